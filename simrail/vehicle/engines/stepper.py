"""Fixed-step classical Runge-Kutta integration of a vehicle, compiled: the kernel of the compiled engine.

The state is one flat array: per body position (3), attitude quaternion (4, scalar first), velocity (3,
global axes) and angular rate (3, body axes); then the spin angles, the spin rates, and the first-order
states. The quaternion is integrated like everything else and normalised once per step: its error in a
step goes with the fifth power of the small angle turned in it, and unlike a rotation vector it has no
place where its composition loses digits.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.vehicle.engines.forces import forces

BODY = 13
"""Numbers of a body in the state."""


@njit_borrowed
def pose_of(state: FloatArray, bodies: int, pose: FloatArray) -> None:
    """Position, velocity, rotation matrix (rows) and global angular rate of each body into (b, 18)."""
    for b in range(bodies):
        j = BODY * b
        w, x, y, z = state[j + 3], state[j + 4], state[j + 5], state[j + 6]
        for k in range(3):
            pose[b, k] = state[j + k]
            pose[b, 3 + k] = state[j + 7 + k]
        r00, r01, r02 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        r10, r11, r12 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        r20, r21, r22 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        p, q, r = state[j + 10], state[j + 11], state[j + 12]
        pose[b, 6], pose[b, 7], pose[b, 8] = r00, r01, r02
        pose[b, 9], pose[b, 10], pose[b, 11] = r10, r11, r12
        pose[b, 12], pose[b, 13], pose[b, 14] = r20, r21, r22
        pose[b, 15] = r00 * p + r01 * q + r02 * r
        pose[b, 16] = r10 * p + r11 * q + r12 * r
        pose[b, 17] = r20 * p + r21 * q + r22 * r


@njit_borrowed
def body_rates(
    state: FloatArray, inertia: FloatArray, pose: FloatArray, wrench: FloatArray, slope: FloatArray
) -> None:
    """Newton's and Euler's equations and the kinematics of every body into ``slope``.

    ``inertia`` (b, 4): mass and principal inertias.
    """
    for b in range(inertia.shape[0]):
        j = BODY * b
        w, x, y, z = state[j + 3], state[j + 4], state[j + 5], state[j + 6]
        p, q, r = state[j + 10], state[j + 11], state[j + 12]
        mass, ix, iy, iz = inertia[b, 0], inertia[b, 1], inertia[b, 2], inertia[b, 3]
        mx, my, mz = wrench[b, 3], wrench[b, 4], wrench[b, 5]
        for k in range(3):
            slope[j + k] = state[j + 7 + k]
            slope[j + 7 + k] = wrench[b, k] / mass
        slope[j + 3] = -0.5 * (x * p + y * q + z * r)
        slope[j + 4] = 0.5 * (w * p + y * r - z * q)
        slope[j + 5] = 0.5 * (w * q + z * p - x * r)
        slope[j + 6] = 0.5 * (w * r + x * q - y * p)
        about_x = pose[b, 6] * mx + pose[b, 9] * my + pose[b, 12] * mz
        about_y = pose[b, 7] * mx + pose[b, 10] * my + pose[b, 13] * mz
        about_z = pose[b, 8] * mx + pose[b, 11] * my + pose[b, 14] * mz
        slope[j + 10] = (about_x - (iz - iy) * q * r) / ix
        slope[j + 11] = (about_y - (ix - iz) * r * p) / iy
        slope[j + 12] = (about_z - (iy - ix) * p * q) / iz


@njit_borrowed
def normalise(state: FloatArray, bodies: int) -> None:
    """Make every quaternion one of length 1 again."""
    for b in range(bodies):
        j = BODY * b + 3
        square = 0.0
        for k in range(4):
            square += state[j + k] * state[j + k]
        for k in range(4):
            state[j + k] /= np.sqrt(square)


@njit_borrowed
def march(
    first: int,
    step_s: float,
    state: FloatArray,
    rows: FloatArray,
    inertia: FloatArray,
    spin_inertia: FloatArray,
    memo: FloatArray,
    scratch: FloatArray,
    pose: FloatArray,
    wrench: FloatArray,
    work: FloatArray,
    data: tuple[FloatArray, ...],
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
    inertia : ndarray (b, 4)
        Mass and principal inertias of each body.
    spin_inertia : ndarray (p,)
        Of each spin.
    memo : ndarray
        Memory of `simrail.vehicle.engines.forces.forces`.
    scratch : ndarray (3, n)
        Scratch of this function.
    pose, wrench, work : ndarray (b, 18), (b, 6), (34,)
        Scratch of `simrail.vehicle.engines.forces.forces`.
    data : tuple of ndarray
        `simrail.vehicle.engines.force_data.ForceData`.

    Returns
    -------
    int
        Steps made: fewer than rows if a wheel left its rail, whose flag is in ``memo``.
    """
    nb, np_, n = inertia.shape[0], spin_inertia.shape[0], state.shape[0]
    turned = BODY * nb
    spin_at, zeta_at = turned + np_, turned + 2 * np_
    stage, total, slope = scratch[0], scratch[1], scratch[2]
    spin, zeta = stage[spin_at:zeta_at], stage[zeta_at:]
    torque, zeta_rate = slope[spin_at:zeta_at], slope[zeta_at:]
    for k in range(n):
        stage[k] = state[k]
    for row in range(rows.shape[0]):
        start = (first + row) * step_s
        for part in range(4):
            # Stages at 0, 1/2, 1/2, 1 of the step, with weights 1, 2, 2, 1 sixths.
            t = start + step_s * (0.0 if part == 0 else (1.0 if part == 3 else 0.5))
            ahead = step_s * (0.5 if part < 2 else 1.0)
            weight = step_s / (6.0 if part == 0 or part == 3 else 3.0)
            pose_of(stage, nb, pose)
            forces(t, pose, spin, zeta, *data, wrench, torque, zeta_rate, memo, work)  # type: ignore[call-arg]
            body_rates(stage, inertia, pose, wrench, slope)
            for k in range(np_):
                slope[turned + k] = spin[k]
                torque[k] /= spin_inertia[k]
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
        normalise(state, nb)
        for k in range(n):
            stage[k] = state[k]
            rows[row, k] = state[k]
        for k in range(3, memo.shape[0], 5):
            if memo[k] != 0.0:
                return row
    return rows.shape[0]
