"""Bounds and faults of the track-relative filter: they hold on a sound ride, and a wrong sheet is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.line_table import PLACES_PER_M
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.monitor import (
    ALLOWED,
    BOUND_SDS,
    MOST_BENT,
    MOST_SUM,
    PATIENCE,
    WINDOW_S,
    contradiction,
    faults_and_widening,
    in_curves,
)
from simrail.estimators.track_relative.noise import AT_MPS
from simrail.estimators.track_relative.output import with_bounds
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.core.columns import ACCEL, BOUND, FAULT, GYRO
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.vehicle_sheet import SheetBody, VehicleSheet
from simrail.track.design import STRAIGHT, Curve, Straight
from simrail.track.file import track_by_name

DRAWN = VehicleSheet((SheetBody("body"),))


def found(recording: Recording) -> pd.DataFrame:
    recording = replace(recording, vehicle_sheet=DRAWN)
    return TrackRelativeSmoother(smoothed=False, geometry_step_m=0.0).estimate(recording).states


def with_wheel(recording: Recording, scale: float) -> Recording:
    assert recording.encoder is not None
    counts = np.round(recording.encoder["pulse_count"] * scale)
    return replace(recording, encoder=recording.encoder.assign(pulse_count=counts))


def with_bias(recording: Recording, column: str, bias: float) -> Recording:
    imu = recording.imu.copy()
    imu.loc[imu.index > 15.0, column] += bias
    return replace(recording, imu=imu)


def yawed(recording: Recording, degrees: float) -> Recording:
    turn, imu = np.deg2rad(degrees), recording.imu.copy()
    for x, y, _ in (GYRO, ACCEL):
        imu[x] = np.cos(turn) * recording.imu[x] + np.sin(turn) * recording.imu[y]
        imu[y] = np.cos(turn) * recording.imu[y] - np.sin(turn) * recording.imu[x]
    return replace(recording, imu=imu)


def upside_down(recording: Recording) -> Recording:
    imu = recording.imu.copy()
    for _, *across in (GYRO, ACCEL):
        imu[across] = -recording.imu[across]
    return replace(recording, imu=imu)


FAULTS = {
    "a wheel wrong by 5 %": lambda r: with_wheel(r, 1.05),
    "a gyro's bias that leaves its sheet": lambda r: with_bias(r, GYRO[2], 0.02),
    "an accelerometer's bias that leaves its sheet": lambda r: with_bias(r, ACCEL[1], 0.2),
    "an IMU yawed by 3 degrees": lambda r: yawed(r, 3.0),
    "a start that is 20 m off": lambda r: replace(r, start_position_m=r.start_position_m + 20.0),
}

WRONG_USE = {
    "an IMU upside down": lambda r: upside_down(r),
    "another line's map": lambda r: replace(r, track=track_by_name("metro_line")),
}
"""It is told before the train has run ten metres, or at its first curve."""


@pytest.mark.parametrize("direction", [1, -1])
def test_a_sound_ride_has_no_fault_and_keeps_its_bounds(
    rough: Callable, rough_motion: Callable, direction: int
) -> None:
    states = found(rough(0, direction))
    motion = rough_motion(0, direction).loc[states.index]
    assert not states[FAULT].any()
    for bound, name in zip(BOUND, ("roll_rad", "position_m"), strict=True):
        assert ((states[name] - motion[name]).abs() <= states[bound]).mean() > 0.9985
    moves = motion["speed_mps"].abs() > 0.5
    assert states["position_bound_m"][moves].median() < 3.0


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_sheet_is_a_fault(rough: Callable, fault: str) -> None:
    states = found(FAULTS[fault](rough()))
    assert states[FAULT].iloc[-1] == 1.0
    assert (np.diff(states[FAULT]) >= 0.0).all()
    assert not states[FAULT].iloc[:100].any()


@pytest.mark.parametrize("use", WRONG_USE)
def test_wrong_use_is_a_fault_and_no_calm_answer(rough: Callable, use: str) -> None:
    recording = WRONG_USE[use](rough())
    states = found(recording)
    way = states["position_m"] - recording.start_position_m
    assert states[FAULT][way.abs() > 200.0].all()


def test_a_map_worse_than_its_sheet_shows_in_its_curves(rough: Callable) -> None:
    """By the mean of squares over curves and transitions: planted sums, beside those without surprise.

    Rails that err as their sheet says leave it far below 1, a sheet 100 times too good raises it.
    """
    trace = TrackRelativeSmoother(smoothed=False).trace(rough())
    track, place = trace.course.recording.track, trace.course.around.states[:, at.S]
    states = np.tile(trace.course.start, (len(place), 1))
    none = trace._replace(states=states, surprises=0.0 * trace.surprises)
    planted = none.surprises.copy()
    planted[track.kind(np.clip(place, track.start_m, track.end_m)) != STRAIGHT, 2] = 0.3
    found = contradiction(none._replace(surprises=planted))
    speed = np.abs(trace.course.around.states[:, at.V])
    number = track.segment(np.clip(place, track.start_m, track.end_m))
    squares = [
        0.3**2 * (number == i).sum() * speed[number == i].mean() / AT_MPS
        for i, element in enumerate(track.elements)
        if element.kind != STRAIGHT
    ]
    wanted = sum(squares) / (len(squares) + PATIENCE) / MOST_BENT
    # At its end no window of some seconds holds a curve any more.
    assert found[-1] == pytest.approx(wanted, rel=0.02)
    honest, better = (contradiction_of_map(rough(), share) for share in (1.0, 0.01))
    assert honest < 0.7 and better > 2.0 * honest


def contradiction_of_map(recording: Recording, share: float) -> float:
    """By curves alone, of a map that claims a share of its errors."""
    sizes = {name: size for name, size in asdict(recording.map_errors).items() if "length" not in name}
    claimed = {name: share * size for name, size in sizes.items()}
    spoiled = replace(recording, map_errors=replace(recording.map_errors, **claimed), vehicle_sheet=DRAWN)
    return float(in_curves(TrackRelativeSmoother(smoothed=False).trace(spoiled)).max())


def test_what_is_later_does_not_enter(rough: Callable) -> None:
    recording = with_wheel(rough(), 1.05)
    whole = found(recording)
    part = found(beginning(recording, samples=6000))
    names = [*BOUND, FAULT]
    np.testing.assert_array_equal(part[names], whole[names].iloc[:6000])


def test_contradiction_is_the_largest_of_states_and_sums(rough: Callable) -> None:
    """A planted sum of innovations, and a planted state, count as their limits say."""
    trace = TrackRelativeSmoother(smoothed=False).trace(beginning(rough(), samples=3500))
    quiet = trace._replace(
        states=np.tile(trace.course.start, (len(trace.states), 1)), surprises=0.0 * trace.surprises
    )
    assert not contradiction(quiet).any()
    biased = quiet.surprises.copy()
    biased[:, 2] = 0.5
    steps = round(WINDOW_S / trace.course.steps.dt)
    wanted = 0.5 * np.sqrt(steps) / MOST_SUM[2]
    assert contradiction(quiet._replace(surprises=biased))[-1] == pytest.approx(wanted)
    faults, widening = faults_and_widening(quiet._replace(surprises=4.0 * biased))
    assert faults[-1] == 1.0
    assert widening[-1] == pytest.approx(ALLOWED * BOUND_SDS * 4.0 * wanted)
    assert widening[0] == pytest.approx(ALLOWED * BOUND_SDS)


def test_a_curve_is_judged_by_where_the_train_runs_through_it() -> None:
    """Two seconds at half a metre a second, which say nothing, then two at five."""
    places = np.arange(100 * PLACES_PER_M + 1) / PLACES_PER_M
    element = np.searchsorted([40.0, 60.0], places, side="right").astype(np.float64)
    lines = SimpleNamespace(places=places, element=element, curve=0.0 * places, vertical=0.0 * places)
    elements = (Straight(40.0), Curve(20.0, 300.0), Straight(40.0))
    states, surprises = np.zeros((80, at.STATES)), np.zeros((80, 6))
    states[:, at.S] = np.repeat([10.0, 45.0, 55.0, 80.0], 20)
    states[:, at.V] = np.repeat([5.0, 0.5, 5.0, 5.0], 20)
    surprises[:, 2] = np.repeat([3.0, 7.0, 1.0, 3.0], 20)
    course = SimpleNamespace(
        steps=SimpleNamespace(dt=0.1),
        around=SimpleNamespace(states=states),
        lines=lines,
        recording=SimpleNamespace(track=SimpleNamespace(elements=elements)),
    )
    bent = in_curves(SimpleNamespace(course=course, surprises=surprises))  # type: ignore[arg-type]
    assert not bent[:60].any()
    np.testing.assert_allclose(bent[60:], 20.0**2 / 20.0 * 5.0 / AT_MPS / (1 + PATIENCE), rtol=1e-12)


def test_bounds_of_a_sample_are_those_of_the_last_step_that_is_over() -> None:
    """Row 0 is of before the first step; nothing is a step late."""
    time = np.array([0.00, 0.01, 0.02, 0.03, 0.04, 0.05])
    steps = SimpleNamespace(end_s=np.array([0.01, 0.03, 0.05]))
    trace = SimpleNamespace(course=SimpleNamespace(steps=steps))
    states = pd.DataFrame({"roll_sd_rad": 2.0, "position_sd_m": 3.0}, index=pd.Index(time, name="time_s"))
    widened = with_bounds(states, trace, np.array([0.0, 0.0, 1.0, 1.0]), np.array([1.0, 2.0, 4.0, 8.0]))  # type: ignore[arg-type]
    assert widened[BOUND[0]].tolist() == [2.0, 4.0, 4.0, 8.0, 8.0, 16.0]
    assert widened[BOUND[1]].tolist() == [3.0, 6.0, 6.0, 12.0, 12.0, 24.0]
    assert widened[FAULT].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]
