"""Compiled evaluation of a design: cant, height and yaw with their derivatives, and the Darboux curvatures.

Everything that a design says along its line is a polynomial between two joints: yaw a parabola, cant and
height of higher order, and so is what a survey adds (`simrail.track.deviation`). Their joints are merged
here, once for a design, so that one piece holds all of them. The samples of a train that moves on stay in a
piece for many metres: its coefficients are then numbers, and the loop over the samples has no look-up.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from simrail.core.jit import FloatArray, njit, njit_borrowed, njit_inline

CANT_TERMS, HEIGHT_TERMS = 6, 8
"""A smooth ramp of cant is a quintic; the height under a bend that rises as a quintic has two powers more."""

BLOCK = 64
"""Samples worked out at a time: within a block the rows lie at distances that the compiler knows, so that it
may take several samples in one instruction."""

ROWS = 18
(
    SINE, SLOPE, YAW_ANGLE, RISE, LEVEL, FLAT,
    ROLL1, PITCH1, YAW1, ROLL2, PITCH2, YAW2, K1, K2, K3, DK1, DK2, DK3,
) = range(ROWS)  # fmt: skip
"""What `evaluate` gives: sine of roll, z', yaw, z, 1/cos roll, 1/cos pitch; first and second derivatives of
roll, pitch and yaw; Darboux curvatures and their derivatives."""


class Pieces(NamedTuple):
    """A design as polynomials about the starts of its pieces.

    Attributes
    ----------
    starts : ndarray (p,)
        Where each begins, m; the first holds before it as well, and the last to any end.
    terms : ndarray (p, 17)
        Coefficients of yaw (3), sine of roll (`CANT_TERMS`) and height (`HEIGHT_TERMS`), lowest power first.
    """

    starts: FloatArray
    terms: FloatArray


def polynomial_terms(polynomial: PPoly, places: FloatArray, count: int) -> FloatArray:
    """Coefficients (p, count), lowest power first, of a piecewise polynomial about the starts of finer ones.

    Raises
    ------
    ValueError
        If it has more of them.
    """
    if polynomial.c.shape[0] > count:
        raise ValueError(f"a polynomial of {polynomial.c.shape[0]} terms, where {count} have room")
    terms = np.zeros((len(places), count))
    for power in range(polynomial.c.shape[0]):
        terms[:, power] = polynomial(places, power) / math.factorial(power)
    return terms


def evaluate(pieces: Pieces, s: FloatArray) -> FloatArray:
    """Rows `SINE` to `DK3` (18, n) at places s (n,)."""
    out = np.empty((ROWS, len(s)))
    # Of places that may only be read it would be compiled for anew.
    _evaluate(pieces.starts, pieces.terms, np.require(s, requirements=["C", "W"]), out)
    return out


@njit
def _evaluate(starts: FloatArray, terms: FloatArray, s: FloatArray, out: FloatArray) -> None:
    """Run by run: as many samples as lie in one piece, at most `BLOCK`."""
    block, n, at, begin = np.empty(ROWS * BLOCK), s.shape[0], 0, 0
    while begin < n:
        end, at = run_of(starts, s, begin, at)
        of_piece(terms[at], starts[at], s[begin:end], block)
        for row in range(ROWS):
            for j in range(end - begin):
                out[row, begin + j] = block[row * BLOCK + j]
        begin = end


@njit_inline
def run_of(starts: FloatArray, s: FloatArray, begin: int, at: int) -> tuple[int, int]:
    """End of the run of samples from ``begin`` that lie in one piece, at most `BLOCK`, and that piece.

    ``at`` is the piece of the sample before, or 0.
    """
    place, last = s[begin], starts.shape[0] - 1
    if (at > 0 and place < starts[at]) or (at < last and place >= starts[at + 1]):
        at = max(0, np.searchsorted(starts, place, side="right") - 1)
    low = starts[at] if at > 0 else -math.inf
    high = starts[at + 1] if at < last else math.inf
    end, most = begin + 1, min(s.shape[0], begin + BLOCK)
    while end < most and low <= s[end] < high:
        end += 1
    return end, at


@njit_borrowed
def of_piece(terms: FloatArray, first: float, s: FloatArray, block: FloatArray) -> None:
    """Evaluate samples of one piece into ``block`` (18 * 64).

    With u the sine of roll, z the height, and ' for d/ds:

        roll' = u'/cos roll,         roll'' = u''/cos roll + u u'^2/cos^3 roll
        pitch' = -z''/(1 + z'^2),    pitch'' = -z'''/(1 + z'^2) + 2 z' pitch'^2
        k1 = roll' - sin(pitch) yaw'
        k2 = cos(roll) pitch' + sin(roll) cos(pitch) yaw'
        k3 = -sin(roll) pitch' + cos(roll) cos(pitch) yaw'

    (EQUATIONS section 1.1; the tests derive both from the rotation matrix.)
    """
    y0, y1, y2 = terms[0], terms[1], terms[2]
    c0, c1, c2, c3, c4, c5 = terms[3], terms[4], terms[5], terms[6], terms[7], terms[8]
    h0, h1, h2, h3, h4, h5, h6, h7 = (
        terms[9],
        terms[10],
        terms[11],
        terms[12],
        terms[13],
        terms[14],
        terms[15],
        terms[16],
    )
    for j in range(s.shape[0]):
        x = s[j] - first
        u = c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
        u1 = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
        u2 = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
        z = h0 + x * (h1 + x * (h2 + x * (h3 + x * (h4 + x * (h5 + x * (h6 + x * h7))))))
        z1 = h1 + x * (
            2.0 * h2 + x * (3.0 * h3 + x * (4.0 * h4 + x * (5.0 * h5 + x * (6.0 * h6 + x * 7.0 * h7))))
        )
        z2 = 2.0 * h2 + x * (6.0 * h3 + x * (12.0 * h4 + x * (20.0 * h5 + x * (30.0 * h6 + x * 42.0 * h7))))
        z3 = 6.0 * h3 + x * (24.0 * h4 + x * (60.0 * h5 + x * (120.0 * h6 + x * 210.0 * h7)))
        turn, turn1 = y1 + x * 2.0 * y2, 2.0 * y2
        cr = math.sqrt(1.0 - u * u)
        level = 1.0 / cr
        roll1 = u1 * level
        roll2 = u2 * level + u * u1 * u1 * level * level * level
        flat = 1.0 / (1.0 + z1 * z1)
        secant = math.sqrt(1.0 + z1 * z1)
        cp = secant * flat
        sp = -z1 * cp
        pitch1 = -z2 * flat
        pitch2 = -z3 * flat + 2.0 * z1 * pitch1 * pitch1
        across, across1 = cp * turn, cp * turn1 - sp * pitch1 * turn  # cos(pitch) yaw', and its derivative
        k2, k3 = cr * pitch1 + u * across, cr * across - u * pitch1
        block[SINE * BLOCK + j] = u
        block[SLOPE * BLOCK + j] = z1
        block[YAW_ANGLE * BLOCK + j] = y0 + x * (y1 + x * y2)
        block[RISE * BLOCK + j] = z
        block[LEVEL * BLOCK + j] = level
        block[FLAT * BLOCK + j] = secant
        block[ROLL1 * BLOCK + j] = roll1
        block[PITCH1 * BLOCK + j] = pitch1
        block[YAW1 * BLOCK + j] = turn
        block[ROLL2 * BLOCK + j] = roll2
        block[PITCH2 * BLOCK + j] = pitch2
        block[YAW2 * BLOCK + j] = turn1
        block[K1 * BLOCK + j] = roll1 - sp * turn
        block[K2 * BLOCK + j] = k2
        block[K3 * BLOCK + j] = k3
        block[DK1 * BLOCK + j] = roll2 - sp * turn1 - cp * pitch1 * turn
        block[DK2 * BLOCK + j] = cr * pitch2 + u * across1 + roll1 * k3
        block[DK3 * BLOCK + j] = cr * across1 - u * pitch2 - roll1 * k2
