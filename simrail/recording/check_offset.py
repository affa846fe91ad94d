"""Is this the offset of that device? What a gyro shows while nothing turns it, held against its sheet.

A logger that takes off the mean of a ride, or an automatic zero while the train turned, leaves a gyro that
shows at rest what it should not; so does a device that is another than its sheet's, or that is still warm
from elsewhere. What is far more than that is refused (`simrail.recording.check_physics`).
"""

import math

from simrail.recording.recording import Recording, imus
from simrail.recording.triads import Triad, rests_of, triads_of

SETTLES_RAD = 0.01
"""What a body turns by at a rest, by itself: as it settles, and as people board. Twice what it leans by."""

EARTH_RADPS = 7.292e-5
"""Rate of the Earth, which a gyro that is still shows (IERS Conventions 2010, table 1.1: 7.292115e-5)."""

FAR = 5.0
"""Standard deviations of noise, and of a bias that wanders, that are no fault yet."""


def offset_warnings(recording: Recording) -> tuple[str, ...]:
    """A warning for a gyro whose mean at the longest rest is more than the turn-on bias of its sheet.

    Parameters
    ----------
    recording : Recording
        A ride; of both IMUs, where there are two. A sheet without a turn-on bias says nothing.
    """
    told: list[str] = []
    for table, alone in imus(recording):
        rests = rests_of(alone)
        longest = max(rests, key=lambda rest: rest.stop - rest.start, default=None)
        for triad in triads_of(alone, table):
            if longest is not None and triad.kind == "gyro" and triad.sheet.gyro_turn_on_bias_radps > 0.0:
                told += _beyond(triad, longest)
    return tuple(told)


def _beyond(triad: Triad, rest: slice) -> list[str]:
    """A warning of the axis that is farthest beyond its sheet."""
    sheet, count, by = triad.sheet, rest.stop - rest.start, math.degrees(1.0)
    lasts, after = count / sheet.rate_hz, rest.stop / sheet.rate_hz
    wanders = math.hypot(
        triad.noise / math.sqrt(count),
        sheet.gyro_bias_instability_radps,
        sheet.gyro_random_walk_radpspsqrts * math.sqrt(after),
    )
    bound = sheet.gyro_turn_on_bias_radps
    limit = bound + FAR * wanders + EARTH_RADPS + SETTLES_RAD / lasts
    means = triad.values[rest].mean(axis=0)
    axis = int(abs(means).argmax())
    if abs(means[axis]) <= limit:
        return []
    return [
        f"{triad.field}: {'XYZ'[axis]} shows {by * means[axis]:+.2g} deg/s at rest, and the bias of "
        f"{sheet.grade} at switch-on is {by * bound:.2g} deg/s at most: the mean of the ride was taken off, "
        "or a zero while the train turned, or the device is another; log raw samples, or take off what it "
        "shows at rest"
    ]
