"""A ride of white noise, as a sheet has it, and a wheel that went as it is told."""

import numpy as np
import pandas as pd

from simrail.core.columns import IMU
from simrail.core.jit import FloatArray
from simrail.recording.recording import EncoderSheet, ImuSheet, Recording
from simrail.track.design import Straight, TrackDesign

RATE, COUNT = 100.0, 4000
TIME = np.arange(COUNT) / RATE
N = 0.01
"""Noise of a density of 0.1 N, so N a sample."""


def ride(way_m: FloatArray, rate_hz: float = RATE) -> Recording:
    """White noise as of the sheet, and a wheel that went so."""
    draw = np.random.default_rng(2)
    time = pd.Index(np.arange(len(way_m)) / rate_hz, name="time_s")
    imu = pd.DataFrame(N * draw.standard_normal((len(way_m), 6)), index=time, columns=list(IMU))
    density = N / np.sqrt(rate_hz)
    encoder_sheet = EncoderSheet("front.left", 1024, 0.29, rate_hz)
    pulses = np.rint(way_m / encoder_sheet.pulse_m).astype(np.int64)
    return Recording(
        name="ride",
        imu=imu,
        imu_sheet=ImuSheet("mine", rate_hz, 0.0, density, density, 0.0, 0.0, 0.0, 0.0),
        mount="imu",
        mount_body="front",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TrackDesign("line", 0.0, (Straight(1000.0),)),
        encoder=pd.DataFrame({"pulse_count": pulses}, index=time),
        encoder_sheet=encoder_sheet,
        start_position_m=10.0,
    )


def way_of_speed(speed_mps: FloatArray) -> FloatArray:
    return np.cumsum(speed_mps) / RATE
