"""Time per sample of the estimators, beside those that others wrote, on one and the same signal.

    pytest tests/benchmarks/test_estimators.py --benchmark-only

Every kernel gets arrays that are ready; `estimate` is timed too, from recording to data frame. Those of
`ahrs` are timed where it is installed. The limits are for one idle core of a machine of 2024; ratios are
taken in one run, so they hold on others as well.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache

import imufusion
import numpy as np
import pytest
from channels import harmonic
from simrail.estimators.attitude.compensation import gravity_force, track_acceleration
from simrail.estimators.attitude.ekf import AttitudeEkf
from simrail.estimators.attitude.gda import AttitudeGda
from simrail.estimators.attitude.kernel import attitude_ekf, attitude_gda
from simrail.estimators.attitude.rest_bias import rest_bias, step_rates
from simrail.estimators.attitude.veillard_ekf import VeillardEkf
from simrail.estimators.attitude.veillard_kernel import Model as ElevenStates
from simrail.estimators.attitude.veillard_kernel import eleven_states, room
from simrail.estimators.kalman import room_for_history
from simrail.estimators.odometry import zero_velocity_kernel
from simrail.estimators.odometry.spectral import FRAME, HOP, spectral_sums
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry
from simrail.estimators.odometry.zero_velocity_kernel import zero_velocity
from simrail.estimators.profile.kernel import profile_filter
from simrail.estimators.profile.kernel import room as room_for_profile
from simrail.estimators.profile.profile_filter import ProfileFilter
from simrail.estimators.trajectory.kernel import (
    STATES,
    Model,
    room_for_filtered,
    room_for_past,
    trajectory_back,
    trajectory_filter,
)
from simrail.estimators.trajectory.smoother import TrajectorySmoother, log_likelihood, run_model
from twins.attitude import filterpy_ekf
from twins.profile import filterpy_profile
from twins.trajectory import filterpy_smoother
from twins.veillard import filterpy_eleven_states
from twins.zero_velocity import filterpy_zero_velocity
from vqf import VQF

from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.recording import Recording
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.file import track_by_name
from simrail.vehicle.speed_profile import SpeedProfile

SLOW = 4000
"""Samples for those that run in Python."""


@lru_cache
def ride(draw: int = 0) -> Recording:
    """Some 100 s over the line at 70 km/h."""
    truth = kinematic_truth(
        track_by_name("condequinto_olivar"),
        SpeedProfile(10.0, 1500.0, 70.0 / 3.6),
        channels={"roll": harmonic(0.005, frequency_hz=1.1), "lateral": harmonic(0.003, frequency_hz=1.7)},
    )
    recording = measure(
        truth,
        name="benchmark",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        encoder=EncoderSpec("wheel"),
        seed=1,
        draw=draw,
    )
    return with_odometry(recording, "encoder")


@lru_cache
def ekf_arguments(n: int | None = None) -> tuple:
    """What kernel and twin of the EKF take, outputs included."""
    arrays, _ = AttitudeEkf()._arrays(ride())
    rate, force, process, noise, *rest = arrays
    rows = len(rate[:n])
    outputs = np.empty((rows, 3)), np.empty((rows, 3, 3)), np.empty((rows, 4))
    return (rate[:n], force[:n], process[:n], noise[:n], *rest, *outputs)


@lru_cache
def signals() -> tuple[np.ndarray, np.ndarray]:
    """Rate and compensated force, (n, 3) each."""
    recording = ride()
    rate = step_rates(recording, rest_bias(recording).bias)
    return rate, gravity_force(recording, compensated=True)


def best_us(function: Callable[[], object], samples: int, *, rounds: int = 5) -> float:
    """Least time of some rounds, us per sample: what the machine can do when nothing disturbs it."""
    function()
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / samples


def report(benchmark: Callable, function: Callable[[], object], samples: int, **extra: float) -> float:
    """Run the benchmark and store its figures under plain names; returns us per sample."""
    function()
    benchmark.pedantic(function, rounds=10, iterations=1, warmup_rounds=1)
    us = 1e6 * benchmark.stats.stats.min / samples
    benchmark.extra_info["us_per_sample"] = us
    for name, other in extra.items():
        benchmark.extra_info[name] = other / us
    return us


def filterpy_us() -> float:
    arguments = ekf_arguments(SLOW)
    return best_us(lambda: filterpy_ekf(*arguments), SLOW, rounds=2)


def vqf_us() -> float:
    rate, force = signals()
    return best_us(lambda: VQF(0.004).updateBatch(rate, force), len(rate))


def ahrs_madgwick_us() -> float:
    filters = pytest.importorskip("ahrs.filters", reason="ahrs is not installed")
    rate, force = signals()
    return best_us(
        lambda: filters.Madgwick(gyr=rate[:SLOW], acc=force[:SLOW], frequency=250.0), SLOW, rounds=2
    )


def imufusion_us() -> float:
    rate, force = signals()
    degrees, g = np.degrees(rate[:SLOW]), force[:SLOW] / 9.81

    def run() -> None:
        ahrs = imufusion.Ahrs()
        ahrs.set_sample_period(0.004)
        for w, z in zip(degrees, g, strict=True):
            ahrs.update_no_magnetometer(w, z)

    return best_us(run, SLOW, rounds=2)


def gda_arguments() -> tuple:
    rate, force = signals()
    return rate, force, np.array([1.0, 0.0, 0.0, 0.0]), 7.56e-3, 0.004, np.empty((len(rate), 4))


def test_ekf_kernel(benchmark: Callable) -> None:
    arguments = ekf_arguments()
    us = report(
        benchmark,
        lambda: attitude_ekf(*arguments),
        len(arguments[0]),
        ratio_to_filterpy=filterpy_us(),
        ratio_to_vqf=vqf_us(),
        ratio_to_imufusion=imufusion_us(),
    )
    assert us <= 0.08
    assert benchmark.extra_info["ratio_to_filterpy"] >= 250.0


def test_gda_kernel(benchmark: Callable) -> None:
    arguments = gda_arguments()
    us = report(
        benchmark,
        lambda: attitude_gda(*arguments),
        len(arguments[0]),
        ratio_to_filterpy=filterpy_us(),
        ratio_to_vqf=vqf_us(),
        ratio_to_imufusion=imufusion_us(),
    )
    assert us <= 0.08
    assert benchmark.extra_info["ratio_to_vqf"] >= 3.0


@pytest.mark.parametrize("compensated", [False, True])
def test_eleven_states_kernel(benchmark: Callable, compensated: bool) -> None:
    method = VeillardEkf(calibration="encoder", compensated=compensated)
    model: ElevenStates = method.model(ride(), method.spectral.frame_speeds(ride()))
    few, n = model._replace(signals=model.signals[:SLOW]), len(model.signals)
    theirs = best_us(lambda: filterpy_eleven_states(few, room(SLOW)), SLOW, rounds=2)
    found = room(n)
    us = report(benchmark, lambda: eleven_states(model, found), n, ratio_to_filterpy=theirs)
    assert us <= 0.4
    assert benchmark.extra_info["ratio_to_filterpy"] >= 250.0


@pytest.mark.parametrize("step_m", [0.25, 0.18])
def test_profile_kernel(benchmark: Callable, step_m: float) -> None:
    """26 and 30 states: nodes over a bogie's wheelbase of 1.8 m, and as many behind."""
    model = ProfileFilter(other_axle_m=-1.8, step_m=step_m).model(ride())
    n, few = len(model.place), 800
    assert 26 <= len(model.start) <= 30
    cut = {
        name: value[4000 : 4000 + few]
        for name, value in model._asdict().items()
        if isinstance(value, np.ndarray) and value.shape == (n,)
    }
    short = model._replace(**cut)
    theirs = best_us(lambda: filterpy_profile(short, room_for_profile(short)), few, rounds=2)
    found = room_for_profile(model)
    us = report(benchmark, lambda: profile_filter(model, found), n, ratio_to_filterpy=theirs)
    assert us <= 1.0
    assert benchmark.extra_info["ratio_to_filterpy"] >= 100.0


def test_zero_velocity_kernel(benchmark: Callable) -> None:
    """A step of ten samples a second: microseconds are those of a sample of the IMU."""
    method, recording = ZeroVelocityOdometry(), ride()
    model, few = method.model(recording), SLOW // 25
    rests = method.trace(recording).found.log_odds > model.surely
    short = model._replace(signals=model.signals[:few])
    twin = zero_velocity_kernel.room(few, 4)
    theirs = best_us(
        lambda: filterpy_zero_velocity(short, *method.start(recording, model), rests, twin),
        25 * few,
        rounds=2,
    )
    found = zero_velocity_kernel.room(len(model.signals), 4)
    no_past = room_for_history(0, zero_velocity_kernel.STATES, zero_velocity_kernel.UPDATES)
    us = report(
        benchmark,
        lambda: zero_velocity(model, *method.start(recording, model), found, no_past),
        len(recording.imu),
        ratio_to_filterpy=theirs,
    )
    assert us <= 0.4
    assert benchmark.extra_info["ratio_to_filterpy"] >= 250.0


def test_spectral_sums(benchmark: Callable) -> None:
    vertical = ride().imu["accel_z_mps2"].to_numpy()
    us = report(benchmark, lambda: spectral_sums(vertical, frame=FRAME, hop=HOP), len(vertical))
    assert us <= 0.1


def test_gda_beside_ahrs_madgwick(benchmark: Callable) -> None:
    arguments = gda_arguments()
    report(benchmark, lambda: attitude_gda(*arguments), len(arguments[0]), ratio_to_ahrs=ahrs_madgwick_us())


@pytest.mark.parametrize("estimator", [AttitudeEkf(), AttitudeGda()], ids=["ekf", "gda"])
def test_whole_estimate(benchmark: Callable, estimator: AttitudeEkf | AttitudeGda) -> None:
    us = report(
        benchmark, lambda: estimator.estimate(ride()), len(ride().imu), ratio_to_filterpy=filterpy_us()
    )
    assert us <= 0.15


@pytest.mark.parametrize("estimator", [AttitudeEkf(), AttitudeGda()], ids=["ekf", "gda"])
def test_sixteen_draws_as_lanes(benchmark: Callable, estimator: AttitudeEkf | AttitudeGda) -> None:
    """Whole estimates of 16 recordings at once, beside one after the other in the same run."""
    recordings = [ride(draw) for draw in range(16)]
    samples = sum(len(one.imu) for one in recordings)
    alone = best_us(lambda: [estimator.estimate(one) for one in recordings], samples)
    # The loop itself is a third of an estimate, and what lanes need besides takes most of what they gain: no
    # limit, a figure to be watched.
    report(benchmark, lambda: estimator.estimate_many(recordings), samples, ratio_to_alone=alone)


def test_compensation(benchmark: Callable) -> None:
    report(benchmark, lambda: track_acceleration(ride()), len(ride().imu))


@lru_cache
def trajectory_model() -> Model:
    return TrajectorySmoother().model(ride())


def run_trajectory(model: Model, *, with_covariance: bool) -> Callable[[], None]:
    """Filter and smoother on arrays that are there, as for the other kernels."""
    n = len(model.signals)
    past, out = room_for_past(n), room_for_filtered(innovations=n)

    def run() -> None:
        trajectory_filter(model, past, out)
        chosen = np.arange(STATES if with_covariance else 0)
        trajectory_back(model, past, chosen, past.states, past.covariance)

    return run


@lru_cache
def trajectory_filterpy_us(smoothed: bool) -> float:
    model = trajectory_model()
    few = model._replace(signals=model.signals[:SLOW])
    run = lambda: filterpy_smoother(few, smoothed=smoothed, with_covariance=smoothed)  # noqa: E731
    return best_us(run, SLOW, rounds=3)


def report_trajectory(
    benchmark: Callable,
    function: Callable[[], object],
    *,
    limit_us: float,
    smoothed: bool,
) -> None:
    theirs = trajectory_filterpy_us(smoothed)
    us = report(benchmark, function, len(trajectory_model().signals), ratio_to_filterpy=theirs)
    assert us < limit_us
    assert theirs > 40.0 * us


def test_trajectory_filter_with_likelihood(benchmark: Callable) -> None:
    model = trajectory_model()
    report_trajectory(benchmark, lambda: log_likelihood(model), limit_us=1.0, smoothed=False)


def test_trajectory_smoother_means(benchmark: Callable) -> None:
    run = run_trajectory(trajectory_model(), with_covariance=False)
    report_trajectory(benchmark, run, limit_us=1.8, smoothed=True)


def test_trajectory_smoother_with_covariances(benchmark: Callable) -> None:
    run = run_trajectory(trajectory_model(), with_covariance=True)
    report_trajectory(benchmark, run, limit_us=4.0, smoothed=True)


def test_trajectory_whole_estimate(benchmark: Callable) -> None:
    smoother = TrajectorySmoother()
    us = report(
        benchmark,
        lambda: smoother.estimate(ride()),
        len(ride().imu),
        ratio_to_filterpy=trajectory_filterpy_us(True),
    )
    assert us <= 2.0


def test_trajectory_time_is_linear_in_the_ride() -> None:
    """Four times the ride takes four times as long, new memory included."""
    model = trajectory_model()
    long = model._replace(
        signals=np.tile(model.signals, (4, 1)),
        track=np.ascontiguousarray(np.tile(model.track, (4, 1))),
        kinds=np.tile(model.kinds, 4),
    )
    times = [best_us(lambda m=m: run_model(m, smoothed=True), len(m.signals)) for m in (model, long)]
    assert times[1] < 1.5 * times[0]
