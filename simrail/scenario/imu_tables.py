"""Tables of a scenario about IMUs and in what they stand: ``[[imu]]``, ``[earth]``, ``[temperature]``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, create_model

from simrail.core.toml_files import Part
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.imu_file import ImuHead, described, limited
from simrail.scenario.axes import Listed
from simrail.scenario.fields import Draws, Name, OnBoard, Positive


class _SheetPart(Part):
    """``[imu.sheet]``: figures that take the place of those of the grade's data sheet."""

    @classmethod
    def explained(cls, key: str, value: object) -> str | None:
        """What to write in the place of the words of a data sheet; see `ImuHead.explained`."""
        return ImuHead.explained(key, value)

    def figures(self) -> dict[str, float]:
        """Those that are given. Nothing of it is a list."""
        return {name: value for name, value in self.model_dump().items() if value is not None}


if TYPE_CHECKING:
    SheetPart = _SheetPart
else:
    _figures: dict[str, Any] = {
        name: (Listed[limited(name)] | None, Field(default=None, description=described(name)))
        for name in FIGURES
    }
    SheetPart = create_model("SheetPart", __base__=_SheetPart, __module__=__name__, **_figures)


NOISE = "noise"
"""Word in the name of an IMU or of its grade that says that noise was added to its signals."""


class ImuPart(Part):
    """``[[imu]]``: an IMU of some grade, mounted on a body of the vehicle.

    ``sensor_draws`` limits the draws of this IMU below those of ``[monte_carlo]``: an ideal one has no
    errors to be drawn, so that one or two draws (of the encoder) say all. ``vehicle`` names the one that it
    is on, where a scenario has several whose bodies have other names. ``sheet`` has figures that take the
    place of those of the grade's data sheet, by the keys of IMU files: a number, a list, or a distribution.
    """

    name: Name
    """Name of the IMU in tables."""
    grade: Listed[str]
    """A shipped IMU, or the path of an IMU file."""
    vehicle: str | None = None
    """The vehicle that it is on, where a scenario has several with bodies of other names."""
    body: Listed[str]
    """The body that carries it."""
    position_m: tuple[OnBoard, OnBoard, OnBoard]
    """Where, m: ahead of the body's reference point, left of the track's centre, above the rails, as it
    stands on level track."""
    roll_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """How it is turned on the body about X, degrees; nobody tells the train."""
    pitch_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]] = 0.0
    """The same about Y, degrees."""
    yaw_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    """The same about Z, degrees."""
    sensor_draws: Draws | None = None
    """Fewer draws than those of [monte_carlo], for one that has no errors to be drawn."""
    sheet: SheetPart | None = None
    """Figures in the place of those of the grade's data sheet."""

    def is_on(self, vehicle: str) -> bool:
        """Whether it is on a vehicle."""
        return self.vehicle in (None, vehicle)

    @property
    def noise_added(self) -> bool:
        """Whether it stands for another one with noise added, as a report sets the two side by side."""
        return NOISE in self.name or NOISE in str(self.grade)


class EarthPart(Part):
    """``[earth]``: the Earth turns. Without it, it is at rest.

    ``x_axis_deg`` is the direction of the track's X axis, counter-clockwise from east.
    """

    latitude_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]]
    """Latitude, degrees north."""
    x_axis_deg: Listed[Annotated[float, Field(ge=-360.0, le=360.0)]] = 0.0
    """Direction of the track's X axis, degrees counter-clockwise from east."""


class TemperaturePart(Part):
    """``[temperature]``: of the IMUs, from ``start_c`` to ``ambient_c``. Without it, that of calibration."""

    start_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    """At the start of the recording, degrees Celsius."""
    ambient_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    """What it goes to."""
    time_constant_s: Listed[Positive] = 600.0
    """How fast, s."""
