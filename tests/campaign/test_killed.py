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

from simrail.campaign.campaign import run_campaign
from simrail.campaign.checkpoint import Checkpoint
from simrail.cli.main import DONE, INTERRUPTED
from simrail.scenario.scenario import load_scenario

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


@pytest.mark.parametrize(("kills", "cells"), [(1, 12), pytest.param(50, 600, marks=pytest.mark.slow)])
def test_killed_and_gone_on_with_each_time_ends_with_the_same_bits(
    kills: int,
    cells: int,
    noting_file: Path,
    notes: Notes,
    tmp_path: Path,
    assert_same: Callable[[pd.DataFrame, pd.DataFrame], None],
) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    settings = ["--set", f"monte_carlo.sensor_draws={cells // 2}"]
    whole = run_campaign(load_scenario(noting_file, overrides=[settings[1]]))
    notes.file.unlink()
    words = [sys.executable, str(program), str(BATCH_CELLS), "run", str(noting_file), *settings]
    killed, kept = run_with_kills(
        kills, [*words, "--workers", str(WORKERS)], notes, tmp_path, cells=cells, seed=kills
    )
    # A quick machine may be done before the last of a few kills.
    assert killed == kills if cells > 100 else 0 < killed <= kills
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


def test_ctrl_c_ends_all_processes_in_one_line(noting_file: Path, notes: Notes, tmp_path: Path) -> None:
    """The terminal sends it to the main process and to its workers alike."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    slow = ["--set", "estimator.noting.options.sleep_s=0.5", "--workers", str(WORKERS)]
    words = [sys.executable, str(program), str(BATCH_CELLS), "run", str(noting_file), *slow]
    process = subprocess.Popen(
        words, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True
    )
    wait_while(lambda: process.poll() is None and len({pid for pid, _ in notes}) < WORKERS, at_most_s=120.0)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == INTERRUPTED
    assert said.decode().splitlines()[-1].startswith("simrail: interrupted") and b"Traceback" not in said
    wait_while(lambda: any(alive(pid) for pid, _ in notes), at_most_s=5.0)
    assert not any(alive(pid) for pid, _ in notes)
