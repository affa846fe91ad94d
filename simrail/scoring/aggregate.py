"""A score table averaged over its draws: one row per figure of a case, and how sure it is."""

import numpy as np
import pandas as pd

from simrail.scoring import table
from simrail.scoring.bootstrap import mean_interval
from simrail.scoring.metrics import SHARES

AGGREGATE_COLUMNS = ("value", "low95", "high95", "sd_sensor", "sd_track", "track_draws", "draws", "failed")
"""What `aggregate` says of a figure."""


_SIGNED = ("mean", "final")
"""Metrics that may be negative; the interval of any other ends at 0."""


def aggregate(scores: pd.DataFrame, cells: pd.DataFrame | None = None) -> pd.DataFrame:
    """Average the figures over draws, the two levels of the Monte Carlo apart.

    Parameters
    ----------
    scores : pandas.DataFrame
        A score table with labels.
    cells : pandas.DataFrame, optional
        One row per cell (column ``cell``) with the values of the scenario's axes, in columns that
        the score table does not have: figures of unlike axes are never averaged. Columns that differ
        between the cells of one ``case`` are draws of a distribution, no axes, and are left out.

    Returns
    -------
    pandas.DataFrame
        The text columns and axes, then ``value`` (mean over all draws that are ok), ``low95`` and
        ``high95`` (its 95 % interval, over tracks, or over the draws of the sensors where there is one
        track: `simrail.scoring.bootstrap`), ``sd_sensor`` (pooled standard deviation between sensor draws of
        one track), ``sd_track`` (standard deviation between the means of the tracks, of all samples),
        ``track_draws``, ``draws`` (ok), ``failed`` (`simrail.scoring.table.is_failure`). What the number of
        draws does not allow is empty.
    """
    axes: list[str] = []
    track = ["track_draw"]
    # In the order of the cells, whoever was ready first: sums and resamples depend on it.
    frame = scores.drop(columns=["n_samples"]).sort_values("cell", kind="stable")
    if cells is not None:
        axes = axis_columns(cells)
        track = [*(["sample"] if "sample" in cells else []), *track]
        frame = frame.merge(cells[["cell", *axes, *track[:-1]]], on="cell", how="left")
    # A failed figure keeps the group of its fellows: the reason is counted, not grouped by.
    frame["failed"] = table.is_failure(frame).astype(np.int64)
    labels = [name for name in table.LABEL_COLUMNS if name not in table.INTEGER_COLUMNS]
    figure = [name for name in table.FIGURE_COLUMNS if name not in ("value", "n_samples", "status")]
    keys = [*labels, *axes, *figure]
    by_figure = frame.groupby(keys, observed=True, dropna=False, sort=False)
    per_track = (
        frame.groupby([*keys, *track], observed=True, dropna=False, sort=False)
        .agg(mean=("value", "mean"), var=("value", "var"), draws=("value", "count"), failed=("failed", "sum"))
        .reset_index()
    )
    per_track["total"] = per_track["mean"].fillna(0.0) * per_track["draws"]
    per_track["spread"] = per_track["var"].fillna(0.0) * (per_track["draws"] - 1).clip(lower=0)
    per_track["freedom"] = (per_track["draws"] - 1).clip(lower=0)
    per_track["tracks"] = (per_track["draws"] > 0).astype(np.int64)
    grouped = per_track.groupby(keys, observed=True, dropna=False, sort=False)
    sums = grouped[["total", "draws", "failed", "spread", "freedom", "tracks"]].sum()
    several = (sums["tracks"] > 1).to_numpy()
    number = grouped.ngroup().to_numpy()
    low, high = _bounds(number, per_track["total"].to_numpy(), per_track["draws"].to_numpy(), several)
    alone = _bounds(
        by_figure.ngroup().to_numpy(),
        frame["value"].fillna(0.0).to_numpy(),
        frame["value"].notna().to_numpy(),
        ~several,
    )
    result = pd.DataFrame(
        {
            "value": sums["total"] / sums["draws"].where(sums["draws"] > 0),
            "low95": np.where(several, low, alone[0]),
            "high95": np.where(several, high, alone[1]),
            "sd_sensor": np.sqrt(sums["spread"] / sums["freedom"].where(sums["freedom"] > 0)),
            "sd_track": grouped["mean"].std(),
            "track_draws": sums["tracks"],
            "draws": sums["draws"],
            "failed": sums["failed"],
        }
    )
    result = result.reset_index()
    result["low95"] = result["low95"].clip(lower=0.0).where(~result["metric"].isin(_SIGNED), result["low95"])
    result["high95"] = result["high95"].clip(upper=1.0).where(result["metric"].isin(SHARES), result["high95"])
    return result


def axis_columns(cells: pd.DataFrame) -> list[str]:
    """Columns of the table of cells that tell its cases apart: neither labels nor draws."""
    names = [str(name) for name in cells.columns if name not in (*table.SCORE_COLUMNS, "sample")]
    if "case" not in names:
        return names
    most = cells.groupby("case")[names].nunique(dropna=False).max()
    return [name for name in names if most[name] <= 1]


def _bounds(
    group: np.ndarray, total: np.ndarray, count: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (g,) of the wanted groups, NaN for others, from the sums and counts of their clusters (m,).

    Groups are numbered in the order in which they are first met, in both of the tables above.
    """
    low, high = np.full(len(wanted), np.nan), np.full(len(wanted), np.nan)
    rows = np.flatnonzero(wanted[group] & (count > 0))
    if len(rows) == 0:
        return low, high
    which, group_rows = np.unique(group[rows], return_inverse=True)
    place = pd.Series(group_rows).groupby(group_rows).cumcount().to_numpy()
    sums = np.zeros((len(which), int(place.max()) + 1))
    counts = np.zeros_like(sums)
    sums[group_rows, place] = total[rows]
    counts[group_rows, place] = count[rows]
    _, low[which], high[which] = mean_interval(sums, counts)
    return low, high
