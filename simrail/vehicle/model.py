"""A vehicle as plain numbers: bodies, springs, wheels, and the guide that drives it.

Both the Exudyn model and the force kernel are built from a `VehicleModel`, so there is one
description and one bushing definition. The vehicle's coordinates are those of the track frame when it
stands centred on level track: X forward, Y left, Z up from the rail plane, origin at its reference
point. Statics (preload of the springs, wheel loads) follow from the description here; dynamics do not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simrail.errors import InputError
from simrail.jit import FloatArray


@dataclass(frozen=True)
class Body:
    """A rigid body. Principal inertias (roll, pitch, yaw) about the centre of gravity, kg m2.

    The body of an axle carries the mass of its wheels and their transverse inertia, but not their
    spin inertia: the wheels turn on it (see `Wheel`), the body does not spin.
    """

    name: str
    mass_kg: float
    inertia_kgm2: tuple[float, float, float]
    position_m: tuple[float, float, float]


@dataclass(frozen=True)
class Suspension:
    """A linear spring-damper between two bodies at one point, acting along the axes of `inner`.

    The force on each body acts at that body's own attachment point; the deflection is the position of
    the outer point seen in the inner body's axes.
    """

    name: str
    inner: str
    outer: str
    position_m: tuple[float, float, float]
    stiffness_npm: tuple[float, float, float]
    damping_nspm: tuple[float, float, float]


@dataclass(frozen=True)
class Wheel:
    """A wheel on an axle. Wheels that share a spin name turn as one (a conventional wheelset)."""

    name: str
    axle: str
    side: int
    spin: str
    radius_m: float


@dataclass(frozen=True)
class Guide:
    """What drives one body along the track: springs to a point that follows the speed profile."""

    body: str
    stiffness_npm: float
    damping_nspm: float
    pitch_stiffness_nmprad: float
    pitch_damping_nmsprad: float
    yaw_stiffness_nmprad: float
    yaw_damping_nmsprad: float


@dataclass(frozen=True)
class WheelRail:
    """Which profiles meet, and how slippery they are."""

    wheel_profile: str
    rail_profile: str
    gauge_m: float
    rail_inclination: float
    friction: float


@dataclass(frozen=True)
class VehicleModel:
    """A whole vehicle.

    Attributes
    ----------
    name, title, source : str
        Name (of its file), what it is, where its figures come from.
    synthetic : bool
        True if its figures are not those of a real vehicle.
    bodies : tuple of Body
        Axles first.
    suspensions : tuple of Suspension
        Springs and dampers.
    wheels : tuple of Wheel
        Left and right of each axle, in the order of the axles.
    spin_inertia_kgm2 : dict of str to float
        Inertia about the axle of each spin.
    guide : Guide
        The driver.
    wheel_rail : WheelRail
        The contact.
    """

    name: str
    title: str
    source: str
    synthetic: bool
    bodies: tuple[Body, ...]
    suspensions: tuple[Suspension, ...]
    wheels: tuple[Wheel, ...]
    spin_inertia_kgm2: dict[str, float]
    guide: Guide
    wheel_rail: WheelRail

    @property
    def body_names(self) -> list[str]:
        """Names of the bodies, in order."""
        return [body.name for body in self.bodies]

    @property
    def wheel_names(self) -> list[str]:
        """Names of the wheels, in order."""
        return [wheel.name for wheel in self.wheels]

    @property
    def axle_names(self) -> list[str]:
        """Names of the bodies that carry wheels, in order."""
        return list(dict.fromkeys(wheel.axle for wheel in self.wheels))

    @property
    def reach_m(self) -> tuple[float, float]:
        """Smallest and largest x of an axle: how far the vehicle reaches from its reference point."""
        x = [body.position_m[0] for body in self.bodies if body.name in self.axle_names]
        return min(x), max(x)

    def body(self, name: str) -> Body:
        """The body of a name."""
        return self.bodies[self.body_names.index(name)]

    def preload_n(self, gravity_mps2: float) -> FloatArray:
        """Vertical force (m,) that each suspension carries at rest on level track, + in compression."""
        return self._statics[: len(self.suspensions)] * gravity_mps2

    def wheel_load_n(self, gravity_mps2: float) -> FloatArray:
        """Static vertical load (w,) of each wheel."""
        return self._statics[len(self.suspensions) :] * gravity_mps2

    @cached_property
    def _statics(self) -> FloatArray:
        """Vertical spring and wheel forces per unit of gravity, from the balance of every body.

        Vertical force, roll moment and pitch moment of each body balance; where that leaves a choice
        (several springs side by side), springs share in proportion to their stiffness, which is what
        equal deflections do, and the guide may take the pitch moment of its own body.
        """
        springs, wheels = len(self.suspensions), len(self.wheels)
        balance = np.zeros((3 * len(self.bodies), springs + wheels))
        weight = np.zeros(3 * len(self.bodies))
        scale = np.ones(springs + wheels)
        for i, body in enumerate(self.bodies):
            weight[3 * i] = body.mass_kg
        for j, spring in enumerate(self.suspensions):
            scale[j] = np.sqrt(max(spring.stiffness_npm[2], 1e-9))
            for name, sign in ((spring.outer, 1.0), (spring.inner, -1.0)):
                i = self.body_names.index(name)
                arm = np.subtract(spring.position_m, self.bodies[i].position_m)
                balance[3 * i : 3 * i + 3, j] += sign * np.array([1.0, arm[1], -arm[0]])
        for j, wheel in enumerate(self.wheels, start=springs):
            i = self.body_names.index(wheel.axle)
            scale[j] = 1e6  # a wheel is far stiffer than a spring
            balance[3 * i : 3 * i + 2, j] = 1.0, 0.75 * wheel.side
        forces = scale * np.linalg.lstsq(balance * scale, weight, rcond=1e-12)[0]
        held = 3 * self.body_names.index(self.guide.body) + 2
        error = np.abs(balance @ forces - weight)
        error[held] = 0.0
        if np.max(error) > 1e-6 * np.sum(weight):
            name = self.body_names[int(np.argmax(error)) // 3]
            raise InputError(
                "cannot rest: its weight is not balanced by vertical springs and wheels",
                file=f"vehicle {self.name}",
                field=name,
                remedy="give it a suspension with vertical stiffness on both sides",
            )
        return forces
