"""Compiled loop of the zero-velocity odometry: strapdown along the track, held whenever the train stands.

The train moves along its own X axis, up to what the body points askew. Gyros carry roll and pitch from one
step to the next, and the accelerometer less gravity is the change of speed (EQUATIONS 0):

    psd = sin(roll) q + cos(roll) r                               turning about the vertical of the body
    roll' = p + tan(pitch) psd,    pitch' = cos(roll) q - sin(roll) r
    v' = f_x - push + g sin(pitch) + lever psd^2 + askew v psd,    s' = v cos(pitch)
                                                                  (pitch at the middle of the step in v')
    f_y = v psd + g sin(roll) cos(pitch) + sway                    lateral row, every step

with p, q, r the gyro less its biases. An IMU that is ``lever`` ahead of the middle of the chord on which its
body runs is pulled towards that middle in a curve (`simrail.recording.sheets.vehicle_sheet.Chord`).

At rest the body turns no more than passengers turn it, and the rows are v = 0 and the gyro's biases. That
gives the pitch less push / g anew at each stop, and the biases of the gyros, which the way in between lives
on. How much passengers turn it differs from train to train, and the gyros show it: it is the mean square of
what those rows leave, less what is expected without passengers, over the last half minute of rest.

Whether the train stands is judged by `simrail.estimators.odometry.standstill`, from the signals and from
what the filter knows. Odds from seconds that have nothing in common add up, and one second that speaks
against rest takes all of that away.

Where a second IMU on another bogie echoes the first (`simrail.estimators.odometry.bogie_delay_kernel`), five
states follow, and a row: by the delay the speed was larger by e, at the middle of what was seen, T ago. Of
that the filter knows what it knows of the speed, less what push and pitch have added since; and if the
second clock is further ahead than it takes it to be, or the distance L (> 0 where the second IMU is behind)
larger, the speed seen is off by V^2/L and V/L times that, with V at that age. The distance seems larger or
smaller, by a Gauss-Markov process, for what the bogies do not do alike: wheels that are out of round keep
their phases over long ways, and shift the best match.

    e = dv + T (dpush - g cos(pitch) dpitch - V' dscale) - V^2/L doffset - V/L (dspacing + dunlike),
    offset' = clock drift,    unlike' = -unlike/tau + w,    v' has (1 + scale) (f_x - push)

d of the truth less the state.
"""

import math
from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import History, congruence, keep, remember, remember_prediction, update
from simrail.estimators.odometry.bogie_delay_kernel import Echo, Heard, is_borne_out, search_delay
from simrail.estimators.odometry.standstill import PRIOR, SUREST, TURN_S, rest_log_ratio, speed_log_ratio

from simrail.core.jit import FloatArray, njit, njit_borrowed

STATES = 10
S, V, ROLL, PITCH, DRIFT_X, DRIFT_Y, DRIFT_Z, PUSH, SWAY, ASKEW = range(STATES)
"""Place and speed along the track, roll, pitch, biases of the gyros, offsets of the accelerometers along X
and Y, yaw of the IMU in its track."""

ECHO_STATES = 15
OFFSET, CLOCK_DRIFT, SPACING, UNLIKE, SCALE = range(STATES, ECHO_STATES)
"""With a second IMU: how far its clock is ahead, s, how fast that grows, how much larger the distance of both
is than told, m, how much larger it seems for what two bogies do not do alike, and the share by which the
accelerometer along X shows too little, which no stop tells."""

SCALED_S = 10.0
"""A curve or a vertical curve lasts so long: an error of a gyro's scale does the same all along."""

UPDATES = 5
LATERAL, REST, REST_X, REST_Y, REST_Z = range(UPDATES)
"""Rows: lateral force; at rest, the speed and the three gyros."""

ECHO, ECHO_UPDATES = UPDATES, UPDATES + 1
"""And the delay of a second IMU."""

ECHO_GATE = 4.0
"""Standard deviations from which on a delay is no echo."""

ROCKED_ROWS, ROCKED_BEFORE = 600, 100
"""Over so many rows, of two gyros ten times a second, is averaged by how much passengers turn a body; what is
taken before any is heard counts as so many."""

ROCKED_MOST = 9.0
"""Of a row no more than so many times its variance counts: three standard deviations. A train that leaves
turns by more."""

UNKNOWN = 4.0
"""The clocks' offset is unknown while it adds so many times more to a delay's speed than bogies that are not
alike do: then it is what is searched, and one delay alone is not believed."""


class Model(NamedTuple):
    """What the filter takes of a ride of n steps.

    Attributes
    ----------
    step_s, gravity, lever_m, lag_m : float
        Step, gravity, how far the IMU is ahead of the middle of its body's chord, and how far that middle
        moves against the direction of running in a curve.
    signals : ndarray (n, 5)
        Mean angular rates, rad/s, and specific forces along X and Y, m/s2, over the step that ends here.
    shaking, turning, turn_s, force : ndarray
        `simrail.estimators.odometry.standstill.Signs`.
    given : ndarray (n,)
        1 where the train is told to stand, 0 where to run; below 0 the filter judges.
    process, rest_process : ndarray (10,) or (15,)
        Variances that a step adds while the train runs, and at rest.
    noise : ndarray (5,)
        Variances of the rows.
    rest_lateral : float
        Variance of the lateral row at rest.
    rocking, leaning, still : float
        Density squared by which passengers are taken to turn the body at rest, (rad/s)^2 s, until the gyros
        have shown it, 0 where none turn it and nothing is learnt; the share of it by which the body's angles
        wander; and what remains of both where nobody turns it.
    rate_variance, force_variance : float
        White noise of a gyro and of the accelerometer along X: variances of a mean over one second.
    scale_variance : float
        Of the relative error of a gyro's scale.
    surely : float
        Log odds from which on the train is held to stand.
    unheard_m : float
        So far a train may have run by the time it is heard to leave.
    """

    step_s: float
    gravity: float
    lever_m: float
    lag_m: float
    signals: FloatArray
    shaking: FloatArray
    turning: FloatArray
    turn_s: FloatArray
    force: FloatArray
    given: FloatArray
    process: FloatArray
    rest_process: FloatArray
    noise: FloatArray
    rest_lateral: float
    rocking: float
    leaning: float
    still: float
    rate_variance: float
    force_variance: float
    scale_variance: float
    surely: float
    unheard_m: float


class Found(NamedTuple):
    """What it says after each of n steps.

    Attributes
    ----------
    states, covariances : ndarray (n, 10) or (n, 15), (n, m, m)
        Covariances of the first m states.
    acceleration : ndarray (n,)
        Mean of v' over the step, m/s2; 0 at rest.
    log_odds : ndarray (n,)
        That the train stands.
    """

    states: FloatArray
    covariances: FloatArray
    acceleration: FloatArray
    log_odds: FloatArray


def room(steps: int, spoken_of: int, states: int = STATES) -> Found:
    """Room for what the filter says."""
    square = (steps, spoken_of, spoken_of)
    return Found(np.empty((steps, states)), np.empty(square), np.empty(steps), np.empty(steps))


@njit
def zero_velocity(
    model: Model,
    x: FloatArray,
    p: FloatArray,
    found: Found,
    past: History,
    echo: Echo | None = None,
    heard: Heard | None = None,
) -> None:
    """Run the filter over n steps.

    Parameters
    ----------
    model : Model
    x, p : ndarray (10,), (10, 10), in and out
        State and covariance at the start of the first step; with a second IMU of 15 states.
    found : Found, out
    past : History, out
        For `simrail.estimators.kalman.fixed_interval`; of no steps where no smoother follows.
    echo, heard : Echo, Heard, optional
        A second IMU, and room for its delays, out.
    """
    n, keeps = x.shape[0], past.states.shape[0] > 0
    f, work, h = np.eye(n), np.zeros((n, n)), np.zeros((ECHO_UPDATES, n))
    gain, v, turn, variance, scaled = np.zeros(n), np.zeros(n), np.zeros(3), np.zeros(3), np.zeros(5)
    h[REST, V] = h[REST_X, DRIFT_X] = h[REST_Y, DRIFT_Y] = h[REST_Z, DRIFT_Z] = 1.0
    fading = 1.0
    if echo is not None:
        fading = math.exp(-model.step_s / echo.unlike_s)
        f[OFFSET, CLOCK_DRIFT], f[UNLIKE, UNLIKE] = model.step_s, fading
    odds, rests = SUREST, True  # a train begins its ride at rest
    rest_noise, rest_process = model.noise.copy(), model.rest_process.copy()
    rest_noise[LATERAL] = model.rest_lateral
    rocked = np.array([model.rocking, 0.0])
    for k in range(model.signals.shape[0]):
        signal = model.signals[k]
        now = _evidence(model, k, x, p, turn, variance)
        more = max(now, odds + model.step_s / TURN_S * now) if now > 0.0 else max(odds, 0.0) + now
        odds = min(more, SUREST)
        # That it shakes no more is said once: a train whose sensors hide it shows so for all of its ride.
        quiet = max(model.shaking[k], 0.0)
        found.log_odds[k] = PRIOR + odds + quiet + speed_log_ratio(x[V], p[V, V])
        stood = rests
        rests = found.log_odds[k] > model.surely if model.given[k] < 0.0 else model.given[k] > 0.0
        if stood and not rests:
            _misled(model, p, gain)
        if echo is not None:
            _predict_echo(model, signal, fading, x, f, scaled)
            signal = scaled
        if model.rocking > 0.0:
            rest_process[ROLL : PITCH + 1] = model.step_s * max(model.leaning * rocked[0], model.still)
        process = rest_process if rests else model.process
        found.acceleration[k] = _predict(model, signal, rests, process, x, p, f, work)
        if keeps:
            remember_prediction(past, k, x, p, f)
        noise = rest_noise if rests else model.noise
        for m in range(UPDATES if rests else LATERAL + 1):
            if m == LATERAL:
                error = _lateral(model, signal, x, h[LATERAL])
            elif m == REST:
                error = -x[V]
            else:
                error = _turns(model, signal, m, x, p, rocked, rest_noise)
            s = update(x, p, h[m], error, noise[m], gain, v)
            if keeps:
                remember(past, k, m, h[m], gain, error, s)
        if rests:
            found.acceleration[k] = 0.0
        elif echo is not None and heard is not None and k % echo.every == 0:
            error, by_delay = _echo(model, echo, heard, k, x, p, found.acceleration, h[ECHO])
            if by_delay > 0.0:
                s = update(x, p, h[ECHO], error, by_delay, gain, v)
                if keeps:
                    remember(past, k, ECHO, h[ECHO], gain, error, s)
        keep(found.states, found.covariances, k, x, p)


@njit_borrowed
def _evidence(
    model: Model, k: int, x: FloatArray, p: FloatArray, turn: FloatArray, variance: FloatArray
) -> float:
    """What the signals say of rest, less the biases and the slope that the filter knows.

    What has led the speed astray has led the slope astray as well. The speed is judged elsewhere; here the
    acceleration is that of a train of speed zero, given which less is doubtful.
    """
    for i in range(3):
        turn[i] = model.turning[k, i] - x[DRIFT_X + i]
        variance[i] = p[DRIFT_X + i, DRIFT_X + i] + model.rate_variance / model.turn_s[k]
    slope = model.gravity * math.cos(x[PITCH])
    push = model.force[k] - x[PUSH] + model.gravity * math.sin(x[PITCH])
    known = p[PUSH, PUSH] - 2.0 * slope * p[PUSH, PITCH] + slope * slope * p[PITCH, PITCH]
    shared = (slope * p[V, PITCH] - p[V, PUSH]) / p[V, V]
    push -= shared * x[V]
    known -= shared * shared * p[V, V]
    loud = min(model.shaking[k], 0.0)
    return rest_log_ratio(loud, turn, variance, push, max(known, 0.0) + model.force_variance)


@njit_borrowed
def _misled(model: Model, p: FloatArray, gain: FloatArray) -> None:
    """What the last rows of rest did to all states while the train ran already, unheard; ``gain`` is room.

    A row v = 0 that comes when the speed is v moves the state by -K v, K = P[:, v] / R. The speeds of these
    steps sum up to the way over the step's length.
    """
    share = model.unheard_m / (model.step_s * model.noise[REST])
    for i in range(p.shape[0]):
        gain[i] = p[i, V] * share
    for i in range(p.shape[0]):
        for j in range(p.shape[0]):
            p[i, j] += gain[i] * gain[j]


@njit_borrowed
def _turns(
    model: Model,
    signal: FloatArray,
    m: int,
    x: FloatArray,
    p: FloatArray,
    rocked: FloatArray,
    rest_noise: FloatArray,
) -> float:
    """Innovation of a gyro's row m at rest, and what it tells of how much passengers turn the body.

    ``rocked`` (2,) holds that as a density squared, and the rows that it is of; ``rest_noise`` follows it.
    """
    axis = DRIFT_X + m - REST_X
    error, known = signal[m - REST_X] - x[axis], p[axis, axis]
    # A bias that is hardly known yet would hide it; people who walk roll and pitch a body above all.
    if model.rocking > 0.0 and m < REST_Z and known < rest_noise[m]:
        square = min(error * error, ROCKED_MOST * (known + rest_noise[m])) - known
        rocked[1] += 1.0
        share = 1.0 / min(rocked[1] + ROCKED_BEFORE, ROCKED_ROWS)
        rocked[0] += share * (square * model.step_s - model.rate_variance - rocked[0])
        rest_noise[REST_X:] = (model.rate_variance + max(rocked[0], model.still)) / model.step_s
    return float(error)


@njit_borrowed
def _predict(
    model: Model,
    signal: FloatArray,
    rests: bool,
    process: FloatArray,
    x: FloatArray,
    p: FloatArray,
    f: FloatArray,
    work: FloatArray,
) -> float:
    """State and covariance over one step, F in ``f``; returns the mean acceleration."""
    dt, g = model.step_s, model.gravity
    lever = model.lever_m + (model.lag_m if x[V] > 0.0 else -model.lag_m)
    sr, cr, sp, cp = math.sin(x[ROLL]), math.cos(x[ROLL]), math.sin(x[PITCH]), math.cos(x[PITCH])
    a, b, c = signal[0] - x[DRIFT_X], signal[1] - x[DRIFT_Y], signal[2] - x[DRIFT_Z]
    turns = 0.0 if rests else 1.0
    psd, pitching = turns * (sr * b + cr * c), turns * (cr * b - sr * c)
    pull = 2.0 * lever * psd + x[ASKEW] * x[V]  # derivative of v' by psd
    # Half a step of a vertical curve: by the pitch at its start each change of gradient would leave
    # g dt/2 times that change in the speed, .01 m/s after 20 permil.
    middle = x[PITCH] + 0.5 * dt * pitching
    along = g * math.cos(middle)
    acceleration = signal[3] - x[PUSH] + g * math.sin(middle) + lever * psd * psd + x[ASKEW] * x[V] * psd
    for i in range(V, PITCH + 1):
        for j in range(STATES):
            f[i, j] = 1.0 if i == j else 0.0
    f[V, V] += dt * x[ASKEW] * psd
    f[V, PITCH], f[V, PUSH], f[V, ASKEW] = dt * along, -dt, dt * x[V] * psd
    f[V, ROLL] = dt * (pull * pitching - 0.5 * dt * along * psd)
    f[V, DRIFT_Y] = -dt * turns * (pull * sr + 0.5 * dt * along * cr)
    f[V, DRIFT_Z] = -dt * turns * (pull * cr - 0.5 * dt * along * sr)
    f[ROLL, ROLL] += dt * sp / cp * pitching
    f[ROLL, PITCH] = dt * psd / (cp * cp)
    f[ROLL, DRIFT_X] = -dt * turns
    f[ROLL, DRIFT_Y], f[ROLL, DRIFT_Z] = -dt * sp / cp * sr * turns, -dt * sp / cp * cr * turns
    f[PITCH, ROLL] = -dt * psd
    f[PITCH, DRIFT_Y], f[PITCH, DRIFT_Z] = -dt * cr * turns, dt * sr * turns
    way = dt * (x[V] + 0.5 * dt * acceleration)
    for j in range(STATES):
        f[S, j] = 0.5 * dt * cp * f[V, j]
    f[S, S] = 1.0
    f[S, V] += 0.5 * dt * cp
    f[S, PITCH] -= sp * way
    x[S] += cp * way
    x[V] += dt * acceleration
    x[ROLL] += dt * (turns * a + sp / cp * psd)
    x[PITCH] += dt * pitching
    congruence(f, p, work)
    for i in range(x.shape[0]):
        p[i, i] += process[i]
    scaled = turns * dt * SCALED_S * model.scale_variance
    p[ROLL, ROLL] += scaled * (a * a + (sp / cp) ** 2 * ((sr * b) ** 2 + (cr * c) ** 2))
    p[PITCH, PITCH] += scaled * ((cr * b) ** 2 + (sr * c) ** 2)
    return float(acceleration)


@njit_borrowed
def _lateral(model: Model, signal: FloatArray, x: FloatArray, h: FloatArray) -> float:
    """Innovation of the lateral force, its row in ``h``."""
    sr, cr, sp, cp = math.sin(x[ROLL]), math.cos(x[ROLL]), math.sin(x[PITCH]), math.cos(x[PITCH])
    b, c = signal[1] - x[DRIFT_Y], signal[2] - x[DRIFT_Z]
    psd = sr * b + cr * c
    h[V], h[SWAY] = psd, 1.0
    h[ROLL] = x[V] * (cr * b - sr * c) + model.gravity * cr * cp
    h[PITCH] = -model.gravity * sr * sp
    h[DRIFT_Y], h[DRIFT_Z] = -x[V] * sr, -x[V] * cr
    return float(signal[4] - x[V] * psd - model.gravity * sr * cp - x[SWAY])


@njit_borrowed
def _predict_echo(
    model: Model, signal: FloatArray, fading: float, x: FloatArray, f: FloatArray, scaled: FloatArray
) -> None:
    """The states of a second IMU over one step, their columns of F, and the signal by its scale."""
    x[OFFSET] += model.step_s * x[CLOCK_DRIFT]
    x[UNLIKE] *= fading
    force = signal[3] - x[PUSH]
    for i in range(signal.shape[0]):
        scaled[i] = signal[i]
    scaled[3] += x[SCALE] * force
    f[V, SCALE] = model.step_s * force
    f[S, SCALE] = 0.5 * model.step_s * f[V, SCALE]


@njit_borrowed
def _echo(
    model: Model,
    echo: Echo,
    heard: Heard,
    k: int,
    x: FloatArray,
    p: FloatArray,
    acceleration: FloatArray,
    h: FloatArray,
) -> tuple[float, float]:
    """Innovation of the delay row and its noise, the row in ``h``; noise 0 where there is none."""
    speed = abs(x[V])
    spacing = echo.spacing_m + x[SPACING] + x[UNLIKE]
    if speed < echo.least_speed_mps or spacing * echo.spacing_m <= 0.0:
        return 0.0, 0.0
    age = echo.lag_s + 0.5 * (echo.window_s + abs(spacing) / speed)
    then = x[V]  # the speed at that age
    for i in range(max(0, k + 1 - int(age / model.step_s)), k + 1):
        then -= acceleration[i] * model.step_s
    h[V] = 1.0
    h[PITCH], h[PUSH] = -age * model.gravity * math.cos(x[PITCH]), age
    floor = echo.shared * (echo.floor_mps + echo.floor_share * speed) ** 2
    by_clock = then**4 / spacing**2 * p[OFFSET, OFFSET] > UNKNOWN * floor
    h[OFFSET], h[SPACING] = -then * then / spacing, -then / spacing
    h[UNLIKE], h[SCALE] = h[SPACING], then - x[V]
    known = 0.0
    for i in range(x.shape[0]):
        if h[i] != 0.0:
            for j in range(x.shape[0]):
                known += h[i] * p[i, j] * h[j]
    c, noise = search_delay(
        echo, heard, k, x[V], math.sqrt(known), x[OFFSET], abs(spacing), acceleration, model.step_s, by_clock
    )
    if by_clock:  # what was found is a delay, of the speed at that age
        c, noise = c * (then / x[V]) ** 2, noise * (then / x[V]) ** 4
    error = c if x[V] > 0.0 else -c
    if noise <= 0.0:
        return 0.0, 0.0
    heard.searches[k, 4] = x[OFFSET] + error / h[OFFSET]
    heard.searches[k, 5] = math.sqrt(noise / echo.shared) / abs(h[OFFSET])
    if by_clock and not is_borne_out(echo, heard, k, model.step_s):
        return 0.0, 0.0
    if c * c > ECHO_GATE**2 * (known + noise):
        return 0.0, 0.0
    heard.searches[k, 0] = 1.0
    return error, noise
