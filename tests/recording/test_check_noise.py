"""Noise, tones and steps of a signal are held against the sheet, at rest and under way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.check_noise import noise_warnings
from simrail.recording.recording import Recording
from tests.shared.noisy_ride import COUNT, TIME, N, ride, way_of_speed

STANDING = ride(np.zeros(COUNT))
BRIEF = ride(way_of_speed(np.clip(TIME - 1.3, 0.0, 10.0)))
"""Stands for 1.3 s, of which some 0.8 s are trusted."""
NEVER_STANDS = ride(way_of_speed(4.0 + 0.3 * TIME))


def changed(sound: Recording, kind: str, factor: float | FloatArray) -> Recording:
    columns = list(GYRO if kind == "gyro" else ACCEL)
    return replace(sound, imu=sound.imu.assign(**{c: sound.imu[c] * factor for c in columns}))


@pytest.mark.parametrize("sound", [STANDING, BRIEF, NEVER_STANDS])
def test_the_noise_of_the_sheet_is_no_fault(sound: Recording) -> None:
    assert noise_warnings(sound) == ()


@pytest.mark.parametrize("sound", [STANDING, BRIEF])
@pytest.mark.parametrize(
    ("factor", "kind", "words"), [(20.0, "gyro", "20 times"), (0.02, "accel", "smoothed")]
)
def test_noise_at_rest_is_held_against_the_sheet(
    factor: float, kind: str, words: str, sound: Recording
) -> None:
    (told,) = noise_warnings(changed(sound, kind, factor))
    assert f"imu.{kind}" in told and words.split()[-1] in told and "mine" in told and "at rest" in told


def test_noise_at_a_later_stop_counts() -> None:
    stops = ride(way_of_speed(np.clip(np.abs(TIME - 20.0) - 5.0, 0.0, None)))
    assert noise_warnings(stops) == ()
    (told,) = noise_warnings(changed(stops, "gyro", 15.0))
    assert "at rest" in told


def test_under_way_noise_that_does_not_grow_with_the_speed_is_the_devices() -> None:
    (told,) = noise_warnings(changed(NEVER_STANDS, "accel", 40.0))
    assert "imu.accel" in told and "alike from 5.4" in told
    # What rails shake grows with the speed, and a device may be as silent as it likes there.
    assert noise_warnings(changed(NEVER_STANDS, "accel", 100.0 * (4.0 + 0.3 * TIME) / 16.0)) == ()
    # At one speed nobody knows.
    steady = ride(way_of_speed(np.full(COUNT, 10.0)))
    assert noise_warnings(changed(steady, "accel", 40.0)) == ()


@pytest.mark.parametrize(("rate_hz", "seen"), [(1000.0, "50 Hz"), (80.0, "30 Hz")])
def test_a_tone_at_rest_is_told_with_its_frequency(rate_hz: float, seen: str) -> None:
    """Four times the noise: at 1 kHz second differences show 1/25 of a tone of 50 Hz."""
    still = ride(np.zeros(COUNT), rate_hz)
    tone = 4.0 * np.sqrt(2.0) * N * np.sin(2.0 * np.pi * 50.0 * still.imu.index.to_numpy())
    (told,) = noise_warnings(replace(still, imu=still.imu.assign(**{GYRO[0]: still.imu[GYRO[0]] + tone})))
    assert f"imu.gyro: hums at rest at {seen}" in told and "is 4" in told


def test_numbers_in_steps_beyond_the_noise_are_told() -> None:
    step = 6.0 * N
    rounded = STANDING.imu.assign(**{ACCEL[1]: np.rint(STANDING.imu[ACCEL[1]] * 10.0 / step) * step})
    (told,) = noise_warnings(replace(STANDING, imu=rounded))
    assert "imu.accel: stands in steps of 0.06 m/s2" in told and "more decimals" in told
    known = replace(STANDING, imu=rounded, imu_sheet=replace(STANDING.imu_sheet, accel_resolution_mps2=step))
    assert noise_warnings(known) == ()


def test_a_bandwidth_above_half_the_rate_folds() -> None:
    for bandwidth, count in ((50.0, 0), (51.0, 1)):
        sheet = replace(STANDING.imu_sheet, bandwidth_hz=bandwidth)
        told = noise_warnings(replace(STANDING, imu_sheet=sheet))
        assert len(told) == count and all("above half the rate" in line for line in told)
