"""What a person writes of what shakes a ride: ``[vibration]`` and a table for each source.

The bare table ``[vibration]`` has every source but joints, with figures whose origin
`simrail.ride.vibration.sources` tells; ``on = false`` leaves one out. Units of the text end here. What of it
fits a ride is judged by `simrail.scenario.check_vibration`.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.ride.vibration.sources import CarBending, Equipment, Passengers, Traction, Vibration
from simrail.scenario.axes import Listed
from simrail.track.rail_surface import Corrugation, Dips, RailSources, Roughness, SleeperPassing
from simrail.track.roughness import TABLES, RoughnessTable
from simrail.track.sections import PASSING_M, SectionGain
from simrail.vehicle.vibration.linear_model import TrackSupport
from simrail.vehicle.vibration.wheels import OutOfRound

Positive = Annotated[float, Field(gt=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Frequency = Annotated[float, Field(gt=0.0, le=500.0)]
Acceleration = Annotated[float, Field(ge=0.0, le=10.0)]
Level = Annotated[float, Field(ge=-60.0, le=60.0)]

OWN_TABLE = "own"
"""Name of the roughness table that a scenario gives itself."""


class RoughnessPart(Part):
    """``[vibration.roughness]``: levels of one-third octave bands, by a table's name or a table of one's own.

    ``wavelengths_m`` and ``levels_db`` (re 1 um), from the longest band on, stand for ``table = "own"``.
    """

    on: Listed[bool] = True
    """False switches this source off."""
    table: Listed[Literal["eu_2021_1226_m", "iso_3095", "own"]] = "eu_2021_1226_m"
    """Levels by a table's name; own for those below."""
    offset_db: Listed[Annotated[float, Field(ge=-40.0, le=40.0)]] = 0.0
    """Added to all levels, dB."""
    shortest_m: Listed[Annotated[float, Field(ge=0.04, le=1.0)]] = 0.05
    """Shortest wave, m."""
    wavelengths_m: tuple[Positive, ...] = ()
    """Centres of one-third octave bands, from the longest on, m, of a table of one's own."""
    levels_db: tuple[Level, ...] = ()
    """Their levels, dB re 1 um."""

    @model_validator(mode="after")
    def _bands(self) -> RoughnessPart:
        waves = self.wavelengths_m
        if len(waves) != len(self.levels_db):
            raise InputError(
                "needs a level for each band",
                field="levels_db",
                value=f"{len(self.levels_db)} levels",
                limit=f"{len(waves)}, one for each of wavelengths_m",
                remedy="give as many levels as wavelengths",
            )
        for longer, shorter in pairwise(waves):
            if not 1.2 < longer / shorter < 1.32:
                raise InputError(
                    "is no list of neighbouring one-third octave bands",
                    field="wavelengths_m",
                    value=f"{longer:g}, {shorter:g}",
                    limit="falling, each the next nominal band: 1.25, 1.0, 0.8, 0.63, ...",
                    remedy="fill the gap, or mend the order",
                )
        if waves and self.table != OWN_TABLE:
            raise InputError(
                "has levels of its own that nothing uses",
                field="table",
                value=self.table,
                limit=OWN_TABLE,
                remedy='set table = "own"',
            )
        if not waves and self.table == OWN_TABLE:
            raise InputError(
                "has no levels",
                field="table",
                value=self.table,
                limit="wavelengths_m and levels_db",
                remedy="give them, or the name of a table",
            )
        return self

    def levels(self) -> RoughnessTable:
        """The table that it names, or gives."""
        if self.table == OWN_TABLE:
            source = "levels as the scenario says"
            return RoughnessTable(OWN_TABLE, source, self.wavelengths_m, self.levels_db)
        return TABLES[self.table]


class SectionGainPart(Part):
    """``[vibration.section_gain]``: sections of the line are rougher and smoother, at short and long waves.

    Standard deviations of the logarithm of the gain on amplitudes: ``sd`` of the roughness, ``long_waves_sd``
    of what ``[irregularity]`` draws.
    """

    on: Listed[bool] = True
    """False switches this source off."""
    sd: Listed[Annotated[float, Field(ge=0.0, le=2.0)]] = 0.4
    """Standard deviation of the logarithm of the gain on the roughness."""
    long_waves_sd: Listed[Annotated[float, Field(ge=0.0, le=2.0)]] = 0.35
    """The same of what [irregularity] draws."""
    lengths_m: tuple[Positive, Positive] = (100.0, 400.0)
    """Shortest and longest section, m."""

    @model_validator(mode="after")
    def _lengths(self) -> SectionGainPart:
        if not PASSING_M <= self.lengths_m[0] <= self.lengths_m[1]:
            raise InputError(
                "are not the shortest and the longest section",
                field="lengths_m",
                value=list(self.lengths_m),
                limit=f"{PASSING_M:g} m <= shortest <= longest",
                remedy="e.g. [100.0, 400.0]",
            )
        return self


class DipsPart(Part):
    """``[vibration.welds]``, ``[vibration.joints]``: dips of the rails at even distances."""

    on: Listed[bool] = True
    """False switches this source off."""
    spacing_m: Listed[Annotated[float, Field(ge=2.0, le=1000.0)]] = 18.0
    """Distance between them, m."""
    depth_mm: Listed[Annotated[float, Field(ge=-5.0, le=5.0)]] = 0.15
    """Mean depth, mm."""
    depth_sd_mm: Listed[Annotated[float, Field(ge=0.0, le=5.0)]] = 0.1
    """Standard deviation of the depth, mm."""
    decay_m: Listed[Annotated[float, Field(ge=0.02, le=2.0)]] = 0.12
    """Length over which a dip decays, m."""
    reach_m: Listed[Annotated[float, Field(ge=0.1, le=5.0)]] = 0.8
    """Half of the length of a dip, m."""

    def dips(self) -> Dips | None:
        """The dips; None if they are off."""
        if not self.on:
            return None
        depth, spread = 1e-3 * float(self.depth_mm), 1e-3 * float(self.depth_sd_mm)
        return Dips(self.spacing_m, depth, spread, self.decay_m, self.reach_m)


class SleepersPart(Part):
    """``[vibration.sleepers]``: passing over sleepers, as an equivalent wave of both rails."""

    on: Listed[bool] = True
    """False switches this source off."""
    spacing_m: Listed[Annotated[float, Field(ge=0.2, le=2.0)]] = 0.6
    """Mean distance, m."""
    spacing_sd: Listed[Annotated[float, Field(ge=0.0, le=0.1)]] = 0.01
    """Relative standard deviation of the distance."""
    amplitude_um: Listed[Annotated[float, Field(ge=0.0, le=1000.0)]] = 10.0
    """Amplitude of the equivalent wave, um."""
    amplitude_sd: Listed[Annotated[float, Field(ge=0.0, le=1.0)]] = 0.25
    """Relative standard deviation of the amplitude."""


class CorrugationPart(Part):
    """``[vibration.corrugation]``: one wave on the inner rail of curves sharper than ``radius_m``."""

    on: Listed[bool] = True
    """False switches this source off."""
    wavelength_m: Listed[Annotated[float, Field(ge=0.04, le=1.0)]] = 0.08
    """Its wavelength, m."""
    amplitude_um: Listed[Annotated[float, Field(ge=0.0, le=1000.0)]] = 15.0
    """Its amplitude, um."""
    radius_m: Listed[Annotated[float, Field(gt=0.0, le=5000.0)]] = 450.0
    """Curves sharper than this have it, m."""


class WheelsPart(Part):
    """``[vibration.wheels]``: wheels out of round by orders; order n has ``amplitude_um n^-exponent``."""

    on: Listed[bool] = True
    """False switches this source off."""
    amplitude_um: Listed[Annotated[float, Field(ge=0.0, le=2000.0)]] = 60.0
    """Median amplitude of the first order, um."""
    exponent: Listed[Annotated[float, Field(ge=0.0, le=4.0)]] = 1.3
    """Order n has amplitude_um n^-exponent."""
    spread: Listed[Annotated[float, Field(ge=0.0, le=2.0)]] = 0.4
    """Standard deviation of the logarithm of an amplitude, each wheel's and order's by itself."""
    orders: Listed[Annotated[int, Field(ge=1, le=60)]] = 20
    """Highest order."""


class FlexibleTrackPart(Part):
    """``[vibration.track]``: mass, stiffness and damping of the rail under one wheel; off, it is rigid."""

    on: Listed[bool] = True
    """False makes it rigid."""
    mass_kg: Listed[Annotated[float, Field(gt=0.0, le=1e4)]] = 150.0
    """Mass of the rail that moves under one wheel, kg."""
    stiffness_npm: Listed[Annotated[float, Field(gt=0.0, le=1e10)]] = 7.0e7
    """Stiffness below it, N/m."""
    damping_nspm: Listed[Annotated[float, Field(ge=0.0, le=1e7)]] = 1.0e5
    """Damping below it, N s/m."""


class BendingPart(Part):
    """``[vibration.bending]``: first vertical bending of car bodies."""

    on: Listed[bool] = True
    """False switches this source off."""
    frequency_hz: Listed[Annotated[float, Field(gt=1.0, le=100.0)]] = 10.0
    """Natural frequency, Hz."""
    damping_ratio: Listed[Annotated[float, Field(gt=0.0, lt=1.0)]] = 0.02
    """Share of critical damping."""


class StructureBornePart(Part):
    """``[vibration.structure_borne]``: share of the frames' vertical motion that reaches the floor."""

    on: Listed[bool] = True
    """False switches this source off."""
    share: Listed[Share] = 0.02
    """Share of the vertical motion of what carries a body that its floor has besides its own."""


class EquipmentPart(Part):
    """``[vibration.equipment]``: equipment under the floor: lines of half the power, noise of the rest."""

    on: Listed[bool] = True
    """False switches this source off."""
    rms_mps2: Listed[Acceleration] = 0.03
    """Root mean square on the floor, m/s2."""
    lines_hz: tuple[Frequency, ...] = (24.6, 49.2, 98.4)
    """Frequencies of its lines, which have half of the power, Hz."""
    band_hz: tuple[Frequency, Frequency] = (15.0, 180.0)
    """Band of the noise that has the rest, Hz."""


class TractionPart(Part):
    """``[vibration.traction]``: noise of motors and gears, rms ``share`` of the acceleration along."""

    on: Listed[bool] = True
    """False switches this source off."""
    share: Listed[Share] = 0.04
    """Vertical root mean square over the acceleration along the track."""
    band_hz: tuple[Frequency, Frequency] = (30.0, 180.0)
    """Band of the noise, Hz."""


class PassengersPart(Part):
    """``[vibration.passengers]``: doors and passengers, while the train stands."""

    on: Listed[bool] = True
    """False switches this source off."""
    rms_mps2: Listed[Acceleration] = 0.0125
    """Vertical root mean square while the train stands, m/s2."""
    band_hz: tuple[Frequency, Frequency] = (0.5, 4.0)
    """Band of the noise, Hz."""


class VibrationPart(Part):
    """``[vibration]``: what shakes the vehicle beyond what its multibody ride sees. Without it, nothing does.

    ``off = true`` is an ablation: the same ride in silence. ``join = true`` scales the roughness so that it
    meets the spectrum of ``[irregularity]`` at its shortest wave. ``lateral_creep = true`` lets axles sway
    and yaw in the creep of their contacts, as at the mean speed of the ride; it is refused for a vehicle with
    independent wheels whose axles nothing holds in yaw, such as ``irw_car``.
    """

    off: Listed[bool] = False
    """True is an ablation: the same ride in silence."""
    rate_hz: Listed[Annotated[float, Field(ge=500.0, le=8000.0)]] = 2000.0
    """Rate at which the short waves are worked out, Hz; a whole multiple of that of the truth."""
    join: Listed[bool] = False
    """Scale the roughness so that it meets the spectrum of [irregularity] at its shortest wave."""
    lateral_creep: Listed[bool] = False
    """Let axles sway and yaw in the creep of their contacts."""
    roughness: RoughnessPart = RoughnessPart()
    """Roughness of rails and wheels."""
    section_gain: SectionGainPart = SectionGainPart()
    """Sections of the line are rougher and smoother."""
    welds: DipsPart = DipsPart()
    """Dips at welds."""
    joints: DipsPart = DipsPart(on=False, spacing_m=36.0, depth_mm=0.5, depth_sd_mm=0.25)
    """Dips at joints."""
    sleepers: SleepersPart = SleepersPart()
    """Passing over sleepers."""
    corrugation: CorrugationPart = CorrugationPart()
    """Corrugation of the inner rail in curves."""
    wheels: WheelsPart = WheelsPart()
    """Wheels out of round."""
    track: FlexibleTrackPart = FlexibleTrackPart()
    """The track gives under each wheel."""
    bending: BendingPart = BendingPart()
    """First vertical bending of car bodies."""
    structure_borne: StructureBornePart = StructureBornePart()
    """What of the frames' motion reaches the floor."""
    equipment: EquipmentPart = EquipmentPart()
    """Equipment under the floor."""
    traction: TractionPart = TractionPart()
    """Motors and gears."""
    passengers: PassengersPart = PassengersPart()
    """Doors and passengers at stops."""

    @model_validator(mode="after")
    def _bands_in_order(self) -> VibrationPart:
        for name in ("equipment", "traction", "passengers"):
            low, high = getattr(self, name).band_hz
            if not low < high:
                raise InputError(
                    "is not a band",
                    field=f"{name}.band_hz",
                    value=[low, high],
                    limit="lowest < highest frequency",
                    remedy="mend the order",
                )
        return self

    def long_wave_gain(self) -> SectionGain | None:
        """Gain by sections of what ``[irregularity]`` draws; it is there also where the rest is off."""
        part = self.section_gain
        return SectionGain(part.long_waves_sd, part.lengths_m) if part.on and part.long_waves_sd else None

    def vibration(self, longest_m: float, offset_db: float) -> Vibration | None:
        """What shakes, in SI; None if it is off.

        Parameters
        ----------
        longest_m : float
            Longest wave of the roughness.
        offset_db : float
            Added to the roughness besides its own offset.
        """
        if self.off:
            return None
        return Vibration(
            rails=self._rails(longest_m, offset_db),
            wheels=OutOfRound(
                1e-6 * self.wheels.amplitude_um, self.wheels.exponent, self.wheels.spread, self.wheels.orders
            )
            if self.wheels.on
            else None,
            support=TrackSupport(self.track.mass_kg, self.track.stiffness_npm, self.track.damping_nspm)
            if self.track.on
            else None,
            bending=CarBending(self.bending.frequency_hz, self.bending.damping_ratio)
            if self.bending.on
            else None,
            structure_borne=self.structure_borne.share if self.structure_borne.on else 0.0,
            equipment=Equipment(self.equipment.rms_mps2, self.equipment.lines_hz, self.equipment.band_hz)
            if self.equipment.on
            else None,
            traction=Traction(self.traction.share, self.traction.band_hz) if self.traction.on else None,
            passengers=Passengers(self.passengers.rms_mps2, self.passengers.band_hz)
            if self.passengers.on
            else None,
            rate_hz=self.rate_hz,
            lateral_creep=self.lateral_creep,
        )

    def _rails(self, longest_m: float, offset_db: float) -> RailSources:
        rough, gain, sleepers, wave = self.roughness, self.section_gain, self.sleepers, self.corrugation
        drawn = Roughness(rough.levels(), rough.offset_db + offset_db, longest_m, rough.shortest_m)
        return RailSources(
            roughness=drawn if rough.on else None,
            welds=self.welds.dips(),
            joints=self.joints.dips(),
            sleepers=SleeperPassing(
                sleepers.spacing_m, sleepers.spacing_sd, 1e-6 * sleepers.amplitude_um, sleepers.amplitude_sd
            )
            if sleepers.on
            else None,
            corrugation=Corrugation(wave.wavelength_m, 1e-6 * wave.amplitude_um, wave.radius_m)
            if wave.on
            else None,
            section_gain=SectionGain(gain.sd, gain.lengths_m) if gain.on and rough.on else None,
        )
