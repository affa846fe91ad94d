"""What one process does for a campaign: simulate a ride, or run a batch of its cells.

Both are plain functions of a packed plan and of cells, so they run alike in this process, in another one,
and on another machine; a process remembers the last plan and ride, which its next batch often shares.
Nothing here knows which batches there are, nor who runs them: see `simrail.campaign.campaign` and
`simrail.campaign.executors`.
"""

import os
import pickle
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import pandas as pd
from threadpoolctl import threadpool_limits

from simrail.campaign.cell import BatchTally, CellResult, Failure, look_at, run_cells
from simrail.campaign.passes import run_passes
from simrail.core.errors import InputError
from simrail.core.interrupts import Check, interruptible
from simrail.core.source_hash import score_code_hash
from simrail.estimation.user_modules import install, sources_of
from simrail.ride.ride import Progress, is_cached, simulate
from simrail.ride.truth import Truth
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, rides_of
from simrail.scoring.table import labelled


@dataclass(frozen=True)
class BatchResult:
    """What came of a batch: plain tables and values, the same whoever ran it.

    Attributes
    ----------
    cells : tuple of int
        Numbers of its cells; none of a ride that was simulated for cells to come.
    ride_number : int
        Number of their ride.
    scores : pandas.DataFrame
        Their rows of the score table.
    failures : tuple of Failure
        What failed.
    ride : dict
        What the engine said of the ride; plain values, empty if the ride failed.
    wall_s, cpu_s : dict of str to float
        Time of the stages `simrail.campaign.cell.STAGES`.
    notes : tuple of str
        What is worth a line to the user.
    worker : str
        Who ran it.
    """

    cells: tuple[int, ...]
    ride_number: int
    scores: pd.DataFrame
    failures: tuple[Failure, ...]
    ride: dict[str, Any]
    wall_s: dict[str, float]
    cpu_s: dict[str, float]
    notes: tuple[str, ...] = ()
    worker: str = ""


@dataclass
class _Worker:
    """What this process remembers between batches: a plan, unpacked, and the ride used last."""

    packed: bytes
    parts: Parts
    warm: set[str] = field(default_factory=set)
    ride: tuple[int, Truth, dict[str, Any]] | None = None

    def tally(self, sample: int) -> BatchTally:
        """What gathers one batch; with the estimators of a sample."""
        parts = self.parts
        estimators, tunings = parts.estimators(sample), parts.tunings(sample)
        limits = parts.time_limits_s, parts.memory_limits_mb
        return BatchTally(parts.scenario.name, estimators, tunings, self.warm, *limits)

    def take_sample(self, tally: BatchTally, sample: int) -> None:
        """Give a batch the estimators of another sample; their names are the same in every one."""
        tally.estimators, tally.tunings = self.parts.estimators(sample), self.parts.tunings(sample)

    def truth(
        self, cell: Cell, notes: list[str], progress: Progress | None = None
    ) -> tuple[Truth, dict[str, Any]]:
        """The ride of a cell and what the engine said: remembered, from the cache, or simulated."""
        if self.ride is None or self.ride[0] != cell.ride_number:
            self.ride = None
            ride = self.parts.ride(cell)
            cached = is_cached(ride)
            begun = time.perf_counter()
            truth = simulate(ride, progress=progress, told=notes.append, warn=False)
            took = time.perf_counter() - begun
            facts = {key: value for key, value in truth.manifest.items() if key != "versions"}
            facts |= {"number": cell.ride_number, "ride": cell.ride.name, "track_draw": cell.track_draw}
            self.ride = cell.ride_number, truth, facts | {"from_cache": cached, "took_s": took}
        return self.ride[1], self.ride[2]


_worker: _Worker | None = None
_at_work = threading.RLock()
"""One batch at a time in a process, whatever threads it has: timings and memory are those of one batch."""


def pack(parts: Parts) -> bytes:
    """Pack what every batch needs: the parts of a scenario that has been judged, its estimators among them.

    Raises
    ------
    InputError
        If an estimator cannot be sent to another process.
    """
    estimators = [*parts.estimators(0).items(), *parts.odometries().items()]
    for name, estimator in estimators:
        try:
            pickle.dumps(estimator)
        except Exception as error:
            raise InputError(
                f"the estimator cannot be sent to another process: {error}",
                field="estimator",
                value=name,
                remedy="make it a frozen dataclass of plain values",
                limit="what can be pickled",
            ) from error
    sources = sources_of([estimator for _, estimator in estimators])
    return pickle.dumps((score_code_hash(), sources, pickle.dumps(parts)))


def run_ride(packed: bytes, cells: tuple[Cell, ...], progress: Progress | None = None) -> BatchResult:
    """Simulate the ride of cells into the cache, or find it there; if it fails, all of them have failed.

    Raises
    ------
    InputError
        If this process runs other code than the one that packed the plan.
    OSError
        If the cache of rides cannot be read or written.
    """
    return _run(packed, cells, progress, ride_only=True)


def run_batch(packed: bytes, cells: tuple[Cell, ...]) -> BatchResult:
    """Run cells that share a ride; for errors see `run_ride`."""
    return _run(packed, cells, None, ride_only=False)


def _run(
    packed: bytes, cells: tuple[Cell, ...], progress: Progress | None, *, ride_only: bool
) -> BatchResult:
    notes: list[str] = []
    facts: dict[str, Any] = {}
    with _at_work_on(packed) as (worker, check):
        tally = worker.tally(cells[0].sample)
        try:
            with tally.timed("simulate"):
                truth, facts = worker.truth(cells[0], notes, progress)
                for cell in rides_of(cells)[1:] if ride_only else ():
                    worker.truth(cell, notes, progress)
        except Exception as error:
            check()
            if isinstance(error, OSError):
                raise  # of the cache, no property of a cell: it ends the campaign, which goes on afterwards
            for cell in cells:
                for name in tally.estimators:
                    tally.fail(cell, name, error)
            return _result(cells[0].ride_number, cells, tally, facts, notes)
        if not ride_only and cells[0].passes:

            def ride_of(cell: Cell) -> Truth:
                return worker.truth(cell, notes)[0]

            run_passes(cells, ride_of, worker.parts, tally, check)
        elif not ride_only:
            # What all samples have in common takes their recordings at once.
            apart = worker.parts.draws_estimators
            for _, own in groupby(cells, key=lambda cell: cell.sample if apart else 0):
                of_sample = tuple(own)
                worker.take_sample(tally, of_sample[0].sample)
                run_cells(of_sample, truth, worker.parts, tally, check)
    return _result(cells[0].ride_number, () if ride_only else cells, tally, facts, notes)


def fail_batch(packed: bytes, cells: tuple[Cell, ...], reason: str) -> BatchResult:
    """Failed rows for cells that cannot be run."""
    with _at_work_on(packed) as (worker, _):
        tally = worker.tally(cells[0].sample)
        for cell in cells:
            for name in tally.estimators:
                tally.fail(cell, name, reason)
    return _result(cells[0].ride_number, cells, tally, {}, [])


def example_of(packed: bytes, cell: Cell) -> CellResult:
    """Run a cell again to look at it closely."""
    with _at_work_on(packed) as (worker, _):
        cell = cell.passes[0] if cell.passes else cell
        truth, _ = worker.truth(cell, [])
        return look_at(cell, truth, worker.parts, worker.tally(cell.sample))


def forget() -> None:
    """Drop what this process remembers."""
    global _worker
    with _at_work:
        _worker = None


@contextmanager
def _at_work_on(packed: bytes) -> Iterator[tuple[_Worker, Check]]:
    """Put this process to work on a plan: alone, with one thread for linear algebra."""
    global _worker
    # The sums of a linear-algebra library depend on its number of threads.
    with _at_work, threadpool_limits(1), interruptible() as check:
        if _worker is None or _worker.packed != packed:
            code, sources, parts = pickle.loads(packed)
            if code != score_code_hash():
                raise InputError(
                    "the worker runs other code than the campaign, and would give other bits",
                    value=_name(),
                    remedy="change no source while a campaign runs, and install the same on every machine",
                    limit="the code of the campaign",
                )
            install(sources)
            _worker = _Worker(packed, pickle.loads(parts))
        yield _worker, check


def _result(
    ride_number: int, cells: tuple[Cell, ...], tally: BatchTally, facts: dict[str, Any], notes: list[str]
) -> BatchResult:
    return BatchResult(
        cells=tuple(cell.number for cell in cells),
        ride_number=ride_number,
        scores=labelled(tally.figures) if cells else pd.DataFrame(),
        failures=tuple(tally.failures),
        ride=facts,
        wall_s=tally.wall_s,
        cpu_s=tally.cpu_s,
        notes=(*notes, *(f"{name} printed: {text}" for name, text in tally.printed.items())),
        worker=_name(),
    )


def _name() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"
