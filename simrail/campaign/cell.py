"""Cells that share a ride: their sensors drawn, every estimator run on the recordings, each estimate scored.

What fails becomes a row with its reason and the others go on. Seeds belong to names, so the scores of
a cell do not depend on which cells ran before it, or with it. Who runs which cells together, and
where, is decided in `simrail.campaign.campaign`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import pandas as pd

from simrail.campaign.example import CellResult
from simrail.campaign.ledger import Ledger
from simrail.core.interrupts import Check
from simrail.estimation.choose_odometry import TRUTH, with_odometry
from simrail.estimation.estimate import Estimate, Estimator, estimate_many
from simrail.recording.recording import Recording, beginning
from simrail.ride.truth import Truth
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
from simrail.scenario.cells import Cell
from simrail.scoring.geometry import score_geometry
from simrail.scoring.score import Reference, reference_of, score, score_odometry, truth_at_imu
from simrail.sensors.measure import measure


@dataclass(frozen=True)
class _Recorded:
    """A cell with its recording and what its estimates are compared with."""

    cell: Cell
    recording: Recording
    reference: Reference


def run_cells(cells: Sequence[Cell], truth: Truth, parts: Parts, ledger: Ledger, check: Check) -> None:
    """Record cells of one ride, run every estimator on the recordings, and score.

    Parameters
    ----------
    cells : sequence of Cell
        Cells that share the ride.
    truth : Truth
        Their ride.
    parts : Parts
        Parts of their scenario.
    ledger : Ledger
        Gathers what was found.
    check : callable
        Raises `KeyboardInterrupt` if there was one that a library swallowed.
    """
    recorded = []
    for cell in cells:
        try:
            recorded.append(_record(cell, truth, parts, ledger))
        except Exception as error:
            check()
            for name in ledger.estimators:
                ledger.failed(cell, name, error)
    if not recorded:
        return
    for name, estimator in ledger.estimators.items():
        found = _estimates(name, estimator, [one.recording for one in recorded], ledger, check)
        for one, outcome in zip(recorded, found, strict=True):
            try:
                if isinstance(outcome, Exception):
                    raise outcome
                with ledger.timed("score"):
                    _score(one, name, *outcome, parts, ledger)
                ledger.judge_finite(one.cell, name, outcome[0])
            except Exception as error:
                check()
                ledger.failed(one.cell, name, error)


def record_cell(cell: Cell, truth: Truth, parts: Parts) -> Recording:
    """Measure a cell, its sensors on its ride, and run its odometry."""
    recording = measure(
        truth,
        name=cell.ride.name,
        mount=mount_of(cell),
        grade=parts.grade(cell),
        encoder=encoder_of(cell),
        magnetometer=magnetometer_of(cell),
        rail_sensor=rail_sensor_of(cell),
        rails=None if rail_sensor_of(cell) is None else parts.rails(cell),
        odometry=TRUTH if cell.spec.odometry == TRUTH else None,
        seed=cell.sensor_seed,
        draw=cell.sensor_draw,
        earth_rate=earth_of(cell),
        temperature=temperature_of(cell),
    )
    odometry = parts.odometry(cell)
    if odometry is None:
        return recording
    return with_odometry(recording, odometry, source=cell.spec.odometry)


def look_at(
    cell: Cell, truth: Truth, parts: Parts, ledger: Ledger, described: dict[str, object]
) -> CellResult:
    """Run a cell again for the figures of a report: its recording and estimates, without scores."""
    recording = record_cell(cell, truth, parts)
    estimates = {}
    for name, estimator in ledger.estimators.items():
        with suppress(Exception):
            (estimates[name],) = estimate_many(estimator, [recording])
    speaks_of_rails = any(estimate.geometry is not None for estimate in estimates.values())
    rails = parts.rails(cell) if speaks_of_rails else None
    return CellResult(described, recording, truth_at_imu(truth, recording), estimates, rails)


def _record(cell: Cell, truth: Truth, parts: Parts, ledger: Ledger) -> _Recorded:
    """Record one cell and score its odometry, if it has one."""
    with ledger.timed("measure"):
        recording = record_cell(cell, truth, parts)
    with ledger.timed("score"):
        reference = reference_of(truth_at_imu(truth, recording), recording)
        if recording.odometry is not None:
            figures = score_odometry(recording, reference, **kept_of(cell))
            ledger.scored(cell, f"odometry:{recording.odometry_source}", figures)
    return _Recorded(cell, recording, reference)


def _estimates(
    name: str, estimator: Estimator, recordings: list[Recording], ledger: Ledger, check: Check
) -> Iterator[tuple[Estimate, float] | Exception]:
    """Each estimate and the microseconds per sample that it took, or what went wrong with it.

    A method that takes many recordings at once takes them all; if one of them upsets it, it takes them
    one by one, so that only that one fails.
    """
    if name not in ledger.warm:
        # The first call of a kernel compiles it or loads it from disk: that is no property of the method.
        with ledger.timed("estimate"), suppress(Exception):
            estimate_many(estimator, [beginning(recordings[0], samples=64)])
        ledger.warm.add(name)
    together = [recordings] if hasattr(estimator, "estimate_many") else [[one] for one in recordings]
    while together:
        group = together.pop(0)
        try:
            with ledger.timed("estimate"):
                begun = time.perf_counter()
                found = estimate_many(estimator, group)
                seconds = time.perf_counter() - begun
            if len(found) != len(group):
                raise ValueError(f"estimate_many gave {len(found)} estimates of {len(group)} recordings")
        except Exception as error:
            check()
            if len(group) > 1:
                together = [[one] for one in group]
            else:
                yield error
            continue
        us_per_sample = 1e6 * seconds / sum(len(one.imu) for one in group)
        yield from ((estimate, us_per_sample) for estimate in found)


def _score(
    one: _Recorded, name: str, estimate: Estimate, us_per_sample: float, parts: Parts, ledger: Ledger
) -> None:
    """Score one estimate."""
    for figures in figures_of(one.cell, estimate, one.reference, one.recording, us_per_sample, parts):
        ledger.scored(one.cell, name, figures)


def figures_of(
    cell: Cell,
    estimate: Estimate,
    reference: Reference,
    recording: Recording,
    us_per_sample: float,
    parts: Parts,
) -> list[pd.DataFrame]:
    """Scores of one estimate as a cell wants them: of its states, and of its geometry if it has one."""
    keep = kept_of(cell)
    tables = [score(estimate, reference, recording, us_per_sample=us_per_sample, **keep)]
    if estimate.geometry is not None:
        tables.append(
            score_geometry(
                estimate,
                parts.rails(cell),
                recording,
                bands=bands_of(cell),
                twist_base_m=cell.spec.geometry.twist_base_m,
                **keep,
            )
        )
    return tables


def kept_of(cell: Cell) -> dict[str, Any]:
    """What of the score table the scenario keeps."""
    return {"windows": cell.spec.score.windows, "metrics": cell.spec.score.metrics}
