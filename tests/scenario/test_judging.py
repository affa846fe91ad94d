"""Judging a large scenario says how far it is; what no disk holds is refused at once."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from simrail.campaign import progress
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.errors import InputError
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario

TUNE = ["tune", "quick_kinematic", "--estimator", "x", "--method"]
CHECK = ["check", "quick_kinematic", "--set"]
LONG = "x" * 300


def test_it_is_told_after_two_seconds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["check", "quick_kinematic", "--set", "ride.speed_kmh=[30.0, 40.0, 50.0]"]
    clock = iter(range(100, 10_000))
    monkeypatch.setattr(progress, "time", SimpleNamespace(perf_counter=lambda: float(next(clock))))
    assert call(words) == DONE
    said = [line for line in capsys.readouterr().err.splitlines() if "cells judged" in line]
    assert said == ["4 of 12 cells judged"]  # the third of one a second; the next after ten
    monkeypatch.undo()
    assert call(words) == DONE
    assert "judged" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        (["monte_carlo.track_draws=1000000", "monte_carlo.sensor_draws=1000000"], "cells"),
        (["ride.rest_s=900.0"], "ride"),
    ],
)
def test_what_no_disk_holds_is_refused(
    settings: list[str], field: str, monkeypatch: pytest.MonkeyPatch, here: Path
) -> None:
    size = 10**12 if field == "cells" else 10**7
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(total=size))
    scenario = load_scenario("quick_kinematic", overrides=settings)
    with pytest.raises(InputError, match="more than the disk holds") as told:
        judge_scenario(scenario, many=True)
    assert told.value.field == field and told.value.limit and told.value.remedy


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ([*TUNE, "kom", "--within", "9", "3"], ["--within", "[9.0, 3.0]"]),
        ([*TUNE, "kom", "--step", "inf"], ["--step", "no finite number"]),
        ([*TUNE, "cml", "--out", "nowhere/x.toml"], ["nowhere", "make the folder"]),
        (["export", "quick_kinematic", "--out", "x", "--draw", "1000000"], ["--draw", "999999"]),
        (
            ["export", "quick_kinematic", "--out", "x", "--draw", "2"],
            ["--draw", "found 2", "0 to 1", "monte_carlo.sensor_draws=3"],
        ),
        (["vehicle", "two_axle_wagon", "--out", "file"], ["--out", "cannot be written"]),
        (["vehicle", "two_axle_wagon", "--out", LONG], ["--out", "255 bytes"]),
        (["vehicle", "two_axle_wagon", "--speed", "nan"], ["--speed"]),
        (["imu", "lord_3dm_gx4_25", "--out", "file/below"], ["--out", "cannot be written"]),
        (["run", "quick_kinematic", "--out", LONG], ["--out", "cannot be written"]),
        (["run", "quick_kinematic", "--out", "a\0b"], ["--out", "null"]),
        ([*CHECK, f"track='{LONG}.toml'"], ["track", "no such file", "(307 characters)"]),
        ([*CHECK, "step_s=1e-12"], ["step_s", "1e-12", ">= 1e-06"]),
        ([*CHECK, "truth_rate_hz=1e9"], ["truth_rate_hz", "<= 4000"]),
        ([*CHECK, "ride.end_m=1e9"], ["end_m", "1000000000"]),
        (["check", "x" * 100_000], ["no scenario of this name", "characters)"]),
    ],
)
def test_it_is_refused_before_time_is_spent(
    words: list[str],
    parts: list[str],
    here: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (here / "file").touch()
    monkeypatch.setattr("simrail.vehicle.study.study_vehicle", lambda *_, **__: pytest.fail("studied"))
    monkeypatch.setattr("simrail.ride.ride.simulate", lambda *_, **__: pytest.fail("simulated"))
    assert call(words) == BAD_INPUT
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("simrail: ") and len(said) < 2500
    for part in parts:
        assert part in said, said
    assert "remedy:" in said
    assert [path.name for path in here.iterdir()] == ["file"]
