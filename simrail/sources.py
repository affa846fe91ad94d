"""Hashes of source code: what was computed by other code is found, or gone on with, by nobody."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

_NO_MATTER = (
    *("commands", "report", "catalogue.py", "cli.py", "export.py", "new.py", "new_ride.py", "progress.py"),
    *("aggregate.py", "statistics.py", "plan.py", "rehearsal.py", "tune.py"),
)
"""Parts of this package that no score depends on."""


@cache
def source_hash(*names: str) -> str:
    """SHA-256 over source files and folders of this package, as they were when first asked for."""
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256()
    for name in names:
        place = here / name
        for source in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()


@cache
def score_code_hash() -> str:
    """SHA-256 over all sources here and of the shipped estimators that scores depend on."""
    here = Path(__file__).resolve().parent
    names = sorted(place.name for place in here.iterdir() if place.suffix == ".py" or place.is_dir())
    wanted = [name for name in names if name not in (*_NO_MATTER, "__pycache__")]
    return source_hash(*wanted, "../estimators")
