"""The sensor of the rails: closed forms of what it sees, its noise, its streams, and measure's side of it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import ATTITUDE, POSITION, RAIL_DISPLACEMENT
from simrail.core.errors import InputError
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.measure import measure
from simrail.sensors.rail_sensor import RailSensorSpec, check_rail_sensor, rails_seen, sample_rails
from simrail.track.design import Curve, Gradient, Straight, TrackDesign, Transition
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.speed_profile import SpeedProfile

LEVEL = TrackDesign("level", 0.0, (Straight(200.0),))
SMOOTH = lay(LEVEL, Irregularity("none", fade_m=0.0), seed=1)
ROUGH = lay(LEVEL, Irregularity("erri_b176_high", (1.5, 100.0), 20.0), seed=2)
EXACT = RailSensorSpec(noise_m=0.0, outlier_fraction=0.0)
QUIET = RailSensorSpec(outlier_fraction=0.0)


def still(x=100.0, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0, count=3):
    """The motion of a body that stands: the columns that the sensor looks at."""
    values = np.tile([x, y, z, roll, pitch, yaw, x], (count, 1))
    return pd.DataFrame(
        values,
        index=pd.Index(np.arange(count) / 250.0, name="time_s"),
        columns=[*POSITION, *ATTITUDE, "position_m"],
    )


def seen(motion, spec=EXACT, rails=SMOOTH, draw=0, name="axle", seed=1):
    return sample_rails(motion, motion.index, spec, rails, seed=seed, draw=draw, name=name)


def test_a_body_displaced_and_rolled_sees_the_rails_where_geometry_says():
    y, z, roll, b = 0.02, 0.7, 0.03, 0.75
    found = seen(still(y=y, z=z, roll=roll))
    assert list(found) == list(RAIL_DISPLACEMENT)
    cos, sin = np.cos(roll), np.sin(roll)
    for side, at in ((b, 0), (-b, 2)):
        # (side - y, -z) on axes turned by the roll, which lifts the left side.
        expected = (cos * (side - y) - sin * z, -sin * (side - y) - cos * z)
        np.testing.assert_allclose(found.iloc[0, at : at + 2], expected, atol=1e-12)


def test_a_body_that_turns_to_the_left_sees_the_rails_farther_apart():
    yaw, y = 0.05, 0.01
    found = seen(still(y=y, z=0.5, yaw=yaw)).iloc[0]
    # Its plane X = 0 meets the rails askew: a rail at the distance d across is d / cos(yaw) along the plane.
    assert found["rail_left_y_m"] == pytest.approx((0.75 - y) / np.cos(yaw), abs=1e-7)
    assert found["rail_right_y_m"] == pytest.approx((-0.75 - y) / np.cos(yaw), abs=1e-7)
    assert found["rail_left_z_m"] == pytest.approx(-0.5, abs=1e-9)


def test_pitched_it_still_sees_the_rail_in_its_own_plane():
    found = seen(still(z=0.5, pitch=0.04)).iloc[0]
    np.testing.assert_allclose(found, [0.75, -0.5 / np.cos(0.04), -0.75, -0.5 / np.cos(0.04)], atol=1e-9)


def test_irregular_rails_show_as_they_were_laid():
    s = np.linspace(30.0, 170.0, 57)
    angles = np.zeros((len(s), 3))
    position = np.column_stack([s, np.zeros(len(s)), np.full(len(s), 0.4)])
    left, right = rails_seen(position, angles, s + 0.3, ROUGH)
    expected = ROUGH.rails(s)
    np.testing.assert_allclose(left, expected[:, :2] + [0.75, -0.4], atol=1e-9)
    np.testing.assert_allclose(right, expected[:, 2:] + [-0.75, -0.4], atol=1e-9)
    # On a narrower base, as of a scale track, the nominal rails move and their deviations stay.
    narrow = replace(ROUGH, design=replace(LEVEL, rail_base_m=0.13))
    seen_left, seen_right = rails_seen(position, angles, s, narrow)
    np.testing.assert_allclose(seen_left, left - [0.75 - 0.065, 0.0], atol=1e-9)
    np.testing.assert_allclose(seen_right, right - [0.065 - 0.75, 0.0], atol=1e-9)


def test_in_a_canted_curve_the_rails_lie_in_the_track_frame():
    track = TrackDesign(
        "bend",
        0.0,
        (Straight(50.0), Transition(40.0), Curve(100.0, 250.0, 0.1)),
        gradients=(Gradient(20.0, 0.01),),
        vertical_radius_m=1500.0,
    )
    laid = lay(track, Irregularity("erri_b176_high", (1.5, 100.0), 20.0), seed=4)
    s = np.linspace(100.0, 160.0, 31)
    frame = track.frame(s)
    angles = np.column_stack([frame.roll_rad, frame.pitch_rad, frame.yaw_rad])
    left, right = rails_seen(frame.position, angles, s, laid)
    nominal = np.array([0.75, 0.0])
    np.testing.assert_allclose(left - nominal, laid.rails(s)[:, :2], atol=1e-8)
    np.testing.assert_allclose(right + nominal, laid.rails(s)[:, 2:], atol=1e-8)


def test_noise_is_white_of_the_stated_size_and_free_of_correlation():
    motion = still(count=40_000, z=0.5)
    noise = (seen(motion, QUIET) - seen(motion)).to_numpy()
    np.testing.assert_allclose(noise.std(axis=0), 1e-4, rtol=4.0 / np.sqrt(2 * len(noise)))
    assert np.abs(noise.mean(axis=0)).max() < 4e-4 / np.sqrt(len(noise))
    others = [seen(motion, QUIET, draw=1), seen(motion, QUIET, name="body"), seen(motion, QUIET, seed=2)]
    columns = [noise, noise[1:], *((other - seen(motion)).to_numpy() for other in others)]
    everything = np.column_stack([part[: len(noise) - 1] for part in columns])
    correlation = np.corrcoef(everything.T) - np.eye(everything.shape[1])
    assert np.abs(correlation).max() < 4.5 / np.sqrt(len(noise))


def test_outliers_are_as_many_and_as_large_as_stated_and_leave_the_noise_alone():
    motion = still(count=40_000, z=0.5)
    spec = RailSensorSpec(outlier_fraction=0.02, outlier_m=8e-3)
    added = (seen(motion, spec) - seen(motion, QUIET)).to_numpy()
    struck = added != 0.0
    n = struck.size
    assert struck.mean() == pytest.approx(0.02, abs=4 * np.sqrt(0.02 / n))
    assert added[struck].std() == pytest.approx(8e-3, rel=4.0 / np.sqrt(2 * struck.sum()))
    both = (struck[:, 0] & struck[:, 1]).mean()
    assert both == pytest.approx(0.02**2, abs=4 * 0.02 / np.sqrt(len(motion)))


def test_impossible_sensors_are_named():
    for field, value in (
        ("noise_m", -1e-4),
        ("noise_m", np.nan),
        ("outlier_fraction", 0.5),
        ("outlier_m", -1.0),
    ):
        with pytest.raises(InputError, match=f"{field}: is impossible"):
            check_rail_sensor(RailSensorSpec(**{field: value}))


def recorded(**sensors):
    truth = kinematic_truth(LEVEL, SpeedProfile(20.0, 60.0, 8.0, rest_s=1.0))
    return measure(
        truth,
        name="ride",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("lord_3dm_gx4_25"),
        odometry="truth",
        seed=1,
        draw=0,
        **sensors,
    )


def test_measure_puts_it_into_the_recording_and_changes_nothing_else():
    with_it = recorded(rail_sensor=RailSensorSpec(), rails=ROUGH)
    without = recorded()
    assert with_it.imu.equals(without.imu) and with_it.odometry.equals(without.odometry)
    assert without.rail_displacement is None and without.rail_sensor_sheet is None
    assert with_it.rail_displacement.index.equals(with_it.imu.index)
    assert with_it.rail_sensor_sheet.noise_m == 1e-4
    again = recorded(rail_sensor=RailSensorSpec(), rails=ROUGH)
    assert with_it.rail_displacement.equals(again.rail_displacement)
    with pytest.raises(InputError, match=r"rails: a rail sensor needs rails"):
        recorded(rail_sensor=RailSensorSpec())
