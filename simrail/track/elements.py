"""The elements that a track is designed from: straights, curves, transitions, gradients.

Plain values in metres. How they are joined to a line, and which combinations are refused, is the
matter of `simrail.track.alignment`; what the line looks like at a place is that of
`simrail.track.design`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

STRAIGHT, TRANSITION, CURVE = 0, 1, 2
"""Values of `TrackDesign.kind`."""

RAIL_BASE_M = 1.5
"""Lateral distance of the two running tables, over which cant and cross-level are measured."""


@dataclass(frozen=True)
class Straight:
    """A straight without cant.

    Attributes
    ----------
    length_m : float
        Length of the horizontal projection.
    """

    length_m: float

    kind = STRAIGHT
    word = "straight"
    curvature_1pm = 0.0
    cross_slope_m = 0.0

    def mirrored(self) -> Straight:
        """Itself: a straight has no side."""
        return self


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
        Height of the outer above the inner rail over 1.5 m, turned about the centreline.
    """

    length_m: float
    radius_m: float
    cant_m: float = 0.0

    kind = CURVE
    word = "curve"

    @property
    def curvature_1pm(self) -> float:
        """d yaw / ds, positive to the left."""
        return 1.0 / self.radius_m

    @property
    def cross_slope_m(self) -> float:
        """Height of the left above the right rail; a left curve has its right rail raised."""
        return -self.cant_m if self.radius_m > 0 else self.cant_m

    def mirrored(self) -> Curve:
        """The curve to the other side."""
        return Curve(self.length_m, -self.radius_m, self.cant_m)


@dataclass(frozen=True)
class Transition:
    """A clothoid with a cant ramp: it joins whatever stands before it to whatever follows.

    Attributes
    ----------
    length_m : float
        Length of the horizontal projection.
    """

    length_m: float

    kind = TRANSITION
    word = "transition"

    def mirrored(self) -> Transition:
        """Itself: a transition takes its sides from its neighbours."""
        return self


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


_ELEMENTS: dict[str, type[Straight] | type[Curve] | type[Transition]] = {
    cls.word: cls for cls in (Straight, Curve, Transition)
}


def element_to_dict(element: Element) -> dict[str, Any]:
    """Plain data of an element; `element_from_dict` is the inverse."""
    return {"kind": element.word, **asdict(element)}


def element_from_dict(data: dict[str, Any]) -> Element:
    """Element from the plain data that `element_to_dict` makes."""
    values = dict(data)
    return _ELEMENTS[values.pop("kind")](**values)
