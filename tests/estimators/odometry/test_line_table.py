"""The map as the odometry takes it: chords in closed form, and what its errors do to the heading."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simrail.estimators.odometry.line_table import Line, line_at, line_table

from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.track.elements import Gradient
from simrail.track.file import track_by_name
from simrail.track.map_errors import EXACT, draw_map

RAMP = 1.0 / (250.0 * 60.0)
LINE = TrackDesign(
    name="s",
    start_m=0.0,
    elements=(
        Straight(100.0),
        Transition(60.0),
        Curve(80.0, 250.0, 0.08),
        Transition(60.0),
        Straight(90.0),
        Transition(50.0),
        Curve(70.0, -300.0, 0.06),
        Transition(50.0),
        Straight(100.0),
    ),
)


def at(s: float, chord: Chord | None = None, mount_x_m: float = 0.0, ahead_m: float = 0.0) -> Line:
    """The table's line at a place."""
    grid, table = line_table(LINE, chord=chord, mount_x_m=mount_x_m, wheel_ahead_m=ahead_m)
    return Line(*(float(value) for value in line_at(grid, table, s)))


def test_without_a_chord_it_is_the_track():
    """Heading, curvature, roll and pitch of the design, interpolated over a quarter of a metre."""
    for s in (50.0, 131.3, 200.0, 370.2):
        frame, line = LINE.frame(np.array([s])), at(s)
        assert line.heading == pytest.approx(float(frame.yaw_rad[0]), abs=RAMP * 0.25**2)
        assert line.bend == line.curvature == pytest.approx(float(frame.rates[0, 2]), abs=1e-12)
        assert line.roll == pytest.approx(float(frame.roll_rad[0]), abs=1e-6)
        assert line.askew == 0.0


def test_chord_on_a_transition_and_on_an_arc():
    """On an arc a chord has the heading at its middle; on a transition of slope k' it has k'(a^2/6 + b^2/2)
    more: the mean of s^2/2 over its places. All of it is in the middle of the chord, not under the mount."""
    a, b, x = 9.5, 1.28, 4.0
    chord = Chord(1.0, a, b, 0.0)
    for middle, more in ((200.0, 0.0), (130.0, RAMP * (a * a / 6.0 + b * b / 2.0))):
        s = middle + x - 1.0
        line = at(s, chord, x)
        straight = float(LINE.frame(np.array([middle])).yaw_rad[0])
        # Straight lines between quarters of a metre: at most k h^2/8 in each of four integrals.
        assert line.heading - straight == pytest.approx(
            more, abs=4.0 * 0.004 * 0.25**2 / 8.0 / (4.0 * a) * 4.0
        )
        under = float(LINE.frame(np.array([s])).yaw_rad[0])
        assert line.askew == pytest.approx(straight + more - under, abs=2e-5)
    assert at(150.0, ahead_m=-20.0).curvature == pytest.approx(RAMP * 30.0, rel=1e-6)


def test_elements_and_curves_are_counted():
    """A curve's error holds from the middle of the straight before it to that of the straight behind it."""
    assert [at(s).element for s in (50.0, 101.0, 161.0, 241.0, 301.0, 391.0)] == [0, 1, 2, 3, 4, 5]
    assert [at(s).curve for s in (10.0, 340.0, 349.0, 600.0)] == [0, 0, 1, 1]


def test_elements_and_curves_are_those_under_the_middle_of_the_chord():
    """It is 5 m ahead of the mount: the joint at 300 m and the parting at 345 m are met 5 m earlier."""
    chord = Chord(7.0, 9.0, 1.0, 0.0)
    lines = [at(s, chord, 2.0) for s in (294.0, 296.0, 339.0, 341.0)]
    assert [line.element for line in lines] == [3, 4, 4, 4]
    assert [line.curve for line in lines] == [0, 0, 0, 1]
    assert at(2.0, chord, 9.0).element == 0 and at(598.0, chord, 2.0).element == 8


@pytest.mark.parametrize("kind", ["radius_relative_sd", "place_sd_m"])
def test_errors_of_the_map_in_the_heading(kind: str):
    """What a drawn map's heading lacks of the laid one is what the table says of its errors, to first order.

    Of second order are: the square of a shift of at most 1.5 m, times k'; a joint that meets a transition.
    """
    size = {"radius_relative_sd": 0.01, "place_sd_m": 0.3}[kind]
    for draw in range(3):
        known = draw_map(LINE, replace(EXACT, **{kind: size}), seed=5, draw=draw)
        grid, table = line_table(known)
        places = grid[0] + np.arange(len(table)) / grid[1]
        lines = [line_at(grid, table, s) for s in places]
        starts = [
            np.concatenate([[0.0], np.cumsum([element.length_m for element in track.elements])])
            for track in (LINE, known)
        ]
        shift = starts[0] - starts[1]
        bends = [
            laid.radius_m and mapped.radius_m / laid.radius_m - 1.0
            for laid, mapped in zip(LINE.elements, known.elements, strict=True)
            if isinstance(laid, Curve)
        ]
        beyond = []
        for line in lines:
            i = int(line.element)
            below, above = shift[i], shift[i + 1]
            even, odd = (below, above) if i % 2 == 0 else (above, below)
            beyond.append(line.bend * bends[int(line.curve)] - line.ramp_even * even - line.ramp_odd * odd)
        expected = np.concatenate([[0.0], np.cumsum(0.125 * (np.array(beyond[1:]) + np.array(beyond[:-1])))])
        found = LINE.frame(places).yaw_rad - known.frame(places).yaw_rad
        bound = 8.0 * RAMP * max(np.max(np.abs(shift)), 0.25) ** 2 + 2e-5
        assert np.max(np.abs(found - expected)) < bound
        assert np.max(np.abs(found)) > 5.0 * bound  # without the errors it fails


def test_shipped_lines_have_a_table():
    """Every element of a shipped line is in its table once, in order."""
    for name in ("condequinto_olivar", "scale_track", "smooth_curve", "level_straight"):
        track = track_by_name(name)
        _, table = line_table(track, chord=Chord(0.0, 5.0, 1.0, 0.0), mount_x_m=2.0)
        assert np.isfinite(table).all()
        assert (np.diff(table[:, 8]) >= 0.0).all()


def test_a_jointed_body_pitches_with_the_plane_of_its_section() -> None:
    """On a canted arc on a slope and on a transition: its axis lies in the plane of the section's axes.

    By rotations in full; what is left is a product of three angles (roll .05, slope .02, yaw .03).
    Pitched by itself on the arc it would be .05 times a yaw of 6.64 m over 250 m off.
    """
    section, own = Chord(-6.64, 5.8, 0.9, 0.0), Chord(-0.84, 0.9, 0.0, 0.0)
    hill = replace(LINE, gradients=(Gradient(0.0, 0.02),))
    assert float(hill.frame(np.array([200.0])).pitch_rad[0]) == pytest.approx(-0.02, abs=1e-4)
    for s in (130.0, 200.0, 215.0):
        grid, table = line_table(hill, chord=own, section=section, mount_x_m=1.5)
        body = line_at(grid, table, s)
        middle = s - 1.5 - 6.64
        ends = hill.frame(np.array([middle - 5.8, middle + 5.8]))
        along = Rotation.from_euler(
            "ZYX",
            [
                float(hill.frame(np.array([middle])).yaw_rad[0]) + RAMP * 5.8**2 / 6.0 * (s == 130.0),
                float(ends.pitch_rad.mean()),
                float(ends.roll_rad.mean()),
            ],
        )
        upright = along.apply([0.0, 0.0, 1.0])
        steep = upright[0] * np.cos(body.heading) + upright[1] * np.sin(body.heading)
        assert body.pitch == pytest.approx(float(np.arctan2(steep, upright[2])), abs=3e-5)
        alone = line_at(grid, line_table(hill, chord=own, mount_x_m=1.5)[1], s)
        assert abs(body.pitch - alone.pitch) > (1e-3 if s > 140.0 else 1e-4)
        same = alone._replace(pitch=body.pitch, pitch_slope=body.pitch_slope)
        assert tuple(same) == pytest.approx(
            tuple(body), abs=0.004 * 0.25**2 / 8.0
        )  # another grid under the chord
