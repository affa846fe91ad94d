"""The signals of a recording, listed once: what a ride file calls them, their columns and their units.

Reading and writing go over this list, so a new signal of `Recording` is one entry here and one table of
`simrail.recording.files.ride_file.RideFile`. No data here.
"""

from dataclasses import dataclass, field
from math import pi

from simrail.core.columns import (
    ACCEL,
    ATTITUDE,
    EDGE_TIME,
    ENCODER,
    GNSS,
    GYRO,
    IRREGULARITY,
    MAGNETIC,
    ODOMETRY,
    ODOMETRY_SD,
    RAIL_DISPLACEMENT,
)
from simrail.recording.sheets.units import STANDARD_GRAVITY_MPS2

Factor = tuple[float, float]
"""A unit in SI as (multiply by, divide by): 1/1000 is no binary number, so milliseconds are divided."""

_DEGREE = (pi, 180.0)

TIMES: dict[str, Factor] = {"s": (1.0, 1.0), "ms": (1.0, 1e3), "us": (1.0, 1e6), "ns": (1.0, 1e9)}
ANGLES: dict[str, Factor] = {"rad": (1.0, 1.0), "deg": _DEGREE, "mrad": (1.0, 1e3), "urad": (1.0, 1e6)}
RATES: dict[str, Factor] = {"rad/s": (1.0, 1.0), "deg/s": _DEGREE, "deg/h": (pi, 180.0 * 3600.0)}
FORCES: dict[str, Factor] = {
    "m/s2": (1.0, 1.0),
    "g": (STANDARD_GRAVITY_MPS2, 1.0),
    "mg": (STANDARD_GRAVITY_MPS2, 1e3),
}
SPEEDS: dict[str, Factor] = {"m/s": (1.0, 1.0), "km/h": (1.0, 3.6)}
LENGTHS: dict[str, Factor] = {"m": (1.0, 1.0), "km": (1e3, 1.0), "mm": (1.0, 1e3)}
ACCELERATIONS: dict[str, Factor] = {"m/s2": (1.0, 1.0)}
FIELDS: dict[str, Factor] = {
    "T": (1.0, 1.0),
    "uT": (1.0, 1e6),
    "nT": (1.0, 1e9),
    "G": (1.0, 1e4),
}
IMPULSES: dict[str, Factor] = {"m/s": (1.0, 1.0), "mm/s": (1.0, 1e3)}
COUNTS: dict[str, Factor] = {"1": (1.0, 1.0)}


@dataclass(frozen=True)
class Quantity:
    """One quantity of a signal.

    Attributes
    ----------
    key : str
        What a ride file calls it, e.g. ``"gyro"``.
    columns : tuple of str
        Its columns in the recording; three of them are the X, Y and Z of a vector.
    units : dict of str to Factor
        Units in which a file may give it; the first is that of the columns.
    whole : bool
        True if it is a whole number.
    required : bool
        False for a column that a recording may lack; it alone may hold NaN.
    increments : dict of str to Factor
        Units in which a file may give what a sample adds to its integral, rather than the quantity.
    """

    key: str
    columns: tuple[str, ...]
    units: dict[str, Factor]
    whole: bool = False
    required: bool = True
    increments: dict[str, Factor] = field(default_factory=dict)


@dataclass(frozen=True)
class Signal:
    """One signal: its name (field of `Recording`, table of a ride file, stem of its file), its quantities.

    Attributes
    ----------
    name : str
        Its name.
    quantities : tuple of Quantity
        What it holds.
    timed : bool
        True if its frame is indexed by ``time_s``.
    keeps_blanks : bool
        True if a row without any value is a sample that says so, and none that is missing.
    """

    name: str
    quantities: tuple[Quantity, ...]
    timed: bool = True
    keeps_blanks: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """Every column that the signal may have, in order."""
        return tuple(column for quantity in self.quantities for column in quantity.columns)


def _alone(column: str, units: dict[str, Factor], *, whole: bool = False) -> Quantity:
    """A quantity of one column, called as the column is."""
    return Quantity(column, (column,), units, whole=whole)


_GYRO = Quantity("gyro", GYRO, RATES, increments=ANGLES)
_ACCEL = Quantity("accel", ACCEL, FORCES, increments=IMPULSES)
IMU_SIGNAL = Signal("imu", (_GYRO, _ACCEL))
SECOND_IMU_SIGNAL = Signal("second_imu", (_GYRO, _ACCEL))
IMU_SENSORS = (Signal("imu", (_GYRO,)), Signal("imu", (_ACCEL,)))
"""Gyroscope and accelerometer of an IMU apart, as loggers that give each a file of its own have them."""

ENCODER_SIGNAL = Signal(
    "encoder",
    (
        Quantity("count", ENCODER, COUNTS, whole=True),
        Quantity("edge_time", (EDGE_TIME,), TIMES, required=False),
    ),
)
GNSS_SIGNAL = Signal(
    "gnss",
    (
        Quantity("position", GNSS[:1], LENGTHS, required=False),
        Quantity("speed", GNSS[1:], SPEEDS, required=False),
    ),
    keeps_blanks=True,
)
MAGNETOMETER_SIGNAL = Signal("magnetometer", (Quantity("field", MAGNETIC, FIELDS),))
RAIL_SIGNAL = Signal("rail_displacement", tuple(_alone(column, LENGTHS) for column in RAIL_DISPLACEMENT))
ODOMETRY_SIGNAL = Signal(
    "odometry",
    tuple(
        _alone(column, units)
        for column, units in zip(ODOMETRY + ODOMETRY_SD, 2 * (LENGTHS, SPEEDS, ACCELERATIONS), strict=True)
    ),
)
ODOMETER_SIGNAL = Signal(
    "odometer",
    (
        Quantity("distance", ("distance_m",), LENGTHS, required=False),
        Quantity("speed", ("speed_mps",), SPEEDS, required=False),
    ),
)
"""What a train's odometer gives in place of an encoder's pulses; a recording holds the speed alone, since a
distance in steps is an encoder's."""

REFERENCE_SIGNAL = Signal(
    "reference",
    (
        *(Quantity(name.removesuffix("_rad"), (name,), ANGLES, required=False) for name in ATTITUDE),
        Quantity("position", ODOMETRY[:1], LENGTHS, required=False),
        Quantity("speed", ODOMETRY[1:2], SPEEDS, required=False),
    ),
)
"""What a recorded ride is compared with; part of no recording."""

RAIL_REFERENCE_SIGNAL = Signal(
    "rail_reference",
    (
        Quantity("position", ODOMETRY[:1], LENGTHS),
        *(Quantity(name.removesuffix("_m"), (name,), LENGTHS, required=False) for name in IRREGULARITY),
    ),
    timed=False,
)
"""Rails that a recorded ride is compared with."""

GAPS_SIGNAL = Signal(
    "gaps",
    (_alone("start_s", TIMES), _alone("end_s", TIMES), _alone("missing", COUNTS, whole=True)),
    timed=False,
)

SIGNALS: tuple[Signal, ...] = (
    IMU_SIGNAL,
    SECOND_IMU_SIGNAL,
    ENCODER_SIGNAL,
    MAGNETOMETER_SIGNAL,
    RAIL_SIGNAL,
    ODOMETRY_SIGNAL,
    ODOMETER_SIGNAL,
    GNSS_SIGNAL,
    GAPS_SIGNAL,
)
"""Every frame of a `Recording`."""
