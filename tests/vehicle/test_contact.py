"""The contact kernel: a published benchmark, exact symmetries, rest, reversal, saturation, smoothness."""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

from simrail.vehicle.contact import build_contact, static_height, wheel_force
from simrail.vehicle.contact_geometry import COLUMNS
from simrail.vehicle.creep_laws import LAWS, CreepLaw
from simrail.vehicle.hertz import hertz_ellipse, kalker_coefficients
from simrail.vehicle.profiles import conical_wheel, rail_60e1, s1002
from simrail.vehicle.wheelset import contact_state

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
ARGUMENTS = ("side", "y", "z", "phi", "psi", "y_rail", "z_rail", "V", "v_x", "y_dot", "z_dot", "phi_dot")
ARGUMENTS += ("psi_dot", "W", "kappa_h", "dy_rail", "dz_rail")


@cache
def table(load=53e3, **options):
    return build_contact(s1002(), rail_60e1(), static_load_n=load, **options)


def call(contact, zeta=None, **state):
    """Flag, forces and creep rates at a state; what is not given is 0 (side: left)."""
    values = dict.fromkeys(ARGUMENTS, 0.0) | {"side": 1.0} | state
    zeta = np.zeros(4) if zeta is None else np.array(zeta, dtype=float)
    rate, out = np.full(4, np.nan), np.full(8, np.nan)
    friction = values.pop("friction", contact.const[5])
    arguments = (*(float(values[a]) for a in ARGUMENTS), float(friction))
    flag = wheel_force(contact.coef, contact.const, *arguments, zeta, rate, out)
    return flag, out, rate


def settle(contact, **state):
    """Creep states of steady rolling, by marching their own equation."""
    zeta = np.zeros(4)
    for _ in range(4000):
        _, out, rate = call(contact, zeta, **state)
        zeta = zeta + 3e-4 * rate
    assert np.abs(rate).max() < 1e-9
    return zeta, out


def random_states(n, seed=7):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        side = rng.choice([-1.0, 1.0])
        y, phi = rng.uniform(-6.5e-3, 6.5e-3), rng.uniform(-3e-3, 3e-3)
        state = {"side": side, "y": y, "phi": phi, "psi": rng.uniform(-8e-3, 8e-3)}
        state |= {"y_rail": rng.uniform(-1e-3, 1e-3), "z_rail": rng.uniform(-1e-3, 1e-3)}
        V = rng.uniform(-30.0, 30.0)
        state |= {"V": V, "v_x": V * rng.uniform(0.999, 1.001), "W": V / 0.46 * rng.uniform(0.99, 1.01)}
        for name in ("y_dot", "z_dot"):
            state[name] = rng.normal(0.0, 0.02)
        for name in ("phi_dot", "psi_dot"):
            state[name] = rng.normal(0.0, 0.02)
        state |= {"kappa_h": rng.uniform(-5e-3, 5e-3)}
        state |= {"dy_rail": rng.normal(0.0, 1e-3), "dz_rail": rng.normal(0.0, 1e-3)}
        state["z"] = height_for(table(), state, rng.uniform(10e-6, 150e-6))
        yield state, rng.normal(0.0, 2e-3, 4)


def height_for(contact, state, penetration):
    """Height of the axle at which the deeper patch has this penetration."""
    at = {k: state.get(k, 0.0) for k in ("y", "phi", "psi", "y_rail", "z_rail")}
    found = contact_state(
        contact, state.get("side", 1.0), y_m=at["y"], z_m=0.0, roll_rad=at["phi"], yaw_rad=at["psi"],
        y_rail_m=at["y_rail"], z_rail_m=at["z_rail"],
    )  # fmt: skip
    return max(p["penetration_m"] for p in found.values()) - penetration


@pytest.mark.parametrize("row", BENCHMARK, ids=lambda r: f"{'left' if r[0] > 0 else 'right'}-{r[1]}")
def test_manchester_benchmark_a22(row):
    side, y, z, roll, yaw, pitch_rate, abscissa, angle, normal, fx, fy, pmax = row
    contact = table(10e3)
    state = {"side": side, "y": -y * 1e-3, "phi": roll, "psi": -yaw, "V": 2.0, "v_x": 2.0, "W": -pitch_rate}
    height = brentq(lambda h: settle_vertical(contact, state | {"z": h}) - 1e4, -1.5e-3, 1.5e-3, xtol=1e-10)
    _, out = settle(contact, **state, z=height)
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


def settle_vertical(contact, state):
    zeta = np.zeros(4)
    for _ in range(400):
        _, out, rate = call(contact, zeta, **state)
        zeta = zeta + 4e-4 * rate
    return out[2]


def peak_pressure(contact, u, normal):
    """3 N/(2 pi a b), the semi-axes from the table."""
    i = int((u - contact.const[0]) * contact.const[1])
    x = u - contact.const[0] - i / contact.const[1]
    a, b = (np.polyval(contact.coef[0, i, COLUMNS.index(f"semi_axis_{n}")], x) for n in ("along", "across"))
    approach = (normal / contact.const[4]) ** (2.0 / 3.0)
    return 1.5 * normal / (np.pi * a * b * approach)


@pytest.mark.parametrize("law", LAWS)
def test_left_and_right_are_mirror_images(law):
    contact = table(creep_law=CreepLaw(law))
    odd = {"y", "phi", "psi", "y_rail", "y_dot", "phi_dot", "psi_dot", "kappa_h", "dy_rail", "side"}
    mirror_out = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0])
    mirror_creep = np.array([1.0, -1.0, 1.0, -1.0])
    flags = set()
    for state, zeta in random_states(300):
        flag, out, rate = call(contact, zeta, **state)
        mirrored = {k: -v if k in odd else v for k, v in state.items()}
        flag2, out2, rate2 = call(contact, zeta * mirror_creep, **mirrored)
        flags.add(flag)
        assert flag == flag2
        assert np.allclose(out2, out * mirror_out, rtol=1e-12, atol=1e-12)
        assert np.allclose(rate2, rate * mirror_creep, rtol=1e-12, atol=1e-12)
    assert flags >= {1, 2}


@pytest.mark.parametrize("law", LAWS)
def test_running_backward_is_running_forward_seen_from_the_other_end(law):
    contact = table(creep_law=CreepLaw(law))
    # Half a turn about the vertical: x and y, and whatever points along them, change sign; the
    # derivatives by s keep theirs where the deviation turns too.
    odd = {"side", "y", "phi", "y_rail", "V", "v_x", "y_dot", "phi_dot", "W", "kappa_h", "dz_rail"}
    turn_out = np.array([-1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
    for state, zeta in random_states(300, seed=8):
        flag, out, rate = call(contact, zeta, **state)
        turned = {k: -v if k in odd else v for k, v in state.items()}
        flag2, out2, rate2 = call(contact, -zeta, **turned)
        assert flag == flag2
        assert np.allclose(out2, out * turn_out, rtol=1e-12, atol=1e-12)
        assert np.allclose(rate2, -rate, rtol=1e-12, atol=1e-12)


def test_kernel_and_reading_agree_on_the_penetration():
    for state, zeta in random_states(100, seed=9):
        _, out, _ = call(table(), zeta, **state)
        found = contact_state(
            table(), state["side"], y_m=state["y"], z_m=state["z"], roll_rad=state["phi"],
            yaw_rad=state["psi"], y_rail_m=state["y_rail"], z_rail_m=state["z_rail"],
        )  # fmt: skip
        assert out[7] == pytest.approx(max(p["penetration_m"] for p in found.values()), rel=1e-12)


def test_a_wheel_that_follows_its_rail_does_not_slip():
    for state, zeta in random_states(50, seed=10):
        # The same relative motion by the wheel or by the rail.
        _, out, rate = call(table(), zeta, **state)
        moved = dict(state)
        for wheel, rail in (("y_dot", "dy_rail"), ("z_dot", "dz_rail")):
            moved[wheel] = state[wheel] + state["V"] * 1e-3
            moved[rail] = state[rail] + 1e-3
        _, out2, rate2 = call(table(), zeta, **moved)
        assert np.allclose(out, out2, rtol=1e-10, atol=1e-6)
        assert np.allclose(rate, rate2, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pure_rolling_through_a_curve_has_no_longitudinal_slip(side):
    contact, V, kappa = table(), 12.0, 1.0 / 250.0
    state = {"side": side, "y": -side * 2e-3, "V": V, "v_x": V, "kappa_h": kappa, "psi_dot": 0.01}
    state["z"] = height_for(contact, state, 60e-6)
    found = contact_state(contact, side, y_m=state["y"], z_m=state["z"])["tread"]
    lateral = side * (0.75 + found["abscissa_m"])
    # The axle turns left by kappa V + psi_dot: its left wheel covers less ground.
    W = (V - (kappa * V + 0.01) * lateral) / found["radius_m"]
    _, _, rate = call(contact, W=W, **state)
    assert abs(rate[0]) * 0.0136 < 1e-12 * V
    _, _, rate = call(contact, W=W * 1.001, **state)
    assert rate[0] * 0.0136 == pytest.approx(-0.001 * W * found["radius_m"], rel=1e-9)


def test_approach_stiffens_and_parting_softens_along_the_normal_only():
    contact = table()
    for side, y in ((1.0, 4.8e-3), (-1.0, -4.8e-3), (1.0, 6.7e-3)):
        state = {"side": side, "y": y}
        state["z"] = height_for(contact, state, 60e-6)
        patches = contact_state(contact, side, y_m=y, z_m=state["z"]).values()
        found = max(patches, key=lambda p: p["normal_n"])
        cd = 1.0 / np.hypot(1.0, found["slope"])
        normal = np.array([-side * found["slope"] * cd, cd])
        along = np.array([cd, side * found["slope"] * cd])
        for direction, expected in ((normal, 1.0 - 0.6 * 0.05), (-normal, 1.0 + 0.6 * 0.05), (along, 1.0)):
            y_dot, z_dot = 0.05 * direction
            _, out, _ = call(contact, **state, y_dot=y_dot, z_dot=z_dot)
            assert out[6] == pytest.approx(found["normal_n"] * expected, rel=1e-9)


def test_moment_is_that_of_the_force_at_the_contact_and_a_moment_about_the_normal():
    checked = 0
    for state, zeta in random_states(200, seed=11):
        flag, out, _ = call(table(), zeta, **state)
        if flag not in (1, 2):
            continue
        found = contact_state(
            table(), state["side"], y_m=state["y"], z_m=state["z"], roll_rad=state["phi"],
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


def test_apart_is_exactly_zero_and_creep_fades():
    for V in (0.0, 15.0, -15.0):
        zeta = np.array([1e-3, -2e-3, 3e-3, 4e-3])
        flag, out, rate = call(table(), zeta, z=1e-3, V=V, v_x=V, W=V / 0.46, y_dot=0.1, psi=1e-3)
        assert flag == 0
        assert (out[:7] == 0.0).all()
        assert out[7] < 0.0
        assert (rate * zeta < 0.0).all()
        assert np.allclose(rate / zeta, rate[0] / zeta[0])
    # Parting so fast that the damped force would pull gives nothing either.
    flag, out, _ = call(table(), z=static_height(table()), z_dot=3.0)
    assert flag == 0
    assert (out[:7] == 0.0).all()


@cache
def cone():
    """A 1:50 cone: it stands on the rail's 300 mm arc, where ellipse and creep are closed forms."""
    return build_contact(conical_wheel(0.02), rail_60e1(), static_load_n=53e3)


@pytest.mark.parametrize("V", [15.0, -15.0, 1.0])
def test_linear_creep_is_kalkers_for_the_hertz_ellipse_of_a_cone_on_an_arc(V):
    contact, tiny = cone(), 1e-6
    base = {"y": 1e-3, "z": height_for(contact, {"y": 1e-3}, 60e-6), "V": V, "v_x": V}
    found = contact_state(contact, 1.0, y_m=1e-3, z_m=base["z"])["tread"]
    normal, radius, slope = found["normal_n"], found["radius_m"], found["slope"]
    assert slope == pytest.approx(0.02, abs=1e-6)
    cd = 1.0 / np.hypot(1.0, slope)
    sd = slope * cd
    ellipse = hertz_ellipse(0.5 * cd / radius, 0.5 / 0.3)
    a, b = (float(x) * normal ** (1.0 / 3.0) for x in (ellipse.a, ellipse.b))
    c11, c22, c23, c33 = (float(c) for c in kalker_coefficients(np.array(a / b)))
    assert contact.const[4] * (60e-6 * cd) ** 1.5 == pytest.approx(normal, rel=1e-12)

    def linear(force):
        """The force before the cubic saturation, from the one after it."""
        size = np.hypot(*force)
        roots = np.roots([1.0 / 27.0, -1.0 / 3.0, 1.0, -size / (0.3 * normal)])
        q = roots[np.isreal(roots)].real.min()
        return np.array(force) * (q * 0.3 * normal / size)

    def tangential(**state):
        _, out = settle(contact, **(base | state))
        return linear((out[0], cd * (out[1] + sd * normal) + sd * (out[2] - cd * normal)))

    # Longitudinal creepage, then lateral, then spin, each with the conicity's own spin as it comes.
    rolling = tangential(W=V / radius)
    pulled = tangential(W=V / radius, v_x=V * (1.0 + tiny))
    pushed = tangential(W=V / radius, y_dot=abs(V) * tiny / cd)
    turned = tangential(W=V / radius, kappa_h=1e-3, v_x=V * (1.0 + 1e-3 * (0.75 + found["abscissa_m"])))
    sign = np.sign(V)
    assert (pulled - rolling)[0] == pytest.approx(-sign * 82e9 * a * b * c11 * tiny, rel=2e-3)
    assert (pushed - rolling)[1] == pytest.approx(-82e9 * a * b * c22 * tiny, rel=2e-3)
    # Spin of a rolling cone is -sin(angle)/r per metre: it pushes the left wheel outward both ways.
    assert rolling[1] == pytest.approx(82e9 * (a * b) ** 1.5 * c23 * sd / radius, rel=3e-3)
    assert (turned - rolling)[1] == pytest.approx(-82e9 * (a * b) ** 1.5 * c23 * cd * 1e-3, rel=3e-3)
    # Spin moment about the normal, in pure rolling.
    zeta, out = settle(contact, **(base | {"W": V / radius}))
    found_moment = moment_about_normal(out, found, sd, cd)
    xi2, phi = zeta[1], -sd / radius * sign
    free = 82e9 * ((a * b) ** 1.5 * c23 * sign * xi2 - (a * b) ** 2 * c33 * phi)
    size = np.hypot(*rolling) / (0.3 * normal)
    assert found_moment == pytest.approx(free * (1.0 - size / 3.0 + size**2 / 27.0), rel=5e-3)


def moment_about_normal(out, found, sd, cd):
    """What is left of the moment after that of the force at its point (left wheel, no yaw or roll)."""
    at = np.array([0.0, 0.75 + found["abscissa_m"], -found["radius_m"]])
    rest = out[3:6] - np.cross(at, out[:3])
    assert abs(rest @ [0.0, cd, sd]) < 1e-6 * max(1.0, np.abs(out[3:6]).max())
    return float(rest @ [0.0, -sd, cd])


@pytest.mark.parametrize("V", [0.3, 5.0, -20.0])
def test_saturated_force_in_steady_rolling_is_exact(V):
    # Cubic law of Shen, Hedrick and Elkins on the pure creepages slip/|V|, deep in saturation with
    # spin, although the wind-up limit is at work: neither size nor direction may suffer.
    contact = cone()
    base = {"y": 1e-3, "z": height_for(contact, {"y": 1e-3}, 60e-6), "V": V, "v_x": V}
    found = contact_state(contact, 1.0, y_m=1e-3, z_m=base["z"])["tread"]
    sd = found["slope"] / np.hypot(1.0, found["slope"])
    cd = 1.0 / np.hypot(1.0, found["slope"])
    base |= {"W": V / found["radius_m"] * 0.97, "psi": 0.01}
    # Normal velocity changes N a little: read N back.
    _, out = settle(contact, **base)
    normal = out[6]
    T = np.array([out[0], cd * (out[1] + sd * normal) + sd * (out[2] - cd * normal)])
    assert np.hypot(*T) == pytest.approx(0.3 * normal, rel=1e-5)
    d = 60e-6 * cd
    i = int((1e-3 - contact.const[0]) * contact.const[1])
    f = {n: contact.coef[0, i, COLUMNS.index(n), 3] for n in ("f11", "f22", "f23")}
    radius, W = found["radius_m"], base["W"]
    slip = np.array([V - W * radius, -W * 0.01 * radius * cd])
    spin_per_v = -sd * W / V
    linear = np.array(
        [-f["f11"] * d * slip[0] / abs(V), -f["f22"] * d * slip[1] / abs(V) - f["f23"] * d**1.5 * spin_per_v]
    )
    assert np.hypot(*linear) > 5.0 * 0.3 * normal
    cross = (T[0] * linear[1] - T[1] * linear[0]) / (np.hypot(*T) * np.hypot(*linear))
    assert abs(cross) < 2e-3
    assert T @ linear > 0.0


def test_rolling_below_saturation_is_exactly_slip_over_speed():
    contact = table()
    for V in (0.5, 20.0, -20.0):
        state = {"y": -2e-3, "V": V, "v_x": V, "W": V / 0.46, "psi": 2e-4}
        state["z"] = height_for(contact, state, 60e-6)
        zeta, _ = settle(contact, **state)
        # At V = 0 the state would be a plain integral of slip: its rate at zeta = 0 is slip/L0.
        _, _, rate = call(contact, **state)
        slip = rate[:2] * (0.010 + 3e-4 * abs(V))
        assert np.allclose(zeta[:2], slip / abs(V), rtol=1e-6)
        assert (zeta[2:] == 0.0).all()


def test_at_rest_the_contact_is_a_spring():
    contact = table()
    state = {"z": static_height(contact)}
    _, rest, rate = call(contact, **state)
    assert (rate == 0.0).all()
    assert rest[0] == 0.0
    # No spin force at rest: the lateral force is the normal force's own.
    found = contact_state(contact, 1.0, y_m=0.0, z_m=state["z"])["tread"]
    assert rest[1] == pytest.approx(-rest[6] * found["slope"] / np.hypot(1.0, found["slope"]), rel=1e-12)
    # Linear force f11 zeta with zeta = displacement/L0 and no decay.
    stretch = np.array([1e-6 / 0.010, 0.0, 0.0, 0.0])
    _, out, rate = call(contact, stretch, **state)
    assert (rate == 0.0).all()
    assert -out[0] / 1e-6 == pytest.approx(1.4e9, rel=0.35)
    # Turning on the spot gives no spin force either, and no infinity.
    _, turning, _ = call(contact, **state, psi_dot=0.1)
    assert np.isfinite(turning).all()
    assert abs(turning[1] - rest[1]) < 0.02 * rest[6]


def test_passing_through_standstill_is_smooth():
    # Speeds through zero in fine steps: every output moves in small steps, spin included.
    contact = table()
    z = static_height(contact)
    values = []
    speeds = np.linspace(-0.3, 0.3, 3001)
    for V in speeds:
        _, out, rate = call(contact, [2e-4, 1e-4, 0, 0], z=z, V=V, v_x=V, W=V / 0.46, psi=1e-3)
        values.append([*out[:6], *rate[:2]])
    steps = np.abs(np.diff(values, axis=0)) / np.ptp(values, axis=0).clip(1e-9)
    assert np.isfinite(values).all()
    assert steps.max() < 0.01


def test_sliding_at_rest_does_not_wind_up():
    contact, dt = table(), 1e-5
    state = {"z": static_height(contact)}
    zeta = np.zeros(4)
    for _ in range(20000):  # 0.2 s at 5 mm/s: 1 mm, twenty times what saturates
        flag, out, rate = call(contact, zeta, **state, v_x=5e-3)
        zeta = zeta + dt * rate
    assert flag == 1
    assert -out[0] == pytest.approx(0.3 * out[6], rel=1e-6)
    held = zeta[0]
    travelled = 0.0
    while out[0] < -0.5 * 0.3 * out[6]:  # back: half the force is gone within a tenth of a millimetre
        flag, out, rate = call(contact, zeta, **state, v_x=-5e-3)
        zeta = zeta + dt * rate
        travelled += dt * 5e-3
    assert travelled < 1e-4
    assert held < 1e-2


@pytest.mark.parametrize("name, step", [("y", 1e-6), ("z", 2e-7), ("phi", 1e-6), ("psi", 4e-6)])
def test_forces_are_continuously_differentiable_in_the_pose(name, step):
    # Second differences over the step fall with the step (like it where curved, like its root where
    # the wheel lifts off); at a kink they would stay.
    check_smooth(name, step)


@pytest.mark.parametrize("index", [0, 1])
def test_forces_and_creep_rates_are_continuously_differentiable_in_the_creep(index):
    check_smooth(index, 4e-6)


@pytest.mark.parametrize("variable, step", [("z", 2e-7), (0, 4e-6), ("v_x", 1e-4)])
def test_forces_are_smooth_with_polach_and_falling_friction(variable, step):
    law = CreepLaw("polach", adhesion=0.9, slip=0.5, friction_floor=0.4, friction_decay_spm=0.6)
    check_smooth(variable, step, contact=table(creep_law=law))


def check_smooth(variable, step, contact=None):
    contact = contact or table()
    worst = []
    for divisor in (1.0, 4.0, 16.0):
        h, most = step / divisor, 0.0
        for y in (1e-4, 5.05e-3, 6.6e-3):
            base = {"y": y, "V": 8.0, "v_x": 8.0, "W": 8.0 / 0.4605, "psi": 1e-3}
            base["z"] = height_for(contact, base, 30e-6)
            # As fine as the step itself, so that no kink hides between the points.
            points = np.arange(-400.0 * divisor, 400.0 * divisor) * h
            values = []
            for x in points:
                state, zeta = dict(base), np.array([1e-3, 5e-4, 1e-3, 5e-4])
                if isinstance(variable, str):
                    state[variable] = state.get(variable, 0.0) + x
                else:
                    zeta[variable] += x
                _, out, rate = call(contact, zeta, **state)
                values.append([*out[:3], *(out[3:6] / 0.75), *(rate[:2] if variable in (0, 1) else (0, 0))])
            second = np.abs(np.diff(values, 2, axis=0)) / h
            most = np.maximum(most, second.max(axis=0))
        worst.append(most)
    first, _, last = np.array(worst)
    slope_scale = np.maximum(first, 1e-12)
    assert ((last / slope_scale < 0.5) | (last < 1e-3)).all(), (first, last)


def test_normal_force_passes_through_the_axle():
    # A surface of revolution without friction cannot be turned about its axis, rolled and yawed or not.
    contact = table(53e3, friction=1e-9)
    for y, phi, psi in ((0.0, 0.0, 0.0), (2e-3, 1e-3, 5e-3), (6.6e-3, 2e-3, 1e-2), (7.2e-3, -3e-3, -1e-2)):
        for side in (1.0, -1.0):
            state = {"side": side, "y": side * y, "phi": phi, "psi": psi}
            state["z"] = height_for(contact, state, 60e-6)
            _, out, _ = call(contact, **state)
            axis = np.array([-psi, 1.0, phi])
            # What is left is of third order in the angles.
            assert abs(out[3:6] @ axis) < out[6] * 0.46 * 30.0 * (abs(psi) + abs(phi)) ** 3 + 1e-4


def test_normal_forces_do_no_net_work_around_a_loop():
    # Closed path in y, z, roll at rest, without friction: the work against the spring's own energy.
    contact = table(53e3, friction=1e-9)
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    for centre, size, limit in ((0.0, 2e-3, 0.02), (4e-3, 1.5e-3, 0.2), (6.4e-3, 4e-4, 0.2)):
        work = 0.0
        energy = 0.4 * 53e3 * 68e-6
        path = []
        for q in angle:
            y, phi = centre + size * np.cos(q), 5e-4 * np.sin(q)
            pen = 60e-6 + 30e-6 * np.sin(2.0 * q)
            state = {"y": y, "phi": phi}
            state["z"] = height_for(contact, state, pen)
            _, out, _ = call(contact, **state)
            path.append([y, state["z"], phi, out[1], out[2], out[3]])
        path = np.array(path)
        mean, step = 0.5 * (path[1:, 3:] + path[:-1, 3:]), np.diff(path[:, :3], axis=0)
        work = float((mean * step).sum())
        # The law is not exactly conservative where the contact angle changes fast: below a fifth of
        # the elastic energy across the gauge corner, a hundredth on the tread.
        assert abs(work) < limit * energy


def test_beyond_the_flange_it_is_derailed_and_still_finite():
    contact = table()
    for side in (1.0, -1.0):
        for y in (12.5e-3, 14e-3, 30e-3, 1.0):
            flag, out, rate = call(contact, side=side, y=side * y, z=-1e-3, V=10.0, v_x=10.0, W=21.0)
            assert flag == -1
            assert np.isfinite(out).all()
            assert np.isfinite(rate).all()
        flag, _, _ = call(contact, side=side, y=side * 11.5e-3, z=10.67e-3 + 0.001, V=10.0)
        assert flag == 0
        # The wheel that falls inward off its rail.
        flag, _, _ = call(contact, side=side, y=side * -25e-3)
        assert flag == -1
