"""A modulus is undone, exactly; what is none is refused with time and size."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.recording.files.counters import Unwrapped, unwrap

PULSE_M, TURN = 2.0 * np.pi * 0.29 / 1024, 1024
TIME = np.arange(800) / 20.0


def counted(seed: int = 1, *, sign: int = 1) -> np.ndarray:
    """A ride: at rest, faster and faster to 11 m/s, at rest; counts of a wheel whose speed ripples."""
    speed = np.clip(np.minimum(TIME - 3.0, 37.0 - TIME), 0.0, 11.0)
    ripple = 1.0 + 0.02 * np.random.default_rng(seed).standard_normal(len(TIME))
    return sign * np.floor(np.cumsum(speed * ripple) / 20.0 / PULSE_M).astype(np.int64)


def undone(counts: np.ndarray, modulus: int | None = None) -> Unwrapped:
    return unwrap(counts, TIME, m_per_pulse=PULSE_M, turn=TURN, modulus=modulus, field="encoder.count")


def test_a_sound_counter_stays_as_it_is() -> None:
    for sign in (1, -1):
        counts = counted(sign=sign)
        assert undone(counts).counts is counts


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("modulus", "first"),
    [(2**16, 60000), (2**16, 0), (2**32, 2**32 - 900), (9000, 0), (1024, 5), (8192, 1), (10**5, 99000)],
)
@pytest.mark.parametrize("lowest", [0, 0.5])
def test_a_modulus_is_undone(modulus: int, first: int, lowest: float, sign: int) -> None:
    """Unsigned or signed, forwards or backwards, once or many times."""
    counts = counted(sign=sign)
    low = -int(lowest * modulus)
    wrapped = np.mod(counts + first - low, modulus) + low
    found = undone(wrapped)
    times = int(np.count_nonzero(np.abs(np.diff(wrapped)) > modulus // 2))
    assert found.times == times
    np.testing.assert_array_equal(found.counts - found.counts[0], counts - counts[0])
    assert found.modulus == (modulus if times else 0)


def test_an_odd_modulus_is_known_to_what_its_jumps_tell_or_exactly_if_it_is_said() -> None:
    counts = counted()
    wrapped = np.mod(counts, 12347)
    np.testing.assert_array_equal(undone(wrapped, 12347).counts, counts)
    found = undone(wrapped)
    # The ripple of a step, 2 % of 310 pulses, in the mean of its jumps.
    assert abs(found.modulus - 12347) < 3.0 * 0.02 * 310 * np.sqrt(1.5 / found.times) + 2.0


@pytest.mark.parametrize("at", [100, 300, 600])
def test_a_reset_is_refused_with_time_and_size(at: int) -> None:
    counts = counted()
    counts[at:] -= counts[at]
    before, after = counts[at - 1], counts[at]
    with pytest.raises(
        InputError,
        match=rf"jumps at time_s = {TIME[at]:g}.*{after - before} pulses in 0.05 s.*counter_modulus",
    ):
        undone(counts)


def test_a_counter_too_short_to_be_followed_is_refused() -> None:
    with pytest.raises(InputError, match=r"too few to tell|the counter jumps"):
        undone(np.mod(counted(), 512))


def test_late_readings_and_single_pulses_are_no_jumps() -> None:
    counts = counted()
    counts[400] = counts[399]  # a reading that came before the counter had moved on
    assert undone(counts).times == 0
    few = (TIME > 5.0).astype(np.int64) + (TIME > 20.0)
    assert undone(few).times == 0


def test_a_counter_that_has_counted_further_has_no_such_modulus() -> None:
    """1004 counts were seen: the jump of some 1000 is none of a counter that begins anew after 1000."""
    counts = 4 * np.arange(len(TIME))
    counts[252:] -= 1000
    assert counts[251] == 1004
    with pytest.raises(InputError, match="the counter jumps"):
        undone(counts)
    counts[252:] += 1000
    assert undone(np.mod(counts, 1024)).modulus == 1024


@pytest.mark.parametrize("sign", [1, -1])
def test_up_to_nearly_half_a_modulus_a_step_tells_its_direction(sign: int) -> None:
    counts = sign * np.arange(len(TIME))
    np.testing.assert_array_equal(undone(np.mod(440 * counts, 1000), 1000).counts, 440 * counts)
    with pytest.raises(InputError, match=r"too few to tell.*480 pulses between two readings"):
        undone(np.mod(480 * counts, 1000), 1000)
