"""Text as loggers write it: which line holds the names, which the units, where the data begin.

Comment lines (``#``, ``%``, ``//``), blank lines, a row of units below the names, separators at the ends of
lines, several blanks between values, files without a line of names and those in UTF-16 are all read; `Layout`
says what was found, so that the user can be told. Only the columns that are asked for are kept, as float64.
"""

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as pa_csv

from simrail.core.errors import InputError, joined
from simrail.core.jit import FloatArray
from simrail.core.toml_files import label

COMMENTS = ("#", "%", "//")
"""A line that begins so holds no data; it may hold the names, right above the data."""

MOST_TEXT = 200
"""Lines within which the data must begin."""

MOST_UNIT_ROWS = 5
"""Lines of text (units, descriptions, kinds) that may stand between the names and the data."""

BLOCK_BYTES = 1 << 20
"""Text that is parsed at a time."""

NULLS = (
    "",
    "NaN",
    "nan",
    "NAN",
    "-nan",
    "NA",
    "N/A",
    "n/a",
    "#N/A",
    "null",
    "NULL",
    "None",
    "-",
    "--",
    "---",
)
_PADDED_NULLS = [
    *(before + word for before in ("", " ") for word in NULLS),
    *(" " * count for count in range(2, 13)),
]
_SENTENCE = re.compile(r"[$!]([A-Z]\w*),[^*]*\*[0-9A-F]{2}\s*", re.IGNORECASE)
"""A line as NMEA 0183 has it: what kind it is, its values, and a checksum."""

_NUMBER = re.compile(r"[-+]?(\d|[.,]\d|inf|nan)", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """How a text file is laid out.

    Attributes
    ----------
    names : tuple of str
        One per field of a data line; the numbers from 1 on where the file has no line of names, "" for the
        empty field after a separator at the end.
    named : bool
        Whether there is a line of names.
    data_line : int
        Lines above the first line of data.
    units : tuple of str
        The row of units below the names; empty without one.
    """

    names: tuple[str, ...]
    named: bool
    data_line: int
    units: tuple[str, ...] = ()


def layout_of(path: Path, *, separator: str, skip_lines: int, units_row: bool | None) -> Layout:
    """Find out how a text file is laid out.

    Parameters
    ----------
    path : Path
        The file.
    separator : str
        What stands between two values; a blank stands for any number of blanks and tabs.
    skip_lines : int
        Lines at the top that hold neither names nor data.
    units_row : bool, optional
        Whether a row of units follows the names; None to find out.

    Raises
    ------
    InputError
        If the file is empty, cannot be read, is no UTF-8 or UTF-16, or holds sentences with checksums.
    """
    lines = _first_lines(path, skip_lines + MOST_TEXT)
    _refuse_sentences(lines[skip_lines:], path)
    rows = [
        (number, line)
        for number, line in enumerate(lines)
        if number >= skip_lines and line.strip(" \t" + separator)
    ]
    plain = [(number, line) for number, line in rows if not line.lstrip().startswith(COMMENTS)]
    if not rows or (not plain and len(lines) < skip_lines + MOST_TEXT and len(rows) > 1):
        raise InputError(
            "is empty" if not skip_lines else "has no line of column names",
            file=label(path),
            value=f"{len(lines)} lines",
            limit="column names, then samples",
            remedy="write the column names in one line, then one line per sample",
        )
    first = plain[0] if plain else rows[0]
    fields = split(first[1], separator)
    if _is_data(fields):
        # The last comment above the data holds the names if it has as many words as there are values.
        above = [line for number, line in rows if number < first[0]]
        names = split(_uncommented(above[-1]), separator) if above else []
        if names and len(_trimmed(names)) == len(_trimmed(fields)) and not _is_data(names):
            return Layout(_as_wide(names, fields), True, first[0])
        return Layout(tuple(str(i + 1) for i in range(len(fields))), False, first[0])
    names = split(_uncommented(first[1]), separator)
    below = [(number, split(line, separator)) for number, line in plain if number > first[0]]
    count = 0 if units_row is False else 1 if units_row else _unit_rows(below)
    units = tuple(below[0][1]) if count and below else ()
    below = below[count:]
    if not below:
        return Layout(tuple(names), True, first[0] + 1)
    return Layout(_as_wide(names, below[0][1]), True, below[0][0], units)


def split(line: str, separator: str) -> list[str]:
    """Fields of a line, without the blanks around them."""
    if separator == " ":
        return [field.strip('"') for field in line.split()]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=separator))]
    except csv.Error as error:
        raise InputError(
            f"has a line that cannot be parted into fields ({error})",
            value=line[:60],
            limit=f"fields of at most {csv.field_size_limit()} characters",
            remedy="mend that line, or pass over it by skip_lines",
        ) from None


def read_text(
    path: Path, layout: Layout, wanted: Sequence[str], *, separator: str, decimal: str, text: Sequence[str]
) -> dict[str, FloatArray | pd.Series]:
    """Read columns of a text file, and no others, block by block: the memory is that of the columns.

    Parameters
    ----------
    path : Path
        The file.
    layout : Layout
        As `layout_of` found it.
    wanted : sequence of str
        Names of the columns; each stands in the layout once.
    separator, decimal : str
        What stands between two values, and before the decimals.
    text : sequence of str
        Those of the columns that are kept as text.

    Returns
    -------
    dict of str to ndarray (n,) or pandas.Series
        By name: float64, or text.

    Raises
    ------
    InputError
        If a field is no number, or a line has too few or too many fields.
    """
    types = {name: pa.string() if name in text else pa.float64() for name in wanted}
    # Columns that are not read may have any name, also none or a double one.
    names = [name if name in types else f"unread {i}" for i, name in enumerate(layout.names)]
    parse = pa_csv.ParseOptions(delimiter=separator)
    convert = pa_csv.ConvertOptions(
        column_types=types, include_columns=list(wanted), decimal_point=decimal, null_values=_PADDED_NULLS
    )
    blocks = path.stat().st_size // BLOCK_BYTES + 2
    if separator != " ":
        read = pa_csv.ReadOptions(
            skip_rows=layout.data_line, column_names=names, use_threads=False, block_size=BLOCK_BYTES
        )
        try:
            with open_text(path) as file:
                return _blocks_read(file, read, parse, convert, types, blocks)
        except pa.ArrowInvalid:
            pass  # comments between the data, or some lines that end in a separator: once more, line by line
    read = pa_csv.ReadOptions(column_names=names, use_threads=False, block_size=BLOCK_BYTES)
    try:
        with open_text(path) as file:
            return _blocks_read(_Cleaned(file, layout, separator), read, parse, convert, types, blocks)
    except pa.ArrowInvalid as error:
        raise _bad_text(str(error), path, layout, separator, decimal) from None


def _blocks_read(
    source: "io.BufferedReader | _Cleaned",
    read: pa_csv.ReadOptions,
    parse: pa_csv.ParseOptions,
    convert: pa_csv.ConvertOptions,
    types: dict[str, pa.DataType],
    blocks: int,
) -> dict[str, FloatArray | pd.Series]:
    columns = {name: _Column(kind == pa.float64()) for name, kind in types.items()}
    try:
        with pa_csv.open_csv(source, read, parse, convert) as reader:
            for batch in reader:
                for name, column in columns.items():
                    column.add(batch.column(name).to_numpy(zero_copy_only=False), blocks)
    except pa.ArrowInvalid as error:
        if "Empty CSV" not in str(error):
            raise
    return {name: column.whole() for name, column in columns.items()}


class _Column:
    """A column that grows by blocks, in one array: parts to be joined would take its memory twice."""

    def __init__(self, is_number: bool) -> None:
        self._is_number = is_number
        self._values = np.empty(0, dtype=np.float64 if is_number else object)
        self._count = 0

    def add(self, block: FloatArray, blocks: int) -> None:
        """Append a block, of about so many in all."""
        needed = self._count + len(block)
        if needed > len(self._values):
            # Memory that is not written to is not taken: too much is no loss.
            wider = np.empty(max(needed, len(block) * blocks, 3 * self._count // 2), dtype=self._values.dtype)
            wider[: self._count] = self._values[: self._count]
            self._values = wider
        self._values[self._count : needed] = block
        self._count = needed

    def whole(self) -> FloatArray | pd.Series:
        values = self._values[: self._count]
        return values if self._is_number else pd.Series(values, dtype=object)


def open_text(path: Path) -> io.BufferedReader:
    """Open a text file as bytes of UTF-8, without the mark that may stand at its beginning.

    A file in UTF-16 (Windows' "Unicode"), by its mark or by its zeros, is told anew as it is read.
    """
    file = path.open("rb")
    head = file.read(64)
    file.seek(len(codecs.BOM_UTF8) if head.startswith(codecs.BOM_UTF8) else 0)
    encoding = _wide_encoding(head)
    if encoding is None:
        return file
    return io.BufferedReader(_AsUtf8(io.TextIOWrapper(file, encoding, errors="replace", newline="")))


def _wide_encoding(head: bytes) -> str | None:
    """Encoding of a text whose letters take two bytes or four; None of any other, also of what is no text."""
    encoding = _marked(head)
    words = head.decode(encoding or "latin-1", errors="replace")
    return encoding if 2 * sum(letter.isascii() for letter in words) > len(words) else None


def _marked(head: bytes) -> str | None:
    """The wide encoding that a file's beginning looks like, by its mark or its zeros."""
    if head.startswith((codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)):
        return "utf-32"
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    low, high = head[0::2], head[1::2]
    if len(head) >= 4 and not any(high) and all(low):
        return "utf-16-le"
    return "utf-16-be" if len(head) >= 4 and not any(low) and all(high) else None


class _AsUtf8(io.RawIOBase):
    """A text of another encoding as bytes of UTF-8."""

    def __init__(self, text: io.TextIOWrapper) -> None:
        self._text = text
        self._rest = b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "bytearray | memoryview") -> int:  # type: ignore[override]
        if not self._rest:
            self._rest = self._text.read(1 << 18).encode("utf-8", errors="replace")
        count = min(len(buffer), len(self._rest))
        buffer[:count] = self._rest[:count]
        self._rest = self._rest[count:]
        return count

    def close(self) -> None:
        self._text.close()
        super().close()


def line_number(path: Path, layout: Layout, row: int) -> int:
    """Number, from 1, of the line that holds a row of data, counted from 0."""
    with open_text(path) as file:
        data = (
            number
            for number, line in enumerate(file, start=1)
            if number > layout.data_line and _holds_data(line)
        )
        return next(islice(data, row, None), layout.data_line + row + 1)


class _Cleaned(io.RawIOBase):
    """The data lines of a text file as bytes: no comments, one blank for several, as many fields as names."""

    def __init__(self, file: io.BufferedReader, layout: Layout, separator: str) -> None:
        for _ in range(layout.data_line):
            file.readline()
        self._blocks = _clean_blocks(file, separator.encode(), len(layout.names))
        self._rest = b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "bytearray | memoryview") -> int:  # type: ignore[override]
        if not self._rest:
            self._rest = next(self._blocks, b"")
        count = min(len(buffer), len(self._rest))
        buffer[:count] = self._rest[:count]
        self._rest = self._rest[count:]
        return count


def _clean_blocks(file: io.BufferedReader, separator: bytes, width: int) -> Iterator[bytes]:
    while lines := file.readlines(1 << 18):
        kept = [line for line in lines if _holds_data(line)]
        if separator == b" ":
            kept = [b" ".join(line.split()) + b"\n" for line in kept]
        elif any(line.count(separator) != width - 1 for line in kept):
            kept = [_fitted(line.rstrip(b"\r\n"), separator, width) + b"\n" for line in kept]
        if kept:
            yield b"".join(kept)


def _fitted(line: bytes, separator: bytes, width: int) -> bytes:
    """A line without the empty fields at its end that no name stands above."""
    while line.count(separator) > width - 1 and line.endswith(separator):
        line = line[: -len(separator)]
    return line


def _holds_data(line: bytes) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith((b"#", b"%", b"//"))


def _first_lines(path: Path, count: int) -> list[str]:
    try:
        with open_text(path) as file, io.TextIOWrapper(file, "utf-8") as text:
            return [line.rstrip("\n") for line in islice(text, count)]
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})",
            file=label(path),
            value=path.name,
            limit="a file that can be read",
            remedy="see to its path and who may read it",
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            "is not UTF-8 text",
            file=label(path),
            value=f"byte 0x{error.object[error.start]:02x}",
            limit="UTF-8 text",
            remedy="save the file as UTF-8",
        ) from None


def _refuse_sentences(lines: Sequence[str], path: Path) -> None:
    """Refuse lines with checksums, which are sentences of several kinds and no table."""
    kinds = [found[1] for line in lines if (found := _SENTENCE.fullmatch(line.strip()))]
    if 2 * len(kinds) <= sum(bool(line.strip()) for line in lines):
        return
    usual = max(dict.fromkeys(kinds), key=kinds.count)
    raise InputError(
        "holds sentences with checksums, each of its kind, and no table of samples",
        file=label(path),
        value=next(line.strip() for line in lines if _SENTENCE.fullmatch(line.strip()))[:60],
        limit="one line per sample, of numbers",
        remedy="take the values of one kind out, "
        rf"sed -n 's/^.{usual},\(.*\)\*.*$/\1/p' {path.name} > {path.stem}_{usual}.csv, "
        "and give the numbers of its columns, e.g. time = 1, gyro = [2, 3, 4]",
    )


def _uncommented(line: str) -> str:
    """A line without the mark of a comment, where more than the mark is left."""
    for mark in COMMENTS:
        if line.lstrip().startswith(mark):
            return line.lstrip().removeprefix(mark)
    return line


def is_number(field: str) -> bool:
    """Whether a field begins as a number does."""
    return bool(_NUMBER.match(field))


def _is_data(fields: Sequence[str]) -> bool:
    """Whether a line holds values rather than words; a column or two may hold words."""
    filled = [field for field in fields if field]
    return 2 * sum(is_number(field) for field in filled) > len(filled)


def _unit_rows(below: list[tuple[int, list[str]]]) -> int:
    """How many lines of words stand between the names and the data; none if nothing but words follows."""
    for count, (_, fields) in enumerate(below[: MOST_UNIT_ROWS + 1]):
        if _is_data(fields):
            return count
    return 0


def _trimmed(fields: Sequence[str]) -> list[str]:
    """Fields without the empty ones at the end."""
    kept = list(fields)
    while kept and not kept[-1]:
        kept.pop()
    return kept


def _as_wide(names: Sequence[str], fields: Sequence[str]) -> tuple[str, ...]:
    """Names as many as a data line has fields, where the difference is of empty fields at the end."""
    bare, filled = _trimmed(names), _trimmed(fields)
    if len(bare) <= len(fields) and (len(filled) <= len(bare) or len(bare) == len(fields)):
        return (*bare, *[""] * (len(fields) - len(bare)))
    return tuple(names)


def _bad_text(said: str, path: Path, layout: Layout, separator: str, decimal: str) -> InputError:
    """What is wrong with the text, from what the parser says of it."""
    row = re.search(r"Row #(\d+)", said)
    line = f" in line {line_number(path, layout, int(row[1]) - 1)}" if row else ""
    value = re.search(r"invalid value '(.*)'", said, re.DOTALL)
    if value:
        number = re.search(r"CSV column #(\d+)", said)
        column = layout.names[int(number[1])] if number and int(number[1]) < len(layout.names) else None
        return InputError(
            f"holds no number{line}",
            file=label(path),
            field=column,
            value=value[1],
            limit="numbers, or empty fields",
            remedy="the line of names stands there again: the logger was started anew; cut the file there"
            if value[1].strip(' "') in [name for name in layout.names if name]
            else "drop the last line, which holds no sample"
            if row and _is_last(path, layout, int(row[1]) - 1)
            else _remedy_of_word(value[1], decimal, line == f" in line {layout.data_line + 1}"),
        )
    count = re.search(r"Expected (\d+) columns, got (\d+)", said)
    if count:
        return InputError(
            f"has another number of fields{line} than in the line of column names",
            file=label(path),
            value=int(count[2]),
            limit=count[1],
            remedy="drop the last line, which was cut when the logger was switched off"
            if row and int(count[2]) < int(count[1]) and _is_last(path, layout, int(row[1]) - 1)
            else "mend that line; for text above the column names set skip_lines, for another separator "
            f"than {separator!r} set separator",
        )
    return InputError(
        f"cannot be read as CSV: {joined(said)}",
        file=label(path),
        value=f"separator {separator!r}",
        limit="one sample per line, as many fields in each",
        remedy="mend the file, or set separator",
    )


def _is_last(path: Path, layout: Layout, row: int) -> bool:
    """Whether a row of data stands in the last line of a file."""
    number = line_number(path, layout, row)
    with open_text(path) as file:
        return not any(line.strip() for line in islice(file, number, None))


def _remedy_of_word(word: str, decimal: str, in_first_line: bool) -> str:
    if re.fullmatch(r"-?[1-9]\d{0,2}(['\u2019\u00a0\u202f ]\d{3})+([.,]\d*)?", word):
        return "write numbers without separators of thousands"
    if re.fullmatch(r"'.*'", word):
        return "write numbers without quotes, or in double ones"
    if re.fullmatch(r"-?[1-9]\d{0,2}(,\d{3})+", word) and decimal == ".":
        return "write numbers without separators of thousands; or, if the comma is a decimal one, set decimal"
    if "," in word and decimal == ".":
        return 'set decimal = ","'
    if "." in word and decimal == "," and _NUMBER.match(word):
        return 'set decimal = "."'
    if re.match(r"\d+:\d\d|\d{4}-\d\d|\d\d?[./]\d\d?[./]\d{4}", word):
        return 'for clock times and dates set units.time = "iso"'
    if re.fullmatch(r"0x[0-9a-fA-F]+", word):
        return "write numbers to base ten"
    if in_first_line:
        return "if that line holds units set units_row = true; if not, mend it"
    return "empty that line's fields, so that it is a gap; or mend it"
