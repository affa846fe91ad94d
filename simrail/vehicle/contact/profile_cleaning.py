"""What of a measured profile a wheel and a rail touch each other with, and what is said of the rest.

A device traces all of a wheel that it reaches: the flange's back, the tread, the chamfer and the face of the
rim; and of a rail the head with what lies under it. Contact needs the part from the flange's tip to the rim,
and the head as it is seen from above. What is left out, turned round or left as it was measured is told in
notes, never silently done. Nothing is smoothed; of points that scatter a note warns.

All lengths are in metres, depth positive downward; `line` is where a point stands in its file.
"""

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.profile_points import Points, refuse_folded

TAPE_CIRCLE_M = 0.070
"""Where a MiniProf has the tape circle, from the back of the flange, unless its header says otherwise."""

_BACK_M = 0.003
"""Of the flange's back from lateral zero, that a MiniProf file may have."""
_SMALL_FOLD_M = 2e-4
"""Points that go back by less are scatter, more is another order of points."""
_TIP_FOLD_M, _TIP_M = 1e-3, 3e-3
"""Fold that two scans leave where they meet at the flange's tip, and how far that reaches."""
_RIM_FROM_M, _RIM_CHORD_M, _RIM_SLOPE = 0.020, 1.5e-3, 0.5
"""Beyond the first, outward of the tape circle, a chord of the second that rises more steeply is the rim."""
_UPRIGHT_M = 5e-4
"""Undercut that is the lean or scatter of a head's side; what goes back further lies under the head."""
_DEEP_M, _SHALLOW_M = 0.008, 0.004
"""A head that was measured down one side only: its depth there, and on the other side."""
_ROUGH_M, _ROUGH_SPAN_M = 1e-6, 4e-3
"""Scatter about a parabola over so many metres from which on the curvature of the spline is that of noise."""


def clean_wheel(points: Points, *, tape_circle_m: float | None, notes: list[str]) -> Points:
    """The running surface of a wheel, from the flange's tip outward, lateral zero at the tape circle.

    Parameters
    ----------
    points : tuple of ndarray (n,)
        Lateral position, depth and line, along the surface in either direction, the flange on either side.
    tape_circle_m : float, optional
        Lateral position of the tape circle in the file; 0 if not given.
    notes : list of str
        What was done is added to it.

    Raises
    ------
    InputError
        If the points do not reach over the tape circle, or fold back.
    """
    y, z, line = points
    tape = tape_circle_m or 0.0
    tip = int(np.argmax(z))
    # The back of a flange is some 30 mm away from its tip, the rim 100 mm.
    mirrored = np.max(y) - y[tip] < y[tip] - np.min(y)
    if mirrored:
        notes.append("the flange is on the right: the profile is mirrored")
    y = (-1.0 if mirrored else 1.0) * (y - tape)
    if y[-1] < y[0]:
        y, z, line = y[::-1], z[::-1], line[::-1]
    tip = int(np.argmax(z))
    behind = float(np.ptp(y[: tip + 1]))
    if behind > _SMALL_FOLD_M:
        notes.append(f"{tip} points behind the flange's tip, {1e3 * behind:.1f} mm, are left out")
    y, z, line = y[tip:], z[tip:], line[tip:]
    if not y[0] < 0.0 < np.max(y):
        raise InputError(
            "the points do not reach over the tape circle, where lateral position is 0",
            field="lateral position",
            value=f"flange tip at {1e3 * y[0]:.1f} mm, field side at {1e3 * np.max(y):.1f} mm",
            limit="flange tip < 0 m < field side",
            remedy="say in the vehicle file where the tape circle lies in this one: tape_circle_mm = 70.0 if "
            "lateral zero is the flange's back; or shift the points so that the tape circle is at 0",
        )
    end = _rim(y, z)
    if end < y.size:
        rim = f"{y.size - end} points of the rim, from {1e3 * y[end - 1]:.1f} mm outward, are left out"
        notes.append(rim)
    return _advancing((y[:end], z[:end], line[:end]), notes, strictly=True)


def miniprof_tape_circle(y: FloatArray, z: FloatArray, header: dict[str, str]) -> float:
    """Where the tape circle of a MiniProf's wheel lies in its file: so far from the back of the flange.

    Raises
    ------
    InputError
        If the flange's back is not where such a file has its zero.
    """
    taper = header.get("wheeldiametertaperline", "")
    try:
        away = float(taper) / 1e3
    except ValueError:
        away = TAPE_CIRCLE_M
    tip = int(np.argmax(z))
    left = np.max(y) - y[tip] >= y[tip] - np.min(y)
    back = float(np.min(y) if left else np.max(y))
    if abs(back) > _BACK_M:
        raise InputError(
            "the back of the flange is not at 0, from where a MiniProf counts the tape circle",
            field="lateral position",
            value=f"{1e3 * back:.1f} mm",
            limit=f"within {1e3 * _BACK_M:g} mm",
            remedy="say in the vehicle file where the tape circle lies in this one, e.g. "
            "tape_circle_mm = 70.0",
        )
    return away if left else -away


def _rim(y: FloatArray, z: FloatArray) -> int:
    """How many points lie before the rim, where the surface turns up to its chamfer and face."""
    widest = int(np.argmax(y)) + 1
    for i in np.flatnonzero(y[:widest] > _RIM_FROM_M):
        first = int(np.searchsorted(np.maximum.accumulate(y[: i + 1]), y[i] - _RIM_CHORD_M))
        if first < i and z[first] - z[i] > _RIM_SLOPE * (y[i] - y[first]):
            return first + 1
    return widest


def clean_rail(points: Points, *, notes: list[str]) -> Points:
    """The head of a rail as it is seen from above, from the gauge side (negative) outward.

    Parameters are those of `clean_wheel`.

    Raises
    ------
    InputError
        If the points fold back on the head.
    """
    y, z, line = points
    top = int(np.argmin(z))
    near = slice(max(top - 2, 0), top + 3)
    if np.sum(np.diff(y[near])) < 0.0:
        y, z, line, top = y[::-1], z[::-1], line[::-1], y.size - 1 - top
    left, right = (float(np.max(side) - z[top]) for side in (z[: top + 1], z[top:]))
    if right > _DEEP_M and left < _SHALLOW_M:
        notes.append(
            f"the head was measured down its right side only ({1e3 * right:.1f} mm, on the left "
            f"{1e3 * left:.1f} mm): that is taken for the gauge side, and the profile is mirrored"
        )
        y, z, line, top = -y[::-1], z[::-1], line[::-1], y.size - 1 - top
    outer = _side((y[top:], z[top:], line[top:]), "field", notes)
    inner = _side((-y[top::-1], z[top::-1], line[top::-1]), "gauge", notes)
    parts = zip((-inner[0], inner[1], inner[2]), outer, strict=True)
    y, z, line = (np.concatenate([gauge[:0:-1], field]) for gauge, field in parts)
    return y, z, line


def _side(points: Points, side: str, notes: list[str]) -> Points:
    """One side of a head from its top outward, without what lies under it."""
    y, z, line = points
    widest = int(np.argmax(y))
    under = np.flatnonzero(y[widest:] < y[widest] - _UPRIGHT_M)
    end = y.size if under.size == 0 else widest + int(under[0])
    if end < y.size:
        notes.append(
            f"{y.size - end} points under the head on the {side} side, {1e3 * (z[end - 1] - z[0]):.1f} mm "
            "below its top and deeper, are left out"
        )
    upright = np.maximum.accumulate(y[:end])
    raised = int(np.count_nonzero(upright[widest:] > y[widest:end]))
    if raised:
        notes.append(f"{raised} points of the {side} side that lean inward are set upright")
    y = np.concatenate([y[:widest], upright[widest:end]])
    return _advancing((y, z[:end], line[:end]), notes, strictly=False)


def _advancing(points: Points, notes: list[str], *, strictly: bool) -> Points:
    """Points that go outward; the few that scatter takes back are dropped.

    Raises
    ------
    InputError
        If one goes back by more than scatter.
    """
    y, z, line = points
    reached = np.maximum.accumulate(y)
    back = reached - y
    at_tip = strictly & (y - y[0] < _TIP_M)
    if (back > np.where(at_tip, _TIP_FOLD_M, _SMALL_FOLD_M)).any():
        refuse_folded(y, line, least=0.0 if strictly else -1e-12)
    before = np.concatenate([[-np.inf], reached[:-1]])
    keep = y > before if strictly else y >= before
    if not keep.all():
        notes.append(f"{np.count_nonzero(~keep)} points that go back by less than a millimetre are left out")
    return y[keep], z[keep], line[keep]


def roughness_note(y: FloatArray, z: FloatArray, *, around_m: float) -> str | None:
    """A warning where points scatter so much that the spline through them bends with the noise; else None.

    Parameters
    ----------
    y, z : ndarray (n,)
        Points, lateral position rising.
    around_m : float
        Middle of the running surface, of which 25 mm to either side are judged.

    Notes
    -----
    The scatter is what is left of each point after a parabola through its neighbours within 2 mm, robustly:
    1.48 times the median of its magnitude. Points h apart that scatter by e bend the spline by about e 4/h^2.
    """
    inside = np.flatnonzero(np.abs(y - around_m) < 0.025)
    left = []
    for i in inside:
        near = np.flatnonzero(np.abs(y - y[i]) <= 0.5 * _ROUGH_SPAN_M)
        if near.size >= 6:
            t = (y[near] - y[i]) / _ROUGH_SPAN_M
            # A parabola takes 3 of the degrees of freedom.
            share = np.sqrt(near.size / (near.size - 3.0))
            left.append(share * (z[i] - np.polyval(np.polyfit(t, z[near], 2), 0.0)))
    if len(left) < 10:
        return None
    scatter = 1.48 * float(np.median(np.abs(left)))
    if scatter <= _ROUGH_M:
        return None
    apart = float(np.median(np.diff(y[inside])))
    return (
        f"the points scatter by {1e6 * scatter:.1f} um about a smooth curve, {1e3 * apart:.2f} mm apart: the "
        f"spline goes through each, and bends by about {4.0 * scatter / apart**2:.0f} 1/m, the head of a new "
        "rail by 3 to 12; smooth them first, contact is that of the noise"
    )
