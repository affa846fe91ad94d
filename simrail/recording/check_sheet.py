"""Is this the device of that sheet? A whole signal held against the sheet: its range, its noise at rest.

Single samples that are no measurements were refused before (`simrail.recording.check_samples`).
"""

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.recording.check_samples import SLACK, STUCK_COUNTS, imu_bounds
from simrail.recording.recording import Recording, imus
from simrail.recording.standstill import at_rest_initially

_TRIADS = (("gyro", GYRO, "rad/s"), ("accel", ACCEL, "m/s2"))
_TURNED = float(np.sqrt(3.0))
"""A device turned in its body may show the range of each of its axes at once along one of the body."""


def check_ranges(recording: Recording) -> None:
    """Refuse an IMU that measures beyond the range of its sheet throughout: it is the sheet of another.

    Meant for signals whose units have been judged already; of both IMUs, where there are two.

    Raises
    ------
    InputError
        With the largest value and its time.
    """
    for table, alone in imus(recording):
        _check_ranges(alone, table)


def _check_ranges(recording: Recording, table: str) -> None:
    bounds = imu_bounds(recording.imu_sheet)
    for kind, columns, unit in _TRIADS:
        limit = bounds[kind].range
        for column in columns if limit is not None else ():
            values = np.abs(recording.imu[column].to_numpy())
            worst = int(np.argmax(values))
            if limit is not None and values[worst] > SLACK * _TURNED * limit:
                raise InputError(
                    f"is beyond the range of its sheet at time_s = {float(recording.imu.index[worst]):.6g} "
                    f"({int((values > SLACK * _TURNED * limit).sum())} such samples)",
                    field=f"{table}.{column}",
                    value=float(f"{recording.imu[column].iloc[worst]:.6g}"),
                    limit=f"{limit:.6g} {unit}, the range of {bounds[kind].sheet}",
                    remedy="mend the range in its sheet: a device measures no further",
                )


LOUD, SILENT = {"gyro": 10.0, "accel": 30.0}, 0.1
"""Noise at rest over that of the sheet from which on it is told: an engine that idles shakes the
accelerometer more than the gyro; and below which samples were smoothed, or are of a better device."""

REST_SAMPLES = 100


def noise_warnings(recording: Recording) -> tuple[str, ...]:
    """Warnings, a line each, of a noise at rest that is far from what the sheet says.

    The noise of a sample is taken from second differences of the initial rest, x[k-1] - 2 x[k] + x[k+1] over
    sqrt(6): bias and its wandering do not show in them.
    """
    return tuple(line for table, alone in imus(recording) for line in _noise_warnings(alone, table))


def _noise_warnings(recording: Recording, table: str) -> tuple[str, ...]:
    resting, sheet = at_rest_initially(recording), recording.imu_sheet
    if resting < REST_SAMPLES:
        return ()
    told = []
    for kind, columns, unit in _TRIADS:
        stated = imu_bounds(sheet)[kind].noise * np.sqrt(sheet.rate_hz)
        values = recording.imu[list(columns)].to_numpy()
        steps = np.abs(np.diff(values, axis=0))
        count = float(steps[steps > 1e-9 * stated].min(initial=np.inf))
        found = float(np.diff(values[:resting], n=2, axis=0).std(axis=0).max()) / np.sqrt(6.0)
        if stated == 0.0 or stated < STUCK_COUNTS * count:
            continue
        if not SILENT < found / stated < LOUD[kind]:
            why = (
                "the device is another, or shakes while the train stands"
                if found > stated
                else "the samples were smoothed, or the device is another"
            )
            told.append(
                f"{table}.{kind}: noise of {found:.2g} {unit} a sample at rest is {found / stated:.2g} times "
                f"that of {sheet.grade} ({stated:.2g} {unit} at {sheet.rate_hz:g} Hz): {why}"
            )
    return tuple(told)
