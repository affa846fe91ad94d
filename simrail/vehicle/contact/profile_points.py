"""Points of a profile from a file: SIMPACK's, MiniProf's, and columns of text, in metres.

SIMPACK's ``.prw`` and ``.prr`` have sections. A MiniProf writes ``.whl`` and ``.ban``: lines of a header,
mostly ``key=value``, then columns, of which ``ColumnDef`` says the first two are X and Y; a rail has Y
upward, a wheel toward the flange's tip (as read in files of the public test bank of CONTACT,
github.com/eve70a/CONTACT). Text with such a header is read as MiniProf's too.

The points are those of the file, after what its header asks for; whether they are a wheel or a rail, and
which way round, is found by `simrail.vehicle.contact.profile_files`, which also says in a refusal which file
it was. Nothing is smoothed.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

TEXTS = (".txt", ".csv", ".dat")
"""Endings of files of columns."""
MINIPROF = (".whl", ".ban")
"""Endings of files of a MiniProf, of a wheel and of a rail; any other is SIMPACK's."""
_FEWEST_POINTS = 8
_LEAST_DISTANCE_M = 5e-5
"""Points closer than this say nothing more, and their rounding would bend the spline."""
_WIDTH_M = (0.005, 0.25)
"""A profile's width, from a 1:20 model to a wheel with its rim; anything else is a unit mistaken."""
_INCHES_M = 0.0065
"""A wheel's width in inches, read as millimetres, is less; so is a small model's, which must say so."""
_UNITS = {"m": 1.0, "mm": 1e3, "in": 1.0 / 0.0254, "inch": 1.0 / 0.0254}
"""Of text: how many are in a metre."""


Points = tuple[FloatArray, FloatArray, FloatArray]
"""Lateral position, depth and line of each point, (n,) each."""


class ReadPoints(NamedTuple):
    """Points of a file.

    Attributes
    ----------
    y, z : ndarray (n,)
        Lateral position and depth (downward), m, in the order of the file.
    line : ndarray (n,)
        Line of the file that each point stands in.
    notes : tuple of str
        What of the file is not used.
    miniprof : dict of str to str, optional
        Header of a MiniProf's file, keys in small letters; None if it is not one.
    """

    y: FloatArray
    z: FloatArray
    line: FloatArray
    notes: tuple[str, ...] = ()
    miniprof: dict[str, str] | None = None


def read_points(path: Path, *, kind: int) -> ReadPoints:
    """Read the points of a profile.

    Parameters
    ----------
    path : Path
        A file that exists: one of `TEXTS`, of `MINIPROF`, else SIMPACK's.
    kind : int
        SIMPACK's type of profile, 1 wheel and 0 rail.

    Returns
    -------
    ReadPoints

    Raises
    ------
    InputError
        If the file is unreadable or of the other kind, or holds too few points, or what is no number,
        no unit or no width of a profile.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise InputError(
            "the profile cannot be read", value=error.strerror, limit="a file that can be read"
        ) from error
    ending = path.suffix.lower()
    if ending not in (*TEXTS, *MINIPROF):
        y, z, line = _in_metres(*_parse_simpack(lines, kind=kind), said=True)
        return ReadPoints(y, z, line)
    if ending in MINIPROF and ending != (".ban", ".whl")[kind]:
        raise InputError(
            "this is the other kind of profile",
            value=ending,
            limit=f"{('.ban', '.whl')[kind]} (.ban rail, .whl wheel)",
        )
    return _parse_columns(lines, kind=kind, miniprof=ending in MINIPROF)


def refuse_folded(y: FloatArray, line: FloatArray, *, least: float) -> None:
    """Refuse points that do not go outward.

    Parameters
    ----------
    y, line : ndarray (n,)
        As of `read_points`, from flange or gauge side outward.
    least : float
        Steps of y must be greater than this.

    Raises
    ------
    InputError
        Naming the first line that goes back.
    """
    back = np.flatnonzero(~(np.diff(y) > least))
    if back.size:
        i = int(back[0])
        raise InputError(
            "the profile folds back or its points are out of order",
            field=f"line {int(line[i + 1])}",
            value=float(y[i + 1]),
            limit=f"> {float(y[i])} m (line {int(line[i])})",
            remedy="order the points from flange or gauge side outward, and drop folded or double ones",
        )


def thinned(y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points no closer to each other than what a spline can use.

    Parameters
    ----------
    y, z : ndarray (n,)
        Points, m.

    Returns
    -------
    y, z : ndarray (m,)
        Those of them that stay, the first among them.

    Raises
    ------
    InputError
        If too few stay.
    """
    apart = [0]
    for i in range(1, y.size):
        if np.hypot(y[i] - y[apart[-1]], z[i] - z[apart[-1]]) >= _LEAST_DISTANCE_M:
            apart.append(i)
    if len(apart) < _FEWEST_POINTS:
        raise InputError(
            "too few different points for a profile",
            field="points",
            value=len(apart),
            limit=f"at least {_FEWEST_POINTS}, {_LEAST_DISTANCE_M * 1e3:g} mm apart",
        )
    return y[apart], z[apart]


def _parse_simpack(
    lines: list[str], *, kind: int
) -> tuple[FloatArray, FloatArray, FloatArray, dict[str, float]]:
    """Points in the file's own unit and order, the lines that they stand in, and the header."""
    header: dict[str, float] = {}
    rows: list[tuple[float, float, int]] = []
    inside, section = False, ""
    for number, raw in enumerate(lines, start=1):
        line = re.split(r"[!%]", raw)[0].strip()
        if not line:
            continue
        if line in ("header.begin", "spline.begin", "point.begin"):
            section, inside = line.split(".")[0], line == "point.begin"
        elif line == "point.end":
            inside = False
        elif inside:
            cells = re.split(r"[\s,;]+", line)
            field = f"line {number}"
            if len(cells) not in (2, 3):
                raise _no_point(line, field)
            rows.append((_number(cells[0], field), _number(cells[1], field), number))
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            if not value.startswith("'") and key not in ("file.mtime", "version"):
                header[f"{section}.{key}" if key == "type" else key] = _number(value, key)
    y, z, at = _finite(rows, "point.begin ... point.end")
    if header.get("header.type", kind) != kind:
        raise InputError(
            "this is the other kind of profile",
            field="header.type",
            value=header["header.type"],
            limit=f"{kind} (0 rail, 1 wheel)",
        )
    return y, z, at, header


def _parse_columns(lines: list[str], *, kind: int, miniprof: bool) -> ReadPoints:
    """Points of text in columns, after the header that a MiniProf writes, if there is one."""
    unit: str | None = None
    header: dict[str, str] = {}
    rows: list[tuple[float, float, int]] = []
    width = 0
    for number, raw in enumerate(lines, start=1):
        text = raw.strip()
        if said := re.fullmatch(r"[#!%]\s*unit\s*[=:]\s*(\S+)", text):
            unit = said[1]
            if unit not in _UNITS:
                raise InputError("unknown unit", field="unit", value=unit, limit="m, mm or in")
            continue
        line = re.split(r"[#!%]", text)[0].strip()
        field = f"line {number}"
        if not rows and not _begins_with_numbers(line):
            key, equals, value = text.strip('"').partition("=")
            if equals and not line.startswith(("#", "!", "%")):
                header[key.strip().lower()] = value.strip()
            elif line and not miniprof:
                raise _no_point(line, field)
            continue
        if not line:
            continue
        cells = re.split(r"[\s,;]+", line)
        width = width or len(cells)
        decimal_comma = re.search(r"\d,\d+[\s;]", line) and not re.search(r"\d,\s", line)
        if len(cells) != width or width < 2 or (width > 2 and decimal_comma):
            raise _no_point(line, field)
        rows.append((_number(cells[0], field), _number(cells[1], field), number))
    y, z, at = _finite(rows, "points")
    miniprof = miniprof or bool(header)
    notes = [] if width == 2 else [f"{width - 2} columns beside the first two are not used"]
    if miniprof:
        _check_miniprof(header, len(rows), notes)
        z = z if kind == 1 else -z  # of a rail Y is upward
    scale = {"units.len.f": _UNITS[unit or "mm"]}
    y, z, at = _in_metres(y, z, at, scale, said=unit is not None)
    return ReadPoints(y, z, at, tuple(notes), header if miniprof else None)


def _begins_with_numbers(line: str) -> bool:
    """Whether a line's first cell is a number; what follows may be wrong."""
    cells = re.split(r"[\s,;]+", line)
    try:
        float(cells[0])
    except ValueError:
        return False
    return True


def _check_miniprof(header: dict[str, str], count: int, notes: list[str]) -> None:
    """Refuse a MiniProf's file whose columns or offsets are others than what is read here."""
    columns = header.get("columndef", "X,Y")
    if not columns.upper().replace(" ", "").startswith("X,Y"):
        raise InputError(
            "the first two columns are not lateral position and height",
            field="ColumnDef",
            value=columns,
            limit="X,Y, ...",
            remedy="write the file again with these two first",
        )
    for key in ("xoffset", "yoffset"):
        value = header.get(key, "")
        if value and _number(value, key) != 0.0:
            raise InputError(
                "offsets of the header are not applied here",
                field=key,
                value=value,
                limit="0",
                remedy="add it to the points, and set it to 0",
            )
    told = header.get("xypoints", "")
    if told.isdigit() and int(told) != count:
        notes.append(f"the header tells of {told} points, the file has {count}")


def _no_point(line: str, field: str) -> InputError:
    return InputError(
        "a point is a lateral position and a depth",
        field=field,
        value=line,
        limit="2 numbers",
        remedy="decimals have a point; further columns are not used, but each line has as many",
    )


def _finite(rows: list[tuple[float, float, int]], field: str) -> Points:
    """Columns of the points and their lines; refuses too few of them, and what is not finite."""
    if len(rows) < _FEWEST_POINTS:
        raise InputError(
            "too few points for a profile", field=field, value=len(rows), limit=f"at least {_FEWEST_POINTS}"
        )
    y, z, at = np.array(rows).T
    bad = np.flatnonzero(~(np.isfinite(y) & np.isfinite(z)))
    if bad.size:
        i = int(bad[0])
        raise InputError(
            "a profile's points must be finite numbers",
            field=f"line {int(at[i])}",
            value=(float(y[i]), float(z[i])),
            remedy="leave out points that were not measured",
            limit="finite numbers",
        )
    return y, z, at


def _number(text: str, field: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(
            "not a number", field=field, value=text, remedy="decimals have a point", limit="a number"
        ) from None


def _in_metres(
    y: FloatArray, z: FloatArray, line: FloatArray, header: dict[str, float], *, said: bool
) -> Points:
    """Points in metres and their lines, after what SIMPACK's header asks for, in the order that it numbers.

    ``said`` is whether the file says its unit.

    Shift, rotation about x (y towards z), bounds, mirrors; the order of the points does not matter here.
    """
    if header.get("approx.smooth", 0.0) != 0.0:
        raise InputError(
            "smoothing by the reader is SIMPACK's own and not done here",
            field="approx.smooth",
            value=header["approx.smooth"],
            limit="0",
            remedy="write the smoothed points to the file",
        )
    unit, angle_unit = header.get("units.len.f", 1.0), header.get("units.ang.f", 1.0)
    for field, value in (("units.len.f", unit), ("units.ang.f", angle_unit)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError("not a unit", field=field, value=value, limit="> 0, 1000 for mm, 1 for m")
    y, z = y + header.get("shift.y", 0.0), z + header.get("shift.z", 0.0)
    angle = header.get("rotate", 0.0) / angle_unit
    y, z = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    keep = np.ones(y.size, dtype=bool)
    for name, values in (("y", y), ("z", z)):
        low, high = header.get(f"bound.{name}.min", 1.0), header.get(f"bound.{name}.max", 0.0)
        if low < high:
            keep &= (values >= low) & (values <= high)
    if keep.sum() < _FEWEST_POINTS:
        raise InputError(
            "the bounds leave too few points",
            field="bound",
            value=int(keep.sum()),
            limit=f"at least {_FEWEST_POINTS}",
        )
    y, z = y[keep] / unit, z[keep] / unit
    if header.get("mirror.y", 0.0) == 1.0:
        y = -y
    if header.get("mirror.z", 0.0) == 1.0:
        z = -z
    width = float(np.ptp(y))
    if not said and _WIDTH_M[0] < width < _INCHES_M:
        raise InputError(
            "is narrow for a profile in mm",
            field="unit",
            value=f"{1e3 * width:.3g} mm",
            limit=f"> {1e3 * _INCHES_M:g} mm, where no line says the unit",
            remedy="add a line '# unit = in' if it is in inches, '# unit = mm' if it is so small",
        )
    if not _WIDTH_M[0] < width < _WIDTH_M[1]:
        raise InputError(
            "no profile is that wide: the unit is another one",
            field="units.len.f" if "shift.y" in header else "unit",
            value=f"{width:g} m",
            limit=f"{_WIDTH_M[0]:g} to {_WIDTH_M[1]:g} m",
            remedy="text is in mm unless a line says '# unit = m' or '# unit = in'; a SIMPACK header says "
            "units.len.f",
        )
    return y, z, line[keep]
