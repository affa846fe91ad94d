"""Which way a train runs: by its first acceleration, by the encoder, or given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.direction import REST_S, running_direction

from simrail.core.columns import ACCEL, GYRO
from simrail.core.seeds import stream
from simrail.recording.recording import EncoderSheet, Recording


@pytest.mark.parametrize("direction", [1, -1])
def test_the_first_acceleration_tells(direction: int, bend: Callable, exactly: Callable) -> None:
    """On a slope of 20 permil, whose own share of gravity is more than the threshold."""
    recording = exactly(bend(direction=direction, rest_s=4.0))
    speed = recording.odometry["speed_mps"].to_numpy()
    alone = replace(recording, odometry=None, odometry_source="")
    found = running_direction(alone, "first_acceleration")
    moves = np.abs(speed) > 0.5
    np.testing.assert_array_equal(found[moves], np.sign(speed[moves]))


def pushes(exactly: Callable, bend: Callable, rest_s: float) -> Recording:
    """A push forwards, noise while it runs, a rest, and a push backwards; every part is 20 s but the rest."""
    rate = 250.0
    parts = [(0.0, 0.01), (0.6, 0.2), (0.0, 0.2), (-0.6, 0.2), (0.0, 0.2)]
    force = [np.full(int(20 * rate), mean) for mean, _ in parts]
    noise = [np.full(int(20 * rate), sd) for _, sd in parts]
    force += [np.zeros(int(rest_s * rate)), np.full(int(20 * rate), -0.6)]
    noise += [np.full(int(rest_s * rate), 0.01), np.full(int(20 * rate), 0.2)]
    sd, rng = np.concatenate(noise), stream(1, "pushes")
    values = sd[:, None] * rng.standard_normal((len(sd), 6)) * np.array([0.01] * 3 + [1.0] * 3)
    values[:, 3] += np.concatenate(force)
    values[:, 5] += 9.81
    index = pd.Index(np.arange(len(sd)) / rate, name="time_s")
    imu = pd.DataFrame(values, index=index, columns=[*GYRO, *ACCEL])
    return replace(exactly(bend()), imu=imu, odometry=None, odometry_source="")


def test_braking_does_not_turn_a_train_and_a_long_rest_may(bend: Callable, exactly: Callable) -> None:
    recording = pushes(exactly, bend, REST_S + 10.0)
    found = running_direction(recording, "first_acceleration")
    time = recording.imu.index.to_numpy()
    leaves = 101.0 + REST_S + 10.0
    assert (found[(time > 21.0) & (time < leaves - 2.0)] == 1.0).all()
    assert (found[time > leaves] == -1.0).all()
    # A halt at a signal: no driver changes ends in that.
    recording = pushes(exactly, bend, 0.5 * REST_S)
    assert (running_direction(recording, "first_acceleration") == 1.0).all()


def test_nothing_later_enters(bend: Callable, exactly: Callable) -> None:
    recording = pushes(exactly, bend, REST_S + 10.0)
    whole = running_direction(recording, "first_acceleration")
    decided = int(np.flatnonzero(np.diff(whole))[-1]) + 1
    for n in (5003, *range(decided - 12, decided + 3, 2)):
        part = running_direction(replace(recording, imu=recording.imu.iloc[:n]), "first_acceleration")
        np.testing.assert_array_equal(part, whole[:n])


def test_given_or_by_the_encoder(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend(direction=-1))
    assert (running_direction(recording, "forwards") == 1.0).all()
    assert (running_direction(recording, "backwards") == -1.0).all()
    sheet = EncoderSheet("wheel", 128, 0.29, 250.0)
    way = recording.odometry["position_m"] - recording.start_position_m
    counts = np.floor(way / sheet.pulse_m + 0.5).rename("pulse_count").to_frame()
    turned = running_direction(replace(recording, encoder=counts, encoder_sheet=sheet), "encoder")
    moves = recording.odometry["speed_mps"].abs().to_numpy() > 0.5
    assert (turned[moves] == -1.0).all()
    assert turned[-1] == -1.0  # at the final rest it is what it was
