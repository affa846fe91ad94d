"""A wheel encoder: signed pulses counted from the rotation of a wheel.

The counter reads floor(N theta / 2 pi + phase) minus its first value. The phase, where between two
edges the wheel happened to stand, is random. What the train believes of the wheel's radius is not
quite true; that belief is made here too, since it belongs to the device as much as its pulses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from simrail.errors import InputError
from simrail.jit import FloatArray
from simrail.seeds import stream
from simrail.sensors.decimation import decimation_factor


@dataclass(frozen=True)
class EncoderSpec:
    """A wheel encoder, and how well its wheel is known.

    Attributes
    ----------
    wheel : str
        Name of the wheel in the truth, or its place in the direction of travel: ``leading.left``,
        ``trailing.right`` and so on. The wheels of a leading axle run on their flange in curves, where
        they roll on a larger radius; those of the trailing one hardly do.
    pulses_per_revolution : int
        Pulses per turn, > 0.
    rate_hz : float
        Rate at which the logger reads the counter.
    radius : {"drawing", "calibrated"}
        What the nominal radius is near to: the wheel's own at the tape circle, or the mean radius on
        which it rolled over the line, as an operator calibrates it from the pulses between two stations.
    radius_error_sd : float
        Relative standard deviation of the nominal radius about that; one draw per sensor draw.
    radius_error : float, optional
        Fixed relative error (nominal / true - 1) instead of a draw.
    rolling_sd : float
        Relative standard deviation of the rolling radius about the wheel's own, as the train believes:
        a coned wheel that runs off the middle of the track, or on its flange, rolls on another radius.
        The contact makes this error; here it only widens the odometry's standard deviations. The
        default, 0.4 %, is the order of the taper's 0.3 to 1.5 mm on a wheel of 290 mm.
    """

    wheel: str
    pulses_per_revolution: int = 1024
    rate_hz: float = 250.0
    radius: Literal["drawing", "calibrated"] = "drawing"
    radius_error_sd: float = 0.0
    radius_error: float | None = None
    rolling_sd: float = 0.004


def sample_encoder(
    wheel_angle: FloatArray,
    time_s: FloatArray,
    *,
    pulses_per_revolution: int,
    rate_hz: float,
    seed: int,
    draw: int,
    name: str = "encoder",
) -> pd.DataFrame:
    """Count the pulses of a turning wheel.

    Parameters
    ----------
    wheel_angle : ndarray (n,)
        Rotation of the wheel against its axle box, rad, positive forward.
    time_s : ndarray (n,)
        Uniform times of the angles.
    pulses_per_revolution : int
        Pulses per turn N.
    rate_hz : float
        Rate of the readings; must divide the rate of the angles. A counter needs no filter.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.
    name : str
        Name of the encoder (its wheel), for the random stream of its phase.

    Returns
    -------
    pandas.DataFrame
        Indexed by ``time_s``, column ``pulse_count`` (int64), 0 at first.

    Raises
    ------
    InputError
        If the rates do not divide or there are no pulses.
    """
    if pulses_per_revolution < 1:
        raise InputError(
            "an encoder needs pulses",
            field="pulses_per_revolution",
            value=pulses_per_revolution,
            limit=">= 1",
        )
    truth_rate = float(round((len(time_s) - 1) / (time_s[-1] - time_s[0]), 6))
    factor = decimation_factor(truth_rate, rate_hz)
    phase = stream(seed, "sensor", draw, "encoder", name, "phase").uniform()
    turns = (wheel_angle[::factor] - wheel_angle[0]) / (2.0 * np.pi)
    count = np.floor(turns * pulses_per_revolution + phase).astype(np.int64)
    index = pd.Index(np.asarray(time_s, dtype=np.float64)[::factor], name="time_s")
    return pd.DataFrame({"pulse_count": count}, index=index)


def nominal_radius(near_m: float, spec: EncoderSpec, *, seed: int, draw: int) -> float:
    """Wheel radius that the train believes in: near_m times 1 + error, fixed or N(0, sd)."""
    error = spec.radius_error
    if error is None:
        error = spec.radius_error_sd * stream(seed, "sensor", draw, "encoder", spec.wheel, "radius").normal()
    return near_m * (1.0 + error)
