"""Judging what wheels and rails of a ride do to each other: gauge, traction, and what lies on the rails."""

from __future__ import annotations

from simrail.core.errors import InputError
from simrail.scenario.build import conditions_of
from simrail.scenario.cells import Cell
from simrail.scenario.scenario import Scenario
from simrail.track.design import TrackDesign
from simrail.track.rail_condition import check_conditions
from simrail.vehicle.model import VehicleModel

MOST_BASE_PER_GAUGE = 1.1
"""The middles of the heads of two rails are farther apart than their gauge, by less than a tenth of it."""


def judge_wheels(scenario: Scenario, cell: Cell, track: TrackDesign, vehicle: VehicleModel) -> None:
    """Refuse wheels beside the rails or that cannot drive, and conditions off the track or without sense."""
    _judge_gauge(scenario, track, vehicle)
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


def _judge_gauge(scenario: Scenario, track: TrackDesign, vehicle: VehicleModel) -> None:
    """Refuse a vehicle of another gauge: what a rail is off would not turn it as it turns the track."""
    low, high = vehicle.wheel_rail.gauge_m, MOST_BASE_PER_GAUGE * vehicle.wheel_rail.gauge_m
    if not low < track.rail_base_m < high:
        raise InputError(
            f"vehicle {vehicle.name!r} does not fit track {track.name!r}: the running tables of its gauge of "
            f"{1e3 * vehicle.wheel_rail.gauge_m:g} mm are not as far apart as the track's",
            file=scenario.file,
            field="vehicle",
            value=f"rail_base_mm = {1e3 * track.rail_base_m:g} in the track file",
            limit=f"{1e3 * low:g} to {1e3 * high:g} mm",
            remedy="choose a vehicle of the track's gauge, or correct the track's rail_base_mm",
        )
