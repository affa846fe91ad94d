"""The algebra of every Kalman filter here: predict, update, smooth, on arrays and in place.

For compiled loops: each function is a few lines that a kernel calls once a step and the compiler puts in its
place, so that what a filter adds is its model alone. The model is linear, or linearised about the state:

    x(k) = F x(k-1) + w,  w ~ N(0, Q);        z_m(k) = h_m x(k) + u_m,  u_m ~ N(0, r_m)

Measurements of independent noise are taken one by one, which needs no inverse and equals taking them at once;
`block_update` is for those whose noise is not. A covariance P is (n, w) with w >= n: rows may be padded with
zeros to fill the vector registers. A row h has n numbers, most of which may be zero.

The smoother goes backwards through what a filter left behind (`History`), update by update, by the modified
Bryson-Frazier recursion: it equals the Rauch-Tung-Striebel smoother and inverts nothing. Draws of its error
go the same way (`simrail.estimators.trajectory.kernel.trajectory_error`).

References: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press 1977,
chapters 2 and 10 (scalar updates, Bryson-Frazier); P. D. Joseph in R. S. Bucy and P. D. Joseph, Filtering for
Stochastic Processes, Wiley 1968 (block update); F. C. Schweppe, IEEE Trans. Inf. Theory 11 (1965) 61-70
(likelihood).
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit, njit_borrowed, njit_inline


class History(NamedTuple):
    """What a filter leaves behind for the way back: k steps, n states, at most m scalar updates a step.

    Attributes
    ----------
    states, covariances : ndarray (k, n), (k, n, n)
        Predicted, before the step's updates.
    transitions : ndarray (k, n, n)
        F of the step that led there; that of the first step is not used.
    rows, gains : ndarray (k, m, n)
        h and K of each update.
    errors, inverses : ndarray (k, m)
        e/s and 1/s of each update; both 0 for one that was not made.
    """

    states: FloatArray
    covariances: FloatArray
    transitions: FloatArray
    rows: FloatArray
    gains: FloatArray
    errors: FloatArray
    inverses: FloatArray


def room_for_history(steps: int, n: int, m: int) -> History:
    """Room for a filter's history."""
    square, updates = (steps, n, n), (steps, m, n)
    shapes = ((steps, n), square, square, updates, updates, (steps, m), (steps, m))
    return History(*(np.zeros(shape) for shape in shapes))


@njit_borrowed
def keep(states: FloatArray, covariances: FloatArray, k: int, x: FloatArray, p: FloatArray) -> None:
    """Write state and covariance of step k into rows k; the covariance of as many states as it has room for.

    By elements: what numba makes of the assignment of a whole array takes seconds to compile in each process.
    """
    for i in range(x.shape[0]):
        states[k, i] = x[i]
    for i in range(covariances.shape[1]):
        for c in range(covariances.shape[1]):
            covariances[k, i, c] = p[i, c]


@njit_borrowed
def take(x: FloatArray, p: FloatArray, mean: FloatArray, covariance: FloatArray) -> None:
    """State x (n,) and its covariance p (n, n) from those that were kept, by elements as in `keep`."""
    for i in range(x.shape[0]):
        x[i] = mean[i]
        for c in range(x.shape[0]):
            p[i, c] = covariance[i, c]


@njit_borrowed
def remember_prediction(past: History, k: int, x: FloatArray, p: FloatArray, f: FloatArray) -> None:
    """Put predicted state, covariance and F of step k into the history."""
    keep(past.states, past.covariances, k, x, p)
    for i in range(x.shape[0]):
        for c in range(x.shape[0]):
            past.transitions[k, i, c] = f[i, c]


@njit_borrowed
def remember(past: History, k: int, m: int, h: FloatArray, gain: FloatArray, error: float, s: float) -> None:
    """Put update m of step k into the history: row h, gain K, innovation e and its variance s."""
    for i in range(h.shape[0]):
        past.rows[k, m, i], past.gains[k, m, i] = h[i], gain[i]
    past.errors[k, m], past.inverses[k, m] = error / s, 1.0 / s


@njit_borrowed
def mirror(p: FloatArray) -> None:
    """Lower triangle from the upper one.

    Rounding leaves a part that is not symmetric, which no update ever takes away and every prediction lets
    grow: without this a filter breaks down after some hundred thousand steps.
    """
    for i in range(p.shape[0]):
        for c in range(i + 1, p.shape[0]):
            p[c, i] = p[i, c]


@njit_borrowed
def congruence(f: FloatArray, p: FloatArray, work: FloatArray) -> None:
    """P <- F P F' in place for any F (n, n), most of whose entries may be zero; ``work`` is (n, w).

    Equation: P^- = F P F' + Q without its Q, which a model adds where it is not zero.
    """
    n, width = p.shape
    for i in range(n):
        for c in range(width):
            work[i, c] = 0.0
        for j in range(n):
            share = f[i, j]
            if share != 0.0:
                for c in range(width):
                    work[i, c] += share * p[j, c]
    for i in range(n):
        for c in range(i, n):
            total = 0.0
            for j in range(n):
                total += work[i, j] * f[c, j]
            p[i, c] = p[c, i] = total


@njit_borrowed
def chain(x: FloatArray, into: tuple[int, ...], origin: tuple[int, ...], share: tuple[float, ...]) -> None:
    """X <- F x in place for F = I + sum of share[r] at (into[r], origin[r]), all above the diagonal.

    Chains of integrators are of this kind. ``into`` must not decrease: a state is then used before it moves.
    """
    for r in range(len(into)):
        x[into[r]] += share[r] * x[origin[r]]


@njit_borrowed
def chain_covariance(
    p: FloatArray, into: tuple[int, ...], origin: tuple[int, ...], share: tuple[float, ...]
) -> None:
    """P <- F P F' in place, F as in `chain`; of the result only the upper triangle is meant (`mirror`)."""
    n, width = p.shape
    for r in range(len(into)):
        for c in range(width):
            p[into[r], c] += share[r] * p[origin[r], c]
    for i in range(n):
        for r in range(len(into)):
            p[i, into[r]] += share[r] * p[i, origin[r]]


@njit_borrowed
def chain_back(
    lam: FloatArray, into: tuple[int, ...], origin: tuple[int, ...], share: tuple[float, ...]
) -> None:
    """Lam <- F' lam in place, F as in `chain`."""
    for r in range(len(into) - 1, -1, -1):
        lam[origin[r]] += share[r] * lam[into[r]]


@njit_borrowed
def chain_information(
    info: FloatArray, into: tuple[int, ...], origin: tuple[int, ...], share: tuple[float, ...]
) -> None:
    """Lam <- F' Lam F in place, F as in `chain`."""
    n, width = info.shape
    for r in range(len(into) - 1, -1, -1):
        for c in range(width):
            info[origin[r], c] += share[r] * info[into[r], c]
    for i in range(n):
        for r in range(len(into) - 1, -1, -1):
            info[i, origin[r]] += share[r] * info[i, into[r]]
    mirror(info)


@njit_inline
def condition(
    x: FloatArray, p: FloatArray, v: FloatArray, error: float, inverse: float, gain: FloatArray
) -> None:
    """Scalar update in place, given what a model with structure makes faster: v = P h' and 1/s.

    K = v/s,   x <- x + K e,   P <- P - K v'
    """
    n, width = p.shape
    for i in range(n):
        k = v[i] * inverse
        gain[i] = k
        x[i] += k * error
        for c in range(width):
            p[i, c] -= k * v[c]


@njit_borrowed
def update(
    x: FloatArray,
    p: FloatArray,
    h: FloatArray,
    error: float,
    variance: float,
    gain: FloatArray,
    v: FloatArray,
) -> float:
    """Scalar update in place, in the form that is symmetric but for rounding; returns s.

        v = P h',   s = h v + r,   and `condition`

    Parameters
    ----------
    x, p : ndarray (n,), (n, w), in and out
        State, and its covariance.
    h : ndarray (n,)
        Row of the Jacobian, most of whose entries may be zero.
    error, variance : float
        e = z - h x, or z less what a nonlinear model predicts; r, the variance of z.
    gain : ndarray (n,), out
        K.
    v : ndarray (w,), work
    """
    n, width = p.shape
    for c in range(width):
        v[c] = 0.0
    for i in range(n):
        if h[i] != 0.0:
            for c in range(width):
                v[c] += h[i] * p[i, c]
    s = variance
    for i in range(n):
        s += h[i] * v[i]
    condition(x, p, v, error, 1.0 / s, gain)
    return s


@njit
def block_update(
    x: FloatArray, p: FloatArray, rows: FloatArray, errors: FloatArray, noise: FloatArray
) -> float:
    """Update in place with m measurements at once, of correlated noise; returns their log-likelihood.

        S = H P H' + R,   K = P H' S^-1,   x <- x + K e,   P <- (I - K H) P (I - K H)' + K R K'

    Joseph's form: P stays symmetric and positive whatever the rounding of K.

    Parameters
    ----------
    x, p : ndarray (n,), (n, n), in and out
    rows, errors, noise : ndarray (m, n), (m,), (m, m)
        H, e = z - H x, and R.
    """
    across = rows @ p
    s = across @ rows.T + noise
    gain = np.ascontiguousarray(np.linalg.solve(s, across).T)
    kept = np.eye(len(x)) - gain @ rows
    x += gain @ errors
    p[:] = kept @ p @ kept.T + gain @ noise @ gain.T
    square = (errors * np.linalg.solve(s, errors)).sum()
    return log_density(square, np.linalg.det(s), len(errors))


@njit_borrowed
def row_product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Out (k,) = a B of a row a (n,), most of whose entries may be zero, and B (n, k)."""
    for c in range(out.shape[0]):
        out[c] = 0.0
    for i in range(a.shape[0]):
        if a[i] != 0.0:
            for c in range(out.shape[0]):
                out[c] += a[i] * b[i, c]


@njit_borrowed
def product(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Out (m, k) = A B of A (m, n), most of whose entries may be zero, and B (n, k).

    In place of numpy's, which asks for memory at every call and compiles for seconds.
    """
    for i in range(out.shape[0]):
        for c in range(out.shape[1]):
            out[i, c] = 0.0
        for j in range(a.shape[1]):
            if a[i, j] != 0.0:
                for c in range(out.shape[1]):
                    out[i, c] += a[i, j] * b[j, c]


@njit_borrowed
def transpose(a: FloatArray, out: FloatArray) -> None:
    """Out (n, m) = A' of A (m, n), for `congruence` and `product` with F'."""
    for i in range(a.shape[0]):
        for c in range(a.shape[1]):
            out[c, i] = a[i, c]


@njit_borrowed
def log_density(squares: float, product: float, count: int) -> float:
    """Log-likelihood of ``count`` measurements: -(sum of e^2/s + ln product of s + count ln 2 pi)/2.

    By prediction-error decomposition: e are the innovations, s their variances (Schweppe).
    """
    return -0.5 * (squares + math.log(product) + count * math.log(2.0 * math.pi))


@njit_borrowed
def withdraw(lam: FloatArray, h: FloatArray, gain: FloatArray, error: float) -> None:
    """Lam <- lam - h' (K' lam + e/s) in place: back through one update; ``error`` is e/s."""
    total = error
    for i in range(lam.shape[0]):
        total += gain[i] * lam[i]
    for i in range(lam.shape[0]):
        lam[i] -= h[i] * total


@njit_borrowed
def information_share(v: FloatArray, h: FloatArray, gain: FloatArray, inverse: float) -> None:
    """W = v - h (1/s + v K)/2 in place of v = K' Lam, for `withdraw_information`."""
    square = inverse
    for i in range(gain.shape[0]):
        square += gain[i] * v[i]
    for c in range(v.shape[0]):
        v[c] -= 0.5 * square * h[c]


@njit_borrowed
def withdraw_information(
    info: FloatArray, h: FloatArray, gain: FloatArray, inverse: float, v: FloatArray
) -> None:
    """Lam <- (I - h' K') Lam (I - K h) + h' h/s in place: back through one update; ``inverse`` is 1/s.

    Written as Lam - h' w - w' h with w = v - h (1/s + v K)/2, so that it stays symmetric.

    Parameters
    ----------
    info : ndarray (n, w), in and out
    h : ndarray (w,)
        Row of the Jacobian, padded with zeros.
    gain : ndarray (n,)
    v : ndarray (w,), in and out
        K' Lam; becomes w.
    """
    n, width = info.shape
    information_share(v, h, gain, inverse)
    for i in range(n):
        a, b = h[i], v[i]
        for c in range(width):
            info[i, c] -= a * v[c] + b * h[c]


@njit
def fixed_interval(past: History, states: FloatArray, covariances: FloatArray) -> None:
    """Smoothed states and covariances from what a filter left behind; ``past`` is not changed.

    Backwards through the updates of each step, m = last..first, and then through F:

        lam <- lam - h' (K' lam + e/s),   Lam <- (I - h' K') Lam (I - K h) + h' h/s
        x = x^- - P^- lam,                P = P^- - P^- Lam P^-
        lam <- F' lam,                    Lam <- F' Lam F

    Parameters
    ----------
    past : History
    states, covariances : ndarray (k, n), (k, n, n), out
    """
    steps, n = past.states.shape
    lam, info, v = np.zeros(n), np.zeros((n, n)), np.zeros(n)
    back, work, shrunk = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for k in range(steps - 1, -1, -1):
        for m in range(past.rows.shape[1] - 1, -1, -1):
            if past.inverses[k, m] > 0.0:
                h, gain = past.rows[k, m], past.gains[k, m]
                withdraw(lam, h, gain, past.errors[k, m])
                row_product(gain, info, v)
                withdraw_information(info, h, gain, past.inverses[k, m], v)
        p, f = past.covariances[k], past.transitions[k]
        row_product(lam, p, v)
        product(p, info, work)
        product(work, p, shrunk)
        for i in range(n):
            states[k, i] = past.states[k, i] - v[i]
            for c in range(n):
                covariances[k, i, c] = p[i, c] - shrunk[i, c]
        row_product(lam, f, v)
        for i in range(n):
            lam[i] = v[i]
        transpose(f, back)
        congruence(back, info, work)
