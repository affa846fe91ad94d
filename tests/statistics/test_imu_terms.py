"""Every term of an IMU that is not noise, against its closed form; and the tests themselves by mutation.

A check takes what a grade claims and samples of what is real. It passes when they are the same, and must
fail when the real one has the term doubled, halved or deleted. Constants of a device are uniform within
their bound: the Kolmogorov-Smirnov test judges 150 to 900 draws of them (5e-4 of false alarm each, and
the seeds are fixed), and none may lie beyond the bound. What is no random variable is judged to rounding,
or to the tolerance that the check derives.

The truth is sampled at its own rate, where no filter comes between, unless the check is about filters.
"""

import math
from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.recording.sheets.grades import ImuGrade
from simrail.sensors.imu import arrived, sample_imu
from simrail.sensors.imu_response import Temperature

COLUMNS = {"gyro": list(GYRO), "accel": list(ACCEL)}
KINDS = ("gyro", "accel")
HOT = Temperature(45.0, 45.0)
DRAWS = 100


def motion(values: np.ndarray, rate_hz: float = 1000.0) -> pd.DataFrame:
    index = pd.Index(np.arange(len(values)) / rate_hz, name="time_s")
    return pd.DataFrame(np.asarray(values, dtype=np.float64), index=index, columns=list(IMU))


def sampled(
    grade: ImuGrade, truth: pd.DataFrame, *, draw: int = 0, temperature: Temperature | None = None
) -> pd.DataFrame:
    return sample_imu(truth, grade, seed=5, draw=draw, name="imu", temperature=temperature)[0]


def basis(size: float = 1.0) -> pd.DataFrame:
    """Six samples: each axis of each triad by itself."""
    return motion(size * np.eye(6))


def matrices(grade: ImuGrade, truth: pd.DataFrame, draw: int, **more: object) -> np.ndarray:
    """Output per input (6, 6) of one device, from its answer to `basis`."""
    size = truth.to_numpy().max()
    return sampled(grade, truth, draw=draw, **more).to_numpy().T / size


def assert_uniform(values: np.ndarray, bound: float) -> None:
    values = np.ravel(values)
    assert len(values) >= 150
    assert np.abs(values).max() <= bound * (1.0 + 1e-6)
    assert stats.kstest(values, stats.uniform(-bound, 2.0 * bound).cdf).pvalue > 5e-4


# --- checks: (claimed, real, kind) -----------------------------------------------------------------


def check_scale(claimed, real, kind):
    at = 3 * KINDS.index(kind)
    found = [np.diag(matrices(real, basis(), draw))[at : at + 3] - 1.0 for draw in range(DRAWS)]
    assert_uniform(np.array(found), getattr(claimed, f"{kind}_scale_error"))


def check_nonlinearity(claimed, real, kind):
    unit = "radps" if kind == "gyro" else "mps2"
    full = getattr(claimed, f"{kind}_range_{unit}")
    steps = np.array([-1.0, -1.0 / math.sqrt(3.0), 0.0, 1.0 / math.sqrt(3.0), 1.0])
    truth = motion(full * np.repeat(steps[:, None], 6, axis=1))
    wrong = []
    for draw in range(DRAWS):
        wrong.append(((sampled(real, truth, draw=draw) - truth)[COLUMNS[kind]] / full).to_numpy())
    bent = np.array(wrong)
    assert_uniform(bent[:, 3], getattr(claimed, f"{kind}_nonlinearity"))
    np.testing.assert_allclose(bent[:, 1], -bent[:, 3], atol=1e-12)
    np.testing.assert_allclose(bent[:, (0, 2, 4)], 0.0, atol=1e-12)


def check_package(claimed, real, kind):
    turns = []
    for draw in range(DRAWS):
        both = matrices(real, basis(), draw)
        np.testing.assert_allclose(both[:3, :3], both[3:, 3:], atol=1e-14, err_msg="one package, one turn")
        turn = both[:3, :3].T
        np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=1e-14)
        turns.append(
            [math.atan2(turn[2, 1], turn[2, 2]), -math.asin(turn[2, 0]), math.atan2(turn[1, 0], turn[0, 0])]
        )
    assert_uniform(np.array(turns), claimed.package_misalignment_rad)


def check_nonorthogonality(claimed, real, kind):
    at = 3 * KINDS.index(kind)
    leans = []
    for draw in range(DRAWS):
        axes = matrices(real, basis(), draw)[at : at + 3, at : at + 3]
        np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)
        assert axes[0, 1] == axes[0, 2] == axes[1, 2] == 0.0
        leans.append([axes[1, 0] / axes[1, 1], axes[2, 0] / axes[2, 2], axes[2, 1] / axes[2, 2]])
    assert_uniform(np.array(leans), getattr(claimed, f"{kind}_nonorthogonality_rad"))


def check_g_sensitivity(claimed, real, kind):
    found = [matrices(real, basis(), draw)[:3, 3:] for draw in range(DRAWS)]
    assert_uniform(np.array(found), claimed.gyro_g_sensitivity_radspm)


VIBRATION_HZ, AMPLITUDE = 100.0, (1.0, 2.0, 3.0)


def shaking(seconds: float) -> pd.DataFrame:
    t = np.arange(round(1000.0 * seconds)) / 1000.0
    values = np.zeros((len(t), 6))
    values[:, 3:] = np.array(AMPLITUDE) * np.sin(2.0 * np.pi * VIBRATION_HZ * t)[:, None]
    values[:, 5] += 9.81
    return motion(values)


def rectified(grade: ImuGrade, kind: str, draw: int, seconds: float) -> np.ndarray:
    """Bias (n, 3) over half the mean square of the amplitude: what the vibration adds."""
    truth = shaking(seconds)
    added = (sampled(grade, truth, draw=draw) - truth)[COLUMNS[kind]].to_numpy()
    return added / (0.5 * np.square(AMPLITUDE))


def check_rectification(claimed, real, kind):
    unit = "rads3pm2" if kind == "gyro" else "s2pm"
    bound = getattr(claimed, f"{kind}_vibration_rectification_{unit}")
    # Ten time constants, then the mean of the last ten periods. The running mean takes 1/(2 pi f T)^2 =
    # 1e-3 of the mean square; gravity is no vibration.
    found = [rectified(real, kind, draw, 0.6)[-100:].mean(axis=0) for draw in range(DRAWS)]
    assert_uniform(np.array(found), bound)


def check_vibration_averaging(claimed, real, kind):
    # It comes on like 1 - exp(-t/T): 63 % after one time constant. Ripple of the mean square: 1/(4 pi f T).
    grown = rectified(real, kind, 0, 20.0 * claimed.vibration_averaging_s)
    period = round(1000.0 / VIBRATION_HZ)
    middle = round(1000.0 * claimed.vibration_averaging_s)
    around = grown[middle - period // 2 : middle + period // 2].mean(axis=0)
    with np.errstate(invalid="ignore"):  # a deleted one never grows
        share = around / grown[-100:].mean(axis=0)
    np.testing.assert_allclose(share, 1.0 - math.exp(-1.0), atol=0.03)


def check_bias_temperature(claimed, real, kind):
    unit = "radpspk" if kind == "gyro" else "mps2pk"
    truth = motion(np.zeros((2, 6)))
    found = [
        sampled(real, truth, draw=d, temperature=HOT)[COLUMNS[kind]].iloc[0] / 20.0 for d in range(DRAWS)
    ]
    assert_uniform(np.array(found), getattr(claimed, f"{kind}_bias_temperature_{unit}"))


def check_scale_temperature(claimed, real, kind):
    at = 3 * KINDS.index(kind)
    found = [
        (np.diag(matrices(real, basis(), draw, temperature=HOT))[at : at + 3] - 1.0) / 20.0
        for draw in range(DRAWS)
    ]
    assert_uniform(np.array(found), getattr(claimed, f"{kind}_scale_temperature_1pk"))


def tone(frequency_hz: float, rate_hz: float, seconds: float) -> pd.DataFrame:
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    return motion(np.repeat(np.sin(2.0 * np.pi * frequency_hz * t)[:, None], 6, axis=1), rate_hz)


def fitted(frame: pd.DataFrame, frequency_hz: float) -> complex:
    """Amplitude and phase of a tone in the second half of a signal: 1 for sin(2 pi f t)."""
    half = frame.iloc[len(frame) // 2 :]
    t = half.index.to_numpy()
    waves = np.column_stack([np.sin(2.0 * np.pi * frequency_hz * t), np.cos(2.0 * np.pi * frequency_hz * t)])
    (a, b), *_ = np.linalg.lstsq(waves, half.to_numpy()[:, 0], rcond=None)
    return complex(a, b)


def check_bandwidth(claimed, real, kind):
    triad = kind or "gyro"
    corner = claimed.bandwidth_of(triad)
    columns = list(ACCEL if triad == "accel" else GYRO)
    assert abs(fitted(sampled(real, tone(corner, 1000.0, 2.0))[columns], corner)) == pytest.approx(
        math.sqrt(0.5), rel=1e-3
    )
    slow = fitted(sampled(real, tone(2.0, 1000.0, 4.0))[columns], 2.0)
    # Of second order in f / corner: below 1 % at 2 of 50 Hz.
    assert -np.angle(slow) / (2.0 * np.pi * 2.0) == pytest.approx(claimed.lag_s, rel=0.01)


def check_oversampling(claimed, real, kind):
    # The mean of M samples spans (M - 1) / (M rate): half of it is the lag of a tone of any frequency, and
    # its gain is sin(M x) / (M sin x), x = pi f / (M rate).
    frequency, m = 60.0, claimed.oversampling
    found = fitted(sampled(real, tone(frequency, 2000.0, 2.0)), frequency)
    assert -np.angle(found) / (2.0 * np.pi * frequency) == pytest.approx(claimed.lag_s, rel=1e-3)
    x = np.pi * frequency / (m * claimed.rate_hz)
    assert abs(found) == pytest.approx(np.sin(m * x) / (m * np.sin(x)), rel=2e-3)


RAMP = 50.0


def ramp(seconds: float, rate_hz: float = 1000.0) -> pd.DataFrame:
    t = np.arange(round(rate_hz * seconds)) / rate_hz
    return motion(np.repeat(RAMP * t[:, None], 6, axis=1), rate_hz)


def check_jitter(claimed, real, kind):
    frame = sampled(real, ramp(10.0))
    late = frame.to_numpy() / RAMP - frame.index.to_numpy()[:, None]
    np.testing.assert_allclose(late, np.repeat(late[:, :1], 6, axis=1), atol=1e-12)
    # 9900 samples: 0.7 % standard deviation of the standard deviation, 1 % of the mean.
    assert late[:, 0].std() == pytest.approx(claimed.clock_jitter_s, rel=0.03)
    assert abs(late[:, 0].mean()) < 0.04 * claimed.clock_jitter_s
    assert stats.kstest(late[:, 0] / claimed.clock_jitter_s, "norm").pvalue > 5e-4


def check_drift(claimed, real, kind):
    found = []
    for draw in range(150):
        frame = sampled(real, ramp(0.2), draw=draw).loc[0.01:]
        t = frame.index.to_numpy()
        drift = frame.to_numpy()[:, 0] / (RAMP * t) - 1.0
        # The interpolator of a device at the truth's own rate is true to 1e-9 s here.
        np.testing.assert_allclose(drift, drift[0], atol=1e-7, err_msg="one drift per device")
        found.append(drift[0])
    assert_uniform(np.array(found), claimed.clock_drift)


def losses(grade: ImuGrade, count: int = 40_000) -> np.ndarray:
    truth = motion(np.zeros((count, 6)))
    came = arrived(truth, grade, seed=5, draw=0, name="imu")
    return ~truth.index.isin(came.index)


def check_dropped_fraction(claimed, real, kind):
    share, burst = claimed.dropped_fraction, claimed.dropped_burst
    lost = losses(real)
    # Variance of a two-state chain's mean: p (1 - p) / n times (1 + r) / (1 - r), r = 1 - begin - end.
    begin = share / (1.0 - share) / burst
    r = 1.0 - begin - 1.0 / burst
    sd = math.sqrt(share * (1.0 - share) / len(lost) * (1.0 + r) / (1.0 - r))
    assert abs(lost.mean() - share) < 4.0 * sd
    assert not lost[:2].any()
    assert not lost[-2:].any()


def check_dropped_burst(claimed, real, kind):
    lost = losses(real).astype(int)
    starts = np.flatnonzero(np.diff(lost) == 1)
    lengths = np.flatnonzero(np.diff(lost) == -1) - starts
    mean = claimed.dropped_burst
    # Geometric: standard deviation sqrt(mean (mean - 1)).
    assert abs(lengths.mean() - mean) < 4.0 * math.sqrt(mean * (mean - 1.0) / len(lengths)) + 1e-9


def check_output(claimed, real, kind):
    # The sum of what increments say is never further than half a count from the true angle, at any time;
    # rates, rounded one by one, lose what is below half a count for good.
    size = claimed.gyro_resolution_radps
    truth = motion(np.full((4000, 6), 0.3 * size))
    wrong = np.cumsum(sampled(real, truth).to_numpy() - truth.to_numpy(), axis=0)[:, 0]
    assert np.abs(wrong).max() <= 0.5 * size * (1.0 + 1e-6)


# --- terms -----------------------------------------------------------------------------------------

PLAIN = ImuGrade("plain", 1000.0)


def both(**values: float) -> ImuGrade:
    """A grade with a term in both triads, by its name without the triad."""
    return replace(PLAIN, **{f"{kind}_{name}": value for name, value in values.items() for kind in KINDS})


SHAKEN = replace(
    PLAIN,
    gyro_vibration_rectification_rads3pm2=1e-3,
    accel_vibration_rectification_s2pm=1e-2,
    vibration_averaging_s=0.05,
)
BENT = replace(
    PLAIN, gyro_range_radps=5.0, accel_range_mps2=50.0, gyro_nonlinearity=1e-3, accel_nonlinearity=1e-3
)
WARM = replace(PLAIN, gyro_bias_temperature_radpspk=1e-4, accel_bias_temperature_mps2pk=1e-3)
BURSTS = replace(PLAIN, dropped_fraction=0.1, dropped_burst=5.0)

TERMS: dict[str, tuple[ImuGrade, Callable[..., None], str]] = {
    "gyro_scale_error": (both(scale_error=0.01), check_scale, "gyro"),
    "accel_scale_error": (both(scale_error=0.01), check_scale, "accel"),
    "gyro_nonlinearity": (BENT, check_nonlinearity, "gyro"),
    "accel_nonlinearity": (BENT, check_nonlinearity, "accel"),
    "package_misalignment_rad": (replace(PLAIN, package_misalignment_rad=0.01), check_package, ""),
    "gyro_nonorthogonality_rad": (both(nonorthogonality_rad=0.01), check_nonorthogonality, "gyro"),
    "accel_nonorthogonality_rad": (both(nonorthogonality_rad=0.01), check_nonorthogonality, "accel"),
    "gyro_g_sensitivity_radspm": (replace(PLAIN, gyro_g_sensitivity_radspm=1e-4), check_g_sensitivity, ""),
    "gyro_vibration_rectification_rads3pm2": (SHAKEN, check_rectification, "gyro"),
    "accel_vibration_rectification_s2pm": (SHAKEN, check_rectification, "accel"),
    "vibration_averaging_s": (SHAKEN, check_vibration_averaging, "accel"),
    "gyro_bias_temperature_radpspk": (WARM, check_bias_temperature, "gyro"),
    "accel_bias_temperature_mps2pk": (WARM, check_bias_temperature, "accel"),
    "gyro_scale_temperature_1pk": (both(scale_temperature_1pk=1e-4), check_scale_temperature, "gyro"),
    "accel_scale_temperature_1pk": (both(scale_temperature_1pk=1e-4), check_scale_temperature, "accel"),
    "bandwidth_hz": (replace(PLAIN, bandwidth_hz=50.0), check_bandwidth, ""),
    "gyro_bandwidth_hz": (replace(PLAIN, gyro_bandwidth_hz=50.0), check_bandwidth, "gyro"),
    "accel_bandwidth_hz": (replace(PLAIN, accel_bandwidth_hz=50.0), check_bandwidth, "accel"),
    "oversampling": (ImuGrade("mean", 250.0, oversampling=4), check_oversampling, ""),
    "clock_jitter_s": (replace(PLAIN, clock_jitter_s=2e-5), check_jitter, ""),
    "clock_drift": (replace(PLAIN, clock_drift=1e-4), check_drift, ""),
    "dropped_fraction": (BURSTS, check_dropped_fraction, ""),
    "dropped_burst": (BURSTS, check_dropped_burst, ""),
    "output": (replace(PLAIN, output="increments", gyro_resolution_radps=0.01), check_output, ""),
}

IN_TEST_IMU_NOISE = ("noise", "instability", "correlation", "random_walk", "turn_on", "range", "resolution")


def test_every_term_of_a_grade_has_a_check():
    not_terms = {"name", "rate_hz", "source", "assumed", "bias_process"}
    for field in fields(ImuGrade):
        elsewhere = any(part in field.name for part in IN_TEST_IMU_NOISE)
        assert field.name in TERMS or field.name in not_terms or elsewhere, field.name


@pytest.mark.parametrize("term", TERMS)
def test_term_is_what_the_grade_claims(term):
    claimed, check, kind = TERMS[term]
    check(claimed, claimed, kind)


WITHOUT = {
    "bandwidth_hz": None,
    "gyro_bandwidth_hz": None,
    "accel_bandwidth_hz": None,
    "oversampling": 1,
    "dropped_burst": 1.0,
    "vibration_averaging_s": 1e-9,
}


def mutations():
    for term in TERMS:
        if term == "output":
            yield term, "rates"
            continue
        value = getattr(TERMS[term][0], term)
        yield term, type(value)(2 * value)
        yield term, type(value)(value / 2)
        yield term, WITHOUT.get(term, 0.0)


def quick_or_slow(term, value):
    """Slow where a gyro's term has the same check."""
    _, check, kind = TERMS[term]
    seen = kind == "accel" and any(other[1:] == (check, "gyro") for other in TERMS.values())
    return pytest.param(term, value, marks=pytest.mark.slow if seen else ())


@pytest.mark.parametrize(("term", "value"), [quick_or_slow(*mutation) for mutation in mutations()])
def test_a_term_doubled_halved_or_deleted_is_caught(term, value):
    claimed, check, kind = TERMS[term]
    with pytest.raises(AssertionError):
        check(claimed, replace(claimed, **{term: value}), kind)


# --- what the checks leave open --------------------------------------------------------------------


def test_temperature_follows_its_profile():
    profile = Temperature(5.0, 35.0, time_constant_s=0.5)
    truth = motion(np.zeros((1500, 6)))
    bias = sampled(WARM, truth, temperature=profile)["gyro_x_radps"].to_numpy()
    t = truth.index.to_numpy()
    warmth = (35.0 - 25.0) + (5.0 - 35.0) * np.exp(-t / 0.5)
    np.testing.assert_allclose(bias / bias[0], warmth / warmth[0], rtol=1e-12)
    assert (sampled(WARM, truth) == 0.0).all(axis=None), "at the temperature of calibration: nothing"


def test_terms_are_independent_draws():
    """Each pair of a device's constants, over 400 devices: below 4/sqrt(400) as independent ones are."""
    grade = replace(
        PLAIN,
        **{f"{kind}_scale_error": 0.01 for kind in KINDS},
        **{f"{kind}_nonorthogonality_rad": 0.01 for kind in KINDS},
        gyro_g_sensitivity_radspm=1e-2,
    )
    devices = np.array([matrices(grade, basis(), draw).ravel() for draw in range(400)])
    varying = devices[:, devices.std(axis=0) > 1e-5]
    correlation = np.corrcoef(varying.T)
    # The lengths of the axes are normalised, so the three leans tell the diagonal: leave that to 2nd order.
    assert varying.shape[1] >= 6 + 6 + 9
    assert np.abs(correlation[np.triu_indices(len(correlation), 1)]).max() < 4.0 / math.sqrt(400.0)


def test_one_term_more_leaves_the_others_draws_alone():
    alone = both(scale_error=0.01)
    more = replace(alone, gyro_g_sensitivity_radspm=1e-3, package_misalignment_rad=0.0, clock_drift=0.0)
    first = np.diag(matrices(alone, basis(), 3))
    np.testing.assert_array_equal(np.diag(matrices(more, basis(), 3)), first)
