"""Single axes against the line: one alone may have another unit, another sign, or another's place.

The fit of `simrail.recording.evidence.judge` holds a device as a whole: its axes stay square. A logger that
gives one column the other sign makes a device that there is not. So each axis is held alone against what the
map and the way let expect of it, in means over a second: the gyro's X against the roll rate of
transitions, its Y against the pitch rate of vertical curves and what cant leaves of a turn, the
accelerometer's X against changes of speed, its Y against what speed and cant leave of curves, its Z against
gravity. On a level line without cant nothing tells of the gyro's Y, and that is said.

Such a slope tells another sign or unit, whatever else the ride is. Its number comes from the fit of all
(`simrail.recording.evidence.single`), which also tells a factor of 1.1, a column that is late alone, a sensor
behind a low-pass, and stamps whose second is none.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import LIKELY, Finding, Verdict, verdict_of
from simrail.recording.evidence.finding import SURE as CERTAIN
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    CUTS,
    FORCE_X,
    GAINS,
    LATES,
    OF_CHANNEL,
    PACE,
    RAMPS,
    SLOW,
    THEN,
    TURNS,
)
from simrail.recording.evidence.single import Single, Up, up_of
from simrail.recording.evidence.slack import distance
from simrail.recording.evidence.way import way_of
from simrail.recording.recording import Recording

OTHER_SIGN, OTHER_UNIT = 0.4, 4.0
"""Slopes beyond which (below minus, above) an axis has the other sign, or another unit."""

NEXT_TO_NONE = 0.2
"""Size of a slope below which an axis does not follow at all; in rad/s for deg/s it has 0.017."""

SQUARE = 1.4
"""Slopes between 1 over this and this, of either sign, are those of an axis that follows."""

SURE = 6.0
"""Standard deviations that a slope must be off 1 before a ride is refused for it; they take seconds as
independent, which sway and drift are not."""

WANTED = 1.0 / SURE
"""Standard deviation of a slope up to which its sign is told: minus 1 is then `SURE` of them off nothing."""


class Slope(NamedTuple):
    """Slope of a least-squares line, and its standard deviation (white)."""

    value: float
    sd: float

    @property
    def against(self) -> bool:
        """Whether it has the other sign."""
        return self.value < -OTHER_SIGN and -self.value > SURE * self.sd

    @property
    def along(self) -> bool:
        """Whether it has the sign that it should have."""
        return self.value > OTHER_SIGN and self.value > SURE * self.sd

    @property
    def many(self) -> bool:
        """Whether it is many times too large."""
        return self.value > OTHER_UNIT and self.value - 1.0 > SURE * self.sd

    @property
    def none(self) -> bool:
        """Whether it is next to none."""
        return abs(self.value) < NEXT_TO_NONE and 1.0 - self.value > SURE * self.sd


class Axis(NamedTuple):
    """How an axis is told: its name, what it is held against, and what a ride without a word of it lacks."""

    name: str
    of: str
    lacks: str


RX, RY, RZ = GYRO
FX, FY, FZ = ACCEL

AXES = {
    RX: Axis("gyro X alone", "the roll rate of the transitions", "no transition with cant"),
    RY: Axis("gyro Y alone", "the pitch rate of the line", "no vertical and no canted curve to tell it by"),
    RZ: Axis("gyro Z alone", "the curves", "no curve"),
    FX: Axis("accelerometer X alone", "the change of speed", "no change of speed to tell it by"),
    FY: Axis("accelerometer Y alone", "what speed and cant leave of the curves", "no curve to feel"),
}
"""Which axes are judged, in the order in which they are told."""

APART = 1.5
"""Standard deviations between two explanations from which on one is preferred."""

ALL_ACCEL = "factor of the accelerometer"

SENSORS = {SLOW[0]: "gyro", SLOW[1]: "accelerometer"}

G = 9.80665
"""Standard gravity, m/s2."""

LEAST = dict.fromkeys((RX, RY, RZ), 2e-4) | dict.fromkeys((FX, FY), 0.02)
"""Rms of what the line lets expect, in means over a second, rad/s and m/s2, below which it tells nothing of
an axis: rails and bodies move as much by themselves, and a noiseless IMU would make a sure fault of it."""

AS_A_WHOLE = (
    ((RX, RY, FX, FY), (RZ,)),
    ((RX, RY, RZ), (FX, FY)),
    ((RX, RY, RZ, FX), (FY,)),
    ((FX,), ()),
    ((RZ,), ()),
)
"""Axes that go against the line, and those that go along, of a device as a whole: one that looks backwards, a
gyro of the other sense, a train that ran the other way; and what either of them comes to where no other axis
tells anything."""


def weigh_axes(recording: Recording, single: Single | None = None) -> tuple[Finding, ...]:
    """What a ride says of each axis alone, of its sensors and its time; nothing without a map or a way.

    Parameters
    ----------
    recording : Recording
        A ride.
    single : Single, optional
        What the fit of all says of them.
    """
    slopes, crossed = _slopes(recording)
    if not slopes:
        return ()
    findings = [_judged(name, slopes[name]) for name in AXES]
    if findings[0].wrong and abs(crossed.value) > OTHER_SIGN and abs(crossed.value) > SURE * crossed.sd:
        findings[0] = _finding(
            RX,
            slopes[RX],
            "surely wrong",
            f"does not roll in the transitions, but its Y does, {crossed.value:.2g} times: their columns are "
            "swapped",
            "mend the order in columns.gyro, or the axes",
        )
    if single is not None:
        findings = [_numbered(finding, i, single) for i, finding in enumerate(findings)]
        findings = _late_together(findings, single)
        findings += [of_all(name, single) for name in single.free if name not in (*GAINS, *LATES)]
    return (*findings, _upright(recording, single))


def _slopes(recording: Recording) -> tuple[dict[str, Slope], Slope]:
    """Slope of each axis on what is expected of it, and of the gyro's Y on its X's; nothing without a way."""
    expected = expected_of(recording)
    if not expected:
        return {}, Slope(1.0, math.inf)
    found = {name: seconds_of(recording, name) for name in AXES}
    slopes = {name: slope(found[name], expected[name], LEAST[name]) for name in AXES}
    return slopes, slope(found[RY], expected[RX], LEAST[RX])


def seconds_of(recording: Recording, name: str) -> FloatArray:
    """Means (n,) over a second of a column of the IMU."""
    return means(recording.imu[name].to_numpy(), max(1, round(recording.imu_sheet.rate_hz)))


def expected_of(recording: Recording) -> dict[str, FloatArray]:
    """Means (n,) over a second that map and way let expect of each of `AXES`; nothing without either."""
    way = way_of(recording) if recording.track.is_map else None
    if way is None:
        return {}
    count, time = max(1, round(recording.imu_sheet.rate_hz)), recording.imu.index.to_numpy(dtype=np.float64)
    went, speed, push = (
        means(np.interp(time, way.time_s, values), count)
        for values in (way.way_m, way.speed_mps, way.acceleration_mps2)
    )
    frame = recording.track.frame_extended(recording.start_position_m + went)
    along, level = -np.sin(frame.pitch_rad), np.cos(frame.pitch_rad) * np.sin(frame.roll_rad)
    gravity = recording.gravity_mps2
    return {
        RX: frame.k[:, 0] * speed,
        RY: frame.k[:, 1] * speed,
        RZ: frame.k[:, 2] * speed,
        FX: push + gravity * along,
        FY: frame.k[:, 2] * speed**2 + gravity * level,
    }


def _numbered(finding: Finding, channel: int, single: Single) -> Finding:
    """The finding of an axis with its number, by the fit of all."""
    name, gain, late = OF_CHANNEL[channel], GAINS[channel], LATES[channel]
    if gain in single.free:
        return _scaled(name, Slope(*single.told[gain]), _told(gain, single), _or(gain, single))
    if late in single.free:
        value, side = single.told[late][0], "late" if single.told[late][0] < 0.0 else "early"
        return replace(
            _finding(name, Slope(*single.told[late]), verdict_of(single.off(late))),
            name=f"{AXES[name].name}: offset of its clock",
            nominal=0.0,
            unit="s",
            verdict=_told(late, single),
            why=f"is {abs(value):.2f} s {side}, against all other axes",
            remedy="; or ".join(
                part
                for part in (
                    "shift that column alone, by so many samples: no setting does",
                    _or(late, single),
                )
                if part
            ),
        )
    if single.free or finding.verdict == "sound":
        found = Slope(*single.told[gain])
        if found.sd > WANTED or single.off(gain) > LIKELY:
            return _finding(name, found, "could not be judged", "the ride tells too little of it")
        return _finding(name, found, "sound")
    return finding


def _late_together(findings: list[Finding], single: Single) -> list[Finding]:
    """The findings of `AXES`; one, in place of both, where gyro and accelerometer are late alike."""
    found = list(findings)
    for i, axis in enumerate("XY"):
        pair, lates = (i, i + FORCE_X), (LATES[i], LATES[i + FORCE_X])
        if not set(lates) & set(single.free) or not set(lates) <= single.told.keys():
            continue
        values, sds = np.array([single.told[late] for late in lates]).T
        if np.any(np.abs(values) < LIKELY * sds) or abs(values[1] - values[0]) > LIKELY * math.hypot(*sds):
            continue
        late = values @ sds**-2.0 / np.sum(sds**-2.0)
        first = next(findings[k] for k, name in zip(pair, lates, strict=True) if name in single.free)
        side = "late" if late < 0.0 else "early"
        found[pair[0]] = replace(
            first,
            name=f"{axis} of gyro and accelerometer: offset of their clock",
            key=f"together_{axis.lower()}",
            value=float(late),
            sd=float(np.sum(sds**-2.0) ** -0.5),
            rests_on=" and ".join(AXES[OF_CHANNEL[k]].of for k in pair),
            verdict=verdict_of(max(single.off(name) for name in lates)),
            why=f"{axis} of gyro and accelerometer is {abs(late):.2f} s {side}, against all other axes",
            field=", ".join(findings[k].field for k in pair),
            remedy="shift both columns, by so many samples: no setting does; or mend how the logger puts "
            "axes together",
        )
        del found[pair[1]]
    return found


def _scaled(name: str, found: Slope, verdict: Verdict, rival: str) -> Finding:
    """The finding of an axis that has another factor, or the other sign."""
    of = AXES[name].of
    unit = "mend the unit: one axis alone has another one"
    if found.value < 0.0:
        why, remedy = f"goes against {of}", "give that column alone the other sign, or mend the axes"
    elif found.value > OTHER_UNIT:
        why, remedy = f"is many times {of}", unit
    elif found.value < NEXT_TO_NONE:
        why, remedy = f"has next to nothing of {of}", f"{unit}; or the order of the columns"
    else:
        why, remedy = f"is {found.value:.3g} times {of}", "mend the scale: one axis alone has another one"
    remedy = "; or ".join(part for part in (remedy, rival) if part)
    kind = "gyro" if name in GYRO else "accel"
    return replace(_finding(name, found, verdict, why, remedy), setting=f"imu.scale.{kind}")


def _told(name: str, single: Single) -> Verdict:
    """The judgement of what the fit sets free; what others that came after it explain is no fault."""
    if single.off(name) > CERTAIN:
        return "surely wrong"
    if name in SLOW and single.off(name) < LIKELY:
        return "could not be judged"  # springs do as much
    return "likely wrong" if distance(name, *single.told[name], 0.0) > LIKELY else "could not be judged"


def _or(name: str, single: Single) -> str:
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
    remedy = "; or ".join(part for part in (remedy, _or(name, single)) if part)
    return Finding(
        quantity,
        name,
        value,
        sd,
        nominal,
        unit,
        "all of the ride",
        _told(name, single),
        why,
        setting,
        field,
        remedy,
    )


def _apart(name: str, value: float, sd: float, single: Single) -> Finding:
    """The finding of a gyro whose axes are turned against the accelerometer's."""
    angle, by = name.removeprefix("gyro_"), math.degrees(1.0)
    value = math.remainder(value, 2.0 * math.pi)
    return Finding(
        f"{angle} of the gyro beside the accelerometer",
        name,
        value * by,
        sd * by,
        0.0,
        "deg",
        "all of the ride",
        _told(name, single),
        f"the gyro is turned by {value * by:+.1f} deg of {angle} against the accelerometer, by how the line "
        "rolls and bends",
        f"imu.gyro.{angle}_deg",
        f"imu.gyro.{angle}_deg",
        _or(name, single),
    )


def _changes(name: str, value: float, sd: float, single: Single) -> Finding:
    """The finding of what changes within a ride."""
    of, by, unit = THEN[name], 1.0, "1"
    cut = f"cut the recording at time_s = {single.changed_s:.4g}"
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
    return Finding(
        quantity,
        name,
        value * by,
        sd * by,
        0.0,
        unit,
        "all of the ride",
        _told(name, single),
        f"from time_s = {single.changed_s:.4g} on {why}",
        field=field,
        remedy=remedy,
    )


def _counts(change: Slope, single: Single) -> Finding:
    """The finding of a wheel that counts otherwise from a moment on: per metre, over those before."""
    begun = single.found.value("wheel")
    counts = begun / (begun + change.value)
    sd = counts**2 * change.sd / abs(begun)
    cut = f"cut the recording at time_s = {single.changed_s:.4g}"
    if counts < 0.0:
        why = f"the wheel counts backwards ({counts:.2f} of before)"
        remedy = f"{cut} and set reverse for what follows, or else for what was; mend the counter's wiring"
    else:
        why = f"the wheel counts {counts:.3g} times as much for a metre as before"
        remedy = f"{cut} and give each part its own radius or pulses; mend the wiring of the counter"
    return Finding(
        "counts for a metre, over those before",
        "then_wheel",
        counts,
        sd,
        1.0,
        "1",
        "all of the ride",
        _told("then_wheel", single),
        f"from time_s = {single.changed_s:.4g} on {why}",
        field=single.way,
        remedy=remedy,
    )


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
    return Finding(
        quantity,
        name,
        value / by,
        sd / by,
        0.0,
        unit,
        "all of the ride",
        _told(name, single),
        why,
        "",
        field,
        remedy,
    )


def _upright(recording: Recording, single: Single | None) -> Finding:
    """The finding of the accelerometer's Z, by gravity."""
    up = up_of(recording)
    found, off = Slope(up.value, up.sd), abs(up.value - 1.0) / up.sd
    verdict: Verdict = "surely wrong" if off > CERTAIN else "likely wrong" if off > LIKELY else "sound"
    name, why, remedy, setting = "accelerometer Z alone", "", "", ""
    if verdict != "sound" and single is not None and single.changed_s is not None:
        verdict, why = "could not be judged", "something changes within the ride"
    elif verdict != "sound":
        why, setting = f"is {up.value:.3g} times gravity in the median of the ride", "imu.scale.accel"
        remedy = "mend the scale, if one axis alone has another one, its offset, or gravity_mps2"
        whole = _by_all(up, single)
        if whole is None:
            setting, remedy = (
                "",
                "mend imu.scale.accel, of Z alone or of all (the ride does not tell), or gravity_mps2",
            )
        elif whole and single is not None and ACCEL_GAIN in single.free:
            verdict, why, setting = "could not be judged", "all of the accelerometer has another factor", ""
        elif whole:
            return Finding(
                ALL_ACCEL,
                ACCEL_GAIN,
                up.value,
                up.sd,
                1.0,
                "1",
                "gravity, push and curves",
                verdict,
                why,
                setting,
                f"imu.{FZ}",
                "",
            )
    return Finding(
        name,
        key_of(FZ),
        found.value,
        found.sd,
        1.0,
        "1",
        "gravity",
        verdict,
        why,
        setting=setting,
        field=f"imu.{FZ}",
        remedy=remedy,
    )


def _by_all(up: Up, single: Single | None) -> bool | None:
    """Whether push and curves have the factor that gravity has; None where they do not tell."""
    if single is None or ACCEL_GAIN not in single.told:
        return None
    value, sd = single.told[ACCEL_GAIN]
    alone, whole = abs(value - 1.0) / sd, abs(value - up.value) / sd
    return whole < alone if abs(alone - whole) > APART else None


def are_columns(findings: Sequence[Finding]) -> bool:
    """Whether all axes that a ride tells of follow the line, some against it, as no whole device would.

    Then the place, the way and the device are right, and the signs of columns wrong.

    Parameters
    ----------
    findings : sequence of Finding
        Those of `weigh_axes`, by the slopes alone.
    """
    judged = {key_of(name) for name in AXES}
    told = {finding.key: finding for finding in findings if finding.sd < WANTED and finding.key in judged}
    against = {key for key, finding in told.items() if finding.value < 0.0}
    follow = all(1.0 / SQUARE < abs(finding.value) < SQUARE for finding in told.values())
    whole = any(
        against == told.keys() & {key_of(name) for name in turned} and told.keys() <= _keys(turned, kept)
        for turned, kept in AS_A_WHOLE
    )
    return bool(against) and follow and not whole


def _keys(*groups: Sequence[str]) -> set[str]:
    return {key_of(name) for group in groups for name in group}


def key_of(name: str) -> str:
    """Key of the finding of an axis."""
    return f"alone_{name}"


def _judged(name: str, found: Slope) -> Finding:
    """What is found of one axis."""
    of = AXES[name].of
    sign, unit = "give that column alone the other sign", "mend the unit: one axis alone has another one"
    if found.against and found.value < -OTHER_UNIT:
        return _finding(name, found, "surely wrong", f"has nothing of {of}", "mend the order of the columns")
    if found.against:
        return _finding(name, found, "surely wrong", f"goes against {of}", f"{sign}, or mend the axes")
    if found.many:
        return _finding(name, found, "surely wrong", f"is many times {of}", unit)
    if found.none:
        remedy = f"{unit}; or the order of the columns, or what it is measured by"
        if name in (FX, FY):
            remedy += ": a wheel that slid, counts without a sign, two rides in one file"
        return _finding(name, found, "surely wrong", f"has next to nothing of {of}", remedy)
    if found.sd > WANTED:
        return _finding(name, found, "could not be judged", f"the ride has {AXES[name].lacks}")
    return _finding(name, found, "sound")


def _finding(name: str, found: Slope, verdict: Verdict, why: str = "", remedy: str = "") -> Finding:
    axis = AXES[name]
    rests_on = "nothing" if verdict == "could not be judged" else axis.of
    return Finding(
        axis.name,
        key_of(name),
        found.value,
        found.sd,
        1.0,
        "1",
        rests_on,
        verdict,
        why,
        field=f"imu.{name}",
        remedy=remedy,
    )


def slope(measured: FloatArray, expected: FloatArray, least: float = 0.0) -> Slope:
    """Slope of the least-squares line measured = a + slope * expected; unknown below a least rms of these."""
    x, y = expected - expected.mean(), measured - measured.mean()
    power = float(x @ x)
    if power <= len(x) * least**2:
        return Slope(1.0, math.inf)
    found = float(x @ y) / power
    rest = y - found * x
    return Slope(found, float(np.sqrt(rest @ rest / len(x) / power)))


def means(values: FloatArray, count: int) -> FloatArray:
    """Means (n // count,) of a signal over `count` samples each; of all of it, if it is shorter."""
    count = min(count, len(values))
    whole = len(values) // count * count
    found: FloatArray = values[:whole].reshape(-1, count).mean(axis=1)
    return found
