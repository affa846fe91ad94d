"""The track-relative filter and smoother by whole matrices: short, readable, what their kernels are held to.

The transition is made of the differential equations of its processes (matrix exponentials and Lyapunov
equations), not of the closed forms of the kernel. Not for long rides: every covariance is a whole matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter, rts_smoother
from scipy.linalg import expm, solve_continuous_lyapunov
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.kernel import Model, Noise

from simrail.core.jit import FloatArray


def matern_3_2(length: float) -> FloatArray:
    """Generator (2, 2) of a Matern process of order 3/2 and its derivative: (d/ds + a)^2 x = white."""
    a = math.sqrt(3.0) / length
    return np.array([[0.0, 1.0], [-(a**2), -2.0 * a]])


def matern_5_2(length: float) -> FloatArray:
    """Generator (3, 3) of order 5/2: (d/ds + a)^3 x = white."""
    a = math.sqrt(5.0) / length
    return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-(a**3), -3.0 * a**2, -3.0 * a]])


def swaying(hz: float, damping: float) -> FloatArray:
    """Generator (2, 2) of a damped oscillator that white noise drives, in time."""
    w = 2.0 * math.pi * hz
    return np.array([[0.0, 1.0], [-(w**2), -2.0 * damping * w]])


def stationary(generator: FloatArray, sd: float) -> FloatArray:
    """Covariance P of A P + P A' + q e e' = 0, with the q for which the first state has that sd."""
    drive = np.zeros_like(generator)
    drive[-1, -1] = 1.0
    unit = solve_continuous_lyapunov(generator, -drive)
    return np.asarray(unit * sd**2 / unit[0, 0])


def moved(generator: FloatArray, p: FloatArray, run: float) -> tuple[FloatArray, FloatArray]:
    """F = exp(A run), and the noise Q that keeps the stationary covariance P."""
    f = expm(generator * run)
    return f, p - f @ p @ f.T


class Step(NamedTuple):
    """F and Q (m, m) of a step."""

    f: FloatArray
    q: FloatArray


class Process(NamedTuple):
    """First state, generator A, stationary covariance P, and whether it goes by time."""

    first: int
    generator: FloatArray
    p: FloatArray
    by_time: bool


def processes(noise: Noise) -> list[Process]:
    """What moves in the track, and the cant along the line."""
    sways = noise.sway_hz > 0.0
    roll = swaying(noise.sway_hz, noise.damping) if sways else matern_3_2(noise.length[0])
    pairs = [roll, *(matern_3_2(length) for length in noise.length[1:4])]
    generators = [*pairs, *(matern_5_2(length) for length in noise.length[4:])]
    return [
        Process(first, generator, stationary(generator, sd), sways and first == at.ROLL)
        for first, generator, sd in zip((*at.PAIRS, *at.TRIPLES), generators, noise.sd, strict=True)
    ]


def steps_of(model: Model) -> list[Step]:
    """Transition that leads to each step: the chains first, then what it forgets, then the processes."""
    ours = processes(model.noise)
    return [_step(model, flow, ours) for flow in model.flows]


def _step(model: Model, flow: FloatArray, ours: list[Process]) -> Step:
    noise, dt = model.noise, model.dt
    run, way, by_curve, by_even, by_odd, left, right = flow[:7]
    chains, kept, sd = np.eye(at.STATES), np.ones(at.STATES), np.zeros(at.STATES)
    for place in (at.WAY, at.S):
        chains[place, at.V], chains[place, at.A] = dt, 0.5 * dt**2
    chains[at.V, at.A] = dt
    for state, share in ((at.SCALE, 1.0), (at.TREAD, 1.0), (at.LEFT, left), (at.RIGHT, right)):
        chains[at.WAY, state] = way * share
    for state, share in ((at.CURVE, by_curve), (at.EVEN, by_even), (at.ODD, by_odd)):
        chains[at.HEADING, state] = share
    chains[at.ROLL_SLOW, at.ROLL] = (1.0 - flow[13]) / flow[13]
    kept[at.ROLL_SLOW] = flow[13]
    forgotten = [at.SLOPE, at.CURVE, at.CANT, at.EVEN, at.ODD]
    kept[at.TREAD], kept[forgotten] = math.exp(-run / noise.tread_length), flow[7:12]
    sd[at.TREAD], sd[forgotten] = noise.tread_sd, noise.forgotten_sd
    f, q = np.diag(kept) @ chains, np.diag(sd**2 * (1.0 - kept**2))
    for process in ours:
        rows = slice(process.first, process.first + len(process.p))
        f[rows, rows], q[rows, rows] = moved(process.generator, process.p, dt if process.by_time else run)
    # The random walk of the acceleration moves the speed; of the place it is below a micrometre in a step.
    q[np.ix_((at.V, at.A), (at.V, at.A))] += noise.jerk * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    q[at.WAY, at.WAY] += flow[12]
    q[at.LAG, at.LAG] += noise.lag_walk * run
    for gyro, accel in zip(at.GYRO_BIAS, at.ACCEL_BIAS, strict=True):
        q[gyro, gyro] += noise.gyro_walk * dt
        q[accel, accel] += noise.accel_walk * dt
    return Step(f, q)


def whole_rows(columns: np.ndarray, coefficients: FloatArray) -> FloatArray:
    """Rows (7, m) of those of few entries."""
    rows = np.zeros((len(columns), at.STATES))
    for row, (states, values) in enumerate(zip(columns, coefficients, strict=True)):
        np.add.at(rows[row], states, values)
    return rows


class Found(NamedTuple):
    """States (n, m), covariances (n, m, m), innovations over their sds (n, 7), -2 log-likelihood.

    The innovations are those of measurements taken one after another, as the kernel takes them.
    """

    states: FloatArray
    covariances: FloatArray
    surprises: FloatArray
    total: float


def filterpy_filter(model: Model, steps: list[Step], x: FloatArray, p: FloatArray) -> Found:
    """The filter by filterpy: block update in Joseph's form.

    Innovations one after another are those of the block in the axes of its covariance's Cholesky factor.
    """
    n = len(model.measured)
    rows_made = model.measured.shape[1]
    kalman = KalmanFilter(dim_x=at.STATES, dim_z=rows_made)
    kalman.x, kalman.P = x.copy(), p[:, : at.STATES].copy()
    states, covariances = np.empty((n, at.STATES)), np.empty((n, at.STATES, at.STATES))
    surprises, total = np.full((n, rows_made), np.nan), 0.0
    for k, (f, q) in enumerate(steps):
        kalman.predict(F=f, Q=q)
        made = np.isfinite(model.variances[k])
        rows = whole_rows(model.columns, model.coefficients[k])[made]
        kalman.update(model.measured[k][made], R=np.diag(model.variances[k][made]), H=rows)
        root = np.linalg.cholesky(kalman.S)
        surprises[k, made] = np.linalg.solve(root, kalman.y)
        total += np.nansum(surprises[k] ** 2) + 2.0 * np.log(np.diag(root)).sum()
        states[k], covariances[k] = kalman.x, kalman.P
    return Found(states, covariances, surprises, float(total))


def filterpy_smoother(steps: list[Step], found: Found) -> tuple[FloatArray, FloatArray]:
    """Smoothed states and covariances by filterpy's Rauch-Tung-Striebel recursion."""
    ahead = [*steps[1:], steps[-1]]  # filterpy's k-th is that from k to k + 1; the last is not used
    smoothed = rts_smoother(found.states, found.covariances, [s.f for s in ahead], [s.q for s in ahead])
    return smoothed[0], smoothed[1]


def square_root(covariance: FloatArray) -> FloatArray:
    """Of a covariance that may be singular, and below zero by rounding."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    sd[sd == 0.0] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(sd, sd))
    return np.asarray(sd[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def draw(
    model: Model,
    start: FloatArray,
    covariance: FloatArray,
    rng: np.random.Generator,
    *,
    draws: int,
    scale: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """States (n, draws, m) and measurements (draws, n, rows) of the model's world.

    ``scale`` spoils the noise of both.
    """
    n, rows = model.measured.shape
    x = start + rng.standard_normal((draws, at.STATES)) @ square_root(covariance[:, : at.STATES]).T
    states, measured = np.empty((n, draws, at.STATES)), np.empty((draws, n, rows))
    for k, (f, q) in enumerate(steps_of(model)):
        x = x @ f.T + scale * rng.standard_normal((draws, at.STATES)) @ square_root(q).T
        states[k] = x
        noise = np.sqrt(model.variances[k]) * rng.standard_normal((draws, rows))
        measured[:, k] = x @ whole_rows(model.columns, model.coefficients[k]).T + scale * noise
    return states, measured
