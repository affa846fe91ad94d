"""The force kernel in the coordinates of Exudyn: what its user function calls, without Exudyn itself.

Rotation vectors and rates in the axes of the nodes come in, generalised forces in these axes go out; the
forces are those of `simrail.vehicle.engines.forces`. All arguments lie in one array, the arena, since every
array that is handed over takes its time. What the nodes are, and why, is said in
`simrail.vehicle.engines.exudyn_engine`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simrail.core.jit import FloatArray, njit
from simrail.vehicle.engines.forces import forces

HALF_TURN = np.array([1.0, -1.0, -1.0])
"""Diagonal of the half turn about X between the axes of a body and those of its node."""


@njit
def generalized_forces(
    t: float,
    state: FloatArray,
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
    pose: FloatArray,
    wrench: FloatArray,
    memo: FloatArray,
    work: FloatArray,
) -> None:
    """Forces in Exudyn's coordinates.

    ``state`` (3 n,) holds coordinates, rates and, as the output, generalised forces, each n = 6 b + p +
    the number of first-order states long. Rates and moments of a node are in its own axes: the body's,
    half a turn about X.
    """
    nb = bodies.shape[0]
    n = state.shape[0] // 3
    q, v, out = state[:n], state[n : 2 * n], state[2 * n :]
    for b in range(nb):
        p, j = pose[b], 6 * b
        for k in range(3):
            p[k], p[3 + k] = q[j + k], v[j + k]
        # Rodrigues: cos I + sin/angle [r]x + (1 - cos)/angle^2 r r^T, then the half turn.
        rx, ry, rz = q[j + 3], q[j + 4], q[j + 5]
        square = rx * rx + ry * ry + rz * rz
        angle = np.sqrt(square)
        c = np.cos(angle)
        s = np.sin(angle) / angle
        d = (1.0 - c) / square
        p[6], p[7], p[8] = c + d * rx * rx, s * rz - d * rx * ry, -s * ry - d * rx * rz
        p[9], p[10], p[11] = s * rz + d * rx * ry, -c - d * ry * ry, s * rx - d * ry * rz
        p[12], p[13], p[14] = d * rx * rz - s * ry, -s * rx - d * ry * rz, -c - d * rz * rz
        wx, wy, wz = v[j + 3], -v[j + 4], -v[j + 5]
        for k in range(3):
            p[15 + k] = p[6 + 3 * k] * wx + p[7 + 3 * k] * wy + p[8 + 3 * k] * wz
    first = 6 * nb
    creep = first + spins.shape[0]
    forces(
        t, pose, v[first:creep], v[creep:], bodies, springs, series, turns, stops, laws, wheels, spins, axles,
        guide, switches, drive, grid, table, coef, const, wrench, out[first:creep], out[creep:], memo, work,
    )  # fmt: skip
    for b in range(nb):
        w, p, j = wrench[b], pose[b], 6 * b
        out[j], out[j + 1], out[j + 2] = w[0], w[1], w[2]
        out[j + 3] = p[6] * w[3] + p[9] * w[4] + p[12] * w[5]
        out[j + 4] = -(p[7] * w[3] + p[10] * w[4] + p[13] * w[5])
        out[j + 5] = -(p[8] * w[3] + p[11] * w[4] + p[14] * w[5])


def spread(parts: Sequence[FloatArray]) -> tuple[FloatArray, list[FloatArray]]:
    """Lay arrays into one, with a header that says where each begins and what shape it has.

    A compiled function takes some 0.15 us per array that it is handed; at 8,000 calls a simulated second
    one array instead of twenty-one is worth it. `part_of` takes them out again.

    Returns
    -------
    arena : ndarray (m,)
        Header of six numbers per part (offset, then the shape padded with ones to five), then the parts.
    views : list of ndarray
        The parts, as views into the arena.
    """
    head = 6 * len(parts)
    arena = np.zeros(head + sum(part.size for part in parts))
    views = []
    at = head
    for i, part in enumerate(parts):
        arena[6 * i : 6 * i + 6] = at, *part.shape, *(1,) * (5 - part.ndim)
        views.append(arena[at : at + part.size].reshape(part.shape))
        views[-1][...] = part
        at += part.size
    return arena, views


@njit
def part_of(arena: FloatArray, i: int) -> FloatArray:
    """The i-th part of an arena (see `spread`), flat."""
    at = int(arena[6 * i])
    n = 1
    for k in range(1, 6):
        n *= int(arena[6 * i + k])
    return arena[at : at + n]


@njit
def generalized_forces_of(t: float, arena: FloatArray) -> None:
    """`generalized_forces` of an arena that holds its arguments after t, in their order."""
    coef = part_of(arena, 15)
    generalized_forces(
        t,
        part_of(arena, 0),
        part_of(arena, 1).reshape(-1, 1),
        part_of(arena, 2).reshape(int(arena[13]), 17),
        part_of(arena, 3).reshape(int(arena[19]), 11),
        part_of(arena, 4).reshape(int(arena[25]), 8),
        part_of(arena, 5).reshape(int(arena[31]), 12),
        part_of(arena, 6).reshape(int(arena[37]), 5),
        part_of(arena, 7).reshape(-1, 6),
        part_of(arena, 8).reshape(-1, 6),
        part_of(arena, 9).reshape(-1, 2),
        part_of(arena, 10),
        part_of(arena, 11),
        part_of(arena, 12).reshape(-1, 5),
        part_of(arena, 13),
        part_of(arena, 14).reshape(-1, 12, 4),
        coef.reshape(int(arena[91]), 2, int(arena[93]), int(arena[94]), 4),
        part_of(arena, 16).reshape(int(arena[97]), -1),
        part_of(arena, 17).reshape(-1, 18),
        part_of(arena, 18).reshape(-1, 6),
        part_of(arena, 19),
        part_of(arena, 20),
    )
