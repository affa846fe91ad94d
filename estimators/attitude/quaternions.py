"""Quaternions (a, b, c, d), scalar first, body to global, to and from ZYX Euler angles."""

import numpy as np

from simrail.core.jit import FloatArray


def from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Unit quaternion (4,) of Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
    cr, sr = np.cos(0.5 * roll), np.sin(0.5 * roll)
    cp, sp = np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    cy, sy = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    return np.array(
        [
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ]
    )


def to_euler(quaternions: FloatArray, *, start_yaw_rad: float) -> FloatArray:
    """Roll, pitch and yaw of unit quaternions.

    Parameters
    ----------
    quaternions : ndarray (n, 4)
        Scalar first, body to global.
    start_yaw_rad : float
        The first yaw is given the turns that bring it closest to this.

    Returns
    -------
    ndarray (n, 3)
        rad; the yaw is unwrapped.
    """
    a, b, c, d = quaternions.T
    roll = np.arctan2(2.0 * (a * b + c * d), 1.0 - 2.0 * (b * b + c * c))
    pitch = np.arcsin(np.clip(2.0 * (a * c - b * d), -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(2.0 * (a * d + b * c), 1.0 - 2.0 * (c * c + d * d)))
    turns = np.round((start_yaw_rad - yaw[0]) / (2.0 * np.pi))
    return np.column_stack([roll, pitch, yaw + 2.0 * np.pi * turns])


def level(force: FloatArray) -> tuple[float, float]:
    """Roll and pitch, rad, at which gravity alone gives the specific force (3,) (EQUATIONS 0)."""
    x, y, z = (float(value) for value in force)
    return float(np.arctan2(y, z)), float(np.arctan2(-x, np.hypot(y, z)))
