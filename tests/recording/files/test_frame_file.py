"""Tables as files: a legend that our own reader passes over, units on request, units in Parquet's schema."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from simrail.recording.files.data_file import DataPart, open_data, read_columns
from simrail.recording.files.frame_file import LEGEND_LINES, in_units, write_frame

VALUES = {"roll_rad": [0.1, 1.0 / 3.0], "gyro_x_radps": [1e-9, -2.0], "cross_level_sd_m": [1e-3, 2e-3]}
FRAME = pd.DataFrame(VALUES, index=pd.Index([0.0, 0.01], name="time_s"))


def test_three_lines_stand_above_the_names_and_every_reader_passes_over_them(tmp_path: Path) -> None:
    write_frame(FRAME, tmp_path / "a.csv", format="csv", about="a table\nof two lines")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert LEGEND_LINES == 3 and all(line.startswith("# ") for line in lines[:3])
    assert lines[3] == "time_s,roll_rad,gyro_x_radps,cross_level_sd_m" and len(lines) == 6
    assert lines[0].startswith("# a table of two lines (simrail ")
    assert "roll_rad [rad] roll, positive left side up" in lines[1] and "cross_level_sd_m [m]" in lines[1]
    by_pandas = pd.read_csv(tmp_path / "a.csv", comment="#", index_col="time_s")
    pd.testing.assert_frame_equal(by_pandas, FRAME)
    data = open_data(DataPart(file="a.csv"), tmp_path, table="imu")
    own = read_columns(data, ["roll_rad", "gyro_x_radps"], table="imu")
    np.testing.assert_array_equal(np.asarray(own["roll_rad"]), FRAME["roll_rad"])


def test_degrees_and_millimetres_are_named(tmp_path: Path) -> None:
    write_frame(FRAME, tmp_path / "a.csv", format="csv", about="x", units=("deg", "mm"))
    read = pd.read_csv(tmp_path / "a.csv", comment="#", index_col="time_s")
    assert list(read) == ["roll_deg", "gyro_x_degps", "cross_level_sd_mm"]
    np.testing.assert_allclose(read["roll_deg"], np.rad2deg(FRAME["roll_rad"]), rtol=1e-15)
    np.testing.assert_allclose(read["cross_level_sd_mm"], [1.0, 2.0], rtol=1e-15)
    assert "roll_deg [deg] roll, positive left side up" in (tmp_path / "a.csv").read_text()


@pytest.mark.parametrize(
    "name",
    ["position_m", "position_sd_m", "peak_position_m", "start_m", "end_m", "open_m", "position_bound_m"],
)
def test_what_lies_along_the_track_stays_in_metres(name: str) -> None:
    assert list(in_units(pd.DataFrame({name: [1.0]}), ("deg", "mm"))) == [name]


def test_parquet_says_its_units(tmp_path: Path) -> None:
    write_frame(FRAME, tmp_path / "a.parquet", format="parquet", about="a table", units=("deg",))
    schema = pq.read_schema(tmp_path / "a.parquet")
    assert schema.field("roll_deg").metadata[b"unit"] == b"deg"
    assert schema.field("time_s").metadata[b"unit"] == b"s"
    assert schema.metadata[b"about"] == b"a table" and b"roll positive" in schema.metadata[b"conventions"]
    read = pd.read_parquet(tmp_path / "a.parquet").set_index("time_s")
    np.testing.assert_array_equal(read["cross_level_sd_m"], FRAME["cross_level_sd_m"])


def test_other_axes_have_other_signs(tmp_path: Path) -> None:
    write_frame(FRAME, tmp_path / "a.csv", format="csv", about="x", axes="ned")
    assert "pitch positive nose up" in (tmp_path / "a.csv").read_text()
