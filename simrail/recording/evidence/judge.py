"""From the fit to findings: what is sound, likely wrong, surely wrong, or could not be judged.

A figure is held against its nominal value in standard deviations: its own, with what a sound ride may be off
besides (the sheet's errors of scale and of the package, the map's of place and radius, what the model leaves
out). Beyond `LIKELY` of them it is likely wrong, beyond `SURE` surely: one normal figure is beyond
`LIKELY` in 0.2 of 500 sound rides. What a ride knows no better than `WANTED` is not called sound: it could
not be judged.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from simrail.core.errors import InputError
from simrail.recording.evidence.finding import Finding, Verdict
from simrail.recording.evidence.fit import Fit, fit
from simrail.recording.evidence.line import K3
from simrail.recording.evidence.model import (
    FORCE_X,
    GYRO_Z,
    INDEX,
    Ride,
    motion,
    ride_of,
    start_values,
)
from simrail.recording.evidence.start import scan
from simrail.recording.recording import Recording

LIKELY, SURE = 3.5, 8.0
"""Standard deviations from which on a figure is likely wrong, and surely."""

EXPLAINED = 0.9
"""Share of the gyro's Z, and of the push along X, that a fit explains: else other starts are tried."""

FOLLOWED = 0.5
"""Share of the gyro's Z that it must explain at least, for the curves to say anything."""

LEAST_TURN_RAD = 0.1
"""Turn of the track on a ride, there and back counted, from which on its curves say something."""

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
}
"""What is judged, in the order in which it is told; ``by`` is what it needs, one of them at least."""


DEARER = 0.15
"""Share by which a fit has to be better for each figure that it blames."""

GOOD = 0.05
"""Cost of a fit that is as good as any: what is better differs by what no part of the model holds."""

_MUCH = {"gyro": 0.05, "wheel": 0.05, "shift": 10.0, "yaw": 0.05, "offset": 0.2, "drift": 3e-4}
"""What counts as far."""


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
    """

    findings: tuple[Finding, ...]
    turn_rad: float = 0.0
    push_mps: float = 0.0
    middle_s: float = 0.0

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
        best = best_fit(ride)
    moved = motion(ride, best.x)
    turn = (
        np.abs(ride.table.at(moved.place_m)[:, K3] * moved.speed_mps).mean()
        * ride.block_s
        * len(ride.measured)
    )
    push = np.abs(moved.acceleration_mps2).mean() * ride.block_s * len(ride.measured)
    has = {
        "turn": bool(turn > LEAST_TURN_RAD and best.explained[GYRO_Z] > FOLLOWED),
        "push": bool(push > LEAST_PUSH_MPS),
    }
    rests = {"turn": f"{turn / _DEG:.0f} deg of curves", "push": f"{push:.0f} m/s of changes of speed"}
    slack = _slack(ride, best)
    findings = []
    for key, kind in KINDS.items():
        sources = [rests[by] for by in kind.by if has[by]]
        if kind.by and not sources:
            lacking = {"turn": "no curve that the gyro follows", "push": "no change of speed"}
            why = "the ride has " + " and ".join(lacking[by] for by in kind.by)
            findings.append(_unjudged(key, best.sd(key) / kind.si, "nothing", why))
            continue
        if not kind.by:
            sources = ["gravity" + " and curves" * has["turn"]]
        findings.append(_judged(key, best, slack[key], " and ".join(sources), ride))
    middle = ride.middle_s - float(ride.way.time_s[0])
    return Evidence(tuple(findings), float(turn), float(push), middle)


def best_fit(ride: Ride) -> Fit:
    """The fit from the sound ride's values; from others too where it blames or leaves much."""
    first = fit(ride, start_values())
    if _explains(ride, first) and not _blamed(first):
        return first
    fits = [first, *(fit(ride, x) for x in scan(ride))]
    # Whatever a fit blames has to pay for itself: a ride on other rails, the other way, may look much like
    # one whose gyro has the other sign.
    return min(fits, key=lambda other: (other.cost + GOOD) * (1.0 + DEARER * _blamed(other)))


def _blamed(found: Fit) -> int:
    """How many figures a fit has far from those of a sound ride."""
    nominal = start_values()
    return sum(
        abs(found.value(key) - nominal[INDEX[key]]) > SURE * found.sd(key) + _MUCH[key] for key in _MUCH
    )


def _explains(ride: Ride, found: Fit) -> bool:
    turning = float(np.abs(ride.measured[:, GYRO_Z]).mean() * ride.block_s * len(ride.measured))
    turns = turning < LEAST_TURN_RAD or found.explained[GYRO_Z] > EXPLAINED
    return bool(turns and found.explained[FORCE_X] > EXPLAINED)


def _slack(ride: Ride, found: Fit) -> dict[str, float]:
    """How far from its nominal value each may be in a sound ride, besides the fit's own sd; in SI."""
    recording = ride.recording
    sheet, errors = recording.imu_sheet, recording.map_errors
    package = sheet.package_misalignment_rad / math.sqrt(3.0)
    moved = motion(ride, found.x)
    curves = max(1, len(ride.table.curves_in(float(moved.place_m.min()), float(moved.place_m.max()))))
    seconds = float(ride.fine_s[-1] - ride.fine_s[0])
    clock = 0.02 + 0.02 * ride.reading_s
    return {
        "gyro": math.hypot(
            sheet.gyro_scale_error / math.sqrt(3.0), errors.radius_relative_sd / math.sqrt(curves), 0.003
        ),
        "wheel": math.hypot(ride.way.scale_sd, errors.chainage_scale_sd, 0.001),
        "shift": math.hypot(errors.chainage_offset_sd_m, 2.0),
        "yaw": math.hypot(package, 0.3 * _DEG),
        "pitch": math.hypot(package, errors.gradient_sd, 0.2 * _DEG),
        "roll": math.hypot(package, errors.cant_along_sd_m / recording.track.rail_base_m, 0.2 * _DEG),
        "offset": clock,
        "drift": math.hypot(sheet.clock_drift, 0.03 / seconds, 3e-5),
    }


def _judged(key: str, found: Fit, slack: float, rests_on: str, ride: Ride) -> Finding:
    kind = KINDS[key]
    nominal = start_values()[INDEX[key]]
    value, sd = found.value(key), found.sd(key)
    if key in ("yaw", "pitch", "roll"):
        value = math.remainder(value, 2.0 * math.pi)
    off = abs(value - nominal) / math.hypot(sd, slack)
    verdict: Verdict = "surely wrong" if off > SURE else "likely wrong" if off > LIKELY else "sound"
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
        side = "late" if value < 0.0 else "early"
        return f"the stamps of the {device} are {abs(value):.2f} s {side} against the IMU's", ""
    return f"the clock of the {device} drifts by {value * 1e6:+.0f} ppm against the IMU's", ""


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
