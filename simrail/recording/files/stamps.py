"""Time stamps as loggers write them, to seconds on the one clock of a ride.

Text and counts of any unit become seconds. What can be undone is, and is noted: a clock time that goes over
midnight, a counter of ticks that begins anew, a line that was written twice, packets whose samples share the
time of their arrival (`simrail.core.packets`). What cannot is refused, with time and size: a clock that is
set back, stamps that several samples share.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.packets import spread
from simrail.core.resample import MOST_LOST, check_stamps, find_gaps, rate_of
from simrail.core.toml_files import blame
from simrail.recording.files.clock_times import EMPTY, continued, read_times
from simrail.recording.files.signal_part import EPOCHS, TEXT_TIMES, TICKS, SignalPart
from simrail.recording.signals import TIMES

COUNTER_BITS = (8, 12, 15, 16, 20, 24, 31, 32, 40, 48)
COUNTER_DIGITS = range(3, 13)
"""Widths of counters of time: where one begins anew, it falls by all but a step of its range."""

DECIMALS = (1e-3, 1e-6)
"""What a counter's count may have been multiplied by, to be a number with decimals."""

PERIODS_S = {
    604_800.0: "week",
    86_400.0: "day",
    43_200.0: "half day",
    3600.0: "hour",
    60.0: "minute",
    1.0: "second",
}
"""Clocks that show a part of the time begin anew with the next: of receivers the week, of loggers others."""

SUMMER_S = 3600.0
"""A clock of the wall goes back by an hour where summer time ends."""

FEW_STEPS_BACK = 0.01
"""Share of the steps that a clock that is set may make back; more of them are samples in disorder."""


class RideClock:
    """The clock of a ride: dates, from the whole second of the first signal on, or seconds of its own."""

    def __init__(self) -> None:
        self._zero_s: int | None = None
        self._dated: bool | None = None
        self._first_s: float | None = None

    def seconds(
        self,
        raw: FloatArray | pd.Series,
        part: SignalPart,
        table: str,
        *,
        file: str,
        name: str,
        notes: list[str],
    ) -> FloatArray:
        """Time stamps in seconds; NaN where there are none.

        Parameters
        ----------
        raw : ndarray (n,) or pandas.Series
            As read.
        part : SignalPart
            What the ride file says of them.
        table, file, name : str
            Their table in the ride file, their data file and column, for messages.
        notes : list of str
            Takes what was done to them.

        Raises
        ------
        InputError
            If they are of no known form, or on another kind of clock than those of the first signal.
        """
        unit = part.time_unit
        if unit == TEXT_TIMES:
            read = read_times(pd.Series(raw), file=file, field=name)
            if read.dates_ns is not None:
                self._same_kind(True, unit, table)
                since = _over(SUMMER_S, self._since(read.dates_ns, 10**9), table, notes, "summer time ends")
                return _summer_begins(since, float(self._zero_s or 0), table, notes)
            assert read.seconds is not None
            self._same_kind(False, unit, table)
            return self._over_midnight(read.seconds, read.period_s, table, notes)
        self._same_kind(unit in EPOCHS, unit, table)
        if unit in EPOCHS:
            return self._since(np.asarray(raw), int(TIMES[unit.removeprefix("epoch_")][1]))
        count = np.asarray(raw, dtype=np.float64)
        multiply, divide = (1.0, float(part.tick_rate_hz or 1.0)) if unit == TICKS else TIMES[unit]
        count = _counted_on(count, divide / multiply, table, name, notes)
        _refuse_written_clock(count, file, f"{table}.{name}")
        return count if multiply == divide else count * multiply / divide

    def _same_kind(self, dated: bool, unit: str, table: str) -> None:
        self._dated = dated if self._dated is None else self._dated
        if dated != self._dated:
            raise InputError(
                "has dates where the IMU has none, or none where it has: no common clock",
                field=f"{table}.units.time",
                value=unit,
                limit="dates in both, or in none",
                remedy="give both in one clock",
            )

    def _since(self, count: np.ndarray, per_second: int) -> FloatArray:
        """Seconds since the whole second of the first stamp of the ride."""
        known = count != EMPTY if count.dtype.kind == "i" else np.isfinite(count)
        if not known.any():
            return np.full(len(count), np.nan)
        if self._zero_s is None:
            self._zero_s = int(count[int(np.argmax(known))] // per_second)
        since = np.where(known, count, self._zero_s * per_second) - self._zero_s * per_second
        seconds = np.asarray(since / float(per_second), dtype=np.float64)
        seconds[~known] = np.nan
        return seconds

    def _over_midnight(
        self, seconds: FloatArray, period_s: float, table: str, notes: list[str]
    ) -> FloatArray:
        """Clock times that go on, within a signal and from the first signal to the others."""
        whole, times = continued(seconds, period_s)
        known = whole[np.isfinite(whole)]
        if self._first_s is None:
            self._first_s = float(known[0]) if len(known) else 0.0
        elif len(known):
            whole += period_s * round((self._first_s - float(known[0])) / period_s)
        if times:
            what = "midnight" if period_s > 3600.0 else "the full hour"
            notes.append(f"{table}: the clock passes {what}; its times go on")
        return whole


def _over(period_s: float, seconds: FloatArray, table: str, notes: list[str], what: str) -> FloatArray:
    """Times that go on where a clock went back, by a period to within some samples; else as they are."""
    known = np.flatnonzero(np.isfinite(seconds))
    step = np.diff(seconds[known])
    back = np.flatnonzero(step < 0.0)
    if not len(back) or len(step) < 3 * len(back):
        return seconds
    usual = float(np.median(step))
    after = step[back] + period_s
    if not (usual > 0.0 and (after >= 0.0).all() and (after <= 3.0 * usual).all()):
        return seconds
    notes.append(f"{table}: {what} at {seconds[known[back[0]]]:.6g} s{_more(back)}; its times go on")
    return _joined(seconds, known, period_s)


def _joined(time: FloatArray, known: np.ndarray, size: float) -> FloatArray:
    """Times that go on: by so much more after each of the known ones that is before the last."""
    whole = time.copy()
    whole[known[1:]] += size * np.cumsum(np.diff(time[known]) < 0.0)
    return whole


def _more(back: np.ndarray) -> str:
    return f" (and {len(back) - 1} more times)" if len(back) > 1 else ""


def _summer_begins(seconds: FloatArray, zero_s: float, table: str, notes: list[str]) -> FloatArray:
    """Times without the hour that a clock of the wall leaves out where summer time begins; else as they are.

    It leaves out an hour of a Sunday's night, from one full hour to the next.
    """
    known = np.flatnonzero(np.isfinite(seconds))
    step = np.diff(seconds[known])
    ahead = np.flatnonzero(step >= SUMMER_S)
    if len(ahead) != 1 or len(step) < 3:
        return seconds
    usual, before = float(np.median(step)), float(seconds[known[ahead[0]]])
    left_out = 0.0 < float(step[ahead[0]]) - SUMMER_S <= 3.0 * usual
    hour = round((zero_s + before) / 3600.0)
    at_the_hour = abs(zero_s + before - 3600.0 * hour) <= 3.0 * usual
    # 1970 began on a Thursday.
    is_sunday, is_night = (hour // 24 + 4) % 7 == 0, hour % 24 <= 3
    if not (left_out and at_the_hour and is_sunday and is_night):
        return seconds
    whole = seconds.copy()
    whole[known[ahead[0]] + 1 :] -= SUMMER_S
    notes.append(f"{table}: summer time begins at {before:.6g} s; its times go on")
    return whole


class _Period(NamedTuple):
    """What a clock or a counter begins anew after.

    Attributes
    ----------
    size : float
        So many counts.
    words : str
        How it is told.
    is_clock : bool
        Whether a part of the time begins anew, which is never below 0; else a counter does.
    lost, slack : float
        So many steps may be lost there, or so many counts.
    """

    size: float
    words: str
    is_clock: bool = False
    lost: float = 3.0
    slack: float = 0.0

    def has(self, least: float, most: float) -> bool:
        """Whether it counts from the least to the most; a counter with a sign goes from minus a half."""
        return most <= self.size and least >= (0.0 if self.is_clock else -0.5 * self.size)

    def explains(self, back: FloatArray, usual: float) -> bool:
        """Whether steps back are usual ones, but for what may be lost."""
        after = back + self.size
        return bool((after >= 0.0).all() and (after <= max(self.lost * usual, self.slack)).all())


def _periods(per_second: float, *, is_whole: bool) -> Iterator[_Period]:
    """Periods of clocks that count so many in a second."""
    for period, word in PERIODS_S.items():
        yield _Period(period * per_second, f"the seconds of the {word} begin anew", is_clock=True)
    if not is_whole:
        for scale in DECIMALS:
            for bits in COUNTER_BITS:
                yield _Period(scale * 2.0**bits, f"begins anew after 2^{bits} x {scale:g}")
        return
    for bits in COUNTER_BITS:
        yield _Period(2.0**bits, f"begins anew after 2^{bits}", lost=20.0, slack=1.0)
    for digits in COUNTER_DIGITS:
        yield _Period(10.0**digits, f"begins anew after 10^{digits}")


def _counted_on(count: FloatArray, per_second: float, table: str, name: str, notes: list[str]) -> FloatArray:
    """A clock that goes on where it began anew: by that period that leaves the most even steps.

    As it is, if it did not, or if it is that of no clock.
    """
    known = np.flatnonzero(np.isfinite(count))
    values = count[known]
    step = np.diff(values)
    back = np.flatnonzero(step < 0.0)
    if not len(back) or 3 * len(back) > len(step):
        return count
    usual = float(np.median(step[step > 0.0])) if (step > 0.0).any() else 0.0
    least, most = float(values.min()), float(values.max())
    found: tuple[float, _Period] | None = None
    for period in _periods(per_second, is_whole=bool(np.array_equal(values, np.rint(values)))):
        if not (period.has(least, most) and period.explains(step[back], usual)):
            continue
        uneven = float(np.median(np.abs(step[back] + period.size - usual)))
        if found is None or uneven < 0.5 * found[0]:
            found = uneven, period
    if found is None:
        return count
    period = found[1]
    if period.is_clock:
        when = f"{values[back[0]] / per_second:.6g} s"
        notes.append(f"{table}: {period.words} at {when}{_more(back)}; its times go on")
    else:
        notes.append(f"{table}: {name} {period.words}, {_times(len(back))}; its times go on")
    return _joined(count, known, period.size)


def _refuse_written_clock(count: FloatArray, file: str, field: str) -> None:
    """Refuse clock times written as one number: from 115959 to 120000 is a second."""
    values = count[np.isfinite(count)]
    step = np.diff(values)
    if len(step) < 3:
        return
    usual = float(np.median(step))
    for unit in (1.0, 1e3, 1e6):
        two = [np.floor(values / (unit * 100.0**place)) % 100.0 for place in range(2)]
        if usual <= 0.0 or not all((part < 60.0).all() for part in two):
            continue
        odd = step[np.abs(step) > 3.0 * usual]
        written = np.array([40.0, 4040.0, 764_040.0, -235_959.0]) * unit
        near = np.abs(odd[:, None] - written).min(axis=1, initial=np.inf) <= unit + 3.0 * usual
        if len(odd) and near.all() and usual <= 2.0 * unit:
            raise InputError(
                "holds clock times written as one number, whose minutes have 60 seconds and no hundred",
                file=file,
                field=field,
                value=f"{float(values[0]):.12g}, as hours, minutes, seconds",
                limit="a count that rises evenly",
                remedy='write them with colons, e.g. 12:59:45.05, and set units.time = "iso"; or leave time '
                "out and give rate_hz",
            )


def mended(
    frame: pd.DataFrame, time: FloatArray, *, file: str, field: str, table: str, notes: list[str]
) -> tuple[pd.DataFrame, FloatArray]:
    """Samples and their times without lines written twice, packets spread evenly.

    Parameters
    ----------
    frame : pandas.DataFrame
        Samples.
    time : ndarray (n,)
        Their stamps, s.
    file, field, table : str
        Where they stand, for messages: data file, field with the name of the column, table of the ride file.
    notes : list of str
        Takes what was done.

    Raises
    ------
    InputError
        If the stamps go back, or several samples share one.
    """
    step = np.diff(time)
    if (step == 0.0).any():
        twice = np.concatenate([[False], step == 0.0])
        same = np.ones(len(time) - 1, dtype=bool)
        for name in frame:
            values = frame[name].to_numpy()
            same &= (values[1:] == values[:-1]) | ((values[1:] != values[1:]) & (values[:-1] != values[:-1]))
        other = np.flatnonzero(twice[1:] & ~same)
        if len(other):
            raise _shared(time, int(other[0]), int(twice.sum()), file, field)
        frame, time = frame[~twice].reset_index(drop=True), time[~twice]
        notes.append(f"{table}: {_counted(int(twice.sum()), 'sample')} that the logger wrote twice left out")
        step = np.diff(time)
    if (step < 0.0).any():
        _refuse_again(frame, time, step, file, field)
        _refuse_back(time, step, file, field)
    with blame(file):
        check_stamps(time, field=field)
    if len(time) > 2 and lost_share(time) > MOST_LOST:
        packets = spread(time)
        if packets is not None:
            notes.append(
                f"{table}: stamps of packets of {packets.size} samples are spread evenly, at "
                f"{packets.rate_hz:.6g} Hz (samples over time), moved by {packets.moved_s:.3g} s at most"
            )
            time = packets.time
    return frame, time


def lost_share(time: FloatArray) -> float:
    """Share of the samples that are missing between stamps, as their usual interval has it."""
    missing = float(find_gaps(time, 1.0 / rate_of(time))["missing"].sum())
    return missing / (missing + len(time))


def _shared(time: FloatArray, first: int, count: int, file: str, field: str) -> InputError:
    starts = np.concatenate([[True], np.diff(time) != 0.0])
    begins = np.flatnonzero(starts)
    # The first group may be the end of one.
    first_whole = begins[1] if len(begins) > 2 else begins[0]
    seconds = time[-1] - time[first_whole]
    rate = (begins[-1] - first_whole) / seconds if seconds > 0.0 else np.nan
    rate = round(rate) if np.isfinite(rate) and abs(rate / max(round(rate), 1) - 1.0) < 2e-3 else rate
    return InputError(
        f"has duplicate time stamps at sample {first + 1} ({count} such samples), though the samples differ",
        file=file,
        field=field,
        value=[float(time[first]), float(time[first + 1])],
        limit="strictly increasing",
        remedy="these are stamps of packets, or too coarse; if no samples are lost leave time out and give "
        + (f"rate_hz = {rate:.6g}" if np.isfinite(rate) else "rate_hz"),
    )


def _refuse_again(frame: pd.DataFrame, time: FloatArray, step: FloatArray, file: str, field: str) -> None:
    """Refuse a block of samples that stands there twice, behind itself."""
    first = int(np.argmax(step < 0.0)) + 1
    begin = int(np.searchsorted(time[:first], time[first]))
    size = first - begin
    once, again = slice(begin, first), slice(first, first + size)
    values = frame.to_numpy()
    same = size > 1 and np.array_equal(time[once], time[again])
    if same and np.array_equal(values[once], values[again], equal_nan=values.dtype.kind == "f"):
        raise InputError(
            f"has {size} samples twice: samples {first + 1} to {first + size} are those before them",
            file=file,
            field=field,
            value=f"{time[first]:.9g} to {time[first + size - 1]:.9g} s",
            limit="each sample once",
            remedy="drop the second of the two blocks",
        )


def _refuse_back(time: FloatArray, step: FloatArray, file: str, field: str) -> None:
    """Refuse stamps that go back: of a clock that was set, or of samples in disorder."""
    back = np.flatnonzero(step < 0.0)
    first, size = int(back[0]), float(step[back[0]])
    usual = float(np.median(np.abs(step)))
    again = time[back + 1]
    if len(back) > 1 and 3 * len(back) <= len(step) and np.ptp(again) <= 2.0 * usual:
        raise InputError(
            f"has reversed time stamps at sample {first + 1}: the clock begins anew after some "
            f"{usual - size:.6g} s, {len(back)} times, a period of no clock that is known",
            file=file,
            field=field,
            value=f"{size:.9g} s after {time[first]:.9g} s",
            limit="strictly increasing",
            remedy="add that to all later stamps each time; or, if no samples are lost, leave time out and "
            "give rate_hz",
        )
    if len(back) <= 1 + FEW_STEPS_BACK * len(step) and -size > 5.0 * usual:
        raise InputError(
            f"has reversed time stamps at sample {first + 1}: the clock jumps back{_more(back)}",
            file=file,
            field=field,
            value=f"{size:.9g} s after {time[first]:.9g} s",
            limit="strictly increasing",
            remedy="cut the recording there; or, if no samples are lost, leave time out and give rate_hz",
        )
    in_order = np.diff(np.sort(time))
    remedy = "sort the samples by time"
    if float(np.quantile(in_order, 0.9)) > 3.0 * float(np.median(in_order)):
        remedy = (
            "a counter that begins anew between two samples tells no time: leave time out and give rate_hz; "
            "samples in disorder are to be sorted"
        )
    raise InputError(
        f"has reversed time stamps at sample {first + 1} ({len(back)} steps back)",
        file=file,
        field=field,
        value=[float(time[first]), float(time[first + 1])],
        limit="strictly increasing",
        remedy=remedy,
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'s' * (count != 1)}"
