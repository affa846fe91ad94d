"""Judging sensors: they fit the vehicle that carries them, the ride and the rate of the truth.

What a sensor may be at all is judged where it is read (`simrail.recording.sheets.imu_file`,
`simrail.scenario.sensor_tables`) and by the sensors themselves. Faults name no file: the caller knows the
scenario's.
"""

from simrail.core.errors import InputError, one_of
from simrail.core.toml_files import blame
from simrail.recording.check_form import check_pair
from simrail.ride.truth import Mount
from simrail.scenario.build import ResolvedCell
from simrail.sensors.decimation import check_bandwidth, decimation_factor, sampling_of
from simrail.sensors.encoder import check_encoder
from simrail.sensors.gnss import check_gnss
from simrail.sensors.magnetometer import check_magnetometer
from simrail.sensors.rail_sensor import check_rail_sensor


def judge_sensors(resolved: ResolvedCell) -> None:
    """Judge the sensors of a cell.

    Parameters
    ----------
    resolved : ResolvedCell
        Any draw of the sensors.

    Raises
    ------
    InputError
        If a sensor sits where the vehicle has nothing, would leave the track, samples what the truth does
        not hold, or has no use on this ride.
    """
    _judge_imu(resolved)
    _judge_second_imu(resolved)
    if resolved.magnetometer is not None:
        with blame(None, "magnetometer"):
            check_magnetometer(resolved.magnetometer)
    if resolved.rail_sensor is not None:
        with blame(None, "rail_sensor"):
            check_rail_sensor(resolved.rail_sensor)
    if resolved.gnss is not None:
        with blame(None, "gnss"):
            check_gnss(resolved.gnss)
    _judge_encoder(resolved)


def _judge_imu(resolved: ResolvedCell) -> None:
    cell, mount, grade = resolved.cell, resolved.mount, resolved.grade
    track, vehicle, truth_rate = resolved.ride.track, resolved.ride.vehicle, resolved.ride.rate_hz
    field = f"imu[{cell.imu_index}]"
    one_of(mount.body, vehicle.body_names, "the vehicle has no such body", field=f"{field}.body")
    offset = mount.position_m[0] + vehicle.body(mount.body).position_m[0]
    ends = {"start": cell.ride.start_m} | {
        f"end of run {i + 1}": end for i, end in enumerate(cell.ride.ends_m)
    }
    if not cell.ride.runs and not cell.ride.stands:
        ends = {"start": cell.ride.start_m, "end": cell.ride.ends_m[0]}
    for name, position in ends.items():
        if not track.start_m <= position + offset <= track.end_m:
            raise InputError(
                f"the IMU would leave track {track.name!r} at the {name} of ride {cell.ride.name}",
                field=f"{field}.position_m",
                value=f"s = {position + offset:g} m",
                limit=f"{track.start_m:g} to {track.end_m:g} m",
                remedy="shorten the ride or lengthen the track",
            )
    with blame(None, f"{field}.grade"):
        sampling_of(truth_rate, grade.rate_hz, grade.oversampling)
        for kind in ("gyro", "accel"):
            bandwidth = grade.bandwidth_of(kind)
            if bandwidth is not None:
                check_bandwidth(bandwidth, truth_rate)


def _judge_second_imu(resolved: ResolvedCell) -> None:
    """It is another IMU than the first, on the vehicle, far enough from it, and of its rate."""
    second, vehicle = resolved.second_imu, resolved.ride.vehicle
    if second is None:
        return
    names = vehicle.body_names
    one_of(second.mount.body, names, "the vehicle has no such body", field="second_imu.body")
    if second.mount.name == resolved.mount.name:
        raise InputError(
            "is the name of an [[imu]] that it is recorded with",
            field="second_imu.name",
            value=second.mount.name,
            limit="another name than that of the [[imu]]",
            remedy="give it a name of its own: by its name its noise is drawn",
        )
    check_pair(
        resolved.grade.rate_hz,
        second.grade.rate_hz,
        _along(resolved, resolved.mount) - _along(resolved, second.mount),
    )
    with blame(None, "second_imu.grade"):
        sampling_of(resolved.ride.rate_hz, second.grade.rate_hz, second.grade.oversampling)
        if second.grade.bandwidth_hz is not None:
            check_bandwidth(second.grade.bandwidth_hz, resolved.ride.rate_hz)


def _along(resolved: ResolvedCell, mount: Mount) -> float:
    """Where a mount is along the vehicle, m."""
    return float(mount.position_m[0] + resolved.ride.vehicle.body(mount.body).position_m[0])


def _judge_encoder(resolved: ResolvedCell) -> None:
    cell, encoder, vehicle = resolved.cell, resolved.encoder, resolved.ride.vehicle
    if encoder is None:
        return
    sides = {name.partition(".")[2] for name in vehicle.wheel_names}
    places = [f"{where}.{side}" for where in ("leading", "trailing") for side in sorted(sides)]
    wheels = [*vehicle.wheel_names, *places]
    one_of(encoder.wheel, wheels, "the vehicle has no such wheel", field="encoder.wheel")
    with blame(None, "encoder"):
        decimation_factor(resolved.ride.rate_hz, encoder.rate_hz)
        check_encoder(encoder)
    duration = resolved.ride.profile.duration_s
    for i, event in enumerate(encoder.slip):
        if event.start_s >= duration:
            raise InputError(
                f"the slip begins after the end of ride {cell.ride.name}",
                field=f"encoder.slip[{i}].start_s",
                value=event.start_s,
                limit=f"< {duration:.1f} s",
                remedy="let it begin earlier, or put the ride into a scenario of its own",
            )
    if cell.ride.stands and encoder.radius == "calibrated":
        raise InputError(
            "no wheel can be calibrated at a standstill",
            field="encoder.radius",
            value=encoder.radius,
            remedy='set radius = "drawing", or let the ride move',
            limit="a ride that moves",
        )
