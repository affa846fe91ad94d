"""A whole signal is held against its sheet: its range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, IMU
from simrail.core.errors import InputError
from simrail.recording.check_sheet import check_ranges
from simrail.recording.recording import ImuSheet, Recording
from simrail.track.design import Straight, TrackDesign

RATE = 100.0
G = 9.80665


def test_a_signal_beyond_its_range_throughout_is_the_sheet_of_another() -> None:
    time = pd.Index(np.arange(100) / RATE, name="time_s")
    imu = pd.DataFrame(0.0, index=time, columns=list(IMU)).assign(**{ACCEL[0]: np.linspace(0.0, 90.0, 100)})
    sheet = ImuSheet("mine", RATE, 0.0, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, accel_range_mps2=50.0)
    track = TrackDesign("line", 0.0, (Straight(100.0),))
    ride = Recording("ride", imu, sheet, "imu", "front", (0.0, 0.0, 0.6), track, None, None, 10.0)
    with pytest.raises(InputError, match=r"accel_x_mps2: is beyond the range.*found 90.0; limit: 50 m/s2"):
        check_ranges(ride)
    check_ranges(replace(ride, imu=imu * 0.9))
