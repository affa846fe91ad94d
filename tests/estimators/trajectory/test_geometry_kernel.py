"""Loops of the rails' geometry against scipy's and numpy's, which say the same at length."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from simrail.estimators.trajectory.geometry_kernel import on_spline, spline_slopes, thinned


@pytest.mark.parametrize("count", [4, 5, 300])
def test_spline_is_scipys(count: int) -> None:
    """To rounding: the equations' condition is that of the distances of the knots, here within a hundred."""
    rng = np.random.default_rng(count)
    at, values = np.cumsum(rng.uniform(0.01, 1.0, count)), rng.standard_normal((count, 4))
    places = np.sort(np.concatenate([at, np.linspace(at[0] - 1.0, at[-1] + 1.0, 999)]))
    slopes, found = np.empty_like(values), np.empty((len(places), 4))
    spline_slopes(at, values, np.empty(count), slopes)
    on_spline(at, values, slopes, places, found)
    theirs = CubicSpline(at, values)
    np.testing.assert_allclose(slopes, theirs(at, 1), rtol=0, atol=1e-11 * np.abs(theirs(at, 1)).max())
    expected = theirs(np.clip(places, at[0], at[-1]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("is_odd", [True, False])
@pytest.mark.parametrize("length", [9, 33, 161])
def test_low_pass_is_a_convolution_with_what_is_turned_or_mirrored_at_the_ends(
    is_odd: bool, length: int
) -> None:
    rng = np.random.default_rng(length)
    half = rng.standard_normal(13)
    line, taps = rng.standard_normal((length, 4)), np.concatenate([half[::-1], half[1:]])
    found = np.empty(((length - 1) // 4 + 1, 4))
    thinned(line, taps, 4, is_odd, found)
    kind = {"reflect_type": "odd" if is_odd else "even"}
    padded = np.pad(line, ((12, 12), (0, 0)), mode="reflect", **kind)
    whole = np.array([np.convolve(column, taps, mode="valid") for column in padded.T]).T
    # Of 25 products of numbers up to some tens, where a short line is turned more than once.
    np.testing.assert_allclose(found, whole[::4], rtol=0, atol=1e-13 * 25 * np.abs(padded).max())
