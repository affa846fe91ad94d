"""What a scenario will run, and about what it will take: ``simrail run NAME --plan``.

Numbers of cells, rides and cached rides are counted. Rows, time and disk are those of one cell, run as the
campaign runs it, times the number of cells, or of seconds ridden. What an engine computes counts once for all
rides that differ in their vibration only, and the short waves beside it once for each. Its ride stays in the
cache, where the campaign finds it. A machine that is busy, rides on other engines and vehicles, or recordings
at other rates make them differ: they are an estimate, no promise.
"""

import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, islice
from typing import NamedTuple

from rich.console import Console
from rich.filesize import decimal
from rich.table import Table

from simrail.campaign.cell import STAGES
from simrail.campaign.worker import BatchResult, forget, pack, run_batch, run_ride
from simrail.core.interrupts import interruptible
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, is_cached, simulate
from simrail.ride.vibration.run import Shaker
from simrail.scenario.axes import each
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, first_cells
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.requirements import stop_rule_of
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import LEVELS

SCORE_ROW_BYTES = 8.0
"""Of ``scores.parquet``; recorded on tables of 60,000 to 800,000 rows, which take 5 to 8."""

MOST_LOOKED_UP = 2000
"""Rides that are looked for in the cache, each in some 10 ms."""

MOST_LISTED = 200
"""Of more rides, so many are looked at, over the first draw of the track: others share as much."""

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
    draws, most = (scenario.spec.monte_carlo.track_draws, None) if look else (1, MOST_LISTED)
    rides = [_Planned.of(*one, look=look) for one in islice(_rides(scenario, plan.parts, draws), most)]
    scale = plan.simulated_s / sum(ride.duration_s for ride in rides)
    # Shaken if any is: a ride in silence would not tell what short waves take.
    cheapest = min(rides, key=lambda ride: (not ride.is_shaken, not ride.is_cached, ride.duration_s))
    cost = _cost_of(cheapest.cell, plan.parts)
    kept = [scale * seconds / cost.duration_s for seconds in _seconds(rides)]
    missing = [ride for ride in rides if not ride.is_cached]
    new = [scale * seconds / cost.duration_s for seconds in _seconds(missing, new=True)]
    numbers = each(scenario.spec.passes) if scenario.spec.passes is not None else (1,)
    # Cells of fewer passes share the recordings of those of the most.
    recordings = plan.cells // len(numbers) * int(max(numbers))
    recorded = recordings * plan.simulated_s / plan.rides / cost.duration_s
    simulated = new[0] * cost.engine_s + new[1] * cost.vibration_s
    rows = plan.cells * len(cost.result.scores)
    return Forecast(
        plan=plan,
        cached=len(rides) - len(missing) if look else None,
        rows=rows,
        stages_s={stage: recorded * cost.result.cpu_s[stage] for stage in STAGES} | {"simulate": simulated},
        ride_bytes=kept[0] * cost.engine_bytes + kept[1] * cost.vibration_bytes,
        score_bytes=SCORE_ROW_BYTES * rows,
        failed={failure.estimator: failure.reason for failure in cost.result.failures},
    )


def _rides(scenario: Scenario, parts: Parts, draws: int) -> Iterator[tuple[Cell, Ride]]:
    """Every ride over the first draws of the track, with its first cell."""
    for _, group in groupby(first_cells(scenario), key=lambda cell: cell.ride_number):
        first = next(group)
        for draw in range(draws):
            cell = replace(first, ride_number=first.ride_number + draw, track_draw=draw)
            yield cell, parts.ride(cell)


class _Planned(NamedTuple):
    """A ride that will be run.

    Attributes
    ----------
    cell : Cell
        Its first cell.
    duration_s : float
        Simulated time.
    engine_key : str
        Key of what its engine computes, which rides that differ in their vibration share.
    is_shaken : bool
        Whether it has short waves of its own.
    has_engine, is_cached : bool
        Whether the cache has that of the engine, and all of it.
    """

    cell: Cell
    duration_s: float
    engine_key: str
    is_shaken: bool
    has_engine: bool
    is_cached: bool

    @classmethod
    def of(cls, cell: Cell, ride: Ride, *, look: bool) -> "_Planned":
        """Look at a ride, and for it in the cache."""
        own = ride.without_vibration
        key, has_engine = ride_cache.key_of(own.describe()), look and is_cached(own)
        has_all = has_engine and (ride.vibration is None or is_cached(ride))
        return cls(cell, ride.profile.duration_s, key, ride.vibration is not None, has_engine, has_all)


def _seconds(rides: Sequence[_Planned], *, new: bool = False) -> tuple[float, float]:
    """Seconds that engines compute, and that are shaken; ``new``: of what the cache lacks."""
    engine = {ride.engine_key: ride.duration_s for ride in rides if not (new and ride.has_engine)}
    return sum(engine.values()), sum(ride.duration_s for ride in rides if ride.is_shaken)


class _Cost(NamedTuple):
    """What a cell and its ride take.

    Attributes
    ----------
    duration_s : float
        Simulated time.
    result : BatchResult
        What came of the cell, with the processor time of its stages.
    engine_s, vibration_s : float
        Processor time of what the engine computes, and of the short waves beside it.
    engine_bytes, vibration_bytes : float
        Disk that they take.
    """

    duration_s: float
    result: BatchResult
    engine_s: float
    vibration_s: float
    engine_bytes: float
    vibration_bytes: float


def _cost_of(cell: Cell, parts: Parts) -> _Cost:
    """Run a cell as the campaign does, a second time where kernels are compiled."""
    packed, ride = pack(parts), parts.ride(cell)
    duration = max(ride.profile.duration_s, 1e-3)
    with interruptible():
        try:
            simulated = run_ride(packed, (cell,))
            run_batch(packed, (cell,))
            result = run_batch(packed, (cell,))
        finally:
            forget()
    engine = result.ride.get("real_time_factor")
    seconds = duration / engine + result.ride["setup_s"] if engine else simulated.cpu_s["simulate"]
    shaken = ride.vibration is not None
    return _Cost(
        duration,
        result,
        seconds,
        _vibration_s(ride) if shaken else 0.0,
        _bytes_of(ride.without_vibration),
        _bytes_of(ride) if shaken else 0.0,
    )


def _vibration_s(ride: Ride) -> float:
    """Processor time of the short waves of a ride that is in the cache."""
    assert ride.vibration is not None
    truth = simulate(ride.without_vibration, warn=False)
    begun = time.process_time()
    for _ in Shaker(ride.vibration, truth, ride.vehicle, seed=ride.track_seed).run():
        pass
    return time.process_time() - begun


def _bytes_of(ride: Ride) -> float:
    """Disk that a ride takes in the cache, or its short waves if it has any."""
    places = ride_cache.places_of(ride_cache.key_of(ride.describe()))
    return float(sum(file.stat().st_size for file in places[-1].iterdir())) if places else 0.0


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
