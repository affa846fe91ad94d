"""Every fault of a ride file or its data: one message by name, exit code 2, nothing written."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.cli.main import BAD_INPUT, call
from simrail.cli.templates import ride_template
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.check_physics import check_plausible
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.sheets.vehicle_sheet import Chord
from simrail.track.map_errors import UNSTATED

TOML, DATA = "ride.toml", "ride.csv"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The template: upside down, deg/s, g, jittering milliseconds."""
    folder = tmp_path_factory.mktemp("sound")
    text, logged = ride_template("ride")
    (folder / TOML).write_text(text)
    (folder / DATA).write_text(logged)
    return folder


@pytest.fixture
def ride(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(sound, tmp_path, dirs_exist_ok=True)
    return tmp_path


def text(*pairs: tuple[str, str]) -> Callable[[Path], None]:
    """Replace words of the ride file."""

    def change(folder: Path) -> None:
        said = (folder / TOML).read_text()
        for old, new in pairs:
            assert old in said, old
            said = said.replace(old, new)
        (folder / TOML).write_text(said)

    return change


def data(change: Callable[[pd.DataFrame], pd.DataFrame | None]) -> Callable[[Path], None]:
    """Change the logger's data."""

    def apply(folder: Path) -> None:
        frame = pd.read_csv(folder / DATA)
        changed = change(frame)
        (frame if changed is None else changed).to_csv(folder / DATA, index=False)

    return apply


def scaled(factor: float, *columns: str) -> Callable[[Path], None]:
    return data(lambda frame: frame.assign(**{name: frame[name] * factor for name in columns}))


def put(row: int, column: str, value: object) -> Callable[[Path], None]:
    def change(frame: pd.DataFrame) -> pd.DataFrame:
        frame[column] = frame[column].astype(object)
        frame.loc[row, column] = value
        return frame

    return data(change)


def raw(change: Callable[[str], str]) -> Callable[[Path], None]:
    return lambda folder: (folder / DATA).write_text(change((folder / DATA).read_text())) and None


def decimal_comma(folder: Path) -> None:
    raw(lambda said: said.replace(",", ";").replace(".", ","))(folder)
    text((f'file = "{DATA}"', f'file = "{DATA}"\nseparator = ";"'))(folder)


def swap(frame: pd.DataFrame) -> None:
    frame.loc[[500, 501], "t_ms"] = frame.loc[[501, 500], "t_ms"].to_numpy()


def repeat(frame: pd.DataFrame) -> None:
    frame.loc[501, "t_ms"] = frame.loc[500, "t_ms"]


def late(frame: pd.DataFrame) -> None:
    frame.loc[2000:, "t_ms"] += 5000.0


def known(table: str) -> Callable[[Path], None]:
    """Say something of line or vehicle."""
    return text(("\n[imu]\n", f"\n{table}\n[imu]\n"))


def without_odometry(folder: Path) -> None:
    path = folder / TOML
    said = path.read_text().split("[encoder]")[0]
    path.write_text(said.replace("start_position_m = 110.0", "start_position_m = 900.0"))


GYROS, ACCELS = ("wx", "wy", "wz"), ("ax", "ay", "az")

FAULTS: dict[str, tuple[Callable[[Path], None], list[str]]] = {
    # units
    "degrees_as_radians": (
        text(('gyro = "deg/s"', 'gyro = "rad/s"')),
        ["imu.gyro_", "degrees", "units.gyro"],
    ),
    "radians_as_degrees": (
        scaled(np.pi / 180.0, *GYROS),
        ["imu.gyro_z_radps", "does not turn with the curves", "factor of the gyro 0.02", "units.gyro"],
    ),
    "degrees_twice": (scaled(180.0 / np.pi, *GYROS), ["imu.gyro_", "degrees"]),
    "g_as_mps2": (
        text(('accel = "g"', 'accel = "m/s2"')),
        ["imu.accel", "gravity", "1.0", "9.81 m/s2", "look like g, given as m/s2"],
    ),
    "mps2_as_g": (scaled(9.81, *ACCELS), ["imu.accel", "look like m/s2, given as g"]),
    "mg_as_g": (scaled(1000.0, *ACCELS), ["imu.accel", "500 m/s2", "mg"]),
    "ten_percent_off": (scaled(1.1, *ACCELS), ["imu.accel", "10.8", "0.51"]),
    "no_such_unit": (text(('gyro = "deg/s"', 'gyro = "deg/sec"')), ["units.gyro", "deg/sec", "rad/s, deg/s"]),
    "seconds_as_ms": (
        text(
            ('time = "ms"               ', 'time = "s" '),
            ('units = { time = "ms" }', 'units = { time = "s" }'),
        ),
        ["imu.units.time", "no IMU's rate", "0.1 Hz", "ms"],
    ),
    # axes
    "upside_down": (
        text(('axes = ["x", "-y", "-z"]', 'axes = ["x", "y", "z"]')),
        ["imu.accel", "points down", '["x", "-y", "-z"]', '"-g"'],
    ),
    "left_handed": (
        text(('axes = ["x", "-y", "-z"]', 'axes = ["x", "y", "-z"]')),
        ["imu.axes", "left-handed", "['x', 'y', '-z']"],
    ),
    "axis_twice": (
        text(('"x", "-y", "-z"', '"x", "-x", "-z"')),
        ["imu.axes", "each axis of the device once"],
    ),
    "on_its_side": (
        text(('axes = ["x", "-y", "-z"]', 'axes = ["x", "z", "-y"]')),
        ["imu.axes", "gravity lies along -Y"],
    ),
    "turns_the_other_way": (
        scaled(-1.0, "wz"),
        ["imu.gyro_z_radps", "against the curves", "that column alone"],
    ),
    "looks_backwards": (
        text(('axes = ["x", "-y", "-z"]', 'axes = ["-x", "y", "-z"]')),
        ["imu.yaw_deg", "backwards", "reverse"],
    ),
    "turned_by_90": (
        text(('axes = ["x", "-y", "-z"]', 'axes = ["y", "x", "-z"]')),
        ["imu.yaw_deg", "sideways", "axes"],
    ),
    "counts_backwards": (
        text(("reverse = false", "reverse = true"), ("start_position_m = 110.0", "start_position_m = 330.0")),
        ["encoder.reverse", "the other way", "reverse = true"],
    ),
    "leaves_the_track": (
        text(("reverse = false", "reverse = true")),
        ["encoder.reverse", "the other way", "wheel -"],
    ),
    "missing_axis": (
        text(('["wx", "wy", "wz"]', '["wx", "wy"]')),
        ["imu.columns.gyro", "lacks an axis", "x, y, z"],
    ),
    # columns
    "no_such_column": (
        text(('"wy"', '"gy"')),
        ["imu.columns", "'gy'", "t_ms, wx, wy, wz", "did you mean"],
    ),
    "other_case": (text(('"wy"', '"WY"')), ["'WY'", "did you mean 'wy'"]),
    "unknown_quantity": (text(("accel = [", "acell = [")), ["imu.columns.acell", "did you mean 'accel'"]),
    "column_twice": (raw(lambda t: t.replace("t_ms,wx,wy", "t_ms,wx,wx", 1)), ["several columns", "'wx'"]),
    "wrong_separator": (
        raw(lambda t: t.replace(",", ";")),
        ["imu.separator", "semicolon", 'separator = ";"'],
    ),
    "decimal_comma": (decimal_comma, [DATA, "no number in line 2", 'decimal = ","']),
    # data
    "empty_file": (raw(lambda t: ""), [DATA, "is empty"]),
    "header_only": (raw(lambda t: t.split("\n")[0] + "\n"), [DATA, "too short", "0 samples"]),
    "no_file": (lambda folder: (folder / DATA).unlink(), ["imu.file", DATA, "no such file"]),
    "other_kind": (text((f'"{DATA}"', '"ride.xls"')), ["imu.file", "ride.xls", "no kind that is read"]),
    "binary": (lambda folder: (folder / DATA).write_bytes(b"\xff\xfe\x00\x93") and None, [DATA, "UTF-8"]),
    "nan": (put(123, "wy", ""), [DATA, "wy", "line 125", "nan", "drop"]),
    "infinite": (put(123, "ax", "inf"), [DATA, "ax", "line 125", "inf"]),
    "words": (put(123, "az", "fault"), [DATA, "az", "line 125", "'fault'"]),
    "ragged": (raw(lambda t: t.replace("\n", "\n1,2\n", 1)), [DATA, "line 2", "number of fields", "found 2"]),
    "half_a_pulse": (put(123, "pulses", 0.5), [DATA, "pulses", "line 125", "no whole number", "odometer"]),
    # time
    "reversed": (data(swap), [DATA, "imu.t_ms", "reversed", "sample 501"]),
    "duplicate": (data(repeat), [DATA, "imu.t_ms", "duplicate", "sample 501"]),
    "gap": (data(late), ["imu.time_s", "gap of 500 samples", "too long to bridge", "longest_gap_s = 0.1 s"]),
    "other_rate": (
        text(('body = "front"', 'body = "front"\nrate_hz = 90.0')),
        ["imu.rate_hz", "90", "100.0"],
    ),
    "no_common_clock": (
        text(('units = { time = "ms" }', 'units = { time = "epoch_ms" }')),
        ["encoder.units.time", "no common clock"],
    ),
    # what the train knows
    "no_track": (
        text(('track = "smooth_curve"', 'track = "smoth_curve"')),
        ["track", "smoth_curve", "smooth_curve"],
    ),
    "off_the_track": (text(("start_position_m = 110.0", "start_position_m = 900.0")), ["odometry", "track"]),
    "off_the_track_without_odometry": (
        without_odometry,
        ["start_position_m", "900", "leaves track 'smooth_curve'", "0 to 600 m"],
    ),
    "negative_map_sd": (known("[map]\ncant_sd_mm = -3.0"), [TOML, "map.cant_sd_mm", "-3", ">= 0", "unit"]),
    "map_sd_is_nan": (known("[map]\nplace_sd_m = nan"), [TOML, "map.place_sd_m", "not a finite number"]),
    "map_sd_in_m": (known("[map]\nradius_sd_percent = 300.0"), ["map.radius_sd_percent", "300", "<= 20"]),
    "map_typo": (known("[map]\ncant_sd = 3.0"), ["map.cant_sd", "did you mean cant_sd_mm"]),
    "exact_map_that_errs": (
        known("[map]\nexact = true\ncant_sd_mm = 3.0"),
        [TOML, "map.cant_sd_mm", "exact map has no errors", "remove it"],
    ),
    "pivot_outside_the_body": (
        known("[vehicle_sheet]\npivots_m = [9.5, -9.5]\nbody_ends_m = [-9.0, 12.0]"),
        [TOML, "vehicle_sheet.pivots_m", "outside the body", "-9.5", "-9 to 12 m", "reference point"],
    ),
    "pivots_in_mm": (
        known("[vehicle_sheet]\npivots_m = [9500.0, -9500.0]"),
        [TOML, "vehicle_sheet.pivots_m[0]", "9500", "<= 40", "unit"],
    ),
    "negative_sheet_sd": (
        known("[vehicle_sheet]\nother_axle_m = -1.8\nplace_sd_m = -0.1"),
        [TOML, "vehicle_sheet.place_sd_m", "-0.1", ">= 0"],
    ),
    "sheet_of_no_body": (
        known('[[vehicle_sheet.body]]\nname = "frunt"\nx_m = 0.0'),
        [TOML, "imu.body", "not on the drawing", "'front'", "one of frunt"],
    ),
    "imu_outside_its_body": (
        text(
            ("\n[imu]\n", "\n[vehicle_sheet]\nother_axle_m = -1.8\nbody_ends_m = [-0.5, 0.5]\n[imu]\n"),
            ("position_m = [0.0, 0.0, 0.6]", "position_m = [0.9, 0.0, 0.6]"),
        ),
        [TOML, "imu.position_m[0]", "outside its body", "0.9", "-0.5 to 0.5 m"],
    ),
    "vehicle_sheet_typo": (
        known("[vehicle_sheet]\npivot_m = [9.5, -9.5]"),
        ["vehicle_sheet.pivot_m", "unknown key", "did you mean pivots_m"],
    ),
    "no_sheet": (text(('grade = "lord_3dm_gx4_25"', "")), ["imu.grade", "data sheet", "imu.datasheet"]),
    "no_grade": (text(('grade = "lord_3dm_gx4_25"', 'grade = "lord"')), ["imu.grade", "lord_3dm_gx4_25"]),
    "no_way": (
        lambda folder: (folder / TOML).write_text((folder / TOML).read_text().split("[encoder]")[0]) and None,
        ["encoder", "where the train is", "[odometer]"],
    ),
    "radius_in_mm": (
        text(("wheel_radius_m = 0.", "wheel_radius_m = 290.")),
        ["encoder.sheet.wheel_radius_m", "1.5"],
    ),
    "no_pulses": (text(("per_revolution = 1024", "per_revolution = 0")), ["pulses_per_revolution", "> 0"]),
    "sheet_typo": (
        text(("pulses_per_rev", "pulse_per_rev")),
        ["encoder.sheet", "unknown key", "did you mean pulses_per_revolution"],
    ),
    "typo": (text(("gravity_mps2", "gravity_mps")), ["gravity_mps", "did you mean gravity_mps2"]),
    "gravity": (text(("gravity_mps2 = 9.81", "gravity_mps2 = 981.0")), ["gravity_mps2", "981", "9.9"]),
    "no_body": (text(('body = "front"', "")), ["imu.body", "required"]),
    "broken_toml": (text(("[imu.units]", "[imu.units")), ["ride.toml", "not valid TOML"]),
}


def test_the_template_itself_is_sound(ride: Path) -> None:
    recording = read_ride(ride / TOML)
    assert recording.gaps is not None and recording.gaps["missing"].tolist() == [2, 1]


def test_the_template_shows_how_to_say_what_is_known(ride: Path) -> None:
    """Without the marks of comment its tables are read, at the values that are taken where none are said."""
    plain = read_ride(ride / TOML)
    assert plain.vehicle_sheet is None and plain.map_errors == UNSTATED
    said = (ride / TOML).read_text()
    begin, end = said.index("# [map]"), said.index("\n[imu]\n")
    shown = re.sub("^# ?", "", said[begin:end], flags=re.MULTILINE)
    (ride / TOML).write_text(said[:begin] + shown + said[end:])
    recording = read_ride(ride / TOML)
    assert recording.map_errors == replace(UNSTATED, cant_sd_m=0.003)
    sheet = recording.vehicle_sheet
    assert sheet is not None and (sheet.place_sd_m, sheet.stiffness_relative_sd) == (0.02, 0.2)
    assert sheet.chord(recording.mount_body) == Chord(-0.9, 0.9, 0.0, 0.02, 0.9)
    assert sheet.bodies[0].primary_stiffness_npm == 2.4e6
    pd.testing.assert_frame_equal(recording.imu, plain.imu, check_exact=True)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_refused_by_name(fault: str, ride: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damage, words = FAULTS[fault]
    damage(ride)
    assert call(["estimate", TOML, "--estimator", "DesignAngles", "--out", "out"]) == BAD_INPUT
    captured = capsys.readouterr()
    message = captured.err.strip()
    # Two tables name the data file of another kind; a ride the other way began elsewhere: both are told.
    lines = 2 if fault in ("other_kind", "counts_backwards") else 1
    assert captured.out == "" and len(message.splitlines()) == lines, message
    assert message.startswith("simrail: ")
    for word in words:
        assert word in message, message
    assert not (ride / "out").exists()
    assert not list(ride.glob(".out*"))


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--estimator", "AttitudeEkg"], "AttitudeEkf"),
        (["--estimator", "nothing.py:Mine"], "nothing.py"),
        (["--estimator", "AttitudeEkf", "--set", "compensatd=true"], "did you mean compensated"),
        (["--estimator", "AttitudeEkf", "--set", "compensated=maybe"], "compensated"),
        (["--estimator", "AttitudeEkf", "--set", "compensated"], "key=value"),
        (["--estimator", "DesignAngles", "--format", "xlsx"], "one of csv, parquet"),
        (["--estimator", "DesignAngles", "--out", "."], "other things than an estimate"),
    ],
)
def test_a_bad_command_is_refused(
    arguments: list[str], word: str, ride: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {path.name for path in ride.iterdir()}
    assert call(["estimate", TOML, *arguments]) == BAD_INPUT
    assert word in capsys.readouterr().err
    assert {path.name for path in ride.iterdir()} == before


@pytest.mark.parametrize("part", ["imu", "odometry", "encoder"])
@pytest.mark.parametrize("format", ["csv", "parquet"])
@pytest.mark.parametrize("damage", ["missing", "garbage", "empty"])
def test_a_damaged_file_of_a_written_ride_is_refused(
    ride: Path, part: str, format: str, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = read_ride(ride / TOML)
    write_ride(recording, ride / "written", format=format)  # type: ignore[arg-type]
    path = ride / "written" / f"{part}.{format}"
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes(b"\x93 not this" if damage == "garbage" else b"")
    assert call(["estimate", "written", "--estimator", "DesignAngles", "--out", "out"]) == BAD_INPUT
    assert path.name in capsys.readouterr().err


def test_no_sound_ride_is_called_implausible(ride: Path) -> None:
    """Limits are far from what happens: 40 mg of bias, a gyro of 2 deg/s, a coarse place on the track."""
    recording = read_ride(ride / TOML)
    imu = recording.imu.copy()
    imu["accel_z_mps2"] += 0.4
    imu[["gyro_x_radps", "gyro_z_radps"]] += 0.035
    odometry = recording.odometry.assign(position_m=recording.odometry["position_m"] + 10.0)
    check_plausible(replace(recording, imu=imu, odometry=odometry))
