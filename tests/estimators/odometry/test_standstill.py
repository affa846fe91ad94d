"""Quiet: what an IMU alone says of a train that stands, or does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.standstill import LOUDER, TURNING_RADPS, WINDOW_S, quiet_of

from simrail.core.columns import ACCEL, GYRO
from simrail.core.seeds import stream
from simrail.recording.recording import Recording

BLOCK, RATE_HZ = 5, 250.0


@pytest.fixture
def still(exactly: Callable, bend: Callable) -> Recording:
    """40 s of an IMU that shows its sheet's white noise, biases, and gravity on a slope."""
    ride: Recording = exactly(bend(15.0, 1))
    sheet = replace(ride.imu_sheet, rate_hz=RATE_HZ)
    time = np.arange(0.0, 40.0, 1.0 / RATE_HZ)
    sd = np.array([sheet.gyro_noise_radpsqrts] * 3 + [sheet.accel_noise_mpsqrts] * 3) * np.sqrt(RATE_HZ)
    values = stream(1, "still").standard_normal((len(time), 6)) * sd
    values += np.array([2e-3, -1e-3, 4e-3, 0.3, 0.1, 9.8])
    imu = pd.DataFrame(values, index=pd.Index(time, name="time_s"), columns=[*GYRO, *ACCEL])
    return replace(ride, imu=imu, imu_sheet=sheet)


def moved(recording: Recording, column: str, push: np.ndarray) -> np.ndarray:
    """Whether it is quiet where ``push`` (n,) is added to a signal from 20 s to 30 s, at those times."""
    time = recording.imu.index.to_numpy()
    inside = (time >= 20.0) & (time < 30.0)
    imu = recording.imu.copy()
    imu.loc[inside, column] += push[: inside.sum()]
    quiet = quiet_of(replace(recording, imu=imu), BLOCK)
    ends = time[BLOCK - 1 :: BLOCK][: len(quiet)]
    return quiet[(ends > 21.0) & (ends < 30.0)]


def test_a_train_that_stands_is_quiet(still: Recording) -> None:
    """Of white noise the window's sd varies by 1/sqrt(2 n) of itself, n = 500: 1.6 is never reached."""
    assert quiet_of(still, BLOCK).mean() > 0.99


@pytest.mark.parametrize("column", [*GYRO, *ACCEL])
def test_what_shakes_is_not_quiet(still: Recording, column: str) -> None:
    """Twice the noise is sqrt(3) times in what is added."""
    sd = still.imu[column].std()
    shakes = np.sqrt(3.0) * sd * stream(2, column).standard_normal(4000)
    assert not moved(still, column, shakes).any()
    assert LOUDER < 2.0


@pytest.mark.parametrize("column", GYRO)
def test_what_turns_is_not_quiet(still: Recording, column: str) -> None:
    after = moved(still, column, np.full(4000, 3.0 * TURNING_RADPS))
    assert not after[int((WINDOW_S - 1.0) * RATE_HZ / BLOCK) :].any()


def test_a_force_that_changes_is_not_quiet(still: Recording) -> None:
    """A jerk of 0.1 m/s3; a constant force is, and is for the slope of the line to explain."""
    assert not moved(still, ACCEL[0], 0.1 * np.arange(4000) / RATE_HZ).any()
    assert moved(still, ACCEL[0], np.full(4000, 0.2))[100:].all()


def test_nothing_later_enters(still: Recording) -> None:
    whole = quiet_of(still, BLOCK)
    part = quiet_of(replace(still, imu=still.imu.iloc[:5000]), BLOCK)
    np.testing.assert_array_equal(part, whole[:1000])
