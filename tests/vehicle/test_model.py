"""Suspension elements against closed forms, third law, and the switches of a vehicle file."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from simrail.core.toml_files import judge, load, parse_toml, shipped
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact.contact_geometry import CONSTANTS
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.linear_contact import linear_wheel_force
from simrail.vehicle.engines.force_data import pack, states_of
from simrail.vehicle.engines.forces import forces
from simrail.vehicle.engines.suspension_forces import series_forces, spring_forces, stop_forces, turn_forces
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


def poses(seed=0, turn=0.3):
    """Two bodies anywhere, moving and turning anyhow: rows of `pose`."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(2, 18))
    for row in rows:
        row[6:15] = Turn.from_rotvec(turn * rng.normal(size=3)).as_matrix().ravel()
    return rows


def still():
    rows = np.zeros((2, 18))
    rows[:, 6:15] = np.eye(3).ravel()
    return rows


def data_of(name):
    model = load(VehicleFile, "vehicle", name).model(name)
    track = load(TrackFile, "track", "level_straight").design("level_straight")
    laid = lay(track, Irregularity("none", (1.5, 100.0), 0.0), seed=0)
    return model, pack(model, laid, SpeedProfile(100.0, 200.0, 10.0), gravity_mps2=9.81)


ENDS = [0.0, 1.0, 0.3, -0.2, 0.5, -0.4, 0.1, 0.7]
LAW = np.array([[0.0, 0.0, 5e3, 0.0, 0.0], [0.1, 0.0, 0.0, 1e3, 50.0]])
ELEMENTS = {
    "series": lambda pose, w: series_forces(
        np.array([[*ENDS, 1.0, 1e6, 2e4]]), pose, np.array([777.0]), w, np.zeros(1)
    ),
    "stop": lambda pose, w: stop_forces(np.array([[*ENDS, 2.0, 0.0, 0.0, 2.0]]), LAW, pose, w),
    "rate law": lambda pose, w: stop_forces(np.array([[*ENDS, 0.0, 1.0, 0.0, 2.0]]), LAW, pose, w),
    "rotation": lambda pose, w: turn_forces(np.array([[0.0, 1.0, 1e3, 2e3, 3e3, 10.0, 20.0, 30.0]]), pose, w),
}


def spring(stiffness, damping):
    return np.array([[*ENDS, *stiffness, *damping, 0.0, 0.0, 0.0]])


@pytest.mark.parametrize("name", ELEMENTS)
def test_action_is_reaction(name):
    """Forces cancel; moments cancel about either attachment, up to the stretch times the force."""
    pose, wrench = poses(), np.zeros((2, 6))
    ELEMENTS[name](pose, wrench)
    assert np.abs(wrench).max() > 1.0
    np.testing.assert_allclose(wrench[0, :3], -wrench[1, :3], rtol=1e-12)
    inner, outer = pose[0, 6:15].reshape(3, 3) @ ENDS[2:5], pose[1, 6:15].reshape(3, 3) @ ENDS[5:8]
    free = [wrench[k, 3:] - np.cross(arm, wrench[k, :3]) for k, arm in ((0, inner), (1, outer))]
    if name == "rotation":
        np.testing.assert_allclose(wrench[0, 3:], -wrench[1, 3:], rtol=1e-12)
    else:
        np.testing.assert_allclose(free, 0.0, atol=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_one_axis_elements_share_the_springs_kinematics(axis):
    """A stop with a linear law is a spring, and with one over the rate a damper, in any pose."""
    for seed in range(5):
        pose = poses(seed)
        for rate, law in ((0.0, 1e3), (1.0, 1e3)):
            one, other = np.zeros((2, 6)), np.zeros((2, 6))
            linear = np.array([[0.0, 0.0, 0.0, law, 0.0]])
            stop_forces(np.array([[*ENDS, float(axis), rate, 0.0, 1.0]]), linear, pose, one)
            only = np.where(np.arange(3) == axis, law, 0.0)
            spring_forces(spring(*((np.zeros(3), only) if rate else (only, np.zeros(3)))), pose, other)
            np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-9)


def test_series_damper_has_the_impedance_of_its_chain():
    """Force over a sinusoidal stretch: k c i w / (k + c i w), to 1e-6, at three frequencies."""
    k, c, step = 6e6, 2e4, 1e-5
    for w in (20.0, 300.0, 2000.0):
        force, rate, pose = np.zeros(1), np.zeros(1), still()
        row = np.array([[0.0, 1.0, *np.zeros(6), 1.0, k, c]])
        expected = k * c * 1j * w / (k + c * 1j * w)
        force[0] = expected.real  # the steady state at t = 0 of a stretch cos(w t)
        for i in range(2000):
            rates = []
            for at, shift in ((0.0, 0.0), (0.5, 0.5), (0.5, 0.5), (1.0, 1.0)):
                pose[1, 4] = -w * np.sin(w * (i + at) * step)
                trial = force + shift * step * (rates[-1] if rates else 0.0)
                series_forces(row, pose, trial, np.zeros((2, 6)), rate)
                rates.append(rate.copy())
            force = force + step / 6.0 * (rates[0] + 2.0 * rates[1] + 2.0 * rates[2] + rates[3])
        steady = (expected * np.exp(1j * w * 2000 * step)).real
        assert force[0] == pytest.approx(steady, abs=1e-6 * abs(expected))


def test_anti_roll_bar_is_a_moment_by_angle():
    """940 kN m/rad and 10 mrad give 9.4 kN m about X, and nothing else."""
    pose, wrench = still(), np.zeros((2, 6))
    pose[1, 6:15] = Turn.from_rotvec([0.010, 0.0, 0.0]).as_matrix().ravel()
    turn_forces(np.array([[0.0, 1.0, 940e3, 0.0, 0.0, 0.0, 0.0, 0.0]]), pose, wrench)
    np.testing.assert_allclose(wrench[0], [0, 0, 0, 9400.0, 0, 0], rtol=2e-5, atol=1e-9)
    np.testing.assert_allclose(wrench[1], -wrench[0])


def test_lateral_bump_stop_goes_through_its_published_points():
    """Manchester's table, odd in the deflection, continuous with its slope."""
    _, data = data_of("manchester_1")
    row = data.stops[:1].copy()
    row[0, :8] = 0.0, 1.0, *np.zeros(6)

    def force(y):
        pose, wrench = still(), np.zeros((2, 6))
        pose[1, 1] = y
        stop_forces(row, data.laws, pose, wrench)
        return wrench[0, 1]

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
    pose = np.zeros((len(data.bodies), 18))
    pose[:, 6:15] = np.eye(3).ravel()
    # High over the rails: no contact.
    pose[:, 0], pose[:, 2] = 100.0, 5.0
    pose[0, 15:] = rates
    wrench, memo = np.zeros((len(pose), 6)), np.zeros(2 + 5 * len(data.axles))
    memo[2::5] = 100.0
    states = np.zeros(states_of(data))
    forces(
        0.0, pose, np.full(len(data.spins), spin), states, *data, wrench, np.zeros(len(data.spins)),
        states.copy(), memo, np.zeros(34),
    )  # fmt: skip
    return wrench[0]


@pytest.mark.parametrize("name", ["irw_axle", "two_axle_wagon"])
def test_gyroscopic_moment_and_its_switch(name):
    """-omega x h of both wheels' spin; nothing of it with the switch off."""
    model, data = data_of(name)
    rates = np.array([0.1, 0.0, 0.2])
    moment = (evaluate(data, 100.0, rates) - evaluate(data, 0.0, rates))[3:]
    inertia = sum(model.spin_inertia_kgm2.values()) / len(model.axle_names)
    np.testing.assert_allclose(moment, -np.cross(rates, [0.0, inertia * 100.0, 0.0]), rtol=1e-9)
    switches = data.switches.copy()
    switches[0] = 0.0
    off = data._replace(switches=switches)
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
    switches = data.switches.copy()
    switches[9:11] = 0.5 * 4e5, 0.5 * -7e3
    force = moment = vertical = 0.0
    for side in (1.0, -1.0):
        out = np.zeros(8)
        flag = linear_wheel_force(
            switches, data.const[0], data.wheels[0, 5], side, 1e-3, 0.0, 0.0, 2e-3,
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0, np.zeros(4), np.zeros(4), out,
        )  # fmt: skip
        assert flag == 1
        force, moment, vertical = force + out[1], moment + out[5], vertical + out[2]
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
    law, slip = CONSTANTS.index("creep_law"), CONSTANTS.index("polach_slip")
    assert (plain[law], polach[law]) == (0.0, 1.0)
    assert polach[slip] == 0.4
