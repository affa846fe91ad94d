"""Wheel-rail forces of a ride against Newton's laws of the whole vehicle, and against quasi-static formulas.

A truth's forces, its motion and the track are all that is used; the guide's force is written anew from its
definition (`simrail.vehicle.model.Guide`).
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from simrail.core.toml_files import load
from simrail.ride.ride import Ride, simulate
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profile_files import profiles_of
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

pytestmark = pytest.mark.usefixtures("own_cache")
SMOOTH = Irregularity("none", (1.5, 100.0), 0.0)
G = 9.81


def model_of(name):
    return load(VehicleFile, "vehicle", name).model(name)


def contact_arrays(truth, column):
    """A column of every wheel, (n, w)."""
    return np.column_stack([truth.contact(wheel)[column] for wheel in truth.wheel_names])


def contact_force(truth):
    """Sum of the forces of all rails (n, 3), global axes: creep force along, Y and Q in each axle's frame."""
    total = np.zeros((len(truth.time_s), 3))
    for wheel in truth.wheel_names:
        contact = truth.contact(wheel)
        axes = truth.track.frame(contact["position_m"].to_numpy()).rotation
        force = contact[["creep_force_x_n", "guiding_force_n", "wheel_load_n"]].to_numpy()
        total += np.einsum("nij,nj->ni", axes, force)
    return total


def guide_force(truth, model, profile):
    """Force (n, 3) of the guide: spring and damper along the track to where the profile wants its body."""
    guide, body = model.guide, truth.bodies[model.guide.body]
    s, speed, _ = profile.motion(truth.time_s)
    frame = truth.track.frame(s + body.offset_m)
    place = np.einsum("nji,nj->ni", frame.rotation, body.position - frame.position)
    v = np.einsum("nji,nj->ni", frame.rotation, body.velocity)
    metre = 1.0 / np.cos(frame.pitch_rad) - frame.k[:, 2] * place[:, 1] + frame.k[:, 1] * place[:, 2]
    along = -guide.stiffness_npm * place[:, 0] - guide.damping_nspm * (v[:, 0] - speed * metre)
    return frame.rotation[:, :, 0] * along[:, None]


def momentum(truth, model, quantity="velocity"):
    return sum(body.mass_kg * getattr(truth.bodies[body.name], quantity) for body in model.bodies)


def weight(model):
    return G * sum(body.mass_kg for body in model.bodies)


def closure(model, *, step_s, drive="guide"):
    """What the forces of a start, a transition and a stop on irregular rails leave over, over the weight.

    At each row, (n, 3), and of the momentum, integrated by Simpson's rule, over the largest.
    """
    design = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    rough = Irregularity("erri_b176_low", (1.5, 100.0), 20.0)
    profile = SpeedProfile(
        140.0, 160.0, 10.0, rest_s=0.2, final_rest_s=0.1, acceleration_mps2=3.0, jerk_mps3=30.0
    )
    ride = Ride("closure", design, rough, 1, model, profile, engine="compiled", contact_rate_hz=1000.0)
    truth = simulate(replace(ride, step_s=step_s, drive=drive))
    force = contact_force(truth) - [0.0, 0.0, weight(model)]
    if drive == "guide":
        force += guide_force(truth, model, profile)
    gained = momentum(truth, model) - momentum(truth, model)[0]
    pushed = cumulative_simpson(force, dx=1e-3, axis=0, initial=0.0)
    rows = (force - momentum(truth, model, "acceleration")) / weight(model)
    return rows, np.abs(pushed - gained).max(axis=0) / np.abs(gained).max()


def rms(values):
    return np.sqrt(np.mean(values**2, axis=0))


@pytest.mark.parametrize("drive", ["guide", "wheels"])
def test_contact_gravity_and_guide_are_all_that_moves_the_vehicle(drive):
    """At 1/16 ms: each row to 1e-9 of the weight rms, the momentum to 1e-7. At 1/8 ms: the step's error.

    Forces are those at the states, accelerations those of the motion: what the integrator puts between
    them falls with the fourth power of the step. Where the wheels drive there is no guide to be counted.
    """
    model = model_of("metro_irw_bogie")
    fine, left = closure(model, step_s=1e-3 / 16, drive=drive)
    assert rms(fine)[1:].max() < 1e-9
    assert rms(fine)[0] < 5e-9  # the guide's jerk steps between two rows
    assert left.max() < 1e-7
    if drive == "guide":
        coarse, _ = closure(model, step_s=1e-3 / 8)
        assert rms(coarse)[2] / rms(fine)[2] == pytest.approx(16.0, rel=0.3)


def arc(radius_m, cant_m):
    return TrackDesign("arc", 0.0, (Straight(100.0), Transition(80.0), Curve(340.0, radius_m, cant_m)))


def steady(name, design, speed_mps):
    """A vehicle in steady running at s = 350 m of smooth track, and the row there."""
    model = model_of(name)
    profile = SpeedProfile(30.0, 500.0, speed_mps, rest_s=0.2, acceleration_mps2=3.0, jerk_mps3=20.0)
    truth = simulate(Ride(name, design, SMOOTH, 0, model, profile, engine="compiled", contact_rate_hz=1000.0))
    return model, truth, int(np.searchsorted(truth.reference_position_m, 350.0))


def test_straight_running_carries_the_static_load():
    """Each wheel to 0.1 %, all of them weight and inertia to 1e-9 of it; nothing pushes sideways."""
    design = TrackDesign("level", 0.0, (Straight(520.0),))
    model, truth, row = steady("two_axle_wagon", design, 25.0)
    load, guiding = (contact_arrays(truth, name)[row] for name in ("wheel_load_n", "guiding_force_n"))
    np.testing.assert_allclose(load, model.wheel_load_n(G), rtol=1e-3)
    inertia = momentum(truth, model, "acceleration")[row, 2]
    assert load.sum() == pytest.approx(weight(model) + inertia, rel=1e-9)
    np.testing.assert_allclose(guiding.reshape(-1, 2).sum(axis=1), 0.0, atol=1e-6 * weight(model))
    assert contact_arrays(truth, "flange_contact").max() == 0.0


@pytest.fixture(
    scope="module", params=[500.0, pytest.param(-500.0, marks=pytest.mark.slow)], ids=["left", "right"]
)
def curving(request):
    """Manchester vehicle 1 at 90 km/h on R500 with 100 mm of cant: 0.6 m/s2 uncompensated."""
    return *steady("manchester_1", arc(request.param, 0.1), 25.0), request.param


def support(truth, row, radius_m, speed_mps=25.0):
    """Specific force along and across that rails give a vehicle in steady curving: (across, up), m/s2."""
    roll = truth.track.frame(truth.reference_position_m[[row]]).roll_rad[0]
    centripetal = speed_mps**2 / radius_m
    return (
        centripetal * np.cos(roll) + G * np.sin(roll),
        G * np.cos(roll) - centripetal * np.sin(roll),
    )


def test_steady_curving_sums_and_quotient_are_those_of_cant_deficiency(own_cache, curving):
    """Sum of Y = m (V2/R cos - g sin), sum of Q = m (g cos + V2/R sin); their quotient.

    To 1e-3: what V2/R differs by between the middle of the vehicle and its bogies, a2/(2 R2), is 2e-4. Each
    bogie carries its half, to 1 %.
    """
    model, truth, row, radius_m = curving
    across, up = support(truth, row, radius_m)
    mass = weight(model) / G
    load, guiding = (contact_arrays(truth, name)[row] for name in ("wheel_load_n", "guiding_force_n"))
    assert across * np.sign(radius_m) > 0.5
    assert guiding.sum() == pytest.approx(mass * across, rel=1e-3)
    assert load.sum() == pytest.approx(mass * up, rel=1e-4)
    assert guiding.sum() / load.sum() == pytest.approx(across / up, rel=1e-3)
    np.testing.assert_allclose(guiding.reshape(2, 4).sum(axis=1), 0.5 * mass * across, rtol=1e-2)


def test_one_contact_has_the_quotient_of_its_angle(own_cache, curving):
    """Y/Q = tan(angle - atan(T/N)) in the left wheel's sense: Nadal's, with the force that there is.

    Within 2 % and 0.002, as the axle's roll (2 mrad) is in one and not in the other.
    """
    model, truth, row, _ = curving
    for wheel in model.wheels:
        here = truth.contact(wheel.name).iloc[row]
        if here["flange_contact"]:
            continue  # two patches have no one angle
        out = -wheel.side * here["guiding_force_n"] / here["wheel_load_n"]
        tilt = np.arctan(wheel.side * here["creep_force_y_n"] / here["normal_force_n"])
        assert out == pytest.approx(np.tan(here["contact_angle_rad"] - tilt), rel=0.02, abs=2e-3)


def moment_of_contacts(truth, model, row, frame):
    """Moment of all contact forces about the X axis of a frame, each where it touches its rail."""
    _, rail = profiles_of(model.wheel_rail)
    head = incline(rail, model.wheel_rail.rail_inclination, gauge_depth_m=0.014)
    middle = 0.5 * model.wheel_rail.gauge_m - head.gauge_abscissa_m
    total = 0.0
    for wheel in model.wheels:
        here = truth.contact(wheel.name).iloc[row]
        axle = truth.track.frame(np.array([here["position_m"]]))
        touched = [0.0, wheel.side * (middle + here["rail_contact_m"]), -head.depth(here["rail_contact_m"])]
        force = here[["creep_force_x_n", "guiding_force_n", "wheel_load_n"]].to_numpy()
        arm = axle.position[0] + axle.rotation[0] @ touched - frame.position[0]
        total += np.cross(arm, axle.rotation[0] @ force) @ frame.rotation[0, :, 0]
    return total


def test_steady_curving_transfers_the_load_of_the_quasi_static_formula(own_cache, curving):
    """Moment of Q and Y about the track's middle = sum of m (y f_up - h f_across), less the gyroscopes'.

    With each body's own h and y as it stands in the curve; to 1 % of the transfer by the height alone.
    """
    model, truth, row, radius_m = curving
    across, up = support(truth, row, radius_m)
    frame = truth.track.frame(truth.reference_position_m[[row]])
    axes, levers = frame.rotation[0].T, np.zeros(3)
    for body in model.bodies:
        levers += body.mass_kg * axes @ (truth.bodies[body.name].position[row] - frame.position[0])
    turning = 25.0 / radius_m * np.cos(frame.roll_rad[0])
    gyroscopes = turning * sum(model.spin_inertia_kgm2.values()) * 25.0 / model.wheels[0].radius_m
    expected = levers[1] * up - levers[2] * across - gyroscopes
    found = moment_of_contacts(truth, model, row, frame)
    assert found == pytest.approx(expected, abs=0.01 * abs(levers[2] * across))
