"""Judging sensors: do they fit the vehicle that carries them, the ride and the rate of the truth?

What a sensor may be at all is judged where it is read (`simrail.recording.sheets.imu_file`,
`simrail.scenario.sensor_tables`) and by the sensors themselves.
"""

from __future__ import annotations

from collections.abc import Iterable

from simrail.core.errors import InputError
from simrail.core.toml_files import blame
from simrail.scenario.build import Parts, encoder_of, magnetometer_of, profile_of, rail_sensor_of
from simrail.scenario.cells import Cell
from simrail.scenario.scenario import Scenario
from simrail.sensors.decimation import check_bandwidth, decimation_factor, sampling_of
from simrail.sensors.encoder import check_encoder
from simrail.sensors.magnetometer import check_magnetometer
from simrail.sensors.rail_sensor import check_rail_sensor
from simrail.track.design import TrackDesign
from simrail.vehicle.model import VehicleModel


def judge_sensors(scenario: Scenario, cell: Cell, parts: Parts) -> None:
    """Judge the sensors of a cell.

    Parameters
    ----------
    scenario : Scenario
        As read.
    cell : Cell
        Any draw of the sensors.
    parts : Parts
        The scenario's parts.

    Raises
    ------
    InputError
        If a sensor sits where the vehicle has nothing, would leave the track, samples what the truth does
        not hold, or has no use on this ride.
    """
    vehicle, track = parts.vehicle(cell), parts.track(cell)
    _judge_imu(scenario, cell, parts, track, vehicle)
    magnetometer = magnetometer_of(cell)
    if magnetometer is not None:
        with blame(scenario.file, "magnetometer"):
            check_magnetometer(magnetometer)
    rail_sensor = rail_sensor_of(cell)
    if rail_sensor is not None:
        with blame(scenario.file, "rail_sensor"):
            check_rail_sensor(rail_sensor)
    _judge_encoder(scenario, cell, vehicle)
    parts.odometry(cell)


def _judge_imu(
    scenario: Scenario, cell: Cell, parts: Parts, track: TrackDesign, vehicle: VehicleModel
) -> None:
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


def _judge_encoder(scenario: Scenario, cell: Cell, vehicle: VehicleModel) -> None:
    encoder = encoder_of(cell)
    if encoder is None:
        return
    sides = {name.partition(".")[2] for name in vehicle.wheel_names}
    places = [f"{where}.{side}" for where in ("leading", "trailing") for side in sorted(sides)]
    wheels = [*vehicle.wheel_names, *places]
    _one_of(wheels, encoder.wheel, scenario.file, "encoder.wheel", "the vehicle has no such wheel")
    with blame(scenario.file, "encoder"):
        decimation_factor(cell.spec.truth_rate_hz, encoder.rate_hz)
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
