"""Units and axes of one signal: whatever a device says is read back as the motion that it was."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrail.core.errors import InputError
from simrail.core.rotation import rotation_matrix
from simrail.core.toml_files import judge, parse_toml
from simrail.recording.files.imu_reader import sheet_at
from simrail.recording.files.ride_file import ImuSignalPart
from simrail.recording.files.signal_reader import SignalReader
from simrail.recording.recording import ImuSheet
from simrail.recording.signals import FORCES, RATES

AXES = [
    tuple(sign + letter for sign, letter in zip(signs, letters, strict=True))
    for letters in permutations("xyz")
    for signs in product(("", "-"), repeat=3)
]


def turning(axes: tuple[str, ...]) -> np.ndarray:
    """Matrix (3, 3) from the device's axes to the body's, by the meaning of `axes`."""
    matrix = np.zeros((3, 3))
    for row, axis in enumerate(axes):
        matrix[row, "xyz".index(axis[-1])] = -1.0 if axis[0] == "-" else 1.0
    return matrix


def is_rotation(axes: tuple[str, ...]) -> bool:
    return bool(np.linalg.det(turning(axes)) > 0.0)


@pytest.mark.parametrize("axes", AXES, ids="".join)
def test_the_24_rotations_are_taken_and_the_24_mirrors_refused(axes):
    text = f'file = "a.csv"\nbody = "b"\nposition_m = [0, 0, 0]\ngrade = "x"\naxes = {list(axes)}'
    data = parse_toml(text, file="t")
    if is_rotation(axes):
        assert judge(ImuSignalPart, data, file="t").axes == axes
    else:
        with pytest.raises(InputError, match="left-handed"):
            judge(ImuSignalPart, data, file="t")


@settings(max_examples=60, deadline=None)
@given(
    axes=st.sampled_from([axes for axes in AXES if is_rotation(axes)]),
    gyro_unit=st.sampled_from([sign + unit for unit in RATES for sign in ("", "-")]),
    accel_unit=st.sampled_from([sign + unit for unit in FORCES for sign in ("", "-")]),
    angles=st.tuples(*[st.floats(-60.0, 60.0)] * 3) | st.just((0.0, 0.0, 0.0)),
    seed=st.integers(0, 99),
)
def test_units_and_axes_are_undone(tmp_path_factory, axes, gyro_unit, accel_unit, angles, seed):
    """What a device of any unit and mounting says of a motion is read back as that motion."""
    folder = tmp_path_factory.mktemp("map")
    body = np.random.default_rng(seed).standard_normal((20, 6))
    tilt = rotation_matrix(np.radians([angles]))[0]
    columns = {"time_s": np.arange(20) / 10.0}
    for part, unit, units, names in (
        (body[:, :3], gyro_unit, RATES, ("p", "q", "r")),
        (body[:, 3:], accel_unit, FORCES, ("u", "v", "w")),
    ):
        multiply, divide = units[unit.removeprefix("-")]
        printed = part @ tilt @ turning(axes) / (multiply / divide)
        columns |= dict(zip(names, (-printed if unit[0] == "-" else printed).T, strict=True))
    pd.DataFrame(columns).to_csv(folder / "a.csv", index=False)
    roll, pitch, yaw = angles
    text = f"""file = "a.csv"
body = "b"
position_m = [0, 0, 0]
grade = "x"
axes = {list(axes)}
roll_deg = {roll!r}
pitch_deg = {pitch!r}
yaw_deg = {yaw!r}
columns = {{ gyro = ["p", "q", "r"], accel = ["u", "v", "w"] }}
units = {{ gyro = "{gyro_unit}", accel = "{accel_unit}" }}
"""
    part = judge(ImuSignalPart, parse_toml(text, file="t"), file="t")
    found = SignalReader(folder).frame(part, "imu").to_numpy()
    np.testing.assert_allclose(found, body, rtol=0.0, atol=1e-14 if any(angles) else 2e-15)


def test_samples_without_stamps_are_counted_from_where_they_begin(tmp_path):
    """Sample k of a file of 50 Hz that begins at 12.5 s is of 12.5 s + k / 50 Hz."""
    pd.DataFrame({name: np.arange(4.0) for name in "pqruvw"}).to_csv(tmp_path / "a.csv", index=False)
    text = """file = "a.csv"
body = "b"
position_m = [0, 0, 0]
grade = "x"
rate_hz = 50.0
start_s = 12.5
columns = { gyro = ["p", "q", "r"], accel = ["u", "v", "w"] }
"""
    part = judge(ImuSignalPart, parse_toml(text, file="t"), file="t")
    assert SignalReader(tmp_path).frame(part, "imu").index.tolist() == [12.5, 12.52, 12.54, 12.56]
    # A clock that is slow by 5000 ppm and 2 s behind.
    told = "time_offset_s = 2.0\ntime_drift_ppm = 5000.0\n" + text
    clock = judge(ImuSignalPart, parse_toml(told, file="t"), file="t")
    times = SignalReader(tmp_path).frame(clock, "imu").index
    np.testing.assert_allclose(times, 14.5 + 1.005 * np.arange(4) / 50.0, rtol=0.0, atol=1e-12)


def test_an_increment_is_the_mean_of_the_interval_before_its_stamp(tmp_path):
    """So it is half an interval old, unless the sheet has it older still; a rate is as old as it says."""
    sheet = ImuSheet("mine", 100.0, 0.002, *([1e-3] * 6))
    for increments, lag_s, wanted in ((("gyro",), 0.002, 0.01), (("gyro",), 0.03, 0.03), ((), 0.002, 0.002)):
        part = SimpleNamespace(sheet=replace(sheet, lag_s=lag_s), increments=increments)
        found = sheet_at(part, tmp_path, 50.0, [])
        assert (found.rate_hz, found.lag_s) == (50.0, pytest.approx(wanted, rel=1e-12))


def test_a_sheet_whose_rate_is_far_below_that_of_the_file_is_noted(tmp_path):
    for rate, count in ((1.0, 1), (250.0, 0)):
        notes: list[str] = []
        part = SimpleNamespace(sheet=ImuSheet("mine", rate, 0.0, *([1e-3] * 6)), increments=())
        assert sheet_at(part, tmp_path, 1000.0, notes).rate_hz == 1000.0
        assert len(notes) == count and all("mine gives 1 samples a second" in note for note in notes)
