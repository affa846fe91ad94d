"""Faults of factors, place, mounting and clocks, planted in a recording that has been read."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from simrail.core.columns import ACCEL, GYRO
from simrail.core.rotation import rotation_matrix
from simrail.recording.evidence.model import retimed
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


def apart(axis: int) -> Callable[[Recording, float], Recording]:
    """A gyro that is turned so many degrees about X (0), Y (1) or Z (2) against its accelerometer."""

    def plant(recording: Recording, degrees: float) -> Recording:
        whole, imu = turned(axis)(recording, degrees), recording.imu.copy()
        imu[list(GYRO)] = whole.imu[list(GYRO)]
        return replace(recording, imu=imu)

    return plant


def midway(plant: Callable[[Recording, float], Recording], share: float = 0.5) -> Callable[..., Recording]:
    """A fault of the IMU from a share of the ride on."""

    def later(recording: Recording, size: float) -> Recording:
        imu, first = recording.imu.copy(), round(share * len(recording.imu))
        imu.iloc[first:] = plant(recording, size).imu.iloc[first:]
        return replace(recording, imu=imu)

    return later


def offset(column: str) -> Callable[[Recording, float], Recording]:
    """One axis of an IMU that reads so much more than it should, SI."""

    def plant(recording: Recording, more: float) -> Recording:
        return replace(recording, imu=recording.imu.assign(**{column: recording.imu[column] + more}))

    return plant


def missing(recording: Recording, seconds: float, share: float = 0.5) -> Recording:
    """So many seconds of the IMU's samples that were lost, while stamps go on: counted samples hide a gap."""
    first, count = round(share * len(recording.imu)), round(seconds * recording.imu_sheet.rate_hz)
    values, imu = recording.imu.to_numpy(), recording.imu.iloc[: len(recording.imu) - count].copy()
    imu.iloc[first:] = values[first + count :]
    return replace(recording, imu=imu)


def counted_otherwise(recording: Recording, factor: float, share: float = 0.5) -> Recording:
    """A counter that counts so many times as much from a share of the ride on."""
    assert recording.encoder is not None
    counts = recording.encoder["pulse_count"].to_numpy().astype(np.float64, copy=True)
    first = round(share * len(counts))
    counts[first:] = counts[first] + factor * (counts[first:] - counts[first])
    return replace(recording, encoder=recording.encoder.assign(pulse_count=np.rint(counts).astype(np.int64)))


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


def axis(column: str) -> Callable[[Recording, float], Recording]:
    """One axis of an IMU that reads so many times what it should."""

    def plant(recording: Recording, factor: float) -> Recording:
        return replace(recording, imu=recording.imu.assign(**{column: factor * recording.imu[column]}))

    return plant


def exchanged(recording: Recording, first: str, second: str) -> Recording:
    """An IMU of which two columns stand in each other's place."""
    imu = recording.imu
    return replace(recording, imu=imu.assign(**{first: imu[second], second: imu[first]}))


def slow(columns: Sequence[str]) -> Callable[[Recording, float], Recording]:
    """A sensor behind a low-pass of the first order, of a time constant in seconds."""

    def plant(recording: Recording, seconds: float) -> Recording:
        decay = float(np.exp(-1.0 / (seconds * recording.imu_sheet.rate_hz)))
        imu = recording.imu.copy()
        for name in columns:
            values = imu[name].to_numpy()
            imu[name] = lfilter([1.0 - decay], [1.0, -decay], values, zi=[decay * values[0]])[0]
        return replace(recording, imu=imu)

    return plant


def pace(recording: Recording, factor: float) -> Recording:
    """Stamps of all devices that run so many times as fast as the ride."""
    return retimed(recording, 1.0 / factor)


def slipping(recording: Recording, speed_mps: float) -> Recording:
    """A wheel that spins up between 10 and 14 s, by so much, and comes back."""
    assert recording.encoder is not None and recording.encoder_sheet is not None
    counts = recording.encoder.copy()
    time = counts.index.to_numpy()
    excess = np.interp(time, [10.0, 10.6, 13.4, 14.0], [0.0, speed_mps, speed_mps, 0.0])
    lost_m = np.cumsum(excess) * float(time[1] - time[0])
    counts["pulse_count"] += np.rint(lost_m / recording.encoder_sheet.pulse_m).astype(np.int64)
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
