"""What one process does for a campaign: simulate a ride, or run a batch of its cells.

Both are plain functions of an order and of cells, so they run alike in this process, in another one, and on
another machine; a process remembers the last order and ride, which its next batch often shares. Nothing
here knows which batches there are, nor who runs them: see `simrail.campaign.campaign` and
`simrail.campaign.executors`.
"""

from __future__ import annotations

import errno
import hashlib
import os
import pickle
import socket
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from typing import Any

import pandas as pd
from threadpoolctl import threadpool_limits

from simrail.campaign.cell import look_at, run_cells
from simrail.campaign.example import CellResult
from simrail.campaign.ledger import Failure, Ledger, cell_record, reason_of
from simrail.core.errors import InputError
from simrail.core.interrupts import Check, interruptible
from simrail.core.source_hash import score_code_hash
from simrail.estimation.user_modules import install, sources_of
from simrail.ride.ride import Progress, is_cached, simulate
from simrail.ride.truth import Mount, Truth
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, methods
from simrail.scoring.table import labelled_all


@dataclass(frozen=True)
class Order:
    """What every batch of a campaign needs, packed for other processes.

    Attributes
    ----------
    data : bytes
        Parts, estimators among them, pickled.
    key : str
        SHA-256 of the data.
    code : str
        Hash of the code that ordered it: other code would give other bits.
    """

    data: bytes
    key: str
    code: str


@dataclass(frozen=True)
class RideResult:
    """What came of a ride.

    Attributes
    ----------
    facts : dict
        What the engine said of its run; plain values. Empty if it failed.
    reason, trace : str
        Why it failed; empty if it did not.
    notes : tuple of str
        What is worth a line to the user.
    wall_s, cpu_s : float
        Time that it took.
    """

    facts: dict[str, Any]
    reason: str = ""
    trace: str = ""
    notes: tuple[str, ...] = ()
    wall_s: float = 0.0
    cpu_s: float = 0.0


@dataclass(frozen=True)
class BatchResult:
    """What came of a batch: plain tables and values, the same whoever ran it.

    Attributes
    ----------
    cells : tuple of int
        Numbers of its cells.
    ride_number : int
        Number of their ride.
    scores : pandas.DataFrame
        Their rows of the score table.
    failures : tuple of Failure
        What failed.
    ride : dict
        What the engine said of the ride; empty if the ride failed.
    wall_s, cpu_s : dict of str to float
        Time of the stages `simrail.campaign.ledger.STAGES`.
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


@dataclass
class _Desk:
    """What this process remembers between batches: an order, unpacked, and the ride used last."""

    key: str
    parts: Parts
    tunings: dict[int, dict[str, str]] = field(default_factory=dict)
    warm: set[str] = field(default_factory=set)
    ride: tuple[int, Truth, dict[str, Any]] | None = None

    def ledger(self, sample: int) -> Ledger:
        """A ledger for one batch, whose cells are of one sample, as they share a ride."""
        scenario = self.parts.scenario
        if sample not in self.tunings:
            self.tunings[sample] = {each.name: each.tuning for each in methods(scenario, sample=sample)}
        return Ledger(scenario.name, self.parts.estimators(sample), self.tunings[sample], self.warm)


_desk: _Desk | None = None
_at_work = threading.RLock()
"""One batch at a time in a process, whatever threads it has: timings and memory are those of one batch."""


def order_of(parts: Parts) -> Order:
    """Pack what every batch needs: the parts of a scenario that has been judged, its estimators among them.

    Raises
    ------
    InputError
        If an estimator cannot be sent to another process.
    """
    estimators = {**parts.estimators(0), **parts.odometries()}
    for name, estimator in estimators.items():
        try:
            pickle.dumps(estimator)
        except Exception as error:
            raise InputError(
                f"the estimator cannot be sent to another process: {error}",
                field="estimator",
                value=name,
                remedy="make it a frozen dataclass of plain values",
            ) from error
    sources = sources_of(list(estimators.values()))
    data = pickle.dumps((sources, pickle.dumps(parts)))
    return Order(data, hashlib.sha256(data).hexdigest(), score_code_hash())


def run_ride(order: Order, cell: Cell, progress: Progress | None = None) -> RideResult:
    """Simulate the ride of a cell into the cache, or find it there.

    Raises
    ------
    InputError
        If this process runs other code than the one that ordered.
    OSError
        If the disk is full.
    """
    begun, worked = time.perf_counter(), time.process_time()
    notes: list[str] = []
    with _at_desk(order) as (desk, check):
        try:
            _, facts = _ride(desk, cell, notes, progress)
            reason = trace = ""
        except Exception as error:
            check()
            _raise_full_disk(error)
            facts, reason, trace = {}, reason_of(error), "".join(traceback.format_exception(error))
    took = time.perf_counter() - begun, time.process_time() - worked
    return RideResult(facts, reason, trace, tuple(notes), *took)


def run_batch(order: Order, cells: tuple[Cell, ...]) -> BatchResult:
    """Run cells that share a ride; for errors see `run_ride`."""
    notes: list[str] = []
    with _at_desk(order) as (desk, check):
        ledger = desk.ledger(cells[0].sample)
        facts: dict[str, Any] = {}
        try:
            with ledger.timed("simulate"):
                truth, facts = _ride(desk, cells[0], notes)
        except Exception as error:
            check()
            _raise_full_disk(error)
            for cell in cells:
                for name in ledger.estimators:
                    ledger.failed(cell, name, error)
        else:
            run_cells(cells, truth, desk.parts, ledger, check)
    return _result(cells, ledger, facts, tuple(notes))


def lost_batch(order: Order, cells: tuple[Cell, ...], reason: str, trace: str) -> BatchResult:
    """Failed rows for cells that cannot be run, and why."""
    with _at_desk(order) as (desk, _):
        ledger = desk.ledger(cells[0].sample)
        for cell in cells:
            for name in ledger.estimators:
                ledger.lost(cell, name, reason, trace)
    return _result(cells, ledger, {}, ())


def example_of(order: Order, cell: Cell) -> CellResult:
    """Run a cell again to look at it closely."""
    with _at_desk(order) as (desk, _):
        truth, _ = _ride(desk, cell, [])
        ledger = desk.ledger(cell.sample)
        described = {**ledger.labels(cell, ""), **cell_record(cell)}
        del described["estimator"], described["tuning"]
        return look_at(cell, truth, desk.parts, ledger, described)


def forget() -> None:
    """Drop what this process remembers."""
    global _desk
    with _at_work:
        _desk = None


@contextmanager
def _at_desk(order: Order) -> Iterator[tuple[_Desk, Check]]:
    """This process, at work on an order: alone, with one thread for linear algebra."""
    global _desk
    # The sums of a linear-algebra library depend on its number of threads.
    with _at_work, threadpool_limits(1), interruptible() as check:
        if order.code != score_code_hash():
            raise InputError(
                "the worker runs other code than the campaign, and would give other bits",
                value=_worker(),
                remedy="change no source while a campaign runs, and install the same on every machine",
            )
        if _desk is None or _desk.key != order.key:
            sources, data = pickle.loads(order.data)
            install(sources)
            _desk = _Desk(order.key, pickle.loads(data))
        yield _desk, check


def _ride(
    desk: _Desk, cell: Cell, notes: list[str], progress: Progress | None = None
) -> tuple[Truth, dict[str, Any]]:
    """The ride of a cell and what the engine said: remembered, from the cache, or simulated."""
    if desk.ride is None or desk.ride[0] != cell.ride_number:
        desk.ride = None
        ride = desk.parts.ride(cell)
        found = is_cached(ride)
        begun = time.perf_counter()
        truth = simulate(ride, progress=progress, told=notes.append)
        took = time.perf_counter() - begun
        truth = _RememberedTruth(**{entry.name: getattr(truth, entry.name) for entry in fields(Truth)})
        said = {key: value for key, value in truth.manifest.items() if key != "versions"}
        said |= {"number": cell.ride_number, "ride": cell.ride.name, "track_draw": cell.track_draw}
        desk.ride = cell.ride_number, truth, said | {"from_cache": found, "took_s": took}
    return desk.ride[1], desk.ride[2]


def _result(
    cells: tuple[Cell, ...], ledger: Ledger, facts: dict[str, Any], notes: tuple[str, ...]
) -> BatchResult:
    return BatchResult(
        cells=tuple(cell.number for cell in cells),
        ride_number=cells[0].ride_number,
        scores=labelled_all(ledger.figures),
        failures=tuple(ledger.failures),
        ride=facts,
        wall_s=ledger.wall_s,
        cpu_s=ledger.cpu_s,
        notes=notes,
        worker=_worker(),
    )


def _raise_full_disk(error: Exception) -> None:
    """A full disk is no property of a cell: it ends the campaign, which goes on when there is room."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        raise error


def _worker() -> str:
    return f"{socket.gethostname()}:{os.getpid()}"
