"""The teaching example runs, and says that kernels and twins agree."""

import runpy
from pathlib import Path

import pytest


def test_the_lesson_runs(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(Path(__file__).parent), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert [line[:20].strip() for line in lines] == [
        "attitude EKF",
        "EKF of 11 states",
        "zero-velocity filter",
        "trajectory filter",
        "trajectory smoother",
    ]
    assert all(float(line.split("apart by ")[1].split(";")[0]) < 1e-7 for line in lines)
