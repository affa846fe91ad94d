"""Attitude, acceleration and speed of an IMU alone: the eleven-state EKF of Veillard et al. 2016 (paper 003).

Gyro and accelerometer are measurements; so are roll and pitch by a complementary filter of the same signals,
and the speed that the spectrum of the vertical accelerometer tells. It needs nothing but an IMU, and the
calibration of that speed from other rides.

Not given by the paper, and chosen here: Q, R, the time constant, the step, how the direction of running is
known. Weak by design (EQUATIONS 4), and left as it is: the complementary filter uses the same signals again;
the lateral acceleration is a free random walk although it is yaw rate times speed; Z of the gyro has no bias.
The errors of the inclination and of a frame's speed last, the one for a time constant, the other for as long
as a section is rough: R holds white noise of the same density, else the filter would believe them by far.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from simrail.estimators.attitude.compensation import start_frame
from simrail.estimators.attitude.complementary import TIME_CONSTANT_S
from simrail.estimators.attitude.veillard_kernel import (
    AX,
    BIAS_X,
    PITCH,
    ROLL,
    STATES,
    YAW_RATE,
    Found,
    Model,
    V,
    eleven_states,
    room,
)
from simrail.estimators.odometry.calibration_file import SpectralCalibration
from simrail.estimators.odometry.direction import BLOCK_S
from simrail.estimators.odometry.spectral import (
    FRAME,
    HOP,
    ROUGH_S,
    START_SD_M,
    FrameSpeeds,
    SpectralOdometry,
)
from simrail.estimators.odometry.standstill import quiet_of

from simrail.core.columns import ACCEL, ACCELERATION, GYRO, INNOVATION, ODOMETRY, ODOMETRY_SD, RATE_INNOVATION
from simrail.core.errors import InputError, one_of
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording

DATES = ("centre", "end")
"""Of a frame's speed: its centre, or its end as if it were of that time."""


class Noise(NamedTuple):
    """What the filter takes for noise; the paper gives none of it.

    Attributes
    ----------
    rate_walk_rad2ps3 : float
        Intensity of the random walk of the Euler rates: 0.02 rad/s within a second of a transition.
    angle_rad2ps : float
        Of roll and pitch beside their rates.
    jerk_m2ps5 : float
        Of the accelerations: a jerk of 0.6 m/s3 for a second.
    bias_rad2ps3 : float
        Of the gyro's biases: 0.002 degrees/s in five minutes.
    vibration_radps, vibration_mps2 : float
        Standard deviation that shaking adds to a sample.
    inclination_rad : float
        Standard deviation of roll and pitch by the complementary filter, which lasts its time constant.
    """

    rate_walk_rad2ps3: float = 4e-4
    angle_rad2ps: float = 1e-8
    jerk_m2ps5: float = 0.36
    bias_rad2ps3: float = 4e-12
    vibration_radps: float = 0.01
    vibration_mps2: float = 0.3
    inclination_rad: float = math.radians(0.5)


NOISE = Noise()


@dataclass(frozen=True)
class VeillardEkf:
    """Eleven-state extended Kalman filter of Veillard et al. 2016, section II.C: an IMU and nothing else.

    Roll, pitch, the acceleration in body axes, and way, speed and acceleration along the track, which makes
    it an odometry as well. Way and yaw are no states: they are the sums of speed and of yaw rate, from where
    the ride begins on the map.

    Attributes
    ----------
    slope, intercept_mps, calibration, direction, frame, hop, speed_sd_mps
        Of the spectral speed, as in `simrail.estimators.odometry.spectral.SpectralOdometry`.
    calibration_relative_sd, calibration_file
        Likewise.
    time_constant_s : float
        Of the complementary filter.
    compensated : bool
        Take what the filter itself knows of motion and biases off the complementary filter's signals. Not the
        paper's, whose inclination leans in every curve.
    dated : str
        One of `DATES`: the paper says nothing of the delay.
    start_bias : bool
        Subtract the gyro's mean over the first rest.
    """

    slope: float | None = None
    intercept_mps: float | None = None
    calibration: str = "standstill"
    direction: str = "first_acceleration"
    frame: int = FRAME
    hop: int = HOP
    speed_sd_mps: float = 2.5
    calibration_relative_sd: float = 0.17
    time_constant_s: float = TIME_CONSTANT_S
    compensated: bool = False
    dated: str = "centre"
    start_bias: bool = True
    calibration_file: SpectralCalibration | None = None

    label = "EKF of 11 states"
    cites = ("veillard_2016",)

    def __post_init__(self) -> None:
        one_of(self.dated, DATES, "no such date", field="dated")
        if not 0.0 < self.time_constant_s < math.inf:
            value = self.time_constant_s
            raise InputError("is out of range", field="time_constant_s", value=value, limit="> 0 s")
        _ = self.spectral  # which judges the rest

    @property
    def spectral(self) -> SpectralOdometry:
        """What it has its speed from."""
        return SpectralOdometry(
            slope=self.slope,
            intercept_mps=self.intercept_mps,
            calibration=self.calibration,
            direction=self.direction,
            frame=self.frame,
            hop=self.hop,
            speed_sd_mps=self.speed_sd_mps,
            calibration_relative_sd=self.calibration_relative_sd,
            calibration_file=self.calibration_file,
        )

    @property
    def causal(self) -> bool:
        """As its spectral speed."""
        return self.spectral.causal

    @property
    def needs(self) -> tuple[str, ...]:
        """As its spectral speed."""
        return self.spectral.needs

    @property
    def role(self) -> str:
        """As its spectral speed."""
        return self.spectral.role

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch, yaw, position, speed and acceleration, with sds and innovations.

        Raises
        ------
        InputError
            As `SpectralOdometry.estimate`.
        """
        told = self.spectral.frame_speeds(recording)
        model = self.model(recording, told)
        found = room(len(recording.imu))
        eleven_states(model, found)
        columns = [*RATE_INNOVATION, *INNOVATION]
        innovations = pd.DataFrame(found.innovations, index=recording.imu.index, columns=columns)
        return Estimate(self._states(recording, told, found), recording.mount, innovations)

    def _states(self, recording: Recording, told: FrameSpeeds, found: Found) -> pd.DataFrame:
        """States in columns, and the way as the sum of the speed.

        What rough sections do to the speed lasts for `ROUGH_S`, so that the variance of the way grows by
        twice that time its variance; one constant factor of speed and way is the calibration's.
        """
        step = 1.0 / recording.imu_sheet.rate_hz
        speed, n = found.states[:, V], len(found.states)
        way = np.cumsum(step * speed)
        rough = 2.0 * ROUGH_S * told.rough_sd_mps**2 * step * np.arange(n)
        factor = self.calibration_relative_sd
        sd = {name: np.sqrt(found.variances[:, i]) for name, i in (("roll", ROLL), ("pitch", PITCH))}
        values = {
            "roll_rad": found.states[:, ROLL],
            "pitch_rad": found.states[:, PITCH],
            "yaw_rad": float(start_frame(recording).yaw_rad[0]) + np.cumsum(step * found.states[:, YAW_RATE]),
            "roll_sd_rad": sd["roll"],
            "pitch_sd_rad": sd["pitch"],
            ODOMETRY[0]: recording.start_position_m + way,
            ODOMETRY[1]: speed,
            ODOMETRY[2]: found.states[:, AX],
            ODOMETRY_SD[0]: np.sqrt(START_SD_M**2 + rough + (factor * way) ** 2),
            ODOMETRY_SD[1]: np.sqrt(found.variances[:, V] + (factor * speed) ** 2),
            ODOMETRY_SD[2]: np.sqrt(found.variances[:, AX]),
            **{name: found.states[:, AX + axis] for axis, name in enumerate(ACCELERATION)},
        }
        return pd.DataFrame(values, index=recording.imu.index)

    def model(self, recording: Recording, told: FrameSpeeds) -> Model:
        """What the kernel takes."""
        imu, sheet = recording.imu, recording.imu_sheet
        step = 1.0 / sheet.rate_hz
        gyro = imu[list(GYRO)].to_numpy(dtype=np.float64)
        if self.start_bias:
            gyro = gyro - first_rest_mean(recording)
        speed = np.full(len(imu), np.nan)
        speed[told.ends] = told.speed
        q, r = np.zeros(STATES), np.empty(9)
        q[:3], q[3:5], q[5:8] = NOISE.rate_walk_rad2ps3, NOISE.angle_rad2ps, NOISE.jerk_m2ps5
        q[BIAS_X:] = NOISE.bias_rad2ps3
        r[:3] = sheet.gyro_noise_radpsqrts**2 * sheet.rate_hz + NOISE.vibration_radps**2
        r[3:6] = sheet.accel_noise_mpsqrts**2 * sheet.rate_hz + NOISE.vibration_mps2**2
        # An error of the correlation time T counts as one new one in 2 T: white noise of the same density.
        r[6:8] = NOISE.inclination_rad**2 * max(1.0, 2.0 * self.time_constant_s / step)
        r[8] = told.rough_sd_mps**2 * max(1.0, 2.0 * ROUGH_S / (self.hop * step))
        bias = sheet.gyro_turn_on_bias_radps**2 / 3.0
        variance = np.array([1e-4] * 3 + [0.1**2] * 2 + [0.1**2] * 3 + [0.1**2] + [bias] * 2)
        return Model(
            signals=np.ascontiguousarray(np.hstack([gyro, imu[list(ACCEL)].to_numpy(dtype=np.float64)])),
            speed=speed,
            process=q * step,
            noise=r,
            start=self._start(recording),
            start_variance=variance,
            late=self.frame // 2 if self.dated == "centre" else 0,
            compensated=self.compensated,
            time_constant_s=self.time_constant_s,
            step_s=step,
            gravity=recording.gravity_mps2,
        )

    def _start(self, recording: Recording) -> FloatArray:
        """A train at rest, level as its first sample has it."""
        x, y, z = recording.imu[list(ACCEL)].iloc[0].to_numpy(dtype=np.float64)
        start = np.zeros(STATES)
        start[ROLL], start[PITCH] = math.atan2(y, z), math.atan2(-x, math.hypot(y, z))
        return start


def first_rest_mean(recording: Recording) -> FloatArray:
    """Mean of the gyro over the first rest so far (n, 3), rad/s: the rest is found in the IMU alone.

    A sample enters when the quiet block after it has ended: what the first jerk of a departure turns stays
    out but for the window that tells quiet.
    """
    block = max(1, round(BLOCK_S * recording.imu_sheet.rate_hz))
    quiet, n = quiet_of(recording, block), len(recording.imu)
    still = int(np.argmin(quiet)) if not quiet.all() else len(quiet)
    gyro = recording.imu[list(GYRO)].to_numpy(dtype=np.float64)
    sums = np.vstack([np.zeros(3), np.cumsum(gyro, axis=0)])
    used = np.minimum((np.arange(n) + 1) // block, still) * block
    return np.asarray(sums[used] / np.maximum(used, 1)[:, None])
