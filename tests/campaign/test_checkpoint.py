"""Batches on disk: whole or not there, damage told, one process at a time; and runs that go on from them."""

from __future__ import annotations

import errno
import gc
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pandas as pd
import pytest
from flaky import FLAKY

import simrail
from simrail import results
from simrail.campaign import checkpoint
from simrail.campaign.campaign import key_of, run_campaign
from simrail.campaign.cell import Failure
from simrail.campaign.checkpoint import Checkpoint, Start, checkpoint_of
from simrail.campaign.worker import BatchResult
from simrail.cli.main import BAD_INPUT, CELL_FAILED, DONE, call
from simrail.core import source_hash
from simrail.core.errors import InputError
from simrail.ride.ride import simulate
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario

Same = Callable[[pd.DataFrame, pd.DataFrame], None]


@pytest.fixture
def no_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Spare the figures of the report."""
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))


@pytest.fixture
def mine(noting_file: Path, here: Path, no_drawing: None) -> list[str]:
    """Words of a run: 2 rides of 4 cells, without sleep."""
    return ["run", str(noting_file), "--set", "estimator.noting.options.sleep_s=0.0"]


def hidden(folder: Path) -> list[Path]:
    return sorted((folder / "results").glob(".*"))


@pytest.mark.long
def test_batches_come_back_as_they_were(rides: Path, short: Callable[..., Scenario], tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    assert kept.is_empty and kept.cells() == set()
    run_campaign(short("monte_carlo.sensor_draws=3"), checkpoint=kept, batch_cells=2)
    first, second = kept.results()
    assert first.cells == (0, 1) and second.cells == (2,)
    assert set(first.scores["cell"]) == {0, 1}
    assert first.failures == () and first.ride["from_cache"] is False
    assert set(first.wall_s) == set(first.cpu_s) == {"simulate", "measure", "estimate", "score"}
    assert kept.cells() == {0, 1, 2} and kept.damaged == 0


@pytest.mark.long
def test_a_batch_that_cannot_be_written_leaves_nothing(
    rides: Path, short: Callable[..., Scenario], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = Checkpoint(tmp_path / "kept")
    run_campaign(short("monte_carlo.sensor_draws=1"), checkpoint=kept)
    (result,) = kept.results()
    other = Checkpoint(tmp_path / "other")

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        other.add(result)
    assert list(other.folder.iterdir()) == []


@pytest.mark.long
def test_damaged_batches_are_dropped_and_run_again(
    mine: list[str], here: Path, capsys: pytest.CaptureFixture[str], whole: pd.DataFrame, assert_same: Same
) -> None:
    """A bit that flipped, a half and an empty file are told in one line; a leftover draft is not."""
    plan = judge_scenario(load_scenario(mine[1], overrides=[mine[3]]))
    with checkpoint_of(here / "results" / "mine", key_of(plan)) as kept:
        run_campaign(plan, checkpoint=kept, batch_cells=1)
        files = sorted(kept.folder.glob("*.parquet"))
    content = bytearray(files[1].read_bytes())
    content[len(content) // 3] ^= 4
    files[1].write_bytes(content)
    files[3].write_bytes(files[3].read_bytes()[:1000])
    files[6].write_bytes(b"")
    (files[0].parent / f".{files[0].name}.draft").write_bytes(content[:1000])
    capsys.readouterr()
    assert call([*mine, "--resume"]) == DONE
    said = capsys.readouterr().err
    assert "3 damaged file" in said and "5 of 8 cells are done" in said
    assert_same(whole, pd.read_parquet(here / "results" / "mine" / "scores.parquet"))
    assert hidden(here) == []


@pytest.mark.long
def test_a_damaged_ride_and_one_that_is_gone_are_simulated_again(
    mine: list[str],
    here: Path,
    rides: Path,
    capsys: pytest.CaptureFixture[str],
    whole: pd.DataFrame,
    assert_same: Same,
) -> None:
    plan = judge_scenario(load_scenario(mine[1], overrides=[mine[3]]))
    for cell in (0, 4):
        simulate(plan.parts.ride(list(cells(plan.scenario))[cell]))
    damaged, gone = sorted(rides.iterdir())
    array = bytearray((damaged / "body_0.npy").read_bytes())
    array[len(array) // 2] ^= 1
    (damaged / "body_0.npy").write_bytes(array)
    shutil.rmtree(gone)
    capsys.readouterr()
    assert call(mine) == DONE
    said = [line for line in capsys.readouterr().err.splitlines() if "damaged" in line]
    assert len(said) == 1 and "simulated again" in said[0]
    assert_same(whole, pd.read_parquet(here / "results" / "mine" / "scores.parquet"))


@pytest.mark.long
def test_a_full_disk_ends_in_one_line_and_the_next_run_goes_on(
    mine: list[str],
    here: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real, calls = os.fsync, []

    def full(descriptor: int) -> None:
        calls.append(descriptor)
        if len(calls) == 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", full)
    assert call(mine) == CELL_FAILED
    said = capsys.readouterr().err.splitlines()
    assert said[-1].startswith("simrail: No space left on device") and "goes on" in said[-1]
    assert not any("Traceback" in line for line in said)
    (folder,) = hidden(here)
    assert len(list(folder.glob("*.parquet"))) == 2 and not (here / "results" / "mine").exists()
    assert call(mine) == DONE
    assert "going on with an unfinished run" in capsys.readouterr().err
    assert hidden(here) == []


@pytest.mark.long
def test_a_disk_that_is_really_full(
    noting_file: Path, tmp_path: Path, no_drawing: None, capsys: pytest.CaptureFixture[str], here: Path
) -> None:
    """A small file system of its own, for results and for rides in turn."""
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("file systems cannot be mounted here")
    words = ["run", str(noting_file), "--set", "estimator.noting.options.sleep_s=0.0"]
    try:
        filler = small / "filler"
        filler.write_bytes(b"0" * 700_000)
        assert call([*words, "--out", str(small / "results")]) == CELL_FAILED
        assert "No space left on device" in capsys.readouterr().err.splitlines()[-1]
        filler.unlink()
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("SIMRAIL_RIDES", str(small / "rides"))
            assert call([*words, "--out", "elsewhere"]) == CELL_FAILED
            assert "No space left on device" in capsys.readouterr().err.splitlines()[-1]
            assert list((small / "rides").iterdir()) == []
        assert call([*words, "--out", "elsewhere"]) == DONE
    finally:
        gc.collect()  # the traceback of the ride that failed holds its mapped arrays, in a cycle
        subprocess.run(["umount", str(small)], check=True)


@pytest.mark.long
def test_fresh_and_resume(mine: list[str], here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call([*mine, "--resume"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "there is no unfinished run of this plan" in said and "--resume" in said
    assert hidden(here) == [] and not (here / "results" / "mine").exists()
    assert call([*mine, "--resume", "--fresh"]) == BAD_INPUT
    capsys.readouterr()
    plan = judge_scenario(load_scenario(mine[1], overrides=[mine[3]]))
    with checkpoint_of(here / "results" / "mine", key_of(plan)) as kept:
        run_campaign(plan, checkpoint=kept, batch_cells=5)
    assert call([*mine, "--fresh"]) == DONE
    assert "unfinished" not in capsys.readouterr().err
    log = (here / "results" / "mine" / "run.log").read_text()
    assert "8 cells to run" in log and "going on" not in log


@pytest.mark.long
def test_another_plan_or_other_code_is_not_gone_on_with(
    mine: list[str], here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = key_of(judge_scenario(load_scenario(mine[1], overrides=[mine[3]])))
    assert key_of(judge_scenario(load_scenario(mine[1], overrides=[mine[3]]))) == key
    assert key_of(judge_scenario(load_scenario(mine[1], overrides=[mine[3]], seed=9))) != key
    own = Path(mine[1]).parent / "noting.py"
    own.write_text(own.read_text() + "\n# another version\n")
    with_other_file = key_of(judge_scenario(load_scenario(mine[1], overrides=[mine[3]])))
    assert with_other_file != key
    for what, other in (("score_code_hash", lambda: "other code"), ("version", lambda package: "another")):
        with monkeypatch.context() as patch:
            patch.setattr(f"simrail.campaign.campaign.{what}", other)
            plan = judge_scenario(load_scenario(mine[1], overrides=[mine[3]]))
            assert key_of(plan) not in (key, with_other_file)


@pytest.mark.long
def test_code_that_is_left_out_of_the_key_is_there_and_makes_no_score() -> None:
    """A batch imports none of it; a new command or page must not abandon a run that is under way."""
    left_out = source_hash.NO_MATTER
    assert {"cli/", "report/", "campaign/export.py"} <= set(left_out)
    package = Path(simrail.__file__).parent
    # A folder of scenarios stands beside the package in a checkout.
    assert all((package / name).exists() or (package.parent / name).exists() for name in left_out)
    program = "import sys, simrail.campaign.worker; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    own = {name.removeprefix("simrail.").replace(".", "/") + ".py" for name in loaded.stdout.split()}
    assert "campaign/cell.py" in own and not [name for name in own if name.startswith(left_out)]


def test_two_processes_do_not_run_one_plan_into_one_folder(tmp_path: Path) -> None:
    with checkpoint_of(tmp_path / "results", "key") as kept:
        kept.log("something")
        with (
            pytest.raises(InputError, match="being run by another process"),
            checkpoint_of(tmp_path / "results", "key"),
        ):
            pass
        with checkpoint_of(tmp_path / "results", "another"):
            pass
    assert list(tmp_path.iterdir()) == []


def test_a_process_that_is_refused_leaves_the_other_one_alone(tmp_path: Path) -> None:
    """Before the other has a batch, and while it writes one."""
    with checkpoint_of(tmp_path / "results", "key") as kept:
        draft = kept.folder / ".000000000-ab.parquet.1.draft"
        draft.touch()
        with pytest.raises(InputError), checkpoint_of(tmp_path / "results", "key", start="fresh"):
            pass
        assert draft.exists()
        kept.log("at work")


def test_a_lock_on_a_folder_that_has_gone_holds_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one that held it ended between our opening of the lock and our taking it: a third may be there."""
    fcntl = pytest.importorskip("fcntl")
    real = fcntl.flock

    def late(stream: object, how: int) -> None:
        shutil.rmtree(next(tmp_path.glob(".results.unfinished-*")))
        real(stream, how)

    monkeypatch.setattr(fcntl, "flock", late)
    with pytest.raises(InputError, match="another process"), checkpoint_of(tmp_path / "results", "key"):
        pytest.fail("it was let in")


@pytest.mark.parametrize("start", ["resume", "auto"])
def test_folders_that_nothing_came_into_go_again(tmp_path: Path, start: Start) -> None:
    with suppress(InputError), checkpoint_of(tmp_path / "a" / "b" / "results", "key", start=start):
        pass
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a").mkdir()
    with suppress(InputError), checkpoint_of(tmp_path / "a" / "results", "key", start=start):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_runs_that_nobody_goes_on_with_are_dropped_after_a_month(tmp_path: Path) -> None:
    old, young = (tmp_path / f".x.unfinished-{name}" for name in ("old", "young"))
    for folder, days in ((old, 31), (young, 29)):
        folder.mkdir()
        os.utime(folder, (time.time() - 86400.0 * days,) * 2)
    with checkpoint_of(tmp_path / "x", "key"):
        assert not old.exists() and young.exists()


@pytest.mark.long
def test_retry_failed_runs_exactly_the_failed_cells(
    mine: list[str], here: Path, capsys: pytest.CaptureFixture[str], whole: pd.DataFrame, assert_same: Same
) -> None:
    (Path(mine[1]).parent / "noting.py").write_text(FLAKY)
    assert call([*mine, "--retry-failed"]) == BAD_INPUT
    assert "there are no finished results" in capsys.readouterr().err
    (here / "broken").touch()
    assert call(mine) == CELL_FAILED
    folder = here / "results" / "mine"
    failed = {entry["cell"] for entry in json.loads((folder / "manifest.json").read_text())["failures"]}
    assert 0 < len(failed) < 8
    (here / "broken").unlink()
    capsys.readouterr()
    assert call([*mine, "--retry-failed"]) == DONE
    assert f"{8 - len(failed)} of 8 cells are done" in capsys.readouterr().err
    assert_same(whole, pd.read_parquet(folder / "scores.parquet"))
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["failed"] == 0 and len(manifest["rides"]) == 2
    assert not (folder / "failures.txt").exists() and hidden(here) == []
    assert call([*mine, "--retry-failed"]) == BAD_INPUT
    assert "nothing failed" in capsys.readouterr().err
    assert call([*mine, "--retry-failed", "--seed", "9"]) == BAD_INPUT
    assert "of another plan" in capsys.readouterr().err
    assert (folder / "report.html").exists() and hidden(here) == []


@pytest.mark.long
def test_a_cell_alone_is_printed_and_written(
    mine: list[str], here: Path, capsys: pytest.CaptureFixture[str], whole: pd.DataFrame
) -> None:
    assert call([*mine, "--cell", "5", "--out", "one"]) == DONE
    printed = capsys.readouterr().out
    value = whole.query(
        "cell == 5 and estimator == 'ekf' and quantity == 'roll' and reference == 'truth' "
        "and window == 'whole' and metric == 'rms'"
    )["value"].item()
    assert f"{value:.9g}" in printed and "cell 5" in printed
    alone = pd.read_parquet(here / "one" / "scores.parquet")
    ours = alone.query("metric != 'us_per_sample'")["value"].to_numpy()
    theirs = whole.query("cell == 5 and metric != 'us_per_sample'")["value"].to_numpy()
    assert ours.tobytes() == theirs.tobytes()
    assert json.loads((here / "one" / "manifest.json").read_text())["command"].endswith("--cell 5")
    assert call([*mine, "--cell", "8"]) == BAD_INPUT
    assert "0 to 7" in capsys.readouterr().err
    assert call([*mine, "--cell", "1", "--workers", "2"]) == BAD_INPUT


def test_the_hidden_name_is_what_keeps_a_half_batch_out(tmp_path: Path) -> None:
    """Every name that a batch is written under is one that is not read."""
    kept = Checkpoint(tmp_path / "kept")
    (kept.folder / ".000000000-abc.parquet.draft").write_bytes(b"half")
    assert kept.is_empty
    assert Checkpoint(tmp_path / "kept").is_empty and list(kept.folder.iterdir()) == []
    assert checkpoint.LOG == "run.log"


def made(*numbers: int) -> BatchResult:
    """A batch of cells, with a failure of the first."""
    return BatchResult(
        cells=numbers,
        ride_number=min(numbers) // 4,
        scores=pd.DataFrame({"cell": numbers, "value": [0.1 * n for n in numbers], "metric": "rms"}),
        failures=(Failure(numbers[0], "mine", "a reason", "a trace"),),
        ride={"from_cache": True, "wall_s": 1.5},
        wall_s={"simulate": 1.0},
        cpu_s={"simulate": 0.1 + 0.2},
        notes=("a note",),
        worker="here",
    )


def test_what_is_kept_comes_back_in_order_and_what_is_damaged_is_counted(tmp_path: Path) -> None:
    kept = Checkpoint(tmp_path / "kept")
    batches = [
        made(8, 9),
        made(0, 1),
        made(4, 5, 6),
        made(
            12,
        ),
    ]
    for batch in batches:
        kept.add(batch)
    back = list(kept.results())
    assert [batch.cells for batch in back] == [(0, 1), (4, 5, 6), (8, 9), (12,)]
    for batch, given in zip(back, sorted(batches, key=lambda one: one.cells), strict=True):
        pd.testing.assert_frame_equal(batch.scores, given.scores, check_exact=True)
        assert {**vars(batch), "scores": 0} == {**vars(given), "scores": 0}
    assert kept.cells() == {0, 1, 4, 5, 6, 8, 9, 12} and kept.damaged == 0
    files = sorted(kept.folder.glob("*.parquet"))
    for file in (files[0], files[2]):
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        file.write_bytes(content)
    again = Checkpoint(kept.folder)
    assert again.cells() == {4, 5, 6, 12} and again.damaged == 2
    assert sorted(kept.folder.glob("*.parquet")) == [files[1], files[3]]
    assert again.cells() == {4, 5, 6, 12} and again.damaged == 2
    again.clear()
    assert again.is_empty and again.cells() == set()
