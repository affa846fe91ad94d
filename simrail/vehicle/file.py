"""A vehicle file: bodies, springs, wheels and guide in one TOML, judged and made a `VehicleModel`."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part, blame
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.contact.profile_files import profile_place, rail_profile, wheel_profile
from simrail.vehicle.model import (
    Body,
    Guide,
    Inertia,
    LinearContact,
    NotNegative,
    Point,
    Positive,
    Rod,
    Rotation,
    SeriesDamper,
    Suspension,
    Tabled,
    Traction,
    TrailingArms,
    Triple,
    VehicleModel,
    Wheel,
    WheelRail,
)


class AxleEntry(Part):
    """An axle with its two wheels; the bridge is what does not turn.

    Of a conventional wheelset ("fixed") only sums matter: bridge and wheels turn together about the
    vertical and the longitudinal axis, and the spin inertia of both wheels is that of the wheelset.
    """

    name: str
    """Name of the axle."""
    x_m: float
    """Ahead of the vehicle's reference point, m."""
    wheels: Literal["independent", "fixed"]
    """Whether its wheels turn on their own, or as one wheelset."""
    wheel_radius_m: Annotated[float, Field(ge=0.01, le=1.0)]
    """Radius at the tape circle, m."""
    wheel_y_m: tuple[float, float] = (0.75, -0.75)
    """Distance of the tape circle from the centre, m."""
    bridge_mass_kg: Positive
    """Mass of what does not turn, kg."""
    bridge_inertia_kgm2: Inertia
    """Its inertias in roll, pitch and yaw, kg m2."""
    wheel_mass_kg: Positive
    """Mass of a wheel, kg."""
    wheel_spin_inertia_kgm2: Positive
    """Inertia of a wheel about its axis, kg m2."""
    wheel_transverse_inertia_kgm2: Positive
    """Inertia of a wheel about its diameters, kg m2."""


class SuspensionEntry(Part):
    """Equal springs at one or several points between two bodies."""

    name: str
    """Its name."""
    between: tuple[str, str]
    """The two that it joins, inner first."""
    positions_m: Annotated[list[Point], Field(min_length=1)]
    """Where, m: one spring at each point."""
    stiffness_npm: Triple
    """Of one spring along, across and upright, N/m."""
    damping_nspm: Triple
    """Of one damper along, across and upright, N s/m."""
    series_stiffness_npm: Triple = (0.0, 0.0, 0.0)
    """Stiffness in series with the damper of each axis; 0: the damper is mounted rigidly."""


class RotationEntry(Part):
    """Springs and dampers of the rotation between two bodies (roll, pitch, yaw)."""

    name: str
    """Its name."""
    between: tuple[str, str]
    """The two that it joins, inner first."""
    stiffness_nmprad: Triple
    """In roll, pitch and yaw, N m/rad."""
    damping_nmsprad: Triple
    """In roll, pitch and yaw, N m s/rad."""


class TabledEntry(Part):
    """Equal bump stops or nonlinear dampers at one or several points: force over deflection or speed."""

    name: str
    """Its name."""
    between: tuple[str, str]
    """The two that it joins, inner first."""
    positions_m: Annotated[list[Point], Field(min_length=1)]
    """Where, m: one at each point."""
    axis: Literal["x", "y", "z"]
    """Along which axis it works."""
    over: Literal["deflection_m", "speed_mps"]
    """Whether its force depends on deflection or speed."""
    points: Annotated[list[tuple[Positive, NotNegative]], Field(min_length=2)]
    """Pairs of deflection (m) or speed (m/s) and force (N), rising; the same to either side."""


class RodEntry(Part):
    """Equal rods between two bodies: the first end of each is on the first body."""

    name: str
    """Its name."""
    between: tuple[str, str]
    """The two that it joins."""
    ends_m: Annotated[list[tuple[Point, Point]], Field(min_length=1)]
    """Both ends of each rod, m; the first end is on the first body."""
    stiffness_npm: Positive
    """Along the rod, N/m."""
    damping_nspm: NotNegative
    """Along the rod, N s/m."""


class TrailingArmEntry(Part):
    """Left and right trailing arm of an axle: bushings on the frame; along the arm, lateral, across it."""

    name: str
    """Its name."""
    between: tuple[str, str]
    """The axle and the frame."""
    bushings_m: tuple[Point, Point]
    """Left and right bushing on the frame, m."""
    stiffness_npm: Triple
    """Of one bushing along the arm, lateral, and across it, N/m."""
    damping_nspm: Triple
    """The same of its damping, N s/m."""


class VehicleFile(Part):
    """A whole vehicle file; profiles that it names by a relative path lie beside it."""

    title: str
    """One line: what it is."""
    source: str
    """Where its figures come from."""
    synthetic: bool
    """True if they are not those of a real vehicle."""
    gauge_m: Annotated[float, Field(gt=0.1, lt=2.0)]
    """Gauge of the track that it runs on, m."""
    rail_inclination: Annotated[float, Field(ge=0, le=0.1)]
    """Inclination of the rails towards each other, e.g. 0.025 for 1:40."""
    wheel_profile: str
    """A profile by name, or the path of a file."""
    rail_profile: str
    """A profile by name, or the path of a file."""
    tape_circle_mm: Annotated[float, Field(ge=-200.0, le=200.0)] | None = None
    """Where the tape circle stands in the file of the wheel profile, mm, e.g. 70 behind the flange's back."""
    profile_scale: Annotated[float, Field(ge=0.02, le=1.0)] = 1.0
    """Size of the profiles on this vehicle; 0.1 on one of 1:10."""
    contact_smoothing: Annotated[float, Field(ge=0.1, le=5.0)] = 0.22
    """Smoothing of the contact over its static elastic approach; below 0.1 it chatters like a rigid one."""
    friction: Annotated[float, Field(gt=0, le=1.0)]
    """Friction coefficient of wheel and rail."""
    axle: Annotated[list[AxleEntry], Field(min_length=1)]
    """The axles, with their wheels."""
    body: tuple[Body, ...] = ()
    """Frames and bodies."""
    suspension: tuple[SuspensionEntry, ...] = ()
    """Springs and dampers between two bodies, or axles."""
    rotation: tuple[RotationEntry, ...] = ()
    """Springs and dampers of rotations."""
    tabled: tuple[TabledEntry, ...] = ()
    """Bump stops and nonlinear dampers."""
    rod: tuple[RodEntry, ...] = ()
    """Rods from point to point."""
    trailing_arm: tuple[TrailingArmEntry, ...] = ()
    """Trailing arms of axles."""
    creep: CreepLaw = CreepLaw()
    """Law of the creep forces."""
    linear_contact: LinearContact | None = None
    """Linear contact of the textbooks, in place of the profiles."""
    gyroscopic: bool = True
    """Whether spinning wheels resist being turned."""
    guide: Guide
    """The driver: what pulls the vehicle to where it should be."""
    traction: Traction | None = None
    """Motors and brakes, where the wheels drive."""
    _folder: Path | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        self._folder = (info.context or {}).get("folder")
        names = [axle.name for axle in self.axle] + [body.name for body in self.body]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputError(
                "two bodies share a name",
                field="name",
                value=sorted(twice)[0],
                remedy="rename one",
                limit="each name once",
            )
        asked = [
            (f"{kind}[{i}].between", name)
            for kind in ("suspension", "rotation", "tabled", "rod", "trailing_arm")
            for i, entry in enumerate(getattr(self, kind))
            for name in entry.between
        ]
        for field, name in [*asked, ("guide.body", self.guide.body)]:
            if name not in names:
                raise InputError("no such body", field=field, value=name, limit="one of " + ", ".join(names))
        solids = [(f"body[{i}].inertia_kgm2", entry.inertia_kgm2) for i, entry in enumerate(self.body)]
        solids += [
            (f"axle[{i}].bridge_inertia_kgm2", entry.bridge_inertia_kgm2) for i, entry in enumerate(self.axle)
        ]
        for field, inertia in solids:
            if 2.0 * max(inertia) > sum(inertia) * (1.0 + 1e-9):
                raise InputError(
                    "no rigid body has such inertias",
                    field=field,
                    value=inertia,
                    limit="the largest at most the sum of the other two",
                )
        with blame(None, "creep"):
            self.creep.constants()
        self._check_elements()
        self._check_wheels()
        self._check_held(names)
        self._check_traction(names)
        return self

    def _check_elements(self) -> None:
        for i, spring in enumerate(self.suspension):
            for stiffness, damping in zip(spring.series_stiffness_npm, spring.damping_nspm, strict=True):
                if stiffness > 0.0 and damping == 0.0:
                    raise InputError(
                        "a series stiffness without a damper",
                        field=f"suspension[{i}].series_stiffness_npm",
                        value=spring.series_stiffness_npm,
                        remedy="give that axis damping, or 0 in series",
                        limit="0 without damping",
                    )
        for i, entry in enumerate(self.tabled):
            x, force = zip(*entry.points, strict=True)
            if any(b <= a for a, b in pairwise(x)) or any(b < a for a, b in pairwise(force)):
                raise InputError(
                    "the points of a law must rise",
                    field=f"tabled[{i}].points",
                    value=entry.points,
                    limit="first column rising, second not falling",
                )
        self._check_rods()
        # Each says itself what it cannot read.
        wheel_profile(self.wheel_profile, self._folder, tape_circle_m=self._tape_circle_m)
        rail_profile(self.rail_profile, self._folder)

    @property
    def _tape_circle_m(self) -> float | None:
        return None if self.tape_circle_mm is None else self.tape_circle_mm / 1000.0

    def _check_rods(self) -> None:
        for i, rod in enumerate(self.rod):
            for first, second in rod.ends_m:
                if first == second:
                    raise InputError(
                        "a rod without length has no direction",
                        field=f"rod[{i}].ends_m",
                        value=(first, second),
                        remedy="set its ends apart, or take a [[suspension]] with stiffness along one axis",
                        limit="> 0 m",
                    )
        axles = {axle.name: axle for axle in self.axle}
        for i, arm in enumerate(self.trailing_arm):
            axle = axles.get(arm.between[0])
            if axle is None:
                raise InputError(
                    "a trailing arm leads from an axle to a frame",
                    field=f"trailing_arm[{i}].between",
                    value=arm.between,
                    limit="first one of " + ", ".join(axles),
                )
            left, right = arm.bushings_m
            if right != (left[0], -left[1], left[2]) or left[1] <= 0.0 or left[0] == axle.x_m:
                raise InputError(
                    "not the bushings of a left and a right arm",
                    field=f"trailing_arm[{i}].bushings_m",
                    value=arm.bushings_m,
                    limit=f"[x, y, z] and [x, -y, z], y > 0, x other than the axle's {axle.x_m:g}",
                )

    def _check_wheels(self) -> None:
        """Wheels must stand on the rails, all alike: one contact table serves them."""
        first = self.axle[0]
        for i, axle in enumerate(self.axle):
            left, right = axle.wheel_y_m
            excess = (left - 0.5 * self.gauge_m) / self.gauge_m
            if left != -right or not 0.0 < excess < 0.05:
                raise InputError(
                    "a wheel off the axle's place over its rail",
                    field=f"axle[{i}].wheel_y_m",
                    value=axle.wheel_y_m,
                    limit=f"y and -y, {0.5 * self.gauge_m:.4g} < y < {0.55 * self.gauge_m:.4g} m",
                )
            for field in ("wheel_y_m", "wheel_radius_m"):
                if getattr(axle, field) != getattr(first, field):
                    raise InputError(
                        "the wheels of a vehicle are alike",
                        field=f"axle[{i}].{field}",
                        value=getattr(axle, field),
                        limit=f"{getattr(first, field)}, as axle[0] has it",
                    )

    def _check_held(self, names: list[str]) -> None:
        """Every body must hang together with the guide's body by springs."""
        held = {self.guide.body}
        pairs = [set(entry.between) for entry in self.suspension if any(entry.stiffness_npm)]
        pairs += [set(entry.between) for entry in self.rod] + [
            set(entry.between) for entry in self.trailing_arm
        ]
        for _ in names:
            held = held.union(*(pair for pair in pairs if pair & held))
        for i, name in enumerate(names):
            if name not in held:
                axles = len(self.axle)
                raise InputError(
                    "nothing holds this body: no suspension with stiffness leads from it to the guide",
                    field=f"axle[{i}].name" if i < axles else f"body[{i - axles}].name",
                    value=name,
                    remedy="mount it with a [[suspension]]",
                    limit="a suspension that leads to it",
                )

    def _check_traction(self, names: list[str]) -> None:
        if self.traction is None:
            return
        wheels, _ = self._wheels()
        with blame(None, "traction"):
            for kind in ("driven", "braked"):
                _shares(self.traction, kind, wheels)
            if self.traction.reaction not in ("axle", *names):
                raise InputError(
                    "no such body",
                    field="reaction",
                    value=self.traction.reaction,
                    limit="axle, or one of " + ", ".join(names),
                )

    def _wheels(self) -> tuple[list[Wheel], dict[str, float]]:
        """The wheels, and the inertia of each spin."""
        wheels: list[Wheel] = []
        spins: dict[str, float] = {}
        for axle in self.axle:
            for side, word in ((1, "left"), (-1, "right")):
                wheel = f"{axle.name}.{word}"
                spin = wheel if axle.wheels == "independent" else axle.name
                spins[spin] = spins.get(spin, 0.0) + axle.wheel_spin_inertia_kgm2
                wheels.append(
                    Wheel(name=wheel, axle=axle.name, side=side, spin=spin, radius_m=axle.wheel_radius_m)
                )
        return wheels, spins

    def _axles(self) -> list[Body]:
        """The axles' bodies."""
        bodies: list[Body] = []
        for axle in self.axle:
            # The wheels ride on the bridge at the tape circles: their mass and transverse inertia count.
            carried = 2.0 * (axle.wheel_mass_kg * axle.wheel_y_m[0] ** 2 + axle.wheel_transverse_inertia_kgm2)
            roll, pitch, yaw = axle.bridge_inertia_kgm2
            bodies.append(
                Body(
                    name=axle.name,
                    mass_kg=axle.bridge_mass_kg + 2.0 * axle.wheel_mass_kg,
                    inertia_kgm2=(roll + carried, pitch, yaw + carried),
                    position_m=(axle.x_m, 0.0, axle.wheel_radius_m),
                )
            )
        return bodies

    def _springs(self) -> tuple[list[Suspension], list[SeriesDamper]]:
        """Springs with the dampers beside them, and the dampers on mounts that give way."""
        springs: list[Suspension] = []
        series: list[SeriesDamper] = []
        for entry in self.suspension:
            elastic = entry.series_stiffness_npm
            rigid = [0.0 if k > 0.0 else c for k, c in zip(elastic, entry.damping_nspm, strict=True)]
            for ends in _ends(entry):
                springs.append(
                    Suspension(
                        **ends,
                        stiffness_npm=entry.stiffness_npm,
                        damping_nspm=(rigid[0], rigid[1], rigid[2]),
                    )
                )
                series += [
                    SeriesDamper(**ends, axis=k, stiffness_npm=elastic[k], damping_nspm=entry.damping_nspm[k])
                    for k in range(3)
                    if elastic[k] > 0.0
                ]
        return springs, series

    def model(self, name: str) -> VehicleModel:
        """Build the vehicle that the file describes."""
        wheels, spins = self._wheels()
        springs, series = self._springs()
        traction = self.traction
        if traction is not None:
            driven, braked = (_shares(traction, kind, wheels) for kind in ("driven", "braked"))
            traction = replace(traction, driven=driven, braked=braked)
        return VehicleModel(
            name=name,
            title=self.title,
            source=self.source,
            synthetic=self.synthetic,
            bodies=(*self._axles(), *self.body),
            suspensions=tuple(springs),
            wheels=tuple(wheels),
            spin_inertia_kgm2=spins,
            guide=self.guide,
            wheel_rail=WheelRail(
                wheel_profile=profile_place(self.wheel_profile, self._folder),
                rail_profile=profile_place(self.rail_profile, self._folder),
                profile_scale=self.profile_scale,
                wheel_file_tape_circle_m=self._tape_circle_m,
                smoothing=self.contact_smoothing,
                gauge_m=self.gauge_m,
                rail_inclination=self.rail_inclination,
                friction=self.friction,
                creep=self.creep,
                tape_circle_half_m=self.axle[0].wheel_y_m[0],
                linear=self.linear_contact,
            ),
            series=tuple(series),
            rotations=tuple(
                Rotation(entry.name, *entry.between, entry.stiffness_nmprad, entry.damping_nmsprad)
                for entry in self.rotation
            ),
            tabled=tuple(
                Tabled(
                    **ends,
                    axis="xyz".index(entry.axis),
                    over=entry.over,
                    points=tuple(entry.points),
                )
                for entry in self.tabled
                for ends in _ends(entry)
            ),
            rods=self._rods(),
            arms=self._arms(),
            gyroscopic=self.gyroscopic,
            traction=traction,
        )

    def _arms(self) -> tuple[TrailingArms, ...]:
        return tuple(
            TrailingArms(
                name=entry.name,
                axle=entry.between[0],
                frame=entry.between[1],
                bushings_m=entry.bushings_m,
                stiffness_npm=entry.stiffness_npm,
                damping_nspm=entry.damping_nspm,
            )
            for entry in self.trailing_arm
        )

    def _rods(self) -> tuple[Rod, ...]:
        return tuple(
            Rod(
                name=entry.name if len(entry.ends_m) == 1 else f"{entry.name} {i}",
                inner=entry.between[0],
                outer=entry.between[1],
                inner_position_m=first,
                outer_position_m=second,
                stiffness_npm=entry.stiffness_npm,
                damping_nspm=entry.damping_nspm,
            )
            for entry in self.rod
            for i, (first, second) in enumerate(entry.ends_m, start=1)
        )


def _shares(traction: Traction, kind: str, wheels: Sequence[Wheel]) -> dict[str, float]:
    """Share of each spin of a vehicle; ``kind`` is "driven" or "braked".

    Raises
    ------
    InputError
        For an axle or a wheel that is none, a wheelset that is given twice, or shares that do not
        sum to 1.
    """
    given: dict[str, float] = getattr(traction, kind)
    shares: dict[str, float] = {}
    for name, share in given.items():
        spins = list(dict.fromkeys(w.spin for w in wheels if name in (w.axle, w.name)))
        if not spins:
            names = dict.fromkeys([w.axle for w in wheels] + [w.name for w in wheels])
            raise InputError(
                "no such axle or wheel", field=kind, value=name, limit="one of " + ", ".join(names)
            )
        for spin in spins:
            if spin in shares:
                raise InputError(
                    "a wheel has its share twice",
                    field=kind,
                    value=name,
                    remedy="name it once",
                    limit="each wheel once",
                )
            shares[spin] = share / len(spins)
    total = sum(shares.values())
    if abs(total - 1.0) > 1e-6:
        raise InputError("the shares do not sum to 1", field=kind, value=f"{total:g}", limit="1")
    return shares


def _ends(entry: SuspensionEntry | TabledEntry) -> list[dict[str, Any]]:
    """Name, bodies and place of each of an entry's equal elements."""
    return [
        {
            "name": entry.name if len(entry.positions_m) == 1 else f"{entry.name} {i + 1}",
            "inner": entry.between[0],
            "outer": entry.between[1],
            "position_m": position,
        }
        for i, position in enumerate(entry.positions_m)
    ]
