"""What a campaign found: made of the batches that are kept, the same whatever their order and size.

Scores come from the batches only. The examples for figures are cells run once more: a recording with its
estimates is large, and no batch hands it on.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import pandas as pd

from simrail.batch import example_of
from simrail.example import CellResult
from simrail.job import Job
from simrail.ledger import STAGES, Failure, cell_record
from simrail.scenario.cells import Cell, cells
from simrail.scenario.check import Plan
from simrail.score_table import concat_scores, in_order
from simrail.unfinished import Unfinished

MOST_EXAMPLES = 6
"""Recordings that are kept for the report's figures, one per ride."""


@dataclass(frozen=True)
class CampaignResult:
    """What a campaign found.

    Attributes
    ----------
    scores : pandas.DataFrame
        The score table, columns `simrail.score_table.SCORE_COLUMNS`, in the order of the cells.
    cells : pandas.DataFrame
        One row per cell: its labels, and the values of the scenario's axes under their dotted names.
    examples : list of CellResult
        First draw of each ride, for figures.
    rides : list of dict
        What each engine said of its run; plain values.
    wall_s, cpu_s : dict of str to float
        Wall and processor time of the stages ``simulate``, ``measure``, ``estimate``, ``score``, all workers.
    failures : list of Failure
        What failed; each is a row of the scores as well.
    plan : Plan
        What was planned, with its warnings.
    """

    scores: pd.DataFrame
    cells: pd.DataFrame
    examples: list[CellResult]
    rides: list[dict[str, Any]]
    wall_s: dict[str, float]
    cpu_s: dict[str, float]
    failures: list[Failure]
    plan: Plan


def chosen_cells(job: Job, only: int | None) -> Iterator[Cell]:
    """The cells of a job, or the one that is wanted."""
    return (cell for cell in cells(job.scenario) if only is None or cell.number == only)


def gather(job: Job, kept: Unfinished, *, only: int | None = None) -> CampaignResult:
    """Put together the batches that are kept."""
    results = list(kept.results())
    failures = [failure for result in results for failure in result.failures]
    rides: dict[int, dict[str, Any]] = {}
    for result in results:
        known = rides.get(result.ride_number)
        if result.ride and (known is None or (known["from_cache"] and not result.ride["from_cache"])):
            rides[result.ride_number] = result.ride
    listed = list(chosen_cells(job, only))
    return CampaignResult(
        scores=in_order(concat_scores(result.scores for result in results)),
        cells=pd.DataFrame.from_records([cell_record(cell) for cell in listed]),
        examples=_examples(job, listed, failures),
        rides=[rides[number] for number in sorted(rides)],
        wall_s={stage: sum(result.wall_s[stage] for result in results) for stage in STAGES},
        cpu_s={stage: sum(result.cpu_s[stage] for result in results) for stage in STAGES},
        failures=sorted(failures, key=lambda failure: failure.cell),
        plan=job.plan,
    )


def _examples(job: Job, listed: list[Cell], failures: list[Failure]) -> list[CellResult]:
    """The first cell of each ride over the first draw that did not fail altogether, and of added noise."""
    failed: dict[int, int] = {}
    for failure in failures:
        failed[failure.cell] = failed.get(failure.cell, 0) + 1
    shown: set[int] = set()
    noise_shown = False
    found: list[CellResult] = []
    for cell in listed:
        if len(found) == MOST_EXAMPLES:
            break
        lost = failed.get(cell.number, 0) >= len(job.plan.estimators)
        first = cell.ride_number not in shown or (cell.imu.noise_added and not noise_shown)
        if cell.track_draw == cell.sample == 0 and first and not lost:
            shown.add(cell.ride_number)
            noise_shown |= cell.imu.noise_added
            with suppress(Exception):
                found.append(example_of(job.order, cell))
    return found
