"""Packets of samples are told from samples that are lost, and spread at the rate that the samples have."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.packets import spread


def stamped(
    size: int, *, jitter: float = 0.0, lost: tuple[int, ...] = (), count: int = 900
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps of packets at 100 Hz, and when their samples were taken."""
    number = np.arange(count)
    packet = number // size
    late = np.random.default_rng(2).normal(0.0, jitter * size / 100.0, packet[-1] + 1)
    stamps = packet * size / 100.0 + (number % size) * 1e-3 + late[packet]
    kept = ~np.isin(packet, lost)
    return stamps[kept], number[kept] / 100.0


@pytest.mark.parametrize("size", [2, 3, 4, 5, 10, 25])
@pytest.mark.parametrize("lost", [(), (7,), (7, 8, 12)])
def test_packets_are_spread_and_lost_ones_stay_gaps(size: int, lost: tuple[int, ...]) -> None:
    stamps, taken = stamped(size, lost=lost)
    found = spread(stamps)
    assert found is not None and found.size == size
    assert found.rate_hz == pytest.approx(100.0, rel=1e-9)
    np.testing.assert_allclose(found.time - found.time[0], taken - taken[0], rtol=0.0, atol=1e-9)
    assert found.moved_s == pytest.approx((size - 1) * 9e-3, abs=1e-9)


def test_packets_that_come_late_now_and_then() -> None:
    stamps, taken = stamped(4, jitter=0.05)
    found = spread(stamps)
    # The mean line through 225 packets of 2 ms jitter: its slope over 9 s.
    assert found is not None and found.rate_hz == pytest.approx(
        100.0, rel=3.0 * 0.002 * np.sqrt(12.0 / 225) / 9.0
    )
    assert np.abs(found.time - taken).max() < 0.002


def test_a_buffer_that_is_emptied_at_another_rate_than_a_multiple() -> None:
    """500 Hz, emptied every 7 ms: three or four samples at a time."""
    taken = np.arange(3000) / 500.0
    came = np.ceil(taken / 0.007 + 1e-9) * 0.007
    stamps = came + (np.arange(3000) - np.searchsorted(came, came)) * 1e-4
    found = spread(stamps)
    assert found is not None and found.rate_hz == pytest.approx(500.0, rel=1e-3)


@pytest.mark.parametrize("share", [0.06, 0.2, 0.5])
def test_samples_lost_at_random_are_no_packets(share: float) -> None:
    for seed in range(40):
        rng = np.random.default_rng(seed)
        kept = rng.random(rng.integers(200, 3000)) > share
        time = np.flatnonzero(kept) / 50.0 + rng.normal(0.0, 1e-3, int(kept.sum()))
        assert spread(np.sort(time)) is None


def test_even_and_jittering_stamps_are_no_packets() -> None:
    assert spread(np.arange(500) / 50.0) is None
    assert spread(np.arange(500) / 50.0 + np.random.default_rng(1).uniform(0.0, 0.01, 500)) is None
    assert spread(np.arange(4.0)) is None
