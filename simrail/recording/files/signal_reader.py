"""From the columns of a data file to the frame of one signal: SI, the body's axes, times from the start.

Nothing is resampled or filled in: a missing value is refused with its line. How the signals of a ride go
together is the matter of `simrail.recording.files.ride_reader`.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import check_stamps
from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import blame, label
from simrail.recording.files.data_file import column_names, line_of, read_columns
from simrail.recording.files.signal_part import DATE_TIMES, SignalPart, VectorPart
from simrail.recording.signals import TIMES, Quantity


class SignalReader:
    """Reads the data files of one ride; dates are counted from the whole second of the first read.

    Parameters
    ----------
    folder : Path
        Folder of the ride file, which the paths of its data files start from.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._zero_s: int | None = None
        self._dated: bool | None = None

    def frame(self, part: SignalPart, table: str) -> pd.DataFrame:
        """Frame of a signal: its columns in SI and in the body's axes, indexed by ``time_s``.

        Parameters
        ----------
        part : SignalPart
            What the ride file says of it.
        table : str
            Table of the ride file, for messages.

        Raises
        ------
        InputError
            If its file, a column or a value is missing or bad, its times do not rise, or its clock is
            another than that of the first signal read.
        """
        signal = part.signal
        found = column_names(part, self._folder, table=table)
        names: dict[str, list[str]] = {}
        for quantity in signal.quantities:
            named = list(part.columns.get(quantity.key, quantity.columns))
            if quantity.required or quantity.key in part.columns or set(named) <= set(found):
                names[quantity.key] = named
        time_name, unit = part.columns.get("time", ("time_s",))[0], part.units.get("time", "s")
        stamped = signal.timed and ("time" in part.columns or time_name in found or part.rate_hz is None)
        wanted = [*([time_name] if stamped else []), *(name for group in names.values() for name in group)]
        text = [time_name] if stamped and unit == "iso" else []
        read = read_columns(part, self._folder, wanted, table=table, text=text)
        columns: dict[str, FloatArray] = {}
        for quantity in signal.quantities:
            if quantity.key in names:
                values = [
                    _si(np.asarray(read[name]), quantity, part, name, label(self._folder / part.file))
                    for name in names[quantity.key]
                ]
                if isinstance(part, VectorPart) and len(values) == 3:
                    values = _turned(values, part)
                columns.update(zip(quantity.columns, values, strict=True))
        frame = pd.DataFrame(columns)
        if signal.timed:
            if len(frame) < 3:
                raise InputError(
                    "is too short",
                    file=label(self._folder / part.file),
                    value=f"{len(frame)} samples",
                    limit=">= 3",
                )
            if stamped:
                time = self._times(read[time_name], unit, part, table)
            else:
                assert part.rate_hz is not None
                time = part.start_s + np.arange(len(frame)) / part.rate_hz
            with blame(label(self._folder / part.file)):
                check_stamps(time, field=f"{table}.{time_name}")
            frame.index = pd.Index(time, name="time_s")
        return frame

    def _times(self, raw: FloatArray | pd.Series, unit: str, part: SignalPart, table: str) -> FloatArray:
        """Time stamps in seconds since the start."""
        dated = unit in DATE_TIMES
        self._dated = dated if self._dated is None else self._dated
        if dated != self._dated:
            raise InputError(
                "has dates where the IMU has none, or none where it has: no common clock",
                field=f"{table}.units.time",
                value=unit,
                remedy="give both in one clock",
                limit="dates in all files, or in none",
            )
        if not dated:
            multiply, divide = TIMES[unit]
            return np.asarray(raw, dtype=np.float64) * multiply / divide
        if unit == "iso":
            try:
                stamps = pd.to_datetime(pd.Series(raw), utc=True, format="ISO8601")
            except (ValueError, TypeError) as error:
                raise InputError(
                    f"holds no date-time ({error})",
                    file=label(self._folder / part.file),
                    field=part.columns.get("time", ("time_s",))[0],
                    limit="e.g. 2024-05-31T12:00:00.123",
                ) from None
            count = stamps.dt.as_unit("ns").astype("int64").to_numpy()
            per_second: float | int = 10**9
        else:
            count = np.asarray(raw)
            per_second = TIMES[unit.removeprefix("epoch_")][1]
        if self._zero_s is None:
            self._zero_s = int(count[0] // per_second)
        return np.asarray((count - self._zero_s * per_second) / float(per_second), dtype=np.float64)


def _si(values: FloatArray, quantity: Quantity, part: SignalPart, name: str, file: str) -> FloatArray:
    """Values of a column in SI; a missing one is refused, not filled."""
    bad = ~np.isfinite(values)
    if bad.any() and quantity.required:
        first = int(np.argmax(bad))
        raise InputError(
            f"is not a finite number in {line_of(part, first)} ({int(bad.sum())} such samples)",
            file=file,
            field=name,
            value=float(values[first]),
            limit="finite numbers",
            remedy="drop those lines, so that they are gaps; nothing is filled in silently",
        )
    if quantity.whole:
        broken = values != np.rint(values)
        if broken.any():
            raise InputError(
                f"is no whole number in {line_of(part, int(np.argmax(broken)))}",
                file=file,
                field=name,
                value=float(values[int(np.argmax(broken))]),
                remedy="give a distance as [odometer]" if quantity.key == "count" else None,
                limit="whole numbers",
            )
        return values.astype(np.int64)
    unit = part.units.get(quantity.key, next(iter(quantity.units)))
    multiply, divide = quantity.units[unit.removeprefix("-")]
    with np.errstate(over="ignore"):  # what is beyond all numbers is judged where samples are
        scaled = values if multiply == divide else values * multiply / divide
    return -scaled if unit.startswith("-") else scaled


def _turned(device: list[FloatArray], part: VectorPart) -> list[FloatArray]:
    """The X, Y, Z of the body from the x, y, z of the device."""
    body = []
    for axis in part.axes:
        along = device["xyz".index(axis.removeprefix("-"))]
        body.append(-along if axis.startswith("-") else along)
    angles = np.radians([[part.roll_deg, part.pitch_deg, part.yaw_deg]])
    if not np.any(angles):
        return body
    return list(rotation_matrix(angles)[0] @ np.vstack(body))
