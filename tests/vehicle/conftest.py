"""What several tests of the contact measure against."""

import numpy as np
import pytest

from simrail.vehicle.hertz import kalker_coefficients


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
