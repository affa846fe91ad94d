"""Folders and files that appear whole or not at all: written under another name beside, then moved."""

import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import BinaryIO

from simrail.core.errors import InputError

_IN_MOTION_S = 1.0
"""How long two renames of a living process may take."""


@contextmanager
def draft_of(folder: Path) -> Iterator[Path]:
    """A folder to write into, which takes the place of `folder` when the block ends without an exception.

    The former folder is kept until the new one is complete; a process that is killed while the two change
    places leaves the former one under another name, from which `restore` puts it back.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    restore(folder)
    _drop_leftovers(folder)
    draft = folder.parent / f".{folder.name}.{os.getpid()}.draft"
    former = folder.parent / f".{folder.name}.{os.getpid()}.former"
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir()
    try:
        yield draft
        if folder.exists():
            folder.replace(former)
        try:
            draft.replace(folder)
        except OSError:
            if former.exists():
                former.replace(folder)
            raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
        shutil.rmtree(former, ignore_errors=True)


def can_be_made(folder: Path) -> bool:
    """Whether a folder, and drafts beside it, can be made where it is to be; nothing is left of the trial."""
    above = folder.absolute().parent
    try:
        folder.exists()  # no file may stand on the way, and its name must be one
        while not above.exists():
            above = above.parent
        # As long as the longest name beside it, that of an unfinished run or a former folder.
        Path(tempfile.mkdtemp(prefix=f".{folder.name}.{'x' * 24}.", dir=above)).rmdir()
    except (OSError, ValueError):
        return False
    return True


def restore(folder: Path) -> bool:
    """Put a folder back that a killed process had moved away to make room for a new one.

    Returns
    -------
    bool
        Whether there was one to put back. Former ones beside a folder that is there are dropped: the new one
        had taken its place.

    Raises
    ------
    OSError
        If it cannot be moved.
    """
    if not folder.name:
        return False
    formers = sorted(folder.parent.glob(f".{escape(folder.name)}.*.former"), key=_changed)
    end = time.monotonic() + _IN_MOTION_S
    while formers and not folder.exists() and time.monotonic() < end:
        time.sleep(0.05)  # another process may be between the two renames now
    if formers and not folder.exists():
        with suppress(FileNotFoundError):  # that other process may have put it back itself
            formers.pop().replace(folder)
            return True
    for former in formers:
        shutil.rmtree(former, ignore_errors=True)
    return False


def _changed(place: Path) -> float:
    """When a folder was changed last."""
    try:
        return place.stat().st_mtime
    except OSError:
        return 0.0


@contextmanager
def whole_file(file: Path) -> Iterator[BinaryIO]:
    """A stream whose content becomes `file` when the block ends without an exception, on the disk by then."""
    draft = file.with_name(f".{file.name}.{os.getpid()}.draft")
    try:
        with draft.open("wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        draft.replace(file)
    finally:
        draft.unlink(missing_ok=True)


def write_whole(
    file: Path,
    content: bytes,
    *,
    what: str,
    field: str = "--out",
    remedy: str = "choose another place with --out",
) -> Path:
    """Write what somebody asked for: a file, whole or not at all; its folder is made if it is not there.

    Parameters
    ----------
    file : Path
        Where; returned.
    content : bytes
        What stands in it.
    what : str
        What it is to whoever asked, as "page" or "film".
    field, remedy : str
        What the place was asked for by, and what to do where it cannot be used.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as stream:
            stream.write(content)
    except (OSError, ValueError) as error:  # a place that is no name of a file at all
        raise InputError(
            f"the {what} cannot be written: {getattr(error, 'strerror', None) or error}",
            field=field,
            value=str(file),
            limit="a file in a folder that can be written",
            remedy=remedy,
        ) from error
    return file


def _drop_leftovers(folder: Path) -> None:
    """Remove drafts that a killed run left behind: those that nobody wrote to for a day."""
    for draft in folder.parent.glob(f".{escape(folder.name)}.*.draft"):
        if draft.is_dir() and time.time() - draft.stat().st_mtime > 86400.0:
            shutil.rmtree(draft, ignore_errors=True)
