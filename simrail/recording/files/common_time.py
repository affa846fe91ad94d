"""The time that the signals of a ride share: what all of them have is used, and that is said.

Devices are switched on one after another. A signal that begins late shortens the ride; the place where it
begins then is worked out from the way in between.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.resample import rate_of
from simrail.recording.files.signal_part import LARGEST_OFFSET_S
from simrail.recording.recording import AT_IMU_TIMES, Recording

LEAST_COMMON = 0.5
"""Share of the IMU's time that the signals beside it must have."""

ZONE_S = 900.0
"""Time zones differ by quarters of an hour."""

STILL_MPS = 0.2
"""An odometer's speed below which the train may stand."""

FIRST_READINGS = 5
"""Readings of a way that must be alike for the train to stand."""


def common_time(imu: pd.DataFrame, signals: Mapping[str, pd.DataFrame], notes: list[str]) -> pd.DataFrame:
    """The IMU within the time that all signals beside it have.

    Parameters
    ----------
    imu : pandas.DataFrame
        Indexed by ``time_s``.
    signals : mapping of str to pandas.DataFrame
        The signals that are wanted at its times.
    notes : list of str
        Is told of what is left out.

    Raises
    ------
    InputError
        If they share less than `LEAST_COMMON` of its time.
    """
    time = imu.index.to_numpy()
    first = max([time[0], *(frame.index[0] for frame in signals.values())])
    last = min([time[-1], *(frame.index[-1] for frame in signals.values())])
    within = (time >= first) & (time <= last)
    if within.all():
        return imu
    refuse_little(time, within, signals)
    late = [name for name, frame in signals.items() if frame.index[0] > time[0] or frame.index[-1] < time[-1]]
    notes.append(_shortened(time, within, late))
    cut: pd.DataFrame = imu.loc[within]
    return cut


def _zone(time: FloatArray, name: str, frame: pd.DataFrame) -> str | None:
    """A remedy for a clock of another time zone, if by quarters of an hour it would share the IMU's time."""
    offset = ZONE_S * round((time[0] - frame.index[0]) / ZONE_S)
    first, last = max(time[0], frame.index[0] + offset), min(time[-1], frame.index[-1] + offset)
    if not 0.0 < abs(offset) <= LARGEST_OFFSET_S or last - first < LEAST_COMMON * (time[-1] - time[0]):
        return None
    hours = f"{abs(offset) / 3600.0:g} h"
    return f"its clock is of another time zone, by {hours}: set {name}.time_offset_s = {offset:g}"


def refuse_little(time: FloatArray, within: np.ndarray, signals: Mapping[str, pd.DataFrame]) -> None:
    """Refuse a ride whose signals share too little time.

    Parameters
    ----------
    time : ndarray (n,)
        The IMU's.
    within : ndarray (n,) of bool
        Whether the others have it.
    signals : mapping of str to pandas.DataFrame
        The others.

    Raises
    ------
    InputError
        Naming the shortest of them.
    """
    if within.mean() >= LEAST_COMMON and within.sum() >= 3:
        return
    name, frame = min(signals.items(), key=lambda item: item[1].index[-1] - item[1].index[0])
    remedy = _zone(time, name, frame) or "mend the clocks: they share no time at all"
    if within.any():
        remedy = (
            f"cut the IMU's file to {time[within][0]:.9g} ... {time[within][-1]:.9g} s, or mend the clocks"
        )
    raise InputError(
        "has too little time in common with the IMU",
        field=f"{name}.time_s",
        value=f"{frame.index[0]:.9g} to {frame.index[-1]:.9g} s",
        limit=f"{100.0 * LEAST_COMMON:g} % of {time[0]:.9g} to {time[-1]:.9g} s",
        remedy=remedy,
    )


def spanned(
    recording: Recording, frame: pd.DataFrame, table: str, *, still: float, notes: list[str]
) -> Recording:
    """The recording within the time of its way, which may begin late if the train stands then.

    Parameters
    ----------
    recording : Recording
        Without a way.
    frame : pandas.DataFrame
        The way: counts, or speeds, in its first column.
    table : str
        Its table in the ride file.
    still : float
        What the first counts may differ by, or the first speeds be, while the train stands.
    notes : list of str
        Is told of what is left out.

    Raises
    ------
    InputError
        If they share too little time, or the way begins late and the train moves then.
    """
    time, imu = frame.index.to_numpy(), recording.imu.index.to_numpy()
    slack = max(0.5, 2.0 / rate_of(time))
    if time[0] <= imu[0] + slack and time[-1] >= imu[-1] - slack:
        return recording
    within = (imu >= time[0] - slack) & (imu <= time[-1] + slack)
    refuse_little(imu, within, {table: frame})
    values = frame.iloc[:FIRST_READINGS, 0].to_numpy(dtype=np.float64)
    moves = float(np.abs(values).max()) if "speed_mps" in frame else float(np.ptp(values))
    if time[0] > imu[0] + slack and moves > still:
        raise InputError(
            "does not span the times of the IMU, and the train moves when it begins",
            field=f"{table}.time",
            value=f"{time[0]:.6g} to {time[-1]:.6g} s",
            limit=f"{imu[0]:.6g} to {imu[-1]:.6g} s",
            remedy=f"cut the IMU's file to {time[0]:.6g} ... {time[-1]:.6g} s, with start_position_m there; "
            "or mend the clocks: both need one and the same",
        )
    notes.append(_shortened(imu, within, [table]))
    kept = {name: getattr(recording, name) for name in AT_IMU_TIMES}
    cut = {name: None if old is None else old.loc[within] for name, old in kept.items()}
    return replace(
        recording,
        imu=recording.imu.loc[within],
        odometry=cut["odometry"],
        magnetometer=cut["magnetometer"],
        rail_displacement=cut["rail_displacement"],
    )


def begun_later(recording: Recording, began_s: float, notes: list[str]) -> Recording:
    """The recording with its place at the first sample, where that is later than it was.

    Parameters
    ----------
    recording : Recording
        With its way, and its start position at `began_s`.
    began_s : float
        Time of the IMU's first sample, before any was left out.
    notes : list of str
        Is told of a start position that moved, or could not be.
    """
    begins_s = float(recording.imu.index[0])
    if begins_s <= began_s:
        return recording
    gaps = recording.gaps
    if gaps is not None:
        gaps = gaps[(gaps["end_s"] > begins_s) & (gaps["start_s"] < recording.imu.index[-1])]
        recording = replace(recording, gaps=gaps.reset_index(drop=True) if len(gaps) else None)
    way, sheet = recording.encoder, recording.encoder_sheet
    if way is not None and sheet is not None:
        before = max(int(np.searchsorted(way.index.to_numpy(), begins_s, side="right")) - 1, 0)
        pulses = int(way["pulse_count"].iloc[before] - way["pulse_count"].iloc[0])
        moved = pulses * 2.0 * np.pi * sheet.wheel_radius_m / sheet.pulses_per_revolution
        recording = replace(recording, encoder=way.iloc[before:])
    elif recording.odometer is not None:
        speed = recording.odometer
        before = max(int(np.searchsorted(speed.index.to_numpy(), begins_s, side="right")) - 1, 0)
        moved = float(np.trapezoid(speed["speed_mps"].iloc[: before + 1], speed.index[: before + 1]))
        recording = replace(recording, odometer=speed.iloc[before:])
    else:
        notes.append(f"start_position_m is taken to hold at {begins_s:.6g} s, where the ride begins now")
        return recording
    if moved == 0.0:
        return recording
    place = recording.start_position_m + float(moved)
    notes.append(f"the ride begins at {place:.2f} m, {moved:+.2f} m from start_position_m")
    return replace(recording, start_position_m=place)


def _shortened(time: FloatArray, within: np.ndarray, late: list[str]) -> str:
    used = time[within]
    return (
        f"only {used[0]:.9g} to {used[-1]:.9g} s are used, of {time[0]:.9g} to {time[-1]:.9g} s: the time "
        f"that the IMU shares with {' and '.join(late)}"
    )
