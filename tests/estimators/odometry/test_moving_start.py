"""A ride that begins at speed: seen as such, and its first seconds answered with hindsight."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.moving_start import (
    SPEED_SD_MPS,
    Shown,
    Start,
    reading_variance,
    shown_by,
    smoothed_back,
    start_of,
    start_of_counts,
)

from simrail.recording.recording import EncoderSheet

PULSE = 2.0 * np.pi * 0.29 / 1024.0
TIME = np.arange(0.0, 6.0, 0.05)
SHEET = EncoderSheet("wheel", 1024, 0.29, 20.0)


def counted(way: np.ndarray) -> np.ndarray:
    return np.floor(way / PULSE) * PULSE


@pytest.mark.parametrize("speed", [0.5, 10.0, -40.0])
def test_a_train_at_speed_is_seen(speed: float) -> None:
    start = start_of_counts(TIME, counted(speed * TIME), PULSE)
    assert start.speed_mps == pytest.approx(speed, abs=0.1)


@pytest.mark.parametrize("rate", [1.0, 2.0, 20.0])
def test_a_slow_logger_shows_a_train_at_speed_as_well(rate: float) -> None:
    """By its first reading that counts, a second after the first at most; the ride file's word goes first."""
    time = np.arange(0.0, 6.0, 1.0 / rate)
    counts = pd.DataFrame({"pulse_count": np.floor(9.0 * time / PULSE).astype(np.int64)}, index=time)
    recording = SimpleNamespace(start_speed_mps=None, encoder=counts, encoder_sheet=SHEET)
    start = start_of(recording)  # type: ignore[arg-type]
    assert start.speed_mps == pytest.approx(9.0, abs=0.1) and start.sd_mps == SPEED_SD_MPS
    for told in (0.0, -3.0):
        recording.start_speed_mps = told
        assert start_of(recording) == (Start(told, SPEED_SD_MPS) if told else Start())  # type: ignore[arg-type]
    recording.start_speed_mps, recording.encoder = None, None
    assert start_of(recording) == Start()  # type: ignore[arg-type]


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


def odometry(way: np.ndarray, method: EncoderOdometry, until: int | None = None) -> pd.DataFrame:
    """What an odometry says of counts of a way at their own times."""
    counts = pd.DataFrame({"pulse_count": np.floor(way / PULSE).astype(np.int64)}, index=TIME)[:until]
    return method.from_counts(counts, SHEET, TIME[:until], 0.0)


def test_what_shows_a_train_at_speed_is_seen_when_it_comes_and_no_earlier() -> None:
    """Readings after the one that is named do not change it; a start from rest shows nothing."""
    way = counted(8.0 * TIME)
    whole = shown_by(TIME, way, PULSE)
    assert whole == Shown(1, 10)
    for n in range(2, len(TIME)):
        part = shown_by(TIME[:n], way[:n], PULSE)
        assert part == Shown(whole.first if n > whole.first else -1, whole.told if n > whole.told else -1)
    assert shown_by(TIME, counted(1.4 * TIME**3 / 6.0), PULSE) == Shown()


@pytest.mark.parametrize("speed", [8.0, -25.0])
def test_without_hindsight_the_beginning_is_causal_and_its_errors_are_within_its_sds(speed: float) -> None:
    """Bit by bit, a prefix gives the prefix; from the first reading that shows motion on, 3 sds hold."""
    way = speed * TIME + 0.15 * TIME**2
    causal = odometry(way, EncoderOdometry())
    assert EncoderOdometry().causal and not EncoderOdometry(hindsight=True).causal
    for n in (2, 5, 10, 11, 12, 40):
        pd.testing.assert_frame_equal(odometry(way, EncoderOdometry(), n), causal.iloc[:n], check_exact=True)
    off = np.abs(causal["speed_mps"] - (speed + 0.3 * TIME)).iloc[1:]
    assert (off < 3.0 * causal["speed_sd_mps"].iloc[1:] + 0.01).all()
    push = np.abs(causal["acceleration_mps2"] - 0.3).iloc[1:]
    assert (push < 3.0 * causal["acceleration_sd_mps2"].iloc[1:] + 0.02).all()
    back = odometry(way, EncoderOdometry(hindsight=True))
    assert abs(back["speed_mps"].iloc[0] - speed) < 3.0 * back["speed_sd_mps"].iloc[0] < 0.5


def test_a_ride_from_rest_is_the_same_with_hindsight_and_without() -> None:
    way = 0.7 * np.maximum(TIME - 1.0, 0.0) ** 3 / 6.0
    pd.testing.assert_frame_equal(
        odometry(way, EncoderOdometry()), odometry(way, EncoderOdometry(hindsight=True)), check_exact=True
    )
