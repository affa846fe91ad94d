"""The map under a body, at the places of a ride: what the track-relative smoother takes of it.

A body points along a chord of the track (`simrail.estimators.odometry.line_table`) and rolls with the track
under the two ends of that chord; its suspension follows cant and curvature within a window of `EASE_M`. How
the shift of a joint changes curvature and cant is as in that module: the slope times the joint's weight, by
the parity of its number.

A quantity of the map depends on the place, which is a state: each is a `Dual` of S.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from simrail.estimators.odometry.line_table import PLACES_PER_M, line_under
from simrail.estimators.odometry.pointing import chord_of
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative.dual import Dual, Vector
from simrail.estimators.track_relative.states import S

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.design import TrackFrame

EASE_M = 1.5
"""Standard deviation of the window over which a suspension follows cant and curvature."""

LEVEL_1PM = 1e-7
"""1/m: where the slope's own slope is less, there is no vertical curve."""

NO_CANT_RAD = 1e-3
"""A curve of which the roll stays below has no cant that could err."""

NO_RAMP_1PM2 = 1e-12
"""1/m2: where the curvature's slope is less, there is no transition."""


class Lines(NamedTuple):
    """The map over its whole length, on a grid of places, for one mount.

    Attributes
    ----------
    places : ndarray (m,)
    askew_roll, askew_pitch, askew_yaw : ndarray (m,)
        Angles of the body on its chord less those of the track under the mount, rad.
    bend, lean, dip : ndarray (m,)
        Eased: curvature of the track over the chord, its roll, and the slope of its pitch.
    torsion : ndarray (m,)
        Roll of the track under the body that rests on this one, less that under this one, rad.
    canted : ndarray (m,)
        Share of a curve's full cant, 0 to 1.
    even, odd, even_roll, odd_roll : ndarray (m,)
        Slope of curvature and roll, by the weights of the joints of even and odd number.
    element, curve : ndarray (m,)
        Numbers of the element, and of the stretch that has one curve's error.
    vertical : ndarray (m,)
        1 in a vertical curve, else 0.
    """

    places: FloatArray
    askew_roll: FloatArray
    askew_pitch: FloatArray
    askew_yaw: FloatArray
    bend: FloatArray
    lean: FloatArray
    dip: FloatArray
    torsion: FloatArray
    canted: FloatArray
    even: FloatArray
    odd: FloatArray
    even_roll: FloatArray
    odd_roll: FloatArray
    element: FloatArray
    curve: FloatArray
    vertical: FloatArray


def lines_of(recording: Recording) -> Lines:
    """The map of a recording, for its mount."""
    track = recording.track
    _, table = line_under(recording)
    heading_askew, even, odd, pitch, curve = table[:, 7], table[:, 2], table[:, 3], table[:, 5], table[:, 9]
    places = np.minimum(track.start_m + np.arange(len(table)) / PLACES_PER_M, track.end_m)
    under = track.frame(places)
    borne = _roll_over_chord(recording, places)
    askew = _turns(under, np.column_stack([borne - under.roll_rad, pitch - under.pitch_rad, heading_askew]))
    if not _is_borne(recording):
        askew[:, 0] = 0.0  # an axle lies across both rails, however it is yawed on them
    ramp, ease_m = even + odd, scale_of(recording) * EASE_M
    in_transition = np.abs(even) + np.abs(odd) > NO_RAMP_1PM2
    share = np.where(in_transition, even / np.where(ramp == 0.0, 1.0, ramp), 0.0)
    roll_slope = np.where(in_transition, under.rates[:, 0], 0.0)
    return Lines(
        places=places,
        askew_roll=askew[:, 0],
        askew_pitch=askew[:, 1],
        askew_yaw=askew[:, 2],
        bend=_eased(table[:, 1], ease_m),
        lean=_eased(borne, ease_m),
        dip=_eased(np.gradient(pitch, places), ease_m),
        torsion=_roll_above(recording, places, borne) - borne,
        canted=_share_of_cant(under.roll_rad, curve),
        even=even,
        odd=odd,
        even_roll=roll_slope * share,
        odd_roll=roll_slope * (1.0 - share),
        element=table[:, 8],
        curve=curve,
        vertical=(np.abs(under.rates[:, 1]) > LEVEL_1PM).astype(np.float64),
    )


def _turns(frame: TrackFrame, angles: FloatArray) -> FloatArray:
    """Small turns (m, 3) about the axes of the track, of small differences of roll, pitch and yaw.

    A body that lies along a chord of canted track is level, where the track beside its middle is not: it is
    pitched in it by the yaw between them times the roll.
    """
    sr, cr, sp, cp = (f(a) for a in (frame.roll_rad, frame.pitch_rad) for f in (np.sin, np.cos))
    roll, pitch, yaw = angles.T
    return np.column_stack([roll - sp * yaw, cr * pitch + cp * sr * yaw, cp * cr * yaw - sr * pitch])


def _eased(values: FloatArray, ease_m: float) -> FloatArray:
    return np.asarray(ndimage.gaussian_filter1d(values, ease_m * PLACES_PER_M, mode="nearest"))


def _is_borne(recording: Recording) -> bool:
    """Whether other bodies bear the mount's, by the drawing."""
    sheet = recording.vehicle_sheet
    here = None if sheet is None else sheet.body(recording.mount_body)
    return here is not None and len(here.supports) > 0


def _roll_over_chord(recording: Recording, places: FloatArray) -> FloatArray:
    """Roll of the track under a body: the mean of those under the two ends of its chord.

    An axle rolls with the track where it is, though its frame points it along a chord.
    """
    chord = chord_of(recording)
    if chord is None or not _is_borne(recording):
        return recording.track.frame(places).roll_rad
    return _mean_roll(recording, places, chord, recording.mount_position_m[0])


def _roll_above(recording: Recording, places: FloatArray, borne: FloatArray) -> FloatArray:
    """The same of the one body that rests on this one, and twists it; ``borne`` where there is none."""
    sheet = recording.vehicle_sheet
    here = None if sheet is None else sheet.body(recording.mount_body)
    if sheet is None or here is None or not here.supports:
        return borne
    above = sheet.above(here.name)
    chord = sheet.chord(above[0].name) if len(above) == 1 else None
    if chord is None:
        return borne
    return _mean_roll(recording, places, chord, recording.mount_position_m[0] + here.x_m - above[0].x_m)


def _mean_roll(recording: Recording, places: FloatArray, chord: Chord, mount_x_m: float) -> FloatArray:
    """Mean roll under both ends of a chord, over the places of a mount at ``mount_x_m`` of its body."""
    middle = places + chord.centre_m - mount_x_m
    ends = [recording.track.frame_extended(middle + side * chord.half_m).roll_rad for side in (1.0, -1.0)]
    return np.asarray(0.5 * (ends[0] + ends[1]))


def _share_of_cant(roll: FloatArray, curve: FloatArray) -> FloatArray:
    """Roll over the largest of its curve, 0 to 1."""
    share = np.zeros_like(roll)
    for number in np.unique(curve):
        here = curve == number
        most = np.abs(roll[here]).max()
        if most > NO_CANT_RAD:
            share[here] = np.abs(roll[here]) / most
    return share


class Ground(NamedTuple):
    """The map at the places of n steps.

    Attributes
    ----------
    frame : TrackFrame
        Of the track under the mount.
    k, dk : Vector
        Darboux curvatures per metre, and their slopes (EQUATIONS 1.1).
    pitch_slope : Dual
        d pitch/ds.
    up : Vector
        Unit vector against gravity, track axes.
    askew, askew_slope : Vector
        Roll, pitch and yaw of the body on its chord less those of the track, and their slopes, 1/m.
    bend, lean : tuple of three Dual
        As in `Lines`, with their first and second slope.
    dip, torsion, canted : tuple of two Dual
        With their first slope.
    even, odd, even_roll, odd_roll : ndarray (n,)
        As in `Lines`.
    """

    frame: TrackFrame
    k: Vector
    dk: Vector
    pitch_slope: Dual
    up: Vector
    askew: Vector
    askew_slope: Vector
    bend: tuple[Dual, ...]
    lean: tuple[Dual, ...]
    dip: tuple[Dual, ...]
    torsion: tuple[Dual, ...]
    canted: tuple[Dual, ...]
    even: FloatArray
    odd: FloatArray
    even_roll: FloatArray
    odd_roll: FloatArray


def ground_at(recording: Recording, lines: Lines, place: FloatArray) -> Ground:
    """The map at places (n,); beyond its ends it is as at its ends."""
    track = recording.track
    place = np.clip(place, track.start_m, track.end_m)

    def known(values: FloatArray, slopes: int) -> tuple[Dual, ...]:
        """A quantity and so many of its slopes, each a Dual."""
        rows = [values]
        for _ in range(slopes + 1):
            rows.append(np.gradient(rows[-1], lines.places))
        read = [np.interp(place, lines.places, row) for row in rows]
        return tuple(Dual(value, {S: slope}) for value, slope in pairwise(read))

    askew = [known(values, 1) for values in (lines.askew_roll, lines.askew_pitch, lines.askew_yaw)]
    frame = track.frame(place)
    return Ground(
        frame=frame,
        k=_vector(frame.k, frame.dk),
        dk=_vector(frame.dk, np.zeros_like(frame.dk)),
        pitch_slope=Dual(frame.rates[:, 1], {S: frame.second[:, 1]}),
        up=_up(frame),
        askew=(askew[0][0], askew[1][0], askew[2][0]),
        askew_slope=(askew[0][1], askew[1][1], askew[2][1]),
        bend=known(lines.bend, 2),
        lean=known(lines.lean, 2),
        dip=known(lines.dip, 1),
        torsion=known(lines.torsion, 1),
        canted=known(lines.canted, 1),
        even=np.interp(place, lines.places, lines.even),
        odd=np.interp(place, lines.places, lines.odd),
        even_roll=np.interp(place, lines.places, lines.even_roll),
        odd_roll=np.interp(place, lines.places, lines.odd_roll),
    )


def _up(frame: TrackFrame) -> Vector:
    """Unit vector against gravity in the axes of the track, with its slopes along it."""
    sr, cr = np.sin(frame.roll_rad), np.cos(frame.roll_rad)
    sp, cp = np.sin(frame.pitch_rad), np.cos(frame.pitch_rad)
    roll, pitch = frame.rates[:, 0], frame.rates[:, 1]
    return (
        Dual(-sp, {S: -cp * pitch}),
        Dual(cp * sr, {S: cp * cr * roll - sp * sr * pitch}),
        Dual(cp * cr, {S: -cp * sr * roll - sp * cr * pitch}),
    )


def _vector(values: FloatArray, slopes: FloatArray) -> Vector:
    x, y, z = (Dual(values[:, i], {S: slopes[:, i]}) for i in range(3))
    return x, y, z


def numbers_at(
    lines: Lines, place: FloatArray
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], FloatArray]:
    """Numbers of element and curve (n,), and where vertical curves are, at places (n,)."""
    at = np.round((place - lines.places[0]) * PLACES_PER_M).astype(np.int64)
    at = np.clip(at, 0, len(lines.places) - 1)
    return lines.element[at].astype(np.int64), lines.curve[at].astype(np.int64), lines.vertical[at]
