"""Joins the elements of a design to piecewise polynomials, and refuses what cannot be joined.

Plan: curvature is piecewise linear, so yaw is piecewise quadratic; x and y are closed forms on
straights and arcs and Gauss-Legendre quadrature (to rounding) on clothoids. Cant: height of the left
above the right rail, a polynomial per element. Vertical: constant gradients joined by parabolas.

This module knows nothing of angles' rates, Darboux vectors or irregularities.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PPoly

from simrail.errors import InputError
from simrail.jit import FloatArray
from simrail.track.elements import RAIL_BASE_M, Element, Gradient, Transition

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
# The quintic smooth step 10 u^3 - 15 u^4 + 6 u^5, and its integral, highest power first.
_SMOOTH_STEP = np.array([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])
MAX_CANT_M = 0.5 * RAIL_BASE_M
MAX_SLOPE = 0.5


@dataclass(frozen=True, eq=False)
class Plan:
    """The horizontal projection, in pieces of linear curvature.

    Attributes
    ----------
    start_m, x_m, y_m, yaw_rad, curvature_1pm, curvature_rate_1pm2 : ndarray (n,)
        State at the start of every piece.
    yaw : PPoly
        Yaw over s, piecewise quadratic.
    """

    start_m: FloatArray
    x_m: FloatArray
    y_m: FloatArray
    yaw_rad: FloatArray
    curvature_1pm: FloatArray
    curvature_rate_1pm2: FloatArray
    yaw: PPoly

    def xy(self, s_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates at s, (n,) each."""
        piece = np.clip(np.searchsorted(self.start_m, s_m, side="right") - 1, 0, self.start_m.size - 1)
        along = s_m - self.start_m[piece]
        east, north = _advance(
            along, self.yaw_rad[piece], self.curvature_1pm[piece], self.curvature_rate_1pm2[piece]
        )
        return self.x_m[piece] + east, self.y_m[piece] + north


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
    yaw = PPoly(np.array([0.5 * rates, curvature, yaws]), np.append(starts, s))
    return Plan(starts, x, y, yaws, curvature, rates, yaw)


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
            coefficients[:, i] = (h1 - h0) * _SMOOTH_STEP / element.length_m ** np.arange(5.0, -1.0, -1.0)
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
        before, after = (elements[i - 1], elements[i + 1]) if isinstance(element, Transition) else (element,) * 2
        assert not isinstance(before, Transition) and not isinstance(after, Transition)
        values.append(
            ((before.curvature_1pm, before.cross_slope_m), (after.curvature_1pm, after.cross_slope_m))
        )
    return values


def build_vertical(
    gradients: Sequence[Gradient],
    start_m: float,
    *,
    end_m: float,
    radius_m: float | Sequence[float],
    ramp_m: float,
    height_m: float,
) -> PPoly:
    """Height of the centreline over s, m.

    Every change of gradient is a parabola of length radius times change, centred on it. Its bend z''
    rises and falls over `ramp_m`, centred on its two ends, as a quintic smooth step: the change of
    slope stays exact, and z'' stays C2 (with a bare parabola, `ramp_m` = 0, the pitch rate steps). A
    change so small that its parabola would be shorter than the ramp gets a larger radius instead.

    Raises
    ------
    InputError
        If two vertical curves overlap, or one reaches beyond the track.
    """
    slope, changes = _slope_changes(gradients, start_m)
    radii = _radii(radius_m, len(changes))
    breaks, bends = [start_m], [np.zeros(6)]  # bend z'' per piece, highest power first
    for i, (centre, change, radius) in enumerate(zip(*_columns(changes), radii, strict=True)):
        if change == 0.0:
            continue
        length = max(radius * abs(change), ramp_m)
        first, last = centre - 0.5 * (length + ramp_m), centre + 0.5 * (length + ramp_m)
        if first < breaks[-1] or last > end_m:
            raise InputError(
                "vertical curve overlaps the one before or reaches beyond the track",
                field="gradient",
                value=f"from {first:.3f} to {last:.3f} m about {centre:g} m (change {i + 1})",
                limit=f"between {breaks[-1]:.3f} and {end_m:.3f} m",
                remedy="move the gradients apart, or reduce vertical_radius_m",
            )
        peak = change / length
        up = peak * _SMOOTH_STEP / max(ramp_m, 1e-300) ** np.arange(5.0, -1.0, -1.0) if ramp_m else None
        flat = np.array([0.0, 0.0, 0.0, 0.0, 0.0, peak])
        pieces = [] if up is None else [(first, up)]
        if length > ramp_m:
            pieces.append((first + ramp_m, flat))
        if up is not None:
            pieces.append((last - ramp_m, flat - up))
        pieces.append((last, np.zeros(6)))
        if first == breaks[-1]:
            breaks.pop()
            bends.pop()
        breaks += [place for place, _ in pieces]
        bends += [bend for _, bend in pieces]
    bend = PPoly(np.array(bends).T, np.append(breaks, max(end_m, np.nextafter(breaks[-1], np.inf))))
    # antiderivative() starts from 0 at start_m; the constants are added to every piece.
    inclination = bend.antiderivative()
    inclination.c[-1] += slope
    height = inclination.antiderivative()
    height.c[-1] += height_m
    return height


def _slope_changes(gradients: Sequence[Gradient], start_m: float) -> tuple[float, list[tuple[float, float]]]:
    """Slope at the start, and (place, change) of every gradient after it. Level before the first."""
    slope = first = 0.0
    changes = []
    for i, gradient in enumerate(gradients):
        if i == 0 and gradient.from_m <= start_m:
            first = slope = gradient.slope
            continue
        changes.append((gradient.from_m, gradient.slope - slope))
        slope = gradient.slope
    return first, changes


def _columns(changes: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [place for place, _ in changes], [change for _, change in changes]


def _radii(radius_m: float | Sequence[float], n: int) -> list[float]:
    radii = list(radius_m) if isinstance(radius_m, Sequence) else [radius_m] * n
    if len(radii) != n:
        raise InputError(
            "needs one radius per change of gradient, or a single one",
            field="vertical_radius_m",
            value=len(radii),
            limit=f"{n} radii",
        )
    for radius in radii:
        require_number(radius, "vertical_radius_m", above=0.0)
    return radii


def require_number(
    value: float, field: str, *, above: float = -math.inf, within: float = math.inf, zero: bool = True
) -> None:
    """Refuse a number that is not finite, not above a bound, or larger in magnitude than another."""
    good = math.isfinite(value) and value > above and abs(value) <= within and (zero or value != 0.0)
    if not good:
        limits = ["finite"] + ([f"> {above:g}"] if above > -math.inf else [])
        limits += ([f"magnitude <= {within:g}"] if within < math.inf else []) + ([] if zero else ["not 0"])
        raise InputError("is out of range", field=field, value=value, limit=", ".join(limits))
