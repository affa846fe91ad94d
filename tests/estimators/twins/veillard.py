"""The eleven-state EKF by filterpy: short, readable, what its kernel is held to.

Veillard et al. 2016 (paper 003), Eqs. 3 to 7. The Jacobian is that of vectors: derivatives of the rotation
matrix and of the matrix from Euler rates to body rates, not the expanded rows of the kernel.
"""

from __future__ import annotations

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from simrail.estimators.attitude.veillard_kernel import Found, Model

from simrail.core.jit import FloatArray


def _turns(roll: float, pitch: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rotations about X and Y from the level frame to the body, and their derivatives."""
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    about_x = np.array([[1, 0, 0], [0, cr, sr], [0, -sr, cr]])
    about_y = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    d_x = np.array([[0, 0, 0], [0, -sr, cr], [0, -cr, -sr]])
    d_y = np.array([[-sp, 0, -cp], [0, 0, 0], [cp, 0, -sp]])
    return about_x, about_y, d_x, d_y


def measured(x: FloatArray, gravity: float) -> tuple[FloatArray, FloatArray]:
    """All nine measurements of a state and their Jacobian (9, 11).

    w = (roll', 0, 0) + Rx (0, pitch', 0) + Rx Ry (0, 0, yaw') + bias,   f = a + Rx Ry (0, 0, g)
    """
    roll_rate, pitch_rate, yaw_rate, roll, pitch = x[:5]
    rx, ry, dx, dy = _turns(roll, pitch)
    ex, ey, ez = np.eye(3)
    bias = np.array([x[9], x[10], 0.0])
    w = roll_rate * ex + rx @ (pitch_rate * ey + ry @ (yaw_rate * ez)) + bias
    f = x[5:8] + rx @ ry @ (gravity * ez)
    h = np.zeros((9, 11))
    h[:3, 0], h[:3, 1], h[:3, 2] = ex, rx @ ey, rx @ ry @ ez
    h[:3, 3] = dx @ (pitch_rate * ey + ry @ (yaw_rate * ez))
    h[:3, 4] = rx @ dy @ (yaw_rate * ez)
    h[0, 9] = h[1, 10] = 1.0
    h[3:6, 5:8] = np.eye(3)
    h[3:6, 3], h[3:6, 4] = dx @ ry @ (gravity * ez), rx @ dy @ (gravity * ez)
    h[6, 3] = h[7, 4] = h[8, 8] = 1.0
    return np.concatenate([w, f, [roll, pitch, x[8]]]), h


def leaning(model: Model, k: int, x: FloatArray) -> FloatArray:
    """Roll and pitch by the accelerometer (Eq. 4), less the motion of the state if compensated."""
    fx, fy, fz = model.signals[k, 3:]
    if not model.compensated:
        return np.array([np.arctan(fy / model.gravity), np.arcsin(np.clip(-fx / model.gravity, -1, 1))])
    turned = measured(x, 0.0)[0][:3] - [x[9], x[10], 0.0]
    fx, fy, fz = model.signals[k, 3:] - [x[5], 0, 0] - np.cross(turned, [x[8], 0, 0])
    return np.array([np.arctan2(fy, fz), np.arcsin(np.clip(-fx / model.gravity, -1, 1))])


def filterpy_eleven_states(model: Model, out: Found) -> None:
    """The same filter by filterpy: block update, Joseph form; arguments as in the kernel."""
    dt, n = model.step_s, len(model.signals)
    f = np.eye(11)
    f[3, 0] = f[4, 1] = f[8, 5] = dt
    ekf = ExtendedKalmanFilter(dim_x=11, dim_z=9)
    ekf.x, ekf.P, ekf.F, ekf.Q = model.start.copy(), np.diag(model.start_variance), f, np.diag(model.process)
    added = np.zeros(n + 1)
    inclination = leaning(model, 0, ekf.x)
    for k in range(n):
        if k > 0:
            added[k] = added[k - 1] + dt * ekf.x[5]
            ekf.predict()
            gyro = model.signals[k, :3].copy()
            if model.compensated:
                gyro[:2] -= ekf.x[9:]
            rx, ry, _, _ = _turns(*inclination)
            rates = np.linalg.solve(np.column_stack([np.eye(3)[0], rx[:, 1], (rx @ ry)[:, 2]]), gyro)
            led = inclination + dt * rates[:2]
            share = max(dt / (model.time_constant_s + dt), 1.0 / (k + 1))
            inclination = (1.0 - share) * led + share * leaning(model, k, ekf.x)
        speed = model.speed[k] + added[k] - added[max(k - model.late, 0)]
        rows = slice(0, 8 if np.isnan(speed) else 9)
        z = np.concatenate([model.signals[k], inclination, [speed]])[rows]
        ekf.update(
            z,
            lambda x, rows=rows: measured(x, model.gravity)[1][rows],
            lambda x, rows=rows: measured(x, model.gravity)[0][rows],
            R=np.diag(model.noise[rows]),
        )
        out.states[k], out.variances[k] = ekf.x, np.diag(ekf.P)
        out.innovations[k, :6], out.innovations[k, 6] = ekf.y[:6], ekf.y @ ekf.SI @ ekf.y
