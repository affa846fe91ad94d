"""Single axes against the line: one alone may have another unit, another sign, or another's place.

The fit of `simrail.recording.evidence.judge` holds a device as a whole: its axes stay square. A logger that
gives one column the other sign makes a device that there is not. So each axis is held alone against what the
map and the way let expect of it, in means over a second: the gyro's X against the roll rate of
transitions, its Y against the pitch rate of vertical curves and what cant leaves of a turn, the
accelerometer's X against changes of speed, its Y against what speed and cant leave of curves. On a level line
without cant nothing tells of the gyro's Y, and that is said.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import Finding, Verdict
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
FX, FY = ACCEL[:2]

AXES = {
    RX: Axis("gyro X alone", "the roll rate of the transitions", "no transition with cant"),
    RY: Axis("gyro Y alone", "the pitch rate of the line", "no vertical and no canted curve to tell it by"),
    RZ: Axis("gyro Z alone", "the curves", "no curve"),
    FX: Axis("accelerometer X alone", "the change of speed", "no change of speed to tell it by"),
    FY: Axis("accelerometer Y alone", "what speed and cant leave of the curves", "no curve to feel"),
}
"""Which axes are judged, in the order in which they are told."""

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


def weigh_axes(recording: Recording) -> tuple[Finding, ...]:
    """What a ride says of each axis alone; nothing without a map or a way.

    Parameters
    ----------
    recording : Recording
        A ride.
    """
    way = way_of(recording) if recording.track.is_map else None
    if way is None:
        return ()
    count, time = max(1, round(recording.imu_sheet.rate_hz)), recording.imu.index.to_numpy(dtype=np.float64)
    went, speed, push = (
        means(np.interp(time, way.time_s, values), count)
        for values in (way.way_m, way.speed_mps, way.acceleration_mps2)
    )
    frame = recording.track.frame_extended(recording.start_position_m + went)
    along, level = -np.sin(frame.pitch_rad), np.cos(frame.pitch_rad) * np.sin(frame.roll_rad)
    gravity = recording.gravity_mps2
    expected = {
        RX: frame.k[:, 0] * speed,
        RY: frame.k[:, 1] * speed,
        RZ: frame.k[:, 2] * speed,
        FX: push + gravity * along,
        FY: frame.k[:, 2] * speed**2 + gravity * level,
    }
    found = {name: means(recording.imu[name].to_numpy(), count) for name in AXES}
    slopes = {name: slope(found[name], expected[name], LEAST[name]) for name in AXES}
    findings = [_judged(name, slopes[name]) for name in AXES]
    across = slope(found[RY], expected[RX], LEAST[RX])
    if findings[0].wrong and abs(across.value) > OTHER_SIGN and abs(across.value) > SURE * across.sd:
        findings[0] = _finding(
            RX,
            slopes[RX],
            "surely wrong",
            f"does not roll in the transitions, but its Y does, {across.value:.2g} times: their columns are "
            "swapped",
            "mend the order in columns.gyro, or the axes",
        )
    return tuple(findings)


def are_columns(findings: Sequence[Finding]) -> bool:
    """Whether all axes that a ride tells of follow the line, some against it, as no whole device would.

    Then the place, the way and the device are right, and the signs of columns wrong.

    Parameters
    ----------
    findings : sequence of Finding
        Those of `weigh_axes`.
    """
    told = {finding.key: finding for finding in findings if finding.sd < WANTED}
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
