"""An odometry whose acceleration is the slope of its speed, for estimators that work after the ride.

A causal odometry cannot know an acceleration without lag and noise: that of an encoder is late by 0.15 s
and wrong by 0.1 m/s2 where the rolling radius changes in a curve. A smoother of trajectories takes the
difference to the accelerometer for a share of the centripetal acceleration, and so for yaw: 0.04 m/s2 below
1 Hz are a degree. After the ride the slope of the speed is better. Corrections of the place do no such harm.
"""

import math

import numpy as np
from scipy import signal

from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording, odometry_of

CALM_HZ = 1.0
"""Up to here a slope of the speed is the train's."""

AGREES_MPS2 = 0.01
"""Rms difference up to there, below which an acceleration is the slope: a smoothed odometry has 0.003, an
encoder 0.03."""


def with_consistent_acceleration(recording: Recording, *, causal: bool) -> Recording:
    """The recording with the slope of the speed for an acceleration; itself where that is so already.

    Parameters
    ----------
    recording : Recording
        With an odometry.
    causal : bool
        True: from the speed so far, some 0.3 s late. False: without lag.
    """
    odometry, rate = odometry_of(recording), recording.imu_sheet.rate_hz
    speed = odometry["speed_mps"].to_numpy(dtype=np.float64)
    off = odometry["acceleration_mps2"].to_numpy(dtype=np.float64) - np.gradient(speed, 1.0 / rate)
    if np.sqrt(np.mean(_low(off, CALM_HZ, rate) ** 2)) < AGREES_MPS2:
        return recording
    if causal:
        # The slope of the speed so far, and two equal lags.
        slope = np.diff(speed, prepend=speed[0]) * rate
        keep = math.exp(-2.0 * math.pi * CALM_HZ / rate)
        calm = signal.lfilter([(1.0 - keep) ** 2], [1.0, -2.0 * keep, keep * keep], slope)
    else:
        calm = _low(np.gradient(speed, 1.0 / rate), CALM_HZ, rate)
    return recording.with_odometry(odometry.assign(acceleration_mps2=calm), recording.odometry_source)


def _low(values: FloatArray, cutoff_hz: float, rate_hz: float) -> FloatArray:
    """What lies below a frequency, without lag."""
    sections = signal.butter(2, cutoff_hz, fs=rate_hz, output="sos")
    padding = min(len(values) - 1, int(3.0 * rate_hz / cutoff_hz))
    low: FloatArray = signal.sosfiltfilt(sections, values, padlen=padding)
    return low
