"""One table as a file: CSV under a legend of three lines, or Parquet with its units in the schema.

Every name ends with its unit. The legend says what the table is, what each column means, and how to read it;
its lines begin with ``#``, as comments do in the files that simrail and most loggers read.
"""

import re
from collections.abc import Collection, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from simrail.core.columns import COLUMNS
from simrail.recording.files.ned import Frame

Format = Literal["csv", "parquet"]

UNITS = ("deg", "mm")
"""Units that a person may ask for in place of rad and m."""

LEGEND_LINES = 3

_SUFFIXES = {
    "radps": "rad/s",
    "degps": "deg/s",
    "mps2": "m/s2",
    "mps": "m/s",
    "rad": "rad",
    "deg": "deg",
    "mm": "mm",
    "m": "m",
    "s": "s",
    "hz": "Hz",
    "t": "T",
    "n": "N",
    "1pm": "1/m",
}
"""Units by the last word of a name."""

_PLACES = re.compile(r"(^|_)(position|start|end|known|open|shift)_")
"""Lengths along the track: these stay in metres."""

_SIGNS: dict[Frame, str] = {
    "flu": "axes X forward, Y left, Z up; angles ZYX: roll positive left side up, pitch positive nose down, "
    "yaw positive to the left",
    "ned": "axes X forward, Y right, Z down; angles ZYX: roll positive left side up, pitch positive nose up, "
    "yaw positive to the right",
}
_READING = '_sd_ is a standard deviation; read by pandas.read_csv(FILE, comment="#")'


def write_frame(
    frame: pd.DataFrame,
    path: Path,
    *,
    format: Format,
    about: str,
    units: Collection[str] = (),
    axes: Frame = "flu",
) -> None:
    """Write a frame, its index as the first column if it has a name; floats with all their digits.

    Parameters
    ----------
    frame : pandas.DataFrame
        Columns whose names end with their units, SI.
    path : Path
        The file.
    format : str
        ``"csv"`` or ``"parquet"``.
    about : str
        What the table is, in a line.
    units : collection of str
        Some of `UNITS`: columns in rad or m are written so, and their names say it.
    axes : {"flu", "ned"}
        Axes that the frame is in.
    """
    plain = in_units(frame.reset_index() if frame.index.name else frame, units)
    table = pa.Table.from_pandas(plain, preserve_index=False)
    if format == "parquet":
        pq.write_table(_described(table, about, axes), path)
        return
    with path.open("wb") as file:
        for line in legend(plain, about, axes):
            file.write(f"# {line}\n".encode())
        file.write((",".join(map(str, plain.columns)) + "\n").encode())
        pa_csv.write_csv(table, file, pa_csv.WriteOptions(include_header=False))


def legend(frame: pd.DataFrame, about: str, axes: Frame = "flu") -> tuple[str, str, str]:
    """The three lines above a table, without the marks of a comment."""
    columns = []
    for name in map(str, frame.columns):
        unit, meaning = described(name)
        columns.append(f"{name}{f' [{unit}]' if unit else ''}{f' {meaning}' if meaning else ''}")
    head = f"{' '.join(about.split())} (simrail {version('simrail')})"
    return head, "; ".join(columns), f"{_SIGNS[axes]}; {_READING}"


def described(name: str) -> tuple[str, str]:
    """Unit and meaning of a column, by its name; empty where it has none that is known."""
    unit = _SUFFIXES.get(name.rpartition("_")[2], "")
    known = COLUMNS.get(name) or COLUMNS.get(_in_si(name))
    if known is None:
        return unit, ""
    return unit if name not in COLUMNS and unit else known.unit, known.meaning


def in_units(frame: pd.DataFrame, units: Collection[str]) -> pd.DataFrame:
    """The same in degrees, or millimetres where a length is not along the track, with names that say so."""
    columns: dict[str, pd.Series] = {}
    for name, values in frame.items():
        column = str(name)
        for ending, other, unit, factor in (
            ("_rad", "_deg", "deg", 180.0 / np.pi),
            ("_radps", "_degps", "deg", 180.0 / np.pi),
            ("_m", "_mm", "mm", 1e3),
        ):
            if unit in units and column.endswith(ending) and not (unit == "mm" and _is_place(column)):
                column, values = column.removesuffix(ending) + other, factor * values
                break
        columns[column] = values
    return pd.DataFrame(columns, index=frame.index)


def _is_place(column: str) -> bool:
    return _PLACES.search(column) is not None or column in ("x_m", "y_m", "z_m")


def _in_si(name: str) -> str:
    for ending, other in (("_deg", "_rad"), ("_degps", "_radps"), ("_mm", "_m")):
        if name.endswith(ending):
            return name.removesuffix(ending) + other
    return name


def _described(table: pa.Table, about: str, axes: Frame) -> pa.Table:
    """The table with the unit of each field in its metadata, and what it is in those of the schema."""

    def fields() -> Iterator[pa.Field]:
        for field in table.schema:
            unit, meaning = described(field.name)
            told = {"unit": unit, "meaning": meaning}
            yield field.with_metadata({key: word for key, word in told.items() if word})

    more = {"simrail_version": version("simrail"), "about": " ".join(about.split())}
    more["conventions"] = _SIGNS[axes]
    metadata = {
        **(table.schema.metadata or {}),
        **{key.encode(): word.encode() for key, word in more.items()},
    }
    return table.cast(pa.schema(list(fields()), metadata=metadata))
