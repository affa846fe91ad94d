"""Numbers that know their derivative by the states: a formula written once gives its value and its Jacobian.

A `Dual` holds the value of an expression at n samples, and the slopes of those states on which it depends:
forward differentiation, of first order.
"""

from collections.abc import Mapping
from typing import Union

import numpy as np

from simrail.core.jit import FloatArray, IntArray

Term = Union["Dual", FloatArray, float]


class Dual:
    """Values (n,) and their slopes by states.

    Attributes
    ----------
    value : ndarray (n,)
    slopes : dict of int to ndarray (n,)
        By the number of the state; a state that is not there has none.
    """

    __slots__ = ("slopes", "value")
    __array_ufunc__ = None  # so that an array on the left leaves the work to the Dual

    def __init__(self, value: FloatArray, slopes: Mapping[int, FloatArray] | None = None) -> None:
        self.value = value
        self.slopes: dict[int, FloatArray] = dict(slopes or {})

    def __add__(self, other: Term) -> "Dual":
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.slopes)
        slopes = dict(self.slopes)
        for state, slope in other.slopes.items():
            slopes[state] = slopes[state] + slope if state in slopes else slope
        return Dual(self.value + other.value, slopes)

    def __mul__(self, other: Term) -> "Dual":
        if not isinstance(other, Dual):
            return Dual(self.value * other, {state: slope * other for state, slope in self.slopes.items()})
        slopes = {state: slope * other.value for state, slope in self.slopes.items()}
        for state, slope in other.slopes.items():
            share = slope * self.value
            slopes[state] = slopes[state] + share if state in slopes else share
        return Dual(self.value * other.value, slopes)

    def __neg__(self) -> "Dual":
        return self * -1.0

    def __sub__(self, other: Term) -> "Dual":
        return self + (-other)

    def __rsub__(self, other: Term) -> "Dual":
        return -self + other

    __radd__ = __add__
    __rmul__ = __mul__


Vector = tuple[Dual, Dual, Dual]


def cross(a: Vector, b: Vector) -> Vector:
    """Cross product of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def turned(vector: Vector, rotation: Vector) -> Vector:
    """A vector of the track's axes in those of a body turned by a small rotation; of second order in that.

    (I - [r]x + [r]x [r]x / 2) v: at 30 mrad what is left out is below 1e-5 of the vector.
    """
    first = cross(rotation, vector)
    second = cross(rotation, first)
    return (
        vector[0] - first[0] + 0.5 * second[0],
        vector[1] - first[1] + 0.5 * second[1],
        vector[2] - first[2] + 0.5 * second[2],
    )


def table_of(duals: list[Dual], n: int) -> tuple[FloatArray, IntArray, FloatArray]:
    """Values, and slopes as rows of few entries: (n, m), columns (m, w) and coefficients (n, m, w).

    A row has as many entries as the longest one; those beyond its own are zeros of state 0.
    """
    width = max(len(dual.slopes) for dual in duals)
    columns = np.zeros((len(duals), width), dtype=np.int64)
    slopes = np.zeros((n, len(duals), width))
    values = np.empty((n, len(duals)))
    for row, dual in enumerate(duals):
        values[:, row] = dual.value
        for entry, (state, slope) in enumerate(sorted(dual.slopes.items())):
            columns[row, entry] = state
            slopes[:, row, entry] = slope
    return values, columns, slopes
