"""Score tables held against requirements: which IMU, where, with which method, is good enough."""

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from simrail.scoring.ablations import without_ablations
from simrail.scoring.aggregate import axis_columns
from simrail.scoring.requirement import Requirement
from simrail.scoring.share import ENOUGH, NOT_ENOUGH, NOT_JUDGED, UNDECIDED, decide, effective, wilson
from simrail.scoring.statistics import compare
from simrail.scoring.table import OK, is_failure

CASE = ("vehicle", "mount", "imu", "odometry", "map", "vibration", "estimator", "tuning")
"""What a verdict is about, beside its requirement."""

GROUP = ("vehicle", "mount", "imu")
"""What is drawn together: the verdicts of a grade at a mount."""

DEVICE = ("sample", "track_draw", "sensor_draw")
"""What tells devices apart."""

ORDER = (ENOUGH, NOT_ENOUGH, UNDECIDED, NOT_JUDGED)
"""Of verdicts, in tables."""


def device_figures(scores: pd.DataFrame, cells: pd.DataFrame, wanted: Requirement) -> pd.DataFrame:
    """The figure that each device has: the worst of the rides that it must meet the limit on.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        A campaign's.
    wanted : Requirement
        Over all rides, or over each kind of them.

    Returns
    -------
    pandas.DataFrame
        `CASE`, with ``over="each"`` the axes as well; `DEVICE`; ``value`` in the table's unit, infinite where
        the method failed on one of the rides, NaN where there is nothing to be judged; ``status``, why.
    """
    chosen = scores
    for name in ("quantity", "band", "reference", "window", "metric"):
        chosen = chosen[(chosen[name] == getattr(wanted, name)).to_numpy()]
    chosen = pd.concat([chosen, _failed_cells(scores, chosen)], ignore_index=True)
    kept = without_ablations(cells)
    axes = axis_columns(kept) if wanted.over == "each" else []
    frame = chosen.merge(kept[["cell", "sample", *axes]], on="cell", how="inner")
    frame = frame.astype(dict.fromkeys((*CASE, "status"), str))
    value = frame["value"].where(frame["status"] == OK)
    frame = frame.assign(value=value.mask(is_failure(frame), np.inf))
    keys = [*CASE, *(["ride"] if wanted.over == "each" else []), *axes, *DEVICE]
    of_devices = frame.groupby(keys, observed=True, dropna=False, sort=False)
    return of_devices.agg(value=("value", "max"), status=("status", "first")).reset_index()


def _failed_cells(scores: pd.DataFrame, chosen: pd.DataFrame) -> pd.DataFrame:
    """Rows of cells on which a method failed altogether, that has the chosen figure on others."""
    failed = scores[is_failure(scores) & scores["estimator"].isin(chosen["estimator"].unique())]
    failed = failed.drop_duplicates(["cell", "estimator"])
    has = pd.MultiIndex.from_frame(chosen[["cell", "estimator"]].astype({"estimator": str}))
    its = pd.MultiIndex.from_frame(failed[["cell", "estimator"]].astype({"estimator": str}))
    return failed[~its.isin(has)]


def verdict_table(
    scores: pd.DataFrame,
    cells: pd.DataFrame,
    requirements: Iterable[Requirement],
    *,
    looks: Sequence[int] = (1,),
) -> pd.DataFrame:
    """A verdict for each requirement, IMU, mount and method.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        A campaign's.
    requirements : iterable of Requirement
        What is asked.
    looks : sequence of int
        Devices at each look of a growing campaign (`simrail.scoring.share.decide`).

    Returns
    -------
    pandas.DataFrame
        ``requirement`` (its words), ``number`` (from 0), `CASE`, axes; ``verdict``, ``devices``, ``passed``,
        ``share`` with ``low95`` and ``high95`` (Wilson, of the effective number of devices), ``tracks``,
        ``effective``; ``median``, and ``at_share``, below which so many devices are as the requirement asks;
        ``unit`` of both; ``reason`` of one that is not judged.
    """
    tables = []
    for number, wanted in enumerate(requirements):
        devices = device_figures(scores, cells, wanted)
        keys = [name for name in devices.columns if name not in (*DEVICE, "value", "status")]
        rows = [
            dict(zip(keys, names, strict=True)) | _verdict(group, wanted, looks)
            for names, group in devices.groupby(keys, observed=True, dropna=False, sort=False)
        ]
        if rows:
            table = pd.DataFrame.from_records(rows)
            table.insert(0, "requirement", wanted.words)
            table.insert(1, "number", number)
            tables.append(table)
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def _verdict(devices: pd.DataFrame, wanted: Requirement, looks: Sequence[int]) -> dict[str, object]:
    """The verdict on the devices of one case."""
    judged = devices[devices["value"].notna()]
    values = judged["value"].to_numpy(dtype=np.float64)
    n, passed = len(values), int((values <= wanted.limit).sum())
    tracks = judged[["sample", "track_draw"]].drop_duplicates()
    labels = judged.groupby(["sample", "track_draw"], sort=False).ngroup().to_numpy()
    count = effective(values, labels) if n else 0.0
    low, high = wilson(passed * count / n, count) if n else (np.nan, np.nan)
    verdict, reason = NOT_JUDGED, ""
    if n:
        verdict = decide(passed * count / n, count, wanted.share, chance=wanted.chance, looks=looks)
    else:
        reason = str(devices["status"].iloc[0])
    return {
        "verdict": verdict,
        "devices": n,
        "passed": passed,
        "share": passed / n if n else np.nan,
        "low95": low,
        "high95": high,
        "tracks": len(tracks),
        "effective": count,
        "median": float(np.median(values)) if n else np.nan,
        "at_share": float(np.quantile(values, wanted.share, method="higher")) if n else np.nan,
        "unit": wanted.unit,
        "reason": reason,
    }


PAIR = ("vehicle", "mount", "odometry", "map", "vibration", "estimator", "tuning")
"""What two IMUs have in common that are compared."""


def imu_pairs(scores: pd.DataFrame, cells: pd.DataFrame, requirements: Iterable[Requirement]) -> pd.DataFrame:
    """Pairs of IMUs by the same method on the same rides: whatever rails and map do to both drops out.

    Parameters
    ----------
    scores, cells : pandas.DataFrame
        A campaign's.
    requirements : iterable of Requirement
        Whose figures are compared.

    Returns
    -------
    pandas.DataFrame
        ``requirement``, ``number``, `PAIR`, ``first``, ``second``; ``difference``, the mean of the first's
        figure less the second's, with ``low95`` and ``high95``, tracks being the clusters; ``won``, on how
        many of ``pairs`` the first's is smaller; ``unit``. A device on which a method failed is left out.
    """
    rows = []
    for number, wanted in enumerate(requirements):
        devices = device_figures(scores, cells, wanted)
        devices = devices[np.isfinite(devices["value"].to_numpy(dtype=np.float64))]
        for names, group in devices.groupby(list(PAIR), observed=True, sort=False):
            rides = [name for name in group.columns if name not in (*CASE, "value", "status")]
            table = group.pivot_table("value", rides, "imu", sort=False)
            for one, other in combinations(dict.fromkeys(group["imu"]), 2):
                both = table[[one, other]].dropna()
                tracks = (
                    both.index.to_frame(index=False).groupby(["sample", "track_draw"], sort=False).ngroup()
                )
                pair = compare(both[one], both[other], tracks.to_numpy())
                rows.append(
                    {"requirement": wanted.words, "number": number}
                    | dict(zip(PAIR, names, strict=True))
                    | {"first": one, "second": other, "difference": pair.difference.value}
                    | {"low95": pair.difference.low, "high95": pair.difference.high}
                    | {"won": int((both[one] < both[other]).sum()), "pairs": pair.pairs}
                    | {"unit": wanted.unit}
                )
    return pd.DataFrame.from_records(rows)


def settled(table: pd.DataFrame) -> set[tuple[str, ...]]:
    """The `GROUP`s of which every verdict is settled: more draws would change nothing."""
    if table.empty:
        return set()
    is_open = (table["verdict"] == UNDECIDED).groupby([table[name] for name in GROUP], sort=False).any()
    return {tuple(str(name) for name in names) for names in is_open.index[~is_open.to_numpy()]}
