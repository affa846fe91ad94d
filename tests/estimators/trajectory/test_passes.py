"""Passes of the smoother: what first order in roll costs a body that rolls, and what a second one mends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import twins.trajectory
from channels import harmonic
from simrail.estimators.trajectory.model import beyond_first_order
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import TrajectorySmoother

from simrail.core.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.core.rotation import rotation_matrix
from simrail.recording.recording import ImuSheet, Recording
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.track.design import Straight, TrackDesign
from simrail.vehicle.speed_profile import SpeedProfile

ROLL, FREQUENCY_HZ = 0.03, 0.2
LINE = TrackDesign("line", 0.0, (Straight(90.0),))
BODY = Mount("body", "body", (0.0, 0.0, 0.05))
QUIET = Hyperparameters(
    accel_y_m2ps4=1e-4, accel_z_m2ps4=1e-4, lateral_position_m2=1e-2, vertical_position_m2=1e-2
)


@pytest.fixture(scope="module")
def rolling() -> tuple[Recording, pd.DataFrame]:
    """A body that rolls by 30 mrad and does nothing else, exactly recorded; and its motion."""
    profile = SpeedProfile(1.0, 61.0, 1.0, rest_s=2.0)
    swing = {"roll": harmonic(ROLL, frequency_hz=FREQUENCY_HZ)}
    truth = kinematic_truth(LINE, profile, channels=swing, height_m=0.05)
    motion = truth.motion(BODY).iloc[::4]
    odometry = motion[list(ODOMETRY)].copy()
    odometry[list(ODOMETRY_SD)] = 0.0
    recording = Recording(
        name="rolling",
        imu=motion[[*GYRO, *ACCEL]],
        imu_sheet=ImuSheet("exact", 250.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount=BODY.name,
        mount_body=BODY.body,
        mount_position_m=BODY.position_m,
        track=LINE,
        encoder=None,
        encoder_sheet=None,
        start_position_m=1.0,
        odometry=odometry,
        odometry_source="truth",
    )
    return recording, motion


def vertical_error(smoother: TrajectorySmoother, ride: tuple[Recording, pd.DataFrame]) -> np.ndarray:
    recording, motion = ride
    error = smoother.estimate(recording).states["vertical_m"] - motion["vertical_m"]
    return error.to_numpy()[2500:-2500]


def test_first_order_takes_a_roll_for_a_motion_along_z(rolling: tuple[Recording, pd.DataFrame]) -> None:
    """g (cos(roll) - 1) swings with g roll^2/4 at twice the frequency: as if Z moved by that over omega^2."""
    smoother = TrajectorySmoother(hyperparameters=QUIET, rest_bias=False, geometry_step_m=0.0)
    omega = 2.0 * np.pi * 2.0 * FREQUENCY_HZ
    amplitude = 9.81 * ROLL**2 / 4.0 / omega**2  # 0.35 mm
    once = vertical_error(smoother, rolling)
    # The virtual measurement holds slow motion back; 6.3 rad/s2 are fast beside its 0.32 rad/s.
    assert np.std(once) == pytest.approx(amplitude / np.sqrt(2.0), rel=0.1)
    twice = vertical_error(replace(smoother, passes=2), rolling)
    assert np.abs(twice).max() < 0.03 * amplitude
    # It converges: a third pass changes next to nothing.
    third = vertical_error(replace(smoother, passes=3), rolling)
    assert np.abs(third - twice).max() < 1e-3 * amplitude


def test_passes_equal_filterpys(rolling: tuple[Recording, pd.DataFrame]) -> None:
    recording = rolling[0]
    short = replace(recording, imu=recording.imu.iloc[:1000], odometry=recording.odometry.iloc[:1000])
    ours = TrajectorySmoother(hyperparameters=QUIET, passes=2)
    compiled, readable = ours.trace(short), twins.trajectory.trace(ours, short)
    np.testing.assert_allclose(compiled.states, readable.states, rtol=0, atol=1e-7)
    assert not np.allclose(compiled.states, replace(ours, passes=1).trace(short).states, rtol=0, atol=1e-6)


def test_what_is_beyond_first_order_against_the_rotation_matrix() -> None:
    """Gravity from C' e_z, rates from the derivative of C, at any angles and rates."""
    rng = np.random.default_rng(3)
    angles, rates = rng.uniform(-0.3, 0.3, (50, 3)), rng.uniform(-1.0, 1.0, (50, 3))
    c, step = rotation_matrix(angles), 1e-6
    slope = (rotation_matrix(angles + step * rates) - rotation_matrix(angles - step * rates)) / (2.0 * step)
    spin = np.einsum("nji,njk->nik", c, slope)  # C' dC/dt = [w]x
    roll, pitch, _ = angles.T
    p, q, r = rates.T
    rate = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
    first = np.column_stack([p - pitch * r, q + roll * r, r - roll * q])
    gravity = 9.81 * (c[:, 2, :] - np.column_stack([-pitch, roll, np.ones(50)]))
    beyond = beyond_first_order(angles, rates, 9.81)
    np.testing.assert_allclose(beyond[:, :3], rate - first, atol=1e-8)
    np.testing.assert_allclose(beyond[:, 3:], gravity, atol=1e-12)


@pytest.mark.parametrize(
    "options",
    [
        {"passes": 0},
        {"passes": 6},
        {"passes": 2, "smoothed": False},
        {"passes": 2, "second_order": False},
        {"passes": 2, "printed": True},
    ],
)
def test_passes_that_cannot_be_are_named(options: dict[str, bool]) -> None:
    with pytest.raises(InputError, match="passes"):
        TrajectorySmoother(**options)
