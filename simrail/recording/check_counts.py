"""Counts that no wheel gives: single readings that jump there and back."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.recording.recording import EncoderSheet

_JUMP_MPS = 150.0
"""Speed of no train (540 km/h): a count that goes there and back within one reading."""


def check_counts(counts: pd.Series, sheet: EncoderSheet, *, where: Callable[[int], str], file: str) -> None:
    """Refuse single readings of a counter that jump there and back, or at an end: no wheel does.

    Parameters
    ----------
    counts : pandas.Series
        Counts, indexed by ``time_s``; wraps and resets mended.
    sheet : EncoderSheet
        Pulses per revolution and radius.
    where, file
        As of `check_samples`.

    Raises
    ------
    InputError
        Naming the first such reading.
    """
    count, time = counts.to_numpy(dtype=np.float64), counts.index.to_numpy(dtype=np.float64)
    if len(count) < 3:
        return
    before, after = np.diff(count)[:-1], np.diff(count)[1:]
    # Beyond two counts a reading, and beyond what a train does in the longer of both intervals.
    most = 2.0 + _JUMP_MPS / sheet.pulse_m * np.maximum(np.diff(time)[:-1], np.diff(time)[1:])
    back = (before * after < 0.0) & (np.minimum(np.abs(before), np.abs(after)) > most)
    if abs(before[0]) > most[0] >= abs(after[0]):
        i, back = 0, np.ones(1, dtype=np.bool_)
    elif abs(after[-1]) > most[-1] >= abs(before[-1]):
        i, back = len(count) - 1, np.ones(1, dtype=np.bool_)
    else:
        i = int(np.argmax(back)) + 1
    if back.any():
        more = f" (and {int(back.sum()) - 1} more such readings)" if back.sum() > 1 else ""
        raise InputError(
            f"jumps in {where(i)} (time_s = {time[i]:.6g}){more}; the reading is no count",
            file=file,
            field="pulse_count",
            value=int(count[i]),
            limit=" and ".join(
                f"{int(count[k])} {side}"
                for k, side in ((i - 1, "before"), (i + 1, "after"))
                if 0 <= k < len(count)
            ),
            remedy="drop that line, so that it is a gap; or mend the width of the counter",
        )
