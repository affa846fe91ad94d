"""All forces of a vehicle on a laid track, compiled: the one right-hand side that every engine calls.

Gravity, suspensions, guide, wheel-rail contact and the gyroscopic moment of the wheels, from poses and
velocities in the global frame. Engines bring their own coordinates and integrate; nothing is
integrated here. The constants are `simrail.vehicle.engines.force_data.ForceData`.
"""

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.contact.contact import Motion, RailHere, clear, wheel_force
from simrail.vehicle.contact.linear_contact import linear_wheel_force
from simrail.vehicle.engines.force_data import ForceData, Memory
from simrail.vehicle.engines.lookup import find_on_track
from simrail.vehicle.engines.records import Record, RecordArray, push, relative, rotated, rotated_back
from simrail.vehicle.engines.suspension_forces import (
    guide_force,
    link_forces,
    series_forces,
    spring_forces,
    stop_forces,
)
from simrail.vehicle.engines.traction_forces import driver, traction_forces


@njit_inner
def axle_forces(
    t: float,
    axle: Record,
    spin: FloatArray,
    zeta: FloatArray,
    data: ForceData,
    pose: RecordArray,
    wrench: RecordArray,
    torque: FloatArray,
    zeta_rate: FloatArray,
    memo: Record,
    frame: Record,
    contacts: RecordArray,
) -> None:
    """Add the contact forces of one axle's two wheels, and their gyroscopic moment.

    ``memo`` is an `simrail.vehicle.engines.records.AXLE_MEMO`; its s is where the search for s starts.
    What is told of the two wheels goes into ``contacts`` (w,).
    """
    options, wheels = data.options[0], data.wheels
    b, w, first = pose[axle.body], wrench[axle.body], axle.first_wheel
    s, y, z, metre = find_on_track(data.track, options, b, memo.s_m, frame)
    memo.s_m = s
    # Rates of the axle against the track frame, which moves along and turns with the curvatures.
    vx, vy, vz = rotated_back(frame.rotation, b.vx, b.vy, b.vz)
    wx, _, wz = rotated_back(frame.rotation, b.wx, b.wy, b.wz)
    speed = vx / metre
    y_dot, z_dot = vy + speed * frame.k1 * z, vz - speed * frame.k1 * y
    phi_dot, psi_dot = wx - speed * frame.k1, wz - speed * frame.k3
    # ZYX angles of the axle in the track frame, from C^T A.
    turn = relative(frame.rotation, b.rotation)
    phi, psi = np.arctan2(turn.zy, turn.zz), np.arctan2(turn.yx, turn.xx)
    # The axle's own axis in global components.
    ex, ey, ez = b.rotation[0, 1], b.rotation[1, 1], b.rotation[2, 1]
    together = wheels[first].spin == wheels[first + 1].spin
    for n in range(2):
        wheel = wheels[first + n]
        k, const = wheel.spin, data.const[wheel.table]
        motion = Motion(
            y, z - wheel.radius_m, phi, psi, speed, vx, y_dot, z_dot, phi_dot, psi_dot, spin[k], frame.k3
        )
        if wheel.side > 0:
            friction = const.friction * frame.friction_left
            rail = RailHere(friction, frame.y_left, frame.z_left, frame.dy_left, frame.dz_left)
        else:
            friction = const.friction * frame.friction_right
            rail = RailHere(friction, frame.y_right, frame.z_right, frame.dy_right, frame.dz_right)
        creep = zeta[4 * (first + n) : 4 * (first + n) + 4]
        creep_rate = zeta_rate[4 * (first + n) : 4 * (first + n) + 4]
        side = float(wheel.side)
        told = contacts[first + n]
        if told.wanted:
            clear(told)
        if options.linear_contact:
            contact = linear_wheel_force(
                options, const, wheel.load_n, side, motion, rail, creep, creep_rate, told
            )
        else:
            contact = wheel_force(
                data.patches[wheel.table], const, side, motion, rail, creep, creep_rate, told
            )
        # Before 0 the vehicle is still being set down on its rails: where it then stands counts.
        if contact.flag < 0 and memo.derailed == 0 and t >= 0.0:
            memo.derailed, memo.derailed_time_s, memo.derailed_s_m = n + 1, t, s
            memo.speed_mps, memo.shift_m, memo.lift_m = speed, told.shift_m, told.lift_m
        gx, gy, gz = rotated(frame.rotation, contact.fx, contact.fy, contact.fz)
        mx, my, mz = rotated(frame.rotation, contact.mx, contact.my, contact.mz)
        # The bearing passes everything on to the axle but the moment about its own axis.
        about = mx * ex + my * ey + mz * ez
        torque[k] += about
        # Gyroscopic moment -omega x h; half of it goes with each wheel if both turn as one.
        h = options.gyroscopic * data.spins[k].inertia * spin[k] * (0.5 if together else 1.0)
        push(w, 0.0, 0.0, 0.0, gx, gy, gz)
        w.mx += mx - about * ex - h * (b.wy * ez - b.wz * ey)
        w.my += my - about * ey - h * (b.wz * ex - b.wx * ez)
        w.mz += mz - about * ez - h * (b.wx * ey - b.wy * ex)
        told.flag, told.position_m = contact.flag, s
        told.load_n, told.guiding_n, told.normal_n = contact.fz, contact.fy, contact.normal


@njit_borrowed
def forces(
    t: float,
    pose: RecordArray,
    spin: FloatArray,
    zeta: FloatArray,
    data: ForceData,
    wrench: RecordArray,
    torque: FloatArray,
    zeta_rate: FloatArray,
    memory: Memory,
) -> None:
    """All forces at one instant.

    Parameters
    ----------
    t : float
        Time, s; before 0 the guide stands at the profile's start.
    pose : ndarray (b,)
        Of each body, `simrail.vehicle.engines.records.POSE`.
    spin : ndarray (p,)
        Absolute rate of each spin about its axle, rad/s.
    zeta : ndarray (4 w + d,), or (4 w + d + p,) where the wheels drive
        Creep states of each wheel (see `simrail.vehicle.contact.contact`), then the force of each series
        damper, then the state of each spin's brake (see `simrail.vehicle.engines.traction_forces`).
    data : ForceData
        The constants.
    wrench : ndarray (b,), output
        Force and moment on each body, `simrail.vehicle.engines.records.WRENCH`.
    torque : ndarray (p,), output
        Moment about the axle of each spin.
    zeta_rate : ndarray, shape of zeta, output
        d(zeta)/dt.
    memory : Memory
        What is remembered from call to call.
    """
    contacts = memory.contacts
    options, traction, frame, memo = data.options[0], data.traction[0], memory.frame[0], memory.guide_memo[0]
    for k in range(torque.shape[0]):
        torque[k] = 0.0
    for b in range(data.bodies.shape[0]):
        w = wrench[b]
        w.fx = w.fy = w.mx = w.my = w.mz = 0.0
        w.fz = -data.bodies[b].mass_kg * options.gravity
    creep = 4 * data.wheels.shape[0]
    brakes = creep + data.series.shape[0]
    spring_forces(data.springs, pose, wrench)
    series_forces(data.series, pose, zeta[creep:brakes], wrench, zeta_rate[creep:brakes])
    link_forces(data.links, pose, wrench)
    stop_forces(data.stops, data.laws, pose, wrench)
    wheels_drive = traction.wheels_drive > 0
    behind, wanted, speed = guide_force(
        t, data.guide[0], wheels_drive, data.drive, data.track, options, pose, wrench, memo, frame
    )
    if wheels_drive:
        traction.direction = data.drive[memo.piece].direction
        efforts = driver(behind, wanted, speed, traction)
        traction_forces(
            efforts, traction, data.spins, pose, spin, zeta[brakes:], wrench, torque, zeta_rate[brakes:]
        )
    for a in range(data.axles.shape[0]):
        memo = memory.axle_memos[a]
        axle_forces(
            t, data.axles[a], spin, zeta, data, pose, wrench, torque, zeta_rate, memo, frame, contacts
        )
