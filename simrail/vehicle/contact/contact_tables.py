"""The contact tables of a vehicle: one per static wheel load, all on one grid, each built once.

How far a wheel sinks into its rail, and how softly its contact moves over, depend on its load; an axle
under a heavy engine and one under a light end need different tables. Loads within 2 % share one.

Not here: making one table (`simrail.vehicle.contact.contact_geometry`).
"""

import hashlib
import io
import json
import math
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from simrail.core.jit import FloatArray, cache_folder
from simrail.core.sealed_files import DamagedError, damage_told, read_sealed_file, write_sealed_file
from simrail.core.source_hash import source_hash
from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_geometry import CONST, ContactTable, build_contact
from simrail.vehicle.contact.profile_files import profiles_digest, profiles_of
from simrail.vehicle.model import VehicleModel, WheelRail

FOLDER = "contact_tables"
"""Where tables lie in the cache."""

SAME_LOAD = 0.02
"""Loads that differ by less share a table: it moves the penetration by 1.3 %, one micrometre."""


@dataclass(frozen=True, eq=False)
class WheelContacts:
    """Contact tables of a vehicle.

    Attributes
    ----------
    tables : tuple of ContactTable
        On one grid, by rising load.
    of_wheel : tuple of int
        Which of them each wheel has.
    """

    tables: tuple[ContactTable, ...]
    of_wheel: tuple[int, ...]


def contacts_of(model: VehicleModel, *, gravity_mps2: float = 9.81) -> WheelContacts:
    """Contact tables of a vehicle's wheels at their static loads."""
    loads = model.wheel_load_n(gravity_mps2)
    groups: list[list[int]] = []
    for i in np.argsort(loads, kind="stable"):
        if groups and loads[i] <= (1.0 + SAME_LOAD) * loads[groups[-1][0]]:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    means = [float(np.mean(loads[sorted(group)])) for group in groups]
    pair = model.wheel_rail
    shape = profiles_digest(pair)
    radius = model.wheels[0].radius_m
    tables = tuple(_built(pair, shape, radius, load, means[0]) for load in means)
    of_wheel = {i: k for k, group in enumerate(groups) for i in group}
    return WheelContacts(tables, tuple(of_wheel[i] for i in range(len(loads))))


@lru_cache(maxsize=64)
def _built(
    pair: WheelRail, shape: str, wheel_radius_m: float, load_n: float, grid_load_n: float
) -> ContactTable:
    """One table, from the disk if it was built before.

    ``shape`` is the digest of the profiles: a file that has changed is another key.
    """
    file = cache_folder() / FOLDER / f"{_key(pair, shape, wheel_radius_m, load_n, grid_load_n)}.table"
    table = _read(file)
    if table is None:
        table = build_contact(
            *profiles_of(pair),
            gauge_m=pair.gauge_m,
            rail_inclination=pair.rail_inclination,
            wheel_radius_m=wheel_radius_m,
            tape_circle_half_m=pair.tape_circle_half_m,
            static_load_n=load_n,
            grid_load_n=grid_load_n,
            friction=pair.friction,
            smoothing=pair.smoothing,
            creep_law=pair.creep,
        )
        _write(file, table)
    # Many share it.
    table.coef.flags.writeable = False
    return table


def _key(pair: WheelRail, *rest: object) -> str:
    """All that decides a table, hashed; exact numbers."""
    decides = [
        asdict(pair),
        *rest,
        source_hash("vehicle/contact"),
        *(version(package) for package in ("numpy", "scipy")),
    ]
    return hashlib.sha256(json.dumps(decides, sort_keys=True, default=str).encode()).hexdigest()[:24]


def _read(file: Path) -> ContactTable | None:
    """A table that was written; None where there is none, or it is damaged."""
    try:
        with damage_told(), np.load(io.BytesIO(read_sealed_file(file)), allow_pickle=False) as held:
            split = float(held["split_m"])
            return ContactTable(
                name=str(held["name"]),
                coef=held["coef"],
                const=held["const"].view(CONST)[0],  # aligned, which no file tells and kernels ask for
                static_load_n=float(held["static_load_n"]),
                smoothing_m=float(held["smoothing_m"]),
                split_m=None if math.isnan(split) else split,
            )
    except (OSError, DamagedError):
        return None


def _write(file: Path, table: ContactTable) -> None:
    """Keep a table for other processes; where the disk does not let us, each builds its own."""
    stream = io.BytesIO()
    np.savez(
        stream,
        name=table.name,
        coef=table.coef,
        const=np.array([table.const]),
        static_load_n=table.static_load_n,
        smoothing_m=table.smoothing_m,
        split_m=math.nan if table.split_m is None else table.split_m,
    )
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_sealed_file(file, stream.getvalue())


def rest_drops_m(model: VehicleModel, *, gravity_mps2: float) -> FloatArray:
    """How much lower (negative) each body (b,) stands at rest than the nominal wheel radius says.

    An axle stands as its own tables say, a body above the axles as they do on average.
    """
    if model.wheel_rail.linear is not None:
        return np.zeros(len(model.bodies))
    contacts = contacts_of(model, gravity_mps2=gravity_mps2)
    heights = [static_height(table) for table in contacts.tables]
    axles = {
        axle: float(
            np.mean(
                [heights[k] for k, w in zip(contacts.of_wheel, model.wheels, strict=True) if w.axle == axle]
            )
        )
        for axle in model.axle_names
    }
    above = float(np.mean(list(axles.values())))
    return np.array([axles.get(body.name, above) for body in model.bodies])
