"""Where the numbers of a campaign come from: which parts are synthetic, and how to make it again."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from simrail.campaign.cell import CellResult
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.recording.sheets.imu_file import ImuFile
from simrail.scenario.scenario import Scenario
from simrail.track.rail_condition import FRICTION
from simrail.vehicle.file import VehicleFile


@dataclass(frozen=True)
class Part:
    """One part of the scenario.

    Attributes
    ----------
    what, name : str
        Kind and name.
    synthetic : str
        ``"synthetic"``, or what else it is.
    source : str
        What its file says of its source.
    """

    what: str
    name: str
    synthetic: str
    source: str


def parts(scenario: Scenario, cells: pd.DataFrame, examples: Sequence[CellResult]) -> list[Part]:
    """Every part that the campaign used, with its source."""
    result: dict[tuple[str, str], Part] = {}
    for example in examples:
        track = example.recording.track
        word = "synthetic" if track.synthetic else "as published"
        result["track", track.name] = Part("track", track.name, word, track.source)
    irregularity = scenario.spec.irregularity
    if irregularity is not None:
        shortest, longest = irregularity.wavelengths_m
        source = f"random draw from the spectrum, wavelengths {shortest:g} to {longest:g} m"
        spectrum = str(irregularity.spectrum)
        result["irregularity", spectrum] = Part("irregularity", spectrum, "synthetic", source)
    for at in scenario.spec.rail_condition:
        where = f"{at.words}, {at.start_m:g} to {at.end_m:g} m"
        if at.condition is None:
            source = "friction as the scenario says"
        elif at.condition == "dry":
            source = "friction as the vehicle file says"
        else:
            source = f"friction {FRICTION[at.condition]:g}, a nominal value of this project"
        result["rail condition", where] = Part("rail condition", where, "synthetic", source)
    for name in _names(cells, "vehicle"):
        try:
            vehicle = load(VehicleFile, "vehicle", name, folder=scenario.folder)
        except InputError:
            source = "a body that follows the rails exactly; no vehicle file"
            result["vehicle", name] = Part("vehicle", name, "synthetic", source)
        else:
            word = "synthetic" if vehicle.synthetic else "as published"
            result["vehicle", name] = Part("vehicle", name, word, f"{vehicle.title}. {vehicle.source}")
    for name in _names(cells, "imu"):
        try:
            imu = load(ImuFile, "imu", name, folder=scenario.folder)
        except InputError:
            continue
        assumed = f" Assumed: {imu.assumed}" if imu.assumed else ""
        result["imu", name] = Part("IMU", name, "simulated", f"{imu.title} ({imu.source}).{assumed}")
    return list(result.values())


def _names(cells: pd.DataFrame, column: str) -> list[str]:
    return [str(name) for name in cells[column].unique()] if column in cells else []


def facts(manifest: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The manifest as pairs of words, what is long left to manifest.json."""
    listed: list[tuple[str, str]] = []
    for key, word in _WORDS.items():
        value = manifest.get(key)
        if value is None or value in ([], {}, ""):
            continue
        listed.append((word, value["told"] if key == "stop" else _plain(value)))
    return listed


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


def _plain(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(part)}" for key, part in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_plain(part) for part in value)
    return f"{value:.3g}" if isinstance(value, float) else str(value)
