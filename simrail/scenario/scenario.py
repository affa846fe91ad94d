"""What a person writes into a scenario file, as models; and the reading of it.

A `Scenario` is a name, the text it was read from, and a `ScenarioFile`: the judged content. Any
scalar may be a list (`simrail.scenario.axes`) or a distribution (`simrail.scenario.distributions`), so
one scenario is one ride or a whole campaign.
Only the form of each field is judged here; whether track, vehicle, rides and sensors fit each other
is judged by `simrail.scenario.check`, and what is run is listed by `simrail.scenario.cells`.
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from simrail.core.errors import InputError
from simrail.core.shown import Facts, Shown, names
from simrail.core.toml_files import Part, blame, find, judge, label, parse_toml, read_text, shipped_folder
from simrail.scenario.axes import Axis, Listed, axes_of, each
from simrail.scenario.distributions import Distribution, is_distribution, read_distribution
from simrail.scenario.imu_tables import EarthPart, ImuPart, TemperaturePart
from simrail.scenario.line_tables import IrregularityPart, MapPart
from simrail.scenario.overrides import override
from simrail.scenario.ride_tables import RailConditionPart, RidePart
from simrail.scenario.scoring_tables import GeometryPart, RideComfortPart, RunningSafetyPart, ScorePart
from simrail.scenario.sensor_tables import (
    EncoderPart,
    GnssPart,
    MagnetometerPart,
    RailSensorPart,
    SecondImuPart,
)
from simrail.scenario.study_tables import (
    EstimatorPart,
    MemoryLimit,
    MonteCarloPart,
    RequirePart,
    StopRulePart,
    TimeLimit,
)
from simrail.scenario.vehicle_tables import VehicleFactorsPart
from simrail.scenario.vibration_tables import VibrationPart


def ride_count(rides: Sequence[RidePart]) -> int:
    """Number of rides over a track: those of the tables, each for every combination of its lists."""
    return sum(prod(len(axis) for axis in axes_of(part).values()) for part in rides)


class ScenarioFile(Part):
    """The content of a scenario file.

    ``paper`` names the publication whose tables and figures the report sets beside the scenario's own.
    ``odometry`` names that which the estimators work with (`simrail.estimation.choose_odometry`); if it is
    not given, ``"curve_matched"`` with an ``[encoder]`` and ``"none"`` without. ``contact_rate_hz`` is the
    rate at which forces between wheels and rails are kept, ``truth_rate_hz`` over a whole number; 0 keeps
    none. ``passes`` is over how many of the rides the rails are fused
    (`simrail.estimators.rails.fuse`); a cell is then so many rides, and its scores are of the rails alone.
    ``time_limit_s`` and ``memory_limit_mb`` are those of every estimator which names none of its own.
    """

    title: str
    """One line: what is run, as pages and lists show it."""
    paper: Literal["briales_2021", "gonzalez_2023", "veillard_2016", "hidalgo"] | None = None
    """The publication whose tables and figures the page sets beside the scenario's own."""
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    """Root of all chance: the same seed gives the same rails, sensors and scores."""
    track: Listed[str]
    """A shipped track, or the path of a track file."""
    vehicle: Listed[str]
    """A shipped vehicle, or the path of a vehicle file."""
    vehicle_factors: VehicleFactorsPart | None = None
    """How the vehicle differs from its drawing."""
    engine: Listed[Literal["exudyn", "compiled", "kinematic"]] = "exudyn"
    """What moves the vehicle: Exudyn, our compiled integrator of the same equations, or, exactly on the
    rails and without dynamics, the kinematic one."""
    step_s: Listed[Annotated[float, Field(ge=1e-6, le=0.001)]] = 0.0005
    """Step of the integration, s; it divides 1 ms."""
    truth_rate_hz: Listed[Annotated[float, Field(ge=10.0, le=4000.0)]] = 1000.0
    """Rate at which the true motion is kept, Hz: 1000 over a whole number, 2000 or 4000."""
    contact_rate_hz: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.0
    """Rate at which forces between wheels and rails are kept, Hz; 0 keeps none."""
    monte_carlo: MonteCarloPart = MonteCarloPart()
    """How often chance is asked."""
    passes: Listed[Annotated[int, Field(ge=1, le=1000)]] | None = None
    """Over how many of the rides the rails are fused; scores are then of the rails alone."""
    odometry: Listed[str] = ""
    """The odometry that the methods work with, by its short name, class or file; with an [encoder]
    curve_matched if left out, else none."""
    time_limit_s: TimeLimit | None = None
    """Longest time of a method for a recording, s; one that takes longer is ended, and its row says so."""
    memory_limit_mb: MemoryLimit | None = None
    """Most memory of a method, MB, on Linux; one that asks for more is ended, and its row says so."""
    irregularity: IrregularityPart | None = None
    """How the rails deviate from the design; without it they do not."""
    vibration: VibrationPart | None = None
    """What shakes the vehicle beyond its multibody ride; without it, nothing."""
    map: MapPart | None = None
    """How the map that the train carries differs from what was laid; without it, not at all."""
    rail_condition: tuple[RailConditionPart, ...] = ()
    """What lies on the rails, stretch by stretch; dry without it."""
    ride: Annotated[list[RidePart], Field(min_length=1)]
    """The rides; at least one."""
    imu: Annotated[list[ImuPart], Field(min_length=1)]
    """The IMUs; at least one."""
    encoder: EncoderPart | None = None
    """A wheel encoder; without it the train has none."""
    magnetometer: MagnetometerPart | None = None
    """A magnetometer in the housing of each IMU; without it there is none."""
    rail_sensor: RailSensorPart | None = None
    """A sensor beside each IMU that sees both rails; without it there is none."""
    second_imu: SecondImuPart | None = None
    """An IMU on another bogie, recorded beside each of the others; without it there is none."""
    gnss: GnssPart | None = None
    """A satellite receiver; without it there is none."""
    earth: EarthPart | None = None
    """The Earth turns; without it, it is at rest."""
    temperature: TemperaturePart | None = None
    """Temperature of the IMUs; without it, that of their calibration."""
    estimator: Annotated[list[EstimatorPart], Field(min_length=1)]
    """The methods under test and their baselines; at least one."""
    score: ScorePart = ScorePart()
    """What of the score table is kept; everything without it."""
    require: tuple[RequirePart, ...] = ()
    """What is asked of an IMU: each has a verdict on the page."""
    stop: StopRulePart | None = None
    """When to draw no more; without it every draw is made."""
    geometry: GeometryPart = GeometryPart()
    """Wavelength bands and base of twist in which rails are scored."""
    running_safety: RunningSafetyPart | None = None
    """Score the forces between wheels and rails after EN 14363."""
    ride_comfort: RideComfortPart | None = None
    """Score N_MV (EN 12299) and Sperling's Wz where each IMU sits."""

    @field_validator("step_s")
    @classmethod
    def _divides_the_output(cls, value: float | Axis | Distribution) -> float | Axis | Distribution:
        for step in each(value):
            if abs(0.001 / float(step) - round(0.001 / float(step))) > 1e-6:
                limit, remedy = "0.001 s over a whole number", "try 0.0005"
                problem = "does not divide the output interval of 0.001 s"
                raise InputError(problem, value=step, limit=limit, remedy=remedy)
        return value

    @field_validator("truth_rate_hz")
    @classmethod
    def _whole_milliseconds(cls, value: float | Axis | Distribution) -> float | Axis | Distribution:
        for rate in each(value):
            if float(rate) in (2000.0, 4000.0):
                continue
            if abs(1000.0 / float(rate) - round(1000.0 / float(rate))) > 1e-9:
                limit = "1000 Hz divided by a whole number, 2000 or 4000 Hz"
                raise InputError("is no such rate", value=rate, limit=limit, remedy="try 250.0")
        return value

    @field_validator("ride", "imu", "estimator")
    @classmethod
    def _unique_names(cls, value: list[Any]) -> list[Any]:
        names = [(part.name, getattr(part, "vehicle", None)) for part in value]
        for name, vehicle in names:
            if names.count((name, vehicle)) > 1 or (vehicle and (name, None) in names):
                limit, remedy = "each name once", "give each a name of its own"
                problem = f"two of them are named {name!r}"
                raise InputError(problem, value=name, limit=limit, remedy=remedy)
        return value

    @model_validator(mode="after")
    def _has_rides_for_the_passes(self) -> "ScenarioFile":
        if self.passes is None:
            return self
        if isinstance(self.passes, Distribution):
            raise InputError(
                "is no number that chance decides",
                field="passes",
                value=self.passes.kind,
                limit="a whole number, or a list of them",
                remedy="write passes = [1, 2, 4]",
            )
        rides, most = ride_count(self.ride), max(each(self.passes))
        if most > rides:
            raise InputError(
                "are more passes than the scenario has rides",
                field="passes",
                value=most,
                limit=f"1 to {rides}, the [[ride]]s and the values of their lists",
                remedy="take fewer passes, list more ride.speed_kmh, or set ride.reverse = [false, true]",
            )
        return self

    @model_validator(mode="after")
    def _every_vehicle_has_an_imu(self) -> "ScenarioFile":
        vehicles = [str(vehicle) for vehicle in each(self.vehicle)]
        for i, part in enumerate(self.imu):
            if part.vehicle is not None and part.vehicle not in vehicles:
                raise InputError(
                    "is none of the scenario's",
                    field=f"imu[{i}].vehicle",
                    value=part.vehicle,
                    limit=f"one of {', '.join(vehicles)}",
                    remedy="choose one of them",
                )
        for vehicle in vehicles:
            if not any(part.is_on(vehicle) for part in self.imu):
                limit, remedy = "an imu on each vehicle", f"add an [[imu]] with vehicle = {vehicle!r}"
                problem = f"no imu is on {vehicle!r}"
                raise InputError(problem, value=vehicle, limit=limit, remedy=remedy)
        return self


@dataclass(frozen=True, repr=False)
class Scenario(Shown):
    """A scenario that has been read: its name, where it stood, its text and its content.

    Attributes
    ----------
    name : str
        Stem of the file; names the folder of the results.
    file : str
        How messages call the file.
    folder : Path, optional
        Where parts that are given by a relative path are looked for.
    text : str
        The file as it was written.
    overrides : tuple of str
        Settings of the command line, ``key=value``.
    spec : ScenarioFile
        The judged content, settings applied.
    """

    name: str
    file: str
    folder: Path | None
    text: str
    overrides: tuple[str, ...]
    spec: ScenarioFile

    def _facts(self) -> Facts:
        spec = self.spec
        facts = {
            "is": self.title,
            "rides": names(ride.name for ride in spec.ride) + f" on {names(each(spec.track))}",
            "vehicle": f"{names(each(spec.vehicle))} by the {names(each(spec.engine))} engine",
            "imus": names(imu.name for imu in spec.imu),
            "estimators": names(part.name for part in spec.estimator),
        }
        return self.name, facts

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return self.spec.title

    @property
    def own_files(self) -> tuple[str, ...]:
        """Python files that it names and that there are: estimators and odometries of a person's own."""
        named = [part.method for part in self.spec.estimator]
        named += [name for name in each(self.spec.odometry) if isinstance(name, str)]
        files = dict.fromkeys(name.partition(":")[0] for name in named if _is_own(name))
        return tuple(
            name for name in files if (self.folder and (self.folder / name).is_file()) or Path(name).is_file()
        )

    def without_own_files(self) -> "Scenario":
        """The scenario without what stands in Python files of a person's own.

        Raises
        ------
        InputError
            If nothing of it is left to be judged.
        """
        kept = [part for part in self.spec.estimator if not _is_own(part.method)]
        usual = [name for name in each(self.spec.odometry) if not _is_own(str(name))]
        if not kept or not usual:
            raise InputError(
                "has no method but those of its own files",
                file=self.file,
                field="estimator" if not kept else "odometry",
                value=", ".join(self.own_files),
                remedy="judge it with them, or name a shipped method beside them",
                limit="a shipped method, or --plugins",
            )
        odometry = self.spec.odometry if len(usual) == len(each(self.spec.odometry)) else Axis(usual)
        spec = self.spec.model_copy(update={"estimator": kept, "odometry": odometry})
        return replace(self, spec=spec)

    @property
    def called(self) -> str:
        """What a command calls it: a shipped one by its name, a person's own by its file."""
        return self.name if self.folder in (None, shipped_folder()) else self.file

    @property
    def command(self) -> str:
        """The command that runs it with its settings, quoted for a shell; a setting always, to be read."""
        called = f"./{self.called}" if self.called.startswith("-") else self.called
        settings = [f"--set {in_quotes(setting)}" for setting in self.overrides]
        return " ".join(["simrail run", shlex.quote(called), *settings])


def in_quotes(text: str) -> str:
    """A text in quotes of a shell, within which it takes nothing for a command."""
    inside = text.replace("'", "'\"'\"'")
    return f"'{inside}'"


def _is_own(name: str) -> bool:
    """Whether a method is a class in a Python file, ``"file.py:Class"``."""
    return name.partition(":")[0].endswith(".py")


def load_scenario(name: str | Path, *, overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """Read a scenario.

    Parameters
    ----------
    name : str or Path
        Name of a shipped scenario (``"go20a"``) or path of a file.
    overrides : sequence of str, optional
        Settings ``key=value`` that replace what the file says, e.g. ``"ride.speed_kmh=[20, 70]"``.
    seed : int, optional
        Replaces the file's seed.

    Raises
    ------
    InputError
        If the file is missing or has a fault: an unknown key, a wrong type or unit, NaN.
    """
    path = find("scenario", str(name))
    settings = [*overrides, *([f"seed={seed}"] if seed is not None else [])]
    return read_scenario(
        read_text(path), name=path.stem, file=label(path), folder=path.parent, overrides=settings
    )


_TABLES = ("vehicle_factors",)
"""Tables whose names are near to other keys: a setting may begin them all the same."""


def read_scenario(
    text: str,
    *,
    name: str,
    file: str | None = None,
    folder: Path | None = None,
    overrides: Sequence[str] = (),
) -> Scenario:
    """Read a scenario from TOML text; see `load_scenario`."""
    file = file or f"{name}.toml"
    data = override(parse_toml(text, file=file), overrides, tables=_TABLES)
    spec = judge(ScenarioFile, data, file=file)
    listed = [
        _options_as_axes(part, f"estimator[{i}].options", file) for i, part in enumerate(spec.estimator)
    ]
    usual = "none" if spec.encoder is None else "curve_matched"
    spec = spec.model_copy(update={"estimator": listed, "odometry": spec.odometry or usual})
    return Scenario(name=name, file=file, folder=folder, text=text, overrides=tuple(overrides), spec=spec)


def _options_as_axes(part: EstimatorPart, field: str, file: str) -> EstimatorPart:
    """Read lists among an estimator's options as axes, and tables such as ``{ uniform = ... }`` as draws.

    A list of lists is a list-valued option. What the options may be is judged when the estimator is made.
    """
    options: dict[str, Any] = {}
    for key, value in part.options.items():
        if is_distribution(value):
            with blame(file, f"{field}.{key}"):
                options[key] = read_distribution(value)
        elif isinstance(value, list) and value and not any(isinstance(item, (list, dict)) for item in value):
            options[key] = Axis(value)
        else:
            options[key] = value
    return part.model_copy(update={"options": options})
