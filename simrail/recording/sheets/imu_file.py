"""IMU files: the figures of a data sheet, in its own units, as TOML.

A file holds a title, a source, how the device samples, and any of the figures of
`simrail.recording.sheets.datasheet.FIGURES`, each with its unit in its name, e.g. ``gyro_noise_degpsqrthz =
0.005``. A figure that the sheet does not state is left out and is then zero (errors), infinite (ranges) or
the stated default; `assumed` says in words what was assumed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from simrail.core.toml_files import Part, blame, find, judge, label, read_toml
from simrail.recording.sheets.datasheet import FIGURES, grade_from_datasheet
from simrail.recording.sheets.grades import ImuGrade

_HEAD = ("title", "synthetic")


class ImuHead(Part):
    """What an IMU file says besides the figures of the sheet."""

    title: str
    source: str
    assumed: str = ""
    synthetic: bool = False
    rate_hz: float = Field(gt=0)
    noise_reading: Literal["allan", "one_sided_density"] = "allan"
    bias_process: Literal["gauss_markov", "flicker"] = "gauss_markov"
    flicker_range_s: tuple[float, float] = (1.0, 1000.0)
    oversampling: int = Field(default=1, ge=1, le=1000)
    output: Literal["rates", "increments"] = "rates"

    def grade(self, name: str) -> ImuGrade:
        """The grade in SI units; `name` is the stem of the file."""
        return grade_from_datasheet(name, **self.model_dump(exclude=set(_HEAD)))


def _limits(name: str) -> Any:
    """Type of a figure: above 0 where 0 means nothing, otherwise not negative."""
    above = name.endswith(("_s", "_hz")) or "range" in name
    return Annotated[float | None, Field(gt=0) if above else Field(ge=0)]


if TYPE_CHECKING:

    class ImuFile(ImuHead):
        """One IMU: `ImuHead`, and every figure of `FIGURES`, each of which may be left out."""

else:
    _figures: dict[str, Any] = {name: (_limits(name), None) for name in FIGURES}
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
