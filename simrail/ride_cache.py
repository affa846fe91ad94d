"""Rides on disk: each simulated once, found again by the hash of all that it depends on.

A ride is a folder under the user's cache; a folder is written under another name and renamed when it
is complete, so an interrupted or killed run leaves nothing that looks like a ride. The cache keeps
below a size limit by dropping the rides that were used longest ago.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrail.jit import cache_folder

LIMIT_GB = 20.0


@dataclass(frozen=True)
class CachedRide:
    """One ride in the cache: its key, its name, its size and when it was last used (epoch seconds)."""

    key: str
    name: str
    size_bytes: int
    last_used_s: float


def limit_bytes() -> int:
    """Size limit of the cache: ``SIMRAIL_CACHE_GB`` in the environment, or 20 GB."""
    return int(float(os.environ.get("SIMRAIL_CACHE_GB", LIMIT_GB)) * 1e9)


def folder() -> Path:
    """Where the rides are."""
    return cache_folder() / "rides"


def key_of(description: dict[str, Any]) -> str:
    """SHA-256 of a JSON description, in hexadecimal."""
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def source_hash(*names: str) -> str:
    """SHA-256 over source files and folders of this package: the code that makes the truth."""
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256()
    for name in names:
        place = here / name
        for source in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()


def rides() -> list[CachedRide]:
    """Every complete ride in the cache, the most recently used first."""
    found = []
    for place in folder().glob("[!.]*/truth.json"):
        size = sum(file.stat().st_size for file in place.parent.iterdir())
        try:
            name = json.loads(place.read_text(encoding="utf-8"))["manifest"].get("ride", "?")
        except (ValueError, KeyError):
            name = "damaged"
        found.append(CachedRide(place.parent.name, name, size, place.stat().st_mtime))
    return sorted(found, key=lambda ride: -ride.last_used_s)


def clear() -> int:
    """Drop every ride, finished or not; returns the bytes freed."""
    freed = sum(file.stat().st_size for file in folder().rglob("*") if file.is_file())
    shutil.rmtree(folder(), ignore_errors=True)
    return freed


def touch(place: Path) -> None:
    """Note that a ride was used now."""
    os.utime(place / "truth.json")


@contextmanager
def new_ride(key: str) -> Iterator[Path]:
    """A folder to write a ride into; it enters the cache when the block ends without an exception."""
    folder().mkdir(parents=True, exist_ok=True)
    _drop_leftovers()
    draft = folder() / f".{key}.{os.getpid()}"
    shutil.rmtree(draft, ignore_errors=True)
    try:
        yield draft
        _make_room(sum(file.stat().st_size for file in draft.iterdir()))
        final = folder() / key
        shutil.rmtree(final, ignore_errors=True)
        draft.replace(final)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _drop_leftovers() -> None:
    """Remove drafts that a killed run left behind: those that nobody wrote to for a day."""
    for draft in folder().glob(".*"):
        if draft.is_dir() and time.time() - draft.stat().st_mtime > 86400.0:
            shutil.rmtree(draft, ignore_errors=True)


def _make_room(size: int) -> None:
    kept = rides()
    total = size + sum(ride.size_bytes for ride in kept)
    while kept and total > limit_bytes():
        oldest = kept.pop()
        shutil.rmtree(folder() / oldest.key, ignore_errors=True)
        total -= oldest.size_bytes
