"""Attitude by extended Kalman filter: Euler angles with track compensation (Briales et al. 2021).

Three states: roll, pitch, yaw. The gyro predicts, gravity corrects (EQUATIONS 2.2). The noise that it
assumes is chosen in `simrail.estimators.attitude.noise`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from filterpy.kalman import ExtendedKalmanFilter
from simrail.estimators.attitude.compensation import design_frame, gravity_force, start_frame
from simrail.estimators.attitude.kernel import attitude_ekf
from simrail.estimators.attitude.noise import (
    SWING_PER_SPEED,
    Noise,
    check_tuning,
    paper_noise,
    recommended_noise,
)
from simrail.estimators.attitude.rest_bias import RestBias, rest_bias, step_rates

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, INNOVATION
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.track.design import TrackFrame


class _Arrays(NamedTuple):
    """What both backends take; shapes as in `simrail.estimators.attitude.kernel.attitude_ekf`."""

    rate: FloatArray
    force: FloatArray
    process: FloatArray
    noise: FloatArray
    start: FloatArray
    start_variance: FloatArray
    step_s: float
    gravity: float


@dataclass(frozen=True)
class AttitudeEkf:
    """Extended Kalman filter of Briales et al. 2021, Section 5.1.

    Attributes
    ----------
    compensated : bool
        Take the design track's acceleration off the accelerometer first.
    tuning : str
        ``"recommended"``, ``"paper_initial"`` or ``"paper_final"`` (`simrail.estimators.attitude.noise`).
    process_noise : str
        How a paper's or a given process noise is read: ``"intensity"`` (Q = value Ts) or
        ``"per_step"`` (Q = value).
    rest_bias : bool
        Subtract the gyro's mean over the rests so far.
    printed : bool
        Compensate as paper 000 prints it (`simrail.estimators.attitude.compensation.track_acceleration`).
    backend : str
        ``"compiled"``, or ``"filterpy"``: slow, short, the reference.
    gyro_intensity_rad2ps : float, optional
        Process noise in place of the tuning's, rad2/s (rad2 if read per step).
    accel_sd_mps2 : float, optional
        Standard deviation of one sample of specific force in place of the tuning's.
    doubt : float
        How far a specific force that is longer or shorter than gravity is doubted: adds doubt (|z| - g)^2 to
        its variance. Paper 000, Fig. 3 does so after Yuan et al.; how exactly is not printed, this is our
        reading. 0 for none.
    vibration : float
        For the recommended tuning: velocity sd of the body in the track frame over train speed.
    start_sd_rad, start_yaw_sd_rad : float
        Standard deviation of roll and pitch, and of yaw, about the design track's at the start.
    """

    compensated: bool = True
    tuning: str = "recommended"
    process_noise: str = "intensity"
    rest_bias: bool = True
    printed: bool = False
    backend: str = "compiled"
    gyro_intensity_rad2ps: float | None = None
    accel_sd_mps2: float | None = None
    doubt: float = 0.0
    vibration: float = SWING_PER_SPEED
    start_sd_rad: float = math.radians(1.0)
    start_yaw_sd_rad: float = math.radians(0.3)

    causal = True
    label = "EKF"
    cites = ("Briales, Urda and Escalona 2021",)

    @property
    def needs(self) -> tuple[str, ...]:
        """The odometry, for the compensation, and for what the recommended tuning knows of the vibration."""
        return ("odometry",) if self.compensated or self.tuning == "recommended" else ()

    @property
    def role(self) -> str:
        """Under test with compensation; a filter that knows nothing of trains without."""
        return "method" if self.compensated else "general_purpose"

    def __post_init__(self) -> None:
        check_tuning(self.tuning, self.process_noise)
        if self.backend not in BACKENDS:
            raise InputError(
                "no such backend", field="backend", value=self.backend, limit="one of " + ", ".join(BACKENDS)
            )
        for name in (
            "gyro_intensity_rad2ps",
            "accel_sd_mps2",
            "doubt",
            "vibration",
            "start_sd_rad",
            "start_yaw_sd_rad",
        ):
            value = getattr(self, name)
            lowest_allowed = name in ("doubt", "vibration", "start_yaw_sd_rad", "gyro_intensity_rad2ps")
            if value is not None and not (0.0 < value < math.inf or (lowest_allowed and value == 0.0)):
                raise InputError(
                    "is out of range", field=name, value=value, limit=">= 0" if lowest_allowed else "> 0"
                )

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw with covariance and innovations at every IMU sample."""
        arrays, considered = self._arrays(recording)
        n = arrays.rate.shape[0]
        states, covariance, innovations = np.empty((n, 3)), np.empty((n, 3, 3)), np.empty((n, 4))
        BACKENDS[self.backend](*arrays, states, covariance, innovations)
        for axis in range(3):
            covariance[:, axis, axis] += considered[:, axis]
        sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        index = recording.imu.index
        return Estimate(
            states=pd.DataFrame(np.hstack([states, sd]), index=index, columns=[*ATTITUDE, *ATTITUDE_SD]),
            mount=recording.mount,
            innovations=pd.DataFrame(innovations, index=index, columns=list(INNOVATION)),
            covariance=covariance,
            covariance_of=ATTITUDE,
        )

    def _arrays(self, recording: Recording) -> tuple[_Arrays, FloatArray]:
        rest = rest_bias(recording, enabled=self.rest_bias)
        frame = design_frame(recording) if self.compensated else None
        noise = self._noise(recording, rest, frame)
        first = start_frame(recording)
        sd = np.array([self.start_sd_rad, self.start_sd_rad, self.start_yaw_sd_rad])
        force = gravity_force(recording, frame, compensated=self.compensated, printed=self.printed)
        excess = np.linalg.norm(force, axis=1) - recording.gravity_mps2
        arrays = _Arrays(
            rate=step_rates(recording, rest.bias),
            force=force,
            process=noise.process,
            noise=noise.force + self.doubt * excess[:, None] ** 2,
            start=np.array([first.roll_rad[0], first.pitch_rad[0], first.yaw_rad[0]]),
            start_variance=sd**2,
            step_s=1.0 / recording.imu_sheet.rate_hz,
            gravity=recording.gravity_mps2,
        )
        return arrays, noise.considered

    def _noise(self, recording: Recording, rest: RestBias, frame: TrackFrame | None) -> Noise:
        if self.tuning == "recommended":
            noise = recommended_noise(recording, rest, frame=frame, vibration=self.vibration)
        else:
            noise = paper_noise(recording, self.tuning, reading=self.process_noise)
        if self.gyro_intensity_rad2ps is not None:
            step = 1.0 / recording.imu_sheet.rate_hz if self.process_noise == "intensity" else 1.0
            noise = noise._replace(process=np.full_like(noise.process, self.gyro_intensity_rad2ps * step))
        if self.accel_sd_mps2 is not None:
            noise = noise._replace(force=np.full_like(noise.force, self.accel_sd_mps2**2))
        return noise


class _EulerEkf(ExtendedKalmanFilter):
    """filterpy's EKF with the attitude's own state prediction."""

    def predict_x(self, u: FloatArray) -> None:
        """Add the step u of the Euler angles."""
        self.x: FloatArray = self.x + u


def _filterpy_ekf(
    rate: FloatArray,
    force: FloatArray,
    process: FloatArray,
    noise: FloatArray,
    start: FloatArray,
    start_variance: FloatArray,
    step_s: float,
    gravity: float,
    states: FloatArray,
    covariance: FloatArray,
    innovations: FloatArray,
) -> None:
    """The same filter by filterpy: block update, Joseph form; arguments as in the kernel."""

    def predicted_force(x: FloatArray) -> FloatArray:
        roll, pitch, _ = x
        return gravity * np.array(
            [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
        )

    def force_jacobian(x: FloatArray) -> FloatArray:
        (sr, sp, _), (cr, cp, _) = np.sin(x), np.cos(x)
        return gravity * np.array([[0.0, -cp, 0.0], [cr * cp, -sr * sp, 0.0], [-sr * cp, -cr * sp, 0.0]])

    ekf = _EulerEkf(dim_x=3, dim_z=3)
    ekf.x, ekf.P = start.copy(), np.diag(start_variance)
    for k in range(rate.shape[0]):
        if k > 0:
            (sr, sp, _), (cr, cp, _) = np.sin(ekf.x), np.cos(ekf.x)
            x, y, z = rate[k]
            u, w = y * cr - z * sr, y * sr + z * cr
            jacobian = np.array(
                [[u * sp / cp, w / cp**2, 0.0], [-w, 0.0, 0.0], [u / cp, w * sp / cp**2, 0.0]]
            )
            ekf.F = np.eye(3) + step_s * jacobian
            ekf.Q = process[k] * np.eye(3)
            ekf.predict(step_s * np.array([x + w * sp / cp, u, w / cp]))
        yaw, yaw_variance = ekf.x[2], ekf.P[2, 2]
        ekf.update(force[k], force_jacobian, predicted_force, R=np.diag(noise[k]))
        # Gravity says nothing of heading: its gain is zero, so its value and variance stay (Schmidt).
        ekf.x[2], ekf.P[2, 2] = yaw, yaw_variance
        states[k], covariance[k] = ekf.x, ekf.P
        innovations[k, :3], innovations[k, 3] = ekf.y, ekf.y @ ekf.SI @ ekf.y


BACKENDS = {"compiled": attitude_ekf, "filterpy": _filterpy_ekf}
"""Loops that can run the filter, by name; all take the arguments of the kernel."""
