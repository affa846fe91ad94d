"""A wheel encoder: signed counts of the edges that pass as a wheel turns.

The disc has an edge wherever its wheel has turned by one more count. Edges do not sit exactly where they
should: the disc has a pattern of its own that comes back every turn, and each passage jitters. The
counter says how many edges lie between where the wheel stands and where it first stood; that is a function
of the angle alone, so a wheel that turns back is counted back, but for pulses that were missed.

The rolling radius is none of its business: a coned wheel off the middle of the track, or on its flange, or
creeping under traction, turns as the contact makes it turn, and that angle comes in. `Slip` adds what the
simulated contact did not do. What the train believes of the wheel's radius is not quite true; that belief
is made here too, since it belongs to the device as much as its pulses.

Not here: what an odometry makes of the counts (`simrail.estimators.odometry.encoder`).
"""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.sensors.decimation import decimation_factor
from simrail.sensors.imu_noise import Streams

IntArray = npt.NDArray[np.int64]

_REACH_SD = 9.0
"""No edge is out of place by more than this many standard deviations (one in 1e18 would be)."""


@dataclass(frozen=True)
class Slip:
    """A time in which the wheel turns faster or slower than it rolls, as in low adhesion.

    Attributes
    ----------
    start_s : float
        When it begins.
    duration_s : float
        How long it lasts, ramps included.
    creepage : float
        (wheel's speed - train's speed) / train's speed: positive for a spinning wheel, negative for a
        sliding one, -1 for a locked one. It multiplies the rolling speed: at rest it does nothing.
    ramp_s : float
        Length of the smooth (raised cosine) rise and of the fall.
    """

    start_s: float
    duration_s: float
    creepage: float
    ramp_s: float = 0.25


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
    quadrature : bool
        Two channels a quarter pulse apart, decoded fully: four counts per pulse, and the order of the
        edges tells the direction. Without it one edge of each pulse counts, and the sign of the count is
        the direction that the train knows by other means.
    edge_pattern_sd : float
        Standard deviation of the disc's own edges from where they should be, as a fraction of a pulse;
        the same error every turn. Synthetic unless a disc was measured.
    edge_jitter_sd : float
        Standard deviation of what each edge of each turn is off beyond that, as a fraction of a pulse.
    missed_rate : float
        Probability that a pulse goes uncounted (in quadrature all four edges of it). It is never made up.
    slip : tuple of Slip
        Slides and spins that are injected on top of the creep that the contact made.
    edge_times : bool
        Record the time of the last edge as well, from a timer of the logger.
    timer_hz : float
        Frequency of that timer.
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
    phase : float, optional
        How far the wheel first stands past an edge, as a fraction of a count, instead of a draw.
    """

    wheel: str
    pulses_per_revolution: int = 1024
    rate_hz: float = 250.0
    quadrature: bool = False
    edge_pattern_sd: float = 0.0
    edge_jitter_sd: float = 0.0
    missed_rate: float = 0.0
    slip: tuple[Slip, ...] = ()
    edge_times: bool = False
    timer_hz: float = 1e6
    radius: Literal["drawing", "calibrated"] = "drawing"
    radius_error_sd: float = 0.0
    radius_error: float | None = None
    rolling_sd: float = 0.004
    phase: float | None = None

    @property
    def counts_per_pulse(self) -> int:
        """4 in quadrature, otherwise 1."""
        return 4 if self.quadrature else 1

    @property
    def counts_per_revolution(self) -> int:
        """Counts per turn of the wheel."""
        return self.counts_per_pulse * self.pulses_per_revolution


def sample_encoder(
    wheel_angle: FloatArray, time_s: FloatArray, spec: EncoderSpec, *, seed: int, draw: int
) -> pd.DataFrame:
    """Count the edges of a turning wheel.

    Parameters
    ----------
    wheel_angle : ndarray (n,)
        Rotation of the wheel against its axle box, rad, positive forward.
    time_s : ndarray (n,)
        Uniform times of the angles.
    spec : EncoderSpec
        The encoder. Its rate must divide the rate of the angles; a counter needs no filter.
    seed, draw : int
        Seed of the scenario and number of the sensor draw; with the name of the wheel they name the
        random streams, one for each term.

    Returns
    -------
    pandas.DataFrame
        Indexed by ``time_s``, column ``pulse_count`` (int64), 0 at first; with ``edge_times`` also
        ``edge_time_s``, whole ticks of the timer, and the first time stamp until an edge has passed.

    Raises
    ------
    InputError
        If the rates do not divide, or a value of the specification is impossible.

    Notes
    -----
    An edge on which the wheel stands counts as passed. The angle in counts has a rounding error of a few
    units in the last place; an angle that close to an edge is taken to be on it, so that a wheel which
    turns by whole counts is counted exactly. With several edges between two of the given times, the time
    of the last one is recorded even where that one belonged to a missed pulse.
    """
    check_encoder(spec)
    time = np.asarray(time_s, dtype=np.float64)
    truth_rate = float(round((len(time) - 1) / (time[-1] - time[0]), 6))
    factor = decimation_factor(truth_rate, spec.rate_hz)
    streams = _streams(spec, seed=seed, draw=draw)
    angle = np.asarray(wheel_angle, dtype=np.float64)
    if spec.slip:
        angle = angle + slipped_angle(angle, time, spec.slip)
    scale = spec.counts_per_revolution
    phase = streams("phase").uniform() if spec.phase is None else spec.phase
    turned = (angle - angle[0]) / (2.0 * np.pi) * scale + phase
    nearest = np.rint(turned)
    rounding = 4.0 * np.finfo(np.float64).eps * (np.abs(turned) + np.abs(angle) * scale + 1.0)
    turned = np.where(np.abs(turned - nearest) <= rounding, nearest, turned)
    edges = _displaced_edges(turned, spec, streams)
    if edges is None:
        passed = np.floor(turned).astype(np.int64)
    else:
        first, places = edges
        passed = first - 1 + np.searchsorted(places, turned, side="right").astype(np.int64)
    change = np.diff(passed, prepend=passed[0])
    seen = change - _missed(change, spec, streams)
    columns = {"pulse_count": np.cumsum(seen)[::factor]}
    if spec.edge_times:
        # Forward, the last edge passed is the highest one at or below the wheel; backward, the lowest above.
        last = passed + (change < 0)
        place = last.astype(np.float64) if edges is None else edges[1][np.clip(last - edges[0], 0, None)]
        columns["edge_time_s"] = _edge_times(turned, time, place, seen != 0, spec.timer_hz)[::factor]
    return pd.DataFrame(columns, index=pd.Index(time[::factor], name="time_s"))


def slipped_angle(angle: FloatArray, time_s: FloatArray, slip: tuple[Slip, ...]) -> FloatArray:
    """By how much (n,) slip has turned the wheel beyond its rolling, rad: the integral of creepage dtheta."""
    creepage = np.zeros_like(angle)
    for event in slip:
        ramp = event.ramp_s
        inside = np.minimum(time_s - event.start_s, event.start_s + event.duration_s - time_s)
        if ramp > 0.0:
            creepage += event.creepage * 0.5 * (1.0 - np.cos(np.pi * np.clip(inside / ramp, 0.0, 1.0)))
        else:
            creepage += event.creepage * (inside >= 0.0)
    steps = 0.5 * (creepage[1:] + creepage[:-1]) * np.diff(angle)
    return np.concatenate([[0.0], np.cumsum(steps)])


def nominal_radius(near_m: float, spec: EncoderSpec, *, seed: int, draw: int) -> float:
    """Wheel radius that the train believes in: near_m times 1 + error, fixed or N(0, sd)."""
    error = spec.radius_error
    if error is None:
        error = spec.radius_error_sd * _streams(spec, seed=seed, draw=draw)("radius").normal()
    return near_m * (1.0 + error)


def check_encoder(spec: EncoderSpec) -> None:
    """Refuse an encoder that cannot be.

    Raises
    ------
    InputError
        Naming the field.
    """

    def refuse(problem: str, field: str, value: object, limit: str) -> None:
        raise InputError(problem, field=field, value=value, limit=limit)

    if spec.pulses_per_revolution < 1:
        refuse("an encoder needs pulses", "pulses_per_revolution", spec.pulses_per_revolution, ">= 1")
    for field in ("edge_pattern_sd", "edge_jitter_sd"):
        if not 0.0 <= getattr(spec, field) <= 0.5:
            refuse("is a fraction of a pulse", field, getattr(spec, field), "0 to 0.5")
    if not 0.0 <= spec.missed_rate <= 0.5:
        refuse("is a probability per pulse", "missed_rate", spec.missed_rate, "0 to 0.5")
    if not 0.0 < spec.timer_hz < np.inf:
        refuse("a timer must tick", "timer_hz", spec.timer_hz, "> 0 Hz")
    if spec.phase is not None and not 0.0 <= spec.phase < 1.0:
        refuse("is a fraction of a count", "phase", spec.phase, ">= 0 and < 1")
    for i, event in enumerate(spec.slip):
        if not event.duration_s > 0.0:
            refuse("a slip takes time", f"slip[{i}].duration_s", event.duration_s, "> 0 s")
        if not 0.0 <= event.ramp_s <= 0.5 * event.duration_s:
            limit = f"0 to half the duration, {0.5 * event.duration_s:g} s"
            refuse("rise and fall do not fit", f"slip[{i}].ramp_s", event.ramp_s, limit)
        if not -1.0 <= event.creepage <= 10.0:
            refuse("no wheel slips so", f"slip[{i}].creepage", event.creepage, "-1 (locked) to 10")


def _streams(spec: EncoderSpec, *, seed: int, draw: int) -> Streams:
    """Random streams of one encoder, by the name of the term."""
    return partial(stream, seed, "sensor", draw, "encoder", spec.wheel)


def _displaced_edges(
    turned: FloatArray, spec: EncoderSpec, streams: Streams
) -> tuple[int, FloatArray] | None:
    """Number of the first edge, and sorted places of all edges that the ride may pass, in counts.

    None if every edge is in its place. Edge j belongs at j. Its jitter is the j-th of its stream (or the
    (-j)-th of another one, backward of the start), so that a longer ride meets the same edges.
    """
    sd = np.array([spec.edge_pattern_sd, spec.edge_jitter_sd]) * spec.counts_per_pulse
    if not sd.any():
        return None
    reach = int(np.ceil(_REACH_SD * sd.sum())) + 1
    first, last = int(np.floor(turned.min())) - reach, int(np.ceil(turned.max())) + reach
    numbers = np.arange(first, last + 1)
    places = numbers.astype(np.float64)
    if sd[0] > 0.0:
        pattern = streams("edge_pattern").normal(0.0, sd[0], spec.counts_per_revolution)
        places += pattern[numbers % spec.counts_per_revolution]
    if sd[1] > 0.0:
        places[-first:] += streams("edge_jitter").normal(0.0, sd[1], last + 1)
        places[:-first] += streams("edge_jitter_back").normal(0.0, sd[1], -first)[::-1]
    places.sort()
    return first, places


def _missed(change: IntArray, spec: EncoderSpec, streams: Streams) -> IntArray:
    """Change of the count (n,) that went unseen, signed."""
    lost = np.zeros_like(change)
    if spec.missed_rate == 0.0:
        return lost
    passages = np.cumsum(np.abs(change))
    per_pulse = spec.counts_per_pulse
    pulses = int(passages[-1]) // per_pulse + 1
    # From one missed pulse to the next: geometric.
    generator = streams("missed")
    numbers = np.zeros(0, dtype=np.int64)
    while len(numbers) == 0 or numbers[-1] <= pulses:
        start = numbers[-1] if len(numbers) else 0
        more = generator.geometric(spec.missed_rate, 100)
        numbers = np.concatenate([numbers, start + np.cumsum(more)])
    edges = (per_pulse * (numbers[:, None] - 1) + np.arange(1, per_pulse + 1)).ravel()
    when = np.searchsorted(passages, edges, side="left")
    when = when[when < len(change)]
    np.add.at(lost, when, np.sign(change[when]))
    return lost


def _edge_times(
    turned: FloatArray, time: FloatArray, place: FloatArray, seen: npt.NDArray[np.bool_], timer_hz: float
) -> FloatArray:
    """Time (n,) of the last edge seen, whole ticks: the wheel turns evenly between two given times."""
    step = np.diff(turned, prepend=turned[0])
    share = np.divide(place - turned, step, out=np.zeros_like(turned), where=step != 0.0)
    passed_at = time + share * (time[1] - time[0])
    ticks = np.floor(passed_at * timer_hz * (1.0 + 4.0 * np.finfo(np.float64).eps)) / timer_hz
    latest = np.maximum.accumulate(np.where(seen, np.arange(len(time)), 0))
    ticks[0] = time[0]
    times: FloatArray = ticks[latest]
    return times
