"""Short rides over the bend, for the track-relative smoother."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import pytest

from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth, rail_following
from simrail.ride.truth import Mount, Truth
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.design import TrackDesign
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.track.map_errors import MapErrors, draw_map
from simrail.vehicle.speed_profile import SpeedProfile

ERRORS = MapErrors(cant_sd_m=0.004, cant_along_sd_m=5e-4, radius_relative_sd=0.01, place_sd_m=0.3)
"""Of the maps of these rides."""

AT = Mount("axle", "body", (0.0, 0.2, 0.6))


@pytest.fixture
def exact_bend(bend: Callable, exactly: Callable) -> Recording:
    """A body that keeps to the track of the bend, without any sensor."""
    return exactly(bend(15.0, 1))


@lru_cache(maxsize=12)
def rough_truth(track: TrackDesign, draw: int, direction: int) -> Truth:
    """A body that keeps to the irregular rails of the bend, at 15 m/s."""
    laid = lay(track, Irregularity("erri_b176_low", (3.0, 60.0), 20.0), seed=draw + 1)
    start, end = (10.0, 590.0) if direction > 0 else (590.0, 10.0)
    profile = SpeedProfile(start, end, 15.0, acceleration_mps2=1.0, jerk_mps3=1.0, rest_s=4.0)
    return kinematic_truth(track, profile, channels=rail_following(laid, height_m=0.6), height_m=0.3)


@lru_cache(maxsize=12)
def record_rough(track: TrackDesign, draw: int, direction: int) -> Recording:
    """That ride as recorded, with a map that errs as its sheet says."""
    return measure(
        rough_truth(track, draw, direction),
        name=f"rough {draw}",
        mount=AT,
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel", radius_error_sd=0.001),
        track_map=draw_map(track, ERRORS, seed=3, draw=draw),
        map_errors=ERRORS,
        seed=3,
        draw=draw,
    )


@pytest.fixture
def rough(bend: Callable) -> Callable[..., Recording]:
    """Rides over the rough bend with a map that errs, by draw of everything and direction."""
    return lambda draw=0, direction=1: record_rough(bend(15.0, 1).track, draw, direction)


@pytest.fixture
def rough_motion(bend: Callable) -> Callable:
    """True motion of such a ride."""
    return lambda draw=0, direction=1: rough_truth(bend(15.0, 1).track, draw, direction).motion(AT)
