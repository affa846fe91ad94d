"""IMU files: the figures of a data sheet, in its own units, as TOML.

A figure that the sheet does not state is left out and is then zero (errors), infinite (ranges) or the
stated default; `assumed` says in words what was assumed.
"""

from __future__ import annotations

import math
from pathlib import Path

from pydantic import Field

from simrail.scenario.files import Part, load
from simrail.sensors.grades import ImuGrade


class ImuFile(Part):
    """One IMU. The unit is in each name: deg/s/sqrt(Hz), ug/sqrt(Hz), deg/h, mg, deg/s, g, Hz, s."""

    title: str
    source: str
    assumed: str = ""
    rate_hz: float = Field(gt=0)
    bandwidth_hz: float | None = Field(default=None, gt=0)
    gyro_noise_degpsqrthz: float = Field(default=0.0, ge=0)
    gyro_bias_instability_degph: float = Field(default=0.0, ge=0)
    gyro_bias_correlation_s: float = Field(default=300.0, gt=0)
    gyro_turn_on_bias_degps: float = Field(default=0.0, ge=0)
    gyro_range_degps: float | None = Field(default=None, gt=0)
    gyro_resolution_degps: float = Field(default=0.0, ge=0)
    accel_noise_ugpsqrthz: float = Field(default=0.0, ge=0)
    accel_bias_instability_mg: float = Field(default=0.0, ge=0)
    accel_bias_correlation_s: float = Field(default=300.0, gt=0)
    accel_turn_on_bias_mg: float = Field(default=0.0, ge=0)
    accel_range_g: float | None = Field(default=None, gt=0)
    accel_resolution_mg: float = Field(default=0.0, ge=0)

    def grade(self, name: str) -> ImuGrade:
        """The grade in SI units; `name` is the stem of the file."""
        figures = self.model_dump(exclude={"title", "assumed", "gyro_range_degps", "accel_range_g"})
        return ImuGrade.from_datasheet(
            name,
            gyro_range_degps=math.inf if self.gyro_range_degps is None else self.gyro_range_degps,
            accel_range_g=math.inf if self.accel_range_g is None else self.accel_range_g,
            **figures,
        )


def load_grade(name: str, *, folder: Path | None = None) -> ImuGrade:
    """Grade from a shipped name or a path.

    Raises
    ------
    InputError
        If there is no such file, or it says something impossible.
    """
    file = load(ImuFile, "imu", name, folder=folder)
    return file.grade(Path(name).stem)
