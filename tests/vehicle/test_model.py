"""Suspension elements against closed forms, third law, and the switches of a vehicle file."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from simrail.core.toml_files import judge, load, parse_toml, shipped
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact.contact import Motion, RailHere
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.linear_contact import linear_wheel_force
from simrail.vehicle.engines.force_data import memory_of, pack, states_of
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.records import LAW, LINK, POSE, ROTATION, SERIES, SPRING, STOP, WRENCH
from simrail.vehicle.engines.suspension_forces import (
    link_forces,
    series_forces,
    spring_forces,
    stop_forces,
)
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


def flat(records):
    """Records as rows of floats, the same memory."""
    return records.view(np.float64).reshape(len(records), -1)


def two(record):
    """Two records of zeros."""
    return np.zeros(2, record)


def poses(seed=0, turn=0.3):
    """Two bodies anywhere, moving and turning anyhow."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(2, 18))
    for row in rows:
        row[6:15] = Turn.from_rotvec(turn * rng.normal(size=3)).as_matrix().ravel()
    return rows.view(POSE)[:, 0]


def still():
    pose = two(POSE)
    pose["rotation"] = np.eye(3)
    return pose


def rotational(stiffness, damping):
    """A rotational spring and damper between the two bodies."""
    return np.array([(ROTATION, 0, 1, NOWHERE, NOWHERE, stiffness, damping, 0.0)], LINK)


def data_of(name):
    model = load(VehicleFile, "vehicle", name).model(name)
    track = load(TrackFile, "track", "level_straight").design("level_straight")
    laid = lay(track, Irregularity("none", (1.5, 100.0), 0.0), seed=0)
    return model, pack(model, laid, SpeedProfile(100.0, 200.0, 10.0), gravity_mps2=9.81)


ARMS = (0.3, -0.2, 0.5), (-0.4, 0.1, 0.7)
ENDS = (0, 1, *ARMS)
AT_CENTRES = (0, 1, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
NOWHERE = np.zeros((2, 3))
PIECES = np.array([(0.0, (0.0, 5e3, 0.0, 0.0)), (0.1, (0.0, 0.0, 1e3, 50.0))], LAW)
ELEMENTS = {
    "series": lambda pose, w: series_forces(
        np.array([(*ENDS, 1, 1e6, 2e4)], SERIES), pose, np.array([777.0]), w, np.zeros(1)
    ),
    "stop": lambda pose, w: stop_forces(np.array([(*ENDS, 2, 0, 0, 2)], STOP), PIECES, pose, w),
    "rate law": lambda pose, w: stop_forces(np.array([(*ENDS, 0, 1, 0, 2)], STOP), PIECES, pose, w),
    "rotation": lambda pose, w: link_forces(rotational((1e3, 2e3, 3e3), (10.0, 20.0, 30.0)), pose, w),
}


@pytest.mark.parametrize("name", ELEMENTS)
def test_action_is_reaction(name):
    """Forces cancel, and so do moments about any point: both act at the outer attachment."""
    pose, wrenches = poses(), two(WRENCH)
    ELEMENTS[name](pose, wrenches)
    wrench = flat(wrenches)
    assert np.abs(wrench).max() > 1.0
    np.testing.assert_allclose(wrench[0, :3], -wrench[1, :3], rtol=1e-12)
    places = np.column_stack([pose[axis] for axis in "xyz"])
    if name == "rotation":
        np.testing.assert_allclose(wrench[0, 3:], -wrench[1, 3:], rtol=1e-12)
    else:
        point = places[1] + pose["rotation"][1] @ ARMS[1]
        free = wrench[:, 3:] - np.cross(point - places, wrench[:, :3])
        np.testing.assert_allclose(free, 0.0, atol=1e-9 * np.abs(wrench[:, :3]).max())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_axis_elements_share_the_springs_kinematics(axis):
    """A stop with a linear law is a spring, and with one over the rate a damper, in any pose."""
    for seed in range(5):
        pose = poses(seed)
        for rate in (0, 1):
            one, other = two(WRENCH), two(WRENCH)
            linear = np.array([(0.0, (0.0, 0.0, 1e3, 0.0))], LAW)
            stop_forces(np.array([(*ENDS, axis, rate, 0, 1)], STOP), linear, pose, one)
            only = np.where(np.arange(3) == axis, 1e3, 0.0)
            factors = (np.zeros(3), only) if rate else (only, np.zeros(3))
            spring_forces(np.array([(*ENDS, *factors, 0.0)], SPRING), pose, other)
            np.testing.assert_allclose(flat(one), flat(other), rtol=1e-10, atol=1e-9)


def test_series_damper_has_the_impedance_of_its_chain():
    """Force over a sinusoidal stretch: k c i w / (k + c i w), to 1e-6, at three frequencies."""
    k, c, step = 6e6, 2e4, 1e-5
    for w in (20.0, 300.0, 2000.0):
        force, rate, pose = np.zeros(1), np.zeros(1), still()
        row = np.array([(*AT_CENTRES, 1, k, c)], SERIES)
        expected = k * c * 1j * w / (k + c * 1j * w)
        force[0] = expected.real  # the steady state at t = 0 of a stretch cos(w t)
        for i in range(2000):
            rates = []
            for at, shift in ((0.0, 0.0), (0.5, 0.5), (0.5, 0.5), (1.0, 1.0)):
                pose["vy"][1] = -w * np.sin(w * (i + at) * step)
                trial = force + shift * step * (rates[-1] if rates else 0.0)
                series_forces(row, pose, trial, two(WRENCH), rate)
                rates.append(rate.copy())
            force = force + step / 6.0 * (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3])
        steady = (expected * np.exp(1j * w * 2000 * step)).real
        assert force[0] == pytest.approx(steady, abs=1e-6 * abs(expected))


def test_anti_roll_bar_is_a_moment_by_angle():
    """940 kN m/rad and 10 mrad give 9.4 kN m about X, and nothing else."""
    pose, wrenches = still(), two(WRENCH)
    pose["rotation"][1] = Turn.from_rotvec([0.010, 0.0, 0.0]).as_matrix()
    link_forces(rotational((940e3, 0.0, 0.0), (0.0, 0.0, 0.0)), pose, wrenches)
    wrench = flat(wrenches)
    np.testing.assert_allclose(wrench[0], [0, 0, 0, 9400.0, 0, 0], rtol=2e-5, atol=1e-9)
    np.testing.assert_allclose(wrench[1], -wrench[0])


def test_lateral_bump_stop_goes_through_its_published_points():
    """Manchester's table, odd in the deflection, continuous with its slope."""
    _, data = data_of("manchester_1")
    row = data.stops[:1].copy()
    row["inner"], row["outer"], row["inner_arm"], row["outer_arm"] = AT_CENTRES

    def force(y):
        pose, wrench = still(), two(WRENCH)
        pose["y"][1] = y
        stop_forces(row, data.laws, pose, wrench)
        return wrench["fy"][0]

    for y, expected in ((0.02, 0.0), (0.025, 0.0), (0.03, 600.0), (0.05, 11580.0), (0.065, 230e3)):
        assert force(y) == pytest.approx(expected, abs=1e-6)
        assert force(-y) == pytest.approx(-expected, abs=1e-6)
    assert force(0.07) == pytest.approx(230e3 + 0.005 * (230e3 - 29.2e3) / 0.005)
    for y in (0.025, 0.03, 0.05, 0.06):
        left, right = (force(y + h) - force(y + h - 1e-7) for h in (0.0, 1e-7))
        assert left == pytest.approx(right, abs=0.05)


def test_states_are_creep_states_then_series_dampers():
    model, data = data_of("manchester_1")
    assert len(model.series) == 4 * 2 + 2 * 4
    assert states_of(data) == 4 * 8 + 16
    _, plain = data_of("metro_irw_bogie")
    assert states_of(plain) == 16


def evaluate(data, spin, rates):
    """Wrench on the first body of a vehicle at rest in its place, with a spin and an angular rate."""
    pose = np.zeros(len(data.bodies), POSE)
    pose["rotation"] = np.eye(3)
    # High over the rails: no contact.
    pose["x"], pose["z"] = 100.0, 5.0
    pose["wx"][0], pose["wy"][0], pose["wz"][0] = rates
    wrench, memory = np.zeros(len(pose), WRENCH), memory_of(len(data.axles))
    memory.axle_memos["s_m"] = 100.0
    states, torque = np.zeros(states_of(data)), np.zeros(len(data.spins))
    forces(0.0, pose, np.full(len(torque), spin), states, data, wrench, torque, states.copy(), memory)
    return np.array(wrench[0].tolist())


@pytest.mark.parametrize("name", ["irw_axle", "two_axle_wagon"])
def test_gyroscopic_moment_and_its_switch(name):
    """-omega x h of both wheels' spin; nothing of it with the switch off."""
    model, data = data_of(name)
    rates = np.array([0.1, 0.0, 0.2])
    moment = (evaluate(data, 100.0, rates) - evaluate(data, 0.0, rates))[3:]
    inertia = sum(model.spin_inertia_kgm2.values()) / len(model.axle_names)
    np.testing.assert_allclose(moment, -np.cross(rates, [0.0, inertia * 100.0, 0.0]), rtol=1e-9)
    options = data.options.copy()
    options["gyroscopic"] = 0
    off = data._replace(options=options)
    np.testing.assert_array_equal(evaluate(off, 100.0, rates), evaluate(off, 0.0, rates))
    assert replace(model, gyroscopic=False).gyroscopic is False


def test_wheelset_masses_add_up_to_the_source():
    """Manchester's wheelset: 1813 kg, 1120 kg m2 in roll and yaw, 112 kg m2 of spin."""
    model, _ = data_of("manchester_1")
    axle = model.bodies[0]
    assert axle.mass_kg == pytest.approx(1813.0)
    assert axle.inertia_kgm2[0] == pytest.approx(1120.0)
    assert axle.inertia_kgm2[2] == pytest.approx(1120.0)
    assert model.spin_inertia_kgm2[axle.name] == pytest.approx(112.0)


def test_prescribed_contact_has_its_gravitational_stiffness():
    """A wheelset at rest, 1 mm off and turned by 2 mrad: -k y and -k psi, both wheels together."""
    model, data = data_of("suspended_wheelset")
    options = data.options.copy()
    options["gravitational_stiffness"], options["gravitational_yaw_stiffness"] = 0.5 * 4e5, 0.5 * -7e3
    force = moment = vertical = 0.0
    for side in (1.0, -1.0):
        motion, load = Motion(1e-3, 0.0, psi=2e-3), data.wheels["load_n"][0]
        out = linear_wheel_force(
            options[0], data.const[0], load, side, motion, RailHere(0.0), np.zeros(4), np.zeros(4)
        )
        assert out.flag == 1
        force, moment, vertical = force + out.fy, moment + out.mz, vertical + out.fz
    assert force == pytest.approx(-4e5 * 1e-3)
    assert moment == pytest.approx(7e3 * 2e-3)
    assert vertical == pytest.approx(np.sum(model.wheel_load_n(9.81)))


def test_creep_law_of_the_file_reaches_the_contact():
    """Polach's law, chosen in the file, is what the wheels' table holds; nothing said is SHE."""
    text = shipped("vehicle")["metro_irw_bogie"].read_text(encoding="utf-8")
    chosen = text.replace("[guide]", '[creep]\nlaw = "polach"\nslip = 0.4\n\n[guide]')
    plain, polach = (
        contacts_of(judge(VehicleFile, parse_toml(one, file="v"), file="v").model("v")).tables[0].const
        for one in (text, chosen)
    )
    assert (plain["creep_law"], polach["creep_law"]) == (0.0, 1.0)
    assert polach["polach_slip"] == 0.4


def test_a_vehicle_shows_its_whole_mass_and_every_radius_of_its_wheels() -> None:
    """A body of 32 t, two frames of 2615 kg, four wheelsets of 613 and two wheels of 600 kg."""
    model = load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")
    name, facts = model._facts()
    assert name == "manchester_1" and facts["mass"] == "44,482 kg"
    assert facts["wheels"] == "8 of 0.46 m radius"
    assert str(facts["is"]).startswith("synthetic: ") == model.synthetic
