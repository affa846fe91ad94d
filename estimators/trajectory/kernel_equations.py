"""Compiled equations of the trajectory smoother: what the IMU should show in a state, and the Jacobian.

Gonzalez-Carbajal et al. 2023 (paper 001), appendix 1, as EQUATIONS 3.2 and 3.3 have it; the printed misprints
of the Jacobian apart. What happens along the track comes as `TERMS` of each sample, made by
`simrail.estimators.trajectory.model`, so nothing here knows of tracks, recordings or data frames.
"""

from __future__ import annotations

from simrail.core.jit import FloatArray, njit_borrowed

STATES = 12
ROLL, ROLL_RATE, PITCH, PITCH_RATE, YAW, YAW_RATE, Y, YD, YDD, Z, ZD, ZDD = range(STATES)

ROWS = 8
"""Measurements: three of the gyro, three of the accelerometer, two virtual positions."""

TERMS = (
    "roll_rad",
    "pitch_rad",
    "yaw_rad",
    "ax_mps2",
    "ay_mps2",
    "az_mps2",
    "ax_of_y",
    "ay_of_y",
    "az_of_y",
    "ax_of_z",
    "ay_of_z",
    "az_of_z",
    "turn_x",
    "turn_y",
    "turn_z",
)
"""What the filter takes of the track at each sample, in this order: angles of the track frame (rad), its
acceleration (m/s2), acceleration per m of y and of z in it (1/s2), and twice its angular rate (rad/s)."""


@njit_borrowed
def measured(x: FloatArray, track: FloatArray, k: int, gravity: float, g: FloatArray, j: FloatArray) -> None:
    """What gyro and accelerometer should show in state x, and how that depends on x (EQUATIONS 3.2, 3.3).

    Parameters
    ----------
    x : ndarray (12,)
        State.
    track : ndarray (n, 15), k : int
        `TERMS` of all samples, and which sample.
    gravity : float
        m/s2.
    g : ndarray (6,), out
        Angular rate and specific force, body axes.
    j : ndarray (3, 8), out
        Jacobian of the specific force. Columns: the first and the second of the angles that the row
        depends on (X: pitch, yaw; Y: roll, yaw; Z: roll, pitch), then y, yd, ydd, z, zd, zdd. The rows of
        the gyro are so simple that they stand where they are used.
    """
    d, e, f = x[ROLL] - track[k, 0], x[PITCH] - track[k, 1], x[YAW] - track[k, 2]
    xy, yy, zy = track[k, 6], track[k, 7], track[k, 8]
    xz, yz, zz = track[k, 9], track[k, 10], track[k, 11]
    t, v, h = track[k, 12], track[k, 13], track[k, 14]
    y, yd, ydd, z, zd, zdd = x[Y], x[YD], x[YDD], x[Z], x[ZD], x[ZDD]
    ax = track[k, 3] + xy * y + xz * z - h * yd + v * zd
    ay = track[k, 4] + yy * y + yz * z - t * zd + ydd
    az = track[k, 5] + zy * y + zz * z + t * yd + zdd
    g[0] = x[ROLL_RATE] - x[PITCH] * x[YAW_RATE]
    g[1] = x[PITCH_RATE] + x[ROLL] * x[YAW_RATE]
    g[2] = x[YAW_RATE] - x[ROLL] * x[PITCH_RATE]
    g[3] = ax + f * ay - e * az - gravity * x[PITCH]
    g[4] = ay - f * ax + d * az + gravity * x[ROLL]
    g[5] = az + e * ax - d * ay + gravity
    j[0, 0], j[0, 1] = -az - gravity, ay
    j[0, 2], j[0, 3], j[0, 4] = xy + f * yy - e * zy, -h - e * t, f
    j[0, 5], j[0, 6], j[0, 7] = xz + f * yz - e * zz, v - f * t, -e
    j[1, 0], j[1, 1] = az + gravity, -ax
    j[1, 2], j[1, 3], j[1, 4] = yy - f * xy + d * zy, f * h + d * t, 1.0
    j[1, 5], j[1, 6], j[1, 7] = yz - f * xz + d * zz, -t - f * v, d
    j[2, 0], j[2, 1] = -ay, ax
    j[2, 2], j[2, 3], j[2, 4] = zy + e * xy - d * yy, t - e * h, -d
    j[2, 5], j[2, 6], j[2, 7] = zz + e * xz - d * yz, e * v + d * t, 1.0


@njit_borrowed
def misprint(x: FloatArray, track: FloatArray, slips: FloatArray, k: int, j: FloatArray) -> None:
    """Spoil the Jacobian as the appendix of paper 001 prints it: J43, J5,10 and J61 (EQUATIONS 1.3).

    ``slips`` (n, 3): v V - v V^2, h^2, h^2 V^2 with V the speed and v, h the curvatures.
    """
    j[0, 0] += slips[k, 0]
    j[1, 5] += slips[k, 1] + (x[ROLL] - track[k, 0]) * slips[k, 2]
    j[2, 0] += 2.0 * x[YDD]
