"""What is told of a contact is what acts: forces, creepages and its place, against algebra of their own."""

import numpy as np
import pytest

from simrail.core.toml_files import load
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact.contact import CONTACT, Motion, RailHere, wheel_force
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profiles import rail_60e1
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


def tell(contact, *, side=1.0, zeta=None, rail=None, **state):
    told, rate = np.zeros(1, CONTACT), np.zeros(4)
    told["wanted"] = 1
    zeta = np.zeros(4) if zeta is None else np.array(zeta, dtype=float)
    rail = rail or RailHere(float(contact.const["friction"]))
    motion = Motion(**{"y": 0.0, "z": 0.0} | {name: float(value) for name, value in state.items()})
    force = wheel_force(contact.patches, contact.const, side, motion, rail, zeta, rate, told[0])
    return told[0], force


def pressed(kernel, contact, *, side=1.0, by_m=60e-6, **state):
    """A wheel at the height at which it is pressed into its rail."""
    here = {"side": side} | {name: state.get(name, 0.0) for name in ("y", "phi", "psi")}
    return state | {"z": kernel.height_for(contact, here, by_m)}


def test_the_kernel_is_the_same_whether_or_not_it_tells(kernel):
    """Bit by bit: telling is reading."""
    contact = kernel.table()
    for state, zeta in kernel.random_states(40):
        flag, out, _ = kernel.call(contact, zeta, **state)
        motion = {name: state[name] for name in state if name in Motion._fields}
        rail = RailHere(
            float(contact.const["friction"]), *(state[f"{n}_rail"] for n in ("y", "z", "dy", "dz"))
        )
        _, force = tell(contact, side=state["side"], zeta=zeta, rail=rail, **motion)
        assert force.flag == flag
        np.testing.assert_array_equal(np.array(force[1:]), out)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("outward_mm", [0.0, 2.0, 4.5, 7.2])
def test_q_and_y_follow_from_normal_and_creep_force_at_the_contact_angle(kernel, side, outward_mm):
    """Q = N cos + T2 sin, Y = T2 cos - N sin in the left wheel's sense; one patch alone, and no roll."""
    contact = kernel.table()
    state = pressed(kernel, contact, side=side, y=side * 1e-3 * outward_mm)
    told, force = tell(
        contact, side=side, **state, V=20.0, v_x=20.0, W=20.0 / 0.46, zeta=[1e-4, 2e-3, 1e-4, 2e-3]
    )
    assert force.flag in (1, 2) and told["carried_n"] == force.normal
    c, s = np.cos(told["angle_rad"]), side * np.sin(told["angle_rad"])
    assert force.fz == pytest.approx(c * force.normal + s * told["creep_y_n"], rel=1e-12)
    assert force.fy == pytest.approx(c * told["creep_y_n"] - s * force.normal, rel=1e-12, abs=1e-9)
    assert force.fx == told["creep_x_n"]
    assert told["shift_m"] == pytest.approx(1e-3 * outward_mm, abs=1e-15)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("outward_mm", [-4.0, 1.5, 4.0, 5.6, 6.6, 7.5, 9.0])
def test_the_rail_lies_at_the_contact_angle_where_it_is_said_to_be_touched(kernel, side, outward_mm):
    """The angle is the rail's own at the abscissa told: within 0.01, where one place is touched.

    Away from the jumps of the contact (3.2 of NOTES: 2 degrees of the flange are 0.15 mm).
    """
    contact = kernel.table()
    head = incline(rail_60e1(), 1.0 / 40.0, gauge_depth_m=0.014)
    told, _ = tell(contact, side=side, **pressed(kernel, contact, side=side, y=side * 1e-3 * outward_mm))
    slope = -float(head.slope(np.array([told["rail_m"]]))[0])
    assert np.arctan(slope) == pytest.approx(told["angle_rad"], abs=0.01 + 0.03 * told["angle_rad"])
    assert told["rail_m"] < 0.0 if outward_mm > 5.0 else True


def test_creepages_are_slips_over_the_speed(kernel):
    """A wheel too fast by 0.2 % creeps back by as much; a yaw to the left of 3 mrad is -3e-3 across."""
    contact = kernel.table()
    for V in (20.0, -20.0):
        state = pressed(kernel, contact, psi=3e-3)
        told, force = tell(contact, **state, V=V, v_x=V, W=1.002 * V / 0.46)
        r = 0.46 + float(contact.piece("depth", 0.0)[0][3])
        assert told["creepage_x"] == pytest.approx(np.sign(V) * (1.0 - 1.002 * r / 0.46), abs=2e-5)
        assert told["creepage_y"] == pytest.approx(-np.sign(V) * 3e-3, rel=0.02)
        # A cone touched at an angle turns on its rail: W sin(angle) over V.
        assert told["spin_1pm"] == pytest.approx(-1.002 / 0.46 * np.sin(told["angle_rad"]), rel=5e-3)
        assert force.normal > 0.0


def test_steady_creep_states_are_the_creepages_told(kernel):
    """In steady rolling the contact's states have run into the creepages, to 1e-6."""
    contact = kernel.table()
    state = pressed(kernel, contact, y=2e-3, psi=2e-4) | {"V": 20.0, "v_x": 20.0, "W": 20.004 / 0.46}
    zeta, _ = kernel.settle(contact, **state)
    told, _ = tell(contact, zeta=zeta, **state)
    np.testing.assert_allclose(zeta[:2], [told["creepage_x"], told["creepage_y"]], rtol=0.0, atol=1e-6)


def test_at_rest_nothing_creeps_and_in_the_air_nothing_is_told(kernel):
    contact = kernel.table()
    told, force = tell(contact, **pressed(kernel, contact), zeta=[1e-4, 0.0, 0.0, 0.0])
    assert (told["creepage_x"], told["creepage_y"], told["spin_1pm"]) == (0.0, 0.0, 0.0)
    assert told["creep_x_n"] < 0.0 and force.normal > 0.0
    told, force = tell(contact, z=4e-3, V=20.0, v_x=20.0)
    assert force.flag == 0 and told["lift_m"] == pytest.approx(4e-3)
    for name in ("creep_x_n", "creep_y_n", "creepage_x", "creepage_y", "angle_rad", "carried_n"):
        assert told[name] == 0.0


def test_a_wheel_lifted_above_its_flange_is_derailed(kernel):
    """S1002's flange is 28 mm high (EN 13715): its tip then passes over the rail's head."""
    contact = kernel.table()
    assert contact.const["flange_height_m"] == pytest.approx(0.028, abs=1e-4)
    assert tell(contact, z=0.0279)[1].flag == 0
    assert tell(contact, z=0.0281)[1].flag == -1


@pytest.fixture(scope="module")
def both_engines():
    """The same 3 s on an irregular curve by both engines: contact (n, w) and accelerations."""
    model = load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")
    design = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    laid = lay(design, Irregularity("erri_b176_low", (1.5, 100.0), 20.0), seed=2)
    profile = SpeedProfile(150.0, 200.0, 12.0, rest_s=0.2, acceleration_mps2=3.0, jerk_mps3=30.0)
    setup = Setup(model, laid, profile, settle_s=1.0)
    return {
        engine: np.concatenate([part.contacts for part in engine(setup).run(3.0, segment_s=1.3)])
        for engine in (CompiledEngine, ExudynEngine)
    }


def test_both_engines_tell_the_same(both_engines):
    """Of one kernel at states that agree to 1e-10 m: forces to 1e-6 of the load, places to 1e-9 m."""
    compiled, exudyn = both_engines.values()
    assert compiled.shape == exudyn.shape == (3001, 4)
    np.testing.assert_array_equal(compiled["flag"], exudyn["flag"])
    for name in ("load_n", "guiding_n", "normal_n", "creep_x_n", "creep_y_n"):
        np.testing.assert_allclose(compiled[name], exudyn[name], rtol=0.0, atol=0.04)
    for name in ("position_m", "shift_m", "lift_m", "rail_m", "angle_rad", "creepage_x", "creepage_y"):
        np.testing.assert_allclose(compiled[name], exudyn[name], rtol=0.0, atol=1e-7)
