"""Track files: the shipped ones, and what is said of those that describe no track."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.track.design import CURVE, STRAIGHT
from simrail.track.file import track_by_name, track_text

GOOD = """
title = "one curve"
source = "this test"
synthetic = true
start_m = -10.0
vertical_radius_m = [500.0]

[[segment]]
kind = "straight"
length_m = 50.0
[[segment]]
kind = "transition"
length_m = 30.0
[[segment]]
kind = "curve"
length_m = 40.0
radius_m = 200.0
cant_mm = 60.0

[[gradient]]
from_m = 20.0
permil = 12.0
"""


def write(folder: Path, text: str) -> str:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_units_and_signs(tmp_path: Path) -> None:
    design = track_by_name(write(tmp_path, GOOD))
    end = design.frame(design.end_m)
    assert design.end_m == 110.0
    assert end.roll_rad == pytest.approx(-np.arcsin(0.060 / 1.5))  # left curve: right rail raised
    assert design.curvature(110.0) == pytest.approx(1.0 / 200.0)
    assert np.tan(end.pitch_rad) == pytest.approx(-0.012)
    assert end.position[2] == pytest.approx(0.012 * 90.0)
    assert end.position[1] > 0.0
    assert design.vertical_radius_m == (500.0,)


def test_ramps_pass_through(tmp_path: Path) -> None:
    default = track_by_name(write(tmp_path, GOOD))
    chosen = track_by_name(write(tmp_path, 'cant_ramp = "linear"\nvertical_ramp_m = 0.0\n' + GOOD))
    assert (default.cant_ramp, default.vertical_ramp_m) == ("smooth", 5.0)
    assert (chosen.cant_ramp, chosen.vertical_ramp_m) == ("linear", 0.0)
    assert chosen.name == "mine"


def test_cant_is_a_height_over_the_rail_base(tmp_path: Path) -> None:
    narrow = GOOD.replace("cant_mm = 60.0", "cant_mm = 6.0").replace(
        "start_m", "rail_base_mm = 150.0\nstart_m", 1
    )
    design, full = track_by_name(write(tmp_path, narrow)), track_by_name(write(tmp_path, GOOD))
    assert (design.rail_base_m, full.rail_base_m) == (0.15, 1.5)
    s = np.linspace(-10.0, 110.0, 41)
    # A tenth of the cant over a tenth of the base: the same roll, whose end is asin(6/150).
    assert design.frame(110.0).roll_rad == pytest.approx(-np.arcsin(0.04), abs=1e-15)
    np.testing.assert_allclose(design.frame(s).k, full.frame(s).k, atol=1e-15)
    (tmp_path / "again.toml").write_text(track_text(design), encoding="utf-8")
    assert track_by_name(str(tmp_path / "again.toml")) == design


@pytest.mark.parametrize("name", sorted(shipped("track")))
def test_shipped_tracks_are_sound(name: str) -> None:
    design = track_by_name(name)
    assert design.source
    frame = design.frame(np.linspace(design.start_m, design.end_m, 5001))
    assert all(np.isfinite(part).all() for part in frame)
    base = design.rail_base_m
    size = base / 1.5
    assert np.abs(base * np.sin(frame.roll_rad)).max() <= 0.160 * size + 1e-9  # EN 13803, normal cant
    assert (
        np.abs(base * frame.rates[:, 0]).max() <= 3.5e-3
    )  # twist, m/m: the quintic is 15/8 of a linear ramp
    assert np.abs(frame.pitch_rad).max() <= 0.040


def test_condequinto_olivar_is_the_line_of_the_station_coordinates() -> None:
    design = track_by_name("condequinto_olivar")
    assert design.synthetic
    assert (design.start_m, design.end_m) == (-50.0, 2150.0)
    frame = design.frame(np.array([0.0, 2100.0]))
    # Chords between the stations turn from 161.4 to 198.3 deg (clockwise from north): 37 deg to the right.
    assert np.degrees(frame.yaw_rad[1]) == pytest.approx(-(198.3 - 161.4), abs=1.0)
    # End to end, scaled from the 2012 m of station chords to the 2100 m of line.
    chords = np.array([492.0, 521.0, 999.0]) * np.exp(
        -1j * np.radians(np.array([161.4, 185.6, 198.3]) - 161.4)
    )
    across = frame.position[1, :2] - frame.position[0, :2]
    assert abs(complex(*across) - chords.sum() * 2100.0 / 2012.0) < 150.0
    # Lead-in and lead-out are straight and level.
    for s in (np.linspace(-50.0, -10.0, 9), np.linspace(2110.0, 2150.0, 9)):
        assert (design.kind(s) == STRAIGHT).all()
        assert not np.abs(design.frame(s).pitch_rad).max() > 1e-15
    # The sharp curve is 250 m to the right, the smooth one 800 m.
    names = [design.segment_name(i) for i, e in enumerate(design.elements) if e.kind == CURVE]
    assert names == ["curve 3 R300", "curve 7 R-250", "curve 11 R-800", "curve 15 R400", "curve 19 R-500"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("radius_m = 200.0", "", ("segment[2].radius_m", "a curve needs its radius")),
        ("radius_m = 200.0", "radius_m = 5e-324", ("segment[2].radius_m", "5e-324", ">= 0.5 m", "in m")),
        ("radius_m = 200.0", "radius_m = 0.0", ("segment[2].radius_m", "found 0.0", "not 0")),
        ("cant_mm = 60.0", "cant_mm = 6000.0", ("segment[2].cant_m",)),
        ("cant_mm = 60.0", "cant_mm = nan", ("segment[2].cant_mm", "not a finite number")),
        ("cant_mm = 60.0", "cant_m = 0.06", ("segment[2].cant_m", "unknown key", "did you mean cant_mm?")),
        ("length_m = 30.0", "length_m = -30.0", ("segment[1].length_m", "found -30.0", "> 0")),
        ("length_m = 50.0", "length_m = 50.0\nradius_m = 5.0", ("segment[0].radius_m", "belongs to a curve")),
        ("length_m = 30.0", "length_m = 30.0\ncant_mm = 5.0", ("segment[1].cant_mm", "start_radius_m")),
        ("length_m = 30.0", "length_m = 30.0\nend_cant_mm = 5.0", ("end_cant_mm", "add end_radius_m")),
        (
            "length_m = 50.0",
            "length_m = 50.0\nend_radius_m = 5.0",
            ("end_radius_m", "belongs to a transition"),
        ),
        ("length_m = 50.0", 'length_m = 50.0\nraised = "left"', ("cant_mm", "needs a positive cant")),
        ("length_m = 50.0", "length_m = 50.0\ncant_mm = -5.0", ("segment[0].raised", "changes sides")),
        ("length_m = 30.0", "length_m = 30.0\nend_radius_m = 150.0", ("segment[2]", "step_smoothing_m")),
        ("start_m = -10.0", "step_smoothing_m = 31.0", ("step_smoothing_m", "<= 30")),
        ('kind = "transition"', 'kind = "straight"', ("segment[2]", "put a transition between")),
        ('kind = "transition"', 'kind = "clothoid"', ("segment[1].kind", "clothoid", "transition")),
        ("from_m = 20.0", "from_m = 200.0", ("gradient[0].from_m", "found 200.0", "110")),
        ("permil = 12.0", "permil = 1200.0", ("gradient[0]", "1.2")),
        ("vertical_radius_m = [500.0]", "vertical_radius_m = [500.0, 1.0]", ("vertical_radius_m", "1 radii")),
        # At most half of the base: 750 mm over 1500 mm, 50 mm over 100 mm.
        ("cant_mm = 60.0", "cant_mm = 800.0", ("segment[2].cant_m", "0.8", "<= 0.75")),
        ("start_m = -10.0", "rail_base_mm = 100.0", ("segment[2].cant_m", "0.06", "<= 0.05")),
        ("start_m = -10.0", "rail_base_mm = 1.5", ("rail_base_mm", "1.5", ">= 50")),
        ("start_m = -10.0", "start_km = -10.0", ("start_km", "did you mean start_m?")),
    ],
)
def test_one_message_says_what_is_wrong(tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in GOOD
    with pytest.raises(InputError) as caught:
        track_by_name(write(tmp_path, GOOD.replace(old, new)))
    message = str(caught.value)
    assert "mine.toml" in message
    for word in words:
        assert word in message


STATIONS = """
[[cant]]
at_m = 50.0
mm = 0.0
[[cant]]
at_m = 70.0
mm = 60.0
[[cant]]
from_m = 110.0
mm = 40.0
"""


def test_cant_by_stations_is_linear_between_them(tmp_path: Path) -> None:
    by_stations = GOOD.replace("cant_mm = 60.0\n", "") + STATIONS
    design = track_by_name(write(tmp_path, by_stations))
    s = np.array([-10.0, 50.0, 60.0, 70.0, 90.0, 110.0])
    # A left curve has its right rail raised; the cant changes within the arc.
    expected = -np.array([0.0, 0.0, 30.0, 60.0, 50.0, 40.0])
    np.testing.assert_allclose(1500.0 * np.sin(design.frame(s).roll_rad), expected, atol=1e-10)
    right = track_by_name(write(tmp_path, by_stations.replace("radius_m = 200.0", "radius_m = -200.0")))
    np.testing.assert_allclose(1500.0 * np.sin(right.frame(s).roll_rad), -expected, atol=1e-10)
    (tmp_path / "again.toml").write_text(track_text(design), encoding="utf-8")
    assert track_by_name(str(tmp_path / "again.toml")) == design


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("at_m = 70.0", "at_m = 50.0", ("cant[1].at_m", "> 50")),
        ("mm = 40.0", "mm = 4000.0", ("cant[2].mm", "0.75")),
        ("at_m = 50.0\nmm = 0.0", "at_m = 30.0\nmm = -5.0", ("cant[0].raised", "left or right")),
        ("mm = 0.0", 'mm = -5.0\nraised = "left"', ("cant[0].mm", ">= 0 mm")),
        ("[[cant]]\nat_m = 50.0", "[[cant]]\nplace_m = 50.0", ("cant[0].place_m", "unknown key")),
    ],
)
def test_stations_that_are_none(tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in STATIONS
    text = GOOD.replace("cant_mm = 60.0\n", "") + STATIONS.replace(old, new)
    with pytest.raises(InputError) as caught:
        track_by_name(write(tmp_path, text))
    for word in words:
        assert word in str(caught.value)


def test_cant_is_said_once(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"segment\[2\].cant_mm: the cant is said twice"):
        track_by_name(write(tmp_path, GOOD + STATIONS))
