"""How far from its nominal value a figure of a sound ride may be, besides what its fit leaves open."""

import math

import numpy as np

from simrail.recording.evidence.finding import LIKELY
from simrail.recording.evidence.fit import Fit
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    CUTS,
    GAINS,
    GYRO_Z,
    INDEX,
    LATES,
    PACE,
    RAMPS,
    SLOW,
    THEN,
    TURNS,
    Ride,
    motion,
    start_values,
)

CLOCK_SD_S, CLOCK_SD_M = 0.1, 0.7
"""Of a sound IMU, beside half an interval of its samples: what suspensions do to the turns of a body and to
its push (bodies of six vehicles have up to 0.3 s), and a way, for the joints of a map and where it turns."""

GAIN_SD = 0.02
"""Relative, of one axis: what sway and the joints of the rails leave of a slope."""

AHEAD_SHARE = 0.5
"""Of the way from the middle of a body to its IMU: a body turns as at its middle, wherever its device is."""

RAMP_SD_RADPS, RAMP_SD_MPS2, CUT_SD_RADPS = 2e-3, 0.05, 0.01
"""Of an offset, over a ride, beside what its sheet calls instability: warming up; and of the corner of a
high-pass: one of 100 s."""

TURN_SD_RAD = math.radians(0.5)
"""Of the gyro against the accelerometer, beside the package: what cant that is wrong, and a body that leans
and squats, leave of a roll or a pitch."""

THEN_SD = {"then_wheel": 0.01, "then_offset": 0.0}
THEN_SD |= dict.fromkeys(("then_roll", "then_pitch", "then_yaw"), TURN_SD_RAD)
THEN_GYRO_SD_RADPS, THEN_ACCEL_SD_MPS2 = 3e-4, 0.02
"""Of what changes within a ride: nothing does, but for what rails that are wrong, and bodies that stick, make
of it."""

PACE_SD = 0.003
"""Of stamps, beside their clock: as little as the factor of a gyro, which a pace is much like."""

_DEG = math.pi / 180.0


def clock_slack(ride: Ride) -> float:
    """How far the clocks of a sound IMU's sensors may be apart, s.

    A gyro shows the turn of a body, as at its middle, and an accelerometer what its own place feels: ahead of
    the middle that comes earlier.
    """
    fastest = max(float(np.abs(ride.way.speed_mps).max()), 0.1)
    ahead = AHEAD_SHARE * ride.recording.mount_position_m[0]
    return math.hypot(
        CLOCK_SD_S, CLOCK_SD_M / fastest, ahead / fastest, 0.5 / ride.recording.imu_sheet.rate_hz
    )


def slack_of(ride: Ride, found: Fit) -> dict[str, float]:
    """Standard deviation of each figure in a sound ride, besides the fit's own sd; in SI.

    Parameters
    ----------
    ride : Ride
        The blocks.
    found : Fit
        Of them: it says which curves were passed.
    """
    recording = ride.recording
    sheet, errors = recording.imu_sheet, recording.map_errors
    package = sheet.package_misalignment_rad / math.sqrt(3.0)
    moved = motion(ride, found.x)
    curves = max(1, len(ride.table.curves_in(float(moved.place_m.min()), float(moved.place_m.max()))))
    seconds = float(ride.fine_s[-1] - ride.fine_s[0])
    clock = 0.02 + 0.02 * ride.reading_s
    bent = errors.radius_relative_sd / math.sqrt(curves)
    slack = {
        "gyro": math.hypot(sheet.gyro_scale_error / math.sqrt(3.0), bent, 0.003),
        "wheel": math.hypot(ride.way.scale_sd, errors.chainage_scale_sd, 0.001),
        "shift": math.hypot(errors.chainage_offset_sd_m, 2.0, AHEAD_SHARE * recording.mount_position_m[0]),
        "yaw": math.hypot(package, 0.3 * _DEG),
        "pitch": math.hypot(package, errors.gradient_sd, 0.2 * _DEG),
        "roll": math.hypot(package, errors.cant_along_sd_m / recording.track.rail_base_m, 0.2 * _DEG),
        "offset": clock,
        "gyro_offset": clock_slack(ride),
        "drift": math.hypot(sheet.clock_drift, 0.03 / seconds, 3e-5),
    }
    for channel, (gain, late) in enumerate(zip(GAINS, LATES, strict=True)):
        scale = sheet.gyro_scale_error if channel <= GYRO_Z else sheet.accel_scale_error
        slack[gain] = math.hypot(scale / math.sqrt(3.0), GAIN_SD)
        slack[late] = clock_slack(ride)
    slack |= dict.fromkeys(TURNS, math.hypot(package, TURN_SD_RAD))
    slack[ACCEL_GAIN] = math.hypot(sheet.accel_scale_error / math.sqrt(3.0), GAIN_SD)
    slack[PACE] = math.hypot(PACE_SD, bent)
    for channel, ramp in enumerate(RAMPS):
        is_gyro = channel <= GYRO_Z
        slack[ramp] = (
            math.hypot(RAMP_SD_RADPS, 3.0 * sheet.gyro_bias_instability_radps)
            if is_gyro
            else math.hypot(RAMP_SD_MPS2, 3.0 * sheet.accel_bias_instability_mps2)
        )
    slack |= dict.fromkeys(CUTS, CUT_SD_RADPS) | THEN_SD | {"then_offset": clock_slack(ride)}
    for name, of in THEN.items():
        if of.startswith("gyro_bias"):
            slack[name] = math.hypot(THEN_GYRO_SD_RADPS, 3.0 * sheet.gyro_bias_instability_radps)
        elif of.startswith("accel_bias"):
            slack[name] = math.hypot(THEN_ACCEL_SD_MPS2, 3.0 * sheet.accel_bias_instability_mps2)
    return slack | dict.fromkeys(SLOW, clock_slack(ride))


def distance(key: str, value: float, sd: float, slack: float) -> float:
    """How many standard deviations a figure is off its nominal value."""
    nominal = float(start_values()[INDEX[key]])
    if key in GAINS or key == ACCEL_GAIN:
        slack *= max(1.0, abs(value))  # a factor's errors are shares of it
    return abs(value - nominal) / math.hypot(sd, slack)


def accused(found: Fit, slack: dict[str, float], keys: tuple[str, ...]) -> int:
    """How many of some figures a fit has likely wrong."""
    return sum(distance(key, found.value(key), found.sd(key), slack[key]) > LIKELY for key in keys)
