"""Compiled loops of Veillard et al. 2016 (paper 003): complementary filter, Kalman filter of eleven states.

Equations are those of EQUATIONS 4. Nothing here knows of recordings or data frames.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import chain, chain_covariance, condition, mirror

from simrail.core.jit import FloatArray, njit, njit_inline

STATES = 11
ROLL_RATE, PITCH_RATE, YAW_RATE, ROLL, PITCH, AX, AY, AZ, V, BIAS_X, BIAS_Y = range(STATES)
"""State of paper 003, Eq. 5: Euler rates, roll and pitch, acceleration in body axes, speed, gyro biases."""

ROWS = 9
"""Measurements of Eq. 5: gyro, accelerometer, roll and pitch by the complementary filter, speed."""

WIDTH = 12
"""Length of a covariance's row in the loop: the last entry is always zero, and fills the vector registers."""

MIRRORED = 16
"""Steps from one time that the covariance is made symmetric to the next: what rounding adds in so many is
some 1e-15 of it."""

INTO = (ROLL, PITCH, V)
ORIGIN = (ROLL_RATE, PITCH_RATE, AX)
"""Where F is not the identity (Eq. 6), as `simrail.estimators.kalman.chain` takes it."""


class Model(NamedTuple):
    """What the filter takes of a ride of n samples.

    Attributes
    ----------
    signals : ndarray (n, 6)
        Angular rate less the bias that is known, rad/s, and specific force, m/s2, body axes.
    speed : ndarray (n,)
        Signed speed that has become known at a sample, m/s; NaN where none has.
    process : ndarray (11,)
        Diagonal of Q of a step.
    noise : ndarray (9,)
        Diagonal of R.
    start, start_variance : ndarray (11,)
        State before the first update, and its variances.
    late : int
        Samples by which a speed is older than the sample at which it becomes known.
    compensated : bool
        Take the motion that the filter knows off the accelerometer, and its biases off the gyro, before the
        complementary filter gets them.
    time_constant_s, step_s, gravity : float
        Of the complementary filter, s; sample interval, s; gravity, m/s2.
    """

    signals: FloatArray
    speed: FloatArray
    process: FloatArray
    noise: FloatArray
    start: FloatArray
    start_variance: FloatArray
    late: int
    compensated: bool
    time_constant_s: float
    step_s: float
    gravity: float


Turns = tuple[float, float, float, float]
"""Sine and cosine of roll, then of pitch."""


class Found(NamedTuple):
    """States and their variances, both (n, 11), innovations (n, 7): of gyro and accelerometer, then NIS."""

    states: FloatArray
    variances: FloatArray
    innovations: FloatArray


def room(n: int) -> Found:
    """Room for what a filter finds."""
    return Found(np.empty((n, STATES)), np.empty((n, STATES)), np.empty((n, 7)))


@njit_inline
def complementary_step(
    roll: float, pitch: float, x: float, y: float, z: float, step_s: float
) -> tuple[float, float]:
    """Roll and pitch led on by the gyro after its cross-coupling is taken out (EQUATIONS 0).

    roll' = w_x + (w_y sin roll + w_z cos roll) tan pitch,   pitch' = w_y cos roll - w_z sin roll
    """
    sine, cosine = math.sin(roll), math.cos(roll)
    return (
        roll + step_s * (x + (y * sine + z * cosine) * math.tan(pitch)),
        pitch + step_s * (y * cosine - z * sine),
    )


@njit
def complementary(
    rate: FloatArray, level: FloatArray, yaw: float, time_constant_s: float, step_s: float, angles: FloatArray
) -> None:
    """Run the complementary filter (paper 003, Eq. 3, with H1 = 1 / (1 + T s) and H2 = 1 - H1).

        inc <- c (inc + step rate) + (1 - c) level,      c = T / (T + step)

    Until a time constant has passed, (1 - c) is one over the number of samples: the filter then has no start
    to forget.

    Parameters
    ----------
    rate : ndarray (n, 3)
        Body rate that holds over the step that ends at each sample, rad/s; row 0 is not used.
    level : ndarray (n, 2)
        Roll and pitch by the accelerometer, rad.
    yaw : float
        At the first sample, rad; the gyro leads it on from there, which is not the paper's.
    time_constant_s, step_s : float
        T and the sample interval, s.
    angles : ndarray (n, 3), out
        Roll, pitch and yaw, rad.
    """
    roll, pitch = level[0, 0], level[0, 1]
    lasting = step_s / (time_constant_s + step_s)
    angles[0, 0], angles[0, 1], angles[0, 2] = roll, pitch, yaw
    for k in range(1, rate.shape[0]):
        share = max(lasting, 1.0 / (k + 1))
        y, z = rate[k, 1], rate[k, 2]
        yaw += step_s * (y * math.sin(roll) + z * math.cos(roll)) / math.cos(pitch)
        roll, pitch = complementary_step(roll, pitch, rate[k, 0], y, z, step_s)
        roll += share * (level[k, 0] - roll)
        pitch += share * (level[k, 1] - pitch)
        angles[k, 0], angles[k, 1], angles[k, 2] = roll, pitch, yaw


@njit_inline
def _correct(
    dx: FloatArray,
    p: FloatArray,
    v: FloatArray,
    gain: FloatArray,
    columns: tuple[int, int, int, int, int],
    row: tuple[float, float, float, float, float],
    error: float,
    variance: float,
) -> float:
    """Scalar update by a row of at most five entries, about the predicted state; returns e^2 / s."""
    a, b, c, d, f = columns
    ha, hb, hc, hd, hf = row
    for i in range(WIDTH):
        v[i] = ha * p[a, i] + hb * p[b, i] + hc * p[c, i] + hd * p[d, i] + hf * p[f, i]
    e = error - ha * dx[a] - hb * dx[b] - hc * dx[c] - hd * dx[d] - hf * dx[f]
    inverse = 1.0 / (ha * v[a] + hb * v[b] + hc * v[c] + hd * v[d] + hf * v[f] + variance)
    condition(dx, p, v, e, inverse, gain)
    nis: float = e * e * inverse
    return nis


@njit_inline
def _correct_one(
    dx: FloatArray, p: FloatArray, v: FloatArray, gain: FloatArray, state: int, error: float, variance: float
) -> float:
    """The same of a state that is measured itself."""
    for i in range(WIDTH):
        v[i] = p[state, i]
    e = error - dx[state]
    inverse = 1.0 / (v[state] + variance)
    condition(dx, p, v, e, inverse, gain)
    nis: float = e * e * inverse
    return nis


@njit_inline
def _turns(x: FloatArray) -> Turns:
    return math.sin(x[ROLL]), math.cos(x[ROLL]), math.sin(x[PITCH]), math.cos(x[PITCH])


@njit_inline
def _level(model: Model, k: int, x: FloatArray, turns: Turns) -> tuple[float, float]:
    """Roll and pitch by the accelerometer (paper 003, Eq. 4, its sign mended), or less the motion known.

    The motion is x'' along X and w x v, of which a curve is most.
    """
    fx, fy, fz = model.signals[k, 3], model.signals[k, 4], model.signals[k, 5]
    if model.compensated:
        sr, cr, _, cp = turns
        wy = cr * x[PITCH_RATE] + sr * cp * x[YAW_RATE]
        wz = cr * cp * x[YAW_RATE] - sr * x[PITCH_RATE]
        roll, along = math.atan2(fy - wz * x[V], fz + wy * x[V]), fx - x[AX]
    else:
        roll, along = math.atan(fy / model.gravity), fx
    return roll, -math.asin(min(1.0, max(-1.0, along / model.gravity)))


@njit_inline
def _correct_all(
    x: FloatArray,
    p: FloatArray,
    dx: FloatArray,
    v: FloatArray,
    gain: FloatArray,
    model: Model,
    k: int,
    turns: Turns,
    inclination: tuple[float, float],
    innovations: FloatArray,
) -> float:
    """Gyro, accelerometer and inclination (Eq. 7; Jacobian as EQUATIONS 4); returns their NIS."""
    signals, r, g = model.signals, model.noise, model.gravity
    sr, cr, sp, cp = turns
    thd, psd = x[PITCH_RATE], x[YAW_RATE]
    turn = cr * cp * psd - sr * thd  # what the gyro should show on Z
    e = innovations[k]
    e[0] = signals[k, 0] - x[ROLL_RATE] + sp * psd - x[BIAS_X]
    e[1] = signals[k, 1] - cr * thd - sr * cp * psd - x[BIAS_Y]
    e[2] = signals[k, 2] - turn
    e[3] = signals[k, 3] - x[AX] + g * sp
    e[4] = signals[k, 4] - x[AY] - g * sr * cp
    e[5] = signals[k, 5] - x[AZ] - g * cr * cp
    columns = (ROLL_RATE, YAW_RATE, PITCH, BIAS_X, V)
    nis = _correct(dx, p, v, gain, columns, (1.0, -sp, -cp * psd, 1.0, 0.0), e[0], r[0])
    columns = (PITCH_RATE, YAW_RATE, ROLL, PITCH, BIAS_Y)
    nis += _correct(dx, p, v, gain, columns, (cr, sr * cp, turn, -sr * sp * psd, 1.0), e[1], r[1])
    row = (-sr, cr * cp, -cr * thd - sr * cp * psd, -cr * sp * psd, 0.0)
    nis += _correct(dx, p, v, gain, columns, row, e[2], r[2])
    nis += _correct(dx, p, v, gain, (AX, ROLL, PITCH, V, V), (1.0, 0.0, -g * cp, 0.0, 0.0), e[3], r[3])
    row = (1.0, g * cr * cp, -g * sr * sp, 0.0, 0.0)
    nis += _correct(dx, p, v, gain, (AY, ROLL, PITCH, V, V), row, e[4], r[4])
    row = (1.0, -g * sr * cp, -g * cr * sp, 0.0, 0.0)
    nis += _correct(dx, p, v, gain, (AZ, ROLL, PITCH, V, V), row, e[5], r[5])
    nis += _correct_one(dx, p, v, gain, ROLL, inclination[0] - x[ROLL], r[6])
    return nis + _correct_one(dx, p, v, gain, PITCH, inclination[1] - x[PITCH], r[7])


@njit
def eleven_states(model: Model, out: Found) -> None:
    """Run complementary filter and Kalman filter together (paper 003, Eqs. 3 to 7; EQUATIONS 4).

    Scalar updates, each linearised at the predicted state, which equals the block update: R is diagonal. A
    speed that has become known now but is `late` samples old is compared with the present one less what the
    filter has added to it since,

        v(k - late) = v(k) - sum of step ax,

    so that its row is that of the present speed. What is wrong in so short a sum (0.1 m/s of a pitch wrong by
    0.3 degrees over two seconds) is left to R.
    """
    signals, dt, lasting = model.signals, model.step_s, model.step_s / (model.time_constant_s + model.step_s)
    x, p = model.start.copy(), np.zeros((STATES, WIDTH))
    v, dx, gain = np.zeros(WIDTH), np.zeros(STATES), np.zeros(STATES)
    ring, steps = model.late + 1, (dt, dt, dt)
    added, total = np.zeros(ring), 0.0  # to the speed so far, at each of the last samples
    turns = _turns(x)
    roll, pitch = _level(model, 0, x, turns)
    for i in range(STATES):
        p[i, i] = model.start_variance[i]
    for k in range(signals.shape[0]):
        if k > 0:
            total += dt * x[AX]
            chain(x, INTO, ORIGIN, steps)
            chain_covariance(p, INTO, ORIGIN, steps)
            if k % MIRRORED == 0:
                mirror(p)
            for i in range(STATES):
                p[i, i] += model.process[i]
            fed_x, fed_y = (x[BIAS_X], x[BIAS_Y]) if model.compensated else (0.0, 0.0)
            y, z = signals[k, 1] - fed_y, signals[k, 2]
            roll, pitch = complementary_step(roll, pitch, signals[k, 0] - fed_x, y, z, dt)
            share, turns = max(lasting, 1.0 / (k + 1)), _turns(x)
            roll_m, pitch_m = _level(model, k, x, turns)
            roll += share * (roll_m - roll)
            pitch += share * (pitch_m - pitch)
        added[k % ring] = total
        for i in range(STATES):
            dx[i] = 0.0
        nis = _correct_all(x, p, dx, v, gain, model, k, turns, (roll, pitch), out.innovations)
        if not math.isnan(model.speed[k]):
            error = model.speed[k] - x[V] + total - added[(k + 1) % ring]
            nis += _correct_one(dx, p, v, gain, V, error, model.noise[8])
        out.innovations[k, 6] = nis
        for i in range(STATES):
            x[i] += dx[i]
            out.states[k, i], out.variances[k, i] = x[i], p[i, i]
