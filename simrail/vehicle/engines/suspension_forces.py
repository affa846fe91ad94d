"""Forces of suspension elements and of the guide, compiled: what `simrail.vehicle.engines.forces` adds up.

Most elements act between an *inner* and an *outer* body, along or about the axes of the inner one. With A
the rotation of the inner body, w its rate, p the way from its centre of gravity to the attachment point on
the outer body and r to its own, an element sees the deflection d = A^T p - r and the rate
d' = A^T (p' - w x p). What follows from the energy of d alone is that the force acts on both bodies at the
outer point: pushed each at its own point, the couple of force and deflection would be in no balance, and a
car body that leans out on its springs would not load the outer wheels. Rods pull along their own line, and
trailing arms turn about their axle's. The records are those of
`simrail.vehicle.engines.records`.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.contact.cubic import value
from simrail.vehicle.engines.lookup import driven, find_on_track, place_in, track_at
from simrail.vehicle.engines.records import (
    ROD,
    ROTATION,
    Record,
    RecordArray,
    push,
    relative,
    rotated,
    rotated_back,
)


class Between(NamedTuple):
    """Where an element acts, and how it lies there.

    Arms from the centres of gravity (inner ``ax, ay, az``, outer ``bx, by, bz``) to the attachment point on
    the outer body, global axes, m; a way (m) and its rate (m/s) in the axes of the inner body: that from the
    inner body's centre of gravity to this point, or the deflection.
    """

    ax: float
    ay: float
    az: float
    bx: float
    by: float
    bz: float
    x: float
    y: float
    z: float
    x_rate: float
    y_rate: float
    z_rate: float


@njit_inner
def way_to(outer_arm: FloatArray, a: Record, b: Record) -> Between:
    """Way A^T p to the attachment point on the outer body (arm in its axes), from the poses of both."""
    bx, by, bz = rotated(b.rotation, outer_arm[0], outer_arm[1], outer_arm[2])
    ax, ay, az = b.x + bx - a.x, b.y + by - a.y, b.z + bz - a.z
    # A point of a body moves with v + w x r, and the inner body's axes turn with w.
    ex = b.vx + b.wy * bz - b.wz * by - a.vx - a.wy * az + a.wz * ay
    ey = b.vy + b.wz * bx - b.wx * bz - a.vy - a.wz * ax + a.wx * az
    ez = b.vz + b.wx * by - b.wy * bx - a.vz - a.wx * ay + a.wy * ax
    x, y, z = rotated_back(a.rotation, ax, ay, az)
    x_rate, y_rate, z_rate = rotated_back(a.rotation, ex, ey, ez)
    return Between(ax, ay, az, bx, by, bz, x, y, z, x_rate, y_rate, z_rate)


@njit_inner
def between(inner_arm: FloatArray, outer_arm: FloatArray, a: Record, b: Record) -> Between:
    """Deflection A^T p - r of an element, from its arms on the bodies, in their axes, and their poses."""
    p = way_to(outer_arm, a, b)
    x, y, z = p.x - inner_arm[0], p.y - inner_arm[1], p.z - inner_arm[2]
    return Between(p.ax, p.ay, p.az, p.bx, p.by, p.bz, x, y, z, p.x_rate, p.y_rate, p.z_rate)


@njit_inner
def pull(p: Between, a: Record, wa: Record, wb: Record, fx: float, fy: float, fz: float) -> None:
    """Pull the two bodies of an element together with a force in the inner body's axes.

    ``a`` is the inner body's pose, ``wa`` and ``wb`` are the wrenches on the inner and the outer body.
    """
    gx, gy, gz = rotated(a.rotation, fx, fy, fz)
    push(wa, p.ax, p.ay, p.az, gx, gy, gz)
    push(wb, p.bx, p.by, p.bz, -gx, -gy, -gz)


@njit_inner
def along(axis: int, x: float, y: float, z: float) -> float:
    """One of three components."""
    if axis == 0:
        return x
    return y if axis == 1 else z


@njit_inner
def pull_along(p: Between, axis: int, a: Record, wa: Record, wb: Record, force: float) -> None:
    """`pull` along one axis."""
    fx = force if axis == 0 else 0.0
    fy = force if axis == 1 else 0.0
    fz = force if axis == 2 else 0.0
    pull(p, a, wa, wb, fx, fy, fz)


@njit_borrowed
def spring_forces(springs: RecordArray, pose: RecordArray, wrench: RecordArray) -> None:
    """Add every linear spring and damper: F = k (deflection less that at rest) + c rate, along each axis."""
    for m in range(springs.shape[0]):
        spring = springs[m]
        a, b = pose[spring.inner], pose[spring.outer]
        p = between(spring.inner_arm, spring.outer_arm, a, b)
        k, c = spring.stiffness, spring.damping
        fx = k[0] * p.x + c[0] * p.x_rate
        fy = k[1] * p.y + c[1] * p.y_rate
        fz = k[2] * (p.z - spring.sag_m) + c[2] * p.z_rate
        pull(p, a, wrench[spring.inner], wrench[spring.outer], fx, fy, fz)


@njit_borrowed
def series_forces(
    series: RecordArray, pose: RecordArray, force: FloatArray, wrench: RecordArray, force_rate: FloatArray
) -> None:
    """Add dampers in series with a spring. Their force (N) is the inner state: F' = k (v - F / c)."""
    for m in range(series.shape[0]):
        damper = series[m]
        a, b = pose[damper.inner], pose[damper.outer]
        p = between(damper.inner_arm, damper.outer_arm, a, b)
        speed = along(damper.axis, p.x_rate, p.y_rate, p.z_rate)
        force_rate[m] = damper.stiffness * (speed - force[m] / damper.damping)
        pull_along(p, damper.axis, a, wrench[damper.inner], wrench[damper.outer], force[m])


@njit_borrowed
def stop_forces(stops: RecordArray, laws: RecordArray, pose: RecordArray, wrench: RecordArray) -> None:
    """Add elements whose force is an odd tabled law of their deflection or of its rate.

    Beyond the last piece of its law, which is linear, a law goes on in a straight line.
    """
    for m in range(stops.shape[0]):
        stop = stops[m]
        a, b = pose[stop.inner], pose[stop.outer]
        p = between(stop.inner_arm, stop.outer_arm, a, b)
        if stop.over_rate:
            x = along(stop.axis, p.x_rate, p.y_rate, p.z_rate)
        else:
            x = along(stop.axis, p.x, p.y, p.z)
        size = abs(x)
        row, last = stop.first, stop.first + stop.pieces - 1
        while row < last and size >= laws[row + 1].start:
            row += 1
        force = value(laws[row].cubic, size - laws[row].start)
        force = force if x > 0.0 else -force
        pull_along(p, stop.axis, a, wrench[stop.inner], wrench[stop.outer], force)


@njit_inner
def rotation_force(spring: Record, a: Record, b: Record, wa: Record, wb: Record) -> None:
    """Add a rotational spring and damper, of the small rotation of the outer body in the inner body's axes.

    The rotation is the antisymmetric part of A^T B.
    """
    A, B = a.rotation, b.rotation
    for k in range(3):
        q, u = (k + 1) % 3, (k + 2) % 3
        angle = 0.0
        for n in range(3):
            angle += 0.5 * (A[n, u] * B[n, q] - A[n, q] * B[n, u])
        rate = A[0, k] * (b.wx - a.wx) + A[1, k] * (b.wy - a.wy) + A[2, k] * (b.wz - a.wz)
        moment = spring.stiffness[k] * angle + spring.damping[k] * rate
        wa.mx += A[0, k] * moment
        wa.my += A[1, k] * moment
        wa.mz += A[2, k] * moment
        wb.mx -= A[0, k] * moment
        wb.my -= A[1, k] * moment
        wb.mz -= A[2, k] * moment


class Arm(NamedTuple):
    """A trailing arm as its axle sees it.

    Attributes
    ----------
    way : Between
        From the axle's centre to the bushing on the frame.
    length, length_rate : float
        Distance of the bushing from the axle's own line.
    turn, turn_rate : float
        Angle by which the arm has turned about that line from its place at rest.
    """

    way: Between
    length: float
    length_rate: float
    turn: float
    turn_rate: float


@njit_inner
def rod_force(rod: Record, a: Record, b: Record, wa: Record, wb: Record) -> None:
    """Add a rod: a spring and damper along the line between two points, F = k (L - L0) + c L'."""
    p = between(rod.inner_arm[0], rod.outer_arm[0], a, b)
    length = np.sqrt(p.x * p.x + p.y * p.y + p.z * p.z)
    x, y, z = p.x / length, p.y / length, p.z / length
    rate = x * p.x_rate + y * p.y_rate + z * p.z_rate
    force = rod.stiffness[0] * (length - rod.length_m) + rod.damping[0] * rate
    pull(p, a, wa, wb, force * x, force * y, force * z)


@njit_inner
def arm_of(axle_arm: FloatArray, frame_arm: FloatArray, a: Record, b: Record) -> Arm:
    """One trailing arm between the axle's body (pose ``a``) and the frame (pose ``b``)."""
    p = way_to(frame_arm, a, b)
    length = np.sqrt(p.x * p.x + p.z * p.z)
    length_rate = (p.x * p.x_rate + p.z * p.z_rate) / length
    turn = np.arctan2(axle_arm[2] * p.x - axle_arm[0] * p.z, axle_arm[0] * p.x + axle_arm[2] * p.z)
    turn_rate = (p.z * p.x_rate - p.x * p.z_rate) / (length * length)
    return Arm(p, length, length_rate, turn, turn_rate)


@njit_inner
def arm_force(pair: Record, a: Record, b: Record, wa: Record, wb: Record) -> None:
    """Add trailing arms: the left and the right one of an axle turn about its line one by one.

    In the axle's axes an arm of the length r0 at rest, its bushing at a distance r from the axle's line and
    turned by the angle t about it, feels

        along   k_x (r - r0) + c_x r'            towards the bushing
        lateral k_y (y - y0) + c_y y'
        across  r0^2 (k_z T + c_z T') / r        with T the mean turn of both arms

    The force acts at the bushing, on both bodies. An arm without mass bears no moment about the line that it
    turns on, so no force across it comes of its own turn; the mean of both is that of the axle boxes, which
    the axle's body stands for, and their moment holds that body. The potential is
    ``sum (k_x (r - r0)^2 + k_y (y - y0)^2)/2 + k_z r0^2 T^2``.
    """
    left = arm_of(pair.inner_arm[0], pair.outer_arm[0], a, b)
    right = arm_of(pair.inner_arm[1], pair.outer_arm[1], a, b)
    k, c = pair.stiffness, pair.damping
    turning = k[2] * 0.5 * (left.turn + right.turn) + c[2] * 0.5 * (left.turn_rate + right.turn_rate)
    for n in range(2):
        arm, rest = left if n == 0 else right, pair.inner_arm[n]
        p = arm.way
        square = rest[0] * rest[0] + rest[2] * rest[2]
        # Over the length, so that the way to the bushing gives the direction.
        along_arm = (k[0] * (arm.length - np.sqrt(square)) + c[0] * arm.length_rate) / arm.length
        across = square * turning / (arm.length * arm.length)
        side = k[1] * (p.y - rest[1]) + c[1] * p.y_rate
        pull(p, a, wa, wb, along_arm * p.x + across * p.z, side, along_arm * p.z - across * p.x)


@njit_borrowed
def link_forces(links: RecordArray, pose: RecordArray, wrench: RecordArray) -> None:
    """Add rotational springs, rods and trailing arms."""
    for m in range(links.shape[0]):
        link = links[m]
        a, b, wa, wb = pose[link.inner], pose[link.outer], wrench[link.inner], wrench[link.outer]
        if link.kind == ROTATION:
            rotation_force(link, a, b, wa, wb)
        elif link.kind == ROD:
            rod_force(link, a, b, wa, wb)
        else:
            arm_force(link, a, b, wa, wb)


@njit_inner
def guide_force(
    t: float,
    guide: Record,
    wheels_drive: bool,
    drive: RecordArray,
    track: RecordArray,
    options: Record,
    pose: RecordArray,
    wrench: RecordArray,
    memo: Record,
    frame: Record,
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
    b, w = pose[guide.body], wrench[guide.body]
    place = s + guide.offset_m
    behind, speed, along_force = 0.0, wanted, 0.0
    if wheels_drive:
        memo.s_m, y, z, metre = find_on_track(track, options, b, memo.s_m, frame)
        vx, vy, vz = rotated_back(frame.rotation, b.vx, b.vy, b.vz)
        behind, speed = place - memo.s_m, vx / metre
    else:
        memo.s_m = place
        track_at(track, options, place, frame)
        x, y, z, metre = place_in(frame, b)
        vx, vy, vz = rotated_back(frame.rotation, b.vx, b.vy, b.vz)
        along_force = -guide.stiffness * x - guide.damping * (vx - speed * metre)
    # Small relative rotation: the antisymmetric part of C^T A; rates against the moving track frame.
    angle = relative(frame.rotation, b.rotation)
    wx, wy, wz = rotated_back(frame.rotation, b.wx, b.wy, b.wz)
    pitch = -guide.pitch_stiffness * 0.5 * (angle.xz - angle.zx) - guide.pitch_damping * (
        wy - speed * frame.k2
    )
    yaw = -guide.yaw_stiffness * 0.5 * (angle.yx - angle.xy) - guide.yaw_damping * (wz - speed * frame.k3)
    side = up = roll = 0.0
    # Only a carrier that a single wheelset hangs on is held across the track, too.
    if guide.lateral_stiffness + guide.vertical_stiffness + guide.roll_stiffness > 0.0:
        side = -guide.lateral_stiffness * y - guide.lateral_damping * (vy + speed * frame.k1 * z)
        up = (
            guide.load_n
            - guide.vertical_stiffness * (z - guide.height_m)
            - guide.vertical_damping * (vz - speed * frame.k1 * y)
        )
        roll = -guide.roll_stiffness * 0.5 * (angle.zy - angle.yz) - guide.roll_damping * (
            wx - speed * frame.k1
        )
    gx, gy, gz = rotated(frame.rotation, along_force, side, up)
    mx, my, mz = rotated(frame.rotation, roll, pitch, yaw)
    push(w, 0.0, 0.0, 0.0, gx, gy, gz)
    w.mx += mx
    w.my += my
    w.mz += mz
    return behind, wanted, speed
