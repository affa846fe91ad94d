"""Sums over the last rows of a table: what a causal method knows at each."""

import numpy as np

from simrail.core.jit import FloatArray


def trailing_sum(values: FloatArray, window: int) -> FloatArray:
    """Sum (n, m) of values (n, m) over the last ``window`` rows, over fewer at the start.

    Sums are differences of running ones, so that those of a prefix are the same bits.
    """
    total = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    last = np.arange(1, len(values) + 1)
    return np.asarray(total[last] - total[np.maximum(last - window, 0)])
