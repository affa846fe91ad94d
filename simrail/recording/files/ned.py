"""Signals in the axes that navigation uses: body X forward, Y right, Z down (FRD); ground with Z down (NED).

Beside simrail's own (X forward, Y left, Z up) Y and Z have the other sign, and so have pitch and yaw. The X
axis of the ground stays that of the track's plane: it points north only where the track file says so. The
axes stand in the names of the columns (``gyro_y_frd_radps``, ``x_ned_m``), so that nobody mixes them up.
What is told along the track stays as it is.
"""

from typing import Literal

import pandas as pd

from simrail.core.columns import ATTITUDE, COLUMNS
from simrail.recording.signals import Signal

Frame = Literal["flu", "ned"]
"""Axes of an export: simrail's own, or FRD of the body and NED of the ground."""

BODY_AXES = ("x", "-y", "-z")
"""Axes of a device in FRD that point along simrail's X, Y, Z."""

_MARKS = {"body": "frd", "global": "ned"}


def ned_name(name: str) -> str:
    """The name of a column in these axes; its own where they make no difference.

    Parameters
    ----------
    name : str
        A column of `simrail.core.columns.COLUMNS`.
    """
    mark = _MARKS.get(COLUMNS[name].frame) if name in COLUMNS else None
    stem, _, unit = name.rpartition("_")
    return name if mark is None else f"{stem}_{mark}_{unit}"


def is_turned(name: str) -> bool:
    """Whether a column has the other sign in these axes."""
    if ned_name(name) == name:
        return False
    if name in ATTITUDE:
        return not name.startswith("roll")
    return any(part in ("y", "z") for part in name.split("_"))


def in_ned(frame: pd.DataFrame) -> pd.DataFrame:
    """A frame of signals or of true motion in these axes.

    Parameters
    ----------
    frame : pandas.DataFrame
        Columns of `simrail.core.columns.COLUMNS`; others stay as they are.

    Returns
    -------
    pandas.DataFrame
        With the axes in the names of its columns.
    """
    turned = frame.copy()
    for name in frame.columns:
        if is_turned(str(name)):
            turned[name] = -frame[name]
    return turned.rename(columns=lambda name: ned_name(str(name)))


def ned_table(signal: Signal, columns: list[str]) -> dict[str, object]:
    """What a ride file says of a signal that was written in these axes, so that it reads as it was.

    Parameters
    ----------
    signal : Signal
        The signal.
    columns : list of str
        Its columns, as the recording has them.
    """
    names: dict[str, object] = {}
    units: dict[str, str] = {}
    vectors = False
    for quantity in signal.quantities:
        if not set(quantity.columns) <= {*columns} or all(ned_name(c) == c for c in quantity.columns):
            continue
        mapped = [ned_name(column) for column in quantity.columns]
        names[quantity.key] = mapped if len(mapped) > 1 else mapped[0]
        if len(mapped) > 1:
            vectors = True
        elif is_turned(quantity.columns[0]):
            units[quantity.key] = f"-{next(iter(quantity.units))}"
    said: dict[str, object] = {"columns": names} if names else {}
    return said | ({"units": units} if units else {}) | ({"axes": list(BODY_AXES)} if vectors else {})
