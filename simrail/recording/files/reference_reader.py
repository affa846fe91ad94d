"""From the tables ``[reference]`` and ``[rail_reference]`` of a ride file to a `RideReference`."""

from pathlib import Path

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.toml_files import label
from simrail.recording.files.asked import RailReferencePart, ReferencePart, RideReference
from simrail.recording.files.data_file import open_data
from simrail.recording.files.ride_file import RideFile
from simrail.recording.files.signal_reader import SignalReader
from simrail.track.bands import SAMPLES_PER_WAVE


def read_reference(spec: RideFile, reader: SignalReader, imu: pd.DataFrame) -> RideReference | None:
    """Read what a ride is compared with, after its signals: dates are counted from the first of those.

    Parameters
    ----------
    spec : RideFile
        The ride file.
    reader : SignalReader
        That of the ride.
    imu : pandas.DataFrame
        The recording's IMU, indexed by ``time_s``.

    Returns
    -------
    RideReference or None
        None if the file names no reference.

    Raises
    ------
    InputError
        If it cannot be read, holds nothing, or lies beside the ride.
    """
    if spec.reference is None and spec.rail_reference is None:
        return None
    motion = rails = None
    if spec.reference is not None:
        motion = _motion(spec.reference, reader, imu)
    if spec.rail_reference is not None:
        rails = _rails(spec.rail_reference, reader)
    return RideReference(
        motion,
        rails,
        {} if spec.reference is None else spec.reference.sds(),
        {} if spec.rail_reference is None else spec.rail_reference.sds(),
        "" if spec.reference is None else spec.reference.source,
        "" if spec.rail_reference is None else spec.rail_reference.source,
        None if spec.rail_reference is None else spec.rail_reference.band,
    )


def _motion(part: ReferencePart, reader: SignalReader, imu: pd.DataFrame) -> pd.DataFrame:
    _refuse_empty(part, "reference", reader.folder)
    frame = reader.frame(part, "reference")
    within: pd.DataFrame = frame[(frame.index >= imu.index[0]) & (frame.index <= imu.index[-1])]
    if not len(within):
        raise InputError(
            "has no sample while the IMU recorded",
            field="reference.time_s",
            value=f"{frame.index[0]:.9g} to {frame.index[-1]:.9g} s",
            limit=f"{imu.index[0]:.9g} to {imu.index[-1]:.9g} s",
            remedy="give both on one clock, or set reference.time_offset_s",
        )
    return within


def _rails(part: RailReferencePart, reader: SignalReader) -> pd.DataFrame:
    _refuse_empty(part, "rail_reference", reader.folder)
    read = reader.frame(part, "rail_reference").sort_values("position_m")
    frame: pd.DataFrame = read.set_index("position_m")
    step = np.diff(frame.index.to_numpy())
    if len(step) == 0 or not (step > 0.0).all():
        place = float(frame.index[int(np.argmin(step))]) if len(step) else float(frame.index[0])
        raise InputError(
            "has a place twice",
            file=label(reader.folder / part.file),
            field="rail_reference.position",
            value=place,
            limit="a row for each place, two places at least",
            remedy="leave one of them out",
        )
    if np.median(step) * SAMPLES_PER_WAVE > 1.0:
        reader.notes.append(
            f"rail_reference: a place every {np.median(step):.3g} m; waves shorter than "
            f"{SAMPLES_PER_WAVE * np.median(step):.3g} m are not in it"
        )
    return frame


def _refuse_empty(part: ReferencePart | RailReferencePart, table: str, folder: Path) -> None:
    """Refuse a reference whose file has no column of any quantity that can be compared with."""
    quantities = {q.key: q.columns[0] for q in part.signal.quantities if not q.required}
    names = open_data(part, folder, table=table).names
    if not any(key in part.columns or column in names for key, column in quantities.items()):
        key = next(iter(quantities))
        raise InputError(
            "has nothing to compare with",
            file=label(folder / part.file),
            field=f"{table}.columns",
            value=list(part.columns) or None,
            limit="a column for one of " + ", ".join(quantities),
            remedy=f'name it, e.g. columns = {{ {key} = "its name in the file" }}',
        )
