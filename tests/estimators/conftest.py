"""Rides for the estimator tests: exact bodies on a curved, canted, sloped track."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import PPoly
from simrail.estimators.odometry.curve_matched import CurveMatchedOdometry

from simrail.core.columns import ACCEL, ATTITUDE, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.core.toml_files import load
from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.recording import ImuSheet, Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import Channel, along, kinematic_truth, rail_following
from simrail.ride.ride import Ride, rails_of, simulate
from simrail.ride.truth import Mount, Truth
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.file import track_by_name
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import LaidTrack, lay
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

SHEET = ImuSheet(
    grade="test",
    rate_hz=250.0,
    delay_s=0.0,
    gyro_noise_radpsqrts=8.7e-5,
    accel_noise_mpsqrts=9.8e-4,
    gyro_bias_instability_radps=4.8e-5,
    accel_bias_instability_mps2=3.9e-4,
    gyro_turn_on_bias_radps=8.7e-4,
    accel_turn_on_bias_mps2=0.0196,
)

BEND = TrackDesign(
    name="bend",
    start_m=0.0,
    elements=(
        Straight(60.0),
        Transition(40.0),
        Curve(60.0, 250.0, 0.08),
        Transition(40.0),
        Straight(30.0),
        Transition(40.0),
        Curve(60.0, -300.0, 0.06),
        Transition(40.0),
        Straight(230.0),
    ),
    gradients=(Gradient(20.0, 0.02), Gradient(180.0, -0.015), Gradient(330.0, 0.004)),
    vertical_radius_m=1500.0,
)
"""A short line with everything: both hands of curve, cant, slope and vertical curves."""

IMU_AT = Mount("axle", "body", (0.0, 0.2, 0.6))


def record_exactly(
    truth: Truth, mount: Mount = IMU_AT, *, step: int = 4, sheet: ImuSheet = SHEET
) -> Recording:
    """Every step-th sample of the true motion, without any sensor: what closed forms are tested on."""
    motion = truth.motion(mount).iloc[::step]
    odometry = motion[list(ODOMETRY)].copy()
    odometry[list(ODOMETRY_SD)] = 0.0
    return Recording(
        name="exact",
        imu=motion[[*GYRO, *ACCEL]].copy(),
        imu_sheet=sheet,
        mount=mount.name,
        mount_body=mount.body,
        mount_position_m=mount.position_m,
        track=truth.track,
        encoder=None,
        encoder_sheet=None,
        start_position_m=float(odometry["position_m"].iloc[0]),
        odometry=odometry,
        odometry_source="truth",
        gravity_mps2=truth.gravity_mps2,
    )


@lru_cache
def bend_truth(speed_mps: float = 15.0, direction: int = 1, rest_s: float = 2.0) -> Truth:
    """A body that does not move in the track frame, over the bend."""
    start, end = (10.0, 590.0) if direction > 0 else (590.0, 10.0)
    profile = SpeedProfile(start, end, speed_mps, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=rest_s)
    return kinematic_truth(BEND, profile, height_m=0.3)


def following(laid: LaidTrack) -> dict[str, Channel]:
    """Keeps to the irregular rails, and points along them: lateral', -vertical' as yaw and pitch."""
    knots = laid.table_start_m + laid.table_step_m * np.arange(laid.table.shape[0] + 1)
    rails = PPoly(laid.table[:, 6:10].transpose(2, 0, 1), knots)
    channels = rail_following(laid)

    def mean_of_rails(first: int, sign: float) -> Channel:
        return along(
            lambda s, order: sign * 0.5 * (rails(s, order + 1)[:, first] + rails(s, order + 1)[:, first + 2])
        )

    channels["yaw"] = mean_of_rails(0, 1.0)
    channels["pitch"] = mean_of_rails(1, -1.0)
    return channels


@lru_cache
def line_truth(speed_kmh: float, direction: int) -> Truth:
    """A ride over the 2.1 km line on irregular rails."""
    design = track_by_name("condequinto_olivar")
    laid = lay(design, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=1)
    start, end = (10.0, 2090.0) if direction > 0 else (2090.0, 10.0)
    profile = SpeedProfile(start, end, speed_kmh / 3.6)
    return kinematic_truth(design, profile, channels=following(laid), height_m=0.29)


@lru_cache
def line_motion(speed_kmh: float, direction: int) -> pd.DataFrame:
    """True motion of the axle IMU on that ride."""
    return line_truth(speed_kmh, direction).motion(IMU_AT)


@lru_cache(maxsize=8)
def record_line(speed_kmh: float, direction: int, draw: int) -> Recording:
    """That ride as the 3DM-GX4-25 and an encoder with a wheel that is not quite nominal record it."""
    recording = measure(
        line_truth(speed_kmh, direction),
        name=f"{speed_kmh:g} km/h {direction:+d}",
        mount=IMU_AT,
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel", radius_error_sd=0.001),
        seed=1,
        draw=draw,
    )
    return with_odometry(recording, "encoder")


AXLE_AT = Mount("axle", "front", (0.0, 0.0, 0.6))


@lru_cache
def bogie_truth(speed_kmh: float, direction: int) -> Truth:
    """The same line, rails and speed profile, by the light-metro bogie in Exudyn."""
    start, end = (10.0, 2090.0) if direction > 0 else (2090.0, 10.0)
    return simulate(
        Ride(
            name="accuracy",
            track=track_by_name("condequinto_olivar"),
            irregularity=Irregularity("erri_b176_low", (1.5, 100.0), 40.0),
            track_seed=1,
            vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
            profile=SpeedProfile(start, end, speed_kmh / 3.6),
        )
    )


@lru_cache
def bogie_motion(speed_kmh: float, direction: int) -> pd.DataFrame:
    """True motion of the axle IMU on that ride."""
    return bogie_truth(speed_kmh, direction).motion(AXLE_AT)


@lru_cache(maxsize=2)
def record_bogie(speed_kmh: float, direction: int, draw: int) -> Recording:
    """That ride as recorded."""
    recording = measure(
        bogie_truth(speed_kmh, direction),
        name=f"bogie {speed_kmh:g} km/h {direction:+d}",
        mount=AXLE_AT,
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("front.left", radius_error_sd=0.001),
        seed=1,
        draw=draw,
    )
    return with_odometry(recording, "encoder")


METRO_AT = {"axle": AXLE_AT, "frame": Mount("frame", "frame", (0.0, 0.0, 0.6))}


LINE = (10.0, 2090.0)


def metro_ride(speed_kmh: float, direction: int, way: tuple[float, float] = LINE) -> Ride:
    """The bogie's ride by the compiled engine, over the whole line or a stretch of it."""
    start, end = way if direction > 0 else way[::-1]
    return Ride(
        name="trajectory",
        track=track_by_name("condequinto_olivar"),
        irregularity=Irregularity("erri_b176_low", (1.5, 100.0), 40.0),
        track_seed=1,
        vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
        profile=SpeedProfile(start, end, speed_kmh / 3.6),
        engine="compiled",
    )


@lru_cache
def metro_truth(speed_kmh: float, direction: int, way: tuple[float, float] = LINE) -> Truth:
    """The truth of that ride."""
    return simulate(metro_ride(speed_kmh, direction, way))


@lru_cache(maxsize=4)
def record_metro(
    speed_kmh: float, direction: int, mount: str, draw: int, way: tuple[float, float] = LINE
) -> Recording:
    """That ride as recorded, with curve-matched odometry."""
    recording = measure(
        metro_truth(speed_kmh, direction, way),
        name=f"metro {mount} {speed_kmh:g} km/h {direction:+d}",
        mount=METRO_AT[mount],
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("front.left", radius_error_sd=0.001),
        seed=1,
        draw=draw,
    )
    odometry = CurveMatchedOdometry(smoothed=True).estimate(recording).states
    return recording.with_odometry(odometry, "curve_matched")


@pytest.fixture
def metro_recording() -> Callable[..., Recording]:
    return record_metro


@pytest.fixture
def metro_rails() -> Callable[..., LaidTrack]:
    """The rails of that ride."""
    return lambda speed_kmh, direction: rails_of(metro_ride(speed_kmh, direction))


@pytest.fixture
def metro_motion() -> Callable[..., pd.DataFrame]:
    """True motion of a mount on that ride."""

    def motion(speed_kmh: float, direction: int, mount: str, way: tuple[float, float] = LINE) -> pd.DataFrame:
        return metro_truth(speed_kmh, direction, way).motion(METRO_AT[mount])

    return motion


@pytest.fixture
def line_exactly() -> Callable[..., tuple[Recording, pd.DataFrame]]:
    """The kinematic ride over the line without any sensor, and its true motion."""

    def record(speed_kmh: float, direction: int) -> tuple[Recording, pd.DataFrame]:
        recording = record_exactly(line_truth(speed_kmh, direction))
        return recording, line_motion(speed_kmh, direction).loc[recording.imu.index]

    return record


@pytest.fixture
def follow() -> Callable[..., dict[str, Channel]]:
    """Channels of a body that keeps to irregular rails."""
    return following


@pytest.fixture
def bogie_recording() -> Callable[..., Recording]:
    return record_bogie


@pytest.fixture
def bogie_true_motion() -> Callable[..., pd.DataFrame]:
    return bogie_motion


@pytest.fixture
def bend() -> Callable[..., Truth]:
    return bend_truth


@pytest.fixture
def exactly() -> Callable[..., Recording]:
    return record_exactly


@pytest.fixture
def line_recording() -> Callable[..., Recording]:
    return record_line


@pytest.fixture
def line_true_motion() -> Callable[..., pd.DataFrame]:
    return line_motion


@pytest.fixture
def true_angles() -> Callable[..., np.ndarray]:
    """True roll, pitch and yaw at a recording's times."""

    def angles(truth: Truth, recording: Recording) -> np.ndarray:
        motion = truth.motion(Mount(recording.mount, recording.mount_body, recording.mount_position_m))
        return motion.loc[recording.imu.index, list(ATTITUDE)].to_numpy()

    return angles
