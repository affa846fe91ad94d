"""Records of the force kernel: every number of a body, an element or the track by its name.

The force data, poses and wrenches are arrays of records, so that a kernel reads ``spring.stiffness[0]`` and
not a numbered slot. Beside flat arrays of numbers this costs a ride nothing, and it compiles faster: numba
takes a named field as a fixed offset, and resolves every index anew.

Fields are 8 bytes each, floats or whole numbers, so that records have no gaps: Exudyn's kernel makes
arrays of them from addresses (`simrail.vehicle.engines.exudyn_forces.records_at`).
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from simrail.core.jit import FloatArray, njit_inner
from simrail.track.laid_track import CHANNELS

RecordArray = npt.NDArray[np.void]
"""Array of records, one per body, element, wheel, ...; C-contiguous."""

Record = Any
"""One record, as a kernel sees it: its fields are attributes."""


def _record(floats: str, **others: str | tuple[str, tuple[int, ...]]) -> np.dtype[np.void]:
    """A record type: whole numbers and vectors first, then the named floats."""
    fields = [(name, *((kind,) if isinstance(kind, str) else kind)) for name, kind in others.items()]
    return np.dtype([*fields, *((name, "f8") for name in floats.split())], align=True)


_INDEX, _VECTOR = "i8", ("f8", (3,))
_ENDS: dict[str, Any] = {"inner": _INDEX, "outer": _INDEX, "inner_arm": _VECTOR, "outer_arm": _VECTOR}

POSE = np.dtype(
    [
        *((name, "f8") for name in ("x", "y", "z", "vx", "vy", "vz")),
        ("rotation", "f8", (3, 3)),
        *((name, "f8") for name in ("wx", "wy", "wz")),
    ],
    align=True,
)
"""Position, velocity, rotation matrix from body to global axes, angular rate of a body; all global."""
WRENCH = _record("fx fy fz mx my mz")
"""Force and moment about a body's centre of gravity, global axes."""
FRAME = np.dtype(
    [
        *((name, "f8") for name in ("x", "y", "z")),
        ("rotation", "f8", (3, 3)),
        *((name, "f8") for name in ("k1", "k2", "k3", "stretch")),
        *((f"{name}_{side}", "f8") for side in ("left", "right") for name in ("y", "z")),
        *((f"d{name}_{side}", "f8") for side in ("left", "right") for name in ("y", "z")),
        *((f"friction_{side}", "f8") for side in ("left", "right")),
    ],
    align=True,
)
"""The track at one s: place and axes of its frame, its curvatures about these axes (1/m), 1/cos(pitch),
deviations of both rails (m) and their derivatives by s, friction factors."""
TRACK = np.dtype([(name, "f8", (4,)) for name in CHANNELS])
"""Cubics, highest power first, over one interval of `simrail.track.laid_track.LaidTrack.table`."""

BODY = _record("mass_kg", inertia=_VECTOR)
SPRING = _record("sag_m", **_ENDS, stiffness=_VECTOR, damping=_VECTOR)
"""``sag_m``: deflection at rest along z."""
SERIES = _record("stiffness damping", **_ENDS, axis=_INDEX)
ROTATION, ROD, ARMS = 0, 1, 2
"""Kinds of `LINK`."""
LINK = _record(
    "length_m",
    kind=_INDEX,
    inner=_INDEX,
    outer=_INDEX,
    inner_arm=("f8", (2, 3)),
    outer_arm=("f8", (2, 3)),
    stiffness=_VECTOR,
    damping=_VECTOR,
)
"""A spring and damper of the rotation between two bodies; or a rod, with its length without force; or both
trailing arms of an axle (inner) on a frame (outer). In one array, since every further one that a kernel takes
costs it a per cent. A rod has its places and factors first of their fields, a rotation has no places."""
STOP = _record("", **_ENDS, axis=_INDEX, over_rate=_INDEX, first=_INDEX, pieces=_INDEX)
"""An element with a tabled law: the pieces from ``first`` on, over its deflection or its rate."""
LAW = np.dtype([("start", "f8"), ("cubic", "f8", (4,))], align=True)
WHEEL = _record("radius_m load_n", axle=_INDEX, side=_INDEX, spin=_INDEX, table=_INDEX)
SPIN = _record("inertia radius_m traction_share braking_share", axle=_INDEX, carrier=_INDEX)
"""What turns about an axle; ``carrier`` is the body that carries its motor and brake."""
AXLE = _record("", body=_INDEX, first_wheel=_INDEX)
GUIDE = _record(
    "offset_m stiffness damping pitch_stiffness pitch_damping yaw_stiffness yaw_damping lateral_stiffness "
    "lateral_damping vertical_stiffness vertical_damping roll_stiffness roll_damping height_m load_n",
    body=_INDEX,
)
"""Springs that lead one body along the track (`simrail.vehicle.model.Guide`); its height and load at rest."""
TRACTION = _record(
    "direction tractive_effort power braking_effort speed_gain position_gain catch_up slide_protection "
    "windup damping",
    wheels_drive=_INDEX,
)
"""The driver and his means (`simrail.vehicle.model.Traction`); all zero where the guide drives."""
OPTIONS = _record(
    "gravity grid_start_m grid_step_m f11 f22 f23 f33 conicity vertical_stiffness vertical_damping "
    "gravitational_stiffness gravitational_yaw_stiffness",
    gyroscopic=_INDEX,
    linear_contact=_INDEX,
)
"""Gravity, the grid of the track's table, and the prescribed linear contact, per wheel."""
DRIVE = np.dtype([("start_s", "f8"), ("cubic", "f8", (4,)), ("direction", "f8")], align=True)
"""A piece of the speed profile: s(t) from its start on, and the direction of its run, 1 or -1."""
GUIDE_MEMO = _record("s_m", piece=_INDEX)
"""What the kernel remembers from call to call: the piece of the profile and the s of the guide's body."""
AXLE_MEMO = _record("s_m derailed_time_s derailed_s_m speed_mps shift_m lift_m", derailed=_INDEX)
"""The same of an axle: its s; and where a wheel derailed (1 its first, 2 its second), when, where, how fast,
and its shift and lift (`simrail.vehicle.contact.contact.CONTACT`)."""


class Relative(NamedTuple):
    """C^T R of two rotation matrices: ``xz`` is the x axis of C times the z axis of R, and so on."""

    xx: float
    xy: float
    xz: float
    yx: float
    yy: float
    yz: float
    zx: float
    zy: float
    zz: float


@njit_inner
def rotated(r: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R v: a vector in the axes of a body or of the track, in global ones."""
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@njit_inner
def rotated_back(r: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float]:
    """R^T v: a global vector in the axes of a body or of the track."""
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@njit_inner
def relative(c: FloatArray, r: FloatArray) -> Relative:
    """C^T R: the axes of a body with rotation R seen in those of one with rotation C."""
    xx, yx, zx = rotated_back(c, r[0, 0], r[1, 0], r[2, 0])
    xy, yy, zy = rotated_back(c, r[0, 1], r[1, 1], r[2, 1])
    xz, yz, zz = rotated_back(c, r[0, 2], r[1, 2], r[2, 2])
    return Relative(xx, xy, xz, yx, yy, yz, zx, zy, zz)


@njit_inner
def push(w: Record, rx: float, ry: float, rz: float, fx: float, fy: float, fz: float) -> None:
    """Add a force that acts at r from the centre of gravity to a wrench: F, r x F."""
    w.fx += fx
    w.fy += fy
    w.fz += fz
    w.mx += ry * fz - rz * fy
    w.my += rz * fx - rx * fz
    w.mz += rx * fy - ry * fx
