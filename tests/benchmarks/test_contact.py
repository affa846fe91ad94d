"""Time of one call of the contact kernel by each creep law, creep and both patches included."""

import numpy as np
import pytest

from simrail.core.jit import njit
from simrail.vehicle.contact.contact import build_contact, wheel_force
from simrail.vehicle.contact.creep_laws import LAWS, CreepLaw
from simrail.vehicle.contact.profiles import rail_60e1, s1002


@njit
def many(coef, const, y, z, zeta, rate, out):
    total = 0.0
    for i in range(y.size):
        flag = wheel_force(
            coef, const, 1.0, y[i], z[i], 1e-4, 1e-3, 0.0, 0.0, 20.0, 20.0, 0.01, 0.01, 1e-3, 1e-3,
            20.0 / 0.46, 1.0 / 300.0, 0.0, 0.0, const[5], zeta, rate, out,
        )  # fmt: skip
        total += out[1] + rate[0] + flag
    return total


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("patches, first, last", [("tread", -5e-3, 4.5e-3), ("both", 6.4e-3, 6.7e-3)])
def test_contact_kernel(benchmark, patches, first, last, law):
    contact = build_contact(s1002(), rail_60e1(), static_load_n=53e3, creep_law=CreepLaw(law))
    y = np.random.default_rng(1).uniform(first, last, 20000)
    shift = y + 0.46e-4 - contact.const[0]
    i = (shift * contact.const[1]).astype(int)
    x = shift - i / contact.const[1]
    c = contact.coef[:, i, 0]
    surface = (((c[..., 0] * x + c[..., 1]) * x + c[..., 2]) * x + c[..., 3]).max(axis=0)
    z = surface - 0.75e-4 - 1.5e-4 * (patches == "both") - 7e-5
    zeta, rate, out = np.full(4, 2e-4), np.zeros(4), np.zeros(8)
    many(contact.coef, contact.const, y[:10], z[:10], zeta, rate, out)
    benchmark.pedantic(
        many, args=(contact.coef, contact.const, y, z, zeta, rate, out), rounds=15, warmup_rounds=2
    )
    us = benchmark.stats.stats.min / y.size * 1e6
    benchmark.extra_info["us_per_call"] = us
    # FASTSIM looks at 64 points of each patch: a patch that sticks costs some 1 us, one that slides 6.
    assert us < {"she": 0.6, "polach": 0.6, "fastsim": 20.0}[law]
