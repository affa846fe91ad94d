"""IMU files: the figures of a data sheet, in its own units, as TOML.

A file holds a title, a source, how the device samples, and any of the figures of
`simrail.recording.sheets.figures.FIGURES`, each with its unit in its name, e.g. ``gyro_noise_degpsqrthz =
0.005``. A figure that the sheet does not state is left out and is then zero (errors), infinite (ranges) or
the stated default; `assumed` says in words what was assumed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, create_model, model_validator

from simrail.core.errors import InputError, did_you_mean
from simrail.core.toml_files import Part, blame, find, judge, label, read_toml
from simrail.recording.sheets.datasheet import grade_from_datasheet
from simrail.recording.sheets.figures import FIGURES, MEANINGS
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.sheet_words import explain, in_own_units
from simrail.recording.sheets.units import read_measured
from simrail.recording.sheets.usual import refuse_unusual

_HEAD = ("title", "synthetic")
_TEXTS = (
    "title",
    "source",
    "assumed",
    "synthetic",
    "rate_hz",
    "noise_reading",
    "bias_process",
    "flicker_range_s",
    "oversampling",
    "output",
    "gyro_axis_noise",
    "accel_axis_noise",
)
"""Keys of `ImuHead`: what a misspelt key may have been to be that is no figure."""


_LISTS = ("flicker_range_s", "gyro_axis_noise", "accel_axis_noise")


class ImuHead(Part):
    """What an IMU file says besides the figures of the sheet."""

    title: str = Field(description="what the device is, in one line")
    source: str = Field(description="where the figures come from")
    assumed: str = Field(default="", description="what was assumed where the sheet is silent or unclear")
    synthetic: bool = Field(default=False, description="true if the figures are those of no real device")
    rate_hz: float = Field(gt=0, description="output rate, Hz")
    noise_reading: Literal["allan", "one_sided_density"] = Field(
        default="allan",
        description="how a noise density is read: as the Allan coefficient N, or as a one-sided density, "
        "sqrt(2) N",
    )
    bias_process: Literal["gauss_markov", "flicker"] = Field(
        default="gauss_markov",
        description="how the bias wanders in a run: one Gauss-Markov process, or 1/f noise",
    )
    flicker_range_s: tuple[float, float] = Field(
        default=(1.0, 1000.0), description="averaging times between which 1/f noise is flat, s"
    )
    oversampling: int = Field(
        default=1, ge=1, le=1000, description="samples that the device averages for one of its output"
    )
    output: Literal["rates", "increments"] = Field(
        default="rates", description="whether the device sends rates, or angle and velocity increments"
    )
    gyro_axis_noise: tuple[float, float, float] = Field(
        default=(1.0, 1.0, 1.0),
        description="white noise of the gyro's axes x, y, z over its figure; or give that as a list of three",
    )
    accel_axis_noise: tuple[float, float, float] = Field(
        default=(1.0, 1.0, 1.0),
        description="white noise of the accelerometer's axes x, y, z over its figure; or as a list of three",
    )

    @model_validator(mode="before")
    @classmethod
    def _in_units_of_its_own(cls, data: Any) -> Any:
        """Figures in units that the table has not, and noise given for each axis, as the table has them."""
        if not isinstance(data, dict):
            return data
        # What a validator returns is no longer JSON, in which arrays stand for tuples.
        return {
            key: tuple(value) if key in _LISTS and isinstance(value, list) else value
            for key, value in in_own_units(data).items()
        }

    @model_validator(mode="after")
    def _as_sensors_are(self) -> Self:
        refuse_unusual(dict(self))
        return self

    def grade(self, name: str) -> ImuGrade:
        """The grade in SI units; `name` is the stem of the file."""
        return grade_from_datasheet(name, **self.model_dump(exclude=set(_HEAD)))

    def with_figures(self, figures: Mapping[str, float]) -> Self:
        """The same device with other figures, each in the place of its quantity in whatever unit."""
        fields = {FIGURES[name].field for name in figures}
        replaced = {name: None for name, figure in FIGURES.items() if figure.field in fields}
        return self.model_copy(update=replaced | dict(figures))

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:
        """What to write in the place of the words of a data sheet; never a key of another quantity."""
        if key in cls.model_fields:
            return explain(key, value) if key in FIGURES and read_measured(value) else None
        guess = did_you_mean(key, _TEXTS, cutoff=0.85) or explain(key, value)
        guess = guess or did_you_mean(key, _TEXTS, cutoff=0.7)
        return guess or "remove it; 'simrail new imu NAME' writes a file with every key and its meaning"

    @classmethod
    def others(cls, data: Mapping[str, Any]) -> Iterable[InputError]:
        """What figures contradict each other, or are none of a device."""
        known = {key: value for key, value in data.items() if key in cls.model_fields and key not in _HEAD}
        # Where the rate itself is missing, nothing contradicts it: one kilohertz stands for it.
        try:
            grade_from_datasheet("file", **{"rate_hz": 1000.0, **known})
        except InputError as error:
            return error.each
        return ()


def limited(name: str) -> Any:
    """Type of a figure: above 0 where 0 means nothing, otherwise not negative."""
    above = name.endswith(("_s", "_hz")) or "range" in name
    return Annotated[float, Field(gt=0) if above else Field(ge=0)]


def described(name: str) -> str:
    """Meaning and unit of a figure."""
    return f"{MEANINGS[name.rpartition('_')[0]]}, {FIGURES[name].unit}"


if TYPE_CHECKING:

    class ImuFile(ImuHead):
        """One IMU: `ImuHead`, and every figure of `FIGURES`, each of which may be left out."""

else:
    _figures: dict[str, Any] = {
        name: (limited(name) | None, Field(default=None, description=described(name))) for name in FIGURES
    }
    ImuFile = create_model(
        "ImuFile",
        __base__=ImuHead,
        __module__=__name__,
        __doc__="One IMU: `ImuHead`, and every figure of `FIGURES`, each of which may be left out.",
        **_figures,
    )


def load_grade(name: str, *, folder: Path | None = None) -> ImuGrade:
    """Grade from a shipped name or a path.

    Raises
    ------
    InputError
        If there is no such file, or it says something impossible.
    """
    return load_imu(name, folder=folder)[1]


def load_imu(name: str, *, folder: Path | None = None) -> tuple[ImuHead, ImuGrade]:
    """IMU file and its grade; see `load_grade`."""
    path = find("imu", name, folder=folder)
    file = judge(ImuFile, read_toml(path), file=label(path))
    with blame(label(path)):
        return file, file.grade(path.stem)
