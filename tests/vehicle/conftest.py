"""What several tests of the contact measure against."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from simrail.vehicle.contact.contact import Motion, RailHere, wheel_force
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.hertz import kalker_coefficients
from simrail.vehicle.contact.profiles import rail_60e1, s1002
from simrail.vehicle.contact.wheelset import contact_state

RAIL = {"y_rail": "y", "z_rail": "z", "dy_rail": "dy", "dz_rail": "dz", "friction": "friction"}


def fastsim(xi_x, xi_y, spin, *, a, b, normal, friction, modulus, strips=50):
    """Creep forces and spin moment (Fx, Fy over mu N; M over mu N, m) from creepages and spin creepage (1/m).

    Kalker's simplified theory (1982), an independent oracle. The ellipse is cut into strips along the
    rolling direction. A particle enters a strip's leading edge without traction; the traction grows
    with the rigid slip over the flexibility and is cut back to the parabolic bound
    ``2 mu N/(pi a b) (1 - x^2/a^2 - y^2/b^2)`` wherever it would exceed it.
    One weighted flexibility for all three creepages would bias the linear slope; here each has its own
    (Vollebregt and Wilders 2011), so that small creepages give Kalker's forces.
    """
    c11, c22, c23, _ = (float(c) for c in kalker_coefficients(np.array(a / b)))
    l1, l2 = 8.0 * a / (3.0 * c11 * modulus), 8.0 * a / (3.0 * c22 * modulus)
    l3 = np.pi * a * np.sqrt(a / b) / (4.0 * c23 * modulus)
    dy = 2.0 * b / strips
    y = -b + dy * (np.arange(strips) + 0.5)
    edge = a * np.sqrt(1.0 - (y / b) ** 2)
    dx = 2.0 * edge / strips
    px, py = np.zeros(strips), np.zeros(strips)
    fx = fy = moment = 0.0
    x = edge.copy()
    for _ in range(strips):
        middle = x - 0.5 * dx
        px = px - dx * (xi_x / l1 - spin * y / l3)
        py = py - dx * (xi_y / l2 + spin * middle / l3)
        x = x - dx
        shape = np.maximum(1.0 - (middle / a) ** 2 - (y / b) ** 2, 0.0)
        bound = friction * 2.0 * normal / (np.pi * a * b) * shape
        size = np.maximum(np.hypot(px, py), 1e-30)
        cut = np.minimum(bound / size, 1.0)
        px, py = px * cut, py * cut
        fx += (px * dx).sum() * dy
        fy += (py * dx).sum() * dy
        moment += ((middle * py - y * px) * dx).sum() * dy
    return tuple(value / (friction * normal) for value in (fx, fy, moment))


@pytest.fixture
def dense_fastsim():
    """`fastsim` as a function of creepages, contact and number of strips."""
    return fastsim


@cache
def table(load=53e3, **options):
    return build_contact(s1002(), rail_60e1(), static_load_n=load, **options)


def call(contact, zeta=None, **state):
    """Flag, forces and creep rates at a state; what is not given is 0 (side: left)."""
    values = {"y": 0.0, "z": 0.0, "side": 1.0, "friction": contact.const["friction"]} | state
    values = {name: float(value) for name, value in values.items()}
    side, zeta = values.pop("side"), np.zeros(4) if zeta is None else np.array(zeta, dtype=float)
    rail = RailHere(**{RAIL[name]: values.pop(name) for name in list(values) if name in RAIL})
    rate = np.full(4, np.nan)
    flag, *out = wheel_force(contact.patches, contact.const, side, Motion(**values), rail, zeta, rate)
    return flag, np.array(out), rate


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


@pytest.fixture(scope="session")
def kernel():
    """The contact kernel at one state at a time: `table`, `call`, `settle`, `random_states`, `height_for`."""
    return SimpleNamespace(
        table=table, call=call, settle=settle, random_states=random_states, height_for=height_for
    )
