"""What a person writes of the sensors beside the IMU: ``[encoder]``, ``[magnetometer]``, ``[rail_sensor]``.

Each part makes the specification of its sensor (`spec`); units of the text end here. Whether a sensor fits
vehicle and ride is judged by `simrail.scenario.check_sensors`.
"""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.scenario.axes import Listed
from simrail.sensors.encoder import EncoderSpec, Slip
from simrail.sensors.magnetic_surroundings import Steel, Traction
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron
from simrail.sensors.rail_sensor import RailSensorSpec

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=0.5)]


class SlipPart(Part):
    """``[[encoder.slip]]``: a slide (creepage < 0) or a spin of the encoder's wheel."""

    start_s: NotNegative
    duration_s: Positive
    creepage: Annotated[float, Field(ge=-1.0, le=10.0)]
    ramp_s: NotNegative = 0.25

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
    radius: Listed[Literal["drawing", "calibrated"]] = "drawing"
    pulses_per_revolution: Listed[Annotated[int, Field(ge=1, le=1_000_000)]] = 1024
    rate_hz: Listed[Annotated[float, Field(gt=0.0, le=1000.0)]] = 250.0
    radius_error_sd: Listed[Annotated[float, Field(ge=0.0, le=0.1)]] = 0.0
    rolling_sd: Listed[Annotated[float, Field(ge=0.0, le=0.1)]] = 0.004
    radius_error: Listed[Annotated[float, Field(ge=-0.2, le=0.2)]] | None = None
    quadrature: Listed[bool] = False
    edge_pattern_sd: Listed[Fraction] = 0.0
    edge_jitter_sd: Listed[Fraction] = 0.0
    missed_rate: Listed[Fraction] = 0.0
    edge_times: Listed[bool] = False
    timer_hz: Listed[Positive] = 1e6
    slip: tuple[SlipPart, ...] = ()

    def spec(self) -> EncoderSpec:
        """The encoder, with no axis left."""
        plain = {name: value for name, value in self.model_dump().items() if name != "slip"}
        return EncoderSpec(**plain, slip=tuple(Slip(**event.model_dump()) for event in self.slip))


class IronPart(Part):
    """``[magnetometer.iron]``: hard and soft iron of the vehicle; synthetic."""

    hard_iron_ut: tuple[float, float, float] = (6.0, -4.0, 8.0)
    soft_iron: tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]] = (
        VehicleIron.soft_iron
    )


class TractionPart(Part):
    """``[magnetometer.traction]``: currents of the line that feeds the vehicle; synthetic."""

    supply: Listed[Literal["catenary", "third_rail"]] = "catenary"
    voltage_v: Listed[Annotated[float, Field(gt=0.0, le=30e3)]] = 750.0
    efficiency: Listed[Annotated[float, Field(gt=0.0, le=1.0)]] = 0.85
    auxiliary_kw: Listed[NotNegative] = 30.0
    mass_t: Listed[Positive] = 42.0
    resistance_kn: Listed[NotNegative] = 2.5
    regenerative: Listed[bool] = True
    share: Listed[Annotated[float, Field(gt=0.0, le=1.0)]] = 0.5


class SteelPart(Part):
    """``[magnetometer.steel]``: structures along the track; synthetic."""

    spacing_m: Listed[Annotated[float, Field(ge=1.0)]] = 20.0
    moment_sd_am2: Listed[NotNegative] = 1500.0
    beside_m: tuple[float, float] = (1.8, 4.0)
    height_m: tuple[float, float] = (-0.5, 5.0)

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
    inclination_deg: Listed[Annotated[float, Field(ge=-89.0, le=89.0)]] = 55.0
    declination_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    x_axis_deg: Listed[Annotated[float, Field(ge=-360.0, le=360.0)]] = 0.0
    noise_ntpsqrthz: Listed[NotNegative] = 10.0
    bias_nt: Listed[NotNegative] = 300.0
    range_ut: Listed[Positive] = 250.0
    resolution_nt: Listed[NotNegative] = 0.0
    iron: IronPart | None = None
    traction: TractionPart | None = None
    steel: SteelPart | None = None

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
    outlier_fraction: Listed[Annotated[float, Field(ge=0.0, le=0.2)]] = 0.01
    outlier_mm: Listed[Annotated[float, Field(ge=0.0, lt=1000.0)]] = 5.0

    def spec(self) -> RailSensorSpec:
        """The sensor, with no axis left."""
        return RailSensorSpec(
            noise_m=self.noise_mm / 1e3,
            outlier_fraction=self.outlier_fraction,
            outlier_m=self.outlier_mm / 1e3,
        )
