"""Wheels that drive and brake: Kalker's creep on dry rails, spin and slide on leaves, rest on a gradient.

The axle here is conical so that its rolling radius is the nominal one, and drives by itself: what the
wheels do not pass on does not move it.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.ride.abeam import abeam
from simrail.track.design import Straight, TrackDesign
from simrail.track.elements import Gradient
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.track.rail_condition import RailCondition
from simrail.vehicle.contact.hertz import hertz_ellipse, kalker_coefficients
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.records import TRACTION
from simrail.vehicle.engines.traction_forces import driver
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.model import Traction
from simrail.vehicle.speed_profile import SpeedProfile

SMOOTH = Irregularity("none", fade_m=0.0)
ALL = {"axle.left": 0.5, "axle.right": 0.5}
PULL = Traction(
    driven=ALL,
    braked=ALL,
    tractive_effort_n=10e3,
    power_w=300e3,
    braking_effort_n=12e3,
    speed_gain_nspm=60e3,
    position_gain_1ps=0.5,
    catch_up_mps=0.5,
)
LEAVES = 0.05 / 0.3
GRADIENT = 0.03


def axle(**traction):
    model = load(VehicleFile, "vehicle", "irw_axle").model("irw_axle")
    pair = replace(model.wheel_rail, wheel_profile="cone_0.001", rail_inclination=0.0)
    return replace(model, wheel_rail=pair, traction=replace(PULL, **traction))


def mass_kg(model, *, rolling):
    spins = sum(model.spin_inertia_kgm2.values()) / model.wheels[0].radius_m ** 2
    return sum(body.mass_kg for body in model.bodies) + (spins if rolling else 0.0)


def run(model, profile, *, conditions=(), gradient=0.0, duration_s=None, engine=CompiledEngine, **options):
    design = TrackDesign("line", 0.0, (Straight(500.0),), gradients=(Gradient(0.0, gradient),))
    laid = lay(design, SMOOTH, seed=0, conditions=conditions)
    solver = engine(Setup(model, laid, profile, drive="wheels", **{"settle_s": 3.0, **options}))
    segments = list(solver.run(duration_s or np.floor(profile.duration_s * 1000.0) / 1000.0))
    fields = ("time_s", "position", "velocity", "acceleration", "rate", "spin_rad", "states")
    ride = SimpleNamespace(**{f: np.concatenate([getattr(s, f) for s in segments]) for f in fields})
    cos = 1.0 / np.hypot(1.0, gradient)
    ride.v = ride.velocity[:, 0, 0] / cos
    ride.a = ride.acceleration / cos
    ride.s = (ride.position[:, 0, 0] - ride.position[0, 0, 0]) / cos
    ride.rolled = (ride.spin_rad - ride.spin_rad[0]) * model.wheels[0].radius_m
    ride.rim = np.gradient(ride.rolled, ride.time_s, axis=0)
    ride.model, ride.laid, ride.cos = model, laid, cos
    return ride


START = SpeedProfile(20.0, 200.0, 15.0, acceleration_mps2=1.0, jerk_mps3=2.0, rest_s=1.0)


@pytest.fixture(scope="module")
def dry():
    return run(axle(), START, duration_s=14.0)


@pytest.fixture(scope="module")
def on_leaves():
    return run(axle(), START, conditions=(RailCondition(5.0, 190.0, LEAVES),), duration_s=14.0)


def test_dry_creepage_under_traction_is_kalkers_within_3_percent(dry):
    """Force over f11, where f11 comes from Hertz and Kalker directly, while the acceleration is steady."""
    model = dry.model
    steady = (dry.time_s > 6.0) & (dry.time_s < 8.0)
    force = mass_kg(model, rolling=False) * dry.a[steady, :, 0].mean(axis=0)[0] / 2.0
    creepage = dry.rim[steady, 0] / dry.v[steady] - 1.0
    radius, load = model.wheels[0].radius_m, model.wheel_load_n(9.81)[0]
    # Lateral curvature of a cone of next to no taper on the upright 60E1: its crown, R 300 mm.
    curvature = 1.0 / 0.3
    ellipse = hertz_ellipse(0.5 / radius, 0.5 * curvature)
    a, b = (float(x) * load ** (1.0 / 3.0) for x in (ellipse.a, ellipse.b))
    f11 = 82e9 * a * b * float(kalker_coefficients(np.array(a / b))[0])
    limit = 0.3 * load
    # Creep force of the cubic law, solved for the linear force.
    linear = 3.0 * (1.0 - np.cbrt(1.0 - force / limit)) * limit
    assert 0.2 < force / limit < 0.6
    assert creepage.mean() == pytest.approx(linear / f11, rel=0.03)


def test_full_slip_pulls_with_friction_times_load_within_1_percent(on_leaves):
    """Both wheels slip by more than a third: the vehicle's m a is the friction limit of both."""
    model = on_leaves.model
    full = (on_leaves.time_s > 5.0) & (on_leaves.time_s < 9.0)
    assert (on_leaves.rim[full, 0] > 1.3 * on_leaves.v[full]).all()
    pull = sum(body.mass_kg * on_leaves.a[full, i, 0].mean() for i, body in enumerate(model.bodies))
    assert pull == pytest.approx(0.05 * model.wheel_load_n(9.81).sum(), rel=0.01)


def test_effort_accelerates_mass_and_turning_wheels_within_1_percent(dry):
    """F/(m + I/r^2) with F of the driver's law from the recorded motion, on dry rails."""
    model, profile = dry.model, START
    times = np.arange(6.0, 8.0, 0.1)
    rows = np.searchsorted(dry.time_s, times)
    wanted_s, wanted_v, _ = profile.motion(times)
    asked = []
    for row, place, speed in zip(rows, wanted_s, wanted_v, strict=True):
        at, v = dry.position[row, 1, 0], dry.velocity[row, 1, 0]
        want = speed + PULL.catch_up_mps * np.tanh(PULL.position_gain_1ps * (place - at) / PULL.catch_up_mps)
        u = PULL.speed_gain_nspm * (want - v) / PULL.tractive_effort_n
        asked.append(PULL.tractive_effort_n * np.tanh(u))
    expected = np.mean(asked) / mass_kg(model, rolling=True)
    assert dry.a[rows, 0, 0].mean() == pytest.approx(expected, rel=0.01)
    # Without the wheels' inertia it would be 3 % off.
    assert mass_kg(model, rolling=True) / mass_kg(model, rolling=False) > 1.03


def slip_distance_m(ride, first=0):
    """Integral of creepage over the way, and of sliding at rest: rim speed less true speed over time."""
    slip = ride.rim[first:, 0] - ride.v[first:]
    return float(np.sum(0.5 * (slip[1:] + slip[:-1]) * np.diff(ride.time_s[first:])))


def test_driven_wheel_on_leaves_spins_and_its_encoder_shows_it(dry, on_leaves):
    """A hundred metres and more too much, centimetres on dry rails: the integral of creepage."""
    excess = [ride.rolled[-1, 0] - ride.s[-1] for ride in (dry, on_leaves)]
    assert 0.0 < excess[0] < 0.1
    assert excess[1] > 100.0
    for ride, found in zip((dry, on_leaves), excess, strict=True):
        assert slip_distance_m(ride) == pytest.approx(found, rel=1e-3, abs=1e-4)


STOP = SpeedProfile(20.0, 120.0, 12.0, acceleration_mps2=1.2, jerk_mps3=2.0, rest_s=0.5, final_rest_s=14.0)


def test_braked_wheel_on_leaves_slides_and_its_encoder_falls_short():
    """Locked, or nearly: its distance falls short by metres, the axle slows with friction times load."""
    leaves = (RailCondition(75.0, 200.0, LEAVES),)
    clean, slid = run(axle(), STOP), run(axle(), STOP, conditions=leaves)
    short = [ride.s[-1] - ride.rolled[-1, 0] for ride in (clean, slid)]
    assert abs(short[0]) < 0.1
    assert short[1] > 10.0
    assert -slip_distance_m(slid) == pytest.approx(short[1], rel=1e-3)
    locked = (slid.rim[:, 0] < 0.05 * slid.v) & (slid.v > 1.0)
    assert np.count_nonzero(locked) > 500
    # A brake never turns a wheel backwards but for the spring of its mounting, twice 5 mrad.
    pitch = np.cumsum(slid.rate[:, 0, 1]) * 1e-3
    turned = slid.rolled[:, 0] / 0.29 - pitch
    assert np.max(np.maximum.accumulate(turned) - turned) < 2.0 * 5e-3
    model = slid.model
    pull = sum(body.mass_kg * slid.a[locked, i, 0].mean() for i, body in enumerate(model.bodies))
    assert pull == pytest.approx(-0.05 * model.wheel_load_n(9.81).sum(), rel=0.02)


def test_slide_protection_keeps_the_creepage_near_its_limit():
    """At 15 % half of the torque is taken back: above 3 m/s creepage stays between 5 and 30 %."""
    ride = run(
        axle(slide_protection_creepage=0.15),
        START,
        conditions=(RailCondition(5.0, 190.0, LEAVES),),
        duration_s=12.0,
    )
    rolling = ride.v > 3.0
    creepage = ride.rim[rolling, 0] / ride.v[rolling] - 1.0
    assert 0.05 < creepage.min() < creepage.max() < 0.3


def test_power_ends_the_effort():
    """At 9 m/s the pull is P/v within 2 %, a sixth of the greatest effort."""
    model = axle(power_w=30e3, tractive_effort_n=20e3)
    profile = SpeedProfile(20.0, 400.0, 25.0, acceleration_mps2=2.0, jerk_mps3=4.0, rest_s=0.5)
    ride = run(model, profile, duration_s=24.0)
    row = int(np.searchsorted(ride.v, 9.0))
    assert ride.a[row, 0, 0] * mass_kg(model, rolling=True) * ride.rim[row, 0] == pytest.approx(
        30e3, rel=0.02
    )


def test_power_of_traction_is_energy_gained_and_dissipated_on_a_gradient():
    """Uphill over leaves: work of the motors = d(kinetic) + gravity + friction times slip, to 1 %.

    Motors by the driver's law from the recorded motion, friction by the Coulomb limit, for the wheels spin
    all the time: neither is read from the engine.
    """
    model = axle()
    ride = run(model, START, conditions=(RailCondition(5.0, 190.0, LEAVES),), gradient=0.01, duration_s=9.0)
    row = slice(int(np.searchsorted(ride.time_s, 5.0)), None)
    t, x, v = ride.time_s[row], ride.position[row], ride.velocity[row]
    spin = ride.rim[row] / model.wheels[0].radius_m
    s = abeam(ride.laid.design, x[:, 1, 0], x[:, 1])[4]
    place, wanted, _ = START.motion(t)
    want = wanted + PULL.catch_up_mps * np.tanh(PULL.position_gain_1ps * (place - s) / PULL.catch_up_mps)
    limit = PULL.tractive_effort_n
    pull = limit * np.tanh(PULL.speed_gain_nspm * (want - v[:, 1, 0]) / limit)
    rate = spin - ride.rate[row, 0, 1:2]
    rim = rate * model.wheels[0].radius_m
    power = np.sum(0.5 * rim * (pull / (1.0 + (pull * rim.T / PULL.power_w) ** 4) ** 0.25).T, axis=1)
    energy = sum(
        0.5 * body.mass_kg * np.sum(v[:, i] ** 2, axis=1)
        + body.mass_kg * 9.81 * x[:, i, 2]
        + 0.5 * body.inertia_kgm2[1] * ride.rate[row, i, 1] ** 2
        for i, body in enumerate(model.bodies)
    )
    energy = energy + np.sum(
        [0.5 * i * w**2 for i, w in zip(model.spin_inertia_kgm2.values(), spin.T, strict=True)], axis=0
    )
    normal = model.wheel_load_n(9.81) * ride.cos
    slip = ride.rim[row] - ride.v[row, None]
    assert slip.min() > 2.0
    spent = 0.05 * slip @ normal
    gained = energy[-5] - energy[5]
    work, lost = (np.trapezoid(p[5:-4], t[5:-4]) for p in (power, spent))
    assert min(gained, lost) > 0.2 * work
    assert work == pytest.approx(gained + lost, rel=0.01)


def test_brakes_hold_on_a_gradient():
    """3 %, 10 s after the doors would open: drift below 1e-5 m in 4 s, noise below 1e-4 m/s2."""
    profile = SpeedProfile(20.0, 60.0, 8.0, rest_s=10.0, final_rest_s=14.0)
    for gradient in (GRADIENT, -GRADIENT):
        ride = run(axle(), profile, gradient=gradient)
        for still in ((ride.time_s > 6.0) & (ride.time_s < 10.0), ride.time_s > ride.time_s[-1] - 4.0):
            assert np.ptp(ride.position[still, :, 0], axis=0).max() < 1e-5
            assert np.ptp(ride.rolled[still], axis=0).max() < 1e-5
            assert ride.acceleration[still].std(axis=0).max() < 1e-4
        assert abs(ride.position[-1, 1, 0] - 60.0) < 0.5


def test_driver_never_reverses_and_never_races():
    """Past his stop he brakes; far behind he asks for the catch-up speed and no more."""
    traction = np.array([(1, 1.0, 10e3, 300e3, 12e3, 60e3, 0.5, 0.5, 0.0, 5e-3, 0.02)], TRACTION)[0]
    assert driver(-30.0, 0.0, 0.0, traction)[0] < 1.0
    assert driver(-30.0, 0.0, 0.0, traction)[1] == pytest.approx(12e3)
    assert driver(500.0, 10.0, 10.5, traction)[0] == pytest.approx(0.0, abs=1.0)
    assert driver(500.0, 10.0, 10.6, traction)[1] > 1e3
    backward = traction.copy()
    backward["direction"] = -1.0
    for behind, wanted, speed in ((1.0, 5.0, 4.9), (-1.0, 5.0, 5.2), (0.0, 0.0, 0.01)):
        assert driver(-behind, -wanted, -speed, backward) == driver(behind, wanted, speed, traction)


def test_wheels_without_traction_are_refused():
    model = replace(axle(), traction=None)
    with pytest.raises(InputError, match="without traction"):
        run(model, START, duration_s=1.0)


@pytest.mark.long
@pytest.mark.parametrize(("rails", "spins"), [("left", 0), ("right", 1)])
def test_leaves_on_one_rail_spin_that_rails_wheel(rails, spins):
    """The wheel on leaves gains metres over the way, the other one centimetres."""
    ride = run(axle(), START, conditions=(RailCondition(5.0, 190.0, LEAVES, rails),), duration_s=8.0)
    excess = ride.rolled[-1] - ride.s[-1]
    assert excess[spins] > 5.0
    assert abs(excess[1 - spins]) < 0.1
