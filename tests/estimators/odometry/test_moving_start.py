"""A ride that begins at speed: seen as such, and its first seconds answered with hindsight."""

from __future__ import annotations

import numpy as np
import pytest
from simrail.estimators.odometry.moving_start import (
    Start,
    reading_variance,
    smoothed_back,
    start_of_counts,
)

PULSE = 2.0 * np.pi * 0.29 / 1024.0
TIME = np.arange(0.0, 6.0, 0.05)


def counted(way: np.ndarray) -> np.ndarray:
    return np.floor(way / PULSE) * PULSE


@pytest.mark.parametrize("speed", [0.5, 10.0, -40.0])
def test_a_train_at_speed_is_seen(speed: float) -> None:
    start = start_of_counts(TIME, counted(speed * TIME), PULSE)
    assert start.speed_mps == pytest.approx(speed, abs=0.1)


@pytest.mark.parametrize("jerk", [0.0, 0.3, 1.4])
def test_a_train_that_leaves_with_the_first_sample_begins_at_rest(jerk: float) -> None:
    assert start_of_counts(TIME, counted(jerk * TIME**3 / 6.0), PULSE) == Start()


def test_the_smoother_has_the_sds_that_it_has() -> None:
    """Counts and a jittering clock: over 200 draws the normalised errors of speed and acceleration are 1."""
    rng, speed, push = np.random.default_rng(1), 10.0, 0.6
    way = speed * TIME + 0.5 * push * TIME**2
    errors = []
    for _ in range(200):
        read = way + rng.normal(0.0, 0.01, len(TIME))
        read[0] = 0.0
        variance = reading_variance(TIME, read, PULSE)
        states, covariances = smoothed_back(TIME, read, Start(9.0, 2.0), variance=variance, intensity=0.01)
        errors.append((states[0, 1:] - [speed, push]) / np.sqrt(np.diag(covariances[0])[1:]))
    # The truth has no jerk, the model has: errors are smaller than told, never larger.
    assert (np.mean(np.square(errors), axis=0) < 1.3).all()
    assert (np.mean(np.square(errors), axis=0) > 0.1).all()
