"""What is gathered while cells run: tables with their labels, failures, wall times.

Nothing is run here; that is done in `simrail.campaign.cell`.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimate, Estimator
from simrail.scenario.cells import Cell
from simrail.scenario.tables import RidePart
from simrail.scoring.table import failed_figures


@dataclass(frozen=True)
class Failure:
    """A cell, or one estimator on it, that failed: the reason for the table, the traceback for its author."""

    cell: int
    estimator: str
    reason: str
    trace: str


STAGES = ("simulate", "measure", "estimate", "score")


@dataclass
class Ledger:
    """What is gathered cell by cell.

    Attributes
    ----------
    scenario : str
        Name of what is run.
    estimators : mapping of str to Estimator
        By their names in the tables.
    tunings : mapping of str to str
        How each is tuned, by the same names.
    warm : set of str
        Estimators whose kernels have been compiled in this process.
    figures : list of (pandas.DataFrame, dict)
        Figures of one estimate, and their labels.
    failures : list of Failure
        What failed.
    wall_s, cpu_s : dict of str to float
        Wall time, and time of this process on the processor, of the stages `STAGES`.
    """

    scenario: str
    estimators: Mapping[str, Estimator]
    tunings: Mapping[str, str]
    warm: set[str] = field(default_factory=set)
    figures: list[tuple[pd.DataFrame, dict[str, object]]] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    wall_s: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    cpu_s: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time of a block to a stage."""
        begun, worked = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.wall_s[stage] += time.perf_counter() - begun
            self.cpu_s[stage] += time.process_time() - worked

    def failed(self, cell: Cell, estimator: str, error: Exception) -> None:
        """Note a failure as a row with its reason."""
        self.lost(cell, estimator, reason_of(error), "".join(traceback.format_exception(error)))

    def lost(self, cell: Cell, estimator: str, reason: str, trace: str) -> None:
        """Note a failure whose reason is known in words."""
        self.failures.append(Failure(cell.number, estimator, reason, trace))
        self.scored(cell, estimator, failed_figures(reason))

    def labels(self, cell: Cell, estimator: str) -> dict[str, object]:
        """Labels of a row of the score table."""
        return {
            "cell": cell.number,
            "scenario": self.scenario,
            "ride": cell.ride.name,
            "vehicle": cell.spec.vehicle,
            "mount": cell.imu.name,
            "imu": cell.imu.grade,
            "odometry": cell.spec.odometry,
            "tuning": self.tunings.get(estimator, "default"),
            "track_draw": cell.track_draw,
            "sensor_draw": cell.sensor_draw,
            "estimator": estimator,
        }

    def scored(self, cell: Cell, estimator: str, figures: pd.DataFrame) -> None:
        """Note the figures of one estimator, or of the odometry, on a cell."""
        self.figures.append((figures, self.labels(cell, estimator)))

    def judge_finite(self, cell: Cell, estimator: str, estimate: Estimate) -> None:
        """Note an estimate that is not finite: its rows say so, and it is a failure of its cell as well."""
        bad = int((~np.isfinite(estimate.states.to_numpy(dtype=np.float64))).any(axis=1).sum())
        if bad:
            reason = f"estimate not finite in {bad} of {len(estimate.states)} samples"
            self.failures.append(Failure(cell.number, estimator, reason, reason + "\n"))


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


def reason_of(error: Exception) -> str:
    """One line that says why."""
    text = " ".join(str(error).split())
    named = text if isinstance(error, InputError) else f"{type(error).__name__}: {text}"
    return named[:300]
