"""Fixed-interval smoothing of what a Kalman filter with scalar updates left behind, for any model.

Arrays in, arrays out. Dense: a filter with structure to use brings a backward pass of its own.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit


@njit
def smooth(
    before: FloatArray,
    before_covariance: FloatArray,
    transition: FloatArray,
    rows: FloatArray,
    gains: FloatArray,
    scaled: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
) -> None:
    """Smoothed states and covariances from what the filter kept: modified Bryson-Frazier, no inverse.

    Backwards through each update with row h, gain K, innovation e of variance s, then through F:

        lam <- lam - h (K lam + e/s),   Lam <- (I - h K') Lam (I - K h') + h h'/s
        x = x^- - P^- lam,              P = P^- - P^- Lam P^-
        lam <- F' lam,                  Lam <- F' Lam F

    Parameters
    ----------
    before, before_covariance : ndarray (k, n), (k, n, n)
        Predicted state and covariance of every step, before its updates.
    transition : ndarray (k, n, n)
        F of the step that led there.
    rows, gains : ndarray (k, m, n)
        Row of the Jacobian and gain of each of m scalar updates.
    scaled : ndarray (k, 2 m)
        Innovation over its variance of each update, then one over its variance; 0 for one not made.
    states, covariance : ndarray (k, n), (k, n, n), output
        Smoothed.
    """
    steps, n = before.shape
    updates = rows.shape[1]
    lam, v = np.zeros(n), np.zeros(n)
    info = np.zeros((n, n))
    for k in range(steps - 1, -1, -1):
        for m in range(updates - 1, -1, -1):
            inverse = scaled[k, updates + m]
            if inverse == 0.0:
                continue
            h, gain = rows[k, m], gains[k, m]
            dot = scaled[k, m]
            square = inverse
            for i in range(n):
                dot += gain[i] * lam[i]
                total = 0.0
                for j in range(n):
                    total += info[i, j] * gain[j]
                v[i] = total
                square += gain[i] * total
            for i in range(n):
                lam[i] -= h[i] * dot
                for j in range(n):
                    info[i, j] += h[i] * h[j] * square - h[i] * v[j] - v[i] * h[j]
        p, f = before_covariance[k], transition[k]
        states[k] = before[k] - p @ lam
        covariance[k] = p - p @ info @ p
        lam = f.T @ lam
        info = f.T @ info @ f
