"""Where a wheel and a rail touch, as tables over the lateral shift alone, made once before a ride.

A rigid search for the contact point jumps from tread to gauge corner to flange, and every jump is a
hammer blow to the integrator. Two elastic bodies do not jump: the pressure moves over. Here the
penetration is a *soft maximum* of the vertical interpenetration over the wheel's width, smoothed by
a fixed fraction of the static elastic approach. That makes the table smooth, and, with the
fraction 0.22, puts the contact where the full elastic solution has it.

Two patches, tread and flange, are split at a fixed place of the wheel where the rigid contact would
jump by more than 0.5 in slope. Roll and yaw enter by the derivatives of the soft maximum.

Not here: forces (`simrail.vehicle.contact`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from simrail.errors import InputError
from simrail.jit import FloatArray
from simrail.vehicle.hertz import (
    POISSON_RATIO,
    SHEAR_MODULUS_PA,
    hertz_ellipse,
    kalker_coefficients,
)
from simrail.vehicle.profiles import RailProfile, WheelProfile, wheel_depth

COLUMNS = ("penetration", "abscissa", "depth", "spread", "yaw_rise", "f11", "f22", "f23", "f33")
"""What a patch's table holds, in the order of its columns (see `ContactTable.coef`)."""

_STEEPEST = 30.0
"""The rail head goes on in a straight line beyond this slope: it never carries a wheel there."""
_PROBE_YAW_RAD = 8e-3
"""Yaw at which the exact silhouette of the wheel is taken for the second derivative in yaw."""
_FULL_SCALE_RADIUS_M = 0.46
"""Default lengths of the tables are those of this wheel, and scale with the wheel's radius."""


@dataclass(frozen=True)
class ContactTable:
    """Contact of one wheel with its rail: plain arrays for the compiled kernel.

    Attributes
    ----------
    name : str
        Wheel, rail, inclination and gauge in words.
    coef : ndarray, shape (2, n, 9, 4)
        Cubic pieces over the lateral shift u (outward shift of the wheel on its rail, m): patch
        (tread, flange), interval, column, power. Value ``((c0 x + c1) x + c2) x + c3`` with x the
        distance from the interval's left end. Columns: vertical penetration P; contact abscissa s
        on the wheel and wheel depth F there (m); spread C = var(s)/eps (m); rise with yaw
        D = d2P/dpsi2 (m); creep factors f11, f22, f23, f33, to be multiplied by d, d, d^1.5, d^2
        of the normal approach d.
    const : ndarray, shape (15,)
        u0, 1/du, tape circle half spacing, wheel radius, Hertz constant, friction coefficient,
        normal damping chi, relaxation length and time, Voigt time of the creep states, speed
        below which spin creepage fades, rate of the wind-up limit, limits of u, touch load.
    static_load_n : float
        Wheel load for which the smoothing is made.
    smoothing_m : float
        eps of the tread patch.
    split_m : float or None
        Abscissa on the wheel that parts tread and flange; None when there is one patch.
    """

    name: str
    coef: FloatArray
    const: FloatArray
    static_load_n: float
    smoothing_m: float
    split_m: float | None


@dataclass(frozen=True)
class _Head:
    """A rail head in the track: depth over the abscissa e from the head's highest point, outward."""

    spline: CubicSpline
    gauge_abscissa_m: float

    def depth(self, e: FloatArray) -> FloatArray:
        low, high = float(self.spline.x[0]), float(self.spline.x[-1])
        inside = np.clip(e, low, high)
        beyond = np.where(e < low, low - e, np.maximum(e - high, 0.0))
        return self.spline(inside) + _STEEPEST * beyond

    def slope(self, e: FloatArray) -> FloatArray:
        low, high = float(self.spline.x[0]), float(self.spline.x[-1])
        inside = self.spline(np.clip(e, low, high), 1)
        return np.where(e < low, -_STEEPEST, np.where(e > high, _STEEPEST, inside))


def incline(rail: RailProfile, inclination: float, *, gauge_depth_m: float) -> _Head:
    """Lean a rail towards the track's centre and read its head as depth over the abscissa.

    Parameters
    ----------
    rail : RailProfile
        Upright rail.
    inclination : float
        Tangent of the lean, e.g. 1/40.
    gauge_depth_m : float
        Depth below the head's highest point at which gauge is measured.

    Returns
    -------
    _Head
        With the highest point at abscissa 0, depth 0, and the abscissa of the gauge point (< 0).
    """
    lean = np.arctan(inclination)
    e = rail.lateral_m * np.cos(lean) + rail.depth_m * np.sin(lean)
    z = rail.depth_m * np.cos(lean) - rail.lateral_m * np.sin(lean)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(e), np.diff(z)))])
    es, zs = CubicSpline(length, e), CubicSpline(length, z)
    flat = zs.derivative().roots(extrapolate=False)
    if flat.size == 0:
        raise InputError("the rail's head has no highest point", field=rail.name, value=inclination)
    top = float(flat[np.argmin(zs(flat))])
    e_top, z_top = float(es(top)), float(zs(top))
    gauge = zs.solve(z_top + gauge_depth_m, extrapolate=False)
    gauge = gauge[gauge < top]
    if gauge.size == 0:
        raise InputError(
            "the rail's profile ends above the gauge point",
            field=f"{rail.name}.depth_m",
            value=float(z.max() - z_top),
            limit=f"> {gauge_depth_m} m",
        )
    fine = np.linspace(0.0, float(length[-1]), 4 * length.size)
    steep = np.abs(zs(fine, 1)) > _STEEPEST * es(fine, 1)
    first = fine[(fine < top) & steep].max(initial=0.0)
    last = fine[(fine > top) & steep].min(initial=float(length[-1]))
    keep = fine[(fine > first) & (fine < last)]
    head = CubicSpline(es(keep) - e_top, zs(keep) - z_top)
    return _Head(head, float(es(gauge.max())) - e_top)


def build_contact(
    wheel: WheelProfile,
    rail: RailProfile,
    *,
    static_load_n: float,
    gauge_m: float = 1.435,
    rail_inclination: float = 1.0 / 40.0,
    wheel_radius_m: float = 0.46,
    tape_circle_half_m: float = 0.75,
    gauge_depth_m: float | None = None,
    friction: float = 0.3,
    smoothing: float = 0.22,
    normal_damping_spm: float = 0.6,
    relaxation_length_m: float | None = None,
    relaxation_time_s: float = 3e-4,
    creep_damping_s: float = 1e-4,
    shear_modulus_pa: float = SHEAR_MODULUS_PA,
    poisson_ratio: float = POISSON_RATIO,
    shift_m: tuple[float, float] | None = None,
    split: bool = True,
) -> ContactTable:
    """Tabulate the contact of a wheel on a rail.

    Parameters
    ----------
    wheel, rail : WheelProfile, RailProfile
        Cross-sections.
    static_load_n : float
        Vertical load of this wheel at rest; it sets the smoothing.
    gauge_m, gauge_depth_m : float
        Distance of the rail heads, and how far below their top it is measured.
    rail_inclination : float
        Lean of the rails, e.g. 1/40.
    wheel_radius_m, tape_circle_half_m : float
        Rolling radius at the tape circle and half the distance of the two tape circles.
    friction : float
        Coulomb coefficient.
    smoothing : float
        eps over the static elastic approach. 0.22 fits the elastic solution; below about 0.1 the
        contact chatters like a rigid one.
    normal_damping_spm : float
        chi of N (1 - chi v_n), s/m.
    relaxation_length_m, relaxation_time_s : float
        Creep force builds up over ``length + time |V|``.
    creep_damping_s : float
        Voigt time of the tangential contact spring.
    shear_modulus_pa, poisson_ratio : float
        Of wheel and rail.
    shift_m : tuple of float
        Range of the outward shift u to tabulate; the ride ends as derailed beyond it.
    split : bool
        Whether a flange patch of its own is made where the rigid contact jumps.

    Returns
    -------
    ContactTable

    Raises
    ------
    InputError
        For values that make no contact, naming the field.

    Notes
    -----
    Formulas of the soft maximum: with gap function g(s) = F(s) - z_rail(e), weights
    w ~ exp(g/eps): P = eps ln(integral exp(g/eps) ds / sqrt(2 pi eps/k0)), abscissa <s>, depth <F>,
    dP/du = -<z_rail'> = tan(contact angle), d<s>/d(roll) = -var(s)/eps. The lateral curvature of the
    ellipse is <g'^2>/eps, which unlike eps/var(s) stays right where two places share the load.
    """
    for field, value in (
        ("static_load_n", static_load_n),
        ("gauge_m", gauge_m),
        ("wheel_radius_m", wheel_radius_m),
        ("tape_circle_half_m", tape_circle_half_m),
        ("friction", friction),
        ("smoothing", smoothing),
    ):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError("must be a positive number", field=field, value=value, limit="> 0")
    scale = wheel_radius_m / _FULL_SCALE_RADIUS_M
    depth = wheel_depth(wheel)
    head = incline(rail, rail_inclination, gauge_depth_m=gauge_depth_m or 0.014 * scale)
    datum = 0.5 * gauge_m - head.gauge_abscissa_m
    k0 = 3.0 / scale
    half = np.array(0.5)
    ball = hertz_ellipse(
        half / wheel_radius_m, half * k0, shear_modulus_pa=shear_modulus_pa, poisson_ratio=poisson_ratio
    )
    hertz = float(ball.approach) ** -1.5
    eps = smoothing * (static_load_n / hertz) ** (2.0 / 3.0)

    low, high = shift_m or (-0.020 * scale, 0.014 * scale)
    du = 5e-5 * scale
    u = low + du * np.arange(round((high - low) / du) + 1)
    s = np.arange(depth.x[0], depth.x[-1], 5e-5 * scale)
    geometry = _Pair(depth, head, s, tape_circle_half_m - datum, wheel_radius_m)

    split_at = geometry.split(np.arange(0.0, 0.8 * high, 2e-5 * scale)) if split else None
    patches = [s >= (s[0] if split_at is None else split_at)]
    if split_at is not None:
        patches.append(s < split_at)
    coef = np.zeros((2, u.size - 1, len(COLUMNS), 4))
    coef[1, :, 0, 3] = -1.0  # a flange patch that never touches
    for k, mask in enumerate(patches):
        columns = geometry.patch(
            u,
            mask,
            eps=eps * (1.0 if k == 0 else 2.5),
            k0=k0,
            hertz=hertz,
            shear_modulus_pa=shear_modulus_pa,
            poisson_ratio=poisson_ratio,
            scale=scale,
        )
        pieces = CubicSpline(u, columns).c
        coef[k] = np.moveaxis(pieces, 0, -1)
    const = np.array(
        [
            u[0],
            1.0 / du,
            tape_circle_half_m,
            wheel_radius_m,
            hertz,
            friction,
            normal_damping_spm,
            relaxation_length_m or 0.010 * scale,
            relaxation_time_s,
            creep_damping_s,
            0.1,
            1e3,
            u[0],
            min(u[-1], 0.012 * scale),
            0.01 * static_load_n,
        ]
    )
    name = (
        f"{wheel.name} on {rail.name} 1:{1.0 / rail_inclination:.0f}"
        if rail_inclination
        else (f"{wheel.name} on {rail.name} upright")
    )
    return ContactTable(
        f"{name}, gauge {gauge_m * 1e3:.1f} mm",
        np.ascontiguousarray(coef),
        const,
        static_load_n,
        eps,
        split_at,
    )


@dataclass(frozen=True)
class _Pair:
    """A wheel over its rail: abscissae s, and the offset that turns s + u into a rail abscissa."""

    depth: CubicSpline
    head: _Head
    s: FloatArray
    offset_m: float
    radius_m: float

    def split(self, shifts: FloatArray) -> float | None:
        """Middle of the outermost jump of the rigid contact that changes the slope by over 0.5."""
        wheel = self.depth(self.s)
        at = np.array([np.argmax(wheel - self.head.depth(self.s + self.offset_m + u)) for u in shifts])
        slope = -self.head.slope(self.s[at] + self.offset_m + shifts)
        jumps = np.flatnonzero((np.abs(np.diff(slope)) > 0.5) & (np.abs(np.diff(self.s[at])) > 1e-9))
        if jumps.size == 0:
            return None
        j = int(jumps[-1])
        return float(0.5 * (self.s[at[j]] + self.s[at[j + 1]]))

    def patch(
        self,
        u: FloatArray,
        mask: FloatArray,
        *,
        eps: float,
        k0: float,
        hertz: float,
        shear_modulus_pa: float,
        poisson_ratio: float,
        scale: float,
    ) -> FloatArray:
        """Columns of `COLUMNS` at the shifts u for the part of the wheel in `mask`."""
        s = self.s[mask]
        wheel, wheel_slope = self.depth(s), self.depth(s, 1)
        ds = s[1] - s[0]
        level = eps * np.log(ds / np.sqrt(2.0 * np.pi * eps / k0))
        tan_yaw, sin_yaw, cos_yaw = (f(_PROBE_YAW_RAD) for f in (np.tan, np.sin, np.cos))
        # Silhouette of the yawed wheel, a surface of revolution seen along the rail.
        radius = self.radius_m + wheel
        half = self.offset_m  # only shifts count: the lateral move of each silhouette point
        turned_depth = radius * np.sqrt(np.maximum(1.0 - (wheel_slope * tan_yaw) ** 2, 0.0)) - self.radius_m
        out = np.empty((u.size, len(COLUMNS)))
        for i, shift in enumerate(u):
            e = s + half + shift
            gap = wheel - self.head.depth(e)
            top = gap.max()
            weight = np.exp((gap - top) / eps)
            total = weight.sum()
            weight /= total
            mean_s = weight @ s
            out[i, 0] = top + eps * np.log(total) + level
            out[i, 1] = mean_s
            out[i, 2] = weight @ wheel
            out[i, 3] = weight @ (s - mean_s) ** 2 / eps
            out[i, 5] = weight @ (wheel_slope - self.head.slope(e)) ** 2 / eps
            out[i, 6] = -(weight @ self.head.slope(e))
            out[i, 4] = sin_yaw + cos_yaw + tan_yaw  # replaced below
        lever = s + 0.75
        turned_s = lever * cos_yaw - radius * wheel_slope * sin_yaw**2 / cos_yaw - 0.75
        for i, shift in enumerate(u):
            gap = turned_depth - self.head.depth(turned_s + half + shift)
            top = gap.max()
            turned = top + eps * np.log(np.exp((gap - top) / eps).sum()) + level
            out[i, 4] = (turned - out[i, 0]) / (0.5 * _PROBE_YAW_RAD**2)
        cos_contact = 1.0 / np.sqrt(1.0 + out[:, 6] ** 2)
        curvature = np.clip(out[:, 5] * cos_contact**3, 0.2 / scale, 3000.0 / scale)
        ellipse = hertz_ellipse(
            0.5 * cos_contact / (self.radius_m + out[:, 2]),
            0.5 * curvature,
            shear_modulus_pa=shear_modulus_pa,
            poisson_ratio=poisson_ratio,
        )
        c11, c22, c23, c33 = kalker_coefficients(ellipse.a / ellipse.b)
        area = ellipse.a * ellipse.b
        force = hertz ** (1.0 / 3.0)  # N^(1/3) = force d^(1/2)
        out[:, 5] = shear_modulus_pa * area * c11 * force**2
        out[:, 6] = shear_modulus_pa * area * c22 * force**2
        out[:, 7] = shear_modulus_pa * area**1.5 * c23 * force**3
        out[:, 8] = shear_modulus_pa * area**2 * c33 * force**4
        return out
