"""Joins gradients by vertical curves to the height of the centreline, a piecewise polynomial.

This module knows nothing of the plan, and nothing of the pitch angle that belongs to a slope.
"""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PPoly

from simrail.core.errors import InputError
from simrail.track.elements import MAX_SLOPE, SMOOTH_STEP, Gradient, require_number

_TOUCHING_M = 1e-6
"""Overlap of two vertical curves that is rounding."""


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
    for i, ((centre, change), radius) in enumerate(zip(changes, radii, strict=True)):
        if change == 0.0:
            continue
        length = max(radius * abs(change), ramp_m)
        first, last = centre - 0.5 * (length + ramp_m), centre + 0.5 * (length + ramp_m)
        # Curves that touch do so to rounding.
        first = breaks[-1] if breaks[-1] - _TOUCHING_M < first < breaks[-1] else first
        last = end_m if end_m < last < end_m + _TOUCHING_M else last
        if first < breaks[-1] or last > end_m:
            raise InputError(
                "vertical curve overlaps the one before or reaches beyond the track",
                field="gradient",
                value=f"from {first:.3f} to {last:.3f} m about {centre:g} m (change {i + 1})",
                limit=f"between {breaks[-1]:.3f} and {end_m:.3f} m",
                remedy="move the gradients apart, or reduce vertical_radius_m",
            )
        peak = change / length
        up = peak * SMOOTH_STEP / ramp_m ** np.arange(5.0, -1.0, -1.0) if ramp_m else None
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


def check_gradients(gradients: Sequence[Gradient], *, end_m: float) -> None:
    """Refuse gradients that are not in order, not on the track, or steeper than 500 permil.

    Raises
    ------
    InputError
        Naming the gradient (counted from 0).
    """
    before = -np.inf
    for i, gradient in enumerate(gradients):
        require_number(gradient.slope, f"gradient[{i}].slope", within=MAX_SLOPE)
        require_number(gradient.from_m, f"gradient[{i}].from_m")
        if not before < gradient.from_m < end_m:
            raise InputError(
                "is not between the gradient before it and the end of the track",
                field=f"gradient[{i}].from_m",
                value=gradient.from_m,
                limit=f"between {before:g} and {end_m:g} m",
                remedy="list the gradients in the order of from_m",
            )
        before = gradient.from_m
