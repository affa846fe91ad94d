"""Quiet, from an IMU alone: as quiet, and as it was, when the train was known to stand.

A train begins its ride at rest: how quiet that is is read from its first second, and from any quieter one
since. It stands again where, over the last `WINDOW_S`, no axis shakes by more, no axis turns, and the force
along the track stays. Steady traction is as quiet as that for some seconds: who asks must hold the force
against the slope of the line as well (`simrail.estimators.odometry.kernel.curve_matched` does).

It says nothing false rather than all that is true: a stop of less than the window is not found.
"""

import numpy as np
import numpy.typing as npt

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
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


def quiet_of(recording: Recording, block: int) -> npt.NDArray[np.bool_]:
    """Whether the IMU shows no motion, at the end of each block of samples; nothing later enters."""
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
    least = np.minimum.accumulate(np.maximum(loud, _floor(recording)), axis=0)
    half = window // 2
    late, early = _trailing(mean[:, 3:4], half), _trailing(mean[:, 3:4], window)
    noise = LOUDER * least[:, 3:4] / np.sqrt(half * block)
    steady = np.abs(late - early)[:, 0] < 0.5 * STEADY_MPS2 + 3.0 * noise[:, 0]
    still = (loud < LOUDER * least).all(axis=1) & steady
    off = np.abs(level - level[min(reference, steps) - 1]) if steps else level
    still &= (off[:, :3] < TURNING_RADPS).all(axis=1)
    still[:reference] = True
    return np.asarray(still)


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
