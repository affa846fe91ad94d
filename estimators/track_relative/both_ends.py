"""Height and side of a body on two bogies, by its gyros: both its ends follow the same rails.

Whatever springs and wheels make of the rails, both ends of a body come by the same line p(s) over the track,
one half a base a ahead of its middle and one as far behind. Its middle and its slope are

    z(s) = [p(s + a) + p(s - a)] / 2,     slope(s) = [p(s + a) - p(s - a)] / (2 a)

so that, with no word of p, of the rails or of the suspension,

    z(s + a) - z(s - a) = a [slope(s + a) + slope(s - a)]

In waves that are longer than the body an angle by a gyro errs by far less than a height by an accelerometer
(an integral once against twice): what of that is not so is the height's error, in each wave by Wiener's
filter

    error = P conj(T) / (|T|^2 P + Q) difference,     T = 2 i sin(2 pi a / wavelength)

with the spectra P of the height's error and Q of all else. To the side it is alike, by yaw. The formulation
is ours.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy import fft
from scipy.interpolate import CubicSpline
from simrail.estimators.odometry.pointing import chord_of
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.full_rate import LEAST_ACCEL_MPS2, LEAST_GYRO_RADPS, at_samples
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import pose_of
from simrail.estimators.track_relative.noise import BODY, class_of
from simrail.estimators.track_relative.output import Trace
from simrail.estimators.trajectory.track_geometry import Sight, over_space

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

ENDS_M3 = (5.7e-6, 5.7e-7)
"""By what two ends do not follow the same line to the side and in height: white over the track, m2 per cycle
per m, two-sided, of full size. Synthetic, chosen by hand on six rides of `scale_greatest`."""

LONGEST = 10.0
"""Longest wave in which it is told, in bases of the body."""

STEEP = 8
"""Power by which it ends there."""


class Ends(NamedTuple):
    """A body between its ends, and what its sensors err by.

    Attributes
    ----------
    half_m, ahead_m : float
        Half its base, and how far the mount is ahead of its middle.
    slopes : ndarray (n, 2)
        Of the body in the track at the samples, to the side and in height.
    speed_mps : float
        Under way.
    accel, gyro : float
        Noise of the sensors, two-sided, m2/s4 and rad2/s2 per Hz.
    gravity_mps2 : float
    own_m3 : ndarray (2,)
        `ENDS_M3` at the scale.
    """

    half_m: float
    ahead_m: float
    slopes: FloatArray
    speed_mps: float
    accel: float
    gyro: float
    gravity_mps2: float
    own_m3: FloatArray


def ends_of(recording: Recording, trace: Trace) -> Ends | None:
    """The ends of the mount's body; None where it is none on two bogies, or never moves."""
    chord, speed = chord_of(recording), np.abs(trace.states[:, at.V])
    if chord is None or chord.half_m == 0.0 or class_of(recording) is not BODY or not speed.any():
        return None
    course, x = trace.course, [Dual(column) for column in trace.states.T]
    ground = ground_at(recording, course.lines, trace.states[:, at.S])
    pose = pose_of(x, ground, course.around)
    # A body whose nose is down has a positive pitch; what the design has along its chord is no motion.
    turns = np.column_stack([(pose.rho[2] - ground.askew[2]).value, (ground.askew[1] - pose.rho[1]).value])
    sheet = recording.imu_sheet
    return Ends(
        half_m=chord.half_m,
        ahead_m=recording.mount_position_m[0] - chord.centre_m,
        slopes=at_samples(recording, trace, turns),
        speed_mps=float((speed**2).sum() / speed.sum()),
        accel=sheet.accel_noise_mpsqrts**2 + LEAST_ACCEL_MPS2**2 / sheet.rate_hz,
        gyro=sheet.gyro_noise_radpsqrts**2 + LEAST_GYRO_RADPS**2 / sheet.rate_hz,
        gravity_mps2=recording.gravity_mps2,
        own_m3=scale_of(recording) ** 3 * np.array(ENDS_M3),
    )


def missed(ends: Ends, sight: Sight, motion: FloatArray, step_m: float) -> FloatArray:
    """By how much side and height (n, 2) of the mount at the samples are too large, at the places (g, 2)."""
    there = _over_places(sight, np.column_stack([motion, ends.slopes[sight.use]]), step_m)
    middle = there[:, :2] - ends.ahead_m * there[:, 2:]
    return _told(ends, _difference(ends, middle, there[:, 2:], step_m), step_m)


def still_missed(
    ends: Ends, sight: Sight, errors: FloatArray, step_m: float, rng: np.random.Generator
) -> FloatArray:
    """What `missed` finds (g, 2) of a draw of the errors (n, 2) of side and height, and of gyros and ends."""
    there = _over_places(sight, errors, step_m)
    rest = _difference(ends, there, np.zeros_like(there), step_m)
    n = _padded(len(rest), ends, step_m)
    _, own = _spectra(ends, n, step_m)
    white = fft.rfft(rng.standard_normal((n, 2)), axis=0)
    rest += fft.irfft(white * np.sqrt(own / step_m), n, axis=0)[: len(rest)]
    return _told(ends, rest, step_m)


def _over_places(sight: Sight, values: FloatArray, step_m: float) -> FloatArray:
    return over_space(sight.place[sight.use], values, step_m=step_m).values


def _difference(ends: Ends, middle: FloatArray, slopes: FloatArray, step_m: float) -> FloatArray:
    """What lines (g, 2) of the middle rise from end to end beside what their slopes say; 0 near the ends."""
    places, half = step_m * np.arange(len(middle)), ends.half_m
    rest = np.zeros_like(middle)
    inside = (places >= half) & (places <= places[-1] - half)
    if not inside.any():
        return rest
    line, turn = CubicSpline(places, middle), CubicSpline(places, slopes)
    before, behind = places[inside] - half, places[inside] + half
    rest[inside] = line(behind) - line(before) - half * (turn(behind) + turn(before))
    # A start that is not smooth would pass for waves.
    away = np.minimum(places - half, places[-1] - half - places) / (2.0 * half)
    smooth = np.square(np.sin(0.5 * math.pi * np.clip(away, 0.0, 1.0)))
    return np.asarray(rest * smooth[:, None])


def _padded(count: int, ends: Ends, step_m: float) -> int:
    """Length of a transform, so that one end is not the neighbour of the other."""
    return fft.next_fast_len(count + math.ceil(2.0 * LONGEST * ends.half_m / step_m), real=True)


def _spectra(ends: Ends, n: int, step_m: float) -> tuple[FloatArray, FloatArray]:
    """Of the errors of side and height, and of all else in the difference, (k, 2), m2 per cycle per m."""
    per_m = np.maximum(fft.rfftfreq(n, step_m), 0.5 / (LONGEST * ends.half_m) / STEEP)[:, None]
    in_time = 2.0 * math.pi * per_m * ends.speed_mps
    angle = ends.gyro * ends.speed_mps / in_time**2
    # To the side an accelerometer feels gravity where the roll errs.
    felt = ends.accel * ends.speed_mps + ends.gravity_mps2**2 * angle * np.array([1.0, 0.0])
    arm = 2.0 * ends.half_m * np.cos(2.0 * math.pi * ends.half_m * per_m)
    return felt / in_time**4, arm**2 * angle + ends.own_m3


def _told(ends: Ends, rest: FloatArray, step_m: float) -> FloatArray:
    """Errors of side and height (g, 2) by the difference from end to end."""
    n = _padded(len(rest), ends, step_m)
    errors, own = _spectra(ends, n, step_m)
    per_m = fft.rfftfreq(n, step_m)[:, None]
    rises = 2j * np.sin(2.0 * math.pi * ends.half_m * per_m)
    gain = errors * np.conj(rises) / (np.abs(rises) ** 2 * errors + own)
    waves = 2.0 * LONGEST * ends.half_m * per_m
    gain = gain * (waves**STEEP / (1.0 + waves**STEEP))
    return np.asarray(fft.irfft(fft.rfft(rest, n, axis=0) * gain, n, axis=0)[: len(rest)])
