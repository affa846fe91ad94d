"""Confidence intervals of means by resampling, where draws hang together in clusters.

Chance has two levels in a campaign: the track is laid anew (a cluster), and each ride over it is recorded
with several draws of the sensors. Draws over one track have the track in common and are not independent
of each other. An interval therefore resamples whole clusters (Davison & Hinkley 1997, section 3.8:
resample the upper level only, and what lies below goes with it); one that counts all draws as independent
would be too narrow by as much as the track matters.

* From `FEWEST` clusters on: bootstrap-t (Hall 1988; Efron & Tibshirani 1993, chapter 12), right also for ten.
* Fewer say too little of themselves to be resampled: Student's t.

Intervals are those of means; for other statistics of independent draws see `scipy.stats.bootstrap`.

Resamples come from streams of their own names, so the same table gives the same intervals.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy import stats

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

CONFIDENCE = 0.95
RESAMPLES = 2000
FEWEST = 5
"""Clusters below which nothing is resampled."""

LEAST_SPREAD = 0.01
"""Share of the standard error. A resample that has less of it has none of the clusters that differ, as of
ninety shares of 1 and one of .9: like one without any, it says nothing."""

SEED = 1
"""Of the resampling: an analysis has no draws of the scenario."""


@dataclass(frozen=True)
class Interval:
    """An estimate and its confidence interval; bounds are NaN where there are too few draws."""

    value: float
    low: float
    high: float

    def within(self, least: float = -math.inf, most: float = math.inf) -> Self:
        """The same of what cannot be less or more, as an rms or a share."""
        return replace(
            self, low=float(np.clip(self.low, least, most)), high=float(np.clip(self.high, least, most))
        )


def resampled(clusters: int, *, resamples: int = RESAMPLES) -> FloatArray:
    """How often each cluster is drawn in each resample, (resamples, clusters)."""
    drawn = stream(SEED, "bootstrap", clusters).multinomial(
        clusters, np.full(clusters, 1.0 / clusters), size=resamples
    )
    return drawn.astype(np.float64)


def mean_interval(
    sums: FloatArray, counts: FloatArray, *, confidence: float = CONFIDENCE
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means over all draws with their intervals, of many groups at once.

    Parameters
    ----------
    sums, counts : ndarray (g, k)
        Sum and number of the values of each of k clusters in each of g groups; a cluster without values
        has 0 of both.
    confidence : float
        Of the interval, two-sided.

    Returns
    -------
    value, low, high : ndarray (g,)
        Bounds are NaN for groups with fewer than two clusters.
    """
    sums, counts = np.atleast_2d(sums), np.atleast_2d(counts)
    value, low, high = (np.full(len(sums), np.nan) for _ in range(3))
    filled = counts > 0
    number = filled.sum(axis=1)
    for k in np.unique(number[number > 0]):
        rows = np.flatnonzero(number == k)
        # Clusters with values first: the others take no part in the resampling.
        order = np.argsort(~filled[rows], axis=1, kind="stable")[:, :k]
        n = np.take_along_axis(counts[rows], order, axis=1).astype(np.float64)
        total = np.take_along_axis(sums[rows], order, axis=1)
        value[rows], low[rows], high[rows] = _means(total, n, confidence)
    return value, low, high


def _means(total: FloatArray, n: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means (g,) and intervals of groups whose k clusters all have values."""
    k = n.shape[1]
    every = n.sum(axis=1)
    mean = total.sum(axis=1) / every
    off = total - mean[:, None] * n
    scale = np.sqrt(k / max(k - 1, 1))
    error = scale * np.sqrt(np.square(off).sum(axis=1)) / every
    tail = 0.5 * (1.0 - confidence)
    if k == 1:
        return mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)
    if k < FEWEST:
        reach = float(stats.t(k - 1).ppf(1.0 - tail)) * error
        return mean, mean - reach, mean + reach
    weights = resampled(k)
    low, high = np.empty_like(mean), np.empty_like(mean)
    step = max(1, 4_000_000 // len(weights))
    for begin in range(0, len(mean), step):
        part = slice(begin, begin + step)
        m, d = n[part].T, off[part].T
        drawn = weights @ m
        shift = (weights @ d) / drawn
        square = weights @ d**2 - 2.0 * shift * (weights @ (d * m)) + shift**2 * (weights @ m**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            spread = scale * np.sqrt(np.maximum(square, 0.0)) / drawn
            t = shift / spread
        # One cluster drawn k times has no spread: the resample says nothing.
        t[~np.isfinite(t) | (spread < LEAST_SPREAD * error[part])] = np.nan
        t[:, np.isnan(t).all(axis=0)] = 0.0
        upper, lower = np.nanquantile(t, [1.0 - tail, tail], axis=0)
        low[part] = mean[part] - upper * error[part]
        high[part] = mean[part] - lower * error[part]
    return mean, low, high


def interval(values: npt.ArrayLike, clusters: npt.ArrayLike | None = None) -> Interval:
    """Mean of all draws with its 95 % interval.

    Parameters
    ----------
    values : array_like (n,)
        One per draw; what is not finite is left out.
    clusters : array_like (n,), optional
        What belongs together (the track); without, or where there is one cluster only, each value is one
        of its own and the interval speaks of this track.
    """
    finite, labels = clustered(values, clusters)
    if len(finite) == 0:
        return Interval(np.nan, np.nan, np.nan)
    sums = np.bincount(labels, finite).astype(np.float64)
    counts = np.bincount(labels).astype(np.float64)
    value, low, high = mean_interval(sums, counts)
    return Interval(float(value[0]), float(low[0]), float(high[0]))


def clustered(
    values: npt.ArrayLike, clusters: npt.ArrayLike | None, *, apart: bool = True
) -> tuple[FloatArray, npt.NDArray[np.intp]]:
    """Finite values (n,), and the numbers of their clusters from 0 (n,).

    Without clusters, or where there is one only (unless ``apart`` is false), each value is one of its own.
    """
    every = np.asarray(values, dtype=np.float64)
    is_finite = np.isfinite(every)
    finite = every[is_finite]
    if clusters is not None and len(finite):
        _, labels = np.unique(np.asarray(clusters)[is_finite], return_inverse=True)
        if labels.max() > 0 or not apart:
            return finite, labels.astype(np.intp)
    return finite, np.arange(len(finite), dtype=np.intp)
