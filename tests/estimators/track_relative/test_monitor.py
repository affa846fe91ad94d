"""Bounds and faults of the track-relative filter: they hold on a sound ride, and a wrong sheet is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.track_relative.monitor import (
    ALLOWED,
    BOUND_SDS,
    WINDOW_S,
    contradiction,
    faults_and_widening,
)
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.core.columns import ACCEL, BOUND, FAULT, GYRO
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.vehicle_sheet import SheetBody, VehicleSheet

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


FAULTS = {
    "a wheel wrong by 5 %": lambda r: with_wheel(r, 1.05),
    "a gyro's bias that leaves its sheet": lambda r: with_bias(r, GYRO[2], 0.02),
    "an accelerometer's bias that leaves its sheet": lambda r: with_bias(r, ACCEL[1], 0.2),
    "an IMU yawed by 3 degrees": lambda r: yawed(r, 3.0),
    "a start that is 20 m off": lambda r: replace(r, start_position_m=r.start_position_m + 20.0),
}


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
    wanted = 0.5 * np.sqrt(steps) / 7.0
    assert contradiction(quiet._replace(surprises=biased))[-1] == pytest.approx(wanted)
    faults, widening = faults_and_widening(quiet._replace(surprises=4.0 * biased))
    assert faults[-1] == 1.0
    assert widening[-1] == pytest.approx(ALLOWED * BOUND_SDS * 4.0 * wanted)
    assert widening[0] == pytest.approx(ALLOWED * BOUND_SDS)
