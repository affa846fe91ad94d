"""The short-wave part of a truth on disk: made piece by piece beside the ride that it adds to.

Motions are kept as float32: relative to their size of some millimetres and metres per second squared that is
a ten-millionth. A folder without its header was interrupted, and is no vibration.
"""

from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from simrail.core.jit import FloatArray
from simrail.core.sealed_files import DamagedError, damage_told, read_sealed, seal
from simrail.ride.mount_motion import give_back
from simrail.ride.truth import Truth
from simrail.ride.truth_files import create_array, read_array
from simrail.ride.vibration.run import Shaker
from simrail.ride.vibration.short_waves import COLUMNS, ShortWaves
from simrail.ride.vibration.sources import Vibration
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.vibration.linear_model import Bending


def write_short_waves(
    vibration: Vibration,
    truth: Truth,
    model: VehicleModel,
    folder: Path,
    *,
    seed: int,
    manifest: dict[str, Any],
) -> None:
    """Work out the short-wave part of a ride and write it into a folder.

    Parameters
    ----------
    vibration : Vibration
        What shakes.
    truth : Truth
        The ride; motions are kept of its bodies, loads where it keeps contacts.
    model : VehicleModel
        The vehicle.
    folder : Path
        Where to.
    seed : int
        Root seed of the track draw.
    manifest : dict
        What the header says of the ride.
    """
    folder.mkdir(parents=True, exist_ok=True)
    shaker = Shaker(vibration, truth, model, seed=seed)
    rows, every = len(truth.time_s), truth.contact_every

    def create(name: str, *shape: int) -> np.memmap:
        return create_array(folder, name, shape, np.float32)

    motions = {body: create(f"motion_{i}", rows, len(COLUMNS)) for i, body in enumerate(truth.body_names)}
    bendings = [bending for bending in shaker.bendings if bending.body in truth.bodies]
    bends = {bending.body: create(f"bending_{i}", rows, 3) for i, bending in enumerate(bendings)}
    kept = -(-rows // every) if truth.contacts else 0
    loads = create("loads", kept, len(model.wheels)) if kept else None
    written = [*motions.values(), *bends.values(), *([] if loads is None else [loads])]
    least = np.full(len(model.wheels), np.inf)
    static = model.wheel_load_n(truth.gravity_mps2)
    for piece in shaker.run():
        here = slice(piece.first, piece.first + len(piece.loads))
        for body, motion in motions.items():
            motion[here] = piece.motions[body]
        for body, bend in bends.items():
            bend[here] = piece.bendings[body]
        least = np.minimum(least, 1.0 + piece.loads.min(axis=0) / static)
        if loads is not None:
            first = -(-here.start // every)
            loads[first : -(-here.stop // every)] = piece.loads[first * every - here.start :: every]
        give_back((*written, *truth.wheel_angles.values(), truth.reference_position_m))
    for array in written:
        array.flush()
    plain = {
        "manifest": manifest,
        "sources": vibration.named,
        "longest_wave_m": longest_wave_m(vibration),
        "bodies": truth.body_names,
        "bendings": [asdict(bending) for bending in bendings],
        "wheels": model.wheel_names if kept else [],
        "least_share_of_load": dict(zip(model.wheel_names, least.tolist(), strict=True)),
    }
    seal(folder, plain)


def longest_wave_m(vibration: Vibration) -> float:
    """Where the short waves begin, m; 0 without roughness."""
    rough = vibration.rails.roughness
    return 0.0 if rough is None else rough.longest_m


def read_short_waves(folder: Path, rows: int) -> ShortWaves:
    """Read what `write_short_waves` wrote; arrays are mapped.

    Raises
    ------
    DamagedError
        If the folder is incomplete, not what was written, or not of ``rows`` rows.
    OSError
        If it cannot be read.
    """
    plain, _ = read_sealed(folder)
    with damage_told():
        return _short_waves_of(_Header.model_validate(plain), rows, partial(read_array, folder))


class _Header(BaseModel):
    """What a header says beside the arrays."""

    model_config = ConfigDict(extra="forbid")

    manifest: dict[str, Any]
    sources: dict[str, str]
    longest_wave_m: float
    bodies: list[str]
    bendings: list[dict[str, Any]]
    wheels: list[str]
    least_share_of_load: dict[str, float]


def _short_waves_of(header: _Header, rows: int, read: Callable[[str], FloatArray]) -> ShortWaves:
    """The short-wave part of its header and its arrays."""
    motions = {body: read(f"motion_{i}") for i, body in enumerate(header.bodies)}
    for body, motion in motions.items():
        if motion.shape != (rows, len(COLUMNS)):
            shape = (rows, len(COLUMNS))
            raise DamagedError(f"vibration of {body} has shape {motion.shape}, not {shape}")
    bendings = {
        bent["body"]: (Bending(**bent), read(f"bending_{i}")) for i, bent in enumerate(header.bendings)
    }
    loads = read("loads") if header.wheels else np.zeros((0, 0))
    return ShortWaves(
        sources=header.sources,
        longest_wave_m=header.longest_wave_m,
        motions=motions,
        bendings=bendings,
        loads={wheel: loads[:, w] for w, wheel in enumerate(header.wheels)},
        least_share_of_load=header.least_share_of_load,
    )
