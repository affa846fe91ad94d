"""From the states of the track-relative smoother, at its steps, to an estimate at every sample of the IMU.

The attitude is that of the map at the place found, turned about the vertical by the heading that the map has
not, and then by the body's small turn in the map's track. Between its steps the smoother's answer is a cubic
spline; the filter's goes on from the last step with the rates found there. Before its first step the filter
knows what was known before the ride.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import table_of
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import Around, duals, pose_of, told
from simrail.estimators.track_relative.model import Course

from simrail.core.columns import (
    ATTITUDE,
    ATTITUDE_SD,
    BOUND,
    FAULT,
    INNOVATION,
    ODOMETRY,
    RATE_INNOVATION,
    RELATIVE_POSITION,
    RELATIVE_POSITION_SD,
)
from simrail.core.jit import FloatArray, IntArray
from simrail.core.rotation import euler_angles, rotation_matrix

SD_COLUMNS = (*ATTITUDE_SD, "position_sd_m", "speed_sd_mps", *RELATIVE_POSITION_SD)
"""Standard deviations, in the order of the kernel's outputs: the first of them."""

MOST_STEPS_AHEAD = 2.0
"""The filter does not go on from a step for longer than this: the last one of a ride may be a gap ago."""


SAMPLES = 1 << 15
"""Of the IMU, answered at a time: rotation matrices of a whole long ride would be most of its memory."""


class Trace(NamedTuple):
    """All that is estimated, at n steps.

    Attributes
    ----------
    course : Course
        About which the last pass was linearised.
    states : ndarray (n, 52)
    covariance : ndarray (n, 8, 8)
        Of roll, pitch, yaw, S, V, y, z, and the roll that is the rails'.
    surprises : ndarray (n, m)
        Innovations of the filter over their standard deviations, the IMU's six first;
        NaN for a measurement that was not made.
    log_likelihood : float
        Of all measurements, but for a constant.
    """

    course: Course
    states: FloatArray
    covariance: FloatArray
    surprises: FloatArray
    log_likelihood: float


def states_of(trace: Trace, *, causal: bool) -> pd.DataFrame:
    """Estimate at every IMU sample: between steps, or, if causal, from the last one on."""
    index = trace.course.recording.imu.index
    time = index.to_numpy(dtype=np.float64)
    columns = [*ATTITUDE, *ODOMETRY, *RELATIVE_POSITION, *SD_COLUMNS]
    table = np.empty((len(time), len(columns)))
    look = _from_steps(trace) if causal or not len(trace.states) else _between_steps(trace)
    for first in range(0, len(time), SAMPLES):
        rows = slice(first, first + SAMPLES)
        values, sd = look(time[rows])
        table[rows] = np.column_stack([_attitude(trace.course, values), values[:, 4:], sd])
    return pd.DataFrame(table, index=index, columns=columns)


def with_bounds(states: pd.DataFrame, trace: Trace, faults: FloatArray, widening: FloatArray) -> pd.DataFrame:
    """States with bounds of roll and place, and faults.

    Both are given (1 + n,), before the first step and at the end of each.
    """
    step = _last_step(trace, states.index.to_numpy(dtype=np.float64)) + 1
    sds = ("roll_sd_rad", "position_sd_m")
    bounds = {name: widening[step] * states[sd] for name, sd in zip(BOUND, sds, strict=True)}
    return states.assign(**bounds, **{FAULT: faults[step]})


Look = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""From times (m,) to what is found there, (m, 9) as in `_found`, and standard deviations, (m, 7)."""


def _from_steps(trace: Trace) -> Look:
    """Each time from the last step that is over."""
    steps = trace.course.steps
    known, known_sd = _before(trace.course)
    values, rates = _found(trace.course, trace.states, trace.course.around)
    values, rates = np.vstack([known, values]), np.vstack([np.zeros_like(known), rates])
    sd = np.vstack([known_sd, _sds(trace)])
    start = trace.course.recording.imu.index[0] - steps.dt
    ends = np.concatenate([[start], steps.time_s])

    def look(time: FloatArray) -> tuple[FloatArray, FloatArray]:
        last = _last_step(trace, time) + 1
        ahead = np.minimum(time - ends[last], MOST_STEPS_AHEAD * steps.dt)[:, None]
        return values[last] + ahead * rates[last], sd[last]

    return look


def _between_steps(trace: Trace) -> Look:
    """Cubic splines, since a step is a fifth of the shortest waves of the rails; beyond the ends as there."""
    at_s = trace.course.steps.time_s
    values, _ = _found(trace.course, trace.states, trace.course.around)
    sd = _sds(trace)
    spline = CubicSpline(at_s, values) if len(at_s) > 1 else None

    def look(time: FloatArray) -> tuple[FloatArray, FloatArray]:
        sure = np.column_stack([np.interp(time, at_s, column) for column in sd.T])
        if spline is None:
            return values[np.zeros(len(time), dtype=np.int64)], sure
        return spline(np.clip(time, at_s[0], at_s[-1])), sure

    return look


def _sds(trace: Trace) -> FloatArray:
    """Standard deviations (n, 7) of what is in `SD_COLUMNS`."""
    variances = np.diagonal(trace.covariance, axis1=1, axis2=2)[:, : len(SD_COLUMNS)]
    return np.asarray(np.sqrt(np.maximum(variances, 0.0)))


def innovations_of(trace: Trace) -> pd.DataFrame:
    """Innovations over their standard deviations, of the last step before each sample; 0 before the first."""
    time = trace.course.recording.imu.index.to_numpy(dtype=np.float64)
    seen = np.vstack([np.zeros(6), trace.surprises[:, :6]])[_last_step(trace, time) + 1]
    table = np.column_stack([seen, (seen**2).sum(axis=1)])
    index = trace.course.recording.imu.index
    return pd.DataFrame(table, index=index, columns=[*RATE_INNOVATION, *INNOVATION])


def _last_step(trace: Trace, time: FloatArray) -> IntArray:
    """Number of the last step that is over at each time; -1 before the first."""
    return np.searchsorted(trace.course.steps.end_s, time + 1e-9, side="right") - 1


def _found(course: Course, states: FloatArray, around: Around) -> tuple[FloatArray, FloatArray]:
    """Small turn (three), heading, S, V, A, y and z at n steps, and their rates: (n, 9) each."""
    around = around._replace(states=states)
    ground, x = ground_at(course.recording, course.lines, states[:, at.S]), duals(states)
    pose = pose_of(x, ground, around)
    none = np.zeros(len(states))
    turn, turning = (angle.value for angle in pose.rho), (rate.value for rate in pose.rho_rate)
    values = [*turn, *states[:, [at.HEADING, at.S, at.V, at.A]].T, pose.y.value, pose.z.value]
    rates = [*turning, none, states[:, at.V], states[:, at.A], none, pose.y_rate.value, pose.z_rate.value]
    return np.column_stack(values), np.column_stack(rates)


def _before(course: Course) -> tuple[FloatArray, FloatArray]:
    """What is known before the ride, (1, 9), and the standard deviations of `SD_COLUMNS`, (1, 7)."""
    states = course.start[None, :]
    around = course.around._replace(states=states, jerk=np.zeros(1), sense=np.ones(1))
    values, _ = _found(course, states, around)
    ground, x = ground_at(course.recording, course.lines, states[:, at.S]), duals(states)
    _, columns, rows = table_of(told(x, ground, around, pose_of(x, ground, around)), 1)
    outputs = np.zeros((len(columns), at.STATES))
    np.add.at(outputs, (np.arange(len(columns))[:, None], columns), rows[0])
    covariance = outputs @ course.start_covariance[:, : at.STATES] @ outputs.T
    return values, np.sqrt(np.diagonal(covariance))[None, : len(SD_COLUMNS)]


def _attitude(course: Course, values: FloatArray) -> FloatArray:
    """Roll, pitch and yaw (n, 3)."""
    track = course.recording.track
    frame = track.frame(np.clip(values[:, 4], track.start_m, track.end_m))
    heading = frame.yaw_rad + values[:, 3]
    base = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, heading]))
    angles = euler_angles(base @ rotation_matrix(values[:, :3]))
    # Counted as the map counts it, whole turns included.
    angles[:, 2] += 2.0 * np.pi * np.round((heading - angles[:, 2]) / (2.0 * np.pi))
    return angles
