"""Figures of windows in themselves."""

import numpy as np
import pandas as pd
import pytest

from simrail.scoring.metrics import nis_figures
from simrail.scoring.table import NO_SAMPLES, OK


def innovations(nis: list[float]) -> pd.DataFrame:
    """Two of them at each sample; none where there was no update."""
    made = np.where(np.arange(len(nis)) == 0, np.nan, 1.0)
    return pd.DataFrame({"innovation_x_mps2": made, "innovation_y_mps2": made, "nis": nis})


def test_a_nis_that_is_missing_where_there_was_an_innovation_is_told() -> None:
    """Not where there was none; and of two of four it is told as of one of four."""
    frame = innovations([np.nan, 1.0, 3.0, np.inf, np.nan, 5.0, 7.0])
    windows = {
        name: np.array(own, dtype=np.intp)
        for name, own in (("fine", [0, 1, 2]), ("none", [0]), ("empty", []), ("half", [3, 4, 5, 6]))
    }
    rows = {row[3]: row[5:] for row in nis_figures(frame, "roll", windows)}
    assert rows["fine"] == (pytest.approx(1.0), "1", 2, OK), "over the number of innovations"
    assert [rows[name][2:] for name in ("none", "empty")] == [(0, NO_SAMPLES)] * 2
    assert rows["half"][3] == "NIS not finite in 2 of 4 samples" and np.isnan(rows["half"][0])
