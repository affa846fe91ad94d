"""Folders and files of a cache that are what was written, or are told to be damaged.

A disk, a copy between machines or a person may change what a cache holds. A folder of arrays has a header
with the checksum of each array, and one digest over header and checksums; a file begins with the digest of
the rest.
"""

import hashlib
import json
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from simrail.core.atomic_files import whole_file

HEADER = "truth.json"
"""File of a folder that is written last: without it a folder was interrupted and is nothing."""

_DIGEST_BYTES = 32


class DamagedError(ValueError):
    """What is there is not what was written."""


class _Header(BaseModel):
    """A header as it is written."""

    model_config = ConfigDict(extra="forbid", strict=True)

    digest: str
    crc32: dict[str, int]
    plain: dict[str, Any]


@contextmanager
def damage_told() -> Iterator[None]:
    """Say of whatever is wrong with a stored folder or file that it is damaged.

    Other faults of the machine, such as a folder that may not be read, say nothing of what is stored there.

    Raises
    ------
    DamagedError
        In one line.
    """
    try:
        yield
    except DamagedError:
        raise
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError) as error:
        raise DamagedError(f"{Path(str(error.filename)).name} is missing") from error
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError, EOFError) as error:
        raise DamagedError("it has another form than what was written") from error


def seal(folder: Path, plain: dict[str, Any]) -> None:
    """Write the header of a folder over its arrays (``*.npy``); done last."""
    plain = json.loads(json.dumps(plain))  # as it will be read
    checksums = {file.name: _crc32(file) for file in sorted(folder.glob("*.npy"))}
    whole = {"digest": _digest(plain, checksums), "crc32": checksums, "plain": plain}
    (folder / HEADER).write_text(json.dumps(whole), encoding="utf-8")


def plain_of(folder: Path) -> dict[str, Any]:
    """The header of a folder, as it was written; its arrays are not looked at.

    Raises
    ------
    DamagedError
        If it is not what was written.
    OSError
        If it cannot be read.
    """
    return _header(folder).plain


def read_sealed(folder: Path) -> tuple[dict[str, Any], set[str]]:
    """The header of a folder, and the names of its arrays; both are what was written.

    Raises
    ------
    DamagedError
        If they are not.
    OSError
        If they cannot be read.
    """
    header = _header(folder)
    with damage_told():
        for name, crc32 in header.crc32.items():
            if _crc32(folder / name) != crc32:
                raise DamagedError(f"{name} is not what was written")
    return header.plain, {name.removesuffix(".npy") for name in header.crc32}


def write_sealed_file(file: Path, content: bytes) -> None:
    """Write a file that begins with the digest of its content; it appears whole or not at all."""
    with whole_file(file) as stream:
        stream.write(hashlib.sha256(content).digest())
        stream.write(content)


def read_sealed_file(file: Path) -> bytes:
    """The content of a file that `write_sealed_file` wrote.

    Raises
    ------
    DamagedError
        If it is not what was written.
    OSError
        If there is none, or it cannot be read.
    """
    whole = file.read_bytes()
    digest, content = whole[:_DIGEST_BYTES], whole[_DIGEST_BYTES:]
    if hashlib.sha256(content).digest() != digest:
        raise DamagedError(f"{file.name} is not what was written")
    return content


def _header(folder: Path) -> _Header:
    with damage_told():
        header = _Header.model_validate(json.loads((folder / HEADER).read_text(encoding="utf-8")))
    if _digest(header.plain, header.crc32) != header.digest:
        raise DamagedError(f"{HEADER} is not what was written")
    return header


def _digest(plain: dict[str, Any], checksums: dict[str, int]) -> str:
    """SHA-256 over a header: over what it says, and over the checksums of its arrays."""
    return hashlib.sha256(json.dumps([plain, checksums], sort_keys=True).encode()).hexdigest()


def _crc32(file: Path) -> int:
    checksum = 0
    with file.open("rb") as stream:
        while block := stream.read(1 << 20):
            checksum = zlib.crc32(block, checksum)
    return checksum
