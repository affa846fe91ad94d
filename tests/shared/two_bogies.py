"""A ride on two bogies, 15 m apart, that feel the same rails one after the other."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL
from simrail.core.seeds import stream
from simrail.recording.recording import Recording, SecondImuSheet
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount, Truth
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import Run, SpeedProfile

SPACING_M = 15.0

FRAME_LAG_S = 0.012
"""By so much the frames follow what their wheels run over."""

THERE_AND_BACK = SpeedProfile(
    30.0,
    900.0,
    16.0,
    acceleration_mps2=0.9,
    jerk_mps3=0.6,
    rest_s=15.0,
    final_rest_s=8.0,
    stops=((450.0, 20.0),),
    runs=(Run(30.0, 20.0),),
)
"""Two sections there and two back, backwards: four minutes."""


@lru_cache
def ridden(profile: SpeedProfile = THERE_AND_BACK) -> Truth:
    return kinematic_truth(track_by_name("condequinto_olivar"), profile, height_m=0.9)


def shaken(place: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """What rails do at places of s, the same whenever a wheel is there: .3 m/s2 at 15 m/s."""
    step = 0.05
    rails = stream(5, "rails").standard_normal(round(1200.0 / step))
    rails = np.convolve(rails, np.hanning(9) / np.sqrt((np.hanning(9) ** 2).sum()), mode="same")
    return np.asarray(0.02 * np.abs(speed) * np.interp(place + 50.0, step * np.arange(len(rails)), rails))


def recorded(
    offset_s: float = 0.0,
    *,
    told_m: float = SPACING_M,
    draw: int = 0,
    profile: SpeedProfile = THERE_AND_BACK,
) -> Recording:
    """Two IMUs 15 m apart; the second one's clock is ahead."""
    truth, mount = ridden(profile), Mount("front", "body", (0.0, 0.0, 1.1))
    one = measure(truth, name="ride", mount=mount, grade=load_grade("lord_3dm_gx4_25"), seed=11, draw=draw)
    motion = truth.motion(mount).loc[one.imu.index]
    times = motion.index.to_numpy()
    place, speed = (
        np.interp(times - FRAME_LAG_S, times, motion[name]) for name in ("position_m", "speed_mps")
    )
    noise = stream(11, "second", draw).standard_normal((2, len(place)))
    first, second = one.imu.copy(), one.imu.copy()
    first[ACCEL[2]] += shaken(place, speed) + 0.02 * noise[0] * (speed != 0.0)
    second[ACCEL[2]] += shaken(place - SPACING_M, speed) + 0.02 * noise[1] * (speed != 0.0)
    second.index = pd.Index(second.index.to_numpy() + offset_s, name="time_s")
    sheet = SecondImuSheet("second", "rear", (0.0, 0.0, 0.6), told_m, one.imu_sheet)
    return replace(one, imu=first, second_imu=second, second_imu_sheet=sheet)
