"""Compiled loop of the profile filter: a height in time, and the heights that it has left along the track.

Hidalgo et al. (paper 004) with the delay line over the distance in place of time (EQUATIONS 5). Places are
measured along x = u s: u = 1 if the axle under the IMU is ahead of the other one towards larger s, else -1,
so that the other axle always is at x - L. The state is

    [h, h', b_a, b_g, d, d', c_1 .. c_N]

with the height h of the rails at x, the biases of accelerometer and gyro, the angle d by which the body
leaves the chord from axle to axle, and the heights c of the nodes of a fixed grid under the vehicle, from
x - L on. The nodes lie in a ring: node j in slot j modulo N.

    each sample:   h <- h + dt h' + dt^2/2 (a - b_a + w),   h' <- h' + dt (a - b_a + w)         (paper, Eq. 5)
    rows:          0 = h + v                                        moving: the paper's virtual sensor
                   0 = h' + v                                       standing
                   rate = (h' - V c'(x - L)) / L + d' + b_g + v     nose up, turned with u          (Eq. 2)
    a node that the IMU passes first is what h was there:   c <- h - t h',  t the time since   (Eq. 6, over x)
    a node that was there before is a measurement of h:     0 = h - t h' - c + v
    a node that comes under the other axle first:           c <- c_neighbour + w, w of the profile's variance

So the window moves with the vehicle to either side, and nothing happens to it at standstill. It has a
wheelbase of nodes behind whatever runs last: from x - L to x if the IMU leads, to x + L if it trails. A node
that leaves it is the estimate; a place that is passed again is estimated anew.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import update

from simrail.core.jit import FloatArray, njit, njit_borrowed

H, RATE, BIAS_A, BIAS_G, ANGLE, ANGLE_RATE = range(6)
OWN = 6
"""States before the nodes."""

SLACK = 1
"""Nodes by which the train may rock to and fro before any is forgotten behind the other axle."""

SAME = 1e-10
"""m^2: a node that is passed again, and h at that moment, are one to 10 um."""


class Model(NamedTuple):
    """What the filter takes of a ride of n samples.

    Attributes
    ----------
    side : float
        u.
    place, speed : ndarray (n,)
        x of the axle under the IMU, m, and dx/dt, m/s.
    vertical : ndarray (n,)
        Vertical acceleration a of the IMU's place, gravity and the design track's taken off, m/s2.
    rate : ndarray (n,)
        Angular rate against the design track, rad/s: nose up if u = 1, nose down if u = -1.
    moves, sees : ndarray of bool (n,)
        Whether the train moves, and whether the gyro's row is used.
    zero_variance : ndarray (n,)
        Of the virtual sensor, m^2; used where the train moves.
    still_variance, rate_variance : float
        Of h' at standstill, (m/s)^2, and of the gyro's row, (rad/s)^2.
    accel_variance : float
        Of a sample of the accelerometer, (m/s2)^2.
    bias_walk : ndarray (2,)
        Variance that the biases gain with each sample, (m/s2)^2 and (rad/s)^2.
    angle_step, angle_process : ndarray (2, 2)
        F and Q of [d, d'] over a sample.
    start, start_covariance : ndarray (m,), (m, m)
        Before the first sample.
    wheelbase_m, step_m : float
        L, and the distance of the nodes.
    profile_variance : float
        Of the profile, m^2.
    is_linear : bool
        Slope by two nodes (Eq. 7) in place of four.
    step_s : float
        Sample interval, s.
    """

    side: float
    place: FloatArray
    speed: FloatArray
    vertical: FloatArray
    rate: FloatArray
    moves: np.ndarray
    sees: np.ndarray
    zero_variance: FloatArray
    still_variance: float
    rate_variance: float
    accel_variance: float
    bias_walk: FloatArray
    angle_step: FloatArray
    angle_process: FloatArray
    start: FloatArray
    start_covariance: FloatArray
    wheelbase_m: float
    step_m: float
    profile_variance: float
    is_linear: bool
    step_s: float


class Found(NamedTuple):
    """What the filter finds at n samples and m nodes.

    Attributes
    ----------
    states, variances : ndarray (n, 6)
        Filtered h, h', b_a, b_g, d, d', and their variances.
    first_node : int
        Node j is in row j - first_node of what follows; it lies at x = j step_m.
    oldest, front : ndarray (m, 2)
        Height and its variance, m and m^2: as a node has left the window, and as it was when the IMU passed
        it, each the last time; NaN where that never was.
    """

    states: FloatArray
    variances: FloatArray
    first_node: int
    oldest: FloatArray
    front: FloatArray


def slots(wheelbase_m: float, step_m: float) -> int:
    """Nodes that the window needs."""
    return 2 * math.ceil(wheelbase_m / step_m) + 3 + SLACK


def room(model: Model) -> Found:
    """Room for what is found."""
    n = len(model.place)
    # The slope at the other axle takes one node behind its interval.
    first = math.floor((float(model.place.min()) - model.wheelbase_m) / model.step_m) - 1
    count = math.floor(float(model.place.max()) / model.step_m) - first + 1
    nodes = np.full((2, count, 2), np.nan)
    return Found(np.empty((n, OWN)), np.empty((n, OWN)), first, nodes[0], nodes[1])


@njit
def profile_filter(model: Model, found: Found) -> float:
    """Run the filter; returns the log-likelihood of the moving gyro, given the accelerometer."""
    n = len(model.start)
    x, p = model.start.copy(), np.zeros((n, 8 * ((n + 7) // 8)))
    for i in range(n):
        for c in range(n):
            p[i, c] = model.start_covariance[i, c]
    row, gain, work = np.zeros(n), np.zeros(n), np.zeros(p.shape[1])
    step, base = model.step_m, model.wheelbase_m
    passed = int(np.floor(model.place[0] / step))
    low, high = int(np.floor((model.place[0] - base) / step)) - 1, passed
    keep, likelihood = int(np.ceil(base / step)), 0.0
    for k in range(len(model.place)):
        place, speed = model.place[k], model.speed[k]
        if k > 0:
            _predict(x, p, model, model.vertical[k])
        here = int(np.floor(place / step))
        behind = int(np.floor((place - base) / step)) - 1
        while low < behind - SLACK:
            _emit(x, p, low, found.oldest, found.first_node)
            low += 1
        while passed < here:
            passed += 1
            late = _since(place - passed * step, speed, model.step_s)
            if passed > high:
                high = passed
                _deposit(x, p, passed, late)
            else:
                _pass_again(x, p, passed, late, row, gain, work)
            _emit(x, p, passed, found.front, found.first_node)
        while passed > here:
            late = _since(place - passed * step, speed, model.step_s)
            _pass_again(x, p, passed, late, row, gain, work)
            _emit(x, p, passed, found.front, found.first_node)
            passed -= 1
        while high > here + keep:
            _emit(x, p, high, found.oldest, found.first_node)
            high -= 1
        while low > behind:
            low -= 1
            _begin(x, p, low, model)
        zero = H if model.moves[k] else RATE
        row[zero] = 1.0
        variance = model.zero_variance[k] if model.moves[k] else model.still_variance
        update(x, p, row, -x[zero], variance, gain, work)
        row[zero] = 0.0
        if model.sees[k]:
            error = model.rate[k] - _seen(x, row, place, speed, model)
            s = update(x, p, row, error, model.rate_variance, gain, work)
            row[:] = 0.0
            if model.moves[k]:
                likelihood -= 0.5 * (error * error / s + math.log(2.0 * math.pi * s))
        for i in range(OWN):
            found.states[k, i], found.variances[k, i] = x[i], p[i, i]
    for node in range(low, high + 1):
        _emit(x, p, node, found.oldest, found.first_node)
    return likelihood


@njit_borrowed
def _slot(node: int, n: int) -> int:
    """State of a node, of n states."""
    return OWN + node % (n - OWN)


@njit_borrowed
def _pass_again(
    x: FloatArray, p: FloatArray, node: int, late: float, row: FloatArray, gain: FloatArray, work: FloatArray
) -> None:
    """0 = h - late h' - c."""
    slot = _slot(node, len(x))
    row[H], row[RATE], row[slot] = 1.0, -late, -1.0
    update(x, p, row, x[slot] + late * x[RATE] - x[H], SAME, gain, work)
    row[H] = row[RATE] = row[slot] = 0.0


@njit_borrowed
def _since(beyond: float, speed: float, step_s: float) -> float:
    """Time since a node was passed: within the last sample."""
    return min(abs(beyond / speed), step_s) if speed != 0.0 else 0.0


@njit_borrowed
def _predict(x: FloatArray, p: FloatArray, model: Model, vertical: float) -> None:
    """X <- F x + N u and P <- F P F' + Q; nodes stay, so their own covariances do."""
    n, width = p.shape
    dt = model.step_s
    half = 0.5 * dt * dt
    a, f, q = vertical - x[BIAS_A], model.angle_step, model.angle_process
    x[H] += dt * x[RATE] + half * a
    x[RATE] += dt * a
    angle = x[ANGLE]
    x[ANGLE] = f[0, 0] * angle + f[0, 1] * x[ANGLE_RATE]
    x[ANGLE_RATE] = f[1, 0] * angle + f[1, 1] * x[ANGLE_RATE]
    for c in range(width):
        p[H, c] += dt * p[RATE, c] - half * p[BIAS_A, c]
        p[RATE, c] -= dt * p[BIAS_A, c]
        angle = p[ANGLE, c]
        p[ANGLE, c] = f[0, 0] * angle + f[0, 1] * p[ANGLE_RATE, c]
        p[ANGLE_RATE, c] = f[1, 0] * angle + f[1, 1] * p[ANGLE_RATE, c]
    for i in range(OWN):
        p[i, H] += dt * p[i, RATE] - half * p[i, BIAS_A]
        p[i, RATE] -= dt * p[i, BIAS_A]
        angle = p[i, ANGLE]
        p[i, ANGLE] = f[0, 0] * angle + f[0, 1] * p[i, ANGLE_RATE]
        p[i, ANGLE_RATE] = f[1, 0] * angle + f[1, 1] * p[i, ANGLE_RATE]
    p[H, H] += half * half * model.accel_variance
    p[H, RATE] += half * dt * model.accel_variance
    p[RATE, RATE] += dt * dt * model.accel_variance
    p[BIAS_A, BIAS_A] += model.bias_walk[0]
    p[BIAS_G, BIAS_G] += model.bias_walk[1]
    p[ANGLE, ANGLE] += q[0, 0]
    p[ANGLE, ANGLE_RATE] += q[0, 1]
    p[ANGLE_RATE, ANGLE_RATE] += q[1, 1]
    for i in range(OWN):
        for c in range(i + 1, n):
            p[c, i] = p[i, c]


@njit_borrowed
def _deposit(x: FloatArray, p: FloatArray, node: int, late: float) -> None:
    """Make a node, c <- h - late h': its row and column are copies as well."""
    n, width = p.shape
    slot = _slot(node, n)
    x[slot] = x[H] - late * x[RATE]
    for c in range(width):
        p[slot, c] = p[H, c] - late * p[RATE, c]
    p[slot, slot] = p[H, H] - 2.0 * late * p[H, RATE] + late * late * p[RATE, RATE]
    for i in range(n):
        p[i, slot] = p[slot, i]


@njit_borrowed
def _begin(x: FloatArray, p: FloatArray, node: int, model: Model) -> None:
    """A node where nothing has been yet: what is known before must not be a second virtual sensor."""
    n, width = p.shape
    slot, neighbour = _slot(node, n), _slot(node + 1, n)
    x[slot] = x[neighbour]
    for c in range(width):
        p[slot, c] = p[neighbour, c]
    p[slot, slot] = p[neighbour, neighbour] + model.profile_variance
    for i in range(n):
        p[i, slot] = p[slot, i]


@njit_borrowed
def _emit(x: FloatArray, p: FloatArray, node: int, out: FloatArray, first_node: int) -> None:
    """Write height and variance of a node."""
    slot = _slot(node, len(x))
    out[node - first_node, 0], out[node - first_node, 1] = x[slot], p[slot, slot]


@njit_borrowed
def _seen(x: FloatArray, row: FloatArray, place: float, speed: float, model: Model) -> float:
    """What the gyro should show; writes its row."""
    base, step = model.wheelbase_m, model.step_m
    at = (place - base) / step
    node = int(np.floor(at))
    t = at - node
    share = speed / (base * step)
    row[RATE] = 1.0 / base
    row[BIAS_G] = row[ANGLE_RATE] = 1.0
    # Slope by Lagrange's polynomial through four nodes at -1, 0, 1, 2.
    first = -(3.0 * t * t - 6.0 * t + 2.0) / 6.0
    second = (3.0 * t * t - 4.0 * t - 1.0) / 2.0
    third = -(3.0 * t * t - 2.0 * t - 2.0) / 2.0
    fourth = (3.0 * t * t - 1.0) / 6.0
    if model.is_linear:
        first, second, third, fourth = 0.0, -1.0, 1.0, 0.0
    row[_slot(node - 1, len(x))] = -share * first
    row[_slot(node, len(x))] = -share * second
    row[_slot(node + 1, len(x))] = -share * third
    row[_slot(node + 2, len(x))] = -share * fourth
    total = 0.0
    for i in range(row.shape[0]):
        total += row[i] * x[i]
    return total
