"""Where the numbers of a campaign come from: which parts are synthetic, and how to make it again."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.recording.sheets.imu_file import ImuFile
from simrail.scenario.line_tables import IrregularityPart
from simrail.scenario.scenario import Scenario
from simrail.track.rail_condition import FRICTION
from simrail.vehicle.file import VehicleFile


class Part(NamedTuple):
    """One part of the scenario: kind and name, ``"synthetic"`` or what else it is, its file's source."""

    what: str
    name: str
    synthetic: str
    source: str


def parts(scenario: Scenario, cells: pd.DataFrame, examples: Sequence[CellResult]) -> list[Part]:
    """Every part that the campaign used, with its source."""
    tracks = {example.line.name: example.line for example in examples}
    result = [Part("track", name, _word(track.synthetic), track.source) for name, track in tracks.items()]
    if scenario.spec.irregularity is not None:
        result += _irregularities(scenario.spec.irregularity)
    for at in scenario.spec.rail_condition:
        if at.condition is None:
            source = "friction as the scenario says"
        elif at.condition == "dry":
            source = "friction as the vehicle file says"
        else:
            source = f"friction {FRICTION[at.condition]:g}, a nominal value of this project"
        where = f"{at.words}, {at.start_m:g} to {at.end_m:g} m"
        result.append(Part("rail condition", where, "synthetic", source))
    for example in examples:
        for name, source in (example.shaken or {}).items():
            word = "synthetic" if source.startswith("synthetic") else "from levels"
            told = source.removeprefix("synthetic").removeprefix(": ") or "figures of this project"
            result.append(Part("vibration", name.replace("_", " "), word, told))
    for name in _names(cells, "vehicle"):
        word, source = "synthetic", "a body that follows the rails exactly; no vehicle file"
        with suppress(InputError):
            vehicle = load(VehicleFile, "vehicle", name, folder=scenario.folder)
            word, source = _word(vehicle.synthetic), f"{vehicle.title}. {vehicle.source}"
        result.append(Part("vehicle", name, word, source))
    for name in _names(cells, "imu"):
        with suppress(InputError):
            imu = load(ImuFile, "imu", name, folder=scenario.folder)
            assumed = f" Assumed: {imu.assumed}" if imu.assumed else ""
            result.append(Part("IMU", name, "simulated", f"{imu.title} ({imu.source}).{assumed}"))
    return list(dict.fromkeys(result))


def _irregularities(part: IrregularityPart) -> list[Part]:
    """What makes the rails deviate from the design: a spectrum, a file, defects."""
    result = []
    if part.spectrum != "none" or not (part.measured or part.defect):
        shortest, longest = part.wavelengths_m
        source = f"random draw from the spectrum, wavelengths {shortest:g} to {longest:g} m"
        result.append(Part("irregularity", str(part.spectrum), "synthetic", source))
    if part.measured is not None:
        columns = ", ".join(name for name in part.measured.columns if name != "position")
        result.append(Part("measured rails", part.measured.file, "from a file", columns.replace("_", " ")))
    for at in part.defect:
        shape = f"{at.form} of {at.size_mm:g} mm over {at.length_m:g} m at {at.at_m:g} m"
        result.append(
            Part("defect", shape, "synthetic", f"as the scenario says; {at.rails} rails, {at.direction}")
        )
    return result


def _word(is_synthetic: bool) -> str:
    return "synthetic" if is_synthetic else "as published"


def _names(cells: pd.DataFrame, column: str) -> list[str]:
    return [str(name) for name in cells[column].unique()] if column in cells else []


_WORDS = {
    "scenario_hash": "hash of the scenario and its parts",
    "seed": "seed",
    "settings": "settings",
    "engine": "engine",
    "earth": "Earth",
    "temperature": "temperature of the IMUs",
    "real_time_factor": "real-time factor of the simulation",
    "cells": "cells",
    "failed": "failed",
    "stop": "stop rule",
    "warnings": "warnings",
    "wall_s": "wall time, s",
    "started_utc": "started (UTC)",
    "git_revision": "revision of simrail",
    "versions": "versions",
    "platform": "platform",
}


def facts(manifest: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The manifest as pairs of words, what is long left to manifest.json."""
    values = {key: manifest[key] for key in _WORDS if manifest.get(key) not in (None, [], {}, "")}
    return [(_WORDS[k], value["told"] if k == "stop" else _plain(value)) for k, value in values.items()]


def _plain(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(part)}" for key, part in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_plain(part) for part in value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)
