"""Clock times and dates of many forms are the times that they were written from."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.recording.files.clock_times import DAY_S, HOUR_S, continued, read_times
from simrail.recording.files.stamps import RideClock

FIRST = pd.Timestamp("2024-05-31 23:59:59.250")
SINCE = np.array([0.0, 0.5, 1.0, 1.5])

DATED = {
    "iso": "%Y-%m-%dT%H:%M:%S.%f",
    "iso_z": "%Y-%m-%dT%H:%M:%S.%fZ",
    "iso_zone": "%Y-%m-%d %H:%M:%S.%f+02:00",
    "german": "%d.%m.%Y %H:%M:%S,%f",
    "british": "%d/%m/%Y %H:%M:%S.%f",
    "american": "%m/%d/%Y %I:%M:%S.%f %p",
    "slashes": "%Y/%m/%d %H:%M:%S.%f",
    "compact": "%Y%m%dT%H%M%S.%f",
    "digits": "%Y%m%d%H%M%S%f",
    "month_by_name": "%d-%b-%Y %H:%M:%S.%f",
    "colon_before_decimals": "%d.%m.%Y %H:%M:%S:%f",
}


@pytest.mark.parametrize("form", DATED)
def test_dates_over_midnight_and_the_end_of_a_month(form: str) -> None:
    texts = pd.Series([(FIRST + pd.Timedelta(seconds=s)).strftime(DATED[form]) for s in SINCE])
    found = read_times(texts, file="f", field="t")
    assert found.dates_ns is not None and found.seconds is None
    np.testing.assert_array_equal((found.dates_ns - found.dates_ns[0]) / 1e9, SINCE)


@pytest.mark.parametrize("form", ["%H:%M:%S.%f", "%I:%M:%S.%f %p", "%H:%M:%S,%f", "%H:%M:%S:%f"])
def test_clock_times_go_on_over_midnight(form: str) -> None:
    texts = pd.Series([(FIRST + pd.Timedelta(seconds=s)).strftime(form) for s in SINCE])
    found = read_times(texts, file="f", field="t")
    assert found.seconds is not None and found.period_s == DAY_S
    whole, times = continued(found.seconds, found.period_s)
    np.testing.assert_allclose(whole, 86399.25 + SINCE, rtol=0.0, atol=1e-9)
    assert times == 1


def test_minutes_and_seconds_as_a_spreadsheet_shows_them() -> None:
    found = read_times(pd.Series(["59:59.5", "00:00.0", None]), file="f", field="t")
    assert found.seconds is not None and found.period_s == HOUR_S
    whole, _ = continued(found.seconds, HOUR_S)
    np.testing.assert_array_equal(whole, [3599.5, 3600.0, np.nan])


def test_of_two_orders_of_day_and_month_the_one_without_months_between_samples() -> None:
    found = read_times(pd.Series(["5/6/2024 23:59:59.5", "5/7/2024 00:00:00.5"]), file="f", field="t")
    assert found.dates_ns is not None and np.diff(found.dates_ns).tolist() == [10**9]


@pytest.mark.parametrize(
    ("texts", "named"),
    [
        (["hello", "x"], "hello"),
        (["12:00:00.1", "fault"], "fault"),
        (["12:34", "12:35"], "12:34"),
        (["", None], None),
    ],
)
def test_what_is_no_time_is_named_in_one_line(texts: list[str | None], named: str | None) -> None:
    with pytest.raises(InputError) as error:
        read_times(pd.Series(texts, dtype=object), file="f.csv", field="t")
    line = str(error.value)
    assert "\n" not in line and "31.05.2024 12:00:00.123" in line and "f.csv: t" in line
    assert error.value.value == named


@pytest.mark.parametrize(
    ("first", "other", "goes_on"),
    [
        ([86390.0, 86395.0, 0.0, 5.0], [2.0, 7.0], [86402.0, 86407.0]),
        ([86390.0, 86395.0], [86380.0, 86385.0], [86380.0, 86385.0]),
        ([3.0, 8.0], [86398.0, 1.0], [-2.0, 1.0]),
        ([43_000.0, 43_001.0], [43_002.0, np.nan], [43_002.0, np.nan]),
    ],
)
def test_a_signal_that_begins_across_midnight_is_on_the_day_of_the_first(
    first: list[float], other: list[float], goes_on: list[float]
) -> None:
    """The nearest one, before or after: a logger starts its signals within seconds."""
    clock, notes = RideClock(), []  # type: ignore[var-annotated]
    own = clock._over_midnight(np.array(first), DAY_S, "imu", notes)
    assert (np.diff(own) > 0.0).all() and own[0] == first[0]
    beside = clock._over_midnight(np.array(other), DAY_S, "encoder", notes)
    np.testing.assert_array_equal(beside, goes_on)
    assert len(notes) == sum(bool(np.any(np.diff(each) < 0.0)) for each in (first, other))
