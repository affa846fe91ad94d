"""Whether a vehicle hunts below a speed, on rails of a certain gauge: a quick answer, kept on disk.

The whole search is in `simrail.vehicle.stability`; here running is linearised at a few speeds only. Above
the critical speed a smallest disturbance grows until flanges limit it: what a ride then shows is decided by
them, and by how the linear contact ends.
"""

import hashlib
import json
from contextlib import suppress
from dataclasses import asdict, replace
from typing import Any, NamedTuple

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import cache_folder
from simrail.core.sealed_files import DamagedError, damage_told, read_sealed_file, write_sealed_file
from simrail.core.source_hash import source_hash
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.profile_files import profiles_digest
from simrail.vehicle.contact.wheelset import conicity
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile
from simrail.vehicle.stability import first_crossing
from simrail.vehicle.study import AMPLITUDE_M

SLOWEST_MPS = 2.0
SHARES = (0.5, 0.75, 1.0)
"""Of the top speed: where running is linearised. What grows between two of them only is missed."""
ACCURACY_MPS = 0.05
WORTH_M = 1e-3
"""A gauge that is off by less is that of the vehicle's file."""


class Hunting(NamedTuple):
    """A vehicle that hunts on the rails of a ride.

    Attributes
    ----------
    model : VehicleModel
        The vehicle on their mean gauge.
    critical_mps : float
        Speed above which it hunts there.
    """

    model: VehicleModel
    critical_mps: float


def hunting_on(
    laid: LaidTrack, model: VehicleModel, profile: SpeedProfile, *, top_mps: float, gravity_mps2: float
) -> Hunting | None:
    """Whether a vehicle hunts below a speed on the rails of a ride; None if it does not.

    Parameters
    ----------
    laid : LaidTrack
        The rails.
    model : VehicleModel
        The vehicle, on the gauge of its file.
    profile : SpeedProfile
        Where it runs: over that way the gauge is averaged.
    top_mps : float
        Speed up to which it matters.
    gravity_mps2 : float
        Gravity.
    """
    here = on_gauge(model, mean_widening_m(laid, profile))
    critical = critical_below(here, top_mps, gravity_mps2=gravity_mps2)
    return None if critical is None else Hunting(here, critical)


def on_gauge(model: VehicleModel, wider_m: float) -> VehicleModel:
    """A vehicle on rails whose gauge is on average wider by so much, in whole millimetres."""
    steps = round(wider_m / WORTH_M)
    if steps == 0:
        return model
    pair = model.wheel_rail
    return replace(model, wheel_rail=replace(pair, gauge_m=pair.gauge_m + steps * WORTH_M))


def mean_widening_m(laid: LaidTrack, profile: SpeedProfile) -> float:
    """How much wider than designed the gauge of laid rails is, on average over a ride."""
    low, high = profile.reach_m
    y_left, _, y_right, _ = laid.rails(np.arange(low, high + 1.0)).T
    return float(np.mean(y_left - y_right))


def critical_below(model: VehicleModel, top_mps: float, *, gravity_mps2: float = 9.81) -> float | None:
    """Critical speed of a vehicle if it is below a speed.

    Parameters
    ----------
    model : VehicleModel
        The vehicle, on the gauge of its file (`on_gauge`).
    top_mps : float
        Speed up to which it matters.
    gravity_mps2 : float
        Gravity.

    Returns
    -------
    float or None
        To 0.05 m/s; None if no oscillation grows at the speeds tried, or the vehicle has no steady running.
    """
    file = cache_folder() / "critical_speeds" / f"{_key(model, gravity_mps2)}.sealed"
    known: dict[str, Any] = {"stable_mps": 0.0, "critical_mps": None}
    with suppress(OSError, DamagedError), damage_told():
        known |= json.loads(read_sealed_file(file))
    if known["critical_mps"] is None and known["stable_mps"] < top_mps:
        critical = _search(model, float(known["stable_mps"]), top_mps, gravity_mps2)
        known = {"stable_mps": top_mps, "critical_mps": critical}
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            write_sealed_file(file, json.dumps(known).encode())
    found: float | None = known["critical_mps"]
    return found if found is not None and found < top_mps else None


def conicity_of(model: VehicleModel, *, gravity_mps2: float = 9.81) -> float | None:
    """Equivalent conicity at 3 mm; None where the wheels turn apart or the contact is prescribed."""
    if not model.has_wheelsets or model.wheel_rail.linear is not None:
        return None
    value = conicity(contacts_of(model, gravity_mps2=gravity_mps2).tables[0], AMPLITUDE_M)
    return value if np.isfinite(value) else None


def _search(model: VehicleModel, stable_mps: float, top_mps: float, gravity_mps2: float) -> float | None:
    """Critical speed up to a top speed, if running is stable up to another."""
    slowest = max(stable_mps, min(SLOWEST_MPS, 0.25 * top_mps))
    speeds = np.array([slowest, *(share * top_mps for share in SHARES if share * top_mps > slowest)])
    try:
        vehicle = running_vehicle(model, gravity_mps2=gravity_mps2)
        return first_crossing(
            lambda v: np.linalg.eigvals(vehicle.linearised(v)).astype(complex),
            speeds,
            accuracy_mps=ACCURACY_MPS,
        ).speed_mps
    except InputError:  # no steady running, or wheels that do not fit between these rails
        return None


def _key(model: VehicleModel, gravity_mps2: float) -> str:
    """All that decides the answer, hashed."""
    decides = {
        "vehicle": asdict(model),
        "profiles": profiles_digest(model.wheel_rail),
        "gravity_mps2": gravity_mps2,
        "sources": source_hash("vehicle", "track", "core/rotation.py"),
    }
    text = json.dumps(decides, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]
