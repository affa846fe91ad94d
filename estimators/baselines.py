"""Baselines that every table lists: what is known without any inertial sensor.

A method that loses to `DesignAngles` is better replaced by the track's drawing.
"""

from dataclasses import dataclass, replace

import numpy as np
from simrail.estimators.attitude.compensation import design_frame
from simrail.estimators.trajectory.track_geometry import track_geometry

from simrail.core.columns import ATTITUDE, RELATIVE_POSITION
from simrail.estimation.estimate import Estimate, states_only
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class DesignAngles:
    """The attitude of the design track at the odometry's position; the IMU is not used."""

    causal = True
    needs = ("odometry",)
    uses_imu = False
    role = "baseline"
    label = "design angles only"

    def estimate(self, recording: Recording) -> Estimate:
        """Look up roll, pitch and yaw of the design track."""
        frame = design_frame(recording)
        angles = np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad])
        return states_only(recording, angles, ATTITUDE)


@dataclass(frozen=True)
class ZeroTrack:
    """Rails that lie where the design has them: what track geometry scores against without any sensor.

    Attributes
    ----------
    step_m : float
        Distance of the places of its geometry.
    """

    step_m: float = 0.25
    causal = False
    needs = ("odometry",)
    uses_imu = False
    role = "baseline"
    label = "rails as designed"

    def estimate(self, recording: Recording) -> Estimate:
        """The body follows the design track, so alignment, vertical profile and cross-level are 0."""
        angles = DesignAngles().estimate(recording).states
        place = dict(zip(RELATIVE_POSITION, recording.mount_position_m[1:], strict=True))
        estimate = Estimate(states=angles.assign(**place), mount=recording.mount)
        blind = replace(recording, rail_displacement=None, rail_sensor_sheet=None)
        return replace(estimate, geometry=track_geometry(estimate, blind, step_m=self.step_m))
