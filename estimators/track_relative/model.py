"""A ride in steps, and its linear model for the kernels of the track-relative smoother.

The IMU is averaged over steps; all is linearised about a course (`Course`): at first that of an odometry
with the body at rest in the map's track, then that of the smoothed train. The odometry is that only: its
place and speed are no measurements, since they are made of the same signals.
"""

import math
from collections.abc import Collection
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from simrail.estimators.odometry.curve_matched import CurveMatchedOdometry, counts_at, first_speed
from simrail.estimators.odometry.kernel import DIRECTION_SPEED_MPS, SATURATION_RADIUS_M
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import Aiding, Rows
from simrail.estimators.track_relative.dual import table_of
from simrail.estimators.track_relative.kernel import FLOWS, Model, Noise
from simrail.estimators.track_relative.line import Ground, Lines, ground_at, lines_of, numbers_at
from simrail.estimators.track_relative.measurement import Around, duals, pose_of, shown, told
from simrail.estimators.track_relative.noise import AT_MPS, Motion, slow_m_of
from simrail.estimators.track_relative.prior import first_state, noise_of, start_of

from simrail.core.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

VERTICAL_LENGTH_M = 7.0
"""Over which the slope's error changes in a vertical curve, from that of one gradient to that of the next."""

MOTION_RATE_HZ = 125.0
"""Rate to which `simrail.estimators.track_relative.noise.Motion` speaks of white motion."""

LEAST_GYRO_RADPS, LEAST_ACCEL_MPS2 = 5e-5, 3e-3
"""Noise that is always added: no mount is stiffer, and a filter of sensors without noise is singular."""

STANDS_MPS = 1.0
"""Below it passengers shake a body more than its rails do."""

LOST_M = 1.0
"""Of the wheel's way, per step in which it slips: it says nothing, and begins anew after that."""

JERK_S, START_JERK_S = 1.0, 0.3
"""Over which the slope of the acceleration is taken: of the odometry's, and at a start or stop (`STANDS_MPS`)
of the accelerometer's, which is at once where the odometry is late by half a second. A body that squats turns
then, and nothing else turns it: what is missed there passes for speed."""

LEAST_JERK_MPS3 = 0.1
"""Of a train that begins to move; less is a body that passengers rock, where gravity passes for a jerk."""


class Steps(NamedTuple):
    """A recording in steps; n of them.

    Attributes
    ----------
    time_s, end_s : ndarray (n,)
        Middle of each step, and time of its last sample.
    dt : float
        s.
    signals : ndarray (n, 6)
        Mean rates and forces, rad/s and m/s2.
    way : ndarray (n,)
        That the wheel shows, m; 0 where there is none.
    odometry : ndarray (n, 4)
        Mean place, speed, acceleration and sd of the place by the odometry, m, m/s, m/s2, m.
    slipping, resting : ndarray (n,) of bool
        Where the wheel is not believed, and where the train stands.
    """

    time_s: FloatArray
    end_s: FloatArray
    dt: float
    signals: FloatArray
    way: FloatArray
    odometry: FloatArray
    slipping: npt.NDArray[np.bool_]
    resting: npt.NDArray[np.bool_]


def steps_of(recording: Recording, rate_hz: float, *, smoothed: bool = False) -> Steps:
    """Bring a recording to steps; what is left over at its end is dropped.

    A step takes nothing from later than its last sample. The odometry is the causal one for the smoother too:
    it linearises anew about what it finds, and the history of a smoothed one would be most of its memory.
    Without a wheel that is metres off between two curves, and no smoother is linear so far.
    """
    time = recording.imu.index.to_numpy(dtype=np.float64)
    block = max(1, round(recording.imu_sheet.rate_hz / rate_hz))
    n = len(time) // block

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(values[: n * block].reshape(n, block, values.shape[1]).mean(axis=1))

    method = CurveMatchedOdometry(smoothed=smoothed and not recording.has_wheel)
    method = method.at_scale(scale_of(recording))
    trace = method.trace(recording)
    odometry = mean(method.at_imu_times(trace, recording)[[*ODOMETRY, ODOMETRY_SD[0]]].to_numpy())
    ends = time[block - 1 :: block][:n]
    # Before the odometry's first step, which a short ride does not have, the train is as it begins.
    known = np.searchsorted(trace.time_s, ends + 1e-9, side="right")
    resting = np.concatenate([[first_speed(recording)[0] == 0.0], trace.resting])[known]
    odometry[resting, 1:3] = 0.0
    counts, pulse_m = counts_at(recording, time)
    return Steps(
        time_s=mean(time[:, None])[:, 0],
        end_s=ends,
        dt=block / recording.imu_sheet.rate_hz,
        signals=mean(recording.imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)),
        way=mean((counts * pulse_m)[:, None])[:, 0],
        odometry=odometry,
        slipping=np.concatenate([[not recording.has_wheel], trace.slipping])[known],
        resting=resting,
    )


class Course(NamedTuple):
    """About what a ride is linearised, and what does not change with that.

    Attributes
    ----------
    recording : Recording
    lines : Lines
    motion : Motion
    noise : Noise
    start, start_covariance : ndarray (52,), (52, 52)
    steps : Steps
    around : Around
        Of all n steps.
    way : ndarray (n,)
        From the step before, m.
    aiding : tuple of Aiding
        What is measured beside the IMU.
    aided : Rows
        Of all of it, at n steps.
    """

    recording: Recording
    lines: Lines
    motion: Motion
    noise: Noise
    start: FloatArray
    start_covariance: FloatArray
    steps: Steps
    around: Around
    way: FloatArray
    aiding: tuple[Aiding, ...]
    aided: Rows

    @property
    def rows(self) -> int:
        """Measurements of a step."""
        return 6 + int(self.aided.values.shape[1])


def course_of(
    recording: Recording,
    steps: Steps,
    motion: Motion,
    aiding: tuple[Aiding, ...],
    without: Collection[str],
) -> Course:
    """The course of the odometry, with the body at rest in the map's track."""
    noise = noise_of(recording, motion, without)
    start, covariance = start_of(recording, motion, noise, without)
    states = np.tile(first_state(recording, motion), (len(steps.time_s), 1))
    states[:, [at.S, at.V, at.A]] = steps.odometry[:, :3]
    empty = np.empty(0)
    _, lateral, height = recording.mount_position_m
    around = Around(
        states,
        empty,
        empty,
        (lateral, height),
        recording.gravity_mps2,
        motion.sway_hz > 0.0,
        slow_m_of(recording),
        recording.rail_displacement is not None,
    )
    each = [kind.rows(recording, steps) for kind in aiding]
    none = np.empty((len(steps.time_s), 0))
    aided = Rows(
        *(np.hstack([none, *part]) for part in ([r.values for r in each], [r.variances for r in each]))
    )
    course = Course(
        recording, lines_of(recording), motion, noise, start, covariance, steps, around, empty, aiding, aided
    )
    return about(course, states)


FOLLOWED = (at.S, at.V, at.A, at.TILT, at.LAG, at.Y_BEND)
"""States about which to linearise anew: of the train, and how its body follows cant and curves.

Not those of the body in its track: what multiplies them is a motion of the body as well, and a smoothed
motion is smaller than the true one, so that a state that is constant would make up for the product.
"""


def about(course: Course, states: FloatArray) -> Course:
    """The course with states (n, 52) to linearise about; of those, what is `FOLLOWED`."""
    followed = np.zeros_like(states)
    followed[:, FOLLOWED] = states[:, FOLLOWED]
    speed, dt = states[:, at.V], course.steps.dt
    jerk = _jerk(course.steps, speed, states[:, at.A], stands_mps(course.recording))
    around = course.around._replace(states=followed, jerk=jerk, sense=_sense(speed))
    return course._replace(around=around, way=0.5 * dt * (speed + np.concatenate([speed[:1], speed[:-1]])))


def linearised(course: Course, rows: slice) -> Model:
    """Linear model of some of the steps."""
    whole, steps = course.around, course.steps
    around = whole._replace(states=whole.states[rows], jerk=whole.jerk[rows], sense=whole.sense[rows])
    ground, n = ground_at(course.recording, course.lines, around.states[:, at.S]), len(around.jerk)
    x = duals(around.states)
    pose = pose_of(x, ground, around)
    beside = [row for kind in course.aiding for row in kind.shown(x, pose)]
    values, columns, coefficients = table_of([*shown(x, ground, around, pose), *beside], n)
    _, said_columns, said = table_of(told(x, ground, around, pose), n)
    # z - h(x0) - H (x - x0) = (z - h(x0) + H x0) - H x
    constant = np.einsum("nmw,nmw->nm", coefficients, around.states[:, columns])
    measured = np.hstack([steps.signals[rows], course.aided.values[rows]])
    return Model(
        columns=columns,
        coefficients=coefficients,
        measured=np.ascontiguousarray(measured - values + constant),
        variances=_variances(course, rows),
        flows=_flows(course, ground, rows),
        said_columns=said_columns,
        said=said,
        dt=steps.dt,
        noise=course.noise,
    )


def _variances(course: Course, rows: slice) -> FloatArray:
    """Of the measurements (n, m); infinite where one is not made."""
    sheet, steps, motion = course.recording.imu_sheet, course.steps, course.motion
    rate = 1.0 / steps.dt
    moves = (np.abs(course.around.states[rows, at.V]) / AT_MPS) ** 3 * (rate / MOTION_RATE_HZ)
    gyro = sheet.gyro_noise_radpsqrts**2 * rate + LEAST_GYRO_RADPS**2
    accel = sheet.accel_noise_mpsqrts**2 * rate + LEAST_ACCEL_MPS2**2
    own = (motion.accel_x, motion.accel_y, motion.accel_z)
    rocks = motion.rocking**2
    rates = [gyro + rest + motion.gyro**2 * moves for rest in (rocks, rocks, 0.0)]
    stands = np.abs(course.around.states[rows, at.V]) < stands_mps(course.recording)
    rests = np.outer((0.0, 0.0, motion.heaving**2), stands)
    forces = [accel + rest + sd**2 * moves for sd, rest in zip(own, rests, strict=True)]
    columns = [*rates, *forces]
    return np.ascontiguousarray(np.column_stack([*columns, course.aided.variances[rows]]))


def _flows(course: Course, ground: Ground, rows: slice) -> FloatArray:
    """`simrail.estimators.track_relative.kernel.FLOWS` of each step, over the way that leads there."""
    way, place = course.way[rows], course.around.states[:, at.S]
    before = place[max(rows.start - 1, 0)]
    out = np.ones((len(way), FLOWS))
    curvature = ground.frame.rates[:, 2]
    scale = scale_of(course.recording)
    bent = scale * SATURATION_RADIUS_M * curvature
    flank = bent / np.sqrt(1.0 + bent * bent)
    out[:, 0], out[:, 1] = np.abs(way), way
    out[:, 2], out[:, 3], out[:, 4] = way * curvature, -way * ground.even, -way * ground.odd
    out[:, 5], out[:, 6] = np.maximum(flank, 0.0), np.maximum(-flank, 0.0)
    element, curve, vertical = numbers_at(course.lines, np.concatenate([[before], place[rows]]))
    slips = course.steps.slipping[rows]
    out[:, 12] = np.where(slips, LOST_M**2, CurveMatchedOdometry().wheel_walk_m * np.abs(way))
    if not course.around.in_time:
        out[:, 13] = np.exp(-np.abs(way) / course.around.slow_m)
    out[:, 7] = np.where(vertical[1:] > 0.0, np.exp(-np.abs(way) / (scale * VERTICAL_LENGTH_M)), 1.0)
    out[np.diff(curve) != 0, 8:10] = 0.0
    # Element i lies between joints i and i + 1: a train from below has i behind it and meets i + 1, one
    # from above keeps i + 1 and meets i.
    step, odd = np.diff(element), element[1:] % 2 == 1
    up, down = (step > 0) | (np.abs(step) > 1), (step < 0) | (np.abs(step) > 1)
    out[(up & odd) | (down & ~odd), 10] = 0.0
    out[(up & ~odd) | (down & odd), 11] = 0.0
    return out


def _sense(speed: FloatArray) -> FloatArray:
    """Direction of travel (n,), 1 or -1: held where the train stands, 1 before it moves."""
    last = np.maximum.accumulate(np.where(np.abs(speed) > DIRECTION_SPEED_MPS, np.arange(len(speed)), -1))
    return np.where((last >= 0) & (speed[np.maximum(last, 0)] < 0.0), -1.0, 1.0)


def stands_mps(recording: Recording) -> float:
    """`STANDS_MPS` of a vehicle of any scale: under the same gravity speeds are by the root of it."""
    return math.sqrt(scale_of(recording)) * STANDS_MPS


def _jerk(
    steps: Steps, speed: FloatArray, acceleration: FloatArray, stands: float = STANDS_MPS
) -> FloatArray:
    """Slope (n,) of the acceleration; no later value enters."""
    at_once = _slope(steps.signals[:, len(GYRO)], steps.dt, START_JERK_S)
    at_once[steps.resting & (np.abs(at_once) < LEAST_JERK_MPS3)] = 0.0
    return np.where(np.abs(speed) < stands, at_once, _slope(acceleration, steps.dt, JERK_S))


def _slope(values: FloatArray, dt: float, over_s: float) -> FloatArray:
    """Backward difference (n,) over a time."""
    back = max(1, round(over_s / dt))
    longer = np.concatenate([np.repeat(values[:1], back), values])
    return np.asarray((values - longer[: len(values)]) / (back * dt))
