"""Attitude by extended Kalman filter: Euler angles with track compensation (Briales et al. 2021).

Three states: roll, pitch, yaw. The gyro predicts, gravity corrects (EQUATIONS 2.2). The noise that it
assumes is chosen in `simrail.estimators.attitude.noise`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from simrail.estimators.attitude.compensation import gravity_and_curves, role_of, start_frame
from simrail.estimators.attitude.kernel import attitude_ekf, with_deviations
from simrail.estimators.attitude.lanes import (
    Board,
    begin_ekf,
    board,
    by_lanes,
    ekf_block,
    side_by_side,
    through,
)
from simrail.estimators.attitude.noise import (
    READINGS,
    SWING_PER_SPEED,
    TUNINGS,
    Noise,
    paper_noise,
    recommended_noise,
)
from simrail.estimators.attitude.rest_bias import RestBias, rest_bias, step_rates

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, INNOVATION
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording

LIMITS = {
    "gyro_intensity_rad2ps": ">= 0",
    "accel_sd_mps2": "> 0",
    "doubt": ">= 0",
    "vibration": ">= 0",
    "start_sd_rad": "> 0",
    "start_yaw_sd_rad": ">= 0",
}


class _Arrays(NamedTuple):
    """What the kernel takes; shapes as in `simrail.estimators.attitude.kernel.attitude_ekf`."""

    rate: FloatArray
    force: FloatArray
    process: FloatArray
    noise: FloatArray
    start: FloatArray
    start_variance: FloatArray
    step_s: float
    gravity: float


class _Room(NamedTuple):
    """What the kernel finds: the covariance in rows of nine, else shapes as there."""

    angles: FloatArray
    innovations: FloatArray
    covariance: FloatArray

    @classmethod
    def of(cls, n: int) -> _Room:
        """Room for n samples."""
        return cls(*(np.empty((n, columns)) for columns in (3, 4, 9)))


def _block(lanes: Board, arrays: _Arrays, count: int, is_first: bool) -> None:
    ekf_block(lanes, count, is_first, arrays.step_s, arrays.gravity)


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
    gyro_intensity_rad2ps : float, optional
        Process noise in place of the tuning's, rad2/s (rad2 if read per step).
    accel_sd_mps2 : float, optional
        Standard deviation of one sample of specific force in place of the tuning's.
    doubt : float
        How far a specific force that is longer or shorter than gravity is doubted: adds
        doubt (norm(z) - g)^2 to its variance. Paper 000, Fig. 3 does so after Yuan et al.; how exactly is not
        printed, this is our reading. 0 for none.
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
    gyro_intensity_rad2ps: float | None = None
    accel_sd_mps2: float | None = None
    doubt: float = 0.0
    vibration: float = SWING_PER_SPEED
    start_sd_rad: float = math.radians(1.0)
    start_yaw_sd_rad: float = math.radians(0.3)

    causal = True
    role = property(role_of)
    label = "EKF"
    cites = ("briales_2021",)

    @property
    def needs(self) -> tuple[str, ...]:
        """The odometry, for the compensation, and for what the recommended tuning knows of the vibration."""
        return ("odometry",) if self.compensated or self.tuning == "recommended" else ()

    def __post_init__(self) -> None:
        for name, allowed in (("tuning", TUNINGS), ("process_noise", READINGS)):
            value = getattr(self, name)
            if value not in allowed:
                problem = "no such " + name.replace("_", " ")
                raise InputError(problem, field=name, value=value, limit=f"one of {', '.join(allowed)}")
        for name, limit in LIMITS.items():
            value = getattr(self, name)
            if value is not None and not (0.0 < value < math.inf or (value == 0.0 and limit == ">= 0")):
                raise InputError("is out of range", field=name, value=value, limit=limit)

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate roll, pitch and yaw with covariance and innovations at every IMU sample."""
        arrays, considered = self._arrays(recording)
        room = _Room.of(len(arrays.rate))
        square = room.covariance.reshape(-1, 3, 3)
        attitude_ekf(*arrays, room.angles, square, room.innovations)
        return self._estimate(recording, room, considered)

    def estimate_many(self, recordings: Sequence[Recording]) -> list[Estimate]:
        """The same of many recordings, bit by bit; those of equal length are lanes of one loop."""
        shared, alone = by_lanes(recordings)
        found = {i: self.estimate(recordings[i]) for i in alone}
        for members in shared:
            made = [self._arrays(recordings[i]) for i in members]
            each = [arrays for arrays, _ in made]
            rooms = [_Room.of(len(arrays.rate)) for arrays in each]
            lanes = board(10, 16, 13)
            begin_ekf(
                side_by_side([np.append(arrays.start, arrays.start_variance) for arrays in each]), lanes.state
            )
            through(
                partial(_block, lanes, each[0]),
                lanes,
                [(one.rate, one.force, one.noise, one.process[:, None]) for one in each],
                rooms,
            )
            for i, room, (_, considered) in zip(members, rooms, made, strict=True):
                found[i] = self._estimate(recordings[i], room, considered)
        return [found[i] for i in range(len(recordings))]

    def _estimate(self, recording: Recording, room: _Room, considered: FloatArray) -> Estimate:
        states = np.empty((6, len(room.angles)))
        with_deviations(room.angles, room.covariance, considered, states)
        index = recording.imu.index
        return Estimate(
            states=pd.DataFrame(states.T, index=index, columns=[*ATTITUDE, *ATTITUDE_SD], copy=False),
            mount=recording.mount,
            innovations=pd.DataFrame(room.innovations, index=index, columns=list(INNOVATION), copy=False),
            covariance=room.covariance.reshape(-1, 3, 3),
            covariance_of=ATTITUDE,
        )

    def _arrays(self, recording: Recording) -> tuple[_Arrays, FloatArray]:
        rest = rest_bias(recording, enabled=self.rest_bias)
        left = gravity_and_curves(recording, compensated=self.compensated, printed=self.printed)
        force = left.force
        noise = self._noise(recording, rest, left.curves)
        first = start_frame(recording)
        sd = np.array([self.start_sd_rad, self.start_sd_rad, self.start_yaw_sd_rad])
        doubted = noise.force
        if self.doubt:
            excess = np.linalg.norm(force, axis=1) - recording.gravity_mps2
            doubted = doubted + self.doubt * excess[:, None] ** 2
        arrays = _Arrays(
            rate=step_rates(recording, rest.bias),
            force=force,
            process=noise.process,
            noise=doubted,
            start=np.array([first.roll_rad[0], first.pitch_rad[0], first.yaw_rad[0]]),
            start_variance=sd**2,
            step_s=1.0 / recording.imu_sheet.rate_hz,
            gravity=recording.gravity_mps2,
        )
        return arrays, noise.considered

    def _noise(self, recording: Recording, rest: RestBias, curves: FloatArray) -> Noise:
        if self.tuning == "recommended":
            noise = recommended_noise(recording, rest, curves=curves, vibration=self.vibration)
        else:
            noise = paper_noise(recording, self.tuning, reading=self.process_noise)
        if self.gyro_intensity_rad2ps is not None:
            step = 1.0 / recording.imu_sheet.rate_hz if self.process_noise == "intensity" else 1.0
            noise = noise._replace(process=np.full_like(noise.process, self.gyro_intensity_rad2ps * step))
        if self.accel_sd_mps2 is not None:
            noise = noise._replace(force=np.full_like(noise.force, self.accel_sd_mps2**2))
        return noise
