"""Pose from rates and specific force alone: the integration that a perfect IMU would allow.

Proves that a truth is consistent with itself: its rates and accelerations integrate back to its poses. It
is no estimator: it starts from a known pose.
"""

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from simrail.core.columns import ACCEL, ATTITUDE, GYRO, POSITION, VELOCITY
from simrail.core.jit import FloatArray, njit


@njit
def _derivative(
    q: FloatArray, w: FloatArray, f: FloatArray, gravity: float, dq: FloatArray, dv: FloatArray
) -> None:
    """Dq = q (0, w) / 2 and dv = C(q) f - g e_z, for a quaternion (scalar first) body to global."""
    a, b, c, d = q[0], q[1], q[2], q[3]
    dq[0] = 0.5 * (-b * w[0] - c * w[1] - d * w[2])
    dq[1] = 0.5 * (a * w[0] + c * w[2] - d * w[1])
    dq[2] = 0.5 * (a * w[1] + d * w[0] - b * w[2])
    dq[3] = 0.5 * (a * w[2] + b * w[1] - c * w[0])
    s = 1.0 / (a * a + b * b + c * c + d * d)
    dv[0] = s * (
        (a * a + b * b - c * c - d * d) * f[0] + 2 * (b * c - a * d) * f[1] + 2 * (b * d + a * c) * f[2]
    )
    dv[1] = s * (
        2 * (b * c + a * d) * f[0] + (a * a - b * b + c * c - d * d) * f[1] + 2 * (c * d - a * b) * f[2]
    )
    dv[2] = (
        s * (2 * (b * d - a * c) * f[0] + 2 * (c * d + a * b) * f[1] + (a * a - b * b - c * c + d * d) * f[2])
        - gravity
    )


@njit
def _integrate(gyro: FloatArray, accel: FloatArray, step: float, gravity: float, out: FloatArray) -> None:
    """Classical Runge-Kutta from sample to sample; gyro, accel (2 n - 1, 3) hold the midpoints, too."""
    q, v, p = out[0, :4].copy(), out[0, 4:7].copy(), out[0, 7:].copy()
    h = step
    dq, dv = np.empty((4, 4)), np.empty((4, 3))
    weight = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
    reach = np.array([0.0, 0.5, 0.5, 1.0])
    row = np.array([0, 1, 1, 2])
    for k in range(1, out.shape[0]):
        i = 2 * (k - 1)
        for stage in range(4):
            trial = q + reach[stage] * h * dq[stage - 1] if stage else q
            _derivative(trial, gyro[i + row[stage]], accel[i + row[stage]], gravity, dq[stage], dv[stage])
        for stage in range(4):
            q = q + weight[stage] * h * dq[stage]
        p = p + h * v + h * h / 6.0 * (dv[0] + dv[1] + dv[2])
        v = v + h / 6.0 * (dv[0] + 2.0 * dv[1] + 2.0 * dv[2] + dv[3])
        q = q / np.sqrt(np.sum(q * q))
        out[k, :4], out[k, 4:7], out[k, 7:] = q, v, p


def _with_midpoints(samples: FloatArray) -> FloatArray:
    """Samples (n, 3) and between them the value of the cubic through the four around: (2 n - 1, 3).

    Summed up, these midpoints weigh every inner sample alike: vibration near the Nyquist rate, which
    Simpson's alternating weights would turn into drift, averages out.
    """
    full = np.empty((2 * len(samples) - 1, 3))
    full[::2] = samples
    full[3:-3:2] = (9.0 * (samples[1:-2] + samples[2:-1]) - samples[:-3] - samples[3:]) / 16.0
    first, last = samples[:4], samples[:-5:-1]
    end = np.array([5.0, 15.0, -5.0, 1.0]) / 16.0
    full[1], full[-2] = end @ first, end @ last
    return full


def dead_reckon(signals: pd.DataFrame, start: pd.Series, *, gravity_mps2: float = 9.81) -> pd.DataFrame:
    """Integrate gyro and accelerometer from a known pose, with fourth-order quadrature.

    Parameters
    ----------
    signals : pandas.DataFrame
        Indexed by ``time_s``, uniform, columns `GYRO` + `ACCEL` (an ideal IMU, or a truth's motion).
    start : pandas.Series
        Position, velocity and attitude at the first sample: columns `POSITION`, `VELOCITY`, `ATTITUDE`.
    gravity_mps2 : float
        Gravity.

    Returns
    -------
    pandas.DataFrame
        At the same times: `POSITION`, `VELOCITY`, `ATTITUDE` (yaw unwrapped).
    """
    time = signals.index.to_numpy()
    out: FloatArray = np.empty((len(time), 10))
    yaw_pitch_roll = start[list(ATTITUDE)].to_numpy(dtype=float)[::-1]
    quaternion = Rotation.from_euler("ZYX", yaw_pitch_roll).as_quat()
    out[0] = [*np.roll(quaternion, 1), *start[list(VELOCITY)], *start[list(POSITION)]]
    gyro = _with_midpoints(signals[list(GYRO)].to_numpy(dtype=float))
    accel = _with_midpoints(signals[list(ACCEL)].to_numpy(dtype=float))
    _integrate(gyro, accel, (time[-1] - time[0]) / (len(time) - 1), gravity_mps2, out)
    angles = Rotation.from_quat(np.roll(out[:, :4], -1, axis=1)).as_euler("ZYX")[:, ::-1]
    angles[:, 2] = np.unwrap(angles[:, 2])
    columns = [*POSITION, *VELOCITY, *ATTITUDE]
    return pd.DataFrame(np.hstack([out[:, 7:], out[:, 4:7], angles]), index=signals.index, columns=columns)
