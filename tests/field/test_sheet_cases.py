"""What people met with, by their own files: samples that are none, sheets in all words, rates of devices."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from simrail.cli.main import BAD_INPUT, DONE, call
from simrail.core.errors import InputError
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.sheets.imu_file import load_grade

CASES = Path(__file__).parent / "cases"


def refusal(case: str) -> str:
    with pytest.raises(InputError) as raised:
        read_ride(CASES / case / "ride.toml")
    said = str(raised.value)
    assert "\n" not in said
    return said


def test_the_control_is_read() -> None:
    assert len(read_ride(CASES / "00-base" / "ride.toml").imu) == 801


def test_a_marker_of_an_accelerometer_is_named_by_its_line_and_range() -> None:
    said = refusal("06-accel-sentinel")
    for words in ("ride.csv: ax", "line 302", "time_s = 15", "-16 g", "5 g, the range of", "no measurement"):
        assert words in said


def test_a_marker_of_a_gyro_is_not_taken_for_degrees() -> None:
    said = refusal("07-gyro-sentinel")
    for words in ("ride.csv: wx", "line 302", "-2000 deg/s", "300 deg/s, the range of", "no measurement"):
        assert words in said
    assert "look like" not in said and "convert" not in said


def test_zeros_of_a_magnetometer_are_told_from_a_field() -> None:
    said = refusal("11-mag-all-zero")
    assert "0 uT" in said and "44.2 uT" in said and "magnetometer" in said


SHEETS = CASES / "31-imu-did-you-mean"


@pytest.mark.parametrize(
    ("name", "field", "value"),
    [
        ("mdps", "gyro_noise_radpsqrts", math.radians(0.0028)),
        ("si", "gyro_noise_radpsqrts", 4.9e-5),
        ("percent_per_k", "gyro_scale_temperature_1pk", 3e-4),
        ("two_bandwidths", "gyro_bandwidth_hz", 255.0),
        ("two_bandwidths", "accel_bandwidth_hz", 324.0),
        ("axis_noise", "accel_noise_mpsqrts", 190e-6 * 9.80665),
        ("axis_noise", "accel_axis_noise", (160.0 / 190.0, 160.0 / 190.0, 1.0)),
    ],
)
def test_figures_as_printed_are_accepted_with_their_unit(name: str, field: str, value: float) -> None:
    assert getattr(load_grade(str(SHEETS / f"{name}.toml")), field) == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("cross_axis", "gyro_nonorthogonality_mrad = 12.5"),
        ("kalibr", f"gyro_random_walk_degphpsqrth = {math.degrees(2.5e-6) * 3600 * 60:.6g}"),
        ("rms", "accel_noise_ugpsqrthz = 700.0 / sqrt(1.57 B)"),
    ],
)
def test_figures_of_other_words_are_explained_in_a_line(
    name: str, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["imu", str(SHEETS / f"{name}.toml")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1 and line in said and "did you mean" not in said
    assert not re.search(r"scale_error|gyro_noise_deg", said)


def test_noise_that_no_gyro_has_is_refused_with_the_unit_that_was_meant(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(["imu", str(CASES / "32-imu-noise-1000x" / "imu.toml")]) == BAD_INPUT
    said = capsys.readouterr().err
    for words in ("gyro_noise_degpsqrthz", "2.8", "0.1 deg/s/sqrt(Hz)", "gyro_noise_mdpspsqrthz = 2.8"):
        assert words in said


def test_noise_of_each_axis_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["imu", str(SHEETS / "axis_noise.toml")]) == DONE
    assert "160, 160, 190 ug/sqrt(Hz)" in capsys.readouterr().out


RATES = CASES / "33-rates-of-real-imus"


@pytest.mark.parametrize("rate", [400, 416])
def test_rates_of_devices_are_fine(rate: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["check", str(RATES / f"s{rate}.toml")]) == DONE
    assert "fine" in capsys.readouterr().out


def test_a_rate_above_the_truth_is_told_the_rate_that_it_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["check", str(RATES / "s1667.toml")]) == BAD_INPUT
    said = capsys.readouterr().err
    assert "imu[0].grade.rate_hz" in said and "1667" in said and "truth_rate_hz = 2000" in said
    assert call(["check", str(RATES / "s1667.toml"), "--set", "truth_rate_hz=2000"]) == DONE


def test_hard_iron_is_named_where_a_ride_is_estimated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Thirty microtesla along the train, beside 44.2 of the Earth."""
    case, ride = CASES / "11-mag-all-zero", tmp_path / "ride.toml"
    for name in ("ride.csv", "ride.toml"):
        (tmp_path / name).write_bytes((case / name).read_bytes())
    level, down = 44.2 * math.cos(0.9137), 44.2 * math.sin(0.9137)
    rows = (f"{k / 10},{level + 30.0 + 0.01 * (k % 3)},0.0,{down}" for k in range(401))
    (tmp_path / "mag.csv").write_text("t,mx,my,mz\n" + "\n".join(rows) + "\n", encoding="utf-8")
    out = str(tmp_path / "out")
    assert call(["estimate", str(ride), "--estimator", "AttitudeEkf", "--out", out]) == DONE
    said = capsys.readouterr().err
    assert "warning: magnetometer.field: hard iron of [30." in said
