"""A vehicle as plain numbers: bodies, springs, wheels, and the guide that drives it.

Both the Exudyn model and the force kernel are built from a `VehicleModel`, so there is one
description and one bushing definition. The vehicle's coordinates are those of the track frame when it
stands centred on level track: X forward, Y left, Z up from the rail plane, origin at its reference
point. A vehicle file (`simrail.vehicle.file`) holds several of these parts as they are; their limits are
judged there. Statics (preload of the springs, wheel loads) follow from the description here; dynamics do not.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import Field

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.shown import Facts, Shown, names
from simrail.vehicle.contact.creep_laws import CreepLaw

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Point = tuple[float, float, float]
Triple = tuple[NotNegative, NotNegative, NotNegative]
Inertia = tuple[Positive, Positive, Positive]


@dataclass(frozen=True)
class Body:
    """A rigid body. Principal inertias (roll, pitch, yaw) about the centre of gravity, kg m2.

    The body of an axle carries the mass of its wheels and their transverse inertia, but not their
    spin inertia: the wheels turn on it (see `Wheel`), the body does not spin.
    """

    name: str
    """Its name."""
    mass_kg: Positive
    """Mass, kg."""
    inertia_kgm2: Inertia
    """Inertias in roll, pitch and yaw about the centre of gravity, kg m2."""
    position_m: Point
    """Centre of gravity, m: ahead of the reference point, left, above the rails."""


@dataclass(frozen=True)
class Suspension:
    """A linear spring-damper between two bodies at one point, acting along the axes of `inner`.

    The force on each body acts at that body's own attachment point; the deflection is the position of
    the outer point seen in the inner body's axes.
    """

    name: str
    inner: str
    outer: str
    position_m: Point
    stiffness_npm: Triple
    damping_nspm: Triple


@dataclass(frozen=True)
class SeriesDamper:
    """A damper along one axis (0 x, 1 y, 2 z) of `inner`, in series with the stiffness of its mounts."""

    name: str
    inner: str
    outer: str
    position_m: Point
    axis: int
    stiffness_npm: float
    damping_nspm: float


@dataclass(frozen=True)
class Rotation:
    """Springs and dampers of the small rotation between two bodies: anti-roll bars, bending springs."""

    name: str
    inner: str
    outer: str
    stiffness_nmprad: Triple
    damping_nmsprad: Triple


@dataclass(frozen=True)
class Rod:
    """A bar with a ball joint at each end: a spring and damper along the line between two points.

    It has no mass and turns freely. Its force is along the line as the bodies stand at the moment, so it is
    right at any rotation.
    """

    name: str
    inner: str
    outer: str
    inner_position_m: Point
    outer_position_m: Point
    stiffness_npm: Positive
    damping_nspm: NotNegative

    @property
    def length_m(self) -> float:
        """Distance of its ends as the vehicle stands nominally."""
        return float(np.linalg.norm(np.subtract(self.outer_position_m, self.inner_position_m)))


@dataclass(frozen=True)
class TrailingArms:
    """The left and the right trailing arm of an axle: each turns by itself about the axle's own line.

    An arm is rigid and has no mass; its far end hangs in a bushing of the frame. It follows the axle in roll
    and yaw. What swings it up or down at one end only meets no resistance; both together turn the
    axle's body, which stands for the axle boxes. The springs that carry the frame stand on the boxes, over
    the axle's line. Equations: `simrail.vehicle.engines.suspension_forces.arm_force`.

    Attributes
    ----------
    name, axle, frame : str
        Name, body of the axle, body that holds the bushings.
    bushings_m : (Point, Point)
        Centres of the left and the right bushing.
    stiffness_npm, damping_nspm : Triple
        Of each bushing: along the arm, lateral, and across the arm in its plane.
    """

    name: str
    axle: str
    frame: str
    bushings_m: tuple[Point, Point]
    stiffness_npm: Triple
    damping_nspm: Triple


@dataclass(frozen=True)
class Tabled:
    """A force that is an odd tabled law of a deflection (bump stop) or of its rate (damper).

    Between its points the law is the monotone cubic of Fritsch and Carlson (PCHIP), so that it is C1 and
    does not overshoot; beyond its last point it goes on with the slope of its last two points.
    """

    name: str
    inner: str
    outer: str
    position_m: Point
    axis: int
    over: str
    points: tuple[tuple[float, float], ...]


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
    """What drives one body along the track: springs to a point that follows the speed profile.

    A guide with lateral, vertical and roll stiffness as well holds its body to the design track: a
    carrier that a single wheelset hangs on. With vertical stiffness it also carries weight.
    """

    body: str
    """The body that it holds."""
    stiffness_npm: Positive
    """Along the track, N/m."""
    damping_nspm: NotNegative
    """Along the track, N s/m."""
    pitch_stiffness_nmprad: NotNegative
    """In pitch, N m/rad."""
    pitch_damping_nmsprad: NotNegative
    """In pitch, N m s/rad."""
    yaw_stiffness_nmprad: NotNegative
    """In yaw, N m/rad."""
    yaw_damping_nmsprad: NotNegative
    """In yaw, N m s/rad."""
    lateral_stiffness_npm: NotNegative = 0.0
    """Across the track, N/m."""
    lateral_damping_nspm: NotNegative = 0.0
    """Across the track, N s/m."""
    vertical_stiffness_npm: NotNegative = 0.0
    """Upright, N/m."""
    vertical_damping_nspm: NotNegative = 0.0
    """Upright, N s/m."""
    roll_stiffness_nmprad: NotNegative = 0.0
    """In roll, N m/rad."""
    roll_damping_nmsprad: NotNegative = 0.0
    """In roll, N m s/rad."""


@dataclass(frozen=True)
class Traction:
    """Motors, brakes and driver of a vehicle that its wheels drive; the equations: `engines.traction_forces`.

    Attributes
    ----------
    driven, braked : dict of str to float
        Spins and their shares of the tractive and of the braking effort; each set sums to 1. In a file axles
        (both wheels alike) or single wheels.
    tractive_effort_n, power_w, braking_effort_n : float
        Greatest tractive effort and power, greatest braking effort, of the whole vehicle at the rims.
    speed_gain_nspm : float
        Effort that the driver asks for per m/s that the speed lacks.
    position_gain_1ps, catch_up_mps : float
        Speed that he adds per m that the vehicle is behind, and the most that he adds.
    slide_protection_creepage : float
        Creepage at which half of the torque is taken back; 0 for none.
    reaction : str
        Body that carries motors and brakes, ``"axle"`` for each axle itself.
    """

    driven: Annotated[dict[str, Positive], Field(min_length=1)]
    braked: Annotated[dict[str, Positive], Field(min_length=1)]
    tractive_effort_n: Positive
    power_w: Positive
    braking_effort_n: Positive
    speed_gain_nspm: Positive
    position_gain_1ps: Positive
    catch_up_mps: Positive
    slide_protection_creepage: NotNegative = 0.0
    reaction: str = "axle"


@dataclass(frozen=True, kw_only=True)
class LinearContact:
    """Prescribed linear wheel-rail contact of the textbooks, per wheel, in place of the profiles.

    Kalker's coefficients f11, f22 (N), f23 (N m), f33 (N m2), no saturation; the radius of a wheel that
    is displaced by y outward is ``r0 + conicity y``; a linear vertical spring carries it. The gravitational
    stiffnesses are those of a whole wheelset (lateral N/m, yaw N m/rad), half of them at each wheel.
    """

    f11_n: Positive
    """Kalker's coefficient along, N."""
    f22_n: Positive
    """Kalker's coefficient across, N."""
    f23_nm: float = 0.0
    """Kalker's coefficient of lateral force and spin, N m."""
    f33_nm2: NotNegative = 0.0
    """Kalker's coefficient of spin, N m2."""
    conicity: Annotated[float, Field(ge=0.0, le=0.5)]
    """Change of the rolling radius over displacement."""
    vertical_stiffness_npm: Positive
    """Of the spring that carries a wheel, N/m."""
    vertical_damping_nspm: NotNegative
    """Of its damper, N s/m."""
    gravitational_stiffness_npm: float = 0.0
    """Lateral, of a wheelset, N/m."""
    gravitational_yaw_stiffness_nmprad: float = 0.0
    """In yaw, of a wheelset, N m/rad."""


@dataclass(frozen=True)
class WheelRail:
    """Which profiles meet, and how slippery they are.

    Profiles are names or the paths of files (`simrail.vehicle.contact.profile_files`); ``profile_scale`` is
    the size that they have on this vehicle, 0.1 on one of 1:10 whose profiles are full-size ones made small.
    ``wheel_file_tape_circle_m`` is where the tape circle lies in the wheel's file, if not where that has it.
    ``smoothing`` is that of `simrail.vehicle.contact.contact_geometry.build_contact`.
    """

    wheel_profile: str
    rail_profile: str
    gauge_m: float
    rail_inclination: float
    friction: float
    tape_circle_half_m: float = 0.75
    creep: CreepLaw = field(default_factory=CreepLaw)
    linear: LinearContact | None = None
    profile_scale: float = 1.0
    smoothing: float = 0.22
    wheel_file_tape_circle_m: float | None = None


@dataclass(frozen=True, repr=False)
class VehicleModel(Shown):
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
    series : tuple of SeriesDamper
        Dampers with the stiffness of their mounts.
    rotations : tuple of Rotation
        Springs and dampers of rotations.
    tabled : tuple of Tabled
        Bump stops and nonlinear dampers.
    rods : tuple of Rod
        Bars between two points.
    arms : tuple of TrailingArms
        Trailing arms, one entry for both of an axle.
    gyroscopic : bool
        Whether the spinning wheels resist being turned.
    traction : Traction or None
        What drives it if its wheels do.
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
    series: tuple[SeriesDamper, ...] = ()
    rotations: tuple[Rotation, ...] = ()
    tabled: tuple[Tabled, ...] = ()
    rods: tuple[Rod, ...] = ()
    arms: tuple[TrailingArms, ...] = ()
    gyroscopic: bool = True
    traction: Traction | None = None

    def _facts(self) -> Facts:
        radii = sorted({wheel.radius_m for wheel in self.wheels})
        pair = self.wheel_rail
        facts = {
            "is": ("synthetic: " if self.synthetic else "") + self.title,
            "bodies": names(self.body_names, most=8),
            "mass": f"{sum(body.mass_kg for body in self.bodies):,.0f} kg",
            "wheels": f"{len(self.wheels)} of {' and '.join(f'{radius:g}' for radius in radii)} m radius",
            "contact": "linear" if pair.linear else f"{pair.wheel_profile} on {pair.rail_profile}",
        }
        return self.name, facts

    @property
    def body_names(self) -> list[str]:
        """Names of the bodies, in order."""
        return [body.name for body in self.bodies]

    @property
    def wheel_names(self) -> list[str]:
        """Names of the wheels, in order."""
        return [wheel.name for wheel in self.wheels]

    def wheel_at(self, place: str, *, direction: int) -> str:
        """Name of a wheel from its place in a direction of travel, e.g. ``"trailing.left"``."""
        where, _, side = place.partition(".")
        if where not in ("leading", "trailing"):
            return place
        axles = {wheel.axle for wheel in self.wheels if wheel.name.endswith("." + side)}
        pick = max if (where == "leading") == (direction > 0) else min
        return f"{pick(axles, key=lambda name: self.body(name).position_m[0], default=where)}.{side}"

    @property
    def axle_names(self) -> list[str]:
        """Names of the bodies that carry wheels, in order."""
        return list(dict.fromkeys(wheel.axle for wheel in self.wheels))

    @property
    def has_wheelsets(self) -> bool:
        """Whether both wheels of some axle turn as one: only then there is conicity, and hunting by it."""
        return len(self.spin_inertia_kgm2) < len(self.wheels)

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
        first = len(self.suspensions)
        return self._statics[first : first + len(self.wheels)] * gravity_mps2

    def rod_tension_n(self, gravity_mps2: float) -> FloatArray:
        """Force (r,) that each rod carries at rest on level track, + in tension."""
        return self._statics[len(self.suspensions) + len(self.wheels) : -1] * gravity_mps2

    def guide_load_n(self, gravity_mps2: float) -> float:
        """Weight that the guide carries at rest, N."""
        return float(self._statics[-1]) * gravity_mps2

    @cached_property
    def _statics(self) -> FloatArray:
        """Forces of springs, wheels, rods and guide per unit of gravity: every body balances.

        Vertical force, roll moment and pitch moment of each body balance; where that leaves a choice
        (several springs side by side), springs share in proportion to their stiffness, which is what
        equal deflections do. Springs and wheels bear vertically, rods along their lines, unless these are
        level. The guide may take the pitch moment of its own body, and its roll moment and weight if it
        has the stiffness.
        """
        springs, wheels = len(self.suspensions), len(self.wheels)
        balance = np.zeros((3 * len(self.bodies), springs + wheels + len(self.rods) + 1))
        weight = np.zeros(3 * len(self.bodies))
        scale = np.ones(balance.shape[1])
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
            balance[3 * i : 3 * i + 2, j] = 1.0, self.wheel_rail.tape_circle_half_m * wheel.side
        for j, rod in enumerate(self.rods, start=springs + wheels):
            scale[j] = np.sqrt(rod.stiffness_npm)
            for i, wrench in self._pulls(rod):
                balance[3 * i : 3 * i + 3, j] = wrench[[2, 3, 4]]
        held = 3 * self.body_names.index(self.guide.body)
        scale[-1] = np.sqrt(self.guide.vertical_stiffness_npm)
        balance[held, -1] = 1.0
        forces = scale * np.linalg.lstsq(balance * scale, weight, rcond=1e-12)[0]
        # A spring without vertical stiffness may not be what carries a body.
        stiff = np.array(
            [spring.stiffness_npm[2] > 0.0 for spring in self.suspensions]
            + [True] * (wheels + len(self.rods) + 1)
        )
        short = weight - balance @ np.where(stiff, forces, 0.0)
        short[held + 2] = 0.0
        if self.guide.roll_stiffness_nmprad > 0.0:
            short[held + 1] = 0.0
        if np.max(np.abs(short)) > 1e-6 * np.sum(weight):
            # What lacks support, not what stands under it and is pressed in its stead.
            where = int(np.argmax(short))
            unit = "N" if where % 3 == 0 else "N m"
            raise InputError(
                "cannot rest: its weight is not balanced by vertical springs and wheels",
                file=f"vehicle {self.name}",
                field=self.body_names[where // 3],
                value=f"{short[where]:.3g} {unit} without support",
                remedy="give it a suspension with vertical stiffness on both sides",
                limit="vertical forces in balance",
            )
        self._check_thrust(forces[springs + wheels : -1], 1e-6 * np.sum(weight))
        return forces

    def _pulls(self, rod: Rod) -> list[tuple[int, FloatArray]]:
        """Body and wrench (6,) on it of a rod's unit tension, for both ends; none for a level rod."""
        way = np.subtract(rod.outer_position_m, rod.inner_position_m)
        if abs(way[2]) < 1e-9 * rod.length_m:
            return []
        found = []
        for name, place, sign in (
            (rod.inner, rod.inner_position_m, 1.0),
            (rod.outer, rod.outer_position_m, -1.0),
        ):
            i = self.body_names.index(name)
            force = sign * way / rod.length_m
            arm = np.subtract(place, self.bodies[i].position_m)
            found.append((i, np.concatenate([force, np.cross(arm, force)])))
        return found

    def _check_thrust(self, tension: FloatArray, limit: float) -> None:
        """Refuse rods that bear weight and thrust a body aside: it would not stand where it is said to."""
        thrust = np.zeros((len(self.bodies), 3))
        for rod, force in zip(self.rods, tension, strict=True):
            for i, wrench in self._pulls(rod):
                thrust[i] += force * wrench[[0, 1, 5]]
        if np.max(np.abs(thrust), initial=0.0) > limit:
            i = int(np.argmax(np.max(np.abs(thrust), axis=1)))
            raise InputError(
                "cannot rest: rods that carry its weight push it aside",
                file=f"vehicle {self.name}",
                field=self.bodies[i].name,
                value=f"a thrust of {np.max(np.abs(thrust[i])):.3g} N or N m",
                remedy="lay rods level, or in pairs whose level thrusts balance",
                limit="level forces in balance",
            )
