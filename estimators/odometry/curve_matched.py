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

Not here: the loops (`simrail.estimators.odometry.kernel`, `simrail.estimators.kalman`), what is made of their
steps (`simrail.estimators.odometry.trace`), and odometry from the encoder alone
(`simrail.estimators.odometry.encoder`).
"""

import math
from dataclasses import dataclass

import numpy as np
from simrail.estimators.kalman import fixed_interval, room_for_history
from simrail.estimators.odometry.kernel import SCALE, STATES, UPDATES, YAW, LineModel, S, Steps, curve_matched
from simrail.estimators.odometry.trace import RATE_HZ, STILL_SD_MPS, Trace, at_imu_times

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording
from simrail.track.design import TrackDesign

_PLACES_PER_M = 4.0
_STILL_S = 0.5


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
    cites = ("Escalona, Urda and Munoz, Sensors 21(3) 683, 2021",)

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return "curve-smoothed odometry" if self.smoothed else "curve-matched odometry"

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
        states = at_imu_times(
            trace,
            recording,
            smoothed=self.smoothed,
            start_sd_m=self.start_sd_m,
            radius_sd=self.radius_sd,
        )
        return Estimate(states=states, mount=recording.mount)

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
        steps = Steps(np.empty((n, STATES)), np.empty((n, STATES, STATES)), np.empty(n), np.empty((n, 2)))
        past = room_for_history(n if self.smoothed else 0, STATES, UPDATES)
        model = self._model(recording, pulse)
        dt, gravity = block / sheet.rate_hz, recording.gravity_mps2
        curve_matched(dt, signals, counts, model, gravity, grid, table, x, p, steps, past)
        if self.smoothed:
            fixed_interval(past, steps.states, steps.covariance)
        slips, rests = steps.flags.T > 0.0
        return Trace(ends, steps.states, steps.covariance, steps.acceleration, slips, rests)

    def wheel_scale(self, recording: Recording) -> tuple[float, float]:
        """Relative error of the nominal wheel radius found at the end of the ride, and its sd.

        Positive if the wheel shows more way than the track has: its true radius is smaller.
        """
        trace = self.trace(recording)
        return float(trace.states[-1, SCALE]), float(np.sqrt(trace.covariance[-1, SCALE, SCALE]))

    def _model(self, recording: Recording, pulse: float) -> LineModel:
        sheet = recording.imu_sheet
        return LineModel(
            pulse_m=pulse,
            still_s=_STILL_S,
            gate=self.gate,
            wheel_walk_m=self.wheel_walk_m,
            tread_sd=self.tread_sd,
            tread_length_m=self.tread_length_m,
            force_m2ps3=sheet.accel_noise_mpsqrts**2 + self.force_m2ps3,
            unsteady_s05=self.unsteady_s05,
            push_walk_m2ps5=self.push_walk_m2ps5,
            gyro_rad2ps=sheet.gyro_noise_radpsqrts**2 + 1e-12,
            # Of a Markov process that wanders by its bias instability within some 300 s.
            drift_walk_rad2ps3=2.0 * sheet.gyro_bias_instability_radps**2 / 300.0 + 1e-16,
            gyro_scale=sheet.gyro_scale_error / math.sqrt(3.0),
            sway_sd_rad=self.sway_sd_rad,
            sway_length_m=self.sway_length_m,
            lag_walk_m=self.lag_walk_m,
            heading_sd_rad=self.heading_sd_rad,
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
                STILL_SD_MPS,
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
