"""Faults in the parts that a scenario names: vehicle, track, IMU."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.core.toml_files import shipped

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")

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
    "an IMU rate above the truth's": (
        "imu",
        "lord_3dm_gx4_25",
        "rate_hz = 250",
        "rate_hz = 1333",
        ["1333", "truth_rate_hz = 2000"],
    ),
}


@pytest.mark.parametrize("fault", PART_FAULTS)
def test_fault_in_a_part(fault: str, place: Path, message_of: Callable[[list[str]], str]) -> None:
    kind, name, old, new, parts = PART_FAULTS[fault]
    text = shipped(kind)[name].read_text(encoding="utf-8")
    assert old in text
    (place / "part.toml").write_text(text.replace(old, new, 1))
    (place / "mine.toml").write_text(GOOD.replace(f'"{name}"', '"part.toml"', 1))
    told = message_of(["check", "mine.toml"])
    assert ".toml" in told
    for part in parts:
        assert part in told, told
