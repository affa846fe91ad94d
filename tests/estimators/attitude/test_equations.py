"""The project's own derivation of what the attitude estimators compute, by sympy from the rotation matrix.

Nothing of EQUATIONS or of paper 000 is taken over: every formula follows here from C = Rz Ry Rx, from
dx/ds = cos yaw, dy/ds = sin yaw, dz/ds = -tan pitch, and from differentiation. Then the code is asked.
"""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import sympy as sp
from simrail.estimators.attitude.compensation import track_acceleration
from simrail.estimators.attitude.kernel import attitude_ekf
from taylor_pieces import taylor_pieces
from turning import rotation, turning

from simrail.track.frame_kernel import Pieces

t, s, r_y, r_z, g = sp.symbols("t s r_y r_z g", real=True)


# A track with everything in it at once, as functions of s that can be differentiated for ever.
TRACK = (
    sp.Rational(8, 100) * sp.sin(s / 31 + sp.Rational(1, 3)),
    sp.Rational(3, 100) * sp.cos(s / 47),
    sp.Rational(7, 10) * sp.sin(s / 60) + s / 400,
)
RIDE = 40 + 12 * t - sp.Rational(9, 20) * t**2 + sp.Rational(1, 50) * t**3
PLACE = (0.35, 0.8)
TIMES = np.array([0.0, 1.7, 4.0, 9.0, 14.0])


@lru_cache
def true_acceleration() -> np.ndarray:
    """Second time derivative of the global position of a point fixed in the track frame, in its axes."""
    roll, pitch, yaw = (angle.subs(s, RIDE) for angle in TRACK)
    speed = RIDE.diff(t)
    c = rotation(roll, pitch, yaw)
    line = sp.Matrix([sp.cos(yaw), sp.sin(yaw), -sp.tan(pitch)]) * speed
    lever = c * sp.Matrix([0, r_y, r_z])
    function = sp.lambdify((t, r_y, r_z), [c, line.diff(t) + lever.diff(t, 2)], "numpy", cse=True)
    axes, accelerations = zip(*(function(time, *PLACE) for time in TIMES), strict=True)
    return np.array([a.T @ b.ravel() for a, b in zip(axes, accelerations, strict=True)])


@lru_cache
def frame_functions() -> list:
    """Angles, two derivatives, k and k' of TRACK as functions of s; k straight from the rotation matrix."""
    k = turning(rotation(*TRACK), s)
    parts = [sp.Matrix(TRACK), sp.Matrix(TRACK).diff(s), sp.Matrix(TRACK).diff(s, 2), k, k.diff(s)]
    return [sp.lambdify(s, part, "numpy") for part in parts]


def track_frame(at_m: np.ndarray, *, places: bool = True) -> SimpleNamespace:
    """The frame of TRACK, as a `TrackDesign` would give it."""
    values = [np.array([part(x).ravel() for x in at_m]) for part in frame_functions()]
    angles, rates, second, k, dk = values
    return SimpleNamespace(
        roll_rad=angles[:, 0],
        pitch_rad=angles[:, 1],
        yaw_rad=angles[:, 2],
        rates=rates,
        second=second,
        k=k,
        dk=dk,
    )


@lru_cache
def track_pieces() -> Pieces:
    """TRACK at the places of the ride."""
    return taylor_pieces(TRACK, s, np.array([float(RIDE.subs(t, time)) for time in TIMES]))


class Line:
    """A design track that is TRACK."""

    start_m, end_m = 0.0, 1e4
    frame = staticmethod(track_frame)
    on_track = staticmethod(np.asarray)
    pieces = property(lambda _: track_pieces())


@pytest.fixture(scope="module")
def ride() -> SimpleNamespace:
    columns = [sp.lambdify(t, RIDE.diff(t, order), "numpy") for order in range(3)]
    data = np.array([[column(time) for column in columns] for time in TIMES])
    data[:, 0] = track_pieces().starts  # to the last bit
    odometry = pd.DataFrame(data, columns=["position_m", "speed_mps", "acceleration_mps2"])
    return SimpleNamespace(track=Line(), odometry=odometry, mount_position_m=(1.0, *PLACE))


def test_compensation_is_the_acceleration_of_the_place(ride: SimpleNamespace) -> None:
    expected = true_acceleration()
    # Curved track, cant and slope changing, speed changing and lever arms: several m/s2.
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(track_acceleration(ride), expected, rtol=0, atol=1e-12)


def test_compensation_running_backwards(ride: SimpleNamespace) -> None:
    """The same places with V < 0 and the time run backwards: the same accelerations."""
    turned = SimpleNamespace(**vars(ride))
    turned.odometry = ride.odometry.iloc[::-1].copy()
    turned.odometry["speed_mps"] *= -1.0
    np.testing.assert_allclose(track_acceleration(turned), true_acceleration()[::-1], rtol=0, atol=1e-12)


def test_printed_compensation_is_what_paper_000_prints(ride: SimpleNamespace) -> None:
    """Eqs. 3-6 with the track's angle rates for curvatures; wrong by more than 0.05 m/s2 on this track."""
    frame = track_frame(ride.odometry["position_m"].to_numpy())
    speed, push = ride.odometry[["speed_mps", "acceleration_mps2"]].to_numpy().T
    _, vertical, horizontal = frame.rates.T
    square = speed**2
    origin = np.column_stack([push, horizontal * square, -vertical * square])
    omega = frame.rates * speed[:, None]
    alpha = frame.rates * push[:, None]
    alpha[:, 2] += frame.second[:, 2] * square
    lever = np.array([0.0, *PLACE])
    printed = origin + np.cross(alpha, lever) + np.cross(omega, np.cross(omega, lever))
    found = track_acceleration(ride, printed=True)
    np.testing.assert_allclose(found, printed, rtol=0, atol=1e-14)
    assert np.abs(found - true_acceleration()).max() > 0.05


# The EKF's model, from the rotation matrix.
roll, pitch, yaw = sp.symbols("roll pitch yaw", real=True)
ANGLES = sp.Matrix([roll, pitch, yaw])


@lru_cache
def body_rate_map() -> sp.Matrix:
    """Matrix E with body rate = E (d roll, d pitch, d yaw), from the turning of C(t)."""
    moving = [sp.Function(name)(t) for name in ("a", "b", "c")]
    body = turning(rotation(*moving), t)
    still = dict(zip(moving, ANGLES, strict=True))
    return sp.Matrix.hstack(*(body.diff(function.diff(t)) for function in moving)).subs(still)


def numbers(expression: sp.Matrix) -> np.ndarray:
    """Value at STATE."""
    return np.array(sp.lambdify((ANGLES,), expression, "numpy")(STATE), dtype=float)


def euler_rates() -> np.ndarray:
    """Solve body rate = E(angles) rates at STATE and RATE."""
    return np.linalg.solve(numbers(body_rate_map()), RATE)


def euler_rates_jacobian() -> np.ndarray:
    """d rates / d angles = -E^-1 (dE/d angle) rates, column by column."""
    e = body_rate_map()
    columns = [-np.linalg.solve(numbers(e), numbers(e.diff(angle)) @ euler_rates()) for angle in ANGLES]
    return np.column_stack(columns)


STATE = np.array([0.11, -0.07, 0.9])
RATE = np.array([0.2, -0.3, 0.4])
STEP = 0.004
GRAVITY = 9.81


def run_ekf(
    *, variance: np.ndarray, noise: np.ndarray, force: np.ndarray | None = None, samples: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    n = samples
    forces = np.zeros((n, 3)) if force is None else np.tile(force, (n, 1))
    states, covariance, innovations = np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 4))
    attitude_ekf(
        np.tile(RATE, (n, 1)),
        forces,
        np.zeros(n),
        np.tile(noise, (n, 1)),
        STATE.copy(),
        variance,
        STEP,
        GRAVITY,
        states,
        covariance,
        innovations,
    )
    return states, covariance, innovations


BLIND = np.full(3, 1e30)


def test_ekf_predicts_the_euler_rates() -> None:
    states, _, _ = run_ekf(variance=np.zeros(3), noise=BLIND)
    np.testing.assert_allclose((states[1] - states[0]) / STEP, euler_rates(), rtol=1e-12)


def test_ekf_propagates_with_the_jacobian_of_the_euler_rates() -> None:
    transition = np.eye(3) + STEP * euler_rates_jacobian()
    for state in range(3):
        variance = np.zeros(3)
        variance[state] = 1.0
        _, covariance, _ = run_ekf(variance=variance, noise=BLIND)
        column = transition[:, state]
        np.testing.assert_allclose(covariance[1], np.outer(column, column), rtol=0, atol=1e-15)


def test_ekf_measures_gravity_in_body_axes_with_its_jacobian() -> None:
    gravity = rotation(roll, pitch, yaw).T * sp.Matrix([0, 0, g])
    predicted = sp.lambdify((ANGLES, g), gravity, "numpy")(STATE, GRAVITY).ravel()
    h = np.array(sp.lambdify((ANGLES, g), gravity.jacobian(ANGLES), "numpy")(STATE, GRAVITY), dtype=float)
    assert np.abs(h[:, 2]).max() == 0.0
    force = np.array([0.3, -0.2, 9.5])
    _, _, innovations = run_ekf(variance=np.zeros(3), noise=BLIND, samples=1)
    np.testing.assert_allclose(innovations[0, :3], -predicted, rtol=1e-14)
    for row in range(3):
        for state in range(2):
            variance, noise = np.zeros(3), BLIND.copy()
            variance[state], noise[row] = 0.01, 2.0
            states, _, _ = run_ekf(variance=variance, noise=noise, force=force, samples=1)
            error = force[row] - predicted[row]
            gain = 0.01 * h[row, state] / (0.01 * h[row, state] ** 2 + 2.0)
            np.testing.assert_allclose(states[0, state] - STATE[state], gain * error, rtol=1e-9, atol=1e-16)
