"""What a scenario runs: its cells, in a fixed order, each with everything that it needs to be run.

A *world* is what decides the motion: track, vehicle, engine, step, irregularity and a ride. A world
and a track draw make one simulated ride; a ride, a sensor setting, an IMU and a sensor draw make one
*cell*: one recording, on which every estimator runs. Cells that differ in their draws only share a
*case*: scores are aggregated over the cells of a case.

Nothing depends on the order: seeds are found by name (`ride_seed`, `sensor_seed`), so a cell gives
the same scores alone, among others, or in another order.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import Any

from simrail.scenario.axes import Scalar, axes_of, expand
from simrail.scenario.scenario import EstimatorPart, ImuPart, RidePart, Scenario, ScenarioFile

WORLD = ("track", "vehicle", "engine", "step_s", "truth_rate_hz", "irregularity")
SENSING = ("odometry", "encoder", "magnetometer", "rail_sensor", "earth", "temperature")


@dataclass(frozen=True)
class Cell:
    """One recording to be made and estimated from.

    Attributes
    ----------
    number : int
        Its place in the order of the scenario, from 0.
    case : int
        Number that it shares with the cells that differ in draws only.
    ride_number : int
        Number that it shares with the cells that use the same simulated ride.
    spec : ScenarioFile
        The scenario with this cell's values; nothing in it that the cell uses is an axis.
    ride, imu : RidePart, ImuPart
        Its ride and its IMU.
    ride_index, imu_index : int
        Where they stand in the scenario, for messages.
    track_draw, sensor_draw : int
        Draws, from 0.
    settings : dict
        Values of the scenario's axes by dotted name, e.g. ``{"ride.speed_kmh": 70.0}``.
    """

    number: int
    case: int
    ride_number: int
    spec: ScenarioFile
    ride: RidePart
    imu: ImuPart
    ride_index: int
    imu_index: int
    track_draw: int
    sensor_draw: int
    settings: dict[str, Scalar]

    @property
    def ride_seed(self) -> int:
        """Root seed of the track that is laid: the same for all rides over a track draw."""
        return derived_seed(self.spec.seed, "track_draw", self.track_draw)

    @property
    def sensor_seed(self) -> int:
        """Root seed of the sensors: rides over the same draws are paired, draws share nothing."""
        return derived_seed(self.spec.seed, "sensors_of_track_draw", self.track_draw)


@dataclass(frozen=True)
class Method:
    """An estimator to run: its unique name in the tables, and what makes it.

    Attributes
    ----------
    name : str
        The scenario's name; a variant of an axis adds its values, ``"ekf[compensated=True]"``.
    tuning : str
        The option ``tuning``, or ``"default"``.
    part : EstimatorPart
        Class and options.
    index : int
        Where it stands in the scenario, for messages.
    """

    name: str
    tuning: str
    part: EstimatorPart
    index: int


def derived_seed(root: int, *names: str | int) -> int:
    """Return the seed (63 bits) that belongs to a name under a root seed."""
    digest = hashlib.sha256(repr((int(root), *names)).encode()).digest()
    return int.from_bytes(digest[:8], "little") >> 1


def cells(scenario: Scenario) -> Iterator[Cell]:
    """Yield every cell of a scenario, those of one simulated ride in a row.

    Parameters
    ----------
    scenario : Scenario
        As read by `simrail.scenario.scenario.load_scenario`.
    """
    spec = scenario.spec
    number = ride_number = 0
    worlds = [
        (world_settings | ride_settings, world, i, ride)
        for world_settings, world in expand(spec, fields=WORLD)
        for i, part in enumerate(spec.ride)
        for ride_settings, ride in expand(part, prefix="ride.")
    ]
    sensings = [
        (sensing_settings | imu_settings, sensing, i, imu)
        for sensing_settings, sensing in expand(spec, fields=SENSING)
        for i, part in enumerate(spec.imu)
        for imu_settings, imu in expand(part, prefix="imu.")
    ]
    for w, (world_settings, world, ride_index, ride) in enumerate(worlds):
        for track_draw in range(spec.track_draws):
            for k, (sensing_settings, sensing, imu_index, imu) in enumerate(sensings):
                together = world.model_copy(update={name: getattr(sensing, name) for name in SENSING})
                for sensor_draw in range(spec.sensor_draws):
                    yield Cell(
                        number=number,
                        case=w * len(sensings) + k,
                        ride_number=ride_number,
                        spec=together,
                        ride=ride,
                        imu=imu,
                        ride_index=ride_index,
                        imu_index=imu_index,
                        track_draw=track_draw,
                        sensor_draw=sensor_draw,
                        settings=world_settings | sensing_settings,
                    )
                    number += 1
            ride_number += 1


def count(scenario: Scenario) -> tuple[int, int]:
    """Return the numbers of rides to simulate and of cells, without listing them."""
    spec = scenario.spec
    rides = _size(spec, WORLD) * sum(_size(part) for part in spec.ride) * spec.track_draws
    sensings = _size(spec, SENSING) * sum(_size(part) for part in spec.imu)
    return rides, rides * sensings * spec.sensor_draws


def methods(scenario: Scenario) -> list[Method]:
    """Return the estimators of a scenario, one for each combination of their options' axes."""
    found = []
    for i, part in enumerate(scenario.spec.estimator):
        for settings, concrete in expand(part):
            options = {name.removeprefix("options."): value for name, value in settings.items()}
            variant = ",".join(f"{key}={value}" for key, value in options.items())
            name = f"{part.name}[{variant}]" if variant else part.name
            tuning = str(concrete.options.get("tuning", "default"))
            found.append(Method(name=name, tuning=tuning, part=concrete, index=i))
    return found


def _size(part: Any, fields: tuple[str, ...] | None = None) -> int:
    return prod(len(axis) for axis in axes_of(part, fields=fields).values())
