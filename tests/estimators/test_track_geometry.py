"""Track geometry from perfect and imperfect trajectories, against the rails as they were laid."""

from functools import lru_cache

import numpy as np
import pandas as pd
import pytest

from estimators.track_geometry import track_geometry
from simrail.bands import BANDS, band_pass
from simrail.columns import (
    ATTITUDE,
    IRREGULARITY,
    ODOMETRY,
    ODOMETRY_SD,
    RELATIVE_POSITION,
)
from simrail.estimate import Estimate
from simrail.profile import SpeedProfile
from simrail.recording import ImuSheet, Recording
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.irregularity import Irregularity
from simrail.track.laid import lay
from simrail.truth import Mount
from simrail.vehicle.kinematic_engine import harmonic, kinematic_truth, rail_following

LINE = TrackDesign(
    name="bend",
    start_m=0.0,
    elements=(
        Straight(60.0),
        Transition(40.0),
        Curve(60.0, 250.0, 0.08),
        Transition(40.0),
        Straight(150.0),
    ),
    gradients=(Gradient(20.0, 0.02), Gradient(180.0, -0.015)),
    vertical_radius_m=1500.0,
)
LAID = lay(LINE, Irregularity("erri_b176_high", (1.5, 100.0), 20.0), seed=5)
MOUNT = Mount("axle", "body", (0.0, 0.2, 0.6))
STOPS = {
    "forward": SpeedProfile(10.0, 340.0, 15.0, rest_s=2.0),
    "backward": SpeedProfile(340.0, 10.0, 15.0, rest_s=2.0),
    "stopping": SpeedProfile(10.0, 340.0, 12.0, rest_s=2.0, stops=((150.07, 5.0),)),
}


@lru_cache
def ride(name: str, extra: str = "") -> tuple[Recording, Estimate]:
    """A body that keeps to the rails, its exact motion as a recording and as an estimate."""
    channels = rail_following(LAID, height_m=0.3)
    if extra == "loose":
        swings = {"lateral": 4e-3, "vertical": 8e-3, "roll": 6e-3, "pitch": 4e-3, "yaw": 3e-3}
        channels = {
            word: harmonic(size, frequency_hz=0.4 + 0.1 * i, phase_rad=i)
            for i, (word, size) in enumerate(swings.items())
        }
    truth = kinematic_truth(LINE, STOPS[name], channels=channels, height_m=0.3)
    motion = truth.motion(MOUNT).iloc[::4]
    odometry = motion[list(ODOMETRY)].copy()
    odometry[list(ODOMETRY_SD)] = 0.0
    recording = Recording(
        name=name,
        imu=motion,
        imu_sheet=ImuSheet("exact", 250.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount=MOUNT.name,
        mount_body=MOUNT.body,
        mount_position_m=MOUNT.position_m,
        track=LINE,
        encoder=None,
        encoder_sheet=None,
        start_position_m=float(odometry["position_m"].iloc[0]),
        odometry=odometry,
        odometry_source="truth",
    )
    return recording, Estimate(motion[[*ATTITUDE, *RELATIVE_POSITION]], MOUNT.name)


def error_mm(geometry: pd.DataFrame, band: str | None = None) -> pd.DataFrame:
    """What is wrong in it, against the rails as they lie."""
    truth = LAID.irregularities(geometry.index.to_numpy())
    error = 1e3 * (geometry[list(IRREGULARITY)] - truth)
    if band is not None:
        for name in error.columns[error.notna().all()]:
            edges = BANDS[band].edges_m(name.removesuffix("_m"))
            error[name] = band_pass(error[name].to_numpy(), edges, step_m=0.25)
    return error


@pytest.mark.parametrize("name", STOPS)
def test_a_body_that_keeps_to_the_rails_gives_them_back(name):
    recording, estimate = ride(name)
    geometry = track_geometry(estimate, recording)
    assert geometry.index[0] == 10.0 and geometry.index[-1] == 340.0
    assert np.ptp(np.diff(geometry.index)) < 1e-9
    inside = error_mm(geometry, "D1").iloc[:, :3].abs().max()
    print(inside, error_mm(geometry).abs().max())
    assert (inside < 0.05).all()
    assert geometry["gauge_m"].isna().all()
