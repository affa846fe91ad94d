"""Faults of one axis, one sensor or the time: which one explains a ride that devices as a whole do not.

A fit that may change whole devices only bends several of them around one axis that is wrong: an accelerometer
whose X is halved makes it a wheel, a gyro and a place. So each of `SINGLE` is set free in turn. By one step
from the fit of the whole devices first (`hints`); those that may be off are fitted, from there and, where
that fit blames something itself, from a sound ride's values. The one is believed that leaves least by its
own noise, if it is off by more than `LIKELY` standard deviations and pays for itself; then the next one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.evidence.finding import LIKELY, SURE
from simrail.recording.evidence.fit import OUTLIER, Fit, fit, hints
from simrail.recording.evidence.model import (
    ACCEL_GAIN,
    GAINS,
    INDEX,
    LATES,
    OF_CHANNEL,
    PACE,
    SINGLE,
    SLOW,
    TURNS,
    Ride,
    start_values,
)
from simrail.recording.evidence.readings import expected
from simrail.recording.evidence.search import explains, price
from simrail.recording.evidence.slack import accused, distance, slack_of
from simrail.recording.recording import Recording

MOST = 3
"""So many faults of single axes are looked for in one ride."""

HINT = 2.5
"""Standard deviations from which on a step is followed by a fit."""

WORTH = 12.25
"""What a figure that is blamed has to save of the squares of residuals: those of one `LIKELY` wrong."""

GRAVITY_SD_MPS2, TILTED = 0.026, 2e-3
"""How far gravity is from 9.81 between the equator and a pole, and what cant and gradient take off Z."""

OFFSET_SD_MPS2 = 0.04 * 9.80665 / math.sqrt(3.0)
"""Of an accelerometer's zero, whatever its sheet says: within 40 mg, so that the 80 mg that the MPU-6050's
specification has for Z (rev. 3.4, section 6.2) are not called wrong. Gravity is all that Z shows, and it is
always the same: nothing tells such an offset from a factor."""

LEAST_SHARE, LEAST_SURE_SHARE = 0.9, 0.7
"""Share of an axis that a fit has to explain, if it blames that, likely and surely."""

LEAST_UP = 0.01
"""How far the accelerometer's Z is off gravity where all of it may have another factor."""

FIRST_S = 0.3
"""Time constant from which a low-pass is looked for: at none, the model has no slope by it."""

SHOWN_BY = (GYRO[1], GYRO[0], GYRO[1])
"""Which axis shows most of a gyro that is rolled, pitched or yawed: one that turns little by itself."""

FEW, TRIAL, FOLLOWED = 3, 5, 3
"""Rounds of a first look, and of a fit that is compared with others; and how many looks are followed."""

WHOLE = ("gyro", "wheel", "shift", "yaw", "pitch", "roll", "offset", "drift")
"""What a fit may blame of whole devices."""


@dataclass(frozen=True)
class Single:
    """What a ride says of single axes, sensors and its time.

    Attributes
    ----------
    found : Fit
        The fit with what is wrong of them set free.
    free : tuple of str
        Which are; none in a sound ride.
    told : dict
        Value and sd of each of `SINGLE` that was looked at, all others as in the fit.
    slack : dict
        How far each may be off in a sound ride, besides.
    rivals : tuple of str
        What explains the ride nearly as well as the last of those that are free.
    changed_s : float, optional
        Time stamp of the IMU from which on they hold, where they begin within the ride.
    way : str
        Device that says how the train moved.
    """

    found: Fit
    free: tuple[str, ...]
    told: dict[str, tuple[float, float]]
    slack: dict[str, float]
    rivals: tuple[str, ...] = ()
    changed_s: float | None = None
    way: str = "encoder"

    def off(self, name: str) -> float:
        """How many standard deviations one of those that were looked at is off."""
        return distance(name, *self.told[name], self.slack[name])


class Up(NamedTuple):
    """Factor of the accelerometer's Z against gravity, and its standard deviation in a sound ride."""

    value: float
    sd: float


def up_of(recording: Recording) -> Up:
    """What the median of a ride says of the accelerometer's Z: what curves add passes, gravity stays."""
    sheet, gravity = recording.imu_sheet, recording.gravity_mps2
    value = float(np.median(recording.imu[ACCEL[2]].to_numpy())) / gravity
    bias = sheet.accel_turn_on_bias_mps2 / math.sqrt(3.0) + sheet.accel_bias_instability_mps2
    scale = sheet.accel_scale_error / math.sqrt(3.0)
    return Up(value, math.hypot((bias + GRAVITY_SD_MPS2) / gravity, OFFSET_SD_MPS2 / gravity, scale, TILTED))


def left_over(found: Fit, noise: FloatArray) -> float:
    """Squares of what a fit leaves, by a noise (2, 5), and of what it strains; large ones by their size."""
    size = np.abs(found.left) / noise[found.standing.astype(np.int64)]
    return float(np.sum(np.where(size < OUTLIER, size**2, OUTLIER * (2.0 * size - OUTLIER)))) + found.strain


def weigh_single(ride: Ride, whole: Fit, apart: Fit, *, is_apart: bool) -> Single:
    """What a ride says of single axes, sensors and its time.

    Parameters
    ----------
    ride : Ride
        The blocks.
    whole, apart : Fit
        The best ones of whole devices, with one clock in the IMU and with two.
    is_apart : bool
        Whether that with two is believed.
    """
    current = whole
    free: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    # Another pace is no step from here: the ride is fitted by stamps that are set right, before.
    out = {PACE} if abs(up_of(ride.recording).value - 1.0) > LEAST_UP else {PACE, ACCEL_GAIN}
    known = [name for name in SINGLE if name not in out]
    told = hints(ride, current, [name for name in known if name not in SLOW])
    while len(free) < MOST:
        slack = slack_of(ride, current)
        names = [name for name in known if name not in free]
        hinted = [name for name in names if name in told and distance(name, *told[name], 0.0) > HINT]
        hinted += [name for name in SLOW if name in names and any(late in hinted for late in LATES)]
        fits = _tried(ride, current, free, hinted)
        against = [current] if free or not is_apart else [current, apart]
        doubted = _doubted(ride, against, free, names, slack)
        if doubted:
            fits = _better(fits, _from_sound(ride, current, free, doubted))
        best = _best(fits, against, slack)
        if best is None:
            break
        rivals = _rivals(best, fits, slack)
        current, free = fit(ride, fits[best].x, free=(*free, best), noise=fits[best].noise), (*free, best)
        others = [name for name in known if name not in SLOW and name not in free]
        told = hints(ride, current, others, free=free)
    told |= {name: (current.value(name), current.sd(name)) for name in free}
    return Single(current, free, told, slack_of(ride, current), rivals)


def _doubted(
    ride: Ride, against: Sequence[Fit], free: Sequence[str], names: Sequence[str], slack: dict[str, float]
) -> list[str]:
    """Which parameters may explain what fits of whole devices blame, so that they are begun anew.

    All of them where no fit explains the ride, or the best one blames several figures, or one and another
    parameter would still help it; of a clock that is blamed alone, a low-pass; else none.
    """
    best, is_apart = against[-1], len(against) > 1
    blamed = accused(best, slack, WHOLE) + is_apart
    if not explains(ride, best) or blamed > 1:
        return list(names)
    if not blamed:
        return []
    told = hints(
        ride, best, [name for name in names if name not in SLOW], free=(*free, *("gyro_offset",) * is_apart)
    )
    if any(distance(name, *found, 0.0) > HINT for name, found in told.items()):
        return list(names)
    is_late = is_apart or accused(best, slack, ("offset",)) > 0
    return [name for name in SLOW if is_late and name in names]


def _tried(ride: Ride, current: Fit, free: Sequence[str], names: Sequence[str]) -> dict[str, Fit]:
    """Fits with one more parameter free each, from where the last one ended."""
    fits = {}
    for name in names:
        x = current.x.copy()
        if name in SLOW:
            x[INDEX[name]] = FIRST_S
        fits[name] = fit(ride, x, free=(*free, name), rounds=TRIAL)
    return fits


def _from_sound(ride: Ride, current: Fit, free: Sequence[str], names: Sequence[str]) -> dict[str, Fit]:
    """The best of such fits from a sound ride's values, for a fit of whole devices that may be far off."""
    begun = {}
    for name in names:
        x = start_values()
        for other in free:
            x[INDEX[other]] = current.value(other)
        if name in SLOW:
            x[INDEX[name]] = FIRST_S
        elif name in GAINS:
            x[INDEX[name]] = _slope(ride, x, GAINS.index(name))
        begun[name] = fit(ride, x, free=(*free, name), rounds=FEW)
    best = sorted(begun, key=lambda name: price(begun[name]))[:FOLLOWED]
    return {name: fit(ride, begun[name].x, free=(*free, name), rounds=TRIAL) for name in best}


def _better(fits: dict[str, Fit], others: dict[str, Fit]) -> dict[str, Fit]:
    """The better one of each name."""
    best = fits | others
    return best | {name: min(fits[name], others[name], key=price) for name in fits.keys() & others.keys()}


def _slope(ride: Ride, x: FloatArray, channel: int) -> float:
    """Slope of a channel on what is expected of it; 1 where nothing is."""
    first, then = (
        values[:, channel] - values[:, channel].mean() for values in (expected(ride, x), ride.measured)
    )
    power = float(first @ first)
    return float(first @ then) / power if power > 0.0 else 1.0


def _best(fits: dict[str, Fit], against: Sequence[Fit], slack: dict[str, float]) -> str | None:
    """Which of some fits with one more parameter is believed, rather than those without; None if none is."""
    blamed = {name: accused(found, slack, WHOLE) for name, found in fits.items()}
    least = min(accused(other, slack, WHOLE) for other in against)
    off = {
        name: distance(name, found.value(name), found.sd(name), slack[name]) for name, found in fits.items()
    }
    bare = {name: distance(name, found.value(name), found.sd(name), 0.0) for name, found in fits.items()}
    kept = [
        name
        for name in fits
        if off[name] > LIKELY or (least > 0 and blamed[name] == 0 and bare[name] > LIKELY)
    ]
    kept = [name for name in kept if _follows(name, fits[name], off[name])]
    if not kept:
        return None
    noise = np.min([fits[name].noise for name in kept], axis=0)
    best = min(kept, key=lambda name: left_over(fits[name], noise) + WORTH * blamed[name])
    noise = fits[best].noise
    left = left_over(fits[best], noise) + WORTH * (1 + blamed[best])
    is_worth = all(
        left + WORTH * (i > 0) < _left_of(other, noise, slack, i) for i, other in enumerate(against)
    )
    return best if is_worth else None


def _follows(name: str, found: Fit, off: float) -> bool:
    """Whether an axis that is so far off follows the line at all: bodies on springs roll by themselves."""
    least = LEAST_SURE_SHARE if off > SURE else LEAST_SHARE
    for names, channels in ((GAINS, OF_CHANNEL), (LATES, OF_CHANNEL), (TURNS, SHOWN_BY)):
        if name in names:
            return bool(found.explained[OF_CHANNEL.index(channels[names.index(name)])] > least)
    return True


def _left_of(other: Fit, noise: FloatArray, slack: dict[str, float], clocks: int) -> float:
    """What a fit of whole devices leaves, and what it blames; a gyro's clock of its own is blamed, too."""
    return left_over(other, noise) + WORTH * (accused(other, slack, WHOLE) + clocks)


def _rivals(best: str, fits: dict[str, Fit], slack: dict[str, float]) -> tuple[str, ...]:
    """Others that leave hardly more than the best one."""
    noise = fits[best].noise
    least = left_over(fits[best], noise) + WORTH * accused(fits[best], slack, WHOLE)
    return tuple(
        name
        for name, found in fits.items()
        if name != best
        and distance(name, found.value(name), found.sd(name), slack[name]) > LIKELY
        and left_over(found, noise) + WORTH * accused(found, slack, WHOLE) < least + WORTH
    )
