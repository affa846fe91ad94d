"""Make ``validation_quick.csv`` anew: ``python results/reference/make.py``, some minutes.

The table holds the main figures of every cell of the scenario, one row per recording and estimator, so
that any of its cells can be held against it (``tests/test_validation.py``). Whoever changes a method, a
sensor or an engine makes it anew, and the difference shows in review what the change did.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from simrail.campaign.campaign import CampaignResult, run_campaign
from simrail.scenario.scenario import load_scenario

SCENARIO = "validation_quick"
TABLE = Path(__file__).with_name(f"{SCENARIO}.csv")
KEYS = ["speed_kmh", "direction", "irregularity.scale", "imu", "track_draw", "sensor_draw", "estimator"]
FIGURES = {
    "roll": ("roll", "rms", "whole"),
    "roll_in_curves": ("roll", "rms", "curve"),
    "pitch": ("pitch", "rms", "whole"),
    "yaw_debiased": ("yaw_debiased", "rms", "whole"),
    "nees_of_roll": ("roll", "nees", "whole"),
}
"""Columns of the table: quantity, metric, window; against the truth."""


def table_of(result: CampaignResult) -> pd.DataFrame:
    """Main figures of every cell and estimator, sorted by `KEYS`; empty where a method has none."""
    scores = result.scores[result.scores["reference"] == "truth"]
    columns = {}
    for name, (quantity, metric, window) in FIGURES.items():
        chosen = (
            (scores["quantity"] == quantity) & (scores["metric"] == metric) & (scores["window"] == window)
        )
        rows = scores[chosen].astype({"estimator": str})
        columns[name] = rows.set_index(["cell", "estimator"])["value"]
    table = pd.DataFrame(columns).reset_index()
    where = result.cells[["cell", *(key for key in KEYS if key != "estimator")]]
    return table.merge(where, on="cell")[[*KEYS, *FIGURES]].sort_values(KEYS, ignore_index=True)


def main() -> None:
    """Run the scenario and write the table."""
    result = run_campaign(load_scenario(SCENARIO))
    if result.failures:
        raise SystemExit(f"{len(result.failures)} failures, e.g. {result.failures[0].reason}")
    table_of(result).to_csv(TABLE, index=False, float_format="%.9g")
    print(f"wrote {TABLE}: {len(result.cells)} cells")


if __name__ == "__main__":
    main()
