"""Levels of chance, consistency bounds and paired comparisons against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from simrail.scoring.share import wilson
from simrail.scoring.statistics import anees_bounds, compare, coverage_bounds, levels

TRIALS = 2000


def test_levels_are_told_apart() -> None:
    """Mean squares of normal data are chi-square: four sd of the variance components' estimates."""
    rng = np.random.default_rng(1)
    tracks, draws, track_sd, sensor_sd = 400, 10, 2.0, 3.0
    values = track_sd * rng.normal(size=(tracks, 1)) + sensor_sd * rng.normal(size=(tracks, draws))
    labels = np.repeat(np.arange(tracks), draws)
    sensor, track = levels(values.ravel(), labels)
    sensor_error = sensor_sd**2 * np.sqrt(2.0 / (tracks * (draws - 1)))
    between = draws * track_sd**2 + sensor_sd**2
    track_error = np.hypot(between * np.sqrt(2.0 / (tracks - 1)), sensor_error) / draws
    assert sensor**2 == pytest.approx(sensor_sd**2, abs=4.0 * sensor_error)
    assert track**2 == pytest.approx(track_sd**2, abs=4.0 * track_error)


def test_levels_are_unbiased_over_few_unequal_tracks() -> None:
    """The size that an unbalanced table counts with is not its mean number of draws."""
    rng = np.random.default_rng(2)
    labels = np.repeat(np.arange(6), [1, 2, 3, 5, 9, 20])
    found = []
    for _ in range(TRIALS):
        values = 3.0 * rng.normal(size=6)[labels] + rng.normal(size=len(labels))
        sensor, track = levels(values, labels)
        found.append((sensor**2, track**2))
    mean, error = np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(TRIALS)
    assert np.all(np.abs(mean - [1.0, 9.0]) < 4.0 * error)


def test_levels_that_the_draws_do_not_allow_are_empty() -> None:
    assert levels([1.0, 2.0, 4.0], [0, 0, 0]) == (
        pytest.approx(np.std([1.0, 2.0, 4.0], ddof=1)),
        pytest.approx(np.nan, nan_ok=True),
    )
    sensor, track = levels([1.0, 2.0, 4.0], [0, 1, 2])
    assert np.isnan(sensor) and track == pytest.approx(np.std([1.0, 2.0, 4.0], ddof=1))
    assert np.isnan(levels([np.nan], [0])).all()
    assert levels([1.0, 3.0, 1.0, 3.0], [0, 0, 1, 1])[1] == 0.0


@pytest.mark.parametrize(("draws", "dimension"), [(10, 1), (50, 3)])
def test_a_consistent_method_lies_in_the_bounds_as_often_as_said(draws: int, dimension: int) -> None:
    rng = np.random.default_rng(3)
    nees = np.square(rng.normal(size=(TRIALS, draws, dimension))).mean(axis=(1, 2))
    low, high = anees_bounds(draws, dimension=dimension)
    inside = np.mean((nees >= low) & (nees <= high))
    assert inside == pytest.approx(0.95, abs=3.0 * np.sqrt(0.95 * 0.05 / TRIALS))
    # A method whose sd is 1.5 times too small is found out as often as chi-square says.
    power = stats.chi2(draws * dimension).sf(draws * dimension * high / 2.25)
    assert np.mean(2.25 * nees > high) == pytest.approx(power, abs=3.0 * np.sqrt(0.25 / TRIALS))
    assert power > 0.5


def test_bounds_are_those_of_the_tables_of_chi_square() -> None:
    """Ten degrees of freedom, 2.5 and 97.5 %: 3.247 and 20.483 in any table."""
    assert anees_bounds(10) == pytest.approx((0.3247, 2.0483), abs=5e-5)
    assert anees_bounds(5, dimension=2) == anees_bounds(10)


def test_errors_that_last_raise_no_false_alarm() -> None:
    """Rides of samples that hang together: averages over rides stay within the bounds for draws."""
    rng, draws = np.random.default_rng(4), 20
    low, high = anees_bounds(draws)
    for lasting in (0.0, 0.9, 1.0):  # share of the variance that lasts for the ride
        ride = np.sqrt(lasting) * rng.normal(size=(500, draws, 1))
        error = ride + np.sqrt(1.0 - lasting) * rng.normal(size=(500, draws, 40))
        nees = np.square(error).mean(axis=(1, 2))
        alarms = np.mean((nees < low) | (nees > high))
        assert alarms <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 500)


def test_bounds_of_coverage_are_binomial() -> None:
    low, high = coverage_bounds(100)
    assert (
        stats.binom(100, 0.95).cdf(round(100 * low) - 1)
        < 0.025
        <= stats.binom(100, 0.95).cdf(round(100 * low))
    )
    assert low == 0.9 and high == 0.99
    assert coverage_bounds(10)[1] == 1.0


def test_paired_differences_do_not_see_what_both_share() -> None:
    rng = np.random.default_rng(5)
    shared = 10.0 * rng.normal(size=40)
    first, second = shared + 0.1 * rng.normal(size=40), shared + 0.3 + 0.1 * rng.normal(size=40)
    found = compare(first, second)
    assert found.difference.low < -0.3 < found.difference.high < 0.0
    assert found.win_rate.value > 0.9 and found.pairs == 40
    difference = first - second
    assert found.effect_size == pytest.approx(difference.mean() / difference.std(ddof=1))
    turned = compare(second, first)
    assert turned.difference.value == -found.difference.value
    assert turned.win_rate.value == 1.0 - found.win_rate.value


def test_the_interval_of_a_difference_covers_over_tracks() -> None:
    rng, inside = np.random.default_rng(6), 0
    labels, trials = np.repeat(np.arange(10), 4), 500
    for _ in range(trials):
        first = rng.normal(size=10)[labels] + rng.normal(size=40)
        second = 0.5 + rng.normal(size=10)[labels] + rng.normal(size=40)
        found = compare(first, second, labels).difference
        inside += found.low <= -0.5 <= found.high
    assert inside / trials == pytest.approx(0.95, abs=3.0 * np.sqrt(0.95 * 0.05 / trials) + 0.5 / 100)


def test_wilson_interval_of_the_win_rate() -> None:
    """Wilson 1927: 8 of 10, 95 %: 0.490 to 0.943 (Newcombe 1998 gives such tables)."""
    first = np.array([0.0] * 8 + [2.0] * 2)
    found = compare(first, np.ones(10)).win_rate
    assert (found.value, found.low, found.high) == pytest.approx((0.8, 0.4902, 0.9433), abs=1e-4)
    assert compare(np.ones(4), np.ones(4)).win_rate.value == 0.5


def test_pairs_need_both() -> None:
    found = compare([1.0, np.nan, 3.0, 4.0], [2.0, 2.0, np.nan, 5.0])
    assert found.pairs == 2 and found.difference.value == -1.0
    assert compare([np.nan], [1.0]).pairs == 0


def test_draws_of_one_track_are_one_trial_of_the_win_rate() -> None:
    rng = np.random.default_rng(4)
    first, labels = rng.normal(size=40), np.repeat(np.arange(8), 5)
    found = compare(first, np.zeros(40), labels).win_rate
    low, high = wilson(8.0 * np.mean(first < 0.0), 8.0)
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-12)
