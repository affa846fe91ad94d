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
    remember,
    remember_prediction,
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

TILT, LEVEL, BUMP, GRADE, GYRO_SCALE = 2, 4, 5, 6, 7
"""In place of what a wheel needs; the states that both filters have keep their numbers."""

HEADING, SLOPE = range(2)
"""Rows of a step: heading and pitch of the body."""

LOST_M, MOST_DOUBT_S = 1.0, 30.0
"""Standard deviation of the place above which the map is not taken for its tangent; and for how long at most
what is left of it is one error."""


class Reckoned(NamedTuple):
    """What the zero-velocity odometry says at n steps, and how that errs.

    Attributes
    ----------
    speed, acceleration, pitch, turning : ndarray (n,)
        Along the track at the end of each step, m/s, m/s2, rad; mean heading rate over it, rad/s.
    rests : ndarray (n,)
        1 where the train stands, 0 elsewhere.
    transitions, noises : ndarray (n, 2, 2)
        A and Q of the error of speed and acceleration, from the step before (`neighbours`).
    """

    speed: FloatArray
    acceleration: FloatArray
    pitch: FloatArray
    turning: FloatArray
    rests: FloatArray
    transitions: FloatArray
    noises: FloatArray


class SlopeModel(NamedTuple):
    """Noise of what the wheel's filter does not have.

    Attributes
    ----------
    level_walk_rad2ps : float
        Random walk of `level`.
    bump_sd_rad, bump_length_m, grade_sd_rad, grade_length_m : float
        Markov processes in distance `bump` and `grade`.
    slope_sd_rad : float
        White part of the pitch.
    """

    level_walk_rad2ps: float
    bump_sd_rad: float
    bump_length_m: float
    grade_sd_rad: float
    grade_length_m: float
    slope_sd_rad: float


@njit
def neighbours(
    past: History, picked: FloatArray, smoothed: bool, covariances: FloatArray, crossed: FloatArray
) -> None:
    """Covariances of some of a filter's errors at each step, and with those at the step after.

    Of e = T (x - x^), with P^- predicted, P^+ after the updates of step k, and Lam the information that all
    later steps add, as in `simrail.estimators.kalman.fixed_interval`:

        filter:    cov(e(k), e(k+1)) = T P^+ F' (I - h_1' K_1') .. (I - h_m' K_m') T'
        smoother:  cov(e(k), e(k+1)) = T P^+ F' (I - Lam P^-) T',   P^- and Lam of k+1

    Parameters
    ----------
    past : History
    picked : ndarray (m, n)
        T.
    smoothed : bool
        Of the smoother's errors; False for the filter's.
    covariances, crossed : ndarray (k, m, m), out
        cov(e(k), e(k)), cov(e(k), e(k+1)); the last of ``crossed`` is 0.
    """
    steps, n = past.states.shape
    info, after = np.zeros((n, n)), np.zeros((n, len(picked)))
    for k in range(steps - 1, -1, -1):
        predicted = past.covariances[k]
        filtered = predicted.copy()
        gained = picked.T.copy()
        for m in range(past.rows.shape[1]):
            if past.inverses[k, m] > 0.0:
                v = filtered @ past.rows[k, m]
                for i in range(n):
                    for c in range(n):
                        filtered[i, c] -= past.gains[k, m, i] * v[c]
        crossed[k] = picked @ filtered @ after
        for m in range(past.rows.shape[1] - 1, -1, -1):
            h, gain = past.rows[k, m], past.gains[k, m]
            if past.inverses[k, m] > 0.0:
                share = gain @ gained
                for i in range(n):
                    for c in range(len(picked)):
                        gained[i, c] -= h[i] * share[c]
                if smoothed:
                    withdraw_information(info, h, gain, past.inverses[k, m], gain @ info)
        if smoothed:
            kept = picked.T - info @ predicted @ picked.T
            covariances[k] = picked @ predicted @ kept
            after = past.transitions[k].T @ kept
            info = past.transitions[k].T @ info @ past.transitions[k]
        else:
            covariances[k] = picked @ filtered @ picked.T
            after = past.transitions[k].T @ gained


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
    new, old = reckoned.speed[k], reckoned.speed[max(k - 1, 0)]
    off = x[V] - (1.0 + x[SCALE]) * old
    speed = (1.0 + x[SCALE]) * new + a[0, 0] * off + a[0, 1] * gravity * x[TILT]
    tilt = a[1, 0] * off / gravity + a[1, 1] * x[TILT]
    runs = 0.0 if reckoned.rests[k] > 0.0 else 0.5 * dt  # a train that stands gets nowhere
    way = runs * (x[V] + speed)
    run = abs(way)
    astray = here.ramp_even * x[EVEN] + here.ramp_odd * x[ODD] - here.bend * x[BEND]
    bumps, grades = np.exp(-run / slopes.bump_length_m), np.exp(-run / slopes.grade_length_m)
    sways = np.exp(-run / model.sway_length_m)
    for i in range(n):
        for j in range(n):
            f[i, j] = 1.0 if i == j else 0.0
    f[V, V], f[V, TILT], f[V, SCALE] = a[0, 0], a[0, 1] * gravity, new - a[0, 0] * old
    f[TILT, V], f[TILT, TILT], f[TILT, SCALE] = a[1, 0] / gravity, a[1, 1], -a[1, 0] * old / gravity
    f[S, V], f[S, TILT], f[S, SCALE] = runs * (1.0 + f[V, V]), runs * f[V, TILT], runs * f[V, SCALE]
    f[BUMP, BUMP], f[GRADE, GRADE], f[SWAY, SWAY] = bumps, grades, sways
    for i in (V, TILT, SCALE):
        f[YAW, i] = astray * f[S, i]
    f[YAW, DRIFT], f[YAW, GYRO_SCALE] = -dt, dt * reckoned.turning[k]
    f[YAW, BEND], f[YAW, EVEN], f[YAW, ODD] = -way * here.bend, way * here.ramp_even, way * here.ramp_odd
    x[S] += way
    x[V], x[TILT] = speed, tilt
    x[BUMP] *= bumps
    x[GRADE] *= grades
    x[SWAY] *= sways
    x[YAW] += dt * ((1.0 + x[GYRO_SCALE]) * reckoned.turning[k] - x[DRIFT]) + way * astray

    congruence(f, p, work)
    p[V, V] += q[0, 0]
    p[TILT, TILT] += q[1, 1] / gravity**2
    p[S, S] += runs * runs * q[0, 0]
    for i, j, share in (
        (V, TILT, q[0, 1] / gravity),
        (S, V, runs * q[0, 0]),
        (S, TILT, runs * q[0, 1] / gravity),
    ):
        p[i, j] += share
        p[j, i] = p[i, j]
    p[LEVEL, LEVEL] += slopes.level_walk_rad2ps * dt
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
    past: History | None,
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
    past : History or None, output
        For `simrail.estimators.kalman.fixed_interval`; None where no smoother follows.
    """
    f, work, h, gain, v = scratch
    h[HEADING, YAW] = h[SLOPE, TILT] = 1.0
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
        if past is not None:
            remember_prediction(past, k, x, p, f)
        for m in range(2):
            lost = np.sqrt(p[S, S])
            held = max(min(lost / max(abs(x[V]), 1.0), MOST_DOUBT_S) / dt, 1.0)
            if m == HEADING:
                line, variance, _ = about(grid, table, x[S] - direction * x[LAG], lost, held)
                error = off_heading(line, x, direction, model, gravity, h[HEADING])
                variance += model.heading_sd_rad**2
            else:
                line, _, variance = about(grid, table, x[S] - x[LEAD], lost, held)
                effort = reckoned.acceleration[k] / gravity
                h[SLOPE, S], h[SLOPE, LEAD], h[SLOPE, SQUAT] = -line.pitch_slope, line.pitch_slope, -effort
                error = line.pitch + x[LEVEL] + x[BUMP] + x[GRADE] + effort * x[SQUAT]
                error -= reckoned.pitch[k] + x[TILT]
                variance += slopes.slope_sd_rad**2
            s = update(x, p, h[m], error, variance, gain, v)
            if past is not None:
                remember(past, k, m, h[m], gain, error, s)
        keep(steps.states, steps.covariance, k, x, p)
