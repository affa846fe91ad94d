"""simrail: a testbed for inertial sensors on trains.

The way of the data, and the verbs between the nouns::

    scenario = load_scenario("go20a")       # a TOML file                      -> Scenario
    truth    = simulate(ride)               # a vehicle over a laid track      -> Truth       (cached)
    record   = measure(truth, ...)          # what the logger saw              -> Recording
    result   = AttitudeEkf().estimate(record)                                # -> Estimate
    table    = score(result, truth, record) # one row per figure               -> DataFrame
    results  = run("go20a")                 # all of it, for every cell        -> Results, results/go20a/
    record   = read_ride(path)              # a ride of a real train, or one that write_ride wrote

The data vocabulary
-------------------
Data are pandas frames indexed by ``time_s``; every column is named once, in `simrail.columns`. SI and
radians inside, units in names; degrees and millimetres in reports only.

=====================  =========================================================================
frame                  columns
=====================  =========================================================================
IMU signals            ``gyro_{x,y,z}_radps``, ``accel_{x,y,z}_mps2`` (at rest +g on Z)
encoder                ``pulse_count``, and ``edge_time_s`` where the logger times edges
magnetometer           ``magnetic_{x,y,z}_t``
rail displacement      ``rail_{left,right}_{y,z}_m``, seen from the IMU
gaps of the IMU        ``start_s``, ``end_s``, ``missing`` (no time index)
odometry               ``position_m``, ``speed_mps``, ``acceleration_mps2`` and their ``..._sd_...``
attitude               ``roll_rad``, ``pitch_rad``, ``yaw_rad`` (global), ``{angle}_sd_rad``
relative attitude      ``relative_{angle}_rad`` (in the design track frame)
motion of a mount      position, velocity, attitude, IMU, odometry, ``lateral_m``, ``vertical_m``
place in the track     ``lateral_m``, ``vertical_m`` and their ``..._sd_m``
innovations            ``innovation_{x,y,z}_mps2``, ``innovation_{x,y,z}_radps``, ``nis``
rail irregularity      ``alignment_m``, ``vertical_profile_m``, ``cross_level_m``, ``gauge_m``,
                       indexed by ``position_m``
scores                 `simrail.score_table.SCORE_COLUMNS`: one row per quantity, band, reference,
                       window and metric
=====================  =========================================================================

Frames and signs: right-handed, X forward in the direction of increasing s, Y left, Z up; ZYX Euler
angles (yaw, pitch, roll), pitch positive nose down, roll positive left side up. Running backwards
means a negative speed; nothing is turned around. ``position_m`` is the distance s along the
horizontal projection of the track. Gravity is 9.81 m/s2 on a flat Earth that does not turn, unless
`measure` is told otherwise.

The nouns: `TrackDesign`, `Irregularity` and `LaidTrack` (the track), `VehicleModel`, `SpeedProfile`,
`Ride`, `Truth`, `Mount`, `ImuGrade`, `EncoderSpec`, `MagnetometerSpec`, `RailSensorSpec`, `Recording`,
`Estimate`, `Scenario`, `Results`.
A `Recording` holds what the train may know and never a true value; truth and estimate meet in `score`
only. A person's faulty input raises `InputError`, whose text names file, field, value, limit and remedy.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simrail.columns import COLUMNS
    from simrail.errors import InputError
    from simrail.estimate import Estimate, Estimator
    from simrail.line_odometry import with_odometry
    from simrail.measure import measure
    from simrail.profile import SpeedProfile
    from simrail.recording import Recording
    from simrail.results import Results, run
    from simrail.ride import Ride, simulate
    from simrail.scenario.build import Parts
    from simrail.scenario.cells import Cell, cells
    from simrail.scenario.check import judge_scenario
    from simrail.scenario.ride_reader import read_ride
    from simrail.scenario.ride_writer import write_ride
    from simrail.scenario.scenario import Scenario, load_scenario
    from simrail.score import score, score_odometry
    from simrail.score_geometry import score_geometry
    from simrail.sensors.encoder import EncoderSpec
    from simrail.sensors.grades import ImuGrade
    from simrail.sensors.magnetometer import MagnetometerSpec
    from simrail.sensors.rail_sensor import RailSensorSpec
    from simrail.track.design import TrackDesign
    from simrail.track.irregularity import Irregularity
    from simrail.track.laid import LaidTrack, lay
    from simrail.truth import Mount, Truth
    from simrail.vehicle.model import VehicleModel

_HOMES = {
    "columns": ("COLUMNS",),
    "errors": ("InputError",),
    "estimate": ("Estimate", "Estimator"),
    "line_odometry": ("with_odometry",),
    "measure": ("measure",),
    "profile": ("SpeedProfile",),
    "recording": ("Recording",),
    "results": ("Results", "run"),
    "ride": ("Ride", "simulate"),
    "scenario.build": ("Parts",),
    "scenario.cells": ("Cell", "cells"),
    "scenario.check": ("judge_scenario",),
    "scenario.ride_reader": ("read_ride",),
    "scenario.ride_writer": ("write_ride",),
    "scenario.scenario": ("Scenario", "load_scenario"),
    "score": ("score", "score_odometry"),
    "score_geometry": ("score_geometry",),
    "sensors.encoder": ("EncoderSpec",),
    "sensors.grades": ("ImuGrade",),
    "sensors.magnetometer": ("MagnetometerSpec",),
    "sensors.rail_sensor": ("RailSensorSpec",),
    "track.design": ("TrackDesign",),
    "track.irregularity": ("Irregularity",),
    "track.laid": ("LaidTrack", "lay"),
    "truth": ("Mount", "Truth"),
    "vehicle.model": ("VehicleModel",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "COLUMNS",
    "Cell",
    "EncoderSpec",
    "Estimate",
    "Estimator",
    "ImuGrade",
    "InputError",
    "Irregularity",
    "LaidTrack",
    "MagnetometerSpec",
    "Mount",
    "Parts",
    "RailSensorSpec",
    "Recording",
    "Results",
    "Ride",
    "Scenario",
    "SpeedProfile",
    "TrackDesign",
    "Truth",
    "VehicleModel",
    "cells",
    "judge_scenario",
    "lay",
    "load_scenario",
    "measure",
    "read_ride",
    "run",
    "score",
    "score_geometry",
    "score_odometry",
    "simulate",
    "with_odometry",
    "write_ride",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for: ``simrail --version`` must not wait for numba."""
    if name not in _HOME_OF:
        raise AttributeError(f"module 'simrail' has no attribute {name!r}")
    return getattr(import_module(f"simrail.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """The package, whose verbs win over the modules that hold them.

    Importing ``simrail.score`` would bind that module to the name ``score`` of the package, so that
    ``simrail.score(...)`` worked only until then. ``from simrail.score import ...`` is not affected.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOME_OF and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
