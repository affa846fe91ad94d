"""Judging a ride and its track: does the vehicle stay on it, can the curves hold the speed, is the step safe?

European and urban standards advise on cant deficiency; here a ride above 1.0 m/s2 of uncompensated
lateral acceleration is warned of and one above 1.5 m/s2 is refused. What wheels and rails do to each
other is judged by `simrail.scenario.check_wheels`, the sensors by `simrail.scenario.check_sensors`.
"""

from __future__ import annotations

import numpy as np

from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.scenario.build import Parts, irregularity_of, profile_of
from simrail.scenario.cells import Cell
from simrail.scenario.check_wheels import judge_wheels
from simrail.scenario.scenario import Scenario
from simrail.track.design import TrackDesign
from simrail.track.laid_track import lay
from simrail.vehicle.engines.step_limit import ACCURATE, contact_resonance
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

WARN_LATERAL_MPS2 = 1.0
REFUSE_LATERAL_MPS2 = 1.5
LONGEST_RIDE_S = 7200.0
GRAVITY_MPS2 = 9.81


def judge_ride(scenario: Scenario, cell: Cell, parts: Parts) -> tuple[float, list[str]]:
    """Judge the ride of a cell.

    Parameters
    ----------
    scenario : Scenario
        As read.
    cell : Cell
        Any cell of the ride.
    parts : Parts
        The scenario's parts.

    Returns
    -------
    duration_s : float
        How long the ride takes.
    warnings : list of str
        What is unusual, one line each.

    Raises
    ------
    InputError
        If its track cannot be laid, the vehicle cannot stand on it or leaves it, or the ride is too long,
        too fast for a curve, or too coarse a step for the integrator.
    """
    field, ride = f"ride[{cell.ride_index}]", cell.ride
    track, vehicle = parts.track(cell), parts.vehicle(cell)
    _judge_irregularity(scenario, cell, track)
    with blame(f"vehicle {vehicle.name}", "axle"):
        _judge_loads(vehicle)
    if ride.start_m == ride.end_m:
        raise InputError(
            "the ride ends where it starts",
            file=scenario.file,
            field=f"{field}.end_m",
            value=ride.end_m,
            remedy="end_m > start_m runs forward, end_m < start_m backward",
        )
    _judge_places(scenario, cell, track, vehicle.reach_m)
    judge_wheels(scenario, cell, track, vehicle)
    profile = profile_of(cell)
    with blame(scenario.file, field):
        duration = profile.duration_s
    if not duration <= LONGEST_RIDE_S:
        raise InputError(
            "the ride takes too long",
            file=scenario.file,
            field=f"{field}.speed_kmh",
            value="standing" if ride.speed_kmh is None else f"{ride.speed_kmh:g} km/h, {duration:.0f} s",
            limit=f"{LONGEST_RIDE_S:.0f} s",
            remedy="ride faster, shorter, or with less dwell time",
        )
    warnings = _judge_step(scenario, cell, vehicle)
    if not ride.stands:
        warnings += _judge_dynamics(scenario, cell, track, profile)
    return duration, warnings


def _judge_irregularity(scenario: Scenario, cell: Cell, track: TrackDesign) -> None:
    irregularity = irregularity_of(cell)
    # Laying the track is the judgement: it takes a moment and no rule can be forgotten.
    try:
        lay(track, irregularity, seed=cell.ride_seed)
    except InputError as error:
        if error.file is None:
            error.file = scenario.file
            field = error.field or ""
            error.field = field if field.startswith("irregularity") else f"irregularity.{field}".rstrip(".")
        raise


def _judge_step(scenario: Scenario, cell: Cell, vehicle: VehicleModel) -> list[str]:
    """Refuse a step that the vehicle's wheels on their rails make unstable; warn where it is inaccurate."""
    if cell.spec.engine == "kinematic":
        return []
    step, resonance = cell.spec.step_s, contact_resonance(vehicle, gravity_mps2=GRAVITY_MPS2)
    advised = f"step_s = {resonance.advised_step_s:.8g}"
    frequency = f"{resonance.normal_radps / (2.0 * np.pi):.0f} Hz"
    if step > resonance.longest_step_s:
        raise InputError(
            f"the integrator would be unstable: axles of {vehicle.name} swing on their rails at {frequency}",
            file=scenario.file,
            field="step_s",
            value=step,
            limit=f"{resonance.longest_step_s:.2g} s",
            remedy=f"set {advised}",
        )
    if step * resonance.normal_radps > ACCURATE:
        off = (step * resonance.normal_radps) ** 4 / 1.2
        return [
            f"step_s = {step:g} is long for {vehicle.name}, whose axles swing on their rails at {frequency}: "
            f"it puts that off by {off:.0f} %; {advised} is within 1 %"
        ]
    return []


def _judge_loads(vehicle: VehicleModel) -> None:
    loads = vehicle.wheel_load_n(GRAVITY_MPS2)
    worst = int(np.argmin(loads))
    if loads[worst] <= 0.0:
        raise InputError(
            "a wheel carries nothing at rest",
            field=vehicle.wheel_names[worst],
            value=f"{loads[worst]:.0f} N",
            limit="> 0 N",
            remedy="move the centres of gravity between the axles",
        )


def _judge_places(scenario: Scenario, cell: Cell, track: TrackDesign, ahead: tuple[float, float]) -> None:
    """Refuse a ride whose vehicle would leave the track, or that stops beyond its end."""
    ride = cell.ride
    low, high = track.start_m - ahead[0], track.end_m - ahead[1]
    places = {"start_m": ride.start_m} | ({} if ride.end_m is None else {"end_m": ride.end_m})
    for name, position in places.items():
        if not low <= position <= high:
            raise InputError(
                f"the ride is not on track {track.name!r}",
                file=scenario.file,
                field=f"ride[{cell.ride_index}].{name}",
                value=position,
                limit=f"{low:g} to {high:g} m (the track is {track.start_m:g} to {track.end_m:g} m"
                + (", the axles reach out from the reference point)" if any(ahead) else ")"),
                remedy="shorten the ride or lengthen the track",
            )
    first, last = min(places.values()), max(places.values())
    for i, stop in enumerate(ride.stops):
        if not first < stop.position_m < last:
            raise InputError(
                "the stop is not on the way",
                file=scenario.file,
                field=f"ride[{cell.ride_index}].stops[{i}].position_m",
                value=stop.position_m,
                limit=f"between {first:g} and {last:g} m",
                remedy="move the stop, or let the ride start or end elsewhere",
            )


def _judge_dynamics(scenario: Scenario, cell: Cell, track: TrackDesign, profile: SpeedProfile) -> list[str]:
    """Refuse a speed that a curve cannot hold; warn where it is uncomfortable, or never reached."""
    field, ride = f"ride[{cell.ride_index}]", cell.ride
    assert ride.speed_kmh is not None
    times = np.arange(0.0, profile.duration_s, 0.1)
    s, v, _ = profile.motion(times)
    frame = track.frame(np.clip(s, track.start_m, track.end_m))
    # Specific force across the track, gravity included: V^2 k3 / cos(pitch) + g sin(roll) cos(pitch).
    bend = frame.k[:, 2] / np.cos(frame.pitch_rad)
    from_cant = GRAVITY_MPS2 * np.sin(frame.roll_rad) * np.cos(frame.pitch_rad)
    lateral = np.abs(v**2 * bend + from_cant)
    lateral[np.abs(v) < 0.1 * np.max(np.abs(v))] = 0.0  # standing on cant is no matter of speed
    i = int(np.argmax(lateral))
    where = f"{track.segment_name(int(track.segment(s[i])))} at s = {s[i]:.0f} m"
    if lateral[i] > REFUSE_LATERAL_MPS2:
        relief = -from_cant * np.sign(bend)
        allowed = np.sqrt(np.maximum(REFUSE_LATERAL_MPS2 + relief, 0.0) / np.maximum(np.abs(bend), 1e-12))
        raise InputError(
            f"the track cannot hold this speed: {lateral[i]:.2f} m/s2 uncompensated lateral acceleration "
            f"in {where}",
            file=scenario.file,
            field=f"{field}.speed_kmh",
            value=ride.speed_kmh,
            limit=f"{REFUSE_LATERAL_MPS2:g} m/s2",
            remedy=f"ride at most at {np.floor(3.6 * np.min(allowed)):.0f} km/h, "
            "or use a wider curve or more cant",
        )
    warnings = []
    if lateral[i] > WARN_LATERAL_MPS2:
        warnings.append(
            f"{field} ({ride.name}) at {ride.speed_kmh:g} km/h: {lateral[i]:.2f} m/s2 uncompensated lateral "
            f"acceleration in {where}; above {WARN_LATERAL_MPS2:g} m/s2 is uncomfortable"
        )
    reached = 3.6 * float(np.max(np.abs(v)))
    if reached < 0.99 * ride.speed_kmh:
        warnings.append(
            f"{field} ({ride.name}): reaches {reached:.0f} of {ride.speed_kmh:g} km/h, since the way "
            "between stops is too short for its acceleration and jerk"
        )
    return warnings
