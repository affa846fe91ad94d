"""An odometry is optional, and anybody's: scenarios without one or with a stranger's; roles are said."""

from __future__ import annotations

import io
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from simrail.campaign.campaign import run_campaign
from simrail.campaign.result import CampaignResult
from simrail.cli.main import call
from simrail.cli.score_tables import print_scores
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import odometry_named, with_odometry
from simrail.report.tables.methods import method_styles
from simrail.results import run
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, read_scenario

RIDE = """
title = "A short ride through a curve"
seed = 1
track = "smooth_curve"
vehicle = "metro_irw_bogie"
engine = "kinematic"
{odometry}

[[ride]]
name = "out"
start_m = 110.0
end_m = 300.0
speed_kmh = 40.0
rest_s = 4.0
final_rest_s = 2.0

[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "front"
position_m = [0.0, 0.0, 0.6]

{sensors}
"""

ENCODER = '[encoder]\nwheel = "front.left"\n'

OWN = '''
"""An odometry of one's own: that of the encoder, with another scale."""

from dataclasses import dataclass, replace

from simrail.estimation.estimate import Estimate
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.core.columns import ATTITUDE


@dataclass(frozen=True)
class Mine:
    scale: float = 0.8

    causal = True
    needs = ("encoder",)

    def estimate(self, recording):
        sheet = recording.encoder_sheet
        sheet = replace(sheet, wheel_radius_m=sheet.wheel_radius_m * self.scale)
        return EncoderOdometry().estimate(replace(recording, encoder_sheet=sheet))


@dataclass(frozen=True)
class Speedless(Mine):
    def estimate(self, recording):
        estimate = super().estimate(recording)
        return replace(estimate, states=estimate.states.drop(columns="speed_mps"))


@dataclass(frozen=True, kw_only=True)
class Needy(Mine):
    how: int

    needs = ("sonar",)


@dataclass(frozen=True)
class Level:
    role: str = "baseline"

    causal = True
    needs = ()

    def estimate(self, recording):
        import pandas as pd

        states = pd.DataFrame(0.0, index=recording.imu.index, columns=list(ATTITUDE))
        return Estimate(states=states, mount=recording.mount)
'''


def scenario_of(
    *methods: str, odometry: str = "", sensors: str = ENCODER, folder: Path | None = None
) -> Scenario:
    """That ride, with estimators given as ``"Class"`` or ``"Class option = value"``."""
    text = RIDE.format(odometry=f"odometry = {odometry}" if odometry else "", sensors=sensors)
    for i, method in enumerate(methods):
        name, _, options = method.partition(" ")
        text += f'\n[[estimator]]\nname = "e{i}"\nmethod = "{name}"\n[estimator.options]\n{options}\n'
    return read_scenario(text, name="short", folder=folder)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(OWN)
    return tmp_path


def value(result: CampaignResult, estimator: str, quantity: str, metric: str = "rms") -> float:
    rows = result.scores
    chosen = rows[
        (rows["estimator"] == estimator)
        & (rows["quantity"] == quantity)
        & (rows["metric"] == metric)
        & (rows["window"] == "whole")
        & (rows["reference"] == "truth")
    ]
    return float(chosen["value"].iloc[0])


def test_without_an_encoder_an_estimator_that_needs_no_odometry_runs(tmp_path: Path) -> None:
    """Its scores are those that it has beside an encoder; rows of an odometry are not there."""
    needless = "Vqf rest_bias = false"
    with_encoder = run_campaign(scenario_of(needless))
    done = run(scenario_of(needless, sensors=""), out=tmp_path / "out")
    without = done.campaign
    assert not without.failures
    assert set(without.scores["estimator"]) == {"e0"} and set(without.scores["odometry"]) == {"none"}
    assert {"e0", "odometry:curve_matched"} == set(with_encoder.scores["estimator"])
    keys = ["quantity", "reference", "window", "metric"]
    a, b = (
        table.astype(dict.fromkeys(keys, str))
        .query("estimator == 'e0' and metric != 'us_per_sample'")
        .set_index(keys)["value"]
        for table in (with_encoder.scores, without.scores)
    )
    pd.testing.assert_series_equal(a, b, check_exact=True)
    assert value(without, "e0", "roll") > 0.0
    page = (tmp_path / "out" / "report.html").read_text()
    assert (
        "no odometry: only a method that finds the place itself says where the train is" in page
        and 'id="odometry"' not in page
    )


def test_an_imu_alone_gives_attitude_speed_and_distance(tmp_path: Path) -> None:
    """Veillard's methods without an encoder; of the one without attitude the page draws none."""
    given = 'slope = 0.9\nintercept_mps = -5.0\ncalibration = "given"'
    done = run(
        scenario_of(f"SpectralOdometry {given}", f"VeillardEkf {given}", sensors=""), out=tmp_path / "out"
    )
    assert not done.campaign.failures
    for quantity in ("position", "speed"):
        assert value(done.campaign, "e0", quantity) > 0.0
    for quantity in ("position", "speed", "roll", "pitch"):
        assert value(done.campaign, "e1", quantity) > 0.0
    assert (tmp_path / "out" / "report.html").exists()


def test_a_recording_without_odometry_rests_unknown() -> None:
    """With `rest_bias` on, nothing tells of rest, and nothing is taken off: the same as without."""
    assert value(run_campaign(scenario_of("Vqf", sensors="")), "e0", "roll") == value(
        run_campaign(scenario_of("Vqf rest_bias = false", sensors="")), "e0", "roll"
    )


@pytest.mark.parametrize(
    "method",
    [
        "AttitudeEkf",
        "AttitudeGda",
        "TrajectorySmoother",
        "DesignAngles",
        "ZeroTrack",
        "Vqf compensated = true",
    ],
)
def test_what_needs_an_odometry_is_refused_by_name(method: str) -> None:
    name = method.partition(" ")[0]
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario_of("Vqf", method, sensors=""))
    message = str(caught.value)
    for word in ("estimator[1].method", "the scenario has no odometry", name, '"none"', "add an [encoder]"):
        assert word in message, message
    with pytest.raises(InputError, match="the scenario has no odometry"):
        judge_scenario(scenario_of(method, odometry='["curve_matched", "none"]'))


def test_that_is_exit_code_2_and_nothing_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = RIDE.format(odometry="", sensors="") + '\n[[estimator]]\nname = "ekf"\nmethod = "AttitudeEkf"\n'
    (tmp_path / "mine.toml").write_text(text)
    assert call(["run", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "the scenario has no odometry" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_odometry_of_ones_own_is_used_by_the_filters(own: Path) -> None:
    """It misses a fifth of the way, and so compensation comes in the wrong places; VQF asks nobody."""
    axis = '["encoder", "./mine.py:Mine"]'
    result = run_campaign(scenario_of("AttitudeEkf", "Vqf", odometry=axis, folder=own))
    assert not result.failures
    by_odometry = dict(list(result.scores.groupby("odometry", observed=True)))
    assert set(by_odometry) == {"encoder", "./mine.py:Mine"}

    def rms(odometry: str, estimator: str, quantity: str) -> float:
        rows = by_odometry[odometry].query("metric == 'rms' and window == 'whole' and reference == 'truth'")
        return float(rows[(rows["estimator"] == estimator) & (rows["quantity"] == quantity)]["value"].iloc[0])

    assert rms("encoder", "odometry:encoder", "position") < 2.0
    assert rms("./mine.py:Mine", "odometry:./mine.py:Mine", "position") > 15.0
    assert rms("./mine.py:Mine", "e0", "roll") > 2.0 * rms("encoder", "e0", "roll")
    assert rms("encoder", "e1", "roll") == rms("./mine.py:Mine", "e1", "roll")


def test_a_registered_class_is_an_odometry_too() -> None:
    assert odometry_named("EncoderOdometry") == odometry_named("encoder")
    assert not odometry_named("CurveMatchedOdometry").smoothed  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("odometry", "words"),
    [
        ('"curve_mached"', ["odometry", "no such odometry", "did you mean curve_matched?"]),
        ('"./none.py:Mine"', ["odometry", "no such file", "none.py"]),
        ('"./mine.py:Yours"', ["odometry", "no such estimator class", "Yours"]),
        ('"./mine.py:Needy"', ["odometry", "cannot be made without options", "how"]),
    ],
)
def test_an_odometry_that_cannot_be_is_refused(own: Path, odometry: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario_of("AttitudeEkf", odometry=odometry, folder=own))
    for word in ("short.toml", *words):
        assert word in str(caught.value)


def test_an_odometry_whose_sensor_is_not_there_is_refused() -> None:
    with pytest.raises(
        InputError, match=r'odometry: the odometry needs an encoder; found \'encoder\'.*"none"'
    ):
        judge_scenario(scenario_of("Vqf", odometry='"encoder"', sensors=""))


def test_an_odometry_without_a_column_is_a_failure_with_its_reason(own: Path) -> None:
    result = run_campaign(scenario_of("AttitudeEkf", odometry='"./mine.py:Speedless"', folder=own))
    (failure,) = result.failures
    assert failure.estimator == "e0" and "missing column speed_mps [m/s]" in failure.reason


def test_true_odometry_is_handed_in_or_not_at_all() -> None:
    result = run_campaign(scenario_of("AttitudeEkf", odometry='"truth"', sensors=""))
    assert not result.failures and value(result, "odometry:truth", "position") == 0.0
    recording = result.examples[0].recording
    assert with_odometry(recording, "truth") is recording
    with pytest.raises(InputError, match="does not hold the true odometry"):
        with_odometry(with_odometry(recording, "none"), "truth")


def test_a_role_that_is_said_is_shown(own: Path, tmp_path: Path) -> None:
    """In terminal and page: a stranger's baseline with its mark, whatever its name; an ablation in words."""
    methods = ("./mine.py:Level", './mine.py:Level role = "method"', './mine.py:Level role = "ablation"')
    scenario = scenario_of(*methods, folder=own)
    assert [style.baseline for style in method_styles(scenario).values()] == ["baseline", "", ""]
    done = run(scenario, out=tmp_path / "out")
    console = Console(file=io.StringIO(), width=100)
    print_scores(console, done)
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert "e0 *" in shown and "e1 *" not in shown and "e2 (ablation)" in shown and "* baseline" in shown
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count('<tr class="baseline">') and "e2 (ablation)" in page


def test_a_role_that_nobody_knows_is_refused(own: Path) -> None:
    with pytest.raises(InputError) as caught:
        judge_scenario(scenario_of('./mine.py:Level role = "king"', folder=own))
    for word in ("short.toml", "estimator[0].method", "role", "'king'", "method, baseline, general_purpose"):
        assert word in str(caught.value)
