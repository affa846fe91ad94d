"""A ride file with what its recording found wrong set right: its text in, its text out.

Only what is judged wrong is changed, each by the setting that its finding names. The data files are not
touched. Comments of the ride file are not kept.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simrail.core.atomic_files import write_whole
from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.core.rotation import euler_angles, rotation_matrix
from simrail.core.toml_files import judge, label, read_toml, toml_text
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence
from simrail.recording.files.ride_file import RideFile
from simrail.recording.files.ride_reader import ride_file

ANGLES = ("roll", "pitch", "yaw")


def write_mended(path: Path, evidence: Evidence, out: Path) -> list[str]:
    """Write a ride file that has what is wrong set right; it appears whole or not at all.

    Parameters
    ----------
    path : Path
        The ride file, or its folder.
    evidence : Evidence
        What was found of it.
    out : Path
        The new ride file; must not exist yet.

    Returns
    -------
    list of str
        The settings that were changed, as ``key = value (before)``.

    Raises
    ------
    InputError
        If the new file exists, or nothing is wrong that a setting could mend.
    """
    if out.exists():
        raise InputError(
            "exists already",
            file=label(out),
            field="--write",
            limit="a file that does not exist yet",
            remedy="choose another name",
        )
    if not out.parent.is_dir():
        raise InputError(
            "no such folder",
            file=label(out.parent),
            field="--write",
            limit="a folder that exists",
            remedy="make it first",
        )
    path = ride_file(path)
    data = read_toml(path)
    changes = mended(data, evidence)
    if not changes:
        raise InputError(
            "nothing is wrong that a setting could mend",
            file=label(path),
            field="--write",
            limit="a fault that a setting mends",
        )
    _move(data, path.parent, out.parent)
    text = toml_text(data)
    judge(RideFile, data, file=label(out))
    write_whole(out, text.encode(), what="ride file", field="--write", remedy="choose another place")
    return changes


def mended(data: dict[str, Any], evidence: Evidence) -> list[str]:
    """Set right what is wrong in the tables of a ride file, in place; returns what was changed."""
    wrong = {finding.key: finding for finding in evidence.wrong if finding.setting}
    changes: list[str] = []
    for mark, table in (("", "imu"), ("second_", "second_imu")):
        if f"{mark}gyro" in wrong:
            _multiply(data, f"{table}.scale.gyro", 1.0 / wrong[f"{mark}gyro"].value, changes)
        _scale_axes(data, table, wrong, mark, changes)
        if f"{mark}accel" in wrong:
            _multiply(data, f"{table}.scale.accel", 1.0 / wrong[f"{mark}accel"].value, changes)
        found = {key: wrong[f"{mark}{key}"].value for key in ANGLES if f"{mark}{key}" in wrong}
        if found:
            _turn(data, table, found, changes)
        beside = {key: wrong[f"{mark}gyro_{key}"].value for key in ANGLES if f"{mark}gyro_{key}" in wrong}
        if beside:
            _turn(data, f"{table}.gyro", beside, changes)
    if "wheel" in wrong:
        _mend_wheel(data, wrong["wheel"], changes)
    if "shift" in wrong:
        _add(data, "start_position_m", wrong["shift"].value, changes)
    if "spacing" in wrong:
        _set(
            data, "second_imu.spacing_m", round(wrong["spacing"].value, 2), wrong["spacing"].nominal, changes
        )
    for mark in ("", "second_"):
        offset = wrong[f"{mark}offset"].value if f"{mark}offset" in wrong else 0.0
        if f"{mark}drift" in wrong:
            slow = wrong[f"{mark}drift"]
            _add(data, slow.setting, slow.value, changes)
            offset = evidence.of(f"{mark}offset").value - 1e-6 * slow.value * evidence.middle_s
        if offset:
            _add(data, evidence.of(f"{mark}offset").setting, offset, changes)
        if f"{mark}gyro_offset" in wrong:
            apart = wrong[f"{mark}gyro_offset"]
            whole = _table(data, apart.setting.rpartition(".")[0].rpartition(".")[0] + ".time_offset_s")
            _table(data, apart.setting).setdefault("time_offset_s", whole.get("time_offset_s", 0.0))
            _add(data, apart.setting, apart.value, changes)
    if "magnetometer_offset" in wrong:
        found_offset = wrong["magnetometer_offset"]
        _add(data, found_offset.setting, found_offset.value, changes)
    return changes


def _scale_axes(
    data: dict[str, Any], table: str, wrong: Mapping[str, Finding], mark: str, changes: list[str]
) -> None:
    """Factors of single columns, each that of the axis of the device which points along the body's."""
    for kind, names in (("gyro", GYRO), ("accel", ACCEL)):
        found = {
            i: wrong[key].value for i, name in enumerate(names) if (key := f"{mark}alone_{name}") in wrong
        }
        if not found:
            continue
        setting, axes = f"{table}.scale.{kind}", data[table].get("axes", ["x", "y", "z"])
        before = _table(data, setting).get(kind, 1.0)
        factors = [float(factor) for factor in (before if isinstance(before, list) else 3 * [before])]
        for axis, value in found.items():
            column = "xyz".index(str(axes[axis]).removeprefix("-"))
            factors[column] = float(f"{factors[column] / value:.6g}")
        _table(data, setting)[kind] = factors
        changes.append(f"{setting} = {factors} (before: {before})")


def _mend_wheel(data: dict[str, Any], wheel: Finding, changes: list[str]) -> None:
    """Radius or scale; or the direction, where that is wrong."""
    if wheel.value < 0.0:
        before = bool(_table(data, wheel.setting).get("reverse", False))
        _set(data, wheel.setting, not before, before, changes)
    elif wheel.setting == "odometer.scale":
        quantity = "distance" if "distance" in data["odometer"].get("columns", {}) else "speed"
        _multiply(data, f"{wheel.setting}.{quantity}", wheel.value, changes)
    else:
        _multiply(data, wheel.setting, wheel.value, changes)


def _turn(data: dict[str, Any], table: str, wrong: Mapping[str, float], changes: list[str]) -> None:
    """Mounting angles: those that are given, turned on by those that were found, degrees.

    A sensor of an IMU has those of the IMU, where it has none of its own.
    """
    imu, _, sensor = table.partition(".")
    own = data[imu].setdefault(sensor, {}) if sensor else data[imu]
    given = [float(own.get(f"{key}_deg", data[imu].get(f"{key}_deg", 0.0))) for key in ANGLES]
    found = np.radians([[wrong.get(key, 0.0) for key in ANGLES]])
    angles = np.degrees(euler_angles(rotation_matrix(found) @ rotation_matrix(np.radians([given]))))[0]
    for key, angle, before in zip(ANGLES, angles, given, strict=True):
        if abs(angle - before) > 1e-6:
            _set(data, f"{table}.{key}_deg", float(f"{angle:.5g}"), before, changes)


def _table(data: dict[str, Any], setting: str) -> dict[str, Any]:
    """The table that a dotted setting stands in; made where it is not there."""
    table = data
    for name in setting.split(".")[:-1]:
        table = table.setdefault(name, {})
    return table


def _set(data: dict[str, Any], setting: str, value: object, before: object, changes: list[str]) -> None:
    _table(data, setting)[setting.rpartition(".")[2]] = value
    shown = [str(word).lower() if isinstance(word, bool) else f"{word:g}" for word in (value, before)]
    changes.append(f"{setting} = {shown[0]} (before: {shown[1]})")


def _multiply(data: dict[str, Any], setting: str, factor: float, changes: list[str]) -> None:
    before = _table(data, setting).get(setting.rpartition(".")[2], 1.0)
    if isinstance(before, list):
        factors = [float(f"{one * factor:.6g}") for one in before]
        _table(data, setting)[setting.rpartition(".")[2]] = factors
        changes.append(f"{setting} = {factors} (before: {before})")
        return
    _set(data, setting, float(f"{float(before) * factor:.6g}"), float(before), changes)


def _add(data: dict[str, Any], setting: str, value: float, changes: list[str]) -> None:
    before = float(_table(data, setting).get(setting.rpartition(".")[2], 0.0))
    _set(data, setting, round(before + value, 4), before, changes)


def _move(data: dict[str, Any], folder: Path, other: Path) -> None:
    """Paths of a ride file, seen from another folder."""
    if folder.resolve() == other.resolve():
        return
    for table, key in [
        (data, "track"),
        *((part, "file") for part in _parts(data)),
        *((part, "grade") for part in _parts(data)),
    ]:
        named = table.get(key)
        if isinstance(named, str) and not Path(named).is_absolute() and (folder / named).is_file():
            table[key] = f"./{Path(os.path.relpath(folder / named, other)).as_posix()}"


def _parts(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Every table of a ride file, and those inside."""
    inner = [value for value in data.values() if isinstance(value, dict)]
    return [part for table in inner for part in (table, *_parts(table))]
