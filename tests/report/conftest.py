"""Rides whose every figure is known beforehand, their scores, and the scenario they belong to."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
import pytest

from simrail.campaign.cell import CellResult
from simrail.core.columns import ATTITUDE, IMU, ODOMETRY, ODOMETRY_SD
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording
from simrail.report.pages import page
from simrail.scenario.scenario import Scenario, read_scenario
from simrail.scoring.score import reference_of, score, score_odometry
from simrail.scoring.table import concat_scores, labelled
from simrail.track.design import Curve, Straight, TrackDesign, Transition

SCENARIO = """
title = "A <test> ride"
seed = 1
track = "test_line"
vehicle = "none"
engine = "kinematic"
[encoder]
wheel = "wheel"
[monte_carlo]
sensor_draws = 2
[[ride]]
name = "go"
start_m = 10.0
end_m = 560.0
speed_kmh = 40.0
[[imu]]
name = "axle"
grade = "lord_3dm_gx4_25"
body = "body"
position_m = [0.0, 0.0, 0.6]
[[estimator]]
name = "ekf_compensated"
method = "AttitudeEkf"
[[estimator]]
name = "plain_filter"
method = "AttitudeEkf"
[estimator.options]
compensated = false
[[estimator]]
name = "vqf"
method = "Vqf"
[[estimator]]
name = "design_angles"
method = "DesignAngles"
"""

TRACK = TrackDesign(
    name="test_line",
    start_m=0.0,
    elements=(
        Straight(150.0),
        Transition(50.0),
        Curve(100.0, 300.0, 0.07),
        Transition(50.0),
        Straight(250.0),
    ),
    source="made up for this test",
    synthetic=True,
)

# Constant errors in degrees (roll, pitch, yaw) of each method, so that every figure is known beforehand.
ERRORS = {
    "ekf_compensated": (0.1, 0.2, 0.3),
    "plain_filter": (0.5, 0.6, 0.3),
    "vqf": (0.4, 0.6, 0.3),
}
IRREGULARITY_DEG = 0.25


def example_ride(*, backward: bool = False, rate: float = 50.0, name: str = "go") -> CellResult:
    """A ride at constant speed after a rest; the body rolls +-0.25 deg against the track in a square wave."""
    n = int(70.0 * rate)
    t = np.arange(n) / rate
    run = np.clip(t - 10.0, 0.0, 50.0) * 11.0
    s = 560.0 - run if backward else 10.0 + run
    v = np.where((t > 10.0) & (t < 60.0), -11.0 if backward else 11.0, 0.0)
    frame = TRACK.frame(s)
    wave = np.deg2rad(IRREGULARITY_DEG) * np.sign(np.sin(0.5 * s))
    columns = {
        "roll_rad": frame.roll_rad + wave,
        "pitch_rad": frame.pitch_rad,
        "yaw_rad": frame.yaw_rad,
        "position_m": s,
        "speed_mps": v,
        "acceleration_mps2": 0.0 * t,
    }
    motion = pd.DataFrame(columns, index=pd.Index(t, name="time_s"))
    imu = pd.DataFrame(0.01 * np.sin(np.outer(t, np.arange(1, 7))), index=motion.index, columns=list(IMU))
    odometry = motion[list(ODOMETRY)].copy()
    odometry["position_m"] += 0.5
    odometry[list(ODOMETRY_SD)] = 1.0
    recording = Recording(
        name=name,
        imu=imu,
        imu_sheet=ImuSheet("lord_3dm_gx4_25", rate, 0.01, *([1e-3] * 6)),
        mount="axle",
        mount_body="body",
        mount_position_m=(0.0, 0.0, 0.6),
        track=TRACK,
        encoder=None,
        encoder_sheet=None,
        start_position_m=float(s[0]),
        odometry=odometry,
        odometry_source="encoder",
    )
    estimates = {}
    for method, errors in ERRORS.items():
        states = motion[list(ATTITUDE)] + np.deg2rad(errors)
        states["roll_sd_rad"] = np.deg2rad(0.1)
        estimates[method] = Estimate(states=states, mount="axle")
    design = np.column_stack((frame.roll_rad, frame.pitch_rad, frame.yaw_rad))
    states = pd.DataFrame(design, index=motion.index, columns=list(ATTITUDE))
    estimates["design_angles"] = Estimate(states=states, mount="axle")
    cell: dict[str, object] = {
        "cell": 0,
        "ride": name,
        "vehicle": "none",
        "mount": "axle",
        "imu": "lord_3dm_gx4_25",
        "odometry": "encoder",
        "map": "exact",
        "vibration": "off",
    }
    return CellResult(cell, recording, motion, estimates)


def tables_of(
    *examples: CellResult, draws: int = 2, spread: float = 0.0
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and cells of some rides; draws differ by a factor 1 +- spread."""
    parts, cells, number = [], [], 0
    for one in examples:
        reference = reference_of(one.motion, one.recording)
        for draw in range(draws):
            labels = {key: value for key, value in one.cell.items() if key != "cell"}
            labels |= {
                "cell": number,
                "scenario": "test",
                "tuning": "default",
                "track_draw": 0,
                "sensor_draw": draw,
            }
            cells.append(
                {"cell": number, "ride": one.cell["ride"], "imu": one.cell["imu"], "vehicle": "none"}
            )
            number += 1
            for name, estimate in one.estimates.items():
                figures = score(estimate, reference, one.recording, us_per_sample=0.2)
                figures["value"] *= 1.0 + spread * (2 * draw - 1)
                parts.append(labelled([(figures, labels | {"estimator": name})]))
            figures = score_odometry(one.recording, reference)
            parts.append(labelled([(figures, labels | {"estimator": "odometry:encoder"})]))
    return concat_scores(parts), pd.DataFrame(cells)


@pytest.fixture(scope="session")
def example() -> Callable[..., CellResult]:
    """See `example_ride`."""
    return example_ride


@pytest.fixture(scope="session")
def tables() -> Callable[..., tuple[pd.DataFrame, pd.DataFrame]]:
    """See `tables_of`."""
    return tables_of


@pytest.fixture(scope="module")
def no_pictures_of_rides() -> Iterator[None]:
    """Pages without the sections on single rides and tracks, whose pictures take half of their time."""
    with pytest.MonkeyPatch.context() as patch:
        pictures = (page.explorer_section, page._tracks)
        patch.setattr(page, "SECTIONS", tuple(make for make in page.SECTIONS if make not in pictures))
        yield


@pytest.fixture(scope="session")
def scenario() -> Scenario:
    return read_scenario(SCENARIO, name="test")
