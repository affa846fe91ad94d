"""The gradient descent algorithm: against a plain numpy loop, and its limits in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from simrail.estimators.attitude.compensation import gravity_force
from simrail.estimators.attitude.gda import AttitudeGda
from simrail.estimators.attitude.kernel import attitude_gda
from simrail.estimators.attitude.rest_bias import rest_bias, step_rates

from simrail.core.columns import ATTITUDE
from simrail.core.errors import InputError
from simrail.estimation.conformance import standing, time_reversed
from simrail.recording.recording import Recording

STEP = 0.004
BETA = np.sqrt(0.75) * np.radians(0.5)


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    a, u = p[0], p[1:]
    b, v = q[0], q[1:]
    return np.concatenate([[a * b - u @ v], a * v + b * u + np.cross(u, v)])


def plain_gda(rate: np.ndarray, force: np.ndarray, start: np.ndarray, beta: float) -> np.ndarray:
    """Eqs. 40-42 of paper 000 with Madgwick's step, as one would write it on a blackboard."""
    q = start
    rows = [q]
    for w, z in zip(rate[1:], force[1:], strict=True):
        a, b, c, d = q
        up = np.array([2 * (b * d - a * c), 2 * (a * b + c * d), 1 - 2 * (b**2 + c**2)])
        f = up - z / np.linalg.norm(z)
        jacobian = 2 * np.array([[-c, d, -a, b], [b, a, d, c], [0, -2 * b, -2 * c, 0]])
        gradient = jacobian.T @ f
        q = q + STEP * (0.5 * product(q, np.array([0.0, *w])) - beta * gradient / np.linalg.norm(gradient))
        q = q / np.linalg.norm(q)
        rows.append(q)
    return np.array(rows)


def plain_angles(quaternions: np.ndarray) -> np.ndarray:
    """Angles by way of the rotation matrix."""
    rows = []
    for a, *u in quaternions:
        u = np.array(u)
        cross = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        c = (a**2 - u @ u) * np.eye(3) + 2 * np.outer(u, u) + 2 * a * cross
        rows.append([np.arctan2(c[2, 1], c[2, 2]), -np.arcsin(c[2, 0]), np.arctan2(c[1, 0], c[0, 0])])
    angles = np.array(rows)
    angles[:, 2] = np.unwrap(angles[:, 2])
    return angles


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    recording = exactly(bend())
    rng = np.random.default_rng(3)
    recording.imu.iloc[:, :3] += 1.4e-3 * rng.standard_normal((len(recording.imu), 3))
    recording.imu.iloc[:, 3:] += 0.3 * rng.standard_normal((len(recording.imu), 3))
    return recording


@pytest.mark.parametrize(
    ("turn", "compensated"),
    [
        pytest.param(time_reversed, True, id="compensated-backward"),
        pytest.param(lambda r: r, False, id="forward"),
        pytest.param(lambda r: r, True, marks=pytest.mark.slow, id="compensated-forward"),
        pytest.param(time_reversed, False, marks=pytest.mark.slow, id="backward"),
    ],
)
def test_equals_a_plain_loop(turn: Callable, compensated: bool, noisy: Recording) -> None:
    recording = turn(noisy)
    force = gravity_force(recording, compensated=compensated)
    rate = step_rates(recording, rest_bias(recording).bias)
    x, y, z = force[0]
    roll, pitch = np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))
    yaw = recording.track.frame(recording.odometry["position_m"].iloc[:1]).yaw_rad[0]
    start = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turned = np.zeros(4)
        turned[0], turned[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
        start = product(start, turned)
    expected = plain_angles(plain_gda(rate, force, start, BETA))
    found = (
        AttitudeGda(compensated=compensated, tuning="paper")
        .estimate(recording)
        .states[list(ATTITUDE)]
        .to_numpy()
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("mismatch_deg", [1.0, 4.0])
def test_correction_has_the_speed_of_two_beta(mismatch_deg: float) -> None:
    """The roll moves by 2 beta = 0.87 deg/s, whatever the mismatch (0.3 % less at 4 degrees)."""
    n = 250
    force = np.tile([0.0, 0.0, 9.81], (n, 1))
    out = np.empty((n, 4))
    half = np.radians(mismatch_deg) / 2
    attitude_gda(np.zeros((n, 3)), force, np.array([np.cos(half), np.sin(half), 0.0, 0.0]), BETA, STEP, out)
    roll = 2 * np.arctan2(out[:, 1], out[:, 0])
    np.testing.assert_allclose(-np.diff(roll) / STEP, 2 * BETA, rtol=5e-3)


def test_free_fall_is_integrated_without_correction() -> None:
    n = 100
    out = np.empty((n, 4))
    rate = np.tile([0.1, 0.0, 0.0], (n, 1))
    attitude_gda(rate, np.zeros((n, 3)), np.array([1.0, 0.0, 0.0, 0.0]), BETA, STEP, out)
    np.testing.assert_allclose(2 * np.arctan2(out[-1, 1], out[-1, 0]), 0.1 * STEP * (n - 1), rtol=1e-7)


def test_an_exact_minimum_is_left_alone() -> None:
    out = np.empty((50, 4))
    level = np.array([1.0, 0.0, 0.0, 0.0])
    attitude_gda(np.zeros((50, 3)), np.tile([0.0, 0.0, 9.81], (50, 1)), level, BETA, STEP, out)
    np.testing.assert_array_equal(out, np.tile(level, (50, 1)))


def test_standstill_settles_on_gravity(noisy: Recording) -> None:
    recording = standing(noisy)
    recording.imu.iloc[:, 3:] = 9.81 * np.array([np.sin(0.02), 0.0, np.cos(0.02)])
    states = AttitudeGda(tuning="paper").estimate(recording).states
    # The first sample sets it; afterwards it chatters by about one step of 2 beta Ts = 0.0035 deg.
    np.testing.assert_allclose(states["pitch_rad"], -0.02, rtol=0, atol=1.5 * 2 * BETA * STEP)


@pytest.mark.parametrize("error", [-1.0, float("nan"), float("inf")])
def test_bad_gyro_error_is_refused(error: float) -> None:
    with pytest.raises(InputError, match="gyro_error_radps"):
        AttitudeGda(gyro_error_radps=error)


def test_given_gyro_error_replaces_the_tunings(noisy: Recording) -> None:
    paper = AttitudeGda(tuning="paper").estimate(noisy).states
    given = AttitudeGda(gyro_error_radps=np.radians(0.5)).estimate(noisy).states
    np.testing.assert_array_equal(paper, given)
    assert not np.array_equal(paper, AttitudeGda().estimate(noisy).states)


def test_unknown_tuning_is_refused() -> None:
    with pytest.raises(InputError, match="recommended, paper"):
        AttitudeGda(tuning="best")
