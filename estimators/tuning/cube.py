"""Parameters that are searched, each within its box and bounds, as the unit cube.

The cube is mapped so that every point of it keeps to boxes and bounds: no optimiser has to know of them. A
parameter on a logarithmic scale is searched in its logarithm.

Not here: the search (`simrail.estimators.tuning.search`), what it minimises (a tunable estimator's own).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.tunable import Parameter

BoolArray = npt.NDArray[np.bool_]


def _end_on_scale(parameter: Parameter, end: float) -> float:
    """An end of a parameter's box on the scale on which it is searched."""
    return math.log10(end) if parameter.scale == "log" else end


@dataclass(frozen=True)
class Cube:
    """The unit cube of n parameters, of which m are not held."""

    parameters: tuple[Parameter, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def searched(self) -> tuple[int, ...]:
        """Numbers of the parameters that are searched, in the order of the cube's axes."""
        return tuple(i for i, parameter in enumerate(self.parameters) if not parameter.is_held)

    def start(self) -> FloatArray:
        """The point (m,) at which a search begins."""
        return self.point(np.array([parameter.start for parameter in self.parameters]))

    def named(self, point: FloatArray) -> dict[str, float]:
        """Value of every parameter by name at a point (m,)."""
        return dict(zip(self.names, map(float, self.values(point)), strict=True))

    def values(self, point: FloatArray) -> FloatArray:
        """The parameters (n,) at a point of the unit cube (m,)."""
        places = np.array([_end_on_scale(parameter, parameter.lower) for parameter in self.parameters])
        shares = dict(zip(self.searched, np.clip(point, 0.0, 1.0), strict=True))
        # A parameter comes after the one that bounds it.
        for i in sorted(self.searched, key=lambda i: self.parameters[i].at_most is not None):
            low, high = self._ends(i, places)
            places[i] = low + shares[i] * (high - low)
        # Clipped and bounded again for the rounding of the logarithms.
        lower, upper = np.array([(parameter.lower, parameter.upper) for parameter in self.parameters]).T
        values: FloatArray = np.clip(self._from_places(places), lower, upper)
        for i, parameter in enumerate(self.parameters):
            if parameter.at_most is not None:
                bounding, divisor = parameter.at_most
                values[i] = min(values[i], values[self.names.index(bounding)] / divisor)
        return values

    def point(self, values: FloatArray) -> FloatArray:
        """The point of the unit cube (m,) with parameters (n,), or the nearest edge along each axis."""
        places = self._places(values)
        shares = []
        for i in self.searched:
            low, high = self._ends(i, places)
            shares.append((places[i] - low) / (high - low) if high > low else 0.0)
        point: FloatArray = np.clip(np.array(shares), 0.0, 1.0)
        return point

    def limits(self, values: FloatArray) -> FloatArray:
        """Least and greatest value (m, 2) of each searched parameter, the others being as in (n,)."""
        places = self._places(values)
        ends = np.array([self._ends(i, places) for i in range(len(places))])
        return np.column_stack([self._from_places(end) for end in ends.T])[list(self.searched)]

    def check(self, values: Mapping[str, float]) -> None:
        """Refuse values that break boxes or bounds.

        Raises
        ------
        InputError
            Naming the parameter, its value and the limit.
        """
        for parameter in self.parameters:
            value = values[parameter.name]
            if not parameter.lower <= value <= parameter.upper:
                raise InputError(
                    "is not what the search held it at"
                    if parameter.is_held
                    else "is outside the box of its search",
                    field=parameter.name,
                    value=float(value),
                    limit=repr(parameter.lower)
                    if parameter.is_held
                    else f"{parameter.lower:g} to {parameter.upper:g}",
                )
            if parameter.at_most is not None:
                bounding, divisor = parameter.at_most
                if value > values[bounding] / divisor:
                    raise InputError(
                        "breaks the constraint of its search",
                        field=parameter.name,
                        value=float(value),
                        limit=f"<= {bounding}/{divisor:g} = {values[bounding] / divisor:g}",
                    )

    def allows(self, values: Mapping[str, float]) -> bool:
        """True if values keep to boxes and bounds."""
        try:
            self.check(values)
        except InputError:
            return False
        return True

    def _is_log(self) -> BoolArray:
        """Which parameters (n,) are searched in their logarithm."""
        return np.array([parameter.scale == "log" for parameter in self.parameters])

    def _from_places(self, places: FloatArray) -> FloatArray:
        """Parameters (n,) from their places on their scales."""
        values = places.copy()
        values[self._is_log()] = 10.0 ** places[self._is_log()]
        return values

    def _places(self, values: FloatArray) -> FloatArray:
        """Places of parameters (n,) on their scales; one that is held is where it is held."""
        places = np.array(values, dtype=np.float64)
        places[self._is_log()] = np.log10(places[self._is_log()])
        for i, parameter in enumerate(self.parameters):
            if parameter.is_held:
                places[i] = _end_on_scale(parameter, parameter.lower)
        return places

    def _ends(self, number: int, places: FloatArray) -> tuple[float, float]:
        """Least and greatest place of a parameter on its scale, given those of the parameters (n,)."""
        parameter = self.parameters[number]
        low, high = (_end_on_scale(parameter, end) for end in (parameter.lower, parameter.upper))
        for other in self.parameters:
            if other.at_most is not None and other.at_most[0] == parameter.name:
                low = max(low, _end_on_scale(other, other.lower) + math.log10(other.at_most[1]))
        if parameter.at_most is not None:
            bounding, divisor = parameter.at_most
            bound = float(places[self.names.index(bounding)]) - math.log10(divisor)
            high = min(high, max(low, bound))
        return low, high
