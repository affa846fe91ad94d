"""Samples that come in packets: evenly taken, but stamped when their packet came.

A host that empties a buffer of three stamps its samples 1, 1, 4, 1, 1, 4 ms apart, though they were taken
every 2 ms. Stamps so close together tell nothing of a sample of its own; those of the packets tell the rate:
samples over time. Told from lost samples by this: packets are of one size, and their stamps keep to the even
line of all samples over the whole ride, while a loss moves all stamps behind it.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray

FEWEST_PACKETS = 8
"""Packets below which nothing is concluded."""

CLOSE = 0.7
"""Within a packet, stamps are closer than this share of the true interval; from there on they are samples."""

SIZE_SPREAD = 0.35
"""Packets are of one size to this share, or to one sample."""

OFF_LINE = 0.35
"""Stamps of packets keep to the even line to this share of their interval, or to 1.5 samples."""


class Packets(NamedTuple):
    """Stamps of packets, spread evenly.

    Attributes
    ----------
    time : ndarray (n,)
        Evenly spread times; the first sample of a packet keeps to its stamp, in the mean.
    rate_hz : float
        Rate of the samples.
    size : int
        Samples in most packets.
    moved_s : float
        How far a stamp was moved at most.
    """

    time: FloatArray
    rate_hz: float
    size: int
    moved_s: float


def spread(time: FloatArray) -> Packets | None:
    """Spread the samples of packets evenly; None if they do not come in packets.

    Parameters
    ----------
    time : ndarray (n,)
        Strictly increasing time stamps, s.

    Notes
    -----
    A packet that was lost shows as a gap of whole samples in the times that are returned.
    """
    step = np.diff(time)
    if len(step) < 2 * FEWEST_PACKETS:
        return None
    # The interval of all samples lies between the steps within packets and those between them; a gap or two
    # may not count.
    kept = step[step <= 10.0 * np.quantile(step, 0.995)]
    starts = np.concatenate([[0], np.flatnonzero(step > kept.mean()) + 1])
    size, period = np.diff(starts), np.diff(time[starts])
    if len(size) < FEWEST_PACKETS or size.mean() < 1.3:
        return None
    low, usual, high = np.quantile(size[1:], [0.1, 0.5, 0.9])
    if high - low > max(1.0, SIZE_SPREAD * usual):
        return None
    interval = float(np.median(period / size))
    if np.median(step[step <= kept.mean()]) > CLOSE * interval:
        return None
    first, rate = _numbered(time[starts], size, interval)
    line = time[starts] - first / rate
    off = line - np.median(line)
    if np.abs(off).max() > max(1.5 / rate, OFF_LINE * usual / rate):
        return None
    number = np.repeat(first - starts, np.diff(np.append(starts, len(time)))) + np.arange(len(time))
    even = float(np.median(line)) + number / rate
    return Packets(even, rate, round(float(usual)), float(np.abs(even - time).max()))


def _numbered(start: FloatArray, size: np.ndarray, interval: float) -> tuple[np.ndarray, float]:
    """Numbers of the samples that begin packets, lost ones counted, and the rate."""
    excess = np.diff(start) / interval - size
    later = np.append(excess[1:], 0.0)
    # A late packet is followed by an early one; a lost one is not.
    lost = (excess > 0.6 * np.median(size)) & (later > -0.3 * excess)
    rate = 1.0 / interval
    for _ in range(
        2
    ):  # over a long gap a small error of the rate is a sample: once more, with it known better
        missing = np.rint(np.diff(start) * rate - size)
        number = np.concatenate([[0], np.cumsum(size + np.where(lost, missing, 0.0))]).astype(np.int64)
        rate = float(np.polyfit(start - start[0], number, 1)[0])
    return number, rate
