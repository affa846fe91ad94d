"""Design angles, the quaternion helpers, and the VQF wrapper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simrail.estimators.ahrs import Imufusion, Vqf
from simrail.estimators.attitude.quaternions import from_euler, level, to_euler
from simrail.estimators.baselines import DesignAngles, ZeroTrack

from simrail.core.columns import ATTITUDE
from simrail.core.errors import InputError
from simrail.estimation.conformance import check_estimator, standing


def test_design_angles_are_the_tracks(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend())
    states = DesignAngles().estimate(recording).states
    frame = recording.track.frame(recording.odometry["position_m"].to_numpy())
    np.testing.assert_array_equal(states["roll_rad"], frame.roll_rad)
    np.testing.assert_array_equal(states["pitch_rad"], frame.pitch_rad)
    np.testing.assert_array_equal(states["yaw_rad"], frame.yaw_rad)


def test_design_angles_use_no_imu(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend())
    before = DesignAngles().estimate(recording).states
    recording.imu.iloc[:, :] = 0.0
    np.testing.assert_array_equal(DesignAngles().estimate(recording).states, before)


def test_zero_track_says_that_the_rails_lie_as_designed(bend: Callable, exactly: Callable) -> None:
    recording = exactly(bend())
    estimate = ZeroTrack(step_m=0.5).estimate(recording)
    geometry = estimate.geometry
    assert geometry is not None and len(geometry) == 1161 and geometry.index[0] == 10.0
    assert np.abs(geometry.iloc[:, :3]).max(axis=None) < 1e-12
    assert geometry["gauge_m"].isna().all()
    assert (estimate.states["lateral_m"] == 0.2).all() and (estimate.states["vertical_m"] == 0.6).all()
    short = exactly(bend(), step=40)
    check_estimator(ZeroTrack(), replace(short, imu_sheet=replace(short.imu_sheet, rate_hz=25.0)))


def test_quaternions_agree_with_scipy() -> None:
    rng = np.random.default_rng(4)
    for roll, pitch, yaw in rng.uniform([-3, -1.5, -3], [3, 1.5, 3], (20, 3)):
        ours = from_euler(roll, pitch, yaw)
        x, y, z, w = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
        # A quaternion and its negative are the same attitude.
        assert abs(ours @ [w, x, y, z]) == pytest.approx(1.0, abs=1e-14)
        np.testing.assert_allclose(
            to_euler(ours[None], start_yaw_rad=0.0)[0], [roll, pitch, yaw], rtol=0, atol=1e-12
        )


def test_yaw_is_unwrapped_from_the_turn_of_its_start() -> None:
    yaw = np.linspace(6.0, 14.0, 50)
    quaternions = np.array([from_euler(0.0, 0.0, angle) for angle in yaw])
    np.testing.assert_allclose(to_euler(quaternions, start_yaw_rad=6.1)[:, 2], yaw, rtol=0, atol=1e-12)


def test_level_inverts_gravity() -> None:
    roll, pitch = 0.2, -0.3
    up = Rotation.from_euler("ZYX", [1.0, pitch, roll]).inv().apply([0.0, 0.0, 9.81])
    np.testing.assert_allclose(level(up), (roll, pitch), rtol=1e-12)


def test_vqf_finds_attitude_and_heading_in_our_convention(
    bend: Callable, exactly: Callable, true_angles: Callable
) -> None:
    truth = bend()
    recording = exactly(truth)
    true = true_angles(truth, recording)
    error = Vqf(compensated=True).estimate(recording).states[list(ATTITUDE)].to_numpy() - true
    # VQF takes part of the turning for gyro bias; an axis or a sign wrong would cost far more.
    assert np.degrees(np.abs(error[:, :2])).max() < 1.0
    assert np.degrees(np.abs(error[:, 2])).max() < 4.0
    assert np.degrees(np.ptp(true[:, 2])) > 20.0  # and that was no small turn
    plain = Vqf().estimate(recording).states["roll_rad"].to_numpy() - true[:, 0]
    assert np.degrees(np.abs(plain)).max() > 1.0


def test_vqf_starts_at_the_designs_yaw(bend: Callable, exactly: Callable) -> None:
    recording = standing(exactly(bend(direction=-1)))
    # Leaning both ways, so that VQF's own heading does not start at zero.
    recording.imu.iloc[:, 3:] = np.array([2.0, -3.0, 9.0])
    frame = recording.track.frame(recording.odometry["position_m"].iloc[:1])
    assert Vqf().estimate(recording).states["yaw_rad"].iloc[0] == frame.yaw_rad[0]


def test_imufusion_finds_attitude_and_heading_in_our_convention(
    bend: Callable, exactly: Callable, true_angles: Callable
) -> None:
    truth = bend()
    recording = exactly(truth)
    true = true_angles(truth, recording)
    error = Imufusion(compensated=True).estimate(recording).states[list(ATTITUDE)].to_numpy() - true
    # Exact signals: what is left is single precision, and first-order integration.
    assert np.degrees(np.abs(error)).max() < 0.2
    assert np.degrees(np.ptp(true[:, 2])) > 20.0
    plain = Imufusion().estimate(recording).states["roll_rad"].to_numpy() - true[:, 0]
    assert np.degrees(np.abs(plain)).max() > 1.0


def test_imufusion_refuses_a_gain_that_is_none() -> None:
    for gain in (-0.1, np.nan, np.inf):
        with pytest.raises(InputError, match="gain"):
            Imufusion(gain=gain)
