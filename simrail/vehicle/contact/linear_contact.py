"""Prescribed linear contact between a wheel and its rail: the wheelset of the textbooks, for validation.

The kernel takes the arguments of `simrail.vehicle.contact.contact.wheel_force`, with prescribed coefficients
in place of the profile table, and leaves out what the closed forms leave out: saturation, the contact
angle, the axle's roll in the creepages. Creep forces build up over the same relaxation states.
"""

from typing import Any

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.vehicle.contact.contact import Motion, RailHere, WheelForce, rolling, tell_patch


@njit_borrowed
def linear_wheel_force(
    linear: Any,
    const: Any,
    load: float,
    side: float,
    motion: Motion,
    rail: RailHere,
    zeta: FloatArray,
    zeta_dot: FloatArray,
    told: Any = None,
) -> WheelForce:
    """Force and moment of a rail on a wheel, and the rates of its creep states.

    ``linear`` is a record `simrail.vehicle.engines.records.OPTIONS`, ``load`` the static load, N; the rest,
    units and output as in `simrail.vehicle.contact.contact.wheel_force`. Only the first two creep states
    are used. The flag is 0 off the rail, 1 on it, -1 beyond the flange's place.
    """
    V, W, psi_dot, r0 = motion.V, motion.W, motion.psi_dot, const.wheel_radius_m
    speed = abs(V)
    length = const.relaxation_length_m + const.relaxation_time_s * speed
    shift = motion.y - rail.y
    Y = side * const.tape_circle_half_m
    if told is not None:
        told.shift_m, told.lift_m = side * shift, motion.z + Y * motion.phi - rail.z
    zeta_dot[2] = zeta_dot[3] = 0.0
    # Normal force: the static load and a linear spring and damper.
    pen = rail.z - motion.z - Y * motion.phi
    rise = V * rail.dz - motion.z_dot - Y * motion.phi_dot
    N = load + linear.vertical_stiffness * pen + linear.vertical_damping * rise
    if not N > 0.0:
        zeta_dot[0] = -zeta[0] * speed / length
        zeta_dot[1] = -zeta[1] * speed / length
        return WheelForce(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    # Creep states: zeta' = (slip - |V| zeta)/(L0 + tau |V|).
    slip_x = motion.v_x - (motion.kappa_h * V + psi_dot) * Y - W * (r0 + side * linear.conicity * shift)
    slip_y = motion.y_dot - V * rail.dy - W * r0 * motion.psi
    spin_slip = psi_dot + motion.kappa_h * V
    zeta_dot[0] = (slip_x - speed * zeta[0]) / length
    zeta_dot[1] = (slip_y - speed * zeta[1]) / length
    x1 = zeta[0] + const.creep_damping_s * zeta_dot[0]
    x2 = zeta[1] + const.creep_damping_s * zeta_dot[1]
    # Kalker's linear forces and spin moment, and the gravitational stiffness.
    per_speed = rolling(V, const.spin_speed_mps)
    T1 = -linear.f11 * x1
    T2 = -linear.f22 * x2 - linear.f23 * spin_slip * per_speed
    M = speed * per_speed * linear.f23 * x2 - linear.f33 * spin_slip * abs(per_speed)
    fy = T2 - linear.gravitational_stiffness * shift
    my = -r0 * T1
    # The larger rolling radius moves the point where the longitudinal force drives the wheel.
    my -= side * linear.conicity * shift * T1
    mz = -Y * T1 + M - linear.gravitational_yaw_stiffness * motion.psi
    if told is not None and told.wanted:
        rolled = abs(per_speed)
        tell_patch(told, N, T1, fy, slip_x * rolled, slip_y * rolled, spin_slip * per_speed)
    flag = -1 if abs(shift) > const.derailed_shift_m else 1
    return WheelForce(flag, T1, fy, N, Y * N + r0 * fy, my, mz, N, pen)
