"""Make ``track_relative.csv`` of the results of ``simrail run track_relative``, and likewise of two others.

    simrail run track_relative --out DIR
    python results/reference/track_relative.py DIR
    simrail run track_relative_parts --out DIR
    python results/reference/track_relative.py DIR
    simrail run coverage --out DIR
    python results/reference/track_relative.py DIR

One row per vehicle, mount, method and quantity: the root of the mean square error over all rides with its
95 % interval (whole samples, which have rails, map and device of their own, are resampled), the 95th
percentile of the rides' rms, how much of the time the method's own intervals hold (those of
95 % with an interval, likewise), over how much of the way
the error is beyond the method's bound, that bound's median, and the share of the way behind a fault.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.scoring.bootstrap import interval

QUANTITIES = ("roll", "pitch", "yaw_debiased", "position", "speed")
TOLD = (
    *("coverage50", "coverage90", "coverage95", "coverage99", "coverage999"),
    *("bound", "outside", "fault"),
)
BY = ["vehicle", "mount", "estimator", "quantity"]


def whole_of(scores: pd.DataFrame, cells: pd.DataFrame) -> pd.DataFrame:
    """Figures of whole rides against the truth, with their samples."""
    whole = scores[(scores["reference"] == "truth") & (scores["window"] == "whole")]
    whole = whole[whole["quantity"].isin(QUANTITIES)].drop(columns="sample", errors="ignore")
    return whole.merge(cells[["cell", "sample"]], on="cell").astype({"estimator": str})


def pooled(whole: pd.DataFrame) -> pd.DataFrame:
    """How much of the time the intervals of 95 % hold, over all vehicles and mounts."""
    rows = []
    held = whole[(whole["metric"] == "coverage95") & whole["value"].notna()]
    for key, group in held.groupby(["estimator", "quantity"], observed=True):
        share = interval(group["value"], group["sample"]).within(0.0, 1.0)
        rows.append((*key, group["sample"].nunique(), len(group), share.value, share.low, share.high))
    columns = ["estimator", "quantity", "samples", "recordings", "coverage95", "low", "high"]
    return pd.DataFrame(rows, columns=columns)


def table_of(whole: pd.DataFrame) -> pd.DataFrame:
    """Rows as the module says them."""
    rows = []
    for key, group in whole.groupby(BY, observed=True):
        errors = group[group["metric"] == "rms"]
        if errors.empty:
            continue
        square = interval(errors["value"] ** 2, errors["sample"]).within(0.0)
        low, high = np.sqrt([square.low, square.high])
        told = group.groupby("metric", observed=True)["value"].mean()
        held = group[group["metric"] == "coverage95"]
        share = interval(held["value"], held["sample"]).within(0.0, 1.0)
        figures = {
            "rides": len(errors),
            "rms": np.sqrt(square.value),
            "low": low,
            "high": high,
            "p95": errors["value"].quantile(0.95),
        } | {name: told.get(name, np.nan) for name in TOLD}
        figures |= {"coverage95_low": share.low, "coverage95_high": share.high}
        rows.append(dict(zip(BY, key, strict=True)) | figures)
    return pd.DataFrame(rows)


def main() -> None:
    """Read the results named on the command line, and write the table."""
    folder = Path(sys.argv[1])
    scores, cells = (pd.read_parquet(folder / f"{name}.parquet") for name in ("scores", "cells"))
    whole = whole_of(scores, cells)
    table = table_of(whole)
    name = json.loads((folder / "manifest.json").read_text())["scenario"]
    path = Path(__file__).with_name(f"{name}.csv")
    table.to_csv(path, index=False, float_format="%.4g")
    print(pooled(whole).to_string(index=False, float_format="%.3f"))
    print(f"wrote {path}: {len(table)} rows")


if __name__ == "__main__":
    main()
