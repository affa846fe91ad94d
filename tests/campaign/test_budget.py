"""The budget of an error: of a linear estimator by closed form, and of an attitude by what is known of it."""

import html
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf

from simrail.campaign import budget as budgets
from simrail.campaign.budget import (
    OF_THE_RIDE,
    TERMS,
    TOGETHER,
    budget_sentence,
    error_budget,
    ride_budget,
)
from simrail.campaign.cell import record_cell
from simrail.campaign.progress import Watcher
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.recording.sheets.grades import ImuGrade
from simrail.results import run
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.check import judge_scenario
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


@pytest.mark.long
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


class Stranger(Level):
    """Does what the fence is there for."""

    def estimate(self, recording: Recording) -> Estimate:
        print("a word of a stranger")
        np.seterr(all="ignore")
        os.environ["SIMRAIL_TEST_STRANGER"] = "here"
        assert not recording.imu.to_numpy().flags.writeable
        return super().estimate(recording)


class Leaver(Level):
    """Ends the process."""

    def estimate(self, recording: Recording) -> Estimate:
        raise SystemExit(3)


def test_a_budget_runs_estimators_behind_the_fence(capsys: pytest.CaptureFixture[str]) -> None:
    listed, parts = some_cells()
    before = np.geterr()
    error_budget(listed[:1], parts, Stranger(), WANTED)
    assert np.geterr() == before and "SIMRAIL_TEST_STRANGER" not in os.environ
    assert "a word of a stranger" not in capsys.readouterr().out


class Listener(Watcher):
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def told(self, line: str) -> None:
        self.lines.append(line)


@pytest.mark.long
def test_the_page_of_a_ride_says_what_its_error_is_made_of(here: Path, own_cache: None) -> None:
    listener = Listener()
    found = run(read_scenario(TEXT, name="budget"), budget_draws=2, watcher=listener)
    budget = found.budgets
    assert set(budget["number"]) == {OF_THE_RIDE} and set(budget["draws"]) == {2}
    assert set(budget["estimator"]) == {"ekf"} and set(budget["what"]) == {"roll rms"}
    assert budget["share"].sum() == pytest.approx(1.0, abs=1e-9)
    page = (found.folder / "report.html").read_text(encoding="utf-8")
    assert "What the error is made of" in page and budget_sentence(budget) in html.unescape(page)
    (cost,) = [line for line in listener.lines if line.startswith("budget: ")]
    assert f"{2 * len(budget)} estimates by ekf" in cost
    # Without, the page has no such part.
    plain = run(read_scenario(TEXT, name="budget"), out="plain")
    assert "What the error is made of" not in (plain.folder / "report.html").read_text(encoding="utf-8")
    assert plain.budgets.empty


def test_a_method_that_fails_has_no_budget_and_the_run_goes_on() -> None:
    listener = Listener()
    scenario = read_scenario(TEXT, name="budget")
    plan = replace(judge_scenario(scenario), estimators={"leaver": Leaver()})
    assert ride_budget(plan, 1, watcher=listener).empty
    assert any("no budget of leaver" in line for line in listener.lines)


def test_a_quantity_that_is_not_estimated() -> None:
    listed, parts = some_cells()
    with pytest.raises(InputError, match="says nothing of it"):
        error_budget(listed[:1], parts, Level(), replace(WANTED, quantity="position"))


OTHER_MOUNT = """
[[imu]]
name = "high"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 2.0]
[[require]]
quantity = "roll"
limit = "0.1 deg"
budget_draws = 3
"""


@pytest.mark.parametrize(
    "budget_at, mounts", [("each", ["axle", "high"]), ("worst", ["high"])], ids=["each", "worst"]
)
def test_a_budget_is_of_the_mount_that_is_asked_for(
    budget_at: str, mounts: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The worst is where devices of the best method there are the worst; one that is not judged is none."""
    text = TEXT + OTHER_MOUNT + f'budget_at = "{budget_at}"\n'
    plan = judge_scenario(read_scenario(text, name="budget"))
    asked: list[tuple[str, int]] = []

    def taken_apart(draws: list[Cell], *_: object, **__: object) -> pd.DataFrame:
        asked.append((draws[0].imu.name, len(draws)))
        assert [cell.sensor_draw for cell in draws] == [0, 1, 2]
        return pd.DataFrame({"term": ["floor"], "share": [1.0]})

    monkeypatch.setattr(budgets, "error_budget", taken_apart)
    rows = [("axle", 0.2), ("high", 0.3), ("high", 0.9)]
    verdicts = pd.DataFrame(
        [
            {"number": 0, "vehicle": "metro_irw_bogie", "mount": mount, "imu": "lord_3dm_gx4_25"}
            | {"estimator": "ekf", "at_share": value}
            for mount, value in rows
        ]
    )
    found = budgets.budgets_of(plan, verdicts)
    assert asked == [(mount, 3) for mount in mounts]
    assert list(found["mount"]) == mounts
    verdicts.loc[verdicts["mount"] == "high", "at_share"] = np.nan
    asked.clear()
    budgets.budgets_of(plan, verdicts)
    assert asked == [(mount, 3) for mount in (["axle", "high"] if budget_at == "each" else ["axle"])]
