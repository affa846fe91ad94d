"""Motion of a mount from the truth of its body: worked out in pieces, and remembered while there is room.

A piece is so short that its arrays stay in the processor's cache, and the pages of a truth that is mapped
from disk are given back after each: a ride of any length needs the memory of what was asked for, no more.
"""

from __future__ import annotations

import mmap
from collections import OrderedDict
from collections.abc import Hashable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from simrail.core.columns import ATTITUDE, IMU, MOTION, POSITION, VELOCITY
from simrail.core.jit import FloatArray
from simrail.core.rigid_body import carry
from simrail.core.rotation import rotation_matrix
from simrail.ride.abeam import along_track

if TYPE_CHECKING:
    from simrail.ride.truth import BodyMotion, Mount, Truth

PIECE = 8192
"""Rows at a time."""

_PIECES_HELD = 32
"""After so many, pages of the disk are given back."""

MOST_BYTES = 256_000_000
"""What a truth remembers of the motions of its mounts; the one that was asked for longest ago goes first."""

_INERTIAL = POSITION + VELOCITY + ATTITUDE + IMU
"""Columns that need no track; `MOTION` begins with them."""


class Remembered:
    """Arrays by what was asked for, as many as there is room for, the most recently used."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._arrays: OrderedDict[Hashable, FloatArray] = OrderedDict()
        self._most_bytes = most_bytes

    def __getstate__(self) -> dict[str, object]:
        """Nothing of it goes to another process: it is worked out there as fast as it is sent."""
        return {"_arrays": OrderedDict(), "_most_bytes": self._most_bytes}

    @property
    def nbytes(self) -> int:
        """How much is kept."""
        return sum(array.nbytes for array in self._arrays.values())

    def get(self, key: Hashable) -> FloatArray | None:
        """The array of a key, if it is kept."""
        if key in self._arrays:
            self._arrays.move_to_end(key)
        return self._arrays.get(key)

    def keep(self, key: Hashable, array: FloatArray) -> None:
        """Keep an array, unless it alone is more than there is room for."""
        if array.nbytes > self._most_bytes:
            return
        self._arrays[key] = array
        while self.nbytes > self._most_bytes:
            self._arrays.popitem(last=False)


def mount_motion(truth: Truth, mount: Mount, rows: range, columns: Sequence[str]) -> FloatArray:
    """Motion of a mount; see `simrail.ride.truth.Truth.motion`.

    Returns
    -------
    ndarray (n, m)
        The columns at the rows.
    """
    body = truth.bodies[mount.body]
    lever = np.array(mount.position_m, dtype=np.float64) - np.array([0.0, 0.0, body.height_m])
    tilt = rotation_matrix(np.array([[mount.roll_rad, mount.pitch_rad, mount.yaw_rad]]))[0]
    chosen = [MOTION.index(name) for name in columns]
    abeam = any(name not in _INERTIAL for name in columns)
    data = np.empty((len(rows), len(chosen)))
    mapped = [body.position, body.velocity, truth.reference_position_m]
    if truth.short_waves is not None:
        mapped += truth.short_waves.arrays(mount.body)
    motion, acceleration, rotation = (
        np.empty((PIECE, len(MOTION))),
        np.empty((PIECE, 3)),
        np.empty((PIECE, 3, 3)),
    )
    for begin in range(0, len(rows), PIECE):
        piece = rows[begin : begin + PIECE]
        m = len(piece)
        here = slice(piece.start, piece.stop, piece.step)
        # Turns and yaw of the sensor follow the body's: a row needs no other.
        carry(
            _rows_of(truth.body(mount.body, ahead_m=mount.position_m[0], rows=here)),
            lever,
            tilt,
            mount.yaw_rad,
            truth.gravity_mps2,
            motion[:m],
            acceleration[:m],
            rotation[:m],
        )
        if abeam:
            guess = truth.reference_position_m[here] + body.offset_m + mount.position_m[0]
            frame, *along, beside = along_track(
                truth.track, guess, motion[:m, 0:3], motion[:m, 3:6], acceleration[:m]
            )
            motion[:m, 15:18] = np.column_stack(along)
            motion[:m, 18:20] = beside
            motion[:m, 20:23] = _angles_near(np.swapaxes(frame, 1, 2) @ rotation[:m], mount.yaw_rad)
        data[begin : begin + m] = motion[:m, chosen]
        if begin // PIECE % _PIECES_HELD == _PIECES_HELD - 1:
            give_back(mapped)
    give_back(mapped)
    return data


def _rows_of(body: BodyMotion) -> FloatArray:
    """A body's motion as one array (n, 18), copied."""
    parts = (
        body.position,
        body.velocity,
        body.acceleration,
        body.angles,
        body.rate,
        body.angular_acceleration,
    )
    return np.concatenate(parts, axis=1, dtype=np.float64)


def give_back(arrays: Iterable[FloatArray]) -> None:
    """Drop the pages of arrays that are mapped from disk from this process; they are read anew if needed."""
    for array in arrays:
        mapped = getattr(array, "_mmap", None)
        if mapped is not None and hasattr(mmap, "MADV_DONTNEED"):
            mapped.madvise(mmap.MADV_DONTNEED)


def _angles_near(rotation: FloatArray, yaw_rad: float) -> FloatArray:
    """Roll, pitch and yaw (n, 3) of rotations (n, 3, 3), the yaw within half a turn of a given one."""
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1.0, 1.0))
    yaw = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    yaw += 2.0 * np.pi * np.rint((yaw_rad - yaw) / (2.0 * np.pi))
    return np.column_stack([roll, pitch, yaw])
