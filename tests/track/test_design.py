"""The design track against closed forms, finite differences and a symbolic derivation."""

from __future__ import annotations

import functools
import json
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.track.design import (
    CURVE,
    STRAIGHT,
    TRANSITION,
    Curve,
    Element,
    Gradient,
    Straight,
    TrackDesign,
    TrackFrame,
    Transition,
)

LEFT_AND_RIGHT = TrackDesign(
    "left and right",
    -30.0,
    (
        Straight(60.0),
        Transition(40.0),
        Curve(50.0, 200.0, 0.11),
        Transition(55.0),
        Curve(70.0, -150.0, 0.09),
        Transition(35.0),
        Straight(90.0),
    ),
    gradients=(Gradient(-30.0, 0.012), Gradient(75.0, -0.025), Gradient(210.0, 0.03)),
    vertical_radius_m=(1200.0, 900.0),
)


@st.composite
def designs(draw: st.DrawFn) -> TrackDesign:
    """Any alternation of curves and straights, S-curves included, with up to three gradients."""
    length = st.floats(10.0, 120.0)
    start = draw(st.floats(-500.0, 500.0))
    elements: list[Element] = [Straight(draw(length))]
    for _ in range(draw(st.integers(1, 4))):
        elements.append(Transition(draw(st.floats(15.0, 80.0))))
        radius = draw(st.floats(80.0, 3000.0)) * draw(st.sampled_from([-1.0, 1.0]))
        elements.append(Curve(draw(length), radius, draw(st.floats(-0.05, 0.18))))
        if draw(st.booleans()):
            elements += [Transition(draw(st.floats(15.0, 80.0))), Straight(draw(length))]
    slopes = draw(st.lists(st.floats(-0.04, 0.04), max_size=3))
    total = sum(element.length_m for element in elements)
    # 0.08 x 150 m = 12 m of vertical curve at most, and a ramp: it fits into an eighth of the track.
    gradients = tuple(Gradient(start + total * (i + 1) / 4, slope) for i, slope in enumerate(slopes))
    return TrackDesign(
        "drawn",
        start,
        tuple(elements),
        gradients=gradients,
        vertical_radius_m=min(150.0, total),
        vertical_ramp_m=draw(st.sampled_from([0.0, 1.0])),
        cant_ramp=draw(st.sampled_from(["smooth", "linear"])),
        rail_base_m=draw(st.sampled_from([1.5, 1.0, 1.8])),
        start_yaw_rad=draw(st.floats(-3.0, 3.0)),
    )


properties = settings(max_examples=40, deadline=None, derandomize=True)


def joints(design: TrackDesign) -> np.ndarray:
    """Places where a derivative may step: joints of elements, ends and ramps of vertical curves."""
    plan = design.start_m + np.cumsum([element.length_m for element in design.elements])[:-1]
    z = design._shape.height.x
    return np.unique(np.concatenate([plan, z[(z > design.start_m) & (z < design.end_m)]]))


def between_joints(design: TrackDesign, n: int, margin: float) -> np.ndarray:
    """About n places that keep a distance from every joint and from both ends."""
    s = np.linspace(design.start_m + margin, design.end_m - margin, n)
    near = np.abs(s[:, None] - joints(design)[None, :]).min(axis=1)
    return s[near > margin]


def rotation(frame: TrackFrame) -> np.ndarray:
    """Rz Ry Rx, written out from the elementary rotations; (n, 3, 3)."""

    def about(axis: int, angle: np.ndarray) -> np.ndarray:
        matrix = np.zeros((angle.size, 3, 3))
        matrix[:, axis, axis] = 1.0
        i, j = (axis + 1) % 3, (axis + 2) % 3
        matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
        matrix[:, i, j], matrix[:, j, i] = -np.sin(angle), np.sin(angle)
        return matrix

    return about(2, frame.yaw_rad) @ about(1, frame.pitch_rad) @ about(0, frame.roll_rad)


def slope_of(function: Callable[[np.ndarray], np.ndarray], s: np.ndarray, h: float) -> np.ndarray:
    """Fourth-order central difference."""
    near, far = function(s + h) - function(s - h), function(s + 2 * h) - function(s - 2 * h)
    return (8.0 * near - far) / (12.0 * h)


@properties
@given(designs())
def test_s_is_the_arc_length_of_the_horizontal_projection(design: TrackDesign) -> None:
    s = np.linspace(design.start_m, design.end_m, 20001)
    chords = np.hypot(*np.diff(design.frame(s).position[:, :2], axis=0).T)
    # A chord over h on an arc of curvature c is shorter than the arc by c^2 h^3 / 24.
    h = s[1] - s[0]
    arcs = chords + np.interp(s[1:] - h / 2, s, design.curvature(s)) ** 2 * h**3 / 24.0
    assert arcs.sum() == pytest.approx(design.length_m, abs=2e-9)


@properties
@given(designs())
def test_nothing_steps_at_a_joint(design: TrackDesign) -> None:
    places, eps = joints(design), 1e-9
    before, after = design.frame(places - eps), design.frame(places + eps)
    assert np.abs(after.position - before.position).max() < 2 * eps * 1.01 + 1e-11
    for angle in ("roll_rad", "pitch_rad", "yaw_rad"):
        assert np.abs(getattr(after, angle) - getattr(before, angle)).max() < 1e-9
    assert np.abs(after.rates - before.rates)[:, 2].max() < 1e-9  # curvature
    if design.cant_ramp == "smooth" and design.vertical_ramp_m > 0.0:
        assert np.abs(after.k - before.k).max() < 1e-9
        assert np.abs(after.second - before.second)[:, :2].max() < 1e-6


@properties
@given(designs(), st.integers(0, 10**6))
def test_scalar_equals_vector_equals_any_shape(design: TrackDesign, seed: int) -> None:
    s = np.random.default_rng(seed).uniform(design.start_m, design.end_m, 6)
    together, reshaped = design.frame(s), design.frame(s.reshape(2, 3))
    for i in range(6):
        alone = design.frame(float(s[i]))
        for one, all_, grid in zip(alone, together, reshaped, strict=True):
            # Not bit by bit: numpy computes sines of one and of many by different code.
            np.testing.assert_allclose(one, all_[i], rtol=1e-12, atol=1e-15)
            np.testing.assert_allclose(one, grid[divmod(i, 3)], rtol=1e-12, atol=1e-15)
        assert design.kind(s[i]) == design.kind(s)[i]
        assert design.curvature(s[i]) == pytest.approx(together.rates[i, 2], rel=1e-12, abs=1e-15)


def mirrored(design: TrackDesign) -> TrackDesign:
    """The same track with left and right exchanged (y -> -y)."""
    x, y, z = design.start_position_m
    return replace(
        design,
        elements=tuple(
            replace(part, radius_m=-part.radius_m) if isinstance(part, Curve) else part
            for part in design.elements
        ),
        start_position_m=(x, -y, z),
        start_yaw_rad=-design.start_yaw_rad,
    )


@properties
@given(designs())
def test_mirrored_track_gives_the_mirrored_frame(design: TrackDesign) -> None:
    s = np.linspace(design.start_m, design.end_m, 301)
    here, there = design.frame(s), mirrored(design).frame(s)
    assert np.array_equal(there.position, here.position * [1, -1, 1])
    assert np.array_equal(there.roll_rad, -here.roll_rad)
    assert np.array_equal(there.pitch_rad, here.pitch_rad)
    assert np.array_equal(there.yaw_rad, -here.yaw_rad)
    assert np.array_equal(there.k, here.k * [-1, 1, -1])
    assert np.array_equal(there.dk, here.dk * [-1, 1, -1])
    assert mirrored(mirrored(design)) == design


@properties
@given(designs())
def test_the_frame_is_the_derivative_of_the_position(design: TrackDesign) -> None:
    s = between_joints(design, 400, 0.01)
    frame = design.frame(s)
    tangent = slope_of(lambda x: design.frame(x).position, s, 2e-3)
    assert np.abs(np.hypot(tangent[:, 0], tangent[:, 1]) - 1.0).max() < 1e-9
    x_axis = rotation(frame)[:, :, 0]
    assert np.abs(tangent - x_axis / np.cos(frame.pitch_rad)[:, None]).max() < 1e-9


@properties
@given(designs())
def test_rates_and_curvatures_against_finite_differences(design: TrackDesign) -> None:
    h = 2e-3
    s = between_joints(design, 400, 5 * h)
    frame = design.frame(s)
    angles = slope_of(
        lambda x: np.column_stack([(f := design.frame(x)).roll_rad, f.pitch_rad, f.yaw_rad]), s, h
    )
    assert np.abs(angles - frame.rates).max() < 1e-10
    assert np.abs(slope_of(lambda x: design.frame(x).rates, s, h) - frame.second).max() < 1e-8
    # C^T C' = [k]x
    turn = np.swapaxes(rotation(frame), 1, 2) @ slope_of(lambda x: rotation(design.frame(x)), s, h)
    k = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=-1)
    assert np.abs(k - frame.k).max() < 1e-10
    assert np.abs(slope_of(lambda x: design.frame(x).k, s, h) - frame.dk).max() < 1e-8


@functools.cache
def darboux_by_sympy() -> Callable[..., list[np.ndarray]]:
    """k and k' of a ZYX frame, derived from its rotation matrix."""
    s = sympy.Symbol("s")
    roll, pitch, yaw = (sympy.Function(name)(s) for name in ("roll", "pitch", "yaw"))
    # sympy's rot_axis matrices rotate the axes, hence the transposes.
    matrix = sympy.rot_axis3(yaw).T * sympy.rot_axis2(pitch).T * sympy.rot_axis1(roll).T
    turn = matrix.T * matrix.diff(s)
    k = [turn[2, 1], turn[0, 2], turn[1, 0]]
    everything = [*k, *(component.diff(s) for component in k)]
    symbols = []
    for order in (2, 1, 0):
        for function in (roll, pitch, yaw):
            symbol = sympy.Symbol(f"{function.func}_{order}")
            symbols.append(symbol)
            term = function.diff(s, order) if order else function
            everything = [expression.subs(term, symbol) for expression in everything]
    return sympy.lambdify(symbols, everything)


def test_curvatures_against_the_symbolic_derivation() -> None:
    s = np.linspace(LEFT_AND_RIGHT.start_m, LEFT_AND_RIGHT.end_m, 2001)
    frame = LEFT_AND_RIGHT.frame(s)
    derived = darboux_by_sympy()(
        *frame.second.T, *frame.rates.T, frame.roll_rad, frame.pitch_rad, frame.yaw_rad
    )
    assert np.abs(frame.k.T - np.stack(derived[:3])).max() < 1e-16
    assert np.abs(frame.dk.T - np.stack(derived[3:])).max() < 1e-16
    # The test has something to see: every coupling of the angles is at work.
    assert np.abs(frame.k).max(axis=0).min() > 1e-4
    assert np.abs(frame.dk).max(axis=0).min() > 1e-5


@pytest.mark.parametrize("place", [-30.001, 370.5, np.nan, np.inf])
def test_off_the_track_is_an_error_that_names_place_and_limits(place: float) -> None:
    for method in (LEFT_AND_RIGHT.frame, LEFT_AND_RIGHT.kind, LEFT_AND_RIGHT.curvature):
        with pytest.raises(InputError) as caught:
            method(np.array([0.0, place, 10.0]))
        message = str(caught.value)
        assert f"{place:g} m" in message
        assert "between -30 and 370 m" in message
        assert "left and right" in message
    assert LEFT_AND_RIGHT.frame(np.array([-30.0, 370.0])).s_m.shape == (2,)


def test_kind_segment_and_their_names() -> None:
    ends = np.array([-30.0, 29.9, 30.0, 70.0, 120.0, 175.0, 245.0, 280.0, 370.0])
    assert LEFT_AND_RIGHT.kind(ends).tolist() == [
        STRAIGHT,
        STRAIGHT,
        TRANSITION,
        CURVE,
        TRANSITION,
        CURVE,
        TRANSITION,
        STRAIGHT,
        STRAIGHT,
    ]
    assert LEFT_AND_RIGHT.kind(ends).dtype == np.int8
    assert LEFT_AND_RIGHT.segment(ends).tolist() == [0, 0, 1, 2, 3, 4, 5, 6, 6]
    assert LEFT_AND_RIGHT.segment_name(4) == "curve 5 R-150"
    assert LEFT_AND_RIGHT.segment_name(1) == "transition 2"


@properties
@given(designs())
def test_plain_data_and_back(design: TrackDesign) -> None:
    again = TrackDesign.from_dict(json.loads(json.dumps(design.to_dict())))
    assert again == design
    assert hash(again) == hash(design)
    assert pickle.loads(pickle.dumps(design)) == design


def test_start_position_and_yaw_move_the_whole_line() -> None:
    s = np.linspace(-30.0, 370.0, 101)
    here = LEFT_AND_RIGHT.frame(s)
    moved = replace(LEFT_AND_RIGHT, start_position_m=(100.0, -20.0, 7.0), start_yaw_rad=0.7).frame(s)
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    assert np.abs(moved.position - (here.position @ turn.T + [100.0, -20.0, 7.0])).max() < 1e-12
    assert np.abs(moved.yaw_rad - here.yaw_rad - 0.7).max() < 1e-15
    assert np.array_equal(moved.k, here.k)
    assert here.position[0].tolist() == [0.0, 0.0, 0.0]
    assert here.yaw_rad[0] == 0.0


def test_a_design_is_not_worked_on_before_it_is_used() -> None:
    assert TrackDesign("nonsense", 0.0, (Transition(-1.0),)).name == "nonsense"


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"gradients": (Gradient(50.0, 0.02), Gradient(60.0, -0.02))}, "gradient"),
        ({"gradients": (Gradient(5.0, 0.02),)}, "gradient"),
        ({"gradients": (Gradient(90.0, 0.02),)}, "gradient"),
        ({"gradients": (Gradient(60.0, 0.0), Gradient(50.0, 0.0))}, "gradient[1].from_m"),
        ({"gradients": (Gradient(120.0, 0.0),)}, "gradient[0].from_m"),
        ({"gradients": (Gradient(50.0, 20.0),)}, "gradient[0].slope"),
        ({"gradients": (Gradient(50.0, 0.01),), "vertical_radius_m": -1.0}, "vertical_radius_m"),
        ({"gradients": (Gradient(50.0, 0.01),), "vertical_radius_m": (900.0, 900.0)}, "vertical_radius_m"),
        ({"vertical_ramp_m": -1.0}, "vertical_ramp_m"),
        ({"cant_ramp": "cosine"}, "cant_ramp"),
        ({"rail_base_m": 1500.0}, "rail_base_m"),
        ({"rail_base_m": float("nan")}, "rail_base_m"),
        ({"start_m": float("nan")}, "start_m"),
    ],
)
def test_what_makes_no_line_is_refused(options: dict[str, object], field: str) -> None:
    values: dict[str, object] = {"name": "bad", "start_m": 0.0, "elements": (Straight(100.0),), **options}
    with pytest.raises(InputError) as caught:
        TrackDesign(**values).check()  # type: ignore[arg-type]
    assert caught.value.field == field
