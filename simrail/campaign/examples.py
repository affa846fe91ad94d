"""Which recordings of a campaign are kept for figures, and how they are made once more.

Beside a publication they are what its figures are of: the first draw of each ride. Of every other campaign
they are the worst: of each ride and IMU the draw in which the best method errs the most, the worst first.
"""

from collections import Counter
from collections.abc import Iterator

import pandas as pd

from simrail.campaign.cell import CellResult, Failure
from simrail.campaign.worker import example_of
from simrail.estimation.estimate import description_of
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell
from simrail.scenario.check import Plan
from simrail.scoring.table import FULL

EACH_MOUNT = ("veillard_2016",)
"""Publications whose section draws a ride as each of its mounts recorded it."""

MOST_EXAMPLES = 6
"""Recordings that are kept for the report's figures."""

MOST_WORST = 5
"""The same beside no publication: the fewer there are, the finer is each."""

JUDGED = (("vertical_profile", "sd"), ("roll", "rms"), ("position", "rms"))
"""By what a recording is the worst: the first figure that a method under test has."""

IDEAL = "ideal"
"""IMUs of this grade are a floor, and come after all others."""


def examples_of(
    plan: Plan, packed: bytes, listed: list[Cell], scores: pd.DataFrame, failures: list[Failure]
) -> list[CellResult]:
    """Run the cells once more that are drawn, at most `MOST_EXAMPLES`; those that fail are left out.

    Parameters
    ----------
    plan, packed : Plan, bytes
        What was run, and the same for `simrail.campaign.worker`.
    listed : list of Cell
        Cells that may be drawn.
    scores : pandas.DataFrame
        The score table.
    failures : list of Failure
        What failed: cells in which everything did are not drawn.
    """
    failed = Counter(failure.cell for failure in failures)
    alive = [cell for cell in listed if failed[cell.number] < len(plan.estimators)]
    if plan.scenario.spec.paper is not None:
        chosen = list(_first_draws(alive, by_mount=plan.scenario.spec.paper in EACH_MOUNT))
    else:
        chosen = worst_cells(alive, _errors(plan, scores))
    examples: list[CellResult] = []
    for cell in chosen[: MOST_EXAMPLES if plan.scenario.spec.paper is not None else MOST_WORST]:
        try:
            examples.append(example_of(packed, cell))
        except OSError:
            raise  # a cache that cannot be used is none of the cell's faults
        except Exception:
            continue
    return examples


def _first_draws(cells: list[Cell], *, by_mount: bool) -> Iterator[Cell]:
    """The first cell of each ride over the first draw, of each mount where asked, and of added noise."""
    shown: set[tuple[int, str]] = set()
    noise_shown = False
    for cell in sorted(cells, key=lambda cell: cell.ride_number):
        key = cell.ride_number, cell.imu.name if by_mount else ""
        first = key not in shown or (cell.imu.noise_added and not noise_shown)
        if cell.track_draw == cell.sample == 0 and first:
            shown.add(key)
            noise_shown |= cell.imu.noise_added
            yield cell


def _errors(plan: Plan, scores: pd.DataFrame) -> dict[int, float]:
    """By cell, the error of the method under test that is best in the figure that counts."""
    told = {name: description_of(one) for name, one in Parts(plan.scenario).estimators(0).items()}
    tested = [name for name, one in told.items() if one.role == "method" and one.uses_imu]
    whole = scores[(scores["window"] == "whole") & (scores["reference"] == "truth") & scores["value"].notna()]
    for quantity, metric in JUDGED:
        rows = whole[(whole["quantity"] == quantity) & (whole["metric"] == metric)]
        if quantity != "position":
            rows = rows[rows["estimator"].isin(tested)]
        bands = [str(band) for band in rows["band"].unique()]
        band = "D1" if "D1" in bands else next((band for band in bands if band != FULL), FULL)
        rows = rows[rows["band"] == band].astype({"estimator": str})
        if len(rows):
            best = rows.groupby("estimator")["value"].median().idxmin()
            own = rows[rows["estimator"] == best]
            return dict(zip(own["cell"].astype(int), own["value"].astype(float), strict=True))
    return {}


def worst_cells(cells: list[Cell], errors: dict[int, float]) -> list[Cell]:
    """The worst draw of each case, the worst first: of each IMU one before any has two, the ideal ones last.

    Parameters
    ----------
    cells : list of Cell
        All that may be drawn.
    errors : dict of int to float
        By number of a cell; a cell without one is less bad than any other.
    """
    ordered = sorted(cells, key=lambda cell: (-errors.get(cell.number, -1.0), cell.number))
    worst_of_case: dict[int, Cell] = {}
    for cell in ordered:
        worst_of_case.setdefault(cell.case, cell)
    turns: Counter[tuple[str, str]] = Counter()
    placed = []
    for place, cell in enumerate(worst_of_case.values()):
        key = cell.imu.name, str(cell.imu.grade)
        placed.append(((str(cell.imu.grade) == IDEAL, turns[key], place), cell))
        turns[key] += 1
    return [cell for _, cell in sorted(placed, key=lambda one: one[0])]
