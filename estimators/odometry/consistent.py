"""An odometry whose acceleration is the slope of its speed, for estimators that work after the ride.

A causal odometry cannot know an acceleration without lag and noise: that of an encoder is late by 0.15 s
and wrong by 0.1 m/s2 where the rolling radius changes in a curve. A smoother of trajectories takes the
difference to the accelerometer for a share of the centripetal acceleration, and so for yaw: 0.04 m/s2 below
1 Hz are a degree. After the ride the slope of the speed is better. Corrections of the place do no such harm.
"""

import numpy as np
from simrail.estimators.odometry.calm import calm

from simrail.recording.recording import Recording, odometry_of

AGREES_MPS2 = 0.01
"""Rms difference up to there, below which an acceleration is the slope: a smoothed odometry has 0.003, an
encoder 0.03."""


def with_consistent_acceleration(recording: Recording) -> Recording:
    """The recording with the slope of the speed, without lag, for an acceleration.

    A recording whose odometry has that already is returned as it is.
    """
    odometry, rate = odometry_of(recording), recording.imu_sheet.rate_hz
    slope = np.gradient(odometry["speed_mps"].to_numpy(dtype=np.float64), 1.0 / rate)
    off = odometry["acceleration_mps2"].to_numpy(dtype=np.float64) - slope
    if np.sqrt(np.mean(calm(off, rate) ** 2)) < AGREES_MPS2:
        return recording
    return recording.with_odometry(
        odometry.assign(acceleration_mps2=calm(slope, rate)), recording.odometry_source
    )
