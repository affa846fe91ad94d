"""Discrete defects: shapes in closed form, smoothness, sides and signs, and that laid rails hold them."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.track.defects import FORMS, Defect, shortest_wave_m
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import knot_step_m, lay

TRACK = TrackDesign("straight", -20.0, (Straight(220.0),))
U = np.linspace(0.0, 1.0, 2001)


def defect(form: str, **options: object) -> Defect:
    values: dict[str, object] = {"at_m": 50.0, "length_m": 6.0, "size_m": 0.02, **options}
    return Defect(form=form, **values)  # type: ignore[arg-type]


def laid(*defects: Defect, spectrum: str = "none"):
    return lay(TRACK, Irregularity(spectrum, (1.5, 100.0), fade_m=20.0, defects=defects), seed=3)


def test_a_dip_is_a_wave_of_a_cosine() -> None:
    # The dip that a coach is sent over in a curve of R150: 20 mm over 6 m, out and back.
    expected = -0.01 * (1.0 - np.cos(2.0 * np.pi * U))
    found = defect("dip").deviations(50.0 + 6.0 * U)
    assert np.abs(found[:, 1] - expected).max() < 1e-15
    assert found[1000, 1] == pytest.approx(-0.020, abs=1e-15)
    assert not found[:, [0, 2]].any()
    assert np.array_equal(found[:, 1], found[:, 3])


def test_a_ramp_is_straight_between_its_bends() -> None:
    shape = defect("ramp").shape(50.0 + 6.0 * U)
    straight = (U >= 0.2) & (U <= 0.8)
    # A fifth of it bends at each end, with half of the slope in the mean: the slope is 1/(1 - 1/5).
    assert np.abs(shape[straight] - (0.5 + (U[straight] - 0.5) / 0.8)).max() < 1e-14
    # In the first bend the slope is the cubic smooth step of 5 u over 0.8; integrated here by quadrature.
    bend = 5.0 * U[:401]
    slope = bend**2 * (3.0 - 2.0 * bend) / 0.8
    integral = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2.0 * np.diff(U[:401]))])
    assert np.abs(shape[:401] - integral).max() < 1e-6
    assert np.abs(shape + shape[::-1] - 1.0).max() < 1e-14


def test_a_step_is_a_quintic_and_a_joint_two_parabolas_to_a_point() -> None:
    shape = defect("step").shape(50.0 + 6.0 * U)
    assert np.abs(shape - (6.0 * U**5 - 15.0 * U**4 + 10.0 * U**3)).max() < 1e-14
    shape = defect("joint").shape(50.0 + 6.0 * U)
    assert shape.max() == pytest.approx(1.0) == shape[1000]
    # (1 - v)^2 outside of a tenth; within it the parabola that goes on with its slope, 0.9 high.
    v = np.abs(2.0 * U - 1.0)
    assert np.abs(shape - (1.0 - v) ** 2 / 0.9)[v >= 0.1].max() < 1e-14
    assert np.abs(shape - (0.9 - 9.0 * v**2) / 0.9)[v <= 0.1].max() < 1e-14


@pytest.mark.parametrize("form", FORMS)
def test_slopes_are_continuous(form: str) -> None:
    h = 1e-4
    s = np.arange(49.0, 64.0, h)
    slope = (
        np.diff(defect(form, **({"hold_m": 1.0} if form in ("ramp", "step", "twist") else {})).shape(s)) / h
    )
    # From sample to sample by no more than the greatest bend of any form: 2 (2/L)^2 9/0.9 of a joint.
    assert np.abs(np.diff(slope)).max() < 1.01 * 2.0 * (2.0 / 6.0) ** 2 * 10.0 * h
    assert slope[0] == slope[-1] == 0.0


def test_ramps_steps_and_twists_stay_or_return() -> None:
    for form in ("ramp", "step", "twist"):
        stays = defect(form).shape(np.array([49.9, 56.0, 60.0, 190.0]))
        assert stays.tolist() == [0.0, 1.0, 1.0, 1.0]
        held = defect(form, hold_m=10.0)
        assert held.end_m == 72.0
        assert (
            np.abs(held.shape(np.array([56.0, 66.0, 69.0, 72.0, 190.0])) - [1.0, 1.0, 0.5, 0.0, 0.0]).max()
            < 1e-14
        )


@pytest.mark.parametrize("form", ["ramp", "dip"])
@pytest.mark.parametrize(
    ("direction", "columns"), [("lateral", {"left": 0, "right": 2}), ("vertical", {"left": 1, "right": 3})]
)
@pytest.mark.parametrize("rails", ["left", "right", "both"])
def test_rails_and_directions(form: str, direction: str, columns: dict[str, int], rails: str) -> None:
    found = defect(form, direction=direction, rails=rails).deviations(np.array([53.0]))[0]
    # Halfway: a ramp has half of its size, up or left; a dip all of it, down or right.
    expected = np.zeros(4)
    expected[list(columns.values()) if rails == "both" else columns[rails]] = (
        0.01 if form == "ramp" else -0.02
    )
    assert np.abs(found - expected).max() < 1e-15


def test_a_twist_is_a_cross_level() -> None:
    frame = laid(defect("twist", length_m=12.0, size_m=0.024)).irregularities(
        np.array([49.0, 56.0, 70.0, 190.0])
    )
    assert frame["cross_level_m"].to_numpy() == pytest.approx([0.0, 0.012, 0.024, 0.024], abs=1e-9)
    assert np.abs(frame.drop(columns="cross_level_m").to_numpy()).max() < 1e-9
    # Between the bends 24 mm over 0.8 * 12 m: 2.5 mm per m.
    level = laid(defect("twist", length_m=12.0, size_m=0.024)).irregularities(np.array([54.5, 57.5]))[
        "cross_level_m"
    ]
    assert np.diff(level)[0] / 3.0 == pytest.approx(2.5e-3, rel=1e-6)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("length", [0.25, 1.0, 6.0])
def test_laid_rails_hold_the_shapes(form: str, length: float) -> None:
    one = defect(form, at_m=50.033, length_m=length, size_m=0.01)
    s = np.linspace(45.0, 60.0, 30001)
    # Splines carry waves with a point in eight to 0.2 % of the amplitude; a bend that begins at once, to 1 %.
    assert np.abs(laid(one).rails(s) - one.deviations(s)).max() < 0.01 * 0.01


def test_defects_add_to_each_other_and_to_a_spectrum() -> None:
    s = np.linspace(-20.0, 200.0, 4001)
    first, second = defect("dip"), defect("ramp", at_m=52.0, direction="lateral", rails="left")
    drawn = laid(spectrum="erri_b176_low").rails(s)
    assert np.abs(drawn).max() > 1e-3
    both = laid(first, second, spectrum="erri_b176_low").rails(s)
    alone = laid(first).rails(s) + laid(second).rails(s)
    assert np.abs(both - drawn - alone).max() < 1e-15


def test_short_defects_have_finer_knots() -> None:
    def step(*defects: Defect) -> float:
        return knot_step_m(Irregularity(defects=defects))

    assert step() == 0.125 == step(defect("dip", length_m=1.0))
    assert step(defect("dip", length_m=0.5)) == 0.0625
    assert step(defect("joint", length_m=1.0)) == 0.125 / 8


@pytest.mark.parametrize(
    ("form", "options", "field"),
    [
        ("bump", {}, "form"),
        ("dip", {"length_m": 0.1}, "length_m"),
        ("dip", {"length_m": float("nan")}, "length_m"),
        ("dip", {"size_m": 20.0}, "size_m"),
        ("dip", {"size_m": 0.0}, "size_m"),
        ("dip", {"hold_m": 1.0}, "hold_m"),
        ("ramp", {"hold_m": -1.0}, "hold_m"),
        ("twist", {"rails": "left"}, "rails"),
        ("twist", {"direction": "lateral"}, "direction"),
        ("dip", {"at_m": -21.0}, "at_m"),
        ("dip", {"at_m": 195.0}, "at_m"),
        ("dip", {"at_m": float("nan")}, "at_m"),
        ("ramp", {"at_m": 150.0, "hold_m": 40.0}, "at_m"),
    ],
)
def test_what_cannot_be_is_refused(form: str, options: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as caught:
        laid(defect("dip"), defect(form, **options))
    assert caught.value.field == f"defect[1].{field}"


def test_rails_are_as_fine_as_the_sharpest_of_their_defects_asks_for() -> None:
    """A ramp of 10 m bends over 4 m, the point of a joint of 1 m over a fifth of one."""
    ramp, joint = Defect("ramp", 100.0, 10.0, 0.01), Defect("joint", 300.0, 1.0, 0.002)
    assert [shortest_wave_m(pair) for pair in ((ramp, joint), (joint, ramp), (ramp,))] == [0.2, 0.2, 4.0]
    fine, coarse = (knot_step_m(Irregularity(defects=d)) for d in ((ramp, joint), (ramp,)))
    assert fine <= 0.2 / 8.0 < coarse
