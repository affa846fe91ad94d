"""Linear model of a ride for the kernels of the track-relative smoother: what they take of a recording.

The IMU is averaged over steps of 1/`rate_hz`; all is linearised about a trajectory (`Around`): at first that of an
odometry with the body at rest in the map's track, then the smoothed one. The odometry is that only: its place and
speed are no measurements.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.odometry.curve_matched import (
    CurveMatchedOdometry,
    chord_of,
    pointing_of,
)
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.dual import table_of
from simrail.estimators.track_relative.kernel import FLOWS, ROWS, Model, Noise
from simrail.estimators.track_relative.line import Ground, ground_at
from simrail.estimators.track_relative.measurement import Around, duals, shown, told
from simrail.estimators.track_relative.noise import AT_MPS, Motion

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.design import Curve

SATURATION_RADIUS_M = 1000.0
VERTICAL_LENGTH_M = 7.0
REST_SD_MPS = 1e-3
JERK = 0.05
WHEEL_WALK_M = 2e-6
TREAD_SD, TREAD_LENGTH_M, FLANGE_SD = 0.002, 25.0, 0.008


class Steps(NamedTuple):
    """A recording in steps.

    Attributes
    ----------
    time_s : ndarray (n,)
        Middles of the steps.
    dt : float
    signals : ndarray (n, 6)
        Mean rates and forces.
    way : ndarray (n,)
        That the wheel shows, m.
    place, speed, acceleration : ndarray (n,)
        Of the odometry.
    slipping, resting : ndarray (n,) of bool
    """

    time_s: FloatArray
    dt: float
    signals: FloatArray
    way: FloatArray
    place: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    slipping: np.ndarray
    resting: np.ndarray


def steps_of(recording: Recording, rate_hz: float, *, smoothed: bool) -> Steps:
    """Bring a recording to steps; what is left over at its end is dropped."""
    sheet = recording.imu_sheet
    block = max(1, round(sheet.rate_hz / rate_hz))
    time = recording.imu.index.to_numpy(dtype=np.float64)
    n = len(time) // block

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(values[: n * block].reshape(n, block, -1).mean(axis=1))

    odometry = CurveMatchedOdometry(smoothed=smoothed)
    trace = odometry.trace(recording)
    along = odometry._at_imu_times(trace, recording)  # noqa: SLF001
    values = mean(along[["position_m", "speed_mps", "acceleration_mps2"]].to_numpy())
    assert recording.encoder is not None and recording.encoder_sheet is not None
    read = np.searchsorted(recording.encoder.index.to_numpy(), time + 1e-9, side="right") - 1
    counts = recording.encoder["pulse_count"].to_numpy(dtype=np.float64)
    way = (counts[np.maximum(read, 0)] - counts[0]) * recording.encoder_sheet.pulse_m
    middle = mean(time[:, None])[:, 0]
    near = np.clip(np.searchsorted(trace.time_s, middle), 0, len(trace.time_s) - 1)
    return Steps(
        time_s=middle,
        dt=block / sheet.rate_hz,
        signals=mean(recording.imu[[*GYRO, *ACCEL]].to_numpy(dtype=np.float64)),
        way=mean(way[:, None])[:, 0],
        place=values[:, 0],
        speed=np.where(trace.resting[near], 0.0, values[:, 1]),
        acceleration=np.where(trace.resting[near], 0.0, values[:, 2]),
        slipping=trace.slipping[near],
        resting=trace.resting[near],
    )


def first_guess(steps: Steps, motion: Motion, lag_m: float, y_bend: float) -> FloatArray:
    """States (n, 49) with the body at rest in the map's track."""
    x = np.zeros((len(steps.time_s), at.STATES))
    x[:, at.S], x[:, at.V], x[:, at.A] = steps.place, steps.speed, steps.acceleration
    x[:, at.TILT], x[:, at.LAG], x[:, at.Y_BEND] = motion.tilt, lag_m, y_bend
    return x


def model_of(
    recording: Recording, steps: Steps, motion: Motion, chord: Chord | None, states: FloatArray
) -> Model:
    """Linearise about states (n, 49)."""
    n = len(steps.time_s)
    v = states[:, at.V]
    _, lateral, height = recording.mount_position_m
    around = Around(
        states=states,
        jerk=_jerk(states[:, at.A], steps.dt),
        sense=_sense(v),
        nominal=(lateral, height),
        gravity=recording.gravity_mps2,
        in_time=motion.sway_hz > 0.0,
    )
    ground = ground_at(recording, chord, states[:, at.S])
    x = duals(states)
    rows = [*shown(x, ground, around), x[at.WAY], x[at.V]]
    values, columns, coefficients = table_of(rows, n)
    said_values, said_columns, said = table_of(told(x, ground, around), n)
    # e = z - h(x0) - H (x - x0) = (z - h(x0) + H x0) - H x
    constant = np.einsum("nmw,nmw->nm", coefficients, states[:, columns])
    measured = np.column_stack([steps.signals, steps.way, np.zeros(n)]) - values + constant
    start, covariance = start_of(recording, steps, motion, chord)
    return Model(
        columns=columns,
        coefficients=coefficients,
        measured=np.ascontiguousarray(measured),
        variances=_variances(recording, steps, motion, v),
        flows=_flows(recording, steps, ground, v, around.sense),
        said_columns=said_columns,
        said=said,
        start=start,
        start_covariance=covariance,
        dt=steps.dt,
        noise=noise_of(recording, motion),
    )


def noise_of(recording: Recording, motion: Motion) -> Noise:
    """Processes: those of the mount's class, the map's sheet and the IMU's."""
    errors, sheet = recording.map_errors, recording.imu_sheet
    base = recording.track.rail_base_m
    along = max(errors.cant_along_sd_m / base, 1e-6)
    sd = [motion.roll_sd, motion.pitch_sd, motion.yaw_sd, along, motion.y_sd, motion.z_sd]
    length = [motion.roll_length, motion.pitch_length, motion.yaw_length, errors.cant_along_length_m]
    return Noise(
        sd=np.array(sd),
        length=np.array([*length, motion.y_length, motion.z_length]),
        sway_hz=motion.sway_hz,
        damping=motion.damping,
        jerk=JERK,
        wheel_walk=WHEEL_WALK_M,
        tread_sd=TREAD_SD,
        tread_length=TREAD_LENGTH_M,
        lag_walk=pointing_of(recording, chord_of(recording)).lag_walk_m,
        gyro_walk=2.0 * sheet.gyro_bias_instability_radps**2 / 300.0 + 1e-16,
        accel_walk=2.0 * sheet.accel_bias_instability_mps2**2 / 300.0 + 1e-14,
        forgotten_sd=_map_sds(recording),
    )


def _map_sds(recording: Recording) -> FloatArray:
    """Of SLOPE, CURVE, CANT, EVEN and ODD."""
    errors = recording.map_errors
    cant = errors.cant_sd_m / recording.track.rail_base_m
    place = errors.place_sd_m
    return np.maximum([errors.gradient_sd, errors.radius_relative_sd, cant, place, place], 1e-9)


def _variances(recording: Recording, steps: Steps, motion: Motion, v: FloatArray) -> FloatArray:
    """Of the measurements (n, 8); infinite where one is not made."""
    sheet, rate = recording.imu_sheet, 1.0 / steps.dt
    shakes = (np.abs(v) / AT_MPS) ** 3
    gyro = sheet.gyro_noise_radpsqrts**2 * rate
    accel = sheet.accel_noise_mpsqrts**2 * rate
    floor = 1e-5  # rad/s and 1e-3 m/s2, of a mount that is not quite stiff: an ideal sensor's filter needs one
    columns = [gyro + floor**2 + motion.gyro**2 * shakes] * 3
    columns += [accel + (100.0 * floor) ** 2 + k**2 * shakes for k in motion.accel]
    assert recording.encoder_sheet is not None
    pulse = recording.encoder_sheet.pulse_m
    wheel = np.where(steps.slipping, np.inf, pulse**2 / 12.0)
    rest = np.where(steps.resting, REST_SD_MPS**2, np.inf)
    return np.ascontiguousarray(np.column_stack([*columns, wheel, rest]))


def _flows(
    recording: Recording, steps: Steps, ground: Ground, v: FloatArray, sense: FloatArray
) -> FloatArray:
    """`simrail.estimators.track_relative.kernel.FLOWS` of each step, over the step that leads there."""
    n = len(v)
    out = np.zeros((n, FLOWS))
    mean = 0.5 * (v + np.concatenate([v[:1], v[:-1]]))
    way = mean * steps.dt
    out[:, 0], out[:, 1] = np.abs(way), way
    h = ground.k[2].value
    out[:, 2], out[:, 3], out[:, 4] = way * h, -way * ground.even, -way * ground.odd
    bent = SATURATION_RADIUS_M * h
    flank = bent / np.sqrt(1.0 + bent * bent)
    out[:, 5], out[:, 6] = np.maximum(flank, 0.0), np.maximum(-flank, 0.0)
    out[:, 7] = np.where(ground.vertical, np.exp(-np.abs(way) / VERTICAL_LENGTH_M), 1.0)
    out[:, 8:] = 1.0
    curve, element = np.diff(ground.curve, prepend=ground.curve[0]), np.diff(ground.element, prepend=ground.element[0])
    out[curve != 0, 8] = out[curve != 0, 9] = 0.0
    odd_below = ground.element % 2.0 == 1.0
    ahead, back, far = element > 0, element < 0, np.abs(element) > 1
    forget_even = ((ahead | far) & odd_below & (element != 0)) | ((back | far) & ~odd_below & (element != 0))
    forget_odd = ((ahead | far) & ~odd_below & (element != 0)) | ((back | far) & odd_below & (element != 0))
    out[forget_even, 10] = 0.0
    out[forget_odd, 11] = 0.0
    return out


def start_of(
    recording: Recording, steps: Steps, motion: Motion, chord: Chord | None
) -> tuple[FloatArray, FloatArray]:
    """State and covariance of a train that stands where it is known to stand."""
    sheet, errors, g = recording.imu_sheet, recording.map_errors, recording.gravity_mps2
    noise = noise_of(recording, motion)
    pointing = pointing_of(recording, chord)
    x = first_guess(steps, motion, lag_of(chord), y_bend_of(recording, chord))[0]
    x[at.S], x[at.V], x[at.A] = recording.start_position_m, 0.0, 0.0
    sd = np.zeros(at.STATES)
    root3, root5 = math.sqrt(3.0), math.sqrt(5.0)
    for b, state in enumerate(at.PAIRS):
        rate = 2.0 * math.pi * noise.sway_hz if b == 0 and noise.sway_hz > 0.0 else root3 / noise.length[b]
        sd[state], sd[state + 1] = noise.sd[b], noise.sd[b] * rate
    for b, state in enumerate(at.TRIPLES, start=4):
        rate = root5 / noise.length[b]
        sd[state], sd[state + 1], sd[state + 2] = noise.sd[b] * np.array([1.0, rate / root3, rate**2])
    sd[at.S] = math.hypot(0.05, errors.chainage_offset_sd_m)
    sd[at.V], sd[at.A] = REST_SD_MPS, 1e-2
    assert recording.encoder_sheet is not None
    sd[at.WAY] = recording.encoder_sheet.pulse_m
    sd[at.SCALE] = recording.encoder_sheet.radius_relative_sd
    sd[at.TREAD], sd[at.LEFT], sd[at.RIGHT] = TREAD_SD, FLANGE_SD, FLANGE_SD
    sd[at.HEADING] = heading_sd(recording)
    slope, curve, cant, place, _ = noise.forgotten_sd
    sd[at.SLOPE], sd[at.CURVE], sd[at.CANT], sd[at.EVEN], sd[at.ODD] = slope, curve, cant, place, place
    sd[at.TILT], sd[at.SQUAT], sd[at.Y_TILT], sd[at.Y_BEND] = (
        motion.tilt_sd,
        motion.squat_sd,
        motion.y_tilt_sd,
        motion.y_bend_sd,
    )
    sd[at.LAG] = math.hypot(pointing.lag_sd_m, 0.0 if chord is None else chord.sd_m)
    sd[at.LEAD] = pointing.lead_sd_m
    bias = sheet.package_misalignment_rad / root3
    for i in range(3):
        sd[at.GYRO_BIAS[i]] = sheet.gyro_turn_on_bias_radps / root3 + 1e-6
        tilted = g * bias if i < 2 else g * sheet.accel_scale_error / root3
        sd[at.ACCEL_BIAS[i]] = math.hypot(sheet.accel_turn_on_bias_mps2 / root3, tilted) + 1e-5
        scale = sheet.gyro_scale_error / root3
        sd[at.GYRO_OF_Z[i]] = scale if i == 2 else math.hypot(bias, sheet.package_misalignment_rad / root3)
        accel_scale = sheet.accel_scale_error / root3
        across = math.hypot(bias, sheet.package_misalignment_rad / root3)
        sd[at.ACCEL_OF_X[i]] = accel_scale if i == 0 else across
        sd[at.ACCEL_OF_Y[i]] = accel_scale if i == 1 else across
    p = np.zeros((at.STATES, at.WIDTH))
    p[np.arange(at.STATES), np.arange(at.STATES)] = sd**2
    for b, state in enumerate(at.TRIPLES, start=4):
        rate = root5 / noise.length[b]
        p[state, state + 2] = p[state + 2, state] = -((noise.sd[b] * rate) ** 2) / 3.0
    return x, p


def heading_sd(recording: Recording) -> float:
    """Of the map's yaw at the start: the curves between its origin and there."""
    track, total, place = recording.track, 0.0, recording.track.start_m
    for element in track.elements:
        if place >= recording.start_position_m:
            break
        if isinstance(element, Curve):
            total += (element.length_m / element.radius_m) ** 2
        place += element.length_m
    return math.hypot(1e-3, recording.map_errors.radius_relative_sd * math.sqrt(total))


def lag_of(chord: Chord | None) -> float:
    """How far behind its chord the body is taken to point, m."""
    return 0.0 if chord is None else min(max(chord.play_m, -1.0), 1.0)


def y_bend_of(recording: Recording, chord: Chord | None) -> float:
    """Lateral place per curvature of a mount that a chord carries across the inside of a curve, m2."""
    if chord is None or chord.half_m == 0.0 or chord.weights:
        return 0.0
    return 0.5 * (chord.half_m**2 - (recording.mount_position_m[0] - chord.centre_m) ** 2)


def _sense(v: FloatArray) -> FloatArray:
    """Direction of travel, 1 or -1: held where the train stands, and the first one before it moves."""
    moves = np.abs(v) > 0.2
    last = np.maximum.accumulate(np.where(moves, np.arange(len(v)), -1))
    first = v[np.argmax(moves)] if moves.any() else 1.0
    return np.where(np.where(last >= 0, v[np.maximum(last, 0)], first) < 0.0, -1.0, 1.0)


def _jerk(a: FloatArray, dt: float) -> FloatArray:
    """Backward difference over a second."""
    back = max(1, round(1.0 / dt))
    before = np.concatenate([np.full(back, a[0]), a[:-back]]) if len(a) > back else np.full(len(a), a[0])
    return (a - before) / (back * dt)


