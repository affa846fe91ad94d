"""Which fit of a ride: from the sound ride's values, from others, with one clock in the IMU or two.

A gyro whose samples are late is much like one with another factor, or a train elsewhere. So every ride is
fitted a second time, with a clock of the gyro's own; that fit is believed where the clocks are apart by more
than it leaves open, and where it is no dearer than the other.
"""

import math

import numpy as np

from simrail.recording.evidence.finding import LIKELY, SURE
from simrail.recording.evidence.fit import Fit, fit
from simrail.recording.evidence.model import FORCE_X, GYRO_Z, INDEX, Ride, start_values
from simrail.recording.evidence.slack import clock_slack
from simrail.recording.evidence.start import scan, scan_turns

EXPLAINED = 0.9
"""Share of the gyro's Z, and of the push along X, that a fit explains: else other starts are tried."""

LEAST_TURN_RAD = 0.1
"""Turn of the track on a ride, there and back counted, from which on its curves say something."""

DEARER = 0.15
"""Share by which a fit has to be better for each figure that it blames."""

GOOD = 0.05
"""Cost of a fit that is as good as any: what is better differs by what no part of the model holds."""

_MUCH = {
    "gyro": 0.05,
    "wheel": 0.05,
    "shift": 10.0,
    "yaw": 0.05,
    "offset": 0.2,
    "drift": 3e-4,
    "gyro_offset": 0.2,
}
"""What counts as far."""

NO_DEARER, NO_MORE = 1.2, 1.005
"""So much of the other's price a fit with two clocks may have: it may blame one figure more, and leave no
more, but for residuals that are weighed by others."""

KNOWN_S = 1.0
"""Standard deviation of a gyro's clock from which on a ride knows none of it, whatever its value."""


def best_fit(ride: Ride) -> Fit:
    """The fit from the sound ride's values; from others too where it blames or leaves much."""
    first = fit(ride, start_values())
    if is_sound_start(ride, first):
        return first
    fits = [first, *(fit(ride, x) for x in scan(ride))]
    # Whatever a fit blames has to pay for itself: a ride on other rails, the other way, may look much like
    # one whose gyro has the other sign.
    return min(fits, key=price)


def is_sound_start(ride: Ride, found: Fit) -> bool:
    """Whether a fit explains the ride and blames nothing, so that no other start is tried."""
    return explains(ride, found) and not _blamed(found)


def _blamed(found: Fit) -> int:
    """How many figures a fit has far from those of a sound ride."""
    nominal = start_values()
    return sum(
        abs(found.value(key) - nominal[INDEX[key]]) > SURE * found.sd(key) + _MUCH[key] for key in _MUCH
    )


def explains(ride: Ride, found: Fit) -> bool:
    """Whether a fit explains what the gyro turns and what pushes, if there is any."""
    turning = float(np.abs(ride.measured[:, GYRO_Z]).mean() * ride.block_s * len(ride.measured))
    turns = turning < LEAST_TURN_RAD or found.explained[GYRO_Z] > EXPLAINED
    return bool(turns and found.explained[FORCE_X] > EXPLAINED)


def price(found: Fit) -> float:
    """What a fit leaves, and what it blames: to compare fits of one ride."""
    return (found.cost + GOOD) * (1.0 + DEARER * _blamed(found))


def apart_fit(ride: Ride, one: Fit) -> Fit:
    """The best fit with a clock of the gyro's own.

    Parameters
    ----------
    ride : Ride
        The blocks.
    one : Fit
        The best one with one clock.
    """
    first = fit(ride, one.x, free=("gyro_offset",), noise=one.noise)
    if is_sound_start(ride, first):
        return first
    fits = [first]
    for x in (one.x, start_values()):
        trial = scan_turns(ride, x)
        if trial is not None:
            fits.append(fit(ride, trial, free=("gyro_offset",)))
    return min(fits, key=price)


def are_apart(ride: Ride, one: Fit, two: Fit) -> bool:
    """Whether a fit with two clocks is to be believed, rather than that with one."""
    sd = two.sd("gyro_offset")
    off = abs(two.value("gyro_offset")) / math.hypot(sd, clock_slack(ride))
    leaves_more = two.cost + GOOD > NO_MORE * (one.cost + GOOD)
    return sd < KNOWN_S and off > LIKELY and not leaves_more and price(two) <= NO_DEARER * price(one)


def accel_is_apart(ride: Ride, two: Fit) -> bool:
    """Whether it is the accelerometer whose clock is apart: gyro and the device of the way have one."""
    off, between = (
        abs(seen.value("offset")) / math.hypot(seen.sd("offset"), clock_slack(ride))
        for seen in (two, two.by_gyro())
    )
    return off > LIKELY > between
