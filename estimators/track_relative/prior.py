"""What is known before a ride: start of the state, and sizes of what changes under way.

All comes from the recording's sheets (IMU, encoder, map, drawing) and from the mount's class
(`simrail.estimators.track_relative.noise`); bounds of a sheet are taken for uniform.
"""

import math
from collections.abc import Collection

import numpy as np
from simrail.estimators.odometry.curve_matched import CurveMatchedOdometry, first_speed, rolling_share
from simrail.estimators.odometry.moving_start import ACCELERATION_SD_MPS2
from simrail.estimators.odometry.pointing import chainage_sd, chord_of, lag_of, pointing_of
from simrail.estimators.odometry.scale import scale_of
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.kernel import Noise
from simrail.estimators.track_relative.noise import Motion, slow_m_of

from simrail.core.jit import FloatArray
from simrail.recording.recording import ImuSheet, Recording
from simrail.track.design import Curve, Transition

JERK_M2PS5 = 0.05
"""Intensity of the acceleration's random walk: service traction changes by some 0.2 m/s2 in a second."""

BIAS_TIME_S = 300.0
"""Within which a bias wanders by its instability, where the sheet says nothing else."""

GRAVITY_SD_MPS2 = 1e-3
"""Of the local gravity: by latitude and height it is known to some 0.1 permil."""

STEEPEST = 1.5 * math.sqrt(3.0)
"""Slope at zero of a cubic that leaves the line between its ends by 1 at most, over its range: a train moves
near the zero of its gyros and accelerometers, where a nonlinearity is an error of scale."""

TO_1_E = 2.146193220620583 / math.sqrt(3.0)
"""Lengths of a Matern 3/2 process over which its correlation falls to 1/e: what a map's sheet calls one."""

START_HEADING_SD_RAD = 1e-3
"""Of the map's yaw at its origin."""

LAG_RADIUS_M, ATTACK_LAG_M = 400.0, 0.1
"""A lag stands here for what the odometry knows apart: in a curve of this radius, what a body turns beside
its lag, and the angle of attack by which its wheels carry a lateral force, at 20 to 60 km/h."""

PARTS = {
    "tilt": (at.TILT, at.TILT_RATE),
    "squat": (at.SQUAT,),
    "torsion": (at.TORSION,),
    "lag": (at.LAG,),
    "lead": (at.LEAD,),
    "drift_in_curves": (at.Y_TILT, at.Y_BEND),
    "cant": (at.CANT,),
    "cant_along": (at.CANT_ALONG, at.CANT_ALONG_1),
    "slope": (at.SLOPE,),
    "curve": (at.CURVE,),
    "joints": (at.EVEN, at.ODD),
    "gyro_bias": at.GYRO_BIAS,
    "accel_bias": at.ACCEL_BIAS,
    "gyro_scale": at.GYRO_OF_Z,
    "accel_scale": (*at.ACCEL_OF_X, *at.ACCEL_OF_Y),
}
"""Parts of the state that can be left out, to show what each is for."""


def noise_of(recording: Recording, motion: Motion, without: Collection[str] = ()) -> Noise:
    """Sizes of the processes; 0 for what is left out."""
    errors, sheet, scale = recording.map_errors, recording.imu_sheet, scale_of(recording)
    method, pointing = CurveMatchedOdometry().at_scale(scale), pointing_of(recording, chord_of(recording))
    base = recording.track.rail_base_m
    along = 0.0 if "cant_along" in without else errors.cant_along_sd_m / base
    angles = [motion.roll_sd, motion.pitch_sd, motion.yaw_sd, along]
    lengths = [
        motion.roll_length,
        motion.pitch_length,
        motion.yaw_length,
        errors.cant_along_length_m / TO_1_E,
    ]
    forgotten = {
        "slope": errors.gradient_sd,
        "curve": errors.radius_relative_sd,
        "cant": errors.cant_sd_m / base,
        "joints": errors.place_sd_m,
    }
    kept = {name: 0.0 if name in without else sd for name, sd in forgotten.items()}
    return Noise(
        sd=np.array([*angles, motion.y_sd, motion.z_sd]),
        length=np.array([*lengths, motion.y_length, motion.z_length]),
        sway_hz=motion.sway_hz,
        damping=motion.damping,
        jerk=JERK_M2PS5,
        tread_sd=method.tread_sd * rolling_share(recording),
        tread_length=method.tread_length_m,
        lag_walk=0.0 if "lag" in without else pointing.lag_walk_m,
        gyro_walk=0.0 if "gyro_bias" in without else _walk(sheet, "gyro"),
        accel_walk=0.0 if "accel_bias" in without else _walk(sheet, "accel"),
        forgotten_sd=np.array([kept["slope"], kept["curve"], kept["cant"], kept["joints"], kept["joints"]]),
    )


def _walk(sheet: ImuSheet, sensor: str) -> float:
    """Intensity of a bias's random walk, by its instability and its own random walk."""
    instability, walk = (
        (sheet.gyro_bias_instability_radps, sheet.gyro_random_walk_radpspsqrts)
        if sensor == "gyro"
        else (sheet.accel_bias_instability_mps2, sheet.accel_random_walk_mps2psqrts)
    )
    return 2.0 * instability**2 / BIAS_TIME_S + walk**2


def start_of(
    recording: Recording, motion: Motion, noise: Noise, without: Collection[str] = ()
) -> tuple[FloatArray, FloatArray]:
    """State (52,) and covariance (52, 52) of a train that stands where it is known to stand."""
    x, sd = first_state(recording, motion), np.zeros(at.STATES)
    _body_sds(sd, noise)
    _train_sds(sd, recording, motion)
    _sensor_sds(sd, recording)
    slope, curve, cant, place, _ = noise.forgotten_sd
    sd[at.SLOPE], sd[at.CURVE], sd[at.CANT], sd[at.EVEN], sd[at.ODD] = slope, curve, cant, place, place
    for name in without:
        sd[list(PARTS[name])] = 0.0
    p = np.zeros((at.STATES, at.WIDTH))
    p[np.arange(at.STATES), np.arange(at.STATES)] = sd**2
    if noise.sway_hz == 0.0:
        _slow_roll(p, noise, slow_m_of(recording))
    for state in at.TRIPLES:
        # A Matern 5/2 process and its second derivative: minus the variance of the first.
        p[state, state + 2] = p[state + 2, state] = -(sd[state + 1] ** 2)
    return x, p


def _slow_roll(p: FloatArray, noise: Noise, slow_m: float) -> None:
    """Covariances of ROLL_SLOW with ROLL (Matern 3/2) and its derivative, of a way without beginning.

    L(u) = integral of a exp(-a w) M(u - w): its covariance with M is that integral of M's, and so is its own.
    """
    a, rate, square = 1.0 / slow_m, math.sqrt(3.0) / noise.length[0], noise.sd[0] ** 2
    together = square * a * (1.0 / (a + rate) + rate / (a + rate) ** 2)
    rising = -square * a * (rate / (a + rate)) ** 2
    p[at.ROLL_SLOW, at.ROLL_SLOW] = together
    p[at.ROLL_SLOW, at.ROLL] = p[at.ROLL, at.ROLL_SLOW] = together
    p[at.ROLL_SLOW, at.ROLL_RATE] = p[at.ROLL_RATE, at.ROLL_SLOW] = rising


def first_state(recording: Recording, motion: Motion) -> FloatArray:
    """State (52,) before anything is measured."""
    chord, x = chord_of(recording), np.zeros(at.STATES)
    x[at.S], x[at.TILT] = recording.start_position_m, motion.tilt
    x[at.V] = first_speed(recording)[0]
    if chord is not None:
        x[at.LAG] = lag_of(chord)[0]
        if chord.half_m > 0.0 and not chord.weights:
            # A mount on a straight body is carried across the inside of a curve: its versine.
            x[at.Y_BEND] = 0.5 * (chord.half_m**2 - (recording.mount_position_m[0] - chord.centre_m) ** 2)
    return x


def _body_sds(sd: FloatArray, noise: Noise) -> None:
    """Stationary standard deviations of what moves in the track."""
    for block, state in enumerate(at.PAIRS):
        sways = block == 0 and noise.sway_hz > 0.0
        rate = 2.0 * math.pi * noise.sway_hz if sways else math.sqrt(3.0) / noise.length[block]
        sd[state], sd[state + 1] = noise.sd[block], noise.sd[block] * rate
    for block, state in enumerate(at.TRIPLES, start=len(at.PAIRS)):
        rate = math.sqrt(5.0) / noise.length[block]
        sd[state], sd[state + 1] = noise.sd[block], noise.sd[block] * rate / math.sqrt(3.0)
        sd[state + 2] = noise.sd[block] * rate**2


def _train_sds(sd: FloatArray, recording: Recording, motion: Motion) -> None:
    """Place, wheel, heading, and how the body follows cant, curves and traction."""
    errors, wheel, scale = recording.map_errors, recording.encoder_sheet, scale_of(recording)
    method, chord = CurveMatchedOdometry().at_scale(scale), chord_of(recording)
    pointing = pointing_of(recording, chord)
    sd[at.S] = math.hypot(method.start_sd_m, chainage_sd(recording, recording.start_position_m))
    speed, speed_sd = first_speed(recording)
    sd[at.V], sd[at.A] = speed_sd, 1e-2 if speed == 0.0 else ACCELERATION_SD_MPS2
    scaled = recording.odometer_sheet if wheel is None else wheel
    if wheel is not None:
        sd[at.WAY] = wheel.pulse_m
        share = rolling_share(recording)
        sd[at.TREAD] = share * method.tread_sd
        sd[at.LEFT] = sd[at.RIGHT] = share * method.flange_sd
    if scaled is not None:
        sd[at.SCALE] = math.hypot(scaled.radius_relative_sd, errors.chainage_scale_sd)
    sd[at.HEADING] = heading_sd(recording)
    sd[at.TILT], sd[at.SQUAT] = motion.tilt_sd, motion.squat_sd
    sd[at.TORSION], sd[at.TILT_RATE] = motion.torsion_sd, motion.tilt_rate_sd
    sd[at.Y_TILT], sd[at.Y_BEND] = motion.y_tilt_sd, motion.y_bend_sd
    sd[at.LAG] = math.hypot(
        pointing.lag_sd_m,
        scale * LAG_RADIUS_M * pointing.turn_sd_rad,
        scale * ATTACK_LAG_M if pointing.attacks else 0.0,
        0.0 if chord is None else lag_of(chord)[1],
    )
    sd[at.LEAD] = pointing.lead_sd_m


def _sensor_sds(sd: FloatArray, recording: Recording) -> None:
    """Biases, scales and axes of the IMU, of its sheet's bounds."""
    sheet, g, uniform = recording.imu_sheet, recording.gravity_mps2, 1.0 / math.sqrt(3.0)
    turn = sheet.package_misalignment_rad * uniform
    gyro = math.hypot(sheet.gyro_scale_error, STEEPEST * sheet.gyro_nonlinearity) * uniform
    accel = math.hypot(sheet.accel_scale_error, STEEPEST * sheet.accel_nonlinearity) * uniform
    # A bias that wanders has wandered before the ride as well.
    gyro_bias = math.hypot(sheet.gyro_turn_on_bias_radps * uniform, sheet.gyro_bias_instability_radps)
    accel_bias = math.hypot(sheet.accel_turn_on_bias_mps2 * uniform, sheet.accel_bias_instability_mps2)
    for i in range(3):
        sd[at.GYRO_BIAS[i]] = gyro_bias
        sd[at.ACCEL_BIAS[i]] = (
            math.hypot(accel_bias, g * accel, GRAVITY_SD_MPS2) if i == 2 else math.hypot(accel_bias, g * turn)
        )
        sd[at.GYRO_OF_Z[i]] = gyro if i == 2 else turn
        sd[at.ACCEL_OF_X[i]] = accel if i == 0 else turn
        sd[at.ACCEL_OF_Y[i]] = accel if i == 1 else turn


def heading_sd(recording: Recording) -> float:
    """Of the map's yaw where the ride begins: that of all curves from the map's origin on.

    A transition turns by half its length at the curvature of either end: it belongs to its curve.
    """
    track, total, place = recording.track, 0.0, recording.track.start_m
    around = (None, *track.elements, None)
    for before, element, behind in zip(around, track.elements, around[2:], strict=False):
        if place >= recording.start_position_m:
            break
        if isinstance(element, Curve):
            ramps = [side.length_m for side in (before, behind) if isinstance(side, Transition)]
            total += ((element.length_m + 0.5 * sum(ramps)) / element.radius_m) ** 2
        place += element.length_m
    return math.hypot(START_HEADING_SD_RAD, recording.map_errors.radius_relative_sd * math.sqrt(total))
