"""A cache or a folder of results that cannot be used ends the run in one line; nothing former is lost."""

from __future__ import annotations

import errno
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest
from shortest_ride import DESIGN, SHORTEST_RIDE

from simrail import results
from simrail.campaign import time_limit
from simrail.cli.main import BAD_INPUT, CELL_FAILED, DONE, call
from simrail.core.errors import InputError
from simrail.ride import cache as ride_cache
from simrail.ride import ride as ride_module
from simrail.ride import truth_files

TEXT = SHORTEST_RIDE + DESIGN
ERRORS = [errno.EROFS, errno.EACCES, errno.ENOENT, errno.EIO, errno.EMFILE, errno.ENOSPC]


@pytest.fixture
def rides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path / "rides"))
    yield tmp_path / "rides"
    ride_cache.drop_spare()


@pytest.fixture
def mine(here: Path, rides: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Words of a run of one cell, without its figures."""
    monkeypatch.setattr(results, "write_report", lambda path, **keywords: path.write_text("<html></html>"))
    (here / "mine.toml").write_text(TEXT)
    return ["run", "mine.toml"]


def contents(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def raising(number: int) -> Callable[..., object]:
    def fail(*arguments: object, **keywords: object) -> object:
        raise OSError(number, os.strerror(number), "somewhere/file")

    return fail


@pytest.fixture
def former(here: Path) -> dict[str, bytes]:
    """Results that are there already."""
    folder = here / "results" / "mine"
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text("{}")
    (folder / "scores.csv").write_text("years of work")
    return contents(folder)


CASES = [
    *(("written", number) for number in ERRORS),
    ("looked for", errno.EACCES),
    ("read", errno.EIO),
    ("results", errno.ENOSPC),
]


@pytest.mark.parametrize(("where", "number"), CASES)
def test_storage_that_cannot_be_used_ends_the_run_and_keeps_former_results(
    number: int,
    where: str,
    mine: list[str],
    here: Path,
    former: dict[str, bytes],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if where == "written":
        monkeypatch.setattr(truth_files, "create_array", raising(number))
    elif where == "looked for":
        monkeypatch.setattr(ride_cache, "places_of", raising(number))
    elif where == "read":
        monkeypatch.setattr(ride_module, "load_truth", raising(number))
    else:
        monkeypatch.setattr(pd.DataFrame, "to_csv", raising(number))
    capsys.readouterr()
    assert call(mine) == CELL_FAILED
    said = capsys.readouterr().err.splitlines()
    assert [os.strerror(number) in line for line in said].count(True) == 1 and "file" in said[-1]
    assert not any("Traceback" in line for line in said)
    assert contents(here / "results" / "mine") == former
    unfinished = [path for path in (here / "results").iterdir() if path.name != "mine"]
    assert bool(unfinished) == (where == "results"), "what is done is kept beside"


def test_what_the_machine_lacks_is_no_failure_of_an_estimator(
    mine: list[str], here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(time_limit, "estimate_many", raising(errno.ENOSPC))
    assert call(mine) == CELL_FAILED
    assert "No space left" in capsys.readouterr().err.splitlines()[-1]
    assert not (here / "results").exists()
    monkeypatch.setattr(time_limit, "estimate_many", raising(errno.ENOENT))
    assert call(mine) == CELL_FAILED, "a file that an estimator did not find is its own failure"
    assert (here / "results" / "mine" / "failures.txt").exists()


def closed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing be made in a folder, also for root."""
    real = Path.mkdir

    def mkdir(path: Path, *arguments: object, **keywords: object) -> None:
        if path.is_relative_to(folder) and not path.exists():
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        real(path, *arguments, **keywords)  # type: ignore[arg-type]

    monkeypatch.setattr(Path, "mkdir", mkdir)
    real_os = os.mkdir

    def os_mkdir(path: object, *arguments: object, **keywords: object) -> None:
        if Path(str(path)).is_relative_to(folder):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        real_os(path, *arguments, **keywords)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "mkdir", os_mkdir)


def test_a_cache_that_cannot_be_written_is_read_and_else_gone_round(
    mine: list[str],
    here: Path,
    rides: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(mine) == DONE
    closed(rides, monkeypatch)
    capsys.readouterr()
    assert call(mine) == DONE
    assert "cannot be written" not in capsys.readouterr().err, "the ride is there"
    before = contents(rides)
    assert call([*mine, "--seed", "4"]) == DONE
    said = [line for line in capsys.readouterr().err.splitlines() if "cannot be written" in line]
    assert len(said) == 1 and str(rides) in said[0] and "simrail-rides-" in said[0]
    assert contents(rides) == before
    spare = Path(os.environ[ride_cache.SPARE])
    assert len(list(spare.iterdir())) == 1
    assert call([*mine, "--seed", "4"]) == DONE
    assert "cannot be written" not in capsys.readouterr().err, "it was found again"
    ride_cache.drop_spare()
    assert not spare.exists()


@pytest.mark.slow
def test_a_file_system_that_is_really_read_only(
    mine: list[str],
    here: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """With two workers, which share the temporary folder; and as the folder of results."""
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=30m,ro", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("file systems cannot be mounted here")
    try:
        monkeypatch.setenv("SIMRAIL_RIDES", str(small / "rides"))
        words = [*mine, "--set", "monte_carlo.track_draws=3", "--workers", "2"]
        assert call(words) == DONE
        said = capsys.readouterr().err
        assert said.count("cannot be written") == 1
        assert len(list(Path(os.environ[ride_cache.SPARE]).iterdir())) == 3, "each simulated once"
        assert call([*mine, "--out", str(small / "out")]) == BAD_INPUT
        assert "cannot be written" in capsys.readouterr().err
    finally:
        subprocess.run(["umount", str(small)], check=True)


def test_the_size_of_the_cache_is_a_number(
    mine: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SIMRAIL_CACHE_GB", "plenty")
    assert call(mine) == BAD_INPUT
    said = capsys.readouterr().err
    assert "SIMRAIL_CACHE_GB" in said and "'plenty'" in said and "Traceback" not in said


def test_a_lock_that_cannot_be_made_is_no_other_process(
    mine: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from filelock import FileLock

    monkeypatch.setattr(FileLock, "acquire", raising(errno.ENOSPC))
    assert call(mine) == CELL_FAILED
    said = capsys.readouterr().err
    assert "No space left" in said and "another process" not in said


def test_one_cell_is_counted_from_0_and_its_command_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first and the last of four cells run, none before or behind; nothing is drawn."""
    ran: list[int | None] = []
    said: list[str] = []

    def run_campaign(plan: object, *, only: int | None, watcher: object) -> str:
        ran.append(only)
        return "result"

    def write(_draft: Path, _read: object, _campaign: object, manifest: dict[str, str], **_: object) -> None:
        said.append(manifest["command"])

    monkeypatch.setattr(results, "run_campaign", run_campaign)
    monkeypatch.setattr(results, "describe", lambda read, campaign: {"command": "simrail run it"})
    monkeypatch.setattr(results, "_write", write)
    four = ["ride.speed_kmh=[30, 40]", "monte_carlo.sensor_draws=2", "imu.grade='tactical'"]
    plan = results.judge_scenario(results.load_scenario("quick_kinematic", overrides=four))
    monkeypatch.setattr(results, "judge_scenario", lambda read: plan)
    for cell in (0, 3):
        assert results.run_cell("quick_kinematic", cell, out=tmp_path / "out", overrides=four) == "result"
    assert ran == [0, 3] and said == ["simrail run it --cell 0", "simrail run it --cell 3"]
    for cell in (-1, 4):
        with pytest.raises(InputError, match="no such cell") as caught:
            results.run_cell("quick_kinematic", cell, overrides=four)
        assert (caught.value.field, caught.value.limit) == ("--cell", "0 to 3")
    assert ran == [0, 3]
