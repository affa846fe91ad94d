"""An IMU: what it would have recorded of a motion, with the errors of its grade.

In order: response of the device, decimation to its rate, bias at switch-on, wandering bias, white
noise, range and resolution. Every random term of every sensor has its own named stream, so that a new
sensor, a new term or a longer ride changes no sample of another.

The motion (rates and specific force at the mount) comes from the truth; this module knows neither
vehicle nor track.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import signal

from simrail.columns import ATTITUDE, IMU, VELOCITY
from simrail.jit import FloatArray
from simrail.seeds import stream
from simrail.sensors.decimation import decimate, decimation_factor, second_order
from simrail.sensors.grades import ImuGrade, bias_sd

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


def sample_imu(
    motion: pd.DataFrame,
    grade: ImuGrade,
    *,
    seed: int,
    draw: int,
    name: str,
    errors: bool = True,
    earth: EarthRate | None = None,
) -> tuple[pd.DataFrame, float]:
    """Sample a motion with an IMU.

    Parameters
    ----------
    motion : pandas.DataFrame
        Indexed by ``time_s`` (uniform), with columns `simrail.columns.IMU` of a perfect sensor; with
        `earth` also attitude and velocity.
    grade : ImuGrade
        The device. Its rate must divide the rate of the motion.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.
    name : str
        Name of the sensor: with seed and draw it names the random streams.
    errors : bool
        False leaves out every error of the grade and keeps its rate and bandwidth.
    earth : EarthRate, optional
        Adds the rotation of the Earth (gyro) and the Coriolis acceleration (accelerometer).

    Returns
    -------
    imu : pandas.DataFrame
        Indexed by ``time_s``, a subset of the motion's own time stamps; columns `simrail.columns.IMU`.
    delay_s : float
        How much later than its time stamp a sample leaves the sensor's filter.

    Raises
    ------
    InputError
        If the rates do not divide, or the motion is shorter than the filter.
    """
    time = motion.index.to_numpy(dtype=np.float64)
    truth_rate = float(round((len(time) - 1) / (time[-1] - time[0]), 6))
    factor = decimation_factor(truth_rate, grade.rate_hz)
    perfect = motion[list(IMU)].to_numpy(dtype=np.float64)
    if earth is not None:
        perfect = perfect + _earth_terms(motion, earth)
    if grade.bandwidth_hz is not None:
        perfect = second_order(perfect, bandwidth_hz=grade.bandwidth_hz, rate_hz=truth_rate)
    samples, delay = decimate(perfect, factor)
    if errors:
        for kind, columns in (("gyro", slice(0, 3)), ("accel", slice(3, 6))):
            samples[:, columns] += _errors(grade, kind, len(samples), (seed, draw, name))
            samples[:, columns] = _digitise(grade, kind, samples[:, columns])
    stamps = pd.Index(time[delay : delay + factor * len(samples) : factor], name="time_s")
    return pd.DataFrame(samples, index=stamps, columns=list(IMU)), delay / truth_rate


def gauss_markov(
    generator: np.random.Generator, count: int, *, sd: float, correlation_s: float, rate_hz: float
) -> FloatArray:
    """Three independent stationary first-order Gauss-Markov sequences.

    b[k+1] = a b[k] + sqrt(1 - a^2) sd w[k], a = exp(-1/(T rate)), and b[0] of standard deviation sd:
    exact at any rate, stationary from the first sample.

    Returns
    -------
    ndarray (count, 3)
    """
    decay = float(np.exp(-1.0 / (correlation_s * rate_hz)))
    white = generator.standard_normal((count, 3))
    white[0] *= sd
    white[1:] *= sd * np.sqrt(1.0 - decay**2)
    sequence: FloatArray = signal.lfilter([1.0], [1.0, -decay], white, axis=0)
    return sequence


def _errors(grade: ImuGrade, kind: str, count: int, identity: tuple[int, int, str]) -> FloatArray:
    """Sum (count, 3) of the additive errors of one triad."""
    seed, draw, name = identity
    unit, root = ("radps", "radpsqrts") if kind == "gyro" else ("mps2", "mpsqrts")

    def term(stem: str) -> np.random.Generator:
        return stream(seed, "sensor", draw, "imu", name, f"{kind}_{stem}")

    bound = getattr(grade, f"{kind}_turn_on_bias_{unit}")
    total = np.tile(term("turn_on_bias").uniform(-1.0, 1.0, 3) * bound, (count, 1))
    wandering = bias_sd(getattr(grade, f"{kind}_bias_instability_{unit}"))
    if wandering > 0.0:
        total += gauss_markov(
            term("bias_instability"),
            count,
            sd=wandering,
            correlation_s=getattr(grade, f"{kind}_bias_correlation_s"),
            rate_hz=grade.rate_hz,
        )
    density = getattr(grade, f"{kind}_noise_{root}")
    if density > 0.0:
        # Row by row: a longer ride begins with the samples of the shorter one.
        total += term("white").standard_normal((count, 3)) * (density * np.sqrt(grade.rate_hz))
    return total


def _digitise(grade: ImuGrade, kind: str, samples: FloatArray) -> FloatArray:
    """Round to whole counts and clip at the last count within the range."""
    unit = "radps" if kind == "gyro" else "mps2"
    limit = getattr(grade, f"{kind}_range_{unit}")
    count = getattr(grade, f"{kind}_resolution_{unit}")
    if count == 0.0:
        return np.clip(samples, -limit, limit)
    last = np.floor(limit / count * (1.0 + 1e-12))
    return np.clip(np.rint(samples / count), -last, last) * count


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
