"""The elements that a track is designed from: straights, curves, transitions, gradients.

Plain values in metres, and the check that they can be joined without a step. How they are joined to a
line is the matter of `simrail.track.alignment` and `simrail.track.vertical`; what the line looks like
at a place is that of `simrail.track.design`.
"""

import math
from collections.abc import Sequence
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


LEAST_LENGTH_M = 1e-6
"""Of one element: of shorter ones places cannot be told apart along a track."""

MOST_LENGTH_M = 1e6
"""Of one element: the longest straight there is has 478 km (figure from memory)."""


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
        return -self.cant_m if self.radius_m > 0 else self.cant_m


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


def check_elements(elements: Sequence[Element], *, rail_base_m: float = RAIL_BASE_M) -> None:
    """Refuse elements that cannot be joined to a line of continuous curvature and cant.

    Parameters
    ----------
    elements : sequence of Straight, Curve, Transition
        The plan, in the order of s.
    rail_base_m : float
        What cant is a height over.

    Raises
    ------
    InputError
        Naming the element (counted from 0, as in ``segment[3]``) and its field.
    """
    if not elements:
        raise InputError(
            "has no elements", field="segment", remedy="add a straight", limit="one element or more"
        )
    for i, element in enumerate(elements):
        here = f"segment[{i}]"
        require_number(element.length_m, f"{here}.length_m", above=LEAST_LENGTH_M, within=MOST_LENGTH_M)
        if isinstance(element, Curve):
            require_number(element.radius_m, f"{here}.radius_m", zero=False)
            require_number(element.cant_m, f"{here}.cant_m", within=MAX_CANT_PER_BASE * rail_base_m)
        after = elements[i + 1] if i + 1 < len(elements) else None
        if isinstance(element, Transition):
            if i == 0 or after is None or isinstance(after, Transition):
                raise InputError(
                    "a transition joins two neighbours, each a straight or a curve",
                    field=here,
                    remedy="put a straight or a curve before and after it",
                    limit="a straight or a curve on either side",
                )
        elif after is not None and not isinstance(after, Transition):
            ends = ((part.curvature_1pm, part.cross_slope_m) for part in (element, after))
            if len(set(ends)) > 1:
                raise InputError(
                    "curvature or cant steps between two elements",
                    field=f"segment[{i + 1}]",
                    value=after,
                    remedy="put a transition between them",
                    limit="neighbours that meet in curvature and cant",
                )


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
