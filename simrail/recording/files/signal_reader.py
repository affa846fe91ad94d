"""From the columns of a data file to the frame of one signal: SI, the body's axes, times from the start.

Nothing is resampled or filled in: a row without any value of a signal is no sample of it, one that lacks some
is refused with its line. What was done to time stamps (`simrail.recording.files.stamps`) and units is kept as
notes. How the signals of a ride go together is the matter of `simrail.recording.files.ride_reader`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import rate_of
from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import label
from simrail.recording.check_samples import Bounds, Channel, check_samples
from simrail.recording.files.as_mended import as_mended, scaled
from simrail.recording.files.data_file import DataFile, open_data, read_columns
from simrail.recording.files.signal_part import TEXT_TIMES, SignalPart, VectorPart
from simrail.recording.files.stamps import RideClock, mended
from simrail.recording.signals import Quantity, Signal


@dataclass
class _Rows:
    """The rows of a data file that a signal needs: columns by quantity, and the times."""

    data: DataFile
    columns: dict[str, list[FloatArray]]
    names: dict[str, list[str]]
    time: FloatArray | None
    time_name: str
    stamped: bool
    size: int
    bounds: Mapping[str, Bounds]


class SignalReader:
    """Reads the data files of one ride; dates are counted from the whole second of the first read.

    Parameters
    ----------
    folder : Path
        Folder of the ride file, which the paths of its data files start from.

    Attributes
    ----------
    notes : list of str
        What was done to the signals that were read, one line each.
    folder : Path
        As given.
    places : dict of str to callable
        By table, where a sample of its frame stands in its file, in words.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._clock = RideClock()
        self.notes: list[str] = []
        self.places: dict[str, Callable[[int], str]] = {}

    def frame(self, part: SignalPart, table: str, bounds: Mapping[str, Bounds] | None = None) -> pd.DataFrame:
        """Frame of a signal: its columns in SI and in the body's axes, indexed by ``time_s``.

        Parameters
        ----------
        part : SignalPart
            What the ride file says of it.
        table : str
            Table of the ride file, for messages.
        bounds : mapping of str to Bounds, optional
            What the sheet of its device says, by quantity.

        Raises
        ------
        InputError
            If its file, a column or a value is missing or bad, its times do not rise, or its clock is
            another than that of the first signal read; if a sample is none of its device
            (`simrail.recording.check_samples`).
        """
        # What is beyond all numbers is judged where samples and stamps are, without a warning beside it.
        with np.errstate(over="ignore", invalid="ignore"):
            return self._framed(self._read(part, table, bounds), part, part.signal, table)

    def apart(
        self, part: SignalPart, table: str, signals: tuple[Signal, ...], bounds: Mapping[str, Bounds]
    ) -> list[pd.DataFrame]:
        """Frames of sensors that share a file: one frame if they share all samples, else one for each.

        Parameters
        ----------
        part : SignalPart
            What the ride file says of all of them.
        table : str
            Table of the ride file, for messages.
        signals : tuple of Signal
            The quantities of each sensor.
        bounds : mapping of str to Bounds
            What the sheet of the device says, by quantity.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            rows = self._read(part, table, bounds)
            blank = [
                np.isnan(np.vstack([c for q in one.quantities for c in rows.columns[q.key]])).all(axis=0)
                if _has_nan(rows.columns, one)
                else np.zeros(rows.size, dtype=bool)
                for one in signals
            ]
            if all(np.array_equal(blank[0], other) for other in blank[1:]):
                return [self._framed(rows, part, part.signal, table)]
            return [self._framed(rows, part, one, f"{table}.{one.quantities[0].key}") for one in signals]

    def _read(self, part: SignalPart, table: str, bounds: Mapping[str, Bounds] | None) -> _Rows:
        """The columns that a signal needs, and no others."""
        signal = part.signal
        data = open_data(part, self.folder, table=table)
        if data.layout is not None and data.layout.units:
            self._note(f"{label(data.path)}: a row of units ({', '.join(data.layout.units)}) is passed over")
        names: dict[str, list[str]] = {}
        for quantity in signal.quantities:
            named = list(part.columns.get(quantity.key, quantity.columns))
            if quantity.required or quantity.key in part.columns or set(named) <= set(data.names):
                names[quantity.key] = named
        for key, name, unit in _other_units(part, data, names):
            self._note(
                f"{label(data.path)}: {name} is in {unit} by its row of units; the ride file has another "
                f"units.{key}, which is taken"
            )
        times = list(part.columns.get("time", ("time_s",)))
        stamped = signal.timed and ("time" in part.columns or times[0] in data.names or part.rate_hz is None)
        if not stamped:
            times = []
        wanted = [*times, *(name for group in names.values() for name in group)]
        text = times if part.time_unit == TEXT_TIMES else []
        read = read_columns(data, wanted, table=table, text=text)
        size = len(next(iter(read.values())))
        time: FloatArray | None = None
        if stamped:
            raw = read.pop(times[0]) if times[0] not in names else read[times[0]]
            for more in times[1:]:
                raw = pd.Series(raw).str.cat(pd.Series(read.pop(more)), sep=" ")
            time = self._clock.seconds(
                raw, part, table, file=label(data.path), name=times[0], notes=self.notes
            )
        elif signal.timed:
            assert part.rate_hz is not None
            time = part.start_s + np.arange(size) / part.rate_hz
        columns = {key: [_own(read, name, wanted) for name in group] for key, group in names.items()}
        name = times[0] if times else "time"
        return _Rows(data, columns, names, time, name, stamped, size, bounds or {})

    def _framed(self, rows: _Rows, part: SignalPart, signal: Signal, table: str) -> pd.DataFrame:
        """Frame of some quantities of the rows that were read."""
        quantities = [quantity for quantity in signal.quantities if quantity.key in rows.columns]
        kept = None if signal.keeps_blanks else _kept(rows, quantities)

        def place(sample: int) -> str:
            return rows.data.place(sample if kept is None else int(kept[sample]))

        self.places[table] = place
        file = label(rows.data.path)
        framed: dict[str, FloatArray] = {}
        for quantity in quantities:
            values = [
                _si(_taken(column, kept), quantity, part, name, file, place)
                for name, column in zip(rows.names[quantity.key], rows.columns[quantity.key], strict=True)
            ]
            bounds = rows.bounds.get(quantity.key)
            if bounds is not None and rows.time is not None and quantity.key not in part.increments:
                channels = _channels(values, rows.names[quantity.key], quantity, part)
                time = _taken(rows.time, kept)
                check_samples(channels, quantity.key, bounds, time=time, where=place, file=file)
            values = scaled(values, quantity.key, part)
            if isinstance(part, VectorPart) and len(values) == 3:
                values = _turned(values, part)
            framed.update(zip(quantity.columns, values, strict=True))
        frame = pd.DataFrame(framed, copy=False)
        if not signal.timed:
            return as_mended(frame, part)
        if len(frame) < 3:
            raise InputError("is too short", file=file, value=f"{len(frame)} samples", limit=">= 3")
        assert rows.time is not None
        time = _taken(rows.time, kept)
        if rows.stamped:
            frame, time = mended(
                frame, time, file=file, field=f"{table}.{rows.time_name}", table=table, notes=self.notes
            )
        if part.increments:
            self._as_rates(frame, part, signal, rate_of(time))
        frame.index = pd.Index(time, name="time_s")
        return as_mended(frame, part)

    def _as_rates(self, frame: pd.DataFrame, part: SignalPart, signal: Signal, rate: float) -> None:
        """Make increments rates, in place: over the interval that a sample stands for."""
        for quantity in signal.quantities:
            if quantity.key in part.increments:
                frame[list(quantity.columns)] *= rate
                self._note(
                    f"imu: increments of {quantity.key} are taken as means over {1e3 / rate:.4g} ms, "
                    "up to their time stamps"
                )

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)


def _other_units(
    part: SignalPart, data: DataFile, names: Mapping[str, list[str]]
) -> list[tuple[str, str, str]]:
    """Quantities, columns and units of a row of units that names other ones than the ride file."""
    units = dict(zip(data.names, data.layout.units if data.layout else (), strict=False))
    found = []
    for quantity in part.signal.quantities:
        known = quantity.units | quantity.increments
        taken = part.units.get(quantity.key, next(iter(known), "")).removeprefix("-")
        for name in names.get(quantity.key, ()):
            unit = units.get(data.column(name), "").strip("[]() ").replace("°", "deg").replace("²", "2")
            unit = unit.replace("^2", "2")
            if unit in known and taken in known and known[unit] != known[taken]:
                found.append((quantity.key, name, unit))
    return found


def _own(read: dict[str, FloatArray | pd.Series], name: str, wanted: list[str]) -> FloatArray:
    """A column, which is scaled in place: a copy where it is wanted twice, or belongs to the file."""
    values = np.asarray(read[name], dtype=np.float64)
    return values if wanted.count(name) == 1 and values.flags.writeable else values.copy()


def _has_nan(columns: dict[str, list[FloatArray]], signal: Signal) -> bool:
    return any(
        bool(np.isnan(column).any()) for quantity in signal.quantities for column in columns[quantity.key]
    )


def _kept(rows: _Rows, quantities: list[Quantity]) -> np.ndarray | None:
    """Rows that hold a sample, in order; None if all do."""
    blank = np.ones(rows.size, dtype=bool)
    for quantity in quantities:
        for column in rows.columns[quantity.key]:
            if not blank.any():
                return None
            blank &= np.isnan(column)
    return np.flatnonzero(~blank) if blank.any() else None


def _taken(column: FloatArray, kept: np.ndarray | None) -> FloatArray:
    return column if kept is None else column[kept]


def _si(
    values: FloatArray,
    quantity: Quantity,
    part: SignalPart,
    name: str,
    file: str,
    place: Callable[[int], str],
) -> FloatArray:
    """Values of a column in SI; a missing one is refused, not filled."""
    bad = ~np.isfinite(values)
    if bad.any() and (quantity.required or len(part.signal.quantities) == 1):
        first = int(np.argmax(bad))
        raise InputError(
            f"is not a finite number in {place(first)} ({int(bad.sum())} such samples)",
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
                f"is no whole number in {place(int(np.argmax(broken)))}",
                file=file,
                field=name,
                value=float(values[int(np.argmax(broken))]),
                remedy="give a distance as [odometer]" if quantity.key == "count" else None,
                limit="whole numbers",
            )
        return values.astype(np.int64)
    unit = part.units.get(quantity.key, next(iter(quantity.units)))
    multiply, divide = (quantity.units | quantity.increments)[unit.removeprefix("-")]
    divide *= part.lsb_per_unit.get(quantity.key, 1.0)
    # In place: a long ride is held once.
    if multiply != divide:
        np.multiply(values, multiply, out=values)
        np.divide(values, divide, out=values)
    return np.negative(values, out=values) if unit.startswith("-") else values


def _channels(
    values: list[FloatArray], names: list[str], quantity: Quantity, part: SignalPart
) -> tuple[Channel, ...]:
    """Columns as the device logged them, in SI."""
    unit = part.units.get(quantity.key, next(iter(quantity.units))).removeprefix("-")
    multiply, divide = quantity.units[unit]
    per_unit = part.lsb_per_unit.get(quantity.key)
    if per_unit is not None:
        unit, divide = "counts", divide * per_unit
    return tuple(
        Channel(name, column, unit, multiply / divide) for name, column in zip(names, values, strict=True)
    )


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
