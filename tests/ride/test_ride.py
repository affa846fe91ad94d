"""Rides and their cache: simulated once, found again, never half there, never in the way of another."""

import os
from dataclasses import fields, replace

import numpy as np
import pytest

from simrail.core.columns import CONTACT
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride import ride as ride_module
from simrail.ride.ride import Kept, Ride, is_cached, simulate
from simrail.ride.truth import Mount
from simrail.ride.truth_files import load_truth, save_truth
from simrail.ride.vibration.sources import Vibration
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.rail_condition import RailCondition
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    return tmp_path / "rides"


@pytest.fixture
def ride():
    return Ride(
        name="short",
        track=load(TrackFile, "track", "smooth_curve").design("smooth_curve"),
        irregularity=Irregularity("erri_b176_low", (3.0, 100.0), 20.0),
        track_seed=4,
        vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
        profile=SpeedProfile(30.0, 90.0, 10.0, rest_s=1.0, final_rest_s=0.5),
        engine="kinematic",
    )


def all_arrays(truth):
    yield truth.time_s
    yield truth.reference_position_m
    for body in truth.bodies.values():
        yield from (body.position, body.velocity, body.acceleration, body.angles, body.rate)
        yield body.angular_acceleration
    yield from truth.wheel_angles.values()
    yield from truth.contacts.values()


def assert_same(one, other):
    for a, b in zip(all_arrays(one), all_arrays(other), strict=True):
        np.testing.assert_array_equal(a, b)


def test_simulated_once_then_found(ride, monkeypatch):
    assert not is_cached(ride)
    first = simulate(ride)
    assert is_cached(ride)
    monkeypatch.setattr(ride_module, "_follow", lambda ride: pytest.fail("simulated again"))
    assert_same(simulate(ride), first)


@pytest.mark.parametrize(
    "change",
    [
        {"track_seed": 5},
        {"step_s": 0.25e-3},
        {"rate_hz": 500.0},
        {"gravity_mps2": 9.80665},
        {"engine": "exudyn"},
        {"engine": "compiled"},
        {"irregularity": Irregularity("erri_b176_high", (3.0, 100.0), 20.0)},
        {"profile": SpeedProfile(30.0, 90.0, 11.0, rest_s=1.0, final_rest_s=0.5)},
        {"drive": "wheels"},
        {"contact_rate_hz": 100.0},
        {"conditions": (RailCondition(40.0, 60.0, 0.2),)},
        {"kept": Kept(("body",), ("front.left",))},
        {"vibration": Vibration()},
    ],
    ids=lambda change: next(iter(change)),
)
def test_key_covers_what_the_truth_depends_on(ride, change):
    assert ride_cache.key_of(ride.describe()) != ride_cache.key_of(replace(ride, **change).describe())


def test_key_covers_vehicle_and_sources(ride, monkeypatch):
    key = ride_cache.key_of(ride.describe())
    bodies = (replace(ride.vehicle.bodies[0], mass_kg=1051.0), *ride.vehicle.bodies[1:])
    heavier = replace(ride, vehicle=replace(ride.vehicle, bodies=bodies))
    assert ride_cache.key_of(heavier.describe()) != key
    for what, other in (
        ("source_hash", lambda *names: "other code"),
        ("_versions", lambda: (("numpy", "another"),)),
        ("profiles_digest", lambda wheel_rail: "another file of a profile"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(ride_module, what, other)
            assert ride_cache.key_of(ride.describe()) != key
    assert ride_cache.key_of(ride.describe()) == key


def test_no_setting_of_a_ride_is_left_out_of_its_key(ride):
    """Not the name, by which no wheel turns otherwise."""
    shaken = replace(ride, vibration=Vibration()).describe()
    assert {one.name for one in fields(Ride)} - {"name"} <= set(shaken)
    assert "vibration_sources" in shaken


def test_interrupted_simulation_leaves_no_ride(ride, own_cache, monkeypatch):
    def interrupted(truth, folder):
        folder.mkdir(parents=True)
        (folder / "time_s.npy").write_bytes(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(ride_module, "save_truth", interrupted)
    with pytest.raises(KeyboardInterrupt):
        simulate(ride)
    assert not is_cached(ride)
    assert list(own_cache.iterdir()) == []


@pytest.mark.parametrize("damage", ["truncated array", "missing array", "broken header", "one bit"])
def test_damaged_ride_is_made_again(ride, own_cache, damage):
    first = simulate(ride)
    kept = [np.array(array) for array in all_arrays(first)]
    place = own_cache / ride_cache.key_of(ride.describe())
    if damage == "truncated array":
        with (place / "body_1.npy").open("r+b") as file:
            file.truncate(1000)
    elif damage == "missing array":
        (place / "wheel_0.npy").unlink()
    elif damage == "one bit":
        content = bytearray((place / "body_1.npy").read_bytes())
        content[len(content) // 2] ^= 1
        (place / "body_1.npy").write_bytes(content)
    else:
        (place / "truth.json").write_text("{")
    told = []
    again = simulate(ride, told=told.append)
    for array, expected in zip(all_arrays(again), kept, strict=True):
        np.testing.assert_array_equal(array, expected)
    assert len(told) == 1 and "damaged" in told[0] and "\n" not in told[0]
    assert [path.name for path in own_cache.iterdir()] == [place.name]
    simulate(ride, told=told.append)
    assert len(told) == 1


def test_oldest_rides_make_room(ride, own_cache, monkeypatch):
    rides = [replace(ride, track_seed=seed) for seed in range(3)]
    for age, one in enumerate(rides[:2]):
        simulate(one)
        header = own_cache / ride_cache.key_of(one.describe()) / "truth.json"
        os.utime(header, (1000.0 + age, 1000.0 + age))
    size = ride_cache.rides()[0].size_bytes
    monkeypatch.setenv("SIMRAIL_CACHE_GB", str(2.5 * size / 1e9))
    simulate(rides[2])
    assert [is_cached(one) for one in rides] == [False, True, True]


def test_a_ride_that_is_found_again_is_not_the_one_to_go(ride, own_cache, monkeypatch):
    rides = [replace(ride, track_seed=seed) for seed in range(3)]
    for one in rides[:2]:
        simulate(one)
        os.utime(own_cache / ride_cache.key_of(one.describe()) / "truth.json", (1000.0, 1000.0))
    simulate(rides[0])
    size = ride_cache.rides()[0].size_bytes
    monkeypatch.setenv("SIMRAIL_CACHE_GB", str(2.5 * size / 1e9))
    simulate(rides[2])
    assert [is_cached(one) for one in rides] == [True, False, True]


def test_the_same_ride_of_a_faster_process_stays_and_a_fault_of_the_disk_is_raised(own_cache, monkeypatch):
    with ride_cache.new_ride("fast") as draft:
        draft.mkdir(parents=True)
        (draft / "body").write_text("mine")
        (own_cache / "fast").mkdir()
        (own_cache / "fast" / "body").write_text("theirs")
    assert (own_cache / "fast" / "body").read_text() == "theirs"

    def broken(self, target):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(type(own_cache), "replace", broken)
    with pytest.raises(OSError, match="Input/output"), ride_cache.new_ride("slow") as draft:
        draft.mkdir()
        (draft / "body").write_text("mine")
    assert [one.name for one in own_cache.iterdir()] == ["fast"], "no draft is left"


def test_clear_frees_everything(ride):
    simulate(ride)
    size = sum(found.size_bytes for found in ride_cache.rides())
    assert ride_cache.clear() == size
    assert ride_cache.rides() == []


def test_truth_survives_the_disk_bit_by_bit(ride, tmp_path):
    truth = simulate(ride)
    save_truth(truth, tmp_path / "copy")
    copy = load_truth(tmp_path / "copy")
    assert_same(copy, truth)
    assert copy.manifest == truth.manifest
    mount = Mount("imu", "frame", (0.2, 0.1, 0.5))
    assert copy.motion(mount).equals(truth.motion(mount))


def test_place_in_the_direction_of_travel(ride):
    truth = simulate(ride)
    assert truth.wheel_at("leading.left") == "front.left"
    assert truth.wheel_at("trailing.right") == "rear.right"
    assert truth.wheel_at("front.left") == "front.left"
    back = simulate(replace(ride, profile=SpeedProfile(90.0, 30.0, 10.0)))
    assert back.wheel_at("leading.left") == "rear.left"


def test_wheels_over_leaves_are_late_and_the_truth_knows_where(ride):
    """The reference point is where the vehicle is, metres behind the profile: the mount's s, to 1 mm."""
    late = replace(
        ride,
        engine="compiled",
        drive="wheels",
        conditions=(RailCondition(20.0, 80.0, 0.05 / 0.3),),
        profile=SpeedProfile(30.0, 90.0, 10.0, rest_s=1.0, final_rest_s=0.5, acceleration_mps2=1.2),
    )
    truth = simulate(late)
    planned = late.profile.motion(truth.time_s)[0]
    assert np.max(planned - truth.reference_position_m) > 3.0
    there = truth.motion(Mount("body", "body", (0.0, 0.0, 1.45)))["position_m"].to_numpy()
    np.testing.assert_allclose(truth.reference_position_m, there, rtol=0.0, atol=1e-3)
    assert truth.manifest["drive"] == "wheels"
    assert truth.manifest["conditions"][0]["start_m"] == 20.0


BRISK = SpeedProfile(30.0, 60.0, 10.0, rest_s=0.3, final_rest_s=0.2, acceleration_mps2=3.0, jerk_mps3=20.0)


@pytest.fixture
def driven(ride):
    return replace(ride, engine="compiled", profile=BRISK, contact_rate_hz=1000.0)


def test_contact_is_kept_at_the_rate_that_is_asked_for(driven, tmp_path):
    """Every n-th row of what is kept at the output rate, bit by bit, over the segments of the engine, too."""
    whole = simulate(driven)
    assert len(whole.time_s) > 5000  # a segment of the engine
    for rate_hz, every in ((250.0, 4), (1000.0 / 7.0, 7)):
        some = simulate(replace(driven, contact_rate_hz=rate_hz))
        for wheel in whole.wheel_names:
            expected, kept = whole.contact(wheel).iloc[::every], some.contact(wheel)
            assert kept.equals(expected) and list(kept.columns) == list(CONTACT)
    save_truth(some, tmp_path / "copy")
    copy = load_truth(tmp_path / "copy")
    assert_same(copy, some)
    assert copy.contact("rear.left").equals(some.contact("rear.left"))


def test_the_motion_does_not_depend_on_what_is_kept(driven):
    kept, bare = simulate(driven), simulate(replace(driven, contact_rate_hz=0.0))
    assert kept.manifest["contact"] == bare.manifest["contact"]
    assert not bare.contacts
    assert_same(replace(kept, contacts={}), bare)


def test_wheels_of_the_contact_are_where_they_are(driven):
    """A wheel's place is that of its axle, as its motion says it."""
    truth = simulate(driven)
    for axle in ("front", "rear"):
        mount = Mount("centre", axle, (0.0, 0.0, truth.bodies[axle].height_m))
        there = truth.motion(mount)["position_m"].to_numpy()
        for side in ("left", "right"):
            place = truth.contact(f"{axle}.{side}")["position_m"].to_numpy()
            np.testing.assert_allclose(place, there, rtol=0.0, atol=1e-6)
    assert truth.contact("leading.left").equals(truth.contact("front.left"))
    static = driven.vehicle.wheel_load_n(9.81)
    for wheel, load_n in zip(truth.wheel_names, static, strict=True):
        assert truth.contact(wheel)["wheel_load_n"].mean() == pytest.approx(load_n, rel=0.03)


def test_extremes_of_a_ride_are_those_of_its_rows(driven):
    truth = simulate(driven)
    load = np.column_stack([truth.contact(wheel)["wheel_load_n"] for wheel in truth.wheel_names])
    said = truth.manifest["contact"]
    assert said["greatest_q_n"]["value"] == load.max()
    assert said["smallest_q_over_q0"]["value"] == (load / driven.vehicle.wheel_load_n(9.81)).min()
    manifest = truth.manifest
    assert manifest["warnings"] == [] and manifest["setup_s"] > 0.0
    assert manifest["simulated_s"] == pytest.approx(truth.time_s[-1], abs=1e-9)
    assert manifest["real_time_factor"] == manifest["simulated_s"] / manifest["wall_s"]


def test_contact_that_was_not_kept_is_said_with_the_remedy(ride):
    truth = simulate(ride)
    with pytest.raises(InputError, match=r"contact_rate_hz: this ride kept no forces.*set contact_rate_hz"):
        truth.contact("front.left")
    with pytest.raises(InputError, match=r"no such wheel; found 'third'; limit: front.left"):
        truth.contact("third")
