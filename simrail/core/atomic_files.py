"""Folders and files that appear whole or not at all: written under another name beside, then moved."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


@contextmanager
def draft_of(folder: Path) -> Iterator[Path]:
    """A folder to write into, which takes the place of `folder` when the block ends without an exception.

    The former folder is kept until the new one is complete.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
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


def _drop_leftovers(folder: Path) -> None:
    """Remove drafts that a killed run left behind: those that nobody wrote to for a day."""
    for draft in folder.parent.glob(f".{folder.name}.*.draft"):
        if draft.is_dir() and time.time() - draft.stat().st_mtime > 86400.0:
            shutil.rmtree(draft, ignore_errors=True)
