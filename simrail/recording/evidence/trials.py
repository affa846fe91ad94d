"""Trials of a ride: by which stamps, with what that changes within it, it is explained without blaming much.

A ride whose fit of whole devices blames one is tried with other causes: stamps of another pace, a clock that
drifts by per cents, a sensor that is not steady, a wheel that slides, something that changes at a moment.
Each is believed if the ride is then explained, blames nothing and leaves less.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import LIKELY
from simrail.recording.evidence.fit import Fit, fit, hints
from simrail.recording.evidence.midway import change_of
from simrail.recording.evidence.model import (
    CUTS,
    GAINS,
    LATES,
    PACE,
    RAMPS,
    Ride,
    retimed,
    ride_of,
    start_values,
    without_drift,
)
from simrail.recording.evidence.search import (
    apart_fit,
    are_apart,
    best_fit,
    explains,
    is_sound_start,
    price,
)
from simrail.recording.evidence.single import WHOLE, WORTH, Single, left_over, weigh_single
from simrail.recording.evidence.slack import accused, distance, slack_of
from simrail.recording.evidence.slides import with_slides
from simrail.recording.evidence.start import drift_by_turns, pace_by_turns

ROUNDS = 3
"""Of a search for the pace of the stamps."""

LESS = 0.9
"""Share of what whole devices leave, that another pace of the stamps may leave at most to be believed."""

MUCH = 1.0
"""Cost of a fit from which on it leaves more than rails and bodies make: some 0.1 m/s2 and 1 deg/s."""


class Fits(NamedTuple):
    """Fits of a ride: one clock in the IMU, two, faults of single axes; and the one that is believed."""

    one: Fit
    two: Fit
    single: Single
    best: Fit

    @property
    def is_apart(self) -> bool:
        """Whether that with two clocks is believed."""
        return self.best is self.two

    def blamed(self, ride: Ride) -> int:
        """How many figures it says are wrong."""
        accuses = accused(self.best, slack_of(ride, self.best), WHOLE)
        return accuses + len(self.single.free) + self.is_apart

    def price(self, ride: Ride, noise: FloatArray) -> float:
        """What the believed one leaves by a noise (2, 5), and what it blames."""
        return left_over(self.best, noise) + WORTH * (self.blamed(ride) + len(ride.slides))


def explained(ride: Ride) -> tuple[Ride, Fits]:
    """A ride and its fits; with what changes within it, if something does."""
    ride, fits = _unchanging(ride)
    if ride.slides or ride.drift or PACE in fits.single.free:
        return ride, fits
    changed = change_of(ride, fits.best, fits.blamed(ride))
    if changed is None:
        return ride, fits
    other, single = changed
    return other, Fits(single.found, single.found, single, single.found)


def _unchanging(ride: Ride) -> tuple[Ride, Fits]:
    """A ride and its fits; by other stamps, or without what its wheel says while it slides, if that is it."""
    one = best_fit(ride)
    two = apart_fit(ride, one)
    if _is_suspect(ride, one) or are_apart(ride, one, two):
        pace = pace_by_turns(ride)
        paced = None if pace is None else _paced(ride, pace, one)
        if paced is not None:
            return paced
        drift = drift_by_turns(ride)
        undrifted = None if drift is None else _undrifted(ride, drift, one)
        if undrifted is not None:
            return undrifted
        unsteady = _unsteady(ride, one)
        if unsteady is not None:
            return ride, unsteady
    fits = _fits(ride, one, two)
    slid = with_slides(ride) if fits.blamed(ride) else None
    if slid is None or not is_sound_start(slid, fit(slid, start_values())):
        return ride, fits
    others = _fits_of(slid)
    noise = others.best.noise
    return (slid, others) if others.price(slid, noise) < fits.price(ride, noise) else (ride, fits)


def _is_suspect(ride: Ride, one: Fit) -> bool:
    """Whether a fit of whole devices blames one, or leaves much, or leaves more and more."""
    slack = slack_of(ride, one)
    if accused(one, slack, WHOLE) or not explains(ride, one) or one.cost > MUCH:
        return True
    grows = hints(ride, one, RAMPS)
    return any(distance(name, *told, slack[name]) > LIKELY for name, told in grows.items())


def _paced(ride: Ride, pace: float, one: Fit) -> tuple[Ride, Fits] | None:
    """A ride whose stamps have another pace, and its fits by stamps that are set right; None if it has not.

    How rough a way is, and how long a block, is said in seconds: by stamps of another pace they are wrong.
    Gravity does not grow with the pace, what curves push does with its square, and what a gyro turns with
    itself: a gyro of another factor leaves the push, and what cant and curves leave, unexplained.
    """
    sd, other = math.inf, ride
    for _ in range(ROUNDS):
        set_right = ride_of(retimed(ride.recording, pace)) if pace > 0.0 else None
        if set_right is None:
            return None
        found = fit(set_right, start_values(), free=(PACE,))
        pace, sd, other = pace * found.value(PACE), pace * found.sd(PACE), set_right
        if abs(pace - 1.0) < LIKELY * sd:
            return None
    if not is_sound_start(other, found) or price(found) > LESS * price(one):
        return None
    again = _fits_of(other)
    single = again.single
    if again.blamed(other):
        return None
    single = replace(single, free=(PACE, *single.free), told=single.told | {PACE: (pace, sd)})
    return other, again._replace(single=single)


def _undrifted(ride: Ride, drift: float, one: Fit) -> tuple[Ride, Fits] | None:
    """A ride whose way has a clock that drifts by per cents, and its fits without; None if it has not."""
    for of_imu in (True, False):
        other = ride_of(without_drift(ride.recording, drift, of_imu=of_imu))
        first = None if other is None else fit(other, start_values())
        if not other or not first or not is_sound_start(other, first) or price(first) > LESS * price(one):
            continue
        again = _fits_of(other)
        if not again.blamed(other):
            return replace(other, drift=drift, of_imu=of_imu), again
    return None


def _unsteady(ride: Ride, one: Fit) -> Fits | None:
    """Fits of a ride of a sensor whose offset grows, or that takes off what is slow; None if it does not."""
    for names in (RAMPS, *((cut,) for cut in CUTS)):
        found = fit(ride, start_values(), free=names)
        slack = slack_of(ride, found)
        if accused(found, slack, WHOLE) or not explains(ride, found) or price(found) > LESS * price(one):
            continue
        told = {name: (found.value(name), found.sd(name)) for name in names}
        free = tuple(name for name in names if distance(name, *told[name], slack[name]) > LIKELY)
        if free:
            told |= hints(ride, found, [*GAINS, *LATES], free=names)
            return Fits(found, found, Single(found, free, told, slack), found)
    return None


def _fits_of(ride: Ride) -> Fits:
    one = best_fit(ride)
    return _fits(ride, one, apart_fit(ride, one))


def _fits(ride: Ride, one: Fit, two: Fit) -> Fits:
    is_apart = are_apart(ride, one, two)
    single = weigh_single(ride, one, two, is_apart=is_apart)
    return Fits(one, two, single, single.found if single.free else two if is_apart else one)
