"""From the fit to findings: what is sound, likely wrong, surely wrong, or could not be judged.

A figure is held against its nominal value in standard deviations: its own, with what a sound ride may be off
besides (the sheet's errors of scale and of the package, the map's of place and radius, what the model leaves
out). Beyond `LIKELY` of them it is likely wrong, beyond `SURE` surely: one normal figure is beyond
`LIKELY` in 0.2 of 500 sound rides. What a ride knows no better than `WANTED` is not called sound: it could
not be judged.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from simrail.core.errors import InputError
from simrail.recording.evidence.finding import LIKELY, Finding, Verdict, verdict_of
from simrail.recording.evidence.fit import Fit, fit
from simrail.recording.evidence.line import K3
from simrail.recording.evidence.model import (
    GYRO_Z,
    INDEX,
    SLOW,
    Motion,
    Ride,
    motion,
    ride_of,
    start_values,
)
from simrail.recording.evidence.search import (
    KNOWN_S,
    LEAST_TURN_RAD,
    accel_is_apart,
    is_sound_start,
)
from simrail.recording.evidence.single import Single
from simrail.recording.evidence.slack import slack_of
from simrail.recording.evidence.slides import Slide, slides_left
from simrail.recording.evidence.trials import explained
from simrail.recording.recording import Recording

FOLLOWED = 0.5
"""Share of the gyro's Z that it must explain at least, for the curves to say anything."""

LEAST_MPS, LONGEST_S = 1.0, 10.0
"""Speeds at which a place may be a time, and the longest lateness that is named for one."""

HINT = 2.0
"""Standard deviations from which on another clock is named beside the one that is told."""

SURE_TURN_RAD = 0.3
"""Turn of the track from which on a gyro that follows none of it is surely wrong."""

SPEEDS_TAKEN = {"km/h": 1.0 / 3.6, "miles an hour": 0.44704, "knots": 0.51444, "feet a second": 0.3048}
"""Units that a speed in m/s may be in, in m/s, and how far a factor may be off one of them."""

LEAST_PUSH_MPS = 2.0
"""Changes of speed, summed, from which on the push says something."""


class Kind(NamedTuple):
    """How a parameter is told: name, unit, unit in SI, the sd from which on it is not judged, its source."""

    name: str
    unit: str
    si: float
    wanted: float
    by: tuple[str, ...]


_DEG = math.pi / 180.0

KINDS = {
    "gyro": Kind("factor of the gyro", "1", 1.0, 0.1, ("turn",)),
    "wheel": Kind("factor of the wheel", "1", 1.0, 0.1, ("turn", "push")),
    "shift": Kind("shift along the track", "m", 1.0, 15.0, ("turn",)),
    "yaw": Kind("yaw of the mounting", "deg", _DEG, 3.0, ("push",)),
    "pitch": Kind("pitch of the mounting", "deg", _DEG, 3.0, ()),
    "roll": Kind("roll of the mounting", "deg", _DEG, 3.0, ()),
    "offset": Kind("offset of the clock", "s", 1.0, 0.3, ("push",)),
    "drift": Kind("drift of the clock", "ppm", 1e-6, 500.0, ("push",)),
    "gyro_offset": Kind("offset of the gyro's clock", "s", 1.0, 0.3, ("turn",)),
}
"""What is judged, in the order in which it is told; ``by`` is what it needs, one of them at least."""


OF_GYRO, OF_ACCEL = "imu.gyro.time_offset_s", "imu.accel.time_offset_s"
"""Where the clock of a gyro is set right, and that of an accelerometer."""

OF_WHEEL = ("wheel", "offset", "drift")
"""What nothing but the push of a wheel tells on a straight line: there a wheel that slides tells nothing."""

OF_CLOCKS = ("offset", "drift", "gyro_offset")
"""What tells clocks."""

ALIKE = ("gyro", "shift")
"""What a gyro that is late may look like on a ride that tells little."""


@dataclass(frozen=True)
class Evidence:
    """What a recording says of itself.

    Attributes
    ----------
    findings : tuple of Finding
        One for each of `KINDS`.
    turn_rad, push_mps : float
        Turn of the track on the ride, and its changes of speed, both summed.
    middle_s : float
        Time from the first stamp of the device of the way to where the offset of its clock holds.
    single : Single, optional
        What it says of single axes, sensors and its time; the findings hold beside that.
    """

    findings: tuple[Finding, ...]
    turn_rad: float = 0.0
    push_mps: float = 0.0
    middle_s: float = 0.0
    single: Single | None = None

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """Those that are wrong, the surest first."""
        found = [finding for finding in self.findings if finding.wrong]
        return tuple(sorted(found, key=lambda finding: finding.verdict != "surely wrong"))

    def of(self, key: str) -> Finding:
        """The finding of one parameter."""
        return next(finding for finding in self.findings if finding.key == key)


def weigh(recording: Recording) -> Evidence:
    """What a recording says of its factors, its place, its mounting and its clocks.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`; its odometry frame is used
        only where there is neither wheel nor odometer.

    Returns
    -------
    Evidence
        Without a way at all, or of a ride of a few seconds, nothing could be judged.
    """
    ride = ride_of(recording) if recording.track.is_map else None
    if ride is None:
        why = "there is no map, nobody says how far the train went, or the ride is too short"
        return Evidence(tuple(_unjudged(key, math.inf, "nothing", why) for key in KINDS))
    # The matrices are small: threads of BLAS cost more than they bring.
    with threadpool_limits(1):
        ride, fits = explained(ride)
    one, two, single, best = fits
    # Of three clocks that one is wrong that agrees with neither of the others.
    is_accel = best is two and accel_is_apart(ride, two)
    told = two.by_gyro() if is_accel else best
    moved = motion(ride, best.x)
    turn, told_turn = _turn_of(ride, moved), _turn_of(ride, motion(ride, start_values()))
    push = np.abs(moved.acceleration_mps2).mean() * ride.block_s * len(ride.measured)
    has = {
        "turn": bool(turn > LEAST_TURN_RAD and best.explained[GYRO_Z] > FOLLOWED),
        "push": bool(push > LEAST_PUSH_MPS),
    }
    rests = {"turn": f"{turn / _DEG:.0f} deg of curves", "push": f"{push:.0f} m/s of changes of speed"}
    slack = slack_of(ride, best)
    # With a curve, the way beside the slides is known from it.
    slid = () if has["turn"] else slides_left(ride, best.x)
    findings = []
    for key, kind in KINDS.items():
        sources = [rests[by] for by in kind.by if has[by]]
        if kind.by and not sources:
            lacking = {"turn": "no curve that the gyro follows", "push": "no change of speed"}
            why = "the ride has " + " and ".join(lacking[by] for by in kind.by)
            findings.append(_unjudged(key, best.sd(key) / kind.si, "nothing", why))
            if key == "gyro" and turn > LEAST_TURN_RAD and told_turn > SURE_TURN_RAD:
                findings[-1] = _follows_nothing(findings[-1], best, told_turn, ride)
            continue
        if not kind.by:
            sources = ["gravity" + " and curves" * has["turn"]]
        finding = _judged(key, told, slack[key], " and ".join(sources), ride)
        if slid and finding.wrong and key in OF_WHEEL:
            findings.append(_beside_slides(finding, slid, ride))
            continue
        if is_accel and key == "gyro_offset":
            finding = _of_the_accelerometer(finding)
        if best is one and key in ("gyro_offset", "offset", *ALIKE):
            finding = _beside_a_late_gyro(finding, two, slack[key], ride)
        findings.append(finding)
    findings = [_qualified(finding, single, ride) for finding in findings]
    middle = ride.middle_s - float(ride.way.time_s[0])
    return Evidence(tuple(findings), turn, float(push), middle, single)


def is_near_sound(recording: Recording) -> bool:
    """Whether a ride is explained from near a sound ride's values: one fit of it, before all others."""
    ride = ride_of(recording)
    if ride is None:
        return False
    with threadpool_limits(1):
        return is_sound_start(ride, fit(ride, start_values()))


def _judged(key: str, found: Fit, slack: float, rests_on: str, ride: Ride) -> Finding:
    kind = KINDS[key]
    nominal = start_values()[INDEX[key]]
    value, sd = found.value(key), found.sd(key)
    if key in ("yaw", "pitch", "roll"):
        value = math.remainder(value, 2.0 * math.pi)
    verdict = verdict_of(abs(value - nominal) / math.hypot(sd, slack))
    why, remedy = "", ""
    setting, field = setting_of(key, ride.recording, ride.way.device)
    if verdict != "sound":
        why, remedy = _words(key, value, ride)
        if key == "gyro" and remedy:
            setting = ""  # no factor: a unit or an axis
        if key == "wheel" and remedy:
            setting = field = f"{ride.way.device}.reverse"
    elif sd / kind.si > kind.wanted:
        verdict, why = "could not be judged", "the ride tells too little of it"
    return Finding(
        kind.name,
        key,
        value / kind.si,
        sd / kind.si,
        nominal / kind.si,
        kind.unit,
        rests_on,
        verdict,
        why,
        setting,
        field,
        remedy,
    )


def _turn_of(ride: Ride, moved: Motion) -> float:
    """Turn of the track on a ride that moved so, there and back counted, rad."""
    bend = ride.table.at(moved.place_m)[:, K3] * moved.speed_mps
    return float(np.abs(bend).mean() * ride.block_s * len(ride.measured))


def _follows_nothing(finding: Finding, best: Fit, told_turn: float, ride: Ride) -> Finding:
    """That of a gyro which the curves do not explain by any place, factor or clock.

    ``told_turn`` is that of the track by what the ride file says of the way, rad.
    """
    return replace(
        finding,
        value=max(float(best.explained[GYRO_Z]), 0.0),
        name="share of the gyro's Z that the curves explain",
        sd=1.0 / math.sqrt(len(ride.measured)),
        rests_on=f"{told_turn / _DEG:.0f} deg of curves",
        verdict="surely wrong",
        why=f"does not follow the curves of {ride.recording.track.name!r}, wherever they are begun",
        setting="",
        field="imu.gyro_z_radps",
        remedy="mend columns.gyro (angles are no rates), the track, or start_position_m; else its gyro "
        "drifts, or the file holds two rides",
    )


def _beside_a_late_gyro(finding: Finding, two: Fit, slack: float, ride: Ride) -> Finding:
    """A finding of the fit with one clock, beside what the fit with two leaves open."""
    key, kind = finding.key, KINDS[finding.key]
    value, sd = two.value(key), two.sd(key)
    off = abs(value - start_values()[INDEX[key]]) / math.hypot(sd, slack)
    if key == "gyro_offset":
        verdict: Verdict = "sound"
        if off > LIKELY or sd / kind.si > kind.wanted:
            verdict = "could not be judged"
        why = "" if verdict == "sound" else finding.why
        finding = replace(finding, value=value / kind.si, sd=sd / kind.si, verdict=verdict, why=why)
    elif key == "offset":
        apart, between = two.value("gyro_offset"), two.by_gyro().value("offset")
        is_known = abs(apart) > HINT * two.sd("gyro_offset")
        if finding.wrong and is_known and abs(between) < 0.5 * abs(apart):
            other = f"{_late('accelerometer', -apart, 'gyro')}: set {OF_ACCEL}"
            finding = replace(finding, remedy=other)
    elif finding.wrong and (off < LIKELY or (key == "shift" and two.sd("gyro_offset") > KNOWN_S)):
        seconds = two.value("gyro_offset")
        if two.sd("gyro_offset") > KNOWN_S and key == "shift":
            # At one speed a place is a time, and the fit has taken any.
            speed = np.abs(ride.way.speed_mps)
            seconds = finding.value / float(np.median(speed[speed > LEAST_MPS]))
            if not abs(seconds) < LONGEST_S:
                return finding
        other = f"{_late('gyro', seconds, 'accelerometer')} (this ride does not tell): set {OF_GYRO}"
        finding = replace(finding, remedy="; or ".join(part for part in (finding.remedy, other) if part))
    return finding


def _beside_slides(finding: Finding, slides: tuple[Slide, ...], ride: Ride) -> Finding:
    """A finding that rests on the push of a wheel which slides."""
    begun, block = float(ride.fine_s[0]), ride.block_s
    times = " and ".join(
        f"{begun + block * one.first:.0f} to {begun + block * (one.last + 1):.0f} s" for one in slides
    )
    why = f"the wheel spins or slides at {times}, and no curve tells more"
    return _unjudged(finding.key, math.inf, "nothing", why)


def _qualified(finding: Finding, single: Single, ride: Ride) -> Finding:
    """A finding beside what else the ride has: stamps that were counted, or springs.

    Where a low-pass explains a ride that may be springs, which are late by themselves, what is late and what
    drifts share what the springs do, and the fit has of that a low-pass of the first order alone. A clock is
    believed wrong then if it surely is.
    """
    if ride.drift and finding.key == "drift":
        return _counted(finding, ride)
    on_springs = any(name in SLOW and single.off(name) < LIKELY for name in single.free)
    if not on_springs or finding.key not in OF_CLOCKS or finding.verdict != "likely wrong":
        return finding
    why = "the body hangs on springs, or is behind a low-pass: both are late by themselves"
    return replace(finding, verdict="could not be judged", why=why, setting="", remedy="")


def _counted(finding: Finding, ride: Ride) -> Finding:
    """The finding of a drift by per cents: of stamps that were counted at another rate than the device's."""
    drift, device = ride.drift + 1e-6 * finding.value, ride.way.device
    wrong, right = ("IMU", device) if ride.of_imu else (device, "IMU")
    remedy = f"give {wrong} and {right} the stamps of one clock"
    if ride.of_imu:
        rate = ride.recording.imu_sheet.rate_hz
        remedy += (
            f"; if samples were counted, their rate was {rate:.4g} Hz, or {abs(drift):.1%} of them are lost"
        )
    return replace(
        finding,
        value=1e6 * drift,
        verdict="surely wrong",
        why=f"the stamps of the {wrong} drift by {abs(drift):.1%} against the {right}'s, by the curves",
        setting="",
        field="imu.time_s" if ride.of_imu else f"{device}.time_s",
        remedy=remedy,
    )


def _of_the_accelerometer(finding: Finding) -> Finding:
    """The finding of the gyro's clock as one of the accelerometer's, with which no other clock agrees."""
    why = _late("accelerometer", finding.value, "gyro") if finding.wrong else ""
    name = "offset of the accelerometer's clock"
    return replace(finding, name=name, why=why, setting=OF_ACCEL, field=OF_ACCEL)


def _unjudged(key: str, sd: float, rests_on: str, why: str) -> Finding:
    kind = KINDS[key]
    nominal = float(start_values()[INDEX[key]])
    return Finding(kind.name, key, nominal, sd, nominal, kind.unit, rests_on, "could not be judged", why)


def setting_of(key: str, recording: Recording, device: str) -> tuple[str, str]:
    """Where in a ride file a parameter is mended, and which field of it a message blames."""
    if (
        device == "encoder"
        and recording.encoder_sheet is not None
        and recording.encoder_sheet.wheel == "odometer"
    ):
        device = "odometer"
    if key == "wheel":
        at = {"encoder": "encoder.sheet.wheel_radius_m", "odometer": "odometer.scale"}.get(device, "")
        return at, at or device
    if key == "shift":
        return "start_position_m", "start_position_m"
    if key in ("offset", "drift"):
        at = f"{device}.{'time_offset_s' if key == 'offset' else 'time_drift_ppm'}"
        return at, at
    if key == "gyro":
        return "imu.scale.gyro", "imu.gyro_z_radps"
    if key == "gyro_offset":
        return OF_GYRO, OF_GYRO
    return f"imu.{key}_deg", f"imu.{key}_deg"


def _words(key: str, value: float, ride: Ride) -> tuple[str, str]:
    """A clause that says what is wrong, and what to do where more is to be said than the setting."""
    curves, device = f"the curves of {ride.recording.track.name!r}", ride.way.device
    if key == "gyro":
        if value < 0.0:
            return (
                f"turns against {curves}",
                "mend the axes, the sign of the unit, or the direction (reverse)",
            )
        if value < 0.2:
            return f"does not turn with {curves}", "mend units.gyro (rad/s?), or the axes"
        if value > 5.0:
            remedy = 'mend units.gyro: the values look like "deg/s"'
            if value < 40.0:
                remedy = (
                    "mend units.gyro; or the times: numbers of samples are no seconds (give rate_hz instead)"
                )
            return f"turns many times as much as {curves}", remedy
        return f"turns {value:.3g} times as much as {curves}", ""
    if key == "wheel":
        taken = [unit for unit, si in SPEEDS_TAKEN.items() if abs(value / si - 1.0) < 0.03]
        if taken and device != "encoder":
            set_it = ' (units.speed = "km/h")' * (taken == ["km/h"])
            return (
                f"went {value:.3g} times as far as the {device} says: its speeds look like "
                f"{taken[0]}{set_it}",
                "",
            )
        if value < 0.0:
            return (
                f"the train ran the other way than the {device} says, by {curves} and its push",
                "turn over what it says: reverse = true is for a device that counts up while the train runs "
                "towards smaller s",
            )
        return f"the train went {value:.3g} times as far as the {device} says, by its curves and its push", ""
    if key == "shift":
        side = "ahead of" if value > 0.0 else "behind"
        return f"the train was {abs(value):.0f} m {side} the place given, by {curves}", ""
    if key == "yaw":
        quarter = round(value / (0.5 * math.pi)) % 4
        if abs(math.remainder(value, 0.5 * math.pi)) > 15.0 * _DEG or quarter == 0:
            return f"the push along the train lies {value / _DEG:+.1f} deg beside X", ""
        side = "backwards" if quarter == 2 else "sideways"
        axes = {1: '["-y", "x", "z"]', 2: '["-x", "-y", "z"]', 3: '["y", "-x", "z"]'}[quarter]
        return (
            f"pushes {side} when the train gains speed: the push lies {value / _DEG:+.1f} deg beside X",
            f"turn the axes as by axes = {axes}; or the direction is wrong (reverse)",
        )
    if key in ("pitch", "roll"):
        return (
            f"gravity says that the device has {value / _DEG:+.1f} deg of {key} beside what is given",
            "",
        )
    if key == "offset":
        return _late(device, value, "IMU"), ""
    if key == "gyro_offset":
        return _late("gyro", value, "accelerometer"), ""
    return f"the clock of the {device} drifts by {value * 1e6:+.0f} ppm against the IMU's", ""


def _late(sensor: str, value: float, other: str) -> str:
    """A clause on stamps to which `value` has to be added."""
    side = "late" if value < 0.0 else "early"
    return f"the stamps of the {sensor} are {abs(value):.2f} s {side} against the {other}'s"


def refuse_wrong(evidence: Evidence) -> None:
    """Refuse a recording of which something is surely wrong.

    Raises
    ------
    InputError
        Naming the figure found, with its sd, and the setting that mends it: one line for each.
    """
    errors = [error_of(finding) for finding in evidence.wrong if finding.verdict == "surely wrong"]
    if errors:
        errors[0].also = tuple(errors[1:])
        raise errors[0]


def error_of(finding: Finding) -> InputError:
    """What is said of a finding that is wrong."""
    unit = "" if finding.unit == "1" else f" {finding.unit}"
    mend = (
        f"set {finding.setting}: 'simrail check RIDE.toml --write mended.toml' does"
        if finding.setting
        else ""
    )
    return InputError(
        finding.why,
        field=finding.field,
        value=f"{finding.name} {finding.shown}",
        limit=f"{finding.nominal:g}{unit}",
        remedy="; or ".join(part for part in (finding.remedy, mend) if part)
        or "mend the method that made it",
    )


def warnings_of(evidence: Evidence) -> list[str]:
    """A line for each figure that is likely wrong."""
    return [error_of(finding).line for finding in evidence.wrong if finding.verdict == "likely wrong"]
