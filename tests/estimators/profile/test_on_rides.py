"""The profile filter on rides of the scenario ``vertical_profile``: what its page says of the gyro."""

from __future__ import annotations

import numpy as np
import pytest
from simrail.estimators.profile.profile_filter import ProfileFilter

from simrail.campaign.cell import record_cell
from simrail.recording.recording import Recording
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.scoring.geometry import score_geometry
from simrail.track.bands import BANDS
from simrail.track.laid_track import LaidTrack


def rides(vehicle: str, mount: str, *, count: int) -> list[tuple[Recording, LaidTrack]]:
    """First rides of a vehicle, as a mount records them, there and back, with the true place."""
    scenario = load_scenario("vertical_profile", overrides=["odometry='truth'"])
    parts, found = Parts(scenario), []
    for cell in cells(scenario):
        if cell.spec.vehicle == vehicle and cell.imu.name == mount and len(found) < count:
            recording = record_cell(cell, simulate(parts.resolve(cell).ride), parts)
            found.append((recording, parts.rails(cell)))
    return found


def error_mm(method: ProfileFilter, recording: Recording, rails: LaidTrack) -> float:
    """Sd of the error of the vertical profile in D1."""
    table = score_geometry(method.estimate(recording), rails, recording, bands=[BANDS["D1"]], metrics=["sd"])
    row = (table["quantity"] == "vertical_profile") & (table["band"] == "D1") & (table["window"] == "whole")
    return float(table.loc[row, "value"].iloc[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("vehicle", "mount", "helps"),
    [
        ("metro_irw_bogie", "axle", True),
        ("metro_irw_bogie", "carried", True),
        ("two_axle_wagon", "carried", True),
        ("two_axle_wagon", "axle", False),
    ],
)
def test_the_gyro_helps_where_it_points_along_the_chord(vehicle: str, mount: str, helps: bool) -> None:
    """Not on the axle of the wagon, whose box pitches by itself; there the state for that mends the harm."""
    logs = []
    for recording, rails in rides(vehicle, mount, count=8):
        errors = [
            error_mm(method, recording, rails)
            for method in (
                ProfileFilter(gyro=False),
                ProfileFilter(deviation_rad=0.0),
                ProfileFilter(),
            )
        ]
        logs.append(np.log(errors))
    alone, gyro, deviation = np.mean(logs, axis=0)
    assert (gyro < alone) == helps
    assert helps or deviation < gyro
