"""Slope and intercept of the spectral speed as a file: by mount, from rides whose speed was known.

    # Made by: python scenarios/calibrations/make.py
    rides = ["metro_line, seed 401"]

    [mount.floor]
    slope = 1.9
    intercept_mps = -28.0
    rms_mps = 3.1

How a vehicle shakes belongs to the place on it: a mount that the file lacks is refused, never guessed. Not
here: how they are found (`simrail.estimators.odometry.spectral.calibrate`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from pydantic import Field

from simrail.core.errors import InputError, did_you_mean
from simrail.core.toml_files import Part, judge, label, read_toml


class LinePart(Part):
    """``[mount.NAME]``: v = slope sqrt(S) + intercept, and the rms of what it left on its own rides."""

    slope: Annotated[float, Field(gt=0.0, le=1e3)]
    intercept_mps: Annotated[float, Field(ge=-1e4, le=1e4)]
    rms_mps: Annotated[float, Field(gt=0.0, le=100.0)]


class CalibrationPart(Part):
    """The file."""

    rides: tuple[str, ...]
    mount: dict[str, LinePart]


@dataclass(frozen=True)
class SpectralCalibration:
    """Lines of the spectral speed by mount, as an option of an estimator: the path of the file.

    Attributes
    ----------
    lines : mapping of str to LinePart
        By the name of the mount.
    rides : tuple of str
        The rides that they were found on, in words.
    """

    lines: Mapping[str, LinePart] = field(default_factory=dict)
    rides: tuple[str, ...] = ()

    @classmethod
    def from_file(cls, path: Path) -> SpectralCalibration:
        """Read a file.

        Raises
        ------
        InputError
            If it is none, or holds a value that it cannot.
        """
        part = judge(CalibrationPart, read_toml(path), file=label(path))
        return cls(part.mount, part.rides)

    def of(self, mount: str) -> LinePart:
        """The line of a mount.

        Raises
        ------
        InputError
            If the file has none of that name.
        """
        if mount not in self.lines:
            raise InputError(
                "the calibration does not have this mount, and another's says nothing of it",
                field="calibration_file.mount",
                value=mount,
                limit=" or ".join(self.lines) or "none at all",
                remedy=did_you_mean(mount, self.lines) or "calibrate it on rides whose speed is known",
            )
        return self.lines[mount]
