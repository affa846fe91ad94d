"""What draws say beside their mean: levels of chance, consistency, and two methods side by side.

Numbers in, numbers out; intervals are those of `simrail.scoring.bootstrap`, tables are made in
`simrail.scoring.aggregate`.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.special import ndtri

from simrail.scoring.bootstrap import CONFIDENCE, Interval, clustered, interval


@dataclass(frozen=True)
class Comparison:
    """Two methods over the same draws.

    Attributes
    ----------
    difference : Interval
        Mean of the first less the second.
    win_rate : Interval
        Share of the draws in which the first is smaller; ties count half.
    effect_size : float
        Mean over standard deviation of the differences (Cohen's d_z).
    pairs : int
        Draws that both have.
    """

    difference: Interval
    win_rate: Interval
    effect_size: float
    pairs: int


def levels(values: npt.ArrayLike, clusters: npt.ArrayLike) -> tuple[float, float]:
    """Standard deviation that the sensors cause, and that which the tracks cause beside it.

    The usual components of variance of one-way analysis (Searle, Casella, McCulloch 1992, chapter 3):
    within clusters, and what is between their means more than that explains. NaN where the number of
    draws does not allow them; a component below zero is zero.
    """
    finite, labels = clustered(values, clusters, apart=False)
    k = int(labels.max()) + 1 if len(finite) else 0
    if k == 0:
        return np.nan, np.nan
    n = np.bincount(labels, minlength=k).astype(np.float64)
    means = np.bincount(labels, finite, k) / n
    total = float(n.sum())
    within = float(np.square(finite - means[labels]).sum())
    sensor = within / (total - k) if total > k else np.nan
    if k < 2:
        return float(np.sqrt(sensor)), np.nan
    between = float((n * np.square(means - finite.mean())).sum()) / (k - 1)
    size = (total - float(np.square(n).sum()) / total) / (k - 1)
    noise = sensor if np.isfinite(sensor) else 0.0
    return float(np.sqrt(sensor)), float(np.sqrt(max(between - noise, 0.0) / size))


def anees_bounds(independent: int, *, dimension: int = 1) -> tuple[float, float]:
    """Between which bounds a consistent method's NEES, averaged over independent draws, lies.

    N d times the average of d-dimensional NEES divided by d is chi-square with N d degrees of freedom
    (Bar-Shalom, Li, Kirubarajan 2001, section 5.4). A draw's own average over its ride counts as one
    independent value, however long the ride is: then errors that last for the whole ride raise no false
    alarm, and shorter ones are given more room than they need.
    """
    freedom = independent * dimension
    low, high = stats.chi2(freedom).interval(CONFIDENCE)
    return float(low) / freedom, float(high) / freedom


def coverage_bounds(independent: int) -> tuple[float, float]:
    """Between which bounds the share of errors inside a consistent method's 95 % interval lies.

    Binomial, with as many trials as there are independent draws; see `anees_bounds`.
    """
    low, high = stats.binom(independent, 0.95).interval(CONFIDENCE)
    return float(low) / independent, float(high) / independent


def compare(
    first: npt.ArrayLike,
    second: npt.ArrayLike,
    clusters: npt.ArrayLike | None = None,
) -> Comparison:
    """Compare two methods over the same draws: whatever both suffer from alike drops out.

    Parameters
    ----------
    first, second : array_like (n,)
        Figures of the two, draw by draw; smaller is better. A draw that one of them lacks is left out.
    clusters : array_like (n,), optional
        See `interval`. The interval of the win rate is Wilson's, with as many trials as there are clusters.
    """
    difference = np.asarray(first, dtype=np.float64) - np.asarray(second, dtype=np.float64)
    paired, labels = clustered(difference, clusters)
    if len(paired) == 0:
        nothing = Interval(np.nan, np.nan, np.nan)
        return Comparison(nothing, nothing, np.nan, 0)
    won = (paired < 0.0) + 0.5 * (paired == 0.0)
    rate, trials = float(won.mean()), int(labels.max()) + 1
    z = float(ndtri(0.5 * (1.0 + CONFIDENCE)))
    middle = (rate + z * z / (2 * trials)) / (1.0 + z * z / trials)
    reach = z / (1.0 + z * z / trials) * np.sqrt(rate * (1.0 - rate) / trials + z * z / (4 * trials**2))
    spread = float(paired.std(ddof=1)) if len(paired) > 1 else np.nan
    return Comparison(
        difference=interval(paired, labels),
        win_rate=Interval(rate, float(middle - reach), float(middle + reach)),
        effect_size=float(paired.mean()) / spread if spread > 0.0 else np.nan,
        pairs=len(paired),
    )
