"""Two engines, one vehicle, one track, one step: the same motion, so each is the proof of the other."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import simrail.scenarios
from wheel_loads import wheel_loads_n

from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import load
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.track.rail_condition import RailCondition
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

pytestmark = pytest.mark.long

ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
BRISK = {"rest_s": 0.3, "final_rest_s": 0.5, "acceleration_mps2": 2.0, "jerk_mps3": 4.0}
FIELDS = ("time_s", "position", "rotation", "acceleration", "angular_acceleration", "spin_rad", "states")
VEHICLES = sorted(file.stem for file in (Path(simrail.scenarios.__file__).parent / "vehicles").glob("*.toml"))


def run(
    engine,
    vehicle,
    track,
    profile,
    *,
    duration_s,
    rough=ROUGH,
    step_s=0.5e-3,
    conditions=(),
    drive="guide",
    law=None,
):
    model = load(VehicleFile, "vehicle", vehicle).model(vehicle)
    if law is not None:
        model = replace(model, wheel_rail=replace(model.wheel_rail, creep=CreepLaw(law)))
    laid = lay(load(TrackFile, "track", track).design(track), rough, seed=1, conditions=conditions)
    solver = engine(Setup(model, laid, profile, settle_s=1.0, step_s=step_s, drive=drive))
    segments = list(solver.run(duration_s, segment_s=3.0))
    joined = {name: np.concatenate([getattr(part, name) for part in segments]) for name in FIELDS}
    return SimpleNamespace(**joined, loads_n=wheel_loads_n(solver), model=model, laid=laid)


def both(vehicle, track, profile, *, duration_s=None, **options):
    duration_s = duration_s or np.floor(profile.duration_s * 1000.0) / 1000.0
    engines = (CompiledEngine, ExudynEngine)
    return tuple(run(engine, vehicle, track, profile, duration_s=duration_s, **options) for engine in engines)


def rms(difference):
    """Over the rows and axes, the worst body."""
    return float(np.sqrt(np.mean(difference**2, axis=(0, 2))).max())


def lateral_shift_m(ride, body):
    """Greatest distance of an axle's centre from the centre between the rails, in the canted track frame."""
    design, position = ride.laid.design, ride.position[::50, body]
    s = np.linspace(design.start_m, design.end_m, 20001)
    frame = design.frame(s)
    nearest = np.array([np.argmin(np.sum((frame.position[:, :2] - p[:2]) ** 2, axis=1)) for p in position])
    angles = np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad])[nearest]
    left = rotation_matrix(angles)[:, :, 1]
    rails = ride.laid.rails(s[nearest])
    across = np.sum((position - frame.position[nearest]) * left, axis=1)
    return float(np.abs(across - 0.5 * (rails[:, 0] + rails[:, 2])).max())


SCALE_ROUGH = Irregularity("erri_b176_low", (0.3, 7.0), 3.0, 0.65)
SCALE_RIDE = SpeedProfile(18.0, 40.0, 1.0, rest_s=0.3, final_rest_s=0.3, acceleration_mps2=0.8, jerk_mps3=4.0)
SCALE_STEP_S = 0.125e-3

FLANGE_M = 6e-3
"""Shift from which S1002 on 60E1 at 1435 mm touches with its flange (root: from 5 mm on)."""

RIDES = {
    "there, a stop between": SpeedProfile(120.0, 180.0, 12.0, stops=((150.0, 0.5),), **BRISK),
    "and back": SpeedProfile(180.0, 120.0, 12.0, **BRISK),
}


@pytest.mark.parametrize("profile", RIDES.values(), ids=RIDES)
def test_on_the_tread_in_an_irregular_curve(profile):
    """1e-6 m/s2 rms (1e-6 rad/s2) at the same 0.5 ms, start, stop and standstill included; each way."""
    compiled, exudyn = both("metro_irw_bogie", "smooth_curve", profile)
    np.testing.assert_array_equal(compiled.time_s, exudyn.time_s)
    assert rms(exudyn.acceleration) > 0.05
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-6
    assert rms(compiled.angular_acceleration - exudyn.angular_acceleration) < 1e-6
    np.testing.assert_allclose(compiled.position, exudyn.position, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(compiled.rotation, exudyn.rotation, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(compiled.spin_rad, exudyn.spin_rad, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(compiled.states, exudyn.states, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(compiled.loads_n, exudyn.loads_n, rtol=1e-5)


# One wheel of a conventional wheelset does not slide while the other holds.
@pytest.mark.parametrize(
    ("vehicle", "rails"),
    [("metro_irw_bogie", "left"), pytest.param("metro_car_gz18", "both", marks=pytest.mark.slow)],
)
def test_driven_and_braked_by_the_wheels_over_leaves(vehicle, rails):
    """1e-6 m/s2 rms from a start that spins to a stop that slides, on irregular rails, off the flange."""
    profile = SpeedProfile(120.0, 160.0, 6.0, **BRISK)
    leaves = (RailCondition(105.0, 134.0, 0.05 / 0.3), RailCondition(139.0, 170.0, 0.05 / 0.3, rails))
    compiled, exudyn = both(vehicle, "level_straight", profile, conditions=leaves, drive="wheels")
    slip = np.diff(exudyn.spin_rad[:, 0] * exudyn.model.wheels[0].radius_m - exudyn.position[:, 0, 0])
    assert slip.max() > 0.1e-3  # more than 0.1 m/s
    assert slip.min() < -0.1e-3
    assert max(lateral_shift_m(exudyn, i) for i in range(2)) < FLANGE_M
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-6
    assert rms(compiled.angular_acceleration - exudyn.angular_acceleration) < 1e-6
    np.testing.assert_allclose(compiled.states, exudyn.states, rtol=0.0, atol=1e-5)


def test_with_flange_contact():
    """1e-4 m/s2 rms in the sharp curve, where the outer wheel runs on its flange root."""
    profile = SpeedProfile(370.0, 450.0, 40.0 / 3.6, **BRISK)
    compiled, exudyn = both("metro_irw_bogie", "condequinto_olivar", profile)
    assert lateral_shift_m(exudyn, 0) > 5e-3
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-4


def test_a_scale_vehicle_in_its_curve():
    """1e-6 m/s2 rms with axles that swing on their rails at 1.3 kHz, at the step that this needs."""
    profile = replace(SCALE_RIDE, start_m=27.0, end_m=29.0)
    compiled, exudyn = both(
        "scale_vehicle", "scale_track", profile, duration_s=2.0, rough=SCALE_ROUGH, step_s=SCALE_STEP_S
    )
    assert rms(exudyn.acceleration) > 0.05
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-6


@pytest.mark.parametrize("vehicle", ["metro_car_gz18", "irw_car"])
def test_on_arms_and_on_rods(vehicle):
    """1e-6 m/s2 rms (1e-6 rad/s2) from rest on irregular rails: GZ18's trailing arms, the IRW car's rods."""
    profile = SpeedProfile(100.0, 140.0, 10.0, **BRISK | {"acceleration_mps2": 6.0, "jerk_mps3": 30.0})
    compiled, exudyn = both(vehicle, "level_straight", profile, duration_s=3.0)
    assert rms(exudyn.acceleration) > 0.05
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-6
    assert rms(compiled.angular_acceleration - exudyn.angular_acceleration) < 1e-6


def test_with_fastsim():
    """1e-6 m/s2 rms into the curve, creep forces by FASTSIM, which is another ride than by the default."""
    profile, ride = SpeedProfile(180.0, 260.0, 12.0, **BRISK), ("metro_irw_bogie", "smooth_curve")
    compiled, exudyn = both(*ride, profile, duration_s=5.0, law="fastsim")
    assert rms(compiled.acceleration - exudyn.acceleration) < 1e-6
    usual = run(CompiledEngine, *ride, profile, duration_s=5.0)
    assert rms(compiled.acceleration - usual.acceleration) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_every_vehicle_of_the_library(vehicle):
    """1e-6 m/s2 rms from rest into an irregular curve; 1e-4 where an axle reaches its flange.

    Not to the stop: there a conventional wheelset rings against dry friction for half a second, in which
    rounding errors grow to 1e-4.
    """
    model = load(VehicleFile, "vehicle", vehicle).model(vehicle)
    scale = model.wheel_rail.profile_scale
    if scale < 1.0:
        options = {"rough": SCALE_ROUGH, "step_s": SCALE_STEP_S}
        compiled, exudyn = both(vehicle, "scale_track", SCALE_RIDE, duration_s=10.0, **options)
        on_flange = max(lateral_shift_m(exudyn, i) for i in range(len(model.axle_names))) > FLANGE_M * scale
        assert rms(compiled.acceleration - exudyn.acceleration) < (1e-4 if on_flange else 1e-6)
        return
    # Prescribed linear contact has no flange to hold an axle in a curve.
    track = "level_straight" if model.wheel_rail.linear else "smooth_curve"
    compiled, exudyn = both(vehicle, track, SpeedProfile(120.0, 260.0, 12.0, **BRISK), duration_s=10.0)
    on_flange = max(lateral_shift_m(exudyn, i) for i in range(len(model.axle_names))) > FLANGE_M
    assert rms(compiled.acceleration - exudyn.acceleration) < (1e-4 if on_flange else 1e-6)
