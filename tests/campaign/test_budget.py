"""The budget of an error: of a linear estimator by closed form, and of an attitude by what is known of it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf

from simrail.campaign.budget import TERMS, TOGETHER, budget_sentence, error_budget
from simrail.campaign.cell import record_cell
from simrail.campaign.progress import Watcher
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.recording.sheets.grades import ImuGrade
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.scenario import read_scenario
from simrail.scoring.requirement import Requirement

TEXT = """
title = "budget"
seed = 3
track = "condequinto_olivar"
vehicle = "metro_irw_bogie"
engine = "kinematic"
truth_rate_hz = 250.0
odometry = "truth"
[monte_carlo]
sensor_draws = 12
[[ride]]
name = "line"
start_m = 40.0
end_m = 120.0
speed_kmh = 40.0
acceleration_mps2 = 1.5
jerk_mps3 = 1.5
rest_s = 2.0
final_rest_s = 1.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "ekf"
method = "AttitudeEkf"
"""
WANTED = Requirement("roll", 0.1)


class Level:
    """Roll of one level for the whole ride: the mean lateral force over gravity. It is linear."""

    needs = ()
    causal = False

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate it."""
        lean = recording.imu["accel_y_mps2"].mean() / recording.gravity_mps2
        states = pd.DataFrame({"roll_rad": np.full(len(recording.imu), lean)}, index=recording.imu.index)
        return Estimate(states=states, mount=recording.mount)


def some_cells() -> tuple[list[Cell], Parts]:
    scenario = read_scenario(TEXT, name="budget")
    return list(cells(scenario)), Parts(scenario)


def test_a_linear_estimator_has_the_closed_form() -> None:
    """A lateral bias b is a roll of b/g, known from its own stream; the rest adds up to the whole."""
    listed, parts = some_cells()
    budget = error_budget(listed, parts, Level(), WANTED).set_index("term")
    bound = parts.grade(listed[0]).accel_turn_on_bias_mps2
    drawn = [
        stream(cell.sensor_seed, "sensor", cell.sensor_draw, "imu", "axle", "accel_turn_on_bias")
        for cell in listed
    ]
    of_bias = np.rad2deg([one.uniform(-1.0, 1.0, 3)[1] * bound / 9.81 for one in drawn])
    # Counts of 0.1 mg do not move with the bias, and their mean not quite.
    assert budget.loc["accel_turn_on_bias", "rms"] == pytest.approx(np.sqrt(np.mean(of_bias**2)), rel=2e-3)
    assert budget["share"].sum() == pytest.approx(1.0, abs=1e-9)
    # A linear estimator leaves nothing to terms together, but for counts that round.
    assert abs(budget.loc[TOGETHER, "share"]) < 5e-3
    bias = budget.loc["accel_turn_on_bias", "share"]
    assert budget.loc["gyro_turn_on_bias", "share"] == pytest.approx(0.0, abs=1e-12)
    assert budget.loc["accel_turn_on_bias", "low95"] < bias < budget.loc["accel_turn_on_bias", "high95"]


def test_the_train_still_believes_its_sheets() -> None:
    """Nothing of what an estimator knows changes with what is taken away."""
    listed, parts = some_cells()
    from simrail.campaign.cell import simulated

    truth = simulated(listed[0], parts, Watcher(), 1, 1)
    whole = record_cell(listed[0], truth, parts)
    for term in TERMS:
        if term.is_in(parts.resolve(listed[0])):
            spared = record_cell(listed[0], truth, parts, spared=term.spared)
            assert spared.imu_sheet == whole.imu_sheet
            assert spared.map_errors == whole.map_errors
            assert not spared.imu.equals(whole.imu), term.name


def test_an_ekf_that_cannot_see_the_bias_errs_by_it() -> None:
    listed, parts = some_cells()
    budget = error_budget(listed[:4], parts, AttitudeEkf(), WANTED)
    assert budget["term"].iloc[0] == "accel_turn_on_bias"
    assert budget["share"].iloc[0] > 0.5
    assert "the accelerometer's turn-on bias" in budget_sentence(budget)


def test_every_term_of_a_sheet_is_in_the_budget_or_named_as_left_out() -> None:
    taken = {name for term in TERMS for name in term.grade}
    left = {"name", "rate_hz", "bias_process", "flicker_range_s", "vibration_averaging_s", "bandwidth_hz"}
    left |= {"gyro_bandwidth_hz", "accel_bandwidth_hz", "gyro_axis_noise", "accel_axis_noise"}
    left |= {"oversampling", "output", "dropped_fraction", "dropped_burst", "source", "assumed"}
    left |= {"gyro_bias_correlation_s", "accel_bias_correlation_s", "gyro_range_radps", "accel_range_mps2"}
    assert taken | left == set(ImuGrade.__dataclass_fields__)
    assert not taken & left


def test_a_quantity_that_is_not_estimated() -> None:
    listed, parts = some_cells()
    with pytest.raises(InputError, match="says nothing of it"):
        error_budget(listed[:1], parts, Level(), replace(WANTED, quantity="position"))
