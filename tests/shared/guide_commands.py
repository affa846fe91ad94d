"""Every command that README, CONTRIBUTING and the guide name, and what becomes of it in the tests."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
MADE = ("validation",)
"""Pages that git does not keep; what they name is checked when they are made."""

PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *sorted(page for page in (ROOT / "docs").glob("*.md") if page.stem not in MADE),
    ROOT / "simrail" / "lessons" / "TEACHER.md",
]

PROGRAMS = "simrail|python|pip|pytest|sphinx-build|nox"

PATTERNS = {
    "simrail new KIND NAME": "stands for the commands above it",
    "simrail schema KIND": "stands for six: simrail schema scenario is run",
    "simrail sensitivity NAME": "stands for simrail sensitivity sensitivity",
    "simrail grade NAME --for ...": "stands for simrail grade consumer",
    "simrail new track my_line --from FILE": "run by tests/cli with files of both kinds",
    "simrail export SCENARIO --format mcap --out rides": "tests/campaign export and read one",
    "python results/reference/bounds.py DIR ...": "of the results of an hour",
    "simrail run which_imu --out DIR": "half an hour; it is read with its settings",
    "python results/reference/greatest.py DIR": "of the results of an hour",
    "python results/reference/which_imu.py DIR": "of the results of half an hour",
    "simrail estimate RIDE.toml --estimator ZeroVelocityOdometry --set smoothed=true": "my_ride.toml is",
}
"""Lines that hold a word for something of the reader's own."""

TOO_LONG = {
    "simrail grade all": "many minutes: each shipped grade, with its budget",
    "simrail grade consumer --for 'roll<0.5deg'": "a minute and more: run by tests/cli at its own settings",
    "simrail grade lord_3dm_gx4_25 --for 'roll<0.1deg at 60km/h'": "likewise",
    "simrail grade lord_3dm_gx4_25,tactical --for 'roll<0.1deg at 60km/h'": "likewise",
    "simrail tune my_ride.toml": "two minutes; tests/cli tune a short ride",
    "simrail estimate my_ride.toml --set tuning=my_ride_cml.toml": "of the tuning above; tests/cli do it",
    "simrail sensitivity sensitivity --method morris --set engine=compiled --set "
    "'vehicle_factors.load={ uniform = [0.9, 1.3] }'": "minutes; tests/scenario have a short one",
    "simrail grade my_imu.toml --for 'roll<0.1deg in curves at 60km/h'": "likewise",
    "simrail grade my_imu.toml,lord_3dm_gx4_25 --for 'roll<0.1deg in curves at 60km/h'": "likewise",
    "simrail grade my_imu.toml --for 'roll<0.1deg' --mount axle --devices 20": "likewise",
    "simrail grade my_imu.toml --for 'roll<0.1deg for 80%' --devices 20": "likewise",
    "simrail sensitivity sensitivity": "some minutes; tests/campaign runs small ones",
    "simrail spectra shaking": "a multibody ride with all waves; tests/cli runs a short one",
    "simrail tune metro_geometry --estimator TrajectorySmoother --method cml --ride go70": "minutes",
    "simrail estimate ride_1.toml ride_2.toml --fuse": "two rides of one's own; tests/cli makes them",
    "simrail export go20a --format csv --out rides": "a multibody ride of 2 km",
    "simrail export standstill --format csv --out standstill": "an hour of six devices",
    "simrail film go20a --from 380 --to 600": "quick_kinematic's is made in its place",
    "simrail film results/go20a": "of the ride above",
    "simrail film go20a --from 420 --to 480 --gif curve.gif": "likewise; tests/report make moving pictures",
    "simrail figure results/go20a answer --out a.pdf": "results/quick_kinematic is run in its place",
    "simrail imu --from-rest rest.csv --out my_imu": "hours of a device at rest; tests/cli has a short one",
    "simrail run validation --cluster tcp://host:8786": "tests/campaign has one of two workers",
    "simrail run validation_quick --cell 100": "a multibody ride; it is read with its settings",
    "simrail run mine.toml": "the same scenario as quick_kinematic, which is run",
    "simrail run quick_kinematic --set ride.speed_kmh=[20,50,80] --out results/speeds": "three like it",
    "simrail open": "opens a browser",
    "simrail vehicle manchester_1": "with --out it is run",
    "simrail check my_scenario.toml": "mine.toml is checked",
    "simrail run metro_geometry --beside results/scale_track": "of results of many minutes",
}
"""Lines that are not run as they stand, and why."""

ELSEWHERE = {
    "pip install 'simrail[lessons]'": "by hand, in a new environment",
    "pip install 'simrail[sensitivity]'": "in the extra test",
    "pip install 'simrail[loggers]'": "what it brings is in the extra test",
    'pip install "simrail[loggers]"': "likewise",
    "pip install 'simrail[ifc]'": "by hand: 55 MB for one kind of file",
    "pytest -n 0": "this is one",
    "pytest -m long": "by .ci/run",
    "pytest -m slow": "minutes",
    "pytest --cov": "by .ci/run",
    "pytest -n 0 tests/benchmarks --benchmark-only": "a benchmark",
    "pytest -m slow -s -k simpack tests/physics/test_vehicle_loads.py": "minutes",
    "pip install -e .": "by .ci/run",
    "pip install -e . && simrail run go20a": "by .ci/run",
    'pip install -e ".[test]" && pytest': "by .ci/run",
    'pip install -e ".[docs]" && sphinx-build docs docs/_build': "by .ci/run",
    "python -m venv .venv && . .venv/bin/activate": "by .ci/run",
    "python .ci/static.py": "by .ci/run",
    "python -m simrail.lessons.rides": "tests/lessons compare what it made",
    "python -m simrail.lessons.notebooks.drift": "by tests/lessons",
    "python results/reference/make.py": "an hour",
    "python results/reference/track_relative.py results/track_relative": "of half an hour's results",
    "python results/reference/track_relative.py DIR": "of half an hour's results",
    "python results/reference/track_relative_faults.py": "minutes",
    "python tests/statistics/across_machines.py": "minutes; tests/statistics run it",
    "python tests/statistics/soak.py": "an hour",
    "python tests/bad_input/fuzz.py --seed 1 --count 1000": "tests/bad_input run a hundred",
    "python tests/benchmarks/page_rates.py --film FILE.html": "a benchmark",
    "python tests/benchmarks/page_rates.py --lessons": "a benchmark",
}
"""Lines that are no command of simrail's own."""

PARTS_ONLY = {"simrail new ride": "one of simrail new, whose NAME is not said"}
"""Commands that a sentence names without their arguments."""

LONG_RUNS = (
    *(
        "bounds_multibody",
        "coverage",
        "bounds",
        "compensation",
        "go20a",
        "imu_only",
        "leaves",
        "manchester_cases",
        "metro_geometry",
        "metro_ride",
    ),
    *("metro_table3", "odometry", "passes", "scale_greatest", "scale_track", "shaking", "track_relative"),
    *("track_relative_parts", "validation", "validation_quick", "vertical_profile", "which_imu"),
)
"""Scenarios of minutes: they are read with their settings, nothing is simulated."""


class Command(NamedTuple):
    """A line, without what is said of it, and the page that it stands on."""

    page: str
    line: str

    @property
    def words(self) -> list[str]:
        """As a shell parts it."""
        return shlex.split(self.line)


def commands() -> list[Command]:
    """Commands of all pages in their order, each once a page: in blocks, indented, and within sentences."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        lines = re.findall(rf"^(?:\$ |    )((?:{PROGRAMS})\b[^\n]*)$", text, re.MULTILINE)
        lines += re.findall(rf"`((?:{PROGRAMS}) [^`]*)`", text)
        for line in lines:
            told = re.sub(r"(?<!\S)#(?!\S).*$", "", line)
            told = " ".join(told.split())
            # Where a sentence names a command it may be no more than its name.
            whole = " " in told and not re.fullmatch(r"simrail \w+", told)
            if whole or re.fullmatch(r"simrail (?:list|cache|lesson|open)", told):
                found.append(Command(page.stem, told))
    return list(dict.fromkeys(found))
