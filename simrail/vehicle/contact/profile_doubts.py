"""Points that form a profile and cannot be one: a spike, a hole, a head upside down, another zero."""

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.profile_points import Points

_SPIKE_M, _SPIKE_SPREADS, _STEEP = 3e-4, 12.0, 3.0
"""Height of a point over the lines through its neighbours on either side, from which on it is none, and over
what is usual; and slope of those lines up to which they tell."""

_SURFACE_M = 0.025
"""To either side of the middle of the running surface."""

_HOLE_M, _HOLE_SHARE = 0.005, 10.0
"""Distance of two points of the running surface from which on some are missing, and over the usual one."""

_TIP_M, _WHOLE_M = (0.050, 0.066), 0.09
"""Where the tip of a flange lies, from the tape circle, on wheels of railways (S1002: 0.055), and the width
from which on a profile is such a wheel's."""

_CENTRE_M, _HEAD_M = 0.010, (0.05, 0.09)
"""How far the middle of a rail's head may be from lateral zero; and widths of heads."""

_BAND = 0.1
"""Share of a profile's height that is near its top, or its bottom."""


def spike_note(points: Points) -> str | None:
    """A sentence where points stand out of their neighbours; else None."""
    y, z, line = points
    if len(z) < 20:
        return None
    # A corner lies on the lines of both of its sides; a spike lies on neither.
    steps = np.diff(z) / np.maximum(np.diff(y), 1e-6)
    left = z[1:-3] + steps[:-3] * (y[2:-2] - y[1:-3])
    right = z[3:-1] - steps[3:] * (y[3:-1] - y[2:-2])
    off = np.minimum(np.abs(z[2:-2] - left), np.abs(z[2:-2] - right))
    flat = np.maximum(np.abs(steps[:-3]), np.abs(steps[3:])) < _STEEP
    usual = float(np.median(off))
    apart = np.flatnonzero(flat & (off > _SPIKE_M) & (off > _SPIKE_SPREADS * usual))
    if not apart.size:
        return None
    worst = int(apart[np.argmax(off[apart])])
    more = f", and {apart.size - 1} more such points" if apart.size > 1 else ""
    return (
        f"doubtful: the point of line {int(line[worst + 2])} stands {1e3 * off[worst]:.2f} mm out of its "
        f"neighbours{more}: no surface has such a step; the spline goes through it, unless it is dropped"
    )


def refuse_upside_down(y: FloatArray, z: FloatArray) -> None:
    """Refuse a rail's head whose broad side is the lower one.

    Raises
    ------
    InputError
        With the remedy.
    """
    height, wide = float(np.ptp(z)), np.abs(np.diff(y))
    if not _HEAD_M[0] < np.ptp(y) < _HEAD_M[1] or height <= 0.0:
        return
    low, high = (
        float(wide[(near[:-1] < _BAND * height) & (near[1:] < _BAND * height)].sum())
        for near in (z - z.min(), z.max() - z)
    )
    if high > 2.0 * low:
        raise InputError(
            "the head is upside down: its broad side is the lower one",
            field="depth",
            value=f"{1e3 * low:.1f} mm wide at its top, {1e3 * high:.1f} mm at its bottom",
            limit="broad at its top",
            remedy="depth is positive downward: set mirror.z, or turn the sign of the second column",
        )


def hole_note(y: FloatArray, *, around_m: float) -> str | None:
    """A sentence where points of the running surface are missing; else None."""
    inside = y[np.abs(y - around_m) < _SURFACE_M + _HOLE_M]
    steps = np.diff(inside)
    if len(steps) < 10:
        return None
    worst = int(np.argmax(steps))
    if steps[worst] < max(_HOLE_M, _HOLE_SHARE * float(np.median(steps))):
        return None
    return (
        f"doubtful: there are no points between {1e3 * inside[worst]:.1f} and "
        f"{1e3 * inside[worst + 1]:.1f} mm of the running surface: a spline bridges that, and contact is "
        "made up there"
    )


def tip_note(y: FloatArray) -> str | None:
    """A sentence where the flange's tip is not where those of wheels are; else None."""
    if np.ptp(y) < _WHOLE_M or _TIP_M[0] <= -y[0] <= _TIP_M[1]:
        return None
    return (
        f"doubtful: the flange's tip is {-1e3 * y[0]:.1f} mm from lateral zero, on most wheels "
        f"{1e3 * _TIP_M[0]:g} to {1e3 * _TIP_M[1]:g} mm: zero has to be the tape circle; say where it is by "
        "tape_circle_mm"
    )


def centre_note(y: FloatArray) -> str | None:
    """A sentence where a rail's head lies beside lateral zero; else None."""
    middle = 0.5 * float(y[0] + y[-1])
    if abs(middle) < _CENTRE_M or not _HEAD_M[0] < np.ptp(y) < _HEAD_M[1]:
        return None
    return (
        f"doubtful: the middle of the head is at {1e3 * middle:.1f} mm: lateral zero has to be the middle of "
        "the head, so subtract that from the first column"
    )
