"""Judging a scenario without running it: track, vehicle, rides, sensors and estimators fit each other.

`judge_scenario` refuses what cannot be run, or would mean nothing, with one `InputError`; and
returns a `Plan` that says what will be run, with warnings. Each ride is judged once
(`simrail.scenario.check_ride`), and each set of sensors once on each ride
(`simrail.scenario.check_sensors`).
"""

import re
import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simrail.core.errors import InputError, one_of
from simrail.core.toml_files import blame
from simrail.estimation.estimate import Estimator
from simrail.recording.sheets.usual import sheet_warnings
from simrail.ride.vibration.sources import Vibration
from simrail.scenario.build import Parts
from simrail.scenario.cells import count, first_cells
from simrail.scenario.check_ride import judge_ride
from simrail.scenario.check_sensors import judge_sensors
from simrail.scenario.check_vibration import step_words
from simrail.scenario.designs import DESIGNS
from simrail.scenario.distributions import dimensions, sample_count
from simrail.scenario.requirements import judge_requirements, judge_requirements_of_ride
from simrail.scenario.scenario import Scenario
from simrail.scoring.ride_figures import RIDE
from simrail.scoring.table import CURVE_PREFIX, METRICS, ON_REQUEST, WINDOWS
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.contact.profile_files import profile_notes

MOST_CELLS = 1_000_000

LEAST_CELL_BYTES = 1000
"""What the scores of a cell take at least."""


@dataclass(frozen=True)
class Plan:
    """A scenario that has been judged, and what it will run.

    Attributes
    ----------
    scenario : Scenario
        As read.
    parts : Parts
        What it names, read; its cells are resolved here.
    rides, cells : int
        Numbers of rides to simulate (cached ones among them) and of recordings to estimate from.
    simulated_s : float
        Simulated time of all rides together.
    estimators : dict of str to Estimator
        By their names in the tables, with the options of the first sample.
    warnings : tuple of str
        What is unusual, one line each.
    content_hash : str
        Hash of the scenario and of the parts that it names.
    notes : tuple of str
        What is worth knowing and not unusual, one line each.
    """

    scenario: Scenario = field(repr=False)
    parts: Parts = field(repr=False)
    rides: int
    cells: int
    simulated_s: float
    estimators: dict[str, Estimator]
    warnings: tuple[str, ...]
    content_hash: str
    notes: tuple[str, ...] = ()


def judge_scenario(
    scenario: Scenario,
    parts: Parts | None = None,
    *,
    many: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Plan:
    """Judge everything about a scenario that can be judged without running it.

    Parameters
    ----------
    scenario : Scenario
        As read.
    parts : Parts, optional
        Its parts, to share what is read.
    many : bool
        Accept more than `MOST_CELLS` cells.
    progress : callable, optional
        Called now and then with (cells judged so far, cells in all).

    Raises
    ------
    InputError
        At the first fault, naming file, field, value, limit and remedy.
    """
    parts = parts or Parts(scenario)
    rides, total = count(scenario)
    if total > MOST_CELLS and not many:
        raise InputError(
            "has too many cells",
            file=scenario.file,
            value=total,
            limit=f"{MOST_CELLS}",
            remedy="shorten a list or take fewer draws; 'simrail run --yes' runs them all",
        )
    with blame(scenario.file):
        _judge_score(scenario)
        _judge_design(scenario)
        estimators = parts.estimators(0)
        if parts.draws_estimators:
            for sample in range(1, sample_count(scenario.spec)):
                parts.estimators(sample)
        judge_requirements(scenario.spec, [*estimators, *_judge_ride_figures(scenario, estimators)])
        _judge_disk("cells", total, total * LEAST_CELL_BYTES, "shorten a list or take fewer draws")
        simulated, unusual, notes = _judge_cells(
            scenario, parts, lambda done: (progress or _silent)(done, total)
        )
        warnings = [*_judge_samples(scenario), *_judge_twist(scenario, estimators), *unusual]
    return Plan(
        scenario,
        parts,
        rides,
        total,
        simulated,
        estimators,
        _by_kind(warnings),
        parts.hash,
        tuple(dict.fromkeys(notes)),
    )


def _by_kind(warnings: list[str]) -> tuple[str, ...]:
    """The first of each kind, with how many more there are: of draws and axes they differ by numbers."""
    kinds: dict[str, list[str]] = {}
    for warning in dict.fromkeys(warnings):
        kinds.setdefault(re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", warning), []).append(warning)
    return tuple(
        first if not more else f"{first} (and {len(more)} more like it)" for first, *more in kinds.values()
    )


def _silent(_done: int, _count: int) -> None:
    """Tell nobody."""


def _judge_disk(field: str, value: object, least_bytes: float, remedy: str) -> None:
    """Refuse what the disk here cannot hold, even if it held nothing else."""
    free = shutil.disk_usage(Path.cwd()).total
    if least_bytes > free:
        raise InputError(
            f"leaves {least_bytes / 1e9:.3g} GB at least, more than the disk holds",
            field=field,
            value=value,
            limit=f"{free / 1e9:.3g} GB",
            remedy=remedy,
        )


def _judge_cells(
    scenario: Scenario, parts: Parts, progress: Callable[[int], None]
) -> tuple[float, list[str], list[str]]:
    """Judge each ride, draws aside, and each set of sensors on it; simulated time of all, warnings, notes."""
    warnings: list[str] = []
    notes: list[str] = []
    simulated = 0.0
    last_ride = None
    durations: dict[tuple[object, ...], float] = {}
    judged_sensors: set[tuple[object, ...]] = set()
    shaken: set[tuple[int, Vibration]] = set()
    judged_rails: tuple[tuple[object, ...], LaidTrack] | None = None
    for cell in first_cells(scenario):
        progress(cell.number)
        resolved = parts.resolve(cell)
        ride = resolved.ride
        way = (
            ride.name,
            id(ride.track),
            id(ride.vehicle),
            ride.profile,
            ride.engine,
            ride.rate_hz,
            ride.drive,
        )
        ride_key = (*way, ride.irregularity, ride.step_s, ride.vibration)
        if ride_key not in durations:
            rails_key = (id(ride.track), ride.irregularity, ride.conditions)
            # One is remembered: rides over the same rails come in a row, and rails of many are large.
            same = judged_rails[1] if judged_rails is not None and judged_rails[0] == rails_key else None
            durations[ride_key], unusual, laid = judge_ride(resolved, shaken=shaken, known_rails=same)
            judged_rails = rails_key, laid
            rows = ride.profile.duration_s * ride.rate_hz
            least = rows * len(ride.kept_bodies) * (144 if ride.kept is None else 96)
            _judge_disk("ride", ride.name, least, "shorten the ride, or lower truth_rate_hz")
            judge_requirements_of_ride(scenario.spec, ride.track, resolved.bands, cell.ride.reach_m)
            warnings += unusual
            notes += [f"vibration: {words}" for words in [step_words(ride)] if words]
            notes += profile_notes(ride.vehicle.wheel_rail)
            for file in (ride.irregularity.measured, ride.irregularity.own_spectrum):
                notes += [] if file is None else [f"{file.name}: {words}" for words in file.notes]
        if cell.ride_number != last_ride:
            last_ride = cell.ride_number
            simulated += durations[ride_key] * scenario.spec.monte_carlo.track_draws
        spec = cell.spec
        sensors = (cell.imu, spec.encoder, spec.magnetometer, spec.rail_sensor, spec.second_imu, spec.gnss)
        words = map(repr, sensors)
        sensor_key = (*way, *words, cell.spec.odometry)
        if sensor_key not in judged_sensors:
            judged_sensors.add(sensor_key)
            judge_sensors(resolved)
            warnings += sheet_warnings(resolved.grade)
    return simulated, warnings, notes


def _judge_score(scenario: Scenario) -> None:
    score = scenario.spec.score
    for name, words, possible in (
        ("windows", score.windows, (*WINDOWS, CURVE_PREFIX + "*")),
        ("metrics", score.metrics, (*METRICS, *ON_REQUEST)),
    ):
        for i, word in enumerate(words or ()):
            if name == "metrics" or not word.startswith(CURVE_PREFIX):
                one_of(word, possible, f"is not one of the {name}", field=f"score.{name}[{i}]")


def _judge_ride_figures(scenario: Scenario, estimators: Mapping[str, Estimator]) -> list[str]:
    """Name under which figures of the ride itself stand, if there are any; refused if an estimator has it."""
    spec = scenario.spec
    kicked = any(ride.kick_end_m is not None for ride in spec.ride)
    if spec.running_safety is None and spec.ride_comfort is None and not kicked:
        return []
    if RIDE in estimators:
        raise InputError(
            "figures of the ride itself stand under this name in the tables",
            field="estimator",
            value=RIDE,
            remedy="give the estimator another name",
            limit="another name",
        )
    return [RIDE]


def _judge_twist(scenario: Scenario, estimators: Mapping[str, Estimator]) -> list[str]:
    """Warn of a base of the twist that is no whole number of an estimator's steps: it then has no twist."""
    base = scenario.spec.geometry.twist_base_m
    steps = {name: getattr(made, "geometry_step_m", 0.0) for name, made in estimators.items()}
    return [
        f"geometry.twist_base_m = {base:g} m is no multiple of geometry_step_m = {step:g} m of {name}: "
        "its twist is not computed"
        for name, step in steps.items()
        if isinstance(step, int | float) and step > 0.0 and abs(round(base / step) * step / base - 1.0) > 1e-6
    ]


def _judge_design(scenario: Scenario) -> None:
    """Refuse a design of a sensitivity analysis that has nothing to vary, or would not be run as a whole."""
    spec = scenario.spec
    method = spec.monte_carlo.method
    if method not in DESIGNS:
        return
    here = {"field": "monte_carlo.method", "value": method}
    if not dimensions(spec):
        raise InputError(
            "is a design over distributions, and no value is one",
            **here,
            limit="a scenario with a range for one value or more",
            remedy='write a range, e.g. --set "imu.sheet.gyro_noise_degpsqrth={ log_uniform = [0.05, 1.0] }"',
        )
    # A requirement is judged over devices, and all samples of a design have the same.
    for name in ("stop", "passes", "require"):
        if getattr(spec, name):
            raise InputError(
                f"needs all of its samples, each by itself, and does not go with {name}",
                **here,
                remedy=f"leave out {name}, or the method",
            )


def _judge_samples(scenario: Scenario) -> list[str]:
    """Warn of samples that draw nothing, and of distributions that are drawn from once."""
    monte_carlo, drawn = scenario.spec.monte_carlo, dimensions(scenario.spec)
    if monte_carlo.samples > 1 and not drawn:
        return [f"monte_carlo.samples = {monte_carlo.samples} counts for nothing: no value is a distribution"]
    if monte_carlo.samples == 1 and drawn:
        return [f"one sample only of {', '.join(drawn)}; set monte_carlo.samples"]
    return []
