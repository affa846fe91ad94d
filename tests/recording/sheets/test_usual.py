"""Figures that no sensor has are refused with the unit they were meant in; shipped devices pass."""

from __future__ import annotations

import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import shipped
from simrail.recording.sheets.figures import FIGURES
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.sheets.usual import USUAL, refuse_unusual, unusual_figures


@pytest.mark.parametrize(
    ("key", "value", "remedy"),
    [
        ("gyro_noise_degpsqrthz", 2.8, "gyro_noise_mdpspsqrthz = 2.8"),
        ("gyro_noise_degpsqrthz", 200.0, "gyro_noise_degphpsqrthz = 200"),
        ("accel_noise_ugpsqrthz", 2e5, "accel_noise_ngpsqrthz = 200000"),
        ("gyro_noise_degpsqrth", 1e4, "mind the unit"),
        ("accel_turn_on_bias_mg", 1e5, "accel_turn_on_bias_ug = 100000"),
        ("gyro_turn_on_bias_degps", 800.0, "gyro_turn_on_bias_mdps = 800"),
    ],
)
def test_a_slip_of_a_unit_is_refused_with_the_unit(key: str, value: float, remedy: str) -> None:
    with pytest.raises(InputError) as raised:
        refuse_unusual({key: value, "title": "mine", "gyro_range_degps": None})
    said = str(raised.value)
    assert key in said and remedy in said and FIGURES[key].unit in said and "sold" in said


@pytest.mark.parametrize("name", sorted(shipped("imu")))
def test_no_shipped_device_is_unusual(name: str) -> None:
    assert unusual_figures(load_grade(name)) == ()


def test_what_is_only_unlikely_is_warned_of() -> None:
    told = unusual_figures(ImuGrade.from_datasheet("mine", 100.0, gyro_noise_degpsqrthz=0.3))
    assert len(told) == 1 and "gyro" in told[0] and "0.3 deg/s/sqrt(Hz)" in told[0]
    told = unusual_figures(ImuGrade.from_datasheet("mine", 100.0, accel_noise_ugpsqrthz=1e-4))
    assert len(told) == 1 and "accelerometer" in told[0]


def test_a_rate_in_khz_is_warned_of() -> None:
    (told,) = unusual_figures(ImuGrade.from_datasheet("mine", 1.0))
    assert "1 Hz" in told and "rate_hz = 1000" in told
    assert unusual_figures(ImuGrade.from_datasheet("mine", 10.0)) == ()


def test_noise_and_counts_are_held_against_the_range() -> None:
    """0.09 deg/s/sqrt(Hz) at 1 kHz is 2.8 deg/s a sample: 9 % of 30 deg/s."""
    grade = ImuGrade.from_datasheet(
        "mine",
        1000.0,
        gyro_noise_degpsqrthz=0.09,
        gyro_range_degps=30.0,
        accel_range_g=2.0,
        accel_resolution_mg=100.0,
    )
    told = unusual_figures(grade)
    assert len(told) == 2
    assert "noise of a sample of the gyro is 9.49 %" in told[0]
    assert "resolution of the accelerometer is 5 %" in told[1]


def test_every_bound_is_one_of_a_figure() -> None:
    for usual in USUAL.values():
        assert usual.key in FIGURES and 0.0 < usual.least < usual.most
