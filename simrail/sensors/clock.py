"""A device's clock: samples taken at the wrong times, stamped with the right ones, and samples that get lost.

The clock agrees with the truth's at time 0, runs fast or slow from then on, and jitters at each sample. A
right clock whose rate does not divide the truth's is one of these, without drift and jitter.
The motion at the true time is that behind the sampling filter, interpolated by a windowed sinc. What is lost
is lost on the way to the logger: `lose_samples` says which samples those are, it fills nothing in.
"""

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy import signal

from simrail.core.jit import FloatArray, njit
from simrail.recording.sheets.grades import ImuGrade
from simrail.sensors.decimation import Sampling, too_short
from simrail.sensors.imu_noise import Streams

SHIFTS = 256
"""Shifts per truth sample at which the filter is tabulated; linear in between (error below 1e-5)."""

SINC_HALF = 16
SINC_DB = 90.0
"""Half length, in samples, of the interpolator of a device that samples at the truth's own rate, and its stop
band: true to 1e-4 up to 0.4 times that rate. Behind a low-pass, half as long does as well."""


def sample_by_clock(
    samples: FloatArray,
    sampling: Sampling,
    grade: ImuGrade,
    *,
    truth_rate_hz: float,
    streams: Streams,
    errors: bool = True,
) -> tuple[FloatArray, int, FloatArray]:
    """Sample with a clock that drifts and jitters.

    The sample stamped at truth sample q is that of the place q (1 + drift) + jitter: a positive drift is
    a slow clock, whose seconds are too long.

    Parameters
    ----------
    samples : ndarray (n, 6)
        Uniform samples of the truth, from time 0.
    sampling : Sampling
        How the device samples.
    grade : ImuGrade
        The device.
    truth_rate_hz : float
        Rate of the truth.
    streams : callable
        Random streams by the name of the term.
    errors : bool
        False for a right clock.

    Returns
    -------
    output : ndarray (k, 6)
        Output sample j is stamped at the input's place ``(first + j) * factor``.
    first : int
        Number of the first stamp: a sample more than without clock errors is lost at either end.
    places : ndarray (k,)
        Where the samples were really taken, in input samples.

    Raises
    ------
    InputError
        If the input is shorter than the filter.
    """
    factor = sampling.factor
    table, behind = _shifted_taps(sampling)
    ahead = table.shape[1] - 1 - behind
    inner = factor / sampling.averaged
    reach = behind + (sampling.averaged - 1) * inner
    first = int(np.ceil(reach / factor)) + 1
    drift = grade.clock_drift * streams("clock_drift").uniform(-1.0, 1.0) if errors else 0.0
    last = (len(samples) - 1 - ahead - factor) / (1.0 + drift)
    count = int(np.floor((last - first * factor) / factor)) + 1
    if count < 1:
        raise too_short(len(samples), int(np.ceil((first + 1) * factor)) + ahead + 2)
    places: FloatArray = factor * np.arange(first, first + count, dtype=np.float64) * (1.0 + drift)
    if errors and grade.clock_jitter_s > 0.0:
        places += streams("clock_jitter").standard_normal(count) * (grade.clock_jitter_s * truth_rate_hz)
    truth = np.ascontiguousarray(samples)
    output = _evaluate(truth, table, behind, places)
    for earlier in range(1, sampling.averaged):
        output += _evaluate(truth, table, behind, places - earlier * inner)
    return output / sampling.averaged if sampling.averaged > 1 else output, first, places


def _shifted_taps(sampling: Sampling) -> tuple[FloatArray, int]:
    """Filter (SHIFTS + 1, m) at each shift, and how many of its taps lie before the place.

    Row r holds the weights of the samples i - behind, ..., i - behind + m - 1 for the place i + r / SHIFTS:
    those of the filter, spread over the neighbours by the interpolator.
    """
    # A low-pass near the truth's own rate leaves more for the interpolator to do.
    sharp = len(sampling.taps) == 1 or sampling.delay == 0 or (not sampling.whole and sampling.factor < 3.0)
    half = SINC_HALF if sharp else SINC_HALF // 2
    table = np.array([np.convolve(row, sampling.taps[::-1]) for row in _interpolator(half)])
    return table, half + len(sampling.taps) - 1 - sampling.delay


@lru_cache(maxsize=4)
def _interpolator(half: int) -> FloatArray:
    """Kaiser-windowed sinc (SHIFTS + 1, 2 half + 2): weights of the samples -half, ..., half + 1."""
    x = np.arange(-half, half + 2)[None, :] - np.linspace(0.0, 1.0, SHIFTS + 1)[:, None]
    window = np.i0(signal.kaiser_beta(SINC_DB) * np.sqrt(np.clip(1.0 - (x / half) ** 2, 0.0, None)))
    table = np.sinc(x) * window * (np.abs(x) <= half)
    weights: FloatArray = table / np.sum(table, axis=1, keepdims=True)
    return weights


@njit
def _evaluate(samples: FloatArray, table: FloatArray, behind: int, places: FloatArray) -> FloatArray:
    """Weighted sums of samples (n, 6) around places (k,); six sums in registers are what makes it fast."""
    shifts, taps = table.shape[0] - 1, table.shape[1]
    output = np.empty((len(places), 6))
    for k in range(len(places)):
        i = int(np.floor(places[k]))
        row = (places[k] - i) * shifts
        begin = min(max(i - behind, 0), samples.shape[0] - taps)
        r = min(int(row), shifts - 1)
        share = row - r
        a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for t in range(taps):
            weight = table[r, t] + share * (table[r + 1, t] - table[r, t])
            a += weight * samples[begin + t, 0]
            b += weight * samples[begin + t, 1]
            c += weight * samples[begin + t, 2]
            d += weight * samples[begin + t, 3]
            e += weight * samples[begin + t, 4]
            f += weight * samples[begin + t, 5]
        output[k] = a, b, c, d, e, f
    return output


def lost_samples(grade: ImuGrade, count: int, streams: Streams) -> npt.NDArray[np.bool_]:
    """Which of the samples never arrive.

    A two-state chain (Gilbert): a burst begins with probability p after a sample that arrived and ends
    with probability 1 / (mean burst) after one that did not, with p such that the stated fraction is
    lost. One uniform number per sample, so a longer ride loses the same samples. The first two and the
    last two samples always arrive.

    Returns
    -------
    ndarray (count,) of bool
    """
    lost: npt.NDArray[np.bool_] = np.zeros(count, dtype=np.bool_)
    if grade.dropped_fraction > 0.0:
        end = 1.0 / grade.dropped_burst
        begin = end * grade.dropped_fraction / (1.0 - grade.dropped_fraction)
        _lose(streams("dropped").uniform(size=count), begin, end, lost)
        lost[:2] = lost[-2:] = False
    return lost


@njit
def _lose(chance: FloatArray, begin: float, end: float, lost: npt.NDArray[np.bool_]) -> None:
    out = False
    for k in range(len(chance)):
        out = chance[k] >= end if out else chance[k] < begin
        lost[k] = out
