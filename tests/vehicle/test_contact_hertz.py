"""Hertz's ellipse against its defining integrals; Kalker's table at its rows and its limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from simrail.vehicle.contact.hertz import hertz_ellipse, kalker_coefficients


@pytest.mark.parametrize("lateral", [0.02, 0.5, 1.087, 3.0, 40.0, 900.0])
def test_ellipse_and_load_return_the_gap_of_the_two_bodies(lateral):
    # Independent: the elastic displacement under a semi-ellipsoidal pressure p0 on the axes a, b is
    # (p0 a b / E*) integral of (1 - x^2/(a^2+w) - y^2/(b^2+w)) / (2 sqrt((a^2+w)(b^2+w)w)) dw ... its
    # coefficients of 1, x^2, y^2 must be approach, A and B (Johnson 1985, eq. 3.40 to 3.42).
    along, load = 1.0 / 0.92, 1e4
    ellipse = hertz_ellipse(along, lateral)
    a, b = float(ellipse.a) * load ** (1 / 3), float(ellipse.b) * load ** (1 / 3)
    modulus = 82e9 * 1.28 / (1.0 - 0.28**2)  # E/(2(1-nu^2)), both bodies equal
    p0 = 1.5 * load / (np.pi * a * b)

    def integral(extra):
        # w = a b tan(q)^2 makes the integrand smooth.
        def f(q):
            w = a * b * np.tan(q) ** 2
            dw = 2.0 * a * b * np.tan(q) / np.cos(q) ** 2
            return extra(w) * dw / np.sqrt((a * a + w) * (b * b + w) * w)

        return p0 * a * b / (2.0 * modulus) * quad(f, 1e-12, 0.5 * np.pi - 1e-12, epsabs=0.0, epsrel=1e-10)[0]

    assert integral(lambda w: 1.0 / (a * a + w)) == pytest.approx(along, rel=1e-6)
    assert integral(lambda w: 1.0 / (b * b + w)) == pytest.approx(lateral, rel=1e-6)
    assert integral(lambda w: 1.0) == pytest.approx(float(ellipse.approach) * load ** (2 / 3), rel=1e-6)


def test_kalker_coefficients_pass_through_the_table_and_are_clipped():
    for ratio, row in ((0.1, (3.31, 2.52, 0.473, 8.28)), (1.0, (4.12, 3.67, 1.47, 1.19))):
        assert np.allclose([float(c) for c in kalker_coefficients(np.array(ratio))], row, rtol=1e-12)
    assert np.allclose(kalker_coefficients(np.array(10.0)), kalker_coefficients(np.array(50.0)))
    # Between rows: monotone, no overshoot.
    c11, c22, c23, c33 = kalker_coefficients(np.geomspace(0.1, 10.0, 500))
    for c in (c11, c22, c23):
        assert (np.diff(c) > 0.0).all()
    assert (np.diff(c33) < 0.0).all()
