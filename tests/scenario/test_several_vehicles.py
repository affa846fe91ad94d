"""One scenario on several vehicles whose bodies have other names: each IMU names the one that it is on."""

import pytest

from simrail.core.errors import InputError
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells, count, first_cells
from simrail.scenario.scenario import Scenario, load_scenario, read_scenario

TEXT = """
title = "several"
seed = 1
track = "condequinto_olivar"
vehicle = ["metro_irw_bogie", "manchester_1"]
engine = "compiled"
odometry = "truth"
[monte_carlo]
track_draws = 2
sensor_draws = 3
[[ride]]
name = "r"
start_m = 20.0
end_m = 60.0
speed_kmh = 20.0
[[estimator]]
name = "design"
method = "DesignAngles"
"""
IMU = """
[[imu]]
name = "{name}"
grade = ["lord_3dm_gx4_25", "tactical"]
{vehicle}body = "{body}"
position_m = [0.0, 0.0, 0.6]
"""


def imu(body: str, vehicle: str = "", name: str = "axle") -> str:
    return IMU.format(body=body, name=name, vehicle=f'vehicle = "{vehicle}"\n' if vehicle else "")


def scenario(*imus: str) -> Scenario:
    return read_scenario(TEXT + "".join(imus), name="several")


def test_each_imu_is_on_its_own_vehicle():
    """Two grades, three draws of the sensors, two tracks: an axle on both, a frame on one, a body on all."""
    spec = scenario(
        imu("front", "metro_irw_bogie"),
        imu("axle_f1", "manchester_1"),
        imu("frame", "metro_irw_bogie", name="frame"),
        imu("body", name="body"),
    )
    found = list(cells(spec))
    assert count(spec) == (4, len(found)) == (4, 2 * 2 * 3 * (3 + 2))
    assert [cell.number for cell in found] == list(range(len(found)))
    for cell in found:
        assert cell.imu.vehicle in (None, cell.spec.vehicle)
    on_axles = {(cell.spec.vehicle, cell.imu.body) for cell in found if cell.imu.name == "axle"}
    assert on_axles == {("metro_irw_bogie", "front"), ("manchester_1", "axle_f1")}
    numbers = {cell.number: cell for cell in found}
    for cell in first_cells(spec):
        assert numbers[cell.number].imu == cell.imu
        Parts(spec).resolve(cell)


@pytest.mark.parametrize(
    ("imus", "words"),
    [
        ([imu("front", "metro_irw_bogie")], ["no imu is on", "manchester_1"]),
        ([imu("front"), imu("x", "irw_car", "b")], ["imu[1].vehicle", "irw_car", "one of metro_irw_bogie"]),
        ([imu("body"), imu("frame", "manchester_1")], ["two of them are named 'axle'"]),
        ([imu("body"), imu("body")], ["two of them are named 'axle'"]),
    ],
)
def test_wrong_vehicles_are_refused(imus: list[str], words: list[str]):
    with pytest.raises(InputError) as caught:
        scenario(*imus)
    for word in words:
        assert word in str(caught.value)


def test_the_shipped_one_resolves():
    """Every mount of `odometry` is on a body that its vehicle has."""
    spec = load_scenario("odometry")
    parts = Parts(spec)
    mounts = {(cell.spec.vehicle, parts.resolve(cell).mount.name) for cell in first_cells(spec)}
    assert len(mounts) == 17
