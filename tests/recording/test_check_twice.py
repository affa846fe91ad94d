"""Blocks of samples that stand twice: told by a noise that no device repeats, and never of a sound one."""

from __future__ import annotations

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.recording.check_samples import Bounds, Channel, check_samples
from simrail.recording.check_twice import LOOKED_AT, check_twice

RATE, SHEET = 100.0, Bounds(50.0, 0.02 / 10.0, "mine")


def signal(count: int = 3000, seed: int = 0, decimals: int = 2) -> np.ndarray:
    """A triad that sways, with a noise of 0.02."""
    sway = np.sin(0.02 * np.arange(count))
    noise = 0.02 * np.random.default_rng(seed).standard_normal((count, 3))
    return np.round(np.column_stack([0.3 * sway, sway, 9.81 + 0.1 * sway]) + noise, decimals)


def judged(values: np.ndarray, noise: float = 0.02) -> None:
    time = np.arange(len(values)) / RATE
    check_twice(["ax", "ay", "az"], list(values.T), noise, lambda sample: f"line {sample + 2}", time)


@pytest.mark.parametrize(("first", "again", "count"), [(500, 600, 100), (100, 2900, 20), (0, 40, 40)])
def test_a_block_that_stands_twice_is_told_with_both_places(first: int, again: int, count: int) -> None:
    values = signal()
    values[again : again + count] = values[first : first + count]
    with pytest.raises(InputError) as raised:
        judged(values)
    said = str(raised.value)
    assert f"from time_s = {first / RATE:g} on again" in said and f"line {again + 2} to" in said
    assert f"time_s = {(again + count - 1) / RATE:.6g};" in said and f"{count} samples" in said


@pytest.mark.parametrize("decimals", [2, 6])
@pytest.mark.parametrize("seed", range(5))
def test_a_sound_signal_passes_with_few_decimals_and_with_many(seed: int, decimals: int) -> None:
    judged(signal(seed=seed, decimals=decimals))


def test_a_device_that_hardly_lives_at_rest_is_not_told_of_its_decimals() -> None:
    """At rest the noise is a tenth of a step, so that blocks of one number stand there by chance."""
    values, rest = signal(), 0.001 * np.random.default_rng(1).standard_normal((1000, 3))
    values[:1000] = np.round(rest + np.array([0.004, 0.0, 9.81]), 2)
    judged(values)
    values[2500:2540] = values[1500:1540]
    with pytest.raises(InputError, match="40 samples"):
        judged(values)


def test_what_was_computed_may_repeat_itself() -> None:
    values = signal()
    values[2000:2100] = values[1000:1100]
    judged(values, noise=0.0)
    time = np.arange(3000) / RATE
    channels = tuple(Channel(name, np.sin(time * k), "m/s2", 1.0) for k, name in enumerate("abc", 1))
    check_samples(channels, "accel", SHEET, time=time, where=str)


def test_of_a_long_signal_some_blocks_are_looked_at_and_a_second_is_found() -> None:
    values = signal(4 * LOOKED_AT, decimals=6)
    values[1_500_000:1_500_100] = values[700_000:700_100]
    with pytest.raises(InputError, match="100 samples"):
        judged(values)


def test_one_axis_that_holds_still_while_the_others_live_is_stuck_after_a_second() -> None:
    values = signal(decimals=3)
    values[1000:1030, 1] = values[1000, 1]
    channels = tuple(Channel(name, values[:, i], "m/s2", 1.0) for i, name in enumerate(("ax", "ay", "az")))
    time = np.arange(len(values)) / RATE
    with pytest.raises(InputError, match=r"ay: repeats one number from line 1000 .*stuck"):
        check_samples(channels, "accel", SHEET, time=time, where=lambda sample: f"line {sample}")
    values[1008:1030, 1] = signal(22, 5, 3)[:, 1]  # a few samples may be equal
    check_samples(channels, "accel", SHEET, time=time, where=str)
