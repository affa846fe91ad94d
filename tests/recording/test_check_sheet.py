"""A whole signal is held against its sheet: range, and noise at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ACCEL, GYRO, IMU
from simrail.core.errors import InputError
from simrail.recording.check_sheet import check_ranges, noise_warnings
from simrail.recording.recording import EncoderSheet, ImuSheet, Recording
from simrail.track.design import Straight, TrackDesign

RATE = 100.0
G = 9.80665


def test_noise_at_rest_is_held_against_the_sheet() -> None:
    draw = np.random.default_rng(2)
    time = pd.Index(np.arange(1000) / RATE, name="time_s")
    imu = pd.DataFrame(draw.standard_normal((1000, 6)), index=time, columns=list(IMU))
    sheet = ImuSheet("mine", RATE, 0.0, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0)
    encoder = pd.DataFrame({"pulse_count": np.zeros(1000, dtype=np.int64)}, index=time)
    ride = Recording(
        name="rest",
        imu=imu,
        imu_sheet=sheet,
        mount="imu",
        mount_body="front",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TrackDesign("line", 0.0, (Straight(100.0),)),
        encoder=encoder,
        encoder_sheet=EncoderSheet("front.left", 1024, 0.29, RATE),
        start_position_m=10.0,
    )
    assert noise_warnings(ride) == ()
    for factor, kind, words in ((20.0, "gyro", "20 times"), (0.02, "accel", "smoothed")):
        columns = list(GYRO if kind == "gyro" else ACCEL)
        (told,) = noise_warnings(replace(ride, imu=imu.assign(**{c: imu[c] * factor for c in columns})))
        assert f"imu.{kind}" in told and words in told and "mine" in told


def test_a_signal_beyond_its_range_throughout_is_the_sheet_of_another() -> None:
    time = pd.Index(np.arange(100) / RATE, name="time_s")
    imu = pd.DataFrame(0.0, index=time, columns=list(IMU)).assign(**{ACCEL[0]: np.linspace(0.0, 90.0, 100)})
    sheet = ImuSheet("mine", RATE, 0.0, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, accel_range_mps2=50.0)
    track = TrackDesign("line", 0.0, (Straight(100.0),))
    ride = Recording("ride", imu, sheet, "imu", "front", (0.0, 0.0, 0.6), track, None, None, 10.0)
    with pytest.raises(InputError, match=r"accel_x_mps2: is beyond the range.*found 90.0; limit: 50 m/s2"):
        check_ranges(ride)
    check_ranges(replace(ride, imu=imu * 0.9))
