"""Standing or not, from an IMU alone: how quiet it is, and how likely that makes it that the train stands.

A train begins its ride at rest: how quiet that is is read from its first second, and from any quieter one
since. It is quiet again where, over the last `WINDOW_S`, no axis shakes by more, no axis turns, and the force
along the track stays (`quiet_of`): what can be said without knowing anything of the ride. Steady traction is
as quiet as that for some seconds, and a stop of less than the window is not found.

The floor of a car that crawls, brakes gently or rolls smoothly shakes no more than at a platform. Who knows
the sensors' biases and about how fast the train is can say more, and how sure that is (`rest_log_ratio`):
rails are never so straight that a train could run over them without turning a little, in pitch above all.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, IntArray, njit_borrowed
from simrail.core.trailing import trailing_sum
from simrail.recording.recording import Recording

WINDOW_S = 2.0
"""That must be quiet."""

REFERENCE_S = 1.0
"""Within which every train still stands."""

LOUDER = 1.6
"""Of the quiet level: passengers and equipment differ from stop to stop."""

TURNING_RADPS = 1.5e-3
"""A bias of a gyro wanders by less between two stops; a curve of 1500 m at 2 m/s is as much."""

STEADY_MPS2 = 0.02
"""By so much the two halves of the window may differ in force along the track, besides their noise."""


TURN_S = 3.0
"""Over which turning is averaged: at a walking pace what turns a body changes within some seconds."""

FORCE_S = 0.4
"""Over which the force along the track is averaged: a train that leaves shows it so soon."""

RESTS_LOG_SD = 0.2
"""Of the logarithm of what shakes, from one rest to another: passengers and equipment differ."""

LOG_LEVELS = 5.0
"""A train that runs shakes by anything up to exp(5) = 150 times what it does at rest, or no
more than then."""

LEAST_SHAKING = np.array([2e-5] * 3 + [1e-3] * 3)
"""No train is so still that less than this, rad/s and m/s2, would tell motion from rest."""

REST_TURN_RADPS = 5e-5
"""What passengers turn a body at rest, averaged over `TURN_S`: standard deviation."""

LEAST_TURN_RADPS = np.array([1e-4, 4e-4, 1e-4])
"""What rails turn a body about its axes at a slow walking pace, .5 m/s, averaged likewise."""

REST_FORCE_MPS2 = 0.02
"""What passengers shake the force along the track by at rest, averaged over `FORCE_S`: standard deviation."""

RUN_FORCE_MPS2 = 0.2
"""What a train's acceleration is while traction or brakes work."""

STEADY_SHARE, STEADY_FORCE_MPS2 = 0.5, 0.05
"""So much of its time a train keeps its speed or coasts: its acceleration is that of rolling resistance and
of who holds a speed by hand. So does one that crawls: its acceleration hardly tells it from rest."""

FASTEST_MPS = 40.0
"""Speeds up to this one, of either sign, are taken as equally likely of a train that runs."""

ASTRAY, ASTRAY_SDS = 0.05, 3.0
"""So many estimates of the speed are off by so many times their standard deviation more."""

PRIOR = -1.0
"""Log odds of a train about which nothing is known: it stands for a quarter of its time."""

REST_EXCESS = np.array([3e-3] * 3 + [0.05] * 3)
"""By what shakes so much more than the quietest seconds of a
ride, rad/s and m/s2, and `LOUDER` times as much, the train ran: passengers and equipment shake a floor by
half of that."""

LOUDEST_REST_MPS2 = 0.3
"""What shakes more than this up and down runs, be there quieter seconds or not: ten times a floor at rest."""

SUREST = 14.0
"""Log odds that no number of seconds exceeds: one in a million is something else."""


class Signs(NamedTuple):
    """What an IMU shows of rest at the end of each block of samples; nothing later enters.

    Attributes
    ----------
    shaking : ndarray (n,)
        Logarithm of how much likelier it shakes so at rest than while it runs; -inf where samples are lost.
    turning : ndarray (n, 3)
        Mean angular rate over the last `TURN_S`, rad/s.
    turn_s : ndarray (n,)
        Time over which that mean is taken: less at the start.
    force : ndarray (n,)
        Mean specific force along X over the last `FORCE_S`, m/s2.
    """

    shaking: FloatArray
    turning: FloatArray
    turn_s: FloatArray
    force: FloatArray


def signs_of_rest(recording: Recording, block: int) -> Signs:
    """What the IMU shows of rest, at the end of each block of samples, some ten of them a second."""
    rate = recording.imu_sheet.rate_hz / block
    mean, level, loud, least = _loudness(recording, block)
    window, turn, force = (max(2, round(over * rate)) for over in (WINDOW_S, TURN_S, FORCE_S))
    first = recording.imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)[:1]
    # What changes from block to block: passengers bounce a body up and down, and hardly move it otherwise.
    slow = np.sqrt(np.maximum(_trailing(mean[:, :5] ** 2, window) - level[:, :5] ** 2, 0.0))
    slowest = np.maximum(slow, _floor(recording)[:5] / math.sqrt(block))
    full = slowest[window - 1 :]  # of few blocks it is less
    full[:] = np.minimum.accumulate(full, axis=0)
    louder = np.log((loud + LEAST_SHAKING) / (least + LEAST_SHAKING))
    slower = np.log((slow + LEAST_SHAKING[:5]) / (slowest + LEAST_SHAKING[:5]))
    rows = np.minimum(np.arange(1, len(mean) + 1), window)
    shaking = np.minimum(_log_ratio_of_shaking(louder, rows * block), _log_ratio_of_shaking(slower, rows))
    shaking[: round(REFERENCE_S * rate)] = math.log(2.0)
    shaking[_interpolated(recording, block, len(mean))] = -np.inf
    return Signs(
        shaking=shaking,
        turning=_trailing(mean[:, :3], turn) + first[:, :3],
        turn_s=np.minimum(np.arange(1, len(mean) + 1), turn) / rate,
        force=_trailing(mean[:, 3:4], force)[:, 0] + first[0, 3],
    )


def require_rest_first(recording: Recording) -> None:
    """Refuse a ride that does not begin at rest: what is learnt from its first second would be wrong.

    Raises
    ------
    InputError
        If what shakes in the first second is above `REST_EXCESS` or `LOUDEST_REST_MPS2`.
    """
    rate = recording.imu_sheet.rate_hz
    block = max(1, round(0.1 * rate))
    _, _, loud, least = _loudness(recording, block)
    if len(loud) < round(WINDOW_S * rate / block):
        return
    first = loud[round(REFERENCE_S * rate / block) - 1]
    quietest = least[-1]
    excess = np.sqrt(np.maximum(first**2 - quietest**2, 0.0))
    runs = bool(((excess > REST_EXCESS) & (first > LOUDER * quietest)).any())
    vertical = math.sqrt(max(first[5] ** 2 - (_floor(recording)[5] / 0.75) ** 2, 0.0))
    if not runs and vertical < LOUDEST_REST_MPS2:
        return
    ratio = float((first / np.maximum(quietest, LEAST_SHAKING)).max())
    raise InputError(
        "the ride does not begin at rest, and without a stop nobody knows the biases of an IMU and its speed",
        field="imu",
        value=f"{vertical:.2g} m/s2 up and down in its first second, {ratio:.2g} times the quietest",
        limit=f"{LOUDEST_REST_MPS2:g} m/s2, {LOUDER:g} times",
        remedy="begin the recording while the train stands, some ten seconds before it leaves",
    )


def _log_ratio_of_shaking(louder: FloatArray, values: IntArray) -> FloatArray:
    """Of the axis that speaks most against rest, (n,), from the logarithms of how much louder all are (n, m).

    At rest these are normal, and vary as those of a standard deviation of so many values do beside; of a
    train that runs half are, and half anything up to `LOG_LEVELS`. So what shakes can deny rest, and never
    show it: the most that is said is ln 2.
    """
    sd = np.hypot(RESTS_LOG_SD, np.sqrt(0.5 / np.maximum(values - 1, 1)))
    most = louder.max(axis=1, initial=0.0)
    log_rest = -0.5 * (most / sd) ** 2 - np.log(sd * math.sqrt(2.0 * math.pi))
    return np.asarray(log_rest - np.logaddexp(log_rest + math.log(0.5), math.log(0.5 / LOG_LEVELS)))


def _interpolated(recording: Recording, block: int, steps: int) -> npt.NDArray[np.bool_]:
    """Whether samples were lost within the longest of the windows before the end of each block."""
    lost = np.zeros(steps, dtype=np.bool_)
    if recording.gaps is None:
        return lost
    ends = recording.imu.index.to_numpy(dtype=np.float64)[block - 1 :: block][:steps]
    for start, end in recording.gaps[["start_s", "end_s"]].to_numpy(dtype=np.float64):
        lost |= (ends > start) & (ends < end + max(WINDOW_S, TURN_S))
    return lost


@njit_borrowed
def rest_log_ratio(
    shaking: float,
    turn: FloatArray,
    turn_variance: FloatArray,
    push: float,
    push_variance: float,
) -> float:
    """Logarithm of how much likelier an IMU's signs are at rest than of a train that runs; less known biases.

    Each sign is normal, at rest with the variance of what the sensors and passengers do, while it runs with
    that of the least that rails and driving add to it, of the force one of two:

        ln p(x | rest) - ln p(x | runs) = (ln(1 + m^2/s^2) - x^2/s^2 + x^2/(s^2 + m^2)) / 2

    Parameters
    ----------
    shaking : float
        As in `Signs`.
    turn, turn_variance : ndarray (3,)
        Mean rate over `TURN_S` less the gyro's bias, rad/s, and how well both are known.
    push, push_variance : float
        Mean acceleration over `FORCE_S` by the accelerometer and the slope that the body has, m/s2, likewise.
    """
    total = shaking
    for i in range(3):
        rest = turn_variance[i] + REST_TURN_RADPS**2
        total += _log_ratio(turn[i], rest, rest + LEAST_TURN_RADPS[i] ** 2)
    rest = push_variance + REST_FORCE_MPS2**2
    driven = math.log(1.0 - STEADY_SHARE) - _log_ratio(push, rest, rest + RUN_FORCE_MPS2**2)
    steady = math.log(STEADY_SHARE) - _log_ratio(push, rest, rest + STEADY_FORCE_MPS2**2)
    most = max(driven, steady)
    return total - most - math.log(math.exp(driven - most) + math.exp(steady - most))


@njit_borrowed
def speed_log_ratio(speed: float, variance: float) -> float:
    """Logarithm of how much likelier an estimate of the speed is at rest than of a train that runs.

    A share `ASTRAY` of estimates is off by `ASTRAY_SDS` times what it says: a stop at which a filter was led
    astray must be found above all.
    """
    square = speed * speed / variance
    said = math.log(1.0 - ASTRAY) - 0.5 * square
    more = math.log(ASTRAY / ASTRAY_SDS) - 0.5 * square / ASTRAY_SDS**2
    most = max(said, more)
    likely = most + math.log(math.exp(said - most) + math.exp(more - most))
    return likely - 0.5 * math.log(2.0 * math.pi * variance) + math.log(2.0 * FASTEST_MPS)


@njit_borrowed
def _log_ratio(value: float, rest: float, runs: float) -> float:
    """Difference ln N(value; 0, rest) - ln N(value; 0, runs), of variances."""
    return 0.5 * (math.log(runs / rest) - value * value * (1.0 / rest - 1.0 / runs))


def quiet_of(recording: Recording, block: int) -> npt.NDArray[np.bool_]:
    """Whether the IMU shows no motion, at the end of each block of samples; nothing later enters."""
    rate = recording.imu_sheet.rate_hz / block
    window, reference = max(2, round(WINDOW_S * rate)), max(1, round(REFERENCE_S * rate))
    mean, level, loud, least = _loudness(recording, block)
    steps = len(mean)
    half = window // 2
    late, early = _trailing(mean[:, 3:4], half), _trailing(mean[:, 3:4], window)
    noise = LOUDER * least[:, 3:4] / np.sqrt(half * block)
    steady = np.abs(late - early)[:, 0] < 0.5 * STEADY_MPS2 + 3.0 * noise[:, 0]
    still = (loud < LOUDER * least).all(axis=1) & steady
    off = np.abs(level - level[min(reference, steps) - 1]) if steps else level
    still &= (off[:, :3] < TURNING_RADPS).all(axis=1)
    still[:reference] = True
    return np.asarray(still)


def _loudness(recording: Recording, block: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Mean of each block, mean and standard deviation over the window, the least of these; (n, 6) each."""
    rate = recording.imu_sheet.rate_hz / block
    window, reference = max(2, round(WINDOW_S * rate)), max(1, round(REFERENCE_S * rate))
    signals = recording.imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)
    signals = signals - signals[:1]
    steps = len(signals) // block
    blocks = signals[: steps * block].reshape(steps, block, 6)
    mean, square = blocks.mean(axis=1), (blocks**2).mean(axis=1)
    level = _trailing(mean, window)
    loud = np.sqrt(np.maximum(_trailing(square, window) - level**2, 0.0))
    loud[: reference - 1] = loud[min(reference, steps) - 1] if steps else 0.0  # of few samples it is any
    return mean, level, loud, np.minimum.accumulate(np.maximum(loud, _floor(recording)), axis=0)


def _trailing(values: FloatArray, window: int) -> FloatArray:
    """Mean (n, m) over the last so many rows, over fewer at the start."""
    rows = np.minimum(np.arange(1, len(values) + 1), window)
    return np.asarray(trailing_sum(values, window) / rows[:, None])


def _floor(recording: Recording) -> FloatArray:
    """Standard deviation of a sample by the sheet (6,): no window is quieter than three quarters of it."""
    sheet = recording.imu_sheet
    gyro, accel = (
        0.75 * np.hypot(density * np.sqrt(sheet.rate_hz), count / np.sqrt(12.0))
        for density, count in (
            (sheet.gyro_noise_radpsqrts, sheet.gyro_resolution_radps),
            (sheet.accel_noise_mpsqrts, sheet.accel_resolution_mps2),
        )
    )
    return np.array([gyro] * 3 + [accel] * 3)
