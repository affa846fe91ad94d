"""The other size beside ours: rows of Tables 1 and 2 from the results of another run."""

from dataclasses import dataclass

import numpy as np

from simrail.campaign.stored_results import StoredResults
from simrail.report.papers.gonzalez_2023.parts import Rows, rows_of
from simrail.report.tables.pivot import cases
from simrail.scenario.cells import methods

MODEL, FULL = "1:10", "full size"
"""What the two sizes are called."""

LONGEST_OF_MODEL_M = 10.0
"""Longest wave of the scenario's own band below which it is taken for one of the 1:10 track."""


@dataclass(frozen=True)
class OtherSize:
    """Rows of another run.

    Attributes
    ----------
    name, started, where : str
        Its scenario, its date, and which of its cases is looked at.
    size : str
        `MODEL` or `FULL`, with what tells it from ours if that is of the same size.
    rows : Rows
        Its figures.
    """

    name: str
    started: str
    where: str
    size: str
    rows: Rows


def other_size(former: StoredResults, *, band: str) -> OtherSize | None:
    """Rows of former results in the band of that name; None if they have no rail geometry."""
    scenario = former.scenario()
    rows = rows_of(cases(former.scores, former.cells), methods(scenario), band=band)
    if rows is None:
        return None
    _, longest_m = scenario.spec.geometry.own_bands.get(band, (0.0, np.inf))
    started = str(former.manifest.get("started_utc", "an unknown day"))[:10]
    return OtherSize(scenario.name, started, rows.where, size_of(longest_m), rows)


def size_of(longest_m: float) -> str:
    """`MODEL` or `FULL`, by the longest wave of the scenario's own band."""
    return MODEL if longest_m < LONGEST_OF_MODEL_M else FULL
