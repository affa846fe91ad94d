"""Where a way turns back."""

import numpy as np

from simrail.core.turning import TURN_M, turning_rows


def test_a_way_to_and_fro_has_a_row_at_each_turn() -> None:
    way = np.concatenate(
        [np.zeros(50), np.linspace(0, 500, 1000), np.full(80, 500.0), np.linspace(500, 20, 900)]
    )
    first, turn, last = turning_rows(way)
    assert (first, last) == (0, len(way) - 1)
    assert way[turn] == 500.0 and turn < 1130
    backward = turning_rows(-way)
    assert backward == [first, turn, last]
    coarse = turning_rows(way, step=7)
    assert len(coarse) == 3 and abs(way[coarse[1]] - 500.0) < 1e-9


def test_one_way_a_standstill_and_rocking_have_no_turn() -> None:
    line = np.linspace(0.0, 300.0, 500)
    for way in (line, -line, np.full(500, 3.0), line + 0.45 * TURN_M * np.sin(np.arange(500))):
        assert turning_rows(way) == [0, 499]
