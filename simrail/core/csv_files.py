"""Tables as CSV that no spreadsheet takes for more than it is."""

from pathlib import Path

import pandas as pd

from simrail.core.errors import one_line

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes a cell for a formula at."""

_MOST = 2000


def csv_bytes(frame: pd.DataFrame, *, float_format: str | None = "%.9g") -> bytes:
    """A table as CSV; a text that looks like a formula gets an apostrophe before it, and is one line.

    Parameters
    ----------
    frame : pandas.DataFrame
        The table; its index is not written.
    float_format : str, optional
        Of numbers; all their digits with None.
    """
    texts = [name for name in frame if not pd.api.types.is_numeric_dtype(frame[name])]
    shown = frame.assign(**{str(name): frame[name].astype(object).map(_cell) for name in texts})
    return shown.to_csv(index=False, float_format=float_format).encode()


def write_csv(frame: pd.DataFrame, file: Path, *, float_format: str | None = "%.9g") -> None:
    """Write `csv_bytes` of a table into a folder that is a draft."""
    file.write_bytes(csv_bytes(frame, float_format=float_format))


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
