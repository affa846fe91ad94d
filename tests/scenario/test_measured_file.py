"""Rails from a file in a scenario: columns, units, signs, kinds of files, and what a ride is known by."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.toml_files import shipped
from simrail.ride.cache import key_of
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import read_scenario

GOOD = shipped("scenario")["quick_kinematic"].read_text(encoding="utf-8")
SPECTRUM = 'spectrum = "erri_b176_low"'
S = np.arange(0.0, 600.25, 0.25)
VALUES = 1e-3 * np.sin(2.0 * np.pi * S[:, None] / np.array([7.0, 9.0, 11.0, 13.0]))


def scenario_of(table: str, folder: Path, *, spectrum: str = ""):
    text = GOOD.replace(SPECTRUM, spectrum).replace(
        "[[ride]]", f"[irregularity.measured]\n{table}\n[[ride]]", 1
    )
    return read_scenario(text, name="mine", folder=folder)


def rails(table: str, folder: Path) -> np.ndarray:
    parts = Parts(scenario_of(table, folder))
    laid = parts.rails(next(cells(parts.scenario)))
    return laid.irregularities(S[400:2000]).to_numpy()


def test_a_recording_cars_csv(tmp_path: Path) -> None:
    """Kilometre and metre, decimal commas, both rails, the gauge itself, cross-level of the other sign."""
    alignment, vertical, level, gauge = VALUES.T
    frame = pd.DataFrame(
        {
            "Km": 12 + (S // 500).astype(int),
            "Meter": S % 500,
            "note": 0.0,
            "up left": 1e3 * (vertical + 0.5 * level),
            "up right": 1e3 * (vertical - 0.5 * level),
            "AL_L": 1e3 * (alignment + 0.5 * gauge),
            "AL_R": 1e3 * (alignment - 0.5 * gauge),
            "Gauge [mm]": 1435.0 + 1e3 * gauge,
            "level right over left": -1e3 * level,
        }
    )
    frame["Meter"] += 500.0 * (frame["Km"] - 12)
    frame["Km"] = 12
    frame.to_csv(tmp_path / "car.csv", sep=";", decimal=",", index=False)
    text = """
file = "car.csv"
separator = ";"
decimal = ","
start_m = 0.0
columns.position = ["Km", "Meter"]
units.position = ["km", "m"]
"""
    rail_by_rail = """
columns.left_level = "up left"
units.left_level = "mm"
columns.right_level = "up right"
units.right_level = "mm"
columns.left_alignment = "AL_L"
units.left_alignment = "mm"
columns.right_alignment = "AL_R"
units.right_alignment = "mm"
"""
    own = """
nominal_gauge_mm = 1435.0
columns.gauge = "Gauge [mm]"
units.gauge = "mm"
columns.cross_level = "level right over left"
units.cross_level = "-mm"
"""
    assert np.abs(rails(text + rail_by_rail, tmp_path) - VALUES[400:2000]).max() < 1e-12
    assert np.abs(rails(text + own, tmp_path)[:, 2:] - VALUES[400:2000, 2:]).max() < 1e-12
    assert not rails(text + own, tmp_path)[:, :2].any()
    # A column of its own counts before what both rails say.
    frame["level right over left"] *= 2.0
    frame.to_csv(tmp_path / "car.csv", sep=";", decimal=",", index=False)
    both = rails(text + rail_by_rail + own, tmp_path)
    assert np.abs(both - VALUES[400:2000] * [1.0, 1.0, 2.0, 1.0]).max() < 1e-12


PLAIN = """
file = "{file}"
columns = {{ position = "s", alignment = "a", vertical_profile = "v" }}
units = {{ position = "m", alignment = "m", vertical_profile = "mm" }}
"""


def write(path: Path, scale: float = 1.0) -> None:
    frame = pd.DataFrame({"s": S, "a": VALUES[:, 0] * scale, "v": 1e3 * VALUES[:, 1]})
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    else:
        frame.to_csv(path, index=False)


def test_parquet_is_read_as_csv_is(tmp_path: Path) -> None:
    for name in ("a.csv", "a.parquet"):
        write(tmp_path / name)
        found = rails(PLAIN.format(file=name), tmp_path)
        assert np.abs(found[:, :2] - VALUES[400:2000, :2]).max() < 1e-12


def test_a_ride_is_known_by_what_is_in_the_file(tmp_path: Path) -> None:
    def keys(table: str) -> tuple[str, str]:
        parts = Parts(scenario_of(table, tmp_path))
        ride = parts.ride(next(cells(parts.scenario)))
        return key_of(ride.describe()), parts.hash

    write(tmp_path / "a.csv")
    write(tmp_path / "b.csv")
    first = keys(PLAIN.format(file="a.csv"))
    assert keys(PLAIN.format(file="a.csv")) == first
    assert keys(PLAIN.format(file="b.csv"))[0] == first[0]  # the same rails: no new simulation
    write(tmp_path / "a.csv", scale=1.0 + 1e-9)
    changed = keys(PLAIN.format(file="a.csv"))
    assert changed[0] != first[0] and changed[1] != first[1]
    moved = keys(PLAIN.format(file="b.csv") + "start_m = -0.1")
    assert moved[0] != first[0]


def test_scales_and_starts_may_be_lists(tmp_path: Path) -> None:
    write(tmp_path / "a.csv")
    scenario = scenario_of(PLAIN.format(file="a.csv") + "scale = [1.0, 2.0]", tmp_path)
    parts = Parts(scenario)
    laid = [parts.rails(cell).rails(300.0) for cell in cells(scenario) if cell.imu.grade == "ideal"]
    assert laid[-1] == pytest.approx(2.0 * laid[0], abs=1e-15) and np.abs(laid[0]).max() > 1e-5
    assert judge_scenario(scenario).rides == 2


def test_defects_stand_in_a_scenario(tmp_path: Path) -> None:
    dip = """[[irregularity.defect]]
form = "dip"
at_m = 300.0
length_m = 6.0
size_mm = 20.0
rails = "left"
[[ride]]"""
    text = GOOD.replace(SPECTRUM, 'spectrum = "none"').replace("[[ride]]", dip, 1)
    parts = Parts(read_scenario(text, name="mine", folder=tmp_path))
    found = parts.rails(next(cells(parts.scenario))).rails(303.0)
    assert found == pytest.approx([0.0, -0.020, 0.0, 0.0], abs=1e-6)
