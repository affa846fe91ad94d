"""``simrail imu``: what it prints and writes, and how it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.toml_files import shipped
from simrail.recording.sheets.allan import overlapping_allan
from simrail.recording.sheets.imu_file import load_grade
from simrail.report.pages.imu_page import at_rest


def test_prints_the_sheet_in_its_own_units(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["imu", "lord_3dm_gx4_25"]) == DONE
    said = capsys.readouterr().out
    # Briales et al. 2021, Table 1, as printed there.
    for words in ("0.005 deg/s/sqrt(Hz)", "0.3 deg/sqrt(h)", "100 ug/sqrt(Hz)", "10 deg/h", "0.04 mg"):
        assert words in said
    for words in ("0.05 deg/s", "2 mg", "300 deg/s", "5 g", "0.008 deg/s", "0.1 mg", "250 Hz"):
        assert words in said
    assert "assumed:" in said
    assert "vibration rectification" in " ".join(said.split())


@pytest.mark.parametrize("name", sorted(shipped("imu")))
def test_every_shipped_imu_is_shown(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["imu", name]) == DONE
    said = capsys.readouterr().out
    assert name in said
    assert ("synthetic" in said) == (name in ("consumer", "industrial", "tactical", "navigation"))


def test_brackets_in_a_text_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["imu", "navigation"]) == DONE
    assert "[earth]" in capsys.readouterr().out


def test_an_imu_without_errors_has_no_empty_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["imu", "ideal", "--out", str(tmp_path)]) == DONE
    assert "no error terms" in capsys.readouterr().out
    page = (tmp_path / "ideal.html").read_text(encoding="utf-8")
    assert "No error terms" in page
    assert "<figure" not in page
    assert "Allan" not in page


def test_a_page_that_cannot_be_written_is_bad_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine", encoding="utf-8")
    assert call(["imu", "ideal", "--out", str(taken)]) == BAD_INPUT
    assert "--out: the page cannot be written" in capsys.readouterr().err
    assert taken.read_text(encoding="utf-8") == "mine"


def test_writes_a_page_that_stands_by_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'title = "Mine"\nsource = "made up"\nsynthetic = true\nrate_hz = 10.0\n'
        "gyro_noise_degpsqrth = 0.3\naccel_bias_instability_mg = 0.1\noversampling = 2\n",
        encoding="utf-8",
    )
    assert call(["imu", str(mine), "--out", str(tmp_path / "page")]) == DONE
    page = (tmp_path / "page" / "mine.html").read_text(encoding="utf-8")
    assert "Synthetic: its figures are not those of a real device" in page
    assert "0.3 deg/sqrt(h)" in page
    assert "averages over" in page
    assert page.count('role="img" aria-label') == 2, "for a desk and for a phone"
    assert not re.search(r'(src|href)="(?!#)', page), "nothing is loaded from elsewhere"


def test_the_simulated_curve_is_that_of_the_closed_form() -> None:
    grade = load_grade("lord_3dm_gx4_25")
    tau = np.array([0.1, 1.0])
    frame = at_rest(grade, seconds=600.0, seed=2)
    for kind, expected in grade.allan(tau).items():
        columns = [name for name in frame if str(name).startswith(kind)]
        found = [overlapping_allan(frame[name].to_numpy(), grade.rate_hz, tau) for name in columns]
        # Three axes of 600 averages of 1 s each: 1.4 %.
        np.testing.assert_allclose(np.sqrt(np.mean(np.square(found), axis=0)), expected, rtol=0.05)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("gyro_noise_degpsqrth = -0.3", ["gyro_noise_degpsqrth", "-0.3", ">= 0"]),
        ("bandwidth_hz = 0.0", ["bandwidth_hz", "> 0"]),
        ("gyro_nois_degpsqrth = 0.3", ["unknown key", "did you mean gyro_noise_degpsqrth"]),
        ("gyro_noise_degpsqrth = 0.3\ngyro_noise_degpsqrthz = 0.005", ["given twice", "either this or"]),
        ("dropped_percent = 70.0", ["dropped_fraction", "< 0.5"]),
        ("flicker_range_s = [10.0, 1.0]\nbias_process = 'flicker'", ["flicker_range_s", "shortest"]),
    ],
)
def test_wrong_grades_are_refused_with_one_message(
    line: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(f'title = "Mine"\nsource = "made up"\nrate_hz = 10.0\n{line}\n', encoding="utf-8")
    assert call(["imu", str(mine), "--out", str(tmp_path / "page")]) == BAD_INPUT
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    for word in ["mine.toml", *words]:
        assert word in said.err
    assert not (tmp_path / "page").exists()


def test_a_name_that_is_not_there_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["imu", "lord_3dm_gx4_52"]) == BAD_INPUT
    assert "lord_3dm_gx4_25" in capsys.readouterr().err
