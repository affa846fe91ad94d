"""Recordings of robots' middleware: MCAP (with ROS 2, ROS 1 or JSON messages), rosbag2 and rosbag.

A column is called by its topic and the place in the message: ``/imu/data.angular_velocity.x``. A stamp
(``/imu/data.header.stamp``) is its nanoseconds, and so is ``/imu/data.log_time``, when the message was
written: ``units.time = "epoch_ns"``, or ``"ns"`` where it does not count from 1970.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.toml_files import label
from simrail.recording.files.table_file import Table, library, refuse_texts, unreadable

LOG_TIME = "log_time"

Message = tuple[str, int, Any]
"""Topic, time of writing in ns, and the message: nested mappings or objects."""


def open_bag(path: Path) -> Table:
    """Open an MCAP file, a rosbag2 (by its ``.db3``) or a rosbag (``.bag``).

    Raises
    ------
    InputError
        If it cannot be read, or a library is missing.
    """
    messages = _mcap_messages if path.suffix.lower() == ".mcap" else _rosbag_messages
    firsts: dict[str, list[str]] = {}
    for topic, _, message in messages(path, None, first=True):
        firsts[topic] = [f"{topic}.{LOG_TIME}", *(f"{topic}.{place}" for place, _ in _numbers(message, ""))]
    owner = {name: topic for topic, names in firsts.items() for name in names}

    def read(wanted: Sequence[str], texts: Sequence[str]) -> dict[str, FloatArray | pd.Series]:
        refuse_texts(path, texts)
        topics = {owner[name] for name in wanted}
        if len(topics) > 1:
            raise InputError(
                "its columns are of several topics",
                file=label(path),
                value=sorted(topics),
                limit="one topic for a signal",
                remedy="give sensors with topics of their own a table each, e.g. [imu.gyro] and [imu.accel]",
            )
        (topic,) = topics
        places = [name.removeprefix(f"{topic}.") for name in wanted]
        rows = [
            [written if place == LOG_TIME else _value(message, place) for place in places]
            for _, written, message in messages(path, topic, first=False)
        ]
        # Nanoseconds since 1970 are whole numbers beyond those of a float.
        columns = zip(*rows, strict=True)
        return {name: np.array(column) for name, column in zip(wanted, columns, strict=True)}

    return Table(tuple(owner), read)


def _mcap_messages(path: Path, topic: str | None, *, first: bool) -> Iterator[Message]:
    """Messages of a topic, or the first of each."""
    reader = library("mcap.reader", path)
    decoders: dict[int, Callable[[bytes], Any]] = {}
    seen: set[str] = set()
    try:
        with path.open("rb") as file:
            opened = reader.make_reader(file)
            told = opened.get_summary() if first else None
            topics = {channel.topic for channel in told.channels.values()} if told else set()
            for schema, channel, message in opened.iter_messages(topics=None if topic is None else [topic]):
                if first and channel.topic in seen:
                    continue
                seen.add(channel.topic)
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(schema, channel, path)
                yield channel.topic, int(message.log_time), decoders[channel.id](message.data)
                if first and seen == topics:
                    return  # the rest of a long ride holds no new topic
    except InputError:
        raise
    except Exception as error:  # the library has errors of many kinds
        raise unreadable(
            f"is not readable MCAP ({type(error).__name__})", path, "a whole MCAP file"
        ) from None


def _decoder(schema: Any, channel: Any, path: Path) -> Callable[[bytes], Any]:
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding not in ("cdr", "ros1") or schema is None:
        return lambda _: {}
    typesys = library("rosbags.typesys", path)
    ros2 = channel.message_encoding == "cdr"
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE if ros2 else typesys.Stores.ROS1_NOETIC)
    if schema.name not in store.types and "/msg/" not in schema.name:
        schema_name = schema.name.replace("/", "/msg/")
    else:
        schema_name = schema.name
    text = schema.data.decode()
    parse = typesys.get_types_from_idl if schema.encoding == "ros2idl" else typesys.get_types_from_msg
    types = parse(text) if schema.encoding == "ros2idl" else parse(text, schema_name)
    store.register({name: kind for name, kind in types.items() if name not in store.types})
    read = store.deserialize_cdr if ros2 else store.deserialize_ros1
    return lambda data: read(data, schema_name)


def _rosbag_messages(path: Path, topic: str | None, *, first: bool) -> Iterator[Message]:
    """Messages of a topic of a rosbag, or the first of each."""
    anyreader = library("rosbags.highlevel", path)
    typesys = library("rosbags.typesys", path)
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    place = path.parent if path.suffix.lower() == ".db3" else path
    try:
        with anyreader.AnyReader([place], default_typestore=store) as reader:
            for connection in reader.connections:
                if topic is not None and connection.topic != topic:
                    continue
                for written, data in _of(reader, connection):
                    yield connection.topic, int(written), reader.deserialize(data, connection.msgtype)
                    if first:
                        break
    except InputError:
        raise
    except Exception as error:  # the library has errors of many kinds
        raise unreadable(
            f"is not a readable rosbag ({type(error).__name__})", path, "a whole rosbag"
        ) from None


def _of(reader: Any, connection: Any) -> Iterator[tuple[int, bytes]]:
    for _, written, data in reader.messages(connections=[connection]):
        yield written, data


def _members(message: Any) -> Sequence[tuple[str, Any]]:
    if isinstance(message, dict):
        return list(message.items())
    if hasattr(message, "__dataclass_fields__"):
        return [(name, getattr(message, name)) for name in message.__dataclass_fields__ if name[0] != "_"]
    if isinstance(message, list | np.ndarray):
        return [(str(i + 1), value) for i, value in enumerate(message)] if len(message) <= 64 else []
    return []


def _is_stamp(message: Any) -> bool:
    names = [name for name, _ in _members(message)]
    return names in (["sec", "nanosec"], ["sec", "nsec"])


def _numbers(message: Any, path: str) -> Iterator[tuple[str, float | int]]:
    """Numbers of a message by place; a stamp is one, in ns."""
    for name, value in _members(message):
        place = f"{path}.{name}" if path else name
        if _is_stamp(value):
            (_, seconds), (_, rest) = _members(value)
            yield place, 10**9 * int(seconds) + int(rest)
        elif isinstance(value, bool | int | float | np.number):
            yield place, float(value)
        else:
            yield from _numbers(value, place)


def _value(message: Any, place: str) -> float | int:
    """The number at a place; NaN where a message lacks it."""
    current = message
    for name in place.split("."):
        current = dict(_members(current)).get(name)
    if _is_stamp(current):
        (_, seconds), (_, rest) = _members(current)
        return 10**9 * int(seconds) + int(rest)
    if isinstance(current, int):
        return current
    return float(current) if isinstance(current, float | np.number) else float("nan")
