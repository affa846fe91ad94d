"""Boxes and bounds as a unit cube: of the smoother's hyper-parameters, and of others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.space import NAMES, SearchSpace

from simrail.core.errors import InputError
from simrail.estimation.tunable import Parameter

PAPER = SearchSpace()
BOTH = SearchSpace(constrained=("y", "z"))
HELD = SearchSpace(box=(1e-8, 1e4), constrained=(), position_m2=3e-3)
HELD_BOTH = SearchSpace(box=(1e-8, 1e4), constrained=("y", "z"), position_m2=3e-3)
ACCEL_Y, ACCEL_Z, PLACE_Y, PLACE_Z = 9, 10, 11, 12


def cube_of(space: SearchSpace) -> Cube:
    return Cube(space.parameters(Hyperparameters()))


@pytest.mark.parametrize("space", [PAPER, BOTH, HELD, HELD_BOTH])
@settings(deadline=None, max_examples=60)
@given(data=st.data())
def test_every_point_keeps_to_box_and_constraints(space: SearchSpace, data: st.DataObject) -> None:
    cube = cube_of(space)
    m = len(cube.searched)
    corners = st.sampled_from([0.0, 1.0, 0.5]) | st.floats(0.0, 1.0)
    point = np.array(data.draw(st.lists(corners, min_size=m, max_size=m)))
    values = cube.values(point)
    space.check(Hyperparameters(*values.tolist()))
    low, high = space.box
    free = values[list(cube.searched)]
    assert (free >= low).all() and (free <= high).all()
    for axis, accel, place in (("y", ACCEL_Y, PLACE_Y), ("z", ACCEL_Z, PLACE_Z)):
        if axis in space.constrained:
            assert values[accel] <= values[place] / 10.0
        if space.position_m2 is not None:
            assert values[place] == space.position_m2
    back = cube.values(cube.point(values))
    np.testing.assert_allclose(back, values, rtol=1e-12)


def test_the_cube_reaches_all_of_the_space() -> None:
    """Corners: the box's edges, and where constrained the bound that follows from the position."""
    cube = cube_of(PAPER)
    least, most = cube.values(np.zeros(13)), cube.values(np.ones(13))
    np.testing.assert_allclose(np.delete(least, PLACE_Y), 1e-4, rtol=1e-12)
    assert least[PLACE_Y] == pytest.approx(1e-3)
    np.testing.assert_allclose(np.delete(most, ACCEL_Y), 1e4, rtol=1e-12)
    assert most[ACCEL_Y] == pytest.approx(1e3)
    middle = np.full(13, 0.5)
    middle[ACCEL_Y] = 1.0
    values = cube.values(middle)
    assert values[ACCEL_Y] == pytest.approx(values[PLACE_Y] / 10.0)
    assert values[ACCEL_Z] == pytest.approx(1.0)  # the paper does not bind z
    assert len(cube_of(HELD).searched) == 11


def test_a_step_along_an_axis_moves_one_parameter() -> None:
    """Except that the accelerometer's follows the position that bounds it."""
    for space in (BOTH, HELD):
        cube = cube_of(space)
        base = np.full(len(cube.searched), 0.4)
        for i, number in enumerate(cube.searched):
            moved = base.copy()
            moved[i] += 0.1
            changed = np.flatnonzero(cube.values(moved) != cube.values(base))
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


def test_linear_and_logarithmic_scales() -> None:
    """Half way is the middle of a linear box and the geometric mean of a logarithmic one."""
    cube = Cube(
        (
            Parameter("tau_s", "s", 0.1, 10.0, 2.0),
            Parameter("offset_m", "m", -3.0, 5.0, 0.0, scale="linear"),
            Parameter("gain", "1", 2.0, 2.0, 2.0),
        )
    )
    assert cube.named(np.full(2, 0.5)) == {"tau_s": pytest.approx(1.0), "offset_m": 1.0, "gain": 2.0}
    np.testing.assert_allclose(cube.values(cube.start()), [2.0, 0.0, 2.0], atol=1e-12)
    with pytest.raises(InputError, match=r"offset_m: .*found -4\.0; limit: -3 to 5"):
        cube.check({"tau_s": 1.0, "offset_m": -4.0, "gain": 2.0})
    with pytest.raises(InputError, match="tau_s: is no box"):
        Parameter("tau_s", "s", 0.0, 10.0, 2.0)
