"""Time of one call of the contact kernel by each creep law, creep and both patches included."""

import numpy as np
import pytest

from simrail.core.jit import njit
from simrail.vehicle.contact.contact import Motion, RailHere, wheel_force
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.creep_laws import LAWS, CreepLaw
from simrail.vehicle.contact.profiles import rail_60e1, s1002


@njit
def many(patches, const, y, z, zeta, rate):
    rail = RailHere(const.friction, 0.0, 0.0, 0.0, 0.0)
    total = 0.0
    for i in range(y.size):
        motion = Motion(
            y[i], z[i], 1e-4, 1e-3, 20.0, 20.0, 0.01, 0.01, 1e-3, 1e-3, 20.0 / 0.46, 1.0 / 300.0
        )  # fmt: skip
        force = wheel_force(patches, const, 1.0, motion, rail, zeta, rate)
        total += force.fy + rate[0] + force.flag
    return total


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("patches, first, last", [("tread", -5e-3, 4.5e-3), ("both", 6.4e-3, 6.7e-3)])
def test_contact_kernel(benchmark, patches, first, last, law):
    contact = build_contact(s1002(), rail_60e1(), static_load_n=53e3, creep_law=CreepLaw(law))
    y = np.random.default_rng(1).uniform(first, last, 20000)
    shift = y + 0.46e-4 - contact.const["first_shift_m"]
    i = (shift * contact.const["intervals_per_m"]).astype(int)
    x = shift - i / contact.const["intervals_per_m"]
    c = contact.coef[:, i, 0]
    surface = (((c[..., 0] * x + c[..., 1]) * x + c[..., 2]) * x + c[..., 3]).max(axis=0)
    z = surface - 0.75e-4 - 1.5e-4 * (patches == "both") - 7e-5
    table, zeta, rate = contact.patches, np.full(4, 2e-4), np.zeros(4)
    many(table, contact.const, y[:10], z[:10], zeta, rate)
    benchmark.pedantic(many, args=(table, contact.const, y, z, zeta, rate), rounds=15, warmup_rounds=2)
    us = benchmark.stats.stats.min / y.size * 1e6
    benchmark.extra_info["us_per_call"] = us
    # FASTSIM looks at 64 points of each patch: a patch that sticks costs some 1 us, one that slides 6.
    assert us < {"she": 0.6, "polach": 0.6, "fastsim": 20.0}[law]
