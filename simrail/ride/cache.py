"""Rides on disk: each simulated once, found again by the hash of all that it depends on.

A ride is a folder under the user's cache; a folder is written under another name and renamed when it
is complete, so an interrupted or killed run leaves nothing that looks like a ride. Any number of processes
may use it at once. The cache keeps below a size limit by dropping the rides that were used longest ago.
"""

import hashlib
import json
import os
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrail.core.jit import cache_folder

LIMIT_GB = 20.0

HEADER = "truth.json"
"""File of a folder that is written last: without it a folder was interrupted and is no ride."""


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
    """Where the rides are: ``SIMRAIL_RIDES`` in the environment, or a folder of the user's cache."""
    named = os.environ.get("SIMRAIL_RIDES")
    return Path(named) if named else cache_folder() / "rides"


def key_of(description: dict[str, Any]) -> str:
    """SHA-256 of a JSON description, in hexadecimal."""
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def rides() -> list[CachedRide]:
    """Every complete ride in the cache, the most recently used first."""
    cached = []
    for place in folder().glob(f"[!.]*/{HEADER}"):
        with suppress(OSError):  # another process may drop it meanwhile
            size = sum(file.stat().st_size for file in place.parent.iterdir())
            used = place.stat().st_mtime
            try:
                name = json.loads(place.read_text(encoding="utf-8"))["manifest"].get("ride", "?")
            except (ValueError, KeyError):
                name = "damaged"
            cached.append(CachedRide(place.parent.name, name, size, used))
    return sorted(cached, key=lambda ride: -ride.last_used_s)


def clear() -> int:
    """Drop every ride, finished or not; returns the bytes freed."""
    freed = sum(file.stat().st_size for file in folder().rglob("*") if file.is_file())
    shutil.rmtree(folder(), ignore_errors=True)
    return freed


def touch(place: Path) -> None:
    """Note that a ride was used now."""
    with suppress(OSError):  # another process may have dropped it, or the cache may be read only
        os.utime(place / HEADER)


def drop(key: str) -> None:
    """Take a ride out of the cache, at once."""
    gone = folder() / f".{key}.{secrets.token_hex(8)}"
    with suppress(OSError):
        (folder() / key).replace(gone)
    shutil.rmtree(gone, ignore_errors=True)


@contextmanager
def new_ride(key: str) -> Iterator[Path]:
    """A folder to write a ride into; it enters the cache when the block ends without an exception."""
    folder().mkdir(parents=True, exist_ok=True)
    _drop_leftovers()
    draft = folder() / f".{key}.{secrets.token_hex(8)}"
    try:
        yield draft
        _make_room(sum(file.stat().st_size for file in draft.iterdir()))
        try:
            draft.replace(folder() / key)
        except OSError:
            if not (folder() / key).exists():  # else another process was faster with the same ride
                raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _drop_leftovers() -> None:
    """Remove drafts that a killed run left behind: those that nobody wrote to for a day."""
    for draft in folder().glob(".*"):
        with suppress(OSError):
            if draft.is_dir() and time.time() - draft.stat().st_mtime > 86400.0:
                shutil.rmtree(draft, ignore_errors=True)


def _make_room(size: int) -> None:
    stored = rides()
    total = size + sum(ride.size_bytes for ride in stored)
    while stored and total > limit_bytes():
        oldest = stored.pop()
        drop(oldest.key)
        total -= oldest.size_bytes
