"""A ride in steps, and its linear model: means of samples, joints that are forgotten, no future."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import WheelWay
from simrail.estimators.track_relative.line import ground_at
from simrail.estimators.track_relative.measurement import duals, pose_of, shown
from simrail.estimators.track_relative.model import (
    START_JERK_S,
    Steps,
    _jerk,
    _sense,
    about,
    course_of,
    linearised,
    steps_of,
)
from simrail.estimators.track_relative.noise import AXLE, BODY
from twins.track_relative import whole_rows

from simrail.core.columns import ACCEL, GYRO
from simrail.recording.recording import Recording, beginning
from simrail.track.alignment import element_starts


def test_a_step_is_the_mean_of_its_samples(rough: Callable) -> None:
    recording: Recording = rough()
    steps = steps_of(recording, 125.0)
    imu = recording.imu[[*GYRO, *ACCEL]].to_numpy()
    assert steps.dt == 2.0 / 250.0
    assert len(steps.signals) == len(imu) // 2
    np.testing.assert_allclose(steps.signals[5], imu[10:12].mean(axis=0), rtol=1e-15)
    time = recording.imu.index.to_numpy()
    np.testing.assert_allclose(steps.time_s[[0, 7]], [time[:2].mean(), time[14:16].mean()])
    np.testing.assert_array_equal(steps.end_s[[0, 7]], time[[1, 15]])
    ten = steps_of(recording, 25.0)
    np.testing.assert_allclose(ten.signals[3], imu[30:40].mean(axis=0), rtol=1e-12)


def test_the_wheels_way_is_that_of_its_counts(rough: Callable) -> None:
    """The counter's last reading at each sample, from the ride's first count on."""
    recording: Recording = rough()
    assert recording.encoder is not None and recording.encoder_sheet is not None
    steps = steps_of(recording, 125.0)
    counts = recording.encoder["pulse_count"].to_numpy(dtype=float)
    way = (
        np.interp(steps.time_s, recording.encoder.index, counts - counts[0]) * recording.encoder_sheet.pulse_m
    )
    # A reading is at most one period of the counter old, and as old as a count is coarse.
    slack = 15.5 / recording.encoder_sheet.rate_hz + 2.0 * recording.encoder_sheet.pulse_m
    assert np.abs(steps.way - way).max() < slack
    assert steps.way[-1] == pytest.approx(580.0, rel=0.01)


def test_a_step_takes_nothing_from_later(rough: Callable) -> None:
    recording: Recording = rough()
    whole = steps_of(recording, 125.0)
    part = steps_of(beginning(recording, samples=4000), 125.0)
    for name in ("signals", "way", "odometry", "slipping", "resting"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[:2000], err_msg=name)


@pytest.mark.parametrize("missing", ["encoder", "encoder_sheet"])
def test_without_an_encoder_it_rests_where_the_imu_is_quiet(rough: Callable, missing: str) -> None:
    recording: Recording = rough()
    wheeled, alone = steps_of(recording, 125.0), steps_of(replace(recording, **{missing: None}), 125.0)
    assert not alone.way.any() and alone.slipping.all()
    assert (alone.resting & ~wheeled.resting).sum() < 25  # until the second count of the wheel
    assert alone.resting[:375].all()


def test_the_linear_model_is_the_measurement_where_it_is_linearised(rough: Callable) -> None:
    """There its innovation is z - h(x), whatever the states; its rows are the slopes."""
    recording: Recording = rough()
    steps = steps_of(recording, 125.0)
    course = course_of(recording, steps, BODY, (WheelWay(),), ())
    moved = course.around.states.copy()
    moved[:, at.TILT], moved[:, at.LAG], moved[:, at.Y_BEND], moved[:, at.S] = (
        0.3,
        0.4,
        2.0,
        moved[:, at.S] + 0.2,
    )
    course = about(course, moved)
    rows = slice(1500, 1600)
    model, x0 = linearised(course, rows), course.around.states[rows]
    around = course.around._replace(states=x0, jerk=course.around.jerk[rows], sense=course.around.sense[rows])
    ground = ground_at(recording, course.lines, x0[:, at.S])
    pose = pose_of(duals(x0), ground, around)
    h = np.array([row.value for row in shown(duals(x0), ground, around, pose)]).T
    linear = np.array([whole_rows(model.columns, c) @ x for c, x in zip(model.coefficients, x0, strict=True)])
    np.testing.assert_allclose((model.measured - linear)[:, :6], steps.signals[rows] - h, rtol=0, atol=1e-12)
    np.testing.assert_allclose((model.measured - linear)[:, 6], steps.way[rows] - x0[:, at.WAY], atol=1e-9)
    np.testing.assert_array_equal(
        whole_rows(model.columns, model.coefficients[0])[6], np.eye(at.STATES)[at.WAY]
    )


def test_the_mount_stands_where_it_is_told(rough: Callable) -> None:
    """Left of the middle and above the rails: y before z, and the lever along stays out of both."""
    recording: Recording = replace(rough(), mount_position_m=(1.2, -0.3, 0.7))
    course = course_of(recording, steps_of(recording, 25.0), BODY, (), ())
    assert course.around.nominal == (-0.3, 0.7)
    assert course.around.gravity == recording.gravity_mps2 and course.around.sees_rails is False


@pytest.mark.parametrize("direction", [1, -1])
def test_a_joint_is_forgotten_once_it_is_behind(rough: Callable, direction: int) -> None:
    """EVEN and ODD are of the joints at the ends of the element: one changes just where its joint does."""
    recording: Recording = rough(0, direction)
    steps = steps_of(recording, 125.0)
    course = course_of(recording, steps, AXLE, (WheelWay(),), ())
    flows = linearised(course, slice(0, len(steps.time_s))).flows
    starts = element_starts(recording.track.elements, recording.track.start_m)
    nearest = np.round(course.around.states[:, at.S] * 4.0) / 4.0  # as the map is tabled
    element = np.searchsorted(starts, nearest + 1e-9, side="right") - 1
    ends = np.column_stack([element, element + 1])
    even, odd = ends[np.arange(len(ends)), element % 2], ends[np.arange(len(ends)), 1 - element % 2]
    for column, joint in ((10, even), (11, odd)):
        np.testing.assert_array_equal(
            np.flatnonzero(np.diff(joint)) + 1, np.flatnonzero(flows[:, column] == 0.0)
        )
    assert set(np.unique(flows[:, 10:])) >= {0.0, 1.0}
    assert (flows[:, 10] == 0.0).sum() + (flows[:, 11] == 0.0).sum() == 8
    # Curve and cant begin anew once, between the two curves, at 215 m of the design.
    for column in (8, 9):
        (where,) = np.flatnonzero(flows[:, column] == 0.0)
        assert abs(course.around.states[where, at.S] - 215.0) < 2.0


@pytest.mark.parametrize("direction", [1, -1])
def test_flows_add_up_over_a_ride(rough: Callable, bend: Callable, direction: int) -> None:
    """To its way, to the angle that it turns by, and over a vertical curve to its length."""
    recording: Recording = replace(rough(0, direction), track=bend(15.0, 1).track)
    steps = steps_of(recording, 125.0)
    # A causal odometry corrects its place by what is no speed: here the place is the way.
    speed = steps.odometry[:, 1]
    middle = speed - 0.5 * np.diff(speed, prepend=speed[0])
    way = recording.start_position_m + steps.dt * np.cumsum(middle)
    steps = steps._replace(odometry=np.column_stack([way, steps.odometry[:, 1:]]))
    course = course_of(recording, steps, AXLE, (WheelWay(),), ())
    flows, track = linearised(course, slice(0, len(steps.time_s))).flows, recording.track
    place = course.around.states[[0, -1], at.S]
    assert flows[:, 1].sum() == pytest.approx(place[1] - place[0], abs=0.05)
    assert (flows[:, 0] == np.abs(flows[:, 1])).all()
    yaw = track.frame(place).yaw_rad
    assert flows[:, 2].sum() == pytest.approx(yaw[1] - yaw[0], abs=1e-4)
    # A joint that lies elsewhere turns the line behind it, as much as that of a track that was laid so.
    side = np.abs(course.around.states[:, at.S] - 80.0) < 22.0
    for joint, column in ((1, 4), (2, 3)):
        elements = list(track.elements)
        for i, more in ((joint - 1, 0.2), (joint, -0.2)):
            elements[i] = replace(elements[i], length_m=elements[i].length_m + more)
        behind = np.array([125.0])
        turned = replace(track, elements=tuple(elements)).frame(behind).yaw_rad - track.frame(behind).yaw_rad
        assert 0.2 * flows[side, column].sum() == pytest.approx(direction * turned[0], rel=0.02)
    near = np.abs(course.around.states[:, at.S] - 180.0) < 40.0
    # R times the change of slope, and half of each of the ramps of some 5 m by which it begins and ends.
    assert 1500.0 * 0.035 < -7.0 * np.log(flows[near, 7]).sum() < 1500.0 * 0.035 + 6.0


def test_a_wheel_that_slips_is_not_measured(rough: Callable) -> None:
    recording: Recording = rough()
    steps = steps_of(recording, 125.0)
    slips = steps.slipping.copy()
    slips[2000:2010] = True
    model = linearised(
        course_of(recording, steps._replace(slipping=slips), AXLE, (WheelWay(),), ()), slice(1990, 2020)
    )
    assert np.isinf(model.variances[10:20, 6]).all()
    assert np.isfinite(model.variances[:10]).all() and np.isfinite(model.variances[:, :6]).all()
    assert (model.flows[10:20, 12] == 1.0).all() and model.flows[:10, 12].max() < 1e-2


def test_white_motion_grows_with_the_speed(rough: Callable) -> None:
    """Variance by the third power of V; at 70 km/h and 125 Hz it is the class's own, beside the sensor's."""
    recording: Recording = rough()
    steps = steps_of(recording, 125.0)
    motion = replace(AXLE, heaving=0.03)
    course = course_of(recording, steps, motion, (WheelWay(),), ())
    states = course.around.states.copy()
    states[:, at.V] = 70.0 / 3.6
    fast = linearised(about(course, states), slice(0, 1)).variances[0]
    states[:, at.V] = 35.0 / 3.6
    slow = linearised(about(course, states), slice(0, 1)).variances[0]
    states[:, at.V] = 0.0
    still = linearised(about(course, states), slice(0, 1)).variances[0]
    own = [*[AXLE.gyro] * 3, AXLE.accel_x, AXLE.accel_y, AXLE.accel_z]
    always = still.copy()
    always[5] -= motion.heaving**2
    np.testing.assert_allclose(fast[:6] - always[:6], np.square(own), rtol=1e-9)
    np.testing.assert_allclose(fast[:6] - always[:6], 8.0 * (slow[:6] - always[:6]), rtol=1e-9)
    sheet = recording.imu_sheet
    # With what every mount does: 0.05 mrad/s and 3 mm/s2, and rolls, pitches and heaves at rest.
    gyro, accel = sheet.gyro_noise_radpsqrts**2 * 125.0, sheet.accel_noise_mpsqrts**2 * 125.0
    rates = [gyro + 25e-10 + AXLE.rocking**2] * 2 + [gyro + 25e-10]
    np.testing.assert_allclose(still[:6], [*rates, *[accel + 9e-6] * 2, accel + 9e-6 + 9e-4], rtol=1e-12)


def test_the_sense_of_travel_is_held_at_rest() -> None:
    speed = np.array([0.0, 0.1, -0.1, 3.0, 0.1, -0.1, -3.0, -0.1, 0.1, 0.0, 3.0])
    assert _sense(speed).tolist() == [1, 1, 1, 1, 1, 1, -1, -1, -1, -1, 1]


def steps_with(forward: np.ndarray, *, resting: bool) -> Steps:
    """Steps of a train whose accelerometer shows this along X."""
    n = len(forward)
    signals = np.zeros((n, 6))
    signals[:, 3] = forward
    time, none, no = 0.008 * np.arange(n), np.zeros(n), np.zeros(n, dtype=bool)
    return Steps(time, time, 0.008, signals, none, np.zeros((n, 4)), no, np.full(n, resting))


def test_the_jerk_is_the_slope_of_the_acceleration_of_the_past() -> None:
    time = 0.008 * np.arange(1000)
    steps, fast = steps_with(9.0 * time, resting=False), np.full(1000, 9.0)
    np.testing.assert_allclose(_jerk(steps, fast, 0.3 * time)[200:], 0.3)
    step = np.where(time > 4.0, 1.0, 0.0)
    assert not _jerk(steps, fast, step)[time <= 4.0].any()


@pytest.mark.parametrize("resting", [True, False])
def test_where_a_train_begins_to_move_its_accelerometer_tells_the_jerk_at_once(resting: bool) -> None:
    """Gravity beside it, which does not change, is no jerk; the odometry knows of nothing yet."""
    time = 0.008 * np.arange(1000)
    steps = steps_with(0.4 + 0.5 * np.maximum(time - 4.0, 0.0), resting=resting)
    jerk = _jerk(steps, np.zeros(1000), np.zeros(1000))
    assert not jerk[time <= 4.0].any()
    np.testing.assert_allclose(jerk[time > 4.0 + START_JERK_S + 0.008], 0.5)


def test_a_body_that_is_rocked_at_rest_has_no_jerk() -> None:
    """Its pitch turns gravity into its accelerometer: a slope that is the rate of pitch itself, times g."""
    time = 0.008 * np.arange(1000)
    rocked = 9.81 * 1e-3 * np.sin(2.0 * np.pi * 0.5 * time)
    assert not _jerk(steps_with(rocked, resting=True), np.zeros(1000), np.zeros(1000)).any()
    assert _jerk(steps_with(rocked, resting=False), np.zeros(1000), np.zeros(1000)).any()
