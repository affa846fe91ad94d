"""Scores on the command line: rails first where they are scored, in the band that counts, and no name cut."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from rich.console import Console

from simrail.cli.score_tables import MOST_NAMES, MOST_TABLES, WIDEST, print_cell, print_scores
from simrail.cli.verdict_tables import _none_enough, print_budgets
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.scoring.table import NO_SAMPLES, OK, QUANTITY_UNITS, SCORE_COLUMNS, TOO_SHORT, UNOBSERVABLE

TEXT = """
title = "Rails"
seed = 1
track = "scale_track"
vehicle = "scale_vehicle"
engine = "kinematic"
odometry = "truth"
[monte_carlo]
sensor_draws = 2
[encoder]
wheel = "wheel"
[[ride]]
name = "out"
start_m = 1.0
end_m = 89.0
speed_kmh = 3.6
[[imu]]
name = "body"
grade = "lord_3dm_gx4_25"
body = "body"
position_m = [0.0, 0.0, 0.05]
[geometry]
bands = ["D1"]
own_bands = { paper = [0.3, 7.0] }
[[estimator]]
name = "smoother_camera_free_of_the_whole_ride_tuned_on_the_other_ride"
method = "TrajectorySmoother"
[[estimator]]
name = "smoother"
method = "TrajectorySmoother"
[[estimator]]
name = "design_angles"
method = "DesignAngles"
[[estimator]]
name = "zero_track"
method = "ZeroTrack"
"""
LONG, SHORT, DESIGN, ZERO = (
    "smoother_camera_free_of_the_whole_ride_tuned_on_the_other_ride",
    "smoother",
    "design_angles",
    "zero_track",
)
SD_MM = {
    (LONG, "vertical_profile"): 0.11,
    (LONG, "cross_level"): 0.22,
    (LONG, "alignment"): 0.97,
    (SHORT, "vertical_profile"): 0.12,
    (SHORT, "cross_level"): 0.23,
    (SHORT, "alignment"): 0.34,
    (SHORT, "gauge"): 0.45,
    (ZERO, "vertical_profile"): 0.71,
    (ZERO, "cross_level"): 0.82,
    (ZERO, "alignment"): 0.93,
}
"""Of the band ``paper``, mean of two draws that lie 0.01 mm to either side; in D1 ten times as much."""


def scores(*, bands: dict[str, str], rails: bool = True) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Score table and cells of two draws; `bands`: by name, the status of the figures in it."""
    labels = {
        "scenario": "rails",
        "ride": "out",
        "vehicle": "v",
        "mount": "body",
        "imu": "lord_3dm_gx4_25",
        "odometry": "encoder",
        "map": "exact",
        "vibration": "off",
        "tuning": "default",
        "track_draw": 0,
    }
    rows: list[dict[str, Any]] = []

    def add(draw: int, name: str, quantity: str, metric: str, value: float | None, **other: Any) -> None:
        where = {"band": "full", "reference": "truth", "window": "whole", "status": OK} | other
        unit = "us" if metric == "us_per_sample" else QUANTITY_UNITS[quantity]
        own = {"cell": draw, "sensor_draw": draw, "estimator": name, "quantity": quantity, "metric": metric}
        rows.append(labels | own | where | {"value": value, "unit": unit, "n_samples": 9})

    for draw, sign in enumerate((-1.0, 1.0)):
        for name in (LONG, SHORT, DESIGN, ZERO):
            angle = 0.4 if name in (DESIGN, ZERO) else 0.05
            for quantity in ("roll", "pitch"):
                for window in ("whole", "curve"):
                    add(draw, name, quantity, "rms", angle, window=window)
                add(draw, name, quantity, "rms", 0.777, window="curve", reference="design")
            add(draw, name, "roll", "us_per_sample", 3.25)
            if name == DESIGN or not rails:
                continue
            for quantity in ("vertical_profile", "cross_level", "alignment", "gauge"):
                known = SD_MM.get((name, quantity))
                for band, status in {"full": OK, **bands}.items():
                    size = {"full": 100.0, "D1": 10.0}.get(band, 1.0)
                    value = None if known is None else size * (known + 0.01 * sign)
                    status = status if value is not None else UNOBSERVABLE
                    add(draw, name, quantity, "sd", value if status == OK else None, band=band, status=status)
    cells = pd.DataFrame(
        [
            labels | {"cell": i, "sensor_draw": i, "case": 0, "speed_kmh": 3.6, "direction": "forward"}
            for i in range(2)
        ]
    )
    return pd.DataFrame(rows)[list(SCORE_COLUMNS)], cells


def shown(scenario: Scenario, table: pd.DataFrame, cells: pd.DataFrame, *, width: int = WIDEST) -> list[str]:
    """Lines that the command line prints."""
    campaign = SimpleNamespace(
        scores=table,
        cells=cells,
        stopped=None,
        plan=SimpleNamespace(warnings=[]),
        warnings=[],
        failures=[],
        verdicts=pd.DataFrame(),
    )
    manifest = {"wall_s": {"total": 1.0}, "real_time_factor": None}
    results = SimpleNamespace(campaign=campaign, scenario=scenario, manifest=manifest, folder=Path("there"))
    console = Console(width=width, record=True, file=StringIO())
    print_scores(console, results)  # type: ignore[arg-type]
    return console.export_text().splitlines()


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return read_scenario(TEXT, name="rails")


def row_of(lines: list[str], name: str, *, after: str) -> list[str]:
    """Numbers of a method's line in the table that follows a title."""
    start = next(i for i, line in enumerate(lines) if line.startswith(after))
    return next(line for line in lines[start:] if line.split()[:1] == [name]).split()[1:]


def test_rails_come_first_in_the_scenarios_own_band_where_d1_is_too_long(scenario: Scenario) -> None:
    lines = shown(scenario, *scores(bands={"D1": TOO_SHORT, "paper": OK}))
    titles = [line for line in lines if line.startswith(("Rails", "Attitude"))]
    assert titles == [
        "Rails: sd of the error in wavelengths of 0.3\u20137 m (paper), mm; mean of 2 draws",
        "Attitude: rms error, deg; mean of 2 draws",
    ]
    assert row_of(lines, SHORT, after="Rails") == ["0.120", "0.230", "0.340", "0.450", "3.25"]
    assert row_of(lines, ZERO, after="Rails") == ["*", "0.710", "0.820", "0.930", "-", "3.25"]
    assert row_of(lines, SHORT, after="Attitude") == ["0.050"] * 4
    text = "\n".join(lines)
    assert "0.777" not in text, "against the design angles nothing is told beside rails"
    attitude = text[text.index("Attitude") :]
    assert DESIGN in attitude and "zero_track *" not in attitude, "the design angles are told once"
    assert " ".join(text.split()).count(f"{ZERO}, which uses no IMU, errs less in alignment than {LONG}") == 1


def test_rails_are_told_in_d1_where_it_has_figures(scenario: Scenario) -> None:
    lines = shown(scenario, *scores(bands={"D1": OK, "paper": OK}))
    assert any(
        line.startswith("Rails: sd of the error in wavelengths of 3\u201325 m (D1), mm") for line in lines
    )
    assert row_of(lines, SHORT, after="Rails")[0] == "1.200"


def test_rails_without_any_band_are_told_unfiltered(scenario: Scenario) -> None:
    lines = shown(scenario, *scores(bands={"D1": TOO_SHORT, "paper": TOO_SHORT}))
    assert any(line.startswith("Rails: sd of the error unfiltered, mm") for line in lines)
    assert row_of(lines, SHORT, after="Rails")[0] == "12.000"


@pytest.mark.parametrize("width", [80, 200])
def test_no_line_of_a_table_is_wider_than_80_and_no_name_is_cut(scenario: Scenario, width: int) -> None:
    for rails in (True, False):
        lines = shown(scenario, *scores(bands={"paper": OK}, rails=rails), width=width)
        rules = [line for line in lines if "\u2500\u2500" in line]
        assert rules and max(len(line.rstrip()) for line in rules) <= WIDEST
        text = "".join(line.split()[0] for line in lines if line.startswith(" ") and line.split())
        assert LONG in text, "folded, not cut"
        assert "\u2026" not in "\n".join(lines)


def test_a_ride_without_rails_has_the_attitude_against_both_references(scenario: Scenario) -> None:
    lines = shown(scenario, *scores(bands={}, rails=False))
    assert not any(line.startswith("Rails") for line in lines)
    assert row_of(lines, SHORT, after="Attitude") == [
        "0.050",
        "0.050",
        "0.777",
        "0.050",
        "0.050",
        "0.777",
        "3.25",
    ]


def test_a_failed_figure_is_a_dash(scenario: Scenario) -> None:
    table, cells = scores(bands={"paper": OK})
    gone = (table["estimator"] == SHORT) & (table["quantity"] == "alignment")
    table.loc[gone, "value"] = None
    table.loc[gone, "status"] = NO_SAMPLES
    assert row_of(shown(scenario, table, cells), SHORT, after="Rails")[2] == "-"


def many(rides: int, mounts: tuple[str, ...] = ("body",)) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and cells of rides at 10, 20, 30 ... km/h; the roll of ride number i is i + 1 times as wrong."""
    tables, every = [], []
    for case, (mount, i) in enumerate((mount, i) for mount in mounts for i in range(rides)):
        table, cells = scores(bands={}, rails=False)
        names = {"ride": f"ride{i}", "mount": mount}
        of_roll = (table["quantity"] == "roll") & (table["metric"] == "rms")
        table.loc[of_roll, "value"] *= i + 1
        direction = "backward" if i == 0 else "forward"
        more = {"case": case, "speed_kmh": 10.0 * (i + 1), "direction": direction}
        tables.append(table.assign(**names, cell=table["cell"] + 2 * case))
        every.append(cells.assign(**names, **more, cell=cells["cell"] + 2 * case))
    return pd.concat(tables, ignore_index=True), pd.concat(every, ignore_index=True)


def test_few_cases_have_a_table_each(scenario: Scenario) -> None:
    lines = shown(scenario, *many(MOST_TABLES))
    assert sum(line.startswith("Attitude: rms error, deg; mean of 2 draws") for line in lines) == MOST_TABLES


def test_many_cases_share_a_table_of_least_and_most(scenario: Scenario) -> None:
    rides = MOST_TABLES + 2
    lines = shown(scenario, *many(rides))
    titles = [line for line in lines if line.startswith(("ride0", "Attitude"))]
    assert len(titles) == 2
    assert titles[0].startswith(
        f"ride0, ride1, ride2 and {rides - MOST_NAMES} more: 10 to {10 * rides} km/h both ways"
    )
    assert titles[1] == f"Attitude: rms error, deg; least and most of {rides} kinds of ride, mean of 2 draws"
    # Of rolls .05, .10, .15 ...; the pitch is the same on all.
    assert row_of(lines, SHORT, after="Attitude") == [f"0.050\u2013{0.05 * rides:.3f}"] * 2 + ["0.050"] * 2
    assert (
        row_of(lines, DESIGN, after="Attitude")[1:] == [f"0.400\u2013{0.4 * rides:.3f}"] * 2 + ["0.400"] * 2
    )
    assert "design" not in " ".join(lines[:8]), "no column against the design angles"


def test_where_vehicles_differ_a_table_says_which_and_else_does_not(scenario: Scenario) -> None:
    table, cells = many(MOST_TABLES + 1)
    assert not any(" of v," in line for line in shown(scenario, table, cells))
    other, more = table.assign(vehicle="other", cell=table["cell"] + 100), cells.assign(vehicle="other")
    more = more.assign(cell=more["cell"] + 100, case=more["case"] + 100)
    text = "\n".join(shown(scenario, pd.concat([table, other]), pd.concat([cells, more]), width=200))
    assert text.count(" on body of v,") == text.count(" on body of other,") == 1


def test_tables_that_are_too_many_are_counted(scenario: Scenario) -> None:
    mounts = tuple("abcdefg")
    lines = shown(scenario, *many(2, mounts))
    assert sum(line.startswith("Attitude") for line in lines) == MOST_TABLES
    assert f"... and {len(mounts) - MOST_TABLES} more tables: see the report, or scores.csv" in lines


@pytest.mark.parametrize(("rides", "told"), [(2, False), (MOST_TABLES + 1, True)])
def test_ablations_of_many_kinds_of_ride_are_left_to_the_report(
    scenario: Scenario, rides: int, told: bool
) -> None:
    table, cells = many(rides)
    errs = table.assign(map="drawn", cell=table["cell"] + 100)
    more = cells.assign(map="drawn", cell=cells["cell"] + 100, case=cells["case"] + 100)
    lines = shown(scenario, pd.concat([table, errs]), pd.concat([cells, more]))
    assert ("What the ablations change stands in the report." in lines) == told
    assert any(line.startswith("What the map costs") for line in lines) == (not told)


def test_a_sheet_of_ones_own_is_told_by_its_file(scenario: Scenario) -> None:
    table, cells = many(1)
    own = "/somewhere/far/away/my_imu.toml"
    lines = shown(scenario, table.assign(imu=own), cells.assign(imu=own), width=200)
    assert lines[0].startswith("ride0: 10 km/h backward, my_imu.toml on body,")


def test_so_is_the_one_of_a_single_cell_and_of_a_budget(capsys: pytest.CaptureFixture[str]) -> None:
    table, cells = many(1)
    own = "/somewhere/far/away/my_imu.toml"
    console = Console(width=200)
    print_cell(console, SimpleNamespace(cells=cells.assign(imu=own), scores=table, warnings=()))  # type: ignore[arg-type]
    first = capsys.readouterr().out.splitlines()[0]
    assert first == "cell 0: ride ride0, my_imu.toml on body"
    of = {"number": 0, "vehicle": "car", "mount": "axle", "imu": own, "what": "roll, rms", "unit": "deg"}
    budget = {"words": "gyro bias", "share": 0.9, "low95": 0.8, "high95": 1.0, "rms_of_whole": 0.1}
    print_budgets(console, pd.DataFrame([of | budget]))
    told = capsys.readouterr().out
    assert "is gyro bias, my_imu.toml on the axle" in told and "far" not in told


def test_what_no_device_has_shown_is_open_and_no_verdict() -> None:
    verdicts = pd.DataFrame(
        {"imu": ["/a/one.toml", "two"], "verdict": ["not enough"] * 2, "devices": [20, 20]}
    )
    assert _none_enough(verdicts) == "none of these is enough"
    verdicts.loc[0, "verdict"] = "not enough draws"
    assert _none_enough(verdicts) == "open for one.toml: 20 devices do not show it, take more (--devices)"
