"""Running an estimator of a stranger: what it is given it cannot change, and what it touches is put back.

Every estimator of a cell gets frames of its own over arrays that cannot be written; what changes them all the
same is found by a digest, and is a failure of that estimator. Filters of warnings, numpy's handling of
floating-point errors, the working folder, the environment and the global random states are after it as they
were before; an exit is a failure like any other, and what it prints is kept for the log.
"""

import io
import os
import random
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.recording.recording import AT_IMU_TIMES, AT_OWN_TIMES, Recording

_FRAMES = (*AT_IMU_TIMES, *AT_OWN_TIMES, "gaps")

MOST_PRINTED = 200
"""Characters of what an estimator printed that are kept."""


class EstimatorExit(RuntimeError):
    """An estimator wanted to end the whole process."""


def handed(recording: Recording) -> Recording:
    """A recording with frames of its own, over the same arrays, which cannot be written."""
    frames: dict[str, Any] = {
        name: _read_only(frame) for name in _FRAMES if (frame := getattr(recording, name)) is not None
    }
    return replace(recording, **frames)


def _read_only(frame: pd.DataFrame) -> pd.DataFrame:
    """A frame of the same columns over views that cannot be written."""
    if len(set(frame.dtypes)) == 1:
        whole = frame.to_numpy().view()
        whole.flags.writeable = False
        return pd.DataFrame(whole, index=frame.index, columns=frame.columns, copy=False)
    columns = {}
    for name in frame.columns:
        columns[name] = frame[name].to_numpy().view()
        columns[name].flags.writeable = False
    return pd.DataFrame(columns, index=frame.index, copy=False)


def digest(recording: Recording) -> int:
    """Checksum of all that a recording holds in arrays."""
    value = 0
    for name in _FRAMES:
        frame = getattr(recording, name)
        if frame is None:
            continue
        for values in (frame.index.to_numpy(), *(frame[column].to_numpy() for column in frame.columns)):
            value = zlib.crc32(np.ascontiguousarray(values).tobytes(), value)
    return value


@contextmanager
def fenced() -> Iterator[io.StringIO]:
    """Put back behind an estimator what it may have changed; gives what it prints.

    Raises
    ------
    EstimatorExit
        In place of `SystemExit`.
    """
    folder, environment, errors = Path.cwd(), dict(os.environ), np.geterr()
    states = random.getstate(), np.random.get_state()  # noqa: NPY002 (what a stranger may have used)
    printed = io.StringIO()
    try:
        with warnings.catch_warnings(), redirect_stdout(printed):
            yield printed
    except SystemExit as error:
        raise EstimatorExit(f"it ended the process (exit code {error.code})") from error
    finally:
        np.seterr(**errors)
        random.setstate(states[0])
        np.random.set_state(states[1])  # noqa: NPY002
        with suppress(OSError):
            os.chdir(folder)
        if dict(os.environ) != environment:
            os.environ.clear()
            os.environ.update(environment)
