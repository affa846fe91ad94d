"""A real dask scheduler and two workers on this machine: the same bits, also if one of them is killed."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Protocol

import pandas as pd
import pytest

import simrail
from simrail import results
from simrail.campaign.campaign import run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.executors import _Cluster
from simrail.campaign.sensitivity import FigureName, sensitivities, sensitivity_table
from simrail.cli.main import BAD_INPUT, CELL_FAILED, DONE, call
from simrail.core.errors import InputError
from simrail.scenario.scenario import load_scenario

pytest.importorskip("distributed")


class Notes(Protocol):
    """See conftest."""

    file: Path

    def __iter__(self) -> Iterator[tuple[int, str]]: ...

    def repeated(self, *, main: int) -> int: ...


class Cluster:
    """A scheduler and its workers, as processes of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.workers: list[subprocess.Popen[bytes]] = []
        log = folder / "scheduler.log"
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", log=log)
        for _ in range(600):
            found = re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text())
            if found:
                break
            time.sleep(0.05)
        assert found, log.read_text()
        self.address = found[0]

    def _start(self, kind: str, *words: str, log: Path, path: Path | None = None) -> subprocess.Popen[bytes]:
        environment = {**os.environ, **({"PYTHONPATH": str(path)} if path else {})}
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--no-dashboard", *words]
        return subprocess.Popen(command, cwd=self.folder, env=environment, stderr=log.open("wb"))

    def add_worker(self, path: Path | None = None) -> None:
        log = self.folder / f"worker{len(self.workers)}.log"
        arguments = (self.address, "--nthreads", "1", "--no-nanny")
        self.workers.append(self._start("worker", *arguments, log=log, path=path))

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    started = Cluster(tmp_path)
    yield started
    started.close()


@pytest.mark.slow
def test_a_campaign_on_a_cluster_with_a_worker_killed_midway(
    cluster: Cluster,
    noting_file: Path,
    notes: Notes,
    tmp_path: Path,
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    """The estimator comes from a file, which the workers get from the campaign."""
    cluster.add_worker()
    cluster.add_worker()
    scenario = load_scenario(noting_file, overrides=["monte_carlo.sensor_draws=6"])
    whole = run_campaign(scenario, workers=1)
    notes.file.unlink()

    def kill() -> None:
        pids = {worker.pid for worker in cluster.workers}
        while len(seen := {pid for pid, _ in notes} & pids) < 2:
            time.sleep(0.01)
        os.kill(min(seen), signal.SIGKILL)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    kept = Checkpoint(tmp_path / "kept")
    found = run_campaign(scenario, cluster=cluster.address, batch_cells=2, checkpoint=kept)
    thread.join(timeout=10)
    assert not thread.is_alive() and sum(worker.poll() is not None for worker in cluster.workers) == 1
    assert_same(whole.scores, found.scores)
    assert found.failures == []
    assert notes.repeated(main=os.getpid()) <= 2  # one batch of the worker that was killed


def test_a_worker_gets_no_batch_before_its_last_result_is_here() -> None:
    asked: list[tuple[str | None, Future[None]]] = []

    class Pool:
        def submit(self, *arguments: object, workers: str | None, allow_other_workers: bool) -> object:
            assert allow_other_workers == (workers is not None)  # where that worker dies, others may
            asked.append((workers, Future()))
            return asked[-1][1]

    class Client:
        def nthreads(self) -> dict[str, int]:
            return {"one": 1, "two": 1}

    executor = object.__new__(_Cluster)
    executor._client, executor._pool, executor._busy = Client(), Pool(), set()  # type: ignore[assignment]
    for done in (None, None, 1, None, 2, 0):
        if done is not None:
            asked[done][1].set_result(None)
        executor.submit(print)
    assert [workers for workers, _ in asked] == ["one", "two", "two", None, "two", "one"]


@pytest.mark.slow
def test_a_scheduler_that_dies_is_told_in_one_line_and_the_run_goes_on_without_it(
    cluster: Cluster,
    noting_file: Path,
    notes: Notes,
    here: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))
    monkeypatch.setattr("simrail.campaign.executors._WAIT_S", 5.0)
    cluster.add_worker()
    words = ["run", str(noting_file), "--set", "estimator.noting.options.sleep_s=0.3"]
    done: list[int] = []

    def kill() -> None:
        while not list((here / "results").glob(".mine.unfinished-*/*.parquet")):
            time.sleep(0.01)
        cluster.scheduler.kill()
        done.append(1)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    assert call([*words, "--cluster", cluster.address]) == CELL_FAILED
    assert done
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("simrail:")]
    assert len(said) == 1 and "the dask scheduler has gone" in said[0] and "goes on" in said[0]
    assert call([*words, "--resume"]) == DONE
    assert "of 8 cells are done" in capsys.readouterr().err


def test_a_cluster_that_cannot_be_used_is_refused_in_one_line(
    cluster: Cluster, noting_file: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("simrail.campaign.executors._WAIT_S", 2.0)
    scenario = load_scenario(noting_file)
    with pytest.raises(InputError, match=r"has no workers.*dask worker tcp://127"):
        run_campaign(scenario, cluster=cluster.address)
    other = cluster.folder / "other"
    for package in ("simrail", "estimators", "scenarios"):
        home = Path(simrail.__file__).resolve().parents[1]
        shutil.copytree(home / package, other / package, ignore=shutil.ignore_patterns("__pycache__"))
    with (other / "simrail" / "score.py").open("a") as source:
        source.write("\n# another version\n")
    cluster.add_worker(path=other)
    monkeypatch.setattr("simrail.campaign.executors._WAIT_S", 20.0)
    with pytest.raises(InputError, match=r"runs another simrail.*install the same"):
        run_campaign(scenario, cluster=cluster.address)
    cluster.close()
    monkeypatch.setattr("simrail.campaign.executors._WAIT_S", 2.0)
    with pytest.raises(InputError, match="no dask scheduler answers"):
        run_campaign(scenario, cluster=cluster.address)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "distributed", None)
        assert call(["run", str(noting_file), "--cluster", "tcp://127.0.0.1:1"]) == BAD_INPUT
    said = capsys.readouterr().err.splitlines()[-1]
    assert 'pip install -e ".[cluster]"' in said


@pytest.mark.slow
def test_a_sensitivity_on_a_cluster_has_the_bits_of_one_process(
    cluster: Cluster, rides: Path, assert_same: Callable[[pd.DataFrame, pd.DataFrame], None]
) -> None:
    cluster.add_worker()
    cluster.add_worker()
    few = ["monte_carlo.samples=2", "ride.end_m=80.0", "ride.rest_s=1.0"]
    scenario = load_scenario("sensitivity", overrides=few)
    alone = run_campaign(scenario, workers=1)
    found = run_campaign(scenario, cluster=cluster.address, batch_cells=3)
    assert_same(alone.scores, found.scores)
    tables = [
        sensitivity_table(sensitivities(scenario.spec, one.scores, one.cells, FigureName()))
        for one in (alone, found)
    ]
    pd.testing.assert_frame_equal(*tables, check_exact=True)
    assert len(tables[0])
