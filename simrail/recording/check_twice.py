"""Was it measured once? Blocks of samples that stand twice in a signal, told by their noise.

A logger that writes its buffer again, or who joins files that overlap, leaves samples that are those of
another time to the last digit. No device repeats its noise, so a few samples in a row are enough.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, IntArray

CHANCE = 1e-9
"""Chance that a sound signal has two such blocks, from which on they are no chance."""

LEAST, MOST = 8, 64
"""Samples of a block; where a longer one would be needed the decimals are too coarse to tell."""

AROUND, PAIRS = 64, 1000
"""Samples on each side of a block that say how it lives; and pairs of blocks that are looked at."""

LOOKED_AT = 500_000
"""Blocks that are held against each other; of longer signals one in so many, chosen by their samples."""

_PART = 1_000_000
_KEYS = tuple(np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64))


def check_twice(
    names: Sequence[str],
    values: Sequence[FloatArray],
    noise: float,
    place: Callable[[int], str],
    time: FloatArray,
    file: str | None = None,
) -> None:
    """Refuse a triad that holds the same samples at two times.

    Parameters
    ----------
    names : sequence of str
        How messages call its axes.
    values : sequence of ndarray (n,)
        Its samples.
    noise : float
        Of a sample, as the device shows it; 0 of a computed ride, which may repeat itself.
    place : callable
        Place of a sample in its file, in words.
    time : ndarray (n,)
        Time stamps, s.
    file : str, optional
        The file, for messages.

    Raises
    ------
    InputError
        With the first block that stands there again, and where it stands first.
    """
    size = _size(values, noise, len(values[0]))
    if size is None or len(values[0]) <= 2 * size or np.any(np.diff(time) <= 0.0):
        return
    pair = _first_pair(values, size, noise)
    if pair is None:
        return
    first, again = pair
    count = _length(values, first, again)
    raise InputError(
        f"holds the samples from time_s = {time[first]:.6g} on again, to the last digit, from {place(again)} "
        f"to time_s = {time[again + count - 1]:.6g}; no device repeats its noise",
        file=file,
        field=", ".join(names),
        value=f"{count} samples that are equal",
        limit=f"each once; fewer than {size} in a row by chance",
        remedy="drop the second of the two blocks, so that it is a gap; what follows it, if it is late by so "
        "much, needs its own stamps; or cut the recording there",
    )


def _size(values: Sequence[FloatArray], noise: float, total: int) -> int | None:
    """Samples in a row that no chance repeats in so many; None where decimals are too coarse to tell.

    Two samples of a noise s in steps d are equal by a chance of d / (2 sqrt(pi) s).
    """
    if noise <= 0.0:
        return None
    chance = 1.0
    for column in values:
        step = np.abs(np.diff(column[:_PART]))
        least = float(step[step > 1e-9 * noise].min(initial=math.inf))
        shown = float(np.median(np.abs(np.diff(column[:_PART], n=2)))) / (0.6745 * math.sqrt(6.0))
        if math.isinf(least) or shown <= 0.0:
            return None
        chance *= min(1.0, least / (2.0 * math.sqrt(math.pi) * shown))
    if chance >= 1.0:
        return None
    needed = (math.log(CHANCE) - 2.0 * math.log(total)) / math.log(max(chance, 1e-12))
    size = LEAST
    while size < needed:
        size *= 2
    return size if size <= MOST else None


def _first_pair(values: Sequence[FloatArray], size: int, noise: float) -> tuple[int, int] | None:
    """The first block that stands before, as (where before, where); None if there is none."""
    count = len(values[0]) - size + 1
    share = np.uint64(max(1, count // LOOKED_AT))
    hashes, places = [], []
    for begin in range(0, count, _PART):
        block = _hashes([column[begin : begin + _PART + size - 1] for column in values], size)
        chosen = np.flatnonzero(block % share == 0)
        hashes.append(block[chosen])
        places.append(chosen + begin)
    block, place = np.concatenate(hashes), np.concatenate(places)
    order = np.argsort(block, kind="stable")
    same = np.flatnonzero(block[order[1:]] == block[order[:-1]])
    later: IntArray = place[order[same + 1]]
    for i in np.argsort(later)[:PAIRS]:
        first, again = _grown(values, int(place[order[same[i]]]), int(later[i]))
        length = _length(values, first, again)
        # A device at rest may live less than it does under way, so that its decimals repeat by chance.
        near = [column[max(0, again - AROUND) : again + length + AROUND] for column in values]
        needed = _size(near, noise, len(values[0]))
        if needed is not None and length >= max(size, needed):
            return first, again
    return None


def _hashes(values: Sequence[FloatArray], size: int) -> np.ndarray:
    """A number (n - size + 1,) of each block of samples."""
    found = np.zeros(len(values[0]), dtype=np.uint64)
    with np.errstate(over="ignore"):
        for key, column in zip(_KEYS, values, strict=True):
            bits = (np.ascontiguousarray(column, dtype=np.float64) + 0.0).view(np.uint64)
            found = (found ^ (bits ^ (bits >> np.uint64(29)))) * key
            found ^= found >> np.uint64(32)
        width = 1
        while width < size:
            found = found[:-width] * _KEYS[0] + found[width:]
            found ^= found >> np.uint64(31)
            found *= _KEYS[1]
            width *= 2
    return found


def _grown(values: Sequence[FloatArray], first: int, again: int) -> tuple[int, int]:
    """Both beginnings, moved to where the two blocks begin to be equal."""
    while first > 0 and all(column[first - 1] == column[again - 1] for column in values):
        first, again = first - 1, again - 1
    return first, again


def _length(values: Sequence[FloatArray], first: int, again: int) -> int:
    """Samples that are equal, from two beginnings on; no more than lie between them."""
    count = min(again - first, len(values[0]) - again)
    for column in values:
        differ = np.flatnonzero(column[first : first + count] != column[again : again + count])
        count = min(count, int(differ[0]) if differ.size else count)
    return count
