"""Odometry from an IMU and a map: how far it is off, what it claims, and that its way errs as it should."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.curve_matched import CurveMatchedOdometry
from simrail.estimators.odometry.without_wheel import Reckoned, reckoned_of
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry
from simrail.estimators.odometry.zero_velocity_kernel import S, V

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.estimation.conformance import check_odometry
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount, Truth
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.track.map_errors import MapErrors, draw_map
from simrail.vehicle.speed_profile import Run, SpeedProfile

FLOOR = Mount("floor", "body", (0.0, 0.0, 1.1))

THERE_AND_BACK = SpeedProfile(
    30.0,
    1500.0,
    16.0,
    acceleration_mps2=0.9,
    jerk_mps3=0.6,
    rest_s=30.0,
    final_rest_s=20.0,
    stops=((500.0, 25.0), (1000.0, 25.0)),
    runs=(Run(30.0, 40.0),),
)
"""Three sections there and three back, backwards: five minutes and a half."""

METRO = SpeedProfile(
    0.0,
    9250.0,
    20.0,
    acceleration_mps2=1.0,
    braking_mps2=0.95,
    jerk_mps3=0.6,
    rest_s=30.0,
    final_rest_s=30.0,
    stops=tuple((at, 30.0) for at in (850.0, 2250.0, 3050.0, 4200.0, 5350.0, 6600.0, 7950.0)),
)
"""The first nine stations of the metro line."""


@pytest.fixture(scope="module")
def ridden() -> Callable[..., Truth]:
    return lru_cache(lambda line, profile, follow, seed: _ridden(line, profile, follow, seed))


def _ridden(line: str, profile: SpeedProfile, follow: Callable, seed: int) -> Truth:
    design = track_by_name(line)
    laid = lay(design, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=seed)
    return kinematic_truth(design, profile, channels=follow(laid), height_m=0.9)


def recorded(truth: Truth, draw: int, line: str, *, grade: str = "lord_3dm_gx4_25") -> Recording:
    """By an IMU alone, with a map that errs by the default sizes."""
    errors = MapErrors()
    return measure(
        truth,
        name="ride",
        mount=FLOOR,
        grade=load_grade(grade),
        encoder=None,
        seed=11,
        draw=draw,
        track_map=draw_map(track_by_name(line), errors, seed=5, draw=draw),
        map_errors=errors,
    )


def compared(truth: Truth, recording: Recording, *, smoothed: bool) -> pd.DataFrame:
    """The estimate's states beside the true place and speed."""
    states = CurveMatchedOdometry(smoothed=smoothed).estimate(recording).states
    motion = truth.motion(FLOOR).loc[states.index]
    return states.assign(true_m=motion["position_m"], true_mps=motion["speed_mps"])


def integrated(reckoned: Reckoned, first: FloatArray, dt: float) -> FloatArray:
    """Variance (n, 2) of way and speed: the speed errs by the process, and is known where it stops."""
    p, out = np.zeros((4, 4)), np.empty((len(reckoned.speed), 2))
    p[1:, 1:] = first
    for k in range(len(out)):
        f, q = np.eye(4), np.zeros((4, 4))
        f[1:, 1:], q[1:, 1:] = reckoned.transitions[k], reckoned.noises[k]
        half = 0.0 if reckoned.rests[k] > 0.0 else 0.5 * dt
        mean = np.eye(4)
        mean[0, 1] = half
        both = mean @ f
        both[0, 1] += half
        p = both @ p @ both.T + mean @ q @ mean.T
        if reckoned.rests[k] > 0.0:
            p -= np.outer(p[1], p[1]) / (p[1, 1] + reckoned.rest_variance)
        out[k] = p[0, 0], p[1, 1]
    return out


@pytest.mark.long
@pytest.mark.parametrize("smoothed", [False, True])
def test_the_way_errs_as_the_zero_velocity_odometry_says(
    ridden: Callable, follow: Callable, smoothed: bool
) -> None:
    """The process, integrated, has the variance of way and speed of the odometry's own ten states.

    That three states stand for ten shows by less than an eighth, stop after stop; smoothed by a twentieth.
    """
    within = 0.05 if smoothed else 0.125
    recording = recorded(ridden("condequinto_olivar", THERE_AND_BACK, follow, 1), 0, "condequinto_olivar")
    trace = ZeroVelocityOdometry(smoothed=smoothed).trace(recording, remembering=True)
    reckoned, first = reckoned_of(trace, recording, smoothed=smoothed)
    way, speed = integrated(reckoned, first, trace.model.step_s).T
    own = trace.found.covariances[:, S, S] - trace.found.covariances[0, S, S]
    stops = np.flatnonzero(np.diff(reckoned.rests) > 0.0)  # the first step at rest is the next
    for at in (stops - 1, stops + 50):
        np.testing.assert_allclose(np.sqrt(way[at]), np.sqrt(own[at]), rtol=within)
        np.testing.assert_allclose(
            np.sqrt(speed[at]), np.sqrt(trace.found.covariances[at, V, V]), rtol=within
        )
    if not smoothed:  # what a stop tells of the way since the last one
        assert (way[stops + 50] < 0.2 * way[stops - 1]).all()


SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 7))]


@pytest.mark.parametrize("seed", SEEDS)
def test_place_and_speed_hold_what_they_say(ridden: Callable, follow: Callable, seed: int) -> None:
    """Two devices and two maps: place 3 m rms causal, 1.5 m smoothed; no sd too small or far too large.

    Twelve sections have some twelve independent errors: a well stated interval of 95 % holds for 83 %.
    """
    truth = ridden("condequinto_olivar", THERE_AND_BACK, follow, seed)
    for smoothed, most in ((False, 3.0), (True, 1.5)):
        both = [
            compared(truth, recorded(truth, draw, "condequinto_olivar"), smoothed=smoothed) for draw in (0, 1)
        ]
        found = pd.concat(both)
        for value, true, within in (("position_m", "true_m", most), ("speed_mps", "true_mps", 0.2)):
            off, sd = found[value] - found[true], found[value.replace("_m", "_sd_m")]
            assert np.sqrt((off**2).mean()) < within
            assert (off.abs() < 1.96 * sd).mean() > 0.83
            assert np.sqrt((off**2).mean()) > 0.25 * np.sqrt((sd**2).mean())


@pytest.mark.slow
@pytest.mark.parametrize("grade", ["lord_3dm_gx4_25", "consumer"])
def test_metro(ridden: Callable, follow: Callable, grade: str) -> None:
    """Nine stations, three lines of rails, two devices and two maps each: the same of all of them."""
    for smoothed, most in ((False, 3.0), (True, 1.5)):
        found = pd.concat(
            compared(truth, recorded(truth, draw, "metro_line", grade=grade), smoothed=smoothed)
            for truth in (ridden("metro_line", METRO, follow, seed) for seed in (1, 2, 3))
            for draw in (0, 1)
        )
        off = found["position_m"] - found["true_m"]
        assert np.sqrt((off**2).mean()) < most
        assert (off.abs() < 1.96 * found["position_sd_m"]).mean() > 0.9


def test_it_is_an_odometry_as_any_other(ridden: Callable, follow: Callable) -> None:
    """Causal bit by bit, finite, of some samples or of none but rest."""
    recording = recorded(ridden("condequinto_olivar", THERE_AND_BACK, follow, 1), 0, "condequinto_olivar")
    for smoothed in (False, True):
        check_odometry(CurveMatchedOdometry(smoothed=smoothed), beginning(recording, samples=20000))


def test_a_ride_that_begins_in_motion_is_refused(ridden: Callable, follow: Callable) -> None:
    recording = recorded(ridden("condequinto_olivar", THERE_AND_BACK, follow, 1), 0, "condequinto_olivar")
    shaken = recording.imu.copy()
    shaken[ACCEL[2]] += stream(1, "shakes").standard_normal(len(shaken))
    with pytest.raises(InputError, match="does not begin at rest") as caught:
        CurveMatchedOdometry().estimate(replace(recording, imu=shaken))
    assert "\n" not in str(caught.value)
    flat = replace(recording, imu=recording.imu.assign(**{ACCEL[2]: 0.0}))
    with pytest.raises(InputError, match="no vertical signal"):
        CurveMatchedOdometry(smoothed=True).estimate(flat)
