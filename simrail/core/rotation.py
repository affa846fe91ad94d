"""Rotation matrices and ZYX Euler angles (EQUATIONS section 0), for arrays of samples."""

import numpy as np

from simrail.core.jit import FloatArray


def rotation_matrix(angles: FloatArray) -> FloatArray:
    """Body-to-global rotation Rz(yaw) Ry(pitch) Rx(roll) (paper 000, Eq. 2): (n, 3) to (n, 3, 3)."""
    cr, cp, cy = np.cos(angles).T
    sr, sp, sy = np.sin(angles).T
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def euler_angles(rotation: FloatArray) -> FloatArray:
    """Roll, pitch, yaw (yaw unwrapped) of rotation matrices: (n, 3, 3) to (n, 3)."""
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))
    return np.column_stack([roll, pitch, yaw])
