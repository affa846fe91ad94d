"""Gyro bias from the initial rest: mean of the past, never of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from estimators.rest_bias import rest_bias, step_rates
from simrail.recording import EncoderSheet, Recording

RATE = 250
GUARD = 125  # half a second


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    recording = exactly(bend())
    rng = np.random.default_rng(1)
    recording.imu.iloc[:, :3] += np.array([0.01, -0.02, 0.03]) + 1e-3 * rng.standard_normal(
        (len(recording.imu), 3)
    )
    return recording


def with_encoder(recording: Recording, first_pulse_s: float) -> Recording:
    times = np.arange(0.0, recording.imu.index[-1], 0.01)
    counts = np.maximum(np.floor((times - first_pulse_s) * 100) + 1, 0).astype(int)
    return replace(
        recording,
        encoder=pd.DataFrame({"pulse_count": counts}, index=pd.Index(times, name="time_s")),
        encoder_sheet=EncoderSheet("wheel", 1024, 0.29, 100.0),
    )


def test_bias_is_the_mean_of_the_rest_and_then_stays(noisy: Recording) -> None:
    recording = with_encoder(noisy, 1.6)
    found = rest_bias(recording)
    gyro = recording.imu.to_numpy()[:, :3]
    moving = 400  # first sample at or after 1.6 s
    for k in (GUARD + 1, 300, moving - 1):
        np.testing.assert_allclose(found.bias[k], gyro[: k - GUARD].mean(axis=0), rtol=1e-12)
        assert found.samples[k] == k - GUARD
    kept = gyro[: moving - GUARD].mean(axis=0)
    np.testing.assert_allclose(
        found.bias[moving:], np.broadcast_to(kept, (len(gyro) - moving, 3)), rtol=1e-12
    )
    assert (found.samples[moving:] == moving - GUARD).all()


def test_nothing_is_averaged_within_the_guard(noisy: Recording) -> None:
    found = rest_bias(with_encoder(noisy, 0.3))
    assert not found.bias.any() and not found.samples.any()


def test_without_an_encoder_the_odometry_speaks(noisy: Recording) -> None:
    found = rest_bias(noisy)
    speed = noisy.odometry["speed_mps"].to_numpy()
    standing = int(np.argmax(np.abs(speed) > 0.01))
    assert found.samples[-1] == standing - GUARD


def test_switched_off(noisy: Recording) -> None:
    found = rest_bias(noisy, enabled=False)
    assert not found.bias.any() and not found.samples.any()


def test_rate_over_a_step_is_the_mean_of_its_ends(noisy: Recording) -> None:
    bias = rest_bias(noisy).bias
    gyro = noisy.imu.to_numpy()[:, :3]
    rates = step_rates(noisy, bias)
    np.testing.assert_allclose(rates[1:], 0.5 * (gyro[1:] + gyro[:-1]) - bias[1:], rtol=0, atol=1e-16)
    np.testing.assert_array_equal(rates[0], gyro[0] - bias[0])
    assert rates.flags.c_contiguous
