"""The EKF: against filterpy, on closed forms, and its parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.kernel import attitude_ekf
from twins.attitude import filterpy_ekf

from simrail.core.columns import ACCEL, ATTITUDE, ATTITUDE_SD
from simrail.core.errors import InputError
from simrail.estimation.conformance import standing, time_reversed
from simrail.recording.recording import Recording, beginning

TUNINGS = [
    {},
    {"compensated": False},
    {"tuning": "paper_final"},
    {"tuning": "paper_initial", "process_noise": "per_step"},
]


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    recording = exactly(bend())
    rng = np.random.default_rng(2)
    recording.imu.iloc[:, :3] += 1.4e-3 * rng.standard_normal((len(recording.imu), 3))
    recording.imu.iloc[:, 3:] += 0.3 * rng.standard_normal((len(recording.imu), 3))
    return recording


def pieces(recording: Recording) -> dict[str, Recording]:
    """Some 4 s each of standstill, straight, curve, and the same curve in the other direction."""

    def cut(first: int, n: int = 1000) -> Recording:
        return replace(
            recording,
            imu=recording.imu.iloc[first : first + n],
            odometry=recording.odometry.iloc[first : first + n],
        )

    position = recording.odometry["position_m"].to_numpy()
    curve = cut(int(np.searchsorted(position, 90.0)))
    return {
        "standstill": beginning(standing(recording), samples=1000),
        "straight": cut(int(np.searchsorted(position, 420.0))),
        "curve": curve,
        "reverse": time_reversed(curve),
    }


@pytest.mark.parametrize("piece", ["standstill", "straight", "curve", "reverse"])
@pytest.mark.parametrize("options", TUNINGS)
def test_kernel_equals_filterpy(piece: str, options: dict, noisy: Recording) -> None:
    recording = pieces(noisy)[piece]
    arrays, _ = AttitudeEkf(**options)._arrays(recording)
    n = len(arrays.rate)
    ours, theirs = ((np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 4))) for _ in range(2))
    attitude_ekf(*arrays, *ours)
    filterpy_ekf(*arrays, *theirs)
    np.testing.assert_allclose(ours[0], theirs[0], rtol=0, atol=1e-9)
    scale = np.abs(theirs[1]).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(ours[1] / scale, theirs[1] / scale, rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours[2], theirs[2], rtol=1e-9, atol=1e-9)


def test_perfect_signals_give_the_true_attitude(
    bend: Callable, exactly: Callable, true_angles: Callable
) -> None:
    """Roll and pitch to the error of first-order integration; the body's own motion is zero here."""
    for direction in (1, -1):
        truth = bend(direction=direction)
        recording = exactly(truth)
        error = AttitudeEkf().estimate(recording).states[list(ATTITUDE)].to_numpy() - true_angles(
            truth, recording
        )
        assert np.degrees(np.abs(error[:, :2])).max() < 1e-3
        assert np.degrees(np.abs(error[:, 2])).max() < 0.01


@pytest.mark.parametrize(
    ("reading", "tau"), [("per_step", 0.19), ("intensity", 3.0)], ids=["per_step", "intensity"]
)
def test_time_constant_of_the_two_readings(reading: str, tau: float, noisy: Recording) -> None:
    """EQUATIONS 2.3: tau = sqrt(R Ts / Qc) / g. A gyro bias b tilts the estimate by b tau in the end."""
    recording = standing(noisy)
    bias = 0.01
    recording.imu.iloc[:, 0] = bias
    recording.imu.iloc[:, 1:] = 0.0
    recording.imu.iloc[:, 3:] = np.array([0.0, 0.0, 9.81])
    ekf = AttitudeEkf(tuning="paper_final", process_noise=reading, rest_bias=False, compensated=False)
    roll = ekf.estimate(recording).states["roll_rad"].iloc[-1]
    assert roll == pytest.approx(bias * tau, rel=0.03)


def test_yaw_is_not_touched_by_gravity(noisy: Recording) -> None:
    """Tilt the accelerometer: roll and pitch answer, yaw integrates the gyro as before."""
    recording = beginning(standing(noisy), samples=2500)
    recording.imu.iloc[:, :3] = np.array([0.0, 0.0, 0.05])
    before = AttitudeEkf(rest_bias=False).estimate(recording)
    np.testing.assert_allclose(np.diff(before.states["yaw_rad"]), 0.05 * 0.004, rtol=1e-3)
    sd = before.states["yaw_sd_rad"].to_numpy()
    assert (np.diff(sd) > 0.0).all()


def test_standard_deviations_are_those_of_the_covariance(noisy: Recording) -> None:
    estimate = AttitudeEkf().estimate(noisy)
    assert estimate.covariance is not None and estimate.covariance_of == ATTITUDE
    variance = np.diagonal(estimate.covariance, axis1=1, axis2=2)
    np.testing.assert_array_equal(estimate.states[list(ATTITUDE_SD)].to_numpy(), np.sqrt(variance))


def test_the_accelerometers_bias_is_a_floor_of_the_stated_error(noisy: Recording) -> None:
    floor = noisy.imu_sheet.accel_turn_on_bias_mps2 / np.sqrt(3.0) / 9.81
    sd = AttitudeEkf().estimate(noisy).states["roll_sd_rad"].to_numpy()
    assert sd.min() > floor
    assert sd[400:500].max() < 1.1 * floor  # at rest there is little else


def test_given_noise_replaces_the_tunings(noisy: Recording) -> None:
    paper = AttitudeEkf(tuning="paper_final", process_noise="per_step").estimate(noisy)
    same = AttitudeEkf(
        tuning="paper_initial", process_noise="per_step", gyro_intensity_rad2ps=1e-3, accel_sd_mps2=15.0
    ).estimate(noisy)
    np.testing.assert_array_equal(paper.states, same.states)
    other = AttitudeEkf(tuning="paper_final", gyro_intensity_rad2ps=0.25).estimate(noisy)
    np.testing.assert_allclose(paper.states, other.states, rtol=1e-12)  # 1e-3 / Ts


def test_a_force_that_is_not_gravitys_size_is_doubted(noisy: Recording) -> None:
    force = noisy.imu[list(ACCEL)].to_numpy()
    excess = np.linalg.norm(force, axis=1) - noisy.gravity_mps2
    plain = AttitudeEkf(compensated=False)._arrays(noisy)[0].noise
    doubted = AttitudeEkf(compensated=False, doubt=50.0)._arrays(noisy)[0].noise
    np.testing.assert_allclose(
        doubted - plain, np.tile(50.0 * excess[:, None] ** 2, 3), rtol=1e-9, atol=1e-12
    )
    assert np.ptp(excess) > 0.1


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"tuning": "best"}, "tuning"),
        ({"process_noise": "per_second"}, "process_noise"),
        ({"accel_sd_mps2": 0.0}, "accel_sd_mps2"),
        ({"start_sd_rad": -1.0}, "start_sd_rad"),
        ({"gyro_intensity_rad2ps": float("nan")}, "gyro_intensity_rad2ps"),
        ({"vibration": float("inf")}, "vibration"),
        ({"doubt": -1.0}, "doubt"),
    ],
)
def test_bad_options_are_refused_by_name(options: dict, named: str) -> None:
    with pytest.raises(InputError, match=named):
        AttitudeEkf(**options)


def test_a_heading_is_as_sure_at_first_as_it_is_told_and_so_are_roll_and_pitch(noisy: Recording) -> None:
    """Gravity says nothing of heading: its first standard deviation is what it began with."""
    method = AttitudeEkf(start_sd_rad=0.04, start_yaw_sd_rad=0.007)
    arrays, considered = method._arrays(beginning(noisy, samples=10))
    np.testing.assert_allclose(np.sqrt(arrays.start_variance), [0.04, 0.04, 0.007], rtol=1e-12)
    first = method.estimate(beginning(noisy, samples=10)).states.iloc[0]
    assert first[ATTITUDE_SD[2]] == pytest.approx(np.sqrt(0.007**2 + considered[0, 2]), rel=1e-9)
