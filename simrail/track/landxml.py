"""Alignments from LandXML 1.x: what designers of lines hand over, read into what `simrail.track.drawn` takes.

Read are ``CoordGeom`` (``Line``, ``Curve``, ``Spiral`` of type clothoid), the first ``ProfAlign`` of
``Profile`` (``PVI``, ``ParaCurve``, ``CircCurve``), the stations of ``Cant``, and ``StaEquation``. Lengths
and radii make the line; coordinates ("northing easting", x east and y north here) give its heading at the
start, and what lengths and radii say is held against them. Other spirals, chains and irregular lines are
refused by name. The form was learnt from public files, above all tests/AL01 and tests/STN01 of
github.com/buildingSMART/IFC4.x-IF.

The parser is that of Python's own library: of a file without a document type it needs no more.
"""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from simrail.core.errors import InputError
from simrail.track.drawn import Drawn, Piece, Turn, add_cant, chosen_alignment, refuse_kink

_UNITS_M = {
    "meter": 1.0,
    "metre": 1.0,
    "kilometer": 1000.0,
    "decimeter": 0.1,
    "centimeter": 0.01,
    "millimeter": 0.001,
    "foot": 0.3048,
    "ussurveyfoot": 1200.0 / 3937.0,
    "inch": 0.0254,
    "mile": 1609.344,
}
_NORMAL_GAUGE_M = (1.40, 1.52)
"""Gauges whose cant is over 1500 mm, from one rail's middle to the other's, also where that is so called."""
_HEAD_M = 0.065
"""Width of a rail's head, which the rail base of other gauges has more than the gauge."""


class _Part(NamedTuple):
    """An element of the plan, lengths in m; ends as (x, y) and directions where the file has coordinates."""

    kind: str
    piece: Piece
    start: complex | None
    end: complex | None
    start_rad: float | None
    end_rad: float | None


def read_landxml(path: Path, *, alignment: str | None = None) -> Drawn:
    """One alignment of a LandXML file.

    Parameters
    ----------
    path : Path
        The file.
    alignment : str, optional
        Name of the alignment; needed where there are several.

    Raises
    ------
    InputError
        If the file is no LandXML, has not that alignment, or holds what is not read.
    """
    root = _root(path)
    unit, inches = _unit(root)
    chosen = _alignment(root, alignment)
    name = chosen.get("name") or path.stem
    notes: list[str] = []
    parts = _plan(chosen, unit)
    start_m = unit * _float(chosen, "staStart", default=0.0)
    drawn = Drawn(
        name, f"LandXML {path.name}, alignment {name}", start_m, [p.piece for p in parts], notes=notes
    )
    if unit != 1.0:
        notes.append(f"lengths are in units of {unit:.9g} m")
    _place(drawn, parts)
    _cant(drawn, chosen, unit, inches=inches)
    _profile(drawn, chosen, unit)
    _breaks(drawn, chosen, unit)
    return drawn


def _root(path: Path) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        raise InputError(
            f"is not readable XML ({error})", limit="well-formed XML", remedy="export the file again"
        ) from None
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", limit="a file that can be read") from None
    if _tag(root) != "LandXML":
        raise InputError("is no LandXML", value=_tag(root), limit="a root element LandXML")
    return root


def _tag(element: ET.Element) -> str:
    return element.tag.rsplit("}", 1)[-1]


def _children(element: ET.Element, *names: str) -> list[ET.Element]:
    return [child for child in element if _tag(child) in names]


def _unit(root: ET.Element) -> tuple[float, bool]:
    """Metres of the file's unit of length, and whether it is an imperial one."""
    for units in _children(root, "Units"):
        for system in units:
            word = system.get("linearUnit", "meter" if _tag(system) == "Metric" else "foot")
            if word.lower() not in _UNITS_M:
                limit = "one of " + ", ".join(_UNITS_M)
                raise InputError("is no unit of length", field="Units.linearUnit", value=word, limit=limit)
            return _UNITS_M[word.lower()], _tag(system) == "Imperial"
    return 1.0, False


def _alignment(root: ET.Element, wanted: str | None) -> ET.Element:
    found = [one for group in _children(root, "Alignments") for one in _children(group, "Alignment")]
    names = [one.get("name", "") for one in found]
    return found[chosen_alignment(names, wanted, kind="Alignment")]


def _float(element: ET.Element, key: str, *, default: float | None = None) -> float:
    """A number of an element's attribute; ``INF`` is one."""
    text = element.get(key)
    if text is None and default is not None:
        return default
    try:
        value = float(text if text is not None else "missing")
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise InputError("is no number", field=f"{_tag(element)}.{key}", value=text, limit="a number")
    return value


def _plan(alignment: ET.Element, unit: float) -> list[_Part]:
    """The elements of the plan."""
    geometry = _children(alignment, "CoordGeom")
    parts: list[_Part] = []
    for i, element in enumerate(geometry[0] if geometry else []):
        kind, here = _tag(element), f"CoordGeom[{i}]"
        if kind in ("Feature",):
            continue
        if kind not in ("Line", "Curve", "Spiral"):
            raise InputError(
                "is no element that is read",
                field=here,
                value=kind,
                limit="Line, Curve, Spiral",
                remedy="export the alignment as straights, arcs and clothoids",
            )
        try:
            part = {"Line": _line, "Curve": _curve, "Spiral": _spiral}[kind](element, unit)
        except InputError as error:
            error.field = f"{here}.{error.field or kind}"
            raise
        if part.piece.length_m > 1e-6:
            parts.append(part)
    if not parts:
        raise InputError("has no plan", field="CoordGeom", limit="Line, Curve, Spiral")
    return parts


def _points(element: ET.Element, unit: float) -> dict[str, complex]:
    """Points of an element, x east + i y north, m."""
    found = {}
    for child in _children(element, "Start", "End", "Center", "PI"):
        cells = (child.text or "").split()
        if len(cells) >= 2:
            north, east = float(cells[0]), float(cells[1])
            found[_tag(child)] = unit * complex(east, north)
    return found


def _angle(direction: complex | None) -> float | None:
    return None if direction is None or direction == 0 else math.atan2(direction.imag, direction.real)


def _line(element: ET.Element, unit: float) -> _Part:
    at = _points(element, unit)
    start, end = at.get("Start"), at.get("End")
    along = end - start if start is not None and end is not None else None
    length = unit * _float(element, "length", default=None if along is None else abs(along) / unit)
    heading = _angle(along)
    return _Part("Line", Piece(length, 0.0, 0.0), start, end, heading, heading)


def _side(element: ET.Element) -> float:
    """1 for a curve to the left (counterclockwise), -1 to the right."""
    rot = element.get("rot", "")
    if rot not in ("cw", "ccw"):
        raise InputError(
            "is no direction of turning", field=f"{_tag(element)}.rot", value=rot, limit="cw, ccw"
        )
    return 1.0 if rot == "ccw" else -1.0


def _curve(element: ET.Element, unit: float) -> _Part:
    side, at = _side(element), _points(element, unit)
    start, centre, end = (at.get(key) for key in ("Start", "Center", "End"))
    first = last = turn = None
    if start is not None and centre is not None and end is not None:
        if centre in (start, end):
            raise InputError(
                "has its centre at an end",
                field="Curve.Center",
                value=(element.findtext("{*}Center") or "").strip(),
                limit="a point beside the arc, north before east",
            )
        first, last = _angle(side * 1j * (start - centre)), _angle(side * 1j * (end - centre))
        turned = (end - centre) / (start - centre)
        turn = (side * math.atan2(turned.imag, turned.real)) % (2.0 * math.pi)
    given = None if start is None or centre is None else abs(start - centre) / unit
    radius = unit * _float(element, "radius", default=given)
    if not 0.0 < radius < math.inf:
        raise InputError("is no radius", field="Curve.radius", value=radius, limit="> 0")
    length = unit * _float(element, "length", default=None if turn is None else turn * radius / unit)
    return _Part("Curve", Piece(length, side / radius, side / radius), start, end, first, last)


def _spiral(element: ET.Element, unit: float) -> _Part:
    kind = element.get("spiType", "clothoid")
    if kind.lower() != "clothoid":
        raise InputError(
            "is a spiral that is not read",
            field="Spiral.spiType",
            value=kind,
            limit="clothoid",
            remedy="give the line as a CSV of curvature over distance instead",
        )
    side, at = _side(element), _points(element, unit)
    bends = []
    for key in ("radiusStart", "radiusEnd"):
        radius = unit * _float(element, key)
        if radius < 0.0:
            raise InputError(
                "is negative", field=f"Spiral.{key}", value=radius, limit=">= 0 m", remedy="rot says the side"
            )
        # Some programs write 0 for no curvature.
        bends.append(0.0 if radius in (0.0, math.inf) else side / radius)
    start, corner, end = (at.get(key) for key in ("Start", "PI", "End"))
    first = _angle(corner - start) if corner is not None and start is not None else None
    last = _angle(end - corner) if corner is not None and end is not None else None
    length = unit * _float(element, "length")
    return _Part("Spiral", Piece(length, bends[0], bends[1]), start, end, first, last)


def _place(drawn: Drawn, parts: Sequence[_Part]) -> None:
    """Heading at the start; what lengths and radii make, held against the coordinates."""
    station = drawn.start_m
    for before, after in itertools.pairwise(parts):
        station += before.piece.length_m
        if before.end_rad is not None and after.start_rad is not None:
            refuse_kink(
                after.start_rad - before.end_rad,
                f"{before.kind} to {after.kind} at {station:.3f} m",
                remedy="put an arc there, or mend rot or the coordinates",
            )
    first = parts[0]
    if first.start is None or first.start_rad is None:
        drawn.notes.append("no coordinates at the start: the line begins at 0, 0 to the east")
        return
    drawn.start_yaw_rad = first.start_rad
    where, heading, away, at = first.start, first.start_rad, 0.0, drawn.start_m
    for part in parts:
        where, heading = _walked(where, heading, part.piece)
        at += part.piece.length_m
        if part.end is not None and abs(where - part.end) > away:
            away, worst = abs(where - part.end), at
    drawn.notes.append(
        f"it begins at east {first.start.real:.3f} m, north {first.start.imag:.3f} m, which is 0, 0 here"
    )
    if away > 1e-3:
        drawn.notes.append(
            f"lengths and radii lead at most {away:.3f} m beside the coordinates of the file, at {worst:.0f} "
            "m: these are rounded, and the line is that of lengths and radii"
        )
    if away > max(1.0, 1e-3 * (at - drawn.start_m)):
        raise InputError(
            "lengths and radii make another line than the coordinates",
            field=f"at {worst:.1f} m",
            value=f"{away:.2f} m beside",
            limit="1 m, or a thousandth of the line",
            remedy="mend the units, or the direction of a curve",
        )


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(20)


def _walked(where: complex, heading: float, piece: Piece) -> tuple[complex, float]:
    """Place and heading behind a piece: Gauss quadrature of the direction, whose angle is a parabola."""
    length, k0, k1 = piece.length_m, piece.start_1pm, piece.end_1pm
    parts = max(1, math.ceil(max(abs(k0), abs(k1)) * length))
    for i in range(parts):
        u = (i + 0.5 * (1.0 + _NODES)) * length / parts
        angles = heading + k0 * u + 0.5 * (k1 - k0) * u * u / length
        where += complex(0.5 * length / parts * np.sum(_WEIGHTS * np.exp(1j * angles)))
    return where, heading + 0.5 * (k0 + k1) * length


def _curvature(drawn: Drawn, at_m: float) -> float:
    """Of the plan at a place."""
    s = drawn.start_m
    for piece in drawn.pieces:
        if at_m <= s + piece.length_m + 1e-6:
            return piece.start_1pm + (piece.end_1pm - piece.start_1pm) * (at_m - s) / piece.length_m
        s += piece.length_m
    return 0.0


def _cant(drawn: Drawn, alignment: ET.Element, unit: float, *, inches: bool) -> None:
    """Stations of cant."""
    tables = _children(alignment, "Cant")
    if not tables:
        drawn.notes.append("the file has no cant for it")
        return
    table = tables[0]
    stations = _children(table, "CantStation")
    heights = [_float(station, "appliedCant", default=0.0) for station in stations]
    largest = max((abs(height) for height in heights), default=0.0)
    scale, word = (0.0254, "inches") if inches else (0.001, "mm")
    if 0.0 < largest < 0.6:
        scale, word = (unit, "the unit of length")
    drawn.notes.append(f"cant is taken in {word}: {1e3 * scale * largest:.1f} mm at most")
    drawn.rail_base_m = _rail_base(drawn, table, unit)
    if table.get("rotationPoint", "center").lower() not in ("center", "centre"):
        drawn.notes.append(
            f"the file turns cant about {table.get('rotationPoint')}: here it is turned about the middle, "
            "which changes heights by half the cant"
        )
    odd = {s.get("transitionType", "clothoid") for s in stations} - {"clothoid", "linear", "none"}
    if odd:
        drawn.notes.append(f"cant of type {', '.join(sorted(odd))} is taken to change linearly")
    for station, height in zip(stations, heights, strict=True):
        at, turned = unit * _float(station, "station"), station.get("curvature")
        bend = {"cw": -1.0, "ccw": 1.0}.get(turned or "", _curvature(drawn, at))
        bend = -bend if station.get("adverse", "false").lower() == "true" else bend
        level = scale * height * (-1.0 if bend >= 0.0 else 1.0)
        add_cant(drawn, at, level)


def _rail_base(drawn: Drawn, table: ET.Element, unit: float) -> float:
    """What the cant of a table is a height over."""
    gauge = unit * _float(table, "gauge", default=1.435 / unit)
    gauge = gauge / 1000.0 if gauge > 100.0 else gauge  # some write it in mm
    base = table.get("superelevationBase")
    if base is not None:
        return unit * _float(table, "superelevationBase")
    if _NORMAL_GAUGE_M[0] <= gauge <= _NORMAL_GAUGE_M[1]:
        return 1.5
    drawn.notes.append(f"cant is taken over {1e3 * (gauge + _HEAD_M):.0f} mm, the gauge and a rail's head")
    return gauge + _HEAD_M


def _profile(drawn: Drawn, alignment: ET.Element, unit: float) -> None:
    """Height and slope at the start, and the changes of gradient."""
    lines = [line for profile in _children(alignment, "Profile") for line in _children(profile, "ProfAlign")]
    if not lines:
        drawn.notes.append("the file has no gradients for it: the line is level")
        return
    if len(lines) > 1:
        drawn.notes.append(f"of {len(lines)} profiles the first is taken: {lines[0].get('name')}")
    points: list[tuple[float, float, ET.Element]] = []
    for i, element in enumerate(lines[0]):
        kind = _tag(element)
        if kind not in ("PVI", "ParaCurve", "CircCurve"):
            if kind == "Feature":
                continue
            raise InputError(
                "is no point of a profile that is read",
                field=f"ProfAlign[{i}]",
                value=kind,
                limit="PVI, ParaCurve, CircCurve",
            )
        cells = (element.text or "").split()
        if len(cells) < 2:
            raise InputError(
                "is no station and height",
                field=f"ProfAlign[{i}].{kind}",
                value=element.text,
                limit="two numbers: station and height",
            )
        points.append((unit * float(cells[0]), unit * float(cells[1]), element))
    stations, heights = (np.array([point[k] for point in points]) for k in (0, 1))
    if len(points) < 2 or not (np.diff(stations) > 0.0).all():
        raise InputError(
            "the points of the profile do not rise in station",
            field="ProfAlign",
            limit=">= 2 points, each with a greater station",
        )
    slopes = np.diff(heights) / np.diff(stations)
    begin = int(np.clip(np.searchsorted(stations, drawn.start_m, side="right") - 1, 0, len(slopes) - 1))
    drawn.slope = float(slopes[0])
    drawn.start_height_m = float(heights[begin] + slopes[begin] * (drawn.start_m - stations[begin]))
    for i in range(1, len(points) - 1):
        element, change = points[i][2], abs(float(slopes[i] - slopes[i - 1]))
        length = 0.0
        if _tag(element) == "CircCurve" and element.get("radius") is not None:
            length = unit * _float(element, "radius") * change
        elif _tag(element) != "PVI":
            length = unit * _float(element, "length")
        drawn.turns.append(Turn(float(stations[i]), float(slopes[i]), length))


def _breaks(drawn: Drawn, alignment: ET.Element, unit: float) -> None:
    """Chainage breaks: told, with the place on the track that each stands for."""
    for equation in _children(alignment, "StaEquation"):
        ahead = unit * _float(equation, "staAhead")
        back = equation.get("staBack")
        inside = equation.get("staInternal")
        if inside is None and back is None:
            raise InputError(
                "says neither staBack nor staInternal", field="StaEquation", limit="staBack or staInternal"
            )
        at = unit * _float(equation, "staInternal" if inside is not None else "staBack")
        before = at if back is None else unit * _float(equation, "staBack")
        drawn.breaks.append((at, before, ahead))
