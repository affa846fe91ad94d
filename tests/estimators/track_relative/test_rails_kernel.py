"""The smoother at full rate against the joint Gaussian of a short ride, its processes against theirs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag, expm
from simrail.estimators.track_relative.full_rate import Chain, error_of
from simrail.estimators.track_relative.rails_kernel import Waves, smooth, stationary, step

from simrail.core.jit import FloatArray

N, DT = 120, 0.004


def companion(rates: FloatArray) -> FloatArray:
    """Generator of (d/ds + a)(d/ds + b) ... x = white."""
    generator = np.eye(len(rates), k=1)
    generator[-1] = -np.polynomial.polynomial.polyfromroots(-rates)[:-1]
    return generator


RATES = {
    "pair alike": np.array([0.4, 0.4]),
    "pair": np.array([0.1, 0.9]),
    "alike": np.array([0.45, 0.45, 0.45]),
    "two alike": np.array([0.02, 0.43, 0.43]),
    "nearly alike": np.array([0.3, 0.3001, 0.3002]),
    "three": np.array([0.02, 0.8, 3.0]),
}


def waves_of(parts: list[FloatArray], sds: list[float], rows: FloatArray, variances: list[float]) -> Waves:
    """A ride that stands, sets off and brakes; ``rows`` (4, m, s)."""
    time = np.arange(N) * DT
    speed = np.maximum(20.0 * np.sin(2.0 * np.pi * (time - 0.05) / 0.7), 0.0)
    padded = np.array([np.pad(rates, (0, 3 - len(rates))) for rates in parts])
    sizes, shaking = np.array([len(rates) for rates in parts]), np.full(len(variances), 1e-6)
    slope = np.gradient(speed, DT)
    return Waves(speed, slope, DT, sizes, padded, np.array(sds), *rows, np.array(variances), shaking)


def side() -> Waves:
    """Roll and y, of which one measurement shows both."""
    rows = np.zeros((4, 2, 5))
    rows[1, 0, 1] = 1.0
    rows[0, 1, 0], rows[2, 1, 4], rows[3, 1, 3] = 9.81, 1.0, 1.0
    return waves_of([RATES["pair alike"], RATES["two alike"]], [1.3e-3, 4e-3], rows, [2e-6, 3e-4])


def one_process(rates: FloatArray) -> Waves:
    size = len(rates)
    return waves_of([rates], [2e-3], np.zeros((4, 1, size)), [1.0])


@pytest.mark.parametrize("run", [0.0, 1e-4, 0.08, 0.3])
@pytest.mark.parametrize("process", RATES)
def test_a_step_is_the_exponential_and_keeps_the_process_stationary(process: str, run: float) -> None:
    """F = exp(A run), Q = P - F P F'; the latter to what Gauss's rule leaves, of order (c run)^6."""
    rates = RATES[process]
    waves, size = one_process(rates), len(rates)
    f, roots = np.zeros((size, size)), np.zeros((size, 3))
    step(run, waves, f, roots, np.zeros((3, 3)))
    np.testing.assert_allclose(f, expm(companion(rates) * run), rtol=1e-12, atol=1e-13)
    p = stationary(waves)
    scale = np.sqrt(np.outer(np.diag(p), np.diag(p)))
    left = (f @ p @ f.T + roots @ roots.T - p) / scale
    assert np.abs(left).max() < 1e-13 + (rates.max() * run) ** 7


def joint(waves: Waves) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Covariance of all states (N s, N s), rows of all measurements, and their noise, written out."""
    parts = [rates[:size] for rates, size in zip(waves.rates, waves.sizes, strict=True)]
    generator, p = block_diag(*map(companion, parts)), stationary(waves)
    s, m = len(p), len(waves.variances)
    travelled = np.cumsum(np.concatenate([[0.0], waves.speed[1:] * waves.dt]))
    covariance, rows = np.zeros((N * s, N * s)), np.zeros((N * m, N * s))
    for i in range(N):
        for j in range(i, N):
            block = expm(generator * (travelled[j] - travelled[i])) @ p
            covariance[j * s : (j + 1) * s, i * s : (i + 1) * s] = block
            covariance[i * s : (i + 1) * s, j * s : (j + 1) * s] = block.T
        u, slope = waves.speed[i], waves.slope[i]
        h = waves.constant + u * waves.by_speed + u**2 * waves.by_square + slope * waves.by_slope
        rows[i * m : (i + 1) * m, i * s : (i + 1) * s] = h
    noise = np.repeat(waves.speed**3, m) * np.tile(waves.shaking, N) + np.tile(waves.variances, N)
    return covariance, rows, noise


def posterior(waves: Waves) -> tuple[FloatArray, FloatArray]:
    """Gain (N s, N m) and covariance (N s, N s) of the states given all measurements."""
    covariance, rows, noise = joint(waves)
    across = covariance @ rows.T
    gain = np.linalg.solve(rows @ across + np.diag(noise), across.T).T
    return gain, covariance - gain @ across.T


def test_the_smoother_is_the_joint_gaussian() -> None:
    """Of a ride that stands, moves and stands: expectation and covariance of roll and y, to rounding."""
    waves, rng = side(), np.random.default_rng(1)
    gain, covariance = posterior(waves)
    scale = np.array([5e-3, 0.05])
    measured, wanted = scale * rng.standard_normal((N, 2)), np.array([0, 2])
    states, sure = smooth(waves, measured, wanted, with_covariance=True)
    expected = (gain @ measured.ravel()).reshape(N, 5)[:, wanted]
    np.testing.assert_allclose(states, expected, atol=1e-7 * np.abs(expected).max(axis=0).min())
    for k in range(N):
        block = covariance[5 * k : 5 * k + 5, 5 * k : 5 * k + 5][np.ix_(wanted, wanted)]
        np.testing.assert_allclose(sure[k], block, rtol=1e-5, atol=1e-6 * np.sqrt(block[0, 0] * block[1, 1]))
    again, none = smooth(waves, measured, wanted, with_covariance=False)
    np.testing.assert_array_equal(again, states)
    assert none.shape == (0, 2, 2)


def test_draws_of_the_error_are_of_the_joint_posterior() -> None:
    """Of y and roll at four samples of the ride together: chi-squared of 8 degrees, mean of 400 draws."""
    waves, wanted = side(), np.array([0, 2])
    _, covariance = posterior(waves)
    samples = np.array([5, 40, 60, 110])
    rows = (5 * samples[:, None] + wanted).ravel()
    root = np.linalg.cholesky(covariance[np.ix_(rows, rows)])
    chain, rng, count = Chain(waves, (0, 2), wanted), np.random.default_rng(2), 400
    drawn = np.array([error_of(chain, rng)[samples].ravel() for _ in range(count)])
    squares = (np.linalg.solve(root, drawn.T) ** 2).sum(axis=0)
    assert squares.mean() == pytest.approx(8.0, abs=4.0 * np.sqrt(16.0 / count))
    assert np.abs(np.linalg.solve(root, drawn.T).mean(axis=1)).max() < 4.0 / np.sqrt(count)


def test_a_ride_of_several_segments_is_smoothed_as_one() -> None:
    """2500 samples of a process of second order: a Kalman filter and Rauch, Tung and Striebel's smoother."""
    rates, n = RATES["pair"], 2500
    one = waves_of(
        [rates], [2e-3], np.array([[[0.0, 0.0]], [[0.0, 1.0]], [[0.0, 0.0]], [[0.0, 0.0]]]), [1e-6]
    )
    waves = one._replace(speed=np.full(n, 15.0), slope=np.zeros(n))
    measured = 1e-3 * np.random.default_rng(3).standard_normal((n, 1))
    f, p = expm(companion(rates) * 15.0 * DT), stationary(waves)
    q, h, x = p - f @ p @ f.T, np.array([0.0, 15.0]), np.zeros(2)
    predicted, filtered = [], []
    for k in range(n):
        if k:
            x, p = f @ x, f @ p @ f.T + q
        predicted.append((x, p))
        gain = p @ h / (h @ p @ h + 1e-6 + 15.0**3 * 1e-6)
        x, p = x + gain * (measured[k, 0] - h @ x), p - np.outer(gain, h @ p)
        filtered.append((x, p))
    expected, variance = np.empty(n), np.empty(n)
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            back = filtered[k][1] @ f.T @ np.linalg.inv(predicted[k + 1][1])
            x = filtered[k][0] + back @ (x - predicted[k + 1][0])
            p = filtered[k][1] + back @ (p - predicted[k + 1][1]) @ back.T
        expected[k], variance[k] = x[0], p[0, 0]
    states, sure = smooth(waves, measured, np.array([0]), with_covariance=True)
    np.testing.assert_allclose(states[:, 0], expected, atol=1e-7 * np.abs(expected).max())
    np.testing.assert_allclose(sure[:, 0, 0], variance, rtol=1e-6)
