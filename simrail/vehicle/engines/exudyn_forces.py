"""The force kernel in the coordinates of Exudyn: what its user function calls, without Exudyn itself.

Rotation vectors and rates in the axes of the nodes come in, generalised forces in these axes go out; the
forces are those of `simrail.vehicle.engines.forces`. All arguments lie in one array, the arena, since every
array that is handed over takes its time. What the nodes are, and why, is said in
`simrail.vehicle.engines.exudyn_engine`.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit
from simrail.vehicle.contact.contact_geometry import CONST, PATCH
from simrail.vehicle.engines.force_data import ForceData, Memory
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.records import (
    AXLE,
    AXLE_MEMO,
    BODY,
    DRIVE,
    FRAME,
    GUIDE,
    GUIDE_MEMO,
    LAW,
    OPTIONS,
    POSE,
    SERIES,
    SPIN,
    SPRING,
    STOP,
    TRACK,
    TRACTION,
    TURN,
    WHEEL,
    WRENCH,
    RecordArray,
    rotated,
    rotated_back,
)

HALF_TURN = np.array([1.0, -1.0, -1.0])
"""Diagonal of the half turn about X between the axes of a body and those of its node."""


@njit
def generalized_forces(
    t: float,
    state: FloatArray,
    data: ForceData,
    memory: Memory,
    pose: RecordArray,
    wrench: RecordArray,
) -> None:
    """Forces in Exudyn's coordinates.

    ``state`` (3 n,) holds coordinates, rates and, as the output, generalised forces, each n = 6 b + p +
    the number of first-order states long. Rates and moments of a node are in its own axes: the body's,
    half a turn about X.
    """
    nb = data.bodies.shape[0]
    n = state.shape[0] // 3
    q, v, out = state[:n], state[n : 2 * n], state[2 * n :]
    for b in range(nb):
        p, j = pose[b], 6 * b
        p.x, p.y, p.z = q[j], q[j + 1], q[j + 2]
        p.vx, p.vy, p.vz = v[j], v[j + 1], v[j + 2]
        # Rodrigues: cos I + sin/angle [r]x + (1 - cos)/angle^2 r r^T, then the half turn.
        rx, ry, rz = q[j + 3], q[j + 4], q[j + 5]
        square = rx * rx + ry * ry + rz * rz
        angle = np.sqrt(square)
        c = np.cos(angle)
        s = np.sin(angle) / angle
        d = (1.0 - c) / square
        r = p.rotation
        r[0, 0], r[0, 1], r[0, 2] = c + d * rx * rx, s * rz - d * rx * ry, -s * ry - d * rx * rz
        r[1, 0], r[1, 1], r[1, 2] = s * rz + d * rx * ry, -c - d * ry * ry, s * rx - d * ry * rz
        r[2, 0], r[2, 1], r[2, 2] = d * rx * rz - s * ry, -s * rx - d * ry * rz, -c - d * rz * rz
        p.wx, p.wy, p.wz = rotated(p, v[j + 3], -v[j + 4], -v[j + 5])
    spins = 6 * nb
    states = spins + data.spins.shape[0]
    forces(t, pose, v[spins:states], v[states:], data, wrench, out[spins:states], out[states:], memory)
    for b in range(nb):
        w, j = wrench[b], 6 * b
        out[j], out[j + 1], out[j + 2] = w.fx, w.fy, w.fz
        mx, my, mz = rotated_back(pose[b], w.mx, w.my, w.mz)
        out[j + 3], out[j + 4], out[j + 5] = mx, -my, -mz


_PARTS = ("state", *ForceData._fields, *Memory._fields, "pose", "wrench")
_HEAD = np.dtype([(name, "f8", (2,)) for name in _PARTS], align=True)
"""Head of an arena: where each part begins and ends."""
_HEAD_SIZE = 2 * len(_PARTS)


class Arena:
    """All arguments of `generalized_forces` in one array, behind a head that says where each lies.

    A compiled function takes some 0.15 us per array that it is handed; at 8,000 calls a simulated second
    one array instead of twenty-one is worth it.

    Attributes
    ----------
    array : ndarray (m,)
        The arena, for `generalized_forces_of`.
    state : ndarray (3 n,)
        Coordinates, rates and generalised forces in it.
    memory : Memory
        The kernel's memory in it.
    """

    def __init__(self, size: int, data: ForceData, memory: Memory) -> None:
        bodies = len(data.bodies)
        parts = [np.zeros(3 * size), *data, *memory, np.zeros(bodies, POSE), np.zeros(bodies, WRENCH)]
        flat = [np.ascontiguousarray(part).reshape(-1).view(np.float64) for part in parts]
        ends = _HEAD_SIZE + np.cumsum([0, *(part.size for part in flat)])
        self.array = np.concatenate([np.column_stack([ends[:-1], ends[1:]]).ravel(), *flat])
        views = {
            name: self.array[begin:end].view(part.dtype)
            for name, begin, end, part in zip(_PARTS, ends, ends[1:], parts, strict=False)
        }
        self.state = views["state"]
        self.memory = Memory(*(views[name] for name in Memory._fields))


@njit
def _part(arena: FloatArray, ends: FloatArray) -> FloatArray:
    """A part of an arena."""
    return arena[int(ends[0]) : int(ends[1])]


@njit
def generalized_forces_of(t: float, arena: FloatArray) -> None:
    """`generalized_forces` of the arguments in an `Arena`."""
    head = arena[:_HEAD_SIZE].view(_HEAD)[0]
    const = _part(arena, head.const).view(CONST)
    data = ForceData(
        _part(arena, head.bodies).view(BODY),
        _part(arena, head.springs).view(SPRING),
        _part(arena, head.series).view(SERIES),
        _part(arena, head.turns).view(TURN),
        _part(arena, head.stops).view(STOP),
        _part(arena, head.laws).view(LAW),
        _part(arena, head.wheels).view(WHEEL),
        _part(arena, head.spins).view(SPIN),
        _part(arena, head.axles).view(AXLE),
        _part(arena, head.guide).view(GUIDE),
        _part(arena, head.traction).view(TRACTION),
        _part(arena, head.options).view(OPTIONS),
        _part(arena, head.drive).view(DRIVE),
        _part(arena, head.track).view(TRACK),
        _part(arena, head.patches).view(PATCH).reshape(const.shape[0], 2, -1),
        const,
    )
    memory = Memory(
        _part(arena, head.guide_memo).view(GUIDE_MEMO),
        _part(arena, head.axle_memos).view(AXLE_MEMO),
        _part(arena, head.frame).view(FRAME),
    )
    pose, wrench = _part(arena, head.pose).view(POSE), _part(arena, head.wrench).view(WRENCH)
    generalized_forces(t, _part(arena, head.state), data, memory, pose, wrench)
