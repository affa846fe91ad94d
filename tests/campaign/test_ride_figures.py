"""A scenario that asks for running safety, comfort and the decay of a kick: scores, page, printed lines."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from simrail.campaign import cell as cells_of_a_ride
from simrail.cli.score_tables import print_scores
from simrail.report.pages.answer import answer_section
from simrail.report.pages.explorer import stored_rides
from simrail.report.pages.page import SECTIONS, in_order
from simrail.report.pages.section import PageData
from simrail.report.tables.pivot import cases
from simrail.report.tables.running import running_table
from simrail.results import run
from simrail.scoring.aggregate import aggregate
from simrail.scoring.table import OK

TEXT = """
title = "Forces of a wagon"
seed = 1
track = "level_straight"
vehicle = "two_axle_wagon"
engine = "compiled"
odometry = "truth"
truth_rate_hz = 250.0
[running_safety]
vehicle = "freight"
derailment_limit = 0.05
[ride_comfort]
[monte_carlo]
sensor_draws = 2
[[irregularity.defect]]
form = "dip"
at_m = 32.0
length_m = 6.0
size_mm = 0.02
direction = "lateral"
[[ride]]
name = "out"
start_m = 20.0
end_m = 100.0
speed_kmh = [20.0, 28.0]
acceleration_mps2 = 3.0
jerk_mps3 = 10.0
rest_s = 0.5
final_rest_s = 0.5
kick_end_m = 38.0
[[ride]]
name = "stands"
start_m = 20.0
rest_s = 1.0
final_rest_s = 0.5
[[imu]]
name = "floor"
grade = "ideal"
body = "body"
position_m = [0.0, 0.0, 1.2]
[[estimator]]
name = "design_angles"
method = "DesignAngles"
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    path = folder / "wagon.toml"
    path.write_text(TEXT)
    return run(path, out=folder / "out", workers=1)


def figures(results, **wanted):
    """Rows of the ride itself."""
    scores = results.campaign.scores
    chosen = scores["estimator"] == "truth"
    for name, value in wanted.items():
        chosen &= scores[name] == value
    return scores[chosen]


def test_each_ride_is_scored_once_whatever_the_draws_of_the_sensors(results):
    assert not results.campaign.failures
    unloading = figures(results, quantity="wheel_unloading", metric="max", window="whole")
    assert unloading["ride"].tolist() == ["out", "out", "stands"]
    assert set(unloading["sensor_draw"]) == {0}
    assert unloading["status"].tolist() == [OK] * 3
    # Standing on smooth straight track each wheel carries its static load.
    assert unloading["value"].iloc[2] == pytest.approx(0.0, abs=1e-3)
    assert 0.0 < unloading["value"].iloc[0] < 0.2


def test_what_a_standing_vehicle_has_not(results):
    """No way, no mean over 2 m and no comfort: rows that say why."""
    shift = figures(results, ride="stands", quantity="sum_y", metric="max", window="whole")
    assert shift["status"].tolist() == ["no samples"]
    comfort = figures(results, ride="stands", quantity="comfort_nmv")
    assert comfort["status"].tolist() == ["the vehicle does not run for one period of 5 s"]
    assert figures(results, ride="stands", quantity="lateral_growth").empty


def test_the_page_and_the_printed_lines(results, capsys):
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    assert "Running safety and comfort" in page
    assert "0.85 (10 kN + 2 Q" in page
    print_scores(Console(width=200, force_terminal=False), results)
    printed = capsys.readouterr().out
    value = figures(results, ride="out", quantity="derailment_quotient", metric="max", window="whole")[
        "value"
    ]
    quotient = float(value.iloc[0])
    assert f"Y/Q {quotient:.3f} ({100.0 * quotient / 0.05:.0f} % of its limit)" in printed
    growth = figures(results, ride="out", quantity="lateral_growth")["value"].to_numpy()
    assert np.all(growth < 0.0)
    assert f"the kick decays by {-growth[0]:.3f} per second" in printed
    assert "two_axle_wagon on ride out: the kick decays at all speeds from 20 to 28 km/h" in printed
    unloading = figures(results, ride="out", quantity="wheel_unloading", metric="max", window="whole")
    assert f"{1.0 - unloading['value'].iloc[0]:.3f}" in page


def test_the_page_begins_with_the_ride_where_no_method_is_under_test(results):
    page = (results.folder / "report.html").read_text(encoding="utf-8")
    anchors = re.findall(r'<(?:h2|details class="part") id="([\w-]+)"', page)
    assert anchors[:4] == [
        "answer",
        "failures",
        "running",
        "explorer",
    ]  # failed: what a standing vehicle has not
    assert anchors.index("track") < anchors.index("scores") < anchors.index("campaign")
    answer = page[page.index('id="answer"') : page.index('id="failures"')]
    assert "least Q/Q" in answer and "greatest Y/Q" in answer
    views, _ = stored_rides(page)
    titles = [panel.title for view in views for panel in view.panels]
    assert {"speed", "Q", "Y/Q"} <= set(titles)
    assert "position error of the odometry" not in titles  # it is the true one


def test_the_page_of_a_method_under_test_keeps_its_order(results):
    scenario = SimpleNamespace(scores=results.campaign.scores, styles=[SimpleNamespace(baseline="")])
    assert not PageData.asks_of_ride.func(scenario)
    page = SimpleNamespace(asks_of_ride=False, scenario=results.scenario)
    assert in_order(page) == [answer_section, *SECTIONS]


def test_the_table_of_the_page_holds_y_over_q_against_the_limit_of_the_scenario(results):
    campaign = results.campaign
    table = running_table(cases(campaign.scores, campaign.cells), derailment_limit=0.05)
    quotient = figures(results, ride="out", quantity="derailment_quotient", metric="max", window="whole")
    share = f"{100.0 * quotient['value'].iloc[0] / 0.05:.0f}"
    assert table.rows[0].cells[table.columns.index("of limit, %")].text == share
    assert len(table.rows) == 3


def test_aggregates_say_that_growth_may_be_negative(results):
    table = aggregate(results.campaign.scores, results.campaign.cells)
    rows = table[table["quantity"] == "lateral_growth"]
    assert (rows["value"] < 0.0).all()
    assert (rows["draws"] == 1).all()


def test_a_ride_is_scored_once_whatever_is_drawn_of_sensors_and_map(monkeypatch):
    """Else its figures would count as many draws as there are maps, of which none changes it."""
    scored = []
    monkeypatch.setattr(cells_of_a_ride, "_record", lambda cell, *_: cell)
    monkeypatch.setattr(cells_of_a_ride, "_score_ride", lambda cell, *_: scored.append(cell.number))
    draws = [(map_draw, sensor_draw) for map_draw in range(3) for sensor_draw in range(2)]
    drawn = [SimpleNamespace(number=i, map_draw=m, sensor_draw=s) for i, (m, s) in enumerate(draws)]
    cells_of_a_ride.run_cells(drawn, None, None, cells_of_a_ride.BatchTally("mine", {}, {}), lambda: None)
    assert scored == [0]
