"""The report's tables, and the cases that they are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgb

from simrail.campaign.cell import CellResult
from simrail.report.figures import canvas
from simrail.report.pages.page import sections_of
from simrail.report.pages.section import PageData
from simrail.report.tables.geometry import behind_baseline, is_zero
from simrail.report.tables.methods import MethodStyle, method_styles
from simrail.report.tables.pivot import Case, Mean, _index, cases, of_cell
from simrail.report.tables.provenance import _irregularities, facts
from simrail.report.tables.running import running_table
from simrail.report.tables.tables import (
    NONE,
    Cell,
    Row,
    Table,
    error_table,
    number_cell,
    odometry_table,
    without_empty,
)
from simrail.report.words.verdicts import imu_words
from simrail.scenario.line_tables import IrregularityPart
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scoring.ride_figures import RIDE

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]


def case_of(scores: pd.DataFrame, cells: pd.DataFrame) -> Case:
    return cases(scores, cells)[0]


def test_table_marks_the_best_method_and_every_loss(
    scenario: Scenario,
    example: Rides,
    tables: Tables,
) -> None:
    styles = list(method_styles(scenario).values())
    table = error_table(case_of(*tables(example())), styles, reference="truth")
    column = table.columns.index("curve")
    marks = {row.label: row.cells[column] for row in table.rows}
    assert marks["EKF compensated"].mark == "best" and marks["EKF compensated"].text == "0.100"
    assert marks["plain filter"].mark == "worse" and marks["VQF"].mark == "worse"
    assert marks["design angles"].mark == "" and marks["design angles"].text == "0.250"
    design = error_table(case_of(*tables(example())), styles, reference="design")
    assert design.rows[3].cells[column].text == "0.000"
    assert sum(span for _, span in table.groups) == len(table.columns) == len(table.rows[0].cells)
    # A column beside rms stands below the quantity that it is of.
    assert table.groups[0][0].startswith("roll error") and table.groups[0][0].endswith(": rms, max")


def test_spread_over_draws_is_shown(scenario: Scenario, example: Rides, tables: Tables) -> None:
    case = case_of(*tables(example(), spread=0.1))
    found = case.get("ekf_compensated", "roll", "rms")
    assert found.draws == 2
    assert found.value == pytest.approx(0.1)
    assert found.sd == pytest.approx(0.1 * np.sqrt(2) * 0.1)


def test_cases_are_found_by_their_labels(example: Rides, tables: Tables) -> None:
    one, two = example(), example(backward=True, name="back")
    all_cases = cases(*tables(one, two))
    assert len(all_cases) == 2
    found = of_cell(all_cases, two.cell)
    assert found is not None and found.labels["ride"] == "back"
    assert of_cell(all_cases, {"ride": "elsewhere"}) is None
    assert all_cases[0].curves() == ["curve:curve 3 R300"]


@pytest.mark.parametrize("name", ["metro_geometry", "scale_track"])
def test_many_methods_of_one_class_have_colours_of_their_own(name: str) -> None:
    """Ten shades of green were not told apart."""
    styles = method_styles(load_scenario(name))
    smoothers = [style.colour for name, style in styles.items() if name.startswith(("smoother", "filter"))]
    assert len(smoothers) > 3
    assert len(set(smoothers)) == len(smoothers)
    # Each is seen on the ground of dark mode, and still told from the others.
    nights = [canvas.by_night(colour) for colour in smoothers]
    assert min(canvas.contrast(colour, canvas.NIGHT) for colour in nights) > 3.0
    assert len(set(nights)) == len(nights)
    for one, two in combinations(smoothers, 2):
        assert max(abs(a - b) for a, b in zip(to_rgb(one), to_rgb(two), strict=True)) > 0.2
    few = method_styles(load_scenario("validation_quick"))
    assert few["ekf_compensated"].colour == "#0072B2"


def test_two_or_three_methods_of_one_class_have_colours_of_their_own() -> None:
    styles = method_styles(load_scenario("metro_table3"))
    named = [style.colour for name, style in styles.items() if name.startswith(("gda", "vqf"))]
    assert len(set(named)) == len(named) == 6
    assert styles["gda_compensated"].colour == "#D55E00", "the first keeps that of its class"


def test_contrast_is_that_of_wcag() -> None:
    # Black and white are 21 to 1 by definition: (1 + 0.05) / (0 + 0.05).
    assert canvas.contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert canvas.by_night("#ffffff") == "#ffffff", "what is seen stays"


def test_a_column_that_no_row_fills_is_left_out() -> None:
    one = Cell("1.0")
    rows = [Row("a", "", "", [NONE, one, NONE, one]), Row("b", "", "", [NONE, NONE, NONE, one])]
    table = without_empty(Table([("x", 2), ("y", 1), ("z", 1)], ["p", "q", "r", "s"], rows))
    assert table.groups == [("x", 1), ("z", 1)] and table.columns == ["q", "s"]
    assert [row.cells for row in table.rows] == [[one, one], [NONE, one]]


def test_a_loss_to_the_design_angles_is_one_of_sizes(
    scenario: Scenario, example: Rides, tables: Tables
) -> None:
    """A final error of -0.5 degrees is larger than one of 0.3."""
    case = case_of(*tables(example()))
    at = ("yaw_debiased", "full", "truth", "whole", "final")
    finals = {"ekf_compensated": 0.3, "plain_filter": -0.6, "vqf": 0.4, "design_angles": -0.5}
    figures = {(name, *at): Mean(value, np.nan, 1) for name, value in finals.items()}
    styles = list(method_styles(scenario).values())
    table = error_table(replace(case, scores=case.scores | figures), styles, reference="truth")
    column = table.columns.index("final")
    marks = {row.label: row.cells[column].mark for row in table.rows}
    assert marks == {"EKF compensated": "best", "plain filter": "worse", "VQF": "", "design angles": ""}


def test_chance_of_tracks_and_of_sensors_add_up(example: Rides, tables: Tables) -> None:
    (case, *_) = cases(*tables(example()))
    row = case.table.iloc[:1].assign(sd_sensor=0.3, sd_track=0.4, draws=5)
    alone = row.assign(draws=1)
    assert [mean.sd for mean in _index(row).values()] == pytest.approx([0.5])
    assert np.isnan([mean.sd for mean in _index(alone).values()]).all()


def test_running_safety_is_told_by_what_is_left_and_by_shares_of_its_own_limits(
    example: Rides, tables: Tables
) -> None:
    """A wheel that is unloaded by .4 keeps .6; Y/Q of .2 is a quarter of .8, and the sum of Y has its own."""
    (case, *_) = cases(*tables(example()))
    figures = {
        ("wheel_unloading", "max"): 0.4,
        ("derailment_quotient", "max"): 0.2,
        ("sum_y", "max"): 12.34,
        ("sum_y_relative", "max"): 0.7,
    }
    ride = replace(
        case,
        table=case.table.assign(estimator=RIDE),
        scores={
            (RIDE, quantity, "full", "truth", "whole", metric): Mean(value, np.nan, 1)
            for (quantity, metric), value in figures.items()
        },
    )
    table = running_table([ride], derailment_limit=0.8)
    assert table is not None
    cells = [cell.text for cell in table.rows[0].cells]
    assert dict(zip(table.columns, cells, strict=True))["\u03a3Y max, kN"] == "12.3"
    assert [text for text in cells if text != "12.3"] == ["0.600", "0.200", "25", "70"]


def test_what_the_rails_deviate_by_is_told_with_its_sizes() -> None:
    spectrum = IrregularityPart(spectrum="erri_b176_low", wavelengths_m=(1.5, 80.0))
    (drawn,) = _irregularities(spectrum)
    assert drawn == (
        "irregularity",
        "erri_b176_low",
        "synthetic",
        "random draw from the spectrum, wavelengths 1.5 to 80 m",
    )
    defect = {"form": "dip", "at_m": 120.0, "length_m": 6.0, "size_mm": 4.0, "rails": "left"}
    dip = IrregularityPart.model_validate(
        {"spectrum": "none", "defect": (defect | {"direction": "vertical"},)}
    )
    assert _irregularities(dip) == [
        (
            "defect",
            "dip of 4 mm over 6 m at 120 m",
            "synthetic",
            "as the scenario says; left rails, vertical",
        )
    ]
    (none,) = _irregularities(IrregularityPart(spectrum="none"))
    assert none.name == "none"


def test_the_manifest_is_told_in_words() -> None:
    told = facts(
        {"seed": 0, "cells": 12, "failed": 0, "warnings": [], "wall_s": 12.3456, "beside": "x"}
        | {"versions": {"numpy": "2.1", "python": "3.11"}, "stop": {"told": "after 4 draws", "draws": 4}}
    )
    assert dict(told) == {
        "seed": "0",
        "cells": "12",
        "failed": "0",
        "stop rule": "after 4 draws",
        "wall time, s": "12.3",
        "versions": "numpy 2.1, python 3.11",
    }


def test_a_number_has_its_decimals_and_its_spread_as_many() -> None:
    assert number_cell(1.23456) == Cell("1.235")
    assert number_cell(-1.26, decimals=1, spread=0.349, mark="best") == Cell("\u22121.3", "0.3", "best")
    assert number_cell(-0.0004) == Cell("0.000")
    assert number_cell(float("nan"), spread=1.0) == number_cell(float("inf")) == NONE


def test_behind_the_baseline_is_what_errs_more_than_no_imu() -> None:
    """In the quantity and band that are asked of; an equal one is not behind, nor is the baseline."""
    sizes = {"zero": 1.0, "better": 0.9, "equal": 1.0, "worse": 1.1, "worst": 9.0}
    scores = {
        (name, quantity, band, "truth", "whole", "sd"): Mean(size if band == "D1" else 1.0 / size, 0.0, 2)
        for name, size in sizes.items()
        for quantity in ("vertical_profile", "cross_level")
        for band in ("D1", "full")
    }
    case = Case({}, pd.DataFrame({"draws": [2]}), scores)
    styles = [
        MethodStyle(name, name, "no IMU" if name == "zero" else "", name != "zero", "", None, "#000000", "-")
        for name in sizes
    ]
    assert is_zero(styles[0]) and not any(map(is_zero, styles[1:]))
    told = behind_baseline(case, styles, "cross_level", band="D1")
    assert [style.name for style in told] == ["worse", "worst"]
    told = behind_baseline(case, styles, "cross_level", band="full")
    assert [style.name for style in told] == ["better"]
    assert behind_baseline(case, styles[1:], "cross_level", band="D1") == []


def test_a_sheet_of_ones_own_is_told_by_its_file(scenario: Scenario, example: Rides, tables: Tables) -> None:
    """Unless two have one name."""
    scores, cells = tables(example(), draws=2)
    own = "/somewhere/far/away/my_imu.toml"
    data = PageData(scenario, scores.assign(imu=own), cells.assign(imu=own), [], {})
    (case,) = data.shown_cases
    assert imu_words(case.labels).endswith(" (my_imu.toml)")
    assert all(" (my_imu.toml) " in row.label for row in odometry_table([case]).rows)
    assert data.question is not None and set(data.question.judged["slot"]) == {"my_imu.toml"}
    text = "".join(str(section.data) for section in sections_of(data) if section.anchor != "parts")
    assert "my_imu.toml" in text and "far" not in text.replace("farth", "")
    imu = [f"/{'ab'[draw]}/my_imu.toml" for draw in scores["sensor_draw"]]
    two = PageData(scenario, scores.assign(imu=imu), cells, [], {}).question
    assert two is not None and set(two.judged["slot"]) == {"/a/my_imu.toml", "/b/my_imu.toml"}
