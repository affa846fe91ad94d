"""Loads and places of the shipped vehicles' wheels: on good track, over a dip in a curve, against SIMPACK.

SIMPACK's figures are those of the vehicles' source (see `scenarios/vehicles/metro_car_gz18.toml`), read off
its pictures to 5 %. They belong to the profile LM, whose arcs could not be had; S1002 stands on LM's tape
circle here, so what hangs on the profile is not compared.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from wheel_loads import wheel_loads_n

from simrail.core.toml_files import load
from simrail.track.design import TrackDesign
from simrail.track.elements import Curve, Straight, Transition
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import CHANNELS, lay
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

G = 9.81
SMOOTH = Irregularity("none", (1.5, 100.0), 0.0)
FALLING_FRICTION = CreepLaw("fastsim", friction_floor=0.4, friction_decay_spm=0.55)

SIMPACK_LOADS_KN = np.array([[59.0, 79.0], [68.0, 69.0], [61.3, 75.4], [65.5, 71.5]])
"""Inner and outer wheel of each axle, R300 at 60 km/h."""
SIMPACK_SHIFT_MM = np.array([-8.85, 0.30, -8.75, -0.35])
SIMPACK_YAW_MRAD = np.array([-7.5, -0.33, -7.0, 0.25])
SIMPACK_TX_AXLE_2_KN = np.array([15.8, -15.8])


def vehicle(name):
    return load(VehicleFile, "vehicle", name).model(name)


def loads_over_time(engine, duration_s):
    """Times and loads (n, w) of the wheels, every 8 ms."""
    rows = [(part.time_s[-1], wheel_loads_n(engine)) for part in engine.run(duration_s, segment_s=8e-3)]
    times, loads = zip(*rows, strict=True)
    return np.array(times), np.array(loads)


def load_variation(name, speed_mps, *, length_m=700.0):
    """Wheel loads (n, w) less their means, over the static ones, on ERRI's good straight track."""
    model = vehicle(name)
    rough = Irregularity("erri_b176_low", (1.5, 100.0), 40.0)
    laid = lay(TrackDesign("straight", 0.0, (Straight(length_m),)), rough, seed=1)
    profile = SpeedProfile(
        40.0, length_m - 30.0, speed_mps, rest_s=0.2, acceleration_mps2=8.0, jerk_mps3=40.0
    )
    engine = CompiledEngine(Setup(model, laid, profile, settle_s=2.0))
    # Away from where it starts and brakes, the driver's pull does not count.
    times, loads = loads_over_time(engine, round(profile.duration_s - 4.5 - speed_mps / 16.0, 1))
    running = loads[times > 3.2 + speed_mps / 16.0]
    return (running - running.mean(axis=0)) / model.wheel_load_n(G)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_gz18_keeps_its_wheel_loads_on_good_track():
    """dQ/Q0 below 0.05 rms at 72 km/h. Arms that cannot pivot one by one made it 0.25."""
    assert rms(load_variation("metro_car_gz18", 20.0)) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "speed_kmh"),
    [
        ("irw_car", 72.0),
        ("manchester_1", 72.0),
        ("metro_irw_bogie", 72.0),
        ("metro_irw_train", 72.0),
        ("two_axle_wagon", 100.0),
    ],
)
def test_vehicles_keep_their_wheel_loads_on_good_track(name, speed_kmh):
    """dQ/Q0 below 0.10 rms over all wheels; the wagon's file has no top speed, 100 km/h is a usual one."""
    variation = load_variation(name, speed_kmh / 3.6)
    print(f"\n{name}: dQ/Q0 {rms(variation):.4f} rms, worst wheel {variation.std(axis=0).max():.4f}")
    assert rms(variation) < 0.10


def dipped(rails, *, depth_m=0.02, length_m=6.0, at_m=90.0):
    """A left curve of 150 m radius; one rail or both sink by a cosine over a length."""
    design = TrackDesign(
        "dip",
        0.0,
        (Straight(40.0), Transition(30.0), Curve(60.0, 150.0, 0.0), Transition(30.0), Straight(40.0)),
    )
    laid = lay(design, SMOOTH, seed=0)
    s = laid.table_start_m + laid.table_step_m * np.arange(len(laid.table) + 1)
    phase = 2.0 * np.pi * (s - at_m) / length_m
    sunk = np.where(np.abs(phase) < np.pi, -0.5 * depth_m * (1.0 + np.cos(phase)), 0.0)
    table = laid.table.copy()
    for rail in rails:
        table[:, CHANNELS.index(f"z_{rail}")] += CubicSpline(s, sunk).c.T
    return replace(laid, table=table)


DIPS = {"outer": ("right",), "inner": ("left",), "both": ("left", "right")}


def least_load(name, rails):
    """Smallest Q/Q0 over a dip at 16 km/h; a derailment raises."""
    model, laid = vehicle(name), dipped(DIPS[rails])
    profile = SpeedProfile(25.0, 135.0, 16.0 / 3.6, rest_s=0.2, acceleration_mps2=2.0, jerk_mps3=4.0)
    engine = CompiledEngine(Setup(model, laid, profile, settle_s=2.0))
    _, loads = loads_over_time(engine, 25.0)
    lowest = laid.rails(np.array([90.0]))[0]
    assert min(lowest[1], lowest[3]) == pytest.approx(-0.02, abs=1e-6)
    return float((loads / model.wheel_load_n(G)).min())


def test_gz18_passes_a_dip_in_a_sharp_curve():
    """20 mm over 6 m in the outer rail of R150, at 16 km/h: no derailment; two thirds of a load stay."""
    assert least_load("metro_car_gz18", "outer") > 0.6


@pytest.mark.slow
@pytest.mark.parametrize("rails", DIPS)
@pytest.mark.parametrize(
    "name",
    ["irw_car", "manchester_1", "metro_car_gz18", "metro_irw_bogie", "metro_irw_train", "two_axle_wagon"],
)
def test_vehicles_pass_a_dip_in_a_sharp_curve(name, rails):
    """No derailment, and no wheel below 0.4 of its load (EN 14363 asks of a twist test)."""
    least = least_load(name, rails)
    print(f"\n{name}, dip in {rails}: least Q/Q0 {least:.3f}")
    assert least > 0.4


class AxleContacts(NamedTuple):
    """Of each axle (a,): lateral shift from the middle of its rails, m; yaw in the track's frame, rad.

    Of its wheels (a, 2), left and right: vertical force on them, and creep force along the track, N.
    """

    shift_m: np.ndarray
    yaw_rad: np.ndarray
    load_n: np.ndarray
    creep_x_n: np.ndarray


def contacts_at_the_end(engine, segment):
    """Contacts of all axles at the last output row of a segment.

    Each wheel tells how far it stands outward on its rail; the axle's centre stands less its roll.
    """
    told = segment.contacts[-1].reshape(-1, 2)
    frame = engine.setup.track.design.frame(told["position_m"][:, 0])
    turned = frame.rotation.swapaxes(1, 2) @ segment.rotation[-1, engine.data.axles["body"]]
    yaw = np.arctan2(turned[:, 1, 0], turned[:, 0, 0])
    roll = np.arctan2(turned[:, 2, 1], turned[:, 2, 2])
    on_rails = 0.5 * (told["shift_m"][:, 0] - told["shift_m"][:, 1])
    shift = on_rails - engine.setup.model.wheels[0].radius_m * roll
    return AxleContacts(shift, yaw, told["load_n"], told["creep_x_n"])


def in_the_curve_of_simpack(name):
    """Contacts of a vehicle 250 m into R300 (50 m transition, 120 mm of cant) at 60 km/h."""
    model = vehicle(name)
    model = replace(model, wheel_rail=replace(model.wheel_rail, creep=FALLING_FRICTION))
    parts = (Straight(100.0), Transition(50.0), Curve(500.0, 300.0, 0.12), Transition(50.0), Straight(100.0))
    profile = SpeedProfile(30.0, 500.0, 60.0 / 3.6, rest_s=0.2, acceleration_mps2=4.0, jerk_mps3=8.0)
    grid = np.arange(0.0, profile.duration_s, 1e-3)
    until = round(float(np.interp(400.0, profile.motion(grid)[0], grid)), 3)
    engine = CompiledEngine(Setup(model, lay(TrackDesign("r300", 0.0, parts), SMOOTH, seed=0), profile))
    return contacts_at_the_end(engine, list(engine.run(until, segment_s=1.0))[-1])


@pytest.mark.slow
def test_gz18_in_the_curve_of_simpack():
    """Loads within 1.5 kN of SIMPACK's, axles in its order; the creep forces of axle 2 within 10 %.

    These last are asked to 5 %, and are 6 % greater on S1002: its ellipse is another one than LM's.
    """
    found = in_the_curve_of_simpack("metro_car_gz18")
    shift_mm, yaw_mrad = 1e3 * found.shift_m, 1e3 * found.yaw_rad
    load_kn, along_kn = 1e-3 * found.load_n, 1e-3 * found.creep_x_n
    print("\naxle    Q inner, outer kN   SIMPACK     y mm  SIMPACK   yaw mrad  SIMPACK   Tx inner, outer kN")
    for i in range(4):
        inner, outer = load_kn[i]
        print(
            f"{i + 1}        {inner:6.1f} {outer:6.1f}     {SIMPACK_LOADS_KN[i]}   {shift_mm[i]:6.2f} "
            f"{SIMPACK_SHIFT_MM[i]:6.2f}    {yaw_mrad[i]:6.2f} {SIMPACK_YAW_MRAD[i]:6.2f}     "
            f"{along_kn[i, 0]:6.1f} {along_kn[i, 1]:6.1f}"
        )
    np.testing.assert_allclose(load_kn, SIMPACK_LOADS_KN, atol=1.5)
    np.testing.assert_array_equal(np.argsort(shift_mm), np.argsort(SIMPACK_SHIFT_MM))
    np.testing.assert_array_equal(np.argsort(yaw_mrad), np.argsort(SIMPACK_YAW_MRAD))
    np.testing.assert_allclose(along_kn[1], SIMPACK_TX_AXLE_2_KN, rtol=0.10)


@pytest.mark.slow
def test_irw_cars_bogies_run_on_opposite_rails():
    """As the source's do: the front one against the outer rail, the rear one against the inner."""
    shift_mm = 1e3 * in_the_curve_of_simpack("irw_car").shift_m
    print("\nshift of the axles, mm:", shift_mm.round(2))
    assert np.all(shift_mm[:2] < -8.0)
    assert np.all(shift_mm[2:] > 8.0)
