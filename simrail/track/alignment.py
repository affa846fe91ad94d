"""Joins the elements of a design to piecewise polynomials: yaw, x, y and cant.

Plan: curvature is piecewise linear, so yaw is piecewise quadratic; x and y are closed forms on
straights and arcs and Gauss-Legendre quadrature (to rounding) on clothoids. Cant: height of the left
above the right rail, a polynomial per element.

This module knows nothing of gradients (`simrail.track.vertical`), angles or irregularities. It takes
elements that `check_elements` has passed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly

from simrail.core.jit import FloatArray
from simrail.track.elements import SMOOTH_STEP, Element, Transition

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True, eq=False)
class Plan:
    """The horizontal projection, in pieces of linear curvature.

    Attributes
    ----------
    start_m, x_m, y_m, yaw_rad, curvature_1pm, curvature_rate_1pm2 : ndarray (n,)
        State at the start of every piece.
    """

    start_m: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    yaw_rad: FloatArray
    curvature_1pm: FloatArray
    curvature_rate_1pm2: FloatArray

    def xy(self, s_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates at s, each shaped like s."""
        piece, along = self._locate(np.ravel(s_m))
        east, north = _advance(
            along, self.yaw_rad[piece], self.curvature_1pm[piece], self.curvature_rate_1pm2[piece]
        )
        shape = np.shape(s_m)
        return (self.x_m[piece] + east).reshape(shape), (self.y_m[piece] + north).reshape(shape)

    def state(self, s_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Yaw, curvature, and d curvature / ds at s, each shaped like s."""
        piece, along = self._locate(s_m)
        rate = self.curvature_rate_1pm2[piece]
        curvature = self.curvature_1pm[piece]
        yaw = self.yaw_rad[piece] + along * (curvature + 0.5 * along * rate)
        return yaw, curvature + along * rate, rate

    def _locate(self, s_m: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
        piece = np.clip(np.searchsorted(self.start_m, s_m, side="right") - 1, 0, self.start_m.size - 1)
        return piece, s_m - self.start_m[piece]


def build_plan(
    elements: Sequence[Element], start_m: float, *, position_m: tuple[float, float], yaw_rad: float
) -> Plan:
    """Chain the elements from a start."""
    ends = _end_values(elements)
    rows: list[tuple[float, float, float]] = []
    s = start_m
    for element, ((k0, _), (k1, _)) in zip(elements, ends, strict=True):
        rate = (k1 - k0) / element.length_m
        # Ten nodes are exact to rounding while a piece turns by no more than a radian.
        n = max(1, math.ceil(max(abs(k0), abs(k1)) * element.length_m)) if rate else 1
        step = element.length_m / n
        rows += [(s + i * step, k0 + i * step * rate, rate) for i in range(n)]
        s += element.length_m
    starts, curvature, rates = (np.array(column) for column in zip(*rows, strict=True))
    lengths = np.diff(starts, append=s)
    turns = lengths * (curvature + 0.5 * lengths * rates)
    yaws = yaw_rad + np.concatenate([[0.0], np.cumsum(turns)[:-1]])
    east, north = _advance(lengths, yaws, curvature, rates)
    x = position_m[0] + np.concatenate([[0.0], np.cumsum(east)[:-1]])
    y = position_m[1] + np.concatenate([[0.0], np.cumsum(north)[:-1]])
    return Plan(starts, x, y, yaws, curvature, rates)


def _advance(
    along: FloatArray, yaw: FloatArray, curvature: FloatArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Integrals of cos and sin of yaw + curvature u + rate u^2/2 for u from 0 to `along`."""
    half_turn = 0.5 * curvature * along
    chord = along * np.sinc(half_turn / np.pi)  # exact on arcs, and on straights without a special case
    east, north = chord * np.cos(yaw + half_turn), chord * np.sin(yaw + half_turn)
    bent = np.flatnonzero(rate)
    if bent.size:
        half = 0.5 * along[bent]
        y0, k0, k1 = yaw[bent], curvature[bent], rate[bent]
        cosines, sines = np.zeros(bent.size), np.zeros(bent.size)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            u = half * (1.0 + node)
            angle = y0 + u * (k0 + 0.5 * u * k1)
            cosines += weight * np.cos(angle)
            sines += weight * np.sin(angle)
        east[bent], north[bent] = half * cosines, half * sines
    return east, north


def build_cant(elements: Sequence[Element], start_m: float, *, ramp: str) -> PPoly:
    """Height of the left above the right rail over s, m.

    Parameters
    ----------
    ramp : str
        ``"smooth"``: a quintic with zero slope and bend at both ends of a transition.
        ``"linear"``: in proportion to the curvature, as most real track has it; the twist then steps,
        so its derivative is an impulse, which `TrackDesign.frame` leaves out.
    """
    coefficients = np.zeros((6, len(elements)))
    for i, (element, ((_, h0), (_, h1))) in enumerate(zip(elements, _end_values(elements), strict=True)):
        if ramp == "smooth":
            coefficients[:, i] = (h1 - h0) * SMOOTH_STEP / element.length_m ** np.arange(5.0, -1.0, -1.0)
        else:
            coefficients[-2, i] = (h1 - h0) / element.length_m
        coefficients[-1, i] += h0
    return PPoly(coefficients, element_starts(elements, start_m))


def element_starts(elements: Sequence[Element], start_m: float) -> FloatArray:
    """Start of every element, and the end of the last, (n + 1,)."""
    return start_m + np.concatenate([[0.0], np.cumsum([element.length_m for element in elements])])


def _end_values(elements: Sequence[Element]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Curvature and cross slope at both ends of every element."""
    values = []
    for i, element in enumerate(elements):
        before, after = (
            (elements[i - 1], elements[i + 1]) if isinstance(element, Transition) else (element,) * 2
        )
        assert not isinstance(before, Transition) and not isinstance(after, Transition)
        values.append(
            ((before.curvature_1pm, before.cross_slope_m), (after.curvature_1pm, after.cross_slope_m))
        )
    return values
