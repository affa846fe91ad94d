"""Recordings as files, and the judgement of recordings, ours or a stranger's.

A recording is a folder: Parquet for the signals (``imu``, ``odometry``, ``encoder``,
``magnetometer``), one JSON file
for what the train knows. Numbers survive the round trip bit by bit. Nothing is repaired: a recording
with a fault is refused, with the place of the fault.

Files of other loggers, in other units, are not read here.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.columns import ACCEL, EDGE_TIME, ENCODER, GYRO, IMU, MAGNETIC, ODOMETRY, ODOMETRY_SD, require
from simrail.errors import InputError
from simrail.recording import EncoderSheet, ImuSheet, MagnetometerSheet, Recording
from simrail.resample import check_stamps
from simrail.track.design import TrackDesign

FORMAT = "simrail recording 1"
MAX_RATE_RADPS, MAX_FORCE_MPS2 = 20.0, 500.0
"""No train turns or shakes harder: beyond this the unit is wrong."""

MAX_FIELD_T = 1e-2
"""Two hundred times the Earth's field: beyond this the unit is wrong."""

_PARTS = ("imu", "odometry", "encoder", "magnetometer")


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
        magnetometer at other times than the IMU's; an encoder or magnetometer without its sheet.
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
    limits = [
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


def write_recording(recording: Recording, folder: Path) -> None:
    """Write a recording into a new folder; it appears whole or not at all.

    Parameters
    ----------
    recording : Recording
        What to write.
    folder : Path
        Must not exist yet; its parents are made.

    Raises
    ------
    InputError
        If the folder exists.
    """
    if folder.exists():
        raise InputError("exists already", file=folder, remedy="remove it or choose another name")
    folder.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        for part in _PARTS:
            frame = getattr(recording, part)
            if frame is not None:
                frame.to_parquet(unfinished / f"{part}.parquet")
        sheet, magnetic = recording.encoder_sheet, recording.magnetometer_sheet
        plain = {
            "format": FORMAT,
            "name": recording.name,
            "imu_sheet": asdict(recording.imu_sheet),
            "mount": recording.mount,
            "mount_body": recording.mount_body,
            "mount_position_m": list(recording.mount_position_m),
            "track": recording.track.to_dict(),
            "encoder_sheet": None if sheet is None else asdict(sheet),
            "magnetometer_sheet": None if magnetic is None else asdict(magnetic),
            "start_position_m": recording.start_position_m,
            "odometry_source": recording.odometry_source,
            "gravity_mps2": recording.gravity_mps2,
        }
        text = json.dumps(plain, indent=1, ensure_ascii=False)
        (unfinished / "recording.json").write_text(text, encoding="utf-8")
        unfinished.chmod(0o755)
        unfinished.rename(folder)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise


def read_recording(folder: Path) -> Recording:
    """Read what `write_recording` wrote, and judge it.

    Raises
    ------
    InputError
        If a file is missing or unreadable, or the recording does not pass `check_recording`.
    """
    path = folder / "recording.json"
    plain = _read_json(path)
    imu, odometry = _read_frame(folder / "imu.parquet"), _read_frame(folder / "odometry.parquet")
    try:
        sheet, magnetic = plain["encoder_sheet"], plain.get("magnetometer_sheet")
        x, y, z = (float(value) for value in plain["mount_position_m"])
        recording = Recording(
            name=plain["name"],
            imu=imu,
            imu_sheet=ImuSheet(**plain["imu_sheet"]),
            mount=plain["mount"],
            mount_body=plain["mount_body"],
            mount_position_m=(x, y, z),
            track=TrackDesign.from_dict(plain["track"]),
            encoder=None if sheet is None else _read_frame(folder / "encoder.parquet"),
            encoder_sheet=None if sheet is None else EncoderSheet(**sheet),
            start_position_m=float(plain["start_position_m"]),
            odometry=odometry,
            odometry_source=plain["odometry_source"],
            gravity_mps2=float(plain["gravity_mps2"]),
            magnetometer=None if magnetic is None else _read_frame(folder / "magnetometer.parquet"),
            magnetometer_sheet=None if magnetic is None else MagnetometerSheet(**magnetic),
        )
    except KeyError as error:
        raise InputError("is required", file=path, field=str(error.args[0]), remedy="add it") from None
    except InputError as error:
        error.file = path if error.file is None else error.file
        raise
    except (TypeError, ValueError) as error:
        raise InputError(
            f"cannot be understood ({error})", file=path, remedy="write the recording again"
        ) from None
    check_recording(recording, file=folder)
    return recording


def _read_json(path: Path) -> dict[str, Any]:
    try:
        plain = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})", file=path, remedy="give the folder of a recording"
        ) from None
    except ValueError as error:
        raise InputError(
            f"is not valid JSON: {error}", file=path, remedy="write the recording again"
        ) from None
    if not isinstance(plain, dict) or plain.get("format") != FORMAT:
        found = plain.get("format") if isinstance(plain, dict) else None
        raise InputError(
            "is not a recording of this version", file=path, field="format", value=found, limit=FORMAT
        )
    return plain


def _read_frame(path: Path) -> pd.DataFrame:
    if not path.exists():
        raise InputError("is missing", file=path, remedy="write the recording again, whole")
    try:
        return pd.read_parquet(path)
    except (OSError, ValueError) as error:
        raise InputError(f"is not readable Parquet ({error})", file=path, remedy="write it again") from None


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
