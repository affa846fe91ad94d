"""Noise that the trajectory smoother assumes: the 13 hyper-parameters of paper 001.

Gonzalez-Carbajal et al. 2023, Eq. 16. The paper searches them by maximum likelihood or against a known output
(section 4). Not here: the search (`simrail.estimators.tuning.tune`) and its file
(`simrail.estimators.tuning.file`).
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray


@dataclass(frozen=True)
class Hyperparameters:
    """Intensities of the process noise and variances of the measurements (paper 001, Eq. 16, in its order).

    Attributes
    ----------
    roll_rad2ps3, pitch_rad2ps3, yaw_rad2ps3 : float
        Intensity (two-sided spectral density) of the angular accelerations.
    lateral_m2ps5, vertical_m2ps5 : float
        Intensity of the jerk of y and z.
    gyro_x_rad2ps2, gyro_y_rad2ps2, gyro_z_rad2ps2 : float
        Variance of a sample of each gyro.
    accel_x_m2ps4, accel_y_m2ps4, accel_z_m2ps4 : float
        Variance of a sample of each accelerometer.
    lateral_position_m2, vertical_position_m2 : float
        Variance of the virtual measurements of y and z. They are no measurements, and the likelihood does not
        identify them: they are design constants. Against an accelerometer of variance u_accel they take over
        for motion slower than (u_accel/u_position)^(1/4) rad/s: by default 0.96 rad/s, wavelengths above
        128 m at 70 km/h and above 37 m at 20 km/h.

    The defaults were set by hand, between what the likelihood and what the true trajectory prefer on rides of
    the light-metro bogie's axle and frame at 20 and 70 km/h over rails of ERRI B176 low, as the 3DM-GX4-25
    records them. X of the accelerometer is believed least, since odometry does not see how the bogie shakes
    along the track.
    """

    roll_rad2ps3: float = 0.01
    pitch_rad2ps3: float = 0.01
    yaw_rad2ps3: float = 0.01
    lateral_m2ps5: float = 10.0
    vertical_m2ps5: float = 10.0
    gyro_x_rad2ps2: float = 3e-6
    gyro_y_rad2ps2: float = 3e-6
    gyro_z_rad2ps2: float = 3e-6
    accel_x_m2ps4: float = 0.025
    accel_y_m2ps4: float = 2.5e-3
    accel_z_m2ps4: float = 2.5e-3
    lateral_position_m2: float = 3e-3
    vertical_position_m2: float = 3e-3

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
                raise InputError("is no positive number", field=field.name, value=value, limit="> 0")

    def vector(self) -> FloatArray:
        """The 13 values in the paper's order."""
        return np.array(astuple(self), dtype=np.float64)
