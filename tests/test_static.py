"""The wall that static checks hold: planted faults are caught, as links to a checkout and from a wheel.

A copy of the sources is checked, with a fault in it, by the very script that `.ci/run` calls.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = {
    "campaign", "cli", "core", "estimation", "lessons", "recording", "report",
    "ride", "scenario", "scoring", "sensors", "track", "vehicle",
}  # fmt: skip


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what the checks read."""
    copy = tmp_path_factory.mktemp("checkout")
    ignore = shutil.ignore_patterns("__pycache__")
    for name in ("simrail", "estimators", "scenarios", ".ci"):
        shutil.copytree(ROOT / name, copy / name, ignore=ignore)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy / name)
    return copy


@pytest.fixture
def plant(checkout: Path, request: pytest.FixtureRequest) -> object:
    """Adds lines to modules of the copy, and takes them out again after the test."""
    former: dict[Path, str] = {}

    def add(module: str, line: str) -> None:
        file = checkout / module
        text = former.setdefault(file, file.read_text(encoding="utf-8"))
        file.write_text(f"{text}\n{line}\n", encoding="utf-8")

    yield add
    for file, text in former.items():
        file.write_text(text, encoding="utf-8")


def check(checkout: Path, *words: str) -> tuple[int, str]:
    """Exit code and output of the checks."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, str(checkout / ".ci" / "static.py"), *words],
        capture_output=True, text=True, check=False, env=environment,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


TRUTH = "from simrail.ride.truth import Truth"
IMPORTS = [
    ({"estimators/baselines.py": TRUTH}, "an estimator never sees the truth BROKEN"),
    (
        # Through a helper of the estimators that imports a module of recordings, in which the import is.
        {
            "estimators/attitude/rest_bias.py": "import simrail.recording.standstill",
            "simrail/recording/standstill.py": TRUTH,
        },
        "an estimator never sees the truth BROKEN",
    ),
    ({"simrail/core/seeds.py": "import simrail.cli.main"}, "data flow one way BROKEN"),
    ({"estimators/kalman.py": "import exudyn"}, "exudyn is imported in one file BROKEN"),
]


def test_the_checkout_as_it_is_keeps_to_the_direction_of_imports(checkout: Path) -> None:
    code, text = check(checkout, "imports")
    assert code == 0 and "3 kept, 0 broken" in text, text


@pytest.mark.parametrize("way", [(), pytest.param(("--wheel",), marks=pytest.mark.slow)])
@pytest.mark.parametrize(("lines", "verdict"), IMPORTS)
def test_a_planted_import_is_caught(
    lines: dict[str, str], verdict: str, way: tuple[str, ...], checkout: Path, plant: object
) -> None:
    for module, line in lines.items():
        plant(module, line)  # type: ignore[operator]
    code, text = check(checkout, *way, "imports")
    assert code == 1 and verdict in text, text


@pytest.mark.slow
@pytest.mark.parametrize("way", [(), ("--wheel",)])
def test_a_planted_type_error_in_an_estimator_is_caught(
    way: tuple[str, ...], checkout: Path, plant: object
) -> None:
    plant("estimators/attitude/gda.py", 'PLANTED: int = "text"')  # type: ignore[operator]
    code, text = check(checkout, *way, "types")
    assert code == 1, text
    (line,) = [line for line in text.splitlines() if "error" in line and "gda.py" in line]
    assert "Incompatible types in assignment" in line


def test_the_rooms() -> None:
    """Twelve folders, at most three modules and the mark of types: nothing else lies flat."""
    entries = {entry.name for entry in (ROOT / "simrail").iterdir()} - {"__pycache__"}
    assert {name for name in entries if (ROOT / "simrail" / name).is_dir()} == ROOMS
    assert entries - ROOMS <= {"__init__.py", "__main__.py", "results.py", "py.typed"}


def test_every_package_is_installed() -> None:
    """The list of packages in pyproject.toml is that of the folders with Python files."""
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = {file.parent for file in (ROOT / "simrail").rglob("*.py")}
    names = {folder.relative_to(ROOT).as_posix().replace("/", ".") for folder in folders}
    for name in ("estimators", "scenarios"):
        files = {file.parent for file in (ROOT / name).rglob("__init__.py")}
        names |= {"simrail." + folder.relative_to(ROOT).as_posix().replace("/", ".") for folder in files}
    assert sorted(listed) == sorted(names)


@pytest.mark.slow
def test_only_simrail_is_installed(checkout: Path, tmp_path: Path) -> None:
    """A wheel brings one package and its metadata, no top-level `estimators` or `scenarios`."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(tmp_path)]
    subprocess.run([*command, str(checkout)], check=True)
    names = {entry.name for entry in tmp_path.iterdir() if entry.name != "bin"}
    assert {name for name in names if not name.endswith(".dist-info")} == {"simrail"}
    assert len(names) == 2
    assert (tmp_path / "simrail" / "estimators" / "attitude" / "ekf.py").is_file()
    assert (tmp_path / "simrail" / "scenarios" / "tracks").is_dir()
    subprocess.run([sys.executable, "-m", "simrail", "list"], cwd=tmp_path, check=True, capture_output=True)
