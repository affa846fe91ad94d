"""Wheels out of round: each order has the amplitude that was drawn for it."""

import numpy as np
import pytest

from simrail.vehicle.vibration.wheels import OutOfRound, drawn_orders, wheel_surface


def test_orders_are_those_drawn():
    shape = OutOfRound(amplitude_m=60e-6, exponent=1.3, spread=0.4, orders=20)
    amplitudes, phases = drawn_orders(shape, "f1.left", seed=3)
    angle = 2.0 * np.pi * np.arange(4096) / 4096 - 100.0
    lines = np.fft.rfft(wheel_surface(shape, "f1.left", seed=3).height(angle)) / 2048
    # A cubic spline with 51 knots on the shortest wave is right to (2 pi/51)^4/720.
    np.testing.assert_allclose(np.abs(lines[1:21]), amplitudes, rtol=1e-5)
    # The first sample lies at -100 rad: order n has turned by n times as much.
    turned = np.angle(lines[1:21] * np.exp(1j * (100.0 * np.arange(1, 21) - phases)))
    np.testing.assert_allclose(turned, 0.0, atol=1e-5)
    assert np.abs(lines[0]) < 1e-10


def test_amplitudes_fall_with_the_order_as_told():
    """Median over many wheels, by its own standard error: 1.25 spread / sqrt(n)."""
    shape = OutOfRound(amplitude_m=60e-6, exponent=1.3, spread=0.4, orders=5)
    drawn = np.array([drawn_orders(shape, f"wheel {i}", seed=1)[0] for i in range(400)])
    expected = 60e-6 * np.arange(1.0, 6.0) ** -1.3
    off = np.log(np.median(drawn, axis=0) / expected)
    assert np.abs(off).max() < 4.0 * 1.25 * 0.4 / np.sqrt(400)
    sd = np.std(np.log(drawn), axis=0)
    assert np.abs(sd / 0.4 - 1.0).max() < 4.0 / np.sqrt(800)


@pytest.mark.long
def test_each_wheel_by_itself():
    shape = OutOfRound()
    _, left = drawn_orders(shape, "f1.left", seed=3)
    _, right = drawn_orders(shape, "f1.right", seed=3)
    assert np.abs(left - right).min() > 1e-6
    more, _ = drawn_orders(OutOfRound(orders=5), "f1.left", seed=3)
    np.testing.assert_array_equal(more, drawn_orders(shape, "f1.left", seed=3)[0][:5])
