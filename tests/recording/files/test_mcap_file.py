"""What is exported as MCAP: read back as it was, and plain to tools that know ROS 2 only."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.recording.files.mcap_file import Topic, write_mcap
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.recording import (
    GnssSheet,
    MagnetometerSheet,
    Recording,
    SecondImuSheet,
    beginning,
)
from simrail.recording.signals import SIGNALS

BASE = Path(__file__).parents[2] / "field" / "cases" / "00-base"


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A ride with every kind of signal, a clock ahead of zero and blanks in what a receiver says."""
    base = beginning(read_signals(BASE), samples=161)
    draw = np.random.default_rng(1).standard_normal
    time = base.imu.index
    field = pd.DataFrame(
        2e-5 + 1e-7 * draw((len(time), 3)), time, ["magnetic_x_t", "magnetic_y_t", "magnetic_z_t"]
    )
    second = base.imu + 1e-3 * draw(base.imu.shape)
    second.index = pd.Index(time.to_numpy() - 0.0123456789, name="time_s")
    gnss = pd.DataFrame(
        {"position_m": draw(8), "speed_mps": draw(8)}, pd.Index(np.arange(8.0), name="time_s")
    )
    gnss.iloc[2:4] = np.nan
    gaps = pd.DataFrame({"start_s": [3.0, 7.5], "end_s": [3.1, 7.75], "missing": np.array([1, 4])})
    return replace(
        base,
        second_imu=second,
        second_imu_sheet=SecondImuSheet(
            "rear", base.mount_body, base.mount_position_m, 9.0, base.imu_sheet, clock_offset_sd_s=0.1
        ),
        magnetometer=field,
        magnetometer_sheet=MagnetometerSheet(1e-8, 3.464e-5, 0.0, 0.0),
        gnss=gnss,
        gnss_sheet=GnssSheet(1.0, 3.0, 0.1),
        gaps=gaps,
        notes=(),
    )


@pytest.mark.parametrize("axes", ["flu", "ned"])
def test_a_ride_reads_back_to_the_same_samples(recording: Recording, tmp_path: Path, axes: str) -> None:
    """Every value to the bit, stamps to half a nanosecond."""
    pytest.importorskip("mcap.writer")
    write_ride(recording, tmp_path / "ride", format="mcap", axes=axes)
    assert sorted(path.name for path in (tmp_path / "ride").iterdir()) == [
        "ride.mcap",
        "ride.toml",
        "track.toml",
    ]
    again = read_signals(tmp_path / "ride")
    for name in (signal.name for signal in SIGNALS):
        left, right = getattr(recording, name), getattr(again, name)
        if left is None:
            assert right is None
            continue
        np.testing.assert_array_equal(left.to_numpy(), right.to_numpy(), err_msg=name)
        assert list(left) == list(right) and left.dtypes.equals(right.dtypes)
        np.testing.assert_allclose(left.index, right.index, rtol=0.0, atol=0.5001e-9)
    assert again.second_imu_sheet == recording.second_imu_sheet and again.gnss_sheet == recording.gnss_sheet


def test_tools_that_know_ros_find_axes_times_and_units(recording: Recording, tmp_path: Path) -> None:
    """By the library alone: kinds of messages, frames, order, and that no orientation is claimed."""
    reading = pytest.importorskip("mcap.reader")
    typesys = pytest.importorskip("rosbags.typesys")
    write_ride(recording, tmp_path / "ride", format="mcap", axes="ned")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    kinds, written = {}, []
    with (tmp_path / "ride" / "ride.mcap").open("rb") as file:
        reader = reading.make_reader(file)
        assert reader.get_header().profile == "ros2"
        for schema, channel, message in reader.iter_messages():
            written.append(message.log_time)
            if channel.topic not in kinds:
                kinds[channel.topic] = schema
                if channel.topic == "/imu":
                    imu = store.deserialize_cdr(message.data, schema.name)
    assert written == sorted(written) and written[0] == 0
    assert kinds["/imu"].name == kinds["/second_imu"].name == "sensor_msgs/msg/Imu"
    assert kinds["/magnetometer"].name == "sensor_msgs/msg/MagneticField"
    assert "int64 pulse_count  # 1, -: signed encoder counts" in kinds["/encoder"].data.decode()
    assert imu.header.frame_id == f"{recording.mount}_frd" and imu.orientation_covariance[0] == -1.0
    assert imu.linear_acceleration.z == -recording.imu["accel_z_mps2"].iloc[0]
    assert imu.angular_velocity.x == recording.imu["gyro_x_radps"].iloc[0]


def test_a_library_that_is_not_there_is_named(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(
        InputError, match=r"not installed.*simrail\[loggers\]', or write csv or parquet"
    ) as error:
        write_ride(recording, tmp_path / "ride", format="mcap")
    assert "\n" not in str(error.value) and not (tmp_path / "ride").exists()


def test_a_message_of_columns_says_what_they_are(tmp_path: Path) -> None:
    """In NED the columns bear the axes, and those that turn have the other sign."""
    reading = pytest.importorskip("mcap.reader")
    time = pd.Index([0.0, 0.5], name="time_s")
    frame = pd.DataFrame({"velocity_y_mps": [1.0, 2.0], "odd": [3.0, 4.0]}, time)
    write_mcap(tmp_path / "a.mcap", [Topic("truth", frame, "axle")], axes="ned")
    with (tmp_path / "a.mcap").open("rb") as file:
        schema, _, message = next(iter(reading.make_reader(file).iter_messages()))
    assert schema.name == "simrail_msgs/msg/Truth"
    assert "float64 velocity_y_ned_mps  # m/s, global" in schema.data.decode()
    assert np.frombuffer(message.data[-16:]).tolist() == [-1.0, 3.0]
