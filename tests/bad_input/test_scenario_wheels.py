"""Faults in what wheels and rails do to each other: traction, and what lies on the rails."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from simrail.core.toml_files import shipped

LEAVES = shipped("scenario")["leaves"].read_text(encoding="utf-8")

WHEEL_FAULTS: dict[str, tuple[str, str, list[str]]] = {
    "a driver that is none": ('drive = "wheels"', 'drive = "wheel"', ["ride[0].drive", "'wheel'", "guide"]),
    "wheels of a vehicle without traction": (
        'vehicle = "metro_irw_bogie"',
        'vehicle = "irw_car"',
        ["ride[0].drive", "no [traction]", "irw_car", "give the vehicle file a [traction]"],
    ),
    "a vehicle of another gauge than the track": (
        'vehicle = "metro_irw_bogie"',
        'vehicle = "scale_vehicle"',
        ["vehicle", "scale_vehicle", "rail_base_mm = 1500", "127 to 139.7 mm", "gauge"],
    ),
    "wheels of a body that follows the rails": (
        'engine = "compiled"',
        'engine = "kinematic"',
        ["ride[0].drive", "no forces", "compiled or exudyn"],
    ),
    "forces at a rate that is none of the truth's": (
        'engine = "compiled"',
        'engine = "compiled"\ncontact_rate_hz = 300.0',
        ["contact_rate_hz", "300.0", "truth_rate_hz = 1000 Hz divided by a whole number", "333.333333333"],
    ),
    "forces more often than the truth": (
        'engine = "compiled"',
        'engine = "compiled"\ncontact_rate_hz = 500.0\ntruth_rate_hz = 250.0',
        ["contact_rate_hz", "500.0", "truth_rate_hz = 250 Hz", "try 250"],
    ),
    "forces at a negative rate": (
        'engine = "compiled"',
        'engine = "compiled"\ncontact_rate_hz = -1.0',
        ["contact_rate_hz", "-1.0", ">= 0"],
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
def test_fault_of_wheels_and_rails(fault: str, place: Path, message_of: Callable[[list[str]], str]) -> None:
    old, new, parts = WHEEL_FAULTS[fault]
    assert old in LEAVES
    (place / "mine.toml").write_text(LEAVES.replace(old, new, 1))
    before = sorted(place.rglob("*"))
    text = message_of(["check", "mine.toml"])
    for part in ("mine.toml", *parts):
        assert part in text, text
    assert sorted(place.rglob("*")) == before


def test_forces_of_a_body_that_follows_the_rails(message_of: Callable[[list[str]], str]) -> None:
    text = message_of(["check", "quick_kinematic", "--set", "contact_rate_hz=100.0"])
    for part in ("contact_rate_hz", "100.0", "no forces to keep", "compiled or exudyn"):
        assert part in text, text


def test_leaves_under_a_kinematic_ride(place: Path, message_of: Callable[[list[str]], str]) -> None:
    text = LEAVES.replace('drive = "wheels"\n', "").replace('"compiled"', '"kinematic"')
    (place / "mine.toml").write_text(text)
    message = message_of(["check", "mine.toml"])
    assert "mine.toml: rail_condition: " in message
    assert "does not feel their friction" in message
