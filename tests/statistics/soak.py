"""A long campaign that is disturbed in every way, and ends with the table of one that was not.

    python tests/statistics/soak.py --cells 20000 --seed 1

Cells are short kinematic rides with three estimators, one of which raises, hangs or eats memory on some
recordings (it has a time and a memory limit). At random moments, drawn from the seed, a worker, the run
itself or the scheduler of a cluster is killed with SIGKILL, and twice the disk of the results is full. After
each the same command goes on. In the end the scores are those of an undisturbed run to the bit, the memory
of the longest session has not grown, and no process and no file is left. Exit code 0 if all of it holds.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))
from shortest_ride import DESIGN, SHORTEST_RIDE

TOKEN = "SIMRAIL_SOAK"
"""In the environment of every process that is begun here, and of all that these begin."""

ROGUE = """
import zlib
from dataclasses import dataclass

import numpy as np

from simrail.estimators.baselines import DesignAngles


@dataclass(frozen=True)
class Rogue:
    "Raises, hangs or eats memory on some recordings, always the same ones."
    often: float = 1.0
    causal = True

    def estimate(self, recording):
        share = zlib.crc32(recording.imu.to_numpy().tobytes()) / 2**32 / self.often
        if len(recording.imu) > 64:
            if share < 0.005:
                raise ValueError("it does not like this one")
            while share < 0.006:
                pass
            if share < 0.008:
                np.ones(1_000_000_000)
        return DesignAngles().estimate(recording)
"""

METHODS = """
[[estimator]]
name = "ekf"
method = "AttitudeEkf"
[[estimator]]
name = "rogue"
method = "rogue.py:Rogue"
time_limit_s = {limit_s}
memory_limit_mb = 500.0
options = {{ often = {often} }}
"""


def scenario(*, draws: int, limit_s: float, often: float) -> str:
    """Two rides of so many draws, with three methods."""
    ride = SHORTEST_RIDE.replace("speed_kmh = 10.0", "speed_kmh = [10.0, 20.0]")
    ride = ride.replace("seed = 3", f"seed = 5\nmonte_carlo = {{ sensor_draws = {draws} }}")
    return ride + DESIGN + METHODS.format(limit_s=limit_s, often=often)


PROGRAM = """
import sys
from simrail import results
from simrail.campaign import campaign

campaign._MOST_CELLS = {batch}  # more batches, so more moments
# The figures of the page take longer than the campaign.
results.write_report = lambda path, **keywords: path.write_text("<html></html>")
if __name__ == "__main__":
    from simrail.cli.main import call
    sys.exit(call(sys.argv[1:]))
"""

WORKERS = 2
GROWN_S = 10.0
"""After so long a worker has loaded what it needs; before, its memory says nothing."""
DONE = (0, 1)
"""Exit codes of a run that has ended by itself; 1 is also that of one with failed rows, as here."""


def batch_of(cells: int) -> int:
    """Cells of a batch: few enough that all events of a short campaign find a moment of their own."""
    return min(5, max(1, cells // 60))


def children(pid: int) -> list[int]:
    """Processes that one has begun."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            for child in map(int, task.read_text().split()):
                found.append(child)
    return found


def rss_mb(pid: int) -> float:
    """Memory of a process, MB; 0 if it is gone."""
    with contextlib.suppress(OSError, IndexError):
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    return 0.0


def command_of(pid: int) -> str:
    """Command line of a process; "" if it is gone."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    return ""


@dataclass
class Soak:
    """A disturbed campaign.

    Attributes
    ----------
    folder : Path
        Where all of it is: the scenario, rides, temporary files and the disk of the results.
    cells : int
        How many cells.
    events : list of str
        What is to happen, in order: "worker", "run", "scheduler", "disk".
    chance : random.Random
        When it happens.
    """

    folder: Path
    cells: int
    events: list[str]
    chance: random.Random
    happened: Counter[str] = field(default_factory=Counter)
    memory: list[tuple[int, int, float, float]] = field(default_factory=list)
    """Of each look: pid of the run, batches kept, memory of the run and of its largest worker, MB."""
    born: dict[int, float] = field(default_factory=dict)
    """When a worker was seen first."""
    problems: list[str] = field(default_factory=list)

    @property
    def environment(self) -> dict[str, str]:
        own = {TOKEN: str(self.folder), "SIMRAIL_RIDES": str(self.folder / "rides")}
        return dict(os.environ) | own | {"TMPDIR": str(self.folder / "tmp")}

    @property
    def disk(self) -> Path:
        return self.folder / "disk"

    def kept(self) -> int:
        """Batches that are kept."""
        return sum(1 for _ in self.disk.glob(".disturbed.unfinished-*/[0-9]*.parquet"))

    def start(self, out: Path, *words: str) -> subprocess.Popen[str]:
        """Begin the run, or go on with it."""
        command = [sys.executable, "program.py", "run", "mine.toml", "--out", str(out), *words]
        with (self.folder / "said.txt").open("w") as said:
            return subprocess.Popen(
                command,
                cwd=self.folder,
                env=self.environment,
                stdout=subprocess.DEVNULL,
                stderr=said,
                text=True,
            )

    def run(self) -> None:
        """Session after session, until one ends by itself with results."""
        while not (self.disk / "disturbed" / "scores.parquet").exists():
            event = self.events[0] if self.events else None
            if event == "scheduler":
                self.clustered()
            else:
                self.session(self.start(self.disk / "disturbed", "--workers", str(WORKERS)), None)

    def clustered(self) -> None:
        """A session on a cluster of our own, which loses its scheduler."""
        log = self.folder / "scheduler.txt"
        dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--no-dashboard"]
        # Killed, dask leaves what it has: scheduler and workers have a folder of their own for it.
        environment = self.environment | {"DASK_TEMPORARY_DIRECTORY": str(self.folder / "dask")}
        where = {"cwd": self.folder / "tmp", "env": environment, "stdout": subprocess.DEVNULL}
        with log.open("w") as said:
            scheduler = subprocess.Popen([*dask, "--host", "127.0.0.1", "--port", "0"], stderr=said, **where)
        while not (found := re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text())):
            time.sleep(0.1)
        dask = [sys.executable, "-m", "distributed.cli.dask_worker", "--no-dashboard", found[0]]
        workers = [
            subprocess.Popen([*dask, "--nthreads", "1", "--no-nanny"], stderr=subprocess.DEVNULL, **where)
            for _ in range(WORKERS)
        ]
        try:
            self.session(self.start(self.disk / "disturbed", "--cluster", found[0]), scheduler)
        finally:
            for process in (*workers, scheduler):
                process.kill()
                process.wait()

    def session(self, run: subprocess.Popen[str], scheduler: subprocess.Popen[bytes] | None) -> None:
        """Watch a session, and let happen what is due."""
        due, in_a_row = self.kept() + self.gap(least=1), 0
        while run.poll() is None:
            time.sleep(0.5)
            kept = self.kept()
            # Neither the tracker of shared resources, nor the processes of estimators with a limit.
            workers = [pid for pid in children(run.pid) if "popen_loky" in command_of(pid)]
            now = time.monotonic()
            grown = [pid for pid in workers if now - self.born.setdefault(pid, now) > GROWN_S]
            self.memory.append((run.pid, kept, rss_mb(run.pid), max(map(rss_mb, grown), default=0.0)))
            if not self.events or kept < due:
                continue
            event = self.events[0]
            if event == "scheduler" and scheduler is None:
                event = "run"  # on to the cluster, by a kill more
            if self.happen(event, run, workers, scheduler):
                self.happened[event] += 1
                if event == self.events[0]:
                    self.events.pop(0)
                in_a_row = in_a_row + 1 if event == "worker" else 0
                least = int(in_a_row > 0 and self.events[:1] == ["worker"])
                if in_a_row == 2 and least:
                    # A cell whose worker is killed time after time fails, as it should: let these be done.
                    least, in_a_row = WORKERS * batch_of(self.cells), 0
                due = self.kept() + self.gap(least=least)
                print(f"{event}, at {self.kept()} batches; left {len(self.events)}", flush=True)
        said = (self.folder / "said.txt").read_text()
        if "Traceback" in said:
            self.problems.append(f"a traceback: {said[-1500:]}")
        if run.returncode not in (*DONE, -signal.SIGKILL):
            self.problems.append(f"exit code {run.returncode}: {said[-500:]}")
        (self.disk / "filler").unlink(missing_ok=True)

    def gap(self, *, least: int = 0) -> int:
        """Batches until the next event: all of them within the first nine tenths, however few there are."""
        batches = max(2, self.cells // batch_of(self.cells))
        left = max(0.0, 0.9 * batches - self.kept())
        most = int(2.0 * left / max(1, len(self.events)))
        return self.chance.randint(max(least, min(1, most)), max(least, most))

    def happen(
        self,
        event: str,
        run: subprocess.Popen[str],
        workers: list[int],
        scheduler: subprocess.Popen[bytes] | None,
    ) -> bool:
        """Let something happen; whether it could."""
        time.sleep(self.chance.uniform(0.0, 0.5))
        if event == "worker" and not workers:
            return False
        if event == "disk":
            fill(self.disk / "filler")
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(timeout=300.0)
            said = (self.folder / "said.txt").read_text()
            if run.poll() != 1 or "No space left" not in said:
                self.problems.append(f"a full disk: exit code {run.poll()}, {said[-300:]!r}")
            (self.disk / "filler").unlink()
            return True
        if event == "scheduler" and scheduler is not None:
            scheduler.kill()
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(timeout=300.0)
            return True
        with contextlib.suppress(ProcessLookupError):
            os.kill(run.pid if event == "run" else self.chance.choice(workers), signal.SIGKILL)
        return True

    def judge(self, whole: pd.DataFrame) -> None:
        """Set the scores beside those of an undisturbed run, and look for what is left."""
        ours = pd.read_parquet(self.disk / "disturbed" / "scores.parquet")
        tables = [table[table["metric"] != "us_per_sample"].reset_index(drop=True) for table in (whole, ours)]
        try:
            pd.testing.assert_frame_equal(*tables, check_exact=True)
            print(f"{len(tables[0])} rows are the same to the bit")
        except AssertionError as error:
            self.problems.append(f"another table: {error}")
        states = ours[ours["estimator"] == "rogue"].drop_duplicates("cell")["status"].astype(str)
        reasons = Counter(states[states != "ok"].str.slice(0, 60))
        print(f"failed rows of the rogue: {dict(reasons)}")
        self.judge_memory()
        self.judge_leftovers()

    def judge_memory(self) -> None:
        """In the longest session neither the run nor a worker grows from the second third to the last."""
        frame = pd.DataFrame(self.memory, columns=["run", "kept", "run_mb", "worker_mb"])
        frame = frame[(frame["worker_mb"] > 0.0) & (frame["kept"] < frame["kept"].max())]  # not as it ends
        if frame.empty:
            print("no session was long enough to judge its memory")
            return
        longest = frame[
            frame["run"] == frame.groupby("run")["kept"].agg(lambda kept: kept.max() - kept.min()).idxmax()
        ]
        third = max(1, len(longest) // 3)
        for name in ("run_mb", "worker_mb"):
            values = longest[name].to_list()
            first, last = (
                statistics.median(values[third : 2 * third] or values),
                statistics.median(values[-third:]),
            )
            print(
                f"{name}, longest session ({longest['kept'].min()} to {longest['kept'].max()} batches): "
                f"{first:.0f} in its second third, {last:.0f} in its last, {max(values):.0f} at most"
            )
            if last > 1.3 * first + 50.0:
                self.problems.append(f"{name} grows from {first:.0f} to {last:.0f} MB")

    def judge_leftovers(self) -> None:
        """No process, no temporary file, nothing beside the results."""
        end = time.monotonic() + 30.0
        while (alive := with_token(self.folder)) and time.monotonic() < end:
            time.sleep(0.5)
        if alive:
            self.problems.append(f"processes are left: {[command_of(pid)[:80] for pid in alive]}")
        beside = sorted(path.name for path in self.disk.iterdir() if path.name not in ("disturbed", "whole"))
        temporary = sorted(path.name for path in (self.folder / "tmp").iterdir())
        drafts = sorted(path.name for path in (self.folder / "rides").rglob("*") if "draft" in path.name)
        for words, names in (("beside the results", beside), ("temporary", temporary), ("of rides", drafts)):
            print(f"left {words}: {len(names)} {names[:6]}")
            if names:
                self.problems.append(f"left {words}: {names[:6]}")


def with_token(folder: Path) -> list[int]:
    """Processes that were begun for a soak in a folder, this one aside."""
    word, found = f"{TOKEN}={folder}".encode(), []
    for place in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if word in place.read_bytes() and int(place.parent.name) != os.getpid():
                found.append(int(place.parent.name))
    return found


def fill(file: Path) -> None:
    """Take all of a disk that is free, and go on taking it until the file is taken away."""

    def write() -> None:
        with contextlib.suppress(OSError), file.open("ab", buffering=0) as stream:
            while True:
                with contextlib.suppress(OSError):
                    stream.write(bytes(1 << 16))
                    continue
                for size in (4096, 1):
                    with contextlib.suppress(OSError):
                        stream.write(bytes(size))
                time.sleep(0.01)
                if not file.exists():
                    return

    threading.Thread(target=write, daemon=True).start()


def events_of(words: str, chance: random.Random) -> list[str]:
    """The events of `worker=12,run=8,scheduler=2,disk=2`, shuffled."""
    counts = {name: int(count) for name, count in (word.split("=") for word in words.split(","))}
    events = [name for name, count in counts.items() for _ in range(count)]
    chance.shuffle(events)
    return events


@contextlib.contextmanager
def small_disk(place: Path, size_mb: int) -> object:
    """A file system of its own size."""
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size_mb}m", "tmpfs", str(place)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)


def main() -> int:
    """Read the command line, and soak."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--cells", type=int, default=20000)
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("--events", default="worker=16,run=10,scheduler=2,disk=2")
    words.add_argument("--limit-s", type=float, default=10.0, help="time limit of the estimator that hangs")
    words.add_argument("--often", type=float, default=1.0, help="how many times more often it misbehaves")
    given = words.parse_args()
    chance, begun = random.Random(given.seed), time.monotonic()
    with tempfile.TemporaryDirectory(prefix="simrail-soak-") as place:
        folder = Path(place)
        (folder / "tmp").mkdir()
        (folder / "rogue.py").write_text(ROGUE)
        (folder / "program.py").write_text(PROGRAM.format(batch=batch_of(given.cells)))
        (folder / "mine.toml").write_text(
            scenario(draws=given.cells // 2, limit_s=given.limit_s, often=given.often)
        )
        soak = Soak(folder, given.cells, events_of(given.events, chance), chance)
        with small_disk(soak.disk, 64 + given.cells // 20):
            run = soak.start(soak.disk / "whole", "--workers", str(WORKERS))
            if run.wait() not in DONE or not (soak.disk / "whole" / "scores.parquet").exists():
                print((folder / "said.txt").read_text()[-2000:])
                return 1
            print(f"undisturbed: {time.monotonic() - begun:.0f} s", flush=True)
            soak.run()
            print(f"disturbed {dict(soak.happened)}: {time.monotonic() - begun:.0f} s in all", flush=True)
            if soak.events:
                soak.problems.append(f"done before these could happen: {soak.events}")
            soak.judge(pd.read_parquet(soak.disk / "whole" / "scores.parquet"))
            if soak.problems:
                print((soak.disk / "disturbed" / "run.log").read_text())
    for problem in soak.problems:
        print(f"PROBLEM: {problem}")
    return int(bool(soak.problems))


if __name__ == "__main__":
    sys.exit(main())
