"""Octaves add up to the line; variances and weights of passes by closed forms."""

import numpy as np
import pytest
from simrail.estimators.rails.octaves import octaves_of
from simrail.estimators.rails.weighing import LEAST_SHARE, fit, weigh

STEP_M, COUNT = 0.25, 6000


def test_octaves_add_up_to_the_line() -> None:
    line = np.cumsum(np.random.default_rng(1).standard_normal(COUNT))
    parts = octaves_of(COUNT, STEP_M).cut(line)
    assert np.abs(parts.sum(axis=0) - line).max() < 1e-9 * np.abs(line).max()


def test_a_sine_is_in_the_octave_of_its_wavelength() -> None:
    bank = octaves_of(COUNT, STEP_M)
    place = STEP_M * np.arange(COUNT)
    inner = slice(1000, -1000)
    for at, wavelength in enumerate(bank.wavelengths_m[1:-1], start=1):
        parts = bank.cut(np.sin(2.0 * np.pi * place / wavelength))[:, inner]
        assert np.abs(parts[at]).max() == pytest.approx(1.0, abs=0.02)
        assert np.abs(np.delete(parts, at, axis=0)).max() < 0.05


def test_the_variance_of_a_line_comes_back_from_its_octaves() -> None:
    """White noise of variance 1: density 2 steps, and the sum of the density is the variance."""
    bank = octaves_of(COUNT, STEP_M)
    line = np.random.default_rng(2).standard_normal((20, COUNT))
    variance = np.square(bank.cut(line)).mean(axis=(1, 2))
    assert bank.total(variance) == pytest.approx(1.0, rel=0.03)
    # Turned about its ends a white line has a step there, which long waves show.
    density = bank.density(variance)[bank.frequencies_1pm > 0.1]
    assert density == pytest.approx(2.0 * STEP_M, rel=0.1)


def test_a_gain_between_two_waves_passes_what_lies_between() -> None:
    bank = octaves_of(COUNT, STEP_M)
    place, gain = STEP_M * np.arange(COUNT), bank.between((3.0, 25.0))
    for wavelength, passes in ((1.5, 0.0), (4.5, 1.0), (16.0, 1.0), (50.0, 0.0)):
        wave = bank.passed(np.sin(2.0 * np.pi * place / wavelength), gain)[1000:-1000]
        assert np.abs(wave).max() == pytest.approx(passes, abs=0.02)


def test_variances_of_unlike_passes_are_found() -> None:
    """Errors of sd 1, 1, 2 and 3: what passes differ by gives each its own, and weights as 1/variance."""
    rng = np.random.default_rng(3)
    bank = octaves_of(COUNT, STEP_M)
    planted = np.array([1.0, 1.0, 2.0, 3.0])
    truth = 5.0 * rng.standard_normal(COUNT)
    weighed = weigh(bank.cut(truth + planted[:, None] * rng.standard_normal((4, COUNT))), bank, np.ones(4))
    white = bank.bandwidths_1pm * 2.0 * STEP_M
    short = bank.wavelengths_m < 8.0  # some hundred degrees of freedom and more
    found = (weighed.own / white[:, None])[short]
    # The least share of the typical variance, 2.5, holds the two best; the others within their statistics.
    assert found[:, 2] == pytest.approx(4.0, rel=0.25)
    assert found[:, 3] == pytest.approx(9.0, rel=0.25)
    assert (found[:, :2] > 0.6).all() and (found[:, :2] < 1.6).all()
    assert weighed.weight.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert (weighed.weight[short, 0] > 2.5 * weighed.weight[short, 3]).all()


def test_two_passes_share_what_they_differ_by_as_they_state_it() -> None:
    rng = np.random.default_rng(4)
    bank = octaves_of(COUNT, STEP_M)
    weighed = weigh(bank.cut(rng.standard_normal((2, COUNT))), bank, np.array([3.0, 1.0]))
    assert weighed.own[:, 0] / weighed.own[:, 1] == pytest.approx(3.0)
    assert weighed.weight[:, 0] == pytest.approx(0.25)
    white = bank.bandwidths_1pm * 2.0 * STEP_M
    assert (weighed.own.mean(axis=1) / white)[:4] == pytest.approx(1.0, rel=0.15)


def test_agreement_of_a_few_does_not_outweigh_the_others() -> None:
    """Two of six passes with the same error agree perfectly; neither is trusted beyond the least share."""
    rng = np.random.default_rng(5)
    bank = octaves_of(COUNT, STEP_M)
    lines = rng.standard_normal((6, COUNT))
    lines[1] = lines[0]
    weighed = weigh(bank.cut(lines), bank, np.ones(6))
    assert (weighed.weight[:4, :2] <= 1.0 / LEAST_SHARE / 6.0 + 0.05).all()


def test_a_pass_that_fits_has_its_whole_weight() -> None:
    lines = np.random.default_rng(6).standard_normal((4, COUNT))
    assert (fit(lines, STEP_M) == 1.0).all()
    lines[2, 2000:3000] *= 8.0
    fits = fit(lines, STEP_M)
    assert fits[2, 2500] < 0.1 and (fits[[0, 1, 3]] == 1.0).all()
    assert (fit(lines[:2], STEP_M) == 1.0).all()
