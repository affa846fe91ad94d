"""From a ride file and its data files to a `Recording`: one way for rides of real trains and for our own.

Signals come in SI and in the body's axes (`simrail.recording.files.signal_reader`); an IMU with irregular
time stamps is resampled (`simrail.core.resample`), with its gaps on record. What is at its best already (SI,
the body's own axes, uniform times) passes bit by bit. Nothing else is repaired: what has a fault is refused
by name.

Not here: an odometry, where the file has none, and whether the ride can be true, which are the matter of
`simrail.estimation.recorded_ride.read_ride`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

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
from simrail.recording.check_form import SHEETS, check_recording
from simrail.recording.files.ride_file import ImuSignalPart, RideFile
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import EncoderSheet, ImuSheet, OdometerSheet, Recording
from simrail.recording.sheets.grades import imu_sheet
from simrail.recording.sheets.imu_file import load_grade
from simrail.track.file import TrackFile

RIDE_FILE = "ride.toml"
"""Name of the ride file in a folder that simrail wrote."""

WAY_GAP_S = 1.0
"""A wheel or an odometer may be silent for this long (or three readings) while the train moves."""


def read_signals(path: Path) -> Recording:
    """Read the signals of a ride, and what the train knows; its odometry only where the file has one.

    Parameters
    ----------
    path : Path
        A ride file, or a folder that holds a ``ride.toml``.

    Raises
    ------
    InputError
        If a file is missing or unreadable, or says something impossible, or the recording does not pass
        `check_recording`.
    """
    path = ride_file(path)
    spec = judge(RideFile, read_toml(path), file=label(path))
    with blame(label(path)):
        recording = _recording(spec, path.parent)
        check_recording(recording)
    return recording


def ride_file(path: Path) -> Path:
    """The ride file that a path means."""
    return path / RIDE_FILE if path.is_dir() else path


def _recording(spec: RideFile, folder: Path) -> Recording:
    with blame(None, "track"):
        track = load(TrackFile, "track", spec.track, folder=folder).design(Path(spec.track).stem)
    reader = SignalReader(folder)
    imu, rate_hz, gaps = _uniform(reader.frame(spec.imu, "imu"), spec)
    if spec.gaps is not None:
        noted = reader.frame(spec.gaps, "gaps")
        gaps = noted if gaps is None else pd.concat([noted, gaps], ignore_index=True)
    others: dict[str, Any] = {}
    for name, longest_gap_s in (
        ("magnetometer", spec.longest_gap_s),
        ("rail_displacement", spec.longest_gap_s),
        ("odometry", WAY_GAP_S),
    ):
        part = getattr(spec, name)
        if part is not None:
            others[name] = _at(reader.frame(part, name), imu.index.to_numpy(), longest_gap_s, name)
            if name in SHEETS:
                others[SHEETS[name][0]] = part.sheet
    recording = Recording(
        name=spec.name,
        imu=imu,
        imu_sheet=replace(_sheet(spec.imu, folder), rate_hz=rate_hz),
        mount=spec.imu.name,
        mount_body=spec.imu.body,
        mount_position_m=spec.imu.position_m,
        track=track,
        map_errors=spec.map.errors(),
        vehicle_sheet=None if spec.vehicle_sheet is None else spec.vehicle_sheet.sheet(spec.imu.body),
        encoder=None,
        encoder_sheet=None,
        start_position_m=spec.start_position_m,
        start_speed_mps=spec.start_speed_mps,
        odometry_source="" if spec.odometry is None else spec.odometry.source,
        gravity_mps2=spec.gravity_mps2,
        gaps=gaps,
        **others,
    )
    return _with_way(recording, spec, reader)


def _at(frame: pd.DataFrame, times: FloatArray, longest_gap_s: float, what: str) -> pd.DataFrame:
    """A signal at the IMU's times: as it is if it has them, else interpolated."""
    if np.array_equal(frame.index.to_numpy(), times):
        return frame
    return resample(frame, times, longest_gap_s=longest_gap_s, what=what)[0]


def _uniform(imu: pd.DataFrame, spec: RideFile) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """IMU at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    time = imu.index.to_numpy()
    measured = rate_of(time)
    stated = spec.imu.rate_hz or (spec.imu.sheet.rate_hz if spec.imu.sheet else None)
    if stated is not None and abs(measured / stated - 1.0) > 0.01:
        raise InputError(
            "the time stamps have another rate than is stated",
            field="imu.rate_hz" if spec.imu.rate_hz else "imu.sheet.rate_hz",
            value=stated,
            limit=f"{measured:.6g} Hz, to 1 %",
            remedy="mend it, or the unit of the time stamps; samples are not thinned out here",
        )
    rate = stated if stated is not None and abs(measured / stated - 1.0) <= 1e-4 else measured
    if is_uniform(time, rate):
        return imu, rate, None
    grid = uniform_times(float(time[0]), float(time[-1]), rate)
    sampled, gaps = resample(imu, grid, longest_gap_s=spec.longest_gap_s)
    return sampled, rate, gaps if len(gaps) else None


def _sheet(part: ImuSignalPart, folder: Path) -> ImuSheet:
    if part.sheet is not None:
        return part.sheet
    if part.datasheet is not None:
        grade = part.datasheet.grade("datasheet")
    else:
        with blame(None, "imu.grade"):
            grade = load_grade(str(part.grade), folder=folder)
    return imu_sheet(grade, delay_s=part.delay_s)


def _judge_way(frame: pd.DataFrame, table: str, imu: pd.DataFrame, step: float) -> None:
    """Refuse a way that does not span the IMU's times, or is lost while the train moves."""
    time, interval = frame.index.to_numpy(), 1.0 / rate_of(frame.index.to_numpy())
    slack = max(0.5, 2.0 * interval)
    first, last = float(imu.index[0]), float(imu.index[-1])
    if time[0] > first + slack or time[-1] < last - slack:
        raise InputError(
            "does not span the times of the IMU",
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
    refuse_long_gaps(gaps, max(WAY_GAP_S, 3.0 * interval), what=table)


def _with_way(recording: Recording, spec: RideFile, reader: SignalReader) -> Recording:
    """Add the encoder or the odometer; a distance in steps is an encoder with one pulse per step."""
    if spec.encoder is not None:
        counts = reader.frame(spec.encoder, "encoder")
        if spec.encoder.reverse:
            counts["pulse_count"] = -counts["pulse_count"]
        _judge_way(counts, "encoder", recording.imu, 1.0)
        return replace(recording, encoder=counts, encoder_sheet=spec.encoder.known)
    part = spec.odometer
    if part is None:
        return recording
    frame, sign = reader.frame(part, "odometer"), -1.0 if part.reverse else 1.0
    if "speed" in part.columns:
        _judge_way(frame, "odometer", recording.imu, 0.0)
        odometer = frame[["speed_mps"]] * sign
        sheet = OdometerSheet(part.speed_sd_mps, part.radius_relative_sd)
        return replace(recording, odometer=odometer, odometer_sheet=sheet)
    step = float(part.resolution_m or 0.0)
    _judge_way(frame[["distance_m"]], "odometer", recording.imu, step)
    way = frame["distance_m"].to_numpy()
    steps = np.rint(sign * (way - way[0]) / step).astype(np.int64)
    return replace(
        recording,
        encoder=pd.DataFrame({"pulse_count": steps}, index=frame.index),
        encoder_sheet=EncoderSheet(
            wheel="odometer",
            pulses_per_revolution=1,
            wheel_radius_m=step / (2.0 * np.pi),
            rate_hz=rate_of(frame.index.to_numpy()),
            radius_relative_sd=part.radius_relative_sd,
        ),
    )
