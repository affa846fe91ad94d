"""Compiled loop of the track-frame compensation: how the track frame moves (EQUATIONS 1.1, 2.1).

Block by block, for the reason that `simrail.track.frame_kernel` gives.
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit, njit_borrowed

BLOCK = 64
"""Samples worked out at a time."""

GIVEN = 10
"""Rows of what is known of each sample: k, its derivative, pitch', tan pitch, speed and its rate."""

MOTION = 12
"""Rows of what comes of it: acceleration of the origin, what is added per m of y and of z, angular rate."""


class Course(NamedTuple):
    """The track frame under a train, and how fast it passes, n samples.

    Attributes
    ----------
    k, dk : ndarray (3, n)
        Darboux curvatures, 1/m, and their derivatives by s.
    pitch_rate, tangent : ndarray (n,)
        d pitch/ds, tan pitch.
    speed, speed_rate : ndarray (n,)
        m/s and m/s2, signed.
    """

    k: FloatArray
    dk: FloatArray
    pitch_rate: FloatArray
    tangent: FloatArray
    speed: FloatArray
    speed_rate: FloatArray


@njit
def frame_motion(course: Course, out: FloatArray) -> None:
    """Motion of the track frame (12, n): `simrail.estimators.attitude.compensation.track_motion`."""
    given, found = np.zeros(GIVEN * BLOCK), np.empty(MOTION * BLOCK)
    n = course.speed.shape[0]
    for begin in range(0, n, BLOCK):
        count = min(BLOCK, n - begin)
        _gather(course, begin, count, given)
        _block_motion(given, found)
        for row in range(MOTION):
            for j in range(count):
                out[row, begin + j] = found[row * BLOCK + j]


@njit
def force_less_motion(course: Course, signals: FloatArray, y: float, z: float, force: FloatArray) -> None:
    """Specific force less the acceleration of a place (0, y, z) of the frame.

    Parameters
    ----------
    course : Course
    signals : ndarray (n, 3)
        Specific force, m/s2.
    y, z : float
        m.
    force : ndarray (n, 3), out
    """
    given, found = np.zeros(GIVEN * BLOCK), np.empty(MOTION * BLOCK)
    n = course.speed.shape[0]
    for begin in range(0, n, BLOCK):
        count = min(BLOCK, n - begin)
        _gather(course, begin, count, given)
        _block_motion(given, found)
        for axis in range(3):
            at = axis * BLOCK
            for j in range(count):
                moved = found[at + j] + y * found[3 * BLOCK + at + j] + z * found[6 * BLOCK + at + j]
                force[begin + j, axis] = signals[begin + j, axis] - moved


@njit_borrowed
def _gather(course: Course, begin: int, count: int, given: FloatArray) -> None:
    """Put samples into a block; what is left of it stays as it was, and is worked out in vain."""
    k, dk, pitch_rate, tangent, speed, speed_rate = course
    for row in range(3):
        for j in range(count):
            given[row * BLOCK + j] = k[row, begin + j]
        for j in range(count):
            given[(3 + row) * BLOCK + j] = dk[row, begin + j]
    for j in range(count):
        given[6 * BLOCK + j] = pitch_rate[begin + j]
        given[7 * BLOCK + j] = tangent[begin + j]
        given[8 * BLOCK + j] = speed[begin + j]
        given[9 * BLOCK + j] = speed_rate[begin + j]


@njit_borrowed
def _block_motion(given: FloatArray, found: FloatArray) -> None:
    """A whole block, whether all of it is wanted or not."""
    for j in range(BLOCK):
        t, v, h = given[j], given[BLOCK + j], given[2 * BLOCK + j]
        t1, v1, h1 = given[3 * BLOCK + j], given[4 * BLOCK + j], given[5 * BLOCK + j]
        tangent, speed, rate = given[7 * BLOCK + j], given[8 * BLOCK + j], given[9 * BLOCK + j]
        secant, stretch = math.sqrt(1.0 + tangent * tangent), tangent * given[6 * BLOCK + j]
        square = speed * speed
        a_t, a_v, a_h = rate * t + square * t1, rate * v + square * v1, rate * h + square * h1
        found[j] = (rate + square * stretch) * secant
        found[BLOCK + j] = square * h * secant
        found[2 * BLOCK + j] = -square * v * secant
        found[3 * BLOCK + j] = square * t * v - a_h
        found[4 * BLOCK + j] = -square * (t * t + h * h)
        found[5 * BLOCK + j] = square * v * h + a_t
        found[6 * BLOCK + j] = square * t * h + a_v
        found[7 * BLOCK + j] = square * v * h - a_t
        found[8 * BLOCK + j] = -square * (t * t + v * v)
        found[9 * BLOCK + j] = t * speed
        found[10 * BLOCK + j] = v * speed
        found[11 * BLOCK + j] = h * speed
