"""The noise of the IMU by allantools and by plain statistics, and the tests themselves by mutation.

Each term has a check that compares samples with what the grade claims. The same checks are then given
samples in which that term was doubled, halved or deleted, and must fail: so they test what they say.
Tolerances: the relative error of an Allan deviation from `edf` equivalent degrees of freedom is
1/sqrt(2 edf), with about 1.5 degrees per averaging time per series for the overlapping estimate of white
noise, and about 1 of slower processes. Each check says how many draws it takes; seeds are fixed.
"""

from collections.abc import Callable
from dataclasses import replace

import allantools
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.recording.sheets.allan import (
    FLICKER_FLOOR,
    GAUSS_MARKOV_PEAK_AT,
    bias_sd,
    gauss_markov_allan,
)
from simrail.recording.sheets.grades import ImuGrade
from simrail.sensors.imu import sample_imu
from simrail.sensors.imu_noise import BLOCK

pytestmark = pytest.mark.long

RATES = (10.0, 100.0, 1000.0)
COLUMNS = {"gyro": list(GYRO), "accel": list(ACCEL)}
UNITS = {"gyro": ("radps", "radpsqrts"), "accel": ("mps2", "mpsqrts")}


def standstill(seconds: float, rate_hz: float) -> pd.DataFrame:
    index = pd.Index(np.arange(round(seconds * rate_hz)) / rate_hz, name="time_s")
    return pd.DataFrame(0.0, index=index, columns=list(IMU))


def sampled(
    grade: ImuGrade, seconds: float, *, draw: int = 0, name: str = "imu", seed: int = 11
) -> pd.DataFrame:
    return sample_imu(standstill(seconds, grade.rate_hz), grade, seed=seed, draw=draw, name=name)[0]


def allan(series: np.ndarray, rate_hz: float, taus: list[float]) -> np.ndarray:
    """Overlapping Allan deviation at exactly the given averaging times."""
    found, deviation, _, _ = allantools.oadev(series, rate=rate_hz, data_type="freq", taus=taus)
    np.testing.assert_allclose(found, taus, rtol=1e-9)
    return deviation


def root_mean_square(values: list[np.ndarray]) -> np.ndarray:
    return np.sqrt(np.mean(np.square(values), axis=0))


# --- checks: what a grade claims against what was sampled ------------------------------------------


def check_white(claimed: ImuGrade, real: ImuGrade, kind: str, *, seconds: float = 1200.0) -> None:
    """Allan deviation N at 1 s within 4 % (sd of the estimate 1 %), and N / sqrt(tau) at 0.1 and 10 s."""
    density = getattr(claimed, f"{kind}_noise_{UNITS[kind][1]}")
    frame = sampled(real, seconds)
    taus = [max(0.1, 1.0 / claimed.rate_hz), 1.0, 10.0]
    found = root_mean_square([allan(frame[c].to_numpy(), claimed.rate_hz, taus) for c in COLUMNS[kind]])
    tolerance = np.maximum(0.04, 4.0 / np.sqrt(2.0 * 1.5 * 3.0 * seconds / np.array(taus)))
    assert np.all(np.abs(found / (density / np.sqrt(taus)) - 1.0) < tolerance)


def check_bias(claimed: ImuGrade, real: ImuGrade, kind: str, *, draws: int, seconds: float = 400.0) -> None:
    """Mean Allan variance of an ensemble within 5 % of the closed form, around the peak and on its slopes."""
    instability = getattr(claimed, f"{kind}_bias_instability_{UNITS[kind][0]}")
    correlation = getattr(claimed, f"{kind}_bias_correlation_s")
    rate = claimed.rate_hz
    taus = [round(x * correlation * rate) / rate for x in (0.4, GAUSS_MARKOV_PEAK_AT, 4.0)]
    other = "accel" if kind == "gyro" else "gyro"
    alone = replace(real, **{f"{other}_bias_instability_{UNITS[other][0]}": 0.0})
    series = [
        sampled(alone, seconds, draw=draw)[c].to_numpy() for draw in range(draws) for c in COLUMNS[kind]
    ]
    found = root_mean_square([allan(values, rate, taus) for values in series])
    expected = gauss_markov_allan(np.array(taus), sd=bias_sd(instability), correlation_s=correlation)
    assert np.all(np.abs(found / expected - 1.0) < 0.05)
    assert abs(found[1] / (FLICKER_FLOOR * instability) - 1.0) < 0.05, "the peak is the data sheet's floor"


def check_random_walk(
    claimed: ImuGrade, real: ImuGrade, kind: str, *, draws: int = 40, seconds: float = 600.0
) -> None:
    """Mean Allan deviation at tau = 30 s of 40 draws, three axes each, within 5 % of K sqrt(tau/3).

    600 s hold 19 averages of 30 s beyond the first, so 120 series leave 1/sqrt(2 * 19 * 120) = 1.5 %.
    Sampling adds 1/(2 m^2) to the variance, m = 30 rate: nothing.
    """
    coefficient = getattr(claimed, f"{kind}_random_walk_{WALK_UNITS[kind]}")
    found = [
        allan(sampled(real, seconds, draw=draw)[c].to_numpy(), claimed.rate_hz, [30.0])[0]
        for draw in range(draws)
        for c in COLUMNS[kind]
    ]
    assert abs(np.mean(found) / (coefficient * np.sqrt(10.0)) - 1.0) < 0.05


def check_flicker(
    claimed: ImuGrade, real: ImuGrade, kind: str, *, draws: int = 30, seconds: float = 400.0
) -> None:
    """Root mean Allan variance of an ensemble within 5 % of 0.664 B over the stated range, and of the closed
    form on both sides of it.

    At the longest time of the floor, 20 s, 19 averages in each of 90 series leave 1.7 %; beyond it, at 80 s,
    4 averages leave 3.7 %, so there the tolerance is 12 %.
    """
    instability = getattr(claimed, f"{kind}_bias_instability_{UNITS[kind][0]}")
    low, high = claimed.flicker_range_s
    taus = [max(low / 10.0, 1.0 / claimed.rate_hz), low, 2.0 * low, np.sqrt(low * high), high, 4.0 * high]
    taus = [max(1, round(tau * claimed.rate_hz)) / claimed.rate_hz for tau in taus]
    series = [sampled(real, seconds, draw=draw)[c].to_numpy() for draw in range(draws) for c in COLUMNS[kind]]
    found = root_mean_square([allan(values, claimed.rate_hz, taus) for values in series])
    floor = FLICKER_FLOOR * instability
    assert np.all(np.abs(found[1:5] / floor - 1.0) < 0.05)
    closed = claimed.allan(np.array(taus))[kind]
    # Below the floor the sampled process is that in continuous time only where tau is many samples long.
    if taus[0] * claimed.rate_hz >= 10.0:
        assert abs(found[0] / closed[0] - 1.0) < 0.05
    assert abs(found[5] / closed[5] - 1.0) < 0.12


def check_turn_on(claimed: ImuGrade, real: ImuGrade, kind: str) -> None:
    """Uniform within the bound (Kolmogorov-Smirnov, 900 values), constant over the ride."""
    bound = getattr(claimed, f"{kind}_turn_on_bias_{UNITS[kind][0]}")
    frames = [sampled(real, 0.04, draw=draw)[COLUMNS[kind]] for draw in range(300)]
    assert all(np.ptp(frame.to_numpy(), axis=0).max() == 0.0 for frame in frames)
    values = np.concatenate([frame.iloc[0].to_numpy() for frame in frames])
    assert np.abs(values).max() <= bound
    assert stats.kstest(values, stats.uniform(-bound, 2.0 * bound).cdf).pvalue > 1e-3


def check_resolution(claimed: ImuGrade, real: ImuGrade, kind: str) -> None:
    size = getattr(claimed, f"{kind}_resolution_{UNITS[kind][0]}")
    counts = sampled(real, 40.0)[COLUMNS[kind]].to_numpy() / size
    assert np.allclose(counts, np.rint(counts), atol=1e-6)
    assert np.min(np.diff(np.unique(np.rint(counts)))) == 1.0


def check_range(claimed: ImuGrade, real: ImuGrade, kind: str) -> None:
    limit = getattr(claimed, f"{kind}_range_{UNITS[kind][0]}")
    values = sampled(real, 40.0)[COLUMNS[kind]].to_numpy()
    assert values.max() == limit
    assert values.min() == -limit


WHITE = ImuGrade("white", 100.0, gyro_noise_radpsqrts=0.02, accel_noise_mpsqrts=0.3)
WANDERING = ImuGrade(
    "wandering",
    10.0,
    gyro_bias_instability_radps=0.004,
    gyro_bias_correlation_s=5.0,
    accel_bias_instability_mps2=0.05,
    accel_bias_correlation_s=5.0,
)
WALK_UNITS = {"gyro": "radpspsqrts", "accel": "mps2psqrts"}
WALKING = ImuGrade("walking", 10.0, gyro_random_walk_radpspsqrts=1e-4, accel_random_walk_mps2psqrts=2e-3)
FLICKERING = ImuGrade(
    "flickering",
    100.0,
    bias_process="flicker",
    flicker_range_s=(1.0, 20.0),
    gyro_bias_instability_radps=0.004,
    accel_bias_instability_mps2=0.05,
)
TURN_ON = ImuGrade("turn_on", 100.0, gyro_turn_on_bias_radps=0.01, accel_turn_on_bias_mps2=0.2)
COARSE = replace(WHITE, gyro_resolution_radps=0.05, accel_resolution_mps2=0.5)
NARROW = replace(WHITE, gyro_range_radps=0.3, accel_range_mps2=4.0)

TERMS: dict[str, tuple[ImuGrade, Callable[..., None], dict[str, object]]] = {
    "noise": (WHITE, check_white, {"seconds": 600.0}),
    "bias_instability": (WANDERING, check_bias, {"draws": 50}),
    "bias_correlation": (WANDERING, check_bias, {"draws": 50}),
    "flicker": (FLICKERING, check_flicker, {"draws": 12}),
    "random_walk": (WALKING, check_random_walk, {}),
    "turn_on_bias": (TURN_ON, check_turn_on, {}),
    "resolution": (COARSE, check_resolution, {}),
    "range": (NARROW, check_range, {}),
}


def field_of(term: str, kind: str) -> str:
    if term == "flicker":
        term = "bias_instability"
    suffixes = {"noise": UNITS[kind][1], "bias_correlation": "s", "random_walk": WALK_UNITS[kind]}
    return f"{kind}_{term}_{suffixes.get(term, UNITS[kind][0])}"


# --- the checks pass -------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ("gyro", "accel"))
@pytest.mark.parametrize("rate", RATES)
def test_white_noise_is_the_allan_coefficient_at_one_second(rate, kind):
    grade = replace(WHITE, rate_hz=rate)
    check_white(grade, grade, kind, seconds=3600.0 if rate == 100.0 else 1200.0)
    sd = sampled(grade, 60.0)[COLUMNS[kind]].to_numpy().std()
    density = getattr(grade, f"{kind}_noise_{UNITS[kind][1]}")
    assert sd == pytest.approx(density * np.sqrt(rate), rel=4.0 / np.sqrt(2.0 * 180.0 * rate) + 1e-3)


def test_white_noise_alone_has_no_random_walk():
    # A random walk of K = N/1000 (one thousandth of N at 1 s) would lift the deviation by 29 % at 1000 s.
    grade = replace(WHITE, rate_hz=10.0)
    values = [
        sampled(grade, 20_000.0, draw=draw)[c].to_numpy() for draw in range(12) for c in COLUMNS["gyro"]
    ]
    found = root_mean_square([allan(series, 10.0, [1000.0]) for series in values])[0]
    assert found == pytest.approx(0.02 / np.sqrt(1000.0), rel=4.0 / np.sqrt(2.0 * 1.5 * 36 * 20.0))


@pytest.mark.parametrize(
    ("rate", "kind"),
    [
        (10.0, "gyro"),
        (10.0, "accel"),
        (100.0, "gyro"),
        pytest.param(100.0, "accel", marks=pytest.mark.slow),
        pytest.param(1000.0, "gyro", marks=pytest.mark.slow),
        pytest.param(1000.0, "accel", marks=pytest.mark.slow),
    ],
)
def test_bias_instability_is_the_closed_form_at_every_rate(rate, kind):
    grade = replace(WANDERING, rate_hz=rate)
    check_bias(grade, grade, kind, draws=50 if rate < 1000.0 else 24)


@pytest.mark.parametrize(
    ("rate", "kind"),
    [
        (10.0, "gyro"),
        (10.0, "accel"),
        (100.0, "gyro"),
        pytest.param(100.0, "accel", marks=pytest.mark.slow),
        pytest.param(1000.0, "gyro", marks=pytest.mark.slow),
        pytest.param(1000.0, "accel", marks=pytest.mark.slow),
    ],
)
def test_random_walk_is_the_allan_coefficient_at_every_rate(rate, kind):
    grade = replace(WALKING, rate_hz=rate)
    check_random_walk(grade, grade, kind)


def test_random_walk_begins_at_zero_and_takes_independent_steps():
    # At 1000 Hz too: 40 draws of one second. Step variance K^2 / rate, to 1/sqrt(2 * 120 000) = 0.2 %.
    grade = replace(WALKING, rate_hz=1000.0)
    walks = np.concatenate([sampled(grade, 1.0, draw=draw)[COLUMNS["gyro"]] for draw in range(40)], axis=1)
    assert (walks[0] == 0.0).all()
    steps = np.diff(walks, axis=0)
    assert steps.std() == pytest.approx(1e-4 / np.sqrt(1000.0), rel=0.01)
    assert abs(np.mean(steps[1:] * steps[:-1]) / np.mean(steps**2)) < 4.0 / np.sqrt(steps.size)
    # None is left out where one block of draws ends and the next begins.
    longer = np.diff(sampled(grade, 5.0)[COLUMNS["gyro"]].to_numpy(), axis=0)
    assert len(longer) > 2 * BLOCK and (longer != 0.0).all()


@pytest.mark.parametrize(
    ("rate", "kind"),
    [
        (10.0, "gyro"),
        (10.0, "accel"),
        (100.0, "gyro"),
        pytest.param(100.0, "accel", marks=pytest.mark.slow),
        pytest.param(1000.0, "gyro", marks=pytest.mark.slow),
        pytest.param(1000.0, "accel", marks=pytest.mark.slow),
    ],
)
def test_flicker_floor_is_flat_at_every_rate(rate, kind):
    grade = replace(FLICKERING, rate_hz=rate)
    check_flicker(grade, grade, kind)


@pytest.mark.parametrize("factor", (2.0, 0.5))
def test_another_range_of_the_floor_is_caught(factor):
    low, high = FLICKERING.flicker_range_s
    with pytest.raises(AssertionError):
        check_flicker(
            FLICKERING, replace(FLICKERING, flicker_range_s=(factor * low, factor * high)), "gyro", draws=12
        )


def test_one_process_in_place_of_flicker_is_caught():
    with pytest.raises(AssertionError):
        check_flicker(FLICKERING, replace(FLICKERING, bias_process="gauss_markov"), "gyro", draws=12)


def test_analytic_allan_deviation_is_that_of_a_device_with_all_of_it():
    # 1 h at 100 Hz, three axes: at 100 s 35 averages each leave 1/sqrt(2 * 105) = 7 %; 3 of those.
    grade = ImuGrade(
        "all",
        100.0,
        bias_process="flicker",
        gyro_noise_radpsqrts=1e-4,
        gyro_bias_instability_radps=5e-5,
        gyro_random_walk_radpspsqrts=5e-6,
        gyro_resolution_radps=2e-3,
        accel_noise_mpsqrts=1e-3,
        accel_bias_instability_mps2=2e-4,
        accel_random_walk_mps2psqrts=5e-6,
        accel_resolution_mps2=2e-2,
    )
    taus = np.array([0.1, 1.0, 10.0, 100.0])
    frame = sampled(grade, 3600.0)
    for kind, expected in grade.allan(taus).items():
        found = root_mean_square([allan(frame[c].to_numpy(), 100.0, list(taus)) for c in COLUMNS[kind]])
        assert np.all(np.abs(found / expected - 1.0) < [0.02, 0.02, 0.07, 0.21])
        parts = replace(grade, **{f"{kind}_resolution_{UNITS[kind][0]}": 0.0}).allan(taus)[kind]
        assert expected[0] > 1.1 * parts[0], "counting is seen"


def test_increments_leave_the_quantisation_of_angles():
    # A count of c rad/s at 100 Hz is c/100 rad of angle: sqrt(3) Q / tau, Q = c / 100 / sqrt(12).
    grade = ImuGrade(
        "angles", 100.0, gyro_noise_radpsqrts=0.01, gyro_resolution_radps=0.2, output="increments"
    )
    taus = np.array([0.01, 0.02, 0.1])
    frame = sampled(grade, 600.0)
    found = root_mean_square([allan(frame[c].to_numpy(), 100.0, list(taus)) for c in COLUMNS["gyro"]])
    np.testing.assert_allclose(found, grade.allan(taus)["gyro"], rtol=0.03)
    by_hand = np.hypot(np.sqrt(3.0) * (0.2 / 100.0 / np.sqrt(12.0)) / taus, 0.01 / np.sqrt(taus))
    np.testing.assert_allclose(grade.allan(taus)["gyro"], by_hand, rtol=1e-12)


@pytest.mark.parametrize("term", ("turn_on_bias", "resolution", "range"))
@pytest.mark.parametrize("kind", ("gyro", "accel"))
def test_other_terms(term, kind):
    grade, check, settings = TERMS[term]
    check(grade, grade, kind, **settings)


def test_bias_is_stationary_from_the_first_sample():
    grade = replace(WANDERING, rate_hz=10.0)
    frames = [sampled(grade, 60.0, draw=draw)[COLUMNS["gyro"]].to_numpy() for draw in range(600)]
    ensemble = np.concatenate(frames, axis=1)
    sd = ensemble.std(axis=1) / bias_sd(grade.gyro_bias_instability_radps)
    # 1800 values each: 1.7 % sd; the first sample, and every later one.
    assert abs(sd[0] - 1.0) < 0.06
    assert abs(sd[[10, 50, 200, -1]] - 1.0).max() < 0.06
    lag = round(grade.gyro_bias_correlation_s * grade.rate_hz)
    correlation = np.mean(ensemble[0] * ensemble[lag]) / np.mean(ensemble[0] ** 2)
    assert correlation == pytest.approx(np.exp(-1.0), abs=4.0 / np.sqrt(1800.0))


# --- correlation -----------------------------------------------------------------------------------


def white_part(frame: pd.DataFrame, grade: ImuGrade) -> np.ndarray:
    """Innovations of a Gauss-Markov sequence (of a white one: itself), so that 4/sqrt(n) applies."""
    values = frame.to_numpy()
    if grade.gyro_random_walk_radpspsqrts > 0.0 or grade.bias_process == "flicker":
        return np.diff(values, axis=0)  # of flicker: nearly white, its neighbours' correlation is -0.1
    if grade.gyro_bias_instability_radps > 0.0:
        return values[1:] - np.exp(-1.0 / (grade.gyro_bias_correlation_s * grade.rate_hz)) * values[:-1]
    return values[1:]


def correlations(grades: tuple[ImuGrade, ...], seeds: tuple[int, ...]) -> np.ndarray:
    """Correlation of all pairs of axes, sensors, draws (and grades, seeds), times sqrt(n): N(0, 1)."""
    series = [
        white_part(sampled(grade, 2000.0, draw=draw, name=name, seed=seed), grade)
        for grade in grades
        for name in ("axle", "body")
        for draw in (0, 1)
        for seed in seeds
    ]
    values = np.concatenate(series, axis=1)
    matrix = np.corrcoef(values.T)
    return matrix[np.triu_indices(len(matrix), 1)] * np.sqrt(len(values))


@pytest.mark.parametrize(
    "grade",
    (replace(WHITE, rate_hz=10.0), WANDERING, WALKING, replace(FLICKERING, rate_hz=10.0)),
    ids=lambda grade: grade.name,
)
def test_axes_sensors_and_draws_are_uncorrelated(grade):
    found = correlations((grade,), (21,))
    assert len(found) == 24 * 23 // 2
    assert np.abs(found).max() < 4.0


def test_terms_and_seeds_are_uncorrelated_too():
    found = correlations((replace(WHITE, rate_hz=10.0), WANDERING, WALKING), (11, 12))
    assert len(found) == 144 * 143 // 2
    # Of 10296 pairs one exceeds 4 by chance every other time: judge the whole distribution, and 5.
    assert np.abs(found).max() < 5.0
    assert stats.kstest(found, "norm").pvalue > 1e-3


def test_turn_on_biases_are_uncorrelated():
    values = np.array(
        [sampled(TURN_ON, 0.04, draw=draw, name=name).iloc[0] for draw in range(400) for name in "ab"]
    )
    correlation = np.corrcoef(values.reshape(400, 12).T)
    assert np.abs(correlation[np.triu_indices(12, 1)]).max() < 4.0 / np.sqrt(400.0)


# --- the checks fail when they should --------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "factor"),
    [
        *(("gyro", factor) for factor in (2.0, 0.5, 0.0)),
        # The checks are the same for both sensors.
        *(pytest.param("accel", factor, marks=pytest.mark.slow) for factor in (2.0, 0.5, 0.0)),
    ],
)
@pytest.mark.parametrize("term", TERMS)
def test_a_term_doubled_halved_or_deleted_is_caught(term, kind, factor):
    claimed, check, settings = TERMS[term]
    field = field_of(term, kind)
    value = getattr(claimed, field) * factor
    if factor == 0.0:
        # Without: no limit, no memory.
        value = {"range": np.inf, "bias_correlation": 1e-9}.get(term, 0.0)
    mutated = replace(claimed, **{field: value})
    with pytest.raises(AssertionError):
        check(claimed, mutated, kind, **settings)
