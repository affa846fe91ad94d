"""How a body points in its track, by the drawing of the vehicle, and how far the map may be off the line.

What every odometry that knows the line takes of both.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.odometry.scale import scale_of

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import Chord

MODEL_SWAY = 8.0
"""By so much more than a body of full size that of a model sways: its rails are rougher than by its scale.
Synthetic, of the 1:10 car of `scale_greatest`."""


class Pointing(NamedTuple):
    """How a body points against the chord of the track that it is on.

    Attributes
    ----------
    lag_sd_m : float
        The track that it points along lies behind its chord, in the direction of travel, by the chord's
        `play_m` and something: the standard deviation of that between vehicles.
    turn_sd_rad : float
        And what it turns beside that in a curve, from curve to curve.
    lag_walk_m : float
        The same as a random walk of the lag, m2 per m, for an estimator that has no turn of each curve.
    sway_sd_rad, sway_length_m : float
        What it does beside that: standard deviation, and over what distance it changes.
    lead_sd_m : float
        The slope that it has is the track's so far behind its chord: the standard deviation of that.
    attacks : bool
        It turns with the wheels where these carry an unbalanced lateral acceleration by creep.
    """

    lag_sd_m: float
    turn_sd_rad: float
    lag_walk_m: float
    sway_sd_rad: float
    sway_length_m: float
    lead_sd_m: float
    attacks: bool = False

    def at_scale(self, scale: float) -> "Pointing":
        """That of a model of another scale, with the same angles, but for the sway (`MODEL_SWAY`)."""
        if scale == 1.0:
            return self
        lengths = ("lag_sd_m", "lag_walk_m", "sway_length_m", "lead_sd_m")
        shorter = {name: scale * getattr(self, name) for name in lengths}
        return self._replace(sway_sd_rad=MODEL_SWAY * self.sway_sd_rad, **shorter)


AXLE = Pointing(0.1, 6e-4, 2e-5, 4e-4, 2.0, 1.0, attacks=True)
"""It steers against its frame."""

FRAME = Pointing(0.1, 3e-4, 1e-5, 4e-4, 2.0, 1.0, attacks=True)
"""And any other body on axles."""

ON_BOGIES = Pointing(0.06, 5e-5, 2e-6, 2.5e-4, 6.5, 1.0)
"""A body on two bogies: what they do is the same at both ends, and 15 m apart."""

OTHER_BODY = Pointing(0.6, 4e-4, 5e-5, 1e-3, 8.0, 7.0)
"""A body on one bogie, or between other bodies: its suspension turns with it, and it swings after a
transition. The joints of a train of such bodies pitch it with its neighbours (`section_of`), how stiffly no
drawing says."""

TURNED = Pointing(0.5, 7e-4, 5e-5, 1.5e-3, 10.0, 1.0)
"""On a vehicle of which rods let the axles yaw: little brings a frame back to the middle of a straight."""

TURNED_AXLE = Pointing(1.5, 1e-4, 5e-5, 3e-3, 60.0, 1.0)
"""And its axles: they turn in their rods by as much in a wide curve as in a tight one, for all its length."""

UNKNOWN_BODY = Pointing(3.0, 5e-4, 5e-5, 1e-3, 4.0, 3.0)
"""No drawing says what it rests on: half a bogie centre distance is 3 to 10 m, an IMU is seldom at its end.

The sizes of all seven are synthetic: orders of what simrail's vehicles do on good track at 20 to 100 km/h."""

PLAY_M = 0.012
"""Lateral play of a wheelset in the gauge, from flange to flange: it turns a body by PLAY_M / (2 half_m) at
most (`simrail.recording.sheets.vehicle_sheet.Chord`)."""

USUAL_RADIUS_M = 400.0
"""Of the curves that matter."""

MOST_LAG_M = 1.0
"""By play, of a body that does not stand on axles."""

TOUCHING_TURN_SD = 0.35
"""Of the angle by which flanges that touch turn a body, so much is its sd: gauge and flanges wear. And by so
much the body sways in that play."""

LATERAL_CREEP = 150.0
"""Lateral creep force of a wheel per creepage and load: f22 / N of Kalker's linear theory (f22 = G a b C22)
for steel wheels of 0.3 to 0.5 m in radius under 30 to 60 kN."""

CUT_LAG_SD = 0.3
"""Of what the longest lag leaves out of the play, so much is the sd of the lag."""


def chainage_sd(recording: Recording, place_m: FloatArray | float) -> FloatArray:
    """How far the map's chainage may be from the line's at places (n,): what no curve can tell apart."""
    errors = recording.map_errors
    return np.hypot(
        errors.chainage_offset_sd_m, errors.chainage_scale_sd * (place_m - recording.track.start_m)
    )


def lag_of(chord: Chord) -> tuple[float, float]:
    """By how much the tangent lies behind the chord, m, and the sd of that by the drawing."""
    most = _most_lag_m(chord)
    lag = min(max(chord.play_m, -most), most)
    return lag, math.hypot(place_sd_of(chord), CUT_LAG_SD * (chord.play_m - lag))


def turn_of(chord: Chord | None, yaw: Pointing) -> tuple[float, float]:
    """What a body turns in a curve beside its lag, rad, and the sd of that.

    Where flanges touch, that is all: an angle, whatever the radius, in place of a lag.
    """
    if chord is None or not yaw.attacks or chord.play_m <= _most_lag_m(chord):
        return 0.0, yaw.turn_sd_rad
    turn = 0.5 * PLAY_M / chord.half_m
    return turn, math.hypot(yaw.turn_sd_rad, TOUCHING_TURN_SD * turn)


def sway_sd_of(yaw: Pointing, turn: float) -> float:
    """Standard deviation of the sway, of a body that flanges turn by ``turn`` in a curve."""
    return math.hypot(yaw.sway_sd_rad, TOUCHING_TURN_SD * turn)


def _most_lag_m(chord: Chord) -> float:
    """Most lag that play makes, m: where a body on axles turns further, flanges touch in the usual curve."""
    on_axles = chord.half_m > 0.0 and math.isclose(chord.play_m, chord.half_m)
    return 0.5 * PLAY_M * USUAL_RADIUS_M / chord.half_m if on_axles else MOST_LAG_M


def place_sd_of(chord: Chord) -> float:
    """Standard deviation of the middle of a chord, m."""
    return math.hypot(chord.sd_m / math.sqrt(2.0), chord.shift_sd_m)


def chord_of(recording: Recording) -> Chord | None:
    """The chord along which the body of the mount points, if the train has a drawing."""
    sheet = recording.vehicle_sheet
    return None if sheet is None else sheet.chord(recording.mount_body)


def section_of(recording: Recording) -> Chord | None:
    """The chord of the section that the mount's body pitches with, if joints hold it in one."""
    sheet = recording.vehicle_sheet
    return None if sheet is None else sheet.section(recording.mount_body)


def pointing_of(recording: Recording, chord: Chord | None) -> Pointing:
    """What is known of the yaw of the mount's body in the track."""
    return kind_of(recording, chord).at_scale(scale_of(recording))


def kind_of(recording: Recording, chord: Chord | None) -> Pointing:
    """Which of the seven it is, at full size."""
    if recording.vehicle_sheet is None or chord is None:
        return UNKNOWN_BODY
    rests_on = {body.name: body.supports for body in recording.vehicle_sheet.bodies}
    supports = rests_on[recording.mount_body]
    if any(body.turned_by and not body.supports for body in recording.vehicle_sheet.bodies):
        return TURNED if supports else TURNED_AXLE
    if chord.half_wheelbase_m > 0.0:
        return ON_BOGIES
    if not supports:
        return AXLE
    return FRAME if all(not rests_on.get(support.on) for support in supports) else OTHER_BODY
