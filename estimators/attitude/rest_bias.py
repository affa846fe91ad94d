"""Gyro bias from the rests of a ride: each stop refreshes it, and between stops it stays.

Every attitude method uses this one, so that none gets a better gyro than another. It is causal: a sample
is used only when it is `simrail.recording.standstill.guard_s` old, so that the first jerk of a departure,
which the encoder notices late, never enters; and no rest is known to be one before it is long enough.

**How much a new rest counts** follows from the data sheet. The mean over a rest of length T has the white
noise N^2 / T. The in-run bias wanders: as a Gauss-Markov process of variance b^2 (`WANDER_PER_INSTABILITY`)
and correlation time tau it changes in the time t by a variance of D(t) = 2 b^2 (1 - exp(-t / tau)). Taken as
a random walk over the rest: the bias b0 at its start is known from before with the variance
P0 = P + D(gap), the mean is off b0 by noise of M = D(T) / 3 + N^2 / T, and the bias at the end, which is
wanted, has moved on by D(T), of which the mean has seen one half (the covariance of a walk with its mean).
The estimate b = b_before + K (mean - b_before) has the error variance

    P = (1 - K)^2 P0 + K^2 M + (1 - K) D(T),     least for     K = (P0 + D(T) / 2) / (P0 + M), at most 1.

Without wandering that is the mean over all rests together; without white noise, the newest alone. The first
rest counts fully: what the sheet says of the bias at switch-on is no match for it.

A sheet prints B but not tau; `CORRELATION_S` stands for it.
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.columns import GYRO
from simrail.core.jit import FloatArray, njit, njit_borrowed
from simrail.recording.recording import Recording, rows_of
from simrail.recording.standstill import SETTLE_S, SHORTEST_S, guard_s, motion_times

CORRELATION_S = 300.0
"""Correlation time of the in-run bias, which sheets do not print: some minutes for MEMS gyros."""

WANDER_PER_INSTABILITY = 1.076
"""Standard deviation b of the process over B: 0.664 / 0.617, since the Allan deviation of a Gauss-Markov
process peaks at 0.617 of its standard deviation, and the floor of a sheet is 0.664 B (IEEE 952)."""

LEAST_NOISE = 1e-20
"""(rad/s)^2 s: a sheet without noise still weighs its rests by their lengths."""


class RestBias(NamedTuple):
    """Gyro bias over time, n samples.

    Attributes
    ----------
    bias : ndarray (n, 3)
        Bias as the rests so far have it, rad/s; zero while nothing has been averaged.
    samples : ndarray (n,)
        How many samples it has been averaged over.
    variance : ndarray (n,) or (0,)
        Variance of its error on each axis as a measure of the present bias, (rad/s)^2, where it is wanted.
    """

    bias: FloatArray
    samples: FloatArray
    variance: FloatArray


def rest_bias(recording: Recording, *, enabled: bool = True, with_variance: bool = False) -> RestBias:
    """Average the gyro over the rests of a ride, causally.

    Parameters
    ----------
    recording : Recording
        The recording.
    enabled : bool
        False gives zero bias from zero samples.
    with_variance : bool
        False leaves out the variance, which takes a third of the time.

    Returns
    -------
    RestBias
        Row k uses samples older than `simrail.recording.standstill.guard_s` only, and only samples from
        rests.
    """
    sheet, n = recording.imu_sheet, len(recording.imu)
    wander = (WANDER_PER_INSTABILITY * sheet.gyro_bias_instability_radps) ** 2
    unknown = sheet.gyro_turn_on_bias_radps**2 / 3.0 + wander
    spread = np.full(n if with_variance else 0, unknown)
    if not enabled:
        return RestBias(np.zeros((n, 3)), np.zeros(n), spread)
    found = RestBias(np.empty((n, 3)), np.empty(n), spread)
    # Arrays of one kind: for each other one, as some that may only be read, the kernel is compiled for anew.
    times, moves = np.array(recording.imu.index, dtype=np.float64), np.array(motion_times(recording))
    guard = guard_s(recording)
    average_rests(
        running_sums(*rows_of(recording.imu, GYRO)),
        times,
        moves,
        max(SETTLE_S, guard),
        round(guard * sheet.rate_hz),
        round(SHORTEST_S * sheet.rate_hz),
        1.0 / sheet.rate_hz,
        sheet.gyro_noise_radpsqrts**2 + LEAST_NOISE,
        wander,
        CORRELATION_S,
        unknown,
        *found,
    )
    return found


@njit
def running_sums(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
    """Sums (n + 1, 3) of what is before each sample of three signals (n,).

    They are added in the order of time, so a prefix of the recording has the very same sums.
    """
    sums = np.empty((first.shape[0] + 1, 3))
    x = y = z = 0.0
    sums[0, 0] = sums[0, 1] = sums[0, 2] = 0.0
    for k in range(first.shape[0]):
        x, y, z = x + first[k], y + second[k], z + third[k]
        sums[k + 1, 0], sums[k + 1, 1], sums[k + 1, 2] = x, y, z
    return sums


@njit_borrowed
def average_rests(
    sums: FloatArray,
    times: FloatArray,
    moves: FloatArray,
    settle_s: float,
    guard: int,
    shortest: int,
    step_s: float,
    white: float,
    wander: float,
    correlation_s: float,
    unknown: float,
    bias: FloatArray,
    samples: FloatArray,
    variance: FloatArray,
) -> None:
    """Average over the rests so far; the module's docstring derives it.

    The loop goes forward over the samples and knows of the future nothing, so the result of a prefix is the
    prefix of the result.

    Parameters
    ----------
    sums : ndarray (n + 1, 3)
        Running sums of the gyro, rad/s; row k is the sum of the samples before sample k.
    times : ndarray (n,)
        Of the samples, s.
    moves : ndarray (m,)
        Times of the signs of motion, increasing, s.
    settle_s : float
        After each of them, until the first sample that a rest may use, s.
    guard, shortest : int
        Samples before the present one that are not used yet, and the fewest that make a later rest.
    step_s : float
        Sample interval, s.
    white : float
        Intensity of the gyro's white noise, (rad/s)^2 s.
    wander, correlation_s : float
        Variance of the in-run bias, (rad/s)^2, and its correlation time, s.
    unknown : float
        Variance of the bias before any rest, (rad/s)^2.
    bias : ndarray (n, 3), out
        rad/s.
    samples : ndarray (n,), out
        Number of samples used so far.
    variance : ndarray (n,) or (0,), out
        Of the bias' error, (rad/s)^2; of no rows if it is not wanted.
    """
    begin, needed, j = 0, 1, 0
    past, past_variance, past_samples, past_end = 0, math.inf, 0, 0
    here_variance, here_samples, here_end = math.inf, 0, 0
    for k in range(len(bias)):
        while j < len(moves) and k > 0 and moves[j] <= times[k - 1]:
            # The rest that was under way, if one was, is over: the last row's bias is the past of the next.
            past, past_variance, past_samples, past_end = k - 1, here_variance, here_samples, here_end
            settled = moves[j] + settle_s
            while begin < len(times) and times[begin] < settled:
                begin += 1
            needed = shortest
            j += 1
        count = k - guard - begin
        if count >= needed:
            time = count * step_s
            grown = 2.0 * wander * -math.expm1(-time / correlation_s)
            noise = grown / 3.0 + white / time
            gain = 1.0
            here_variance = noise
            if past_samples > 0:
                gap = (begin - past_end) * step_s
                before = past_variance + 2.0 * wander * -math.expm1(-gap / correlation_s)
                gain = min(1.0, (before + 0.5 * grown) / (before + noise))
                here_variance = (1.0 - gain) ** 2 * before + gain**2 * noise
            here_variance += (1.0 - gain) * grown
            here_samples, here_end = past_samples + count, k - guard
            for i in range(3):
                mean = (sums[here_end, i] - sums[begin, i]) / count
                bias[k, i] = mean if past_samples == 0 else bias[past, i] + gain * (mean - bias[past, i])
        else:
            for i in range(3):
                bias[k, i] = bias[k - 1, i] if k > 0 else 0.0
        samples[k] = here_samples
        if len(variance) == 0:
            continue
        if here_samples == 0:
            variance[k] = unknown
        else:
            since = (k - here_end) * step_s
            variance[k] = here_variance + 2.0 * wander * -math.expm1(-since / correlation_s)


def step_rates(recording: Recording, bias: FloatArray) -> FloatArray:
    """Body rate over the step that ends at each sample: the mean of its two ends, less the bias.

    The trapezoid takes away the half sample of lag that the rate of one end alone would have.

    Parameters
    ----------
    recording : Recording
        The recording.
    bias : ndarray (n, 3)
        Gyro bias, rad/s.

    Returns
    -------
    ndarray (n, 3)
        rad/s, C-contiguous; row 0 is the first sample itself.
    """
    rates = np.empty((len(recording.imu), 3))
    for axis, gyro in enumerate(rows_of(recording.imu, GYRO)):
        _step_rates(gyro, bias, axis, rates)
    return rates


@njit_borrowed
def _step_rates(gyro: FloatArray, bias: FloatArray, axis: int, rates: FloatArray) -> None:
    rates[0, axis] = gyro[0] - bias[0, axis]
    for k in range(1, len(gyro)):
        rates[k, axis] = gyro[k] - bias[k, axis] - 0.5 * (gyro[k] - gyro[k - 1])
