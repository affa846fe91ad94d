"""Ride comfort against the printed tables of ISO 8041-1, closed forms of sines, and other algebra.

The factors of ISO 8041-1:2017, Tables B.1 and B.3, stand in the public tests of the package phonometry
(github, file tests/reference_data/vibration.py), transcribed there from the standard.
"""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.scoring.ride_comfort import (
    W_B,
    W_B_ISO_8041,
    W_D,
    mean_comfort,
    period_rms,
    sperling,
    sperling_weighting,
    weighted,
)

THIRD_OCTAVES_HZ = 10.0 ** (np.arange(-10, 27) / 10.0)
TABLE_B1 = [
    *(
        0.02494,
        0.03941,
        0.06198,
        0.09645,
        0.1464,
        0.2113,
        0.28,
        0.3347,
        0.3666,
        0.3808,
        0.3853,
        0.3864,
        0.3916,
    ),
    *(
        0.4168,
        0.496,
        0.6653,
        0.885,
        1.026,
        1.054,
        1.026,
        0.9745,
        0.9042,
        0.8144,
        0.7088,
        0.5973,
        0.4906,
        0.395,
    ),
    *(0.3118, 0.2389, 0.1734, 0.1154, 0.06929, 0.03818, 0.01999, 0.0102, 0.005154, 0.002591),
]
TABLE_B3 = [
    *(0.06242, 0.09867, 0.1553, 0.242, 0.3682, 0.533, 0.7097, 0.854, 0.9443, 0.9914, 1.011, 1.007, 0.9707),
    *(
        0.8913,
        0.7733,
        0.6398,
        0.5143,
        0.4081,
        0.3226,
        0.255,
        0.2017,
        0.1597,
        0.1266,
        0.1004,
        0.07958,
        0.06299,
    ),
    *(
        0.04965,
        0.03872,
        0.02946,
        0.0213,
        0.01414,
        0.008478,
        0.004668,
        0.002442,
        0.001246,
        0.0006293,
        0.0003164,
    ),
]
RATE_HZ = 1000.0


@pytest.mark.parametrize(("weighting", "table"), [(W_B_ISO_8041, TABLE_B1), (W_D, TABLE_B3)])
def test_a_weighting_has_the_factors_that_the_standard_prints(weighting, table):
    # Four printed figures are right to half a unit of the fourth: 0.05 %.
    np.testing.assert_allclose(np.abs(weighting.response(THIRD_OCTAVES_HZ)), table, rtol=5.1e-4)


def test_the_w_b_of_en_12299_is_the_product_of_its_polynomials():
    """Poles and zeros of comfpy and pyridy, multiplied out: W_b of trains, not of ISO."""
    w1, w2, w4, w5, w6 = 2.0 * np.pi * np.array([0.4, 100.0, 16.0, 2.5, 4.0])
    root = np.sqrt(0.5)
    above = [0.4 / w5**2, 0.4 / (0.8 * w5), 0.4]
    above = np.polymul(np.polymul([1.0, 0.0, 0.0], [w2**2]), np.polymul([w4, w4**2], above))
    below = np.polymul([1.0, w1 / root, w1**2], [1.0, w2 / root, w2**2])
    below = np.polymul(below, [1.0, w4 / 0.63, w4**2])
    below = np.polymul(below, [1.0 / w6**2, 1.0 / (0.8 * w6), 1.0])
    s = 2j * np.pi * THIRD_OCTAVES_HZ
    expected = np.polyval(above, s) / np.polyval(below, s)
    np.testing.assert_allclose(W_B.response(THIRD_OCTAVES_HZ), expected, rtol=1e-9)
    difference = np.abs(W_B.response(THIRD_OCTAVES_HZ)) / TABLE_B1 - 1.0
    assert 0.12 < difference.max() < 0.14


def sine(frequency_hz, amplitude_mps2, seconds=60.0):
    """A sine, whole periods of it in every 5 s if the frequency is a multiple of 0.2 Hz."""
    return amplitude_mps2 * np.sin(2.0 * np.pi * frequency_hz * np.arange(0.0, seconds, 1.0 / RATE_HZ))


@pytest.mark.parametrize("frequency_hz", [1.0, 6.4, 20.0, 60.0])
def test_a_weighted_sine_has_the_rms_of_the_response(frequency_hz):
    rms = period_rms(weighted(sine(frequency_hz, 2.0), RATE_HZ, W_B), RATE_HZ)
    gain = abs(W_B.response(np.array([frequency_hz]))[0])
    # From the second period on the filter has settled: at 0.4 Hz and a damping of 0.7, exp(-1.8 . 5) = 1e-4.
    np.testing.assert_allclose(rms[1:], 2.0 / np.sqrt(2.0) * gain, rtol=2e-4)


def test_weighting_does_not_care_for_gravity_nor_for_the_end_of_the_record():
    flat = weighted(np.full(10_000, 9.81), RATE_HZ, W_B)
    assert np.abs(flat).max() < 1e-12
    late = np.concatenate([np.zeros(10_000), np.linspace(0.0, 10.0, 10_000)])
    assert np.abs(weighted(late, RATE_HZ, W_D)[:9_000]).max() < 1e-4
    long, short = sine(3.0, 1.0, 40.0), sine(3.0, 1.0, 20.0)
    np.testing.assert_allclose(
        weighted(long, RATE_HZ, W_D)[: len(short)], weighted(short, RATE_HZ, W_D), atol=2e-6
    )


def test_mean_comfort_of_three_sines():
    acceleration = np.column_stack([sine(1.0, 0.2), sine(2.0, 0.4), sine(8.0, 0.3)])
    result = mean_comfort(acceleration, RATE_HZ, counts=np.ones(len(acceleration), dtype=bool))
    gains = [abs(W_D.response(np.array([f]))[0]) for f in (1.0, 2.0)] + [
        abs(W_B.response(np.array([8.0]))[0])
    ]
    axes = np.array([0.2, 0.4, 0.3]) * gains / np.sqrt(2.0)
    # The first period rings; of twelve it shifts the 95th percentile by at most its own excess.
    np.testing.assert_allclose([result.a_x_mps2, result.a_y_mps2, result.a_z_mps2], axes, rtol=5e-3)
    assert result.n_mv == pytest.approx(6.0 * np.sqrt(np.sum(axes**2)), rel=5e-3)
    assert result.periods == 12


def test_the_95th_percentile_is_that_of_the_periods():
    """Twenty-one periods that rise evenly: the 95th percentile is the last but one, by its definition."""
    level = np.repeat(np.arange(1.0, 22.0), 5000)
    wave = level * np.sin(2.0 * np.pi * 10.0 * np.arange(len(level)) / RATE_HZ)
    still = np.zeros_like(wave)
    result = mean_comfort(np.column_stack([still, still, wave]), RATE_HZ, counts=np.ones(len(wave), bool))
    gain = abs(W_B.response(np.array([10.0]))[0])
    assert result.a_z_mps2 == pytest.approx(20.0 * gain / np.sqrt(2.0), rel=5e-3)
    assert result.a_x_mps2 == 0.0


def test_only_periods_count_in_which_the_vehicle_runs():
    wave = np.concatenate([sine(5.0, 1.0, 20.0), sine(5.0, 3.0, 20.0)])
    runs = np.arange(len(wave)) >= 20_000
    acceleration = np.column_stack([wave, wave, wave])
    assert mean_comfort(acceleration, RATE_HZ, counts=runs).periods == 4
    # It begins to run in the middle of a period.
    assert mean_comfort(acceleration, RATE_HZ, counts=np.arange(len(wave)) >= 22_000).periods == 3
    with pytest.raises(InputError, match="does not run for one period"):
        mean_comfort(acceleration, RATE_HZ, counts=np.zeros(len(wave), dtype=bool))


@pytest.mark.parametrize("direction", ["vertical", "lateral"])
@pytest.mark.parametrize(("frequency_hz", "amplitude_mps2"), [(1.0, 0.5), (5.0, 1.0), (12.0, 0.2)])
def test_wz_of_a_sine_is_its_older_form_in_cm(direction, frequency_hz, amplitude_mps2):
    """Wz = (A^2 B^2)^(1/6.67), A in cm/s2: the printed exponent and 4.42 are rounded, to 0.2 % together."""
    weight = float(sperling_weighting(np.array([frequency_hz]), direction)[0])
    older = ((100.0 * amplitude_mps2) ** 2 * weight**2) ** (1.0 / 6.67)
    assert sperling(sine(frequency_hz, amplitude_mps2), RATE_HZ, direction) == pytest.approx(older, rel=2e-3)


def test_sperling_weights_as_two_public_programs_do():
    """At 5 Hz, worked by hand from the printed formula; both directions differ by a factor of 1.25."""
    # 1.911 . 25 + (0.25 . 25)^2 = 86.8375; (1 - 6.925)^2 + 25 (1.563 - 0.92)^2 = 45.4418
    vertical = sperling_weighting(np.array([5.0]), "vertical")[0]
    assert vertical == pytest.approx(0.588 * np.sqrt(86.8375 / 45.44185), rel=1e-6)
    assert sperling_weighting(np.array([5.0]), "lateral")[0] / vertical == pytest.approx(1.25, abs=4e-3)


def test_wz_of_two_sines_adds_their_squares():
    wave = sine(2.0, 0.5) + sine(7.0, 0.3)
    parts = [sperling(sine(2.0, 0.5), RATE_HZ, "vertical"), sperling(sine(7.0, 0.3), RATE_HZ, "vertical")]
    together = sum(one ** (1.0 / 0.15) for one in parts) ** 0.15
    assert sperling(wave, RATE_HZ, "vertical") == pytest.approx(together, rel=1e-9)
    assert sperling(sine(0.2, 5.0), RATE_HZ, "lateral") < 0.01


@pytest.mark.parametrize("of", [lambda a: weighted(a, 100.0, W_D), lambda a: sperling(a, 100.0, "lateral")])
def test_too_low_a_rate_is_refused(of):
    with pytest.raises(InputError, match=r"truth_rate_hz.*found 100.0; limit: 200 Hz; remedy"):
        of(np.zeros(1000))
