"""Samples of a ride, taken at any places in any order, brought to uniform places along the track.

Not here: what the samples are of (`simrail.estimators.trajectory.track_geometry`), and wavelength bands
(`simrail.track.bands`).
"""

from typing import NamedTuple

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from simrail.core.jit import FloatArray

FINE = 8
"""Cells per step in which samples are averaged before the step's own low-pass."""

_REACH = 10
"""Steps that the low-pass sees on either side."""

_LOW_PASS = signal.firwin(2 * _REACH * FINE + 1, 1.0 / FINE, window=("kaiser", 5.0))
"""Passes waves longer than 2.5 steps to 0.2 % and stops those shorter than 1.7 to 1 %."""


class OverSpace(NamedTuple):
    """Samples brought from time to uniform places.

    Attributes
    ----------
    position_m : ndarray (g,)
        Whole multiples of the step.
    values : ndarray (g, m)
    variance : ndarray (g, m), optional
        That of the samples there: errors of a trajectory hardly change over a step, no mean lessens them.
    noise_gain : ndarray (g,)
        Variance that is left of white noise of variance 1 in the samples; too small over the last few
        steps at each end, unless the train stood there.
    """

    position_m: FloatArray
    values: FloatArray
    variance: FloatArray | None
    noise_gain: FloatArray


def over_space(
    place: FloatArray, values: FloatArray, *, step_m: float, variance: FloatArray | None = None
) -> OverSpace:
    """Bring samples (n, m) taken at places (n,), in any order, to uniform places.

    They are averaged in cells of an eighth of the step, a cubic spline joins the means at the mean places,
    and a symmetric low-pass thins the spline out to the step. Over the ten steps at each end it sees the line
    turned about its end point.
    """
    first, last = (np.ceil(place.min() / step_m - 1e-9), np.floor(place.max() / step_m + 1e-9))
    if last - first < 1:
        nothing, spread = np.empty((0, values.shape[1])), None if variance is None else variance[:0]
        return OverSpace(np.empty(0), nothing, spread, np.empty(0))
    cell_m = step_m / FINE
    kinds = np.unique(np.floor(place / cell_m).astype(np.int64), return_inverse=True)[1]
    at = np.bincount(kinds, place) / np.bincount(kinds)
    # Two means may be close where the train stood on the border of two cells: make one of both.
    close = np.diff(at, prepend=-np.inf) < 0.25 * cell_m
    kinds = (np.arange(len(at)) - np.cumsum(close))[kinds]
    count = np.bincount(kinds)

    def mean(columns: FloatArray) -> FloatArray:
        return np.stack([np.bincount(kinds, column) / count for column in columns.T], axis=-1)

    at = mean(place[:, None])[:, 0]
    position = np.arange(first, last + 1) * step_m
    fine = first * step_m + cell_m * np.arange((len(position) - 1) * FINE + 1)
    line = CubicSpline(at, mean(values))(np.clip(fine, at[0], at[-1]))
    line = _thinned(line, _LOW_PASS, odd=True)
    density = count * cell_m / np.gradient(at)  # samples per cell; below one where the train is fast
    spread = np.interp(fine, at, 1.0 / density)[:, None]
    gain = _thinned(spread, _LOW_PASS**2, odd=False)[:, 0]
    if variance is not None:
        means = mean(variance)
        variance = np.stack([np.interp(position, at, column) for column in means.T], axis=-1)
    return OverSpace(position, line, variance, np.minimum(gain, 1.0))


def _thinned(line: FloatArray, taps: FloatArray, *, odd: bool) -> FloatArray:
    """Low-pass a line (n, m) and keep every `FINE`-th sample; beyond its ends it is turned or mirrored."""
    beyond = ((_REACH * FINE, _REACH * FINE), (0, 0))
    longer = np.pad(line, beyond, mode="reflect", reflect_type="odd" if odd else "even")
    passed: FloatArray = signal.upfirdn(taps, longer, up=1, down=FINE, axis=0)
    return passed[2 * _REACH : 2 * _REACH + (len(line) - 1) // FINE + 1]
