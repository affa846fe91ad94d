"""How much each of several lines of the same rails counts, octave by octave, and how wrong their mean is."""

from typing import NamedTuple

import numpy as np
from scipy import ndimage
from simrail.estimators.rails.octaves import Octaves

from simrail.core.jit import FloatArray

PRIOR_FREEDOM = 20.0
"""Degrees of freedom that the mean of all passes has in the variance of each."""

LEAST_SHARE = 0.5
"""Of the typical variance, that of a pass is taken for this much at least. Passes may agree because they have
errors alike, such as all that ran the same way: agreement alone shall not outweigh the others."""


WINDOW_M = 50.0
"""Length over which a pass is held against the others."""

MOST_MISFIT = 9.0
"""Mean square of a pass's difference from the median, over the typical one, that chance hardly gives."""

TINY_M2 = 1e-18
"""Variance of a nanometre, for passes that do not differ at all."""


class Weighed(NamedTuple):
    """Variances and weights of n passes in k octaves.

    Attributes
    ----------
    own : ndarray (k, n)
        Variance of what is a pass's own error.
    weight : ndarray (k, n)
        Adding up to 1 in each octave.
    """

    own: FloatArray
    weight: FloatArray

    @property
    def scatter(self) -> FloatArray:
        """Mean variance of the passes' own errors, by their weights, (k,)."""
        return np.asarray((self.weight * self.own).sum(axis=1))

    @property
    def of_mean(self) -> FloatArray:
        """Variance that the own errors leave in the mean, (k,)."""
        return np.asarray((np.square(self.weight) * self.own).sum(axis=1))


def weigh(parts: FloatArray, bank: Octaves, claims: FloatArray) -> Weighed:
    """Find variances and weights of passes from what they differ by.

    With S_i the variance of pass i's own error, it differs from the plain mean of the other n - 1 in the mean
    square by

        P_i = S_i + sum over j, not i, of S_j/(n - 1)^2,

    which is solved for S. Each is drawn towards the median of all, in proportion to what the passes state, by
    `PRIOR_FREEDOM`, and is `LEAST_SHARE` of it at least; two passes show only what both leave together, and
    share it as they state it. Weights are as 1/S.

    Parameters
    ----------
    parts : ndarray (k, n, places)
        Octaves of n >= 2 passes.
    bank : Octaves
        What cut them.
    claims : ndarray (n,)
        Variance that each pass states, in any unit.
    """
    n = parts.shape[1]
    ratio = claims / claims.mean()
    # (n - 1)/n of a pass's difference from the mean of the others is that from the mean of all.
    apart = np.square(parts - parts.mean(axis=1, keepdims=True)).mean(axis=-1) * (n / (n - 1.0)) ** 2
    total = apart.sum(axis=1, keepdims=True) * (n - 1.0) / n
    typical = total / n * ratio
    own = typical
    if n > 2:
        alone = (apart - total / (n - 1.0) ** 2) / (1.0 - 1.0 / (n - 1.0) ** 2)
        typical = np.maximum(np.median(alone / ratio, axis=1, keepdims=True), 0.1 * total / n) * ratio
        freedom = bank.freedoms[:, None]
        own = (freedom * alone + PRIOR_FREEDOM * typical) / (freedom + PRIOR_FREEDOM)
        own = np.maximum(own, LEAST_SHARE * typical)
    info = 1.0 / np.maximum(own, TINY_M2)
    return Weighed(own, info / info.sum(axis=1, keepdims=True))


def fit(waves: FloatArray, step_m: float) -> FloatArray:
    """How well passes fit the others, place by place: 1, or less where one is wrong, a factor on its weight.

    Parameters
    ----------
    waves : ndarray (n, places)
        Of n passes, in a band whose waves are short against `WINDOW_M`.
    step_m : float

    Returns
    -------
    ndarray (n, places)
        With d the mean square over `WINDOW_M` of a pass's difference from the median of all, and t its median
        over the line, of this pass or of all, whichever is greater: (MOST_MISFIT t/d)^2 where that is less
        than 1. What is wrong all along is in the variances. Two passes fit each other alike everywhere.
    """
    if len(waves) < 3:
        return np.ones_like(waves)
    apart = np.square(waves - np.median(waves, axis=0))
    mean = ndimage.uniform_filter1d(apart, max(1, round(WINDOW_M / step_m)), axis=-1, mode="nearest")
    usual = np.maximum(np.median(mean, axis=-1, keepdims=True), max(float(np.median(mean)), TINY_M2))
    limit = MOST_MISFIT * usual
    fits: FloatArray = np.square(np.minimum(1.0, limit / np.maximum(mean, TINY_M2)))
    return fits
