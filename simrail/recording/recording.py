"""What the logger on the train saw, and what the train may know: the wall before the truth.

A `Recording` holds the signals (IMU, encoder, magnetometer, a second IMU) and the knowledge that a real train
has: the design track, the nominal wheel radius, the IMU's data sheet, where it is mounted, the drawing of the
vehicle.
Where the train is, nobody records: an odometry estimator concludes it, and its odometry frame is handed on to
those estimators that need one (`simrail.estimation.choose_odometry`). A recording never holds a true value,
except in an odometry frame that is labelled ``source="truth"`` (an ablation). Rides of real trains are read
into the same class, so the same estimators run on them.

This module neither simulates nor estimates.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.shown import Facts, Shown, names
from simrail.recording.sheets.vehicle_sheet import VehicleSheet
from simrail.track.design import TrackDesign
from simrail.track.map_errors import UNSTATED, MapErrors


@dataclass(frozen=True)
class ImuSheet:
    """What the data sheet says of an IMU: what an estimator may use for its tuning.

    Attributes
    ----------
    grade : str
        Name of the grade.
    rate_hz : float
        Sample rate.
    delay_s : float
        How much later than its time stamp a sample leaves the sensor (group delay of its filter).
        Time stamps are already corrected for it.
    gyro_noise_radpsqrts, accel_noise_mpsqrts : float
        Allan coefficients N of the white noise, rad/s/sqrt(Hz) and m/s2/sqrt(Hz) (IEEE 952): the
        standard deviation of one sample is N sqrt(rate).
    gyro_bias_instability_radps, accel_bias_instability_mps2 : float
        In-run bias instability B (Allan floor / 0.664).
    gyro_turn_on_bias_radps, accel_turn_on_bias_mps2 : float
        Bound of the bias at switch-on.
    lag_s : float
        Age of what a sample says at its time stamp, for slow motion: response of the device and its
        averaging, which the time stamps do not correct.
    bandwidth_hz : float, optional
        -3 dB frequency of its response; None where the sheet is silent.
    gyro_bias_correlation_s, accel_bias_correlation_s : float, optional
        Correlation time of the wandering bias; None where nothing is known.
    gyro_random_walk_radpspsqrts, accel_random_walk_mps2psqrts : float
        Rate random walk K, rad/s/sqrt(s) and m/s2/sqrt(s).
    gyro_scale_error, accel_scale_error : float
        Bound of the relative error of the scale factor.
    package_misalignment_rad : float
        Bound of the turns of the package about its axes.
    gyro_resolution_radps, accel_resolution_mps2 : float
        Size of one count; 0 for none.
    gyro_range_radps, accel_range_mps2 : float, optional
        Largest magnitude that is measured; None for no limit.
    clock_drift : float
        Bound of the relative error of the device's second.
    gyro_nonlinearity, accel_nonlinearity : float
        Bound of the deviation from a straight line, as a share of the range.
    """

    grade: str
    rate_hz: float
    delay_s: float
    gyro_noise_radpsqrts: float
    accel_noise_mpsqrts: float
    gyro_bias_instability_radps: float
    accel_bias_instability_mps2: float
    gyro_turn_on_bias_radps: float
    accel_turn_on_bias_mps2: float
    lag_s: float = 0.0
    bandwidth_hz: float | None = None
    gyro_bias_correlation_s: float | None = None
    accel_bias_correlation_s: float | None = None
    gyro_random_walk_radpspsqrts: float = 0.0
    accel_random_walk_mps2psqrts: float = 0.0
    gyro_scale_error: float = 0.0
    accel_scale_error: float = 0.0
    package_misalignment_rad: float = 0.0
    gyro_resolution_radps: float = 0.0
    accel_resolution_mps2: float = 0.0
    gyro_range_radps: float | None = None
    accel_range_mps2: float | None = None
    clock_drift: float = 0.0
    gyro_nonlinearity: float = 0.0
    accel_nonlinearity: float = 0.0


@dataclass(frozen=True)
class SecondImuSheet:
    """What the train knows of a second IMU, beside its signals.

    Attributes
    ----------
    mount, mount_body : str
        Name of this IMU, and of the body that it is mounted on.
    mount_position_m : tuple of float
        As `Recording.mount_position_m`.
    spacing_m : float
        How far it sits behind the first one along the train, m; below 0 for one that is ahead of it.
    imu : ImuSheet
        Its data sheet.
    spacing_sd_m : float
        Standard deviation of that distance.
    clock_offset_sd_s : float
        Standard deviation of how far its clock is ahead of the first one's.
    """

    mount: str
    mount_body: str
    mount_position_m: tuple[float, float, float]
    spacing_m: float
    imu: ImuSheet
    spacing_sd_m: float = 0.01
    clock_offset_sd_s: float = 0.02


@dataclass(frozen=True)
class EncoderSheet:
    """What the train knows of its wheel encoder.

    Attributes
    ----------
    wheel : str
        Name of the wheel, e.g. ``"front.left"``.
    pulses_per_revolution : int
        Counts per turn of the wheel: its pulses, or four times as many in quadrature.
    wheel_radius_m : float
        Nominal wheel radius; the true one differs.
    rate_hz : float
        Rate at which the logger reads the counter.
    radius_relative_sd : float
        Relative standard deviation of the rolling radius about the nominal one.
    """

    wheel: str
    pulses_per_revolution: int
    wheel_radius_m: float
    rate_hz: float
    radius_relative_sd: float = 0.005

    @property
    def pulse_m(self) -> float:
        """Way of one count, 2 pi r / N, in m."""
        return 2.0 * math.pi * self.wheel_radius_m / self.pulses_per_revolution


@dataclass(frozen=True)
class OdometerSheet:
    """What the train knows of an odometer that gives its speed.

    Attributes
    ----------
    speed_sd_mps : float
        Standard deviation of a reading; its error is treated as white.
    radius_relative_sd : float
        Relative standard deviation of its scale.
    """

    speed_sd_mps: float
    radius_relative_sd: float


@dataclass(frozen=True)
class GnssSheet:
    """What the train knows of its satellite receiver.

    Attributes
    ----------
    rate_hz : float
        Rate of its samples, those that are blank among them.
    position_sd_m, correlation_s : float
        Standard deviation of the part of the place's error that wanders, and over what time it does.
    position_noise_m : float
        That of its white part.
    speed_sd_mps : float
        That of the speed; white.
    latency_s : float
        How much earlier than its stamp is what a sample speaks of.
    ahead_m : float
        How far the antenna is ahead of the IMU along the train.
    """

    rate_hz: float
    position_sd_m: float
    speed_sd_mps: float
    correlation_s: float = 60.0
    position_noise_m: float = 0.3
    latency_s: float = 0.0
    ahead_m: float = 0.0


@dataclass(frozen=True)
class MagnetometerSheet:
    """What the train knows of its magnetometer, and of the field of the Earth where it runs.

    Attributes
    ----------
    noise_tpsqrthz : float
        Density N of the white noise, T/sqrt(Hz): one sample has the standard deviation N sqrt(rate).
    intensity_t, inclination_rad : float
        The Earth's field from a model or a chart: total intensity, and dip below the horizontal.
    north_rad : float
        Direction of magnetic north, counter-clockwise from the global X axis (seen from above).
    """

    noise_tpsqrthz: float
    intensity_t: float
    inclination_rad: float
    north_rad: float


@dataclass(frozen=True)
class RailSensorSheet:
    """What the train knows of the sensor that sees the rails from the body.

    Attributes
    ----------
    noise_m : float
        Standard deviation of each of its values, outliers apart.
    """

    noise_m: float


@dataclass(frozen=True, repr=False)
class Recording(Shown):
    """Signals of one ride, and what the train knows.

    Attributes
    ----------
    name : str
        Name of the ride.
    imu : pandas.DataFrame
        Indexed by ``time_s``, columns `simrail.core.columns.IMU`, uniform in time.
    imu_sheet : ImuSheet
        Its data sheet.
    mount : str
        Name of the IMU.
    mount_body : str
        Body that it is mounted on, e.g. ``"front"`` (an axle), ``"frame"``, ``"body"``.
    mount_position_m : tuple of float
        (x, y, z) of the IMU in its body when it stands centred on level track: x forward from the
        body's reference point, y left of the track centre, z above the rail plane.
    track : TrackDesign
        `simrail.track.design.NO_MAP` where the train carries no map.
        The map of the line that the train carries: its design, with the errors of a survey.
    map_errors : MapErrors
        How wrong that map may be; wide where nobody has said.
    encoder : pandas.DataFrame, optional
        Indexed by ``time_s``, column ``pulse_count``, and ``edge_time_s`` if the logger times edges.
    encoder_sheet : EncoderSheet, optional
        Its data sheet.
    start_position_m : float
        Where on the track the IMU stood at the first sample (the train knows its platform).
    odometry : pandas.DataFrame, optional
        Indexed by the IMU's ``time_s``; columns `simrail.core.columns.ODOMETRY` + `ODOMETRY_SD`: position,
        speed and acceleration of the IMU along the track. None until some odometry has been run.
    odometry_source : str
        ``"encoder"``, ``"truth"`` (an ablation), or the name of the method that made it; "" without one.
    gravity_mps2 : float
        Local gravity.
    gaps : pandas.DataFrame, optional
        Where the IMU's samples were lost and are interpolated in `imu`, one row per gap, columns
        `simrail.core.resample.GAPS`; None if none were.
    magnetometer : pandas.DataFrame, optional
        Indexed by the IMU's ``time_s``, columns `simrail.core.columns.MAGNETIC`, on the axes of the IMU.
    magnetometer_sheet : MagnetometerSheet, optional
        What is known of it.
    rail_displacement : pandas.DataFrame, optional
        Indexed by the IMU's ``time_s``, columns `simrail.core.columns.RAIL_DISPLACEMENT`: both rails seen
        from the place of the IMU, along Y and Z of the body.
    rail_sensor_sheet : RailSensorSheet, optional
        What is known of the sensor that sees them.
    odometer : pandas.DataFrame, optional
        Indexed by ``time_s``, column ``speed_mps``, negative towards smaller s: what an odometer shows.
    odometer_sheet : OdometerSheet, optional
        Its data sheet.
    vehicle_sheet : VehicleSheet, optional
        The vehicle's drawing, and how far the train may be from it; None where nothing is known of it.
    start_speed_mps : float, optional
        Speed at the first sample, negative towards smaller s, to some metres per second; None where nobody
        said it: then it is found out by the first second of an encoder.
    second_imu : pandas.DataFrame, optional
        What an IMU elsewhere on the train records, as `imu`, at the times of a clock of its own.
    second_imu_sheet : SecondImuSheet, optional
        Where it sits, and its data sheet.
    gnss : pandas.DataFrame, optional
        Indexed by ``time_s``, at which a sample came; columns `simrail.core.columns.GNSS` or one of them:
        place of the antenna along the map, and speed, NaN where there is none.
    gnss_sheet : GnssSheet, optional
        What is known of the receiver.
    notes : tuple of str
        What was done to its signals when they were read, one line each.
    """

    name: str
    imu: pd.DataFrame
    imu_sheet: ImuSheet
    mount: str
    mount_body: str
    mount_position_m: tuple[float, float, float]
    track: TrackDesign
    encoder: pd.DataFrame | None
    encoder_sheet: EncoderSheet | None
    start_position_m: float
    odometry: pd.DataFrame | None = None
    odometry_source: str = ""
    gravity_mps2: float = 9.81
    gaps: pd.DataFrame | None = None
    magnetometer: pd.DataFrame | None = None
    magnetometer_sheet: MagnetometerSheet | None = None
    rail_displacement: pd.DataFrame | None = None
    rail_sensor_sheet: RailSensorSheet | None = None
    odometer: pd.DataFrame | None = None
    odometer_sheet: OdometerSheet | None = None
    map_errors: MapErrors = UNSTATED
    vehicle_sheet: VehicleSheet | None = None
    start_speed_mps: float | None = None
    second_imu: pd.DataFrame | None = None
    second_imu_sheet: SecondImuSheet | None = None
    gnss: pd.DataFrame | None = None
    gnss_sheet: GnssSheet | None = None
    notes: tuple[str, ...] = ()

    def _facts(self) -> Facts:
        aiding = {
            "encoder": self.encoder,
            "odometer": self.odometer,
            "magnetometer": self.magnetometer,
            "second IMU": self.second_imu,
            "GNSS": self.gnss,
            "rail sensor": self.rail_displacement,
        }
        lost = 0 if self.gaps is None else int(self.gaps["missing"].sum())
        facts = {
            "imu": f"{len(self.imu):,} samples at {self.imu_sheet.rate_hz:g} Hz, {lost:,} lost",
            "mount": f"{self.mount} on {self.mount_body} at {names(self.mount_position_m)} m",
            "beside": names(name for name, frame in aiding.items() if frame is not None),
            "map": f"{self.track.name}, begins at s = {self.start_position_m:g} m",
            "odometry": self.odometry_source or "none yet",
        }
        return self.name, facts

    @property
    def has_wheel(self) -> bool:
        """Whether there are counts of an encoder, and its data sheet."""
        return self.encoder is not None and self.encoder_sheet is not None

    def with_odometry(self, odometry: pd.DataFrame, source: str) -> Recording:
        """Return the same recording with another odometry frame."""
        return replace(self, odometry=odometry, odometry_source=source)


def rows_of(frame: pd.DataFrame, columns: Iterable[str]) -> tuple[FloatArray, ...]:
    """Columns of a frame for a kernel, (n,) each, contiguous; not copied where the frame holds them so.

    All are read-only: of arrays that are not a kernel would be compiled once more.
    """
    values = frame.to_numpy(dtype=np.float64)
    rows = [np.ascontiguousarray(values[:, frame.columns.get_loc(name)]) for name in columns]
    for row in rows:
        row.flags.writeable = False
    return tuple(rows)


def odometry_of(recording: Recording) -> pd.DataFrame:
    """The odometry frame of a recording, for those that cannot do without.

    Raises
    ------
    InputError
        If no odometry has been run on it.
    """
    if recording.odometry is None:
        raise InputError(
            "the recording has no odometry: nobody knows where the train is",
            field="odometry",
            value=recording.name,
            remedy='choose one, e.g. simrail.with_odometry(recording, "curve_matched")',
            limit="a recording with an odometry",
        )
    return recording.odometry


AT_IMU_TIMES = ("imu", "odometry", "magnetometer", "rail_displacement")
"""Frames of a recording that have one row per sample of the IMU."""

AT_OWN_TIMES = ("encoder", "odometer", "second_imu", "gnss")
"""Frames of a recording whose device has a clock, or a clock rate, of its own."""


def beginning(recording: Recording, *, samples: int) -> Recording:
    """What the logger had after the first samples of the IMU; the frames are copies."""
    last = recording.imu.index[samples - 1] if samples <= len(recording.imu) else None
    frames = {name: getattr(recording, name) for name in (*AT_IMU_TIMES, *AT_OWN_TIMES)}
    cut = {
        name: (frame.iloc[:samples] if name in AT_IMU_TIMES else frame.loc[:last]).copy()
        for name, frame in frames.items()
        if frame is not None
    }
    return replace(recording, **cut)


def second_alone(recording: Recording) -> Recording | None:
    """The ride as the second IMU alone would have recorded it; None where there is none.

    Parameters
    ----------
    recording : Recording
        A ride with two IMUs.
    """
    imu, sheet = recording.second_imu, recording.second_imu_sheet
    if imu is None or sheet is None:
        return None
    place = recording.start_position_m - sheet.spacing_m
    odometry = recording.odometry
    if odometry is not None:
        odometry = odometry.assign(position_m=odometry["position_m"] - sheet.spacing_m)
    return replace(
        recording,
        imu=imu,
        imu_sheet=sheet.imu,
        mount=sheet.mount,
        mount_body=sheet.mount_body,
        mount_position_m=sheet.mount_position_m,
        start_position_m=place,
        odometry=odometry,
        gaps=None,
        magnetometer=None,
        magnetometer_sheet=None,
        rail_displacement=None,
        rail_sensor_sheet=None,
        second_imu=None,
        second_imu_sheet=None,
    )


def imus(recording: Recording) -> tuple[tuple[str, Recording], ...]:
    """Each IMU of a ride by its table in a ride file, with the ride as it alone would have recorded it.

    Parameters
    ----------
    recording : Recording
        A ride with one IMU or two.
    """
    second = second_alone(recording)
    first = ("imu", recording)
    return (first,) if second is None else (first, ("second_imu", second))
