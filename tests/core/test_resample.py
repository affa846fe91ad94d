"""Irregular stamps become a uniform grid; gaps are reported, or refused, never hidden."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.core.resample import GAPS, find_gaps, rate_of, refuse_long_gaps, resample, uniform_times
from simrail.core.toml_files import blame

RATE = 100.0


def signals(stamps: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(
        {"a": 3.0 - 2.0 * stamps, "b": np.sin(2.0 * np.pi * 0.7 * stamps)},
        index=pd.Index(stamps, name="time_s"),
    )


def jittering(count: int, seed: int, *, drift: float = 0.0) -> np.ndarray:
    """Stamps of a clock that runs fast by `drift`, each late by up to 40 % of an interval."""
    late = np.random.default_rng(seed).uniform(0.0, 0.4, count)
    return 5.0 + (np.arange(count) + late) / RATE * (1.0 + drift)


def test_jitter_and_drift_are_interpolated_away():
    stamps = jittering(2000, 1, drift=1e-3)
    times = uniform_times(stamps[0], stamps[-1], RATE)
    found, gaps = resample(signals(stamps), times)
    assert len(gaps) == 0 and tuple(gaps.columns) == GAPS
    assert found.index.name == "time_s"
    np.testing.assert_array_equal(found.index, times)
    # A straight line is exact; of a sine a chord over h keeps within h^2/8 times its second derivative.
    np.testing.assert_allclose(found["a"], 3.0 - 2.0 * times, rtol=0.0, atol=1e-12)
    longest = np.diff(stamps).max()
    bound = longest**2 / 8.0 * (2.0 * np.pi * 0.7) ** 2
    error = np.abs(found["b"] - np.sin(2.0 * np.pi * 0.7 * times)).max()
    assert 0.2 * bound < error <= bound


def test_stamps_on_the_grid_keep_their_samples_bit_by_bit():
    times = 0.028 + np.arange(500) / 250.0
    kept = np.ones(500, dtype=bool)
    kept[[100, 101, 300]] = False
    frame = signals(times[kept])
    found, gaps = resample(frame, times)
    assert found[kept].to_numpy().tobytes() == frame.to_numpy().tobytes()
    assert gaps["missing"].tolist() == [2, 1] and gaps["missing"].dtype == np.int64
    assert gaps["start_s"].tolist() == [times[99], times[299]]
    assert gaps["end_s"].tolist() == [times[102], times[301]]
    # Within a gap the signal stays between its neighbours: no overshoot.
    low, high = np.sort(frame["b"].to_numpy()[[99, 100]])
    assert ((found["b"].iloc[100:102] >= low) & (found["b"].iloc[100:102] <= high)).all()


def test_gaps_up_to_the_limit_are_bridged_and_longer_ones_refused():
    stamps = np.arange(1000) / RATE
    ten = np.delete(stamps, slice(400, 410))  # 0.11 s between neighbours
    times = uniform_times(0.0, 9.99, RATE)
    found, gaps = resample(signals(ten), times, longest_gap_s=0.11)
    assert gaps["missing"].tolist() == [10] and len(found) == 1000
    with pytest.raises(InputError) as caught, blame("imu.csv"):
        resample(signals(ten), times, longest_gap_s=0.1)
    message = str(caught.value)
    for words in (
        "imu.csv: imu.time_s",
        "gap of 10 samples",
        "0.11 s after",
        "3.99",
        "longest_gap_s = 0.1 s",
    ):
        assert words in message, message


def test_of_several_long_gaps_the_first_is_named_and_the_others_counted():
    gaps = pd.DataFrame(
        {"start_s": [1.0, 5.0, 8.0, 20.0], "end_s": [1.5, 7.0, 11.0, 24.0], "missing": [4, 19, 29, 39]}
    )
    with pytest.raises(InputError) as caught:
        refuse_long_gaps(gaps, 1.0, what="odometer.speed")
    said = str(caught.value)
    for words in (
        "gap of 19 samples",
        "(and 2 more such gaps)",
        "2 s after time_s = 5",
        "raise odometer.longest",
    ):
        assert words in said
    with pytest.raises(InputError) as caught:
        refuse_long_gaps(gaps.iloc[[1]], 1.0)
    assert "more such" not in str(caught.value)
    refuse_long_gaps(gaps, 4.0)


def test_what_counts_as_a_gap_is_stated():
    stamps = np.array([0.0, 1.0, 2.4, 4.0, 5.0])
    assert find_gaps(stamps, 1.0)["missing"].tolist() == [1]
    assert find_gaps(stamps, 1.0, gap_intervals=1.3)["missing"].tolist() == [1, 1]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda t: t.__setitem__(7, t[6]), "duplicate"),
        (lambda t: t.__setitem__(7, t[5]), "reversed"),
        (lambda t: t.__setitem__(7, np.nan), "NaN"),
    ],
)
def test_bad_stamps_are_refused(change, word):
    stamps = np.arange(100) / RATE
    change(stamps)
    with pytest.raises(InputError, match=word):
        resample(signals(stamps), uniform_times(0.1, 0.9, RATE))


def test_nothing_is_extrapolated_and_no_value_made_up():
    frame = signals(np.arange(100) / RATE)
    for first, last in ((-0.01, 0.5), (0.0, 1.0)):
        with pytest.raises(InputError, match="extrapolated"):
            resample(frame, uniform_times(first, last, RATE))
    frame.iloc[40, 1] = np.nan
    with pytest.raises(InputError, match=r"imu\.b: is not a finite number at time_s = 0\.4"):
        resample(frame, uniform_times(0.0, 0.99, RATE))


@pytest.mark.parametrize("rate", [99.97, 250.0, 300.0])
def test_rate_of_stamps_in_whole_milliseconds_with_gaps(rate):
    kept = np.delete(np.arange(5000), [*range(700, 703), 2000, *range(4000, 4009)])
    stamps = np.round(kept / rate, 3)
    # Each end is rounded by up to half a millisecond.
    assert rate_of(stamps) == pytest.approx(rate, rel=0.001 / stamps[-1])


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 1000), lost=st.sets(st.integers(1, 198), max_size=60))
def test_every_lost_sample_is_reported(seed, lost):
    stamps = np.delete(5.0 + np.arange(200) / RATE, sorted(lost))
    noise = np.random.default_rng(seed).standard_normal(len(stamps))
    frame = pd.DataFrame({"x": noise}, index=pd.Index(stamps, name="time_s"))
    found, gaps = resample(frame, uniform_times(stamps[0], stamps[-1], RATE), longest_gap_s=10.0)
    assert len(found) == 200 == len(frame) + gaps["missing"].sum()
    assert found["x"].abs().max() <= np.abs(noise).max() * (1.0 + 1e-12)
