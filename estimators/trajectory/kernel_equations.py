"""Compiled equations of the trajectory smoother: what the IMU should show in a state, and the Jacobian.

Gonzalez-Carbajal et al. 2023 (paper 001), appendix 1, as EQUATIONS 3.2 and 3.3 have it; the printed misprints
of the Jacobian apart. What happens along the track comes as `TERMS` of each sample, made by
`simrail.estimators.trajectory.model`, so nothing here knows of tracks, recordings or data frames.
"""

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed

STATES = 12
ROLL, ROLL_RATE, PITCH, PITCH_RATE, YAW, YAW_RATE, Y, YD, YDD, Z, ZD, ZDD = range(STATES)

ROWS = 8
"""Measurements: three of the gyro, three of the accelerometer, two virtual positions."""

PACKED = STATES * (STATES + 1) // 2
"""Entries of a covariance's upper triangle, row by row."""

BLOCKS = ((0, 2), (2, 4), (4, 6), (6, 9), (9, 12))
"""First state of each block of Q, and the first beyond it."""

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


WIDTH = 16
"""Length of a row of the covariance and of the Jacobian in the loops: the last four are always zero, and
loops of sixteen fill the vector registers."""

RATE_COLUMNS = np.array(
    [[ROLL_RATE, PITCH, YAW_RATE], [PITCH_RATE, ROLL, YAW_RATE], [YAW_RATE, ROLL, PITCH_RATE]]
)
"""States that each row of the gyro depends on."""

ANGLE_COLUMNS = np.array([[PITCH, YAW], [ROLL, YAW], [ROLL, PITCH]])
"""Angles that each row of the accelerometer depends on, besides all of y to z''."""

INTO = (ROLL, PITCH, YAW, Y, Y, YD, Z, Z, ZD)
ORIGIN = (ROLL_RATE, PITCH_RATE, YAW_RATE, YD, YDD, YDD, ZD, ZDD, ZDD)
"""Where F is not the identity (EQUATIONS 3.1), as `simrail.estimators.kalman.chain` takes it."""


@njit_borrowed
def shares(dt: float) -> tuple[float, ...]:
    """Entries of F at (`INTO`, `ORIGIN`): constant angular rates, constant accelerations of the place."""
    half = 0.5 * dt * dt
    return dt, dt, dt, dt, half, dt, dt, half, dt


@njit_borrowed
def constant_rows(rows: FloatArray) -> None:
    """What is always one in the rows (8, 16) of the Jacobian, which are zero before."""
    rows[0, ROLL_RATE] = rows[1, PITCH_RATE] = rows[2, YAW_RATE] = 1.0
    rows[4, YDD] = rows[5, ZDD] = rows[6, Y] = rows[7, Z] = 1.0


@njit_borrowed
def linearise(
    x: FloatArray,
    track: FloatArray,
    slips: FloatArray,
    k: int,
    gravity: float,
    g: FloatArray,
    rows: FloatArray,
) -> None:
    """What gyro and accelerometer should show in state x, and how that depends on x (EQUATIONS 3.2, 3.3).

    Parameters
    ----------
    x : ndarray (12,)
        State.
    track : ndarray (n, 15), k : int
        `TERMS` of all samples, and which sample.
    slips : ndarray (n, 3) or (0, 3)
        Not empty: spoil the Jacobian as the appendix of paper 001 prints it: J43, J5,10 and J61 (EQUATIONS
        1.3), by v V - v V^2, h^2, h^2 V^2 with V the speed and v, h the curvatures.
    gravity : float
        m/s2.
    g : ndarray (8,), out
        Angular rate and specific force, body axes; y and z.
    rows : ndarray (8, 16), in and out
        Jacobian; what never changes must stand there already (`constant_rows`).
    """
    d, e, f = x[ROLL] - track[k, 0], x[PITCH] - track[k, 1], x[YAW] - track[k, 2]
    xy, yy, zy = track[k, 6], track[k, 7], track[k, 8]
    xz, yz, zz = track[k, 9], track[k, 10], track[k, 11]
    t, v, h = track[k, 12], track[k, 13], track[k, 14]
    y, yd, ydd, z, zd, zdd = x[Y], x[YD], x[YDD], x[Z], x[ZD], x[ZDD]
    # Acceleration of the body in the axes of the track: origin + M r + 2 w x r' + r''.
    ax = track[k, 3] + xy * y + xz * z - h * yd + v * zd
    ay = track[k, 4] + yy * y + yz * z - t * zd + ydd
    az = track[k, 5] + zy * y + zz * z + t * yd + zdd
    # Body rates of first order in roll and pitch.
    g[0] = x[ROLL_RATE] - x[PITCH] * x[YAW_RATE]
    g[1] = x[PITCH_RATE] + x[ROLL] * x[YAW_RATE]
    g[2] = x[YAW_RATE] - x[ROLL] * x[PITCH_RATE]
    # Force = (I - [rho]x) a + g (-pitch, roll, 1), rho = (d, e, f).
    g[3] = ax + f * ay - e * az - gravity * x[PITCH]
    g[4] = ay - f * ax + d * az + gravity * x[ROLL]
    g[5] = az + e * ax - d * ay + gravity
    g[6], g[7] = y, z
    # The same, differentiated.
    rows[0, PITCH], rows[0, YAW_RATE] = -x[YAW_RATE], -x[PITCH]
    rows[1, ROLL], rows[1, YAW_RATE] = x[YAW_RATE], x[ROLL]
    rows[2, ROLL], rows[2, PITCH_RATE] = -x[PITCH_RATE], -x[ROLL]
    rows[3, PITCH], rows[3, YAW] = -az - gravity, ay
    rows[3, Y], rows[3, YD], rows[3, YDD] = xy + f * yy - e * zy, -h - e * t, f
    rows[3, Z], rows[3, ZD], rows[3, ZDD] = xz + f * yz - e * zz, v - f * t, -e
    rows[4, ROLL], rows[4, YAW] = az + gravity, -ax
    rows[4, Y], rows[4, YD] = yy - f * xy + d * zy, f * h + d * t
    rows[4, Z], rows[4, ZD], rows[4, ZDD] = yz - f * xz + d * zz, -t - f * v, d
    rows[5, ROLL], rows[5, PITCH] = -ay, ax
    rows[5, Y], rows[5, YD], rows[5, YDD] = zy + e * xy - d * yy, t - e * h, -d
    rows[5, Z], rows[5, ZD] = zz + e * xz - d * yz, e * v + d * t
    if slips.shape[0] > 0:
        rows[3, PITCH] += slips[k, 0]
        rows[4, Z] += slips[k, 1] + d * slips[k, 2]
        rows[5, ROLL] += 2.0 * ydd


@njit_borrowed
def pack(p: FloatArray, packed: FloatArray, k: int) -> None:
    """Upper triangle of P (12, 16), row by row, into row k of ``packed`` (n, 78)."""
    at = 0
    for i in range(STATES):
        for c in range(i, STATES):
            packed[k, at] = p[i, c]
            at += 1


@njit_borrowed
def unpack(packed: FloatArray, k: int, p: FloatArray) -> None:
    """Row k of ``packed`` (n, 78) as a full matrix (12, 16)."""
    at = 0
    for i in range(STATES):
        for c in range(i, STATES):
            p[i, c] = p[c, i] = packed[k, at]
            at += 1
