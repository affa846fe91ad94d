"""A satellite receiver: place along the line and speed, late, noisy, and nothing where the sky is hidden.

What a receiver gives in plan coordinates is here already brought to the line: the place s that the map has
nearest to the fix, and the speed along it, which is what an estimator on a track can use. Its errors are
synthetic: white noise, and a part of the place's error that wanders (orbits, atmosphere, reflections) as a
Gauss-Markov process. No error depends on where satellites stand.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from simrail.core.columns import GNSS
from simrail.core.errors import InputError, refuse_unless
from simrail.core.jit import FloatArray
from simrail.core.resample import interpolated
from simrail.core.seeds import stream
from simrail.recording.recording import GnssSheet


@dataclass(frozen=True)
class Outage:
    """A stretch of the line where nothing is received, e.g. a tunnel: from one s to a larger one, m."""

    from_m: float
    to_m: float


@dataclass(frozen=True)
class GnssSpec:
    """A receiver; all its figures are synthetic.

    Attributes
    ----------
    rate_hz : float
        Of its samples.
    position_sd_m, correlation_s : float
        The part of the place's error that wanders: standard deviation, and time.
    position_noise_m : float
        The white part.
    speed_sd_mps : float
        White noise of the speed.
    latency_s : float
        How much later than what it speaks of a sample comes: its stamp.
    ahead_m : float
        How far the antenna is ahead of the IMU along the train.
    outages : tuple of Outage
        Where nothing is received by the antenna.
    reacquire_s : float
        And for how long after that.
    """

    rate_hz: float = 1.0
    position_sd_m: float = 1.5
    correlation_s: float = 60.0
    position_noise_m: float = 0.3
    speed_sd_mps: float = 0.05
    latency_s: float = 0.1
    ahead_m: float = 0.0
    outages: tuple[Outage, ...] = ()
    reacquire_s: float = 3.0

    @property
    def sheet(self) -> GnssSheet:
        """What the train knows of it."""
        return GnssSheet(
            rate_hz=self.rate_hz,
            position_sd_m=self.position_sd_m,
            correlation_s=self.correlation_s,
            position_noise_m=self.position_noise_m,
            speed_sd_mps=self.speed_sd_mps,
            latency_s=self.latency_s,
            ahead_m=self.ahead_m,
        )


def sample_gnss(motion: pd.DataFrame, spec: GnssSpec, *, seed: int, draw: int) -> pd.DataFrame:
    """What the receiver gives over a ride.

    Parameters
    ----------
    motion : pandas.DataFrame
        True motion of the IMU's mount, columns ``position_m`` and ``speed_mps``, indexed by ``time_s``.
    spec : GnssSpec
        The receiver.
    seed, draw : int
        Seed of the scenario and number of the sensor draw.

    Returns
    -------
    pandas.DataFrame
        Indexed by ``time_s``, at which a sample came; columns `simrail.core.columns.GNSS`, NaN where nothing
        was received.

    Raises
    ------
    InputError
        If a value of the specification is impossible.
    """
    check_gnss(spec)
    first, last = float(motion.index[0]), float(motion.index[-1])
    count = int(np.floor((last - first) * spec.rate_hz + 1e-9)) + 1
    epochs = first + np.arange(count) / spec.rate_hz
    place, speed = interpolated(motion, epochs, "position_m", "speed_mps").T
    place = place + spec.ahead_m
    term = partial(stream, seed, "sensor", draw, "gnss")
    error = _wandering(term("wander").standard_normal(count), spec)
    error += spec.position_noise_m * term("white").standard_normal(count)
    noise = spec.speed_sd_mps * term("speed").standard_normal(count)
    values = np.column_stack([place + error, speed + noise])
    hidden = np.zeros(count, dtype=np.bool_)
    for outage in spec.outages:
        hidden |= (place >= outage.from_m) & (place <= outage.to_m)
    after = np.convolve(hidden, np.ones(int(spec.reacquire_s * spec.rate_hz + 1e-9) + 1))[:count] > 0.0
    values[after] = np.nan
    came = epochs + spec.latency_s
    seen = came <= last
    return pd.DataFrame(values[seen], index=pd.Index(came[seen], name="time_s"), columns=list(GNSS))


def _wandering(white: FloatArray, spec: GnssSpec) -> FloatArray:
    """A stationary Gauss-Markov process (n,) made of white noise."""
    keeps = float(np.exp(-1.0 / (spec.rate_hz * spec.correlation_s)))
    out = np.empty(len(white))
    value = white[0] if len(white) else 0.0
    for i, step in enumerate(white):
        value = step if i == 0 else keeps * value + np.sqrt(1.0 - keeps * keeps) * step
        out[i] = value
    return spec.position_sd_m * out


def check_gnss(spec: GnssSpec) -> None:
    """Refuse a receiver that cannot be.

    Raises
    ------
    InputError
        Naming the field.
    """
    refuse_unless(0.0 < spec.rate_hz <= 100.0, "rate_hz", spec.rate_hz, "> 0, <= 100 Hz")
    refuse_unless(spec.position_sd_m >= 0.0, "position_sd_m", spec.position_sd_m, ">= 0 m")
    refuse_unless(spec.correlation_s > 0.0, "correlation_s", spec.correlation_s, "> 0 s")
    refuse_unless(spec.position_noise_m > 0.0, "position_noise_m", spec.position_noise_m, "> 0 m")
    refuse_unless(spec.speed_sd_mps > 0.0, "speed_sd_mps", spec.speed_sd_mps, "> 0 m/s")
    refuse_unless(0.0 <= spec.latency_s <= 10.0, "latency_s", spec.latency_s, "0 to 10 s")
    refuse_unless(0.0 <= spec.reacquire_s <= 600.0, "reacquire_s", spec.reacquire_s, "0 to 600 s")
    for i, outage in enumerate(spec.outages):
        if not outage.from_m < outage.to_m:
            raise InputError(
                "the stretch has no length",
                field=f"outage[{i}].to_m",
                value=outage.to_m,
                limit=f"> from_m = {outage.from_m:g} m",
                remedy="from_m is the smaller s, whichever way the train goes",
            )
