"""Running safety against closed forms: filters, means over distance, limits, percentiles."""

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.scoring.running_safety import (
    TRACK_SHIFT_FACTOR,
    WheelForces,
    estimated_maximum,
    greatest_percentile,
    low_pass,
    prudhomme_limit_n,
    safety_series,
    section_percentiles,
    sliding_mean,
    travelled,
)
from simrail.vehicle.engines.derailment import nadal_limit

RATE_HZ = 1000.0


def test_nadals_limit_is_the_balance_of_forces_on_a_flange():
    """A wheel about to climb: N and mu N on a plane at the angle a carry Y and Q."""
    for angle_deg, friction in ((70.0, 0.36), (60.0, 0.5), (75.0, 0.1)):
        a = np.deg2rad(angle_deg)
        normal = 1.0
        y = normal * np.sin(a) - friction * normal * np.cos(a)
        q = normal * np.cos(a) + friction * normal * np.sin(a)
        assert nadal_limit(a, friction) == pytest.approx(y / q, rel=1e-12)
    # 1.2 of a flange of 70 degrees at 0.36 is the limit of EN 14363, 6.1 (from memory).
    assert nadal_limit(np.deg2rad(70.0), 0.36) == pytest.approx(1.2, abs=5e-4)
    assert nadal_limit(np.deg2rad(75.0), 0.5) == pytest.approx(1.13, abs=5e-3)


def test_prudhommes_limit():
    """10 kN + 2 Q0/3: an axle of 180 kN bears 70 kN of lateral force, a wagon's 59.5 kN."""
    assert prudhomme_limit_n(180e3) == pytest.approx(70e3)
    assert prudhomme_limit_n(180e3, factor=TRACK_SHIFT_FACTOR["freight"]) == pytest.approx(59.5e3)


@pytest.mark.parametrize("rate_hz", [1000.0, 200.0])
def test_the_low_pass_lets_half_the_power_through_at_20_hz(rate_hz):
    time = np.arange(0.0, 20.0, 1.0 / rate_hz)

    def gain(frequency_hz):
        wave = np.sin(2.0 * np.pi * frequency_hz * time)
        inner = slice(len(time) // 4, -len(time) // 4)
        filtered = low_pass(wave, rate_hz)[inner]
        # No shift of place: the filtered wave is the wave, times a number.
        factor = float(filtered @ wave[inner] / (wave[inner] @ wave[inner]))
        np.testing.assert_allclose(filtered, factor * wave[inner], atol=1e-6)
        return factor

    assert gain(20.0) == pytest.approx(np.sqrt(0.5), rel=1e-6)
    # Bilinear transform: |H|^2 falls with the fourth power of tan(pi f/rate), 24 dB per octave.
    ratio = np.tan(np.pi * 40.0 / rate_hz) / np.tan(np.pi * 20.0 / rate_hz)
    assert gain(40.0) == pytest.approx(1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * ratio**4), rel=1e-6)
    assert gain(2.0) == pytest.approx(1.0, abs=1e-4)


def test_a_rate_that_is_too_low_is_refused():
    with pytest.raises(InputError, match="too low for forces"):
        low_pass(np.zeros(100), 50.0)


def test_a_sliding_mean_of_a_parabola_over_distance():
    """Mean of s^2 over 2 m is s^2 + 1/3, however the speed varies; of samples in time it is not."""
    time = np.linspace(0.0, 1.0, 20_001)
    distance = 60.0 * time**2  # from rest: the samples lie dense at the beginning
    middle, mean = sliding_mean(distance, distance**2)
    np.testing.assert_allclose(middle, 1.0 + 0.5 * np.arange(len(middle)), atol=1e-9)
    assert middle[-1] == pytest.approx(59.0)
    np.testing.assert_allclose(mean, middle**2 + 1.0 / 3.0, atol=1e-4)


def test_a_sliding_mean_is_exact_between_samples():
    """Of what is linear between samples 1.5 m apart, integrated by hand."""
    middle, mean = sliding_mean(np.array([0.0, 1.5, 3.0]), np.array([0.0, 3.0, 0.0]))
    np.testing.assert_allclose(middle, [1.0, 1.5, 2.0])
    np.testing.assert_allclose(mean, [1.75, 2.0, 1.75], rtol=1e-12)  # (2.25 + 1.25)/2, (4.5 - 0.5)/2


def test_standing_and_running_back_count_as_distance_travelled():
    position = np.array([10.0, 10.0, 10.0, 8.0, 6.0])
    np.testing.assert_allclose(travelled(position), [0.0, 0.0, 0.0, 2.0, 4.0])
    mean = sliding_mean(travelled(position), np.array([9.0, 9.0, 1.0, 1.0, 1.0]))[1]
    np.testing.assert_allclose(mean, 1.0)
    assert len(sliding_mean(np.array([0.0, 1.0]), np.array([1.0, 1.0]))[0]) == 0


def test_percentiles_are_of_either_side():
    values = np.linspace(-3.0, 1.0, 4001)
    # The 0.15 % percentile of an even spread over 4 is 0.006 above its lower end.
    assert greatest_percentile(values) == pytest.approx(2.994, abs=1e-9)


def test_sections_and_the_estimated_maximum():
    distance = np.arange(0.0, 500.0, 0.5)
    values = np.where(distance < 250.0, 1.0, 3.0)
    sections = section_percentiles(distance, values, 100.0)
    np.testing.assert_allclose(sections, [1.0, 1.0, 3.0, 3.0])
    # Mean 2, and 3 times the standard deviation of (1, 1, 3, 3), which is sqrt(4/3).
    assert estimated_maximum(sections) == pytest.approx(2.0 + 3.0 * np.sqrt(4.0 / 3.0))
    with pytest.raises(ValueError, match="two sections"):
        estimated_maximum(sections[:1])


def forces(position, *, lateral_left, lateral_right, load_left=50e3, load_right=50e3):
    """An axle whose forces are constant."""
    ones = np.ones(len(position))
    return [
        WheelForces("front.left", 50e3, load_left * ones, lateral_left * ones),
        WheelForces("front.right", 50e3, load_right * ones, lateral_right * ones),
    ]


def test_a_steady_curve():
    """Constant forces: quotient, sum and unloading by hand."""
    position = np.linspace(0.0, 40.0, 4001)
    wheels = forces(position, lateral_left=20e3, lateral_right=-5e3, load_left=60e3, load_right=40e3)
    (axle,) = safety_series(wheels, position, rate_hz=RATE_HZ)
    assert axle.wheels == ("front.left", "front.right")
    np.testing.assert_allclose(axle.derailment_quotient[0], 1.0 / 3.0, rtol=1e-9)
    np.testing.assert_allclose(axle.derailment_quotient[1], -0.125, rtol=1e-9)
    np.testing.assert_allclose(axle.sum_y_n, 15e3, rtol=1e-9)
    np.testing.assert_allclose(axle.unloading, [[-0.2] * 4001, [0.2] * 4001], rtol=1e-9)


def test_a_short_blow_is_spread_over_two_metres():
    """A lateral blow of 1 kN s on one wheel, at 10 m/s: 1 kN s . 10 m/s / 2 m in windows around it."""
    position = np.arange(0.0, 60.0, 0.01)
    wheels = forces(position, lateral_left=0.0, lateral_right=0.0)
    wheels[0].lateral_n[2995:3005] = 1e3 / (10 / RATE_HZ)
    (axle,) = safety_series(wheels, position, rate_hz=RATE_HZ)
    # Its low-passed trace is some 0.05 s, 0.5 m, long: windows whose ends are 0.7 m off hold it all.
    inside = np.abs(axle.middle_m - 30.0) < 0.3
    np.testing.assert_allclose(axle.sum_y_n[inside], 1e3 * 10.0 / 2.0, rtol=0.02)
    assert np.abs(axle.sum_y_n[np.abs(axle.middle_m - 30.0) > 2.0]).max() < 50.0


def test_a_wheel_that_carries_nothing_has_no_quotient():
    position = np.linspace(0.0, 40.0, 4001)
    wheels = forces(position, lateral_left=0.0, lateral_right=0.0, load_left=0.0)
    (axle,) = safety_series(wheels, position, rate_hz=RATE_HZ)
    assert np.all(axle.derailment_quotient == 0.0)
    np.testing.assert_allclose(axle.unloading[0], 1.0)
