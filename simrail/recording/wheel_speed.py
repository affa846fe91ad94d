"""Distance and speed as a logger reads them off a wheel encoder: by counting, and by timing the edges.

Counting divides the pulses of an interval by its length: simple, good at high speed, and useless below a
pulse per interval. Timing divides the way between two edges by the time between them: fine at low speed,
and limited by the timer at high speed. Both are what a device does sample by sample, with no model
of the train; `simrail.estimators.odometry.encoder` is the filter that the estimators use.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from simrail.core.columns import EDGE_TIME
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, njit
from simrail.recording.recording import EncoderSheet

STILL_S = 0.5
"""Without an edge for so long, a logger that times edges shows zero."""


def pulse_way_m(sheet: EncoderSheet) -> float:
    """Way of one count, 2 pi r / N, in m."""
    return 2.0 * np.pi * sheet.wheel_radius_m / sheet.pulses_per_revolution


def counted_way_m(encoder: pd.DataFrame, sheet: EncoderSheet) -> pd.Series[float]:
    """Way since the first reading, m, signed: whole counts times `pulse_way_m`."""
    counts = encoder["pulse_count"] - encoder["pulse_count"].iloc[0]
    way: pd.Series[float] = (counts * pulse_way_m(sheet)).rename("way_m")
    return way


def speed_by_counting(encoder: pd.DataFrame, sheet: EncoderSheet, *, readings: int = 1) -> pd.Series[float]:
    """Speed from the counts of an interval.

    Parameters
    ----------
    encoder : pandas.DataFrame
        Indexed by ``time_s``, column ``pulse_count``.
    sheet : EncoderSheet
        Counts per turn and nominal radius.
    readings : int
        Length of the interval in readings, >= 1. Before there are so many, the interval begins at the
        first reading.

    Returns
    -------
    pandas.Series
        ``speed_mps``, m/s: mean speed over the interval that ends at the reading, in steps of
        2 pi r / (N T); 0 at the first reading.

    Raises
    ------
    InputError
        If the interval has no length.
    """
    if readings < 1:
        raise InputError("an interval needs a length", field="readings", value=readings, limit=">= 1")
    counts = encoder["pulse_count"].to_numpy(dtype=np.float64)
    times = encoder.index.to_numpy(dtype=np.float64)
    begin = np.maximum(np.arange(len(counts)) - readings, 0)
    elapsed = times - times[begin]
    elapsed[0] = np.inf
    speed = (counts - counts[begin]) * pulse_way_m(sheet) / elapsed
    return pd.Series(speed, index=encoder.index, name="speed_mps")


def speed_by_period(
    encoder: pd.DataFrame, sheet: EncoderSheet, *, still_s: float = STILL_S
) -> pd.Series[float]:
    """Speed from the times of edges.

    At a reading with a new edge: the way from the last edge known at an earlier reading to the new one,
    over the time between them. With at most one edge per reading that is the time between the last two
    edges; with more it is the mean over those of the interval. An edge that is passed to and fro is no
    way at all, so a reversal reads zero. While the next edge is awaited the speed can be no more than one
    count over the time since the last one; after `still_s` it is zero.

    Parameters
    ----------
    encoder : pandas.DataFrame
        Indexed by ``time_s``, columns ``pulse_count`` and ``edge_time_s``.
    sheet : EncoderSheet
        Counts per turn and nominal radius.
    still_s : float
        Time without an edge after which the wheel is taken to stand.

    Returns
    -------
    pandas.Series
        ``speed_mps``, m/s; 0 until two edges have passed.

    Raises
    ------
    InputError
        If there are no edge times.
    """
    if EDGE_TIME not in encoder:
        raise InputError(
            "the encoder has no edge times",
            field="encoder",
            value=list(map(str, encoder.columns)),
            limit=EDGE_TIME,
            remedy="record with edge_times = true, or count",
        )
    speed = _by_period(
        encoder.index.to_numpy(dtype=np.float64),
        encoder["pulse_count"].to_numpy(dtype=np.float64),
        encoder[EDGE_TIME].to_numpy(dtype=np.float64),
        pulse_way_m(sheet),
        still_s,
    )
    return pd.Series(speed, index=encoder.index, name="speed_mps")


@njit
def _by_period(time: FloatArray, count: FloatArray, edge: FloatArray, way: float, still: float) -> FloatArray:
    """Loop of `speed_by_period`; way is that of one count."""
    speed = np.zeros(len(time))
    known = False  # whether an edge has passed
    place, when = 0.0, edge[0]  # of the last edge, in counts
    value = 0.0
    for k in range(1, len(time)):
        change = count[k] - count[k - 1]
        if edge[k] > when or change != 0.0:
            # The edge just passed lies below the count when going up, above it when going down.
            if change == 0.0:
                now = place  # to and fro within one reading
            elif change > 0.0:
                now = count[k]
            else:
                now = count[k] + 1.0
            if known and edge[k] > when:
                value = (now - place) * way / (edge[k] - when)
            place, when, known = now, edge[k], True
        awaited = time[k] - when
        if awaited > still:
            value = 0.0
        if awaited > 0.0 and abs(value) * awaited > way:
            value = np.sign(value) * way / awaited
        speed[k] = value
    return speed
