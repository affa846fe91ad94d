"""Speed and way from an IMU alone: dead reckoning that every stop of the train puts right.

An accelerometer that is integrated drifts: by gravity along a slope that the gyros have not seen, and by its
bias. But trains stop, every other minute on a metro line, and then their speed is known exactly. A Kalman
filter that is told so learns pitch, biases and speed from each stop, and a smoother draws the speed between
two stops back to zero at both ends. Neither a map nor a wheel is needed, and which way the train runs is no
question.

Between two stops the error of the speed grows by the gyro's noise N as g N sqrt(t^3/3): .4 m/s after 90 s
with .005 deg/s/sqrt(Hz). A ride that never stops again is no fault, but its standard deviations grow without
end.

Zero-velocity updates are those of pedestrian navigation: I. Skog, P. Handel, J.-O. Nilsson and J.
Rantakokko, IEEE Trans. Biomed. Eng. 57(11) (2010) 2657-2666. The model along a track, and the detector,
which lives on the turning of the rails under a train that is not quite at rest, are ours.

Not here: the loop (`simrail.estimators.odometry.zero_velocity_kernel`), the detector
(`simrail.estimators.odometry.standstill`), and odometry with a map
(`simrail.estimators.odometry.curve_matched`).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.linalg import block_diag
from simrail.estimators.kalman import History, fixed_interval, room_for_history
from simrail.estimators.odometry.bogie_delay_kernel import Echo, Heard, room_to_hear
from simrail.estimators.odometry.calm import ACCELERATION_SD_MPS2, calm, calm_so_far, power, unsteady
from simrail.estimators.odometry.pointing import chainage_sd, chord_of, lag_of
from simrail.estimators.odometry.standstill import FORCE_S, REST_FORCE_MPS2, require_rest_first, signs_of_rest
from simrail.estimators.odometry.vertical import vertical_force
from simrail.estimators.odometry.zero_velocity_kernel import (
    ASKEW,
    DRIFT_X,
    DRIFT_Z,
    ECHO_UPDATES,
    LATERAL,
    PITCH,
    PUSH,
    REST,
    REST_X,
    ROLL,
    STATES,
    SWAY,
    UPDATES,
    Found,
    Model,
    S,
    V,
    room,
    zero_velocity,
)

from simrail.core.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD, STANDSTILL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording

RATE_HZ = 10.0
"""Rate of the filter. A train's jerk is limited, and what shakes faster averages out in between."""

BIAS_S = 300.0
"""Time within which a bias wanders by its instability, where no sheet says it."""

LEANS_RAD = 0.1
"""Roll and pitch of a train that stands, and of an IMU in it: standard deviation."""

ASKEW_RAD = 5e-4
"""Yaw of a body in its track in a curve, at the middle of its chord: standard deviation."""

REST_TURNING_RADPSQRTS = 5e-5
"""Density of the angular rate that passengers give the body that they are in, at rest, until its gyros have
shown theirs."""

REST_LEANING_RADPSQRTS = 3e-5
"""By this random walk it leans as they change their places: one in six seconds, of 75 kg, 6 m along a body of
30 t on springs of .9 MN/m, is 7e-5 rad. What carries that body does not lean with it. Where they turn it
less they lean it less by the same share."""

REST_LATERAL_MPS2SQRTS = REST_FORCE_MPS2 * math.sqrt(FORCE_S)
"""Density of the lateral force at rest: as of that along the track."""

UNHEARD_M = 0.006
"""So far a train that leaves with the jerk of a gentle start, .2 m/s3, runs before it is heard: within
.55 s, by when its mean acceleration over `simrail.estimators.odometry.standstill.FORCE_S` is three standard
deviations of what passengers do."""


class Trace(NamedTuple):
    """The filter's, or the smoother's, own steps.

    Attributes
    ----------
    time_s : ndarray (n,)
        End of each step.
    model : Model
        What went in.
    found : Found
        What came out, smoothed if that is wanted.
    past : History
        What the filter left behind for the smoother; of no steps if that is not wanted.
    heard : Heard or None
        What came of the searches for the delay of a second IMU.
    last : ndarray (m, m) or None
        Covariance of all states at the end of the ride.
    """

    time_s: FloatArray
    model: Model
    found: Found
    past: History
    heard: Heard | None = None
    last: FloatArray | None = None


class SecondImu(NamedTuple):
    """What a second IMU adds to the filter.

    Attributes
    ----------
    echo : Echo
        Its signal and the first one's.
    sd, process : ndarray (5,)
        Of its states, which begin at 0: standard deviation, and variance that a second adds.
    """

    echo: Echo
    sd: FloatArray
    process: FloatArray


@dataclass(frozen=True)
class ZeroVelocityOdometry:
    """Odometry from an IMU alone, by zero-velocity updates.

    Attributes
    ----------
    smoothed : bool
        Smooth over the whole ride: the error between two stops is some tenth of the filter's.
    push_density_mps2sqrts : float
        Density of what the force along the track has beside motion, slope and the sensor's own noise: over
        the sections of a simulated ride .8e-3 on a floor and .9e-3 on a frame.
    turn_density_radpsqrts : float
        Density of what a gyro has beside turning and its own noise: .6e-6 and 1e-6 likewise, of what it
        turns within a step.
    lateral_density_mps2sqrts : float
        Density of the sway, in the lateral row.
    rest_speed_mps : float
        Standard deviation of the speed of a body at rest, which passengers move.
    surely : float
        Probability from which on the train is held to stand.
    start_sd_m : float
        Of the place where the ride begins.
    """

    smoothed: bool = False
    push_density_mps2sqrts: float = 1e-3
    turn_density_radpsqrts: float = 1e-6
    lateral_density_mps2sqrts: float = 0.3
    rest_speed_mps: float = 0.02
    surely: float = 0.99
    start_sd_m: float = 0.05

    cites = ("skog_2010",)

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return "zero-velocity odometry, smoothed" if self.smoothed else "zero-velocity odometry"

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name not in ("smoothed", "surely") and not 0.0 < value < math.inf:
                raise InputError("is out of range", field=name, value=value, limit="> 0")
        if not 0.5 <= self.surely < 1.0:
            raise InputError(
                "is no probability that tells", field="surely", value=self.surely, limit=">= .5 and < 1"
            )

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every IMU sample.

        Raises
        ------
        InputError
            If there is no vertical signal, or the ride does not begin at rest.
        """
        trace = self.trace(recording)
        return Estimate(states=self.at_imu_times(trace, recording), mount=recording.mount)

    def trace(
        self, recording: Recording, *, remembering: bool = False, second: SecondImu | None = None
    ) -> Trace:
        """Run the filter, and the smoother if wanted; all states at its own steps.

        What the filter leaves behind is kept for the smoother, and where it is asked for (``remembering``).
        A second IMU adds its states and its row.

        Raises
        ------
        InputError
            If there is no vertical signal, or the ride does not begin at rest.
        """
        vertical_force(recording, tells="rest from motion")
        require_rest_first(recording)
        model = self.model(recording)
        steps = len(model.signals)
        x, p = self.start(recording, model)
        updates, heard = UPDATES, None
        if second is not None:
            x, p = np.append(x, np.zeros(len(second.sd))), block_diag(p, np.diag(second.sd**2))
            model = model._replace(
                process=np.append(model.process, second.process * model.step_s),
                rest_process=np.append(model.rest_process, second.process * model.step_s),
            )
            updates, heard = ECHO_UPDATES, room_to_hear(steps)
        found = room(steps, len(x) if self.smoothed else PITCH + 1, len(x))
        past = room_for_history(steps if self.smoothed or remembering else 0, len(x), updates)
        if second is None:
            zero_velocity(model, x, p, found, past)
        else:
            zero_velocity(model, x, p, found, past, second.echo, heard)
        if self.smoothed:
            fixed_interval(past, found.states, found.covariances)
        return Trace(ends_of_steps(recording), model, found, past, heard, p)

    def model(self, recording: Recording) -> Model:
        """Signals at the filter's rate, and the noise: the method's own, with what the data sheet adds."""
        sheet, block = recording.imu_sheet, _block(recording)
        step = block / sheet.rate_hz
        signals = recording.imu[[*GYRO, *ACCEL[:2]]].to_numpy(dtype=np.float64)
        steps = len(signals) // block
        signals = np.ascontiguousarray(signals[: steps * block].reshape(steps, block, 5).mean(axis=1))
        rate_variance, force_variance = white(sheet)
        process = np.zeros(STATES)
        process[V] = force_variance + self.push_density_mps2sqrts**2
        process[[ROLL, PITCH]] = rate_variance + self.turn_density_radpsqrts**2
        drift, push = wandering(sheet)
        process[DRIFT_X : DRIFT_Z + 1], process[[PUSH, SWAY]] = drift, push
        rest_process = process.copy()
        rocking, leaning = self._rocked(recording)
        still = self.turn_density_radpsqrts**2
        rest_process[[ROLL, PITCH]] = max(leaning * rocking, still)
        noise = np.empty(UPDATES)
        noise[LATERAL] = self.lateral_density_mps2sqrts**2 / step
        noise[REST] = self.rest_speed_mps**2
        noise[REST_X:] = (rate_variance + max(rocking, still)) / step
        chord = chord_of(recording)
        signs = signs_of_rest(recording, block)
        return Model(
            step_s=step,
            gravity=recording.gravity_mps2,
            lever_m=recording.mount_position_m[0] - (0.0 if chord is None else chord.centre_m),
            lag_m=0.0 if chord is None else lag_of(chord)[0],
            signals=signals,
            **signs._asdict(),
            given=np.full(steps, -1.0),
            process=process * step,
            rest_process=rest_process * step,
            noise=noise,
            rest_lateral=(REST_LATERAL_MPS2SQRTS**2 + force_variance) / step,
            rocking=rocking,
            leaning=leaning,
            still=still,
            rate_variance=rate_variance,
            force_variance=force_variance,
            scale_variance=sheet.gyro_scale_error**2 / 3.0,
            surely=math.log(self.surely / (1.0 - self.surely)),
            unheard_m=UNHEARD_M,
        )

    def _rocked(self, recording: Recording) -> tuple[float, float]:
        """By how much passengers turn the IMU at rest, and its angles by which share of that; 0 by none.

        They rock the body that they are in; what carries another body, by the drawing, is none such.
        """
        sheet = recording.vehicle_sheet
        below = set() if sheet is None else {s.on for body in sheet.bodies for s in body.supports}
        if recording.mount_body in below:
            return 0.0, 0.0
        return REST_TURNING_RADPSQRTS**2, (REST_LEANING_RADPSQRTS / REST_TURNING_RADPSQRTS) ** 2

    def start(self, recording: Recording, model: Model) -> tuple[FloatArray, FloatArray]:
        """State and covariance of a train that stands where it is known to stand, leaning as it seems to."""
        sheet = recording.imu_sheet
        x, sd = np.zeros(STATES), np.zeros(STATES)
        x[S] = recording.start_position_m
        if len(model.signals):
            lean = np.clip(model.signals[0, 3:] / model.gravity, -0.5, 0.5)
            x[PITCH], x[ROLL] = -math.asin(lean[0]), math.asin(lean[1])
        sd[S] = math.hypot(self.start_sd_m, float(chainage_sd(recording, x[S])))
        sd[V] = self.rest_speed_mps
        sd[[ROLL, PITCH]] = LEANS_RAD
        sd[DRIFT_X : DRIFT_Z + 1] = sheet.gyro_turn_on_bias_radps / math.sqrt(3.0) + 1e-5
        sd[[PUSH, SWAY]] = sheet.accel_turn_on_bias_mps2 / math.sqrt(3.0) + 1e-4
        sd[ASKEW] = math.hypot(ASKEW_RAD, sheet.package_misalignment_rad / math.sqrt(3.0))
        return x, np.diag(sd**2)

    def at_imu_times(self, trace: Trace, recording: Recording) -> pd.DataFrame:
        """States at every IMU sample: interpolated, or of nothing later."""
        wanted, found = recording.imu.index.to_numpy(dtype=np.float64), trace.found
        odds = found.log_odds
        rests = odds > trace.model.surely
        rate = 1.0 / trace.model.step_s
        if self.smoothed and len(odds) > 1:
            own = calm(np.gradient(found.states[:, V], 1.0 / rate), rate)
        else:
            own = calm_so_far(found.acceleration, rate)
        left = unsteady(recording, _block(recording), len(own)) + (found.acceleration - own) ** 2
        shaking = power(left, rate, both_ways=self.smoothed)
        sd = np.sqrt(np.diagonal(found.covariances, axis1=1, axis2=2)[:, [S, V]])
        if trace.heard is None:
            # A scale that is off makes all changes of the speed wrong by the same share, and no stop shows
            # it; a second IMU does, by a state.
            scaled = found.states[:, [S, V]] - [recording.start_position_m, 0.0]
            sd = np.hypot(sd, recording.imu_sheet.accel_scale_error / math.sqrt(3.0) * scaled)
        lines = np.column_stack(
            [
                found.states[:, S],
                found.states[:, V] * np.cos(found.states[:, PITCH]),
                np.where(rests, 0.0, own),
                sd,
                np.sqrt(ACCELERATION_SD_MPS2**2 + shaking),
                1.0 / (1.0 + np.exp(-np.maximum(odds, -700.0))),
            ]
        )
        # Until the filter's first step: standing at the start.
        start_sd = math.hypot(self.start_sd_m, float(chainage_sd(recording, recording.start_position_m)))
        sds = [start_sd, self.rest_speed_mps, ACCELERATION_SD_MPS2]
        start = [recording.start_position_m, 0.0, 0.0, *sds, 1.0]
        lines, times = np.vstack([start, lines]), np.concatenate([[-np.inf], trace.time_s])
        last = np.searchsorted(times, wanted, side="right") - 1
        if self.smoothed:
            times[0] = wanted[0] - 1.0 / rate
            values = np.column_stack([np.interp(wanted, times, column) for column in lines.T])
            ahead = np.maximum(wanted - times[-1], 0.0)
        else:
            values = lines[last]
            ahead = np.where(last > 0, wanted - times[last], 0.0)
        values[:, 0] += ahead * (values[:, 1] + 0.5 * ahead * values[:, 2])
        values[:, 1] += ahead * values[:, 2]
        return pd.DataFrame(values, index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD, STANDSTILL])


def white(sheet: ImuSheet) -> tuple[float, float]:
    """Variance of the mean over one second of a gyro and of an accelerometer, (rad/s)^2 s and (m/s2)^2 s."""
    gyro, accel = (
        density**2 + count**2 / (12.0 * sheet.rate_hz)
        for density, count in (
            (sheet.gyro_noise_radpsqrts, sheet.gyro_resolution_radps),
            (sheet.accel_noise_mpsqrts, sheet.accel_resolution_mps2),
        )
    )
    return gyro, accel


def wandering(sheet: ImuSheet) -> tuple[float, float]:
    """Variance that the biases of a gyro and of an accelerometer gain in a second.

    Of a Markov process that wanders by its bias instability within its correlation time, and of the random
    walk.
    """
    gyro, accel = (
        2.0 * instability**2 / (time or BIAS_S) + walk**2
        for instability, time, walk in (
            (
                sheet.gyro_bias_instability_radps,
                sheet.gyro_bias_correlation_s,
                sheet.gyro_random_walk_radpspsqrts,
            ),
            (
                sheet.accel_bias_instability_mps2,
                sheet.accel_bias_correlation_s,
                sheet.accel_random_walk_mps2psqrts,
            ),
        )
    )
    return gyro + 1e-16, accel + 1e-14


def ends_of_steps(recording: Recording) -> FloatArray:
    """Time at the end of each of the filter's steps."""
    block = _block(recording)
    times = recording.imu.index.to_numpy(dtype=np.float64)
    return np.ascontiguousarray(times[block - 1 :: block][: len(times) // block])


def _block(recording: Recording) -> int:
    """Samples in a step of the filter."""
    return max(1, round(recording.imu_sheet.rate_hz / RATE_HZ))
