"""Gyro bias from the initial rest: a running mean while the train has not moved, frozen afterwards.

Every attitude method uses this one, so that none gets a better gyro than another. It is causal: the
bias at a sample is the mean of the samples at least `GUARD_S` older, so that the first jerk of a
departure, which the encoder notices late, never enters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simrail.columns import GYRO
from simrail.jit import FloatArray
from simrail.recording import Recording

GUARD_S = 0.5
"""How long before the first sign of motion the averaging ends."""


class RestBias(NamedTuple):
    """Gyro bias over time, n samples.

    Attributes
    ----------
    bias : ndarray (n, 3)
        Mean rate of the rest so far, rad/s; zero while nothing has been averaged.
    count : ndarray (n,)
        How many samples it is the mean of.
    """

    bias: FloatArray
    count: FloatArray


def first_motion(recording: Recording) -> int:
    """Index of the first IMU sample at which the encoder has counted, or n if it never has.

    Without an encoder the odometry's speed decides.
    """
    times = recording.imu.index.to_numpy(dtype=np.float64)
    if recording.encoder is not None and len(recording.encoder):
        counts = recording.encoder["pulse_count"].to_numpy()
        moved = np.flatnonzero(counts != counts[0])
        if moved.size == 0:
            return len(times)
        return int(np.searchsorted(times, recording.encoder.index.to_numpy()[moved[0]]))
    moving = np.flatnonzero(recording.odometry["speed_mps"].to_numpy() != 0.0)
    return int(moving[0]) if moving.size else len(times)


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
        Row k uses samples older than k - `GUARD_S` only, and none after the first motion.
    """
    gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
    n = gyro.shape[0]
    if not enabled:
        return RestBias(np.zeros((n, 3)), np.zeros(n))
    guard = round(GUARD_S * recording.imu_sheet.rate_hz)
    used = np.maximum(np.minimum(np.arange(n), first_motion(recording)) - guard, 0)
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
