"""Compiled backward pass of the trajectory smoother: modified Bryson-Frazier, without any inverse.

It uses what `simrail.estimators.trajectory.kernel_filter.trajectory_filter` left behind and replaces it, in
place: a ride of an hour then needs no second copy of its covariances. It equals the Rauch-Tung-Striebel
smoother because the transition is linear.
"""

from __future__ import annotations

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
    Y,
    Z,
    measured,
    misprint,
)
from simrail.estimators.trajectory.kernel_filter import WIDTH, mirror

from simrail.core.jit import FloatArray, njit, njit_borrowed


@njit_borrowed
def jacobian_rows(x: FloatArray, j: FloatArray, rows: FloatArray) -> None:
    """Whole rows (8, 16) from `measured`'s part; what is always zero or one must stand there already."""
    rows[0, PITCH], rows[0, YAW_RATE] = -x[YAW_RATE], -x[PITCH]
    rows[1, ROLL], rows[1, YAW_RATE] = x[YAW_RATE], x[ROLL]
    rows[2, ROLL], rows[2, PITCH_RATE] = -x[PITCH_RATE], -x[ROLL]
    rows[3, PITCH], rows[3, YAW] = j[0, 0], j[0, 1]
    rows[4, ROLL], rows[4, YAW] = j[1, 0], j[1, 1]
    rows[5, ROLL], rows[5, PITCH] = j[2, 0], j[2, 1]
    for r in range(3):
        for i in range(6):
            rows[3 + r, Y + i] = j[r, 2 + i]


@njit_borrowed
def still_rows(rows: FloatArray) -> None:
    """What is always one in the rows (8, 16) of the Jacobian, which are zero before."""
    rows[0, ROLL_RATE] = rows[1, PITCH_RATE] = rows[2, YAW_RATE] = rows[6, Y] = rows[7, Z] = 1.0


@njit_borrowed
def linearise(
    x: FloatArray,
    track: FloatArray,
    slips: FloatArray,
    k: int,
    gravity: float,
    g: FloatArray,
    j: FloatArray,
    rows: FloatArray,
) -> None:
    """Rows (8, 16) of the Jacobian in state x at sample k, as the filter had them; ``g`` and ``j``: work."""
    measured(x, track, k, gravity, g, j)
    if slips.shape[0] > 0:
        misprint(x, track, slips, k, j)
    jacobian_rows(x, j, rows)


@njit_borrowed
def transpose_predict(lam: FloatArray, dt: float) -> None:
    """Lam <- F' lam in place."""
    half = 0.5 * dt * dt
    for a in range(0, 6, 2):
        lam[a + 1] += dt * lam[a]
    for a in range(6, 12, 3):
        lam[a + 2] += dt * lam[a + 1] + half * lam[a]
        lam[a + 1] += dt * lam[a]


@njit_borrowed
def information_predict(info: FloatArray, dt: float) -> None:
    """Lam <- F' Lam F in place."""
    half = 0.5 * dt * dt
    width = info.shape[1]
    for a in range(0, 6, 2):
        for i in range(width):
            info[a + 1, i] += dt * info[a, i]
    for a in range(6, 12, 3):
        for i in range(width):
            info[a + 2, i] += dt * info[a + 1, i] + half * info[a, i]
        for i in range(width):
            info[a + 1, i] += dt * info[a, i]
    for i in range(12):
        info[i, 1] += dt * info[i, 0]
        info[i, 3] += dt * info[i, 2]
        info[i, 5] += dt * info[i, 4]
        info[i, 8] += dt * info[i, 7] + half * info[i, 6]
        info[i, 7] += dt * info[i, 6]
        info[i, 11] += dt * info[i, 10] + half * info[i, 9]
        info[i, 10] += dt * info[i, 9]
    mirror(info)


@njit_borrowed
def combine(a: FloatArray, start: int, b: FloatArray, out: FloatArray, to: int) -> None:
    """Row a' B into ``out`` from ``to``, with the twelve numbers of ``a`` from ``start``.

    Written out, with all strides known, so that the compiler keeps the sums in vector registers.
    """
    a0, a1, a2, a3 = a[start], a[start + 1], a[start + 2], a[start + 3]
    a4, a5, a6, a7 = a[start + 4], a[start + 5], a[start + 6], a[start + 7]
    a8, a9, a10, a11 = a[start + 8], a[start + 9], a[start + 10], a[start + 11]
    for i in range(WIDTH):
        out[to + i] = (
            a0 * b[i]
            + a1 * b[WIDTH + i]
            + a2 * b[2 * WIDTH + i]
            + a3 * b[3 * WIDTH + i]
            + a4 * b[4 * WIDTH + i]
            + a5 * b[5 * WIDTH + i]
            + a6 * b[6 * WIDTH + i]
            + a7 * b[7 * WIDTH + i]
            + a8 * b[8 * WIDTH + i]
            + a9 * b[9 * WIDTH + i]
            + a10 * b[10 * WIDTH + i]
            + a11 * b[11 * WIDTH + i]
        )


@njit_borrowed
def give_back(info: FloatArray, h: FloatArray, gain: FloatArray, inverse: float, v: FloatArray) -> None:
    """Lam <- (I - h K') Lam (I - K h') + h h'/s in place, as Lam - h w' - w h'."""
    width = v.shape[0]
    combine(gain, 0, info, v, 0)
    square = inverse
    for c in range(12):
        square += gain[c] * v[c]
    for i in range(width):
        v[i] -= 0.5 * square * h[i]
    for r in range(12):
        a, b = h[r], v[r]
        for i in range(width):
            info[r * WIDTH + i] -= a * v[i] + b * h[i]


@njit_borrowed
def shrink(
    info: FloatArray, p: FloatArray, work: FloatArray, v: FloatArray, packed: FloatArray, k: int
) -> None:
    """Row k of ``packed`` becomes P - P Lam P."""
    for o in range(0, 12 * WIDTH, WIDTH):
        combine(info, o, p, work, o)
    at = 0
    for r in range(12):
        combine(p, r * WIDTH, work, v, 0)
        for c in range(r, 12):
            packed[k, at] -= v[c]
            at += 1


@njit_borrowed
def unpack(packed: FloatArray, k: int, p: FloatArray) -> None:
    """Row k of ``packed`` (n, 78) as a full matrix."""
    at = 0
    for i in range(12):
        for c in range(i, 12):
            p[i * WIDTH + c] = packed[k, at]
            p[c * WIDTH + i] = packed[k, at]
            at += 1


@njit
def trajectory_back(
    track: FloatArray,
    slips: FloatArray,
    step_s: float,
    gravity: float,
    gains: FloatArray,
    scaled: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
    with_covariance: bool,
) -> None:
    """Turn predicted states and covariances into smoothed ones.

    Backwards through the updates of each sample, m = 8..1, and then through F:

        lam <- lam - J_m' (K_m' lam + e_m/s_m),   Lam <- (I - J_m' K_m') Lam (I - K_m J_m) + J_m' J_m/s_m
        x = x^- - P^- lam,                        P = P^- - P^- Lam P^-
        lam <- F' lam,                            Lam <- F' Lam F

    Parameters
    ----------
    track, slips, step_s, gravity
        As the filter had them: the Jacobian is made again, which is cheaper than to fetch it.
    gains, scaled : ndarray (n, 8, 12), (n, 8, 2)
        From the filter.
    states, covariance : ndarray (n, 12), (n, 78), in and out
        The filter's ``before`` and ``before_covariance``; replaced by the smoothed ones.
    with_covariance : bool
        False leaves ``covariance`` as it is, the predicted one.
    """
    lam, v, out = np.zeros(STATES), np.zeros(WIDTH), np.zeros(STATES)
    g, j, rows = np.zeros(6), np.zeros((3, 8)), np.zeros((ROWS, WIDTH))
    info, p, work = np.zeros(STATES * WIDTH), np.zeros(STATES * WIDTH), np.zeros(STATES * WIDTH)
    square = info.reshape((STATES, WIDTH))
    still_rows(rows)
    for k in range(states.shape[0] - 1, -1, -1):
        x = states[k]
        linearise(x, track, slips, k, gravity, g, j, rows)
        for m in range(ROWS - 1, -1, -1):
            dot = scaled[k, m, 0]
            for i in range(STATES):
                dot += gains[k, m, i] * lam[i]
            for i in range(STATES):
                lam[i] -= rows[m, i] * dot
            if with_covariance:
                give_back(info, rows[m], gains[k, m], scaled[k, m, 1], v)
        out[:] = 0.0
        at = 0
        for i in range(STATES):
            out[i] += covariance[k, at] * lam[i]
            at += 1
            for c in range(i + 1, STATES):
                out[i] += covariance[k, at] * lam[c]
                out[c] += covariance[k, at] * lam[i]
                at += 1
        if with_covariance:
            unpack(covariance, k, p)
            shrink(info, p, work, v, covariance, k)
            information_predict(square, step_s)
        for i in range(STATES):
            states[k, i] -= out[i]
        transpose_predict(lam, step_s)
