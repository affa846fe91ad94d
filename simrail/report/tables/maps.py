"""What a map that errs costs: each method's error with it, and with an exact one beside it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from simrail.report.tables.geometry import JUDGED, QUANTITIES, judged_band
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, with_exact_map
from simrail.report.tables.tables import Row, Table, method_row, number_cell
from simrail.scoring.table import FULL

ATTITUDE = (("roll", "roll"), ("pitch", "pitch"), ("yaw_debiased", "yaw\u00b9"))
"""Angles that are compared, and their words."""

HEADS = ("the map errs", "exact")
"""Columns of a comparison."""


class MapCost(NamedTuple):
    """One figure of one method, mean over the same cases.

    Attributes
    ----------
    erring, exact : float
        With a map that errs, and with an exact one.
    """

    erring: float
    exact: float


class MapGroup(NamedTuple):
    """Cases of one mount, IMU and odometry, each with an exact map beside it.

    Attributes
    ----------
    title : str
        Mount, IMU and odometry, and vehicle where there are several.
    pairs : list of (Case, Case)
        With a map that errs, and with an exact one.
    """

    title: str
    pairs: list[tuple[Case, Case]]

    def cost(self, name: str, quantity: str, metric: str, **where: str) -> MapCost:
        """Means of a figure over the pairs that have both; NaN if none has."""
        both = [[case.get(name, quantity, metric, **where).value for case in pair] for pair in self.pairs]
        known = np.array([figures for figures in both if np.isfinite(figures).all()]).reshape(-1, 2)
        return MapCost(*known.mean(axis=0)) if len(known) else MapCost(float("nan"), float("nan"))


def map_groups(all_cases: Sequence[Case]) -> list[MapGroup]:
    """Cases with a map that errs and their twins with an exact one, by vehicle, mount, IMU and odometry."""
    several = len({case.labels["vehicle"] for case in all_cases}) > 1
    groups: dict[str, list[tuple[Case, Case]]] = {}
    for case in all_cases:
        exact, labels = with_exact_map(case, all_cases), case.labels
        if exact is not None:
            words = [*[labels["vehicle"]] * several, f"IMU {labels['mount']} ({labels['imu']})"]
            words.append(f"odometry {labels['odometry']}")
            groups.setdefault(" \u00b7 ".join(words), []).append((case, exact))
    return [MapGroup(title, pairs) for title, pairs in groups.items()]


def attitude_costs(group: MapGroup, styles: Sequence[MethodStyle]) -> dict[str, list[MapCost]]:
    """Rms errors in degrees over whole rides, in the order of `ATTITUDE`, by the name of the method."""
    costs = {s.name: [group.cost(s.name, quantity, "rms") for quantity, _ in ATTITUDE] for s in styles}
    return {name: own for name, own in costs.items() if np.isfinite(own).any()}


def rails_costs(group: MapGroup, styles: Sequence[MethodStyle]) -> dict[str, list[MapCost]]:
    """Sd of the errors of the rails in the band that a case is judged in, mm, by the name of the method."""
    band = judged_band(group.pairs[0][0])
    costs = {s.name: [group.cost(s.name, quantity, "sd", band=band) for quantity in JUDGED] for s in styles}
    return {name: own for name, own in costs.items() if np.isfinite(own).any()}


def map_table(costs: dict[str, list[MapCost]], styles: Sequence[MethodStyle], titles: Sequence[str]) -> Table:
    """A row per method: each figure with a map that errs and, beside it, with an exact one."""
    rows: list[Row] = []
    for style in styles:
        if style.name in costs:
            figures = [figure for cost in costs[style.name] for figure in cost]
            rows.append(method_row(style, [number_cell(figure) for figure in figures]))
    return Table([(title, 2) for title in titles], list(HEADS) * len(titles), rows)


def map_tables(
    group: MapGroup, attitude: Sequence[MethodStyle], styles: Sequence[MethodStyle]
) -> list[Table]:
    """Tables of one group: rails where they are scored, and the attitude."""
    tables = []
    rails, angles = rails_costs(group, styles), attitude_costs(group, attitude)
    if rails:
        band = judged_band(group.pairs[0][0])
        where = "unfiltered" if band == FULL else band
        titles = [f"{QUANTITIES[quantity]} sd, {where}, mm" for quantity in JUDGED]
        tables.append(map_table(rails, styles, titles))
    if angles:
        tables.append(map_table(angles, attitude, [f"{words} error, \u00b0 rms" for _, words in ATTITUDE]))
    return tables
