"""Long signals made short for a page, without losing their peaks.

A plot is about a thousand pixels wide; a ride has a hundred thousand samples. Samples are gathered
into bins and each bin keeps its smallest and largest value, so a single spike is still seen.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, IntArray
from simrail.core.turning import turning_rows

BINS = 700
"""Bins over a plot: two points each."""


LEAST_BINS = 200
"""Of one run among several."""


def _first_of(x: FloatArray, bins: int) -> IntArray:
    """First samples of the bins of one run."""
    sign = 1.0 if x[-1] >= x[0] else -1.0
    run = np.maximum.accumulate(sign * x)
    edges = np.linspace(run[0], run[-1], bins + 1)[:-1]
    first = np.searchsorted(run, edges, side="left")
    # An empty bin (a train at speed over short bins) would repeat its neighbour: leave it out.
    first = np.unique(np.minimum(first, len(x) - 1))
    first[0] = 0
    return first


class Envelope(NamedTuple):
    """Smallest, mean and largest value per bin; every array (bins,)."""

    low: FloatArray
    mean: FloatArray
    high: FloatArray


class Bins:
    """Bins along an axis, made once for many signals.

    Parameters
    ----------
    x : ndarray (n,)
        Time or position. A position may run either way and stand still; small steps back are
        counted into the bin already reached. Where a ride turns back (`simrail.core.turning`), its runs are
        binned each by itself, and a bin more, at NaN, parts them: a line over them is not joined.
    bins : int
        How many, at most; with several runs, a share of them for each.
    """

    def __init__(self, x: FloatArray, *, bins: int = BINS) -> None:
        rows = turning_rows(x, step=max(1, len(x) // 50_000))
        firsts = [
            _first_of(x[begin:end], max(bins // (len(rows) - 1), LEAST_BINS if len(rows) > 2 else 1)) + begin
            for begin, end in zip(rows[:-1], [*rows[1:-1], len(x)], strict=True)
        ]
        self.first = np.concatenate(firsts)
        self.breaks = np.cumsum([len(first) for first in firsts])[:-1]
        self.count = np.diff(np.append(self.first, len(x)))
        self.place = self._mean(np.asarray(x, dtype=np.float64))
        self.x = self.place.copy()
        self.x[self.breaks + np.arange(len(self.breaks))] = np.nan

    def parted(self, values: FloatArray) -> FloatArray:
        """Values of the bins, that before a break twice."""
        return np.insert(values, self.breaks, values[self.breaks - 1]) if len(self.breaks) else values

    def _mean(self, y: FloatArray) -> FloatArray:
        return self.parted(np.add.reduceat(y, self.first) / self.count)

    def envelope(self, y: FloatArray) -> Envelope:
        """Envelope of a signal (n,)."""
        low, high = np.minimum.reduceat(y, self.first), np.maximum.reduceat(y, self.first)
        return Envelope(self.parted(low), self._mean(y), self.parted(high))

    def line(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Polyline (2 bins,) through the extremes of a signal (n,), in the order that they rise or fall."""
        low, _, high = self.envelope(y)
        last = np.append(self.first[1:], len(y)) - 1
        falls = self.parted((y[last] < y[self.first]).astype(np.float64)) == 1.0
        gap = np.flatnonzero(np.isnan(self.x))
        parts = np.split(self.x, np.sort(np.concatenate([gap, gap + 1])))
        quarter = np.concatenate([0.25 * np.gradient(x) if len(x) > 1 else np.zeros(len(x)) for x in parts])
        x = np.column_stack((self.x - quarter, self.x + quarter)).ravel()
        points = np.column_stack((np.where(falls, high, low), np.where(falls, low, high))).ravel()
        return x, points
