"""Profiles by name or from a file: SIMPACK's ``.prw`` and ``.prr``, and two columns of text.

A vehicle file says ``wheel_profile = "S1002"``, ``"cone_1_20"`` or ``"measured/wheel_7.prw"``, and
`wheel_profile` and `rail_profile` make the points of it. Points from a file are taken as they are, never
smoothed: the cubic spline goes through each of them, so a measured profile must be smooth before it
comes here.

Not here: formulas of standard profiles (`simrail.vehicle.contact.profiles`), and the text of the files
(`simrail.vehicle.contact.profile_points`).
"""

import hashlib
import re
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.vehicle.contact.profile_points import TEXTS, read_points, refuse_folded, thinned
from simrail.vehicle.contact.profiles import (
    RailProfile,
    WheelProfile,
    conical_wheel,
    rail_60e1,
    s1002,
    scaled,
    worn,
)
from simrail.vehicle.model import WheelRail

_WHEEL_NAMES = "S1002, cone_1_20 (or cone_0.05), S1002_worn_0.3 (mm), or a file .prw, .txt, .csv, .dat"
_RAIL_NAMES = "60E1, or a file .prr, .txt, .csv, .dat"


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
    if path.suffix.lower() not in (".prw", ".prr", *TEXTS) or beside is None or path.is_absolute():
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
    if match := re.fullmatch(r"cone_(\d+)_(\d+)", text):
        rise, run = int(match[1]), int(match[2])
        return conical_wheel(rise / run if run else np.inf)
    if match := re.fullmatch(r"cone_(\d*\.\d+)", text):
        return conical_wheel(float(match[1]))
    if match := re.fullmatch(r"S1002_worn_(\d*\.?\d+)", text):
        return worn(s1002(), wear_m=float(match[1]) * 1e-3)
    path = _path(text, beside, ".prw", field="wheel_profile", names=_WHEEL_NAMES)
    with blame(path):
        return _wheel_of(path)


def _wheel_of(path: Path) -> WheelProfile:
    """The wheel profile of a file."""
    y, z, line = read_points(path, kind=1)
    tip = int(np.argmax(z))
    if y[tip] > 0.0:
        y = -y
    y, z, line = (a[:: 1 if y[-1] > y[0] else -1] for a in (y, z, line))
    tip = int(np.argmax(z))
    y, z, line = y[tip:], z[tip:], line[tip:]
    if not y[0] < 0.0 < y[-1]:
        raise InputError(
            "the points do not reach over the tape circle, where lateral position is 0",
            field="lateral position",
            value=(float(y[0]), float(y[-1])),
            limit="flange tip < 0 m < field side",
            remedy="shift the points so that the tape circle is at 0",
        )
    refuse_folded(y, line, least=0.0)
    y, z = thinned(y, z)
    spline = CubicSpline(y, z)
    if spline(y[0]) - spline(0.0) < 0.1 * (y[-1] - y[0]):
        raise InputError(
            "the profile has no flange",
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
    with blame(path):
        return _rail_of(path)


def _rail_of(path: Path) -> RailProfile:
    """The rail profile of a file."""
    y, z, line = read_points(path, kind=0)
    y, z, line = (a[:: 1 if y[-1] > y[0] else -1] for a in (y, z, line))
    # The side of a head may be upright.
    refuse_folded(y, line, least=-1e-12)
    y, z = thinned(y, z)
    top = int(np.argmin(z))
    if min(z[0], z[-1]) - z[top] < 0.01 * (y[-1] - y[0]):
        raise InputError(
            "the rail's head has no highest point between its sides",
            field="depth",
            value=float(z[top]),
            limit="least in the middle, greater to both sides",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column",
        )
    return RailProfile(path.name, y, z - z[top], f"file {path.name}")


def _path(text: str, beside: Path | None, own: str, *, field: str, names: str) -> Path:
    """The file that is meant, which exists."""
    path = Path(text)
    if path.suffix.lower() not in (own, *TEXTS):
        raise InputError("no such profile", field=field, value=text, limit=names)
    path = Path(profile_place(text, beside))
    if not path.is_file():
        raise InputError(
            "no such profile file",
            file=path,
            field=field,
            value=text,
            remedy="a relative path starts at the file that names it",
            limit="a file that is there",
        )
    return path
