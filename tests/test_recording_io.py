"""Recordings survive the disk bit by bit, whole or not at all."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.measure import measure
from simrail.profile import SpeedProfile
from simrail.recording import Recording
from simrail.recording_io import check_recording, read_recording, write_recording
from simrail.scenario.imu_file import load_grade
from simrail.sensors.encoder import EncoderSpec
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.truth import Mount
from simrail.vehicle.kinematic_engine import kinematic_truth


@pytest.fixture(scope="module")
def recording() -> Recording:
    track = TrackDesign(
        "curve",
        -50.0,
        (
            Straight(80.0),
            Transition(30.0),
            Curve(100.0, 1.0 / 3.0e-3, 0.07),
            Transition(30.0),
            Straight(100.0),
        ),
        gradients=(Gradient(0.0, 0.005), Gradient(90.0, -0.0123)),
        vertical_radius_m=1500.0,
    )
    truth = kinematic_truth(track, SpeedProfile(start_m=0.0, end_m=150.0, speed_mps=8.0, rest_s=2.0))
    return measure(
        truth,
        name="Montequinto é",
        mount=Mount("axle", "body", (0.1, -0.2, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel", radius_error_sd=1e-3),
        seed=1,
        draw=0,
    )


def assert_same(a: Recording, b: Recording) -> None:
    for part in ("imu", "odometry", "encoder"):
        left, right = getattr(a, part), getattr(b, part)
        if left is None:
            assert right is None
        else:
            pd.testing.assert_frame_equal(left, right, check_exact=True)
            assert left.to_numpy().tobytes() == right.to_numpy().tobytes()
            assert left.index.to_numpy().tobytes() == right.index.to_numpy().tobytes()
            assert right.index.name == "time_s"
    blank = pd.DataFrame()
    assert replace(a, imu=blank, odometry=blank, encoder=None).__repr__() == (
        replace(b, imu=blank, odometry=blank, encoder=None).__repr__()
    )


def test_round_trip_is_exact(recording, tmp_path):
    write_recording(recording, tmp_path / "ride")
    assert sorted(path.name for path in (tmp_path / "ride").iterdir()) == [
        "encoder.parquet",
        "imu.parquet",
        "odometry.parquet",
        "recording.json",
    ]
    again = read_recording(tmp_path / "ride")
    assert_same(recording, again)
    s = np.linspace(-40.0, 280.0, 50)
    np.testing.assert_array_equal(again.track.frame(s).k, recording.track.frame(s).k)


def test_round_trip_without_an_encoder(recording, tmp_path):
    blind = replace(recording, encoder=None, encoder_sheet=None, odometry_source="truth")
    write_recording(blind, tmp_path / "deep" / "ride")
    assert_same(blind, read_recording(tmp_path / "deep" / "ride"))


def test_a_folder_in_use_is_not_overwritten(recording, tmp_path):
    write_recording(recording, tmp_path / "ride")
    with pytest.raises(ValueError, match="exists already"):
        write_recording(replace(recording, name="other"), tmp_path / "ride")
    assert read_recording(tmp_path / "ride").name == "Montequinto é"


def test_nothing_half_written_is_left(recording, tmp_path):
    broken = replace(recording, gravity_mps2=object())  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        write_recording(broken, tmp_path / "ride")
    assert list(tmp_path.iterdir()) == []


def test_the_judge_changes_nothing(recording):
    before = recording.imu.copy(deep=True)
    check_recording(recording)
    pd.testing.assert_frame_equal(recording.imu, before, check_exact=True)
