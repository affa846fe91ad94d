"""The report's sentences are looked up in the scores, also when they do not flatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import CellResult
from simrail.core.columns import ATTITUDE
from simrail.estimation.estimate import Estimate
from simrail.report.tables.methods import method_styles
from simrail.report.tables.pivot import Mean, cases
from simrail.report.words.findings import findings
from simrail.report.words.sentences import significant
from simrail.scenario.scenario import Scenario

Rides = Callable[..., CellResult]
Tables = Callable[..., tuple[pd.DataFrame, pd.DataFrame]]


def said(scenario: Scenario, scores: pd.DataFrame, cells: pd.DataFrame) -> str:
    styles = list(method_styles(scenario).values())
    return "\n".join(finding.text for finding in findings(cases(scores, cells)[0], styles))


def test_sentences_are_looked_up_in_the_scores(scenario: Scenario, example: Rides, tables: Tables) -> None:
    text = said(scenario, *tables(example()))
    sizes = "from 0.500\u00b0 rms without to 0.100\u00b0 with it: 5.0 times less"
    assert f"In curves, compensation takes the roll error of EKF {sizes}" in text
    # Design: roll off by the square wave of 0.25 deg, pitch exact.
    assert (
        "'Design angles only', which uses no IMU, beats EKF compensated in pitch (0\u00b0 against 0.200\u00b0"
        in text
    )
    assert "beats EKF compensated in roll" not in text
    assert "beats plain filter" not in text and "beats VQF" not in text, "baselines against a baseline"
    assert "VQF is worse than EKF compensated in roll: 0.400\u00b0 against 0.100\u00b0 rms" in text
    assert "No ideal IMU was run" in text
    assert "odometry 'encoder'; its position error is 0.500 m rms" in text


def test_sentences_turn_with_the_scores(scenario: Scenario, example: Rides, tables: Tables) -> None:
    """Exchange the method with its uncompensated twin: the page must say that compensation hurts."""
    one = example()
    swapped = dict(one.estimates)
    swapped["ekf_compensated"], swapped["plain_filter"] = swapped["plain_filter"], swapped["ekf_compensated"]
    text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, swapped)))
    assert "compensation does not reduce the roll error of EKF" in text and "times less" not in text
    assert "beats EKF compensated in roll (0.250\u00b0 against 0.500\u00b0 rms)" in text
    assert "VQF is better than EKF compensated" in text


def test_a_filter_that_is_never_beaten_is_said_to_be_so(
    scenario: Scenario,
    example: Rides,
    tables: Tables,
) -> None:
    one = example()
    states = one.motion[list(ATTITUDE)]
    perfect = dict(one.estimates, ekf_compensated=Estimate(states=states, mount="axle"))
    text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, perfect)))
    assert "'Design angles only', which uses no IMU, nowhere beats EKF compensated: neither" in text


def test_coverage_decides_what_is_said_of_the_standard_deviations(
    scenario: Scenario,
    example: Rides,
    tables: Tables,
) -> None:
    one = example()
    for sd_deg, verdict in ((0.1, "larger than need be"), (0.04, "are too small")):
        states = one.estimates["ekf_compensated"].states.assign(roll_sd_rad=np.deg2rad(sd_deg))
        estimates = dict(one.estimates, ekf_compensated=Estimate(states=states, mount="axle"))
        text = said(scenario, *tables(CellResult(one.cell, one.recording, one.motion, estimates)))
        assert verdict in text


def test_true_odometry_is_called_an_ablation(scenario: Scenario, example: Rides, tables: Tables) -> None:
    one = example()
    scores, cells = tables(one)
    scores["estimator"] = scores["estimator"].cat.rename_categories({"odometry:encoder": "odometry:truth"})
    assert "ablation" in said(scenario, scores, cells)


def test_the_ideal_imu_tells_the_floor(scenario: Scenario, example: Rides, tables: Tables) -> None:
    one = example()
    ideal = CellResult(one.cell | {"imu": "ideal"}, one.recording, one.motion, one.estimates)
    all_cases = cases(*tables(one, ideal))
    styles = list(method_styles(scenario).values())
    text = "\n".join(finding.text for finding in findings(all_cases[0], styles, others=all_cases))
    assert "With an ideal IMU" in text and "EKF compensated 0.100\u00b0 instead of 0.100\u00b0" in text


def test_roles_follow_from_the_scenario_not_from_names(scenario: Scenario) -> None:
    styles = method_styles(scenario)
    assert {name: style.baseline for name, style in styles.items()} == {
        "ekf_compensated": "",
        "plain_filter": "uncompensated",
        "vqf": "general purpose",
        "design_angles": "no IMU",
    }
    assert styles["ekf_compensated"].twin == "plain_filter"
    assert len({(style.colour, style.stroke) for style in styles.values()}) == len(styles)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.21349, "0.213"),
        (2.1349, "2.13"),
        (123.4, "123"),
        (0.00012, "0.0001"),
        (0.0999999, "0.100"),
        (1e-9, "<0.0001"),
        (np.nan, "\u2013"),
        (np.inf, "\u2013"),
    ],
)
def test_numbers_have_three_significant_digits(value: float, text: str) -> None:
    assert significant(value) == text


def test_metrics_that_were_not_kept_are_not_spoken_of(
    scenario: Scenario,
    example: Rides,
    tables: Tables,
) -> None:
    scores, cells = tables(example())
    text = said(scenario, scores[scores["metric"] == "rms"], cells)
    assert "position error is 0.500 m rms." in text and "at most" not in text
    text = said(scenario, scores[scores["metric"] == "sd"], cells)
    assert "nan" not in text.lower() and "position error" not in text


def test_the_floor_is_that_of_the_same_speed(scenario: Scenario, example: Rides, tables: Tables) -> None:
    """Cases of other speeds have an ideal IMU, too: it is not this one's floor."""
    one = example()
    ideal = CellResult(one.cell | {"imu": "ideal"}, one.recording, one.motion, one.estimates)
    scores, cells = tables(one, ideal, draws=1)
    styles = list(method_styles(scenario).values())

    def floor_with(speeds: list[float]) -> str:
        found = cases(scores, cells.assign(**{"ride.speed_kmh": speeds}))
        return "\n".join(finding.text for finding in findings(found[0], styles, others=found))

    assert "With an ideal IMU" in floor_with([20.0, 20.0])
    assert "No ideal IMU was run" in floor_with([20.0, 70.0])


def test_a_general_purpose_filter_is_held_against_the_best_of_the_methods(
    scenario: Scenario, example: Rides, tables: Tables
) -> None:
    (case, *_) = cases(*tables(example()))
    styles = list(method_styles(scenario).values())
    tested = next(style for style in styles if style.name == "ekf_compensated")
    second = replace(tested, name="second", label="second EKF", twin="")
    figure = {("second", "roll", "full", "truth", "whole", "rms"): Mean(0.3, float("nan"), 1)}
    two = replace(case, scores=case.scores | figure)
    for order in ([*styles, second], [second, *styles]):
        text = "\n".join(finding.text for finding in findings(two, order))
        assert "VQF is worse than EKF compensated in roll: 0.400\u00b0 against 0.100\u00b0 rms" in text


def test_of_many_methods_each_is_told_with_the_worse_of_roll_and_pitch(
    scenario: Scenario, example: Rides, tables: Tables
) -> None:
    (case, *_) = cases(*tables(example()))
    styles = list(method_styles(scenario).values())
    tested = next(style for style in styles if style.name == "ekf_compensated")
    more = [replace(tested, name=f"method {i}", label=f"method {i}", twin="") for i in range(4)]
    figures = {}
    for i, style in enumerate(more):
        for angle, share in (("roll", 0.94), ("pitch", 0.6 - 0.01 * i)):
            figures[style.name, angle, "full", "truth", "whole", "coverage95"] = Mean(share, float("nan"), 1)
            error = Mean(0.1 + 0.1 * i, float("nan"), 1)
            figures[style.name, angle, "full", "truth", "whole", "rms"] = error
    many = replace(case, scores=case.scores | figures)
    text = "\n".join(finding.text for finding in findings(many, [*styles, *more]))
    for i in range(4):
        assert f"method {i} ({60 - i} % inside)" in text
