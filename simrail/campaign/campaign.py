"""The campaign loop: every cell of a scenario, from simulation to scores. There is no second one.

A cell is one recording (`simrail.scenario.cells`): a ride is simulated once and shared by its cells,
each cell draws its sensors, every estimator runs on the recording, and each estimate is scored. Here
cells are put into batches, batches are handed to a crew (`simrail.campaign.executors`), and each that is done
is kept (`simrail.campaign.checkpoint`) before its worker gets another; cells that have been kept before are
not run.

Seeds belong to names, so neither the batches, nor their order, nor who runs them changes a score.
"""

from __future__ import annotations

import tempfile
from collections import Counter, deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from simrail.campaign.checkpoint import Unfinished
from simrail.campaign.executors import Crew, broken, crew_of, error_of, lost
from simrail.campaign.job import Job, prepare
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult, chosen_cells, gather, look_at_draws
from simrail.campaign.worker import BatchResult, RideResult, forget, lost_batch, run_batch, run_ride
from simrail.core.interrupts import interruptible
from simrail.ride.ride import is_cached
from simrail.scenario.build import profile_of
from simrail.scenario.cells import Cell
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import Look, stop_rule_of

_MOST_CELLS, _MOST_SECONDS = 20, 600.0
"""Largest batch: cells, and seconds of recordings together, which are held in memory at once."""

_MOST_TRIES = 3
"""How often a cell is run whose worker dies each time; then it has failed."""


class _Task(NamedTuple):
    """A ride to simulate, for the cells that it has, or a batch of cells to run on it."""

    is_ride: bool
    cells: tuple[Cell, ...]

    @property
    def words(self) -> str:
        """What it is, for messages."""
        first, last = self.cells[0], self.cells[-1]
        return f"ride {first.ride.name} is" if self.is_ride else f"cells {first.number} to {last.number} are"

    @property
    def name(self) -> tuple[bool, int, int]:
        """What tells it from others."""
        return self.is_ride, self.cells[0].number, len(self.cells)


def run_campaign(
    scenario: Scenario | Job,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    kept: Unfinished | None = None,
    batch_cells: int | None = None,
    only: int | None = None,
    watcher: Watcher | None = None,
) -> CampaignResult:
    """Run every cell of a scenario.

    Parameters
    ----------
    scenario : Scenario or Job
        As read by `simrail.load_scenario`, or judged already.
    workers, cluster : int, str, optional
        Who runs it, see `simrail.campaign.executors.crew_of`.
    kept : Unfinished, optional
        Batches that have been run, and where those to come are kept; else they are kept for now only.
    batch_cells : int, optional
        Cells of a batch; as many as suit if not given.
    only : int, optional
        Run this one cell.
    watcher : Watcher, optional
        Is told of the progress.

    Raises
    ------
    InputError
        If the scenario cannot be run; then nothing has been run. Or if a worker runs other code.
    OSError
        If a disk is full, or the cluster has gone. Batches that are complete are kept.
    KeyboardInterrupt
        If interrupted; batches and rides that are complete are kept.
    """
    job = scenario if isinstance(scenario, Job) else prepare(scenario)
    with tempfile.TemporaryDirectory(prefix="simrail-", ignore_cleanup_errors=True) as spare:
        kept = Unfinished(Path(spare)) if kept is None else kept
        loop = _Loop(job, kept, watcher or Watcher(), only)
        with interruptible():
            try:
                with crew_of(workers, cluster if loop.left else None, cells=loop.left) as crew:
                    stopped = loop.run(crew, batch_cells)
                return gather(job, kept, only=only, stopped=stopped)
            finally:
                forget()


class _Loop:
    """The loop over the cells that are not kept yet; with a stop rule, from look to look."""

    def __init__(self, job: Job, kept: Unfinished, watcher: Watcher, only: int | None) -> None:
        self.job, self.kept, self.watcher, self.only = job, kept, watcher, only
        self.done = kept.cells()
        self.total = job.plan.cells if only is None else 1
        self.left = self.total - len(self.done)
        self.failed = 0
        self.rides: dict[int, RideResult] = {}
        self.ready: deque[_Task] = deque()
        self.suspects: deque[_Task] = deque()
        self.tries: Counter[tuple[bool, int, int]] = Counter()
        if kept.damaged:
            self._tell(f"{kept.damaged} damaged file(s) of finished batches dropped: run again")
        if self.done:
            self._tell(f"going on with an unfinished run: {len(self.done)} of {self.total} cells are done")

    def run(self, crew: Crew, batch_cells: int | None) -> Look | None:
        """Run what is left, or as much as the stop rule asks for; its last look."""
        rule = stop_rule_of(self.job.scenario) if self.only is None else None
        if rule is None:
            self._run(crew, batch_cells)
            return None
        for draws in rule.looks:
            numbers = {cell.number for cell in chosen_cells(self.job, draws=draws)}
            self.total, self.left = len(numbers), len(numbers - self.done)
            self._run(crew, batch_cells, draws=draws)
            look = look_at_draws(self.job, self.kept, rule, draws)
            self._tell(look.words)
            if look.reached:
                break
        return look

    def _run(self, crew: Crew, batch_cells: int | None, *, draws: int | None = None) -> None:
        """Run what is left of these draws; each batch is kept before its worker gets another."""
        if not self.left:
            return
        self.kept.log(f"{self.left} cells to run, {crew.workers()} at once")
        self.watcher.cells_begin(self.total - self.left, self.total)
        waiting: dict[Future[Any], _Task] = {}
        rides = self._rides(draws)
        while True:
            while len(waiting) < (1 if self.suspects else crew.workers()):
                task = self._next(rides, crew, batch_cells)
                if task is None:
                    break
                waiting[self._submit(crew, task)] = task
            if not waiting:
                return
            self._collect(waiting, crew, batch_cells)

    def _collect(self, waiting: dict[Future[Any], _Task], crew: Crew, batch_cells: int | None) -> None:
        """Wait until something is done, and take it.

        No future that has been taken is held on to from here: a cluster keeps a result for as long as
        somebody does, and computes it again when the worker dies that has it.
        """
        done, _ = wait(waiting, return_when=FIRST_COMPLETED)
        if any(broken(error_of(future)) for future in done):
            done = set(waiting)  # all that were under way are lost; which one it was, is not known
            wait(done)
            crew.renew()
        for future in done:
            self._take(waiting.pop(future), future, crew, batch_cells)

    def _rides(self, draws: int | None) -> Iterator[tuple[Cell, ...]]:
        """The cells left of each ride."""
        chosen = chosen_cells(self.job, self.only, draws=draws)
        for _, group in groupby(chosen, key=lambda cell: cell.ride_number):
            left = tuple(cell for cell in group if cell.number not in self.done)
            if left:
                yield left

    def _next(self, rides: Iterator[tuple[Cell, ...]], crew: Crew, batch_cells: int | None) -> _Task | None:
        """What to run next: suspects, alone; then batches of rides that are there; then another ride."""
        if self.suspects:
            return self.suspects.popleft()
        if not self.ready and (ride := next(rides, None)) is not None:
            self.watcher.ride_begins(ride[0].ride_number + 1, self.job.plan.rides, ride[0].ride.name)
            if not is_cached(self.job.parts.ride(ride[0])):
                return _Task(True, ride)
            self._ride_is_there(ride, crew, batch_cells)
        return self.ready.popleft() if self.ready else None

    def _ride_is_there(self, ride: tuple[Cell, ...], crew: Crew, batch_cells: int | None) -> None:
        """Make the batches of a ride: small enough for memory, and for every worker to have some."""
        seconds = max(profile_of(ride[0]).duration_s, 1e-3)
        most = min(_MOST_CELLS, int(_MOST_SECONDS / seconds), self.left // (4 * crew.workers()))
        size = batch_cells or max(1, most)
        self.ready.extend(_Task(False, ride[i : i + size]) for i in range(0, len(ride), size))
        self.watcher.ride_ends()

    def _submit(self, crew: Crew, task: _Task) -> Future[Any]:
        """Hand a task to the crew."""
        if not task.is_ride:
            return crew.submit(run_batch, self.job.order, task.cells)
        progress = (self.watcher.ride_goes,) if crew.here else ()
        return crew.submit(run_ride, self.job.order, task.cells[0], *progress)

    def _take(self, task: _Task, future: Future[Any], crew: Crew, batch_cells: int | None) -> None:
        """Take what came of a task."""
        error = error_of(future)
        if error is not None and not lost(error):
            raise error
        if error is not None:
            self._lost(task, given_up=not broken(error))
        elif not task.is_ride:
            self._keep(future.result())
        else:
            ride: RideResult = future.result()
            for note in ride.notes:
                self._tell(note)
            self.rides[task.cells[0].ride_number] = ride
            if ride.reason:
                self._keep(lost_batch(self.job.order, task.cells, ride.reason, ride.trace))
            else:
                self._ride_is_there(task.cells, crew, batch_cells)

    def _lost(self, task: _Task, *, given_up: bool) -> None:
        """A worker died over a task: run it again, alone; in the end, its cells have failed."""
        self.tries[task.name] += 1
        single = task.is_ride or len(task.cells) == 1
        if not given_up and self.tries[task.name] < (_MOST_TRIES if single else _MOST_TRIES - 1):
            self._tell(f"a worker died: {task.words} run again")
            self.suspects.append(task)
        elif not single:
            # One of them is enough to kill a worker: the others shall not fail with it.
            singles = [_Task(False, (cell,)) for cell in task.cells]
            self.tries.update({one.name: _MOST_TRIES - 1 for one in singles})
            self.suspects.extend(singles)
        else:
            reason = "the worker died, killed or out of memory, each time this was run"
            self._keep(lost_batch(self.job.order, task.cells, reason, reason + "\n"))

    def _keep(self, result: BatchResult) -> None:
        """Keep a batch, with the ride that was simulated for it, and tell of it."""
        ride = self.rides.pop(result.ride_number, None)
        if ride is not None:
            wall = result.wall_s | {"simulate": result.wall_s["simulate"] + ride.wall_s}
            cpu = result.cpu_s | {"simulate": result.cpu_s["simulate"] + ride.cpu_s}
            result = replace(result, ride=ride.facts, wall_s=wall, cpu_s=cpu)
        self.kept.add(result)
        for note in result.notes:
            self._tell(note)
        for failure in result.failures:
            self.kept.log(f"cell {failure.cell}, {failure.estimator} failed: {failure.reason}")
        self.done.update(result.cells)
        self.left -= len(result.cells)
        self.failed += len({failure.cell for failure in result.failures})
        done = self.total - self.left
        self.kept.log(f"{done} of {self.total} cells done; the last by {result.worker}")
        self.watcher.cells_done(done, self.total, self.failed, result.worker)

    def _tell(self, line: str) -> None:
        self.kept.log(line)
        self.watcher.told(line)
