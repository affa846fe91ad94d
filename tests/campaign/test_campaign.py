"""The campaign loop: cells, seeds, shared rides, failed rows, repeatable scores."""

from __future__ import annotations

import signal
from concurrent.futures import BrokenExecutor, Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.campaign import executors, worker
from simrail.campaign.campaign import run_campaign
from simrail.campaign.cell import Failure
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult, gather
from simrail.core.toml_files import shipped
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario
from simrail.scoring.aggregate import aggregate
from simrail.scoring.table import OK, SCORE_COLUMNS
from simrail.track.file import track_by_name

SHORT = [
    "ride.end_m=300.0",
    "ride.acceleration_mps2=2.0",
    "ride.jerk_mps3=4.0",
    "ride.rest_s=2.0",
    "imu.grade='lord_3dm_gx4_25'",
]

pytestmark = pytest.mark.usefixtures("own_cache")


def short(*settings: str) -> Scenario:
    return load_scenario("quick_kinematic", overrides=[*SHORT, *settings])


@pytest.fixture(scope="module")
def two_draws() -> CampaignResult:
    return run_campaign(short())


def without_time(scores: pd.DataFrame) -> pd.DataFrame:
    kept = scores[scores["metric"] != "us_per_sample"].reset_index(drop=True)
    return kept.astype({name: str for name in kept.columns if kept[name].dtype == "category"})


def test_table_has_the_fixed_columns_and_no_failure(two_draws: CampaignResult) -> None:
    assert list(two_draws.scores.columns) == list(SCORE_COLUMNS)
    assert two_draws.failures == []
    assert len(two_draws.cells) == 2
    assert set(two_draws.scores["estimator"].astype(str)) == {
        "odometry:curve_matched",
        "ekf_compensated",
        "ekf_uncompensated",
        "design_angles",
    }
    whole = two_draws.scores.query("window == 'whole' and quantity == 'roll' and metric == 'rms'")
    assert (whole["status"] == OK).all() and len(whole) == 2 * 3 * 2


def test_the_ride_that_is_drawn_has_the_map_that_errs_beside_the_line_that_was_laid() -> None:
    """Whichever the scenario names first; of exact maps alone one of them is drawn."""
    both = run_campaign(short("map.exact=[true, false]", "monte_carlo.sensor_draws=1"))
    assert both.cells["map"].tolist() == ["exact", "drawn"]
    (example,) = both.examples
    assert example.cell["map"] == "drawn"
    curve = [one.line.elements[2] for one in (example, replace(example, laid=None))]
    assert example.line == track_by_name("smooth_curve") != example.recording.track
    assert curve[0] != curve[1] == example.recording.track.elements[2]
    (alone,) = run_campaign(short("map.exact=true", "monte_carlo.sensor_draws=1")).examples
    assert alone.cell["map"] == "exact" and alone.line == alone.recording.track


def test_rides_that_are_drawn_shake_where_any_does() -> None:
    """A ride in silence is a ride of its own, and an ablation: it is drawn where no other is."""
    both = run_campaign(short("vibration.off=[true, false]", "monte_carlo.sensor_draws=1"))
    assert not both.failures and set(both.cells["vibration"]) == {"on", "off"}
    assert both.scores.groupby("cell")["vibration"].first().tolist() == both.cells["vibration"].tolist()
    (example,) = both.examples
    assert example.cell["vibration"] == "on" and example.shaken
    (alone,) = run_campaign(short("vibration.off=true", "monte_carlo.sensor_draws=1")).examples
    assert alone.cell["vibration"] == "off" and alone.shaken is None


def test_same_seed_gives_the_same_bits(two_draws: CampaignResult) -> None:
    again = run_campaign(short())
    pd.testing.assert_frame_equal(
        without_time(two_draws.scores), without_time(again.scores), check_exact=True
    )


def test_another_seed_gives_other_scores(two_draws: CampaignResult) -> None:
    other = run_campaign(short("seed=2"))
    chosen = "estimator == 'ekf_compensated' and metric == 'rms' and quantity == 'roll' and status == 'ok'"
    ours, theirs = two_draws.scores.query(chosen)["value"], other.scores.query(chosen)["value"]
    assert len(ours) == len(theirs) > 4
    assert not np.isclose(ours.to_numpy(), theirs.to_numpy(), rtol=1e-6).any()


def test_a_cell_does_not_depend_on_its_neighbours(two_draws: CampaignResult) -> None:
    # The same ride among others, in another place of the order, with more draws and another estimator.
    more = short(
        "monte_carlo.sensor_draws=3",
        "ride.speed_kmh=[30.0, 50.0]",
        "odometry=['truth', 'curve_matched']",
        "estimator[0].options.rest_bias=[false, true]",
    )
    found = run_campaign(more)
    assert len(found.cells) == 2 * 2 * 3
    wanted = found.cells.query("speed_kmh == 50 and odometry == 'curve_matched' and sensor_draw < 2")
    keys = ["sensor_draw", "quantity", "reference", "window", "metric"]
    for name, theirs_name in (
        ("ekf_compensated", "ekf_compensated[rest_bias=True]"),
        ("ekf_uncompensated", "ekf_uncompensated"),
        ("odometry:curve_matched", "odometry:curve_matched"),
    ):
        ours = without_time(two_draws.scores[two_draws.scores["estimator"] == name])
        theirs = without_time(
            found.scores[
                (found.scores["estimator"] == theirs_name) & found.scores["cell"].isin(wanted["cell"])
            ]
        )
        pd.testing.assert_series_equal(
            ours.set_index(keys)["value"], theirs.set_index(keys)["value"], check_exact=True
        )


def test_draws_differ_and_rides_over_one_draw_are_paired(two_draws: CampaignResult) -> None:
    rms = two_draws.scores.query(
        "estimator == 'ekf_compensated' and metric == 'rms' and reference == 'truth'"
    )
    first, second = (rms[rms["sensor_draw"] == draw]["value"].to_numpy() for draw in (0, 1))
    assert not np.isclose(first[np.isfinite(first)], second[np.isfinite(second)], rtol=1e-6).any()
    back = read_scenario(
        shipped("scenario")["quick_kinematic"]
        .read_text()
        .replace(
            "[[imu]]", '[[ride]]\nname = "back"\nstart_m = 590.0\nend_m = 10.0\nspeed_kmh = 50.0\n\n[[imu]]'
        ),
        name="both",
        overrides=["monte_carlo.track_draws=3"],
    )
    listed = list(cells(back))
    seeds = {(cell.ride.name, cell.track_draw): (cell.ride_seed, cell.sensor_seed) for cell in listed}
    assert all(seeds["out", draw] == seeds["back", draw] for draw in range(3))
    assert len(set(seeds.values())) == 3
    assert len({seed for pair in seeds.values() for seed in pair}) == 6
    assert len({cell.ride_number for cell in listed}) == 6 and len({cell.case for cell in listed}) == 4


class Counter(Watcher):
    def __init__(self) -> None:
        self.rides: list[str] = []
        self.last = (0, 0, 0)

    def ride_begins(self, number: int, count: int, name: str) -> None:
        self.rides.append(f"{number}/{count} {name}")

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        self.last = (done, count, failed)


FAILING = """
from dataclasses import dataclass
import numpy as np
from simrail.estimators.baselines import DesignAngles

@dataclass(frozen=True)
class Failing:
    'Fails on every second draw of its life, or gives NaN.'
    nan: bool = False
    causal = True

    def estimate(self, recording):
        found = DesignAngles().estimate(recording)
        if self.nan:
            found.states.iloc[5:, 0] = np.nan
            return found
        if len(recording.imu) > 100 and recording.imu['gyro_x_radps'].iloc[0] > 0:
            raise RuntimeError('the\\nwheel came off')
        return found
"""


def test_failures_are_rows_and_the_others_go_on(tmp_path: Path) -> None:
    (tmp_path / "failing.py").write_text(FAILING)
    text = shipped("scenario")["quick_kinematic"].read_text()
    text += '\n[[estimator]]\nname = "failing"\nmethod = "failing.py:Failing"\n'
    text += '\n[[estimator]]\nname = "nan"\nmethod = "failing.py:Failing"\noptions = { nan = true }\n'
    text += '\n[[estimator]]\nname = "after"\nmethod = "DesignAngles"\n'
    scenario = read_scenario(
        text, name="failing", folder=tmp_path, overrides=[*SHORT, "monte_carlo.sensor_draws=6"]
    )
    counter = Counter()
    found = run_campaign(scenario, watcher=counter)
    raised = [failure for failure in found.failures if failure.estimator == "failing"]
    assert 0 < len(raised) < 6
    assert {failure.reason for failure in raised} == {"RuntimeError: the wheel came off"}
    assert "in estimate" in raised[0].trace
    rows = found.scores[found.scores["estimator"] == "failing"]
    lost = rows[rows["status"] == raised[0].reason]
    assert sorted(lost["cell"]) == [failure.cell for failure in raised] and lost["value"].isna().all()
    not_finite = [failure for failure in found.failures if failure.estimator == "nan"]
    assert len(not_finite) == 6 and "not finite" in not_finite[0].reason
    bad = found.scores.query("estimator == 'nan' and quantity == 'roll' and window == 'whole'")
    assert bad[bad["metric"] == "rms"]["value"].isna().all()
    good = found.scores.query(
        "estimator == 'after' and quantity == 'roll' and window == 'whole' and metric == 'rms'"
    )
    assert (good["status"] == OK).all() and set(good["cell"]) == set(range(6))
    assert counter.rides == ["1/1 out"]
    assert counter.last == (6, 6, 6)


def test_a_ride_that_fails_fails_its_cells_only(monkeypatch: pytest.MonkeyPatch) -> None:
    real = worker.simulate

    def derail(ride, *, progress=None, told=None, warn=True):  # type: ignore[no-untyped-def]
        if ride.profile.speed_mps > 10.0:
            raise RuntimeError("derailed: axle front left the rail at s = 100.0 m")
        return real(ride, progress=progress)

    monkeypatch.setattr(worker, "simulate", derail)
    found = run_campaign(short("ride.speed_kmh=[50.0, 30.0]", "monte_carlo.sensor_draws=1"))
    assert len(found.cells) == 2 and len(found.rides) == 1
    statuses = found.scores.groupby("cell")["status"].agg(lambda column: sorted(set(column.astype(str))))
    assert statuses[0] == ["RuntimeError: derailed: axle front left the rail at s = 100.0 m"]
    assert OK in statuses[1]
    assert len(found.failures) == 3
    assert found.examples[0].cell["speed_kmh"] == 30.0


@pytest.mark.parametrize("by_one", [True, False])
def test_no_cell_of_a_lost_worker_is_dropped(by_one: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers that die over cells 1 and 4, as on a cluster or in a pool: the rest have their scores."""
    killers, tried = {1, 4}, []

    class KilledWorker(Exception):
        """By the name of dask's."""

    class Mortal(executors._Here):
        def submit(self, function, packed, cells, *more):  # type: ignore[no-untyped-def]
            numbers = {cell.number for cell in cells}
            if function is not worker.run_batch or not numbers & killers:
                return super().submit(function, packed, cells, *more)
            tried.append(numbers)
            future: Future[object] = Future()
            future.set_exception(KilledWorker() if by_one else BrokenExecutor())
            return future

    settings = ["monte_carlo.sensor_draws=6", "ride.end_m=70.0", "score.windows=['whole']"]
    whole = run_campaign(short(*settings))
    monkeypatch.setattr(executors, "_Here", Mortal)
    found = run_campaign(short(*settings), workers=1, batch_cells=3)
    assert {failure.cell for failure in found.failures} == killers
    assert set(found.scores["cell"]) == set(range(6)) == set(found.cells["cell"])
    is_lost = found.scores["cell"].isin(killers)
    assert found.scores["value"][is_lost].isna().all() and (found.scores["status"][is_lost] != OK).all()
    good = whole.scores[~whole.scores["cell"].isin(killers)]
    pd.testing.assert_frame_equal(without_time(found.scores[~is_lost]), without_time(good), check_exact=True)
    counts = aggregate(found.scores, found.cells).query("estimator == 'ekf_compensated' and metric == 'rms'")
    assert set(counts["draws"]) == {4}
    assert tried[0] == {0, 1, 2} and {1} in tried and {4} in tried


def test_a_cell_does_not_fail_for_a_worker_that_died_once_while_it_was_run_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What kills for want of memory kills what is there: the batch twice, then one of its cells."""
    tried = []

    class Mortal(executors._Here):
        def submit(self, function, packed, cells, *more):  # type: ignore[no-untyped-def]
            if function is not worker.run_batch:
                return super().submit(function, packed, cells, *more)
            tried.append([cell.number for cell in cells])
            if len(tried) > 3:
                return super().submit(function, packed, cells, *more)
            future: Future[object] = Future()
            future.set_exception(BrokenExecutor())
            return future

    monkeypatch.setattr(executors, "_Here", Mortal)
    settings = ["monte_carlo.sensor_draws=2", "ride.end_m=70.0", "score.windows=['whole']"]
    found = run_campaign(short(*settings), workers=1, batch_cells=2)
    assert tried == [[0, 1], [0, 1], [0], [1], [0]]
    assert found.failures == []


def test_interrupt_ends_the_campaign_at_once_even_if_it_was_swallowed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []

    def swallow(ride, *, progress=None, told=None, warn=True):  # type: ignore[no-untyped-def]
        # What a C++ library does with an exception in its callback.
        calls.append(ride.name)
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise RuntimeError("the integrator stopped") from None

    monkeypatch.setattr(worker, "simulate", swallow)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run_campaign(short("monte_carlo.sensor_draws=1", "ride.speed_kmh=[30.0, 50.0]"))
    assert calls == ["out"]
    assert signal.getsignal(signal.SIGINT) is before


def test_examples_and_kept_windows() -> None:
    found = run_campaign(
        short(
            "monte_carlo.sensor_draws=2",
            "score.windows=['curve', 'curve:*']",
            "score.metrics=['rms', 'us_per_sample']",
        )
    )
    assert len(found.examples) == 1
    example = found.examples[0]
    assert list(example.estimates) == ["ekf_compensated", "ekf_uncompensated", "design_angles"]
    assert example.cell["sensor_draw"] == 0 and example.recording.imu.index.equals(example.motion.index)
    rms = found.scores[found.scores["metric"] == "rms"]
    assert {str(window) for window in rms["window"]} == {"curve", "curve:curve 3 R300"}
    assert set(found.scores["metric"].astype(str)) == {"rms", "us_per_sample"}


def test_figures_are_averaged_over_samples_and_their_values_are_kept() -> None:
    settings = ["monte_carlo.samples=3", "monte_carlo.sensor_draws=2", "score.windows=['whole']"]
    found = run_campaign(short("ride.speed_kmh={ uniform = [30.0, 50.0] }", *settings))
    assert not found.failures
    assert found.cells["ride.speed_kmh"].nunique() == 3 and set(found.cells["sample"]) == {0, 1, 2}
    table = aggregate(found.scores, found.cells)
    assert "ride.speed_kmh" not in table and "sample" not in table  # chance is no axis
    rows = found.scores.merge(found.cells[["cell", "sample"]], on="cell")
    which = {"estimator": "design_angles", "quantity": "roll", "metric": "rms"}
    for name, word in (which | {"reference": "truth"}).items():
        rows, table = rows[rows[name] == word], table[table[name] == word]
    assert len(rows) == 6 and len(table) == 1
    row = table.iloc[0]
    assert row["value"] == pytest.approx(rows["value"].mean())
    assert (
        row["sd_track"] == pytest.approx(rows.groupby("sample")["value"].mean().std()) and row["sd_track"] > 0
    )
    assert (row["track_draws"], row["draws"]) == (3, 6)


@pytest.mark.parametrize("first", [True, False])
def test_a_ride_is_told_by_whoever_simulated_it_and_failures_by_cell(first: bool, tmp_path: Path) -> None:
    """Of two batches of a ride one had it from the cache, whichever is the first; each has a failure."""
    settings = ["monte_carlo.sensor_draws=2", "ride.end_m=70.0", "score.windows=['whole']"]
    plan, kept, made = (
        judge_scenario(short(*settings)),
        Checkpoint(tmp_path / "a"),
        Checkpoint(tmp_path / "b"),
    )
    run_campaign(plan, workers=1, batch_cells=1, checkpoint=kept)
    for one, cached in zip(kept.results(), (first, not first), strict=True):
        failures = tuple(Failure(one.cells[0], name, "why", "where") for name in ("ekf", "gda"))
        made.add(replace(one, ride=one.ride | {"from_cache": cached}, failures=failures))
    found = gather(plan, worker.pack(plan.parts), made)
    assert [ride["from_cache"] for ride in found.rides] == [False]
    assert [failure.cell for failure in found.failures] == [0, 0, 1, 1]
