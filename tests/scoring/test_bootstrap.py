"""Intervals hold what they promise: coverage over simulated campaigns, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from simrail.scoring.bootstrap import FEWEST, RESAMPLES, clustered, interval, mean_interval, resampled

CAMPAIGNS = 2000


def campaigns(tracks: int, draws: int, *, track_sd: float, sensor_sd: float, seed: int) -> np.ndarray:
    """Values (campaigns, tracks, draws) about 5."""
    rng = np.random.default_rng(seed)
    track = track_sd * rng.normal(size=(CAMPAIGNS, tracks, 1))
    return 5.0 + track + sensor_sd * rng.normal(size=(CAMPAIGNS, tracks, draws))


def slack(coverage: float, *, trials: int = CAMPAIGNS) -> float:
    """Three standard deviations of a share that is counted over so many trials."""
    return 3.0 * float(np.sqrt(coverage * (1.0 - coverage) / trials))


@pytest.mark.parametrize(("tracks", "draws"), [(8, 5), (20, 3), (3, 10)])
@pytest.mark.parametrize("confidence", [0.95, 0.8])
def test_interval_of_the_mean_covers_as_often_as_it_says(tracks: int, draws: int, confidence: float) -> None:
    """Normal tracks and sensors; the bootstrap-t errs by the order of 1/tracks^2 beside the counting."""
    values = campaigns(tracks, draws, track_sd=1.0, sensor_sd=1.0, seed=tracks)
    counts = np.full((CAMPAIGNS, tracks), float(draws))
    _, low, high = mean_interval(values.sum(axis=2), counts, confidence=confidence)
    covered = float(np.mean((low <= 5.0) & (high >= 5.0)))
    assert covered == pytest.approx(confidence, abs=slack(confidence) + 0.5 / tracks**2)


def test_draws_that_share_a_track_are_not_counted_as_independent() -> None:
    """The fault that the clusters are for: an interval over all draws as if they were independent."""
    values = campaigns(8, 5, track_sd=1.0, sensor_sd=0.3, seed=1).reshape(CAMPAIGNS, 40)
    _, low, high = mean_interval(values, np.ones_like(values))
    assert np.mean((low <= 5.0) & (high >= 5.0)) < 0.75


def test_tracks_of_unequal_numbers_of_draws() -> None:
    """Failed cells leave gaps: the mean over all draws, and its interval, are those of the ratio."""
    tracks = 25
    counts = np.tile(np.resize([1.0, 3.0, 6.0], tracks), (CAMPAIGNS, 1))
    rng = np.random.default_rng(5)
    sums = counts * (5.0 + rng.normal(size=counts.shape)) + np.sqrt(counts) * rng.normal(size=counts.shape)
    value, low, high = mean_interval(sums, counts)
    assert value == pytest.approx(sums.sum(axis=1) / counts.sum(axis=1))
    covered = float(np.mean((low <= 5.0) & (high >= 5.0)))
    # Unequal weights: as if of (sum n)^2 / sum n^2 tracks, hence an error of a few times 1/17^2 beside.
    assert covered == pytest.approx(0.95, abs=slack(0.95) + 0.01)


def test_few_tracks_have_the_interval_of_student() -> None:
    values = np.array([1.0, 2.0, 4.0])
    found = interval(np.repeat(values, 6), np.repeat([0, 1, 2], 6))
    reach = stats.t(2).ppf(0.975) * values.std(ddof=1) / np.sqrt(3.0)
    assert (found.low, found.high) == pytest.approx((values.mean() - reach, values.mean() + reach))
    assert np.isnan(interval([3.0]).low) and interval([3.0]).value == 3.0


def test_one_track_is_resampled_by_its_draws() -> None:
    values = np.random.default_rng(8).normal(size=30)
    assert interval(values, np.zeros(30)) == interval(values)


def test_what_failed_is_left_out() -> None:
    values = np.array([1.0, np.nan, 2.0, 3.0, np.inf, 5.0, 4.0])
    assert interval(values) == interval(values[np.isfinite(values)])
    assert np.isnan(interval([np.nan]).value)
    kept, labels = clustered(values, list("aabbbcc"))
    assert kept.tolist() == [1.0, 2.0, 3.0, 5.0, 4.0] and labels.tolist() == [0, 1, 1, 2, 2]


def test_the_same_numbers_have_the_same_interval_alone_and_among_others() -> None:
    values = campaigns(12, 1, track_sd=1.0, sensor_sd=0.0, seed=2)[:50, :, 0]
    together = np.array(mean_interval(values, np.ones_like(values)))
    alone = np.array([mean_interval(row, np.ones_like(row)) for row in values])[:, :, 0].T
    assert np.allclose(together, alone, rtol=1e-12)


def test_every_resample_draws_as_many_clusters_as_there_are() -> None:
    drawn = resampled(FEWEST)
    assert drawn.shape == (RESAMPLES, FEWEST) and (drawn.sum(axis=1) == FEWEST).all()
    # Each cluster once on average: 4 sd of a mean of RESAMPLES numbers of variance 1 - 1/k.
    assert np.abs(drawn.mean(axis=0) - 1.0).max() < 4.0 * np.sqrt((1.0 - 1.0 / FEWEST) / RESAMPLES)


def test_equal_values_have_no_width() -> None:
    found = interval(np.full(20, 3.0))
    assert (found.value, found.low, found.high) == (3.0, 3.0, 3.0)


def test_shares_that_are_nearly_all_one_have_an_interval_among_shares() -> None:
    """All but one of a hundred tracks hold all the time; a third of the resamples has none but these."""
    held = 1.0 - 1e-6 * np.arange(100) / 100.0
    held[7] = 0.93
    found = interval(held)
    assert 0.9 < found.low < found.value < found.high < 1.1


def test_the_interval_of_what_is_skewed_reaches_to_the_side_of_its_tail() -> None:
    """The mean of few draws misses a rare large one more often than not: a bootstrap-t knows it."""
    skewed = np.array([0.9, 1.0, 1.1, 1.2, 1.3, 1.5, 2.0, 6.0])
    one, turned = interval(skewed), interval(-skewed)
    assert one.high - one.value > 2.0 * (one.value - one.low)
    assert (-turned.high, -turned.low) == pytest.approx((one.low, one.high), rel=1e-12)
