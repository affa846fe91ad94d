"""simrail: a testbed for inertial sensors on trains.

The way of the data, and the verbs between the nouns::

    scenario = load_scenario("go20a")       # a TOML file                      -> Scenario
    truth    = simulate(ride)               # a vehicle over a laid track      -> Truth       (cached)
    record   = measure(truth, ...)          # what the logger saw              -> Recording
    record   = with_odometry(record, "curve_matched")   # where the train is   -> Recording
    result   = AttitudeEkf().estimate(record)                                # -> Estimate
    rails    = fuse([result, ...])          # rails of several rides           -> Fused
    table    = score(result, truth, record) # one row per figure               -> DataFrame
    results  = run("go20a")                 # all of it, for every cell        -> Results, results/go20a/
    figure   = show(result)                 # any of these nouns, drawn
    record   = read_ride(path)              # a ride of a real train, or one that write_ride wrote

The data vocabulary
-------------------
Data are pandas frames indexed by ``time_s``; every column is named once, in `simrail.core.columns`. SI and
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
scores                 `simrail.scoring.table.SCORE_COLUMNS`: one row per quantity, band, reference,
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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simrail.core.columns import COLUMNS
    from simrail.core.errors import InputError
    from simrail.estimation.choose_odometry import with_odometry
    from simrail.estimation.estimate import Estimate, Estimator
    from simrail.estimation.recorded_ride import read_ride
    from simrail.estimators.rails.fuse import Fused, fuse
    from simrail.recording.files.ride_writer import write_ride
    from simrail.recording.recording import Recording
    from simrail.recording.sheets.grades import ImuGrade
    from simrail.report.show import show
    from simrail.results import Results, run
    from simrail.ride.ride import Ride, simulate
    from simrail.ride.truth import Mount, Truth
    from simrail.scenario.build import Parts
    from simrail.scenario.cells import Cell, cells
    from simrail.scenario.check import judge_scenario
    from simrail.scenario.scenario import Scenario, load_scenario
    from simrail.scoring.geometry import score_geometry
    from simrail.scoring.ride_figures import ride_comfort, running_safety
    from simrail.scoring.score import score, score_odometry
    from simrail.sensors.encoder import EncoderSpec
    from simrail.sensors.magnetometer import MagnetometerSpec
    from simrail.sensors.measure import measure
    from simrail.sensors.rail_sensor import RailSensorSpec
    from simrail.track.design import TrackDesign
    from simrail.track.irregularity import Irregularity
    from simrail.track.laid_track import LaidTrack, lay
    from simrail.vehicle.model import VehicleModel
    from simrail.vehicle.speed_profile import SpeedProfile

_HOMES = {
    "core.columns": ("COLUMNS",),
    "core.errors": ("InputError",),
    "estimation.choose_odometry": ("with_odometry",),
    "estimation.estimate": ("Estimate", "Estimator"),
    "estimation.recorded_ride": ("read_ride",),
    "estimators.rails.fuse": ("Fused", "fuse"),
    "recording.files.ride_writer": ("write_ride",),
    "recording.recording": ("Recording",),
    "report.show": ("show",),
    "results": ("Results", "run"),
    "ride.ride": ("Ride", "simulate"),
    "ride.truth": ("Mount", "Truth"),
    "scenario.build": ("Parts",),
    "scenario.cells": ("Cell", "cells"),
    "scenario.check": ("judge_scenario",),
    "scenario.scenario": ("Scenario", "load_scenario"),
    "scoring.geometry": ("score_geometry",),
    "scoring.ride_figures": ("ride_comfort", "running_safety"),
    "scoring.score": ("score", "score_odometry"),
    "sensors.encoder": ("EncoderSpec",),
    "recording.sheets.grades": ("ImuGrade",),
    "sensors.magnetometer": ("MagnetometerSpec",),
    "sensors.measure": ("measure",),
    "sensors.rail_sensor": ("RailSensorSpec",),
    "track.design": ("TrackDesign",),
    "track.irregularity": ("Irregularity",),
    "track.laid_track": ("LaidTrack", "lay"),
    "vehicle.model": ("VehicleModel",),
    "vehicle.speed_profile": ("SpeedProfile",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "COLUMNS",
    "Cell",
    "EncoderSpec",
    "Estimate",
    "Estimator",
    "Fused",
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
    "fuse",
    "judge_scenario",
    "lay",
    "load_scenario",
    "measure",
    "read_ride",
    "ride_comfort",
    "run",
    "running_safety",
    "score",
    "score_geometry",
    "score_odometry",
    "show",
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
