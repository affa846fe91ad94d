"""What lies on the rails: the friction channels of the laid track."""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.track.design import Straight, TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import CHANNELS, lay
from simrail.track.rail_condition import FADE_M, RailCondition, check_conditions

DESIGN = TrackDesign("level", -20.3, (Straight(300.0),))
LEAVES, WET = RailCondition(50.0, 80.0, 0.2), RailCondition(80.0, 100.0, 0.5, "right")


def factors(s, *conditions, derivative=0):
    laid = lay(DESIGN, Irregularity("none", fade_m=0.0), seed=0, conditions=conditions)
    return laid.channels(s, derivative=derivative)[..., CHANNELS.index("friction_left") :]


def test_clean_rails_are_exactly_1():
    np.testing.assert_array_equal(factors(np.linspace(-20.0, 279.0, 1000)), 1.0)


def test_full_inside_the_fades_and_clean_outside_to_1e_6():
    inside = np.linspace(50.0 + FADE_M + 0.5, 80.0 - FADE_M - 0.5, 50)
    np.testing.assert_allclose(factors(inside, LEAVES, WET), 0.2, atol=1e-6)
    outside = np.concatenate([np.linspace(0.0, 49.5, 50), np.linspace(100.5, 200.0, 50)])
    np.testing.assert_allclose(factors(outside, LEAVES, WET), 1.0, atol=1e-6)
    one_rail = factors(np.linspace(85.0, 95.0, 9), LEAVES, WET)
    np.testing.assert_allclose(one_rail, np.tile([1.0, 0.5], (9, 1)), atol=1e-6)


def test_fades_are_smooth_and_within_bounds():
    """C2: the second derivative changes by less than 1 % of its span from one mm to the next."""
    s = np.arange(49.0, 56.0, 1e-3)
    value = factors(s, LEAVES)
    assert value.min() > 0.2 - 1e-5
    assert value.max() < 1.0 + 1e-5
    bend = factors(s, LEAVES, derivative=2)[:, 0]
    assert np.abs(np.diff(bend)).max() < 0.01 * np.ptp(bend)


@pytest.mark.parametrize(
    ("conditions", "field"),
    [
        (
            (RailCondition(50.0, 80.0, 0.2), RailCondition(79.0, 90.0, 0.5, "left")),
            "rail_condition[1].start_m",
        ),
        (
            (RailCondition(79.0, 90.0, 0.5, "left"), RailCondition(50.0, 80.0, 0.2)),
            "rail_condition[1].start_m",
        ),
        ((RailCondition(-30.0, 80.0, 0.2),), "rail_condition[0].start_m"),
        ((RailCondition(30.0, 300.0, 0.2),), "rail_condition[0].end_m"),
        ((RailCondition(30.0, 37.0, 0.2),), "rail_condition[0].end_m"),
        ((RailCondition(80.0, 50.0, 0.2),), "rail_condition[0].end_m"),
        ((RailCondition(50.0, 80.0, 0.0),), "rail_condition[0].friction"),
        ((RailCondition(50.0, 80.0, float("nan")),), "rail_condition[0].friction"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(conditions, field):
    with pytest.raises(InputError) as caught:
        check_conditions(conditions, DESIGN.start_m, DESIGN.end_m)
    assert caught.value.field == field


def test_different_rails_may_overlap():
    check_conditions(
        (RailCondition(50.0, 80.0, 0.2, "left"), RailCondition(60.0, 90.0, 0.5, "right")), 0.0, 99.0
    )
