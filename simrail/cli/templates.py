"""Templates: ``simrail new estimator NAME`` writes one file that works, to be changed into one's own.

An estimator, an odometry and a ride are made from the files in ``template_files``; a track, vehicle or
scenario is a copy of a shipped file, and an IMU has the figures of one among all the keys that there are, so
the template is always one that runs. A ride has its data beside it:
simulated, and written as a logger might have, of a device upside down, in deg/s and g, with time stamps in
milliseconds that jitter, and a few samples lost.
"""

from __future__ import annotations

import json
import keyword
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from shlex import quote
from string import Template
from textwrap import wrap
from typing import TYPE_CHECKING

from simrail.core.errors import InputError, did_you_mean, joined, one_of
from simrail.core.toml_files import label, read_toml, shipped

if TYPE_CHECKING:
    import pandas as pd

    from simrail.core.jit import FloatArray

IMU = "lord_3dm_gx4_25"
"""The device whose figures an IMU to begin with has."""

SHIPPED = {
    "track": ("smooth_curve", 'track = "./{file}"', ""),
    "vehicle": ("metro_irw_bogie", 'vehicle = "./{file}"', "look at it: simrail vehicle {path}\n"),
    "imu": (IMU, 'grade = "./{file}" in an [[imu]]', "look at it: simrail imu {path}\n"),
}
KINDS = ("estimator", "odometry", *SHIPPED, "scenario", "ride")


def _filled(file: str, **words: str) -> str:
    """Text of a template, with words in the place of its ``$names``."""
    text = files("simrail.cli").joinpath("template_files", file).read_text(encoding="utf-8")
    return Template(text).substitute(words)


def write_template(kind: str, name: str, *, folder: Path = Path()) -> tuple[Path, str]:
    """Write a template.

    Parameters
    ----------
    kind : str
        ``estimator``, ``odometry``, ``track``, ``vehicle``, ``imu``, ``scenario`` or ``ride``.
    name : str
        Name of the part: a word of letters, digits and ``_``, e.g. ``my_filter``.
    folder : Path, optional
        Where to write it.

    Returns
    -------
    Path, str
        The file, and what to do next.

    Raises
    ------
    InputError
        If there is no such kind, the name is none, or the file exists.
    """
    guess = did_you_mean(kind, KINDS)
    one_of(kind, KINDS, "there is no template of this kind", field="KIND", remedy=guess)
    path = _place(name, folder, ".py" if kind in ("estimator", "odometry") else ".toml")
    data = _place(name, folder, ".csv") if kind == "ride" else None
    if data is not None:
        text, logged = ride_template(name)
        data.write_text(logged, encoding="utf-8")
        next_step = f"its data: {label(data)}\ntry it: simrail estimate {quote(label(path))}"
    elif kind in ("estimator", "odometry"):
        text, next_step = _of_class(kind, name, path)
    elif kind == "scenario":
        text, next_step = (
            _copy("scenario", "quick_kinematic", name),
            f"run it: simrail run {quote(label(path))}",
        )
    else:
        source, use, look = SHIPPED[kind]
        text = imu_template(name) if kind == "imu" else _copy(kind, source, name)
        next_step = look.format(path=quote(label(path)))
        next_step += f"use it in a scenario beside it: {use.format(file=path.name)}"
    path.write_text(text, encoding="utf-8")
    return path, next_step


def _place(name: str, folder: Path, ending: str) -> Path:
    """The file that a part of this name is written to; refuses names that are none, and files that exist."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or keyword.iskeyword(name):
        raise InputError(
            "is no name for a file",
            field="NAME",
            value=name,
            limit="letters, digits and _, a letter first, and no word of Python",
            remedy="e.g. my_filter",
        )
    if not folder.is_dir():
        raise InputError(
            "there is no such folder",
            field="--in",
            value=str(folder),
            limit="a folder that exists",
            remedy="make it first",
        )
    path = folder / f"{name}{ending}"
    if path.exists():
        raise InputError(
            "the file exists",
            file=label(path),
            limit="a file that does not exist yet",
            remedy="choose another name, or move the file away",
        )
    return path


def write_track(
    name: str,
    source: Path,
    *,
    folder: Path = Path(),
    alignment: str | None = None,
    step_smoothing_m: float | None = None,
) -> tuple[Path, list[str]]:
    """Write a track file of what another program's file says.

    Parameters
    ----------
    name : str
        Name of the track.
    source : Path
        LandXML, IFC 4.3, or a table of curvature over distance.
    folder : Path, optional
        Where to write it.
    alignment : str, optional
        Which one, of a LandXML or IFC file with several.
    step_smoothing_m : float, optional
        Length over which steps of curvature are smoothed.

    Returns
    -------
    Path, list of str
        The file, and what is to be told; it stands at the head of the file too.

    Raises
    ------
    InputError
        As of `write_template`, or if the file describes no line.
    """
    from simrail.track.file import track_text
    from simrail.track.foreign_file import design_from_file

    path = _place(name, folder, ".toml")
    design, notes = design_from_file(source, alignment=alignment, step_smoothing_m=step_smoothing_m)
    text = track_text(replace(design, name=name))
    path.write_text("".join(f"# {note}\n" for note in notes) + text, encoding="utf-8")
    return path, notes


def _of_class(kind: str, name: str, path: Path) -> tuple[str, str]:
    class_name = "".join(word[:1].upper() + word[1:] for word in name.split("_") if word)
    text = _filled(f"{kind}.py.txt", Class=class_name)
    if kind == "odometry":
        setting = quote(f'odometry="{label(path)}:{class_name}"')
        return text, (
            f'use it in a scenario beside it: odometry = "./{path.name}:{class_name}"\n'
            f"or try it at once: simrail run quick_kinematic --set {setting}"
        )
    return text, (
        f'use it in a scenario beside it:\n\n    [[estimator]]\n    name = "{name}"\n'
        f'    method = "{path.name}:{class_name}"\n\n'
        f"or try it at once: simrail run quick_kinematic "
        # Quoted: some shells take brackets for a pattern of file names.
        f"--set {quote(f'estimator[0].method={label(path)}:{class_name}')} "
        f"--set 'estimator[0].name={name}' --set 'estimator[0].options={{}}'"
    )


def _copy(kind: str, source: str, name: str) -> str:
    text = shipped(kind)[source].read_text(encoding="utf-8")
    return f"# {name}: a copy of the shipped {kind} {source!r}, to be changed.\n\n{text}"


def imu_template(name: str) -> str:
    """Text of an IMU file with every key that there is: the figures of a device, the others commented out."""
    from simrail.recording.sheets.figures import FIGURES, MEANINGS, QUANTITIES
    from simrail.recording.sheets.imu_file import ImuHead

    given = read_toml(shipped("imu")[IMU])
    lines = [
        f"# {name}: the figures of the shipped imu {IMU!r}, to be changed into those of your data sheet.",
        "# Every key that there is stands here: put # before what the sheet does not print, and take it away",
        "# from what it does. Of a quantity in two units give one. A figure in the words of the sheet, as in",
        "# 'angle_random_walk = \"0.34 deg/sqrt(h)\"', is refused with the line to write in its place.",
        "",
    ]
    for key, field in ImuHead.model_fields.items():
        lines += [
            *wrap(str(field.description), 110, initial_indent="# ", subsequent_indent="# "),
            _entry(key, given.get(key, field.default), commented=key not in given),
        ]
    for quantity, meaning in MEANINGS.items():
        lines += ["", *wrap(meaning, 110, initial_indent="# ", subsequent_indent="# ")]
        for key in QUANTITIES[quantity]:
            entry = _entry(key, given.get(key, _usual(key)), commented=key not in given)
            lines.append(f"{entry}  # {FIGURES[key].unit}")
    return "\n".join(lines) + "\n"


def _usual(key: str) -> float:
    """What an IMU has whose file does not say a figure, in its unit; a bandwidth where there is none."""
    from simrail.recording.sheets.figures import FIGURES
    from simrail.recording.sheets.grades import ImuGrade

    figure = FIGURES[key]
    value = getattr(ImuGrade("usual", 1.0), figure.field)
    return 100.0 if value is None else float(value / figure.si)


def _entry(key: str, value: object, *, commented: bool) -> str:
    """One line of a TOML file."""
    text = joined(value) if isinstance(value, str) else value
    # Text, numbers, truth and lists of numbers are written alike in JSON and TOML.
    return f"{'# ' if commented else ''}{key} = {json.dumps(text, ensure_ascii=False)}"


def ride_template(name: str) -> tuple[str, str]:
    """Text of a ride file, and of the logger's file that it names (``<name>.csv``)."""
    # It simulates: too heavy for the other templates.
    from simrail.recording.sheets.imu_file import load_grade
    from simrail.ride.kinematic import kinematic_truth
    from simrail.ride.truth import Mount
    from simrail.sensors.encoder import EncoderSpec
    from simrail.sensors.measure import measure
    from simrail.track.file import track_by_name
    from simrail.vehicle.speed_profile import SpeedProfile

    track = track_by_name("smooth_curve")
    profile = SpeedProfile(start_m=110.0, end_m=330.0, speed_mps=12.0, rest_s=5.0, final_rest_s=2.0)
    truth = kinematic_truth(track, profile)
    recording = measure(
        truth,
        name=name,
        mount=Mount("imu", truth.body_names[0], (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec(truth.wheel_names[0], radius="calibrated"),
        seed=1,
        draw=0,
    )
    assert recording.encoder is not None and recording.encoder_sheet is not None
    start, radius = f"{recording.start_position_m:.1f}", f"{recording.encoder_sheet.wheel_radius_m:.4f}"
    text = _filled("ride.toml.txt", name=name, start=start, radius=radius)
    return text, _logged(recording.imu, recording.encoder)


def _logged(imu: pd.DataFrame, encoder: pd.DataFrame) -> str:
    """A logger's CSV, at 100 Hz, of what IMU and encoder recorded."""
    import numpy as np
    import pandas as pd

    from simrail.core.columns import ACCEL, GYRO
    from simrail.core.seeds import stream
    from simrail.recording.sheets.units import STANDARD_GRAVITY_MPS2

    time = imu.index.to_numpy()
    generator = stream(1, "template", "ride")
    count = int((time[-1] - time[0]) * 100.0) - 1
    stamps = time[0] + (np.arange(count) + generator.uniform(0.0, 0.3, count)) / 100.0
    stamps = np.round(np.delete(stamps, [1200, 1201, 1707]), 4)

    columns: dict[str, FloatArray] = {"t_ms": np.round(1e3 * stamps, 1)}
    for names, letter, scale in ((GYRO, "w", np.pi / 180.0), (ACCEL, "a", STANDARD_GRAVITY_MPS2)):
        for name, axis, sign in zip(names, "xyz", (1.0, -1.0, -1.0), strict=True):
            columns[letter + axis] = np.round(sign * np.interp(stamps, time, imu[name]) / scale, 5)
    counted = np.interp(stamps, encoder.index.to_numpy(), encoder["pulse_count"].to_numpy())
    columns["pulses"] = np.floor(counted).astype(np.int64)
    return str(pd.DataFrame(columns).to_csv(index=False, lineterminator="\n"))
