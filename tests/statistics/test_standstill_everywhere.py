"""No shipped ride is said to stand while it runs: a stop that is none ruins all that comes after it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry

from simrail.campaign.cell import record_cell
from simrail.core.columns import STANDSTILL
from simrail.recording.recording import Recording
from simrail.ride.ride import Truth, simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scoring.score import truth_at_imu

pytestmark = pytest.mark.slow

SHIPPED = sorted(path.stem for path in (Path(__file__).parents[2] / "scenarios").glob("*.toml"))

LONG = ("metro_ride", "imu_only", "vertical_profile", "standstill")
"""Of rides of tens of kilometres one is enough, in its own direction."""

SURE = 0.99
MOVES_MPS = 0.1
"""Five standard deviations of what a train at rest does (`ZeroVelocityOdometry.rest_speed_mps`)."""


def chosen(scenario: Scenario) -> list[list[Cell]]:
    """Cells of one draw, those of a ride together: of each ride and vehicle the slowest and the fastest."""
    rides: dict[tuple[object, ...], dict[int, list[Cell]]] = {}
    for cell in cells(scenario):
        if cell.track_draw == cell.map_draw == cell.sensor_draw == cell.sample == 0:
            kind = (cell.ride.name, cell.spec.vehicle, cell.spec.engine)
            rides.setdefault(kind, {}).setdefault(cell.ride_number, []).append(cell)
    out = []
    for of_kind in rides.values():
        by_speed = sorted(of_kind.values(), key=lambda ride: float(str(ride[0].ride.speed_kmh or 0.0)))
        out += [by_speed[0]] if len(by_speed) == 1 else [by_speed[0], by_speed[-1]]
    return out


def recordings(name: str, *, turned: bool) -> Iterator[tuple[Cell, Truth, Recording]]:
    """One recording of each IMU and mount on the rides that are `chosen`."""
    plain = load_scenario(name)
    backward = [f"ride.{ride.name}.reverse={str(not ride.reverse).lower()}" for ride in plain.spec.ride]
    scenario = load_scenario(name, overrides=backward) if turned else plain
    for ride in chosen(scenario):
        parts = Parts(scenario)
        truth = simulate(parts.ride(ride[0]), warn=False)
        seen = set()
        for cell in ride:
            if (key := (cell.imu.name, str(cell.imu.grade), cell.imu.body)) not in seen:
                seen.add(key)
                yield cell, truth, record_cell(cell, truth, parts)


@pytest.mark.parametrize("turned", [False, True], ids=["as_shipped", "turned"])
@pytest.mark.parametrize("name", SHIPPED)
def test_no_ride_is_said_to_stand_while_it_runs(name: str, turned: bool) -> None:
    if turned and name in LONG:
        pytest.skip("one direction of long rides")
    if turned and not all(isinstance(ride.reverse, bool) for ride in load_scenario(name).spec.ride):
        pytest.skip("it runs both ways as shipped")
    heard = 0
    for cell, truth, recording in recordings(name, turned=turned):
        if recording.start_speed_mps:
            continue
        heard += 1
        for smoothed in (False, True):
            said = ZeroVelocityOdometry(smoothed=smoothed).estimate(recording).states[STANDSTILL] > SURE
            speed = np.abs(truth_at_imu(truth, recording)["speed_mps"].to_numpy())
            worst = float(speed[said].max(initial=0.0))
            print(f"{name} {cell.ride.name} {cell.spec.vehicle} {cell.imu.name}: {worst:.3f} m/s")
            assert worst < MOVES_MPS, (cell.settings, recording.mount, smoothed)
    assert heard or name == "leaves"
