"""The filter of the spectral odometry: its transition, against a joint Gaussian, and its consistency."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2
from simrail.estimators.odometry.spectral_kernel import STATES, A, E, Led, S, V, led_on, spectral_filter

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

STEP_S, FRAME, HOP = 0.1, 16, 4
START = np.array([0.0, 0.1**2, 0.1**2, 2.0**2])


def led() -> Led:
    return led_on(STEP_S, FRAME + HOP, sd=(0.7, 2.0), correlation_s=(10.0, 5.0))


def test_transition_keeps_what_is_stationary_and_repeats() -> None:
    """The variances of acceleration and error stay; five steps and then seven are twelve."""
    f, q = led()
    for j in (1, 12):
        for state, sd in ((A, 0.7), (E, 2.0)):
            np.testing.assert_allclose(
                f[j, state, state] ** 2 * sd**2 + q[j, state, state], sd**2, rtol=1e-12
            )
    np.testing.assert_allclose(f[7] @ f[5], f[12], atol=1e-12)
    np.testing.assert_allclose(f[7] @ q[5] @ f[7].T + q[7], q[12], atol=1e-12)
    t, tau = 12 * STEP_S, 10.0
    decay = np.exp(-t / tau)
    exact = [[1.0, t, tau * t - tau**2 * (1.0 - decay)], [0.0, 1.0, tau * (1.0 - decay)], [0.0, 0.0, decay]]
    np.testing.assert_allclose(f[12, :3, :3], exact, atol=1e-12)


def frames(n: int) -> np.ndarray:
    return np.arange(FRAME - 1, n, HOP)


def run(speed: FloatArray, direction: FloatArray, variance: float, n: int) -> FloatArray:
    out = np.empty((n, 6))
    noise = np.full(len(speed), variance)
    spectral_filter(speed, noise, direction, frames(n), FRAME // 2, led(), START, out)
    return out


def test_filter_equals_the_joint_gaussian() -> None:
    """Every sample's state given all frames that have ended by then; one tells nothing, one is backwards."""
    n, variance = 40, 0.3**2
    f, q = led()
    centres = frames(n) - FRAME // 2
    z = np.array([1.0, 3.0, np.nan, -4.0, 2.0, 2.5, 1.5])[: len(centres)]
    direction = np.array([1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0])[: len(centres)]
    found = run(z, direction, variance, n)

    # Covariance of the states at all samples, from the first one's and the step.
    joint = np.zeros((n, n, STATES, STATES))
    p = np.diag(START)
    for i in range(n):
        across = p
        for j in range(i, n):
            joint[j, i], joint[i, j] = across, across.T
            across = f[1] @ across
        p = f[1] @ p @ f[1].T + q[1]
    row = np.zeros((len(centres), STATES))
    row[:, V], row[:, E] = 1.0, direction
    for k in range(n):
        used = [i for i, end in enumerate(frames(n)) if end <= k and np.isfinite(z[i])]
        mean, cov = np.zeros(STATES), joint[k, k]
        if used:
            cross = np.column_stack([joint[k, centres[i]] @ row[i] for i in used])
            inner = np.array([[row[i] @ joint[centres[i], centres[j]] @ row[j] for j in used] for i in used])
            gain = np.linalg.solve(inner + variance * np.eye(len(used)), cross.T).T
            mean, cov = gain @ z[used], cov - gain @ cross.T
        np.testing.assert_allclose(found[k, :3], mean[:3], atol=1e-9)
        np.testing.assert_allclose(found[k, 3:], np.diag(cov)[:3], rtol=1e-8, atol=1e-12)


def test_a_steady_acceleration_leaves_no_lag() -> None:
    """Speeds that are exact, of a train that gains .5 m/s2: said of the end, they would be .4 m/s behind."""
    n = 400
    time = STEP_S * np.arange(n)
    exact = led_on(STEP_S, FRAME + HOP, sd=(0.7, 1e-6), correlation_s=(1e6, 5.0))
    ends, out = frames(n), np.empty((n, 6))
    speed = 0.5 * time[ends - FRAME // 2]
    few = np.full(len(ends), 1e-8)
    spectral_filter(speed, few, np.ones(len(ends)), ends, FRAME // 2, exact, START, out)
    np.testing.assert_allclose(out[100:, V], 0.5 * time[100:], atol=1e-3)
    np.testing.assert_allclose(out[100:, A], 0.5, atol=1e-3)


def test_stated_variances_are_those_of_the_errors() -> None:
    """On rides of its own model; two-sided, the mean of 300 normalised squares."""
    n, draws, variance = 120, 300, 0.3**2
    f, q = led()
    rng = stream(5, "consistency")
    root = np.linalg.cholesky(q[1] + 1e-18 * np.eye(STATES))
    x = np.sqrt(START) * rng.standard_normal((draws, STATES))
    states = np.empty((n, draws, STATES))
    for k in range(n):
        states[k] = x
        x = x @ f[1].T + rng.standard_normal((draws, STATES)) @ root.T
    centres = frames(n) - FRAME // 2
    z = states[centres, :, V] + states[centres, :, E]
    z += np.sqrt(variance) * rng.standard_normal(z.shape)
    squares = np.empty((draws, 3))
    for i in range(draws):
        out = run(np.ascontiguousarray(z[:, i]), np.ones(len(centres)), variance, n)
        squares[i] = (out[-1, :3] - states[-1, i, [S, V, A]]) ** 2 / out[-1, 3:]
    low, high = chi2.ppf([0.0005, 0.9995], draws) / draws
    assert ((low < squares.mean(axis=0)) & (squares.mean(axis=0) < high)).all()
