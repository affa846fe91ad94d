"""A piece of a ride as a film shows it: poses, rails, forces, attitudes and signals at its frames.

Everything is taken from what a run of the scenario would have: the ride, one recording of it, and the
estimates of every method. Nothing is drawn here (`simrail.report.film.page`, `simrail.report.film.gif`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.campaign.cell import BatchTally, CellResult, look_at
from simrail.campaign.progress import Watcher
from simrail.campaign.stored_results import read_results
from simrail.core.columns import CONTACT, RELATIVE_ATTITUDE, RELATIVE_POSITION
from simrail.core.errors import InputError, one_of
from simrail.core.interrupts import interruptible
from simrail.core.jit import FloatArray
from simrail.ride.ride import Kept, Ride, is_cached, simulate
from simrail.ride.truth import Mount, Truth
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.track.laid_track import LaidTrack
from simrail.vehicle.model import VehicleModel

FRAME_HZ = 25.0
"""Poses per second of the ride; the page interpolates between them."""

USUAL_S = 60.0
"""Length of a film whose range is not given."""

LONGEST_S = 600.0
"""The page of a longer one would be too big to be opened with ease."""

CONTACT_HZ = 100.0
"""Least rate of the contact forces that a film simulates a ride with."""

POSE = ("position_m", *RELATIVE_POSITION, *RELATIVE_ATTITUDE)
"""Columns of a pose: place along the track, place in the track frame, angles to the track frame."""


@dataclass(frozen=True)
class Signal:
    """One strip of signals: each line over the frames, those of methods by the method's name.

    ``least`` is the least span that it is drawn over: what is less is noise beside it.
    """

    label: str
    unit: str
    least: float
    lines: dict[str, FloatArray]
    methods: dict[str, FloatArray]


@dataclass(frozen=True)
class Film:
    """What a film shows, at its n frames.

    Attributes
    ----------
    scenario, ride, imu : str
        Names.
    engine : str
        Who computed the motion.
    vehicle : VehicleModel
        What runs.
    mount : Mount
        Where the IMU sits.
    rails : LaidTrack
        What it runs on; holds the design, too.
    time_s : ndarray (n,)
        Time of the ride, `FRAME_HZ` apart.
    reference_m : ndarray (n,)
        Where the vehicle's reference point is along the track.
    poses : dict of str to ndarray (n, 6)
        Columns `POSE` of each body's centre of gravity, without what shakes by short waves; the height is
        that above the rail plane.
    turns_rad : dict of str to ndarray (n,)
        Angle of each wheel.
    contacts : dict of str to ndarray (n, 12)
        Columns `simrail.core.columns.CONTACT` of each wheel; empty where the ride has no forces.
    true_rad : ndarray (n, 2)
        True roll and pitch of the IMU, global.
    estimated_rad : dict of str to ndarray (n, 2)
        The same as each method has it.
    signals : tuple of Signal
        What is shown in step.
    notes : tuple of str
        What a reader should know of it.
    """

    scenario: str
    ride: str
    imu: str
    engine: str
    vehicle: VehicleModel
    mount: Mount
    rails: LaidTrack
    time_s: FloatArray
    reference_m: FloatArray
    poses: dict[str, FloatArray]
    turns_rad: dict[str, FloatArray]
    contacts: dict[str, FloatArray]
    true_rad: FloatArray
    estimated_rad: dict[str, FloatArray]
    signals: tuple[Signal, ...]
    notes: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        """Length of the film at the ride's own pace."""
        return float(self.time_s[-1] - self.time_s[0])


def scenario_of(name: str, *, overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """The scenario of a name, of a file, or of a folder of results.

    Raises
    ------
    InputError
        If it cannot be read; of results, settings are those that they were made with.
    """
    folder = Path(name)
    if not (folder.is_dir() and (folder / "manifest.json").is_file()):
        return load_scenario(name, overrides=overrides, seed=seed)
    if overrides or seed is not None:
        raise InputError(
            "results have the settings that they were made with",
            field="--set" if overrides else "--seed",
            limit="only with a scenario",
            remedy="name the scenario instead of the folder of its results",
        )
    return read_results(folder, field="SCENARIO", remedy="name a scenario").scenario()


def film_of(
    scenario: Scenario,
    *,
    cell: int = 0,
    from_m: float | None = None,
    to_m: float | None = None,
    method: str | None = None,
    forces: bool = True,
    watcher: Watcher | None = None,
) -> Film:
    """Make the film of a piece of a ride.

    Parameters
    ----------
    scenario : Scenario
        As read.
    cell : int
        Which of its recordings.
    from_m, to_m : float, optional
        Range along the track, m, in any order: the first time that the vehicle's reference point is in it.
        Without either, the minute about the sharpest curve.
    method : str, optional
        The method that is shown first; the first of the scenario if not given.
    forces : bool
        Show the forces between wheels and rails: a ride that kept none is simulated again.
    watcher : Watcher, optional
        Is told of the progress.

    Raises
    ------
    InputError
        If there is no such cell, method or place on the ride, or the range is too long or too short.
    """
    watcher = watcher or Watcher()
    parts = judge_scenario(scenario).parts
    chosen = _cell_of(scenario, cell)
    estimators = parts.estimators(chosen.sample)
    if method is not None:
        one_of(method, estimators, "the scenario has no such method", field="--method")
    _check_numbers(from_m, to_m)
    truth = _simulated(chosen, parts, watcher, forces=forces)
    rows = _rows(truth, from_m, to_m)
    tally = BatchTally(scenario.name, estimators, parts.tunings(chosen.sample))
    seen = look_at(chosen, truth, parts, tally)
    if method is not None and method not in seen.estimates:
        raise InputError(
            "this method failed on this ride",
            field="--method",
            value=method,
            limit="a method that does not fail on this ride",
            remedy="run it to see why",
        )
    if method is not None:
        first = {method: seen.estimates[method]}
        seen = replace(seen, estimates=first | seen.estimates)
    return _film(scenario, chosen, parts, truth, seen, rows)


def _cell_of(scenario: Scenario, number: int) -> Cell:
    last = -1
    for cell in cells(scenario):
        if cell.number == number:
            return cell
        last = cell.number
    raise InputError("the scenario has no such cell", field="--cell", value=number, limit=f"0 to {last}")


def _check_numbers(from_m: float | None, to_m: float | None) -> None:
    for field, value in (("--from", from_m), ("--to", to_m)):
        if value is not None and not np.isfinite(value):
            raise InputError("is no place", field=field, value=value, limit="a finite number of metres")


def _simulated(cell: Cell, parts: Parts, watcher: Watcher, *, forces: bool) -> Truth:
    """The ride of a cell with every body kept, and with its forces if they are wanted."""
    ride = parts.ride(cell)
    wanted = _filmed(ride, forces=forces)
    if wanted is not ride and is_cached(ride) and not is_cached(wanted):
        watcher.told("the stored ride lacks what a film shows: simulated again (--no-forces may need less)")
    watcher.ride_begins(1, 1, ride.name)
    with interruptible() as check:
        try:
            truth = simulate(wanted, progress=watcher.ride_goes, warn=False)
        except Exception:
            check()
            raise
    watcher.ride_ends()
    return truth


def _filmed(ride: Ride, *, forces: bool) -> Ride:
    """The ride as a film needs it; itself where it has that."""
    if ride.kept is not None:
        ride = replace(ride, kept=Kept(tuple(ride.vehicle.body_names), tuple(ride.vehicle.wheel_names)))
    if forces and ride.engine != "kinematic" and not ride.contact_every:
        every = max(n for n in range(1, 1 + int(ride.rate_hz / CONTACT_HZ)) if ride.rate_hz % n == 0)
        ride = replace(ride, contact_rate_hz=ride.rate_hz / every)
    return ride


def _rows(truth: Truth, from_m: float | None, to_m: float | None) -> range:
    """Rows of the truth that are the film's frames."""
    place = truth.reference_position_m
    every = max(1, round(truth.rate_hz / FRAME_HZ))
    low, high = float(place.min()), float(place.max())
    limit = f"{low:.1f} to {high:.1f} m, where the ride goes"
    for field, value in (("--from", from_m), ("--to", to_m)):
        if value is not None and not low - 0.05 <= value <= high + 0.05:
            raise InputError("the ride does not go there", field=field, value=value, limit=limit)
    if from_m is None and to_m is None:
        return _usual_rows(truth, every)
    a, b = (low if from_m is None else from_m), (high if to_m is None else to_m)
    inside = (place >= min(a, b)) & (place <= max(a, b))
    first = int(np.argmax(inside))
    left = np.flatnonzero(~inside[first:])
    last = first + int(left[0]) - 1 if len(left) else len(place) - 1
    seconds = (last - first) / truth.rate_hz
    if not inside.any() or seconds < 1.0:
        raise InputError(
            "the film would be shorter than a second",
            field="--to",
            value=to_m,
            limit=limit,
            remedy="choose a longer range",
        )
    if seconds > LONGEST_S:
        raise InputError(
            f"the film would take {seconds:.0f} s",
            field="--to" if to_m is not None else "--from",
            value=to_m if to_m is not None else from_m,
            limit=f"at most {LONGEST_S:.0f} s",
            remedy="choose a shorter range",
        )
    return range(first, last + 1, every)


def _usual_rows(truth: Truth, every: int) -> range:
    """The whole of a short ride; of a longer one the minute about its sharpest curve."""
    count, rate = len(truth.time_s), truth.rate_hz
    if truth.time_s[-1] <= 2.0 * USUAL_S:
        return range(0, count, every)
    bend = np.abs(
        truth.track.curvature(
            np.clip(truth.reference_position_m[::every], truth.track.start_m, truth.track.end_m)
        )
    )
    middle = every * int(np.argmax(bend >= 0.999 * bend.max()))
    first = int(np.clip(middle - 0.4 * USUAL_S * rate, 0, count - 1 - USUAL_S * rate))
    return range(first, first + int(USUAL_S * rate) + 1, every)


def _film(scenario: Scenario, cell: Cell, parts: Parts, truth: Truth, seen: CellResult, rows: range) -> Film:
    """Gather everything at the frames."""
    resolved, bare = parts.resolve(cell), replace(truth, short_waves=None)
    vehicle = resolved.ride.vehicle
    time = truth.time_s[rows.start : rows.stop : rows.step]
    poses = {}
    for body in vehicle.bodies:
        if body.name in truth.bodies:
            # A mount is counted ahead from its body, and to the side and up from the rails.
            mount = Mount("centre", body.name, (0.0, *body.position_m[1:]))
            poses[body.name] = bare.motion(mount, rows, POSE).to_numpy(dtype=np.float64)
    turns = {name: _at(truth.time_s, np.asarray(angle), time) for name, angle in truth.wheel_angles.items()}
    contacts = {
        name: _at(truth.time_s[:: truth.contact_every], np.asarray(columns), time)
        for name, columns in truth.contacts.items()
    }
    when = seen.recording.imu.index.to_numpy(dtype=np.float64)
    angles = ("roll_rad", "pitch_rad")
    estimated = {
        name: _at(when, estimate.states[list(angles)].to_numpy(dtype=np.float64), time)
        for name, estimate in seen.estimates.items()
        if set(angles) <= set(estimate.states)
    }
    true = _at(when, seen.motion[list(angles)].to_numpy(dtype=np.float64), time)
    return Film(
        scenario=scenario.name,
        ride=cell.ride.name,
        imu=f"{Path(cell.imu.grade).stem} ({cell.imu.name})",
        engine=resolved.ride.engine,
        vehicle=vehicle,
        mount=resolved.mount,
        rails=parts.rails(cell),
        time_s=time,
        reference_m=truth.reference_position_m[rows.start : rows.stop : rows.step],
        poses=poses,
        turns_rad=turns,
        contacts=contacts,
        true_rad=true,
        estimated_rad=estimated,
        signals=_signals(seen, time, true, estimated, contacts),
        notes=_notes(truth, vehicle, contacts, cell),
    )


def _at(when: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """Values (k, ...) at other times, linear between samples."""
    if values.ndim == 1:
        return np.interp(wanted, when, values)
    return np.column_stack([np.interp(wanted, when, column) for column in values.T])


def _mean_at(signal: pd.Series, wanted: FloatArray) -> FloatArray:
    """Mean of a signal over the time of each frame: what is faster than the frames does not fold."""
    when = signal.index.to_numpy(dtype=np.float64)
    total = np.concatenate([[0.0], np.cumsum(signal.to_numpy(dtype=np.float64))])
    half = 0.5 * (wanted[1] - wanted[0])
    first = np.clip(np.searchsorted(when, wanted - half), 0, len(when) - 1)
    last = np.maximum(np.searchsorted(when, wanted + half), first + 1)
    mean: FloatArray = (total[last] - total[first]) / (last - first)
    return mean


def _signals(
    seen: CellResult,
    time: FloatArray,
    true: FloatArray,
    estimated: dict[str, FloatArray],
    contacts: dict[str, FloatArray],
) -> tuple[Signal, ...]:
    """The strips, from above."""
    degrees = np.rad2deg
    strips = []
    for column, angle in enumerate(("roll", "pitch")):
        methods = {name: degrees(values[:, column]) for name, values in estimated.items()}
        strips.append(Signal(angle, "\N{DEGREE SIGN}", 0.2, {"true": degrees(true[:, column])}, methods))
    errors = {name: degrees(values[:, 0] - true[:, 0]) for name, values in estimated.items()}
    strips.append(Signal("error of roll", "\N{DEGREE SIGN}", 0.05, {}, errors))
    imu = seen.recording.imu
    sideways = {"IMU, mean of each frame": _mean_at(imu["accel_y_mps2"], time)}
    strips.append(Signal("accel y", "m/s\N{SUPERSCRIPT TWO}", 0.1, sideways, {}))
    turning = {"IMU, mean of each frame": degrees(_mean_at(imu["gyro_z_radps"], time))}
    strips.append(Signal("turn rate z", "\N{DEGREE SIGN}/s", 0.1, turning, {}))
    when = seen.motion.index.to_numpy(dtype=np.float64)
    speed = 3.6 * _at(when, seen.motion["speed_mps"].to_numpy(dtype=np.float64), time)
    strips.append(Signal("speed", "km/h", 5.0, {"true": speed}, {}))
    if contacts:
        axle = next(iter(contacts)).partition(".")[0]
        guiding = {
            name.partition(".")[2]: 1e-3 * values[:, CONTACT.index("guiding_force_n")]
            for name, values in contacts.items()
            if name.startswith(f"{axle}.")
        }
        strips.append(Signal(f"Y of axle {axle}", "kN", 0.1, guiding, {}))
    return tuple(strips)


def _notes(
    truth: Truth, vehicle: VehicleModel, contacts: dict[str, FloatArray], cell: Cell
) -> tuple[str, ...]:
    notes = [
        "Boxes are drawn from masses and moments of inertia, since a model has no other shape: it is "
        "a picture of the model, not of a car.",
        f"Poses {FRAME_HZ:g} times a second by the engine, between them straight lines.",
    ]
    if vehicle.synthetic:
        notes.append("The figures of the vehicle are synthetic.")
    if truth.short_waves is not None:
        notes.append(
            "What shakes by short waves is in the signals of the IMU, not in the poses and not in the forces."
        )
    if not contacts:
        notes.append(f"This ride kept no contact forces ({cell.spec.engine} engine): none are shown.")
    return tuple(notes)
