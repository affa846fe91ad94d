"""The decimation filter against pure tones, polynomials and its own ends."""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.sensors.decimation import (
    decimation_factor,
    decimation_taps,
    sample_on_time,
    sampling_of,
    second_order,
)

FACTORS = (2, 4, 10, 40)


def decimate(samples, factor):
    """Low-pass and take every `factor`-th sample: the output, and which sample the first one stands for."""
    return sample_on_time(samples, sampling_of(float(factor), 1.0))


def gain(factor: int, frequency: float) -> complex:
    """Complex amplitude left of exp(i 2 pi f t), f in output rates, by sampling one and fitting it."""
    taps = decimation_taps(factor)
    count = len(taps) + 200 * factor
    wave = np.exp(2j * np.pi * frequency * np.arange(count) / factor)
    both = np.column_stack([wave.real, wave.imag])
    output, delay = decimate(both, factor)
    expected = wave[delay::factor][: len(output)]
    return complex(np.vdot(expected, output[:, 0] + 1j * output[:, 1]) / len(expected))


@pytest.mark.parametrize("factor", FACTORS)
def test_tones_beyond_the_stop_edge_leave_less_than_one_percent(factor):
    nyquist = 0.5 * factor
    for frequency in (0.6, 0.7, 0.75, 1.0, 0.9 * nyquist, nyquist):
        if 0.6 <= frequency <= nyquist:
            wave = np.cos(2.0 * np.pi * frequency * np.arange(400 * factor) / factor + 0.3)
            output, _ = decimate(wave[:, None], factor)
            assert np.abs(output).max() < 0.01, frequency


@pytest.mark.parametrize("factor", FACTORS)
def test_passband_is_flat_with_exactly_no_phase(factor):
    for frequency in (0.0, 0.01, 0.1, 0.2, 0.25, 0.3):
        found = gain(factor, frequency)
        assert abs(found) == pytest.approx(1.0, abs=2e-3)
        assert np.angle(found) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("factor", (1, *FACTORS))
def test_constants_and_ramps_stay_put_from_the_first_to_the_last_sample(factor):
    t = np.arange(300 * factor, dtype=np.float64)
    output, delay = decimate(np.column_stack([np.full_like(t, 9.81), 3.0 + 0.1 * t]), factor)
    at = delay + factor * np.arange(len(output))
    np.testing.assert_allclose(output[:, 0], 9.81, rtol=1e-13)
    np.testing.assert_allclose(output[:, 1], 3.0 + 0.1 * at, rtol=1e-12)


def test_chirp_in_the_passband_stays_put():
    t = np.arange(40_000) / 1000.0
    chirp = np.sin(2.0 * np.pi * (0.5 * (62.5 / t[-1]) * t) * t)
    output, delay = decimate(chirp[:, None], 4)
    at = delay + 4 * np.arange(len(output))
    # One sample of time error would leave 2 pi 62.5 / 1000 = 0.39 at the end of the chirp.
    assert np.abs(output[:, 0] - chirp[at]).max() < 3e-3


@pytest.mark.parametrize("factor", FACTORS)
def test_no_sample_is_made_up_at_the_ends(factor):
    rng = np.random.default_rng(1)
    longer = rng.standard_normal((500 * factor, 3))
    begin, end = 30 * factor, 400 * factor
    part, delay = decimate(longer[begin:end], factor)
    whole, _ = decimate(longer, factor)
    np.testing.assert_allclose(part, whole[begin // factor :][: len(part)], rtol=0, atol=1e-13)
    last = begin + delay + factor * (len(part) - 1)
    assert end - 1 - delay - factor < last <= end - 1 - delay, "every complete output sample is there"


def test_output_is_the_plain_sum_over_the_taps():
    rng = np.random.default_rng(2)
    samples = rng.standard_normal((400, 2))
    taps = decimation_taps(4)
    output, delay = decimate(samples, 4)
    by_hand = [taps @ samples[k - delay : k + delay + 1] for k in range(delay, 400 - delay, 4)]
    np.testing.assert_allclose(output, by_hand, atol=1e-13)


def test_factor_one_changes_nothing():
    samples = np.arange(12.0).reshape(4, 3)
    output, delay = decimate(samples, 1)
    assert delay == 0
    np.testing.assert_array_equal(output, samples)
    assert output is not samples


@pytest.mark.parametrize(("truth", "rate"), [(1000.0, 300.0), (1000.0, 2000.0), (1000.0, 333.0)])
def test_rates_that_do_not_divide_are_refused(truth, rate):
    with pytest.raises(InputError, match="does not divide"):
        decimation_factor(truth, rate)


def test_too_short_a_ride_is_refused():
    with pytest.raises(InputError, match="too short"):
        decimate(np.zeros((len(decimation_taps(4)) - 1, 6)), 4)
    output, _ = decimate(np.zeros((len(decimation_taps(4)), 6)), 4)
    assert len(output) == 1


def test_device_response_has_its_bandwidth_and_starts_settled():
    t = np.arange(20_000) / 1000.0
    tone = np.cos(2.0 * np.pi * 50.0 * t)
    samples = np.column_stack([np.full_like(t, 9.81), tone])
    output = second_order(samples, bandwidth_hz=50.0, rate_hz=1000.0)
    np.testing.assert_allclose(output[:, 0], 9.81, rtol=1e-12)
    assert np.sqrt(2.0 * np.mean(output[5000:, 1] ** 2)) == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-3)
    ramp = second_order(t[:, None], bandwidth_hz=50.0, rate_hz=1000.0)
    assert t[-1] - ramp[-1, 0] == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * 50.0), rel=0.02)
    with pytest.raises(InputError, match="bandwidth"):
        second_order(samples, bandwidth_hz=500.0, rate_hz=1000.0)


@pytest.mark.parametrize(("factor", "times"), [(4, 2), (4, 4), (8, 2), (10, 5), (6, 3)])
def test_averaging_is_the_plain_mean_of_internal_samples(factor, times):
    rng = np.random.default_rng(4)
    samples = rng.standard_normal((60 * factor, 2))
    sampling = sampling_of(1000.0, 1000.0 / factor, times)
    output, first = sample_on_time(samples, sampling)
    assert first % factor == 0
    inner = factor // times
    fast, delay = decimate(samples, inner)
    for k in range(len(output)):
        last = (first + k * factor - delay) // inner
        by_hand = fast[last - times + 1 : last + 1].mean(axis=0)
        np.testing.assert_allclose(output[k], by_hand, atol=1e-13)
    # Every sample that is complete is there, and no other.
    end = first + len(output) * factor + sampling.delay
    assert len(samples) - 1 < end
