"""The design track: position, angles and Darboux curvatures at any place, in closed form.

A `TrackDesign` is what the track's drawing says: straights, clothoids and arcs with cant, gradients
joined by vertical curves. An estimator may know it. Irregularities are not part of it: see
`simrail.track.irregularity` and `simrail.track.laid_track`.

Conventions (`estimators/EQUATIONS.md`, section 0): X forward in the direction of increasing s,
Y left, Z up; ZYX Euler angles, pitch positive nose down, roll positive left side up; s is the arc
length of the horizontal projection of the centreline.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix
from simrail.core.shown import Facts, Shown, names
from simrail.track.alignment import Plan, build_cant, build_plan, cant_of_stations, element_starts
from simrail.track.deviation import Deviation
from simrail.track.elements import (
    CURVE,
    RAIL_BASE_M,
    STRAIGHT,
    TRANSITION,
    CantStation,
    ChainageBreak,
    Curve,
    Element,
    Gradient,
    Straight,
    Transition,
    element_from_dict,
    element_to_dict,
    require_number,
)
from simrail.track.frame_kernel import (
    CANT_TERMS,
    DK1,
    HEIGHT_TERMS,
    K1,
    RISE,
    ROLL1,
    ROLL2,
    SINE,
    SLOPE,
    YAW_ANGLE,
    Pieces,
    evaluate,
    polynomial_terms,
)
from simrail.track.joints import check_elements, check_stations
from simrail.track.vertical import build_vertical, check_gradients

__all__ = [
    "CURVE",
    "NO_MAP",
    "STRAIGHT",
    "TRANSITION",
    "CantStation",
    "ChainageBreak",
    "Curve",
    "Element",
    "Gradient",
    "Straight",
    "TrackDesign",
    "TrackFrame",
    "Transition",
]


RAIL_BASE_LIMITS_M = (0.05, 2.0)
"""From a model railway to a track of 1880 mm: beyond lies a wrong unit."""


class TrackFrame(NamedTuple):
    """The design track frame at places s; every array has the shape of s, vectors a last axis of 3.

    Attributes
    ----------
    s_m : ndarray (...)
        Arc length of the horizontal projection.
    position : ndarray (..., 3)
        Centreline in the rail plane, global, m; of no rows if it was not wanted.
    roll_rad, pitch_rad, yaw_rad : ndarray (...)
        ZYX Euler angles of the track frame; yaw is unwrapped.
    rates, second : ndarray (..., 3)
        First and second derivative of (roll, pitch, yaw) with respect to s, rad/m and rad/m^2.
    k, dk : ndarray (..., 3)
        Darboux vector (twist, vertical, horizontal) in the track frame, rad/m, and its derivative with
        respect to s: the frame that moves at V = ds/dt turns at V k.

    At a joint, derivatives that step have the value of what begins there; the impulse in `dk` where a
    linear cant ramp or a bare parabola makes `k` step is left out.
    """

    s_m: FloatArray
    position: FloatArray
    roll_rad: FloatArray
    pitch_rad: FloatArray
    yaw_rad: FloatArray
    rates: FloatArray
    second: FloatArray
    k: FloatArray
    dk: FloatArray

    @property
    def rotation(self) -> FloatArray:
        """From the axes of the frame to the global ones, (n, 3, 3) at n places."""
        return rotation_matrix(np.column_stack([self.roll_rad, self.pitch_rad, self.yaw_rad]))


class _Shape(NamedTuple):
    """Piecewise polynomials of a design, made once and kept; what it deviates by is in `pieces` alone."""

    starts_m: FloatArray
    plan: Plan
    cant: PPoly
    height: PPoly
    pieces: Pieces


@dataclass(frozen=True, repr=False)
class TrackDesign(Shown):
    """A design track.

    Attributes
    ----------
    name : str
        Name of the track.
    start_m : float
        s at the start of the first element.
    elements : tuple of Straight, Curve, Transition
        The plan, in the order of s. A transition joins its neighbours, or has ends of its own; without one,
        curvature and cant may not step.
    gradients : tuple of Gradient
        In the order of s; level before the first.
    vertical_radius_m : float or tuple of float
        Radius of the vertical curves: one for all, or one per change of gradient.
    vertical_ramp_m : float
        Length over which the bend of a vertical curve rises and falls; 0 for bare parabolas, whose
        pitch rate steps.
    cant_ramp : str
        ``"smooth"`` (quintic) or ``"linear"``.
    rail_base_m : float
        Lateral distance of the two running tables: cant and cross-level are heights over it.
    source : str
        Where the design comes from.
    synthetic : bool
        True if it is made up, in whole or in part.
    start_position_m : tuple of float
        Global x, y, z at `start_m`.
    start_yaw_rad : float
        Yaw at `start_m`.
    deviation : Deviation, optional
        Cant and height that are added to those of the elements and gradients.
    cant_stations : tuple of CantStation
        Cant beside the plan, in the order of s, in the place of that of the elements; linear between, level
        before the first and after the last.
    step_smoothing_m : float
        Length over which curvature and cant rise where they step, centred on the step; 0 refuses steps.
    chainage_breaks : tuple of ChainageBreak
        Where the kilometre posts jump, in the order of s: see `chainage_m`.
    """

    name: str
    start_m: float
    elements: tuple[Element, ...]
    gradients: tuple[Gradient, ...] = ()
    vertical_radius_m: float | tuple[float, ...] = 2000.0
    vertical_ramp_m: float = 5.0
    cant_ramp: str = "smooth"
    rail_base_m: float = RAIL_BASE_M
    source: str = ""
    synthetic: bool = False
    start_position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_yaw_rad: float = 0.0
    deviation: Deviation | None = None
    cant_stations: tuple[CantStation, ...] = ()
    step_smoothing_m: float = 0.0
    chainage_breaks: tuple[ChainageBreak, ...] = ()

    @property
    def is_map(self) -> bool:
        """Whether there is a line: false for `NO_MAP` alone, since every file has a segment."""
        return self != NO_MAP

    def _facts(self) -> Facts:
        curves = [element for element in self.elements if isinstance(element, Curve)]
        radii = sorted({abs(curve.radius_m) for curve in curves})
        cants = [abs(curve.cant_m) * 1000.0 for curve in curves]
        slopes = [1000.0 * gradient.slope for gradient in self.gradients] or [0.0]
        bends = f"{len(curves)}, R {names(f'{radius:g}' for radius in radii)} m"
        facts = {
            "way": f"{self.length_m:,.0f} m, from s = {self.start_m:g} m",
            "curves": bends if curves else "none: straight",
            "cant": f"up to {max(cants, default=0.0):.0f} mm over {self.rail_base_m:g} m",
            "gradient": f"{min(slopes):g} to {max(slopes):g} per mille" if any(slopes) else "level",
            "source": ("synthetic; " if self.synthetic else "") + (self.source or "not said"),
        }
        return self.name, facts

    @property
    def length_m(self) -> float:
        """Length of the horizontal projection."""
        return self.end_m - self.start_m

    @cached_property
    def end_m(self) -> float:
        """S at the end of the last element."""
        return float(element_starts(self.elements, self.start_m)[-1])

    def check(self) -> None:
        """Refuse a design that makes no line; every other method does so on its first use.

        Raises
        ------
        InputError
            Naming the element or gradient, the value and the limit.
        """
        _ = self._shape

    @cached_property
    def _shape(self) -> _Shape:
        if not self.is_map:
            raise InputError(
                "the method needs a map of the track, and the ride names none",
                field="track",
                limit="a ride with a map of its track",
                remedy='name one in the ride file, e.g. track = "./my_line.toml" (simrail new track), or '
                "choose a method that needs none",
            )
        require_number(self.start_m, "start_m")
        require_number(self.vertical_ramp_m, "vertical_ramp_m", least=0.0)
        if self.cant_ramp not in ("smooth", "linear"):
            raise InputError("is unknown", field="cant_ramp", value=self.cant_ramp, limit="smooth or linear")
        if not RAIL_BASE_LIMITS_M[0] <= self.rail_base_m <= RAIL_BASE_LIMITS_M[1]:
            low, high = RAIL_BASE_LIMITS_M
            raise InputError(
                "is out of range", field="rail_base_m", value=self.rail_base_m, limit=f"{low:g} to {high:g} m"
            )
        check_elements(
            self.elements,
            rail_base_m=self.rail_base_m,
            step_smoothing_m=self.step_smoothing_m,
            has_stations=bool(self.cant_stations),
        )
        check_stations(self.cant_stations, rail_base_m=self.rail_base_m)
        before = -np.inf
        for i, mark in enumerate(self.chainage_breaks):
            require_number(mark.at_m, f"chainage_break[{i}].at_m", above=before)
            require_number(mark.ahead_m, f"chainage_break[{i}].ahead_m")
            before = mark.at_m
        check_gradients(self.gradients, end_m=self.end_m)
        if self.deviation is not None:
            self.deviation.check()
        x, y, z = self.start_position_m
        smoothing = self.step_smoothing_m
        plan = build_plan(
            self.elements,
            self.start_m,
            position_m=(x, y),
            yaw_rad=self.start_yaw_rad,
            step_smoothing_m=smoothing,
        )
        if self.cant_stations:
            cant = cant_of_stations(self.cant_stations, self.start_m, self.end_m)
        else:
            cant = build_cant(self.elements, self.start_m, ramp=self.cant_ramp, step_smoothing_m=smoothing)
        height = build_vertical(
            self.gradients,
            self.start_m,
            end_m=self.end_m,
            radius_m=self.vertical_radius_m,
            ramp_m=self.vertical_ramp_m,
            height_m=z,
        )
        return _Shape(
            element_starts(self.elements, self.start_m), plan, cant, height, self._pieces(plan, cant, height)
        )

    def _pieces(self, plan: Plan, cant: PPoly, height: PPoly) -> Pieces:
        """Yaw, sine of roll and height about the joints of all of them."""
        joints = [plan.start_m, cant.x[:-1], height.x[:-1]]
        if self.deviation is not None:
            joints.append(self.deviation.joints_m)
        starts = np.unique(np.concatenate(joints))
        yaw, curvature, rate = plan.state(starts)
        sine, rise = (
            polynomial_terms(cant, starts, CANT_TERMS),
            polynomial_terms(height, starts, HEIGHT_TERMS),
        )
        if self.deviation is not None:
            sine += self.deviation.cant_terms(starts, CANT_TERMS)
            rise += self.deviation.height_terms(starts, HEIGHT_TERMS)
        terms = np.column_stack([yaw, curvature, 0.5 * rate, sine / self.rail_base_m, rise])
        return Pieces(starts, np.ascontiguousarray(terms))

    @property
    def pieces(self) -> Pieces:
        """The polynomials that it is made of, for kernels that take no frame."""
        return self._shape.pieces

    def frame(self, s: npt.ArrayLike, *, places: bool = True) -> TrackFrame:
        """Track frame at places s.

        Parameters
        ----------
        s : array_like (...)
            Places in [start_m, end_m], m.
        places : bool
            False leaves out the coordinates, which take as long as all the rest: `position` has no rows.

        Raises
        ------
        InputError
            If a place is off the track or not a number.
        """
        return self.frame_extended(self.on_track(s), places=places)

    def frame_extended(self, s: npt.ArrayLike, *, places: bool = True) -> TrackFrame:
        """Like `frame`, but the first and the last element go on beyond the ends of the track."""
        s = np.asarray(s, dtype=float)
        shape = self._shape
        rows = evaluate(shape.pieces, s.ravel())
        angles = np.arcsin(rows[SINE]), -np.arctan(rows[SLOPE]), rows[YAW_ANGLE]
        position = np.empty((0, 3))
        if places:
            position = _stack(*shape.plan.xy(s), rows[RISE].reshape(s.shape))
        vectors = (
            np.moveaxis(rows[first : first + 3].reshape(3, *s.shape), 0, -1)
            for first in (ROLL1, ROLL2, K1, DK1)
        )
        return TrackFrame(s, position, *(angle.reshape(s.shape) for angle in angles), *vectors)

    def curvature(self, s: npt.ArrayLike) -> FloatArray:
        """Plan curvature d yaw / ds at places s, 1/m, positive to the left; shaped like s."""
        return self._shape.plan.state(self.on_track(s))[1]

    def chainage_m(self, s: npt.ArrayLike) -> FloatArray:
        """What the kilometre posts say at places s, m; at a break what begins there; shaped like s."""
        places = self.on_track(s)
        if not self.chainage_breaks:
            return places
        starts = np.array([mark.at_m for mark in self.chainage_breaks])
        shifts = np.array([0.0, *(mark.ahead_m - mark.at_m for mark in self.chainage_breaks)])
        return np.asarray(places + shifts[np.searchsorted(starts, places, side="right")])

    def segment(self, s: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Index of the element at places s; at a joint, of the one that begins there."""
        starts = self._shape.starts_m
        index = np.searchsorted(starts, self.on_track(s), side="right") - 1
        return np.minimum(index, len(self.elements) - 1)

    def kind(self, s: npt.ArrayLike) -> npt.NDArray[np.int8]:
        """`STRAIGHT`, `TRANSITION` or `CURVE` at places s; shaped like s."""
        return np.array([element.kind for element in self.elements], dtype=np.int8)[self.segment(s)]

    def segment_name(self, index: int) -> str:
        """Name of an element, e.g. ``"curve 4 R-250"``: its kind, number from 1, and radius."""
        element = self.elements[index]
        radius = f" R{element.radius_m:g}" if isinstance(element, Curve) else ""
        return f"{element.word} {index + 1}{radius}"

    def to_dict(self) -> dict[str, Any]:
        """Plain data (str, float, bool, list, tuple, dict); `from_dict` returns an equal design."""
        data = asdict(self)
        data["elements"] = [element_to_dict(element) for element in self.elements]
        return data

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> TrackDesign:
        """Design from the plain data that `to_dict` makes, e.g. after a way through JSON."""
        values = dict(data)
        values["elements"] = tuple(element_from_dict(element) for element in data["elements"])
        values["gradients"] = tuple(Gradient(**gradient) for gradient in data["gradients"])
        stations = data.get("cant_stations", ())
        values["cant_stations"] = tuple(CantStation(**station) for station in stations)
        marks = data.get("chainage_breaks", ())
        values["chainage_breaks"] = tuple(ChainageBreak(**mark) for mark in marks)
        values["start_position_m"] = tuple(data["start_position_m"])
        if isinstance(data["vertical_radius_m"], list):
            values["vertical_radius_m"] = tuple(data["vertical_radius_m"])
        if data.get("deviation") is not None:
            beside = data["deviation"]
            rows = tuple(beside["cant_m"]), tuple(beside["height_m"])
            values["deviation"] = Deviation(beside["from_m"], beside["step_m"], *rows)
        return cls(**values)

    def on_track(self, s: npt.ArrayLike) -> FloatArray:
        """The places s as an array of floats; refused with an `InputError` if one is off the track."""
        s = np.asarray(s, dtype=float)
        if not self.is_map:
            _ = self._shape
        off = ~((s >= self.start_m) & (s <= self.end_m))  # also true for NaN
        if off.any():
            first = float(s[off].flat[0])
            raise InputError(
                f"s = {first:g} m is not on track '{self.name}'",
                field="s",
                value=first,
                limit=f"between {self.start_m:g} and {self.end_m:g} m",
                remedy="shorten the ride or lengthen the track",
            )
        return s


NO_MAP = TrackDesign("no map", 0.0, ())
"""What a ride has in the place of a map if it names no track: whoever asks it for the line is refused."""


def _stack(*parts: FloatArray) -> FloatArray:
    """Join arrays of the same or broadcastable shape along a new last axis."""
    return np.stack(np.broadcast_arrays(*parts), axis=-1)
