"""Attitude by gradient descent: Madgwick's filter with track compensation (Briales et al. 2021).

The correction has a fixed speed whatever the size of the mismatch. That makes it robust against impulsive
vibration, unable to hold more than 2 beta of gyro error, and a follower of the median: where flange contact
makes the lateral acceleration lopsided, mean and median differ, and the roll goes with the median. It has
no covariance.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from simrail.estimators.attitude.compensation import gravity_force, needs_of, role_of, start_frame
from simrail.estimators.attitude.kernel import attitude_gda
from simrail.estimators.attitude.lanes import Board, board, by_lanes, gda_block, side_by_side, through
from simrail.estimators.attitude.quaternions import from_euler, level, to_euler
from simrail.estimators.attitude.rest_bias import rest_bias, step_rates

from simrail.core.columns import ATTITUDE
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate, states_only
from simrail.recording.recording import Recording

GYRO_ERROR_RADPS = {"recommended": math.radians(0.2), "paper": math.radians(0.5)}
"""By tuning. On the simulated light-metro bogie at 70 km/h the rms roll error in curves with 0.5 deg/s is
half as large again as with 0.2 deg/s, and larger on the leading than on the trailing axle by 0.05 deg."""


@dataclass(frozen=True)
class AttitudeGda:
    """Gradient descent algorithm of Briales et al. 2021, Section 5.2 (EQUATIONS 2.4).

    Roll and pitch start at the first accelerometer sample, yaw at the design track's.

    Attributes
    ----------
    compensated : bool
        Take the design track's acceleration off the accelerometer first.
    tuning : str
        ``"paper"``: a gyro error of 0.5 deg/s, as in paper 000, Section 6. ``"recommended"``: 0.2 deg/s.
        beta = sqrt(3/4) times the gyro error, and roll and pitch are corrected at up to 2 beta. After a
        rest the gyro's bias is some 0.003 deg/s, so both leave a wide margin; the lower one follows the
        vibration of a leading axle in flange contact less (`GYRO_ERROR_RADPS`).
    gyro_error_radps : float, optional
        Gyro error in place of the tuning's, rad/s.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far.
    printed : bool
        Compensate as paper 000 prints it (`simrail.estimators.attitude.compensation.track_acceleration`).
    """

    compensated: bool = True
    tuning: str = "recommended"
    gyro_error_radps: float | None = None
    rest_bias: bool = True
    printed: bool = False

    causal = True
    needs = property(needs_of)
    role = property(role_of)
    label = "GDA"
    cites = ("briales_2021", "madgwick_2010")

    def __post_init__(self) -> None:
        if self.tuning not in GYRO_ERROR_RADPS:
            known = ", ".join(GYRO_ERROR_RADPS)
            raise InputError("no such tuning", field="tuning", value=self.tuning, limit=f"one of {known}")
        if self.gyro_error_radps is not None and not 0.0 <= self.gyro_error_radps < math.inf:
            raise InputError(
                "must be a finite rate",
                field="gyro_error_radps",
                value=self.gyro_error_radps,
                limit=">= 0 rad/s",
                remedy="give it in rad/s, e.g. 0.0087 for 0.5 deg/s",
            )

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw at every IMU sample."""
        rates, force, start, start_yaw = self._arrays(recording)
        quaternions = np.empty((force.shape[0], 4))
        attitude_gda(rates, force, start, self._beta, 1.0 / recording.imu_sheet.rate_hz, quaternions)
        return states_only(recording, to_euler(quaternions, start_yaw_rad=start_yaw), ATTITUDE)

    def estimate_many(self, recordings: Sequence[Recording]) -> list[Estimate]:
        """The same of many recordings, bit by bit; those of equal length are lanes of one loop."""
        shared, alone = by_lanes(recordings)
        found = {i: self.estimate(recordings[i]) for i in alone}
        for members in shared:
            made = [self._arrays(recordings[i]) for i in members]
            rates, forces, starts, yaws = zip(*made, strict=True)
            quaternions = [np.empty((len(rates[0]), 4)) for _ in made]
            lanes, step_s = board(6, 4, 4), 1.0 / recordings[members[0]].imu_sheet.rate_hz
            lanes.state[:] = side_by_side(starts).ravel()
            through(
                partial(_block, lanes, self._beta, step_s),
                lanes,
                list(zip(rates, forces, strict=True)),
                [(own,) for own in quaternions],
            )
            for i, own, start_yaw in zip(members, quaternions, yaws, strict=True):
                found[i] = states_only(recordings[i], to_euler(own, start_yaw_rad=start_yaw), ATTITUDE)
        return [found[i] for i in range(len(recordings))]

    def _arrays(self, recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """Rates, forces and first quaternion, as the kernel takes them, and the first yaw, rad."""
        force = gravity_force(recording, compensated=self.compensated, printed=self.printed)
        rates = step_rates(recording, rest_bias(recording, enabled=self.rest_bias).bias)
        start_yaw = float(start_frame(recording).yaw_rad[0])
        return rates, force, from_euler(*level(force[0]), start_yaw), start_yaw

    @property
    def _beta(self) -> float:
        given = self.gyro_error_radps
        return math.sqrt(0.75) * (GYRO_ERROR_RADPS[self.tuning] if given is None else given)


def _block(lanes: Board, beta: float, step_s: float, count: int, is_first: bool) -> None:
    gda_block(lanes, count, is_first, beta, step_s)
