"""The force kernel in the coordinates of Exudyn: what its user function calls, without Exudyn itself.

Rotation vectors and rates in the axes of the nodes come in, generalised forces in these axes go out; the
forces are those of `simrail.vehicle.engines.forces`. What the nodes are, and why, is said in
`simrail.vehicle.engines.exudyn_engine`.
"""

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.contact.contact_geometry import CONST, PATCH
from simrail.vehicle.engines import records
from simrail.vehicle.engines.force_data import ForceData, Memory
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.records import RecordArray, rotated, rotated_back

_FLOAT = np.dtype("f8")

HALF_TURN = np.array([1.0, -1.0, -1.0])
"""Diagonal of the half turn about X between the axes of a body and those of its node."""


@njit_inner
def poses_of(q: FloatArray, v: FloatArray, pose: RecordArray) -> None:
    """Poses of the bodies from Exudyn's coordinates and rates: six numbers of each body, (6 b + ...,)."""
    for b in range(pose.shape[0]):
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
        p.wx, p.wy, p.wz = rotated(r, v[j + 3], -v[j + 4], -v[j + 5])


@njit_inner
def loads_of(pose: RecordArray, wrench: RecordArray, out: FloatArray) -> None:
    """Forces and moments on the bodies as generalised forces: moments in the axes of the nodes."""
    for b in range(pose.shape[0]):
        w, j = wrench[b], 6 * b
        out[j], out[j + 1], out[j + 2] = w.fx, w.fy, w.fz
        mx, my, mz = rotated_back(pose[b].rotation, w.mx, w.my, w.mz)
        out[j + 3], out[j + 4], out[j + 5] = mx, -my, -mz


def _records_at(_typing: Any, address: Any, shape: Any, dtype: Any) -> Any:
    """Array of records, C-contiguous, at an address: numba's `carray`, compiled in no time.

    The caller must keep what lies there. ``shape`` is a tuple, ``dtype`` a numpy dtype.
    """
    array = types.Array(dtype.dtype, len(shape), "C")

    def lower(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        made = context.make_array(array)(context, builder)
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(dtype.dtype)))
        sizes = [builder.extract_value(args[1], i) for i in range(len(shape))]
        strides = [size]
        for n in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], n))
        data = builder.inttoptr(args[0], made.data.type)
        populate_array(made, data, sizes, strides, size, None)
        return made._getvalue()

    return array(address, shape, dtype), lower


records_at: Any = intrinsic(_records_at)
"""`_records_at`, as a kernel calls it: ``records_at(address, shape, dtype)``."""


_PLACES = np.dtype(
    [(name, "i8", (4,)) for name in ("state", *ForceData._fields, *Memory._fields, "pose", "wrench")],
    align=True,
)


class Arguments:
    """Arguments of `generalized_forces`, of which only the addresses are handed over.

    A compiled function takes some 0.15 us per array that it is handed; at 8,000 calls a simulated second
    one array instead of twenty-two is worth it.

    Attributes
    ----------
    places : ndarray of records (1,)
        Address and shape of every array, for `generalized_forces`. They hold as long as this object lives.
    state : ndarray (3 n,)
        Coordinates, rates and, as the output, generalised forces, each n = 6 b + p + the number of
        first-order states long.
    contacts : ndarray of records (w,)
        Those of the memory.
    """

    def __init__(self, size: int, data: ForceData, memory: Memory) -> None:
        self.state, self.contacts = np.zeros(3 * size), memory.contacts
        bodies = len(data.bodies)
        parts = [self.state, *data, *memory, np.zeros(bodies, records.POSE), np.zeros(bodies, records.WRENCH)]
        self._parts = [np.ascontiguousarray(part) for part in parts]
        rows = [(part.ctypes.data, *part.shape, *(1,) * (3 - part.ndim)) for part in self._parts]
        self.places = np.array([tuple(rows)], _PLACES)


@njit_borrowed
def generalized_forces(t: float, places: RecordArray) -> None:
    """Forces in Exudyn's coordinates, of the arrays in `Arguments.places`.

    Rates and moments of a node are in its own axes: the body's, half a turn about X.
    """
    at = places[0]
    data = ForceData(
        records_at(at.bodies[0], (at.bodies[1],), records.BODY),
        records_at(at.springs[0], (at.springs[1],), records.SPRING),
        records_at(at.series[0], (at.series[1],), records.SERIES),
        records_at(at.links[0], (at.links[1],), records.LINK),
        records_at(at.stops[0], (at.stops[1],), records.STOP),
        records_at(at.laws[0], (at.laws[1],), records.LAW),
        records_at(at.wheels[0], (at.wheels[1],), records.WHEEL),
        records_at(at.spins[0], (at.spins[1],), records.SPIN),
        records_at(at.axles[0], (at.axles[1],), records.AXLE),
        records_at(at.guide[0], (1,), records.GUIDE),
        records_at(at.traction[0], (1,), records.TRACTION),
        records_at(at.options[0], (1,), records.OPTIONS),
        records_at(at.drive[0], (at.drive[1],), records.DRIVE),
        records_at(at.track[0], (at.track[1],), records.TRACK),
        records_at(at.patches[0], (at.patches[1], at.patches[2], at.patches[3]), PATCH),
        records_at(at.const[0], (at.const[1],), CONST),
    )
    memory = Memory(
        records_at(at.guide_memo[0], (1,), records.GUIDE_MEMO),
        records_at(at.axle_memos[0], (at.axle_memos[1],), records.AXLE_MEMO),
        records_at(at.frame[0], (1,), records.FRAME),
        records_at(at.contacts[0], (at.contacts[1],), CONTACT),
    )
    pose = records_at(at.pose[0], (at.pose[1],), records.POSE)
    wrench = records_at(at.wrench[0], (at.wrench[1],), records.WRENCH)
    n = at.state[1] // 3
    state = records_at(at.state[0], (3 * n,), _FLOAT)
    q, v, out = state[:n], state[n : 2 * n], state[2 * n :]
    poses_of(q, v, pose)
    spins = 6 * pose.shape[0]
    states = spins + data.spins.shape[0]
    forces(t, pose, v[spins:states], v[states:], data, wrench, out[spins:states], out[states:], memory)
    loads_of(pose, wrench, out)


@njit_borrowed
def tell_contacts(
    time_s: FloatArray,
    rows: FloatArray,
    state: FloatArray,
    told: RecordArray,
    places: RecordArray,
    out: RecordArray,
) -> None:
    """Contact of each wheel at rows of Exudyn's coordinates and rates.

    Parameters
    ----------
    time_s : ndarray (n,)
        Times.
    rows : ndarray (n, 2, k)
        Coordinates and rates.
    state, told, places : ndarray
        `Arguments.state`, its memory's ``contacts``, and `Arguments.places`.
    out : ndarray of records (n, w), output
        `simrail.vehicle.contact.contact.CONTACT`.
    """
    size = rows.shape[2]
    for w in range(told.shape[0]):
        told[w].wanted = 1
    for i in range(rows.shape[0]):
        for k in range(size):
            state[k] = rows[i, 0, k]
            state[size + k] = rows[i, 1, k]
        generalized_forces(time_s[i], places)
        for w in range(told.shape[0]):
            out[i, w] = told[w]
