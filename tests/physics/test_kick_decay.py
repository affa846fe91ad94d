"""A small kick decays below the critical speed and grows above it, by riding."""

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.results import run
from simrail.ride.ride import Ride, simulate
from simrail.scoring.kick import decay_limit, score_kick
from simrail.track.defects import Defect
from simrail.track.design import TrackDesign
from simrail.track.elements import Straight
from simrail.track.irregularity import Irregularity
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.speed_profile import SpeedProfile
from simrail.vehicle.stability import critical_speed, root_locus

CRITICAL_MPS = 75.680
"""Closed form of the suspended wheelset with a conicity of 0.05 (tests/vehicle/test_linear.py)."""

KICK = Irregularity(
    "none", (1.5, 100.0), 0.0, defects=(Defect("dip", 320.0, 6.0, 2e-5, direction="lateral"),)
)


def growth_1ps(speed_mps):
    """Growth of the lateral motion of the suspended wheelset after a kick of 0.02 mm."""
    ride = Ride(
        name="kick",
        track=TrackDesign(name="straight", start_m=0.0, elements=(Straight(1200.0),)),
        irregularity=KICK,
        track_seed=1,
        vehicle=load(VehicleFile, "vehicle", "suspended_wheelset").model("suspended_wheelset"),
        profile=SpeedProfile(20.0, 1150.0, speed_mps, 10.0, 20.0, rest_s=0.5, final_rest_s=0.5),
        engine="compiled",
    )
    table = score_kick(simulate(ride), after_m=326.0)
    assert table["status"].tolist() == ["ok"]
    return float(table["value"][0])


def test_a_wheelset_ceases_to_recover_at_its_critical_speed():
    """Interpolated between 5 % below and above; growth is not quite linear in between."""
    growth = {factor * CRITICAL_MPS: growth_1ps(factor * CRITICAL_MPS) for factor in (0.95, 1.05)}
    assert decay_limit(growth) == pytest.approx(CRITICAL_MPS, rel=0.005)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_manchester_case_4_finds_the_critical_speed(tmp_path):
    """Of the run itself, within 3 % of what `simrail vehicle` prints (Exudyn: test_manchester_cases)."""
    results = run("manchester_cases", out=tmp_path / "out", overrides=["engine=compiled"])
    scores, cells = results.campaign.scores, results.campaign.cells
    rows = scores[scores["quantity"] == "lateral_growth"].merge(cells[["cell", "speed_kmh"]], on="cell")
    limit = decay_limit(dict(zip(rows["speed_kmh"], rows["value"], strict=True)))
    vehicle = running_vehicle(load(VehicleFile, "vehicle", "manchester_1").model("manchester_1"))
    expected = critical_speed(vehicle, root_locus(vehicle, np.arange(60.0, 80.0, 5.0))).speed_mps
    assert limit is not None
    assert limit / 3.6 == pytest.approx(expected, rel=0.03)
    safety = scores[(scores["quantity"] == "wheel_unloading") & (scores["metric"] == "max")]
    assert safety[safety["ride"] == "case_1"]["value"].max() < 1.0  # no wheel leaves its rail in the dip
