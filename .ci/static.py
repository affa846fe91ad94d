"""Types and directions of imports, of the package as it is installed.

    python .ci/static.py [--wheel] [types] [imports]

In a checkout ``estimators`` and ``scenarios`` stand beside ``simrail``; installed, they are
``simrail.estimators`` and ``simrail.scenarios``. An editable install finds them by a hook of the import
system, which checkers do not run: they read folders. So they are shown the layout that is installed, as
links to the checkout, or, with ``--wheel``, as the files of a wheel that is built for it. Needs the extra
``test``.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
INSIDE = ("estimators", "scenarios")
COMMANDS = {
    "types": [sys.executable, "-m", "mypy", "--config-file", str(ROOT / "pyproject.toml")],
    "imports": [str(Path(sys.executable).with_name("lint-imports")), str(ROOT / "pyproject.toml")],
}


def lay_links(folder: Path) -> None:
    """Lay the installed layout into a folder, as links; as copies where links are not allowed."""
    package = folder / "simrail"
    package.mkdir()
    parts = [part for part in (ROOT / "simrail").iterdir() if part.name != "__pycache__"]
    for part in (*parts, *(ROOT / name for name in INSIDE)):
        try:
            (package / part.name).symlink_to(part, target_is_directory=part.is_dir())
        except OSError:  # on Windows, without the right to make links
            (shutil.copytree if part.is_dir() else shutil.copy)(part, package / part.name)


def lay_wheel(folder: Path) -> None:
    """Build a wheel and lay out its files in a folder."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    with tempfile.TemporaryDirectory() as copy:  # setuptools builds in the folder of the sources
        source = Path(copy) / "simrail"
        left_out = shutil.ignore_patterns(".*", "build", "results", "tests", "*.egg-info")
        shutil.copytree(ROOT, source, ignore=left_out)
        subprocess.run([*pip, "--target", str(folder), str(source)], check=True)


def main(arguments: list[str]) -> int:
    """Run the checks; 0 if all are clean."""
    wanted = [name for name in arguments if name in COMMANDS] or list(COMMANDS)
    lay = lay_wheel if "--wheel" in arguments else lay_links
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "installed"
        folder.mkdir()
        lay(folder)
        codes = [subprocess.run(COMMANDS[name], cwd=folder, check=False).returncode for name in wanted]
    return int(any(codes))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
