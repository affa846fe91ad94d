"""Judging what shakes a ride: rates, speeds and bands fit each other, and short waves meet the long ones.

Faults name no file: the caller knows the scenario's.
"""

import numpy as np

from simrail.core.errors import InputError
from simrail.ride.ride import Ride
from simrail.ride.vibration.floor import noise_bands
from simrail.ride.vibration.run import linear_vehicle_of
from simrail.ride.vibration.sources import Vibration
from simrail.track.join import step_db
from simrail.vehicle.vibration.modal import modes_of

LEAST_RATE_HZ = 250.0
"""Lowest rate of a truth with vibration: below, little of it is left."""
LARGE_STEP_DB = 3.0
"""A larger step between roughness and spectrum, twice the power, is warned of."""
_HELD = 0.45
"""Highest frequency of noise over the rate that holds it."""


def judge_vibration(ride: Ride, shaken: set[tuple[int, Vibration]]) -> list[str]:
    """Refuse a vibration that cannot be worked out; warn of short and long waves that do not meet.

    Parameters
    ----------
    ride : Ride
        The ride.
    shaken : set of (int, Vibration)
        Vehicles, by identity, and what shakes them, of which it is known that it can be; this one is added.

    Raises
    ------
    InputError
        If rates do not fit, noise lies beyond the rate of the truth, waves pass faster than the rate holds,
        or the vehicle has no linear model.
    """
    vibration = ride.vibration
    if vibration is None:
        return []
    _judge_rates(ride, vibration)
    _judge_waves(ride, vibration)
    if (id(ride.vehicle), vibration) not in shaken:
        modes_of(
            linear_vehicle_of(vibration, ride.vehicle, gravity_mps2=ride.gravity_mps2),
            step_s=1.0 / vibration.rate_hz,
        )
        shaken.add((id(ride.vehicle), vibration))
    return _unusual(ride, vibration)


def step_words(ride: Ride) -> str:
    """How far the roughness lies above or below the spectrum where they meet; "" where they do not."""
    step, rough = _step(ride), ride.vibration and ride.vibration.rails.roughness
    if step is None or not rough:
        return ""
    return (
        f"at {rough.longest_m:.3g} m the roughness lies {abs(step):.1f} dB "
        f"{'above' if step >= 0.0 else 'below'} the spectrum {ride.irregularity.spectrum} of the rails"
    )


def _step(ride: Ride) -> float | None:
    rough = ride.vibration and ride.vibration.rails.roughness
    return step_db(ride.irregularity, rough.table, offset_db=rough.offset_db) if rough else None


def _judge_rates(ride: Ride, vibration: Vibration) -> None:
    ratio = vibration.rate_hz / ride.rate_hz
    if ride.rate_hz < LEAST_RATE_HZ:
        raise InputError(
            "is too low for a ride that shakes",
            field="truth_rate_hz",
            value=ride.rate_hz,
            limit=f">= {LEAST_RATE_HZ:g} Hz with [vibration]",
            remedy="set truth_rate_hz = 1000.0, or vibration.off = true",
        )
    if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
        raise InputError(
            "is no multiple of the rate of the truth",
            field="vibration.rate_hz",
            value=vibration.rate_hz,
            limit=f"a whole multiple of truth_rate_hz = {ride.rate_hz:g} Hz",
            remedy=f"try {ride.rate_hz * max(round(ratio), 1):g}",
        )
    for name, (_, high) in noise_bands(vibration):
        if high > _HELD * ride.rate_hz:
            raise InputError(
                "lies beyond what the rate of the truth holds",
                field=f"vibration.{name}",
                value=f"{high:g} Hz",
                limit=f"{_HELD * ride.rate_hz:g} Hz at truth_rate_hz = {ride.rate_hz:g}",
                remedy="lower it, or raise truth_rate_hz",
            )


def _judge_waves(ride: Ride, vibration: Vibration) -> None:
    """Refuse waves that pass faster than twice in three samples: they would come back as longer ones."""
    time: np.ndarray = np.arange(0.0, ride.profile.duration_s + 0.1, 0.1)
    fastest = float(np.max(np.abs(ride.profile.motion(time)[1])))
    rails = vibration.rails
    shortest = {
        "roughness.shortest_m": rails.roughness and rails.roughness.shortest_m,
        "corrugation.wavelength_m": rails.corrugation and rails.corrugation.wavelength_m,
    }
    for field, wave in shortest.items():
        if wave and fastest / wave > _HELD * vibration.rate_hz:
            raise InputError(
                "passes too fast for the rate of the vibration",
                field=f"vibration.{field}",
                value=f"{wave:g} m, {fastest / wave:.0f} Hz at {3.6 * fastest:.0f} km/h",
                limit=f"{_HELD * vibration.rate_hz:g} Hz at vibration.rate_hz = {vibration.rate_hz:g}",
                remedy=f"set vibration.rate_hz = {2.0 * vibration.rate_hz:g}, or longer waves",
            )


def _unusual(ride: Ride, vibration: Vibration) -> list[str]:
    rough, step = vibration.rails.roughness, _step(ride)
    if rough is None or step is None:
        return []
    words = []
    if abs(step) > LARGE_STEP_DB:
        words.append(f"vibration: {step_words(ride)}; vibration.join = true scales the roughness to meet it")
    shortest = ride.irregularity.wavelengths_m[0]
    if shortest > 1.001 * rough.longest_m:
        words.append(
            f"vibration: no waves between {rough.longest_m:.3g} m, where the roughness table ends, and "
            f"{shortest:g} m, where the spectrum begins"
        )
    return words
