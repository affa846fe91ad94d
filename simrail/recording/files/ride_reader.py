"""From a ride file and its data files to a `Recording`: one way for rides of real trains and for our own.

Signals come in SI and in the body's axes (`simrail.recording.files.signal_reader`); an IMU with irregular
time stamps is resampled (`simrail.core.resample`), with its gaps on record; an odometry that is not there is
made from encoder or odometer by the same filter that simulated rides use. What is at its best already (SI,
the body's own axes, uniform times) passes bit by bit. Nothing else is repaired: what has a fault is refused
by name.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import (
    GAP_INTERVALS,
    find_gaps,
    is_uniform,
    rate_of,
    refuse_long_gaps,
    resample,
    uniform_times,
)
from simrail.core.toml_files import blame, judge, label, load, read_toml
from simrail.estimators.odometry.encoder import encoder_odometry, speed_odometry
from simrail.recording.check_form import check_recording
from simrail.recording.check_physics import check_plausible
from simrail.recording.files.ride_file import ImuSignalPart, OdometerPart, RideFile
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import EncoderSheet, ImuSheet, Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.sheets.imu_sheet import imu_sheet
from simrail.track.file import TrackFile

RIDE_FILE = "ride.toml"
"""Name of the ride file in a folder that simrail wrote."""

WAY_GAP_S = 1.0
"""A wheel or an odometer may be silent for this long (or three readings) while the train moves."""


def read_ride(path: Path) -> Recording:
    """Read a ride.

    Parameters
    ----------
    path : Path
        A ride file, or a folder that holds a ``ride.toml``.

    Raises
    ------
    InputError
        If a file is missing or unreadable, or says something impossible, or the recording passes neither
        `check_recording` nor `check_plausible`.
    """
    path = path / RIDE_FILE if path.is_dir() else path
    file = label(path)
    spec = judge(RideFile, read_toml(path), file=file)
    with blame(file, "track"):
        track = load(TrackFile, "track", spec.track, folder=path.parent).design(Path(spec.track).stem)
    reader = SignalReader(path.parent, file)
    imu = reader.frame(spec.imu, "imu")
    imu, rate_hz, gaps = _uniform(imu, spec, file)
    if spec.gaps is not None:
        noted = reader.frame(spec.gaps, "gaps")
        gaps = noted if gaps is None else pd.concat([noted, gaps], ignore_index=True)
    sheet = replace(_sheet(spec.imu, path.parent, file), rate_hz=rate_hz)
    encoder, encoder_sheet = None, None
    if spec.encoder is not None:
        encoder, encoder_sheet = reader.frame(spec.encoder, "encoder"), spec.encoder.sheet
        if spec.encoder.reverse:
            encoder["pulse_count"] = -encoder["pulse_count"]
        _judge_way(encoder, "encoder", imu, 1.0, file)
    times = imu.index.to_numpy()
    magnetometer = None
    if spec.magnetometer is not None:
        magnetometer = _at(
            reader.frame(spec.magnetometer, "magnetometer"), times, spec.longest_gap_s, "magnetometer", file
        )
    seen = None
    if spec.rail_displacement is not None:
        seen = reader.frame(spec.rail_displacement, "rail_displacement")
        seen = _at(seen, times, spec.longest_gap_s, "rail_displacement", file)
    if spec.odometry is not None:
        odometry = _at(reader.frame(spec.odometry, "odometry"), times, WAY_GAP_S, "odometry", file)
        source = spec.odometry.source
    elif encoder is not None and encoder_sheet is not None and spec.encoder is not None:
        source = "encoder"
        odometry = encoder_odometry(
            encoder,
            encoder_sheet,
            times,
            start_position_m=spec.start_position_m,
            radius_relative_sd=spec.encoder.radius_relative_sd,
        )
    else:
        assert spec.odometer is not None
        odometry, encoder, encoder_sheet = _from_odometer(
            reader.frame(spec.odometer, "odometer"), spec.odometer, imu, spec.start_position_m, file
        )
        source = "odometer"
    recording = Recording(
        name=spec.name,
        imu=imu,
        imu_sheet=sheet,
        mount=spec.imu.name,
        mount_body=spec.imu.body,
        mount_position_m=spec.imu.position_m,
        track=track,
        encoder=encoder,
        encoder_sheet=encoder_sheet,
        start_position_m=spec.start_position_m,
        odometry=odometry,
        odometry_source=source,
        gravity_mps2=spec.gravity_mps2,
        gaps=gaps,
        magnetometer=magnetometer,
        magnetometer_sheet=None if spec.magnetometer is None else spec.magnetometer.sheet,
        rail_displacement=seen,
        rail_sensor_sheet=None if spec.rail_displacement is None else spec.rail_displacement.sheet,
    )
    check_recording(recording, file=file)
    check_plausible(recording, file=file)
    return recording


def _at(frame: pd.DataFrame, times: FloatArray, longest_gap_s: float, what: str, file: str) -> pd.DataFrame:
    """A signal at the IMU's times: as it is if it has them, else interpolated."""
    if np.array_equal(frame.index.to_numpy(), times):
        return frame
    return resample(frame, times, longest_gap_s=longest_gap_s, what=what, file=file)[0]


def _uniform(imu: pd.DataFrame, spec: RideFile, file: str) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """IMU at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    time = imu.index.to_numpy()
    measured = rate_of(time)
    stated = spec.imu.rate_hz or (spec.imu.sheet.rate_hz if spec.imu.sheet else None)
    if stated is not None and abs(measured / stated - 1.0) > 0.01:
        raise InputError(
            "the time stamps have another rate than is stated",
            file=file,
            field="imu.rate_hz" if spec.imu.rate_hz else "imu.sheet.rate_hz",
            value=stated,
            limit=f"{measured:.6g} Hz, to 1 %",
            remedy="mend it, or the unit of the time stamps; samples are not thinned out here",
        )
    rate = stated if stated is not None and abs(measured / stated - 1.0) <= 1e-4 else measured
    if is_uniform(time, rate):
        return imu, rate, None
    grid = uniform_times(float(time[0]), float(time[-1]), rate)
    sampled, gaps = resample(imu, grid, longest_gap_s=spec.longest_gap_s, file=file)
    return sampled, rate, gaps if len(gaps) else None


def _sheet(part: ImuSignalPart, folder: Path, file: str) -> ImuSheet:
    if part.sheet is not None:
        return part.sheet
    if part.datasheet is not None:
        grade = part.datasheet.grade("datasheet")
    else:
        with blame(file, "imu.grade"):
            grade = load_grade(str(part.grade), folder=folder)
    return imu_sheet(grade, delay_s=part.delay_s)


def _judge_way(frame: pd.DataFrame, table: str, imu: pd.DataFrame, step: float, file: str) -> None:
    """Refuse a way that does not span the IMU's times, or is lost while the train moves."""
    time, interval = frame.index.to_numpy(), 1.0 / rate_of(frame.index.to_numpy())
    slack = max(0.5, 2.0 * interval)
    first, last = float(imu.index[0]), float(imu.index[-1])
    if time[0] > first + slack or time[-1] < last - slack:
        raise InputError(
            "does not span the times of the IMU",
            file=file,
            field=f"{table}.time",
            value=f"{time[0]:.6g} to {time[-1]:.6g} s",
            limit=f"{first:.6g} to {last:.6g} s",
            remedy="cut the IMU's file, or mend the clocks: both need one and the same",
        )
    gaps = find_gaps(time, interval, gap_intervals=max(GAP_INTERVALS, WAY_GAP_S / interval))
    if step > 0.0:
        way = frame.iloc[:, 0]
        moved = np.abs(way[gaps["end_s"]].to_numpy() - way[gaps["start_s"]].to_numpy()) > step
        gaps = gaps[moved]
    refuse_long_gaps(gaps, max(WAY_GAP_S, 3.0 * interval), what=table, file=file)


def _from_odometer(
    frame: pd.DataFrame, part: OdometerPart, imu: pd.DataFrame, start_m: float, file: str
) -> tuple[pd.DataFrame, pd.DataFrame | None, EncoderSheet | None]:
    """Odometry from distance or speed; a distance in steps is an encoder with one pulse per step."""
    sign = -1.0 if part.reverse else 1.0
    times = imu.index.to_numpy()
    if "distance_m" in frame:
        step = float(part.resolution_m or 0.0)
        _judge_way(frame[["distance_m"]], "odometer", imu, step, file)
        way = frame["distance_m"].to_numpy()
        counts = np.rint(sign * (way - way[0]) / step).astype(np.int64)
        encoder = pd.DataFrame({"pulse_count": counts}, index=frame.index)
        sheet = EncoderSheet("odometer", 1, step / (2.0 * np.pi), rate_of(frame.index.to_numpy()))
        made = encoder_odometry(
            encoder, sheet, times, start_position_m=start_m, radius_relative_sd=part.radius_relative_sd
        )
        return made, encoder, sheet
    _judge_way(frame, "odometer", imu, 0.0, file)
    made = speed_odometry(
        frame.index.to_numpy(),
        sign * frame["speed_mps"].to_numpy(),
        times,
        start_position_m=start_m,
        speed_sd_mps=part.speed_sd_mps,
        scale_relative_sd=part.radius_relative_sd,
    )
    return made, None, None
