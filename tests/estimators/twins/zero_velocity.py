"""The zero-velocity filter by filterpy: short, readable, what its kernel is held to.

The motion is written with vectors and rotation matrices, and derived by complex steps (W. Squire and G.
Trapp, SIAM Review 40 (1998) 110-112), which have no truncation error. When the train stands is given.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from simrail.estimators.odometry.zero_velocity_kernel import SCALED_S, Found, Model

from simrail.core.jit import FloatArray

STEP = 1e-30


def derived(function: Callable[[np.ndarray], np.ndarray], x: FloatArray) -> FloatArray:
    """Jacobian of a function of x (n,)."""
    columns = [function(x + 1j * STEP * e).imag / STEP for e in np.eye(len(x))]
    return np.column_stack([np.atleast_1d(c) for c in columns])


def into_body(roll: complex, pitch: complex) -> np.ndarray:
    """From the level frame that heads where the body does into the body: Rx Ry of EQUATIONS 0."""
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    about_x = np.array([[1, 0, 0], [0, cr, sr], [0, -sr, cr]])
    about_y = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    return about_x @ about_y


def euler_rates(w: np.ndarray, roll: complex, pitch: complex) -> np.ndarray:
    """Rates of roll, pitch and yaw from those about the body's axes."""
    ex, ey, ez = np.eye(3)
    of_rates = np.column_stack([ex, into_body(roll, 0.0) @ ey, into_body(roll, pitch) @ ez])
    return np.asarray(np.linalg.solve(of_rates, w))


def moved(x: np.ndarray, model: Model, k: int, rests: bool) -> np.ndarray:
    """State a step later."""
    s, v, roll, pitch = x[:4]
    push, askew = x[7], x[9]
    rates = np.zeros(3) if rests else euler_rates(model.signals[k, :3] - x[4:7], roll, pitch)
    turn = rates[2] * np.cos(pitch)
    gravity = into_body(roll, pitch + 0.5 * model.step_s * rates[1]) @ np.array([0.0, 0.0, model.gravity])
    force = model.signals[k, 3] - push - gravity[0]
    acceleration = force + (model.lever_m + np.sign(v.real) * model.lag_m) * turn**2 + askew * v * turn
    dt = model.step_s
    way = np.cos(pitch) * (v * dt + 0.5 * acceleration * dt**2)
    return np.concatenate(
        [[s + way, v + acceleration * dt, roll + rates[0] * dt, pitch + rates[1] * dt], x[4:]]
    )


def scaled(x: FloatArray, model: Model, k: int) -> FloatArray:
    """Variances that errors of the gyros' scales add to roll and pitch, each by its share of their rates."""
    w = model.signals[k, :3] - x[4:7]
    shares = np.column_stack([euler_rates(w[i] * np.eye(3)[i], x[2], x[3]) for i in range(3)])
    variances = np.zeros(len(x))
    variances[2:4] = model.step_s * SCALED_S * model.scale_variance * (shares[:2] ** 2).sum(axis=1)
    return variances


def lateral(x: np.ndarray, model: Model, k: int) -> complex:
    """Specific force along Y that a state would show."""
    turn = euler_rates(model.signals[k, :3] - x[4:7], x[2], x[3])[2] * np.cos(x[3])
    return x[1] * turn + (into_body(x[2], x[3]) @ np.array([0.0, 0.0, model.gravity]))[1] + x[8]


def filterpy_zero_velocity(model: Model, x: FloatArray, p: FloatArray, rests: np.ndarray, out: Found) -> None:
    """Run it over all steps, into ``out``; ``rests`` (n,) says where the train stands."""
    ekf = ExtendedKalmanFilter(dim_x=len(x), dim_z=1)
    ekf.x, ekf.P = x.copy(), p.copy()
    stood = True
    for k in range(len(model.signals)):
        if stood and not rests[k]:
            misled = ekf.P[:, 1] / model.noise[1] * model.unheard_m / model.step_s
            ekf.P += np.outer(misled, misled)
        stood = rests[k]
        f = derived(lambda state, k=k: moved(state, model, k, rests[k]), ekf.x)
        noise = model.rest_process if rests[k] else model.process + scaled(ekf.x, model, k)
        ekf.x = moved(ekf.x, model, k, rests[k])
        ekf.P = f @ ekf.P @ f.T + np.diag(noise)
        rows = [(model.signals[k, 4], lambda state, k=k: lateral(state, model, k))]
        if rests[k]:
            rows.append((0.0, lambda state: state[1]))
            rows += [(model.signals[k, i], lambda state, i=i: state[4 + i]) for i in range(3)]
        variances = [model.rest_lateral, *model.noise[1:]] if rests[k] else model.noise
        for (z, row), variance in zip(rows, variances, strict=False):
            ekf.update(
                np.array([z]),
                lambda state, row=row: derived(row, state),
                lambda state, row=row: np.atleast_1d(row(state)),
                R=np.array([[variance]]),
            )
        m = out.covariances.shape[1]
        out.states[k], out.covariances[k] = ekf.x, ekf.P[:m, :m]
