"""Are the smoother's covariances true? On a model that is exactly the filter's, over many draws, two-sided.

States are drawn from the filter's prior and its process, signals from its measurements and their noise, on a
curve with cant at steady speed. The angles are small, so that the equations are as good as linear. The
virtual positions are constants that no draw can match, so they get a variance that says nothing; that their
rows are right is for `test_trajectory_smoother` and `test_trajectory_equations`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import chi2
from simrail.estimators.trajectory.kernel import ROWS, STATES, WIDTH, Model, constant_rows, linearise
from simrail.estimators.trajectory.model import process_noise
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import run_model
from twins.trajectory import transition

from simrail.core.seeds import stream

DRAWS, SAMPLES, STEP, GRAVITY = 200, 300, 0.004, 9.81
NOISE = Hyperparameters(
    roll_rad2ps3=1e-3,
    pitch_rad2ps3=1e-3,
    yaw_rad2ps3=1e-3,
    lateral_m2ps5=1.0,
    vertical_m2ps5=1.0,
    accel_x_m2ps4=1e-2,
    lateral_position_m2=1e6,
    vertical_position_m2=1e6,
)
START_SD = np.array([2e-3, 5e-3, 2e-3, 5e-3, 2e-3, 5e-3, 0.002, 0.005, 0.05, 0.002, 0.005, 0.05])
AT = (0, 40, 150, 299)
"""Samples that are judged, each by itself."""

SPEED, RADIUS, CANT = 15.0, 300.0, -0.02


def curve() -> np.ndarray:
    """`TERMS` of a steady curve whose heading grows."""
    turn = SPEED / RADIUS
    yaw = turn * STEP * np.arange(SAMPLES)
    v, h = CANT * turn, turn
    row = [CANT, 0.0, 0.0, 0.0, SPEED * h, -SPEED * v]
    row += [0.0, -h * h, v * h, 0.0, v * h, -v * v, 0.0, 2 * v, 2 * h]
    track = np.tile(row, (SAMPLES, 1))
    track[:, 2] = yaw
    return track


@lru_cache
def run(scale: float = 1.0) -> dict[bool, tuple[np.ndarray, np.ndarray]]:
    """NEES of all states (draws, samples) and NIS, by smoothed or not; `scale` spoils the truth's noise."""
    rng = stream(5, "trajectory consistency")
    f, track = transition(STEP), curve()
    q = process_noise(NOISE, STEP)
    root, sd = np.linalg.cholesky(q), np.sqrt(NOISE.vector()[5:])
    start = np.zeros(STATES)
    start[[0, 5, 9]] = CANT, SPEED / RADIUS, 0.6
    kinds, process = np.zeros(SAMPLES, dtype=np.int64), q[None]
    upper, slips = np.triu_indices(STATES), np.empty((0, 3))
    g, rows = np.zeros(ROWS), np.zeros((ROWS, WIDTH))
    constant_rows(rows)
    found: dict[bool, tuple[np.ndarray, np.ndarray]] = {}
    nees, nis = (
        {False: np.empty((DRAWS, len(AT))), True: np.empty((DRAWS, len(AT)))},
        np.empty((DRAWS, SAMPLES)),
    )
    for draw in range(DRAWS):
        x = start + START_SD * rng.standard_normal(STATES)
        truth, signals = np.empty((SAMPLES, STATES)), np.empty((SAMPLES, 6))
        for k in range(SAMPLES):
            if k > 0:
                x = f @ x + scale * root @ rng.standard_normal(STATES)
            truth[k] = x
            linearise(x, track, slips, k, GRAVITY, g, rows)
            signals[k] = g[:6] + scale * sd[:6] * rng.standard_normal(6)
        model = Model(
            signals, track, slips, kinds, process, NOISE.vector()[None, 5:], np.array([0.0, 0.6]),
            start, START_SD**2, STEP, GRAVITY,
        )  # fmt: skip
        for smoothed in (False, True):
            result = run_model(model, smoothed=smoothed)
            covariance = np.zeros((len(AT), STATES, STATES))
            covariance[:, *upper] = covariance[:, *upper[::-1]] = result.covariance[list(AT)]
            error = (result.states - truth)[list(AT)]
            weighted = np.linalg.solve(covariance, error[:, :, None])[:, :, 0]
            nees[smoothed][draw] = np.einsum("ni,ni->n", error, weighted)
            nis[draw] = result.innovations[:, 6]
    for smoothed in (False, True):
        found[smoothed] = nees[smoothed], nis
    return found


def interval(draws: int, freedom: int, *, tests: int = 1) -> tuple[float, float]:
    """Two-sided 99 % interval of the mean of chi-square draws, shared by several tests."""
    tail = 0.005 / tests
    low, high = chi2.ppf([tail, 1.0 - tail], freedom * draws) / draws
    return float(low), float(high)


@pytest.mark.long
@pytest.mark.parametrize("smoothed", [False, True], ids=["filter", "smoother"])
def test_consistent_over_200_draws(smoothed: bool) -> None:
    nees, nis = run()[smoothed]
    low, high = interval(DRAWS, STATES, tests=len(AT))
    for at in range(len(AT)):
        assert low < nees[:, at].mean() < high
    # Innovations are white: every sample counts.
    low, high = interval(DRAWS * SAMPLES, 6)
    assert low < nis.mean() < high


@pytest.mark.parametrize("scale", [0.8, 1.25])
def test_a_noise_wrong_by_a_quarter_is_noticed(scale: float) -> None:
    """The test above has the power to see it."""
    for smoothed in (False, True):
        nees, nis = run(scale)[smoothed]
        low, high = interval(DRAWS, STATES, tests=len(AT))
        assert not low < nees[:, -1].mean() < high
        low, high = interval(DRAWS * SAMPLES, 6)
        assert not low < nis.mean() < high
