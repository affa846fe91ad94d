"""The kernel's small creep forces over the axis ratio, against the published table itself."""

import numpy as np
import pytest
from scipy.optimize import brentq

from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.hertz import hertz_ellipse
from simrail.vehicle.contact.profiles import RailProfile, conical_wheel
from simrail.vehicle.contact.wheelset import contact_state

# Kalker (1990), Table E3, nu = 0.25: a/b, then C11, C22, C23, C33.
TABLE = [
    (0.3, 3.44, 2.75, 0.715, 2.96),
    (0.5, 3.62, 3.01, 0.929, 1.93),
    (0.8, 3.91, 3.41, 1.25, 1.37),
    (1.0, 4.12, 3.67, 1.47, 1.19),
    (1 / 0.7, 4.54, 4.21, 1.95, 0.965),
    (1 / 0.5, 5.10, 4.90, 2.62, 0.819),
    (1 / 0.3, 6.34, 6.40, 4.32, 0.674),
    (1 / 0.2, 7.78, 8.14, 6.63, 0.601),
]
RADIUS, V, FRICTION = 0.46, 15.0, 1e4


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


@pytest.mark.parametrize("ratio, c11, c22, c23, c33", TABLE)
def test_small_creep_forces_are_the_tables(kernel, ratio, c11, c22, c23, c33):
    # A cylinder on an arc: its own spin is nothing, and the arc's radius sets a/b.
    def away(radius):
        ellipse = hertz_ellipse(0.5 / RADIUS, 0.5 / radius)
        return float(np.log(ellipse.a / ellipse.b / ratio))

    arc = brentq(away, 0.03, 5.0)
    options = {"static_load_n": 53e3, "rail_inclination": 0.0, "gauge_m": 1.450}
    contact = build_contact(conical_wheel(0.0), head(arc), **options)
    z = contact_state(contact, 1.0, y_m=0.0, z_m=0.0)["tread"]["penetration_m"] - 60e-6
    found = contact_state(contact, 1.0, y_m=0.0, z_m=z)["tread"]
    assert abs(found["slope"]) < 1e-6
    at = 0.75 + found["abscissa_m"]

    def force(xi_x=0.0, xi_y=0.0, spin=0.0):
        """Steady rolling: the states are the creepages. Spin by the track's curvature."""
        motion = {"V": V, "v_x": V * (1.0 + xi_x + spin * at), "y_dot": V * xi_y, "kappa_h": spin}
        _, out, rate = kernel.call(
            contact, [xi_x, xi_y, 0.0, 0.0], z=z, W=V / RADIUS, friction=FRICTION, **motion
        )
        assert np.abs(rate).max() < 1e-9
        # Moment about the normal through the contact (lever: the force along the track).
        return out[0], out[1], out[5] + at * out[0], out[6]

    normal = force()[3]
    ellipse = hertz_ellipse(0.5 / RADIUS, 0.5 / arc)
    area = float(ellipse.a * ellipse.b) * normal ** (2.0 / 3.0) * 82e9
    length = np.sqrt(area / 82e9)
    xi, phi = 1e-4, 1e-2
    assert force(xi_x=xi)[0] == pytest.approx(-area * c11 * xi, rel=4e-3)
    assert force(xi_y=xi)[1] == pytest.approx(-area * c22 * xi, rel=4e-3)
    assert force(spin=phi)[1] == pytest.approx(-area * length * c23 * phi, rel=4e-3)
    assert force(xi_y=xi)[2] == pytest.approx(area * length * c23 * xi, rel=4e-3)
    assert force(spin=phi)[2] == pytest.approx(-area * length**2 * c33 * phi, rel=4e-3)
