"""Track files: one TOML file per track, in the units and signs of a track drawing.

`TrackFile` judges the text and makes a `TrackDesign`. Units differ from those inside: cant in mm, gradients
in permil. Signs do not: radius positive to the left, cant positive with the outer rail raised, gradient
positive uphill in the direction of s. On a straight no rail is the outer one: there a positive cant raises
the right rail, as in a curve to the left, unless ``raised`` says which.
"""

from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, load, toml_text
from simrail.track.design import (
    RAIL_BASE_LIMITS_M,
    CantStation,
    ChainageBreak,
    Curve,
    Element,
    Gradient,
    Straight,
    TrackDesign,
    Transition,
)
from simrail.track.deviation import Deviation
from simrail.track.elements import cross_slope
from simrail.track.joints import EVEN_1PM

Length = Annotated[float, Field(gt=0.0)]
Radius = Annotated[float, Field(allow_inf_nan=True)]
Side = Literal["left", "right"]

_SHARED = (
    *("source", "synthetic", "start_m", "start_position_m", "start_yaw_rad"),
    *("cant_ramp", "vertical_radius_m", "vertical_ramp_m", "step_smoothing_m"),
)
"""Fields that file and design share, in the order in which a file is written."""


_TAKEN = "its neighbours, or from start_radius_m, end_radius_m, start_cant_mm, end_cant_mm of its own"


class SegmentPart(Part):
    """``[[segment]]``: a straight, a curve, or a transition that joins its two neighbours.

    Attributes
    ----------
    kind : str
        ``straight``, ``transition`` or ``curve``.
    length_m : float
        Length of the horizontal projection.
    radius_m : float
        Of a curve, positive to the left.
    cant_mm : float
        Of a curve or a straight, positive with the outer rail raised; on a straight with the right one.
    raised : str
        Which rail a straight has raised, ``left`` or ``right``.
    start_radius_m, end_radius_m : float
        Of a transition that begins or ends otherwise than its neighbour says, `inf` where it is straight.
    start_cant_mm, end_cant_mm : float
        Cant at such an end.
    """

    kind: Literal["straight", "transition", "curve"]
    length_m: Length
    radius_m: float | None = None
    cant_mm: float | None = None
    raised: Side | None = None
    start_radius_m: Radius | None = None
    end_radius_m: Radius | None = None
    start_cant_mm: float | None = None
    end_cant_mm: float | None = None

    @model_validator(mode="after")
    def _fields_of_the_kind(self) -> Self:
        if self.kind == "curve" and self.radius_m is None:
            raise InputError(
                "a curve needs its radius",
                field="radius_m",
                remedy="add it; positive to the left",
                limit="not 0 m",
            )
        for field, kinds in _KINDS_OF.items():
            if getattr(self, field) is not None and self.kind not in kinds:
                raise InputError(
                    "belongs to a " + " or a ".join(kinds),
                    field=field,
                    value=getattr(self, field),
                    limit="only in a " + " or a ".join(kinds),
                    remedy=f"remove it: a transition takes it from {_TAKEN}"
                    if self.kind == "transition"
                    else f"remove it, or make the segment a {kinds[0]}",
                )
        if self.raised is not None and not (self.cant_mm or 0.0) > 0.0:
            raise InputError(
                "needs a positive cant beside it", field="cant_mm", value=self.cant_mm, limit="> 0 mm"
            )
        return self

    def element(self) -> Element:
        """The element that it describes."""
        cant_m = (self.cant_mm or 0.0) / 1000.0
        if self.kind == "straight":
            return Straight(self.length_m, -cant_m if self.raised == "left" else cant_m)
        if self.radius_m is None:
            cants = (
                None if cant is None else cant / 1000.0 for cant in (self.start_cant_mm, self.end_cant_mm)
            )
            return Transition(self.length_m, self.start_radius_m, self.end_radius_m, *cants)
        return Curve(self.length_m, self.radius_m, cant_m)


_KINDS_OF = {
    "radius_m": ("curve",),
    "cant_mm": ("curve", "straight"),
    "raised": ("straight",),
    **dict.fromkeys(("start_radius_m", "end_radius_m", "start_cant_mm", "end_cant_mm"), ("transition",)),
}
"""Field of a segment -> kinds that have it."""


class CantPart(Part):
    """``[[cant]]``: cant at a place, beside the plan, linear from one to the next.

    Attributes
    ----------
    at_m : float
        Where it is, s along the track; ``from_m`` says the same.
    mm : float
        Positive with the outer rail raised; where the plan is straight, with the right one.
    raised : str
        Which rail is raised, ``left`` or ``right``, whatever the plan is.
    """

    at_m: float
    mm: float
    raised: Side | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_or_at(cls, data: object) -> object:
        if isinstance(data, dict) and "from_m" in data and "at_m" not in data:
            return {("at_m" if key == "from_m" else key): value for key, value in data.items()}
        return data

    @model_validator(mode="after")
    def _raised_is_positive(self) -> Self:
        if self.raised is not None and self.mm < 0.0:
            raise InputError("is not negative beside raised", field="mm", value=self.mm, limit=">= 0 mm")
        return self

    def station(self, curvature_1pm: float) -> CantStation:
        """The station that it describes, on a plan of this curvature there."""
        cant = self.mm / 1000.0
        if self.raised is not None:
            return CantStation(self.at_m, cant if self.raised == "left" else -cant)
        return CantStation(self.at_m, cross_slope(cant, curvature_1pm))


class GradientPart(Part):
    """``[[gradient]]``: holds from a place on."""

    from_m: float
    """Where it begins, s along the track, m."""
    permil: float
    """Slope, per mille, positive uphill."""

    def gradient(self) -> Gradient:
        """The gradient that it describes."""
        return Gradient(self.from_m, self.permil / 1000.0)


class ChainageBreakPart(Part):
    """``[[chainage_break]]``: a place where the kilometre posts jump."""

    at_m: float
    """Where it is, s along the track, m."""
    ahead_m: float
    """Chainage that begins there, m; before the first break chainage is s."""


class DeviationPart(Part):
    """``[deviation]``: cant and height beside those of segments and gradients, at equal steps along the line.

    A map that was surveyed has one; a drawing has none. See `simrail.track.deviation`.
    """

    from_m: float
    """Where the first value stands, s along the track, m."""
    step_m: Length
    """Distance of the values, m."""
    cant_mm: tuple[float, ...]
    """Added to the cant, mm."""
    height_mm: tuple[float, ...]
    """Added to the height, mm."""

    def deviation(self) -> Deviation:
        """The deviation that it describes."""
        cant, height = (tuple(value / 1000.0 for value in row) for row in (self.cant_mm, self.height_mm))
        return Deviation(self.from_m, self.step_m, cant, height)


class TrackFile(Part):
    """A track file.

    Attributes
    ----------
    title, source : str
        One line each: what it is, and where its numbers come from.
    name : str, optional
        What to call the track; the stem of the file where left out.
    synthetic : bool
        True if the numbers are made up, in whole or in part; tables and reports then say so.
    start_m : float
        s at the start of the first segment.
    start_position_m, start_yaw_rad
        Global place and heading there, as in `TrackDesign`.
    cant_ramp : str
        How cant rises in a transition: ``"smooth"`` (quintic) or ``"linear"``.
    vertical_radius_m : float or list of float
        Radius of the vertical curves, m: one for all, or one for each change of gradient.
    vertical_ramp_m : float
        Length over which the bend of a vertical curve rises and falls, m; 0 for bare parabolas.
    rail_base_mm : float
        Lateral distance of the running tables, which cant and cross-level are heights over; 1500 mm at normal
        gauge.
    segment, gradient : tuple
        The plan and the gradients, in the order of s.
    cant : tuple
        Cant by stations beside the plan, in the order of s; then no segment has any.
    step_smoothing_m : float
        Length over which curvature and cant rise where they step, about that of a vehicle's base; a track
        whose curvature or cant steps needs it.
    chainage_break : tuple
        Where the kilometre posts jump, in the order of s; s itself goes on.
    deviation : DeviationPart, optional
        What is added to them.
    """

    title: str
    source: str
    synthetic: bool
    name: str | None = None
    start_m: float = 0.0
    start_position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_yaw_rad: float = 0.0
    cant_ramp: Literal["smooth", "linear"] = "smooth"
    vertical_radius_m: float | tuple[float, ...] = 2000.0
    vertical_ramp_m: float = Field(default=5.0, ge=0.0)
    rail_base_mm: float = Field(
        default=1500.0, ge=1000.0 * RAIL_BASE_LIMITS_M[0], le=1000.0 * RAIL_BASE_LIMITS_M[1]
    )
    segment: tuple[SegmentPart, ...] = Field(min_length=1)
    gradient: tuple[GradientPart, ...] = ()
    cant: tuple[CantPart, ...] = ()
    step_smoothing_m: float = Field(default=0.0, ge=0.0)
    chainage_break: tuple[ChainageBreakPart, ...] = ()
    deviation: DeviationPart | None = None

    @model_validator(mode="after")
    def _makes_a_line(self) -> Self:
        design = self.design("")
        design.check()
        self._refuse_doubtful_sides(design)
        return self

    def _refuse_doubtful_sides(self, design: TrackDesign) -> None:
        """Refuse cant on a straight that nothing says the side of, beside one of the other side."""
        levels: list[tuple[str, float, bool]] = []
        for i, (station, part) in enumerate(zip(design.cant_stations, self.cant, strict=True)):
            straight = part.raised is None and abs(_curvature(design, station.at_m)) < EVEN_1PM
            levels.append((f"cant[{i}]", station.cross_slope_m, straight))
        for i, (element, segment) in enumerate(zip(design.elements, self.segment, strict=True)):
            if not isinstance(element, Transition) and not self.cant:
                unsaid = isinstance(element, Straight) and segment.raised is None
                levels.append((f"segment[{i}]", element.cross_slope_m, unsaid))
        for before, after in pairwise(levels):
            doubtful = [place for place, _, unsaid in (before, after) if unsaid]
            if doubtful and before[1] * after[1] < 0.0:
                raise InputError(
                    "the cant changes sides beside a straight, and nothing says which rail that has raised",
                    field=f"{doubtful[0]}.raised",
                    limit="left or right",
                    remedy='add it: raised = "left" or "right", with a positive cant; without it the right '
                    "rail of a straight is raised",
                )

    def design(self, name: str) -> TrackDesign:
        """The design that the file describes.

        Parameters
        ----------
        name : str
            What to call it if the file does not say; its stem.
        """
        design = TrackDesign(
            name if self.name is None else self.name,
            elements=tuple(part.element() for part in self.segment),
            gradients=tuple(part.gradient() for part in self.gradient),
            rail_base_m=self.rail_base_mm / 1000.0,
            chainage_breaks=tuple(ChainageBreak(mark.at_m, mark.ahead_m) for mark in self.chainage_break),
            deviation=None if self.deviation is None else self.deviation.deviation(),
            **{field: getattr(self, field) for field in _SHARED},
        )
        if not self.cant:
            return design
        stations = tuple(part.station(_curvature(design, part.at_m)) for part in self.cant)
        return replace(design, cant_stations=stations)


def _curvature(design: TrackDesign, place_m: float) -> float:
    """Curvature of the plan at a place, 0 beyond its ends."""
    if not design.start_m <= place_m <= design.end_m:
        return 0.0
    bend = float(design.curvature(place_m))
    return bend if abs(bend) >= EVEN_1PM else 0.0


def track_by_name(name: str) -> TrackDesign:
    """Design of a shipped track, or of a file given by its path.

    Raises
    ------
    InputError
        If there is no such file, or it describes no track.
    """
    return load(TrackFile, "track", name).design(Path(name).stem)


def track_text(design: TrackDesign) -> str:
    """Track file of a design, which reads back as an equal one, bit by bit.

    Raises
    ------
    InputError
        If a cant or a gradient is a number that no decimal in mm or permil gives exactly, as one in some
        forty random ones is; every track that was read from a file has one.
    """
    head = {
        "title": f"Track {design.name}",
        "name": design.name,
        **{field: getattr(design, field) for field in _SHARED},
        # A line without steps needs no word of them.
        "step_smoothing_m": design.step_smoothing_m or None,
        "rail_base_mm": _thousandths(design.rail_base_m, "rail_base_mm"),
    }
    segments = [_segment(element, f"segment[{i}]") for i, element in enumerate(design.elements)]
    gradients = [
        {"from_m": gradient.from_m, "permil": _thousandths(gradient.slope, f"gradient[{i}].permil")}
        for i, gradient in enumerate(design.gradients)
    ]
    tables: dict[str, object] = {"segment": segments, **({"gradient": gradients} if gradients else {})}
    if design.cant_stations:
        tables["cant"] = [
            {
                "at_m": station.at_m,
                "mm": _thousandths(abs(station.cross_slope_m), f"cant[{i}].mm"),
                "raised": "left" if station.cross_slope_m > 0.0 else "right",
            }
            for i, station in enumerate(design.cant_stations)
        ]
    if design.chainage_breaks:
        tables["chainage_break"] = [asdict(mark) for mark in design.chainage_breaks]
    if design.deviation is not None:
        beside = design.deviation
        tables["deviation"] = {
            "from_m": beside.from_m,
            "step_m": beside.step_m,
            "cant_mm": [_thousandths(value, "deviation.cant_mm") for value in beside.cant_m],
            "height_mm": [_thousandths(value, "deviation.height_mm") for value in beside.height_m],
        }
    return toml_text({**head, **tables})


def _segment(element: Element, here: str) -> dict[str, object]:
    """Table of an element."""
    segment: dict[str, object] = {"kind": element.word, "length_m": element.length_m}
    if isinstance(element, Curve):
        segment["radius_m"] = element.radius_m
        segment["cant_mm"] = _thousandths(element.cant_m, f"{here}.cant_mm")
    elif isinstance(element, Straight) and element.cant_m:
        segment["cant_mm"] = _thousandths(abs(element.cant_m), f"{here}.cant_mm")
        segment["raised"] = "left" if element.cant_m < 0.0 else "right"
    elif isinstance(element, Transition):
        for end in ("start", "end"):
            radius, cant = (getattr(element, f"{end}_{what}_m") for what in ("radius", "cant"))
            if radius is not None:
                segment[f"{end}_radius_m"] = radius
            if cant is not None:
                segment[f"{end}_cant_mm"] = _thousandths(cant, f"{here}.{end}_cant_mm")
    return segment


def _thousandths(value: float, field: str) -> float:
    """The number that divided by 1000 gives a value exactly."""
    middle = value * 1000.0
    for candidate in (round(middle, 9), middle):
        if candidate / 1000.0 == value:
            return candidate
    raise InputError(
        "is a number that no decimal in mm or permil gives exactly",
        field=field,
        value=value,
        remedy=f"take {middle!r} / 1000 instead: it differs in the last of its 53 bits",
        limit="a decimal in mm or permil",
    )
