"""Discrete defects of the rails: ramp, step, dip, joint and twist, as shapes in closed form at a place.

Each is a deviation of a rail over u = (s - at) / length, added to whatever else lies there:

    ramp   from 0 to `size` in a straight line whose two bends are rounded; it stays for `hold` and returns
    step   the same as a quintic smooth step
    dip    size (1 - cos(2 pi u))/2 over 0 <= u <= 1: it leaves and comes back
    joint  size (1 - |2 u - 1|)^2 with its point rounded: two rail ends that hang towards each other
    twist  a ramp of the cross-level: the left rail by half of `size`, the right one by minus half

All have a continuous slope (dip and joint), or a continuous curvature too (ramp, step, twist), since the
second derivative of a rail is what shakes an axle; a step of no length is none that a wheel could follow.

The places are those of the track, whichever way it is ridden. How the shapes get into the rails is the
matter of `simrail.track.laid_track`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simrail.core.errors import InputError, one_of
from simrail.core.jit import FloatArray
from simrail.track.elements import require_number

FORMS = ("ramp", "step", "dip", "joint", "twist")

SHORTEST_DEFECT_M = 0.25
"""Shortest length; a wave of that length is the shortest that rails have."""

LARGEST_DEFECT_M = 0.5
"""Bound of the geometry, not of any standard: it catches a wrong unit."""

ROUNDED = 0.2
"""Share of a ramp's length over which each of its bends is rounded."""

ROUNDED_POINT = 0.1
"""Share of a joint's length over which its point is rounded."""

SHORTEST_WAVE = {
    "ramp": 2.0 * ROUNDED,
    "twist": 2.0 * ROUNDED,
    "step": 1.0,
    "dip": 1.0,
    "joint": 2.0 * ROUNDED_POINT,
}
"""Of each form, over its length: the wave that its sharpest bend is half of, which the rails must carry."""


@dataclass(frozen=True)
class Defect:
    """One defect.

    Attributes
    ----------
    form : {"ramp", "step", "dip", "joint", "twist"}
        Its shape.
    at_m : float
        Where it begins, s along the track.
    length_m : float
        Length of the shape; of a ramp, step or twist that of its rise.
    size_m : float
        Its height: upward or to the left positive; of a dip or joint downward or to the right positive; of
        a twist the cross-level that it ends with, left rail up positive.
    direction : {"vertical", "lateral"}
        Which way the rails deviate; a twist is always vertical.
    rails : {"both", "left", "right"}
        Which rails deviate; a twist is of both.
    hold_m : float, optional
        How far a ramp, step or twist stays before it returns over its length; to the end of the track if
        not given.
    """

    form: Literal["ramp", "step", "dip", "joint", "twist"]
    at_m: float
    length_m: float
    size_m: float
    direction: Literal["vertical", "lateral"] = "vertical"
    rails: Literal["both", "left", "right"] = "both"
    hold_m: float | None = None

    @property
    def stays(self) -> bool:
        """Whether it is of a form that does not come back by itself."""
        return self.form in ("ramp", "step", "twist")

    @property
    def end_m(self) -> float:
        """Where it has come back to nothing; infinite for one that stays."""
        if not self.stays:
            return self.at_m + self.length_m
        return math.inf if self.hold_m is None else self.at_m + 2.0 * self.length_m + self.hold_m

    def shape(self, s: FloatArray) -> FloatArray:
        """Its shape at places s (n,), from 0 to 1."""
        u = (s - self.at_m) / self.length_m
        if self.form == "dip":
            return 0.5 - 0.5 * np.cos(2.0 * np.pi * np.clip(u, 0.0, 1.0))
        if self.form == "joint":
            return _cusp(np.abs(2.0 * u - 1.0))
        rise = _smooth if self.form == "step" else _ramp
        if self.hold_m is None:
            return rise(u)
        return rise(u) - rise(u - 1.0 - self.hold_m / self.length_m)

    def deviations(self, s: FloatArray) -> FloatArray:
        """Deviations y_left, z_left, y_right, z_right of the rails at places s (n,), m; (n, 4)."""
        shape = self.size_m * self.shape(s)
        result = np.zeros((len(s), 4))
        if self.form == "twist":
            result[:, 1], result[:, 3] = 0.5 * shape, -0.5 * shape
            return result
        if not self.stays:
            shape = -shape
        offset = 1 if self.direction == "vertical" else 0
        for column, rail in ((0, "left"), (2, "right")):
            if self.rails in (rail, "both"):
                result[:, column + offset] = shape
        return result


def _smooth(u: FloatArray) -> FloatArray:
    """Quintic from 0 to 1 over 0 <= u <= 1, without slope or bend at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _ramp(u: FloatArray) -> FloatArray:
    """Straight line from 0 to 1 over 0 <= u <= 1 whose slope rises and falls over r = `ROUNDED` at its ends.

    The slope is p(u/r) / (1 - r) with the smooth step p(t) = t^2 (3 - 2 t), whose integral is t^3 - t^4/2:
    the curvature is continuous, and between the bends the line is straight. Its halves mirror each other.
    """
    u = np.clip(u, 0.0, 1.0)
    half = np.minimum(u, 1.0 - u)
    bend = np.minimum(half / ROUNDED, 1.0)
    risen = (ROUNDED * (bend**3 - 0.5 * bend**4) + np.maximum(half - ROUNDED, 0.0)) / (1.0 - ROUNDED)
    return np.where(u <= 0.5, risen, 1.0 - risen)


def _cusp(v: FloatArray) -> FloatArray:
    """(1 - v)^2 for a distance v from the middle, up to 1, with a parabola for its point.

    Within v < p = `ROUNDED_POINT` the parabola has the slope of (1 - v)^2 where they meet; the whole is
    divided by its height, so that the middle is 1.
    """
    p = ROUNDED_POINT
    point = (1.0 - p) ** 2 + (1.0 - p) * (p**2 - v**2) / p
    return np.where(v < p, point, np.clip(1.0 - v, 0.0, None) ** 2) / ((1.0 - p) ** 2 + (1.0 - p) * p)


def check_defects(defects: Sequence[Defect], start_m: float, end_m: float) -> None:
    """Refuse defects that cannot be, or are off a track from ``start_m`` to ``end_m``.

    Raises
    ------
    InputError
        Naming the defect as ``defect[i]``.
    """
    for i, at in enumerate(defects):
        field = f"defect[{i}]"
        one_of(at.form, FORMS, "there is no such form of a defect", field=f"{field}.form")
        require_number(at.length_m, f"{field}.length_m", least=SHORTEST_DEFECT_M)
        require_number(at.size_m, f"{field}.size_m", within=LARGEST_DEFECT_M, zero=False)
        if at.hold_m is not None:
            require_number(at.hold_m, f"{field}.hold_m", least=0.0)
        if at.hold_m is not None and not at.stays:
            raise InputError(
                f"a {at.form} comes back by itself",
                field=f"{field}.hold_m",
                value=at.hold_m,
                remedy="remove it, or take a ramp, step or twist",
                limit="a form that stays",
            )
        if at.form == "twist" and (at.rails != "both" or at.direction != "vertical"):
            name, value = ("rails", at.rails) if at.rails != "both" else ("direction", at.direction)
            raise InputError(
                "a twist is of both rails, one up and one down",
                field=f"{field}.{name}",
                value=value,
                remedy=f"remove {name}, or take a ramp",
                limit="no such key in a twist",
            )
        last = at.at_m + at.length_m if at.end_m == math.inf else at.end_m
        if not (start_m <= at.at_m and last <= end_m):
            raise InputError(
                "the defect is not on the track",
                field=f"{field}.at_m",
                value=f"{at.at_m:g} to {last:g} m",
                limit=f"{start_m:g} to {end_m:g} m",
                remedy="move it, or make it shorter",
            )


def deviations(defects: Sequence[Defect], s: FloatArray) -> FloatArray:
    """Sum of the defects' deviations y_left, z_left, y_right, z_right at places s (n,), m; (n, 4)."""
    total = np.zeros((len(s), 4))
    for at in defects:
        total += at.deviations(s)
    return total


def shortest_wave_m(defects: Sequence[Defect]) -> float:
    """Length of the shortest wave that the rails must carry for these defects; infinite without any."""
    return min((SHORTEST_WAVE[at.form] * at.length_m for at in defects), default=math.inf)
