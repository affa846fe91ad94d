"""How the train is driven: speed over distance, with stops, limited acceleration and jerk.

A profile is a list of legs between stops. Within a leg the jerk is piecewise constant (the classic
seven-piece ramp), so s(t) is a piecewise cubic: exact, with continuous acceleration, and reaching
every stop to rounding. The track's own limits are judged in `simrail.scenario`, not here.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly
from scipy.optimize import brentq

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray


@dataclass(frozen=True)
class SpeedProfile:
    """Speed profile of one ride; the direction follows from start and end.

    Attributes
    ----------
    start_m, end_m : float
        Where the vehicle's reference point stands at first and at last (s along the track); if they are
        the same, without stops, it does not move.
    speed_mps : float
        Cruise speed, > 0; of no matter where nothing moves.
    acceleration_mps2, jerk_mps3 : float
        Limits of traction and braking alike, > 0.
    rest_s, final_rest_s : float
        Time at rest before the first start and after the last stop.
    stops : tuple of (position_m, dwell_s)
        Stops on the way, in the order of travel.
    """

    start_m: float
    end_m: float
    speed_mps: float
    acceleration_mps2: float = 0.6
    jerk_mps3: float = 0.4
    rest_s: float = 20.0
    final_rest_s: float = 5.0
    stops: tuple[tuple[float, float], ...] = ()

    @property
    def direction(self) -> int:
        """+1 towards larger s, -1 towards smaller s (then speeds are negative)."""
        return 1 if self.end_m >= self.start_m else -1

    @property
    def duration_s(self) -> float:
        """Length of the ride, rests included."""
        return float(self._curve.x[-1])

    @property
    def pieces(self) -> tuple[FloatArray, FloatArray]:
        """Breakpoints (m+1,) in s and cubic coefficients (m, 4), highest power first, of s(t)."""
        curve = self._curve
        return np.ascontiguousarray(curve.x), np.ascontiguousarray(curve.c.T)

    def motion(self, t: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, signed speed and acceleration (each shaped like t) at times t in seconds."""
        time = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration_s)
        curve = self._curve
        return curve(time), curve(time, 1), curve(time, 2)

    @cached_property
    def _curve(self) -> PPoly:
        sign = self.direction
        points = [self.start_m, *(position for position, _ in self.stops), self.end_m]
        dwells = [*(dwell for _, dwell in self.stops), self.final_rest_s]
        pieces: list[tuple[float, float]] = [(self.rest_s, 0.0)]
        stands = self.end_m == self.start_m and not self.stops
        for begin, end, dwell in zip(points[:-1], points[1:], dwells, strict=True):
            if stands:
                pieces.append((dwell, 0.0))
                continue
            distance = sign * (end - begin)
            if distance <= 0.0:
                raise InputError(
                    "stops must lie between start and end, in the order of travel",
                    field="stops",
                    value=end,
                    limit=f"beyond {begin:g} m",
                )
            pieces += _leg(distance, self.speed_mps, self.acceleration_mps2, self.jerk_mps3)
            pieces.append((dwell, 0.0))
        pieces = [piece for piece in pieces if piece[0] > 0.0]
        if not pieces:
            raise InputError("the ride takes no time", field="rest_s", value=self.rest_s, limit="> 0 s")
        times = np.concatenate([[0.0], np.cumsum([duration for duration, _ in pieces])])
        coefficients = np.empty((4, len(pieces)))
        position, speed, acceleration = self.start_m, 0.0, 0.0
        for i, (duration, jerk) in enumerate(pieces):
            jerk *= sign
            if jerk == 0.0 and abs(speed) < 1e-9 and abs(acceleration) < 1e-9:
                speed = acceleration = 0.0  # a rest is exactly a rest, not a rounding error
            coefficients[:, i] = jerk / 6.0, acceleration / 2.0, speed, position
            position += duration * (speed + duration * (acceleration / 2.0 + duration * jerk / 6.0))
            speed += duration * (acceleration + duration * jerk / 2.0)
            acceleration += duration * jerk
        return PPoly(coefficients, times, extrapolate=False)


def _ramp(speed: float, acceleration: float, jerk: float) -> tuple[float, float]:
    """Durations (of each jerk piece, of constant acceleration) to change the speed from 0."""
    if speed * jerk >= acceleration**2:
        return acceleration / jerk, speed / acceleration - acceleration / jerk
    return float(np.sqrt(speed / jerk)), 0.0


def _leg(distance: float, speed: float, acceleration: float, jerk: float) -> list[tuple[float, float]]:
    """(duration, jerk) pieces from rest to rest over a distance, at most at the given speed."""

    def ramps_need(peak: float) -> float:
        jerk_time, constant_time = _ramp(peak, acceleration, jerk)
        return peak * (2.0 * jerk_time + constant_time)

    peak = speed
    if ramps_need(speed) > distance:
        peak = brentq(lambda v: ramps_need(v) - distance, 0.0, speed, xtol=1e-15, rtol=1e-14)
    jerk_time, constant_time = _ramp(peak, acceleration, jerk)
    up = [(jerk_time, jerk), (constant_time, 0.0), (jerk_time, -jerk)]
    down = [(jerk_time, -jerk), (constant_time, 0.0), (jerk_time, jerk)]
    return [*up, ((distance - ramps_need(peak)) / peak, 0.0), *down]
