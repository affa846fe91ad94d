"""What a ride file asks for beside its signals: limits, methods and a reference; what of it is refused."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import judge
from simrail.recording.files.ride_file import RideFile
from simrail.recording.files.ride_reader import read_signals, read_whole

RIDE = """
name = "asked"
[imu]
file = "imu.csv"
body = "front"
position_m = [0.0, 0.0, 0.6]
grade = "lord_3dm_gx4_25"
[imu.units]
time = "iso"
"""


@pytest.fixture
def asked(tmp_path: Path) -> Callable[[str], Path]:
    time = np.arange(0.0, 8.0, 0.01)
    stamps = pd.to_datetime("2026-03-01T10:00:00.25") + pd.to_timedelta(time, unit="s")
    signals = {"gyro_x_radps": 0.0, "gyro_y_radps": 0.0, "gyro_z_radps": 0.0}
    signals |= {"accel_x_mps2": 0.0, "accel_y_mps2": 0.0, "accel_z_mps2": 9.81}
    pd.DataFrame({"time_s": stamps.strftime("%Y-%m-%dT%H:%M:%S.%f"), **signals}).to_csv(
        tmp_path / "imu.csv", index=False
    )
    level = pd.to_datetime("2026-03-01T10:00:01") + pd.to_timedelta([0.0, 2.5, 4.0, 60.0], unit="s")
    frame = {"when": level.strftime("%Y-%m-%d %H:%M:%S.%f"), "roll": [1.0, "", 3.0, 4.0]}
    pd.DataFrame(frame).to_csv(tmp_path / "level.csv", index=False)
    place = pd.DataFrame({"km": [0.2, 0.1, 0.3], "xl": [2.0, 1.0, 3.0]})
    place.to_csv(tmp_path / "trolley.csv", index=False)

    def write(more: str) -> Path:
        (tmp_path / "ride.toml").write_text(RIDE + more)
        return tmp_path / "ride.toml"

    return write


REFERENCE = """
[reference]
file = "level.csv"
source = "a level"
columns = { time = "when", roll = "roll" }
units = { time = "iso", roll = "deg" }
sd = { roll = "0.1 deg" }
[rail_reference]
file = "trolley.csv"
source = "a trolley"
columns = { position = "km", cross_level = "xl" }
units = { position = "km", cross_level = "mm" }
"""


def test_a_reference_is_on_the_clock_of_the_ride_and_in_no_recording(asked: Callable[[str], Path]) -> None:
    recording, _, reference = read_whole(asked(REFERENCE))
    assert reference is not None and reference.motion is not None and reference.rails is not None
    # Dates count from the whole second of the IMU's first stamp; the sample after the ride is none of it.
    assert list(reference.motion.index) == pytest.approx([1.0, 5.0])
    np.testing.assert_allclose(reference.motion["roll_rad"], np.radians([1.0, 3.0]))
    assert reference.sds == {"roll_rad": pytest.approx(np.radians(0.1))}
    assert list(reference.rails.index) == pytest.approx([100.0, 200.0, 300.0])
    np.testing.assert_allclose(reference.rails["cross_level_m"], [1e-3, 2e-3, 3e-3])
    alone = read_signals(asked(""))
    pd.testing.assert_frame_equal(recording.imu, alone.imu)
    assert not hasattr(recording, "reference")


def test_limits_are_read_with_their_units(asked: Callable[[str], Path]) -> None:
    text = (
        '[limits]\nsection_m = 100.0\ncross_level = { D1 = "0.4 cm", D1_sd = 1.5 }\ntwist = { full = "6 mm" }'
    )
    _, spec, _ = read_whole(asked(text))
    limits = spec.limits.limits()
    assert limits.peaks == {
        ("cross_level", "D1"): pytest.approx(4e-3),
        ("twist", "full"): pytest.approx(6e-3),
    }
    assert limits.sds == {("cross_level", "D1"): pytest.approx(1.5e-3)}
    assert not limits.is_example and limits.section_m == 100.0
    assert read_whole(asked(""))[1].limits.limits().is_example


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ('[limits]\ncross_level = { D9 = "4 mm" }', r"limits\.cross_level\.D9: has no such band"),
        ('[limits]\ncross_level = { D1 = "4 deg" }', r"limits\.cross_level\.D1: has a unit of angle"),
        ("[limits]\ntwist = { D1 = 4.0 }", r"limits\.twist\.D1: has no such band"),
        ("[limits]\ngauge = { D1 = -4.0 }", r"limits\.gauge\.D1: is no limit"),
        (
            '[[estimator]]\nmethod = "Vqf"\n[[estimator]]\nmethod = "Vqf"',
            r"estimator\[1\]\.name.*two methods",
        ),
        (REFERENCE.replace('"0.1 deg"', "0.1"), r"reference\.sd\.roll: lacks its unit"),
        (REFERENCE.replace('sd = { roll = "0.1 deg" }', 'sd = { gauge = "1 mm" }'), "has no such quantity"),
        (REFERENCE.replace(', roll = "roll" }', " }"), "has nothing to compare with"),
        (
            REFERENCE.replace("[rail_reference]", "time_offset_s = -100.0\n[rail_reference]"),
            "no sample while",
        ),
        (REFERENCE.replace("level.csv", "no.csv"), r"reference\.file.*no such file"),
    ],
)
def test_what_cannot_be_meant_is_refused(asked: Callable[[str], Path], more: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        read_whole(asked(more))


def test_a_place_that_stands_twice_is_refused(asked: Callable[[str], Path], tmp_path: Path) -> None:
    path = asked(REFERENCE)
    pd.DataFrame({"km": [0.1, 0.1], "xl": [1.0, 2.0]}).to_csv(tmp_path / "trolley.csv", index=False)
    with pytest.raises(InputError, match=r"trolley\.csv.*has a place twice.*100"):
        read_whole(path)


def test_the_template_shows_how_it_is_asked_for() -> None:
    """Without the marks of comment the tables at the end of a new ride file are read."""
    text = (files("simrail.cli") / "template_files" / "ride.toml.txt").read_text(encoding="utf-8")
    shown = re.sub("^# ?", "", text[text.index("# [limits]") :], flags=re.MULTILINE)
    spec = judge(RideFile, tomllib.loads(RIDE.partition("[imu.units]")[0] + shown), file="new.toml")
    assert spec.limits.limits().peaks["vertical_profile", "D1"] == pytest.approx(6e-3)
    assert spec.estimator[0].called == "tuned" and spec.reference is not None
