"""Compiled loop of the curve-matched odometry: a Kalman filter along the line.

Arrays in, arrays out; nothing here knows of recordings or data frames. What the states are, and how their
noise is chosen, stands in `simrail.estimators.odometry.curve_matched`.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from simrail.estimators.kalman import History, congruence, keep, remember, remember_prediction, update
from simrail.estimators.odometry.line_table import Line, line_at

from simrail.core.jit import FloatArray, njit_borrowed, njit_inner

BoolArray = npt.NDArray[np.bool_]

STATES = 18
S, V, WAY, SCALE, TREAD, LEFT, RIGHT, PUSH, SQUAT, LEAD, YAW, DRIFT, SWAY, LAG = range(14)
BEND, EVEN, ODD, TURN = range(14, STATES)

UPDATES = 3
WHEEL, HEADING, REST = range(UPDATES)
"""Scalar updates of a step at most."""

DIRECTION_SPEED_MPS = 0.2
"""Below this a train that comes to rest sways to and fro: that is no change of direction."""

START_JERK_MPS3 = 0.5
"""Jerk with which a train leaves, as service traction does."""

STEADY_S, WHEEL_SPEED_SHARE = 0.5, 0.1
"""Time constant of the steady effort; share of the newest reading in the smoothed speed of the wheel. Chosen
so that both forget a vibration of some Hz."""

START_S, AGREE_S = 2.0, 0.5
"""For so long after a start the wheel is believed; for so long it must agree before it is believed again."""

AGREE_SDS, AGREE_SHARE = 3.0, 0.005
"""It agrees within so many standard deviations of the speed and this share of the speed."""

REST_VARIANCE = 1e-8
"""(m/s)^2: of the speed of a train that stands."""

NARROWEST = 0.1
"""Least width, in pulses, of the interval in which an edge that was just passed says the wheel is."""

SATURATION_RADIUS_M = 1000.0
"""A wheelset runs the further out the sharper the curve, up to its flange: free wheels are there at a radius
of 800 m, conventional wheelsets at 500 to 300 m; chosen so that both are nearly so."""

SCALE_FACTOR_S = 10.0
"""s: a gyro's error of scale is taken for white over so long; a curve lasts as long at line speed."""


class LineModel(NamedTuple):
    """Noise and constants of the filter; `simrail.estimators.odometry.curve_matched` says where from.

    Attributes
    ----------
    pulse_m, jitter_m2, still_s, gate : float
        Way of a pulse; variance that stamps which jitter add to a reading of the way; longest time without a
        pulse that is no rest; innovations of the wheel beyond so many standard deviations are slip.
    wheel_walk_m, tread_sd, tread_length_m : float
        Random walk of `way` (m2 per m), and the Markov process `tread` in distance.
    force_m2ps3, unsteady_s05 : float
        Intensity of what disturbs the accelerometer, and its density per effort, per sqrt(Hz).
    push_walk_m2ps5, gyro_rad2ps, drift_walk_rad2ps3, gyro_scale : float
        Random walk of `push`; white noise, drift and relative scale error of the gyro.
    sway_sd_rad, sway_length_m, heading_sd_rad : float
        Markov process `sway` in distance; white part of the heading.
    turn_rad, turn_sd_rad : float
        Of `turn`, anew in each curve: mean and standard deviation.
    attack_s2pm : float
        Yaw with which the wheels carry an unbalanced lateral acceleration, rad per m/s2.
    bend_sd, shift_sd_m : float
        How wrong the map is: relative error of a curve's curvature, and of the place of a joint.
    """

    pulse_m: float
    jitter_m2: float
    still_s: float
    gate: float
    wheel_walk_m: float
    tread_sd: float
    tread_length_m: float
    force_m2ps3: float
    unsteady_s05: float
    push_walk_m2ps5: float
    gyro_rad2ps: float
    drift_walk_rad2ps3: float
    gyro_scale: float
    sway_sd_rad: float
    sway_length_m: float
    heading_sd_rad: float
    turn_rad: float
    turn_sd_rad: float
    attack_s2pm: float
    bend_sd: float
    shift_sd_m: float


class Steps(NamedTuple):
    """What the filter finds at each of n steps; the states are those of the smoother after that.

    Attributes
    ----------
    rate_hz : float
        Rate of the steps; given, as are
    time_s : ndarray (n,)
        Ends of the steps.
    states, covariance : ndarray (n, 18), (n, m, m)
        See `simrail.estimators.odometry.curve_matched`; the covariance is of the first m states. A smoother
        needs all, an odometry place and speed: of 90 minutes, 9 MB in place of 620.
    acceleration : ndarray (n,)
        Along the track, over the step; it shakes with the body.
    slipping, resting : ndarray (n,) of bool
        Where the wheel was not believed, and where the train stood.
    """

    rate_hz: float
    time_s: FloatArray
    states: FloatArray
    covariance: FloatArray
    acceleration: FloatArray
    slipping: BoolArray
    resting: BoolArray


class Scratch(NamedTuple):
    """What the filter works in. A kernel that makes its own arrays takes a second longer to compile.

    Attributes
    ----------
    f, work : ndarray (18, 18)
        F, and what `simrail.estimators.kalman.congruence` needs.
    rows : ndarray (3, 18)
        h of each update.
    gain, v : ndarray (18,)
        What `simrail.estimators.kalman.update` writes.
    """

    f: FloatArray
    work: FloatArray
    rows: FloatArray
    gain: FloatArray
    v: FloatArray


def room_to_work(states: int = STATES) -> Scratch:
    """Scratch for a filter of so many states, all zero."""
    n, m = states, UPDATES
    return Scratch(*(np.zeros(shape) for shape in ((n, n), (n, n), (m, n), n, n)))


@njit_borrowed
def forget(x: FloatArray, p: FloatArray, f: FloatArray, state: int, mean: float, sd: float) -> None:
    """Put a constant of what is ahead in place of one that is behind: known only to `sd` about its mean.

    It is a prediction with a zero in F, so that the smoother knows of it too.
    """
    for i in range(x.shape[0]):
        p[i, state] = p[state, i] = f[state, i] = 0.0
    p[state, state] = sd * sd
    x[state] = mean


@njit_borrowed
def map_ahead(
    x: FloatArray, p: FloatArray, f: FloatArray, before: Line, here: Line, model: LineModel
) -> None:
    """Turn and errors of curve and joints, where the train comes from the one to the next.

    Element i lies between joints i and i + 1. A train that comes from the element below keeps joint i, which
    was ahead and now is behind, and meets i + 1; one from above keeps i + 1. The states differ by parity.
    """
    if here.curve != before.curve:
        forget(x, p, f, BEND, 0.0, model.bend_sd)
        forget(x, p, f, TURN, model.turn_rad, model.turn_sd_rad)
    step = here.element - before.element
    if step != 0.0:
        odd_below = here.element % 2.0 == 1.0
        if step > 0.0 or abs(step) > 1.0:
            forget(x, p, f, EVEN if odd_below else ODD, 0.0, model.shift_sd_m)
        if step < 0.0 or abs(step) > 1.0:
            forget(x, p, f, ODD if odd_below else EVEN, 0.0, model.shift_sd_m)


@njit_inner
def flank(curvature: float) -> float:
    """How sharp a curve is for wheelsets, below 1, with the sign of its curvature."""
    bent = SATURATION_RADIUS_M * curvature
    sharpness: float = bent / np.sqrt(1.0 + bent * bent)
    return sharpness


@njit_borrowed
def predict(
    x: FloatArray,
    p: FloatArray,
    f: FloatArray,
    work: FloatArray,
    here: Line,
    lean: Line,
    signal: FloatArray,
    force: float,
    dt: float,
    model: LineModel,
    gravity: float,
    steady: float,
) -> tuple[float, float]:
    """One step of the model, in place: x, P and F.

    ``here`` is the design at x[S], ``lean`` that at x[S] - x[LEAD], ``signal`` the mean rates about Y and
    Z, ``force`` the mean force along the track, ``steady`` the effort without its vibration. Returns the
    acceleration, and the way that the wheel shows per metre.
    """
    n = x.shape[0]
    # Heading rate of a body in the design's cant and slope; the effort less what squat and slope feign.
    turn = (signal[0] * np.sin(here.roll) + signal[1] * np.cos(here.roll)) / np.cos(here.pitch)
    level = np.cos(lean.pitch)
    share = 1.0 / (1.0 + x[SQUAT])
    effort = (force - x[PUSH]) * share
    acceleration = level * (effort + gravity * np.sin(lean.pitch))
    # Way of the train, and of its wheel (`rolls` per metre); what is Markov in distance forgets.
    half = 0.5 * dt * dt
    way = dt * x[V] + half * acceleration
    run = abs(way)
    out = flank(here.curvature)
    left, right = max(out, 0.0), max(-out, 0.0)
    rolls = 1.0 + x[SCALE] + x[TREAD] + left * x[LEFT] + right * x[RIGHT]
    wears, sways = np.exp(-run / model.tread_length_m), np.exp(-run / model.sway_length_m)
    # The map has a curvature that is not there (`simrail.estimators.odometry.line_table`): the heading counts
    # from the map's, so it loses what the track turns beyond the map.
    astray = here.ramp_even * x[EVEN] + here.ramp_odd * x[ODD] - here.bend * x[BEND]
    # F, the derivative of all that follows by the state.
    for i in range(n):
        for j in range(n):
            f[i, j] = 1.0 if i == j else 0.0
    by_place = level * gravity * level * lean.pitch_slope
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
    f[WAY, SCALE], f[WAY, TREAD], f[WAY, LEFT], f[WAY, RIGHT] = way, way, way * left, way * right
    f[TREAD, TREAD], f[SWAY, SWAY] = wears, sways
    f[YAW, DRIFT] = -dt
    f[YAW, BEND], f[YAW, EVEN], f[YAW, ODD] = -way * here.bend, way * here.ramp_even, way * here.ramp_odd
    f[YAW, V] = dt * astray
    # The state itself.
    x[S] += way
    x[V] += dt * acceleration
    x[WAY] += rolls * way
    x[TREAD] *= wears
    x[YAW] += dt * (turn - x[DRIFT]) + way * astray
    x[SWAY] *= sways

    congruence(f, p, work)
    # What disturbs the accelerometer moves speed and position, and with them the way of the wheel.
    q = model.force_m2ps3 + (model.unsteady_s05 * steady) ** 2
    for i in (S, WAY):
        for j in (S, WAY):
            p[i, j] += q * dt**3 / 3.0
        p[i, V] += q * dt * dt / 2.0
        p[V, i] = p[i, V]
    p[V, V] += q * dt
    p[WAY, WAY] += model.wheel_walk_m * run
    p[TREAD, TREAD] += model.tread_sd**2 * (1.0 - wears * wears)
    p[PUSH, PUSH] += model.push_walk_m2ps5 * dt
    p[YAW, YAW] += model.gyro_rad2ps * dt + (model.gyro_scale * turn) ** 2 * dt * SCALE_FACTOR_S
    p[DRIFT, DRIFT] += model.drift_walk_rad2ps3 * dt
    p[SWAY, SWAY] += model.sway_sd_rad**2 * (1.0 - sways * sways)
    return acceleration, rolls


@njit_inner
def wheel_reading(
    change: float, measured: float, x: FloatArray, p: FloatArray, pulse: float, dt: float
) -> tuple[float, float]:
    """Error of the wheel's way by its count, and the width of the interval that the count leaves.

    A count says between which two edges the wheel stands; an edge that has just been passed says more at low
    speed; and without a pulse the wheel is at most at the edge (then the error is 0 inside).
    """
    error = measured - x[WAY]
    if abs(change) == 1.0:
        width = min(pulse, max(NARROWEST * pulse, (abs(x[V]) + 2.0 * np.sqrt(p[V, V])) * dt))
        return error - 0.5 * change * (pulse - width), width
    if change == 0.0:
        return np.sign(error) * max(abs(error) - 0.5 * pulse, 0.0), pulse
    return error, pulse


@njit_inner
def start_anew(x: FloatArray, p: FloatArray, f: FloatArray, measured: float, pulse: float) -> None:
    """Forget the wheel's way, which says nothing while the wheel slips: it is what the wheel reads."""
    for i in range(x.shape[0]):
        p[i, WAY] = p[WAY, i] = f[WAY, i] = 0.0
    p[WAY, WAY] = pulse * pulse / 12.0
    x[WAY] = measured


@njit_borrowed
def off_heading(
    line: Line, x: FloatArray, direction: float, model: LineModel, gravity: float, h: FloatArray
) -> float:
    """Innovation of the heading; writes the slopes by place, lag and turn in ``h``.

    The heading is that of the design where the body points (``line``); by how much less it turns in this
    curve, and by how much more since the wheels carry what cant leaves of the lateral acceleration (that
    hardly changes with place and speed); and its sway.
    """
    out = direction * flank(line.bend)
    h[S], h[LAG], h[TURN] = -line.bend, direction * line.bend, out
    unbalanced = x[V] * x[V] * line.bend + gravity * np.sin(line.roll)
    attack = direction * model.attack_s2pm * unbalanced
    innovation: float = line.heading + attack - out * x[TURN] - x[YAW] + x[SWAY]
    return innovation


@njit_borrowed
def curve_matched(
    dt: float,
    signals: FloatArray,
    count: FloatArray,
    model: LineModel,
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
    signals : ndarray (n, 4)
        Mean angular rates about Y and Z (rad/s) and mean specific forces along X and Y (m/s2) over the step
        that ends here, body axes.
    count : ndarray (n,)
        Last reading of the pulse counter at the end of the step.
    model : LineModel
        Noise.
    gravity : float
        m/s2.
    grid, table : ndarray (2,), (m, 10)
        The map (`simrail.estimators.odometry.line_table`).
    x, p : ndarray (18,), (18, 18)
        State and covariance at the start, at rest if its speed is 0; replaced by the last ones.
    steps : Steps, output
        Of n rows.
    scratch : Scratch
        All zero.
    past : History, output
        For `simrail.estimators.kalman.fixed_interval`; of no steps where no smoother follows.
    """
    f, work, h, gain, v = scratch
    pulse, keeps = model.pulse_m, past.states.shape[0] > 0
    h[WHEEL, WAY] = h[HEADING, YAW] = h[REST, V] = 1.0
    h[HEADING, SWAY] = -1.0
    direction = idle = moving = agreed = wheel_speed = steady = 0.0
    # A train that begins at speed does not rest.
    resting, slipping = x[V] == 0.0, False
    before = line_at(grid, table, x[S])
    for k in range(signals.shape[0]):
        here = line_at(grid, table, x[S])
        lean = line_at(grid, table, x[S] - x[LEAD])
        # A body askew of the track under the mount feels a share of what pushes it around the curve.
        force = signals[k, 2] * np.cos(here.askew) - signals[k, 3] * np.sin(here.askew)
        steady += dt / STEADY_S * (force - x[PUSH] - steady)
        steps.acceleration[k], rolls = predict(
            x, p, f, work, here, lean, signals[k], force, dt, model, gravity, steady
        )
        map_ahead(x, p, f, before, here, model)
        before = here

        # The wheel: where it stands, and since when it rests or rolls.
        change = count[k] - count[k - 1] if k > 0 else 0.0
        measured = (count[k] - count[0]) * pulse
        wheel_speed += WHEEL_SPEED_SHARE * (change * pulse / dt - wheel_speed)
        idle += dt
        moving += dt
        if abs(x[V]) > DIRECTION_SPEED_MPS or direction == 0.0:
            direction = np.sign(x[V])
        if change != 0.0:
            idle = 0.0
            if resting:
                # It left less than a pulse q ago, held to be standing: from rest with jerk j it is as fast
                # as (36 j q^2)^(1/3)/2 by then.
                p[V, V] += (0.5 * np.cbrt(START_JERK_MPS3 * 36.0 * pulse * pulse)) ** 2
                moving = 0.0
            resting = False
        off_way, width = wheel_reading(change, measured, x, p, pulse, dt)
        way_variance = width * width / 12.0 + model.jitter_m2

        # Slip: the innovation gives it away, and it ends when wheel and filter agree on the speed again.
        if slipping:
            off = abs(wheel_speed - x[V] * rolls)
            agrees = off < AGREE_SDS * np.sqrt(p[V, V]) + AGREE_SHARE * abs(x[V])
            agreed = agreed + dt if agrees else 0.0
            slipping = agreed <= AGREE_S
        elif moving > START_S and off_way**2 > model.gate**2 * (p[WAY, WAY] + way_variance):
            slipping, agreed = True, 0.0
        if slipping:
            start_anew(x, p, f, measured, pulse)
        resting = resting or (idle > model.still_s and abs(x[V]) * idle < 2.0 * pulse)
        if keeps:
            remember_prediction(past, k, x, p, f)

        for m in range(UPDATES):
            if m == WHEEL:
                error, variance = off_way, way_variance
                wanted = not slipping and (change != 0.0 or off_way != 0.0)
            elif m == HEADING:
                line = line_at(grid, table, x[S] - direction * x[LAG])
                error = off_heading(line, x, direction, model, gravity, h[HEADING])
                variance, wanted = model.heading_sd_rad**2, True
            else:
                error, variance, wanted = -x[V], REST_VARIANCE, resting
            if wanted:
                s = update(x, p, h[m], error, variance, gain, v)
                if keeps:
                    remember(past, k, m, h[m], gain, error, s)
        keep(steps.states, steps.covariance, k, x, p)
        steps.slipping[k], steps.resting[k] = slipping, resting
