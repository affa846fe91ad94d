"""Zero-velocity odometry: exact motion gives exact speed, no stop but the true ones, wrong use is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.standstill import LOUDEST_REST_MPS2
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry, wandering, white
from simrail.estimators.odometry.zero_velocity_kernel import PITCH, REST_Y

from simrail.core.columns import ACCEL, GYRO, STANDSTILL
from simrail.core.errors import InputError
from simrail.core.resample import GAPS
from simrail.core.seeds import stream
from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.sheets.vehicle_sheet import SheetBody, Support, VehicleSheet
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount, Truth
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.speed_profile import Restriction, Run, SpeedProfile

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

CRAWLING = replace(
    THERE_AND_BACK,
    end_m=1000.0,
    stops=((500.0, 25.0),),
    runs=(),
    braking_mps2=0.1,
    restrictions=(Restriction(330.0, 370.0, 1.0), Restriction(900.0, 930.0, 0.7)),
)
"""It brakes gently, and creeps at a walking pace for half a minute, on its way and before its last stop."""


@pytest.fixture(scope="module")
def ridden() -> Callable[..., Truth]:
    return lru_cache(lambda profile, follow, seed: _ridden(profile, follow, seed))


def _ridden(profile: SpeedProfile, follow: Callable, seed: int) -> Truth:
    design = track_by_name("condequinto_olivar")
    laid = lay(design, Irregularity("erri_b176_low", (1.5, 100.0), 40.0), seed=seed)
    return kinematic_truth(design, profile, channels=follow(laid), height_m=0.9)


def recorded(truth: Truth, draw: int, *, grade: str = "lord_3dm_gx4_25", mount: Mount = FLOOR) -> Recording:
    return measure(truth, name="ride", mount=mount, grade=load_grade(grade), encoder=None, seed=11, draw=draw)


def compared(truth: Truth, recording: Recording, **options: object) -> pd.DataFrame:
    """The estimate's states beside the true speed, place and whether it runs."""
    states = ZeroVelocityOdometry(**options).estimate(recording).states  # type: ignore[arg-type]
    mount = Mount(recording.mount, recording.mount_body, recording.mount_position_m)
    motion = truth.motion(mount).loc[states.index]
    return states.assign(true_mps=motion["speed_mps"], true_m=motion["position_m"])


def test_exact_motion_gives_exact_speed(exactly: Callable, bend: Callable) -> None:
    """Curves of both hands, cant, gradients and vertical curves, either way; without any sensor's error.

    What is left is the mean of a step: rates that change within .1 s are turned one after another. An IMU 5 m
    ahead of what runs along the track is pulled back by .02 m/s2 in a curve of 250 m at 15 m/s.
    """
    for direction, x in ((1, 0.0), (-1, 0.0), (1, 5.0)):
        truth = bend(15.0, direction)
        mount = Mount("floor", "body", (x, 0.0, 1.1))
        recording = replace(exactly(truth, mount), odometry=None, odometry_source="")
        found = compared(truth, recording, smoothed=True)
        at_middle = truth.motion(FLOOR).loc[found.index, "speed_mps"]
        # .017 at most; by the pitch at the start of each step .020 to .025.
        np.testing.assert_allclose(found["speed_mps"], at_middle, atol=0.019)
        way = found["position_m"] - found["position_m"].iloc[0]
        true_way = found["true_m"] - found["true_m"].iloc[0]
        np.testing.assert_allclose(way, true_way, atol=0.6)


SEEDS = [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 7))]


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
def test_speed_and_way_hold_what_they_say(ridden: Callable, follow: Callable, seed: int) -> None:
    """Two devices: speed .1 m/s smoothed and .9 causal, way .4 %, and no stop but the true ones.

    Errors of a ride of six sections have some six independent values, and two rides twelve: a well stated
    interval of 95 % holds for 83 % of them at least (two standard deviations, .126).
    """
    truth = ridden(THERE_AND_BACK, follow, seed)
    for smoothed, most in ((False, 0.9), (True, 0.1)):
        both = []
        for draw in (0, 1):
            found = compared(truth, recorded(truth, draw), smoothed=smoothed)
            stands, rests = found[STANDSTILL] > 0.99, found["true_mps"].abs() < 1e-3
            assert found["true_mps"][stands].abs().max() < 0.05
            assert (stands & rests).sum() > 0.85 * rests.sum()
            both.append(found)
            if smoothed:
                way = found["speed_mps"].abs().sum() / found["true_mps"].abs().sum()
                assert way == pytest.approx(1.0, abs=0.004)
                assert (found["position_m"] - found["true_m"]).abs().max() < 4.0 * found[
                    "position_sd_m"
                ].max()
        states = pd.concat(both)
        off, sd, runs = (
            states["speed_mps"] - states["true_mps"],
            states["speed_sd_mps"],
            states["true_mps"].abs() > 1e-3,
        )
        assert np.sqrt((off**2).mean()) < most
        assert (off.abs() < 1.96 * sd)[runs].mean() > 0.83
        assert np.sqrt((off[runs] ** 2).mean()) > 0.3 * np.sqrt((sd[runs] ** 2).mean())


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
def test_neither_crawling_nor_gentle_braking_is_a_stop(ridden: Callable, follow: Callable, seed: int) -> None:
    """1 and .7 m/s for half a minute, .1 m/s2: as quiet as at rest, since nothing vibrates in this ride."""
    truth = ridden(CRAWLING, follow, seed)
    found = compared(truth, recorded(truth, 0))
    speed = found["true_mps"].abs()
    assert ((speed > 0.6) & (speed < 1.1)).sum() > 40.0 * 250.0
    assert speed[found[STANDSTILL] > 0.99].max() < 0.05
    assert (found[STANDSTILL] > 0.99)[speed < 1e-3].mean() > 0.8


def test_lost_samples_are_no_stop(ridden: Callable, follow: Callable) -> None:
    """What is interpolated is as quiet as can be."""
    recording = recorded(ridden(THERE_AND_BACK, follow, 1), 0)
    gaps = pd.DataFrame([[5.0, 5.5, 125]], columns=list(GAPS))
    states = ZeroVelocityOdometry().estimate(replace(recording, gaps=gaps)).states
    assert (states[STANDSTILL].loc[5.3:7.9] < 1e-9).all()
    assert (states[STANDSTILL].loc[9.0:25.0] > 0.99).all()


def test_a_ride_that_does_not_begin_at_rest_is_refused(ridden: Callable, follow: Callable) -> None:
    """By what shakes: as such, or beside a later rest."""
    recording = recorded(ridden(THERE_AND_BACK, follow, 1), 0)
    shaken = recording.imu.copy()
    n = len(shaken)
    shaken[ACCEL[2]] += 2.0 * LOUDEST_REST_MPS2 * stream(1, "shakes").standard_normal(n)
    with pytest.raises(InputError, match="does not begin at rest"):
        ZeroVelocityOdometry().estimate(replace(recording, imu=shaken))
    early = recording.imu.copy()
    early.iloc[:500, 5] += 0.1 * stream(1, "early").standard_normal(500)
    with pytest.raises(InputError, match="times the quietest"):
        ZeroVelocityOdometry().estimate(replace(recording, imu=early))


def test_no_vertical_signal_and_impossible_options_are_refused(ridden: Callable, follow: Callable) -> None:
    recording = recorded(ridden(THERE_AND_BACK, follow, 1), 0)
    for value in (0.0, np.nan):
        flat = replace(recording, imu=recording.imu.assign(**{ACCEL[2]: value}))
        with pytest.raises(InputError, match="no vertical signal, which tells rest from motion"):
            ZeroVelocityOdometry().estimate(flat)
    with pytest.raises(InputError, match="surely"):
        ZeroVelocityOdometry(surely=1.0)
    with pytest.raises(InputError, match="rest_speed_mps"):
        ZeroVelocityOdometry(rest_speed_mps=0.0)


def test_passengers_lean_what_they_are_in_and_not_what_carries_it(ridden: Callable, follow: Callable) -> None:
    """A body at rest leans by a random walk; a frame, on which that body stands, does not; nor turns."""
    recording = recorded(ridden(THERE_AND_BACK, follow, 1), 0)
    sheet = VehicleSheet((SheetBody("frame"), SheetBody("body", supports=(Support("frame", 0.0),))))
    noises = {}
    for body in ("body", "frame"):
        model = ZeroVelocityOdometry().model(replace(recording, vehicle_sheet=sheet, mount_body=body))
        noises[body] = model.rest_process[PITCH] / model.step_s, model.noise[REST_Y] * model.step_s
    rate, _ = white(recording.imu_sheet)
    assert noises["body"] == pytest.approx((9e-10, rate + 25e-10), rel=1e-6)
    assert noises["frame"] == pytest.approx((1e-12, rate + 1e-12), rel=1e-6)
    unknown = ZeroVelocityOdometry().model(replace(recording, vehicle_sheet=None, mount_body="frame"))
    assert unknown.rest_process[PITCH] / unknown.step_s == pytest.approx(9e-10)


def test_a_few_samples_are_a_train_that_stands(ridden: Callable, follow: Callable) -> None:
    recording = recorded(ridden(THERE_AND_BACK, follow, 1), 0)
    for samples in (1, 20, 30, 60):
        for smoothed in (False, True):
            short = replace(recording, imu=recording.imu.iloc[:samples])
            states = ZeroVelocityOdometry(smoothed=smoothed).estimate(short).states
            np.testing.assert_allclose(states["position_m"], recording.start_position_m, atol=1e-3)
            assert np.isfinite(states.to_numpy()).all()


def test_noise_is_that_of_the_sheet(ridden: Callable, follow: Callable) -> None:
    """N^2 and a count's share; 2 B^2 / tau, a Markov process' gain in a second."""
    sheet = recorded(ridden(THERE_AND_BACK, follow, 1), 0).imu_sheet
    sheet = replace(
        sheet, gyro_resolution_radps=1e-3, gyro_bias_correlation_s=100.0, gyro_random_walk_radpspsqrts=1e-6
    )
    gyro, accel = white(sheet)
    assert gyro == pytest.approx(sheet.gyro_noise_radpsqrts**2 + 1e-6 / 12.0 / sheet.rate_hz, rel=1e-12)
    assert accel >= sheet.accel_noise_mpsqrts**2
    drift, _ = wandering(sheet)
    assert drift == pytest.approx(2.0 * sheet.gyro_bias_instability_radps**2 / 100.0 + 1e-12, rel=1e-3)
    assert list(GYRO) == list(recorded(ridden(THERE_AND_BACK, follow, 1), 0).imu.columns[:3])
