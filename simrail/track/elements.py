"""The elements that a track is designed from: straights, curves, transitions, gradients, stations of cant.

Plain values in metres. At what curvature and cant they meet is the matter of `simrail.track.joints`; how they
are joined to a line is that of `simrail.track.alignment` and `simrail.track.vertical`; what the line looks
like at a place is that of `simrail.track.design`.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from simrail.core.errors import InputError

STRAIGHT, TRANSITION, CURVE = 0, 1, 2
"""Values of `TrackDesign.kind`."""

RAIL_BASE_M = 1.5
"""Lateral distance of the two running tables of a track of normal gauge, over which cant and cross-level are
measured: that of every track whose file names no other one."""

MAX_CANT_PER_BASE = 0.5
MAX_SLOPE = 0.5
"""Bounds of the geometry (30 deg, 27 deg), not of any standard: they catch a wrong unit."""

SMOOTH_STEP = np.array([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])
"""The quintic from 0 to 1 with zero slope and bend at both ends, highest power first."""


LEAST_RADIUS_M = 0.5
"""Narrower no vehicle goes round, also not a model."""

LEAST_LENGTH_M = 1e-6
"""Of one element: of shorter ones places cannot be told apart along a track."""

MOST_LENGTH_M = 1e6
"""Of one element: the longest straight there is has 478 km (figure from memory)."""


def cross_slope(cant_m: float, curvature_1pm: float) -> float:
    """Height of the left above the right rail; a left curve and a straight have the right one raised.

    On a straight no rail is the outer one: there a positive cant is that of a curve to the left.
    """
    if curvature_1pm == 0.0 and cant_m == 0.0:
        return 0.0
    return -cant_m if curvature_1pm >= 0.0 else cant_m


@dataclass(frozen=True)
class Straight:
    """A straight.

    Attributes
    ----------
    length_m : float
        Length of the horizontal projection.
    cant_m : float
        Height of the right above the left rail, as in a curve to the left; over the track's rail base, turned
        about the centreline.
    """

    length_m: float
    cant_m: float = 0.0

    kind = STRAIGHT
    word = "straight"
    curvature_1pm = 0.0

    @property
    def cross_slope_m(self) -> float:
        """Height of the left above the right rail."""
        return cross_slope(self.cant_m, 0.0)


@dataclass(frozen=True)
class Curve:
    """An arc of constant radius and cant.

    Attributes
    ----------
    length_m : float
        Length of the horizontal projection.
    radius_m : float
        Radius of the horizontal projection, positive for a curve to the left.
    cant_m : float
        Height of the outer above the inner rail over the track's rail base, turned about the centreline.
    """

    length_m: float
    radius_m: float
    cant_m: float = 0.0

    kind = CURVE
    word = "curve"

    @property
    def curvature_1pm(self) -> float:
        """D yaw / ds, positive to the left."""
        return 1.0 / self.radius_m

    @property
    def cross_slope_m(self) -> float:
        """Height of the left above the right rail; a left curve has its right rail raised."""
        return cross_slope(self.cant_m, self.radius_m)


@dataclass(frozen=True)
class Transition:
    """A clothoid with a cant ramp: it joins whatever stands before it to whatever follows.

    An end may have a radius and a cant of its own. One that has none takes them from the straight, the curve
    or the end of the transition beside it; the end of a track, and the place where two
    transitions of opposite curves meet, is straight and level then.

    Attributes
    ----------
    length_m : float
        Length of the horizontal projection.
    start_radius_m, end_radius_m : float, optional
        Radius at either end, positive to the left; infinite where it is straight.
    start_cant_m, end_cant_m : float, optional
        Cant at an end that has a radius of its own, signed as in `Curve` and `Straight`; 0 if not given.
    """

    length_m: float
    start_radius_m: float | None = None
    end_radius_m: float | None = None
    start_cant_m: float | None = None
    end_cant_m: float | None = None

    kind = TRANSITION
    word = "transition"


Element = Straight | Curve | Transition


@dataclass(frozen=True)
class Gradient:
    """A slope that holds from a place on, until the next gradient.

    Attributes
    ----------
    from_m : float
        Where it begins; the vertical curve that leads to it is centred here.
    slope : float
        dz/ds, positive uphill in the direction of s.
    """

    from_m: float
    slope: float


@dataclass(frozen=True)
class CantStation:
    """Cant at a place, beside the plan; between two stations it changes linearly.

    Attributes
    ----------
    at_m : float
        Where it is, s along the track.
    cross_slope_m : float
        Height of the left above the right rail over the track's rail base.
    """

    at_m: float
    cross_slope_m: float


@dataclass(frozen=True)
class ChainageBreak:
    """A place where the kilometre posts jump: s goes on, the chainage does not.

    Attributes
    ----------
    at_m : float
        Where it is, s along the track.
    ahead_m : float
        Chainage that begins there; before the first break chainage is s.
    """

    at_m: float
    ahead_m: float


_ELEMENTS: dict[str, type[Straight] | type[Curve] | type[Transition]] = {
    cls.word: cls for cls in (Straight, Curve, Transition)
}


def element_to_dict(element: Element) -> dict[str, Any]:
    """Plain data of an element, without what it does not say; `element_from_dict` is the inverse."""
    said = {key: value for key, value in asdict(element).items() if value is not None}
    if isinstance(element, Straight) and not element.cant_m:
        del said["cant_m"]
    return {"kind": element.word, **said}


def element_from_dict(data: dict[str, Any]) -> Element:
    """Element from the plain data that `element_to_dict` makes."""
    values = dict(data)
    return _ELEMENTS[values.pop("kind")](**values)


def require_number(
    value: float,
    field: str,
    *,
    above: float = -math.inf,
    least: float = -math.inf,
    within: float = math.inf,
    zero: bool = True,
) -> None:
    """Refuse a number that is not finite, or outside of its bounds.

    Parameters
    ----------
    above, least : float
        Bounds from below, the first excluded and the second included.
    within : float
        Largest magnitude.
    zero : bool
        Whether 0 is allowed.

    Raises
    ------
    InputError
        Naming the field, the value and the limits.
    """
    fits = above < value and least <= value and abs(value) <= within and (zero or value != 0.0)
    if not (math.isfinite(value) and fits):
        limits = ["a finite number"]
        limits += [f"> {above:g}"] if above > -math.inf else []
        limits += [f">= {least:g}"] if least > -math.inf else []
        limits += [f"magnitude <= {within:g}"] if within < math.inf else []
        limits += [] if zero else ["not 0"]
        raise InputError("is out of range", field=field, value=value, limit=", ".join(limits))
