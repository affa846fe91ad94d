"""Tables of a campaign as a whole: methods with their intervals, pairs of methods, worst cells.

They are frames, for files (`write_tables`) and for the page alike. Means weigh every cell alike, are of one
IMU, mount and vehicle each, and of what a train has: cells of an ablation beside it stand on the axis of that
ablation only.
Tracks are the clusters of every interval, the same track draw in all cases being one of them, since cases
meet the same draws.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from simrail.core.csv_files import write_csv
from simrail.report.campaign.axes import CampaignAxis, along, beside_ablations, draws_of
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.question import UNLIKE
from simrail.scoring.ablations import without_ablations
from simrail.scoring.bootstrap import interval
from simrail.scoring.statistics import anees_bounds, compare, coverage_bounds, levels

HEADLINES = {
    "roll": ("roll", "rms", "whole"),
    "roll in curves": ("roll", "rms", "curve"),
    "pitch": ("pitch", "rms", "whole"),
    "yaw\u00b9": ("yaw_debiased", "rms", "whole"),
}
"""Quantity, metric and window of what methods are compared by, and their titles."""

TABLES = "tables"
"""Folder beside the page for the tables of a campaign, as CSV and LaTeX."""

WORST_PER_METHOD = 1
MOST_PAIRS = 16


def campaign_tables(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    styles: Sequence[MethodStyle],
    *,
    command: str,
) -> dict[str, pd.DataFrame]:
    """Make all tables of a campaign.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        Score table and table of cells.
    axes : sequence of CampaignAxis
        What the cells differ in.
    styles : sequence of MethodStyle
        Methods, in their order.
    command : str
        What ran the campaign, e.g. ``"simrail run validation"``.

    Returns
    -------
    dict of str to pandas.DataFrame
        Frames with plain columns; angles in degrees.

        ``of`` of the first, third and fourth names the IMU, mount and whatever else of `UNLIKE` the rows are
        of; it is empty where there is but one.

        ``methods``: one row per method and headline: mean, interval, spread by sensors and by tracks within a
        case, 95th percentile over cells, number of draws. ``axes``: one row per method, axis and value: mean
        roll error and its interval. ``pairs``: two methods over the same recordings: difference, win rate,
        effect size. ``consistency``: NEES and coverage of roll with the bounds of a consistent method.
        ``worst``: cells of the largest roll error, with the command that makes each again.
    """
    of_all = {
        (quantity, metric, window): draws_of(
            scores, cells, axes, quantity=quantity, metric=metric, window=window
        )
        for quantity, metric, window in HEADLINES.values()
    }
    headlines = {figure: without_ablations(draws) for figure, draws in of_all.items()}
    trust = {
        metric: without_ablations(draws_of(scores, cells, axes, metric=metric))
        for metric in ("nees", "coverage95")
    }
    roll = headlines[HEADLINES["roll"]]
    present = [style for style in styles if (roll["estimator"] == style.name).any()]
    groups = groups_of(cells)

    def in_each(make: Callable[[frozenset[int]], list[dict[str, Any]]]) -> list[dict[str, Any]]:
        return [{"of": words} | row for words, numbers in groups.items() for row in make(numbers)]

    rows = {
        "methods": in_each(lambda numbers: _methods(_of_cells(headlines, numbers), present)),
        "axes": _along(of_all[HEADLINES["roll"]], axes, present),
        "pairs": in_each(lambda numbers: _pairs(roll[roll["cell"].isin(numbers)], present)),
        "consistency": in_each(lambda numbers: _consistency(_of_cells(trust, numbers), present)),
        "worst": _worst(roll, beside_ablations(axes), present, command),
    }
    return {name: pd.DataFrame(lines) for name, lines in rows.items()}


def groups_of(cells: pd.DataFrame) -> dict[str, frozenset[int]]:
    """Numbers of the cells of each combination of `UNLIKE` that a campaign has, by its words."""
    kept = without_ablations(cells)
    varying = [name for name in UNLIKE if name in kept and len(kept[name].unique()) > 1]
    if not varying:
        return {"": frozenset(kept["cell"])}
    order: list[str] = [name for name in ("imu", "mount", "vehicle") if name in varying]
    order += [name for name in varying if name not in order]
    between = {"mount": "on", "vehicle": "of"}

    def words(names: tuple[object, ...]) -> str:
        told = [
            f"{between.get(key, '')} {name}".strip() if i else str(name)
            for i, (key, name) in enumerate(zip(order, names, strict=True))
        ]
        return " ".join(told)

    return {
        words(names if isinstance(names, tuple) else (names,)): frozenset(own["cell"])
        for names, own in kept.groupby(order, sort=False, observed=True)
    }


_Key = TypeVar("_Key")


def _of_cells(draws: Mapping[_Key, pd.DataFrame], numbers: frozenset[int]) -> dict[_Key, pd.DataFrame]:
    """Draws of some cells."""
    return {key: frame[frame["cell"].isin(numbers)] for key, frame in draws.items()}


def _by_method(
    draws: pd.DataFrame, styles: Sequence[MethodStyle], *, highest: float = np.inf
) -> Iterator[tuple[str, pd.DataFrame, dict[str, float]]]:
    """Name and draws of each method that has any, and their mean with its interval.

    What they are of is never negative, nor above `highest`: no bound is where no value can be.
    """
    for style in styles:
        own = draws[draws["estimator"] == style.name]
        if len(own):
            mean = interval(own["value"], own["cluster"])
            low, high = np.clip([mean.low, mean.high], 0.0, highest)
            yield style.name, own, {"mean": mean.value, "low95": float(low), "high95": float(high)}


def _methods(
    headlines: Mapping[tuple[str, str, str], pd.DataFrame], styles: Sequence[MethodStyle]
) -> list[dict[str, Any]]:
    rows = []
    for (quantity, metric, window), draws in headlines.items():
        for name, own, mean in _by_method(draws, styles):
            # Spread by sensors and by tracks within a case: root mean square over the cases.
            spreads = pd.DataFrame(levels(one["value"], one["cluster"]) for _, one in own.groupby("case"))
            sensor, track = np.sqrt((spreads**2).mean())
            rows.append(
                {
                    "method": name,
                    "quantity": quantity,
                    "metric": metric,
                    "window": window,
                    **mean,
                    "sd_sensor": sensor,
                    "sd_track": track,
                    "p95_of_cells": float(np.percentile(own["value"], 95.0)),
                    "draws": len(own),
                    "tracks": own["cluster"].nunique(),
                }
            )
    return rows


def _along(
    draws: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle]
) -> list[dict[str, Any]]:
    return [
        {"axis": axis.title, "value": word, "method": name, **mean}
        for axis in axes
        for value, word in zip(axis.values, axis.words, strict=True)
        for name, _, mean in _by_method(_at(draws, axis, value), styles)
    ]


def _at(draws: pd.DataFrame, axis: CampaignAxis, value: object) -> pd.DataFrame:
    """Draws with a value of an axis."""
    own = along(draws, axis)
    return own[own[axis.column] == value]


def _pairs(draws: pd.DataFrame, styles: Sequence[MethodStyle]) -> list[dict[str, Any]]:
    """Methods under test: against their own without compensation, each other, and the baselines."""
    table = draws.pivot_table(index=["cell", "cluster"], columns="estimator", values="value", observed=True)
    table = table.sort_index()
    tested = [style for style in styles if not style.baseline]
    wanted = [(one, other) for one in tested for other in styles if other.name == one.twin]
    wanted += [(one, other) for i, one in enumerate(tested) for other in tested[i + 1 :]]
    for kind in ("no IMU", "general purpose"):
        wanted += [(one, other) for one in tested for other in styles if other.baseline == kind]
    rows = []
    for one, other in wanted[:MOST_PAIRS]:
        pair = compare(table[one.name], table[other.name], table.index.get_level_values("cluster"))
        row: dict[str, Any] = {"method": one.name, "against": other.name}
        for name, figure in (("difference", pair.difference), ("win_rate", pair.win_rate)):
            row |= {name: figure.value, f"{name}_low95": figure.low, f"{name}_high95": figure.high}
        rows.append(row | {"effect_size": pair.effect_size, "pairs": pair.pairs})
    return rows


def _consistency(trust: Mapping[str, pd.DataFrame], styles: Sequence[MethodStyle]) -> list[dict[str, Any]]:
    rows = []
    for metric, bounds_of, highest in (("nees", anees_bounds, np.inf), ("coverage95", coverage_bounds, 1.0)):
        for name, own, mean in _by_method(trust[metric], styles, highest=highest):
            tracks = int(own["cluster"].nunique())
            # What lasts for a ride may come from the track: only tracks are independent for certain.
            low, high = bounds_of(tracks)
            bounds = {"lower_bound": low, "upper_bound": high, "inside": low <= mean["mean"] <= high}
            rows.append({"method": name, "metric": metric, **mean, **bounds, "tracks": tracks})
    return rows


def _worst(
    draws: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle], command: str
) -> list[dict[str, Any]]:
    tested = [style for style in styles if not style.baseline] or list(styles)
    return [
        {
            "method": style.name,
            "rms_roll_deg": float(record["value"]),
            **{axis.title: axis.word_of(record[axis.column]) for axis in axes},
            "track_draw": int(record["track_draw"]),
            "sensor_draw": int(record["sensor_draw"]),
            "cell": int(record["cell"]),
            "command": f"{command} --cell {int(record['cell'])}",
        }
        for style in tested
        for record in draws[draws["estimator"] == style.name]
        .nlargest(WORST_PER_METHOD, "value")
        .to_dict("records")
    ]


def write_tables(folder: Path, tables: Mapping[str, pd.DataFrame]) -> None:
    """Write every table as CSV and as a LaTeX ``tabular`` (it needs booktabs), in a folder of `folder`."""
    (folder / TABLES).mkdir(parents=True, exist_ok=True)
    for name, frame in tables.items():
        if frame.empty:
            continue
        file = folder / TABLES / name
        write_csv(frame, file.with_suffix(".csv"), float_format="%.6g")
        text = frame.to_latex(index=False, escape=True, float_format="%.4g", na_rep="--")
        file.with_suffix(".tex").write_text(text.replace("\u00b0", r"$^\circ$"), encoding="utf-8")
