"""A ride above its vehicle's critical speed is warned of before it runs; slower ones are not."""

import pytest

from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario

FAST = [
    "track=level_straight",
    "vehicle=two_axle_wagon",
    "engine=compiled",
    "imu.body=body",
    "encoder.wheel=leading.left",
    "ride.start_m=20.0",
    "ride.end_m=1980.0",
    "ride.acceleration_mps2=3.0",
    "ride.jerk_mps3=3.0",
]


def warnings(*settings):
    return judge_scenario(load_scenario("quick_kinematic", overrides=[*FAST, *settings])).warnings


def test_a_speed_above_the_critical_one_is_warned_of():
    """212 km/h by the search of `simrail vehicle two_axle_wagon`."""
    (line,) = warnings("ride.speed_kmh=230.0")
    assert line.startswith("ride[0] (out) reaches 230 km/h: two_axle_wagon hunts above 21")
    assert "equivalent conicity 0." in line and "gauge 1435 mm" in line


@pytest.mark.parametrize("settings", [["ride.speed_kmh=120.0"], ["ride.speed_kmh=230.0", "engine=kinematic"]])
def test_nothing_is_said_below_it_or_of_a_body_that_follows_the_rails(settings):
    assert warnings(*settings) == ()


def test_what_counts_is_the_speed_that_is_reached():
    """On 360 m it is not the 230 km/h that are asked for."""
    (line,) = warnings("ride.speed_kmh=230.0", "ride.end_m=380.0")
    assert "reaches" in line and "of 230 km/h" in line and "hunts" not in line
