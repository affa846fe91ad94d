"""A ride: a vehicle driven over a laid track. `simulate` turns it into a `Truth`, once.

The truth is cached by the hash of everything it depends on: track, irregularity, seed, vehicle,
profile, engine, step, versions and the sources of the code that makes it. Sensors and estimators are
not among them, so a new sensor draw costs no new simulation.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar

from simrail.core.sealed_files import HEADER, DamagedError
from simrail.core.shown import Facts, Shown
from simrail.core.source_hash import source_hash
from simrail.ride import cache as ride_cache
from simrail.ride.contact_extremes import ContactExtremes
from simrail.ride.hunting import hunting_warning, with_hunting
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.ride.truth import Truth
from simrail.ride.truth_files import load_truth, save_truth, write_header
from simrail.ride.truth_rows import TruthRows
from simrail.ride.vibration.files import read_short_waves, write_short_waves
from simrail.ride.vibration.short_waves import ShortWaves
from simrail.ride.vibration.sources import Vibration
from simrail.track.design import TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import LaidTrack, lay
from simrail.track.rail_condition import RailCondition
from simrail.vehicle.contact.profile_files import profiles_digest
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.derailment import DerailedError
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

if TYPE_CHECKING:
    from simrail.vehicle.engines.exudyn_engine import ExudynEngine

T = TypeVar("T")

Progress = Callable[[float, float, float], None]
"""Called with (simulated seconds done, seconds in all, present speed in m/s)."""

_SOURCES = (
    *(
        "track",
        "vehicle",
        "ride/abeam.py",
        "ride/ride.py",
        "ride/contact_forces.py",
        "ride/contact_extremes.py",
        "ride/kinematic.py",
        "ride/truth.py",
        "ride/truth_files.py",
        "ride/truth_rows.py",
    ),
    *("core/rotation.py", "core/seeds.py", "core/jit.py", "core/sealed_files.py"),
)
_VIBRATION_SOURCES = ("ride/vibration",)


class Kept(NamedTuple):
    """What of a long ride is kept: the motion of some bodies, and the angles of some wheels.

    Of bodies, place and attitude are in double precision, the rest in single; no states of the contacts.
    """

    bodies: tuple[str, ...]
    wheels: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class Ride(Shown):
    """Everything that a truth depends on.

    Attributes
    ----------
    name : str
        Name of the ride.
    track : TrackDesign
        Design track.
    irregularity : Irregularity
        What the track looks like.
    track_seed : int
        Seed of this realisation of the irregularity.
    vehicle : VehicleModel
        What runs.
    profile : SpeedProfile
        How it is driven.
    engine : {"exudyn", "compiled", "kinematic"}
        Who computes the motion.
    step_s : float
        Step of the integrator.
    rate_hz : float
        Output rate.
    gravity_mps2 : float
        Gravity.
    drive : {"guide", "wheels"}
        Whether the guide pulls the vehicle along, or its wheels drive and brake it.
    conditions : tuple of RailCondition
        What lies on the rails.
    contact_rate_hz : float
        Rate of the kept samples of forces between wheels and rails, unfiltered: `rate_hz` over a whole
        number; 0 keeps none.
    kept : Kept, optional
        What of a long ride is kept; None keeps everything, in double precision.
    vibration : Vibration, optional
        What shakes beside what the engine sees; None for nothing.
    """

    name: str
    track: TrackDesign
    irregularity: Irregularity
    track_seed: int
    vehicle: VehicleModel
    profile: SpeedProfile
    engine: Literal["exudyn", "compiled", "kinematic"] = "exudyn"
    step_s: float = 0.5e-3
    rate_hz: float = 1000.0
    gravity_mps2: float = 9.81
    drive: Literal["guide", "wheels"] = "guide"
    conditions: tuple[RailCondition, ...] = ()
    contact_rate_hz: float = 0.0
    kept: Kept | None = None
    vibration: Vibration | None = None

    def _facts(self) -> Facts:
        profile = self.profile
        facts = {
            "track": f"{self.track.name}, rails {self.irregularity.spectrum}, seed {self.track_seed}",
            "vehicle": f"{self.vehicle.name} by the {self.engine} engine, steps of {1e3 * self.step_s:g} ms",
            "way": f"s = {profile.start_m:g} to {profile.end_m:g} m at {3.6 * profile.speed_mps:.0f} km/h",
            "time": f"{profile.duration_s:.1f} s at {self.rate_hz:g} Hz",
            "vibration": "none" if self.vibration is None else "yes",
        }
        return self.name, facts

    @property
    def kept_bodies(self) -> list[int]:
        """Numbers of the bodies whose motion is kept."""
        names = self.vehicle.body_names
        return [i for i, name in enumerate(names) if self.kept is None or name in self.kept.bodies]

    @property
    def kept_wheels(self) -> list[int]:
        """Numbers of the wheels whose angles are kept."""
        names = self.vehicle.wheel_names
        return [i for i, name in enumerate(names) if self.kept is None or name in self.kept.wheels]

    @property
    def contact_every(self) -> int:
        """Output rows from one with kept contact forces to the next; 0 if none are kept."""
        return round(self.rate_hz / self.contact_rate_hz) if self.contact_rate_hz > 0.0 else 0

    def describe(self) -> dict[str, Any]:
        """Plain data that tells this ride from every other, versions and sources included."""
        plain = {
            "track": self.track.to_dict(),
            "irregularity": self.irregularity.describe(),
            "track_seed": self.track_seed,
            "vehicle": asdict(self.vehicle),
            "profiles": profiles_digest(self.vehicle.wheel_rail),
            "profile": asdict(self.profile),
            "engine": self.engine,
            "step_s": self.step_s,
            "rate_hz": self.rate_hz,
            "gravity_mps2": self.gravity_mps2,
            "drive": self.drive,
            "conditions": [asdict(condition) for condition in self.conditions],
            "contact_rate_hz": self.contact_rate_hz,
            "kept": None if self.kept is None else self.kept._asdict(),
            "versions": dict(_versions()),
            "sources": source_hash(*_SOURCES),
        }
        if self.vibration is not None:
            plain["vibration"] = self.vibration.describe()
            plain["vibration_sources"] = source_hash(*_VIBRATION_SOURCES)
        return plain

    @property
    def without_vibration(self) -> Ride:
        """The ride as its engine computes it: with and without vibration it is the same."""
        return replace(self, vibration=None)


@lru_cache(maxsize=1)
def _versions() -> tuple[tuple[str, str], ...]:
    """Names and versions of the packages that make a ride; looked up once, each takes milliseconds."""
    return tuple((package, version(package)) for package in ("simrail", "numpy", "scipy", "numba", "exudyn"))


def rails_of(ride: Ride) -> LaidTrack:
    """The rails of a ride, laid anew: the same bits every time."""
    return lay(ride.track, ride.irregularity, seed=ride.track_seed, conditions=ride.conditions)


def is_cached(ride: Ride) -> bool:
    """Whether `simulate` would find this ride on disk, its vibration included."""
    if ride.vibration is not None and not is_cached(ride.without_vibration):
        return False
    places = ride_cache.places_of(ride_cache.key_of(ride.describe()))
    return any((place / HEADER).is_file() for place in places)


def simulate(
    ride: Ride,
    *,
    progress: Progress | None = None,
    told: Callable[[str], None] | None = None,
    warn: bool = True,
) -> Truth:
    """Simulate a ride, or find it in the cache.

    Parameters
    ----------
    ride : Ride
        What to simulate.
    progress : callable, optional
        Called now and then with (seconds done, seconds in all, speed).
    told : callable, optional
        Called with one line if a ride in the cache was damaged, it is dropped and simulated again; or if the
        cache cannot be written.
    warn : bool
        Warn (`UserWarning`) of a speed at which the vehicle hunts. A campaign, whose check has said so, does
        not say it again.

    Returns
    -------
    Truth
        Motion at `Ride.rate_hz`; ``manifest["real_time_factor"]`` says how fast the engine was.

    Raises
    ------
    simrail.vehicle.engines.derailment.DerailedError
        If a wheel leaves the rail.
    OSError
        If the cache cannot be read, or the disk is full.
    """
    if ride.vibration is not None:
        truth = simulate(ride.without_vibration, progress=progress, told=told, warn=warn)
        short = _shaken(ride, truth, told)
        warned = [*truth.manifest.get("warnings", ()), *short.warnings()]
        return replace(truth, short_waves=short, manifest={**truth.manifest, "warnings": warned})
    if warn and ride.engine != "kinematic" and (words := hunting_warning(ride, rails_of(ride))):
        warnings.warn(f"ride {ride.name} {words}", stacklevel=2)
    key = ride_cache.key_of(ride.describe())
    kept = _kept_before(key, load_truth, told, f"ride {ride.name}", "simulated again")
    if kept is not None:
        return kept
    with ride_cache.new_ride(key, told) as draft:
        if ride.engine == "kinematic":
            save_truth(_follow(ride), draft)
        else:
            try:
                _drive(ride, draft, progress)
            except DerailedError as error:
                raise DerailedError(with_hunting(error.derailment, ride, rails_of(ride))) from error
    return load_truth(ride_cache.places_of(key)[-1])


def _kept_before(
    key: str, read: Callable[[Path], T], told: Callable[[str], None] | None, name: str, again: str
) -> T | None:
    """What the cache has of a key; None if it has nothing, or what was damaged and is dropped.

    Raises
    ------
    OSError
        If the cache cannot be read, which says nothing of what it holds.
    """
    for place in ride_cache.places_of(key):
        try:
            found = read(place)
        except DamagedError as error:
            ride_cache.drop(place)
            if told is not None:
                told(f"{name} in the cache was damaged ({error}): {again}")
            continue
        ride_cache.touch(place)
        return found
    return None


def _shaken(ride: Ride, truth: Truth, told: Callable[[str], None] | None) -> ShortWaves:
    """The short-wave part of a ride, worked out or found in the cache."""
    assert ride.vibration is not None
    key = ride_cache.key_of(ride.describe())
    read = partial(read_short_waves, rows=len(truth.time_s))
    kept = _kept_before(key, read, told, f"vibration of ride {ride.name}", "worked out again")
    if kept is not None:
        return kept
    with ride_cache.new_ride(key, told) as draft:
        manifest = {"ride": f"{ride.name} (vibration)", "vehicle": ride.vehicle.name}
        write_short_waves(ride.vibration, truth, ride.vehicle, draft, seed=ride.track_seed, manifest=manifest)
    return read(ride_cache.places_of(key)[-1])


def _follow(ride: Ride) -> Truth:
    """Every body of the vehicle keeps to the irregular rails at its own place: no dynamics."""
    laid, model = rails_of(ride), ride.vehicle
    radius = model.wheels[0].radius_m
    truths = {
        body.name: kinematic_truth(
            ride.track,
            ride.profile,
            channels=rail_following(laid, height_m=body.position_m[2]),
            offset_m=body.position_m[0],
            height_m=body.position_m[2],
            wheel_radius_m=radius,
            rate_hz=ride.rate_hz,
            gravity_mps2=ride.gravity_mps2,
        )
        for body in (model.bodies[i] for i in ride.kept_bodies)
    }
    first = next(iter(truths.values()))
    return replace(
        first,
        bodies={name: truth.bodies["body"] for name, truth in truths.items()},
        wheel_angles={wheel.name: first.wheel_angles["wheel"] for wheel in model.wheels},
        wheel_radius_m={wheel.name: wheel.radius_m for wheel in model.wheels},
        axle_offsets_m=_axle_offsets_m(model),
        manifest={"ride": ride.name, "engine": "kinematic", "vehicle": model.name},
    )


def _axle_offsets_m(model: VehicleModel) -> dict[str, float]:
    return {name: model.body(name).position_m[0] for name in model.axle_names}


def _engine_of(name: str) -> type[ExudynEngine] | type[CompiledEngine]:
    """The engine of a name."""
    if name == "compiled":
        return CompiledEngine
    # Exudyn takes long to import; neither a cached ride nor the compiled engine needs it.
    from simrail.vehicle.engines.exudyn_engine import ExudynEngine

    return ExudynEngine


def _drive(ride: Ride, folder: Path, progress: Progress | None) -> None:
    """Run an engine segment by segment into arrays on disk."""
    started = time.perf_counter()
    model, profile = ride.vehicle, ride.profile
    setup = Setup(
        model,
        rails_of(ride),
        profile,
        step_s=ride.step_s,
        rate_hz=ride.rate_hz,
        gravity_mps2=ride.gravity_mps2,
        drive=ride.drive,
    )
    engine = _engine_of(ride.engine)(setup)
    rows = TruthRows(ride, folder)
    extremes = ContactExtremes(model, rate_hz=ride.rate_hz, gravity_mps2=ride.gravity_mps2)
    ready = time.perf_counter()
    for segment in engine.run(rows.duration_s):
        extremes.add(rows.add(segment), segment.contacts)
        if progress is not None:
            now = float(segment.time_s[-1])
            progress(now, rows.duration_s, float(profile.motion(now)[1]))
    rows.finish()
    wall = time.perf_counter() - ready
    write_header(
        folder,
        track=ride.track,
        bodies={
            body.name: (body.position_m[0], body.position_m[2])
            for body in (model.bodies[i] for i in ride.kept_bodies)
        },
        wheels={wheel.name: wheel.radius_m for wheel in (model.wheels[i] for i in ride.kept_wheels)},
        contact_wheels=model.wheel_names,
        axle_offsets_m=_axle_offsets_m(model),
        gravity_mps2=ride.gravity_mps2,
        contact_every=ride.contact_every or 1,
        manifest={
            **_facts(ride),
            "simulated_s": rows.duration_s,
            "wall_s": wall,
            "setup_s": ready - started,
            "real_time_factor": rows.duration_s / wall,
            "contact": extremes.summary(),
            "warnings": extremes.warnings(),
            "versions": ride.describe()["versions"],
        },
    )


def _facts(ride: Ride) -> dict[str, Any]:
    """What a manifest says of a ride that an engine drives."""
    return {
        "ride": ride.name,
        "engine": ride.engine,
        "vehicle": ride.vehicle.name,
        "drive": ride.drive,
        "conditions": [asdict(condition) for condition in ride.conditions],
        "step_s": ride.step_s,
        "rate_hz": ride.rate_hz,
    }
