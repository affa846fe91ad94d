"""When does the train stand? As a logger would find it: from the encoder alone.

Used for averaging the gyro bias at rest. It does not average anything itself.
"""

from __future__ import annotations

import numpy as np

from simrail.recording import Recording

GUARD_S = 0.5
"""Rest is not trusted this long before the first pulse: the wheel turns up to one pulse unseen."""


def first_motion_s(recording: Recording) -> float:
    """Time of the first sign of motion: the first pulse, or without an encoder a speed above 0.01 m/s.

    Returns
    -------
    float
        Time in s; infinity if the train never moves.
    """
    if recording.encoder is not None:
        counts = recording.encoder["pulse_count"].to_numpy()
        times = recording.encoder.index.to_numpy()
        moving = counts != counts[0]
    else:
        times = recording.odometry.index.to_numpy()
        moving = np.abs(recording.odometry["speed_mps"].to_numpy()) > 0.01
    return float(times[np.argmax(moving)]) if moving.any() else float("inf")


def at_rest_initially(recording: Recording, *, guard_s: float = GUARD_S) -> int:
    """Number of IMU samples before the first motion.

    Parameters
    ----------
    recording : Recording
        The ride.
    guard_s : float
        Samples less than this before the first motion do not count.

    Returns
    -------
    int
        All samples, if the train never moves. A filter that must not look ahead may use at time t
        those of them that are older than t - guard_s: then whatever it used was at rest.
    """
    times = recording.imu.index.to_numpy()
    return int(np.searchsorted(times, first_motion_s(recording) - guard_s, side="left"))
