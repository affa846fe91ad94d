"""The slope of the speed for an acceleration: what is replaced, and by what."""

import numpy as np
import pandas as pd
from simrail.estimators.odometry.consistent import with_consistent_acceleration

from simrail.core.columns import ODOMETRY
from simrail.recording.recording import ImuSheet, Recording
from simrail.track.design import Straight, TrackDesign

RATE_HZ = 250.0
TIME = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
SWING = 2.0 * np.pi * 0.1
SPEED, SLOPE = 10.0 + 0.5 * np.sin(SWING * TIME) / SWING, 0.5 * np.cos(SWING * TIME)


def recorded(acceleration: np.ndarray) -> Recording:
    """A train whose speed swings once in ten seconds; of the recording only the odometry matters."""
    place = np.cumsum(SPEED) / RATE_HZ
    frame = pd.DataFrame(dict(zip(ODOMETRY, (place, SPEED, acceleration), strict=True)), index=TIME)
    sheet = ImuSheet("made up", RATE_HZ, 0.0, *[1e-3] * 6)
    track = TrackDesign("straight", 0.0, (Straight(1000.0),))
    recording = Recording(
        "made up", frame, sheet, "axle", "front", (0.0, 0.0, 0.0), track, None, None, start_position_m=0.0
    )
    return recording.with_odometry(frame, "made up")


def test_a_slope_is_left_as_it_is():
    """Also one that shakes above 1 Hz, which the speed does not tell."""
    recording = recorded(SLOPE + 0.2 * np.sin(2.0 * np.pi * 8.0 * TIME))
    assert with_consistent_acceleration(recording) is recording


def test_what_is_late_or_wrong_is_replaced():
    """A lag of 0.2 s and a swing of 0.5 Hz, 0.1 m/s2 each, leave what a filter of second order, there and
    back, leaves of 0.1 Hz: its fourth power."""
    wrong = 0.5 * np.cos(SWING * (TIME - 0.2)) + 0.1 * np.sin(2.0 * np.pi * 0.5 * TIME)
    recording = recorded(wrong)
    found = with_consistent_acceleration(recording).odometry
    inner = slice(750, -750)
    assert np.max(np.abs((wrong - SLOPE)[inner])) > 0.1
    assert np.max(np.abs(found["acceleration_mps2"].to_numpy()[inner] - SLOPE[inner])) < 0.5 * 0.1**4 + 1e-4
    np.testing.assert_array_equal(found["speed_mps"], recording.odometry["speed_mps"])
