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
    way         way that the wheel should show, d(way) = (1 + scale + tread + left or right) ds
    scale       relative error of the nominal wheel radius (constant)
    tread       wandering of the rolling radius: the wheel runs off its tape circle (Markov in distance)
    left, right how the way changes in a curve to the left or right: the wheel's own path, and its flange
    push        m/s2, offset of the accelerometer along X (random walk)
    squat       relative: a body that pitches under traction and braking feels more than there is
    lead        m, the slope that the body has is the design's this far behind
    yaw         heading of the body
    drift       rad/s, gyro bias (random walk)
    sway        rad, yaw of the body in the track (Markov in distance)
    lag         m, the heading of the body is the design's this far behind, in the direction of travel
    bend        relative error of the map's curvature, anew in each curve
    even, odd   m, error of the map's place of the joint of two elements ahead and of that behind
    turn        rad, by so much less than lag says the body turns in this curve: anew in each

Lag and lead matter: the leading axle of a bogie points where the bogie points, which in a curve is a
metre or two behind. They are found along the way because the train knows where it started. The lag is that
of a body whose wheels carry no lateral force. Where cant leaves some of the lateral acceleration a they carry
it by creep, and point inward of their way by (a / g) / (f22 / N): a lag shorter by .2 m at 60 km/h, whatever
the radius, than at 20. What an axle's or a frame's own steering does beside that is no length but an angle,
another one in each curve.

A wheel that slips is not believed: its innovation gives it away, the accelerometer takes over, and the
wheel's way starts anew when both agree on the speed again. Without a wheel another filter takes its place,
driven by the speed of the zero-velocity odometry (`simrail.estimators.odometry.without_wheel`).

Of the three that an attitude filter asks for, position and speed are the filter's. The acceleration is
made here, since a train's own acceleration changes slowly, and the accelerometer shakes with the body.

Not here: the loops (`simrail.estimators.odometry.kernel`, `simrail.estimators.kalman`), and odometry from the
encoder alone (`simrail.estimators.odometry.encoder`).
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from simrail.estimators.kalman import fixed_interval, room_for_history
from simrail.estimators.odometry.calm import ACCELERATION_SD_MPS2, calm, calm_so_far, power, unsteady
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.kernel import (
    BEND,
    DRIFT,
    EVEN,
    LAG,
    LEAD,
    LEFT,
    ODD,
    PUSH,
    RIGHT,
    SCALE,
    SQUAT,
    STATES,
    SWAY,
    TREAD,
    TURN,
    UPDATES,
    WAY,
    YAW,
    BoolArray,
    LineModel,
    S,
    Steps,
    V,
    curve_matched,
    room_to_work,
)
from simrail.estimators.odometry.line_table import line_at, line_under
from simrail.estimators.odometry.moving_start import (
    BACK_S,
    Start,
    reading_variance,
    shown_by,
    start_of,
)
from simrail.estimators.odometry.pointing import (
    LATERAL_CREEP,
    Pointing,
    chainage_sd,
    chord_of,
    lag_of,
    place_sd_of,
    pointing_of,
    sway_sd_of,
    turn_of,
)
from simrail.estimators.odometry.without_wheel import steps_without_wheel

from simrail.core.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, IntArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import AT_IMU_TIMES, AT_OWN_TIMES, Recording, beginning
from simrail.recording.sheets.vehicle_sheet import Chord

_STILL_S = 0.5

RATE_HZ = 50.0
"""Rate of the filter. A train's jerk is limited: between two steps nothing happens along the track."""

HOLD_S = 2.0
"""After a slip the acceleration of the wheel is not believed for so long: its filter still remembers it."""


WHEELSET_SHARE = 0.4
"""Of the wandering of a free wheel's rolling radius, so much is that of a wheelset in a bogie: what one of
its wheels gains by a shift to the side the other loses, and its taper steers it back. Under a long wagon it
runs on its flange in curves, as a free wheel does."""

MODEL_FORCE = 100.0
"""By so much more than `force_m2ps3` the body of a model shakes, by its pitch: with less a wheel that rolls
passes for one that slips. Synthetic, of the 1:10 car of `scale_greatest`."""

STILL_SD_MPS = 1e-3
"""Of the speed of a train that is known to stand."""


@dataclass(frozen=True)
class CurveMatchedOdometry:
    """Position, speed and acceleration from encoder, gyro, accelerometer and the design track.

    Attributes
    ----------
    smoothed : bool
        False: a causal filter. True: the fixed-interval smoother, for use after the ride.
    start_sd_m : float
        How well the start is known.
    tread_sd, tread_length_m : float
        Relative standard deviation of the rolling radius about its mean, and over what distance it
        changes: 0.1 to 0.35 % are the taper's share on 5 mm of lateral play. Of a free wheel, or where no
        drawing says; on a wheelset less (`WHEELSET_SHARE`).
    flange_sd : float
        Standard deviation of `left` and `right`. In a curve a wheel rolls on its flange root, some 4 mm
        further out than at its tape circle, or not: 1.5 % of a wheel of 0.29 m, 0.9 % of one of 0.46 m.
    wheel_walk_m : float
        Random walk of the wheel's way against the track, m2 per m: creep.
    force_m2ps3 : float
        Intensity of what disturbs the accelerometer along X besides its own noise: the body pitches.
    push_sd_mps2, push_walk_m2ps5 : float
        Its offset at first, besides the turn-on bias: a body that leans; and how that wanders.
    squat_sd, unsteady_s05 : float
        Of `squat`: a body that pitches by 1 deg at 1 m/s2 has 0.17. And how unsteady that is:
        what it feels, times `unsteady_s05`, is the density, per sqrt(Hz), of what disturbs it.
    heading_sd_rad : float
        White part of that.
    gate : float
        Innovations of the wheel beyond so many standard deviations are slip.
    wheel : bool
        False leaves the encoder aside: an IMU and a map alone.
    hindsight : bool
        As of `EncoderOdometry`: the first seconds of a ride that begins at speed are answered by later ones.
        The smoother always does; the filter hears the wheel alone until readings have shown the speed.
    """

    smoothed: bool = False
    start_sd_m: float = 0.05
    tread_sd: float = 0.002
    tread_length_m: float = 25.0
    flange_sd: float = 0.008
    wheel_walk_m: float = 2e-6
    force_m2ps3: float = 3e-5
    push_sd_mps2: float = 0.05
    push_walk_m2ps5: float = 1e-6
    squat_sd: float = 0.1
    unsteady_s05: float = 0.03
    heading_sd_rad: float = 2e-4
    gate: float = 7.0
    wheel: bool = True
    hindsight: bool = False

    needs = ()
    cites = ("escalona_2021",)

    @property
    def causal(self) -> bool:
        """The filter is causal without hindsight, the smoother is not."""
        return not self.smoothed and not self.hindsight

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return "curve-smoothed odometry" if self.smoothed else "curve-matched odometry"

    def at_scale(self, scale: float) -> "CurveMatchedOdometry":
        """That of a model of another scale: its lengths are shorter by that, and it shakes by `MODEL_FORCE`.

        But for the walk of the wheel: over rails that are rougher than by the scale, its radius wanders more.
        """
        if scale == 1.0:
            return self
        lengths = {name: scale * getattr(self, name) for name in ("start_sd_m", "tread_length_m")}
        return replace(self, force_m2ps3=MODEL_FORCE * self.force_m2ps3, **lengths)

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name not in ("smoothed", "wheel", "hindsight") and not 0.0 < value < math.inf:
                raise InputError("is out of range", field=name, value=value, limit="> 0")

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every IMU sample."""
        heard = self._heard(recording)
        if heard.has_wheel and self.causal:
            states = self._once_shown(recording)
        else:
            states = self.at_imu_times(self.trace(recording), recording)
            if heard.has_wheel and start_of(heard).speed_mps:
                # Until its own states have settled, the wheel's first seconds, smoothed back, are better.
                first = EncoderOdometry(hindsight=True).estimate(heard).states
                early = states.index < states.index[0] + BACK_S
                states.loc[early, list(first)] = first.loc[early]
        return Estimate(states=states, mount=recording.mount)

    def _once_shown(self, recording: Recording) -> pd.DataFrame:
        """States of a ride that may begin at speed: from rest until readings show it, then from there anew.

        Nothing later than a sample enters it.
        """
        assert recording.encoder is not None and recording.encoder_sheet is not None
        if recording.start_speed_mps:
            return self.at_imu_times(self.trace(recording), recording)
        read, pulse = recording.encoder.index.to_numpy(dtype=np.float64), recording.encoder_sheet.pulse_m
        shown = shown_by(read, recording.encoder["pulse_count"].to_numpy(dtype=np.float64) * pulse, pulse)
        resting = replace(recording, start_speed_mps=0.0)
        if shown.first < 0 and shown.told < 0:
            return self.at_imu_times(self.trace(resting), resting)
        time = recording.imu.index.to_numpy(dtype=np.float64)
        seen = int(np.searchsorted(time, read[shown.first if shown.first >= 0 else shown.told]))
        at = len(time) if shown.told < 0 else int(np.searchsorted(time, read[shown.told]))
        wheel = EncoderOdometry().estimate(recording).states
        before = beginning(resting, samples=max(seen, 2))
        early = [self.at_imu_times(self.trace(before), before).iloc[:seen], wheel.iloc[seen : at + 1]]
        if len(time) >= at + 2:
            late = from_sample(recording, at, wheel)
            start = Start(float(wheel["speed_mps"].iloc[at]), float(wheel["speed_sd_mps"].iloc[at]))
            steps = self.trace(late, start, jitter_m2=jitter_of(read[: shown.told + 1], recording))
            early.append(self.at_imu_times(steps, late, wheel=wheel.iloc[at:]).iloc[1:])
        return pd.concat(early)

    def trace(
        self, recording: Recording, start: Start | None = None, *, jitter_m2: float | None = None
    ) -> Steps:
        """Run the filter, and the smoother if wanted; all states at its own steps.

        Parameters
        ----------
        recording : Recording
            The recording.
        start : Start, optional
            Speed at its first sample; as `first_speed` has it if not given.
        jitter_m2 : float, optional
            Variance that stamps which jitter add to a reading of the way; if not given, as the first second
            of a ride that begins at speed shows it, with hindsight, and 0 without.
        """
        recording = self._heard(recording)
        if not recording.has_wheel:
            return self._without_wheel(recording)
        sheet = recording.imu_sheet
        block = max(1, round(sheet.rate_hz / RATE_HZ))
        time = recording.imu.index.to_numpy(dtype=np.float64)
        n = len(time) // block
        names = [GYRO[1], GYRO[2], ACCEL[0], ACCEL[1]]
        signals = recording.imu[names].to_numpy(dtype=np.float64)[: n * block]
        # Rows of a frame may lie by columns, for which the kernel would be compiled anew.
        signals = np.ascontiguousarray(signals.reshape(n, block, 4).mean(axis=1))
        ends = np.array(time[block - 1 :: block][:n])  # a view would be compiled for anew
        counts, pulse = counts_at(recording, ends)
        chord = chord_of(recording)
        grid, table = line_under(recording, wheel_ahead_m=wheel_ahead(recording))
        pointing = pointing_of(recording, chord)
        x, p = self._start(recording, pulse, chord, pointing, start)
        x[YAW] = line_at(grid, table, x[S]).heading
        spoken_of = STATES if self.smoothed else V + 1
        states, covariance = np.empty((n, STATES)), np.empty((n, spoken_of, spoken_of))
        rate = sheet.rate_hz / block
        steps = Steps(rate, ends, states, covariance, np.empty(n), *np.empty((2, n), bool))
        past = room_for_history(n if self.smoothed else 0, STATES, UPDATES)
        if jitter_m2 is None:
            begun = not self.causal and start_of(recording).speed_mps != 0.0
            jitter_m2 = jitter_of(None, recording) if begun else 0.0
        model = self._model(recording, pulse, pointing)._replace(jitter_m2=jitter_m2)
        dt, gravity = block / sheet.rate_hz, recording.gravity_mps2
        curve_matched(dt, signals, counts, model, gravity, grid, table, x, p, steps, room_to_work(), past)
        if self.smoothed:
            fixed_interval(past, steps.states, steps.covariance)
        return steps

    def _without_wheel(self, recording: Recording) -> Steps:
        """The steps of the filter that has the zero-velocity odometry in place of a wheel."""
        chord = chord_of(recording)
        pointing = pointing_of(recording, chord)
        x, p = self._start(recording, 0.0, chord, pointing)
        return steps_without_wheel(
            recording, x, p, self._model(recording, 0.0, pointing), smoothed=self.smoothed
        )

    def _heard(self, recording: Recording) -> Recording:
        """What of a recording it takes: without a wheel, if it is told so."""
        if self.wheel:
            return recording
        return replace(recording, encoder=None, encoder_sheet=None, odometer=None, odometer_sheet=None)

    def at_imu_times(
        self, steps: Steps, recording: Recording, *, wheel: pd.DataFrame | None = None
    ) -> pd.DataFrame:
        """Position, speed and acceleration at every IMU sample: interpolated, or of nothing later.

        ``wheel`` is the wheel's own odometry at the same samples, of one that has heard more than this
        recording: its beginning, too.
        """
        recording, rate = self._heard(recording), steps.rate_hz
        wanted = recording.imu.index.to_numpy(dtype=np.float64)
        if self.smoothed:
            own = calm(np.gradient(steps.states[:, V], 1.0 / rate), rate)
        else:
            own = calm_so_far(steps.acceleration, rate)
        block = max(1, round(recording.imu_sheet.rate_hz / rate))
        left = unsteady(recording, block, len(own)) + (steps.acceleration - own) ** 2
        shaking = power(left, rate, both_ways=self.smoothed)
        values = np.column_stack([steps.states[:, [S, V]], own])
        values[steps.resting, 1:] = 0.0
        sd = np.sqrt(np.diagonal(steps.covariance, axis1=1, axis2=2)[:, [S, V]])
        sd[:, 0] = np.hypot(sd[:, 0], chainage_sd(recording, values[:, 0]))
        lines = np.column_stack([values, sd, np.sqrt(ACCELERATION_SD_MPS2**2 + shaking)])
        # Until the filter's first step: at the start, standing or at its first speed.
        if wheel is None:
            speed, speed_sd = first_speed(recording)
            place = [recording.start_position_m, speed, 0.0]
            start = [*place, self.start_sd_m, speed_sd, ACCELERATION_SD_MPS2]
        else:
            start = wheel[[*ODOMETRY, *ODOMETRY_SD]].iloc[0].to_list()
        lines, times = np.vstack([start, lines]), np.concatenate([[-np.inf], steps.time_s])
        if self.smoothed:
            times[0] = min(wanted[0], steps.time_s[0]) - 1.0 / rate
            values = np.column_stack([np.interp(wanted, times, column) for column in lines.T])
        else:
            last = np.searchsorted(times, wanted, side="right") - 1
            values = lines[last]
            if recording.has_wheel:
                rolls = ~np.concatenate([[False], _held(steps.slipping, HOLD_S)])[last]
                if wheel is None:
                    wheel = EncoderOdometry().estimate(recording).states
                values[rolls, 2::3] = _acceleration_of(wheel, steps.time_s, own, shaking, last)[rolls]
            ahead = np.where(last > 0, wanted - times[last], 0.0)
            values[:, 0] += ahead * (values[:, 1] + 0.5 * ahead * values[:, 2])
            values[:, 1] += ahead * values[:, 2]
        return pd.DataFrame(values, index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD])

    def _model(self, recording: Recording, pulse: float, yaw: Pointing) -> LineModel:
        """Noise and constants: those of the method under their own names, with what the data sheet adds."""
        sheet = recording.imu_sheet
        turn, turn_sd = turn_of(chord_of(recording), yaw)
        own = {name: value for name, value in vars(self).items() if name in LineModel._fields}
        sheets = {
            "pulse_m": pulse,
            "jitter_m2": 0.0,
            "still_s": _STILL_S,
            "force_m2ps3": sheet.accel_noise_mpsqrts**2 + self.force_m2ps3,
            "gyro_rad2ps": sheet.gyro_noise_radpsqrts**2 + 1e-12,
            # Of a Markov process that wanders by its bias instability within some 300 s.
            "drift_walk_rad2ps3": 2.0 * sheet.gyro_bias_instability_radps**2 / 300.0 + 1e-16,
            "gyro_scale": sheet.gyro_scale_error / math.sqrt(3.0),
            "tread_sd": self.tread_sd * rolling_share(recording),
            "sway_sd_rad": sway_sd_of(yaw, turn),
            "sway_length_m": yaw.sway_length_m,
            "turn_rad": turn,
            "turn_sd_rad": turn_sd,
            "attack_s2pm": 0.0 if turn or not yaw.attacks else 1.0 / (recording.gravity_mps2 * LATERAL_CREEP),
            "bend_sd": recording.map_errors.radius_relative_sd,
            "shift_sd_m": recording.map_errors.place_sd_m,
        }
        return LineModel(**(own | sheets))

    def _start(
        self,
        recording: Recording,
        pulse: float,
        chord: Chord | None,
        yaw: Pointing,
        start: Start | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """State and covariance of a train that stands, or runs, where it is known to."""
        sheet, wheel, errors = recording.imu_sheet, recording.encoder_sheet, recording.map_errors
        x = np.zeros(STATES)
        x[S] = recording.start_position_m
        x[V], speed_sd = first_speed(recording) if start is None else start
        if x[V] != 0.0:  # the first step ends at the first sample, and begins one interval earlier
            x[S] -= x[V] / sheet.rate_hz
            x[WAY] = -x[V] / sheet.rate_hz
        x[LAG], chord_sd = (0.0, 0.0) if chord is None else lag_of(chord)
        x[TURN], turn_sd = turn_of(chord, yaw)
        if chord is not None and x[TURN] > 0.0:
            x[LAG], chord_sd = 0.0, place_sd_of(chord)
        sd = np.zeros(STATES)
        sd[S] = math.hypot(self.start_sd_m, float(chainage_sd(recording, x[S])))
        sd[V] = speed_sd
        sd[WAY] = pulse / math.sqrt(12.0)
        sd[SCALE] = 0.0 if wheel is None else wheel.radius_relative_sd
        sd[TREAD] = self.tread_sd * rolling_share(recording)
        sd[LEFT] = sd[RIGHT] = self.flange_sd * rolling_share(recording)
        sd[PUSH] = math.hypot(sheet.accel_turn_on_bias_mps2 / math.sqrt(3.0), self.push_sd_mps2)
        sd[SQUAT] = self.squat_sd
        sd[LEAD] = yaw.lead_sd_m
        sd[YAW] = 5e-3
        sd[DRIFT] = sheet.gyro_turn_on_bias_radps / math.sqrt(3.0) + 1e-5
        sd[SWAY] = sway_sd_of(yaw, x[TURN])
        sd[LAG] = math.hypot(yaw.lag_sd_m, chord_sd)
        sd[TURN] = turn_sd
        sd[BEND] = errors.radius_relative_sd
        sd[EVEN] = sd[ODD] = errors.place_sd_m
        return x, np.diag(sd**2)


def from_sample(recording: Recording, sample: int, odometry: pd.DataFrame) -> Recording:
    """The recording from a sample of the IMU on, with the place and the speed that an odometry has there."""
    began = recording.imu.index[sample]
    cut: dict[str, Any] = {}
    for name in (*AT_IMU_TIMES, *AT_OWN_TIMES):
        frame = getattr(recording, name)
        if frame is not None:
            first = max(int(np.searchsorted(frame.index.to_numpy(), began, side="right")) - 1, 0)
            cut[name] = frame.iloc[sample:] if name in AT_IMU_TIMES else frame.iloc[first:]
    return replace(
        recording,
        start_position_m=float(odometry["position_m"].iloc[sample]),
        start_speed_mps=float(odometry["speed_mps"].iloc[sample]),
        **cut,
    )


def first_speed(recording: Recording) -> tuple[float, float]:
    """Speed at the first sample, and its standard deviation: of a train at rest, as told, or by hindsight."""
    start = start_of(recording)
    if start.speed_mps == 0.0 or not recording.has_wheel or recording.start_speed_mps is not None:
        return start.speed_mps, max(start.sd_mps, STILL_SD_MPS)
    wheel = EncoderOdometry(hindsight=True).estimate(recording).states.iloc[0]
    return float(wheel["speed_mps"]), max(float(wheel["speed_sd_mps"]), STILL_SD_MPS)


def jitter_of(read: FloatArray | None, recording: Recording) -> float:
    """Variance that stamps add to a reading of the wheel's way, m2, by those first readings, or by all."""
    assert recording.encoder is not None and recording.encoder_sheet is not None
    time = recording.encoder.index.to_numpy(dtype=np.float64) if read is None else read
    pulse = recording.encoder_sheet.pulse_m
    way = recording.encoder["pulse_count"].to_numpy()[: len(time)].astype(np.float64) * pulse
    return reading_variance(time, way, pulse) - pulse**2 / 12.0


def counts_at(recording: Recording, times: FloatArray) -> tuple[FloatArray, float]:
    """Counts since the first reading, by the last one at each time (n,), and the way of a count, m.

    Both are 0 where there is no wheel.
    """
    if recording.encoder is None or recording.encoder_sheet is None:
        return np.zeros(len(times)), 0.0
    read = np.searchsorted(recording.encoder.index.to_numpy(), times + 1e-9, side="right") - 1
    counts = recording.encoder["pulse_count"].to_numpy(dtype=np.float64)
    return counts[np.maximum(read, 0)] - counts[0], recording.encoder_sheet.pulse_m


def wheel_ahead(recording: Recording) -> float:
    """How far ahead of the mount the encoder's wheel is along the vehicle, m; 0 where no drawing says it."""
    sheet, wheel = recording.vehicle_sheet, recording.encoder_sheet
    if sheet is None or wheel is None:
        return 0.0
    at = {body.name: body.x_m for body in sheet.bodies}
    axle = wheel.wheel.rpartition(".")[0]
    if axle not in at or recording.mount_body not in at:
        return 0.0
    return at[axle] - at[recording.mount_body] - recording.mount_position_m[0]


def rolling_share(recording: Recording) -> float:
    """How much the encoder's rolling radius wanders, of what that of a free wheel does."""
    sheet, wheel = recording.vehicle_sheet, recording.encoder_sheet
    axle = None if sheet is None or wheel is None else sheet.body(wheel.wheel.rpartition(".")[0])
    if sheet is None or axle is None or not axle.wheelset:
        return 1.0
    in_bogie = any(sheet.above(body.name) for body in sheet.above(axle.name))
    return WHEELSET_SHARE if in_bogie else 1.0


def _acceleration_of(
    wheel: pd.DataFrame, times: FloatArray, calmed: FloatArray, shaking: FloatArray, last: IntArray
) -> FloatArray:
    """The wheel's own acceleration and its sd (n, 2), for where it rolls.

    An attitude filter takes the acceleration off the accelerometer. Made from that same accelerometer it
    would take the body's own pitch away as well. What parts the two is the wheel's error, which is mostly its
    rolling radius that changes, and is measured so.
    """
    read = np.searchsorted(wheel.index.to_numpy(), times + 1e-9, side="right") - 1
    own = wheel["acceleration_mps2"].to_numpy()
    off = power((own[read] - calmed) ** 2, RATE_HZ, both_ways=False)
    sd = np.sqrt(wheel["acceleration_sd_mps2"].to_numpy() ** 2 + np.append(off + shaking, 0.0)[last - 1])
    return np.column_stack([own, sd])


def _held(flags: BoolArray, hold_s: float) -> BoolArray:
    """Flags (n,) at the filter's steps, each held on for a time."""
    number = np.arange(len(flags))
    latest = np.maximum.accumulate(np.where(flags, number, -len(flags) - 10**6))
    held: BoolArray = number - latest <= hold_s * RATE_HZ
    return held
