"""A wheel's cross-section over a rail's: gap, rigid contact, and the soft maximum that replaces it.

The *shift* u is how far the wheel has moved outward on its rail. A point s of the wheel (abscissa
from the tape circle, outward) then stands over the rail's abscissa e = s + u + offset, and the gap
function g(s) = wheel depth - rail depth(e) says how deep the two interpenetrate at nominal height.

Not here: tables, elasticity (`simrail.vehicle.contact.contact_geometry`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.profiles import RailProfile

_STEEPEST = 30.0
"""A rail head goes on in a straight line beyond this slope: no wheel rests there."""
_PROBE_YAW_RAD = 8e-3
"""Yaw at which the exact silhouette of the wheel is taken for the second derivative in yaw."""
_YAW_MARGIN = 2e-3
"""Of the wheel radius: no point of the wheel rises by more at the probe yaw while it can touch."""
_SPLIT_SLOPE = 0.5
"""A jump of the rigid contact by more than this slope makes a flange patch of its own."""


@dataclass(frozen=True)
class RailHead:
    """A rail head as it lies in the track: depth over the abscissa, both from its highest point.

    Attributes
    ----------
    spline : scipy.interpolate.CubicSpline
        Depth (m, downward) over the abscissa (m, outward) of the part that can carry a wheel.
    gauge_abscissa_m : float
        Abscissa of the point where gauge is measured, negative.
    """

    spline: CubicSpline
    gauge_abscissa_m: float

    def depth(self, e: FloatArray) -> FloatArray:
        """Depth (m) at abscissa e, going on steeply beyond the head."""
        inside = np.clip(e, self.spline.x[0], self.spline.x[-1])
        depth: FloatArray = self.spline(inside) + _STEEPEST * np.abs(e - inside)
        return depth

    def slope(self, e: FloatArray) -> FloatArray:
        """Derivative of `depth`."""
        inside = np.clip(e, self.spline.x[0], self.spline.x[-1])
        return np.where(e == inside, self.spline(inside, 1), _STEEPEST * np.sign(e - inside))


def incline(rail: RailProfile, inclination: float, *, gauge_depth_m: float) -> RailHead:
    """Lean a rail towards the track's centre and read off its head.

    Parameters
    ----------
    rail : RailProfile
        Upright rail.
    inclination : float
        Tangent of the lean, e.g. 1/40; 0 for a rail that is upright or given as it lies.
    gauge_depth_m : float
        Depth below the head's highest point at which gauge is measured.

    Returns
    -------
    RailHead

    Raises
    ------
    InputError
        If the profile has no highest point or ends above the gauge point.
    """
    lean = np.arctan(inclination)
    e = rail.lateral_m * np.cos(lean) + rail.depth_m * np.sin(lean)
    z = rail.depth_m * np.cos(lean) - rail.lateral_m * np.sin(lean)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(e), np.diff(z)))])
    es, zs = CubicSpline(length, e), CubicSpline(length, z)
    flat = zs.derivative().roots(extrapolate=False)
    flat = flat[zs(flat, 2) > 0.0]
    if flat.size == 0:
        raise InputError(
            "the rail's head has no highest point inside its profile",
            field=f"{rail.name}.depth_m",
            remedy="depth is positive downward",
            limit="a head whose top is inside",
        )
    top = float(flat[np.argmin(zs(flat))])
    e_top, z_top = float(es(top)), float(zs(top))
    gauge = zs.solve(z_top + gauge_depth_m, extrapolate=False)
    gauge = gauge[gauge < top]
    if gauge.size == 0:
        raise InputError(
            "the rail's profile ends above the point where gauge is measured",
            field=f"{rail.name}.depth_m",
            value=float(z[0] - z_top),
            limit=f"> {gauge_depth_m} m on the gauge side",
        )
    fine = np.linspace(0.0, float(length[-1]), 2 * length.size)
    steep = np.abs(zs(fine, 1)) > _STEEPEST * es(fine, 1)
    first = fine[(fine < top) & steep].max(initial=-1.0)
    last = fine[(fine > top) & steep].min(initial=2.0 * float(length[-1]))
    keep = fine[(fine > first) & (fine < last)]
    return RailHead(CubicSpline(es(keep) - e_top, zs(keep) - z_top), float(es(gauge.max())) - e_top)


class SoftContact(NamedTuple):
    """Soft maximum of the gap and its moments over a grid of shifts; all arrays of its shape."""

    penetration: FloatArray
    roll_rise: FloatArray
    spread: FloatArray
    yaw_rise: FloatArray
    abscissa: FloatArray
    depth: FloatArray
    slope: FloatArray
    curvature: FloatArray


@dataclass(frozen=True)
class ContactPair:
    """A wheel over its rail.

    Attributes
    ----------
    depth : scipy.interpolate.CubicSpline
        Wheel depth over its abscissa.
    head : RailHead
        The rail.
    s : ndarray
        Uniform abscissae of the wheel at which the gap is taken.
    half_m : float
        Distance of the tape circle from the axle's middle.
    offset_m : float
        Rail abscissa under the tape circle at shift 0.
    radius_m : float
        Wheel radius at the tape circle.
    """

    depth: CubicSpline
    head: RailHead
    s: FloatArray
    half_m: float
    offset_m: float
    radius_m: float

    def rigid(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rigid one-point contact: gap, abscissa on the wheel and slope there, for each shift."""
        wheel = self.depth(self.s)
        gap, at = np.empty(u.size), np.empty(u.size, dtype=int)
        for i, shift in enumerate(u):
            g = wheel - self.head.depth(self.s + (self.offset_m + shift))
            at[i] = np.argmax(g)
            gap[i] = g[at[i]]
        return gap, self.s[at], -self.head.slope(self.s[at] + self.offset_m + u)

    def split(self, u: FloatArray) -> float | None:
        """Middle of the outermost jump of the rigid contact that changes its slope by over 0.5."""
        _, at, slope = self.rigid(u)
        jumps = np.flatnonzero((np.abs(np.diff(slope)) > _SPLIT_SLOPE) & (np.diff(at) < 0.0))
        if jumps.size == 0:
            return None
        return float(0.5 * (at[jumps[-1]] + at[jumps[-1] + 1]))

    def soften(
        self, u: FloatArray, mask: npt.NDArray[np.bool_], *, eps_m: float, k0_1pm: float
    ) -> SoftContact:
        """Soft maximum of the gap over the part of the wheel in `mask`, and its moments.

        Parameters
        ----------
        u : ndarray, shape (n,)
            Shifts.
        mask : ndarray of bool, shape of `s`
            Part of the wheel. Fixed on the wheel, so that everything stays smooth in u.
        eps_m : float
            Smoothing length.
        k0_1pm : float
            Relative curvature for which a single smooth contact gives its rigid gap.

        Returns
        -------
        SoftContact
            With weights w ~ exp(g/eps): penetration ``eps ln(int exp(g/eps) ds / sqrt(2 pi eps/k0))``,
            its first derivative in roll (the tape circle's distance aside) <F> slope - <s> and
            second, the spread var(s)/eps, its second derivative in yaw, mean abscissa and depth,
            slope = d penetration/du, and the curvature <g'^2>/eps.
        """
        s = self.s[mask]
        wheel, wheel_slope = self.depth(s), self.depth(s, 1)
        level = eps_m * np.log((s[1] - s[0]) / np.sqrt(2.0 * np.pi * eps_m / k0_1pm))
        # Silhouette, seen along the rail, of the wheel (a surface of revolution) turned in yaw.
        radius = self.radius_m + wheel
        cos, sin, tan = np.cos(_PROBE_YAW_RAD), np.sin(_PROBE_YAW_RAD), np.tan(_PROBE_YAW_RAD)
        turned_e = (self.half_m + s) * cos - radius * wheel_slope * sin**2 / cos - self.half_m
        turned_z = radius * np.sqrt(np.maximum(1.0 - (wheel_slope * tan) ** 2, 0.0)) - self.radius_m
        out = SoftContact(*np.empty((len(SoftContact._fields), u.size)))
        for i, shift in enumerate(u + self.offset_m):
            gap = wheel - self.head.depth(s + shift)
            top = gap.max()
            # All else is below exp(-60), upright or turned.
            near = np.flatnonzero(gap > top - 60.0 * eps_m - _YAW_MARGIN * self.radius_m)
            at, rail_slope = s[near], self.head.slope(s[near] + shift)
            w = np.exp((gap[near] - top) / eps_m)
            total = w.sum()
            w /= total
            out.penetration[i] = top + eps_m * np.log(total) + level
            out.abscissa[i] = w @ at
            out.depth[i] = w @ wheel[near]
            out.spread[i] = w @ (at - out.abscissa[i]) ** 2 / eps_m
            out.slope[i] = -(w @ rail_slope)
            out.curvature[i] = w @ (wheel_slope[near] - rail_slope) ** 2 / eps_m
            out.roll_rise[i] = out.depth[i] * out.slope[i] - out.abscissa[i]
            gap = turned_z[near] - self.head.depth(turned_e[near] + shift)
            top = gap.max()
            turned = top + eps_m * np.log(np.exp((gap - top) / eps_m).sum()) + level
            out.yaw_rise[i] = (turned - out.penetration[i]) / (0.5 * _PROBE_YAW_RAD**2)
        return out
