"""A vehicle whose masses, springs and dampers differ from its drawing by factors.

What a depot does not know: how full the train is, how the rubber has aged, what a damper has lost. The train
itself goes on to believe its drawing.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from simrail.vehicle.model import Tabled, VehicleModel


@dataclass(frozen=True)
class VehicleFactors:
    """Factors on the figures of a vehicle.

    Attributes
    ----------
    load : float
        On mass and inertias of all bodies that no wheel turns on: frames and car bodies.
    stiffness : float
        On the stiffness of everything between two bodies: springs, rods, bushings, mounts of dampers, bump
        stops.
    damping : float
        On their damping, and on the forces of dampers.
    """

    load: float = 1.0
    stiffness: float = 1.0
    damping: float = 1.0

    def of(self, vehicle: VehicleModel) -> VehicleModel:
        """The vehicle with them; the same one if they are all one."""
        if self == VehicleFactors():
            return vehicle
        axles = {wheel.axle for wheel in vehicle.wheels}
        bodies = tuple(
            body
            if body.name in axles
            else replace(
                body,
                mass_kg=self.load * body.mass_kg,
                inertia_kgm2=_times(body.inertia_kgm2, self.load),
            )
            for body in vehicle.bodies
        )
        parts: dict[str, Any] = {
            name: tuple(self._part(part) for part in getattr(vehicle, name))
            for name in ("suspensions", "series", "rotations", "rods", "arms")
        }
        tabled = tuple(replace(one, points=self._points(one)) for one in vehicle.tabled)
        return replace(vehicle, bodies=bodies, tabled=tabled, **parts)

    def _part(self, part: Any) -> Any:
        """A part with its stiffness and damping, which are numbers or triples of them."""
        changed = {}
        for name in vars(part):
            for word, factor in (("stiffness_", self.stiffness), ("damping_", self.damping)):
                if name.startswith(word):
                    changed[name] = _times(getattr(part, name), factor)
        return replace(part, **changed)

    def _points(self, part: Tabled) -> tuple[tuple[float, float], ...]:
        factor = self.damping if part.over == "speed_mps" else self.stiffness
        return tuple((x, factor * force) for x, force in part.points)


def _times(value: Any, factor: float) -> Any:
    """A number, or each of a tuple, times a factor."""
    times: Callable[[float], float] = factor.__mul__
    return tuple(times(one) for one in value) if isinstance(value, tuple) else times(value)
