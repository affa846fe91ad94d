"""Hashes of source code: what was computed by other code is found, or gone on with, by nobody."""

import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path

NO_MATTER = (
    *("cli/", "report/", "scenarios/"),
    *(f"campaign/{name}.py" for name in ("export", "forecast", "tune", "progress")),
    *("scoring/aggregate.py", "scoring/statistics.py"),
)
"""Folders and files of this package that no score depends on."""


def source_folders() -> tuple[Path, Path]:
    """Where the sources lie: this package's, and its estimators', which stand beside it in a checkout."""
    return Path(str(files("simrail"))), Path(str(files("simrail.estimators")))


@cache
def source_hash(*names: str) -> str:
    """SHA-256 over source files and folders of this package, as they were when first asked for."""
    here, estimators = source_folders()
    digest = hashlib.sha256()
    for name in names:
        place = estimators if name == "estimators" else here / name
        for source in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()


@cache
def score_code_hash() -> str:
    """SHA-256 over all sources here and of the shipped estimators that scores depend on."""
    here, _ = source_folders()
    modules = {module.relative_to(here).as_posix() for module in here.rglob("*.py")}
    wanted = {name for name in modules if not name.startswith((*NO_MATTER, "estimators/"))}
    return source_hash(*sorted(wanted), "estimators")
