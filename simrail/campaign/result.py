"""What a campaign found: made of the batches that are kept, the same whatever their order and size.

Scores come from the batches only. The examples for figures are cells run once more: a recording with its
estimates is large, and no batch hands it on.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import pandas as pd

from simrail.campaign.cell import STAGES, CellResult, Failure
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.examples import examples_of
from simrail.campaign.worker import BatchResult
from simrail.scenario.cells import Cell, cell_record, cells
from simrail.scenario.check import Plan
from simrail.scenario.requirements import VerdictState, looks_of, requirements_of, stop_rule_of
from simrail.scenario.stop_rule import StopState
from simrail.scoring.ablations import without_ablations
from simrail.scoring.table import concat_scores, in_order
from simrail.scoring.verdicts import verdict_table


@dataclass(frozen=True)
class CampaignResult:
    """What a campaign found.

    Attributes
    ----------
    scores : pandas.DataFrame
        The score table, columns `simrail.scoring.table.SCORE_COLUMNS`, in the order of the cells.
    cells : pandas.DataFrame
        One row per cell: its labels, and the values of the scenario's axes under their dotted names.
    examples : list of CellResult
        Recordings for figures (`simrail.campaign.examples`).
    rides : list of dict
        What each engine said of its run; plain values.
    wall_s, cpu_s : dict of str to float
        Wall and processor time of the stages ``simulate``, ``measure``, ``estimate``, ``score``, all workers.
    failures : list of Failure
        What failed; each is a row of the scores as well.
    plan : Plan
        What was planned, with its warnings.
    stopped : StopState or VerdictState, optional
        The last state of the scenario's stop rule: the tables hold the draws that it was asked about.
    """

    scores: pd.DataFrame
    cells: pd.DataFrame
    examples: list[CellResult]
    rides: list[dict[str, Any]]
    wall_s: dict[str, float]
    cpu_s: dict[str, float]
    failures: list[Failure]
    plan: Plan
    stopped: StopState | VerdictState | None = None

    @cached_property
    def verdicts(self) -> pd.DataFrame:
        """What became of the scenario's requirements (`simrail.scoring.verdicts.verdict_table`)."""
        spec = self.plan.scenario.spec
        return verdict_table(self.scores, self.cells, requirements_of(spec), looks=looks_of(spec))

    @property
    def warnings(self) -> list[str]:
        """What was unusual in the plan, and in the rides, one line each."""
        of_rides = [
            f"ride {ride['ride']}: {line}" for ride in self.rides for line in ride.get("warnings", ())
        ]
        return [*self.plan.warnings, *dict.fromkeys(of_rides)]


def chosen_cells(
    plan: Plan,
    only: int | None = None,
    *,
    draws: int | None = None,
    former: StopState | VerdictState | None = None,
) -> Iterator[Cell]:
    """The cells of a plan: all, the one that is wanted, or those of the first draws of its stop rule.

    ``former`` is what the rule knew before these draws: what it had settled is drawn no more.
    """
    rule = stop_rule_of(plan.scenario)
    for cell in cells(plan.scenario):
        beyond = rule is not None and draws is not None and not rule.has(cell, draws, former)
        if not beyond and (only is None or cell.number == only):
            yield cell


def gather(
    plan: Plan,
    packed: bytes,
    checkpoint: Checkpoint,
    *,
    only: int | None = None,
    stopped: StopState | VerdictState | None = None,
) -> CampaignResult:
    """Put together the batches that are kept, up to where the stop rule ended the campaign.

    Parameters
    ----------
    plan, packed : Plan, bytes
        What was run, and the same for `simrail.campaign.worker`.
    checkpoint : Checkpoint
        Its batches.
    only : int, optional
        The one cell that was wanted.
    stopped : StopState or VerdictState, optional
        Where the stop rule ended it.
    """
    draws = None if stopped is None else stopped.draws
    listed = list(chosen_cells(plan, only, draws=draws, former=stopped))
    results = list(checkpoint.results())
    if stopped is not None:
        results = _without_others(results, {cell.number for cell in listed})
    failures = [failure for result in results for failure in result.failures]
    rides: dict[int, dict[str, Any]] = {}
    for result in results:
        former = rides.get(result.ride_number)
        if result.ride and (former is None or (former["from_cache"] and not result.ride["from_cache"])):
            rides[result.ride_number] = result.ride
    table = pd.DataFrame.from_records([cell_record(cell) for cell in listed])
    drawn = set(without_ablations(table)["cell"]) if listed else set()
    scores = in_order(concat_scores(result.scores for result in results))
    return CampaignResult(
        scores=scores,
        cells=table,
        examples=examples_of(plan, packed, [one for one in listed if one.number in drawn], scores, failures),
        rides=[rides[number] for number in sorted(rides)],
        wall_s={stage: sum(result.wall_s[stage] for result in results) for stage in STAGES},
        cpu_s={stage: sum(result.cpu_s[stage] for result in results) for stage in STAGES},
        failures=sorted(failures, key=lambda failure: failure.cell),
        plan=plan,
        stopped=stopped,
    )


def _without_others(results: list[BatchResult], numbers: set[int]) -> list[BatchResult]:
    """Batches with the cells of these numbers only; a run whose failed cells are tried again has others."""
    batches = []
    for result in results:
        if not numbers.issuperset(result.cells):
            scores = result.scores[result.scores["cell"].isin(numbers)].reset_index(drop=True)
            failures = tuple(failure for failure in result.failures if failure.cell in numbers)
            result = replace(result, scores=scores, failures=failures)
        if numbers.intersection(result.cells):
            batches.append(result)
    return batches
