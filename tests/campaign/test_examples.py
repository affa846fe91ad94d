"""Which recordings are drawn: the worst of each case, of each IMU one before a second, ideal ones last."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from simrail.campaign.examples import worst_cells


def cell(number: int, case: int, grade: str) -> Any:
    return SimpleNamespace(number=number, case=case, imu=SimpleNamespace(name="axle", grade=grade))


CELLS = [
    *(cell(n, 0, "ideal") for n in range(3)),
    *(cell(n, 1, "fine") for n in range(3, 6)),
    *(cell(n, 2, "coarse") for n in range(6, 9)),
    *(cell(n, 3, "coarse") for n in range(9, 12)),
]
ERRORS = dict(enumerate([9.0, 8.0, 7.0, 0.1, 0.3, 0.2, 1.0, 3.0, 2.0, 2.5, 1.5, 0.5]))


def test_the_worst_draw_of_each_case_is_drawn_and_an_ideal_imu_comes_last() -> None:
    """An ideal IMU errs the most here, and is still no device that anyone buys."""
    assert [one.number for one in worst_cells(CELLS, ERRORS)] == [7, 4, 9, 0]


@pytest.mark.parametrize("seed", [0, 1])
def test_the_order_of_the_cells_does_not_matter(seed: int) -> None:
    mixed = [CELLS[place] for place in np.random.default_rng(seed).permutation(len(CELLS))]
    assert [one.number for one in worst_cells(mixed, ERRORS)] == [7, 4, 9, 0]


def test_a_cell_without_a_figure_is_less_bad_than_any_other() -> None:
    known = {number: error for number, error in ERRORS.items() if number not in (7, 9)}
    assert [one.number for one in worst_cells(CELLS, known)] == [8, 4, 10, 0]
    assert [one.number for one in worst_cells(CELLS, {})] == [3, 6, 9, 0], "the first draws, without any"
