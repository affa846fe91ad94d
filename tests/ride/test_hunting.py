"""`simulate` warns of a speed at which the vehicle hunts, as the check of a scenario does."""

import warnings
from contextlib import nullcontext
from pathlib import Path

import pytest

from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride import hunting as ride_hunting
from simrail.ride import ride as ride_module
from simrail.ride.hunting import hunting_warning
from simrail.ride.ride import Ride, rails_of, simulate
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.vehicle import hunting
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

CRITICAL_MPS = 8.0


@pytest.fixture(autouse=True)
def own_caches(tmp_path, monkeypatch):
    monkeypatch.setattr(hunting, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)


@pytest.fixture(autouse=True)
def slow_hunter(monkeypatch):
    """A vehicle that hunts above 8 m/s, whatever it is."""
    monkeypatch.setattr(hunting, "critical_below", lambda _, top, **__: CRITICAL_MPS if top > 8.0 else None)


def ride_at(speed_mps, *, engine="compiled"):
    model = load(VehicleFile, "vehicle", "two_axle_wagon").model("two_axle_wagon")
    track, smooth = TrackDesign("line", 0.0, (Straight(100.0),)), Irregularity("none", (1.5, 100.0), 0.0)
    profile = SpeedProfile(20.0, 60.0, speed_mps, rest_s=0.1, acceleration_mps2=8.0, jerk_mps3=80.0)
    return Ride("fast", track, smooth, 0, model, profile, engine=engine)


def test_a_ride_that_reaches_the_critical_speed_is_warned_of_every_time():
    """Once for each call, in the words of the check; also where the ride is found in the cache."""
    ride = ride_at(9.0)
    for _ in range(2):
        with pytest.warns(UserWarning, match="ride fast reaches 32 km/h") as caught:
            simulate(ride)
        (warning,) = caught
        assert str(warning.message) == f"ride fast {hunting_warning(ride, rails_of(ride))}"
        assert "two_axle_wagon hunts above 29 km/h on these rails" in str(warning.message)
        assert warning.filename == __file__


def test_nothing_is_warned_of_below_it_or_where_it_is_not_wanted(monkeypatch):
    monkeypatch.setattr(ride_module, "load_truth", lambda place, *_, **__: place)
    monkeypatch.setattr(ride_cache, "places_of", lambda key: [Path(key)])
    monkeypatch.setattr(ride_cache, "new_ride", lambda *_, **__: nullcontext())
    for made in ("_drive", "_follow", "save_truth"):
        monkeypatch.setattr(ride_module, made, lambda *_, **__: None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(ride_at(7.9))
        simulate(ride_at(9.0), warn=False)
        simulate(ride_at(9.0, engine="kinematic"))


def test_the_rails_of_a_body_that_follows_them_are_not_laid_for_it(monkeypatch):
    monkeypatch.setattr(ride_hunting, "hunting_on", None)
    ride = ride_at(9.0, engine="kinematic")
    assert hunting_warning(ride, rails_of(ride)) == ""
