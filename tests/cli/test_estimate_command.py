"""``simrail estimate`` on recorded rides: an IMU and nothing else, several methods, limits, a reference."""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import pandas as pd
import pytest

from simrail.cli.estimate_ride import ride_with_warnings
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.columns import ODOMETRY, ODOMETRY_SD, STANDSTILL
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
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
    states = pd.read_csv(tmp_path / "out" / "estimate.csv", index_col="time_s", comment="#")
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


METHODS = """
[[estimator]]
name = "quick"
method = "ComplementaryFilter"
[[estimator]]
method = "DesignAngles"
[reference]
file = "level.csv"
source = "a spirit level"
sd = { roll = "0.05 deg" }
"""


@pytest.fixture(scope="module")
def with_reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ride with an encoder, two methods in its file, and a level that was read every second."""
    folder = tmp_path_factory.mktemp("reference")
    profile = SpeedProfile(
        300.0, END_M, 12.0, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=4.0, final_rest_s=2.0
    )
    truth = kinematic_truth(track_by_name("condequinto_olivar"), profile)
    recording = measure(
        truth,
        name="levelled",
        mount=Mount("floor", "body", (0.0, 0.0, 1.1)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec(truth.wheel_names[0], radius="calibrated"),
        seed=1,
        draw=0,
    )
    write_ride(recording, folder / "ride")
    moved = truth.motion(Mount("floor", "body", (0.0, 0.0, 1.1)))
    every = slice(None, None, round(len(moved) / (moved.index[-1] - moved.index[0])))
    moved[["roll_rad", "position_m"]].iloc[every].to_csv(folder / "ride" / "level.csv")
    text = (folder / "ride" / "ride.toml").read_text()
    head, brackets, rest = text.partition("[")
    (folder / "ride" / "ride.toml").write_text(head + METHODS + brackets + rest)
    return folder / "ride"


def test_methods_of_the_file_stand_side_by_side_and_beside_the_reference(
    with_reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    command = ["estimate", str(with_reference), "--out", str(out), "--units", "deg,mm"]
    assert call(command) == DONE
    said = capsys.readouterr().out
    assert "less quick" in said and "beside the reference" in said and "DesignAngles: roll, deg" in said
    written = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert {"quick/estimate.csv", "DesignAngles/estimate.csv", "differences.csv", "scores.csv"} <= written
    assert all(name in said for name in written), "every file that was written is named"
    scores = pd.read_csv(out / "scores.csv", comment="#")
    assert set(scores["reference"]) == {"reference"} and set(scores["estimator"]) == {"quick", "DesignAngles"}
    table = pd.read_csv(out / "DesignAngles" / "estimate.csv", comment="#")
    assert "roll_deg" in table and "position_m" in table
    # The level is the truth itself: rails as designed err by what the body sways, and by no more.
    whole = scores[(scores["window"] == "whole") & (scores["metric"] == "rms")]
    rms = whole.set_index(["estimator", "quantity"])["value"]
    assert 0.0 < rms["DesignAngles", "roll"] < 1.0 and rms["DesignAngles", "roll"] != rms["quick", "roll"]
    page = (out / "estimate.html").read_text(encoding="utf-8")
    assert "Beside the reference" in page and "a spirit level" in page
    for words in (said, page.partition("<script")[0]):
        assert "truth" not in words.replace("no truth", "")


def test_one_of_the_file_is_chosen_by_its_name_and_options_say_whose_they_are(
    with_reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["estimate", str(with_reference), "--out", str(tmp_path / "out")]
    assert call([*command, "--estimator", "quick", "--set", "time_constant_s=2.5"]) == DONE
    assert "time_constant_s=2.5" in (tmp_path / "out" / "estimate.html").read_text(encoding="utf-8")
    assert not (tmp_path / "out" / "differences.csv").exists()
    capsys.readouterr()
    for more, words in (
        (["--set", "time_constant_s=2.5"], ["whose option", "quick.time_constant_s"]),
        (["--estimator", "quick", "--estimator", "quick"], ["named twice"]),
        (["--estimator", "quick", "--set", "no=1"], ["no such option"]),
        (["--units", "inch"], ["--units", "deg, mm"]),
        (["--limit", "twist=3mm"], ["--limit", "QUANTITY.BAND=LIMIT", "vertical_profile.D1=6mm"]),
        (["--limit", "crosslevel.D1=3mm"], ["no such quantity", "cross_level"]),
        (["--limit", "twist.D1=3mm"], ["no such band", "full"]),
        (["--limit", "twist.full=3deg"], ["--limit", "3deg"]),
        (["--limit", "twist.full=3mm", "--fuse"], ["fused rails"]),
    ):
        assert call([*command, *more]) == BAD_INPUT
        said = capsys.readouterr().err
        assert all(word in said for word in words) and len(said.splitlines()) == 1, said


def test_limits_of_the_command_stand_in_place_of_those_of_the_file_or_beside_them(
    with_reference: Path, tmp_path: Path
) -> None:
    ride = tmp_path / "ride"
    shutil.copytree(with_reference, ride)
    assert ride_with_warnings(ride).spec.limits.limits().is_example
    with (ride / "ride.toml").open("a") as file:
        file.write('\n[limits]\nsection_m = 100.0\ncross_level = { D1 = "4 mm", D1_sd = 1.0 }\n')
    told = ["cross_level.D1 = 1.5mm", "twist.full=6"]
    limits = ride_with_warnings(ride, told).spec.limits.limits()
    assert limits.peaks == pytest.approx({("cross_level", "D1"): 1.5e-3, ("twist", "full"): 6e-3})
    assert limits.sds == pytest.approx({("cross_level", "D1"): 1e-3}) and limits.section_m == 100.0
