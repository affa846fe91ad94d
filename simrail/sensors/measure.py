"""Truth in, recording out: everything that the logger on the train would have seen of a ride.

The only place where sensors meet the truth. Signals are recorded here, and nothing is estimated. What comes
out holds no true value, unless the true odometry is asked for by name (an ablation, labelled in every table).
"""

import math
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.core.resample import interpolated
from simrail.recording.recording import EncoderSheet, MagnetometerSheet, RailSensorSheet, Recording
from simrail.recording.sheets.grades import ImuGrade, imu_sheet
from simrail.recording.sheets.vehicle_sheet import VehicleSheet
from simrail.ride.truth import Mount, Truth
from simrail.sensors.encoder import EncoderSpec, nominal_radius, sample_encoder
from simrail.sensors.gnss import GnssSpec, sample_gnss
from simrail.sensors.imu import EarthRate, log_imu
from simrail.sensors.imu_response import Temperature
from simrail.sensors.magnetometer import MagnetometerSpec, sample_magnetometer
from simrail.sensors.rail_sensor import RailSensorSpec, sample_rails
from simrail.sensors.second_imu import SecondImuSpec, sample_second_imu
from simrail.track.design import TrackDesign
from simrail.track.laid_track import LaidTrack
from simrail.track.map_errors import EXACT, MapErrors


def measure(
    truth: Truth,
    *,
    name: str,
    mount: Mount,
    grade: ImuGrade,
    encoder: EncoderSpec | None = None,
    magnetometer: MagnetometerSpec | None = None,
    rail_sensor: RailSensorSpec | None = None,
    rails: LaidTrack | None = None,
    second_imu: SecondImuSpec | None = None,
    gnss: GnssSpec | None = None,
    odometry: str | None = None,
    seed: int,
    draw: int,
    earth_rate: EarthRate | None = None,
    temperature: Temperature | None = None,
    track_map: TrackDesign | None = None,
    map_errors: MapErrors = EXACT,
    vehicle_sheet: VehicleSheet | None = None,
) -> Recording:
    """Record a ride.

    Parameters
    ----------
    truth : Truth
        What happened.
    name : str
        Name of the ride.
    mount : Mount
        Where the IMU sits.
    grade : ImuGrade
        The IMU.
    encoder : EncoderSpec, optional
        The wheel encoder; None for a train without one.
    magnetometer : MagnetometerSpec, optional
        A magnetometer in the housing of the IMU, sampled at the IMU's times.
    rail_sensor : RailSensorSpec, optional
        A sensor beside the IMU that sees both rails.
    rails : LaidTrack, optional
        The rails that the ride was run on (`simrail.ride.ride.rails_of`), for that sensor.
    second_imu : SecondImuSpec, optional
        An IMU elsewhere on the train.
    gnss : GnssSpec, optional
        A satellite receiver.
    odometry : str, optional
        ``"truth"`` hands the true position, speed and acceleration of the mount on to estimators, an
        ablation. Any other odometry is concluded from what is recorded
        (`simrail.estimation.choose_odometry`).
    seed, draw : int
        Seed of the scenario and number of the sensor draw: a new draw is a new set of sensors.
    earth_rate : EarthRate, optional
        Rotation of the Earth; None for an Earth at rest.
    temperature : Temperature, optional
        Temperature of the IMU over the ride; None for that of its calibration.
    track_map : TrackDesign, optional
        The map that the train carries (`simrail.track.map_errors.draw_map`); None for an exact one, which is
        the design that was laid.
    map_errors : MapErrors
        How wrong that map may be, as the train knows it.
    vehicle_sheet : VehicleSheet, optional
        The vehicle's drawing (`simrail.sensors.drawing`); None where the train has none.

    Returns
    -------
    Recording
        The train knows where the mount stood at time 0. Samples of the IMU that got lost are filled by
        straight lines and listed in `Recording.gaps`.

    Raises
    ------
    InputError
        If body or wheel is unknown, a rate is above the truth's (of an encoder: does not divide it), or a
        rail sensor has no rails to see; or if another odometry than the true one is asked for.
    """
    _judge(odometry, is_blind=rail_sensor is not None and rails is None)
    imu, gaps, delay_s = log_imu(
        truth, mount, grade, seed=seed, draw=draw, earth=earth_rate, temperature=temperature
    )
    counts, sheet = None, None
    if encoder is not None:
        counts, sheet = _counted(truth, mount, encoder, seed=seed, draw=draw)
    # What else is beside the IMU meets the motion at its stamps only.
    motion = truth.motion(mount, _rows_of(truth, imu)) if magnetometer or rail_sensor or odometry else None
    of_mount: dict[str, Any] = {"seed": seed, "draw": draw, "name": mount.name}
    magnetic, seen = None, None
    if magnetometer is not None and motion is not None:
        line = truth.track.start_m, truth.track.end_m
        magnetic = sample_magnetometer(motion, imu.index, magnetometer, track_m=line, **of_mount)
    if rail_sensor is not None and rails is not None and motion is not None:
        seen = sample_rails(motion, imu.index, rail_sensor, rails, **of_mount)
    second, second_sheet = None, None
    if second_imu is not None:
        second, second_sheet = sample_second_imu(
            truth, mount, second_imu, seed=seed, draw=draw, earth_rate=earth_rate, temperature=temperature
        )
    received = None
    if gnss is not None:
        received = sample_gnss(
            truth.motion(mount, columns=("position_m", "speed_mps")), gnss, seed=seed, draw=draw
        )
    return Recording(
        name=name,
        imu=imu,
        imu_sheet=imu_sheet(grade, delay_s=delay_s),
        mount=mount.name,
        mount_body=mount.body,
        mount_position_m=mount.position_m,
        track=track_map or truth.track,
        map_errors=map_errors,
        vehicle_sheet=vehicle_sheet,
        encoder=counts,
        encoder_sheet=sheet,
        start_position_m=_place(truth, mount, 0),
        odometry=None if odometry is None or motion is None else true_odometry(motion, imu.index),
        odometry_source=odometry or "",
        gravity_mps2=truth.gravity_mps2,
        gaps=gaps,
        magnetometer=magnetic,
        magnetometer_sheet=None if magnetometer is None else magnetometer_sheet(magnetometer),
        rail_displacement=seen,
        rail_sensor_sheet=None if rail_sensor is None else RailSensorSheet(rail_sensor.noise_m),
        second_imu=second,
        second_imu_sheet=second_sheet,
        gnss=received,
        gnss_sheet=None if gnss is None else gnss.sheet,
    )


def _judge(odometry: str | None, *, is_blind: bool) -> None:
    """Refuse an odometry that nothing measures, and a rail sensor without rails to see."""
    if is_blind:
        raise InputError(
            "a rail sensor needs rails to see",
            field="rails",
            remedy="give rails_of(ride)",
            limit="rails of the ride",
        )
    if odometry not in (None, "truth"):
        raise InputError(
            "no such thing is measured: an odometry is concluded from a recording",
            field="odometry",
            value=odometry,
            limit="truth",
            remedy=f'use simrail.with_odometry(recording, "{odometry}")',
        )


def _counted(
    truth: Truth, mount: Mount, encoder: EncoderSpec, *, seed: int, draw: int
) -> tuple[pd.DataFrame, EncoderSheet]:
    """Counts of an encoder on a ride, and what the train knows of it."""
    wheel = truth.wheel_at(encoder.wheel)
    angle, radius = truth.wheel_angle(wheel), truth.wheel_radius_m[wheel]
    if encoder.radius == "calibrated":
        # Over all runs: one there and one back would leave nothing to divide.
        turns = truth.turning_rows
        run = np.abs(np.diff([_place(truth, mount, row) for row in turns])).sum()
        radius = run / np.abs(np.diff([angle[row] for row in turns])).sum()
    sheet = EncoderSheet(
        wheel=wheel,
        pulses_per_revolution=encoder.counts_per_revolution,
        wheel_radius_m=nominal_radius(radius, encoder, seed=seed, draw=draw),
        rate_hz=encoder.rate_hz,
        radius_relative_sd=math.hypot(encoder.radius_error_sd, encoder.rolling_sd),
    )
    return sample_encoder(angle, truth.time_s, encoder, seed=seed, draw=draw), sheet


def _place(truth: Truth, mount: Mount, row: int) -> float:
    """Where a mount was, s, at a sample of the truth."""
    return float(truth.motion(mount, range(row, row + 1), ("position_m",)).to_numpy()[0, 0])


def _rows_of(truth: Truth, imu: pd.DataFrame) -> range | None:
    """Samples of the truth at the stamps of an IMU; None (all) where these lie between its own."""
    first, second = np.searchsorted(truth.time_s, imu.index[:2].to_numpy())
    step = int(second - first)
    rows = range(int(first), int(first) + step * len(imu), step)
    if rows[-1] >= len(truth.time_s) or not np.array_equal(
        truth.time_s[rows.start : rows.stop : rows.step], imu.index.to_numpy()
    ):
        return None
    return rows


def magnetometer_sheet(spec: MagnetometerSpec) -> MagnetometerSheet:
    """What a chart of the Earth's field and the data sheet tell an estimator; nothing of disturbances."""
    return MagnetometerSheet(
        noise_tpsqrthz=spec.noise_tpsqrthz,
        intensity_t=spec.field.intensity_t,
        inclination_rad=spec.field.inclination_rad,
        north_rad=spec.field.north_rad,
    )


def true_odometry(motion: pd.DataFrame, times: pd.Index) -> pd.DataFrame:
    """The true odometry of a mount, with standard deviations of zero; interpolated between its own times."""
    if times.isin(motion.index).all():
        frame = motion.loc[times, list(ODOMETRY)].copy()
    else:
        values = interpolated(motion, times.to_numpy(dtype=np.float64), *ODOMETRY)
        frame = pd.DataFrame(values, index=times, columns=list(ODOMETRY))
    frame[list(ODOMETRY_SD)] = np.zeros((len(frame), len(ODOMETRY_SD)))
    return frame
