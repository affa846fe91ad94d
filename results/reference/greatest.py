"""Say what the greatest errors of 95 % of the rides of ``simrail run scale_greatest --out DIR`` stay below.

    python results/reference/greatest.py DIR

In D1 of the scale track, mm, with the 95 % interval that resamples rides.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd

RESAMPLES = 2000


def main() -> None:
    """Print the table."""
    scores = pd.read_parquet(Path(sys.argv[1]) / "scores.parquet")
    chosen = scores["metric"].eq("max") & scores["band"].eq("scaled_d1") & scores["window"].eq("whole")
    random, rows = np.random.default_rng(0), []
    for names, own in scores[chosen].groupby(["estimator", "quantity"], observed=True):
        values = own["value"].dropna().to_numpy()
        drawn = np.quantile(random.choice(values, (RESAMPLES, len(values))), 0.95, axis=1)
        low, high = np.quantile(drawn, [0.025, 0.975])
        rows.append((*names, len(values), values.mean(), np.quantile(values, 0.95), low, high, values.max()))
    columns = ["estimator", "quantity", "rides", "mean", "p95", "low", "high", "greatest"]
    print(pd.DataFrame(rows, columns=columns).round(3).to_string(index=False))


if __name__ == "__main__":
    main()
