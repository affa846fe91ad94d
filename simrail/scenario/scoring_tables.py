"""Tables of a scenario about what is scored: ``[score]``, ``[geometry]``, ``[running_safety]``, ..."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from simrail.core.errors import InputError
from simrail.core.toml_files import Part
from simrail.scenario.fields import Name, Positive, Wavelengths


class ScorePart(Part):
    """``[score]``: what of the score table is kept; everything, unless said otherwise.

    ``"curve:*"`` among the windows keeps every single curve.
    """

    windows: tuple[str, ...] | None = None
    """Stretches that are kept, e.g. whole, curve, straight; curve:* keeps every single curve."""
    metrics: tuple[str, ...] | None = None
    """Figures that are kept, e.g. rms, p95, max."""


class RunningSafetyPart(Part):
    """``[running_safety]``: scores the forces between wheels and rails after EN 14363.

    ``vehicle`` says which limit of Prud'homme's counts, and ``derailment_limit`` what the report holds Y/Q
    against. Forces are kept at ``contact_rate_hz``, or at the rate of the truth if that is not given.
    """

    vehicle: Literal["passenger", "freight"] = "passenger"
    """Kind of vehicle, which says the limit of Prud'homme's that counts."""
    derailment_limit: Annotated[float, Field(gt=0.0, le=3.0)] = 0.8
    """What Y/Q is held against."""


class RideComfortPart(Part):
    """``[ride_comfort]``: scores N_MV (EN 12299) and Sperling's Wz where each IMU sits."""


class GeometryLimitsPart(Part):
    """``[geometry.limits.<quantity>]``: limits that the report holds sections of 200 m against, mm.

    ``error_sd_mm`` is asked of the estimate, not of the rails: standard deviation of its error in D1.
    """

    sd_mm: Positive | None = None
    """Standard deviation of the rails over 200 m, mm."""
    defect_mm: Positive | None = None
    """Single value, mm."""
    error_sd_mm: Positive | None = None
    """Standard deviation of the estimate's error in D1, mm."""


class GeometryPart(Part):
    """``[geometry]``: in which wavelength bands, and over which base of twist, rail geometry is scored.

    ``bands`` are those of `simrail.track.bands` by name; ``own_bands`` are others, name = [shortest,
    longest], m. ``limits`` change no score: what lies beyond them is marked in the report.
    """

    bands: tuple[Literal["D0", "D1", "D2", "D3"], ...] = ("D0", "D1", "D2", "D3")
    """Wavelength bands by name, e.g. D1."""
    own_bands: dict[Name, Wavelengths] = Field(default_factory=dict)
    """Others: name = [shortest, longest], m."""
    twist_base_m: Annotated[float, Field(gt=0.0, le=50.0)] = 3.0
    """Base of the twist, m."""
    limits: dict[Literal["alignment", "vertical_profile", "cross_level"], GeometryLimitsPart] = Field(
        default_factory=dict
    )
    """What the page marks where it is exceeded, by quantity; no score changes."""

    @field_validator("own_bands")
    @classmethod
    def _bands(cls, value: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        for name in value:
            if name in ("full", "D0", "D1", "D2", "D3"):
                limit, remedy = "another name than full, D0 to D3", "give the band another name"
                raise InputError("is a name that is taken", value=name, limit=limit, remedy=remedy)
        return value
