"""Compiled loops of the trajectory smoother: the filter, the way back, and draws of the smoother's error.

Gonzalez-Carbajal et al. 2023 (paper 001), section 3 and appendix 1, with the errata of EQUATIONS 1.3; what
the IMU should show in a state, and its Jacobian, are as EQUATIONS 3.2 and 3.3 have them, printed misprints
apart. What happens along the track comes as `TERMS` of each sample, made by
`simrail.estimators.trajectory.model`, so nothing here knows of tracks, recordings or data frames.

The algebra is that of `simrail.estimators.kalman`; the structure of the model makes it fast: the transition
is a few chains of integrators, and a row of the Jacobian has few entries (35 of 96). The ways back use what
the filter left behind. Random numbers come from outside.

Not here: the geometry of the rails that follows from a draw (`simrail.estimators.trajectory.draws`).
"""

from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import (
    chain,
    chain_back,
    chain_covariance,
    log_density,
    mirror,
    withdraw,
)

from simrail.core.jit import FloatArray, IntArray, njit, njit_borrowed, njit_inline

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

MIRRORED = 16
"""Samples after which a covariance is made symmetric anew (`simrail.estimators.kalman.mirror`): what rounding
leaves grows by a few units in the last place until then, and at every sample it takes a tenth of the time."""

INTO = (ROLL, PITCH, YAW, Y, Y, YD, Z, Z, ZD)
ORIGIN = (ROLL_RATE, PITCH_RATE, YAW_RATE, YD, YDD, YDD, ZD, ZDD, ZDD)
"""Where F is not the identity (EQUATIONS 3.1), as `simrail.estimators.kalman.chain` takes it."""


class Model(NamedTuple):
    """What the filter takes of a ride of n samples.

    Attributes
    ----------
    signals : ndarray (n, 6)
        Angular rate less its bias, rad/s, and specific force, m/s2, body axes.
    track : ndarray (n, 15)
        `TERMS`.
    slips : ndarray (n, 3) or (0, 3)
        See `linearise`; of no rows for the corrected equations.
    kinds : ndarray of int (n,)
        Which of the c rows of ``process`` and ``noise`` holds at a sample, and over the step to it.
    process : ndarray (c, 12, 12)
        Q, in five blocks.
    noise : ndarray (c, 8)
        Variances U of the measurements.
    virtual : ndarray (2,)
        Virtual positions y and z, m.
    start, start_variance : ndarray (12,)
        State before the first update, and its variances.
    step_s, gravity : float
        Sample interval, s, and gravity, m/s2.
    """

    signals: FloatArray
    track: FloatArray
    slips: FloatArray
    kinds: IntArray
    process: FloatArray
    noise: FloatArray
    virtual: FloatArray
    start: FloatArray
    start_variance: FloatArray
    step_s: float
    gravity: float


class Past(NamedTuple):
    """What the filter leaves behind for the way back, of n samples; of no rows if nothing follows.

    Attributes
    ----------
    states, covariance : ndarray (n, 12), (n, 78)
        Predicted states, and their covariances' upper triangles row by row.
    gains, scaled : ndarray (n, 8, 12), (n, 8, 2)
        K, and (e/s, 1/s) of each scalar update.
    """

    states: FloatArray
    covariance: FloatArray
    gains: FloatArray
    scaled: FloatArray


class Filtered(NamedTuple):
    """What the filter finds at each of n samples; an array of no rows is not wanted and not written.

    Attributes
    ----------
    states, covariance : ndarray (n, 12), (n, 78)
        Filtered, and packed as in `Past`.
    innovations : ndarray (n, 7)
        Measured minus predicted rates and forces, and the normalised innovation squared of these six.
    likelihoods : ndarray (n,)
        Log-likelihood of each sample given those before it.
    """

    states: FloatArray
    covariance: FloatArray
    innovations: FloatArray
    likelihoods: FloatArray


def room_for_past(n: int) -> Past:
    """Arrays of n rows."""
    shapes = (n, STATES), (n, PACKED), (n, ROWS, STATES), (n, ROWS, 2)
    return Past(*(np.empty(shape) for shape in shapes))


def room_for_filtered(*, states: int = 0, innovations: int = 0, likelihoods: int = 0) -> Filtered:
    """Arrays of as many rows as are wanted of each."""
    shapes = (states, STATES), (states, PACKED), (innovations, ROWS - 1), (likelihoods,)
    return Filtered(*(np.empty(shape) for shape in shapes))


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


@njit_inline
def write_row(rows: FloatArray, k: int, values: FloatArray, count: int) -> None:
    """So many values into row k, by elements (`simrail.estimators.kalman.keep` says why)."""
    for i in range(count):
        rows[k, i] = values[i]


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


@njit_borrowed
def predict(x: FloatArray, p: FloatArray, process: FloatArray, kind: int, dt: float) -> None:
    """X <- F x, P <- F P F' + Q in place (EQUATIONS 3.1); Q is ``process[kind]``, (c, 12, 12)."""
    share = shares(dt)
    chain(x, INTO, ORIGIN, share)
    chain_covariance(p, INTO, ORIGIN, share)
    for first, end in BLOCKS:
        for i in range(first, end):
            for c in range(first, end):
                p[i, c] += process[kind, i, c]


@njit_inline
def across(p: FloatArray, rows: FloatArray, m: int, dx: FloatArray, v: FloatArray) -> tuple[float, float]:
    """V (16,) = P h' for row m of the Jacobian by the entries that it has; returns h v and h dx."""
    if m < 3:
        a, b, c = RATE_COLUMNS[m, 0], RATE_COLUMNS[m, 1], RATE_COLUMNS[m, 2]
        ha, hb, hc = rows[m, a], rows[m, b], rows[m, c]
        for i in range(WIDTH):
            v[i] = ha * p[a, i] + hb * p[b, i] + hc * p[c, i]
        return ha * v[a] + hb * v[b] + hc * v[c], ha * dx[a] + hb * dx[b] + hc * dx[c]
    if m < 6:
        a, b = ANGLE_COLUMNS[m - 3, 0], ANGLE_COLUMNS[m - 3, 1]
        ha, hb, hy, hyd, hydd = rows[m, a], rows[m, b], rows[m, Y], rows[m, YD], rows[m, YDD]
        hz, hzd, hzdd = rows[m, Z], rows[m, ZD], rows[m, ZDD]
        for i in range(WIDTH):
            v[i] = (
                ha * p[a, i]
                + hb * p[b, i]
                + hy * p[Y, i]
                + hyd * p[YD, i]
                + hydd * p[YDD, i]
                + hz * p[Z, i]
                + hzd * p[ZD, i]
                + hzdd * p[ZDD, i]
            )
        spread = ha * v[a] + hb * v[b] + hy * v[Y] + hyd * v[YD] + hydd * v[YDD]
        moved = ha * dx[a] + hb * dx[b] + hy * dx[Y] + hyd * dx[YD] + hydd * dx[YDD]
        spread += hz * v[Z] + hzd * v[ZD] + hzdd * v[ZDD]
        return spread, moved + hz * dx[Z] + hzd * dx[ZD] + hzdd * dx[ZDD]
    a = Y if m == 6 else Z
    for i in range(WIDTH):
        v[i] = p[a, i]
    return v[a], dx[a]


@njit_inline
def mirror_at(p: FloatArray, k: int) -> None:
    """`simrail.estimators.kalman.mirror` at every so many samples (`MIRRORED`)."""
    if k % MIRRORED == 0:
        mirror(p)


@njit_inline
def less_square(p: FloatArray, v: FloatArray, inverse: float) -> None:
    """P <- P - v v'/s in place, (12, 16) and (16,); written out as `less_outer`, for the same reason."""
    g0, g1, g2, g3 = v[0] * inverse, v[1] * inverse, v[2] * inverse, v[3] * inverse
    g4, g5, g6, g7 = v[4] * inverse, v[5] * inverse, v[6] * inverse, v[7] * inverse
    g8, g9, g10, g11 = v[8] * inverse, v[9] * inverse, v[10] * inverse, v[11] * inverse
    for c in range(WIDTH):
        u = v[c]
        p[0, c] -= g0 * u
        p[1, c] -= g1 * u
        p[2, c] -= g2 * u
        p[3, c] -= g3 * u
        p[4, c] -= g4 * u
        p[5, c] -= g5 * u
        p[6, c] -= g6 * u
        p[7, c] -= g7 * u
        p[8, c] -= g8 * u
        p[9, c] -= g9 * u
        p[10, c] -= g10 * u
        p[11, c] -= g11 * u


@njit
def trajectory_filter(model: Model, past: Past, out: Filtered) -> float:
    """Run the filter; fills ``past`` and ``out``.

    With J_m the rows of the Jacobian at the predicted state x and dx = 0 at first, for m = 1..8:

        e = z_m - g_m(x) - J_m dx,   s = J_m P J_m' + U_m,   K = P J_m'/s
        dx += K e,   P -= K s K',    log-likelihood -= (e^2/s + ln 2 pi s)/2

    which is the update with all eight at once.

    Returns
    -------
    float
        Log-likelihood of all measurements, the virtual ones among them.
    """
    # Named once, before the loop: numba counts references wherever an array is taken out of a tuple.
    signals, track, slips, kinds, process, noise, virtual, start, variance, step_s, gravity = model
    before, before_covariance, gains, scaled = past
    after, after_covariance, innovations, likelihoods = out
    x, p = start.copy(), np.zeros((STATES, WIDTH))
    v, dx, gain = np.zeros(WIDTH), np.zeros(STATES), np.zeros(STATES)
    residual, rows = np.zeros(ROWS), np.zeros((ROWS, WIDTH))
    nis = likelihood = 0.0
    constant_rows(rows)
    for i in range(STATES):
        p[i, i] = variance[i]
    for k in range(signals.shape[0]):
        kind = kinds[k]
        if k > 0:
            predict(x, p, process, kind, step_s)
            mirror_at(p, k)
        if before.shape[0] > 0:
            write_row(before, k, x, STATES)
            pack(p, before_covariance, k)
        linearise(x, track, slips, k, gravity, residual, rows)
        for m in range(6):
            residual[m] = signals[k, m] - residual[m]
        residual[6], residual[7] = virtual[0] - residual[6], virtual[1] - residual[7]
        dx[:] = 0.0
        squares, product = 0.0, 1.0
        for m in range(ROWS):
            spread, moved = across(p, rows, m, dx, v)
            error, s = residual[m] - moved, spread + noise[kind, m]
            inverse = 1.0 / s
            less_square(p, v, inverse)
            for i in range(STATES):
                gain[i] = v[i] * inverse
                dx[i] += gain[i] * error
            squares += error * error * inverse
            product *= s
            if m == 5:
                nis = squares
            if gains.shape[0] > 0:
                for i in range(STATES):
                    gains[k, m, i] = gain[i]
                scaled[k, m, 0], scaled[k, m, 1] = error * inverse, inverse
        for i in range(STATES):
            x[i] += dx[i]
        of_sample = log_density(squares, product, ROWS)
        likelihood += of_sample
        if likelihoods.shape[0] > 0:
            likelihoods[k] = of_sample
        if innovations.shape[0] > 0:
            write_row(innovations, k, residual, 6)
            innovations[k, 6] = nis
        if after.shape[0] > 0:
            write_row(after, k, x, STATES)
            pack(p, after_covariance, k)
    return likelihood


@njit_borrowed
def packed_product(packed: FloatArray, k: int, lam: FloatArray, out: FloatArray) -> None:
    """Out (12,) = P lam, with P row k of ``packed`` (n, 78)."""
    for i in range(STATES):
        out[i] = 0.0
    at = 0
    for i in range(STATES):
        out[i] += packed[k, at] * lam[i]
        at += 1
        for c in range(i + 1, STATES):
            out[i] += packed[k, at] * lam[c]
            out[c] += packed[k, at] * lam[i]
            at += 1


@njit_inline
def dot(a: FloatArray, b: FloatArray) -> float:
    """Sum of twelve products, in parts that need not wait for each other, in the order of `row_times`."""
    first = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    second = a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
    third = a[6] * b[6] + a[7] * b[7] + a[8] * b[8]
    return float(first + second + (third + a[9] * b[9] + a[10] * b[10] + a[11] * b[11]))


@njit_inline
def row_times(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Out (16,) = a B with a row a (12,) and a matrix B (12, 16).

    Written out, so that the compiler keeps the sums in vector registers.
    """
    a0, a1, a2, a3, a4, a5 = a[0], a[1], a[2], a[3], a[4], a[5]
    a6, a7, a8, a9, a10, a11 = a[6], a[7], a[8], a[9], a[10], a[11]
    for c in range(WIDTH):
        first = a0 * b[0, c] + a1 * b[1, c] + a2 * b[2, c]
        second = a3 * b[3, c] + a4 * b[4, c] + a5 * b[5, c]
        third = a6 * b[6, c] + a7 * b[7, c] + a8 * b[8, c]
        out[c] = first + second + (third + a9 * b[9, c] + a10 * b[10, c] + a11 * b[11, c])


@njit_inline
def less_outer(info: FloatArray, h: FloatArray, w: FloatArray) -> None:
    """Lam <- Lam - h' w - w' h in place, (12, 16) and (16,).

    Written out over the rows: else the compiler takes the numbers one by one.
    """
    h0, h1, h2, h3, h4, h5 = h[0], h[1], h[2], h[3], h[4], h[5]
    h6, h7, h8, h9, h10, h11 = h[6], h[7], h[8], h[9], h[10], h[11]
    w0, w1, w2, w3, w4, w5 = w[0], w[1], w[2], w[3], w[4], w[5]
    w6, w7, w8, w9, w10, w11 = w[6], w[7], w[8], w[9], w[10], w[11]
    for c in range(WIDTH):
        v, u = w[c], h[c]
        info[0, c] -= h0 * v + w0 * u
        info[1, c] -= h1 * v + w1 * u
        info[2, c] -= h2 * v + w2 * u
        info[3, c] -= h3 * v + w3 * u
        info[4, c] -= h4 * v + w4 * u
        info[5, c] -= h5 * v + w5 * u
        info[6, c] -= h6 * v + w6 * u
        info[7, c] -= h7 * v + w7 * u
        info[8, c] -= h8 * v + w8 * u
        info[9, c] -= h9 * v + w9 * u
        info[10, c] -= h10 * v + w10 * u
        info[11, c] -= h11 * v + w11 * u


@njit_inline
def through_update(
    info: FloatArray, h: FloatArray, gain: FloatArray, error: float, inverse: float, v: FloatArray
) -> None:
    """`simrail.estimators.kalman.withdraw` and `withdraw_information` at once, on padded arrays.

    The first of the columns that fill up ``info`` is lam, which then costs nothing of its own: h is 0 there.
    Specialised by hand: on arrays of any shape the information of a sample takes three times as long.
    """
    row_times(gain, info, v)
    half = 0.5 * (inverse + dot(gain, v))
    for i in range(WIDTH):
        v[i] -= half * h[i]
    v[STATES] += error
    less_outer(info, h, v)


@njit_inline
def withdraw_mean(lam: FloatArray, h: FloatArray, gain: FloatArray, error: float) -> None:
    """What `through_update` does to lam, to the bit."""
    total = dot(gain, lam) + error
    for i in range(STATES):
        lam[i] -= h[i] * total


@njit_inline
def information_back(info: FloatArray, dt: float) -> None:
    """`simrail.estimators.kalman.chain_information` with F of `INTO` and `ORIGIN`, row by row at once."""
    half = 0.5 * dt * dt
    for c in range(WIDTH):
        y, yd, z, zd = info[Y, c], info[YD, c], info[Z, c], info[ZD, c]
        info[ROLL_RATE, c] += dt * info[ROLL, c]
        info[PITCH_RATE, c] += dt * info[PITCH, c]
        info[YAW_RATE, c] += dt * info[YAW, c]
        info[YD, c], info[YDD, c] = yd + dt * y, info[YDD, c] + dt * yd + half * y
        info[ZD, c], info[ZDD, c] = zd + dt * z, info[ZDD, c] + dt * zd + half * z
    for i in range(STATES):
        y, yd, z, zd = info[i, Y], info[i, YD], info[i, Z], info[i, ZD]
        info[i, ROLL_RATE] += dt * info[i, ROLL]
        info[i, PITCH_RATE] += dt * info[i, PITCH]
        info[i, YAW_RATE] += dt * info[i, YAW]
        info[i, YD], info[i, YDD] = yd + dt * y, info[i, YDD] + dt * yd + half * y
        info[i, ZD], info[i, ZDD] = zd + dt * z, info[i, ZDD] + dt * zd + half * z


@njit_inline
def shrink(
    info: FloatArray, p: FloatArray, chosen: IntArray, v: FloatArray, packed: FloatArray, k: int
) -> None:
    """P - P Lam P of the chosen states into row k of ``packed``, its upper triangle row by row."""
    at = 0
    for a in range(chosen.shape[0]):
        row_times(p[chosen[a]], info, v)
        for b in range(a, chosen.shape[0]):
            packed[k, at] = p[chosen[a], chosen[b]] - dot(v, p[chosen[b]])
            at += 1


@njit
def trajectory_back(
    model: Model, past: Past, chosen: IntArray, smoothed: FloatArray, found: FloatArray
) -> None:
    """Smoothed states, and how sure they are.

    `simrail.estimators.kalman.fixed_interval` has the equations. The Jacobian is made again, which is cheaper
    than to fetch it.

    Parameters
    ----------
    model, past
        What the filter had, and what it left behind.
    chosen : ndarray of int (m,)
        States whose covariance is wanted, in increasing order.
    smoothed : ndarray (n, 12), out
        May be the states of ``past``, which are then replaced.
    found : ndarray (n, m (m + 1)/2), out
        Upper triangles of that covariance, row by row; of all twelve it may be that of ``past`` itself.
    """
    # Named once, before the loop, as in the filter. Backwards, so that a row may be replaced in place.
    track, slips, gravity, dt = model.track, model.slips, model.gravity, model.step_s
    states, covariance, gains, scaled = past
    lam, v, h, g = np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(ROWS)
    rows, info, p = np.zeros((ROWS, WIDTH)), np.zeros((STATES, WIDTH)), np.zeros((STATES, WIDTH))
    share, with_covariance = shares(dt), chosen.shape[0] > 0
    constant_rows(rows)
    for k in range(states.shape[0] - 1, -1, -1):
        linearise(states[k], track, slips, k, gravity, g, rows)
        for m in range(ROWS - 1, -1, -1):
            for i in range(WIDTH):
                h[i] = rows[m, i]
            if with_covariance:
                through_update(info, h, gains[k, m], scaled[k, m, 0], scaled[k, m, 1], v)
            else:
                withdraw_mean(lam, h, gains[k, m], scaled[k, m, 0])
        if with_covariance:
            for i in range(STATES):
                lam[i] = info[i, STATES]
        unpack(covariance, k, p)
        row_times(lam, p, v)
        for i in range(STATES):
            smoothed[k, i] = states[k, i] - v[i]
        if with_covariance:
            shrink(info, p, chosen, v, found, k)
            information_back(info, dt)
            mirror_at(info, k)
        else:
            chain_back(lam, INTO, ORIGIN, share)


@njit_borrowed
def outputs(
    states: FloatArray,
    packed: FloatArray,
    chosen: IntArray,
    beside: FloatArray,
    found: FloatArray,
    covariance: FloatArray,
) -> None:
    """Chosen states, their standard deviations and their covariance, from what a run left behind.

    Parameters
    ----------
    states : ndarray (n, 12)
    packed : ndarray (n, m (m + 1)/2) or (0, ...)
        Upper triangles of the covariance of the chosen states, row by row.
    chosen : ndarray of int (m,)
    beside : ndarray (m,)
        Added to the variances.
    found : ndarray (n, 2 m) or (n, m), out
        States, and then standard deviations where there are covariances.
    covariance : ndarray (n, m, m) or (0, m, m), out
    """
    m = chosen.shape[0]
    for k in range(states.shape[0]):
        for a in range(m):
            found[k, a] = states[k, chosen[a]]
        if covariance.shape[0] == 0:
            continue
        at = 0
        for a in range(m):
            variance = packed[k, at] + beside[a]
            covariance[k, a, a], found[k, m + a] = variance, np.sqrt(variance)
            at += 1
            for b in range(a + 1, m):
                covariance[k, a, b] = covariance[k, b, a] = packed[k, at]
                at += 1


@njit
def trajectory_error(
    model: Model,
    past: Past,
    roots: FloatArray,
    noise_sd: FloatArray,
    normals: FloatArray,
    innovations: FloatArray,
    errors: FloatArray,
) -> None:
    """One draw of truth minus smoothed state, at all samples; ``past`` is not changed.

    Let e be the truth minus the filter's state. It obeys the filter's own recursion, whatever the truth is,
    driven by the noise alone: with e ~ N(0, P0) at first, forwards, for m = first..last,

        v = h e + u,   e <- e - K v;     then   e <- F e + w,   w ~ N(0, Q),  u ~ N(0, r)

    and backwards, as the smoother goes,

        lam <- lam - h' (K' lam + v/s);    error = e^- + P^- lam;    lam <- F' lam

    The gains are at hand, so that a draw is two recursions of twelve numbers, without covariance (J. Durbin
    and S. J. Koopman, Biometrika 89 (2002) 603-615: draws by mean corrections).

    Parameters
    ----------
    model, past
        What the filter had, and what it left behind.
    roots : ndarray (c, 12, 12)
        Lower triangular, root root' = Q, of the blocks of
        `simrail.estimators.trajectory.model.process_noise`.
    noise_sd : ndarray (c, 8)
        Standard deviations of the measurements, virtual ones among them.
    normals : ndarray (n, 20)
        Independent standard normal numbers: of start or process, and of the measurements.
    innovations : ndarray (n, 8), work
    errors : ndarray (n, 12), out
    """
    # Named once, before the loops, as in the filter.
    track, slips, kinds, gravity = model.track, model.slips, model.kinds, model.gravity
    states, covariance, gains, scaled = past
    e, lam, out, g = np.empty(STATES), np.zeros(STATES), np.zeros(STATES), np.zeros(ROWS)
    rows = np.zeros((ROWS, WIDTH))
    share = shares(model.step_s)
    constant_rows(rows)
    for i in range(STATES):
        e[i] = np.sqrt(model.start_variance[i]) * normals[0, i]
    n = states.shape[0]
    for k in range(n):
        kind = kinds[k]
        if k > 0:
            chain(e, INTO, ORIGIN, share)
            for first, end in BLOCKS:
                for i in range(first, end):
                    for c in range(first, i + 1):
                        e[i] += roots[kind, i, c] * normals[k, c]
        write_row(errors, k, e, STATES)
        linearise(states[k], track, slips, k, gravity, g, rows)
        for m in range(ROWS):
            v = noise_sd[kind, m] * normals[k, STATES + m]
            for i in range(STATES):
                v += rows[m, i] * e[i]
            for i in range(STATES):
                e[i] -= gains[k, m, i] * v
            innovations[k, m] = v * scaled[k, m, 1]
    for k in range(n - 1, -1, -1):
        linearise(states[k], track, slips, k, gravity, g, rows)
        for m in range(ROWS - 1, -1, -1):
            withdraw(lam, rows[m], gains[k, m], innovations[k, m])
        packed_product(covariance, k, lam, out)
        for i in range(STATES):
            errors[k, i] += out[i]
        chain_back(lam, INTO, ORIGIN, share)
