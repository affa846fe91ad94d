"""A recording as files: a ride file, its track, and one data file per signal, in simrail's own columns.

What `simrail.recording.files.ride_reader` reads: the same form as a ride of a real train, without any map of
columns or units. Numbers survive the round trip bit by bit, in CSV as in Parquet; in MCAP, where all signals
share a file, time stamps are whole nanoseconds.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from simrail.core.atomic_files import draft_of
from simrail.core.errors import InputError
from simrail.core.toml_files import toml_text
from simrail.recording.files.frame_file import write_frame
from simrail.recording.files.mcap_file import Topic, mcap_table, write_mcap
from simrail.recording.files.ned import Frame, in_ned, ned_table
from simrail.recording.files.ride_reader import RIDE_FILE
from simrail.recording.recording import Recording
from simrail.recording.sheets.vehicle_sheet_file import vehicle_sheet_table
from simrail.recording.signals import SIGNALS
from simrail.track.file import track_text
from simrail.track.map_file import map_table

RideFormat = Literal["csv", "parquet", "mcap"]
"""Form of the signals of a recording."""

TRACK_FILE = "track.toml"
MCAP_FILE = "ride.mcap"

OF_A_MOUNT = ("imu", "second_imu", "magnetometer", "rail_displacement")
"""Signals whose axes are those of a mount."""


def write_ride(
    recording: Recording, folder: Path, *, format: RideFormat = "csv", axes: Frame = "flu"
) -> None:
    """Write a recording into a new folder; it appears whole or not at all.

    Parameters
    ----------
    recording : Recording
        What to write.
    folder : Path
        Must not exist yet; its parents are made.
    format : str
        ``"csv"``, ``"parquet"`` or ``"mcap"``: the form of the signals.
    axes : {"flu", "ned"}
        Axes of the signals: simrail's own, or forward, right, down, named in the columns.

    Raises
    ------
    InputError
        If the folder exists, or a frame has a column that rides do not have, or the libraries that write
        MCAP are not installed.
    """
    refuse_existing(folder)
    with draft_of(folder) as draft:
        write_parts(recording, draft, format=format, axes=axes)


def refuse_existing(folder: Path) -> None:
    """Refuse to write where there is something already."""
    if folder.exists():
        raise InputError(
            "exists already", file=folder, remedy="remove it or choose another name", limit="a new name"
        )


def write_parts(recording: Recording, folder: Path, *, format: RideFormat, axes: Frame = "flu") -> None:
    """Write the files of a recording into a folder that is there, in simrail's axes or in FRD."""
    tables = _write_signals(recording, folder, format=format, axes=axes)
    second = recording.second_imu_sheet
    if second is not None:
        tables["second_imu"] |= {
            "name": second.mount,
            "body": second.mount_body,
            "position_m": second.mount_position_m,
            "spacing_m": second.spacing_m,
            "spacing_sd_m": second.spacing_sd_m,
            "clock_offset_sd_s": second.clock_offset_sd_s,
            "sheet": asdict(second.imu),
        }
    tables["imu"] |= {
        "name": recording.mount,
        "body": recording.mount_body,
        "position_m": recording.mount_position_m,
        "sheet": asdict(recording.imu_sheet),
    }
    if "odometry" in tables:
        tables["odometry"] |= {"source": recording.odometry_source}
    if recording.odometer_sheet is not None:
        tables["odometer"].setdefault("columns", {"speed": "speed_mps"})
        tables["odometer"] |= asdict(recording.odometer_sheet)
    for table, sheet in (
        ("encoder", recording.encoder_sheet),
        ("magnetometer", recording.magnetometer_sheet),
        ("rail_displacement", recording.rail_sensor_sheet),
        ("gnss", recording.gnss_sheet),
    ):
        if sheet is not None:
            tables[table] |= {"sheet": asdict(sheet)}
    head: dict[str, Any] = {
        "name": recording.name,
        "track": f"./{TRACK_FILE}",
        "start_position_m": recording.start_position_m,
        "start_speed_mps": recording.start_speed_mps,
        "gravity_mps2": recording.gravity_mps2,
        "map": map_table(recording.map_errors),
    }
    if not recording.track.is_map:
        del head["track"], head["map"]
    if recording.vehicle_sheet is not None:
        head["vehicle_sheet"] = vehicle_sheet_table(recording.vehicle_sheet)
    if recording.track.is_map:
        (folder / TRACK_FILE).write_text(track_text(recording.track), encoding="utf-8")
    (folder / RIDE_FILE).write_text(toml_text({**head, **tables}), encoding="utf-8")


def _write_signals(
    recording: Recording, folder: Path, *, format: RideFormat, axes: Frame
) -> dict[str, dict[str, Any]]:
    """Write the signals; what the ride file says of each of them."""
    tables: dict[str, dict[str, Any]] = {}
    topics = []
    for signal in SIGNALS:
        frame: pd.DataFrame | None = getattr(recording, signal.name)
        if frame is None:
            continue
        unknown = [str(name) for name in frame.columns if name not in signal.columns]
        if unknown:
            raise InputError(
                "has columns that a ride does not have",
                field=signal.name,
                value=unknown,
                limit="some of " + ", ".join(signal.columns),
                remedy="drop them",
            )
        if format == "mcap":
            second = recording.second_imu_sheet if signal.name == "second_imu" else None
            mount = recording.mount if second is None else second.mount
            topics.append(Topic(signal.name, frame, mount if signal.name in OF_A_MOUNT else ""))
            tables[signal.name] = {"file": MCAP_FILE, **mcap_table(signal, [*frame.columns], axes=axes)}
            continue
        file = f"{signal.name}.{format}"
        about = f"{signal.name} of the recording {recording.name!r}"
        turned = frame if axes == "flu" else in_ned(frame)
        write_frame(turned, folder / file, format=format, about=about, axes=axes)
        tables[signal.name] = {"file": file}
        if axes == "ned":
            tables[signal.name] |= ned_table(signal, [*frame.columns])
    if topics:
        write_mcap(folder / MCAP_FILE, topics, axes=axes)
    return tables
