"""The speed by two bogies in the track-relative smoother: its rows, and what they do to a ride."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.odometry.bogie_delay import BogieDelayOdometry
from simrail.estimators.odometry.zero_velocity_kernel import PITCH, V
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import DELAY_S, SecondImuSpeed
from simrail.estimators.track_relative.measurement import duals
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother
from two_bogies import THERE_AND_BACK, recorded, ridden

from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.recording.recording import Recording, beginning
from simrail.ride.truth import Mount
from simrail.track.map_errors import MapErrors, draw_map
from simrail.vehicle.speed_profile import SpeedProfile

ERRORS = MapErrors(cant_sd_m=0.004, cant_along_sd_m=5e-4, radius_relative_sd=0.01, place_sd_m=0.5)
NOWHERE: Any = None
"""The body in its track, of which these say nothing."""

AT = Mount("front", "body", (0.0, 0.0, 1.1))


def on_a_map(draw: int = 0, profile: SpeedProfile = THERE_AND_BACK) -> Recording:
    """No wheel, two IMUs whose clocks are 10 ms apart, and a map that errs as told."""
    recording = recorded(0.01, draw=draw, profile=profile)
    track = draw_map(recording.track, ERRORS, seed=3, draw=draw)
    return replace(recording, track=track, map_errors=ERRORS)


def errors(recording: Recording, *, second_imu: bool, smoothed: bool = False) -> pd.DataFrame:
    method = TrackRelativeSmoother(smoothed=smoothed, second_imu=second_imu, geometry_step_m=0.0)
    found, motion = method.estimate(recording).states, ridden().motion(AT)
    columns = {}
    for name in ("position", "speed"):
        value = next(column for column in (f"{name}_m", f"{name}_mps") if column in found)
        columns[name] = found[value] - motion[value].loc[found.index]
        columns[f"{name}_sd"] = found[value.replace(name, f"{name}_sd")]
    return pd.DataFrame(columns)


def test_a_row_is_of_a_delay_that_was_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 10 Hz, by hand: one delay refused, one believed up a gradient, one after the last step; none else.

    Its variance is as many times that of the odometry as searches come in two `DELAY_S`.
    """
    states, covariances, searches = np.zeros((5, 10)), np.zeros((5, 4, 4)), np.full((5, 6), -1.0)
    states[:, V], states[:, PITCH] = 20.0, 0.1
    covariances[:, V, V] = 0.04**2
    searches[1, 0], searches[2, 0], searches[4, 0] = 0.0, 1.0, 1.0
    found = SimpleNamespace(states=states, covariances=covariances)
    trace = SimpleNamespace(
        time_s=0.1 * np.arange(1.0, 6.0), found=found, heard=SimpleNamespace(searches=searches)
    )
    monkeypatch.setattr(BogieDelayOdometry, "trace", lambda *_: trace)
    ends = 0.01 + 0.04 * np.arange(1.0, 10.0)
    steps = SimpleNamespace(end_s=ends, time_s=ends - 0.02, odometry=np.tile([0.0, 20.0, 0.5, 1.0], (9, 1)))
    recording = SimpleNamespace(second_imu=1, second_imu_sheet=1)
    rows = SecondImuSpeed().rows(recording, steps)  # type: ignore[arg-type]
    (made,) = np.nonzero(np.isfinite(rows.variances[:, 0]))
    assert made.tolist() == [7]  # of the delay at 0.3 s, by the step that ends at 0.33 s
    assert rows.values[7, 0] == pytest.approx(20.0 * np.cos(0.1) + 0.5 * (0.31 - 0.3))
    assert rows.variances[7, 0] == pytest.approx(0.04**2 * 2.0 * DELAY_S / 0.5)
    drawn = stream(3, "states").standard_normal((4, at.STATES))
    (shown,) = SecondImuSpeed().shown(duals(drawn), NOWHERE)
    np.testing.assert_array_equal(shown.value, drawn[:, at.V])
    assert set(shown.slopes) == {at.V}


def test_it_is_asked_for_and_refused_without_one(rough: Callable) -> None:
    method = TrackRelativeSmoother(second_imu=True, gnss=True)
    assert method.needs == ("gnss", "second_imu")
    with pytest.raises(InputError, match="no second IMU") as caught:
        TrackRelativeSmoother(second_imu=True, smoothed=False).estimate(rough())
    assert caught.value.field == "second_imu" and "second_imu = false" in str(caught.value)


@pytest.mark.long
def test_without_a_wheel_place_and_speed_are_better_and_as_sure_as_told() -> None:
    """Four minutes of three devices and maps, causal and smoothed."""
    for smoothed, share in ((False, 0.8), (True, 1.0)):
        both = {
            second: pd.concat(
                errors(on_a_map(draw), second_imu=second, smoothed=smoothed) for draw in range(3)
            )
            for second in (False, True)
        }
        for name in ("position", "speed"):
            rms = {second: float(np.sqrt((found[name] ** 2).mean())) for second, found in both.items()}
            assert rms[True] < share * rms[False]
            sd = both[True][f"{name}_sd"]
            assert (both[True][name].abs() < 1.96 * sd).mean() > 0.85
            assert sd.mean() < both[False][f"{name}_sd"].mean()


@pytest.mark.long
def test_nothing_later_enters_and_unasked_it_changes_nothing() -> None:
    short = SpeedProfile(30.0, 200.0, 12.0, acceleration_mps2=1.2, jerk_mps3=1.0, rest_s=4.0)
    recording = on_a_map(profile=short)
    causal = TrackRelativeSmoother(smoothed=False, second_imu=True, geometry_step_m=0.0)
    steps = causal.course(recording)
    assert np.isfinite(steps.aided.variances[:, -1]).sum() > 5
    whole = causal.estimate(recording).states
    part = causal.estimate(beginning(recording, samples=4003)).states
    pd.testing.assert_frame_equal(whole.iloc[:4003], part, check_exact=True)
    without = replace(recording, second_imu=None, second_imu_sheet=None)
    unasked = replace(causal, second_imu=False)
    heard, unheard = (unasked.estimate(one).states for one in (recording, without))
    pd.testing.assert_frame_equal(heard, unheard, check_exact=True)
    assert not whole["speed_mps"].equals(heard["speed_mps"])
