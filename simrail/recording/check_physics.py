"""Can it be true? Units, axes and signs of a recording, judged by what every train does.

A wrong unit or a device upside down leaves a file that looks sound. It shows against what is known: gravity,
that a train turns slowly, the curves of the design track, and the odometry's setting off and braking. Each
test has a limit far from what a sound recording does and far from what the fault does. Faults of form
(columns, stamps, numbers) are judged by `simrail.recording.check_form`.
"""

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.exchanged import weigh_exchange
from simrail.recording.evidence.judge import Evidence, error_of, refuse_wrong
from simrail.recording.evidence.slopes import SURE, Slope, means, slope
from simrail.recording.evidence.way import way_of
from simrail.recording.recording import Recording, imus
from simrail.recording.signals import FORCES
from simrail.recording.standstill import at_rest_initially

GRAVITY_SHARE = 0.05
"""At rest an accelerometer shows gravity to 5 %, beside its bias: units differ by 9.8 times and more."""

UPRIGHT = 0.9
"""Share of gravity along Z at least: cosine of 26 deg, beyond any cant and gradient."""

MEAN_RATE_RADPS, MEAN_OVER_S = 0.5, 10.0
"""No train turns by 290 deg in 10 s; in deg/s a curve of 500 m at 50 km/h already shows 1.6."""

OFFSET_RADPS, OFFSET_SHEETS = 0.1, 3.0
"""What a gyro shows at rest at most: 6 deg/s, beside so many turn-on biases of its sheet."""

LEAST_TURN_RAD = 0.1
"""Turn of the track on a ride, there and back counted, from which on the gyro is held against it."""

LEAST_SPEED_MPS, LEAST_READINGS = 2.0, 10.0
"""Speed, and readings of a way, from which on counts are held against those of each reading."""

LEAST_WAY_M, LEAST_VARIANCE_M2PS4 = 20.0, 0.01
"""Way, and variance of the acceleration, from which on the accelerometer is held against the odometry."""

STANDING_MPS, STANDING_S = 0.05, 5
"""Slower than this a train stands; and means over so many seconds of it are held against each other."""

STANDING_RADPS = 0.02
"""No gyro of a train that stands wanders by a degree a second; in a curve of 500 m it turns so at 36 km/h."""

BEYOND_TRACK_M = 20.0
"""How far an odometry may be off the end of the track by its own error."""


def check_plausible(recording: Recording) -> Evidence:
    """Refuse a recording whose units, axes, factors, place or clocks cannot be those that are claimed.

    The specific force is judged at rest, where the ride begins with a second of it, else by its median; of
    both IMUs, where there are two. Then the ride's curves, its setting off and braking, and gravity are
    weighed together (`simrail.recording.evidence.devices`). What that cannot explain is held against wide
    limits: the gyro's Z against the track's yaw rate, the accelerometer's X and Y against the odometry's
    acceleration. A ride on the straight at constant speed says nothing of either, nor does one without
    odometry or without a map.

    Returns
    -------
    Evidence
        What was found; what in it is likely wrong, is for the caller to tell.

    Raises
    ------
    InputError
        If gravity has another size or direction; if the train turns faster than a train; if it leaves the
        track; if a figure is surely wrong; if the gyro does not turn with the track: by none of its curves,
        the other way, or many times as much; if the accelerometer does not push when the train gains speed,
        or sideways, or backwards.
    """
    for table, alone in imus(recording):
        _check_gravity(alone, table)
        _check_offset(alone, table)
        _check_turning(alone, table)
    _check_counted(recording)
    _check_standing(recording)
    evidence = weigh_all(recording)
    refuse_wrong(evidence)
    if not recording.track.is_map:
        return evidence
    if recording.odometry is not None:
        _check_motion(recording, recording.odometry)
    else:
        _check_on_track(recording, recording.start_position_m, field="start_position_m")
    return evidence


def _check_gravity(recording: Recording, table: str) -> None:
    resting = at_rest_initially(recording)
    force = recording.imu[list(ACCEL)].to_numpy()
    if resting >= recording.imu_sheet.rate_hz:
        found, when = force[:resting].mean(axis=0), "at rest"
    else:
        found, when = np.median(force, axis=0), "in the median of the ride"
    size, gravity = float(np.linalg.norm(found)), recording.gravity_mps2
    slack = GRAVITY_SHARE * gravity + recording.imu_sheet.accel_turn_on_bias_mps2
    shown = f"{size:.4g} m/s2 {when}"
    if abs(size - gravity) > slack:
        remedy = (
            f"it is {size / gravity:.3g} times gravity: set units.accel, or mend imu.scale.accel, of "
            "all columns or of Z alone"
        )
        if size < slack:
            remedy = (
                "gravity has been taken off (a phone's linear acceleration): log the accelerometer as it is, "
                "with gravity; or these are columns of another sensor"
            )
        # What the unit would have to be, from the size alone: every unit as read in every other.
        for unit, (multiply, divide) in FORCES.items():
            for claimed, (by, over) in FORCES.items():
                if unit != claimed and abs(size * (multiply / divide) / (by / over) - gravity) < slack:
                    remedy = f'the values look like {unit}, given as {claimed}: set units.accel = "{unit}"'
        raise InputError(
            "is not as large as gravity",
            field=f"{table}.accel",
            value=shown,
            limit=f"{gravity:g} m/s2 to {slack:.2g} m/s2",
            remedy=remedy,
        )
    if found[2] < -UPRIGHT * size:
        raise InputError(
            "points down: at rest an accelerometer shows +g on Z, which points up",
            field=f"{table}.accel",
            value=f"{found[2]:.4g} m/s2 on Z {when}",
            limit=f"> {UPRIGHT * gravity:.3g} m/s2",
            remedy='for a device upside down set axes = ["x", "-y", "-z"]; for a logger that writes gravity '
            'instead of specific force set a negative unit, e.g. units.accel = "-g"',
        )
    if found[2] < UPRIGHT * size:
        axis = int(np.argmax(np.abs(found)))
        exchanged = weigh_exchange(recording)
        if exchanged is not None:  # only the columns of the accelerometer: the gyro stands upright
            raise error_of(exchanged.findings[-1])
        raise InputError(
            f"gravity lies along {'-' if found[axis] < 0 else ''}{'XYZ'[axis]} of the body, not Z",
            field=f"{table}.axes",
            value=[round(float(part), 3) for part in found],
            limit=f"> {UPRIGHT * gravity:.3g} m/s2 on Z {when}",
            remedy="name the axes of the device that point forward, left and up, or its mounting angles",
        )


def _check_offset(recording: Recording, table: str) -> None:
    """Refuse a gyro that shows at rest, or all the time about X and Y, what no gyro of its sheet does."""
    resting = at_rest_initially(recording)
    is_resting = resting >= recording.imu_sheet.rate_hz
    limit = OFFSET_RADPS + OFFSET_SHEETS * recording.imu_sheet.gyro_turn_on_bias_radps
    when = "at rest" if is_resting else "in the median of the ride"
    for name in GYRO if is_resting else GYRO[:2]:
        values = recording.imu[name].to_numpy()
        found = float(values[:resting].mean() if is_resting else np.median(values))
        if abs(found) > limit:
            raise InputError(
                f"shows a turn {when}: that is the column of another sensor, or an offset that was never "
                "taken off",
                field=f"{table}.{name}",
                value=f"{found:.3g} rad/s",
                limit=f"{limit:.2g} rad/s, by its sheet",
                remedy="mend columns.gyro, or take the offset off; or give the turn-on bias in its sheet",
            )


def _check_turning(recording: Recording, table: str) -> None:
    rate = recording.imu_sheet.rate_hz
    window = max(1, min(round(MEAN_OVER_S * rate), len(recording.imu) - 1))
    for name in GYRO:
        turned = np.concatenate([[0.0], np.cumsum(recording.imu[name].to_numpy())]) / rate
        mean = (turned[window:] - turned[:-window]) * rate / window
        worst = int(np.argmax(np.abs(mean)))
        if abs(mean[worst]) > MEAN_RATE_RADPS:
            raise InputError(
                f"turns faster than a train does, in the mean over {window / rate:.3g} s "
                f"from time_s = {float(recording.imu.index[worst]):.6g}",
                field=f"{table}.{name}",
                value=float(f"{mean[worst]:.4g}"),
                limit=f"{MEAN_RATE_RADPS:g} rad/s",
                remedy='the values look like degrees: set units.gyro = "deg/s"',
            )


def _check_standing(recording: Recording) -> None:
    """Refuse a way that stands still while the train turns: its counter has stopped."""
    way = way_of(recording)
    if way is None:
        return
    count, time = max(1, round(recording.imu_sheet.rate_hz)), recording.imu.index.to_numpy(dtype=np.float64)
    moves = means(np.abs(np.interp(time, way.time_s, way.speed_mps)), count) > STANDING_MPS
    near = np.convolve(moves, np.ones(min(5, len(moves))), mode="same") > 0.5
    turning = means(recording.imu[GYRO[2]].to_numpy(), count)[~near]
    if len(turning) < 2 * STANDING_S:
        return
    spread = float(np.ptp(means(turning, STANDING_S)))
    limit = STANDING_RADPS + 12.0 * recording.imu_sheet.gyro_noise_radpsqrts / np.sqrt(STANDING_S)
    if spread > limit:
        raise InputError(
            f"stands still while the train turns: the {way.device} has stopped",
            field=way.device,
            value=f"{np.degrees(spread):.2g} deg/s of turn while it stands",
            limit=f"{np.degrees(limit):.2g} deg/s, as a gyro may wander",
            remedy="cut the recording where it stops, or mend its sensor",
        )


def _check_counted(recording: Recording) -> None:
    """Refuse counts that are those of each reading, not since the start: they rise and fall with the speed.

    Told by the push: what they would be as a speed changes as the accelerometer says, and as a way they are
    next to none.
    """
    encoder, sheet = recording.encoder, recording.encoder_sheet
    if encoder is None or sheet is None or len(encoder) < 2:
        return
    count = encoder["pulse_count"].to_numpy(dtype=np.float64)
    stamps = encoder.index.to_numpy(dtype=np.float64)
    step_s = float(stamps[-1] - stamps[0]) / (len(stamps) - 1)
    speed, way_m = count * sheet.pulse_m / step_s, float(np.ptp(count)) * sheet.pulse_m
    went_m = abs(float(speed.sum())) * step_s
    if np.ptp(speed) < LEAST_SPEED_MPS or went_m < LEAST_WAY_M or way_m > went_m / LEAST_READINGS:
        return
    time = recording.imu.index.to_numpy(dtype=np.float64)
    seconds = max(1, round(recording.imu_sheet.rate_hz))
    width = max(1, round(1.0 / step_s))
    smooth = np.convolve(speed, np.ones(width) / width, mode="same")
    push = np.gradient(np.interp(time, stamps, smooth), 1.0 / recording.imu_sheet.rate_hz)
    expected = means(push, seconds)
    found = slope(means(recording.imu[ACCEL[0]].to_numpy(), seconds), expected)
    if np.var(expected) > LEAST_VARIANCE_M2PS4 and abs(found.value) > max(0.5, SURE * found.sd):
        raise InputError(
            "rises and falls with the speed: it holds what was counted in each reading, not since the start",
            field="encoder.count",
            value=f"{int(count.min())} to {int(count.max())}, {way_m:.3g} m of way; summed up {went_m:.4g} m",
            limit="counts since the start",
            remedy="set per_reading = true in [encoder]",
        )


def _check_motion(recording: Recording, odometry: pd.DataFrame) -> None:
    """Hold gyro and accelerometer against what track and odometry say, in means over a second."""
    position, speed = odometry["position_m"].to_numpy(), odometry["speed_mps"].to_numpy()
    for place in (position.min(), position.max()):
        _check_on_track(recording, float(place), field="odometry.position_m")
    seconds = max(1, round(recording.imu_sheet.rate_hz))
    frame = recording.track.frame_extended(means(position, seconds))
    bend = frame.rates[:, 2] * means(speed, seconds)
    if np.abs(bend).sum() > LEAST_TURN_RAD:
        _judge_turn(recording, slope(means(recording.imu[GYRO[2]].to_numpy(), seconds), bend))
    acceleration = odometry["acceleration_mps2"].to_numpy()
    along = means(acceleration, seconds) - recording.gravity_mps2 * np.sin(frame.pitch_rad)
    # A noisy regressor flattens the line: only an acceleration that the odometry knows is one to hold to.
    noise = float(np.mean(odometry["acceleration_sd_mps2"].to_numpy() ** 2))
    if np.ptp(position) > LEAST_WAY_M and np.var(along) > max(2.0 * noise, LEAST_VARIANCE_M2PS4):
        x, y = (slope(means(recording.imu[name].to_numpy(), seconds), along) for name in ACCEL[:2])
        _judge_push(x, y)


def _check_on_track(recording: Recording, place: float, *, field: str) -> None:
    track = recording.track
    if not track.start_m - BEYOND_TRACK_M <= place <= track.end_m + BEYOND_TRACK_M:
        raise InputError(
            f"the ride leaves track {track.name!r}",
            field=field,
            value=round(place, 2),
            limit=f"{track.start_m:g} to {track.end_m:g} m",
            remedy="mend start_position_m or the direction (reverse = true), or lengthen the track",
        )


def _judge_turn(recording: Recording, found: Slope) -> None:
    if 0.2 < found.value < 5.0 or abs(found.value - 1.0) < SURE * found.sd:
        return
    if found.value <= -0.2:
        problem = "turns against the curves of the track"
        remedy = (
            "mend the axes; or the direction: a train that ran towards smaller s has falling pulse counts "
            "(reverse = true)"
        )
    elif found.value < 0.2:
        problem = "does not turn with the curves of the track"
        remedy = "mend units.gyro (rad/s?), the axes, start_position_m, or the track"
    else:
        problem = "turns many times as much as the track"
        remedy = 'mend units.gyro: the values look like "deg/s"'
    raise InputError(
        problem,
        field=f"imu.{GYRO[2]}",
        value=f"{found.value:.3g} times the curvature of {recording.track.name!r} times speed",
        limit="about 1",
        remedy=remedy,
    )


def _judge_push(x: Slope, y: Slope) -> None:
    if x.value > 0.4 or 1.0 - x.value < SURE * x.sd:
        return
    sideways = abs(y.value) > max(abs(x.value), 0.4)
    if x.value < -0.4 and not sideways:
        problem = "pushes backwards when the train gains speed"
        remedy = (
            'a device that looks backwards has axes = ["-x", "-y", "z"]; a train that ran towards smaller s '
            "has falling pulse counts (reverse = true)"
        )
    elif sideways:
        axes = '["y", "-x", "z"]' if y.value > 0.0 else '["-y", "x", "z"]'
        problem, remedy = "pushes sideways when the train gains speed", f"turn the axes as by axes = {axes}"
    else:
        problem, remedy = "does not push when the train gains speed", "mend the axes, or the odometry"
    raise InputError(
        problem,
        field=f"imu.{ACCEL[0]}",
        value=f"{x.value:.2g} times the acceleration of the odometry along X, {y.value:.2g} along Y",
        limit="about 1, and 0",
        remedy=remedy,
    )
