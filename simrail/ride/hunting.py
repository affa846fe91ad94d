"""What is said of a ride above the speed at which its vehicle begins to hunt."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from simrail.track.laid_track import LaidTrack
from simrail.vehicle.engines.derailment import Derailment
from simrail.vehicle.hunting import conicity_of, hunting_on

if TYPE_CHECKING:
    from simrail.ride.ride import Ride


def hunting_warning(ride: Ride, laid: LaidTrack) -> str:
    """Say that a ride reaches a speed above that at which its vehicle begins to hunt; "" if it does not.

    Parameters
    ----------
    ride : Ride
        The ride.
    laid : LaidTrack
        Its rails.
    """
    if ride.engine == "kinematic":
        return ""
    fastest = float(np.max(np.abs(ride.profile.motion(np.arange(0.0, ride.profile.duration_s, 0.1))[1])))
    found = hunting_on(laid, ride.vehicle, ride.profile, top_mps=fastest, gravity_mps2=ride.gravity_mps2)
    if found is None:
        return ""
    cone = conicity_of(found.model, gravity_mps2=ride.gravity_mps2)
    # Wheels that all turn apart have no conicity to hunt by; what grows is another swing.
    does = "hunts" if ride.vehicle.has_wheelsets else "runs unstably"
    on = "" if cone is None else f" with equivalent conicity {cone:.2f} at 3 mm,"
    gauge_mm = 1e3 * found.model.wheel_rail.gauge_m
    return (
        f"reaches {3.6 * fastest:.0f} km/h: {ride.vehicle.name} {does} above "
        f"{3.6 * found.critical_mps:.0f} km/h on these rails,{on} gauge {gauge_mm:.0f} mm; "
        "what grows there ends at the flanges only"
    )


def with_hunting(derailment: Derailment, ride: Ride, laid: LaidTrack) -> Derailment:
    """A derailment that the rails do not explain, with hunting as its cause where the vehicle does hunt.

    It does if the axle has swung from side to side above the critical speed: a vehicle that is too fast for a
    curve leans on one rail.
    """
    if derailment.from_the_track or not derailment.swung:
        return derailment
    top = abs(derailment.speed_mps)
    found = hunting_on(laid, ride.vehicle, ride.profile, top_mps=top, gravity_mps2=ride.gravity_mps2)
    if found is None:
        return derailment
    # Wheels that all turn apart do not hunt; what grows is another swing.
    swing = "hunting" if found.model.has_wheelsets else "unstable running"
    cause = f"{swing}, above the critical speed of {3.6 * found.critical_mps:.0f} km/h; {derailment.cause}"
    return replace(derailment, cause=cause)
