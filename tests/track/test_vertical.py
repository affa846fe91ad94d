"""Vertical curves against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.track.design import Gradient, Straight, TrackDesign


@pytest.mark.parametrize("ramp", [0.0, 5.0, 20.0])
@pytest.mark.parametrize("change", [0.045, -0.045, 0.001])
def test_vertical_curve_keeps_the_change_of_slope_exact(ramp: float, change: float) -> None:
    radius, middle = 1500.0, 200.0
    design = TrackDesign(
        "crest",
        0.0,
        (Straight(400.0),),
        gradients=(Gradient(0.0, -0.01), Gradient(middle, change - 0.01)),
        vertical_radius_m=radius,
        vertical_ramp_m=ramp,
    )
    slope = -np.tan(design.frame(np.array([0.0, 100.0, 300.0, 400.0])).pitch_rad)
    assert np.abs(slope - [-0.01, -0.01, change - 0.01, change - 0.01]).max() < 1e-16
    # The gradients meet at the middle, as the two tangents of a parabola do.
    z = design.frame(np.array([0.0, 400.0])).position[:, 2]
    assert z[1] - z[0] == pytest.approx(-0.01 * middle + (change - 0.01) * (400.0 - middle), abs=1e-13)
    length = max(radius * abs(change), ramp)
    centre = design.frame(middle)
    bend = -centre.rates[1] / np.cos(centre.pitch_rad) ** 2
    assert bend == pytest.approx(change / length, rel=1e-12)
    outside = middle + np.array([-1.0, 1.0]) * (0.5 * (length + ramp) + 1e-6)
    assert np.array_equal(design.frame(outside).rates[:, 1], [0.0, 0.0])
    s = np.linspace(middle - 60.0, middle + 60.0, 120001)
    steps = np.abs(np.diff(design.frame(s).rates[:, 1])).max()
    # A bare parabola steps by 1/radius; a ramp rises by no more than 15/8 of its mean slope.
    assert steps == pytest.approx(1.0 / radius, rel=1e-3) if not ramp else steps < 2e-3 / ramp / radius


def test_every_gradient_has_its_own_slope() -> None:
    """Three changes: each counts from the gradient before it, with a gradient at the start and without."""
    slopes, places = (0.004, -0.01, 0.02, 0.005), (0.0, 200.0, 400.0, 600.0)
    gradients = tuple(Gradient(place, slope) for place, slope in zip(places, slopes, strict=True))
    for given, first in ((gradients, 0.004), (gradients[1:], 0.0)):
        design = TrackDesign("three", 0.0, (Straight(800.0),), gradients=given)
        frame = design.frame(np.array([100.0, 300.0, 500.0, 700.0]))
        assert -np.tan(frame.pitch_rad) == pytest.approx([first, *slopes[1:]], abs=1e-15)


def test_parabola_stands_where_it_should() -> None:
    design = TrackDesign(
        "parabola", 0.0, (Straight(300.0),), gradients=(Gradient(100.0, 0.03),), vertical_ramp_m=0.0
    )
    s = np.array([50.0, 70.0, 100.0, 130.0, 200.0])  # level until 100 - 30, radius 2000 m, 60 m long
    assert design.frame(s).position[:, 2] == pytest.approx([0.0, 0.0, 30.0**2 / 4000, 0.9, 3.0], abs=1e-14)
