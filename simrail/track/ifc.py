"""Alignments from IFC 4.3: their business logic, read into what `simrail.track.drawn` takes.

Read are the segments of ``IfcAlignmentHorizontal`` (``LINE``, ``CIRCULARARC``, ``CLOTHOID`` with both radii),
``IfcAlignmentVertical`` (``CONSTANTGRADIENT``, ``PARABOLICARC``, ``CIRCULARARC``) and ``IfcAlignmentCant``
(``CONSTANTCANT``, ``LINEARTRANSITION``); other curves are refused by name. Radii are positive to the left, 0
is straight; distances count from the start of the plan, whose station a referent may say.

By the library ifcopenshell (LGPL, some 55 MB), an extra of its own: ``pip install 'simrail[ifc]'``. The form:
IFC 4.3.2 (ISO 16739-1:2024), the entities named above.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from simrail.core.errors import InputError, joined
from simrail.track.drawn import Drawn, Piece, Turn, add_cant, chosen_alignment, refuse_kink

PLAN = ("LINE", "CIRCULARARC", "CLOTHOID")
PROFILE = ("CONSTANTGRADIENT", "PARABOLICARC", "CIRCULARARC")
CANT = ("CONSTANTCANT", "LINEARTRANSITION")

SHORT_M = 1e-6
"""Segments of no length end each part of an alignment."""


def read_ifc(path: Path, *, alignment: str | None = None) -> Drawn:
    """One alignment of an IFC file.

    Parameters
    ----------
    path : Path
        The file.
    alignment : str, optional
        Name of the alignment; needed where there are several.

    Raises
    ------
    InputError
        If the library is missing, or the file is no IFC, has not that alignment, or holds what is not read.
    """
    library = _library()
    try:
        model = library.open(str(path))
    except Exception as error:  # the library has errors of many kinds
        raise InputError(
            f"is not readable IFC ({joined(error)[:80]})", limit="a whole IFC file", remedy="export it again"
        ) from None
    if not model.schema.startswith("IFC4X3"):
        raise InputError(
            "has no alignments with segments",
            field="FILE_SCHEMA",
            value=model.schema,
            limit="IFC4X3",
            remedy="export it as IFC 4.3, or as LandXML",
        )
    unit = importlib.import_module("ifcopenshell.util.unit").calculate_unit_scale(model)
    angle = _angle_unit(model)
    chosen = _alignment(model, alignment)
    name = chosen.Name or path.stem
    notes: list[str] = []
    parts = {part.is_a(): part for part in _nested(chosen)}
    drawn = Drawn(name, f"IFC {path.name}, alignment {name}", _station(chosen, unit), [], notes=notes)
    _plan(drawn, parts.get("IfcAlignmentHorizontal"), unit, angle)
    _cant(drawn, parts.get("IfcAlignmentCant"), unit)
    _profile(drawn, parts.get("IfcAlignmentVertical"), unit)
    if unit != 1.0:
        notes.append(f"lengths are in units of {unit:.9g} m")
    return drawn


def _library() -> Any:
    try:
        return importlib.import_module("ifcopenshell")
    except ImportError:
        raise InputError(
            "needs the library ifcopenshell, which is not installed",
            value=".ifc",
            limit="a kind of file whose library is installed",
            remedy="pip install 'simrail[ifc]', or export the alignment as LandXML",
        ) from None


def _angle_unit(model: Any) -> float:
    """Radians of the file's unit of plane angles."""
    found: float = importlib.import_module("ifcopenshell.util.unit").calculate_unit_scale(
        model, "PLANEANGLEUNIT"
    )
    return found


def _nested(item: Any) -> Iterator[Any]:
    """What nests in an item, in order."""
    for relation in item.IsNestedBy or ():
        yield from relation.RelatedObjects


def _alignment(model: Any, wanted: str | None) -> Any:
    found = model.by_type("IfcAlignment")
    names = [one.Name or one.GlobalId for one in found]
    return found[chosen_alignment(names, wanted, kind="IfcAlignment")]


def _station(alignment: Any, unit: float) -> float:
    """Station of the start, by the first referent that has one; 0 where none has."""
    for item in _nested(alignment):
        for relation in getattr(item, "IsDefinedBy", None) or () if item.is_a("IfcReferent") else ():
            definition = getattr(relation, "RelatingPropertyDefinition", None)
            for value in getattr(definition, "HasProperties", None) or ():
                if value.Name == "Station" and value.NominalValue is not None:
                    return unit * float(value.NominalValue.wrappedValue)
    return 0.0


def _segments(part: Any, known: tuple[str, ...], what: str) -> Iterator[tuple[str, Any]]:
    """Where each segment stands, and what it says; those of no length are left out."""
    for i, nested in enumerate(_nested(part)):
        said = nested.DesignParameters
        length = getattr(said, "SegmentLength", None)
        length = said.HorizontalLength if length is None else length
        if length <= SHORT_M:
            continue
        if said.PredefinedType not in known:
            raise InputError(
                "is a segment that is not read",
                field=f"{what}[{i}]",
                value=said.PredefinedType,
                limit=", ".join(known),
                remedy="give the line as a CSV of curvature and cant over distance instead",
            )
        yield f"{what}[{i}]", said


def _plan(drawn: Drawn, part: Any, unit: float, angle: float) -> None:
    """Pieces of the plan; directions of the file are held against what radii and lengths turn."""
    heading = None
    for where, said in _segments(part, PLAN, "IfcAlignmentHorizontal") if part is not None else ():
        length = unit * float(said.SegmentLength)
        bends = [
            0.0 if not radius else 1.0 / (unit * float(radius))
            for radius in (said.StartRadiusOfCurvature, said.EndRadiusOfCurvature)
        ]
        if said.PredefinedType == "LINE":
            bends = [0.0, 0.0]
        told = angle * float(said.StartDirection)
        if heading is None:
            drawn.start_yaw_rad = heading = told
        else:
            refuse_kink(
                told - heading,
                f"{where}.StartDirection",
                problem="the line has a kink, or a radius has the wrong sign",
                remedy="put an arc there, or mend the direction or the radius (positive to the left)",
            )
        heading += 0.5 * (bends[0] + bends[1]) * length
        drawn.pieces.append(Piece(length, bends[0], bends[1]))
    if not drawn.pieces:
        raise InputError("has no plan", field="IfcAlignmentHorizontal", limit="segments " + ", ".join(PLAN))


def _cant(drawn: Drawn, part: Any, unit: float) -> None:
    """Heights of the left rail over the right one, by stations."""
    if part is None:
        drawn.notes.append("the file has no cant for it")
        return
    drawn.rail_base_m = unit * float(part.RailHeadDistance)
    for _, said in _segments(part, CANT, "IfcAlignmentCant"):
        begin = drawn.start_m + unit * float(said.StartDistAlong)
        first = unit * (float(said.StartCantLeft) - float(said.StartCantRight))
        ends = [said.EndCantLeft, said.EndCantRight]
        last = first
        if said.PredefinedType == "LINEARTRANSITION" and None not in ends:
            last = unit * (float(ends[0]) - float(ends[1]))
        for at, level in ((begin, first), (begin + unit * float(said.HorizontalLength), last)):
            add_cant(drawn, at, level)


def _profile(drawn: Drawn, part: Any, unit: float) -> None:
    """Height and slope at the start, and the changes of gradient."""
    if part is None:
        drawn.notes.append("the file has no gradients for it: the line is level")
        return
    slope = None
    for where, said in _segments(part, PROFILE, "IfcAlignmentVertical"):
        first, last = float(said.StartGradient), float(said.EndGradient)
        if slope is None:
            drawn.slope, drawn.start_height_m = first, unit * float(said.StartHeight)
        elif abs(first - slope) > 1e-6:
            raise InputError(
                "the gradients do not meet",
                field=f"{where}.StartGradient",
                value=first,
                limit=f"{slope:g}, where the segment before ends",
                remedy="put an arc there, or mend the gradient",
            )
        slope = last
        if said.PredefinedType != "CONSTANTGRADIENT" and first != last:
            length = unit * float(said.HorizontalLength)
            middle = drawn.start_m + unit * float(said.StartDistAlong) + 0.5 * length
            drawn.turns.append(Turn(middle, last, length))
