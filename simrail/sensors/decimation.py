"""From the truth's rate to a sensor's rate without aliasing: linear-phase low-pass, then the samples.

Where the rate divides the truth's, they are every M-th; at any other rate up to the truth's (104, 416,
833 Hz) they lie between its samples and are interpolated behind the same low-pass (`simrail.sensors.clock`).

The filter is a Kaiser-windowed FIR: flat to 0.1 % up to 0.3 times the output rate, below 0.1 % from
0.6 times the output rate on. A tone between 0.5 and 0.6 folds back to between 0.4 and 0.5, above
everything that the passband keeps. Being symmetric it delays all frequencies alike, by half its
length, and the time stamps are corrected by exactly that.

Near its ends a filter lacks neighbours. Nothing is made up there: the sampled signal begins and ends
half a filter length inside the truth, as it does on a device that has just been switched on.

Only filters live here; what a device adds to the signal is in `simrail.sensors.imu`.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import signal

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, njit

PASS_EDGE, STOP_EDGE = 0.3, 0.6
"""Edges of the decimation filter, in output rates."""

STOP_DB = 63.0


TRUTH_RATES_HZ = (1000.0, 2000.0, 4000.0)
"""Rates of the truth that a scenario may have for fast sensors."""


@lru_cache(maxsize=32)
def decimation_taps(factor: float) -> FloatArray:
    """Coefficients of the filter before sampling at the rate over `factor`; odd in number, sum 1, read-only.

    Of a whole factor, half their number is a multiple of it.
    """
    if factor == 1:
        return np.ones(1)
    width = (STOP_EDGE - PASS_EDGE) / factor
    order = (STOP_DB - 7.95) / (2.285 * 2.0 * np.pi * width)
    # Half the length is a whole number of output samples, where there is one: the delay is one, too.
    half = round(factor * int(np.ceil(0.5 * order / factor)))
    taps = signal.firwin(
        2 * half + 1,
        PASS_EDGE + STOP_EDGE,
        window=("kaiser", signal.kaiser_beta(STOP_DB)),
        fs=2.0 * factor,
    )
    taps = taps / np.sum(taps)
    taps.flags.writeable = False
    return taps


def decimation_factor(truth_rate_hz: float, output_rate_hz: float) -> int:
    """Whole ratio of two rates.

    Raises
    ------
    InputError
        If the ratio is not a whole number.
    """
    ratio = truth_rate_hz / output_rate_hz
    factor = round(ratio)
    if factor < 1 or abs(ratio - factor) > 1e-6 * factor:
        raise InputError(
            "does not divide the rate of the truth",
            field="rate_hz",
            value=output_rate_hz,
            limit=f"{truth_rate_hz:g} Hz divided by a whole number",
            remedy=f"e.g. {truth_rate_hz / max(factor, 1):g} Hz",
        )
    return factor


@dataclass(frozen=True)
class Sampling:
    """How a device takes one output sample out of the truth's samples.

    Attributes
    ----------
    factor : float
        Truth's rate over output rate.
    taps : ndarray (m,)
        Coefficients of a causal filter: its output at truth sample i is the output sample stamped i - delay.
    delay : int
        Truth samples after its stamp that an output sample needs.
    averaged : int
        How many outputs of the filter, evenly over the time since the last output sample, are averaged for
        one; 1 where the taps do that already, as they do for whole factors.
    """

    factor: float
    taps: FloatArray
    delay: int
    averaged: int = 1

    @property
    def whole(self) -> int:
        """The factor, where it is a whole number; 0 where output samples lie between those of the truth."""
        return int(self.factor) if self.factor == round(self.factor) and self.averaged == 1 else 0

    @property
    def first(self) -> int:
        """First truth sample, a multiple of a whole factor, at which an output sample is complete."""
        behind = len(self.taps) - 1 - self.delay
        return self.whole * -(-behind // self.whole)


def sampling_of(truth_rate_hz: float, output_rate_hz: float, oversampling: int = 1) -> Sampling:
    """Filter between the truth and a device that samples `oversampling` times as fast and averages.

    The internal samples are decimated as usual; an output sample is the mean of the last `oversampling`
    of them, stamped at the last one.

    Raises
    ------
    InputError
        If the internal rate is above the truth's.
    """
    ratio = truth_rate_hz / output_rate_hz
    inner_rate = output_rate_hz * oversampling
    if inner_rate > truth_rate_hz * (1.0 + 1e-9):
        fast = next((rate for rate in TRUTH_RATES_HZ if rate >= inner_rate), None)
        times = f", {oversampling} times averaged: {inner_rate:g} Hz" if oversampling > 1 else ""
        raise InputError(
            f"is above the rate of the truth{times}",
            field="rate_hz",
            value=output_rate_hz,
            limit=f"{truth_rate_hz:g} Hz",
            remedy=f"choose a slower output, up to {TRUTH_RATES_HZ[-1]:g} Hz"
            if fast is None
            else f"set truth_rate_hz = {fast:g} in the scenario",
        )
    factor = round(ratio)
    if abs(ratio - factor) > 1e-6 * factor or factor % oversampling:
        inner_taps = decimation_taps(ratio / oversampling)
        return Sampling(ratio, inner_taps, len(inner_taps) // 2, oversampling)
    inner = factor // oversampling
    taps = decimation_taps(inner)
    delay = len(taps) // 2
    if oversampling > 1:
        comb = np.zeros((oversampling - 1) * inner + 1)
        comb[::inner] = 1.0 / oversampling
        taps = np.convolve(taps, comb)
    return Sampling(factor, taps, delay)


def sample_on_time(samples: FloatArray, sampling: Sampling) -> tuple[FloatArray, int]:
    """Sample at the very stamps.

    Parameters
    ----------
    samples : ndarray (n, m)
        Uniform samples of m channels of the truth.
    sampling : Sampling
        How the device samples; its factor is whole.

    Returns
    -------
    output : ndarray (k, m)
        Output sample j is stamped at input sample ``first + j * factor``.
    first : int
        How much of the input is lost at its start.

    Raises
    ------
    InputError
        If the input is shorter than the filter.
    """
    taps, factor = sampling.taps, sampling.whole
    if len(taps) == 1 and factor == 1:
        return samples.copy(), 0
    first = sampling.first
    count = (len(samples) - 1 - sampling.delay - first) // factor + 1
    if count < 1:
        raise too_short(len(samples), len(taps))
    # A filter delayed by whole output samples can be evaluated at those only.
    later = -sampling.delay % factor
    filtered = signal.upfirdn(np.pad(taps, (later, 0)), samples, up=1, down=factor, axis=0)
    begin = (first + sampling.delay + later) // factor
    return np.ascontiguousarray(filtered[begin : begin + count]), first


def too_short(found: int, needed: int) -> InputError:
    """What is said of a ride that has fewer samples than a filter needs."""
    return InputError(
        "the ride is too short for the sensor's filter",
        field="rate_hz",
        value=f"{found} samples",
        limit=f"at least {needed} samples",
        remedy="simulate a longer ride or choose a faster sensor",
    )


def second_order(samples: FloatArray, *, bandwidth_hz: float, rate_hz: float) -> FloatArray:
    """Response of a device of second order (Butterworth), at rest in the first sample before it begins.

    Parameters
    ----------
    samples : ndarray (n, m)
        Uniform samples.
    bandwidth_hz : float
        -3 dB frequency; below half the sample rate.
    rate_hz : float
        Sample rate.

    Returns
    -------
    ndarray (n, m)
        Lags the input by about ``sqrt(2) / (2 pi bandwidth)`` s at low frequency: a real device does
        not correct this, so neither do the time stamps.
    """
    check_bandwidth(bandwidth_hz, rate_hz)
    b, a = signal.butter(2, bandwidth_hz, fs=rate_hz)
    return _biquad(np.ascontiguousarray(samples, dtype=np.float64), b, a)


def check_bandwidth(bandwidth_hz: float, rate_hz: float) -> None:
    """Refuse a bandwidth that the truth's rate cannot show.

    Raises
    ------
    InputError
        If it is not below half the rate.
    """
    if bandwidth_hz >= 0.5 * rate_hz:
        raise InputError(
            "cannot be simulated at the rate of the truth",
            field="bandwidth_hz",
            value=bandwidth_hz,
            limit=f"< {0.5 * rate_hz:g} Hz",
            remedy="leave the bandwidth out: the truth holds nothing faster",
        )


@njit
def _biquad(samples: FloatArray, b: FloatArray, a: FloatArray) -> FloatArray:
    """Second-order filter of each column (transposed direct form II), steady in the first sample at first."""
    count, channels = samples.shape
    output = np.empty((count, channels))
    b0, b1, b2, a1, a2 = b[0], b[1], b[2], a[1], a[2]
    gain = (b0 + b1 + b2) / (1.0 + a1 + a2)
    one, two = np.empty(channels), np.empty(channels)
    for j in range(channels):
        two[j] = (b2 - a2 * gain) * samples[0, j]
        one[j] = (b1 - a1 * gain) * samples[0, j] + two[j]
    for k in range(count):
        for j in range(channels):
            x = samples[k, j]
            y = b0 * x + one[j]
            one[j] = b1 * x - a1 * y + two[j]
            two[j] = b2 * x - a2 * y
            output[k, j] = y
    return output
