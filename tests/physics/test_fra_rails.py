"""A coach on the rails of every FRA track class, whose gauge the published form makes impossible."""

import pytest

from simrail.core.toml_files import load
from simrail.ride.ride import Ride, simulate
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.vehicle.engines.derailment import DerailedError
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

STRAIGHT = TrackDesign("straight", 0.0, (Straight(460.0),))
AT_20_KMH = SpeedProfile(30.0, 430.0, 20.0 / 3.6, rest_s=0.0, final_rest_s=0.0)


def coach_on(spectrum: str, seed: int) -> Ride:
    coach = load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")
    rough = Irregularity(spectrum, (1.5, 100.0), fade_m=40.0)
    return Ride("fra", STRAIGHT, rough, seed, coach, AT_20_KMH, engine="compiled")


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize("number", [1, 2, 3, 4, 5, 6])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_coach_runs_every_class_at_20_kmh(number: int, seed: int) -> None:
    truth = simulate(coach_on(f"fra_{number}", seed))
    assert truth.reference_position_m[-1] == pytest.approx(430.0, abs=0.01)


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_no_coach_runs_the_published_form_of_class_1() -> None:
    with pytest.raises(DerailedError):
        simulate(coach_on("fra_1_formula", 1))
