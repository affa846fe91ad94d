"""Rides of several runs: the train goes back without being turned, and everything after it works on it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.campaign import run_campaign
from simrail.core.toml_files import load, shipped
from simrail.ride import ride as ride_module
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Mount, Truth
from simrail.scenario.scenario import read_scenario
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import Restriction, Run, SpeedProfile

PROFILE = SpeedProfile(
    110.0,
    190.0,
    12.0,
    acceleration_mps2=0.8,
    jerk_mps3=0.8,
    rest_s=1.0,
    final_rest_s=2.0,
    runs=(Run(100.0, 3.0), Run(140.0, 3.0)),
    restrictions=(Restriction(150.0, 170.0, 6.0),),
)
RIDE = Ride(
    name="there and back",
    track=load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar"),
    irregularity=Irregularity("erri_b176_low", (3.0, 100.0), 20.0),
    track_seed=4,
    vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
    profile=PROFILE,
    engine="compiled",
)
MOUNT = Mount("axle", "front", (0.0, 0.0, 0.6))


@pytest.fixture(scope="module", params=["guide", "wheels"])
def truth(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Truth:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMRAIL_RIDES", str(tmp_path_factory.mktemp("rides")))
        return simulate(replace(RIDE, drive=request.param))


def test_the_vehicle_goes_where_it_is_driven(truth: Truth) -> None:
    place, speed, _ = PROFILE.motion(truth.time_s)
    motion = truth.motion(MOUNT)
    ahead = truth.bodies["front"].offset_m
    late = motion["position_m"].to_numpy() - ahead - place
    # The guide's spring stretches; a driver is a metre behind his profile, or beyond where he should stop.
    assert np.abs(late).max() < (0.05 if truth.manifest["drive"] == "guide" else 1.5)
    for way in (1.0, -1.0):
        goes = way * speed > 2.0
        assert goes.any() and np.all(way * motion["speed_mps"].to_numpy()[goes] > 1.0)
    assert abs(motion["speed_mps"].iloc[-1]) < 0.02


def test_wheels_turn_back(truth: Truth) -> None:
    rows = truth.turning_rows
    assert len(rows) == 4
    place = truth.motion(MOUNT)["position_m"].to_numpy()[rows]
    np.testing.assert_allclose(np.diff(place), [80.0, -90.0, 40.0], atol=2.0)
    for wheel in ("front.left", "front.right", "rear.left", "rear.right"):
        turned = np.diff(truth.wheel_angle(wheel)[rows]) * truth.wheel_radius_m[wheel]
        # Rolling: the two wheels of an axle share what the straight's conicity leaves of 1 %.
        np.testing.assert_allclose(turned, np.diff(place), rtol=0.01)
    assert truth.wheel_at("leading.left") == "front.left"
    assert replace(truth, reference_position_m=-truth.reference_position_m).wheel_at("leading.left") == (
        "rear.left"
    )


def test_velocity_integrates_to_position_over_all_runs(truth: Truth) -> None:
    motion = truth.motion(MOUNT, columns=("x_m", "y_m", "z_m", *(f"velocity_{c}_mps" for c in "xyz")))
    values = motion.to_numpy()
    # Simpson over pairs of steps.
    v = values[:, 3:]
    way = (v[:-2:2] + 4.0 * v[1:-1:2] + v[2::2]).sum(axis=0) / 3000.0
    last = (len(values) - 1) // 2 * 2
    np.testing.assert_allclose(values[last, :3] - values[0, :3], way, atol=2e-6)


def test_gauge_and_reach_are_those_of_all_runs() -> None:
    assert PROFILE.reach_m == (100.0, 190.0)
    assert ride_module.rails_of(RIDE).design is RIDE.track


def scenario_text(runs: str) -> str:
    text = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
    text = text.replace("end_m = 590.0\n", runs).replace("sensor_draws = 2", "sensor_draws = 1")
    text = text.replace('["lord_3dm_gx4_25", "ideal"]', '"lord_3dm_gx4_25"')
    odometry = 'odometry = ["encoder", "curve_matched", "curve_smoothed"]\n'
    return text.replace("[monte_carlo]", odometry + "\n[monte_carlo]", 1)


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> tuple[pd.DataFrame, pd.DataFrame]:
    runs = "runs = [{ end_m = 590.0, turn_s = 20.0 }, { end_m = 20.0, turn_s = 20.0 }, { end_m = 300.0 }]\n"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMRAIL_RIDES", str(tmp_path_factory.mktemp("rides")))
        result = run_campaign(read_scenario(scenario_text(runs), name="turned", folder=Path.cwd()), workers=1)
    assert not result.failures
    return result.scores, result.cells


def rms(scores: pd.DataFrame, **labels: str) -> float:
    wanted = {"metric": "rms", "window": "whole", "reference": "truth", "band": "full"} | labels
    rows = scores[np.logical_and.reduce([scores[name] == value for name, value in wanted.items()])]
    assert len(rows) == 1, wanted
    return float(rows["value"].iloc[0])


@pytest.mark.long
def test_a_scenario_of_runs_is_estimated_and_scored(turned: tuple[pd.DataFrame, pd.DataFrame]) -> None:
    scores, cells = turned
    assert set(cells["direction"]) == {"both ways"}
    found = {
        name: rms(
            scores, estimator=f"odometry:{name}", imu="lord_3dm_gx4_25", quantity="position", odometry=name
        )
        for name in ("encoder", "curve_matched", "curve_smoothed")
    }
    # 1440 m by a wheel whose radius is known to 0.1 %: what the way there brings, the way back takes.
    assert found["encoder"] < 3.0
    assert found["curve_matched"] < 1.0 and found["curve_smoothed"] < 1.0
    for name in found:
        labels = {"imu": "lord_3dm_gx4_25", "odometry": name}
        assert rms(scores, estimator=f"odometry:{name}", quantity="speed", **labels) < 0.1
        roll = rms(scores, estimator="ekf_compensated", quantity="roll", **labels)
        assert roll < 0.5
