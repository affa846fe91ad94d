"""The drawing of a vehicle as a person writes it: ``[vehicle_sheet]`` of a ride file, in SI.

For the body that carries the IMU a few places suffice (``pivots_m``, ``axles_m`` or ``other_axle_m``). A
whole vehicle has a ``[[vehicle_sheet.body]]`` for each axle, frame and body, which is what simrail writes.
"""

from dataclasses import asdict, replace
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.recording.sheets.vehicle_sheet import (
    PLACE_SD_M,
    STIFFNESS_RELATIVE_SD,
    SheetBody,
    Springs,
    Support,
    VehicleSheet,
)

LONGEST_M = 40.0
"""Longest distance of two supports of a body: no vehicle has its bogies farther apart."""

WEIGHTS_TOLERANCE = 1e-3
"""Of the sums of weights, 1/m and 1: they may be rounded to four digits."""

Name = Annotated[str, Field(min_length=1, max_length=200)]
AlongVehicle = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Place = Annotated[float, Field(ge=-LONGEST_M, le=LONGEST_M)]
Places = tuple[Place, Place]
Wheelbase = Annotated[float, Field(gt=0.0, le=10.0)]
# A scale vehicle has some 1e4 N/m; smaller numbers are those of kN/mm or N/mm.
PrimaryStiffness = Annotated[float, Field(ge=1e4, le=1e9)]
PrimaryDamping = Annotated[float, Field(ge=0.0, le=1e7)]
Stiffness = Annotated[float, Field(ge=0.0, le=1e10)]
Height = Annotated[float, Field(ge=0.0, le=6.0)]
Mass = Annotated[float, Field(gt=0.0, le=2e5)]
Inertia = Annotated[float, Field(gt=0.0, le=2e7)]


class SpringsPart(Part):
    """``[[vehicle_sheet.body.springs]]``: between a body and one of those that it rests on, as `Springs`."""

    lateral_npm: Stiffness
    """Lateral stiffness of all of them together, N/m."""
    vertical_npm: Annotated[float, Field(ge=1e3, le=1e10)]
    """Vertical stiffness, N/m."""
    roll_nmprad: Stiffness
    """Stiffness in roll beyond that of the vertical springs, N m/rad."""
    lateral_nspm: PrimaryDamping
    """Lateral damping, N s/m."""
    vertical_nspm: PrimaryDamping
    """Vertical damping, N s/m."""
    roll_nmsprad: PrimaryDamping
    """Damping in roll, N m s/rad."""
    height_m: Height
    """Height above the rails at which the lateral springs act, m."""


class SheetBodyPart(Part):
    """``[[vehicle_sheet.body]]``: an axle, a bogie frame or a body; those that it rests on stand before it.

    Attributes
    ----------
    name : str
        Its name.
    x_m : float
        Where its reference point is along the vehicle, m, forward from any point that all bodies share.
    rests_on : tuple of str
        Names of those below it; none for an axle.
    pivots_m : tuple of float
        Where it rests on each of them, in its own coordinates.
    ends_m : tuple of float, optional
        Its rear and its front end, in its own coordinates, m.
    primary_stiffness_npm, primary_damping_nspm : float, optional
        Of an axle: vertical stiffness and damping of its suspension, both sides together.
    turned_by, turned_by_1pm : tuple of str, tuple of float
        Where it does not point from support to support: names of axles, and by how much its heading follows
        the lateral offset of each, 1/m (`SheetBody.turned_by`).
    wheelset : bool, optional
        Of an axle: whether its wheels turn as one.
    mass_kg, roll_inertia_kgm2, pitch_inertia_kgm2, height_m : float, optional
        Mass, inertia about the centre of gravity, and its height over the rails.
    springs : tuple of SpringsPart
        One for each of rests_on, or none.
    """

    name: Name
    x_m: AlongVehicle
    rests_on: tuple[Name, ...] = ()
    pivots_m: tuple[Place, ...] = ()
    ends_m: Places | None = None
    primary_stiffness_npm: Annotated[float, Field(gt=0.0)] | None = None
    primary_damping_nspm: Annotated[float, Field(ge=0.0)] | None = None
    turned_by: tuple[Name, ...] = ()
    turned_by_1pm: tuple[Annotated[float, Field(ge=-100.0, le=100.0)], ...] = ()
    wheelset: bool | None = None
    mass_kg: Mass | None = None
    roll_inertia_kgm2: Inertia | None = None
    pitch_inertia_kgm2: Inertia | None = None
    height_m: Height | None = None
    springs: tuple[SpringsPart, ...] = ()

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if len(self.turned_by_1pm) != len(self.turned_by):
            raise InputError(
                "has another number of weights than of axles",
                field="turned_by_1pm",
                value=self.turned_by_1pm,
                limit=f"{len(self.turned_by)} weights, one for each of turned_by",
            )
        if len(self.pivots_m) != len(self.rests_on):
            raise InputError(
                "has another number of places than of bodies below",
                field="pivots_m",
                value=self.pivots_m,
                limit=f"{len(self.rests_on)} places, one for each of rests_on",
            )
        if self.springs and len(self.springs) != len(self.rests_on):
            raise InputError(
                "has another number of springs than of bodies below",
                field="springs",
                value=len(self.springs),
                limit=f"{len(self.rests_on)}, one for each of rests_on, or none",
            )
        if len(set(self.rests_on)) < len(self.rests_on):
            raise InputError(
                "rests twice on the same body",
                field="rests_on",
                value=self.rests_on,
                remedy="give one place, the middle of them",
                limit="each body once",
            )
        if self.wheelset is not None and self.rests_on:
            raise InputError(
                "is of an axle",
                field="wheelset",
                value=self.wheelset,
                limit="none for a body that rests on others",
                remedy="give it in the [[vehicle_sheet.body]] of its axles",
            )
        _check_ends(self.ends_m, "ends_m")
        _check_places(self.pivots_m, "pivots_m", self.ends_m)
        return self

    def body(self) -> SheetBody:
        """The body that it describes."""
        return SheetBody(
            name=self.name,
            x_m=self.x_m,
            supports=tuple(Support(on, x) for on, x in zip(self.rests_on, self.pivots_m, strict=True)),
            ends_m=self.ends_m,
            primary_stiffness_npm=self.primary_stiffness_npm,
            primary_damping_nspm=self.primary_damping_nspm,
            turned_by=tuple(zip(self.turned_by, self.turned_by_1pm, strict=True)),
            wheelset=self.wheelset,
            mass_kg=self.mass_kg,
            roll_inertia_kgm2=self.roll_inertia_kgm2,
            pitch_inertia_kgm2=self.pitch_inertia_kgm2,
            height_m=self.height_m,
            springs=tuple(Springs(**part.model_dump()) for part in self.springs),
        )


class VehicleSheetPart(Part):
    """``[vehicle_sheet]``: what a drawing of the vehicle says, for the body that carries the IMU or for all.

    Places are in the coordinates of the body that carries the IMU, as ``position_m`` of ``[imu]``.

    Attributes
    ----------
    pivots_m : tuple of float, optional
        Of a body on two bogies: the pivots.
    bogie_wheelbase_m : float, optional
        Distance of the axles of these bogies; without it each counts as a single axle.
    axles_m : tuple of float, optional
        Of a bogie frame, or of a vehicle with two axles: the axles.
    other_axle_m : float, optional
        Of an axle: the other axle of its bogie or vehicle.
    body_ends_m : tuple of float, optional
        The ends of the body, to hold the other places against.
    primary_stiffness_npm, primary_damping_nspm : float, optional
        Vertical, of an axle.
    body : tuple of SheetBodyPart, optional
        Instead of all these: the whole vehicle.
    place_sd_m : float
        Standard deviation of each place.
    stiffness_relative_sd : float
        Relative standard deviation of stiffness, damping, masses and inertia.
    """

    pivots_m: Places | None = None
    bogie_wheelbase_m: Wheelbase | None = None
    axles_m: Places | None = None
    other_axle_m: Place | None = None
    body_ends_m: Places | None = None
    primary_stiffness_npm: PrimaryStiffness | None = None
    primary_damping_nspm: PrimaryDamping | None = None
    body: tuple[SheetBodyPart, ...] = ()
    place_sd_m: Annotated[float, Field(ge=0.0, le=1.0)] = PLACE_SD_M
    stiffness_relative_sd: Annotated[float, Field(ge=0.0, le=1.0)] = STIFFNESS_RELATIVE_SD

    @model_validator(mode="after")
    def _possible(self) -> Self:
        ways = ("pivots_m", "axles_m", "other_axle_m")
        given = [key for key in ways if getattr(self, key) is not None] + ["body"] * bool(self.body)
        if len(given) != 1:
            raise InputError(
                "needs what the IMU's body rests on, given once",
                field=given[1] if given else "pivots_m",
                value=given or None,
                limit="one of pivots_m (a body on two bogies), axles_m (a frame, or a body on two axles), "
                "other_axle_m (an axle), [[vehicle_sheet.body]] (all)",
                remedy="e.g. pivots_m = [9.5, -9.5]",
            )
        if self.body:
            self._check_whole()
        else:
            self._check_places()
        return self

    def _check_places(self) -> None:
        _check_ends(self.body_ends_m, "body_ends_m")
        if self.bogie_wheelbase_m is not None and self.pivots_m is None:
            raise InputError(
                "is of the bogies under a body on two",
                field="bogie_wheelbase_m",
                value=self.bogie_wheelbase_m,
                remedy="for an IMU on a bogie frame give axles_m, on an axle other_axle_m",
                limit="a body on two bogies",
            )
        if self.other_axle_m == 0.0:
            raise InputError(
                "two axles in one place",
                field="other_axle_m",
                value=0.0,
                limit="other than 0, as the IMU's own",
            )
        for key in ("pivots_m", "axles_m"):
            places = getattr(self, key)
            if places is not None:
                _check_places(places, key, self.body_ends_m)
        if self.pivots_m and self.bogie_wheelbase_m:
            distance = abs(self.pivots_m[0] - self.pivots_m[1])
            if self.bogie_wheelbase_m >= distance:
                raise InputError(
                    "bogies that reach into each other",
                    field="bogie_wheelbase_m",
                    value=self.bogie_wheelbase_m,
                    limit=f"< {distance:g} m, the distance of the pivots",
                    remedy="give the distance of the two axles of one bogie",
                )

    def _check_whole(self) -> None:
        for key in ("bogie_wheelbase_m", "body_ends_m", "primary_stiffness_npm", "primary_damping_nspm"):
            if getattr(self, key) is not None:
                raise InputError(
                    "goes with the places of one body only",
                    field=key,
                    value=getattr(self, key),
                    remedy="give it in a [[vehicle_sheet.body]], or remove these",
                    limit="one body",
                )
        names: list[str] = []
        for i, part in enumerate(self.body):
            if part.name in names:
                raise InputError(
                    "two bodies share a name",
                    field=f"body[{i}].name",
                    value=part.name,
                    remedy="rename one",
                    limit="each name once",
                )
            for on in part.rests_on:
                if on not in names:
                    raise InputError(
                        "rests on no body before it",
                        field=f"body[{i}].rests_on",
                        value=on,
                        limit="one of " + ", ".join(names) if names else None,
                        remedy="list the axles first, then frames, then bodies",
                    )
            names.append(part.name)
        for i, part in enumerate(self.body):
            _check_turned(part, {other.name: other.x_m for other in self.body if not other.rests_on}, i)

    def sheet(self, mount_body: str) -> VehicleSheet:
        """The drawing; ``mount_body`` is the body that carries the IMU.

        What the file does not name is called after it, e.g. ``"body.bogie_rear.axle_front"``.
        """
        bodies = tuple(part.body() for part in self.body) or self._bodies(mount_body)
        return VehicleSheet(bodies, self.place_sd_m, self.stiffness_relative_sd)

    def _bodies(self, mount: str) -> tuple[SheetBody, ...]:
        if self.other_axle_m is not None:
            half = 0.5 * self.other_axle_m
            other = f"{mount}.other_axle"
            return (
                replace(self._axle(mount, 0.0), ends_m=self.body_ends_m),
                self._axle(other, self.other_axle_m),
                SheetBody(f"{mount}.frame", half, (Support(mount, -half), Support(other, half))),
            )
        if self.axles_m is not None:
            return self._on_axles(mount, 0.0, self.axles_m, self.body_ends_m)
        assert self.pivots_m is not None
        bogies: list[SheetBody] = []
        supports = []
        for x, end in zip(sorted(self.pivots_m, reverse=True), ("front", "rear"), strict=True):
            name = f"{mount}.bogie_{end}"
            if self.bogie_wheelbase_m is None:
                below = f"{name}.axle"
                bogies += (self._axle(below, x), SheetBody(name, x, (Support(below, 0.0),)))
            else:
                half = 0.5 * self.bogie_wheelbase_m
                bogies += self._on_axles(name, x, (half, -half), None)
            supports.append(Support(name, x))
        return (*bogies, SheetBody(mount, 0.0, tuple(supports), self.body_ends_m))

    def _on_axles(
        self, name: str, x: float, axles: tuple[float, float], ends: tuple[float, float] | None
    ) -> tuple[SheetBody, ...]:
        """A body at x along the vehicle, after the two axles that it rests on."""
        front, rear = max(axles), min(axles)
        names = (f"{name}.axle_front", f"{name}.axle_rear")
        return (
            self._axle(names[0], x + front),
            self._axle(names[1], x + rear),
            SheetBody(name, x, (Support(names[0], front), Support(names[1], rear)), ends),
        )

    def _axle(self, name: str, x: float) -> SheetBody:
        return SheetBody(name, x, (), None, self.primary_stiffness_npm, self.primary_damping_nspm)


def _check_ends(ends: tuple[float, float] | None, field: str) -> None:
    """Refuse ends of a body that are not a rear and a front one."""
    if ends is not None and ends[0] >= ends[1]:
        raise InputError(
            "are not a rear and a front end", field=field, value=ends, limit="[rear, front], rear < front"
        )


def _check_places(places: tuple[float, ...], field: str, ends: tuple[float, float] | None) -> None:
    """Refuse places under a body that coincide, are too far apart, or beyond its ends."""
    in_order = sorted(places)
    if len(set(places)) < len(places):
        raise InputError(
            "two places in one",
            field=field,
            value=places,
            limit="places that differ",
            remedy="mend one of them",
        )
    if places and in_order[-1] - in_order[0] > LONGEST_M:
        raise InputError(
            "are farther apart than on any vehicle",
            field=field,
            value=places,
            limit=f"{LONGEST_M:g} m",
            remedy="give them in metres",
        )
    for x in places:
        if ends is not None and not ends[0] <= x <= ends[1]:
            raise InputError(
                "lies outside the body",
                field=field,
                value=x,
                limit=f"{ends[0]:g} to {ends[1]:g} m, its ends",
                remedy="give it from the body's own reference point, as position_m of [imu]",
            )


def _check_turned(part: SheetBodyPart, axles: dict[str, float], number: int) -> None:
    """Refuse weights that are not of axles, or do not turn a vehicle on a straight line with that line."""
    unknown = next((name for name in part.turned_by if name not in axles), None)
    if unknown is not None:
        raise InputError(
            "is no axle of this drawing",
            field=f"body[{number}].turned_by",
            value=unknown,
            limit="one of " + ", ".join(axles),
        )
    total = sum(part.turned_by_1pm)
    turn = sum(axles[name] * weight for name, weight in zip(part.turned_by, part.turned_by_1pm, strict=True))
    if part.turned_by and (abs(total) > WEIGHTS_TOLERANCE or abs(turn - 1.0) > WEIGHTS_TOLERANCE):
        raise InputError(
            "do not turn a vehicle on a straight line with that line",
            field=f"body[{number}].turned_by_1pm",
            value=part.turned_by_1pm,
            limit=f"a sum of 0 (here {total:g}), and of 1 times the places x_m of the axles (here {turn:g})",
            remedy="for a body on two axles at x1 and x2 they are 1/(x1 - x2) and -1/(x1 - x2)",
        )


def vehicle_sheet_table(sheet: VehicleSheet) -> dict[str, Any]:
    """The table that says this drawing: what `VehicleSheetPart` reads back, bit by bit."""
    return {
        "place_sd_m": sheet.place_sd_m,
        "stiffness_relative_sd": sheet.stiffness_relative_sd,
        "body": [
            {
                "name": body.name,
                "x_m": body.x_m,
                "rests_on": [support.on for support in body.supports] or None,
                "pivots_m": [support.x_m for support in body.supports] or None,
                "ends_m": body.ends_m,
                "primary_stiffness_npm": body.primary_stiffness_npm,
                "primary_damping_nspm": body.primary_damping_nspm,
                "turned_by": [axle for axle, _ in body.turned_by] or None,
                "turned_by_1pm": [weight for _, weight in body.turned_by] or None,
                "wheelset": body.wheelset,
                "mass_kg": body.mass_kg,
                "roll_inertia_kgm2": body.roll_inertia_kgm2,
                "pitch_inertia_kgm2": body.pitch_inertia_kgm2,
                "height_m": body.height_m,
                "springs": [asdict(springs) for springs in body.springs] or None,
            }
            for body in sheet.bodies
        ],
    }
