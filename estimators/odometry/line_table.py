"""The map as the curve-matched odometry takes it: a table over places, and what its errors do there.

A body does not point where the track under its sensor points, but along the chord between the places that
it rests on (`simrail.recording.sheets.vehicle_sheet.Chord`): its heading is the mean of the track's heading
over the chord, and that of a body on two bogies over the wheelbases at its ends too,

    heading(s) = [H(s+a+b) + H(s+a-b) - H(s-a+b) - H(s-a-b)] / (4 a),   H the integral of the track's yaw

with s the middle of the chord, a half its length and b half a wheelbase: the chord's ends are at the middles
of their own chords, y(s +- a) = [y(s +- a + b) + y(s +- a - b)]/2, for small angles between track and body.
Where stiffness turns the body it is the sum of H over the axles, each with its weight.

Its pitch is alike, of the heights. A body that joints hold in one plane with its neighbours has the pitch of
that plane, which lies along the chord of their section, has its heading, and the mean roll of its ends: the
upright of the plane leans by (pitch, -roll) there, and the body sees it turned by what it yaws in the plane,

    pitch of the body = pitch cos(yaw) - roll sin(yaw),   yaw = heading of the body - heading of the section

Where the map has a curve of curvature k, there lies one of (1 + bend) k; a joint of two elements that the map
has at j lies at j + shift. To first order the curvature that lies there is

    k(s) (1 + bend) - k'(s) shift(s),   shift(s) = (1 - u) shift_j + u shift_(j+1) from joint j to j+1

which is exact for a linear transition of which both ends are moved. The table has k' (1 - u) and k' u by the
parity of the joint, so that each joint keeps its place in the state while it matters.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from simrail.estimators.odometry.pointing import chord_of, section_of

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.alignment import element_starts
from simrail.track.design import Curve, Straight, TrackDesign, TrackFrame

PLACES_PER_M = 4.0


class Line(NamedTuple):
    """The map at one place.

    Attributes
    ----------
    heading, bend : float
        Of a body on its chord, rad, and the slope of that, 1/m.
    ramp_even, ramp_odd : float
        Slope of its curvature, by the parity of the joint whose shift it goes with, 1/m2.
    roll : float
        rad.
    pitch, pitch_slope : float
        Of a body on its chord, rad, and the slope of that, 1/m.
    curvature : float
        Of the track under the encoder's wheel, 1/m.
    askew : float
        Heading of the body on its chord less that of the track under the mount, rad.
    element, curve : float
        Numbers of the element, and of the stretch that has one curve's error.
    """

    heading: float
    bend: float
    ramp_even: float
    ramp_odd: float
    roll: float
    pitch: float
    pitch_slope: float
    curvature: float
    askew: float
    element: float
    curve: float


@njit_borrowed
def line_at(grid: FloatArray, table: FloatArray, s: float) -> Line:
    """The map at s."""
    at = min(max((s - grid[0]) * grid[1], 0.0), table.shape[0] - 1.000001)
    i = int(at)
    x, a, b = at - i, table[i], table[i + 1]
    return Line(
        a[0] + x * (b[0] - a[0]),
        a[1] + x * (b[1] - a[1]),
        a[2] + x * (b[2] - a[2]),
        a[3] + x * (b[3] - a[3]),
        a[4] + x * (b[4] - a[4]),
        a[5] + x * (b[5] - a[5]),
        (b[5] - a[5]) * grid[1],
        a[6] + x * (b[6] - a[6]),
        a[7] + x * (b[7] - a[7]),
        a[8],
        a[9],
    )


ROOTS, WEIGHTS = (
    (-2.8569700138728056, -1.355626179974266, 0.0, 1.355626179974266, 2.8569700138728056),
    (
        0.011257411327720686,
        0.22207592200561266,
        0.5333333333333333,
        0.22207592200561266,
        0.011257411327720686,
    ),
)
"""Of Gauss and Hermite's quadrature over a standard normal law."""


class Spread(NamedTuple):
    """Heading and pitch where the place is only known to a standard deviation: the lines that fit them best.

    Attributes
    ----------
    heading, bend, heading_variance : float
        Mean, slope and what is left of the heading: rad, 1/m, rad2.
    pitch, pitch_slope, pitch_variance : float
        The same of the pitch.
    """

    heading: float
    bend: float
    heading_variance: float
    pitch: float
    pitch_slope: float
    pitch_variance: float


@njit_borrowed
def line_over(grid: FloatArray, table: FloatArray, s: float, sd: float) -> Spread:
    """The map about s: regression over a normal law of the place (Sarkka 2013, section 5.2).

    A tangent would be that of the place where the train is held to be, a straight as well as a curve.
    """
    h = hh = ht = p = pp = pt = 0.0
    for i in range(5):
        line, t, weight = line_at(grid, table, s + ROOTS[i] * sd), ROOTS[i], WEIGHTS[i]
        h += weight * line.heading
        ht += weight * line.heading * t
        p += weight * line.pitch
        pt += weight * line.pitch * t
    for i in range(5):
        line, t, weight = line_at(grid, table, s + ROOTS[i] * sd), ROOTS[i], WEIGHTS[i]
        hh += weight * (line.heading - h - ht * t) ** 2
        pp += weight * (line.pitch - p - pt * t) ** 2
    return Spread(h, ht / sd, hh, p, pt / sd, pp)


def line_table(
    track: TrackDesign,
    *,
    chord: Chord | None = None,
    section: Chord | None = None,
    mount_x_m: float = 0.0,
    wheel_ahead_m: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """The map under a body on its chord, over the place of a mount on that body.

    Parameters
    ----------
    track : TrackDesign
        The map.
    chord : Chord, optional
        What the body points along; without one it points where the track does.
    section : Chord, optional
        Of the bodies that joints hold in one plane with it; without one it pitches by itself.
    mount_x_m : float
        Place of the mount along the body, in the coordinates of both.
    wheel_ahead_m : float
        How far ahead of the mount the encoder's wheel is.

    Returns
    -------
    grid : ndarray (2,)
        First place (m), places per metre.
    table : ndarray (m, 10)
        `Line` at every place, but for the slope of the pitch.
    """
    count = math.ceil((track.end_m - track.start_m) * PLACES_PER_M) + 1
    places = np.minimum(track.start_m + np.arange(count) / PLACES_PER_M, track.end_m)
    frame = track.frame(places)
    centre, held_at = _held(chord, mount_x_m)
    reach = max(_reach(centre, held_at), _reach(*_held(section, mount_x_m))) + abs(wheel_ahead_m) + 1.0
    fine = np.arange(track.start_m - reach, track.end_m + reach, 1.0 / PLACES_PER_M)
    under = track.frame_extended(fine)
    curvature = under.rates[:, 2]
    ramps = _ramps(track, fine, curvature)
    columns = [under.yaw_rad, curvature, *ramps]
    heading, bend, even, odd, pitch = (
        _along_chord(fine, column, places + centre, held_at) for column in (*columns, under.pitch_rad)
    )
    if section is not None:
        pitch = _pitch_in_plane(fine, under, places - mount_x_m, heading, section)
    element = track.segment(np.clip(places + centre, track.start_m, track.end_m))
    curve = np.searchsorted(_curve_ends(track), places + centre, side="right")
    at_wheel = np.interp(places + wheel_ahead_m, fine, curvature)
    askew = heading - frame.yaw_rad
    rows = [heading, bend, even, odd, frame.roll_rad, pitch, at_wheel, askew, element, curve]
    return np.array([track.start_m, PLACES_PER_M]), np.ascontiguousarray(
        np.column_stack(rows), dtype=np.float64
    )


def line_under(recording: Recording, *, wheel_ahead_m: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """`line_table` of a recording's map, for its mount."""
    return line_table(
        recording.track,
        chord=chord_of(recording),
        section=section_of(recording),
        mount_x_m=recording.mount_position_m[0],
        wheel_ahead_m=wheel_ahead_m,
    )


def _pitch_in_plane(
    fine: FloatArray, under: TrackFrame, places: FloatArray, heading: FloatArray, section: Chord
) -> FloatArray:
    """Pitch of a body with its reference point over ``places`` and a heading, in the plane of its section."""
    middle = places + section.centre_m
    along = _along_chord(fine, under.yaw_rad, middle, section.held_at)
    pitch = _along_chord(fine, under.pitch_rad, middle, section.held_at)
    ends = [np.interp(middle + side * section.half_m, fine, under.roll_rad) for side in (1.0, -1.0)]
    roll, yaw = 0.5 * (ends[0] + ends[1]), heading - along
    return np.asarray(pitch * np.cos(yaw) - roll * np.sin(yaw))


def _held(chord: Chord | None, mount_x_m: float) -> tuple[float, tuple[tuple[float, float], ...]]:
    """How far the middle of a chord is ahead of a mount, and `Chord.held_at`."""
    return (0.0, ()) if chord is None else (chord.centre_m - mount_x_m, chord.held_at)


def _reach(centre: float, held_at: tuple[tuple[float, float], ...]) -> float:
    """How far from a mount a chord is held."""
    return abs(centre) + max((abs(x) for x, _ in held_at), default=0.0)


def _along_chord(
    places: FloatArray, values: FloatArray, middle: FloatArray, held_at: tuple[tuple[float, float], ...]
) -> FloatArray:
    """Mean of values over chords about the places ``middle``, as the module says it."""
    if not held_at:
        return np.interp(middle, places, values)
    steps = 0.5 * np.diff(places) * (values[1:] + values[:-1])
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    mean = np.zeros(len(middle))
    for offset, weight in held_at:
        mean += weight * np.interp(middle + offset, places, integral)
    return mean


def _ramps(track: TrackDesign, places: FloatArray, curvature: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slope of the curvature times the weight of the joint of even, and of odd number; (n,) each."""
    starts = element_starts(track.elements, track.start_m)
    element = np.clip(np.searchsorted(starts, places, side="right") - 1, 0, len(track.elements) - 1)
    share = np.clip((places - starts[element]) / np.diff(starts)[element], 0.0, 1.0)
    slope = np.gradient(curvature, places)
    begins_even = element % 2 == 0
    even = np.where(begins_even, 1.0 - share, share)
    return slope * even, slope * (1.0 - even)


def _curve_ends(track: TrackDesign) -> FloatArray:
    """Places that part curves: the middle of the longest straight between two, or of what there is."""
    starts = element_starts(track.elements, track.start_m)
    curves = [i for i, element in enumerate(track.elements) if isinstance(element, Curve)]
    ends = []
    for before, after in pairwise(curves):
        between = range(before + 1, after)
        straights = [i for i in between if isinstance(track.elements[i], Straight)]
        widest = max(straights, key=lambda i: float(starts[i + 1] - starts[i]), default=None)
        first, last = (before + 1, after) if widest is None else (widest, widest + 1)
        ends.append(0.5 * float(starts[first] + starts[last]))
    return np.array(ends)
