"""Faulty rails: files and defects, one message each that names file, field, value, limit, remedy; code 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.cli.main import call
from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
TABLE = """spectrum = "none"

[irregularity.measured]
file = "rails.csv"
columns = { position = "s", alignment = "a", gauge = "g" }
units = { position = "m", alignment = "mm", gauge = "mm" }

[irregularity]"""
S = np.arange(0.0, 600.25, 0.25)
FRAME = pd.DataFrame({"s": S, "a": 2.0 * np.sin(S), "g": 1.5 * np.cos(S / 3.0)})


def _text(words: str = "", instead: str = "") -> str:
    head, tail = GOOD.split('spectrum = "erri_b176_low"')
    table = TABLE.removesuffix("[irregularity]").split("\n", 1)
    return head + table[0] + tail.replace("[[ride]]", table[1].replace(words, instead) + "[[ride]]", 1)


def _frame(**changes: object) -> pd.DataFrame:
    frame = FRAME.copy()
    for name, change in changes.items():
        frame[name] = change(frame[name])  # type: ignore[operator]
    return frame


def _set(index: int, value: float) -> Callable[[pd.Series], pd.Series]:
    return lambda column: column.where(column.index != index, value)


# name: (data, words of the scenario, what stands there instead, parts of the message)
FAULTS: dict[str, tuple[pd.DataFrame, str, str, list[str]]] = {
    "unsorted": (
        _frame(s=_set(40, 9.0)),
        "",
        "",
        ["rails.csv", "position", "9 m after 9.75 m, line 42", "> 9.75 m", "sort"],
    ),
    "NaN": (
        _frame(a=_set(40, np.nan)),
        "",
        "",
        ["rails.csv", "alignment", "line 42", "finite", "bridge_gaps_m"],
    ),
    "NaN place": (_frame(s=_set(40, np.nan)), "", "", ["rails.csv", "position", "line 42", "drop"]),
    "gap": (
        FRAME.drop(index=[50, 51]),
        "",
        "",
        ["rails.csv", "0.75 m after line 51", "0.375 m", "bridge_gaps_m = 0.8"],
    ),
    "millimetres as metres": (
        FRAME,
        'alignment = "mm"',
        'alignment = "m"',
        ["rails.csv", "alignment", "0.254 m", "213", "unit"],
    ),
    "metres as millimetres": (
        _frame(g=lambda v: v / 1e3),
        "",
        "",
        ["rails.csv", "gauge", "5e-05 m", "unit (metres?)"],
    ),
    "the whole gauge": (
        _frame(g=lambda v: v + 1435.0),
        "",
        "",
        ["rails.csv", "gauge", "1.43", "nominal_gauge_mm"],
    ),
    "kilometres as metres": (
        _frame(s=lambda v: v / 1e3),
        "",
        "",
        ["rails.csv", "position", "0.00025 m apart", "0.001 m", "unit (kilometres?)"],
    ),
    "metres as kilometres": (
        FRAME,
        'position = "m"',
        'position = "km"',
        ["wavelengths_m", "every 250 m", "0.375 m", "finer"],
    ),
    "too short": (
        FRAME[:1000],
        "",
        "",
        ["measured.start_m", "0 to 249.75 m", "9.1 to 590.9 m", "partial = true"],
    ),
    "too coarse": (
        FRAME[::2],
        "",
        "",
        ["wavelengths_m", "every 0.5 m", "0.375 m", "wavelengths_m = [2, ...]"],
    ),
    "no unit": (FRAME, ', gauge = "mm"', "", ["measured.units.gauge", "no unit", "mm"]),
    "unknown unit": (
        FRAME,
        'gauge = "mm" }',
        'gauge = "mn" }',
        ["measured.units.gauge", "'mn'", "one of m, km", "did you mean"],
    ),
    "unknown quantity": (
        FRAME,
        'gauge = "g"',
        'gage = "g"',
        ["measured.columns.gage", "did you mean 'gauge'"],
    ),
    "unknown column": (FRAME, 'gauge = "g"', 'gauge = "gg"', ["measured.columns", "'gg'", "one of s, a, g"]),
    "no file": (FRAME, "rails.csv", "rail.csv", ["measured.file", "no such file", "rail.csv", "path"]),
    "one rail": (
        FRAME,
        'alignment = "',
        'left_level = "',
        ["measured.columns.right_level", "both rails", "add it"],
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("command", ["check", "run"])
def test_faulty_rails(place: Path, message_of: Callable[[list[str]], str], fault: str, command: str) -> None:
    frame, words, instead, parts = FAULTS[fault]
    frame.to_csv(place / "rails.csv", index=False)
    text = _text(words, instead)
    assert not words or text != _text()
    (place / "mine.toml").write_text(text)
    message = message_of([command, "mine.toml"])
    for part in parts:
        assert part in message
    assert [path.name for path in (place / "results" / "mine").iterdir()] == ["manifest.json"]


def test_the_good_file_passes(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    FRAME.to_csv(place / "rails.csv", index=False)
    (place / "mine.toml").write_text(_text())
    assert call(["check", "mine.toml"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("lines", "parts"),
    [
        ('form = "bump"', ["defect[0].form", "'bump'", "'dip'"]),
        ("length_m = 0.1", ["irregularity.defect[0].length_m", "0.1", ">= 0.25"]),
        ("size_mm = 2000.0", ["irregularity.defect[0].size_m", "2.0", "0.5"]),
        ("at_m = 598.0", ["irregularity.defect[0].at_m", "598 to 604 m", "0 to 600 m", "move it"]),
        ("hold_m = 3.0", ["irregularity.defect[0].hold_m", "3.0", "ramp"]),
    ],
)
def test_faulty_defects(
    place: Path, message_of: Callable[[list[str]], str], lines: str, parts: list[str]
) -> None:
    dip = {"form": '"dip"', "at_m": "100.0", "length_m": "6.0", "size_mm": "20.0"}
    key, _, value = lines.partition(" = ")
    written = "\n".join(f"{k} = {v}" for k, v in (dip | {key: value}).items())
    text = GOOD.replace("[[ride]]", f"[[irregularity.defect]]\n{written}\n\n[[ride]]", 1)
    (place / "mine.toml").write_text(text)
    message = message_of(["check", "mine.toml"])
    for part in parts:
        assert part in message
