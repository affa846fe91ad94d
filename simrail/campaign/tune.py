"""Tuning the trajectory smoother on the rides of a scenario: what ``simrail tune`` does.

Simulates (or finds in the cache) the rides, draws the sensors as a campaign would, and searches. The rails of
a known output are those that were laid: a measured reference without error.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.campaign.cell import record_cell
from simrail.campaign.progress import Watcher
from simrail.core.errors import InputError
from simrail.core.interrupts import interruptible
from simrail.core.toml_files import blame
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Tuning
from simrail.estimators.tuning.identify import Identification, identify
from simrail.estimators.tuning.objectives import KINDS, objective_of
from simrail.estimators.tuning.space import SearchSpace
from simrail.estimators.tuning.tune import tune
from simrail.recording.recording import Recording
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import EstimatorPart, Scenario
from simrail.track.bands import SAMPLES_PER_WAVE, Band

METHODS = ("cml", "kom")


@dataclass(frozen=True)
class Tuned:
    """A tuning, the file that it was written into, and what it knows, by set: ``all``, or one of `KINDS`."""

    tuning: Tuning
    file: Path
    identified: dict[str, Identification]


def tune_scenario(
    scenario: Scenario,
    out: Path,
    *,
    estimator: str,
    method: str,
    rides: Sequence[str] = (),
    draws: int = 1,
    imu: str | None = None,
    space: SearchSpace | None = None,
    by_kind: bool = False,
    band: str | None = None,
    within_m: tuple[float, float] | None = None,
    step_m: float = 0.25,
    evaluations: int = 480,
    at_most: int | None = None,
    command: str = "",
    watcher: Watcher | None = None,
) -> Tuned:
    """Tune an estimator of a scenario and write the result.

    Parameters
    ----------
    scenario : Scenario
        As read. Of every list the first value is used.
    out : Path
        File of the tuning. A former tuning is replaced when the new one is there. What has been found before
        lies beside it, and an interrupted search with the same arguments goes on from there.
    estimator : str
        Name of the estimator in the scenario, a trajectory smoother, or ``"TrajectorySmoother"`` for one
        without options. Options hold, but a tuning that they name is not read: it may be the one that is made
        here.
    method : str
        ``"cml"`` or ``"kom"``.
    rides : sequence of str
        Names of the rides to fit on, together; all of them if none is named.
    draws : int
        How many draws of each ride to fit on, of different tracks as long as there are such. One ride alone
        has too few waves, and one set of sensor biases, to know thirteen parameters by its rails.
    imu : str, optional
        Name of the IMU; the first if not given.
    space : SearchSpace, optional
        Where to search; the paper's if not given.
    by_kind : bool
        One set for straights and one for transitions and curves.
    band, within_m, step_m
        KOM compares in this band (of those that the scenario scores), between these places, and at places
        this far apart.
    evaluations : int
        Of CMA-ES.
    at_most : int, optional
        Evaluations of the whole search of each set.
    command : str
        What to write into the file as the command that makes it.
    watcher : Watcher, optional
        Is told how it goes.

    Raises
    ------
    InputError
        If the scenario cannot be run, or has no such ride, IMU, smoother or number of draws; if the file is
        no tuning.
    KeyboardInterrupt
        If interrupted; the search can be gone on with.
    """
    if method not in METHODS:
        raise InputError("no such method", field="--method", value=method, limit="cml or kom")
    if method == "cml" and (band is not None or within_m is not None):
        field = "--band" if band is not None else "--within"
        raise InputError("belongs to a known output", field=field, remedy="use --method kom, or leave it out")
    if evaluations < 0:
        raise InputError("is out of range", field="--evaluations", value=evaluations, limit=">= 0")
    if at_most is not None and at_most < 1:
        raise InputError("is out of range", field="--at-most", value=at_most, limit=">= 1")
    _judge_file(out)
    watcher = watcher or Watcher()
    scenario = alone(scenario, estimator)
    parts = Parts(scenario)
    smoother = smoother_of(scenario, parts, estimator)
    chosen = chosen_cells(scenario, rides, imu, draws=draws)
    wanted = None if band is None else _band(parts.resolve(chosen[0]).bands, band, step_m=step_m)
    recordings, references = [], []
    with interruptible() as check:
        for number, cell in enumerate(chosen, start=1):
            watcher.ride_begins(number, len(chosen), cell.ride.name)
            try:
                truth = simulate(parts.ride(cell), progress=watcher.ride_goes)
            except Exception:
                check()  # an engine in C++ may have made an error of its own of Ctrl-C
                raise
            watcher.ride_ends()
            recordings.append(record_cell(cell, truth, parts))
            if method == "kom":
                references.append(reference_of(cell, parts, within_m, step_m))
        space = SearchSpace() if space is None else space
        rails = references if method == "kom" else None
        with blame(scenario.file, "tuning"):
            found = tune(
                recordings,
                smoother,
                references=rails,
                space=space,
                by_kind=by_kind,
                band=wanted,
                step_m=step_m,
                evaluations=evaluations,
                at_most=at_most,
                seed=scenario.spec.seed,
                unfinished=unfinished(out),
                progress=watcher.search_goes,
                fitted_on=[_words(scenario, *pair) for pair in zip(chosen, recordings, strict=True)],
                command=command,
            )
        sets = {name: kind for kind, name in enumerate(KINDS)} if by_kind else {"all": None}
        values = [found.hyperparameters, found.curve_hyperparameters]
        identified = {}
        for (name, kind), parameters in zip(sets.items(), values, strict=False):
            goal = objective_of(recordings, smoother, kind=kind, references=rails, band=wanted, step_m=step_m)
            assert parameters is not None
            identified[name] = identify(goal, parameters, space)
    known = [dict(judged.table["status"]) for judged in identified.values()]
    found = replace(found, status=known[0], curve_status=known[1] if by_kind else None)
    found.write(out)
    return Tuned(found, out, identified)


def unfinished(out: Path) -> Path:
    """File of the best so far beside that of the result."""
    return out.with_name(f"{out.stem}.unfinished.toml")


def alone(scenario: Scenario, estimator: str) -> Scenario:
    """The scenario with one estimator, without its tuning; the others only keep places, for messages."""
    spec = scenario.spec
    names = [part.name for part in spec.estimator]
    own = () if estimator in names else (EstimatorPart(name=estimator, method=estimator),)
    if own and estimator != TrajectorySmoother.__name__:
        raise InputError(
            "the scenario has no such estimator",
            file=scenario.file,
            field="--estimator",
            value=estimator,
            limit="one of " + ", ".join([*names, TrajectorySmoother.__name__]),
        )
    parts = [
        part.model_copy(update={"options": {k: v for k, v in part.options.items() if k != "tuning"}})
        if part.name == estimator
        else EstimatorPart(name=part.name, method="DesignAngles")
        for part in spec.estimator
    ]
    parts += own
    return replace(scenario, spec=spec.model_copy(update={"estimator": parts}))


def smoother_of(scenario: Scenario, parts: Parts, estimator: str) -> TrajectorySmoother:
    """The smoother of that name, in a scenario that has been judged."""
    made = judge_scenario(scenario, parts).estimators
    found = {name: value for name, value in made.items() if name.split("[")[0] == estimator}
    if len(found) > 1:
        raise InputError(
            "has variants, and one can be tuned",
            file=scenario.file,
            field="--estimator",
            value=", ".join(found),
            remedy=f"choose one with --set estimator.{estimator}.options.NAME=VALUE",
        )
    (smoother,) = found.values()
    if not isinstance(smoother, TrajectorySmoother):
        raise InputError(
            "is no trajectory smoother, and has nothing to tune",
            file=scenario.file,
            field="--estimator",
            value=estimator,
            limit="an estimator whose method is TrajectorySmoother",
        )
    return smoother


def chosen_cells(scenario: Scenario, rides: Iterable[str], imu: str | None, *, draws: int = 1) -> list[Cell]:
    """First cells of each ride that is wanted, in the scenario's order, those of new tracks first."""
    spec = scenario.spec
    for field, wanted, known in (
        ("--ride", list(rides), [part.name for part in spec.ride]),
        ("--imu", [] if imu is None else [imu], [part.name for part in spec.imu]),
    ):
        for name in wanted:
            if name not in known:
                raise InputError(
                    "the scenario has none of this name",
                    file=scenario.file,
                    field=field,
                    value=name,
                    limit="one of " + ", ".join(known),
                )
    names = set(rides) or {part.name for part in spec.ride}
    mount = spec.imu[0].name if imu is None else imu
    found: dict[str, list[Cell]] = {}
    for cell in cells(scenario):
        if cell.ride.name in names and cell.imu.name == mount:
            of_ride = found.setdefault(cell.ride.name, [])
            if not of_ride or cell.case == of_ride[0].case:
                of_ride.append(cell)
    if draws < 1:
        raise InputError("is out of range", field="--draws", value=draws, limit=">= 1")
    least = min(len(of_ride) for of_ride in found.values())
    if draws > least:
        raise InputError(
            "the scenario does not draw so often",
            file=scenario.file,
            field="--draws",
            value=draws,
            limit=f"1 to {least}",
            remedy="for more, --set monte_carlo.track_draws=N",
        )
    for of_ride in found.values():
        of_ride.sort(key=lambda cell: (cell.sample, cell.sensor_draw, cell.track_draw))
    return [cell for of_ride in found.values() for cell in of_ride[:draws]]


def reference_of(
    cell: Cell, parts: Parts, within_m: tuple[float, float] | None, step_m: float
) -> pd.DataFrame:
    """The rails of a cell over ``position_m``, between two places."""
    track = parts.track(cell)
    first, last = (track.start_m, track.end_m) if within_m is None else within_m
    if not track.start_m <= first < last <= track.end_m:
        raise InputError(
            "is not on the track",
            field="--within",
            value=[first, last],
            limit=f"{track.start_m:g} to {track.end_m:g} m, the smaller first",
        )
    place = np.linspace(first, last, max(2, round((last - first) / step_m) + 1))
    return parts.rails(cell).irregularities(place)


def _band(bands: Sequence[Band], name: str, *, step_m: float) -> Band:
    known = {band.name: band for band in bands}
    if name not in known:
        raise InputError("no such band", field="--band", value=name, limit="one of " + ", ".join(known))
    coarsest = known[name].shortest_m / SAMPLES_PER_WAVE
    if step_m > coarsest:
        raise InputError(
            f"is too coarse for the band {name}", field="--step", value=step_m, limit=f"<= {coarsest:g} m"
        )
    return known[name]


def _words(scenario: Scenario, cell: Cell, recording: Recording) -> str:
    return (
        f"{scenario.name}: {cell.ride.name}, {cell.imu.name} on {cell.imu.body}, "
        f"{Path(cell.imu.grade).stem}, odometry {recording.odometry_source}, {len(recording.imu)} samples"
        + (
            f", draw {cell.sensor_draw} on track {cell.track_draw}"
            if cell.track_draw or cell.sensor_draw
            else ""
        )
    )


def _judge_file(out: Path) -> None:
    """Refuse to replace what is no tuning, or to write where nothing can be written."""
    if out.suffix != ".toml":
        raise InputError(
            "is no TOML file", field="--out", value=str(out), limit="a name that ends with .toml"
        )
    if not out.absolute().parent.is_dir():
        raise InputError("no such folder", field="--out", value=str(out), remedy="make the folder first")
    if not os.access(out.absolute().parent, os.W_OK):
        raise InputError(
            "the folder cannot be written", field="--out", value=str(out), remedy="choose another"
        )
    if out.exists():
        try:
            Tuning.from_file(out)
        except InputError as error:
            raise InputError(
                "is no tuning, and would be replaced",
                field="--out",
                value=str(out),
                remedy="choose another file with --out",
            ) from error


def command_of(words: Sequence[str]) -> str:
    """A command line, quoted where a shell needs it."""
    return shlex.join(["simrail", "tune", *words])
