"""Maps that err: what was laid compared with what is known, each kind of error alone, over 200 draws."""

from dataclasses import fields, replace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, parse_toml
from simrail.track.design import CantStation, Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.file import TrackFile, track_text
from simrail.track.map_errors import EXACT, MapDefect, MapErrors, draw_map

DRAWS = 200
LINE = TrackDesign(
    "line",
    0.0,
    (
        Straight(300.0),
        Transition(60.0),
        Curve(200.0, 400.0, 0.08),
        Transition(60.0),
        Straight(150.0),
        Transition(80.0),
        Curve(150.0, -600.0, 0.05),
        Transition(80.0),
        Straight(520.0),
    ),
    gradients=(Gradient(500.0, 0.01), Gradient(1100.0, -0.005)),
)
S = np.arange(0.0, 1600.0, 5.0)


def only(**sizes: float) -> MapErrors:
    return replace(EXACT, **sizes)


def maps(errors: MapErrors, seed: int = 3) -> list[TrackDesign]:
    return [draw_map(LINE, errors, seed=seed, draw=draw) for draw in range(DRAWS)]


def assert_sd(values: np.ndarray, sd: float, independent: int) -> None:
    """Standard deviation and mean of so many independent normal numbers, inside 4 of their own sds."""
    assert np.std(values) == pytest.approx(sd, rel=4.0 / np.sqrt(2.0 * independent))
    assert abs(np.mean(values)) < 4.0 * sd / np.sqrt(independent)


def curves(track: TrackDesign) -> list[Curve]:
    return [element for element in track.elements if isinstance(element, Curve)]


def test_an_exact_map_is_the_design() -> None:
    assert draw_map(LINE, EXACT, seed=1, draw=0) == LINE


def test_cant_of_curves() -> None:
    off = np.array([[c.cant_m for c in curves(m)] for m in maps(only(cant_sd_m=0.003))]) - [0.08, 0.05]
    assert_sd(off, 0.003, off.size)
    assert abs(np.corrcoef(off.T)[0, 1]) < 4.0 / np.sqrt(DRAWS)


def test_radius_of_curves() -> None:
    bend = np.array([[1.0 / c.radius_m for c in curves(m)] for m in maps(only(radius_relative_sd=0.01))])
    assert_sd(bend / [1.0 / 400.0, -1.0 / 600.0] - 1.0, 0.01, bend.size)


def test_the_error_of_a_curve_is_one_of_its_curvature_and_apart_from_that_of_its_cant() -> None:
    """Twice the size is twice the error, to the bit of rounding: of a radius it would not be."""
    small, large = (
        np.array(
            [1.0 / c.radius_m for c in curves(draw_map(LINE, only(radius_relative_sd=sd), seed=3, draw=0))]
        )
        for sd in (0.1, 0.2)
    )
    right = np.array([1.0 / 400.0, -1.0 / 600.0])
    np.testing.assert_allclose(large - right, 2.0 * (small - right), rtol=1e-12)
    both = [curves(m) for m in maps(only(radius_relative_sd=0.01, cant_sd_m=0.003))]
    bend = np.array([[1.0 / c.radius_m for c in own] for own in both]) / right - 1.0
    cant = np.array([[c.cant_m for c in own] for own in both]) - [0.08, 0.05]
    assert abs(np.corrcoef(bend.ravel(), cant.ravel())[0, 1]) < 4.0 / np.sqrt(bend.size)


def test_cant_that_stands_beside_the_plan_errs_as_that_of_its_curve_does() -> None:
    """More cant raises the right rail in a curve to the left, the left rail in one to the right."""
    level = [(300.0, 0.0), (360.0, -0.08), (560.0, -0.08), (620.0, 0.0)]
    level += [(850.0, 0.05), (1000.0, 0.05), (1080.0, 0.0)]
    plan = tuple(replace(e, cant_m=0.0) if isinstance(e, Curve) else e for e in LINE.elements)
    beside = replace(LINE, elements=plan, cant_stations=tuple(CantStation(*station) for station in level))
    errors = only(cant_sd_m=0.003)
    found = np.array([s.cross_slope_m for s in draw_map(beside, errors, seed=3, draw=0).cant_stations])
    left, right = np.array([c.cant_m for c in curves(draw_map(LINE, errors, seed=3, draw=0))]) - [0.08, 0.05]
    off = found - [cross for _, cross in level]
    np.testing.assert_allclose(off, [0.0, -left, -left, 0.0, right, right, 0.0], atol=1.1e-6)


def test_places_of_joints() -> None:
    lengths = np.array([[e.length_m for e in m.elements] for m in maps(only(place_sd_m=0.5))])
    joints = np.cumsum(lengths, axis=1)[:, :-1] - np.cumsum([e.length_m for e in LINE.elements])[:-1]
    assert_sd(joints, 0.5, joints.size)
    np.testing.assert_allclose(lengths.sum(axis=1), LINE.length_m)


def test_slopes_of_gradients() -> None:
    at = np.array([250.0, 800.0, 1400.0])
    slope = lambda track: -np.tan(track.frame(at).pitch_rad)  # noqa: E731
    off = np.array([slope(m) for m in maps(only(gradient_sd=2e-4))]) - slope(LINE)
    # heights are rounded to 1 um over 5 m
    assert_sd(off, 2e-4, off.size)
    assert abs(np.corrcoef(off.T) - np.eye(3)).max() < 4.0 / np.sqrt(DRAWS)


def test_cant_that_wanders_has_its_size_and_its_correlation() -> None:
    errors = only(cant_along_sd_m=0.001, cant_along_length_m=100.0)
    cants = np.array([np.sin(m.frame(S).roll_rad) - np.sin(LINE.frame(S).roll_rad) for m in maps(errors)])
    cants *= LINE.rail_base_m
    # 1600 m hold about 1600/(2 * 100) independent values in each draw.
    assert_sd(cants, 0.001, DRAWS * 8)
    for lag_m, rho in ((100.0, np.exp(-1.0)), (5.0, None), (400.0, 0.0)):
        k = round(lag_m / 5.0)
        measured = np.mean(cants[:, :-k] * cants[:, k:]) / np.mean(cants**2)
        if rho is None:  # (1 + w d) exp(-w d), w = 2.1462/100
            rho = (1.0 + 0.107310) * np.exp(-0.107310)
        assert measured == pytest.approx(rho, abs=4.0 / np.sqrt(DRAWS * 8))


def test_chainage_shifts_and_stretches_what_lies_between_the_ends() -> None:
    joint = lambda m: np.cumsum([e.length_m for e in m.elements])[:-1]  # noqa: E731
    laid = joint(LINE)
    shift = np.array([joint(m) - laid for m in maps(only(chainage_offset_sd_m=2.0))])
    np.testing.assert_allclose(shift - shift[:, :1], 0.0, atol=1e-9)
    assert_sd(shift[:, 0], 2.0, DRAWS)
    scale = np.array([joint(m) / laid - 1.0 for m in maps(only(chainage_scale_sd=1e-3))])
    np.testing.assert_allclose(scale - scale[:, :1], 0.0, atol=1e-9)
    assert_sd(scale[:, 0], 1e-3, DRAWS)


@pytest.mark.parametrize("name", [field.name for field in fields(MapErrors) if "length" not in field.name])
def test_a_kind_of_error_has_a_stream_of_its_own(name: str) -> None:
    """With another kind set to zero, what remains errs as before."""
    others = {field.name for field in fields(MapErrors)} - {name, "cant_along_length_m"}
    all_kinds = replace(MapErrors(), chainage_scale_sd=1e-4, chainage_offset_sd_m=0.5)
    whole = draw_map(LINE, all_kinds, seed=5, draw=7)
    alone = draw_map(LINE, replace(all_kinds, **dict.fromkeys(others, 0.0)), seed=5, draw=7)
    if name == "cant_sd_m":
        assert [c.cant_m for c in curves(whole)] == [c.cant_m for c in curves(alone)]
    elif name == "radius_relative_sd":
        assert [c.radius_m for c in curves(whole)] == [c.radius_m for c in curves(alone)]
    elif name in ("cant_along_sd_m", "gradient_sd"):
        assert whole.deviation is not None and alone.deviation is not None
        row = "cant_m" if name == "cant_along_sd_m" else "height_m"
        assert getattr(whole.deviation, row) == getattr(alone.deviation, row)
    assert draw_map(LINE, all_kinds, seed=5, draw=7) == whole
    assert draw_map(LINE, all_kinds, seed=5, draw=8) != whole != draw_map(LINE, all_kinds, seed=6, draw=7)


def defect(kind: str, at_m: float, **sizes: float) -> TrackDesign:
    return draw_map(LINE, EXACT, seed=1, draw=0, defects=[MapDefect(kind, at_m, **sizes)])  # type: ignore[arg-type]


def test_a_missing_transition_steps_in_its_middle_and_turns_as_much() -> None:
    known = defect("missing_transition", 330.0)
    curvature = known.curvature(np.array([329.0, 331.0]))
    np.testing.assert_allclose(curvature, [0.0, 1.0 / 400.0])
    assert known.frame(1600.0).yaw_rad == pytest.approx(LINE.frame(1600.0).yaw_rad, abs=1e-12)


def test_a_straightened_transition_steps_at_its_end() -> None:
    known = defect("straightened_transition", 330.0)
    np.testing.assert_allclose(known.curvature(np.array([358.9, 360.1])), [0.0, 1.0 / 400.0])
    # 30 m less of the arc, but for the metre that the step takes.
    short = (60.0 - 1.0) / 2.0 / 400.0
    assert LINE.frame(1600.0).yaw_rad - known.frame(1600.0).yaw_rad == pytest.approx(short, abs=1e-12)


def test_a_coarse_curve_turns_as_much_and_is_off_by_the_chord_in_its_ends_only() -> None:
    known = defect("coarse_curve", 450.0, size_m=20.0)
    # A vertex is an arc of 10 mm: a quarter of it too much at either end, where the curvature is 1e-4.
    assert known.frame(1600.0).yaw_rad == pytest.approx(LINE.frame(1600.0).yaw_rad, abs=1e-6)
    off = np.abs(known.curvature(S) - LINE.curvature(S))
    # A clothoid is linear, so the mean over a chord is off only about its corners: by kappa'/8 of a chord.
    assert off[(S > 380.0) & (S < 540.0)].max() < 1e-9
    assert 0.5 < off.max() / (1.0 / 400.0 / 60.0 * 20.0 / 8.0) < 1.1
    vertices = np.arange(300.0, 621.0, 20.0)
    cant = np.sin(known.frame(vertices).roll_rad) - np.sin(LINE.frame(vertices).roll_rad)
    np.testing.assert_allclose(LINE.rail_base_m * cant, 0.0, atol=1e-6)  # rounded to 1 um


def test_a_settled_place_lies_higher_on_the_map() -> None:
    known = defect("settled", 900.0, size_m=0.02, length_m=60.0)
    off = known.frame(S).position[:, 2] - LINE.frame(S).position[:, 2]
    assert off[S == 900.0] == pytest.approx(0.02, abs=1e-5)
    np.testing.assert_allclose(off[np.abs(S - 900.0) >= 30.0], 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "at_m", "words"),
    [
        ("missing_transition", 100.0, "in a transition for missing_transition; there is a straight"),
        ("coarse_curve", 330.0, "in a curve for coarse_curve; there is a transition"),
        ("settled", 900.0, "length_m"),
        ("missing_transition", 5000.0, "is not on track"),
    ],
)
def test_a_defect_at_the_wrong_place_is_refused(kind: str, at_m: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        defect(kind, at_m)


def test_sizes_that_are_none_are_refused() -> None:
    for name, value in (("cant_sd_m", -0.001), ("radius_relative_sd", np.nan), ("cant_along_length_m", 1.0)):
        with pytest.raises(InputError, match=name):
            draw_map(LINE, replace(MapErrors(), **{name: value}), seed=1, draw=0)
    with pytest.raises(InputError, match="chainage_offset_sd_m"):
        [draw_map(LINE, only(chainage_offset_sd_m=200.0), seed=2, draw=draw) for draw in range(20)]


def test_a_map_is_a_track_file() -> None:
    known = draw_map(LINE, MapErrors(), seed=4, draw=1, defects=[MapDefect("coarse_curve", 450.0, 20.0)])
    read = judge(TrackFile, parse_toml(track_text(known), file="map.toml"), file="map.toml").design("map")
    assert read == known
    assert TrackDesign.from_dict(known.to_dict()) == known


def test_a_map_holds_plain_numbers() -> None:
    """A recording is told by its repr, which a file must give again."""
    assert "np.float64" not in repr(draw_map(LINE, MapErrors(), seed=3, draw=0))


def test_a_long_line_may_have_a_wrong_height_of_metres() -> None:
    """A slope that is wrong by 0.2 permil, over 20 km."""
    long = TrackDesign("long", 0.0, (Straight(20000.0),))
    ends = [draw_map(long, only(gradient_sd=2e-4), seed=3, draw=k).deviation for k in range(20)]
    heights = np.array([end.height_m[-1] for end in ends if end is not None])
    assert_sd(heights, 4.0, 20)
    assert np.abs(heights).max() > 1.0
