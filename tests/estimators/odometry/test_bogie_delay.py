"""Odometry by two bogies: the delay is found, clock and distance are told from speed, misuse is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.bogie_delay import SURE, BogieDelayOdometry, _judge_spacing
from simrail.estimators.odometry.bogie_delay_kernel import is_borne_out, room_to_hear, search_delay
from simrail.estimators.odometry.zero_velocity import ZeroVelocityOdometry
from simrail.estimators.odometry.zero_velocity_kernel import OFFSET, SCALE, SPACING, V
from two_bogies import FRAME_LAG_S, SPACING_M, THERE_AND_BACK, recorded, ridden

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.conformance import check_odometry
from simrail.estimation.estimate import registered
from simrail.recording.recording import Recording, beginning
from simrail.ride.truth import Mount
from simrail.vehicle.speed_profile import SpeedProfile


def compared(recording: Recording, profile: SpeedProfile = THERE_AND_BACK, **options: object) -> pd.DataFrame:
    states = BogieDelayOdometry(**options).estimate(recording).states  # type: ignore[arg-type]
    motion = ridden(profile).motion(Mount("front", "body", (0.0, 0.0, 1.1))).loc[states.index]
    return states.assign(true_mps=motion["speed_mps"], true_m=motion["position_m"])


@pytest.mark.long
def test_it_is_registered() -> None:
    assert registered()["BogieDelayOdometry"].load() is BogieDelayOdometry


@pytest.mark.long
def test_speed_there_and_back_and_a_planted_clock_offset() -> None:
    """.06 m/s causal with a clock 31 ms ahead, twice as good as without the second IMU.

    What is not known of the clock is V^2/L in the speed: 4 ms at 16 m/s are .07 m/s, .4 % of the way; so much
    is left of it in the first section, a third of that after four.
    """
    recording = recorded(0.031)
    alone = ZeroVelocityOdometry().estimate(recording).states["speed_mps"]
    for smoothed, most, share in ((False, 0.06, 0.004), (True, 0.03, 0.002)):
        found = compared(recording, smoothed=smoothed)
        off = found["speed_mps"] - found["true_mps"]
        runs = found["true_mps"].abs() > 1e-3
        assert np.sqrt((off**2).mean()) < most
        assert (off.abs() < 1.96 * found["speed_sd_mps"])[runs].mean() > 0.85
        way = found["speed_mps"].abs().sum() / found["true_mps"].abs().sum()
        assert way == pytest.approx(1.0, abs=share)
        assert np.sqrt((off**2).mean()) < 0.5 * np.sqrt(((alone - found["true_mps"]) ** 2).mean())
        trace = BogieDelayOdometry(smoothed=smoothed).trace(recording)
        assert trace.heard is not None
        taken = trace.heard.searches[:, 0]
        assert (taken == 1.0).sum() > 0.7 * (taken >= 0.0).sum() > 100
        assert trace.found.states[-1, OFFSET] == pytest.approx(0.031, abs=0.004)


@pytest.mark.long
def test_a_clock_that_is_far_off_is_searched_as_such_while_the_train_sets_off() -> None:
    """47 ms: no one addition to the speed has both ends of a window right at .9 m/s2, an offset has.

    On a line of `imu_only` the true wave was lost so, another was taken for it, and the way was 2 % off.
    """
    recording, method = recorded(-0.047), BogieDelayOdometry()
    assert recording.second_imu_sheet is not None
    echo = method._echo(recording, recording.second_imu_sheet)
    speed = ridden().motion(Mount("front", "body", (0.0, 0.0, 1.1))).loc[echo.end_s, "speed_mps"].to_numpy()
    heard, acceleration = room_to_hear(len(speed)), np.diff(speed, prepend=0.0) / 0.1
    k = int(np.argmax(speed > 9.5))
    found = {}
    for by_clock in (False, True):
        c, _ = search_delay(echo, heard, k, speed[k], 0.3, 0.0, SPACING_M, acceleration, 0.1, by_clock)
        found[by_clock] = c, heard.searches[k, 2]
    assert -found[True][0] * SPACING_M / speed[k] ** 2 == pytest.approx(-0.047, abs=1e-3)
    assert found[True][1] > 0.9 > found[False][1]
    trace = method.trace(recording)
    assert trace.heard is not None
    searches = trace.heard.searches
    first = int(np.argmax(searches[:, 0] == 1.0))
    assert trace.time_s[first] < 30.0 and (searches[:first, 3] > 0.0).any()
    assert trace.found.states[first, OFFSET] == pytest.approx(-0.047, abs=0.01)


@pytest.mark.long
def test_a_frame_follows_what_its_wheels_run_over() -> None:
    """Told 6 ms less than the 12 ms by which it does, a search is off by 6 ms times the acceleration."""
    recording = recorded()
    assert recording.second_imu_sheet is not None
    found = {}
    for lag_s in (FRAME_LAG_S, FRAME_LAG_S - 0.006):
        method = BogieDelayOdometry(frame_lag_s=lag_s)
        echo = method._echo(recording, recording.second_imu_sheet)
        mount = Mount("front", "body", (0.0, 0.0, 1.1))
        speed = ridden().motion(mount).loc[echo.end_s, "speed_mps"].to_numpy()
        heard, acceleration = room_to_hear(len(speed)), np.diff(speed, prepend=0.0) / 0.1
        ks = np.flatnonzero((speed > 10.0) & (acceleration > 0.85))[::4]
        cs = [search_delay(echo, heard, k, speed[k], 0.1, 0.0, SPACING_M, acceleration, 0.1)[0] for k in ks]
        found[lag_s] = float(np.mean(cs))
    right, wrong = found.values()
    assert abs(right) < 0.002
    assert wrong - right == pytest.approx(-0.006 * 0.9, rel=0.2)


@pytest.mark.long
def test_one_delay_alone_is_not_believed() -> None:
    """Before the clocks' offset is known: another search, in other samples, must tell the same."""
    recording = recorded()
    assert recording.second_imu_sheet is not None
    echo, heard = BogieDelayOdometry()._echo(recording, recording.second_imu_sheet), room_to_hear(300)
    k = 200

    def searched(before: int, offset: float) -> None:
        heard.searches[k - before, 3:] = 0.02, offset, 2e-3

    searched(0, 0.010)
    assert not is_borne_out(echo, heard, k, 0.1)
    searched(19, 0.010)  # shares samples with it
    assert not is_borne_out(echo, heard, k, 0.1)
    searched(25, 0.020)
    assert not is_borne_out(echo, heard, k, 0.1)
    searched(30, 0.012)
    assert is_borne_out(echo, heard, k, 0.1)
    searched(35, 0.030)
    assert not is_borne_out(echo, heard, k, 0.1)  # more tell another


@pytest.mark.long
def test_a_second_imu_ahead_of_the_first_says_the_same() -> None:
    """Their parts changed: what was behind is ahead, its clock behind."""
    one = recorded(0.02)
    assert one.second_imu is not None and one.second_imu_sheet is not None
    turned = replace(
        one,
        imu=one.second_imu.set_index(one.imu.index),
        second_imu=one.imu.set_index(one.second_imu.index - 0.04),
        second_imu_sheet=replace(one.second_imu_sheet, spacing_m=-SPACING_M),
    )
    found = compared(turned)
    # Of the second IMU in the first one's place all but the vertical force is the same.
    off = found["speed_mps"] - found["true_mps"]
    assert np.sqrt((off**2).mean()) < 0.06
    trace = BogieDelayOdometry().trace(turned)
    assert trace.found.states[-1, OFFSET] == pytest.approx(-0.02, abs=0.006)


@pytest.mark.long
def test_a_wrong_spacing_is_refused_with_the_right_one() -> None:
    """1 and 3 % more than it is, told with an sd of 1 cm; with 1 m it is found, and speed is right."""
    for share in (0.01, 0.03):
        with pytest.raises(InputError, match="are not so far apart as told") as caught:
            compared(recorded(told_m=(1.0 + share) * SPACING_M))
        shown = re.search(r"limit: ([0-9.]+) m to ([0-9.]+) m", str(caught.value))
        assert shown is not None
        assert float(shown[1]) == pytest.approx(SPACING_M, abs=2.0 * float(shown[2]) + 0.02)
        assert float(shown[2]) < 0.1
    wrong = recorded(told_m=1.03 * SPACING_M)
    assert wrong.second_imu_sheet is not None
    unsure = replace(wrong, second_imu_sheet=replace(wrong.second_imu_sheet, spacing_sd_m=1.0))
    found = compared(unsure, smoothed=True)
    fast = found["true_mps"].abs() > 15.0
    share = (found["speed_mps"] / found["true_mps"])[fast].median() - 1.0
    assert abs(share) < 0.004
    trace = BogieDelayOdometry(smoothed=True).trace(unsure)
    assert trace.found.states[-1, SPACING] == pytest.approx(-0.03 * SPACING_M, abs=0.06)


@pytest.mark.long
def test_the_row_is_the_derivative_of_the_search() -> None:
    """c changes by V^2/L per second of the clock, V/L per metre of the distance, an age by push."""
    recording, method = recorded(), BogieDelayOdometry()
    assert recording.second_imu_sheet is not None
    echo = method._echo(recording, recording.second_imu_sheet)
    motion = ridden().motion(Mount("front", "body", (0.0, 0.0, 1.1))).loc[echo.end_s]
    speed, heard = motion["speed_mps"].to_numpy(), room_to_hear(len(motion))
    acceleration = np.diff(speed, prepend=0.0) / 0.1

    def search(k: int, *, offset: float = 0.0, longer: float = 0.0, push: float = 0.0) -> float:
        c, variance = search_delay(
            echo, heard, k, speed[k], 0.1, offset, SPACING_M + longer, acceleration + push, 0.1
        )
        assert variance > 0.0
        return c

    for k in (int(np.argmax(speed)) + 40, int(np.argmin(speed)) + 40):
        way = np.sign(speed[k])
        assert abs(search(k)) < 0.02
        age = echo.lag_s + 0.5 * (echo.window_s + SPACING_M / abs(speed[k]))
        v = abs(speed[k - round(10.0 * age)])
        by_offset = (search(k, offset=2e-3) - search(k, offset=-2e-3)) / 4e-3
        assert by_offset == pytest.approx(way * v * v / SPACING_M, rel=0.1)
        by_length = (search(k, longer=0.05) - search(k, longer=-0.05)) / 0.1
        assert by_length == pytest.approx(v / SPACING_M, rel=0.1)
        by_push = way * (search(k, push=0.02) - search(k, push=-0.02)) / 0.04
        assert by_push == pytest.approx(age, rel=0.1)


@pytest.mark.long
def test_it_passes_the_battery() -> None:
    """Nothing later enters, by either clock; backwards, at rest and without what it does not need."""
    short = SpeedProfile(
        30.0, 150.0, 12.0, acceleration_mps2=1.2, jerk_mps3=1.0, rest_s=4.0, final_rest_s=3.0
    )
    recording = recorded(-0.013, profile=short)
    trace = BogieDelayOdometry().trace(recording)
    assert trace.heard is not None and (trace.heard.searches[:, 0] == 1.0).sum() > 3
    for smoothed in (False, True):
        check_odometry(BogieDelayOdometry(smoothed=smoothed), recording)
    ahead = recorded(0.7, profile=short)
    whole = BogieDelayOdometry().estimate(ahead).states
    part = BogieDelayOdometry().estimate(beginning(ahead, samples=3000)).states
    pd.testing.assert_frame_equal(whole.iloc[:3000], part, check_exact=True)


@pytest.mark.long
def test_without_a_second_imu_it_is_refused() -> None:
    recording = recorded()
    with pytest.raises(InputError, match="no second IMU"):
        BogieDelayOdometry().estimate(replace(recording, second_imu=None, second_imu_sheet=None))


@pytest.mark.long
def test_other_rates_nearness_and_slow_recording_are_refused() -> None:
    recording = recorded()
    sheet = recording.second_imu_sheet
    assert sheet is not None
    other = replace(sheet, imu=replace(sheet.imu, rate_hz=200.0))
    with pytest.raises(InputError, match="another rate than the first IMU") as caught:
        BogieDelayOdometry().estimate(replace(recording, second_imu_sheet=other))
    assert "200 Hz" in str(caught.value) and "\n" not in str(caught.value)
    with pytest.raises(InputError, match="too near to the first IMU"):
        near = replace(recording, second_imu_sheet=replace(sheet, spacing_m=-4.9))
        BogieDelayOdometry().estimate(near)
    slow = replace(
        recording,
        imu=recording.imu.iloc[::10],
        imu_sheet=replace(recording.imu_sheet, rate_hz=25.0),
        second_imu_sheet=replace(sheet, imu=replace(sheet.imu, rate_hz=25.0)),
    )
    with pytest.raises(InputError, match="too low a rate"):
        BogieDelayOdometry().estimate(slow)
    for options in ({"window_s": 0.0}, {"least_correlation": 1.0}, {"band_hz": (60.0, 10.0)}):
        with pytest.raises(InputError, match=next(iter(options))):
            BogieDelayOdometry(**options)  # type: ignore[arg-type]


@pytest.mark.long
def test_the_scale_of_the_accelerometer_is_found() -> None:
    """1 % too little: no stop tells it, and without its state clock and distance would take it for theirs.

    It is the whole bound of its sheet, 1.7 standard deviations: the first section lies at the edge of 95 %.
    """
    recording = recorded()
    force = recording.imu[ACCEL[0]]
    sheet = replace(recording.imu_sheet, accel_scale_error=0.01)
    less = replace(recording, imu=recording.imu.assign(**{ACCEL[0]: force / 1.01}), imu_sheet=sheet)
    trace = BogieDelayOdometry(smoothed=True).trace(less)
    assert trace.found.states[-1, SCALE] == pytest.approx(0.01, abs=0.004)
    found = compared(less)
    off = (found["speed_mps"] - found["true_mps"]).abs()
    assert np.sqrt((off**2).mean()) < 0.08
    assert (off < 1.96 * found["speed_sd_mps"])[found["true_mps"].abs() > 1e-3].mean() > 0.75


@pytest.mark.long
def test_rails_that_two_bogies_do_not_feel_alike_do_no_harm() -> None:
    """Without an echo it is the zero-velocity odometry, but for chance."""
    recording = recorded()
    assert recording.second_imu is not None
    other = recording.second_imu.copy()
    other[ACCEL[2]] = 9.81 + 0.3 * stream(3, "other").standard_normal(len(other))
    trace = BogieDelayOdometry().trace(replace(recording, second_imu=other))
    alone = ZeroVelocityOdometry().trace(recording)
    assert trace.heard is not None and (trace.heard.searches[:, 0] == 1.0).sum() == 0
    np.testing.assert_allclose(trace.found.states[:, V], alone.found.states[:, V], atol=1e-9)


def learnt(metres: float, before_sd: float, after_sd: float) -> SimpleNamespace:
    """A trace whose filter found the spacing so much longer than told, and how sure it is of it."""
    states, last = np.zeros((3, SPACING + 1)), np.zeros((SPACING + 1, SPACING + 1))
    states[-1, SPACING], last[SPACING, SPACING] = metres, after_sd**2
    return SimpleNamespace(found=SimpleNamespace(states=states), last=last)


def test_the_spacing_that_is_told_is_that_of_the_ride_alone() -> None:
    """Told with 0.1 m and learnt to 0.06 m: the ride alone knows it to 0.06 / 0.8, and moves by 1 / 0.64."""
    sheet = SimpleNamespace(spacing_m=20.0, spacing_sd_m=0.1)
    with pytest.raises(InputError) as caught:
        _judge_spacing(learnt(0.64, 0.1, 0.06), sheet)  # type: ignore[arg-type]
    assert caught.value.limit == "21 m to 0.15 m" and caught.value.value == 20.0
    # What it learns has a standard deviation of 0.08 m before: SURE of them are no contradiction.
    _judge_spacing(learnt(0.99 * SURE * 0.08, 0.1, 0.06), sheet)  # type: ignore[arg-type]
    with pytest.raises(InputError):
        _judge_spacing(learnt(-1.01 * SURE * 0.08, 0.1, 0.06), sheet)  # type: ignore[arg-type]
    _judge_spacing(learnt(9.0, 0.1, 0.1), sheet)  # type: ignore[arg-type]
