"""Transitions with ends of their own, steps that are smoothed, canted straights: against quadrature."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.design import CantStation, Curve, Straight, TrackDesign, Transition
from simrail.track.file import track_by_name, track_text
from simrail.track.map_errors import MapDefect, MapErrors, draw_map

Profile = list[tuple[float, float, float]]
"""Length and curvature at both ends, of pieces of linear curvature."""


def curvature_of(pieces: Profile) -> Callable[[float], float]:
    """Curvature at s: the formula of the clothoid, k0 + (k1 - k0) s/L."""

    def at(s: float) -> float:
        for length, k0, k1 in pieces:
            if s <= length:
                return k0 + (k1 - k0) * s / length
            s -= length
        return pieces[-1][2]

    return at


def by_quadrature(pieces: Profile, places: FloatArray) -> FloatArray:
    """Coordinates (n, 2): the integral of (cos, sin) of the integral of the curvature, piece by piece."""
    found = []
    for place in places:
        x = y = yaw = 0.0
        left = float(place)
        for length, k0, k1 in pieces:
            along, rate = min(length, left), (k1 - k0) / length

            def angle(u: float, yaw: float = yaw, k0: float = k0, rate: float = rate) -> float:
                return yaw + k0 * u + 0.5 * rate * u * u

            x += quad(lambda u: np.cos(angle(u)), 0.0, along, epsabs=1e-12, limit=200)[0]
            y += quad(lambda u: np.sin(angle(u)), 0.0, along, epsabs=1e-12, limit=200)[0]
            yaw, left = angle(along), left - along
            if left <= 0.0:
                break
        found.append((x, y))
    return np.array(found)


INF = float("inf")
LINES = {
    "reverse clothoids": (
        [
            Straight(100.0),
            Transition(80.0),
            Curve(80.0, -1500.0),
            Transition(80.0),
            Transition(60.0),
            Curve(60.0, 1000.0),
            Transition(50.0),
            Straight(100.0),
        ],
        [
            (100, 0, 0),
            (80, 0, -1 / 1500),
            (80, -1 / 1500, -1 / 1500),
            (80, -1 / 1500, 0),
            (60, 0, 0.001),
            (60, 0.001, 0.001),
            (50, 0.001, 0),
            (100, 0, 0),
        ],
    ),
    "begins and ends in one": (
        [Transition(50.0), Curve(70.0, 300.0), Transition(40.0)],
        [(50, 0, 1 / 300), (70, 1 / 300, 1 / 300), (40, 1 / 300, 0)],
    ),
    "begins inside of one": (
        [Transition(30.0, start_radius_m=-900.0), Curve(70.0, -300.0)],
        [(30, -1 / 900, -1 / 300), (70, -1 / 300, -1 / 300)],
    ),
    "three in a row": (
        [
            Curve(20.0, 800.0),
            Transition(40.0, end_radius_m=400.0),
            Transition(50.0, end_radius_m=INF),
            Transition(60.0, end_radius_m=-500.0),
        ],
        [(20, 1 / 800, 1 / 800), (40, 1 / 800, 1 / 400), (50, 1 / 400, 0), (60, 0, -1 / 500)],
    ),
    "compound": (
        [Curve(40.0, 200.0), Transition(30.0), Curve(50.0, 90.0), Transition(20.0), Curve(30.0, -250.0)],
        [
            (40, 1 / 200, 1 / 200),
            (30, 1 / 200, 1 / 90),
            (50, 1 / 90, 1 / 90),
            (20, 1 / 90, -1 / 250),
            (30, -1 / 250, -1 / 250),
        ],
    ),
}


@pytest.mark.parametrize("name", LINES)
def test_against_quadrature_of_the_formula(name: str) -> None:
    elements, pieces = LINES[name]
    design = TrackDesign(name, 0.0, tuple(elements))
    s = np.linspace(0.0, design.end_m, 12)
    assert np.abs(design.frame(s).position[:, :2] - by_quadrature(pieces, s)).max() < 1e-9
    at = curvature_of(pieces)
    bends = [at(float(place)) for place in s]
    np.testing.assert_allclose(design.curvature(s), bends, atol=1e-12)


def test_a_step_becomes_a_clothoid_of_the_stated_length() -> None:
    line = (Straight(100.0), Curve(40.0, 25.0), Straight(100.0))
    smooth = TrackDesign("tram", 0.0, line, step_smoothing_m=6.0)
    k = 1.0 / 25.0
    pieces = [(97.0, 0, 0), (6.0, 0, k), (34.0, k, k), (6.0, k, 0), (97.0, 0, 0)]
    s = np.linspace(0.0, 240.0, 13)
    assert np.abs(smooth.frame(s).position[:, :2] - by_quadrature(pieces, s)).max() < 1e-9
    assert smooth.curvature(100.0) == pytest.approx(0.5 * k)
    # The turn is that of the bare arc; the line is shifted by k L^2/24 = 60 mm to the inside.
    assert smooth.frame(240.0).yaw_rad == pytest.approx(40.0 / 25.0, abs=1e-12)
    bare = by_quadrature([(100.0, 0, 0), (20.0, k, k)], np.array([120.0]))[0]
    shift = np.hypot(*(smooth.frame(120.0).position[:2] - bare))
    assert shift == pytest.approx(k * 36.0 / 24.0, rel=0.01)


def test_a_kink_shorter_than_the_smoothing_keeps_its_turn() -> None:
    line = (Straight(100.0), Curve(0.6, -26000.0), Straight(400.0))
    smooth = TrackDesign("kink", 0.0, line, step_smoothing_m=5.0)
    assert smooth.frame(500.6).yaw_rad == pytest.approx(-0.6 / 26000.0, rel=1e-9)
    s = np.linspace(90.0, 110.0, 4001)
    bend = smooth.curvature(s)
    # The box of 0.6 m averaged over 5 m: 12 % of its height, over 4.4 m.
    assert bend.min() == pytest.approx(-0.12 / 26000.0, rel=1e-9)
    assert np.abs(np.diff(bend)).max() < 1.01 * 0.005 / 26000.0 / 5.0
    assert np.count_nonzero(bend) * 0.005 == pytest.approx(5.6, abs=0.02)


@pytest.mark.parametrize("ramp", ["smooth", "linear"])
def test_a_step_of_cant_rises_as_a_ramp_does(ramp: str) -> None:
    line = (Straight(50.0), Curve(50.0, -300.0, 0.06), Curve(50.0, -300.0, 0.03))
    design = TrackDesign("steps", 0.0, line, step_smoothing_m=10.0, cant_ramp=ramp)
    u = np.array([-0.5, -0.3, 0.0, 0.2, 0.5]) + 0.5
    share = u if ramp == "linear" else 10 * u**3 - 15 * u**4 + 6 * u**5
    level = 1.5 * np.sin(design.frame(45.0 + 10.0 * u).roll_rad)
    np.testing.assert_allclose(level, 0.06 * share, atol=1e-14)
    again = 1.5 * np.sin(design.frame(95.0 + 10.0 * u).roll_rad)
    np.testing.assert_allclose(again, 0.06 - 0.03 * share, atol=1e-14)


def test_a_canted_straight_raises_the_right_rail_as_a_left_curve_does() -> None:
    design = TrackDesign("canted", 0.0, (Straight(30.0, 0.02), Transition(40.0), Curve(30.0, 500.0, 0.05)))
    assert 1.5 * np.sin(design.frame(10.0).roll_rad) == pytest.approx(-0.02)
    assert 1.5 * np.sin(design.frame(90.0).roll_rad) == pytest.approx(-0.05)


@pytest.mark.parametrize(
    ("elements", "field"),
    [
        # Between curves of one side nothing says whether two transitions meet straight.
        ((Curve(9.0, 300.0), Transition(9.0), Transition(9.0), Curve(9.0, 200.0)), "segment[1].end_radius_m"),
        ((Transition(9.0), Transition(9.0), Curve(9.0, 200.0)), "segment[0].start_radius_m"),
        ((Curve(9.0, 300.0), Transition(9.0, start_radius_m=250.0), Straight(9.0)), "segment[1]"),
        ((Transition(9.0, 0.0), Curve(9.0, 300.0)), "segment[0].start_radius_m"),
        (
            (Curve(9.0, 300.0, 0.1), Transition(9.0, None, 500.0), Transition(9.0), Straight(9.0)),
            "segment[1].end_cant_mm",
        ),
        ((Transition(9.0, start_cant_m=0.1), Curve(9.0, 300.0)), "segment[0].start_cant_mm"),
    ],
)
def test_ends_of_which_nothing_says_enough(elements: tuple[object, ...], field: str) -> None:
    with pytest.raises(InputError) as caught:
        TrackDesign("bad", 0.0, elements).check()  # type: ignore[arg-type]
    assert caught.value.field == field


@pytest.mark.parametrize("ways", [slice(None), slice(None, None, -1)], ids=["start", "end"])
def test_a_step_at_the_very_end_cannot_be_smoothed(ways: slice) -> None:
    line = (Straight(2.4), Curve(9.0, 300.0))[ways]
    with pytest.raises(InputError, match="too close to an end") as caught:
        TrackDesign("bad", 0.0, line, step_smoothing_m=5.0).check()
    assert caught.value.value == "2.4 m from the end" and caught.value.field == "segment[1]"
    TrackDesign("good", 0.0, line, step_smoothing_m=4.8).check()


@pytest.mark.parametrize("name", LINES)
def test_files_read_back(tmp_path: Path, name: str) -> None:
    design = TrackDesign(name, 5.0, tuple(LINES[name][0]), step_smoothing_m=4.0)
    (tmp_path / "line.toml").write_text(track_text(design), encoding="utf-8")
    assert track_by_name(str(tmp_path / "line.toml")) == design
    assert TrackDesign.from_dict(design.to_dict()) == design


def test_maps_of_such_lines_are_drawn() -> None:
    # A transition that says the radius of its curve follows the map's curve, whose radius is another one.
    line = (Straight(90.0), Transition(60.0, INF, 400.0, 0.0, 0.05), Curve(80.0, 400.0, 0.05))
    line += (Transition(50.0), Transition(70.0), Curve(60.0, -300.0, 0.04), Transition(60.0))
    design = TrackDesign("line", 0.0, line)
    known = draw_map(design, MapErrors(), seed=1, draw=0)
    curve = known.elements[2]
    assert isinstance(curve, Curve) and curve.radius_m != 400.0
    assert known.curvature(200.0) == pytest.approx(1.0 / curve.radius_m)
    with pytest.raises(InputError, match="before and after"):
        draw_map(design, MapErrors(), seed=1, draw=0, defects=[MapDefect("missing_transition", 260.0)])


def test_maps_move_and_err_the_stations_of_cant() -> None:
    line = (Straight(200.0), Transition(60.0), Curve(80.0, -400.0), Transition(50.0), Straight(200.0))
    stations = tuple(CantStation(s, h) for s, h in ((200.0, 0.0), (260.0, 0.05), (340.0, 0.05), (390.0, 0.0)))
    design = TrackDesign("line", 0.0, line, cant_stations=stations)
    errors = MapErrors(cant_along_sd_m=0.0, chainage_offset_sd_m=2.0)
    known = draw_map(design, errors, seed=3, draw=1).cant_stations
    shifts = [b.at_m - a.at_m for a, b in zip(stations, known, strict=True)]
    assert shifts[0] != 0.0 and np.ptp(shifts) < 1e-9
    wrong = [b.cross_slope_m - a.cross_slope_m for a, b in zip(stations, known, strict=True)]
    # One error of the curve's cant at both of its ends, none where there is none.
    assert wrong[0] == wrong[3] == 0.0
    assert wrong[1] == pytest.approx(wrong[2]) and 1e-5 < abs(wrong[1]) < 0.015
