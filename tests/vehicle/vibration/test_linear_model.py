"""The linear vertical model against closed forms, and against the equations that the engines ride."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.model import Body, Guide, LinearContact, VehicleModel, Wheel, WheelRail
from simrail.vehicle.vibration.car_bodies import car_bodies
from simrail.vehicle.vibration.linear_model import (
    HEAVE,
    PITCH,
    ROLL,
    SWAY,
    YAW,
    Bending,
    TrackSupport,
    contact_stiffness_npm,
    creep_coefficients_n,
    linear_vehicle,
)
from simrail.vehicle.vibration.modal import modes_of, state_space

CONTACT_NPM, HALF_M = 1.2e9, 0.75
SUPPORT = TrackSupport(150.0, 7e7, 1e5)


def vehicle(name):
    return load(VehicleFile, "vehicle", name).model(name)


def lone_axle(mass=1500.0, roll=700.0):
    """A wheelset on prescribed contacts that nothing stands on."""
    contact = LinearContact(
        f11_n=1e6, f22_n=1e6, conicity=0.1, vertical_stiffness_npm=CONTACT_NPM, vertical_damping_nspm=0.0
    )
    return VehicleModel(
        name="axle",
        title="axle",
        source="test",
        synthetic=True,
        bodies=(Body("axle", mass, (roll, 100.0, roll), (0.0, 0.0, 0.46)),),
        suspensions=(),
        wheels=tuple(Wheel(f"axle.{s}", "axle", k, "axle", 0.46) for s, k in (("left", 1), ("right", -1))),
        spin_inertia_kgm2={"axle": 100.0},
        guide=Guide("axle", 1e5, 0.0, 0.0, 0.0, 0.0, 0.0),
        wheel_rail=WheelRail("S1002", "60E1", 1.435, 0.025, 0.3, tape_circle_half_m=HALF_M, linear=contact),
    )


def frequencies(linear):
    a, _ = state_space(linear)
    found = np.linalg.eigvals(a)
    return np.sort(np.abs(found[found.imag > 0.0])) / (2.0 * np.pi)


def two_masses(m, k_contact, m_rail, k_track):
    """Both natural frequencies of a mass on a contact spring on a rail mass on a track spring, Hz."""
    a = m * m_rail
    b = -(m * (k_contact + k_track) + m_rail * k_contact)
    c = k_contact * k_track
    squares = (-b + np.array([-1.0, 1.0]) * np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    return np.sqrt(squares) / (2.0 * np.pi)


def test_p2_and_contact_resonance_are_those_of_two_masses_on_two_springs():
    undamped = TrackSupport(SUPPORT.mass_kg, SUPPORT.stiffness_npm, 0.0)
    found = frequencies(linear_vehicle(lone_axle(), undamped))
    expected = [
        *two_masses(1500.0 / 2, CONTACT_NPM, 150.0, 7e7),  # heave, half the axle on each wheel
        # Roll about the points where it touches the rails, 0.46 m below.
        *two_masses((700.0 + 1500.0 * 0.46**2) / (2 * HALF_M**2), CONTACT_NPM, 150.0, 7e7),
    ]
    np.testing.assert_allclose(found, np.sort(expected), rtol=1e-9)
    # Jenkins et al. 1974: unsprung mass and rail mass on the track, the contact being stiff beside it.
    p2 = np.sqrt(7e7 / (750.0 + 150.0)) / (2.0 * np.pi)
    assert found[1] == pytest.approx(p2, rel=0.03) or found[0] == pytest.approx(p2, rel=0.03)


def test_rigid_rails_leave_the_contact_alone():
    found = frequencies(linear_vehicle(lone_axle(), None))
    rolled = 700.0 + 1500.0 * 0.46**2
    expected = np.sqrt([2 * CONTACT_NPM / 1500.0, 2 * CONTACT_NPM * HALF_M**2 / rolled]) / (2.0 * np.pi)
    np.testing.assert_allclose(found, np.sort(expected), rtol=1e-12)


def test_each_wheel_has_its_own_rail():
    """A slow rise of one rail lifts the axle by half and rolls it by the rise over the base."""
    linear = linear_vehicle(lone_axle(), None)
    rise = linear.response(0.01)[:, 0].real * 1e-3
    assert linear.row("axle", HEAVE) @ rise == pytest.approx(0.5e-3, rel=1e-6)
    assert linear.row("axle", ROLL) @ rise == pytest.approx(1e-3 / (2.0 * HALF_M), rel=1e-6)


def creeping(model, speed_mps):
    """Coordinates of the lone axle across, C and K, at a speed."""
    linear = linear_vehicle(model, None, speed_mps=speed_mps)
    at = [linear.coordinates.index(("axle", motion)) for motion in (SWAY, ROLL, YAW)]
    square = np.ix_(at, at)
    return linear.damping[square], linear.stiffness[square]


def test_a_wheelset_creeps_as_in_the_textbooks():
    """De Pater, Wickens: 2 f22/V across at the rails, 0.46 m below, and 2 f11 b^2/V about the vertical."""
    f11, f22, height, speed = 1e6, 1e6, 0.46, 8.0
    damping, stiffness = creeping(lone_axle(), speed)
    across = 2.0 * f22 / speed * np.outer([1.0, height, 0.0], [1.0, height, 0.0])
    about = 2.0 * f11 * HALF_M**2 / speed * np.outer([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])
    np.testing.assert_allclose(damping, across + about, rtol=1e-12, atol=1e-6)
    assert stiffness[0, 2] == 0.0


def test_independent_wheels_go_where_they_point_and_turn_freely():
    """F_y = -2 f22 (y'/V - psi): a force across for a yaw, none the other way, and no damping of the yaw."""
    axle = lone_axle()
    free = replace(axle, wheels=tuple(replace(wheel, spin=wheel.name) for wheel in axle.wheels))
    free = replace(free, spin_inertia_kgm2={wheel.spin: 50.0 for wheel in free.wheels})
    damping, stiffness = creeping(free, 8.0)
    assert damping[2, 2] == 0.0
    assert stiffness[0, 2] == pytest.approx(-2e6)
    assert stiffness[2, 0] == 0.0


def test_an_axle_that_nothing_holds_in_yaw_is_refused_where_it_goes_where_it_points():
    axle = lone_axle()
    free = replace(axle, wheels=tuple(replace(wheel, spin=wheel.name) for wheel in axle.wheels))
    free = replace(free, spin_inertia_kgm2={wheel.spin: 50.0 for wheel in free.wheels})
    with pytest.raises(InputError, match="that nothing holds"):
        modes_of(linear_vehicle(free, SUPPORT, speed_mps=8.0), step_s=5e-4)
    modes_of(linear_vehicle(free, SUPPORT), step_s=5e-4)


def test_contacts_that_hardly_creep_hold():
    """At a speed that goes to 0 the axles roll about the rails, and sway with it, as without creep."""
    model = vehicle("manchester_1")
    held, slow = linear_vehicle(model, SUPPORT), linear_vehicle(model, SUPPORT, speed_mps=1e-4)
    for frequency in (6.0, 20.0, 60.0):
        expected, found = held.response(frequency), slow.response(frequency)
        for body, motion in (("axle_f1", ROLL), ("axle_f1", SWAY), ("frame_front", ROLL), ("body", HEAVE)):
            rows = held.row(body, motion) @ expected, slow.row(body, motion) @ found
            np.testing.assert_allclose(rows[1], rows[0], rtol=2e-3, atol=1e-3 * np.abs(rows[0]).max())


def test_creep_coefficients_go_with_the_area_of_the_contact():
    """f = G a b C(a/b) (Kalker): with the load to the power 2/3, and f11 over f22 as C11 over C22, 1 to 1.3.

    How much the profiles are smoothed goes with the load, too: some percent of the coefficients.
    """
    model = vehicle("manchester_1")
    whole, half = creep_coefficients_n(model), creep_coefficients_n(model, gravity_mps2=9.81 / 2.0)
    for one, other in zip(whole, half, strict=True):
        np.testing.assert_allclose(other / one, 0.5 ** (2.0 / 3.0), rtol=0.05)
    assert np.all((whole[0] / whole[1] > 1.0) & (whole[0] / whole[1] < 1.32))
    assert creep_coefficients_n(lone_axle())[1].tolist() == [1e6, 1e6]


def held_frequencies(model):
    """Frequencies and damping of the model with its axles held in all but pitch."""
    linear = linear_vehicle(model, None)
    axles = set(model.axle_names)
    free = [i for i, (body, k) in enumerate(linear.coordinates) if body not in axles or k == PITCH]
    n, d = len(linear.coordinates), len(linear.series)
    a, _ = state_space(linear)
    rows = np.array([*free, *(n + i for i in free), *range(2 * n, 2 * n + d)], dtype=int)
    found = np.linalg.eigvals(a[np.ix_(rows, rows)])
    return found[found.imag > 2.0 * np.pi * 3.0]


@pytest.mark.parametrize("name", ["manchester_1", "metro_car_gz18", "metro_irw_bogie", "irw_car"])
def test_same_vehicle_as_the_engines_ride(name):
    """Modes above 3 Hz of the vehicle on held axles, from the linearised right-hand side of the engines.

    That has what preloads add to stiffness, which this model leaves out: some percent of some hertz.
    """
    model = vehicle(name)
    running = running_vehicle(model)
    matrix, _ = running.held(running.linearised(10.0))
    expected = np.linalg.eigvals(matrix)
    expected = expected[expected.imag > 2.0 * np.pi * 3.3]
    found = held_frequencies(model)
    assert len(expected) >= 3
    for value in expected:
        assert np.abs(found - value).min() < 0.03 * np.abs(value)


def test_contact_stiffness_is_three_halves_of_load_over_approach():
    """Hertz: N = c d^1.5, so that halving the load takes the cube root of it off the stiffness."""
    model = vehicle("manchester_1")
    whole = contact_stiffness_npm(model)
    half = contact_stiffness_npm(model, gravity_mps2=9.81 / 2.0)
    np.testing.assert_allclose(half / whole, 0.5 ** (1.0 / 3.0), rtol=5e-3)


def test_bending_is_the_first_mode_of_a_free_beam():
    bending = Bending("body", 10.0, 0.02, 26.0)
    x = np.linspace(-13.0, 13.0, 2001)
    rise, slope = np.array([bending.shape(float(at)) for at in x]).T
    mean = np.trapezoid(rise, x) / 26.0
    assert np.trapezoid(rise**2, x) / 26.0 == pytest.approx(1.0, rel=1e-5)  # modal mass = mass
    assert mean == pytest.approx(0.0, abs=1e-6)  # no net force on a free body
    np.testing.assert_allclose(np.gradient(rise, x)[5:-5], slope[5:-5], atol=1e-4)
    # Ends rise twice the rms, nodes lie at 0.2242 of the length (Blevins, Formulas for Natural Frequency).
    assert abs(rise[0]) == pytest.approx(2.0, rel=1e-3)
    nodes = x[:-1][np.diff(np.sign(rise)) != 0.0]
    assert (nodes[0] + 13.0) / 26.0 == pytest.approx(0.2242, abs=1e-3)


def test_a_free_body_bends_at_its_frequency():
    """On springs of next to nothing a body bends as a free one does."""
    model = vehicle("manchester_1")
    linear = linear_vehicle(model, None, bending=[Bending("body", 25.0, 0.02, 26.0)])
    found = frequencies(linear)
    assert np.abs(found / 25.0 - 1.0).min() < 0.03  # what springs of some hertz add


def test_no_axle_bends():
    with pytest.raises(InputError, match="cannot bend") as caught:
        linear_vehicle(vehicle("manchester_1"), None, bending=[Bending("axle_f1", 10.0, 0.02, 20.0)])
    assert "body" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "cars", "carriers"),
    [
        ("manchester_1", {"body"}, {"frame_front", "frame_rear"}),
        ("metro_irw_bogie", {"body"}, {"frame"}),
        ("two_axle_wagon", {"body"}, {"front", "rear"}),
        (
            "metro_irw_train",
            {"body_front", "body_middle", "body_rear"},
            {"frame_front", "frame_rear", "body_front", "body_rear"},
        ),
    ],
)
def test_car_bodies(name, cars, carriers):
    found = car_bodies(vehicle(name))
    assert {car.name for car in found} == cars
    assert {carrier for car in found for carrier in car.carriers} == carriers
