"""A second IMU elsewhere on the train: what it records of the same ride, by a clock of its own.

It samples as any IMU does (`simrail.sensors.imu`), and what it samples is stamped by a clock that is ahead of
the first one's, or behind it, by a constant; a drift of that clock is an error of its grade.
"""

from dataclasses import dataclass

import pandas as pd

from simrail.core.seeds import stream
from simrail.recording.recording import SecondImuSheet
from simrail.recording.sheets.grades import ImuGrade, imu_sheet
from simrail.ride.truth import Mount, Truth
from simrail.sensors.imu import EarthRate, log_imu
from simrail.sensors.imu_response import Temperature


@dataclass(frozen=True)
class SecondImuSpec:
    """A second IMU.

    Attributes
    ----------
    mount : Mount
        Where it sits. Its name, which is another than the first one's, names its random streams.
    grade : ImuGrade
        The device, of the first one's rate.
    clock_offset_sd_s : float
        Standard deviation of how far its clock is ahead of the first one's: a draw of the sensors is a draw
        of that.
    clock_offset_s : float, optional
        How far it is ahead, in the place of that draw.
    spacing_sd_m : float
        How well the train knows the distance of both: what it is told errs by a draw of that.
    """

    mount: Mount
    grade: ImuGrade
    clock_offset_sd_s: float = SecondImuSheet.clock_offset_sd_s
    clock_offset_s: float | None = None
    spacing_sd_m: float = SecondImuSheet.spacing_sd_m


def sample_second_imu(
    truth: Truth,
    first: Mount,
    spec: SecondImuSpec,
    *,
    seed: int,
    draw: int,
    earth_rate: EarthRate | None = None,
    temperature: Temperature | None = None,
) -> tuple[pd.DataFrame, SecondImuSheet]:
    """Record a ride by a second IMU.

    Parameters
    ----------
    truth : Truth
        What happened.
    first : Mount
        Where the first IMU sits.
    spec : SecondImuSpec
        The second one.
    seed, draw, earth_rate, temperature
        As of `simrail.sensors.measure.measure`.

    Returns
    -------
    imu : pandas.DataFrame
        Indexed by ``time_s`` of its own clock, columns `simrail.core.columns.IMU`; samples that got lost are
        filled by straight lines.
    sheet : SecondImuSheet
        What the train knows of it: the spacing is measured along the rails while the train stands at its
        start, as well as a tape does.

    Raises
    ------
    InputError
        If its body is unknown, or its rate does not divide the truth's.
    """
    imu, delay_s = _felt(truth, spec, seed=seed, draw=draw, earth_rate=earth_rate, temperature=temperature)
    ahead, behind = (
        float(truth.motion(one, range(1), ("position_m",)).to_numpy()[0, 0]) for one in (first, spec.mount)
    )
    by_tape = stream(seed, "sensor", draw, "imu", spec.mount.name, "spacing").standard_normal()
    sheet = SecondImuSheet(
        mount=spec.mount.name,
        mount_body=spec.mount.body,
        mount_position_m=spec.mount.position_m,
        spacing_m=ahead - behind + spec.spacing_sd_m * by_tape,
        imu=imu_sheet(spec.grade, delay_s=delay_s),
        spacing_sd_m=spec.spacing_sd_m,
        clock_offset_sd_s=spec.clock_offset_sd_s,
    )
    return imu, sheet


def _felt(
    truth: Truth,
    spec: SecondImuSpec,
    *,
    seed: int,
    draw: int,
    earth_rate: EarthRate | None,
    temperature: Temperature | None,
) -> tuple[pd.DataFrame, float]:
    """What it recorded, by its own clock, and by how much that is late."""
    mount, grade = spec.mount, spec.grade
    imu, _, delay_s = log_imu(
        truth, mount, grade, seed=seed, draw=draw, earth=earth_rate, temperature=temperature
    )
    offset_s = spec.clock_offset_s
    if offset_s is None:
        drawn = stream(seed, "sensor", draw, "imu", mount.name, "clock_offset").standard_normal()
        offset_s = spec.clock_offset_sd_s * drawn
    imu.index = pd.Index(imu.index.to_numpy() + offset_s, name="time_s")
    return imu, delay_s
