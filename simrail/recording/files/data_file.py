"""Columns of numbers from a data file, CSV or Parquet, as a logger wrote it.

Reads the columns that are asked for by name, as float64 exactly as printed, and refuses what is not there
or no number, with the line of the file. What the columns mean is said by the ride file
(`simrail.recording.files.signal_part`).
"""

import csv
import difflib
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq
from pydantic import Field, field_validator

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import Part, label

TEXTS, TABLES = (".csv", ".txt", ".tsv", ".dat", ".log"), (".parquet", ".pq")
_SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}


class DataPart(Part):
    """A data file, and how its text is laid out; the last three are for CSV only.

    Attributes
    ----------
    file : str
        Path, seen from the folder of the ride file; ``.parquet``, or text.
    separator : str
        What stands between two values.
    decimal : str
        ``"."`` or ``","``.
    skip_lines : int
        Lines before the line of column names.
    """

    file: str
    separator: str = Field(default=",", min_length=1, max_length=1)
    decimal: str = Field(default=".", pattern=r"^[.,]$")
    skip_lines: int = Field(default=0, ge=0, le=1000)

    @field_validator("file")
    @classmethod
    def _known_kind(cls, value: str) -> str:
        if Path(value).suffix.lower() not in TEXTS + TABLES:
            raise InputError(
                "is neither CSV nor Parquet",
                value=value,
                limit="a name that ends in " + ", ".join(TEXTS + TABLES),
                remedy="export the logger's file as CSV",
            )
        return value


def column_names(part: DataPart, folder: Path, *, table: str) -> list[str]:
    """Names of the columns of a data file.

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
        try:
            return list(pq.read_schema(path).names)
        except (OSError, ValueError) as error:
            raise _no_parquet(path, error) from None
    try:
        with path.open(encoding="utf-8-sig", newline="") as text:
            for _ in range(part.skip_lines):
                text.readline()
            line = text.readline()
    except OSError as error:
        limit, remedy = "a file that may be read", "mend the path, or its rights"
        said = error.strerror
        raise InputError("cannot be read", file=label(path), value=said, limit=limit, remedy=remedy) from None
    except UnicodeDecodeError as error:
        bad, remedy = error.object[error.start : error.start + 8], "save the file as UTF-8"
        raise InputError(
            "is not UTF-8 text", file=label(path), value=bad, limit="UTF-8", remedy=remedy
        ) from None
    if not line.strip():
        raise InputError(
            "is empty" if not part.skip_lines else "has no line of column names",
            file=label(path),
            limit="a line of column names, and one or more lines of samples",
            remedy="write the column names in one line, then one line per sample",
        )
    try:
        return [name.strip() for name in next(csv.reader([line.strip("\r\n")], delimiter=part.separator))]
    except csv.Error as error:
        raise InputError(
            f"has no line of column names that can be read ({error})",
            file=label(path),
            value=line[:60],
            limit="names that are set apart by separators",
            remedy="mend the first line, or set skip_lines",
        ) from None


def _no_parquet(path: Path, error: Exception) -> InputError:
    """What is said of a file that is called Parquet and is none, or a damaged one."""
    said = " ".join(str(error).split())
    limit, remedy = "a whole Parquet file", "write it anew, or give CSV"
    return InputError("is not readable Parquet", file=label(path), value=said, limit=limit, remedy=remedy)


def read_columns(
    part: DataPart, folder: Path, names: Sequence[str], *, table: str, text: Sequence[str] = ()
) -> dict[str, FloatArray | pd.Series]:
    """Read columns by name.

    Parameters
    ----------
    part : DataPart
        Which file, and its layout.
    folder : Path
        Folder of the ride file.
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
    found = column_names(part, folder, table=table)
    path = folder / part.file
    for name in dict.fromkeys(names):
        if found.count(name) != 1:
            raise _no_such_column(name, found, part, table, label(path))
    wanted = list(dict.fromkeys(names))
    if path.suffix.lower() in TABLES:
        read = _read_parquet(path, wanted, text)
    else:
        read = _read_csv(path, part, found, wanted, text)
    columns: dict[str, FloatArray | pd.Series] = {}
    for name in wanted:
        column = read.column(name)
        if name in text:
            columns[name] = column.to_pandas()
        else:
            columns[name] = column.to_numpy().astype(np.float64)
    return columns


def line_of(part: DataPart, sample: int) -> str:
    """Where a sample stands in its file, in words."""
    if Path(part.file).suffix.lower() in TABLES:
        return f"row {sample}"
    return f"line {sample + part.skip_lines + 2}"


def near(word: str, known: Sequence[str]) -> str | None:
    """A remedy that names the word that was probably meant, if there is one."""
    folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=0.5)
    return f"did you mean {folded[close[0]]!r}?" if close else None


def _read_csv(
    path: Path, part: DataPart, found: list[str], wanted: list[str], text: Sequence[str]
) -> pa.Table:
    types = {name: pa.string() if name in text else pa.float64() for name in wanted}
    # Columns that are not read may have any name, also none or a double one.
    unique = [name if name in types else f"unread {i}" for i, name in enumerate(found)]
    try:
        return pa_csv.read_csv(
            path,
            read_options=pa_csv.ReadOptions(
                skip_rows=part.skip_lines + 1, column_names=unique, use_threads=False
            ),
            parse_options=pa_csv.ParseOptions(delimiter=part.separator),
            convert_options=pa_csv.ConvertOptions(
                column_types=types,
                include_columns=wanted,
                decimal_point=part.decimal,
                null_values=["", "NaN", "nan", "NAN", "NA", "N/A", "n/a", "null"],
            ),
        )
    except pa.ArrowInvalid as error:
        said = str(error)
        if "Empty CSV" in said:
            return pa.table({name: pa.array([], type=types[name]) for name in wanted})
        raise _bad_text(said, path, part, found) from None


def _bad_text(said: str, path: Path, part: DataPart, found: list[str]) -> InputError:
    """What is wrong with the text, from what the parser says of it."""
    row = re.search(r"Row #(\d+)", said)
    line = f" in line {row[1]}" if row else ""
    value = re.search(r"invalid value '(.*)'", said)
    if value:
        number = re.search(r"CSV column #(\d+)", said)
        column = found[int(number[1])] if number and int(number[1]) < len(found) else None
        remedy = "drop that line, so that it is a gap; or mend it"
        if "," in value[1] and part.decimal == ".":
            remedy = 'set decimal = ","'
        limit = "a number, or nothing where there is none"
        return InputError(
            f"holds no number{line}",
            file=label(path),
            field=column,
            value=value[1],
            limit=limit,
            remedy=remedy,
        )
    count = re.search(r"Expected (\d+) columns, got (\d+)", said)
    if count:
        return InputError(
            f"has another number of fields{line} than in the line of column names",
            file=label(path),
            value=int(count[2]),
            limit=count[1],
            remedy="mend that line; for text above the column names set skip_lines, for another separator "
            "than a comma set separator",
        )
    limit, remedy = "a line of column names, and a line of numbers for each sample", "mend that place"
    return InputError("cannot be read as CSV", file=label(path), value=said, limit=limit, remedy=remedy)


def _read_parquet(path: Path, wanted: list[str], text: Sequence[str]) -> pa.Table:
    try:
        table = pq.read_table(path, columns=wanted)
    except (OSError, ValueError) as error:
        raise _no_parquet(path, error) from None
    for name in wanted:
        kind = table.schema.field(name).type
        if name not in text and not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
            raise InputError(
                "holds no numbers", file=label(path), field=name, value=str(kind), limit="numbers"
            )
    return table


def _no_such_column(name: str, found: list[str], part: DataPart, table: str, file: str) -> InputError:
    where = f"{table}.columns"
    if name in found:
        return InputError(
            f"{file} has several columns of this name",
            field=where,
            value=name,
            limit="a name of one column",
            remedy="rename them",
        )
    other = next((mark for mark in _SEPARATORS if mark != part.separator and mark in "".join(found)), None)
    if len(found) == 1 and other:
        return InputError(
            f"{file} has one column only, whose name holds a {_SEPARATORS[other]}",
            field=f"{table}.separator",
            value=part.separator,
            limit="what sets the columns apart",
            remedy=f"set separator = {other!r}".replace("'", '"'),
        )
    listed = ", ".join(found[:20]) + (", ..." if len(found) > 20 else "")
    return InputError(
        f"{file} has no such column",
        field=where,
        value=name,
        limit=f"one of {listed}",
        remedy=near(name, found) or f"name it in [{table}.columns]",
    )
