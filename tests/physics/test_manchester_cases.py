"""The four cases after the Manchester benchmark: their rails, and the speed at which a kick grows."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.ride.abeam import abeam
from simrail.ride.ride import Ride, rails_of, simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.stability import critical_speed, root_locus


@cache
def rides(*overrides: str) -> tuple[Ride, ...]:
    scenario = load_scenario("manchester_cases", overrides=["engine=compiled", *overrides])
    parts = Parts(scenario)
    return tuple({id(ride): ride for ride in map(parts.ride, cells(scenario))}.values())


def test_each_case_has_its_rails() -> None:
    one, two, three, *four = rides()
    laid = rails_of(one)
    # The outer rail of the left curve is the right one: 20 mm in the middle of 6 m, half of it a quarter on.
    assert laid.rails([171.5, 173.0, 176.0])[:, 3] == pytest.approx([-0.010, -0.020, 0.0], abs=1e-6)
    assert not laid.rails([171.5, 173.0])[:, :3].any()
    # Both rails go 5 mm outward over 5 m, and stay for 200 m.
    assert laid.rails([699.9, 702.5, 705.0, 905.0, 910.1])[:, 0] == pytest.approx(
        [0, -0.0025, -0.005, -0.005, 0], abs=1e-6
    )
    kick = laid.rails(np.arange(18250.0, 18260.0, 0.5))
    assert kick[:, 0].min() == pytest.approx(-2e-5, abs=1e-8)
    # Irregular track lies under all of the third ride at speed, and under no other.
    rough = laid.irregularities(np.arange(1500.0, 16800.0, 5.0)).to_numpy()
    assert (rough.std(axis=0) > 2e-4).all()
    assert (
        np.abs(laid.rails(np.concatenate([np.arange(0.0, 170.0), np.arange(17000.0, 18249.0)]))).max() < 1e-9
    )
    times = np.arange(0.0, three.profile.duration_s, 0.5)
    s, v, _ = three.profile.motion(times)
    at_speed = v > 160.0 / 3.6 - 1e-6
    assert at_speed.sum() * 0.5 >= 300.0
    assert s[at_speed].min() > 1440.0 and s[at_speed].max() < 16860.0
    assert (two.profile.speed_mps, len(four)) == (pytest.approx(100.0 / 3.6), 3)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize("engine", ["compiled", "exudyn"])
def test_a_kick_decays_below_the_critical_speed_and_grows_above_within_3_percent(engine: str) -> None:
    coach = running_vehicle(load(VehicleFile, "vehicle", "manchester_1").model("manchester_1"))
    critical = critical_speed(coach, root_locus(coach, np.arange(60.0, 90.0, 5.0))).speed_mps
    assert critical is not None
    for factor in (0.97, 1.03):
        (ride,) = [
            ride
            for ride in rides(f"engine={engine}", f"ride.case_4.speed_kmh={factor * 3.6 * critical:.3f}")
            if ride.name == "case_4"
        ]
        truth = simulate(ride)
        place = truth.reference_position_m
        lateral = abeam(ride.track, place + 10.78, truth.bodies["axle_f1"].position)[2][:, 1]
        sizes = [np.ptp(lateral[(place > low) & (place < low + 100.0)]) for low in (18265.0, 19050.0)]
        assert (sizes[1] > 1.1 * sizes[0]) == (factor > 1.0)
        assert (sizes[1] < sizes[0] / 1.1) == (factor < 1.0)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_the_coach_stays_on_the_rails_in_the_dip_and_on_the_ramp() -> None:
    for ride in rides()[:2]:
        assert simulate(ride).reference_position_m[-1] == pytest.approx(ride.profile.end_m, abs=0.01)
