"""The IMUs of a ride: their sensors brought together, at uniform times, with the gaps on record.

Sensors with files or times of their own are joined at the times of the faster one; a second IMU keeps a clock
of its own, and its place is held against the drawing of the vehicle.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.columns import IMU
from simrail.core.errors import InputError
from simrail.core.resample import (
    SLOW_INTERVALS,
    find_gaps,
    is_uniform,
    rate_of,
    refuse_long_gaps,
    refuse_many_lost,
    resample,
    uniform_times,
)
from simrail.core.toml_files import blame
from simrail.recording.check_samples import imu_bounds
from simrail.recording.files.common_time import refuse_little
from simrail.recording.files.ride_file import (
    AccelPart,
    GyroPart,
    ImuSignalPart,
    RideFile,
    SecondImuSignalPart,
)
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import ImuSheet, Recording, SecondImuSheet
from simrail.recording.sheets.grades import imu_sheet
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.signals import IMU_SENSORS

SPACING_SDS = 6.0
"""Standard deviations by which a stated spacing of two IMUs may differ from the drawing's."""

SLOWEST_HZ, FASTEST_HZ = 1.0, 1e5
"""Rates of IMUs; beyond them the unit of the time stamps is wrong."""

SENSORS = ("gyro", "accel")

OTHER_RATE = 10.0
"""Rate of a file over that of its sheet from which on a note says so: up to there a device has several."""


def read_imu(spec: RideFile, reader: SignalReader) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """The IMU at uniform times.

    Parameters
    ----------
    spec : RideFile
        What the ride file says.
    reader : SignalReader
        Reads its data files.

    Returns
    -------
    imu : pandas.DataFrame
        Columns of `simrail.core.columns.IMU`.
    rate_hz : float
        Its rate.
    gaps : pandas.DataFrame or None
        Those that were bridged; None if there were none.

    Raises
    ------
    InputError
        If a signal is bad, its rate is no IMU's or another than is stated, or too much of it is lost.
    """
    part, bounds = spec.imu, imu_bounds(_sheet(spec.imu, reader.folder))
    if part.gyro is None and part.accel is None:
        frames = reader.apart(part, "imu", IMU_SENSORS, bounds)
    else:
        kinds = {"gyro": GyroPart, "accel": AccelPart}
        frames = [reader.frame(part.sensor(key, kind), f"imu.{key}", bounds) for key, kind in kinds.items()]
    longest = spec.longest_gap_s if part.longest_gap_s is None else part.longest_gap_s
    if len(frames) == 1 or np.array_equal(frames[0].index.to_numpy(), frames[1].index.to_numpy()):
        imu = frames[0] if len(frames) == 1 else pd.concat(frames, axis=1)
        return _uniform(imu, part, longest, "imu")
    # The faster one sets the times; of two that are as fast, the gyroscope.
    rates = [rate_of(frame.index.to_numpy()) for frame in frames]
    leads = 1 if rates[1] > 1.01 * rates[0] else 0
    led = frames[1 - leads]
    lead = frames[leads]
    within = (lead.index >= led.index[0]) & (lead.index <= led.index[-1])
    refuse_little(lead.index.to_numpy(), within, {f"imu.{SENSORS[1 - leads]}": led})
    lead, rate, gaps = _uniform(lead[within], part, longest, "imu")
    times, interval = lead.index.to_numpy(), 1.0 / rates[1 - leads]
    other, more = resample(
        led,
        times,
        longest_gap_s=max(longest, SLOW_INTERVALS * interval),
        what=f"imu.{SENSORS[1 - leads]}",
        interval_s=interval,
    )
    reader.notes.append(
        f"imu: {SENSORS[1 - leads]} ({rates[1 - leads]:.4g} Hz) is interpolated at the times of "
        f"{SENSORS[leads]} ({rate:.4g} Hz), {times[0]:.9g} to {times[-1]:.9g} s"
    )
    found = [frame for frame in (gaps, more) if frame is not None and len(frame)]
    imu = pd.concat([lead, other], axis=1)[[*IMU]]
    return imu, rate, pd.concat(found, ignore_index=True).sort_values("start_s") if found else None


def _uniform(
    imu: pd.DataFrame, part: ImuSignalPart, longest_gap_s: float, table: str
) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """A frame at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    time = imu.index.to_numpy()
    measured = rate_of(time)
    if not SLOWEST_HZ <= measured <= FASTEST_HZ:
        raise InputError(
            "the time stamps are of no IMU's rate",
            field=f"{table}.units.time",
            value=f"{measured:.4g} Hz",
            limit=f"{SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz",
            remedy="give the unit of the time stamps: s, ms, us, ns, epoch_s, epoch_ms, ...",
        )
    stated = part.rate_hz or (part.sheet.rate_hz if part.sheet else None)
    if stated is not None and abs(measured / stated - 1.0) > 0.01:
        raise InputError(
            "the time stamps have another rate than is stated",
            field=f"{table}.rate_hz" if part.rate_hz else f"{table}.sheet.rate_hz",
            value=stated,
            limit=f"{measured:.6g} Hz, to 1 %",
            remedy="mend it, or the unit of the time stamps; samples are not thinned out here",
        )
    rate = stated if stated is not None and abs(measured / stated - 1.0) <= 1e-4 else measured
    if is_uniform(time, rate):
        return imu, rate, None
    # Judged before a grid is made: one over a jump of the clock would take all memory.
    lost = find_gaps(time, 1.0 / rate)
    refuse_long_gaps(lost, longest_gap_s)
    refuse_many_lost(lost, len(time))
    grid = uniform_times(float(time[0]), float(time[-1]), rate)
    sampled, gaps = resample(imu, grid, longest_gap_s=longest_gap_s)
    return sampled, rate, gaps if len(gaps) else None


def sheet_at(part: ImuSignalPart, folder: Path, rate_hz: float, notes: list[str]) -> ImuSheet:
    """The sheet at the rate of the file; an increment, a mean up to its stamp, is half an interval old.

    Parameters
    ----------
    part : ImuSignalPart
        What the ride file says.
    folder : Path
        Its folder, which paths of IMU files start from.
    rate_hz : float
        Rate of the file.
    notes : list of str
        Is told of a sheet whose own rate is far below that of the file.
    """
    own = _sheet(part, folder)
    if rate_hz > OTHER_RATE * own.rate_hz:
        notes.append(
            f"imu: the sheet of {own.grade} gives {own.rate_hz:g} samples a second, and the file has "
            f"{rate_hz:.6g}: mind the unit of its rate_hz, or it is the sheet of another device"
        )
    sheet = replace(own, rate_hz=rate_hz)
    return replace(sheet, lag_s=max(sheet.lag_s, 0.5 / rate_hz)) if part.increments else sheet


def _sheet(part: ImuSignalPart, folder: Path, table: str = "imu") -> ImuSheet:
    if part.sheet is not None:
        return part.sheet
    if part.datasheet is not None:
        grade = part.datasheet.grade("datasheet")
    else:
        with blame(None, f"{table}.grade"):
            grade = load_grade(str(part.grade), folder=folder)
    return imu_sheet(grade, delay_s=part.delay_s)


def with_second_imu(
    recording: Recording, part: SecondImuSignalPart, spec: RideFile, reader: SignalReader
) -> Recording:
    """Add the second IMU, at uniform times of its own; its gaps are bridged like the first one's.

    Parameters
    ----------
    recording : Recording
        With its first IMU.
    part, spec : SecondImuSignalPart, RideFile
        What the ride file says.
    reader : SignalReader
        Reads its data file.

    Raises
    ------
    InputError
        If its signals are bad, or its place is not that of the drawing.
    """
    own = _sheet(part, reader.folder, "second_imu")
    signals = reader.frame(part, "second_imu", imu_bounds(own))
    longest = spec.longest_gap_s if part.longest_gap_s is None else part.longest_gap_s
    imu, rate_hz, _ = _uniform(signals, part, longest, "second_imu")
    with blame(None, "second_imu"):
        spacing_m = _spacing_m(recording, part)
    sheet = SecondImuSheet(
        mount=part.name,
        mount_body=part.body,
        mount_position_m=part.position_m,
        spacing_m=spacing_m,
        imu=replace(own, rate_hz=rate_hz),
        spacing_sd_m=part.spacing_sd_m,
        clock_offset_sd_s=part.clock_offset_sd_s,
    )
    return replace(recording, second_imu=imu, second_imu_sheet=sheet)


def _spacing_m(recording: Recording, part: SecondImuSignalPart) -> float:
    """How far a second IMU is behind the first: as told, or by the drawing; refused where these differ."""
    drawn, drawing = None, recording.vehicle_sheet
    if drawing is not None:
        bodies = drawing.body(recording.mount_body), drawing.body(part.body)
        if bodies[0] is not None and bodies[1] is not None:
            first, second = bodies[0].x_m + recording.mount_position_m[0], bodies[1].x_m + part.position_m[0]
            drawn = first - second
            slack = SPACING_SDS * math.hypot(part.spacing_sd_m, math.sqrt(2.0) * drawing.place_sd_m)
            if part.spacing_m is not None and abs(part.spacing_m - drawn) > slack:
                raise InputError(
                    "is not the distance on the drawing of the vehicle",
                    field="spacing_m",
                    value=part.spacing_m,
                    limit=f"{drawn:g} m to {slack:.2g} m",
                    remedy="mend it (positive if the second IMU sits behind the first), or the drawing",
                )
    if part.spacing_m is not None:
        return part.spacing_m
    if drawn is None:
        raise InputError(
            "is missing, and no drawing of the vehicle has both bodies",
            field="spacing_m",
            limit="metres that this IMU sits behind the first, along the train; below 0 ahead of it",
            remedy="measure it to a centimetre: a thousandth of it is a thousandth of the way",
        )
    return drawn
