"""Files that hold columns of numbers rather than text: Parquet, HDF5, MATLAB.

Arrays of an HDF5 or MATLAB file are called by their path (``imu/gyro``, ``log.imu.gyro``); the columns of a
matrix by its path and their number from 1 on (``imu/gyro.1``). Which side of a matrix is time is seen from
its length.
"""

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from simrail.core.errors import InputError, joined
from simrail.core.jit import FloatArray
from simrail.core.toml_files import label

MOST_COLUMNS = 64
"""A matrix with more rows and columns than this holds no columns of signals."""

_HDF5_ERRORS = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError)
"""What h5py says of a damaged file: its insides have no error of their own."""

Read = Callable[[Sequence[str], Sequence[str]], dict[str, "FloatArray | pd.Series"]]


@dataclass(frozen=True)
class Table:
    """A file of columns.

    Attributes
    ----------
    names : tuple of str
        Its columns.
    read : callable
        Reads some of them, of which some (the second argument) are times as text.
    """

    names: tuple[str, ...]
    read: Read


def unreadable(problem: str, path: Path, limit: str) -> InputError:
    """The refusal of a file that its library cannot read, with its size: it is often cut."""
    size = f"{path.stat().st_size} bytes" if path.exists() else "no file"
    return InputError(
        problem,
        file=label(path),
        value=size,
        limit=limit,
        remedy="write or copy the file again, or export it as CSV",
    )


def library(name: str, path: Path, *, instead: str = "export the logger's file as CSV") -> Any:
    """A library that reads or writes a kind of file.

    Parameters
    ----------
    name : str
        Its module.
    path : Path
        The file.
    instead : str
        What else can be done without it.

    Raises
    ------
    InputError
        If it is not installed, naming the extra that has it.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(
            f"needs the library {name.partition('.')[0]}, which is not installed",
            file=label(path),
            value=path.suffix,
            limit="a kind of file whose library is installed",
            remedy=f"pip install 'simrail[loggers]', or {instead}",
        ) from None


def open_parquet(path: Path) -> Table:
    """Open a Parquet file."""
    try:
        names = tuple(pq.read_schema(path).names)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise unreadable(f"is not readable Parquet ({joined(error)})", path, "a whole Parquet file") from None

    def read(wanted: Sequence[str], texts: Sequence[str]) -> dict[str, FloatArray | pd.Series]:
        return {name: _parquet_column(path, name, is_text=name in texts) for name in wanted}

    return Table(names, read)


def open_hdf5(path: Path) -> Table:
    """Open an HDF5 file, also a MATLAB file of version 7.3."""
    h5py = library("h5py", path)
    shapes: dict[str, tuple[int, ...]] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and np.issubdtype(item.dtype, np.number):
            shapes[name] = item.shape

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except _HDF5_ERRORS as error:
        raise unreadable(f"is not readable HDF5 ({joined(error)})", path, "a whole HDF5 file") from None
    places = _places(shapes)

    def read(wanted: Sequence[str], texts: Sequence[str]) -> dict[str, FloatArray | pd.Series]:
        refuse_texts(path, texts)
        try:
            with h5py.File(path, "r") as file:
                columns = {name: _part(file[places[name][0]], *places[name][1:]) for name in wanted}
        except _HDF5_ERRORS as error:
            raise unreadable(f"is not readable HDF5 ({joined(error)})", path, "a whole HDF5 file") from None
        return _alike(columns, path)

    return Table(tuple(places), read)


def open_mat(path: Path) -> Table:
    """Open a MATLAB file of any version."""
    import scipy.io

    try:
        held = scipy.io.loadmat(path, simplify_cells=True)
    except NotImplementedError:
        return open_hdf5(path)
    except (OSError, ValueError, TypeError):
        raise unreadable("is not a readable MATLAB file", path, "a whole MATLAB file") from None
    arrays = dict(_arrays(held, ""))
    places = _places({name: array.shape for name, array in arrays.items()})

    def read(wanted: Sequence[str], texts: Sequence[str]) -> dict[str, FloatArray | pd.Series]:
        refuse_texts(path, texts)
        return _alike({name: _part(arrays[places[name][0]], *places[name][1:]) for name in wanted}, path)

    return Table(tuple(places), read)


def _parquet_column(path: Path, name: str, *, is_text: bool) -> FloatArray | pd.Series:
    try:
        column = pq.read_table(path, columns=[name]).column(name)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise unreadable(f"is not readable Parquet ({joined(error)})", path, "a whole Parquet file") from None
    if is_text:
        series: pd.Series = column.to_pandas()
        return series
    if not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
        raise InputError(
            "holds no numbers",
            file=label(path),
            field=name,
            value=str(column.type),
            limit="numbers",
            remedy="name a column of numbers, or write it as numbers",
        )
    numbers: FloatArray = column.to_numpy().astype(np.float64, copy=False)
    return numbers


def _arrays(held: Mapping[str, Any], path: str) -> list[tuple[str, np.ndarray]]:
    """Arrays of numbers of nested structures, by path."""
    found: list[tuple[str, np.ndarray]] = []
    for key, value in held.items():
        if key.startswith("__"):
            continue
        place = f"{path}.{key}" if path else key
        if isinstance(value, Mapping):
            found += _arrays(value, place)
        elif isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.number):
            found.append((place, value))
    return found


def _places(shapes: Mapping[str, tuple[int, ...]]) -> dict[str, tuple[str, int, int]]:
    """Column -> array, its axis across, and the number there; -1 for an array that is one column."""
    places: dict[str, tuple[str, int, int]] = {}
    for name, shape in shapes.items():
        wide = [size for size in shape if size > 1]
        if len(wide) == 1:
            places[name] = (name, -1, 0)
        elif len(shape) == 2 and min(shape) <= MOST_COLUMNS:
            across = int(np.argmin(shape))
            places |= {f"{name}.{i + 1}": (name, across, i) for i in range(shape[across])}
    return places


def _part(array: Any, across: int, number: int) -> FloatArray:
    if across < 0:
        return np.array(array, dtype=np.float64).ravel()
    return np.array(array[number, :] if across == 0 else array[:, number], dtype=np.float64)


def refuse_texts(path: Path, texts: Sequence[str]) -> None:
    """Refuse times as text, which a file of numbers does not hold."""
    if texts:
        raise InputError(
            "holds numbers, and no times as text",
            file=label(path),
            field=texts[0],
            value='units.time = "iso"',
            limit="times as numbers",
            remedy='set units.time to "s", "ms", "epoch_s", ...',
        )


def _alike(columns: dict[str, FloatArray], path: Path) -> dict[str, FloatArray | pd.Series]:
    """Columns of one length, as those of a signal must be."""
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(
            "its columns have different lengths",
            file=label(path),
            value=lengths,
            limit="one length for a signal",
            remedy="give sensors with samples of their own a table each, e.g. [imu.gyro] and [imu.accel]",
        )
    return {**columns}
