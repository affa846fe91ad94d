"""Compiled loop of the gyro bias from rests: arrays in, arrays out.

It goes forward over the samples and knows of the future nothing, so the result of a prefix is the
prefix of the result. What it computes is derived in `simrail.estimators.attitude.rest_bias`.
"""

import math

import numpy as np

from simrail.core.jit import FloatArray, njit


@njit
def average_rests(
    sums: FloatArray,
    moves: np.ndarray,
    settled: np.ndarray,
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
    """Average over the rests so far.

    Parameters
    ----------
    sums : ndarray (n + 1, 3)
        Running sums of the gyro, rad/s; row k is the sum of the samples before sample k.
    moves, settled : ndarray (m,) of int
        First sample at or after each sign of motion, and first sample after it that a rest may use.
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
    samples, variance : ndarray (n,), out
        Number of samples used so far, and variance of the bias' error, (rad/s)^2.
    """
    begin, needed, j = 0, 1, 0
    past, past_variance, past_samples, past_end = np.zeros(3), math.inf, 0, 0
    here, here_variance, here_samples, here_end = np.zeros(3), math.inf, 0, 0
    for k in range(len(bias)):
        while j < len(moves) and moves[j] < k:
            # The rest that was under way, if one was, is over: it is the past of the next.
            past[:] = here
            past_variance, past_samples, past_end = here_variance, here_samples, here_end
            begin, needed = settled[j], shortest
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
                here[i] = mean if past_samples == 0 else past[i] + gain * (mean - past[i])
        bias[k] = here
        samples[k] = here_samples
        if here_samples == 0:
            variance[k] = unknown
        else:
            since = (k - here_end) * step_s
            variance[k] = here_variance + 2.0 * wander * -math.expm1(-since / correlation_s)
