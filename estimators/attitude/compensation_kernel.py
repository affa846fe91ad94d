"""Compiled loop of the track-frame compensation: how the track frame moves (EQUATIONS 1.1, 2.1).

Block by block, for the reason that `simrail.track.frame_kernel` gives; a block goes from the design's
polynomials to the force without any array of the whole ride in between.
"""

import math
from typing import NamedTuple

import numpy as np

from simrail.core.jit import FloatArray, njit, njit_borrowed
from simrail.track.frame_kernel import (
    BLOCK,
    DK1,
    DK2,
    DK3,
    K1,
    K2,
    K3,
    PITCH1,
    ROLL1,
    ROWS,
    SLOPE,
    YAW2,
    of_piece,
    run_of,
)

GIVEN = 10
"""Rows of what is known of each sample: k, its derivative, pitch', tan pitch, speed and its rate."""

MOTION = 12
"""Rows of what comes of it: acceleration of the origin, what is added per m of y and of z, angular rate."""

CURVES = (K3, DK3, K2, DK2)
"""Curvatures, and their slopes, of which lateral and vertical acceleration are made."""


class Course(NamedTuple):
    """A train's way over its design, n samples.

    Attributes
    ----------
    starts, terms : ndarray
        The design (`simrail.track.frame_kernel.Pieces`).
    place, speed, speed_rate : ndarray (n,)
        m, m/s and m/s2, signed.
    printed : bool
        Take the track's motion as paper 000 prints it: k = (roll', pitch', yaw'), k' = (0, 0, yaw''), no
        slope.
    """

    starts: FloatArray
    terms: FloatArray
    place: FloatArray
    speed: FloatArray
    speed_rate: FloatArray
    printed: bool


@njit
def frame_motion(course: Course, out: FloatArray) -> None:
    """Motion of the track frame (12, n): `simrail.estimators.attitude.compensation.track_motion`."""
    block, given, found = np.zeros(ROWS * BLOCK), np.zeros(GIVEN * BLOCK), np.empty(MOTION * BLOCK)
    n, at, begin = course.place.shape[0], 0, 0
    while begin < n:
        end, at = run_of(course.starts, course.place, begin, at)
        of_piece(course.terms[at], course.starts[at], course.place[begin:end], block)
        _gather(course, block, begin, end - begin, given)
        _block_motion(given, found)
        for row in range(MOTION):
            for j in range(end - begin):
                out[row, begin + j] = found[row * BLOCK + j]
        begin = end


@njit
def force_less_motion(
    course: Course,
    signals: tuple[FloatArray, ...],
    y: float,
    z: float,
    force: FloatArray,
    curves: FloatArray,
) -> None:
    """Specific force less the acceleration of a place (0, y, z) of the frame.

    Parameters
    ----------
    course : Course
    signals : tuple of ndarray (n,)
        Specific force along X, Y and Z, m/s2.
    y, z : float
        m.
    force : ndarray (n, 3), out
    curves : ndarray (4, n) or (4, 0), out
        `CURVES`, 1/m and 1/m2, where they are wanted.
    """
    block, given, found = np.zeros(ROWS * BLOCK), np.zeros(GIVEN * BLOCK), np.empty(MOTION * BLOCK)
    n, at, begin = course.place.shape[0], 0, 0
    while begin < n:
        end, at = run_of(course.starts, course.place, begin, at)
        count = end - begin
        of_piece(course.terms[at], course.starts[at], course.place[begin:end], block)
        _gather(course, block, begin, count, given)
        _block_motion(given, found)
        for axis in range(3):
            first = axis * BLOCK
            for j in range(count):
                k = first + j
                moved = found[k] + y * found[3 * BLOCK + k] + z * found[6 * BLOCK + k]
                force[begin + j, axis] = signals[axis][begin + j] - moved
        if curves.shape[1] > 0:
            for row in range(4):
                for j in range(count):
                    curves[row, begin + j] = block[CURVES[row] * BLOCK + j]
        begin = end


@njit_borrowed
def _gather(course: Course, block: FloatArray, begin: int, count: int, given: FloatArray) -> None:
    """Put samples into a block; what is left of it stays as it was, and is worked out in vain."""
    first, slope = (ROLL1, 0.0) if course.printed else (K1, 1.0)
    for row in range(3):
        for j in range(count):
            given[row * BLOCK + j] = block[(first + row) * BLOCK + j]
        for j in range(count):
            given[(3 + row) * BLOCK + j] = slope * block[(DK1 + row) * BLOCK + j]
    for j in range(count):
        given[6 * BLOCK + j] = slope * block[PITCH1 * BLOCK + j]
        given[7 * BLOCK + j] = -slope * block[SLOPE * BLOCK + j]
        given[8 * BLOCK + j] = course.speed[begin + j]
        given[9 * BLOCK + j] = course.speed_rate[begin + j]
    if course.printed:
        for j in range(count):
            given[5 * BLOCK + j] = block[YAW2 * BLOCK + j]


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
