"""Running the failed cells of finished results again: what did not fail becomes a batch that is kept.

The campaign loop then finds exactly the failed cells missing. Only the same plan, run by the same code, is
gone on with: a table whose rows come from different code belongs to none.
"""

from __future__ import annotations

from pathlib import Path

from simrail.batch import BatchResult
from simrail.errors import InputError
from simrail.former import read_results
from simrail.job import Job
from simrail.ledger import STAGES
from simrail.scenario.cells import cells
from simrail.unfinished import Unfinished


def keep_good(results: Path, job: Job, kept: Unfinished) -> None:
    """Keep the cells of finished results that did not fail.

    Parameters
    ----------
    results : Path
        Folder of the results.
    job : Job
        What is run.
    kept : Unfinished
        Where they are kept.

    Raises
    ------
    InputError
        If there are no results of this plan, or nothing in them failed.
    """

    def refuse(problem: str, remedy: str) -> InputError:
        return InputError(problem, field="--retry-failed", value=str(results), remedy=remedy)

    former = read_results(results, field="--retry-failed", remedy="run it without --retry-failed")
    manifest, scores = former.manifest, former.scores
    if manifest.get("key") != job.key:
        raise refuse(
            "the results there are of another plan, or were made by other code",
            "run it without --retry-failed; rows of different code do not belong together",
        )
    failed = {failure["cell"] for failure in manifest["failures"]}
    if not failed:
        raise refuse("nothing failed there", "there is nothing to do")
    had = set(scores["cell"])  # a run that its stop rule ended has not all
    said = {ride["number"]: ride for ride in manifest["rides"]}
    good: dict[int, list[int]] = {}
    for cell in cells(job.scenario):
        if cell.number in had - failed:
            good.setdefault(cell.ride_number, []).append(cell.number)
    wall, cpu = ({stage: manifest[name][stage] for stage in STAGES} for name in ("wall_s", "cpu_s"))
    for ride_number, numbers in good.items():
        rows = scores[scores["cell"].isin(numbers)].reset_index(drop=True)
        kept.add(BatchResult(tuple(numbers), ride_number, rows, (), said.get(ride_number, {}), wall, cpu))
        wall = cpu = dict.fromkeys(STAGES, 0.0)
