"""The odometry filter on rides in closed form: accuracy, honesty, causality, rest, crawling, mirror."""

import numpy as np
import pandas as pd
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter
from simrail.estimators.kalman import update
from simrail.estimators.odometry.encoder import EncoderOdometry, ahead, predict

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.recording.recording import EncoderSheet, OdometerSheet
from simrail.sensors.encoder import EncoderSpec, sample_encoder
from simrail.vehicle.speed_profile import SpeedProfile

RADIUS = 0.29
COLUMNS = [*ODOMETRY, *ODOMETRY_SD]


def count(time, way, *, pulses=1024, rate_hz=250.0, draw=0):
    spec = EncoderSpec("front.left", pulses_per_revolution=pulses, rate_hz=rate_hz)
    return sample_encoder((way - way[0]) / RADIUS, time, spec, seed=1, draw=draw)


def odometry_of(
    time, way, *, pulses=1024, draw=0, radius_error=0.0, rate_hz=250.0, times=None, radius_relative_sd=0.0
):
    counts = count(time, way, pulses=pulses, rate_hz=rate_hz, draw=draw)
    radius_m = RADIUS * (1.0 + radius_error)
    sheet = EncoderSheet("front.left", pulses, radius_m, rate_hz, radius_relative_sd)
    wanted = time[28:-28:4] if times is None else times
    return EncoderOdometry().from_counts(counts, sheet, wanted, way[0])


def ride(direction=1, *, speed=20.0 / 3.6, end=400.0, stops=((200.0, 10.0),)):
    begin, finish = (10.0, end) if direction > 0 else (end, 10.0)
    profile = SpeedProfile(
        start_m=begin, end_m=finish, speed_mps=speed, rest_s=5.0, final_rest_s=5.0, stops=stops
    )
    time = np.arange(int(profile.duration_s * 1000.0)) / 1000.0
    return time, *profile.motion(time)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("direction", (1, -1))
def test_accuracy_at_20_kmh_with_1024_pulses(direction):
    time, s, v, a = ride(direction)
    found = odometry_of(time, s)
    true = np.column_stack([s, v, a])[28:-28:4]
    error = found[list(ODOMETRY)].to_numpy() - true
    moving = np.abs(true[:, 1]) > 0.0
    changing = np.abs(true[:, 2]) > 0.0
    quantum = 2.0 * np.pi * RADIUS / 1024
    assert rms(error[moving, 0]) < 0.5 * quantum
    assert rms(error[moving, 1]) < 0.004
    assert rms(error[moving, 2]) < 0.03
    # Braking and starting at 0.6 m/s2 with jerk 0.4 m/s3: the lag of the filter.
    assert rms(error[changing, 2]) < 0.04
    assert np.abs(error[:, 1]).max() < 0.03


@pytest.mark.parametrize("direction", (1, -1))
@pytest.mark.parametrize("pulses", (100, 1024))
def test_speed_is_exactly_zero_at_rest_and_nothing_drifts(direction, pulses):
    time, s, v, _ = ride(direction)
    found = odometry_of(time, s, pulses=pulses)
    standing = pd.Series(v, index=time).loc[found.index] == 0.0
    # A second after stopping at the latest, and from the first sample on.
    settled = standing.rolling(250, min_periods=1).min().astype(bool)
    assert settled.sum() > 3000
    assert (found.loc[settled, ["speed_mps", "acceleration_mps2"]] == 0.0).all(axis=None)
    for _, stay in found.loc[settled].groupby((~settled).cumsum()[settled]):
        assert np.ptp(stay["position_m"].to_numpy()) == 0.0
    assert abs(found["position_m"].iloc[-1] - s[-1]) < 2.0 * np.pi * RADIUS / pulses


@pytest.mark.parametrize("speed", (0.01, 0.02, 0.1, -0.01, -0.05))
def test_a_crawling_train_is_not_put_to_rest(speed):
    time = np.arange(60_000) / 1000.0
    found = odometry_of(time, speed * np.clip(time - 5.0, 0.0, None))
    late = found.loc[15.0:]
    assert (late["speed_mps"] != 0.0).all()
    assert late["speed_mps"].mean() == pytest.approx(speed, rel=0.01)
    assert rms(late["speed_mps"] - speed) < 0.08 * abs(speed)


def test_a_train_that_moves_when_the_recording_begins_is_followed_within_a_second():
    time = np.arange(5_000) / 1000.0
    found = odometry_of(time, 100.0 - 15.0 * time)
    assert np.abs(found["speed_mps"].loc[1.0:] + 15.0).max() < 0.02
    assert np.abs(found["position_m"] - (100.0 - 15.0 * found.index)).max() < 0.005


def test_backwards_is_the_exact_mirror_of_forwards():
    time, s, _, _ = ride()
    counts = count(time, s)
    sheet = EncoderSheet("front.left", 1024, RADIUS, 250.0)
    forth = EncoderOdometry().from_counts(counts, sheet, time[28::4], 0.0)
    back = EncoderOdometry().from_counts(-counts, sheet, time[28::4], 0.0)
    np.testing.assert_array_equal(back[list(ODOMETRY)], -forth[list(ODOMETRY)])
    np.testing.assert_array_equal(back[list(ODOMETRY_SD)], forth[list(ODOMETRY_SD)])


def test_the_answer_at_a_time_uses_nothing_read_later():
    time, s, _, _ = ride(end=250.0)
    counts = count(time, s)
    sheet = EncoderSheet("front.left", 1024, RADIUS, 250.0)
    # Wanted between the readings as well as at them.
    wanted = np.sort(np.concatenate([time[28::4], time[1::7] + 0.0003]))
    whole = EncoderOdometry().from_counts(counts, sheet, wanted, 10.0)
    for stop in (3.0, 5.9, 9.0004, 31.7, 50.0):
        part = EncoderOdometry().from_counts(counts.loc[:stop], sheet, wanted[wanted <= stop], 10.0)
        pd.testing.assert_frame_equal(part, whole.loc[:stop], check_exact=True)


def test_between_readings_it_predicts_with_its_own_speed():
    time, s, v, _ = ride(end=250.0)
    at = time[20_000:20_004]
    found = odometry_of(time, s, times=at)
    assert v[20_000] > 5.0
    np.testing.assert_allclose(np.diff(found["position_m"]), found["speed_mps"].iloc[0] * 0.001, rtol=1e-3)
    assert (np.diff(found["position_sd_m"]) > 0.0).all()
    assert found["position_m"].to_numpy() == pytest.approx(s[20_000:20_004], abs=0.003)


def test_predict_and_update_are_the_textbook_filter():
    rng = np.random.default_rng(4)
    oracle = KalmanFilter(dim_x=3, dim_z=1)
    oracle.H = np.array([[1.0, 0.0, 0.0]])
    root = rng.standard_normal((3, 3))
    oracle.P = root @ root.T
    oracle.x = rng.standard_normal((3, 1))
    x, p = oracle.x[:, 0].copy(), oracle.P.copy()
    row, gain, work = np.array([1.0, 0.0, 0.0]), np.zeros(3), np.zeros(3)
    answer = np.empty(6)
    for _ in range(50):
        dt, intensity, z, r = (
            rng.uniform(0.001, 0.1),
            rng.uniform(0.0, 1.0),
            rng.normal(),
            rng.uniform(0.01, 1),
        )
        oracle.F = np.array([[1.0, dt, 0.5 * dt**2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        oracle.Q = Q_continuous_white_noise(3, dt, intensity)
        oracle.predict()
        ahead(x, p, dt, intensity, answer)
        predict(x, p, dt, intensity)
        np.testing.assert_allclose(answer, [*x, *np.diag(p)], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(x, oracle.x[:, 0], rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(p, oracle.P, rtol=1e-9, atol=1e-12)
        oracle.update(z, R=r)
        update(x, p, row, z - x[0], r, gain, work)
        np.testing.assert_allclose(x, oracle.x[:, 0], rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(p, oracle.P, rtol=1e-8, atol=1e-11)


def test_intervals_cover_the_truth_with_a_radius_that_is_known():
    """Radius error excluded: 95 % intervals of s, V and A hold at least 95 % (they are meant to be wide)."""
    inside = []
    for draw in range(12):
        for direction in (1, -1):
            time, s, v, a = ride(direction, end=150.0, stops=())
            found = odometry_of(time, s, draw=draw).to_numpy()
            error = np.abs(found[:, :3] - np.column_stack([s, v, a])[28:-28:4])
            moving = np.abs(v[28:-28:4]) > 0.0
            inside.append((error < 1.96 * found[:, 3:])[moving])
    coverage = np.concatenate(inside).mean(axis=0)
    assert (coverage >= 0.95).all()


def test_standard_deviations_are_not_much_too_wide_either():
    time, s, v, a = ride(end=300.0, stops=())
    found = odometry_of(time, s).to_numpy()
    moving = np.abs(v[28:-28:4]) > 0.0
    error = (found[:, :3] - np.column_stack([s, v, a])[28:-28:4])[moving]
    ratio = np.sqrt(np.mean(np.square(error), axis=0) / np.mean(np.square(found[moving, 3:]), axis=0))
    assert (ratio > 0.3).all()


def test_position_interval_includes_the_radius_error():
    """Radius error included: the final position of 400 draws, N(0, sd) as the odometry is told."""
    time, s, _, _ = ride(end=120.0, stops=(), speed=10.0)
    sd = 1e-3
    normalised = []
    for draw, error in enumerate(np.random.default_rng(8).normal(0.0, sd, 400)):
        # Through the true way: a wheel that is really larger turns less for the same way.
        last = odometry_of(
            time, s, draw=draw, radius_error=error, times=time[-40:-1:4], radius_relative_sd=sd
        ).iloc[-1]
        normalised.append((last["position_m"] - s[-1]) / last["position_sd_m"])
    normalised = np.array(normalised)
    # Binomial: 95 % +- 4 x 1.1 %; the sd of 400 normal values +- 4 x 3.5 %.
    assert abs(np.mean(np.abs(normalised) < 1.96) - 0.95) < 0.044
    assert abs(normalised.std() - 1.0) < 0.14
    assert abs(normalised.mean()) < 0.2


def test_a_slow_encoder_serves_a_fast_imu():
    time, s, v, _ = ride(end=150.0, stops=())
    found = odometry_of(time, s, rate_hz=50.0)
    assert rms(found["speed_mps"].to_numpy() - v[28:-28:4]) < 0.02
    assert list(found.columns) == COLUMNS
    assert np.isfinite(found.to_numpy()).all()
    assert (found[list(ODOMETRY_SD)] > 0.0).all(axis=None)


def test_an_odometer_below_what_it_can_tell_is_a_train_that_stands():
    """Its speed is uniform within the bound; a reading at the bound is one that moves."""
    still, time = 0.02, np.arange(200) / 10.0
    for reading, stands in ((0.0, True), (0.019, True), (0.02, False)):
        odometer = pd.DataFrame({"speed_mps": reading}, index=pd.Index(time, name="time_s"))
        found = EncoderOdometry(still_mps=still).from_speed(odometer, OdometerSheet(0.05, 0.0), time, 7.0)
        last = found.iloc[-1]
        assert (last["speed_mps"] == 0.0) == stands and (last["position_m"] == 7.0) == stands
        if stands:
            assert last["speed_sd_mps"] == pytest.approx(still / np.sqrt(3.0), rel=1e-12)
