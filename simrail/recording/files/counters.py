"""Counters that begin anew: a modulus is undone, a reset is refused.

A counter of 16 bits goes from 65535 to 0 (or from 32767 to -32768), one of another device from 8999 to 0.
The sum over a ride is right once each such jump is taken as the small step that it was. A counter that was
set to zero lost what it had counted, and nobody can tell how much: that is refused, with its place.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import rate_of

WHEEL_JUMP_MPS = 60.0
"""From one reading to the next no wheel's speed changes by more, be it that it locks or spins."""

FASTEST_MPS = 170.0
"""Of all trains on rails the fastest ran at 160 m/s."""

LEAST_JUMP = 4
"""Pulses below which a step is no jump: a late stamp may move a few from one step to the next."""

LONE_JUMP_MPS, LONE_JUMP_MPS2 = 3.0, 30.0
"""Speed that a wheel cannot have for one reading alone, beside 1.5 times that of the readings around it, and
the acceleration that takes. A late reading has it, too, but the next one makes up for it."""

FOLLOWED = 0.45
"""Share of the modulus up to which a step tells its direction: beyond half of it, it is a step back."""

COMMON = (
    *(2**bits for bits in (*range(8, 33), 48)),
    *(10**digits for digits in (3, 4, 5, 6, 7, 8, 9)),
)
"""Moduli that devices have, so that one jump is enough to know them."""


class Unwrapped(NamedTuple):
    """A counter without its jumps.

    Attributes
    ----------
    counts : ndarray (n,) of int64
        Counts that go on.
    modulus : int
        What was undone; 0 if there was nothing.
    times : int
        How often.
    """

    counts: np.ndarray
    modulus: int = 0
    times: int = 0


def unwrap(
    counts: np.ndarray, time: FloatArray, *, m_per_pulse: float, turn: int, modulus: int | None, field: str
) -> Unwrapped:
    """Undo the modulus of a pulse counter.

    Parameters
    ----------
    counts : ndarray (n,) of int64
        As read.
    time : ndarray (n,)
        Strictly increasing, s.
    m_per_pulse : float
        Way of one pulse.
    turn : int
        Pulses per revolution, a common modulus.
    modulus : int, optional
        The counter's, where it is known.
    field : str
        Where the counts stand, for the message.

    Raises
    ------
    InputError
        If the counter jumps and that is no modulus: naming time and size of the first jump.
    """
    step = np.diff(counts)
    if modulus is not None:
        turns = np.rint(step / modulus).astype(np.int64)
        return _followed(
            Unwrapped(_without(counts, turns * modulus), modulus, int(np.count_nonzero(turns))), field
        )
    _refuse_fast(step, time, m_per_pulse, field)
    jumps = _jumps(counts, step, time, m_per_pulse)
    if not len(jumps):
        return Unwrapped(counts)
    smooth = _smooth(step, jumps)
    size = smooth[jumps] - step[jumps]
    slack = np.maximum(LEAST_JUMP, np.abs(smooth[jumps]))
    found = _modulus(counts, np.abs(size), slack, (*COMMON, turn, 4 * turn))
    if found is None:
        at = int(jumps[0])
        more = f" (and {len(jumps) - 1} more such jumps)" if len(jumps) > 1 else ""
        raise InputError(
            f"the counter jumps at time_s = {time[at + 1]:.9g}{more}",
            field=field,
            value=f"{int(step[at])} pulses in {time[at + 1] - time[at]:.4g} s, from {int(counts[at])} to "
            f"{int(counts[at + 1])}",
            limit="a step that a wheel can make, or one of 2^16, 2^32, ...",
            remedy="if it was set to zero or lost pulses cut the recording there; if it begins anew after N "
            "pulses give counter_modulus = N",
        )
    turns = np.zeros(len(step), dtype=np.int64)
    turns[jumps] = -np.sign(size).astype(np.int64)
    return _followed(Unwrapped(_without(counts, turns * found), found, len(jumps)), field)


def _refuse_fast(step: np.ndarray, time: FloatArray, m_per_pulse: float, field: str) -> None:
    """Refuse counts that are those of no train nearly all the time: a unit or a figure is wrong."""
    speed = np.abs(step) * m_per_pulse / np.diff(time)
    usual = float(np.median(speed[step != 0])) if step.any() else 0.0
    if usual > FASTEST_MPS and np.count_nonzero(step) > 0.2 * len(step):
        raise InputError(
            "the counter runs faster than any train",
            field=field,
            value=f"{usual:.4g} m/s in the median",
            limit=f"{FASTEST_MPS:g} m/s",
            remedy="mend units.time, pulses_per_revolution or wheel_radius_m",
        )


def _followed(found: Unwrapped, field: str) -> Unwrapped:
    """The same, unless it turned by so much between two readings that nobody knows the direction."""
    most = int(np.abs(np.diff(found.counts)).max(initial=0))
    if found.times and most > FOLLOWED * found.modulus:
        raise InputError(
            f"the counter begins anew after {found.modulus} pulses: too few to tell how far it went",
            field=field,
            value=f"{most} pulses between two readings",
            limit=f"{FOLLOWED * found.modulus:g}",
            remedy="read the counter more often, or let it count further; or give counter_modulus = N",
        )
    return found


def _without(counts: np.ndarray, jumped: np.ndarray) -> np.ndarray:
    whole: np.ndarray = counts.copy()
    whole[1:] -= np.cumsum(jumped)
    return whole


def _jumps(counts: np.ndarray, step: np.ndarray, time: FloatArray, m_per_pulse: float) -> np.ndarray:
    """Steps that no wheel makes: too far from those around, or most of the counter's range, often."""
    if len(step) < 3 or not step.any():
        return np.empty(0, dtype=np.int64)
    interval = 1.0 / rate_of(time)
    speed = step * m_per_pulse / np.maximum(np.diff(time), interval)
    usual = _local_median(speed)
    off = speed - usual
    far = np.abs(off) > WHEEL_JUMP_MPS
    least = np.maximum(LONE_JUMP_MPS, LONE_JUMP_MPS2 * interval)
    around = np.convolve(off, np.ones(5), mode="same")
    lone = (np.abs(off) > np.maximum(least, 1.5 * np.abs(usual))) & (np.abs(around) > 0.7 * np.abs(off))
    far |= lone & (np.abs(step) > 2 * LEAST_JUMP)
    # A short modulus: its steps are possible speeds, but they span the range, again and again.
    span = float(np.ptp(counts))
    wide = (np.abs(step) > 0.5 * span) & (span >= 16)
    if np.count_nonzero(wide) < 3 or np.abs(step).sum() < 3.0 * span:
        wide[:] = False
    found: np.ndarray = np.flatnonzero((far & (np.abs(step) > LEAST_JUMP)) | wide)
    return found


def _local_median(values: FloatArray) -> FloatArray:
    padded = np.pad(values, 2, mode="edge")
    return np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)


def _smooth(step: np.ndarray, jumps: np.ndarray) -> FloatArray:
    """The steps, with those of the jumps as the sound ones around them."""
    sound = np.ones(len(step), dtype=bool)
    sound[jumps] = False
    if not sound.any():
        return np.zeros(len(step))
    places = np.arange(len(step))
    filled: FloatArray = np.interp(places, places[sound], step[sound].astype(np.float64))
    return filled


def _modulus(counts: np.ndarray, size: FloatArray, slack: FloatArray, common: tuple[int, ...]) -> int | None:
    """The modulus whose multiples the jumps are; None if they are not all of one."""
    least = int(np.ptp(counts)) + 1
    middle, several = float(np.mean(size)), len(size) > 1
    if (np.abs(size - middle) > 2.0 * slack).any():
        return None
    # Of several jumps each errs by as much as the steps around it differ.
    sd = float(np.std(size, ddof=1) / np.sqrt(len(size))) if several else 0.0
    near = 3.0 * sd + 1.0 if several else float(slack[0])
    found = [one for one in common if one >= least and abs(one - middle) <= near]
    if found:
        return min(found, key=lambda one: abs(one - middle))
    if not several:
        return None
    # Of any length: known to the mean of its jumps, and there the roundest number.
    low, high = max(least, int(np.ceil(middle - near))), int(middle + near)
    for unit in (10000, 1000, 100, 64, 10, 8, 4, 2, 1):
        multiple = -(-low // unit) * unit
        if multiple <= high:
            return multiple
    return None
