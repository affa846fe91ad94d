"""Which tests run a line: found by coverage, one file of tests after the other.

Kernels are not compiled: coverage does not see compiled lines, and each fault would be compiled anew. Only
the tests of campaigns, which run whole rides and mutate no kernel, have theirs from the cache.

What a fixture of a file runs counts for all tests of that file, as it is run before the first of them and
judged by others. What runs at import only (constants, fields) counts for whatever uses the module. Tests that
fail or take too long are left out.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from cosmic_ray.work_item import MutationSpec
from coverage import CoverageData
from mutants import ROOMS

TESTS = {
    "simrail/scoring": ("tests/scoring",),
    "simrail/sensors/measure.py": ("tests/sensors",),
    "simrail/estimators/odometry": ("tests/estimators/odometry", "tests/estimation"),
    "simrail/estimators/kalman.py": ("tests/estimators/test_kalman.py", "tests/estimators/odometry"),
    "simrail/campaign": ("tests/campaign",),
}
"""The tests of each room: its mirror, and what else is near."""

COMPILED = ("tests/campaign",)
"""Tests whose kernels are compiled: they run whole rides, and mutate none."""

LEFT_OUT = ("test_killed.py", "test_cluster.py")
"""These run others as processes of their own."""

MOST_TEST_S, MOST_FILE_S = 20.0, 600.0
"""On the processor."""

BUDGET_S = 60.0
"""Of tests for one fault, the shortest first; all have to pass for it to survive."""

_PYTEST = "-m pytest -p mutation_limit --no-header -q -o addopts=--import-mode=importlib -m 'not slow'"


def command(tests: dict[str, float]) -> str:
    """The command that runs tests until one fails, or they take several times their time on the processor."""
    named = " ".join(f"'{test}'" for test in tests)
    most_s = 90 + int(4.0 * sum(tests.values()))
    return f'bash -c "ulimit -t {most_s}; exec {sys.executable} {_PYTEST} -x --tb=line {named}"'


def room_of(mutation: MutationSpec) -> str:
    """The room that a fault is in."""
    return next(room for room in ROOMS if mutation.module_path.as_posix().startswith(room))


def jit_switch(tests: Iterable[str]) -> dict[str, str]:
    """The environment's switch for tests: kernels compiled or not."""
    return {"NUMBA_DISABLE_JIT": "0" if any(test.startswith(COMPILED) for test in tests) else "1"}


class TestMap:
    """Tests by what they run, kept in a file; asked again only where a file of tests has changed.

    Parameters
    ----------
    file : Path
        Where it is kept.
    root : Path
        The sources and tests: the working folder of the runs.
    """

    __test__ = False

    def __init__(self, file: Path, root: Path) -> None:
        self._file, self._root = file, root
        self._map: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}

    def refresh(self, mutations: Sequence[MutationSpec], environment: dict[str, str], *, near: bool) -> None:
        """Run the files of tests of faults that are new or have changed."""
        files = {file for mutation in mutations for file in self._files(mutation, near=near)}
        for path in sorted(files):
            name = path.relative_to(self._root).as_posix()
            code = hashlib.sha256(path.read_bytes()).hexdigest()
            if self._map.get(name, {}).get("code") != code:
                self._map[name] = {"code": code} | self._run(name, environment | jit_switch([name]))
                self._file.write_text(json.dumps(self._map))
                took = sum(self._map[name]["tests"].values())
                print(f"{name}: {len(self._map[name]['tests'])} tests, {took:.0f} s", flush=True)

    def tests(self, mutation: MutationSpec, *, near: bool) -> dict[str, float]:
        """The tests for a fault, with the time of each, the shortest first: near ones, or all others."""
        module = mutation.module_path.as_posix()
        lines = set(range(mutation.start_pos[0], mutation.end_pos[0] + 1))
        exact: dict[str, float] = {}
        whole: dict[str, float] = {}
        nearest = self._files(mutation, near=True)
        files = (
            nearest if near else [file for file in self._files(mutation, near=False) if file not in nearest]
        )
        for name in (file.relative_to(self._root).as_posix() for file in files):
            one = self._map[name]
            runs = one["runs"].get(module, {})
            shared = lines & set(runs.get("", ()))
            for test, seconds in one["tests"].items():
                if shared or lines & set(runs.get(test, ())):
                    exact[test] = seconds
                if runs.get(test) or runs.get(""):
                    whole[test] = seconds
        chosen, total = {}, 0.0
        for test, seconds in sorted((exact or whole).items(), key=lambda item: (item[1], item[0])):
            total += seconds
            if total > BUDGET_S:
                break
            chosen[test] = seconds
        return chosen

    def _files(self, mutation: MutationSpec, *, near: bool) -> list[Path]:
        """Files of tests of the room of a fault; near ones are called by its module, or its kernel's user."""
        stem = f"test_{mutation.module_path.stem}"
        places = [self._root / name for name in TESTS[room_of(mutation)]]
        files = [
            file for place in places for file in ([place] if place.is_file() else place.rglob("test_*.py"))
        ]
        files = [file for file in files if file.name not in LEFT_OUT]
        return (
            [file for file in files if file.stem in (stem, stem.removesuffix("_kernel"))] if near else files
        )

    def _run(self, name: str, environment: dict[str, str]) -> dict[str, Any]:
        data = self._root / ".mutation-coverage"
        data.unlink(missing_ok=True)
        settings = self._root / ".mutation-coveragerc"
        rooms = ",".join(room if room.endswith(".py") else f"{room}/*" for room in ROOMS)
        settings.write_text(f"[run]\ndata_file = {data}\ninclude = {rooms}\n")
        words = f"{_PYTEST} -vv --tb=no --durations=0 --durations-min=0 {name}"
        run = f"{sys.executable} -m coverage run --rcfile={settings} {words}"
        limits = environment | {"MUTATION_TEST_S": str(MOST_TEST_S)}
        words = ["bash", "-c", f"ulimit -t {MOST_FILE_S:.0f}; exec {run}"]
        said = subprocess.run(
            words, cwd=self._root, env=limits, capture_output=True, text=True, check=False
        ).stdout
        passed = set(re.findall(r"^(tests/\S+::.+?) PASSED", said, re.MULTILINE))
        seconds: dict[str, float] = {}
        for took, test in re.findall(r"^([\d.]+)s (?:call|setup|teardown) +(tests/.+?)$", said, re.MULTILINE):
            seconds[test] = seconds.get(test, 0.0) + float(took)
        return {"tests": {test: seconds.get(test, 0.0) for test in sorted(passed)}, "runs": self._runs(data)}

    def _runs(self, data: Path) -> dict[str, dict[str, list[int]]]:
        """Lines by module and test; under "" those of fixtures, for all tests of the file."""
        runs: dict[str, dict[str, list[int]]] = {}
        if not data.exists():
            return runs
        measured = CoverageData(str(data))
        measured.read()
        for file in measured.measured_files():
            by_test: dict[str, set[int]] = {}
            for line, contexts in measured.contexts_by_lineno(file).items():
                for context in contexts:
                    test, _, phase = context.rpartition("|")
                    if test:
                        by_test.setdefault(test if phase == "call" else "", set()).add(line)
            module = Path(file).resolve().relative_to(self._root.resolve()).as_posix()
            runs[module] = {test: sorted(lines) for test, lines in by_test.items()}
        return runs
