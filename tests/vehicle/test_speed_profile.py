"""The speed profile: exact distances, limits kept, rests exactly at rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.vehicle.speed_profile import Coasting, Restriction, Run, SpeedProfile


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


WAY = SpeedProfile(
    100.0,
    3100.0,
    20.0,
    acceleration_mps2=1.0,
    braking_mps2=0.8,
    jerk_mps3=0.5,
    rest_s=10.0,
    stops=((1500.0, 25.0), (900.0, 20.0)),
    runs=(Run(100.0, 60.0), Run(1600.0, 90.0)),
    restrictions=(Restriction(300.0, 500.0, 12.0), Restriction(450.0, 600.0, 8.0)),
)


def rests(profile, rate=100.0):
    """Where and for how long the train stands, in order."""
    t = np.arange(0.0, profile.duration_s, 1.0 / rate)
    s, v, _ = profile.motion(t)
    still = np.concatenate([[False], v == 0.0, [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    return [(s[a], (b - a) / rate) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 10]


def test_each_run_stops_where_it_passes_and_turns_at_its_end():
    found = rests(WAY)
    wanted = [
        *[(100.0, 10.0), (900.0, 20.0), (1500.0, 25.0), (3100.0, 60.0)],
        *[(1500.0, 25.0), (900.0, 20.0), (100.0, 90.0)],
        *[(900.0, 20.0), (1500.0, 25.0), (1600.0, 5.0)],
    ]
    np.testing.assert_allclose([place for place, _ in found], [place for place, _ in wanted], atol=1e-8)
    np.testing.assert_allclose([time for _, time in found], [time for _, time in wanted], atol=0.021)
    assert WAY.reach_m == (100.0, 3100.0)
    times, cubics = WAY.pieces
    moving = np.abs(cubics[:, :3]).sum(axis=1) > 0.0
    middles = 0.5 * (times[1:] + times[:-1])
    signs = np.sign(WAY.motion(middles)[1])
    np.testing.assert_array_equal(WAY.directions[moving], signs[moving])


def test_restrictions_hold_both_ways_and_the_lowest_counts():
    t = np.arange(0.0, WAY.duration_s, 0.01)
    s, v, a = WAY.motion(t)
    for place in WAY.restrictions:
        inside = (s > place.begin_m) & (s < place.end_m)
        assert np.abs(v[inside]).max() == pytest.approx(place.speed_mps, rel=1e-9) or (
            place.begin_m == 300.0 and np.abs(v[inside]).max() <= 12.0 + 1e-9
        )
        # In neither direction is it slower than it must be: the limit is reached.
        for way in (1.0, -1.0):
            assert np.abs(v[inside & (way * v > 0.0)]).max() > 0.9 * place.speed_mps
    forward = v > 0.0
    # Traction and braking have their own limits, whatever the way.
    assert (a * np.sign(v)).max() <= 1.0 + 1e-9 and (a * np.sign(v)).min() >= -0.8 - 1e-9
    assert np.abs(np.diff(a)).max() <= 0.5 * 0.01 * (1.0 + 1e-6)
    assert forward.any() and (~forward).any()


def test_a_restriction_takes_the_time_that_its_ramps_say():
    """Long stretches: each change of speed dv costs dv/a + a/j, at its mean speed."""
    fast, slow, a, j, length = 20.0, 10.0, 0.5, 0.4, 400.0
    free = SpeedProfile(0.0, 4000.0, fast, acceleration_mps2=a, jerk_mps3=j)
    held = SpeedProfile(
        0.0, 4000.0, fast, acceleration_mps2=a, jerk_mps3=j, restrictions=(Restriction(1800.0, 2200.0, slow),)
    )
    ramp_s = (fast - slow) / a + a / j
    lost = length / slow + 2.0 * ramp_s - (length + 2.0 * ramp_s * 0.5 * (fast + slow)) / fast
    assert held.duration_s - free.duration_s == pytest.approx(lost, abs=1e-9)


def test_a_train_that_coasts_slows_down_by_resistance_alone_and_holds_the_least_speed():
    profile = SpeedProfile(
        0.0, 6000.0, 20.0, acceleration_mps2=1.0, jerk_mps3=0.5, coasting=Coasting(0.04, 14.0)
    )
    t = np.arange(0.0, profile.duration_s, 0.01)
    s, v, a = profile.motion(t)
    assert s[-1] == pytest.approx(6000.0, abs=1e-6) and v.max() == pytest.approx(20.0, rel=1e-12)
    rolls = np.abs(a + 0.04) < 1e-9
    # From 20 to 14 m/s at 0.04 m/s2, less the two ramps of jerk in which it is not yet so slow.
    assert np.count_nonzero(rolls) * 0.01 == pytest.approx(6.0 / 0.04 - 0.04 / 0.5, abs=0.03)
    held = (np.abs(v - 14.0) < 1e-9) & (a == 0.0)
    assert np.count_nonzero(held) > 1000
    # On a short way it brakes out of the roll, between the two speeds.
    short = SpeedProfile(
        0.0, 1500.0, 20.0, acceleration_mps2=1.0, jerk_mps3=0.5, coasting=Coasting(0.04, 14.0)
    )
    _, v, a = short.motion(np.arange(0.0, short.duration_s, 0.01))
    end = v[np.flatnonzero(np.abs(a + 0.04) < 1e-9)[-1]]
    assert 14.5 < end < 19.5


@settings(max_examples=60, deadline=None)
@given(
    places=st.lists(st.integers(0, 20_000), min_size=2, max_size=8, unique=True),
    speeds=st.lists(st.floats(1.0, 40.0), min_size=4, max_size=4),
    back=st.booleans(),
    coasts=st.booleans(),
)
def test_any_restrictions_are_kept(places, speeds, back, coasts):
    """However short the stretches: every limit holds, acceleration is continuous, and the end is reached."""
    pairs = [0.1 * place for place in sorted(places)[: len(places) // 2 * 2]]
    limits = [
        Restriction(low, high, speed)
        for low, high, speed in zip(pairs[::2], pairs[1::2], speeds[: len(pairs) // 2], strict=True)
    ]
    start, end = (2000.0, 0.0) if back else (0.0, 2000.0)
    profile = SpeedProfile(
        start,
        end,
        25.0,
        acceleration_mps2=1.2,
        braking_mps2=0.9,
        jerk_mps3=0.7,
        restrictions=tuple(limits),
        coasting=Coasting(0.05, 12.0) if coasts else None,
    )
    t = np.linspace(0.0, profile.duration_s, 20_001)
    s, v, a = profile.motion(t)
    assert s[-1] == pytest.approx(end, abs=1e-6) and v[-1] == 0.0
    for place in limits:
        inside = (s > place.begin_m + 1e-6) & (s < place.end_m - 1e-6)
        assert np.all(np.abs(v[inside]) <= place.speed_mps + 1e-6)
    assert np.all(np.abs(v) <= 25.0 + 1e-6)
    assert np.all(np.abs(np.diff(a)) <= 0.7 * (t[1] - t[0]) * (1.0 + 1e-6) + 1e-9)
    times, cubics = profile.pieces
    step = np.diff(times)[:-1]
    c = cubics[:-1]
    ends = ((c[:, 0] * step + c[:, 1]) * step + c[:, 2]) * step + c[:, 3]
    np.testing.assert_allclose(ends, cubics[1:, 3], atol=1e-7)
