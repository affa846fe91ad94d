"""Compiled loops of the track-relative smoother: the filter, and the way back, in segments.

A linear Kalman filter of 52 states whose transition is a few small blocks: what is a process over the
distance stands still with the train. The way back is the modified Bryson-Frazier recursion of
`simrail.estimators.kalman`. It needs the filter's covariance at every step, 20 kB: the filter keeps one in
`SEGMENT` steps, and the way back runs it again over each segment, so that memory grows with the square root
of the ride's length only.

Not here: what the measurements are (`simrail.estimators.track_relative.measurement`), and how noisy
(`simrail.estimators.track_relative.noise`).

References: J. Hartikainen and S. Sarkka, MLSP 2010, 379-384 (Matern processes as state-space models);
A. Griewank, Optim. Methods Softw. 1 (1992) 35-54 (checkpoints).
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import (
    chain,
    chain_back,
    chain_covariance,
    chain_information,
    condition,
    information_share,
    mirror,
    withdraw,
)
from simrail.estimators.track_relative.states import (
    ACCEL_BIAS,
    CANT,
    CANT_ALONG,
    CURVE,
    EVEN,
    GYRO_BIAS,
    HEADING,
    LAG,
    LEFT,
    ODD,
    PITCH,
    RIGHT,
    ROLL,
    ROLL_SLOW,
    SCALE,
    SLOPE,
    STATES,
    TREAD,
    WAY,
    WIDTH,
    YAW,
    A,
    S,
    V,
    Y,
    Z,
)

from simrail.core.jit import FloatArray, IntArray, njit, njit_borrowed

SEGMENT = 256
"""Steps between two that the filter keeps."""

OUTPUTS = 8
"""Roll, pitch, yaw, place, speed, y, z; and the roll that is the rails'."""

INTO = (WAY, WAY, WAY, WAY, WAY, WAY, HEADING, HEADING, HEADING, S, S, V, ROLL_SLOW)
ORIGIN = (V, A, SCALE, TREAD, LEFT, RIGHT, CURVE, EVEN, ODD, V, A, A, ROLL)
"""Where the transition is a chain, as `simrail.estimators.kalman.chain` takes it."""

FORGETS = (TREAD, SLOPE, CURVE, CANT, EVEN, ODD, ROLL_SLOW)
"""States that a step may shrink, to nothing where what they speak of is behind."""

FLOWS = 14
"""Numbers of a step: way run (m, >= 0), way (m, signed), shares of heading by CURVE, EVEN and ODD, shares of
the wheel's path in curves to the left and right, what is kept of `FORGETS` but for the first and last: 5, the
variance that WAY gains, m2, and what is kept of ROLL_SLOW, which forgets what is behind and follows ROLL."""


class Noise(NamedTuple):
    """Sizes of the processes; m, s, rad.

    Attributes
    ----------
    sd, length : ndarray (6,)
        Of ROLL, PITCH, YAW, CANT_ALONG (Matern 3/2), Y and Z (Matern 5/2): standard deviation, and the length
        over which they change.
    sway_hz, damping : float
        Of a roll that sways in time: natural frequency and damping ratio; 0 Hz for none.
    jerk : float
        m2/s5, intensity of the acceleration's random walk.
    tread_sd, tread_length : float
        Relative, m.
    lag_walk : float
        m2/m.
    gyro_walk, accel_walk : float
        Of biases, rad2/s3, m2/s5.
    forgotten_sd : ndarray (5,)
        Of SLOPE, CURVE, CANT, EVEN, ODD where they begin anew.
    """

    sd: FloatArray
    length: FloatArray
    sway_hz: float
    damping: float
    jerk: float
    tread_sd: float
    tread_length: float
    lag_walk: float
    gyro_walk: float
    accel_walk: float
    forgotten_sd: FloatArray


class Model(NamedTuple):
    """A linear model of n steps.

    Attributes
    ----------
    columns, coefficients : ndarray of int (m, w), ndarray (n, m, w)
        Rows of the measurements: three gyros, three accelerometers, and what else there is.
    measured : ndarray (n, m)
        z less what the linearised model has as its constant: e = measured - H x.
    variances : ndarray (n, m)
        Of each; not finite for one that is not made.
    flows : ndarray (n, 14)
        `FLOWS` of the step that leads there.
    said_columns, said : ndarray of int (7, u), ndarray (n, 7, u)
        Rows of the outputs.
    dt : float
        s.
    noise : Noise
    """

    columns: IntArray
    coefficients: FloatArray
    measured: FloatArray
    variances: FloatArray
    flows: FloatArray
    said_columns: IntArray
    said: FloatArray
    dt: float
    noise: Noise


class Segment(NamedTuple):
    """What the filter leaves behind of a segment: predicted states, covariances, and each update."""

    states: FloatArray
    covariances: FloatArray
    gains: FloatArray
    errors: FloatArray
    inverses: FloatArray


class Scratch(NamedTuple):
    """Transition of a step, and what the loops work in.

    Attributes
    ----------
    f, q : ndarray (6, 3, 3)
        Of the pairs and triples, in the order of `Noise.sd`.
    back : ndarray (3, 3)
        Transpose of one of ``f``.
    kept : ndarray (7,)
        What is kept of `FORGETS`.
    h, v : ndarray (52,)
    gain : ndarray (52,)
    lines : ndarray (3, 52)
    """

    f: FloatArray
    q: FloatArray
    back: FloatArray
    kept: FloatArray
    h: FloatArray
    v: FloatArray
    gain: FloatArray
    lines: FloatArray


FIRST = np.array([ROLL, PITCH, YAW, CANT_ALONG, Y, Z])
"""First states of the blocks."""

SIZE = np.array([2, 2, 2, 2, 3, 3])
"""And how many there are of each."""


def room_for_segment(steps: int, rows: int) -> Segment:
    """Room for as many steps, of as many measurements."""
    shapes = (steps, STATES), (steps, STATES, WIDTH), (steps, rows, STATES), (steps, rows), (steps, rows)
    return Segment(*(np.zeros(shape) for shape in shapes))


def room_to_work() -> Scratch:
    """Scratch, all zero."""
    shapes = ((6, 3, 3), (6, 3, 3), (3, 3), (7,), (WIDTH,), (WIDTH,), (STATES,), (3, WIDTH))
    return Scratch(*(np.zeros(shape) for shape in shapes))


@njit_borrowed
def matern_pair(run: float, sd: float, length: float, f: FloatArray, q: FloatArray) -> None:
    """Matern 3/2 over a way (Hartikainen and Sarkka, 2010): F, and Q = P - F P F' of the stationary P."""
    rate = math.sqrt(3.0) / length
    d = rate * run
    e = math.exp(-d)
    f[0, 0], f[0, 1] = e * (1.0 + d), e * run
    f[1, 0], f[1, 1] = -e * rate * d, e * (1.0 - d)
    square = sd * sd
    p0, p1 = square, square * rate * rate
    q[0, 0] = p0 - f[0, 0] * f[0, 0] * p0 - f[0, 1] * f[0, 1] * p1
    q[0, 1] = q[1, 0] = -f[0, 0] * f[1, 0] * p0 - f[0, 1] * f[1, 1] * p1
    q[1, 1] = p1 - f[1, 0] * f[1, 0] * p0 - f[1, 1] * f[1, 1] * p1


@njit_borrowed
def matern_triple(run: float, sd: float, length: float, f: FloatArray, q: FloatArray) -> None:
    """Matern 5/2 over a way: F, and Q = P - F P F'."""
    rate = math.sqrt(5.0) / length
    d = rate * run
    e = math.exp(-d)
    f[0, 0], f[0, 1], f[0, 2] = e * (1.0 + d + 0.5 * d * d), e * run * (1.0 + d), e * 0.5 * run * run
    f[1, 0], f[1, 1], f[1, 2] = -e * 0.5 * rate * d * d, e * (1.0 + d - d * d), e * run * (1.0 - 0.5 * d)
    f[2, 0] = e * rate * rate * (0.5 * d * d - d)
    f[2, 1] = e * rate * (d * d - 3.0 * d)
    f[2, 2] = e * (1.0 - 2.0 * d + 0.5 * d * d)
    square = sd * sd
    p0, p1, p2 = square, square * rate * rate / 3.0, square * rate**4
    # P has p0, p1, p2 on its diagonal and -p1 in two corners.
    for i in range(3):
        for j in range(3):
            total = p0 * f[i, 0] * f[j, 0] + p1 * f[i, 1] * f[j, 1] + p2 * f[i, 2] * f[j, 2]
            total -= p1 * (f[i, 0] * f[j, 2] + f[i, 2] * f[j, 0])
            stationary = 0.0
            if i == j:
                stationary = p0 if i == 0 else (p1 if i == 1 else p2)
            elif i + j == 2:
                stationary = -p1
            q[i, j] = stationary - total


@njit_borrowed
def oscillator(dt: float, sd: float, hz: float, damping: float, f: FloatArray, q: FloatArray) -> None:
    """A damped oscillator driven by white noise, in time: F, and Q = P - F P F' with P = sd^2 (1, w^2)."""
    w = 2.0 * math.pi * hz
    decay = damping * w
    own = w * math.sqrt(1.0 - damping * damping)
    e, c, s = math.exp(-decay * dt), math.cos(own * dt), math.sin(own * dt)
    f[0, 0], f[0, 1] = e * (c + decay / own * s), e * s / own
    f[1, 0], f[1, 1] = -e * w * w / own * s, e * (c - decay / own * s)
    p0, p1 = sd * sd, sd * sd * w * w
    q[0, 0] = p0 - f[0, 0] * f[0, 0] * p0 - f[0, 1] * f[0, 1] * p1
    q[0, 1] = q[1, 0] = -f[0, 0] * f[1, 0] * p0 - f[0, 1] * f[1, 1] * p1
    q[1, 1] = p1 - f[1, 0] * f[1, 0] * p0 - f[1, 1] * f[1, 1] * p1


@njit_borrowed
def transition(flow: FloatArray, dt: float, noise: Noise, scratch: Scratch) -> None:
    """Blocks of the step's transition, and what is kept of `FORGETS`."""
    run = flow[0]
    for b in range(4):
        if b == 0 and noise.sway_hz > 0.0:
            oscillator(dt, noise.sd[0], noise.sway_hz, noise.damping, scratch.f[0], scratch.q[0])
        else:
            matern_pair(run, noise.sd[b], noise.length[b], scratch.f[b], scratch.q[b])
    for b in range(4, 6):
        matern_triple(run, noise.sd[b], noise.length[b], scratch.f[b], scratch.q[b])
    scratch.kept[0] = math.exp(-run / noise.tread_length)
    for i in range(5):
        scratch.kept[1 + i] = flow[7 + i]
    scratch.kept[6] = flow[13]


@njit_borrowed
def shares(flow: FloatArray, dt: float) -> tuple[float, ...]:
    """Entries of the chains at (`INTO`, `ORIGIN`)."""
    way, half = flow[1], 0.5 * dt * dt
    slow = (1.0 - flow[13]) / flow[13]  # it is shrunk after that
    return (dt, half, way, way, way * flow[5], way * flow[6], flow[2], flow[3], flow[4], dt, half, dt, slow)


@njit_borrowed
def predict(
    x: FloatArray, p: FloatArray, flow: FloatArray, dt: float, noise: Noise, scratch: Scratch
) -> None:
    """X <- F x, P <- F P F' + Q, in place; `transition` must have been called."""
    moves = shares(flow, dt)
    chain(x, INTO, ORIGIN, moves)
    chain_covariance(p, INTO, ORIGIN, moves)
    mirror(p)
    for r in range(len(FORGETS)):
        kept = scratch.kept[r]
        if kept != 1.0:
            i = FORGETS[r]
            shrink(x, p, i, kept)
            if r < 6:
                sd = noise.tread_sd if r == 0 else noise.forgotten_sd[r - 1]
                p[i, i] += sd * sd * (1.0 - kept * kept)
    for b in range(6):
        if flow[0] > 0.0 or (b == 0 and noise.sway_hz > 0.0):
            first, m, q = FIRST[b], SIZE[b], scratch.q[b]
            block(x, p, first, m, scratch.f[b], scratch.lines)
            for i in range(m):
                for j in range(i, m):
                    p[first + i, first + j] += q[i, j]
                    p[first + j, first + i] = p[first + i, first + j]
    way = flow[0]
    q = noise.jerk
    p[A, A] += q * dt
    p[V, A] += 0.5 * q * dt**2
    p[A, V] = p[V, A]
    p[V, V] += q * dt**3 / 3.0
    p[WAY, WAY] += flow[12]
    p[LAG, LAG] += noise.lag_walk * way
    for i in range(3):
        p[GYRO_BIAS[i], GYRO_BIAS[i]] += noise.gyro_walk * dt
        p[ACCEL_BIAS[i], ACCEL_BIAS[i]] += noise.accel_walk * dt


@njit_borrowed
def block(x: FloatArray, p: FloatArray, first: int, m: int, f: FloatArray, lines: FloatArray) -> None:
    """X <- F x, P <- F P F' for the m states from ``first``; P stays symmetric to the bit."""
    n, width = p.shape
    for i in range(m):
        total = 0.0
        for j in range(m):
            total += f[i, j] * x[first + j]
        lines[i, 0] = total
    for i in range(m):
        x[first + i] = lines[i, 0]
    for i in range(m):
        for c in range(width):
            total = 0.0
            for j in range(m):
                total += f[i, j] * p[first + j, c]
            lines[i, c] = total
    for i in range(m):
        for c in range(width):
            p[first + i, c] = lines[i, c]
        for c in range(n):
            p[c, first + i] = lines[i, c]
    for i in range(m):
        for j in range(i, m):
            total = 0.0
            for k in range(m):
                total += lines[i, first + k] * f[j, k]
            p[first + i, first + j] = p[first + j, first + i] = total


@njit_borrowed
def shrink(x: FloatArray, p: FloatArray, i: int, kept: float) -> None:
    """X <- F x, P <- F P F' where F keeps a share of state i, and of the others all: its own transpose."""
    n = x.shape[0]
    x[i] *= kept
    for c in range(n):
        p[i, c] *= kept
    for c in range(n):
        p[c, i] *= kept


@njit_borrowed
def predict_back(
    lam: FloatArray, info: FloatArray, flow: FloatArray, dt: float, noise: Noise, scratch: Scratch
) -> None:
    """Back through `predict`."""
    for b in range(6):
        if flow[0] > 0.0 or (b == 0 and noise.sway_hz > 0.0):
            m, f, back = SIZE[b], scratch.f[b], scratch.back
            for i in range(m):
                for j in range(m):
                    back[i, j] = f[j, i]
            block(lam, info, FIRST[b], m, back, scratch.lines)
    for r in range(len(FORGETS)):
        kept = scratch.kept[r]
        if kept != 1.0:
            shrink(lam, info, FORGETS[r], kept)
    moves = shares(flow, dt)
    chain_back(lam, INTO, ORIGIN, moves)
    chain_information(info, INTO, ORIGIN, moves)


@njit_borrowed
def measure(
    x: FloatArray, p: FloatArray, model: Model, k: int, m: int, scratch: Scratch
) -> tuple[float, float]:
    """Update with measurement m of step k; returns innovation and its variance."""
    width = p.shape[1]
    columns, row, v = model.columns[m], model.coefficients[k, m], scratch.v
    error = model.measured[k, m]
    for c in range(width):
        v[c] = 0.0
    for entry in range(columns.shape[0]):
        h = row[entry]
        if h != 0.0:
            i = columns[entry]
            error -= h * x[i]
            for c in range(width):
                v[c] += h * p[i, c]
    s = model.variances[k, m]
    for entry in range(columns.shape[0]):
        s += row[entry] * v[columns[entry]]
    condition(x, p, v, error, 1.0 / s, scratch.gain)
    return error, s


@njit_borrowed
def run_segment(
    x: FloatArray,
    p: FloatArray,
    model: Model,
    first: int,
    last: int,
    kept: Segment | None,
    scratch: Scratch,
    filtered: FloatArray,
    covariance: FloatArray,
    surprises: FloatArray,
) -> float:
    """Steps ``first`` to ``last`` of the filter, in place; returns -2 log-likelihood but for a constant.

    ``kept``, ``filtered`` (n, 52) with ``covariance`` (n, 7, 7) of the outputs, and ``surprises`` (n, m), the
    innovations over their sds, are written where there is room.
    """
    total = 0.0
    for k in range(first, last):
        transition(model.flows[k], model.dt, model.noise, scratch)
        predict(x, p, model.flows[k], model.dt, model.noise, scratch)
        at = k - first
        if kept is not None:
            for i in range(STATES):
                kept.states[at, i] = x[i]
                for c in range(WIDTH):
                    kept.covariances[at, i, c] = p[i, c]
        for m in range(model.columns.shape[0]):
            if kept is not None:
                kept.inverses[at, m] = 0.0
            if math.isfinite(model.variances[k, m]):
                error, s = measure(x, p, model, k, m, scratch)
                total += error * error / s + math.log(s)
                if kept is not None:
                    for i in range(STATES):
                        kept.gains[at, m, i] = scratch.gain[i]
                    kept.errors[at, m], kept.inverses[at, m] = error / s, 1.0 / s
                if surprises.shape[0] > 0:
                    surprises[k, m] = error / math.sqrt(s)
        if filtered.shape[0] > 0:
            for i in range(STATES):
                filtered[k, i] = x[i]
        if covariance.shape[0] > 0:
            say(p, model.said_columns, model.said[k], covariance[k])
    return total


@njit_borrowed
def say(p: FloatArray, columns: IntArray, rows: FloatArray, out: FloatArray) -> None:
    """Covariance (8, 8) of the outputs of which the rows are sparse."""
    for a in range(OUTPUTS):
        for b in range(a, OUTPUTS):
            total = 0.0
            for i in range(columns.shape[1]):
                if rows[a, i] != 0.0:
                    for j in range(columns.shape[1]):
                        total += rows[a, i] * rows[b, j] * p[columns[a, i], columns[b, j]]
            out[a, b] = out[b, a] = total


@njit
def run_filter(
    model: Model,
    starts: FloatArray,
    start_covariances: FloatArray,
    filtered: FloatArray,
    covariance: FloatArray,
    surprises: FloatArray,
    scratch: Scratch,
    x: FloatArray,
    p: FloatArray,
) -> float:
    """The filter over all steps; returns -2 log-likelihood but for a constant.

    ``starts`` and ``start_covariances``, of one row per segment or none, keep what each begins with.
    """
    n = model.measured.shape[0]
    total = 0.0
    for number in range(-(-n // SEGMENT)):
        if starts.shape[0] > 0:
            for i in range(STATES):
                starts[number, i] = x[i]
                for c in range(WIDTH):
                    start_covariances[number, i, c] = p[i, c]
        first = number * SEGMENT
        last = min(first + SEGMENT, n)
        total += run_segment(x, p, model, first, last, None, scratch, filtered, covariance, surprises)
    return total


@njit
def run_back(
    model: Model,
    starts: FloatArray,
    start_covariances: FloatArray,
    smoothed: FloatArray,
    covariance: FloatArray,
    segment: Segment,
    scratch: Scratch,
    x: FloatArray,
    p: FloatArray,
    lam: FloatArray,
    info: FloatArray,
    said: FloatArray,
    work: FloatArray,
) -> None:
    """Smoothed states (n, 52) and covariances (n, 7, 7) of the outputs, from the starts of the segments.

    ``said`` and ``work`` are (7, 52) and (7, 52), all zero, as ``lam`` (52,) and ``info`` (52, 52).
    """
    n = model.measured.shape[0]
    none, none3 = smoothed[:0], covariance[:0]
    for number in range(starts.shape[0] - 1, -1, -1):
        first, last = number * SEGMENT, min((number + 1) * SEGMENT, n)
        for i in range(STATES):
            x[i] = starts[number, i]
            for c in range(WIDTH):
                p[i, c] = start_covariances[number, i, c]
        run_segment(x, p, model, first, last, segment, scratch, none, none3, none)
        for k in range(last - 1, first - 1, -1):
            at = k - first
            for m in range(model.columns.shape[0] - 1, -1, -1):
                if segment.inverses[at, m] > 0.0:
                    unmeasure(lam, info, model, k, m, segment, at, scratch)
            smooth(segment, at, lam, smoothed[k])
            if covariance.shape[0] > 0:
                speak(
                    segment.covariances[at],
                    info,
                    model.said_columns,
                    model.said[k],
                    said,
                    work,
                    covariance[k],
                )
            transition(model.flows[k], model.dt, model.noise, scratch)
            predict_back(lam, info, model.flows[k], model.dt, model.noise, scratch)


@njit_borrowed
def unmeasure(
    lam: FloatArray,
    info: FloatArray,
    model: Model,
    k: int,
    m: int,
    segment: Segment,
    at: int,
    scratch: Scratch,
) -> None:
    """Back through `measure`: `simrail.estimators.kalman.withdraw_information` for a row of few entries."""
    h, v, gain = scratch.h, scratch.v, segment.gains[at, m]
    columns, row = model.columns[m], model.coefficients[k, m]
    entries, width = columns.shape[0], info.shape[1]
    for entry in range(entries):
        h[columns[entry]] += row[entry]
    withdraw(lam, h[:STATES], gain, segment.errors[at, m])
    for c in range(width):
        v[c] = 0.0
    for i in range(STATES):
        share = gain[i]
        if share != 0.0:
            for c in range(width):
                v[c] += share * info[i, c]
    information_share(v, h, gain, segment.inverses[at, m])
    for entry in range(entries):
        i, share = columns[entry], row[entry]
        if share != 0.0:
            for c in range(width):
                info[i, c] -= share * v[c]
            for r in range(STATES):
                info[r, i] -= v[r] * share
    for entry in range(entries):
        h[columns[entry]] = 0.0


@njit_borrowed
def smooth(segment: Segment, at: int, lam: FloatArray, out: FloatArray) -> None:
    """X = x^- - P^- lam."""
    for i in range(STATES):
        total = segment.states[at, i]
        for c in range(STATES):
            total -= segment.covariances[at, i, c] * lam[c]
        out[i] = total


@njit_borrowed
def speak(
    p: FloatArray,
    info: FloatArray,
    columns: IntArray,
    rows: FloatArray,
    said: FloatArray,
    work: FloatArray,
    out: FloatArray,
) -> None:
    """Covariance of the outputs of the smoothed states: A P A' - (A P) Lam (A P)'."""
    width = p.shape[1]
    for a in range(OUTPUTS):
        for c in range(width):
            said[a, c] = work[a, c] = 0.0
        for i in range(columns.shape[1]):
            share = rows[a, i]
            if share != 0.0:
                for c in range(width):
                    said[a, c] += share * p[columns[a, i], c]
    for i in range(STATES):
        for a in range(OUTPUTS):
            share = said[a, i]
            for c in range(width):
                work[a, c] += share * info[i, c]
    for a in range(OUTPUTS):
        for b in range(a, OUTPUTS):
            total = 0.0
            for i in range(columns.shape[1]):
                total += rows[b, i] * said[a, columns[b, i]]
            for c in range(STATES):
                total -= work[a, c] * said[b, c]
            out[a, b] = out[b, a] = total
