"""Where a wheel spins or slides: that is what the ride has, and no fault of its file.

Under power a wheel spins up, and comes back to the train; under the brake it falls behind, and comes back.
Its acceleration leaves the accelerometer's by more than a clock or a factor would, twice, and what it has
gained in speed at the first it gives back at the second. Between the two its way is not the train's, and
behind them it is off by some metres, which the fit leaves open.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray
from simrail.recording.evidence.model import FORCE_X, Ride, blocks_of, motion, start_values
from simrail.recording.evidence.readings import expected

LEAST_MPS2, SPREADS = 0.4, 5.0
"""Difference of wheel and accelerometer at which a slide begins: no rail and no body makes so much for half a
second; and its least size in spreads of the difference."""

LONGEST_S = 20.0
"""Of a slide; what lasts longer is a factor or a clock."""

BACK = 0.35
"""Share of its greatest difference of speed below which a wheel has come back."""

MOST = 0.5
"""Share of the moving blocks that may be slides."""

PUSHED_MPS2, MOVING_MPS = 0.3, 0.5
"""Accelerations that tell the factor between wheel and accelerometer; and speeds at which a train moves."""


class Slide(NamedTuple):
    """First and last block of a slide, and the way that it may have cost, m."""

    first: int
    last: int
    way_m: float


def with_slides(ride: Ride) -> Ride | None:
    """The ride without what its wheel says while it slides; None where it does not.

    Parameters
    ----------
    ride : Ride
        The blocks.
    """
    found = slides_of(ride)
    slid = np.zeros(len(ride.measured), dtype=np.bool_)
    for one in found:
        slid[one.first : one.last + 1] = True
    moving = blocks_of(np.abs(motion(ride, start_values()).speed_mps)) > MOVING_MPS
    if not found or slid.sum() > MOST * moving.sum():
        return None
    return replace(ride, slides=found, slid=slid)


def slides_of(ride: Ride) -> tuple[Slide, ...]:
    """Slides of the wheel, by the accelerometer's X."""
    apart, block = _apart(ride), ride.block_s
    least = max(LEAST_MPS2, SPREADS * 1.4826 * float(np.median(np.abs(apart))))
    found, block_now = [], 0
    while block_now < len(apart):
        last = _end(apart, block_now, block) if abs(apart[block_now]) > least else None
        if last is None:
            block_now += 1
            continue
        gained = np.cumsum(apart[block_now : last + 1]) * block
        way = float(np.abs(gained).sum()) * block
        found.append(Slide(max(block_now - 1, 0), min(last + 1, len(apart) - 1), way))
        block_now = last + 2
    return tuple(found)


def slides_left(ride: Ride, x: FloatArray) -> tuple[Slide, ...]:
    """Slides of the wheel that a set of parameters (len(GLOBALS),) does not explain otherwise.

    A clock or a factor that is wrong makes wheel and accelerometer differ at each change of speed, and set
    right, they agree. Where they differ by as much as before, it is the wheel that slides.
    """
    apart = expected(ride, x)[:, FORCE_X] - ride.measured[:, FORCE_X]
    apart = np.abs(apart - np.median(apart))
    return tuple(one for one in slides_of(ride) if apart[one.first : one.last + 1].max() > LEAST_MPS2)


def _apart(ride: Ride) -> FloatArray:
    """Acceleration of the wheel less that of the accelerometer (b,), whatever factor is between them."""
    wheel, felt = expected(ride, start_values())[:, FORCE_X], ride.measured[:, FORCE_X]
    felt = felt - np.median(felt - wheel)
    pushed = np.abs(wheel) > PUSHED_MPS2
    factor = float(np.median(felt[pushed] / wheel[pushed])) if pushed.sum() >= 4 else 1.0
    apart: FloatArray = wheel - felt / factor if abs(factor) > 0.1 else np.zeros_like(wheel)
    return apart


def _end(apart: FloatArray, first: int, block_s: float) -> int | None:
    """Block in which a wheel that slides since `first` has come back; None if it does not."""
    gained = np.cumsum(apart[first : first + int(LONGEST_S / block_s)]) * block_s
    leads = np.sign(gained[0])
    back = np.flatnonzero(leads * gained < BACK * np.maximum.accumulate(leads * gained))
    return first + int(back[0]) if len(back) else None
