"""A body's roll and place by a sensor of the rails, in the track-relative smoother."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.track_relative import aiding
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import SeenRails
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import duals, pose_of
from simrail.estimators.track_relative.noise import AXLE, WAGON
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother

from simrail.core.columns import RAIL_DISPLACEMENT
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.recording.recording import RailSensorSheet, Recording, beginning


def seeing(
    recording: Recording, *, roll: float = 0.0, aside: float = 0.0, above: float = 0.0, after: float = 0.0
) -> Recording:
    """Straight rails by u = A'(r - p), from a body that from a time on is turned and moved beside nominal."""
    time, base = recording.imu.index.to_numpy(), recording.track.rail_base_m
    _, across, height = recording.mount_position_m
    later = time >= after
    c, s = np.cos(roll * later), np.sin(roll * later)
    columns = []
    for side in (0.5, -0.5):
        y, z = side * base - across - aside * later, -height - above * later
        columns += [c * y + s * z, c * z - s * y]
    frame = pd.DataFrame(np.column_stack(columns), index=recording.imu.index, columns=list(RAIL_DISPLACEMENT))
    return replace(recording, rail_displacement=frame, rail_sensor_sheet=RailSensorSheet(1e-4))


def test_the_rows_are_the_body_by_straight_rails_and_their_variances_by_hand(
    rough: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exact for a turn that is not small, one sample in eight half a metre off; by way, none at rest."""
    recording = seeing(rough(), roll=0.2, aside=0.03, above=-0.02)
    assert recording.rail_displacement is not None
    recording.rail_displacement.iloc[::8, 1:3] += 0.5
    n = 40
    steps = SimpleNamespace(
        time_s=np.zeros(n),
        dt=0.032,
        odometry=np.tile([0.0, -15.0, 0.0, 1.0], (n, 1)),
        resting=np.arange(n) < 3,
    )
    steps.odometry[5, 1] = 0.0
    rows = SeenRails().rows(recording, steps)  # type: ignore[arg-type]
    _, across, height = recording.mount_position_m
    np.testing.assert_allclose(rows.values, np.tile([0.2, across + 0.03, height - 0.02], (n, 1)), rtol=1e-9)
    assert np.isinf(rows.variances[[0, 1, 2, 5]]).all()
    way, base = 15.0 * 0.032, recording.track.rail_base_m
    wanted = [  # twice the area under the correlation, over the way, and the sensor's own
        2.0 * sd**2 * area / way + own * 1e-8 / 8.0
        for sd, area, own in (
            (WAGON.roll_sd, 4.0 * WAGON.roll_length / math.sqrt(3.0), 2.0 / base**2),
            (WAGON.y_sd, 16.0 * WAGON.y_length / (3.0 * math.sqrt(5.0)), 0.5),
            (WAGON.z_sd, 16.0 * WAGON.z_length / (3.0 * math.sqrt(5.0)), 0.5),
        )
    ]
    np.testing.assert_allclose(rows.variances[4], wanted)
    # What stands on the rails is told nothing by them.
    monkeypatch.setattr(aiding, "class_of", lambda _: AXLE)
    assert np.isinf(SeenRails().rows(recording, steps).variances).all()  # type: ignore[arg-type]


def test_the_area_under_the_correlations() -> None:
    """Of Matern processes, by numbers: what slow motion sees of them as white noise."""
    s = np.linspace(-100.0, 100.0, 200001)
    three, five = math.sqrt(3.0) * np.abs(s) / 5.0, math.sqrt(5.0) * np.abs(s) / 5.0
    assert np.trapezoid((1.0 + three) * np.exp(-three), s) == pytest.approx(4.0 * 5.0 / math.sqrt(3.0))
    area = np.trapezoid((1.0 + five + five**2 / 3.0) * np.exp(-five), s)
    assert area == pytest.approx(16.0 * 5.0 / (3.0 * math.sqrt(5.0)))


def test_what_it_shows_follows_the_states(rough: Callable) -> None:
    """Roll beside the track as it lies, without the map's cant; Jacobian by differences."""
    course = TrackRelativeSmoother(rail_sensor=True).course(seeing(rough()))
    rows = slice(400, 404)
    around = course.around._replace(
        states=course.around.states[rows], jerk=course.around.jerk[rows], sense=course.around.sense[rows]
    )
    ground = ground_at(course.recording, course.lines, around.states[:, at.S])
    states = around.states + 1e-2 * stream(3, "states").standard_normal((4, at.STATES))

    def shown(values: np.ndarray) -> list:
        x = duals(values)
        return SeenRails().shown(x, pose_of(x, ground, around))

    plain = shown(states)
    for state, parts in ((at.ROLL, (1.0, 0.0, 0.0)), (at.Y, (0.0, 1.0, 0.0)), (at.Z, (0.0, 0.0, 1.0))):
        moved = states.copy()
        moved[:, state] += 1e-6
        for before, after, part in zip(plain, shown(moved), parts, strict=True):
            np.testing.assert_allclose((after.value - before.value) / 1e-6, part, atol=1e-6)
            np.testing.assert_allclose(before.slopes.get(state, np.zeros(4)), part, atol=1e-12)
    # The body leans on that cant, and lies on it with the rails.
    np.testing.assert_allclose(plain[0].slopes[at.CANT_ALONG], states[:, at.TILT])
    for state in (at.TILT, at.Y_TILT, at.Y_BEND, at.CANT):
        moved = states.copy()
        moved[:, state] += 1e-6
        for before, after in zip(plain, shown(moved), strict=True):
            slope = before.slopes.get(state, np.zeros(4))
            np.testing.assert_allclose((after.value - before.value) / 1e-6, slope, atol=1e-6)


def test_a_body_that_is_seen_aside_is_believed_aside(rough: Callable) -> None:
    """A third of 18 mm to the left and of 40 mm too high; unasked, to the bit, nothing.

    The IMU shows nothing of either. Of a process of density D at slow waves, seen in white noise of 2 D, a
    third is believed (Wiener); to the side what a body leans in curves is another guess beside it.
    """
    nominal, planted = (seeing(rough(), aside=a, above=b) for a, b in ((0.0, 0.0), (0.018, 0.04)))
    method = TrackRelativeSmoother(rail_sensor=True, geometry_step_m=0.0)
    assert method.needs == ("rail_sensor",)
    runs = slice(8.0, 40.0)
    moved = {}
    for asked in (True, False):
        one = replace(method, rail_sensor=asked)
        before, after = (one.estimate(recording).states for recording in (nominal, planted))
        columns = ["lateral_m", "vertical_m"]
        moved[asked] = (after[columns] - before[columns]).loc[runs].median().to_numpy()
        if asked:
            assert (after["lateral_sd_m"] < 0.02).all()
        else:
            pd.testing.assert_frame_equal(before, after, check_exact=True)
    aside, above = moved[True] / [0.018, 0.04]
    assert above == pytest.approx(1.0 / 3.0, abs=0.01)
    assert 0.99 / 3.0 < aside < 0.4


def test_it_is_causal_and_refused_without_a_sensor(rough: Callable) -> None:
    recording = seeing(rough(), aside=0.02, after=17.0)
    causal = TrackRelativeSmoother(smoothed=False, rail_sensor=True, geometry_step_m=0.0)
    whole = causal.estimate(recording).states
    part = causal.estimate(beginning(recording, samples=5003)).states
    pd.testing.assert_frame_equal(whole.iloc[:5003], part, check_exact=True)
    with pytest.raises(InputError, match="no rail sensor") as caught:
        causal.estimate(rough())
    assert "rail_sensor = false" in str(caught.value)
