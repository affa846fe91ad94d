"""Compiled loops of the curve-matched odometry: a thirteen-state Kalman filter and its smoother.

Arrays in, arrays out; nothing here knows of recordings or data frames. The states, their model and the
choice of its noise are those of `estimators.odometry`.
"""

from __future__ import annotations

import numpy as np

from simrail.jit import FloatArray, njit

STATES = 13
S, V, A, W, SCALE, PUSH, YAW, DRIFT, SWAY, LAG, TREAD, TURN, LEAD = range(STATES)
"""Position, speed, acceleration, way of the wheel, its scale, accelerometer offset, heading, gyro bias,
heading of the body in the track, lag of that heading."""

UPDATES = 4
"""Scalar updates of a step at most: wheel, accelerometer, heading, rest."""

MODEL = (
    "jerk_m2ps5",
    "tread_sd",
    "push_walk_m2ps5",
    "gyro_rad2ps",
    "drift_sd_radps",
    "drift_correlation_s",
    "sway_sd_rad",
    "sway_per_curvature_m",
    "sway_length_m",
    "lag_walk_m",
    "force_m2ps3",
    "force_per_speed_m2ps3",
    "heading_sd_rad",
    "pulse_m",
    "gate",
    "still_s",
    "tread_length_m",
    "wheel_walk_m",
)
"""What the kernel's `model` holds, in its order (`estimators.odometry.CurveMatched`)."""


@njit
def _line(grid: FloatArray, table: FloatArray, s: float, out: FloatArray) -> None:
    """Heading, its slope, and the tangents that turn body rates into a yaw rate, at s, into out (5,)."""
    at = min(max((s - grid[0]) * grid[1], 0.0), table.shape[0] - 1.000001)
    i = int(at)
    x = at - i
    for j in range(4):
        out[j] = table[i, j] + x * (table[i + 1, j] - table[i, j])
    out[4] = (table[i + 1, 3] - table[i, 3]) * grid[1]


@njit
def _predict(x: FloatArray, p: FloatArray, f: FloatArray, work: FloatArray) -> None:
    """P <- F P F' in place for a dense F (its few non-zeros are not worth a special case)."""
    n = x.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                if f[i, k] != 0.0:
                    total += f[i, k] * p[k, j]
            work[i, j] = total
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                if f[j, k] != 0.0:
                    total += work[i, k] * f[j, k]
            p[i, j] = total
            p[j, i] = total


@njit
def _update(
    x: FloatArray, p: FloatArray, h: FloatArray, error: float, variance: float, gain: FloatArray
) -> float:
    """Scalar Kalman update in place; the gain is written, the innovation's variance returned."""
    n = x.shape[0]
    s = variance
    for i in range(n):
        total = 0.0
        for j in range(n):
            if h[j] != 0.0:
                total += p[i, j] * h[j]
        gain[i] = total
    for i in range(n):
        s += h[i] * gain[i]
    for i in range(n):
        x[i] += gain[i] * error / s
        for j in range(i + 1):
            p[i, j] -= gain[i] * gain[j] / s
            p[j, i] = p[i, j]
    for i in range(n):
        gain[i] /= s
    return s


@njit
def curve_matched(
    step_s: float,
    rate: FloatArray,
    force: FloatArray,
    count: FloatArray,
    model: FloatArray,
    gravity: float,
    grid: FloatArray,
    table: FloatArray,
    x: FloatArray,
    p: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
    slipping: FloatArray,
    before: FloatArray,
    before_covariance: FloatArray,
    transition: FloatArray,
    rows: FloatArray,
    gains: FloatArray,
    scaled: FloatArray,
) -> None:
    """Run the filter over n steps.

    Parameters
    ----------
    step_s : float
        Step.
    rate : ndarray (n, 3)
        Mean angular rate over the step that ends here, body axes, rad/s.
    force : ndarray (n,)
        Mean specific force along X over that step, m/s2.
    count : ndarray (n,)
        Last reading of the pulse counter at the end of the step.
    model : ndarray (18,)
        See `MODEL`.
    gravity : float
        m/s2.
    grid, table : ndarray (2,), (m, 4)
        First place and places per metre of the design's table: heading, curvature k3 over the
        horizontal way, roll, pitch.
    x, p : ndarray (13,), (13, 13)
        State and covariance at the start; replaced by the last ones.
    states, covariance : ndarray (n, 13), (n, 13, 13), output
        Filtered.
    slipping : ndarray (n,), output
        1 where the wheel was not believed.
    before, before_covariance, transition : ndarray (n, 13), (n, 13, 13), (n, 13, 13), output
        Predicted state and covariance, and F of the step: what the smoother needs. Arrays of no rows
        where only the filter is wanted.
    rows, gains : ndarray (n, 4, 13), output
        Row of the Jacobian and gain of each scalar update, zero for one that was not made.
    scaled : ndarray (n, 8), output
        Innovation over its variance of each update, then one over its variance.
    """
    n = x.shape[0]
    keep = before.shape[0] > 0
    f, work = np.zeros((n, n)), np.zeros((n, n))
    h, gain, line = np.zeros(n), np.zeros(n), np.zeros(5)
    pulse, gate = model[13], model[14]
    direction = 0.0
    idle = 0.0
    resting = True
    moving_s = 0.0
    agree_s = 0.0
    slip = False
    wheel_speed = 0.0
    for k in range(rate.shape[0]):
        # Predict: constant acceleration, the wheel rolls (1 + scale) times the way, the gyro turns.
        _line(grid, table, x[S], line)
        roll, pitch = line[2], line[3]
        turn = (rate[k, 1] * np.sin(roll) + rate[k, 2] * np.cos(roll)) / np.cos(pitch)
        way = step_s * x[V] + 0.5 * step_s * step_s * x[A]
        run = abs(way)
        stays = np.exp(-run / model[8])
        holds = np.exp(-step_s / model[5])
        f[:, :] = 0.0
        for i in range(n):
            f[i, i] = 1.0
        f[S, V], f[S, A], f[V, A] = step_s, 0.5 * step_s * step_s, step_s
        ratio = 1.0 + x[SCALE] + x[TREAD] + x[TURN] * line[1]
        wears = np.exp(-run / model[16])
        f[W, V] = ratio * step_s
        f[W, A] = ratio * 0.5 * step_s * step_s
        f[W, SCALE] = way
        f[W, TREAD] = way
        f[W, TURN] = way * line[1]
        f[TREAD, TREAD] = wears
        f[YAW, DRIFT] = -step_s
        f[DRIFT, DRIFT] = holds
        f[SWAY, SWAY] = stays
        x[S] += way
        x[V] += step_s * x[A]
        x[W] += ratio * way
        x[TREAD] *= wears
        x[YAW] += step_s * (turn - x[DRIFT])
        x[DRIFT] *= holds
        x[SWAY] *= stays
        _predict(x, p, f, work)
        q = model[0]
        for i in range(3):
            a = step_s**5 / 20.0 if i == 0 else (step_s**3 / 3.0 if i == 1 else step_s)
            p[i, i] += q * a
        p[S, V] += q * step_s**4 / 8.0
        p[S, A] += q * step_s**3 / 6.0
        p[V, A] += q * step_s**2 / 2.0
        p[V, S], p[A, S], p[A, V] = p[S, V], p[S, A], p[V, A]
        p[W, W] += q * step_s**5 / 20.0 + model[17] * run
        for i, a in ((S, step_s**5 / 20.0), (V, step_s**4 / 8.0), (A, step_s**3 / 6.0)):
            p[i, W] += q * a
            p[W, i] = p[i, W]
        p[TREAD, TREAD] += model[1] ** 2 * (1.0 - wears * wears)
        p[PUSH, PUSH] += model[2] * step_s
        p[YAW, YAW] += model[3] * step_s
        p[DRIFT, DRIFT] += model[4] ** 2 * (1.0 - holds * holds)
        sway = model[6] ** 2 + (model[7] * line[1]) ** 2
        p[SWAY, SWAY] += sway * (1.0 - stays * stays)
        p[LAG, LAG] += model[9] * run
        if keep:
            before[k], before_covariance[k], transition[k] = x, p, f
            rows[k] = 0.0
            gains[k] = 0.0
            scaled[k] = 0.0

        # The wheel: the count says between which two edges it stands.
        change = count[k] - count[k - 1] if k > 0 else 0.0
        measured = (count[k] - count[0]) * pulse
        idle += step_s
        if change != 0.0:
            direction = 1.0 if change > 0.0 else -1.0
            if resting:
                # It started less than a pulse ago, with a jerk that the model of a moving train lacks.
                start = 0.5 * np.cbrt(0.5 * 36.0 * pulse * pulse)
                p[V, V] += start * start
                p[A, A] += np.cbrt(6.0 * pulse * 0.25) ** 2
                moving_s = 0.0
            idle = 0.0
            resting = False
        moving_s += step_s
        wheel_speed += 0.1 * (change * pulse / step_s - wheel_speed)
        error = measured - x[W]
        width = pulse
        if abs(change) == 1.0:
            width = min(pulse, max(0.1 * pulse, (abs(x[V]) + 2.0 * np.sqrt(p[V, V])) * step_s))
            error -= 0.5 * direction * (pulse - width)
        variance = width * width / 12.0
        believed = change != 0.0
        if change == 0.0 and abs(error) > 0.5 * pulse:
            error -= np.sign(error) * 0.5 * pulse
            believed = True
        spread = p[W, W] + variance
        if slip:
            off = abs(wheel_speed - x[V] * ratio)
            agree_s = agree_s + step_s if off < 3.0 * np.sqrt(p[V, V]) + 0.01 * abs(x[V]) else 0.0
            if agree_s > 0.5:
                slip = False
        elif believed and error * error > gate * gate * spread and moving_s > 2.0:
            slip = True
            agree_s = 0.0
        slipping[k] = 1.0 if slip else 0.0
        if slip:
            # Whatever way the wheel made says nothing: it starts anew from what it reads.
            shift = measured - x[W]
            for i in range(n):
                p[i, W] = p[W, i] = 0.0
            p[W, W] = pulse * pulse / 12.0
            x[W] += shift
            if keep:
                # For the smoother the wheel's state is new: nothing after flows back through it.
                transition[k, W, :] = 0.0
                before[k], before_covariance[k] = x, p
        elif believed:
            h[:] = 0.0
            h[W] = 1.0
            s = _update(x, p, h, error, variance, gain)
            if keep:
                rows[k, 0], gains[k, 0], scaled[k, 0], scaled[k, 4] = h, gain, error / s, 1.0 / s

        # The accelerometer: acceleration, gravity along the slope, and an offset.
        h[:] = 0.0
        _line(grid, table, x[S] - x[LEAD], line)
        pitch = line[3]
        h[S], h[A], h[PUSH] = -gravity * np.cos(pitch) * line[4], 1.0 / np.cos(pitch), 1.0
        h[LEAD] = -h[S]
        error = force[k] + gravity * np.sin(pitch) - x[A] / np.cos(pitch) - x[PUSH]
        s = _update(x, p, h, error, (model[10] + model[11] * x[V] * x[V]) / step_s, gain)
        if keep:
            rows[k, 1], gains[k, 1], scaled[k, 1], scaled[k, 5] = h, gain, error / s, 1.0 / s

        # The heading: that of the design where the body points, and the body's sway about it.
        _line(grid, table, x[S] - direction * x[LAG], line)
        h[:] = 0.0
        h[S], h[LAG] = -line[1], direction * line[1]
        h[YAW], h[SWAY] = 1.0, -1.0
        error = line[0] - x[YAW] + x[SWAY]
        s = _update(x, p, h, error, model[12] ** 2, gain)
        if keep:
            rows[k, 2], gains[k, 2], scaled[k, 2], scaled[k, 6] = h, gain, error / s, 1.0 / s

        # Rest: no pulse for a while.
        if idle > model[15] and (resting or abs(x[V]) * idle < 2.0 * pulse):
            resting = True
            h[:] = 0.0
            h[V] = 1.0
            error = -x[V]
            s = _update(x, p, h, error, 1e-8, gain)
            if keep:
                rows[k, 3], gains[k, 3], scaled[k, 3], scaled[k, 7] = h, gain, error / s, 1.0 / s
            h[:] = 0.0
        states[k], covariance[k] = x, p


@njit
def smooth(
    before: FloatArray,
    before_covariance: FloatArray,
    transition: FloatArray,
    rows: FloatArray,
    gains: FloatArray,
    scaled: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
) -> None:
    """Smoothed states and covariances from what the filter kept (modified Bryson-Frazier, no inverse).

    lam and its covariance Lam run backwards: through each update lam <- lam - h (K.lam + e/s) and
    Lam <- C' Lam C + h h'/s with C = I - K h', through the prediction lam <- F' lam. Smoothed:
    x - P lam, P - P Lam P at the predicted state.
    """
    m, n = before.shape
    lam = np.zeros(n)
    info = np.zeros((n, n))
    v = np.zeros(n)
    work = np.zeros((n, n))
    for k in range(m - 1, -1, -1):
        for u in range(UPDATES - 1, -1, -1):
            h, gain = rows[k, u], gains[k, u]
            inverse = scaled[k, UPDATES + u]
            if inverse == 0.0:
                continue
            dot = 0.0
            for i in range(n):
                dot += gain[i] * lam[i]
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += info[i, j] * gain[j]
                v[i] = total
            quad = 0.0
            for i in range(n):
                quad += gain[i] * v[i]
            for i in range(n):
                lam[i] -= h[i] * (dot + scaled[k, u])
            for i in range(n):
                for j in range(n):
                    info[i, j] += h[i] * h[j] * (quad + inverse) - h[i] * v[j] - v[i] * h[j]
        p = before_covariance[k]
        for i in range(n):
            total = before[k, i]
            for j in range(n):
                total -= p[i, j] * lam[j]
            states[k, i] = total
            for j in range(n):
                total = 0.0
                for l in range(n):
                    total += p[i, l] * info[l, j]
                work[i, j] = total
        for i in range(n):
            for j in range(n):
                total = p[i, j]
                for l in range(n):
                    total -= work[i, l] * p[l, j]
                covariance[k, i, j] = total
        f = transition[k]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += f[j, i] * lam[j]
            v[i] = total
        lam[:] = v
        for i in range(n):
            for j in range(n):
                total = 0.0
                for l in range(n):
                    total += info[i, l] * f[l, j]
                work[i, j] = total
        for i in range(n):
            for j in range(n):
                total = 0.0
                for l in range(n):
                    total += f[l, i] * work[l, j]
                info[i, j] = total
