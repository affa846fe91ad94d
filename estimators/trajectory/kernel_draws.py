"""Compiled draws of the trajectory smoother's error: what the truth may be, less the smoothed state.

The simulation smoother of Durbin and Koopman (2002), in their form of mean corrections, for the filter's own
linearisation. Its gains are at hand, so that a draw is two recursions of twelve numbers, without covariance.
Random numbers come from outside.

Not here: the geometry of the rails that follows from a draw (`simrail.estimators.trajectory.draws`).
"""

from __future__ import annotations

import numpy as np
from simrail.estimators.trajectory.kernel_back import linearise, still_rows, transpose_predict
from simrail.estimators.trajectory.kernel_equations import ROWS, STATES
from simrail.estimators.trajectory.kernel_filter import WIDTH

from simrail.core.jit import FloatArray, IntArray, njit, njit_borrowed


@njit_borrowed
def step_error(e: FloatArray, root: FloatArray, kind: int, normals: FloatArray, k: int, dt: float) -> None:
    """E <- F e + L n in place; L is row ``kind`` of ``root`` (c, 12, 12), n the first of ``normals[k]``."""
    half = 0.5 * dt * dt
    for a in range(0, 6, 2):
        e[a] += dt * e[a + 1] + root[kind, a, a] * normals[k, a]
        e[a + 1] += root[kind, a + 1, a] * normals[k, a] + root[kind, a + 1, a + 1] * normals[k, a + 1]
    for a in range(6, 12, 3):
        e[a] += dt * e[a + 1] + half * e[a + 2]
        e[a + 1] += dt * e[a + 2]
        for r in range(3):
            for c in range(r + 1):
                e[a + r] += root[kind, a + r, a + c] * normals[k, a + c]


@njit_borrowed
def add_product(e: FloatArray, packed: FloatArray, lam: FloatArray, k: int) -> None:
    """Row k of ``e`` (n, 12) += P lam, with P row k of ``packed`` (n, 78)."""
    at = 0
    for i in range(12):
        row = packed[k, at] * lam[i]
        at += 1
        for c in range(i + 1, 12):
            row += packed[k, at] * lam[c]
            e[k, c] += packed[k, at] * lam[i]
            at += 1
        e[k, i] += row


@njit
def trajectory_error(
    track: FloatArray,
    slips: FloatArray,
    kinds: IntArray,
    root: FloatArray,
    noise_sd: FloatArray,
    start_sd: FloatArray,
    step_s: float,
    gravity: float,
    gains: FloatArray,
    scaled: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
    normals: FloatArray,
    innovations: FloatArray,
    errors: FloatArray,
) -> None:
    """One draw of truth minus smoothed state, at all samples.

    Let e be the truth minus the filter's state. It obeys the filter's own recursion, whatever the truth is,
    driven by the noise alone: with e ~ N(0, P0) at first, forwards, for m = 1..8,

        v_m = J_m e + u_m,   e <- e - K_m v_m;     then   e <- F e + w,   w ~ N(0, Q),  u_m ~ N(0, U_m)

    and backwards, as the smoother goes (`simrail.estimators.trajectory.kernel_back.trajectory_back`),

        lam <- lam - J_m' (K_m' lam + v_m/s_m);    error = e^- + P^- lam;    lam <- F' lam

    Its covariances, those between samples as well, are those of the smoother's error.

    Parameters
    ----------
    track, slips, kinds, start_sd, step_s, gravity
        As the filter had them; ``start_sd`` (12,) are roots of its variances.
    root : ndarray (c, 12, 12)
        Lower triangular, root root' = Q, of the blocks of
        `simrail.estimators.trajectory.model.process_noise`.
    noise_sd : ndarray (c, 8)
        Standard deviations of the measurements, virtual ones among them.
    gains, scaled, states, covariance : ndarray (n, 8, 12), (n, 8, 2), (n, 12), (n, 78)
        From the filter: K, (e/s, 1/s), predicted states and their covariances. Not changed.
    normals : ndarray (n, 20)
        Independent standard normal numbers: of start or process, and of the measurements.
    innovations : ndarray (n, 8), work
    errors : ndarray (n, 12), out
    """
    e, lam = np.empty(STATES), np.zeros(STATES)
    g, j, rows = np.zeros(6), np.zeros((3, 8)), np.zeros((ROWS, WIDTH))
    still_rows(rows)
    for i in range(STATES):
        e[i] = start_sd[i] * normals[0, i]
    n = states.shape[0]
    for k in range(n):
        kind = kinds[k]
        if k > 0:
            step_error(e, root, kind, normals, k, step_s)
        errors[k] = e
        linearise(states[k], track, slips, k, gravity, g, j, rows)
        for m in range(ROWS):
            v = noise_sd[kind, m] * normals[k, STATES + m]
            for i in range(STATES):
                v += rows[m, i] * e[i]
            for i in range(STATES):
                e[i] -= gains[k, m, i] * v
            innovations[k, m] = v
    for k in range(n - 1, -1, -1):
        linearise(states[k], track, slips, k, gravity, g, j, rows)
        for m in range(ROWS - 1, -1, -1):
            dot = innovations[k, m] * scaled[k, m, 1]
            for i in range(STATES):
                dot += gains[k, m, i] * lam[i]
            for i in range(STATES):
                lam[i] -= rows[m, i] * dot
        add_product(errors, covariance, lam, k)
        transpose_predict(lam, step_s)
