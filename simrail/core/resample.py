"""From irregular time stamps to a uniform grid, with every gap on record.

Loggers jitter, their clocks drift, and they lose samples; estimators want samples at one interval. Values
are interpolated linearly between the two neighbouring stamps: next to a gap a cubic overshoots, a
band-limited (sinc) kernel rings, while a straight line stays between its two neighbours. Its price is
known: half way between two samples a tone of frequency f keeps the share cos(pi f / rate) of its
amplitude, and white noise half of its variance.

Only gaps up to a stated length are bridged, and each is reported. A longer one is refused: no method can
know what happened in it. Time stamps are believed; what the clock did wrong is not found here, nor are
samples low-passed for a slower grid.
"""

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

SLOW_INTERVALS = 3.0
"""A signal that is slower than the longest gap may be silent for this many of its own intervals."""

GAP_INTERVALS = 1.5
"""Two stamps further apart than this many intervals have a gap between them: nearer to two than to one."""

LONGEST_GAP_S = 0.1
"""Longest gap that is bridged unless said otherwise: a train's body moves at about 1 Hz, so a tenth of a
second of it is still nearly a straight line; of an axle's vibrations nothing is recovered."""

JUMP_S = 60.0
"""From here on a step of the time stamps is called a jump of the clock, not a gap of so many samples."""

MOST_LOST = 0.05
"""Largest share of the samples that may be missing: more straight lines than that are no recording."""

GAPS = ("start_s", "end_s", "missing")
"""Columns of a frame of gaps: last stamp before, first stamp after, samples missing between (int64)."""


def interpolated(frame: pd.DataFrame, times: FloatArray, *columns: str) -> FloatArray:
    """Columns of a frame, indexed by time, at times (n,): ndarray (n, m)."""
    stamps = frame.index.to_numpy(dtype=np.float64)
    return np.column_stack([np.interp(times, stamps, frame[column].to_numpy()) for column in columns])


def check_stamps(time: FloatArray, *, field: str) -> None:
    """Refuse time stamps that are not numbers, or do not strictly increase.

    Parameters
    ----------
    time : ndarray (n,)
        Time stamps, s.
    field : str
        Where they stand, for the message.

    Raises
    ------
    InputError
        Naming the first NaN, repeated or reversed stamp.
    """
    bad = ~np.isfinite(time)
    step = np.diff(time)
    wrong = np.flatnonzero(bad[1:] | bad[:-1] | ~(step > 0.0))
    if len(wrong):
        i = int(wrong[0])
        kind = "NaN" if bad[i] or bad[i + 1] else ("duplicate" if step[i] == 0.0 else "reversed")
        raise InputError(
            f"has {kind} time stamps at sample {i + 1}",
            field=field,
            value=[float(time[i]), float(time[i + 1])],
            limit="strictly increasing",
            remedy="drop the lines without a time stamp"
            if kind == "NaN"
            else "sort the samples, and drop those that the logger wrote twice",
        )


def rate_of(time: FloatArray) -> float:
    """Mean rate of stamps that jitter, are rounded (to milliseconds, say) or have gaps.

    The interval is at first the mean of the steps that are no gap, as seen from the median step. Then each
    step counts as the whole number of intervals nearest to it, at least one, so that a gap counts its
    missing samples; the rate is their sum over the time that they span.

    Parameters
    ----------
    time : ndarray (n,)
        Strictly increasing time stamps, s; n >= 2.

    Returns
    -------
    float
        Samples per second.
    """
    step = np.diff(time)
    interval = float(np.mean(step[step <= GAP_INTERVALS * np.median(step)]))
    intervals = np.maximum(np.rint(step / interval), 1.0)
    return float(np.sum(intervals) / (time[-1] - time[0]))


def is_uniform(time: FloatArray, rate_hz: float) -> bool:
    """True if each step is one interval to 1 %, and the mean rate that of `rate_hz` to 0.01 %."""
    step = np.diff(time) * rate_hz
    return bool(np.abs(step - 1.0).max() <= 0.01 and abs(step.mean() - 1.0) <= 1e-4)


def uniform_times(first_s: float, last_s: float, rate_hz: float) -> FloatArray:
    """Times first, first + 1/rate, ... up to last (n,), s; a last sample late by rounding still counts."""
    count = int(np.floor((last_s - first_s) * rate_hz + 1e-6)) + 1
    times = first_s + np.arange(count) / rate_hz
    times[-1] = min(times[-1], last_s)
    return times


def find_gaps(time: FloatArray, interval_s: float, *, gap_intervals: float = GAP_INTERVALS) -> pd.DataFrame:
    """Places where stamps are further apart than `gap_intervals` intervals.

    Parameters
    ----------
    time : ndarray (n,)
        Strictly increasing time stamps, s.
    interval_s : float
        Nominal interval.
    gap_intervals : float
        What counts as a gap.

    Returns
    -------
    pandas.DataFrame
        One row per gap, columns `GAPS`.
    """
    step = np.diff(time)
    before = np.flatnonzero(step > gap_intervals * interval_s)
    missing = np.maximum(np.rint(step[before] / interval_s).astype(np.int64) - 1, 1)
    return pd.DataFrame({"start_s": time[before], "end_s": time[before + 1], "missing": missing})


def resample(
    frame: pd.DataFrame,
    times: FloatArray,
    *,
    longest_gap_s: float = LONGEST_GAP_S,
    what: str = "imu",
    interval_s: float | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Interpolate signals linearly at uniform times.

    Parameters
    ----------
    frame : pandas.DataFrame
        Indexed by ``time_s``, strictly increasing, otherwise as irregular as it likes; numeric columns.
    times : ndarray (m,)
        Uniform times within those of the frame, see `uniform_times`; m >= 2. At a time that is a stamp of
        the frame, bit by bit, the sample is kept bit by bit.
    longest_gap_s : float
        Longest distance of two stamps that is bridged.
    what : str
        How messages call the signal.
    interval_s : float, optional
        Interval of the frame's own samples, which tells what is a gap; that of `times` if not given.

    Returns
    -------
    resampled : pandas.DataFrame
        Indexed by `times`, the frame's columns as float64.
    gaps : pandas.DataFrame
        One row per bridged gap, columns `GAPS`.

    Raises
    ------
    InputError
        If stamps do not increase, a value is not finite, a gap is longer than `longest_gap_s`, or `times`
        reach beyond the stamps: nothing is extrapolated.
    """
    stamps = frame.index.to_numpy(dtype=np.float64)
    check_stamps(stamps, field=f"{what}.time_s")
    if times[0] < stamps[0] or times[-1] > stamps[-1]:
        raise InputError(
            "would be extrapolated",
            field=f"{what}.time_s",
            value=[float(times[0]), float(times[-1])],
            limit=f"from {stamps[0]:.9g} to {stamps[-1]:.9g} s, the first and last time stamp",
            remedy=f"cut to {max(stamps[0], times[0]):.9g} ... {min(stamps[-1], times[-1]):.9g} s",
        )
    gaps = find_gaps(stamps, interval_s or (times[-1] - times[0]) / (len(times) - 1))
    refuse_long_gaps(gaps, longest_gap_s, what=what)
    values: dict[str, FloatArray] = {}
    for name in frame.columns:
        samples = frame[name].to_numpy(dtype=np.float64)
        if not np.isfinite(samples).all():
            raise InputError(
                f"is not a finite number at time_s = {stamps[np.argmin(np.isfinite(samples))]:.9g}",
                field=f"{what}.{name}",
                value=float(samples[np.argmin(np.isfinite(samples))]),
                limit="finite numbers",
                remedy="drop that sample, so that it is a gap; nothing is filled in silently",
            )
        values[name] = np.interp(times, stamps, samples)
    return pd.DataFrame(values, index=pd.Index(times, name="time_s"), copy=False), gaps


def refuse_long_gaps(gaps: pd.DataFrame, longest_gap_s: float, *, what: str = "imu") -> None:
    """Refuse gaps longer than can be bridged, naming the first of them.

    Raises
    ------
    InputError
        If ``end_s - start_s`` of a gap is above `longest_gap_s` by more than rounding.
    """
    length = (gaps["end_s"] - gaps["start_s"]).to_numpy(dtype=np.float64)
    too_long = np.flatnonzero(length > longest_gap_s * (1.0 + 1e-9))
    if len(too_long):
        gap = gaps.iloc[int(too_long[0])]
        seconds = float(gap["end_s"] - gap["start_s"])
        more = f" (and {len(too_long) - 1} more such gaps)" if len(too_long) > 1 else ""
        if seconds > JUMP_S:
            raise InputError(
                f"the clock jumps by {_spoken(seconds)}{more}",
                field=f"{what}.time_s",
                value=f"{seconds:.9g} s after time_s = {gap['start_s']:.9g}",
                limit=f"longest_gap_s = {longest_gap_s:g} s",
                remedy="cut the recording there and give each part a ride file; or, if no samples are lost, "
                "leave time out and give rate_hz",
            )
        raise InputError(
            f"has a gap of {gap['missing']:.0f} samples that is too long to bridge{more}",
            field=f"{what}.time_s",
            value=f"{seconds:.6g} s after time_s = {gap['start_s']:.9g}",
            limit=f"longest_gap_s = {longest_gap_s:g} s",
            remedy=f"cut the recording there; or raise {what.partition('.')[0]}.longest_gap_s, knowing that "
            "nothing was measured in it",
        )


def refuse_many_lost(gaps: pd.DataFrame, samples: int, *, what: str = "imu") -> None:
    """Refuse a recording that lacks more than `MOST_LOST` of its samples.

    Raises
    ------
    InputError
        Naming the share.
    """
    missing = float(gaps["missing"].sum())
    share = missing / (missing + samples)
    if share > MOST_LOST:
        raise InputError(
            f"lacks {missing:.0f} samples, in {len(gaps)} gaps",
            field=f"{what}.time_s",
            value=f"{100.0 * share:.3g} % of all",
            limit=f"{100.0 * MOST_LOST:g} %",
            remedy="mend the logger, or cut the recording; if no samples are lost and the stamps are those "
            "of packets, leave time out and give rate_hz",
        )


def _spoken(seconds: float) -> str:
    """A long time in the unit that people use for it."""
    for unit, size in (("years", 365.25 * 86400.0), ("days", 86400.0), ("hours", 3600.0)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.4g} s"
