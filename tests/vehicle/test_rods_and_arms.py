"""Rods and trailing arms against closed forms: statics, pendulums, energy; what a vehicle file refuses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, load, parse_toml, shipped
from simrail.vehicle.engines.records import ARMS, LINK, POSE, ROD, WRENCH
from simrail.vehicle.engines.suspension_forces import link_forces
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle
from simrail.vehicle.model import Body, Rod
from simrail.vehicle.stability import modes_of

G = 9.81
K, C, LENGTH = 3e5, 4e3, 1.1
PLACES = np.array([[0.3, -0.2, 0.5], [-0.4, 0.1, 0.7]])
"""Of a rod's ends on its bodies."""
ARM_K, ARM_C = np.array([17e6, 9e6, 5e6]), np.array([1e4, 2e4, 3e4])
ON_AXLE = np.array([[-0.48, 1.055, 0.0135], [-0.48, -1.055, 0.0135]])
ON_FRAME = np.add(ON_AXLE, (1.3, 0.0, -0.1))


def anywhere(seed, *, turn=2.0, apart=(0.0, 0.0, 0.0), relative=2.0):
    """Two moving bodies, turned far; the second by up to ``relative`` rad against the first."""
    rng = np.random.default_rng(seed)
    pose = np.zeros(2, POSE)
    for name in ("x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"):
        pose[name] = rng.normal(size=2)
    first = Turn.from_rotvec(turn * rng.normal(size=3))
    second = first * Turn.from_rotvec(relative * rng.normal(size=3))
    pose["rotation"] = first.as_matrix(), second.as_matrix()
    if np.any(apart):
        place = np.array(list(pose[["x", "y", "z"]][0])) + first.apply(apart + 0.01 * rng.normal(size=3))
        pose["x"][1], pose["y"][1], pose["z"][1] = place
    return pose


def numbers(records):
    return records.view(np.float64).reshape(len(records), -1)


def points(pose, k, places):
    """Places and velocities of points of body k."""
    row = pose[k]
    arm = places @ row["rotation"].T
    at = np.array([row["x"], row["y"], row["z"]]) + arm
    speed = np.array([row["vx"], row["vy"], row["vz"]])
    return at, speed + np.cross([row["wx"], row["wy"], row["wz"]], arm)


def rod(stiffness=K, damping=C, places=PLACES, length=LENGTH):
    inner, outer = ((place, np.zeros(3)) for place in places)
    row = (ROD, 0, 1, inner, outer, (stiffness, 0.0, 0.0), (damping, 0.0, 0.0), length)
    return np.array([row], LINK)


def arms(stiffness=ARM_K, damping=ARM_C, on_axle=ON_AXLE, on_frame=ON_FRAME):
    return np.array([(ARMS, 0, 1, on_axle, on_frame, stiffness, damping, 0.0)], LINK)


def wrenches(links, pose):
    out = np.zeros(2, WRENCH)
    link_forces(links, pose, out)
    return numbers(out)


@pytest.mark.parametrize("seed", range(5))
def test_a_rod_pulls_along_its_line_at_any_rotation(seed):
    """K (L - L0) + C L' at both ends, with nothing but this force at the two points: to 1e-9."""
    pose = anywhere(seed)
    (a, va), (b, vb) = points(pose, 0, PLACES[0]), points(pose, 1, PLACES[1])
    length = np.linalg.norm(b - a)
    line = (b - a) / length
    force = (K * (length - LENGTH) + C * (vb - va) @ line) * line
    found = wrenches(rod(), pose)
    for k, (sign, place) in enumerate(((1.0, PLACES[0]), (-1.0, PLACES[1]))):
        arm = pose["rotation"][k] @ place
        expected = np.concatenate([sign * force, np.cross(arm, sign * force)])
        np.testing.assert_allclose(found[k], expected, rtol=1e-9, atol=1e-9 * np.abs(force).max())


def test_a_conical_pendulum_on_a_rod():
    """At 70 degrees a weight on a rod that its turning stretches feels just what its circle asks for."""
    mass, angle = 50.0, np.deg2rad(70.0)
    length = LENGTH + mass * G / np.cos(angle) / K
    radius = length * np.sin(angle)
    square = G / (length * np.cos(angle))  # of its angular rate
    pose = np.zeros(2, POSE)
    pose["rotation"] = np.eye(3)
    pose["x"][1], pose["z"][1] = radius, -length * np.cos(angle)
    pose["vy"][1] = np.sqrt(square) * radius
    found = wrenches(rod(places=np.zeros((2, 3))), pose)[1]
    expected = [-mass * square * radius, 0.0, mass * G, 0.0, 0.0, 0.0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-6 * mass * G)


def hung():
    """The wagon, with a gram hung in its body on four upright rods; half the rods' lengths and places."""
    wagon = load(VehicleFile, "vehicle", "two_axle_wagon").model("two_axle_wagon")
    x, y, length = 0.4, 0.3, 0.6
    weight = Body("weight", 1e-3, (4e-5, 5e-5, 6e-5), (0.0, 0.0, 1.2))
    rods = tuple(
        Rod(f"rod {i}", "body", "weight", (sx * x, sy * y, 1.2 + length), (sx * x, sy * y, 1.2), 3.0, 0.0)
        for i, (sx, sy) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1)))
    )
    return replace(wagon, bodies=(*wagon.bodies, weight), rods=rods), weight, x, y, length


def test_pendulums_on_rods_have_their_frequencies():
    """sqrt(g/L) along and across, sqrt(m g (x^2 + y^2)/(I L)) in yaw, to 1e-6; each rod bears a quarter."""
    model, weight, x, y, length = hung()
    np.testing.assert_allclose(model.rod_tension_n(G), 0.25 * weight.mass_kg * G, rtol=1e-9)
    vehicle = running_vehicle(model)
    found = modes_of(vehicle.linearised(5.0), vehicle)
    plain = np.sqrt(G / length) / (2.0 * np.pi)
    square = weight.mass_kg * G * (x**2 + y**2) / (weight.inertia_kgm2[2] * length)
    for direction, expected in (
        ("longitudinal", plain),
        ("lateral", plain),
        ("yaw", np.sqrt(square) / (2.0 * np.pi)),
    ):
        mode = max(found, key=lambda m: m.shares["weight", direction])
        assert mode.shares["weight", direction] > 0.99
        assert mode.natural_frequency_hz == pytest.approx(expected, rel=1e-6)


def test_rods_that_thrust_a_body_aside_are_refused():
    """One inclined rod that bears weight pushes; in a pair the thrusts balance, and each bears more."""
    model, weight, x, _, length = hung()
    weight = replace(weight, mass_kg=100.0)
    model, top = replace(model, bodies=(*model.bodies[:-1], weight)), 1.2 + length
    one = Rod("link", "body", "weight", (0.2, 0.0, top), (0.0, 0.0, 1.2), 3e5, 0.0)
    with pytest.raises(InputError, match=r"push it aside.*found 'a thrust of [1-9]"):
        replace(model, rods=(one,)).wheel_load_n(G)
    pair = tuple(replace(one, name=f"link {s}", inner_position_m=(s * x, 0.0, top)) for s in (1, -1))
    slope = length / np.hypot(length, x)
    tension = replace(model, rods=pair).rod_tension_n(G)
    np.testing.assert_allclose(tension, 0.5 * weight.mass_kg * G / slope, rtol=1e-9)


def seen_by_the_axle(pose):
    """Bushings (2, 3) from the axle's centre in the axle's axes, and their rates in these turning axes."""
    at, speed = points(pose, 1, ON_FRAME)
    centre, own = points(pose, 0, np.zeros(3))
    turn = pose["rotation"][0]
    omega = [pose["wx"][0], pose["wy"][0], pose["wz"][0]]
    way = at - centre
    return way @ turn, (speed - own - np.cross(omega, way)) @ turn


def turn_about_axle(way):
    """Angle of each arm about +Y from its place at rest."""
    angle = np.arctan2(way[:, 0], way[:, 2]) - np.arctan2(ON_AXLE[:, 0], ON_AXLE[:, 2])
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def potential(pose):
    """Energy of both arms, from the docstring of the kernel."""
    way, _ = seen_by_the_axle(pose)
    rest = np.hypot(ON_AXLE[:, 0], ON_AXLE[:, 2])
    stretch = np.hypot(way[:, 0], way[:, 2]) - rest
    turn = np.mean(turn_about_axle(way))
    side = way[:, 1] - ON_AXLE[:, 1]
    return 0.5 * (ARM_K[0] * stretch @ stretch + ARM_K[1] * side @ side) + ARM_K[2] * rest[0] ** 2 * turn**2


@pytest.mark.parametrize("seed", range(4))
def test_arms_forces_are_the_slope_of_their_energy(seed):
    """Forces and moments on both bodies, far from rest, by central differences: to 1e-6."""
    pose = anywhere(seed, apart=(-1.3, 0.0, 0.1), relative=0.05)
    found = wrenches(arms(damping=np.zeros(3)), pose)
    step, expected = 1e-5, np.zeros((2, 6))
    for k in range(2):
        for i in range(6):
            sides = []
            for sign in (1.0, -1.0):
                moved = pose.copy()
                if i < 3:
                    moved["xyz"[i]][k] += sign * step
                else:
                    push = Turn.from_rotvec(sign * step * np.eye(3)[i - 3]).as_matrix()
                    moved["rotation"][k] = push @ pose["rotation"][k]
                sides.append(potential(moved))
            expected[k, i] = (sides[1] - sides[0]) / (2.0 * step)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(4))
def test_arms_damping_takes_the_power_of_its_rates(seed):
    """c_x r'^2 + c_y y'^2 of each arm and 2 c_z r0^2 T'^2 of both, the rates by differences in time."""
    pose = anywhere(seed, apart=(-1.3, 0.0, 0.1), relative=0.05)
    pose["rotation"] = Turn.from_matrix(pose["rotation"]).as_matrix()
    found = wrenches(arms(stiffness=np.zeros(3)), pose)
    motion = np.array([[row[n] for n in ("vx", "vy", "vz", "wx", "wy", "wz")] for row in pose])
    dt, sides = 1e-6, []
    for sign in (1.0, -1.0):
        moved = pose.copy()
        for k in range(2):
            for i, name in enumerate("xyz"):
                moved[name][k] += sign * dt * motion[k, i]
            turn = Turn.from_rotvec(sign * dt * motion[k, 3:]).as_matrix()
            moved["rotation"][k] = turn @ pose["rotation"][k]
        way, _ = seen_by_the_axle(moved)
        sides.append((np.hypot(way[:, 0], way[:, 2]), way[:, 1], np.mean(turn_about_axle(way))))
    stretch, side, turn = ((a - b) / (2.0 * dt) for a, b in zip(*sides, strict=True))
    square = ON_AXLE[0, 0] ** 2 + ON_AXLE[0, 2] ** 2
    power = ARM_C[0] * stretch @ stretch + ARM_C[1] * side @ side + 2.0 * ARM_C[2] * square * turn**2
    assert np.sum(found * motion) == pytest.approx(-power, rel=1e-6)


def at_rest(on_axle=ON_AXLE, on_frame=ON_FRAME):
    pose = np.zeros(2, POSE)
    pose["rotation"] = np.eye(3)
    pose["x"][1], pose["y"][1], pose["z"][1] = on_axle[0] - on_frame[0]
    return pose


def test_arms_hold_the_axle_in_pitch_and_in_line_but_not_in_roll():
    """Statics: 2 k_z r0^2 in pitch, 2 k along x (an arm lies almost level) and y; of k_z nothing in roll."""
    square = ON_AXLE[0, 0] ** 2 + ON_AXLE[0, 2] ** 2
    small = 1e-7
    pose = at_rest()
    pose["rotation"][0] = Turn.from_rotvec([0.0, small, 0.0]).as_matrix()
    found = wrenches(arms(), pose)[0]
    assert found[4] / small == pytest.approx(-2.0 * ARM_K[2] * square, rel=1e-6)
    # Along x both arms stretch, and both turn by z/r0^2: k_x (x/r)^2 + k_z (z/r)^2 of each.
    cos2, sin2 = ON_AXLE[0, 0] ** 2 / square, ON_AXLE[0, 2] ** 2 / square
    for axis, expected in (("x", ARM_K[0] * cos2 + ARM_K[2] * sin2), ("y", ARM_K[1])):
        pose = at_rest()
        pose[axis][0] = small
        found = wrenches(arms(), pose)[0]
        assert found["xy".index(axis)] / small == pytest.approx(-2.0 * expected, rel=1e-6)
    # In roll an arm's far end moves by y upward across it: z/r of that stretches it.
    pose = at_rest()
    pose["rotation"][0] = Turn.from_rotvec([small, 0.0, 0.0]).as_matrix()
    found = wrenches(arms(), pose)[0]
    expected = 2.0 * (ARM_K[0] * sin2 * ON_AXLE[0, 1] ** 2 + ARM_K[1] * ON_AXLE[0, 2] ** 2)
    assert found[3] / small == pytest.approx(-expected, rel=1e-6)
    assert expected < 5e-3 * 2.0 * ARM_K[2] * ON_AXLE[0, 1] ** 2


def test_a_weight_that_hangs_on_arms_swings_as_a_pendulum():
    """Upright arms of no vertical stiffness: the weight's restoring force is m g/r times its way, to 1e-6."""
    mass, r0 = 400.0, 0.7
    upright = np.array([[0.0, 1.0, -r0], [0.0, -1.0, -r0]])
    flat = upright * [1.0, 1.0, 0.0]
    loose = arms(stiffness=(2e6, 9e6, 0.0), damping=np.zeros(3), on_axle=upright, on_frame=flat)
    length = r0 + mass * G / (2.0 * 2e6)
    pose, way = at_rest(upright, flat), 1e-5
    pose["x"][1], pose["y"][1], pose["z"][1] = way, 0.0, -length
    found = wrenches(loose, pose)[1]
    assert found[2] == pytest.approx(mass * G, rel=1e-6)
    assert np.sqrt(-found[0] / way / mass) == pytest.approx(np.sqrt(G / length), rel=1e-6)


def test_roll_of_gz18s_axle_is_held_by_its_springs_alone():
    """2 k y^2 of the primary springs and 2 k_x y^2 of the slope of the arms (28 mm in a metre), to 1e-3."""
    model = load(VehicleFile, "vehicle", "metro_car_gz18").model("metro_car_gz18")
    pair = model.arms[0]
    axle, frame = model.body(pair.axle), model.body(pair.frame)
    way = np.subtract(pair.bushings_m, axle.position_m)
    record = arms(pair.stiffness_npm, np.zeros(3), way, np.subtract(pair.bushings_m, frame.position_m))
    pose, small = np.zeros(2, POSE), 1e-7
    pose["rotation"] = np.eye(3)
    for name, a, b in zip("xyz", axle.position_m, frame.position_m, strict=True):
        pose[name] = a, b
    pose["rotation"][0] = Turn.from_rotvec([small, 0.0, 0.0]).as_matrix()
    of_arms = -wrenches(record, pose)[0, 3] / small
    of_springs = sum(
        s.stiffness_npm[2] * s.position_m[1] ** 2 for s in model.suspensions if s.inner == pair.axle
    )
    assert of_springs == pytest.approx(2.0 * 1.4e6)
    assert of_arms < 0.02 * of_springs


def test_irw_cars_traction_rods_turn_its_bogies_back():
    """2 k y^2 = 2 x 2e7 x 0.185^2 N m/rad between body and bogie, which a rod on the centre line has not."""
    model = load(VehicleFile, "vehicle", "irw_car").model("irw_car")
    for end in ("front", "rear"):
        of = [s for s in model.suspensions if f"traction rods {end}" in s.name]
        centre = model.body(f"frame_{end}").position_m[1]
        found = sum(s.stiffness_npm[0] * (s.position_m[1] - centre) ** 2 for s in of)
        assert found == pytest.approx(2.0 * 2e7 * 0.185**2)
        assert sum(s.stiffness_npm[0] for s in of) == pytest.approx(4e7)


@pytest.mark.parametrize("axle", ["axle_f1", "axle_f2", "axle_r1", "axle_r2"])
def test_irw_cars_guiding_rods_let_an_axle_yaw_about_their_meeting_point(axle):
    """No moment about the point 1.68 m inboard, where the lines of the two rods meet; 2 k cos^2 along."""
    model = load(VehicleFile, "vehicle", "irw_car").model("irw_car")
    pair = [r for r in model.rods if r.outer == axle]
    assert len(pair) == 2
    centre = np.array(model.body(axle).position_m)
    way = np.subtract(pair[0].outer_position_m, pair[0].inner_position_m)
    assert np.linalg.norm(way) == pytest.approx(0.8305, abs=5e-5)
    inboard = -np.sign(way[0]) * 0.235 * abs(way[0]) / 0.115
    assert abs(inboard) == pytest.approx(1.68, abs=1e-3)

    def rods_moment(turn, pivot_x):
        """Moment about a point of the rods on the axle that has turned about it."""
        pose = np.zeros(2, POSE)
        rotation = Turn.from_rotvec([0.0, 0.0, turn]).as_matrix()
        pose["rotation"] = np.eye(3), rotation
        arm = np.array([pivot_x, 0.0, 0.0])
        pose["x"][1], pose["y"][1], pose["z"][1] = centre + arm - rotation @ arm
        records = [
            rod(
                r.stiffness_npm,
                0.0,
                (r.inner_position_m, np.subtract(r.outer_position_m, centre)),
                r.length_m,
            )
            for r in pair
        ]
        on_axle = wrenches(np.concatenate(records), pose)[1]
        return on_axle[5] + np.cross(rotation @ -arm, on_axle[:3])[2]

    about_axle = -rods_moment(1e-6, 0.0) / 1e-6
    assert about_axle == pytest.approx(2.0 * 1e8 * (0.235 * way[0] / 0.8305) ** 2, rel=1e-3)
    assert abs(rods_moment(1e-6, inboard) / 1e-6) < 1e-4 * about_axle


ARM = (
    '[[trailing_arm]]\nname = "axle-box arms f1"\nbetween = ["axle_f1", "frame_front"]\n'
    "bushings_m = [[8.62, 1.055, 0.4335], [8.62, -1.055, 0.4335]]"
)
ROD_ENDS = "ends_m = [[[9.1775, 0.12, 0.36], [10, 0.235, 0.36]], "


@pytest.mark.parametrize(
    ("vehicle", "old", "new", "words"),
    [
        ("metro_car_gz18", ARM, ARM.replace('"axle_f1"', '"body"'), ["trailing_arm[0].between", "axle_f1"]),
        ("metro_car_gz18", ARM, ARM.replace('"axle_f1"', '"axle_x"'), ["trailing_arm[0].between", "axle_x"]),
        (
            "metro_car_gz18",
            ARM,
            ARM.replace("[8.62, -1", "[8.62, 1"),
            ["trailing_arm[0].bushings_m", "y > 0"],
        ),
        ("metro_car_gz18", ARM, ARM.replace("8.62", "9.1"), ["trailing_arm[0].bushings_m", "axle's 9.1"]),
        ("irw_car", ROD_ENDS, ROD_ENDS.replace("[10, 0.235", "[9.1775, 0.12"), ["rod[0].ends_m", "length"]),
        ("irw_car", "stiffness_npm = 100000000.0", "stiffness_npm = 0.0", ["rod[0].stiffness_npm"]),
    ],
)
def test_what_a_file_may_not_say_of_rods_and_arms(vehicle, old, new, words):
    """One message that names the field and its limit."""
    text = shipped("vehicle")[vehicle].read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(InputError) as refused:
        judge(VehicleFile, parse_toml(text.replace(old, new, 1), file="v"), file="v")
    for word in words:
        assert word in str(refused.value)
