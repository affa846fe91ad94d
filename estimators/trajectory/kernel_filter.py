"""Compiled filter of the trajectory smoother: an extended Kalman filter of twelve states.

Gonzalez-Carbajal et al. 2023 (paper 001), section 3, with the errata of EQUATIONS 1.3. Arrays in, arrays out.
What makes it fast is its structure: the transition is block upper triangular, so that the prediction is a few
sums of rows and columns; the noise of the eight measurements is independent, so that they are taken one by
one, each with the few entries that its row of the Jacobian has (35 of 96); and there is no inverse. The
covariance has rows of `WIDTH` numbers of which the last four are always zero: loops of sixteen fill the
vector registers.

Not here: the equations (`simrail.estimators.trajectory.kernel_equations`) and the way back
(`simrail.estimators.trajectory.kernel_back`).
"""

from __future__ import annotations

import math

import numpy as np
from simrail.estimators.trajectory.kernel_equations import (
    PITCH,
    PITCH_RATE,
    ROLL,
    ROLL_RATE,
    ROWS,
    STATES,
    YAW,
    YAW_RATE,
    YD,
    YDD,
    ZD,
    ZDD,
    Y,
    Z,
    measured,
    misprint,
)

from simrail.core.jit import FloatArray, IntArray, njit, njit_borrowed

PACKED = STATES * (STATES + 1) // 2
"""Entries of a covariance's upper triangle, row by row."""

WIDTH = 16
"""Length of a row of the covariance in the loops."""


@njit_borrowed
def mirror(p: FloatArray) -> None:
    """Lower triangle from the upper one.

    Rounding leaves a part that is not symmetric, which no update ever takes away and every prediction lets
    grow: without this the filter breaks down after some hundred thousand samples.
    """
    for i in range(12):
        for c in range(i + 1, 12):
            p[c, i] = p[i, c]


@njit_borrowed
def predict(x: FloatArray, p: FloatArray, q: FloatArray, kind: int, dt: float) -> None:
    """X <- F x, P <- F P F' + Q in place (EQUATIONS 3.1); Q is row ``kind`` of ``q`` (c, 21)."""
    half = 0.5 * dt * dt
    width = p.shape[1]
    for a in range(0, 6, 2):
        x[a] += dt * x[a + 1]
        for i in range(width):
            p[a, i] += dt * p[a + 1, i]
    for a in range(6, 12, 3):
        x[a] += dt * x[a + 1] + half * x[a + 2]
        x[a + 1] += dt * x[a + 2]
        for i in range(width):
            p[a, i] += dt * p[a + 1, i] + half * p[a + 2, i]
        for i in range(width):
            p[a + 1, i] += dt * p[a + 2, i]
    for i in range(12):
        p[i, 0] += dt * p[i, 1]
        p[i, 2] += dt * p[i, 3]
        p[i, 4] += dt * p[i, 5]
        p[i, 6] += dt * p[i, 7] + half * p[i, 8]
        p[i, 7] += dt * p[i, 8]
        p[i, 9] += dt * p[i, 10] + half * p[i, 11]
        p[i, 10] += dt * p[i, 11]
    for block in range(3):
        a, b = 2 * block, 3 * block
        p[a, a] += q[kind, b]
        p[a, a + 1] += q[kind, b + 1]
        p[a + 1, a + 1] += q[kind, b + 2]
    for block in range(2):
        a, b = 6 + 3 * block, 9 + 6 * block
        p[a, a] += q[kind, b]
        p[a, a + 1] += q[kind, b + 1]
        p[a, a + 2] += q[kind, b + 2]
        p[a + 1, a + 1] += q[kind, b + 3]
        p[a + 1, a + 2] += q[kind, b + 4]
        p[a + 2, a + 2] += q[kind, b + 5]
    mirror(p)


@njit_borrowed
def take(
    p: FloatArray, v: FloatArray, dx: FloatArray, error: float, inverse: float, gain: FloatArray
) -> None:
    """Scalar update: K = v/s, dx += K e, P -= K v', with v = P h and ``inverse`` = 1/s."""
    width = p.shape[1]
    for i in range(12):
        k = v[i] * inverse
        gain[i] = k
        dx[i] += k * error
        for c in range(width):
            p[i, c] -= k * v[c]


@njit
def trajectory_filter(
    signals: FloatArray,
    track: FloatArray,
    slips: FloatArray,
    kinds: IntArray,
    process: FloatArray,
    noise: FloatArray,
    virtual: FloatArray,
    start: FloatArray,
    start_variance: FloatArray,
    step_s: float,
    gravity: float,
    before: FloatArray,
    before_covariance: FloatArray,
    gains: FloatArray,
    scaled: FloatArray,
    after: FloatArray,
    after_covariance: FloatArray,
    innovations: FloatArray,
    likelihoods: FloatArray,
) -> float:
    """Run the filter; an output of no rows is not wanted and not written.

    With J_m the rows of the Jacobian at the predicted state x and dx = 0 at first, for m = 1..8:

        e = z_m - g_m(x) - J_m dx,   s = J_m P J_m' + U_m,   K = P J_m'/s
        dx += K e,   P -= K s K',   log-likelihood -= (e^2/s + ln 2 pi s)/2

    which is the update with all eight at once.

    Parameters
    ----------
    signals : ndarray (n, 6)
        Angular rate less its bias, rad/s, and specific force, m/s2, body axes.
    track : ndarray (n, 15)
        `TERMS`.
    slips : ndarray (n, 3) or (0, 3)
        See `misprint`; of no rows for the corrected equations.
    kinds : ndarray of int (n,)
        Which of the c rows of ``process`` and ``noise`` holds at a sample, and over the step to it.
    process : ndarray (c, 21)
        Upper triangles of the five blocks of Q, row by row.
    noise : ndarray (c, 8)
        Variances U of the measurements.
    virtual : ndarray (2,)
        Virtual positions y and z, m.
    start, start_variance : ndarray (12,)
        State before the first update, and its variances.
    step_s, gravity : float
        Sample interval, s, and gravity, m/s2.
    before, before_covariance : ndarray (n, 12), (n, 78), out
        Predicted states, and their covariances' upper triangles row by row.
    gains, scaled : ndarray (n, 8, 12), (n, 8, 2), out
        K, and (e/s, 1/s) of each scalar update.
    after, after_covariance : ndarray (n, 12), (n, 78), out
        Filtered.
    innovations : ndarray (n, 7), out
        Measured minus predicted rates and forces, and the normalised innovation squared of these six.
    likelihoods : ndarray (n,), out
        Log-likelihood of each sample given those before it.

    Returns
    -------
    float
        Log-likelihood of all measurements, the virtual ones among them.
    """
    n = signals.shape[0]
    x, p = start.copy(), np.zeros((STATES, WIDTH))
    v, dx, gain = np.zeros(WIDTH), np.zeros(STATES), np.zeros(STATES)
    g, j = np.zeros(6), np.zeros((3, 8))
    nis = likelihood = 0.0
    first, second = (PITCH, ROLL, ROLL), (YAW, YAW, PITCH)
    for i in range(STATES):
        p[i, i] = start_variance[i]
    for k in range(n):
        kind = kinds[k]
        if k > 0:
            predict(x, p, process, kind, step_s)
        if before.shape[0] > 0:
            before[k] = x
            pack(p, before_covariance, k)
        measured(x, track, k, gravity, g, j)
        if slips.shape[0] > 0:
            misprint(x, track, slips, k, j)
        dx[:] = 0.0
        nis = 0.0
        squares, product = 0.0, 1.0
        for m in range(ROWS):
            if m == 0:
                a0, a1, a2, b0, b1, b2 = ROLL_RATE, PITCH, YAW_RATE, 1.0, -x[YAW_RATE], -x[PITCH]
            elif m == 1:
                a0, a1, a2, b0, b1, b2 = PITCH_RATE, ROLL, YAW_RATE, 1.0, x[YAW_RATE], x[ROLL]
            elif m == 2:
                a0, a1, a2, b0, b1, b2 = YAW_RATE, ROLL, PITCH_RATE, 1.0, -x[PITCH_RATE], -x[ROLL]
            if m < 3:
                for i in range(WIDTH):
                    v[i] = b0 * p[a0, i] + b1 * p[a1, i] + b2 * p[a2, i]
                spread = b0 * v[a0] + b1 * v[a1] + b2 * v[a2]
                error = signals[k, m] - g[m] - b0 * dx[a0] - b1 * dx[a1] - b2 * dx[a2]
            elif m < 6:
                r = m - 3
                a0, a1 = first[r], second[r]
                j0, j1, j2, j3 = j[r, 0], j[r, 1], j[r, 2], j[r, 3]
                j4, j5, j6, j7 = j[r, 4], j[r, 5], j[r, 6], j[r, 7]
                for i in range(WIDTH):
                    v[i] = (
                        j0 * p[a0, i]
                        + j1 * p[a1, i]
                        + j2 * p[Y, i]
                        + j3 * p[YD, i]
                        + j4 * p[YDD, i]
                        + j5 * p[Z, i]
                        + j6 * p[ZD, i]
                        + j7 * p[ZDD, i]
                    )
                spread = j0 * v[a0] + j1 * v[a1] + j2 * v[Y] + j3 * v[YD] + j4 * v[YDD]
                spread += j5 * v[Z] + j6 * v[ZD] + j7 * v[ZDD]
                error = signals[k, m] - g[m] - j0 * dx[a0] - j1 * dx[a1] - j2 * dx[Y] - j3 * dx[YD]
                error -= j4 * dx[YDD] + j5 * dx[Z] + j6 * dx[ZD] + j7 * dx[ZDD]
            else:
                a0 = Y if m == 6 else Z
                for i in range(WIDTH):
                    v[i] = p[a0, i]
                spread = v[a0]
                error = virtual[m - 6] - x[a0] - dx[a0]
            s = spread + noise[kind, m]
            inverse = 1.0 / s
            squares += error * error * inverse
            product *= s
            if m == 5:
                nis = squares
            take(p, v, dx, error, inverse, gain)
            if gains.shape[0] > 0:
                for i in range(STATES):
                    gains[k, m, i] = gain[i]
                scaled[k, m, 0], scaled[k, m, 1] = error * inverse, inverse
        for i in range(STATES):
            x[i] += dx[i]
        of_sample = -0.5 * (squares + math.log(product) + ROWS * math.log(2.0 * math.pi))
        likelihood += of_sample
        if likelihoods.shape[0] > 0:
            likelihoods[k] = of_sample
        if innovations.shape[0] > 0:
            for i in range(6):
                innovations[k, i] = signals[k, i] - g[i]
            innovations[k, 6] = nis
        if after.shape[0] > 0:
            after[k] = x
            pack(p, after_covariance, k)
    return likelihood


@njit_borrowed
def pack(p: FloatArray, packed: FloatArray, k: int) -> None:
    """Upper triangle of P, row by row, into row k of ``packed`` (n, 78)."""
    at = 0
    for i in range(12):
        for c in range(i, 12):
            packed[k, at] = p[i, c]
            at += 1
