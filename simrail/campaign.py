"""The campaign loop: every cell of a scenario, from simulation to scores. There is no second one.

A cell is one recording (`simrail.scenario.cells`): a ride is simulated once and shared by its cells,
each cell draws its sensors, every estimator runs on the recording, and each estimate is scored. What
fails becomes a row with its reason and the others go on. Seeds belong to names, so the scores of a
cell do not depend on which cells ran before it.

What is gathered on the way is in `simrail.ledger`. Nothing is written here: see `simrail.results`.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from itertools import groupby
from typing import Any

import pandas as pd

from simrail.estimate import Estimate, Estimator
from simrail.example import CellResult
from simrail.interrupts import Check, interruptible
from simrail.ledger import Failure, Ledger, cell_record
from simrail.line_odometry import with_odometry
from simrail.measure import measure
from simrail.recording import Recording
from simrail.ride import is_cached, simulate
from simrail.scenario.build import (
    Parts,
    bands_of,
    earth_of,
    encoder_of,
    magnetometer_of,
    mount_of,
    rail_sensor_of,
    temperature_of,
)
from simrail.scenario.cells import Cell, cells, methods
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.scenario import Scenario
from simrail.score import reference_of, score, score_odometry, truth_at_imu
from simrail.score_geometry import score_geometry
from simrail.score_table import concat_scores
from simrail.truth import Mount, Truth
from simrail.watcher import Watcher


@dataclass(frozen=True)
class CampaignResult:
    """What a campaign found.

    Attributes
    ----------
    scores : pandas.DataFrame
        The score table, columns `simrail.score_table.SCORE_COLUMNS`.
    cells : pandas.DataFrame
        One row per cell: its labels, and the values of the scenario's axes under their dotted names.
    examples : list of CellResult
        First draw of each ride, for figures.
    rides : list of dict
        What each engine said of its run; plain values.
    wall_s : dict of str to float
        Wall time of the stages ``simulate``, ``measure``, ``estimate``, ``score``.
    failures : list of Failure
        What failed; each is a row of the scores as well.
    plan : Plan
        What was planned, with its warnings.
    """

    scores: pd.DataFrame
    cells: pd.DataFrame
    examples: list[CellResult]
    rides: list[dict[str, Any]]
    wall_s: dict[str, float]
    failures: list[Failure]
    plan: Plan


@dataclass(frozen=True)
class _RememberedTruth(Truth):
    """A truth that works out the motion of each place once: all draws of a ride ask for it again."""

    remembered: dict[Mount, pd.DataFrame] = field(default_factory=dict)

    def motion(self, mount: Mount) -> pd.DataFrame:
        """See `Truth.motion`; IMUs of any name in one place share it."""
        place = replace(mount, name="")
        if place not in self.remembered:
            self.remembered[place] = super().motion(mount)
        return self.remembered[place]


def run_campaign(scenario: Scenario, *, watcher: Watcher | None = None) -> CampaignResult:
    """Run every cell of a scenario.

    Parameters
    ----------
    scenario : Scenario
        As read by `simrail.load_scenario`.
    watcher : Watcher, optional
        Is told of the progress.

    Raises
    ------
    InputError
        If the scenario cannot be run; then nothing has been run.
    KeyboardInterrupt
        If interrupted; rides that were complete stay in the cache.
    """
    watcher = watcher or Watcher()
    parts = Parts(scenario)
    plan = judge_scenario(scenario, parts)
    chosen = {method.name: (method, plan.estimators[method.name]) for method in methods(scenario)}
    ledger = Ledger(scenario, chosen)
    records = []
    with interruptible() as check:
        for ride_number, group in groupby(cells(scenario), key=lambda cell: cell.ride_number):
            ride_cells = list(group)
            records += [cell_record(cell) for cell in ride_cells]
            watcher.ride_begins(ride_number + 1, plan.rides, ride_cells[0].ride.name)
            _run_ride(ride_cells, parts, ledger, watcher, check, plan.cells)
    return CampaignResult(
        scores=concat_scores(ledger.tables),
        cells=pd.DataFrame.from_records(records),
        examples=ledger.examples,
        rides=ledger.rides,
        wall_s=ledger.wall_s,
        failures=ledger.failures,
        plan=plan,
    )


def _run_ride(
    ride_cells: list[Cell], parts: Parts, ledger: Ledger, watcher: Watcher, check: Check, cell_count: int
) -> None:
    """Simulate one ride and run its cells."""
    first = ride_cells[0]
    try:
        with ledger.timed("simulate"):
            ride = parts.ride(first)
            found = is_cached(ride)
            begun = time.perf_counter()
            truth = simulate(ride, progress=watcher.ride_goes)
            wall = time.perf_counter() - begun
            truth = _RememberedTruth(**{entry.name: getattr(truth, entry.name) for entry in fields(Truth)})
    except Exception as error:
        check()
        for cell in ride_cells:
            for name in ledger.estimators:
                ledger.failed(cell, name, error)
        return
    watcher.ride_ends()
    said = {key: value for key, value in truth.manifest.items() if key != "versions"}
    ledger.rides.append(
        {**said, "ride": first.ride.name, "track_draw": first.track_draw, "from_cache": found, "took_s": wall}
    )
    for cell in ride_cells:
        _run_cell(cell, truth, parts, ledger, watcher, check, cell_count)


def _run_cell(
    cell: Cell,
    truth: Truth,
    parts: Parts,
    ledger: Ledger,
    watcher: Watcher,
    check: Check,
    cell_count: int,
) -> None:
    """Record one cell, run every estimator on the recording, and score."""
    keep = {"windows": cell.spec.score.windows, "metrics": cell.spec.score.metrics}
    try:
        with ledger.timed("measure"):
            recording = record_cell(cell, truth, parts)
        with ledger.timed("score"):
            motion = truth_at_imu(truth, recording)
            reference = reference_of(motion, recording)
            figures = score_odometry(recording, reference, **keep)
            ledger.scored(cell, f"odometry:{recording.odometry_source}", figures)
    except Exception as error:
        check()
        for name in ledger.estimators:
            ledger.failed(cell, name, error)
        return
    estimates: dict[str, Estimate] = {}
    count = cell_count * len(ledger.estimators)
    for i, (name, estimator) in enumerate(parts.estimators(cell.sample).items()):
        try:
            estimate, us_per_sample = _timed_estimate(estimator, recording, name, ledger)
            with ledger.timed("score"):
                figures = score(estimate, reference, recording, us_per_sample=us_per_sample, **keep)
                ledger.scored(cell, name, figures)
                if estimate.geometry is not None:
                    figures = score_geometry(
                        estimate,
                        parts.rails(cell),
                        recording,
                        bands=bands_of(cell),
                        twist_base_m=cell.spec.geometry.twist_base_m,
                        **keep,
                    )
                    ledger.scored(cell, name, figures)
            estimates[name] = estimate
            ledger.judge_finite(cell, name, estimate)
        except Exception as error:
            check()
            ledger.failed(cell, name, error)
        watcher.estimate_made(cell.number * len(ledger.estimators) + i + 1, count, name)
    ledger.show(cell, recording, motion, estimates)


def record_cell(cell: Cell, truth: Truth, parts: Parts) -> Recording:
    """Measure a cell: its sensors on its ride."""
    recording = measure(
        truth,
        name=cell.ride.name,
        mount=mount_of(cell),
        grade=parts.grade(cell),
        encoder=encoder_of(cell),
        magnetometer=magnetometer_of(cell),
        rail_sensor=rail_sensor_of(cell),
        rails=None if rail_sensor_of(cell) is None else parts.rails(cell),
        odometry="truth" if cell.spec.odometry == "truth" else "encoder",
        seed=cell.sensor_seed,
        draw=cell.sensor_draw,
        earth_rate=earth_of(cell),
        temperature=temperature_of(cell),
    )
    return with_odometry(recording, cell.spec.odometry)


def _timed_estimate(
    estimator: Estimator, recording: Recording, name: str, ledger: Ledger
) -> tuple[Estimate, float]:
    """Estimate, and the microseconds per sample that it took."""
    if name not in ledger.warm:
        # The first call of a kernel compiles it or loads it from disk: that is no property of the method.
        with ledger.timed("estimate"), suppress(Exception):
            estimator.estimate(_beginning(recording, samples=64))
        ledger.warm.add(name)
    with ledger.timed("estimate"):
        begun = time.perf_counter()
        estimate = estimator.estimate(recording)
        seconds = time.perf_counter() - begun
    return estimate, 1e6 * seconds / len(recording.imu)


def _beginning(recording: Recording, *, samples: int) -> Recording:
    """The first samples of a recording."""
    imu = recording.imu.iloc[:samples]
    encoder = recording.encoder
    if encoder is not None:
        encoder = encoder.loc[: imu.index[-1]]
    magnetic, seen = recording.magnetometer, recording.rail_displacement
    return replace(
        recording,
        imu=imu,
        encoder=encoder,
        odometry=recording.odometry.iloc[:samples],
        magnetometer=None if magnetic is None else magnetic.iloc[:samples],
        rail_displacement=None if seen is None else seen.iloc[:samples],
    )
