"""Profiles by name or from a file: SIMPACK's ``.prw`` and ``.prr``, MiniProf's ``.whl`` and ``.ban``, text.

A vehicle file says ``wheel_profile = "S1002"``, ``"cone_1_20"`` or ``"measured/wheel_7.prw"``, and
`wheel_profile` and `rail_profile` make the points of it. Points from a file are taken as they are, never
smoothed: the cubic spline goes through each of them, so a measured profile must be smooth before it
comes here.

Not here: formulas of standard profiles (`simrail.vehicle.contact.profiles`), the text of the files
(`simrail.vehicle.contact.profile_points`), and what of a measured one is used
(`simrail.vehicle.contact.profile_cleaning`).
"""

import hashlib
import re
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.vehicle.contact.profile_cleaning import (
    clean_rail,
    clean_wheel,
    miniprof_tape_circle,
    roughness_note,
)
from simrail.vehicle.contact.profile_doubts import (
    centre_note,
    hole_note,
    refuse_upside_down,
    spike_note,
    tip_note,
)
from simrail.vehicle.contact.profile_points import MINIPROF, TEXTS, read_points, thinned
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

_WHEEL_NAMES = "S1002, cone_1_20 (or cone_0.05), S1002_worn_0.3 (mm), or a file .prw, .whl, .txt, .csv, .dat"
_FALSE_FLANGE = 0.3
"""Of a flange's depth, how much deeper than the tape circle a worn tread may be outward of it."""
_RAIL_NAMES = "60E1, or a file .prr, .ban, .txt, .csv, .dat"


def profiles_of(pair: WheelRail) -> tuple[WheelProfile, RailProfile]:
    """The two profiles that meet, at the scale of the vehicle; faults as in `wheel_profile`."""
    wheel = wheel_profile(pair.wheel_profile, tape_circle_m=pair.wheel_file_tape_circle_m)
    rail = rail_profile(pair.rail_profile)
    return scaled(wheel, pair.profile_scale), scaled(rail, pair.profile_scale)


def profiles_digest(pair: WheelRail) -> str:
    """SHA-256 of the points of both profiles: a file may change under its name."""
    wheel, rail = profiles_of(pair)
    points = (wheel.lateral_m, wheel.depth_m, rail.lateral_m, rail.depth_m)
    return hashlib.sha256(b"".join(part.tobytes() for part in points)).hexdigest()


def profile_place(name_or_path: str, beside: Path | None) -> str:
    """A profile's name as it is, or its file seen from the file or folder that names it."""
    path = Path(name_or_path)
    if path.suffix.lower() not in (".prw", ".prr", *MINIPROF, *TEXTS) or beside is None or path.is_absolute():
        return name_or_path
    return str((beside if beside.is_dir() else beside.parent) / path)


def profile_notes(pair: WheelRail) -> list[str]:
    """What was done with the points of profiles that come from files, each after the name of its file."""
    return [f"{part.name}: {note}" for part in profiles_of(pair) for note in part.notes]


def wheel_profile(
    name_or_path: str | Path, beside: Path | None = None, *, tape_circle_m: float | None = None
) -> WheelProfile:
    """The wheel profile of a name or a file.

    Parameters
    ----------
    name_or_path : str or Path
        ``"S1002"``; ``"cone_1_20"`` or ``"cone_0.05"``, a straight cone with flange; ``"S1002_worn_0.3"``,
        S1002 with 0.3 mm of *synthetic* hollow wear; or a file: ``.prw``, ``.whl``, else columns of text,
        lateral position and depth (downward) in mm, or in m or inches if a line says ``# unit = m`` or
        ``# unit = in``; further columns are not used. The flange may be on either side: the deepest point is
        its tip. Lateral zero is the tape circle; of a MiniProf's file it is the back of the flange.
    beside : Path, optional
        File or folder that a relative path starts from, e.g. the vehicle file that names it.
    tape_circle_m : float, optional
        Lateral position of the tape circle in the file, if it is another one.

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
    if tape_circle_m is not None and Path(text).suffix.lower() not in (".prw", ".whl", *TEXTS):
        raise InputError(
            "belongs to a profile from a file",
            field="tape_circle_mm",
            value=1e3 * tape_circle_m,
            limit="only with a profile from a file",
            remedy=f"remove it: the formula of {text} knows its tape circle",
        )
    if text == "S1002":
        return s1002()
    if match := re.fullmatch(r"cone_(\d+)_(\d+)", text):
        rise, run = int(match[1]), int(match[2])
        return conical_wheel(rise / run if run else np.inf)
    if match := re.fullmatch(r"cone_(\d*\.\d+)", text):
        return conical_wheel(float(match[1]))
    if match := re.fullmatch(r"S1002_worn_(\d*\.?\d+)", text):
        return worn(s1002(), wear_m=float(match[1]) * 1e-3)
    path = _path(text, beside, (".prw", ".whl"), field="wheel_profile", names=_WHEEL_NAMES)
    with blame(path):
        return _wheel_of(path, tape_circle_m)


def _wheel_of(path: Path, tape_circle_m: float | None) -> WheelProfile:
    """The wheel profile of a file."""
    read = read_points(path, kind=1)
    notes = list(read.notes)
    if tape_circle_m is None and read.miniprof is not None:
        tape_circle_m = miniprof_tape_circle(read.y, read.z, read.miniprof)
        notes.append(f"the tape circle is taken at {1e3 * tape_circle_m:g} mm of the file")
    points = clean_wheel((read.y, read.z, read.line), tape_circle_m=tape_circle_m, notes=notes)
    spike = spike_note(points)
    y, z = thinned(points[0], points[1])
    spline = CubicSpline(y, z)
    if spline(y[0]) - spline(0.0) < 0.1 * (y[-1] - y[0]):
        raise InputError(
            "the profile has no flange",
            field="depth",
            value=float(z[0] - spline(0.0)),
            limit="deepest at the flange tip, a tenth of the width below the tape circle",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column; a "
            "rail's profile has no flange at all",
        )
    flange, outer = (float(np.max(part) - spline(0.0)) for part in (z, z[y > 0.0]))
    if outer > _FALSE_FLANGE * flange:
        raise InputError(
            "the profile goes down on both sides, as a rail's head does and no wheel",
            field="depth",
            value=f"{1e3 * outer:.1f} mm outward of the tape circle",
            limit=f"{1e3 * _FALSE_FLANGE * flange:.1f} mm, {100 * _FALSE_FLANGE:g} % of the flange",
            remedy="name the file as rail_profile, or end the points at the rim",
        )
    told = (spike, roughness_note(y, z, around_m=0.0), hole_note(y, around_m=0.0), tip_note(y))
    notes += [note for note in told if note]
    return WheelProfile(path.name, y, z - float(spline(0.0)), f"file {path.name}", tuple(notes))


def rail_profile(name_or_path: str | Path, beside: Path | None = None) -> RailProfile:
    """The rail profile of a name or a file.

    Parameters
    ----------
    name_or_path : str or Path
        ``"60E1"``, or a file: ``.prr``, ``.ban``, else columns of text as in `wheel_profile`; lateral
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
    path = _path(text, beside, (".prr", ".ban"), field="rail_profile", names=_RAIL_NAMES)
    with blame(path):
        return _rail_of(path)


def _rail_of(path: Path) -> RailProfile:
    """The rail profile of a file."""
    read = read_points(path, kind=0)
    notes = list(read.notes)
    refuse_upside_down(read.y, read.z)
    points = clean_rail((read.y, read.z, read.line), notes=notes)
    spike = spike_note(points)
    y, z = thinned(points[0], points[1])
    top = int(np.argmin(z))
    if min(z[0], z[-1]) - z[top] < 0.01 * (y[-1] - y[0]):
        raise InputError(
            "the rail's head has no highest point between its sides",
            field="depth",
            value=float(z[top]),
            limit="least in the middle, greater to both sides",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column; a "
            "wheel's profile has no such head",
        )
    around = float(y[top])
    told = (spike, roughness_note(y, z, around_m=around), hole_note(y, around_m=around), centre_note(y))
    notes += [note for note in told if note]
    return RailProfile(path.name, y, z - z[top], f"file {path.name}", tuple(notes))


def _path(text: str, beside: Path | None, own: tuple[str, ...], *, field: str, names: str) -> Path:
    """The file that is meant, which exists."""
    path = Path(text)
    if path.suffix.lower() not in (*own, *TEXTS):
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
