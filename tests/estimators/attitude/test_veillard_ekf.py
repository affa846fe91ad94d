"""The eleven-state EKF: against filterpy, its Jacobian, on closed forms, and what it says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from simrail.estimators.attitude.veillard_ekf import VeillardEkf, first_rest_mean
from simrail.estimators.attitude.veillard_kernel import (
    AX,
    BIAS_X,
    PITCH,
    ROLL,
    STATES,
    YAW_RATE,
    Found,
    Model,
    V,
    eleven_states,
    room,
)
from twins.veillard import filterpy_eleven_states, measured

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.conformance import standing, time_reversed
from simrail.recording.recording import Recording, beginning

G = 9.81
GIVEN = {"slope": 0.9, "intercept_mps": -16.0, "calibration": "given"}


@pytest.fixture
def noisy(bend: Callable, exactly: Callable) -> Recording:
    recording = exactly(bend())
    rng = stream(2, "noisy")
    recording.imu.iloc[:, :3] += 1.4e-3 * rng.standard_normal((len(recording.imu), 3))
    recording.imu.iloc[:, 3:] += 0.3 * rng.standard_normal((len(recording.imu), 3))
    return recording


@pytest.mark.parametrize("piece", ["start", "standstill", "curve", "reverse"])
@pytest.mark.parametrize("compensated", [False, True])
def test_kernel_equals_filterpy(piece: str, compensated: bool, noisy: Recording) -> None:
    recording = {
        "start": lambda: noisy,
        "standstill": lambda: standing(noisy),
        "curve": lambda: replace(noisy, imu=noisy.imu.iloc[2300:]),
        "reverse": lambda: time_reversed(replace(noisy, imu=noisy.imu.iloc[1700:3000], odometry=None)),
    }[piece]()
    method = VeillardEkf(**GIVEN, compensated=compensated, frame=128, hop=32)
    short = beginning(replace(recording, odometry=None), samples=700)
    model = method.model(short, method.spectral.frame_speeds(short))
    assert np.isfinite(model.speed).sum() > 10
    ours, theirs = room(700), room(700)
    eleven_states(model, ours)
    filterpy_eleven_states(model, theirs)
    np.testing.assert_allclose(ours.states, theirs.states, rtol=0, atol=1e-9)
    np.testing.assert_allclose(ours.variances, theirs.variances, rtol=1e-9, atol=0)
    np.testing.assert_allclose(ours.innovations, theirs.innovations, rtol=1e-9, atol=1e-9)


def test_the_jacobian_is_the_slope_of_the_measurements() -> None:
    rng, step = stream(3, "jacobian"), 1e-6
    for _ in range(5):
        x = rng.uniform(-0.3, 0.3, STATES)
        slopes = [(measured(x + d, G)[0] - measured(x - d, G)[0]) / (2 * step) for d in step * np.eye(STATES)]
        np.testing.assert_allclose(measured(x, G)[1], np.transpose(slopes), atol=1e-8)


def run(signals: np.ndarray, speed: np.ndarray, *, late: int = 0, compensated: bool = True) -> Found:
    """The filter at 100 Hz on signals without noise, level and at rest at first, tuned as of an IMU."""
    n = len(signals)
    q = np.array([4e-4] * 3 + [1e-8] * 2 + [0.36] * 3 + [0.0] + [4e-12] * 2) * 0.01
    model = Model(
        signals=np.ascontiguousarray(signals, dtype=float),
        speed=speed,
        process=q,
        noise=np.array([1e-4] * 3 + [0.01] * 3 + [0.08] * 2 + [0.04]),
        start=np.zeros(STATES),
        start_variance=np.array([1e-4] * 3 + [0.01] * 5 + [0.01] + [2.5e-7] * 2),
        late=late,
        compensated=compensated,
        time_constant_s=5.0,
        step_s=0.01,
        gravity=G,
    )
    found = room(n)
    eleven_states(model, found)
    return found


def test_a_standing_tilt_is_found_and_stays() -> None:
    roll, pitch = 0.05, -0.02
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    signals = np.tile([0.0, 0.0, 0.0, -G * sp, G * sr * cp, G * cr * cp], (20000, 1))
    still = np.where(np.arange(20000) % 50 == 0, 0.0, np.nan)
    found = run(signals, still, compensated=False)
    assert found.states[-1, ROLL] == pytest.approx(math.atan(sr * cp), abs=2e-4)
    assert found.states[-1, PITCH] == pytest.approx(pitch, abs=2e-4)
    assert found.states[-1, V] == pytest.approx(0.0, abs=0.02)


def gaining(gain: float, late: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A level train that gains so much after ten seconds: signals, its speed, and that told late."""
    k = np.arange(3000)
    signals = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, G], (3000, 1))
    signals[1000:, 3] = gain
    exact = gain * 0.01 * np.maximum(k - 1000, 0)
    told = gain * 0.01 * np.maximum(k - late - 1000, 0)
    return signals, exact, np.where(k % 50 == 0, told, np.nan)


@pytest.mark.parametrize("gain", [1.0, -1.0])
def test_a_steady_gain_of_speed(gain: float) -> None:
    """A speed that is known two seconds late is compared with that of two seconds ago."""
    signals, exact, told = gaining(gain, 200)
    found = run(signals, told, late=200)
    np.testing.assert_allclose(found.states[1000:, V], exact[1000:], atol=0.1)
    np.testing.assert_allclose(found.states[1200:, AX], gain, atol=0.02)
    assert np.abs(found.states[1000:, PITCH]).max() < 2e-3
    as_if_new = run(signals, told)
    assert abs(as_if_new.states[-1, V] - exact[-1]) > 1.0


def test_the_filter_as_printed_takes_a_gain_for_a_slope() -> None:
    """Ten seconds of 1 m/s2, 5.9 degrees to a filter that knows no motion, while no speed is told."""
    signals, exact, told = gaining(1.0, 0)
    told[1000:] = np.nan
    leaning, known = (
        run(signals, told, compensated=compensated).states[2000] for compensated in (False, True)
    )
    assert leaning[PITCH] < -math.radians(1.0)
    assert abs(known[PITCH]) < 0.05 * abs(leaning[PITCH])
    assert known[V] == pytest.approx(exact[2000], abs=0.2)
    assert leaning[V] < exact[2000] - 0.5


@pytest.mark.parametrize("speed", [15.0, -15.0])
def test_a_coordinated_curve(speed: float) -> None:
    """A start, then a left curve of 300 m without cant: roll stays only where w x v is taken off."""
    n, enters = 5000, 3000
    k = np.arange(n)
    v = speed * np.clip((k - 1000) / 1500.0, 0.0, 1.0)
    turn = np.clip((k - enters) / 300.0, 0.0, 1.0) * v / 300.0
    signals = np.zeros((n, 6))
    signals[:, 3] = np.gradient(v, 0.01)
    signals[:, 2], signals[:, 4], signals[:, 5] = turn, turn * v, G
    told = np.where(k % 50 == 0, v, np.nan)
    known = run(signals, told)
    assert np.abs(known.states[enters:, ROLL]).max() < math.radians(0.15)
    assert known.states[-1, YAW_RATE] == pytest.approx(speed / 300.0, rel=0.01)
    leans = run(signals, told, compensated=False)
    assert leans.states[-1, ROLL] > math.radians(1.0)


def test_a_gyros_bias_is_found() -> None:
    """Roll does not turn, so what the gyro shows is its bias; the horizon is then rid of it."""
    signals = np.tile([5e-4, 0.0, 0.0, 0.0, 0.0, G], (60000, 1))
    found = run(signals, np.where(np.arange(60000) % 50 == 0, 0.0, np.nan))
    assert found.states[-1, BIAS_X] == pytest.approx(5e-4, rel=0.02)
    assert found.states[-1, ROLL] == pytest.approx(0.0, abs=1e-4)


def test_the_first_rest_gives_the_gyro_its_zero(noisy: Recording) -> None:
    """The mean of the samples so far, in whole blocks of 0.04 s, until the train leaves; then it stays."""
    noisy.imu.iloc[:, 1] += 0.004
    found, gyro = first_rest_mean(noisy), noisy.imu.iloc[:, :3].to_numpy()
    np.testing.assert_allclose(found[250], gyro[:250].mean(axis=0), rtol=1e-9)
    np.testing.assert_array_equal(found[-1], found[1500])
    assert found[-1, 1] == pytest.approx(0.004, abs=4.0 * 1.4e-3 / math.sqrt(400.0))


def test_the_way_is_the_sum_of_the_speed(noisy: Recording) -> None:
    states = VeillardEkf(**GIVEN, frame=256).estimate(replace(noisy, odometry=None)).states
    way = np.cumsum(states["speed_mps"].to_numpy()) / noisy.imu_sheet.rate_hz
    np.testing.assert_allclose(states["position_m"] - noisy.start_position_m, way, atol=1e-9)
    assert (np.diff(states["position_sd_m"].to_numpy()[-1000:]) >= 0.0).all()


def test_what_it_says_it_is() -> None:
    method = VeillardEkf(**GIVEN)
    assert (method.causal, method.needs, method.role) == (True, (), "method")
    own = VeillardEkf(calibration="encoder")
    assert (own.causal, own.needs, own.role) == (False, ("encoder",), "ablation")


@pytest.mark.parametrize(
    "options", [{"dated": "start"}, {"time_constant_s": 0.0}, {"hop": 0}, {"direction": "up"}]
)
def test_options_are_judged(options: dict) -> None:
    with pytest.raises(InputError):
        VeillardEkf(**options)
