"""A second IMU, judged as the first one is: its gyro, its mounting, its clock, and how far behind it sits.

It rides on the same train, so the same way and the same map say what it should read, at a place of its own.
The device of the way stamps by one clock: what that is off against the first IMU's clock and against the
second one's tells what those two are off against each other.
"""

import math
from dataclasses import replace

from simrail.recording.evidence.axes import weigh_axes
from simrail.recording.evidence.finding import Finding, Verdict, verdict_of
from simrail.recording.evidence.judge import KINDS, Evidence, Kind, weigh
from simrail.recording.recording import Recording, SecondImuSheet, second_alone

OWN = ("gyro", "yaw", "pitch", "roll", "gyro_offset")
"""What is judged of the device alone, by the map."""

PLACE_SD_M = 3.0
"""Of the distance of both along the track: two fits of one map, and bodies that turn about another point
than their drawings'."""

CLOCK_SD_S, DRIFT_SD = 0.01, 5e-5
"""Of a clock against another one, as two fits tell it, beside what the sheet says."""


def weigh_second(recording: Recording, first: Evidence) -> tuple[Finding, ...]:
    """What a ride says of its second IMU; nothing where it has none.

    Parameters
    ----------
    recording : Recording
        A ride that has passed `simrail.recording.check_form.check_recording`.
    first : Evidence
        What it says of the first one.
    """
    alone, sheet = second_alone(recording), recording.second_imu_sheet
    if alone is None or sheet is None:
        return ()
    second = weigh(alone)
    findings = [_renamed(second.of(key)) for key in OWN]
    beside = [
        _spacing(first, second, recording, sheet),
        _clock("offset", first, second, sheet.clock_offset_sd_s),
        _clock("drift", first, second, sheet.imu.clock_drift),
    ]
    # Slopes on a line that is met elsewhere, or at another time, say nothing of an axis.
    is_single = second.single is not None and bool(second.single.free)
    is_elsewhere = any(finding.verdict == "surely wrong" for finding in (*findings, *beside))
    if is_single or not is_elsewhere:
        findings += [_renamed(finding) for finding in weigh_axes(alone, second.single) if finding.wrong]
    return (*findings, *beside)


def _renamed(finding: Finding) -> Finding:
    """A finding of an IMU as one of the second."""
    table = "second_imu."
    return replace(
        finding,
        name=f"second IMU: {finding.name}",
        key=f"second_{finding.key}",
        why=f"the second IMU: {finding.why}" if finding.why else "",
        setting=finding.setting.replace("imu.", table, 1),
        field=finding.field.replace("imu.", table, 1),
        remedy=finding.remedy.replace("units.gyro", "second_imu.units.gyro"),
    )


def _spacing(first: Evidence, second: Evidence, recording: Recording, sheet: SecondImuSheet) -> Finding:
    """How far the second IMU sits behind the first, by the places at which both feel the curves.

    A body turns as one: both IMUs on one body feel a curve at once, and how far they are apart is not seen.
    """
    ours, theirs = first.of("shift"), second.of("shift")
    ahead = recording.mount_position_m[0] - sheet.mount_position_m[0]
    value = sheet.spacing_m - (theirs.value - ours.value) + ahead
    kind = Kind("second IMU: metres behind the first", "m", 1.0, 15.0, ("turn",))
    if sheet.mount_body == recording.mount_body:
        ours = replace(ours, rests_on="nothing", why="both are on one body, which turns as one")
    slack = math.hypot(PLACE_SD_M, sheet.spacing_sd_m)
    why = f"the second IMU meets the curves {value:.1f} m behind the first"
    setting = "second_imu.spacing_m"
    return _compared("spacing", kind, (ours, theirs), value, sheet.spacing_m, slack, setting, why)


def _clock(key: str, first: Evidence, second: Evidence, told: float) -> Finding:
    """What has to be added to the stamps of the second IMU, to be those of the first one's clock."""
    ours, theirs = first.of(key), second.of(key)
    value = ours.value - theirs.value
    own = KINDS[key]
    kind = own._replace(name=f"second IMU: {own.name}", wanted=math.sqrt(2.0) * own.wanted)
    if key == "offset":
        slack, setting = math.hypot(CLOCK_SD_S, told), "second_imu.time_offset_s"
        side = "late" if value < 0.0 else "early"
        why = f"the stamps of the second IMU are {abs(value):.2f} s {side} against the first one's"
    else:
        slack, setting = math.hypot(DRIFT_SD, told) / kind.si, "second_imu.time_drift_ppm"
        why = f"the clock of the second IMU drifts by {value:+.0f} ppm against the first one's"
    return _compared(f"second_{key}", kind, (ours, theirs), value, 0.0, slack, setting, why)


def _compared(
    key: str,
    kind: Kind,
    both: tuple[Finding, Finding],
    value: float,
    nominal: float,
    slack: float,
    setting: str,
    why: str,
) -> Finding:
    """The judgement of a figure that two fits tell together, in the unit of its kind."""
    sd = math.hypot(both[0].sd, both[1].sd)
    told = [finding for finding in both if finding.rests_on == "nothing"]
    if told:
        nothing: Verdict = "could not be judged"
        return Finding(kind.name, key, nominal, sd, nominal, kind.unit, "nothing", nothing, told[0].why)
    off = abs(value - nominal) / math.hypot(sd, slack)
    verdict = verdict_of(off)
    if verdict == "sound":
        why = ""
        if sd > kind.wanted:
            verdict, why = "could not be judged", "the ride tells too little of it"
    rests_on = both[1].rests_on
    return Finding(kind.name, key, value, sd, nominal, kind.unit, rests_on, verdict, why, setting, setting)
