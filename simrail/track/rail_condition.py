"""What lies on the rails: stretches where they are wet or under leaves, and friction with them.

It is a state of the day, not of the design: it belongs to a ride and to the track as it lies, and no
train knows of it. The coefficients of the named conditions are nominal values of this project, chosen
to tell dry, poor and very poor adhesion apart; they are not from a source.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

FRICTION = {"wet": 0.15, "leaves": 0.05}
"""Nominal coefficients. A rail that is "dry" has the coefficient that the vehicle file gives."""

FADE_M = 4.0
"""Over this length at both ends, within the stretch, friction passes over."""


@dataclass(frozen=True)
class RailCondition:
    """One stretch.

    Attributes
    ----------
    start_m, end_m : float
        Where it lies, s along the track.
    factor : float
        Friction there over friction on a clean rail, > 0.
    rails : {"both", "left", "right"}
        Which rails it lies on.
    """

    start_m: float
    end_m: float
    factor: float
    rails: Literal["both", "left", "right"] = "both"


def check_conditions(conditions: Sequence[RailCondition], start_m: float, end_m: float) -> None:
    """Refuse conditions that are off a track from ``start_m`` to ``end_m``, too short, or overlap.

    Raises
    ------
    InputError
        Naming the condition as ``rail_condition[i]``.
    """
    for i, at in enumerate(conditions):
        field = f"rail_condition[{i}]"
        if not at.factor > 0.0:
            raise InputError(
                "friction must be positive", field=f"{field}.friction", value=at.factor, limit="> 0"
            )
        for name, value in (("start_m", at.start_m), ("end_m", at.end_m)):
            if not start_m <= value <= end_m:
                raise InputError(
                    "the rail condition is not on the track",
                    field=f"{field}.{name}",
                    value=value,
                    limit=f"{start_m:g} to {end_m:g} m",
                    remedy="move it onto the track",
                )
        if at.end_m - at.start_m < 2.0 * FADE_M:
            raise InputError(
                "the rail condition is too short to fade in and out",
                field=f"{field}.end_m",
                value=at.end_m,
                limit=f">= start_m + {2.0 * FADE_M:g} m, {at.start_m + 2.0 * FADE_M:g} m",
                remedy="make it longer; end_m lies beyond start_m whichever way the train runs",
            )
    for side in ("left", "right"):
        here = [(at.start_m, at.end_m, i) for i, at in enumerate(conditions) if at.rails in (side, "both")]
        for (_, end, i), (begin, _, j) in pairwise(sorted(here)):
            if begin < end:
                raise InputError(
                    f"two rail conditions lie on the {side} rail at once",
                    field=f"rail_condition[{max(i, j)}].start_m",
                    value=conditions[max(i, j)].start_m,
                    limit=f"clear of rail_condition[{min(i, j)}], "
                    f"{conditions[min(i, j)].start_m:g} to {conditions[min(i, j)].end_m:g} m",
                    remedy="let one end where the other starts",
                )


def friction_factors(conditions: Sequence[RailCondition], s: FloatArray) -> FloatArray:
    """Friction of the left and right rail over that of clean ones, at places s (n,): (n, 2).

    Within ``FADE_M`` of both ends it follows a quintic smooth step, so that it is C2 along the track.
    """
    factors = np.ones((len(s), 2))
    for at in conditions:
        u = np.clip(np.minimum(s - at.start_m, at.end_m - s) / FADE_M, 0.0, 1.0)
        share = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        for rail, side in enumerate(("left", "right")):
            if at.rails in (side, "both"):
                factors[:, rail] += share * (at.factor - 1.0)
    return factors
