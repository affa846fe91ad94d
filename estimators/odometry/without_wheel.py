"""Odometry from an IMU and a map: a speed that every stop puts right, a place that every curve does.

The zero-velocity odometry gives speed and pitch without any map, and says how sure it is
(`simrail.estimators.odometry.zero_velocity`). Its way takes the place of the wheel's. The place is then
matched as with a wheel: the body's heading, integrated from the gyros, is the map's; and so is its pitch,
which locates a train wherever the gradient changes. States beside those of the wheel's filter
(`simrail.estimators.odometry.curve_matched`), in place of what only a wheel has:

    tilt        rad, error of the reckoned acceleration, over g
    offset      m/s2, error of the accelerometer's offset: the pitch is off by tilt + offset / g
    scale       relative error of the accelerometer's scale, which no stop shows
    level       rad, by how much the body leans in its track at rest
    bump        rad, pitch of the body in the track and of the track in the map (Markov in distance)
    grade       rad, error of the map's gradient (Markov in distance)
    gyro scale  relative error of the scale of the gyro about Z
    squat       here rad per g: a body pitches under traction and braking

**How the reckoned speed errs.** Not as a wheel's does. An error of the tilt makes one of the speed that grows
until the next stop takes it away, and the way errs by the integral of that. The errors of speed, acceleration
and offset, e, are linear in those of the zero-velocity filter, which knows how they vary and how those of two
steps hang together. The process that has these covariances is

    e(k+1) = A e(k) + w,   A = C' P(k)^-1,   Q = P(k+1) - A P(k) A'

with P(k) = cov(e(k)) and C = cov(e(k), e(k+1))
(`simrail.estimators.odometry.without_wheel_kernel.neighbours`). For a smoother they are those of the smoothed
speed, whose error goes back to nothing before a stop as it grew after the last one. For a filter they are
those before the updates of a step, and the stops are this filter's as well: what the speed is off when the
train stands tells how far the way since the last stop is off. The place has no process noise of its own.

**Where the place is not known to a metre** a tangent to the map would be that of one place, a straight as
well as a curve. There it is the line that fits best over all places where the train may be
(`simrail.estimators.odometry.line_table.line_over`), and what that leaves over is one error for as long as
the train runs through them.

Not here: the loops (`simrail.estimators.odometry.without_wheel_kernel`).
"""

import math

import numpy as np
from simrail.estimators.kalman import fixed_interval, room_for_history
from simrail.estimators.odometry.kernel import (
    SCALE,
    SQUAT,
    YAW,
    LineModel,
    S,
    Steps,
    V,
    room_to_work,
)
from simrail.estimators.odometry.line_table import line_at, line_under
from simrail.estimators.odometry.without_wheel_kernel import (
    BUMP,
    GRADE,
    GYRO_SCALE,
    LEVEL,
    OFFSET,
    ROWS,
    STATES,
    TILT,
    Reckoned,
    SlopeModel,
    neighbours,
    without_wheel,
)
from simrail.estimators.odometry.zero_velocity import Trace, ZeroVelocityOdometry
from simrail.estimators.odometry.zero_velocity_kernel import DRIFT_Y, DRIFT_Z, PITCH, PUSH, REST, ROLL
from simrail.estimators.odometry.zero_velocity_kernel import STATES as RECKONED_STATES
from simrail.estimators.odometry.zero_velocity_kernel import V as RECKONED_V

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

LEVEL_SD_RAD = 5e-3
"""Of a body that leans in its track at rest, and of an IMU in it."""

BUMP_SD_RAD, BUMP_LENGTH_M = 1e-3, 8.0
"""Pitch of a body by rails that are not the map's, and over what distance it changes."""

GRADE_LENGTH_M = 300.0
"""Over which the error of the map's gradient changes: from one gradient to the next."""

SLOPE_SD_RAD = 2e-4
"""White part of the pitch."""


def steps_without_wheel(
    recording: Recording, x: FloatArray, p: FloatArray, model: LineModel, *, smoothed: bool
) -> Steps:
    """Run the filter, and the smoother if wanted; ``x``, ``p`` and ``model`` are those of a wheel's filter.

    Raises
    ------
    InputError
        If there is no vertical signal, or the ride does not begin at rest.
    """
    trace = ZeroVelocityOdometry(smoothed=smoothed).trace(recording, remembering=True)
    reckoned, first = reckoned_of(trace, recording, smoothed=smoothed)
    n, gravity = len(trace.time_s), recording.gravity_mps2
    grid, table = line_under(recording)
    x, p = _begin(recording, x, p, first)
    x[YAW] = line_at(grid, table, x[S]).heading
    spoken_of = STATES if smoothed else V + 1
    dt = trace.model.step_s
    steps = Steps(
        rate_hz=1.0 / dt,
        time_s=np.array(trace.time_s),  # a view that is read only would be compiled for anew
        states=np.empty((n, STATES)),
        covariance=np.empty((n, spoken_of, spoken_of)),
        acceleration=trace.found.acceleration,
        slipping=np.ones(n, dtype=bool),
        resting=reckoned.rests > 0.0,
    )
    past = room_for_history(n if smoothed else 0, STATES, ROWS)
    slopes = SlopeModel(
        bump_sd_rad=BUMP_SD_RAD,
        bump_length_m=BUMP_LENGTH_M,
        grade_sd_rad=recording.map_errors.gradient_sd,
        grade_length_m=GRADE_LENGTH_M,
        slope_sd_rad=SLOPE_SD_RAD,
    )
    without_wheel(dt, reckoned, model, slopes, gravity, grid, table, x, p, steps, room_to_work(STATES), past)
    if smoothed:
        fixed_interval(past, steps.states, steps.covariance)
    return steps


def reckoned_of(trace: Trace, recording: Recording, *, smoothed: bool) -> tuple[Reckoned, FloatArray]:
    """What the zero-velocity odometry says, how that errs, and the covariance (3, 3) of its first error."""
    states, n = trace.found.states, len(trace.time_s)
    roll, pitch, gravity = states[:, ROLL], states[:, PITCH], recording.gravity_mps2
    rates = trace.model.signals[:, 1:3] - states[:, [DRIFT_Y, DRIFT_Z]]
    rates[:, 1] += states[:, DRIFT_Z]  # that of the gyro about Z is a state
    picked = np.zeros((3, RECKONED_STATES))
    picked[0, RECKONED_V] = 1.0
    picked[1, PITCH], picked[1, PUSH] = gravity, -1.0
    picked[2, PUSH] = 1.0
    before, crossed, after = np.zeros((3, n, 3, 3))
    neighbours(trace.past, picked, smoothed, before, crossed, after)
    transitions, noises = process_of(before, crossed, after)
    ahead = states if smoothed else trace.past.states
    offset = states[:, PUSH] - ahead[:, PUSH]
    reckoned = Reckoned(
        predicted=ahead[:, RECKONED_V] * np.cos(ahead[:, PITCH]),
        speed=states[:, RECKONED_V] * np.cos(pitch),
        acceleration=trace.found.acceleration,
        pitch=np.ascontiguousarray(pitch),
        turning=(np.sin(roll) * rates[:, 0] + np.cos(roll) * rates[:, 1]) / np.cos(pitch),
        rests=(trace.found.log_odds > trace.model.surely).astype(np.float64),
        shifts=np.column_stack([gravity * (pitch - ahead[:, PITCH]) - offset, offset]),
        transitions=transitions,
        noises=noises,
        rest_variance=math.inf if smoothed else trace.model.noise[REST],
    )
    return reckoned, after[:1].sum(axis=0)


def process_of(before: FloatArray, crossed: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A and Q (n, m, m) of the process that has these covariances; A of the first step is 1, Q is 0.

    Parameters
    ----------
    before, crossed, after : ndarray (n, m, m)
        cov(e(k-1), e(k-1)), cov(e(k-1), e(k)), cov(e(k), e(k)).
    """
    transitions, noises = np.tile(np.eye(before.shape[1]), (len(after), 1, 1)), np.zeros_like(after)
    transitions[1:] = np.linalg.solve(before[1:], crossed[1:]).transpose(0, 2, 1)
    noises[1:] = after[1:] - transitions[1:] @ before[1:] @ transitions[1:].transpose(0, 2, 1)
    # Rounding leaves less than nothing where hardly anything is added.
    values, vectors = np.linalg.eigh(0.5 * (noises + noises.transpose(0, 2, 1)))
    noises = np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, 0.0), vectors)
    return transitions, np.ascontiguousarray(noises)


def _begin(
    recording: Recording, x: FloatArray, p: FloatArray, first: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """State and covariance of a start with the states that are not the wheel's in place of those that are."""
    sheet = recording.imu_sheet
    x, sd = np.append(x, 0.0), np.append(np.sqrt(np.diagonal(p)), 0.0)
    x[V], x[TILT : SQUAT + 1] = 0.0, 0.0
    sd[[V, TILT]] = 0.0
    sd[SCALE] = sheet.accel_scale_error / math.sqrt(3.0)
    sd[LEVEL] = LEVEL_SD_RAD
    sd[BUMP], sd[GRADE] = BUMP_SD_RAD, recording.map_errors.gradient_sd
    sd[GYRO_SCALE] = sheet.gyro_scale_error / math.sqrt(3.0)
    start = np.diag(sd**2)
    to = np.zeros((STATES, 3))
    to[[V, TILT, OFFSET], range(3)] = 1.0, 1.0 / recording.gravity_mps2, 1.0
    return x, start + to @ first @ to.T
