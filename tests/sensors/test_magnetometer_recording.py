"""A magnetometer in a recording: what it does to a heading, and to nothing else; and what VQF makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from simrail.estimators.ahrs import Vqf

from simrail.core.columns import ATTITUDE
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.conformance import check_estimator
from simrail.estimation.recorded_ride import read_ride
from simrail.recording.check_form import check_recording
from simrail.recording.files.ride_writer import write_ride
from simrail.recording.sheets.imu_file import load_grade
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.magnetic_surroundings import (
    Steel,
    Traction,
)
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron
from simrail.sensors.measure import measure
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.vehicle.speed_profile import SpeedProfile

LINE = TrackDesign(
    "line",
    0.0,
    (Straight(150.0), Transition(50.0), Curve(150.0, 250.0, 0.06), Transition(50.0), Straight(200.0)),
)
MOUNT = Mount("axle", "body", (0.0, 0.0, 0.6), roll_rad=0.02)
URBAN = MagnetometerSpec(
    field=EarthField(x_axis_rad=0.3), iron=VehicleIron(), traction=Traction(), steel=Steel(track_seed=1)
)


@pytest.fixture(scope="module")
def truth():
    return kinematic_truth(LINE, SpeedProfile(10.0, 580.0, 15.0, rest_s=3.0), height_m=0.3)


def record(truth, magnetometer, **more):
    settings = {
        "name": "ride",
        "mount": MOUNT,
        "grade": load_grade("lord_3dm_gx4_25"),
        "encoder": EncoderSpec("wheel"),
        "seed": 1,
        "draw": 0,
    } | more
    return with_odometry(measure(truth, magnetometer=magnetometer, **settings), "encoder")


@pytest.fixture
def heading_error_deg(truth, heading_error):
    def error(recording):
        true = truth.motion(MOUNT).loc[recording.imu.index]
        roll, pitch, yaw = (true[name].to_numpy() for name in ATTITUDE)
        north_rad = recording.magnetometer_sheet.north_rad
        return np.degrees(heading_error(recording.magnetometer, roll, pitch, yaw, north_rad=north_rad))

    return error


def test_a_clean_field_gives_the_heading_to_noise(truth, heading_error_deg):
    spec = replace(URBAN, iron=None, traction=None, steel=None, bias_t=0.0)
    error = heading_error_deg(record(truth, spec))
    level = spec.field.intensity_t * np.cos(spec.field.inclination_rad)
    sd = np.degrees(spec.noise_tpsqrthz * np.sqrt(250.0) / level)
    # Leaned by 0.06 rad at most, the steep part of the field takes part: a few per cent.
    assert error.std() == pytest.approx(sd, rel=0.05)
    assert abs(error.mean()) < 5.0 * sd / np.sqrt(len(error))


def test_on_an_urban_line_it_errs_by_tens_of_degrees(truth, heading_error_deg):
    error = heading_error_deg(record(truth, URBAN))
    assert 15.0 < np.sqrt(np.mean(error**2)) < 100.0
    for part in ("iron", "traction", "steel"):
        alone = replace(URBAN, **{name: None for name in ("iron", "traction", "steel") if name != part})
        assert np.sqrt(np.mean(heading_error_deg(record(truth, alone)) ** 2)) > 3.0, part


def test_another_sensor_changes_no_sample(truth):
    alone, more = record(truth, None), record(truth, URBAN)
    assert alone.magnetometer is None and alone.magnetometer_sheet is None
    for part in ("imu", "encoder", "odometry"):
        pd.testing.assert_frame_equal(getattr(alone, part), getattr(more, part), check_exact=True)
    cleaner = record(truth, replace(URBAN, steel=None, traction=None))
    quiet = record(truth, replace(URBAN, steel=None, traction=None, noise_tpsqrthz=0.0, bias_t=0.0))
    noise = cleaner.magnetometer - quiet.magnetometer
    disturbed = record(truth, replace(URBAN, noise_tpsqrthz=0.0, bias_t=0.0)).magnetometer
    np.testing.assert_allclose((more.magnetometer - disturbed).to_numpy(), noise.to_numpy(), atol=1e-18)
    other = record(truth, URBAN, draw=1)
    assert (other.magnetometer != more.magnetometer).mean().min() > 0.99


def test_the_sheet_says_what_a_chart_says_and_nothing_of_disturbances(truth):
    sheet = record(truth, URBAN).magnetometer_sheet
    assert sheet.north_rad == pytest.approx(0.5 * np.pi - 0.3)
    assert (sheet.intensity_t, sheet.noise_tpsqrthz) == (45e-6, 10e-9)
    assert sheet == record(truth, replace(URBAN, iron=None, traction=None, steel=None)).magnetometer_sheet


def test_it_survives_the_disk_bit_by_bit(truth, tmp_path):
    recording = record(truth, URBAN, encoder=EncoderSpec("wheel", edge_times=True, quadrature=True))
    check_recording(recording)
    write_ride(recording, tmp_path / "ride")
    again = read_ride(tmp_path / "ride")
    for part in ("magnetometer", "encoder", "imu"):
        pd.testing.assert_frame_equal(getattr(again, part), getattr(recording, part), check_exact=True)
    assert again.magnetometer_sheet == recording.magnetometer_sheet
    assert list(again.encoder) == ["pulse_count", "edge_time_s"]
    write_ride(record(truth, None), tmp_path / "without")
    assert read_ride(tmp_path / "without").magnetometer is None


FAULTS = {
    "microtesla": (lambda f: f * 1e6, ["magnetometer.magnetic_", "0.01 T", "microtesla"]),
    "a missing axis": (lambda f: f.drop(columns="magnetic_y_t"), ["magnetic_y_t [T]"]),
    "not a number": (lambda f: f.assign(magnetic_z_t=np.nan), ["magnetometer.magnetic_z_t", "finite"]),
    "other times": (lambda f: f.iloc[1:], ["magnetometer.time_s", "IMU"]),
    "reversed": (lambda f: f.iloc[::-1], ["magnetometer.time_s", "reversed"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_signal_is_refused_by_name(truth, fault):
    change, words = FAULTS[fault]
    recording = record(truth, URBAN)
    with pytest.raises(InputError) as caught:
        check_recording(replace(recording, magnetometer=change(recording.magnetometer)))
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_signal_without_its_sheet_is_refused(truth):
    with pytest.raises(InputError, match="magnetometer_sheet"):
        check_recording(replace(record(truth, URBAN), magnetometer_sheet=None))


@pytest.mark.parametrize("x_axis_deg", (0.0, 70.0, -160.0))
def test_vqf_takes_its_heading_from_a_clean_field(truth, x_axis_deg):
    spec = MagnetometerSpec(field=EarthField(x_axis_rad=np.radians(x_axis_deg), declination_rad=0.05))
    recording = record(truth, spec, grade=load_grade("ideal"), mount=replace(MOUNT, roll_rad=0.0))
    true = truth.motion(replace(MOUNT, roll_rad=0.0)).loc[recording.imu.index, "yaw_rad"].to_numpy()
    found = Vqf(compensated=True, magnetometer=True).estimate(recording).states["yaw_rad"].to_numpy()
    assert np.ptp(np.degrees(true)) > 40.0
    # VQF's own bias estimate costs degrees on the way (see the plain wrapper's test); no turn is lost.
    assert np.degrees(np.abs(found - true)).max() < 5.0
    assert abs(np.degrees(found - true)[:500]).max() < 1.0


def test_vqf_on_an_urban_line_is_worse_off_with_the_magnetometer(truth):
    recording = record(truth, URBAN)
    true = truth.motion(MOUNT).loc[recording.imu.index, "yaw_rad"].to_numpy()

    def rms(estimator):
        return np.degrees(np.sqrt(np.mean((estimator.estimate(recording).states["yaw_rad"] - true) ** 2)))

    assert rms(Vqf(magnetometer=True)) > 10.0 > rms(Vqf())


def test_vqf_refuses_a_recording_without_magnetometer(truth):
    with pytest.raises(InputError, match="magnetometer"):
        Vqf(magnetometer=True).estimate(record(truth, None))


def test_vqf_with_magnetometer_keeps_the_contract(truth):
    check_estimator(Vqf(magnetometer=True), record(truth, URBAN))
