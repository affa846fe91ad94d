"""A scenario's recordings carry the drawing of the vehicle that ran."""

import pandas as pd
import pytest

from simrail.campaign.cell import record_cell
from simrail.core.columns import IMU
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.sensors.drawing import drawing
from simrail.sensors.measure import measure

QUICK = ["ride.end_m=150.0", "ride.rest_s=1.0", "ride.speed_kmh=30.0"]


@pytest.mark.parametrize("engine", ["exudyn", "compiled"])
def test_a_cell_has_the_drawing_of_its_vehicle(engine: str) -> None:
    scenario = load_scenario("quick_kinematic", overrides=[f"engine={engine}", "vehicle=manchester_1"])
    parts = Parts(scenario)
    cell = next(iter(cells(scenario)))
    sheet = parts.resolve(cell).vehicle_sheet
    assert sheet == drawing(parts.ride(cell).vehicle)
    assert sheet.chord("body").half_m == 9.5


def test_bodies_of_the_kinematic_engine_point_along_the_track() -> None:
    """It has each body follow the rails at its own place, and the recording says so."""
    scenario = load_scenario("quick_kinematic", overrides=QUICK)
    parts = Parts(scenario)
    cell = next(iter(cells(scenario)))
    truth = simulate(parts.ride(cell))
    recording = record_cell(cell, truth, parts)
    assert recording.vehicle_sheet == drawing(parts.ride(cell).vehicle, each_by_itself=True)
    chord = recording.vehicle_sheet.chord(recording.mount_body)
    assert (chord.centre_m, chord.half_m, chord.play_m) == (0.0, 0.0, 0.0)
    resolved = parts.resolve(cell)
    bare = measure(
        truth,
        name=cell.ride.name,
        mount=resolved.mount,
        grade=resolved.grade,
        seed=cell.sensor_seed,
        draw=cell.sensor_draw,
    )
    assert bare.vehicle_sheet is None
    # What is known of the vehicle changes nothing that is recorded.
    pd.testing.assert_frame_equal(bare.imu[list(IMU)], recording.imu[list(IMU)], check_exact=True)
