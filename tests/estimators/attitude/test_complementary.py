"""The complementary filter on closed forms: what it believes of a rest, of a start, of a curve, of a bias."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.attitude.complementary import ComplementaryFilter

from simrail.core.columns import ACCEL, GYRO, ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.recording.recording import Recording

G, RATE_HZ = 9.81, 250.0
ROLL, PITCH = 0.07, -0.03


@pytest.fixture
def steady(exactly: Callable, bend: Callable) -> Callable[..., Recording]:
    """Signals that stay, with an odometry that knows the motion; the first second may be another's."""

    def record(
        force: tuple, rate: tuple = (0, 0, 0), *, speed: float = 0.0, gain: float = 0.0, first: tuple = ()
    ):
        n = 10000
        index = pd.Index(np.arange(n) / RATE_HZ, name="time_s")
        imu = pd.DataFrame(np.tile([*rate, *force], (n, 1)), index=index, columns=[*GYRO, *ACCEL]).astype(
            float
        )
        if first:
            imu.iloc[: int(RATE_HZ)] = [0.0, 0.0, 0.0, *first]
        odometry = pd.DataFrame(0.0, index=index, columns=[*ODOMETRY, *ODOMETRY_SD])
        odometry["speed_mps"], odometry["acceleration_mps2"] = speed, gain
        return replace(exactly(bend()), imu=imu, odometry=odometry)

    return record


def at_rest(roll: float, pitch: float) -> np.ndarray:
    """Specific force of a body that stands (EQUATIONS 0)."""
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    return G * np.array([-sp, sr * cp, cr * cp])


def angles(method: ComplementaryFilter, recording: Recording) -> np.ndarray:
    return method.estimate(recording).states.iloc[:, :2].to_numpy()


def test_a_standing_tilt(steady: Callable) -> None:
    """As printed but for its sign, atan of f_y / g stands in for the angle; the printed sign mirrors it."""
    recording = steady(tuple(at_rest(ROLL, PITCH)))
    np.testing.assert_allclose(
        angles(ComplementaryFilter(compensated=True), recording) - [ROLL, PITCH], 0.0, atol=1e-12
    )
    roll = math.atan(math.sin(ROLL) * math.cos(PITCH))
    np.testing.assert_allclose(angles(ComplementaryFilter(), recording) - [roll, PITCH], 0.0, atol=1e-12)
    printed = angles(ComplementaryFilter(printed=True), recording)
    np.testing.assert_allclose(printed - [-roll, PITCH], 0.0, atol=1e-12)
    lying = steady(tuple(at_rest(math.radians(8.0), 0.0)))
    assert np.degrees(angles(ComplementaryFilter(), lying)[-1, 0]) == pytest.approx(8.0 - 0.08, abs=0.005)


def leaning(seconds: float, t: float) -> float:
    """How much of a step a low pass of the first order has after so long, in steps of the filter."""
    kept = t / (t + 1.0 / RATE_HZ)
    return 1.0 - kept ** round(seconds * RATE_HZ)


def test_a_start_is_taken_for_a_slope(steady: Callable) -> None:
    """1 m/s2 is asin(1 / g) of pitch, nose up, by the share that T lets in; T has passed before."""
    recording = steady((1.0, 0.0, G), gain=1.0, first=(0.0, 0.0, G))
    found = angles(ComplementaryFilter(time_constant_s=0.5), recording)
    for seconds in (0.2, 1.0, 5.0):
        pitch = found[int((1.0 + seconds) * RATE_HZ) - 1, 1]
        assert pitch == pytest.approx(-math.asin(1.0 / G) * leaning(seconds, 0.5), abs=1e-12)
    known = angles(ComplementaryFilter(compensated=True), steady((1.0, 0.0, G), gain=1.0))
    np.testing.assert_allclose(known, 0.0, atol=1e-12)


@pytest.mark.parametrize("speed", [20.0, -20.0])
@pytest.mark.parametrize("cant", [0.0, -0.1])
def test_a_curve_is_taken_for_a_roll(cant: float, speed: float, steady: Callable) -> None:
    """A left curve of 300 m, steady: uncompensated it goes by the direction of the force, atan(f_y / g)."""
    turn = speed / 300.0
    sine, cosine = math.sin(cant), math.cos(cant)
    inward = turn * speed
    force = (0.0, inward * cosine + G * sine, -inward * sine + G * cosine)
    recording = steady(force, (0.0, sine * turn, cosine * turn), speed=speed)
    known = angles(ComplementaryFilter(compensated=True, rest_bias=False), recording)
    np.testing.assert_allclose(known - [cant, 0.0], 0.0, atol=1e-12)
    # T so short that the gyro, which would turn the leaning horizon, has no say.
    leans = angles(ComplementaryFilter(time_constant_s=1e-6, rest_bias=False), recording)
    np.testing.assert_allclose(leans[1:, 0], math.atan(force[1] / G), atol=1e-6)
    assert leans[-1, 0] - cant > math.radians(6.0)


def test_a_bias_tilts_by_the_time_constant(steady: Callable) -> None:
    """In the end T bias, exactly: c step bias / (1 - c) with c = T / (T + step)."""
    recording = steady((0.0, 0.0, G), (1e-3, 0.0, 0.0))
    found = angles(ComplementaryFilter(time_constant_s=2.0, rest_bias=False), recording)
    assert found[-1, 0] == pytest.approx(2.0 * 1e-3, rel=1e-6)


def test_what_it_says_it_is() -> None:
    assert ComplementaryFilter().needs == () and ComplementaryFilter(compensated=True).needs == ("odometry",)
    assert ComplementaryFilter(printed=True).role == "ablation"
    with pytest.raises(InputError, match="time_constant_s"):
        ComplementaryFilter(time_constant_s=0.0)
