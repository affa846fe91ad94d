"""The gyro and the accelerometer of an IMU, each beside what its sheet says, and when they are at rest."""

from typing import NamedTuple

import numpy as np

from simrail.core.columns import ACCEL, GYRO
from simrail.core.jit import FloatArray
from simrail.recording.check_samples import imu_bounds
from simrail.recording.recording import ImuSheet, Recording
from simrail.recording.standstill import rest_periods

_TRIADS = (
    ("gyro", GYRO, "rad/s", "gyro_resolution_radps"),
    ("accel", ACCEL, "m/s2", "accel_resolution_mps2"),
)

REST_SAMPLES = 40
"""Of a rest that noise is taken from: its standard deviation is known to some 15 % by so many."""


class Triad(NamedTuple):
    """Three axes beside their sheet.

    Attributes
    ----------
    field, kind, unit : str
        What a message blames, ``"gyro"`` or ``"accel"``, and the unit of SI.
    columns : tuple of str
        Of the IMU's frame.
    values : ndarray (n, 3)
        Samples, rad/s or m/s2.
    steps : ndarray (3,)
        Least step between two numbers of each axis; infinity where all are one.
    noise, least : float
        Of one sample, and one count of the device, by the sheet.
    sheet : ImuSheet
        The sheet.
    """

    field: str
    kind: str
    unit: str
    columns: tuple[str, ...]
    values: FloatArray
    steps: FloatArray
    noise: float
    least: float
    sheet: ImuSheet

    def beside(self, found: float) -> str:
        """A noise, beside that of the sheet, in words."""
        return (
            f"is {found / self.noise:.3g} times that of {self.sheet.grade} ({self.noise:.2g} {self.unit} at "
            f"{self.sheet.rate_hz:g} Hz)"
        )


def triads_of(recording: Recording, table: str) -> list[Triad]:
    """The triads of a recording's IMU whose sheet has noise; `table` is where a ride file has it."""
    sheet, found = recording.imu_sheet, []
    for kind, columns, unit, resolution in _TRIADS:
        noise = float(imu_bounds(sheet)[kind].noise * np.sqrt(sheet.rate_hz))
        values = recording.imu[list(columns)].to_numpy()
        if noise > 0.0 and len(values) > 2:
            steps = np.array([_step(values[:, axis], 1e-9 * noise) for axis in range(3)])
            count = getattr(sheet, resolution)
            found.append(Triad(f"{table}.{kind}", kind, unit, columns, values, steps, noise, count, sheet))
    return found


def _step(values: FloatArray, least: float) -> float:
    """Step of the numbers of an axis: the least between two of them; infinity where all are one."""
    apart = np.diff(np.sort(values))
    return float(apart[apart > least].min(initial=np.inf))


def rests_of(recording: Recording) -> list[slice]:
    """The samples of each rest that is long enough."""
    times, rests = recording.imu.index.to_numpy(), rest_periods(recording)
    found = [
        slice(*np.searchsorted(times, (start, end)))
        for start, end in zip(rests["start_s"], rests["end_s"], strict=True)
    ]
    return [rest for rest in found if rest.stop - rest.start >= REST_SAMPLES]


def sample_noise(values: FloatArray) -> float:
    """Noise of a sample of the worst axis of (n, 3), by second differences: no bias shows in them."""
    return float(np.diff(values, n=2, axis=0).std(axis=0).max()) / float(np.sqrt(6.0))
