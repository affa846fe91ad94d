"""From the truth's rate to a sensor's rate without aliasing: linear-phase low-pass, then every M-th sample.

The filter is a Kaiser-windowed FIR: flat to 0.1 % up to 0.3 times the output rate, below 0.1 % from
0.6 times the output rate on. A tone between 0.5 and 0.6 folds back to between 0.4 and 0.5, above
everything that the passband keeps. Being symmetric it delays all frequencies alike, by half its
length, and the time stamps are corrected by exactly that.

Near its ends a filter lacks neighbours. Nothing is made up there: the sampled signal begins and ends
half a filter length inside the truth, as it does on a device that has just been switched on.

Only filters live here; what a device adds to the signal is in `simrail.sensors.imu`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import signal

from simrail.errors import InputError
from simrail.jit import FloatArray

PASS_EDGE, STOP_EDGE = 0.3, 0.6
"""Edges of the decimation filter, in output rates."""

_STOP_DB = 63.0


@lru_cache(maxsize=32)
def _taps(factor: int) -> tuple[float, ...]:
    if factor == 1:
        return (1.0,)
    width = (STOP_EDGE - PASS_EDGE) / factor
    order = (_STOP_DB - 7.95) / (2.285 * 2.0 * np.pi * width)
    # Half the length is a whole number of output samples: the delay is one, too.
    half = factor * int(np.ceil(0.5 * order / factor))
    taps = signal.firwin(
        2 * half + 1,
        PASS_EDGE + STOP_EDGE,
        window=("kaiser", signal.kaiser_beta(_STOP_DB)),
        fs=2.0 * factor,
    )
    return tuple(taps / np.sum(taps))


def decimation_taps(factor: int) -> FloatArray:
    """Coefficients of the filter before taking every `factor`-th sample; odd in number, sum 1."""
    return np.array(_taps(factor))


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


def decimate(samples: FloatArray, factor: int) -> tuple[FloatArray, int]:
    """Low-pass and take every `factor`-th sample.

    Parameters
    ----------
    samples : ndarray (n, m)
        Uniform samples of m channels.
    factor : int
        Input rate over output rate; 1 leaves the samples as they are.

    Returns
    -------
    output : ndarray (k, m)
        Output sample j belongs to the time of input sample ``delay + j * factor``.
    delay : int
        Delay of the filter in input samples, a multiple of `factor`: how much later an output sample
        can be known, and how much of the input is lost at either end.

    Raises
    ------
    InputError
        If the input is shorter than the filter.
    """
    if factor == 1:
        return samples.copy(), 0
    taps = decimation_taps(factor)
    delay = len(taps) // 2
    if len(samples) < len(taps):
        raise InputError(
            "the ride is too short for the sensor's filter",
            field="rate_hz",
            value=f"{len(samples)} samples",
            limit=f"at least {len(taps)} samples",
            remedy="simulate a longer ride or choose a faster sensor",
        )
    count = (len(samples) - len(taps)) // factor + 1
    # The causal convolution is complete for the first time after 2 * delay inputs.
    filtered = signal.upfirdn(taps, samples, up=1, down=factor, axis=0)
    return np.ascontiguousarray(filtered[2 * delay // factor :][:count]), delay


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
    if bandwidth_hz >= 0.5 * rate_hz:
        raise InputError(
            "cannot be simulated at the rate of the truth",
            field="bandwidth_hz",
            value=bandwidth_hz,
            limit=f"< {0.5 * rate_hz:g} Hz",
            remedy="leave the bandwidth out: the truth holds nothing faster",
        )
    sections = signal.butter(2, bandwidth_hz, fs=rate_hz, output="sos")
    initial = signal.sosfilt_zi(sections)[:, :, None] * samples[None, :1, :]
    filtered: FloatArray = signal.sosfilt(sections, samples, axis=0, zi=initial)[0]
    return filtered
