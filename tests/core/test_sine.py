"""Sine and cosine in plain arithmetic against numpy's."""

import numpy as np
import pytest

from simrail.core.jit import njit
from simrail.core.sine import sine_cosine


@njit
def both(angle: np.ndarray, sine: np.ndarray, cosine: np.ndarray) -> None:
    for i in range(len(angle)):
        sine[i], cosine[i] = sine_cosine(angle[i])


@pytest.mark.parametrize("largest", [1e-300, 1e-3, 1.0, 7.0, 1e4])
def test_sine_and_cosine_are_numpys_to_rounding(largest: float) -> None:
    quarters = np.arange(-8, 9) * (0.25 * np.pi)
    edges = np.concatenate([quarters, np.nextafter(quarters, 9.0), np.nextafter(quarters, -9.0)])
    angle = np.concatenate([np.linspace(-largest, largest, 20001), edges[np.abs(edges) <= largest]])
    sine, cosine = np.empty_like(angle), np.empty_like(angle)
    both(angle, sine, cosine)
    # Two units in the last place of numbers up to one, and of the small ones their own.
    assert np.abs(sine - np.sin(angle)).max() <= 2.0 * 2.0**-53
    assert np.abs(cosine - np.cos(angle)).max() <= 2.0 * 2.0**-53
    small = np.abs(angle) < 0.7
    np.testing.assert_allclose(sine[small], np.sin(angle[small]), rtol=4e-16, atol=0)


def test_what_is_no_number_stays_so() -> None:
    sine, cosine = np.empty(2), np.empty(2)
    both(np.array([np.nan, np.inf]), sine, cosine)
    assert np.isnan(sine).all() and np.isnan(cosine).all()
