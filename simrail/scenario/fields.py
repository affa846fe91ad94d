"""Fields that several tables of a scenario have: names, places on a vehicle, counts, wavelengths, factors."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from simrail.core.errors import InputError

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=64)]
"""A name that can stand in tables and file names: letters, digits and ``_ . + -``."""


Positive = Annotated[float, Field(gt=0.0)]


OnBoard = Annotated[float, Field(ge=-50.0, le=50.0)]
"""A coordinate of something that a vehicle carries, m from its reference point."""


Draws = Annotated[int, Field(ge=1, le=1_000_000)]


def _ordered(wavelengths_m: tuple[float, float]) -> tuple[float, float]:
    if wavelengths_m[0] >= wavelengths_m[1]:
        limit = "[shortest, longest]"
        raise InputError("are no range", value=list(wavelengths_m), limit=limit, remedy="swap them")
    return wavelengths_m


Wavelengths = Annotated[tuple[Positive, Positive], AfterValidator(_ordered)]
"""The shortest and the longest wavelength, m."""


Scale = Annotated[float, Field(ge=0.0, le=10.0)]
"""A factor on amplitudes."""
