"""Long signals made short for a page, without losing their peaks.

A plot is about a thousand pixels wide; a ride has a hundred thousand samples. Samples are gathered
into bins and each bin keeps its smallest and largest value, so a single spike is still seen.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray

BINS = 700
"""Bins over a plot: two points each."""


class Envelope(NamedTuple):
    """Smallest, mean and largest value per bin; every array (bins,)."""

    low: FloatArray
    mean: FloatArray
    high: FloatArray


class Bins:
    """Bins along a monotonic axis, made once for many signals.

    Parameters
    ----------
    x : ndarray (n,)
        Time or position. A position may run either way and stand still; small steps back are
        counted into the bin already reached.
    bins : int
        How many, at most.
    """

    def __init__(self, x: FloatArray, *, bins: int = BINS) -> None:
        sign = 1.0 if x[-1] >= x[0] else -1.0
        run = np.maximum.accumulate(sign * x)
        edges = np.linspace(run[0], run[-1], bins + 1)[:-1]
        first = np.searchsorted(run, edges, side="left")
        # An empty bin (a train at speed over short bins) would repeat its neighbour: leave it out.
        self.first = np.unique(np.minimum(first, len(x) - 1))
        self.first[0] = 0
        self.count = np.diff(np.append(self.first, len(x)))
        self.x = self._mean(np.asarray(x, dtype=np.float64))

    def _mean(self, y: FloatArray) -> FloatArray:
        mean: FloatArray = np.add.reduceat(y, self.first) / self.count
        return mean

    def envelope(self, y: FloatArray) -> Envelope:
        """Envelope of a signal (n,)."""
        low, high = np.minimum.reduceat(y, self.first), np.maximum.reduceat(y, self.first)
        return Envelope(low, self._mean(y), high)

    def line(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Polyline (2 bins,) through the extremes of a signal (n,), in the order that they rise or fall."""
        low, high = np.minimum.reduceat(y, self.first), np.maximum.reduceat(y, self.first)
        last = np.append(self.first[1:], len(y)) - 1
        falls = y[last] < y[self.first]
        quarter = 0.25 * np.gradient(self.x) if len(self.x) > 1 else np.zeros(1)
        x = np.column_stack((self.x - quarter, self.x + quarter)).ravel()
        points = np.column_stack((np.where(falls, high, low), np.where(falls, low, high))).ravel()
        return x, points
