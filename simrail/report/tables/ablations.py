"""What a map that errs, or vibration, costs: each method's error with it, and the ablation beside it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from simrail.report.tables.geometry import JUDGED, QUANTITIES, judged_band
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, ablated, first_cases
from simrail.report.tables.tables import Row, Table, method_row, number_cell
from simrail.report.words.ablations import WORDS
from simrail.report.words.verdicts import imu_words
from simrail.scoring.ablations import Ablation
from simrail.scoring.table import FULL

ATTITUDE = (("roll", "roll"), ("pitch", "pitch"), ("yaw_debiased", "yaw\u00b9"))
"""Angles that are compared, and their words."""


class Cost(NamedTuple):
    """One figure of one method, mean over the same cases.

    Attributes
    ----------
    own, ablated : float
        As a train has it, and with the ablation.
    """

    own: float
    ablated: float


class Pairs(NamedTuple):
    """Cases of one mount, IMU and odometry, each with its ablation beside it.

    Attributes
    ----------
    title : str
        Mount, IMU and odometry, and vehicle where there are several.
    ablation : Ablation
        What is taken away.
    pairs : list of (Case, Case)
        As a train has it, and with the ablation.
    """

    title: str
    ablation: Ablation
    pairs: list[tuple[Case, Case]]

    def cost(self, name: str, quantity: str, metric: str, **where: str) -> Cost:
        """Means of a figure over the pairs that have both; NaN if none has."""
        both = [[case.get(name, quantity, metric, **where).value for case in pair] for pair in self.pairs]
        known = np.array([figures for figures in both if np.isfinite(figures).all()]).reshape(-1, 2)
        return Cost(*known.mean(axis=0)) if len(known) else Cost(float("nan"), float("nan"))


def pairs_of(all_cases: Sequence[Case], ablation: Ablation) -> list[Pairs]:
    """First cases and their twins with an ablation, by vehicle, mount, IMU and odometry."""
    several = len({case.labels["vehicle"] for case in all_cases}) > 1
    groups: dict[str, list[tuple[Case, Case]]] = {}
    for case in first_cases(all_cases):
        twin, labels = ablated(case, all_cases, ablation), case.labels
        if twin is not None:
            words = [*[labels["vehicle"]] * several, f"IMU {imu_words(labels)}"]
            words.append(f"odometry {labels['odometry']}")
            groups.setdefault(" \u00b7 ".join(words), []).append((case, twin))
    return [Pairs(title, ablation, pairs) for title, pairs in groups.items()]


def attitude_costs(group: Pairs, styles: Sequence[MethodStyle]) -> dict[str, list[Cost]]:
    """Rms errors in degrees over whole rides, in the order of `ATTITUDE`, by the name of the method."""
    costs = {s.name: [group.cost(s.name, quantity, "rms") for quantity, _ in ATTITUDE] for s in styles}
    return {name: own for name, own in costs.items() if np.isfinite(own).any()}


def rails_costs(group: Pairs, styles: Sequence[MethodStyle]) -> dict[str, list[Cost]]:
    """Sd of the errors of the rails in the band that a case is judged in, mm, by the name of the method."""
    band = judged_band(group.pairs[0][0])
    costs = {s.name: [group.cost(s.name, quantity, "sd", band=band) for quantity in JUDGED] for s in styles}
    return {name: own for name, own in costs.items() if np.isfinite(own).any()}


def cost_table(
    costs: dict[str, list[Cost]], styles: Sequence[MethodStyle], titles: Sequence[str], ablation: Ablation
) -> Table:
    """A row per method: each figure as a train has it and, beside it, with the ablation."""
    rows: list[Row] = []
    for style in styles:
        if style.name in costs:
            figures = [figure for cost in costs[style.name] for figure in cost]
            rows.append(method_row(style, [number_cell(figure) for figure in figures]))
    return Table([(title, 2) for title in titles], list(WORDS[ablation].heads) * len(titles), rows)


def cost_tables(group: Pairs, attitude: Sequence[MethodStyle], styles: Sequence[MethodStyle]) -> list[Table]:
    """Tables of one group: rails where they are scored, and the attitude."""
    tables = []
    rails, angles = rails_costs(group, styles), attitude_costs(group, attitude)
    if rails:
        band = judged_band(group.pairs[0][0])
        where = "unfiltered" if band == FULL else band
        titles = [f"{QUANTITIES[quantity]} sd, {where}, mm" for quantity in JUDGED]
        tables.append(cost_table(rails, styles, titles, group.ablation))
    if angles:
        titles = [f"{words} error, \u00b0 rms" for _, words in ATTITUDE]
        tables.append(cost_table(angles, attitude, titles, group.ablation))
    return tables
