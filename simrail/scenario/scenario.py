"""What a person writes into a scenario file, as models; and the reading of it.

A `Scenario` is a name, the text it was read from, and a `ScenarioFile`: the judged content. Any
scalar may be a list (`simrail.scenario.axes`), so one scenario is one ride or a whole campaign.
Only the form of each field is judged here; whether track, vehicle, rides and sensors fit each other
is judged by `simrail.scenario.check`, and what is run is listed by `simrail.scenario.cells`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from simrail.errors import InputError
from simrail.line_odometry import OdometryName
from simrail.scenario.axes import Axis, Listed
from simrail.scenario.files import Part, find, judge, label, parse_toml, read_text
from simrail.scenario.overrides import override
from simrail.scenario.sensor_parts import EncoderPart, MagnetometerPart, RailSensorPart

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=64)]
"""A name that can stand in tables and file names: letters, digits and ``_ . + -``."""

Positive = Annotated[float, Field(gt=0.0)]


class IrregularityPart(Part):
    """``[irregularity]``: how the rails deviate from the design. Without it they do not."""

    spectrum: Listed[str]
    wavelengths_m: Annotated[tuple[Positive, Positive], Field(description="shortest, longest")] = (1.5, 100.0)
    fade_m: Listed[Annotated[float, Field(ge=0.0, le=1000.0)]] = 40.0
    scale: Listed[Annotated[float, Field(ge=0.0, le=10.0)]] = 1.0

    @field_validator("wavelengths_m")
    @classmethod
    def _ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value[0] >= value[1]:
            raise ValueError(f"are not (shortest, longest): {list(value)}")
        return value


class StopPart(Part):
    """A stop on the way: where the reference point of the vehicle stands, and for how long."""

    position_m: float
    dwell_s: Annotated[float, Field(ge=0.0, le=3600.0)]


class RidePart(Part):
    """``[[ride]]``: one ride over the track. It runs backwards if ``end_m < start_m``.

    Without ``end_m`` and ``speed_kmh`` the vehicle stands where it is, for ``rest_s + final_rest_s``.
    """

    name: Name
    start_m: Listed[float]
    end_m: Listed[float] | None = None
    speed_kmh: Listed[Annotated[float, Field(gt=0.0, le=400.0)]] | None = None
    acceleration_mps2: Listed[Annotated[float, Field(gt=0.0, le=3.0)]] = 0.6
    jerk_mps3: Listed[Annotated[float, Field(gt=0.0, le=10.0)]] = 0.4
    rest_s: Listed[Annotated[float, Field(ge=0.0, le=3600.0)]] = 20.0
    final_rest_s: Listed[Annotated[float, Field(ge=0.0, le=3600.0)]] = 5.0
    stops: tuple[StopPart, ...] = ()
    drive: Listed[Literal["guide", "wheels"]] = "guide"

    @model_validator(mode="after")
    def _goes_or_stands(self) -> RidePart:
        if (self.end_m is None) != (self.speed_kmh is None):
            missing = "end_m" if self.end_m is None else "speed_kmh"
            raise ValueError(f"{missing} is missing: a ride needs end_m and speed_kmh, a standstill neither")
        if self.end_m is None and self.stops:
            raise ValueError("a standstill, without end_m, has no stops on the way")
        return self

    @property
    def stands(self) -> bool:
        """Whether the vehicle does not move."""
        return self.end_m is None


class RailConditionPart(Part):
    """``[[rail_condition]]``: what lies on the rails, by a name or by its friction coefficient."""

    start_m: float
    end_m: float
    condition: Literal["dry", "wet", "leaves"] | None = None
    friction: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    rails: Literal["both", "left", "right"] = "both"

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.condition is None) == (self.friction is None):
            raise InputError(
                "needs either a condition or a friction coefficient",
                field="condition",
                value=None if self.condition is None else f"{self.condition}, friction {self.friction:g}",
                limit="dry, wet or leaves",
                remedy='give condition = "leaves" or friction = 0.05',
            )
        return self

    @property
    def words(self) -> str:
        """What lies there, for reports."""
        what = self.condition or f"friction {self.friction:g}"
        return what if self.rails == "both" else f"{what}, {self.rails} rail"


class ImuPart(Part):
    """``[[imu]]``: an IMU of some grade, mounted on a body of the vehicle."""

    name: Name
    grade: Listed[str]
    body: Listed[str]
    position_m: tuple[float, float, float]
    roll_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0
    pitch_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]] = 0.0
    yaw_deg: Listed[Annotated[float, Field(ge=-180.0, le=180.0)]] = 0.0

    @field_validator("position_m")
    @classmethod
    def _metres(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if max(abs(part) for part in value) > 50.0:
            raise ValueError(
                f"lies more than 50 m from the vehicle's reference point: {list(value)}; it is in metres"
            )
        return value


class EarthPart(Part):
    """``[earth]``: the Earth turns. Without it, it is at rest.

    ``x_axis_deg`` is the direction of the track's X axis, counter-clockwise from east.
    """

    latitude_deg: Listed[Annotated[float, Field(ge=-90.0, le=90.0)]]
    x_axis_deg: Listed[Annotated[float, Field(ge=-360.0, le=360.0)]] = 0.0


class TemperaturePart(Part):
    """``[temperature]``: of the IMUs, from ``start_c`` to ``ambient_c``. Without it, that of calibration."""

    start_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    ambient_c: Listed[Annotated[float, Field(ge=-60.0, le=120.0)]]
    time_constant_s: Listed[Positive] = 600.0


class EstimatorPart(Part):
    """``[[estimator]]``: a method under a name, with the keyword arguments of its class."""

    name: Name
    method: str
    options: dict[str, Any] = Field(default_factory=dict)


class ScorePart(Part):
    """``[score]``: what of the score table is kept; everything, unless said otherwise.

    ``"curve:*"`` among the windows keeps every single curve.
    """

    windows: tuple[str, ...] | None = None
    metrics: tuple[str, ...] | None = None


class GeometryPart(Part):
    """``[geometry]``: in which wavelength bands, and over which base of twist, rail geometry is scored.

    ``bands`` are those of `simrail.bands` by name; ``own_bands`` are others, name = [shortest, longest], m.
    """

    bands: tuple[Literal["D0", "D1", "D2", "D3"], ...] = ("D0", "D1", "D2", "D3")
    own_bands: dict[Name, tuple[Positive, Positive]] = Field(default_factory=dict)
    twist_base_m: Annotated[float, Field(gt=0.0, le=50.0)] = 3.0

    @field_validator("own_bands")
    @classmethod
    def _bands(cls, value: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        for name, (shortest, longest) in value.items():
            if name in ("full", "D0", "D1", "D2", "D3"):
                raise ValueError(f"{name} is a name that is taken; give the band another one")
            if shortest >= longest:
                raise ValueError(f"{name} is not (shortest, longest): {[shortest, longest]}")
        return value


class ScenarioFile(Part):
    """The content of a scenario file.

    ``paper`` names the publication whose tables and figures the report sets beside the scenario's own.
    """

    title: str
    paper: Literal["briales_2021"] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    track: Listed[str]
    vehicle: Listed[str]
    engine: Listed[Literal["exudyn", "compiled", "kinematic"]] = "exudyn"
    step_s: Listed[Annotated[float, Field(gt=0.0, le=0.001)]] = 0.0005
    truth_rate_hz: Listed[Annotated[float, Field(ge=10.0, le=1000.0)]] = 1000.0
    track_draws: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    sensor_draws: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    odometry: Listed[OdometryName] = "curve_matched"
    irregularity: IrregularityPart | None = None
    rail_condition: tuple[RailConditionPart, ...] = ()
    ride: Annotated[list[RidePart], Field(min_length=1)]
    imu: Annotated[list[ImuPart], Field(min_length=1)]
    encoder: EncoderPart | None = None
    magnetometer: MagnetometerPart | None = None
    rail_sensor: RailSensorPart | None = None
    earth: EarthPart | None = None
    temperature: TemperaturePart | None = None
    estimator: Annotated[list[EstimatorPart], Field(min_length=1)]
    score: ScorePart = ScorePart()
    geometry: GeometryPart = GeometryPart()

    @field_validator("step_s")
    @classmethod
    def _divides_the_output(cls, value: float | Axis) -> float | Axis:
        for step in value if isinstance(value, Axis) else (value,):
            if abs(0.001 / float(step) - round(0.001 / float(step))) > 1e-6:
                raise ValueError(f"does not divide the output interval of 0.001 s: {step}; try 0.0005")
        return value

    @field_validator("truth_rate_hz")
    @classmethod
    def _whole_milliseconds(cls, value: float | Axis) -> float | Axis:
        for rate in value if isinstance(value, Axis) else (value,):
            if abs(1000.0 / float(rate) - round(1000.0 / float(rate))) > 1e-9:
                raise ValueError(f"is not 1000 Hz divided by a whole number: {rate}; try 250.0")
        return value

    @field_validator("ride", "imu", "estimator")
    @classmethod
    def _unique_names(cls, value: list[Any]) -> list[Any]:
        names = [part.name for part in value]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two of them are named {name!r}; give each a name of its own")
        return value


@dataclass(frozen=True)
class Scenario:
    """A scenario that has been read: its name, where it stood, its text and its content.

    Attributes
    ----------
    name : str
        Stem of the file; names the folder of the results.
    file : str
        How messages call the file.
    folder : Path, optional
        Where parts that are given by a relative path are looked for.
    text : str
        The file as it was written.
    overrides : tuple of str
        Settings of the command line, ``key=value``.
    spec : ScenarioFile
        The judged content, settings applied.
    """

    name: str
    file: str
    folder: Path | None
    text: str
    overrides: tuple[str, ...]
    spec: ScenarioFile

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return self.spec.title


def load_scenario(name: str | Path, *, overrides: Sequence[str] = (), seed: int | None = None) -> Scenario:
    """Read a scenario.

    Parameters
    ----------
    name : str or Path
        Name of a shipped scenario (``"go20a"``) or path of a file.
    overrides : sequence of str, optional
        Settings ``key=value`` that replace what the file says, e.g. ``"ride.speed_kmh=[20, 70]"``.
    seed : int, optional
        Replaces the file's seed.

    Raises
    ------
    InputError
        If the file is missing or has a fault: an unknown key, a wrong type or unit, NaN.
    """
    path = find("scenario", str(name))
    settings = [*overrides, *([f"seed={seed}"] if seed is not None else [])]
    return read_scenario(
        read_text(path), name=path.stem, file=label(path), folder=path.parent, overrides=settings
    )


def read_scenario(
    text: str,
    *,
    name: str,
    file: str | None = None,
    folder: Path | None = None,
    overrides: Sequence[str] = (),
) -> Scenario:
    """Read a scenario from TOML text; see `load_scenario`."""
    file = file or f"{name}.toml"
    data = override(parse_toml(text, file=file), overrides)
    spec = judge(ScenarioFile, data, file=file)
    listed = [_options_as_axes(part) for part in spec.estimator]
    spec = spec.model_copy(update={"estimator": listed})
    return Scenario(name=name, file=file, folder=folder, text=text, overrides=tuple(overrides), spec=spec)


def _options_as_axes(part: EstimatorPart) -> EstimatorPart:
    """Read lists among an estimator's options as axes; a list of lists is a list-valued option."""
    options: dict[str, Any] = {}
    for key, value in part.options.items():
        is_axis = (
            isinstance(value, list) and value and not any(isinstance(item, (list, dict)) for item in value)
        )
        options[key] = Axis(value) if is_axis else value
    return part.model_copy(update={"options": options})
