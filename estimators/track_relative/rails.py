"""How a mount moves in its track at the full rate of its IMU, given all that changes slowly.

The smoother's own steps are so long, and what shakes a mount so far from white, that it takes most of a short
motion for noise. Attitude and place want that; the rails do not: on an axle the motion is the rails. So what
the smoother has found of the train, the map and the sensors is held, and what the IMU shows beside it is
smoothed once more, sample by sample, with the noise of the sheet alone:

    gyro x  =  d roll/dt,      accel y  =  d2y/dt2 + g roll,
    gyro y  =  d pitch/dt,     accel z  =  d2z/dt2

each of roll, pitch, y and z a process over the distance (`simrail.estimators.track_relative.rails_kernel`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import deviation_of, pose_of, shown
from simrail.estimators.track_relative.noise import AXLE, FRAME, motion_of
from simrail.estimators.track_relative.output import Trace
from simrail.estimators.track_relative.rails_kernel import Waves, simulate, smooth, stationary

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

FAST = (
    at.ROLL,
    at.ROLL_RATE,
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
"""Of what the IMU shows; what the others show says nothing of these."""

LEAST_GYRO_RADPS, LEAST_ACCEL_MPS2 = 3e-4, 3e-3
"""Noise of a sample that is always added: of what the model is short of, and of an IMU that has none."""


@dataclass(frozen=True)
class Waviness:
    """How a mount follows the rails: a standard deviation, and lengths of its filters, m, of each coordinate.

    The sizes are synthetic, of good rails with waves of up to 100 m.
    """

    roll_sd: float = 1.3e-3
    roll_lengths: tuple[float, float] = (2.5, 2.5)
    pitch_sd: float = 7.3e-4
    pitch_lengths: tuple[float, float] = (1.0, 1.0)
    y_sd: float = 4e-3
    y_lengths: tuple[float, float, float] = (2.2, 2.2, 2.2)
    z_sd: float = 6e-3
    z_lengths: tuple[float, float, float] = (48.0, 2.3, 2.3)


class Held(NamedTuple):
    """What is held, at n samples.

    Attributes
    ----------
    rest : ndarray (n, 4)
        What of `SENSED` it does not explain, rad/s and m/s2.
    speed, slope : ndarray (n,)
        |ds/dt| and its slope, m/s and m/s2.
    """

    rest: FloatArray
    speed: FloatArray
    slope: FloatArray


class Found(NamedTuple):
    """Roll, pitch, y and z beside what is held, (n, 4), rad and m; and their covariance (n, 4, 4)."""

    motion: FloatArray
    covariance: FloatArray


def held_of(recording: Recording, trace: Trace) -> Held:
    """What the smoothed states, but for `FAST`, leave of the signals."""
    course, steps = trace.course, trace.course.steps
    states = trace.states.copy()
    states[:, FAST] = 0.0
    x = [Dual(column) for column in states.T]
    ground = ground_at(recording, course.lines, states[:, at.S])
    around = course.around._replace(states=states)
    seen = shown(x, ground, around)
    explained = np.column_stack([seen[i].value for i in (0, 1, 4, 5)])
    sense = around.sense
    slow = np.column_stack([explained, states[:, at.V] * sense, states[:, at.A] * sense])
    time = recording.imu.index.to_numpy(dtype=np.float64)
    inside = np.clip(time, steps.time_s[0], steps.time_s[-1])
    told = CubicSpline(steps.time_s, slow)(inside)
    rest = recording.imu[list(SENSED)].to_numpy(dtype=np.float64) - told[:, :4]
    return Held(rest, np.maximum(told[:, 4], 0.0), np.ascontiguousarray(told[:, 5]))


def waves_of(recording: Recording, held: Held, waviness: Waviness) -> tuple[Waves, Waves, Waves]:
    """The models of roll and y, of pitch, and of z."""
    sheet = recording.imu_sheet
    gyro = sheet.gyro_noise_radpsqrts**2 * sheet.rate_hz + LEAST_GYRO_RADPS**2
    accel = sheet.accel_noise_mpsqrts**2 * sheet.rate_hz + LEAST_ACCEL_MPS2**2

    def model(parts, rows, variances):
        sizes = [len(lengths) for _, lengths in parts]
        rates = np.full((len(parts), 3), np.inf)
        for rate, (_, lengths) in zip(rates, parts, strict=True):
            rate[: len(lengths)] = sorted(1.0 / length for length in lengths)
        rates[np.isinf(rates)] = 0.0
        shape = (4, len(rows), sum(sizes))
        table = np.zeros(shape)
        for m, row in enumerate(rows):
            for kind, state, value in row:
                table[kind, m, state] = value
        return Waves(
            held.speed, held.slope, 1.0 / sheet.rate_hz, np.array(sizes), rates,
            np.array([sd for sd, _ in parts]), *table, np.array(variances),
        )

    g = recording.gravity_mps2
    w = waviness
    side = model(
        [(w.roll_sd, w.roll_lengths), (w.y_sd, w.y_lengths)],
        [[(1, 1, 1.0)], [(0, 0, g), (2, 4, 1.0), (3, 3, 1.0)]],
        [gyro, accel],
    )
    nod = model([(w.pitch_sd, w.pitch_lengths)], [[(1, 1, 1.0)]], [gyro])
    heave = model([(w.z_sd, w.z_lengths)], [[(2, 2, 1.0), (3, 1, 1.0)]], [accel])
    return side, nod, heave


def smoothed(held: Held, models) -> Found:
    n = len(held.speed)
    motion, covariance = np.zeros((n, 4)), np.zeros((n, 4, 4))
    for waves, rows, into, out in zip(models, ([0, 2], [1], [3]), ([0, 2], [1], [3]), ([0, 2], [0], [0]), strict=True):
        s = waves.constant.shape[1]
        states, square = np.empty((n, s)), np.empty((n, s, s))
        smooth(waves, np.ascontiguousarray(held.rest[:, rows]), states, square)
        motion[:, into] = states[:, out]
        covariance[np.ix_(range(n), into, into)] = square[:, out][:, :, out]
    return Found(motion, covariance)
