"""Faults of one axis, one sensor or the time, and a wheel that slips: each is told as what it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.recording.evidence.clipped import weigh_clipped
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.judge import Evidence
from simrail.recording.files.mend import write_mended
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from tests.shared.planted_faults import apart, axis, exchanged, gyro, late, pace, slipping, slow

BASE = Path(__file__).parents[1] / "field" / "cases" / "00-base"


@pytest.fixture(scope="module")
def sound() -> Recording:
    return read_signals(BASE)


def assert_told(evidence: Evidence, key: str, value: float, slack: float, said: str = "") -> None:
    """One figure is wrong, and it is that one, with its size."""
    assert [finding.key for finding in evidence.wrong] == [key]
    found = evidence.of(key)
    assert found.value == pytest.approx(value, abs=slack)
    assert said in found.why and (found.remedy or found.setting)


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("column", "factor"),
    [
        ("gyro_x_radps", 0.5),
        ("accel_y_mps2", 2.0),
        pytest.param("gyro_y_radps", -0.5, marks=LONG),
        pytest.param("gyro_x_radps", 1.1, marks=LONG),
        pytest.param("gyro_y_radps", 2.0, marks=LONG),
        pytest.param("gyro_z_radps", 1.1, marks=LONG),
        pytest.param("gyro_z_radps", 0.5, marks=LONG),
        pytest.param("gyro_z_radps", -2.0, marks=LONG),
        pytest.param("accel_x_mps2", 0.5, marks=LONG),
        pytest.param("accel_x_mps2", -2.0, marks=LONG),
        pytest.param("accel_y_mps2", 0.5, marks=LONG),
        pytest.param("accel_z_mps2", 1.1, marks=LONG),
    ],
)
def test_one_axis_of_another_factor_is_told_alone(column: str, factor: float, sound: Recording) -> None:
    """The slack is three times the sd of the fit (2 %, of the gyro's Y 4 %), of which a part is common."""
    evidence = weigh_all(axis(column)(sound, factor))
    assert_told(
        evidence, f"alone_{column}", factor, (0.12 if "_y_" in column else 0.06) * max(1.0, abs(factor))
    )
    kind = column.partition("_")[0]
    assert evidence.of(f"alone_{column}").setting == f"imu.scale.{kind}"


@pytest.mark.parametrize(
    ("column", "seconds"),
    [
        ("gyro_x_radps", -0.6),
        pytest.param("gyro_z_radps", -0.6, marks=LONG),
        pytest.param("accel_x_mps2", -0.4, marks=LONG),
        pytest.param("accel_y_mps2", 0.6, marks=LONG),
    ],
)
def test_one_column_that_is_late_alone_is_told(column: str, seconds: float, sound: Recording) -> None:
    evidence = weigh_all(late([column])(sound, seconds))
    assert_told(evidence, f"alone_{column}", seconds, 0.1, "late" if seconds < 0.0 else "early")
    assert evidence.of(f"alone_{column}").unit == "s"


@pytest.mark.long
@pytest.mark.parametrize("factor", [0.1, 0.5, 1.1, 2.0, 3.0, 3.6, 10.0])
def test_stamps_of_another_unit_are_no_wheel(factor: float, sound: Recording) -> None:
    """Gyro times accelerometer: curves and push grow by factor and its square, the way does not."""
    assert_told(weigh_all(pace(sound, factor)), "pace", factor, 0.03 * factor, "time stamps run")


@pytest.mark.long
@pytest.mark.parametrize("factor", [0.1, 2.0, 3.0, 10.0])
def test_a_gyro_of_another_factor_is_no_pace_of_the_stamps(factor: float, sound: Recording) -> None:
    """The push and what curves leave do not grow with it."""
    evidence = weigh_all(gyro(sound, factor))
    assert [finding.key for finding in evidence.wrong] == ["gyro"]
    assert evidence.of("gyro").value == pytest.approx(factor, rel=0.1)


@pytest.mark.parametrize("share", [0.04, pytest.param(-0.03, marks=LONG)])
def test_an_imu_of_another_rate_is_told_with_it(share: float, sound: Recording) -> None:
    """Its stamps are counted at a rate that is greater by that share; those of the encoder are right."""
    imu = sound.imu.set_axis(pd.Index(sound.imu.index.to_numpy() / (1.0 + share), name="time_s"), axis=0)
    sheet = replace(sound.imu_sheet, rate_hz=sound.imu_sheet.rate_hz * (1.0 + share))
    evidence = weigh_all(replace(sound, imu=imu, imu_sheet=sheet))
    (found,) = evidence.wrong
    assert found.key == "drift" and found.value == pytest.approx(-1e6 * share, abs=2000.0)
    assert f"{sound.imu_sheet.rate_hz:.3g} Hz" in found.remedy and not found.setting


@pytest.mark.long
@pytest.mark.parametrize("column", ["gyro_z_radps", "gyro_x_radps", "accel_y_mps2"])
def test_an_offset_that_grows_is_no_factor_and_no_clock(column: str, sound: Recording) -> None:
    size = 0.05 if column in GYRO else 1.0
    grown = sound.imu[column] + np.linspace(0.0, size, len(sound.imu))
    (found,) = weigh_all(replace(sound, imu=sound.imu.assign(**{column: grown}))).wrong
    assert found.key == f"ramp_{column}"
    assert found.value == pytest.approx(np.degrees(size) if column in GYRO else size, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize(("columns", "key"), [(GYRO, "cut_gyro"), (ACCEL[:2], "cut_accel")])
def test_a_filter_that_takes_off_what_is_slow_is_told_with_its_corner(
    columns: tuple[str, ...], key: str, sound: Recording
) -> None:
    passed = slow(columns)(sound, 5.0).imu
    imu = sound.imu.assign(**{name: sound.imu[name] - passed[name] for name in columns})
    (found,) = weigh_all(replace(sound, imu=imu)).wrong
    assert found.key == key and found.value == pytest.approx(0.2, rel=0.05)


@pytest.mark.long
def test_a_ride_that_no_single_mistake_explains_is_not_mended_by_figures(sound: Recording) -> None:
    """A mean over three seconds: speeds, places and clocks come out wrong, and none of them is."""
    smooth = sound.imu.rolling(61, center=True, min_periods=1).mean()
    (found,) = weigh_all(replace(sound, imu=smooth)).wrong
    assert found.key == "at_once" and not found.setting and "filter" in found.remedy


@pytest.mark.long
@pytest.mark.parametrize(("columns", "key"), [(GYRO, "slow_gyro"), (ACCEL, "slow_accel")])
def test_a_low_pass_is_no_clock(columns: tuple[str, ...], key: str, sound: Recording) -> None:
    evidence = weigh_all(slow(columns)(sound, 0.5))
    assert_told(evidence, key, 0.5, 0.1, "low-pass of 0.3")


@pytest.mark.parametrize(
    ("about", "degrees"),
    [
        (2, 5.0),
        *(pytest.param(*planted, marks=LONG) for planted in [(0, -4.0), (1, 15.0), (2, -45.0), (0, 45.0)]),
    ],
)
def test_a_gyro_that_is_turned_against_its_accelerometer_is_told_and_mended(
    about: int, degrees: float, sound: Recording, tmp_path: Path
) -> None:
    """Two boards of one box. The slack is four times the sd of the fit, a quarter of a degree."""
    evidence = weigh_all(apart(about)(sound, degrees))
    angle = ("roll", "pitch", "yaw")[about]
    assert_told(evidence, f"gyro_{angle}", degrees, 1.0, "turned by")
    (tmp_path / "ride.csv").write_text((BASE / "ride.csv").read_text())
    (tmp_path / "ride.toml").write_text((BASE / "ride.toml").read_text())
    (change,) = write_mended(tmp_path / "ride.toml", evidence, tmp_path / "mended.toml")
    assert change.startswith(f"imu.gyro.{angle}_deg")
    # The file is sound, and so its gyro is turned the other way by what mends the planted one.
    back = apart(about)(sound, -evidence.of(f"gyro_{angle}").value)
    read = read_signals(tmp_path / "mended.toml")
    np.testing.assert_allclose(read.imu, back.imu, atol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize(
    ("columns", "key"),
    [
        (("gyro_x_radps", "gyro_y_radps"), "order_gyro"),
        pytest.param(("gyro_x_radps", "gyro_z_radps"), "order_gyro", marks=LONG),
        pytest.param(("accel_x_mps2", "accel_y_mps2"), "order_accel", marks=LONG),
        pytest.param(("accel_y_mps2", "accel_z_mps2"), "order_accel", marks=LONG),
    ],
)
def test_columns_in_another_order_are_named(columns: tuple[str, str], key: str, sound: Recording) -> None:
    evidence = weigh_all(exchanged(sound, *columns))
    assert [finding.key for finding in evidence.wrong] == [key]
    first, second = (name.split("_")[1].upper() for name in columns)
    assert f"{first} stands as {second}, {second} stands as {first}" in evidence.of(key).why


def test_a_device_that_is_cut_off_for_some_samples_is_told_with_its_end(sound: Recording) -> None:
    assert weigh_clipped(sound) == ()
    greatest = 0.7 * float(sound.imu["gyro_x_radps"].abs().max())
    imu = sound.imu.assign(gyro_x_radps=sound.imu["gyro_x_radps"].clip(-greatest, greatest))
    (found,) = weigh_clipped(replace(sound, imu=imu))
    assert found.key == "clipped_gyro_x_radps" and abs(found.value) == pytest.approx(greatest)
    assert "saturated" in found.why and "range" in found.remedy
    computed = replace(sound.imu_sheet, gyro_noise_radpsqrts=0.0)
    assert weigh_clipped(replace(sound, imu=imu, imu_sheet=computed)) == ()


@pytest.mark.long
def test_a_wheel_that_slips_is_no_fault_of_the_file(sound: Recording) -> None:
    """It spins up by 1.5 m/s for four seconds: 5 m of way that the train did not go."""
    evidence = weigh_all(slipping(sound, 1.5))
    assert not evidence.wrong
    assert evidence.of("wheel").value == pytest.approx(1.0, abs=0.05)


@pytest.mark.long
def test_an_axis_whose_gyro_and_accelerometer_come_late_is_told_once(sound: Recording) -> None:
    columns = ("gyro_y_radps", "accel_y_mps2")
    evidence = weigh_all(late(columns)(sound, -0.6))
    assert_told(evidence, "together_y", -0.6, 0.06, "Y of gyro and accelerometer")
    assert evidence.of("together_y").field == ", ".join(f"imu.{name}" for name in columns)


@pytest.mark.long
def test_an_accelerometer_without_its_sign_is_told_by_what_push_lets_expect(sound: Recording) -> None:
    """It passes 0 too fast to tell. Of curves of one side an accelerometer has one sign."""
    without = sound.imu.assign(**{name: sound.imu[name].abs() for name in ACCEL})
    (found,) = weigh_all(replace(sound, imu=without)).wrong
    assert found.key == "unsigned_accel_x_mps2" and "its sign is lost" in found.why
    shifted = replace(sound, imu=sound.imu.assign(accel_x_mps2=sound.imu["accel_x_mps2"] + 1.0))
    assert not weigh_clipped(shifted)


@pytest.mark.parametrize("column", ["gyro_x_radps", *(pytest.param(name, marks=LONG) for name in GYRO[1:])])
def test_an_axis_without_its_sign_is_told_as_that(column: str, sound: Recording) -> None:
    evidence = weigh_all(replace(sound, imu=sound.imu.assign(**{column: sound.imu[column].abs()})))
    (found,) = evidence.wrong
    assert found.key == f"unsigned_{column}" and found.verdict == "surely wrong"
    assert "never below" in found.why and "with its sign" in found.remedy
    # Gravity never changes its sign, and an axis that only ends at 0 has few samples there.
    assert not weigh_clipped(sound)
    ending = sound.imu[column] - sound.imu[column].min()
    told = weigh_clipped(replace(sound, imu=sound.imu.assign(**{column: ending})))
    assert not any(finding.key.startswith("unsigned") for finding in told)


@pytest.mark.long
def test_factors_of_single_columns_are_written_and_mend_the_ride(sound: Recording, tmp_path: Path) -> None:
    """The Y of the body is minus the y of the device: the column is found through its axes."""
    frame = np.genfromtxt(BASE / "ride.csv", delimiter=",", names=True)
    frame["wy"] *= -0.5
    names = frame.dtype.names
    assert names is not None
    rows = "\n".join(",".join(f"{value:.6g}" for value in row) for row in frame)
    (tmp_path / "ride.csv").write_text(f"{','.join(names)}\n{rows}\n")
    (tmp_path / "ride.toml").write_text((BASE / "ride.toml").read_text())
    out = tmp_path / "mended.toml"
    (change,) = write_mended(tmp_path, weigh_all(read_signals(tmp_path)), out)
    assert change.startswith("imu.scale.gyro = [1.0, -")
    mended = read_signals(out)
    off = mended.imu["gyro_y_radps"] - sound.imu["gyro_y_radps"]
    assert float(np.sqrt(np.mean(off**2))) < 5e-4
    np.testing.assert_allclose(mended.imu["gyro_z_radps"], sound.imu["gyro_z_radps"], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("factors", ["[1.0, 2.0]", "[1.0, 0.0, 1.0]", "-1.0"])
def test_factors_that_are_none_are_refused(factors: str, tmp_path: Path) -> None:
    (tmp_path / "ride.csv").write_text((BASE / "ride.csv").read_text())
    ride = (
        (BASE / "ride.toml").read_text().replace("[imu.units]", f"[imu.scale]\ngyro = {factors}\n[imu.units]")
    )
    (tmp_path / "ride.toml").write_text(ride)
    with pytest.raises(InputError, match=r"scale") as refused:
        read_signals(tmp_path)
    assert "\n" not in str(refused.value)
