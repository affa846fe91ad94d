"""Attitude by gradient descent: Madgwick's filter with track compensation (Briales et al. 2021).

The correction has a fixed speed whatever the size of the mismatch, which makes it robust against
impulsive vibration and unable to follow more than 2 beta of gyro error. It has no covariance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from estimators.compensation import design_frame, gravity_force
from estimators.kernels.attitude import attitude_gda
from estimators.quaternions import from_euler, level, to_euler
from estimators.rest_bias import rest_bias, step_rates
from simrail.columns import ATTITUDE
from simrail.errors import InputError
from simrail.estimate import Estimate
from simrail.recording import Recording


@dataclass(frozen=True)
class AttitudeGda:
    """Gradient descent algorithm of paper 000, Section 5.2 (EQUATIONS 2.4).

    Roll and pitch start at the first accelerometer sample, yaw at the design track's.

    Attributes
    ----------
    compensated : bool
        Take the design track's acceleration off the accelerometer first.
    gyro_error_radps : float
        Gyro error that the correction can hold, rad/s; beta = sqrt(3/4) times it. Paper 000 uses
        0.5 deg/s. Roll and pitch are corrected at up to 2 beta.
    rest_bias : bool
        Subtract the gyro's mean over the initial rest.
    printed : bool
        Compensate as paper 000 prints it (`estimators.compensation.track_acceleration`).
    """

    compensated: bool = True
    gyro_error_radps: float = math.radians(0.5)
    rest_bias: bool = True
    printed: bool = False

    causal = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.gyro_error_radps < math.inf:
            raise InputError(
                "must be a finite rate",
                field="gyro_error_radps",
                value=self.gyro_error_radps,
                limit=">= 0 rad/s",
                remedy="give it in rad/s, e.g. 0.0087 for 0.5 deg/s",
            )

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw at every IMU sample."""
        force = gravity_force(recording, compensated=self.compensated, printed=self.printed)
        rates = step_rates(recording, rest_bias(recording, enabled=self.rest_bias).bias)
        start_yaw = float(design_frame(recording, count=1).yaw_rad[0])
        quaternions = np.empty((force.shape[0], 4))
        attitude_gda(
            rates,
            force,
            from_euler(*level(force[0]), start_yaw),
            math.sqrt(0.75) * self.gyro_error_radps,
            1.0 / recording.imu_sheet.rate_hz,
            quaternions,
        )
        angles = to_euler(quaternions, start_yaw_rad=start_yaw)
        return Estimate(
            states=pd.DataFrame(angles, index=recording.imu.index, columns=list(ATTITUDE)),
            mount=recording.mount,
        )
