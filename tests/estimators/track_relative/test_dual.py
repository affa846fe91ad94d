"""Numbers that know their derivative: against the complex step, and the turn of a body against rotations."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation
from simrail.estimators.track_relative.dual import Dual, cross, table_of, turned

from simrail.core.seeds import stream

RNG = stream(7, "dual")
AT = RNG.standard_normal((4, 3))


def formula(a, b, c):
    """Everything that a Dual can do, with arrays and numbers on both sides."""
    array = np.array([1.0, -2.0, 0.5, 3.0])
    return (a * b - 2.0 * c) * a + (array * c - b) * array + (1.0 - a) + (array - c) * 0.5 + -b * (c + array)


def test_slopes_equal_the_complex_step() -> None:
    one = np.ones(len(AT))
    found = formula(*(Dual(AT[:, i], {i: one}) for i in range(3)))
    np.testing.assert_allclose(found.value, formula(*AT.T), rtol=1e-14)
    for i in range(3):
        moved = AT.astype(complex)
        moved[:, i] += 1e-30j
        np.testing.assert_allclose(found.slopes[i], formula(*moved.T).imag / 1e-30, rtol=1e-13)


def test_operations_leave_their_operands_alone() -> None:
    one = np.ones(2)
    a, b = Dual(one, {0: one}), Dual(2.0 * one, {0: 3.0 * one, 1: one})
    _ = a + b, a * b, a - b, 1.0 - a, -b
    assert list(a.slopes) == [0] and list(b.slopes) == [0, 1]
    assert (a.slopes[0] == 1.0).all() and (b.slopes[0] == 3.0).all() and (a.value == 1.0).all()


def test_a_small_turn_is_a_rotation_to_second_order() -> None:
    """What is left out is the third order of the exponential series: |r|^3/6 of the vector."""
    vector = RNG.standard_normal((50, 3))
    for size in (0.03, 0.1):
        turn = size * RNG.uniform(-1.0, 1.0, (50, 3))
        duals = [tuple(Dual(values[:, i]) for i in range(3)) for values in (vector, turn)]
        found = np.column_stack([part.value for part in turned(*duals)])  # type: ignore[arg-type]
        exact = Rotation.from_rotvec(turn).inv().apply(vector)
        limit = np.linalg.norm(turn, axis=1) ** 3 / 6.0 * np.linalg.norm(vector, axis=1)
        assert (np.linalg.norm(found - exact, axis=1) < limit).all()
        assert np.linalg.norm(found - exact, axis=1).max() > 0.1 * limit.max()


def test_the_cross_product_is_that_of_vectors() -> None:
    a, b = RNG.standard_normal((2, 5, 3))
    found = cross(*(tuple(Dual(v[:, i]) for i in range(3)) for v in (a, b)))  # type: ignore[arg-type]
    np.testing.assert_allclose(np.column_stack([part.value for part in found]), np.cross(a, b), rtol=1e-14)


def test_a_table_has_every_slope_in_the_column_of_its_state() -> None:
    duals = [
        Dual(np.array([1.0, 2.0]), {5: np.array([3.0, 4.0]), 2: np.array([5.0, 6.0])}),
        Dual(np.array([7.0, 8.0]), {4: np.array([9.0, 1.0])}),
    ]
    values, columns, slopes = table_of(duals, 2)
    np.testing.assert_array_equal(values, [[1.0, 7.0], [2.0, 8.0]])
    whole = np.zeros((2, 2, 6))
    for row in range(2):
        np.add.at(whole[:, row], (slice(None), columns[row]), slopes[:, row])
    np.testing.assert_array_equal(whole[:, 0, [2, 5]], [[5.0, 3.0], [6.0, 4.0]])
    np.testing.assert_array_equal(whole[:, 1, 4], [9.0, 1.0])
    assert np.count_nonzero(whole) == 6
