"""How a mount moves in its track at the full rate of its IMU, given all that changes slowly.

The smoother's own steps are so long, and what shakes a mount so far from white, that it takes most of a short
motion for noise. Attitude and place want that; the rails do not: on an axle the motion is the rails. So what
the smoother has found of the train, the map and the sensors is held, and what the IMU shows beside it is
smoothed once more, sample by sample, with the noise of the sheet and little else:

    gyro x  =  d roll/dt,      accel y  =  d2y/dt2 + g roll,
    gyro y  =  d pitch/dt,     accel z  =  d2z/dt2

each of roll, pitch, y and z a process over the distance (`simrail.estimators.track_relative.rails_kernel`).
Products of two small motions are left out. What the standard deviations say is conditional on what is held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import pose_of, shown
from simrail.estimators.track_relative.model import MOTION_RATE_HZ
from simrail.estimators.track_relative.noise import AT_MPS
from simrail.estimators.track_relative.output import Trace
from simrail.estimators.track_relative.rails_kernel import Waves, simulate, smooth, stationary

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray, IntArray
from simrail.recording.recording import Recording

FAST = (
    at.ROLL,
    at.ROLL_RATE,
    at.ROLL_SLOW,
    at.PITCH,
    at.PITCH_RATE,
    at.Y,
    at.Y_1,
    at.Y_2,
    at.Z,
    at.Z_1,
    at.Z_2,
)
"""States that are found anew."""

SENSED = (GYRO[0], GYRO[1], ACCEL[1], ACCEL[2])
"""What of the IMU shows them."""

LEAST_GYRO_RADPS, LEAST_ACCEL_MPS2 = 3e-4, 3e-3
"""Noise of a sample that is always added: of what the model is short of, and of an IMU that has none."""

CONSTANT, BY_SPEED, BY_SQUARE, BY_SLOPE = range(4)
"""Kinds of coefficients, in the order of `Waves`."""


@dataclass(frozen=True)
class Waviness:
    """How a mount follows the rails: standard deviations, rad and m, and lengths of the filters, m.

    The sizes are synthetic, of good rails with waves of up to 100 m.
    """

    roll_sd: float = 1.3e-3
    roll_lengths: tuple[float, ...] = (2.5, 2.5)
    pitch_sd: float = 7.3e-4
    pitch_lengths: tuple[float, ...] = (1.0, 1.0)
    y_sd: float = 4e-3
    y_lengths: tuple[float, ...] = (6.0, 2.2, 2.2)
    z_sd: float = 6e-3
    z_lengths: tuple[float, ...] = (48.0, 2.3, 2.3)

    def at_scale(self, scale: float) -> "Waviness":
        """That of a model of another scale, with the same angles."""
        return Waviness(
            roll_sd=self.roll_sd,
            roll_lengths=tuple(scale * length for length in self.roll_lengths),
            pitch_sd=self.pitch_sd,
            pitch_lengths=tuple(scale * length for length in self.pitch_lengths),
            y_sd=scale * self.y_sd,
            y_lengths=tuple(scale * length for length in self.y_lengths),
            z_sd=scale * self.z_sd,
            z_lengths=tuple(scale * length for length in self.z_lengths),
        )


class Held(NamedTuple):
    """What is held, at n samples.

    Attributes
    ----------
    rest : ndarray (n, 4)
        What of `SENSED` it does not explain, rad/s and m/s2.
    place : ndarray (n,)
        S, m.
    speed, slope : ndarray (n,)
        |ds/dt| and its slope, m/s and m/s2.
    roll, yaw, y : ndarray (n,)
        Of the body beside the track, as far as it is held, rad and m: in the track as it lies, and under a
        body on several axles the mean of what is under them.
    deficiency, track_roll : ndarray (n,)
        Cant deficiency over g, and roll of the track as it lies, rad.
    """

    rest: FloatArray
    place: FloatArray
    speed: FloatArray
    slope: FloatArray
    roll: FloatArray
    yaw: FloatArray
    y: FloatArray
    deficiency: FloatArray
    track_roll: FloatArray


def held_of(recording: Recording, trace: Trace) -> Held:
    """What the smoothed states say without `FAST`, and what they leave of the signals."""
    course, states = trace.course, trace.states.copy()
    states[:, FAST] = 0.0
    x = [Dual(column) for column in states.T]
    ground, around = ground_at(recording, course.lines, states[:, at.S]), course.around
    pose = pose_of(x, ground, around)
    seen, track = shown(x, ground, around, pose), pose.track
    # Leaned, a body feels along z what pulls it to the side.
    for state in (at.ROLL, at.ROLL_SLOW, at.PITCH):
        x[state] = Dual(trace.states[:, state])
    seen[5] = shown(x, ground, around, pose_of(x, ground, around))[5]
    for state in (at.ROLL, at.ROLL_SLOW, at.PITCH):
        x[state] = Dual(states[:, state])
    speed, g, frame = states[:, at.V], recording.gravity_mps2, ground.frame
    track_roll = frame.roll_rad + track.cant.value
    bent = frame.rates[:, 2] + track.curvature.value
    slow = [
        *(seen[i].value for i in (0, 1, 4, 5)),
        states[:, at.S],
        speed * around.sense,
        states[:, at.A] * around.sense,
        (pose.rho[0] - track.cant - ground.askew[0]).value,
        (pose.rho[2] - ground.askew[2]).value,
        pose.y.value - around.nominal[0],
        speed**2 * bent / g + track_roll,
        track_roll,
    ]
    table = at_samples(recording, trace, np.column_stack(slow))
    rest = recording.imu[list(SENSED)].to_numpy(dtype=np.float64) - table[:, :4]
    columns = [np.ascontiguousarray(column) for column in table[:, 4:].T]
    del table
    return Held(rest, columns[0], np.maximum(columns[1], 0.0), *columns[2:])


def found_before(recording: Recording, trace: Trace) -> FloatArray:
    """ROLL less what is slow of it, Y and Z of the smoother at the samples, (n, 3)."""
    found = trace.states[:, [at.ROLL, at.Y, at.Z]]
    found[:, 0] -= trace.states[:, at.ROLL_SLOW]
    return at_samples(recording, trace, found)


def beside_rails(recording: Recording, trace: Trace) -> FloatArray:
    """Roll at the samples (n,), rad, that is not the rails' (all but `Pose.level`).

    Cant that the map has not is no irregularity. What of it the smoother finds is taken off, and how sure it
    is of the rest is in the last of its outputs.
    """
    course, x = trace.course, [Dual(column) for column in trace.states.T]
    ground = ground_at(recording, course.lines, trace.states[:, at.S])
    pose = pose_of(x, ground, course.around)
    return at_samples(recording, trace, (pose.rho[0] - pose.level).value)


def at_samples(recording: Recording, trace: Trace, values: FloatArray) -> FloatArray:
    """Values at the smoother's steps, at the IMU's samples; beyond the ends as there."""
    known = trace.course.steps.time_s
    time = recording.imu.index.to_numpy(dtype=np.float64)
    return np.asarray(CubicSpline(known, values)(np.clip(time, known[0], known[-1])))


class Chain(NamedTuple):
    """Coordinates that are found together.

    Attributes
    ----------
    waves : Waves
    shown : tuple of int
        Columns of `Held.rest` that show them.
    wanted : ndarray of int (w,)
        Their states, without the derivatives.
    """

    waves: Waves
    shown: tuple[int, ...]
    wanted: IntArray


Part = tuple[float, tuple[float, ...]]
"""Standard deviation and lengths of a coordinate."""


def chain(
    recording: Recording,
    held: Held,
    parts: Sequence[Part],
    rows: dict[int, Sequence[tuple[int, int, float]]],
    shaking: float = 0.0,
) -> Chain:
    """A chain of some coordinates; ``rows`` has kind, state and coefficient of what each column shows.

    ``shaking`` is the intensity of white motion of which an accelerometer's noise has more, m2/s4 at 1 m/s.
    """
    sheet = recording.imu_sheet
    gyro = sheet.gyro_noise_radpsqrts**2 * sheet.rate_hz + LEAST_GYRO_RADPS**2
    accel = sheet.accel_noise_mpsqrts**2 * sheet.rate_hz + LEAST_ACCEL_MPS2**2
    sizes = [len(lengths) for _, lengths in parts]
    rates, table = np.zeros((len(parts), 3)), np.zeros((4, len(rows), sum(sizes)))
    for rate, (_, lengths) in zip(rates, parts, strict=True):
        rate[: len(lengths)] = sorted(1.0 / length for length in lengths)
    for m, row in enumerate(rows.values()):
        for kind, state, value in row:
            table[kind, m, state] = value
    is_accel = np.array([column >= 2 for column in rows])
    waves = Waves(
        speed=held.speed,
        slope=held.slope,
        dt=1.0 / sheet.rate_hz,
        sizes=np.array(sizes),
        rates=rates,
        sds=np.array([sd for sd, _ in parts]),
        constant=table[CONSTANT],
        by_speed=table[BY_SPEED],
        by_square=table[BY_SQUARE],
        by_slope=table[BY_SLOPE],
        variances=np.where(is_accel, accel, gyro),
        shaking=np.where(is_accel, shaking, 0.0),
    )
    return Chain(waves, tuple(rows), np.cumsum([0, *sizes[:-1]]))


def side_of(recording: Recording, held: Held, waviness: Waviness, aside: float = 0.0) -> Chain:
    """Roll and y; ``aside`` is motion that is none of the rails, per sample of 125 Hz at `AT_MPS`, m/s2."""
    parts = [(waviness.roll_sd, waviness.roll_lengths), (waviness.y_sd, waviness.y_lengths)]
    felt = [(CONSTANT, 0, recording.gravity_mps2), (BY_SQUARE, 4, 1.0), (BY_SLOPE, 3, 1.0)]
    shaking = aside**2 * recording.imu_sheet.rate_hz / MOTION_RATE_HZ / AT_MPS**3
    return chain(recording, held, parts, {0: [(BY_SPEED, 1, 1.0)], 2: felt}, shaking)


def nod_of(recording: Recording, held: Held, waviness: Waviness) -> Chain:
    """Pitch."""
    parts = [(waviness.pitch_sd, waviness.pitch_lengths)]
    return chain(recording, held, parts, {1: [(BY_SPEED, 1, 1.0)]})


def heave_of(recording: Recording, held: Held, waviness: Waviness) -> Chain:
    """Height."""
    parts = [(waviness.z_sd, waviness.z_lengths)]
    return chain(recording, held, parts, {3: [(BY_SQUARE, 2, 1.0), (BY_SLOPE, 1, 1.0)]})


def found(one: Chain, rest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates (n, w) of a chain, and their covariance (n, w, w)."""
    measured = np.ascontiguousarray(rest[:, list(one.shown)])
    return smooth(one.waves, measured, one.wanted, with_covariance=True)


def error_of(one: Chain, rng: np.random.Generator) -> FloatArray:
    """A draw (n, w) of truth minus what is found: what is missed of a draw of the model itself."""
    waves, n = one.waves, len(one.waves.speed)
    states, measured = np.empty((n, waves.constant.shape[1])), np.empty((n, len(one.shown)))
    start = np.linalg.cholesky(stationary(waves)) @ rng.standard_normal(states.shape[1])
    normals = rng.standard_normal((n, 3 * len(waves.sizes) + len(one.shown)))
    simulate(waves, start, normals, states, measured)
    return states[:, one.wanted] - smooth(waves, measured, one.wanted, with_covariance=False)[0]
