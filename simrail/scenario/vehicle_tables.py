"""Table of a scenario that says how the vehicle that runs differs from its drawing: ``[vehicle_factors]``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from simrail.core.toml_files import Part
from simrail.scenario.axes import Listed
from simrail.vehicle.factors import VehicleFactors

Factor = Annotated[float, Field(ge=0.1, le=10.0)]
"""Beyond it lies another vehicle."""


class VehicleFactorsPart(Part):
    """``[vehicle_factors]``: how the vehicle that runs differs from its drawing, which the train believes.

    The kinematic engine has no springs: only what follows from the drawing itself would change, so that it is
    refused there. What the wheel's radius is believed to be is ``radius_error`` of the encoder.
    """

    load: Listed[Factor] = 1.0
    """Factor on mass and inertias of frames and car bodies."""
    stiffness: Listed[Factor] = 1.0
    """Factor on the stiffness of all suspensions, rods, bushings and stops."""
    damping: Listed[Factor] = 1.0
    """Factor on the damping of all suspensions and dampers."""

    def factors(self) -> VehicleFactors:
        """The noun."""
        return VehicleFactors(**self.model_dump())
