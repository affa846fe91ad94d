"""Straights, transitions and curves joined to a line, against closed forms: clothoid, arc, cant ramp."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import fresnel

from simrail.track.design import Curve, Straight, TrackDesign, Transition


@pytest.mark.parametrize(
    ("before", "after", "length"),
    [(None, 300.0, 40.0), (250.0, -150.0, 60.0), (-400.0, None, 80.0), (25.0, -12.0, 90.0)],
)
def test_clothoid_against_fresnel_integrals(before: float | None, after: float | None, length: float) -> None:
    ends = [Straight(20.0) if radius is None else Curve(20.0, radius) for radius in (before, after)]
    design = TrackDesign("clothoid", 0.0, (ends[0], Transition(length), ends[1]))
    k0, k1 = (0.0 if radius is None else 1.0 / radius for radius in (before, after))
    rate = (k1 - k0) / length
    u = np.linspace(0.0, length, 201)
    # Completing the square: angle = base + rate (u + shift)^2 / 2.
    scale, shift = np.sqrt(np.pi / abs(rate)), k0 / rate
    entry = design.frame(20.0)
    base = entry.yaw_rad - 0.5 * rate * shift**2
    sine, cosine = fresnel((u + shift) / scale)
    sine0, cosine0 = fresnel(shift / scale)
    spiral = scale * ((cosine - cosine0) + 1j * np.sign(rate) * (sine - sine0)) * np.exp(1j * base)
    position = design.frame(20.0 + u).position - entry.position
    assert np.abs(position[:, 0] + 1j * position[:, 1] - spiral).max() < 1e-12


def test_arc_lies_on_its_circle() -> None:
    design = TrackDesign("circle", 5.0, (Curve(1000.0, 100.0, 0.1),))
    position = design.frame(np.linspace(5.0, 1005.0, 99)).position
    # A left curve that starts towards +x turns about (0, +R).
    assert np.abs(np.hypot(position[:, 0], position[:, 1] - 100.0) - 100.0).max() < 1e-12
    assert design.frame(1005.0).yaw_rad == pytest.approx(10.0, abs=1e-14)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("ramp", ["smooth", "linear"])
def test_cant_ramp(ramp: str, side: float) -> None:
    design = TrackDesign(
        "ramp", 0.0, (Straight(30.0), Transition(50.0), Curve(30.0, side * 300.0, 0.12)), cant_ramp=ramp
    )
    u = np.linspace(0.0, 1.0, 41)
    frame = design.frame(30.0 + 50.0 * u)
    share = u if ramp == "linear" else 10 * u**3 - 15 * u**4 + 6 * u**5
    # The outer rail of a left curve is the right one: left side down, roll negative.
    assert np.abs(1.5 * np.sin(frame.roll_rad) + side * 0.12 * share).max() < 1e-15
    assert design.frame(100.0).roll_rad == pytest.approx(-side * np.arcsin(0.08), abs=1e-16)
    eps = 1e-7
    twist = design.frame(np.array([30.0 + eps, 80.0 - eps])).rates[:, 0]
    bend = design.frame(np.array([30.0 + eps, 80.0 - eps])).second[:, 0]
    if ramp == "smooth":
        assert np.abs(twist).max() < 1e-12
        assert np.abs(bend).max() < 1e-9
    else:
        assert twist[0] == pytest.approx(-side * 0.12 / 50.0 / 1.5, rel=1e-9)
