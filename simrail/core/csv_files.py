"""Tables as CSV that no spreadsheet takes for more than it is."""

from pathlib import Path
from typing import BinaryIO

import pandas as pd

from simrail.core.errors import one_line

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes a cell for a formula at."""

_MOST = 2000


def write_csv(frame: pd.DataFrame, file: Path | BinaryIO, *, float_format: str | None = "%.9g") -> None:
    """Write a table; a text that looks like a formula gets an apostrophe before it, and is one line.

    Parameters
    ----------
    frame : pandas.DataFrame
        The table; its index is not written.
    file : Path or binary stream
        Where to.
    float_format : str, optional
        Of numbers; all their digits with None.
    """
    texts = [name for name in frame if not pd.api.types.is_numeric_dtype(frame[name])]
    shown = frame.assign(**{str(name): frame[name].astype(object).map(_cell) for name in texts})
    shown.to_csv(file, index=False, float_format=float_format)


def _cell(value: object) -> object:
    if not isinstance(value, str):
        return value
    text = one_line(value, _MOST)
    return f"'{text}" if value.startswith(_FORMULA) and not _is_number(value) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
