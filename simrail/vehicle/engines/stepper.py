"""Fixed-step classical Runge-Kutta integration of a vehicle, compiled: the kernel of the compiled engine.

The state is one flat array: per body position (3), attitude quaternion (4, scalar first), velocity (3,
global axes) and angular rate (3, body axes); then the spin angles, the spin rates, and the first-order
states. The quaternion is integrated like everything else and normalised once per step: its error in a
step goes with the fifth power of the small angle turned in it, and unlike a rotation vector it has no
place where its composition loses digits.
"""

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.engines.force_data import ForceData, Memory
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.records import RecordArray, rotated, rotated_back

STATE = np.dtype(
    [
        *((name, "f8") for name in ("x", "y", "z", "q0", "q1", "q2", "q3")),
        *((name, "f8") for name in ("vx", "vy", "vz", "p", "q", "r")),
    ],
    align=True,
)
"""A body's part of the state, and of its derivative."""
BODY = STATE.itemsize // 8
"""Numbers of a body in the state."""


@njit_inner
def pose_of(state: RecordArray, pose: RecordArray) -> None:
    """Position, velocity, rotation matrix and global angular rate of each body."""
    for b in range(state.shape[0]):
        body, place = state[b], pose[b]
        w, x, y, z = body.q0, body.q1, body.q2, body.q3
        place.x, place.y, place.z = body.x, body.y, body.z
        place.vx, place.vy, place.vz = body.vx, body.vy, body.vz
        r = place.rotation
        r[0, 0], r[0, 1], r[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        r[1, 0], r[1, 1], r[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        r[2, 0], r[2, 1], r[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        place.wx, place.wy, place.wz = rotated(place.rotation, body.p, body.q, body.r)


@njit_inner
def body_rates(
    state: RecordArray, bodies: RecordArray, pose: RecordArray, wrench: RecordArray, slope: RecordArray
) -> None:
    """Newton's and Euler's equations and the kinematics of every body into ``slope``."""
    for b in range(bodies.shape[0]):
        body, push, rate = state[b], wrench[b], slope[b]
        mass, inertia = bodies[b].mass_kg, bodies[b].inertia
        w, x, y, z = body.q0, body.q1, body.q2, body.q3
        p, q, r = body.p, body.q, body.r
        # m v' = F.
        rate.x, rate.y, rate.z = body.vx, body.vy, body.vz
        rate.vx, rate.vy, rate.vz = push.fx / mass, push.fy / mass, push.fz / mass
        # The quaternion's rate is half its product with the angular rate in the body's axes.
        rate.q0 = -0.5 * (x * p + y * q + z * r)
        rate.q1 = 0.5 * (w * p + y * r - z * q)
        rate.q2 = 0.5 * (w * q + z * p - x * r)
        rate.q3 = 0.5 * (w * r + x * q - y * p)
        # Euler: I w' = M - w x I w, principal axes.
        mx, my, mz = rotated_back(pose[b].rotation, push.mx, push.my, push.mz)
        ix, iy, iz = inertia[0], inertia[1], inertia[2]
        rate.p = (mx - (iz - iy) * q * r) / ix
        rate.q = (my - (ix - iz) * r * p) / iy
        rate.r = (mz - (iy - ix) * p * q) / iz


@njit_inner
def normalise(state: RecordArray) -> None:
    """Make every quaternion one of length 1 again."""
    for b in range(state.shape[0]):
        body = state[b]
        length = np.sqrt(body.q0 * body.q0 + body.q1 * body.q1 + body.q2 * body.q2 + body.q3 * body.q3)
        body.q0 /= length
        body.q1 /= length
        body.q2 /= length
        body.q3 /= length


@njit_inner
def want(contacts: RecordArray, wanted: bool) -> None:
    """Say whether the next evaluation of the forces shall tell of the contact of each wheel."""
    for w in range(contacts.shape[0]):
        contacts[w].wanted = wanted


@njit_borrowed
def march(
    first: int,
    step_s: float,
    state: FloatArray,
    rows: FloatArray,
    scratch: FloatArray,
    pose: RecordArray,
    wrench: RecordArray,
    memory: Memory,
    data: ForceData,
    every: int,
    contacts: RecordArray,
) -> int:
    """Integrate one step per row.

    Parameters
    ----------
    first : int
        Number of the step that begins here; step 0 begins at t = 0.
    step_s : float
        Step.
    state : ndarray (n,)
        State (see the module); replaced by the last one.
    rows : ndarray (m, n), output
        State after each step.
    scratch : ndarray (3, n)
        Scratch of this function.
    pose, wrench : ndarray of records (b,)
        Scratch of `simrail.vehicle.engines.forces.forces`.
    memory : Memory
        Of `simrail.vehicle.engines.forces.forces`.
    data : ForceData
        The constants.
    every : int
        The contact is told at each step from 0 on whose number this divides.
    contacts : ndarray of records (k, w), output
        `simrail.vehicle.contact.contact.CONTACT` of each wheel at the beginning of these steps.

    Returns
    -------
    int
        Steps made: fewer than rows if a wheel left its rail, whose flag is in ``memory``.
    """
    nb, np_, n = data.bodies.shape[0], data.spins.shape[0], state.shape[0]
    turned = BODY * nb
    spin_at, zeta_at = turned + np_, turned + 2 * np_
    stage, total, slope = scratch[0], scratch[1], scratch[2]
    bodies, bodies_stage, bodies_slope = (
        state[:turned].view(STATE), stage[:turned].view(STATE), slope[:turned].view(STATE)
    )  # fmt: skip
    spin, zeta = stage[spin_at:zeta_at], stage[zeta_at:]
    torque, zeta_rate = slope[spin_at:zeta_at], slope[zeta_at:]
    for k in range(n):
        stage[k] = state[k]
    seen = 0
    for row in range(rows.shape[0]):
        start = (first + row) * step_s
        tells = first + row >= 0 and (first + row) % every == 0
        for part in range(4):
            # Stages at 0, 1/2, 1/2, 1 of the step, with weights 1, 2, 2, 1 sixths.
            t = start + step_s * (0.0 if part == 0 else (1.0 if part == 3 else 0.5))
            ahead = step_s * (0.5 if part < 2 else 1.0)
            weight = step_s / (6.0 if part == 0 or part == 3 else 3.0)
            pose_of(bodies_stage, pose)
            # The first stage is the step's beginning itself: nothing is evaluated for the contact alone.
            want(memory.contacts, tells and part == 0)
            forces(t, pose, spin, zeta, data, wrench, torque, zeta_rate, memory)
            if tells and part == 0:
                for w in range(contacts.shape[1]):
                    contacts[seen, w] = memory.contacts[w]
                seen += 1
            body_rates(bodies_stage, data.bodies, pose, wrench, bodies_slope)
            for k in range(np_):
                slope[turned + k] = spin[k]
                torque[k] /= data.spins[k].inertia
            if part == 0:
                for k in range(n):
                    total[k] = state[k] + weight * slope[k]
                    stage[k] = state[k] + ahead * slope[k]
            elif part < 3:
                for k in range(n):
                    total[k] += weight * slope[k]
                    stage[k] = state[k] + ahead * slope[k]
            else:
                for k in range(n):
                    state[k] = total[k] + weight * slope[k]
        normalise(bodies)
        for k in range(n):
            stage[k] = state[k]
            rows[row, k] = state[k]
        for a in range(memory.axle_memos.shape[0]):
            if memory.axle_memos[a].derailed:
                return int(row)
    return int(rows.shape[0])
