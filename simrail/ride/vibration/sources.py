"""What shakes a vehicle beyond what its multibody ride sees: named sources, each to be left out.

Each source says where its figures come from in `SOURCES`; those called synthetic are this project's own. A
ride with no vibration at all is an ablation, and tables call it so.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

from simrail.track.rail_surface import RailSources
from simrail.vehicle.vibration.linear_model import TrackSupport
from simrail.vehicle.vibration.wheels import OutOfRound

SOURCES = {
    "roughness": "levels by a table, see simrail.track.roughness",
    "section_gain": "synthetic",
    "welds": "synthetic: a cusp",
    "joints": "synthetic: a cusp",
    "sleepers": "synthetic amplitude, of the size of P L^3 / (192 to 48 E I) between sleepers",
    "corrugation": "synthetic",
    "wheels": "synthetic",
    "flexible_track": "synthetic: stiffness, damping and mass of a slab track's rail under a wheel",
    "bending": "synthetic",
    "structure_borne": "synthetic: the least certain of all",
    "equipment": "synthetic: louder than a floor at rest that was measured, 0.007 and 0.016 m/s2",
    "traction": "synthetic",
    "passengers": "synthetic",
}
"""Where the figures of each source come from."""


@dataclass(frozen=True)
class CarBending:
    """First vertical bending of every car body that stands on supports far apart.

    Attributes
    ----------
    frequency_hz, damping_ratio : float
        Of the free body.
    """

    frequency_hz: float = 10.0
    damping_ratio: float = 0.02


@dataclass(frozen=True)
class Equipment:
    """Equipment under the floor that runs always: lines, and even noise in a band.

    Attributes
    ----------
    rms_mps2 : float
        Of all of it.
    lines_hz : tuple of float
        Frequencies of lines of equal power, together half of it.
    band_hz : tuple of float
        Band of the noise.
    """

    rms_mps2: float = 0.03
    lines_hz: tuple[float, ...] = (24.6, 49.2, 98.4)
    band_hz: tuple[float, float] = (15.0, 180.0)


@dataclass(frozen=True)
class Traction:
    """Noise of motors and gears: rms ``share`` times the size of the acceleration along the track.

    Attributes
    ----------
    share : float
        Vertical rms over acceleration along.
    band_hz : tuple of float
        Band of the noise.
    """

    share: float = 0.04
    band_hz: tuple[float, float] = (30.0, 180.0)


@dataclass(frozen=True)
class Passengers:
    """Doors, and people who walk in and out, while the train stands.

    Attributes
    ----------
    rms_mps2 : float
        Vertical rms.
    band_hz : tuple of float
        Band of the noise.
    """

    rms_mps2: float = 0.0125
    band_hz: tuple[float, float] = (0.5, 4.0)


@dataclass(frozen=True)
class Vibration:
    """Everything that shakes a ride; None for what is not there.

    Attributes
    ----------
    rails : RailSources
        Short waves of the rails.
    wheels : OutOfRound, optional
        Wheels out of round.
    support : TrackSupport, optional
        Flexible track under each wheel; None for rails that do not give way.
    bending : CarBending, optional
        Bending of car bodies.
    structure_borne : float
        Share of the mean vertical motion of what carries a car body that its floor has besides its own.
    equipment, traction, passengers
        What shakes the floors of car bodies.
    rate_hz : float
        Rate at which it is worked out; a whole multiple of the truth's.
    lateral_creep : bool
        Whether axles sway and yaw in the creep of their contacts, at the mean speed of the ride over its way;
        or creep holds them.
    """

    rails: RailSources = field(default_factory=RailSources)
    wheels: OutOfRound | None = None
    support: TrackSupport | None = None
    bending: CarBending | None = None
    structure_borne: float = 0.0
    equipment: Equipment | None = None
    traction: Traction | None = None
    passengers: Passengers | None = None
    rate_hz: float = 2000.0
    lateral_creep: bool = False

    def describe(self) -> dict[str, Any]:
        """Plain data that tells this vibration from every other."""
        return asdict(self)

    @property
    def named(self) -> dict[str, str]:
        """Names of the sources that are there, with where their figures come from."""
        rails = {name: getattr(self.rails, name) for name in self.rails.__dataclass_fields__}
        there = {
            **rails,
            "wheels": self.wheels,
            "flexible_track": self.support,
            "bending": self.bending,
            "structure_borne": self.structure_borne or None,
            "equipment": self.equipment,
            "traction": self.traction,
            "passengers": self.passengers,
        }
        named = {name: SOURCES[name] for name, source in there.items() if source is not None}
        if self.rails.roughness is not None:
            named["roughness"] = self.rails.roughness.table.source
        return named
