"""Where hyper-parameters of the trajectory smoother are searched: a box with constraints.

Gonzalez-Carbajal et al. 2023 (paper 001), Eqs. 17 and 19. As a cube: `simrail.estimators.tuning.cube`.
"""

import math
from dataclasses import asdict, dataclass, fields

from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.tuning.cube import Cube

from simrail.core.errors import InputError
from simrail.estimation.tunable import Parameter

NAMES = tuple(field.name for field in fields(Hyperparameters))
"""The 13 hyper-parameters in the paper's order."""

PAIRS = {
    "y": ("accel_y_m2ps4", "lateral_position_m2"),
    "z": ("accel_z_m2ps4", "vertical_position_m2"),
}
"""By axis: the variance of the accelerometer and that of the virtual position."""

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

    def parameters(self, start: Hyperparameters) -> tuple[Parameter, ...]:
        """The 13 hyper-parameters in the paper's order, with where a search begins."""
        bounds = {PAIRS[axis][0]: (PAIRS[axis][1], RATIO) for axis in self.constrained}
        positions = [position for _, position in PAIRS.values()]
        held = self.position_m2
        return tuple(
            Parameter(
                name,
                unit=name.rpartition("_")[2].replace("p", "/"),
                lower=self.box[0] if held is None or name not in positions else held,
                upper=self.box[1] if held is None or name not in positions else held,
                start=value,
                at_most=bounds.get(name),
            )
            for name, value in asdict(start).items()
        )

    def check(self, parameters: Hyperparameters) -> None:
        """Refuse parameters that break box or constraints.

        Raises
        ------
        InputError
            Naming the parameter, its value and the limit.
        """
        Cube(self.parameters(parameters)).check(asdict(parameters))
