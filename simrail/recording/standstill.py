"""When the train stands, as a logger would find it: from the encoder, where there is one.

A count that stays within one of where it was says that the wheel has turned by less than two counts; how
slowly it still turned, no encoder knows. Therefore the rest that is trusted keeps away from the pulses at
both ends: by what a train that stops or starts gently may move unseen, and by what the body still swings
after a stop. An edge on which the wheel happens to stand may be counted to and fro: that is no motion.

Used for averaging the gyro bias at rest (`simrail.estimators.attitude.rest_bias`). It does not average
anything itself.
"""

import numpy as np
import pandas as pd

from simrail.core.jit import FloatArray, njit_borrowed
from simrail.recording.recording import Recording

GUARD_S = 0.5
"""Rest is not trusted at least this long before a pulse."""

GENTLE_JERK_MPS3 = 0.2
"""Jerk of a gentle start or stop, half of a usual one: it moves by jerk t^3 / 6 in the time t."""

SETTLE_S = 1.0
"""Rest is not trusted at least this long after the last pulse of a stop: the body still swings."""

SHORTEST_S = 1.0
"""A stop is a rest if it leaves so much between the guards: nothing that crawls leaves a second without
two pulses in between (below 2 mm/s with 1024 pulses on a wheel of 0.29 m)."""

STILL_MPS = 0.01
"""Without an encoder, a train is at rest below this speed of its odometry or odometer."""


def guard_s(recording: Recording) -> float:
    """Time before a pulse in which the train may already have moved.

    Returns
    -------
    float
        Time in which a gentle start moves by two counts, (12 q / jerk)^(1/3), at least `GUARD_S`: an
        encoder of few pulses sees a departure late.
    """
    if recording.encoder_sheet is None:
        return GUARD_S
    way = 2.0 * recording.encoder_sheet.pulse_m
    return max(GUARD_S, float(np.cbrt(6.0 * way / GENTLE_JERK_MPS3)))


def motion_times(recording: Recording) -> FloatArray:
    """Times (m,) at which the train was seen to move, increasing.

    From the encoder: first the first pulse, then every reading whose count is more than one away from any
    since the last such time. Whether a time is among them depends on no later reading. Without an
    encoder: every time at which the speed of the odometry, or of the odometer, is above `STILL_MPS`. Where
    nothing tells of motion, nothing tells of rest: every time.
    """
    if recording.encoder is not None:
        turned = np.zeros(len(recording.encoder), dtype=np.bool_)
        _moves(recording.encoder["pulse_count"].to_numpy(dtype=np.float64), turned)
        return _times(recording.encoder)[turned]
    way = recording.odometer if recording.odometry is None else recording.odometry
    if way is None:
        return _times(recording.imu)
    return _times(way[np.abs(way["speed_mps"].to_numpy()) > STILL_MPS])


def _times(frame: pd.DataFrame) -> FloatArray:
    times: FloatArray = frame.index.to_numpy(dtype=np.float64)
    return times


@njit_borrowed
def _moves(count: FloatArray, moved: np.ndarray) -> None:
    """Mark in ``moved`` (n,), all False, the readings that say that the wheel turned."""
    low = high = count[0]
    band = 0.0  # nothing is known of the edges at first; later one count to and fro is no motion
    for k in range(1, len(count)):
        low, high = min(low, count[k]), max(high, count[k])
        if high - low > band:
            moved[k] = True
            low = high = count[k]
            band = 1.0


def rest_periods(recording: Recording) -> pd.DataFrame:
    """Times at which the train certainly stood.

    Parameters
    ----------
    recording : Recording
        The ride.

    Returns
    -------
    pandas.DataFrame
        Columns ``start_s`` and ``end_s``, one row per rest, guards taken off: the initial one, every stop
        that is long enough, the final one. Its end is `guard_s` before the next sign of motion, or before
        the end of the recording, where the next pulse may be due. No rows for a train that never stands.
    """
    times = recording.imu.index.to_numpy(dtype=np.float64)
    moves, guard = motion_times(recording), guard_s(recording)
    starts = np.concatenate([times[:1], moves + max(SETTLE_S, guard)])
    ends = np.append(moves, times[-1]) - guard
    long_enough = ends - starts >= SHORTEST_S
    # The train knows that it stood at first: there, any time will do.
    long_enough[0] = ends[0] > starts[0]
    return pd.DataFrame({"start_s": starts[long_enough], "end_s": ends[long_enough]})


def first_motion_s(recording: Recording) -> float:
    """Time of the first sign of motion: the first of `motion_times`.

    Returns
    -------
    float
        Time in s; infinity if the train never moves.
    """
    moves = motion_times(recording)
    return float(moves[0]) if len(moves) else float("inf")


def at_rest_initially(recording: Recording) -> int:
    """Number of IMU samples before the first motion, less the guard.

    Returns
    -------
    int
        All samples, if the train never moves. A filter that must not look ahead may use at time t
        those of them that are older than t - `guard_s`: then whatever it used was at rest.
    """
    times = recording.imu.index.to_numpy()
    return int(np.searchsorted(times, first_motion_s(recording) - guard_s(recording), side="left"))
