"""The track-relative smoother, and its filter: attitude, place and speed of a body with honest intervals."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from simrail.estimators.odometry.curve_matched import chord_of
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.kernel import (
    OUTPUTS,
    SEGMENT,
    Model,
    room_for_segment,
    room_to_work,
    run_back,
    run_filter,
)
from simrail.estimators.track_relative.dual import Dual
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import Around, duals, pose_of
from simrail.estimators.track_relative.model import _sense as sense_of
from simrail.estimators.track_relative.model import first_guess, lag_of, model_of, steps_of, y_bend_of
from simrail.estimators.track_relative.noise import AXLE, BODY, FRAME, Motion

from simrail.core.columns import ATTITUDE, ATTITUDE_SD, ODOMETRY, RELATIVE_POSITION, RELATIVE_POSITION_SD
from simrail.core.jit import FloatArray
from simrail.core.rotation import euler_angles, rotation_matrix
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording


@dataclass(frozen=True)
class TrackRelativeSmoother:
    """Smoother over the track."""

    smoothed: bool = True
    passes: int = 2
    rate_hz: float = 125.0
    motion: Motion | None = None

    needs = ("encoder",)
    label = "track-relative smoother"
    cites = ()

    @property
    def causal(self) -> bool:
        return not self.smoothed

    def trace(self, recording):
        steps = steps_of(recording, self.rate_hz, smoothed=self.smoothed)
        chord = chord_of(recording)
        motion = self.motion or motion_of(recording)
        states = first_guess(steps, motion, lag_of(chord), y_bend_of(recording, chord))
        for number in range(self.passes if self.smoothed else 1):
            if number > 0:
                states = relinearised(states)
            model = model_of(recording, steps, motion, chord, states)
            if self.smoothed:
                states, covariance, nll, surprises = smooth(model)
            else:
                states, covariance, nll, surprises = filtered(model)
        return steps, model, states, covariance, nll, surprises

    def estimate(self, recording: Recording) -> Estimate:
        steps, model, states, covariance, nll, surprises = self.trace(recording)
        return said(recording, steps, self.motion or motion_of(recording), chord_of(recording), states, covariance, causal=self.causal)


def relinearised(states):
    """States about which to linearise again: of the train on its map, of the map and the suspension.

    Not those of the body in its track: what they multiply is a motion of the body as well, and a smoothed one is
    smaller than the true one, so that the product would be made up by a state that is constant.
    """
    again = np.zeros_like(states)
    kept = [at.S, at.V, at.A, at.TILT, at.LAG, at.Y_BEND]
    again[:, kept] = states[:, kept]
    return again


def motion_of(recording):
    sheet = recording.vehicle_sheet
    if sheet is None:
        return BODY
    supports = sheet.body(recording.mount_body).supports
    if not supports:
        return AXLE
    return FRAME if all(not sheet.body(s.on).supports for s in supports) and len(sheet.bodies) > 3 else BODY


def filtered(model: Model):
    n = len(model.measured)
    states, covariance = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    surprises = np.full((n, 8), np.nan)
    x, p = model.start.copy(), model.start_covariance.copy()
    none = np.empty((0, at.STATES))
    nll = run_filter(
        model, none, np.empty((0, at.STATES, at.WIDTH)), states, covariance, surprises, room_to_work(), x, p
    )
    return states, covariance, nll, surprises


def smooth(model: Model):
    n = len(model.measured)
    count = -(-n // SEGMENT)
    starts, squares = np.empty((count, at.STATES)), np.empty((count, at.STATES, at.WIDTH))
    x, p = model.start.copy(), model.start_covariance.copy()
    surprises = np.full((n, 8), np.nan)
    none, none3 = np.empty((0, at.STATES)), np.empty((0, OUTPUTS, OUTPUTS))
    nll = run_filter(model, starts, squares, none, none3, surprises, room_to_work(), x, p)
    states, covariance = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    run_back(
        model, starts, squares, states, covariance, room_for_segment(SEGMENT), room_to_work(), x, p,
        np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH)), np.zeros((OUTPUTS, at.WIDTH)),
        np.zeros((OUTPUTS, at.WIDTH)),
    )
    return states, covariance, nll, surprises


def said(recording, steps, motion, chord, states, covariance, *, causal) -> Estimate:
    track = recording.track
    around = Around(states, np.zeros(len(states)), sense_of(states[:, at.V]), recording.mount_position_m[1:], recording.gravity_mps2, motion.sway_hz > 0)
    ground = ground_at(recording, chord, states[:, at.S])
    pose = pose_of(duals(states), ground, around)
    columns = [*(a.value for a in pose.rho), states[:, at.HEADING], states[:, at.S], states[:, at.V], states[:, at.A], pose.y.value, pose.z.value]
    rates = [*(a.value for a in pose.rho_rate), np.zeros(len(states)), states[:, at.V], states[:, at.A], np.zeros(len(states)), pose.y_rate.value, pose.z_rate.value]
    values = np.column_stack(columns)
    sd = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))
    time = recording.imu.index.to_numpy(dtype=np.float64)
    if causal:
        end = steps.time_s + 0.5 * steps.dt
        last = np.maximum(np.searchsorted(end, time + 1e-9, side="right") - 1, 0)
        ahead = np.clip(time - steps.time_s[last], 0.0, 2.0 * steps.dt)
        full = values[last] + ahead[:, None] * np.column_stack(rates)[last]
        sd = sd[last]
    else:
        full = np.column_stack([np.interp(time, steps.time_s, c) for c in values.T])
        sd = np.column_stack([np.interp(time, steps.time_s, c) for c in sd.T])
    frame = track.frame(np.clip(full[:, 4], track.start_m, track.end_m))
    base = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad + full[:, 3]]))
    angles = euler_angles(base @ rotation_matrix(full[:, :3]))
    angles[:, 2] += 2 * np.pi * np.round((frame.yaw_rad + full[:, 3] - angles[:, 2]) / (2 * np.pi))
    table = np.column_stack([angles, full[:, [4, 5, 6]], full[:, 7:9], sd])
    names = [*ATTITUDE, *ODOMETRY, *RELATIVE_POSITION, *ATTITUDE_SD, "position_sd_m", "speed_sd_mps", *RELATIVE_POSITION_SD]
    return Estimate(states=pd.DataFrame(table, index=recording.imu.index, columns=names), mount=recording.mount)
