"""The accuracy of a map as a person writes it: ``[map]`` of a ride file, in mm, percent and permil.

What a scenario says of its maps has the same keys (`simrail.scenario.line_tables.MapPart`), where each may
be a list or a distribution.
"""

from typing import Annotated

from pydantic import Field

from simrail.core.toml_files import Part
from simrail.track.map_errors import EXACT, UNSTATED, MapErrors

CantSd = Annotated[float, Field(ge=0.0, le=100.0)]
CorrelationLength = Annotated[float, Field(ge=20.0, le=10000.0)]
RadiusSd = Annotated[float, Field(ge=0.0, le=20.0)]
PlaceSd = Annotated[float, Field(ge=0.0, le=50.0)]
GradientSd = Annotated[float, Field(ge=0.0, le=20.0)]
ScaleSd = Annotated[float, Field(ge=0.0, le=5.0)]
OffsetSd = Annotated[float, Field(ge=0.0, le=200.0)]

_UNITS = {
    "cant_sd_mm": ("cant_sd_m", 1e-3),
    "cant_along_sd_mm": ("cant_along_sd_m", 1e-3),
    "cant_along_length_m": ("cant_along_length_m", 1.0),
    "radius_sd_percent": ("radius_relative_sd", 1e-2),
    "place_sd_m": ("place_sd_m", 1.0),
    "gradient_sd_permil": ("gradient_sd", 1e-3),
    "chainage_scale_sd_percent": ("chainage_scale_sd", 1e-2),
    "chainage_offset_sd_m": ("chainage_offset_sd_m", 1.0),
}
"""Key of a file -> field of `MapErrors`, and the unit of the key in that of the field."""


class MapErrorsPart(Part):
    """``[map]``: how wrong the map may be; what is left out is taken to be wide.

    Attributes
    ----------
    exact : bool
        True for a map without errors; then nothing else may be said.
    cant_sd_mm, cant_along_sd_mm, ... : float
        As in `MapErrors`.
    """

    exact: bool = False
    cant_sd_mm: CantSd | None = None
    """Standard deviation of the cant of a curve, one error for each, mm."""
    cant_along_sd_mm: CantSd | None = None
    """Standard deviation of the cant that wanders along the line, mm."""
    cant_along_length_m: CorrelationLength | None = None
    """Distance at which the correlation of that has fallen to 1/e, m."""
    radius_sd_percent: RadiusSd | None = None
    """Relative standard deviation of the curvature of a curve, one error for each, percent."""
    place_sd_m: PlaceSd | None = None
    """Standard deviation of the place of each joint of two segments, m."""
    gradient_sd_permil: GradientSd | None = None
    """Standard deviation of the slope of each gradient, per mille."""
    chainage_scale_sd_percent: ScaleSd | None = None
    """Relative standard deviation of all lengths, percent."""
    chainage_offset_sd_m: OffsetSd | None = None
    """Standard deviation of a shift of all places, m."""

    def errors(self) -> MapErrors:
        """The sizes in SI."""
        return map_errors_of(self, EXACT if self.exact else UNSTATED)


def map_errors_of(part: Part, unsaid: MapErrors) -> MapErrors:
    """Sizes in SI of a table that has these keys; where it says nothing, those of ``unsaid``."""
    said = {key: getattr(part, key) for key in _UNITS}
    values = {
        field: (getattr(unsaid, field) if said[key] is None else unit * said[key])
        for key, (field, unit) in _UNITS.items()
    }
    return MapErrors(**values)


def map_table(errors: MapErrors) -> dict[str, object]:
    """The table that says these sizes: what `MapErrorsPart` reads back, to rounding."""
    if errors == EXACT:
        return {"exact": True}
    return {key: float(f"{getattr(errors, field) / unit:.12g}") for key, (field, unit) in _UNITS.items()}
