"""Compiled ways back of the trajectory smoother: smoothed states and covariances, and draws of their error.

Both are `simrail.estimators.kalman.fixed_interval` and `joint_draw` for a model with structure. They use what
`simrail.estimators.trajectory.kernel_filter.trajectory_filter` left behind; the smoother replaces it, in
place: a ride of an hour then needs no second copy of its covariances. Random numbers come from outside.

Not here: the geometry of the rails that follows from a draw (`simrail.estimators.trajectory.draws`).
"""

import numpy as np
from simrail.estimators.kalman import chain, chain_back, chain_information, withdraw, withdraw_information
from simrail.estimators.trajectory.kernel_equations import (
    BLOCKS,
    INTO,
    ORIGIN,
    ROWS,
    STATES,
    WIDTH,
    constant_rows,
    linearise,
    shares,
    unpack,
)
from simrail.estimators.trajectory.kernel_filter import Past
from simrail.estimators.trajectory.model import Model

from simrail.core.jit import FloatArray, njit, njit_borrowed


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


@njit_borrowed
def row_times(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Out (16,) = a B with a row a (12,) and a matrix B (12, 16).

    Written out, so that the compiler keeps the sums in vector registers.
    """
    a0, a1, a2, a3, a4, a5 = a[0], a[1], a[2], a[3], a[4], a[5]
    a6, a7, a8, a9, a10, a11 = a[6], a[7], a[8], a[9], a[10], a[11]
    for c in range(WIDTH):
        out[c] = (
            a0 * b[0, c]
            + a1 * b[1, c]
            + a2 * b[2, c]
            + a3 * b[3, c]
            + a4 * b[4, c]
            + a5 * b[5, c]
            + a6 * b[6, c]
            + a7 * b[7, c]
            + a8 * b[8, c]
            + a9 * b[9, c]
            + a10 * b[10, c]
            + a11 * b[11, c]
        )


@njit_borrowed
def shrink(
    info: FloatArray, p: FloatArray, work: FloatArray, v: FloatArray, packed: FloatArray, k: int
) -> None:
    """Row k of ``packed``, which is P, becomes P - P Lam P."""
    unpack(packed, k, p)
    for i in range(STATES):
        row_times(info[i], p, work[i])
    at = 0
    for i in range(STATES):
        row_times(p[i], work, v)
        for c in range(i, STATES):
            packed[k, at] -= v[c]
            at += 1


@njit
def trajectory_back(model: Model, past: Past, with_covariance: bool) -> None:
    """Turn predicted states and covariances into smoothed ones, in place.

    `simrail.estimators.kalman.fixed_interval` has the equations. The Jacobian is made again, which is cheaper
    than to fetch it. Without covariances those of ``past`` stay as they are, predicted.
    """
    lam, v, out, g = np.zeros(STATES), np.zeros(WIDTH), np.zeros(STATES), np.zeros(ROWS)
    rows, info = np.zeros((ROWS, WIDTH)), np.zeros((STATES, WIDTH))
    p, work = np.zeros((STATES, WIDTH)), np.zeros((STATES, WIDTH))
    share = shares(model.step_s)
    constant_rows(rows)
    for k in range(past.states.shape[0] - 1, -1, -1):
        linearise(past.states[k], model.track, model.slips, k, model.gravity, g, rows)
        for m in range(ROWS - 1, -1, -1):
            withdraw(lam, rows[m], past.gains[k, m], past.scaled[k, m, 0])
            if with_covariance:
                row_times(past.gains[k, m], info, v)
                withdraw_information(info, rows[m], past.gains[k, m], past.scaled[k, m, 1], v)
        packed_product(past.covariance, k, lam, out)
        if with_covariance:
            shrink(info, p, work, v, past.covariance, k)
            chain_information(info, INTO, ORIGIN, share)
        for i in range(STATES):
            past.states[k, i] -= out[i]
        chain_back(lam, INTO, ORIGIN, share)


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

    `simrail.estimators.kalman.joint_draw` has the equations. The gains are at hand, so that a draw is two
    recursions of twelve numbers, without covariance.

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
        errors[k] = e
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
