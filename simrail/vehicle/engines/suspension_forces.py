"""Forces of suspension elements and of the guide, compiled: what `simrail.vehicle.engines.forces` adds up.

Every element acts between an *inner* and an *outer* body, along or about the axes of the inner one, and
pushes each at that body's own attachment point. The rows are those of
`simrail.vehicle.engines.force_data.ForceData`.
"""

from __future__ import annotations

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.vehicle.engines.lookup import driven, track_at


@njit_borrowed
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


@njit_borrowed
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
) -> tuple[float, float, float]:
    """Add the guide's forces and moments on its body, in the axes of the track where it should be.

    Where the wheels drive it does not push along, and its axes are those of
    the track where the body is: a vehicle that lost time is still held upright and along its own place.

    Returns
    -------
    behind, wanted, speed : float
        Where the wheels drive: distance to the place that the profile asks for, its speed, and the
        body's speed along the track; else nothing that means anything.
    """
    s, wanted = driven(t, drive, memo)
    speed, behind = wanted, 0.0
    i = int(guide[0])
    b, w = pose[i], wrench[i]
    searched = guide[18] > 0.0
    place = s + guide[1]
    at = memo[1] if searched else place
    x = y = z = stretch = 0.0
    for _ in range(8):
        track_at(table, grid, at, f)
        dx, dy, dz = b[0] - f[0], b[1] - f[1], b[2] - f[2]
        x = f[3] * dx + f[6] * dy + f[9] * dz
        y = f[4] * dx + f[7] * dy + f[10] * dz
        z = f[5] * dx + f[8] * dy + f[11] * dz
        stretch = f[15] - f[14] * y + f[13] * z
        if not searched or abs(x) < 1e-12 * (1.0 + abs(at)):
            break
        at += x / stretch
    memo[1] = at
    v = f[3] * b[3] + f[6] * b[4] + f[9] * b[5]
    along = 0.0
    if searched:
        behind, speed = place - at, v / stretch
    else:
        along = -guide[2] * x - guide[3] * (v - speed * stretch)
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
    if guide[10] + guide[12] + guide[14] > 0.0:
        v_y = f[4] * b[3] + f[7] * b[4] + f[10] * b[5] + speed * f[12] * z
        v_z = f[5] * b[3] + f[8] * b[4] + f[11] * b[5] - speed * f[12] * y
        zy = f[5] * b[7] + f[8] * b[10] + f[11] * b[13]
        yz = f[4] * b[8] + f[7] * b[11] + f[10] * b[14]
        rate_x = f[3] * b[15] + f[6] * b[16] + f[9] * b[17] - speed * f[12]
        side = -guide[10] * y - guide[11] * v_y
        up = guide[17] - guide[12] * (z - guide[16]) - guide[13] * v_z
        roll = -guide[14] * 0.5 * (zy - yz) - guide[15] * rate_x
        for j in range(3):
            w[j] += f[4 + 3 * j] * side + f[5 + 3 * j] * up
            w[3 + j] += f[3 + 3 * j] * roll
    return behind, wanted, speed


@njit_borrowed
def _stretch(p: FloatArray, a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Deflection and its rate of a one-axis element: row p, poses a (inner) and b (outer)."""
    k = int(p[8])
    d = e = 0.0
    for n in range(3):
        r, q = 6 + 3 * n, (n + 1) % 3
        u = (n + 2) % 3
        arm_a = a[r] * p[2] + a[r + 1] * p[3] + a[r + 2] * p[4]
        arm_b = b[r] * p[5] + b[r + 1] * p[6] + b[r + 2] * p[7]
        # Component n of omega x arm, for each body.
        aq = a[6 + 3 * q] * p[2] + a[7 + 3 * q] * p[3] + a[8 + 3 * q] * p[4]
        au = a[6 + 3 * u] * p[2] + a[7 + 3 * u] * p[3] + a[8 + 3 * u] * p[4]
        bq = b[6 + 3 * q] * p[5] + b[7 + 3 * q] * p[6] + b[8 + 3 * q] * p[7]
        bu = b[6 + 3 * u] * p[5] + b[7 + 3 * u] * p[6] + b[8 + 3 * u] * p[7]
        rate = b[3 + n] + b[15 + q] * bu - b[15 + u] * bq - a[3 + n] - a[15 + q] * au + a[15 + u] * aq
        d += a[r + k] * (b[n] + arm_b - a[n] - arm_a)
        e += a[r + k] * rate
    return d, e


@njit_borrowed
def _push(p: FloatArray, a: FloatArray, b: FloatArray, wa: FloatArray, wb: FloatArray, force: float) -> None:
    """Pull the two bodies of a one-axis element together with a force."""
    k = int(p[8])
    for n in range(3):
        q, u = (n + 1) % 3, (n + 2) % 3
        fq, fu = a[6 + 3 * q + k] * force, a[6 + 3 * u + k] * force
        aq = a[6 + 3 * q] * p[2] + a[7 + 3 * q] * p[3] + a[8 + 3 * q] * p[4]
        au = a[6 + 3 * u] * p[2] + a[7 + 3 * u] * p[3] + a[8 + 3 * u] * p[4]
        bq = b[6 + 3 * q] * p[5] + b[7 + 3 * q] * p[6] + b[8 + 3 * q] * p[7]
        bu = b[6 + 3 * u] * p[5] + b[7 + 3 * u] * p[6] + b[8 + 3 * u] * p[7]
        wa[n] += a[6 + 3 * n + k] * force
        wb[n] -= a[6 + 3 * n + k] * force
        wa[3 + n] += aq * fu - au * fq
        wb[3 + n] -= bq * fu - bu * fq


@njit_borrowed
def series_forces(
    series: FloatArray, pose: FloatArray, inner: FloatArray, wrench: FloatArray, inner_rate: FloatArray
) -> None:
    """Add dampers in series with a spring. Their force (N) is the inner state: F' = k (v - F / c)."""
    for m in range(series.shape[0]):
        p = series[m]
        i, j = int(p[0]), int(p[1])
        _, speed = _stretch(p, pose[i], pose[j])
        inner_rate[m] = p[9] * (speed - inner[m] / p[10])
        _push(p, pose[i], pose[j], wrench[i], wrench[j], inner[m])


@njit_borrowed
def stop_forces(stops: FloatArray, laws: FloatArray, pose: FloatArray, wrench: FloatArray) -> None:
    """Add elements whose force is an odd tabled law of their deflection or of its rate.

    ``laws`` holds pieces: start and cubic of the force, highest power first; beyond its last row, which
    is linear, a law goes on in a straight line.
    """
    for m in range(stops.shape[0]):
        p = stops[m]
        i, j = int(p[0]), int(p[1])
        d, e = _stretch(p, pose[i], pose[j])
        x = e if p[9] > 0.0 else d
        size = abs(x)
        row, last = int(p[10]), int(p[10] + p[11]) - 1
        while row < last and size >= laws[row + 1, 0]:
            row += 1
        c, u = laws[row], size - laws[row, 0]
        force = ((c[1] * u + c[2]) * u + c[3]) * u + c[4]
        _push(p, pose[i], pose[j], wrench[i], wrench[j], force if x > 0.0 else -force)


@njit_borrowed
def turn_forces(turns: FloatArray, pose: FloatArray, wrench: FloatArray) -> None:
    """Add springs and dampers of the small rotation of the outer body in the inner body's axes."""
    for m in range(turns.shape[0]):
        p = turns[m]
        i, j = int(p[0]), int(p[1])
        a, b = pose[i], pose[j]
        for k in range(3):
            q, u = (k + 1) % 3, (k + 2) % 3
            # The antisymmetric part of A_i^T A_j, and the relative rate.
            angle = rate = 0.0
            for n in range(3):
                r = 6 + 3 * n
                angle += 0.5 * (a[r + u] * b[r + q] - a[r + q] * b[r + u])
                rate += a[r + k] * (b[15 + n] - a[15 + n])
            moment = p[2 + k] * angle + p[5 + k] * rate
            for n in range(3):
                wrench[i, 3 + n] += a[6 + 3 * n + k] * moment
                wrench[j, 3 + n] -= a[6 + 3 * n + k] * moment
