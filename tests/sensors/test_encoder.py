"""Pulses against closed forms."""

import numpy as np
import pytest
from scipy import stats

from simrail.errors import InputError
from simrail.sensors.encoder import EncoderSpec, nominal_radius, sample_encoder

TIME = np.arange(60_001) / 1000.0


def sample(angle, **more):
    settings = {"pulses_per_revolution": 1024, "rate_hz": 250.0, "seed": 5, "draw": 0} | more
    return sample_encoder(angle, TIME[: len(angle)], **settings)


def recovered_phase(draw: int) -> float:
    """Phase of the encoder, from where a slowly turning wheel passes its first edge."""
    slow = TIME / TIME[-1] * 2.0 * np.pi / 1024
    counts = sample(slow, draw=draw, rate_hz=1000.0)["pulse_count"].to_numpy()
    return 1.0 - np.argmax(counts == 1) / (len(TIME) - 1)


@pytest.mark.parametrize("direction", (1.0, -1.0))
def test_counts_are_exact_for_a_ride_in_closed_form(direction):
    angle = direction * (3.0 * TIME + 0.4 * TIME**2)
    frame = sample(angle)
    phase = recovered_phase(0)
    edges = angle[::4] * 1024 / (2.0 * np.pi) + phase
    clear = np.abs(edges - np.rint(edges)) > 1e-4
    assert clear.mean() > 0.99
    np.testing.assert_array_equal(frame["pulse_count"].to_numpy()[clear], np.floor(edges)[clear])
    np.testing.assert_array_equal(frame.index, TIME[::4])
    assert frame["pulse_count"].iloc[0] == 0
    assert frame["pulse_count"].dtype == np.int64


def test_counts_go_down_backwards_and_return():
    angle = -5.0 * np.sin(2.0 * np.pi * TIME / TIME[-1])
    counts = sample(angle)["pulse_count"]
    assert counts.min() == pytest.approx(-5.0 * 1024 / (2.0 * np.pi), abs=1.0)
    assert abs(counts.iloc[-1]) <= 1


def test_phase_is_uniform_over_draws():
    phases = [recovered_phase(draw) for draw in range(200)]
    assert stats.kstest(phases, "uniform").pvalue > 0.01


def test_a_standing_wheel_gives_no_pulses():
    assert (sample(np.full(5000, 1.234))["pulse_count"] == 0).all()


def test_radius_error_is_drawn_or_fixed():
    spec = EncoderSpec("front.left", radius_error_sd=1e-3)
    errors = np.array([nominal_radius(0.29, spec, seed=1, draw=draw) / 0.29 - 1.0 for draw in range(1000)])
    assert errors.std() == pytest.approx(1e-3, rel=0.08)
    assert stats.kstest(errors / 1e-3, "norm").pvalue > 0.01
    other = EncoderSpec("rear.left", radius_error_sd=1e-3)
    assert nominal_radius(0.29, other, seed=1, draw=0) != nominal_radius(0.29, spec, seed=1, draw=0)
    fixed = EncoderSpec("front.left", radius_error_sd=1e-3, radius_error=-0.005)
    assert nominal_radius(0.29, fixed, seed=1, draw=7) == pytest.approx(0.28855, rel=1e-12)


def test_bad_encoders_are_refused():
    with pytest.raises(InputError, match="pulses"):
        sample(TIME, pulses_per_revolution=0)
    with pytest.raises(InputError, match="does not divide"):
        sample(TIME, rate_hz=300.0)
