"""A recording at rest, to fit the figures of its device to: a CSV, or a ride file of which the IMU counts.

The device need not be known, nor a track: of ``[imu]`` the file, its columns, units and axes are read. A file
with gaps is refused: an Allan deviation takes samples as evenly spaced.
"""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.resample import GAP_INTERVALS, find_gaps, rate_of
from simrail.core.toml_files import blame, judge, label, read_toml
from simrail.recording.files.data_file import TABLES, TEXTS
from simrail.recording.files.ride_file import EncoderSignalPart
from simrail.recording.files.ride_reader import ride_file
from simrail.recording.files.signal_part import VectorPart
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.signals import IMU_SIGNAL, Signal


class RestPart(VectorPart):
    """``[imu]`` of a rest: which columns of a file are the device's."""

    signal: ClassVar[Signal] = IMU_SIGNAL


_OF_RIDES = ("name", "body", "position_m", "delay_s", "grade", "datasheet", "sheet")
"""Keys of ``[imu]`` that a ride needs and a rest does not."""


def read_rest(path: Path) -> tuple[pd.DataFrame, float]:
    """Read the IMU of a recording at rest.

    Parameters
    ----------
    path : Path
        A TOML file with a table ``[imu]`` as ride files have it (or a folder with a ``ride.toml``), or a data
        file in simrail's own columns.

    Returns
    -------
    imu : pandas.DataFrame
        Indexed by ``time_s``, evenly; columns `simrail.core.columns.IMU`, SI.
    rate_hz : float
        Rate of its samples.

    Raises
    ------
    InputError
        If a file is missing or bad, samples are missing, or an encoder beside it turns.
    """
    path = ride_file(path)
    reader = SignalReader(path.parent)
    said: dict[str, Any] = {"imu": {"file": path.name}}
    if path.suffix.lower() not in (*TEXTS, *TABLES):
        said = read_toml(path)
    with blame(label(path)):
        if not isinstance(said.get("imu"), dict):
            raise InputError(
                "is required",
                field="imu",
                limit="a table with file, columns and units",
                remedy="as a ride file has it: 'simrail new ride NAME' writes one",
            )
        table = {key: value for key, value in said["imu"].items() if key not in _OF_RIDES}
    with blame(label(path), "imu"):
        part = judge(RestPart, table, file=None)
    with blame(label(path)):
        imu = reader.frame(part, "imu")
        _check_wheel(said, reader, path)
        return _even(imu, part)


def _check_wheel(said: dict[str, Any], reader: SignalReader, path: Path) -> None:
    if "encoder" not in said:
        return
    counts = reader.frame(judge(EncoderSignalPart, said["encoder"], file=label(path)), "encoder")
    turned = counts["pulse_count"] - counts["pulse_count"].iloc[0]
    # On an edge on which the wheel stands, one count goes to and fro.
    moved = np.flatnonzero(turned.abs().to_numpy() > 1)
    if len(moved):
        raise InputError(
            f"is not at rest: the wheel turns from time_s = {float(counts.index[moved[0]]):.6g}",
            field="encoder.pulse_count",
            value=f"{int(turned.abs().max())} counts",
            limit="1 count",
            remedy="cut the recording to where the train stands",
        )


def _even(imu: pd.DataFrame, part: RestPart) -> tuple[pd.DataFrame, float]:
    """Samples as they are, at even times; their stamps may jitter, but none may be missing."""
    time = imu.index.to_numpy(dtype=np.float64)
    measured = rate_of(time)
    gaps = find_gaps(time, 1.0 / measured, gap_intervals=2.0 * GAP_INTERVALS)
    if len(gaps):
        longest = gaps.iloc[int(np.argmax(gaps["missing"].to_numpy()))]
        raise InputError(
            f"lacks samples in {len(gaps)} places, and an Allan deviation needs all of them",
            field="imu.time_s",
            value=f"{longest['end_s'] - longest['start_s']:.6g} s after time_s = {longest['start_s']:.9g}",
            limit=f"{1.0 / measured:.6g} s",
            remedy="cut the recording to its longest part without gaps",
        )
    mean = (len(time) - 1) / float(time[-1] - time[0])
    rate = part.rate_hz if part.rate_hz and abs(mean / part.rate_hz - 1.0) < 1e-3 else float(f"{mean:.5g}")
    even = pd.Index(time[0] + np.arange(len(time)) / rate, name="time_s")
    return imu.set_axis(even), rate
