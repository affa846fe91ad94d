"""Creep of the contact kernel: Kalker's linear forces, saturation, rolling, and rest."""

from functools import cache

import numpy as np
import pytest

from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.hertz import hertz_ellipse, kalker_coefficients
from simrail.vehicle.contact.profiles import conical_wheel, rail_60e1
from simrail.vehicle.contact.wheelset import contact_state


@cache
def cone():
    """A 1:50 cone: it stands on the rail's 300 mm arc, where ellipse and creep are closed forms."""
    return build_contact(conical_wheel(0.02), rail_60e1(), static_load_n=53e3)


@pytest.mark.parametrize("V", [15.0, -15.0, 1.0])
def test_linear_creep_is_kalkers_for_the_hertz_ellipse_of_a_cone_on_an_arc(kernel, V):
    contact, tiny = cone(), 1e-6
    base = {"y": 1e-3, "z": kernel.height_for(contact, {"y": 1e-3}, 60e-6), "V": V, "v_x": V}
    found = contact_state(contact, 1.0, y_m=1e-3, z_m=base["z"])["tread"]
    normal, radius, slope = found["normal_n"], found["radius_m"], found["slope"]
    assert slope == pytest.approx(0.02, abs=1e-6)
    cd = 1.0 / np.hypot(1.0, slope)
    sd = slope * cd
    ellipse = hertz_ellipse(0.5 * cd / radius, 0.5 / 0.3)
    a, b = (float(x) * normal ** (1.0 / 3.0) for x in (ellipse.a, ellipse.b))
    c11, c22, c23, c33 = (float(c) for c in kalker_coefficients(np.array(a / b)))
    assert contact.const["hertz_npm15"] * (60e-6 * cd) ** 1.5 == pytest.approx(normal, rel=1e-12)

    def linear(force):
        """The force before the cubic saturation, from the one after it."""
        size = np.hypot(*force)
        roots = np.roots([1.0 / 27.0, -1.0 / 3.0, 1.0, -size / (0.3 * normal)])
        q = roots[np.isreal(roots)].real.min()
        return np.array(force) * (q * 0.3 * normal / size)

    def tangential(**state):
        _, out = kernel.settle(contact, **(base | state))
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
    zeta, out = kernel.settle(contact, **(base | {"W": V / radius}))
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
def test_saturated_force_in_steady_rolling_is_exact(kernel, V):
    # Cubic law of Shen, Hedrick and Elkins on the pure creepages slip/|V|, deep in saturation with
    # spin, although the wind-up limit is at work: neither size nor direction may suffer.
    contact = cone()
    base = {"y": 1e-3, "z": kernel.height_for(contact, {"y": 1e-3}, 60e-6), "V": V, "v_x": V}
    found = contact_state(contact, 1.0, y_m=1e-3, z_m=base["z"])["tread"]
    sd = found["slope"] / np.hypot(1.0, found["slope"])
    cd = 1.0 / np.hypot(1.0, found["slope"])
    base |= {"W": V / found["radius_m"] * 0.97, "psi": 0.01}
    # Normal velocity changes N a little: read N back.
    _, out = kernel.settle(contact, **base)
    normal = out[6]
    T = np.array([out[0], cd * (out[1] + sd * normal) + sd * (out[2] - cd * normal)])
    assert np.hypot(*T) == pytest.approx(0.3 * normal, rel=1e-5)
    d = 60e-6 * cd
    f = {n: contact.piece(n, 1e-3)[0][3] for n in ("f11", "f22", "f23")}
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


def test_rolling_below_saturation_is_exactly_slip_over_speed(kernel):
    contact = kernel.table()
    for V in (0.5, 20.0, -20.0):
        state = {"y": -2e-3, "V": V, "v_x": V, "W": V / 0.46, "psi": 2e-4}
        state["z"] = kernel.height_for(contact, state, 60e-6)
        zeta, _ = kernel.settle(contact, **state)
        # At V = 0 the state would be a plain integral of slip: its rate at zeta = 0 is slip/L0.
        _, _, rate = kernel.call(contact, **state)
        slip = rate[:2] * (0.010 + 3e-4 * abs(V))
        assert np.allclose(zeta[:2], slip / abs(V), rtol=1e-6)
        assert (zeta[2:] == 0.0).all()


def test_at_rest_the_contact_is_a_spring(kernel):
    contact = kernel.table()
    state = {"z": static_height(contact)}
    _, rest, rate = kernel.call(contact, **state)
    assert (rate == 0.0).all()
    assert rest[0] == 0.0
    # No spin force at rest: the lateral force is the normal force's own.
    found = contact_state(contact, 1.0, y_m=0.0, z_m=state["z"])["tread"]
    assert rest[1] == pytest.approx(-rest[6] * found["slope"] / np.hypot(1.0, found["slope"]), rel=1e-12)
    # Linear force f11 zeta with zeta = displacement/L0 and no decay.
    stretch = np.array([1e-6 / 0.010, 0.0, 0.0, 0.0])
    _, out, rate = kernel.call(contact, stretch, **state)
    assert (rate == 0.0).all()
    assert -out[0] / 1e-6 == pytest.approx(1.4e9, rel=0.35)
    # Turning on the spot gives no spin force either, and no infinity.
    _, turning, _ = kernel.call(contact, **state, psi_dot=0.1)
    assert np.isfinite(turning).all()
    assert abs(turning[1] - rest[1]) < 0.02 * rest[6]


def test_passing_through_standstill_is_smooth(kernel):
    # Speeds through zero in fine steps: every output moves in small steps, spin included.
    contact = kernel.table()
    z = static_height(contact)
    values = []
    speeds = np.linspace(-0.3, 0.3, 3001)
    for V in speeds:
        _, out, rate = kernel.call(contact, [2e-4, 1e-4, 0, 0], z=z, V=V, v_x=V, W=V / 0.46, psi=1e-3)
        values.append([*out[:6], *rate[:2]])
    steps = np.abs(np.diff(values, axis=0)) / np.ptp(values, axis=0).clip(1e-9)
    assert np.isfinite(values).all()
    assert steps.max() < 0.01


def test_sliding_at_rest_does_not_wind_up(kernel):
    contact, dt = kernel.table(), 1e-5
    state = {"z": static_height(contact)}
    zeta = np.zeros(4)
    for _ in range(20000):  # 0.2 s at 5 mm/s: 1 mm, twenty times what saturates
        flag, out, rate = kernel.call(contact, zeta, **state, v_x=5e-3)
        zeta = zeta + dt * rate
    assert flag == 1
    assert -out[0] == pytest.approx(0.3 * out[6], rel=1e-6)
    held = zeta[0]
    travelled = 0.0
    while out[0] < -0.5 * 0.3 * out[6]:  # back: half the force is gone within a tenth of a millimetre
        flag, out, rate = kernel.call(contact, zeta, **state, v_x=-5e-3)
        zeta = zeta + dt * rate
        travelled += dt * 5e-3
    assert travelled < 1e-4
    assert held < 1e-2
