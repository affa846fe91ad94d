"""From a scenario's words to the nouns of the testbed: track, vehicle, ride, mount, grade.

Each noun is made for one cell, and every fault is an `InputError` that names the field of the scenario,
or the file of the part and its field. Nothing is simulated here. Estimators are made in
`simrail.scenario.build_estimator`.
"""

from __future__ import annotations

import hashlib
import json
from math import radians
from pathlib import Path
from typing import Any, TypeVar

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame, load
from simrail.estimation.estimate import Estimator
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import ImuFile
from simrail.ride.ride import Ride, rails_of
from simrail.ride.truth import Mount
from simrail.scenario.build_estimator import estimator_of, odometry_estimator, option_files
from simrail.scenario.cells import Cell, methods
from simrail.scenario.distributions import Distribution
from simrail.scenario.scenario import Scenario, ScenarioFile
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.imu import EarthRate
from simrail.sensors.imu_response import Temperature
from simrail.sensors.magnetometer import MagnetometerSpec
from simrail.sensors.rail_sensor import RailSensorSpec
from simrail.track.bands import BANDS, Band
from simrail.track.design import TrackDesign
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import LaidTrack
from simrail.track.quality import Limits
from simrail.track.rail_condition import FRICTION, RailCondition
from simrail.vehicle.contact.profile_files import profiles_digest
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

_Part = TypeVar("_Part", bound=Part)

NO_IRREGULARITY = Irregularity(spectrum="none", fade_m=0.0)


class Parts:
    """The parts that a scenario names, each file read once.

    Parameters
    ----------
    scenario : Scenario
        Whose parts; relative paths are looked for in its folder first.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self._read: dict[tuple[str, str], Any] = {}
        self._estimators: dict[int, dict[str, Estimator]] = {}
        self._laid: tuple[tuple[object, ...], LaidTrack] | None = None
        self._content: dict[str, Any] = {"scenario": scenario.spec.model_dump(mode="json", warnings=False)}

    def __getstate__(self) -> dict[str, Any]:
        """All but the rails, for another process: they are laid faster than sent."""
        return {**self.__dict__, "_laid": None}

    @property
    def hash(self) -> str:
        """SHA-256 over the content of the scenario and of the parts read so far, 16 digits.

        Comments and the order of keys do not count; settings of the command line do.
        """
        text = json.dumps(self._content, sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def track(self, cell: Cell) -> TrackDesign:
        """Design track of a cell."""
        name = cell.spec.track
        if ("track", name) not in self._read:
            with blame(self.scenario.file, "track"):
                part = self._load(TrackFile, "track", name)
            self._read["track", name] = part.design(Path(name).stem)
        found: TrackDesign = self._read["track", name]
        return found

    def vehicle(self, cell: Cell) -> VehicleModel:
        """Vehicle of a cell."""
        name = cell.spec.vehicle
        if ("vehicle", name) not in self._read:
            with blame(self.scenario.file, "vehicle"):
                part = self._load(VehicleFile, "vehicle", name)
            model = part.model(Path(name).stem)
            self._content[f"profiles {name}"] = profiles_digest(model.wheel_rail)
            self._read["vehicle", name] = model
        vehicle: VehicleModel = self._read["vehicle", name]
        return vehicle

    def grade(self, cell: Cell) -> ImuGrade:
        """IMU grade of a cell."""
        name = cell.imu.grade
        if ("imu", name) not in self._read:
            with blame(self.scenario.file, f"imu[{cell.imu_index}].grade"):
                part = self._load(ImuFile, "imu", name)
                self._read["imu", name] = part.grade(Path(name).stem)
        grade: ImuGrade = self._read["imu", name]
        return grade

    def estimators(self, sample: int) -> dict[str, Estimator]:
        """Estimators of a sample by their names in the tables; those that no sample changes are shared."""
        if sample not in self._estimators:
            made: dict[str, Estimator] = {}
            first = self._estimators.get(0, {})
            for method in methods(self.scenario, sample=sample):
                is_drawn = any(
                    isinstance(option, Distribution)
                    for option in self.scenario.spec.estimator[method.index].options.values()
                )
                if method.name in made:
                    raise InputError(
                        "two estimators have this name",
                        file=self.scenario.file,
                        field=f"estimator[{method.index}].name",
                        value=method.name,
                        remedy="give each a name of its own",
                    )
                known = None if is_drawn else first.get(method.name)
                made[method.name] = known or estimator_of(self.scenario, method)
                for option, content in option_files(made[method.name]).items():
                    # What is in the files that its options name counts as the scenario's.
                    self._content[f"estimator {method.name} {option} {sample}"] = content
            self._estimators[sample] = made
        return self._estimators[sample]

    def odometry(self, cell: Cell) -> Estimator | None:
        """Odometry of a cell; None where there is none to be run (`odometry_estimator`)."""
        name = cell.spec.odometry
        if ("odometry", name) not in self._read:
            self._read["odometry", name] = odometry_estimator(self.scenario, name)
        odometry: Estimator | None = self._read["odometry", name]
        return odometry

    def odometries(self) -> dict[str, Estimator]:
        """Odometries of the cells asked for so far, by the names that the scenario gives them."""
        made = {name: value for (kind, name), value in self._read.items() if kind == "odometry"}
        return {name: estimator for name, estimator in made.items() if estimator is not None}

    def _load(self, model: type[_Part], kind: str, name: str) -> _Part:
        part = load(model, kind, name, folder=self.scenario.folder)
        self._content[f"{kind} {name}"] = part.model_dump(mode="json")
        return part

    def ride(self, cell: Cell) -> Ride:
        """Ride of a cell: all that decides the motion."""
        return Ride(
            name=cell.ride.name,
            track=self.track(cell),
            irregularity=irregularity_of(cell),
            track_seed=cell.ride_seed,
            vehicle=self.vehicle(cell),
            profile=profile_of(cell),
            engine=cell.spec.engine,
            step_s=cell.spec.step_s,
            rate_hz=cell.spec.truth_rate_hz,
            drive=cell.ride.drive,
            conditions=conditions_of(cell, self.vehicle(cell)),
        )

    def rails(self, cell: Cell) -> LaidTrack:
        """The rails of a cell's ride; the last ones are remembered, since cells come ride by ride."""
        ride = self.ride(cell)
        key = (cell.spec.track, repr(ride.irregularity), ride.track_seed, repr(ride.conditions))
        if self._laid is None or self._laid[0] != key:
            self._laid = key, rails_of(ride)
        return self._laid[1]


def profile_of(cell: Cell) -> SpeedProfile:
    """Speed profile of a cell's ride."""
    ride = cell.ride
    return SpeedProfile(
        start_m=ride.start_m,
        end_m=ride.start_m if ride.end_m is None else ride.end_m,
        speed_mps=0.0 if ride.speed_kmh is None else ride.speed_kmh / 3.6,
        acceleration_mps2=ride.acceleration_mps2,
        jerk_mps3=ride.jerk_mps3,
        rest_s=ride.rest_s,
        final_rest_s=ride.final_rest_s,
        stops=tuple((stop.position_m, stop.dwell_s) for stop in ride.stops),
    )


def irregularity_of(cell: Cell) -> Irregularity:
    """How the rails of a cell deviate from the design; a spectrum ``"none"`` if the scenario names none."""
    part = cell.spec.irregularity
    if part is None:
        return NO_IRREGULARITY
    return Irregularity(
        spectrum=part.spectrum, wavelengths_m=part.wavelengths_m, fade_m=part.fade_m, scale=part.scale
    )


def conditions_of(cell: Cell, vehicle: VehicleModel) -> tuple[RailCondition, ...]:
    """What lies on the rails of a cell; a coefficient counts in relation to the vehicle's own."""
    clean = vehicle.wheel_rail.friction
    return tuple(
        RailCondition(
            start_m=part.start_m,
            end_m=part.end_m,
            factor=(part.friction or FRICTION.get(part.condition or "dry", clean)) / clean,
            rails=part.rails,
        )
        for part in cell.spec.rail_condition
    )


def mount_of(cell: Cell) -> Mount:
    """Where the IMU of a cell sits."""
    imu = cell.imu
    return Mount(
        name=imu.name,
        body=imu.body,
        position_m=imu.position_m,
        roll_rad=radians(imu.roll_deg),
        pitch_rad=radians(imu.pitch_deg),
        yaw_rad=radians(imu.yaw_deg),
    )


def encoder_of(cell: Cell) -> EncoderSpec | None:
    """Encoder of a cell, if its scenario has one."""
    part = cell.spec.encoder
    return None if part is None else part.spec()


def magnetometer_of(cell: Cell) -> MagnetometerSpec | None:
    """Magnetometer of a cell, if its scenario has one; steel stands where the seed of the track puts it."""
    part = cell.spec.magnetometer
    return None if part is None else part.spec(cell.ride_seed)


def rail_sensor_of(cell: Cell) -> RailSensorSpec | None:
    """Rail sensor of a cell, if its scenario has one."""
    part = cell.spec.rail_sensor
    return None if part is None else part.spec()


def bands_by_name(spec: ScenarioFile) -> dict[str, Band]:
    """Every wavelength band that a scenario can speak of: the standard's, and its own."""
    own = spec.geometry.own_bands.items()
    return {**BANDS, **{name: Band(name, *wavelengths) for name, wavelengths in own}}


def bands_of(cell: Cell) -> tuple[Band, ...]:
    """Wavelength bands that the rail geometry of a cell is scored in."""
    part, known = cell.spec.geometry, bands_by_name(cell.spec)
    return tuple(known[name] for name in (*part.bands, *part.own_bands))


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


def earth_of(cell: Cell) -> EarthRate | None:
    """Rotation of the Earth in a cell; None for an Earth at rest."""
    part = cell.spec.earth
    return None if part is None else EarthRate(radians(part.latitude_deg), radians(part.x_axis_deg))


def temperature_of(cell: Cell) -> Temperature | None:
    """Temperature of the IMU of a cell; None for that of its calibration."""
    part = cell.spec.temperature
    return None if part is None else Temperature(part.start_c, part.ambient_c, part.time_constant_s)
