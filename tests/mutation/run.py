"""Faults planted by cosmic-ray, a seeded sample of them, and how many the tests find.

    python tests/mutation/run.py --count 400 --seed 1 --processes 2

Ended at any time, the same command goes on where it was. See README.md beside this file.
"""

from __future__ import annotations

import argparse
import compileall
import multiprocessing
import os
import pickle
import shutil
import tempfile
import time
import tomllib
from pathlib import Path

import mutants
from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkItem, WorkResult
from tests_of import TestMap, command, jit_switch, room_of

from simrail.scoring.share import wilson

HOME = Path(__file__).resolve().parents[2]
MOST_WAIT_S = 1200.0
"""For a fault that neither ends nor works; one that works is ended by its time on the processor."""

EQUIVALENT = Path(__file__).with_name("equivalent.toml")
"""Faults that no test can find, each with its reason."""


def main() -> None:
    """Read the command line, and run."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--count", type=int, default=400, help="faults of the sample")
    words.add_argument("--seed", type=int, default=1, help="of the sample")
    words.add_argument("--processes", type=int, default=2)
    words.add_argument("--room", default="", help="only of modules whose path begins so")
    words.add_argument("--work", type=Path, help="folder of the session")
    words.add_argument("--again", action="store_true", help="survivors once more, with the tests of today")
    words.add_argument("--report", action="store_true", help="only tell what is known")
    words.add_argument("--near", action="store_true", help="only the tests that are called by the module")
    words.add_argument("--most-s", type=float, default=1e9, help="end after so many seconds")
    given = words.parse_args()
    work = (given.work or Path(tempfile.gettempdir()) / f"simrail-mutation-{given.seed}").resolve()
    work.mkdir(parents=True, exist_ok=True)
    first = lay_out(work, "copy")
    os.chdir(first)
    items = drawn(work, first, given)
    items = [item for item in items if item.mutations[0].module_path.as_posix().startswith(given.room)]
    with use_db(str(work / "session.sqlite"), WorkDB.Mode.create) as session:
        there = {item.job_id for item in session.work_items}
        session.add_work_items([item for item in items if item.job_id not in there])
        if not given.report:
            run(session, items, work, given)
        report(session, items)


def drawn(work: Path, first: Path, given: argparse.Namespace) -> list[WorkItem]:
    """The sample of a session, which takes some time to draw: once."""
    kept = work / f"sample-{given.count}.pickle"
    if not kept.exists():
        kept.write_bytes(pickle.dumps(mutants.sample(first, seed=given.seed, count=given.count)))
    items: list[WorkItem] = pickle.loads(kept.read_bytes())
    return items


def lay_out(work: Path, name: str) -> Path:
    """A copy to mutate, in the layout of a wheel: the session's sources, and the tests of today."""
    kept = work / "sources"
    if not kept.exists():
        draft = work / "sources.draft"
        shutil.rmtree(draft, ignore_errors=True)
        _copy(HOME / "simrail", draft / "simrail")
        for part in ("estimators", "scenarios"):
            _copy(HOME / part, draft / "simrail" / part)
        draft.rename(kept)
    copy = work / name
    shutil.rmtree(copy, ignore_errors=True)
    _copy(kept, copy)
    for part in ("estimators", "scenarios"):
        (copy / part).symlink_to(f"simrail/{part}")
    for part in ("tests", "docs"):
        _copy(HOME / part, copy / part)
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(HOME / name, copy / name)
    _copy(HOME / "results" / "reference", copy / "results" / "reference")
    compileall.compile_dir(copy / "simrail", quiet=2)  # a run that mutates writes no bytecode
    return copy


def _copy(source: Path, target: Path) -> None:
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "_build"))


def environment_of(copy: Path) -> dict[str, str]:
    """That of the tests: this copy, and a cache of compiled kernels that copies share."""
    paths = os.pathsep.join((str(copy), str(copy / "tests" / "mutation")))
    own = {"PYTHONPATH": paths, "XDG_CACHE_HOME": str(copy.parent / "cache")}
    return dict(os.environ) | own | {"OMP_NUM_THREADS": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}


def run(session: WorkDB, items: list[WorkItem], work: Path, given: argparse.Namespace) -> None:
    """Run what has no result yet; with ``--again`` also what has survived."""
    begun = time.monotonic()
    first = work / "copy"
    tests = TestMap(work / "tests.json", first)
    known = {name for name, result in session.results if not given.again or result.is_killed}
    left = [item for item in items if item.job_id not in known]
    context = multiprocessing.get_context("spawn")
    numbers = context.SimpleQueue()
    for number in range(given.processes):
        numbers.put(number)
    with context.Pool(given.processes, _begin, (work, numbers)) as pool:
        for room, near in ((room, near) for room in mutants.ROOMS for near in (True, False)):
            own = [item for item in left if room_of(item.mutations[0]) == room and item.job_id not in known]
            if given.near and not near:
                continue
            tests.refresh([item.mutations[0] for item in own], environment_of(first), near=near)
            orders = [(item, tests.tests(item.mutations[0], near=near)) for item in own]
            for done, (name, result, took) in enumerate(pool.imap_unordered(_run_one, orders), 1):
                if result.is_killed or not near or given.near:
                    session.set_result(name, result)
                    known.add(name)
                outcome = result.test_outcome.value if result.test_outcome else result.worker_outcome.value
                print(f"{room} {done} of {len(own)}  {outcome:10} {took:5.0f} s  {name}", flush=True)
                if time.monotonic() - begun > given.most_s:
                    pool.terminate()
                    return


def _begin(work: Path, numbers: multiprocessing.SimpleQueue[int]) -> None:
    """A process that mutates a copy of its own."""
    copy = lay_out(work, f"copy{numbers.get()}")
    os.chdir(copy)
    os.environ.update(environment_of(copy))


def _run_one(order: tuple[WorkItem, dict[str, float]]) -> tuple[str, WorkResult, float]:
    item, tests = order
    os.environ.update(jit_switch(tests))
    begun = time.monotonic()
    if tests:
        result = mutate_and_test(item.mutations, command(tests), MOST_WAIT_S)
    else:
        result = WorkResult(
            WorkerOutcome.NO_TEST, test_outcome=TestOutcome.SURVIVED, output="no test runs it"
        )
    return item.job_id, result, time.monotonic() - begun


def report(session: WorkDB, items: list[WorkItem]) -> None:
    """Print the survivors, and the share that was found with its Wilson interval of 95 %."""
    results = dict(session.results)
    equal = tomllib.loads(EQUIVALENT.read_text()).get("fault", [])
    reasons = {(one["module"], one["becomes"]): one["why"] for one in equal}
    done = [item for item in items if item.job_id in results]
    alive = [item for item in done if not results[item.job_id].is_killed]
    same = 0
    for item in alive:
        module, result = item.mutations[0].module_path.as_posix(), results[item.job_id]
        why = next((reasons[module, line] for line in _changed(result, "+") if (module, line) in reasons), "")
        same += bool(why)
        _print_survivor(item.mutations[0], result, why)
    killed = len(done) - len(alive)
    for words, of in (("of all", len(done)), ("of those that are no equivalents", len(done) - same)):
        low, high = wilson(killed, of) if of else (0.0, 1.0)
        print(f"{killed} of {of} killed {words}: {killed / max(of, 1):.1%} [{low:.1%}, {high:.1%}]")
    if len(done) < len(items):
        print(f"{len(items) - len(done)} have not been run yet")


def _print_survivor(mutation: MutationSpec, result: WorkResult, why: str) -> None:
    note = f"equivalent: {why}" if why else "" if result.diff else result.output
    print(f"\n{mutants.name_of(mutation)} in {mutation.definition_name} {note}")
    for sign in "-+":
        for line in _changed(result, sign):
            print(f"    {sign} {line}")


def _changed(result: WorkResult, sign: str) -> list[str]:
    """Lines that were taken away or put in their place, without white space around them."""
    lines = (result.diff or "").splitlines()
    return [line[1:].strip() for line in lines if line[:1] == sign and line[:3] != 3 * sign]


if __name__ == "__main__":
    main()
