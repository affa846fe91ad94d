"""The judgement of a recording, ours or a stranger's: whether it is one at all.

Columns, numbers, time stamps, sheets. Nothing is repaired: a recording with a fault is refused, with the
place of the fault. Whether what it says can be true (units, axes) is judged by
`simrail.recording.check_physics`.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from simrail.core.columns import (
    ACCEL,
    EDGE_TIME,
    ENCODER,
    GNSS,
    GYRO,
    IMU,
    MAGNETIC,
    ODOMETRY,
    ODOMETRY_SD,
    RAIL_DISPLACEMENT,
    require,
)
from simrail.core.errors import InputError
from simrail.core.resample import check_stamps
from simrail.recording.check_field import check_field
from simrail.recording.check_samples import markers
from simrail.recording.recording import AT_IMU_TIMES, Recording


class _Limit(NamedTuple):
    """Magnitude that no train reaches: beyond it the unit is wrong, and looks like another one."""

    frame: str
    columns: tuple[str, ...]
    limit: float
    unit: str
    suspect: str


LIMITS = (
    _Limit("imu", GYRO, 20.0, "rad/s", "degrees"),
    _Limit("imu", ACCEL, 500.0, "m/s2", "mg, or raw counts (lsb_per_unit)"),
    _Limit("second_imu", GYRO, 20.0, "rad/s", "degrees"),
    _Limit("second_imu", ACCEL, 500.0, "m/s2", "mg, or raw counts (lsb_per_unit)"),
    # Two hundred times the Earth's field.
    _Limit("magnetometer", MAGNETIC, 1e-2, "T", "microtesla or gauss"),
    _Limit("rail_displacement", RAIL_DISPLACEMENT, 10.0, "m", "millimetres"),
)

STILL_SHARE = 1e-3
"""Share of a limit that counts as nothing beside it."""

COLUMNS_OF = {
    "imu": IMU,
    "second_imu": IMU,
    "odometry": ODOMETRY + ODOMETRY_SD,
    "encoder": ENCODER,
    "odometer": ("speed_mps",),
    "magnetometer": MAGNETIC,
    "rail_displacement": RAIL_DISPLACEMENT,
    "gnss": (),
}
"""Columns that the frames of a recording must have, with numbers in all rows."""

LEAST_SPACING_M = 5.0
"""Two IMUs that are nearer to each other along the train feel the same place of the rails at nearly the same
time: within one bogie, they rather feel the bogie."""

SAME_RATE = 1e-3
"""Relative difference of rates up to which two IMUs sample alike: clocks differ by less."""

SHEETS = {
    "gnss": ("gnss_sheet", "says nothing", "give the standard deviations of its place and speed"),
    "second_imu": ("second_imu_sheet", "may be anywhere", "say where it sits, with its data sheet"),
    "encoder": ("encoder_sheet", "says nothing", "give pulses per revolution and wheel radius"),
    "odometer": ("odometer_sheet", "says nothing", "give the standard deviations of its speed and scale"),
    "magnetometer": (
        "magnetometer_sheet",
        "gives no heading",
        "give the Earth's field and the direction of magnetic north",
    ),
    "rail_displacement": (
        "rail_sensor_sheet",
        "says nothing of the rails",
        "give its noise and the distance of the nominal rails",
    ),
}
"""Sheet that each device needs, what it is worth without, and the remedy."""


def check_recording(recording: Recording) -> None:
    """Refuse a recording that no estimator should see.

    Parameters
    ----------
    recording : Recording
        The recording to judge.

    Raises
    ------
    InputError
        At the first of: a missing column; a value that is no number; time stamps that are not
        increasing, or not uniform in the IMU; a device without its sheet; values beyond `LIMITS`
        (degrees?); a field that is not as large as the Earth's; an IMU rate other than its sheet's; two
        IMUs of different rates, or too near to each other; a frame at other times than the IMU's that belongs
        there.
    """
    frames = {name: getattr(recording, name) for name in COLUMNS_OF}
    frames = {name: frame for name, frame in frames.items() if frame is not None}
    for name, frame in frames.items():
        timed = (EDGE_TIME,) if name == "encoder" and EDGE_TIME in frame else ()
        _check_signal(frame, COLUMNS_OF[name] + timed, what=name)
        if name == "gnss":
            _check_gnss(frame)
        if name in SHEETS:
            sheet, worth, remedy = SHEETS[name]
            if getattr(recording, sheet) is None:
                raise InputError(
                    f"{name} without its sheet {worth}",
                    field=sheet,
                    remedy=remedy,
                    limit="a signal with its sheet",
                )
    _check_uniform(recording.imu.index.to_numpy(), recording.imu_sheet.rate_hz)
    second = recording.second_imu_sheet
    if recording.second_imu is not None and second is not None:
        _check_uniform(recording.second_imu.index.to_numpy(), second.imu.rate_hz, table="second_imu")
        check_pair(recording.imu_sheet.rate_hz, second.imu.rate_hz, second.spacing_m)
    for limit in LIMITS:
        if limit.frame in frames:
            _check_size(frames[limit.frame], limit)
    check_field(recording)
    for name in AT_IMU_TIMES:
        if name in frames and not np.array_equal(
            frames[name].index.to_numpy(), recording.imu.index.to_numpy()
        ):
            raise InputError(
                "has other time stamps than the IMU",
                field=f"{name}.time_s",
                value=f"{len(frames[name])} samples",
                limit=f"the {len(recording.imu)} time stamps of the IMU",
                remedy=f"make the {name} at the IMU's times",
            )


def _check_gnss(frame: pd.DataFrame) -> None:
    """It has a place or a speed, and rows without any are fine."""
    columns = [name for name in GNSS if name in frame]
    if not columns:
        raise InputError(
            "has neither a place nor a speed",
            field="gnss",
            value=list(frame) or None,
            limit=" or ".join(GNSS),
            remedy='e.g. columns = { time = "t", speed = "v" }',
        )
    for name in columns:
        if not pd.api.types.is_numeric_dtype(frame[name]):
            raise InputError(
                "holds no numbers", field=f"gnss.{name}", value=str(frame[name].dtype), limit="numbers"
            )
        endless = np.isinf(frame[name].to_numpy(dtype=np.float64))
        if endless.any():
            raise InputError(
                f"is not a finite number at time_s = {frame.index[int(np.argmax(endless))]}",
                field=f"gnss.{name}",
                limit="finite, or blank where nothing was received",
            )


def check_pair(rate_hz: float, second_rate_hz: float, spacing_m: float) -> None:
    """Refuse two IMUs whose rates differ, or that are too near to each other along the train.

    Raises
    ------
    InputError
        Beyond `SAME_RATE` or `LEAST_SPACING_M`.
    """
    if abs(second_rate_hz / rate_hz - 1.0) > SAME_RATE:
        raise InputError(
            "has another rate than the first IMU",
            field="second_imu.rate_hz",
            value=f"{second_rate_hz:g} Hz",
            limit=f"{rate_hz:g} Hz, to {100.0 * SAME_RATE:g} %",
            remedy="record both at one rate",
        )
    if not abs(spacing_m) >= LEAST_SPACING_M:
        raise InputError(
            "is too near to the first IMU along the train",
            field="second_imu.spacing_m",
            value=float(f"{spacing_m:.6g}"),
            limit=f"{LEAST_SPACING_M:g} m at least, ahead or behind",
            remedy="mount it on another bogie, or leave [second_imu] out",
        )


def _check_signal(frame: pd.DataFrame, columns: tuple[str, ...], *, what: str) -> None:
    require(frame, columns, what=what)
    if len(frame) < 2:
        raise InputError("is too short", field=what, value=f"{len(frame)} samples", limit=">= 2")
    for column in columns:
        if not pd.api.types.is_numeric_dtype(frame[column]):
            raise InputError(
                "holds no numbers",
                field=f"{what}.{column}",
                value=str(frame[column].dtype),
                limit="numbers",
            )
        bad = ~np.isfinite(frame[column].to_numpy(dtype=np.float64))
        if bad.any():
            raise InputError(
                f"is not a finite number at time_s = {frame.index[int(np.argmax(bad))]} "
                f"({int(bad.sum())} such samples)",
                field=f"{what}.{column}",
                value=float(frame[column].iloc[int(np.argmax(bad))]),
                limit="finite numbers",
                remedy="cut the recording there; nothing is filled in silently",
            )
    if frame.index.name != "time_s" or not pd.api.types.is_numeric_dtype(frame.index):
        raise InputError(
            "is not indexed by time",
            field=what,
            value=f"{frame.index.name} ({frame.index.dtype})",
            limit="an index time_s of seconds",
        )
    check_stamps(frame.index.to_numpy(dtype=np.float64), field=f"{what}.time_s")


def _check_size(frame: pd.DataFrame, bound: _Limit) -> None:
    """Refuse values beyond a limit."""
    for column in bound.columns:
        signal = frame[column].to_numpy(dtype=np.float64)
        values = np.abs(signal)
        if values.max() > bound.limit:
            worst = int(np.argmax(values))
            # Units are judged by the whole: what stands apart from it is no measurement in any unit.
            apart = markers(signal, still=STILL_SHARE * bound.limit, limit=bound.limit)
            remedy = f"convert to {bound.unit}; the values look like {bound.suspect}"
            if apart[worst]:
                remedy = "drop the sample, so that it is a gap: it stands apart from all others"
            raise InputError(
                f"is beyond what a train does at time_s = {float(frame.index[worst]):.6g}"
                + (f" ({int(apart.sum())} such samples); it is no measurement" if apart[worst] else ""),
                field=f"{bound.frame}.{column}",
                value=float(frame[column].iloc[worst]),
                limit=f"{bound.limit:g} {bound.unit}",
                remedy=remedy,
            )


def _check_uniform(time: np.ndarray, rate_hz: float, *, table: str = "imu") -> None:
    """IMU samples must come at the rate of the sheet, to 1 % of an interval each and 0.01 % over all."""
    step = np.diff(time)
    off = np.abs(step * rate_hz - 1.0)
    worst = int(np.argmax(off))
    if off[worst] > 0.01:
        raise InputError(
            f"is not uniform at sample {worst + 1}",
            field=f"{table}.time_s",
            value=f"{step[worst]:.6g} s after time_s = {time[worst]:.6g}",
            limit=f"{1.0 / rate_hz:.6g} s, as the sheet's rate of {rate_hz:g} Hz says",
            remedy="mend the rate in the sheet, or resample; gaps are not bridged silently",
        )
    mean = (len(time) - 1) / (time[-1] - time[0])
    if abs(mean / rate_hz - 1.0) > 1e-4:
        raise InputError(
            "has another rate than the sheet says",
            field=f"{table}.time_s",
            value=f"{mean:.9g} Hz",
            limit=f"{rate_hz:g} Hz",
            remedy="mend the rate in the sheet",
        )
