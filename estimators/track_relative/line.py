"""The map under a body, at the places of a ride: what the track-relative smoother takes of it.

A body points along a chord of the track (`simrail.estimators.odometry.line_table`) and rolls with the cant and
the curvature that its whole length is on: both are brought over the chord, and over a window of
`EASE_M`, within which the suspension follows. How a joint's shift changes curvature and cant is as in that
module: the slope times the joint's weight, by the parity of its number.
"""

from typing import NamedTuple

import numpy as np
from scipy import ndimage
from simrail.estimators.odometry.line_table import line_table
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.states import S

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.design import TrackDesign

STEP_M = 0.25
"""Of the table: that of the odometry's."""

EASE_M = 1.5
"""Standard deviation of the window over which a suspension follows cant and curvature."""

_FLAT = 1e-7
"""1/m: where the slope's own slope is less, there is no vertical curve."""


class Ground(NamedTuple):
    """The map at the places of n steps: what depends on the place, as `Dual` of S.

    Attributes
    ----------
    roll, pitch, yaw : ndarray (n,)
        Of the track, rad.
    k, dk : tuple of three Dual
        Darboux curvatures per metre, and their slopes (EQUATIONS 1.1).
    pitch_slope : Dual
        d pitch/ds.
    gravity : tuple of three Dual
        Unit vector against gravity, track axes.
    askew_roll, askew_yaw, askew_pitch : Dual
        Angles of the body on its chord less those of the track under the mount.
    askew_roll_1, askew_yaw_1, askew_pitch_1 : Dual
        Their slopes, 1/m.
    bend, bend_1, bend_2, lean, lean_1, lean_2, dip, dip_1 : Dual
        Curvature and roll over the chord, eased, and their slopes; of the curvature of the profile.
    even, odd, even_roll, odd_roll : ndarray (n,)
        Slope of curvature and of roll by the weights of the joints of even and odd number.
    canted, canted_1 : Dual
        Share of the curve's full cant, 0 to 1, and its slope.
    element, curve : ndarray (n,)
        Numbers, whole.
    vertical : ndarray (n,) of bool
        In a vertical curve.
    """

    roll: FloatArray
    pitch: FloatArray
    yaw: FloatArray
    k: tuple[Dual, Dual, Dual]
    dk: tuple[Dual, Dual, Dual]
    pitch_slope: Dual
    gravity: tuple[Dual, Dual, Dual]
    askew_roll: Dual
    askew_yaw: Dual
    askew_pitch: Dual
    askew_roll_1: Dual
    askew_yaw_1: Dual
    askew_pitch_1: Dual
    bend: Dual
    bend_1: Dual
    bend_2: Dual
    lean: Dual
    lean_1: Dual
    lean_2: Dual
    dip: Dual
    dip_1: Dual
    even: FloatArray
    odd: FloatArray
    even_roll: FloatArray
    odd_roll: FloatArray
    canted: Dual
    canted_1: Dual
    element: FloatArray
    curve: FloatArray
    vertical: np.ndarray


def ground_at(recording: Recording, chord: Chord | None, place: FloatArray) -> Ground:
    """The map at places (n,); beyond its ends it is as at its ends."""
    track = recording.track
    place = np.clip(place, track.start_m, track.end_m)
    _, table = line_table(track, chord=chord, mount_x_m=recording.mount_position_m[0])
    grid = np.minimum(track.start_m + STEP_M * np.arange(len(table)), track.end_m)
    under = track.frame(grid)
    askew_yaw, askew_pitch = table[:, 7], table[:, 5] - under.pitch_rad
    bend, dip = _eased(table[:, 1]), _eased(np.gradient(table[:, 5], grid))
    borne = _over_chord(track, grid, recording, chord)
    lean, askew_roll = _eased(borne), borne - under.roll_rad
    roll_slope = np.gradient(under.roll_rad, grid)
    even, odd = table[:, 2], table[:, 3]
    weight = np.where(np.abs(even) + np.abs(odd) > 1e-12, even / np.where(even + odd == 0.0, 1.0, even + odd), 0.0)
    canted = _share_of_cant(under.roll_rad, table[:, 9])
    nearest = np.clip(np.round((place - track.start_m) / STEP_M).astype(int), 0, len(grid) - 1)

    def at(values: FloatArray) -> FloatArray:
        return np.interp(place, grid, values)

    def known(values: FloatArray, times: int = 1) -> list[Dual]:
        """Values, and ``times`` slopes of them, each with its own slope by S."""
        rows = [values]
        for _ in range(times + 1):
            rows.append(np.gradient(rows[-1], grid))
        return [Dual(at(row), {S: at(slope)}) for row, slope in zip(rows[:-1], rows[1:], strict=True)]

    frame = track.frame(place)
    sr, cr = np.sin(frame.roll_rad), np.cos(frame.roll_rad)
    sp, cp = np.sin(frame.pitch_rad), np.cos(frame.pitch_rad)
    roll_1, pitch_1 = frame.rates[:, 0], frame.rates[:, 1]
    return Ground(
        roll=frame.roll_rad,
        pitch=frame.pitch_rad,
        yaw=frame.yaw_rad,
        k=_vector(frame.k, frame.dk),
        dk=_vector(frame.dk, np.zeros_like(frame.dk)),
        pitch_slope=Dual(pitch_1, {S: frame.second[:, 1]}),
        gravity=(
            Dual(-sp, {S: -cp * pitch_1}),
            Dual(cp * sr, {S: cp * cr * roll_1 - sp * sr * pitch_1}),
            Dual(cp * cr, {S: -cp * sr * roll_1 - sp * cr * pitch_1}),
        ),
        **dict(zip(("askew_yaw", "askew_yaw_1"), known(askew_yaw), strict=True)),
        **dict(zip(("askew_roll", "askew_roll_1"), known(askew_roll), strict=True)),
        **dict(zip(("askew_pitch", "askew_pitch_1"), known(askew_pitch), strict=True)),
        **dict(zip(("bend", "bend_1", "bend_2"), known(bend, 2), strict=True)),
        **dict(zip(("lean", "lean_1", "lean_2"), known(lean, 2), strict=True)),
        **dict(zip(("dip", "dip_1"), known(dip), strict=True)),
        even=at(even),
        odd=at(odd),
        even_roll=at(roll_slope * weight),
        odd_roll=at(roll_slope * (1.0 - weight) * (np.abs(even) + np.abs(odd) > 1e-12)),
        **dict(zip(("canted", "canted_1"), known(canted), strict=True)),
        element=table[nearest, 8],
        curve=table[nearest, 9],
        vertical=np.abs(at(np.gradient(under.pitch_rad, grid))) > _FLAT,
    )


def _vector(values: FloatArray, slopes: FloatArray) -> tuple[Dual, Dual, Dual]:
    x, y, z = (Dual(values[:, i], {S: slopes[:, i]}) for i in range(3))
    return x, y, z


def _eased(values: FloatArray) -> FloatArray:
    return np.asarray(ndimage.gaussian_filter1d(values, EASE_M / STEP_M, mode="nearest"))


def _over_chord(
    track: TrackDesign, grid: FloatArray, recording: Recording, chord: Chord | None
) -> FloatArray:
    """Roll of the track under a body: the mean of those under the two ends of its chord.

    An axle rolls with the track where it is, though its frame points it along a chord.
    """
    sheet = recording.vehicle_sheet
    here = None if sheet is None else sheet.body(recording.mount_body)
    if chord is None or here is None or not here.supports:
        return track.frame(grid).roll_rad
    middle = grid + chord.centre_m - recording.mount_position_m[0]
    ends = [track.frame_extended(middle + side * chord.half_m).roll_rad for side in (1.0, -1.0)]
    return np.asarray(0.5 * (ends[0] + ends[1]))


def _share_of_cant(roll: FloatArray, curve: FloatArray) -> FloatArray:
    """Roll over the largest of its curve, 0 to 1."""
    share = np.zeros_like(roll)
    for number in np.unique(curve):
        here = curve == number
        most = np.abs(roll[here]).max()
        if most > 1e-3:
            share[here] = np.abs(roll[here]) / most
    return share
