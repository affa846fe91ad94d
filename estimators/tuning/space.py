"""Where hyper-parameters of the trajectory smoother are searched: a box with constraints, as a unit cube.

Gonzalez-Carbajal et al. 2023 (paper 001), Eqs. 17 and 19. The search is in the logarithms, and the cube is
mapped so that every point of it keeps to box and constraints: no optimiser has to know of them.

Not here: the search (`simrail.estimators.tuning.search`), what it minimises
(`simrail.estimators.tuning.tune`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from simrail.estimators.trajectory.noise import Hyperparameters

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray

NAMES = tuple(field.name for field in fields(Hyperparameters))
"""The 13 hyper-parameters in the paper's order."""

PAIRS = {"y": (9, 11), "z": (10, 12)}
"""By axis: numbers of the variance of the accelerometer and of that of the virtual position."""

RATIO = 10.0
"""A constrained accelerometer's variance (m2/s4) is at most the position's (m2) over this (paper, Eq. 19)."""


IDENTIFIED, FLAT, HELD = "identified", "flat", "held"
LOWER, UPPER, CONSTRAINT = "at the lower edge", "at the upper edge", "at the constraint"
STATUSES = (IDENTIFIED, FLAT, HELD, LOWER, UPPER, CONSTRAINT)
"""What can become of a parameter in a search: see `simrail.estimators.tuning.identify.identify`."""


@dataclass(frozen=True)
class SearchSpace:
    """Box and constraints; the defaults are the paper's.

    Attributes
    ----------
    box : tuple of float
        Least and greatest value of every parameter that is searched, SI.
    constrained : tuple of str
        Axes, of "y" and "z", on which the accelerometer is held to be better known than the virtual position
        by `RATIO`. The paper has "y" only; then the likelihood pins z to its virtual position instead.
    position_m2 : float, optional
        Holds the variance of both virtual positions there. They are constants and no measurements, so the
        likelihood says nothing true about them, and they are better chosen than searched.
    """

    box: tuple[float, float] = (1e-4, 1e4)
    constrained: tuple[str, ...] = ("y",)
    position_m2: float | None = None

    def __post_init__(self) -> None:
        low, high = self.box
        if not 0.0 < low < high < math.inf:
            raise InputError("is no box", field="box", value=list(self.box), limit="0 < least < greatest")
        for axis in self.constrained:
            if axis not in PAIRS or self.constrained.count(axis) > 1:
                raise InputError(
                    "are no axes", field="constrained", value=list(self.constrained), limit="y, z, or both"
                )
        held = self.position_m2
        if held is not None and not 0.0 < held < math.inf:
            raise InputError("is out of range", field="position_m2", value=held, limit="> 0 m2")
        greatest = high if held is None else held
        if self.constrained and greatest <= RATIO * low:
            raise InputError(
                "leaves nothing to search",
                field="box" if held is None else "position_m2",
                value=list(self.box) if held is None else held,
                limit=f"> {RATIO * low:g}, {RATIO:g} times the least value of the box",
                remedy="widen the box, or drop the constraint",
            )

    @property
    def searched(self) -> tuple[int, ...]:
        """Numbers of the parameters that are searched, in the order of the cube's axes."""
        held = () if self.position_m2 is None else tuple(position for _, position in PAIRS.values())
        return tuple(i for i in range(len(NAMES)) if i not in held)

    def values(self, point: FloatArray) -> FloatArray:
        """The 13 parameters (13,) at a point of the unit cube (m,)."""
        logs = np.full(len(NAMES), np.nan if self.position_m2 is None else math.log10(self.position_m2))
        at = dict(zip(self.searched, np.clip(point, 0.0, 1.0), strict=True))
        # Positions come after the accelerometers that they bound.
        for i in reversed(self.searched):
            low, high = self._logs(i, logs)
            logs[i] = low + at[i] * (high - low)
        found = np.clip(10.0**logs, *self.box)
        if self.position_m2 is not None:
            found[[position for _, position in PAIRS.values()]] = self.position_m2
        for axis in self.constrained:
            accel, position = PAIRS[axis]
            found[accel] = min(found[accel], found[position] / RATIO)  # rounding of the logarithms
        return found

    def point(self, values: FloatArray) -> FloatArray:
        """The point of the unit cube (m,) with parameters (13,), or the nearest edge along each axis."""
        logs = np.log10(np.asarray(values, dtype=np.float64))
        if self.position_m2 is not None:
            logs[[position for _, position in PAIRS.values()]] = math.log10(self.position_m2)
        found = []
        for i in self.searched:
            low, high = self._logs(i, logs)
            found.append((logs[i] - low) / (high - low) if high > low else 0.0)
        return np.clip(np.array(found), 0.0, 1.0)

    def limits(self, values: FloatArray) -> FloatArray:
        """Least and greatest value (m, 2) of each searched parameter, the others being as in (13,)."""
        return np.array([10.0 ** np.array(self._logs(i, np.log10(values))) for i in self.searched])

    def _logs(self, number: int, logs: FloatArray) -> tuple[float, float]:
        """Least and greatest logarithm of a parameter, given those of the positions."""
        low, high = math.log10(self.box[0]), math.log10(self.box[1])
        for axis in self.constrained:
            accel, position = PAIRS[axis]
            if number == position:
                low += math.log10(RATIO)
            if number == accel:
                high = min(high, max(low, float(logs[position]) - math.log10(RATIO)))
        return low, high

    def check(self, parameters: Hyperparameters) -> None:
        """Refuse parameters that break box or constraints.

        Raises
        ------
        InputError
            Naming the parameter, its value and the limit.
        """
        values = parameters.vector()
        low, high = self.box
        for i, (name, value) in enumerate(zip(NAMES, values, strict=True)):
            if i not in self.searched:
                if value != self.position_m2:
                    raise InputError(
                        "is not what the search held it at",
                        field=name,
                        value=float(value),
                        limit=f"{self.position_m2!r}",
                    )
            elif not low <= value <= high:
                raise InputError(
                    "is outside the box of its search",
                    field=name,
                    value=float(value),
                    limit=f"{low:g} to {high:g}",
                )
        for axis in self.constrained:
            accel, position = PAIRS[axis]
            if values[accel] > values[position] / RATIO:
                raise InputError(
                    "breaks the constraint of its search",
                    field=NAMES[accel],
                    value=float(values[accel]),
                    limit=f"<= {NAMES[position]}/{RATIO:g} = {values[position] / RATIO:g}",
                )
