"""The smooth of responses and its band, against what they are of lines and of noise."""

import numpy as np

from simrail.report.figures.responses import independent_rows, smooth


def test_a_straight_line_is_its_own_smooth() -> None:
    x = np.random.default_rng(1).uniform(size=50)
    at = np.linspace(0.0, 1.0, 11)
    mean, half = smooth(x, 3.0 - 2.0 * x, at)
    np.testing.assert_allclose(mean, 3.0 - 2.0 * at, atol=1e-12)
    np.testing.assert_allclose(half, 0.0, atol=1e-12)


def test_the_band_holds_the_mean_in_95_of_100() -> None:
    """Of a line in noise, at the middle: 300 seeds; a binomial interval at 99.9 % and the residuals' loss."""
    inside = 0
    for seed in range(300):
        generator = np.random.default_rng(seed)
        x = generator.uniform(size=120)
        mean, half = smooth(x, x + generator.standard_normal(120) * (0.5 + x), np.array([0.5]))
        inside += int(abs(mean[0] - 0.5) < half[0])
    assert 0.89 * 300 < inside < 0.99 * 300


def test_of_saltelli_two_points_of_each_block_are_independent() -> None:
    assert np.flatnonzero(independent_rows("saltelli", 3, 10)).tolist() == [0, 4, 5, 9]
    assert independent_rows("morris", 3, 8).all()
