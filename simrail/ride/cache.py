"""Rides on disk: each simulated once, found again by the hash of all that it depends on.

A ride is a folder under the user's cache; a folder is written under another name and renamed when it
is complete, so an interrupted or killed run leaves nothing that looks like a ride. Any number of processes
may use it at once. The cache keeps below a size limit by dropping the rides that were used longest ago.

A cache that cannot be written is read all the same; what it lacks goes into a temporary folder, which is gone
when the process ends.
"""

import atexit
import errno
import hashlib
import json
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simrail.core.errors import InputError
from simrail.core.jit import cache_folder
from simrail.core.sealed_files import HEADER, DamagedError, plain_of

LIMIT_GB = 20.0

SPARE = "SIMRAIL_SPARE_RIDES"
"""Names the temporary folder to the processes that this one starts."""

_CLOSED = (errno.EROFS, errno.EACCES, errno.EPERM)
"""What a folder says that nobody may write to."""


@dataclass(frozen=True)
class CachedRide:
    """One ride in the cache: its key, its name, its size and when it was last used (epoch seconds)."""

    key: str
    name: str
    size_bytes: int
    last_used_s: float


def limit_bytes() -> int:
    """Size limit of the cache: ``SIMRAIL_CACHE_GB`` in the environment, or 20 GB.

    Raises
    ------
    InputError
        If that is no size.
    """
    said = os.environ.get("SIMRAIL_CACHE_GB", str(LIMIT_GB))
    try:
        return int(float(said) * 1e9)
    except (ValueError, OverflowError):
        raise InputError(
            "is no size of a cache",
            field="SIMRAIL_CACHE_GB",
            value=said,
            limit="a number of GB, e.g. 20",
            remedy="set it to a number, or unset it",
        ) from None


def folder() -> Path:
    """Where the rides are: ``SIMRAIL_RIDES`` in the environment, or a folder of the user's cache."""
    named = os.environ.get("SIMRAIL_RIDES")
    return Path(named) if named else cache_folder() / "rides"


def places_of(key: str) -> list[Path]:
    """The folders that a ride may be in and that are there: in the cache, and in the temporary folder.

    Raises
    ------
    OSError
        If the cache cannot be looked at.
    """
    folders = [folder(), *([Path(os.environ[SPARE])] if SPARE in os.environ else [])]
    return [place for place in (one / key for one in folders) if place.exists()]


def make_writable() -> bool:
    """Whether the cache can be written; if not, rides go into a temporary folder from now on.

    For who is about to start other processes: they then share it.

    Raises
    ------
    InputError
        If its size is none.
    """
    limit_bytes()
    if SPARE not in os.environ:
        try:
            folder().mkdir(parents=True, exist_ok=True)
            Path(tempfile.mkdtemp(prefix=".", dir=folder())).rmdir()
        except OSError as error:
            if error.errno not in _CLOSED:
                raise
            _make_spare()
    return SPARE not in os.environ


def key_of(description: dict[str, Any]) -> str:
    """SHA-256 of a JSON description, in hexadecimal."""
    return hashlib.sha256(json.dumps(description, sort_keys=True).encode()).hexdigest()


def rides(where: Path | None = None) -> list[CachedRide]:
    """Every complete ride in the cache, or in another folder, the most recently used first."""
    cached = []
    for place in (where or folder()).glob(f"[!.]*/{HEADER}"):
        with suppress(OSError):  # another process may drop it meanwhile
            size = sum(file.stat().st_size for file in place.parent.iterdir())
            used = place.stat().st_mtime
            try:
                manifest = plain_of(place.parent).get("manifest")
                name = str(manifest.get("ride", "?")) if isinstance(manifest, dict) else "?"
            except DamagedError:
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


def drop(place: Path) -> None:
    """Take a ride out of the cache, at once; where the cache cannot be written, it stays."""
    gone = place.with_name(f".{place.name}.{secrets.token_hex(8)}")
    with suppress(OSError):
        place.replace(gone)
    shutil.rmtree(gone, ignore_errors=True)


@contextmanager
def new_ride(key: str, told: Callable[[str], None] | None = None) -> Iterator[Path]:
    """A folder to write a ride into; it enters the cache when the block ends without an exception.

    ``told`` is called with one line if the cache cannot be written.

    Raises
    ------
    OSError
        If the ride cannot be written: the disk is full, or broken.
    """
    draft = _draft(key, told)
    place = draft.with_name(key)
    try:
        yield draft
        _make_room(draft.parent, sum(file.stat().st_size for file in draft.iterdir()))
        try:
            draft.replace(place)
        except OSError:
            if not place.exists():  # else another process was faster with the same ride
                raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _draft(key: str, told: Callable[[str], None] | None) -> Path:
    """A new folder for a ride to be written into: in the cache, or in the temporary folder."""
    name = f".{key}.{secrets.token_hex(8)}"
    if make_writable():
        _drop_leftovers()
        return folder() / name
    spare = Path(os.environ[SPARE])
    if told is not None:
        told(f"the cache of rides cannot be written ({folder()}): new ones go to {spare}, for now")
    return spare / name


def _make_spare() -> None:
    """Make the temporary folder, which goes with this process."""
    spare = tempfile.mkdtemp(prefix="simrail-rides-")
    os.environ[SPARE] = spare
    atexit.register(drop_spare)


def drop_spare() -> None:
    """Drop the temporary folder, if there is one."""
    spare = os.environ.pop(SPARE, None)
    if spare is not None:
        shutil.rmtree(spare, ignore_errors=True)


def _drop_leftovers() -> None:
    """Remove drafts that a killed run left behind: those that nobody wrote to for a day."""
    for draft in folder().glob(".*"):
        with suppress(OSError):
            if draft.is_dir() and time.time() - draft.stat().st_mtime > 86400.0:
                shutil.rmtree(draft, ignore_errors=True)


def _make_room(where: Path, size: int) -> None:
    stored = rides(where)
    total = size + sum(ride.size_bytes for ride in stored)
    while stored and total > limit_bytes():
        oldest = stored.pop()
        drop(where / oldest.key)
        total -= oldest.size_bytes
