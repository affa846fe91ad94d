"""FASTSIM in the kernel: its own limits in closed form, a dense grid as the oracle, exact symmetries."""

from functools import cache

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from simrail.core.errors import InputError
from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.contact.fastsim import fastsim
from simrail.vehicle.contact.hertz import hertz_ellipse, kalker_coefficients
from simrail.vehicle.contact.profiles import RailProfile, conical_wheel, rail_60e1, s1002
from simrail.vehicle.contact.wheelset import contact_state

# Contact of the published check point (CONTACT's example): 8 x 4 mm, 82 kN, mu 0.3, G 82 GPa.
PATCH = {"a": 8e-3, "b": 4e-3, "normal": 82e3, "friction": 0.3, "modulus": 82e9}


def law(xi_x, xi_y, spin, *, a, b, normal, friction, modulus):
    """The kernel's law: Fx, Fy over mu N, moment over mu N (m), from creepages, rolling forward."""
    c11, c22, c23, _ = (float(c) for c in kalker_coefficients(np.array(a / b)))
    per_limit = modulus * a * b / (friction * normal)
    turn = per_limit * np.sqrt(a * b) * c23 * spin
    fx, fy, along, across = fastsim(per_limit * c11 * xi_x, per_limit * c22 * xi_y, turn, turn, b / a)
    return fx, fy, a * along - b * across


def test_check_point_of_contact_within_5_percent():
    """Lateral creepage -6.25e-4, spin 0.625 per m: Fy/(mu N) -0.6074 by CONTACT, -0.6359 by its FASTSIM."""
    fy = law(0.0, -6.25e-4, 0.625, **PATCH)[1]
    assert fy == pytest.approx(-0.6074, rel=0.05)
    assert fy == pytest.approx(-0.6359, rel=0.01)


def test_the_theory_itself_misses_contact_by_more(dense_fastsim):
    """5.5 % on a grid without end (Richardson, first order): what the kernel's grid gives is 0.7 % less."""
    coarse, fine = (dense_fastsim(0.0, -6.25e-4, 0.625, **PATCH, strips=n)[1] for n in (400, 800))
    limit = 2.0 * fine - coarse
    assert limit == pytest.approx(-0.6406, abs=3e-4)
    assert law(0.0, -6.25e-4, 0.625, **PATCH)[1] == pytest.approx(limit, rel=0.008)


def without_spin(q):
    """Force over mu N of the simplified theory without spin, in closed form per strip.

    A strip of half length e sticks from its leading edge until the traction ``k s`` meets the bound
    ``2 e s - s^2``, at s = 2 e - k, with k = 3 pi q/16; then it slides.
    """
    k = 3.0 * np.pi * q / 16.0

    def strip(y):
        e = np.sqrt(1.0 - y * y)
        s = max(2.0 * e - k, 0.0)
        return 0.5 * k * s * s + 4.0 * e**3 / 3.0 - e * s * s + s**3 / 3.0

    kink = np.sqrt(max(1.0 - 0.25 * k * k, 0.0))
    return 4.0 / np.pi * (quad(strip, 0.0, kink)[0] + quad(strip, kink, 1.0)[0])


@pytest.mark.parametrize("direction", [0.0, 0.5 * np.pi, 0.7])
def test_without_spin_it_is_the_closed_form(direction):
    """Kalker's slope within 1 %, mu N to 3e-4 from 32/(3 pi) on, 0.01 in between; in any direction."""
    along = np.array([np.cos(direction), np.sin(direction)])
    for q in (0.1, 0.3, 1.0, 2.0, 3.0, 3.3, 3.5, 10.0, 1e4):
        force = np.array(fastsim(*(q * along), 0.0, 0.0, 0.5)[:2])
        size = -force @ along
        assert abs(force[0] * along[1] - force[1] * along[0]) < 1e-12
        assert size == pytest.approx(without_spin(q), abs=0.01)
    assert without_spin(1e-6) == pytest.approx(1e-6, rel=1e-5)
    assert without_spin(32.0 / (3.0 * np.pi)) == pytest.approx(1.0, abs=1e-9)
    assert -np.array(fastsim(*(1e-6 * along), 0.0, 0.0, 0.5)[:2]) @ along == pytest.approx(1e-6, rel=0.01)
    for q in (32.0 / (3.0 * np.pi), 10.0, 1e4):
        assert -np.array(fastsim(*(q * along), 0.0, 0.0, 0.5)[:2]) @ along == pytest.approx(1.0, abs=3e-4)


@pytest.mark.parametrize("turn, limit", [(1e-3, 1e-5), (0.1, 2e-3), (0.3, 0.01), (1.0, 0.02), (3.0, 0.07)])
@pytest.mark.parametrize("slimness", [0.3, 1.0, 3.0])
def test_pure_spin_against_a_dense_grid(dense_fastsim, turn, limit, slimness):
    """Force within 1 % of the turn for small spin, 0.02 mu N at turn 1, 0.07 where it slides all over."""
    b = 4e-3
    patch = PATCH | {"a": b / slimness, "b": b}
    c23 = float(kalker_coefficients(np.array(1.0 / slimness))[2])
    spin = turn * 0.3 * 82e3 / (82e9 * (patch["a"] * b) ** 1.5 * c23)
    fx, fy, moment = law(0.0, 0.0, spin, **patch)
    coarse, fine = (np.array(dense_fastsim(0.0, 0.0, spin, **patch, strips=n)) for n in (150, 300))
    _, expected, expected_moment = 2.0 * fine - coarse
    assert fx == 0.0
    assert fy == pytest.approx(expected, abs=limit)
    assert moment == pytest.approx(expected_moment, abs=limit * max(patch["a"], b))
    if turn < 0.01:
        assert fy == pytest.approx(-turn, rel=0.01)


def test_creepage_and_spin_together_against_a_dense_grid(dense_fastsim):
    """Over creepages to 1 % in all directions and spins to 1.2 per m: rms 0.01, worst 0.03 of mu N."""
    rng = np.random.default_rng(4)
    errors = []
    for _ in range(60):
        size, angle = 10.0 ** rng.uniform(-4.0, -2.0), rng.uniform(0.0, 2.0 * np.pi)
        creep = (size * np.cos(angle), size * np.sin(angle), rng.uniform(-1.2, 1.2))
        coarse, fine = (np.array(dense_fastsim(*creep, **PATCH, strips=n)) for n in (100, 200))
        errors.append((np.array(law(*creep, **PATCH)) - (2.0 * fine - coarse)) / (1.0, 1.0, PATCH["a"]))
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 0.01
    assert np.abs(errors).max() < 0.03


def test_moment_of_small_creepages_is_the_theorys():
    """Integrals over the sticking ellipse: 3 pi/32 a f22 of lateral creepage, 8/15 a^2 b^3/L3 of spin."""
    a, b = PATCH["a"], PATCH["b"]
    _, c22, c23, _ = (float(c) for c in kalker_coefficients(np.array(a / b)))
    limit = PATCH["friction"] * PATCH["normal"]
    lateral = 3.0 * np.pi / 32.0 * a * PATCH["modulus"] * a * b * c22 * 1e-7 / limit
    assert law(0.0, 1e-7, 0.0, **PATCH)[2] == pytest.approx(lateral, rel=0.03)
    l3 = np.pi * a * np.sqrt(a / b) / (4.0 * c23 * PATCH["modulus"])
    spin = -8.0 / 15.0 * a**2 * b**3 / l3 * 1e-5 / limit
    assert law(0.0, 0.0, 1e-5, **PATCH)[2] == pytest.approx(spin, rel=0.03)


def test_mirrored_and_reversed_creepages_give_mirrored_and_reversed_forces_to_the_bit():
    rng = np.random.default_rng(2)
    for _ in range(200):
        q1, q2, turn = rng.normal(0.0, 1.5, 3)
        plain = fastsim(q1, q2, turn, turn, 0.7)
        # Left and right: lateral and spin change sign. Forward and backward: longitudinal and twist.
        x, y, along, across = fastsim(q1, -q2, -turn, -turn, 0.7)
        assert (x, -y, -along, -across) == plain
        x, y, along, across = fastsim(-q1, q2, turn, -turn, 0.7)
        assert (-x, y, along, -across) == plain


def test_forces_are_continuous():
    """Along random lines through creepages and spin, steps of the force shrink with the step: no jumps."""
    rng = np.random.default_rng(1)
    for _ in range(30):
        q1, q2, turn = rng.normal(0.0, 1.5, 3)
        way = rng.normal(0.0, 1.0, 3)
        largest = []
        for count in (200, 2000):
            t = np.linspace(0.0, 0.2, count + 1)
            path = np.array([q1, q2, turn]) + t[:, None] * way
            forces = np.array([fastsim(*at, at[2], 0.7) for at in path])
            largest.append(np.abs(np.diff(forces, axis=0)).max() * count)
        assert largest[1] < 1.5 * largest[0]


RADIUS, SPEED = 0.46, 15.0


def head(radius_m):
    """A rail head of one arc, 72 mm wide, with steep sides."""
    y = np.linspace(-0.035, 0.035, 1401)
    z = radius_m - np.sqrt(radius_m**2 - y**2)
    side = np.linspace(0.0, 0.001, 41)[1:]
    return RailProfile(
        "arc",
        np.concatenate([-0.035 - side[::-1], y, 0.035 + side]),
        np.concatenate([z[0] + 20.0 * side[::-1], z, z[-1] + 20.0 * side]),
        "test",
    )


@cache
def cylinder_on_an_arc():
    """A contact with a/b = 2 and no spin of its own, and the wheel's height at 60 um of penetration."""

    def away(radius):
        ellipse = hertz_ellipse(0.5 / RADIUS, 0.5 / radius)
        return float(ellipse.a / ellipse.b) - 2.0

    arc = brentq(away, 0.03, 5.0)
    contact = build_contact(
        conical_wheel(0.0), head(arc), static_load_n=53e3, rail_inclination=0.0, gauge_m=1.450,
        creep_law=CreepLaw("fastsim"),
    )  # fmt: skip
    z = contact_state(contact, 1.0, y_m=0.0, z_m=0.0)["tread"]["penetration_m"] - 60e-6
    return contact, arc, z, 0.75 + contact_state(contact, 1.0, y_m=0.0, z_m=z)["tread"]["abscissa_m"]


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    "xi_x, xi_y, spin",
    [(1e-3, 0.0, 0.0), (0.0, -1e-3, 0.0), (0.0, 0.0, 0.5), (0.0, -7e-4, 0.6), (1e-3, 5e-4, -0.4)],
)
def test_a_rolling_wheel_has_the_forces_and_moment_of_a_dense_grid(
    kernel, dense_fastsim, direction, xi_x, xi_y, spin
):
    """Steady rolling, each way: Fx, Fy within 0.02 mu N of the oracle, the moment within 0.02 mu N a."""
    contact, arc, z, at = cylinder_on_an_arc()
    V = direction * SPEED
    # Seen from its own front, a wheel that runs backward slips and spins the other way about.
    forward, twist = direction * xi_x, direction * spin
    kappa = twist * SPEED / V
    motion = {"v_x": V + SPEED * forward + kappa * V * at, "y_dot": SPEED * xi_y, "kappa_h": kappa}
    _, out, rate = kernel.call(
        contact, [forward, xi_y, 0.0, 0.0], z=z, V=V, W=V / RADIUS, friction=0.3, **motion
    )
    normal = out[6]
    assert np.abs(rate).max() < 1e-9
    ellipse = hertz_ellipse(0.5 / RADIUS, 0.5 / arc)
    a, b = (float(x) * normal ** (1.0 / 3.0) for x in (ellipse.a, ellipse.b))
    assert a / b == pytest.approx(2.0, rel=1e-6)
    patch = {"a": a, "b": b, "normal": normal, "friction": 0.3, "modulus": 82e9}
    coarse, fine = (np.array(dense_fastsim(xi_x, xi_y, spin, **patch, strips=n)) for n in (150, 300))
    expected = (2.0 * fine - coarse) * np.array([direction, 1.0, direction])
    moment = out[5] + at * out[0]
    assert np.abs(expected[:2]).max() > 0.1
    assert out[:2] / (0.3 * normal) == pytest.approx(expected[:2], abs=0.02)
    assert moment / (0.3 * normal * a) == pytest.approx(expected[2] / a, abs=0.02)


def test_nothing_to_hold_is_no_force_and_never_nan(kernel):
    """Zero creep, a wheel that barely touches or hangs, and rest, where spin has no share."""
    assert fastsim(0.0, 0.0, 0.0, 0.0, 1.0) == (0.0, 0.0, 0.0, 0.0)
    contact = build_contact(s1002(), rail_60e1(), static_load_n=53e3, creep_law=CreepLaw("fastsim"))
    z = static_height(contact)
    top = z + contact_state(contact, 1.0, y_m=0.0, z_m=z)["tread"]["penetration_m"]
    for lift in (-1e-15, -1e-12, -1e-9, 0.0, 1e-9, 1e-4):
        for V in (0.0, 1e-9, 20.0, -20.0):
            for zeta in (np.zeros(4), np.full(4, 1e-2)):
                motion = {"V": V, "v_x": V, "W": V / 0.46}
                _, out, rate = kernel.call(contact, zeta, z=top + lift, friction=0.3, **motion)
                assert np.isfinite(out).all() and np.isfinite(rate).all()
                assert np.hypot(out[0], out[1]) <= 0.35 * out[6]
    _, out, _ = kernel.call(contact, z=static_height(contact), psi_dot=2.0, friction=0.3)
    lateral = out[1] + np.sqrt(out[6] ** 2 - out[2] ** 2)
    assert abs(lateral) < 1e-6 * out[6]


def test_a_misspelt_law_names_those_there_are():
    with pytest.raises(InputError, match="she, polach, fastsim"):
        CreepLaw("fastsimm").constants()
