"""Noise that the attitude EKF assumes: paper 000's two settings, and the recommended one.

Kept apart from the filter because it is a matter of judgement, and the filter is not.

**The recommended setting** follows from the data sheet, the rests and one allowance for the
body's own motion. Gravity corrects roll and pitch with the time constant tau = sqrt(R Ts / Qc) / g
(EQUATIONS 2.3), and the error of an angle has three parts that tau trades against each other:

* gyro white noise N leaves the variance N^2 tau / 2;
* a constant residual gyro bias b leaves the offset b tau;
* white acceleration of variance R per sample leaves the variance R Ts / (2 g^2 tau).

Their sum is least where R Ts / (g tau)^2 = N^2 + 4 b^2 tau, and the left-hand side is the intensity Qc
that gives this tau. So **Qc = N^2 + 4 b^2 tau**, solved together with tau: the filter has the best time
constant, and the variance that it states, N^2 tau + 4 b^2 tau^2, is a little above the one that the three
parts add up to, N^2 tau + 3 b^2 tau^2.

b^2 = N^2 / T + 2 B^2 after T seconds of rest: the mean's white noise, and the in-run bias now and
during the rest, each with variance B^2. Before and without a rest, the turn-on bias (b_max^2 / 3) counts.

R is the sum of

* the accelerometer's white noise;
* the body's own motion in the track frame, which the compensation leaves in. It is far from white: a
  displacement is bounded, so nothing is left of it at low frequencies. A swing with the velocity sd u
  disturbs the angle by u / (g tau), white noise by sqrt(R Ts / (2 tau)) / g, hence the allowance
  R Ts = 2 u^2 / tau. u is proportional to speed, so at rest the filter believes the accelerometer;
* errors of the odometry through the compensation V^2 k(s): a wrong place shows in transitions, a wrong
  speed in curves. They last longer than tau, so a variance v of acceleration counts as R Ts = v tau.

R is therefore what disturbs the angle as much as the true disturbance, not the variance of a sample: the
NIS of a ride is well below 3 at low speed and is a test of the matched model only.

**The accelerometer's turn-on bias** is the floor under all of this: nothing here can tell it from tilt
(2 mg is 0.11 deg). It does not enter the gain. The stated covariance holds it as a constant of known
variance ("considered"), and likewise the yaw that the residual gyro bias adds up to.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.attitude.rest_bias import RestBias

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.core.jit import FloatArray, njit, njit_borrowed, njit_inline
from simrail.recording.recording import ImuSheet, Recording, odometry_of, rows_of

PAPER = {"paper_initial": (1e-2, 1.5e-2), "paper_final": (1e-3, 15.0)}
"""Paper 000, Section 6: the printed "Q_{k-1}" and the sd of the accelerometer in m/s2."""

TUNINGS = ("recommended", *PAPER)

SWING_PER_SPEED = 2e-3
"""Velocity sd of the body's swing in the track frame over train speed: 11 mm/s at 20 km/h and 39 mm/s
at 70 km/h, two to three times what the axle of the simulated bogie does on ERRI B176 low rails. The
optimum is flat: a factor of two either way changes the roll error in curves by a tenth at most."""

MODEL_RATE_INTENSITY = 1e-10
"""rad2/s: what sampling and first-order integration leave; a perfect IMU still gets a finite tau."""

MODEL_FORCE_SD = 1e-3
"""m/s2: rounding of counts and of the gravity model; keeps a noiseless accelerometer's R positive."""

_BLOCK = 64
"""Samples whose time constants are worked out together, several in one instruction."""

_NEWTON_STEPS = 12
"""More than any start needs."""

_NEAR, _DONE = 0.1, 1e-9
"""Step of Newton's method over tau up to which a start counts as near, and after which all is rounding."""


class Noise(NamedTuple):
    """Noise per sample, n samples.

    Attributes
    ----------
    process : ndarray (n,)
        Variance that a step adds to every angle, rad2.
    force : ndarray (n, 3)
        Variance of the specific force, (m/s2)^2.
    considered : ndarray (n, 3)
        Variance of roll, pitch, yaw from constants that are not estimated, rad2.
    """

    process: FloatArray
    force: FloatArray
    considered: FloatArray


def paper_noise(recording: Recording, tuning: str, *, reading: str) -> Noise:
    """Settings of paper 000, in one of two readings of its Q_{k-1} (EQUATIONS 2.3).

    Parameters
    ----------
    recording : Recording
        For its number of samples and rate.
    tuning : str
        ``"paper_initial"`` or ``"paper_final"``.
    reading : str
        ``"per_step"``: the printed number is added at every step, as the text has it (final: tau =
        0.19 s). ``"intensity"``: it is the k of Q = k Ts (final: tau = 3.0 s).
    """
    printed, sd = PAPER[tuning]
    n = len(recording.imu)
    step = printed / recording.imu_sheet.rate_hz if reading == "intensity" else printed
    return Noise(np.full(n, step), np.full((n, 3), sd**2), np.zeros((n, 3)))


def recommended_noise(
    recording: Recording, rest: RestBias, *, curves: FloatArray | None, vibration: float = SWING_PER_SPEED
) -> Noise:
    """Settings that follow from the data sheet; the module's docstring derives them.

    Every value uses the past alone.

    Parameters
    ----------
    recording : Recording
        Its data sheet and odometry are used.
    rest : RestBias
        How much rest the gyro bias was averaged over.
    curves : ndarray (4, n) or None
        What the compensation is made of (`simrail.estimators.attitude.compensation.GravityForce`); None for a
        filter without, which no odometry can disturb.
    vibration : float
        Velocity sd of the body in the track frame, as a fraction of train speed.
    """
    sheet, gravity = recording.imu_sheet, recording.gravity_mps2
    n = len(recording.imu)
    step_s = 1.0 / sheet.rate_hz
    motion = odometry_of(recording)
    speed, place_sd, speed_sd, push_sd = rows_of(motion, (ODOMETRY[1], *ODOMETRY_SD))
    curves = np.empty((4, 0)) if curves is None else curves
    white = sheet.gyro_noise_radpsqrts**2 + MODEL_RATE_INTENSITY
    sensor = sheet.accel_noise_mpsqrts**2 + MODEL_FORCE_SD**2 * step_s
    noise = Noise(np.empty(n), np.empty((n, 3)), np.empty((n, 3)))
    bias = bias_variance(sheet, rest.samples * step_s)
    level = sheet.accel_turn_on_bias_mps2**2 / 3.0 / gravity**2
    given = step_s, gravity, white, sensor, vibration, level
    _fill(np.array(given), bias, rest.samples, speed, place_sd, speed_sd, push_sd, curves, *noise)
    return noise


@njit
def _fill(
    given: FloatArray,
    bias: FloatArray,
    samples: FloatArray,
    speed: FloatArray,
    place_sd: FloatArray,
    speed_sd: FloatArray,
    push_sd: FloatArray,
    curves: FloatArray,
    process: FloatArray,
    force: FloatArray,
    considered: FloatArray,
) -> None:
    """Work out what the module's docstring derives, by blocks; ``curves`` of no columns is no frame."""
    step_s, gravity, white, sensor, vibration, level = given
    swing, growth, tau, is_open = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    third, near, n = white * gravity**2, 0.0, speed.shape[0]
    for begin in range(0, n, _BLOCK):
        count = min(_BLOCK, n - begin)
        for j in range(count):
            swing[j] = (vibration * speed[begin + j]) ** 2
            growth[j] = 4.0 * bias[begin + j] * gravity**2
        _time_constants(sensor, third, swing, growth, near, count, tau, is_open)
        near = tau[count - 1]
        for j in range(count):
            i = begin + j
            of_body = (sensor + 2.0 * swing[j] / tau[j]) / step_s
            force[i, 0] = force[i, 1] = force[i, 2] = of_body
            considered[i, 0] = considered[i, 1] = level
            considered[i, 2] = bias[i] * ((i - samples[i]) * step_s) ** 2
            process[i] = (white + 4.0 * bias[i] * tau[j]) * step_s
        if curves.shape[1] == 0:
            continue
        for j in range(count):
            i = begin + j
            share, square, twice = tau[j] / step_s, speed[i] ** 2, 2.0 * speed[i] * speed_sd[i]
            along = square * place_sd[i]
            force[i, 0] += push_sd[i] ** 2
            force[i, 1] += ((along * curves[1, i]) ** 2 + (twice * curves[0, i]) ** 2) * share
            force[i, 2] += ((along * curves[3, i]) ** 2 + (twice * curves[2, i]) ** 2) * share


def bias_variance(sheet: ImuSheet, rest_s: FloatArray) -> FloatArray:
    """Variance (n,) of the gyro bias that is left after averaging over rest_s (n,) seconds, (rad/s)^2."""
    drift = sheet.gyro_bias_instability_radps**2
    turn_on = sheet.gyro_turn_on_bias_radps**2 / 3.0
    averaged = np.full_like(rest_s, np.inf)
    np.divide(sheet.gyro_noise_radpsqrts**2, rest_s, out=averaged, where=rest_s > 0.0)
    return np.minimum(averaged + drift, turn_on) + drift


def time_constant(
    sensor: float, swing: FloatArray, white: float, bias: FloatArray, *, gravity: float
) -> FloatArray:
    """Best time constant: the tau > 0 of (sensor + 2 swing / tau) / (g tau)^2 = white + 4 bias tau.

    Parameters
    ----------
    sensor : float
        Intensity of the accelerometer's white noise, (m/s2)^2 s.
    swing : ndarray (n,)
        Variance of the body's velocity in the track frame, (m/s)^2.
    white : float
        Intensity of the gyro's white noise, rad2/s.
    bias : ndarray (n,)
        Variance of the residual gyro bias, (rad/s)^2.
    gravity : float
        m/s2.

    Returns
    -------
    ndarray (n,)
        s.
    """
    found, near = np.empty(len(swing)), 0.0
    _time_constants(
        sensor,
        white * gravity**2,
        swing,
        4.0 * bias * gravity**2,
        near,
        len(swing),
        found,
        np.empty(len(swing)),
    )
    return found


@njit_borrowed
def _time_constants(
    sensor: float,
    third: float,
    swing: FloatArray,
    fourth: FloatArray,
    near: float,
    count: int,
    tau: FloatArray,
    is_open: FloatArray,
) -> None:
    """`time_constant` of the first ``count`` samples, by Newton's method from one for all, if it is near.

    fourth tau^4 + third tau^3 - sensor tau - 2 swing = 0 has one positive root, above which the left side
    is convex: from a start above it, or a little below, the steps fall towards the root and never below. The
    last step is so small that what it leaves is rounding, so that the start leaves no trace. Each sample
    stops by itself, so that none depends on those that come after it.

    Parameters
    ----------
    sensor, third, near : float
        ``near`` is the time constant of a sample before, or 0.
    swing, fourth : ndarray
    count : int
    tau : ndarray, out
    is_open : ndarray, work
        1 where another step is due, else 0.
    """
    for j in range(count):
        step, slope = _newton(sensor, swing[j], third, fourth[j], near)
        is_near = near > 0.0 and slope > 0.0 and abs(step) <= _NEAR * near
        tau[j], is_open[j] = near - step, 1.0 if is_near else 0.0
    for j in range(count):
        if is_open[j] == 0.0:
            tau[j], is_open[j] = _start(sensor, swing[j], third, fourth[j]), 1.0
    left, steps = 1.0, 0
    while left > 0.0 and steps < _NEWTON_STEPS:
        left, steps = 0.0, steps + 1
        for j in range(count):
            step, _ = _newton(sensor, swing[j], third, fourth[j], tau[j])
            step = step if is_open[j] > 0.0 else 0.0
            tau[j] -= step
            is_open[j] = 1.0 if abs(step) > _DONE * tau[j] else 0.0
        for j in range(count):
            left += is_open[j]


@njit_borrowed
def _start(sensor: float, swing: float, third: float, fourth: float) -> float:
    """Where Newton's method begins without a time constant near by."""
    tau: float = max(math.sqrt(2.0 * sensor / third), (4.0 * swing / third) ** (1.0 / 3.0))
    if fourth > 0.0:
        other = max((2.0 * sensor / fourth) ** (1.0 / 3.0), math.sqrt(math.sqrt(4.0 * swing / fourth)))
        tau = min(tau, other)
    return tau


@njit_inline
def _newton(sensor: float, swing: float, third: float, fourth: float, tau: float) -> tuple[float, float]:
    """Newton's step, and the slope there."""
    slope = (4.0 * fourth * tau + 3.0 * third) * tau * tau - sensor
    return (((fourth * tau + third) * tau * tau - sensor) * tau - 2.0 * swing) / slope, slope


READINGS = ("intensity", "per_step")
"""How a process noise is read: Q = value Ts, or Q = value."""
