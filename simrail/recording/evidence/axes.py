"""Single axes against the line: one alone may have another unit, another sign, or another's place.

The fit of `simrail.recording.evidence.judge` holds a device as a whole: its axes stay square. A logger that
gives one column the other sign makes a device that there is not. So each axis is held alone against what the
map and the way let expect of it, in means over a second: the gyro's X against the roll rate of
transitions, its Y against the pitch rate of vertical curves and what cant leaves of a turn, the
accelerometer's X against changes of speed, its Y against what speed and cant leave of curves. On a level line
without cant nothing tells of the gyro's Y, and that is said.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import Finding, Verdict
from simrail.recording.evidence.way import way_of
from simrail.recording.recording import Recording

OTHER_SIGN, OTHER_UNIT = 0.4, 4.0
"""Slopes beyond which (below minus, above) an axis has the other sign, or another unit."""

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


class Axis(NamedTuple):
    """How an axis is told: its name, what it is held against, and what a ride without a word of it lacks."""

    name: str
    of: str
    lacks: str


AXES = {
    GYRO[0]: Axis("gyro X alone", "the roll rate of the transitions", "no transition with cant"),
    GYRO[1]: Axis(
        "gyro Y alone",
        "the pitch rate of the line",
        "no vertical curve and no canted curve that tells of it",
    ),
    ACCEL[0]: Axis("accelerometer X alone", "the change of speed", "no change of speed that tells of it"),
    ACCEL[1]: Axis(
        "accelerometer Y alone",
        "what speed and cant leave of the curves",
        "no curve that speed or cant is felt in",
    ),
}
"""Which axes are judged, in the order in which they are told; of the gyro's Z the whole fit tells."""


def weigh_axes(recording: Recording) -> tuple[Finding, ...]:
    """What a ride says of each axis alone; nothing without a map or a way.

    Parameters
    ----------
    recording : Recording
        A ride in which no device as a whole is wrong.
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
    twist, gravity = frame.k[:, 0] * speed, recording.gravity_mps2
    expected = {
        GYRO[0]: twist,
        GYRO[1]: frame.k[:, 1] * speed,
        ACCEL[0]: push + gravity * along,
        ACCEL[1]: frame.k[:, 2] * speed**2 + gravity * level,
    }
    found = {name: means(recording.imu[name].to_numpy(), count) for name in AXES}
    slopes = {name: slope(found[name], expected[name]) for name in AXES}
    findings = [_judged(name, slopes) for name in AXES]
    across = slope(found[GYRO[1]], twist)
    if findings[0].verdict != "surely wrong" and _is_swapped(slopes[GYRO[0]], across):
        findings[0] = _finding(
            GYRO[0],
            slopes[GYRO[0]],
            "surely wrong",
            f"does not roll in the transitions, but its Y does, {across.value:.2g} times: their columns are "
            "swapped",
            "mend the order in columns.gyro, or the axes",
        )
    return tuple(findings)


def _judged(name: str, slopes: Mapping[str, Slope]) -> Finding:
    """What is found of one axis."""
    axis, found = AXES[name], slopes[name]
    # Where nothing tells that its others are right, the device may look backwards as a whole.
    others = any(slopes[other].along for other in (GYRO[0], GYRO[1], ACCEL[1]))
    if found.against and (name != ACCEL[0] or others):
        remedy = "give that column alone the other sign, or mend the axes"
        return _finding(name, found, "surely wrong", f"goes against {axis.of}", remedy)
    if found.many:
        remedy = "mend the unit: one axis alone has another one"
        return _finding(name, found, "surely wrong", f"is many times {axis.of}", remedy)
    if found.sd > WANTED:
        return _finding(name, found, "could not be judged", f"the ride has {axis.lacks}")
    return _finding(name, found, "sound")


def _finding(name: str, found: Slope, verdict: Verdict, why: str = "", remedy: str = "") -> Finding:
    axis, key = AXES[name], f"alone_{name}"
    rests_on = "nothing" if verdict == "could not be judged" else axis.of
    return Finding(
        axis.name,
        key,
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


def _is_swapped(roll: Slope, across: Slope) -> bool:
    """Whether the gyro's Y rolls where its X should, which does not."""
    rolls = abs(across.value) > OTHER_SIGN and abs(across.value) > SURE * across.sd
    return rolls and abs(roll.value) < OTHER_SIGN and 1.0 - roll.value > SURE * roll.sd


def slope(measured: FloatArray, expected: FloatArray) -> Slope:
    """Slope of the least-squares line measured = a + slope * expected."""
    x, y = expected - expected.mean(), measured - measured.mean()
    power = float(x @ x)
    if power == 0.0:
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
