"""Is this the device of that sheet? A whole signal held against the sheet: its range.

Single samples that are no measurements were refused before (`simrail.recording.check_samples`); its noise is
judged by `simrail.recording.check_noise`.
"""

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.recording.check_samples import SLACK, imu_bounds
from simrail.recording.recording import Recording, imus

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
