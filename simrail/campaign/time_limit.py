"""An estimator with a limit of time or memory: run in a process of its own, which is ended beyond it.

A signal ends no compiled loop and a thread none at all: only a process can be ended for sure. It is a copy of
this one (a fork, where the system has it), so that what is compiled is there, and takes one batch after the
other; estimators without a limit have no such process. Where the one that waits is killed itself, the system
ends the other one: on Linux at once, elsewhere by a timer, if it has a limit of time.

Memory is limited by the system (``RLIMIT_DATA`` of Linux: what a process has for itself, with what it has
from its parent as the start). What asks for more gets a `MemoryError`, and its process is ended.
"""

import contextlib
import ctypes
import multiprocessing
import multiprocessing.connection
import os
import pickle
import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from simrail.campaign.fence import MOST_PRINTED, fenced, handed
from simrail.estimation.estimate import Estimate, Estimator, estimate_many
from simrail.recording.recording import Recording

FIRST_CALL_S = 20.0
"""What the first call may take, which compiles kernels, where the limit is shorter."""

_GRACE_S = 2.0
"""After the limit, until the system's own timer ends the process."""


class OverTimeError(RuntimeError):
    """An estimator took longer than it may."""


class OverMemoryError(RuntimeError):
    """An estimator asked for more memory than it may have."""


class EstimatorDiedError(RuntimeError):
    """An estimator took its process with it."""


class Outcome(NamedTuple):
    """What an estimator did: its estimates, the time that they took, and what it printed."""

    estimates: list[Estimate]
    wall_s: float
    cpu_s: float
    printed: str


def estimate_here(estimator: Estimator, recordings: Sequence[Recording]) -> Outcome:
    """Run an estimator in this process, fenced."""
    given = [handed(one) for one in recordings]
    with fenced() as printed:
        begun, worked = time.perf_counter(), time.process_time()
        estimates = estimate_many(estimator, given)
        wall_s, cpu_s = time.perf_counter() - begun, time.process_time() - worked
    return Outcome(estimates, wall_s, cpu_s, printed.getvalue()[: 10 * MOST_PRINTED])


class LimitedEstimator:
    """One estimator and the process that runs it, begun when it is needed.

    Parameters
    ----------
    estimator : Estimator
        What is run.
    limit_s : float, optional
        How long it may take for each recording, s.
    memory_mb : float, optional
        How much memory its process may take beside that of this one, MB.
    """

    def __init__(
        self, estimator: Estimator, limit_s: float | None = None, memory_mb: float | None = None
    ) -> None:
        self._estimator, self._limit_s, self._memory_mb = estimator, limit_s, memory_mb
        self._process: Any = None
        self._pipe: Any = None

    def estimate(self, recordings: Sequence[Recording], *, at_least_s: float = 0.0) -> Outcome:
        """Run the estimator.

        Parameters
        ----------
        recordings : sequence of Recording
            What it is given.
        at_least_s : float
            What it may take in any case.

        Raises
        ------
        OverTimeError, OverMemoryError, EstimatorDiedError
            If it was ended, or ended its process.
        Exception
            What the estimator raised.
        """
        limit_s = self._limit_s
        allowed_s = None if limit_s is None else max(limit_s * len(recordings), at_least_s)
        try:
            if self._process is None:
                self._begin()
            self._pipe.send((recordings, allowed_s))
            if not self._pipe.poll(allowed_s):
                raise self._over_time()
            done, content = self._pipe.recv()
        except (EOFError, ConnectionError):
            raise self._death() from None
        except BaseException:
            self.close()
            raise
        if not done:
            if isinstance(content, MemoryError) and self._memory_mb is not None:
                self.close()  # what it holds would be in the way of the next one
                raise OverMemoryError(f"took more memory than memory_limit_mb = {self._memory_mb:g}")
            raise content
        outcome: Outcome = content
        return outcome

    def close(self) -> None:
        """End the process, whatever it does."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = self._pipe = None

    def _begin(self) -> None:
        ways = multiprocessing.get_all_start_methods()
        context: Any = multiprocessing.get_context("fork" if "fork" in ways else "spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_run, args=(other, self._pipe, self._estimator, self._memory_mb, os.getpid()), daemon=True
        )
        with _allowed_children():
            self._process.start()
        other.close()

    def _death(self) -> RuntimeError:
        """What is said of a process that has ended by itself."""
        self._process.join(_GRACE_S)
        code = self._process.exitcode
        self.close()
        if code == -getattr(signal, "SIGALRM", 0):
            return self._over_time()
        by = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
        had = "" if self._memory_mb is None else f"; it had memory_limit_mb = {self._memory_mb:g}"
        return EstimatorDiedError(f"it ended the process that ran it ({by}{had})")

    def _over_time(self) -> OverTimeError:
        return OverTimeError(f"took longer than time_limit_s = {self._limit_s:g}, and was ended")


@contextlib.contextmanager
def _allowed_children() -> Any:
    """Let a worker that is a daemon itself, as those of a cluster are, have a child."""
    config: dict[str, Any] = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    before = config.get("daemon")
    config["daemon"] = False
    try:
        yield
    finally:
        config["daemon"] = before


def _limit_memory(more_mb: float) -> None:
    """Let this process have so much more memory, and no more; nothing where the system cannot.

    What is held already counts: the sum of the private writable mappings, ``VmData`` (proc_pid_status(5)).
    """
    with contextlib.suppress(ImportError, OSError, StopIteration):
        import resource

        lines = Path("/proc/self/status").read_text().splitlines()
        held_kb = next(int(line.split()[1]) for line in lines if line.startswith("VmData:"))
        most = 1024 * held_kb + int(1e6 * more_mb)
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))


_PDEATHSIG = 1
"""Linux's ``PR_SET_PDEATHSIG`` (prctl(2)): the signal that a process gets when its parent dies."""


def _end_with(parent: int) -> None:
    """Let the system end this process with its parent, whatever it does; nothing where the system cannot."""
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before
        os._exit(1)


def _run(pipe: Any, parents: Any, estimator: Estimator, memory_mb: float | None, parent: int) -> None:
    """Run what is asked for, until nobody asks any more: the child's part."""
    parents.close()
    _end_with(parent)
    if memory_mb is not None:
        _limit_memory(memory_mb)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    with contextlib.suppress(EOFError, ConnectionError):
        while True:
            recordings, allowed_s = pipe.recv()
            has_timer = allowed_s is not None and hasattr(signal, "setitimer")
            if has_timer:
                signal.setitimer(signal.ITIMER_REAL, allowed_s + _GRACE_S)
            try:
                answer: tuple[bool, Any] = True, estimate_here(estimator, recordings)
                packed = pickle.dumps(answer)
            except Exception as error:
                packed = pickle.dumps((False, _portable(error)))
            if has_timer:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
            pipe.send_bytes(packed)


def _portable(error: Exception) -> Exception:
    """An error that another process can read, with its own words."""
    if isinstance(error, MemoryError):  # numpy's own cannot be read back without its arguments
        return MemoryError(str(error))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
