"""All forces of a vehicle on a laid track, compiled: the one right-hand side that every engine calls.

Gravity, suspensions, guide, wheel-rail contact and the gyroscopic moment of the wheels, from poses and
velocities in the global frame. Engines bring their own coordinates and integrate; nothing is
integrated here. The constants are the arrays of `simrail.vehicle.engines.force_data.ForceData`.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.vehicle.contact.contact import wheel_force
from simrail.vehicle.contact.linear_contact import linear_wheel_force
from simrail.vehicle.engines.lookup import find_on_track
from simrail.vehicle.engines.suspension_forces import (
    guide_force,
    series_forces,
    spring_forces,
    stop_forces,
    turn_forces,
)
from simrail.vehicle.engines.traction_forces import traction_forces


@njit_borrowed
def axle_forces(
    t: float,
    axle: FloatArray,
    wheels: FloatArray,
    spin: FloatArray,
    zeta: FloatArray,
    spins: FloatArray,
    switches: FloatArray,
    grid: FloatArray,
    table: FloatArray,
    coef: FloatArray,
    const: FloatArray,
    pose: FloatArray,
    wrench: FloatArray,
    torque: FloatArray,
    zeta_rate: FloatArray,
    memo: FloatArray,
    f: FloatArray,
    o: FloatArray,
) -> None:
    """Add the contact forces of one axle's two wheels, and their gyroscopic moment.

    ``memo`` (3,): s of the axle at the last call (where the search for s starts), derailed flag, s of
    the derailment.
    """
    i, first = int(axle[0]), int(axle[1])
    b, wr = pose[i], wrench[i]
    s, y, z = find_on_track(table, grid, b, memo[0], f)
    memo[0] = s
    vx = f[3] * b[3] + f[6] * b[4] + f[9] * b[5]
    vy = f[4] * b[3] + f[7] * b[4] + f[10] * b[5]
    vz = f[5] * b[3] + f[8] * b[4] + f[11] * b[5]
    speed = vx / (f[15] - f[14] * y + f[13] * z)
    y_dot = vy + speed * f[12] * z
    z_dot = vz - speed * f[12] * y
    phi_dot = f[3] * b[15] + f[6] * b[16] + f[9] * b[17] - speed * f[12]
    psi_dot = f[5] * b[15] + f[8] * b[16] + f[11] * b[17] - speed * f[14]
    # ZYX angles of the axle in the track frame, from C_t^T A.
    r00 = f[3] * b[6] + f[6] * b[9] + f[9] * b[12]
    r10 = f[4] * b[6] + f[7] * b[9] + f[10] * b[12]
    r21 = f[5] * b[7] + f[8] * b[10] + f[11] * b[13]
    r22 = f[5] * b[8] + f[8] * b[11] + f[11] * b[14]
    phi, psi = np.arctan2(r21, r22), np.arctan2(r10, r00)
    # The axle's own axis in global components.
    ex, ey, ez = b[7], b[10], b[13]
    for n in range(2):
        wheel = wheels[first + n]
        k = int(wheel[2])
        kind = int(wheel[4])
        rail = 0 if wheel[1] > 0.0 else 2
        if switches[1] > 0.0:
            flag = linear_wheel_force(
                switches, const[kind], wheel[5], wheel[1], y, z - wheel[3], phi, psi,
                f[16 + rail], f[17 + rail],
                speed, vx, y_dot, z_dot, phi_dot, psi_dot, spin[k], f[14], f[20 + rail], f[21 + rail],
                zeta[4 * (first + n) : 4 * (first + n) + 4],
                zeta_rate[4 * (first + n) : 4 * (first + n) + 4], o,
            )  # fmt: skip
        else:
            flag = wheel_force(
                coef[kind], const[kind], wheel[1], y, z - wheel[3], phi, psi, f[16 + rail], f[17 + rail],
                speed, vx, y_dot, z_dot, phi_dot, psi_dot, spin[k], f[14], f[20 + rail], f[21 + rail],
                const[kind, 5] * f[24 + rail // 2], zeta[4 * (first + n) : 4 * (first + n) + 4],
                zeta_rate[4 * (first + n) : 4 * (first + n) + 4], o,
            )  # fmt: skip
        # Before 0 the vehicle is still being set down on its rails: where it then stands counts.
        if flag < 0 and memo[1] == 0.0 and t >= 0.0:
            memo[1], memo[2] = 1.0, s
        gx = f[3] * o[0] + f[4] * o[1] + f[5] * o[2]
        gy = f[6] * o[0] + f[7] * o[1] + f[8] * o[2]
        gz = f[9] * o[0] + f[10] * o[1] + f[11] * o[2]
        mx = f[3] * o[3] + f[4] * o[4] + f[5] * o[5]
        my = f[6] * o[3] + f[7] * o[4] + f[8] * o[5]
        mz = f[9] * o[3] + f[10] * o[4] + f[11] * o[5]
        # The bearing passes everything on to the axle but the moment about its own axis.
        about = mx * ex + my * ey + mz * ez
        torque[k] += about
        # Half of the gyroscopic moment -omega x h goes with each wheel of the spin's inertia.
        h = switches[0] * spins[k, 0] * spin[k] * (0.5 if wheels[first, 2] == wheels[first + 1, 2] else 1.0)
        wr[0] += gx
        wr[1] += gy
        wr[2] += gz
        wr[3] += mx - about * ex - h * (b[16] * ez - b[17] * ey)
        wr[4] += my - about * ey - h * (b[17] * ex - b[15] * ez)
        wr[5] += mz - about * ez - h * (b[15] * ey - b[16] * ex)
        memo[3 + n] = o[2]


@njit_borrowed
def forces(
    t: float,
    pose: FloatArray,
    spin: FloatArray,
    zeta: FloatArray,
    bodies: FloatArray,
    springs: FloatArray,
    series: FloatArray,
    turns: FloatArray,
    stops: FloatArray,
    laws: FloatArray,
    wheels: FloatArray,
    spins: FloatArray,
    axles: FloatArray,
    guide: FloatArray,
    switches: FloatArray,
    drive: FloatArray,
    grid: FloatArray,
    table: FloatArray,
    coef: FloatArray,
    const: FloatArray,
    wrench: FloatArray,
    torque: FloatArray,
    zeta_rate: FloatArray,
    memo: FloatArray,
    work: FloatArray,
) -> None:
    """All forces at one instant.

    Parameters
    ----------
    t : float
        Time, s; before 0 the guide stands at the profile's start.
    pose : ndarray (b, 18)
        Per body: position (3), velocity (3), rotation matrix by rows (9), angular rate (3); global.
    spin : ndarray (p,)
        Absolute rate of each spin about its axle, rad/s.
    zeta : ndarray (4 w + d,), or (4 w + d + p,) where the wheels drive
        Creep states of each wheel (see `simrail.vehicle.contact.contact`), then the force of each series
        damper, then the state of each spin's brake (see `simrail.vehicle.engines.traction_forces`).
    bodies ... const : ndarray
        `ForceData`.
    wrench : ndarray (b, 6), output
        Force and moment about the centre of gravity, global axes.
    torque : ndarray (p,), output
        Moment about the axle of each spin.
    zeta_rate : ndarray, shape of zeta, output
        d(zeta)/dt.
    memo : ndarray (2 + 5 a,)
        Memory between calls: profile piece, s of the guide's body; per axle s, derailed flag, s of
        derailment, and the wheel loads of the last call.
    work : ndarray (34,)
        Scratch.
    """
    wrench[:] = 0.0
    torque[:] = 0.0
    for b in range(bodies.shape[0]):
        wrench[b, 2] = -bodies[b, 0] * guide[8]
    f, o = work[:26], work[26:]
    spring_forces(springs, pose, wrench)
    creep = 4 * wheels.shape[0]
    brakes = creep + series.shape[0]
    series_forces(series, pose, zeta[creep:brakes], wrench, zeta_rate[creep:brakes])
    turn_forces(turns, pose, wrench)
    stop_forces(stops, laws, pose, wrench)
    behind, wanted, speed = guide_force(t, guide, drive, grid, table, pose, wrench, memo, f)
    if guide[18] > 0.0:
        traction_forces(
            behind, wanted, speed, guide[18:], spins, pose, spin, zeta[brakes:], wrench, torque,
            zeta_rate[brakes:],
        )  # fmt: skip
    for a in range(axles.shape[0]):
        axle_forces(
            t, axles[a], wheels, spin, zeta, spins, switches, grid, table, coef, const,
            pose, wrench, torque, zeta_rate, memo[2 + 5 * a : 7 + 5 * a], f, o,
        )  # fmt: skip
