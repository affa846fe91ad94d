"""Columns of numbers from a data file as a logger wrote it: text, Parquet, HDF5, MATLAB, MCAP, rosbag.

Reads the columns that are asked for by name, as float64 exactly as printed, and refuses what is not there
or no number, with the line of the file. What the columns mean is said by the ride file
(`simrail.recording.files.signal_part`).
"""

import difflib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import pandas as pd
from pydantic import Field, field_validator

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import Part, label
from simrail.recording.files.bag_file import open_bag
from simrail.recording.files.table_file import Read, Table, open_hdf5, open_mat, open_parquet
from simrail.recording.files.text_file import (
    MOST_TEXT,
    Layout,
    is_number,
    layout_of,
    line_number,
    open_text,
    read_text,
    split,
)

TEXTS = (".csv", ".txt", ".tsv", ".dat", ".log")
TABLES: dict[str, Callable[[Path], Table]] = {
    ".parquet": open_parquet,
    ".pq": open_parquet,
    ".h5": open_hdf5,
    ".hdf5": open_hdf5,
    ".mat": open_mat,
    ".mcap": open_bag,
    ".db3": open_bag,
    ".bag": open_bag,
}
"""Kinds of files that are no text, and what opens them."""

PACKED = (".zip", ".gz", ".bz2", ".xz", ".7z", ".zst", ".tar", ".tgz", ".rar")
"""Endings of files that hold others."""

MOST_LONG_COLUMNS = 5
"""Columns of a file in long form: time, name of the signal, value, and perhaps its unit and its device."""

MOST_FILES = 50
"""Files of a folder that are looked into for a missing column."""

_SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blank"}


class DataPart(Part):
    """A data file, and how its text is laid out; all but the first are for text only.

    Attributes
    ----------
    file : str
        Path, seen from the folder of the ride file; what it is is seen from its ending, see `TABLES`.
    separator : str
        What stands between two values; a blank stands for any number of blanks and tabs.
    decimal : str
        ``"."`` or ``","``.
    skip_lines : int
        Lines at the top that are passed over; comments (``#``, ``%``, ``//``) are, anyway.
    units_row : bool, optional
        Whether a row of units follows the line of column names; found out where nothing is said.
    """

    file: str
    separator: str = Field(default=",", min_length=1, max_length=1)
    decimal: str = Field(default=".", pattern=r"^[.,]$")
    skip_lines: int = Field(default=0, ge=0, le=1000)
    units_row: bool | None = None

    @field_validator("file")
    @classmethod
    def _known_kind(cls, value: str) -> str:
        if Path(value).suffix.lower() not in [*TEXTS, *TABLES]:
            raise InputError(
                "is of no kind that is read",
                value=value,
                limit="a name that ends in " + ", ".join([*TEXTS, *TABLES]),
                remedy="unpack it first"
                if Path(value).suffix.lower() in PACKED
                else "export the logger's file as CSV",
            )
        return value


@dataclass(frozen=True)
class DataFile:
    """A data file that is there, and the names of its columns.

    Attributes
    ----------
    path : Path
        Where it is.
    part : DataPart
        What the ride file says of it.
    names : tuple of str
        Its columns, in order; their numbers from 1 on where it has no line of names.
    layout : Layout, optional
        How it is laid out, if it is text.
    read : callable, optional
        Reads its columns, if it is none.
    """

    path: Path
    part: DataPart
    names: tuple[str, ...]
    layout: Layout | None = None
    read: Read | None = None

    @property
    def named(self) -> bool:
        """Whether the columns have names."""
        return self.layout is None or self.layout.named

    def column(self, name: str) -> str:
        """The name of a column, which may be given as its number, from 1 on, where no column is called so."""
        if name not in self.names and name.isdecimal() and 1 <= int(name) <= len(self.names):
            return self.names[int(name) - 1]
        return name

    def place(self, row: int) -> str:
        """Where a row of data, counted from 0, stands in the file, in words."""
        if self.layout is None:
            return f"row {row}"
        return f"line {line_number(self.path, self.layout, row)}"


def open_data(part: DataPart, folder: Path, *, table: str) -> DataFile:
    """Find a data file, and the names of its columns.

    Parameters
    ----------
    part : DataPart
        Which file.
    folder : Path
        Folder of the ride file.
    table : str
        Table of the ride file, for messages.

    Raises
    ------
    InputError
        If the file is missing, empty or unreadable.
    """
    path = folder / part.file
    if not path.is_file():
        raise InputError(
            "there is no such file",
            field=f"{table}.file",
            value=part.file,
            remedy="mend the path; it is seen from the folder of the ride file",
            limit="a file that is there",
        )
    if path.suffix.lower() in TABLES:
        table_file = TABLES[path.suffix.lower()](path)
        return DataFile(path, part, table_file.names, read=table_file.read)
    layout = layout_of(path, separator=part.separator, skip_lines=part.skip_lines, units_row=part.units_row)
    return DataFile(path, part, layout.names, layout)


def read_columns(
    data: DataFile, names: Sequence[str], *, table: str, text: Sequence[str] = ()
) -> dict[str, FloatArray | pd.Series]:
    """Read columns by name.

    Parameters
    ----------
    data : DataFile
        Which file.
    names : sequence of str
        Columns to read.
    table : str
        Table of the ride file, for messages.
    text : sequence of str
        Those of them that are date-times: returned as a series, not as numbers.

    Returns
    -------
    dict of str to ndarray (n,) or pandas.Series
        By name, float64; empty fields are NaN.

    Raises
    ------
    InputError
        If a column is not there (naming near ones), a field is no number, or a line has too few or too
        many fields.
    """
    wanted = list(dict.fromkeys(names))
    for name in wanted:
        if data.names.count(data.column(name)) != 1:
            raise _no_such_column(name, data, table)
    called = [data.column(name) for name in wanted]
    texts = [data.column(name) for name in text]
    unique = list(dict.fromkeys(called))
    if data.read is not None:
        read = data.read(unique, texts)
    else:
        part, layout = data.part, data.layout
        assert layout is not None
        read = read_text(
            data.path, layout, unique, separator=part.separator, decimal=part.decimal, text=texts
        )
    return {name: read[column] for name, column in zip(wanted, called, strict=True)}


def near(word: str, known: Sequence[str]) -> str | None:
    """A remedy that names the word that was probably meant, if there is one."""
    folded = {name.casefold(): name for name in known}
    # A unit behind the name: "wx [deg/s]", "wx (deg/s)", "wx_deg/s" for wx.
    own = {name: re.split(r"[\s\[(_]", name, maxsplit=1)[0].casefold() for name in known}
    bare = [name for name in known if own[name] == word.casefold()]
    if len(bare) == 1:
        return f"did you mean {bare[0]!r}?"
    close = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=0.5)
    return f"did you mean {folded[close[0]]!r}?" if close else None


def _no_such_column(name: str, data: DataFile, table: str) -> InputError:
    found, part, file, where = data.names, data.part, label(data.path), f"{table}.columns"
    if name in found:
        return InputError(
            f"{file} has several columns of this name",
            field=where,
            value=name,
            limit="a name that one column has",
            remedy="rename them, or give the number of the column",
        )
    channels = _channels_below(name, data)
    if channels is not None:
        return _long_form(name, data, table, *channels)
    below = _names_below(name, data)
    if below is not None:
        return InputError(
            f"{file} has the column names in line {below + 1}, below other text",
            field=f"{table}.skip_lines",
            value=part.skip_lines,
            limit=f"{below}, the lines above the column names",
            remedy=f"set skip_lines = {below}",
        )
    other = next((mark for mark in _SEPARATORS if mark != part.separator and mark in "".join(found)), None)
    if len(found) == 1 and other and data.named:
        return InputError(
            f"{file} has one column only, whose name holds a {_SEPARATORS[other]}",
            field=f"{table}.separator",
            value=part.separator,
            limit="what sets the columns apart",
            remedy=f"set separator = {other!r}".replace("'", '"') + _decimal_of(data, other),
        )
    if not data.named:
        return InputError(
            f"{file} has no line of column names",
            field=where,
            value=name,
            limit=f"a number from 1 to {len(found)}",
            remedy="give the numbers of the columns, e.g. time = 1, gyro = [2, 3, 4]"
            + (", and the separator" if len(found) == 1 else ""),
        )
    listed = ", ".join(found[:20]) + (", ..." if len(found) > 20 else "")
    return InputError(
        f"{file} has no such column",
        field=where,
        value=name,
        limit=f"one of {listed}",
        remedy=_elsewhere(name, data, table)
        or near(name, [other for other in found if other not in _taken(data.part)])
        or f"name it in [{table}.columns]; what no column holds cannot be read",
    )


def _decimal_of(data: DataFile, separator: str) -> str:
    """What to say of the decimals of a file whose columns stand apart by another mark than a comma."""
    with open_text(data.path) as file:
        lines = [raw.decode("utf-8", errors="replace") for raw in islice(file, MOST_TEXT)]
    fields = [field for line in lines[1:] for field in split(line.rstrip("\r\n"), separator)]
    comma = sum(bool(re.fullmatch(r"-?\d+,\d+", field)) for field in fields)
    return ' and decimal = ","' if 2 * comma > len(fields) and data.part.decimal == "." else ""


def _taken(part: DataPart) -> set[str]:
    """Columns that the ride file has for other quantities: none of them was meant."""
    said: dict[str, tuple[str, ...]] = getattr(part, "columns", {})
    return {name for names in said.values() for name in names}


def _names_below(name: str, data: DataFile) -> int | None:
    """Number, from 0, of a line below the first ones that holds the name of a column."""
    if data.layout is None or not data.named or name.isdecimal():
        return None
    with open_text(data.path) as file:
        for number, raw in enumerate(islice(file, MOST_TEXT)):
            line = raw.decode("utf-8", errors="replace")
            fields = split(line.rstrip("\r\n"), data.part.separator)
            if (
                number >= data.part.skip_lines
                and len(fields) > 1
                and name in fields
                and name not in data.names
            ):
                return number
    return None


def _channels_below(name: str, data: DataFile) -> tuple[str, list[str]] | None:
    """A column that holds names of signals, and these: of a file that has one line for each value."""
    layout, part = data.layout, data.part
    if layout is None or len(set(layout.names)) < 3:
        return None
    with open_text(data.path) as file:
        lines = [raw.decode("utf-8", errors="replace") for raw in islice(file, layout.data_line + MOST_TEXT)]
    rows = [split(line.rstrip("\r\n"), part.separator) for line in lines[layout.data_line :] if line.strip()]
    rows = [row for row in rows if len(row) == len(layout.names)]
    for column, called in enumerate(layout.names):
        words = list(dict.fromkeys(row[column] for row in rows))
        repeated = 3 <= len(words) <= len(rows) / 2 and not any(is_number(word) for word in words)
        if called and repeated and (name in words or len(layout.names) <= MOST_LONG_COLUMNS):
            return called, words
    return None


def _long_form(name: str, data: DataFile, table: str, channel: str, words: list[str]) -> InputError:
    names, part = data.names, data.part
    time = next((one for one in part.__dict__.get("columns", {}).get("time", ()) if one in names), names[0])
    value = next((one for one in names[::-1] if one not in (channel, time) and one), names[-1])
    wide = f"{data.path.stem}_wide.csv"
    given = "" if part.separator == "," else f", sep={part.separator!r}".replace("'", '"')
    code = (
        f"import pandas as p; p.read_csv('{data.path.name}'{given}).pivot(index='{time}', "
        f"columns='{channel}', values='{value}').to_csv('{wide}')"
    ).replace('"', "'")
    return InputError(
        f"{label(data.path)} is in long form: one line for each value, the name of its signal in {channel!r}",
        field=f"{table}.columns",
        value=name,
        limit=f"a column for each signal; {channel!r} holds " + ", ".join(words[:12]),
        remedy=f'make it wide, python -c "{code}", and name that file',
    )


def _elsewhere(name: str, data: DataFile, table: str) -> str | None:
    """Another file of the same folder that has the column, as a remedy."""
    part = data.part
    if data.layout is None or name.isdecimal():
        return None
    try:
        for path in sorted(data.path.parent.glob(f"*{data.path.suffix}"))[:MOST_FILES]:
            other = layout_of(path, separator=part.separator, skip_lines=0, units_row=None)
            if path != data.path and other.named and name in other.names:
                own = f"{table}.gyro or {table}.accel" if table == "imu" else table
                return f'{path.name} has it: name that file in [{own}], file = "{path.name}"'
    except (InputError, OSError, UnicodeDecodeError):
        return None
    return None
