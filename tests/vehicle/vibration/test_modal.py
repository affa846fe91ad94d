"""Motion in time against the answer in the frequency domain, by M, C and K alone."""

from dataclasses import replace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.vibration.linear_model import Bending, TrackSupport, linear_vehicle
from simrail.vehicle.vibration.modal import march_modes, modes_of

STEP_S = 5e-4


@pytest.fixture(scope="module")
def linear():
    model = load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")
    return linear_vehicle(model, TrackSupport(150.0, 7e7, 1e5), bending=[Bending("body", 10.0, 0.02, 26.0)])


def marched(modes, push):
    force = np.ascontiguousarray(np.pad(push, ((2, 1), (0, 0))) @ modes.drive.T)
    state, z = (
        np.zeros(len(modes.decay), dtype=complex),
        np.empty((len(push), len(modes.decay)), dtype=complex),
    )
    march_modes(modes.decay, modes.weights, force, state, z)
    return z


@pytest.mark.parametrize("frequency_hz", [2.0, 10.0, 41.0, 100.0, 490.0])
def test_response_to_a_sine(linear, frequency_hz):
    """After it has settled, the amplitude of each coordinate is ``|H|`` times that of the held sine.

    Cubics through the samples of a sine miss it by ``3/128 (2 pi f/f_s)^4`` at most, between them.
    """
    modes = modes_of(linear, step_s=STEP_S)
    count = 60000 if frequency_hz < 20.0 else 20000
    t = STEP_S * np.arange(count)
    push = np.zeros((count, linear.input.shape[1]))
    push[:, 0] = np.sin(2.0 * np.pi * frequency_hz * t)
    z = marched(modes, push)
    periods = 10000 * STEP_S * frequency_hz  # the last 5 s hold whole periods of every frequency
    assert periods == pytest.approx(round(periods))
    tail, phase = z[-10000:], np.exp(-2j * np.pi * frequency_hz * t[-10000:])
    place = (tail @ modes.place.T).real
    found = 2j * np.mean(place * phase[:, None], axis=0)
    expected = linear.response(frequency_hz)[:, 0]
    limit = 1e-6 + 3.0 / 128.0 * (2.0 * np.pi * frequency_hz * STEP_S) ** 4
    assert np.abs(found - expected).max() < limit * np.abs(expected).max()


def test_rate_and_acceleration_are_derivatives(linear):
    """Of every coordinate, rails under the wheels included: a trapezium of one is the change of the other."""
    modes = modes_of(linear, step_s=STEP_S)
    count = 4000
    t = STEP_S * np.arange(count)
    push = np.outer(1e-4 * np.sin(2.0 * np.pi * 5.0 * t), np.ones(8))
    z = marched(modes, push)
    x, v = (z @ modes.place.T).real, (z @ modes.rate.T).real
    a = (z @ modes.acceleration.T).real + push @ modes.direct.T
    for low, high in ((x, v), (v, a)):
        # The change over a step is the mean of the slopes at its ends but for (2 pi f h)^2/12 of it, 2e-5.
        change = np.diff(low, axis=0)[1000:-1]  # the start shakes the contacts, at a quarter of the rate
        mean = 0.5 * STEP_S * (high[1:] + high[:-1])[1000:-1]
        moving = np.abs(mean).max(axis=0) > 1e-9 * np.abs(mean).max()
        off = np.abs(change - mean).max(axis=0)[moving] / np.abs(mean).max(axis=0)[moving]
        assert off.max() < 1e-3


def test_static_answer(linear):
    """All wheels lifted alike lift everything alike."""
    modes = modes_of(linear, step_s=STEP_S)
    z = -(modes.drive @ np.full(8, 1e-3)) / modes.eigenvalues
    places = (modes.place @ z).real
    heaves = [linear.row(name, 2) @ places for name in ("axle_f1", "frame_front", "body")]
    np.testing.assert_allclose(heaves, 1e-3, rtol=1e-8)


def test_unheld_motion_is_refused(linear):
    loose = replace(linear, stiffness=linear.stiffness * 0.0, damping=linear.damping * 0.0)
    with pytest.raises(InputError, match="no modal form"):
        modes_of(loose, step_s=STEP_S)
