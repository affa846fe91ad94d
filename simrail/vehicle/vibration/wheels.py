"""Wheels that are out of round: their radius over the angle, by orders.

Order n is a wave that goes n times around the wheel, ``a_n cos(n angle + p_n)``, with an amplitude of its own
and an even phase for each wheel. Figures are synthetic: amplitudes fall with the order as ``a n^-e``, which
run-outs of some tenths of a millimetre and polygons of some ten micrometres suggest.
"""

from dataclasses import dataclass

import numpy as np

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.track.rail_surface import spline_at

_POINTS = 1024
"""Points around a wheel: 51 on the shortest wave of order 20."""


@dataclass(frozen=True)
class OutOfRound:
    """Out-of-roundness of all wheels.

    Attributes
    ----------
    amplitude_m : float
        Median amplitude of order 1.
    exponent : float
        Amplitudes fall as order to the power of minus this.
    spread : float
        Standard deviation of the logarithm of an amplitude, each wheel's and order's by itself.
    orders : int
        Highest order.
    """

    amplitude_m: float = 60e-6
    exponent: float = 1.3
    spread: float = 0.4
    orders: int = 20


def drawn_orders(shape: OutOfRound, wheel: str, *, seed: int) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (orders,), m, and phases (orders,), rad, of a wheel."""
    generator = stream(seed, "wheels", "out_of_round", wheel)
    drawn = np.array([(generator.standard_normal(), generator.uniform()) for _ in range(shape.orders)])
    n: FloatArray = np.arange(1.0, shape.orders + 1.0)
    amplitudes: FloatArray = shape.amplitude_m * n**-shape.exponent * np.exp(shape.spread * drawn[:, 0])
    return amplitudes, 2.0 * np.pi * drawn[:, 1]


@dataclass(frozen=True, eq=False)
class WheelSurface:
    """Deviation of a wheel's radius over its angle.

    Attributes
    ----------
    coefficients : ndarray (n,)
        Of a periodic cubic B-spline, with three points more at either end.
    """

    coefficients: FloatArray

    def height(self, angle_rad: FloatArray) -> FloatArray:
        """Deviation (n,), m, of the radius that touches the rail at angles (n,) of the wheel."""
        turned: FloatArray = np.ascontiguousarray(np.mod(angle_rad, 2.0 * np.pi))
        out = np.empty(len(turned))
        step = 2.0 * np.pi / _POINTS
        spline_at(self.coefficients, -3.0 * step, step, turned, out)
        return out


def wheel_surface(shape: OutOfRound, wheel: str, *, seed: int) -> WheelSurface:
    """Draw the surface of a wheel."""
    amplitudes, phases = drawn_orders(shape, wheel, seed=seed)
    n = np.arange(1, shape.orders + 1)
    # The coefficients of a wave are the wave over what the spline makes of them at its knots.
    passed = (2.0 + np.cos(2.0 * np.pi * n / _POINTS)) / 3.0
    angle = 2.0 * np.pi * np.arange(-3, _POINTS + 4) / _POINTS
    waves = np.cos(angle[:, None] * n + phases)
    return WheelSurface(np.ascontiguousarray(waves @ (amplitudes / passed)))
