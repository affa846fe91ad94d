"""Rigid-body motion from the coordinates of Exudyn's Rxyz nodes.

Exudyn turns a body by A = Rx(a) Ry(b) Rz(c); the rest of simrail speaks ZYX Euler angles, body rates
and body angular accelerations. This is pure kinematics: nothing is differentiated numerically.
"""

from __future__ import annotations

import numpy as np

from simrail.jit import FloatArray
from simrail.truth import euler_angles


def angles_of(rotation: FloatArray) -> FloatArray:
    """Angles a, b, c (n, 3) of rotation matrices A = Rx(a) Ry(b) Rz(c) (n, 3, 3)."""
    return np.column_stack(
        [
            np.arctan2(-rotation[:, 1, 2], rotation[:, 2, 2]),
            np.arcsin(np.clip(rotation[:, 0, 2], -1.0, 1.0)),
            np.arctan2(-rotation[:, 0, 1], rotation[:, 0, 0]),
        ]
    )


def rotation_of(angles: FloatArray) -> FloatArray:
    """Rotation matrices A = Rx(a) Ry(b) Rz(c) (n, 3, 3) of angles a, b, c (n, 3)."""
    ca, cb, cc = np.cos(angles).T
    sa, sb, sc = np.sin(angles).T
    rows = [
        [cb * cc, -cb * sc, sb],
        [sa * sb * cc + ca * sc, ca * cc - sa * sb * sc, -sa * cb],
        [sa * sc - ca * sb * cc, ca * sb * sc + sa * cc, ca * cb],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def body_motion(coordinates: FloatArray, rates: FloatArray, accelerations: FloatArray) -> FloatArray:
    """Motion of one body from its six coordinates and their two derivatives.

    Parameters
    ----------
    coordinates, rates, accelerations : ndarray (n, 6)
        x, y, z, a, b, c and their derivatives.

    Returns
    -------
    ndarray (n, 18)
        Position, velocity, acceleration (global), roll pitch yaw (ZYX; yaw unwrapped within the call),
        angular rate and angular acceleration (body components): the columns of `simrail.truth`.
    """
    angles, first, second = coordinates[:, 3:], rates[:, 3:], accelerations[:, 3:]
    rotation = rotation_of(angles)
    ca, cb = np.cos(angles[:, 0]), np.cos(angles[:, 1])
    sa, sb = np.sin(angles[:, 0]), np.sin(angles[:, 1])
    zero, one = np.zeros_like(ca), np.ones_like(ca)
    # The axes about which a, b and c turn, and how fast the second and third axis swing.
    axis_a = np.column_stack([one, zero, zero])
    axis_b = np.column_stack([zero, ca, sa])
    axis_c = np.column_stack([sb, -sa * cb, ca * cb])
    a1, b1, c1 = first[:, 0:1], first[:, 1:2], first[:, 2:3]
    omega = a1 * axis_a + b1 * axis_b + c1 * axis_c
    swing_b = a1 * np.cross(axis_a, axis_b)
    swing_c = np.cross(a1 * axis_a + b1 * axis_b, axis_c)
    alpha = (
        second[:, 0:1] * axis_a
        + second[:, 1:2] * axis_b
        + second[:, 2:3] * axis_c
        + b1 * swing_b
        + c1 * swing_c
    )
    return np.hstack(
        [
            coordinates[:, :3],
            rates[:, :3],
            accelerations[:, :3],
            euler_angles(rotation),
            np.einsum("nji,nj->ni", rotation, omega),
            np.einsum("nji,nj->ni", rotation, alpha),
        ]
    )
