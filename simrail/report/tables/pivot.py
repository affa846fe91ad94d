"""The scores of one case, by method, quantity, metric, window and reference.

A case is what cells share that differ in their draws only: one ride, IMU, mount and odometry, and
one value of every axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas as pd

from simrail.scoring.ablations import ABLATIONS, AXES, COLUMNS, Ablation
from simrail.scoring.aggregate import AGGREGATE_COLUMNS, aggregate
from simrail.scoring.table import CURVE_PREFIX, FULL, SCORE_COLUMNS

CASE_COLUMNS = ("ride", "vehicle", "mount", "imu", "odometry", *COLUMNS)


class Mean(NamedTuple):
    """Mean over draws, its standard deviation between draws (NaN for one draw), number of draws."""

    value: float
    sd: float
    draws: int


NOTHING = Mean(float("nan"), float("nan"), 0)


@dataclass(frozen=True)
class Case:
    """Averaged scores of one case.

    Attributes
    ----------
    labels : dict of str to str
        What the case is: `CASE_COLUMNS` and the axes.
    table : pandas.DataFrame
        Rows of `simrail.scoring.aggregate.aggregate` of this case.
    scores : dict
        (estimator, quantity, band, reference, window, metric) to `Mean`.
    """

    labels: dict[str, str]
    table: pd.DataFrame
    scores: dict[tuple[str, str, str, str, str, str], Mean]

    @property
    def axes(self) -> dict[str, str]:
        """Values of the scenario's lists by dotted name, but those that ``imu`` and ablations have.

        A ride has no value of a list that stands in another ride only.
        """
        told = ("imu.grade", *AXES)
        named = ((name, value) for name, value in self.labels.items() if "." in name or name == "passes")
        return {n: value for n, value in named if not n.startswith(told) and value != "nan"}

    def get(
        self,
        estimator: str,
        quantity: str,
        metric: str,
        *,
        band: str = FULL,
        window: str = "whole",
        reference: str = "truth",
    ) -> Mean:
        """One figure; NaN and no draws if there is none."""
        return self.scores.get((estimator, quantity, band, reference, window, metric), NOTHING)

    def estimators(self) -> list[str]:
        """Names of the methods, odometry included, in the order of the table."""
        return [str(name) for name in self.table["estimator"].unique()]

    def curves(self) -> list[str]:
        """Windows of the single curves that have a figure, in the order of the track."""
        rows = self.table[self.table["draws"] > 0]
        names = {str(name) for name in rows["window"].unique() if str(name).startswith(CURVE_PREFIX)}
        return sorted(names, key=_segment_number)

    def metric_of_any(self, estimator: str, metric: str, *, window: str = "whole") -> Mean:
        """A figure that belongs to a method as a whole (nis, us_per_sample)."""
        for (name, _, _, reference, where, what), figure in self.scores.items():
            if (name, reference, where, what) == (estimator, "truth", window, metric):
                return figure
        return NOTHING


def cases(scores: pd.DataFrame, cell_table: pd.DataFrame) -> list[Case]:
    """Split a score table into its cases and average each over its draws."""
    table = aggregate(scores, cell_table)
    if table.empty:
        return []
    axes = [str(n) for n in table.columns if n not in (*SCORE_COLUMNS, *AGGREGATE_COLUMNS)]
    keys = [*CASE_COLUMNS, *axes]
    return [
        Case({name: str(value) for name, value in zip(keys, values, strict=True)}, rows, _index(rows))
        for values, rows in table.groupby(keys, observed=True, dropna=False, sort=False)
    ]


def first_cases(all_cases: Sequence[Case]) -> list[Case]:
    """Cases without those of an ablation, where others are of what a train has."""
    kept = list(all_cases)
    for one in ABLATIONS:
        kept = [case for case in kept if case.labels[one.column] != one.ablated] or kept
    return kept


def ablated(case: Case, others: Sequence[Case], ablation: Ablation) -> Case | None:
    """The case that differs in an ablation only; None if there is none, or if it is this one."""
    if case.labels[ablation.column] == ablation.ablated:
        return None
    own = _beside(case, ablation)
    twins = (other for other in others if other.labels[ablation.column] == ablation.ablated)
    return next((other for other in twins if _beside(other, ablation) == own), None)


def _beside(case: Case, ablation: Ablation) -> dict[str, str]:
    """What a case is, beside an ablation."""
    left_out = (ablation.column, ablation.axis, "case")
    return {name: value for name, value in case.labels.items() if name not in left_out}


def of_cell(all_cases: list[Case], cell: dict[str, object]) -> Case | None:
    """The case that a cell belongs to."""
    for case in all_cases:
        if all(str(cell[name]) == value for name, value in case.labels.items() if name in cell):
            return case
    return None


def _index(rows: pd.DataFrame) -> dict[tuple[str, str, str, str, str, str], Mean]:
    keys = ("estimator", "quantity", "band", "reference", "window", "metric")
    names = [rows[name].astype(str) for name in keys]
    # Two levels of draws: what differs between tracks and what differs between sensors add up.
    variance = rows["sd_sensor"].fillna(0.0) ** 2 + rows["sd_track"].fillna(0.0) ** 2
    sd = (variance**0.5).where(rows["draws"] > 1)
    values = zip(rows["value"], sd, rows["draws"], strict=True)
    return {key: Mean(*value) for key, value in zip(zip(*names, strict=True), values, strict=True)}


def _segment_number(window: str) -> tuple[int, str]:
    digits = [word for word in window.split() if word.isdigit()]
    return (int(digits[0]) if digits else 0, window)
