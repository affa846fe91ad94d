"""``simrail estimate`` on a recorded ride that has an IMU and nothing else."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import pandas as pd
import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.columns import ODOMETRY, ODOMETRY_SD, STANDSTILL
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile

END_M = 420.0


@lru_cache
def imu_alone() -> Recording:
    """A ride from stop to stop in half a minute."""
    profile = SpeedProfile(
        300.0, END_M, 12.0, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=8.0, final_rest_s=8.0
    )
    return measure(
        kinematic_truth(track_by_name("condequinto_olivar"), profile),
        name="alone",
        mount=Mount("floor", "body", (0.0, 0.0, 1.1)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=None,
        seed=1,
        draw=0,
    )


def estimate(folder: Path, recording: Recording, *settings: str) -> int:
    write_ride(recording, folder / "ride")
    chosen = [part for setting in settings for part in ("--set", setting)]
    command = ["estimate", str(folder / "ride"), "--estimator", "ZeroVelocityOdometry", *chosen]
    return call([*command, "--out", str(folder / "out")])


def test_an_imu_alone_gives_speed_and_way(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert estimate(tmp_path, imu_alone(), "smoothed=true") == DONE
    assert "position and speed from the odometry 'ZeroVelocityOdometry'" in capsys.readouterr().out
    states = pd.read_csv(tmp_path / "out" / "estimate.csv", index_col="time_s")
    assert list(states) == [*ODOMETRY, *ODOMETRY_SD, STANDSTILL]
    last = states.iloc[-1]
    assert last["position_m"] == pytest.approx(END_M, abs=4.0 * last["position_sd_m"])
    assert last["position_sd_m"] < 1.0 and abs(last["speed_mps"]) < 0.01 and last[STANDSTILL] > 0.99
    assert states["speed_mps"].max() == pytest.approx(imu_speed(), abs=0.2)


def imu_speed() -> float:
    """Highest speed of a ride of 120 m with ramps of 1 m/s2 and 1 m/s3: v (v + 1) = 120, below 12."""
    return 0.5 * (-1.0 + (1.0 + 4.0 * 120.0) ** 0.5)


def test_a_recording_that_begins_on_the_way_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    imu = imu_alone().imu.copy()
    imu.iloc[:500, 5] += 0.3 * (-1.0) ** pd.RangeIndex(500).to_numpy()
    assert estimate(tmp_path, replace(imu_alone(), imu=imu)) == BAD_INPUT
    text = capsys.readouterr().err
    assert "does not begin at rest" in text and "begin the recording while the train stands" in text
    assert not (tmp_path / "out").exists()
