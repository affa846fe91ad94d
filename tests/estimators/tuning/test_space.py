"""Box and constraints of the hyper-parameters as a unit cube."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.space import NAMES, SearchSpace

from simrail.core.errors import InputError

PAPER = SearchSpace()
BOTH = SearchSpace(constrained=("y", "z"))
HELD = SearchSpace(box=(1e-8, 1e4), constrained=(), position_m2=3e-3)
HELD_BOTH = SearchSpace(box=(1e-8, 1e4), constrained=("y", "z"), position_m2=3e-3)
ACCEL_Y, ACCEL_Z, PLACE_Y, PLACE_Z = 9, 10, 11, 12


@pytest.mark.parametrize("space", [PAPER, BOTH, HELD, HELD_BOTH])
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_every_point_keeps_to_box_and_constraints(space: SearchSpace, data: st.DataObject) -> None:
    m = len(space.searched)
    corners = st.sampled_from([0.0, 1.0, 0.5]) | st.floats(0.0, 1.0)
    point = np.array(data.draw(st.lists(corners, min_size=m, max_size=m)))
    values = space.values(point)
    space.check(Hyperparameters.from_vector(values))
    low, high = space.box
    free = values[list(space.searched)]
    assert (free >= low).all() and (free <= high).all()
    for axis, accel, place in (("y", ACCEL_Y, PLACE_Y), ("z", ACCEL_Z, PLACE_Z)):
        if axis in space.constrained:
            assert values[accel] <= values[place] / 10.0
        if space.position_m2 is not None:
            assert values[place] == space.position_m2
    back = space.values(space.point(values))
    np.testing.assert_allclose(back, values, rtol=1e-12)


def test_the_cube_reaches_all_of_the_space() -> None:
    """Corners: the box's edges, and where constrained the bound that follows from the position."""
    least, most = PAPER.values(np.zeros(13)), PAPER.values(np.ones(13))
    np.testing.assert_allclose(np.delete(least, PLACE_Y), 1e-4, rtol=1e-12)
    assert least[PLACE_Y] == pytest.approx(1e-3)
    np.testing.assert_allclose(np.delete(most, ACCEL_Y), 1e4, rtol=1e-12)
    assert most[ACCEL_Y] == pytest.approx(1e3)
    middle = np.full(13, 0.5)
    middle[ACCEL_Y] = 1.0
    values = PAPER.values(middle)
    assert values[ACCEL_Y] == pytest.approx(values[PLACE_Y] / 10.0)
    assert values[ACCEL_Z] == pytest.approx(1.0)  # the paper does not bind z
    assert len(HELD.searched) == 11


def test_a_step_along_an_axis_moves_one_parameter() -> None:
    """Except that the accelerometer's follows the position that bounds it."""
    for space in (BOTH, HELD):
        base = np.full(len(space.searched), 0.4)
        for i, number in enumerate(space.searched):
            moved = base.copy()
            moved[i] += 0.1
            changed = np.flatnonzero(space.values(moved) != space.values(base))
            bound = {PLACE_Y: {ACCEL_Y}, PLACE_Z: {ACCEL_Z}}.get(number, set()) if space is BOTH else set()
            assert set(changed) == {number} | bound, NAMES[number]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"box": (1.0, 1e-4)}, ["box", "least < greatest"]),
        ({"box": (0.0, 1.0)}, ["box"]),
        ({"box": (1e-4, float("inf"))}, ["box"]),
        ({"constrained": ("x",)}, ["constrained", "y, z"]),
        ({"constrained": ("y", "y")}, ["constrained"]),
        ({"position_m2": 0.0}, ["position_m2", "> 0"]),
        ({"position_m2": 5e-4}, ["position_m2", "leaves nothing", "0.001"]),
        ({"box": (1e-4, 1e-3)}, ["box", "leaves nothing"]),
    ],
)
def test_no_space(arguments: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        SearchSpace(**arguments)
    for word in words:
        assert word in str(caught.value)
