"""Gyro bias from the initial rest: a running mean while the train has not moved, frozen afterwards.

Every attitude method uses this one, so that none gets a better gyro than another. It is causal: the
bias at a sample is the mean of the samples at least `simrail.rest.GUARD_S` older, so that the first jerk
of a departure, which the encoder notices late, never enters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simrail.columns import GYRO
from simrail.jit import FloatArray
from simrail.recording import Recording
from simrail.rest import GUARD_S, first_motion_s


class RestBias(NamedTuple):
    """Gyro bias over time, n samples.

    Attributes
    ----------
    bias : ndarray (n, 3)
        Mean rate of the rest so far, rad/s; zero while nothing has been averaged.
    samples : ndarray (n,)
        How many samples it is the mean of.
    """

    bias: FloatArray
    samples: FloatArray


def rest_bias(recording: Recording, *, enabled: bool = True) -> RestBias:
    """Average the gyro over the initial rest, causally.

    Parameters
    ----------
    recording : Recording
        The recording.
    enabled : bool
        False gives zero bias from zero samples.

    Returns
    -------
    RestBias
        Row k uses samples older than `simrail.rest.GUARD_S` only, and none after the first motion.
    """
    gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
    n = gyro.shape[0]
    if not enabled:
        return RestBias(np.zeros((n, 3)), np.zeros(n))
    guard = round(GUARD_S * recording.imu_sheet.rate_hz)
    standing = np.searchsorted(recording.imu.index.to_numpy(dtype=np.float64), first_motion_s(recording))
    used = np.maximum(np.minimum(np.arange(n), standing) - guard, 0)
    # cumsum adds in the order of time, so a prefix of the recording has the very same sums.
    sums = np.vstack([np.zeros(3), np.cumsum(gyro, axis=0)])
    return RestBias(sums[used] / np.maximum(used, 1)[:, None], used.astype(np.float64))


def step_rates(recording: Recording, bias: FloatArray) -> FloatArray:
    """Body rate over the step that ends at each sample: the mean of its two ends, less the bias.

    The trapezoid takes away the half sample of lag that the rate of one end alone would have.

    Parameters
    ----------
    recording : Recording
        The recording.
    bias : ndarray (n, 3)
        Gyro bias, rad/s.

    Returns
    -------
    ndarray (n, 3)
        rad/s, C-contiguous; row 0 is the first sample itself.
    """
    gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
    rates = gyro - bias
    rates[1:] -= 0.5 * (gyro[1:] - gyro[:-1])
    return np.ascontiguousarray(rates)
