"""Attitude by a complementary filter (Veillard et al. 2016, paper 003, section II.B).

Slow inclination from the accelerometer, fast from the gyro. It takes whatever the accelerometer feels below
1 / T for gravity: a curve of 140 mg is 8 degrees of roll to it, for as long as the curve lasts against T.

Mended of the paper (EQUATIONS 4): Eq. 4 prints roll = atan(-f_y / 9.81), which contradicts the same paper's
Eq. 7, f_y = a_y + g sin(roll) cos(pitch). With the printed sign, gyro and accelerometer pull apart: a body
that stands at a roll of 4 degrees is told to be at -4, an error of 8. And atan in place of asin tells a
standing roll of 8 degrees 0.08 degrees too small. What a ride makes of the sign depends on its curves: where
they are run with cant deficiency, the force leans against the true roll, and the wrong sign happens to lean
with it (metro_ride's line, T = 30 s: 0.24 to 0.33 degrees rms as printed, 0.31 to 0.36 mended, 0.03 to 0.09
compensated). Standstill shows it: a wrong sign is wrong by twice the cant.
"""

import math
from dataclasses import dataclass

import numpy as np
from simrail.estimators.attitude.compensation import needs_of, start_frame
from simrail.estimators.attitude.rest_bias import rest_bias, step_rates
from simrail.estimators.attitude.veillard_kernel import complementary

from simrail.core.columns import ACCEL, ATTITUDE
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate, states_only
from simrail.recording.recording import Recording, odometry_of

TIME_CONSTANT_S = 30.0
"""T of the complementary filter, which the paper does not give: longer than a transition curve, shorter than
what a gyro of 0.005 deg/sqrt(s) needs to wander by 0.1 degrees."""


@dataclass(frozen=True)
class ComplementaryFilter:
    """Complementary filter of roll and pitch (paper 003, Eqs. 3 and 4); yaw is the gyro's.

    Attributes
    ----------
    time_constant_s : float
        T: the accelerometer counts below 1 / (2 pi T).
    compensated : bool
        Take the odometry's motion off the accelerometer first, A of X and w x V of Y and Z: not the paper's.
    printed : bool
        Give the roll of the accelerometer the sign that Eq. 4 prints.
    rest_bias : bool
        Subtract the gyro's mean over the rests so far, as every method does.
    """

    time_constant_s: float = TIME_CONSTANT_S
    compensated: bool = False
    printed: bool = False
    rest_bias: bool = True

    causal = True
    needs = property(needs_of)
    label = "complementary filter"
    cites = ("veillard_2016",)

    def __post_init__(self) -> None:
        if not 0.0 < self.time_constant_s < math.inf:
            value = self.time_constant_s
            raise InputError("is out of range", field="time_constant_s", value=value, limit="> 0 s")

    @property
    def role(self) -> str:
        """An ablation with the printed sign."""
        return "ablation" if self.printed else "method"

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw at every IMU sample; yaw starts at the design track's."""
        rates = step_rates(recording, rest_bias(recording, enabled=self.rest_bias).bias)
        angles = np.empty((len(rates), 3))
        complementary(
            rates,
            self._level(recording, rates),
            float(start_frame(recording).yaw_rad[0]),
            self.time_constant_s,
            1.0 / recording.imu_sheet.rate_hz,
            angles,
        )
        return states_only(recording, angles, ATTITUDE)

    def _level(self, recording: Recording, rates: FloatArray) -> FloatArray:
        """Roll and pitch (n, 2) by the accelerometer (Eq. 4)."""
        x, y, z = recording.imu[list(ACCEL)].to_numpy(dtype=np.float64).T
        gravity = recording.gravity_mps2
        if self.compensated:
            motion = odometry_of(recording)
            speed = motion["speed_mps"].to_numpy(dtype=np.float64)
            x = x - motion["acceleration_mps2"].to_numpy(dtype=np.float64)
            roll = np.arctan2(y - rates[:, 2] * speed, z + rates[:, 1] * speed)
        else:
            roll = np.arctan(y / gravity)
        if self.printed:
            roll = -roll
        return np.column_stack([roll, np.arcsin(np.clip(-x / gravity, -1.0, 1.0))])
