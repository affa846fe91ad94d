"""The 95th percentile of an error's size, beside numpy's."""

import numpy as np
import pytest

from simrail.scoring.metrics import percentile95


@pytest.mark.parametrize("count", [1, 2, 3, 20, 21, 22, 41, 100, 999, 1000, 20000, 20011])
def test_it_is_numpys_to_the_bit(count: int) -> None:
    values = np.abs(np.random.default_rng(count).normal(size=count))
    assert percentile95(values.copy()) == np.percentile(values, 95.0)


def test_it_lies_between_the_two_nearest() -> None:
    """Of 0 to 20 it is 19; of 0 to 10 it is half way from 9 to 10."""
    assert percentile95(np.arange(21.0)[::-1].copy()) == pytest.approx(19.0)
    assert percentile95(np.arange(11.0)) == pytest.approx(9.5)
