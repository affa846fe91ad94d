"""A vehicle file: bodies, springs, wheels and guide in one TOML, judged and made a `VehicleModel`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simrail.errors import InputError
from simrail.scenario.files import Part
from simrail.vehicle.model import Body, Guide, Suspension, VehicleModel, Wheel, WheelRail

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Point = tuple[float, float, float]
Triple = tuple[NotNegative, NotNegative, NotNegative]
Inertia = tuple[Positive, Positive, Positive]


class AxleEntry(Part):
    """An axle with its two wheels; the bridge is what does not turn."""

    name: str
    x_m: float
    wheels: Literal["independent", "fixed"]
    wheel_radius_m: Annotated[float, Field(ge=0.01, le=1.0)]
    bridge_mass_kg: Positive
    bridge_inertia_kgm2: Inertia
    wheel_mass_kg: Positive
    wheel_spin_inertia_kgm2: Positive
    wheel_transverse_inertia_kgm2: Positive


class BodyEntry(Part):
    """A body above the axles."""

    name: str
    mass_kg: Positive
    inertia_kgm2: Inertia
    position_m: Point


class SuspensionEntry(Part):
    """Equal springs at one or several points between two bodies."""

    name: str
    between: tuple[str, str]
    positions_m: Annotated[list[Point], Field(min_length=1)]
    stiffness_npm: Triple
    damping_nspm: Triple


class GuideEntry(Part):
    """The driver of the ride."""

    body: str
    stiffness_npm: Positive
    damping_nspm: NotNegative
    pitch_stiffness_nmprad: NotNegative
    pitch_damping_nmsprad: NotNegative
    yaw_stiffness_nmprad: NotNegative
    yaw_damping_nmsprad: NotNegative


class VehicleFile(Part):
    """A whole vehicle file."""

    title: str
    source: str
    synthetic: bool
    gauge_m: Annotated[float, Field(gt=0.1, lt=2.0)]
    rail_inclination: Annotated[float, Field(ge=0, le=0.1)]
    wheel_profile: Literal["S1002"]
    rail_profile: Literal["60E1"]
    friction: Annotated[float, Field(gt=0, le=1.0)]
    axle: Annotated[list[AxleEntry], Field(min_length=1)]
    body: tuple[BodyEntry, ...] = ()
    suspension: tuple[SuspensionEntry, ...] = ()
    guide: GuideEntry

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        names = [axle.name for axle in self.axle] + [body.name for body in self.body]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputError(
                "two bodies share a name", field="name", value=sorted(twice)[0], remedy="rename one"
            )
        asked = [
            (f"suspension[{i}].between", name)
            for i, entry in enumerate(self.suspension)
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
        return self

    def model(self, name: str) -> VehicleModel:
        """Build the vehicle that the file describes."""
        bodies: list[Body] = []
        wheels: list[Wheel] = []
        spins: dict[str, float] = {}
        for axle in self.axle:
            # The wheels ride on the bridge at the tape circles: their mass and transverse inertia count.
            carried = 2.0 * (axle.wheel_mass_kg * 0.75**2 + axle.wheel_transverse_inertia_kgm2)
            roll, pitch, yaw = axle.bridge_inertia_kgm2
            bodies.append(
                Body(
                    name=axle.name,
                    mass_kg=axle.bridge_mass_kg + 2.0 * axle.wheel_mass_kg,
                    inertia_kgm2=(roll + carried, pitch, yaw + carried),
                    position_m=(axle.x_m, 0.0, axle.wheel_radius_m),
                )
            )
            for side, word in ((1, "left"), (-1, "right")):
                wheel = f"{axle.name}.{word}"
                spin = wheel if axle.wheels == "independent" else axle.name
                spins[spin] = spins.get(spin, 0.0) + axle.wheel_spin_inertia_kgm2
                wheels.append(
                    Wheel(name=wheel, axle=axle.name, side=side, spin=spin, radius_m=axle.wheel_radius_m)
                )
        bodies += [Body(**entry.model_dump()) for entry in self.body]
        springs = [
            Suspension(
                name=entry.name if len(entry.positions_m) == 1 else f"{entry.name} {i + 1}",
                inner=entry.between[0],
                outer=entry.between[1],
                position_m=position,
                stiffness_npm=entry.stiffness_npm,
                damping_nspm=entry.damping_nspm,
            )
            for entry in self.suspension
            for i, position in enumerate(entry.positions_m)
        ]
        return VehicleModel(
            name=name,
            title=self.title,
            source=self.source,
            synthetic=self.synthetic,
            bodies=tuple(bodies),
            suspensions=tuple(springs),
            wheels=tuple(wheels),
            spin_inertia_kgm2=spins,
            guide=Guide(**self.guide.model_dump()),
            wheel_rail=WheelRail(
                wheel_profile=self.wheel_profile,
                rail_profile=self.rail_profile,
                gauge_m=self.gauge_m,
                rail_inclination=self.rail_inclination,
                friction=self.friction,
            ),
        )
