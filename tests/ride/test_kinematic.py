"""The kinematic engine is exact: its rates and accelerations are the derivatives of its poses."""

import numpy as np
import pytest
from channels import harmonic

from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import load
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.ride.truth import Mount
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.speed_profile import SpeedProfile

MOUNT = Mount("imu", "body", (0.3, -0.2, 0.6))


@pytest.fixture(scope="module", params=[1, -1], ids=["forward", "backward"])
def motion(request):
    track = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    ends = (track.start_m + 10.0, track.start_m + 400.0)
    start, end = ends if request.param > 0 else ends[::-1]
    channels = rail_following(lay(track, Irregularity("erri_b176_high", (3.0, 100.0), 20.0), seed=3))
    channels["pitch"] = harmonic(2e-3, frequency_hz=0.7, phase_rad=0.4)
    channels["yaw"] = harmonic(3e-3, frequency_hz=0.4)
    profile = SpeedProfile(start, end, 15.0, rest_s=1.0)
    truth = kinematic_truth(track, profile, channels=channels, height_m=0.3, rate_hz=4000.0)
    return truth.motion(MOUNT)


def central(values, step):
    """Fourth-order central first derivative of rows; two rows fewer at each end."""
    return (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (12 * step)


def test_velocity_is_the_derivative_of_position(motion):
    position = motion[["x_m", "y_m", "z_m"]].to_numpy()
    velocity = motion[["velocity_x_mps", "velocity_y_mps", "velocity_z_mps"]].to_numpy()
    np.testing.assert_allclose(central(position, 1 / 4000), velocity[2:-2], atol=2e-8)


def test_specific_force_is_acceleration_less_gravity_in_body_axes(motion):
    velocity = motion[["velocity_x_mps", "velocity_y_mps", "velocity_z_mps"]].to_numpy()
    angles = motion[["roll_rad", "pitch_rad", "yaw_rad"]].to_numpy()
    acceleration = central(velocity, 1 / 4000) + np.array([0.0, 0.0, 9.81])
    felt = np.einsum("nji,nj->ni", rotation_matrix(angles[2:-2]), acceleration)
    given = motion[["accel_x_mps2", "accel_y_mps2", "accel_z_mps2"]].to_numpy()[2:-2]
    # The rails' splines have steps in their third derivative: a second derivative of a pose sees them.
    # A dropped Coriolis or lever-arm term is 1e-3 and more.
    assert np.sqrt(np.mean((felt - given) ** 2)) < 1e-5


def test_body_rates_follow_from_the_angles(motion):
    angles = motion[["roll_rad", "pitch_rad", "yaw_rad"]].to_numpy()
    roll_rate, pitch_rate, yaw_rate = central(angles, 1 / 4000).T
    roll, pitch, _ = angles[2:-2].T
    expected = np.column_stack(
        [
            roll_rate - np.sin(pitch) * yaw_rate,
            np.cos(roll) * pitch_rate + np.sin(roll) * np.cos(pitch) * yaw_rate,
            -np.sin(roll) * pitch_rate + np.cos(roll) * np.cos(pitch) * yaw_rate,
        ]
    )
    given = motion[["gyro_x_radps", "gyro_y_radps", "gyro_z_radps"]].to_numpy()[2:-2]
    # The difference sees the steps in the third derivative of the rails' splines, at single knots.
    assert np.abs(given - expected).max() < 1e-6
    assert np.sqrt(np.mean((given - expected) ** 2)) < 1e-8


def test_odometry_columns_are_consistent(motion):
    s, v, a = motion[["position_m", "speed_mps", "acceleration_mps2"]].to_numpy().T
    np.testing.assert_allclose(central(s, 1 / 4000), v[2:-2], atol=1e-8)
    np.testing.assert_allclose(central(v, 1 / 4000), a[2:-2], atol=2e-3)  # jerk steps
    assert np.sqrt(np.mean((central(v, 1 / 4000) - a[2:-2]) ** 2)) < 1e-4


def test_mount_stands_where_it_was_put():
    track = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    truth = kinematic_truth(track, SpeedProfile(20.0, 440.0, 15.0), height_m=0.3)
    motion = truth.motion(MOUNT)
    # The body keeps to the track, so the mount keeps its place in the track frame: exactly on straights,
    # and in curves but for the angle between the frames abeam of the body and of the mount.
    straight = motion["position_m"] < 149.0
    np.testing.assert_allclose(motion.loc[straight, "vertical_m"], 0.6, atol=1e-9)
    np.testing.assert_allclose(motion.loc[straight, "lateral_m"], -0.2, atol=1e-9)
    np.testing.assert_allclose(motion["vertical_m"], 0.6, atol=1e-3)
    np.testing.assert_allclose(motion["lateral_m"], -0.2, atol=1e-3)
