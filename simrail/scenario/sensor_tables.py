"""What a person writes of the sensors beside the IMU: ``[encoder]``, ``[magnetometer]`` and others.

Each part makes the specification of its sensor (`spec`); units of the text end here. Whether a sensor fits
vehicle and ride is judged by `simrail.scenario.check_sensors`.
"""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.recording.recording import SecondImuSheet
from simrail.recording.sheets.grades import ImuGrade
from simrail.ride.truth import Mount
from simrail.scenario.axes import Listed
from simrail.scenario.fields import Name, OnBoard
from simrail.sensors.encoder import EncoderSpec, Slip
from simrail.sensors.gnss import GnssSpec, Outage
from simrail.sensors.magnetic_surroundings import Steel, Traction
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron
from simrail.sensors.rail_sensor import RailSensorSpec
from simrail.sensors.second_imu import SecondImuSpec

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=0.5)]


class SlipPart(Part):
    """``[[encoder.slip]]``: a slide (creepage < 0) or a spin of the encoder's wheel."""

    start_s: NotNegative
    """When it begins, s."""
    duration_s: Positive
    """How long it lasts, s."""
    creepage: Annotated[float, Field(ge=-1.0, le=10.0)]
    """Relative slip: below 0 it slides, above it spins."""
    ramp_s: NotNegative = 0.25
    """Time in which it rises and falls, s."""

    @model_validator(mode="after")
    def _ramps_fit(self) -> SlipPart:
        if self.ramp_s > 0.5 * self.duration_s:
            raise InputError(
                f"rises and falls for longer than it lasts: ramp_s = {self.ramp_s:g}",
                field="ramp_s",
                value=self.ramp_s,
                limit=f"at most half of duration_s = {self.duration_s:g}",
                remedy="shorten ramp_s",
            )
        return self


class EncoderPart(Part):
    """``[encoder]``: counts of one wheel, whose radius is known up to a relative error.

    See `simrail.sensors.encoder.EncoderSpec` for the words that ``wheel`` and ``radius`` take.
    """

    wheel: Listed[str]
    """The wheel that it counts: its name, or its place in the direction of travel, e.g. trailing.left."""
    radius: Listed[Literal["drawing", "calibrated"]] = "drawing"
    """What the nominal radius is near to: the drawing's, or the mean on which it rolled, as an operator
    calibrates it."""
    pulses_per_revolution: Listed[Annotated[int, Field(ge=1, le=1_000_000)]] = 1024
    """Pulses of a turn."""
    rate_hz: Listed[Annotated[float, Field(gt=0.0, le=1000.0)]] = 250.0
    """Rate at which the logger reads the counter, Hz."""
    radius_error_sd: Listed[Annotated[float, Field(ge=0.0, le=0.1)]] = 0.0
    """Relative standard deviation of the nominal radius; one draw for each device."""
    rolling_sd: Listed[Annotated[float, Field(ge=0.0, le=0.1)]] = 0.004
    """Relative standard deviation of the rolling radius, as the train believes."""
    radius_error: Listed[Annotated[float, Field(ge=-0.2, le=0.2)]] | None = None
    """Fixed relative error of the radius in place of a draw."""
    quadrature: Listed[bool] = False
    """True: two channels, four counts of a pulse, and the direction told."""
    edge_pattern_sd: Listed[Fraction] = 0.0
    """Standard deviation of the disc's edges from their places, the same each turn, in pulses."""
    edge_jitter_sd: Listed[Fraction] = 0.0
    """Standard deviation of each edge of each turn beyond that, in pulses."""
    missed_rate: Listed[Fraction] = 0.0
    """Probability that a pulse goes uncounted."""
    edge_times: Listed[bool] = False
    """True records the time of the last edge as well."""
    timer_hz: Listed[Positive] = 1e6
    """Frequency of the timer of the edges, Hz."""
    slip: tuple[SlipPart, ...] = ()
    """Slides and spins on top of the creep of the contact."""

    def spec(self) -> EncoderSpec:
        """The encoder, with no axis left."""
        plain = {name: value for name, value in self.model_dump().items() if name != "slip"}
        return EncoderSpec(**plain, slip=tuple(Slip(**event.model_dump()) for event in self.slip))


class IronPart(Part):
    """``[magnetometer.iron]``: hard and soft iron of the vehicle; synthetic."""

    hard_iron_ut: tuple[float, float, float] = (6.0, -4.0, 8.0)
    """Remanent field of the vehicle on the axes of the sensor, uT."""
    soft_iron: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]] = (
        VehicleIron.soft_iron
    )
    """Induced field over the outer one, 3 x 3."""


class TractionPart(Part):
    """``[magnetometer.traction]``: currents of the line that feeds the vehicle; synthetic."""

    supply: Listed[Literal["catenary", "third_rail"]] = "catenary"
    """A contact wire above the track, or a conductor rail on its left."""
    voltage_v: Listed[Annotated[float, Field(gt=0.0, le=30e3)]] = 750.0
    """Voltage of the line, V."""
    efficiency: Listed[Annotated[float, Field(gt=0.0, le=1.0)]] = 0.85
    """Efficiency of the drive."""
    auxiliary_kw: Listed[NotNegative] = 30.0
    """What light and air take, kW."""
    mass_t: Listed[Positive] = 42.0
    """Mass of the whole train that is fed here, t."""
    resistance_kn: Listed[NotNegative] = 2.5
    """Running resistance, kN."""
    regenerative: Listed[bool] = True
    """True: braking feeds the line."""
    share: Listed[Annotated[float, Field(gt=0.0, le=1.0)]] = 0.5
    """Field over that of an endless line; one half where the line ends at the train."""


class SteelPart(Part):
    """``[magnetometer.steel]``: structures along the track; synthetic."""

    spacing_m: Listed[Annotated[float, Field(ge=1.0)]] = 20.0
    """Mean distance between them, m."""
    moment_sd_am2: Listed[NotNegative] = 1500.0
    """Standard deviation of each component of their magnetic moment, A m2."""
    beside_m: tuple[float, float] = (1.8, 4.0)
    """Least and largest distance from the centre of the track, either side, m."""
    height_m: tuple[float, float] = (-0.5, 5.0)
    """Least and largest height above the rails, m."""

    @model_validator(mode="after")
    def _ordered(self) -> SteelPart:
        if not 1.5 <= self.beside_m[0] <= self.beside_m[1]:
            given, limit = list(self.beside_m), "[least, largest], from 1.5 m on"
            raise InputError("is no range", field="beside_m", value=given, limit=limit, remedy="mend it")
        if not self.height_m[0] <= self.height_m[1]:
            given, limit = list(self.height_m), "[least, largest]"
            raise InputError("is no range", field="height_m", value=given, limit=limit, remedy="swap them")
        return self


class MagnetometerPart(Part):
    """``[magnetometer]``: a magnetometer in the housing of each IMU, in an undisturbed field.

    Each table below it adds a disturbance, which an empty table gives its (synthetic) defaults. The field is
    nominal for a mid-latitude; the sensor is that of the LORD 3DM-GX4-25.
    """

    intensity_ut: Listed[Annotated[float, Field(gt=0.0, lt=100.0)]] = 45.0
    """The Earth's field, uT."""
    inclination_deg: Listed[Annotated[float, Field(ge=-89.0, le=89.0)]] = 55.0
    """Dip below the horizontal, degrees; positive in the northern hemisphere."""
    declination_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """How far magnetic north lies east of north, degrees."""
    x_axis_deg: Listed[Annotated[float, Field(ge=-360.0, le=360.0)]] = 0.0
    """Direction of the track's X axis, degrees counter-clockwise from east."""
    noise_ntpsqrthz: Listed[NotNegative] = 10.0
    """White noise, nT/sqrt(Hz)."""
    bias_nt: Listed[NotNegative] = 300.0
    """Bound of the bias of an axis, nT; uniform, one draw for each device."""
    range_ut: Listed[Positive] = 250.0
    """Largest magnitude that is measured, uT."""
    resolution_nt: Listed[NotNegative] = 0.0
    """Size of one count, nT; 0 for none."""
    iron: IronPart | None = None
    """Hard and soft iron of the vehicle."""
    traction: TractionPart | None = None
    """Currents of the line that feeds the vehicle."""
    steel: SteelPart | None = None
    """Structures along the track."""

    def spec(self, track_seed: int) -> MagnetometerSpec:
        """The magnetometer on the track of a seed, with no axis left."""
        iron, traction, steel = self.iron, self.traction, self.steel
        x, y, z = (0.0, 0.0, 0.0) if iron is None else iron.hard_iron_ut
        return MagnetometerSpec(
            field=EarthField(
                intensity_t=self.intensity_ut / 1e6,
                inclination_rad=radians(self.inclination_deg),
                declination_rad=radians(self.declination_deg),
                x_axis_rad=radians(self.x_axis_deg),
            ),
            noise_tpsqrthz=self.noise_ntpsqrthz / 1e9,
            bias_t=self.bias_nt / 1e9,
            range_t=self.range_ut / 1e6,
            resolution_t=self.resolution_nt / 1e9,
            iron=None
            if iron is None
            else VehicleIron(hard_iron_t=(x / 1e6, y / 1e6, z / 1e6), soft_iron=iron.soft_iron),
            traction=None
            if traction is None
            else Traction(
                supply=traction.supply,
                voltage_v=traction.voltage_v,
                efficiency=traction.efficiency,
                auxiliary_w=1e3 * traction.auxiliary_kw,
                mass_kg=1e3 * traction.mass_t,
                resistance_n=1e3 * traction.resistance_kn,
                regenerative=traction.regenerative,
                share=traction.share,
            ),
            steel=None if steel is None else Steel(track_seed=track_seed, **steel.model_dump()),
        )


class RailSensorPart(Part):
    """``[rail_sensor]``: a sensor beside each IMU that sees both rails from its body."""

    noise_mm: Listed[Annotated[float, Field(ge=0.0, lt=100.0)]] = 0.1
    """Standard deviation of a reading, mm."""
    outlier_fraction: Listed[Annotated[float, Field(ge=0.0, le=0.2)]] = 0.01
    """Share of readings that are false."""
    outlier_mm: Listed[Annotated[float, Field(ge=0.0, lt=1000.0)]] = 5.0
    """Standard deviation of what a false one adds, mm."""

    def spec(self) -> RailSensorSpec:
        """The sensor, with no axis left."""
        return RailSensorSpec(
            noise_m=self.noise_mm / 1e3,
            outlier_fraction=self.outlier_fraction,
            outlier_m=self.outlier_mm / 1e3,
        )


class SecondImuPart(Part):
    """``[second_imu]``: an IMU on another bogie, recorded with each ``[[imu]]`` by a clock of its own.

    Its ``grade`` is that of the IMU beside it, unless it is given. How far its clock is ahead is drawn for
    each draw of the sensors with the standard deviation ``clock_offset_sd_s``, which the train knows; or it
    is ``clock_offset_s``. ``spacing_sd_m`` is how well the train knows the distance of both.
    """

    name: Name = "second"
    """Name of the IMU."""
    grade: Listed[str] | None = None
    """A shipped IMU, or the path of an IMU file; that of the IMU beside it if left out."""
    body: Listed[str]
    """The body that carries it."""
    position_m: tuple[OnBoard, OnBoard, OnBoard]
    """Where, m: ahead of the body's reference point, left of the track's centre, above the rails."""
    roll_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """How it is turned on the body about X, degrees."""
    pitch_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]] = 0.0
    """The same about Y, degrees."""
    yaw_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """The same about Z, degrees."""
    clock_offset_sd_s: Listed[Annotated[float, Field(gt=0.0, le=10.0)]] = SecondImuSheet.clock_offset_sd_s
    """Standard deviation of how far its clock is ahead, s; the train knows it."""
    clock_offset_s: Listed[Annotated[float, Field(ge=-10.0, le=10.0)]] | None = None
    """How far its clock is ahead, s, in place of a draw."""
    spacing_sd_m: Listed[Annotated[float, Field(gt=0.0, le=10.0)]] = SecondImuSheet.spacing_sd_m
    """How well the train knows the distance of both, m."""

    def spec(self, grade: ImuGrade) -> SecondImuSpec:
        """The second IMU, of a grade, with no axis left."""
        mount = Mount(
            name=self.name,
            body=str(self.body),
            position_m=self.position_m,
            roll_rad=radians(self.roll_deg),
            pitch_rad=radians(self.pitch_deg),
            yaw_rad=radians(self.yaw_deg),
        )
        return SecondImuSpec(
            mount, grade, self.clock_offset_sd_s, self.clock_offset_s, spacing_sd_m=self.spacing_sd_m
        )


class OutagePart(Part):
    """``[[gnss.outage]]``: a stretch of the line where nothing is received, e.g. a tunnel."""

    from_m: float
    """Where it begins, s along the track, m."""
    to_m: float
    """Where it ends, m."""


class GnssPart(Part):
    """``[gnss]``: a satellite receiver, its place and speed brought to the line; synthetic.

    See `simrail.sensors.gnss.GnssSpec`; the antenna is ``ahead_m`` of each ``[[imu]]``.
    """

    rate_hz: Listed[Annotated[float, Field(gt=0.0, le=100.0)]] = GnssSpec.rate_hz
    """Rate of its samples, Hz."""
    position_sd_m: Listed[NotNegative] = GnssSpec.position_sd_m
    """Standard deviation of the part of the place's error that wanders, m."""
    correlation_s: Listed[Positive] = GnssSpec.correlation_s
    """Time in which that wanders, s."""
    position_noise_m: Listed[Positive] = GnssSpec.position_noise_m
    """White noise of the place, m."""
    speed_sd_mps: Listed[Positive] = GnssSpec.speed_sd_mps
    """White noise of the speed, m/s."""
    latency_s: Listed[Annotated[float, Field(ge=0.0, le=10.0)]] = GnssSpec.latency_s
    """How much later than what it speaks of a sample comes, s."""
    ahead_m: Listed[OnBoard] = GnssSpec.ahead_m
    """How far the antenna is ahead of the IMU, m."""
    reacquire_s: Listed[Annotated[float, Field(ge=0.0, le=600.0)]] = GnssSpec.reacquire_s
    """How long nothing is received after an outage, s."""
    outage: tuple[OutagePart, ...] = ()
    """Stretches of the line where nothing is received."""

    def spec(self) -> GnssSpec:
        """The receiver, with no axis left."""
        plain = self.model_dump(exclude={"outage"})
        return GnssSpec(**plain, outages=tuple(Outage(part.from_m, part.to_m) for part in self.outage))
