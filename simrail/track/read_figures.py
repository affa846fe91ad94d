"""What a line from another program comes to, in figures; and what of it no railway has.

A unit that is wrong leaves a line that looks sound: cant in metres under a heading of millimetres is next to
none, places in kilometres make a line of a metre. So its length, radii, cant and gradients are told, and what
lies far from those of railways is told with the unit that it looks like.
"""

import math

import numpy as np

from simrail.core.errors import InputError
from simrail.track.drawn import Drawn

SHORTEST_M = 5.0
"""A line below this is none: places in km, or a part of one element."""

SMALLEST_M, TIGHTEST_M = 5e-4, 15.0
"""Greatest cant below which rails are not laid so; and a radius below which none are bent (trams: 18 m).
"""

BALANCED_KMH = 12.0
"""Speed that cant balances below which it is not what the rails have: 76 mm written as 3 (inches) balance
9 km/h where the radius is 300 m."""

STEEPEST, FLATTEST = 0.15, 3e-4
"""Greatest gradient above which no rails are laid without a rack, and below which a line has none."""

FLAT_1PM, LARGE_M = 1e-8, 1e5
"""Curvature that is none; and a radius of all curves above which the unit of the curvature is another."""

APART, APART_M = 20.0, 200.0
"""Distance of two rows, in medians and at least, from which on rows are missing or the chainage breaks."""


def figures_of(drawn: Drawn) -> list[str]:
    """What a line comes to, and what of it is doubtful, a sentence each.

    Raises
    ------
    InputError
        If it is shorter than any line, or its cant is next to none.
    """
    length = sum(piece.length_m for piece in drawn.pieces)
    if length < SHORTEST_M:
        raise InputError(
            "is shorter than any line",
            field="position",
            value=f"{length:.4g} m",
            limit=f">= {SHORTEST_M:g} m",
            remedy="places that are km have to be called so, e.g. 'position [km]'",
        )
    bend = max((max(abs(piece.start_1pm), abs(piece.end_1pm)) for piece in drawn.pieces), default=0.0)
    cant = max((abs(station.cross_slope_m) for station in drawn.cant), default=0.0)
    if 0.0 < cant < SMALLEST_M:
        raise InputError(
            "has a cant that is next to none",
            field="cant",
            value=f"{1e3 * cant:.3g} mm at most",
            limit=f">= {1e3 * SMALLEST_M:g} mm, or 0",
            remedy="it looks like metres, or radians: name the column 'cant [m]'",
        )
    slope = max((abs(value) for value in (drawn.slope, *(turn.slope for turn in drawn.turns))), default=0.0)
    radius = math.inf if bend < FLAT_1PM else 1.0 / bend
    told = [f"{length:.6g} m"]
    told.append("straight" if math.isinf(radius) else f"radii down to {radius:.4g} m")
    told.append(f"cant up to {1e3 * cant:.3g} mm" if cant else "no cant")
    told.append(f"gradients up to {1e3 * slope:.3g} permil" if slope else "level")
    return [", ".join(told), *_doubts(drawn, radius, cant, slope)]


def _doubts(drawn: Drawn, radius: float, cant: float, slope: float) -> list[str]:
    doubts = []
    if radius < TIGHTEST_M:
        doubts.append(f"a radius of {radius:.3g} m is tighter than any railway's: is its unit right?")
    elif not math.isinf(radius) and radius > LARGE_M:
        doubts.append(f"no radius is below {radius / 1e3:.3g} km: is curvature [1/m] called [1/km]?")
    if cant and TIGHTEST_M <= radius < LARGE_M:
        balanced = 3.6 * math.sqrt(9.81 * radius * cant / drawn.rail_base_m)
        if balanced < BALANCED_KMH:
            doubts.append(
                f"a cant of {1e3 * cant:.3g} mm at a radius of {radius:.4g} m balances {balanced:.2g} km/h: "
                "is it in inches, 'cant [in]'?"
            )
    if slope > STEEPEST:
        doubts.append(f"a gradient of {1e3 * slope:.3g} permil is steeper than any railway's: or is it %?")
    elif 0.0 < slope < FLATTEST:
        doubts.append(f"no gradient is above {1e3 * slope:.2g} permil: is it m/m, or %?")
    return [f"doubtful: {doubt}" for doubt in doubts]


def missing_rows(places_m: np.ndarray) -> list[str]:
    """A sentence where two rows of a table are far apart, while all others are not."""
    steps = np.diff(places_m)
    steps, rows = steps[steps > 0.0], np.flatnonzero(steps > 0.0)
    if len(steps) < 10:
        return []
    usual, worst = float(np.median(steps)), int(np.argmax(steps))
    if steps[worst] < max(APART * usual, APART_M) or np.partition(steps, -2)[-2] > 3.0 * usual:
        return []
    return [
        f"doubtful: row {int(rows[worst]) + 3} is {steps[worst]:.5g} m behind the row before, all others "
        f"{usual:.3g} m: are rows missing, or does the chainage break? It is taken as linear in between"
    ]
