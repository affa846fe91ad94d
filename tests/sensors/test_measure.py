"""Truth to recording: what the train may know is there, what it may not know is not."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IMU, MAGNETIC, ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.check_form import check_recording
from simrail.recording.files.ride_writer import write_parts
from simrail.recording.sheets.grades import ImuGrade
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.standstill import GUARD_S, at_rest_initially, first_motion_s, rest_periods
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec, Slip
from simrail.sensors.imu import EarthRate, streams_of
from simrail.sensors.imu_response import Temperature
from simrail.sensors.magnetic_surroundings import Steel
from simrail.sensors.magnetometer import MagnetometerSpec
from simrail.sensors.measure import measure
from simrail.sensors.second_imu import SecondImuSpec
from simrail.track.design import Straight, TrackDesign
from simrail.vehicle.speed_profile import Run, SpeedProfile

REST_S = 6.0
MOUNT = Mount("axle", "body", (0.5, 0.0, 0.6))
LORD = load_grade("lord_3dm_gx4_25")


@pytest.fixture(scope="module")
def truth():
    track = TrackDesign("line", -50.0, (Straight(600.0),))
    return kinematic_truth(
        track, SpeedProfile(start_m=10.0, end_m=210.0, speed_mps=10.0, rest_s=REST_S), height_m=0.3
    )


def record(truth, **more):
    settings = {
        "name": "ride",
        "mount": MOUNT,
        "grade": LORD,
        "encoder": EncoderSpec("wheel", radius_error_sd=1e-3),
        "seed": 2,
        "draw": 0,
    } | more
    return measure(truth, **settings)


def test_a_recording_is_complete_and_passes_its_own_judgement(truth):
    recording = record(truth)
    check_recording(recording)
    assert recording.name == "ride"
    assert recording.mount == "axle"
    assert recording.mount_body == "body"
    assert recording.mount_position_m == MOUNT.position_m
    assert recording.track == truth.track
    assert recording.gravity_mps2 == truth.gravity_mps2
    assert recording.odometry is None and recording.odometry_source == ""
    assert recording.imu_sheet.grade == "lord_3dm_gx4_25"
    assert recording.imu_sheet.rate_hz == 250.0
    assert recording.imu_sheet.delay_s == pytest.approx(recording.imu.index[0])
    assert recording.imu_sheet.gyro_noise_radpsqrts == LORD.gyro_noise_radpsqrts
    assert recording.imu_sheet.accel_turn_on_bias_mps2 == LORD.accel_turn_on_bias_mps2
    assert recording.encoder_sheet.pulses_per_revolution == 1024
    assert recording.encoder_sheet.wheel_radius_m != truth.wheel_radius_m["wheel"]
    assert recording.encoder_sheet.wheel_radius_m == pytest.approx(truth.wheel_radius_m["wheel"], rel=5e-3)


def test_odometry_speaks_of_the_mount_and_is_honest(truth):
    recording = with_odometry(record(truth), "encoder")
    true = truth.motion(MOUNT).loc[recording.imu.index]
    assert recording.start_position_m == pytest.approx(10.5)
    error = recording.odometry["position_m"] - true["position_m"]
    assert np.abs(error[: round(REST_S * 250) - 10]).max() < 1e-9
    assert (np.abs(error) < 3.0 * recording.odometry["position_sd_m"]).all()
    assert recording.odometry["position_sd_m"].iloc[-1] == pytest.approx(
        200.0 * np.hypot(1e-3, 4e-3), rel=0.01
    )


def test_a_slide_and_quadrature_reach_the_odometry(truth):
    """At 10 m/s for 1.5 s less half of both ramps, 15 % too slow: the train believes 1.875 m less."""
    slide = Slip(start_s=REST_S + 18.3, duration_s=1.5, creepage=-0.15)
    for quadrature in (False, True):
        wheel = EncoderSpec("wheel", quadrature=quadrature, radius_error=0.0)
        plain, slid = (
            with_odometry(record(truth, encoder=replace(wheel, slip=slip)), "encoder")
            for slip in ((), (slide,))
        )
        speed = truth.motion(MOUNT)["speed_mps"].loc[slide.start_s : slide.start_s + 1.5]
        np.testing.assert_allclose(speed, 10.0, rtol=1e-9)
        lost = (plain.odometry["position_m"] - slid.odometry["position_m"]).iloc[-1]
        assert lost == pytest.approx(0.15 * 10.0 * (1.5 - 0.25), abs=0.003)
        assert plain.odometry["position_m"].iloc[-1] == pytest.approx(210.5, abs=0.005)
        assert plain.encoder_sheet.pulses_per_revolution == (4096 if quadrature else 1024)


@pytest.mark.parametrize("runs", [(), (Run(30.0, 8.0),)])
def test_a_calibrated_radius_is_the_way_over_the_turns(truth, runs):
    """To rounding, on a wheel that rolls on another radius than its own; also over a run there and one back.

    On a straight, so that the mount's way is the body's. A thousandth of it is a metre in a kilometre.
    """
    profile = SpeedProfile(start_m=10.0, end_m=210.0, speed_mps=10.0, rest_s=REST_S, runs=runs)
    ridden = kinematic_truth(truth.track, profile, height_m=0.3)
    own, place = ridden.wheel_radius_m["wheel"], ridden.reference_position_m
    ridden = replace(ridden, wheel_angles={"wheel": (place - place[0]) / (1.003 * own)})
    spec = EncoderSpec("wheel", radius="calibrated", radius_error=0.0)
    assert record(ridden, encoder=spec).encoder_sheet.wheel_radius_m == pytest.approx(1.003 * own, rel=1e-9)
    drawing = replace(spec, radius="drawing")
    assert record(ridden, encoder=drawing).encoder_sheet.wheel_radius_m == own


def test_true_odometry_is_exact_and_labelled(truth):
    recording = record(truth, odometry="truth", encoder=None)
    assert recording.odometry_source == "truth"
    assert recording.encoder is None
    assert recording.encoder_sheet is None
    true = truth.motion(MOUNT).loc[recording.imu.index, list(ODOMETRY)]
    pd.testing.assert_frame_equal(recording.odometry[list(ODOMETRY)], true, check_exact=True)
    assert (recording.odometry[list(ODOMETRY_SD)] == 0.0).all(axis=None)
    check_recording(recording)


def test_one_sensor_more_changes_no_other(truth):
    alone = record(truth)
    record(truth, mount=replace(MOUNT, name="frame"))
    again = record(truth, encoder=None, odometry="truth")
    pd.testing.assert_frame_equal(alone.imu, again.imu, check_exact=True)
    other = record(truth, mount=replace(MOUNT, name="frame"))
    pd.testing.assert_frame_equal(alone.encoder, other.encoder, check_exact=True)
    assert (alone.imu != other.imu).mean().min() > 0.9


def test_a_new_draw_is_a_new_set_of_sensors(truth):
    first, second = record(truth), record(truth, draw=1)
    assert (first.imu != second.imu).mean().min() > 0.9
    assert first.encoder_sheet != second.encoder_sheet


def test_the_earth_turns_only_if_asked(truth):
    ideal = load_grade("ideal")
    still = record(truth, grade=ideal)
    turning = record(truth, grade=ideal, earth_rate=EarthRate(np.radians(37.3)))
    difference = (turning.imu - still.imu).iloc[:1000, :3].to_numpy()
    assert np.linalg.norm(difference, axis=1) == pytest.approx(7.292115e-5, rel=1e-9)


def test_lost_samples_are_filled_by_straight_lines_and_listed(truth):
    whole = record(truth)
    lossy = record(truth, grade=replace(LORD, dropped_fraction=0.05, dropped_burst=2.0))
    assert whole.gaps is None
    check_recording(lossy)
    pd.testing.assert_index_equal(lossy.imu.index, whole.imu.index)
    assert list(lossy.gaps.columns) == ["start_s", "end_s", "missing"]
    lost = np.zeros(len(whole.imu), dtype=bool)
    for gap in lossy.gaps.itertuples():
        inside = (whole.imu.index > gap.start_s) & (whole.imu.index < gap.end_s)
        assert inside.sum() == gap.missing
        lost |= inside
    assert lost.mean() == pytest.approx(0.05, abs=0.02)
    pd.testing.assert_frame_equal(lossy.imu[~lost], whole.imu[~lost], check_exact=True)
    filled = {c: np.interp(whole.imu.index, whole.imu.index[~lost], whole.imu[c][~lost]) for c in IMU}
    np.testing.assert_allclose(lossy.imu[lost], pd.DataFrame(filled)[lost], rtol=1e-12)


def test_the_sheet_says_what_an_estimator_may_know(truth):
    grade = replace(
        LORD,
        bandwidth_hz=50.0,
        oversampling=4,
        gyro_random_walk_radpspsqrts=1e-6,
        accel_scale_error=1e-3,
        package_misalignment_rad=2e-3,
    )
    sheet = record(truth, grade=grade).imu_sheet
    assert sheet.lag_s == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi * 50.0) + 0.0015)
    assert sheet.bandwidth_hz == 50.0
    assert sheet.delay_s == 0.0, "internal samples at the truth's rate need no filter"
    assert sheet.gyro_random_walk_radpspsqrts == 1e-6
    assert sheet.accel_scale_error == 1e-3
    assert sheet.package_misalignment_rad == 2e-3
    assert sheet.gyro_range_radps == LORD.gyro_range_radps
    assert record(truth, grade=load_grade("ideal")).imu_sheet.gyro_range_radps is None


def test_sheet_and_gaps_survive_the_files(truth, tmp_path):
    grade = replace(
        LORD, dropped_fraction=0.05, clock_jitter_s=1e-5, bandwidth_hz=100.0, gyro_scale_error=0.01
    )
    recording = record(truth, grade=grade)
    write_parts(recording, tmp_path, format="csv")
    again = read_ride(tmp_path / "ride.toml")
    assert again.imu_sheet == recording.imu_sheet
    pd.testing.assert_frame_equal(again.gaps, recording.gaps, check_exact=True)
    pd.testing.assert_frame_equal(again.imu, recording.imu, check_exact=True)


def test_a_turned_package_is_a_turned_mount(truth):
    """The package's angles are those of the sensor's axes in the mount's, as a mount's own are."""
    crooked = replace(load_grade("ideal"), package_misalignment_rad=0.1)
    angles = streams_of(2, 0, "axle")("package_misalignment").uniform(-1.0, 1.0, 3) * 0.1
    assert np.abs(angles).min() > 1e-3
    by_mount = replace(MOUNT, **dict(zip(("roll_rad", "pitch_rad", "yaw_rad"), angles, strict=True)))
    one, other = (
        record(truth, grade=crooked),
        record(truth, grade=load_grade("ideal"), mount=by_mount),
    )
    np.testing.assert_allclose(one.imu, other.imu, atol=1e-12)


def test_a_rate_between_the_samples_of_the_truth_is_measured_whole(truth):
    """Beside it a magnetometer, the true odometry: all at the device's own stamps."""
    grade = ImuGrade("odd", 416.0)
    recording = record(truth, grade=grade, odometry="truth", magnetometer=MagnetometerSpec())
    check_recording(recording)
    motion = truth.motion(MOUNT)
    odometry = recording.odometry
    expected = np.interp(odometry.index.to_numpy(), motion.index.to_numpy(), motion["position_m"].to_numpy())
    np.testing.assert_allclose(odometry["position_m"].to_numpy(), expected, atol=1e-12)


def test_temperature_acts_only_if_given(truth):
    grade = replace(LORD, gyro_bias_temperature_radpspk=1e-4)
    cold = record(truth, grade=grade)
    pd.testing.assert_frame_equal(cold.imu, record(truth).imu, check_exact=True)
    warm = record(truth, grade=grade, temperature=Temperature(45.0, 45.0))
    assert np.abs(warm.imu["gyro_x_radps"] - cold.imu["gyro_x_radps"]).mean() > 1e-5


def test_a_second_imu_is_as_warm_and_on_the_same_earth(truth):
    """Of a coefficient and a gyro without noise all of the difference is theirs, sample by sample."""
    grade = replace(load_grade("ideal"), gyro_bias_temperature_radpspk=1e-4)
    rear = SecondImuSpec(Mount("rear", "body", (-8.0, 0.0, 0.6)), grade)
    earth = EarthRate(0.9, 0.5)
    for change in ({"temperature": Temperature(45.0, 45.0)}, {"earth_rate": earth}):
        plain, changed = (record(truth, grade=grade, second_imu=rear, **more) for more in ({}, change))
        for name in ("gyro_x_radps", "gyro_z_radps"):
            first = (changed.imu[name] - plain.imu[name]).to_numpy()
            second = (changed.second_imu[name] - plain.second_imu[name]).to_numpy()
            assert np.abs(first).min() > 1e-6 and np.abs(second).min() > 1e-6
            if "earth_rate" in change:
                np.testing.assert_allclose(second[:1000], first[:1000], atol=1e-9)


def test_steel_stands_along_the_whole_track_wherever_it_begins(truth, monkeypatch):
    asked = {}

    def sample(motion, times, spec, **more):
        asked.update(more)
        return pd.DataFrame(0.0, index=times, columns=list(MAGNETIC))

    monkeypatch.setattr("simrail.sensors.measure.sample_magnetometer", sample)
    record(truth, magnetometer=MagnetometerSpec(steel=Steel(5)))
    assert asked == {"track_m": (-50.0, 550.0), "seed": 2, "draw": 0, "name": "axle"}


def test_rest_is_found_from_the_encoder(truth):
    recording = record(truth)
    # Jerk 0.4 m/s3: one pulse of 1.8 mm comes at most 0.3 s after the start.
    assert REST_S < first_motion_s(recording) < REST_S + 0.31
    count = at_rest_initially(recording)
    times = recording.imu.index
    assert times[count - 1] < first_motion_s(recording) - GUARD_S <= times[count]
    resting = recording.imu["gyro_x_radps"].iloc[:count]
    assert count == pytest.approx((REST_S - 0.35) * 250, abs=50)
    assert abs(resting.mean()) < LORD.gyro_turn_on_bias_radps + 3e-4


def test_rest_without_an_encoder_or_without_motion(truth):
    blind = record(truth, odometry="truth", encoder=None)
    assert first_motion_s(blind) == pytest.approx(REST_S + 0.22, abs=0.02)
    # Nothing tells of motion, so nothing tells of rest.
    assert at_rest_initially(replace(blind, odometry=None)) == 0
    assert rest_periods(replace(blind, odometry=None)).empty
    short = replace(
        record(truth),
        imu=record(truth).imu.loc[:5.0],
        encoder=record(truth).encoder.loc[:5.0],
    )
    assert first_motion_s(short) == float("inf")
    assert at_rest_initially(short) == len(short.imu)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"odometry": "encoder"}, "odometry: no such thing is measured"),
        ({"encoder": EncoderSpec("front.left")}, "wheel"),
        ({"mount": replace(MOUNT, body="bogie")}, "body"),
        ({"grade": replace(LORD, rate_hz=1300.0)}, "rate_hz"),
        ({"encoder": EncoderSpec("wheel", rate_hz=301.0)}, "rate_hz"),
    ],
)
def test_what_cannot_be_measured_is_refused(truth, change, word):
    with pytest.raises(InputError) as caught:
        record(truth, **change)
    assert word in str(caught.value)
