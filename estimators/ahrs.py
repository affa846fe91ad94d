"""General-purpose AHRS: what a good filter that knows nothing of trains makes of the same signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from vqf import VQF

from estimators.compensation import design_frame, gravity_force
from estimators.quaternions import to_euler
from estimators.rest_bias import rest_bias
from simrail.columns import ATTITUDE, GYRO
from simrail.estimate import Estimate
from simrail.recording import Recording


@dataclass(frozen=True)
class Vqf:
    """VQF (Laidig and Seel 2023) through the `vqf` package, with its own default parameters.

    It stands in for the commercial AHRS that paper 000 compares with. Its estimate of the gyro bias
    at rest takes long, slow, steady curves for standstill, which spoils yaw at 20 km/h.

    Attributes
    ----------
    compensated : bool
        Take the design track's acceleration off the accelerometer first; a general-purpose AHRS
        cannot, so this is off unless asked for.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far, as every method does.
    """

    compensated: bool = False
    rest_bias: bool = True

    causal = True

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw; yaw starts at the design track's."""
        gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
        gyro = gyro - rest_bias(recording, enabled=self.rest_bias).bias
        force = gravity_force(recording, compensated=self.compensated)
        quaternions = VQF(1.0 / recording.imu_sheet.rate_hz).updateBatch(np.ascontiguousarray(gyro), force)[
            "quat6D"
        ]
        start_yaw = float(design_frame(recording, count=1).yaw_rad[0])
        angles = to_euler(quaternions, start_yaw_rad=0.0)
        # Its heading starts anywhere: turned so that the first sample is the design track's.
        angles[:, 2] += start_yaw - angles[0, 2]
        return Estimate(
            states=pd.DataFrame(angles, index=recording.imu.index, columns=list(ATTITUDE)),
            mount=recording.mount,
        )
