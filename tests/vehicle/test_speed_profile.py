"""The speed profile: exact distances, limits kept, rests exactly at rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.vehicle.speed_profile import SpeedProfile


@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(-1e3, 1e3),
    distance=st.floats(0.01, 5e3),
    speed=st.floats(0.1, 60.0),
    acceleration=st.floats(0.05, 2.0),
    jerk=st.floats(0.05, 5.0),
    backward=st.booleans(),
)
def test_reaches_its_end_within_its_limits(start, distance, speed, acceleration, jerk, backward):
    end = start - distance if backward else start + distance
    profile = SpeedProfile(start, end, speed, acceleration_mps2=acceleration, jerk_mps3=jerk, rest_s=1.0)
    t = np.linspace(0.0, profile.duration_s, 4001)
    s, v, a = profile.motion(t)
    assert s[0] == start
    assert s[-1] == pytest.approx(end, abs=1e-9 * max(1.0, abs(end), distance))
    assert np.all(np.abs(v) <= speed * (1 + 1e-9))
    assert np.all(np.abs(a) <= acceleration * (1 + 1e-9))
    assert np.all(np.abs(np.diff(a)) <= jerk * (t[1] - t[0]) * (1 + 1e-6) + 1e-12)
    sign = -1.0 if backward else 1.0
    assert np.all(sign * v >= -1e-9)
    assert v[0] == 0.0 and v[-1] == 0.0


def test_speed_and_acceleration_are_the_derivatives():
    profile = SpeedProfile(0.0, 400.0, 12.0, stops=((150.0, 7.0),))
    h = 1e-4
    t = np.linspace(1.0, profile.duration_s - 1.0, 997)
    s, v, a = profile.motion(t)
    ahead, behind = profile.motion(t + h)[0], profile.motion(t - h)[0]
    np.testing.assert_allclose((ahead - behind) / (2 * h), v, atol=1e-7)
    # A jerk step inside the stencil leaves at most jerk * h / 3 there.
    np.testing.assert_allclose((ahead - 2 * s + behind) / h**2, a, atol=profile.jerk_mps3 * h + 1e-4)


def test_dwells_at_its_stops_exactly_at_rest():
    profile = SpeedProfile(0.0, 400.0, 12.0, rest_s=5.0, final_rest_s=3.0, stops=((150.0, 7.0),))
    t = np.arange(0.0, profile.duration_s, 1e-3)
    s, v, _ = profile.motion(t)
    dwell = np.abs(s - 150.0) < 1e-9
    assert np.count_nonzero(dwell & (v == 0.0)) == pytest.approx(7000, abs=2)
    assert np.count_nonzero(v == 0.0) == pytest.approx(15000, abs=4)


def test_cruises_at_the_set_speed():
    profile = SpeedProfile(0.0, 1000.0, 20.0 / 3.6)
    _, v, _ = profile.motion(profile.duration_s / 2)
    assert v == pytest.approx(20.0 / 3.6, rel=1e-12)


def test_stops_out_of_order_are_refused():
    with pytest.raises(InputError, match="order of travel"):
        SpeedProfile(0.0, 400.0, 12.0, stops=((300.0, 5.0), (150.0, 5.0))).motion(0.0)
