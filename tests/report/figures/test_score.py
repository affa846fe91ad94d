"""Figures of scores: what is drawn where a method tells no roll."""

from __future__ import annotations

import pandas as pd

from simrail.report.figures.score import curves_figure
from simrail.report.tables.methods import MethodStyle
from simrail.report.tables.pivot import Case, Mean


def style(name: str) -> MethodStyle:
    return MethodStyle(name, name, "", True, "", None, "#0072B2", "-")


def test_curves_are_drawn_of_methods_that_tell_roll_and_else_not_at_all() -> None:
    """An odometry has a speed in every curve, and no roll."""
    window = "curve:curve 1 300 m left"
    table = pd.DataFrame({"window": [window], "draws": [1]})
    speed = {("odometry", "speed", "full", "truth", window, "rms"): Mean(1.0, 0.0, 1)}
    assert curves_figure(Case({}, table, speed), [style("odometry")]) == ""
    roll = {("filter", "roll", "full", "truth", window, "rms"): Mean(0.2, 0.0, 1)}
    drawn = curves_figure(Case({}, table, speed | roll), [style("odometry"), style("filter")])
    assert "<svg" in drawn and "filter" in drawn
