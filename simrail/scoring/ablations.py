"""What no train has, beside what one has: an exact map of its line, a ride in silence.

A column of the score table and of the table of cells says for each cell which of the two it is. Where a
campaign has both, tables and figures are of what a train has, and one table sets both side by side. This
module knows these columns only; how they are called is in `simrail.report.words.ablations`.
"""

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd

from simrail.scoring.table import DRAWN_MAP, EXACT_MAP, SHAKEN, SILENT


class Ablation(NamedTuple):
    """One thing that is taken away.

    Attributes
    ----------
    column : str
        Column of the tables.
    own, ablated : str
        Its word for what a train has, and for the ablation.
    axis : str
        The scenario's key that a list of sets both side by side.
    """

    column: str
    own: str
    ablated: str
    axis: str


MAP = Ablation("map", DRAWN_MAP, EXACT_MAP, "map.exact")
VIBRATION = Ablation("vibration", SHAKEN, SILENT, "vibration.off")
ABLATIONS = (MAP, VIBRATION)

COLUMNS = tuple(one.column for one in ABLATIONS)
AXES = tuple(one.axis for one in ABLATIONS)
"""Columns and axes of all ablations."""


def ablation_count(labels: Mapping[str, object]) -> int:
    """How many things are taken away from a cell or a case."""
    return sum(labels[one.column] == one.ablated for one in ABLATIONS)


def has_both(table: pd.DataFrame, ablation: Ablation) -> bool:
    """Whether some rows of a table, by its column, are of an ablation and others of what a train has."""
    if ablation.column not in table:
        return False
    return 0 < int((table[ablation.column] == ablation.ablated).sum()) < len(table)


def without_ablations(table: pd.DataFrame, *, but: Ablation | None = None) -> pd.DataFrame:
    """Rows without those of an ablation, where others are of what a train has.

    Parameters
    ----------
    table : pandas.DataFrame
        Rows; a column that it lacks takes none away.
    but : Ablation, optional
        The one whose rows are kept.
    """
    for one in ABLATIONS:
        if one != but and has_both(table, one):
            table = table[table[one.column] != one.ablated]
    return table
