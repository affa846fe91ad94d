"""What a campaign will cost, measured on a short beginning of its own rides.

A rehearsal simulates some seconds of a ride with the scenario's own engine, records them, runs every
estimator on them and scores it, as the campaign would. Costs of a recording are taken at two lengths,
so that what a call costs at all and what a sample costs come apart. Simulated beginnings stay in the
ride cache, hence a second plan is there at once.

These are measurements of a moment on a machine that may be busy: they make an estimate, no promise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import pandas as pd

from simrail.campaign.cell import figures_of, kept_of, record_cell
from simrail.estimation.estimate import Estimator
from simrail.recording.recording import Recording, beginning
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts, mount_of
from simrail.scenario.cells import Cell
from simrail.scoring.score import Reference, reference_of, score_odometry, truth_at_imu
from simrail.scoring.windows import chosen_windows
from simrail.vehicle.speed_profile import SpeedProfile

RIDDEN_S = 5.0
"""A beginning is as long as the train rides in this time at its speed, start and stop besides."""

RESTED_S = 2.0
REPEATS = 3

KINEMATIC_REAL_TIME = 300.0
"""Simulated over wall time of the kinematic engine, which keeps no record of it: recorded on two cores of
a virtual machine, bogie with four bodies; of small weight in any campaign."""

_Result = TypeVar("_Result")


@dataclass(frozen=True)
class Cost:
    """Seconds of processor time: of a call at all, and of each sample."""

    call_s: float
    sample_s: float

    def of(self, samples: float) -> float:
        """Seconds for a recording of so many samples."""
        return self.call_s + self.sample_s * samples


@dataclass(frozen=True)
class EngineCost:
    """What simulating costs.

    Attributes
    ----------
    real_time_factor : float
        Simulated over wall time.
    setup_s : float
        Wall time before the first step: track and tables.
    bytes_per_s : float
        Size on disk of a simulated second.
    """

    real_time_factor: float
    setup_s: float
    bytes_per_s: float


@dataclass(frozen=True)
class CellCost:
    """What a recording costs.

    Attributes
    ----------
    motion_s : float
        Of the motion of the mount, for each simulated second, once in a ride.
    measure : Cost
        Sensors, odometry and its score.
    methods : dict of str to Cost
        Estimate and score, by the estimator's name.
    rows : int
        Rows of the score table of one cell.
    windows : int
        Windows that they are spread over.
    failed : dict of str to str
        Estimators that could not be rehearsed, with the reason: they may need a longer ride.
    """

    motion_s: float
    measure: Cost
    methods: dict[str, Cost]
    rows: int
    windows: int
    failed: dict[str, str]


def rehearse_engine(cell: Cell, parts: Parts) -> tuple[EngineCost, Truth]:
    """Simulate the beginning of a cell's ride."""
    ride = _beginning_of(parts.ride(cell))
    truth = simulate(ride)
    seconds = max(float(truth.time_s[-1]), 1e-3)
    place = ride_cache.folder() / ride_cache.key_of(ride.describe())
    size = sum(file.stat().st_size for file in place.iterdir()) if place.exists() else 0
    said = truth.manifest
    return EngineCost(
        real_time_factor=float(said.get("real_time_factor", KINEMATIC_REAL_TIME)),
        setup_s=float(said.get("setup_s", 0.0)),
        bytes_per_s=size / seconds,
    ), truth


def rehearse_cell(cell: Cell, truth: Truth, parts: Parts) -> CellCost:
    """Record, estimate and score on the beginning of a ride, as the campaign does."""
    keep = kept_of(cell)
    recording = record_cell(cell, truth, parts)
    motion = truth_at_imu(truth, recording)

    def measured() -> pd.DataFrame:
        recorded = record_cell(cell, truth, parts)
        return score_odometry(recorded, reference_of(truth_at_imu(truth, recorded), recorded), **keep)

    seconds, figures = _timed(measured)
    moving, _ = _timed(lambda: truth.motion(mount_of(cell)))
    rows = len(figures)
    lengths = (len(recording.imu), max(len(recording.imu) // 4, 64))
    recordings = [recording, beginning(recording, samples=lengths[1])]
    references = [reference_of(motion.iloc[: len(part.imu)], part) for part in recordings]
    methods: dict[str, Cost] = {}
    failed: dict[str, str] = {}
    for name, estimator in parts.estimators(cell.sample).items():
        try:
            _judged(cell, estimator, recordings[1], references[1], parts)  # compiles, or loads from disk
            (long, tables), (short, _) = (
                _timed(lambda i=i, e=estimator: _judged(cell, e, recordings[i], references[i], parts))  # type: ignore[misc]
                for i in (0, 1)
            )
        except Exception as error:  # a person's own estimator may raise anything
            failed[name] = f"{type(error).__name__}: {' '.join(str(error).split())}"[:200]
            continue
        rows += sum(len(table) for table in tables)
        sample_s = max(long - short, 0.0) / max(lengths[0] - lengths[1], 1)
        methods[name] = Cost(max(short - sample_s * lengths[1], 0.0), sample_s)
    return CellCost(
        # The motion of the mount is worked out once in a ride, here twice in a call.
        measure=Cost(0.0, max(seconds - 2.0 * moving, 0.0) / lengths[0]),
        motion_s=moving / max(float(truth.time_s[-1]), 1e-3),
        methods=methods,
        rows=rows,
        windows=len(chosen_windows(references[0].windows, keep["windows"])),
        failed=failed,
    )


def _judged(
    cell: Cell, estimator: Estimator, recording: Recording, reference: Reference, parts: Parts
) -> list[pd.DataFrame]:
    return figures_of(cell, estimator.estimate(recording), reference, recording, 1.0, parts)


def _timed(call: Callable[[], _Result]) -> tuple[float, _Result]:
    """Least processor time of some calls, and what the last one returned."""
    best = float("inf")
    for _ in range(REPEATS):
        begun = time.process_time()
        result = call()
        best = min(best, time.process_time() - begun)
    return best, result


def _beginning_of(ride: Ride) -> Ride:
    """The same ride, stopped after some seconds."""
    whole = ride.profile
    profile: SpeedProfile
    if whole.start_m == whole.end_m:
        profile = replace(whole, rest_s=min(whole.rest_s, RIDDEN_S), final_rest_s=1.0)
    else:
        way = min(abs(whole.end_m - whole.start_m), RIDDEN_S * whole.speed_mps)
        end = whole.start_m + whole.direction * way
        profile = replace(whole, end_m=end, stops=(), rest_s=min(whole.rest_s, RESTED_S), final_rest_s=1.0)
    return replace(ride, name=f"{ride.name} (rehearsal)", profile=profile)
