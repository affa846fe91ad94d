"""The Kalman algebra against the joint normal distribution of all states and measurements, and filterpy.

`track_target` is at the same time the example of a new filter on `simrail.estimators.kalman`: what is not a
call there is its model.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter, rts_smoother
from scipy.stats import multivariate_normal
from simrail.estimators.kalman import (
    History,
    block_update,
    chain,
    chain_back,
    chain_covariance,
    chain_information,
    congruence,
    fixed_interval,
    keep,
    log_density,
    mirror,
    remember,
    remember_prediction,
    room_for_history,
    update,
)

from simrail.core.jit import FloatArray, njit

STEPS, N, M = 7, 4, 2
"""A target in the plane, x and y with their speeds, that is seen by two distances."""


class Target(NamedTuple):
    """Its model: dt (k,), q (k,), rows (k, 2, 4), noise (k, 2), start (4,), start_covariance (4, 4)."""

    dt: FloatArray
    q: FloatArray
    rows: FloatArray
    noise: FloatArray
    start: FloatArray
    start_covariance: FloatArray


@njit
def track_target(
    model: Target, z: FloatArray, states: FloatArray, covariances: FloatArray, past: History
) -> float:
    """Filter the measurements z (k, 2), NaN where there is none; returns their log-likelihood."""
    n = len(model.start)
    x, p = model.start.copy(), model.start_covariance.copy()
    f, work, gain, v = np.eye(n), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    likelihood = 0.0
    for k in range(len(z)):
        if k > 0:
            dt, q = model.dt[k], model.q[k]
            f[0, 2] = f[1, 3] = dt
            x[:] = f @ x
            congruence(f, p, work)
            for i in range(2):
                p[i, i] += q * dt**3 / 3.0
                p[i, i + 2] += q * dt**2 / 2.0
                p[i + 2, i] += q * dt**2 / 2.0
                p[i + 2, i + 2] += q * dt
        remember_prediction(past, k, x, p, f)
        for m in range(z.shape[1]):
            if np.isfinite(z[k, m]):
                h = model.rows[k, m]
                error = z[k, m] - h @ x
                s = update(x, p, h, error, model.noise[k, m], gain, v)
                remember(past, k, m, h, gain, error, s)
                likelihood += log_density(error * error / s, s, 1)
        keep(states, covariances, k, x, p)
    return likelihood


@pytest.fixture(scope="module")
def model() -> Target:
    rng = np.random.default_rng(1)
    root = rng.standard_normal((N, N))
    return Target(
        rng.uniform(0.1, 2.0, STEPS),
        rng.uniform(0.1, 1.0, STEPS),
        rng.standard_normal((STEPS, M, N)) * np.array([1.0, 1.0, 0.0, 0.3]),
        rng.uniform(0.1, 2.0, (STEPS, M)),
        rng.standard_normal(N),
        root @ root.T,
    )


def transition(dt: float) -> np.ndarray:
    return np.eye(N) + dt * np.eye(N, k=2)


def process(dt: float, q: float) -> np.ndarray:
    return q * np.kron([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]], np.eye(2))


class Joint(NamedTuple):
    """Normal distribution of all states, one after another, and of the measurements that were made."""

    mean: np.ndarray
    covariance: np.ndarray
    h: np.ndarray
    noise: np.ndarray
    z: np.ndarray

    def given(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of all states given the first measurements."""
        h, noise, z = self.h[:count], np.diag(self.noise[:count]), self.z[:count]
        gain = np.linalg.solve(h @ self.covariance @ h.T + noise, h @ self.covariance).T
        return self.mean + gain @ (z - h @ self.mean), self.covariance - gain @ h @ self.covariance


@pytest.fixture(scope="module")
def measured(model: Target) -> np.ndarray:
    z = 3.0 * np.random.default_rng(2).standard_normal((STEPS, M))
    z[3, 0] = z[5, 0] = z[5, 1] = np.nan
    return z


@pytest.fixture(scope="module")
def joint(model: Target, measured: np.ndarray) -> Joint:
    """States as a linear map of start and process noise, written out."""
    maps, noises, x = [np.eye(N)], [model.start_covariance], [model.start]
    for k in range(1, STEPS):
        f = transition(model.dt[k])
        maps.append(f)
        noises.append(process(model.dt[k], model.q[k]))
        x.append(f @ x[-1])
    whole, driven = np.zeros((STEPS * N, STEPS * N)), np.zeros((STEPS * N, STEPS * N))
    for k in range(STEPS):
        rows = slice(k * N, (k + 1) * N)
        if k > 0:
            whole[rows] = maps[k] @ whole[(k - 1) * N : k * N]
        whole[rows, rows] = np.eye(N)
        driven[rows, rows] = noises[k]
    made = [(k, m) for k in range(STEPS) for m in range(M) if np.isfinite(measured[k, m])]
    h = np.zeros((len(made), STEPS * N))
    for row, (k, m) in enumerate(made):
        h[row, k * N : (k + 1) * N] = model.rows[k, m]
    noise, z = (np.array([a[at] for at in made]) for a in (model.noise, measured))
    return Joint(np.concatenate(x), whole @ driven @ whole.T, h, noise, z)


class Run(NamedTuple):
    states: np.ndarray
    covariances: np.ndarray
    past: History
    likelihood: float


def run_by(track: Callable, model: Target, measured: np.ndarray) -> Run:
    states, covariances, past = np.empty((STEPS, N)), np.empty((STEPS, N, N)), room_for_history(STEPS, N, M)
    likelihood = track(model, measured, states, covariances, past)
    return Run(states, covariances, past, likelihood)


@pytest.fixture(scope="module")
def run(model: Target, measured: np.ndarray) -> Run:
    """By the interpreter, which is faster than to compile it; what it calls is compiled."""
    return run_by(track_target.py_func, model, measured)


@pytest.mark.slow
def test_the_example_compiles(run: Run, model: Target, measured: np.ndarray) -> None:
    compiled = run_by(track_target, model, measured)
    np.testing.assert_allclose(compiled.states, run.states, rtol=0, atol=1e-12)
    np.testing.assert_allclose(compiled.past.gains, run.past.gains, rtol=0, atol=1e-12)


def test_filter_and_likelihood_are_the_joint_distributions(
    run: Run, joint: Joint, measured: np.ndarray
) -> None:
    for k in range(STEPS):
        mean, covariance = joint.given(int(np.isfinite(measured[: k + 1]).sum()))
        at = slice(k * N, (k + 1) * N)
        np.testing.assert_allclose(run.states[k], mean[at], rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.covariances[k], covariance[at, at], rtol=0, atol=1e-9)
    spread = joint.h @ joint.covariance @ joint.h.T + np.diag(joint.noise)
    expected = multivariate_normal.logpdf(joint.z, joint.h @ joint.mean, spread)
    assert run.likelihood == pytest.approx(expected, rel=1e-9)


def test_smoother_is_the_joint_distributions(run: Run, joint: Joint) -> None:
    states, covariances = np.empty((STEPS, N)), np.empty((STEPS, N, N))
    fixed_interval(run.past, states, covariances)
    mean, covariance = joint.given(len(joint.z))
    np.testing.assert_allclose(states.ravel(), mean, rtol=0, atol=1e-9)
    for k in range(STEPS):
        at = slice(k * N, (k + 1) * N)
        np.testing.assert_allclose(covariances[k], covariance[at, at], rtol=0, atol=1e-9)


def test_filter_and_smoother_equal_filterpys(run: Run, model: Target, measured: np.ndarray) -> None:
    theirs = KalmanFilter(dim_x=N, dim_z=1)
    theirs.x, theirs.P = model.start.copy(), model.start_covariance.copy()
    for k in range(STEPS):
        if k > 0:
            theirs.predict(F=transition(model.dt[k]), Q=process(model.dt[k], model.q[k]))
        for m in range(M):
            if np.isfinite(measured[k, m]):
                theirs.update(measured[k, m], R=model.noise[k, m], H=model.rows[k, m][None])
        np.testing.assert_allclose(run.states[k], theirs.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.covariances[k], theirs.P, rtol=0, atol=1e-9)
    # filterpy's k-th F and Q are those of the step from k to k + 1.
    dts, qs = np.append(model.dt[1:], 1.0), np.append(model.q[1:], 1.0)
    steps = [transition(dt) for dt in dts], [process(dt, q) for dt, q in zip(dts, qs, strict=True)]
    by_rts = rts_smoother(run.states, run.covariances, *steps)
    states, covariances = np.empty((STEPS, N)), np.empty((STEPS, N, N))
    fixed_interval(run.past, states, covariances)
    np.testing.assert_allclose(states, by_rts[0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(covariances, by_rts[1], rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    "block_update",
    # To compile it takes longer than all else here together, and its algebra is the same.
    [block_update.py_func, pytest.param(block_update, marks=pytest.mark.slow)],
    ids=["plain", "compiled"],
)
def test_a_block_is_its_whitened_rows_one_by_one(block_update: Callable) -> None:
    """Correlated noise; Joseph's form leaves P symmetric and positive where the measurement is far better."""
    rng = np.random.default_rng(3)
    root, rows, errors = rng.standard_normal((N, N)), rng.standard_normal((3, N)), rng.standard_normal(3)
    x, p, spread = rng.standard_normal(N), root @ root.T, rng.standard_normal((3, 3))
    noise = spread @ spread.T
    one_x, one_p, gain, v = x.copy(), p.copy(), np.zeros(N), np.zeros(N)
    inverse = np.linalg.inv(np.linalg.cholesky(noise))
    likelihood = np.linalg.slogdet(inverse)[1]
    for row, error in zip(inverse @ rows, inverse @ (errors + rows @ x), strict=True):
        e = error - row @ one_x
        s = update(one_x, one_p, row, e, 1.0, gain, v)
        likelihood += log_density(e * e / s, s, 1)
    assert block_update(x, p, rows, errors, noise) == pytest.approx(likelihood, rel=1e-9)
    np.testing.assert_allclose(x, one_x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(p, one_p, rtol=0, atol=1e-9)
    p = np.diag([1e10, 1e10, 1e4, 1e4])
    block_update(x, p, rows, errors, 1e-6 * np.eye(3))
    assert np.linalg.eigvalsh(p).min() > 0.0


def test_chains_are_what_their_matrix_is() -> None:
    """Padded with zeros, for the state, the covariance, and both of the way back."""
    into, origin, share = (0, 0, 1), (1, 2, 2), (0.3, 0.045, 0.3)
    f = np.eye(3)
    f[list(into), list(origin)] = share
    rng = np.random.default_rng(4)
    x, root = rng.standard_normal(3), rng.standard_normal((3, 3))
    p = np.zeros((3, 4))
    p[:, :3] = root @ root.T
    whole = p[:, :3].copy()
    for function, expected in ((chain, f @ x), (chain_back, f.T @ x)):
        moved = x.copy()
        function(moved, into, origin, share)
        np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-14)
    for function, expected in ((chain_covariance, f @ whole @ f.T), (chain_information, f.T @ whole @ f)):
        moved = p.copy()
        function(moved, into, origin, share)
        mirror(moved)
        np.testing.assert_allclose(moved[:, :3], expected, rtol=0, atol=1e-14)
        assert not moved[:, 3].any()
