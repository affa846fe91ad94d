"""From a ride file and its data files to a `Recording`: one way for rides of real trains and for our own.

Signals come in SI and in the body's axes (`simrail.recording.files.signal_reader`), IMUs at uniform times
(`simrail.recording.files.imu_reader`), the way beside them (`simrail.recording.files.way_reader`). What is at
its best already (SI, the body's own axes, uniform times) passes bit by bit. Nothing else is repaired: what
has a fault is refused by name.

Not here: an odometry, where the file has none, and whether the ride can be true, which are the matter of
`simrail.estimation.recorded_ride.read_ride`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.jit import FloatArray
from simrail.core.resample import SLOW_INTERVALS, rate_of, resample
from simrail.core.toml_files import blame, judge, label, load, read_toml
from simrail.recording.check_form import SHEETS, check_recording
from simrail.recording.check_samples import field_bounds
from simrail.recording.files.asked import RideReference
from simrail.recording.files.common_time import begun_later, common_time
from simrail.recording.files.imu_reader import read_imu, sheet_at, with_second_imu
from simrail.recording.files.reference_reader import read_reference
from simrail.recording.files.ride_file import RideFile
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.files.way_reader import WAY_GAP_S, with_way
from simrail.recording.recording import Recording
from simrail.track.design import NO_MAP
from simrail.track.file import TrackFile

RIDE_FILE = "ride.toml"
"""Name of the ride file in a folder that simrail wrote."""

ASIDE = ("magnetometer", "rail_displacement", "odometry")
"""Signals that are given at the IMU's times."""


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
    return read_whole(path)[0]


def read_whole(path: Path) -> tuple[Recording, RideFile, RideReference | None]:
    """As `read_signals`, with what the ride file says and what the ride is to be compared with.

    Returns
    -------
    recording : Recording
        What a method may see.
    spec : RideFile
        The ride file.
    reference : RideReference or None
        What none may see.
    """
    path = ride_file(path)
    spec = judge(RideFile, read_toml(path), file=label(path))
    with blame(label(path)):
        reader = SignalReader(path.parent)
        recording = _recording(spec, reader)
        check_recording(recording)
        reference = read_reference(spec, reader, recording.imu)
    return replace(recording, notes=tuple(reader.notes)), spec, reference


def ride_file(path: Path) -> Path:
    """The ride file that a path means."""
    return path / RIDE_FILE if path.is_dir() else path


def _recording(spec: RideFile, reader: SignalReader) -> Recording:
    track, folder = NO_MAP, reader.folder
    if spec.track is not None:
        with blame(None, "track"):
            track = load(TrackFile, "track", spec.track, folder=folder).design(Path(spec.track).stem)
    imu, rate_hz, gaps = read_imu(spec, reader)
    if spec.gaps is not None:
        noted = reader.frame(spec.gaps, "gaps")
        gaps = noted if gaps is None else pd.concat([noted, gaps], ignore_index=True)
    signals = _aside(spec, reader)
    began_s = float(imu.index[0])
    imu = common_time(imu, signals, reader.notes)
    others: dict[str, Any] = {}
    for name, frame in signals.items():
        others[name] = _at(frame, imu.index.to_numpy(), _longest_gap(spec, name), name, reader)
        if name in SHEETS:
            others[SHEETS[name][0]] = getattr(spec, name).sheet
    recording = Recording(
        name=spec.name,
        imu=imu,
        imu_sheet=sheet_at(spec.imu, folder, rate_hz, reader.notes),
        mount=spec.imu.name,
        mount_body=spec.imu.body,
        mount_position_m=spec.imu.position_m,
        track=track,
        map_errors=spec.map.errors(),
        vehicle_sheet=None if spec.vehicle_sheet is None else spec.vehicle_sheet.sheet(spec.imu.body),
        encoder=None,
        encoder_sheet=None,
        start_position_m=spec.start_position_m or 0.0,
        start_speed_mps=spec.start_speed_mps,
        odometry_source="" if spec.odometry is None else spec.odometry.source,
        gravity_mps2=spec.gravity_mps2,
        gaps=gaps,
        **others,
    )
    if spec.second_imu is not None:
        recording = with_second_imu(recording, spec.second_imu, spec, reader)
    if spec.gnss is not None:
        received = reader.frame(spec.gnss, "gnss")
        recording = replace(recording, gnss=received, gnss_sheet=spec.gnss.sheet)
    way = "encoder" if spec.encoder is not None else "odometer"
    if getattr(spec, way) is not None:
        recording = with_way(recording, spec, longest_gap_s=_longest_gap(spec, way), reader=reader)
    return begun_later(recording, began_s, reader.notes)


def _aside(spec: RideFile, reader: SignalReader) -> dict[str, pd.DataFrame]:
    """Frames of the signals of `ASIDE` that there are, at times of their own."""
    frames = {}
    for name in ASIDE:
        part = getattr(spec, name)
        if part is not None:
            bounds = field_bounds(part.sheet) if name == "magnetometer" else None
            frames[name] = reader.frame(part, name, bounds)
    return frames


def _longest_gap(spec: RideFile, name: str) -> float:
    """Longest gap of a signal that is bridged, as the ride file has it; for a way at least `WAY_GAP_S`."""
    own = getattr(spec, name).longest_gap_s
    if own is not None:
        return float(own)
    return (
        max(spec.longest_gap_s, WAY_GAP_S)
        if name in ("odometry", "encoder", "odometer")
        else spec.longest_gap_s
    )


def _at(
    frame: pd.DataFrame, times: FloatArray, longest_gap_s: float, what: str, reader: SignalReader
) -> pd.DataFrame:
    """A signal at the IMU's times: as it is if it has them, else interpolated."""
    stamps = frame.index.to_numpy()
    if np.array_equal(stamps, times):
        return frame
    interval = 1.0 / rate_of(stamps)
    longest = max(longest_gap_s, SLOW_INTERVALS * interval)
    found, gaps = resample(frame, times, longest_gap_s=longest, what=what, interval_s=interval)
    lost = f", over {len(gaps)} gaps of {gaps['missing'].sum():.0f} samples" if len(gaps) else ""
    reader.notes.append(
        f"{what}: {len(stamps)} samples at {1.0 / interval:.4g} Hz are interpolated at the IMU's times{lost}"
    )
    return found
