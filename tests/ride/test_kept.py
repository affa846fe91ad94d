"""Of a long ride only what was asked for is kept: the same motion, in less room."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simrail.core.columns import ATTITUDE, CONTACT, IMU, ODOMETRY, POSITION
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Kept, Ride, rails_of, simulate
from simrail.ride.truth import Mount, Truth
from simrail.ride.truth_rows import TruthRows
from simrail.scenario import build
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario, read_scenario
from simrail.scoring.ride_figures import axles_of
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

RIDE = Ride(
    name="short",
    track=load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar"),
    irregularity=Irregularity("erri_b176_low", (3.0, 100.0), 20.0),
    track_seed=4,
    vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
    profile=SpeedProfile(240.0, 170.0, 12.0, rest_s=1.0, final_rest_s=2.0),
    engine="compiled",
    contact_rate_hz=200.0,
)
MOUNT = Mount("imu", "front", (0.1, 0.0, 0.6))


@pytest.fixture(scope="module")
def rides(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Truth, Truth]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMRAIL_RIDES", str(tmp_path_factory.mktemp("rides")))
        whole = simulate(RIDE)
        full_bytes = ride_cache.rides()[0].size_bytes
        kept = simulate(replace(RIDE, kept=Kept(("front",), ("rear.left",))))
        assert ride_cache.rides()[0].size_bytes < 0.35 * full_bytes
        yield whole, kept


def test_what_is_kept_is_that_of_the_whole_ride(rides: tuple[Truth, Truth]) -> None:
    whole, kept = rides
    assert kept.body_names == ["front"] and kept.wheel_names == ["rear.left"] and not kept.wheel_states
    np.testing.assert_array_equal(kept.wheel_angle("rear.left"), whole.wheel_angle("rear.left"))
    ours, full = kept.motion(MOUNT), whole.motion(MOUNT)
    exact = [*POSITION, *ATTITUDE, "position_m", "lateral_m", "vertical_m"]
    assert ours[exact].equals(full[exact])
    # Single precision: 2^-24 of each value; accelerations of an axle are some m/s2, rates some rad/s.
    unit = 2.0**-24
    for columns in (IMU, ODOMETRY[1:]):
        off = np.abs(ours[list(columns)].to_numpy() - full[list(columns)].to_numpy())
        assert 0.0 < off.max() < 40.0 * unit


def test_contacts_are_kept_of_every_wheel(rides: tuple[Truth, Truth]) -> None:
    whole, kept = rides
    for wheel in whole.wheel_names:
        assert kept.contact(wheel).equals(whole.contact(wheel))
    assert kept.contacts["front.left"].shape[1] == len(CONTACT)
    # Running safety is that of every axle by both of its wheels.
    for ours, full in zip(axles_of(kept, RIDE.vehicle), axles_of(whole, RIDE.vehicle), strict=True):
        assert ours.series.wheels == full.series.wheels and len(full.series.wheels) == 2
        np.testing.assert_array_equal(ours.series.guiding_force_n, full.series.guiding_force_n)


def test_wheels_are_named_by_their_place_as_before(rides: tuple[Truth, Truth]) -> None:
    whole, kept = rides
    # It runs backwards: the rear axle leads.
    assert kept.wheel_at("leading.left") == whole.wheel_at("leading.left") == "rear.left"
    assert RIDE.vehicle.wheel_at("leading.left", direction=-1) == "rear.left"
    assert RIDE.vehicle.wheel_at("trailing.right", direction=-1) == "front.right"
    assert RIDE.vehicle.wheel_at("front.left", direction=-1) == "front.left"


def test_what_is_not_kept_is_told(rides: tuple[Truth, Truth]) -> None:
    _, kept = rides
    with pytest.raises(InputError, match="no such body"):
        kept.motion(Mount("imu", "rear", (0.0, 0.0, 0.6)))
    with pytest.raises(InputError, match="no such wheel"):
        kept.wheel_angle("front.left")


def test_a_scenario_keeps_of_a_long_ride_what_it_asks_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one that may shake, the angle of every wheel as well."""
    shaking = load_scenario("go20a")
    text = re.sub(r"(?ms)^\[vibration\].*?\n\n", "", shaking.text)
    silent = read_scenario(text, name="go20a")
    for scenario, wheels in ((silent, ("rear.left",)), (shaking, tuple(sorted(RIDE.vehicle.wheel_names)))):
        cell = next(iter(cells(scenario)))
        monkeypatch.setattr(build, "LONG_RIDE_S", 1000.0)
        assert Parts(scenario).ride(cell).kept is None
        monkeypatch.setattr(build, "LONG_RIDE_S", 100.0)
        assert Parts(scenario).ride(cell).kept == Kept(("front",), wheels)


def test_wheel_angles_do_not_feel_where_segments_end(tmp_path: Path) -> None:
    """The boxes' pitch is integrated over the joints of segments, too; only sums are taken in other order."""
    setup = Setup(RIDE.vehicle, rails_of(RIDE), RIDE.profile, step_s=RIDE.step_s, rate_hz=RIDE.rate_hz)
    angles = []
    for segment_s in (5.0, 0.01):
        rows = TruthRows(RIDE, tmp_path / str(segment_s))
        for segment in CompiledEngine(setup).run(rows.duration_s, segment_s=segment_s):
            rows.add(segment)
        rows.finish()
        angles.append(np.load(tmp_path / str(segment_s) / "wheel_0.npy"))
    np.testing.assert_allclose(angles[1], angles[0], rtol=0, atol=1e-12 * np.abs(angles[0]).max())


@pytest.mark.long
def test_a_long_ride_that_shakes_is_that_of_the_whole(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Wheels out of round ask for the angle of every wheel; of what is kept the short waves are the same."""
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path))
    overrides = ["vibration={}", "engine=compiled", "ride.end_m=50.0", "ride.rest_s=1.0", "map.exact=true"]
    scenario = load_scenario("go20a", overrides=overrides)
    cell = next(iter(cells(scenario)))
    whole = simulate(Parts(scenario).ride(cell))
    monkeypatch.setattr(build, "LONG_RIDE_S", 1.0)
    ride = Parts(scenario).ride(cell)
    assert ride.kept is not None and ride.kept.bodies == ("front",)
    kept = simulate(ride)
    assert whole.short_waves is not None and kept.short_waves is not None
    assert list(kept.short_waves.motions) == ["front"]
    np.testing.assert_array_equal(kept.short_waves.motions["front"], whole.short_waves.motions["front"])
    assert kept.short_waves.least_share_of_load == whole.short_waves.least_share_of_load
