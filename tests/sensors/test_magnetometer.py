"""A magnetometer against closed forms: heading, iron, currents, steel; and what they do to a heading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from estimators.ahrs import Vqf
from simrail.columns import ATTITUDE, MAGNETIC, MOTION
from simrail.errors import InputError
from simrail.measure import measure
from simrail.profile import SpeedProfile
from simrail.recording_check import check_recording
from simrail.scenario.imu_file import load_grade
from simrail.scenario.ride_reader import read_ride
from simrail.scenario.ride_writer import write_ride
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.magnetic_surroundings import (
    Steel,
    Traction,
    dipole_field,
    line_field,
    steel_field,
    structures,
    traction_field,
)
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron, sample_magnetometer
from simrail.testing import check_estimator
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.truth import Mount
from simrail.vehicle.kinematic_engine import kinematic_truth

RATE = 100.0
TIMES = pd.Index(np.arange(2000) / RATE, name="time_s")
QUIET = MagnetometerSpec(noise_tpsqrthz=0.0, bias_t=0.0)


def motion(**columns):
    frame = pd.DataFrame(0.0, index=TIMES, columns=list(MOTION))
    return frame.assign(**columns)


def sample(frame, spec, *, draw=0, name="axle", **more):
    return sample_magnetometer(frame, frame.index, spec, seed=3, draw=draw, name=name, **more)


def heading(field, roll, pitch, north_rad):
    """Tilt-compensated compass: level the field, and see how far it has turned from magnetic north."""
    x, y, z = field[list(MAGNETIC)].to_numpy().T
    y, z = np.cos(roll) * y - np.sin(roll) * z, np.sin(roll) * y + np.cos(roll) * z
    x = np.cos(pitch) * x + np.sin(pitch) * z
    return north_rad - np.arctan2(y, x)


def wrapped(angle):
    return (np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.parametrize("yaw", np.radians([0.0, 37.0, 90.0, 179.0, -120.0]))
@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.12, -0.05), (-0.3, 0.2)])
def test_heading_is_right_without_disturbance(yaw, roll, pitch):
    earth = EarthField(declination_rad=np.radians(2.5), x_axis_rad=np.radians(-31.0))
    field = sample(motion(roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw), replace(QUIET, field=earth))
    found = heading(field, roll, pitch, earth.north_rad)
    np.testing.assert_allclose(wrapped(found - yaw), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(field, axis=1), earth.intensity_t, rtol=1e-12)


def test_directions_of_the_compass():
    """X east: north on the left. X north: ahead. Declination east turns it to the right. Dip: down."""
    east = EarthField().vector_t
    level, down = 45e-6 * np.cos(np.radians(55.0)), 45e-6 * np.sin(np.radians(55.0))
    np.testing.assert_allclose(east, [0.0, level, -down], atol=1e-18)
    np.testing.assert_allclose(EarthField(x_axis_rad=0.5 * np.pi).vector_t, [level, 0.0, -down], atol=1e-18)
    turned = EarthField(x_axis_rad=0.5 * np.pi, declination_rad=0.1).vector_t
    np.testing.assert_allclose(turned[:2], [level * np.cos(0.1), -level * np.sin(0.1)], atol=1e-18)


def test_field_turns_with_the_body_as_scipy_says():
    angles = np.random.default_rng(1).uniform(-1.0, 1.0, (len(TIMES), 3))
    field = sample(motion(**dict(zip(ATTITUDE, angles.T, strict=True))), QUIET)
    attitude = Rotation.from_euler("ZYX", angles[:, ::-1])
    expected = attitude.inv().apply(QUIET.field.vector_t)
    np.testing.assert_allclose(field.to_numpy(), expected, rtol=0, atol=1e-18)


def test_hard_iron_moves_the_circle_and_soft_iron_makes_it_an_ellipse():
    yaw = 2.0 * np.pi * np.arange(len(TIMES)) / len(TIMES)
    hard, soft = (6e-6, -4e-6, 8e-6), ((0.1, 0.03, 0.0), (0.03, -0.2, 0.0), (0.0, 0.0, 0.05))
    level = QUIET.field.intensity_t * np.cos(QUIET.field.inclination_rad)
    only = sample(motion(yaw_rad=yaw), replace(QUIET, iron=VehicleIron(hard, np.zeros((3, 3)))))
    np.testing.assert_allclose(only.to_numpy()[:, :2].mean(axis=0), hard[:2], rtol=0, atol=1e-15)
    radius = np.hypot(*(only.to_numpy()[:, :2] - np.array(hard[:2])).T)
    np.testing.assert_allclose(radius, level, rtol=1e-9)
    both = sample(motion(yaw_rad=yaw), replace(QUIET, iron=VehicleIron(hard, soft))).to_numpy()[:, :2]
    np.testing.assert_allclose(both.mean(axis=0), hard[:2], rtol=0, atol=1e-15)
    # Covariance of a turning vector of length b is b^2/2; of its image, M M' b^2 / 2.
    shape = np.eye(2) + np.array(soft)[:2, :2]
    np.testing.assert_allclose(np.cov(both.T, bias=True), shape @ shape.T * level**2 / 2.0, rtol=1e-9)


@pytest.mark.parametrize(("y", "z"), [(0.0, -4.9), (2.0, 0.0), (-3.0, 4.0)])
def test_a_conductors_field_is_amperes(y, z):
    current = 630.0
    field = line_field(np.array([[y, z]]), current)[0]
    distance = np.hypot(y, z)
    assert np.linalg.norm(field) == pytest.approx(
        4e-7 * np.pi * current / (2.0 * np.pi * distance), rel=1e-12
    )
    # Right-hand rule about +X: e_x x away.
    np.testing.assert_allclose(
        field / np.linalg.norm(field), np.cross([1.0, 0.0, 0.0], [0.0, y, z]) / distance, atol=1e-12
    )


def test_a_conductors_circulation_is_mu0_times_current():
    around = np.linspace(0.0, 2.0 * np.pi, 2001)
    path = np.column_stack([1.0 + 2.0 * np.cos(around), 0.3 + 2.0 * np.sin(around)])
    field = line_field(path, 100.0)[:, 1:]
    middle = 0.5 * (field[1:] + field[:-1])
    assert np.sum(middle * np.diff(path, axis=0)) == pytest.approx(4e-7 * np.pi * 100.0, rel=1e-4)


def test_return_current_closes_the_loop():
    """No net current: far away the field falls off faster than that of one conductor (1/d^2)."""
    traction = Traction(share=1.0)
    near, far = (
        np.linalg.norm(traction_field(np.array([[d, 0.0]]), traction, np.array([500.0]))[0])
        for d in (300.0, 600.0)
    )
    assert far / near == pytest.approx(0.25, rel=0.03)
    # In the middle between the rails their fields cancel; what is left is the wire's.
    middle = traction_field(np.array([[0.0, 0.0]]), traction, np.array([500.0]))[0]
    np.testing.assert_allclose(middle, [0.0, 2e-7 * 500.0 / 5.5, 0.0], atol=1e-18)
    third = traction_field(np.array([[0.0, 0.0]]), replace(traction, supply="third_rail"), np.array([500.0]))[
        0
    ]
    assert np.linalg.norm(third) == pytest.approx(2e-7 * 500.0 / np.hypot(1.4, 0.15), rel=1e-12)
    half = traction_field(np.array([[0.0, 0.6]]), Traction(), np.array([500.0]))
    np.testing.assert_allclose(
        2.0 * half, traction_field(np.array([[0.0, 0.6]]), traction, np.array([500.0]))
    )


def test_line_current_is_power_over_voltage():
    traction = Traction(voltage_v=750.0, efficiency=0.8, auxiliary_w=15e3, mass_kg=40e3, resistance_n=2000.0)
    speed, acceleration = np.array([0.0, 10.0, 10.0, 10.0]), np.array([0.0, 1.0, 0.0, -1.0])
    expected = (
        np.array([0.0, (40e3 + 2e3) * 10 / 0.8, 2e3 * 10 / 0.8, -(40e3 - 2e3) * 10 * 0.8]) + 15e3
    ) / 750.0
    np.testing.assert_allclose(traction.current_a(speed, acceleration), expected, rtol=1e-12)
    # The mirrored ride draws the same.
    np.testing.assert_allclose(traction.current_a(-speed, -acceleration), expected, rtol=1e-12)
    braking = replace(traction, regenerative=False).current_a(speed[3:], acceleration[3:])
    assert braking == pytest.approx(20.0)


def test_currents_and_steel_are_seen_from_the_leaning_body():
    """The track's disturbance comes in the track frame, whatever the track's own heading."""
    frame = motion(
        yaw_rad=1.0, roll_rad=0.3, relative_roll_rad=0.2, relative_yaw_rad=-0.1, vertical_m=0.6,
        speed_mps=10.0, acceleration_mps2=1.0,
    )  # fmt: skip
    traction = Traction()
    extra = sample(frame, replace(QUIET, traction=traction)) - sample(frame, QUIET)
    current = traction.current_a(np.array([10.0]), np.array([1.0]))
    there = traction_field(np.array([[0.0, 0.6]]), traction, current)[0]
    expected = Rotation.from_euler("ZYX", [-0.1, 0.0, 0.2]).inv().apply(there)
    np.testing.assert_allclose(extra.iloc[0].to_numpy(), expected, rtol=0, atol=1e-17)


def test_a_dipoles_field_is_the_textbooks():
    moment = np.array([0.0, 0.0, 1000.0])
    axial = dipole_field(np.array([[0.0, 0.0, 2.0]]), moment)[0]
    beside = dipole_field(np.array([[2.0, 0.0, 0.0]]), moment)[0]
    np.testing.assert_allclose(axial, [0.0, 0.0, 1e-7 * 2.0 * 1000.0 / 8.0], rtol=1e-12)
    np.testing.assert_allclose(beside, [0.0, 0.0, -1e-7 * 1000.0 / 8.0], rtol=1e-12)


def test_steel_belongs_to_the_track():
    steel = Steel(track_seed=7)
    found = structures(steel, (0.0, 20_000.0))
    # Poisson: count, and exponential gaps; 1 in 1000 either side.
    low, high = stats.poisson.ppf([0.0005, 0.9995], 1000)
    assert low <= len(found) <= high
    assert stats.kstest(np.diff(found[:, 0]) / steel.spacing_m, "expon").pvalue > 0.001
    assert stats.kstest(found[:, 3:].ravel() / steel.moment_sd_am2, "norm").pvalue > 0.001
    assert (np.abs(found[:, 1]) >= 1.8).all() and (np.abs(found[:, 1]) <= 4.0).all()
    # A longer track begins with the structures of the shorter; another seed has others.
    np.testing.assert_array_equal(structures(steel, (0.0, 5000.0)), found[found[:, 0] < 5000.0])
    assert len(structures(Steel(track_seed=8), (0.0, 20_000.0))) != len(found)
    # Every pass meets the same, at any speed, in both directions, by any sensor.
    out = np.linspace(100.0, 300.0, 2000)
    spec = replace(QUIET, steel=steel)
    there = sample(motion(position_m=out), spec, track_m=(0.0, 500.0)).to_numpy()
    again = sample(motion(position_m=out[::-1]), spec, draw=5, name="other", track_m=(0.0, 500.0)).to_numpy()
    np.testing.assert_array_equal(there, again[::-1])
    assert np.ptp(there, axis=0).max() > 5e-6


def test_far_structures_are_left_out_only_where_they_are_nothing():
    steel = Steel(track_seed=7)
    position = np.linspace(100.0, 300.0, 500)
    place = np.broadcast_to([0.0, 0.6], (500, 2))
    whole = np.zeros((500, 3))
    for s, y, z, *moment in structures(steel, (0.0, 500.0)):
        whole += dipole_field(np.column_stack([position - s, place - [y, z]]), np.array(moment))
    assert np.abs(steel_field(position, place, steel, (0.0, 500.0)) - whole).max() < 20e-9


def test_noise_and_bias_have_the_size_they_are_given():
    long = pd.DataFrame(0.0, index=pd.Index(np.arange(40_000) / 50.0, name="time_s"), columns=list(MOTION))
    spec = MagnetometerSpec(noise_tpsqrthz=10e-9, bias_t=300e-9)
    field = sample(long, spec).to_numpy() - QUIET.field.vector_t
    assert field.std(axis=0, ddof=1) == pytest.approx([10e-9 * np.sqrt(50.0)] * 3, rel=4.0 / np.sqrt(80_000))
    correlation = np.corrcoef(field.T)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4.0 / np.sqrt(40_000)
    short = motion().iloc[:2]
    means = np.array([sample(short, replace(QUIET, bias_t=300e-9), draw=d).iloc[0] for d in range(300)])
    uniform = (means - QUIET.field.vector_t).ravel() / 300e-9
    assert stats.kstest(uniform, stats.uniform(-1.0, 2.0).cdf).pvalue > 0.001


def test_range_and_resolution():
    coarse = sample(motion(), replace(QUIET, resolution_t=1e-7)).to_numpy() / 1e-7
    np.testing.assert_allclose(coarse, np.rint(coarse), rtol=0, atol=1e-9)
    clipped = sample(motion(), replace(QUIET, range_t=10e-6)).to_numpy()
    assert np.abs(clipped).max() == 10e-6


# In a recording.

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
    return measure(truth, magnetometer=magnetometer, **settings)


def heading_error_deg(truth, recording):
    true = truth.motion(MOUNT).loc[recording.imu.index]
    found = heading(
        recording.magnetometer,
        true["roll_rad"].to_numpy(),
        true["pitch_rad"].to_numpy(),
        recording.magnetometer_sheet.north_rad,
    )
    return np.degrees(wrapped(found - true["yaw_rad"].to_numpy()))


def test_a_clean_field_gives_the_heading_to_noise(truth):
    spec = replace(URBAN, iron=None, traction=None, steel=None, bias_t=0.0)
    error = heading_error_deg(truth, record(truth, spec))
    level = spec.field.intensity_t * np.cos(spec.field.inclination_rad)
    sd = np.degrees(spec.noise_tpsqrthz * np.sqrt(250.0) / level)
    # Leaned by 0.06 rad at most, the steep part of the field takes part: a few per cent.
    assert error.std() == pytest.approx(sd, rel=0.05)
    assert abs(error.mean()) < 5.0 * sd / np.sqrt(len(error))


def test_on_an_urban_line_it_errs_by_tens_of_degrees(truth):
    error = heading_error_deg(truth, record(truth, URBAN))
    assert 15.0 < np.sqrt(np.mean(error**2)) < 100.0
    for part in ("iron", "traction", "steel"):
        alone = replace(URBAN, **{name: None for name in ("iron", "traction", "steel") if name != part})
        assert np.sqrt(np.mean(heading_error_deg(truth, record(truth, alone)) ** 2)) > 3.0, part


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


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        (replace(QUIET, field=EarthField(intensity_t=45.0)), ["intensity_t", "45.0", "tesla"]),
        (replace(QUIET, field=EarthField(inclination_rad=55.0)), ["inclination_rad", "55.0"]),
        (replace(QUIET, noise_tpsqrthz=-1.0), ["noise_tpsqrthz", "-1.0", ">= 0"]),
        (replace(QUIET, range_t=0.0), ["range_t", "> 0"]),
        (replace(QUIET, iron=VehicleIron(soft_iron=((-2.0, 0, 0), (0, 0, 0), (0, 0, 0)))), ["soft_iron"]),
        (replace(QUIET, traction=Traction(voltage_v=0.0)), ["traction.voltage_v", "> 0"]),
        (replace(QUIET, traction=Traction(efficiency=1.2)), ["traction.efficiency", "1.2"]),
        (replace(QUIET, traction=Traction(auxiliary_w=float("nan"))), ["traction.auxiliary_w", "nan"]),
        (replace(QUIET, steel=Steel(1, spacing_m=0.0)), ["steel.spacing_m", ">= 1 m"]),
        (replace(QUIET, steel=Steel(1, beside_m=(0.0, 3.0))), ["steel.beside_m", "1.5 m"]),
    ],
)
def test_impossible_magnetometers_are_refused(spec, words):
    with pytest.raises(InputError) as caught:
        sample(motion(), spec)
    assert all(word in str(caught.value) for word in words), str(caught.value)


# In VQF.


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
