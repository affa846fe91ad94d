"""What is exported is what was recorded, bit by bit, whole or not at all; and estimators run on it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import record_cell
from simrail.campaign.export import CONTACT_FOLDER, TRUTH_STEM, export
from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.columns import CONTACT, ENCODER, IMU, MOTION, ODOMETRY, ODOMETRY_SD
from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import shipped
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from simrail.report.pages.explorer import stored_rides
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import Cell, cells
from simrail.scenario.scenario import Scenario, load_scenario
from simrail.scoring.score import score

QUICK = ["ride.end_m=150.0", "ride.acceleration_mps2=2.0", "ride.rest_s=1.0", "ride.speed_kmh=30.0"]
SETTINGS = [word for setting in QUICK for word in ("--set", setting)]

pytestmark = pytest.mark.usefixtures("own_cache")


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def recorded(scenario: Scenario, cell: Cell) -> Recording:
    parts = Parts(scenario)
    return record_cell(cell, simulate(parts.ride(cell)), parts)


def assert_same(a: Recording, b: Recording) -> None:
    for part in ("imu", "odometry", "encoder", "gaps"):
        left, right = getattr(a, part), getattr(b, part)
        if left is None:
            assert right is None
            continue
        pd.testing.assert_frame_equal(left, right, check_exact=True)
        assert left.to_numpy().tobytes() == right.to_numpy().tobytes()
        assert left.index.to_numpy().tobytes() == right.index.to_numpy().tobytes()
    blank = pd.DataFrame()
    bare = [replace(r, imu=blank, odometry=blank, encoder=None, gaps=None) for r in (a, b)]
    assert repr(asdict(bare[0])) == repr(asdict(bare[1]))


@pytest.mark.long
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_exported_rides_read_back_bit_by_bit(
    here: Path, form: str, capsys: pytest.CaptureFixture[str]
) -> None:

    assert (
        call(["export", "quick_kinematic", *SETTINGS, "--format", form, "--out", "a/b", "--draw", "1"])
        == DONE
    )
    assert "2 recordings" in capsys.readouterr().out
    scenario = load_scenario("quick_kinematic", overrides=QUICK)
    first = [cell for cell in cells(scenario) if cell.sensor_draw == 0]
    folders = ["out_axle_lord_3dm_gx4_25", "out_axle_ideal"]
    assert names_in(here / "a" / "b") == {*folders, "recordings.csv"}
    for cell, folder in zip(first, folders, strict=True):
        found = here / "a" / "b" / folder
        assert names_in(found) == {
            "ride.toml", "track.toml", f"imu.{form}", f"encoder.{form}", f"odometry.{form}",
        }  # fmt: skip
        assert_same(recorded(scenario, replace(cell, sensor_draw=1)), read_ride(found))
    index = pd.read_csv(here / "a" / "b" / "recordings.csv")
    assert index["folder"].tolist() == folders
    assert index["imu.grade"].tolist() == ["lord_3dm_gx4_25", "ideal"]


def test_several_imus_draws_and_rides_have_folders_of_their_own(here: Path) -> None:
    text = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
    text += """
[[imu]]
name = "box"
grade = "ideal"
body = "front"
position_m = [0.5, 0.1, 0.7]
roll_deg = 3.0
"""
    (here / "two.toml").write_text(text)
    scenario = load_scenario("two.toml", overrides=[*QUICK[:-1], "ride.speed_kmh=[20.0, 30.0]"])
    names = export(scenario, here / "out", format="parquet")
    assert len(names) == 6 == len(set(names))
    first = [cell for cell in cells(scenario) if cell.sensor_draw == 0]
    for cell, name in zip(first, names, strict=True):
        again = read_signals(here / "out" / name)  # `read_ride` would say that the box is turned by 3 degrees
        assert again.mount == cell.imu.name and again.imu_sheet.grade == cell.imu.grade
        assert_same(recorded(scenario, cell), again)


def test_the_truth_in_ned_is_the_same_motion(here: Path) -> None:
    """Turned by half a turn about X: the rotation of the body is the same one, told in other axes."""
    order = ["export", "quick_kinematic", *SETTINGS, "--set", "imu.grade=ideal", "--truth"]
    assert call([*order, "--out", "flu"]) == DONE and call([*order, "--frame", "ned", "--out", "ned"]) == DONE
    own, ned = (
        pd.read_csv(here / axes / "out_axle_ideal" / "truth_not_part_of_the_recording.csv", comment="#")
        for axes in ("flu", "ned")
    )
    half_turn = np.diag([1.0, -1.0, -1.0])
    attitude = rotation_matrix(own[["roll_rad", "pitch_rad", "yaw_rad"]].to_numpy())
    turned = rotation_matrix(ned[["roll_ned_rad", "pitch_ned_rad", "yaw_ned_rad"]].to_numpy())
    np.testing.assert_allclose(turned, half_turn @ attitude @ half_turn, rtol=0.0, atol=1e-15)
    for old, new in (
        ("velocity_{}_mps", "velocity_{}_ned_mps"),
        ("accel_{}_mps2", "accel_{}_frd_mps2"),
        ("{}_m", "{}_ned_m"),
    ):
        vectors = own[[old.format(axis) for axis in "xyz"]].to_numpy() @ half_turn
        np.testing.assert_array_equal(ned[[new.format(axis) for axis in "xyz"]].to_numpy(), vectors)
    np.testing.assert_array_equal(ned["position_m"], own["position_m"])  # along the track
    assert call([*order, "--frame", "enu", "--out", "x"]) == BAD_INPUT and not (here / "x").exists()


@pytest.mark.long
def test_a_recording_its_truth_and_its_forces_as_mcap(here: Path) -> None:
    """One file each, and the recording is the one of the other forms."""
    pytest.importorskip("mcap.writer")
    order = ["export", "quick_kinematic", *SETTINGS, "--set", "imu.grade=ideal"]
    assert call([*order, "--format", "mcap", "--truth", "--frame", "ned", "--out", "x"]) == DONE
    assert call([*order, "--out", "plain"]) == DONE
    folder = here / "x" / "out_axle_ideal"
    assert names_in(folder) == {"ride.toml", "track.toml", "ride.mcap", f"{TRUTH_STEM}.mcap"}
    pd.testing.assert_frame_equal(read_ride(folder).imu, read_ride(here / "plain" / "out_axle_ideal").imu)
    assert call([*order, "--format", "bag", "--out", "y"]) == BAD_INPUT and not (here / "y").exists()


def test_columns_of_the_files_are_those_of_the_vocabulary(here: Path) -> None:
    assert call(["export", "quick_kinematic", *SETTINGS, "--set", "imu.grade=ideal", "--out", "x"]) == DONE
    folder = here / "x" / "out_axle_ideal"
    for name, columns in (("imu", IMU), ("encoder", ENCODER), ("odometry", ODOMETRY + ODOMETRY_SD)):
        *legend, header, _ = (folder / f"{name}.csv").read_text().split("\n", 4)
        assert all(line.startswith("# ") for line in legend)
        assert header == ",".join(("time_s", *columns))


def test_truth_stands_beside_the_recording_and_is_no_part_of_it(here: Path) -> None:
    settings = [*SETTINGS, "--set", "imu.grade=lord_3dm_gx4_25"]
    assert call(["export", "quick_kinematic", *settings, "--truth", "--out", "x"]) == DONE
    folder = here / "x" / "out_axle_lord_3dm_gx4_25"
    truth = pd.read_csv(folder / f"{TRUTH_STEM}.csv", index_col="time_s", comment="#")
    assert list(truth.columns) == list(MOTION)
    recording = read_ride(folder)
    np.testing.assert_array_equal(truth.index, recording.imu.index)
    assert "truth" not in (folder / "ride.toml").read_text()
    # The perfect signal beside the recorded one: they differ by no more than the noise and bias of the grade.
    difference = recording.imu["accel_z_mps2"] - truth["accel_z_mps2"]
    assert 0.0 < np.abs(difference).median() < 0.1


@pytest.mark.long
def test_estimate_of_an_exported_ride_is_that_of_the_campaign(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [*SETTINGS, "--set", "imu.grade=lord_3dm_gx4_25"]
    assert call(["export", "quick_kinematic", *settings, "--out", "x"]) == DONE
    capsys.readouterr()
    command = ["estimate", "x/out_axle_lord_3dm_gx4_25", "--estimator", "AttitudeEkf"]
    assert call([*command, "--set", "compensated=false", "--out", "est", "--format", "parquet"]) == DONE
    said = capsys.readouterr().out
    assert "no truth" in said and "roll less design" in said and "250 Hz" in said
    assert names_in(here / "est") == {"estimate.parquet", "innovations.parquet", "estimate.html"}
    from simrail.estimators.attitude.ekf import AttitudeEkf

    scenario = load_scenario("quick_kinematic", overrides=[*QUICK, "imu.grade='lord_3dm_gx4_25'"])
    cell = next(cells(scenario))
    recording = recorded(scenario, cell)
    direct = AttitudeEkf(compensated=False).estimate(recording)
    found = pd.read_parquet(here / "est" / "estimate.parquet").set_index("time_s")
    for name in direct.states:
        assert found[name].to_numpy().tobytes() == direct.states[name].to_numpy().tobytes()
    assert found["position_m"].to_numpy().tobytes() == recording.odometry["position_m"].to_numpy().tobytes()
    page = (here / "est" / "estimate.html").read_text(encoding="utf-8")
    assert "no truth beside it" in page and "compensated=False" in page
    assert "http" not in page.replace("http://www.w3.org", "")
    (view,), looks = stored_rides(page)
    assert {panel.group for panel in view.panels} == {"attitude", "ride", "IMU", "innovations"}
    roll = next(panel for panel in view.panels if panel.title == "roll")
    drawn = next(one.y for one in roll.series if one.key == "AttitudeEkf" and one.y is not None)
    assert drawn.max() == pytest.approx(np.rad2deg(direct.states["roll_rad"].max()), rel=1e-6)
    assert looks["AttitudeEkf"].label in page
    truth = simulate(Parts(scenario).ride(cell))
    assert len(score(direct, truth, recording))  # only with the truth at hand is there a score
    assert call([*command, "--out", "est"]) == DONE  # an earlier estimate is replaced as a whole
    assert names_in(here / "est") == {"estimate.csv", "innovations.csv", "estimate.html"}
    assert call([*command, "--out", "x"]) == BAD_INPUT  # other things are not
    assert names_in(here / "x") == {"out_axle_lord_3dm_gx4_25", "recordings.csv"}


def test_estimate_of_a_train_that_stands(here: Path) -> None:
    assert call(["new", "ride", "mine"]) == DONE
    frame = pd.read_csv("mine.csv").iloc[:450]
    frame.to_csv("mine.csv", index=False)
    assert call(["estimate", "mine.toml", "--estimator", "Vqf"]) == DONE
    assert names_in(here / "results" / "mine_Vqf") == {"estimate.csv", "estimate.html"}
    table = pd.read_csv(here / "results" / "mine_Vqf" / "estimate.csv", comment="#")
    assert (table["speed_mps"] == 0.0).all()


def test_an_estimator_of_ones_own_runs_on_the_template(here: Path) -> None:
    assert call(["new", "ride", "mine"]) == DONE
    assert call(["new", "ride", "mine"]) == BAD_INPUT
    assert call(["new", "estimator", "my_filter"]) == DONE
    command = [
        "estimate",
        "mine.toml",
        "--estimator",
        "my_filter.py:MyFilter",
        "--set",
        "time_constant_s=2.0",
    ]
    assert call([*command, "--out", "out"]) == DONE
    assert "time_constant_s=2.0" in (here / "out" / "estimate.html").read_text(encoding="utf-8")


def test_nothing_is_exported_of_a_faulty_scenario_or_into_a_full_place(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["export", "quick_kinematic", "--set", "imu.grade=nothing", "--out", "x"]) == BAD_INPUT
    assert call(["export", "quick_kinematic", "--format", "mat", "--out", "x"]) == BAD_INPUT
    assert not list(here.iterdir())
    (here / "x").mkdir()
    assert call(["export", "quick_kinematic", "--out", "x"]) == BAD_INPUT
    assert "exists already" in capsys.readouterr().err
    assert not list((here / "x").iterdir())


@pytest.mark.slow
def test_killed_export_leaves_no_folder_and_can_be_repeated(here: Path) -> None:
    command = [sys.executable, "-m", "simrail", "export", "quick_kinematic", "--out", "x"]
    environment = {**os.environ, "SIMRAIL_RIDES": str(here / "rides")}
    command += ["--set", "ride.end_m=590.0", "--set", "ride.speed_kmh=[20.0, 21.0, 22.0, 23.0]"]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not list(here.glob(".x.*.draft/*/imu.csv")):
        assert process.poll() is None, "it ended before a recording was begun"
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (here / "x").exists()
    assert call(["export", "quick_kinematic", *SETTINGS, "--out", "x"]) == DONE
    assert (here / "x" / "recordings.csv").is_file()


def test_interrupted_export_leaves_nothing(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*arguments: object, **keywords: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("simrail.campaign.export.write_parts", stop)
    assert call(["export", "quick_kinematic", *SETTINGS, "--out", "x"]) == 130
    assert not list(here.iterdir())


@pytest.mark.long
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_forces_are_written_for_each_wheel(here: Path, form: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What a ride kept, number by number; and refused with the remedy where nothing is kept."""
    settings = [*SETTINGS, "--set", "engine=compiled", "--set", "imu.grade=ideal"]
    asked = ["export", "quick_kinematic", *settings, "--format", form, "--contact", "--out"]
    assert call([*asked, "none"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "keeps no forces" in said and "--set contact_rate_hz=200.0" in said
    assert not (here / "none").exists()
    assert call([*asked, "out", "--set", "contact_rate_hz=50.0"]) == DONE
    overrides = [*QUICK, "engine=compiled", "contact_rate_hz=50.0"]
    scenario = load_scenario("quick_kinematic", overrides=overrides)
    truth = simulate(Parts(scenario).ride(next(cells(scenario))))
    (folder,) = (path / CONTACT_FOLDER for path in (here / "out").iterdir() if path.is_dir())
    assert names_in(folder) == {f"{wheel}.{form}" for wheel in truth.wheel_names}
    for wheel in truth.wheel_names:
        file = folder / f"{wheel}.{form}"
        frame = pd.read_csv(file, comment="#") if form == "csv" else pd.read_parquet(file)
        frame = frame.set_index("time_s") if "time_s" in frame.columns else frame
        assert list(frame.columns) == list(CONTACT)
        np.testing.assert_array_equal(frame.to_numpy(), truth.contact(wheel).to_numpy())
