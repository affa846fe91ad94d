"""Who runs a campaign, in which batches and order, changes no bit; a worker that dies loses nothing."""

from __future__ import annotations

import os
import random
import signal
import struct
import sys
import threading
import time
import warnings
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd
import pytest

from simrail.campaign import campaign, executors
from simrail.campaign.campaign import run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.executors import FEW_CELLS, executor_of
from simrail.campaign.result import CampaignResult, gather
from simrail.campaign.worker import pack
from simrail.core.errors import InputError
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scoring.table import OK

pytestmark = pytest.mark.long

AXES = ["ride.speed_kmh=[30.0, 50.0]", "monte_carlo.track_draws=2", "monte_carlo.sensor_draws=3"]


class Notes(Protocol):
    """See conftest."""

    file: Path

    def __iter__(self) -> Iterator[tuple[int, str]]: ...

    def repeated(self, *, main: int) -> int: ...


Same = Callable[[pd.DataFrame, pd.DataFrame], None]


@pytest.fixture(scope="module")
def alone(module_rides: None, short: Callable[..., Scenario]) -> CampaignResult:
    """A campaign of 4 rides and 12 cells, run in this process in batches of one."""
    return run_campaign(short(*AXES), workers=1, batch_cells=1)


@pytest.mark.parametrize(("workers", "batch_cells"), [(1, 3), pytest.param(4, None, marks=pytest.mark.slow)])
def test_workers_and_batches_change_no_bit(
    workers: int,
    batch_cells: int | None,
    alone: CampaignResult,
    short: Callable[..., Scenario],
    assert_same: Same,
) -> None:
    found = run_campaign(short(*AXES), workers=workers, batch_cells=batch_cells)
    assert_same_result(alone, found, assert_same)


def assert_same_result(alone: CampaignResult, found: CampaignResult, assert_same: Same) -> None:
    assert_same(alone.scores, found.scores)
    pd.testing.assert_frame_equal(alone.cells, found.cells)
    assert found.failures == [] and len(found.rides) == 4
    ours, theirs = alone.examples[0], found.examples[0]
    pd.testing.assert_frame_equal(ours.recording.imu, theirs.recording.imu, check_exact=True)


def test_order_of_rides_changes_no_bit(
    alone: CampaignResult,
    short: Callable[..., Scenario],
    assert_same: Same,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real = campaign.chosen_cells

    def shuffled(*arguments, **keywords):  # type: ignore[no-untyped-def]
        listed = list(real(*arguments, **keywords))
        random.Random(1).shuffle(listed)
        return sorted(listed, key=lambda cell: -cell.ride_number)

    monkeypatch.setattr(campaign, "chosen_cells", shuffled)
    assert_same(alone.scores, run_campaign(short(*AXES), batch_cells=2).scores)


def test_one_cell_alone_has_the_bits_that_it_has_among_others(
    alone: CampaignResult, short: Callable[..., Scenario], assert_same: Same
) -> None:
    found = run_campaign(short(*AXES), only=7)
    rows = alone.scores[alone.scores["cell"] == 7].reset_index(drop=True)
    for name in rows.columns:  # one cell has not the words of them all
        if rows[name].dtype == "category":
            rows[name] = rows[name].astype(str)
            found.scores[name] = found.scores[name].astype(str)
    assert_same(rows, found.scores)
    assert list(found.cells["cell"]) == [7]


def test_two_workers_simulate_each_ride_once_and_change_no_bit(
    alone: CampaignResult, rides: Path, short: Callable[..., Scenario], assert_same: Same
) -> None:
    found = run_campaign(short(*AXES), workers=2, batch_cells=2)
    assert_same_result(alone, found, assert_same)
    assert [ride["from_cache"] for ride in found.rides] == [False] * 4
    assert len(list(rides.glob("[!.]*"))) == 4


def test_a_result_that_was_taken_is_let_go_before_more_is_asked_for(
    short: Callable[..., Scenario], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cluster computes again what is held and whose worker died."""
    submit, handed_out, held = executors._Here.submit, [], []

    def noting(self: executors._Here, *arguments: Any) -> Any:
        held.append(sum(reference() is not None for reference in handed_out))
        future = submit(self, *arguments)
        handed_out.append(weakref.ref(future))
        return future

    monkeypatch.setattr(executors._Here, "submit", noting)
    run_campaign(short(*AXES[:2]), workers=1, batch_cells=1)
    assert len(held) > 3 and not any(held)


@pytest.mark.slow
@pytest.mark.parametrize("kills", [1, 2])
def test_killed_workers_lose_nothing(
    kills: int, noting_file: Path, notes: Notes, tmp_path: Path, assert_same: Same
) -> None:
    scenario = load_scenario(noting_file, overrides=[f"monte_carlo.sensor_draws={4 + 4 * kills}"])
    whole = run_campaign(scenario, workers=1)
    assert notes.repeated(main=0) == 2  # the examples
    notes.file.unlink()
    killed: list[int] = []
    finished = threading.Event()

    def kill() -> None:
        chance = random.Random(2)
        while len(killed) < kills and not finished.is_set():
            time.sleep(chance.uniform(0.1, 0.6))
            for pid, _ in list(notes)[-1:]:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                    killed.append(pid)

    thread = threading.Thread(target=kill)
    thread.start()
    kept = Checkpoint(tmp_path / "kept")
    try:
        found = run_campaign(scenario, workers=2, batch_cells=2, checkpoint=kept)
    finally:
        finished.set()
        thread.join()
    assert len(killed) == kills
    assert_same(whole.scores, found.scores)
    assert found.failures == []
    assert "a worker died" in (kept.folder / "run.log").read_text()
    # One batch of each of the two workers, for each kill.
    assert notes.repeated(main=os.getpid()) <= kills * 2 * 2


KILLER = """
import os
import signal
import struct
import sys
from dataclasses import dataclass

from simrail.estimators.baselines import DesignAngles


@dataclass(frozen=True)
class Noting:
    "Kills its process on some recordings, as a fault in a library would."
    causal = True

    def estimate(self, recording):
        if len(recording.imu) > 64 and recording.imu_sheet.grade == "ideal":
            os.kill(os.getpid(), signal.SIGKILL)
        return DesignAngles().estimate(recording)
"""


@pytest.mark.parametrize(
    ("processes", "grades", "draws"),
    [
        (1, ["lord_3dm_gx4_25", "ideal"], 1),
        pytest.param(2, ["ideal", "lord_3dm_gx4_25"], 3, marks=pytest.mark.slow),
        # The last suspect alone too, though nothing else is suspected beside it.
        pytest.param(2, ["lord_3dm_gx4_25", "ideal"], 3, marks=pytest.mark.slow),
    ],
)
def test_a_cell_that_kills_its_worker_fails_and_its_fellows_do_not(
    processes: int,
    grades: list[str],
    draws: int,
    tmp_path: Path,
    noting_file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each try costs new processes: two tries are enough to see it, and one process at a time."""
    (tmp_path / "noting.py").write_text(KILLER)
    monkeypatch.setattr(campaign, "_MOST_TRIES", 2)
    monkeypatch.setattr(executors, "_Here", lambda: executors._Processes(processes))
    settings = ["ride.speed_kmh=50", f"monte_carlo.sensor_draws={draws}"]
    settings += [f"imu.grade={grades}"]
    found = run_campaign(load_scenario(noting_file, overrides=settings), workers=1, batch_cells=2)
    failed = {failure.cell for failure in found.failures}
    assert failed == set(found.cells.loc[found.cells["imu.grade"] == "ideal", "cell"])
    assert len(failed) == draws and len(found.cells) == 2 * draws
    assert all("the worker died" in failure.reason for failure in found.failures)
    rms = found.scores.query(
        "estimator == 'noting' and metric == 'rms' and window == 'whole' and status == 'ok'"
    )
    assert set(rms["cell"]) == set(found.cells["cell"]) - failed
    lost = found.scores[found.scores["cell"].isin(failed)]
    assert (lost["status"] != OK).all() and np.isnan(lost["value"]).all()
    assert len(lost) == 2 * len(failed)  # a row for each of the two estimators


def test_few_cells_stay_in_this_process_and_one_executor_is_chosen() -> None:
    with executor_of(None, None, cells=FEW_CELLS) as executor:
        assert executor.here and executor.workers() == 1
    with executor_of(8, None, cells=1) as executor:
        assert executor.here
    with pytest.raises(InputError, match="has its own workers"), executor_of(2, "tcp://127.0.0.1:1", cells=9):
        pass


def test_estimators_that_cannot_be_sent_are_refused_by_name(tmp_path: Path, noting_file: Path) -> None:
    (tmp_path / "noting.py").write_text(
        "from dataclasses import dataclass, field\nimport threading\n\n\n"
        "@dataclass(frozen=True)\nclass Noting:\n"
        "    lock: object = field(default_factory=threading.Lock)\n    causal = True\n\n"
        "    def estimate(self, recording):\n        raise ValueError\n"
    )
    with pytest.raises(InputError, match="'noting'"):
        run_campaign(load_scenario(noting_file))


def test_a_result_is_the_same_from_kept_batches_alone(
    alone: CampaignResult, rides: Path, short: Callable[..., Scenario], tmp_path: Path, assert_same: Same
) -> None:
    plan, kept = judge_scenario(short(*AXES)), Checkpoint(tmp_path / "kept")
    run_campaign(plan, checkpoint=kept, batch_cells=5)
    assert_same(alone.scores, gather(plan, pack(plan.parts), kept).scores)


def test_a_worker_that_is_replaced_is_no_news() -> None:
    """loky tells of it in a warning, with a path and advice that do not concern the user."""
    with warnings.catch_warnings(record=True) as shown:
        warnings.simplefilter("always")
        with executor_of(2, None, cells=9):
            for words in ("A worker stopped while some jobs were given to the executor.", "something else"):
                warnings.warn(words, UserWarning, stacklevel=1)
    assert [str(warning.message) for warning in shown] == ["something else"]


def half_a_result() -> None:
    """What a worker does that is killed as it hands in a result."""
    frame = sys._getframe()
    while frame.f_back is not None and "result_queue" not in frame.f_locals:
        frame = frame.f_back
    os.write(frame.f_locals["result_queue"]._writer.fileno(), struct.pack("!i", 1000) + b"half")
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_pool_that_waits_for_a_dead_worker_is_broken_and_renewed() -> None:
    with executor_of(2, None, cells=FEW_CELLS + 1) as executor:
        assert executor.submit(os.getpid).result()
        killed, other = executor.submit(half_a_result), executor.submit(time.sleep, 0.0)
        while not killed.done():
            executor.look_after()
            time.sleep(0.1)
        assert executors.broken(killed.exception())
        assert other.done()
        executor.renew()
        executor.look_after()
        assert executor.submit(os.getpid).result()


def test_work_that_is_not_begun_is_dropped_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    """More than workers and their queue hold; the pool's own thread must not fall over what is left."""
    fallen: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", fallen.append)
    with executor_of(2, None, cells=FEW_CELLS + 1) as executor:
        assert executor.submit(os.getpid).result()
        handed_in = [executor.submit(time.sleep, 60.0) for _ in range(20)]
    assert not fallen
    assert all(future.done() for future in handed_in)
