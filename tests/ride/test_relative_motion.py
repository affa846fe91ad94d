"""Parts of an acceleration against a body whose motion in the track frame is prescribed."""

from __future__ import annotations

import numpy as np
import pytest
from channels import harmonic

from simrail.ride.kinematic import kinematic_truth
from simrail.ride.relative_motion import acceleration_terms, below
from simrail.ride.truth import Mount
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.vehicle.speed_profile import SpeedProfile

BEND = TrackDesign(
    name="bend",
    start_m=0.0,
    elements=(Straight(60.0), Transition(40.0), Curve(60.0, 250.0, 0.08), Transition(40.0), Straight(200.0)),
    gradients=(Gradient(20.0, 0.02), Gradient(180.0, -0.015)),
    vertical_radius_m=1500.0,
)
HEIGHT_M = 0.5
CENTRE = Mount("centre", "body", (0.0, 0.0, HEIGHT_M))


@pytest.mark.parametrize("direction", [1, -1])
def test_relative_and_coriolis_terms_are_those_prescribed(direction: int) -> None:
    start, end = (10.0, 390.0) if direction > 0 else (390.0, 10.0)
    swing = {"lateral": (0.004, 1.3), "vertical": (0.003, 2.1)}
    truth = kinematic_truth(
        BEND,
        SpeedProfile(start, end, 15.0, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=2.0),
        channels={name: harmonic(size, frequency_hz=f) for name, (size, f) in swing.items()},
        height_m=HEIGHT_M,
    )
    motion = truth.motion(CENTRE)
    found = acceleration_terms(motion, BEND, nominal_m=CENTRE.position_m, gravity_mps2=truth.gravity_mps2)
    t, zero = truth.time_s, np.zeros_like(truth.time_s)
    phase = {name: 2.0 * np.pi * f * t for name, (_, f) in swing.items()}
    rate = [swing[n][0] * 2.0 * np.pi * swing[n][1] * np.cos(phase[n]) for n in swing]
    second = [-swing[n][0] * (2.0 * np.pi * swing[n][1]) ** 2 * np.sin(phase[n]) for n in swing]
    np.testing.assert_allclose(found.relative, np.column_stack([zero, *second]), rtol=0, atol=1e-9)
    frame = BEND.frame(motion["position_m"].to_numpy())
    w = motion["speed_mps"].to_numpy()[:, None] * frame.k
    np.testing.assert_allclose(
        found.coriolis, 2.0 * np.cross(w, np.column_stack([zero, *rate])), rtol=0, atol=1e-9
    )
    assert np.abs(found.coriolis).max() > 1e-3


def test_a_body_that_keeps_its_place_has_the_track_and_the_turning_alone() -> None:
    truth = kinematic_truth(BEND, SpeedProfile(10.0, 390.0, 15.0), height_m=HEIGHT_M)
    motion = truth.motion(CENTRE)
    found = acceleration_terms(motion, BEND, nominal_m=CENTRE.position_m, gravity_mps2=truth.gravity_mps2)
    assert np.abs(found.relative).max() < 1e-9
    assert np.abs(found.angular_of_deviation).max() < 1e-9
    assert np.abs(found.angular).max() > 0.01
    # In the middle of the curve the track's acceleration is V^2/R across.
    middle = int(np.argmin(np.abs(motion["position_m"].to_numpy() - 130.0)))
    speed = motion["speed_mps"].iloc[middle]
    assert found.track[middle, 1] == pytest.approx(speed**2 / 250.0, rel=0.01)


def test_below_keeps_what_is_slow() -> None:
    t = np.arange(4000) / 250.0
    slow, fast = np.sin(2.0 * np.pi * 0.25 * t), np.sin(2.0 * np.pi * 3.0 * t)
    kept = below(np.column_stack([slow + fast, fast]), frequency_hz=0.5, rate_hz=250.0)
    np.testing.assert_allclose(kept, np.column_stack([slow, 0.0 * t]), rtol=0, atol=1e-9)
