"""No cell of a written table is a formula to a spreadsheet, and none spans two lines."""

from __future__ import annotations

import ast
import csv
from pathlib import Path

import pandas as pd
import pytest

import simrail
from simrail.core.csv_files import write_csv


@pytest.mark.parametrize("kind", ["object", "string", "category"])
def test_texts_are_harmless_and_numbers_are_numbers(kind: str, tmp_path: Path) -> None:
    texts = ["=1+1", "+cmd", "-2+3", "@SUM", "\t=1", "plain", "-12.5", "a\nb", "\x1b[31m", None]
    frame = pd.DataFrame({"text": pd.Series(texts).astype(kind), "value": [-1.5] * len(texts)})
    write_csv(frame, tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as stream:
        rows = list(csv.reader(stream))[1:]
    shown = ["'=1+1", "'+cmd", "'-2+3", "'@SUM", "'\\t=1", "plain", "-12.5", "a\\nb", "\\x1b[31m", ""]
    assert [row[0] for row in rows] == shown
    assert {row[1] for row in rows} == {"-1.5"}
    assert frame["text"].iloc[0] == "=1+1", "the table itself is as it was"


def test_no_table_is_written_past_the_guard() -> None:
    """`to_csv` is called where the guard is, and for a template, which is made of our own numbers."""
    package = Path(simrail.__file__).parent
    callers = {
        path.name
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr == "to_csv"
    }
    assert callers == {"csv_files.py", "templates.py"}
