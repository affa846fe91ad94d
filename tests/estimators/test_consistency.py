"""Is the EKF's covariance true? On a model that is exactly the filter's, over many draws, two-sided.

The matched model starts from the filter's own prior and adds the filter's own process and measurement
noise to the exact equations of a train in a curve. Then NEES of roll and pitch is chi-square with 2
degrees of freedom and NIS with 3. The interval is for the mean of independent draws, so each time is
judged by itself, and the times are far enough apart (many time constants) to be independent.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2
from simrail.estimators.attitude.kernel import attitude_ekf

from simrail.core.seeds import stream

STEP = 0.004
GRAVITY = 9.81
INTENSITY = 1e-6  # rad2/s: tau = sqrt(R Ts / Qc) / g = 1.3 s
NOISE = 0.2  # m/s2
START_SD = np.array([0.01, 0.01, 0.005])
CENTRE = np.array([-0.08, 0.02, 0.3])


def euler_rates(x: np.ndarray, w: np.ndarray) -> np.ndarray:
    roll, pitch, _ = x.T
    across = w[:, 1] * np.sin(roll) + w[:, 2] * np.cos(roll)
    return np.column_stack(
        [
            w[:, 0] + across * np.tan(pitch),
            w[:, 1] * np.cos(roll) - w[:, 2] * np.sin(roll),
            across / np.cos(pitch),
        ]
    )


def gravity(x: np.ndarray) -> np.ndarray:
    roll, pitch, _ = x.T
    return GRAVITY * np.column_stack(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
    )


def run(draws: int, samples: int, *, scale: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """NEES of roll and pitch, and NIS: each (draws, samples). `scale` falsifies the noise of the truth."""
    rng = stream(5, "consistency", draws)
    truth = np.empty((samples, draws, 3))
    rates = np.empty((samples, draws, 3))
    forces = np.empty((samples, draws, 3))
    x = CENTRE + START_SD * rng.standard_normal((draws, 3))
    for k in range(samples):
        # A curve that comes and goes, seen in the axes of a tilted body that rolls.
        bend = 0.15 * np.sin(0.7 * k * STEP)
        w = np.tile([0.05 * np.cos(1.1 * k * STEP), bend * np.sin(-0.08), bend], (draws, 1))
        if k > 0:
            w_true = w + scale * np.sqrt(INTENSITY / STEP) * rng.standard_normal((draws, 3))
            x = x + STEP * euler_rates(x, w_true)
        truth[k], rates[k] = x, w
        forces[k] = gravity(x) + scale * NOISE * rng.standard_normal((draws, 3))
    nees, nis = np.empty((draws, samples)), np.empty((draws, samples))
    states, covariance = np.empty((samples, 3)), np.empty((samples, 3, 3))
    innovations = np.empty((samples, 4))
    for draw in range(draws):
        attitude_ekf(
            np.ascontiguousarray(rates[:, draw]),
            np.ascontiguousarray(forces[:, draw]),
            np.full(samples, INTENSITY * STEP),
            np.full((samples, 3), NOISE**2),
            CENTRE.copy(),
            START_SD**2,
            STEP,
            GRAVITY,
            states,
            covariance,
            innovations,
        )
        error = states[:, :2] - truth[:, draw, :2]
        weighted = np.linalg.solve(covariance[:, :2, :2], error[:, :, None])[:, :, 0]
        nees[draw] = np.einsum("ni,ni->n", error, weighted)
        nis[draw] = innovations[:, 3]
    return nees, nis


def interval(draws: int, freedom: int, *, tests: int = 1) -> tuple[float, float]:
    """Two-sided 99 % interval of the mean of chi-square draws, shared by several tests."""
    tail = 0.005 / tests
    return (
        float(chi2.ppf(tail, freedom * draws)) / draws,
        float(chi2.ppf(1.0 - tail, freedom * draws)) / draws,
    )


def judge(draws: int, samples: int) -> None:
    nees, nis = run(draws, samples)
    # Errors of one draw are correlated over some tau; every 6 s they are as good as new.
    at = np.arange(1500, samples, 1500)
    low, high = interval(draws * at.size, 2)
    assert low < nees[:, at].mean() < high
    for k in (0, 100, samples - 1):
        low, high = interval(draws, 2, tests=3)
        assert low < nees[:, k].mean() < high
    # Innovations are white: every sample counts.
    low, high = interval(draws * samples, 3)
    assert low < nis.mean() < high


def test_consistent_over_40_draws() -> None:
    judge(40, 3001)


@pytest.mark.slow
def test_consistent_over_200_draws() -> None:
    judge(200, 12001)


@pytest.mark.parametrize("scale", [0.75, 1.3])
def test_a_noise_wrong_by_a_quarter_is_noticed(scale: float) -> None:
    """The test above has the power to see it."""
    nees, nis = run(40, 3001, scale=scale)
    low, high = interval(40 * 3001, 3)
    assert not low < nis.mean() < high
    low, high = interval(40 * 2, 2)
    assert not low < nees[:, [1500, 3000]].mean() < high
