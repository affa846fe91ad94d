"""Track files: one TOML file per track, in the units and signs of a track drawing.

`TrackFile` judges the text and makes a `TrackDesign`. Units differ from those inside: cant in mm, gradients
in permil. Signs do not: radius positive to the left, cant positive with the outer rail raised, gradient
positive uphill in the direction of s.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, load, toml_text
from simrail.track.design import (
    RAIL_BASE_LIMITS_M,
    Curve,
    Element,
    Gradient,
    Straight,
    TrackDesign,
    Transition,
)
from simrail.track.deviation import Deviation

Length = Annotated[float, Field(gt=0.0)]

_SHARED = (
    *("source", "synthetic", "start_m", "start_position_m", "start_yaw_rad"),
    *("cant_ramp", "vertical_radius_m", "vertical_ramp_m"),
)
"""Fields that file and design share, in the order in which a file is written."""


class SegmentPart(Part):
    """``[[segment]]``: a straight, a curve, or a transition that joins its two neighbours."""

    kind: Literal["straight", "transition", "curve"]
    length_m: Length
    radius_m: float | None = None
    cant_mm: float | None = None

    @model_validator(mode="after")
    def _radius_and_cant_of_curves_only(self) -> Self:
        if self.kind == "curve" and self.radius_m is None:
            raise InputError(
                "a curve needs its radius",
                field="radius_m",
                remedy="add it; positive to the left",
                limit="not 0 m",
            )
        for field in ("radius_m", "cant_mm"):
            if self.kind != "curve" and getattr(self, field) is not None:
                raise InputError(
                    "belongs to a curve",
                    field=field,
                    value=getattr(self, field),
                    remedy=f"remove it: a {self.kind} takes it from its neighbours"
                    if self.kind == "transition"
                    else "remove it, or make the segment a curve",
                    limit="a curve",
                )
        return self

    def element(self) -> Element:
        """The element that it describes."""
        if self.kind == "straight":
            return Straight(self.length_m)
        if self.radius_m is None:
            return Transition(self.length_m)
        return Curve(self.length_m, self.radius_m, (self.cant_mm or 0.0) / 1000.0)


class GradientPart(Part):
    """``[[gradient]]``: holds from a place on."""

    from_m: float
    permil: float

    def gradient(self) -> Gradient:
        """The gradient that it describes."""
        return Gradient(self.from_m, self.permil / 1000.0)


class DeviationPart(Part):
    """``[deviation]``: cant and height beside those of segments and gradients, at equal steps along the line.

    A map that was surveyed has one; a drawing has none. See `simrail.track.deviation`.
    """

    from_m: float
    step_m: Length
    cant_mm: tuple[float, ...]
    height_mm: tuple[float, ...]

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
    cant_ramp, vertical_radius_m, vertical_ramp_m
        As in `TrackDesign`.
    rail_base_mm : float
        Lateral distance of the running tables, which cant and cross-level are heights over; 1500 mm at normal
        gauge.
    segment, gradient : tuple
        The plan and the gradients, in the order of s.
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
    deviation: DeviationPart | None = None

    @model_validator(mode="after")
    def _makes_a_line(self) -> Self:
        self.design("").check()
        return self

    def design(self, name: str) -> TrackDesign:
        """The design that the file describes.

        Parameters
        ----------
        name : str
            What to call it if the file does not say; its stem.
        """
        return TrackDesign(
            name if self.name is None else self.name,
            elements=tuple(part.element() for part in self.segment),
            gradients=tuple(part.gradient() for part in self.gradient),
            rail_base_m=self.rail_base_mm / 1000.0,
            deviation=None if self.deviation is None else self.deviation.deviation(),
            **{field: getattr(self, field) for field in _SHARED},
        )


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
        "rail_base_mm": _thousandths(design.rail_base_m, "rail_base_mm"),
    }
    segments = []
    for i, element in enumerate(design.elements):
        segment: dict[str, object] = {"kind": element.word, "length_m": element.length_m}
        if isinstance(element, Curve):
            segment["radius_m"] = element.radius_m
            segment["cant_mm"] = _thousandths(element.cant_m, f"segment[{i}].cant_mm")
        segments.append(segment)
    gradients = [
        {"from_m": gradient.from_m, "permil": _thousandths(gradient.slope, f"gradient[{i}].permil")}
        for i, gradient in enumerate(design.gradients)
    ]
    tables: dict[str, object] = {"segment": segments, **({"gradient": gradients} if gradients else {})}
    if design.deviation is not None:
        beside = design.deviation
        tables["deviation"] = {
            "from_m": beside.from_m,
            "step_m": beside.step_m,
            "cant_mm": [_thousandths(value, "deviation.cant_mm") for value in beside.cant_m],
            "height_mm": [_thousandths(value, "deviation.height_mm") for value in beside.height_m],
        }
    return toml_text({**head, **tables})


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
