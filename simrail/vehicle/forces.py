"""All forces of a vehicle on a laid track, compiled: the one right-hand side that every engine calls.

Gravity, suspensions, guide, wheel-rail contact and the gyroscopic moment of the wheels, from poses and
velocities in the global frame. Engines bring their own coordinates and integrate; nothing is
integrated here. The constants are the arrays of `simrail.vehicle.force_data.ForceData`.
"""

from __future__ import annotations

import numpy as np

from simrail.jit import FloatArray, njit
from simrail.vehicle.contact import wheel_force
from simrail.vehicle.lookup import driven, track_at


@njit
def spring_forces(springs: FloatArray, pose: FloatArray, wrench: FloatArray) -> None:
    """Add every suspension's force and moment (about the centres of gravity, global axes) to wrench."""
    for m in range(springs.shape[0]):
        p = springs[m]
        i, j = int(p[0]), int(p[1])
        a, b = pose[i], pose[j]
        # Arms and point velocities in global axes.
        ax = a[6] * p[2] + a[7] * p[3] + a[8] * p[4]
        ay = a[9] * p[2] + a[10] * p[3] + a[11] * p[4]
        az = a[12] * p[2] + a[13] * p[3] + a[14] * p[4]
        bx = b[6] * p[5] + b[7] * p[6] + b[8] * p[7]
        by = b[9] * p[5] + b[10] * p[6] + b[11] * p[7]
        bz = b[12] * p[5] + b[13] * p[6] + b[14] * p[7]
        dx, dy, dz = b[0] + bx - a[0] - ax, b[1] + by - a[1] - ay, b[2] + bz - a[2] - az
        ex = b[3] + b[16] * bz - b[17] * by - a[3] - a[16] * az + a[17] * ay
        ey = b[4] + b[17] * bx - b[15] * bz - a[4] - a[17] * ax + a[15] * az
        ez = b[5] + b[15] * by - b[16] * bx - a[5] - a[15] * ay + a[16] * ax
        # In the axes of the inner body.
        fx = p[8] * (a[6] * dx + a[9] * dy + a[12] * dz - p[14]) + p[11] * (
            a[6] * ex + a[9] * ey + a[12] * ez
        )
        fy = p[9] * (a[7] * dx + a[10] * dy + a[13] * dz - p[15]) + p[12] * (
            a[7] * ex + a[10] * ey + a[13] * ez
        )
        fz = p[10] * (a[8] * dx + a[11] * dy + a[14] * dz - p[16]) + p[13] * (
            a[8] * ex + a[11] * ey + a[14] * ez
        )
        gx = a[6] * fx + a[7] * fy + a[8] * fz
        gy = a[9] * fx + a[10] * fy + a[11] * fz
        gz = a[12] * fx + a[13] * fy + a[14] * fz
        wi, wj = wrench[i], wrench[j]
        wi[0] += gx
        wi[1] += gy
        wi[2] += gz
        wi[3] += ay * gz - az * gy
        wi[4] += az * gx - ax * gz
        wi[5] += ax * gy - ay * gx
        wj[0] -= gx
        wj[1] -= gy
        wj[2] -= gz
        wj[3] -= by * gz - bz * gy
        wj[4] -= bz * gx - bx * gz
        wj[5] -= bx * gy - by * gx


@njit
def guide_force(
    t: float,
    guide: FloatArray,
    drive: FloatArray,
    grid: FloatArray,
    table: FloatArray,
    pose: FloatArray,
    wrench: FloatArray,
    memo: FloatArray,
    f: FloatArray,
) -> None:
    """Add the guide's force along the track and its pitch and yaw moments."""
    s, speed = driven(t, drive, memo)
    track_at(table, grid, s + guide[1], f)
    i = int(guide[0])
    b, w = pose[i], wrench[i]
    dx, dy, dz = b[0] - f[0], b[1] - f[1], b[2] - f[2]
    x = f[3] * dx + f[6] * dy + f[9] * dz
    y = f[4] * dx + f[7] * dy + f[10] * dz
    z = f[5] * dx + f[8] * dy + f[11] * dz
    v = f[3] * b[3] + f[6] * b[4] + f[9] * b[5]
    along = -guide[2] * x - guide[3] * (v - speed * (f[15] - f[14] * y + f[13] * z))
    # Small relative rotation: the antisymmetric part of C_t^T A.
    xz = f[3] * b[8] + f[6] * b[11] + f[9] * b[14]
    zx = f[5] * b[6] + f[8] * b[9] + f[11] * b[12]
    yx = f[4] * b[6] + f[7] * b[9] + f[10] * b[12]
    xy = f[3] * b[7] + f[6] * b[10] + f[9] * b[13]
    rate_y = f[4] * b[15] + f[7] * b[16] + f[10] * b[17] - speed * f[13]
    rate_z = f[5] * b[15] + f[8] * b[16] + f[11] * b[17] - speed * f[14]
    pitch = -guide[4] * 0.5 * (xz - zx) - guide[5] * rate_y
    yaw = -guide[6] * 0.5 * (yx - xy) - guide[7] * rate_z
    for j in range(3):
        w[j] += f[3 + 3 * j] * along
        w[3 + j] += f[4 + 3 * j] * pitch + f[5 + 3 * j] * yaw


@njit
def axle_forces(
    axle: FloatArray,
    wheels: FloatArray,
    spin: FloatArray,
    zeta: FloatArray,
    spins: FloatArray,
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
    s = memo[0]
    x = y = z = speed = 0.0
    for _ in range(8):
        track_at(table, grid, s, f)
        dx, dy, dz = b[0] - f[0], b[1] - f[1], b[2] - f[2]
        x = f[3] * dx + f[6] * dy + f[9] * dz
        y = f[4] * dx + f[7] * dy + f[10] * dz
        z = f[5] * dx + f[8] * dy + f[11] * dz
        stretch = f[15] - f[14] * y + f[13] * z
        step = x / stretch
        if abs(step) < 1e-12 * (1.0 + abs(s)):
            break
        s += step
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
        rail = 0 if wheel[1] > 0.0 else 2
        flag = wheel_force(
            coef, const, wheel[1], y, z - wheel[3], phi, psi, f[16 + rail], f[17 + rail],
            speed, vx, y_dot, z_dot, phi_dot, psi_dot, spin[k], f[14], f[20 + rail], f[21 + rail],
            zeta[4 * (first + n) : 4 * (first + n) + 4], zeta_rate[4 * (first + n) : 4 * (first + n) + 4], o,
        )  # fmt: skip
        if flag < 0 and memo[1] == 0.0:
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
        h = spins[k] * spin[k] * (0.5 if wheels[first, 2] == wheels[first + 1, 2] else 1.0)
        wr[0] += gx
        wr[1] += gy
        wr[2] += gz
        wr[3] += mx - about * ex - h * (b[16] * ez - b[17] * ey)
        wr[4] += my - about * ey - h * (b[17] * ex - b[15] * ez)
        wr[5] += mz - about * ez - h * (b[15] * ey - b[16] * ex)
        memo[3 + n] = o[2]


@njit
def forces(
    t: float,
    pose: FloatArray,
    spin: FloatArray,
    zeta: FloatArray,
    bodies: FloatArray,
    springs: FloatArray,
    wheels: FloatArray,
    spins: FloatArray,
    axles: FloatArray,
    guide: FloatArray,
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
    zeta : ndarray (4 w,)
        Creep states of each wheel (see `simrail.vehicle.contact`).
    bodies ... const : ndarray
        `ForceData`.
    wrench : ndarray (b, 6), output
        Force and moment about the centre of gravity, global axes.
    torque : ndarray (p,), output
        Moment about the axle of each spin.
    zeta_rate : ndarray (4 w,), output
        d(zeta)/dt.
    memo : ndarray (1 + 5 a,)
        Memory between calls: profile piece; per axle s, derailed flag, s of derailment, and the wheel
        loads of the last call.
    work : ndarray (42,)
        Scratch.
    """
    wrench[:] = 0.0
    torque[:] = 0.0
    for b in range(bodies.shape[0]):
        wrench[b, 2] = -bodies[b, 0] * guide[8]
    f, o = work[:34], work[34:]
    spring_forces(springs, pose, wrench)
    guide_force(t, guide, drive, grid, table, pose, wrench, memo, f)
    for a in range(axles.shape[0]):
        axle_forces(
            axles[a], wheels, spin, zeta, spins, grid, table, coef, const,
            pose, wrench, torque, zeta_rate, memo[1 + 5 * a : 6 + 5 * a], f, o,
        )  # fmt: skip
