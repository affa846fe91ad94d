"""A rest gives back the figures that were planted in it; what moves is refused."""

from __future__ import annotations

import math
from collections.abc import Callable

import allantools
import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.core.errors import InputError
from simrail.core.toml_files import judge, parse_toml
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuFile
from simrail.recording.sheets.rest_fit import TERMS, TriadFit, count_of, fit_rest
from simrail.recording.sheets.rest_sheet import fitted_lines, not_shown, sheet_text
from simrail.sensors.imu import sample_imu

RATE = 20.0
HOURS = 3600.0


def at_rest(grade: ImuGrade, seconds: float, seed: int = 1) -> pd.DataFrame:
    index = pd.Index(np.arange(round(seconds * grade.rate_hz)) / grade.rate_hz, name="time_s")
    motion = pd.DataFrame(0.0, index=index, columns=list(IMU)).assign(**{ACCEL[2]: 9.81})
    return sample_imu(motion, grade, seed=seed, draw=0, name="imu")[0]


def device(**more: object) -> ImuGrade:
    figures: dict[str, object] = {"gyro_noise_degpsqrthz": 0.005, "accel_noise_ugpsqrthz": 100.0}
    return ImuGrade.from_datasheet("planted", RATE, **(figures | more))


def again(fits: dict[str, TriadFit]) -> ImuGrade:
    """The grade of the sheet that is written."""
    text = sheet_text(fits, title="mine", source="a rest", rate_hz=RATE, seconds=1200.0)
    return judge(ImuFile, parse_toml(text, file="x"), file="x").grade("again")


def test_white_noise_and_counts_are_found_in_minutes() -> None:
    """N of each axis within its interval, twice as wide; the count exactly; and nothing else is seen."""
    grade = device(gyro_axis_noise=(0.5, 0.75, 1.0), gyro_resolution_degps=0.008, accel_resolution_mg=0.1)
    fits = fit_rest(at_rest(grade, 1200.0), RATE)
    for kind, count in (("gyro", math.radians(0.008)), ("accel", 1e-4 * 9.80665)):
        assert fits[kind].count == pytest.approx(count, rel=1e-6)
        shares = grade.gyro_axis_noise if kind == "gyro" else grade.accel_axis_noise
        for axis, share in zip(fits[kind].axes, shares, strict=True):
            noise = axis["noise"]
            assert noise.low <= noise.value <= noise.high < 1.1 * noise.value
            assert abs(noise.value - share * grade.triad(kind).noise) < 2.0 * (noise.high - noise.low)
            assert not any(axis[term].seen for term in TERMS[1:])
    written = again(fits)
    assert written.gyro_axis_noise == pytest.approx((0.5, 0.75, 1.0), rel=0.05)
    assert written.accel_axis_noise == (1.0, 1.0, 1.0)
    assert written.gyro_resolution_radps == pytest.approx(math.radians(0.008), rel=1e-3)
    assert written.gyro_bias_instability_radps == 0.0
    assert any("No bias instability B of the gyro" in one for one in not_shown(fits, 1200.0))
    assert any(line.startswith("gyro noise N: x 0.0025") for line in fitted_lines(fits, 1200.0))


@pytest.mark.slow
@pytest.mark.parametrize("process", ["flicker", "gauss_markov"])
def test_planted_figures_come_back_within_a_tenth(process: str) -> None:
    """Eight hours: N within 1 %, B and K within 10 %, in the mean over six devices; intervals hold them."""
    grade = device(
        bias_process=process,
        flicker_range_s=(1.0, 20000.0),
        gyro_bias_correlation_s=30.0,
        accel_bias_correlation_s=30.0,
        gyro_bias_instability_degph=10.0,
        accel_bias_instability_mg=0.04,
        gyro_random_walk_degphpsqrth=60.0,
        accel_random_walk_mgpsqrth=0.5,
    )
    found: dict[tuple[str, str], list[float]] = {}
    inside = []
    for seed in range(6):
        for kind, fit in fit_rest(at_rest(grade, 8.0 * HOURS, seed), RATE).items():
            for term in TERMS[:3]:
                true = getattr(grade.triad(kind), term)
                found.setdefault((kind, term), []).append(fit.mean(term) / true)
                # Planted 1/f noise ends at 1 s: within half a per cent it is no white noise there.
                slack = 0.01 if term == "noise" else 0.0
                inside += [
                    axis[term].low * (1.0 - slack) <= true <= axis[term].high * (1.0 + slack)
                    for axis in fit.axes
                ]
            assert (fit.correlation_s is None) == (process == "flicker")
    for (_, term), ratios in found.items():
        assert np.mean(ratios) == pytest.approx(1.0, abs=0.01 if term == "noise" else 0.1)
    # Of 108 intervals at 95 %, with those of a triad not independent.
    assert np.mean(inside) > 0.85


@pytest.mark.slow
def test_noise_of_allantools_comes_back() -> None:
    """White of one-sided density b has N^2 = b / 2, brown of density b / f^2 has K^2 = 2 pi^2 b."""
    count, white, brown = 400_000, 2e-8, 1e-12
    np.random.seed(5)  # noqa: NPY002
    values = np.column_stack(
        [
            allantools.noise.white(num_points=count, b0=white, fs=RATE)
            + allantools.noise.brown(num_points=count, b_minus2=brown, fs=RATE)[:count]
            for _ in range(6)
        ]
    )
    index = pd.Index(np.arange(count) / RATE, name="time_s")
    imu = pd.DataFrame(values, index=index, columns=list(IMU))
    imu[ACCEL[2]] += 9.81
    for fit in fit_rest(imu, RATE).values():
        assert fit.mean("noise") == pytest.approx(math.sqrt(white / 2.0), rel=0.01)
        assert fit.mean("random_walk") == pytest.approx(math.pi * math.sqrt(2.0 * brown), rel=0.1)


def test_counts_of_an_angle_are_the_quantisation_of_ieee_952() -> None:
    """While it turns through many counts, Q is a count over sqrt(12)."""
    grade = device(
        gyro_noise_degpsqrthz=1e-4,
        gyro_turn_on_bias_degps=0.9,
        gyro_resolution_degps=0.02,
        accel_resolution_mg=0.01,
        output="increments",
    )
    fits = fit_rest(at_rest(grade, 600.0, seed=3), RATE)
    expected = math.radians(0.02) / RATE / math.sqrt(12.0)
    assert fits["gyro"].mean("quantisation") == pytest.approx(expected, rel=0.1)
    written = again(fits)
    assert written.output == "increments"
    assert written.gyro_resolution_radps == pytest.approx(math.radians(0.02), rel=0.1)


def test_a_filter_of_the_device_is_not_taken_for_its_noise() -> None:
    """A mean over four samples leaves the density at long times, and less at short ones."""
    imu = at_rest(device(), 2400.0)
    filtered = imu.rolling(4).mean().iloc[3:]
    noise = fit_rest(filtered, RATE)["gyro"].mean("noise")
    assert noise == pytest.approx(device().gyro_noise_radpsqrts, rel=0.05)


def test_a_count_is_only_where_all_steps_are_whole() -> None:
    draw = np.random.default_rng(1).standard_normal((2000, 3))
    assert count_of(draw) == 0.0
    assert count_of(np.round(draw, 1) * 0.3) == pytest.approx(0.03)
    assert count_of(np.zeros((10, 3))) == 0.0


def _leap(imu: pd.DataFrame) -> None:
    imu.loc[100.0:, ACCEL[0]] += 0.05


def _turn(imu: pd.DataFrame) -> None:
    imu.loc[100.0:110.0, GYRO[2]] += 0.02


def _sway(imu: pd.DataFrame) -> None:
    imu[ACCEL[1]] += 0.3 * np.sin(0.9 * imu.index.to_numpy())


def _units(imu: pd.DataFrame) -> None:
    imu[list(ACCEL)] /= 9.80665


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_leap, (ACCEL[0], "time_s = 100")),
        (_turn, (GYRO[2], "not at rest")),
        (_sway, (ACCEL[1], "not at rest")),
        (_units, ("gravity", "units.accel")),
    ],
)
def test_what_moves_is_refused_in_one_line(
    change: Callable[[pd.DataFrame], None], words: tuple[str, ...]
) -> None:
    imu = at_rest(device(), 200.0)
    change(imu)
    with pytest.raises(InputError) as raised:
        fit_rest(imu, RATE)
    said = str(raised.value)
    assert "\n" not in said
    for word in words:
        assert word in said


def test_too_short_a_rest_is_refused() -> None:
    with pytest.raises(InputError, match="too short"):
        fit_rest(at_rest(device(), 30.0), RATE)
