"""Odometry that knows the line: the wheel's way, corrected wherever the track turns or changes its slope.

A wheel encoder alone is off by its wheel's radius, metres in a kilometre. But a train on a known line turns
where the line turns: its heading, integrated from the gyro, is the design's heading at its position. In
a curve of radius R a position error e shows as a heading error e/R, on a straight the heading shows the
gyro's bias, and in a vertical curve the accelerometer feels the slope change. A Kalman filter weighs all of
this together, so that no curve entry has to be found and no two signals have to be laid on each other.
The idea of matching the measured with the design curvature is that of Escalona, Urda and Munoz (Sensors
21(3) 683, 2021), named in Briales et al. 2021, section 6; the formulation is ours.

The accelerometer drives the model, the wheel and the line correct it. States, in this order:

    s, V        position and speed along the track
    way         way that the wheel should show, d(way) = (1 + scale + tread + turn k3) ds
    scale       relative error of the nominal wheel radius (constant)
    tread       wandering of the rolling radius: the wheel runs off its tape circle (Markov in distance)
    turn        m, how the way depends on curvature: the wheel's own path, and its taper in curves
    push        m/s2, offset of the accelerometer along X (random walk)
    squat       relative: a body that pitches under traction and braking feels more than there is
    lead        m, the slope that the body has is the design's this far behind
    yaw         heading of the body
    drift       rad/s, gyro bias (random walk)
    sway        rad, yaw of the body in the track (Markov in distance)
    lag         m, the heading of the body is the design's this far behind, in the direction of travel

Lag and lead matter: the leading axle of a bogie points where the bogie points, which in a curve is a
metre or two behind. They are found along the way because the train knows where it started.

A wheel that slips is not believed: its innovation gives it away, the accelerometer takes over, and the
wheel's way starts anew when both agree on the speed again.

Not here: the loops (`estimators.kernels.odometry`, `estimators.kernels.smoothing`), and odometry from the
encoder alone (`simrail.odometry`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import signal

from estimators.kernels.odometry import SCALE, STATES, UPDATES, YAW, S, V, curve_matched
from estimators.kernels.smoothing import smooth
from simrail.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.errors import InputError
from simrail.estimate import Estimate
from simrail.jit import FloatArray
from simrail.odometry import encoder_odometry
from simrail.recording import Recording
from simrail.track.design import TrackDesign

RATE_HZ = 50.0
"""Rate of the filter. A train's jerk is limited: between two steps nothing happens along the track."""

CALM_HZ = 1.0
"""Up to here an acceleration is the train's."""

HOLD_S = 2.0
"""After a slip the acceleration of the wheel is not believed for so long: its filter still remembers it."""

ACCELERATION_SD_MPS2 = 0.03
"""Of that acceleration: what the body's pitching leaves in it."""

_PLACES_PER_M = 4.0
_STILL_S = 0.5
_STILL_SD_MPS = 1e-3
"""Of the speed of a train that is known to stand."""


class Trace(NamedTuple):
    """What the filter found at its own steps, n of them.

    Attributes
    ----------
    time_s : ndarray (n,)
        Ends of the steps.
    states, covariance : ndarray (n, 13), (n, 13, 13)
        See the module.
    acceleration : ndarray (n,)
        Along the track, over the step; it shakes with the body.
    slipping, resting : ndarray (n,) of bool
        Where the wheel was not believed, and where the train stood.
    """

    time_s: FloatArray
    states: FloatArray
    covariance: FloatArray
    acceleration: FloatArray
    slipping: np.ndarray
    resting: np.ndarray


@dataclass(frozen=True)
class CurveMatchedOdometry:
    """Position, speed and acceleration from encoder, gyro, accelerometer and the design track.

    Attributes
    ----------
    smoothed : bool
        False: a causal filter. True: the fixed-interval smoother, for use after the ride.
    start_sd_m : float
        How well the start is known.
    radius_sd : float
        Relative standard deviation of the nominal wheel radius.
    tread_sd, tread_length_m : float
        Relative standard deviation of the rolling radius about its mean, and over what distance it
        changes: 0.1 to 0.35 % are the taper's share on 5 mm of lateral play.
    turn_sd_m : float
        Standard deviation of `turn`: half the distance of the wheels, 0.75 m, and some taper.
    wheel_walk_m : float
        Random walk of the wheel's way against the track, m2 per m: creep.
    force_m2ps3 : float
        Intensity of what disturbs the accelerometer along X besides its own noise: the body pitches.
    push_sd_mps2, push_walk_m2ps5 : float
        Its offset at first, besides the turn-on bias: a body that leans; and how that wanders.
    squat_sd, unsteady_s05 : float
        Of `squat`: a body that pitches by 1 deg at 1 m/s2 has 0.17. And how unsteady that is:
        what it feels, times `unsteady_s05`, is the density, per sqrt(Hz), of what disturbs it.
    lag_sd_m, lag_walk_m, lead_sd_m : float
        Of lag and lead, and the random walk of lag, m2 per m.
    sway_sd_rad, sway_length_m : float
        Yaw of the body in the track, and over what distance it changes.
    heading_sd_rad : float
        White part of that.
    gate : float
        Innovations of the wheel beyond so many standard deviations are slip.
    """

    smoothed: bool = False
    start_sd_m: float = 0.05
    radius_sd: float = 0.01
    tread_sd: float = 0.001
    tread_length_m: float = 40.0
    turn_sd_m: float = 1.0
    wheel_walk_m: float = 2e-6
    force_m2ps3: float = 3e-5
    push_sd_mps2: float = 0.05
    push_walk_m2ps5: float = 1e-6
    squat_sd: float = 0.1
    unsteady_s05: float = 0.03
    lag_sd_m: float = 1.0
    lag_walk_m: float = 1e-6
    lead_sd_m: float = 1.0
    sway_sd_rad: float = 5e-4
    sway_length_m: float = 4.0
    heading_sd_rad: float = 2e-4
    gate: float = 7.0

    needs = ("encoder",)

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name != "smoothed" and not 0.0 < value < math.inf:
                raise InputError("is out of range", field=name, value=value, limit="> 0")

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every IMU sample.

        Raises
        ------
        InputError
            If the recording has no encoder.
        """
        trace = self.trace(recording)
        wanted = recording.imu.index.to_numpy(dtype=np.float64)
        found = np.column_stack([trace.states[:, [S, V]], self._calm(trace)])
        sd = np.sqrt(np.diagonal(trace.covariance, axis1=1, axis2=2)[:, [S, V]])
        sd = np.column_stack([sd, np.full(len(sd), ACCELERATION_SD_MPS2)])
        # Until the filter's first step: standing at the start.
        begun = [recording.start_position_m, 0.0, 0.0, self.start_sd_m, _STILL_SD_MPS, ACCELERATION_SD_MPS2]
        start = np.array([begun])
        found[trace.resting, 1:] = 0.0
        known = np.vstack([start, np.hstack([found, sd])])
        times = np.concatenate([[-np.inf], trace.time_s])
        if self.smoothed:
            times[0] = min(wanted[0], trace.time_s[0]) - 1.0 / RATE_HZ
            values = np.column_stack([np.interp(wanted, times, column) for column in known.T])
        else:
            last = np.searchsorted(times, wanted, side="right") - 1
            values = known[last]
            slipping = np.concatenate([[False], _held(trace.slipping, HOLD_S)])
            self._roll(values, recording, slipping[last])
            ahead = np.where(last > 0, wanted - times[last], 0.0)
            values[:, 0] += ahead * (values[:, 1] + 0.5 * ahead * values[:, 2])
            values[:, 1] += ahead * values[:, 2]
        states = pd.DataFrame(values, index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD])
        return Estimate(states=states, mount=recording.mount)

    def _roll(self, values: FloatArray, recording: Recording, slipping: np.ndarray) -> None:
        """Put the wheel's own acceleration into values (n, 6), where the wheel rolls.

        An attitude filter takes the acceleration off the accelerometer. Made from that same accelerometer
        it would take the body's own pitch away as well.
        """
        assert recording.encoder is not None and recording.encoder_sheet is not None
        wheel = encoder_odometry(
            recording.encoder,
            recording.encoder_sheet,
            recording.imu.index.to_numpy(dtype=np.float64),
            start_position_m=recording.start_position_m,
            radius_relative_sd=self.radius_sd,
        )
        rolls = ~slipping
        values[rolls, 2] = wheel["acceleration_mps2"].to_numpy()[rolls]
        values[rolls, 5] = wheel["acceleration_sd_mps2"].to_numpy()[rolls]

    def _calm(self, trace: Trace) -> FloatArray:
        """Acceleration without what the body shakes, (n,): the train's own changes slowly."""
        if self.smoothed:
            slope = np.gradient(trace.states[:, V], 1.0 / RATE_HZ)
            sections = signal.butter(2, CALM_HZ, fs=RATE_HZ, output="sos")
            calm: FloatArray = signal.sosfiltfilt(sections, slope, padlen=min(len(slope) - 1, 150))
            return calm
        # Critically damped: the slope of the speed, followed by two equal lags.
        keep = math.exp(-2.0 * math.pi * CALM_HZ / RATE_HZ)
        passed: FloatArray = signal.lfilter(
            [(1.0 - keep) ** 2], [1.0, -2.0 * keep, keep * keep], trace.acceleration
        )
        return passed

    def trace(self, recording: Recording) -> Trace:
        """Run the filter, and the smoother if wanted; all states at its own steps."""
        if recording.encoder is None or recording.encoder_sheet is None:
            raise InputError(
                "curve-matched odometry needs an encoder",
                field="encoder",
                remedy="add an [encoder] to the scenario, or counts to the ride",
            )
        sheet, wheel = recording.imu_sheet, recording.encoder_sheet
        block = max(1, round(sheet.rate_hz / RATE_HZ))
        time = recording.imu.index.to_numpy(dtype=np.float64)
        n = len(time) // block
        names = [GYRO[1], GYRO[2], ACCEL[0]]
        signals = recording.imu[names].to_numpy(dtype=np.float64)[: n * block]
        signals = signals.reshape(n, block, 3).mean(axis=1)
        ends = time[block - 1 :: block][:n]
        read = np.searchsorted(recording.encoder.index.to_numpy(), ends + 1e-9, side="right") - 1
        counts = recording.encoder["pulse_count"].to_numpy(dtype=np.float64)[np.maximum(read, 0)]
        pulse = 2.0 * math.pi * wheel.wheel_radius_m / wheel.pulses_per_revolution
        grid, table = line_table(recording.track)
        x, p = self._start(recording, pulse)
        states, covariance = np.empty((n, STATES)), np.empty((n, STATES, STATES))
        acceleration, flags = np.empty(n), np.empty((n, 2))
        m = n if self.smoothed else 0
        kept = (
            np.empty((m, STATES)),
            np.empty((m, STATES, STATES)),
            np.empty((m, STATES, STATES)),
            np.empty((m, UPDATES, STATES)),
            np.empty((m, UPDATES, STATES)),
            np.empty((m, 2 * UPDATES)),
        )
        curve_matched(
            block / sheet.rate_hz,
            signals,
            counts,
            self._model(recording, pulse),
            recording.gravity_mps2,
            grid,
            table,
            x,
            p,
            states,
            covariance,
            acceleration,
            flags,
            *kept,
        )
        if self.smoothed:
            smooth(*kept, states, covariance)
        return Trace(ends, states, covariance, acceleration, flags[:, 0] > 0.0, flags[:, 1] > 0.0)

    def wheel_scale(self, recording: Recording) -> tuple[float, float]:
        """Relative error of the nominal wheel radius found at the end of the ride, and its sd.

        Positive if the wheel shows more way than the track has: its true radius is smaller.
        """
        trace = self.trace(recording)
        return float(trace.states[-1, SCALE]), float(np.sqrt(trace.covariance[-1, SCALE, SCALE]))

    def _model(self, recording: Recording, pulse: float) -> FloatArray:
        sheet = recording.imu_sheet
        drift = sheet.gyro_bias_instability_radps
        return np.array(
            [
                pulse,
                _STILL_S,
                self.gate,
                self.wheel_walk_m,
                self.tread_sd,
                self.tread_length_m,
                sheet.accel_noise_mpsqrts**2 + self.force_m2ps3,
                self.unsteady_s05,
                self.push_walk_m2ps5,
                sheet.gyro_noise_radpsqrts**2 + 1e-12,
                # Of a Markov process that wanders by its bias instability within some 300 s.
                2.0 * drift**2 / 300.0 + 1e-16,
                sheet.gyro_scale_error / math.sqrt(3.0),
                self.sway_sd_rad,
                self.sway_length_m,
                self.lag_walk_m,
                self.heading_sd_rad,
            ]
        )

    def _start(self, recording: Recording, pulse: float) -> tuple[FloatArray, FloatArray]:
        """State and covariance of a train that stands where it is known to stand."""
        sheet = recording.imu_sheet
        x = np.zeros(STATES)
        x[S] = recording.start_position_m
        x[YAW] = float(recording.track.frame(np.array([x[S]])).yaw_rad[0])
        sd = np.array(
            [
                self.start_sd_m,
                _STILL_SD_MPS,
                pulse / math.sqrt(12.0),
                self.radius_sd,
                self.tread_sd,
                self.turn_sd_m,
                math.hypot(sheet.accel_turn_on_bias_mps2 / math.sqrt(3.0), self.push_sd_mps2),
                self.squat_sd,
                self.lead_sd_m,
                5e-3,
                sheet.gyro_turn_on_bias_radps / math.sqrt(3.0) + 1e-5,
                self.sway_sd_rad,
                self.lag_sd_m,
            ]
        )
        return x, np.diag(sd**2)


def _held(flags: np.ndarray, hold_s: float) -> np.ndarray:
    """Flags (n,) at the filter's steps, each held on for a time."""
    steps = np.arange(len(flags))
    latest = np.maximum.accumulate(np.where(flags, steps, -len(flags) - 10**6))
    held: np.ndarray = steps - latest <= hold_s * RATE_HZ
    return held


def line_table(track: TrackDesign) -> tuple[FloatArray, FloatArray]:
    """The design as the kernel takes it.

    Returns
    -------
    grid : ndarray (2,)
        First place (m), places per metre.
    table : ndarray (m, 4)
        Heading, its slope, roll, pitch at every place.
    """
    count = math.ceil((track.end_m - track.start_m) * _PLACES_PER_M) + 1
    places = np.minimum(track.start_m + np.arange(count) / _PLACES_PER_M, track.end_m)
    frame = track.frame(places)
    table = np.column_stack([frame.yaw_rad, frame.rates[:, 2], frame.roll_rad, frame.pitch_rad])
    return np.array([track.start_m, _PLACES_PER_M]), np.ascontiguousarray(table)
