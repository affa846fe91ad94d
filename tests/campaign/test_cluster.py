"""A real dask scheduler and two workers on this machine: the same bits, also if one of them is killed."""

from __future__ import annotations

import ast
import logging
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
from typing import ClassVar, Protocol

import pandas as pd
import pytest
from threadpoolctl import threadpool_info

import simrail
from simrail import results
from simrail.campaign import executors
from simrail.campaign.campaign import run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.executors import _Cluster
from simrail.campaign.progress import Watcher
from simrail.campaign.sensitivity import FigureName, sensitivities, sensitivity_table
from simrail.cli.main import BAD_INPUT, CELL_FAILED, DONE, call
from simrail.core.errors import InputError
from simrail.core.machine import machine
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


HERE = {
    "kernels": "znver4",
    "instructions": "avx2 avx512f fma",
    "linear algebra": "SkylakeX",
    "Python": "3.11",
}


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({}, ""),
        (
            {"kernels": "haswell", "instructions": "avx2 fma", "linear algebra": "Haswell"},
            "kernels: znver4 here, haswell on two; linear algebra: SkylakeX here, Haswell on two",
        ),
        ({"instructions": "avx2 fma"}, "instructions: also avx512f here, no others on two"),
        ({"Python": "3.13"}, "Python: 3.11 here, 3.13 on two"),
    ],
)
def test_workers_of_other_instructions_are_told_in_one_line(
    other: dict[str, str], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers that are not there: what they answer is made up."""

    class Client:
        def nthreads(self) -> dict[str, int]:
            return {"one": 1, "two": 1}

        def run(self, function: Callable[[], object]) -> dict[str, object]:
            return {"one": function(), "two": HERE | other if function is executors.machine else function()}

    monkeypatch.setattr(executors, "machine", lambda: dict(HERE))
    executor = object.__new__(_Cluster)
    executor._client = Client()
    executor._judge_workers()
    line = f"warning: scores will agree to some 1e-9, not to the bit: workers differ in {words}"
    assert executor.notes == ((line,) if words else ())


def test_dask_says_nothing_by_any_of_its_loggers() -> None:
    """Some have a level of their own, as `distributed.client`, which told of a dead scheduler."""
    import distributed  # noqa: F401

    named = [logging.getLogger(name) for name in ("distributed", "distributed.client", "distributed.core")]
    logging.getLogger("distributed.client").setLevel(logging.WARNING)
    levels = executors._mute_dask()
    assert not any(logger.isEnabledFor(logging.CRITICAL) for logger in named)
    executors._unmute(levels)
    assert logging.getLogger("distributed.client").level == logging.WARNING


def test_a_campaign_tells_what_its_executor_notes(
    noting_file: Path, notes: Notes, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    class Listener(Watcher):
        lines: ClassVar[list[str]] = []

        def told(self, line: str) -> None:
            self.lines.append(line)

    monkeypatch.setattr(executors._Here, "notes", ("warning: workers differ",))
    scenario = load_scenario(noting_file, overrides=["estimator.noting.options.sleep_s=0.0"])
    run_campaign(scenario, only=0, workers=1, watcher=Listener())
    assert Listener.lines == ["warning: workers differ"]


@pytest.mark.long
def test_this_machine_is_what_the_kernels_are_compiled_for() -> None:
    """In a process of its own, as numba and OpenBLAS read these once."""
    code = "from simrail.core.machine import machine; print(machine())"
    asked = {"NUMBA_CPU_NAME": "generic", "OPENBLAS_CORETYPE": "Prescott"}
    said = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True, check=True
    )
    found = ast.literal_eval(said.stdout)
    assert found["kernels"] == "generic" and found["instructions"] == ""
    mine = machine()
    assert found["Python"] == mine["Python"]
    if "openblas" in str(threadpool_info()):  # it calls the set of Prescott by the first that has it
        assert found["linear algebra"] and found["linear algebra"] != mine["linear algebra"]


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
    err = capsys.readouterr().err
    assert "Traceback" not in err
    said = [line for line in err.splitlines() if line.startswith("simrail:")]
    assert len(said) == 1 and "the dask scheduler has gone" in said[0] and "goes on" in said[0]
    assert call([*words, "--resume"]) == DONE
    assert "of 8 cells are done" in capsys.readouterr().err


@pytest.mark.long
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


class _KillsAndEnds(Watcher):
    """Kills a worker when the first batch is done, and ends the campaign a few batches later."""

    def __init__(self, cluster: Cluster) -> None:
        self.cluster, self.batches = cluster, 0

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        self.batches += 1
        if self.batches == 1:
            self.cluster.workers[0].kill()
        if self.batches == 4:
            raise KeyboardInterrupt


@pytest.mark.slow
def test_a_sensitivity_on_a_cluster_killed_and_resumed_has_the_bits_of_one_process(
    cluster: Cluster, rides: Path, tmp_path: Path, assert_same: Callable[[pd.DataFrame, pd.DataFrame], None]
) -> None:
    cluster.add_worker()
    cluster.add_worker()
    few = ["monte_carlo.samples=2", "ride.end_m=80.0", "ride.rest_s=1.0"]
    scenario = load_scenario("sensitivity", overrides=few)
    alone = run_campaign(scenario, workers=1)
    kept = Checkpoint(tmp_path / "kept")
    with pytest.raises(KeyboardInterrupt):
        run_campaign(
            scenario,
            cluster=cluster.address,
            batch_cells=3,
            checkpoint=kept,
            watcher=_KillsAndEnds(cluster),
        )
    assert cluster.workers[0].poll() is not None
    kept = Checkpoint(tmp_path / "kept")  # as the next start finds it
    done = kept.cells()
    assert 0 < len(done) < len(alone.cells)
    found = run_campaign(scenario, cluster=cluster.address, batch_cells=3, checkpoint=kept)
    assert found.failures == [] and len(found.cells) == len(alone.cells)
    assert_same(alone.scores, found.scores)
    tables = [
        sensitivity_table(sensitivities(scenario.spec, one.scores, one.cells, FigureName()))
        for one in (alone, found)
    ]
    pd.testing.assert_frame_equal(*tables, check_exact=True)
    assert len(tables[0])
