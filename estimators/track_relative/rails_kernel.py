"""Compiled smoother of a few coordinates that are processes over the distance, at every sample of an IMU.

Each coordinate x is white noise over the distance through two or three filters of first order,

    (d/ds + a)(d/ds + b) x = white      or      (d/ds + a)(d/ds + b)(d/ds + c) x = white,

and its states are x, dx/ds and, of the second kind, d2x/ds2. A measurement is a sum of states whose
coefficients follow the speed u = |ds/dt| and its slope u':

    h = constant + u by_speed + u^2 by_square + u' by_slope

Filter, and Bryson-Frazier smoother (`simrail.estimators.kalman`) that runs the filter again over each segment
on the way back, so that memory does not grow by a covariance a sample. A step of a sample is short against
every wave: the noise that it adds is integrated by Gauss and Legendre's three points, which keeps it positive
where a difference of stationary covariances is rounding alone.

Reference: J. Hartikainen and S. Sarkka, MLSP 2010, 379-384 (processes as state-space models).
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import (
    History,
    congruence,
    keep,
    remember,
    remember_prediction,
    room_for_history,
    row_product,
    take,
    transpose,
    update,
    withdraw,
    withdraw_information,
)

from simrail.core.jit import FloatArray, IntArray, njit, njit_borrowed

SEGMENT = 1024
"""Samples between two that the filter keeps."""

SERIES = 18
"""Terms of a series of which the n-th is below 1/(n + 2)!."""

POINTS = (0.5 - 0.5 * math.sqrt(0.6), 0.5, 0.5 + 0.5 * math.sqrt(0.6))
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
"""Of Gauss and Legendre's rule on 0 to 1."""


class Waves(NamedTuple):
    """A linear model of n samples: b coordinates, s states, m measurements.

    Attributes
    ----------
    speed, slope : ndarray (n,)
        u >= 0 and u'.
    dt : float
        s, between samples.
    sizes : ndarray of int (b,)
        States of each coordinate, 2 or 3.
    rates : ndarray (b, 3)
        a <= b <= c, 1/m.
    sds : ndarray (b,)
        Stationary standard deviations.
    constant, by_speed, by_square, by_slope : ndarray (m, s)
        Coefficients of the measurements.
    variances, shaking : ndarray (m,)
        Of their noise: variances + u^3 shaking.
    """

    speed: FloatArray
    slope: FloatArray
    dt: float
    sizes: IntArray
    rates: FloatArray
    sds: FloatArray
    constant: FloatArray
    by_speed: FloatArray
    by_square: FloatArray
    by_slope: FloatArray
    variances: FloatArray
    shaking: FloatArray


@njit_borrowed
def divided_exponentials(a: float, b: float, c: float, run: float) -> tuple[float, float, float]:
    """Divided differences of exp(-x run) of order 0, 1 and 2 over x = -a, -b, -c; a <= b <= c.

    Where they are close the series of the complete homogeneous polynomials of their distances from the mean,
    of which a difference of exponentials would cancel.
    """
    zeroth = math.exp(-a * run)
    first = zeroth * run if b == a else -zeroth * math.expm1((a - b) * run) / (b - a)
    if (c - a) * run > 1.0:
        last = (
            -math.exp(-b * run) * math.expm1((b - c) * run) / (c - b) if c > b else math.exp(-b * run) * run
        )
        return zeroth, first, (first - last) / (c - a)
    mean = (a + b + c) / 3.0
    da, db, dc = (mean - a) * run, (mean - b) * run, (mean - c) * run
    e2, e3 = da * db + db * dc + dc * da, da * db * dc
    before, now, after = 0.0, 0.0, 1.0  # polynomials of order n - 2, n - 1, n
    total, share = 0.5, 0.5  # 1/(n + 2)!
    for n in range(1, SERIES):
        before, now, after = now, after, -e2 * now + e3 * before
        share /= n + 2
        total += share * after
    return zeroth, first, math.exp(-mean * run) * run * run * total


@njit_borrowed
def transition(run: float, size: int, rates: FloatArray, f: FloatArray) -> None:
    """F (size, size) of a coordinate over a way, by Newton's interpolation of the exponential."""
    a, b, c = rates[0], rates[1], rates[2]
    if size == 2:
        g0 = math.exp(-a * run)
        g1 = g0 * run if b == a else -g0 * math.expm1((a - b) * run) / (b - a)
        f[0, 0], f[0, 1] = g0 + a * g1, g1
        f[1, 0], f[1, 1] = -a * b * g1, g0 - b * g1
        return
    e1, e2, e3, ab = a + b + c, a * b + b * c + c * a, a * b * c, a * b
    g0, g1, g2 = divided_exponentials(a, b, c, run)
    f[0, 0], f[0, 1], f[0, 2] = g0 + a * g1 + ab * g2, g1 + (a + b) * g2, g2
    f[1, 0], f[1, 1] = -e3 * g2, g0 + a * g1 + (ab - e2) * g2
    f[1, 2] = g1 + (a + b - e1) * g2
    f[2, 0], f[2, 1] = -e3 * f[1, 2], -e3 * f[0, 2] - e2 * f[1, 2]
    f[2, 2] = f[1, 1] - e1 * f[1, 2]


@njit_borrowed
def intensity(size: int, sd: float, rates: FloatArray) -> float:
    """Of the white noise that makes a coordinate of this standard deviation."""
    a, b, c = rates[0], rates[1], rates[2]
    if size == 2:
        return float(2.0 * a * b * (a + b) * sd * sd)
    return float(2.0 * a * b * c * (a + b) * (b + c) * (c + a) / (a + b + c) * sd * sd)


@njit_borrowed
def step(run: float, waves: Waves, f: FloatArray, roots: FloatArray, work: FloatArray) -> None:
    """F (s, s) of a step, and ``roots`` (s, 3 b) with Q = roots roots'."""
    first = 0
    for b in range(waves.sizes.shape[0]):
        size, rates = waves.sizes[b], waves.rates[b]
        white = intensity(size, waves.sds[b], rates)
        for j in range(3):
            transition(run * POINTS[j], size, rates, work)
            root = math.sqrt(white * WEIGHTS[j] * run)
            for i in range(size):
                roots[first + i, 3 * b + j] = root * work[i, size - 1]
        transition(run, size, rates, work)
        for i in range(size):
            for c in range(size):
                f[first + i, first + c] = work[i, c]
        first += size


@njit_borrowed
def row_of(waves: Waves, k: int, m: int, h: FloatArray) -> None:
    """Coefficients (s,) of measurement m of sample k."""
    u, slope = waves.speed[k], waves.slope[k]
    for i in range(h.shape[0]):
        h[i] = (
            waves.constant[m, i]
            + u * waves.by_speed[m, i]
            + u * u * waves.by_square[m, i]
            + slope * waves.by_slope[m, i]
        )


@njit
def stationary(waves: Waves) -> FloatArray:
    """Covariance (s, s) before anything is measured."""
    total = waves.constant.shape[1]
    p = np.zeros((total, total))
    first = 0
    for b in range(waves.sizes.shape[0]):
        size, square = waves.sizes[b], waves.sds[b] ** 2
        x, y, z = waves.rates[b, 0], waves.rates[b, 1], waves.rates[b, 2]
        p[first, first] = square
        if size == 2:
            p[first + 1, first + 1] = square * x * y
        else:
            slope = square * x * y * z / (x + y + z)
            p[first + 1, first + 1] = slope
            p[first, first + 2] = p[first + 2, first] = -slope
            p[first + 2, first + 2] = slope * (x * y + y * z + z * x)
        first += size
    return p


class Desk(NamedTuple):
    """What the loops work in: F, roots of Q, and scratch."""

    f: FloatArray
    roots: FloatArray
    work: FloatArray
    block: FloatArray
    h: FloatArray
    gain: FloatArray
    v: FloatArray


@njit
def desk_of(waves: Waves) -> Desk:
    """All zero."""
    s, b = waves.constant.shape[1], waves.sizes.shape[0]
    return Desk(
        np.zeros((s, s)),
        np.zeros((s, 3 * b)),
        np.zeros((s, s)),
        np.zeros((3, 3)),
        np.zeros(s),
        np.zeros(s),
        np.zeros(s),
    )


@njit
def run_segment(
    waves: Waves,
    measured: FloatArray,
    first: int,
    last: int,
    x: FloatArray,
    p: FloatArray,
    desk: Desk,
    past: History,
    keeps: bool,
) -> None:
    """Filter over samples ``first`` to ``last``, in place; writes ``past`` if it keeps it."""
    s = x.shape[0]
    for k in range(first, last):
        run = waves.speed[k] * waves.dt if k > 0 else 0.0
        step(run, waves, desk.f, desk.roots, desk.block)
        if run > 0.0:
            for i in range(s):
                total = 0.0
                for c in range(s):
                    total += desk.f[i, c] * x[c]
                desk.v[i] = total
            for i in range(s):
                x[i] = desk.v[i]
            congruence(desk.f, p, desk.work)
            for i in range(s):
                for c in range(i, s):
                    total = p[i, c]
                    for j in range(desk.roots.shape[1]):
                        total += desk.roots[i, j] * desk.roots[c, j]
                    p[i, c] = p[c, i] = total
        if keeps:
            remember_prediction(past, k - first, x, p, desk.f)
        for m in range(measured.shape[1]):
            row_of(waves, k, m, desk.h)
            error = measured[k, m]
            for i in range(s):
                error -= desk.h[i] * x[i]
            noise = waves.variances[m] + waves.speed[k] ** 3 * waves.shaking[m]
            variance = update(x, p, desk.h, error, noise, desk.gain, desk.v)
            for i in range(s):
                for c in range(i + 1, s):
                    p[c, i] = p[i, c]
            if keeps:
                remember(past, k - first, m, desk.h, desk.gain, error, variance)


def smooth(
    waves: Waves, measured: FloatArray, wanted: IntArray, with_covariance: bool
) -> tuple[FloatArray, FloatArray]:
    """Smoothed states of which the numbers are wanted, (n, w), and their covariance (n, w, w), or (0, w, w).

    ``measured`` is (n, m).
    """
    n, w = len(measured), len(wanted)
    states, covariance = np.empty((n, w)), np.empty((n if with_covariance else 0, w, w))
    past = room_for_history(min(SEGMENT, n), waves.constant.shape[1], measured.shape[1])
    there_and_back(waves, measured, wanted, states, covariance, past)
    return states, covariance


@njit
def there_and_back(
    waves: Waves,
    measured: FloatArray,
    wanted: IntArray,
    states: FloatArray,
    covariance: FloatArray,
    past: History,
) -> None:
    """`smooth` with room to keep a segment."""
    n, s = measured.shape[0], waves.constant.shape[1]
    segments = (n + SEGMENT - 1) // SEGMENT
    starts, squares = np.zeros((segments, s)), np.zeros((segments, s, s))
    x, p, desk = np.zeros(s), stationary(waves), desk_of(waves)
    for number in range(segments):
        keep(starts, squares, number, x, p)
        last = min((number + 1) * SEGMENT, n)
        run_segment(waves, measured, number * SEGMENT, last, x, p, desk, past, False)
    lam, info = np.zeros(s), np.zeros((s, s))
    for number in range(segments - 1, -1, -1):
        first, last = number * SEGMENT, min((number + 1) * SEGMENT, n)
        take(x, p, starts[number], squares[number])
        run_segment(waves, measured, first, last, x, p, desk, past, True)
        back(past, first, last, lam, info, desk, wanted, states, covariance)


@njit_borrowed
def back(
    past: History,
    first: int,
    last: int,
    lam: FloatArray,
    info: FloatArray,
    desk: Desk,
    wanted: IntArray,
    states: FloatArray,
    covariance: FloatArray,
) -> None:
    """Back over a segment, as in `simrail.estimators.kalman.fixed_interval`."""
    s, sure = lam.shape[0], covariance.shape[0] > 0
    v = desk.v
    for k in range(last - 1, first - 1, -1):
        at = k - first
        for m in range(past.rows.shape[1] - 1, -1, -1):
            h, gain = past.rows[at, m], past.gains[at, m]
            withdraw(lam, h, gain, past.errors[at, m])
            if sure:
                row_product(gain, info, v)
                withdraw_information(info, h, gain, past.inverses[at, m], v)
        p, f = past.covariances[at], past.transitions[at]
        for a in range(wanted.shape[0]):
            i = wanted[a]
            total = past.states[at, i]
            for c in range(s):
                total -= p[i, c] * lam[c]
            states[k, a] = total
        row_product(lam, f, v)
        for i in range(s):
            lam[i] = v[i]
        if sure:
            speak(p, info, wanted, v, covariance[k])
            transpose(f, desk.f)
            congruence(desk.f, info, desk.work)


@njit_borrowed
def speak(p: FloatArray, info: FloatArray, wanted: IntArray, v: FloatArray, out: FloatArray) -> None:
    """P - P Lam P for the states that are wanted."""
    s = p.shape[0]
    for a in range(wanted.shape[0]):
        row_product(p[wanted[a]], info, v)
        for b in range(wanted.shape[0]):
            total = p[wanted[a], wanted[b]]
            for c in range(s):
                total -= v[c] * p[c, wanted[b]]
            out[a, b] = total


@njit
def simulate(
    waves: Waves, start: FloatArray, normals: FloatArray, states: FloatArray, measured: FloatArray
) -> None:
    """A draw of states (n, s) and measurements (n, m) from the model.

    ``start`` (s,) is the first state, ``normals`` (n, 3 b + m) are standard normal numbers.
    """
    n, s = states.shape
    x, desk = start.copy(), desk_of(waves)
    drives = desk.roots.shape[1]
    for k in range(n):
        run = waves.speed[k] * waves.dt if k > 0 else 0.0
        step(run, waves, desk.f, desk.roots, desk.block)
        for i in range(s):
            total = 0.0
            for c in range(s):
                total += desk.f[i, c] * x[c]
            for j in range(drives):
                total += desk.roots[i, j] * normals[k, j]
            desk.v[i] = total
        for i in range(s):
            x[i] = states[k, i] = desk.v[i]
        for m in range(measured.shape[1]):
            row_of(waves, k, m, desk.h)
            noise = waves.variances[m] + waves.speed[k] ** 3 * waves.shaking[m]
            total = math.sqrt(noise) * normals[k, drives + m]
            for i in range(s):
                total += desk.h[i] * x[i]
            measured[k, m] = total
