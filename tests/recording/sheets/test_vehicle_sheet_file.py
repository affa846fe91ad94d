"""``[vehicle_sheet]`` of a ride file: the same drawing read back, its short forms, and its faults."""

from dataclasses import astuple, replace
from typing import Any

import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import judge, load, parse_toml, shipped, toml_text
from simrail.recording.sheets.vehicle_sheet import PLACE_SD_M, STIFFNESS_RELATIVE_SD, VehicleSheet
from simrail.recording.sheets.vehicle_sheet_file import VehicleSheetPart, vehicle_sheet_table
from simrail.sensors.drawing import drawing
from simrail.vehicle.file import VehicleFile


def read(text: str, mount: str = "body") -> VehicleSheet:
    return judge(VehicleSheetPart, parse_toml(text, file="ride.toml"), file="ride.toml").sheet(mount)


@pytest.mark.parametrize("by_itself", [False, True])
@pytest.mark.parametrize("name", shipped("vehicle"))
def test_every_drawing_reads_back_bit_by_bit(name: str, by_itself: bool) -> None:
    sheet = drawing(load(VehicleFile, "vehicle", name).model(name), each_by_itself=by_itself)
    sheet = replace(sheet, place_sd_m=0.1 + 0.2, stiffness_relative_sd=1.0 / 3.0)
    assert read(toml_text(vehicle_sheet_table(sheet))) == sheet
    ended = replace(sheet, bodies=tuple(replace(body, ends_m=(-9.7, 9.9)) for body in sheet.bodies))
    assert read(toml_text(vehicle_sheet_table(ended))) == ended


PRIMARY = "primary_stiffness_npm = 2.4e6\nprimary_damping_nspm = 16e3\n"


@pytest.mark.parametrize(
    ("text", "chord"),
    [
        # A car of which the reference point is not in the middle.
        ("pivots_m = [-9.0, 10.0]\nbogie_wheelbase_m = 2.5", (0.5, 9.5, 1.25, 0.02, 0.0)),
        ("pivots_m = [10.0, -9.0]\nbogie_wheelbase_m = 2.5", (0.5, 9.5, 1.25, 0.02, 0.0)),
        # Of the bogies only the pivots are known, or the body hangs between two others.
        ("pivots_m = [9.5, -9.5]\nplace_sd_m = 0.1", (0.0, 9.5, 0.0, 0.1, 0.0)),
        # A bogie frame, a two-axle wagon.
        ("axles_m = [1.25, -1.25]", (0.0, 1.25, 0.0, 0.02, 1.25)),
        ("axles_m = [-2.5, 3.5]", (0.5, 3.0, 0.0, 0.02, 3.0)),
        # The leading axle of a bogie, and its trailing one.
        ("other_axle_m = -1.8", (-0.9, 0.9, 0.0, 0.02, 0.9)),
        ("other_axle_m = 1.8", (0.9, 0.9, 0.0, 0.02, 0.9)),
    ],
)
def test_a_few_places_give_the_chord_of_the_mount(text: str, chord: tuple[float, ...]) -> None:
    sheet = read(text + "\nbody_ends_m = [-12.0, 12.0]\n" + PRIMARY)
    assert astuple(sheet.chord("body"))[:5] == pytest.approx(chord, abs=1e-12)
    assert sheet.body("body").ends_m == (-12.0, 12.0)
    axles = [body for body in sheet.bodies if not body.supports]
    assert {(axle.primary_stiffness_npm, axle.primary_damping_nspm) for axle in axles} == {(2.4e6, 16e3)}
    assert sheet.body("body").primary_stiffness_npm == (2.4e6 if "other" in text else None)
    places = {body.name: body.x_m for body in sheet.bodies}
    assert all(
        places[name] > places[name.replace("front", "rear")] for name in places if name.endswith("front")
    )
    names = [body.name for body in sheet.bodies]
    assert len(set(names)) == len(names)
    assert read(toml_text(vehicle_sheet_table(sheet))) == sheet


def test_what_is_not_said_has_the_stated_defaults() -> None:
    sheet = read("axles_m = [1.0, -1.0]")
    assert (
        (sheet.place_sd_m, sheet.stiffness_relative_sd) == (PLACE_SD_M, STIFFNESS_RELATIVE_SD) == (0.02, 0.2)
    )
    assert {body.primary_stiffness_npm for body in sheet.bodies} == {None}


PIVOTS = "pivots_m = [9.5, -9.5]\n"
AXLES = '[[body]]\nname = "f"\nx_m = 1.0\n[[body]]\nname = "r"\nx_m = -1.0\n'
FRAME = AXLES + '[[body]]\nname = "frame"\nx_m = 0.0\nrests_on = ["f", "r"]\npivots_m = [1.0, -1.0]\n'
TURNED = FRAME + 'turned_by = ["f", "r"]\nturned_by_1pm = [0.5, -0.5]\n'

FAULTS: dict[str, tuple[str, list[str]]] = {
    "nothing": ("place_sd_m = 0.02", ["pivots_m", "other_axle_m", "e.g. pivots_m = [9.5, -9.5]"]),
    "twice": (PIVOTS + "axles_m = [1.0, -1.0]", ["axles_m", "given once"]),
    "negative_place_sd": (PIVOTS + "place_sd_m = -0.02", ["place_sd_m", "-0.02", ">= 0"]),
    "negative_stiffness_sd": (PIVOTS + "stiffness_relative_sd = -0.2", ["stiffness_relative_sd", ">= 0"]),
    "sd_in_mm": (PIVOTS + "place_sd_m = 20.0", ["place_sd_m", "20", "<= 1", "unit"]),
    "wheelset_of_a_frame": (FRAME + "wheelset = true", ["wheelset", "axle"]),
    "sd_in_percent": (PIVOTS + "stiffness_relative_sd = 20.0", ["stiffness_relative_sd", "<= 1"]),
    "equal_pivots": ("pivots_m = [9.5, 9.5]", ["pivots_m", "two places in one", "(9.5, 9.5)"]),
    "equal_axles": ("axles_m = [1.0, 1.0]", ["axles_m", "two places in one"]),
    "own_axle": ("other_axle_m = 0.0", ["other_axle_m", "two axles in one place"]),
    "pivot_outside": (
        PIVOTS + "body_ends_m = [-12.0, 9.0]",
        ["pivots_m", "outside the body", "9.5", "-12 to 9 m", "reference point"],
    ),
    "ends_turned": (PIVOTS + "body_ends_m = [12.0, -12.0]", ["body_ends_m", "rear < front"]),
    "no_wheelbase": (PIVOTS + "bogie_wheelbase_m = 0.0", ["bogie_wheelbase_m", "> 0"]),
    "negative_wheelbase": (PIVOTS + "bogie_wheelbase_m = -2.5", ["bogie_wheelbase_m", "-2.5", "> 0"]),
    "wheelbase_in_mm": (PIVOTS + "bogie_wheelbase_m = 2500.0", ["bogie_wheelbase_m", "<= 10", "unit"]),
    "wheelbase_of_the_car": (
        "pivots_m = [2.5, -2.5]\nbogie_wheelbase_m = 6.0",
        ["bogie_wheelbase_m", "< 5 m", "one bogie"],
    ),
    "wheelbase_of_a_frame": (
        "axles_m = [1.0, -1.0]\nbogie_wheelbase_m = 2.0",
        ["bogie_wheelbase_m", "axles_m"],
    ),
    "pivots_in_mm": ("pivots_m = [9500.0, -9500.0]", ["pivots_m[0]", "9500", "<= 40", "unit"]),
    "pivots_too_far": ("pivots_m = [21.0, -21.0]", ["pivots_m", "farther apart", "40 m", "metres"]),
    "nan": ("pivots_m = [nan, -9.5]", ["pivots_m[0]", "not a finite number"]),
    "nan_sd": (PIVOTS + "place_sd_m = nan", ["place_sd_m", "not a finite number"]),
    "infinite": (PIVOTS + "primary_stiffness_npm = inf", ["primary_stiffness_npm", "not a finite number"]),
    "three_pivots": ("pivots_m = [9.0, 0.0, -9.0]", ["pivots_m", "number of items"]),
    "unknown_key": ("pivot_m = [9.5, -9.5]", ["pivot_m", "unknown key", "did you mean pivots_m"]),
    "text": ('pivots_m = ["9.5", "-9.5"]', ["pivots_m[0]", "wrong type"]),
    "stiffness_in_kn_per_mm": (PIVOTS + "primary_stiffness_npm = 2.4", ["primary_stiffness_npm", ">= 10000"]),
    "negative_damping": (PIVOTS + "primary_damping_nspm = -1.0", ["primary_damping_nspm", ">= 0"]),
    "both_forms": (
        FRAME.replace("[[body]]", "body_ends_m = [-2.0, 2.0]\n[[body]]", 1),
        ["body_ends_m", "[[veh"],
    ),
    "name_twice": (AXLES.replace('"r"', '"f"'), ["body[1].name", "share a name", "'f'"]),
    "rests_on_nothing": (FRAME.replace('["f", "r"]', '["f", "q"]'), ["body[2].rests_on", "'q'", "f, r"]),
    "rests_on_itself": (FRAME.replace('["f", "r"]', '["f", "frame"]'), ["body[2].rests_on", "before it"]),
    "rests_twice": (FRAME.replace('["f", "r"]', '["f", "f"]'), ["body[2].rests_on", "twice"]),
    "a_place_short": (FRAME.replace("[1.0, -1.0]", "[1.0]"), ["body[2].pivots_m", "2 places"]),
    "frame_in_one_place": (
        FRAME.replace("[1.0, -1.0]", "[1.0, 1.0]"),
        ["body[2].pivots_m", "two places in one"],
    ),
    "frame_outside": (
        FRAME + "ends_m = [-1.5, 0.5]",
        ["body[2].pivots_m", "outside the body", "-1.5 to 0.5"],
    ),
    "turned_by_no_axle": (
        TURNED.replace('turned_by = ["f", "r"]', 'turned_by = ["f", "q"]'),
        ["body[2].turned_by", "'q'", "one of f, r"],
    ),
    "a_weight_short": (TURNED.replace("-0.5]", "]"), ["body[2].turned_by_1pm", "2 weights"]),
    "weights_in_mm": (TURNED.replace("0.5", "5e-4"), ["body[2].turned_by_1pm", "here 0.001", "x1 - x2"]),
    "weights_of_one_sign": (TURNED.replace("-0.5", "0.5"), ["body[2].turned_by_1pm", "sum of 0 (here 1)"]),
    "frame_in_mm": (FRAME.replace("[1.0, -1.0]", "[1000.0, -1000.0]"), ["body[2].pivots_m[0]", "<= 40"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_refused_by_name(fault: str) -> None:
    text, words = FAULTS[fault]
    with pytest.raises(InputError) as raised:
        read(text)
    message = str(raised.value)
    assert message.startswith("ride.toml") and "\n" not in message, message
    for word in words:
        assert word in message, message


def test_the_sound_ones_are_sound() -> None:
    """What the faults are made of."""
    for text in (PIVOTS, AXLES, FRAME):
        read(text)


def test_nothing_of_a_table_is_lost() -> None:
    """A field that is added to the nouns must be written."""
    sheet = drawing(load(VehicleFile, "vehicle", "manchester_1").model("m"))
    table: dict[str, Any] = vehicle_sheet_table(sheet)
    assert set(table) == {field for field in sheet.__dataclass_fields__ if field != "bodies"} | {"body"}
    fields = set(sheet.bodies[0].__dataclass_fields__) - {"supports"}
    fields |= {"rests_on", "pivots_m", "turned_by_1pm"}
    assert set(table["body"][0]) == fields
