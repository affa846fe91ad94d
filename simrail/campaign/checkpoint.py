"""A campaign that is not finished: one file for each batch that is, so that nothing is computed twice.

A folder beside that of the results holds the batches of one plan, named by the hash of the plan and of the
code that runs it. A batch is a Parquet file with the rest of its result in the metadata. It is written
under a hidden name, flushed to the disk and renamed, so it is whole or not there; and its name ends with
the hash of its content, so a damaged one is told from a good one, and dropped.

When all is done the results are made of these files, and the folder goes. This module does not know
what a batch means.
"""

import hashlib
import io
import json
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from datetime import datetime
from glob import escape
from pathlib import Path
from typing import Literal

import pyarrow as pa
import pyarrow.parquet as pq
from filelock import FileLock, Timeout

from simrail.campaign.cell import Failure
from simrail.campaign.worker import BatchResult
from simrail.core.atomic_files import whole_file
from simrail.core.errors import InputError

LOG = "run.log"
Start = Literal["auto", "resume", "fresh", "retry-failed"]
_KEPT_DAYS = 30.0
_META = b"simrail"


class Checkpoint:
    """Batches of one plan, as files.

    Parameters
    ----------
    folder : Path
        Where they are; made if it is not there.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.damaged = 0
        folder.mkdir(parents=True, exist_ok=True)
        for draft in folder.glob(".*.draft"):
            draft.unlink(missing_ok=True)

    def cells(self) -> set[int]:
        """Numbers of the cells that are done; damaged files are dropped and counted in ``damaged``."""
        done: set[int] = set()
        for file in self._files():
            content = file.read_bytes()
            if _hash(content) != file.stem.partition("-")[2]:
                file.unlink()
                self.damaged += 1
            else:
                done.update(_result_of(content, rows=False).cells)
        return done

    def add(self, result: BatchResult) -> None:
        """Keep a batch.

        Raises
        ------
        OSError
            If it cannot be written; then nothing of it is there.
        """
        content = _content_of(result)
        with whole_file(self.folder / f"{min(result.cells):09d}-{_hash(content)}.parquet") as stream:
            stream.write(content)

    def results(self) -> Iterator[BatchResult]:
        """Every batch, in the order of its first cell."""
        for file in self._files():
            yield _result_of(file.read_bytes())

    def log(self, line: str) -> None:
        """Add a line, with the time, to the log of the run."""
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        with (self.folder / LOG).open("a", encoding="utf-8") as stream:
            stream.write(f"{now} {line}\n")

    @property
    def is_empty(self) -> bool:
        """Whether there is no finished batch."""
        return not self._files()

    def clear(self) -> None:
        """Drop every batch, and the log."""
        for file in (*self._files(), self.folder / LOG):
            file.unlink(missing_ok=True)

    def remove(self) -> None:
        """Drop all of it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _files(self) -> list[Path]:
        return sorted(self.folder.glob("[0-9]*-*.parquet"))


@contextmanager
def checkpoint_of(results: Path, key: str, *, start: Start = "auto") -> Iterator[Checkpoint]:
    """Hold the unfinished run of a plan, beside the folder of its results, for this process.

    What the block leaves behind without a finished batch goes.

    Parameters
    ----------
    results : Path
        Folder of the results to come.
    key : str
        Hash of the plan and of the code that runs it.
    start : {"auto", "resume", "fresh", "retry-failed"}, optional
        Go on with what there is; only if there is something; or drop it (both others).

    Raises
    ------
    InputError
        If another process holds it, or there is nothing to resume.
    """
    _drop_abandoned(results)
    made = [above for above in (results.parent, *results.parent.parents) if not above.exists()]
    folder = results.parent / f".{results.name}.unfinished-{key[:16]}"
    with _locked(folder):
        # Only now: what lies there may be another process's, at work.
        checkpoint = Checkpoint(folder)
        try:
            if start == "resume" and checkpoint.is_empty:
                problem, remedy = "there is no unfinished run of this plan", "run it without --resume"
                limit = "the same scenario, settings, code and folder of results"
                raise InputError(problem, field="--resume", value=results.name, limit=limit, remedy=remedy)
            if start in ("fresh", "retry-failed"):
                checkpoint.clear()
            yield checkpoint
        finally:
            if checkpoint.is_empty:
                checkpoint.remove()
            with suppress(OSError):  # those that were made for it, if nothing has come into them
                for above in made:
                    above.rmdir()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold a folder, made if it is not there, for this process; the lock goes with the process."""
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / ".lock")
    try:
        lock.acquire(blocking=False)
    except (
        Timeout,
        FileNotFoundError,
    ) as error:  # also where one that has just ended took its folder with it
        raise InputError(
            "this plan is being run by another process, into the same folder",
            field="--out",
            value=folder.name,
            remedy="wait for it, or choose another folder with --out",
            limit="one process at a time",
        ) from error
    try:
        yield
    finally:
        lock.release()


def _drop_abandoned(results: Path) -> None:
    """Drop unfinished runs into a folder of results that nobody has gone on with for a month."""
    for folder in results.parent.glob(f".{escape(results.name)}.unfinished-*"):
        with suppress(OSError):
            if time.time() - folder.stat().st_mtime > _KEPT_DAYS * 86400.0:
                shutil.rmtree(folder)


def _content_of(result: BatchResult) -> bytes:
    table = pa.Table.from_pandas(result.scores, preserve_index=False)
    plain = {name: value for name, value in vars(result).items() if name not in ("scores", "failures")}
    plain["failures"] = [asdict(failure) for failure in result.failures]
    metadata = {**table.schema.metadata, _META: json.dumps(plain).encode()}
    stream = io.BytesIO()
    pq.write_table(table.replace_schema_metadata(metadata), stream)
    return stream.getvalue()


def _result_of(content: bytes, *, rows: bool = True) -> BatchResult:
    file = pq.ParquetFile(pa.BufferReader(content))
    plain = json.loads(file.schema_arrow.metadata[_META])
    plain["cells"], plain["notes"] = tuple(plain["cells"]), tuple(plain["notes"])
    plain["failures"] = tuple(Failure(**failure) for failure in plain["failures"])
    scores = file.read() if rows else file.schema_arrow.empty_table()
    return BatchResult(scores=scores.to_pandas(), **plain)


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]
