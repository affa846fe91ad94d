"""What the IMU does besides noise: time stamps, streams, counts, range, the Earth's rotation."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ATTITUDE, IMU, VELOCITY
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import load_grade
from simrail.sensors.imu import EARTH_RATE_RADPS, EarthRate, sample_imu

NAMED = {"seed": 3, "draw": 0, "name": "axle"}


def motion(seconds: float, rate_hz: float = 1000.0, values: object = 0.0) -> pd.DataFrame:
    time = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    index = pd.Index(time, name="time_s")
    columns = [*IMU, *ATTITUDE, *VELOCITY]
    frame = pd.DataFrame(0.0, index=index, columns=columns)
    frame[list(IMU)] = np.broadcast_to(values, (len(time), 6)) if np.ndim(values) else values
    return frame


def swinging(seconds: float) -> pd.DataFrame:
    frame = motion(seconds)
    for i, column in enumerate(IMU):
        frame[column] = (i + 1.0) * np.sin(2.0 * np.pi * (0.5 + i) * frame.index.to_numpy() + i)
    return frame


def test_a_perfect_imu_gives_the_motion_at_its_own_time_stamps():
    truth = swinging(20.0)
    imu, delay_s = sample_imu(truth, load_grade("ideal"), **NAMED)
    assert set(imu.index) <= set(truth.index), "bit by bit the truth's own stamps"
    np.testing.assert_allclose(np.diff(imu.index), 0.004, atol=1e-12)
    assert imu.index[0] == pytest.approx(delay_s)
    assert imu.index[-1] == pytest.approx(20.0 - delay_s)
    assert 0.0 < delay_s < 0.05
    expected = truth.loc[imu.index, list(IMU)]
    # 0.1 % of each channel's amplitude is the filter's ripple; a stamp off by 1 ms would be 0.3 to 3.5 %.
    assert (np.abs(imu - expected).max() < 2e-3 * np.arange(1, 7)).all()


def test_without_a_filter_there_is_no_delay():
    truth = swinging(5.0)
    imu, delay_s = sample_imu(truth, ImuGrade("fast", 1000.0), **NAMED)
    assert delay_s == 0.0
    pd.testing.assert_frame_equal(imu, truth[list(IMU)], check_exact=True)


def test_bandwidth_lags_and_is_not_corrected():
    truth = swinging(20.0)
    grade = ImuGrade("slow", 1000.0, bandwidth_hz=50.0)
    imu, delay_s = sample_imu(truth, grade, **NAMED)
    lag = np.sqrt(2.0) / (2.0 * np.pi * 50.0)
    later = np.interp(imu.index.to_numpy() - lag, truth.index, truth["gyro_x_radps"])
    assert delay_s == 0.0
    assert np.abs(imu["gyro_x_radps"] - later)[1000:].max() < 2e-3
    assert np.abs(imu["gyro_x_radps"] - truth["gyro_x_radps"])[1000:].max() > 5e-3


def test_errors_off_keeps_rate_and_filter_only():
    truth = swinging(5.0)
    grade = load_grade("lord_3dm_gx4_25")
    clean, _ = sample_imu(truth, grade, errors=False, **NAMED)
    ideal, _ = sample_imu(truth, load_grade("ideal"), **NAMED)
    pd.testing.assert_frame_equal(clean, ideal, check_exact=True)


def test_samples_belong_to_seed_draw_and_name_and_to_nothing_else():
    grade = load_grade("lord_3dm_gx4_25")
    truth = motion(10.0)
    first, _ = sample_imu(truth, grade, **NAMED)
    sample_imu(truth, grade, seed=3, draw=0, name="another sensor in between")
    again, _ = sample_imu(truth, grade, **NAMED)
    pd.testing.assert_frame_equal(first, again, check_exact=True)
    longer, _ = sample_imu(motion(20.0), grade, **NAMED)
    pd.testing.assert_frame_equal(longer.iloc[: len(first)], first, check_exact=True)
    for change in ({"seed": 4}, {"draw": 1}, {"name": "frame"}):
        other, _ = sample_imu(truth, grade, **(NAMED | change))
        assert (other != first).mean().min() > 0.9


def test_one_term_more_leaves_the_others_samples_alone():
    truth = motion(10.0, 250.0)
    white = ImuGrade("white", 250.0, gyro_noise_radpsqrts=1.0)
    biased = replace(
        white, gyro_turn_on_bias_radps=0.5, gyro_bias_instability_radps=0.1, accel_noise_mpsqrts=2.0
    )
    alone = sample_imu(truth, white, **NAMED)[0]["gyro_x_radps"]
    together = sample_imu(truth, biased, **NAMED)[0]["gyro_x_radps"]
    slow = sample_imu(truth, replace(biased, gyro_noise_radpsqrts=0.0), **NAMED)[0]["gyro_x_radps"]
    np.testing.assert_allclose(together - slow, alone, atol=1e-13)


@pytest.mark.parametrize(("kind", "unit"), [("gyro", "radps"), ("accel", "mps2")])
def test_counts_are_whole_and_rounded_to_the_nearest(kind, unit):
    truth = swinging(60.0)
    size = 0.013
    grade = ImuGrade("coarse", 1000.0, **{f"{kind}_resolution_{unit}": size})
    imu, _ = sample_imu(truth, grade, **NAMED)
    columns = [name for name in IMU if name.startswith(kind)]
    counts = imu[columns].to_numpy() / size
    np.testing.assert_allclose(counts, np.rint(counts), atol=1e-9)
    assert np.min(np.diff(np.unique(np.rint(counts[:, 0])))) == 1.0, "no finer or coarser grid"
    error = (imu[columns] - truth[columns]).to_numpy()
    assert np.abs(error).max() <= 0.5 * size * (1.0 + 1e-9)
    assert error.std() == pytest.approx(size / np.sqrt(12.0), rel=0.03)
    assert abs(error.mean()) < 0.02 * size
    rest = [name for name in IMU if name not in columns]
    pd.testing.assert_frame_equal(imu[rest], truth[rest], check_exact=True)


@pytest.mark.parametrize(("kind", "unit"), [("gyro", "radps"), ("accel", "mps2")])
@pytest.mark.parametrize("size", (0.0, 0.013))
def test_range_clips_both_signs_and_only_beyond_it(kind, unit, size):
    truth = swinging(60.0)
    limit = 0.75
    grade = ImuGrade("narrow", 1000.0, **{f"{kind}_range_{unit}": limit, f"{kind}_resolution_{unit}": size})
    imu, _ = sample_imu(truth, grade, **NAMED)
    for column in (name for name in IMU if name.startswith(kind)):
        got, true = imu[column].to_numpy(), truth[column].to_numpy()
        assert limit - size <= got.max() <= limit
        assert got.min() == -got.max()
        inside = np.abs(true) < limit - size
        np.testing.assert_allclose(got[inside], true[inside], atol=0.5 * size + 1e-12)


def test_the_earth_turns_for_a_standing_imu():
    truth = motion(2.0)
    truth["yaw_rad"] = 0.4
    ideal = load_grade("ideal")
    latitude = np.radians(37.34)
    still, _ = sample_imu(truth, ideal, earth=None, **NAMED)
    assert (still == 0.0).all(axis=None)
    imu, _ = sample_imu(truth, ideal, earth=EarthRate(latitude, x_axis_rad=0.1), **NAMED)
    # X points 0.5 rad from east towards north: its share of the horizontal rate is sin(0.5).
    level = EARTH_RATE_RADPS * np.cos(latitude)
    expected = [level * np.sin(0.5), level * np.cos(0.5), EARTH_RATE_RADPS * np.sin(latitude), 0, 0, 0]
    np.testing.assert_allclose(imu.to_numpy(), np.tile(expected, (len(imu), 1)), atol=1e-18)
    truth[list(ATTITUDE)] = [0.3, -0.2, 0.4]
    tilted, _ = sample_imu(truth, ideal, earth=EarthRate(latitude, x_axis_rad=0.1), **NAMED)
    norm = np.linalg.norm(tilted.to_numpy()[:, :3], axis=1)
    np.testing.assert_allclose(norm, EARTH_RATE_RADPS, rtol=1e-12)
    # Roll 0.3, pitch -0.2, yaw 0.4 by matrices (paper 000, Eq. 2).
    cr, sr, cp, sp, cy, sy = np.cos(0.3), np.sin(0.3), np.cos(-0.2), np.sin(-0.2), np.cos(0.4), np.sin(0.4)
    rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    world = EARTH_RATE_RADPS * np.array(
        [np.cos(latitude) * np.sin(0.1), np.cos(latitude) * np.cos(0.1), np.sin(latitude)]
    )
    np.testing.assert_allclose(tilted.to_numpy()[0, :3], (rz @ ry @ rx).T @ world, atol=1e-18)


def test_coriolis_pushes_to_the_right_in_the_north():
    truth = motion(2.0)
    truth["velocity_x_mps"] = 20.0
    latitude = np.radians(45.0)
    imu, _ = sample_imu(truth, load_grade("ideal"), earth=EarthRate(latitude), **NAMED)
    force = imu.to_numpy()[0, 3:]
    # Kept on its straight eastward track, the train is pushed to the left (+Y) against the drift to the
    # right, and feels lighter (Eotvos effect).
    assert force[1] == pytest.approx(2.0 * EARTH_RATE_RADPS * np.sin(latitude) * 20.0)
    assert force[2] == pytest.approx(-2.0 * EARTH_RATE_RADPS * np.cos(latitude) * 20.0)
