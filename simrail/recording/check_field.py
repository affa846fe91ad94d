"""Is it the field of the Earth? A magnetometer held against the intensity and dip that its sheet states.

Zeros stand where there is no magnetometer; iron of the vehicle adds a field that turns with the train
(hard iron), which may be larger than the Earth's. Where the track and an odometry say which way the train
heads, the constant field that is left over on the body's axes is named, to be taken off.
"""

import numpy as np

from simrail.core.columns import MAGNETIC
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix
from simrail.recording.recording import MagnetometerSheet, Recording
from simrail.recording.signals import FIELDS

SIZES = (0.4, 2.5)
"""Median size of the field over the Earth's, beyond which it is another unit, or mostly iron."""

REFUSED_OFFSET, WARNED_OFFSET = 1.0, 0.3
"""Hard iron over the Earth's intensity: as large, a heading is nothing but iron; a third turns it by 30
degrees where the dip is 55."""

WARNED_DIP_RAD = np.radians(15.0)

EARTH_T = (15e-6, 80e-6)
"""Intensities of the Earth's field, with room: 22 to 67 uT (NOAA, World Magnetic Model 2020, by memory)."""

LEAST_STEPS = 4
"""Numbers that a field must show to be one that is measured."""


def check_field(recording: Recording) -> None:
    """Refuse a field that is none: zeros, one number for the whole ride, or one of another size.

    Raises
    ------
    InputError
        With the size found, and the unit that would make it right, where one does.
    """
    if recording.magnetometer is None or recording.magnetometer_sheet is None:
        return
    field, sheet = recording.magnetometer[list(MAGNETIC)].to_numpy(), recording.magnetometer_sheet
    stated = f"{_micro(sheet.intensity_t)} uT, the Earth's intensity of its sheet"
    if not field.any():
        raise InputError(
            "is zero throughout: there is no magnetometer",
            field="magnetometer.field",
            value="0 uT",
            limit=stated,
            remedy="take [magnetometer] out, or mend the logger",
        )
    if sheet.noise_tpsqrthz > 0.0 and not np.any(np.diff(field, axis=0)):
        raise InputError(
            "is one and the same throughout: the magnetometer is stuck",
            field="magnetometer.field",
            value=f"{_micro(float(np.linalg.norm(field[0])))} uT",
            limit=f"noise of {sheet.noise_tpsqrthz:g} T/sqrt(Hz), as its sheet says",
            remedy="take [magnetometer] out, or mend the logger",
        )
    size = float(np.median(np.linalg.norm(field, axis=1)))
    if SIZES[0] < size / sheet.intensity_t < SIZES[1]:
        return
    remedy = "mend the unit or the scale, or the intensity of its sheet"
    if size > sheet.intensity_t:
        first = np.median(field[: max(1, len(field) // 100)], axis=0)
        iron = _vector(first - _expected_at_start(recording, sheet))
        remedy = f"take the hard iron of about {iron} uT on X, Y, Z of the body off, or mend the intensity"
    for unit, (multiply, divide) in FIELDS.items():
        for claimed, (by, over) in FIELDS.items():
            if unit != claimed and 0.7 < size * (multiply / divide) / (by / over) / sheet.intensity_t < 1.4:
                remedy = f'the values look like {unit}, given as {claimed}: set units.field = "{unit}"'
    raise InputError(
        "is not as large as the Earth's",
        field="magnetometer.field",
        value=f"{_micro(size)} uT in the median of the ride",
        limit=stated,
        remedy=remedy,
    )


def check_hard_iron(recording: Recording) -> None:
    """Refuse a field that is more of the vehicle than of the Earth, with the offset that is found.

    Raises
    ------
    InputError
        If the constant field on the body's axes is beyond `REFUSED_OFFSET` times the Earth's.
    """
    offset, sheet = field_offset(recording), recording.magnetometer_sheet
    if offset is not None and sheet is not None:
        size = float(np.linalg.norm(offset))
        if size > REFUSED_OFFSET * sheet.intensity_t:
            raise InputError(
                "holds a constant field as large as the Earth's: hard iron, or wrong axes",
                field="magnetometer.field",
                value=f"{_vector(offset)} uT on X, Y, Z of the body, {_micro(size)} uT",
                limit=f"{_micro(sheet.intensity_t)} uT, the Earth's intensity of its sheet",
                remedy="take that offset off the columns, or mend axes, inclination_rad and north_rad",
            )


def field_warnings(recording: Recording) -> tuple[str, ...]:
    """Warnings, a line each, of a field that is used as it is though it is not the Earth's alone."""
    sheet = recording.magnetometer_sheet
    if recording.magnetometer is None or sheet is None:
        return ()
    told = []
    if not EARTH_T[0] < sheet.intensity_t < EARTH_T[1] or abs(sheet.inclination_rad) > 0.5 * np.pi:
        told.append(
            f"magnetometer.sheet: {_micro(sheet.intensity_t)} uT at a dip of "
            f"{np.degrees(sheet.inclination_rad):.4g} deg is the field of no place on the Earth "
            "(22 to 67 uT, 90 deg)"
        )
    offset = field_offset(recording)
    if offset is not None and np.linalg.norm(offset) > WARNED_OFFSET * sheet.intensity_t:
        told.append(
            f"magnetometer.field: hard iron of {_vector(offset)} uT on X, Y, Z of the body beside the "
            f"Earth's {_micro(sheet.intensity_t)} uT: take it off the columns"
        )
    elif offset is None:
        down = -recording.magnetometer[MAGNETIC[2]].to_numpy()
        size = np.linalg.norm(recording.magnetometer[list(MAGNETIC)].to_numpy(), axis=1)
        dip = float(np.median(np.arcsin(down / np.maximum(size, 1e-12))))
        if abs(dip - sheet.inclination_rad) > WARNED_DIP_RAD:
            told.append(
                f"magnetometer.field: dips by {np.degrees(dip):.3g} deg, its sheet says "
                f"{np.degrees(sheet.inclination_rad):.3g} deg: hard iron, or wrong axes"
            )
    return tuple(told)


def field_offset(recording: Recording) -> FloatArray | None:
    """The constant field on the body's axes beside the Earth's (3,), T: its median over the ride.

    The body is taken to stand as the track does, and to head along it. None where the ride has no
    magnetometer or no odometry.
    """
    magnetometer, sheet, odometry = (
        recording.magnetometer,
        recording.magnetometer_sheet,
        recording.odometry,
    )
    if magnetometer is None or sheet is None or odometry is None:
        return None
    step = max(1, len(odometry) // 2000)
    frame = recording.track.frame_extended(odometry["position_m"].to_numpy()[::step])
    turns = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]))
    expected = np.einsum("nji,j->ni", turns, _earth(sheet))
    offset: FloatArray = np.median(magnetometer[list(MAGNETIC)].to_numpy()[::step] - expected, axis=0)
    return offset


def _expected_at_start(recording: Recording, sheet: MagnetometerSheet) -> FloatArray:
    """Field of the Earth (3,) on the axes of a body that stands at the start, T."""
    frame = recording.track.frame_extended(np.array([recording.start_position_m]))
    turns = rotation_matrix(np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad]))
    expected: FloatArray = turns[0].T @ _earth(sheet)
    return expected


def _earth(sheet: MagnetometerSheet) -> FloatArray:
    """Field of the Earth (3,), global axes, T."""
    level = sheet.intensity_t * np.cos(sheet.inclination_rad)
    north = sheet.north_rad
    down = sheet.intensity_t * np.sin(sheet.inclination_rad)
    return np.array([level * np.cos(north), level * np.sin(north), -down])


def _micro(tesla: float) -> str:
    return f"{1e6 * tesla:.4g}"


def _vector(tesla: FloatArray) -> list[float]:
    return [round(1e6 * float(part), 1) for part in tesla]
