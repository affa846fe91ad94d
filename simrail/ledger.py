"""What a campaign gathers while it runs: tables with their labels, failures, examples, wall times.

Nothing is run here; that is the campaign loop (`simrail.campaign`).
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from simrail.errors import InputError
from simrail.estimate import Estimate, Estimator
from simrail.example import CellResult
from simrail.recording import Recording
from simrail.scenario.cells import Cell, Method
from simrail.scenario.parts import RidePart
from simrail.scenario.scenario import Scenario
from simrail.score_table import failed_figures, labelled

MOST_EXAMPLES = 6
"""Recordings that are kept for the report's figures, one per ride."""


@dataclass(frozen=True)
class Failure:
    """A cell, or one estimator on it, that failed: the reason for the table, the traceback for its author."""

    cell: int
    estimator: str
    reason: str
    trace: str


@dataclass
class Ledger:
    """What the campaign loop gathers, cell by cell.

    Attributes
    ----------
    scenario : Scenario
        What is run.
    estimators : mapping of str to (Method, Estimator)
        By their names in the tables.
    tables : list of pandas.DataFrame
        Rows of the score table, labelled.
    failures : list of Failure
        What failed.
    examples : list of CellResult
        First draw of each ride, at most `MOST_EXAMPLES` of them, for figures.
    rides : list of dict
        What each engine said of its run; plain values.
    wall_s : dict of str to float
        Wall time of the stages ``simulate``, ``measure``, ``estimate``, ``score``.
    warm : set of str
        Estimators whose kernels have been compiled.
    shown : set of int
        Numbers of the rides that have an example.
    """

    scenario: Scenario
    estimators: Mapping[str, tuple[Method, Estimator]]
    tables: list[pd.DataFrame] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    examples: list[CellResult] = field(default_factory=list)
    rides: list[dict[str, Any]] = field(default_factory=list)
    wall_s: dict[str, float] = field(
        default_factory=lambda: {"simulate": 0.0, "measure": 0.0, "estimate": 0.0, "score": 0.0}
    )
    warm: set[str] = field(default_factory=set)
    shown: set[int] = field(default_factory=set)

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the wall time of a block to a stage."""
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.wall_s[stage] += time.perf_counter() - begun

    def failed(self, cell: Cell, estimator: str, error: Exception) -> None:
        """Note a failure as a row with its reason."""
        reason = _reason(error)
        trace = "".join(traceback.format_exception(error))
        self.failures.append(Failure(cell.number, estimator, reason, trace))
        self.scored(cell, estimator, failed_figures(reason))

    def labels(self, cell: Cell, estimator: str) -> dict[str, object]:
        """Labels of a row of the score table."""
        known = self.estimators.get(estimator)
        return {
            "cell": cell.number,
            "scenario": self.scenario.name,
            "ride": cell.ride.name,
            "vehicle": cell.spec.vehicle,
            "mount": cell.imu.name,
            "imu": cell.imu.grade,
            "odometry": cell.spec.odometry,
            "tuning": known[0].tuning if known else "default",
            "track_draw": cell.track_draw,
            "sensor_draw": cell.sensor_draw,
            "estimator": estimator,
        }

    def scored(self, cell: Cell, estimator: str, figures: pd.DataFrame) -> None:
        """Note the figures of one estimator, or of the odometry, on a cell."""
        self.tables.append(labelled(figures, self.labels(cell, estimator)))

    def judge_finite(self, cell: Cell, estimator: str, estimate: Estimate) -> None:
        """Note an estimate that is not finite: its rows say so, and it is a failure of its cell as well."""
        bad = int((~np.isfinite(estimate.states.to_numpy(dtype=np.float64))).any(axis=1).sum())
        if bad:
            reason = f"estimate not finite in {bad} of {len(estimate.states)} samples"
            self.failures.append(Failure(cell.number, estimator, reason, reason + "\n"))

    def show(
        self, cell: Cell, recording: Recording, motion: pd.DataFrame, estimates: dict[str, Estimate]
    ) -> None:
        """Keep a cell for the figures if it is the first of its ride, up to `MOST_EXAMPLES`."""
        first_of_ride = cell.track_draw == cell.sample == 0 and cell.ride_number not in self.shown
        if first_of_ride and len(self.examples) < MOST_EXAMPLES:
            self.shown.add(cell.ride_number)
            described = {**self.labels(cell, ""), **cell_record(cell)}
            del described["estimator"], described["tuning"]
            self.examples.append(CellResult(described, recording, motion, estimates))


def cell_record(cell: Cell) -> dict[str, object]:
    """Row of the table of cells: labels, what is worth knowing of the ride, and the axes' values."""
    record: dict[str, object] = {
        "cell": cell.number,
        "case": cell.case,
        "ride": cell.ride.name,
        "vehicle": cell.spec.vehicle,
        "mount": cell.imu.name,
        "imu": cell.imu.grade,
        "odometry": cell.spec.odometry,
        "sample": cell.sample,
        "track_draw": cell.track_draw,
        "sensor_draw": cell.sensor_draw,
        "track": cell.spec.track,
        "engine": cell.spec.engine,
        "speed_kmh": cell.ride.speed_kmh or 0.0,
        "direction": _direction(cell.ride),
    }
    return record | {name: value for name, value in cell.settings.items() if name not in record}


def _direction(ride: RidePart) -> str:
    """Whether a ride runs towards larger s, smaller s, or not at all."""
    if ride.end_m is None:
        return "standing"
    return "forward" if ride.end_m > ride.start_m else "backward"


def _reason(error: Exception) -> str:
    """One line that says why."""
    text = " ".join(str(error).split())
    named = text if isinstance(error, InputError) else f"{type(error).__name__}: {text}"
    return named[:300]
