"""Growth of a motion against waves that are made to grow, and its zero against a line."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.ride.kinematic import along, kinematic_truth
from simrail.scoring.kick import (
    LARGEST_M,
    decay_limit,
    growth_rate_1ps,
    lateral_motion,
    score_kick,
)
from simrail.track.design import TrackDesign
from simrail.track.elements import Straight
from simrail.vehicle.speed_profile import SpeedProfile

RATE_HZ = 250.0


def wave(growth_1ps, *, start_m=1e-5, seconds=12.0, frequency_hz=6.25):
    """Two wheelsets, a quarter of a period apart."""
    time = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    phase = 2.0 * np.pi * frequency_hz * time
    envelope = start_m * np.exp(growth_1ps * time)
    return np.column_stack([envelope * np.sin(phase), envelope * np.cos(phase)])


@pytest.mark.parametrize("growth_1ps", [-1.5, -0.2, 0.0, 0.25])
def test_the_growth_of_a_wave(growth_1ps):
    # Two waves a quarter of a period apart have a smooth envelope: exact but for rounding.
    assert growth_rate_1ps(wave(growth_1ps), RATE_HZ) == pytest.approx(growth_1ps, abs=1e-9)


def test_what_saturates_does_not_count():
    """A limit cycle: growth of 1 per second up to 1 mm, then constant. Only its beginning is small."""
    grown = wave(1.0)
    size = np.hypot(*grown.T)
    capped = grown * np.minimum(1.0, 1e-3 / size)[:, None]
    assert LARGEST_M < 1e-3
    assert growth_rate_1ps(capped, RATE_HZ) == pytest.approx(1.0, abs=1e-9)


def test_too_short_or_too_large_a_motion_has_no_growth():
    assert np.isnan(growth_rate_1ps(wave(0.1, seconds=2.9), RATE_HZ))
    assert np.isnan(growth_rate_1ps(wave(0.1, start_m=1e-3), RATE_HZ))


def test_where_growth_crosses_zero():
    """A line through zero at 252 km/h, whatever the order of the speeds; and none to be found."""
    assert decay_limit({260.0: 0.4, 240.0: -0.6}) == pytest.approx(252.0)
    assert decay_limit([(230.0, -2.0), (240.0, -0.6), (260.0, 0.4), (270.0, 5.0)]) == pytest.approx(252.0)
    assert decay_limit({240.0: -0.6, 250.0: -0.1}) is None
    assert decay_limit({260.0: 0.1, 270.0: 0.4}) is None


@pytest.mark.parametrize("places", [(20.0, 380.0), (380.0, 20.0)])
def test_lateral_motion_begins_when_all_axles_have_passed(places):
    """A body that swings sideways by 1e-5 m at 1 Hz, at constant speed, riding either way."""
    track = TrackDesign(name="straight", start_m=0.0, elements=(Straight(400.0),))
    profile = SpeedProfile(*places, 20.0, acceleration_mps2=3.0, jerk_mps3=10.0, rest_s=1.0, final_rest_s=1.0)

    def shape(s, order):
        return 1e-5 * (0.1 * np.pi) ** order * np.sin(0.1 * np.pi * s + 0.5 * order * np.pi)

    swing = along(shape)
    moved = kinematic_truth(track, profile, rate_hz=RATE_HZ, channels={"lateral": swing})
    axle, angle = moved.bodies["body"], moved.wheel_angles["wheel"]
    truth = replace(moved, bodies={"axle": axle}, wheel_angles={"axle.left": angle, "axle.right": angle})
    lateral = lateral_motion(truth, after_m=200.0)
    at = truth.reference_position_m
    fast = np.abs(np.gradient(at, truth.time_s)) >= 0.999 * 20.0
    beyond = (at > 200.0) if places[1] > places[0] else (at < 200.0)
    assert len(lateral) == np.count_nonzero(fast & beyond)
    np.testing.assert_allclose(lateral[:, 0], shape(at[fast & beyond], 0), atol=1e-12)
    table = score_kick(truth, after_m=200.0)
    assert table["quantity"].tolist() == ["lateral_growth"]
    assert table["value"][0] == pytest.approx(0.0, abs=1e-3)
    assert table["unit"].tolist() == ["1/s"]
    late = score_kick(truth, after_m=350.0 if places[1] > places[0] else 50.0)
    assert late["status"].tolist() == ["no three seconds of small lateral motion after the kick"]


@pytest.mark.parametrize("places", [(20.0, 380.0), (380.0, 20.0)])
def test_the_last_axle_says_when_all_have_passed(places):
    """Axles 9 m before and 6 m behind the middle: forward the one behind is the last, backward the other."""
    track = TrackDesign(name="straight", start_m=0.0, elements=(Straight(400.0),))
    profile = SpeedProfile(*places, 20.0, acceleration_mps2=3.0, jerk_mps3=10.0)
    moved = kinematic_truth(track, profile, rate_hz=RATE_HZ)
    axle, angle = moved.bodies["body"], moved.wheel_angles["wheel"]
    truth = replace(
        moved,
        bodies={"front": replace(axle, offset_m=9.0), "rear": replace(axle, offset_m=-6.0)},
        wheel_angles={f"{name}.{side}": angle for name in ("front", "rear") for side in ("left", "right")},
    )
    at = truth.reference_position_m
    fast = np.abs(np.gradient(at, truth.time_s)) >= 0.999 * 20.0
    beyond = (at - 6.0 > 200.0) if places[1] > places[0] else (at + 9.0 < 200.0)
    assert len(lateral_motion(truth, after_m=200.0)) == np.count_nonzero(fast & beyond)
