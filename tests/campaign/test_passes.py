"""Several passes in a campaign: each as it would be alone, fused as by hand, the same in any batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail import fuse
from simrail.campaign.campaign import run_campaign
from simrail.campaign.cell import record_cell
from simrail.campaign.result import CampaignResult
from simrail.estimation.estimate import Estimate
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import Scenario, read_scenario

TEXT = """
title = "passes"
seed = 3
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
truth_rate_hz = 250.0
passes = [1, 3]
odometry = "curve_smoothed"
[irregularity]
spectrum = "erri_b176_low"
wavelengths_m = [1.5, 100.0]
[[ride]]
name = "pass"
start_m = 40.0
end_m = 230.0
speed_kmh = [40.0, 60.0]
reverse = [false, true]
acceleration_mps2 = 2.0
jerk_mps3 = 2.0
rest_s = 2.0
final_rest_s = 1.0
[encoder]
wheel = "trailing.left"
pulses_per_revolution = 1024
rate_hz = 250.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[score]
windows = ["whole"]
metrics = ["rms", "coverage95"]
[[estimator]]
name = "smoother"
method = "TrajectorySmoother"
[[estimator]]
name = "attitude"
method = "DesignAngles"
"""


def scenario() -> Scenario:
    return read_scenario(TEXT, name="passes")


@pytest.fixture(scope="module")
def result() -> Iterator[CampaignResult]:
    yield run_campaign(scenario(), workers=1)


def rails_of(scores: pd.DataFrame, cell: int) -> pd.DataFrame:
    of = scores[(scores["cell"] == cell) & (scores["estimator"] == "smoother")]
    figures = of[["quantity", "band", "metric", "value", "status"]].astype({"quantity": str, "band": str})
    return figures.reset_index(drop=True)


def test_one_pass_scores_as_the_ride_alone(result: CampaignResult) -> None:
    """With the same device: a scenario of that ride, drawn as often."""
    read = scenario()
    one = next(cells(read)).passes[0]
    part = one.ride.model_copy(update={"reverse": False})
    alone = replace(
        read,
        spec=read.spec.model_copy(
            update={
                "passes": None,
                "ride": [part],
                "monte_carlo": read.spec.monte_carlo.model_copy(update={"sensor_draws": one.sensor_draw + 1}),
            }
        ),
    )
    scores = run_campaign(alone, workers=1, only=one.sensor_draw).scores
    geometry = ("alignment", "vertical_profile", "cross_level", "gauge", "twist")
    expected = rails_of(scores, one.sensor_draw)
    expected = expected[expected["quantity"].isin(geometry)].reset_index(drop=True)
    pd.testing.assert_frame_equal(rails_of(result.scores, 0), expected, check_categorical=False)


def test_three_passes_are_fused_as_by_hand(result: CampaignResult) -> None:
    parts = Parts(scenario())
    three = list(cells(parts.scenario))[1]
    found = []
    for one in three.passes:
        recording = record_cell(one, simulate(parts.ride(one)), parts)
        estimate = parts.estimators(0)["smoother"].estimate(recording)
        assert recording.odometry is not None
        states = estimate.states.join(recording.odometry[["position_m", "position_sd_m"]])
        found.append(Estimate(states, estimate.mount, geometry=estimate.geometry))
    geometry = fuse(found).geometry
    truth = parts.rails(three).irregularities(geometry.index.to_numpy())
    for name in ("vertical_profile", "cross_level", "alignment"):
        rms = 1e3 * np.sqrt(
            np.square(geometry[f"{name}_m"].to_numpy() - truth[f"{name}_m"].to_numpy()).mean()
        )
        rows = rails_of(result.scores, 1).set_index(["quantity", "band", "metric"])["value"]
        assert rows[name, "full", "rms"] == pytest.approx(rms, rel=1e-9)


def test_the_table_of_cells_says_what_passes_they_are(result: CampaignResult) -> None:
    assert list(result.cells["passes"]) == [1, 3]
    assert list(result.cells["ride"]) == ["pass", "pass"]
    rides = [cell.passes for cell in cells(scenario())]
    mean = np.mean([float(one.ride.speed_kmh) for one in rides[1]])  # type: ignore[arg-type]
    assert result.cells["speed_kmh"][1] == pytest.approx(mean)
    assert result.cells["direction"][0] in ("forward", "backward")


def test_an_estimator_without_rails_fails_its_rows_only(result: CampaignResult) -> None:
    reasons = {failure.reason for failure in result.failures}
    assert {failure.estimator for failure in result.failures} == {"attitude"} and len(result.failures) == 2
    assert all("says nothing of the rails" in reason and "geometry_step_m" in reason for reason in reasons)
    assert (result.scores[result.scores["estimator"] == "smoother"]["status"] != "failed").all()


def test_a_cell_alone_gives_the_same_bits(result: CampaignResult) -> None:
    alone = run_campaign(scenario(), workers=1, only=1).scores
    pd.testing.assert_frame_equal(rails_of(alone, 1), rails_of(result.scores, 1))


@pytest.mark.slow
def test_two_workers_give_the_same_bits(result: CampaignResult) -> None:
    both = run_campaign(scenario(), workers=2).scores
    for cell in (0, 1):
        pd.testing.assert_frame_equal(rails_of(both, cell), rails_of(result.scores, cell))


def test_a_ride_that_fails_fails_the_cells_that_need_it(monkeypatch: pytest.MonkeyPatch) -> None:
    import simrail.campaign.passes as of_passes

    read = scenario()
    last = list(cells(read))[1].passes[2]

    def failing(cell, truth, parts):  # type: ignore[no-untyped-def]
        if cell.ride_number == last.ride_number:
            raise ValueError("the logger was off")
        return record_cell(cell, truth, parts)

    monkeypatch.setattr(of_passes, "record_cell", failing)
    failures = run_campaign(read, workers=1).failures
    assert {(one.cell, one.estimator) for one in failures if "logger" in one.reason} == {
        (1, "smoother"),
        (1, "attitude"),
    }
