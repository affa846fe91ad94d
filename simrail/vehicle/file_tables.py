"""The tables of a vehicle file: what each may hold, one by one. How they fit is judged in `vehicle_file`."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.vehicle.model import Wheel

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Point = tuple[float, float, float]
Triple = tuple[NotNegative, NotNegative, NotNegative]
Inertia = tuple[Positive, Positive, Positive]


class AxleEntry(Part):
    """An axle with its two wheels; the bridge is what does not turn.

    Of a conventional wheelset ("fixed") only sums matter: bridge and wheels turn together about the
    vertical and the longitudinal axis, and the spin inertia of both wheels is that of the wheelset.
    """

    name: str
    x_m: float
    wheels: Literal["independent", "fixed"]
    wheel_radius_m: Annotated[float, Field(ge=0.01, le=1.0)]
    wheel_y_m: tuple[float, float] = (0.75, -0.75)
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
    series_stiffness_npm: Triple = (0.0, 0.0, 0.0)
    """Stiffness in series with the damper of each axis; 0: the damper is mounted rigidly."""


class RotationEntry(Part):
    """Springs and dampers of the rotation between two bodies (roll, pitch, yaw)."""

    name: str
    between: tuple[str, str]
    stiffness_nmprad: Triple
    damping_nmsprad: Triple


class TabledEntry(Part):
    """Equal bump stops or nonlinear dampers at one or several points: force over deflection or speed."""

    name: str
    between: tuple[str, str]
    positions_m: Annotated[list[Point], Field(min_length=1)]
    axis: Literal["x", "y", "z"]
    over: Literal["deflection_m", "speed_mps"]
    points: Annotated[list[tuple[Positive, NotNegative]], Field(min_length=2)]


class CreepEntry(Part):
    """How creep forces saturate: see `simrail.vehicle.contact.creep_laws.CreepLaw`."""

    law: Literal["she", "polach", "fastsim"] = "she"
    adhesion: Annotated[float, Field(gt=0, le=1)] = 1.0
    slip: Annotated[float, Field(gt=0, le=1)] = 1.0
    friction_floor: Annotated[float, Field(gt=0, le=1)] = 1.0
    friction_decay_spm: Annotated[float, Field(ge=0)] = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.slip > self.adhesion:
            raise InputError(
                "Polach's factor of slip exceeds that of adhesion",
                field="slip",
                value=self.slip,
                limit=f"<= adhesion, {self.adhesion:g}",
            )
        return self


class LinearContactEntry(Part):
    """Prescribed linear contact in place of the profiles, for validation against closed forms."""

    f11_n: Positive
    f22_n: Positive
    f23_nm: float = 0.0
    f33_nm2: NotNegative = 0.0
    conicity: Annotated[float, Field(ge=0.0, le=0.5)]
    vertical_stiffness_npm: Positive
    vertical_damping_nspm: NotNegative
    gravitational_stiffness_npm: float = 0.0
    gravitational_yaw_stiffness_nmprad: float = 0.0


class GuideEntry(Part):
    """The driver of the ride; with the stiffnesses that are 0 by default it holds its body to the track."""

    body: str
    stiffness_npm: Positive
    damping_nspm: NotNegative
    pitch_stiffness_nmprad: NotNegative
    pitch_damping_nmsprad: NotNegative
    yaw_stiffness_nmprad: NotNegative
    yaw_damping_nmsprad: NotNegative
    lateral_stiffness_npm: NotNegative = 0.0
    lateral_damping_nspm: NotNegative = 0.0
    vertical_stiffness_npm: NotNegative = 0.0
    vertical_damping_nspm: NotNegative = 0.0
    roll_stiffness_nmprad: NotNegative = 0.0
    roll_damping_nmsprad: NotNegative = 0.0


class TractionEntry(Part):
    """What drives and brakes the wheels: see `simrail.vehicle.model.Traction`.

    ``driven`` and ``braked`` give axles (both wheels alike) or single wheels their shares.
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

    def shares(self, kind: Literal["driven", "braked"], wheels: Sequence[Wheel]) -> dict[str, float]:
        """Share of each spin of a vehicle.

        Raises
        ------
        InputError
            For an axle or a wheel that is none, a wheelset that is given twice, or shares that do not
            sum to 1.
        """
        given: dict[str, float] = getattr(self, kind)
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
                        "a wheel has its share twice", field=kind, value=name, remedy="name it once"
                    )
                shares[spin] = share / len(spins)
        total = sum(shares.values())
        if abs(total - 1.0) > 1e-6:
            raise InputError("the shares do not sum to 1", field=kind, value=f"{total:g}", limit="1")
        return shares


def ends_of(entry: SuspensionEntry | TabledEntry) -> list[dict[str, Any]]:
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
