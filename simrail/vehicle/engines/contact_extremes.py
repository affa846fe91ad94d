"""The extremes of the forces between wheels and rails, gathered row by row, compiled.

What an engine tells of the contact at its output rate goes through here whether or not it is kept, so it must
cost next to nothing. What the numbers are called, and what is warned of, is in
`simrail.ride.contact_extremes`.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.engines.records import Record, RecordArray

WINDOW_M = 2.0
"""Way of the sliding means, as EN 14363 takes them of Y/Q and of the sum of Y."""
STEP_M = 1e-3
"""Way from one mark of a sliding mean to the next, at least: a vehicle at rest makes none."""

EXTREME = np.dtype([("value", "f8"), ("which", "i8"), ("position_m", "f8"), ("time_s", "f8")], align=True)
"""A value, the number of its wheel or axle, and where and when it occurred."""
KINDS = (
    "greatest_q_n",
    "greatest_q_over_q0",
    "smallest_q_over_q0",
    "greatest_sum_y_n",
    "greatest_sum_y_2m_n",
    "greatest_y_over_q_2m",
    "longest_without_load_s",
)
"""What is gathered, in the order of `Gathered.found`."""

_MARKS = round(WINDOW_M / STEP_M) + 8
"""Marks that a window and its edges can hold."""
_VALUES = 3
"""Values of an axle that have a sliding mean: the sum of Y, and Y/Q of both wheels."""

AXLE_WAY = np.dtype(
    [
        *((name, "f8") for name in ("place_m", "way_m")),
        *((name, "f8", (_VALUES,)) for name in ("value", "total")),
        *((name, "i8") for name in ("begun", "newest", "oldest")),
        ("mark_m", "f8", (_MARKS,)),
        ("mark_total", "f8", (_MARKS, _VALUES)),
    ],
    align=True,
)
"""Way of an axle, integrals of its values over it, and both at the marks of the last 2 m (a ring)."""


class Gathered(NamedTuple):
    """What has been gathered.

    Attributes
    ----------
    found : ndarray of records (7,)
        `EXTREME` of each of `KINDS`.
    ways : ndarray of records (a,)
        `AXLE_WAY` of each axle.
    up_rows : ndarray (w,)
        Rows for which each wheel has carried nothing until now.
    rows : ndarray (2,)
        Rows in all, and those in which a wheel carries nothing.
    """

    found: RecordArray
    ways: RecordArray
    up_rows: FloatArray
    rows: FloatArray


def gathered_of(axles: int) -> Gathered:
    """A `Gathered` of nothing; each axle has two wheels."""
    found = np.zeros(len(KINDS), EXTREME)
    found["value"] = -np.inf
    found["value"][KINDS.index("smallest_q_over_q0")] = np.inf
    return Gathered(found, np.zeros(axles, AXLE_WAY), np.zeros(2 * axles), np.zeros(2))


@njit_inner
def _note(extreme: Record, value: float, which: int, position_m: float, time_s: float) -> None:
    extreme.value, extreme.which, extreme.position_m, extreme.time_s = value, which, position_m, time_s


@njit_inner
def _go(way: Record, place_m: float, sum_y: float, left: float, right: float) -> float:
    """Take an axle to its next row, by the trapezoidal rule.

    Returns
    -------
    float
        Share of the interval between the two oldest marks that lies before the last 2 m; -1 if it is no row
        for a mean: no mark since the last one, or less than 2 m of way.
    """
    if not way.begun:
        way.begun, way.place_m = 1, place_m
        way.value[0], way.value[1], way.value[2] = sum_y, left, right
    moved = abs(place_m - way.place_m)
    way.place_m = place_m
    way.way_m += moved
    way.total[0] += 0.5 * moved * (way.value[0] + sum_y)
    way.total[1] += 0.5 * moved * (way.value[1] + left)
    way.total[2] += 0.5 * moved * (way.value[2] + right)
    way.value[0], way.value[1], way.value[2] = sum_y, left, right
    if way.way_m - way.mark_m[way.newest] < STEP_M:
        return -1.0
    way.newest = (way.newest + 1) % _MARKS
    way.mark_m[way.newest] = way.way_m
    for c in range(_VALUES):
        way.mark_total[way.newest, c] = way.total[c]
    begin = way.way_m - WINDOW_M
    if begin < 0.0:
        return -1.0
    after = (way.oldest + 1) % _MARKS
    while way.mark_m[after] <= begin:
        way.oldest, after = after, (after + 1) % _MARKS
    share: float = (begin - way.mark_m[way.oldest]) / (way.mark_m[after] - way.mark_m[way.oldest])
    return share


@njit_inner
def _mean(way: Record, share: float, column: int) -> float:
    """Mean over the last 2 m of a value; ``share`` of the oldest interval lies before them."""
    after = (way.oldest + 1) % _MARKS
    low, high = way.mark_total[way.oldest, column], way.mark_total[after, column]
    mean: float = (way.total[column] - low - share * (high - low)) / WINDOW_M
    return mean


@njit_borrowed
def gather(
    time_s: FloatArray,
    told: RecordArray,
    static_n: FloatArray,
    side: FloatArray,
    rate_hz: float,
    gathered: Gathered,
) -> None:
    """Take the next rows.

    Parameters
    ----------
    time_s : ndarray (n,)
        Their times.
    told : ndarray of records (n, w)
        `simrail.vehicle.contact.contact.CONTACT`.
    static_n, side : ndarray (w,)
        Load of each wheel at rest; +1 for a left wheel, -1 for a right one.
    rate_hz : float
        Rate of the rows.
    gathered : Gathered
        Goes on with.
    """
    found, ways, up_rows, rows = gathered.found, gathered.ways, gathered.up_rows, gathered.rows
    for i in range(told.shape[0]):
        t, lifted = time_s[i], False
        for w in range(told.shape[1]):
            here = told[i, w]
            ratio = here.load_n / static_n[w]
            if here.load_n > found[0].value:
                _note(found[0], here.load_n, w, here.position_m, t)
            if ratio > found[1].value:
                _note(found[1], ratio, w, here.position_m, t)
            if ratio < found[2].value:
                _note(found[2], ratio, w, here.position_m, t)
            if here.normal_n > 0.0:
                up_rows[w] = 0.0
                continue
            lifted = True
            up_rows[w] += 1.0
            if up_rows[w] / rate_hz > found[6].value:
                _note(found[6], up_rows[w] / rate_hz, w, here.position_m, t)
        rows[0] += 1.0
        rows[1] += lifted
        for a in range(ways.shape[0]):
            one, other = told[i, 2 * a], told[i, 2 * a + 1]
            summed, way = one.guiding_n + other.guiding_n, ways[a]
            if abs(summed) > found[3].value:
                _note(found[3], abs(summed), a, one.position_m, t)
            left = -side[2 * a] * one.guiding_n / one.load_n if one.load_n > 0.0 else 0.0
            right = -side[2 * a + 1] * other.guiding_n / other.load_n if other.load_n > 0.0 else 0.0
            share = _go(way, one.position_m, summed, left, right)
            if share < 0.0:
                continue
            mean = abs(_mean(way, share, 0))
            if mean > found[4].value:
                _note(found[4], mean, a, one.position_m, t)
            for n in range(2):
                mean = _mean(way, share, n + 1)
                if mean > found[5].value:
                    _note(found[5], mean, 2 * a + n, one.position_m, t)
