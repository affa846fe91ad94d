"""Forces between one wheel and its rail: the kernel that every engine calls.

`wheel_force` takes where a wheel is and how it moves, and gives the force and moment on it. Normal
force by Hertz's law on the soft-maximum penetration of `simrail.vehicle.contact.contact_geometry`, creep
forces by Kalker's linear theory, saturated by the table's law (`simrail.vehicle.contact.creep_laws`), fed by
relaxation states in place of the quotient slip over speed, so that rest and reversal need no special
case.

Not here: making the table, integrating the states, conicity and other readings of a whole wheelset
(`simrail.vehicle.contact.wheelset`).
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.vehicle.contact.contact_geometry import COLUMNS, CONSTANTS, ContactTable, build_contact
from simrail.vehicle.contact.creep_laws import fallen, saturation
from simrail.vehicle.contact.fastsim import fastsim

__all__ = [
    "COLUMNS",
    "CONSTANTS",
    "ContactTable",
    "build_contact",
    "read_patch",
    "static_height",
    "wheel_force",
]


def static_height(table: ContactTable) -> float:
    """Height (m) of a centred wheelset's centre above nominal at which its wheels carry their load.

    The vertical part of the normal force ``hertz (pen cos)^1.5`` is the static load.
    """
    first, per_m, hertz = table.const[0], table.const[1], table.const[4]
    i = int(-first * per_m)
    piece, x = table.coef[0, i, 0], -first - i / per_m
    cosine = 1.0 / np.sqrt(1.0 + np.polyval(np.polyder(piece), x) ** 2)
    pressed = (table.static_load_n / (hertz * cosine)) ** (2.0 / 3.0) / cosine
    return float(np.polyval(piece, x) - pressed)


@njit_borrowed
def _touch(
    c: FloatArray, x: float, half: float, r0: float, height: float, p: float, psi: float
) -> tuple[float, float, float, float]:
    """Vertical penetration and its derivative in u, abscissa and radius of one patch; 0s when apart.

    ``c`` are the cubic pieces of the interval, ``x`` the place in it, ``height`` that of the axle over
    the rail, ``p`` the roll that raises this wheel. The slope is the exact derivative of the
    penetration, so that the normal force does the work that the penetration stores.
    """
    P = ((c[0, 0] * x + c[0, 1]) * x + c[0, 2]) * x + c[0, 3]
    A = ((c[1, 0] * x + c[1, 1]) * x + c[1, 2]) * x + c[1, 3]
    C = ((c[2, 0] * x + c[2, 1]) * x + c[2, 2]) * x + c[2, 3]
    D = ((c[3, 0] * x + c[3, 1]) * x + c[3, 2]) * x + c[3, 3]
    pp, qq = 0.5 * p * p, 0.5 * psi * psi
    pen = P - height + p * (A - half) + pp * C + qq * D
    if not pen > 0.0:
        return pen, 0.0, 0.0, r0
    dP = (3.0 * c[0, 0] * x + 2.0 * c[0, 1]) * x + c[0, 2]
    dA = (3.0 * c[1, 0] * x + 2.0 * c[1, 1]) * x + c[1, 2]
    dC = (3.0 * c[2, 0] * x + 2.0 * c[2, 1]) * x + c[2, 2]
    dD = (3.0 * c[3, 0] * x + 2.0 * c[3, 1]) * x + c[3, 2]
    s = ((c[4, 0] * x + c[4, 1]) * x + c[4, 2]) * x + c[4, 3]
    F = ((c[5, 0] * x + c[5, 1]) * x + c[5, 2]) * x + c[5, 3]
    t = dP + p * dA + pp * dC + qq * dD
    return pen, t, s - p * C, r0 + F + t * p * C


@njit_borrowed
def read_patch(
    coef: FloatArray,
    const: FloatArray,
    side: float,
    patch: int,
    y: float,
    z: float,
    phi: float,
    psi: float,
    y_rail: float,
    z_rail: float,
    out: FloatArray,
) -> None:
    """Penetration, slope, abscissa, radius of one patch into ``out`` (4,); poses as in `wheel_force`."""
    u = side * (y + const[3] * phi - y_rail) - 0.5 * const[2] * phi * phi - const[0]
    i = min(max(int(u * const[1]), 0), coef.shape[1] - 1)
    x = min(max(u, 0.0), coef.shape[1] / const[1]) - i / const[1]
    height = z + 0.5 * const[3] * phi * phi - z_rail
    out[0], out[1], out[2], out[3] = _touch(coef[patch, i], x, const[2], const[3], height, side * phi, psi)


@njit_borrowed
def wheel_force(
    coef: FloatArray,
    const: FloatArray,
    side: float,
    y: float,
    z: float,
    phi: float,
    psi: float,
    y_rail: float,
    z_rail: float,
    V: float,
    v_x: float,
    y_dot: float,
    z_dot: float,
    phi_dot: float,
    psi_dot: float,
    W: float,
    kappa_h: float,
    dy_rail: float,
    dz_rail: float,
    friction: float,
    zeta: FloatArray,
    zeta_dot: FloatArray,
    out: FloatArray,
) -> int:
    """Force and moment of a rail on a wheel, and the rates of its four creep states.

    Parameters
    ----------
    coef, const : ndarray
        Of a `ContactTable`.
    side : float
        +1 left wheel, -1 right wheel.
    y, z : float
        Displacement of the axle's centre from its nominal place in the track frame, m.
    phi, psi : float
        Roll and yaw of the axle relative to the track frame, rad.
    y_rail, z_rail, dy_rail, dz_rail : float
        This rail's deviation, m, and its derivative along the track.
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
    friction : float
        Coulomb coefficient of wheel and rail here, at rest.
    zeta, zeta_dot : ndarray, shape (4,)
        Creep states (tread longitudinal, lateral; flange longitudinal, lateral), and their rates
        (written).
    out : ndarray, shape (8,)
        Written: force on the wheel in the track frame, N; its moment about the axle's centre, N m,
        spin moment included; sum of the normal forces, N; largest vertical penetration, m.

    Returns
    -------
    int
        0 no contact, 1 tread, 2 flange, 3 both, -1 derailed: beyond the table's range, forces no
        longer mean anything.

    Notes
    -----
    Creep: ``zeta' = (slip - |V| zeta)/(L0 + tau |V|) - h (zeta + spin share)/T``. The second term
    keeps the state from winding up while the wheel slides without rolling: h is zero, with zero
    slope, until the linear force reaches so many times the friction limit (3 for the cubic law) that
    the saturated force is constant. It pulls along the direction of the linear force, so the
    direction of a saturated force in steady rolling is exact as well. Spin creepage is
    spin V^3/(V^4 + v^4): spin/V when rolling, nothing at rest, where a contact does not spin.
    """
    u0, inv_du, half, r0, hertz = const[0], const[1], const[2], const[3], const[4]
    chi, length0, tau, taud = const[6], const[7], const[8], const[9]
    v_spin, windup_rate, u_min, u_max, touch = const[10], const[11], const[12], const[13], const[14]
    law, adhesion, slipping = const[15], const[16], const[17]
    floor, decay, onset = const[18], const[19], const[20]

    for k in range(8):
        out[k] = 0.0
    out[7] = -1.0
    u = side * (y + r0 * phi - y_rail) - 0.5 * half * phi * phi
    height = z + 0.5 * r0 * phi * phi - z_rail
    p = side * phi
    i = min(max(int((u - u0) * inv_du), 0), coef.shape[1] - 1)
    x = min(max(u - u0, 0.0), coef.shape[1] / inv_du) - i / inv_du

    speed = abs(V)
    length = length0 + tau * speed
    # 1/V for a rolling contact, 0 at rest; with the sign of V and without; and that sign.
    per_speed = V * V * V / (V * V * V * V + v_spin * v_spin * v_spin * v_spin)
    direction = speed * per_speed
    flag = 0
    for k in range(2):
        c = coef[k, i]
        pen, t, s, r = _touch(c, x, half, r0, height, p, psi)
        out[7] = max(out[7], pen)
        z1, z2 = zeta[2 * k], zeta[2 * k + 1]
        zeta_dot[2 * k] = -z1 * (speed / length + windup_rate)
        zeta_dot[2 * k + 1] = -z2 * (speed / length + windup_rate)
        if not pen > 0.0:
            continue
        cd = 1.0 / np.sqrt(1.0 + t * t)
        sd = t * cd
        Y = side * (half + s)
        # A yawed wheel touches ahead of its axle, so that the normal force still meets the axle.
        lead = r * psi * (side * t - phi) * (1.0 - side * t * phi)

        slip_x = v_x - kappa_h * V * Y - psi_dot * Y - W * r
        slip_y = y_dot - V * dy_rail + (phi_dot - W * psi) * r + psi_dot * lead
        slip_z = z_dot - V * dz_rail + phi_dot * Y - W * lead
        v_n = cd * slip_z - side * sd * slip_y
        v_2 = cd * slip_y + side * sd * slip_z
        spin = cd * (psi_dot + kappa_h * V + W * phi) - side * sd * W

        d = pen * cd
        root = np.sqrt(d)
        N = hertz * d * root * (1.0 - chi * v_n)
        if not N > 0.0:
            continue
        flag += k + 1
        f11 = (((c[6, 0] * x + c[6, 1]) * x + c[6, 2]) * x + c[6, 3]) * d
        f22 = (((c[7, 0] * x + c[7, 1]) * x + c[7, 2]) * x + c[7, 3]) * d
        f23 = (((c[8, 0] * x + c[8, 1]) * x + c[8, 2]) * x + c[8, 3]) * d * root
        f33 = (((c[9, 0] * x + c[9, 1]) * x + c[9, 2]) * x + c[9, 3]) * d * d

        bound = fallen(friction, floor, decay, slip_x, v_2) * N
        turn = f23 * spin * per_speed
        share = turn / f22
        l1 = f11 * z1
        l2 = f22 * z2 + turn
        excess = max(np.sqrt(l1 * l1 + l2 * l2) / bound - onset, 0.0)
        brake = windup_rate * excess * excess / (onset * onset + excess * excess)
        grip = min(N / touch, 1.0)
        grip = grip * grip * (3.0 - 2.0 * grip)
        d1 = (grip * slip_x - speed * z1) / length - brake * z1
        d2 = (grip * v_2 - speed * z2) / length - brake * (z2 + share)
        zeta_dot[2 * k] = d1
        zeta_dot[2 * k + 1] = d2

        x1 = z1 + taud * d1
        x2 = z2 + taud * d2
        if law == 2.0:
            a = (((c[10, 0] * x + c[10, 1]) * x + c[10, 2]) * x + c[10, 3]) * root
            b = (((c[11, 0] * x + c[11, 1]) * x + c[11, 2]) * x + c[11, 3]) * root
            twist = f23 * spin * abs(per_speed)
            T1, T2, along, across = fastsim(
                f11 * x1 / bound, f22 * x2 / bound, turn / bound, twist / bound, b / a
            )
            T1 *= bound
            T2 *= bound
            M = bound * (direction * a * along - b * across)
        else:
            T1 = -f11 * x1
            T2 = -f22 * x2 - turn
            M = direction * f23 * x2 - f33 * spin * abs(per_speed)
            q = np.sqrt(T1 * T1 + T2 * T2) / bound
            factor = saturation(q, law, adhesion, slipping)
            T1 *= factor
            T2 *= factor
            M *= factor

        fy = cd * T2 - side * sd * N
        fz = side * sd * T2 + cd * N
        px = lead - psi * Y
        py = Y + phi * r
        pz = phi * Y - r
        out[0] += T1
        out[1] += fy
        out[2] += fz
        out[3] += py * fz - pz * fy
        out[4] += pz * T1 - px * fz
        out[5] += px * fy - py * T1
        out[4] -= side * sd * M
        out[5] += cd * M
        out[6] += N
    if u < u_min or u > u_max:
        flag = -1
    return flag
