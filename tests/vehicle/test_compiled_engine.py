"""The compiled engine by itself: order, symmetries, energy, and what a ride makes of it."""

import itertools
import subprocess
import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from wheel_loads import wheel_loads_n

from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, simulate
from simrail.track.design import Straight, TrackDesign
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.derailment import DerailedError
from simrail.vehicle.engines.engine import Setup, start_poses
from simrail.vehicle.engines.stepper import BODY
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

SMOOTH = Irregularity("none", (1.5, 100.0), 0.0)
ROUGH = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
BRISK = {"rest_s": 0.3, "final_rest_s": 0.5, "acceleration_mps2": 2.0, "jerk_mps3": 4.0}
FIELDS = ("time_s", "position", "velocity", "acceleration", "rate", "angular_acceleration", "states")


def bogie():
    return load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")


def curve(irregularity, seed=1):
    return lay(load(TrackFile, "track", "smooth_curve").design("smooth_curve"), irregularity, seed=seed)


def ride(laid, profile, duration_s, *, segment_s=5.0, **options):
    engine = CompiledEngine(Setup(bogie(), laid, profile, **{"settle_s": 1.0, **options}))
    segments = list(engine.run(duration_s, segment_s=segment_s))
    joined = {name: np.concatenate([getattr(part, name) for part in segments]) for name in FIELDS}
    return SimpleNamespace(**joined)


def rms(difference):
    """Over the rows and axes, the worst body."""
    return float(np.sqrt(np.mean(difference**2, axis=(0, 2))).max())


def test_halving_the_step_converges_with_order_4():
    """On the tread: the change of acceleration falls by 16 +- 30 % at each halving, to below 1e-3 m/s2."""
    laid, profile = curve(ROUGH), SpeedProfile(2.0, 80.0, 12.0, **BRISK)
    steps = (0.5e-3, 0.25e-3, 0.125e-3)
    rides = [ride(laid, profile, 8.0, step_s=step).acceleration[:, :2] for step in steps]
    coarse, fine = (rms(a - b) for a, b in itertools.pairwise(rides))
    assert coarse < 1e-3
    assert coarse / fine == pytest.approx(16.0, rel=0.3)


def test_output_does_not_depend_on_the_segments():
    """Bit by bit; so a long ride in bounded memory is the same ride."""
    laid, profile = curve(ROUGH), SpeedProfile(2.0, 30.0, 8.0, **BRISK)
    one, other = (ride(laid, profile, 3.0, segment_s=length) for length in (5.0, 0.37))
    np.testing.assert_array_equal(np.diff(one.time_s) > 0.0, True)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_acceleration_is_the_second_difference_of_position():
    """On irregular rails, to 5e-6 of its rms; and the rows stand at their times, to 3 mm at 12 m/s."""
    profile = SpeedProfile(2.0, 120.0, 12.0, **BRISK)
    moved = ride(curve(ROUGH), profile, 9.0, rate_hz=2000.0)
    p, h = moved.position[:, 0], 0.5e-3
    second = (-p[:-4] + 16 * p[1:-3] - 30 * p[2:-2] + 16 * p[3:-1] - p[4:]) / (12 * h**2)
    difference = second - moved.acceleration[2:-2, 0]
    assert np.sqrt(np.mean(difference**2)) < 5e-6 * np.sqrt(np.mean(second**2))
    position, speed, _ = profile.motion(moved.time_s)
    steady = np.abs(speed - 12.0) < 1e-9
    assert np.count_nonzero(steady) > 1000
    np.testing.assert_allclose(moved.position[steady, 3, 0], position[steady], rtol=0.0, atol=3e-3)


@dataclass(frozen=True)
class Mirrored:
    """A design seen in a mirror that stands along X."""

    design: TrackDesign

    def frame(self, s):
        f = self.design.frame(s)
        position = f.position * [1.0, -1.0, 1.0]
        return SimpleNamespace(
            position=position, yaw_rad=-f.yaw_rad, pitch_rad=f.pitch_rad, roll_rad=-f.roll_rad
        )

    def on_track(self, s):
        return self.design.on_track(s)


@dataclass(frozen=True)
class Turned:
    """A design on which s runs the other way, s' = total_m - s."""

    design: TrackDesign
    total_m: float

    def frame(self, s):
        f = self.design.frame(self.total_m - s)
        yaw = f.yaw_rad + np.pi
        return SimpleNamespace(position=f.position, yaw_rad=yaw, pitch_rad=-f.pitch_rad, roll_rad=-f.roll_rad)

    def on_track(self, s):
        return self.total_m - self.design.on_track(self.total_m - s)


# x y z, yaw pitch roll, y and z of the left rail and of the right one, their frictions; rails change places.
OTHER_RAIL = [0, 1, 2, 3, 4, 5, 8, 9, 6, 7, 11, 10]
IN_THE_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0])
TURNED = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, 1.0])


def mirrored(laid):
    table = laid.table[:, OTHER_RAIL] * IN_THE_MIRROR[:, None]
    table = np.ascontiguousarray(table)
    table.flags.writeable = False
    return replace(laid, design=Mirrored(laid.design), table=table)


def turned(laid):
    """The same rails, s counted from the other end."""
    h = laid.table_step_m
    a, b, c, d = np.moveaxis(laid.table[::-1, OTHER_RAIL], -1, 0)
    # The cubic of t, written in h - t.
    ahead = [-a, 3.0 * a * h + b, -(3.0 * a * h + 2.0 * b) * h - c, ((a * h + b) * h + c) * h + d]
    table = np.ascontiguousarray(np.stack(ahead, axis=-1) * TURNED[:, None])
    table[:, 3, 3] += np.pi
    table.flags.writeable = False
    total = 2.0 * laid.table_start_m + len(laid.table) * h
    return replace(laid, design=Turned(laid.design, total), table=table), total


# From rails that are still straight: a start on displaced ones is a blow that rounding errors grow in.
CURVE_RIDE = SpeedProfile(3.0, 250.0, 50.0 / 3.6, **BRISK)


@pytest.fixture(scope="module")
def curve_ride():
    """Straight, transition and curve with cant deficiency, irregular."""
    return ride(curve(ROUGH), CURVE_RIDE, 22.0)


def test_mirrored_track_gives_the_mirrored_ride(curve_ride):
    """To 1e-5 m/s2, at every row."""
    other = ride(mirrored(curve(ROUGH)), CURVE_RIDE, 22.0)
    assert np.abs(curve_ride.acceleration[:, 0, 1]).max() > 0.3
    across, about = [1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]
    assert np.abs(curve_ride.acceleration * across - other.acceleration).max() < 1e-5
    assert np.abs(curve_ride.angular_acceleration * about - other.angular_acceleration).max() < 1e-5


def test_backward_is_forward_over_the_track_turned_end_for_end():
    """To 1e-5 m/s2, at every row: the bogie is the same from either end; only front and rear change names."""
    laid = curve(ROUGH)
    back, total = turned(laid)
    backward = ride(laid, replace(CURVE_RIDE, start_m=597.0, end_m=350.0), 22.0)
    forward = ride(back, replace(CURVE_RIDE, start_m=total - 597.0, end_m=total - 350.0), 22.0)
    assert np.abs(backward.acceleration[:, 0, 1]).max() > 0.3
    swapped = [1, 0, 2, 3]
    assert np.abs(backward.acceleration - forward.acceleration[:, swapped]).max() < 1e-5
    turn = [-1.0, -1.0, 1.0]
    difference = backward.angular_acceleration * turn - forward.angular_acceleration[:, swapped]
    assert np.abs(difference).max() < 1e-5


def test_coasting_gains_no_energy():
    """On level smooth track with the driver off: growth below 1e-6 of the kinetic energy per km.

    Creep takes some: 5 N of resistance under 17 t.
    """
    model = bogie()
    design = TrackDesign("level", 0.0, (Straight(2000.0),))
    engine = CompiledEngine(
        Setup(model, lay(design, SMOOTH, seed=0), SpeedProfile(20.0, 1900.0, 20.0, **BRISK))
    )

    def energy():
        bodies = engine.state[: BODY * len(model.bodies)].reshape(-1, BODY)
        mass = np.array([body.mass_kg for body in model.bodies])
        inertia = np.array([body.inertia_kgm2 for body in model.bodies])
        spins = np.array(list(model.spin_inertia_kgm2.values()))
        rates = engine.state[bodies.size + len(spins) : bodies.size + 2 * len(spins)]
        moving = mass @ np.sum(bodies[:, 7:10] ** 2, axis=1) + np.sum(inertia * bodies[:, 10:] ** 2)
        return 0.5 * (moving + spins @ rates**2), bodies[3, 0]

    stations = []
    for segment in engine.run(80.0, segment_s=5.0):
        now = segment.time_s[-1]
        if now > 24.0:
            for name in (
                "stiffness",
                "damping",
                "pitch_stiffness",
                "pitch_damping",
                "yaw_stiffness",
                "yaw_damping",
            ):
                engine.data.guide[name] = 0.0  # nothing drives or holds the vehicle any more
        if now > 35.0:
            stations.append(energy())
    energies, places = np.array(stations).T
    distance_km = (places[-1] - places[0]) / 1000.0
    assert distance_km > 0.75
    change = (energies - energies[0]) / energies[0]
    assert np.diff(change).max() < 1e-6 * distance_km
    assert -3e-3 * distance_km < change[-1] < 1e-6 * distance_km
    attitudes = engine.state[: BODY * len(model.bodies)].reshape(-1, BODY)[:, 3:7]
    np.testing.assert_allclose(np.linalg.norm(attitudes, axis=1), 1.0, rtol=0.0, atol=1e-15)


def test_derailment_is_said_at_once():
    """One clear error, and no steps after it."""
    profile = SpeedProfile(20.0, 560.0, 75.0, rest_s=0.5, acceleration_mps2=30.0, jerk_mps3=200.0)
    laid = curve(SMOOTH)
    engine = CompiledEngine(Setup(bogie(), laid, profile))
    with pytest.raises(DerailedError, match=r"axle front left the rail at s = [\d.]+ m") as said:
        for _ in engine.run(8.0, segment_s=60.0):
            pass
    place = laid.design.frame(np.array([said.value.derailment.place_m])).position[0]
    assert np.linalg.norm(engine.state[:2] - place[:2]) < 0.2


def test_static_wheel_loads():
    """To 0.1 % after settling."""
    model = bogie()
    engine = CompiledEngine(Setup(model, curve(SMOOTH), SpeedProfile(20.0, 30.0, 5.0)))
    for _ in engine.run(0.1):
        pass
    np.testing.assert_allclose(wheel_loads_n(engine), model.wheel_load_n(9.81), rtol=1e-3)


def test_simulate_with_the_compiled_engine(tmp_path, monkeypatch):
    """A truth like any other, under its own name; a wheel turns as far as it rolls."""
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    track = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    profile = SpeedProfile(20.0, 60.0, 8.0, **BRISK)
    truth = simulate(Ride("compiled", track, SMOOTH, 0, bogie(), profile, engine="compiled"))
    assert truth.manifest["engine"] == "compiled"
    angle = truth.wheel_angles["front.left"][-1]
    assert angle * truth.wheel_radius_m["front.left"] == pytest.approx(40.0, rel=3e-3)


def test_needs_no_exudyn():
    """Nothing of it is imported: an interpreter that cannot is enough."""
    code = (
        "import sys; sys.modules['exudyn'] = None\n"
        "import simrail.ride.ride\n"
        "from simrail.vehicle.engines.compiled_engine import CompiledEngine"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("stopped", [True, False])
def test_a_ride_in_a_canted_curve_begins_at_rest(monkeypatch, stopped):
    """The body leans further than the rails; less than 1/25 of that is left to sway, either side of rest.

    Settling that only waits leaves a half: the sway takes 2 s and is damped by a third in that.
    """
    if not stopped:
        monkeypatch.setattr("simrail.vehicle.engines.engine.HALTS", ())
    laid, model = curve(SMOOTH), bogie()
    frame = laid.design.frame(np.arange(laid.design.start_m, laid.design.end_m))
    start_m = laid.design.start_m + float(np.argmax(np.abs(frame.roll_rad))) + 20.0
    setup = Setup(model, laid, SpeedProfile(start_m, start_m + 30.0, 5.0, rest_s=6.0))
    body = [b.name for b in model.bodies].index("body")
    left = np.concatenate([part.rotation[:, body, 2, 1] for part in CompiledEngine(setup).run(5.0)])
    first = [rotation for _, rotation in start_poses(setup)][body]
    lean, swing = abs(left[-1000:].mean() - first[2, 1]), np.ptp(left)
    assert lean > 1e-3
    assert (swing < 2.0 * lean / 25.0) == stopped
