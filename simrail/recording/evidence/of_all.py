"""Findings of a sensor, of the time and of what changes, by the fit of all that a ride has.

`simrail.recording.evidence.single` sets free what explains a ride; here it becomes words, a verdict and a
remedy.
"""

import math

from simrail.core.columns import ACCEL, GYRO
from simrail.recording.evidence.finding import LIKELY, Finding, Verdict
from simrail.recording.evidence.finding import SURE as CERTAIN
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    CUTS,
    GAINS,
    LATES,
    OF_CHANNEL,
    PACE,
    RAMPS,
    SLOW,
    THEN,
    TURNS,
)
from simrail.recording.evidence.single import Single
from simrail.recording.evidence.slack import distance
from simrail.recording.evidence.slopes import AXES, Slope

ALL_ACCEL = "factor of the accelerometer"

SENSORS = {SLOW[0]: "gyro", SLOW[1]: "accelerometer"}

G = 9.80665
"""Standard gravity, m/s2."""


def verdict_by(name: str, single: Single) -> Verdict:
    """The judgement of what the fit sets free; what others that came after it explain is no fault."""
    if single.off(name) > CERTAIN:
        return "surely wrong"
    if name in SLOW and single.off(name) < LIKELY:
        return "could not be judged"  # springs do as much
    return "likely wrong" if distance(name, *single.told[name], 0.0) > LIKELY else "could not be judged"


def or_else(name: str, single: Single) -> str:
    """What explains the ride nearly as well as the last that was set free."""
    if name != single.free[-1] or not single.rivals:
        return ""
    return "this ride hardly tells it from " + " or ".join(_words(rival) for rival in single.rivals)


def _words(name: str) -> str:
    """One of `SINGLE` in words."""
    if name in GAINS:
        return f"another factor of {AXES[OF_CHANNEL[GAINS.index(name)]].name}"
    if name in LATES:
        return f"{AXES[OF_CHANNEL[LATES.index(name)]].name}, late"
    if name in SLOW:
        return f"a low-pass in the {SENSORS[name]}"
    if name in TURNS:
        return f"a gyro that is turned against the accelerometer ({name.removeprefix('gyro_')})"
    return "another factor of the accelerometer" if name == ACCEL_GAIN else "stamps whose second is none"


def of_all(name: str, single: Single) -> Finding:
    """The finding of a sensor, or of the time, that the fit has set free."""
    value, sd = single.told[name]
    if name in TURNS:
        return _apart(name, value, sd, single)
    if name in THEN:
        return _changes(name, value, sd, single)
    if name in (*RAMPS, *CUTS):
        return _unsteady(name, value, sd, single)
    if name == PACE:
        quantity, unit, nominal, field, setting = "pace of the time", "1", 1.0, "imu.units.time", ""
        why = (
            f"the time stamps run {value:.4g} times as fast as the ride, by its curves, its push and its way"
        )
        remedy = (
            "mend units.time, tick_rate_hz or rate_hz of all its files: one of its seconds is "
            f"{1.0 / value:.4g} s"
        )
    elif name == ACCEL_GAIN:
        quantity, unit, nominal, field = ALL_ACCEL, "1", 1.0, "imu.accel"
        setting, remedy = "imu.scale.accel", ""
        why = f"shows {value:.3g} times the push, the curves and gravity"
    else:
        sensor, key = SENSORS[name], name.removeprefix("slow_")
        quantity, unit, nominal, field, setting = f"low-pass in the {sensor}", "s", 0.0, f"imu.{key}", ""
        why = (
            f"a low-pass of {1.0 / (2.0 * math.pi * value):.2g} Hz (of the first order) makes the {sensor} "
            f"{value:.2f} s late, and takes off what is faster"
        )
        remedy = (
            f"set a wider bandwidth of the device; for the lag alone imu.{key}.time_offset_s = {-value:.2f}"
        )
    remedy = "; or ".join(part for part in (remedy, or_else(name, single)) if part)
    return _of_ride(
        name,
        Slope(value, sd),
        single,
        quantity,
        why,
        nominal=nominal,
        unit=unit,
        setting=setting,
        field=field,
        remedy=remedy,
    )


def _apart(name: str, value: float, sd: float, single: Single) -> Finding:
    """The finding of a gyro whose axes are turned against the accelerometer's."""
    angle, by = name.removeprefix("gyro_"), math.degrees(1.0)
    value = math.remainder(value, 2.0 * math.pi)
    return _of_ride(
        name,
        Slope(value * by, sd * by),
        single,
        f"{angle} of the gyro beside the accelerometer",
        f"the gyro is turned by {value * by:+.1f} deg of {angle} against the accelerometer, by how the line "
        "rolls and bends",
        unit="deg",
        setting=f"imu.gyro.{angle}_deg",
        field=f"imu.gyro.{angle}_deg",
        remedy=or_else(name, single),
    )


def _changes(name: str, value: float, sd: float, single: Single) -> Finding:
    """The finding of what changes within a ride."""
    of, by, unit, cut = THEN[name], 1.0, "1", _cut_at(single)
    if of in ("roll", "pitch", "yaw"):
        by, unit, field = math.degrees(1.0), "deg", f"imu.{of}_deg"
        quantity, why = (
            f"change of the {of} of the mounting",
            f"the device has {value * by:+.1f} deg more of {of}",
        )
        remedy = f"{cut} and give each part its own {of}_deg; fasten the device"
    elif of == "offset":
        unit, field, quantity = "s", "imu.time_s", "jump of the clock"
        side = "samples of the IMU are missing" if value < 0.0 else "the IMU has samples too many"
        why = f"way and IMU are {abs(value):.2f} s apart, by their stamps: {side}"
        remedy = f"{cut}, or give what follows its own stamps: samples that are numbered in a row hide a gap"
    elif of == "wheel":
        return _counts(Slope(value, sd), single)
    else:
        column = dict(zip((name for name in THEN if "bias" in name), OF_CHANNEL, strict=True))[name]
        axis, field = AXES[column].name.removesuffix(" alone"), f"imu.{column}"
        by, unit = (math.degrees(1.0), "deg/s") if column in GYRO else (1.0, "m/s2")
        quantity, why = (
            f"jump of the offset of {axis}",
            f"the offset of {axis} is {value * by:+.3g} {unit} more",
        )
        remedy = f"{cut}; log raw samples, without an automatic zero"
        if column in ACCEL:
            tilt = abs(math.degrees(math.asin(min(1.0, abs(value) / G))))
            why += f", as a tilt of {tilt:.2g} deg would make it"
            remedy += "; fasten the device"
    why = f"from time_s = {single.changed_s:.4g} on {why}"
    return _of_ride(
        name, Slope(value * by, sd * by), single, quantity, why, unit=unit, field=field, remedy=remedy
    )


def _counts(change: Slope, single: Single) -> Finding:
    """The finding of a wheel that counts otherwise from a moment on: per metre, over those before."""
    begun = single.found.value("wheel")
    counts = begun / (begun + change.value)
    sd, cut = counts**2 * change.sd / abs(begun), _cut_at(single)
    if counts < 0.0:
        why = f"the wheel counts backwards ({counts:.2f} of before)"
        remedy = f"{cut} and set reverse for what follows, or else for what was; mend the counter's wiring"
    else:
        why = f"the wheel counts {counts:.3g} times as much for a metre as before"
        remedy = f"{cut} and give each part its own radius or pulses; mend the wiring of the counter"
    return _of_ride(
        "then_wheel",
        Slope(counts, sd),
        single,
        "counts for a metre, over those before",
        f"from time_s = {single.changed_s:.4g} on {why}",
        nominal=1.0,
        field=single.way,
        remedy=remedy,
    )


def _cut_at(single: Single) -> str:
    """Where to cut a ride in which something changes."""
    return f"cut the recording at time_s = {single.changed_s:.4g}"


def _unsteady(name: str, value: float, sd: float, single: Single) -> Finding:
    """The finding of a sensor whose offset grows in the ride, or that takes off what is slow."""
    if name in RAMPS:
        column = OF_CHANNEL[RAMPS.index(name)]
        by, unit = (math.pi / 180.0, "deg/s") if column in GYRO else (1.0, "m/s2")
        axis = AXES[column].name.removesuffix(" alone")
        quantity, field = f"growth of the offset of {axis}", f"imu.{column}"
        why = f"the offset of {axis} grows by {value / by:.3g} {unit} in the ride"
        remedy = "take off what it shows at stops before and after; let the device warm up before a ride"
    else:
        sensor, key = ("gyro", "gyro") if name == CUTS[0] else ("accelerometer", "accel")
        by, unit, quantity, field = 1.0, "rad/s", f"high-pass in the {sensor}", f"imu.{key}"
        why = f"a high-pass of {1.0 / value:.2g} s takes off what the {sensor} shows longer"
        remedy = "log raw samples: no automatic zero, no 'linear acceleration', no AC coupling"
    return _of_ride(
        name, Slope(value / by, sd / by), single, quantity, why, unit=unit, field=field, remedy=remedy
    )


def _of_ride(
    key: str,
    found: Slope,
    single: Single,
    name: str,
    why: str,
    *,
    nominal: float = 0.0,
    unit: str = "1",
    setting: str = "",
    field: str,
    remedy: str,
) -> Finding:
    """A finding of what the fit has set free, which rests on all of the ride."""
    verdict = verdict_by(key, single)
    return Finding(name, key, *found, nominal, unit, "all of the ride", verdict, why, setting, field, remedy)
