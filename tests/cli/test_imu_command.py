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
    assert "--out: the folder cannot be written" in capsys.readouterr().err
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


def rest(path: Path, seconds: float = 120.0) -> Path:
    """A logger's file of a resting device, in deg/s and g, at 50 Hz with stamps that jitter."""
    grade = load_grade("lord_3dm_gx4_25")
    frame = at_rest(grade, seconds=seconds, seed=1).iloc[::5]
    logged = np.column_stack([np.degrees(frame.to_numpy()[:, :3]), frame.to_numpy()[:, 3:] / 9.80665])
    time = np.round(frame.index.to_numpy() + np.random.default_rng(1).normal(0.0, 2e-3, len(frame)), 4)
    with path.with_suffix(".csv").open("w", encoding="utf-8") as stream:
        stream.write("t,wx,wy,wz,ax,ay,az\n")
        for stamp, row in zip(time, logged, strict=True):
            stream.write(",".join([f"{stamp}", *(f"{value:.5f}" for value in row)]) + "\n")
    path.write_text(
        f'[imu]\nfile = "{path.with_suffix(".csv").name}"\n'
        'columns = { time = "t", gyro = ["wx", "wy", "wz"], accel = ["ax", "ay", "az"] }\n'
        'units = { gyro = "deg/s", accel = "g" }\n',
        encoding="utf-8",
    )
    return path


def test_a_sheet_is_made_from_a_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every fifth sample of the device: its noise per sample, so the density of a rate five times lower."""
    mine, out = rest(tmp_path / "mine.toml"), tmp_path / "out"
    assert call(["imu", "--from-rest", str(mine), "--out", str(out)]) == DONE
    said = capsys.readouterr().out
    assert "gyro noise N: x" in said and "not shown:" in said and "mine_fitted.toml" in said
    grade, true = load_grade(str(tmp_path / "out" / "mine_fitted.toml")), load_grade("lord_3dm_gx4_25")
    assert grade.rate_hz == pytest.approx(50.0, rel=1e-3)
    assert grade.gyro_noise_radpsqrts == pytest.approx(5**0.5 * true.gyro_noise_radpsqrts, rel=0.05)
    assert grade.accel_noise_mpsqrts == pytest.approx(5**0.5 * true.accel_noise_mpsqrts, rel=0.05)
    page = (tmp_path / "out" / "mine_fitted.html").read_text(encoding="utf-8")
    assert "<svg" in page and "of the recording at rest" in page
    assert call(["imu", str(tmp_path / "out" / "mine_fitted.toml")]) == DONE


def test_a_ride_is_no_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The encoder of a ride tells of the motion; without it, the IMU does."""
    case = Path(__file__).parents[1] / "field" / "cases" / "00-base"
    for words in ("the wheel turns from time_s =", "not at rest"):
        out = tmp_path / "out"
        text = (case / "ride.toml").read_text(encoding="utf-8")
        (tmp_path / "ride.csv").write_bytes((case / "ride.csv").read_bytes())
        (tmp_path / "ride.toml").write_text(
            text if "wheel" in words else text.partition("[encoder]")[0], encoding="utf-8"
        )
        assert call(["imu", "--from-rest", str(tmp_path / "ride.toml"), "--out", str(out)]) == BAD_INPUT
        said = capsys.readouterr().err
        assert len(said.splitlines()) == 1 and words in said and not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["imu"], "either a name or a recording"),
        (["imu", "ideal", "--from-rest", "x.csv"], "either a name or a recording"),
        (["imu", "--from-rest", "none.toml"], "none.toml"),
        (["imu", "--from-rest", "none.csv"], "no such file"),
    ],
)
def test_what_cannot_be_fitted_is_told(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(arguments) == BAD_INPUT
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1 and words in said


def test_samples_that_are_missing_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = rest(tmp_path / "mine.toml")
    lines = path.with_suffix(".csv").read_text(encoding="utf-8").splitlines()
    path.with_suffix(".csv").write_text("\n".join(lines[:1000] + lines[1100:]) + "\n", encoding="utf-8")
    assert call(["imu", "--from-rest", str(path)]) == BAD_INPUT
    assert "lacks samples in 1 places" in capsys.readouterr().err
