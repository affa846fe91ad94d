"""Which way a train runs, for methods whose sensor tells no sign: given, by the encoder, or by the IMU.

Vibration tells how fast a train runs, not which way. A train that is not turned at the end of its line runs
back backwards, so the direction belongs to each departure: the first acceleration after a rest points along
it.
"""

import numpy as np
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.standstill import quiet_of

from simrail.core.columns import ACCEL
from simrail.core.jit import FloatArray, njit
from simrail.recording.recording import Recording

DIRECTIONS = ("forwards", "backwards", "first_acceleration", "encoder")
"""The whole ride towards larger s; towards smaller s; from the IMU at each departure; the sign that the
encoder counts with, which stands for the signal of the occupied cab."""

BLOCK_S = 0.04
"""In which the IMU is averaged."""

STARTS_MPS2 = 0.15
"""By so much the force along the track must leave its level at rest: less than the gentlest departure, more
than a body's pitch under passengers (1 mrad is 0.01 m/s2)."""

LOOK_S = 0.5
"""Over which the force is averaged for that: half a second outlasts a cycle of anything that shakes."""

REST_S = 60.0
"""Shortest rest after which a train may leave the other way. A driver who changes ends takes minutes; a train
that runs smoothly on good rails is as quiet as a rest for some tens of seconds at most."""


def running_direction(recording: Recording, how: str) -> FloatArray:
    """Direction of running at every IMU sample, +1 towards larger s and -1 towards smaller.

    Parameters
    ----------
    recording : Recording
        The recording.
    how : str
        One of `DIRECTIONS`.

    Returns
    -------
    ndarray (n,)
        Nothing later than a sample enters it. Before anything is known: +1.
    """
    n = len(recording.imu)
    if how == "forwards":
        return np.ones(n)
    if how == "backwards":
        return -np.ones(n)
    if how == "encoder":
        speed = EncoderOdometry().estimate(recording).states["speed_mps"].to_numpy(dtype=np.float64)
        return _held_sign(speed)
    block = max(1, round(BLOCK_S * recording.imu_sheet.rate_hz))
    rate = recording.imu_sheet.rate_hz / block
    force = recording.imu[ACCEL[0]].to_numpy(dtype=np.float64)
    blocks = n // block
    means = np.ascontiguousarray(force[: blocks * block].reshape(blocks, block).mean(axis=1))
    found = np.ones(blocks + 1)
    _departures(means, quiet_of(recording, block), max(1, round(LOOK_S * rate)), round(REST_S * rate), found)
    return np.asarray(found[(np.arange(n) + 1) // block])


def _held_sign(speed: FloatArray) -> FloatArray:
    """Sign (n,) of a speed, the last one where it is zero."""
    moves = np.where(speed != 0.0, np.arange(len(speed)), -1)
    last = np.maximum.accumulate(moves)
    return np.where(last >= 0, np.sign(speed[np.maximum(last, 0)]), 1.0)


@njit
def _departures(force: FloatArray, quiet: np.ndarray, look: int, rest: int, direction: FloatArray) -> None:
    """Direction after each block: entry j + 1 of ``direction`` (m + 1,) knows blocks 0 to j.

    The level at rest is the mean over the rest so far, less what the last look may have of a departure.
    """
    resting, total, count, quiet_for = True, 0.0, 0, 0
    for j in range(len(force)):
        direction[j + 1] = direction[j]
        quiet_for = quiet_for + 1 if quiet[j] else 0
        if not resting and quiet_for >= rest:
            resting, total, count = True, 0.0, 0
        if not resting:
            continue
        begin = max(j + 1 - look, 0)
        recent = 0.0
        for i in range(begin, j + 1):
            recent += force[i]
        recent /= j + 1 - begin
        if count == 0:
            total, count = recent, 1
        off = recent - total / count
        if abs(off) > STARTS_MPS2:
            direction[j + 1] = 1.0 if off > 0.0 else -1.0
            resting = False
        else:
            total += recent
            count += 1
