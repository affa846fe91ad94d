"""Faults of factors, place, mounting and clocks, planted in a recording that has been read."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, GYRO
from simrail.core.rotation import rotation_matrix
from simrail.recording.recording import Recording


def gyro(recording: Recording, factor: float) -> Recording:
    """A gyro that reads `factor` times the rate."""
    imu = recording.imu.copy()
    imu[list(GYRO)] *= factor
    return replace(recording, imu=imu)


def wheel(recording: Recording, factor: float) -> Recording:
    """A train that goes `factor` times as far as its wheel says."""
    sheet = recording.encoder_sheet
    assert sheet is not None
    return replace(recording, encoder_sheet=replace(sheet, wheel_radius_m=sheet.wheel_radius_m / factor))


def shift(recording: Recording, metres: float) -> Recording:
    """A train that is `metres` ahead of where it is said to be."""
    return replace(recording, start_position_m=recording.start_position_m - metres)


def turned(axis: int) -> Callable[[Recording, float], Recording]:
    """A device whose mounting has so many degrees of roll (0), pitch (1) or yaw (2) that nobody told."""

    def plant(recording: Recording, degrees: float) -> Recording:
        angles = np.zeros((1, 3))
        angles[0, axis] = np.radians(degrees)
        turn, imu = rotation_matrix(angles)[0], recording.imu.copy()
        for names in (GYRO, ACCEL):
            imu[list(names)] = imu[list(names)].to_numpy() @ turn
        return replace(recording, imu=imu)

    return plant


def clock(recording: Recording, seconds: float) -> Recording:
    """Stamps of the encoder to which `seconds` have to be added."""
    return _stamped(recording, lambda time: time - seconds)


def drift(recording: Recording, ppm: float) -> Recording:
    """A clock of the encoder that is slow by so many millionths."""
    return _stamped(recording, lambda time: time * (1.0 - 1e-6 * ppm))


def late(columns: Sequence[str]) -> Callable[[Recording, float], Recording]:
    """Samples of some columns of the IMU to whose stamps `seconds` have to be added."""

    def plant(recording: Recording, seconds: float) -> Recording:
        time, imu = recording.imu.index.to_numpy(), recording.imu.copy()
        for name in columns:
            imu[name] = np.interp(time + seconds, time, imu[name])
        return replace(recording, imu=imu)

    return plant


def _stamped(recording: Recording, stamp: Callable[[np.ndarray], np.ndarray]) -> Recording:
    assert recording.encoder is not None
    counts = recording.encoder.copy()
    counts.index = pd.Index(stamp(counts.index.to_numpy()), name="time_s")
    return replace(recording, encoder=counts)


PLANTS: dict[str, Callable[[Recording, float], Recording]] = {
    "gyro": gyro,
    "wheel": wheel,
    "shift": shift,
    "yaw": turned(2),
    "pitch": turned(1),
    "roll": turned(0),
    "offset": clock,
    "drift": drift,
    "gyro_offset": late(GYRO),
    "accel_offset": late(ACCEL),
}
"""How each parameter of `simrail.recording.evidence.model` is made wrong, and the clock of the accelerometer;
the size is what is to be found."""
