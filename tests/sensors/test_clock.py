"""A device's clock: samples taken at wrong times are the motion at those times; lost samples."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IMU
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.recording.sheets.grades import ImuGrade
from simrail.sensors.clock import sample_by_clock
from simrail.sensors.decimation import decimation_taps, sample_on_time, sampling_of
from simrail.sensors.imu import arrived, sample_imu

NAMED = {"seed": 3, "draw": 0, "name": "axle"}
WRONG = ImuGrade("wrong", 250.0, clock_jitter_s=1e-4, clock_drift=0.01)


def tones(seconds: float, frequency_hz: float, rate_hz: float = 1000.0) -> np.ndarray:
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    return np.sin(2.0 * np.pi * frequency_hz * t[:, None] + np.arange(6))


def streams(term: str) -> np.random.Generator:
    return stream(1, term)


@pytest.mark.parametrize(("rate", "times"), [(1000.0, 1), (500.0, 1), (250.0, 1), (100.0, 1), (250.0, 4)])
def test_samples_are_those_of_the_true_times(rate, times):
    """Against the closed form: the tone, as it leaves the filter, at the places that the clock chose."""
    frequency = 0.2 * rate
    grade = replace(WRONG, rate_hz=rate, oversampling=times)
    sampling = sampling_of(1000.0, rate, times)
    signal = tones(4.0, frequency)
    found, first, places = sample_by_clock(signal, sampling, grade, truth_rate_hz=1000.0, streams=streams)
    right, begin = sample_on_time(signal, sampling)
    # Complex gain of the filter at this frequency, by fitting what it gives at the right times.
    turn = 2j * np.pi * frequency
    waves = np.exp(turn * (begin + sampling.factor * np.arange(len(right))) / 1000.0)
    gain = np.linalg.lstsq(np.column_stack([waves.real, waves.imag]), right[:, 0], rcond=None)[0]
    expected = (gain[0] - 1j * gain[1]) * np.exp(turn * places / 1000.0)
    assert np.abs(found[:, 0] - expected.real).max() < 2e-4
    nominal = sampling.factor * (first + np.arange(len(places)))
    assert np.abs(places - nominal).max() > 5.0, "the clock is well off"


def test_a_right_clock_gives_the_right_samples():
    sampling = sampling_of(1000.0, 250.0)
    signal = tones(2.0, 20.0)
    found, first, _ = sample_by_clock(
        signal, sampling, replace(WRONG, clock_jitter_s=0.0, clock_drift=1e-12), truth_rate_hz=1000.0,
        streams=streams,
    )  # fmt: skip
    right, begin = sample_on_time(signal, sampling)
    skipped = first - begin // 4
    np.testing.assert_allclose(found, right[skipped : skipped + len(found)], atol=1e-8)
    assert 0 <= len(right) - skipped - len(found) <= 5


# Rates of devices that do not divide a truth of 1 kHz: ST, Xsens, Bosch; the last with averaging.
RATES = ((104.0, 1), (208.0, 1), (400.0, 1), (416.0, 1), (833.0, 1), (104.0, 4), (250.0, 3))


def sampled(frequency: float, rate: float, times: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and X rate of a perfect device that is shaken at a frequency."""
    index = pd.Index(np.arange(6000) / 1000.0, name="time_s")
    truth = pd.DataFrame(tones(6.0, frequency), index=index, columns=list(IMU))
    frame, _ = sample_imu(truth, ImuGrade("perfect", rate, oversampling=times), **NAMED)
    return frame.index.to_numpy(), frame.iloc[:, 0].to_numpy()


def response(frequency: float, rate: float, times: int) -> complex:
    """What the low-pass leaves of a tone, from its taps, and the mean over the internal samples."""
    taps = decimation_taps(1000.0 / (rate * times))
    turn = 2j * np.pi * frequency
    low_pass = np.sum(taps * np.exp(turn * (np.arange(len(taps)) - len(taps) // 2) / 1000.0))
    return complex(low_pass * np.mean(np.exp(-turn * np.arange(times) / (rate * times))))


@pytest.mark.parametrize(("rate", "times"), RATES)
@pytest.mark.parametrize("share", [0.01, 0.2, 0.3, 0.45, 0.57])
def test_a_tone_at_any_rate_is_that_of_the_true_times(rate, times, share):
    """In the passband and, folded back, beyond half the rate: amplitude and phase in closed form."""
    frequency = share * rate * times
    if frequency > 400.0:
        pytest.skip("the interpolator is true up to 0.4 times the rate of the truth")
    stamps, found = sampled(frequency, rate, times)
    np.testing.assert_allclose(np.diff(stamps), 1.0 / rate, atol=1e-12)
    expected = response(frequency, rate, times) * np.exp(2j * np.pi * frequency * stamps)
    assert np.abs(found - expected.imag).max() < 3e-4


@pytest.mark.parametrize("rate", [104.0, 400.0, 416.0])
def test_what_would_fold_back_is_held_off_as_at_rates_that_divide(rate):
    """Beyond 0.6 times the rate less than 0.1 % is left, of the filter's design."""
    for frequency in np.linspace(0.6 * rate, 490.0, 7):
        assert np.abs(sampled(frequency, rate)[1]).max() < 1e-3


def test_white_noise_has_its_density_at_any_rate():
    """Standard deviation N sqrt(rate), and half of its power in each half of the spectrum."""
    rate, count = 416.0, 60000
    index = pd.Index(np.arange(count * 2.5) / 1000.0, name="time_s")
    still = pd.DataFrame(0.0, index=index, columns=list(IMU))
    grade = ImuGrade("noisy", rate, gyro_noise_radpsqrts=0.01)
    values = sample_imu(still, grade, **NAMED)[0].iloc[:, :3].to_numpy()
    # A variance of n values scatters by sqrt(2 / n), relative: five of those, in 3 n values.
    slack = 5.0 * np.sqrt(2.0 / values.size)
    assert values.var() == pytest.approx(0.01**2 * rate, rel=slack)
    power = np.abs(np.fft.rfft(values, axis=0)[1:-1]) ** 2
    low, high = np.array_split(power, 2)
    assert low.mean() / high.mean() == pytest.approx(1.0, abs=2.0 * slack)


def test_stamps_at_any_rate_are_whole_intervals_and_a_longer_ride_begins_alike():
    index = pd.Index(np.arange(6000) / 1000.0, name="time_s")
    truth = pd.DataFrame(tones(6.0, 7.0), index=index, columns=list(IMU))
    grade = ImuGrade("odd", 416.0, gyro_noise_radpsqrts=0.01, clock_drift=1e-4, clock_jitter_s=1e-5)
    longer, _ = sample_imu(truth, grade, **NAMED)
    shorter, _ = sample_imu(truth.iloc[:4000], grade, **NAMED)
    number = longer.index.to_numpy() * 416.0
    np.testing.assert_allclose(number, np.rint(number), atol=1e-9)
    pd.testing.assert_frame_equal(longer.iloc[: len(shorter)], shorter, check_exact=True)
    assert longer.index[-1] > 5.9 and shorter.index[-1] > 3.9


@pytest.mark.parametrize(
    ("rate", "times", "words"),
    [
        (1667.0, 1, "truth_rate_hz = 2000"),
        (1001.0, 1, "truth_rate_hz = 2000"),
        (416.0, 8, "truth_rate_hz = 4000"),
        (8000.0, 1, "up to 4000 Hz"),
    ],
)
def test_a_rate_above_the_truth_is_refused_with_the_remedy(rate, times, words):
    with pytest.raises(InputError, match="above the rate of the truth") as caught:
        sampling_of(1000.0, rate, times)
    assert words in str(caught.value)


def test_stamps_are_the_nominal_ones_and_a_longer_ride_begins_alike():
    index = pd.Index(np.arange(8000) / 1000.0, name="time_s")
    truth = pd.DataFrame(tones(8.0, 7.0), index=index, columns=list(IMU))
    longer, _ = sample_imu(truth, WRONG, **NAMED)
    shorter, _ = sample_imu(truth.iloc[:5000], WRONG, **NAMED)
    assert set(longer.index) <= set(truth.index)
    np.testing.assert_allclose(np.diff(longer.index), 0.004, atol=1e-12)
    pd.testing.assert_frame_equal(longer.iloc[: len(shorter)], shorter, check_exact=True)


def test_too_short_a_ride_is_refused():
    with pytest.raises(InputError, match="too short"):
        sample_by_clock(
            tones(0.05, 7.0), sampling_of(1000.0, 250.0), WRONG, truth_rate_hz=1000.0, streams=streams
        )


def test_a_longer_ride_loses_the_same_samples():
    grade = ImuGrade("lossy", 1000.0, dropped_fraction=0.2, dropped_burst=3.0)

    def came(count: int) -> pd.DataFrame:
        index = pd.Index(np.arange(count) / 1000.0, name="time_s")
        return arrived(pd.DataFrame(0.0, index=index, columns=list(IMU)), grade, **NAMED)

    short, long = came(500), came(900)
    assert list(short.index[:-2]) == [t for t in long.index if t <= short.index[-3]]
