"""What a scenario will run, and about what it will take: ``simrail run NAME --plan``.

Numbers of cells, rides and cached rides are counted. Rows, time and disk are those of one cell, run as the
campaign runs it, times the number of cells, or of seconds ridden. Its ride stays in the cache, where the
campaign finds it. A machine that is busy, rides on other engines and vehicles, or recordings at other rates
make them differ: they are an estimate, no promise.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby, islice

from rich.console import Console
from rich.filesize import decimal
from rich.table import Table

from simrail.campaign.cell import STAGES
from simrail.campaign.worker import BatchResult, forget, pack, run_batch, run_ride
from simrail.core.interrupts import interruptible
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, is_cached
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, first_cells
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import LEVELS, stop_rule_of

SCORE_ROW_BYTES = 8.0
"""Of ``scores.parquet``; recorded on tables of 60,000 to 800,000 rows, which take 5 to 8."""

MOST_LOOKED_UP = 2000
"""Rides that are looked for in the cache, each in some 10 ms."""

_STAGE_WORDS = {
    "simulate": "rides that the cache lacks",
    "measure": "motion, sensors and odometry",
    "estimate": "all estimators",
    "score": "their scores",
}


@dataclass(frozen=True)
class Forecast:
    """What a scenario will run.

    Attributes
    ----------
    plan : Plan
        Counted, and judged.
    cached : int, optional
        Rides that the cache held before; None if there are too many to look for.
    rows : int
        Rows of the score table.
    stages_s : dict of str to float
        Processor time of the stages `simrail.campaign.cell.STAGES`; of rides, what the cache lacks.
    ride_bytes, score_bytes : float
        Disk for all rides (cached ones among them), and for the score table.
    failed : dict of str to str
        Estimators that failed on the cell, with the reason; their time and rows are not in it.
    """

    plan: Plan
    cached: int | None
    rows: int
    stages_s: dict[str, float]
    ride_bytes: float
    score_bytes: float
    failed: dict[str, str]

    @property
    def total_s(self) -> float:
        """Processor time of all."""
        return sum(self.stages_s.values())


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
    plan = judge_scenario(scenario, many=many)
    look = plan.rides <= MOST_LOOKED_UP
    rides = [
        (not (look and is_cached(ride)), ride.profile.duration_s, first)
        for first, ride in islice(_rides(scenario, plan.parts), None if look else 1)
    ]
    cached = [duration for is_new, duration, _ in rides if not is_new]
    *_, cheapest = min(rides, key=lambda ride: ride[:2])
    duration_s, cost, ride_bytes = _cost_of(cheapest, plan.parts)
    cells_s = plan.cells * plan.simulated_s / plan.rides
    seconds = dict.fromkeys(STAGES, cells_s) | {"simulate": plan.simulated_s - sum(cached)}
    rows = plan.cells * len(cost.scores)
    return Forecast(
        plan=plan,
        cached=len(cached) if look else None,
        rows=rows,
        stages_s={stage: seconds[stage] * cost.cpu_s[stage] / duration_s for stage in STAGES},
        ride_bytes=plan.simulated_s * ride_bytes / duration_s,
        score_bytes=SCORE_ROW_BYTES * rows,
        failed={failure.estimator: failure.reason for failure in cost.failures},
    )


def _rides(scenario: Scenario, parts: Parts) -> Iterator[tuple[Cell, Ride]]:
    """Every ride, with its first cell."""
    for _, group in groupby(first_cells(scenario), key=lambda cell: cell.ride_number):
        first = next(group)
        for draw in range(scenario.spec.monte_carlo.track_draws):
            cell = replace(first, ride_number=first.ride_number + draw, track_draw=draw)
            yield cell, parts.ride(cell)


def _cost_of(cell: Cell, parts: Parts) -> tuple[float, BatchResult, float]:
    """Run a cell as the campaign does, a second time where kernels are compiled.

    Returns the simulated time, what came of the cell with the processor time of its stages, and the disk
    that its ride takes.
    """
    packed, ride = pack(parts), parts.ride(cell)
    duration = max(ride.profile.duration_s, 1e-3)
    with interruptible():
        try:
            simulated = run_ride(packed, (cell,))
            run_batch(packed, (cell,))
            result = run_batch(packed, (cell,))
        finally:
            forget()
    place = ride_cache.folder() / ride_cache.key_of(ride.describe())
    engine = result.ride.get("real_time_factor")
    seconds = duration / engine + result.ride["setup_s"] if engine else simulated.cpu_s["simulate"]
    size = sum(file.stat().st_size for file in place.iterdir()) if place.exists() else 0.0
    return duration, replace(result, cpu_s=result.cpu_s | {"simulate": seconds}), size


def print_forecast(console: Console, expected: Forecast) -> None:
    """Print a forecast as a table."""
    plan = expected.plan
    new = plan.rides if expected.cached is None else plan.rides - expected.cached
    cache = "cache not searched" if expected.cached is None else f"{expected.cached:,} in the cache"
    table = Table(
        title=f"{plan.scenario.name}: what it will run", title_justify="left", show_header=False, box=None
    )
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(style="dim")
    table.add_row(
        "rides to simulate", f"{new:,}", f"of {plan.rides:,}, {_time(plan.simulated_s)} of riding; {cache}"
    )
    table.add_row("cells", f"{plan.cells:,}", f"recordings, {len(plan.estimators)} estimators on each")
    table.add_row("score rows", f"about {expected.rows:,}", decimal(round(expected.score_bytes)))
    table.add_row("disk", decimal(round(expected.ride_bytes)), _cache_words(expected.ride_bytes))
    table.add_section()
    for stage, words in _STAGE_WORDS.items():
        table.add_row(stage, _time(expected.stages_s[stage]), words)
    total = f"[bold]{_time(expected.total_s)}[/bold]"
    table.add_row("[bold]about[/bold]", total, f"on one of {os.cpu_count()} cores; an estimate from one cell")
    console.print(table)
    rule = stop_rule_of(plan.scenario)
    if rule is not None:
        first = f"{rule.asked.least_draws} of {rule.draws} {LEVELS[rule.level]}"
        console.print(
            f"these are upper limits: the stop rule may end it after {first}, or later", highlight=False
        )
    for name, reason in expected.failed.items():
        console.print(f"[yellow]not in it:[/yellow] {name} failed: {reason}", highlight=False)
    for warning in plan.warnings:
        console.print(f"[yellow]warning:[/yellow] {warning}", highlight=False)


def _cache_words(size: float) -> str:
    limit = ride_cache.limit_bytes()
    words = f"of rides; the cache keeps {limit / 1e9:g} GB"
    return words if size <= limit else f"of rides, more than the {limit / 1e9:g} GB that the cache keeps"


def _time(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    minutes, hours = seconds / 60.0, seconds / 3600.0
    return f"{minutes:.0f} min" if minutes < 100.0 else f"{hours:.1f} h"
