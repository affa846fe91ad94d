"""From a scenario's words to the nouns of the testbed: track, vehicle, ride, mount, grade, estimator.

Each noun is made for one cell, and every fault is an `InputError` that names the field of
the scenario, or the file of the part and its field. Nothing is simulated here.
"""

from __future__ import annotations

import dataclasses
import difflib
import hashlib
import json
from math import radians
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.errors import PydanticUserError

from simrail.bands import BANDS, Band
from simrail.errors import InputError
from simrail.estimate import Estimator, estimator_class
from simrail.own_files import load_own
from simrail.profile import SpeedProfile
from simrail.ride import Ride, rails_of
from simrail.scenario.cells import Cell, Method
from simrail.scenario.files import Part, blame, load
from simrail.scenario.imu_file import ImuFile
from simrail.scenario.scenario import Scenario
from simrail.scenario.track_file import TrackFile
from simrail.scenario.vehicle_file import VehicleFile
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.grades import ImuGrade
from simrail.sensors.imu import EarthRate
from simrail.sensors.imu_response import Temperature
from simrail.sensors.magnetometer import MagnetometerSpec
from simrail.sensors.rail_sensor import RailSensorSpec
from simrail.track.design import TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid import LaidTrack
from simrail.track.rail_condition import FRICTION, RailCondition
from simrail.truth import Mount
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.profile_files import profiles_digest

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


def bands_of(cell: Cell) -> tuple[Band, ...]:
    """Wavelength bands that the rail geometry of a cell is scored in."""
    part = cell.spec.geometry
    own = (Band(name, *wavelengths) for name, wavelengths in part.own_bands.items())
    return (*(BANDS[name] for name in part.bands), *own)


def earth_of(cell: Cell) -> EarthRate | None:
    """Rotation of the Earth in a cell; None for an Earth at rest."""
    part = cell.spec.earth
    return None if part is None else EarthRate(radians(part.latitude_deg), radians(part.x_axis_deg))


def temperature_of(cell: Cell) -> Temperature | None:
    """Temperature of the IMU of a cell; None for that of its calibration."""
    part = cell.spec.temperature
    return None if part is None else Temperature(part.start_c, part.ambient_c, part.time_constant_s)


def estimator_of(scenario: Scenario, method: Method) -> Estimator:
    """Make an estimator from its class and the options of the scenario.

    Raises
    ------
    InputError
        If no such estimator is registered, it has no such option (the message lists those that it
        has), or an option has a value that it cannot have.
    """
    field = f"estimator[{method.index}]"
    with blame(scenario.file, f"{field}.method"):
        known_class = class_named(method.part.method, scenario.folder)
    with blame(scenario.file, f"{field}.options"):
        estimator = construct(known_class, method.part.options)
        if getattr(estimator, "magnetometer", False) is True and scenario.spec.magnetometer is None:
            raise InputError(
                "the scenario has no magnetometer",
                field="magnetometer",
                value=True,
                remedy="add a [magnetometer] to the scenario, or set magnetometer = false",
            )
        return estimator


def class_named(name: str, folder: Path | None) -> type[Estimator]:
    """Class of a method: a registered name, or ``"file.py:Class"`` for one's own file."""
    path_name, colon, class_name = name.rpartition(":")
    if not colon or not path_name.endswith(".py"):
        return estimator_class(name)
    candidates = [*([folder / path_name] if folder else []), Path(path_name)]
    path = next((candidate for candidate in candidates if candidate.is_file()), None)
    if path is None:
        raise InputError(
            "no such file", value=path_name, remedy="mend the path; it is seen from the scenario's folder"
        )
    found = getattr(load_own(path, shown=path_name), class_name, None)
    if not isinstance(found, type) or not callable(getattr(found, "estimate", None)):
        raise InputError(
            "the file has no such estimator class",
            value=class_name,
            limit="a class with a method estimate(recording)",
            remedy="see 'simrail new estimator NAME'",
        )
    own: type[Estimator] = found
    return own


def construct(known_class: type[Estimator], options: dict[str, Any]) -> Estimator:
    """Make an estimator from its options, each judged against the type that its class declares."""
    if not dataclasses.is_dataclass(known_class):
        raise InputError(
            "is no dataclass, so its options cannot be judged",
            value=known_class.__qualname__,
            remedy="make the estimator a frozen dataclass, as in 'simrail new estimator'",
        )
    known = {entry.name for entry in dataclasses.fields(known_class) if entry.init and entry.name != "causal"}
    types = get_type_hints(known_class)
    values: dict[str, Any] = {}
    for name, value in options.items():
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            raise InputError(
                f"{known_class.__name__} has no such option",
                field=name,
                value=value,
                limit="one of " + ", ".join(sorted(known)) if known else "it has no options",
                remedy=f"did you mean {near[0]}?" if near else "remove it",
            )
        values[name] = _option(types.get(name, Any), name, value)
    try:
        made: Estimator = known_class(**values)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        raise InputError(f"{known_class.__name__} refuses them: {error}", value=options) from error
    return made


def _option(kind: Any, name: str, value: Any) -> Any:
    """Judge one option against the type that the class declares for it; tuples may be given as arrays."""
    if isinstance(value, list):
        value = tuple(tuple(item) if isinstance(item, list) else item for item in value)
    try:
        adapter = TypeAdapter(kind, config=ConfigDict(strict=True, allow_inf_nan=False))
    except PydanticUserError:
        return value
    try:
        return adapter.validate_python(value)
    except ValidationError as error:
        first = error.errors()[0]
        raise InputError(
            "has the wrong type or value",
            field=name,
            value=value,
            limit=first["msg"].removeprefix("Input should be "),
        ) from None
