"""How sure a share of devices is, and when it is sure enough for a verdict.

Devices on one track have the track in common. If the tracks matter, many devices on few tracks say less than
as many on tracks of their own: they count as `effective` many.
"""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import stats

from simrail.scoring.statistics import levels

ENOUGH, NOT_ENOUGH, UNDECIDED, NOT_JUDGED = "enough", "not enough", "not enough draws", "not judged"


def wilson(passed: float, devices: float, *, confidence: float = 0.95) -> tuple[float, float]:
    """Interval of a share (Wilson 1927, equation for the score interval); NaN without devices.

    Parameters
    ----------
    passed, devices : float
        How many met a limit, of how many; effective ones need not be whole.
    confidence : float
        Two-sided.
    """
    if devices <= 0.0:
        return math.nan, math.nan
    z = float(stats.norm.ppf(0.5 + 0.5 * confidence))
    share, square = passed / devices, z * z / devices
    centre = (share + 0.5 * square) / (1.0 + square)
    reach = z * math.sqrt(share * (1.0 - share) / devices + 0.25 * square / devices) / (1.0 + square)
    return max(centre - reach, 0.0), min(centre + reach, 1.0)


def effective(values: npt.ArrayLike, clusters: npt.ArrayLike) -> float:
    """How many independent devices these count as, by what their tracks have in common.

    The design effect of a share in clusters, 1 + (m - 1) rho (Kish 1965, section 5.4), with m devices on a
    track and rho the share of the figure's variance that lies between tracks. It is taken of the figure's
    logarithm, which says something also where all devices pass; whether a limit is met hangs together by less
    than the figure itself.

    Parameters
    ----------
    values : array_like (n,)
        The figure of each device, positive; what is not finite says nothing of the tracks.
    clusters : array_like (n,)
        Its track.
    """
    every, labels = np.asarray(values, dtype=np.float64), np.asarray(clusters)
    n, k = len(every), len(np.unique(labels))
    if k < 2 or k == n:
        return float(n)
    good = np.isfinite(every) & (every > 0.0)
    sensor, track = levels(np.log(every[good]), labels[good]) if good.any() else (math.nan, math.nan)
    both = sensor**2 + track**2
    rho = track**2 / both if both > 0.0 else 1.0
    if not math.isfinite(rho):
        rho = 1.0
    return n / (1.0 + (n / k - 1.0) * rho)


def decide(passed: float, devices: float, share: float, *, chance: float, looks: Sequence[int] = (1,)) -> str:
    """Whether a share of the devices meets a limit, wrong with no more than a chance.

    By the exact limits of a binomial share (Clopper & Pearson 1934), one-sided: enough if fewer than
    ``share`` would have let so many pass with at most this chance, not enough if more would have let so few.
    Of several looks at a growing number of devices each has its part of the chance (Bonferroni); one at which
    there are fewer devices than could ever be enough has no part of that for "enough".

    Parameters
    ----------
    passed, devices : float
        As in `wilson`.
    share : float
        That is asked for.
    chance : float
        Of a verdict that is false, after all looks.
    looks : sequence of int
        Devices at each look.
    """
    failed, least = devices - passed, least_devices(share, chance)
    late = max(sum(count >= least for count in looks), 1)
    low = float(stats.beta.ppf(chance / late, passed, failed + 1.0)) if passed > 0.0 else 0.0
    high = float(stats.beta.ppf(1.0 - chance / len(looks), passed + 1.0, failed)) if failed > 0.0 else 1.0
    if low >= share:
        return ENOUGH
    return NOT_ENOUGH if high < share else UNDECIDED


def least_devices(share: float, chance: float) -> int:
    """How many devices must all pass before it is enough: the least n with ``share**n <= chance``."""
    return math.ceil(math.log(chance) / math.log(share) - 1e-9)
