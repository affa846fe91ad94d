"""What every signal of a ride file has: its data file, names and units of its columns, axes of its device.

The models judge the text: whether a table names quantities that its signal has, in units that it can have,
and a device as one can be mounted. Which signals there are, and what each says beside that, is in
`simrail.recording.files.ride_file`; the data are read by `simrail.recording.files.signal_reader`.
"""

from collections.abc import Iterable
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import BeforeValidator, Field, PlainValidator, field_validator, model_validator

from simrail.core.errors import InputError
from simrail.recording.files.data_file import DataPart, near
from simrail.recording.signals import TIMES, Signal

TEXT_TIMES = "iso"
"""Time stamps that are text: date-times, or clock times (`simrail.recording.files.clock_times`)."""

EPOCHS = ("epoch_s", "epoch_ms", "epoch_us", "epoch_ns")
"""Time stamps that are a count since 1970."""

LARGEST_OFFSET_S = 50_400.0
"""Of a clock: of time zones the furthest are 14 hours from universal time."""

TICKS = "ticks"
"""Time stamps that count the ticks of a clock, `SignalPart.tick_rate_hz` of them in a second."""


def _as_tuple(value: object) -> object:
    names = value if isinstance(value, list) else [value]
    whole = [str(name) if isinstance(name, int) and not isinstance(name, bool) else name for name in names]
    return tuple(whole) if isinstance(value, list | str | int) else value


Names = Annotated[tuple[str, ...], BeforeValidator(_as_tuple)]
"""Columns: one name, or number from 1 on, or an array of them."""

Positive = Annotated[float, Field(gt=0.0)]


def _factors(value: object) -> object:
    """One factor above 0, or one for each column: of either sign, and not 0."""
    each = value if isinstance(value, list | tuple) else [value]
    numbers = [one for one in each if isinstance(one, int | float) and not isinstance(one, bool)]
    if len(numbers) < len(each) or not numbers or not all(np.isfinite(numbers)) or 0.0 in numbers:
        raise InputError(
            "holds what is no factor",
            value=value if isinstance(value, list | str | int | float) else str(value),
            limit="a number above 0, or an array of numbers that are not 0, one for each column",
            remedy="1.0 for a column that is right",
        )
    if each is value:
        return tuple(float(one) for one in numbers)
    if numbers[0] < 0.0:
        raise InputError(
            "has the other sign",
            value=value if isinstance(value, int | float) else str(value),
            limit="a number above 0",
            remedy="for columns of the other sign give an array of one factor for each column",
        )
    return float(numbers[0])


Factors = Annotated[float | tuple[float, ...], PlainValidator(_factors)]
"""A factor of a quantity, or one of each of its columns."""


Angle = Annotated[float, Field(ge=-180.0, le=180.0)]


class SignalPart(DataPart):
    """One signal: its data file, and the names and units of its columns there.

    Attributes
    ----------
    columns : dict
        Quantity -> column name (three for a vector, in the device's order x, y, z), and ``time``. Left
        out are those that have simrail's own names.
    units : dict
        Quantity -> unit; SI where left out. ``"-g"`` is a logger that prints the negative. The time may be
        text (``"iso"``: clock times and date-times of many forms), or ``"ticks"``.
    lsb_per_unit : dict
        Quantity -> counts of one unit, for a file of raw counts, e.g. ``gyro = 16.4`` of ``"deg/s"``.
    tick_rate_hz : float, optional
        Ticks in a second, for a time in ticks.
    rate_hz : float, optional
        Rate of the samples, for a file without time stamps; beside time stamps, the rate they should have.
    start_s : float
        Time of the first sample of a file without time stamps.
    longest_gap_s : float, optional
        Longest distance of two samples that is bridged; that of the ride file where nothing is said, and
        for devices slower than that, three of their intervals.
    scale : dict
        Quantity -> factor on its values, for a device that is found to be off by one; of a vector also an
        array of three, one for each of its columns, of either sign.
    time_offset_s : float
        Seconds that are added to its stamps: negative for a device whose stamps are late.
    time_drift_ppm : float
        Millionths of the time since its first stamp that are added too: positive for a slow clock.
    """

    signal: ClassVar[Signal]
    """What the table describes."""

    columns: dict[str, Names] = Field(default_factory=dict)
    units: dict[str, str] = Field(default_factory=dict)
    lsb_per_unit: dict[str, Positive] = Field(default_factory=dict)
    tick_rate_hz: Positive | None = None
    rate_hz: Positive | None = None
    start_s: float = 0.0
    longest_gap_s: Annotated[float, Field(gt=0.0, le=600.0)] | None = None
    scale: dict[str, Factors] = Field(default_factory=dict)
    time_offset_s: Annotated[float, Field(ge=-LARGEST_OFFSET_S, le=LARGEST_OFFSET_S)] = 0.0
    time_drift_ppm: Annotated[float, Field(ge=-10_000.0, le=10_000.0)] = 0.0

    @model_validator(mode="after")
    def _known_quantities(self) -> Self:
        quantities = {quantity.key: quantity for quantity in self.signal.quantities}
        tables: dict[str, Iterable[str]] = {
            "columns": self.columns,
            "units": self.units,
            "lsb_per_unit": self.lsb_per_unit,
        }
        for field, table in tables.items():
            keys = [*quantities, *(["time"] if self.signal.timed and field != "lsb_per_unit" else [])]
            for key in table:
                if key not in keys:
                    raise InputError(
                        "unknown key",
                        field=f"{field}.{key}",
                        value=key,
                        limit="one of " + ", ".join(keys),
                        remedy=near(key, keys) or "remove it",
                    )
        scaled = [key for key, quantity in quantities.items() if not quantity.whole]
        for key, factors in self.scale.items():
            if key in scaled and isinstance(factors, tuple) and len(factors) != len(quantities[key].columns):
                raise InputError(
                    "has another number of factors than columns",
                    field=f"scale.{key}",
                    value=list(factors),
                    limit=f"one for all, or {len(quantities[key].columns)}",
                    remedy="1.0 for a column that is right",
                )
            if key not in scaled:
                raise InputError(
                    "has no scale",
                    field=f"scale.{key}",
                    limit="one of " + ", ".join(scaled),
                    remedy=near(key, scaled) or "remove it",
                )
        for key, names in self.columns.items():
            self._judge_names(key, names, len(quantities[key].columns) if key in quantities else 1)
        for key, unit in self.units.items():
            known = [*TIMES, TEXT_TIMES, *EPOCHS, TICKS]
            if key in quantities:
                known = [*quantities[key].units, *quantities[key].increments]
            if unit.removeprefix("-" if key in quantities else "") not in known:
                raise InputError(
                    "is no unit of this quantity",
                    field=f"units.{key}",
                    value=unit,
                    limit="one of " + ", ".join(known),
                    remedy=near(unit, known),
                )
        if (self.units.get("time") == TICKS) != (self.tick_rate_hz is not None):
            raise InputError(
                'belongs to units.time = "ticks", and that to it',
                field="tick_rate_hz",
                value=self.tick_rate_hz,
                limit="both of them, or none",
                remedy='give both, e.g. tick_rate_hz = 32768.0 and units.time = "ticks"',
            )
        return self

    def _judge_names(self, key: str, names: tuple[str, ...], count: int) -> None:
        """Refuse another number of columns than a quantity has; a time may stand in two, date first."""
        if len(names) == count or (key == "time" and len(names) == 2 and self.units.get(key) == TEXT_TIMES):
            return
        wanted = "three column names, of the axes x, y, z" if count == 3 else "one column name"
        raise InputError(
            "lacks an axis" if count == 3 else "names several columns",
            field=f"columns.{key}",
            value=list(names),
            limit=wanted,
            remedy='e.g. ["ax", "ay", "az"]' if count == 3 else None,
        )

    @property
    def time_unit(self) -> str:
        """Unit of the time stamps."""
        return self.units.get("time", "s")

    @property
    def increments(self) -> tuple[str, ...]:
        """Quantities that the file gives as increments."""
        return tuple(
            quantity.key
            for quantity in self.signal.quantities
            if self.units.get(quantity.key, "").removeprefix("-") in quantity.increments
        )


class VectorPart(SignalPart):
    """A signal of vectors: how the device sits on its body.

    Attributes
    ----------
    axes : tuple of str
        Which axis of the device points along X (forward), Y (left) and Z (up) of the body, e.g.
        ``["x", "-y", "-z"]`` for a device turned upside down about its x axis.
    roll_deg, pitch_deg, yaw_deg : float
        Angles (ZYX) of the axes so named in the body, where the device does not sit square.
    """

    axes: tuple[str, str, str] = ("x", "y", "z")
    roll_deg: Angle = 0.0
    pitch_deg: Annotated[float, Field(ge=-90.0, le=90.0)] = 0.0
    yaw_deg: Angle = 0.0

    @field_validator("axes")
    @classmethod
    def _right_handed(cls, value: tuple[str, str, str]) -> tuple[str, str, str]:
        letters = [axis.removeprefix("-") for axis in value]
        if sorted(letters) != ["x", "y", "z"]:
            raise InputError(
                "does not name each axis of the device once",
                value=list(value),
                limit='x, y and z, each with or without "-"',
                remedy='e.g. ["x", "-y", "-z"]',
            )
        order = ["xyz".index(letter) for letter in letters]
        minus = sum(axis.startswith("-") for axis in value)
        if np.linalg.det(np.eye(3)[order]) * (-1) ** minus < 0.0:
            raise InputError(
                "is left-handed: no device can be mounted so",
                value=list(value),
                limit="a rotation: an even number of swaps and minus signs",
                remedy="reverse one axis; if the device itself has left-handed axes, give one column "
                "of its file the other sign",
            )
        return value
