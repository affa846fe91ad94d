"""Make ``bounds.csv``: whether the track-relative filter's bounds hold, over runs of the two scenarios.

    simrail run bounds --out DIR
    simrail run bounds_multibody --out OTHER
    python results/reference/bounds.py DIR OTHER ...

One row per engine, vehicle, mount and quantity, and one for all of an engine: rides, simulated rides among
them, the share of the way on which the error was outside its bound without a fault told, with its 95 %
interval (whole simulated rides are resampled, with all their devices and maps, and the percentiles taken:
where nearly all are 0 there is no spread to divide by), the greatest share of any
ride, the median bound, the rides with a fault told though there was none, the error's rms, and how often the
95 % interval held. Several runs, of other seeds, are taken together.

Where nothing was outside, there is nothing to resample: the upper end is then 3/n of n rides (the rule of
three: as if a ride were outside on all of its way or not at all, and devices and maps made its error, not the
rails).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

QUANTITIES = ("position", "roll")
FIGURES = ("outside", "bound", "fault", "rms", "coverage95")
RIDE = ["run", "vehicle", "ride", "direction", "sample", "track_draw"]
"""What tells one simulated ride from another."""

RESAMPLES = 10_000


def scores_of(folder: Path) -> pd.DataFrame:
    """A row per recording and quantity, with the figures as columns."""
    scores, cells = (pd.read_parquet(folder / f"{name}.parquet") for name in ("scores", "cells"))
    kept = scores[
        (scores["reference"] == "truth")
        & (scores["window"] == "whole")
        & scores["quantity"].isin(QUANTITIES)
        & scores["metric"].isin(FIGURES)
    ]
    wide = kept.pivot_table(index=["cell", "quantity"], columns="metric", values="value", observed=True)
    names = ["cell", "engine", "mount", *RIDE[1:]]
    found = wide.reset_index().merge(cells[names], on="cell").assign(run=str(folder))
    return found.astype(dict.fromkeys(("engine", "mount", "vehicle", "ride", "quantity"), str))


def row_of(group: pd.DataFrame) -> dict[str, float]:
    """The figures of some recordings."""
    each = group.groupby(RIDE)["outside"].agg(["sum", "count"]).to_numpy(dtype=np.float64)
    simulated = len(each)
    chosen = np.random.default_rng(1).integers(simulated, size=(RESAMPLES, simulated))
    means = each[chosen].sum(axis=1)
    low, high = np.quantile(means[:, 0] / means[:, 1], (0.025, 0.975))
    some = bool((group["outside"] > 0.0).any())
    return {
        "rides": len(group),
        "simulated": simulated,
        "outside": group["outside"].mean(),
        "low": low,
        "high": high if some else 3.0 / len(group),
        "outside_most": group["outside"].max(),
        "rides_outside": int((group["outside"] > 0.0).sum()),
        "bound": group["bound"].median(),
        "faults": int((group["fault"] > 0.0).sum()),
        "rms": float(np.sqrt((group["rms"] ** 2).mean())),
        "coverage95": group["coverage95"].mean(),
    }


def table_of(scores: pd.DataFrame) -> pd.DataFrame:
    """Rows as the module says them."""
    every = scores.assign(vehicle_shown="all", mount="all")
    rows = []
    for frame in (scores.assign(vehicle_shown=scores["vehicle"]), every):
        for key, group in frame.groupby(["engine", "vehicle_shown", "mount", "quantity"], sort=False):
            rows.append(
                dict(zip(("engine", "vehicle", "mount", "quantity"), key, strict=True)) | row_of(group)
            )
    return pd.DataFrame(rows)


def main() -> None:
    """Read the results named on the command line, and write the table."""
    table = table_of(pd.concat([scores_of(Path(name)) for name in sys.argv[1:]], ignore_index=True))
    path = Path(__file__).with_suffix(".csv")
    table.to_csv(path, index=False, float_format="%.4g")
    print(table.round(4).to_string(index=False))
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
