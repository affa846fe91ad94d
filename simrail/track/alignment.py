"""Joins the elements of a design to piecewise polynomials: yaw, x, y and cant.

Plan: curvature is piecewise linear, so yaw is piecewise quadratic; x and y are closed forms on
straights and arcs and Gauss-Legendre quadrature (to rounding) on clothoids. Cant: height of the left
above the right rail, a polynomial per element.

Where curvature or cant step, the step is smoothed over a length L, centred on it: curvature rises in
proportion, as in a clothoid of length L, which keeps the turn and shifts the line by step L^2/24; cant rises
as in every other ramp.

This module knows nothing of gradients (`simrail.track.vertical`), angles or irregularities. It takes
elements that `simrail.track.joints.check_elements` has passed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly

from simrail.core.jit import FloatArray
from simrail.track.elements import SMOOTH_STEP, CantStation, Element
from simrail.track.joints import EVEN_1PM, EVEN_M, end_values, steps

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
    elements: Sequence[Element],
    start_m: float,
    *,
    position_m: tuple[float, float],
    yaw_rad: float,
    step_smoothing_m: float = 0.0,
) -> Plan:
    """Chain the elements from a start."""
    rows: list[tuple[float, float, float]] = []
    s = start_m
    for length, k0, k1 in _pieces(elements, start_m, step_smoothing_m):
        rate = (k1 - k0) / length
        # Ten nodes are exact to rounding while a piece turns by no more than a radian.
        n = max(1, math.ceil(max(abs(k0), abs(k1)) * length)) if rate else 1
        step = length / n
        rows += [(s + i * step, k0 + i * step * rate, rate) for i in range(n)]
        s += length
    starts, curvature, rates = (np.array(column) for column in zip(*rows, strict=True))
    lengths = np.diff(starts, append=s)
    turns = lengths * (curvature + 0.5 * lengths * rates)
    yaws = yaw_rad + np.concatenate([[0.0], np.cumsum(turns)[:-1]])
    east, north = _advance(lengths, yaws, curvature, rates)
    x = position_m[0] + np.concatenate([[0.0], np.cumsum(east)[:-1]])
    y = position_m[1] + np.concatenate([[0.0], np.cumsum(north)[:-1]])
    return Plan(starts, x, y, yaws, curvature, rates)


def _pieces(
    elements: Sequence[Element], start_m: float, smoothing_m: float
) -> list[tuple[float, float, float]]:
    """Length and curvature at both ends of every piece: of every element, and of what smooths a step."""
    ends = end_values(elements)
    pieces = [
        (element.length_m, first.curvature_1pm, last.curvature_1pm)
        for element, (first, last) in zip(elements, ends, strict=True)
    ]
    at = [
        (step.element, step.curvature_1pm) for step in steps(elements) if abs(step.curvature_1pm) > EVEN_1PM
    ]
    if not at:
        return pieces
    starts = element_starts(elements, start_m)
    linear = np.array([[(k1 - k0) / length, k0] for length, k0, k1 in pieces]).T
    smooth = _smoothed(PPoly(linear, starts), [(starts[i], size) for i, size in at], smoothing_m, _LINEAR)
    lengths = np.diff(smooth.x)
    return [
        (float(length), float(k0), float(k0 + rate * length))
        for length, rate, k0 in zip(lengths, *smooth.c, strict=True)
    ]


_LINEAR = np.array([1.0, 0.0])
"""The straight line from 0 to 1, highest power first."""


def _smoothed(base: PPoly, at: Sequence[tuple[float, float]], length_m: float, ramp: FloatArray) -> PPoly:
    """A piecewise polynomial whose steps, by place and size, rise over a length in the shape of a ramp.

    Each adds size times (ramp - unit step), which is nothing outside of the length: smoothings that overlap
    add up, so that a kink of half a metre becomes one low bend of the same turn.
    """
    order = max(len(ramp), base.c.shape[0])
    half = 0.5 * length_m
    marks = [place + shift for place, _ in at for shift in (-half, 0.0, half)]
    breaks = np.unique(np.concatenate([base.x, marks]))
    total = _refined(base, breaks, order)
    for place, size in at:
        rise = size * ramp / length_m ** np.arange(len(ramp) - 1.0, -1.0, -1.0)
        upper = np.array(PPoly(rise[:, None], [place - half, place + half]).c[:, 0])
        bridge = PPoly(
            np.column_stack([np.zeros_like(rise), upper, np.zeros_like(rise)]),
            [breaks[0] - length_m, place - half, place + half, breaks[-1] + length_m],
        )
        total += _refined(bridge, breaks, order)
        inside = (breaks[:-1] >= place) & (breaks[:-1] < place + half)
        total[-1, inside] -= size
    return PPoly(total, breaks)


def _refined(polynomial: PPoly, breaks: FloatArray, order: int) -> FloatArray:
    """Coefficients (order, n) of a piecewise polynomial about the starts of finer pieces (n + 1,)."""
    rows = [
        polynomial.derivative(k)(breaks[:-1]) / math.factorial(k) if k else polynomial(breaks[:-1])
        for k in range(polynomial.c.shape[0])
    ]
    rows += [np.zeros(breaks.size - 1)] * (order - len(rows))
    return np.array(rows[::-1])


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


def build_cant(
    elements: Sequence[Element], start_m: float, *, ramp: str, step_smoothing_m: float = 0.0
) -> PPoly:
    """Height of the left above the right rail over s, m.

    Parameters
    ----------
    ramp : str
        ``"smooth"``: a quintic with zero slope and bend at both ends of a transition.
        ``"linear"``: in proportion to the curvature, as most real track has it; the twist then steps,
        so its derivative is an impulse, which `TrackDesign.frame` leaves out.
    step_smoothing_m : float
        Length over which a step of cant rises.
    """
    coefficients = np.zeros((6, len(elements)))
    for i, (element, ((_, h0), (_, h1))) in enumerate(zip(elements, end_values(elements), strict=True)):
        if ramp == "smooth":
            coefficients[:, i] = (h1 - h0) * SMOOTH_STEP / element.length_m ** np.arange(5.0, -1.0, -1.0)
        else:
            coefficients[-2, i] = (h1 - h0) / element.length_m
        coefficients[-1, i] += h0
    starts = element_starts(elements, start_m)
    cant = PPoly(coefficients, starts)
    at = [(starts[step.element], step.cross_slope_m) for step in steps(elements)]
    at = [(place, size) for place, size in at if abs(size) > EVEN_M]
    shape = SMOOTH_STEP if ramp == "smooth" else _LINEAR
    return _smoothed(cant, at, step_smoothing_m, shape) if at else cant


def cant_of_stations(stations: Sequence[CantStation], start_m: float, end_m: float) -> PPoly:
    """Height of the left above the right rail over s, m: linear between stations, level outside of them."""
    places = np.array([station.at_m for station in stations])
    levels = np.array([station.cross_slope_m for station in stations])
    breaks = np.unique(np.concatenate([[start_m, end_m], places]))
    values = np.interp(breaks, places, levels)
    return PPoly(np.array([np.diff(values) / np.diff(breaks), values[:-1]]), breaks)


def element_starts(elements: Sequence[Element], start_m: float) -> FloatArray:
    """Start of every element, and the end of the last, (n + 1,)."""
    return start_m + np.concatenate([[0.0], np.cumsum([element.length_m for element in elements])])
