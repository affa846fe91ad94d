"""What a line has beside its elements: cant and height that vary slowly along it, over equal steps.

A drawing of straights, arcs and clothoids cannot say that the cant wanders by a millimetre along the line, or
that the ground has settled. A surveyed map can. `TrackDesign` adds it to what its elements say.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.track.elements import require_number
from simrail.track.frame_kernel import polynomial_terms


@dataclass(frozen=True)
class Deviation:
    """Cant and height to be added to a design, at equal steps along it.

    Attributes
    ----------
    from_m, step_m : float
        s of the first value, and the distance of the values.
    cant_m : tuple of float
        Left above right rail over the design's rail base, m.
    height_m : tuple of float
        Of the centreline, m; as many as of the cant.

    Between the values lie cubic splines with level ends; beyond the first and the last value nothing
    changes any more.
    """

    from_m: float
    step_m: float
    cant_m: tuple[float, ...]
    height_m: tuple[float, ...]

    def check(self) -> None:
        """Refuse what makes no line.

        Raises
        ------
        InputError
            Naming the field and the limit.
        """
        require_number(self.from_m, "deviation.from_m")
        require_number(self.step_m, "deviation.step_m", above=0.0)
        if not 4 <= len(self.cant_m) == len(self.height_m):
            raise InputError(
                "needs as many values of the cant as of the height",
                field="deviation.cant_m",
                value=len(self.cant_m),
                limit=f"{max(4, len(self.height_m))}, and at least 4",
            )
        # A slope that is wrong by 0.2 permil is 4 m of height after 20 km.
        for name, limit in (("cant_m", 1.0), ("height_m", 100.0)):
            for i, value in enumerate(getattr(self, name)):
                require_number(value, f"deviation.{name}[{i}]", within=limit)

    @cached_property
    def _splines(self) -> tuple[CubicSpline, CubicSpline]:
        places = self.from_m + self.step_m * np.arange(len(self.cant_m))
        cant, height = (
            CubicSpline(places, values, bc_type="clamped") for values in (self.cant_m, self.height_m)
        )
        return cant, height

    def cant(self, s_m: npt.ArrayLike, *, derivatives: int) -> list[FloatArray]:
        """Cant at places s and its derivatives by s up to an order, each shaped like s."""
        return self._at(0, s_m, derivatives)

    def height(self, s_m: npt.ArrayLike, *, derivatives: int) -> list[FloatArray]:
        """Height at places s and its derivatives by s up to an order, each shaped like s."""
        return self._at(1, s_m, derivatives)

    def _at(self, which: int, s_m: npt.ArrayLike, derivatives: int) -> list[FloatArray]:
        s = np.asarray(s_m, dtype=np.float64)
        inside = np.clip(s, self.from_m, self._last_m)
        spline = self._splines[which]
        found = [spline(inside)]
        return found + [
            np.where(inside == s, spline(inside, order), 0.0) for order in range(1, derivatives + 1)
        ]

    @property
    def _last_m(self) -> float:
        return self.from_m + self.step_m * (len(self.cant_m) - 1)

    @cached_property
    def joints_m(self) -> FloatArray:
        """Where one polynomial ends and the next begins, (n,): at the values, and anywhere before them."""
        return np.concatenate([[self.from_m - self.step_m], self._splines[0].x[:-1], [self._last_m]])

    def cant_terms(self, starts_m: FloatArray, count: int) -> FloatArray:
        """Coefficients (p, count) of the cant about places, each of its own joints among them."""
        return self._terms(0, starts_m, count)

    def height_terms(self, starts_m: FloatArray, count: int) -> FloatArray:
        """Coefficients (p, count) of the height about places, each of its own joints among them."""
        return self._terms(1, starts_m, count)

    def _terms(self, which: int, starts_m: FloatArray, count: int) -> FloatArray:
        spline = self._splines[which]
        terms = polynomial_terms(spline, np.clip(starts_m, self.from_m, self._last_m), count)
        beyond = (starts_m < self.from_m) | (starts_m >= self._last_m)
        terms[beyond, 1:] = 0.0
        return terms
