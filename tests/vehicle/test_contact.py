"""The contact kernel: a published benchmark, exact symmetries, kinematics, moments, and where it ends."""

import numpy as np
import pytest
from scipy.optimize import brentq

from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.creep_laws import LAWS, CreepLaw
from simrail.vehicle.contact.wheelset import contact_state

# Manchester contact benchmark, case A-2.2 (S1002 on UIC 60 1:40, 10 kN per wheel, mu 0.3, 2 m/s), from
# CONTACT's reference output (CONTACT, Apache-2.0). CONTACT has y to the right and z down, and gives
# forces on the rail. Per row: side (+1 left), y_ws, z_ws (mm), roll, yaw, pitch rate, ycp_w (mm),
# deltcp_tr, FN, FX_tr, FY_tr, pmax (MPa).
BENCHMARK = [
    (1, 0.0, 0.1981, 0.0, 0.0, -4.3481181, -1.8726, 0.029, 9997, 0.2783, -36.24, 338),
    (1, 0.5, 0.1945, -2.304e-05, 0.0012, -4.3474134, -4.7204, 0.0211, 10050, 887.1, -2582.0, 395),
    (1, 1.0, 0.184, -5.049e-05, 0.0024, -4.3465752, -6.2694, 0.0176, 10050, 829.2, -3070.0, 424),
    (1, 2.0, 0.153, -0.0001128, 0.0048, -4.3459197, -8.566, 0.0134, 10040, 546.3, -3096.0, 466),
    (1, 3.0, 0.1145, -0.0001803, 0.0072, -4.3451503, -10.3382, 0.011, 10030, 460.5, -3084.0, 499),
    (1, 4.0, 0.068, -0.0002557, 0.0096, -4.344093, -11.8167, 0.0096, 10030, 436.6, -3073.0, 527),
    (1, 5.0, 0.0019, -0.0003554, 0.012, -4.3353637, -13.1136, 0.0088, 10030, 837.8, -2977.0, 553),
    (-1, 0.0, 0.1981, 0.0, 0.0, -4.3481181, 1.8726, -0.029, 9997, 0.2783, 36.24, 338),
    (-1, 0.5, 0.1938, -2.304e-05, 0.0012, -4.3474134, -6.0075, -0.0568, 9870, -880.0, -2015.0, 632),
    (-1, 1.0, 0.1839, -5.049e-05, 0.0024, -4.3465752, -9.0305, -0.0696, 9827, -814.3, -2142.0, 741),
    (-1, 2.0, 0.1529, -0.0001128, 0.0048, -4.3459197, -11.1296, -0.0806, 9799, -517.3, -2095.0, 745),
    (-1, 3.0, 0.1143, -0.0001803, 0.0072, -4.3451503, -13.0963, -0.0923, 9774, -417.5, -1988.0, 713),
    (-1, 4.0, 0.0676, -0.0002557, 0.0096, -4.344093, -15.3505, -0.1078, 9745, -379.6, -1833.0, 664),
    (-1, 5.0, 0.0015, -0.0003554, 0.012, -4.3353637, -28.0471, -0.2905, 9619, -763.3, 131.6, 1556),
]


@pytest.mark.parametrize("row", BENCHMARK, ids=lambda r: f"{'left' if r[0] > 0 else 'right'}-{r[1]}")
def test_manchester_benchmark_a22(kernel, row):
    side, y, z, roll, yaw, pitch_rate, abscissa, angle, normal, fx, fy, pmax = row
    contact = kernel.table(10e3)
    state = {"side": side, "y": -y * 1e-3, "phi": roll, "psi": -yaw, "V": 2.0, "v_x": 2.0, "W": -pitch_rate}
    height = brentq(
        lambda h: settle_vertical(kernel, contact, state | {"z": h}) - 1e4, -1.5e-3, 1.5e-3, xtol=1e-10
    )
    _, out = kernel.settle(contact, **state, z=height)
    found = contact_state(contact, side, y_m=-y * 1e-3, z_m=height, roll_rad=roll, yaw_rad=-yaw)["tread"]
    flat, corner = y in (0.0, 0.5), (side < 0 and y == 5.0)
    assert height == pytest.approx(-z * 1e-3, abs=5e-6)
    assert -side * found["abscissa_m"] * 1e3 == pytest.approx(
        abscissa, abs=0.6 if corner else 0.3 if flat else 0.12
    )
    assert found["slope"] == pytest.approx(np.tan(side * angle), abs=0.004)
    assert out[6] == pytest.approx(normal, rel=2e-3)
    assert out[0] == pytest.approx(-fx, abs=150.0 if side < 0 and y == 0.5 else 120.0)
    assert out[1] == pytest.approx(fy, abs=300.0 if side < 0 and y == 0.5 else 80.0)
    # Pressure, from the creep factor and the ellipse that belongs to it.
    u = -side * y * 1e-3 + side * 0.46 * roll
    pressure = peak_pressure(contact, u, out[6])
    assert pressure == pytest.approx(pmax * 1e6, rel=0.15 if y <= 1.0 else 0.05 if y == 5.0 else 0.03)


def settle_vertical(kernel, contact, state):
    zeta = np.zeros(4)
    for _ in range(400):
        _, out, rate = kernel.call(contact, zeta, **state)
        zeta = zeta + 4e-4 * rate
    return out[2]


def peak_pressure(contact, u, normal):
    """3 N/(2 pi a b), the semi-axes from the table."""
    a, b = (np.polyval(*contact.piece(f"semi_axis_{n}", u)) for n in ("along", "across"))
    approach = (normal / contact.const["hertz_npm15"]) ** (2.0 / 3.0)
    return 1.5 * normal / (np.pi * a * b * approach)


@pytest.mark.parametrize("law", LAWS)
def test_left_and_right_are_mirror_images(kernel, law):
    contact = kernel.table(creep_law=CreepLaw(law))
    odd = {"y", "phi", "psi", "y_rail", "y_dot", "phi_dot", "psi_dot", "kappa_h", "dy_rail", "side"}
    mirror_out = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0])
    mirror_creep = np.array([1.0, -1.0, 1.0, -1.0])
    flags = set()
    for state, zeta in kernel.random_states(300):
        flag, out, rate = kernel.call(contact, zeta, **state)
        mirrored = {k: -v if k in odd else v for k, v in state.items()}
        flag2, out2, rate2 = kernel.call(contact, zeta * mirror_creep, **mirrored)
        flags.add(flag)
        assert flag == flag2
        assert np.allclose(out2, out * mirror_out, rtol=1e-12, atol=1e-12)
        assert np.allclose(rate2, rate * mirror_creep, rtol=1e-12, atol=1e-12)
    assert flags >= {1, 2}


@pytest.mark.parametrize("law", LAWS)
def test_running_backward_is_running_forward_seen_from_the_other_end(kernel, law):
    contact = kernel.table(creep_law=CreepLaw(law))
    # Half a turn about the vertical: x and y, and whatever points along them, change sign; the
    # derivatives by s keep theirs where the deviation turns too.
    odd = {"side", "y", "phi", "y_rail", "V", "v_x", "y_dot", "phi_dot", "W", "kappa_h", "dz_rail"}
    turn_out = np.array([-1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    for state, zeta in kernel.random_states(300, seed=8):
        flag, out, rate = kernel.call(contact, zeta, **state)
        turned = {k: -v if k in odd else v for k, v in state.items()}
        flag2, out2, rate2 = kernel.call(contact, -zeta, **turned)
        assert flag == flag2
        assert np.allclose(out2, out * turn_out, rtol=1e-12, atol=1e-12)
        assert np.allclose(rate2, -rate, rtol=1e-12, atol=1e-12)


def test_kernel_and_reading_agree_on_the_penetration(kernel):
    for state, zeta in kernel.random_states(100, seed=9):
        _, out, _ = kernel.call(kernel.table(), zeta, **state)
        found = contact_state(
            kernel.table(), state["side"], y_m=state["y"], z_m=state["z"], roll_rad=state["phi"],
            yaw_rad=state["psi"], y_rail_m=state["y_rail"], z_rail_m=state["z_rail"],
        )  # fmt: skip
        assert out[7] == pytest.approx(max(p["penetration_m"] for p in found.values()), rel=1e-12)


def test_a_wheel_that_follows_its_rail_does_not_slip(kernel):
    for state, zeta in kernel.random_states(50, seed=10):
        # The same relative motion by the wheel or by the rail.
        _, out, rate = kernel.call(kernel.table(), zeta, **state)
        moved = dict(state)
        for wheel, rail in (("y_dot", "dy_rail"), ("z_dot", "dz_rail")):
            moved[wheel] = state[wheel] + state["V"] * 1e-3
            moved[rail] = state[rail] + 1e-3
        _, out2, rate2 = kernel.call(kernel.table(), zeta, **moved)
        assert np.allclose(out, out2, rtol=1e-10, atol=1e-6)
        assert np.allclose(rate, rate2, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pure_rolling_through_a_curve_has_no_longitudinal_slip(kernel, side):
    contact, V, kappa = kernel.table(), 12.0, 1.0 / 250.0
    state = {"side": side, "y": -side * 2e-3, "V": V, "v_x": V, "kappa_h": kappa, "psi_dot": 0.01}
    state["z"] = kernel.height_for(contact, state, 60e-6)
    found = contact_state(contact, side, y_m=state["y"], z_m=state["z"])["tread"]
    lateral = side * (0.75 + found["abscissa_m"])
    # The axle turns left by kappa V + psi_dot: its left wheel covers less ground.
    W = (V - (kappa * V + 0.01) * lateral) / found["radius_m"]
    _, _, rate = kernel.call(contact, W=W, **state)
    assert abs(rate[0]) * 0.0136 < 1e-12 * V
    _, _, rate = kernel.call(contact, W=W * 1.001, **state)
    assert rate[0] * 0.0136 == pytest.approx(-0.001 * W * found["radius_m"], rel=1e-9)


def test_approach_stiffens_and_parting_softens_along_the_normal_only(kernel):
    contact = kernel.table()
    for side, y in ((1.0, 4.8e-3), (-1.0, -4.8e-3), (1.0, 6.7e-3)):
        state = {"side": side, "y": y}
        state["z"] = kernel.height_for(contact, state, 60e-6)
        patches = contact_state(contact, side, y_m=y, z_m=state["z"]).values()
        found = max(patches, key=lambda p: p["normal_n"])
        cd = 1.0 / np.hypot(1.0, found["slope"])
        normal = np.array([-side * found["slope"] * cd, cd])
        along = np.array([cd, side * found["slope"] * cd])
        for direction, expected in ((normal, 1.0 - 0.6 * 0.05), (-normal, 1.0 + 0.6 * 0.05), (along, 1.0)):
            y_dot, z_dot = 0.05 * direction
            _, out, _ = kernel.call(contact, **state, y_dot=y_dot, z_dot=z_dot)
            assert out[6] == pytest.approx(found["normal_n"] * expected, rel=1e-9)


def test_moment_is_that_of_the_force_at_the_contact_and_a_moment_about_the_normal(kernel):
    checked = 0
    for state, zeta in kernel.random_states(200, seed=11):
        flag, out, _ = kernel.call(kernel.table(), zeta, **state)
        if flag not in (1, 2):
            continue
        found = contact_state(
            kernel.table(), state["side"], y_m=state["y"], z_m=state["z"], roll_rad=state["phi"],
            yaw_rad=state["psi"], y_rail_m=state["y_rail"], z_rail_m=state["z_rail"],
        )[("tread", "flange")[flag - 1]]  # fmt: skip
        side, slope, radius = state["side"], found["slope"], found["radius_m"]
        lateral = side * (0.75 + found["abscissa_m"])
        # Contact point from the axle's centre: rolled and yawed wheel, leading on a slope.
        lead = radius * state["psi"] * (side * slope - state["phi"]) * (1.0 - side * slope * state["phi"])
        at = [lead - state["psi"] * lateral, lateral + state["phi"] * radius, state["phi"] * lateral - radius]
        rest = out[3:6] - np.cross(at, out[:3])
        normal = np.array([0.0, -side * slope, 1.0]) / np.hypot(1.0, slope)
        assert np.abs(np.cross(rest, normal)).max() < 1e-9 * out[6]
        checked += 1
    assert checked > 100


def test_apart_is_exactly_zero_and_creep_fades(kernel):
    for V in (0.0, 15.0, -15.0):
        zeta = np.array([1e-3, -2e-3, 3e-3, 4e-3])
        flag, out, rate = kernel.call(
            kernel.table(), zeta, z=1e-3, V=V, v_x=V, W=V / 0.46, y_dot=0.1, psi=1e-3
        )
        assert flag == 0
        assert (out[:7] == 0.0).all()
        assert out[7] < 0.0
        assert (rate * zeta < 0.0).all()
        assert np.allclose(rate / zeta, rate[0] / zeta[0])
    # Parting so fast that the damped force would pull gives nothing either.
    flag, out, _ = kernel.call(kernel.table(), z=static_height(kernel.table()), z_dot=3.0)
    assert flag == 0
    assert (out[:7] == 0.0).all()


def test_normal_force_passes_through_the_axle(kernel):
    # A surface of revolution without friction cannot be turned about its axis, rolled and yawed or not.
    contact = kernel.table(53e3, friction=1e-9)
    for y, phi, psi in ((0.0, 0.0, 0.0), (2e-3, 1e-3, 5e-3), (6.6e-3, 2e-3, 1e-2), (7.2e-3, -3e-3, -1e-2)):
        for side in (1.0, -1.0):
            state = {"side": side, "y": side * y, "phi": phi, "psi": psi}
            state["z"] = kernel.height_for(contact, state, 60e-6)
            _, out, _ = kernel.call(contact, **state)
            axis = np.array([-psi, 1.0, phi])
            # What is left is of third order in the angles.
            assert abs(out[3:6] @ axis) < out[6] * 0.46 * 30.0 * (abs(psi) + abs(phi)) ** 3 + 1e-4


def test_normal_forces_do_no_net_work_around_a_loop(kernel):
    # Closed path in y, z, roll at rest, without friction: the work against the spring's own energy.
    contact = kernel.table(53e3, friction=1e-9)
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    for centre, size, limit in ((0.0, 2e-3, 0.02), (4e-3, 1.5e-3, 0.2), (6.4e-3, 4e-4, 0.2)):
        work = 0.0
        energy = 0.4 * 53e3 * 68e-6
        path = []
        for q in angle:
            y, phi = centre + size * np.cos(q), 5e-4 * np.sin(q)
            pen = 60e-6 + 30e-6 * np.sin(2.0 * q)
            state = {"y": y, "phi": phi}
            state["z"] = kernel.height_for(contact, state, pen)
            _, out, _ = kernel.call(contact, **state)
            path.append([y, state["z"], phi, out[1], out[2], out[3]])
        path = np.array(path)
        mean, step = 0.5 * (path[1:, 3:] + path[:-1, 3:]), np.diff(path[:, :3], axis=0)
        work = float((mean * step).sum())
        # The law is not exactly conservative where the contact angle changes fast: below a fifth of
        # the elastic energy across the gauge corner, a hundredth on the tread.
        assert abs(work) < limit * energy


def test_beyond_the_flange_it_is_derailed_and_still_finite(kernel):
    contact = kernel.table()
    for side in (1.0, -1.0):
        for y in (12.5e-3, 14e-3, 30e-3, 1.0):
            flag, out, rate = kernel.call(contact, side=side, y=side * y, z=-1e-3, V=10.0, v_x=10.0, W=21.0)
            assert flag == -1
            assert np.isfinite(out).all()
            assert np.isfinite(rate).all()
        flag, _, _ = kernel.call(contact, side=side, y=side * 11.5e-3, z=10.67e-3 + 0.001, V=10.0)
        assert flag == 0
        # The wheel that falls inward off its rail.
        flag, _, _ = kernel.call(contact, side=side, y=side * -55e-3)
        assert flag == -1
