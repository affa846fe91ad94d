"""Faulty scenarios: each gives one message that names file, field, value, limit and remedy, and code 2."""

from __future__ import annotations

import copy
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from simrail.cli import BAD_INPUT, call
from simrail.errors import InputError
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.files import judge, shipped
from simrail.scenario.scenario import Scenario, ScenarioFile, load_scenario

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")

# name: (text of the good scenario, what stands there instead, parts of the message)
FAULTS: dict[str, tuple[str, str, list[str]]] = {
    "unknown key": (
        "speed_kmh = 50.0",
        "speed_kph = 50.0",
        ["ride[0].speed_kph", "unknown key", "50.0", "speed_kmh?"],
    ),
    "unknown table": ("[encoder]", "[encodr]", ["encodr", "unknown key", "encoder?"]),
    "missing key": ("seed = 1\n", "", ["seed", "is required", "add it"]),
    "text for a number": (
        "speed_kmh = 50.0",
        'speed_kmh = "50 km/h"',
        ["ride[0].speed_kmh", "type", "'50 km/h'", "a number", "unit"],
    ),
    "number in quotes": (
        "speed_kmh = 50.0",
        'speed_kmh = "50"',
        ["ride[0].speed_kmh", "'50'", "without quotes"],
    ),
    "true for a number": ("speed_kmh = 50.0", "speed_kmh = true", ["ride[0].speed_kmh", "True", "a number"]),
    "number for text": ('name = "out"', "name = 3", ["ride[0].name", "3", "text", "quotes"]),
    "not a number": (
        "speed_kmh = 50.0",
        "speed_kmh = nan",
        ["ride[0].speed_kmh", "nan", "finite", "replace NaN"],
    ),
    "infinite": ("start_m = 10.0", "start_m = -inf", ["ride[0].start_m", "finite"]),
    "zero speed": ("speed_kmh = 50.0", "speed_kmh = 0.0", ["ride[0].speed_kmh", "0.0", "> 0", "unit"]),
    "metres per second that are too many": (
        "speed_kmh = 50.0",
        "speed_kmh = 4000.0",
        ["ride[0].speed_kmh", "4000.0", "<= 400"],
    ),
    "one bad value in a list": (
        "speed_kmh = 50.0",
        "speed_kmh = [50.0, -1.0]",
        ["ride[0].speed_kmh", "-1.0", "> 0"],
    ),
    "an empty list": ("speed_kmh = 50.0", "speed_kmh = []", ["ride[0].speed_kmh", "empty", "at least one"]),
    "a value twice in a list": (
        "speed_kmh = 50.0",
        "speed_kmh = [50.0, 50.0]",
        ["ride[0].speed_kmh", "twice"],
    ),
    "a negative seed": ("seed = 1", "seed = -1", ["seed", "-1", ">= 0"]),
    "a broken seed": ("seed = 1", "seed = 1.5", ["seed", "1.5", "whole number"]),
    "no draws": ("sensor_draws = 2", "sensor_draws = 0", ["sensor_draws", "0", ">= 1"]),
    "too many cells": (
        "sensor_draws = 2",
        "sensor_draws = 1000000\ntrack_draws = 1000",
        ["too many cells", "2000000000", "1000000", "draws"],
    ),
    "an engine that is none": (
        'engine = "kinematic"',
        'engine = "kinematik"',
        ["engine", "'kinematik'", "'exudyn', 'compiled' or 'kinematic'", "did you mean kinematic?"],
    ),
    "a step that does not divide": (
        "sensor_draws = 2",
        "step_s = 0.0007",
        ["step_s", "0.0007", "divide", "0.0005"],
    ),
    "a track that is not shipped": (
        'track = "smooth_curve"',
        'track = "smooth_curves"',
        ["track", "'smooth_curves'", "smooth_curve", "simrail list"],
    ),
    "a track file that is missing": (
        'track = "smooth_curve"',
        'track = "other.toml"',
        ["track", "no such file", "'other.toml'", "smooth_curve", "path"],
    ),
    "a vehicle that is not shipped": (
        'vehicle = "metro_irw_bogie"',
        'vehicle = "metro"',
        ["vehicle", "'metro'", "metro_irw_bogie", "simrail list"],
    ),
    "a grade that is not shipped": (
        '"ideal"]',
        '"idael"]',
        ["imu[0].grade", "'idael'", "ideal", "simrail list"],
    ),
    "a spectrum that is none": (
        'spectrum = "erri_b176_low"',
        'spectrum = "erri"',
        ["irregularity.spectrum", "'erri'", "erri_b176_low"],
    ),
    "wavelengths in the wrong order": (
        "wavelengths_m = [1.5, 100.0]",
        "wavelengths_m = [100.0, 1.5]",
        ["irregularity.wavelengths_m", "100.0, 1.5", "shortest, longest"],
    ),
    "one wavelength": (
        "wavelengths_m = [1.5, 100.0]",
        "wavelengths_m = [1.5]",
        ["irregularity.wavelengths_m"],
    ),
    "waves too short for the track's table": (
        "wavelengths_m = [1.5, 100.0]",
        "wavelengths_m = [0.2, 100.0]",
        ["irregularity.wavelengths_m", "0.2", "0.25 <= shortest"],
    ),
    "a fade longer than the track": (
        "fade_m = 40.0",
        "fade_m = 400.0",
        ["irregularity.fade_m", "400", "shorten fade_m"],
    ),
    "a ride beyond the track": (
        "end_m = 590.0",
        "end_m = 700.0",
        ["ride[0].end_m", "not on track", "700.0", "599.1 m", "shorten the ride or lengthen the track"],
    ),
    "a ride before the track": ("start_m = 10.0", "start_m = 0.5", ["ride[0].start_m", "0.5", "0.9 to"]),
    "a ride of no length": ("end_m = 590.0", "end_m = 10.0", ["ride[0].end_m", "10.0", "backward"]),
    "a ride that takes hours": (
        "speed_kmh = 50.0",
        "speed_kmh = 0.1",
        ["ride[0].speed_kmh", "0.1", "7200 s", "faster"],
    ),
    "a stop off the way": (
        "final_rest_s = 2.0",
        "stops = [{ position_m = 595.0, dwell_s = 5.0 }]",
        ["ride[0].stops[0].position_m", "595.0", "between 10 and 590 m", "move the stop"],
    ),
    "stops in the wrong order": (
        "final_rest_s = 2.0",
        "stops = [{ position_m = 300.0, dwell_s = 5.0 }, { position_m = 200.0, dwell_s = 5.0 }]",
        ["ride[0].stops", "200.0", "order"],
    ),
    "a stop with a typing error": (
        "final_rest_s = 2.0",
        "stops = [{ position_m = 300.0, dwel_s = 5.0 }]",
        ["ride[0].stops[0].dwel_s", "unknown key", "did you mean dwell_s?"],
    ),
    "a negative dwell": (
        "final_rest_s = 2.0",
        "stops = [{ position_m = 300.0, dwell_s = -5.0 }]",
        ["ride[0].stops[0].dwell_s", "-5.0", ">= 0"],
    ),
    "a speed that the curve cannot hold": (
        "speed_kmh = 50.0",
        "speed_kmh = 90.0\nacceleration_mps2 = 2.5\njerk_mps3 = 5.0",
        ["ride[0].speed_kmh", "cannot hold", "90.0", "1.5 m/s2", "curve 3 R300", "ride at most at 88 km/h"],
    ),
    "a body that the vehicle lacks": (
        'body = "front"',
        'body = "bogie"',
        ["imu[0].body", "'bogie'", "front, rear, frame, body"],
    ),
    "a wheel that the vehicle lacks": (
        'wheel = "front.left"',
        'wheel = "left"',
        ["encoder.wheel", "'left'", "front.left"],
    ),
    "an IMU in millimetres": (
        "position_m = [0.0, 0.0, 0.6]",
        "position_m = [0.0, 0.0, 600.0]",
        ["imu[0].position_m", "600.0", "metres"],
    ),
    "an IMU with two coordinates": (
        "position_m = [0.0, 0.0, 0.6]",
        "position_m = [0.0, 0.6]",
        ["imu[0].position_m"],
    ),
    "an IMU beyond the track": (
        "position_m = [0.0, 0.0, 0.6]",
        "position_m = [-12.0, 0.0, 0.6]",
        ["imu[0].position_m", "-1.1 m", "0 to 600 m", "lengthen the track"],
    ),
    "an encoder without pulses": (
        "pulses_per_revolution = 1024",
        "pulses_per_revolution = 0",
        ["encoder.pulses_per_revolution", "0", ">= 1"],
    ),
    "an encoder rate that does not divide": (
        "radius_error_sd = 0.001",
        "rate_hz = 300.0",
        ["encoder", "300"],
    ),
    "an edge off by more than its pulse": (
        "radius_error_sd = 0.001",
        "edge_jitter_sd = 5.0",
        ["encoder.edge_jitter_sd", "5.0", "<= 0.5"],
    ),
    "a negative rate of missed pulses": (
        "radius_error_sd = 0.001",
        "missed_rate = -1e-5",
        ["encoder.missed_rate", "-1e-05", ">= 0"],
    ),
    "a slip faster than a locked wheel": (
        "radius_error_sd = 0.001",
        "[[encoder.slip]]\nstart_s = 15.0\nduration_s = 2.0\ncreepage = -1.5",
        ["encoder.slip[0].creepage", "-1.5", ">= -1"],
    ),
    "a slip that only ramps": (
        "radius_error_sd = 0.001",
        "[[encoder.slip]]\nstart_s = 15.0\nduration_s = 2.0\ncreepage = -0.1\nramp_s = 1.5",
        ["encoder.slip[0]", "ramp_s = 1.5", "half of duration_s = 2"],
    ),
    "a slip after the ride": (
        "radius_error_sd = 0.001",
        "[[encoder.slip]]\nstart_s = 500.0\nduration_s = 2.0\ncreepage = -0.1",
        ["encoder.slip[0].start_s", "500.0", "end of ride out", "< 78"],
    ),
    "a slip with a typing error": (
        "radius_error_sd = 0.001",
        "[[encoder.slip]]\nstart_s = 15.0\nduration_s = 2.0\ncrepage = -0.1",
        ["encoder.slip[0].crepage", "unknown key", "creepage?"],
    ),
    "a field in tesla": (
        "[encoder]",
        "[magnetometer]\nintensity_ut = 0.0\n\n[encoder]",
        ["magnetometer.intensity_ut", "0.0", "> 0"],
    ),
    "a field in nanotesla": (
        "[encoder]",
        "[magnetometer]\nintensity_ut = 45000.0\n\n[encoder]",
        ["magnetometer.intensity_ut", "45000.0", "< 100"],
    ),
    "a supply that is none": (
        "[encoder]",
        '[magnetometer.traction]\nsupply = "overhead"\n\n[encoder]',
        ["magnetometer.traction.supply", "'overhead'", "catenary"],
    ),
    "steel in the vehicle's way": (
        "[encoder]",
        "[magnetometer.steel]\nbeside_m = [0.5, 3.0]\n\n[encoder]",
        ["magnetometer.steel", "beside_m", "0.5", "1.5 m"],
    ),
    "iron that turns the field inside out": (
        "[encoder]",
        "[magnetometer.iron]\nsoft_iron = [[-2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]\n\n[encoder]",
        ["magnetometer.soft_iron", "-2.0"],
    ),
    "a magnetometer with a typing error": (
        "[encoder]",
        "[magnetometer]\ninclination = 55.0\n\n[encoder]",
        ["magnetometer.inclination", "unknown key", "inclination_deg?"],
    ),
    "a rail sensor in metres": (
        "[encoder]",
        "[rail_sensor]\nrail_base_mm = 1.5\n\n[encoder]",
        ["rail_sensor.rail_base_mm", "1.5", ">= 50"],
    ),
    "a rail sensor with more outliers than values": (
        "[encoder]",
        "[rail_sensor]\noutlier_fraction = 1.0\n\n[encoder]",
        ["rail_sensor.outlier_fraction", "1.0", "<= 0.2"],
    ),
    "a band that is none": (
        "[encoder]",
        '[geometry]\nbands = ["D4"]\n\n[encoder]',
        ["geometry.bands", "'D4'", "'D3'"],
    ),
    "an own band with the name of another": (
        "[encoder]",
        "[geometry.own_bands]\nD1 = [3.0, 30.0]\n\n[encoder]",
        ["geometry.own_bands", "D1", "taken"],
    ),
    "a band from long to short": (
        "[encoder]",
        "[geometry.own_bands]\npaper = [7.0, 0.3]\n\n[encoder]",
        ["geometry.own_bands", "paper", "[7.0, 0.3]"],
    ),
    "a twist over nothing": (
        "[encoder]",
        "[geometry]\ntwist_base_m = 0.0\n\n[encoder]",
        ["geometry.twist_base_m", "0.0", "> 0"],
    ),
    "two rides of one name": (
        "[[imu]]",
        '[[ride]]\nname = "out"\nstart_m = 590.0\nend_m = 10.0\nspeed_kmh = 50.0\n\n[[imu]]',
        ["ride", "'out'", "a name of its own"],
    ),
    "two estimators of one name": (
        'name = "ekf_uncompensated"',
        'name = "ekf_compensated"',
        ["estimator", "'ekf_compensated'", "a name of its own"],
    ),
    "a name with a slash": ('name = "out"', 'name = "../out"', ["ride[0].name", "'../out'"]),
    "an estimator that is none": (
        'method = "DesignAngles"',
        'method = "DesignAngle"',
        [
            "estimator[2].method",
            "'DesignAngle'",
            "AttitudeEkf, AttitudeGda, CurveMatchedOdometry, DesignAngles",
        ],
    ),
    "an estimator file that is missing": (
        'method = "DesignAngles"',
        'method = "mine.py:Mine"',
        ["estimator[2].method", "'mine.py'", "no such file", "mend the path"],
    ),
    "an option that the estimator lacks": (
        "compensated = true",
        "compensate = true",
        [
            "estimator[0].options.compensate",
            "no such option",
            "True",
            "rest_bias",
            "did you mean compensated?",
        ],
    ),
    "an option of the wrong type": (
        "compensated = true",
        'compensated = "yes"',
        ["estimator[0].options.compensated", "'yes'", "boolean"],
    ),
    "one bad option in a list": (
        "compensated = true",
        "compensated = [true, 3]",
        ["estimator[0].options.compensated", "3", "boolean"],
    ),
    "a window that is none": (
        "[encoder]",
        '[score]\nwindows = ["curves"]\n\n[encoder]',
        ["score.windows[0]", "'curves'", "whole, cropped"],
    ),
    "a metric that is none": (
        "[encoder]",
        '[score]\nmetrics = ["rms", "mse"]\n\n[encoder]',
        ["score.metrics[1]", "'mse'", "rms, mean"],
    ),
    "broken TOML": ("[[imu]]", "[[imu]", ["not valid TOML", "line 23", "quotes"]),
    "a key twice": ("seed = 1", "seed = 1\nseed = 2", ["not valid TOML"]),
    "a table where a list belongs": ("[[ride]]", "[ride]", ["ride", "array of tables"]),
    "no rides": ("[[ride]]", "[[rides]]", ["rides", "unknown key", "did you mean ride?"]),
}


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    former = tmp_path / "results" / "mine"
    former.mkdir(parents=True)
    (former / "manifest.json").write_text("{}")
    return tmp_path


def message_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Message of a command that must end with code 2; it is one line, without a traceback."""
    assert call(arguments) == BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1 and captured.err.startswith("simrail: ")
    return captured.err


def test_the_good_scenario_is_good(place: Path) -> None:
    (place / "mine.toml").write_text(GOOD)
    assert call(["check", "mine.toml"]) == 0


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_told_and_nothing_is_written(
    fault: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new, parts = FAULTS[fault]
    assert old in GOOD
    (place / "mine.toml").write_text(GOOD.replace(old, new, 1))
    before = sorted(path.relative_to(place) for path in place.rglob("*"))
    for command in ("check", "run"):
        text = message_of([command, "mine.toml"], capsys)
        assert "mine.toml" in text
        for part in parts:
            assert part in text, text
    assert sorted(path.relative_to(place) for path in place.rglob("*")) == before


LEAVES = shipped("scenario")["leaves"].read_text(encoding="utf-8")

WHEEL_FAULTS: dict[str, tuple[str, str, list[str]]] = {
    "a driver that is none": ('drive = "wheels"', 'drive = "wheel"', ["ride[0].drive", "'wheel'", "guide"]),
    "wheels of a vehicle without traction": (
        'vehicle = "metro_irw_bogie"',
        'vehicle = "irw_car"',
        ["ride[0].drive", "no [traction]", "irw_car", "give the vehicle file a [traction]"],
    ),
    "wheels of a body that follows the rails": (
        'engine = "compiled"',
        'engine = "kinematic"',
        ["ride[0].drive", "no forces", "compiled or exudyn"],
    ),
    "a condition that is none": (
        'condition = "leaves"',
        'condition = "snow"',
        ["rail_condition[0].condition", "'snow'", "'dry', 'wet' or 'leaves'"],
    ),
    "no friction": ('condition = "leaves"', "friction = 0.0", ["rail_condition[0].friction", "0.0", "> 0"]),
    "friction of glue": ('condition = "leaves"', "friction = 3.0", ["rail_condition[0].friction", "<= 1"]),
    "a condition and a friction": (
        'condition = "leaves"',
        'condition = "leaves"\nfriction = 0.1',
        ["rail_condition[0].condition", "either", "leaves, friction 0.1"],
    ),
    "neither condition nor friction": (
        'condition = "leaves"\n',
        "",
        ["rail_condition[0].condition", "either", "friction = 0.05"],
    ),
    "a rail that is none": (
        'condition = "leaves"',
        'condition = "leaves"\nrails = "third"',
        ["rail_condition[0].rails", "'third'", "'left' or 'right'"],
    ),
    "leaves on leaves": (
        "start_m = 230.0",
        "start_m = 85.0",
        ["rail_condition[1].start_m", "85.0", "60 to 90 m", "at once"],
    ),
    "leaves off the track": ("end_m = 270.0", "end_m = 2700.0", ["rail_condition[1].end_m", "0 to 2000 m"]),
    "leaves that end before they start": (
        "end_m = 270.0",
        "end_m = 200.0",
        ["rail_condition[1].end_m", "200.0", ">= start_m + 8 m"],
    ),
}


@pytest.mark.parametrize("fault", WHEEL_FAULTS)
def test_fault_of_wheels_and_rails(fault: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, parts = WHEEL_FAULTS[fault]
    assert old in LEAVES
    (place / "mine.toml").write_text(LEAVES.replace(old, new, 1))
    before = sorted(place.rglob("*"))
    text = message_of(["check", "mine.toml"], capsys)
    for part in ("mine.toml", *parts):
        assert part in text, text
    assert sorted(place.rglob("*")) == before


def test_leaves_under_a_kinematic_ride(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = LEAVES.replace('drive = "wheels"\n', "").replace('"compiled"', '"kinematic"')
    (place / "mine.toml").write_text(text)
    message = message_of(["check", "mine.toml"], capsys)
    assert "mine.toml: rail_condition: " in message
    assert "does not feel their friction" in message


PART_FAULTS: dict[str, tuple[str, str, str, str, list[str]]] = {
    "a negative mass": (
        "vehicle",
        "metro_irw_bogie",
        "mass_kg = 2000.0",
        "mass_kg = -2000.0",
        ["body[0].mass_kg", "-2000.0", "> 0", "unit"],
    ),
    "an inertia that no body has": (
        "vehicle",
        "metro_irw_bogie",
        "inertia_kgm2 = [900.0, 1100.0, 1900.0]",
        "inertia_kgm2 = [100.0, 100.0, 1900.0]",
        ["body[0].inertia_kgm2", "1900.0", "sum of the other two"],
    ),
    "a spring to nowhere": (
        "vehicle",
        "metro_irw_bogie",
        'between = ["front", "frame"]',
        'between = ["front", "fram"]',
        ["suspension[0].between", "'fram'", "one of front, rear, frame, body"],
    ),
    "a wheel radius in millimetres": (
        "vehicle",
        "metro_irw_bogie",
        "wheel_radius_m = 0.29",
        "wheel_radius_m = 290.0",
        ["axle[0].wheel_radius_m", "290.0", "<= 1", "unit"],
    ),
    "a curve without a transition": (
        "track",
        "smooth_curve",
        '[[segment]]\nkind = "transition"\nlength_m = 60.0\n\n[[segment]]\nkind = "curve"',
        '[[segment]]\nkind = "curve"',
        ["segment"],
    ),
    "a negative length": (
        "track",
        "smooth_curve",
        "length_m = 180.0",
        "length_m = -180.0",
        ["segment[2]", "length_m", "-180.0", "> 0"],
    ),
    "a kind of segment that is none": (
        "track",
        "smooth_curve",
        'kind = "curve"',
        'kind = "bend"',
        ["segment[2]", "bend", "curve"],
    ),
    "a noise that is negative": (
        "imu",
        "lord_3dm_gx4_25",
        "gyro_noise_degpsqrthz = ",
        "gyro_noise_degpsqrthz = -",
        ["gyro_noise_degpsqrthz", ">= 0"],
    ),
    "an IMU rate that does not divide": (
        "imu",
        "lord_3dm_gx4_25",
        "rate_hz = 250",
        "rate_hz = 333",
        ["333"],
    ),
}


@pytest.mark.parametrize("fault", PART_FAULTS)
def test_fault_in_a_part(fault: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kind, name, old, new, parts = PART_FAULTS[fault]
    text = shipped(kind)[name].read_text(encoding="utf-8")
    assert old in text
    (place / "part.toml").write_text(text.replace(old, new, 1))
    (place / "mine.toml").write_text(GOOD.replace(f'"{name}"', '"part.toml"', 1))
    told = message_of(["check", "mine.toml"], capsys)
    assert ".toml" in told
    for part in parts:
        assert part in told, told


@pytest.mark.parametrize(
    ("setting", "parts"),
    [
        ("ride.speed_kmh", ["--set", "key=value", "e.g."]),
        ("=3", ["--set", "key=value"]),
        ("ride[3].speed_kmh=20", ["ride[3].speed_kmh", "no such item", "0 to 0"]),
        ("ride.speed_kmph=20", ["ride[0].speed_kmph", "unknown key", "speed_kmh?"]),
        ("rid.speed_kmh=20", ["rid.speed_kmh", "did you mean ride?"]),
        ("ride=3", ["ride", "array of tables"]),
        ("ride[0]=3", ["ride[0]", "whole table"]),
        ("title.name=3", ["title.name", "no table"]),
        ("wheel[0].x=3", ["wheel[0].x", "no such array"]),
        ("ride..speed_kmh=3", ["dotted path"]),
        ("ride.speed_kmh=fast", ["ride[0].speed_kmh", "'fast'", "a number"]),
        ("imu.axle.grade=best", ["imu[0].grade", "'best'", "ideal"]),
    ],
)
def test_bad_setting(setting: str, parts: list[str], place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "mine.toml").write_text(GOOD)
    text = message_of(["check", "mine.toml", "--set", setting], capsys)
    for part in parts:
        assert part in text, text


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["run", "nowhere"], "no scenario of this name"),
        (["run", "nowhere.toml"], "no such file"),
        (["run", "go20"], "go20a"),
        (["run", "results"], "no scenario of this name"),
        (["run", "./results"], "no such file"),
        (["run", "mine.toml", "--out", "mine.toml"], "this is a file"),
        (["run", "mine.toml", "--out", "full"], "holds other things"),
        (["run", "mine.toml", "--out", "mine.toml/below"], "cannot be written"),
        (["new", "estimator", "my filter"], "no name for a file"),
        (["new", "estimator", "mine", "--in", "nowhere"], "no such folder"),
        (["new", "locomotive", "mine"], "no template of this kind"),
    ],
)
def test_bad_argument(
    arguments: list[str], part: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (place / "mine.toml").write_text(GOOD)
    (place / "full").mkdir()
    (place / "full" / "thesis.tex").write_text("years of work")
    assert part in message_of(arguments, capsys)
    assert (place / "full" / "thesis.tex").read_text() == "years of work"


@pytest.mark.parametrize("content", [b"title = \xff\xfe", b"\x00" * 64])
def test_not_text(content: bytes, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "mine.toml").write_bytes(content)
    assert "mine.toml" in message_of(["check", "mine.toml"], capsys)


def test_usage_errors_are_bad_input_too(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (
        ["rum"],
        ["run"],
        ["run", "x", "--seed", "one"],
        ["run", "x", "--seed", "-1"],
        ["--wrong"],
    ):
        assert call(arguments) == BAD_INPUT
        assert "Traceback" not in capsys.readouterr().err


def test_own_estimator_that_cannot_be_imported(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (place / "mine.toml").write_text(GOOD.replace('"DesignAngles"', '"mine.py:Mine"'))
    (place / "mine.py").write_text("import no_such_package\n")
    assert "cannot be imported: ModuleNotFoundError" in message_of(["check", "mine.toml"], capsys)
    (place / "mine.py").write_text("class Other:\n    pass\n")
    assert "no such estimator class; found 'Mine'" in message_of(["check", "mine.toml"], capsys)


def test_as_a_process(place: Path) -> None:
    (place / "mine.toml").write_text(GOOD.replace("speed_kmh = 50.0", "speed_kmh = -50.0"))
    done = subprocess.run(
        [sys.executable, "-m", "simrail.cli", "run", "mine.toml"], capture_output=True, text=True, cwd=place
    )
    assert done.returncode == BAD_INPUT
    assert done.stdout == "" and done.stderr.count("\n") == 1
    assert "ride[0].speed_kmh" in done.stderr


# Whatever a scenario holds, reading and judging it ends well or with an InputError.

SHORT = GOOD.replace("end_m = 590.0", "end_m = 60.0").replace("rest_s = 10.0", "rest_s = 1.0")

odd_values = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(allow_nan=True, allow_infinity=True),
    st.text(max_size=8),
    st.sampled_from(
        ["ideal", "front", "exudyn", "smooth_curve", "none", "truth", "../..", "", "a.toml", "x.py:Y", "\0"]
    ),
    st.lists(st.one_of(st.integers(-3, 3), st.floats(), st.text(max_size=3)), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(-3, 3), max_size=2),
)


def _paths(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path] if path else []
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        found += _paths(value, (*path, key))
    return found


@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_scenario_is_judged(data: st.DataObject) -> None:
    content = copy.deepcopy(tomllib.loads(SHORT))
    for _ in range(data.draw(st.integers(1, 3))):
        paths = _paths(content)
        if not paths:
            break
        *way, last = data.draw(st.sampled_from(paths))
        holder = content
        for step in way:
            holder = holder[step]
        action = data.draw(st.sampled_from(["delete", "replace", "swap", "add"]))
        if action == "delete":
            del holder[last]
        elif action == "replace":
            holder[last] = data.draw(odd_values)
        elif action == "swap":
            holder[last] = copy.deepcopy(_at(content, data.draw(st.sampled_from(paths))))
        elif isinstance(holder[last], dict):
            holder[last][data.draw(st.text(max_size=6))] = data.draw(odd_values)
    try:
        spec = judge(ScenarioFile, content, file="mine.toml")
        judge_scenario(Scenario("mine", "mine.toml", None, "", (), spec))
    except InputError as error:
        assert "mine.toml" in str(error) or "scenarios/" in str(error)


def _at(content: Any, path: tuple[Any, ...]) -> Any:
    for step in path:
        content = content[step]
    return content


def test_no_cell_of_a_good_scenario_holds_a_list() -> None:
    scenario = load_scenario(
        "quick_kinematic", overrides=["ride.speed_kmh=[20, 50]", "odometry=['encoder','truth']"]
    )
    for cell in cells(scenario):
        for value in (*cell.ride.model_dump().values(), cell.imu.grade, cell.spec.odometry, cell.spec.track):
            assert not isinstance(value, list)
            assert isinstance(value, (str, int, float, bool, tuple))
