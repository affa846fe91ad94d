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

import numpy as np

from simrail.core.columns import GYRO
from simrail.recording.evidence.finding import LIKELY, Finding, Verdict, verdict_of
from simrail.recording.evidence.finding import SURE as CERTAIN
from simrail.recording.evidence.model import ACCEL_GAIN, FORCE_X, GAINS, LATES, OF_CHANNEL
from simrail.recording.evidence.of_all import ALL_ACCEL, of_all, or_else, verdict_by
from simrail.recording.evidence.single import Single, Up, up_of
from simrail.recording.evidence.slopes import (
    AXES,
    FX,
    FY,
    FZ,
    LEAST,
    NEXT_TO_NONE,
    OTHER_SIGN,
    OTHER_UNIT,
    RX,
    RY,
    RZ,
    SURE,
    WANTED,
    Slope,
    expected_of,
    key_of,
    seconds_of,
    slope,
)
from simrail.recording.recording import Recording

SQUARE = 1.4
"""Slopes between 1 over this and this, of either sign, are those of an axis that follows."""

APART = 1.5
"""Standard deviations between two explanations from which on one is preferred."""

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


def _numbered(finding: Finding, channel: int, single: Single) -> Finding:
    """The finding of an axis with its number, by the fit of all."""
    name, gain, late = OF_CHANNEL[channel], GAINS[channel], LATES[channel]
    if gain in single.free:
        return _scaled(name, Slope(*single.told[gain]), verdict_by(gain, single), or_else(gain, single))
    if late in single.free:
        value, side = single.told[late][0], "late" if single.told[late][0] < 0.0 else "early"
        return replace(
            _finding(name, Slope(*single.told[late]), verdict_of(single.off(late))),
            name=f"{AXES[name].name}: offset of its clock",
            nominal=0.0,
            unit="s",
            verdict=verdict_by(late, single),
            why=f"is {abs(value):.2f} s {side}, against all other axes",
            remedy="; or ".join(
                part
                for part in (
                    "shift that column alone, by so many samples: no setting does",
                    or_else(late, single),
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
