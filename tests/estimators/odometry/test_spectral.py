"""Spectral speed: its sum on closed forms, its calibration, when a frame is known, and what it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.spectral import (
    HAMMING_BINS,
    RAYLEIGH,
    Frames,
    SpectralOdometry,
    calibrate,
    frames_of,
    spectral_sums,
)

from simrail.core.columns import ACCEL, GYRO
from simrail.core.errors import InputError
from simrail.core.resample import GAPS
from simrail.core.seeds import stream
from simrail.recording.recording import Recording

FRAME, HOP, RATE_HZ, G = 1024, 128, 250.0, 9.81


def tone(amplitude: np.ndarray | float, n: int, *, cycles: int = 100) -> np.ndarray:
    """Gravity and a sine of so many cycles in a frame."""
    return G + amplitude * np.sin(2.0 * np.pi * cycles / FRAME * np.arange(n))


@pytest.fixture
def shaking(exactly: Callable, bend: Callable) -> Callable[..., Recording]:
    """An IMU that stands level, whose vertical axis shows a signal, and X a force."""

    def record(vertical: np.ndarray, along: np.ndarray | float = 0.0) -> Recording:
        ride: Recording = exactly(bend(15.0, 1))
        index = pd.Index(np.arange(len(vertical)) / RATE_HZ, name="time_s")
        imu = pd.DataFrame(0.0, index=index, columns=[*GYRO, *ACCEL])
        imu[ACCEL[2]] = vertical
        imu[ACCEL[0]] = along
        return replace(ride, imu=imu, odometry=None, odometry_source="", start_position_m=100.0)

    return record


def test_a_sine_shows_its_amplitude_and_gravity_nothing() -> None:
    """Hamming's periodic window has three lines, .54 N and twice .23 N: of a sine together A N / 2."""
    found = spectral_sums(tone(0.3, 5000), frame=FRAME, hop=HOP)
    assert len(found) == 1 + (5000 - FRAME) // HOP
    np.testing.assert_allclose(found, 0.3 * FRAME / 2.0, rtol=1e-10)


def test_what_is_as_slow_as_a_frame_hardly_counts() -> None:
    """Of one cycle in a frame the line at 1, .54 N A / 2, is left out; that at 2 stays."""
    found = spectral_sums(tone(0.3, FRAME, cycles=1), frame=FRAME, hop=HOP)
    np.testing.assert_allclose(found, 0.23 * 0.3 * FRAME / 2.0, rtol=1e-10)


def test_as_printed_gravity_outweighs_what_shakes() -> None:
    """|H_0| + |H_1| = (.54 + .23) g N: 7.7e3 m/s2."""
    found = spectral_sums(tone(0.3, FRAME), frame=FRAME, hop=HOP, printed=True)
    np.testing.assert_allclose(found, 0.77 * G * FRAME + 0.3 * FRAME / 2.0, rtol=1e-10)


def test_white_noise_shows_its_standard_deviation() -> None:
    """|H_k| is Rayleigh's, of mean sd sqrt(pi sum w^2) / 2, but at k = N / 2 half a normal distribution's."""
    sd, n = 0.0155, 400 * FRAME
    found = spectral_sums(G + sd * stream(3, "white").standard_normal(n), frame=FRAME, hop=FRAME)
    root = math.sqrt((0.54**2 + 0.46**2 / 2.0) * FRAME)
    mean = sd * root * ((FRAME / 2 - 2) * math.sqrt(math.pi) / 2.0 + math.sqrt(2.0 / math.pi))
    spread = RAYLEIGH / math.sqrt(FRAME / 2 / HAMMING_BINS)  # of one frame, relative
    assert found.mean() == pytest.approx(mean, rel=4.0 * spread / math.sqrt(len(found)))
    # An sd of 400 frames varies by 1 / sqrt(800) of itself.
    assert found.std() / found.mean() == pytest.approx(spread, rel=4.0 / math.sqrt(800.0))


def test_a_short_recording_has_no_frame(shaking: Callable) -> None:
    assert len(frames_of(shaking(tone(0.3, FRAME - 1))).ends) == 0
    assert list(frames_of(shaking(tone(0.3, FRAME))).ends) == [FRAME - 1]


def test_frames_with_a_gap_tell_nothing(shaking: Callable) -> None:
    recording = shaking(tone(0.3, 4 * FRAME))
    gaps = pd.DataFrame([[2000 / RATE_HZ, 2010 / RATE_HZ, 9]], columns=list(GAPS))
    found = frames_of(replace(recording, gaps=gaps))
    reaches_in = (found.ends > 2000) & (found.ends - FRAME + 1 < 2010)
    np.testing.assert_array_equal(np.isnan(found.root), reaches_in)


def root_of(amplitude: float) -> float:
    return math.sqrt(amplitude * FRAME / 2.0)


def test_calibration_is_the_line_through_two_speeds(shaking: Callable) -> None:
    quiet, loud = (shaking(tone(amplitude, 4000)) for amplitude in (0.1, 0.4))
    speeds = [np.full(4000, 5.0), np.full(4000, -20.0)]  # of either sign
    found = calibrate([quiet, loud], speeds)
    slope = 15.0 / (root_of(0.4) - root_of(0.1))
    assert found.slope == pytest.approx(slope, rel=1e-9)
    assert found.intercept == pytest.approx(5.0 - slope * root_of(0.1), rel=1e-9)
    assert found.rms == pytest.approx(0.0, abs=1e-7)
    with pytest.raises(InputError, match="rides of one speed"):
        calibrate([quiet], speeds[:1])


def test_a_calibration_takes_the_speed_of_the_frames_centre(shaking: Callable) -> None:
    """Shaking that follows a ramp of the speed: any other date leaves an intercept, the frame's end .41.

    A sine that grows by 8 % within a frame spreads beyond its three lines, by some percent of sqrt(S).
    """
    n = 20 * FRAME
    time = np.arange(n) / RATE_HZ
    level = (10.0 + 0.2 * time) ** 2 * 2.0 / FRAME  # sqrt(S) = 10 + .2 t, and so the speed
    found = calibrate([shaking(tone(level, n))], [10.0 + 0.2 * time])
    assert found.slope == pytest.approx(1.0, abs=0.02)
    assert found.intercept == pytest.approx(0.0, abs=0.15)


def departure(shaking: Callable) -> Recording:
    """Forty seconds of rest that shake a little, then more, after a push along X."""
    n, leaves = 30000, 10000
    amplitude = np.where(np.arange(n) < leaves, 0.1, 0.4)
    push = np.where((np.arange(n) >= leaves) & (np.arange(n) < 15000), -0.5, 0.0)
    return shaking(tone(amplitude, n), push)


def test_the_rest_is_where_the_speed_is_zero(shaking: Callable) -> None:
    """Paper 003: slope from elsewhere, intercept where the train stands; the push says backwards."""
    recording = departure(shaking)
    told = SpectralOdometry(slope=2.0).frame_speeds(recording)
    before, after = told.ends < 10000, told.ends - FRAME > 10000
    np.testing.assert_allclose(told.speed[before], 0.0, atol=1e-9)
    np.testing.assert_allclose(told.speed[after], -2.0 * (root_of(0.4) - root_of(0.1)), rtol=1e-9)


def test_the_estimate_settles_on_speed_and_way(shaking: Callable) -> None:
    recording = departure(shaking)
    states = SpectralOdometry(slope=2.0).estimate(recording).states
    speed = -2.0 * (root_of(0.4) - root_of(0.1))
    last = states.iloc[-1]
    sd = last["speed_sd_mps"]
    assert last["speed_mps"] == pytest.approx(speed, abs=sd)
    assert abs(last["acceleration_mps2"]) < last["acceleration_sd_mps2"]
    assert sd > abs(0.17 * speed)  # one factor of the whole ride
    assert last["position_m"] - 100.0 == pytest.approx(speed * 80.0, abs=last["position_sd_m"])
    assert states["position_m"].iloc[0] == 100.0


def test_what_it_says_it_is() -> None:
    own = SpectralOdometry(calibration="encoder")
    assert (own.causal, own.needs, own.role) == (False, ("encoder",), "ablation")
    given = SpectralOdometry(1.0, 0.0, "given")
    assert (given.causal, given.needs, given.role) == (True, (), "method")
    assert SpectralOdometry(1.0, 0.0, "given", direction="encoder").needs == ("encoder",)


def refused(method: SpectralOdometry, recording: Recording) -> str:
    with pytest.raises(InputError) as caught:
        method.estimate(recording)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_what_cannot_be_is_refused_in_one_line(shaking: Callable) -> None:
    given = SpectralOdometry(1.0, 0.0, "given")
    recording = shaking(tone(0.3, 3000))
    for imu in (
        recording.imu.drop(columns=ACCEL[2]),
        recording.imu.assign(**{ACCEL[2]: 0.0}),
        recording.imu.assign(**{ACCEL[2]: np.nan}),
    ):
        message = refused(given, replace(recording, imu=imu))
        assert "no vertical signal" in message and ACCEL[2] in message
    slow = replace(recording, imu_sheet=replace(recording.imu_sheet, rate_hz=50.0))
    assert "rate is too low for frames of 1024 samples" in refused(given, slow)
    assert len(replace(given, frame=512).estimate(slow).states) == 3000
    assert "slope" in refused(SpectralOdometry(), recording)
    assert "intercept_mps" in refused(SpectralOdometry(1.0, None, "given"), recording)
    turning = recording.imu.assign(**{GYRO[2]: 0.01 * np.arange(3000) / RATE_HZ})
    assert "no rest as long as a frame" in refused(SpectralOdometry(1.0), replace(recording, imu=turning))


@pytest.mark.parametrize(
    "options",
    [
        {"calibration": "mine"},
        {"direction": "left"},
        {"frame": 8},
        {"hop": 0},
        {"hop": 2000},
        {"speed_sd_mps": 0.0},
        {"calibration_relative_sd": -1.0},
    ],
)
def test_options_are_judged(options: dict) -> None:
    with pytest.raises(InputError):
        SpectralOdometry(**options)


def test_the_intercept_is_that_of_the_first_rest_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of 4 samples at 100 Hz; frames of 4 blocks end with a block each: all four have to be quiet."""
    quiet = np.array([False] * 2 + [True] * 8 + [False] * 5 + [True] * 9)
    monkeypatch.setattr("simrail.estimators.odometry.spectral.quiet_of", lambda recording, block: quiet)
    recording = SimpleNamespace(imu_sheet=SimpleNamespace(rate_hz=100.0))
    ends = 4 * np.arange(4, 25) - 1
    root = np.arange(21.0)
    root[3] = np.nan  # a gap
    method = SpectralOdometry(1.0, frame=16, hop=4)
    found = method._root_at_rest(recording, Frames(ends, root))  # type: ignore[arg-type]
    # Frames that end with blocks 6 to 10 lie in the first rest: numbers 2 to 6, but for the gap. The frame at
    # the gap ends what counts.
    assert np.isnan(found[:2]).all()
    np.testing.assert_array_equal(found[2:], 2.0)


def test_the_mean_over_a_rest_grows_with_its_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = np.array([False] * 2 + [True] * 8 + [False] * 5 + [True] * 9)
    monkeypatch.setattr("simrail.estimators.odometry.spectral.quiet_of", lambda recording, block: quiet)
    recording = SimpleNamespace(imu_sheet=SimpleNamespace(rate_hz=100.0))
    frames = Frames(4 * np.arange(4, 25) - 1, np.arange(21.0))
    found = SpectralOdometry(1.0, frame=16, hop=4)._root_at_rest(recording, frames)  # type: ignore[arg-type]
    assert np.isnan(found[:2]).all()
    np.testing.assert_array_equal(found[2:8], [2.0, 2.5, 3.0, 3.5, 4.0, 4.0])
    np.testing.assert_array_equal(found[8:], 4.0)  # not of the second rest
