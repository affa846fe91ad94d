"""Contact tables: exact identities, an independent soft maximum of a rolled wheel, published conicities."""

from functools import cache

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.vehicle.contact.contact import static_height
from simrail.vehicle.contact.contact_geometry import COLUMNS, CONSTANTS, build_contact
from simrail.vehicle.contact.contact_pair import ContactPair, incline
from simrail.vehicle.contact.profiles import conical_wheel, rail_60e1, s1002, wheel_depth
from simrail.vehicle.contact.wheelset import (
    conicity,
    contact_state,
    push_sideways,
    rolling_radius_difference,
)


@cache
def table(load=53e3, **options):
    return build_contact(s1002(), rail_60e1(), static_load_n=load, **options)


def column(contact, patch, name, u, derivative=0):
    first, per_m = contact.const["first_shift_m"], contact.const["intervals_per_m"]
    i = ((u - first) * per_m).astype(int)
    x = u - first - i / per_m
    c = contact.coef[patch, i, COLUMNS.index(name)].T
    if derivative:
        return (3.0 * c[0] * x + 2.0 * c[1]) * x + c[2]
    return ((c[0] * x + c[1]) * x + c[2]) * x + c[3]


def test_constants_are_named_and_arrays_contiguous():
    contact = table()
    assert contact.const.dtype.names == CONSTANTS
    assert contact.patches.dtype.names == COLUMNS
    assert contact.coef.shape[2] == len(COLUMNS)
    assert contact.coef.flags.c_contiguous
    assert contact.coef.dtype == np.float64
    assert contact.split_m == pytest.approx(-0.036, abs=2e-4)
    assert contact.const["derailed_shift_m"] == pytest.approx(0.0124, abs=2e-4)
    # The Hertz constant at full scale, by its published size, and eps at this load.
    assert contact.const["hertz_npm15"] == pytest.approx(9.5e10, rel=5e-3)
    assert contact.smoothing_m == pytest.approx(14.9e-6, rel=0.01)


@pytest.mark.parametrize(
    "patch, first, last, limit, limit_um", [(0, -12e-3, 6.5e-3, 5e-4, 0.03), (1, 6.0e-3, 12e-3, 8e-3, 0.1)]
)
def test_slope_of_the_penetration_is_the_contact_angle(patch, first, last, limit, limit_um):
    # dP/du of the table against -<rail slope>, computed afresh.
    contact = table()
    pair = full_pair()
    u = np.linspace(first, last, 331) + 1.3e-5
    mask = pair.s >= contact.split_m if patch == 0 else pair.s < contact.split_m
    soft = pair.soften(u, mask, eps_m=contact.smoothing_m * (1.0, 2.5)[patch], k0_1pm=3.0)
    assert np.abs(column(contact, patch, "penetration", u, 1) - soft.slope).max() < limit
    assert np.abs(column(contact, patch, "penetration", u) - soft.penetration).max() < limit_um * 1e-6


def test_the_tread_goes_on_where_the_gauge_is_wide():
    # One wheel climbs its rail while the other is off by that and by all of 49 CFR 213.53, 38.2 mm.
    contact = table()
    assert contact.const["first_shift_m"] <= -(contact.const["derailed_shift_m"] + 0.0382)
    # There S1002 is the cone of 1:15, and lies where the canted crown of the rail (R300) has that slope.
    u = np.linspace(-44e-3, -42e-3, 9)
    assert column(contact, 0, "penetration", u, 1) == pytest.approx(1.0 / 15.0, abs=1e-4)


def full_pair(**changes):
    depth = wheel_depth(s1002())
    head = incline(rail_60e1(), 1.0 / 40.0, gauge_depth_m=0.014)
    values = {
        "depth": depth,
        "head": head,
        "s": np.arange(depth.x[0], depth.x[-1], 5e-5),
        "half_m": 0.75,
        "offset_m": 0.75 - 0.5 * 1.435 + head.gauge_abscissa_m,
        "radius_m": 0.46,
    }
    return ContactPair(**(values | changes))


@pytest.mark.parametrize(
    "u, roll, limit_um, slope_limit, abscissa_limit_mm",
    [
        (0.0, 2e-3, 0.1, 1e-3, 0.2),
        (3e-3, -2e-3, 0.1, 1e-3, 0.2),
        (-6e-3, 2e-3, 0.1, 1e-3, 0.2),
        (7.5e-3, 5e-3, 8.0, 0.03, 0.3),
        (8.5e-3, -5e-3, 8.0, 0.05, 0.3),
    ],
)
def test_roll_terms_equal_a_wheel_that_is_really_rolled(u, roll, limit_um, slope_limit, abscissa_limit_mm):
    # Independent: turn the wheel's points about the axle's centre, then take the soft maximum.
    contact = table()
    pair = full_pair()
    patch = int(u > 6.5e-3)
    mask = pair.s >= contact.split_m if patch == 0 else pair.s < contact.split_m
    s = pair.s[mask]
    across, down = pair.half_m + s, pair.radius_m + pair.depth(s)
    # roll > 0 lifts this wheel; the axle stands such that u = y + r0 roll, height 0.
    e_axle = u - pair.radius_m * roll
    rise = -0.5 * pair.radius_m * roll**2
    across_t = across * np.cos(roll) + down * np.sin(roll) + e_axle - pair.half_m + pair.offset_m
    down_t = down * np.cos(roll) - across * np.sin(roll) - pair.radius_m - rise
    eps = contact.smoothing_m * (1.0, 2.5)[patch]
    gap = down_t - pair.head.depth(across_t)
    w = np.exp((gap - gap.max()) / eps)
    level = eps * np.log(5e-5 / np.sqrt(2.0 * np.pi * eps / 3.0))
    exact = gap.max() + eps * np.log(w.sum()) + level
    w /= w.sum()
    state = contact_state(contact, 1.0, y_m=e_axle, z_m=rise, roll_rad=roll)
    state = state[("tread", "flange")[patch]]
    lowered = contact_state(contact, 1.0, y_m=e_axle, z_m=rise - 5e-3, roll_rad=roll)
    lowered = lowered[("tread", "flange")[patch]]
    assert state["penetration_m"] == pytest.approx(exact, abs=limit_um * 1e-6)
    assert lowered["slope"] == pytest.approx(-(w @ pair.head.slope(across_t)), abs=slope_limit)
    assert lowered["abscissa_m"] == pytest.approx(w @ s, abs=abscissa_limit_mm * 1e-3)


@pytest.mark.parametrize("u", [7.0e-3, 7.5e-3])
def test_yaw_term_equals_the_silhouette_of_a_wheel_that_is_really_turned(u):
    # Independent: the points of the wheel's surface of revolution, turned; the deepest in the rail.
    contact, psi = table(), 12e-3
    pair = full_pair()
    s = pair.s[(pair.s > -0.042) & (pair.s < contact.split_m)][::2]
    angle = np.linspace(0.0, 0.06, 1201)[:, None]
    radius, across = pair.radius_m + pair.depth(s), pair.half_m + s
    lateral = across * np.cos(psi) + radius * np.sin(angle) * np.sin(psi)
    turned = radius * np.cos(angle) - pair.radius_m
    gap = turned - pair.head.depth(lateral - pair.half_m + pair.offset_m + u)
    straight = pair.depth(s) - pair.head.depth(s + pair.offset_m + u)
    rise = 0.5 * psi**2 * column(contact, 1, "yaw_rise", np.array([u]))[0]
    assert rise == pytest.approx(gap.max() - straight.max(), rel=0.07)
    # The place on the wheel leads by radius * yaw * slope.
    at = np.unravel_index(gap.argmax(), gap.shape)
    slope = -pair.head.slope(lateral[at] - pair.half_m + pair.offset_m + u)
    assert radius[at[1]] * np.sin(angle[at[0], 0]) == pytest.approx(radius[at[1]] * psi * slope, rel=0.05)


@pytest.mark.long
def test_static_height_carries_the_load(kernel):
    for load in (10e3, 53e3, 110e3):
        contact = table(load)
        _, out, _ = kernel.call(contact, z=static_height(contact))
        assert out[2] == pytest.approx(load, rel=1e-9)


def test_gauge_and_rail_deviation_only_shift_the_table():
    narrow, wide = table(), table(gauge_m=1.441)
    u = np.linspace(-8e-3, 5e-3, 60)
    # 3 mm more on each side: the wheel that moves 3 mm further out touches the same.
    for name in ("penetration", "abscissa", "f22"):
        a, b = column(narrow, 0, name, u), column(wide, 0, name, u + 3e-3)
        assert np.allclose(a, b, rtol=2e-4, atol=3e-8)
    # The flange is met 3 mm later, and so is the derailment.
    assert wide.const["derailed_shift_m"] == pytest.approx(
        narrow.const["derailed_shift_m"] + 3e-3, abs=1.1e-4
    )
    # The same by a deviation of the rail, on both sides.
    for side in (1.0, -1.0):
        moved = contact_state(narrow, side, y_m=1e-3, z_m=-3e-4, y_rail_m=side * 3e-3)["tread"]
        still = contact_state(narrow, side, y_m=1e-3 - side * 3e-3, z_m=-3e-4)["tread"]
        assert moved == pytest.approx(still, rel=1e-12)
        raised = contact_state(narrow, side, y_m=1e-3, z_m=-3e-4 + 2e-3, z_rail_m=2e-3)["tread"]
        level = contact_state(narrow, side, y_m=1e-3, z_m=-3e-4)["tread"]
        assert raised == pytest.approx(level, rel=1e-12)


def test_tables_of_a_scaled_pair_are_the_scaled_tables():
    # Everything is a length but the load: a tenth the size and a hundredth the load is the same shape.
    full = table()
    wheel, rail = s1002(), rail_60e1()
    small = build_contact(
        type(wheel)("S1002/10", wheel.lateral_m * 0.1, wheel.depth_m * 0.1, "scaled"),
        type(rail)("60E1/10", rail.lateral_m * 0.1, rail.depth_m * 0.1, "scaled"),
        static_load_n=530.0,
        gauge_m=0.1435,
        wheel_radius_m=0.046,
        tape_circle_half_m=0.075,
    )
    assert small.smoothing_m == pytest.approx(full.smoothing_m * 0.1, rel=1e-6)
    u = np.linspace(-5e-3, 6e-3, 100)
    for name in ("penetration", "abscissa", "depth", "spread"):
        assert np.allclose(column(small, 0, name, u * 0.1), 0.1 * column(full, 0, name, u), atol=2e-8)
    # f11 d is a force per creepage: area-like, 1/100.
    assert np.allclose(column(small, 0, "f11", u * 0.1) * 0.1, 0.01 * column(full, 0, "f11", u), rtol=1e-3)


@pytest.mark.long
def test_conicity_in_the_rigid_limit():
    # FACTS: rigid search on the Manchester benchmark pair, 0.227, 0.180, 0.162 at 2, 3, 4 mm.
    rigid = table(10e3, smoothing=0.09)
    found = [conicity(rigid, a * 1e-3) for a in (2.0, 3.0, 4.0)]
    assert np.allclose(found, [0.227, 0.180, 0.162], atol=5e-3)
    # An elastic contact shares the load between two places: less conicity, more so when loaded.
    assert conicity(table(53e3), 3e-3) == pytest.approx(0.174, abs=0.01)
    assert conicity(table(53e3), 1e-3) < conicity(table(10e3), 1e-3) - 0.05


@pytest.mark.long
def test_rolling_radii_of_the_manchester_benchmark():
    # CONTACT case, zcp_w right minus left (mm) at lateral shifts of 1, 2, 3, 4 mm. CONTACT
    # reads the radius inside the deformed contact, which differs by some um between the sides.
    difference = rolling_radius_difference(table(10e3), np.array([1e-3, 2e-3, 3e-3, 4e-3]))
    assert np.allclose(difference * 1e3, [0.6042, 0.7967, 0.9887, 1.2296], atol=0.013)


@pytest.mark.long
def test_cone_follows_wickens_conicity_and_gravitational_stiffness():
    # Wickens 2003, eqs 2.5 to 2.7: a cone g on a rail head of radius R, contacts at half distance b
    # (at rest): conicity g (b + R g)/(b - r0 g), roll per displacement g/(b - r0 g), and a lateral
    # force of the load times twice the roll.
    g, load = 0.05, 53e3
    contact = build_contact(conical_wheel(g), rail_60e1(), static_load_n=load, smoothing=0.05)
    b = 0.75 + contact_state(contact, 1.0, y_m=0.0, z_m=static_height(contact))["tread"]["abscissa_m"]
    for amplitude in (1e-3, 3e-3):
        expected = g * (b + 0.3 * g) / (b - 0.46 * g)
        assert conicity(contact, amplitude) == pytest.approx(expected, rel=1e-3)
    lean = g / (b - 0.46 * g) * (1.0 + g * g)
    # What gravity gives an axle: the two normal forces lean inward, and displaced, the outer one leans more.
    push = push_sideways(contact, np.array([-1e-3, 1e-3])).lateral_n
    assert (push[0] - push[1]) / 2e-3 == pytest.approx(2.0 * load * lean, rel=2e-3)
    rest = push_sideways(contact, np.array([2e-3]))
    assert rest.roll_rad[0] == pytest.approx(2e-3 * g / (b - 0.46 * g), rel=2e-3)


def test_no_conicity_where_nothing_steers():
    # A cylinder on leaning rails: the radii do not differ, so there is no oscillation.
    cylinder = build_contact(conical_wheel(0.0), rail_60e1(), static_load_n=53e3)
    assert not conicity(cylinder, 2e-3) > 1e-6


def test_pushing_left_and_right_is_the_same():
    rest = push_sideways(table(), np.array([-5e-3, 5e-3]))
    assert rest.z_m[0] == pytest.approx(rest.z_m[1], abs=1e-14)
    assert rest.lateral_n.sum() == pytest.approx(0.0, abs=1e-5)
    assert rest.radius_left_m[0] == pytest.approx(rest.radius_right_m[1], abs=1e-12)


@pytest.mark.parametrize(
    "field, changes",
    [
        ("static_load_n", {"static_load_n": 0.0}),
        ("friction", {"friction": -0.3}),
        ("wheel_radius_m", {"wheel_radius_m": float("nan")}),
        ("smoothing", {"smoothing": 0.0}),
        ("gauge_m", {"gauge_m": 1.40}),
        ("gauge_m", {"gauge_m": 1.60}),
    ],
)
def test_what_makes_no_contact_is_refused(field, changes):
    with pytest.raises(InputError, match=field):
        build_contact(s1002(), rail_60e1(), **({"static_load_n": 53e3} | changes))


def test_a_wheelset_pushed_off_the_rails_is_refused():
    with pytest.raises(InputError, match="off the rails"):
        push_sideways(table(), np.array([0.0, 14e-3]))
