"""A run that is killed with SIGKILL, again and again, ends with the bits of one that was not."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import pandas as pd
import pytest

from simrail import results
from simrail.campaign.campaign import run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.executors import _begin_worker
from simrail.cli.main import DONE, INTERRUPTED, call
from simrail.scenario.scenario import load_scenario

pytestmark = pytest.mark.long

WORKERS, BATCH_CELLS = 2, 2

PROGRAM = """
import sys
from simrail import results
from simrail.campaign import campaign

# The figures of the report take longer than the campaign.
results.write_report = lambda path, **keywords: path.write_text("<html></html>")
campaign._MOST_CELLS = int(sys.argv[1])
if __name__ == "__main__":
    from simrail.cli.main import call
    sys.exit(call(sys.argv[2:]))
"""


class Notes(Protocol):
    """See conftest."""

    file: Path

    def __iter__(self) -> Iterator[tuple[int, str]]: ...


def alive(pid: int) -> bool:
    try:
        status = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return status != "Z"


def run_with_kills(
    kills: int, words: list[str], notes: Notes, folder: Path, *, cells: int, seed: int
) -> tuple[int, int]:
    """Run until it ends by itself, killing the main process or a worker so many times at random moments.

    Returns how many were killed, and how many cells the last session found done.
    Asserts after each session that no more than one batch of each worker was lost per kill.
    """
    chance = random.Random(seed)
    done = before = 0
    while True:
        seen = len(list(notes))
        process = subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
        in_session = 0
        while done < kills and process.poll() is None:
            # Some die at any moment from the start on, most once cells are being run.
            if chance.random() < 0.3:
                wait_while(lambda: process.poll() is None, at_most_s=chance.uniform(0.0, 8.0))  # noqa: B023
            else:
                now = len(list(notes))
                wait_while(lambda: process.poll() is None and len(list(notes)) == now, at_most_s=60.0)  # noqa: B023
                time.sleep(chance.uniform(0.0, 0.4))
            workers = {pid for pid, _ in list(notes)[seen:] if pid != process.pid and alive(pid)}
            if process.poll() is not None:
                break
            # One worker in a session: a batch whose worker dies again and again is given up, and rightly so.
            is_main = not workers or in_session > 0 or chance.random() < 0.6
            victim = process.pid if is_main else chance.choice(sorted(workers))
            with suppress(ProcessLookupError):
                os.kill(victim, signal.SIGKILL)
                done += 1
                in_session += 1
            if is_main:
                break
        _, said = process.communicate(timeout=300)
        started = {pid for pid, _ in list(notes)[seen:]}
        wait_while(lambda: any(map(alive, started)), at_most_s=10.0)  # noqa: B023
        assert not any(map(alive, started)), "a worker outlives the main process"
        asked = sum(pid != process.pid for pid, _ in list(notes)[seen:])
        if process.returncode == DONE:
            assert asked - (cells - before) <= in_session * WORKERS * BATCH_CELLS
            return done, before
        assert process.returncode == -signal.SIGKILL, said.decode()
        folders = list((folder / "results").glob(".mine.unfinished-*"))
        # Killed as it ended, it has left whole results; the next session then begins anew.
        whole = not folders and (folder / "results" / "mine" / "scores.parquet").exists()
        kept = cells if whole else len(Checkpoint(folders[0]).cells()) if folders else 0
        assert asked - (kept - before) <= in_session * WORKERS * BATCH_CELLS
        before = 0 if whole else kept


def wait_while(condition: Callable[[], bool], *, at_most_s: float) -> None:
    end = time.monotonic() + at_most_s
    while time.monotonic() < end and condition():
        time.sleep(0.01)


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_ended_midway_no_process_outlives_it_and_gone_on_with_it_ends_with_the_same_bits(
    number: signal.Signals,
    noting_file: Path,
    notes: Notes,
    tmp_path: Path,
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ctrl-C, which the terminal sends to the main process and to its workers alike; or a kill of the first.

    Once a batch is kept and both workers have begun; this process, not a third one, does the rest.
    """
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    whole = run_campaign(load_scenario(noting_file))
    notes.file.unlink()
    run = ["run", str(noting_file), "--set", "estimator.noting.options.sleep_s=0.5", "--workers"]
    words = [sys.executable, str(program), str(BATCH_CELLS), *run, str(WORKERS)]
    process = subprocess.Popen(
        words, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True
    )
    folder = tmp_path / "results"

    def begun() -> bool:
        at_work = {pid for pid, _ in notes if pid != process.pid}
        return len(at_work) == WORKERS and any(folder.glob(".mine.unfinished-*/[!.]*.parquet"))

    wait_while(lambda: process.poll() is None and not begun(), at_most_s=120.0)
    assert process.poll() is None
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    _, said = process.communicate(timeout=60)
    if number == signal.SIGINT:
        assert process.returncode == INTERRUPTED
        assert said.decode().splitlines()[-1].startswith("simrail: interrupted") and b"Traceback" not in said
    wait_while(lambda: any(alive(pid) for pid, _ in notes), at_most_s=10.0)
    assert not any(alive(pid) for pid, _ in notes), "a worker outlives the main process"
    asked = sum(pid != process.pid for pid, _ in notes)
    (unfinished,) = folder.glob(".mine.unfinished-*")
    kept = len(Checkpoint(unfinished).cells())
    assert 0 < kept < len(whole.cells) and asked - kept <= WORKERS * BATCH_CELLS
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))
    assert call([*run, "1"]) == DONE
    assert_same(whole.scores, pd.read_parquet(folder / "mine" / "scores.parquet"))
    assert [path.name for path in folder.iterdir()] == ["mine"]
    assert "going on with an unfinished run" in (folder / "mine" / "run.log").read_text()
    # What was kept is not run again; an example of each of the two rides is.
    assert sum(pid == os.getpid() for pid, _ in notes) == len(whole.cells) - kept + 2


@pytest.mark.slow
def test_killed_and_gone_on_with_each_time_ends_with_the_same_bits(
    noting_file: Path,
    notes: Notes,
    tmp_path: Path,
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    """Fifty times, main processes and workers."""
    kills, cells = 50, 600
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    settings = ["--set", f"monte_carlo.sensor_draws={cells // 2}"]
    whole = run_campaign(load_scenario(noting_file, overrides=[settings[1]]))
    notes.file.unlink()
    words = [sys.executable, str(program), str(BATCH_CELLS), "run", str(noting_file), *settings]
    killed, kept = run_with_kills(
        kills, [*words, "--workers", str(WORKERS)], notes, tmp_path, cells=cells, seed=kills
    )
    assert killed == kills
    folder = tmp_path / "results"
    assert_same(whole.scores, pd.read_parquet(folder / "mine" / "scores.parquet"))
    assert [path.name for path in folder.iterdir()] == ["mine"]
    log = (folder / "mine" / "run.log").read_text()
    # Where no main process died after a batch was done, there was nothing to go on with.
    assert ("going on with an unfinished run" in log) == (kept > 0)


@pytest.mark.slow
def test_killed_with_a_stop_rule_it_stops_where_it_would_have(
    noting_file: Path,
    notes: Notes,
    tmp_path: Path,
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    """The main process is killed after 6 and after 20 estimates, repeated ones among them."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    plain = ["monte_carlo.sensor_draws=40", "estimator.noting.options.sleep_s=0.1"]
    figure = 'estimator="ekf", quantity="roll", metric="rms", least_draws=8'
    # A little less than the width after 8 draws: a later look reaches it, before all 40.
    first = run_campaign(load_scenario(noting_file, overrides=[*plain, f"stop={{{figure}, width=9.0}}"]))
    assert first.stopped is not None and first.stopped.draws == 8 and first.stopped.width is not None
    settings = [*plain, f"stop={{{figure}, width={0.999 * first.stopped.width!r}}}"]
    whole = run_campaign(load_scenario(noting_file, overrides=settings))
    assert whole.stopped is not None and whole.stopped.reached and 8 < whole.stopped.draws < 40
    notes.file.unlink()
    options = [word for setting in settings for word in ("--set", setting)]
    words = [sys.executable, str(program), str(BATCH_CELLS), "run", str(noting_file), *options]
    for cells in (6, 20):
        process = subprocess.Popen([*words, "--workers", str(WORKERS)], cwd=tmp_path)
        wait_while(lambda: process.poll() is None and len(list(notes)) < cells, at_most_s=120.0)  # noqa: B023
        assert process.poll() is None
        process.kill()
        process.wait()
    process = subprocess.run([*words, "--workers", "1"], cwd=tmp_path, timeout=300, check=False)
    assert process.returncode == DONE
    folder = tmp_path / "results" / "mine"
    assert_same(whole.scores, pd.read_parquet(folder / "scores.parquet"))
    assert "going on with an unfinished run" in (folder / "run.log").read_text()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs a process that outlives another")
def test_a_worker_whose_parent_is_gone_ends_itself() -> None:
    """A kill tells nobody: a worker looks who its parent is. The kill of a whole run is slow."""
    mine, theirs = os.pipe()
    parent = os.fork()
    if parent == 0:
        if os.fork() == 0:
            _begin_worker(os.getppid())
            os.write(theirs, str(os.getpid()).encode())
            time.sleep(60.0)
        else:
            time.sleep(60.0)
        os._exit(0)
    worker = int(os.read(mine, 20))
    assert alive(parent) and alive(worker)
    os.kill(parent, signal.SIGKILL)
    os.waitpid(parent, 0)
    wait_while(lambda: alive(worker), at_most_s=10.0)
    assert not alive(worker)
