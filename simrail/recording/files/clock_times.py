"""Clock times and dates as text, in the forms that loggers and spreadsheets write them.

Date-times with or without a zone, dates in the order of any country, and clock times without a date, which
begin anew at midnight. Of a date without a zone nobody knows the zone, and nobody needs to: only differences
matter.
"""

import re
from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

FORMS = "e.g. 2024-05-31T12:00:00.123, 31.05.2024 12:00:00.123, 12:00:00.123"

DAY_S, HOUR_S = 86400.0, 3600.0

_CLOCK = r"(?:(?P<h>\d{1,4}):)?(?P<m>\d{1,2}):(?P<s>\d{1,2}(?:[.,:]\d+)?)\s*(?P<half>[AaPp][Mm])?"
_DATE = r"(?P<a>\d{1,4})[-/.](?P<b>\d{1,2})[-/.](?P<c>\d{1,4})[T _,;]+"


class TextTimes(NamedTuple):
    """Times that were read from text.

    Attributes
    ----------
    seconds : ndarray (n,)
        Since midnight, for clock times; NaN where the field is empty. None for dates.
    dates_ns : ndarray (n,) of int64
        Nanoseconds since 1970, for dates; int64's least where the field is empty. None for clock times.
    period_s : float
        After this time the clock begins anew.
    """

    seconds: FloatArray | None
    dates_ns: np.ndarray | None
    period_s: float = DAY_S


EMPTY = np.iinfo(np.int64).min


def read_times(texts: pd.Series, *, file: str, field: str) -> TextTimes:
    """Read clock times or date-times, all in one form.

    Parameters
    ----------
    texts : pandas.Series
        Text, or dates already; missing where there is none.
    file, field : str
        Where they stand, for the message.

    Raises
    ------
    InputError
        Naming the first that is neither, and the forms that are read.
    """
    if pd.api.types.is_datetime64_any_dtype(texts):
        return TextTimes(None, _nanoseconds(pd.to_datetime(texts, utc=True)))
    words = texts.astype("string").str.strip()
    filled = words.dropna()
    filled = filled[filled != ""]
    if not len(filled):
        raise InputError(
            "holds no times",
            file=file,
            field=field,
            limit=FORMS,
            remedy="name the column that holds the times",
        )
    found = None
    if re.fullmatch(_CLOCK, filled.iloc[0]):
        found = _clock(words)
    else:
        for read in (_iso, _ordered, _compact, _any):
            dates = read(words, filled)
            if dates is not None:
                found = TextTimes(None, _nanoseconds(dates))
                break
    if found is None:
        odd = _first_odd(filled)
        raise InputError(
            "holds no date-time",
            file=file,
            field=field,
            value=odd,
            limit=FORMS,
            remedy="for plain numbers set units.time to s, ms, us, ns, epoch_s, epoch_ms, ... or ticks",
        )
    return found


def continued(seconds: FloatArray, period_s: float) -> tuple[FloatArray, int]:
    """Clock times that go on over midnight, and how often the clock began anew."""
    known = np.isfinite(seconds)
    step = np.diff(seconds[known], prepend=seconds[known][:1])
    turns: np.ndarray = np.cumsum(step < -0.5 * period_s) - np.cumsum(step > 0.5 * period_s)
    whole = seconds.copy()
    whole[known] += period_s * turns
    return whole, int(np.sum(step < -0.5 * period_s))


def _clock(words: pd.Series) -> TextTimes | None:
    # The same number of parts in all: 12:00:00.1, or 00:43.4 as a spreadsheet shows minutes and seconds.
    parts = words.str.extract(rf"^{_CLOCK}$")
    filled = words.notna() & (words != "")
    if parts["m"].isna()[filled].any():
        return None
    hours, minutes = (pd.to_numeric(parts[name]).to_numpy(float, na_value=np.nan) for name in ("h", "m"))
    # A colon before the decimals, and a decimal comma.
    seconds = _seconds(parts["s"])
    short = bool(parts["h"].isna()[filled].all())
    plain = not parts["s"][filled].str.contains("[.,:]", regex=True).any()
    if short and plain:  # 12:34 is hours and minutes: too coarse for any samples
        return None
    half = parts["half"].str.lower()
    hours = np.where(half.notna(), hours % 12 + 12.0 * (half == "pm").to_numpy(bool, na_value=False), hours)
    if short:
        return TextTimes(60.0 * minutes + seconds, None, HOUR_S)
    return TextTimes(3600.0 * hours + 60.0 * minutes + seconds, None)


def _seconds(texts: pd.Series) -> FloatArray:
    plain = texts.str.replace("[,:]", ".", regex=True)
    return pd.to_numeric(plain).to_numpy(float, na_value=np.nan)


def _iso(words: pd.Series, filled: pd.Series) -> pd.Series | None:
    if not re.match(r"\d{4}-\d\d-\d\d", filled.iloc[0]):
        return None
    return _parsed(words.str.replace(",", "."), format="ISO8601")


def _ordered(words: pd.Series, filled: pd.Series) -> pd.Series | None:
    """Year, month and day in any order, with any mark between them."""
    if not re.match(_DATE + _CLOCK, filled.iloc[0]):
        return None
    date = words.str.extract("^" + _DATE.replace("[T _,;]+", r"[T _,;]+(?P<rest>.*)$"))
    if date["a"].isna()[words.notna() & (words != "")].any():
        return None
    if len(filled.iloc[0].split(".")[0]) == 4 or re.match(r"\d{4}", filled.iloc[0]):
        orders = [("a", "b", "c")]
    else:
        orders = [("c", "b", "a"), ("c", "a", "b")]  # day first, then month first
        if "." not in filled.iloc[0][:3]:
            numbers = date[["a", "b"]].astype(float).max()
            orders = [order for order in orders if numbers[order[1]] <= 12] or orders
    best: pd.Series | None = None
    for year, month, day in orders:
        years = date[year].where(date[year].str.len() == 4, "20" + date[year])
        rest = date["rest"].str.replace(r"^(\d+:\d+:\d+)[,:](\d)", r"\1.\2", regex=True)
        text = years + "-" + date[month].str.zfill(2) + "-" + date[day].str.zfill(2) + " " + rest
        read = _with_half(text)
        # Of two orders the right one has no months between neighbours.
        if read is not None and (best is None or np.ptp(read.dropna()) < np.ptp(best.dropna())):
            best = read
    return best


def _with_half(text: pd.Series) -> pd.Series | None:
    """Date-times of one order; with am and pm where they have it."""
    if not bool(text.dropna().str.contains(r"[AaPp][Mm]$", regex=True).any()):
        return _parsed(text.str.replace(r" (\d):", r" 0\1:", regex=True), format="ISO8601")
    dots = bool(text.dropna().str.contains(r"\.\d", regex=True).any())
    spaced = text.str.replace(r"\s*([AaPp][Mm])$", r" \1", regex=True)
    return _parsed(spaced, format=f"%Y-%m-%d %I:%M:%S{'.%f' * dots} %p")


def _compact(words: pd.Series, filled: pd.Series) -> pd.Series | None:
    """Digits alone: 20240531T120000.123, 20240531120000123."""
    if not re.match(r"\d{8}", filled.iloc[0]):
        return None
    parts = words.str.extract(r"^(\d{8})[T _-]?(\d{6})[.,]?(\d*)(Z?)$")
    if parts[0].isna()[words.notna() & (words != "")].any():
        return None
    return _parsed(parts[0] + " " + parts[1] + "." + parts[2].replace("", "0"), format="%Y%m%d %H%M%S.%f")


def _any(words: pd.Series, filled: pd.Series) -> pd.Series | None:
    """With the name of a month, as 31-May-2024 12:00:00.5."""
    if not re.search(r"[A-Za-z]{3}", filled.iloc[0]) or not re.search(r"\d:\d\d", filled.iloc[0]):
        return None
    return _parsed(words, format="mixed")


def _parsed(texts: pd.Series, *, format: str) -> pd.Series | None:
    try:
        return pd.to_datetime(texts.where(texts != ""), utc=True, format=format)
    except (ValueError, TypeError, OverflowError):
        return None


def _nanoseconds(dates: pd.Series) -> np.ndarray:
    count: np.ndarray = dates.dt.as_unit("ns").astype("int64").to_numpy().copy()
    count[dates.isna().to_numpy()] = EMPTY
    return count


def _first_odd(filled: pd.Series) -> str:
    """The first text that is not of the form of the first; the first itself, if that is unknown."""
    shape = filled.str.replace(r"\d+", "0", regex=True)
    other = filled[shape != shape.iloc[0]]
    return str(filled.iloc[0] if not len(other) or not _known(filled.iloc[0]) else other.iloc[0])


def _known(word: str) -> bool:
    return bool(re.match(rf"({_DATE})?{_CLOCK}", word) or re.match(r"\d{4}-\d\d-\d\d[T ]", word))
