"""Compiled loops of odometry from an IMU and a map: how a reckoned speed errs, and the filter on the line.

Arrays in, arrays out; what the states are, and how their noise is chosen, stands in
`simrail.estimators.odometry.without_wheel`.
"""

from typing import NamedTuple

import numpy as np
from simrail.estimators.kalman import (
    History,
    congruence,
    keep,
    product,
    remember,
    remember_prediction,
    row_product,
    transpose,
    update,
    withdraw_information,
)
from simrail.estimators.odometry.kernel import (
    BEND,
    DIRECTION_SPEED_MPS,
    DRIFT,
    EVEN,
    LAG,
    LEAD,
    ODD,
    SCALE,
    SQUAT,
    SWAY,
    YAW,
    LineModel,
    S,
    Scratch,
    Steps,
    V,
    map_ahead,
    off_heading,
)
from simrail.estimators.odometry.line_table import Line, line_at, line_over

from simrail.core.jit import FloatArray, njit, njit_borrowed

STATES = 19
TILT, LEVEL, BUMP, GRADE, GYRO_SCALE, OFFSET = 2, 4, 5, 6, 7, 18
"""In place of what a wheel needs; the states that both filters have keep their numbers."""

ROWS = 3
HEADING, SLOPE, REST = range(ROWS)
"""Rows of a step: heading and pitch of the body, and a speed of nothing."""

LOST_M, MOST_DOUBT_S = 1.0, 30.0
"""Standard deviation of the place above which the map is not taken for its tangent; and for how long at most
what is left of it is one error."""


class Reckoned(NamedTuple):
    """What the zero-velocity odometry says at n steps, and how that errs.

    Attributes
    ----------
    predicted, speed : ndarray (n,)
        Along the track at the end of each step, m/s, before its updates and after them.
    acceleration, pitch, turning : ndarray (n,)
        m/s2 and rad; mean heading rate over the step, rad/s.
    rests : ndarray (n,)
        1 where the train stands, 0 elsewhere.
    shifts : ndarray (n, 2)
        By how much the updates change the acceleration and the accelerometer's offset, m/s2.
    transitions, noises : ndarray (n, 3, 3)
        A and Q of the errors of speed, acceleration and offset, from the step before to this one before its
        updates.
    rest_variance : float
        Of the speed of a train that stands; infinite where the speed has all that its stops say.
    """

    predicted: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    pitch: FloatArray
    turning: FloatArray
    rests: FloatArray
    shifts: FloatArray
    transitions: FloatArray
    noises: FloatArray
    rest_variance: float


class SlopeModel(NamedTuple):
    """Noise of what the wheel's filter does not have.

    Attributes
    ----------
    bump_sd_rad, bump_length_m, grade_sd_rad, grade_length_m : float
        Markov processes in distance `bump` and `grade`.
    slope_sd_rad : float
        White part of the pitch.
    """

    bump_sd_rad: float
    bump_length_m: float
    grade_sd_rad: float
    grade_length_m: float
    slope_sd_rad: float


@njit
def neighbours(
    past: History,
    picked: FloatArray,
    smoothed: bool,
    before: FloatArray,
    crossed: FloatArray,
    after: FloatArray,
) -> None:
    """Covariances of some of a filter's errors at a step and the next one, and between the two.

    Of e = T (x - x^), with P^- predicted, P^+ after the updates of step k, and Lam the information that all
    later steps add, as in `simrail.estimators.kalman.fixed_interval`:

        filter, up to the updates of k+1:  T P^+ T',   T P^+ F' T',                  T P^- T'
        smoother:                          of all k    T P^+ F' (I - Lam P^-) T',    of all k + 1

    Parameters
    ----------
    past : History
    picked : ndarray (m, n)
        T.
    smoothed : bool
        Of the smoother's errors; False for the filter's.
    before, crossed, after : ndarray (k, m, m), out
        cov(e(k-1), e(k-1)), cov(e(k-1), e(k)), cov(e(k), e(k)); of the first step ``after`` alone.
    """
    (steps, n), m = past.states.shape, len(picked)
    info, carried, kept = np.zeros((n, n)), np.zeros((n, m)), np.zeros((n, m))
    filtered, back, work, v = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    across, lost, turned = np.zeros((m, n)), np.zeros((m, n)), np.ascontiguousarray(picked.T)
    for k in range(steps - 1, -1, -1):
        predicted = past.covariances[k]
        _updated(past, k, filtered, v)
        product(picked, filtered, across)
        if k < steps - 1:
            product(across, carried, crossed[k + 1])
            if not smoothed:
                product(across, turned, before[k + 1])
        for row in range(past.rows.shape[1] - 1, -1, -1):
            if smoothed and past.inverses[k, row] > 0.0:
                gain = past.gains[k, row]
                row_product(gain, info, v)
                withdraw_information(info, past.rows[k, row], gain, past.inverses[k, row], v)
        product(picked, predicted, across)
        product(across, info, lost)  # its transpose is Lam P^- T'
        for i in range(n):
            for c in range(m):
                kept[i, c] = turned[i, c] - lost[c, i]
        product(across, kept, after[k])
        if k < steps - 1 and smoothed:
            for i in range(m):
                for c in range(m):
                    before[k + 1, i, c] = after[k, i, c]
        transpose(past.transitions[k], back)
        product(back, kept, carried)
        congruence(back, info, work)


@njit_borrowed
def _updated(past: History, k: int, p: FloatArray, v: FloatArray) -> None:
    """P (n, n) after the updates of step k; ``v`` (n,) is for work."""
    n = p.shape[0]
    for i in range(n):
        for c in range(n):
            p[i, c] = past.covariances[k, i, c]
    for m in range(past.rows.shape[1]):
        if past.inverses[k, m] > 0.0:
            row_product(past.rows[k, m], p, v)
            for i in range(n):
                for c in range(n):
                    p[i, c] -= past.gains[k, m, i] * v[c]


@njit_borrowed
def _disturb(p: FloatArray, q: FloatArray, runs: float, per_g: float) -> None:
    """Add the noise of speed, acceleration and offset; that of the speed moves the place with it."""
    places = ((S, 0, runs), (V, 0, 1.0), (TILT, 1, per_g), (OFFSET, 2, 1.0))
    for i, row, share in places:
        for j, column, other in places:
            p[i, j] += share * other * q[row, column]


@njit_borrowed
def predict_reckoned(
    x: FloatArray,
    p: FloatArray,
    f: FloatArray,
    work: FloatArray,
    here: Line,
    reckoned: Reckoned,
    k: int,
    dt: float,
    model: LineModel,
    slopes: SlopeModel,
    gravity: float,
) -> None:
    """One step of the model, in place: x, P and F; ``here`` is the design at x[S]."""
    n = x.shape[0]
    a, q = reckoned.transitions[k], reckoned.noises[k]
    new, old = reckoned.predicted[k], reckoned.speed[max(k - 1, 0)]
    stretch, per_g = 1.0 + x[SCALE], 1.0 / gravity
    slow, pull, offset = x[V] - stretch * old, gravity * x[TILT], x[OFFSET]
    speed = stretch * new + a[0, 0] * slow + a[0, 1] * pull + a[0, 2] * offset
    runs = 0.0 if reckoned.rests[k] > 0.0 else 0.5 * dt  # a train that stands gets nowhere
    way = runs * (x[V] + speed)
    run = abs(way)
    astray = here.ramp_even * x[EVEN] + here.ramp_odd * x[ODD] - here.bend * x[BEND]
    bumps, grades = np.exp(-run / slopes.bump_length_m), np.exp(-run / slopes.grade_length_m)
    sways = np.exp(-run / model.sway_length_m)
    for i in range(n):
        for j in range(n):
            f[i, j] = 1.0 if i == j else 0.0
    f[V, V], f[V, TILT], f[V, OFFSET] = a[0, 0], gravity * a[0, 1], a[0, 2]
    f[TILT, V], f[TILT, TILT], f[TILT, OFFSET] = per_g * a[1, 0], a[1, 1], per_g * a[1, 2]
    f[OFFSET, V], f[OFFSET, TILT], f[OFFSET, OFFSET] = a[2, 0], gravity * a[2, 1], a[2, 2]
    f[V, SCALE] = new - a[0, 0] * old
    f[TILT, SCALE], f[OFFSET, SCALE] = -per_g * a[1, 0] * old, -a[2, 0] * old
    for i in (TILT, OFFSET, SCALE):
        f[S, i] = runs * f[V, i]
    f[S, V] = runs * (1.0 + f[V, V])
    f[BUMP, BUMP], f[GRADE, GRADE], f[SWAY, SWAY] = bumps, grades, sways
    for i in (V, TILT, OFFSET, SCALE):
        f[YAW, i] = astray * f[S, i]
    f[YAW, DRIFT], f[YAW, GYRO_SCALE] = -dt, dt * reckoned.turning[k]
    f[YAW, BEND], f[YAW, EVEN], f[YAW, ODD] = -way * here.bend, way * here.ramp_even, way * here.ramp_odd
    x[S] += way
    x[V] = speed
    x[TILT] = per_g * (a[1, 0] * slow + a[1, 1] * pull + a[1, 2] * offset - reckoned.shifts[k, 0])
    x[OFFSET] = a[2, 0] * slow + a[2, 1] * pull + a[2, 2] * offset - reckoned.shifts[k, 1]
    x[BUMP] *= bumps
    x[GRADE] *= grades
    x[SWAY] *= sways
    x[YAW] += dt * ((1.0 + x[GYRO_SCALE]) * reckoned.turning[k] - x[DRIFT]) + way * astray

    congruence(f, p, work)
    _disturb(p, q, runs, per_g)
    p[BUMP, BUMP] += slopes.bump_sd_rad**2 * (1.0 - bumps * bumps)
    p[GRADE, GRADE] += slopes.grade_sd_rad**2 * (1.0 - grades * grades)
    p[YAW, YAW] += model.gyro_rad2ps * dt
    p[DRIFT, DRIFT] += model.drift_walk_rad2ps3 * dt
    p[SWAY, SWAY] += model.sway_sd_rad**2 * (1.0 - sways * sways)


@njit_borrowed
def about(
    grid: FloatArray, table: FloatArray, place: float, lost: float, held: float
) -> tuple[Line, float, float]:
    """The map about a place that is known to ``lost``, and the variances that it leaves to heading and pitch.

    Those are one error for as many steps as the train takes through the places where it may be, ``held``.
    """
    line = line_at(grid, table, place)
    if lost < LOST_M:
        return line, 0.0, 0.0
    over = line_over(grid, table, place, lost)
    blurred = Line(
        over.heading,
        over.bend,
        line.ramp_even,
        line.ramp_odd,
        line.roll,
        over.pitch,
        over.pitch_slope,
        line.curvature,
        line.askew,
        line.element,
        line.curve,
    )
    return blurred, over.heading_variance * held, over.pitch_variance * held


@njit_borrowed
def without_wheel(
    dt: float,
    reckoned: Reckoned,
    model: LineModel,
    slopes: SlopeModel,
    gravity: float,
    grid: FloatArray,
    table: FloatArray,
    x: FloatArray,
    p: FloatArray,
    steps: Steps,
    scratch: Scratch,
    past: History,
) -> None:
    """Run the filter over n steps.

    Parameters
    ----------
    dt : float
        Step, s.
    reckoned : Reckoned
    model, slopes : LineModel, SlopeModel
        Noise.
    gravity : float
        m/s2.
    grid, table : ndarray (2,), (m, 10)
        The map (`simrail.estimators.odometry.line_table`).
    x, p : ndarray (18,), (18, 18)
        State and covariance at the start; replaced by the last ones.
    steps : Steps, output
        Of n rows: states and covariances.
    scratch : Scratch
        All zero.
    past : History, output
        For `simrail.estimators.kalman.fixed_interval`; of no steps where no smoother follows.
    """
    f, work, h, gain, v = scratch
    keeps = past.states.shape[0] > 0
    h[HEADING, YAW] = h[SLOPE, TILT] = h[REST, V] = 1.0
    h[SLOPE, OFFSET] = 1.0 / gravity
    h[HEADING, SWAY] = h[SLOPE, LEVEL] = h[SLOPE, BUMP] = h[SLOPE, GRADE] = -1.0
    direction = 0.0
    before = line_at(grid, table, x[S])
    for k in range(reckoned.speed.shape[0]):
        here = line_at(grid, table, x[S])
        predict_reckoned(x, p, f, work, here, reckoned, k, dt, model, slopes, gravity)
        map_ahead(x, p, f, before, here, model)
        before = here
        if abs(x[V]) > DIRECTION_SPEED_MPS or direction == 0.0:
            direction = np.sign(x[V])
        if keeps:
            remember_prediction(past, k, x, p, f)
        for m in range(ROWS):
            if m == REST and (reckoned.rests[k] == 0.0 or reckoned.rest_variance == np.inf):
                continue
            lost = np.sqrt(p[S, S])
            held = max(min(lost / max(abs(x[V]), 1.0), MOST_DOUBT_S) / dt, 1.0)
            if m == HEADING:
                line, variance, _ = about(grid, table, x[S] - direction * x[LAG], lost, held)
                error = off_heading(line, x, direction, model, gravity, h[HEADING])
                variance += model.heading_sd_rad**2
            elif m == REST:
                error, variance = -x[V], reckoned.rest_variance
            else:
                line, _, variance = about(grid, table, x[S] - x[LEAD], lost, held)
                effort = reckoned.acceleration[k] / gravity
                h[SLOPE, S], h[SLOPE, LEAD], h[SLOPE, SQUAT] = -line.pitch_slope, line.pitch_slope, -effort
                error = line.pitch + x[LEVEL] + x[BUMP] + x[GRADE] + effort * x[SQUAT]
                error -= reckoned.pitch[k] + x[TILT] + x[OFFSET] / gravity
                variance += slopes.slope_sd_rad**2
            s = update(x, p, h[m], error, variance, gain, v)
            if keeps:
                remember(past, k, m, h[m], gain, error, s)
        keep(steps.states, steps.covariance, k, x, p)
