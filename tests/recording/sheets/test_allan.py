"""Allan deviations against allantools and closed forms."""

import allantools
import numpy as np
import pytest

from simrail.recording.sheets.allan import (
    FLICKER_FLOOR,
    flicker_stages,
    gauss_markov_allan,
    overlapping_allan,
)


def test_own_overlapping_allan_deviation_is_that_of_allantools():
    series = np.cumsum(np.random.default_rng(1).standard_normal(5000)) + 3.0
    taus = [0.01, 0.07, 1.0, 12.0]
    found, deviation, _, _ = allantools.oadev(series, rate=100.0, data_type="freq", taus=taus)
    np.testing.assert_allclose(found, taus, rtol=1e-9)
    np.testing.assert_allclose(overlapping_allan(series, 100.0, np.array(taus)), deviation, rtol=1e-9)


@pytest.mark.parametrize("span", ((0.1, 1.0), (1.0, 1000.0), (1.0, 36_000.0), (100.0, 200.0)))
def test_flicker_stages_are_flat_over_their_range_by_the_closed_form(span):
    correlation, sd = flicker_stages(2.0, span)
    tau = np.geomspace(*span, 200)
    variance = sum(
        gauss_markov_allan(tau, sd=s, correlation_s=t) ** 2 for t, s in zip(correlation, sd, strict=True)
    )
    assert np.abs(np.sqrt(variance) / (2.0 * FLICKER_FLOOR) - 1.0).max() < 0.02
    assert np.max(correlation[1:] / correlation[:-1]) <= 8.0 * (1.0 + 1e-9)
