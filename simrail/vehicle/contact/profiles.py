"""Cross-sections of wheels and rails: what the metal looks like, and nothing about contact.

A profile is a list of points in metres, dense enough that a cubic spline through them is the
profile. Formulas make the standard ones; profiles of other origin are built the same way from
their own points. Both kinds use *side coordinates*: lateral positive outward (towards the field
side), so that one profile serves the left and the right side; depth positive downward.

Not here: where the rail lies in the track (gauge, inclination) and where wheel and rail touch;
that is `simrail.vehicle.contact.contact_geometry`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

_STEP_M = 5e-5
"""Spacing of generated points: the spline through them is then good to 1e-8 m at a step of curvature."""


@dataclass(frozen=True)
class WheelProfile:
    """Cross-section of a wheel, from the flange (negative) to the field side (positive).

    Attributes
    ----------
    name : str
        Short name, e.g. ``"S1002"``.
    lateral_m : ndarray, shape (n,)
        Strictly increasing distance from the tape circle, outward.
    depth_m : ndarray, shape (n,)
        Depth of the profile below the tape circle's point; the wheel's radius is
        ``wheel_radius_m + depth_m``. It ends at the flange tip, the deepest point.
    source : str
        Where the shape comes from.
    notes : tuple of str
        What was done with the points of a file, and what is to be known of them.
    """

    name: str
    lateral_m: FloatArray
    depth_m: FloatArray
    source: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class RailProfile:
    """Cross-section of an upright rail's head, from the gauge side over the top to the field side.

    Attributes
    ----------
    name : str
        Short name, e.g. ``"60E1"``.
    lateral_m, depth_m : ndarray, shape (n,)
        Points along the surface; lateral from the rail's axis (outward positive) does not go back
        along the list, depth from the head's top.
    source : str
        Where the shape comes from.
    notes : tuple of str
        As of `WheelProfile`.
    """

    name: str
    lateral_m: FloatArray
    depth_m: FloatArray
    source: str
    notes: tuple[str, ...] = ()


_Profile = TypeVar("_Profile", WheelProfile, RailProfile)


def scaled(profile: _Profile, scale: float) -> _Profile:
    """A profile of the same shape at another size, e.g. at 0.1 for a vehicle of 1:10."""
    if scale == 1.0:
        return profile
    return replace(
        profile,
        name=f"{profile.name} at 1:{1.0 / scale:g}",
        lateral_m=scale * profile.lateral_m,
        depth_m=scale * profile.depth_m,
        source=f"{profile.source}, at 1:{1.0 / scale:g}",
    )


def check_profile(profile: WheelProfile | RailProfile) -> None:
    """Refuse a profile whose points are not a curve that a cubic spline can follow.

    Raises
    ------
    InputError
        Fewer than 8 points, lengths that differ, values that are not finite, or lateral positions
        that do not increase strictly (folded or unordered profiles).
    """
    y, z = np.asarray(profile.lateral_m), np.asarray(profile.depth_m)
    if y.ndim != 1 or y.shape != z.shape or y.size < 8:
        raise InputError(
            "a profile needs two lists of the same length",
            field=f"{profile.name}.lateral_m, depth_m",
            value=(y.shape, z.shape),
            limit="at least 8 points each",
        )
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise InputError(
            "a profile's points must be finite numbers",
            field=profile.name,
            limit="finite numbers",
            remedy="leave out the others",
        )
    steps = np.diff(y)
    if not (steps > 0.0).all():
        where = int(np.argmin(steps))
        raise InputError(
            f"the profile folds back at point {where + 1}",
            field=f"{profile.name}.lateral_m",
            value=float(y[where + 1]),
            limit=f"> {float(y[where])} m",
            remedy="order the points from the flange or gauge side outward and drop folded ones",
        )


def wheel_depth(profile: WheelProfile) -> CubicSpline:
    """Depth of the wheel over the lateral position as a C2 cubic spline (metres)."""
    check_profile(profile)
    return CubicSpline(profile.lateral_m, profile.depth_m)


def s1002() -> WheelProfile:
    """The S1002 wheel of EN 13715, from its polynomials and arcs.

    The formulas are those published for S1002 (as in CONTACT's and Netter's descriptions of it),
    in millimetres: field-side cone, tread and root polynomials, root arc of 13 mm, 70 degree flange
    and flange tip of 20 and 12 mm. The back of the flange is left out: it never meets the rail head.
    """
    edges = [-55.0, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796, 60.0]
    tread = [0.0, -3.358537058e-2, 1.565681624e-3, -2.810427944e-5, 5.844240864e-8, -1.562379023e-8]
    tread += [5.309217349e-15, -5.957839843e-12, 2.646656573e-13]
    root = [-4.320221063e3, -1.038384026e3, -1.065501873e2, -6.051367875, -2.054332446e-1]
    root += [-4.169739389e-3, -4.687195829e-5, -2.252755540e-7]
    pieces: list[Callable[[FloatArray], npt.NDArray[np.floating]]] = [
        lambda s: 16.0 + np.sqrt(12.0**2 - (s + 55.0) ** 2),
        lambda s: 8.834924130 + np.sqrt(20.0**2 - (s + 58.558326413) ** 2),
        lambda s: -93.576667419 - 2.747477419 * s,
        lambda s: 16.446 - np.sqrt(13.0**2 - (s + 26.210665) ** 2),
        lambda s: np.polynomial.polynomial.polyval(s, root),
        lambda s: np.polynomial.polynomial.polyval(s, tread),
        lambda s: 1.364323640 - 0.066666667 * s,
    ]
    s_mm = np.arange(edges[0], edges[-1] + 1e-9, _STEP_M * 1e3)
    piece = np.clip(np.searchsorted(edges, s_mm, side="right") - 1, 0, len(pieces) - 1)
    depth_mm = np.choose(piece, [np.zeros_like(s_mm)] * len(pieces))
    for i, formula in enumerate(pieces):
        depth_mm[piece == i] = formula(s_mm[piece == i])
    return WheelProfile("S1002", s_mm * 1e-3, depth_mm * 1e-3, "EN 13715, S1002 formulas")


def conical_wheel(
    conicity: float,
    *,
    flange_angle_rad: float = np.deg2rad(70.0),
    root_start_m: float = -0.027,
    root_radius_m: float = 0.013,
    tip_radius_m: float = 0.012,
    flange_height_m: float = 0.028,
) -> WheelProfile:
    """A straight cone with a flange: the wheel of the textbooks, for teaching and for exact checks.

    Parameters
    ----------
    conicity : float
        Tangent of the cone's angle, 0 to 0.4: the radius falls by it per metre outward.
    flange_angle_rad : float
        Angle of the straight part of the flange.
    root_start_m : float
        Lateral position (negative) where the cone ends and the root arc begins.
    root_radius_m, tip_radius_m : float
        Radii of root and flange tip.
    flange_height_m : float
        Depth of the flange tip below the tape circle's point.

    Returns
    -------
    WheelProfile

    Raises
    ------
    InputError
        If conicity or flange do not make a profile.
    """
    angle0, angle1 = np.arctan(conicity), flange_angle_rad
    if not 0.0 <= conicity <= 0.4:
        raise InputError("conicity out of range", field="conicity", value=conicity, limit="0 to 0.4")
    # Going inward, the slope rises from the cone's through the root arc to the flange's.
    top = -conicity * root_start_m
    centre_s = root_start_m + root_radius_m * np.sin(angle0)
    centre_z = top + root_radius_m * np.cos(angle0)
    s1 = centre_s - root_radius_m * np.sin(angle1)
    z1 = centre_z - root_radius_m * np.cos(angle1)
    z2 = flange_height_m - tip_radius_m * (1.0 - np.cos(angle1))
    if z2 <= z1:
        raise InputError(
            "the flange is too low for its root and tip radii",
            field="flange_height_m",
            value=flange_height_m,
            limit=f"> {flange_height_m + z1 - z2:.4f} m",
        )
    s2 = s1 - (z2 - z1) / np.tan(angle1)
    tip_s = s2 - tip_radius_m * np.sin(angle1)
    s = np.arange(tip_s, 0.06, _STEP_M)
    depth = -conicity * s
    arc = (s < root_start_m) & (s >= s1)
    depth[arc] = centre_z - np.sqrt(root_radius_m**2 - (s[arc] - centre_s) ** 2)
    line = (s < s1) & (s >= s2)
    depth[line] = z1 + (s1 - s[line]) * np.tan(angle1)
    tip = s < s2
    depth[tip] = flange_height_m - tip_radius_m + np.sqrt(tip_radius_m**2 - (s[tip] - tip_s) ** 2)
    return WheelProfile(f"cone {conicity:g}", s, depth, "formula: cone, root arc, straight flange, tip arc")


def worn(
    wheel: WheelProfile, *, wear_m: float, centre_m: float = -0.002, width_m: float = 0.015
) -> WheelProfile:
    """A wheel with a hollow worn into its tread: a *synthetic* shape, no measured one.

    Parameters
    ----------
    wheel : WheelProfile
        The wheel when new.
    wear_m : float
        Depth of metal worn away where it is most, 0 to 0.6 mm.
    centre_m, width_m : float
        Where that is, outward from the tape circle, and the standard deviation of the hollow.

    Returns
    -------
    WheelProfile

    Notes
    -----
    ``depth(s) = depth0(s) - wear (h(s) - h(0)),  h(s) = exp(-((s - centre)/width)^2 / 2)``: the tape
    circle stays the datum, so that the wheel's radius is that of the worn wheel.
    """
    if not 0.0 <= wear_m <= 6e-4:
        raise InputError("wear out of range", field="wear_m", value=wear_m, limit="0 to 0.6 mm (6e-4 m)")
    hollow = np.exp(-0.5 * ((wheel.lateral_m - centre_m) / width_m) ** 2)
    datum = np.exp(-0.5 * (centre_m / width_m) ** 2)
    return WheelProfile(
        f"{wheel.name} worn {wear_m * 1e3:g} mm",
        wheel.lateral_m,
        wheel.depth_m - wear_m * (hollow - datum),
        f"synthetic: {wheel.name} less a Gaussian hollow of {wear_m * 1e3:g} mm, no measured profile",
    )


def rail_60e1() -> RailProfile:
    """The head of the 60E1 (UIC 60) rail of EN 13674-1, upright, from its radii.

    Arcs of 300, 80 and 13 mm, tangent to each other, then the head's side at 1:20. The arcs meet
    where they do in the UIC 60 profile of the Manchester contact benchmark (10.5 and 25.99 mm from
    the axis), so that published contact results hold for this rail: the running surface
    agrees to 2 um, the gauge corner to 6 um.
    """
    return rail_head(
        "60E1",
        radii_m=(0.300, 0.080, 0.013),
        joints_m=(0.0105, 0.025988036),
        side_slope=1.0 / 20.0,
        source="EN 13674-1 radii, joints as in the Manchester contact benchmark",
    )


def rail_head(
    name: str,
    *,
    radii_m: tuple[float, ...],
    joints_m: tuple[float, ...],
    side_slope: float,
    source: str,
    side_length_m: float = 0.015,
) -> RailProfile:
    """A symmetric rail head of tangent arcs and a straight side.

    Parameters
    ----------
    name, source : str
        As in `RailProfile`.
    radii_m : tuple of float
        Radii from the top outward.
    joints_m : tuple of float
        Lateral positions where one radius gives way to the next; one fewer than the radii. The last
        arc ends where it has the side's direction.
    side_slope : float
        Lateral over vertical along the side, e.g. 1/20.
    side_length_m : float
        How far down the side is drawn.

    Returns
    -------
    RailProfile
    """
    if len(joints_m) != len(radii_m) - 1:
        raise InputError(
            "a rail head needs one joint between each two radii",
            field=f"{name}.joints_m",
            value=joints_m,
            limit=f"{len(radii_m) - 1} joints",
        )
    angle, y, z = 0.0, 0.0, 0.0
    ys, zs = [np.zeros(1)], [np.zeros(1)]
    side_angle = 0.5 * np.pi - np.arctan(side_slope)
    for i, radius in enumerate(radii_m):
        end = np.arcsin(np.sin(angle) + (joints_m[i] - y) / radius) if i < len(joints_m) else side_angle
        steps = max(8, round(radius * (end - angle) / _STEP_M))
        angles = np.linspace(angle, end, steps + 1)[1:]
        ys.append(y + radius * (np.sin(angles) - np.sin(angle)))
        zs.append(z + radius * (np.cos(angle) - np.cos(angles)))
        angle, y, z = float(end), float(ys[-1][-1]), float(zs[-1][-1])
    lengths = np.linspace(0.0, side_length_m, round(side_length_m / _STEP_M) + 1)[1:]
    ys.append(y + lengths * np.cos(side_angle))
    zs.append(z + lengths * np.sin(side_angle))
    lateral, depth = np.concatenate(ys), np.concatenate(zs)
    return RailProfile(
        name,
        np.concatenate([-lateral[:0:-1], lateral]),
        np.concatenate([depth[:0:-1], depth]),
        source,
    )
