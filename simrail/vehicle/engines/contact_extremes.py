"""The extremes of the forces between wheels and rails, gathered row by row, compiled.

What an engine tells of the contact at its output rate goes through here whether or not it is kept, so it must
cost next to nothing. What the numbers are called, and what is warned of, is in
`simrail.ride.contact_extremes`.

Y/Q over 2 m is the mean of Y over the mean of Q there, as in the message of a derailment
(`simrail.vehicle.engines.derailment`): of forces that are not filtered, the mean of the quotient is that of
spikes, where a wheel hardly touches, or counts the way in the air as 0. EN 14363 takes the mean of the
quotient, of forces that are low-passed first; that is what `simrail.scoring.running_safety` does. Where Q is
steady, both are the same.
"""

from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner
from simrail.vehicle.engines.records import Record, RecordArray

WINDOW_M = 2.0
"""Way of the sliding means, as that of (Y/Q)_2m and (sum Y)_2m in EN 14363."""
STEP_M = 0.1
"""Way from one sliding mean to the next; EN 14363 takes one every 0.5 m."""

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

_MARKS = round(WINDOW_M / STEP_M)
"""Steps of a window."""
_VALUES = 4
"""Values of an axle that have a sliding mean: Y of its left and its right wheel, and their Q."""

AXLE_WAY = np.dtype(
    [
        *((name, "f8") for name in ("place_m", "way_m")),
        *((name, "f8", (_VALUES,)) for name in ("value", "total")),
        ("marks", "i8"),
        ("mark_total", "f8", (_MARKS, _VALUES)),
    ],
    align=True,
)
"""Way of an axle, integrals of its values over it, and these at the marks of the last 2 m (a ring)."""


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
def _note_means(
    way: Record, axle: int, side: FloatArray, found: RecordArray, place_m: float, t: float
) -> None:
    """At a mark: note what the means over the last 2 m, between this mark and that of 2 m before, are.

    ``way.mark_total`` still holds the integrals of 2 m before where those of this mark, ``way.total``, will
    stand.
    """
    before, total = way.mark_total[way.marks % _MARKS], way.total
    y_left, y_right = (total[0] - before[0]) / WINDOW_M, (total[1] - before[1]) / WINDOW_M
    summed = abs(y_left + y_right)
    if summed > found[4].value:
        _note(found[4], summed, axle, place_m, t)
    for n in range(2):
        outward = -side[2 * axle + n] * (y_right if n else y_left)
        carried = (total[2 + n] - before[2 + n]) / WINDOW_M
        # A wheel that carried nothing over the whole way has no quotient.
        if carried > 0.0 and outward > found[5].value * carried:
            _note(found[5], outward / carried, 2 * axle + n, place_m, t)


@njit_inner
def _go(
    way: Record, left: Record, right: Record, axle: int, side: FloatArray, found: RecordArray, t: float
) -> None:
    """Take an axle to its next row, given the contacts of its wheels; in between its values are linear.

    At every mark on the way, the integrals up to it are those of the polyline itself.
    """
    value, total = way.value, way.total
    if not way.marks:
        way.marks, way.place_m = 1, left.position_m
        value[0], value[1], value[2], value[3] = left.guiding_n, right.guiding_n, left.load_n, right.load_n
    moved = abs(left.position_m - way.place_m)
    way.place_m = left.position_m
    rise = (
        left.guiding_n - value[0], right.guiding_n - value[1], left.load_n - value[2], right.load_n - value[3]
    )  # fmt: skip
    # The part of the way to this row from its beginning, or from the last mark on it.
    done, end_m = 0.0, way.way_m + moved
    while way.marks * STEP_M <= end_m and moved > 0.0:
        until = (way.marks * STEP_M - way.way_m) / moved
        for c in range(_VALUES):
            total[c] += moved * (until - done) * (value[c] + 0.5 * (done + until) * rise[c])
        done = until
        if way.marks >= _MARKS:
            _note_means(way, axle, side, found, left.position_m, t)
        for c in range(_VALUES):
            way.mark_total[way.marks % _MARKS, c] = total[c]
        way.marks += 1
    for c in range(_VALUES):
        total[c] += moved * (1.0 - done) * (value[c] + 0.5 * (done + 1.0) * rise[c])
    value[0], value[1], value[2], value[3] = left.guiding_n, right.guiding_n, left.load_n, right.load_n
    way.way_m = end_m


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
            left, right, way = told[i, 2 * a], told[i, 2 * a + 1], ways[a]
            summed = abs(left.guiding_n + right.guiding_n)
            if summed > found[3].value:
                _note(found[3], summed, a, left.position_m, t)
            _go(way, left, right, a, side, found, t)
