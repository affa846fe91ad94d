"""Counts against closed forms, each error term against its own statistic, and what a logger makes of them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from simrail.core.columns import EDGE_TIME
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray, njit
from simrail.recording.recording import EncoderSheet
from simrail.sensors.encoder import EncoderSpec, Slip, nominal_radius, sample_encoder

TIME = np.arange(60_001) / 1000.0
FAST = {"rate_hz": 1000.0}
TURN = 2.0 * np.pi


def sample(angle, *, draw=0, time=TIME, **more):
    spec = EncoderSpec("front.left", **({"pulses_per_revolution": 1024, "rate_hz": 250.0} | more))
    return sample_encoder(angle, time[: len(angle)], spec, seed=5, draw=draw)


def counts_of(angle, **more):
    return sample(angle, **more)["pulse_count"].to_numpy()


def sheet(pulses=1024, rate_hz=1000.0):
    return EncoderSheet("front.left", pulses, 0.29, rate_hz)


def recovered_phase(draw: int) -> float:
    """Phase of the encoder, from where a slowly turning wheel passes its first edge."""
    slow = TIME / TIME[-1] * TURN / 1024
    return 1.0 - np.argmax(counts_of(slow, draw=draw, **FAST) == 1) / (len(TIME) - 1)


@pytest.mark.parametrize("direction", (1.0, -1.0))
def test_counts_are_exact_for_a_ride_in_closed_form(direction):
    angle = direction * (3.0 * TIME + 0.4 * TIME**2)
    frame = sample(angle)
    phase = recovered_phase(0)
    edges = angle[::4] * 1024 / TURN + phase
    clear = np.abs(edges - np.rint(edges)) > 1e-4
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(frame["pulse_count"].to_numpy()[clear], np.floor(edges)[clear])
    np.testing.assert_array_equal(frame.index, TIME[::4])
    assert frame["pulse_count"].iloc[0] == 0
    assert frame["pulse_count"].dtype == np.int64
    assert list(frame) == ["pulse_count"]


@pytest.mark.parametrize("direction", (1, -1))
@pytest.mark.parametrize("quadrature", (False, True))
@pytest.mark.parametrize(("pulses", "numerator", "denominator"), [(1024, 1, 256), (100, 7, 300), (60, 3, 7)])
def test_counts_are_exact_on_the_very_edges(direction, quadrature, pulses, numerator, denominator):
    """k/q of a turn after k samples, phase 1/4 count: integer arithmetic says which edges have passed."""
    k = direction * np.arange(len(TIME)) * numerator
    got = counts_of(
        TURN * k / denominator, pulses_per_revolution=pulses, quadrature=quadrature, phase=0.25, **FAST
    )
    per_turn = pulses * (4 if quadrature else 1)
    np.testing.assert_array_equal(got, (4 * k * per_turn + denominator) // (4 * denominator))
    on_edge = (4 * k * per_turn + denominator) % (4 * denominator) == 0
    straight = counts_of(
        TURN * k / denominator, pulses_per_revolution=pulses, quadrature=quadrature, phase=0.0, **FAST
    )
    np.testing.assert_array_equal(straight, k * per_turn // denominator)
    assert on_edge.any() or (k * per_turn % denominator == 0).sum() > 100


def test_counts_are_exact_over_a_ride_that_speeds_up_on_edges():
    """theta = 2 pi k^2 / 2^20 of a turn: half a million squared over a power of two, forth and back."""
    k = np.concatenate([np.arange(30_001), np.arange(29_999, -1, -1)])
    got = counts_of(TURN * (k * k) / 2.0**20, phase=0.0, **FAST)
    np.testing.assert_array_equal(got, k * k * 1024 // 2**20)
    assert got[-1] == 0


def test_counts_go_down_backwards_and_return():
    angle = -5.0 * np.sin(TURN * TIME / TIME[-1])
    counts = counts_of(angle)
    assert counts.min() == pytest.approx(-5.0 * 1024 / TURN, abs=1.0)
    assert abs(counts[-1]) <= 1


def test_phase_is_uniform_over_draws():
    phases = [recovered_phase(draw) for draw in range(200)]
    assert stats.kstest(phases, "uniform").pvalue > 0.01


def test_a_standing_wheel_gives_no_pulses():
    assert (counts_of(np.full(5000, 1.234), edge_jitter_sd=0.1, edge_pattern_sd=0.1) == 0).all()


def test_quadrature_counts_four_edges_a_pulse():
    angle = 3.0 * TIME - 0.1 * TIME**2
    fine, coarse = (counts_of(angle, phase=0.0, quadrature=q) for q in (True, False))
    np.testing.assert_array_equal(fine // 4, coarse)
    assert np.abs(fine).max() > 3.9 * np.abs(coarse).max()


# Edge terms: a wheel so slow that every edge falls between two samples of its own, 100 samples a count.
PULSES, PER_COUNT, TURNS = 50, 100, 400
STEPS = np.arange(TURNS * PULSES * PER_COUNT + 1)
STEADY = TURN * STEPS / (PULSES * PER_COUNT)
STEADY_TIME = STEPS / 1000.0


def edge_errors(*, sign=1.0, quadrature=False, **terms):
    """Where the edges of a steadily turning wheel are, less where they belong, in pulses: (turns, edges)."""
    per_pulse = 4 if quadrature else 1
    counts = counts_of(
        sign * STEADY / per_pulse,
        time=STEADY_TIME,
        pulses_per_revolution=PULSES,
        quadrature=quadrature,
        phase=0.5,
        **FAST,
        **terms,
    )
    passed = np.repeat(np.arange(len(counts) - 1), np.maximum(np.diff(sign * counts), 0).astype(int)) + 0.5
    per_turn = PULSES * per_pulse
    whole = len(passed) // per_turn - 1
    places = passed[: whole * per_turn] / PER_COUNT - 0.5 - np.arange(whole * per_turn)
    return places.reshape(whole, per_turn) / per_pulse


def test_an_ideal_disc_has_its_edges_in_place():
    assert np.abs(edge_errors()).max() <= 1.0 / PER_COUNT


@pytest.mark.parametrize("sign", (1.0, -1.0))
@pytest.mark.parametrize("quadrature", (False, True))
def test_the_pattern_of_the_disc_repeats_every_turn(sign, quadrature):
    errors = edge_errors(sign=sign, quadrature=quadrature, edge_pattern_sd=0.04)
    assert np.ptp(errors, axis=0).max() <= 1.01 / PER_COUNT
    n = errors.shape[1]
    # sd of n normal values: chi-square, 1 in 1000 either side.
    low, high = np.sqrt(stats.chi2.ppf([0.001, 0.999], n - 1) / (n - 1))
    assert low < errors[0].std(ddof=1) / 0.04 < high
    again = edge_errors(sign=sign, quadrature=quadrature, edge_pattern_sd=0.04, draw=0)
    np.testing.assert_array_equal(errors, again)
    assert np.abs(errors[0] - edge_errors(edge_pattern_sd=0.04, draw=1)[0][0]).max() > 0.01


def test_the_disc_is_the_same_forward_and_backward():
    """From half a pulse past edge 0 a wheel meets the edges 1, 2, ... or 0, -1, ... of one disc."""
    there, back = (edge_errors(sign=sign, edge_pattern_sd=0.04)[0] for sign in (1.0, -1.0))
    number = np.arange(PULSES)
    np.testing.assert_allclose(there[number - 1], -back[-number % PULSES], atol=2.02 / PER_COUNT)


@pytest.mark.parametrize("sign", (1.0, -1.0))
@pytest.mark.parametrize("quadrature", (False, True))
def test_jitter_is_new_at_every_edge_of_every_turn(sign, quadrature):
    sd = 0.1 if not quadrature else 0.03  # edges of a pulse keep their order
    errors = edge_errors(sign=sign, quadrature=quadrature, edge_jitter_sd=sd).ravel()
    n = len(errors)
    low, high = np.sqrt(stats.chi2.ppf([1e-4, 1.0 - 1e-4], n) / n)
    assert low < np.sqrt(np.mean(errors**2)) / sd < high * 1.01
    per_turn = PULSES * (4 if quadrature else 1)
    for lag in (1, per_turn):
        assert abs(np.corrcoef(errors[lag:], errors[:-lag])[0, 1]) < 4.0 / np.sqrt(n)


def test_edges_behind_the_start_jitter_on_their_own():
    there, back = (edge_errors(sign=sign, edge_jitter_sd=0.1).ravel() for sign in (1.0, -1.0))
    for shift in (0, 1, 2):
        together = np.corrcoef(there[: 1000 - shift], back[shift:1000])[0, 1]
        assert abs(together) < 4.0 / np.sqrt(1000), shift


def test_jitter_belongs_to_the_edge_so_turning_back_counts_back():
    there = np.concatenate([STEADY[:50_000], STEADY[50_000::-1]])
    counts = counts_of(there, time=STEADY_TIME, pulses_per_revolution=PULSES, edge_jitter_sd=0.3, **FAST)
    np.testing.assert_array_equal(counts[:50_000], counts[:50_000:-1][:50_000])


@pytest.mark.parametrize("sign", (1.0, -1.0))
@pytest.mark.parametrize("quadrature", (False, True))
def test_missed_pulses_come_at_their_rate_and_are_never_made_up(sign, quadrature):
    rate, angle = 1e-3, sign * 30.0 * TIME
    settings = {"quadrature": quadrature, "phase": 0.5} | FAST
    full, holed = counts_of(angle, **settings), counts_of(angle, missed_rate=rate, **settings)
    lost = sign * (full - holed)
    per_pulse = 4 if quadrature else 1
    assert (np.diff(lost) >= 0).all()
    assert (np.diff(sign * holed) >= 0).all()  # a missed pulse is not counted backwards
    pulses = abs(full[-1]) // per_pulse
    assert lost[-1] % per_pulse == 0 or lost[-1] > per_pulse
    low, high = stats.binom.ppf([0.0005, 0.9995], pulses, rate)
    assert low <= lost[-1] // per_pulse <= high
    # The gaps between them are geometric: their mean is 1/rate and so is their sd.
    gaps = np.diff(np.flatnonzero(np.diff(lost))) * 30.0 / 1000.0 * 1024 / TURN
    assert gaps.std() / gaps.mean() == pytest.approx(1.0, abs=0.25)


def test_a_missed_pulse_is_missed_when_it_passes():
    """In quadrature with all four edges: between two pulses whole pulses have been counted."""
    settings = {"quadrature": True, "phase": 0.0} | FAST
    angle = 2.0 * TIME
    full, holed = counts_of(angle, **settings), counts_of(angle, missed_rate=0.2, **settings)
    assert (np.diff(full) <= 2).all() and holed[-1] < 0.85 * full[-1]
    assert not (holed[full % 4 == 0] % 4).any()


def test_missed_pulses_are_lost_both_ways():
    """Forth and back ends away from where it began: by missed-forth minus missed-back."""
    angle = 30.0 * np.minimum(TIME, TIME[-1] - TIME)
    ends = [counts_of(angle, missed_rate=0.01, phase=0.5, draw=draw)[-1] for draw in range(40)]
    pulses = 30.0 * 30.0 * 1024 / TURN
    expected = np.sqrt(2.0 * pulses * 0.01)
    low, high = np.sqrt(stats.chi2.ppf([0.001, 0.999], 40) / 40)
    assert low < np.sqrt(np.mean(np.square(ends))) / expected < high


@pytest.mark.parametrize("direction", (1.0, -1.0))
@pytest.mark.parametrize("creepage", (0.15, -0.2, -1.0))
def test_slip_turns_the_wheel_by_the_integral_of_creepage(direction, creepage):
    omega = 40.0
    event = Slip(start_s=20.0, duration_s=3.0, creepage=creepage, ramp_s=0.5)
    angle = direction * omega * TIME
    settings = {"phase": 0.5} | FAST
    more = counts_of(angle, slip=(event,), **settings) - counts_of(angle, **settings)
    # Each raised cosine ramp of 0.5 s is worth half of it.
    expected = direction * creepage * omega * (3.0 - 0.5) * 1024 / TURN
    assert more[-1] == pytest.approx(expected, abs=1.0)
    assert (more[:20_000] == 0).all() and np.ptp(more[23_000:]) <= 1
    halfway = direction * creepage * omega * (1.5 - 0.25) * 1024 / TURN
    assert more[21_500] == pytest.approx(halfway, abs=1.0)
    twice = counts_of(angle, slip=(event, replace(event, start_s=30.0)), **settings)
    assert twice[-1] - counts_of(angle, **settings)[-1] == pytest.approx(2.0 * expected, abs=1.0)


def test_a_locked_wheel_stands_while_the_train_slides():
    counts = counts_of(40.0 * TIME, slip=(Slip(20.0, 3.0, -1.0, ramp_s=0.5),), **FAST)
    assert np.ptp(counts[20_500:22_500]) <= 1


def test_slip_does_nothing_at_rest():
    angle = np.full(len(TIME), 0.3)
    assert (counts_of(angle, slip=(Slip(20.0, 3.0, 5.0),), edge_jitter_sd=0.1) == 0).all()


@pytest.mark.parametrize("term", ["edge_pattern_sd", "edge_jitter_sd", "missed_rate"])
def test_terms_have_streams_of_their_own_and_a_longer_ride_begins_with_the_shorter(term):
    angle = np.cumsum(np.sin(TIME / 5.0)) * 0.03
    terms = {"edge_pattern_sd": 0.05, "edge_jitter_sd": 0.05, "missed_rate": 0.01, "edge_times": True}
    whole = sample(angle, **terms)
    part = sample(angle[:40_001], **terms)
    assert whole.iloc[: len(part)].equals(part)
    # A new term moves no edge of another: whatever is left is what that term alone does.
    alone = sample(angle, **{name: 0.0 for name in terms if name not in (term, "edge_times")}, **{term: 0.05})
    assert alone.equals(sample(angle, **{term: 0.05}))


# What a logger makes of it: it counts, or it times edges.


def speed_by_counting(encoder: pd.DataFrame, sheet: EncoderSheet, *, readings: int = 1) -> pd.Series:
    """Mean speed over the interval of so many readings that ends at each, m/s: pulses over time."""
    counts = encoder["pulse_count"].to_numpy(dtype=np.float64)
    times = encoder.index.to_numpy(dtype=np.float64)
    begin = np.maximum(np.arange(len(counts)) - readings, 0)
    elapsed = times - times[begin]
    elapsed[0] = np.inf
    speed = (counts - counts[begin]) * sheet.pulse_m / elapsed
    return pd.Series(speed, index=encoder.index, name="speed_mps")


def speed_by_period(encoder: pd.DataFrame, sheet: EncoderSheet, *, still_s: float = 0.5) -> pd.Series:
    """Speed from the way between two edges over the time between them, m/s; zero long after the last."""
    speed = _by_period(
        encoder.index.to_numpy(dtype=np.float64),
        encoder["pulse_count"].to_numpy(dtype=np.float64),
        encoder[EDGE_TIME].to_numpy(dtype=np.float64),
        sheet.pulse_m,
        still_s,
    )
    return pd.Series(speed, index=encoder.index, name="speed_mps")


@njit
def _by_period(time: FloatArray, count: FloatArray, edge: FloatArray, way: float, still: float) -> FloatArray:
    """Loop of `speed_by_period`; way is that of one count."""
    speed = np.zeros(len(time))
    known = False  # whether an edge has passed
    place, when = 0.0, edge[0]  # of the last edge, in counts
    value = 0.0
    for k in range(1, len(time)):
        change = count[k] - count[k - 1]
        if edge[k] > when or change != 0.0:
            # The edge just passed lies below the count when going up, above it when going down.
            if change == 0.0:
                now = place  # to and fro within one reading
            elif change > 0.0:
                now = count[k]
            else:
                now = count[k] + 1.0
            if known and edge[k] > when:
                value = (now - place) * way / (edge[k] - when)
            place, when, known = now, edge[k], True
        awaited = time[k] - when
        if awaited > still:
            value = 0.0
        if awaited > 0.0 and abs(value) * awaited > way:
            value = np.sign(value) * way / awaited
        speed[k] = value
    return speed


def test_way_and_speed_by_counting_are_quantised_as_theory_says():
    frame, card = sample(9.0 * TIME, **FAST), sheet()
    quantum = TURN * 0.29 / 1024
    assert card.pulse_m == pytest.approx(quantum, rel=1e-15)
    way = (frame["pulse_count"] - frame["pulse_count"].iloc[0]) * card.pulse_m
    assert np.abs(way - 0.29 * 9.0 * TIME).max() <= quantum
    for readings in (1, 4, 250):
        speed = speed_by_counting(frame, card, readings=readings)
        interval = readings / 1000.0
        late = speed.to_numpy()[readings:]
        steps = late / (quantum / interval)
        np.testing.assert_allclose(steps, np.rint(steps), rtol=0, atol=1e-6)
        assert np.ptp(np.rint(steps)) == 1  # two neighbouring values, no third
        assert np.abs(late - 0.29 * 9.0).max() < quantum / interval
        assert late.mean() == pytest.approx(0.29 * 9.0, abs=quantum / 59.0)
    assert speed.iloc[0] == 0.0


@pytest.mark.parametrize("direction", (1.0, -1.0))
@pytest.mark.parametrize("omega", (0.2, 40.0))
def test_speed_by_period_is_quantised_by_the_timer(omega, direction):
    timer_hz, pulses = 10_000.0, 100
    angle = direction * omega * TIME
    frame = sample(angle, pulses_per_revolution=pulses, edge_times=True, timer_hz=timer_hz)
    ticks = frame["edge_time_s"].to_numpy() * timer_hz
    np.testing.assert_allclose(ticks, np.rint(ticks), rtol=0, atol=1e-6)
    assert (frame["edge_time_s"] <= frame.index).all()
    speed = speed_by_period(frame, sheet(pulses)).to_numpy()
    true, quantum = direction * 0.29 * omega, TURN * 0.29 / pulses
    late = speed[1000:]
    new = np.flatnonzero(np.diff(frame["edge_time_s"].to_numpy()[999:]) > 0.0)
    period = quantum / abs(true)
    edges = max(1.0, np.floor(0.004 / period))  # that one reading sees at the least
    relative = late[new] / true - 1.0
    # Two ends, each early by less than a tick: the time is off by less than one.
    tick = 1.0 / timer_hz
    assert np.abs(relative).max() <= tick / (edges * period - tick) * 1.001
    assert np.abs(relative).max() > 0.05 * tick / (2.0 * edges * period)
    assert relative.mean() == pytest.approx(0.0, abs=0.05 * tick / (edges * period))
    if omega < 1.0:
        periods = np.rint(quantum / np.abs(late[new]) * timer_hz)
        np.testing.assert_allclose(quantum / np.abs(late[new]) * timer_hz, periods, rtol=0, atol=1e-3)
        assert np.ptp(periods) == 1.0
        # Counting over one reading sees 0 or a whole pulse: 40 times as coarse as the speed itself.
        assert speed_by_counting(frame, sheet(pulses)).abs().max() > 20.0 * abs(true)


def test_speed_by_period_at_standstill_and_reversal():
    angle = 5.0 * np.sin(0.1 * TIME)  # turns back at 15.7 s and 47.1 s
    frame = sample(angle, edge_times=True)
    speed = speed_by_period(frame, sheet()).to_numpy()
    true = 0.29 * 0.5 * np.cos(0.1 * frame.index.to_numpy())
    quantum = sheet().pulse_m
    # The mean of the last period is half a period old when new and one and a half when the next edge comes;
    # the speed changes by 0.0145 m/s2 at most, and a period by little while it is short.
    brisk = np.abs(true) > 0.02
    brisk[0:10] = False
    lag = quantum / np.maximum(np.abs(true), 1e-9)
    assert (np.abs(speed - true) < 1.5 * 0.0145 * 1.2 * lag + 1e-4)[brisk].all()
    assert np.abs(speed - true).max() < 0.15 and (np.abs(speed[~brisk][10:]) < 0.03).all()
    # Never faster away than the last edge allows; zero at the reversal itself, sign right on both sides.
    assert speed[3925] == pytest.approx(0.0, abs=0.01)
    assert speed[3000] > 0.0 > speed[5000]
    stopped = sample(np.minimum(TIME, 10.0), edge_times=True)
    rest = speed_by_period(stopped, sheet()).loc[10.02:]
    assert (rest.diff().dropna() <= 0.0).all() and (rest.loc[10.6:] == 0.0).all()
    assert (rest.loc[10.1:10.4] * (rest.loc[10.1:10.4].index - 10.0) < 1.1 * quantum).all()


def test_an_edge_to_and_fro_is_no_speed():
    """A wheel that trembles on one edge, as it may at a platform."""
    angle = TURN / 1024 * (0.5 + 0.2 * np.sign(np.sin(TURN * 3.1 * TIME)))
    frame = sample(angle, edge_times=True, phase=0.9)
    assert frame["pulse_count"].nunique() == 2
    assert (speed_by_period(frame, sheet()) == 0.0).all()
    assert speed_by_counting(frame, sheet()).abs().max() > 0.4


def test_edge_times_are_where_the_edges_are():
    angle = 2.0 * TIME
    frame = sample(angle, edge_times=True, phase=0.25, timer_hz=1e7)
    count = frame["pulse_count"].to_numpy()
    passed = count > 0
    expected = (count - 0.25) * TURN / 1024 / 2.0
    early = expected - frame["edge_time_s"].to_numpy()  # the timer shows the last whole tick
    assert early[passed].min() > -1e-10 and early[passed].max() < 1.001e-7
    assert (frame["edge_time_s"].to_numpy()[~passed] == 0.0).all()
    back = sample(-angle, edge_times=True, phase=0.25, timer_hz=1e7)
    count = back["pulse_count"].to_numpy()
    expected = -(count + 1 - 0.25) * TURN / 1024 / 2.0
    passed = count < 0
    early = expected - back["edge_time_s"].to_numpy()
    assert early[passed].min() > -1e-10 and early[passed].max() < 1.001e-7


def test_radius_error_is_drawn_or_fixed():
    spec = EncoderSpec("front.left", radius_error_sd=1e-3)
    errors = np.array([nominal_radius(0.29, spec, seed=1, draw=draw) / 0.29 - 1.0 for draw in range(1000)])
    assert errors.std() == pytest.approx(1e-3, rel=0.08)
    assert stats.kstest(errors / 1e-3, "norm").pvalue > 0.01
    other = EncoderSpec("rear.left", radius_error_sd=1e-3)
    assert nominal_radius(0.29, other, seed=1, draw=0) != nominal_radius(0.29, spec, seed=1, draw=0)
    fixed = EncoderSpec("front.left", radius_error_sd=1e-3, radius_error=-0.005)
    assert nominal_radius(0.29, fixed, seed=1, draw=7) == pytest.approx(0.28855, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pulses_per_revolution": 0}, ["pulses_per_revolution", "0", ">= 1"]),
        ({"rate_hz": 300.0}, ["does not divide"]),
        ({"edge_pattern_sd": -0.1}, ["edge_pattern_sd", "-0.1", "fraction of a pulse"]),
        ({"edge_jitter_sd": 2.0}, ["edge_jitter_sd", "2.0", "0.5"]),
        ({"edge_jitter_sd": float("nan")}, ["edge_jitter_sd", "nan"]),
        ({"missed_rate": 1.0}, ["missed_rate", "probability"]),
        ({"timer_hz": 0.0}, ["timer_hz", "> 0"]),
        ({"phase": 1.0}, ["phase", "< 1"]),
        ({"slip": (Slip(1.0, 0.0, 0.1),)}, ["slip[0].duration_s", "> 0 s"]),
        ({"slip": (Slip(1.0, 1.0, 0.1), Slip(1.0, 1.0, 0.1, 0.6))}, ["slip[1].ramp_s", "0.5 s"]),
        ({"slip": (Slip(1.0, 1.0, -1.2),)}, ["slip[0].creepage", "-1.2", "locked"]),
    ],
)
def test_bad_encoders_are_refused(change, words):
    with pytest.raises(InputError) as caught:
        sample(TIME, **change)
    assert all(word in str(caught.value) for word in words), str(caught.value)
