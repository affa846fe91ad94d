"""The trajectory smoother by filterpy and by vectors: short, readable, what its kernels are held to.

Gonzalez-Carbajal et al. 2023 (paper 001), sections 2 and 3. Not for long rides: it is slow, and keeps every
covariance as a whole matrix.
"""

from __future__ import annotations

import math

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, rts_smoother
from scipy.linalg import block_diag
from simrail.estimators.trajectory.kernel import PACKED, STATES, Model
from simrail.estimators.trajectory.smoother import Trajectory, TrajectorySmoother

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording


def transition(step_s: float) -> np.ndarray:
    """F (12, 12): angles turn with constant rates, places move with constant acceleration."""
    pair = np.array([[1.0, step_s], [0.0, 1.0]])
    triple = np.array([[1.0, step_s, 0.5 * step_s**2], [0.0, 1.0, step_s], [0.0, 0.0, 1.0]])
    return np.asarray(block_diag(pair, pair, pair, triple, triple))


def _cross(a: FloatArray) -> FloatArray:
    """Matrix (3, 3) with [a]x b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def measured(
    x: FloatArray, track: FloatArray, gravity: float, slips: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """All eight measurements of a state and their Jacobian (8, 12) by vectors; ``track`` is one row of terms.

    With rho the angles of the body in the track frame and r = (0, y, z) its place there,

        a = origin + M r + 2 w x r' + r'',   force = (I - [rho]x) a + g (-pitch, roll, 1)
    """
    angles, rates, r = x[[0, 2, 4]], x[[1, 3, 5]], np.array([[0.0] * 3, x[6:9], x[9:12]])
    rho, origin, twice = angles - track[:3], track[3:6], _cross(track[12:15])
    m = np.column_stack([np.zeros(3), track[6:9], track[9:12]])
    turn = np.eye(3) - _cross(rho)
    a = origin + m @ r[:, 0] + twice @ r[:, 1] + r[:, 2]
    gravity_of_angles = gravity * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    roll, pitch, _ = angles
    rate_map = np.array([[1.0, 0.0, -pitch], [0.0, 1.0, roll], [0.0, -roll, 1.0]])
    value = np.concatenate(
        [
            rate_map @ rates,
            turn @ a + gravity_of_angles @ angles + np.array([0.0, 0.0, gravity]),
            [x[6], x[9]],
        ]
    )
    j = np.zeros((8, 12))
    j[:3, [1, 3, 5]] = rate_map
    j[:3, [0, 2]] = np.array([[0.0, -rates[2]], [rates[2], 0.0], [-rates[1], 0.0]])
    j[3:6, [0, 2, 4]] = _cross(a) + gravity_of_angles
    j[3:6, [6, 9]] = (turn @ m)[:, 1:]
    j[3:6, [7, 10]] = (turn @ twice)[:, 1:]
    j[3:6, [8, 11]] = turn[:, 1:]
    j[6, 6] = j[7, 9] = 1.0
    if slips is not None:
        j[3, 2] += slips[0]
        j[4, 9] += slips[1] + rho[0] * slips[2]
        j[5, 0] += 2.0 * x[8]
    return value, j


def filterpy_smoother(model: Model, *, smoothed: bool, with_covariance: bool) -> Trajectory:
    """The same estimate by filterpy: block update in Joseph's form, and the Rauch-Tung-Striebel smoother."""
    n = len(model.signals)
    f = transition(model.step_s)
    upper = np.triu_indices(STATES)
    ekf = ExtendedKalmanFilter(dim_x=STATES, dim_z=8)
    ekf.x, ekf.P, ekf.F = model.start.copy(), np.diag(model.start_variance), f
    noises = [(q, np.diag(r)) for q, r in zip(model.process, model.noise, strict=True)]
    states, covariances = np.empty((n, STATES)), np.empty((n, STATES, STATES))
    innovations, likelihood = np.empty((n, 7)), 0.0
    for k in range(n):
        ekf.Q, ekf.R = noises[model.kinds[k]]
        if k > 0:
            ekf.predict()
        slips = model.slips[k] if len(model.slips) else None
        value, j = measured(ekf.x, model.track[k], model.gravity, slips)
        z = np.concatenate([model.signals[k], model.virtual])
        ekf.update(z, lambda x, j=j: j, lambda x, value=value: value)
        states[k], covariances[k] = ekf.x, ekf.P
        e, s = ekf.y, ekf.S
        innovations[k, :6], innovations[k, 6] = e[:6], e[:6] @ np.linalg.solve(s[:6, :6], e[:6])
        spread = np.linalg.slogdet(s)[1] + len(e) * math.log(2.0 * math.pi)
        likelihood -= 0.5 * (e @ np.linalg.solve(s, e) + spread)
    if smoothed:
        # filterpy's k-th Q is that of the step from k to k + 1; the filter's, that of the step to k.
        steps = [noises[kind][0] for kind in model.kinds[1:n]]
        states, covariances, _, _ = rts_smoother(states, covariances, [f] * n, [*steps, steps[-1]])
    packed = covariances[:, *upper] if with_covariance else np.empty((0, PACKED))
    return Trajectory(states, packed, innovations, float(likelihood))


def trace(smoother: TrajectorySmoother, recording: Recording) -> Trajectory:
    """`TrajectorySmoother.trace` by filterpy, pass by pass."""
    around = None
    for _ in range(smoother.passes - 1):
        model = smoother.model(recording, around=around)
        around = filterpy_smoother(model, smoothed=True, with_covariance=False).states
    model = smoother.model(recording, around=around)
    return filterpy_smoother(model, smoothed=smoother.smoothed, with_covariance=smoother.with_covariance)
