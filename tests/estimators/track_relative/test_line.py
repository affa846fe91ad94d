"""The map under a body: against the design track, chords in closed form, and a map with joints moved."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from simrail.estimators.odometry.line_table import PLACES_PER_M
from simrail.estimators.track_relative.line import ground_at, lines_of, numbers_at
from simrail.estimators.track_relative.states import S

from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import SheetBody, Support, VehicleSheet
from simrail.track.alignment import element_starts
from simrail.track.design import Curve, Gradient, Straight, Transition

COACH = VehicleSheet(
    (
        SheetBody("front axle", 5.0),
        SheetBody("rear axle", -4.0),
        SheetBody("body", 0.0, (Support("rear axle", -4.0), Support("front axle", 5.0))),
    )
)
"""A body on two axles, of which the middle is half a metre before its reference point."""


def at(recording: Recording, place: float) -> int:
    return round((place - recording.track.start_m) * 4.0)


def test_the_ground_is_the_track_under_the_mount(exact_bend: Recording) -> None:
    place = np.array([45.0, 81.3, 130.0, 190.2, 300.0])
    ground, frame = ground_at(exact_bend, lines_of(exact_bend), place), exact_bend.track.frame(place)
    for found, wanted in ((ground.k, frame.k), (ground.dk, frame.dk), (ground.up, frame.rotation[:, 2, :])):
        np.testing.assert_allclose(np.column_stack([part.value for part in found]), wanted, atol=1e-15)
    # Without a drawing a body points where the track does, and follows it eased: roll'' (1.5 m)^2/2 or less.
    for askew in (*ground.askew, *ground.askew_slope):
        np.testing.assert_allclose(askew.value, 0.0, atol=1e-15)
    np.testing.assert_allclose(ground.bend[0].value, frame.rates[:, 2], atol=1e-7)
    np.testing.assert_allclose(ground.lean[0].value, frame.roll_rad, atol=3e-4)
    np.testing.assert_allclose(ground.dip[0].value, frame.rates[:, 1], atol=1e-7)


def test_beyond_its_ends_the_map_is_as_at_its_ends(exact_bend: Recording) -> None:
    lines, track = lines_of(exact_bend), exact_bend.track
    beyond = ground_at(exact_bend, lines, np.array([track.start_m - 5.0, track.end_m + 9.0]))
    ends = ground_at(exact_bend, lines, np.array([track.start_m, track.end_m]))
    np.testing.assert_array_equal(beyond.frame.yaw_rad, ends.frame.yaw_rad)
    np.testing.assert_array_equal(beyond.bend[0].value, ends.bend[0].value)


def test_a_share_of_the_cant_is_one_in_a_curve_and_none_on_a_straight(exact_bend: Recording) -> None:
    canted = lines_of(exact_bend).canted
    for place, share in ((30.0, 0.0), (130.0, 1.0), (210.0, 0.0), (300.0, 1.0), (450.0, 0.0)):
        assert canted[at(exact_bend, place)] == pytest.approx(share, abs=1e-12)
    assert canted[at(exact_bend, 80.0)] == pytest.approx(0.5, abs=0.01)  # a ramp is odd about its middle


def test_a_body_on_two_axles_is_askew_as_its_chord_says(exact_bend: Recording) -> None:
    """In a curve it points along the tangent at its middle, half a metre before the mount at 0."""
    recording = replace(exact_bend, vehicle_sheet=COACH, mount_position_m=(2.5, 0.2, 0.6))
    lines, track = lines_of(recording), recording.track
    middle = 0.5 - 2.5
    here = at(recording, 130.0)
    assert lines.askew_yaw[here] == pytest.approx(middle / 250.0, rel=1e-2)
    assert lines.bend[here] == pytest.approx(1.0 / 250.0, rel=1e-9)
    # It rolls with the mean of the track under its axles.
    for place in (65.0, 80.0, 130.0):
        under = track.frame(np.array([place + middle - 4.5, place, place + middle + 4.5]))
        ends, turned = under.roll_rad, lines.askew_yaw[at(recording, place)] * np.sin(under.pitch_rad[1])
        roll = lines.askew_roll[at(recording, place)]
        assert roll == pytest.approx(0.5 * (ends[0] + ends[2]) - ends[1] - turned, abs=5e-7)
    # On a slope that changes by 1/R its pitch is that of its middle.
    here = at(recording, 180.0)
    level = lines.askew_yaw[here] * np.sin(track.frame(np.array([180.0])).roll_rad[0])
    assert lines.askew_pitch[here] - level == pytest.approx(middle * lines.dip[here], rel=0.02)
    # Between level axles it is level itself, which the canted track beside its middle is not.
    there = at(recording, 130.0)
    track_there = track.frame(np.array([130.0, 130.0 + middle]))
    axes = [
        rotation_matrix(np.array([[roll, pitch, yaw]]))[0]
        for roll, pitch, yaw in zip(
            track_there.roll_rad, track_there.pitch_rad, track_there.yaw_rad, strict=True
        )
    ]
    turn = (axes[0].T @ axes[1] - (axes[0].T @ axes[1]).T)[[2, 0, 1], [1, 2, 0]] / 2.0
    assert abs(turn[1]) > 1e-4
    found = [lines.askew_roll[there], lines.askew_pitch[there], lines.askew_yaw[there]]
    np.testing.assert_allclose(found, turn, atol=2e-6)
    # An axle rolls with the track that it stands on, though a body points it.
    axle = lines_of(replace(recording, mount_body="front axle", mount_position_m=(0.0, 0.0, 0.5)))
    np.testing.assert_allclose(axle.askew_roll, 0.0, atol=1e-15)
    assert axle.askew_yaw[at(recording, 130.0)] == pytest.approx((0.5 - 5.0) / 250.0, rel=2e-3)


def test_a_frame_is_twisted_by_what_rests_on_it(exact_bend: Recording) -> None:
    """By the mean roll of the track under the ends of that, less the mean under its own."""
    metro = VehicleSheet(
        (
            *(SheetBody(f"axle {i}", x) for i, x in enumerate((10.0, 8.0, -8.0, -10.0))),
            SheetBody("front frame", 9.0, (Support("axle 1", -1.0), Support("axle 0", 1.0))),
            SheetBody("rear frame", -9.0, (Support("axle 3", -1.0), Support("axle 2", 1.0))),
            SheetBody("car", 0.0, (Support("rear frame", -9.0), Support("front frame", 9.0))),
        )
    )
    frame = replace(
        exact_bend, vehicle_sheet=metro, mount_body="front frame", mount_position_m=(0.4, 0.0, 1.0)
    )
    lines, track = lines_of(frame), frame.track
    for place in (75.0, 80.0, 92.0, 175.0):
        middle = place - 0.4  # of the frame; that of the car is 9 m behind
        roll = track.frame(middle + np.array([1.0, -1.0, 0.0, -18.0])).roll_rad
        wanted = 0.5 * (roll[2] + roll[3]) - 0.5 * (roll[0] + roll[1])
        assert abs(wanted) > 1e-3
        assert lines.torsion[at(frame, place)] == pytest.approx(wanted, abs=1e-12)
    for body in ("axle 0", "car"):
        assert not lines_of(replace(frame, mount_body=body)).torsion.any()
    assert not lines_of(exact_bend).torsion.any()


@pytest.mark.parametrize("joint", range(1, 5))
def test_joints_shift_curvature_and_cant(exact_bend: Recording, joint: int) -> None:
    """A track of which one joint lies elsewhere has what the weights say, to the square of the shift.

    Of that order are k' d^2/L and roll' d^2/L, and all within the shift of a joint.
    """
    shift, track = 0.2, exact_bend.track
    elements = list(track.elements)
    for i, more in ((joint - 1, shift), (joint, -shift)):
        elements[i] = replace(elements[i], length_m=elements[i].length_m + more)
    laid = replace(track, elements=tuple(elements))
    lines = lines_of(exact_bend)
    starts = element_starts(track.elements, track.start_m)
    away = np.abs(lines.places[:, None] - starts).min(axis=1) > 1.0
    places = lines.places[away]
    by, by_roll = (lines.odd, lines.odd_roll) if joint % 2 else (lines.even, lines.even_roll)
    near = (places > starts[joint - 1]) & (places < starts[joint + 1])
    before, behind = track.frame(places), laid.frame(places)
    for moved, weight, size in (
        (behind.rates[:, 2] - before.rates[:, 2], by[away], 1e-4),
        (behind.roll_rad - before.roll_rad, by_roll[away], 2e-3),
    ):
        np.testing.assert_allclose(
            moved[near], -shift * weight[near], rtol=0, atol=4.0 * size * shift**2 / 40.0 + 1e-9
        )
        assert np.abs(moved[near]).max() > 0.5 * shift * size
        np.testing.assert_allclose(moved[~near], 0.0, atol=1e-7)


def test_places_have_the_numbers_of_their_element_and_curve(exact_bend: Recording) -> None:
    lines, track = lines_of(exact_bend), exact_bend.track
    place: FloatArray = np.array([5.0, 61.0, 101.0, 199.0, 210.0, 232.0, 400.0])
    element, curve, vertical = numbers_at(lines, place)
    assert element.tolist() == [0, 1, 2, 3, 4, 5, 8]
    kinds = [Straight, Transition, Curve, Transition, Straight, Transition, Straight]
    assert [type(track.elements[i]) for i in element] == kinds
    assert curve.tolist() == [0, 0, 0, 0, 0, 1, 1]  # they are parted in the middle of the straight, at 215 m
    assert numbers_at(lines, np.array([214.0, 216.0]))[1].tolist() == [0, 1]
    # Vertical curves: R |slope behind - slope before|, half to either side of 180 m.
    assert numbers_at(lines, np.array([150.0, 156.0, 180.0, 204.0, 210.0]))[2].tolist() == [0, 1, 1, 1, 0]
    assert set(vertical.tolist()) <= {0.0, 1.0}


def test_gravity_on_the_tracks_axes_turns_with_its_cant_and_its_slope(exact_bend: Recording) -> None:
    """In a canted transition on a vertical curve, against differences of the direction itself."""
    gradients = (Gradient(0.0, 0.02), Gradient(100.0, -0.02))
    line = replace(exact_bend.track, gradients=gradients, vertical_radius_m=1500.0)
    recording = replace(exact_bend, track=line)
    place, step = np.arange(80.0, 121.0, 2.5), 1e-3
    slopes = np.column_stack([part.slopes[S] for part in ground_at(recording, lines_of(recording), place).up])
    ahead, behind = (line.frame(place + side * step).rotation[:, 2, :] for side in (1.0, -1.0))
    np.testing.assert_allclose(slopes, (ahead - behind) / (2.0 * step), atol=1e-9)
    # The share of the slope in what is across must be seen.
    frame = line.frame(place)
    tilts = np.sin(frame.pitch_rad) * np.sin(frame.roll_rad) * frame.rates[:, 1]
    assert np.abs(tilts).max() > 1e-7


def test_an_element_is_that_of_the_nearest_place_of_the_grid() -> None:
    row = np.arange(8.0)
    lines = SimpleNamespace(places=10.0 + row / PLACES_PER_M, element=row, curve=row, vertical=row)
    step = 1.0 / PLACES_PER_M
    place = 10.0 + step * np.array([-3.0, 0.4, 0.6, 3.4, 3.6, 20.0])
    for numbers in numbers_at(lines, place):  # type: ignore[arg-type]
        assert numbers.tolist() == [0, 0, 1, 3, 4, 7]
