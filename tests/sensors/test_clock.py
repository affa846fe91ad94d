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
from simrail.sensors.decimation import sample_on_time, sampling_of
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
    nominal = first + sampling.factor * np.arange(len(places))
    assert np.abs(places - nominal).max() > 5.0, "the clock is well off"


def test_a_right_clock_gives_the_right_samples():
    sampling = sampling_of(1000.0, 250.0)
    signal = tones(2.0, 20.0)
    found, first, _ = sample_by_clock(
        signal, sampling, replace(WRONG, clock_jitter_s=0.0, clock_drift=1e-12), truth_rate_hz=1000.0,
        streams=streams,
    )  # fmt: skip
    right, begin = sample_on_time(signal, sampling)
    skipped = (first - begin) // 4
    np.testing.assert_allclose(found, right[skipped : skipped + len(found)], atol=1e-8)
    assert 0 <= len(right) - skipped - len(found) <= 5


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
