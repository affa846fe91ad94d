"""Judging a scenario without running it: do track, vehicle, rides, sensors and estimators fit?

`judge_scenario` refuses what cannot be run, or would mean nothing, with one `InputError`; and
returns a `Plan` that says what will be run, with warnings. European and urban standards advise on
cant deficiency; here a ride above 1.0 m/s2 of uncompensated lateral acceleration is warned of and one
above 1.5 m/s2 is refused.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simrail.errors import InputError
from simrail.estimate import Estimator
from simrail.profile import SpeedProfile
from simrail.scenario.build import (
    Parts,
    encoder_of,
    estimator_of,
    irregularity_of,
    magnetometer_of,
    profile_of,
)
from simrail.scenario.cells import Cell, cells, count, methods
from simrail.scenario.check_wheels import judge_wheels
from simrail.scenario.files import blame
from simrail.scenario.scenario import Scenario
from simrail.score_table import CURVE_PREFIX, METRICS, WINDOWS
from simrail.sensors.decimation import check_bandwidth, decimation_factor, sampling_of
from simrail.sensors.encoder import check_encoder
from simrail.sensors.magnetometer import check_magnetometer
from simrail.track.design import TrackDesign
from simrail.track.laid import lay
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.step_limit import ACCURATE, contact_resonance

WARN_LATERAL_MPS2 = 1.0
REFUSE_LATERAL_MPS2 = 1.5
LONGEST_RIDE_S = 7200.0
MOST_CELLS = 1_000_000
GRAVITY_MPS2 = 9.81


@dataclass(frozen=True)
class Plan:
    """What a scenario that has been judged will run.

    Attributes
    ----------
    rides, cells : int
        Numbers of rides to simulate (cached ones among them) and of recordings to estimate from.
    simulated_s : float
        Simulated time of all rides together.
    estimators : dict of str to Estimator
        By their names in the tables.
    warnings : tuple of str
        What is unusual, one line each.
    content_hash : str
        Hash of the scenario and of the parts that it names.
    """

    rides: int
    cells: int
    simulated_s: float
    estimators: dict[str, Estimator]
    warnings: tuple[str, ...]
    content_hash: str


def judge_scenario(scenario: Scenario, parts: Parts | None = None) -> Plan:
    """Judge everything about a scenario that can be judged without running it.

    Parameters
    ----------
    scenario : Scenario
        As read.
    parts : Parts, optional
        Its parts, to share what is read.

    Raises
    ------
    InputError
        At the first fault, naming file, field, value, limit and remedy.
    """
    parts = parts or Parts(scenario)
    rides, total = count(scenario)
    if total > MOST_CELLS:
        raise InputError(
            "has too many cells",
            file=scenario.file,
            value=total,
            limit=f"{MOST_CELLS}",
            remedy="shorten a list or take fewer draws",
        )
    _judge_score(scenario)
    estimators = _judge_estimators(scenario)
    warnings: dict[str, None] = {}
    simulated = 0.0
    judged_rides: set[tuple[str, ...]] = set()
    judged_sensors: set[tuple[str, ...]] = set()
    for cell in cells(scenario):
        if cell.track_draw or cell.sensor_draw:
            continue
        ride_key = (
            cell.spec.track,
            cell.spec.vehicle,
            cell.spec.engine,
            repr(cell.spec.truth_rate_hz),
            repr(cell.ride),
        )
        sensor_key = (
            cell.spec.vehicle,
            cell.spec.engine,
            repr(cell.imu),
            *map(repr, (cell.spec.encoder, cell.spec.magnetometer)),
        )
        if (*ride_key, repr(cell.spec.irregularity), repr(cell.spec.step_s)) not in judged_rides:
            judged_rides.add((*ride_key, repr(cell.spec.irregularity), repr(cell.spec.step_s)))
            _judge_irregularity(scenario, cell, parts.track(cell))
            duration, found = _judge_ride(scenario, cell, parts)
            warnings.update(dict.fromkeys(found))
            simulated += duration * scenario.spec.track_draws
        if (*sensor_key, cell.spec.odometry, *ride_key) not in judged_sensors:
            judged_sensors.add((*sensor_key, cell.spec.odometry, *ride_key))
            _judge_sensors(scenario, cell, parts)
    return Plan(rides, total, simulated, estimators, tuple(warnings), parts.hash)


def _judge_score(scenario: Scenario) -> None:
    score = scenario.spec.score
    for field, words, known in (
        ("windows", score.windows, (*WINDOWS, CURVE_PREFIX + "*")),
        ("metrics", score.metrics, METRICS),
    ):
        for i, word in enumerate(words or ()):
            of_one_curve = field == "windows" and word.startswith(CURVE_PREFIX)
            if word not in known and not of_one_curve:
                raise InputError(
                    f"is not one of the {field}",
                    file=scenario.file,
                    field=f"score.{field}[{i}]",
                    value=word,
                    limit="one of " + ", ".join(known),
                )


def _judge_estimators(scenario: Scenario) -> dict[str, Estimator]:
    made: dict[str, Estimator] = {}
    for method in methods(scenario):
        if method.name in made:
            raise InputError(
                "two estimators have this name",
                file=scenario.file,
                field=f"estimator[{method.index}].name",
                value=method.name,
                remedy="give each a name of its own",
            )
        made[method.name] = estimator_of(scenario, method)
    return made


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


def _judge_ride(scenario: Scenario, cell: Cell, parts: Parts) -> tuple[float, list[str]]:
    """Duration of a ride, and warnings."""
    field, ride = f"ride[{cell.ride_index}]", cell.ride
    track, vehicle = parts.track(cell), parts.vehicle(cell)
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


def _judge_sensors(scenario: Scenario, cell: Cell, parts: Parts) -> None:
    vehicle, track = parts.vehicle(cell), parts.track(cell)
    field = f"imu[{cell.imu_index}]"
    _one_of(vehicle.body_names, cell.imu.body, scenario.file, f"{field}.body", "the vehicle has no such body")
    offset = cell.imu.position_m[0] + vehicle.body(cell.imu.body).position_m[0]
    ends = {"start_m": cell.ride.start_m, "end_m": cell.ride.end_m}
    for name, position in ends.items():
        if position is None:
            continue
        if not track.start_m <= position + offset <= track.end_m:
            raise InputError(
                f"the IMU would leave track {track.name!r} at the {name.removesuffix('_m')} "
                f"of ride {cell.ride.name}",
                file=scenario.file,
                field=f"{field}.position_m",
                value=f"s = {position + offset:g} m",
                limit=f"{track.start_m:g} to {track.end_m:g} m",
                remedy="shorten the ride or lengthen the track",
            )
    grade = parts.grade(cell)
    truth_rate = cell.spec.truth_rate_hz
    with blame(scenario.file, f"{field}.grade"):
        sampling_of(truth_rate, grade.rate_hz, grade.oversampling)
        if grade.bandwidth_hz is not None:
            check_bandwidth(grade.bandwidth_hz, truth_rate)
    magnetometer = magnetometer_of(cell)
    if magnetometer is not None:
        with blame(scenario.file, "magnetometer"):
            check_magnetometer(magnetometer)
    encoder = encoder_of(cell)
    if encoder is None:
        if cell.spec.odometry != "truth":
            raise InputError(
                "the odometry needs an encoder",
                file=scenario.file,
                field="odometry",
                value=cell.spec.odometry,
                remedy='add an [encoder], or set odometry = "truth" for an ablation',
            )
        return
    sides = {name.partition(".")[2] for name in vehicle.wheel_names}
    places = [f"{where}.{side}" for where in ("leading", "trailing") for side in sorted(sides)]
    wheels = [*vehicle.wheel_names, *places]
    _one_of(wheels, encoder.wheel, scenario.file, "encoder.wheel", "the vehicle has no such wheel")
    with blame(scenario.file, "encoder"):
        decimation_factor(truth_rate, encoder.rate_hz)
        check_encoder(encoder)
    duration = profile_of(cell).duration_s
    for i, event in enumerate(encoder.slip):
        if event.start_s >= duration:
            raise InputError(
                f"the slip begins after the end of ride {cell.ride.name}",
                file=scenario.file,
                field=f"encoder.slip[{i}].start_s",
                value=event.start_s,
                limit=f"< {duration:.1f} s",
                remedy="let it begin earlier, or put the ride into a scenario of its own",
            )
    if cell.ride.stands and encoder.radius == "calibrated":
        raise InputError(
            "no wheel can be calibrated at a standstill",
            file=scenario.file,
            field="encoder.radius",
            value=encoder.radius,
            remedy='set radius = "drawing", or let the ride move',
        )


def _one_of(known: Iterable[str], name: str, file: str, field: str, problem: str) -> None:
    if name not in known:
        raise InputError(
            problem,
            file=file,
            field=field,
            value=name,
            limit="one of " + ", ".join(known),
            remedy="choose one of them",
        )
