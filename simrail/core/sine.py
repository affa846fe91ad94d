"""Sine and cosine in plain arithmetic, so that a compiler may work out several at once.

A library's sine is a call, which no loop over lanes survives. This one is the Taylor series on an eighth of a
turn, after the quarters are taken off (Cody and Waite's way: pi/2 in three parts, of which the first two,
times a whole number, are exact): within 2 units in the last place of the larger of the two up to 1e4 rad.
"""

import math

import numpy as np

from simrail.core.jit import njit_inline

_PER_QUARTER = 2.0 / math.pi
_QUARTER = (1.5707963109016418, 1.5893254712295857e-08, 6.123233995736766e-17)
"""pi/2 in parts of 26 and 27 bits, and what a float64 of pi/2 lacks."""
_EIGHTH = 0.785
"""A little less than pi/4: of such an angle the whole number of quarters is 0."""


@njit_inline
def sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle, rad."""
    # Without whole quarters there is nothing to take off. One angle alone takes this branch and need not wait
    # for what comes to nothing; a loop over several takes none. The bits are the same.
    if abs(angle) < _EIGHTH:
        return _on_eighth(angle)
    quarters = np.floor(angle * _PER_QUARTER + 0.5)
    sine, cosine = _on_eighth(
        angle - quarters * _QUARTER[0] - quarters * _QUARTER[1] - quarters * _QUARTER[2]
    )
    quarter = quarters - 4.0 * np.floor(0.25 * quarters)
    is_odd = quarter == 1.0 or quarter == 3.0
    a, b = (cosine, sine) if is_odd else (sine, cosine)
    return (-a if quarter >= 2.0 else a), (-b if 1.0 <= quarter <= 2.0 else b)


@njit_inline
def _on_eighth(x: float) -> tuple[float, float]:
    """Sine and cosine where x is at most an eighth of a turn.

    Coefficients are 1/3!, 1/5! ... and 1/2!, 1/4! ...; what follows is below 1e-18. In pairs, and pairs of
    these (Estrin's way): none waits for the one before.
    """
    y = x * x
    z = y * y
    w = z * z
    low = (-1.0 / 6.0 + y * (1.0 / 120.0)) + z * (-1.0 / 5040.0 + y * (1.0 / 362880.0))
    high = (-1.0 / 39916800.0 + y * (1.0 / 6227020800.0)) + z * (
        -1.0 / 1307674368000.0 + y * (1.0 / 355687428096000.0)
    )
    sine = x + x * y * (low + w * high)
    low = (1.0 / 24.0 + y * (-1.0 / 720.0)) + z * (1.0 / 40320.0 + y * (-1.0 / 3628800.0))
    high = (1.0 / 479001600.0 + y * (-1.0 / 87178291200.0)) + z * (1.0 / 20922789888000.0)
    return sine, 1.0 - 0.5 * y + z * (low + w * high)
