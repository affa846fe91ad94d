"""The chart of an answer: recordings by rank, the best and the worst of them among the dots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from simrail.report.pages.answer import DOT, FEW, MOST_DOTS, _draw_dots
from simrail.report.tables.methods import MethodStyle

STYLE = MethodStyle("ekf", "the ekf", "", True, "", None, "#123456", "-", "filter", False)


@pytest.mark.parametrize("count", [1, 2, FEW - 1, FEW, MOST_DOTS, 1000])
def test_dots_are_recordings_by_rank_with_the_best_and_the_worst(count: int) -> None:
    values = 1.0 + np.random.default_rng(1).permutation(count).astype(float)
    own = pd.DataFrame({"estimator": ["ekf"] * count + ["other"], "value": [*values, 1e6]})
    panel = Figure().add_subplot()
    _draw_dots(panel, own, STYLE, 3.0, 2)
    (drawn,) = panel.get_lines()
    x, y = (np.asarray(each, dtype=float) for each in drawn.get_data())
    if count >= FEW:  # strokes from x - DOT to x + DOT, parted by gaps
        assert np.isnan(x[2::3]).all()
        np.testing.assert_allclose(x[1::3] - x[::3], 2.0 * DOT)
        x, y = 0.5 * (x[::3] + x[1::3]), y[::3]
    assert len(y) == min(count, MOST_DOTS) and set(y) <= set(values)
    assert (y[0], y[-1]) == (1.0, float(count)) and (np.diff(y) > 0.0).all()
    np.testing.assert_allclose(x + x[::-1], 6.0)  # about the middle, within its share of the slot
    assert np.ptp(x) == pytest.approx(min(0.62 / 2, 0.006 * len(y)) if count > 1 else 0.0)


def test_a_method_without_recordings_has_no_dots() -> None:
    panel = Figure().add_subplot()
    _draw_dots(
        panel, pd.DataFrame({"estimator": ["ekf"], "value": [1.0]}), replace(STYLE, name="gda"), 0.0, 1
    )
    assert not panel.get_lines()
