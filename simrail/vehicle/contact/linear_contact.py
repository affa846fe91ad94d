"""Prescribed linear contact between a wheel and its rail: the wheelset of the textbooks, for validation.

The kernel takes the same arguments as `simrail.vehicle.contact.contact.wheel_force`, the `ForceData.switches`
in place of the profile table, and leaves out what the closed forms leave out: saturation, the contact
angle, the axle's roll in the creepages. Creep forces build up over the same relaxation states.
"""

from __future__ import annotations

from simrail.core.jit import FloatArray, njit_borrowed


@njit_borrowed
def linear_wheel_force(
    switches: FloatArray,
    const: FloatArray,
    load: float,
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
    zeta: FloatArray,
    zeta_dot: FloatArray,
    out: FloatArray,
) -> int:
    """Force and moment of a rail on a wheel, and the rates of its creep states.

    Arguments, units and output as in `simrail.vehicle.contact.contact.wheel_force`, and the static load, N;
    only the first two creep states are used. Returns 0 off the rail, 1 on it, -1 beyond the flange's place.
    """
    half, r0 = const[2], const[3]
    length0, tau, taud, v_spin = const[7], const[8], const[9], const[10]
    f11, f22, f23, f33, conicity = switches[2], switches[3], switches[4], switches[5], switches[6]
    for k in range(8):
        out[k] = 0.0
    zeta_dot[2] = zeta_dot[3] = 0.0
    speed = abs(V)
    length = length0 + tau * speed
    shift = y - y_rail
    Y = side * half
    pen = z_rail - z - Y * phi
    rise = V * dz_rail - z_dot - Y * phi_dot
    N = load + switches[7] * pen + switches[8] * rise
    if not N > 0.0:
        zeta_dot[0] = -zeta[0] * speed / length
        zeta_dot[1] = -zeta[1] * speed / length
        return 0
    slip_x = v_x - (kappa_h * V + psi_dot) * Y - W * (r0 + side * conicity * shift)
    slip_y = y_dot - V * dy_rail - W * r0 * psi
    spin = psi_dot + kappa_h * V
    zeta_dot[0] = (slip_x - speed * zeta[0]) / length
    zeta_dot[1] = (slip_y - speed * zeta[1]) / length
    x1 = zeta[0] + taud * zeta_dot[0]
    x2 = zeta[1] + taud * zeta_dot[1]
    # As in the profile contact: spin creepage is spin / V when rolling, nothing at rest.
    per_speed = V * V * V / (V * V * V * V + v_spin * v_spin * v_spin * v_spin)
    T1 = -f11 * x1
    T2 = -f22 * x2 - f23 * spin * per_speed
    M = speed * per_speed * f23 * x2 - f33 * spin * abs(per_speed)
    fy = T2 - switches[9] * shift
    out[0], out[1], out[2] = T1, fy, N
    out[3] = Y * N + r0 * fy
    out[4] = -r0 * T1
    out[5] = -Y * T1 + M - switches[10] * psi
    # The larger rolling radius moves the point where the longitudinal force drives the wheel.
    out[4] -= side * conicity * shift * T1
    out[6], out[7] = N, pen
    return -1 if abs(shift) > const[13] else 1
