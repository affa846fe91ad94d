"""Factors of a vehicle as values of a design: a ride for each, and a train that believes the drawing."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.campaign.sensitivity import FigureName, sensitivities
from simrail.core.errors import InputError
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.distributions import dimensions
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario

TEXT = """
title = "A frame on springs"
seed = 5
track = "level_straight"
vehicle = "suspended_wheelset"
engine = "compiled"
truth_rate_hz = 250.0
odometry = "truth"
[irregularity]
spectrum = "erri_b176_low"
[monte_carlo]
method = "morris"
samples = 2
[vehicle_factors]
load = { uniform = [0.9, 1.3] }
stiffness = { log_uniform = [0.7, 1.4] }
[[ride]]
name = "out"
start_m = 20.0
end_m = 30.0
speed_kmh = 20.0
rest_s = 1.0
final_rest_s = 0.5
[[imu]]
name = "above"
grade = "ideal"
body = "carrier"
position_m = [0.0, 0.0, 1.0]
[[estimator]]
name = "ekf"
method = "AttitudeEkf"
[score]
windows = ["whole"]
metrics = ["rms"]
"""


def scenario(text: str = TEXT) -> Scenario:
    return read_scenario(text, name="factors")


@pytest.mark.long
def test_each_sample_has_a_vehicle_of_its_own_and_the_drawing_stays() -> None:
    read = scenario()
    assert list(dimensions(read.spec)) == ["vehicle_factors.load", "vehicle_factors.stiffness"]
    plan = judge_scenario(read)
    resolved = [plan.parts.resolve(cell) for cell in cells(read)]
    assert len(resolved) == 2 * 3 and len({one.cell.ride_number for one in resolved}) == 6
    for one in resolved:
        part, drawn = one.cell.spec.vehicle_factors, one.drawn_vehicle
        assert part is not None and drawn == resolved[0].drawn_vehicle
        assert one.ride.vehicle.bodies[-1].mass_kg == part.load * drawn.bodies[-1].mass_kg
        assert one.vehicle_sheet == resolved[0].vehicle_sheet
    assert len({one.ride.vehicle.bodies[-1].mass_kg for one in resolved}) > 1


def test_factors_of_one_are_the_drawing() -> None:
    text = TEXT.replace("{ uniform = [0.9, 1.3] }", "1.0").replace("{ log_uniform = [0.7, 1.4] }", "1.0")
    read = scenario(text.replace('method = "morris"', 'method = "sobol"'))
    (first, *_) = cells(read)
    resolved = judge_scenario(read).parts.resolve(first)
    assert resolved.ride.vehicle is resolved.drawn_vehicle


def test_a_body_without_springs_is_refused() -> None:
    with pytest.raises(InputError, match="neither weight nor springs") as caught:
        judge_scenario(scenario(TEXT.replace('"compiled"', '"kinematic"')))
    assert "vehicle_factors" in str(caught.value) and "compiled" in str(caught.value)


@pytest.mark.long
def test_they_decide_an_error_by_the_same_bits_for_one_and_two_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path))
    read = scenario()
    one, two = (run_campaign(read, workers=workers, batch_cells=1) for workers in (1, 2))
    assert not one.failures
    drop = ["us_per_sample"]
    tables = [found.scores[~found.scores["metric"].isin(drop)].reset_index(drop=True) for found in (one, two)]
    pd.testing.assert_frame_equal(*tables, check_exact=True)
    (found,) = sensitivities(
        read.spec, one.scores, one.cells, FigureName("roll", "rms", "whole", "truth", "full")
    )
    assert set(found.order) == {"vehicle_factors.load", "vehicle_factors.stiffness"}
    assert (found.indices["mu_star"] > 0.0).all()


def test_a_setting_begins_the_table() -> None:
    few = ['engine="compiled"', "vehicle_factors.damping={ uniform = [0.5, 1.0] }"]
    read = load_scenario("sensitivity", overrides=[*few, "encoder.radius_error={ uniform = [-0.01, 0.01] }"])
    assert {"vehicle_factors.damping", "encoder.radius_error"} < set(dimensions(read.spec))
