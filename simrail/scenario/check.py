"""Judging a scenario without running it: do track, vehicle, rides, sensors and estimators fit?

`judge_scenario` refuses what cannot be run, or would mean nothing, with one `InputError`; and
returns a `Plan` that says what will be run, with warnings. Each ride is judged once
(`simrail.scenario.check_ride`), and each set of sensors once on each ride
(`simrail.scenario.check_sensors`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimator
from simrail.scenario.build import Parts
from simrail.scenario.cells import count, first_cells
from simrail.scenario.check_ride import judge_ride
from simrail.scenario.check_sensors import judge_sensors
from simrail.scenario.samples import dimensions, sample_count
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import judge_stop_rule
from simrail.scoring.table import CURVE_PREFIX, METRICS, WINDOWS

MOST_CELLS = 1_000_000


@dataclass(frozen=True)
class Plan:
    """What a scenario that has been judged will run.

    Attributes
    ----------
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
    """

    rides: int
    cells: int
    simulated_s: float
    estimators: dict[str, Estimator]
    warnings: tuple[str, ...]
    content_hash: str


def judge_scenario(scenario: Scenario, parts: Parts | None = None, *, many: bool = False) -> Plan:
    """Judge everything about a scenario that can be judged without running it.

    Parameters
    ----------
    scenario : Scenario
        As read.
    parts : Parts, optional
        Its parts, to share what is read.
    many : bool
        Accept more than `MOST_CELLS` cells.

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
    _judge_score(scenario)
    estimators = parts.estimators(0)
    for sample in range(1, sample_count(scenario.spec)):
        parts.estimators(sample)
    judge_stop_rule(scenario, estimators)
    warnings: dict[str, None] = dict.fromkeys(
        [*_judge_samples(scenario), *_judge_twist(scenario, estimators)]
    )
    simulated = 0.0
    judged_rides: set[tuple[str, ...]] = set()
    judged_sensors: set[tuple[str, ...]] = set()
    for cell in first_cells(scenario):
        ride_key = (
            cell.spec.track,
            cell.spec.vehicle,
            cell.spec.engine,
            repr(cell.spec.truth_rate_hz),
            repr(cell.ride),
        )
        sensor_key = (
            cell.spec.vehicle,
            cell.spec.engine,
            repr(cell.imu),
            *map(repr, (cell.spec.encoder, cell.spec.magnetometer, cell.spec.rail_sensor)),
        )
        if (*ride_key, repr(cell.spec.irregularity), repr(cell.spec.step_s)) not in judged_rides:
            judged_rides.add((*ride_key, repr(cell.spec.irregularity), repr(cell.spec.step_s)))
            duration, found = judge_ride(scenario, cell, parts)
            warnings.update(dict.fromkeys(found))
            simulated += duration * scenario.spec.monte_carlo.track_draws
        if (*sensor_key, cell.spec.odometry, *ride_key) not in judged_sensors:
            judged_sensors.add((*sensor_key, cell.spec.odometry, *ride_key))
            judge_sensors(scenario, cell, parts)
    return Plan(rides, total, simulated, estimators, tuple(warnings), parts.hash)


def _judge_score(scenario: Scenario) -> None:
    score = scenario.spec.score
    for field, words, known in (
        ("windows", score.windows, (*WINDOWS, CURVE_PREFIX + "*")),
        ("metrics", score.metrics, METRICS),
    ):
        for i, word in enumerate(words or ()):
            of_one_curve = field == "windows" and word.startswith(CURVE_PREFIX)
            if word not in known and not of_one_curve:
                raise InputError(
                    f"is not one of the {field}",
                    file=scenario.file,
                    field=f"score.{field}[{i}]",
                    value=word,
                    limit="one of " + ", ".join(known),
                )


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


def _judge_samples(scenario: Scenario) -> list[str]:
    """Warn of samples that draw nothing, and of distributions that are drawn from once."""
    monte_carlo, found = scenario.spec.monte_carlo, dimensions(scenario.spec)
    if monte_carlo.samples > 1 and not found:
        return [f"monte_carlo.samples = {monte_carlo.samples} counts for nothing: no value is a distribution"]
    if monte_carlo.samples == 1 and found:
        return [f"one sample only of {', '.join(found)}; set monte_carlo.samples"]
    return []
