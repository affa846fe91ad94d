"""Quiet: what an IMU alone says of a train that stands, or does not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from simrail.estimators.odometry.standstill import (
    ASTRAY,
    ASTRAY_SDS,
    FASTEST_MPS,
    FORCE_S,
    LEAST_TURN_RADPS,
    LOUDER,
    REST_FORCE_MPS2,
    REST_TURN_RADPS,
    RUN_FORCE_MPS2,
    STEADY_FORCE_MPS2,
    STEADY_SHARE,
    TURN_S,
    TURNING_RADPS,
    WINDOW_S,
    quiet_of,
    rest_log_ratio,
    signs_of_rest,
    speed_log_ratio,
)

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


def test_signs_are_means_of_what_came_before(still: Recording) -> None:
    """White noise and biases: as quiet as ever, and nothing later enters."""
    signs = signs_of_rest(still, 25)
    assert np.mean(signs.shaking > -1.5) > 0.98 and signs.shaking.max() <= np.log(2.0)
    signals = still.imu[[*GYRO, *ACCEL]].to_numpy()
    k, turn, force = 300, round(TURN_S * 10.0), round(FORCE_S * 10.0)
    np.testing.assert_allclose(signs.turning[k], signals[(k + 1 - turn) * 25 : (k + 1) * 25, :3].mean(axis=0))
    np.testing.assert_allclose(signs.force[k], signals[(k + 1 - force) * 25 : (k + 1) * 25, 3].mean())
    part = signs_of_rest(replace(still, imu=still.imu.iloc[:5000]), 25)
    for mine, whole in zip(part, signs, strict=True):
        np.testing.assert_array_equal(mine, whole[:200])


@pytest.mark.parametrize("column", [*GYRO, *ACCEL[:2]])
def test_slow_shaking_speaks_against_rest_where_noise_hides_it(still: Recording, column: str) -> None:
    """2 Hz with half the noise's standard deviation: a twelfth more in all, three times in what is slow."""
    sd, n = still.imu[column].std(), len(still.imu)
    imu = still.imu.copy()
    imu.iloc[5000:, imu.columns.get_loc(column)] += (
        0.5 * np.sqrt(2.0) * sd * np.sin(4.0 * np.pi * np.arange(n - 5000) / RATE_HZ)
    )
    signs = signs_of_rest(replace(still, imu=imu), 25)
    assert (signs.shaking[225:] < -2.0).all() and np.median(signs.shaking[:200]) > -0.5


def test_log_ratios_are_those_of_normal_laws() -> None:
    """Of each sign under both hypotheses, by scipy; the speed's law has a share that is astray."""
    turn, variance = np.array([1e-4, -2e-4, 3e-4]), np.array([1e-9, 2e-9, 3e-9])
    rest = np.sqrt(variance + REST_TURN_RADPS**2)
    runs = np.hypot(rest, LEAST_TURN_RADPS)
    expected = 0.3 + (norm.logpdf(turn, scale=rest) - norm.logpdf(turn, scale=runs)).sum()
    still_sd = np.hypot(0.01, REST_FORCE_MPS2)
    steady, driven = (
        math.log(share) + norm.logpdf(0.05, scale=np.hypot(still_sd, sd))
        for share, sd in ((STEADY_SHARE, STEADY_FORCE_MPS2), (1.0 - STEADY_SHARE, RUN_FORCE_MPS2))
    )
    expected += norm.logpdf(0.05, scale=still_sd) - np.logaddexp(steady, driven)
    assert rest_log_ratio(0.3, turn, variance, 0.05, 0.01**2) == pytest.approx(expected, rel=1e-10)
    for speed in (0.0, 1.0, 5.0):
        law = (1.0 - ASTRAY) * norm.pdf(speed, scale=0.5) + ASTRAY * norm.pdf(speed, scale=0.5 * ASTRAY_SDS)
        assert speed_log_ratio(speed, 0.25) == pytest.approx(np.log(law * 2.0 * FASTEST_MPS), rel=1e-10)
