"""The attitude estimators of `simrail.estimators.attitude.kernel` for several recordings at once.

Recordings are the lanes of one loop: what one of them needs for a sample the processor does for eight in one
instruction. Each lane does what the loop for one recording does, in the same order, so the bits are the same.
Samples go through in blocks, in which the lanes lie side by side; before and after, each recording has arrays
of its own.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numba import literal_unroll
from simrail.estimators.attitude.kernel import (
    Covariance,
    Three,
    Turns,
    descended,
    predicted,
    updated,
)

from simrail.core.jit import FloatArray, njit_borrowed, njit_inline
from simrail.core.sine import sine_cosine
from simrail.recording.recording import Recording

LANES = 16
"""Recordings that one loop takes: twice as many float64 as the widest registers hold. Of fewer the compiler
makes no loop over lanes: it takes eight for too few to look first whether arrays overlap."""

BLOCK = 256
"""Samples that are laid side by side at a time: 26 rows of them stay in the second cache."""


LEAST = 4
"""Of fewer recordings one after the other is faster than a loop with so many lanes in vain."""


def by_lanes(recordings: Sequence[Recording]) -> tuple[list[list[int]], list[int]]:
    """Which recordings share a loop, at most `LANES` and at least `LEAST`, and which run by themselves.

    Those that share one have as many samples, at one rate, in the same gravity.
    """
    alike: dict[tuple[object, ...], list[int]] = {}
    for i, recording in enumerate(recordings):
        key = len(recording.imu), recording.imu_sheet.rate_hz, recording.gravity_mps2
        alike.setdefault(key, []).append(i)
    parts = [members[at : at + LANES] for members in alike.values() for at in range(0, len(members), LANES)]
    shared = [part for part in parts if len(part) >= LEAST]
    return shared, [i for part in parts if len(part) < LEAST for i in part]


def side_by_side(starts: Sequence[FloatArray]) -> FloatArray:
    """Vectors of m recordings as columns for all lanes, (k, LANES); those in vain begin as the last one."""
    return np.array([*starts, *[starts[-1]] * (LANES - len(starts))]).T.copy()


class Board(NamedTuple):
    """Where lanes lie side by side.

    Attributes
    ----------
    given, found : ndarray (BLOCK, rows * LANES)
        What is measured, and what comes of it.
    state : ndarray (states * LANES,)
    """

    given: FloatArray
    found: FloatArray
    state: FloatArray


def board(given: int, found: int, states: int) -> Board:
    """Room for so many rows."""
    shapes = (BLOCK, given * LANES), (BLOCK, found * LANES), (states * LANES,)
    return Board(*(np.zeros(shape) for shape in shapes))


@njit_borrowed
def lay(arrays: tuple[FloatArray, ...], begin: int, count: int, lane: int, given: FloatArray) -> None:
    """Rows ``begin`` and on of what a recording has, each (n, m), into its lane of the board, one by one."""
    first = 0
    for values in literal_unroll(arrays):
        for j in range(count):
            for column in range(values.shape[1]):
                given[j, (first + column) * LANES + lane] = values[begin + j, column]
        first += values.shape[1]


@njit_borrowed
def take(found: FloatArray, begin: int, count: int, lane: int, arrays: tuple[FloatArray, ...]) -> None:
    """The other way round."""
    first = 0
    for values in literal_unroll(arrays):
        for j in range(count):
            for column in range(values.shape[1]):
                values[begin + j, column] = found[j, (first + column) * LANES + lane]
        first += values.shape[1]


def through(
    block: Callable[[int, bool], None],
    board: Board,
    given: Sequence[tuple[FloatArray, ...]],
    found: Sequence[tuple[FloatArray, ...]],
) -> None:
    """Take recordings of equal length through a loop over lanes, block by block.

    Parameters
    ----------
    block : callable
        Goes over so many samples of the board; the second argument is whether they are the first ones.
    board : Board
    given, found : sequence of tuple of ndarray (n, m)
        Of each recording, in the order of the board's rows.
    """
    n = len(given[0][0])
    for begin in range(0, n, BLOCK):
        count = min(BLOCK, n - begin)
        for lane, arrays in enumerate(given):
            lay(arrays, begin, count, lane, board.given)
        block(count, begin == 0)
        for lane, arrays in enumerate(found):
            take(board.found, begin, count, lane, arrays)


@njit_borrowed
def begin_ekf(starts: FloatArray, state: FloatArray) -> None:
    """State of all lanes from roll, pitch and yaw before the first update and their variances, (6, LANES)."""
    for lane in range(LANES):
        for i in range(9):
            state[i * LANES + lane] = 0.0
        for i in range(3):
            state[i * LANES + lane] = starts[i, lane]
        state[3 * LANES + lane] = starts[3, lane]
        state[6 * LANES + lane] = starts[4, lane]
        state[8 * LANES + lane] = starts[5, lane]
        sr, cr = sine_cosine(starts[0, lane])
        sp, cp = sine_cosine(starts[1, lane])
        state[9 * LANES + lane], state[10 * LANES + lane] = sr, cr
        state[11 * LANES + lane], state[12 * LANES + lane] = sp, cp


@njit_borrowed
def ekf_block(board: Board, count: int, is_first: bool, step_s: float, gravity: float) -> None:
    """`simrail.estimators.attitude.kernel.attitude_ekf` of all lanes, over a block.

    Given are rows of rate (3), force (3), its noise (3) and the process noise (1); found are the angles (3),
    the innovations (4) and the covariance (9).
    """
    given, found, state = board
    for j in range(count):
        if j > 0 or not is_first:
            _predict_lanes(given[j], state, step_s)
        _update_lanes(given[j], found[j], state, gravity)


@njit_inline
def _state_of(state: FloatArray, i: int) -> tuple[Three, Covariance, Turns]:
    """Angles, covariance and turns of lane ``i``."""
    w = LANES
    angles = state[i], state[w + i], state[2 * w + i]
    upper = state[3 * w + i], state[4 * w + i], state[5 * w + i]
    lower = state[6 * w + i], state[7 * w + i], state[8 * w + i]
    turns = state[9 * w + i], state[10 * w + i], state[11 * w + i], state[12 * w + i]
    return angles, (upper[0], upper[1], upper[2], lower[0], lower[1], lower[2]), turns


@njit_inline
def _keep_state(state: FloatArray, i: int, angles: Three, p: Covariance, turns: Turns) -> None:
    w = LANES
    state[i], state[w + i], state[2 * w + i] = angles
    state[3 * w + i], state[4 * w + i], state[5 * w + i] = p[0], p[1], p[2]
    state[6 * w + i], state[7 * w + i], state[8 * w + i] = p[3], p[4], p[5]
    state[9 * w + i], state[10 * w + i], state[11 * w + i], state[12 * w + i] = turns


@njit_borrowed
def _predict_lanes(given: FloatArray, state: FloatArray, step_s: float) -> None:
    for i in range(LANES):
        angles, p, turns = _state_of(state, i)
        rate = given[i], given[LANES + i], given[2 * LANES + i]
        angles, p, turns = predicted(angles, p, turns, rate, given[9 * LANES + i], step_s)
        _keep_state(state, i, angles, p, turns)


@njit_borrowed
def _update_lanes(given: FloatArray, found: FloatArray, state: FloatArray, gravity: float) -> None:
    for i in range(LANES):
        angles, p, turns = _state_of(state, i)
        force = given[3 * LANES + i], given[4 * LANES + i], given[5 * LANES + i]
        noise = given[6 * LANES + i], given[7 * LANES + i], given[8 * LANES + i]
        angles, p, turns, innovation = updated(angles, p, turns, force, noise, gravity)
        _keep_state(state, i, angles, p, turns)
        found[i], found[LANES + i], found[2 * LANES + i] = angles
        found[3 * LANES + i], found[4 * LANES + i] = innovation[0], innovation[1]
        found[5 * LANES + i], found[6 * LANES + i] = innovation[2], innovation[3]
        found[7 * LANES + i] = p[0]
        found[8 * LANES + i] = found[10 * LANES + i] = p[1]
        found[9 * LANES + i] = found[13 * LANES + i] = p[2]
        found[11 * LANES + i] = p[3]
        found[12 * LANES + i] = found[14 * LANES + i] = p[4]
        found[15 * LANES + i] = p[5]


@njit_borrowed
def gda_block(board: Board, count: int, is_first: bool, beta: float, step_s: float) -> None:
    """`simrail.estimators.attitude.kernel.attitude_gda` of all lanes, over a block.

    Given are rows of rate (3) and force (3); found are those of the quaternion.
    """
    given, found, state = board
    for j in range(count):
        _descend_lanes(given[j], found[j], state, beta, step_s, j > 0 or not is_first)


@njit_borrowed
def _descend_lanes(
    given: FloatArray,
    found: FloatArray,
    state: FloatArray,
    beta: float,
    step_s: float,
    moves: bool,
) -> None:
    w = LANES
    if moves:
        for i in range(LANES):
            rate = given[i], given[LANES + i], given[2 * LANES + i]
            force = given[3 * LANES + i], given[4 * LANES + i], given[5 * LANES + i]
            q = state[i], state[w + i], state[2 * w + i], state[3 * w + i]
            q = descended(q, rate, force, beta, step_s)
            state[i], state[w + i], state[2 * w + i], state[3 * w + i] = q
    for c in range(4):
        for i in range(LANES):
            found[c * LANES + i] = state[c * w + i]
