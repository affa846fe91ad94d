"""Judging what wheels and rails of a ride do to each other: traction, and what lies on the rails."""

from __future__ import annotations

from simrail.errors import InputError
from simrail.scenario.build import conditions_of
from simrail.scenario.cells import Cell
from simrail.scenario.scenario import Scenario
from simrail.track.design import TrackDesign
from simrail.track.rail_condition import check_conditions
from simrail.vehicle.model import VehicleModel


def judge_wheels(scenario: Scenario, cell: Cell, track: TrackDesign, vehicle: VehicleModel) -> None:
    """Refuse wheels that cannot drive, and rail conditions that are not on the track or mean nothing."""
    followed = cell.spec.engine == "kinematic"
    if cell.ride.drive == "wheels" and (followed or vehicle.traction is None):
        raise InputError(
            "the wheels cannot drive: " + ("the engine has no forces" if followed else "no [traction]"),
            file=scenario.file,
            field=f"ride[{cell.ride_index}].drive",
            value="wheels",
            limit="engine compiled or exudyn" if followed else f"a vehicle with traction, not {vehicle.name}",
            remedy='choose such an engine, or drive = "guide"'
            if followed
            else 'give the vehicle file a [traction], or drive = "guide"',
        )
    if followed and cell.spec.rail_condition:
        raise InputError(
            "a body that follows the rails does not feel their friction",
            file=scenario.file,
            field="rail_condition",
            value="engine kinematic",
            limit="engine compiled or exudyn",
            remedy="choose such an engine, or remove the rail conditions",
        )
    try:
        check_conditions(conditions_of(cell, vehicle), track.start_m, track.end_m)
    except InputError as error:
        error.file = scenario.file
        raise
