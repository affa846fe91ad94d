"""What a sensor costs, beside numpy's own random numbers and, where it is installed, a peer's IMU model.

The peer is imu-error-model, of the extra ``bench``: pyins and gnss-ins-sim are not on PyPI. Ratios within
one run are what counts: the machine is never quiet.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IMU
from simrail.core.toml_files import load
from simrail.recording.sheets.grades import ImuGrade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount, Truth
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.imu import arrived, sample_imu
from simrail.sensors.imu_response import Temperature
from simrail.sensors.measure import measure
from simrail.track.file import TrackFile
from simrail.vehicle.speed_profile import SpeedProfile

SECONDS, RATE_HZ = 200.0, 250.0
TEMPERATURE = Temperature(10.0, 40.0)
NAMED = {"seed": 1, "draw": 0, "name": "imu"}

ALL = ImuGrade(
    "all",
    RATE_HZ,
    gyro_noise_radpsqrts=1e-4,
    accel_noise_mpsqrts=1e-3,
    gyro_bias_instability_radps=1e-5,
    accel_bias_instability_mps2=1e-4,
    bias_process="flicker",
    gyro_random_walk_radpspsqrts=1e-6,
    accel_random_walk_mps2psqrts=1e-5,
    gyro_turn_on_bias_radps=1e-3,
    accel_turn_on_bias_mps2=0.02,
    gyro_scale_error=0.01,
    accel_scale_error=0.01,
    gyro_nonlinearity=3e-4,
    accel_nonlinearity=3e-4,
    package_misalignment_rad=1e-3,
    gyro_nonorthogonality_rad=1e-3,
    accel_nonorthogonality_rad=1e-3,
    gyro_g_sensitivity_radspm=1e-5,
    gyro_vibration_rectification_rads3pm2=1e-6,
    accel_vibration_rectification_s2pm=1e-5,
    gyro_bias_temperature_radpspk=1e-5,
    accel_bias_temperature_mps2pk=1e-4,
    gyro_scale_temperature_1pk=1e-5,
    accel_scale_temperature_1pk=1e-5,
    gyro_range_radps=5.0,
    accel_range_mps2=50.0,
    gyro_resolution_radps=1e-4,
    accel_resolution_mps2=1e-3,
    bandwidth_hz=100.0,
    clock_jitter_s=1e-5,
    clock_drift=5e-5,
    dropped_fraction=0.01,
)


def motion(rate_hz: float) -> pd.DataFrame:
    count = round(SECONDS * rate_hz)
    index = pd.Index(np.arange(count) / rate_hz, name="time_s")
    values = np.random.default_rng(0).standard_normal((count, 6))
    return pd.DataFrame(values, index=index, columns=list(IMU))


def record(truth: pd.DataFrame, grade: ImuGrade) -> pd.DataFrame:
    imu, _ = sample_imu(truth, grade, temperature=TEMPERATURE, **NAMED)
    return arrived(imu, grade, **NAMED)


def best_of(*calls: Callable[[], object], rounds: int = 12) -> list[float]:
    """Shortest time of each call, taken in turns."""
    best = [np.inf] * len(calls)
    for _ in range(rounds):
        for i, call in enumerate(calls):
            begun = time.perf_counter()
            call()
            best[i] = min(best[i], time.perf_counter() - begun)
    return best


@pytest.mark.parametrize("truth_hz", (250.0, 1000.0), ids=lambda rate: f"truth{rate:.0f}Hz")
def test_all_terms_cost_at_most_three_times_their_random_numbers(benchmark, truth_hz):
    """Flicker of six stages an axis; with the decimation and the clock's interpolation from 1 kHz, too."""
    truth = motion(truth_hz)
    record(truth, ALL)
    rows = round(SECONDS * RATE_HZ)
    stages = len(ALL.bias_stages("gyro")[0])
    numbers = rows * (6 * (1 + stages + 1) + 1)  # white, flicker and walk of six axes, and jitter
    generator = np.random.default_rng(1)

    def bare() -> None:
        generator.standard_normal(numbers)
        generator.uniform(size=rows)  # lost samples

    took, drawn = best_of(lambda: record(truth, ALL), bare)
    benchmark.extra_info["us_per_sample"] = 1e6 * took / rows
    benchmark.extra_info["times_bare_numbers"] = took / drawn
    benchmark.pedantic(record, args=(truth, ALL), rounds=3)
    assert took < 3.0 * drawn


def test_faster_than_imu_error_model(benchmark):
    """White noise, Gauss-Markov bias, initial bias and scale factor on the same 250 Hz, per sample."""
    peer = pytest.importorskip("imu_error_model", reason="pip install simrail[bench]")
    axis = peer.AxisConfig(
        white_noise_density=1e-4,
        turn_on_bias_std=1e-3,
        bias_std=1e-5,
        bias_correlation_time=300.0,
        scale_factor=0.01,
    )
    model = peer.ImuModel(peer.ImuConfig(gyroscope=axis, accelerometer=axis), rng=np.random.default_rng(1))
    count = 2000
    velocity, orientation = np.zeros(3), np.eye(3)

    def theirs() -> None:
        model.reset()
        for k in range(count):
            model.measure(k / RATE_HZ, velocity, orientation)

    grade = ImuGrade(
        "same",
        RATE_HZ,
        gyro_noise_radpsqrts=1e-4,
        accel_noise_mpsqrts=1e-4,
        gyro_bias_instability_radps=1e-5,
        accel_bias_instability_mps2=1e-5,
        gyro_turn_on_bias_radps=1e-3,
        accel_turn_on_bias_mps2=1e-3,
        gyro_scale_error=0.01,
        accel_scale_error=0.01,
    )
    truth = motion(RATE_HZ)
    record(truth, grade)
    ours, peers = best_of(lambda: record(truth, grade), theirs, rounds=3)
    ours_us, peers_us = 1e6 * ours / len(truth), 1e6 * peers / count
    benchmark.extra_info["us_per_sample"] = ours_us
    benchmark.extra_info["peer_us_per_sample"] = peers_us
    benchmark.pedantic(record, args=(truth, grade), rounds=3)
    assert ours_us < peers_us


def test_a_recording_costs_at_most_three_microseconds_a_sample(benchmark):
    """Motion of the mount included, worked out anew each time, from a truth at 1 kHz; processor time.

    Beside it, what scipy takes to turn the body's accelerations of the same truth into its axes, which is
    a small part of that motion.
    """
    from scipy.spatial.transform import Rotation

    track = load(TrackFile, "track", "condequinto_olivar").design("condequinto_olivar")
    profile = SpeedProfile(20.0, 1900.0, 10.0)
    truth = kinematic_truth(track, profile, height_m=0.29, wheel_radius_m=0.29)
    mount, encoder = Mount("axle", "body", (0.2, 0.1, 0.6)), EncoderSpec("wheel", radius="calibrated")
    body = truth.bodies["body"]

    def ours() -> int:
        fresh: Truth = replace(truth)
        recording = measure(fresh, name="ride", mount=mount, grade=ALL, encoder=encoder, seed=1, draw=0)
        return len(recording.imu)

    def theirs() -> None:
        Rotation.from_euler("ZYX", body.angles[:, ::-1]).inv().apply(body.acceleration)

    samples = ours()
    best = [np.inf, np.inf]
    for _ in range(7):
        for i, call in enumerate((ours, theirs)):
            begun = time.process_time()
            call()
            best[i] = min(best[i], time.process_time() - begun)
    us, peer_us = (1e6 * seconds / samples for seconds in best)
    benchmark.extra_info["us_per_sample"] = us
    benchmark.extra_info["scipy_rotation_us_per_sample"] = peer_us
    print(f"\nmeasure {us:.2f} us a sample; scipy turns its accelerations alone in {peer_us:.2f} us")
    benchmark.pedantic(ours, rounds=1)
    assert us < 3.0
