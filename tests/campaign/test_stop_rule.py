"""The stop rule: how many draws it takes, and that nothing else than the scores decides it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from flaky import FLAKY

from simrail import results
from simrail.campaign import campaign
from simrail.campaign.campaign import key_of, run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult
from simrail.cli.main import CELL_FAILED, DONE, call
from simrail.results import keep_good
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.requirements import stop_rule_of
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scenario.stop_rule import StopRule, StopState
from simrail.scoring.bootstrap import interval

Same = Callable[[pd.DataFrame, pd.DataFrame], None]
Short = Callable[..., Scenario]

CASES = ["ride.speed_kmh=[30, 50]"]
DRAWS = 10
STAGES = (3, 5, 8, 10)


def stop(width: float, *, estimator: str = "ekf_compensated", least: int = 3, quantity: str = "roll") -> str:
    words = f'estimator="{estimator}", quantity="{quantity}", metric="rms"'
    return f"stop={{{words}, width={width!r}, least_draws={least}}}"


def rule(scenario: Scenario) -> StopRule:
    found = stop_rule_of(scenario)
    assert found is not None
    return found


def planted(scenario: Scenario, value: Callable[..., float], draws: int) -> StopState:
    """Look at a table in which each cell has a value that is made for it, in no order."""
    listed = list(cells(scenario))
    rows = pd.DataFrame(
        {
            "cell": [cell.number for cell in listed],
            "estimator": "ekf_compensated",
            "quantity": "roll",
            "band": "full",
            "reference": "truth",
            "window": "whole",
            "metric": "rms",
            "value": [value(cell) for cell in listed],
        }
    )
    others = [rows.assign(value=1e3 * rows["cell"], **{name: "another"}) for name in rows.columns[1:-1]]
    mixed = pd.concat([rows, *others]).sample(frac=1.0, random_state=1)
    return rule(scenario).state(listed, [mixed[::2], mixed[1::2]], draws)


def test_stages_grow_by_half_and_end_with_the_draws(short: Short) -> None:
    settings = [f"monte_carlo.sensor_draws={DRAWS}", stop(1.0)]
    assert rule(short(*settings)).stages == STAGES
    assert rule(short("monte_carlo.sensor_draws=3", stop(1.0))).stages == (3,)
    assert rule(short("monte_carlo.sensor_draws=2", stop(1.0, least=2))).stages == (2,)


def test_a_draw_is_one_of_what_the_interval_resamples(short: Short) -> None:
    drawn = "ride.acceleration_mps2={uniform=[0.4, 0.6]}"
    sensors, tracks = "monte_carlo.sensor_draws=4", "monte_carlo.track_draws=5"
    for level, number, settings in (
        ("sensor_draw", 4, [sensors]),
        ("track_draw", 5, [sensors, tracks]),
        ("sample", 6, [sensors, drawn, "monte_carlo.samples=6"]),
        ("track_draw", 5, [sensors, tracks, drawn, "monte_carlo.samples=6"]),
    ):
        scenario = short(*settings, stop(1.0))
        found = rule(scenario)
        assert (found.level, found.draws) == (level, number)
        listed = list(cells(scenario))
        taken = [cell for cell in listed if found.has(cell, 2, None)]
        assert len(taken) * number == 2 * len(listed)
        assert {getattr(cell, level) for cell in taken} == {0, 1}


def test_the_width_is_that_of_the_named_figure_over_the_first_draws(short: Short) -> None:
    """Draws beyond the look, and figures of any other name, are wild: neither is seen."""
    scenario = short(*CASES, "monte_carlo.sensor_draws=9", stop(0.5))
    drawn = np.random.default_rng(1).rayleigh(1.0, (2, 9))
    drawn[:, 6:] = 1e6
    look = planted(scenario, lambda cell: drawn[cell.case, cell.sensor_draw], 6)
    widths = [found.high - found.low for found in (interval(row[:6]) for row in drawn)]
    assert look.width == pytest.approx(max(widths), rel=1e-12)
    assert f"ride.speed_kmh = {(30.0, 50.0)[int(np.argmax(widths))]}" in look.case
    assert (look.draws, look.of, look.unit) == (6, 9, "deg")


def test_draws_of_one_track_hang_together(short: Short) -> None:
    """Many draws of the sensors over each track do not narrow what the tracks differ by."""
    scenario = short("monte_carlo.track_draws=6", "monte_carlo.sensor_draws=50", stop(1.0))
    of_track = np.random.default_rng(2).normal(1.0, 0.3, 6)
    look = planted(scenario, lambda cell: of_track[cell.track_draw], 6)
    alone = interval(of_track)
    assert look.width == pytest.approx(alone.high - alone.low, rel=1e-9)


def test_samples_over_the_same_number_of_a_track_are_other_tracks(short: Short) -> None:
    drawn = ["ride.acceleration_mps2={uniform=[0.4, 0.6]}", "monte_carlo.samples=4"]
    scenario = short(*drawn, "monte_carlo.track_draws=3", "monte_carlo.sensor_draws=2", stop(1.0))
    made = np.random.default_rng(3).normal(1.0, 0.3, (4, 3))
    look = planted(scenario, lambda cell: made[cell.sample, cell.track_draw], 3)
    alone = interval(made.T.ravel())
    assert look.width == pytest.approx(alone.high - alone.low, rel=1e-9)
    assert "acceleration" not in look.case


@pytest.mark.parametrize("lost", [1, 3])
def test_a_case_needs_the_least_draws_with_a_value(lost: int, short: Short) -> None:
    """Equal values have an interval of no width; few of them say nothing all the same."""
    scenario = short(*CASES, "monte_carlo.sensor_draws=9", stop(0.5))

    def value(cell):  # type: ignore[no-untyped-def]
        return np.nan if cell.case == 1 and cell.sensor_draw < lost else 1.0

    first, second = planted(scenario, value, 3), planted(scenario, value, 5)
    assert not first.reached and first.width is None and "ride.speed_kmh = 50.0" in first.case
    assert "unknown for want of values" in first.words
    assert second.reached == (lost == 1)


def test_an_imu_with_draws_of_its_own_is_not_waited_for(short: Short) -> None:
    second = 'imu=[{name="a", grade="ideal", body="front", position_m=[0,0,0.6], sensor_draws=2},'
    second += '{name="b", grade="ideal", body="front", position_m=[0,0,0.6]}]'
    scenario = short("imu.grade='ideal'", second, "monte_carlo.sensor_draws=9", stop(0.5))
    look = planted(scenario, lambda cell: 100.0 * cell.sensor_draw if cell.imu.name == "a" else 1.0, 3)
    assert look.reached and "on b" in look.case
    tracks = short("imu.grade='ideal'", second, "monte_carlo.track_draws=9", stop(0.5))
    assert not planted(tracks, lambda cell: 9.0 * cell.track_draw * (cell.imu.name == "a"), 3).reached


@pytest.mark.long
def test_coverage_at_the_stop_stays_near_that_of_one_look(short: Short) -> None:
    """Optional stopping costs a little: measured on 200 campaigns of skewed scores (Rayleigh).

    Chance moves a share of 200 by 0.015 (sd) at 0.95. Below 0.90 the rule could not be recommended.
    """
    truth, spread = np.sqrt(np.pi / 2.0), np.sqrt(2.0 - np.pi / 2.0)
    chance = np.random.default_rng(4)
    stages = rule(short("monte_carlo.sensor_draws=80", stop(1.0, least=10))).stages
    assert stages == (10, 15, 23, 35, 53, 80)
    covered = stopped_early = 0
    for _ in range(200):
        values = chance.rayleigh(1.0, 80)
        for draws in stages:
            found = interval(values[:draws])
            if found.high - found.low < 0.8 * spread:
                break
        covered += found.low <= truth <= found.high
        stopped_early += draws < 80
    assert stopped_early > 195
    assert 0.90 < covered / 200 < 0.98


@pytest.fixture(scope="module")
def all_draws(short: Short, module_rides: None) -> CampaignResult:
    """The campaign without a rule: 2 cases of `DRAWS` draws of the sensors."""
    return run_campaign(short(*CASES, f"monte_carlo.sensor_draws={DRAWS}"), workers=1)


def widths_of(found: CampaignResult) -> dict[int, float]:
    """Width of the widest case at each look, from the whole table."""
    rows = found.scores.query(
        "estimator == 'ekf_compensated' and quantity == 'roll' and metric == 'rms'"
        " and window == 'whole' and reference == 'truth'"
    ).merge(found.cells[["cell", "case"]], on="cell")
    assert len(rows) == 2 * DRAWS
    widths = {}
    for draws in STAGES:
        seen = [interval(case.loc[case["sensor_draw"] < draws, "value"]) for _, case in rows.groupby("case")]
        widths[draws] = max(one.high - one.low for one in seen)
    return widths


def width_for(found: CampaignResult, draws: int) -> float:
    """A width that is first reached after so many draws."""
    widths = widths_of(found)
    before = min(width for number, width in widths.items() if number < draws)
    assert widths[draws] < before
    return 0.5 * (widths[draws] + before)


def rows_of(found: CampaignResult, draws: int) -> pd.DataFrame:
    return found.scores[found.scores["sensor_draw"] < draws].reset_index(drop=True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("workers", "batch_cells"),
    [(1, 5), *(pytest.param(*each, marks=pytest.mark.slow) for each in ((1, 1), (2, 3), (2, None)))],
)
def test_it_stops_at_the_same_draws_with_the_same_bits_whoever_runs_it(
    workers: int,
    batch_cells: int | None,
    all_draws: CampaignResult,
    short: Short,
    assert_same: Same,
) -> None:
    """Exactly the rows that the campaign without a rule has for these draws, under the same numbers."""
    draws = 8
    scenario = short(*CASES, f"monte_carlo.sensor_draws={DRAWS}", stop(width_for(all_draws, draws)))
    found = run_campaign(scenario, workers=workers, batch_cells=batch_cells)
    assert found.stopped is not None and found.stopped.reached
    assert (found.stopped.draws, found.stopped.of) == (draws, DRAWS)
    assert found.stopped.width == pytest.approx(widths_of(all_draws)[draws], rel=1e-12)
    assert_same(rows_of(all_draws, draws), found.scores)
    pd.testing.assert_frame_equal(
        all_draws.cells[all_draws.cells["sensor_draw"] < draws].reset_index(drop=True), found.cells
    )


@pytest.mark.long
def test_order_of_rides_and_what_is_finished_already_do_not_count(
    all_draws: CampaignResult,
    short: Short,
    tmp_path: Path,
    assert_same: Same,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All draws are kept from before: the rule stops where it stops, and the others are dropped."""
    scenario = short(*CASES, f"monte_carlo.sensor_draws={DRAWS}", stop(width_for(all_draws, 8)))
    plan, kept = judge_scenario(scenario), Checkpoint(tmp_path / "kept")
    with monkeypatch.context() as patch:
        patch.setattr(campaign, "stop_rule_of", lambda scenario: None)
        run_campaign(plan, checkpoint=kept, batch_cells=3)
    found = run_campaign(plan, checkpoint=kept)
    assert found.stopped is not None and found.stopped.draws == 8
    assert_same(rows_of(all_draws, 8), found.scores)
    assert len(found.cells) == 16


@pytest.mark.long
@pytest.mark.parametrize("ended_after", [pytest.param(1, marks=pytest.mark.slow), 4])
def test_interrupted_within_a_round_it_goes_on_to_the_same(
    ended_after: int, all_draws: CampaignResult, short: Short, tmp_path: Path, assert_same: Same
) -> None:
    scenario = short(*CASES, f"monte_carlo.sensor_draws={DRAWS}", stop(width_for(all_draws, 8)))
    kept, real = Checkpoint(tmp_path / "kept"), Checkpoint.add
    count = 0

    def add(self, result):  # type: ignore[no-untyped-def]
        nonlocal count
        count += 1
        real(self, result)
        if count == ended_after:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Checkpoint, "add", add)
        with pytest.raises(KeyboardInterrupt):
            run_campaign(scenario, checkpoint=kept, workers=1, batch_cells=2)
    assert not kept.is_empty
    found = run_campaign(scenario, checkpoint=kept, workers=1, batch_cells=3)
    assert found.stopped is not None and found.stopped.draws == 8
    assert_same(rows_of(all_draws, 8), found.scores)


@pytest.mark.long
def test_progress_counts_the_cells_of_a_round(
    all_draws: CampaignResult, short: Short, tmp_path: Path
) -> None:
    class Counting(Watcher):
        def __init__(self) -> None:
            self.begun: list[tuple[int, int]] = []
            self.done: list[tuple[int, int]] = []

        def cells_begin(self, done: int, count: int) -> None:
            self.begun.append((done, count))

        def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
            self.done.append((done, count))

    watcher = Counting()
    scenario = short(*CASES, f"monte_carlo.sensor_draws={DRAWS}", stop(width_for(all_draws, 8)))
    run_campaign(scenario, workers=1, batch_cells=20, watcher=watcher)
    assert watcher.begun == [(0, 6), (6, 10), (10, 16)]
    assert watcher.done == [(3, 6), (6, 6), (8, 10), (10, 10), (13, 16), (16, 16)]


@pytest.mark.long
def test_not_reached_after_all_draws_names_the_widest_case(
    all_draws: CampaignResult, short: Short, assert_same: Same
) -> None:
    draws, width = 5, 0.5 * min(widths_of(all_draws).values())
    found = run_campaign(short(*CASES, f"monte_carlo.sensor_draws={draws}", stop(width)), workers=1)
    assert found.stopped is not None and not found.stopped.reached
    # Numbers of cells count all draws of a case.
    assert_same(rows_of(all_draws, draws).drop(columns="cell"), found.scores.drop(columns="cell"))
    words = found.stopped.words
    assert f"not reached after all {draws} draws of the sensors" in words and "ride.speed_kmh = " in words


@pytest.mark.long
def test_a_figure_that_an_estimator_never_gives_is_not_reached(module_rides: None, short: Short) -> None:
    settings = ["monte_carlo.sensor_draws=3", stop(1.0, estimator="design_angles", quantity="gyro_bias")]
    found = run_campaign(short(*settings), workers=1)
    assert found.stopped is not None and found.stopped.width is None
    assert "unknown for want of values" in found.stopped.words


@pytest.mark.long
def test_one_cell_alone_asks_no_rule(module_rides: None, short: Short) -> None:
    found = run_campaign(short("monte_carlo.sensor_draws=9", stop(9.0)), only=8)
    assert found.stopped is None and list(found.cells["cell"]) == [8]


@pytest.mark.long
def test_results_tell_of_it_and_failed_cells_are_tried_again(
    noting_file: Path,
    here: Path,
    assert_same: Same,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A stopped table has not all cells of its scenario: those that it lacks are not good ones."""
    monkeypatch.setattr(
        results, "write_report", lambda path, **keywords: path.write_text(str(keywords["manifest"]["stop"]))
    )
    (noting_file.parent / "noting.py").write_text(FLAKY)
    settings = ["monte_carlo.sensor_draws=12", stop(5.0, estimator="ekf", least=4)]
    words = ["run", str(noting_file), "--workers", "1"]
    words += [word for one in settings for word in ("--set", one)]
    assert call([*words, "--out", "results/whole"]) == DONE
    assert "stop rule reached after 4 of 12 draws of the sensors" in " ".join(capsys.readouterr().out.split())
    (here / "broken").touch()
    assert call(words) == CELL_FAILED
    (here / "broken").unlink()
    capsys.readouterr()
    had = set(pd.read_parquet(here / "results" / "mine" / "scores.parquet")["cell"])
    plan, kept = judge_scenario(load_scenario(noting_file, overrides=settings)), Checkpoint(here / "kept")
    keep_good(here / "results" / "mine", plan, key_of(plan), kept)
    failed = json.loads((here / "results" / "mine" / "manifest.json").read_text())["failures"]
    assert len(had) == 8 and kept.cells() == had - {failure["cell"] for failure in failed}
    assert 0 < len(kept.cells()) < 8
    assert call([*words, "--retry-failed"]) == DONE
    whole, again = (pd.read_parquet(here / "results" / name / "scores.parquet") for name in ("whole", "mine"))
    assert set(whole["sensor_draw"]) == {0, 1, 2, 3}
    assert_same(whole, again)
    manifest = json.loads((here / "results" / "mine" / "manifest.json").read_text())
    assert manifest["cells"] == 8 and manifest["stop"]["draws"] == 4 and manifest["stop"]["reached"]
    assert "reached after 4 of 12" in (here / "results" / "mine" / "report.html").read_text()


def test_each_look_knows_the_one_before_and_the_last_ends_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the stages 2, 3 and 5 the second settles it: which cells run next follows from the look before."""
    asked: list[tuple[int | None, object]] = []
    looks: list[tuple[int, object]] = []
    states = {draws: SimpleNamespace(reached=draws == 3, words=f"after {draws}") for draws in (2, 3, 5)}

    def chosen_cells(
        _plan: object, _only: object = None, *, draws: int | None = None, former: object = None
    ) -> list:
        asked.append((draws, former))
        return []

    def state(_cells: object, _tables: object, draws: int, former: object) -> object:
        looks.append((draws, former))
        return states[draws]

    rule = SimpleNamespace(stages=(2, 3, 5), draws=5, state=state)
    monkeypatch.setattr(campaign, "stop_rule_of", lambda scenario: rule)
    monkeypatch.setattr(campaign, "chosen_cells", chosen_cells)
    plan = SimpleNamespace(cells=10, scenario=None)
    loop = campaign._Loop(plan, b"", Checkpoint(tmp_path), Watcher(), None, None)  # type: ignore[arg-type]
    assert loop.run(None) is states[3]  # type: ignore[arg-type]
    assert looks == [(2, None), (3, states[2])]
    first, second = asked[:3], asked[3:]
    assert first == [(2, None), (5, None), (None, None)]
    assert second == [(3, states[2]), (5, states[2]), (None, None)]
    # What is left to run is chosen as it was counted.
    assert list(loop._chosen()) == [] and asked[-1] == (3, states[2])
