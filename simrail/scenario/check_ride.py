"""Judging a ride: the vehicle fits and stays on its track, curves hold the speed, and the step is safe.

European and urban standards advise on cant deficiency; here a ride above 1.0 m/s2 of uncompensated
lateral acceleration is warned of and one above 1.5 m/s2 is refused. Sensors are judged by
`simrail.scenario.check_sensors`. Faults name no file: the caller knows the scenario's.
"""

from itertools import pairwise

import numpy as np

from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.ride.hunting import hunting_warning
from simrail.ride.ride import Ride, rails_of
from simrail.ride.vibration.sources import Vibration
from simrail.scenario.build import ResolvedCell
from simrail.scenario.check_vibration import judge_vibration
from simrail.scenario.ride_tables import RidePart
from simrail.scoring.ride_comfort import LEAST_RATE_HZ as COMFORT_HZ
from simrail.scoring.running_safety import LEAST_RATE_HZ as SAFETY_HZ
from simrail.track.design import TrackDesign
from simrail.track.laid_track import LaidTrack
from simrail.track.rail_condition import check_conditions
from simrail.vehicle.engines.step_limit import ACCURATE, contact_resonance
from simrail.vehicle.model import VehicleModel

WARN_LATERAL_MPS2 = 1.0
REFUSE_LATERAL_MPS2 = 1.5
LONGEST_RIDE_S = 7200.0
GRAVITY_MPS2 = 9.81

MOST_BASE_PER_GAUGE = 1.1
"""The middles of the heads of two rails are farther apart than their gauge, by less than a tenth of it."""


def judge_ride(
    resolved: ResolvedCell, *, shaken: set[tuple[int, Vibration]], known_rails: LaidTrack | None = None
) -> tuple[float, list[str], LaidTrack]:
    """Judge the ride of a cell.

    Parameters
    ----------
    resolved : ResolvedCell
        Any cell of the ride.
    shaken : set of (int, Vibration)
        As of `simrail.scenario.check_vibration.judge_vibration`.
    known_rails : LaidTrack, optional
        Its rails, if another ride that has been judged had the same.

    Returns
    -------
    duration_s : float
        How long the ride takes.
    warnings : list of str
        What is unusual, one line each.
    rails : LaidTrack
        Its rails.

    Raises
    ------
    InputError
        If its track cannot be laid, the vehicle cannot stand on it or leaves it, or the ride is too long,
        too fast for a curve, or too coarse a step for the integrator.
    """
    words, vehicle = resolved.cell.ride, resolved.ride.vehicle
    if resolved.ride.engine == "kinematic" and resolved.cell.spec.vehicle_factors is not None:
        raise InputError(
            "a body that follows the rails exactly has neither weight nor springs",
            field="vehicle_factors",
            value=resolved.ride.engine,
            limit="the compiled or the exudyn engine",
            remedy='set engine = "compiled", or leave them out',
        )
    with blame(None, f"ride[{resolved.cell.ride_index}]"):
        for i, (begin, end) in enumerate(pairwise((words.start_m, *words.ends_m))):
            if begin == end:
                raise InputError(
                    f"the {'run' if words.runs else 'ride'} ends where it starts",
                    field=f"runs[{i}].end_m" if words.runs else "end_m",
                    value=end,
                    remedy="end_m > start_m runs forward, end_m < start_m backward",
                    limit="another place than start_m",
                )
        low, high = words.reach_m
        _judge_restrictions(words)
        if words.kick_end_m is not None and not low <= words.kick_end_m < high:
            raise InputError(
                "the ride does not pass the end of the kick",
                field="kick_end_m",
                value=words.kick_end_m,
                limit=f"{low:g} to {high:g} m",
                remedy="move it between start_m and end_m",
            )
    with blame(f"vehicle {vehicle.name}", "axle"):
        _judge_loads(vehicle)
    _judge_places(resolved)
    _judge_wheels(resolved)
    laid = known_rails or _judge_rails(resolved)
    with blame(None, f"ride[{resolved.cell.ride_index}]"):
        duration = resolved.ride.profile.duration_s
        if not duration <= LONGEST_RIDE_S:
            raise InputError(
                "the ride takes too long",
                field="speed_kmh",
                value="standing" if words.stands else f"{words.speed_kmh:g} km/h, {duration:.0f} s",
                limit=f"{LONGEST_RIDE_S:.0f} s",
                remedy="ride faster, shorter, or with less dwell time",
            )
    _judge_contact_rate(resolved.ride)
    _judge_ride_figures(resolved)
    warnings = _judge_step(resolved) + judge_vibration(resolved.ride, shaken)
    if not words.stands:
        warnings += _judge_dynamics(resolved) + _judge_hunting(resolved, laid)
    return duration, warnings, laid


def _judge_rails(resolved: ResolvedCell) -> LaidTrack:
    """Refuse irregularities that cannot be, and conditions off the track or without sense; lay the rails."""
    ride = resolved.ride
    check_conditions(ride.conditions, ride.track.start_m, ride.track.end_m)
    try:
        return rails_of(ride)  # laying them is the judgement: it takes a moment and no rule can be forgotten
    except InputError as error:
        if error.file is None and not (error.field or "").startswith("irregularity"):
            error.field = f"irregularity.{error.field or ''}".rstrip(".")
        raise


def _judge_step(resolved: ResolvedCell) -> list[str]:
    """Refuse a step that the vehicle's wheels on their rails make unstable; warn where it is inaccurate."""
    vehicle, step = resolved.ride.vehicle, resolved.ride.step_s
    if resolved.ride.engine == "kinematic":
        return []
    interval = 1.0 / resolved.ride.rate_hz
    steps = interval / step
    if abs(steps - round(steps)) > 1e-6:
        raise InputError(
            "does not divide the output interval of the truth",
            field="step_s",
            value=step,
            limit=f"{interval:g} s over a whole number",
            remedy=f"set step_s = {interval / max(round(steps), 1):g}, or a lower truth_rate_hz",
        )
    resonance = contact_resonance(vehicle, gravity_mps2=GRAVITY_MPS2)
    advised = f"step_s = {resonance.advised_step_s:.8g}"
    frequency = f"{resonance.normal_radps / (2.0 * np.pi):.0f} Hz"
    if step > resonance.longest_step_s:
        raise InputError(
            f"the integrator would be unstable: axles of {vehicle.name} swing on their rails at {frequency}",
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


def _judge_contact_rate(ride: Ride) -> None:
    """Refuse to keep forces that there are none of, or at a rate that is none of the truth's."""
    if ride.contact_rate_hz == 0.0:
        return
    if ride.engine == "kinematic":
        raise InputError(
            "a body that follows the rails has no forces to keep",
            field="contact_rate_hz",
            value=ride.contact_rate_hz,
            limit="0 with engine kinematic",
            remedy="remove it, or choose the engine compiled or exudyn",
        )
    ratio = ride.rate_hz / ride.contact_rate_hz
    if ratio < 1.0 or abs(ratio - round(ratio)) > 1e-9:
        raise InputError(
            "is not the rate of the truth over a whole number",
            field="contact_rate_hz",
            value=ride.contact_rate_hz,
            limit=f"truth_rate_hz = {ride.rate_hz:g} Hz divided by a whole number",
            remedy=f"try {ride.rate_hz / max(round(ratio), 1):.12g}",
        )


def _judge_ride_figures(resolved: ResolvedCell) -> None:
    """Refuse figures of the ride that its rates are too low for."""
    ride, spec = resolved.ride, resolved.cell.spec
    asked = {"running_safety": spec.running_safety, "ride_comfort": spec.ride_comfort}
    rates = {
        "running_safety": ("contact_rate_hz", ride.contact_rate_hz, SAFETY_HZ),
        "ride_comfort": ("truth_rate_hz", ride.rate_hz, COMFORT_HZ),
    }
    for table, (field, rate_hz, least_hz) in rates.items():
        if asked[table] is not None and rate_hz < least_hz:
            raise InputError(
                f"is too low for [{table}]",
                field=field,
                value=rate_hz,
                limit=f">= {least_hz:g} Hz",
                remedy=f"raise it, or take [{table}] out",
            )


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


def _judge_places(resolved: ResolvedCell) -> None:
    """Refuse a ride whose vehicle would leave the track, or that stops beyond its end."""
    words, track, ahead = resolved.cell.ride, resolved.ride.track, resolved.ride.vehicle.reach_m
    field = f"ride[{resolved.cell.ride_index}]"
    low, high = track.start_m - ahead[0], track.end_m - ahead[1]
    places = {"start_m": words.start_m}
    for i, end in enumerate(words.ends_m):
        places[f"runs[{i}].end_m" if words.runs else "end_m"] = end
    for name, position in places.items():
        if not low <= position <= high:
            raise InputError(
                f"the ride is not on track {track.name!r}",
                field=f"{field}.{name}",
                value=position,
                limit=f"{low:g} to {high:g} m (the track is {track.start_m:g} to {track.end_m:g} m"
                + (", the axles reach out from the reference point)" if any(ahead) else ")"),
                remedy="shorten the ride or lengthen the track",
            )
    first, last = words.reach_m
    measured = resolved.ride.irregularity.measured
    if measured is not None:
        with blame(None, "irregularity"):
            measured.check_covers(first + ahead[0], last + ahead[1])
    for i, stop in enumerate(words.stops):
        if words.runs and any(stop.position_m == other.position_m for other in words.stops[:i]):
            raise InputError(
                "every run stops there already",
                field=f"{field}.stops[{i}].position_m",
                value=stop.position_m,
                remedy="list each stop of the line once; every run that passes makes it",
                limit="each place once",
            )
        if not first < stop.position_m < last:
            raise InputError(
                "the stop is not on the way",
                field=f"{field}.stops[{i}].position_m",
                value=stop.position_m,
                limit=f"between {first:g} and {last:g} m",
                remedy="move the stop, or let the ride start or end elsewhere",
            )


def _judge_restrictions(words: RidePart) -> None:
    """Refuse a restriction that the ride does not meet."""
    low, high = words.reach_m
    for i, part in enumerate(words.restriction):
        if part.end_m <= low or part.start_m >= high:
            raise InputError(
                "the ride does not pass this restriction",
                field=f"restriction[{i}].start_m",
                value=part.start_m,
                limit=f"between {low:g} and {high:g} m",
                remedy="move it, or take it out",
            )


def _judge_dynamics(resolved: ResolvedCell) -> list[str]:
    """Refuse a speed that a curve cannot hold; warn where it is uncomfortable, or never reached."""
    field, words = f"ride[{resolved.cell.ride_index}]", resolved.cell.ride
    track, profile = resolved.ride.track, resolved.ride.profile
    assert words.speed_kmh is not None
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
            field=f"{field}.speed_kmh",
            value=words.speed_kmh,
            limit=f"{REFUSE_LATERAL_MPS2:g} m/s2",
            remedy=f"ride at most at {np.floor(3.6 * np.min(allowed)):.0f} km/h, "
            "or use a wider curve or more cant",
        )
    warnings = []
    if lateral[i] > WARN_LATERAL_MPS2:
        warnings.append(
            f"{field} ({words.name}) at {words.speed_kmh:g} km/h: {lateral[i]:.2f} m/s2 uncompensated "
            f"lateral acceleration in {where}; above {WARN_LATERAL_MPS2:g} m/s2 is uncomfortable"
        )
    reached = 3.6 * float(np.max(np.abs(v)))
    if reached < 0.99 * words.speed_kmh:
        warnings.append(
            f"{field} ({words.name}): reaches {reached:.0f} of {words.speed_kmh:g} km/h, since the way "
            "between stops is too short for its acceleration and jerk"
        )
    return warnings


def _judge_hunting(resolved: ResolvedCell, laid: LaidTrack) -> list[str]:
    """Warn of a speed above that at which the vehicle begins to hunt on these rails."""
    warning = hunting_warning(resolved.ride, laid)
    cell = resolved.cell
    return [f"ride[{cell.ride_index}] ({cell.ride.name}) {warning}"] if warning else []


def _judge_wheels(resolved: ResolvedCell) -> None:
    """Refuse wheels beside the rails, that cannot drive, or that feel no friction where it is asked for."""
    ride, vehicle = resolved.ride, resolved.ride.vehicle
    _judge_gauge(ride.track, vehicle)
    followed = ride.engine == "kinematic"
    if ride.drive == "wheels" and (followed or vehicle.traction is None):
        raise InputError(
            "the wheels cannot drive: " + ("the engine has no forces" if followed else "no [traction]"),
            field=f"ride[{resolved.cell.ride_index}].drive",
            value="wheels",
            limit="engine compiled or exudyn" if followed else f"a vehicle with traction, not {vehicle.name}",
            remedy='choose such an engine, or drive = "guide"'
            if followed
            else 'give the vehicle file a [traction], or drive = "guide"',
        )
    if followed and ride.conditions:
        raise InputError(
            "a body that follows the rails does not feel their friction",
            field="rail_condition",
            value="engine kinematic",
            limit="engine compiled or exudyn",
            remedy="choose such an engine, or remove the rail conditions",
        )


def _judge_gauge(track: TrackDesign, vehicle: VehicleModel) -> None:
    """Refuse a vehicle of another gauge: what a rail is off would not turn it as it turns the track."""
    low, high = vehicle.wheel_rail.gauge_m, MOST_BASE_PER_GAUGE * vehicle.wheel_rail.gauge_m
    if not low < track.rail_base_m < high:
        raise InputError(
            f"vehicle {vehicle.name!r} does not fit track {track.name!r}: the running tables of its gauge of "
            f"{1e3 * vehicle.wheel_rail.gauge_m:g} mm are not as far apart as the track's",
            field="vehicle",
            value=f"rail_base_mm = {1e3 * track.rail_base_m:g} in the track file",
            limit=f"{1e3 * low:g} to {1e3 * high:g} mm",
            remedy="choose a vehicle of the track's gauge, or correct the track's rail_base_mm",
        )
