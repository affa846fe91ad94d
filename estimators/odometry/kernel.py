"""Compiled loop of the curve-matched odometry: a Kalman filter along the line.

Arrays in, arrays out; nothing here knows of recordings or data frames. What the states are, and how their
noise is chosen, stands in `simrail.estimators.odometry.curve_matched`.
"""

from __future__ import annotations

import numpy as np

from simrail.core.jit import FloatArray, njit

STATES = 13
S, V, WAY, SCALE, TREAD, TURN, PUSH, SQUAT, LEAD, YAW, DRIFT, SWAY, LAG = range(STATES)

UPDATES = 3
"""Scalar updates of a step at most: wheel, heading, rest."""

MODEL = (
    "pulse_m",
    "still_s",
    "gate",
    "wheel_walk_m",
    "tread_sd",
    "tread_length_m",
    "force_m2ps3",
    "unsteady_s05",
    "push_walk_m2ps5",
    "gyro_rad2ps",
    "drift_walk_rad2ps3",
    "gyro_scale",
    "sway_sd_rad",
    "sway_length_m",
    "lag_walk_m",
    "heading_sd_rad",
)
"""What `curve_matched` takes as its `model`, in this order; see
`simrail.estimators.odometry.curve_matched`."""


@njit
def line_at(grid: FloatArray, table: FloatArray, s: float, out: FloatArray) -> None:
    """Design at s into out (5,): heading, its slope, roll, pitch, the slope of the pitch."""
    at = min(max((s - grid[0]) * grid[1], 0.0), table.shape[0] - 1.000001)
    i = int(at)
    x = at - i
    for j in range(4):
        out[j] = table[i, j] + x * (table[i + 1, j] - table[i, j])
    out[4] = (table[i + 1, 3] - table[i, 3]) * grid[1]


@njit
def predict(
    x: FloatArray,
    p: FloatArray,
    f: FloatArray,
    work: FloatArray,
    here: FloatArray,
    lean: FloatArray,
    signal: FloatArray,
    dt: float,
    model: FloatArray,
    gravity: float,
    steady: float,
) -> tuple[float, float]:
    """One step of the model, in place: x, P and F.

    ``here`` is the design at x[S], ``lean`` that at x[S] - x[LEAD], ``signal`` the mean rates about Y and
    Z and the mean force along X, ``steady`` the effort without its vibration. Returns the acceleration,
    and the way that the wheel shows per metre.
    """
    n = x.shape[0]
    turn = (signal[0] * np.sin(here[2]) + signal[1] * np.cos(here[2])) / np.cos(here[3])
    level = np.cos(lean[3])
    share = 1.0 / (1.0 + x[SQUAT])
    effort = (signal[2] - x[PUSH]) * share
    acceleration = level * (effort + gravity * np.sin(lean[3]))
    half = 0.5 * dt * dt
    way = dt * x[V] + half * acceleration
    run = abs(way)
    rolls = 1.0 + x[SCALE] + x[TREAD] + x[TURN] * here[1]
    wears, sways = np.exp(-run / model[5]), np.exp(-run / model[13])
    f[:, :] = 0.0
    for i in range(n):
        f[i, i] = 1.0
    by_place = level * gravity * level * lean[4]
    for place, slope in (
        (S, by_place),
        (LEAD, -by_place),
        (PUSH, -level * share),
        (SQUAT, -level * share * effort),
    ):
        f[V, place] += dt * slope
        f[S, place] += half * slope
        f[WAY, place] += rolls * half * slope
    f[S, V], f[WAY, V] = dt, rolls * dt
    f[WAY, SCALE], f[WAY, TREAD], f[WAY, TURN] = way, way, way * here[1]
    f[TREAD, TREAD], f[SWAY, SWAY] = wears, sways
    f[YAW, DRIFT] = -dt
    x[S] += way
    x[V] += dt * acceleration
    x[WAY] += rolls * way
    x[TREAD] *= wears
    x[YAW] += dt * (turn - x[DRIFT])
    x[SWAY] *= sways

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

    # What disturbs the accelerometer moves speed and position, and with them the way of the wheel.
    q = model[6] + (model[7] * steady) ** 2
    for i in (S, WAY):
        for j in (S, WAY):
            p[i, j] += q * dt**3 / 3.0
        p[i, V] += q * dt * dt / 2.0
        p[V, i] = p[i, V]
    p[V, V] += q * dt
    p[WAY, WAY] += model[3] * run
    p[TREAD, TREAD] += model[4] ** 2 * (1.0 - wears * wears)
    p[PUSH, PUSH] += model[8] * dt
    p[YAW, YAW] += model[9] * dt + (model[11] * turn) ** 2 * dt * 10.0
    p[DRIFT, DRIFT] += model[10] * dt
    p[SWAY, SWAY] += model[12] ** 2 * (1.0 - sways * sways)
    p[LAG, LAG] += model[14] * run
    return acceleration, rolls


@njit
def update(
    x: FloatArray, p: FloatArray, h: FloatArray, error: float, variance: float, gain: FloatArray
) -> float:
    """Scalar Kalman update in place; writes the gain and returns the innovation's variance."""
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
    dt: float,
    signals: FloatArray,
    count: FloatArray,
    model: FloatArray,
    gravity: float,
    grid: FloatArray,
    table: FloatArray,
    x: FloatArray,
    p: FloatArray,
    states: FloatArray,
    covariance: FloatArray,
    acceleration: FloatArray,
    flags: FloatArray,
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
    dt : float
        Step, s.
    signals : ndarray (n, 3)
        Mean angular rates about Y and Z (rad/s) and mean specific force along X (m/s2) over the step that
        ends here, body axes.
    count : ndarray (n,)
        Last reading of the pulse counter at the end of the step.
    model : ndarray (16,)
        See `MODEL`.
    gravity : float
        m/s2.
    grid, table : ndarray (2,), (m, 4)
        First place and places per metre of the design's table: heading, its slope, roll, pitch.
    x, p : ndarray (13,), (13, 13)
        State and covariance at the start; replaced by the last ones.
    states, covariance : ndarray (n, 13), (n, 13, 13), output
        Filtered.
    acceleration : ndarray (n,), output
        Acceleration along the track over the step, unfiltered.
    flags : ndarray (n, 2), output
        1 where the wheel is not believed; 1 where the train stands.
    before, before_covariance, transition : ndarray (n, 13), (n, 13, 13), (n, 13, 13), output
        Predicted state and covariance, and F of the step, for `simrail.estimators.kalman`;
        of no rows where no smoother follows.
    rows, gains : ndarray (n, 3, 13), output
        Row of the Jacobian and gain of each scalar update.
    scaled : ndarray (n, 6), output
        Innovation over its variance of each update, then one over its variance; 0 for one not made.
    """
    n = x.shape[0]
    keep = before.shape[0] > 0
    f, work = np.zeros((n, n)), np.zeros((n, n))
    h, gain = np.zeros((UPDATES, n)), np.zeros(n)
    line, lean = np.zeros(5), np.zeros(5)
    error, variance, wanted = np.zeros(UPDATES), np.zeros(UPDATES), np.zeros(UPDATES)
    pulse, still, gate = model[0], model[1], model[2]
    h[0, WAY] = 1.0
    h[1, YAW], h[1, SWAY] = 1.0, -1.0
    h[2, V] = 1.0
    direction = idle = moving = agreed = wheel_speed = steady = 0.0
    resting, slipping = True, False
    for k in range(signals.shape[0]):
        line_at(grid, table, x[S], line)
        line_at(grid, table, x[S] - x[LEAD], lean)
        steady += dt / 0.5 * (signals[k, 2] - x[PUSH] - steady)
        acceleration[k], rolls = predict(x, p, f, work, line, lean, signals[k], dt, model, gravity, steady)

        # The wheel. Its count says between which two edges it stands; an edge that has just been
        # passed says more at low speed.
        change = count[k] - count[k - 1] if k > 0 else 0.0
        measured = (count[k] - count[0]) * pulse
        wheel_speed += 0.1 * (change * pulse / dt - wheel_speed)
        idle += dt
        moving += dt
        # A train that comes to rest sways to and fro: that is no change of direction.
        if abs(x[V]) > 0.2 or direction == 0.0:
            direction = np.sign(x[V])
        if change != 0.0:
            idle = 0.0
            if resting:
                # It left less than a pulse ago, with a jerk of some 0.5 m/s3, held to be standing.
                p[V, V] += (0.5 * np.cbrt(0.5 * 36.0 * pulse * pulse)) ** 2
                moving = 0.0
            resting = False
        width = pulse
        error[0] = measured - x[WAY]
        if abs(change) == 1.0:
            width = min(pulse, max(0.1 * pulse, (abs(x[V]) + 2.0 * np.sqrt(p[V, V])) * dt))
            error[0] -= 0.5 * change * (pulse - width)
        elif change == 0.0:
            # No pulse: the wheel is at most at the edge.
            beyond = abs(error[0]) - 0.5 * pulse
            error[0] = np.sign(error[0]) * max(beyond, 0.0)
        variance[0] = width * width / 12.0
        wanted[0] = 1.0 if change != 0.0 or error[0] != 0.0 else 0.0
        if slipping:
            off = abs(wheel_speed - x[V] * rolls)
            agreed = agreed + dt if off < 3.0 * np.sqrt(p[V, V]) + 0.005 * abs(x[V]) else 0.0
            slipping = agreed <= 0.5
        elif moving > 2.0 and error[0] * error[0] > gate * gate * (p[WAY, WAY] + variance[0]):
            slipping = True
            agreed = 0.0
        if slipping:
            # The way that the wheel makes says nothing: it starts anew from what it reads.
            wanted[0] = 0.0
            for i in range(n):
                p[i, WAY] = p[WAY, i] = f[WAY, i] = 0.0
            p[WAY, WAY] = pulse * pulse / 12.0
            x[WAY] = measured
        if keep:
            before[k], before_covariance[k], transition[k] = x, p, f

        resting = resting or (idle > still and abs(x[V]) * idle < 2.0 * pulse)
        wanted[1], wanted[2] = 1.0, 1.0 if resting else 0.0
        variance[1], variance[2] = model[15] ** 2, 1e-8
        for m in range(UPDATES):
            rows_m = h[m]
            if m == 1:
                # The heading: that of the design where the body points, and its sway about that.
                line_at(grid, table, x[S] - direction * x[LAG], line)
                rows_m[S], rows_m[LAG] = -line[1], direction * line[1]
                error[1] = line[0] - x[YAW] + x[SWAY]
            elif m == 2:
                error[2] = -x[V]
            s = 0.0
            if wanted[m] > 0.0:
                s = update(x, p, rows_m, error[m], variance[m], gain)
            if keep:
                rows[k, m], gains[k, m] = rows_m, gain
                scaled[k, m] = error[m] / s if s > 0.0 else 0.0
                scaled[k, UPDATES + m] = 1.0 / s if s > 0.0 else 0.0
        states[k], covariance[k] = x, p
        flags[k, 0] = 1.0 if slipping else 0.0
        flags[k, 1] = 1.0 if resting else 0.0
