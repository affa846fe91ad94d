"""The campaign loop: every cell of a scenario, from simulation to scores. There is no second one.

A cell is one recording (`simrail.scenario.cells`): a ride is simulated once and shared by its cells,
each cell draws its sensors, every estimator runs on the recording, and each estimate is scored. Here
cells are put into batches, batches are handed to an executor (`simrail.campaign.executors`), and each that is
done is kept (`simrail.campaign.checkpoint`) before its worker gets another; cells that have been kept before
are not run.

Seeds belong to names, so neither the batches, nor their order, nor who runs them changes a score.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from simrail.campaign.checkpoint import Checkpoint
from simrail.campaign.executors import Executor, broken, error_of, executor_of, lost
from simrail.campaign.progress import Watcher
from simrail.campaign.result import CampaignResult, chosen_cells, gather
from simrail.campaign.worker import BatchResult, fail_batch, forget, pack, run_batch, run_ride
from simrail.core.interrupts import interruptible
from simrail.core.source_hash import score_code_hash
from simrail.ride import cache as ride_cache
from simrail.ride.ride import is_cached
from simrail.scenario.cells import Cell, rides_of
from simrail.scenario.check import Plan, judge_scenario
from simrail.scenario.requirements import VerdictRule, VerdictState, stop_rule_of
from simrail.scenario.scenario import Scenario
from simrail.scenario.stop_rule import StopState

_MOST_CELLS, _MOST_SECONDS = 20, 600.0
"""Largest batch: cells, and seconds of recordings together, which are held in memory at once."""

_MOST_TRIES = 3
"""After so many dead workers a cell that runs alone has failed; after one less, a batch is taken apart."""

_LOOK_S = 5.0
"""How often the workers are looked after while nothing comes of them."""

_PACKAGES = ("numpy", "scipy", "pandas", "numba", "exudyn")
"""Whose versions a score depends on."""


def key_of(plan: Plan) -> str:
    """Hash of all that decides the scores of a plan: scenario, parts, estimators, code and versions."""
    methods = (*plan.estimators.values(), *plan.parts.odometries().values())
    files = {inspect.getsourcefile(type(method)) for method in methods}
    decides = {
        "name": plan.scenario.name,
        "plan": plan.content_hash,
        "code": score_code_hash(),
        "estimators": sorted(hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files if file),
        "versions": {package: version(package) for package in _PACKAGES},
    }
    return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()


def run_campaign(
    scenario: Scenario | Plan,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    checkpoint: Checkpoint | None = None,
    batch_cells: int | None = None,
    only: int | None = None,
    watcher: Watcher | None = None,
) -> CampaignResult:
    """Run every cell of a scenario.

    Parameters
    ----------
    scenario : Scenario or Plan
        As read by `simrail.load_scenario`, or judged already.
    workers, cluster : int, str, optional
        Who runs it, see `simrail.campaign.executors.executor_of`.
    checkpoint : Checkpoint, optional
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
        If the cache or the results cannot be read or written, e.g. because a disk is full, or if the cluster
        has gone. Batches that are complete are kept.
    KeyboardInterrupt
        If interrupted; batches and rides that are complete are kept.
    """
    plan = scenario if isinstance(scenario, Plan) else judge_scenario(scenario)
    packed = pack(plan.parts)
    ride_cache.make_writable()  # now, so that workers share the folder that stands in for it
    folder = _kept_for_now() if checkpoint is None else nullcontext(checkpoint)
    with folder as kept:
        loop = _Loop(plan, packed, kept, watcher or Watcher(), only, batch_cells)
        with interruptible():
            try:
                with executor_of(workers, cluster if loop.left else None, cells=loop.left) as executor:
                    for note in executor.notes:
                        loop.tell(note)
                    stopped = loop.run(executor)
                return gather(plan, packed, kept, only=only, stopped=stopped)
            finally:
                forget()


@contextmanager
def _kept_for_now() -> Iterator[Checkpoint]:
    """A folder for batches, which goes with the campaign."""
    with tempfile.TemporaryDirectory(prefix="simrail-", ignore_cleanup_errors=True) as spare:
        yield Checkpoint(Path(spare))


class _Batch(NamedTuple):
    """Cells that share a ride, for one worker: to be run, or to have their ride simulated before."""

    ride_only: bool
    cells: tuple[Cell, ...]
    lost: int = 0
    """How often a worker has died over it."""

    @property
    def words(self) -> str:
        """What it is, for messages."""
        first, last = self.cells[0], self.cells[-1]
        return (
            f"ride {first.ride.name} is" if self.ride_only else f"cells {first.number} to {last.number} are"
        )


def _recordings_of(cell: Cell) -> tuple[int, ...]:
    """What the cells share that are made of the same recordings of passes."""
    return cell.passes[0].case, cell.sample, cell.map_draw, cell.sensor_draw


class _Loop:
    """The loop over the cells that are not kept yet; with a stop rule, from one of its stages to the next."""

    executor: Executor

    def __init__(
        self,
        plan: Plan,
        packed: bytes,
        checkpoint: Checkpoint,
        watcher: Watcher,
        only: int | None,
        batch_cells: int | None,
    ) -> None:
        self.plan, self.packed, self.only, self.batch_cells = plan, packed, only, batch_cells
        self.checkpoint, self.watcher = checkpoint, watcher
        self.done = checkpoint.cells()
        self.total = plan.cells if only is None else 1
        self.left = self.total - len(self.done)
        self.failed = 0
        self.told: set[str] = set()
        self._chosen: Callable[[], Iterator[Cell]] = partial(chosen_cells, plan, only)
        self.simulated: dict[int, BatchResult] = {}
        self.ready: deque[_Batch] = deque()
        self.suspects: deque[_Batch] = deque()
        if checkpoint.damaged:
            self.tell(f"{checkpoint.damaged} damaged file(s) of finished batches dropped: run again")
        if self.done:
            self.tell(f"going on with an unfinished run: {len(self.done)} of {self.total} cells are done")

    def run(self, executor: Executor) -> StopState | VerdictState | None:
        """Run what is left, or as much as the stop rule asks for; its last state."""
        self.executor = executor
        rule = stop_rule_of(self.plan.scenario) if self.only is None else None
        if rule is None:
            self._run()
            return None
        if isinstance(rule, VerdictRule):
            self.tell(rule.words)
        state = None
        for draws in rule.stages:
            self._chosen = partial(chosen_cells, self.plan, draws=draws, former=state)
            numbers = {cell.number for cell in self._chosen()}
            self.total, self.left = len(numbers), len(numbers - self.done)
            most = chosen_cells(self.plan, draws=rule.draws, former=state)
            self.watcher.may_come_to(sum(1 for _ in most))
            self._run()
            tables = (result.scores for result in self.checkpoint.results())
            state = rule.state(chosen_cells(self.plan), tables, draws, state)
            self.tell(state.words)
            for line in state.so_far if isinstance(state, VerdictState) else ():
                self.tell(line)
            if state.reached:
                break
        return state

    def _run(self) -> None:
        """Run what is left of the chosen cells; each batch is kept before its worker gets another."""
        if not self.left:
            return
        self.checkpoint.log(f"{self.left} cells to run, {self.executor.workers()} at once")
        self.watcher.cells_begin(self.total - self.left, self.total)
        waiting: dict[Future[BatchResult], _Batch] = {}
        rides = self._rides()
        while True:
            # What has killed a worker before runs alone, so that nothing else is lost with it.
            while len(waiting) < (1 if self._suspected(waiting) else self.executor.workers()):
                batch = self._next(rides)
                if batch is None:
                    break
                waiting[self._submit(batch)] = batch
            if not waiting:
                return
            self._collect(waiting)

    def _suspected(self, waiting: dict[Future[BatchResult], _Batch]) -> bool:
        """Whether a batch over which a worker died is to run, or is under way."""
        return bool(self.suspects) or any(batch.lost for batch in waiting.values())

    def _collect(self, waiting: dict[Future[BatchResult], _Batch]) -> None:
        """Wait until something is done, and take it.

        No future that has been taken is held on to from here: a cluster keeps a result for as long as
        somebody does, and computes it again when the worker dies that has it.
        """
        while not (done := wait(waiting, timeout=_LOOK_S, return_when=FIRST_COMPLETED).done):
            self.executor.look_after()
        if any(broken(error_of(future)) for future in done):
            done = set(waiting)  # all that were under way are lost; which one it was, is not known
            wait(done)
            self.executor.renew()
        for future in done:
            self._take(waiting.pop(future), future)

    def _rides(self) -> Iterator[tuple[Cell, ...]]:
        """The cells left of each ride."""
        for _, group in groupby(self._chosen(), key=lambda cell: cell.ride_number):
            left = tuple(cell for cell in group if cell.number not in self.done)
            if left:
                yield left

    def _next(self, rides: Iterator[tuple[Cell, ...]]) -> _Batch | None:
        """What to run next: suspects, alone; then batches of rides that are there; then another ride."""
        if self.suspects:
            return self.suspects.popleft()
        if not self.ready and (ride := next(rides, None)) is not None:
            self.watcher.ride_begins(ride[0].ride_number + 1, self.plan.rides, ride[0].ride.name)
            if not all(is_cached(self.plan.parts.ride(cell)) for cell in rides_of(ride)):
                return _Batch(True, ride)
            self._ride_is_there(ride)
        return self.ready.popleft() if self.ready else None

    def _ride_is_there(self, ride: tuple[Cell, ...]) -> None:
        """Make the batches of a ride: small enough for memory, and for every worker to have some."""
        seconds = max(self.plan.parts.ride(ride[0]).profile.duration_s, 1e-3)
        most = min(_MOST_CELLS, int(_MOST_SECONDS / seconds), self.left // (4 * self.executor.workers()))
        size = self.batch_cells or max(1, most)
        if ride[0].passes:  # those of all numbers of passes share their rides' estimates
            self.ready.extend(_Batch(False, tuple(own)) for _, own in groupby(ride, key=_recordings_of))
        else:
            self.ready.extend(_Batch(False, ride[i : i + size]) for i in range(0, len(ride), size))
        self.watcher.ride_ends()

    def _submit(self, batch: _Batch) -> Future[BatchResult]:
        """Hand a batch to the executor."""
        if not batch.ride_only:
            return self.executor.submit(run_batch, self.packed, batch.cells)
        progress = (self.watcher.ride_goes,) if self.executor.here else ()
        return self.executor.submit(run_ride, self.packed, batch.cells, *progress)

    def _take(self, batch: _Batch, future: Future[BatchResult]) -> None:
        """Take what came of a batch."""
        error = error_of(future)
        if error is not None and not lost(error):
            raise error
        if error is not None:
            self._lost(batch, given_up=not broken(error))
            return
        result = future.result()
        for note in result.notes:
            if note not in self.told:
                self.told.add(note)
                self.tell(note)
        if result.cells:
            self._keep(result)
        else:
            self.simulated[result.ride_number] = result
            self._ride_is_there(batch.cells)

    def _lost(self, batch: _Batch, *, given_up: bool) -> None:
        """A worker died over a batch: run it again, alone; in the end, its cells have failed."""
        batch = batch._replace(lost=batch.lost + 1)
        single = batch.ride_only or len(batch.cells) == 1
        if not given_up and batch.lost < (_MOST_TRIES if single else _MOST_TRIES - 1):
            self.tell(f"a worker died: {batch.words} run again")
            self.suspects.append(batch)
        elif not single:
            # One of them is enough to kill a worker: the others shall not fail with it. Each has two tries
            # more: the next worker may be killed by what is none of them, as a machine without memory does.
            self.suspects.extend(_Batch(False, (cell,), _MOST_TRIES - 2) for cell in batch.cells)
        else:
            reason = "the worker died, killed or out of memory, each time this was run"
            self._keep(fail_batch(self.packed, batch.cells, reason))

    def _keep(self, result: BatchResult) -> None:
        """Keep a batch, with the ride that was simulated for it, and tell of it."""
        ride = self.simulated.pop(result.ride_number, None)
        if ride is not None:
            wall = result.wall_s | {"simulate": result.wall_s["simulate"] + ride.wall_s["simulate"]}
            cpu = result.cpu_s | {"simulate": result.cpu_s["simulate"] + ride.cpu_s["simulate"]}
            result = replace(result, ride=ride.ride, wall_s=wall, cpu_s=cpu)
        self.checkpoint.add(result)
        for failure in result.failures:
            self.checkpoint.log(f"cell {failure.cell}, {failure.estimator} failed: {failure.reason}")
        self.done.update(result.cells)
        self.left -= len(result.cells)
        self.failed += len({failure.cell for failure in result.failures})
        done = self.total - self.left
        self.checkpoint.log(f"{done} of {self.total} cells done; the last by {result.worker}")
        self.watcher.cells_done(done, self.total, self.failed, result.worker)

    def tell(self, line: str) -> None:
        """Tell the user a line, and keep it in the log."""
        self.checkpoint.log(line)
        self.watcher.told(line)
