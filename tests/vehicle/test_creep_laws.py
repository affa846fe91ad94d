"""Creep laws: closed forms, Kalker's slope, saturation, falling friction, and FASTSIM as an oracle."""

from functools import cache

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.vehicle.contact.contact import Motion, RailHere, wheel_force
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.creep_laws import CreepLaw, fallen, saturation
from simrail.vehicle.contact.hertz import hertz_ellipse, kalker_coefficients
from simrail.vehicle.contact.profiles import conical_wheel, rail_60e1
from simrail.vehicle.contact.wheelset import contact_state

# Contact of the published check point (CONTACT's example): 8 x 4 mm, 82 kN, mu 0.3, G 82 GPa.
PATCH = {"a": 8e-3, "b": 4e-3, "normal": 82e3, "friction": 0.3, "modulus": 82e9}


def by_law(xi_x, xi_y, spin, law):
    """Fx, Fy over mu N by linear Kalker and a law's saturation."""
    c11, c22, c23, _ = (float(c) for c in kalker_coefficients(np.array(PATCH["a"] / PATCH["b"])))
    area, limit = PATCH["a"] * PATCH["b"], PATCH["friction"] * PATCH["normal"]
    linear = (
        -PATCH["modulus"] / limit * np.array([area * c11 * xi_x, area * c22 * xi_y + area**1.5 * c23 * spin])
    )
    constants = CreepLaw(law).constants()
    return linear * saturation(
        float(np.hypot(*linear)),
        constants["creep_law"],
        constants["polach_adhesion"],
        constants["polach_slip"],
    )


def test_polach_is_its_closed_form():
    # Polach (2005): F = (2 Q mu/pi) (kA e/(1 + (kA e)^2) + arctan(kS e)), e = (2/3) C pi a^2 b s/(Q mu);
    # with C = 3 G C11/(8 a) e is pi/4 of the linear force over the limit. Reckoned by hand at e = 1.
    for adhesion, slip, expected in ((1.0, 1.0, 0.5 + 0.25 * np.pi), (1.0, 0.4, 0.5 + 0.3805063771)):
        q = 4.0 / np.pi
        assert q * saturation(q, 1.0, adhesion, slip) == pytest.approx(2.0 / np.pi * expected, rel=1e-9)
    G, a, b, c11, Q, mu, s = 82e9, 8e-3, 4e-3, 4.9, 82e3, 0.3, 2e-3
    e = 2.0 / 3.0 * (3.0 * G * c11 / (8.0 * a)) * np.pi * a**2 * b * s / (Q * mu)
    published = 2.0 * mu * Q / np.pi * (0.9 * e / (1.0 + (0.9 * e) ** 2) + np.arctan(0.3 * e))
    linear = G * a * b * c11 * s
    assert linear * saturation(linear / (mu * Q), 1.0, 0.9, 0.3) == pytest.approx(published, rel=1e-12)


@pytest.mark.parametrize("law", [0.0, 1.0])
def test_laws_start_with_kalkers_slope_and_end_at_the_friction_limit(law):
    assert saturation(0.0, law, 1.0, 1.0) == 1.0
    assert saturation(1e-4, law, 1.0, 1.0) == pytest.approx(1.0, abs=1e-4)
    assert saturation(1e-7, law, 1.0, 1.0) == pytest.approx(saturation(0.99e-7, law, 1.0, 1.0), abs=1e-6)
    force = [q * saturation(q, law, 1.0, 1.0) for q in np.linspace(0.0, 20.0, 2001)]
    assert (np.diff(force) > -1e-15).all()
    assert 1e4 * saturation(1e4, law, 1.0, 1.0) == pytest.approx(1.0, abs=1e-4)
    assert max(force) <= 1.0


def test_polachs_reduction_is_the_slope():
    assert saturation(1e-5, 1.0, 0.3, 0.1) == pytest.approx(0.2, rel=1e-4)


def test_friction_falls_with_sliding_and_smoothly_through_rest():
    for w in (0.1, 1.0, 5.0):
        expected = 0.55 * (0.6 * np.exp(-0.6 * w) + 0.4)
        assert fallen(0.55, 0.4, 0.6, 0.6 * w, -0.8 * w) == pytest.approx(expected, rel=2e-3)
    assert fallen(0.55, 0.4, 0.0, 3.0, 0.0) == 0.55
    assert fallen(0.55, 0.4, 0.6, 0.0, 0.0) == 0.55
    step = 1e-4
    bend = abs(fallen(0.55, 0.4, 0.6, step, 0.0) - 2.0 * 0.55 + fallen(0.55, 0.4, 0.6, -step, 0.0)) / step
    assert bend < 0.55 * 0.6 * 0.6 * 0.03


@cache
def cone(law):
    """A 1:50 cone on the rail's 300 mm arc, where ellipse and creep are closed forms."""
    return build_contact(conical_wheel(0.02), rail_60e1(), static_load_n=53e3, creep_law=law)


def roll(law, creepage, *, V=15.0, friction=0.3):
    """Longitudinal force over friction times N, and over Kalker's linear force, of steady rolling."""
    contact = cone(law)
    at_rest = contact_state(contact, 1.0, y_m=1e-3, z_m=0.0)["tread"]
    z = at_rest["penetration_m"] - 60e-6
    found = contact_state(contact, 1.0, y_m=1e-3, z_m=z)["tread"]
    zeta, rate = np.zeros(4), np.zeros(4)
    W = V / found["radius_m"]
    for _ in range(4000):
        motion = Motion(1e-3, z, V=V, v_x=V * (1.0 + creepage), W=W)
        out = wheel_force(contact.patches, contact.const, 1.0, motion, RailHere(friction), zeta, rate)
        zeta += 3e-4 * rate
    assert np.abs(rate).max() < 1e-8
    normal = out.normal
    cosine = 1.0 / np.hypot(1.0, found["slope"])
    ellipse = hertz_ellipse(0.5 * cosine / found["radius_m"], 0.5 / 0.3)
    a, b = (float(x) * normal ** (1.0 / 3.0) for x in (ellipse.a, ellipse.b))
    c11 = float(kalker_coefficients(np.array(a / b))[0])
    return -out.fx / (friction * normal), -out.fx / (82e9 * a * b * c11 * creepage)


@pytest.mark.parametrize("name", ["she", "polach"])
def test_the_wheel_has_kalkers_slope_and_the_friction_limit_by_either_law(name):
    law = CreepLaw(name)
    # Much friction, so that spin and creepage stay in the linear part.
    assert roll(law, 1e-6, friction=30.0)[1] == pytest.approx(1.0, abs=3e-3)
    assert roll(law, 0.03)[0] == pytest.approx(1.0, abs=4e-3)
    assert roll(law, 0.03)[0] <= 1.0


def test_the_laws_differ_in_between_by_their_closed_forms():
    she, polach = CreepLaw(), CreepLaw("polach")
    # So much friction that the cone's spin is nothing beside the creepage.
    for creepage in (4e-3, 1.5e-3):
        forces = [roll(law, creepage, friction=0.6) for law in (she, polach)]
        q = forces[0][0] / forces[0][1]
        for (force, _), law in zip(forces, (0.0, 1.0), strict=True):
            assert force == pytest.approx(q * saturation(q, law, 1.0, 1.0), rel=5e-3)
    assert abs(forces[0][0] - forces[1][0]) > 0.015


@pytest.mark.parametrize("slip", [1.0, 0.1])
def test_polach_is_not_cut_short_by_the_windup_limit(slip):
    # In steady rolling the state must reach the creepage while the force still grows with it.
    law = CreepLaw("polach", adhesion=max(slip, 0.3), slip=slip)
    force, part = roll(law, 0.012)
    q = force / part
    assert force == pytest.approx(q * saturation(q, 1.0, law.adhesion, law.slip), rel=4e-3)


def test_friction_is_an_argument_and_falls_with_the_sliding_of_the_wheel():
    assert roll(CreepLaw(), 0.05, friction=0.05)[0] == pytest.approx(1.0, rel=1e-4)
    law = CreepLaw("polach", friction_floor=0.4, friction_decay_spm=0.6)
    # 3 m/s of sliding at 15 m/s.
    expected = 0.6 * np.exp(-0.6 * 3.0) + 0.4
    assert roll(law, 0.2)[0] == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize(
    "field, values",
    [
        ("creep_law", {"law": "kalker"}),
        ("adhesion", {"adhesion": 0.0}),
        ("slip", {"adhesion": 0.5, "slip": 0.6}),
        ("friction_floor", {"friction_floor": 1.2}),
        ("friction_decay_spm", {"friction_decay_spm": -1.0}),
        ("friction_decay_spm", {"friction_decay_spm": np.nan}),
    ],
)
def test_bad_laws_are_refused(field, values):
    with pytest.raises(InputError, match=field):
        CreepLaw(**values).constants()


def test_fastsim_oracle_meets_its_published_check_point_within_5_percent(dense_fastsim):
    # Lateral creepage -6.25e-4 and spin 6.25e-4 per mm: Fy/(mu N) of full CONTACT -0.6074, of FASTSIM
    # -0.6118 (44 strips) and -0.6359 (200 strips).
    for strips, published in ((44, -0.6118), (50, -0.6074), (200, -0.6359)):
        found = dense_fastsim(0.0, -6.25e-4, 0.625, **PATCH, strips=strips)[1]
        assert found == pytest.approx(published, rel=0.02)
    # Its small creepages give Kalker's linear force.
    for x, y, spin in ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-3)):
        assert dense_fastsim(x, y, spin, **PATCH, strips=200)[:2] == pytest.approx(
            by_law(x, y, spin, "she"), rel=0.02
        )


@pytest.mark.parametrize(
    "spin, she, polach",
    # Largest distance from FASTSIM over creepages 0 to 1 %, both directions, in units of mu N; rounded
    # up from what was measured.
    [(0.0, 0.007, 0.04), (0.1, 0.05, 0.05), (0.3, 0.11, 0.09), (0.625, 0.13, 0.13)],
)
def test_laws_against_fastsim_over_creepage_and_spin(dense_fastsim, spin, she, polach):
    """Without spin the cubic law is within 0.007 mu N of FASTSIM and Polach within 0.04; spin costs both.

    At 0.625 per m, a spin of the flange's root, both give less lateral force than FASTSIM up to the
    limit: linear spin is added before saturation, which knows nothing of where in the ellipse it slides.
    """
    worst = {"she": 0.0, "polach": 0.0}
    for creepage in (0.0, 3e-4, 1e-3, 2e-3, 4e-3, 1e-2):
        for x, y in ((creepage, 0.0), (0.0, creepage)):
            exact = np.array(dense_fastsim(x, y, spin, **PATCH)[:2])
            for law in worst:
                worst[law] = max(worst[law], float(np.hypot(*(by_law(x, y, spin, law) - exact))))
    assert worst["she"] < she
    assert worst["polach"] < polach
    # And no better than that: the limits say what the laws are.
    assert worst["she"] > 0.8 * she
    assert worst["polach"] > 0.8 * polach


def test_laws_miss_the_check_point_by_what_is_stated():
    # CONTACT -0.6074. The cubic law gives 13 % less, Polach 7 %: beyond the 5 % between tangential codes.
    assert by_law(0.0, -6.25e-4, 0.625, "she")[1] == pytest.approx(-0.526, abs=0.003)
    assert by_law(0.0, -6.25e-4, 0.625, "polach")[1] == pytest.approx(-0.565, abs=0.003)
