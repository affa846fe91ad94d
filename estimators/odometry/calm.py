"""A train's own acceleration, which changes slowly, apart from what its body shakes."""

import math

import numpy as np
from scipy import signal

from simrail.core.columns import ACCEL
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording

CALM_HZ = 1.0
"""Up to here an acceleration, or a slope of the speed, is the train's."""

ACCELERATION_SD_MPS2 = 0.03
"""Of that acceleration: what the body's pitching leaves in it. What it shakes beside that is measured."""

POWER_S = 5.0
"""So long is averaged over what it shakes: it changes with the speed."""


def calm(values: FloatArray, rate_hz: float) -> FloatArray:
    """What of values (n,) lies below `CALM_HZ`, without lag."""
    sections = signal.butter(2, CALM_HZ, fs=rate_hz, output="sos")
    padding = min(len(values) - 1, int(3.0 * rate_hz / CALM_HZ))
    low: FloatArray = signal.sosfiltfilt(sections, values, padlen=padding)
    return low


def calm_so_far(values: FloatArray, rate_hz: float) -> FloatArray:
    """The same of what is known by each of them, (n,): critically damped, two equal lags."""
    keep = math.exp(-2.0 * math.pi * CALM_HZ / rate_hz)
    passed: FloatArray = signal.lfilter([(1.0 - keep) ** 2], [1.0, -2.0 * keep, keep * keep], values)
    return passed


def unsteady(recording: Recording, block: int, steps: int) -> FloatArray:
    """Variance of the accelerometer along X within each block less its white noise, (steps,), (m/s2)^2."""
    sheet = recording.imu_sheet
    force = recording.imu[ACCEL[0]].to_numpy(dtype=np.float64)[: steps * block].reshape(steps, block)
    within: FloatArray = force.var(axis=1) - sheet.accel_noise_mpsqrts**2 * sheet.rate_hz
    return within


def power(squares: FloatArray, rate_hz: float, *, both_ways: bool) -> FloatArray:
    """Mean of squares (n,) over the last `POWER_S`, or over as long before and after; not negative."""
    keep = math.exp(-1.0 / (POWER_S * rate_hz))
    passed: FloatArray = signal.lfilter([1.0 - keep], [1.0, -keep], squares)
    if both_ways:
        passed = signal.lfilter([1.0 - keep], [1.0, -keep], passed[::-1])[::-1]
    return np.maximum(passed, 0.0)
