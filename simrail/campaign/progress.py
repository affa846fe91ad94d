"""Who is told how a campaign, an export or a tuning goes, and what the command line shows of it."""

import time
from collections import deque
from datetime import timedelta
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

SILENT_S = 2.0
"""So long nothing is said of the judging of a scenario."""

_EVERY_S = 10.0
"""On a plain stream, how often the progress is told."""

_PACE_S = 120.0
"""Over so long, or longer where less than a cell was done, a pace is taken: a machine may become busy."""


class Watcher:
    """Is told how a campaign goes; this one keeps silent. Subclass it to show progress."""

    def judging(self, done: int, count: int) -> None:
        """So many cells of `count` have been judged, before anything is run."""

    def ride_begins(self, number: int, count: int, name: str) -> None:
        """Ride `number` (from 1) of `count` is simulated, or found in the cache, from now on."""

    def ride_goes(self, done_s: float, total_s: float, speed_mps: float) -> None:
        """The ride has been simulated so far."""

    def ride_ends(self) -> None:
        """The ride is there; its cells are run from now on."""

    def cells_begin(self, done: int, count: int) -> None:
        """Cells are run from now on; `done` of `count` were done before."""

    def may_come_to(self, most: int) -> None:
        """A stop rule asks for the cells that begin next, and may ask for more later: for `most` in all."""

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        """So many cells of `count` are done, `failed` of them failed; the last by this worker."""

    def told(self, line: str) -> None:
        """Something is worth a line to the user."""

    def recording_written(self, number: int, count: int, name: str) -> None:
        """Recording `number` (from 1) of `count` has been written, by an export."""

    def search_begins(self, name: str, each_s: float, evaluations: int) -> None:
        """A tuning will evaluate its objective about so often for a set of parameters, each in so many s."""

    def search_goes(self, name: str, evaluations: int, value: float) -> None:
        """A tuning has evaluated its objective so often for a set of parameters; its least value so far."""

    def works(self, what: str, share: float | None = None) -> None:
        """Something that may take long is done up to a share, or begins, where no share is known."""


class ProgressWatcher(Watcher):
    """Shows simulated time, speed and time left; on a plain stream, a line per stage."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TextColumn("{task.fields[note]}"),
            TimeElapsedColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._ride: TaskID | None = None
        self._judged: TaskID | None = None
        self._judged_from = 0.0
        self._cells: TaskID | None = None
        self._begun = self._cells_begun = 0.0
        self._said = -_EVERY_S
        self._before = self._done = 0
        self._paces: deque[tuple[float, int]] = deque()
        self._most: int | None = None
        self._is_look = self._was_look = False
        self._by_worker: dict[str, int] = {}
        self._searches: dict[str, TaskID] = {}
        self._expected: dict[str, tuple[float, int]] = {}
        self._work: tuple[str, float, TaskID] | None = None

    def __enter__(self) -> Self:
        self._progress.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end_work()
        self._progress.__exit__(kind, error, trace)

    def judging(self, done: int, count: int) -> None:
        """See `Watcher`."""
        now = time.perf_counter()
        self._judged_from = self._judged_from or now
        if now < self._judged_from + SILENT_S:
            return
        if self._judged is None:
            self._judged = self._progress.add_task("judging", total=count, note="")
        note = f"{done} of {count} cells judged"
        self._progress.update(self._judged, completed=done, note=note)
        if not self._console.is_terminal and now > self._said + _EVERY_S:
            self._said = now
            self._console.print(note, highlight=False)

    def ride_begins(self, number: int, count: int, name: str) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            self._progress.remove_task(self._ride)
        which = f" {number}/{count}" if count > 1 else ""
        self._ride = self._progress.add_task(f"ride {name}{which}", total=None, note="")
        self._begun = time.perf_counter()
        if not self._console.is_terminal:
            self._console.print(f"ride {name}{which}", highlight=False, markup=False)

    def ride_goes(self, done_s: float, total_s: float, speed_mps: float) -> None:
        """See `Watcher`."""
        if self._ride is None:
            return
        wall = max(time.perf_counter() - self._begun, 1e-6)
        left = (total_s - done_s) * wall / max(done_s, 1e-6)
        note = (
            f"{done_s:.0f} of {total_s:.0f} s, {done_s / wall:.1f} x real time, "
            f"{3.6 * abs(speed_mps):3.0f} km/h, {left:.0f} s left"
        )
        self._progress.update(self._ride, total=total_s, completed=done_s, note=note)

    def ride_ends(self) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            note = "running its cells" if self._cells is not None else "simulated"
            self._progress.update(self._ride, total=1.0, completed=1.0, note=note)

    def may_come_to(self, most: int) -> None:
        """See `Watcher`."""
        self._most, self._is_look = most, True

    def cells_begin(self, done: int, count: int) -> None:
        """See `Watcher`."""
        if not self._is_look:
            self._most = None
        if not (self._is_look and self._was_look):  # what a stop rule asks for later goes on from before
            self._before = self._done = done
            self._cells_begun = time.perf_counter()
            self._paces = deque([(self._cells_begun, done)])
            self._by_worker = {}
        self._was_look, self._is_look = self._is_look, False
        self._said = time.perf_counter()
        if self._cells is not None:
            self._progress.remove_task(self._cells)
        most = max(count, self._most or 0)
        self._cells = self._progress.add_task("cells", total=most, completed=done, note="")

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        """See `Watcher`."""
        now = time.perf_counter()
        self._by_worker[worker] = self._by_worker.get(worker, 0) + done - self._done
        self._done = done
        seconds = max(now - self._cells_begun, 1e-6)
        while len(self._paces) > 1 and self._paces[1][0] <= now - _PACE_S:
            self._paces.popleft()
        since, had = self._paces[0]
        each_s = max(now - since, 1e-6) / max(done - had, 1)
        self._paces.append((now, done))
        left = f", {timedelta(seconds=round((count - done) * each_s))} left"
        of = f"{done} of {count}"
        if self._most is not None and self._most > count:
            of += f" (at most {self._most})"
            left += f", at most {timedelta(seconds=round((self._most - done) * each_s))}"
        if done - self._before < 2 and done < count:
            left = ""  # the first has waited for a ride, and for what was compiled: it says nothing of others
        each = "+".join(map(str, self._by_worker.values()))
        by = f", by {len(self._by_worker)} workers: {each}" if len(self._by_worker) > 1 else ""
        note = f"{of}, {failed} failed, {(done - self._before) / seconds:.3g} per second{left}{by}"
        if self._cells is not None:
            self._progress.update(self._cells, completed=done, note=note)
        if not self._console.is_terminal and (now > self._said + _EVERY_S or done == count):
            self._said = now
            self._console.print(f"cells: {note}", highlight=False, soft_wrap=True)

    def told(self, line: str) -> None:
        """See `Watcher`."""
        self._console.print(line, highlight=False, soft_wrap=True, markup=False)

    def recording_written(self, number: int, count: int, name: str) -> None:
        """See `Watcher`."""
        if self._ride is not None:
            self._progress.update(self._ride, note=f"{number} of {count} recordings written, {name}")
        if not self._console.is_terminal:
            self._console.print(f"wrote {name} ({number} of {count})", highlight=False)

    def search_begins(self, name: str, each_s: float, evaluations: int) -> None:
        """See `Watcher`."""
        self._expected[name] = time.perf_counter(), evaluations
        whole = timedelta(seconds=round(each_s * evaluations))
        self.told(
            f"search, {name}: some {evaluations} evaluations of {each_s:.3g} s each: about {whole}; "
            "interrupted, the same command goes on"
        )

    def search_goes(self, name: str, evaluations: int, value: float) -> None:
        """See `Watcher`."""
        begun, expected = self._expected.get(name, (time.perf_counter(), 0))
        if self._searches.get(name) is None:
            self._searches[name] = self._progress.add_task(f"search, {name}", total=expected or None, note="")
            self._said = time.perf_counter()
            if not expected and not self._console.is_terminal:
                self._console.print(f"search, {name}", highlight=False)
        note = f"{evaluations} evaluations, {value:.6f}"
        now = time.perf_counter()
        if expected:
            left = max(expected - evaluations, 0) * (now - begun) / max(evaluations, 1)
            note += f", some {timedelta(seconds=round(left))} left"
        self._progress.update(self._searches[name], completed=min(evaluations, expected or 0), note=note)
        if not self._console.is_terminal and now > self._said + _EVERY_S:
            self._said = now
            self._console.print(f"search, {name}: {note}", highlight=False, soft_wrap=True)

    def works(self, what: str, share: float | None = None) -> None:
        """See `Watcher`."""
        now = time.perf_counter()
        if self._work is None or self._work[0] != what:
            self._end_work()
            # On a terminal it is seen at once, and goes when it is done; on a plain stream after a while.
            self._work = what, now, self._progress.add_task(what, total=None, note="")
        _, begun, task = self._work
        if share is None:
            return
        note = f"{100.0 * share:.0f} %"
        self._progress.update(task, total=1.0, completed=share, note=note)
        is_due = now > begun + SILENT_S and now > self._said + _EVERY_S
        if not self._console.is_terminal and is_due:
            self._said = now
            self._console.print(f"{what}: {note}", highlight=False, markup=False)

    def _end_work(self) -> None:
        """What was worked at is done: its line goes."""
        if self._work is not None:
            self._progress.remove_task(self._work[2])
        self._work = None
