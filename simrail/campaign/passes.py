"""Cells of several rides over the same rails: each recorded and estimated once, their rails fused and scored.

The rides of all cells of a batch are those of the one with the most passes; the others are the first of them.
What is kept of a ride while the next is run is what it says of the rails.
"""

from collections.abc import Callable, Sequence

from simrail.campaign.cell import BatchTally, estimates_of, record_cell, unless_of_the_machine, wanted_of
from simrail.core.interrupts import Check
from simrail.estimation.estimate import Estimate
from simrail.estimators.rails.fuse import fuse, rails_and_place_of
from simrail.recording.recording import Recording
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, rides_of
from simrail.scoring.geometry import score_geometry


def run_passes(
    cells: Sequence[Cell], ride_of: Callable[[Cell], Truth], parts: Parts, tally: BatchTally, check: Check
) -> None:
    """Record every pass, run every estimator on it, fuse and score.

    Parameters
    ----------
    cells : sequence of Cell
        Of the same recordings, with other numbers of them.
    ride_of : callable
        The ride of a pass.
    parts, tally, check : Parts, BatchTally, callable
        As in `simrail.campaign.cell.run_cells`.
    """
    found: dict[str, list[Estimate | Exception]] = {name: [] for name in tally.estimators}
    first: Recording | None = None
    for one in rides_of(cells):
        try:
            with tally.timed("simulate"):
                truth = ride_of(one)
            with tally.timed("measure"):
                recording = record_cell(one, truth, parts)
        except Exception as error:
            check()
            if isinstance(error, OSError):
                raise  # of the cache, no property of a pass
            for outcomes in found.values():
                outcomes.append(error)
            continue
        first = first or recording
        for name, estimator in tally.estimators.items():
            (outcome,) = estimates_of(name, estimator, [recording], tally, check)
            if isinstance(outcome, Exception):
                found[name].append(outcome)
            else:
                found[name].append(rails_and_place_of(outcome[0], recording))
    for cell in cells:
        for name, outcomes in found.items():
            try:
                _score_fused(cell, name, outcomes[: len(cell.passes)], first, parts, tally)
            except Exception as error:
                check()
                unless_of_the_machine(error)
                tally.fail(cell, name, error)


def _score_fused(
    cell: Cell,
    name: str,
    outcomes: Sequence[Estimate | Exception],
    recording: Recording | None,
    parts: Parts,
    tally: BatchTally,
) -> None:
    """Fuse the passes of a cell and score the rails; one that failed fails the cell."""
    estimates = []
    for outcome in outcomes:
        if isinstance(outcome, Exception):
            raise outcome
        estimates.append(outcome)
    assert recording is not None
    with tally.timed("estimate"):
        fused = fuse(estimates)
    with tally.timed("score"):
        figures = score_geometry(
            fused.estimate,
            parts.rails(cell),
            recording,
            bands=parts.resolve(cell).bands,
            twist_base_m=cell.spec.geometry.twist_base_m,
            **wanted_of(cell),
        )
        tally.add(cell, name, figures)
