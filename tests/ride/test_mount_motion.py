"""Motion of a mount: the same bits in any company, worked out once, and remembered within bounds."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from simrail.core.columns import ATTITUDE, IMU, MOTION, RELATIVE_ATTITUDE
from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import load
from simrail.ride import mount_motion
from simrail.ride import truth as truths
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.mount_motion import Remembered
from simrail.ride.truth import Mount, Truth
from simrail.track.file import TrackFile
from simrail.vehicle.speed_profile import SpeedProfile

STRAIGHT = Mount("imu", "body", (0.4, -0.2, 0.9))
TURNED = Mount("imu", "body", (0.4, -0.2, 0.9), roll_rad=0.1, pitch_rad=-0.2, yaw_rad=3.0)


@pytest.fixture(scope="module")
def truth() -> Truth:
    track = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    return kinematic_truth(track, SpeedProfile(20.0, 440.0, 15.0, rest_s=1.0), height_m=0.3)


@pytest.mark.parametrize("mount", [STRAIGHT, TURNED], ids=["straight", "turned"])
def test_rows_and_columns_have_the_bits_of_the_whole(truth: Truth, mount: Mount) -> None:
    whole = truth.motion(mount)
    some = range(3, len(truth.time_s) - 1, 7)
    assert replace(truth).motion(mount, some).equals(whole.iloc[list(some)])
    assert replace(truth).motion(mount, some, IMU).equals(whole.iloc[list(some)][list(IMU)])
    one = range(12_345, 12_346)
    assert replace(truth).motion(mount, one, ("position_m",)).iloc[0, 0] == whole["position_m"].iloc[12_345]


def test_a_turned_sensor_has_the_attitude_and_the_signals_of_its_axes(truth: Truth) -> None:
    """By matrices: C T, and T^T of what an aligned sensor feels."""
    straight, turned = truth.motion(STRAIGHT), truth.motion(TURNED)
    tilt = rotation_matrix(np.array([[TURNED.roll_rad, TURNED.pitch_rad, TURNED.yaw_rad]]))[0]
    for triad in (IMU[:3], IMU[3:]):
        felt = straight[list(triad)].to_numpy() @ tilt
        np.testing.assert_allclose(turned[list(triad)], felt, atol=1e-13)
    body, sensor = (rotation_matrix(each[list(ATTITUDE)].to_numpy()) for each in (straight, turned))
    np.testing.assert_allclose(sensor, body @ tilt, atol=1e-13)
    # No jump of a turn, though the yaw passes half a turn on the way.
    assert np.abs(np.diff(turned["yaw_rad"])).max() < 1e-3 and np.ptp(turned["yaw_rad"]) > 0.3
    assert turned["yaw_rad"].max() > np.pi


def test_a_sensor_that_faces_back_has_one_yaw_over_the_track(truth: Truth) -> None:
    """Half a turn beside the track's, either side of it: never minus half a turn."""
    for yaw in (np.pi, -np.pi):
        beside = truth.motion(replace(STRAIGHT, yaw_rad=yaw), columns=RELATIVE_ATTITUDE).to_numpy()
        np.testing.assert_allclose(beside[:, 2], yaw, atol=0.01)


def test_a_motion_is_worked_out_once(truth: Truth, monkeypatch: pytest.MonkeyPatch) -> None:
    counted: list[str] = []
    original: Callable[..., object] = mount_motion.mount_motion

    def count(owner: Truth, mount: Mount, rows: range, columns: tuple[str, ...]) -> object:
        counted.append(mount.name)
        return original(owner, mount, rows, columns)

    monkeypatch.setattr(truths, "mount_motion", count)
    fresh = replace(truth)
    first = fresh.motion(STRAIGHT)
    assert fresh.motion(replace(STRAIGHT, name="same place")).equals(first)
    assert counted == ["imu"]
    fresh.motion(TURNED)
    assert len(counted) == 2
    # Another truth has motions of its own, be it made of this one.
    moved = replace(fresh, gravity_mps2=1.62).motion(STRAIGHT)
    assert len(counted) == 3 and moved["accel_z_mps2"].iloc[0] == pytest.approx(1.62)
    assert pickle.loads(pickle.dumps(fresh)).motion(STRAIGHT).equals(first)
    assert len(counted) == 4


def test_what_is_remembered_cannot_be_written_to(truth: Truth) -> None:
    with pytest.raises(ValueError, match="read-only"):
        truth.motion(STRAIGHT).to_numpy()[0, 0] = 1.0
    motion = truth.motion(STRAIGHT)
    motion["x_m"] = 0.0
    assert truth.motion(STRAIGHT)["x_m"].iloc[0] != 0.0 and list(motion.columns) == list(MOTION)


def test_memory_is_bounded_and_what_was_used_last_stays() -> None:
    kept = Remembered(most_bytes=3 * 800)
    for name in "abc":
        kept.keep(name, np.zeros(100))
    assert kept.get("a") is not None
    kept.keep("d", np.zeros(100))
    assert kept.nbytes == 2400
    assert [kept.get(name) is not None for name in "abcd"] == [True, False, True, True]
    kept.keep("too large", np.zeros(301))
    assert kept.get("too large") is None and kept.nbytes == 2400


def test_each_question_has_its_own_answer(truth: Truth) -> None:
    """Of one truth, one after the other, in a transition: other rows, other columns, another place."""
    whole = truth.motion(STRAIGHT)
    at = int(np.argmax(np.abs(np.diff(whole["roll_rad"]))))
    for rows in (range(at, at + 100), range(at + 100, at + 200), range(at + 100, at + 300, 2)):
        for columns in (IMU, ATTITUDE):
            assert truth.motion(STRAIGHT, rows, columns).equals(whole.iloc[list(rows)][list(columns)])
    other = replace(STRAIGHT, position_m=(0.4, 0.2, 0.9))
    assert truth.motion(other)["y_m"].iloc[0] == pytest.approx(whole["y_m"].iloc[0] + 0.4)
