"""``simrail vehicle``: what it prints and writes, and how it refuses."""

from __future__ import annotations

import io
import re
import time
from contextlib import redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.toml_files import load, shipped
from simrail.report.tables.vehicle_text import _contact_lines, amount, body_rows, critical_words, listed
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.stability import CriticalSpeed, Mode


@pytest.fixture(scope="module")
def bogie(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str, float]:
    """What ``simrail vehicle metro_irw_bogie --out`` says, its page, and the seconds that it took."""
    folder = tmp_path_factory.mktemp("vehicle")
    begun = time.perf_counter()
    with redirect_stdout(io.StringIO()) as said:
        assert call(["vehicle", "metro_irw_bogie", "--out", str(folder / "new")]) == DONE
    page = (folder / "new" / "metro_irw_bogie.html").read_text(encoding="utf-8")
    return said.getvalue(), page, time.perf_counter() - begun


def test_prints_what_is_asked_of_a_vehicle(bogie: tuple[str, str, float]) -> None:
    """Masses, wheel loads, frequencies; no conicity and no critical speed of independent wheels."""
    text = " ".join(bogie[0].split())
    assert "metro_irw_bogie (synthetic)" in text
    assert "12,000 18,000 75,000 75,000 1.450" in text
    # 16.1 t on four wheels.
    assert "front.left 39.49" in text and "in all 16,100 kg" in text
    independent = "not given (the wheels turn independently"
    assert f"critical speed: {independent}: without conicity no wheelset hunts)" in text
    assert f"equivalent conicity: {independent})" in text
    # The body's bounce is at sqrt(4 k/m) = 1.30 Hz less what the frame gives way.
    bounce = re.search(r"(\d\.\d+) ([\d.]+) body bounce 100%", text)
    assert bounce and 1.15 < float(bounce[1]) < 1.30 and 5.0 < float(bounce[2]) < 25.0


def test_page_stands_alone_and_shows_three_figures(bogie: tuple[str, str, float]) -> None:
    page = bogie[1]
    assert page.count('role="img" aria-label') == 2 * 3, "for a desk and for a phone"
    assert page.count("<script") == 1 and "fetch(" not in page
    assert "No equivalent conicity is given" in page
    assert "What is reduced" in page and "trailing arms" not in page  # it has none
    assert not re.search(r"""(?:src|href)=["'](?:https?:)?//""", page)
    assert "Synthetic: its figures are not those of a real vehicle" in page
    for heading in ("Masses and loads", "Contact", "Modes", "Root locus"):
        assert f">{heading}" in page
    assert "nan" not in re.sub(r"<[^>]*>", "", page).lower().split()


@pytest.mark.slow
def test_answers_within_20_s(bogie: tuple[str, str, float]) -> None:
    assert bogie[2] < 20.0


@pytest.mark.parametrize(
    ("argument", "said"),
    [("metro_irw_boggie", "metro_irw_bogie"), ("./nowhere.toml", "no such file")],
)
def test_bad_names_are_refused_in_one_line(
    argument: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, the nearest name or the path, and nothing written."""
    assert call(["vehicle", argument, "--out", str(tmp_path / "out")]) == BAD_INPUT
    captured = capsys.readouterr()
    assert captured.err.startswith("simrail: ") and len(captured.err.splitlines()) == 1
    assert said in captured.err and captured.out == ""
    assert not (tmp_path / "out").exists()


def test_a_bad_file_is_refused_with_its_field(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = shipped("vehicle")["metro_irw_bogie"].read_text(encoding="utf-8")
    mine = tmp_path / "mine.toml"
    mine.write_text(text.replace("friction = 0.3", "friction = -0.3"), encoding="utf-8")
    assert call(["vehicle", str(mine)]) == BAD_INPUT
    assert "mine.toml: friction" in capsys.readouterr().err


@pytest.mark.slow
def test_a_scale_vehicle_is_told_in_figures_of_its_size(capsys: pytest.CaptureFixture[str]) -> None:
    """Three digits of grams and newtons; the conicity of S1002 at a tenth of 3 mm."""
    assert call(["vehicle", "scale_vehicle"]) == DONE
    text = " ".join(capsys.readouterr().out.split())
    assert "in all 40 kg" in text and "axle_f1.left 0.04905" in text
    assert "axle_f1 1.6 0.00695 5e-05 0.00695 0.045" in text
    assert "wheel S1002 on rail 60E1 at 1:10, gauge 127 mm" in text
    at_3_mm = re.search(r"equivalent conicity at 0.29 mm: (0\.\d+)", text)
    assert at_3_mm and 0.15 < float(at_3_mm[1]) < 0.2


def test_contact_is_told_in_millimetres_of_the_model() -> None:
    """At a tenth: whole millimetres of full size are listed, and the conicity is that of a tenth of 3 mm."""
    model = load(VehicleFile, "vehicle", "scale_vehicle").model("scale_vehicle")
    conicity = SimpleNamespace(
        steers=True,
        scale=0.1,
        amplitude_m=(1e-4, 1.5e-4, 2e-4),
        equivalent=(0.111, 0.222, 0.333),
        at_3_mm=0.17,
    )
    first, *_, last = _contact_lines(SimpleNamespace(model=model, conicity=conicity))  # type: ignore[arg-type]
    assert first.startswith("wheel S1002 on rail 60E1 at 1:10, gauge 127 mm, inclination 1:")
    assert last == (
        "equivalent conicity at 0.3 mm: [bold]0.170[/bold]; over the amplitude: 0.1 mm 0.111, 0.2 mm 0.333"
    )
    assert [row[0] for row in body_rows(model)] == list(model.body_names)
    assert body_rows(model)[0][1:5] == ("1.6", "0.00695", "5e-05", "0.00695")
    assert (amount(99.96), amount(100.0), amount(16100.4)) == ("100", "100", "16,100")


@pytest.mark.parametrize(
    ("critical", "words"),
    [
        (CriticalSpeed(50.0, 1.5, (5.0, 100.0)), "180.0 km/h (above it an oscillation of 1.50 Hz grows)"),
        (CriticalSpeed(None, None, (5.0, 100.0)), "none below 360 km/h"),
        (
            CriticalSpeed(5.0, 1.5, (5.0, 100.0), True),
            "below 18 km/h already (an oscillation of 1.50 Hz grows)",
        ),
    ],
)
def test_the_critical_speed_is_told_in_kilometres_an_hour(critical: CriticalSpeed, words: str) -> None:
    assert critical_words(critical) == words


def test_modes_of_contact_springs_and_such_as_hardly_swing_are_not_listed() -> None:
    slow, fast = Mode(complex(-1.0, 6.0), {}), Mode(complex(-1.0, 260.0), {})  # 260/s is 41.4 Hz
    creeping = Mode(complex(-6.0, 1.0), {})  # damping 6 / sqrt(37) = 0.986
    assert listed([slow, fast, creeping, Mode(complex(0.5, 250.0), {})]) == [
        slow,
        Mode(complex(0.5, 250.0), {}),
    ]
