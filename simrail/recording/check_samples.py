"""Are these measurements of that device? Samples held against the sheet of the device that took them.

Loggers mark what they do not have by a number: the least count (-32768), the end of the range, -9999,
zeros. One such sample is as large as a thousand sound ones, and an estimator believes it. It is told from
a unit that is wrong by the rest of the signal: markers stand apart from all other samples, while a wrong
unit makes the whole signal large. So samples that stand apart are refused here, by the line of the file,
and a signal that is large as a whole is left to those who judge units (`simrail.recording.check_form`,
`simrail.recording.check_physics`).
"""

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import MOST_LOST
from simrail.recording.check_twice import CHANCE, check_twice
from simrail.recording.recording import ImuSheet, MagnetometerSheet

APART = 10.0
"""Samples stand apart if each is this many times as far from the median as every other sample is."""

APART_BEYOND = 3.0
"""The same of samples that no such device gives, or of numbers that loggers use as markers."""

MOST_MARKERS = 0.2
"""Share of a signal that may be markers; what is more than that is the signal."""

SLACK = 1.01
"""Share of a range that is still within it: scale factors and decimals of a logger."""

MARKERS = (999.0, 999.9, 9999.0, 9999.9, 99999.0, 32767.0, 32768.0, 65535.0, 8388607.0, 8388608.0)
"""Numbers that loggers write where they have none, either sign, in the unit of the file."""

STUCK_S, STUCK_SAMPLES = 2.0, 60
"""A signal whose noise is `STUCK_COUNTS` counts does not repeat one number for so long: the chance that one
sample equals the last is 0.65 even where the noise is a fifth of its sheet's, so 6e-12 of sixty."""

STUCK_COUNTS = 2.0

STUCK_LEAST = 15
"""Samples that are equal, below which nothing is called stuck: a small part of a ride, and soon over."""

HELD_SAMPLES = 10
"""So many times in a row no living device repeats all three axes at once: of three whose noise is a fifth of
the sheet's each does by chance 0.65 of the time, so all of them 10 times in 2e-6."""

LIVING = 0.5
"""Standard deviation of second differences, over the noise of the sheet, of a device that measures: sqrt(6)
where it has the noise of its sheet."""

_COARSE = {"gyro": 0.004, "accel": 0.4}
"""Steps of a signal, SI, that swallow what a train does (a curve of 500 m at 36 km/h turns by five of them):
0.23 deg/s and 0.04 g. Finer than that are all devices that are sold with digits."""

SHORT_ZEROS = 3
"""Zeros in a row of a gyro that may be markers; a specific force is never zero, however long."""

_STILL = {"gyro": 0.01, "accel": 0.2, "field": 1e-6}
"""What counts as nothing beside a marker, in SI: a perfect sensor at rest moves by nothing at all."""


class Bounds(NamedTuple):
    """What a sheet says of the samples of one triad.

    Attributes
    ----------
    range : float, optional
        Largest magnitude that is measured, SI; None where the sheet is silent.
    noise : float
        Density N of its white noise, SI; 0 where the sheet is silent.
    sheet : str
        Name of the sheet, for messages.
    """

    range: float | None
    noise: float
    sheet: str


class Channel(NamedTuple):
    """One column of a device, as it was logged.

    Attributes
    ----------
    name : str
        How messages call it.
    values : ndarray (n,)
        Its samples in SI, on the device's own axis.
    unit, si : str, float
        Unit of the file, and one of it in SI.
    """

    name: str
    values: FloatArray
    unit: str
    si: float


def imu_bounds(sheet: ImuSheet) -> dict[str, Bounds]:
    """What the sheet of an IMU says of its samples, by quantity."""
    return {
        "gyro": Bounds(sheet.gyro_range_radps, sheet.gyro_noise_radpsqrts, sheet.grade),
        "accel": Bounds(sheet.accel_range_mps2, sheet.accel_noise_mpsqrts, sheet.grade),
    }


def field_bounds(sheet: MagnetometerSheet) -> dict[str, Bounds]:
    """What the sheet of a magnetometer says of its samples, by quantity."""
    return {"field": Bounds(None, sheet.noise_tpsqrthz, "magnetometer.sheet")}


def check_samples(
    channels: tuple[Channel, ...],
    kind: str,
    bounds: Bounds,
    *,
    time: FloatArray,
    where: Callable[[int], str],
    file: str | None = None,
) -> None:
    """Refuse samples of a triad that are none of its device.

    Parameters
    ----------
    channels : tuple of Channel
        The three columns.
    kind : {"gyro", "accel", "field"}
        What they measure.
    bounds : Bounds
        What the sheet says.
    time : ndarray (n,)
        Time stamps, s.
    where : callable
        Place of a sample in its file, in words.
    file : str, optional
        The file, for messages.

    Raises
    ------
    InputError
        At the first of: zeros on all axes at once amid a signal; samples beyond the range that stand apart
        from the rest; numbers that mark missing samples; one number for seconds, where the sheet has noise;
        all axes of an IMU repeated, ten times in a row or in more than `MOST_LOST` of the samples; a block
        of its samples that stands twice.
    """

    def place(sample: int) -> str:
        return f"{where(sample)} (time_s = {time[sample]:.6g})"

    _check_copies(channels, file)
    _check_zeros(channels, kind, place, file)
    for channel in channels:
        apart = markers(channel.values, still=_STILL[kind], limit=bounds.range, unit_si=channel.si)
        if apart.any():
            raise _no_measurement(channel, apart, bounds, place, file)
    _check_stuck(channels, bounds, time, place, file)
    if kind in _COARSE and bounds.noise > 0.0:  # a computed ride may have a rate of kinks
        for channel in channels:
            _check_steps(channel, _COARSE[kind], place, file)
    if kind != "field":  # a slow magnetometer is often logged at the rate of the IMU
        _check_held(channels, bounds, time, place, file)
        _check_twice(channels, bounds, time, place, file)


def _check_copies(channels: tuple[Channel, ...], file: str | None) -> None:
    """Refuse a column that holds what another one does, but for its sign: no two axes measure the same."""
    for first, second in combinations(channels, 2):
        one, other = first.values, second.values
        lives = len(one) > STUCK_SAMPLES and len(np.unique(one)) > STUCK_SAMPLES // 2
        if lives and (np.array_equal(one, other) or np.array_equal(one, -other)):
            raise InputError(
                f"holds the same samples as {first.name}",
                file=file,
                field=second.name,
                value=f"{len(one)} samples that are equal",
                limit="samples of its own",
                remedy="mend the names in columns, or the logger: one axis stands there twice",
            )


def markers(
    values: FloatArray, *, still: float, limit: float | None = None, unit_si: float = 1.0
) -> npt.NDArray[np.bool_]:
    """Which samples of a signal stand apart from all others, so that they are no measurements.

    In the order of their distances from the median, the samples before the widest step are apart from those
    behind it, if the step is wide: `APART` times as far; or `APART_BEYOND` times for samples beyond the
    range, at its very end, or equal to one of `MARKERS`. Those within the range must also be alone: a blow
    rings, so its neighbours are large too.

    Parameters
    ----------
    values : ndarray (n,)
        Samples.
    still : float
        Distance that counts as nothing.
    limit : float, optional
        Range of the device.
    unit_si : float
        The unit in which a logger wrote them.

    Returns
    -------
    ndarray (n,) of bool
    """
    none = np.zeros(len(values), dtype=np.bool_)
    if len(values) < 3:
        return none
    off = np.abs(values - np.median(values))
    most = max(1, int(MOST_MARKERS * len(values)))
    if off.max() <= APART_BEYOND * still:
        return none
    top = np.sort(np.partition(off, len(off) - most - 1)[len(off) - most - 1 :])[::-1]
    steps = top[:-1] / np.maximum(top[1:], still)
    widest = int(np.argmax(steps))
    if steps[widest] < APART_BEYOND:
        return none
    apart: npt.NDArray[np.bool_] = np.greater_equal(off, top[widest])
    found = values[apart]
    if limit is not None and bool(np.all(np.abs(found) > SLACK * limit)):
        return apart
    marked = np.isin(np.round(np.abs(found / unit_si), 6), MARKERS)
    if limit is not None:
        marked |= np.abs(np.abs(found) / limit - 1.0) < 1e-3
    if steps[widest] < APART and not marked.all():
        return none
    return apart if marked.all() or _alone(off, apart, top[widest]) else none


def _alone(off: FloatArray, apart: npt.NDArray[np.bool_], size: float) -> bool:
    """Whether the samples beside those that stand apart are as small as any."""
    beside = np.zeros_like(apart)
    beside[1:] |= apart[:-1]
    beside[:-1] |= apart[1:]
    beside &= ~apart
    runs = np.flatnonzero(np.diff(apart.astype(np.int8)) == 1).size + int(apart[0])
    # One sample each: what lasts for longer is a motion that begins and ends.
    return int(apart.sum()) == runs and bool(np.all(off[beside] < size / APART))


def _no_measurement(
    channel: Channel,
    apart: npt.NDArray[np.bool_],
    bounds: Bounds,
    place: Callable[[int], str],
    file: str | None,
) -> InputError:
    first, count = int(np.argmax(apart)), int(apart.sum())
    found = float(channel.values[first])
    more = f" (and {count - 1} more such samples)" if count > 1 else ""
    remedy = _drop(count)
    if bounds.range is not None and abs(found) > SLACK * bounds.range:
        problem = f"is beyond the range of its device in {place(first)}{more}; the sample is no measurement"
        limit = f"{bounds.range / channel.si:.6g} {channel.unit}, the range of {bounds.sheet}"
        remedy += "; if it does measure so far, mend the range in its sheet"
    else:
        rest = np.abs(channel.values[~apart]).max() / channel.si
        problem = f"stands alone in {place(first)}{more}; it marks a missing sample, and is no measurement"
        limit = f"{rest:.6g} {channel.unit}, the largest of all others"
    return InputError(
        problem,
        file=file,
        field=channel.name,
        value=f"{found / channel.si:.6g} {channel.unit}",
        limit=limit,
        remedy=remedy,
    )


def _drop(count: int) -> str:
    return "drop those lines, so that they are gaps" if count > 1 else "drop that line, so that it is a gap"


def _check_zeros(
    channels: tuple[Channel, ...], kind: str, place: Callable[[int], str], file: str | None
) -> None:
    """Refuse zeros on all axes at once, where the samples before and after are far from zero."""
    values = np.column_stack([channel.values for channel in channels])
    empty: npt.NDArray[np.bool_] = np.all(values == 0.0, axis=1)
    if len(values) < 3 or not empty.any() or empty.all():
        return
    # What one sample adds to the mean of its neighbours, beside the markers themselves.
    rough = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    usual = 1.4826 * float(np.median(np.linalg.norm(rough[~empty[1:-1]], axis=1))) if rough.size else 0.0
    full = np.flatnonzero(~empty)
    around = np.searchsorted(full, np.flatnonzero(empty))
    before, after = full[np.maximum(around - 1, 0)], full[np.minimum(around, len(full) - 1)]
    expected = np.linalg.norm(0.5 * (values[before] + values[after]), axis=1)
    wrong = expected > APART * max(usual, _STILL[kind])
    if kind == "gyro":
        # A perfect gyro is at zero between two curves; it does not get there and back in a moment.
        wrong &= (around > 0) & (around < len(full)) & (after - before <= SHORT_ZEROS + 1)
    if wrong.any():
        first, count = int(np.flatnonzero(empty)[int(np.argmax(wrong))]), int(wrong.sum())
        more = f" (and {count - 1} more such samples)" if count > 1 else ""
        size = float(expected[int(np.argmax(wrong))])
        raise InputError(
            f"is zero on all axes in {place(first)}{more}; it marks a missing sample, and is no measurement",
            file=file,
            field=", ".join(channel.name for channel in channels),
            value=f"0 {channels[0].unit}",
            limit=f"{size / channels[0].si:.4g} {channels[0].unit} just before and after",
            remedy=_drop(count),
        )


def _check_twice(
    channels: tuple[Channel, ...],
    bounds: Bounds,
    time: FloatArray,
    place: Callable[[int], str],
    file: str | None,
) -> None:
    """Refuse a device that lives and holds the same samples at two times."""
    noise = bounds.noise * np.sqrt(_rate_of(time))
    if noise == 0.0 or len(time) <= STUCK_SAMPLES:
        return
    if all(float(np.diff(channel.values, n=2).std()) > LIVING * noise for channel in channels):
        check_twice(
            [channel.name for channel in channels],
            [channel.values for channel in channels],
            float(noise),
            place,
            time,
            file,
        )


def _rate_of(time: FloatArray) -> float:
    """Samples per second; 0 of stamps that go back, or are none, which are refused elsewhere."""
    span = float(time[-1] - time[0]) if len(time) else 0.0
    return (len(time) - 1) / span if 0.0 < span < np.inf else 0.0


def _check_stuck(
    channels: tuple[Channel, ...],
    bounds: Bounds,
    time: FloatArray,
    place: Callable[[int], str],
    file: str | None,
) -> None:
    """Refuse a signal that repeats one number for seconds, although its sheet's noise is several counts.

    The device must show noise otherwise, on another axis meanwhile or on both sides: a computed ride has
    none. An axis that lives on both sides as it does elsewhere is told from fewer samples, by the chance that
    so many are equal.
    """
    rate = _rate_of(time)
    noise = bounds.noise * np.sqrt(rate)
    shortest = max(STUCK_SAMPLES, int(np.ceil(STUCK_S * rate)))
    if noise == 0.0 or len(time) <= STUCK_SAMPLES:
        return
    steps = [np.abs(np.diff(channel.values)) for channel in channels]
    counts = [float(step[step > 1e-9 * noise].min(initial=np.inf)) for step in steps]

    def lives(axis: int, begin: int, end: int) -> bool:
        """Whether an axis shows noise, by the median of its second differences."""
        part = channels[axis].values[max(begin, 0) : end]
        return len(part) >= STUCK_SAMPLES // 2 and float(np.diff(part, n=2).std()) > LIVING * noise

    for axis, (channel, step) in enumerate(zip(channels, steps, strict=True)):
        # A column that never changes is held against the decimals of its neighbours.
        count = counts[axis] if np.isfinite(counts[axis]) else min(counts)
        moves = np.concatenate([[-1], np.flatnonzero(step > 1e-9 * noise), [len(step)]])
        longest = int(np.argmax(np.diff(moves)))
        first, end = int(moves[longest]) + 1, min(int(moves[longest + 1]) + 1, len(time))
        if noise < STUCK_COUNTS * count:
            continue
        held, least, most = channel.values[first], channel.values.min(), channel.values.max()
        ends = least < most and held in (least, most)
        if end - first < shortest:
            alone = all(np.any(steps[other][first : end - 1] > 1e-9 * noise) for other in _others(axis))
            if ends or not alone or not _is_no_chance(step, first, end, noise):
                continue
        others = any(lives(other, first, end) for other in _others(axis))
        if others or (lives(axis, first - STUCK_SAMPLES, first) and lives(axis, end, end + STUCK_SAMPLES)):
            raise InputError(
                f"repeats one number from {place(first)} to time_s = {time[end - 1]:.6g}; the device is "
                + ("saturated: it shows nothing beyond that" if ends else "stuck"),
                file=file,
                field=channel.name,
                value=f"{held / channel.si:.6g} {channel.unit}",
                limit=f"noise of {noise / channel.si:.2g} {channel.unit}, as {bounds.sheet} says",
                remedy="set a wider range of the device, or cut the recording there"
                if ends
                else "cut the recording there, or mend the logger",
            )


def _others(axis: int) -> list[int]:
    """The other axes of a triad."""
    return [other for other in range(3) if other != axis]


def _is_no_chance(step: FloatArray, first: int, end: int, noise: float) -> bool:
    """Whether samples are not equal by chance, by how often neighbours are near by and elsewhere."""
    if end - first < STUCK_LEAST:
        return False
    same = step <= 1e-9 * noise
    near = np.concatenate([same[max(0, first - STUCK_SAMPLES) : first], same[end - 1 : end + STUCK_SAMPLES]])
    if len(near) < STUCK_SAMPLES:
        return False
    chance = max((float(part.sum()) + 2.0) / (len(part) + 4.0) for part in (near, same))
    return bool(len(same) * chance ** (end - first - 1) < CHANCE)


def _check_steps(channel: Channel, coarse: float, place: Callable[[int], str], file: str | None) -> None:
    """Refuse numbers that were rounded so that little is left: whole steps, which no noise carries over."""
    step = np.abs(np.diff(channel.values))
    least = float(step[step > 1e-9].min(initial=np.inf))
    if not coarse < least < np.inf or len(channel.values) < STUCK_SAMPLES:
        return
    counts = (channel.values - channel.values[0]) / least
    noise = float(np.std(np.diff(channel.values, n=2))) / np.sqrt(6.0)
    if np.abs(counts - np.rint(counts)).max() < 0.01 and noise < 2.0 * least:
        raise InputError(
            f"has steps of {least / channel.si:.3g} {channel.unit}, first in "
            f"{place(int(np.argmax(step > 0.5 * least)) + 1)}: rounded so, it shows little of a ride",
            file=file,
            field=channel.name,
            value=f"{len(np.unique(channel.values))} different numbers",
            limit=f"steps of {coarse / channel.si:.2g} {channel.unit} at most",
            remedy="log it with more decimals, or as raw counts with lsb_per_unit",
        )


def _check_held(
    channels: tuple[Channel, ...],
    bounds: Bounds,
    time: FloatArray,
    place: Callable[[int], str],
    file: str | None,
) -> None:
    """Refuse samples that a logger wrote again where it had no new ones: all axes at once are the last ones.

    Only of a device that shows its noise, of several counts, in the other samples.
    """
    rate = _rate_of(time)
    noise = bounds.noise * np.sqrt(rate)
    if noise == 0.0 or len(time) <= STUCK_SAMPLES:
        return
    steps = np.array([np.abs(np.diff(channel.values)) for channel in channels])
    same = np.all(steps <= 1e-9 * noise, axis=0)
    if not same.any():
        return
    new = np.concatenate([[True], ~same])
    if new.sum() < STUCK_SAMPLES:
        return
    for channel, step in zip(channels, steps, strict=True):
        count = float(step[step > 1e-9 * noise].min(initial=np.inf))
        if noise < STUCK_COUNTS * count or float(np.diff(channel.values[new], n=2).std()) < LIVING * noise:
            return
    starts = np.flatnonzero(new)
    runs = np.diff(np.append(starts, len(new)))
    longest, share = int(np.argmax(runs)), float(same.mean())
    if runs[longest] > HELD_SAMPLES:
        first, end = int(starts[longest]) + 1, int(starts[longest] + runs[longest])
        raise InputError(
            f"repeats the sample before on all axes from {place(first)} to time_s = {time[end - 1]:.6g}; "
            "nothing was measured there",
            file=file,
            field=", ".join(channel.name for channel in channels),
            value=f"{end - first} times",
            limit=f"{HELD_SAMPLES} times",
            remedy="drop those lines, so that they are a gap; or cut the recording there",
        )
    if share > MOST_LOST:
        raise InputError(
            f"repeats the sample before on all axes, first in {place(int(np.argmax(same)) + 1)}: they were "
            "lost, or the logger reads faster than the device measures",
            file=file,
            field=", ".join(channel.name for channel in channels),
            value=f"{share:.1%} of the samples",
            limit=f"{MOST_LOST:.0%}",
            remedy=f"log at the rate of the device, some {rate * (1.0 - share):.3g} Hz; or drop the lines "
            "that repeat, so that they are gaps",
        )
