"""Where a wheel and a rail touch, as tables over the lateral shift alone, made once before a ride.

A rigid search for the contact point jumps from tread to gauge corner to flange, and every jump is a
hammer blow to the integrator. Two elastic bodies do not jump: the pressure moves over. Here the
penetration is a *soft maximum* of the vertical interpenetration over the wheel's width, smoothed by
a fixed fraction of the static elastic approach. That makes the table smooth, and, with the
fraction 0.22, puts the contact where the full elastic solution has it.

Two patches, tread and flange, are split at a fixed place of the wheel where the rigid contact would
jump by more than 0.5 in slope. Roll and yaw enter by the derivatives of the soft maximum.

Not here: forces (`simrail.vehicle.contact.contact`).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.vehicle.contact.contact_pair import ContactPair, SoftContact, incline
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.contact.hertz import SHEAR_MODULUS_PA, hertz_ellipse, kalker_coefficients
from simrail.vehicle.contact.profiles import RailProfile, WheelProfile, wheel_depth

COLUMNS = (*SoftContact._fields[:6], "f11", "f22", "f23", "f33", "semi_axis_along", "semi_axis_across")
"""What a patch's table holds, in the order of its columns (see `ContactTable.coef`)."""
CONSTANTS = (
    "first_shift_m",
    "intervals_per_m",
    "tape_circle_half_m",
    "wheel_radius_m",
    "hertz_npm15",
    "friction",
    "normal_damping_spm",
    "relaxation_length_m",
    "relaxation_time_s",
    "creep_damping_s",
    "spin_speed_mps",
    "windup_rate_1ps",
    "derailed_shift_m",
    "touch_load_n",
    "rail_offset_m",
    "flange_height_m",
    *CreepLaw().constants(),
)
"""What `ContactTable.const` holds."""
PATCH = np.dtype([(name, "f8", (4,)) for name in COLUMNS], align=True)
"""A patch over one interval of the table: its cubics by name."""
CONST = np.dtype([(name, "f8") for name in CONSTANTS], align=True)
"""Type of `ContactTable.const`."""

_FULL_SCALE_RADIUS_M = 0.46
"""Grids and lengths below are those of a wheel of this radius and scale with the wheel's."""
_SHIFT_STEP_M = 5e-5
_ABSCISSA_STEP_M = 5e-5
_SHIFT_STEPS_PER_SMOOTHING = 3.4
"""A table coarser than this many eps would smooth the contact by itself, and differently per step."""
_WIDENING_PER_GAUGE = 0.022
"""How much wider than nominal, over the gauge, beyond 8 mm at full scale: 40 mm in all at 1435 mm, more than
any track that trains run on (49 CFR 213.53: 38 mm in class 1)."""
_K0_1PM = 3.0
"""Relative lateral curvature of a typical tread contact: the datum of penetration and Hertz constant."""
_FLANGE_SMOOTHING = 2.5
"""The flange's vertical smoothing over the tread's: it is the normal one over cos(flange angle)."""
_WINDUP_RATE_1PS = 1000.0
"""Fast against a slide, slow enough for steps of 0.5 ms (2 at most on RK4's limit of 2.8)."""
_SPIN_SPEED_MPS = 0.1


@dataclass(frozen=True)
class ContactTable:
    """Contact of one wheel with its rail: plain arrays for the compiled kernel.

    Attributes
    ----------
    name : str
        Wheel, rail, inclination and gauge in words.
    coef : ndarray, shape (2, n, 12, 4)
        Cubic pieces over the shift u (m, wheel outward on its rail): patch (tread, flange), interval,
        column (see `COLUMNS`), power. Value ``((c0 x + c1) x + c2) x + c3`` with x the distance from
        the interval's left end. Penetration P is vertical, at nominal height; roll_rise and spread
        are its first and second derivative in the roll that raises this wheel (the first without the
        tape circle's distance), yaw_rise its second derivative in yaw; abscissa s and depth F are
        those of the contact on the wheel; all in m. f11, f22, f23, f33 are linear creep
        coefficients, to be multiplied by d, d, d^1.5, d^2 of the normal approach d; the ellipse's semi-axes
        (m) go with d^0.5.
    const : record
        Of type `CONST`, e.g. ``const["friction"]``.
    static_load_n : float
        Wheel load for which the smoothing is made.
    smoothing_m : float
        eps of the tread patch.
    split_m : float or None
        Abscissa on the wheel that parts tread and flange; None when there is one patch.
    """

    name: str
    coef: FloatArray
    const: np.void
    static_load_n: float
    smoothing_m: float
    split_m: float | None

    @property
    def patches(self) -> npt.NDArray[np.void]:
        """``coef`` as records `PATCH` (2, n), for the kernel."""
        return self.coef.reshape(*self.coef.shape[:2], -1).view(PATCH)[..., 0]

    def piece(self, column: str, shift_m: float) -> tuple[FloatArray, float]:
        """Cubic (4,) of a column of the tread's patch at a shift, and the place in it."""
        first, per_m = self.const["first_shift_m"], self.const["intervals_per_m"]
        i = int((shift_m - first) * per_m)
        return self.coef[0, i, COLUMNS.index(column)], float(shift_m - first - i / per_m)


def build_contact(
    wheel: WheelProfile,
    rail: RailProfile,
    *,
    static_load_n: float,
    grid_load_n: float | None = None,
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
    creep_law: CreepLaw | None = None,
) -> ContactTable:
    """Tabulate the contact of a wheel on a rail (about 0.3 s).

    Parameters
    ----------
    wheel, rail : WheelProfile, RailProfile
        Cross-sections.
    static_load_n : float
        Vertical load of this wheel at rest; it sets the smoothing.
    grid_load_n : float, optional
        Load that sets the step of the grid instead: the lightest of a vehicle's, so that all its tables
        lie on one grid.
    gauge_m, gauge_depth_m : float
        Distance of the rail heads, and how far below their top it is measured (14 mm at full scale).
    rail_inclination : float
        Lean of the rails, e.g. 1/40; 0 for upright rails.
    wheel_radius_m, tape_circle_half_m : float
        Rolling radius at the tape circle and half the distance of the two tape circles. Grids,
        relaxation length and gauge depth scale with the radius.
    friction : float
        Coulomb coefficient.
    smoothing : float
        eps over the static elastic approach. 0.22 fits the elastic solution; below about 0.1 the
        contact chatters like a rigid one.
    normal_damping_spm : float
        chi of N (1 - chi v_n), s/m.
    relaxation_length_m, relaxation_time_s : float
        Creep force builds up over ``length + time |V|``; the length is 10 mm at full scale.
    creep_damping_s : float
        Voigt time of the tangential contact spring.
    creep_law : CreepLaw, optional
        How creep forces saturate, and how friction falls with sliding; Shen-Hedrick-Elkins if none.

    Returns
    -------
    ContactTable

    Raises
    ------
    InputError
        For values that make no contact, naming the field.

    Notes
    -----
    Identities that hold exactly: dP/du is the tangent of the contact angle; with the axle's roll
    taken about the point r0 below its centre, dP/d(roll) is F dP/du - s minus the tape circle's
    distance, and ds/d(roll) is minus the spread. The lateral curvature of Hertz's ellipse is
    <g'^2>/eps; eps/var(s) would be wrong where two places share the load.
    """
    _judge_positive(
        static_load_n=static_load_n,
        gauge_m=gauge_m,
        wheel_radius_m=wheel_radius_m,
        tape_circle_half_m=tape_circle_half_m,
        friction=friction,
        smoothing=smoothing,
    )
    scale = wheel_radius_m / _FULL_SCALE_RADIUS_M
    depth = wheel_depth(wheel)
    head = incline(rail, rail_inclination, gauge_depth_m=gauge_depth_m or 0.014 * scale)
    pair = ContactPair(
        depth=depth,
        head=head,
        s=np.arange(depth.x[0], depth.x[-1], _ABSCISSA_STEP_M * scale),
        half_m=tape_circle_half_m,
        offset_m=tape_circle_half_m - 0.5 * gauge_m + head.gauge_abscissa_m,
        radius_m=wheel_radius_m,
    )
    hertz = float(hertz_ellipse(0.5 / wheel_radius_m, 0.5 * _K0_1PM / scale).approach) ** -1.5
    eps = smoothing * (static_load_n / hertz) ** (2.0 / 3.0)

    derailed, split_at = _limits(pair, scale)
    finest = smoothing * ((grid_load_n or static_load_n) / hertz) ** (2.0 / 3.0)
    step = min(_SHIFT_STEP_M * scale, _SHIFT_STEPS_PER_SMOOTHING * finest)
    u = _shifts(pair, derailed, step=step, scale=scale, gauge_m=gauge_m)
    coef = _patches(pair, u, split_at, eps_m=eps, hertz=hertz, scale=scale)
    values = {
        "first_shift_m": u[0],
        "intervals_per_m": 1.0 / step,
        "tape_circle_half_m": tape_circle_half_m,
        "wheel_radius_m": wheel_radius_m,
        "hertz_npm15": hertz,
        "friction": friction,
        "normal_damping_spm": normal_damping_spm,
        "relaxation_length_m": relaxation_length_m or 0.010 * scale,
        "relaxation_time_s": relaxation_time_s,
        "creep_damping_s": creep_damping_s,
        "spin_speed_mps": _SPIN_SPEED_MPS,
        "windup_rate_1ps": _WINDUP_RATE_1PS,
        "derailed_shift_m": derailed,
        "touch_load_n": 0.01 * static_load_n,
        "rail_offset_m": pair.offset_m,
        "flange_height_m": float(depth(pair.s).max() - depth(0.0)),
        **(creep_law or CreepLaw()).constants(),
    }
    lean = f"1:{1.0 / rail_inclination:.0f}" if rail_inclination else "upright"
    return ContactTable(
        name=f"{wheel.name} on {rail.name} {lean}, gauge {gauge_m * 1e3:.1f} mm",
        coef=np.ascontiguousarray(coef),
        const=np.array([tuple(values[name] for name in CONSTANTS)], dtype=CONST)[0],
        static_load_n=static_load_n,
        smoothing_m=eps,
        split_m=split_at,
    )


def _judge_positive(**values: float) -> None:
    """Refuse a number that is not positive, by its name."""
    for field, value in values.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError("must be a positive number", field=field, value=value, limit="> 0")


def _shifts(pair: ContactPair, derailed: float, *, step: float, scale: float, gauge_m: float) -> FloatArray:
    """Lateral shifts (n,) of the table's grid, m."""
    count = round((2.0 * derailed + 0.009 * scale) / step)
    u: FloatArray = np.linspace(0.0, (count - 1) * step, count) - (derailed + 0.008 * scale)
    # Where the gauge is wide, a wheel stands far from its flange while its fellow climbs; the table goes
    # on for that, as long as the wheel's outer edge lies beyond the middle of the rail.
    wide = max(0.0, min(_WIDENING_PER_GAUGE * gauge_m, float(pair.s[-1]) + float(u[0])))
    return np.concatenate([u[0] - step * np.arange(int(wide / step), 0, -1), u])


def _patches(
    pair: ContactPair, u: FloatArray, split_at: float | None, *, eps_m: float, hertz: float, scale: float
) -> FloatArray:
    """Cubics of tread and flange over the intervals between shifts: (2, n - 1, columns, 4)."""
    masks = [pair.s >= (pair.s[0] if split_at is None else split_at)]
    if split_at is not None:
        masks.append(pair.s < split_at)
    coef = np.zeros((2, u.size - 1, len(COLUMNS), 4))
    coef[1, :, 0, 3] = -1.0  # a flange patch that never touches, unless there is one
    for k, mask in enumerate(masks):
        factor = 1.0 if k == 0 else _FLANGE_SMOOTHING
        contact = pair.soften(u, mask, eps_m=factor * eps_m, k0_1pm=_K0_1PM / scale)
        creep = _creep_factors(contact, pair, hertz=hertz, scale=scale)
        columns = np.stack([*contact[:6], *creep], axis=1)
        coef[k] = np.moveaxis(CubicSpline(u, columns).c, 0, -1)
    return coef


def _limits(pair: ContactPair, scale: float) -> tuple[float, float | None]:
    """Shift beyond which the flange has climbed the rail, and the place to split the wheel at.

    A wheel that climbs lives on the steep face of its flange; past it the slope falls and nothing
    holds the wheel any more. Half the greatest slope marks that (12.4 mm for S1002 on 60E1 at 1435).
    """
    u = scale * np.arange(0.0, 0.060, 1e-4)
    _, _, slope = pair.rigid(u)
    steepest = int(np.argmax(slope))
    if slope[steepest] < 0.5:
        raise InputError(
            "the flange never meets the rail within 60 mm of lateral shift",
            field="gauge_m",
            remedy="check gauge, tape circles and profiles against each other",
            limit="<= 60 mm",
        )
    if slope[0] > 0.5:
        raise InputError(
            "the centred wheelset already stands on its flanges",
            field="gauge_m",
            remedy="check gauge, tape circles and profiles against each other",
            limit="some play between flange and rail",
        )
    past = np.flatnonzero(slope[steepest:] < 0.5 * slope[steepest])
    last = steepest + int(past[0]) if past.size else u.size - 1
    return float(u[last]), pair.split(np.arange(0.0, u[steepest] + 1e-4 * scale, 2e-5 * scale))


def _creep_factors(
    contact: SoftContact, pair: ContactPair, *, hertz: float, scale: float
) -> tuple[FloatArray, ...]:
    """Kalker's linear creep coefficients and the ellipse's semi-axes per power of the normal approach d.

    The ellipse grows with N^(1/3) = (hertz)^(1/3) d^(1/2), so f11 and f22 go with d, f23 with
    d^1.5, f33 with d^2: the kernel needs no power of the load.
    """
    cosine = 1.0 / np.sqrt(1.0 + contact.slope**2)
    curvature = np.clip(contact.curvature * cosine**3, 0.2 / scale, 3000.0 / scale)
    ellipse = hertz_ellipse(0.5 * cosine / (pair.radius_m + contact.depth), 0.5 * curvature)
    c11, c22, c23, c33 = kalker_coefficients(ellipse.a / ellipse.b)
    a, b = ellipse.a * np.cbrt(hertz), ellipse.b * np.cbrt(hertz)
    area = a * b
    modulus = SHEAR_MODULUS_PA
    forces = modulus * area * c11, modulus * area * c22, modulus * area**1.5 * c23, modulus * area**2 * c33
    return *forces, a, b
