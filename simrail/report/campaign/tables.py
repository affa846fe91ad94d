"""Tables of a campaign as a whole: methods with their intervals, pairs of methods, worst cells.

They are frames, for files (`write_tables`) and for the page alike. Means over all cells weigh every cell
alike; tracks are the clusters of every interval, the same track draw in all cases being one of them, since
cases meet the same draws.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.report.campaign.axes import CampaignAxis, cluster_of, draws_of
from simrail.report.tables.methods import MethodStyle
from simrail.scoring.bootstrap import Interval, interval
from simrail.scoring.statistics import anees_bounds, compare, coverage_bounds, levels

HEADLINES = (
    ("roll", "rms", "whole"),
    ("roll", "rms", "curve"),
    ("pitch", "rms", "whole"),
    ("yaw_debiased", "rms", "whole"),
)
WORST_PER_METHOD = 3
MOST_PAIRS = 16


@dataclass(frozen=True)
class CampaignTables:
    """Frames with plain columns; angles in degrees.

    Attributes
    ----------
    methods : pandas.DataFrame
        One row per method and headline: mean, interval, spread by sensors and by tracks within a case,
        95th percentile over cells, number of draws.
    axes : pandas.DataFrame
        One row per method, axis and value: mean roll error and its interval.
    pairs : pandas.DataFrame
        Two methods over the same recordings: difference, win rate, effect size.
    consistency : pandas.DataFrame
        NEES and coverage of roll with the bounds of a consistent method.
    worst : pandas.DataFrame
        Cells of the largest roll error, with the command that makes each again.
    """

    methods: pd.DataFrame
    axes: pd.DataFrame
    pairs: pd.DataFrame
    consistency: pd.DataFrame
    worst: pd.DataFrame


def campaign_tables(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    axes: Sequence[CampaignAxis],
    styles: Sequence[MethodStyle],
    *,
    command: str,
) -> CampaignTables:
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
    """
    roll = draws_of(scores, cells, axes)
    present = [style for style in styles if (roll["estimator"] == style.name).any()]
    return CampaignTables(
        methods=_methods(scores, cells, axes, present),
        axes=_along(roll, axes, present),
        pairs=_pairs(roll, present),
        consistency=_consistency(scores, cells, axes, present),
        worst=_worst(roll, axes, present, command),
    )


def _methods(
    scores: pd.DataFrame, cells: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle]
) -> pd.DataFrame:
    rows = []
    for quantity, metric, window in HEADLINES:
        draws = draws_of(scores, cells, axes, quantity=quantity, metric=metric, window=window)
        draws["cluster"] = cluster_of(draws)
        for style in styles:
            own = draws[draws["estimator"] == style.name]
            if own.empty:
                continue
            mean = interval(own["value"], own["cluster"])
            sensor, track = _levels_within_cases(own)
            rows.append(
                {
                    "method": style.name,
                    "quantity": quantity,
                    "metric": metric,
                    "window": window,
                    **_told(mean),
                    "sd_sensor": sensor,
                    "sd_track": track,
                    "p95_of_cells": float(np.percentile(own["value"], 95.0)),
                    "draws": len(own),
                    "tracks": own["cluster"].nunique(),
                }
            )
    return pd.DataFrame(rows)


def _levels_within_cases(draws: pd.DataFrame) -> tuple[float, float]:
    """Spread by sensors and by tracks within a case: root mean square over the cases."""
    if "case" not in draws:
        return levels(draws["value"], draws["cluster"])
    found = np.array([levels(part["value"], part["cluster"]) for _, part in draws.groupby("case")])
    known = np.isfinite(found)
    count = known.sum(axis=0)
    squares = np.where(known, found, 0.0) ** 2
    sensor, track = np.where(count > 0, np.sqrt(squares.sum(axis=0) / np.maximum(count, 1)), np.nan)
    return float(sensor), float(track)


def _along(draws: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle]) -> pd.DataFrame:
    draws = draws.assign(cluster=cluster_of(draws))
    rows = []
    for axis in axes:
        for value, word in zip(axis.values, axis.words, strict=True):
            at = draws[draws[axis.column] == value]
            for style in styles:
                own = at[at["estimator"] == style.name]
                if len(own):
                    mean = interval(own["value"], own["cluster"])
                    rows.append({"axis": axis.title, "value": word, "method": style.name, **_told(mean)})
    return pd.DataFrame(rows)


def _pairs(draws: pd.DataFrame, styles: Sequence[MethodStyle]) -> pd.DataFrame:
    """Methods under test: against their own without compensation, each other, and the baselines."""
    draws = draws.assign(cluster=cluster_of(draws))
    table = draws.pivot_table(index=["cell", "cluster"], columns="estimator", values="value", observed=True)
    table = table.sort_index()
    tested = [style for style in styles if not style.baseline]
    wanted = [(one, other) for one in tested for other in styles if other.name == one.twin]
    wanted += [(one, other) for i, one in enumerate(tested) for other in tested[i + 1 :]]
    for kind in ("no IMU", "general purpose"):
        wanted += [(one, other) for one in tested for other in styles if other.baseline == kind]
    rows = []
    for one, other in wanted[:MOST_PAIRS]:
        found = compare(table[one.name], table[other.name], table.index.get_level_values("cluster"))
        rows.append(
            {
                "method": one.name,
                "against": other.name,
                "difference": found.difference.value,
                "difference_low95": found.difference.low,
                "difference_high95": found.difference.high,
                "win_rate": found.win_rate.value,
                "win_rate_low95": found.win_rate.low,
                "win_rate_high95": found.win_rate.high,
                "effect_size": found.effect_size,
                "pairs": found.pairs,
            }
        )
    return pd.DataFrame(rows)


def _consistency(
    scores: pd.DataFrame, cells: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle]
) -> pd.DataFrame:
    rows = []
    for metric, bounds_of in (("nees", anees_bounds), ("coverage95", coverage_bounds)):
        draws = draws_of(scores, cells, axes, metric=metric)
        draws["cluster"] = cluster_of(draws)
        for style in styles:
            own = draws[draws["estimator"] == style.name]
            if own.empty:
                continue
            tracks = int(own["cluster"].nunique())
            # What lasts for a ride may come from the track: only tracks are independent for certain.
            low, high = bounds_of(tracks)
            mean = interval(own["value"], own["cluster"])
            rows.append(
                {
                    "method": style.name,
                    "metric": metric,
                    **_told(mean, highest=1.0 if metric == "coverage95" else np.inf),
                    "lower_bound": low,
                    "upper_bound": high,
                    "inside": low <= mean.value <= high,
                    "tracks": tracks,
                }
            )
    return pd.DataFrame(rows)


def _worst(
    draws: pd.DataFrame, axes: Sequence[CampaignAxis], styles: Sequence[MethodStyle], command: str
) -> pd.DataFrame:
    tested = [style for style in styles if not style.baseline] or list(styles)
    rows = []
    for style in tested:
        own = draws[draws["estimator"] == style.name].nlargest(WORST_PER_METHOD, "value")
        for record in own.to_dict("records"):
            where = {axis.title: axis.words[axis.values.index(record[axis.column])] for axis in axes}
            number = int(record["cell"])
            rows.append(
                {
                    "method": style.name,
                    "rms_roll_deg": float(record["value"]),
                    **where,
                    "track_draw": int(record["track_draw"]),
                    "sensor_draw": int(record["sensor_draw"]),
                    "cell": number,
                    "command": f"{command} --cell {number}",
                }
            )
    return pd.DataFrame(rows)


def _told(found: Interval, *, highest: float = np.inf) -> dict[str, float]:
    """Mean and interval of what is never negative: no bound is where no value can be."""
    low, high = np.clip([found.low, found.high], 0.0, highest)
    return {"mean": found.value, "low95": float(low), "high95": float(high)}


def write_tables(folder: Path, tables: CampaignTables) -> None:
    """Write every table as CSV and as a LaTeX ``tabular`` (which needs the package booktabs)."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("methods", "axes", "pairs", "consistency", "worst"):
        frame: pd.DataFrame = getattr(tables, name)
        if frame.empty:
            continue
        frame.to_csv(folder / f"{name}.csv", index=False, float_format="%.6g")
        text = frame.to_latex(index=False, escape=True, float_format="%.4g", na_rep="--")
        (folder / f"{name}.tex").write_text(text.replace("\u00b0", r"$^\circ$"), encoding="utf-8")
