"""Ride files: one TOML file that says what the data files of a ride hold, and what the train knows.

A ride of a real train maps its logger's columns, units and axes here; a ride that simrail wrote has its own
column names in SI and needs no map. The models judge the text, `simrail.recording.files.signal_part` the map
of each signal; `simrail.recording.files.ride_reader` reads the data.
"""

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from simrail.core.errors import InputError
from simrail.core.resample import LONGEST_GAP_S
from simrail.core.toml_files import Part, blame, judge
from simrail.recording.files.asked import LimitsPart, MethodPart, RailReferencePart, ReferencePart
from simrail.recording.files.signal_part import LARGEST_OFFSET_S, TICKS, SignalPart, VectorPart
from simrail.recording.recording import (
    EncoderSheet,
    GnssSheet,
    ImuSheet,
    MagnetometerSheet,
    RailSensorSheet,
    SecondImuSheet,
)
from simrail.recording.sheets.imu_file import ImuFile
from simrail.recording.sheets.vehicle_sheet_file import VehicleSheetPart
from simrail.recording.signals import (
    ENCODER_SIGNAL,
    GAPS_SIGNAL,
    GNSS_SIGNAL,
    IMU_SENSORS,
    IMU_SIGNAL,
    MAGNETOMETER_SIGNAL,
    ODOMETER_SIGNAL,
    ODOMETRY_SIGNAL,
    RAIL_SIGNAL,
    SECOND_IMU_SIGNAL,
    Signal,
)
from simrail.track.map_file import MapErrorsPart


class SensorPart(Part):
    """``[imu.gyro]``, ``[imu.accel]``: what one sensor of an IMU has of its own; all else is as in ``[imu]``.

    Attributes
    ----------
    file, separator, decimal, skip_lines, units_row
        As `DataPart`.
    columns, units, lsb_per_unit, tick_rate_hz, rate_hz, start_s, time_offset_s
        As `SignalPart`.
    axes, roll_deg, pitch_deg, yaw_deg
        As `VectorPart`.
    """

    file: str | None = None
    separator: str | None = None
    decimal: str | None = None
    skip_lines: int | None = None
    units_row: bool | None = None
    columns: dict[str, Any] | None = None
    units: dict[str, str] | None = None
    lsb_per_unit: dict[str, float] | None = None
    tick_rate_hz: float | None = None
    rate_hz: float | None = None
    start_s: float | None = None
    time_offset_s: Annotated[float, Field(ge=-LARGEST_OFFSET_S, le=LARGEST_OFFSET_S)] | None = None
    axes: tuple[str, str, str] | None = None
    roll_deg: float | None = None
    pitch_deg: float | None = None
    yaw_deg: float | None = None


class GyroPart(VectorPart):
    """The gyroscope of an IMU, apart."""

    signal: ClassVar[Signal] = IMU_SENSORS[0]


class AccelPart(VectorPart):
    """The accelerometer of an IMU, apart."""

    signal: ClassVar[Signal] = IMU_SENSORS[1]


class ImuSignalPart(VectorPart):
    """``[imu]``: the IMU, where it sits, and its data sheet (one of three ways to give it).

    Attributes
    ----------
    gyro, accel : SensorPart, optional
        What each of its sensors has of its own: a file, columns, units, axes.
    output : str, optional
        ``"increments"`` if samples are turns in rad and gains of speed in m/s; such units say so, too.
    name, body : str
        Name of the IMU, and of the body that carries it.
    position_m : tuple of float
        Where it sits as the vehicle stands centred on level track, m: ahead of the body's reference point,
        left of the track's centre, above the rails.
    delay_s : float
        How much later than its time stamp a sample leaves the sensor, s, where the sheet does not say it;
        time stamps are already corrected for it.
    grade : str, optional
        A shipped IMU, or the path of an IMU file.
    datasheet : ImuFile, optional
        The same figures here.
    sheet : ImuSheet, optional
        In SI, as simrail writes it.
    """

    signal: ClassVar[Signal] = IMU_SIGNAL

    file: str = ""
    gyro: SensorPart | None = None
    accel: SensorPart | None = None
    output: Literal["rates", "increments"] | None = None
    name: str = "imu"
    body: str
    position_m: tuple[float, float, float]
    delay_s: float = 0.0
    grade: str | None = None
    datasheet: ImuFile | None = None
    sheet: ImuSheet | None = None

    @model_validator(mode="after")
    def _output_as_units(self) -> Self:
        sensors = {key: getattr(self, key) for key in ("gyro", "accel")}
        if not self.file and not all(part is not None and part.file for part in sensors.values()):
            raise InputError(
                "is required",
                field="file",
                limit="a data file for the IMU, or one each for gyro and accel",
                remedy="add it, here or in [imu.gyro] and [imu.accel]",
            )
        for key, unit in (("gyro", "rad"), ("accel", "m/s")) if self.output == "increments" else ():
            self.units.setdefault(key, unit)
        rates = [key for key in sensors if key not in self.increments]
        if self.output is not None and bool(rates) != (self.output == "rates"):
            raise InputError(
                "does not go with the units",
                field="output",
                value=self.output,
                limit='units of increments, e.g. "rad" and "m/s"'
                if rates
                else 'units of rates, e.g. "rad/s"',
                remedy="mend units.gyro and units.accel, or leave output out",
            )
        for key, kind in (("gyro", GyroPart), ("accel", AccelPart)):
            with blame(None, key):
                self.sensor(key, kind)
        return self

    def sensor(self, key: str, kind: type[VectorPart]) -> VectorPart:
        """What is said of one of the sensors, with what it shares with the other.

        Parameters
        ----------
        key : str
            ``"gyro"`` or ``"accel"``.
        kind : type
            `GyroPart` or `AccelPart`.
        """
        shared = {name: getattr(self, name) for name in kind.model_fields if name in self.model_fields_set}
        own: SensorPart | None = getattr(self, key)
        said = {} if own is None else own.model_dump(exclude_none=True)
        for name in ("columns", "units", "lsb_per_unit", "scale"):
            mine = {word: value for word, value in shared.get(name, {}).items() if word in (key, "time")}
            shared[name] = mine | said.pop(name, {})
        if "tick_rate_hz" in shared and shared["units"].get("time") != TICKS:
            shared.pop("tick_rate_hz")
        return judge(kind, shared | said, file=None)

    @model_validator(mode="after")
    def _one_sheet(self) -> Self:
        given = [key for key in ("grade", "datasheet", "sheet") if getattr(self, key) is not None]
        if len(given) != 1:
            raise InputError(
                "needs its data sheet, given once",
                field="grade",
                value=given or None,
                limit="one of grade, [imu.datasheet], [imu.sheet]",
                remedy="e.g. grade = \"lord_3dm_gx4_25\"; 'simrail list' shows all",
            )
        return self


class SecondImuSignalPart(ImuSignalPart):
    """``[second_imu]``: an IMU elsewhere on the train, like ``[imu]``, by a clock of its own.

    Attributes
    ----------
    spacing_m : float, optional
        How far it sits behind the first IMU along the train, m; from the drawing, where there is one and it
        is not given.
    spacing_sd_m, clock_offset_sd_s : float
        Standard deviations of that, m, and of how far its clock is ahead, s.
    """

    signal: ClassVar[Signal] = SECOND_IMU_SIGNAL

    name: str = "second"
    spacing_m: Annotated[float, Field(ge=-1000.0, le=1000.0)] | None = None
    spacing_sd_m: Annotated[float, Field(gt=0.0, le=10.0)] = SecondImuSheet.spacing_sd_m
    clock_offset_sd_s: Annotated[float, Field(gt=0.0, le=10.0)] = SecondImuSheet.clock_offset_sd_s


class EncoderSignalPart(SignalPart):
    """``[encoder]``: pulses of a wheel, signed: falling while the train runs towards smaller s.

    Attributes
    ----------
    sheet : EncoderSheet
        What the train knows of it.
    reverse : bool
        True if the logger counts up while the train runs towards smaller s.
    per_reading : bool
        True if each value is what was counted since the last reading, rather than since the start.
    counter_modulus : int, optional
        Pulses after which the counter begins anew; found out where nothing is said.
    radius_relative_sd : float, optional
        That of the sheet, where the sheet does not say it.
    """

    signal: ClassVar[Signal] = ENCODER_SIGNAL

    sheet: EncoderSheet
    reverse: bool = False
    per_reading: bool = False
    counter_modulus: Annotated[int, Field(ge=16)] | None = None
    radius_relative_sd: Annotated[float, Field(ge=0.0, le=0.1)] | None = None

    @field_validator("sheet")
    @classmethod
    def _counts(cls, value: EncoderSheet) -> EncoderSheet:
        for field in ("pulses_per_revolution", "wheel_radius_m", "rate_hz"):
            if getattr(value, field) <= 0:
                raise InputError("is out of range", field=field, value=getattr(value, field), limit="> 0")
        if not 0.05 <= value.wheel_radius_m <= 1.5:
            raise InputError(
                "is no wheel's",
                field="wheel_radius_m",
                value=value.wheel_radius_m,
                limit="0.05 to 1.5 m",
                remedy=_radius_meant(value.wheel_radius_m),
            )
        return value

    @property
    def known(self) -> EncoderSheet:
        """What the train knows of it, all told."""
        if self.radius_relative_sd is None:
            return self.sheet
        return replace(self.sheet, radius_relative_sd=self.radius_relative_sd)


def _radius_meant(value: float) -> str:
    """A remedy for a wheel radius that is none: what it is in other units."""
    units = (("millimetres", 1e-3), ("centimetres", 1e-2), ("inches", 0.0254))
    # Of a train's wheel, down to that of a model on a scale track.
    meant = [f"{value * si:.4g} from {name}" for name, si in units if 0.1 <= value * si <= 0.7]
    meant += [
        f"{0.5 * value * si:.4g} from a diameter in {name}" for name, si in units if 0.2 <= value * si <= 1.4
    ]
    return "give the radius in metres" + (f": {', or '.join(meant)}" if meant else "")


class MagnetometerSignalPart(VectorPart):
    """``[magnetometer]``: the field at the IMU, and what is known of the Earth's.

    At other times than the IMU's it is interpolated by straight lines.

    Attributes
    ----------
    sheet : MagnetometerSheet
        Its noise, and the Earth's field where the train runs.
    """

    signal: ClassVar[Signal] = MAGNETOMETER_SIGNAL

    sheet: MagnetometerSheet


class RailSignalPart(SignalPart):
    """``[rail_displacement]``: both rails seen from the IMU's place, along Y and Z of the body.

    At other times than the IMU's they are interpolated by straight lines.

    Attributes
    ----------
    sheet : RailSensorSheet
        Its noise.
    """

    signal: ClassVar[Signal] = RAIL_SIGNAL

    sheet: RailSensorSheet

    @field_validator("sheet")
    @classmethod
    def _possible(cls, value: RailSensorSheet) -> RailSensorSheet:
        if not 0.0 < value.noise_m <= 0.1:
            raise InputError(
                "is out of range",
                field="noise_m",
                value=value.noise_m,
                limit="> 0, <= 0.1 m",
                remedy="give it in metres",
            )
        return value


class OdometerPart(SignalPart):
    """``[odometer]``: the distance or the speed that the train's own odometer gives, instead of pulses.

    Attributes
    ----------
    reverse : bool
        True if the train ran towards smaller s, and the odometer does not say so.
    resolution_m : float, optional
        Step of the distance; needed with it.
    speed_sd_mps : float
        Standard deviation of a reading of the speed.
    radius_relative_sd : float
        Relative standard deviation of its scale.
    """

    signal: ClassVar[Signal] = ODOMETER_SIGNAL

    reverse: bool = False
    resolution_m: Annotated[float, Field(gt=0.0, le=100.0)] | None = None
    speed_sd_mps: Annotated[float, Field(gt=0.0, le=10.0)] = 0.1
    radius_relative_sd: Annotated[float, Field(ge=0.0, le=0.1)] = 0.005

    @model_validator(mode="after")
    def _one_quantity(self) -> Self:
        given = [key for key in ("distance", "speed") if key in self.columns]
        if len(given) != 1:
            raise InputError(
                "needs a column of distance or of speed",
                field="columns",
                value=given or None,
                limit="one of distance, speed",
                remedy='e.g. columns = { time = "t", speed = "v" }',
            )
        if given == ["distance"] and self.resolution_m is None:
            raise InputError(
                "is required with a distance",
                field="resolution_m",
                remedy="give the odometer's step, e.g. 0.1",
                limit="> 0 m",
            )
        return self


class GnssSignalPart(SignalPart):
    """``[gnss]``: what a satellite receiver says, brought to the line; blank cells mean no sample.

    Attributes
    ----------
    sheet : GnssSheet
        How wrong it may be, and how late.
    """

    signal: ClassVar[Signal] = GNSS_SIGNAL

    sheet: GnssSheet

    @field_validator("sheet")
    @classmethod
    def _possible(cls, value: GnssSheet) -> GnssSheet:
        for field in ("rate_hz", "position_noise_m", "speed_sd_mps", "correlation_s"):
            if not 0.0 < getattr(value, field) < 1e4:
                raise InputError("is out of range", field=field, value=getattr(value, field), limit="> 0")
        for field in ("position_sd_m", "latency_s"):
            if not 0.0 <= getattr(value, field) < 1e3:
                raise InputError("is out of range", field=field, value=getattr(value, field), limit=">= 0")
        return value


class OdometrySignalPart(SignalPart):
    """``[odometry]``: position, speed and acceleration of the IMU, made elsewhere by `source`.

    At other times than the IMU's they are interpolated by straight lines: that looks ahead by up to one of
    its intervals.
    """

    signal: ClassVar[Signal] = ODOMETRY_SIGNAL

    source: str
    """Who made it, as pages call it."""


class GapsPart(SignalPart):
    """``[gaps]``: where the IMU's samples had been lost before the file was written."""

    signal: ClassVar[Signal] = GAPS_SIGNAL


class RideFile(Part):
    """A ride file.

    Attributes
    ----------
    name : str
        Name of the ride.
    track : str, optional
        A shipped track, or the path of a track file; without it only methods that need no map run.
    start_position_m : float, optional
        s of the IMU at its first sample; 0 if not given, which only a ride without a track may leave out.
    start_speed_mps : float, optional
        Speed at the first sample of a ride that begins at speed, negative towards smaller s; found out by an
        encoder if not given.
    gravity_mps2 : float
        Local gravity.
    longest_gap_s : float
        Longest gap in a signal that is bridged, unless its own table says otherwise.
    map : MapErrorsPart, optional
        How wrong the track file may be; taken to be wide without it.
    vehicle_sheet : VehicleSheetPart, optional
        What a drawing of the vehicle says; without it nothing is known of pivots and axles.
    imu, second_imu, encoder, magnetometer, rail_displacement, odometer, odometry, gnss, gaps
        Its signals. Without an odometry it is made from encoder or odometer
        (`simrail.estimation.recorded_ride.read_ride`); without those as well, nobody knows where it is.
    estimator : tuple of MethodPart
        Methods that ``simrail estimate`` runs, where its command names none.
    limits : LimitsPart
        What the rails that are found are held against; examples where nothing is said.
    reference : ReferencePart, optional
        Angles, place or speed to compare with, better known than what is judged.
    rail_reference : RailReferencePart, optional
        Rails to compare with.
    """

    name: str = Field(min_length=1, max_length=200)
    track: str | None = None
    start_position_m: float | None = None
    start_speed_mps: Annotated[float, Field(ge=-150.0, le=150.0)] | None = None
    gravity_mps2: Annotated[float, Field(ge=9.7, le=9.9)] = 9.81
    longest_gap_s: Annotated[float, Field(gt=0.0, le=10.0)] = LONGEST_GAP_S
    map: MapErrorsPart = MapErrorsPart()
    vehicle_sheet: VehicleSheetPart | None = None
    imu: ImuSignalPart
    second_imu: SecondImuSignalPart | None = None
    encoder: EncoderSignalPart | None = None
    magnetometer: MagnetometerSignalPart | None = None
    rail_displacement: RailSignalPart | None = None
    odometer: OdometerPart | None = None
    odometry: OdometrySignalPart | None = None
    gnss: GnssSignalPart | None = None
    gaps: GapsPart | None = None
    estimator: tuple[MethodPart, ...] = ()
    limits: LimitsPart = LimitsPart()
    reference: ReferencePart | None = None
    rail_reference: RailReferencePart | None = None

    @field_validator("map")
    @classmethod
    def _exact_or_not(cls, value: MapErrorsPart) -> MapErrorsPart:
        said = sorted(value.model_fields_set - {"exact"})
        if value.exact and said:
            raise InputError(
                "an exact map has no errors",
                field=said[0],
                value=getattr(value, said[0]),
                remedy="remove it, or exact = true",
                limit="exact = true, or errors",
            )
        return value

    @model_validator(mode="after")
    def _with_a_track_or_without(self) -> Self:
        if self.track is not None and self.start_position_m is None:
            raise InputError(
                "is required",
                field="start_position_m",
                limit="where the ride starts on the track, m",
                remedy="add it",
            )
        if self.track is None and "map" in self.model_fields_set:
            raise InputError(
                "belongs to a track", field="map", limit="only beside track", remedy="add track, or remove it"
            )
        return self

    @model_validator(mode="after")
    def _on_the_drawing(self) -> Self:
        if self.vehicle_sheet is None:
            return self
        sheet = self.vehicle_sheet.sheet(self.imu.body)
        body = sheet.body(self.imu.body)
        if body is None:
            raise InputError(
                "is not on the drawing of the vehicle",
                field="imu.body",
                value=self.imu.body,
                limit="one of " + ", ".join(entry.name for entry in sheet.bodies),
                remedy="mend it, or add a [[vehicle_sheet.body]]",
            )
        x = self.imu.position_m[0]
        if body.ends_m is not None and not body.ends_m[0] <= x <= body.ends_m[1]:
            raise InputError(
                "the IMU sits outside its body",
                field="imu.position_m[0]",
                value=x,
                limit=f"{body.ends_m[0]:g} to {body.ends_m[1]:g} m, the ends of {body.name!r}",
                remedy="give it in metres from the body's own reference point",
            )
        return self

    @model_validator(mode="after")
    def _methods_told_apart(self) -> Self:
        names = [part.called for part in self.estimator]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise InputError(
                    "is the name of two methods",
                    field=f"estimator[{number}].name",
                    value=name,
                    limit="a name for each",
                    remedy="give one of them another name",
                )
        return self

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.encoder is not None and self.odometer is not None:
            raise InputError(
                "says twice how far the train went",
                field="odometer",
                remedy="remove [odometer] or [encoder]",
                limit="one of them",
            )
        return self
