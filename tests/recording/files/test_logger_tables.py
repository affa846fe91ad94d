"""One ride in files that are no text: HDF5, MATLAB, MCAP and rosbag, read as the same ride."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from simrail.core.errors import InputError
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording

BASE = Path(__file__).parents[2] / "field" / "cases" / "00-base"
FIRST_NS = 1_717_200_000 * 10**9
IMU, WHEEL = "/imu/data", "/wheel"
OF_ARRAYS = ("t", ["gyro.1", "gyro.2", "gyro.3"], ["accel.1", "accel.2", "accel.3"], "t", "pulses")
OF_TOPICS = (
    f"{IMU}.header.stamp",
    [f"{IMU}.angular_velocity.{axis}" for axis in "xyz"],
    [f"{IMU}.linear_acceleration.{axis}" for axis in "xyz"],
    f"{WHEEL}.log_time",
    f"{WHEEL}.data",
)


@pytest.fixture(scope="module")
def base() -> Recording:
    return read_signals(BASE)


def said(folder: Path, file: str, columns: tuple[Any, ...], *, time: str = "s") -> Path:
    """A ride file of other columns."""
    imu_time, gyro, accel, wheel_time, count = (json.dumps(name) for name in columns)
    text = (BASE / "ride.toml").read_text().replace('"ride.csv"', f'"{file}"')
    text = text.replace(
        'time = "t"\ngyro = ["wx","wy","wz"]\naccel = ["ax","ay","az"]',
        f"time = {imu_time}\ngyro = {gyro}\naccel = {accel}",
    )
    text = text.replace('time = "t", count = "pulses"', f"time = {wheel_time}, count = {count}")
    (folder / "ride.toml").write_text(text.replace('time = "s"', f'time = "{time}"'))
    return folder


def logged() -> dict[str, np.ndarray]:
    frame = pd.read_csv(BASE / "ride.csv")
    return {
        "t": frame["t"].to_numpy(),
        "gyro": frame[["wx", "wy", "wz"]].to_numpy(),
        "accel": frame[["ax", "ay", "az"]].to_numpy(),
        "pulses": frame["pulses"].to_numpy(),
    }


def assert_alike(found: Recording, base: Recording) -> None:
    pd.testing.assert_frame_equal(found.imu, base.imu, rtol=0.0, atol=1e-12)
    assert found.encoder is not None and base.encoder is not None
    np.testing.assert_array_equal(found.encoder["pulse_count"], base.encoder["pulse_count"])


@pytest.mark.parametrize("turned", [False, True])
def test_hdf5(base: Recording, tmp_path: Path, turned: bool) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "ride.h5", "w") as file:
        for name, values in logged().items():
            file[f"log/{name}"] = values.T if turned else values
    paths = tuple(f"log/{c}" if isinstance(c, str) else [f"log/{one}" for one in c] for c in OF_ARRAYS)
    assert_alike(read_signals(said(tmp_path, "ride.h5", paths)), base)
    with pytest.raises(InputError, match=r"no such column; found 'log/gyr.1'.*did you mean 'log/gyro.1'"):
        read_signals(said(tmp_path, "ride.h5", (paths[0], ["log/gyr.1", *paths[1][1:]], *paths[2:])))


def test_a_damaged_hdf5_file_is_told_in_one_line(base: Recording, tmp_path: Path) -> None:
    """Bytes of the file overwritten, in its head and in its compressed data; and half of it."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "ride.h5", "w") as file:
        for name, values in logged().items():
            file.create_dataset(f"log/{name}", data=values, compression="gzip", chunks=values.shape)
    paths = tuple(f"log/{c}" if isinstance(c, str) else [f"log/{one}" for one in c] for c in OF_ARRAYS)
    folder, file = said(tmp_path, "ride.h5", paths), tmp_path / "ride.h5"
    whole = file.read_bytes()
    refused = 0
    for begin in range(0, len(whole), max(64, len(whole) // 24)):
        file.write_bytes(whole[:begin] + b"\xa5" * 64 + whole[begin + 64 :])
        try:
            read_signals(folder)
        except InputError as error:
            assert "\n" not in str(error) and error.limit and error.remedy and error.value
            refused += 1
    assert refused > 6
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="not readable HDF5"):
        read_signals(folder)


def test_matlab(base: Recording, tmp_path: Path) -> None:
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "ride.mat", {"log": logged(), "note": "words"})
    paths = tuple(f"log.{c}" if isinstance(c, str) else [f"log.{one}" for one in c] for c in OF_ARRAYS)
    assert_alike(read_signals(said(tmp_path, "ride.mat", paths)), base)
    (tmp_path / "ride.mat").write_bytes(b"no such thing" * 50)
    with pytest.raises(InputError, match="not a readable MATLAB file"):
        read_signals(tmp_path)


def in_json(path: Path) -> None:
    writer_module = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channels = {
            topic: writer.register_channel(topic=topic, message_encoding="json", schema_id=schema)
            for topic in (IMU, WHEEL)
        }
        held = logged()
        for i, t in enumerate(held["t"]):
            now = FIRST_NS + round(t * 1e9)
            vectors = {
                name: dict(zip("xyz", held[key][i].tolist(), strict=True))
                for name, key in (("angular_velocity", "gyro"), ("linear_acceleration", "accel"))
            }
            stamp = {"sec": now // 10**9, "nanosec": now % 10**9}
            for topic, message in (
                (IMU, {"header": {"stamp": stamp, "frame_id": "imu"}, **vectors}),
                (WHEEL, {"data": int(held["pulses"][i])}),
            ):
                # Written late: the stamp in the message is the time.
                written = now + (5_000_000 if topic == IMU else 0)
                writer.add_message(channels[topic], written, json.dumps(message).encode(), now)
        writer.finish()


def messages(
    typesys: Any, serialize: Callable[[Any, str], Any], add: Callable[[str, int, Any], None], store: Any
) -> None:
    types, held = store.types, logged()
    vector = types["geometry_msgs/msg/Vector3"]
    for i, t in enumerate(held["t"]):
        now = FIRST_NS + round(t * 1e9)
        header = types["std_msgs/msg/Header"](
            stamp=types["builtin_interfaces/msg/Time"](sec=now // 10**9, nanosec=now % 10**9), frame_id="imu"
        )
        imu = types["sensor_msgs/msg/Imu"](
            header=header,
            orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=np.zeros(9),
            angular_velocity=vector(*held["gyro"][i].tolist()),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=vector(*held["accel"][i].tolist()),
            linear_acceleration_covariance=np.zeros(9),
        )
        add(IMU, now, serialize(imu, "sensor_msgs/msg/Imu"))
        count = types["std_msgs/msg/Int64"](data=int(held["pulses"][i]))
        add(WHEEL, now, serialize(count, "std_msgs/msg/Int64"))


KINDS = {IMU: "sensor_msgs/msg/Imu", WHEEL: "std_msgs/msg/Int64"}


def in_ros2(path: Path) -> None:
    writer_module, typesys = pytest.importorskip("mcap.writer"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with path.open("wb") as file:
        writer = writer_module.Writer(file)
        writer.start(profile="ros2")
        channels = {}
        for topic, kind in KINDS.items():
            text = store.generate_msgdef(kind, ros_version=2)[0].encode()
            schema = writer.register_schema(name=kind, encoding="ros2msg", data=text)
            channels[topic] = writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema)
        messages(
            typesys,
            store.serialize_cdr,
            lambda topic, now, data: writer.add_message(channels[topic], now, bytes(data), now),
            store,
        )
        writer.finish()


@pytest.mark.parametrize("written", [in_json, in_ros2])
def test_mcap(written: Callable[[Path], None], base: Recording, tmp_path: Path) -> None:
    written(tmp_path / "ride.mcap")
    assert_alike(read_signals(said(tmp_path, "ride.mcap", OF_TOPICS, time="epoch_ns")), base)
    mixed = (OF_TOPICS[4], *OF_TOPICS[1:])
    with pytest.raises(InputError, match=r"several topics.*\[imu.gyro\]"):
        read_signals(said(tmp_path, "ride.mcap", mixed))
    (tmp_path / "ride.mcap").write_bytes(b"no such thing")
    with pytest.raises(InputError, match="not readable MCAP"):
        read_signals(tmp_path)


def test_rosbag2(base: Recording, tmp_path: Path) -> None:
    rosbag2, typesys = pytest.importorskip("rosbags.rosbag2"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    with rosbag2.Writer(tmp_path / "bag", version=9) as writer:
        channels = {t: writer.add_connection(t, kind, typestore=store) for t, kind in KINDS.items()}
        messages(
            typesys,
            store.serialize_cdr,
            lambda topic, now, data: writer.write(channels[topic], now, data),
            store,
        )
    assert_alike(read_signals(said(tmp_path, "bag/bag.db3", OF_TOPICS, time="epoch_ns")), base)


def test_a_library_that_is_not_there_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("h5py", "mcap.reader", "rosbags.highlevel"):
        monkeypatch.setitem(sys.modules, module, None)
    for name in ("ride.h5", "ride.mcap", "ride.bag"):
        (tmp_path / name).write_bytes(b"")
        with pytest.raises(InputError, match=r"not installed.*simrail\[loggers\]") as error:
            read_signals(said(tmp_path, name, OF_ARRAYS))
        assert "\n" not in str(error.value)
