"""Scores agree to 1e-9 whatever the instructions of the processor are; what does not is seen."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from across_machines import MACHINES, MOST, compare, difference


@pytest.mark.slow
@pytest.mark.parametrize("engine", MOST)
def test_scores_of_other_machines_agree(engine: str, tmp_path: Path) -> None:
    """All methods, on a body on the rails and on springs; minutes, as kernels are compiled for each."""
    found = compare(MACHINES, (), tmp_path, settings=[f"engine={engine!r}"], most=MOST[engine])
    assert found.keys() == MACHINES.keys()
    assert max(found.values()) <= MOST[engine]


def table(**more: object) -> pd.DataFrame:
    labels = {"cell": 0, "estimator": "ekf", "quantity": "roll", "band": "full", "reference": "truth"}
    rows = [
        labels | {"window": "whole", "unit": "deg", "status": "ok", "metric": metric, "value": value}
        for metric, value in (("rms", 2.0), ("mean", 1e-9), ("us_per_sample", 1.0))
    ]
    return pd.DataFrame(rows).assign(**more)


def test_differences_are_relative_to_the_figure_and_not_to_a_mean_near_zero() -> None:
    ours, theirs = table(), table()
    theirs["value"] += [2e-9, 2e-9, 5.0]
    assert difference(ours, theirs).tolist() == pytest.approx([1e-9, 1e-9], rel=1e-3)
    assert difference(ours, ours).tolist() == [0.0, 0.0]
    for other in (table(status="broken"), table(value=float("nan"))):
        with pytest.raises(AssertionError):
            difference(ours, other)
