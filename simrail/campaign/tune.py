"""Tuning an estimator on the rides of a scenario: what ``simrail tune`` does.

Simulates (or finds in the cache) the rides, draws the sensors as a campaign would, and searches. The rails of
a known output are those that were laid: a measured reference without error. What is tuned is any estimator
that says what there is to search (`simrail.estimation.tunable`).
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.campaign.cell import record_cell, simulated
from simrail.campaign.progress import Watcher
from simrail.core.atomic_files import can_be_made
from simrail.core.errors import InputError, one_of
from simrail.core.interrupts import interruptible
from simrail.core.toml_files import blame
from simrail.estimation.estimate import Estimator, registered
from simrail.estimation.tunable import Tunable, tunables_of
from simrail.estimators.tuning.cube import Cube
from simrail.estimators.tuning.file import TuningResult
from simrail.estimators.tuning.identify import identify
from simrail.estimators.tuning.tune import objective_of, tune
from simrail.recording.recording import Recording
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import Scenario
from simrail.scenario.study_tables import EstimatorPart
from simrail.track.bands import SAMPLES_PER_WAVE, Band

STEP_M = 0.25
"""Distance of the places of a reference, unless another is given."""

MOST_PLACES = 10_000_000
"""Of a reference of the rails."""


def tune_scenario(
    scenario: Scenario,
    out: Path,
    *,
    estimator: str,
    method: str,
    rides: Sequence[str] = (),
    draws: int = 1,
    imu: str | None = None,
    within_m: tuple[float, float] | None = None,
    settings: Mapping[str, Any] | None = None,
    evaluations: int = 480,
    at_most: int | None = None,
    command: str = "",
    watcher: Watcher | None = None,
) -> tuple[TuningResult, dict[str, pd.DataFrame]]:
    """Tune an estimator of a scenario and write the result.

    Parameters
    ----------
    scenario : Scenario
        As read. Of every list the first value is used.
    out : Path
        File of the tuning. A former tuning is replaced when the new one is there. What has been found before
        lies beside it, and an interrupted search with the same arguments goes on from there.
    estimator : str
        Name of the estimator in the scenario; or, for one without options, a registered name or
        ``"file.py:Class"``. Options hold, but a tuning that they name is not read: it may be the one that is
        made here.
    method : str
        ``"cml"`` or ``"kom"``.
    rides : sequence of str
        Names of the rides to fit on, together; all of them if none is named.
    draws : int
        How many draws of each ride to fit on, of different tracks as long as there are such. One ride alone
        has too few waves, and one set of sensor biases, to know thirteen parameters by its rails.
    imu : str, optional
        Name of the IMU; the first if not given.
    within_m : (float, float), optional
        The reference of KOM lies between these places.
    settings : mapping, optional
        Settings of the search that are the estimator's own. Of those, ``band``, by its name, is one of the
        bands that the scenario scores, and ``step_m`` is also the distance of the reference's places.
    evaluations : int
        Of CMA-ES.
    at_most : int, optional
        Evaluations of the whole search of each set.
    command : str
        What to write into the file as the command that makes it.
    watcher : Watcher, optional
        Is told how it goes.

    Returns
    -------
    result : TuningResult
        What the search found, as it was written into the file.
    identified : dict of str to DataFrame
        What it knows of each parameter, by set of parameters.

    Raises
    ------
    InputError
        If the scenario cannot be run, or has no such ride, IMU, estimator or number of draws; if the
        estimator has nothing to tune by this method; if the file is no tuning.
    KeyboardInterrupt
        If interrupted; the search can be gone on with.
    """
    chosen_settings = dict(settings or {})
    band, step_m = chosen_settings.get("band"), float(chosen_settings.get("step_m", STEP_M))
    if method == "cml" and (band is not None or within_m is not None):
        field = "--band" if band is not None else "--within"
        value = band if band is not None else within_m
        raise InputError(
            "belongs to a known output",
            field=field,
            value=value,
            limit="--method kom",
            remedy="use --method kom, or leave it out",
        )
    if within_m is not None and not within_m[0] < within_m[1]:
        given, limit = list(within_m), "two places, m, the smaller first"
        raise InputError("is no range", field="--within", value=given, limit=limit, remedy="swap them")
    _judge_numbers(evaluations, at_most, draws)
    _judge_file(out)
    watcher = watcher or Watcher()
    scenario = alone(scenario, estimator)
    parts = Parts(scenario)
    tuned_estimator = estimator_named(scenario, parts, estimator)
    chosen = chosen_cells(scenario, rides, imu, draws=draws)
    if band is not None:
        chosen_settings["band"] = _band(parts.resolve(chosen[0]).bands, band, step_m=step_m)
    tunables = tunables_of(tuned_estimator, chosen_settings, method=method)
    recordings, references = _rides(chosen, parts, watcher, within_m=within_m, step_m=step_m)
    with blame(scenario.file, "tuning"):
        return _searched(
            tunables,
            recordings,
            references if method == "kom" else None,
            out,
            evaluations=evaluations,
            at_most=at_most,
            seed=scenario.spec.seed,
            fitted_on=[_words(scenario, *pair) for pair in zip(chosen, recordings, strict=True)],
            command=command,
            watcher=watcher,
        )


def tune_recordings(
    recordings: Sequence[Recording],
    out: Path,
    *,
    estimator: Estimator,
    settings: Mapping[str, Any] | None = None,
    evaluations: int = 480,
    at_most: int | None = None,
    seed: int = 1,
    command: str = "",
    watcher: Watcher | None = None,
) -> tuple[TuningResult, dict[str, pd.DataFrame]]:
    """Tune an estimator on recorded rides by their likelihood, which needs no known rails.

    Parameters
    ----------
    recordings : sequence of Recording
        Rides to fit on, together.
    out : Path
        File of the tuning; see `tune_scenario`.
    estimator : Estimator
        What is tuned. What it searches where `settings` say nothing is its own matter: a verb
        ``usual_search(recordings)``, if it has one, returns its settings.
    settings : mapping, optional
        Settings of the search that are the estimator's own.
    evaluations, at_most, seed, command, watcher
        See `tune_scenario`.

    Returns
    -------
    result, identified
        See `tune_scenario`.

    Raises
    ------
    InputError
        If the estimator has nothing to tune by likelihood, or the file is no tuning.
    KeyboardInterrupt
        If interrupted; the search can be gone on with.
    """
    _judge_numbers(evaluations, at_most, 1)
    _judge_file(out)
    usual = getattr(estimator, "usual_search", None)
    chosen = ({} if usual is None else dict(usual(recordings))) | dict(settings or {})
    return _searched(
        tunables_of(estimator, chosen, method="cml"),
        recordings,
        None,
        out,
        evaluations=evaluations,
        at_most=at_most,
        seed=seed,
        fitted_on=[
            f"recorded ride {one.name}: {one.mount} on {one.mount_body}, odometry "
            f"{one.odometry_source or 'none'}, {len(one.imu)} samples"
            for one in recordings
        ],
        command=command,
        watcher=watcher or Watcher(),
    )


def _searched(
    tunables: Mapping[str, Tunable],
    recordings: Sequence[Recording],
    rails: Sequence[pd.DataFrame] | None,
    out: Path,
    *,
    evaluations: int,
    at_most: int | None,
    seed: int,
    fitted_on: Sequence[str],
    command: str,
    watcher: Watcher,
) -> tuple[TuningResult, dict[str, pd.DataFrame]]:
    """Search, judge what was found, and write it."""
    with interruptible():
        result = tune(
            tunables,
            recordings,
            references=rails,
            evaluations=evaluations,
            at_most=at_most,
            seed=seed,
            unfinished=unfinished(out),
            forecast=watcher.search_begins,
            progress=watcher.search_goes,
            fitted_on=fitted_on,
            command=command,
        )
        identified = {
            name: identify(
                objective_of(tunable, recordings, rails), values, Cube(tuple(tunable.parameters()))
            )
            for (name, tunable), values in zip(tunables.items(), result.values, strict=True)
        }
    result = replace(result, status=tuple(dict(table["status"]) for table in identified.values()))
    result.write(out)
    return result, identified


def _rides(
    chosen: Sequence[Cell],
    parts: Parts,
    watcher: Watcher,
    *,
    within_m: tuple[float, float] | None,
    step_m: float,
) -> tuple[list[Recording], list[pd.DataFrame]]:
    """Recordings of cells, and the rails below them."""
    recordings, references = [], []
    for number, cell in enumerate(chosen, start=1):
        references.append(reference_of(cell, parts, within_m, step_m))
        truth = simulated(cell, parts, watcher, number, len(chosen))
        recordings.append(record_cell(cell, truth, parts))
    return recordings, references


def unfinished(out: Path) -> Path:
    """File of the best so far beside that of the result."""
    return out.with_name(f"{out.stem}.unfinished.toml")


def alone(scenario: Scenario, estimator: str) -> Scenario:
    """The scenario with one estimator, without its tuning; the others only keep places, for messages."""
    spec = scenario.spec
    names = [part.name for part in spec.estimator]
    if estimator not in names and estimator not in registered() and ".py:" not in estimator:
        raise InputError(
            "the scenario has no such estimator",
            file=scenario.file,
            field="--estimator",
            value=estimator,
            limit=f"one of {', '.join(names)}; registered: {', '.join(registered())}; or FILE.py:CLASS",
        )
    parts = [
        part.model_copy(update={"options": {k: v for k, v in part.options.items() if k != "tuning"}})
        if part.name == estimator
        else EstimatorPart(name=part.name, method="DesignAngles")
        for part in spec.estimator
    ]
    if estimator not in names:
        parts.append(EstimatorPart(name=_name(estimator), method=estimator))
    return replace(scenario, spec=spec.model_copy(update={"estimator": parts}))


def _name(estimator: str) -> str:
    """Name of an estimator that is none of the scenario's: its class."""
    return estimator.rpartition(":")[2]


def estimator_named(scenario: Scenario, parts: Parts, estimator: str) -> Estimator:
    """The estimator of that name, in a scenario that has been judged."""
    made = judge_scenario(scenario, parts).estimators
    variants = {name: value for name, value in made.items() if name.split("[")[0] == _name(estimator)}
    if len(variants) > 1:
        raise InputError(
            "has variants, and one can be tuned",
            file=scenario.file,
            field="--estimator",
            value=", ".join(variants),
            remedy=f"choose one with --set estimator.{estimator}.options.NAME=VALUE",
            limit="one of them",
        )
    (only,) = variants.values()
    return only


def chosen_cells(scenario: Scenario, rides: Iterable[str], imu: str | None, *, draws: int = 1) -> list[Cell]:
    """First cells of each ride that is wanted, in the scenario's order, those of new tracks first."""
    spec = scenario.spec
    for field, wanted, named in (
        ("--ride", list(rides), [part.name for part in spec.ride]),
        ("--imu", [] if imu is None else [imu], [part.name for part in spec.imu]),
    ):
        for name in wanted:
            one_of(name, named, "the scenario has none of this name", field=field, file=scenario.file)
    names = set(rides) or {part.name for part in spec.ride}
    mount = spec.imu[0].name if imu is None else imu
    by_ride: dict[str, list[Cell]] = {}
    one_by_one = replace(scenario, spec=spec.model_copy(update={"passes": None}))
    for cell in cells(one_by_one):
        if cell.ride.name in names and cell.imu.name == mount:
            of_ride = by_ride.setdefault(cell.ride.name, [])
            if not of_ride or cell.case == of_ride[0].case:
                of_ride.append(cell)
    least = min(len(of_ride) for of_ride in by_ride.values())
    if draws > least:
        raise InputError(
            "the scenario does not draw so often",
            file=scenario.file,
            field="--draws",
            value=draws,
            limit=f"1 to {least}",
            remedy="for more, --set monte_carlo.track_draws=N",
        )
    for of_ride in by_ride.values():
        of_ride.sort(key=lambda cell: (cell.sample, cell.sensor_draw, cell.track_draw))
    return [cell for of_ride in by_ride.values() for cell in of_ride[:draws]]


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
            remedy="give places within the limit",
        )
    if (last - first) / step_m > MOST_PLACES:
        raise InputError(
            "gives too many places",
            field="--step",
            value=step_m,
            limit=f">= {(last - first) / MOST_PLACES:.3g} m, {MOST_PLACES:,} places",
            remedy="take a longer step, or a shorter --within",
        )
    place = np.linspace(first, last, max(2, round((last - first) / step_m) + 1))
    return parts.rails(cell).irregularities(place)


def _band(bands: Sequence[Band], name: str, *, step_m: float) -> Band:
    by_name = {band.name: band for band in bands}
    one_of(name, by_name, "no such band", field="--band")
    coarsest = by_name[name].shortest_m / SAMPLES_PER_WAVE
    if step_m > coarsest:
        raise InputError(
            f"is too coarse for the band {name}", field="--step", value=step_m, limit=f"<= {coarsest:g} m"
        )
    return by_name[name]


def _words(scenario: Scenario, cell: Cell, recording: Recording) -> str:
    first = cell.track_draw == cell.sensor_draw == 0
    return (
        f"{scenario.name}: {cell.ride.name}, {cell.imu.name} on {cell.imu.body}, "
        f"{Path(cell.imu.grade).stem}, odometry {recording.odometry_source}, {len(recording.imu)} samples"
        + ("" if first else f", draw {cell.sensor_draw} on track {cell.track_draw}")
    )


def _judge_numbers(evaluations: int, at_most: int | None, draws: int) -> None:
    """Refuse numbers of a search that are none."""
    for field, number, least in (
        ("--evaluations", evaluations, 0),
        ("--at-most", at_most, 1),
        ("--draws", draws, 1),
    ):
        if number is not None and number < least:
            raise InputError("is out of range", field=field, value=number, limit=f">= {least}")


def _judge_file(out: Path) -> None:
    """Refuse to replace what is no tuning, or to write where nothing can be written."""
    folder = out.absolute().parent

    def refusal(problem: str, *, limit: str | None = None, remedy: str | None = None) -> InputError:
        return InputError(problem, field="--out", value=str(out), limit=limit, remedy=remedy)

    if out.suffix != ".toml":
        limit, remedy = "a name that ends with .toml", "call it so"
        raise refusal("is no TOML file", limit=limit, remedy=remedy)
    if not folder.is_dir():
        raise refusal("no such folder", limit="a folder that is there", remedy="make the folder first")
    if not can_be_made(out):
        raise refusal("the folder cannot be written", limit="one that can be", remedy="choose another")
    if out.exists():
        try:
            is_tuning = "hyperparameters" in tomllib.loads(out.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
            is_tuning = False
        if not is_tuning:
            raise refusal("is no tuning, and would be replaced", remedy="choose another file with --out")
