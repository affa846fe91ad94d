"""A recording as one MCAP file of ROS 2 messages, as Foxglove, PlotJuggler, Rerun and ``ros2 bag`` read it.

Inertial sensors are ``sensor_msgs/msg/Imu`` without an orientation, magnetometers
``sensor_msgs/msg/MagneticField``; what ROS has no message for is a message of its own
(``simrail_msgs/msg/...``) with a header and simrail's columns, whose definition, with units and meanings,
stands in the file. Values keep all their bits; stamps count nanoseconds since the start of the recording. A
header's ``frame_id`` is the mount and its axes: ``axle_flu``, or ``axle_frd`` of an export in NED.

Forms: MCAP specification (mcap.dev/spec), ROS 2's common_interfaces (sensor_msgs), REP 103 (axes), REP 145
(covariance -1 where an IMU has no orientation).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.columns import ACCEL, COLUMNS, GYRO, MAGNETIC
from simrail.recording.files.ned import BODY_AXES, Frame, in_ned, is_turned, ned_name
from simrail.recording.files.table_file import library
from simrail.recording.signals import Signal

IMU_KIND, FIELD_KIND = "sensor_msgs/msg/Imu", "sensor_msgs/msg/MagneticField"

PLACES = {
    **{name: f"angular_velocity.{axis}" for name, axis in zip(GYRO, "xyz", strict=True)},
    **{name: f"linear_acceleration.{axis}" for name, axis in zip(ACCEL, "xyz", strict=True)},
    **{name: f"magnetic_field.{axis}" for name, axis in zip(MAGNETIC, "xyz", strict=True)},
}
"""Where a column stands in a message of ROS; all others stand in one of our own, by their names."""

_STAMP = "header.stamp"
_AXES: dict[Frame, str] = {"flu": "flu", "ned": "frd"}


@dataclass(frozen=True)
class Topic:
    """What one topic holds.

    Attributes
    ----------
    name : str
        The signal, or what else it is: the topic is called ``/name``.
    frame : pandas.DataFrame
        simrail's columns, in its own axes; indexed by ``time_s``, or, where it is not, with a ``start_s``.
    mount : str
        What its vectors are fixed to; empty where there are none.
    """

    name: str
    frame: pd.DataFrame
    mount: str = ""

    @property
    def kind(self) -> str:
        """Its kind of message."""
        columns = set(self.frame.columns)
        if columns == {*GYRO, *ACCEL}:
            return IMU_KIND
        if columns == {*MAGNETIC}:
            return FIELD_KIND
        return "simrail_msgs/msg/" + "".join(word.capitalize() for word in self.name.split("_"))

    @property
    def stamps(self) -> np.ndarray:
        """Nanoseconds since the start, int64."""
        times = self.frame.index if self.frame.index.name == "time_s" else self.frame["start_s"]
        return np.rint(1e9 * times.to_numpy(dtype=np.float64)).astype(np.int64)


def needs_mcap(path: Path) -> tuple[Any, Any]:
    """The libraries that write MCAP.

    Raises
    ------
    InputError
        If one is not installed, naming the extra that has it.
    """
    instead = "write csv or parquet"
    return library("mcap.writer", path, instead=instead), library("rosbags.typesys", path, instead=instead)


def write_mcap(path: Path, topics: Sequence[Topic], *, axes: Frame = "flu") -> None:
    """Write topics into one file, sorted by time.

    Parameters
    ----------
    path : Path
        The file.
    topics : sequence of Topic
        What it holds.
    axes : {"flu", "ned"}
        Axes of the vectors: simrail's own, or FRD and NED, named in ``frame_id`` and columns.

    Raises
    ------
    InputError
        If a library is missing.
    """
    writing, typesys = needs_mcap(path)
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    first = min((int(topic.stamps[0]) for topic in topics if len(topic.frame)), default=0)
    with path.open("wb") as file:
        writer = writing.Writer(file, compression=writing.CompressionType.ZSTD)
        writer.start(profile="ros2", library="simrail")
        queue: list[tuple[np.ndarray, int, Callable[[int], bytes]]] = []
        for topic in topics:
            frame = topic.frame if axes == "flu" else in_ned(topic.frame)
            if topic.kind not in store.types:
                store.register(typesys.get_types_from_msg(_definition(topic, axes), topic.kind))
            text = store.generate_msgdef(topic.kind, ros_version=2)[0]
            if topic.kind.startswith("simrail_msgs"):
                _, dependencies = text.split("=" * 80, maxsplit=1)
                text = f"{_definition(topic, axes)}{'=' * 80}{dependencies}"
            schema = writer.register_schema(name=topic.kind, encoding="ros2msg", data=text.encode())
            channel = writer.register_channel(f"/{topic.name}", "cdr", schema)
            frame_id = f"{topic.mount}_{_AXES[axes]}" if topic.mount else "track"
            queue.append((topic.stamps, channel, _encoder(store, topic, frame, frame_id)))
        # A stamp of a second clock may lie before the start: time of writing has no sign, the header's has.
        late = -min(first, 0)
        order = np.argsort(np.concatenate([stamps for stamps, *_ in queue]), kind="stable")
        owner = np.repeat(np.arange(len(queue)), [len(stamps) for stamps, *_ in queue])
        begins = np.concatenate(([0], np.cumsum([len(stamps) for stamps, *_ in queue])))
        for place in order:
            stamps, channel, encoded = queue[owner[place]]
            row = int(place - begins[owner[place]])
            written = int(stamps[row]) + late
            writer.add_message(channel, written, encoded(row), written, sequence=row)
        writer.finish()


def mcap_table(signal: Signal, columns: Sequence[str], *, axes: Frame) -> dict[str, object]:
    """What a ride file says of a signal that stands in such a file, so that it reads as it was.

    Parameters
    ----------
    signal : Signal
        The signal.
    columns : sequence of str
        Its columns, as the recording has them.
    axes : {"flu", "ned"}
        Axes in which it was written.
    """
    names: dict[str, object] = {}
    units: dict[str, str] = {}
    if signal.timed:
        names["time"], units["time"] = f"/{signal.name}.{_STAMP}", "ns"
    for quantity in signal.quantities:
        if not set(quantity.columns) <= {*columns}:
            continue
        places = [f"/{signal.name}.{_place(column, axes)}" for column in quantity.columns]
        names[quantity.key] = places if len(places) > 1 else places[0]
        if axes == "ned" and len(places) == 1 and is_turned(quantity.columns[0]):
            units[quantity.key] = f"-{next(iter(quantity.units))}"
    vectors = any(len(quantity.columns) == 3 for quantity in signal.quantities)
    said: dict[str, object] = {"columns": names}
    if units:
        said["units"] = units
    if axes == "ned" and vectors:
        said["axes"] = list(BODY_AXES)
    return said


def _place(column: str, axes: Frame) -> str:
    """Where a column stands in its message."""
    return PLACES.get(column) or (column if axes == "flu" else ned_name(column))


def _definition(topic: Topic, axes: Frame) -> str:
    """The definition of a message of our own: a header, and a line for each column."""
    lines = ["std_msgs/Header header"]
    for name, kind in topic.frame.dtypes.items():
        known = COLUMNS.get(str(name))
        said = f"  # {known.unit}, {known.frame}: {known.meaning}" if known else ""
        column = str(name) if axes == "flu" else ned_name(str(name))
        lines.append(f"{'int64' if np.issubdtype(kind, np.integer) else 'float64'} {column}{said}")
    return "\n".join(lines) + "\n"


def _encoder(store: Any, topic: Topic, frame: pd.DataFrame, frame_id: str) -> Callable[[int], bytes]:
    """A function from the number of a row to its message."""
    make = store.types
    stamps, columns = topic.stamps.tolist(), [frame[name].tolist() for name in frame.columns]
    rows = list(zip(*columns, strict=True))
    unknown = np.zeros(9)
    vector = make["geometry_msgs/msg/Vector3"]
    no_orientation: Mapping[str, object] = {
        "orientation": make["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        "orientation_covariance": np.r_[-1.0, np.zeros(8)],
    }

    def encoded(row: int) -> bytes:
        seconds, rest = divmod(stamps[row], 10**9)
        stamp = make["builtin_interfaces/msg/Time"](sec=seconds, nanosec=rest)
        header = make["std_msgs/msg/Header"](stamp=stamp, frame_id=frame_id)
        values = rows[row]
        if topic.kind == IMU_KIND:
            message = make[IMU_KIND](
                header=header,
                **no_orientation,
                angular_velocity=vector(*values[:3]),
                angular_velocity_covariance=unknown,
                linear_acceleration=vector(*values[3:]),
                linear_acceleration_covariance=unknown,
            )
        elif topic.kind == FIELD_KIND:
            message = make[FIELD_KIND](
                header=header, magnetic_field=vector(*values), magnetic_field_covariance=unknown
            )
        else:
            message = make[topic.kind](header, *values)
        return bytes(store.serialize_cdr(message, topic.kind))

    return encoded
