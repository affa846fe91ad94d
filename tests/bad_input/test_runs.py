"""Faulty rides of several runs, restrictions and coasting: one message each, and exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, call
from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
RUNS = "runs = [{ end_m = 590.0, turn_s = 20.0 }, { end_m = 20.0 }]\n"


def ride(lines: str) -> str:
    """The good scenario with other lines in place of the end of its ride."""
    assert "end_m = 590.0\n" in GOOD
    return GOOD.replace("end_m = 590.0\n", lines)


# name: (lines, parts of the message)
FAULTS: dict[str, tuple[str, list[str]]] = {
    "end and runs": (RUNS + "end_m = 590.0\n", ["ride[0].end_m", "590", "has runs", "take out"]),
    "no run": ("runs = []\n", ["ride[0].runs", "[]", "is empty", "one run or more", "give end_m"]),
    "no run beside an end": ("runs = []\nend_m = 590.0\n", ["ride[0].runs", "is empty"]),
    "reversed": (RUNS + "reverse = true\n", ["ride[0].reverse", "list the runs the other way"]),
    "kick": (RUNS + "kick_end_m = 100.0\n", ["ride[0].kick_end_m", "over one run", "end_m"]),
    "no turning time": (RUNS.replace(", turn_s = 20.0", ""), ["ride[0].runs[0].turn_s", "is missing"]),
    "turn after the last run": (
        RUNS.replace("end_m = 20.0 }", "end_m = 20.0, turn_s = 9.0 }"),
        ["ride[0].runs[1].turn_s", "9.0", "no run follows", "final_rest_s"],
    ),
    "turn for days": (RUNS.replace("turn_s = 20.0", "turn_s = 1e6"), ["runs[0].turn_s", "<= 3600"]),
    "run to where it is": (
        RUNS.replace("end_m = 20.0", "end_m = 590.0"),
        ["ride[0].runs[1].end_m", "590", "ends where it starts"],
    ),
    "run off the track": (
        RUNS.replace("end_m = 20.0", "end_m = -500.0"),
        ["ride[0].runs[1].end_m", "-500", "not on track"],
    ),
    "stop that no run passes": (
        RUNS.replace("590.0", "400.0") + "stops = [{ position_m = 450.0, dwell_s = 5.0 }]\n",
        ["ride[0].stops[0].position_m", "450", "not on the way"],
    ),
    "two stops in one place": (
        RUNS + "stops = [{ position_m = 300.0, dwell_s = 5.0 }, { position_m = 300.0, dwell_s = 1.0 }]\n",
        ["ride[0].stops[1].position_m", "300", "stops there already"],
    ),
    "unknown key of a run": (RUNS.replace("turn_s", "turn_time_s"), ["runs[0].turn_time_s", "unknown key"]),
    "restriction without length": (
        "end_m = 590.0\nrestriction = [{ start_m = 200.0, end_m = 200.0, speed_kmh = 20.0 }]\n",
        ["ride[0].restriction[0].end_m", "200", "no length"],
    ),
    "restriction elsewhere": (
        "end_m = 400.0\nrestriction = [{ start_m = 450.0, end_m = 480.0, speed_kmh = 20.0 }]\n",
        ["ride[0].restriction[0].start_m", "450", "does not pass", "10 and 400 m"],
    ),
    "restriction to a standstill": (
        "end_m = 590.0\nrestriction = [{ start_m = 200.0, end_m = 300.0, speed_kmh = 0.0 }]\n",
        ["ride[0].restriction[0].speed_kmh", "> 0"],
    ),
    "coasting uphill": (
        "end_m = 590.0\ncoasting = { deceleration_mps2 = -0.1, least_kmh = 30.0 }\n",
        ["ride[0].coasting.deceleration_mps2", "-0.1", "> 0"],
    ),
    "coasting without a least speed": (
        "end_m = 590.0\ncoasting = { deceleration_mps2 = 0.05 }\n",
        ["ride[0].coasting.least_kmh", "is required"],
    ),
    "braking like a wall": ("end_m = 590.0\nbraking_mps2 = 30.0\n", ["ride[0].braking_mps2", "<= 3"]),
}


@pytest.mark.parametrize("name", FAULTS)
def test_one_message_names_the_fault(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines, said = FAULTS[name]
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(ride(lines))
    assert call(["run", "mine.toml"]) == BAD_INPUT
    captured = capsys.readouterr()
    assert len(captured.err.strip().splitlines()) == 1, captured.err
    assert "mine.toml" in captured.err
    for words in said:
        assert words in captured.err, captured.err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_runs_need_a_speed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(ride(RUNS).replace("speed_kmh = 50.0\n", ""))
    assert call(["check", "mine.toml"]) == BAD_INPUT
    assert "ride[0].speed_kmh" in capsys.readouterr().err


@pytest.mark.parametrize(
    "lines",
    [
        RUNS,
        RUNS + "braking_mps2 = 0.5\ncoasting = { deceleration_mps2 = 0.05, least_kmh = 30.0 }\n",
        RUNS + "stops = [{ position_m = 300.0, dwell_s = 5.0 }]\n"
        "restriction = [{ start_m = 100.0, end_m = 200.0, speed_kmh = 20.0 }]\n",
    ],
)
def test_sound_ones_are_taken(lines: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(ride(lines))
    assert call(["check", "mine.toml"]) == 0
