"""A ride: a vehicle driven over a laid track. `simulate` turns it into a `Truth`, once.

The truth is cached by the hash of everything it depends on: track, irregularity, seed, vehicle,
profile, engine, step, versions and the sources of the code that makes it. Sensors and estimators are
not among them, so a new sensor draw costs no new simulation.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from simrail.core.source_hash import source_hash
from simrail.ride import cache as ride_cache
from simrail.ride.contact_extremes import ContactExtremes
from simrail.ride.contact_forces import contact_columns
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.ride.truth import Truth, abeam
from simrail.ride.truth_files import create_arrays, let_go, load_truth, save_truth, write_header
from simrail.track.design import TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import LaidTrack, lay
from simrail.track.rail_condition import RailCondition
from simrail.vehicle.contact.profile_files import profiles_digest
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.derailment import DerailedError, Derailment
from simrail.vehicle.engines.engine import Segment, Setup
from simrail.vehicle.hunting import critical_below, mean_widening_m, on_gauge
from simrail.vehicle.model import VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile

if TYPE_CHECKING:
    from simrail.vehicle.engines.exudyn_engine import ExudynEngine

Progress = Callable[[float, float, float], None]
"""Called with (simulated seconds done, seconds in all, present speed in m/s)."""

_SOURCES = (
    *(
        "track",
        "vehicle",
        "ride/ride.py",
        "ride/contact_forces.py",
        "ride/contact_extremes.py",
        "ride/kinematic.py",
        "ride/truth.py",
        "ride/truth_files.py",
    ),
    *("core/rotation.py", "core/seeds.py", "core/jit.py"),
)


@dataclass(frozen=True)
class Ride:
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

    @property
    def contact_every(self) -> int:
        """Output rows from one with kept contact forces to the next; 0 if none are kept."""
        return round(self.rate_hz / self.contact_rate_hz) if self.contact_rate_hz > 0.0 else 0

    def describe(self) -> dict[str, Any]:
        """Plain data that tells this ride from every other, versions and sources included."""
        return {
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
            "versions": dict(_versions()),
            "sources": source_hash(*_SOURCES),
        }


@lru_cache(maxsize=1)
def _versions() -> tuple[tuple[str, str], ...]:
    """Names and versions of the packages that make a ride; looked up once, each takes milliseconds."""
    return tuple((package, version(package)) for package in ("simrail", "numpy", "scipy", "numba", "exudyn"))


def rails_of(ride: Ride) -> LaidTrack:
    """The rails of a ride, laid anew: the same bits every time."""
    return lay(ride.track, ride.irregularity, seed=ride.track_seed, conditions=ride.conditions)


def is_cached(ride: Ride) -> bool:
    """Whether `simulate` would find this ride on disk."""
    return (ride_cache.folder() / ride_cache.key_of(ride.describe()) / "truth.json").is_file()


def simulate(
    ride: Ride, *, progress: Progress | None = None, told: Callable[[str], None] | None = None
) -> Truth:
    """Simulate a ride, or find it in the cache.

    Parameters
    ----------
    ride : Ride
        What to simulate.
    progress : callable, optional
        Called now and then with (seconds done, seconds in all, speed).
    told : callable, optional
        Called with one line if a ride in the cache was damaged; it is dropped and simulated again.

    Returns
    -------
    Truth
        Motion at `Ride.rate_hz`; ``manifest["real_time_factor"]`` says how fast the engine was.

    Raises
    ------
    simrail.vehicle.engines.derailment.DerailedError
        If a wheel leaves the rail.
    """
    key = ride_cache.key_of(ride.describe())
    place = ride_cache.folder() / key
    if place.exists():
        try:
            truth = load_truth(place)
        except (OSError, ValueError, KeyError) as error:
            ride_cache.drop(key)
            if told is not None:
                told(f"ride {ride.name} in the cache was damaged ({error}): simulated again")
        else:
            ride_cache.touch(place)
            return truth
    with ride_cache.new_ride(key) as draft:
        if ride.engine == "kinematic":
            save_truth(_follow(ride), draft)
        else:
            try:
                _drive(ride, draft, progress)
            except DerailedError as error:
                raise DerailedError(_with_hunting(error.derailment, ride)) from error
    return load_truth(place)


def _with_hunting(derailment: Derailment, ride: Ride) -> Derailment:
    """A derailment that the rails do not explain, with hunting as its cause where the vehicle does hunt.

    It does if the axle has swung from side to side above the critical speed: a vehicle that is too fast for a
    curve leans on one rail.
    """
    if derailment.from_the_track or not derailment.swung:
        return derailment
    model = on_gauge(ride.vehicle, mean_widening_m(rails_of(ride), ride.profile))
    critical = critical_below(model, abs(derailment.speed_mps), gravity_mps2=ride.gravity_mps2)
    if critical is None:
        return derailment
    # Wheels that all turn apart do not hunt; what grows is another swing.
    swing = "hunting" if model.has_wheelsets else "unstable running"
    cause = f"{swing}, above the critical speed of {3.6 * critical:.0f} km/h; {derailment.cause}"
    return replace(derailment, cause=cause)


def _follow(ride: Ride) -> Truth:
    """Every body of the vehicle keeps to the irregular rails at its own place: no dynamics."""
    laid = rails_of(ride)
    radius = ride.vehicle.wheels[0].radius_m
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
        for body in ride.vehicle.bodies
    }
    first = next(iter(truths.values()))
    return replace(
        first,
        bodies={name: truth.bodies["body"] for name, truth in truths.items()},
        wheel_angles={wheel.name: first.wheel_angles["wheel"] for wheel in ride.vehicle.wheels},
        wheel_radius_m={wheel.name: wheel.radius_m for wheel in ride.vehicle.wheels},
        manifest={"ride": ride.name, "engine": "kinematic", "vehicle": ride.vehicle.name},
    )


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
    duration = np.floor(profile.duration_s * ride.rate_hz) / ride.rate_hz
    rows = round(duration * ride.rate_hz) + 1
    laid = rails_of(ride)
    setup = Setup(
        model,
        laid,
        profile,
        step_s=ride.step_s,
        rate_hz=ride.rate_hz,
        gravity_mps2=ride.gravity_mps2,
        drive=ride.drive,
    )
    engine = _engine_of(ride.engine)(setup)
    bodies, wheels = len(model.bodies), len(model.wheels)
    every = ride.contact_every
    arrays = create_arrays(folder, rows, bodies=bodies, wheels=wheels, wheel_states=4, contact_every=every)
    at = arrays["reference_position_m"]
    place, led = profile.start_m, model.body_names.index(model.guide.body)
    spins = list(model.spin_inertia_kgm2)
    turned = np.zeros(wheels)
    yaw = np.zeros(bodies)
    extremes = ContactExtremes(model, rate_hz=ride.rate_hz, gravity_mps2=ride.gravity_mps2)
    done = 0
    ready = time.perf_counter()
    for segment in engine.run(duration):
        here = slice(done, done + len(segment.time_s))
        arrays["time_s"][here] = np.arange(done, here.stop) / ride.rate_hz
        for b in range(bodies):
            motion = segment.body(b)
            # The heading is continuous over the segments, too.
            motion[:, 11] += 2.0 * np.pi * np.round((yaw[b] - motion[0, 11]) / (2.0 * np.pi))
            yaw[b] = motion[-1, 11]
            arrays[f"body_{b}"][here] = motion
        # Where the wheels drive, the vehicle is where they have brought it.
        if ride.drive == "wheels":
            at[here] = _places(ride, place, segment, led)
            place = float(at[here.stop - 1])
        else:
            at[here] = profile.motion(arrays["time_s"][here])[0]
        for w, wheel in enumerate(model.wheels):
            axle = arrays[f"body_{model.body_names.index(wheel.axle)}"]
            spin = spins.index(wheel.spin)
            begin = max(done - 1, 0)
            pitch_rate, pitch_acceleration = axle[begin : here.stop, 13], axle[begin : here.stop, 16]
            box = turned[w] + _integral(pitch_rate, pitch_acceleration, 1.0 / ride.rate_hz)
            turned[w] = box[-1]
            arrays[f"wheel_{w}"][here] = segment.spin_rad[:, spin] - box[here.start - begin :]
            arrays[f"wheel_state_{w}"][here] = segment.states[:, 4 * w : 4 * w + 4]
            if every:
                kept = slice(-(-here.start // every), -(-here.stop // every))
                told = segment.contacts[kept.start * every - here.start :: every, w]
                arrays[f"contact_{w}"][kept] = contact_columns(told)
        extremes.add(arrays["time_s"][here], segment.contacts)
        done = here.stop
        let_go(arrays)
        if progress is not None:
            now = float(segment.time_s[-1])
            progress(now, float(duration), float(profile.motion(now)[1]))
    for w in range(wheels):
        arrays[f"wheel_{w}"][:] -= arrays[f"wheel_{w}"][0]
        let_go(arrays)
    wall = time.perf_counter() - ready
    for array in arrays.values():
        array.flush()  # type: ignore[attr-defined]
    write_header(
        folder,
        track=ride.track,
        bodies={body.name: (body.position_m[0], body.position_m[2]) for body in model.bodies},
        wheels={wheel.name: wheel.radius_m for wheel in model.wheels},
        gravity_mps2=ride.gravity_mps2,
        contact_every=every or 1,
        manifest={
            **_facts(ride),
            "simulated_s": float(duration),
            "wall_s": wall,
            "setup_s": ready - started,
            "real_time_factor": float(duration) / wall,
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


def _places(ride: Ride, begin: float, segment: Segment, led: int) -> np.ndarray:
    """Where the vehicle's reference point is, s (n,), from the guide's body; ``begin`` is just before."""
    model, step = ride.vehicle, 1.0 / ride.rate_hz
    offset = model.bodies[led].position_m[0]
    ahead = np.einsum("nk,nk->n", segment.velocity[:, led], segment.rotation[:, led, :, 0])
    guess = begin + offset + np.cumsum(ahead) * step
    return abeam(ride.track, guess, segment.position[:, led])[4] - offset


def _integral(rate: np.ndarray, slope: np.ndarray, step: float) -> np.ndarray:
    """Running integral (n,) of samples whose derivative is known: Hermite, fourth order."""
    pieces = step / 2.0 * (rate[:-1] + rate[1:]) + step**2 / 12.0 * (slope[:-1] - slope[1:])
    return np.concatenate([[0.0], np.cumsum(pieces)])
