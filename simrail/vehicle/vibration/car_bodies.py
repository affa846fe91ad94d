"""Which bodies of a vehicle are car bodies, and what carries them: read off its vertical springs."""

from dataclasses import dataclass

import numpy as np

from simrail.vehicle.model import VehicleModel
from simrail.vehicle.vibration.linear_model import Bending

_LEAST_SPAN_M = 5.0
"""A body whose supports are closer together is a frame, and does not bend."""
_OVERHANG = 1.35
"""Length of a car body over the distance of its outermost supports: of a coach of 26 m on pivots of 19 m."""


@dataclass(frozen=True)
class CarBody:
    """A car body.

    Attributes
    ----------
    name : str
        Its name.
    carriers : tuple of str
        Bodies that it stands on.
    span_m : float
        Distance of its outermost supports along the vehicle.
    """

    name: str
    carriers: tuple[str, ...]
    span_m: float

    def bending(self, frequency_hz: float, damping_ratio: float) -> Bending | None:
        """Its bending; None if it is too short to bend."""
        if self.span_m < _LEAST_SPAN_M:
            return None
        return Bending(self.name, frequency_hz, damping_ratio, _OVERHANG * self.span_m)


def car_bodies(model: VehicleModel) -> tuple[CarBody, ...]:
    """Car bodies of a vehicle: bodies above the frames, or above the axles where there are no frames.

    A body's storey is the number of vertical springs between it and the axles; it carries those of a higher
    storey. What stands on axles and carries others is a frame. A module that hangs between two others of an
    articulated vehicle is carried by them.
    """
    joined: dict[str, list[tuple[str, float]]] = {name: [] for name in model.body_names}
    springs = [(e.inner, e.outer, e.position_m[0]) for e in model.suspensions if e.stiffness_npm[2] > 0.0]
    springs += [
        (rod.inner, rod.outer, rod.inner_position_m[0])
        for rod in model.rods
        if abs(rod.inner_position_m[2] - rod.outer_position_m[2]) > 0.5 * rod.length_m
    ]
    for inner, outer, x in springs:
        joined[inner].append((outer, x))
        joined[outer].append((inner, x))
    storey = dict.fromkeys(model.axle_names, 0)
    level = list(storey)
    while level:
        above = [name for below in level for name, _ in joined[below] if name not in storey]
        level = list(dict.fromkeys(above))
        storey |= {name: 1 + storey[level_below(joined[name], storey)] for name in level}
    cars = []
    for name, at in storey.items():
        below = [(other, x) for other, x in joined[name] if storey[other] < at]
        if at > 1 or (at == 1 and not any(storey[other] > at for other, _ in joined[name])):
            places = [x for _, x in below]
            cars.append(CarBody(name, tuple(dict.fromkeys(o for o, _ in below)), float(np.ptp(places))))
    return tuple(cars)


def level_below(joined: list[tuple[str, float]], storey: dict[str, int]) -> str:
    """The lowest of the bodies that one is joined to, among those whose storey is known."""
    return min((name for name, _ in joined if name in storey), key=storey.__getitem__)
