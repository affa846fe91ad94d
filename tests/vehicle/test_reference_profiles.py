"""EN 15302 reference pairs: published points, rolling radius difference and equivalent conicity.

The figures are those of EN 15302:2021 (Annexes I, J, K) as given by github.com/rohrbecka/EN15302.
"""

import numpy as np
import pytest
from reference_profiles import GAUGE_M, en15302_rail_a, en15302_wheel
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline

from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.contact_pair import ContactPair, incline
from simrail.vehicle.contact.profiles import wheel_depth
from simrail.vehicle.contact.wheelset import conicity

# Annex J: rolling radius difference (mm) at lateral shifts (mm) of the wheelset.
DIFFERENCE = {
    "A": {0.5: 0.116, 1.0: 0.259, 2.0: 0.667, 3.0: 1.243, 4.0: 1.913, 5.0: 2.936, 6.0: 4.327, 6.5: 6.515},
    "B": {0.5: 0.025, 1.0: 0.050, 2.0: 0.100, 2.5: 0.125, 3.5: 2.222, 4.0: 2.515, 5.0: 3.160, 6.5: 6.132},
}
# Annex K: equivalent conicity at amplitudes (mm); tolerance the smaller of 0.05 and half of it.
CONICITY = {
    "A": {1.0: 0.125, 2.0: 0.155, 3.0: 0.188, 4.0: 0.216, 5.0: 0.254, 6.0: 0.303},
    "B": {1.0: 0.025, 2.0: 0.025, 4.0: 0.236, 5.0: 0.280, 6.0: 0.300},
}


def pair(kind):
    depth = wheel_depth(en15302_wheel(kind))
    head = incline(en15302_rail_a(), 0.0, gauge_depth_m=0.014)
    offset = 0.75 - 0.5 * GAUGE_M + head.gauge_abscissa_m
    s = np.arange(depth.x[0], depth.x[-1], 2e-5)
    return ContactPair(depth, head, s, 0.75, offset, 0.46)


def difference_m(contact, y):
    """Left less right rolling radius of rigid wheels that are shifted and do not roll over."""
    left, right = (contact.depth(contact.rigid(side * y)[1]) for side in (1.0, -1.0))
    return left - right


@pytest.mark.parametrize("kind", ["A", "B"])
def test_rolling_radius_difference_of_the_standard(kind):
    """Within 6 um, as much as 10 um of shift changes; that places the rail in the track as well."""
    y, expected = np.array(list(DIFFERENCE[kind].items())).T
    # On the flange the radius grows by 17 um per um of shift: the rounded joints show.
    found = difference_m(pair(kind), y * 1e-3) * 1e3
    assert found[:-1] == pytest.approx(expected[:-1], abs=6e-3)
    assert found[-1] == pytest.approx(expected[-1], abs=0.05)


@pytest.mark.parametrize("kind", ["A", "B"])
def test_equivalent_conicity_of_the_standard(kind):
    """Rigid and without roll, as the standard reckons: within 0.004; asked is Annex K's tolerance."""
    y = np.linspace(0.0, 6.5e-3, 1301)
    difference = difference_m(pair(kind), y)
    potential = CubicSpline(y, cumulative_simpson(difference, x=y, initial=0.0))
    nodes, weights = np.polynomial.legendre.leggauss(400)
    q = 0.25 * np.pi * (nodes + 1.0)
    for amplitude, expected in CONICITY[kind].items():
        a = amplitude * 1e-3
        fall = potential(a) - potential(a * np.sin(q))
        quarter = 0.25 * np.pi * weights @ (a * np.cos(q) / np.sqrt(fall))
        # Of the cone with the same quarter: its difference is 2 tan y, its potential tan y^2.
        assert (0.5 * np.pi / quarter) ** 2 == pytest.approx(expected, abs=0.004)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["A", pytest.param("B", marks=pytest.mark.slow)])
def test_our_conicity_is_within_the_standards_tolerance(kind):
    """Elastic at 10 kN, hardly smoothed, and with the axle's roll: within half of Annex K's tolerance."""
    contact = build_contact(
        en15302_wheel(kind), en15302_rail_a(), static_load_n=10e3, gauge_m=GAUGE_M, rail_inclination=0.0,
        smoothing=0.09,
    )  # fmt: skip
    for amplitude, expected in CONICITY[kind].items():
        tolerance = 0.5 * min(0.05, 0.5 * expected)
        assert conicity(contact, amplitude * 1e-3) == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize(
    "profile, points",
    [
        # Table I.1, every piece once; Table I.6 of the rail.
        (
            en15302_wheel("A"),
            {-52: 27.61960, -45: 23.53837, -39: 13.57565, -34: 6.45597, -20: 1.97093, 0: 0.0, 8: -0.33463,
             25: -0.49194, 45: -1.49193},
        ),
        (
            en15302_rail_a(),
            {-32: 11.87191, -25: 4.05569, -15: 1.49781, 0: 0.0, 10: -0.42031, 20: -0.28833, 35: 3.90694},
        ),
    ],
    ids=["wheel A", "rail A"],
)  # fmt: skip
def test_points_of_the_standards_tables(profile, points):
    """To 0.1 um, which is the rounding of the formulas."""
    at, expected = np.array(list(points.items()), dtype=float).T
    found = CubicSpline(profile.lateral_m, profile.depth_m)(at * 1e-3) * 1e3
    assert found == pytest.approx(expected, abs=1e-4)
