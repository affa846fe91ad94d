"""Columns of a frame as kernels take them."""

import numpy as np
import pandas as pd

from simrail.recording.recording import rows_of


def test_columns_are_contiguous_and_read_only_and_views_where_they_can_be() -> None:
    values = np.arange(12.0).reshape(4, 3)
    held = pd.DataFrame(values, columns=["a", "b", "c"])  # pandas lays its columns in rows
    strided = pd.DataFrame(values, columns=["a", "b", "c"], copy=False)
    mixed = held.assign(b=held["b"].astype(int))
    for frame in (held, strided, mixed):
        for row, column in zip(rows_of(frame, ("c", "a")), (2, 0), strict=True):
            np.testing.assert_array_equal(row, values[:, column])
            assert row.flags.c_contiguous and not row.flags.writeable and row.dtype == np.float64
    assert np.shares_memory(rows_of(held, ("b",))[0], held.to_numpy())
    strided.iloc[0, 0] = 7.0  # what is read-only is the row, not the frame
    assert strided.iloc[0, 0] == 7.0
