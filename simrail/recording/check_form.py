"""The judgement of a recording, ours or a stranger's: is it one at all?

Columns, numbers, time stamps, sheets. Nothing is repaired: a recording with a fault is refused, with the
place of the fault. Whether what it says can be true (units, axes) is judged by
`simrail.recording.check_physics`.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from simrail.core.columns import (
    ACCEL,
    EDGE_TIME,
    ENCODER,
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
from simrail.recording.recording import Recording

MAX_RATE_RADPS, MAX_FORCE_MPS2 = 20.0, 500.0
"""No train turns or shakes harder: beyond this the unit is wrong."""

MAX_FIELD_T = 1e-2
"""Two hundred times the Earth's field: beyond this the unit is wrong."""

MAX_RAIL_M = 10.0
"""No rail is farther from a sensor that sees it: beyond this the unit is wrong."""


def check_recording(recording: Recording, *, file: object = None) -> None:
    """Refuse a recording that no estimator should see.

    Parameters
    ----------
    recording : Recording
        The recording to judge.
    file : object, optional
        Where it came from, for the message.

    Raises
    ------
    InputError
        At the first of: a missing column; a value that is no number; time stamps that are not
        increasing, or not uniform in the IMU; angular rates above 20 rad/s (degrees?) or specific
        forces above 500 m/s2, fields above 10 mT; an IMU rate other than its sheet's; odometry or
        magnetometer at other times than the IMU's; an encoder, magnetometer or rail sensor without its sheet.
    """
    _check_signal(recording.imu, IMU, what="imu", file=file)
    _check_signal(recording.odometry, ODOMETRY + ODOMETRY_SD, what="odometry", file=file)
    if recording.encoder is not None:
        timed = (EDGE_TIME,) if EDGE_TIME in recording.encoder else ()
        _check_signal(recording.encoder, ENCODER + timed, what="encoder", file=file)
        if recording.encoder_sheet is None:
            raise InputError(
                "an encoder without its sheet says nothing",
                file=file,
                field="encoder_sheet",
                remedy="give pulses per revolution and wheel radius",
            )
    _check_uniform(recording.imu.index.to_numpy(), recording.imu_sheet.rate_hz, file)
    limits: list[tuple[str, tuple[str, ...], float, str, str]] = [
        ("imu", GYRO, MAX_RATE_RADPS, "rad/s", "degrees"),
        ("imu", ACCEL, MAX_FORCE_MPS2, "m/s2", "mg"),
    ]
    at_imu_times = ["odometry"]
    if recording.magnetometer is not None:
        _check_signal(recording.magnetometer, MAGNETIC, what="magnetometer", file=file)
        if recording.magnetometer_sheet is None:
            raise InputError(
                "a magnetometer without its sheet gives no heading",
                file=file,
                field="magnetometer_sheet",
                remedy="give the Earth's field and the direction of magnetic north",
            )
        limits.append(("magnetometer", MAGNETIC, MAX_FIELD_T, "T", "microtesla or gauss"))
        at_imu_times.append("magnetometer")
    if recording.rail_displacement is not None:
        _check_signal(recording.rail_displacement, RAIL_DISPLACEMENT, what="rail_displacement", file=file)
        if recording.rail_sensor_sheet is None:
            raise InputError(
                "a rail sensor without its sheet says nothing of the rails",
                file=file,
                field="rail_sensor_sheet",
                remedy="give its noise and the distance of the nominal rails",
            )
        limits.append(("rail_displacement", RAIL_DISPLACEMENT, MAX_RAIL_M, "m", "millimetres"))
        at_imu_times.append("rail_displacement")
    for what, columns, limit, unit, suspect in limits:
        _check_size(getattr(recording, what), columns, (limit, unit, suspect), what=what, file=file)
    for what in at_imu_times:
        frame = getattr(recording, what)
        if not np.array_equal(frame.index.to_numpy(), recording.imu.index.to_numpy()):
            raise InputError(
                "has other time stamps than the IMU",
                file=file,
                field=f"{what}.time_s",
                value=f"{len(frame)} samples",
                limit=f"the {len(recording.imu)} time stamps of the IMU",
                remedy=f"make the {what} at the IMU's times",
            )


def _check_signal(frame: pd.DataFrame, columns: tuple[str, ...], *, what: str, file: object) -> None:
    require(frame, columns, what=what, file=file)
    if len(frame) < 2:
        raise InputError("is too short", file=file, field=what, value=f"{len(frame)} samples", limit=">= 2")
    for column in columns:
        if not pd.api.types.is_numeric_dtype(frame[column]):
            raise InputError(
                "holds no numbers",
                file=file,
                field=f"{what}.{column}",
                value=str(frame[column].dtype),
                limit="numbers",
            )
        bad = ~np.isfinite(frame[column].to_numpy(dtype=np.float64))
        if bad.any():
            raise InputError(
                f"is not a finite number at time_s = {frame.index[int(np.argmax(bad))]} "
                f"({int(bad.sum())} such samples)",
                file=file,
                field=f"{what}.{column}",
                value=float(frame[column].iloc[int(np.argmax(bad))]),
                limit="finite numbers",
                remedy="cut the recording there; nothing is filled in silently",
            )
    if frame.index.name != "time_s" or not pd.api.types.is_numeric_dtype(frame.index):
        raise InputError(
            "is not indexed by time",
            file=file,
            field=what,
            value=f"{frame.index.name} ({frame.index.dtype})",
            limit="an index time_s of seconds",
        )
    check_stamps(frame.index.to_numpy(dtype=np.float64), field=f"{what}.time_s", file=file)


def _check_size(
    frame: pd.DataFrame, columns: tuple[str, ...], bound: tuple[float, str, str], *, what: str, file: object
) -> None:
    """Refuse values beyond (limit, unit); they look like another unit, which the bound names third."""
    limit, unit, suspect = bound
    for column in columns:
        values = np.abs(frame[column].to_numpy(dtype=np.float64))
        if values.max() > limit:
            worst = int(np.argmax(values))
            raise InputError(
                f"is beyond what a train does at time_s = {float(frame.index[worst]):.6g}",
                file=file,
                field=f"{what}.{column}",
                value=float(frame[column].iloc[worst]),
                limit=f"{limit:g} {unit}",
                remedy=f"convert to {unit}; the values look like {suspect}",
            )


def _check_uniform(time: np.ndarray, rate_hz: float, file: object) -> None:
    """IMU samples must come at the rate of the sheet, to 1 % of an interval each and 0.01 % over all."""
    step = np.diff(time)
    off = np.abs(step * rate_hz - 1.0)
    worst = int(np.argmax(off))
    if off[worst] > 0.01:
        raise InputError(
            f"is not uniform at sample {worst + 1}",
            file=file,
            field="imu.time_s",
            value=f"{step[worst]:.6g} s after time_s = {time[worst]:.6g}",
            limit=f"{1.0 / rate_hz:.6g} s, as the sheet's rate of {rate_hz:g} Hz says",
            remedy="mend the rate in the sheet, or resample; gaps are not bridged silently",
        )
    mean = (len(time) - 1) / (time[-1] - time[0])
    if abs(mean / rate_hz - 1.0) > 1e-4:
        raise InputError(
            "has another rate than the sheet says",
            file=file,
            field="imu.time_s",
            value=f"{mean:.9g} Hz",
            limit=f"{rate_hz:g} Hz",
            remedy="mend the rate in the sheet",
        )
