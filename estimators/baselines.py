"""Baselines that every table lists: what is known without any inertial sensor.

A method that loses to `DesignAngles` is better replaced by the track's drawing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from estimators.compensation import design_frame
from simrail.columns import ATTITUDE
from simrail.estimate import Estimate
from simrail.recording import Recording


@dataclass(frozen=True)
class DesignAngles:
    """The attitude of the design track at the odometry's position; the IMU is not used."""

    causal = True

    def estimate(self, recording: Recording) -> Estimate:
        """Look up roll, pitch and yaw of the design track."""
        frame = design_frame(recording)
        angles = np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad])
        return Estimate(
            states=pd.DataFrame(angles, index=recording.imu.index, columns=list(ATTITUDE)),
            mount=recording.mount,
        )
