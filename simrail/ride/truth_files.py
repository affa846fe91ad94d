"""A truth on disk: arrays that an engine fills piece by piece, and a header that says they are complete.

Large arrays are mapped, not copied, so a long ride neither needs nor takes memory. What a truth means
is said in `simrail.ride.truth`; which rides are kept, in `simrail.ride.cache`.
"""

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from simrail.core.columns import CONTACT
from simrail.core.jit import FloatArray
from simrail.core.sealed_files import DamagedError, damage_told, read_sealed, seal
from simrail.ride.truth import BODY_ARRAYS, BodyMotion, Truth
from simrail.track.design import TrackDesign

DOUBLE, SINGLE = ("position", "angles"), ("velocity", "acceleration", "rate", "angular_acceleration")
"""Columns of a body of a long ride, in two arrays, of double and of single precision: single has 6e-8 of a
value, 1e-6 m/s of a speed and 1e-4 deg/h of a slow turn, less than any sensor tells."""


def create_arrays(
    folder: Path,
    rows: int,
    *,
    bodies: int,
    wheels: int,
    wheel_states: int,
    contact_every: int = 0,
    contacts: int | None = None,
    compact: bool = False,
) -> dict[str, FloatArray]:
    """Create the arrays of a truth on disk, to be filled piece by piece in bounded memory.

    Returns
    -------
    dict of str to ndarray
        ``time_s`` and ``reference_position_m`` (rows,), ``body_<i>`` (rows, 18), ``wheel_<i>`` (rows,)
        and, if `wheel_states` > 0, ``wheel_state_<i>`` (rows, wheel_states), and, if `contact_every` > 0,
        ``contact_<i>`` (k, 12) of every such row, for `contacts` wheels (by default all), mapped to .npy
        files. If `compact`, ``body_<i>`` (rows, 6) and ``rates_<i>`` (rows, 12) of single precision
        (`DOUBLE`, `SINGLE`).

    Raises
    ------
    OSError
        If the disk has no room for all of them.
    """
    shapes: dict[str, tuple[int, ...]] = {"time_s": (rows,), "reference_position_m": (rows,)}
    shapes |= {f"body_{i}": (rows, 3 * len(DOUBLE if compact else BODY_ARRAYS)) for i in range(bodies)}
    if compact:
        shapes |= {f"rates_{i}": (rows, 3 * len(SINGLE)) for i in range(bodies)}
    shapes |= {f"wheel_{i}": (rows,) for i in range(wheels)}
    if wheel_states:
        shapes |= {f"wheel_state_{i}": (rows, wheel_states) for i in range(wheels)}
    if contact_every:
        kept = -(-rows // contact_every)
        count = wheels if contacts is None else contacts
        shapes |= {f"contact_{i}": (kept, len(CONTACT)) for i in range(count)}
    folder.mkdir(parents=True, exist_ok=True)
    return {
        name: create_array(folder, name, shape, np.float32 if name.startswith("rates_") else np.float64)
        for name, shape in shapes.items()
    }


def create_array(
    folder: Path, name: str, shape: tuple[int, ...], precision: type[np.float32 | np.float64]
) -> np.memmap:
    """Create an array on disk, mapped, with room for all of it.

    Raises
    ------
    OSError
        If the disk has no room.
    """
    place = folder / f"{name}.npy"
    made: np.memmap = np.lib.format.open_memmap(place, mode="w+", dtype=precision, shape=shape)
    # A mapped file has holes: a disk that is full when they are written to kills the process.
    if hasattr(os, "posix_fallocate"):
        with place.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, place.stat().st_size)
    return made


def read_array(folder: Path, name: str) -> FloatArray:
    """An array of a folder, mapped from disk."""
    array: FloatArray = np.load(folder / f"{name}.npy", mmap_mode="r")
    return array


def write_header(
    folder: Path,
    *,
    track: TrackDesign,
    bodies: dict[str, tuple[float, float]],
    wheels: dict[str, float],
    gravity_mps2: float,
    manifest: dict[str, Any],
    contact_every: int = 1,
    contact_wheels: list[str] | None = None,
    axle_offsets_m: dict[str, float] | None = None,
) -> None:
    """Write what goes with the arrays. Done last: a folder without it was interrupted, and is no truth.

    ``bodies`` maps names to (offset_m, height_m), ``wheels`` names to radii, in the order of the arrays;
    ``contact_wheels`` are those whose contacts are kept, if not all of them.
    """
    plain = {
        "track": track.to_dict(),
        "bodies": bodies,
        "wheels": wheels,
        "gravity_mps2": gravity_mps2,
        "manifest": manifest,
        "contact_every": contact_every,
        "contact_wheels": list(wheels) if contact_wheels is None else contact_wheels,
        "axle_offsets_m": axle_offsets_m or {},
    }
    seal(folder, plain)


def save_truth(truth: Truth, folder: Path) -> None:
    """Write a truth into a folder, losslessly."""
    states = max((state.shape[1] for state in truth.wheel_states.values()), default=0)
    arrays = create_arrays(
        folder,
        len(truth.time_s),
        bodies=len(truth.bodies),
        wheels=len(truth.wheel_angles),
        wheel_states=states,
        contact_every=truth.contact_every if truth.contacts else 0,
    )
    arrays["time_s"][:] = truth.time_s
    arrays["reference_position_m"][:] = truth.reference_position_m
    for i, body in enumerate(truth.bodies.values()):
        arrays[f"body_{i}"][:] = np.hstack([getattr(body, name) for name in BODY_ARRAYS])
    for i, wheel in enumerate(truth.wheel_angles):
        arrays[f"wheel_{i}"][:] = truth.wheel_angles[wheel]
        if states:
            arrays[f"wheel_state_{i}"][:] = truth.wheel_states[wheel]
        if truth.contacts:
            arrays[f"contact_{i}"][:] = truth.contacts[wheel]
    write_header(
        folder,
        track=truth.track,
        bodies={name: (body.offset_m, body.height_m) for name, body in truth.bodies.items()},
        wheels={name: truth.wheel_radius_m[name] for name in truth.wheel_angles},
        gravity_mps2=truth.gravity_mps2,
        manifest=truth.manifest,
        contact_every=truth.contact_every,
        axle_offsets_m=truth.axle_offsets_m,
    )


def load_truth(folder: Path) -> Truth:
    """Read what `save_truth` or an engine wrote; large arrays are mapped from disk, not copied.

    Raises
    ------
    DamagedError
        If the folder is incomplete, or not what was written.
    OSError
        If it cannot be read.
    """
    plain, names = read_sealed(folder)
    with damage_told():
        return _truth_of(_Header.model_validate(plain), names, partial(read_array, folder))


class _Header(BaseModel):
    """What a header says beside the arrays."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    track: dict[str, Any]
    bodies: dict[str, tuple[float, float]]
    wheels: dict[str, float]
    gravity_mps2: float
    manifest: dict[str, Any]
    contact_every: int
    contact_wheels: list[str]
    axle_offsets_m: dict[str, float]


def _truth_of(header: _Header, names: set[str], read: Callable[[str], FloatArray]) -> Truth:
    """A truth of its header and its arrays."""
    time_s = np.array(read("time_s"))
    bodies = {}
    for i, (name, (offset, height)) in enumerate(header.bodies.items()):
        stored = read(f"body_{i}")
        if len(stored) != len(time_s):
            raise DamagedError(f"body_{i}.npy has {len(stored)} rows, not {len(time_s)}")
        if stored.shape[1] == 3 * len(DOUBLE):
            rates = read(f"rates_{i}")
            parts = {key: stored[:, 3 * j : 3 * j + 3] for j, key in enumerate(DOUBLE)}
            parts |= {key: rates[:, 3 * j : 3 * j + 3] for j, key in enumerate(SINGLE)}
        else:
            parts = {key: stored[:, 3 * j : 3 * j + 3] for j, key in enumerate(BODY_ARRAYS)}
        bodies[name] = BodyMotion(offset_m=offset, height_m=height, **parts)
    has_contacts, has_states = "contact_0" in names, "wheel_state_0" in names
    return Truth(
        time_s=time_s,
        track=TrackDesign.from_dict(header.track),
        reference_position_m=np.array(read("reference_position_m")),
        bodies=bodies,
        wheel_angles={wheel: read(f"wheel_{i}") for i, wheel in enumerate(header.wheels)},
        wheel_states={wheel: read(f"wheel_state_{i}") for i, wheel in enumerate(header.wheels)}
        if has_states
        else {},
        wheel_radius_m=header.wheels,
        gravity_mps2=header.gravity_mps2,
        manifest=header.manifest,
        contacts={wheel: read(f"contact_{i}") for i, wheel in enumerate(header.contact_wheels)}
        if has_contacts
        else {},
        contact_every=header.contact_every,
        axle_offsets_m=header.axle_offsets_m,
    )
