"""A ride above its vehicle's critical speed is warned of before it runs; slower ones are not.

The search for that speed, which takes seconds, is that of `tests/vehicle/test_hunting.py`.
"""

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


@pytest.fixture
def known(monkeypatch):
    """The critical speed is told, not searched for."""

    def critical_below(model, top_mps, *, gravity_mps2):
        assert model.name == "two_axle_wagon" and gravity_mps2 == 9.81
        return 212.0 / 3.6 if top_mps > 212.0 / 3.6 else None

    monkeypatch.setattr("simrail.vehicle.hunting.critical_below", critical_below)


@pytest.mark.parametrize("how", ["known", pytest.param("searched", marks=pytest.mark.slow)])
def test_a_speed_above_the_critical_one_is_warned_of(how, request):
    """212 km/h by the search of `simrail vehicle two_axle_wagon`."""
    if how == "known":
        request.getfixturevalue("known")
    (line,) = warnings("ride.speed_kmh=230.0")
    assert line.startswith("ride[0] (out) reaches 230 km/h: two_axle_wagon hunts above 21")
    assert "equivalent conicity 0." in line and "gauge 1435 mm" in line


@pytest.mark.usefixtures("known")
@pytest.mark.parametrize("settings", [["ride.speed_kmh=120.0"], ["ride.speed_kmh=230.0", "engine=kinematic"]])
def test_nothing_is_said_below_it_or_of_a_body_that_follows_the_rails(settings):
    assert warnings(*settings) == ()


@pytest.mark.usefixtures("known")
def test_what_counts_is_the_speed_that_is_reached():
    """On 360 m it is not the 230 km/h that are asked for."""
    (line,) = warnings("ride.speed_kmh=230.0", "ride.end_m=380.0")
    assert "reaches" in line and "of 230 km/h" in line and "hunts" not in line
