"""Profiles: formulas join, arcs have their radii, folded profiles are refused."""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.vehicle.contact.contact_pair import incline
from simrail.vehicle.contact.profiles import (
    WheelProfile,
    check_profile,
    conical_wheel,
    rail_60e1,
    rail_head,
    s1002,
    wheel_depth,
)


def test_s1002_has_the_heights_of_its_drawing():
    # Tape circle, flange tip 28 mm deep, field side (MBench_S1002_v3 of CONTACT: -2.6356764 mm at
    # 60 mm), a point of the 70 degree flange.
    depth = wheel_depth(s1002())
    assert abs(float(depth(0.0))) < 1e-9
    assert float(depth(-0.055)) == pytest.approx(0.028, abs=1e-6)
    assert float(depth(0.060)) == pytest.approx(-0.0026356764, abs=1e-7)
    assert float(depth(-0.039)) == pytest.approx((-93.576667419 + 2.747477419 * 39.0) * 1e-3, abs=1e-7)


def test_s1002_pieces_join_in_value_and_slope():
    depth = wheel_depth(s1002())
    for joint_mm in (-49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796):
        left, right = (joint_mm + d for d in (-0.15, 0.15))
        # Slopes 0.15 mm to both sides differ by no more than the local curvature allows.
        bend = abs(float(depth(right * 1e-3, 1) - depth(left * 1e-3, 1)))
        assert bend < 0.35
        assert abs(float(depth(left * 1e-3) - depth(right * 1e-3))) < 3e-4 * 3.0


def test_flange_of_the_cone_is_steep_smooth_and_as_high_as_asked():
    wheel = conical_wheel(0.05)
    slope = np.diff(wheel.depth_m) / np.diff(wheel.lateral_m)
    assert slope.min() == pytest.approx(-np.tan(np.deg2rad(70.0)), rel=1e-6)
    assert wheel.depth_m.max() == pytest.approx(0.028, abs=1e-6)
    # No kink: the slope changes by no more than the sharpest radius (12 mm) allows per step.
    assert np.abs(np.diff(np.arctan(slope))).max() < 5e-5 / 0.012 / np.cos(np.deg2rad(70.0)) * 1.1


def test_60e1_head_is_72_mm_wide_and_made_of_its_radii():
    rail = rail_60e1()
    y, z = rail.lateral_m, rail.depth_m
    assert np.array_equal(y, -y[::-1])
    assert np.array_equal(z, z[::-1])
    side = np.interp(0.0142, z[y > 0], y[y > 0])
    assert 2.0 * side == pytest.approx(0.072, abs=2e-5)
    # Curvature from three neighbouring points, away from the joints.
    for where, radius in ((0.005, 0.300), (0.018, 0.080), (0.031, 0.013)):
        i = int(np.argmin(np.abs(y - where)))
        a, b, c = (np.array([y[j], z[j]]) for j in (i - 8, i, i + 8))
        sides = np.linalg.norm(a - b) * np.linalg.norm(b - c) * np.linalg.norm(a - c)
        area = abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
        assert sides / (2.0 * area) == pytest.approx(radius, rel=1e-3)


def test_leaning_rail_matches_the_circles_of_the_benchmark_rail():
    # Centres (abscissa, depth; mm) of the arcs of MBench_UIC60_v3 (CONTACT, Apache-2.0), fitted.
    head = incline(rail_60e1(), 1.0 / 40.0, gauge_depth_m=0.014)
    arcs = {
        (-15.0, 0.0): (0.006, 300.000, 300.0, 1.0),
        (-32.0, -20.0): (-13.187, 80.396, 80.0, 2.0),
        (-42.0, -35.0): (-30.128, 15.573, 13.0, 7.0),
        (5.0, 17.0): (2.209, 80.011, 80.0, 2.0),
    }
    for (first, last), (centre, centre_depth, radius, limit_um) in arcs.items():
        e = np.linspace(first, last, 50)
        away = np.hypot(e - centre, head.depth(e * 1e-3) * 1e3 - centre_depth) - radius
        assert np.abs(away).max() * 1e3 < limit_um
    # Reference position of CONTACT's track: 760.53 mm from the centre to the highest point.
    assert 717.5 - head.gauge_abscissa_m * 1e3 == pytest.approx(760.53, abs=0.01)


def test_a_leaning_head_is_highest_at_its_datum_and_smooth_beyond_its_ends():
    for lean in (0.0, 1.0 / 40.0, 1.0 / 20.0):
        head = incline(rail_60e1(), lean, gauge_depth_m=0.014)
        e = np.linspace(-0.06, 0.06, 2001)
        assert head.depth(e).min() > -1e-12
        assert float(head.depth(np.array(0.0))) == pytest.approx(0.0, abs=1e-12)
        # The slope is the derivative, on the head and on its steep continuation.
        middle = 0.5 * (e[1:] + e[:-1])
        gap = np.abs(np.diff(head.depth(e)) / np.diff(e) - head.slope(middle))
        assert np.quantile(gap, 0.98) < 0.05


@pytest.mark.parametrize(
    "y, z",
    [
        ([0.0, 1.0, 2.0], [0.0, 0.0, 0.0]),
        ([0, 1, 2, 3, 2.5, 5, 6, 7, 8], np.zeros(9)),
        ([0, 1, 2, 3, np.nan, 5, 6, 7, 8], np.zeros(9)),
        (np.arange(9.0), np.zeros(8)),
    ],
)
def test_profiles_that_are_no_curve_are_refused(y, z):
    with pytest.raises(InputError, match="worn"):
        check_profile(WheelProfile("worn", np.array(y, float), np.array(z, float), "test"))


def test_heads_that_cannot_carry_a_gauge_are_refused():
    low = rail_head("low", radii_m=(0.3,), joints_m=(), side_slope=1.5, source="test", side_length_m=0.001)
    with pytest.raises(InputError, match="gauge"):
        incline(low, 0.0, gauge_depth_m=0.5)
    with pytest.raises(InputError, match="joints_m"):
        rail_head("x", radii_m=(0.3, 0.08), joints_m=(), side_slope=0.05, source="test")
    with pytest.raises(InputError, match="flange_height_m"):
        conical_wheel(0.05, flange_height_m=0.01)
    with pytest.raises(InputError, match="conicity"):
        conical_wheel(0.9)
