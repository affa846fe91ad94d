"""Forces between one wheel and its rail: the kernel that every engine calls.

`wheel_force` takes where a wheel is and how it moves, and gives the force and moment on it. Normal
force by Hertz's law on the soft-maximum penetration of `simrail.vehicle.contact.contact_geometry`, creep
forces by Kalker's linear theory, saturated by the table's law (`simrail.vehicle.contact.creep_laws`), fed by
relaxation states in place of the quotient slip over speed, so that rest and reversal need no special
case.

Not here: making the table, integrating the states, conicity and other readings of a whole wheelset
(`simrail.vehicle.contact.wheelset`).
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.contact.contact_geometry import ContactTable
from simrail.vehicle.contact.creep_laws import FASTSIM, fallen, saturation
from simrail.vehicle.contact.cubic import slope, value
from simrail.vehicle.contact.fastsim import fastsim


class Motion(NamedTuple):
    """How an axle stands and moves in the track frame, and how one of its wheels turns.

    Attributes
    ----------
    y, z : float
        Displacement of the axle's centre from its nominal place, m.
    phi, psi : float
        Roll and yaw of the axle relative to the track frame, rad.
    V : float
        Speed along the track ds/dt, signed, m/s.
    v_x : float
        Absolute velocity of the axle's centre along the track frame's X, m/s.
    y_dot, z_dot, phi_dot, psi_dot : float
        Rates relative to the track frame.
    W : float
        Absolute rate of the wheel about the axle, positive rolling forward, rad/s.
    kappa_h : float
        Horizontal curvature k3 of the track frame, 1/m.
    """

    y: float
    z: float
    phi: float = 0.0
    psi: float = 0.0
    V: float = 0.0
    v_x: float = 0.0
    y_dot: float = 0.0
    z_dot: float = 0.0
    phi_dot: float = 0.0
    psi_dot: float = 0.0
    W: float = 0.0
    kappa_h: float = 0.0


class RailHere(NamedTuple):
    """The rail under a wheel: friction coefficient at rest; deviation, m, and its derivative along s."""

    friction: float
    y: float = 0.0
    z: float = 0.0
    dy: float = 0.0
    dz: float = 0.0


class WheelForce(NamedTuple):
    """What a rail does to a wheel.

    Attributes
    ----------
    flag : int
        0 no contact, 1 tread, 2 flange, 3 both, -1 derailed: beyond the table's range, or lifted by more than
        the flange is high; forces no longer mean anything.
    fx, fy, fz : float
        Force on the wheel in the track frame, N.
    mx, my, mz : float
        Its moment about the axle's centre, spin moment included, N m.
    normal : float
        Sum of the normal forces, N.
    penetration : float
        Largest vertical penetration, m.
    """

    flag: int
    fx: float
    fy: float
    fz: float
    mx: float
    my: float
    mz: float
    normal: float
    penetration: float


CONTACT = np.dtype(
    [
        ("wanted", "i8"),
        ("flag", "i8"),
        *((name, "f8") for name in ("position_m", "load_n", "guiding_n", "normal_n", "shift_m", "lift_m")),
        *((name, "f8") for name in ("creep_x_n", "creep_y_n", "creepage_x", "creepage_y", "spin_1pm")),
        *((name, "f8") for name in ("rail_m", "angle_rad", "carried_n")),
    ],
    align=True,
)
"""What is told of the contact of one wheel, where ``wanted`` is not 0.

Of the wheel, in any case: the flag, vertical and lateral force in the track frame (Q and Y) and normal force,
as in `WheelForce`; place s of its axle; how far it stands outward of its place on the rail, and how high its
tape circle over the head. Of both patches together: creep forces along and
across in the contact's plane. Of the patch that carries more: creepages, spin creepage, abscissa on the
rail from the middle of its head outward, contact angle, and ``carried_n``, its normal force.
"""


class Touch(NamedTuple):
    """One patch: vertical penetration and its derivative in u, abscissa and radius of the contact."""

    penetration: float
    slope: float
    abscissa: float
    radius: float


def static_height(table: ContactTable) -> float:
    """Height (m) of a centred wheelset's centre above nominal at which its wheels carry their load.

    The vertical part of the normal force ``hertz (pen cos)^1.5`` is the static load.
    """
    piece, x = table.piece("penetration", 0.0)
    cosine = 1.0 / np.sqrt(1.0 + np.polyval(np.polyder(piece), x) ** 2)
    pressed = (table.static_load_n / (table.const["hertz_npm15"] * cosine)) ** (2.0 / 3.0) / cosine
    return float(np.polyval(piece, x) - pressed)


@njit_inner
def _place(
    const: Any, intervals: int, side: float, motion: Motion, rail: RailHere
) -> tuple[float, int, float, float]:
    """Lateral shift u of a wheel on its rail, interval of the table, place in it; height over the rail.

    To second order in the axle's roll, whose centre is r0 above the rail.
    """
    half, r0, phi = const.tape_circle_half_m, const.wheel_radius_m, motion.phi
    u = side * (motion.y + r0 * phi - rail.y) - 0.5 * half * phi * phi
    ahead = u - const.first_shift_m
    per_m = const.intervals_per_m
    i = min(max(int(ahead * per_m), 0), intervals - 1)
    x = min(max(ahead, 0.0), intervals / per_m) - i / per_m
    return u, i, x, motion.z + 0.5 * r0 * phi * phi - rail.z


@njit_inner
def _touch(patch: Any, x: float, const: Any, height: float, p: float, psi: float) -> Touch:
    """One patch of a wheel; slope and abscissa are 0 when it is apart.

    ``patch`` holds the cubics of the interval, ``x`` is the place in it, ``height`` that of the axle over
    the rail, ``p`` the roll that raises this wheel. The slope is the exact derivative of the
    penetration, so that the normal force does the work that the penetration stores.
    """
    half, r0 = const.tape_circle_half_m, const.wheel_radius_m
    pp, qq = 0.5 * p * p, 0.5 * psi * psi
    # Penetration P - height + p (A - half) + p^2/2 C + psi^2/2 D.
    C = value(patch.spread, x)
    pen = (
        value(patch.penetration, x)
        - height
        + p * (value(patch.roll_rise, x) - half)
        + pp * C
        + qq * value(patch.yaw_rise, x)
    )
    if not pen > 0.0:
        return Touch(pen, 0.0, 0.0, r0)
    t = (
        slope(patch.penetration, x)
        + p * slope(patch.roll_rise, x)
        + pp * slope(patch.spread, x)
        + qq * slope(patch.yaw_rise, x)
    )
    return Touch(pen, t, value(patch.abscissa, x) - p * C, r0 + value(patch.depth, x) + t * p * C)


@njit_borrowed
def read_patch(patches: Any, const: Any, side: float, patch: int, motion: Motion, rail: RailHere) -> Touch:
    """One patch of a wheel; arguments as in `wheel_force`."""
    _, i, x, height = _place(const, patches.shape[1], side, motion, rail)
    return _touch(patches[patch, i], x, const, height, side * motion.phi, motion.psi)


@njit_inner
def rolling(V: float, spin_speed: float) -> float:
    """1/V of a rolling contact, 0 at rest, where a contact does not spin: V^3/(V^4 + v^4)."""
    return V * V * V / (V * V * V * V + spin_speed * spin_speed * spin_speed * spin_speed)


@njit_inner
def clear(told: Any) -> None:
    """Forget a `CONTACT`: no patch carries anything."""
    told.creep_x_n = told.creep_y_n = told.creepage_x = told.creepage_y = told.spin_1pm = 0.0
    told.rail_m = told.angle_rad = told.carried_n = 0.0


@njit_inner
def tell_patch(
    told: Any, normal: float, along: float, across: float, xi_x: float, xi_y: float, spin: float
) -> bool:
    """Add a patch to a `CONTACT`: normal force, creep forces, creepages; whether it carries the most."""
    told.creep_x_n += along
    told.creep_y_n += across
    heavier: bool = normal > told.carried_n
    if heavier:
        told.carried_n = normal
        told.creepage_x, told.creepage_y, told.spin_1pm = xi_x, xi_y, spin
    return heavier


@njit_borrowed
def wheel_force(
    patches: npt.NDArray[np.void],
    const: Any,
    side: float,
    motion: Motion,
    rail: RailHere,
    zeta: FloatArray,
    zeta_dot: FloatArray,
    told: Any = None,
) -> WheelForce:
    """Force and moment of a rail on a wheel, and the rates of its four creep states.

    Parameters
    ----------
    patches, const : ndarray of records (2, n), record
        Of a `ContactTable`.
    side : float
        +1 left wheel, -1 right wheel.
    motion, rail : Motion, RailHere
        Where the wheel is and how it moves, and what it runs on.
    zeta, zeta_dot : ndarray, shape (4,)
        Creep states (tread longitudinal, lateral; flange longitudinal, lateral), and their rates
        (written).
    told : record, optional
        A `CONTACT`; shift and lift are written, and its part on the patches if it is wanted.

    Returns
    -------
    WheelForce

    Notes
    -----
    Creep: ``zeta' = (slip - |V| zeta)/(L0 + tau |V|) - h (zeta + spin share)/T``. The second term
    keeps the state from winding up while the wheel slides without rolling: h is zero, with zero
    slope, until the linear force reaches so many times the friction limit (3 for the cubic law) that
    the saturated force is constant. It pulls along the direction of the linear force, so the
    direction of a saturated force in steady rolling is exact as well. Spin creepage is
    spin V^3/(V^4 + v^4): spin/V when rolling, nothing at rest, where a contact does not spin.
    """
    half, V, W = const.tape_circle_half_m, motion.V, motion.W
    phi, psi, phi_dot, psi_dot = motion.phi, motion.psi, motion.phi_dot, motion.psi_dot
    windup_rate, onset = const.windup_rate_1ps, const.windup_onset
    u, i, x, height = _place(const, patches.shape[1], side, motion, rail)

    speed = abs(V)
    length = const.relaxation_length_m + const.relaxation_time_s * speed
    # 1/V for a rolling contact, 0 at rest; with the sign of V and without; and that sign.
    per_speed = rolling(V, const.spin_speed_mps)
    direction = speed * per_speed
    flag, deepest = 0, -1.0
    fx = fy = fz = mx = my = mz = normal = 0.0
    for k in range(2):
        patch = patches[k, i]
        pen, t, s, r = _touch(patch, x, const, height, side * phi, psi)
        deepest = max(deepest, pen)
        z1, z2 = zeta[2 * k], zeta[2 * k + 1]
        zeta_dot[2 * k] = -z1 * (speed / length + windup_rate)
        zeta_dot[2 * k + 1] = -z2 * (speed / length + windup_rate)
        if not pen > 0.0:
            continue
        # The contact's plane, with t the tangent of its angle.
        cd = 1.0 / np.sqrt(1.0 + t * t)
        sd = t * cd
        Y = side * (half + s)
        # A yawed wheel touches ahead of its axle, so that the normal force still meets the axle.
        lead = r * psi * (side * t - phi) * (1.0 - side * t * phi)

        # Slip of the wheel's point on the rail's in the track frame; then in the contact's plane, and the
        # rate at which the two turn on each other about its normal (over V it is the spin creepage).
        slip_x = motion.v_x - motion.kappa_h * V * Y - psi_dot * Y - W * r
        slip_y = motion.y_dot - V * rail.dy + (phi_dot - W * psi) * r + psi_dot * lead
        slip_z = motion.z_dot - V * rail.dz + phi_dot * Y - W * lead
        v_n = cd * slip_z - side * sd * slip_y
        v_2 = cd * slip_y + side * sd * slip_z
        spin_slip = cd * (psi_dot + motion.kappa_h * V + W * phi) - side * sd * W

        # Hertz: N = hertz d^1.5 (1 - chi v_n), with d the approach along the normal.
        d = pen * cd
        root = np.sqrt(d)
        N = const.hertz_npm15 * d * root * (1.0 - const.normal_damping_spm * v_n)
        if not N > 0.0:
            continue
        flag += k + 1
        # Kalker's coefficients at this load.
        f11 = value(patch.f11, x) * d
        f22 = value(patch.f22, x) * d
        f23 = value(patch.f23, x) * d * root
        f33 = value(patch.f33, x) * d * d

        # Creep states: see the notes. A wheel that lands grips gradually, up to its touch load.
        bound = fallen(rail.friction, const.friction_floor, const.friction_decay_spm, slip_x, v_2) * N
        turn = f23 * spin_slip * per_speed
        share = turn / f22
        l1 = f11 * z1
        l2 = f22 * z2 + turn
        excess = max(np.sqrt(l1 * l1 + l2 * l2) / bound - onset, 0.0)
        brake = windup_rate * excess * excess / (onset * onset + excess * excess)
        grip = min(N / const.touch_load_n, 1.0)
        grip = grip * grip * (3.0 - 2.0 * grip)
        d1 = (grip * slip_x - speed * z1) / length - brake * z1
        d2 = (grip * v_2 - speed * z2) / length - brake * (z2 + share)
        zeta_dot[2 * k] = d1
        zeta_dot[2 * k + 1] = d2

        # Creep forces from the states, with Voigt damping of the tangential spring, and saturation.
        x1 = z1 + const.creep_damping_s * d1
        x2 = z2 + const.creep_damping_s * d2
        if const.creep_law == FASTSIM:
            a = value(patch.semi_axis_along, x) * root
            b = value(patch.semi_axis_across, x) * root
            twist = f23 * spin_slip * abs(per_speed)
            T1, T2, along, across = fastsim(
                f11 * x1 / bound, f22 * x2 / bound, turn / bound, twist / bound, b / a
            )
            T1 *= bound
            T2 *= bound
            M = bound * (direction * a * along - b * across)
        else:
            T1 = -f11 * x1
            T2 = -f22 * x2 - turn
            M = direction * f23 * x2 - f33 * spin_slip * abs(per_speed)
            q = np.sqrt(T1 * T1 + T2 * T2) / bound
            factor = saturation(q, const.creep_law, const.polach_adhesion, const.polach_slip)
            T1 *= factor
            T2 *= factor
            M *= factor

        # Back into the track frame, and moments about the axle's centre.
        along_y = cd * T2 - side * sd * N
        along_z = side * sd * T2 + cd * N
        px = lead - psi * Y
        py = Y + phi * r
        pz = phi * Y - r
        fx += T1
        fy += along_y
        fz += along_z
        mx += py * along_z - pz * along_y
        my += pz * T1 - px * along_z
        mz += px * along_y - py * T1
        my -= side * sd * M
        mz += cd * M
        normal += N
        if told is not None and told.wanted:
            rolled = abs(per_speed)
            if tell_patch(told, N, T1, T2, slip_x * rolled, v_2 * rolled, spin_slip * per_speed):
                told.rail_m = s + u + const.rail_offset_m
                told.angle_rad = np.arctan(t)
    lift = height + side * phi * half
    if u < const.first_shift_m or u > const.derailed_shift_m or lift > const.flange_height_m:
        flag = -1
    if told is not None:
        told.shift_m, told.lift_m = u, lift
    return WheelForce(flag, fx, fy, fz, mx, my, mz, normal, deepest)
