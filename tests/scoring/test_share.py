"""Shares of devices: intervals and verdicts against exact sums, and false verdicts by trial."""

import math
from functools import cache

import numpy as np
import pytest
from scipy import stats

from simrail.scoring.share import ENOUGH, NOT_ENOUGH, UNDECIDED, decide, effective, least_devices, wilson

CHANCE = 0.05


@cache
def verdict_of(passed: int, devices: int) -> str:
    """Verdict at a look, worked out once."""
    return decide(passed, devices, 0.95, chance=CHANCE, looks=LOOKS)


LOOKS = (20, 30, 45, 60, 90, 135, 203, 305, 458, 687, 1031, 1547)
"""Of a campaign that begins with 20 devices, as `simrail.scenario.stop_rule.stages_of` has them."""


@pytest.mark.parametrize("passed, devices", [(0, 10), (3, 10), (38, 60), (60, 60)])
def test_wilson_ends_where_the_score_test_just_accepts(passed: int, devices: int) -> None:
    """Its ends solve |p^ - p| = z sqrt(p (1 - p) / n)."""
    z = stats.norm.ppf(0.975)
    for end in wilson(passed, devices):
        square = z**2 * end * (1.0 - end) / devices
        assert (passed / devices - end) ** 2 == pytest.approx(square, abs=1e-12)


def test_an_interval_of_nothing_is_nothing() -> None:
    assert all(math.isnan(end) for end in wilson(0, 0))


@pytest.mark.parametrize("share", [0.5, 0.9, 0.95, 0.99])
def test_least_devices_are_the_least_that_are_enough(share: float) -> None:
    least = least_devices(share, 0.05)
    assert share**least <= 0.05 < share ** (least - 1)
    assert decide(least, least, share, chance=0.05) == ENOUGH
    assert decide(least - 1, least - 1, share, chance=0.05) == UNDECIDED


@pytest.mark.parametrize("devices", [30, 60, 200])
def test_verdicts_are_those_of_exact_binomial_sums(devices: int) -> None:
    for passed in range(devices + 1):
        so_many = stats.binom.sf(passed - 1, devices, 0.9)
        so_few = stats.binom.cdf(passed, devices, 0.9)
        wanted = ENOUGH if so_many <= 0.05 else NOT_ENOUGH if so_few < 0.05 else UNDECIDED
        assert decide(passed, devices, 0.9, chance=0.05) == wanted


@pytest.mark.parametrize("true_share, is_false", [(0.90, ENOUGH), (0.949, ENOUGH), (0.951, NOT_ENOUGH)])
def test_false_verdicts_are_rarer_than_their_chance(true_share: float, is_false: str) -> None:
    """2,000 campaigns that stop at their first verdict; refused only if 5 % were too few with 99 %."""
    drawn = np.random.default_rng(19).random((2000, LOOKS[-1])) < true_share
    passed = np.cumsum(drawn, axis=1)[:, np.array(LOOKS) - 1]
    false = 0
    for row in passed:
        for count, devices in zip(row, LOOKS, strict=True):
            verdict = verdict_of(int(count), devices)
            if verdict != UNDECIDED:
                false += verdict == is_false
                break
    assert stats.binom.sf(false - 1, len(passed), 0.05) > 0.01


def test_a_far_better_sheet_is_found_out() -> None:
    """Of devices of which 99 % pass, nearly all campaigns end with enough."""
    drawn = np.random.default_rng(20).random((300, LOOKS[-1])) < 0.99
    passed = np.cumsum(drawn, axis=1)[:, np.array(LOOKS) - 1]
    verdicts = [
        next(
            (
                verdict
                for count, devices in zip(row, LOOKS, strict=True)
                if (verdict := verdict_of(int(count), devices)) != UNDECIDED
            ),
            UNDECIDED,
        )
        for row in passed
    ]
    assert verdicts.count(ENOUGH) > 285


def test_devices_on_tracks_that_decide_count_as_tracks() -> None:
    rng = np.random.default_rng(3)
    tracks = np.repeat(np.arange(40), 10)
    of_tracks = np.exp(0.3 * rng.standard_normal(40))[tracks]
    alone = np.exp(0.3 * rng.standard_normal(400))
    assert effective(of_tracks * np.exp(1e-6 * rng.standard_normal(400)), tracks) == pytest.approx(
        40, rel=1e-3
    )
    # The share between tracks of nothing is estimated to some 1/40; times 9 more devices a track.
    assert effective(alone, tracks) > 400 / (1.0 + 9 * 0.1)
    assert effective(alone, np.zeros(400)) == effective(alone, np.arange(400)) == 400


def test_a_look_at_just_as_many_devices_as_can_be_enough_has_its_part_of_the_chance() -> None:
    """59 that all pass are enough at 5 %, since .95^59 is .0485; at 2.5 % it takes 72."""
    assert decide(59, 59, 0.95, chance=0.05, looks=(58, 59)) == ENOUGH
    assert decide(59, 59, 0.95, chance=0.05, looks=(59, 118)) == UNDECIDED
    assert decide(72, 72, 0.95, chance=0.05, looks=(59, 118)) == ENOUGH


def test_devices_that_are_all_alike_count_as_their_tracks() -> None:
    """Nothing says then that a device differs from its neighbour on the same rails."""
    assert effective([0.2] * 12, [0, 1, 2] * 4) == pytest.approx(3.0)
