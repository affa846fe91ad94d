"""What map and way let expect of single axes, in means over a second, and the slope of an axis on it.

The gyro's X is held against the roll rate of transitions, its Y against the pitch rate of vertical curves and
what cant leaves of a turn, the accelerometer's X against changes of speed, its Y against what speed and cant
leave of curves.
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.way import way_of
from simrail.recording.recording import Recording

OTHER_SIGN, OTHER_UNIT = 0.4, 4.0
"""Slopes beyond which (below minus, above) an axis has the other sign, or another unit."""

NEXT_TO_NONE = 0.2
"""Size of a slope below which an axis does not follow at all; in rad/s for deg/s it has 0.017."""

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

LEAST = dict.fromkeys((RX, RY, RZ), 2e-4) | dict.fromkeys((FX, FY), 0.02)
"""Rms of what the line lets expect, in means over a second, rad/s and m/s2, below which it tells nothing of
an axis: rails and bodies move as much by themselves, and a noiseless IMU would make a sure fault of it."""


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


def key_of(name: str) -> str:
    """Key of the finding of an axis."""
    return f"alone_{name}"


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
