"""The recommended tuning does what its derivation says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from simrail.estimators.attitude.compensation import design_frame, gravity_and_curves
from simrail.estimators.attitude.noise import bias_variance, paper_noise, recommended_noise, time_constant
from simrail.estimators.attitude.rest_bias import rest_bias

from simrail.recording.recording import Recording, beginning

GRAVITY = 9.81


@pytest.fixture
def recording(bend: Callable, exactly: Callable) -> Recording:
    ride = exactly(bend())
    ride.odometry[["position_sd_m", "speed_sd_mps", "acceleration_sd_mps2"]] = 1.5, 0.02, 0.04
    return ride


@pytest.mark.parametrize("sensor", [1e-9, 1e-6, 1e-4])
@pytest.mark.parametrize("swing", [0.0, 1e-6, 1e-3, 1e-1])
@pytest.mark.parametrize("bias", [0.0, 1e-10, 1e-7])
def test_time_constant_minimises_the_error(sensor: float, swing: float, bias: float) -> None:
    """Against a numerical search of N^2 tau/2 + b^2 tau^2 + noise/(2 g^2 tau), the noise held."""
    white = 8e-9
    tau = float(time_constant(sensor, np.array([swing]), white, np.array([bias]), gravity=GRAVITY)[0])
    noise = sensor + 2.0 * swing / tau

    def error(log_tau: float) -> float:
        at = np.exp(log_tau)
        return float(np.log(white * at / 2 + bias * at**2 + noise / (2 * GRAVITY**2 * at)))

    best = minimize_scalar(error, bracket=(np.log(tau) - 1.0, np.log(tau) + 1.0), tol=1e-12)
    # A minimum is found to the square root of the rounding only.
    assert tau == pytest.approx(np.exp(best.x), rel=1e-6)
    residual = (sensor + 2 * swing / tau) / (GRAVITY * tau) ** 2 - white - 4 * bias * tau
    assert abs(residual) < 1e-9 * (white + 4 * bias * tau)


def test_time_constant_of_a_sample_does_not_depend_on_the_others() -> None:
    """Those that are found at once stop each by itself, however far apart they are."""
    rng = np.random.default_rng(3)
    swing, bias = 10.0 ** rng.uniform(-9.0, 0.0, 200), 10.0 ** rng.uniform(-12.0, -6.0, 200)
    whole = time_constant(1e-6, swing, 8e-9, bias, gravity=GRAVITY)
    for i in range(0, 200, 7):
        alone = time_constant(1e-6, swing[i : i + 1], 8e-9, bias[i : i + 1], gravity=GRAVITY)
        assert alone[0] == whole[i]


def test_noise_follows_a_speed_that_jumps(recording: Recording) -> None:
    """From one time constant to another that is nowhere near: each is as if it had been the first."""
    speed = recording.odometry["speed_mps"].to_numpy().copy()
    speed[3000:3100] = 0.0
    speed[3050] = 80.0
    jumps = replace(recording, odometry=recording.odometry.assign(speed_mps=speed))
    rest, sheet = rest_bias(recording), recording.imu_sheet
    found = recommended_noise(jumps, rest, curves=None)
    white = sheet.gyro_noise_radpsqrts**2 + 1e-10
    sensor = sheet.accel_noise_mpsqrts**2 + 1e-6 / 250.0
    bias = bias_variance(sheet, rest.samples / 250.0)
    tau = time_constant(sensor, (2e-3 * speed) ** 2, white, bias, gravity=GRAVITY)
    np.testing.assert_allclose(found.process, (white + 4.0 * bias * tau) / 250.0, rtol=1e-12)


def curves_of(recording: Recording) -> np.ndarray:
    """What the compensation of a recording is made of."""
    return gravity_and_curves(recording, compensated=True).curves


def test_process_noise_gives_that_time_constant(recording: Recording) -> None:
    """sqrt(R Ts / Qc) / g = tau on every sample, without the odometry's share of R."""
    rest = rest_bias(recording)
    noise = recommended_noise(recording, rest, curves=None)
    intensity = noise.process * 250.0
    tau = np.sqrt(noise.force[:, 2] / 250.0 / intensity) / GRAVITY
    white = recording.imu_sheet.gyro_noise_radpsqrts**2 + 1e-10
    bias = bias_variance(recording.imu_sheet, rest.samples / 250.0)
    np.testing.assert_allclose(intensity, white + 4 * bias * tau, rtol=1e-9)
    # Standing, the accelerometer is quiet and trusted quickly; running, it is not.
    standing, running = tau[200], tau[len(tau) // 2]
    assert 0.3 < standing < 1.5 and 2.0 < running < 10.0


def test_odometry_widens_the_force_where_it_matters(recording: Recording) -> None:
    rest, frame = rest_bias(recording), design_frame(recording)
    blind = recommended_noise(recording, rest, curves=None)
    aware = recommended_noise(recording, rest, curves=curves_of(recording))
    np.testing.assert_allclose((aware.force - blind.force)[:, 0], 0.04**2, rtol=1e-9)
    extra = (aware.force - blind.force)[:, 1]
    kind = recording.track.kind(frame.s_m)
    tau = np.sqrt(blind.force[:, 1] / 250.0 / (blind.process * 250.0)) / GRAVITY
    speed = recording.odometry["speed_mps"].to_numpy()
    in_curve = (2 * speed * frame.k[:, 2] * 0.02) ** 2 * tau * 250.0
    arc = (kind == 2) & (np.abs(frame.dk[:, 2]) < 1e-12)
    np.testing.assert_allclose(extra[arc], in_curve[arc], rtol=1e-6)
    assert extra[kind == 1].max() > 20 * extra[kind == 2].max()
    level = (kind == 0) & (np.abs(frame.k).max(axis=1) == 0.0)
    assert level.any() and not extra[level].any()


def test_residual_bias_shrinks_with_the_rest_to_the_drift(recording: Recording) -> None:
    sheet = recording.imu_sheet
    drift, turn_on = sheet.gyro_bias_instability_radps**2, sheet.gyro_turn_on_bias_radps**2 / 3
    found = bias_variance(sheet, np.array([0.0, 1e-4, 20.0, 1e9]))
    white = sheet.gyro_noise_radpsqrts**2
    np.testing.assert_allclose(
        found, [turn_on + drift, turn_on + drift, white / 20 + 2 * drift, 2 * drift], rtol=1e-6
    )
    perfect = replace(sheet, gyro_turn_on_bias_radps=0.0, gyro_bias_instability_radps=0.0)
    assert not bias_variance(perfect, np.array([0.0, 20.0])).any()


def test_what_is_considered_is_a_tilt_by_the_accelerometers_bias_and_the_heading_since_the_rest(
    recording: Recording,
) -> None:
    """A bias uniform within its bound b tilts by b / (sqrt(3) g); a rate's error adds up from the rest on."""
    sheet, rest = recording.imu_sheet, rest_bias(recording)
    considered = recommended_noise(recording, rest, curves=None).considered
    tilt = sheet.accel_turn_on_bias_mps2 / np.sqrt(3.0) / GRAVITY
    np.testing.assert_allclose(np.sqrt(considered[:, :2]), tilt, rtol=1e-9)
    last = int(np.flatnonzero(np.diff(rest.samples))[-1]) + 1  # from here on the bias stays as it is
    drift = np.sqrt(bias_variance(sheet, rest.samples[last:] / 250.0))
    since = (np.arange(last, len(considered)) - rest.samples[last]) / 250.0
    np.testing.assert_allclose(np.sqrt(considered[last:, 2]), drift * since, rtol=1e-9)


def test_a_perfect_imu_gets_finite_positive_noise(recording: Recording) -> None:
    zero = {
        field: 0.0
        for field in vars(recording.imu_sheet)
        if field.endswith(("radps", "mps2", "radpsqrts", "mpsqrts"))
    }
    ideal = replace(recording, imu_sheet=replace(recording.imu_sheet, **zero))
    noise = recommended_noise(ideal, rest_bias(ideal), curves=curves_of(ideal))
    assert (noise.process > 0.0).all() and (noise.force > 0.0).all()
    assert np.isfinite(noise.process).all() and np.isfinite(noise.force).all()
    assert not noise.considered.any()


def test_paper_noise_in_both_readings(recording: Recording) -> None:
    """Section 6: Q_{k-1} = 1e-2 I with k = 2.5 and Ts = 4 ms; final 1e-3 and R = 1.5^2 10^2."""
    assert paper_noise(recording, "paper_initial", reading="per_step").process[0] == 1e-2
    assert paper_noise(recording, "paper_initial", reading="intensity").process[0] == pytest.approx(4e-5)
    final = paper_noise(recording, "paper_final", reading="intensity")
    assert final.process[0] == pytest.approx(4e-6) and final.force[0, 0] == 225.0


def test_noise_of_a_prefix_is_the_prefix_of_the_noise(recording: Recording) -> None:
    def noise(ride: Recording) -> tuple[np.ndarray, ...]:
        return recommended_noise(ride, rest_bias(ride), curves=curves_of(ride))

    for n in (3, 301, 7001):
        for whole, part in zip(noise(recording), noise(beginning(recording, samples=n)), strict=True):
            np.testing.assert_array_equal(whole[:n], part)
