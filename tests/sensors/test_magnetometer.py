"""A magnetometer against closed forms: heading, iron, the body that leans, noise, range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from simrail.core.columns import ATTITUDE, MOTION
from simrail.core.errors import InputError
from simrail.sensors.magnetic_surroundings import (
    Steel,
    Traction,
    structures,
    traction_field,
)
from simrail.sensors.magnetometer import EarthField, MagnetometerSpec, VehicleIron, sample_magnetometer

RATE = 100.0
TIMES = pd.Index(np.arange(2000) / RATE, name="time_s")
QUIET = MagnetometerSpec(noise_tpsqrthz=0.0, bias_t=0.0)


def motion(**columns):
    frame = pd.DataFrame(0.0, index=TIMES, columns=list(MOTION))
    return frame.assign(**columns)


def sample(frame, spec, *, draw=0, name="axle", **more):
    return sample_magnetometer(frame, frame.index, spec, seed=3, draw=draw, name=name, **more)


@pytest.mark.parametrize("yaw", np.radians([0.0, 37.0, 90.0, 179.0, -120.0]))
@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.12, -0.05), (-0.3, 0.2)])
def test_heading_is_right_without_disturbance(heading_error, yaw, roll, pitch):
    earth = EarthField(declination_rad=np.radians(2.5), x_axis_rad=np.radians(-31.0))
    field = sample(motion(roll_rad=roll, pitch_rad=pitch, yaw_rad=yaw), replace(QUIET, field=earth))
    error = heading_error(field, roll, pitch, yaw, north_rad=earth.north_rad)
    np.testing.assert_allclose(error, 0.0, atol=1e-12)
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


def test_soft_iron_takes_the_field_of_one_axis_to_another():
    """Its row is what is felt, its column what is there: b = (1 + M) b0, by hand for one entry."""
    iron = VehicleIron((0.0, 0.0, 0.0), ((0.0, 0.1, 0.0), (0.0, 0.0, 0.0), (0.0, -0.2, 0.0)))
    bare = sample(motion(yaw_rad=0.4), QUIET).to_numpy()
    felt = sample(motion(yaw_rad=0.4), replace(QUIET, iron=iron)).to_numpy()
    along = bare[:, 1]
    expected = bare + np.column_stack([0.1 * along, np.zeros_like(along), -0.2 * along])
    np.testing.assert_allclose(felt, expected, rtol=0, atol=1e-18)


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
    # Each axis has its own.
    assert np.abs(np.corrcoef(means.T)[np.triu_indices(3, 1)]).max() < 4.0 / np.sqrt(300)


def test_range_and_resolution():
    coarse = sample(motion(), replace(QUIET, resolution_t=1e-7)).to_numpy() / 1e-7
    np.testing.assert_allclose(coarse, np.rint(coarse), rtol=0, atol=1e-9)
    # To the nearest count, what is measured with its noise.
    noisy = [
        sample(motion(), replace(QUIET, noise_tpsqrthz=1e-8, resolution_t=t)).to_numpy() for t in (0.0, 1e-7)
    ]
    assert np.abs(noisy[1] - noisy[0]).max() <= 0.5e-7 * (1.0 + 1e-9)
    clipped = sample(motion(), replace(QUIET, range_t=10e-6)).to_numpy()
    assert np.abs(clipped).max() == 10e-6


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
