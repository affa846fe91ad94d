"""Faulty scenarios: each gives one message that names file, field, value, limit and remedy, and code 2."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.cli.main import call
from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")


def _stop(**changes: object) -> str:
    """A stop rule, with changes; it is put before the table ``[encoder]``."""
    rule: dict[str, object] = {"estimator": "ekf_compensated", "quantity": "roll", "metric": "rms"}
    rule |= {"width": 0.1, "least_draws": 2} | changes
    lines = [f"{key} = {value!r}" for key, value in rule.items() if value is not None]
    return "\n".join(["[stop]", *lines, "", "[encoder]"])


def _require(**changes: object) -> str:
    """A requirement, with changes; it is put before the table ``[encoder]``."""
    wanted: dict[str, object] = {"quantity": "roll", "limit": "0.1 deg"} | changes
    lines = [f"{key} = {value!r}" for key, value in wanted.items()]
    return "\n".join(["[[require]]", *lines, "", "[encoder]"])


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
    "a normal distribution without bounds": (
        "speed_kmh = 50.0",
        "speed_kmh = { normal = [50.0, 5.0] }",
        ["ride[0].speed_kmh.normal", "without bounds", "[50.0, 5.0]", "[lowest, highest]", "add bounds"],
    ),
    "an infinite bound": (
        "speed_kmh = 50.0",
        "speed_kmh = { uniform = [20.0, inf] }",
        ["ride[0].speed_kmh.uniform", "finite", "inf"],
    ),
    "bounds in the wrong order": (
        "speed_kmh = 50.0",
        "speed_kmh = { uniform = [70.0, 20.0] }",
        ["ride[0].speed_kmh.uniform", "[70.0, 20.0]", "smaller bound first"],
    ),
    "draws that the field cannot have": (
        "speed_kmh = 50.0",
        "speed_kmh = { normal = [50.0, 20.0], bounds = [-5.0, 90.0] }",
        ["ride[0].speed_kmh", "-5.0", "> 0"],
    ),
    "a mean far from the bounds": (
        "speed_kmh = 50.0",
        "speed_kmh = { normal = [50.0, 1.0], bounds = [70.0, 90.0] }",
        ["ride[0].speed_kmh.bounds", "[70.0, 90.0]", "1 %", "move the mean"],
    ),
    "a standard deviation of nothing": (
        "speed_kmh = 50.0",
        "speed_kmh = { normal = [50.0, 0.0], bounds = [40.0, 60.0] }",
        ["ride[0].speed_kmh.normal", "0.0", "> 0"],
    ),
    "a logarithm of nothing": (
        "speed_kmh = 50.0",
        "speed_kmh = { log_uniform = [0.0, 60.0] }",
        ["ride[0].speed_kmh.log_uniform", "[0.0, 60.0]", "> 0", "take uniform"],
    ),
    "an empty choice": (
        "speed_kmh = 50.0",
        "speed_kmh = { choice = [] }",
        ["ride[0].speed_kmh.choice", "empty", "at least one"],
    ),
    "a wrong item in a choice": (
        'grade = ["lord_3dm_gx4_25", "ideal"]',
        'grade = { choice = ["ideal", 3] }',
        ["imu[0].grade", "3", "text"],
    ),
    "a part of an impulse": (
        "pulses_per_revolution = 1024",
        "pulses_per_revolution = { uniform = [512, 1024] }",
        ["encoder.pulses_per_revolution", "a whole number"],
    ),
    "a distribution that is none": (
        "speed_kmh = 50.0",
        "speed_kmh = { gamma = [1.0, 2.0] }",
        ["ride[0].speed_kmh", "is no distribution", "gamma", "uniform", "one of these"],
    ),
    "an option without bounds": (
        "compensated = true",
        "compensated = true\ndoubt = { normal = [5.0, 1.0] }",
        ["estimator[0].options.doubt", "without bounds", "add bounds"],
    ),
    "an option drawn outside its range": (
        "compensated = true",
        "compensated = { choice = [true, 3] }",
        ["estimator[0].options.compensated", "3", "boolean"],
    ),
    "an odd number of Sobol points": (
        "sensor_draws = 2",
        'samples = 12\nmethod = "sobol"',
        ["monte_carlo.samples", "12", "powers of two", "take 16"],
    ),
    "a design that is none": (
        "sensor_draws = 2",
        'samples = 12\nmethod = "halton"',
        ["monte_carlo.method", "'halton'", "'sobol', 'morris' or 'saltelli'"],
    ),
    "a standstill the other way": (
        "end_m = 590.0\nspeed_kmh = 50.0",
        "reverse = true",
        ["ride[0]", "cannot be reversed"],
    ),
    "a negative seed": ("seed = 1", "seed = -1", ["seed", "-1", ">= 0"]),
    "a broken seed": ("seed = 1", "seed = 1.5", ["seed", "1.5", "whole number"]),
    "no draws": ("sensor_draws = 2", "sensor_draws = 0", ["monte_carlo.sensor_draws", "0", ">= 1"]),
    "too many cells": (
        "sensor_draws = 2",
        "sensor_draws = 1000000\ntrack_draws = 1000",
        ["too many cells", "2000000000", "1000000", "draws", "--yes"],
    ),
    "an engine that is none": (
        'engine = "kinematic"',
        'engine = "kinematik"',
        ["engine", "'kinematik'", "'exudyn', 'compiled' or 'kinematic'", "did you mean kinematic?"],
    ),
    "a step that does not divide": (
        'engine = "kinematic"',
        'engine = "kinematic"\nstep_s = 0.0007',
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
        ["imu[0].position_m[2]", "600.0", "<= 50.0", "mind the unit"],
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
            "AttitudeEkf, AttitudeGda, BogieDelayOdometry, ComplementaryFilter",
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
    "an option that went": (
        "compensated = true",
        'backend = "filterpy"',
        [
            "estimator[0].options.backend",
            "no such option",
            "'filterpy'",
            "one of accel_sd_mps2",
            "remove it: kernels alone run; their filterpy twins are in the tests",
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
    "an estimator without its sensor": (
        'method = "DesignAngles"',
        'method = "Vqf"\n[estimator.options]\nmagnetometer = [false, true]',
        ["estimator[2].options.magnetometer", "no magnetometer", "True", "add a [magnetometer]", "= false"],
    ),
    "an estimator of the odometry without a wheel": (
        '[encoder]\nwheel = "front.left"\npulses_per_revolution = 1024\nradius_error_sd = 0.001\n',
        '[[estimator]]\nname = "way"\nmethod = "EncoderOdometry"\n',
        ["estimator[0].method", "no encoder", "'EncoderOdometry'", "add a [encoder]", "remove this"],
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
    "a stop rule for an estimator that is none": (
        "[encoder]",
        _stop(estimator="ekf"),
        ["stop.estimator", "'ekf'", "ekf_compensated, ekf_uncompensated, design_angles", "name one"],
    ),
    "a stop rule for a quantity that is none": (
        "[encoder]",
        _stop(quantity="rol"),
        ["stop.quantity", "'rol'", "roll, pitch", "name one"],
    ),
    "a stop rule for a metric that is none": (
        "[encoder]",
        _stop(metric="mse"),
        ["stop.metric", "'mse'", "rms, mean", "name one"],
    ),
    "a stop rule for the time that it takes": (
        "[encoder]",
        _stop(metric="us_per_sample"),
        ["stop.metric", "'us_per_sample'", "one of rms", "coverage95; remedy"],
    ),
    "a stop rule for a metric that is not kept": (
        "[encoder]",
        '[score]\nmetrics = ["sd"]\n\n' + _stop(),
        ["stop.metric", "'rms'", "one of sd;", "keep another in [score]"],
    ),
    "a stop rule for a window that is not kept": (
        "[encoder]",
        '[score]\nwindows = ["curve", "curve:*"]\n\n' + _stop(),
        ["stop.window", "'whole'", "curve", "keep another in [score]"],
    ),
    "a stop rule for a band that is none": (
        "[encoder]",
        _stop(band="D4"),
        ["stop.band", "'D4'", "full, D0", "name one"],
    ),
    "a stop rule for no width": (
        "[encoder]",
        _stop(width=0.0),
        ["stop.width", "0.0", "> 0"],
    ),
    "a stop rule that looks at one draw": (
        "[encoder]",
        _stop(least_draws=1),
        ["stop.least_draws", "1", ">= 2"],
    ),
    "a stop rule that wants more draws than there are": (
        "[encoder]",
        _stop(least_draws=3),
        ["stop.least_draws", "3", "2 to 2", "draws of the sensors", "raise"],
    ),
    "a stop rule with one draw": (
        "sensor_draws = 2\n",
        "sensor_draws = 1\n\n" + _stop().replace("[encoder]", ""),
        ["stop.least_draws", "2", "at least 2 draws, this scenario has 1", "raise"],
    ),
    "a stop rule without a width": (
        "[encoder]",
        _stop(width=None),
        ["stop.width", "is missing", "verdicts = true", "add width"],
    ),
    "a step of a picosecond": (
        'engine = "kinematic"',
        'engine = "kinematic"\nstep_s = 1e-12',
        ["step_s", "1e-12", ">= 1e-06"],
    ),
    "verdicts without a requirement": (
        "[encoder]",
        "[stop]\nverdicts = true\nleast_draws = 2\n\n[encoder]",
        ["stop.verdicts", "no verdict to stop at", "add a [[require]]"],
    ),
    "a stop rule for verdicts and for a width": (
        "[encoder]",
        _stop(verdicts="true").replace("'true'", "true"),
        ["stop.estimator", "verdicts have none", "take out estimator, or verdicts"],
    ),
    "a requirement on nothing that is scored": (
        "[encoder]",
        _require(quantity="rol"),
        ["require[0].quantity", "'rol'", "one of roll"],
    ),
    "a requirement in a unit of another kind": (
        "[encoder]",
        _require(limit="0.1 mm"),
        ["require[0].limit", "unit of length; roll is measured in deg", "'0.1 mm'", "mrad", "give it in deg"],
    ),
    "a requirement on more than all devices": (
        "[encoder]",
        _require(share=1.2),
        ["require[0].share", "1.2", "< 1"],
    ),
    "a requirement in a window that the track has not": (
        "[encoder]",
        _require(window="curve:curve 99 R1"),
        ["require[0].window", "no part of this ride", "curve 99 R1", "straight"],
    ),
    "a requirement in a band beyond the ride": (
        "[encoder]",
        _require(quantity="alignment", band="D3", limit="1 mm"),
        ["require[0].band", "D3", "too short", "waves to 200 m"],
    ),
    "a requirement in a band of what has none": (
        "[encoder]",
        _require(band="D1"),
        ["require[0].band", "D1", "roll has not", "alignment"],
    ),
    "a requirement on a metric that is not kept": (
        "[encoder]",
        '[score]\nmetrics = ["sd"]\n\n' + _require(),
        ["require[0].metric", "not kept", "'rms'", "sd"],
    ),
    "broken TOML": ("[[imu]]", "[[imu]", ["not valid TOML", "line 29", "quotes"]),
    "a key twice": ("seed = 1", "seed = 1\nseed = 2", ["not valid TOML"]),
    "a table where a list belongs": ("[[ride]]", "[ride]", ["ride", "array of tables"]),
    "no rides": ("[[ride]]", "[[rides]]", ["rides", "unknown key", "did you mean ride?"]),
}


def test_the_good_scenario_is_good(place: Path) -> None:
    (place / "mine.toml").write_text(GOOD)
    assert call(["check", "mine.toml"]) == 0


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_told_and_nothing_is_written(
    fault: str, place: Path, message_of: Callable[[list[str]], str]
) -> None:
    old, new, parts = FAULTS[fault]
    assert old in GOOD
    (place / "mine.toml").write_text(GOOD.replace(old, new, 1))
    before = sorted(path.relative_to(place) for path in place.rglob("*"))
    for command in ("check", "run"):
        text = message_of([command, "mine.toml"])
        assert "mine.toml" in text
        for part in parts:
            assert part in text, text
    assert sorted(path.relative_to(place) for path in place.rglob("*")) == before
