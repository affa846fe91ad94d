"""What people met with, by their own files: samples that are none, sheets in all words, rates of devices."""

from __future__ import annotations

from pathlib import Path

import pytest

from simrail.core.errors import InputError
from simrail.estimation.recorded_ride import read_ride

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
