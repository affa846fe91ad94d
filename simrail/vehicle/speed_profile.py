"""How the train is driven: speed over distance, with stops, restrictions, coasting, and runs both ways.

A profile is a list of legs from stop to stop. A leg falls into stretches of one speed limit; in each the
train changes from the speed at its begin to that of the stretch, holds it or coasts, and changes to the speed
at its end. Each change has limited acceleration and jerk (the classic ramp of three pieces of constant jerk),
so s(t) is a piecewise cubic: exact, with continuous acceleration, and reaching every stop to rounding. The
track's own limits are judged in `simrail.scenario`, not here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly
from scipy.optimize import brentq

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

_Piece = tuple[float, float]
"""Duration, s, and jerk, m/s3, in the direction of the run."""


class Restriction(NamedTuple):
    """A stretch of the line, begin and end as s, that is passed at most at a speed, in either direction.

    It holds for the vehicle's reference point.
    """

    begin_m: float
    end_m: float
    speed_mps: float


class Coasting(NamedTuple):
    """The train is let roll once it has its speed, and slows down by resistance alone.

    Below `least_mps` it does not fall; there the speed is held.
    """

    deceleration_mps2: float
    least_mps: float


class Run(NamedTuple):
    """One more run: where it ends (s), and how long the train has stood before it."""

    end_m: float
    turn_s: float


@dataclass(frozen=True)
class SpeedProfile:
    """Speed profile of one ride; the direction of each run follows from its start and end.

    Attributes
    ----------
    start_m, end_m : float
        Where the vehicle's reference point stands at first and after the first run (s along the track); if
        they are the same, without stops and further runs, it does not move.
    speed_mps : float
        Cruise speed, > 0; of no matter where nothing moves.
    acceleration_mps2, jerk_mps3 : float
        Limits of traction, and of braking unless `braking_mps2` is given, > 0.
    rest_s, final_rest_s : float
        Time at rest before the first start and after the last stop.
    stops : tuple of (position_m, dwell_s)
        Stops on the way, in the order of travel; with `runs`, stops of the line: each run that passes stops.
    runs : tuple of Run
        What follows the first run. Nothing is turned around: a train that goes back runs backwards.
    braking_mps2 : float, optional
        Limit of braking.
    restrictions : tuple of Restriction
        Where it is slower. The lowest counts.
    coasting : Coasting, optional
        Whether it coasts; None for holding its speed.
    """

    start_m: float
    end_m: float
    speed_mps: float
    acceleration_mps2: float = 0.6
    jerk_mps3: float = 0.4
    rest_s: float = 20.0
    final_rest_s: float = 5.0
    stops: tuple[tuple[float, float], ...] = ()
    runs: tuple[Run, ...] = ()
    braking_mps2: float | None = None
    restrictions: tuple[Restriction, ...] = ()
    coasting: Coasting | None = None

    @property
    def direction(self) -> int:
        """Of the first run: +1 towards larger s, -1 towards smaller s (then speeds are negative)."""
        return 1 if self.end_m >= self.start_m else -1

    @property
    def reach_m(self) -> tuple[float, float]:
        """Smallest and largest s of the vehicle's reference point."""
        points = (self.start_m, self.end_m, *(run.end_m for run in self.runs))
        return min(points), max(points)

    @property
    def duration_s(self) -> float:
        """Length of the ride, rests included."""
        return float(self._curve.x[-1])

    @property
    def pieces(self) -> tuple[FloatArray, FloatArray]:
        """Breakpoints (m+1,) in s and cubic coefficients (m, 4), highest power first, of s(t)."""
        curve = self._curve
        return np.ascontiguousarray(curve.x), np.ascontiguousarray(curve.c.T)

    @property
    def directions(self) -> FloatArray:
        """+1 or -1 of the run of each piece (m,); a rest belongs to the run before it."""
        return self._planned[1]

    def motion(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, signed speed and acceleration (each shaped like t) at times t in seconds."""
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration_s)
        curve = self._curve
        return curve(time), curve(time, 1), curve(time, 2)

    @property
    def _curve(self) -> PPoly:
        return self._planned[0]

    @cached_property
    def _planned(self) -> tuple[PPoly, FloatArray]:
        """Position s(t), and the direction of each piece."""
        listed: list[tuple[float, float, int]] = [(self.rest_s, 0.0, self.direction)]
        if self.end_m == self.start_m and not self.stops and not self.runs:
            listed.append((self.final_rest_s, 0.0, 1))
        else:
            begin = self.start_m
            rests = [*(run.turn_s for run in self.runs), self.final_rest_s]
            ends = [self.end_m, *(run.end_m for run in self.runs)]
            for end, rest in zip(ends, rests, strict=True):
                sign = 1 if end >= begin else -1
                listed += [(*piece, sign) for piece in self._run(begin, end, rest)]
                begin = end
        listed = [piece for piece in listed if piece[0] > 0.0]
        if not listed:
            raise InputError("the ride takes no time", field="rest_s", value=self.rest_s, limit="> 0 s")
        times = np.concatenate([[0.0], np.cumsum([duration for duration, _, _ in listed])])
        coefficients = np.empty((4, len(listed)))
        position, speed, acceleration = self.start_m, 0.0, 0.0
        for i, (duration, jerk, sign) in enumerate(listed):
            jerk *= sign
            if jerk == 0.0 and abs(speed) < 1e-9 and abs(acceleration) < 1e-9:
                speed = acceleration = 0.0  # a rest is exactly a rest, not a rounding error
            coefficients[:, i] = jerk / 6.0, acceleration / 2.0, speed, position
            position += duration * (speed + duration * (acceleration / 2.0 + duration * jerk / 6.0))
            speed += duration * (acceleration + duration * jerk / 2.0)
            acceleration += duration * jerk
        directions = np.array([float(sign) for _, _, sign in listed])
        return PPoly(coefficients, times, extrapolate=False), directions

    def _run(self, start_m: float, end_m: float, rest_s: float) -> Iterator[_Piece]:
        """Pieces of one run and of the rest after it."""
        sign = 1.0 if end_m >= start_m else -1.0
        stops = self.stops
        if self.runs:
            passed = [stop for stop in stops if 0.0 < sign * (stop[0] - start_m) < sign * (end_m - start_m)]
            stops = tuple(sorted(passed, key=lambda stop: sign * stop[0]))
        points = [start_m, *(position for position, _ in stops), end_m]
        dwells = [*(dwell for _, dwell in stops), rest_s]
        for begin, end, dwell in zip(points[:-1], points[1:], dwells, strict=True):
            if sign * (end - begin) <= 0.0:
                raise InputError(
                    "stops must lie between start and end, in the order of travel",
                    field="stops",
                    value=end,
                    limit=f"beyond {begin:g} m",
                )
            yield from self._leg(begin, end)
            yield dwell, 0.0

    def _leg(self, begin_m: float, end_m: float) -> Iterator[_Piece]:
        """Pieces from rest to rest."""
        up, down = self.acceleration_mps2, self.braking_mps2 or self.acceleration_mps2
        lengths, limits = self._stretches(begin_m, end_m)
        speeds = [0.0, *(min(pair) for pair in pairwise(limits)), 0.0]
        # No speed at a joint that cannot be reached from the one before, or left in time for the next.
        for i, length in enumerate(lengths):
            speeds[i + 1] = min(speeds[i + 1], self._reached(speeds[i], length, up))
        for i, length in reversed(list(enumerate(lengths))):
            speeds[i] = min(speeds[i], self._reached(speeds[i + 1], length, down))
        for i, (length, limit) in enumerate(zip(lengths, limits, strict=True)):
            yield from self._stretch(length, (speeds[i], limit, speeds[i + 1]), up, down)

    def _stretches(self, begin_m: float, end_m: float) -> tuple[list[float], list[float]]:
        """Lengths and speed limits of the stretches of a leg, in the order of travel."""
        low, high = sorted((begin_m, end_m))
        ends = {place for each in self.restrictions for place in each[:2] if low < place < high}
        points = [begin_m, *sorted(ends, reverse=bool(end_m < begin_m)), end_m]
        lengths: list[float] = []
        limits: list[float] = []
        for first, second in pairwise(points):
            middle = 0.5 * (first + second)
            slower = [each.speed_mps for each in self.restrictions if each.begin_m < middle < each.end_m]
            limit = min([self.speed_mps, *slower])
            if limits and limits[-1] == limit:
                lengths[-1] += abs(second - first)
            else:
                lengths.append(abs(second - first))
                limits.append(limit)
        return lengths, limits

    def _reached(self, speed: float, length: float, acceleration: float) -> float:
        """Highest speed, at most that of cruising, to or from which the train changes over a length."""

        def beyond(other: float) -> float:
            return _way(speed, other, acceleration, self.jerk_mps3) - length

        if beyond(self.speed_mps) <= 0.0:
            return self.speed_mps
        return float(brentq(beyond, speed, self.speed_mps, xtol=1e-15, rtol=1e-14))

    def _stretch(
        self, length: float, speeds: tuple[float, float, float], up: float, down: float
    ) -> Iterator[_Piece]:
        """Pieces of a stretch: from one speed to at most another, and to a third at its end."""
        first, limit, last = speeds
        jerk = self.jerk_mps3

        def need(peak: float) -> float:
            return _way(first, peak, up, jerk) + _way(peak, last, down, jerk)

        peak = limit
        if need(limit) > length:
            least = max(first, last)
            # A speed that a joint took from the length itself leaves nothing but rounding.
            peak = (
                least
                if need(least) >= length
                else brentq(lambda v: need(v) - length, least, limit, xtol=1e-15, rtol=1e-14)
            )
        yield from _change(first, peak, up, jerk)
        left = max(length - need(peak), 0.0)
        if self.coasting is None or left == 0.0:
            yield left / peak, 0.0
            yield from _change(peak, last, down, jerk)
            return
        slow, lowest = self.coasting.deceleration_mps2, max(min(self.coasting.least_mps, peak), last)

        def over(end: float) -> float:
            return (
                _way(peak, end, slow, jerk)
                + _way(end, last, down, jerk)
                - (length - _way(first, peak, up, jerk))
            )

        rolled = lowest
        if over(lowest) > 0.0:
            rolled = brentq(over, lowest, peak, xtol=1e-15, rtol=1e-14)
        yield from _change(peak, rolled, slow, jerk)
        yield max(-over(rolled), 0.0) / rolled, 0.0
        yield from _change(rolled, last, down, jerk)


def _ramp(change: float, acceleration: float, jerk: float) -> tuple[float, float]:
    """Durations (of each jerk piece, of constant acceleration) of a change of speed."""
    if change * jerk >= acceleration**2:
        return acceleration / jerk, change / acceleration - acceleration / jerk
    return float(np.sqrt(change / jerk)), 0.0


def _way(first: float, second: float, acceleration: float, jerk: float) -> float:
    """Length over which the speed changes from one to another: by symmetry, at their mean."""
    jerk_time, constant_time = _ramp(abs(second - first), acceleration, jerk)
    return 0.5 * (first + second) * (2.0 * jerk_time + constant_time)


def _change(first: float, second: float, acceleration: float, jerk: float) -> list[_Piece]:
    """Pieces of a change of speed."""
    jerk_time, constant_time = _ramp(abs(second - first), acceleration, jerk)
    jerk = jerk if second >= first else -jerk
    return [(jerk_time, jerk), (constant_time, 0.0), (jerk_time, -jerk)]
