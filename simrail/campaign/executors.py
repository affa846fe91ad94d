"""Who runs the batches of a campaign: this process, processes of this machine (loky), or a dask cluster.

All three are executors of the standard library's kind (`concurrent.futures`), with what they have between
processes made by joblib and dask. What is run, and in which order, is decided in `simrail.campaign.campaign`.
"""

from __future__ import annotations

import logging
import os
import queue
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import contextmanager, suppress
from typing import Any, Protocol
from urllib.parse import urlsplit

from simrail.core.errors import InputError
from simrail.core.machine import differences, machine
from simrail.core.source_hash import score_code_hash
from simrail.ride import cache as ride_cache

FEW_CELLS = 20
"""Up to so many cells run in this process: others would have to be started first."""

_WAIT_S = 20.0
"""How long a cluster may take to answer."""


class Executor(Protocol):
    """Runs functions, here or elsewhere."""

    here: bool = False
    """Whether it is this process: then `submit` returns when the work is done."""

    notes: tuple[str, ...] = ()
    """What is worth a line to the user, before anything is run."""

    def workers(self) -> int:
        """How many batches may be under way at once. A worker gets the next one when the last is kept."""
        ...

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begin to run a function."""
        ...

    def look_after(self) -> None:
        """See to the workers now and then; nothing to do unless there is a pool of one's own."""
        return

    def renew(self) -> None:
        """Go on after workers were lost; nothing to do unless there is a pool of one's own."""
        return

    def close(self) -> None:
        """End all work, also what is under way."""
        return


def error_of(future: Future[Any]) -> BaseException | None:
    """What went wrong with work that has ended; None if nothing did."""
    return ClusterGone() if future.cancelled() else future.exception()


def lost(error: BaseException) -> bool:
    """Whether an error means that a worker died, rather than that its work failed."""
    return broken(error) or type(error).__name__ == "KilledWorker"


def broken(error: BaseException | None) -> bool:
    """Whether a worker took all the others with it, and nobody knows which batch killed it."""
    return isinstance(error, BrokenExecutor)


@contextmanager
def executor_of(workers: int | None, cluster: str | None, *, cells: int) -> Iterator[Executor]:
    """Who runs a campaign.

    Parameters
    ----------
    workers : int, optional
        Processes of this machine; 1 stays in this one. If not given: this process for at most
        `FEW_CELLS` cells, else one for each core.
    cluster : str, optional
        Address of a dask scheduler, ``"tcp://host:8786"``.
    cells : int
        How many there are to run.

    Raises
    ------
    InputError
        If both are given, dask is not installed, or the scheduler or its workers do not answer.
    """
    if cluster is not None and workers is not None:
        remedy = "leave out --workers, or --cluster"
        raise InputError(
            "a cluster has its own workers",
            field="--workers",
            value=workers,
            remedy=remedy,
            limit="--workers or --cluster",
        )
    if workers is None:
        from joblib import cpu_count  # those that this process may use; slow to import

        workers = 1 if cells <= FEW_CELLS else cpu_count()
    executor: Executor
    if cluster is not None:
        executor = _Cluster(cluster)
    else:
        executor = _Here() if min(workers, cells) <= 1 else _Processes(min(workers, cells))
    try:
        yield executor
    finally:
        executor.close()


class _Here(Executor):
    """The process itself, without others."""

    here = True

    def workers(self) -> int:
        return 1

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


class _Processes(Executor):
    """Processes of this machine."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool = self._new()
        self._dead: frozenset[int] = frozenset()

    def _new(self) -> Any:
        from joblib.externals.loky import ProcessPoolExecutor

        # A process that has grown by some 300 MB, as long rides make it, is ended between two batches and
        # another takes its place: nothing is lost, and nobody needs to do anything about it.
        warnings.filterwarnings("ignore", message="A worker stopped while some jobs", category=UserWarning)
        return ProcessPoolExecutor(
            max_workers=self._workers,
            env={"SIMRAIL_RIDES": str(ride_cache.folder().absolute()), "NUMBA_NUM_THREADS": "1"},
            initializer=_begin_worker,
            initargs=(os.getpid(),),
        )

    def workers(self) -> int:
        return self._workers

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        try:
            future: Future[Any] = self._pool.submit(function, *arguments)
        except BrokenExecutor as error:  # a worker died since the last one was handed in
            future = Future()
            future.set_exception(error)
        return future

    def look_after(self) -> None:
        """Break a pool that waits for a dead worker.

        A worker that is killed as it hands in a result leaves half of it in the pipe: the pool then waits for
        the rest, and looks after its workers no more. Who was dead before and is still on its list is one:
        without any worker, and without an end of its own to write to, what it reads comes to an end.
        """
        processes = dict(self._pool._processes or {})
        dead = frozenset(pid for pid, process in processes.items() if not process.is_alive())
        waited_for, self._dead = dead & self._dead, dead
        results = self._pool._result_queue
        if not waited_for or results is None:
            return
        for pid in processes.keys() - dead:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        results._writer.close()

    def renew(self) -> None:
        self.close()
        self._pool, self._dead = self._new(), frozenset()

    def close(self) -> None:
        # The pool's thread forgets what it has not begun, then looks it up: a KeyError on the terminal.
        with suppress(queue.Empty):
            while True:
                self._pool._work_ids.get_nowait()
        self._pool.shutdown(wait=True, kill_workers=True)


def _judge_address(address: str) -> None:
    """Refuse what is no address, before a client of dask is half made, which tells of it at the end.

    Raises
    ------
    ValueError
        If it has no host or no port.
    """
    parts = urlsplit(address if "://" in address else f"tcp://{address}")
    if not parts.hostname or parts.port is None:
        raise ValueError(address)


class _Cluster(Executor):
    """Workers of a dask scheduler, which replaces those that are lost, and runs again what they had."""

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError:
            problem, remedy = "a cluster needs dask, which is not installed", 'pip install -e ".[cluster]"'
            raise InputError(
                problem,
                field="--cluster",
                value=address,
                remedy=remedy,
                limit="a scheduler with workers of the same simrail",
            ) from None
        self._address = address
        self._levels = _mute_dask()  # what goes wrong is told here, in one line
        client: Any = distributed.Client  # its methods have no types
        try:
            _judge_address(address)
            self._client = client(address, timeout=_WAIT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            _unmute(self._levels)
            raise InputError(
                "no dask scheduler answers there",
                field="--cluster",
                value=address,
                limit="an address such as tcp://host:8786",
                remedy="start one with 'dask scheduler', and workers with 'dask worker ADDRESS --nthreads 1'",
            ) from error
        try:
            self._judge_workers()
        except BaseException:
            self.close()
            raise
        self._pool: Any = self._client.get_executor(pure=False)
        self._busy: set[str] = set()

    def _judge_workers(self) -> None:
        """Refuse a cluster without workers, or of another simrail; note in what its machines differ."""

        def refusal(problem: str, value: str, remedy: str) -> InputError:
            return InputError(
                problem,
                field="--cluster",
                value=value,
                remedy=remedy,
                limit="a scheduler with workers of the same simrail",
            )

        begun = time.perf_counter()
        while not self._client.nthreads():
            if time.perf_counter() - begun > _WAIT_S:
                remedy = f"start some with 'dask worker {self._address} --nthreads 1'"
                raise refusal("the dask scheduler has no workers", self._address, remedy)
            time.sleep(0.2)
        remedy = "install the same simrail on every machine"
        try:
            codes = self._client.run(score_code_hash)
        except Exception as error:
            raise refusal(f"a worker cannot import simrail: {error}", self._address, remedy) from error
        others = sorted(worker for worker, code in codes.items() if code != score_code_hash())
        if others:
            raise refusal("a worker runs another simrail, and would give other bits", others[0], remedy)
        unlike = differences(machine(), self._client.run(machine))
        if unlike:
            self.notes = (
                f"warning: scores will agree to some 1e-9, not to the bit: workers differ in {unlike}",
            )

    def workers(self) -> int:
        # Threads of one worker take turns: it works on one batch at a time.
        try:
            return max(1, len(self._client.nthreads()))
        except (OSError, CancelledError, RuntimeError) as error:
            raise ClusterGone from error

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        # To a worker whose last result is here: one that dies then takes one batch with it, not two.
        try:
            place = next((each for each in self._client.nthreads() if each not in self._busy), None)
            future: Future[Any] = self._pool.submit(
                function, *arguments, workers=place, allow_other_workers=place is not None
            )
        except (OSError, CancelledError, RuntimeError) as error:
            raise ClusterGone from error
        if place is not None:
            self._busy.add(place)
            future.add_done_callback(lambda _: self._busy.discard(place))
        return future

    def close(self) -> None:
        there = self._client.status == "running"
        with suppress(Exception):  # a scheduler that has gone cannot be told
            self._client.close(timeout=2)
        if there:  # else dask goes on to say that it is gone, for as long as this process lives
            _unmute(self._levels)


def _mute_dask() -> dict[str, int]:
    """Let dask's loggers say nothing: each of them, as dask gives some a level of their own. Their levels."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    return levels


def _unmute(levels: dict[str, int]) -> None:
    for name, level in levels.items():
        logging.getLogger(name).setLevel(level)


class ClusterGone(OSError):
    """The scheduler has gone; what was done is kept."""

    def __init__(self) -> None:
        super().__init__("the dask scheduler has gone")


def _begin_worker(parent: int) -> None:
    """Leave Ctrl-C to the main process, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
