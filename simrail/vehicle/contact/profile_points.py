"""Points of a profile from a file: SIMPACK's ``.prw`` and ``.prr``, and two columns of text, in metres.

The points are those of the file, after what its header asks for; whether they are a wheel or a rail, and
which way round, is found by `simrail.vehicle.contact.profile_files`, which also says in a refusal which file
it was. Nothing is smoothed.
"""

import re
from pathlib import Path

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

TEXTS = (".txt", ".csv", ".dat")
"""Endings of files of two columns; any other is SIMPACK's."""
_FEWEST_POINTS = 8
_LEAST_DISTANCE_M = 5e-5
"""Points closer than this say nothing more, and their rounding would bend the spline."""
_WIDTH_M = (0.005, 0.25)
"""A profile's width, from a 1:20 model to a wheel with its rim; anything else is a unit mistaken."""


def read_points(path: Path, *, kind: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Read the points of a profile.

    Parameters
    ----------
    path : Path
        A file that exists: one of `TEXTS`, else SIMPACK's.
    kind : int
        SIMPACK's type of profile, 1 wheel and 0 rail.

    Returns
    -------
    y, z : ndarray (n,)
        Lateral position and depth (downward), m, in the order of the file.
    line : ndarray (n,)
        Line of the file that each point stands in.

    Raises
    ------
    InputError
        If the file is unreadable or of the other kind, or holds too few points, or what is no number,
        no unit or no width of a profile.
    """
    return _in_metres(*_parse(path, kind=kind))


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


def _parse(path: Path, *, kind: int) -> tuple[FloatArray, FloatArray, FloatArray, dict[str, float]]:
    """Points in the file's own unit and order, the lines that they stand in, and the header."""
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise InputError(
            "the profile cannot be read",
            value=error.strerror,
            limit="a file that may be read",
            remedy="mend the path, or its rights",
        ) from error
    simpack = path.suffix.lower() not in TEXTS
    header: dict[str, float] = {} if simpack else {"units.len.f": 1e3}
    rows: list[tuple[float, float, int]] = []
    inside = not simpack
    section = ""
    for number, raw in enumerate(lines, start=1):
        line = raw.strip()
        if not simpack and (unit := re.fullmatch(r"[#!%]\s*unit\s*[=:]\s*(\S+)", line)):
            if unit[1] not in ("m", "mm"):
                raise InputError("unknown unit", field="unit", value=unit[1], limit="m or mm")
            header["units.len.f"] = 1.0 if unit[1] == "m" else 1e3
        line = re.split(r"[!]" if simpack else r"[#!%]", line)[0].strip()
        if not line:
            continue
        if simpack and line in ("header.begin", "spline.begin", "point.begin"):
            section, inside = line.split(".")[0], line == "point.begin"
        elif simpack and line == "point.end":
            inside = False
        elif inside:
            cells = re.split(r"[\s,;]+", line)
            field = f"line {number}"
            if len(cells) not in ((2, 3) if simpack else (2,)):
                raise InputError(
                    "a point is a lateral position and a depth", field=field, value=line, limit="2 numbers"
                )
            rows.append((_number(cells[0], field), _number(cells[1], field), number))
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            if not value.startswith("'") and key not in ("file.mtime", "version"):
                header[f"{section}.{key}" if key == "type" else key] = _number(value, key)
    if len(rows) < _FEWEST_POINTS:
        raise InputError(
            "too few points for a profile",
            field="point.begin ... point.end" if simpack else "points",
            value=len(rows),
            limit=f"at least {_FEWEST_POINTS}",
        )
    if simpack and header.get("header.type", kind) != kind:
        raise InputError(
            "this is the other kind of profile",
            field="header.type",
            value=header["header.type"],
            limit=f"{kind} (0 rail, 1 wheel)",
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
    return y, z, at, header


def _number(text: str, field: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(
            "not a number", field=field, value=text, remedy="decimals have a point", limit="a number"
        ) from None


def _in_metres(
    y: FloatArray, z: FloatArray, line: FloatArray, header: dict[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points in metres and their lines, after what SIMPACK's header asks for, in the order that it numbers.

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
    if not _WIDTH_M[0] < width < _WIDTH_M[1]:
        raise InputError(
            "no profile is that wide: the unit is another one",
            field="units.len.f" if "shift.y" in header else "unit",
            value=f"{width:g} m",
            limit=f"{_WIDTH_M[0]:g} to {_WIDTH_M[1]:g} m",
            remedy="text is in mm unless a line says '# unit = m'; a SIMPACK header says units.len.f",
        )
    return y, z, line[keep]
