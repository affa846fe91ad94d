"""A counter that jumps there and back within one reading is told by its place; no wheel does."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.recording.check_counts import check_counts
from simrail.recording.recording import EncoderSheet

RATE = 100.0


def test_a_count_that_jumps_there_and_back_is_named() -> None:
    sheet = EncoderSheet("front.left", 1024, 0.29, RATE)
    time = pd.Index(np.arange(2000) / RATE, name="time_s")
    count = pd.Series(np.rint(0.05 * np.arange(2000) ** 1.5).astype(np.int64), index=time)
    judge = {"where": lambda sample: f"line {sample + 2}", "file": "ride.csv"}
    check_counts(count, sheet, **judge)
    to_and_fro = count.copy()
    to_and_fro.iloc[0:100:2] += 1
    check_counts(to_and_fro, sheet, **judge)
    count.iloc[700] += 65536
    with pytest.raises(InputError, match=r"line 702 \(time_s = 7\).*no count"):
        check_counts(count, sheet, **judge)


@pytest.mark.parametrize(("row", "line"), [(0, 2), (-1, 2001)])
def test_a_count_that_jumps_at_an_end_is_named(row: int, line: int) -> None:
    time = pd.Index(np.arange(2000) / RATE, name="time_s")
    count = pd.Series(np.arange(2000), index=time)
    count.iloc[row] = 99999
    with pytest.raises(InputError, match=f"line {line} "):
        check_counts(
            count,
            EncoderSheet("front.left", 1024, 0.29, RATE),
            where=lambda sample: f"line {sample + 2}",
            file="ride.csv",
        )
