"""``simrail figure``: a figure of finished results as a file, and how it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.results import run

QUICK = ["ride.end_m=120.0", "ride.speed_kmh=40.0", "monte_carlo.sensor_draws=1", "imu.grade=consumer"]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("figure")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("simrail.ride.cache.cache_folder", lambda: folder / "cache")
        run("quick_kinematic", out=folder / "results", overrides=QUICK, workers=1)
    return folder / "results"


def test_all_names_are_told_and_each_is_drawn(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["figure", str(results)]) == DONE
    names = capsys.readouterr().out.split()
    assert {"answer", "errors-over-distance", "ride-1-errors", "ride-1-IMU"} <= set(names)
    assert len(set(names)) == len(names)
    for name in ("answer", "errors-over-distance", "ride-1-IMU"):
        out = results.parent / f"{name}.svg"
        assert call(["figure", str(results), name, "--out", str(out)]) == DONE
        text = out.read_text(encoding="utf-8")
        assert "<svg" in text and "var(--" not in text, "a file has colours of its own"


def test_a_pdf_is_one_and_the_results_stay_as_they_are(results: Path) -> None:
    before = {path.name: path.stat().st_mtime_ns for path in results.iterdir()}
    out = results.parent / "answer.pdf"
    assert call(["figure", str(results), "answer", "--out", str(out)]) == DONE
    assert out.read_bytes().startswith(b"%PDF")
    assert {path.name: path.stat().st_mtime_ns for path in results.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["answr", "--out", "a.svg"], "did you mean answer?"),
        (["answer", "--out", "a.gif"], "limit: .svg, .pdf, .png"),
        (["answer", "--out", "/dev/null/a.svg"], "the figure cannot be written"),
    ],
)
def test_what_is_wrong_is_told(
    results: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["figure", str(results), *arguments]) == BAD_INPUT
    assert words in capsys.readouterr().err
    assert not Path("a.svg").exists()


def test_a_folder_without_a_page_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["figure", str(tmp_path), "answer"]) == BAD_INPUT
    assert "there is no page of results there" in capsys.readouterr().err
