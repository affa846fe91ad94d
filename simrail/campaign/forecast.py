"""What a scenario will run, and about what it will take, before anything runs: ``simrail run NAME --plan``.

Numbers of cells, rides and cached rides are counted; rows, time and disk are estimates from a rehearsal
(`simrail.campaign.timing`). Nothing but the rehearsal's short rides is written, and those into the ride
cache.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from rich.console import Console
from rich.table import Table

from simrail.campaign.timing import CellCost, EngineCost, rehearse_cell, rehearse_engine
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, is_cached
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts, profile_of
from simrail.scenario.cells import Cell, first_cells, sensor_draws
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import LEVELS, stop_rule_of
from simrail.scoring.windows import chosen_windows, windows_of

SCORE_ROW_BYTES = 8.0
"""Of ``scores.parquet``; recorded on tables of 60,000 to 800,000 rows, which take 5 to 8."""

MOST_ENGINES = 8
"""Engines, vehicles and steps that are rehearsed; more of them cost what the mean of these costs."""

MOST_LOOKED_UP = 2000
"""Rides that are looked for in the cache, each in some 10 ms."""


@dataclass(frozen=True)
class Forecast:
    """What a scenario will run.

    Attributes
    ----------
    plan : Plan
        Counted, and judged.
    cached : int, optional
        Rides that the cache holds; None if there are too many to look for.
    rows : int
        Rows of the score table.
    simulate_s, motion_s, measure_s : float
        Processor time of what the cache lacks, of the motion of the mounts, and of the sensors.
    methods_s : dict of str to float
        Processor time of estimates and scores, by method.
    ride_bytes, score_bytes : float
        Disk for all rides (cached ones among them), and for the score table.
    failed : dict of str to str
        Methods that could not be rehearsed, with the reason; their time and rows are not in it.
    """

    plan: Plan
    cached: int | None
    rows: int
    simulate_s: float
    motion_s: float
    measure_s: float
    methods_s: dict[str, float]
    ride_bytes: float
    score_bytes: float
    failed: dict[str, str]

    @property
    def total_s(self) -> float:
        """Processor time of all."""
        return self.simulate_s + self.motion_s + self.measure_s + sum(self.methods_s.values())


def forecast(scenario: Scenario, *, many: bool = False) -> Forecast:
    """Judge a scenario, and say what it will run and about what that takes.

    Parameters
    ----------
    scenario : Scenario
        As read.
    many : bool
        Accept more cells than `simrail.scenario.check.MOST_CELLS`.

    Raises
    ------
    InputError
        If the scenario cannot be run.
    """
    parts = Parts(scenario)
    plan = judge_scenario(scenario, parts, many=many)
    costs = _Costs(parts)
    draws, look = scenario.spec.monte_carlo.track_draws, plan.rides <= MOST_LOOKED_UP
    cached = 0
    rows = simulate = motion = measured = size = 0.0
    methods: dict[str, float] = {}
    for _, group in groupby(first_cells(scenario), key=lambda cell: cell.ride_number):
        ride_cells = list(group)
        first = ride_cells[0]
        duration = profile_of(first).duration_s
        engine, cell_cost = costs.of(first)
        found = sum(is_cached(ride) for ride in _rides(first, draws, parts)) if look else 0
        cached += found
        simulate += (draws - found) * (duration / engine.real_time_factor + engine.setup_s)
        size += draws * duration * engine.bytes_per_s
        motion += draws * duration * cell_cost.motion_s * len({cell.imu.name for cell in ride_cells})
        windows = _windows(first, parts)
        for cell in ride_cells:
            number = draws * sensor_draws(scenario.spec, cell.imu)
            samples = duration * parts.grade(cell).rate_hz
            rows += number * cell_cost.rows * windows / max(cell_cost.windows, 1)
            measured += number * cell_cost.measure.of(samples)
            for name, cost in cell_cost.methods.items():
                methods[name] = methods.get(name, 0.0) + number * cost.of(samples)
    return Forecast(
        plan=plan,
        cached=cached if look else None,
        rows=round(rows),
        simulate_s=simulate,
        motion_s=motion,
        measure_s=measured,
        methods_s=methods,
        ride_bytes=size,
        score_bytes=SCORE_ROW_BYTES * rows,
        failed=costs.failed,
    )


class _Costs:
    """Costs of rides and cells, each kind of engine rehearsed once, the methods on the first of them."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._engines: dict[tuple[object, ...], EngineCost] = {}
        self._cell: CellCost | None = None

    @property
    def failed(self) -> dict[str, str]:
        return {} if self._cell is None else self._cell.failed

    def of(self, cell: Cell) -> tuple[EngineCost, CellCost]:
        spec = cell.spec
        key = (spec.engine, spec.vehicle, spec.step_s, spec.truth_rate_hz)
        truth: Truth | None = None
        if key not in self._engines and len(self._engines) < MOST_ENGINES:
            self._engines[key], truth = rehearse_engine(cell, self._parts)
        if self._cell is None:
            assert truth is not None
            self._cell = rehearse_cell(cell, truth, self._parts)
        return self._engines.get(key) or _mean(list(self._engines.values())), self._cell


def _mean(costs: list[EngineCost]) -> EngineCost:
    return EngineCost(
        1.0 / float(np.mean([1.0 / cost.real_time_factor for cost in costs])),
        float(np.mean([cost.setup_s for cost in costs])),
        float(np.mean([cost.bytes_per_s for cost in costs])),
    )


def _rides(first: Cell, draws: int, parts: Parts) -> Iterator[Ride]:
    for draw in range(draws):
        yield parts.ride(replace(first, track_draw=draw))


def _windows(cell: Cell, parts: Parts) -> int:
    """Number of windows that the scores of a cell's ride are kept for."""
    profile = profile_of(cell)
    times = np.arange(0.0, profile.duration_s, 0.1)
    position, speed, _ = profile.motion(times)
    found = windows_of(parts.track(cell), position, speed, time_s=times)
    return len(chosen_windows(found, cell.spec.score.windows))


def print_forecast(console: Console, scenario: Scenario, told: Forecast, *, cores: int) -> None:
    """Print a forecast as a table."""
    plan = told.plan
    new = plan.rides if told.cached is None else plan.rides - told.cached
    known = "cache not searched" if told.cached is None else f"{told.cached:,} in the cache"
    table = Table(
        title=f"{scenario.name}: what it will run", title_justify="left", show_header=False, box=None
    )
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(style="dim")
    table.add_row(
        "rides to simulate", f"{new:,}", f"of {plan.rides:,}, {_time(plan.simulated_s)} of riding; {known}"
    )
    table.add_row("cells", f"{plan.cells:,}", f"recordings, {len(plan.estimators)} estimators on each")
    table.add_row("score rows", f"about {told.rows:,}", _bytes(told.score_bytes))
    table.add_row("disk", _bytes(told.ride_bytes), _cache_words(told.ride_bytes))
    table.add_section()
    table.add_row("simulate", _time(told.simulate_s), "")
    table.add_row("motion, sensors, odometry", _time(told.motion_s + told.measure_s), "")
    for name, seconds in told.methods_s.items():
        table.add_row(f"  {name}", _time(seconds), "estimates and their scores")
    table.add_row(
        "[bold]about[/bold]", f"[bold]{_time(told.total_s)}[/bold]", f"on one of {cores} cores; an estimate"
    )
    console.print(table)
    rule = stop_rule_of(scenario)
    if rule is not None:
        first = f"{rule.asked.least_draws} of {rule.draws} {LEVELS[rule.level]}"
        console.print(
            f"these are upper limits: the stop rule may end it after {first}, or later", highlight=False
        )
    for name, reason in told.failed.items():
        console.print(f"[yellow]not in it:[/yellow] {name} could not be rehearsed: {reason}", highlight=False)
    for warning in plan.warnings:
        console.print(f"[yellow]warning:[/yellow] {warning}", highlight=False)


def _cache_words(size: float) -> str:
    limit = ride_cache.limit_bytes()
    words = f"of rides; the cache keeps {limit / 1e9:g} GB"
    return words if size <= limit else f"of rides, more than the {limit / 1e9:g} GB that the cache keeps"


def _bytes(size: float) -> str:
    for unit, scale in (("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"


def _time(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    minutes, hours = seconds / 60.0, seconds / 3600.0
    return f"{minutes:.0f} min" if minutes < 100.0 else f"{hours:.1f} h"
