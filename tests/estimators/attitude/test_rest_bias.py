"""Gyro bias from the rests: mean of the past, never of the motion; each stop weighted as the sheet says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import signal, stats
from simrail.estimators.attitude.rest_bias import CORRELATION_S, WANDER_PER_INSTABILITY, rest_bias, step_rates

from simrail.core.columns import IMU, ODOMETRY, ODOMETRY_SD
from simrail.recording.recording import EncoderSheet, ImuSheet, Recording, beginning
from simrail.recording.standstill import rest_periods
from simrail.track.design import Straight, TrackDesign

RATE = 250
GUARD = 125  # half a second


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    recording = exactly(bend())
    rng = np.random.default_rng(1)
    recording.imu.iloc[:, :3] += np.array([0.01, -0.02, 0.03]) + 1e-3 * rng.standard_normal(
        (len(recording.imu), 3)
    )
    return recording


def with_encoder(recording: Recording, first_pulse_s: float) -> Recording:
    times = np.arange(0.0, recording.imu.index[-1], 0.01)
    counts = np.maximum(np.floor((times - first_pulse_s) * 100) + 1, 0).astype(int)
    return replace(
        recording,
        encoder=pd.DataFrame({"pulse_count": counts}, index=pd.Index(times, name="time_s")),
        encoder_sheet=EncoderSheet("wheel", 1024, 0.29, 100.0),
    )


def test_bias_is_the_mean_of_the_rest_and_then_stays(noisy: Recording) -> None:
    recording = with_encoder(noisy, 1.6)
    found = rest_bias(recording)
    gyro = recording.imu.to_numpy()[:, :3]
    moving = 400  # first sample at or after 1.6 s
    for k in (GUARD + 1, 300, moving - 1):
        np.testing.assert_allclose(found.bias[k], gyro[: k - GUARD].mean(axis=0), rtol=1e-12)
        assert found.samples[k] == k - GUARD
    kept = gyro[: moving - GUARD].mean(axis=0)
    np.testing.assert_allclose(
        found.bias[moving:], np.broadcast_to(kept, (len(gyro) - moving, 3)), rtol=1e-12
    )
    assert (found.samples[moving:] == moving - GUARD).all()


def test_nothing_is_averaged_within_the_guard(noisy: Recording) -> None:
    found = rest_bias(with_encoder(noisy, 0.3))
    assert not found.bias.any() and not found.samples.any()


def test_without_an_encoder_the_odometry_speaks(noisy: Recording) -> None:
    found = rest_bias(noisy)
    speed = noisy.odometry["speed_mps"].to_numpy()
    moving = np.flatnonzero(np.abs(speed) > 0.01)
    assert found.samples[moving[-1]] == moving[0] - GUARD
    # The final rest: from a second after the last motion on.
    assert found.samples[-1] == moving[0] - GUARD + len(speed) - 1 - moving[-1] - 250 - GUARD


def test_switched_off(noisy: Recording) -> None:
    found = rest_bias(noisy, enabled=False)
    assert not found.bias.any() and not found.samples.any()


def test_rate_over_a_step_is_the_mean_of_its_ends(noisy: Recording) -> None:
    bias = rest_bias(noisy).bias
    gyro = noisy.imu.to_numpy()[:, :3]
    rates = step_rates(noisy, bias)
    np.testing.assert_allclose(rates[1:], 0.5 * (gyro[1:] + gyro[:-1]) - bias[1:], rtol=0, atol=1e-16)
    np.testing.assert_array_equal(rates[0], gyro[0] - bias[0])
    assert rates.flags.c_contiguous


# A ride of three rests on straight track: the gyro has nothing to feel but its own errors.
SLOW = 50  # Hz
STANDS = ((0.0, 20.0), (80.0, 95.0), (200.0, 240.0))
END_S = 260.0
SHEET = ImuSheet(
    grade="made up",
    rate_hz=SLOW,
    delay_s=0.0,
    gyro_noise_radpsqrts=1e-4,
    accel_noise_mpsqrts=1e-3,
    gyro_bias_instability_radps=5e-5,
    accel_bias_instability_mps2=0.0,
    gyro_turn_on_bias_radps=1e-3,
    accel_turn_on_bias_mps2=0.0,
)


def three_rests(gyro: np.ndarray, *, sheet: ImuSheet = SHEET, direction: int = 1) -> Recording:
    times = pd.Index(np.arange(round(END_S * SLOW)) / SLOW, name="time_s")
    imu = np.zeros((len(times), 6))
    imu[:, :3], imu[:, 5] = gyro, 9.81
    moving = ~np.any([(times >= a) & (times < b) for a, b in STANDS], axis=0)
    columns = [*ODOMETRY, *ODOMETRY_SD]
    return Recording(
        name="three rests",
        imu=pd.DataFrame(imu, index=times, columns=list(IMU)),
        imu_sheet=sheet,
        mount="axle",
        mount_body="front",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TrackDesign("line", 0.0, (Straight(1000.0),)),
        encoder=pd.DataFrame({"pulse_count": direction * np.cumsum(moving) * 20}, index=times),
        encoder_sheet=EncoderSheet("wheel", 1024, 0.29, SLOW),
        start_position_m=0.0,
        odometry=pd.DataFrame(np.zeros((len(times), 6)), index=times, columns=columns),
        odometry_source="encoder",
    )


def wandering(rng: np.random.Generator, n: int, sheet: ImuSheet, correlation_s: float) -> np.ndarray:
    """Turn-on bias and stationary Gauss-Markov bias, by the recursion of the textbook."""
    decay = np.exp(-1.0 / (correlation_s * sheet.rate_hz))
    shocks = rng.standard_normal((n, 3)) * np.sqrt(1.0 - decay**2)
    shocks[0] = rng.standard_normal(3)
    wander = signal.lfilter([1.0], [1.0, -decay], shocks, axis=0)
    sd = WANDER_PER_INSTABILITY * sheet.gyro_bias_instability_radps
    return rng.uniform(-1.0, 1.0, 3) * sheet.gyro_turn_on_bias_radps + sd * wander


def at(time_s: float) -> int:
    return round(time_s * SLOW)


@pytest.fixture(scope="module")
def drawn() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Error (draw, sample, axis) of the bias, the error of the first rest alone, and the variance."""
    n = round(END_S * SLOW)
    errors, frozen = [], []
    for draw in range(250):
        rng = np.random.default_rng([3, draw])
        bias = wandering(rng, n, SHEET, CORRELATION_S)
        white = SHEET.gyro_noise_radpsqrts * np.sqrt(SLOW) * rng.standard_normal((n, 3))
        found = rest_bias(three_rests(bias + white), with_variance=True)
        errors.append(found.bias - bias)
        frozen.append(found.bias[at(60.0)] - bias)
    return np.array(errors), np.array(frozen), found.variance


@pytest.mark.parametrize("time_s", [10.0, 19.9, 60.0, 79.0, 85.0, 95.0, 150.0, 199.0, 215.0, 240.0, 259.0])
def test_the_error_is_as_large_as_its_variance_says(drawn: tuple, time_s: float) -> None:
    errors, _, variance = drawn
    found = errors[:, at(time_s)]
    # 750 values: the chi-square of their squares inside 99.9 %, two-sided.
    low, high = stats.chi2.ppf([0.0005, 0.9995], found.size)
    assert low < (found**2).sum() / variance[at(time_s)] < high


def test_each_stop_makes_it_better(drawn: tuple) -> None:
    errors, frozen, variance = drawn
    for k in (at(110.0), at(250.0)):
        assert np.mean(errors[:, k] ** 2) < 0.8 * np.mean(frozen[:, k] ** 2)
    assert variance[at(95.0)] < variance[at(79.0)] and variance[at(245.0)] < variance[at(199.0)]


def test_without_wandering_it_is_the_mean_of_all_rests() -> None:
    sheet = replace(SHEET, gyro_bias_instability_radps=0.0)
    gyro = np.random.default_rng(1).standard_normal((round(END_S * SLOW), 3))
    recording = three_rests(gyro, sheet=sheet)
    found = rest_bias(recording)
    used = np.zeros(len(gyro), dtype=bool)
    for start, end in rest_periods(recording).to_numpy():
        used |= (recording.imu.index >= start - 1e-9) & (recording.imu.index < end - 1e-9)
    assert abs(found.samples[-1] - used.sum()) <= len(STANDS)
    # The kernel may use one sample more or less at an end of a rest than the times say: below 1e-2 / 60 s.
    np.testing.assert_allclose(found.bias[-1], gyro[used].mean(axis=0), rtol=0, atol=3e-3)
    exact = replace(sheet, gyro_noise_radpsqrts=0.0)
    np.testing.assert_allclose(
        rest_bias(three_rests(gyro, sheet=exact)).bias, found.bias, rtol=1e-9, atol=1e-12
    )


def test_without_white_noise_the_newest_rest_alone_counts() -> None:
    steps = np.repeat(
        [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]], [70 * SLOW, 80 * SLOW, 110 * SLOW], axis=0
    )
    found = rest_bias(three_rests(steps, sheet=replace(SHEET, gyro_noise_radpsqrts=0.0)))
    np.testing.assert_allclose(found.bias[at(70.0)], [1.0, 2.0, 3.0], rtol=1e-9)
    np.testing.assert_allclose(found.bias[at(150.0)], [4.0, 5.0, 6.0], rtol=1e-9)
    np.testing.assert_allclose(found.bias[at(250.0)], [7.0, 8.0, 9.0], rtol=1e-9)


def test_motion_never_enters() -> None:
    """Whatever the gyro feels between the guards of two rests changes nothing."""
    rng = np.random.default_rng(2)
    gyro = 1e-4 * rng.standard_normal((round(END_S * SLOW), 3))
    recording = three_rests(gyro)
    times = recording.imu.index.to_numpy()
    inside = np.zeros(len(times), dtype=bool)
    for start, end in rest_periods(recording).to_numpy():
        inside |= (times >= start - 1e-9) & (times < end + 0.021)  # the sample on which the motion is seen
    shaken = three_rests(np.where(inside[:, None], gyro, gyro + 1.0))
    # Sums of the samples before differ in rounding only.
    np.testing.assert_allclose(rest_bias(shaken).bias, rest_bias(recording).bias, rtol=0, atol=1e-11)


def test_a_crawl_in_steps_is_no_rest() -> None:
    """Two counts every 2 s leave half a second between the guards: too short to be called a rest."""
    gyro = np.random.default_rng(8).standard_normal((round(END_S * SLOW), 3))
    recording = three_rests(gyro)
    stepwise = 2 * np.maximum((recording.imu.index.to_numpy() - 20.0) // 2.0, -1.0).astype(int)
    recording.encoder["pulse_count"] = stepwise
    found = rest_bias(recording)
    assert len(rest_periods(recording)) == 1
    assert found.samples[-1] == found.samples[at(25.0)] > 0
    np.testing.assert_array_equal(found.bias[-1], found.bias[at(25.0)])


@pytest.mark.parametrize("direction", (1, -1))
def test_the_bias_of_a_prefix_is_the_prefix_of_the_bias(direction: int) -> None:
    rng = np.random.default_rng(5)
    recording = three_rests(wandering(rng, round(END_S * SLOW), SHEET, 100.0), direction=direction)
    whole = rest_bias(recording, with_variance=True)
    # Inside each rest (before and after it is long enough), at its ends, on the way, one sample apart.
    for n in (3, at(5.0), at(20.0), at(20.02), at(81.5), at(82.6), at(90.0), at(94.6), at(95.02), at(222.0)):
        for more in (0, 1):
            part = rest_bias(beginning(recording, samples=n + more), with_variance=True)
            for piece, all_of_it in zip(part, whole, strict=True):
                np.testing.assert_array_equal(piece, all_of_it[: n + more])


def test_a_stop_backwards_counts_as_forwards() -> None:
    gyro = np.random.default_rng(6).standard_normal((round(END_S * SLOW), 3))
    for one, other in zip(
        rest_bias(three_rests(gyro)), rest_bias(three_rests(gyro, direction=-1)), strict=True
    ):
        np.testing.assert_array_equal(one, other)
