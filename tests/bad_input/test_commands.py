"""Faulty settings, arguments and files of the command line: one message, code 2, nothing changed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, call
from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("ride.speed_kmh", ["--set", "key=value", "e.g."]),
        ("=3", ["--set", "key=value"]),
        ("ride[3].speed_kmh=20", ["ride[3].speed_kmh", "no such item", "0 to 0"]),
        ("ride.speed_kmph=20", ["ride[0].speed_kmph", "unknown key", "speed_kmh?"]),
        ("rid.speed_kmh=20", ["rid.speed_kmh", "did you mean ride?"]),
        ("ride=3", ["ride", "array of tables"]),
        ("ride[0]=3", ["ride[0]", "whole table"]),
        ("title.name=3", ["title.name", "no table"]),
        ("wheel[0].x=3", ["wheel[0].x", "no such array"]),
        ("ride..speed_kmh=3", ["dotted path"]),
        ("ride.speed_kmh=fast", ["ride[0].speed_kmh", "'fast'", "a number"]),
        ("imu.axle.grade=best", ["imu[0].grade", "'best'", "ideal"]),
    ],
)
def test_bad_setting(
    setting: str, parts: list[str], place: Path, message_of: Callable[[list[str]], str]
) -> None:
    (place / "mine.toml").write_text(GOOD)
    text = message_of(["check", "mine.toml", "--set", setting])
    for part in parts:
        assert part in text, text


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["run", "nowhere"], "no scenario of this name"),
        (["run", "nowhere.toml"], "no such file"),
        (["run", "go20"], "go20a"),
        (["run", "results"], "no scenario of this name"),
        (["run", "./results"], "no such file"),
        (["run", "mine.toml", "--out", "mine.toml"], "this is a file"),
        (["run", "mine.toml", "--out", "full"], "holds other things"),
        (["run", "mine.toml", "--out", "mine.toml/below"], "cannot be written"),
        (["new", "estimator", "my filter"], "no name for a file"),
        (["new", "estimator", "mine", "--in", "nowhere"], "no such folder"),
        (["new", "locomotive", "mine"], "no template of this kind"),
    ],
)
def test_bad_argument(
    arguments: list[str], part: str, place: Path, message_of: Callable[[list[str]], str]
) -> None:
    (place / "mine.toml").write_text(GOOD)
    (place / "full").mkdir()
    (place / "full" / "thesis.tex").write_text("years of work")
    assert part in message_of(arguments)
    assert (place / "full" / "thesis.tex").read_text() == "years of work"


@pytest.mark.parametrize("content", [b"title = \xff\xfe", b"\x00" * 64])
def test_not_text(content: bytes, place: Path, message_of: Callable[[list[str]], str]) -> None:
    (place / "mine.toml").write_bytes(content)
    assert "mine.toml" in message_of(["check", "mine.toml"])


def test_usage_errors_are_bad_input_too(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (
        ["rum"],
        ["run"],
        ["run", "x", "--seed", "one"],
        ["run", "x", "--seed", "-1"],
        ["--wrong"],
    ):
        assert call(arguments) == BAD_INPUT
        assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (
            ["run", "x", "--seed", "-1"],
            "--seed: takes no such value; found '-1'; limit: ",
        ),
        (
            ["run", "x", "--seed=2", "--seed=one"],
            "--seed: takes no such value; found 'one'; limit: ",
        ),
        (
            ["vehicle", "x", "--to", "5000"],
            "--to: takes no such value; found '5000'; limit: ",
        ),
        (["vehicle", "x", "--to"], "'--to' requires an argument"),
        (["list", "nothing"], "found 'nothing'"),
        (["figure", "results", "--out", "a.pdf"], "--out: is for one figure, and none is named"),
        (["new", "estimator", "class"], "is no name for a file; found 'class'"),
        (["estimate", "nowhere.toml"], "no such file; found 'nowhere.toml'"),
    ],
)
def test_a_value_that_is_refused_is_named(
    arguments: list[str], found: str, place: Path, message_of: Callable[[list[str]], str]
) -> None:
    message = message_of(arguments)
    assert found in message and "limit: " in message and "remedy: " in message


def test_own_estimator_that_cannot_be_imported(place: Path, message_of: Callable[[list[str]], str]) -> None:
    (place / "mine.toml").write_text(GOOD.replace('"DesignAngles"', '"mine.py:Mine"'))
    (place / "mine.py").write_text("import no_such_package\n")
    assert "cannot be imported: ModuleNotFoundError" in message_of(["run", "mine.toml"])
    (place / "mine.py").write_text("class Other:\n    pass\n")
    assert "no such estimator class; found 'Mine'" in message_of(["run", "mine.toml"])


@pytest.mark.long
def test_as_a_process(place: Path) -> None:
    (place / "mine.toml").write_text(GOOD.replace("speed_kmh = 50.0", "speed_kmh = -50.0"))
    done = subprocess.run(
        [sys.executable, "-m", "simrail", "run", "mine.toml"], capture_output=True, text=True, cwd=place
    )
    assert done.returncode == BAD_INPUT
    assert done.stdout == "" and done.stderr.count("\n") == 1
    assert "ride[0].speed_kmh" in done.stderr
