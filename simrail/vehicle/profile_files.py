"""Profiles by name or from a file: SIMPACK's ``.prw`` and ``.prr``, and two columns of text.

A vehicle file says ``wheel_profile = "S1002"``, ``"cone_1_20"`` or ``"measured/wheel_7.prw"``, and
`wheel_profile` and `rail_profile` make the points of it. Points from a file are taken as they are, never
smoothed: the cubic spline goes through each of them, so a measured profile must be smooth before it
comes here.

Not here: formulas of standard profiles (`simrail.vehicle.profiles`).
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.errors import InputError
from simrail.jit import FloatArray
from simrail.vehicle.model import WheelRail
from simrail.vehicle.profiles import (
    RailProfile,
    WheelProfile,
    conical_wheel,
    rail_60e1,
    s1002,
    scaled,
    worn,
)

_FEWEST_POINTS = 8
_LEAST_DISTANCE_M = 5e-5
"""Points closer than this say nothing more, and their rounding would bend the spline."""
_WIDTH_M = (0.005, 0.25)
"""A profile's width, from a 1:20 model to a wheel with its rim; anything else is a unit mistaken."""
_WHEEL_NAMES = "S1002, cone_1_20 (or cone_0.05), S1002_worn_0.3 (mm), or a file .prw, .txt, .csv, .dat"
_RAIL_NAMES = "60E1, or a file .prr, .txt, .csv, .dat"
_TEXT = (".txt", ".csv", ".dat")


class _Points(NamedTuple):
    """Points of a file in its own unit and order, the lines that they stand in, and the header."""

    y: FloatArray
    z: FloatArray
    line: FloatArray
    header: dict[str, float]


def profiles_of(pair: WheelRail) -> tuple[WheelProfile, RailProfile]:
    """The two profiles that meet, at the scale of the vehicle; faults as in `wheel_profile`."""
    wheel, rail = wheel_profile(pair.wheel_profile), rail_profile(pair.rail_profile)
    return scaled(wheel, pair.profile_scale), scaled(rail, pair.profile_scale)


def profiles_digest(pair: WheelRail) -> str:
    """SHA-256 of the points of both profiles: a file may change under its name."""
    wheel, rail = profiles_of(pair)
    points = (wheel.lateral_m, wheel.depth_m, rail.lateral_m, rail.depth_m)
    return hashlib.sha256(b"".join(part.tobytes() for part in points)).hexdigest()


def profile_place(name_or_path: str, beside: Path | None) -> str:
    """A profile's name as it is, or its file seen from the file or folder that names it."""
    path = Path(name_or_path)
    if path.suffix.lower() not in (".prw", ".prr", *_TEXT) or beside is None or path.is_absolute():
        return name_or_path
    return str((beside if beside.is_dir() else beside.parent) / path)


def wheel_profile(name_or_path: str | Path, beside: Path | None = None) -> WheelProfile:
    """The wheel profile of a name or a file.

    Parameters
    ----------
    name_or_path : str or Path
        ``"S1002"``; ``"cone_1_20"`` or ``"cone_0.05"``, a straight cone with flange; ``"S1002_worn_0.3"``,
        S1002 with 0.3 mm of *synthetic* hollow wear; or a file: ``.prw``, else two columns of text,
        lateral position and depth (downward) in mm, or in m if a line says ``# unit = m``. The flange may
        be on either side: the deepest point is its tip. Lateral zero is the tape circle.
    beside : Path, optional
        File or folder that a relative path starts from, e.g. the vehicle file that names it.

    Returns
    -------
    WheelProfile
        From the flange tip outward; depth zero at the tape circle.

    Raises
    ------
    InputError
        Unknown name, missing file, or points that are no profile: file, field, value, limit, remedy.
    """
    text = str(name_or_path)
    if text == "S1002":
        return s1002()
    if found := re.fullmatch(r"cone_(\d+)_(\d+)", text):
        rise, run = int(found[1]), int(found[2])
        return conical_wheel(rise / run if run else np.inf)
    if found := re.fullmatch(r"cone_(\d*\.\d+)", text):
        return conical_wheel(float(found[1]))
    if found := re.fullmatch(r"S1002_worn_(\d*\.?\d+)", text):
        return worn(s1002(), wear_m=float(found[1]) * 1e-3)
    path = _path(text, beside, ".prw", field="wheel_profile", names=_WHEEL_NAMES)
    points = _read(path, kind=1)
    y, z, line = _metres(points, path)
    tip = int(np.argmax(z))
    if y[tip] > 0.0:
        y = -y
    y, z, line = (a[:: 1 if y[-1] > y[0] else -1] for a in (y, z, line))
    tip = int(np.argmax(z))
    y, z, line = y[tip:], z[tip:], line[tip:]
    if not y[0] < 0.0 < y[-1]:
        raise InputError(
            "the points do not reach over the tape circle, where lateral position is 0",
            file=path,
            field="lateral position",
            value=(float(y[0]), float(y[-1])),
            limit="flange tip < 0 m < field side",
            remedy="shift the points so that the tape circle is at 0",
        )
    _unfolded(y, line, path, least=0.0)
    y, z = _thin(y, z, path)
    spline = CubicSpline(y, z)
    if spline(y[0]) - spline(0.0) < 0.1 * (y[-1] - y[0]):
        raise InputError(
            "the profile has no flange",
            file=path,
            field="depth",
            value=float(z[0] - spline(0.0)),
            limit="deepest at the flange tip, a tenth of the width below the tape circle",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column",
        )
    return WheelProfile(path.name, y, z - float(spline(0.0)), f"file {path.name}")


def rail_profile(name_or_path: str | Path, beside: Path | None = None) -> RailProfile:
    """The rail profile of a name or a file.

    Parameters
    ----------
    name_or_path : str or Path
        ``"60E1"``, or a file: ``.prr``, else two columns of text as in `wheel_profile`; lateral
        position outward (gauge side negative), depth downward. A rail that was measured as it lies
        already leans: its vehicle has ``rail_inclination = 0``.
    beside : Path, optional
        As in `wheel_profile`.

    Returns
    -------
    RailProfile

    Raises
    ------
    InputError
        As in `wheel_profile`.
    """
    text = str(name_or_path)
    if text == "60E1":
        return rail_60e1()
    path = _path(text, beside, ".prr", field="rail_profile", names=_RAIL_NAMES)
    points = _read(path, kind=0)
    y, z, line = _metres(points, path)
    y, z, line = (a[:: 1 if y[-1] > y[0] else -1] for a in (y, z, line))
    # The side of a head may be upright.
    _unfolded(y, line, path, least=-1e-12)
    y, z = _thin(y, z, path)
    top = int(np.argmin(z))
    if min(z[0], z[-1]) - z[top] < 0.01 * (y[-1] - y[0]):
        raise InputError(
            "the rail's head has no highest point between its sides",
            file=path,
            field="depth",
            value=float(z[top]),
            limit="least in the middle, greater to both sides",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column",
        )
    return RailProfile(path.name, y, z - z[top], f"file {path.name}")


def _path(text: str, beside: Path | None, own: str, *, field: str, names: str) -> Path:
    """The file that is meant, which exists."""
    path = Path(text)
    if path.suffix.lower() not in (own, *_TEXT):
        raise InputError("no such profile", field=field, value=text, limit=names)
    path = Path(profile_place(text, beside))
    if not path.is_file():
        raise InputError(
            "no such profile file",
            file=path,
            field=field,
            value=text,
            remedy="a relative path starts at the file that names it",
        )
    return path


def _number(text: str, path: Path, field: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(
            "not a number", file=path, field=field, value=text, remedy="decimals have a point"
        ) from None


def _read(path: Path, *, kind: int) -> _Points:
    """Points and header; kind is SIMPACK's type, 1 wheel and 0 rail."""
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise InputError("the profile cannot be read", file=path, value=error.strerror) from error
    simpack = path.suffix.lower() not in _TEXT
    header: dict[str, float] = {} if simpack else {"units.len.f": 1e3}
    rows: list[tuple[float, float, int]] = []
    inside = not simpack
    section = ""
    for number, raw in enumerate(lines, start=1):
        line = raw.strip()
        if not simpack and (unit := re.fullmatch(r"[#!%]\s*unit\s*[=:]\s*(\S+)", line)):
            if unit[1] not in ("m", "mm"):
                raise InputError("unknown unit", file=path, field="unit", value=unit[1], limit="m or mm")
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
                    "a point is a lateral position and a depth",
                    file=path,
                    field=field,
                    value=line,
                    limit="2 numbers",
                )
            rows.append((_number(cells[0], path, field), _number(cells[1], path, field), number))
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            if not value.startswith("'") and key not in ("file.mtime", "version"):
                header[f"{section}.{key}" if key == "type" else key] = _number(value, path, key)
    if len(rows) < _FEWEST_POINTS:
        raise InputError(
            "too few points for a profile",
            file=path,
            field="point.begin ... point.end" if simpack else "points",
            value=len(rows),
            limit=f"at least {_FEWEST_POINTS}",
        )
    if simpack and header.get("header.type", kind) != kind:
        raise InputError(
            "this is the other kind of profile",
            file=path,
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
            file=path,
            field=f"line {int(at[i])}",
            value=(float(y[i]), float(z[i])),
            remedy="leave out points that were not measured",
        )
    return _Points(y, z, at, header)


def _metres(points: _Points, path: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points in metres and their lines, after what SIMPACK's header asks for, in the order that it numbers.

    Shift, rotation about x (y towards z), bounds, mirrors; the order of the points does not matter here.
    """
    y, z, line, header = points
    if header.get("approx.smooth", 0.0) != 0.0:
        raise InputError(
            "smoothing by the reader is SIMPACK's own and not done here",
            file=path,
            field="approx.smooth",
            value=header["approx.smooth"],
            limit="0",
            remedy="write the smoothed points to the file",
        )
    unit, angle_unit = header.get("units.len.f", 1.0), header.get("units.ang.f", 1.0)
    for field, value in (("units.len.f", unit), ("units.ang.f", angle_unit)):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(
                "not a unit", file=path, field=field, value=value, limit="> 0, 1000 for mm, 1 for m"
            )
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
            file=path,
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
            file=path,
            field="units.len.f" if "shift.y" in header else "unit",
            value=f"{width:g} m",
            limit=f"{_WIDTH_M[0]:g} to {_WIDTH_M[1]:g} m",
            remedy="text is in mm unless a line says '# unit = m'; a SIMPACK header says units.len.f",
        )
    return y, z, line[keep]


def _unfolded(y: FloatArray, line: FloatArray, path: Path, *, least: float) -> None:
    """Refuse points that do not go outward; `least` is the smallest step allowed (exclusive)."""
    back = np.flatnonzero(~(np.diff(y) > least))
    if back.size:
        i = int(back[0])
        raise InputError(
            "the profile folds back or its points are out of order",
            file=path,
            field=f"line {int(line[i + 1])}",
            value=float(y[i + 1]),
            limit=f"> {float(y[i])} m (line {int(line[i])})",
            remedy="order the points from flange or gauge side outward, and drop folded or double ones",
        )


def _thin(y: FloatArray, z: FloatArray, path: Path) -> tuple[FloatArray, FloatArray]:
    """Points no closer to each other than what a spline can use; first and last stay."""
    kept = [0]
    for i in range(1, y.size):
        if np.hypot(y[i] - y[kept[-1]], z[i] - z[kept[-1]]) >= _LEAST_DISTANCE_M:
            kept.append(i)
    if len(kept) < _FEWEST_POINTS:
        raise InputError(
            "too few different points for a profile",
            file=path,
            field="points",
            value=len(kept),
            limit=f"at least {_FEWEST_POINTS}, {_LEAST_DISTANCE_M * 1e3:g} mm apart",
        )
    return y[kept], z[kept]
