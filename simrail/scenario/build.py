"""From a scenario's words to the nouns of the testbed: track, vehicle, ride, mount, sensors.

Each cell is resolved once (`Parts.resolve`), and what is judged is what is run: checks, campaign, export and
tuning take the same `ResolvedCell`. Every fault is an `InputError` that names the field of the scenario,
or the file of the part and its field. Nothing is simulated here. Estimators are made in
`simrail.scenario.build_estimator`.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import radians
from pathlib import Path
from typing import Any, TypeVar

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame, load
from simrail.estimation.estimate import Estimator
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuFile
from simrail.recording.sheets.vehicle_sheet import VehicleSheet
from simrail.ride.ride import Kept, Ride, rails_of
from simrail.ride.truth import Mount
from simrail.ride.vibration.sources import Vibration
from simrail.scenario.axes import each
from simrail.scenario.build_estimator import estimator_of, odometry_estimator, option_files
from simrail.scenario.cells import Cell, methods
from simrail.scenario.distributions import distributions_of
from simrail.scenario.imu_tables import ImuPart
from simrail.scenario.line_tables import IrregularityPart
from simrail.scenario.measured_file import read_measured
from simrail.scenario.ride_tables import RidePart
from simrail.scenario.scenario import Scenario, ScenarioFile
from simrail.scenario.vibration_tables import VibrationPart
from simrail.sensors.drawing import drawing
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.gnss import GnssSpec
from simrail.sensors.imu import EarthRate
from simrail.sensors.imu_response import Temperature
from simrail.sensors.magnetometer import MagnetometerSpec
from simrail.sensors.rail_sensor import RailSensorSpec
from simrail.sensors.second_imu import SecondImuSpec
from simrail.track.bands import BANDS, Band
from simrail.track.design import TrackDesign
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.join import longest_short_wave_m, step_db
from simrail.track.laid_track import LaidTrack
from simrail.track.map_errors import EXACT, MapErrors, draw_map
from simrail.track.quality import Limits
from simrail.track.rail_condition import FRICTION, RailCondition
from simrail.vehicle.contact.profile_files import profiles_digest
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import Coasting, Restriction, Run, SpeedProfile

_Part = TypeVar("_Part", bound=Part)
_Noun = TypeVar("_Noun")

NO_IRREGULARITY = Irregularity(spectrum="none", fade_m=0.0)

LONG_RIDE_S = 1800.0
"""Of a ride that takes longer only what the scenario asks for is kept: another body asks for another ride."""

_MOST_RESOLVED = 1000
"""Resolved cells that are remembered; cells come ride by ride, and draws of the sensors share one."""


_MOST_MAPS = 16
"""Drawn maps that are remembered."""


@dataclass(frozen=True)
class ResolvedCell:
    """A cell and the nouns that its words stand for.

    Attributes
    ----------
    cell : Cell
        The words, and its place among the others.
    ride : Ride
        All that decides the motion; shared by the cells of a ride.
    drawn_vehicle : VehicleModel
        The vehicle as the train believes it to be; that of the ride may differ by factors.
    mount : Mount
        Where the IMU sits.
    grade : ImuGrade
        The IMU.
    encoder, magnetometer, rail_sensor : EncoderSpec, MagnetometerSpec, RailSensorSpec, optional
        The other sensors; None where the scenario has none.
    second_imu : SecondImuSpec, optional
        The IMU on another bogie, likewise.
    gnss : GnssSpec, optional
        The satellite receiver, likewise.
    earth_rate : EarthRate, optional
        Rotation of the Earth; None for an Earth at rest.
    temperature : Temperature, optional
        Temperature of the IMU; None for that of its calibration.
    track_map : TrackDesign, optional
        The map that the train carries; None for an exact one.
    map_errors : MapErrors
        How wrong it may be.
    odometry : Estimator, optional
        The odometry that is run on the recording; None where there is none to be run.
    bands : tuple of Band
        Wavelength bands that rail geometry is scored in.
    """

    cell: Cell
    ride: Ride
    drawn_vehicle: VehicleModel
    mount: Mount
    grade: ImuGrade
    encoder: EncoderSpec | None
    magnetometer: MagnetometerSpec | None
    rail_sensor: RailSensorSpec | None
    second_imu: SecondImuSpec | None
    gnss: GnssSpec | None
    earth_rate: EarthRate | None
    temperature: Temperature | None
    track_map: TrackDesign | None
    map_errors: MapErrors
    odometry: Estimator | None
    bands: tuple[Band, ...]

    @property
    def vehicle_sheet(self) -> VehicleSheet:
        """The vehicle's drawing, as the train knows it."""
        return drawing(self.drawn_vehicle, each_by_itself=self.ride.engine == "kinematic")


class Parts:
    """The parts that a scenario names, each file read once, and the nouns of its cells.

    Parameters
    ----------
    scenario : Scenario
        Whose parts; relative paths are looked for in its folder first.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self._nouns: dict[tuple[str, str], Any] = {}
        self._estimators: dict[int, dict[str, Estimator]] = {}
        self._tunings: dict[int, dict[str, str]] = {}
        self._resolved: dict[tuple[int, ...], ResolvedCell] = {}
        self._rides: dict[tuple[int, ...], Ride] = {}
        self._maps: dict[tuple[str, str, int, int], TrackDesign] = {}
        self._laid: tuple[Ride, LaidTrack] | None = None
        self._content: dict[str, Any] = {"scenario": scenario.spec.model_dump(mode="json", warnings=False)}

    def __getstate__(self) -> dict[str, Any]:
        """What was read, for another process: cells are resolved, and rails laid, faster than sent."""
        return {**self.__dict__, "_laid": None, "_resolved": {}, "_rides": {}, "_maps": {}}

    @property
    def hash(self) -> str:
        """SHA-256 over the content of the scenario and of the parts read so far, 16 digits.

        Comments and the order of keys do not count; settings of the command line do.
        """
        text = json.dumps(self._content, sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def resolve(self, cell: Cell) -> ResolvedCell:
        """The nouns of a cell.

        Raises
        ------
        InputError
            If a file that it names is missing or faulty, or a sensor cannot be as its words say.
        """
        # All but the draw of the sensors is in the case, the sample and the draw of the track.
        key = (cell.case, cell.sample, cell.track_draw, cell.map_draw, len(cell.passes))
        if key not in self._resolved:
            if len(self._resolved) >= _MOST_RESOLVED:
                self._resolved.clear()
            self._resolved[key] = self._resolve(cell)
        resolved = self._resolved[key]
        return resolved if resolved.cell is cell else replace(resolved, cell=cell)

    def _resolve(self, cell: Cell) -> ResolvedCell:
        spec = cell.spec
        earth, temperature = spec.earth, spec.temperature
        bands = bands_by_name(spec)
        return ResolvedCell(
            cell=cell,
            ride=self.ride(cell),
            drawn_vehicle=self.drawn_vehicle(cell),
            mount=_mount(cell.imu),
            grade=self.grade(cell),
            encoder=None if spec.encoder is None else spec.encoder.spec(),
            # Steel stands where the seed of the track puts it.
            magnetometer=None if spec.magnetometer is None else spec.magnetometer.spec(cell.ride_seed),
            rail_sensor=None if spec.rail_sensor is None else spec.rail_sensor.spec(),
            second_imu=self.second_imu(cell),
            gnss=None if spec.gnss is None else spec.gnss.spec(),
            earth_rate=None
            if earth is None
            else EarthRate(radians(earth.latitude_deg), radians(earth.x_axis_deg)),
            track_map=self.track_map(cell),
            map_errors=EXACT if spec.map is None else spec.map.errors(),
            odometry=self.odometry(cell),
            temperature=None
            if temperature is None
            else Temperature(temperature.start_c, temperature.ambient_c, temperature.time_constant_s),
            bands=tuple(bands[name] for name in (*spec.geometry.bands, *spec.geometry.own_bands)),
        )

    def ride(self, cell: Cell) -> Ride:
        """Ride of a cell: all that decides the motion."""
        # Samples of a design that have the same ride share its number.
        key = (cell.ride_number, 0 if cell.shares_seeds else cell.sample, cell.track_draw)
        if key not in self._rides:
            if len(self._rides) >= _MOST_RESOLVED:
                self._rides.clear()
            spec, vehicle, profile = cell.spec, self.vehicle(cell), _profile(cell.ride)
            rough, shaken = spec.irregularity, spec.vibration
            irregularity = NO_IRREGULARITY if rough is None else self._irregularity(rough, cell)
            if shaken is not None:
                irregularity = replace(irregularity, section_gain=shaken.long_wave_gain())
            self._rides[key] = Ride(
                name=cell.ride.name,
                track=self.track(cell),
                irregularity=irregularity,
                track_seed=cell.ride_seed,
                vehicle=vehicle,
                profile=profile,
                engine=spec.engine,
                step_s=spec.step_s,
                rate_hz=spec.truth_rate_hz,
                drive=cell.ride.drive,
                conditions=_conditions(spec, vehicle),
                contact_rate_hz=contact_rate_hz(spec),
                kept=self._kept(cell, vehicle, profile),
                vibration=None if shaken is None else _vibration(shaken, irregularity),
            )
        return self._rides[key]

    def _kept(self, cell: Cell, vehicle: VehicleModel, profile: SpeedProfile) -> Kept | None:
        """What of a ride is kept: of a long one, bodies with an IMU and the wheel of the encoder.

        Short waves come from every wheel by its angle. In silence as many are kept: it is the same ride.
        """
        try:
            duration_s = profile.duration_s
        except InputError:  # `simrail.scenario.check_ride` says what is wrong with it
            return None
        if duration_s <= LONG_RIDE_S or cell.ride.kick_end_m is not None:
            return None
        spec = self.scenario.spec
        bodies = {str(body) for part in spec.imu if part.is_on(cell.spec.vehicle) for body in each(part.body)}
        if spec.second_imu is not None:
            bodies |= {str(body) for body in each(spec.second_imu.body)}
        places = {str(place) for place in each(spec.encoder.wheel)} if spec.encoder is not None else set()
        wheels = {vehicle.wheel_at(place, direction=profile.direction) for place in places}
        if cell.spec.vibration is not None:
            wheels = set(vehicle.wheel_names)
        return Kept(tuple(sorted(bodies)), tuple(sorted(wheels)))

    def _irregularity(self, part: IrregularityPart, cell: Cell) -> Irregularity:
        """Irregularity of a cell; a file of measured rails is read once."""
        with blame(self.scenario.file, "irregularity"):
            part = part.with_file(self.scenario.folder, start_m=lambda: self.track(cell).start_m)
        if part.measured is None:
            return part.irregularity(None, folder=self.scenario.folder)
        key = ("measured", part.measured.model_dump_json())
        if key not in self._nouns:
            with blame(self.scenario.file):
                self._nouns[key] = read_measured(part.measured, self.scenario.folder)
            self._content[" ".join(key)] = self._nouns[key].digest
        return part.irregularity(self._nouns[key], folder=self.scenario.folder)

    def rails(self, cell: Cell) -> LaidTrack:
        """The rails of a cell's ride; the last ones are remembered, since cells come ride by ride."""
        ride = self.ride(cell)
        if self._laid is None or self._laid[0] is not ride:
            self._laid = ride, rails_of(ride)
        return self._laid[1]

    def track(self, cell: Cell) -> TrackDesign:
        """Design track of a cell."""
        return self._noun("track", TrackFile, cell.spec.track, "track", TrackFile.design)

    def track_map(self, cell: Cell) -> TrackDesign | None:
        """The map that the train of a cell carries; None for an exact one."""
        part = cell.spec.map
        if part is None or part.exact:
            return None
        # Many samples of a design have one map.
        key = (cell.spec.track, part.model_dump_json(), cell.map_seed, cell.map_draw)
        if key not in self._maps:
            if len(self._maps) >= _MOST_MAPS:
                self._maps.clear()
            with blame(self.scenario.file, "map"):
                self._maps[key] = draw_map(
                    self.track(cell),
                    part.errors(),
                    seed=cell.map_seed,
                    draw=cell.map_draw,
                    defects=part.defects(),
                )
        return self._maps[key]

    def vehicle(self, cell: Cell) -> VehicleModel:
        """Vehicle of a cell, as it runs."""
        part, name = cell.spec.vehicle_factors, cell.spec.vehicle
        if part is None:
            return self.drawn_vehicle(cell)
        key = "vehicle", f"{name} {part.model_dump_json()}"
        if key not in self._nouns:
            self._nouns[key] = part.factors().of(self.drawn_vehicle(cell))
        vehicle: VehicleModel = self._nouns[key]
        return vehicle

    def drawn_vehicle(self, cell: Cell) -> VehicleModel:
        """Vehicle of a cell, as its drawing has it."""
        name = cell.spec.vehicle
        vehicle = self._noun("vehicle", VehicleFile, name, "vehicle", VehicleFile.model)
        if f"profiles {name}" not in self._content:
            self._content[f"profiles {name}"] = profiles_digest(vehicle.wheel_rail)
        return vehicle

    def grade(self, cell: Cell) -> ImuGrade:
        """IMU grade of a cell, with the figures that the scenario puts in the place of its own."""
        field = f"imu[{cell.imu_index}]"
        grade = self._noun("imu", ImuFile, cell.imu.grade, f"{field}.grade", ImuFile.grade)
        figures = cell.imu.sheet.figures() if cell.imu.sheet is not None else {}
        if not figures:
            return grade
        file = self._noun("imu", ImuFile, cell.imu.grade, f"{field}.grade", _as_it_is, noun="imu file")
        with blame(self.scenario.file, f"{field}.sheet"):
            return file.with_figures(figures).grade(grade.name)

    def second_imu(self, cell: Cell) -> SecondImuSpec | None:
        """The second IMU of a cell, of the grade of its IMU unless it has its own."""
        part = cell.spec.second_imu
        if part is None:
            return None
        if part.grade is None:
            return part.spec(self.grade(cell))
        return part.spec(self._noun("imu", ImuFile, str(part.grade), "second_imu.grade", ImuFile.grade))

    def _noun(
        self,
        kind: str,
        model: type[_Part],
        name: str,
        field: str,
        make: Callable[[_Part, str], _Noun],
        *,
        noun: str = "",
    ) -> _Noun:
        """What a file of a kind stands for, read once; ``field`` is where the scenario names it."""
        key = (noun or kind, name)
        if key not in self._nouns:
            with blame(self.scenario.file, field):
                part = load(model, kind, name, folder=self.scenario.folder)
                self._content[f"{kind} {name}"] = part.model_dump(mode="json")
                self._nouns[key] = make(part, Path(name).stem)
        made: _Noun = self._nouns[key]
        return made

    def odometry(self, cell: Cell) -> Estimator | None:
        """Odometry of a cell; None where there is none to be run (`odometry_estimator`)."""
        name = cell.spec.odometry
        if ("odometry", name) not in self._nouns:
            self._nouns["odometry", name] = odometry_estimator(self.scenario, name)
        odometry: Estimator | None = self._nouns["odometry", name]
        return odometry

    def odometries(self) -> dict[str, Estimator]:
        """Odometries of the cells asked for so far, by the names that the scenario gives them."""
        nouns = self._nouns.items()
        return {name: noun for (kind, name), noun in nouns if kind == "odometry" and noun is not None}

    def tunings(self, sample: int) -> dict[str, str]:
        """How each estimator of a sample is tuned, by its name in the tables."""
        sample = sample if self.draws_estimators else 0
        self.estimators(sample)
        return self._tunings[sample]

    @property
    def time_limits_s(self) -> dict[str, float]:
        """How long an estimator may take for a recording, by name in the tables; of those with a limit."""
        usual = self.scenario.spec.time_limit_s
        limits = {method.name: method.part.time_limit_s or usual for method in methods(self.scenario)}
        return {name: limit for name, limit in limits.items() if limit is not None}

    @property
    def memory_limits_mb(self) -> dict[str, float]:
        """How much memory an estimator may take, by name in the tables; of those with a limit."""
        usual = self.scenario.spec.memory_limit_mb
        limits = {method.name: method.part.memory_limit_mb or usual for method in methods(self.scenario)}
        return {name: limit for name, limit in limits.items() if limit is not None}

    @property
    def draws_estimators(self) -> bool:
        """Whether an option of an estimator is a distribution."""
        return any(distributions_of(part) for part in self.scenario.spec.estimator)

    def estimators(self, sample: int) -> dict[str, Estimator]:
        """Estimators of a sample by their names in the tables; those that no sample changes are shared."""
        sample = sample if self.draws_estimators else 0
        if sample in self._estimators:
            return self._estimators[sample]
        estimators: dict[str, Estimator] = {}
        first = self._estimators.get(0, {})
        listed = methods(self.scenario, sample=sample)
        for method in listed:
            is_drawn = bool(distributions_of(self.scenario.spec.estimator[method.index]))
            if method.name in estimators:
                raise InputError(
                    "two estimators have this name",
                    file=self.scenario.file,
                    field=f"estimator[{method.index}].name",
                    value=method.name,
                    remedy="give each a name of its own",
                    limit="each name once",
                )
            shared = None if is_drawn else first.get(method.name)
            estimators[method.name] = shared or estimator_of(self.scenario, method)
            for option, content in option_files(estimators[method.name]).items():
                # What is in the files that its options name counts as the scenario's.
                self._content[f"estimator {method.name} {option} {sample}"] = content
        self._estimators[sample] = estimators
        self._tunings[sample] = {method.name: method.tuning for method in listed}
        return estimators


def _as_it_is(part: _Part, _name: str) -> _Part:
    """A file's content itself."""
    return part


def _profile(ride: RidePart) -> SpeedProfile:
    """Speed profile of a ride."""
    return SpeedProfile(
        start_m=ride.start_m,
        end_m=ride.ends_m[0] if ride.ends_m else ride.start_m,
        speed_mps=0.0 if ride.speed_kmh is None else ride.speed_kmh / 3.6,
        acceleration_mps2=ride.acceleration_mps2,
        jerk_mps3=ride.jerk_mps3,
        rest_s=ride.rest_s,
        final_rest_s=ride.final_rest_s,
        stops=tuple((stop.position_m, stop.dwell_s) for stop in ride.stops),
        runs=tuple(Run(after.end_m, before.turn_s or 0.0) for before, after in pairwise(ride.runs)),
        braking_mps2=ride.braking_mps2,
        restrictions=tuple(
            Restriction(part.start_m, part.end_m, part.speed_kmh / 3.6) for part in ride.restriction
        ),
        coasting=None
        if ride.coasting is None
        else Coasting(ride.coasting.deceleration_mps2, ride.coasting.least_kmh / 3.6),
    )


def _vibration(part: VibrationPart, irregularity: Irregularity) -> Vibration | None:
    """What shakes a ride: its roughness begins where the irregularity ends, and meets it if it is to."""
    table = part.roughness.levels()
    step = step_db(irregularity, table, offset_db=part.roughness.offset_db) if part.join else None
    return part.vibration(longest_short_wave_m(irregularity, table), -step if step is not None else 0.0)


def _conditions(spec: ScenarioFile, vehicle: VehicleModel) -> tuple[RailCondition, ...]:
    """What lies on the rails; a coefficient counts in relation to the vehicle's own."""
    clean = vehicle.wheel_rail.friction
    return tuple(
        RailCondition(
            start_m=part.start_m,
            end_m=part.end_m,
            factor=(part.friction or FRICTION.get(part.condition or "dry", clean)) / clean,
            rails=part.rails,
        )
        for part in spec.rail_condition
    )


def _mount(imu: ImuPart) -> Mount:
    """Where an IMU sits."""
    return Mount(
        name=imu.name,
        body=imu.body,
        position_m=imu.position_m,
        roll_rad=radians(imu.roll_deg),
        pitch_rad=radians(imu.pitch_deg),
        yaw_rad=radians(imu.yaw_deg),
    )


def contact_rate_hz(spec: ScenarioFile) -> float:
    """Rate at which contact forces are kept; that of the truth if they are scored and it is not given."""
    if spec.running_safety is None or spec.contact_rate_hz > 0.0:
        return spec.contact_rate_hz
    return float(spec.truth_rate_hz)


def bands_by_name(spec: ScenarioFile) -> dict[str, Band]:
    """Every wavelength band that a scenario can speak of: the standard's, and its own."""
    own = spec.geometry.own_bands.items()
    return {**BANDS, **{name: Band(name, *wavelengths) for name, wavelengths in own}}


def limits_of(spec: ScenarioFile) -> dict[str, Limits]:
    """Limits of rail geometry, m."""
    return {
        name: Limits(
            sd_m=None if part.sd_mm is None else 1e-3 * part.sd_mm,
            defect_m=None if part.defect_mm is None else 1e-3 * part.defect_mm,
        )
        for name, part in spec.geometry.limits.items()
    }


def goals_mm(spec: ScenarioFile) -> dict[str, float]:
    """What the errors of rail geometry in D1 are asked to be at most, sd."""
    limits = spec.geometry.limits.items()
    return {name: part.error_sd_mm for name, part in limits if part.error_sd_mm is not None}
