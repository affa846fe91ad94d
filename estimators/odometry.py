"""Odometry that knows the line: encoder, gyro and accelerometer against the design track's heading.

(prototype)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from estimators.kernels.odometry import A, S, V, STATES, curve_matched, smooth
from simrail.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.recording import Recording

RATE_HZ = 50.0
PLACES_PER_M = 4.0

@dataclass(frozen=True)
class CurveMatched:
    smoothed: bool = False
    radius_sd: float = 0.01
    start_sd_m: float = 0.05
    lag_sd_m: float = 1.0
    jerk_m2ps5: float = 0.01
    tread_sd: float = 0.002
    tread_length_m: float = 60.0
    turn_sd_m: float = 1.0
    force_m2ps3: float = 3e-5
    push_walk_m2ps5: float = 1e-6
    sway_sd_rad: float = 0.6e-3
    sway_per_curvature_m: float = 0.1
    sway_length_m: float = 6.0
    lag_walk_m: float = 1e-4
    force_per_speed: float = 0.0
    heading_sd_rad: float = 2e-4
    gate: float = 5.0
    lead_sd_m: float = 1.0
    wheel_walk_m: float = 1e-6

    def run(self, recording: Recording):
        imu, sheet = recording.imu, recording.imu_sheet
        block = max(1, round(sheet.rate_hz / RATE_HZ))
        step = block / sheet.rate_hz
        time = imu.index.to_numpy(dtype=np.float64)
        n = len(time) // block
        signals = imu[[*GYRO, ACCEL[0]]].to_numpy(dtype=np.float64)[: n * block].reshape(n, block, 4).mean(axis=1)
        ends = time[block - 1 :: block][:n]
        counts = recording.encoder["pulse_count"].to_numpy()
        at = np.searchsorted(recording.encoder.index.to_numpy(), ends + 1e-9, side="right") - 1
        count = np.ascontiguousarray(counts[np.maximum(at, 0)], dtype=np.float64)
        track = recording.track
        s = np.arange(track.start_m, track.end_m, 1 / PLACES_PER_M)
        frame = track.frame(s)
        table = np.ascontiguousarray(np.column_stack([frame.yaw_rad, frame.rates[:, 2], frame.roll_rad, frame.pitch_rad]))
        enc = recording.encoder_sheet
        pulse = 2 * math.pi * enc.wheel_radius_m / enc.pulses_per_revolution
        model = np.array([self.jerk_m2ps5, self.tread_sd, self.push_walk_m2ps5, sheet.gyro_noise_radpsqrts**2 + 1e-12,
            sheet.gyro_bias_instability_radps*1.08 + 1e-9, 300.0, self.sway_sd_rad, self.sway_per_curvature_m, self.sway_length_m, self.lag_walk_m,
            sheet.accel_noise_mpsqrts**2 + self.force_m2ps3, self.force_per_speed, self.heading_sd_rad, pulse, self.gate, 0.5, self.tread_length_m, self.wheel_walk_m])
        # drift: turn-on + GM: approximate as random constant + GM -> one state, sd turn-on at the start
        x = np.zeros(STATES); x[S] = recording.start_position_m
        f0 = track.frame(np.array([x[S]]))
        x[6] = f0.yaw_rad[0]
        last = recording.odometry['position_m']
        x[9] = recording.mount_position_m[0] * np.sign(last.iloc[-1] - last.iloc[0])
        p = np.diag(np.array([self.start_sd_m, 1e-3, 1e-3, pulse / math.sqrt(12), self.radius_sd,
            math.hypot(sheet.accel_turn_on_bias_mps2/math.sqrt(3), 0.05), 5e-3, sheet.gyro_turn_on_bias_radps + 1e-5, self.sway_sd_rad, self.lag_sd_m, self.tread_sd, self.turn_sd_m, self.lead_sd_m])**2)
        states, cov, slip = np.empty((n, STATES)), np.empty((n, STATES, STATES)), np.empty(n)
        m = n if self.smoothed else 0
        mem = [np.empty((m, STATES)), np.empty((m, STATES, STATES)), np.empty((m, STATES, STATES)), np.empty((m, 4, STATES)), np.empty((m, 4, STATES)), np.empty((m, 8))]
        curve_matched(step, np.ascontiguousarray(signals[:, :3]), np.ascontiguousarray(signals[:, 3]), count, model, recording.gravity_mps2,
            np.array([s[0], PLACES_PER_M]), table, x, p, states, cov, slip, *mem)
        if self.smoothed:
            smooth(*mem, states, cov)
        return ends, states, cov, slip
