"""Faulty vehicle files: each is refused with the field's name."""

import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, parse_toml, shipped
from simrail.vehicle.file import VehicleFile

BOGIE = shipped("vehicle")["metro_irw_bogie"].read_text(encoding="utf-8")
COACH = shipped("vehicle")["manchester_1"].read_text(encoding="utf-8")
LOOSE = """
[[body]]
name = "toolbox"
mass_kg = 100.0
inertia_kgm2 = [10.0, 10.0, 10.0]
position_m = [0.0, 0.0, 1.0]

[guide]
"""

# name: (text, what stands there, what stands there instead, parts of the message)
FAULTS = {
    "negative stiffness": (
        BOGIE,
        "[6.0e6, 2.0e6, 0.6e6]",
        "[6.0e6, -2.0e6, 0.6e6]",
        ["suspension[0].stiffness_npm", ">= 0"],
    ),
    "negative damping": (
        BOGIE,
        "[10.0e3, 6.0e3, 4.0e3]",
        "[10.0e3, 6.0e3, -4.0e3]",
        ["suspension[0].damping_nspm"],
    ),
    "unknown creep law": (BOGIE, "[guide]", '[creep]\nlaw = "dahl"\n\n[guide]', ["creep.law", "dahl"]),
    "slip over adhesion": (
        BOGIE,
        "[guide]",
        '[creep]\nlaw = "polach"\nadhesion = 0.4\nslip = 0.6\n\n[guide]',
        ["creep.slip", "0.6", "0.4"],
    ),
    "shares that do not sum to 1": (
        BOGIE,
        "driven = { front = 0.5, rear = 0.5 }",
        "driven = { front = 0.5, rear = 0.4 }",
        ["traction.driven", "0.9", "sum to 1"],
    ),
    "a driven axle that is none": (
        BOGIE,
        "driven = { front = 0.5, rear = 0.5 }",
        "driven = { front = 0.5, reer = 0.5 }",
        ["traction.driven", "reer", "front.left"],
    ),
    "a wheel braked twice": (
        BOGIE,
        "braked = { front = 0.5, rear = 0.5 }",
        'braked = { front = 0.5, rear = 0.25, "front.left" = 0.25 }',
        ["traction.braked", "front.left", "twice"],
    ),
    "a reaction on nothing": (
        BOGIE,
        "catch_up_mps = 0.8",
        'catch_up_mps = 0.8\nreaction = "bogie"',
        ["traction.reaction", "bogie", "axle, or one of"],
    ),
    "no braking effort": (
        BOGIE,
        "braking_effort_n = 24.0e3",
        "braking_effort_n = 0.0",
        ["traction.braking_effort_n", "> 0"],
    ),
    "body that nothing holds": (BOGIE, "[guide]", LOOSE, ["body[2].name", "toolbox", "[[suspension]]"]),
    "axle that nothing holds": (
        BOGIE,
        'between = ["rear", "frame"]',
        'between = ["front", "frame"]',
        ["axle[1].name", "rear"],
    ),
    "unknown body": (
        BOGIE,
        'between = ["rear", "frame"]',
        'between = ["rear", "fram"]',
        ["suspension[1].between", "fram", "frame"],
    ),
    "no rigid body": (
        BOGIE,
        "[900.0, 1100.0, 1900.0]",
        "[900.0, 1100.0, 2900.0]",
        ["body[0].inertia_kgm2", "sum of the other two"],
    ),
    "no rigid bridge": (
        BOGIE,
        "[120.0, 30.0, 120.0]",
        "[120.0, 30.0, 160.0]",
        ["axle[0].bridge_inertia_kgm2"],
    ),
    "wheel off the axle": (
        BOGIE,
        "wheel_radius_m = 0.29",
        "wheel_radius_m = 0.29\nwheel_y_m = [1.2, -1.2]",
        ["axle[0].wheel_y_m", "off the axle"],
    ),
    "axle not in the middle": (
        BOGIE,
        "wheel_radius_m = 0.29",
        "wheel_radius_m = 0.29\nwheel_y_m = [0.75, -0.74]",
        ["axle[0].wheel_y_m"],
    ),
    "wheels of two sizes": (
        BOGIE,
        "wheel_radius_m = 0.29",
        "wheel_radius_m = 0.30",
        ["axle[1].wheel_radius_m", "alike"],
    ),
    "unknown profile": (BOGIE, '"S1002"', '"S1003"', ["wheel_profile", "S1003"]),
    "falling law": (COACH, "[0.03, 600.0]", "[0.03, 6000.0]", ["tabled[0].points", "rising"]),
    "series stiffness without a damper": (
        COACH,
        "[15000.0, 2000.0, 4000.0]",
        "[15000.0, 2000.0, 0.0]",
        ["suspension[0].series_stiffness_npm", "without a damper"],
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_named(name):
    text, there, instead, parts = FAULTS[name]
    assert there in text
    with pytest.raises(InputError) as caught:
        judge(VehicleFile, parse_toml(text.replace(there, instead, 1), file="mine.toml"), file="mine.toml")
    for part in ("mine.toml", *parts):
        assert part in str(caught.value)


def test_body_whose_weight_nothing_carries():
    """Springs without vertical stiffness hold a body along and across, not up."""
    text = BOGIE.replace("stiffness_npm = [75.0e3, 75.0e3, 200.0e3]", "stiffness_npm = [75.0e3, 75.0e3, 0.0]")
    model = judge(VehicleFile, parse_toml(text, file="mine.toml"), file="mine.toml").model("mine")
    with pytest.raises(InputError, match=r"body: cannot rest.*found .* N without support"):
        model.wheel_load_n(9.81)
