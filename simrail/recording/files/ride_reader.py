"""From a ride file and its data files to a `Recording`: one way for rides of real trains and for our own.

Signals come in SI and in the body's axes (`simrail.recording.files.signal_reader`); an IMU with irregular
time stamps is resampled (`simrail.core.resample`), with its gaps on record. What is at its best already (SI,
the body's own axes, uniform times) passes bit by bit. Nothing else is repaired: what has a fault is refused
by name.

Not here: an odometry, where the file has none, and whether the ride can be true, which are the matter of
`simrail.estimation.recorded_ride.read_ride`.
"""

import math
from dataclasses import replace
from functools import partial
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
from simrail.recording.check_sheet import check_counts, field_bounds, imu_bounds
from simrail.recording.files.data_file import line_of
from simrail.recording.files.ride_file import ImuSignalPart, RideFile, SecondImuSignalPart
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import EncoderSheet, ImuSheet, OdometerSheet, Recording, SecondImuSheet
from simrail.recording.sheets.grades import imu_sheet
from simrail.recording.sheets.imu_file import load_grade
from simrail.track.design import NO_MAP
from simrail.track.file import TrackFile

RIDE_FILE = "ride.toml"
"""Name of the ride file in a folder that simrail wrote."""

SPACING_SDS = 6.0
"""Standard deviations by which a stated spacing of two IMUs may differ from the drawing's."""

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
    track = NO_MAP
    if spec.track is not None:
        with blame(None, "track"):
            track = load(TrackFile, "track", spec.track, folder=folder).design(Path(spec.track).stem)
    reader = SignalReader(folder)
    sheet = _sheet(spec.imu, folder)
    signals = reader.frame(spec.imu, "imu", imu_bounds(sheet))
    imu, rate_hz, gaps = _uniform(signals, spec.imu, spec.longest_gap_s, "imu")
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
            bounds = field_bounds(part.sheet) if name == "magnetometer" else None
            others[name] = _at(reader.frame(part, name, bounds), imu.index.to_numpy(), longest_gap_s, name)
            if name in SHEETS:
                others[SHEETS[name][0]] = part.sheet
    recording = Recording(
        name=spec.name,
        imu=imu,
        imu_sheet=replace(sheet, rate_hz=rate_hz),
        mount=spec.imu.name,
        mount_body=spec.imu.body,
        mount_position_m=spec.imu.position_m,
        track=track,
        map_errors=spec.map.errors(),
        vehicle_sheet=None if spec.vehicle_sheet is None else spec.vehicle_sheet.sheet(spec.imu.body),
        encoder=None,
        encoder_sheet=None,
        start_position_m=spec.start_position_m or 0.0,
        odometry_source="" if spec.odometry is None else spec.odometry.source,
        gravity_mps2=spec.gravity_mps2,
        gaps=gaps,
        **others,
    )
    if spec.second_imu is not None:
        recording = _with_second_imu(recording, spec.second_imu, spec, reader, folder)
    if spec.gnss is not None:
        received = reader.frame(spec.gnss, "gnss")
        recording = replace(recording, gnss=received, gnss_sheet=spec.gnss.sheet)
    return _with_way(recording, spec, reader)


def _with_second_imu(
    recording: Recording, part: SecondImuSignalPart, spec: RideFile, reader: SignalReader, folder: Path
) -> Recording:
    """Add the second IMU, at uniform times of its own; its gaps are bridged like the first one's."""
    own = _sheet(part, folder, "second_imu")
    signals = reader.frame(part, "second_imu", imu_bounds(own))
    imu, rate_hz, _ = _uniform(signals, part, spec.longest_gap_s, "second_imu")
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


def _at(frame: pd.DataFrame, times: FloatArray, longest_gap_s: float, what: str) -> pd.DataFrame:
    """A signal at the IMU's times: as it is if it has them, else interpolated."""
    if np.array_equal(frame.index.to_numpy(), times):
        return frame
    return resample(frame, times, longest_gap_s=longest_gap_s, what=what)[0]


def _uniform(
    imu: pd.DataFrame, part: ImuSignalPart, longest_gap_s: float, table: str
) -> tuple[pd.DataFrame, float, pd.DataFrame | None]:
    """IMU at uniform times, its rate, and the gaps that were bridged (None if there were none)."""
    time = imu.index.to_numpy()
    measured = rate_of(time)
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
    grid = uniform_times(float(time[0]), float(time[-1]), rate)
    sampled, gaps = resample(imu, grid, longest_gap_s=longest_gap_s)
    return sampled, rate, gaps if len(gaps) else None


def _sheet(part: ImuSignalPart, folder: Path, table: str = "imu") -> ImuSheet:
    if part.sheet is not None:
        return part.sheet
    if part.datasheet is not None:
        grade = part.datasheet.grade("datasheet")
    else:
        with blame(None, f"{table}.grade"):
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
        check_counts(
            counts["pulse_count"],
            spec.encoder.known,
            where=partial(line_of, spec.encoder),
            file=label(reader.folder / spec.encoder.file),
        )
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
