"""Trailing sums against plain loops."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.seeds import stream
from simrail.core.trailing import trailing_sum


@pytest.mark.parametrize("window", [1, 3, 40])
def test_sums_are_those_of_the_last_rows(window: int) -> None:
    values = stream(1, "trailing").standard_normal((20, 2))
    wanted = [values[max(k + 1 - window, 0) : k + 1].sum(axis=0) for k in range(20)]
    np.testing.assert_allclose(trailing_sum(values, window), wanted, rtol=0, atol=1e-13)


def test_those_of_a_prefix_are_the_same_bits() -> None:
    values = stream(2, "trailing").standard_normal((50, 3))
    np.testing.assert_array_equal(trailing_sum(values[:30], 7), trailing_sum(values, 7)[:30])


def test_nothing_has_no_sums() -> None:
    assert trailing_sum(np.empty((0, 2)), 4).shape == (0, 2)
