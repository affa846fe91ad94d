"""An IMU: what it would have recorded of a motion, with the errors of its grade.

The chain, in the order of a device: response of second order; sampling, at the stamps or at the times of
a wrong clock (`simrail.sensors.decimation`, `simrail.sensors.clock`); scale, axes, g-sensitivity,
vibration and temperature (`simrail.sensors.imu_response`); bias and noise (`simrail.sensors.imu_noise`);
range and resolution. Every random term of every sensor has its own named stream, so that a new sensor, a
new term or a longer ride changes no sample of another.

A device that sends increments is recorded as rates again: the increment over an interval, divided by it.
The angle increment is the plain sum of the internal samples times their interval, without a correction for
coning (nor the velocity increment one for sculling), so it differs from rates only in how it is counted.

The motion (rates and specific force at the mount) comes from the truth; nothing else of vehicle or track is
known here.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.columns import ATTITUDE, IMU, VELOCITY
from simrail.core.jit import FloatArray
from simrail.core.resample import resample
from simrail.core.seeds import stream
from simrail.recording.sheets.grades import ImuGrade
from simrail.ride.truth import Mount, Truth
from simrail.sensors.clock import lost_samples, sample_by_clock
from simrail.sensors.decimation import sample_on_time, sampling_of, second_order
from simrail.sensors.imu_noise import Streams, add_noise
from simrail.sensors.imu_response import (
    Temperature,
    TriadResponse,
    digitise,
    draw_response,
    mean_square_vibration,
    respond,
)

EARTH_RATE_RADPS = 7.292115e-5
"""Sidereal rotation of the Earth (WGS 84)."""


@dataclass(frozen=True)
class EarthRate:
    """Rotation of the Earth as a local, level site feels it.

    Attributes
    ----------
    latitude_rad : float
        Latitude, positive north.
    x_axis_rad : float
        Direction of the global X axis, counter-clockwise from east (seen from above).
    """

    latitude_rad: float
    x_axis_rad: float = 0.0


def streams_of(seed: int, draw: int, name: str) -> Streams:
    """Random streams of one device, by the name of the term."""
    return lambda term: stream(seed, "sensor", draw, "imu", name, term)


class Device(NamedTuple):
    """The coefficients of one device: what its sheet bounds, as this one has it."""

    gyro: TriadResponse
    accel: TriadResponse


def device_of(grade: ImuGrade, *, seed: int, draw: int, name: str) -> Device:
    """Return the device that `sample_imu` samples with.

    Parameters
    ----------
    grade, seed, draw, name
        As of `sample_imu`; `simrail.sensors.measure.measure` names an IMU after its mount.
    """
    streams = streams_of(seed, draw, name)
    return Device(*(draw_response(grade, kind, streams) for kind in ("gyro", "accel")))


def sample_imu(
    motion: pd.DataFrame,
    grade: ImuGrade,
    *,
    seed: int,
    draw: int,
    name: str,
    errors: bool = True,
    earth: EarthRate | None = None,
    temperature: Temperature | None = None,
) -> tuple[pd.DataFrame, float]:
    """Sample a motion with an IMU; those that get lost on the way are left to `arrived`.

    Parameters
    ----------
    motion : pandas.DataFrame
        Indexed by ``time_s`` (uniform), with columns `simrail.core.columns.IMU` of a perfect sensor; with
        `earth` also attitude and velocity.
    grade : ImuGrade
        The device. Its rate, times its oversampling, is at most the rate of the motion.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.
    name : str
        Name of the sensor: with seed and draw it names the random streams.
    errors : bool
        False leaves out every error of the grade and keeps its rate, bandwidth and oversampling.
    earth : EarthRate, optional
        Adds the rotation of the Earth (gyro) and the Coriolis acceleration (accelerometer).
    temperature : Temperature, optional
        Temperature over the ride; None for that of the calibration.

    Returns
    -------
    imu : pandas.DataFrame
        Indexed by ``time_s``, whole intervals of the device from the motion's first stamp on: a subset of the
        motion's own time stamps where its rate divides that of the motion; columns
        `simrail.core.columns.IMU`.
    delay_s : float
        How much later than its time stamp a sample leaves the sensor's filter.

    Raises
    ------
    InputError
        If its rate is above the motion's, the bandwidth is not below half the rate of the motion, or the
        motion is shorter than the filter.
    """
    time = motion.index.to_numpy(dtype=np.float64)
    truth_rate = float(round((len(time) - 1) / (time[-1] - time[0]), 6))
    sampling = sampling_of(truth_rate, grade.rate_hz, grade.oversampling)
    streams = streams_of(seed, draw, name)
    gyro, accel = device_of(grade, seed=seed, draw=draw, name=name)
    rectifies = errors and bool(np.any(gyro.rectification) or np.any(accel.rectification))
    of_imu = motion if tuple(motion.columns) == IMU else motion[list(IMU)]
    felt = of_imu.to_numpy(dtype=np.float64)
    if earth is not None:
        felt = felt + _earth_terms(motion, earth)
    del motion, of_imu
    shaken = np.ascontiguousarray(felt[:, 3:]) if rectifies else None
    felt = _responded(felt, grade, truth_rate)
    wrong_clock = errors and (grade.clock_jitter_s > 0.0 or grade.clock_drift > 0.0)
    if wrong_clock or not sampling.whole:
        samples, number, places = sample_by_clock(
            felt, sampling, grade, truth_rate_hz=truth_rate, streams=streams, errors=wrong_clock
        )
        first = number * sampling.whole
    else:
        samples, first = sample_on_time(felt, sampling)
        number = first // sampling.whole
        places = first + sampling.factor * np.arange(len(samples), dtype=np.float64)
    if sampling.whole:
        stamps = time[first : first + sampling.whole * len(samples) : sampling.whole]
    else:
        stamps = time[0] + np.arange(number, number + len(samples)) / grade.rate_hz
    if errors:
        vibration = None
        if shaken is not None:
            vibration = mean_square_vibration(shaken, truth_rate, grade.vibration_averaging_s, places)
        above_k = None if temperature is None else temperature.above_reference_k(stamps)
        respond(samples, gyro, accel, vibration=vibration, above_k=above_k)
        for kind, columns in (("gyro", slice(0, 3)), ("accel", slice(3, 6))):
            add_noise(samples[:, columns], grade, kind, streams)
            samples[:, columns] = digitise(
                samples[:, columns], grade.triad(kind), increments=grade.output == "increments"
            )
    index = pd.Index(stamps, name="time_s")
    return pd.DataFrame(samples, index=index, columns=list(IMU)), sampling.delay / truth_rate


def _responded(felt: FloatArray, grade: ImuGrade, rate_hz: float) -> FloatArray:
    """What the response of the device makes of rates and forces (n, 6), each triad with its own bandwidth."""
    gyro, accel = grade.bandwidth_of("gyro"), grade.bandwidth_of("accel")
    if gyro == accel:
        return felt if gyro is None else second_order(felt, bandwidth_hz=gyro, rate_hz=rate_hz)
    triads = [
        part if band is None else second_order(part, bandwidth_hz=band, rate_hz=rate_hz)
        for part, band in ((felt[:, :3], gyro), (felt[:, 3:], accel))
    ]
    return np.hstack(triads)


def arrived(imu: pd.DataFrame, grade: ImuGrade, *, seed: int, draw: int, name: str) -> pd.DataFrame:
    """The samples of `sample_imu` that reach the logger; the first and the last two always do."""
    lost = lost_samples(grade, len(imu), streams_of(seed, draw, name))
    return imu[~lost] if lost.any() else imu


def log_imu(
    truth: Truth,
    mount: Mount,
    grade: ImuGrade,
    *,
    seed: int,
    draw: int,
    earth: EarthRate | None = None,
    temperature: Temperature | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame | None, float]:
    """Sample a mount of a ride, and fill what gets lost on the way.

    Parameters
    ----------
    truth : Truth
        The ride.
    mount : Mount
        Where the IMU sits; its name names the random streams.
    grade, seed, draw, earth, temperature
        As of `sample_imu`.

    Returns
    -------
    imu : pandas.DataFrame
        Samples at all its stamps.
    gaps : pandas.DataFrame or None
        Those that were filled; None where nothing can get lost.
    delay_s : float
        As of `sample_imu`.
    """
    # Held by nobody else: of a long ride it is the largest array there is.
    imu, delay_s = sample_imu(
        truth.motion(mount, columns=IMU if earth is None else (*IMU, *ATTITUDE, *VELOCITY)),
        grade,
        seed=seed,
        draw=draw,
        name=mount.name,
        earth=earth,
        temperature=temperature,
    )
    if grade.dropped_fraction == 0.0:
        return imu, None, delay_s
    came = arrived(imu, grade, seed=seed, draw=draw, name=mount.name)
    filled, gaps = resample(came, imu.index.to_numpy(), longest_gap_s=math.inf)
    return filled, gaps, delay_s


def _earth_terms(motion: pd.DataFrame, earth: EarthRate) -> FloatArray:
    """What the Earth's rotation adds (n, 6): C^T w_e to the rates, 2 C^T (w_e x v) to the force."""
    north, up = np.cos(earth.latitude_rad), np.sin(earth.latitude_rad)
    x_axis = earth.x_axis_rad
    rate = EARTH_RATE_RADPS * np.array([north * np.sin(x_axis), north * np.cos(x_axis), up])
    coriolis = 2.0 * np.cross(rate, motion[list(VELOCITY)].to_numpy())
    roll, pitch, yaw = motion[list(ATTITUDE)].to_numpy().T

    def to_body(vector: FloatArray) -> FloatArray:
        x, y, z = np.broadcast_to(vector, (len(motion), 3)).T
        x, y = np.cos(yaw) * x + np.sin(yaw) * y, -np.sin(yaw) * x + np.cos(yaw) * y
        x, z = np.cos(pitch) * x - np.sin(pitch) * z, np.sin(pitch) * x + np.cos(pitch) * z
        y, z = np.cos(roll) * y + np.sin(roll) * z, -np.sin(roll) * y + np.cos(roll) * z
        return np.column_stack([x, y, z])

    return np.hstack([to_body(rate), to_body(coriolis)])
