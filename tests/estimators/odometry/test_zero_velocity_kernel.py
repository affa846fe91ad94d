"""The zero-velocity filter against filterpy, its smoother against a joint Gaussian, and how odds add up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from simrail.estimators.kalman import History, fixed_interval, room_for_history
from simrail.estimators.odometry.standstill import PRIOR, SUREST, TURN_S
from simrail.estimators.odometry.zero_velocity_kernel import (
    DRIFT_X,
    LATERAL,
    PITCH,
    REST,
    REST_X,
    STATES,
    UPDATES,
    Found,
    Model,
    S,
    V,
    room,
    zero_velocity,
)
from twins.zero_velocity import filterpy_zero_velocity

from simrail.core.seeds import stream

STEP_S, G = 0.1, 9.81
START = np.array([120.0, 0.01, 0.03, -0.02, 2e-4, -3e-4, 1e-4, 0.01, -0.02, 2e-3])
SDS = np.array([0.1, 0.02, 0.05, 0.05, 5e-4, 5e-4, 5e-4, 0.02, 0.02, 3e-3])


def ride_of(steps: int, *, given: np.ndarray | None = None, scale_sd: float = 0.0) -> Model:
    """A train that stands, leaves into a canted curve, and stands again; noise is in its signals."""
    rng = stream(7, "zero velocity")
    time = STEP_S * np.arange(steps)
    moves = (time > 0.25 * time[-1]) & (time < 0.75 * time[-1])
    signals = np.array([1e-3, 1e-3, 1e-3, 0.02, 0.05]) * rng.standard_normal((steps, 5))
    signals[:, 3] += G * 0.02
    signals[:, 4] += G * 0.03
    signals[moves] += [0.02, 0.01, 0.08, 0.8, 0.4]
    process = np.array([1e-6, 1e-5, 1e-8, 1e-8, *[1e-11] * 3, 1e-8, 1e-8, 1e-10])
    return Model(
        step_s=STEP_S,
        gravity=G,
        lever_m=7.0,
        lag_m=0.4,
        signals=signals,
        shaking=np.full(steps, math.log(2.0)),
        turning=signals[:, :3].copy(),
        turn_s=np.full(steps, TURN_S),
        force=signals[:, 3].copy(),
        given=np.where(moves, 0.0, 1.0) if given is None else given,
        process=process,
        rest_process=0.5 * process,
        noise=np.array([0.2, 4e-4, 1e-7, 2e-7, 3e-7]),
        rest_lateral=0.05,
        rocking=0.0,
        leaning=0.0,
        still=0.0,
        rate_variance=1e-8,
        force_variance=1e-6,
        scale_variance=scale_sd**2,
        surely=math.log(99.0),
        unheard_m=0.006,
    )


NO_PAST = room_for_history(0, STATES, 1)


def run(model: Model, spoken_of: int = STATES, past: History = NO_PAST) -> Found:
    found = room(len(model.signals), spoken_of)
    zero_velocity(model, START.copy(), np.diag(SDS**2), found, past)
    return found


def test_kernel_equals_filterpy() -> None:
    """To 1e-9 of each state's standard deviation at the start, and of the covariances' scale."""
    model = ride_of(80, scale_sd=0.01)
    ours, theirs = run(model), room(80, STATES)
    filterpy_zero_velocity(model, START, np.diag(SDS**2), model.given > 0.0, theirs)
    np.testing.assert_allclose(ours.states / SDS, theirs.states / SDS, rtol=1e-9, atol=1e-9)
    scale = SDS[:, None] * SDS
    np.testing.assert_allclose(ours.covariances / scale, theirs.covariances / scale, rtol=1e-9, atol=1e-9)
    assert np.abs(ours.states[:, V]).max() > 1.0
    np.testing.assert_array_equal(run(model, 4).covariances, ours.covariances[:, :4, :4])


def test_filter_and_smoother_equal_the_joint_gaussian() -> None:
    """All states given all rows, by one inversion: the states' joint covariance, made of F and Q."""
    n = 24
    model = ride_of(n)
    past = room_for_history(n, STATES, UPDATES)
    filtered = run(model, past=past)
    states, covariances = np.empty((n, STATES)), np.empty((n, STATES, STATES))
    fixed_interval(past, states, covariances)

    joint, p = np.zeros((n, STATES, n, STATES)), np.diag(SDS**2)
    mean, x, before = np.empty((n, STATES)), START, START
    stood = True
    for k in range(n):
        f, rests = past.transitions[k], model.given[k] > 0.0
        if stood and not rests:
            p_then = filtered.covariances[k - 1]
            misled = p_then[:, V] / model.noise[REST] * model.unheard_m / STEP_S
            p = p + np.outer(misled, misled)
        stood = rests
        # Affine: what the filter took for the state a step ago is led to what it predicts.
        x = past.states[k] + f @ (x - before)
        p = f @ p @ f.T + np.diag(model.rest_process if rests else model.process)
        mean[k], before = x, filtered.states[k]
        for i in range(k):
            joint[k, :, i] = f @ joint[k - 1, :, i]
            joint[i, :, k] = joint[k, :, i].T
        joint[k, :, k] = p
    rows, errors, noise = [], [], []
    for k in range(n):
        x = past.states[k].copy()
        for m in range(UPDATES):
            if past.inverses[k, m] > 0.0:
                row, e = np.zeros((n, STATES)), past.errors[k, m] / past.inverses[k, m]
                row[k] = past.rows[k, m]
                rows.append(row.ravel())
                errors.append(e + row[k] @ (x - mean[k]))
                rests = model.given[k] > 0.0
                noise.append(model.rest_lateral if rests and m == LATERAL else model.noise[m])
                x += past.gains[k, m] * e
    h, sigma = np.array(rows), joint.reshape(n * STATES, n * STATES)
    gain = np.linalg.solve(h @ sigma @ h.T + np.diag(noise), h @ sigma).T
    all_states = mean + (gain @ np.array(errors)).reshape(n, STATES)
    all_covariances = (sigma - gain @ h @ sigma).reshape(n, STATES, n, STATES)
    scale = SDS[:, None] * SDS
    np.testing.assert_allclose(states / SDS, all_states / SDS, rtol=1e-7, atol=1e-7)
    for k in range(n):
        np.testing.assert_allclose(covariances[k] / scale, all_covariances[k, :, k] / scale, atol=1e-7)
    np.testing.assert_allclose(filtered.states[-1] / SDS, all_states[-1] / SDS, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("times", [0.0, 1.0, 4.0])
def test_the_gyros_show_by_how_much_passengers_turn_a_body(times: float) -> None:
    """After 150 s of rest the filter is as sure as one that is told; what it took before is forgotten.

    Of 600 rows a variance is known to sqrt(2/600) = 6 %, and what the filter knows goes by its root: four
    standard deviations are 12 %. What it took before would be wrong by a factor of sqrt(5) = 2.2 or more.
    """
    steps, rate_variance, before = 1500, 1e-8, 4e-8
    noise = stream(5, "passengers").standard_normal((steps, 5))
    turned = rate_variance + times * before
    model = ride_of(steps, given=np.ones(steps))
    model = model._replace(
        signals=noise * [*[math.sqrt(turned / STEP_S)] * 3, 1e-3, 1e-3] + [0.0, 0.0, 0.0, G * 0.02, G * 0.03],
        rate_variance=rate_variance,
        leaning=0.36,
        still=1e-12,
    )
    learnt = run(model._replace(rocking=before))
    told_noise, told_process = model.noise.copy(), model.rest_process.copy()
    told_noise[REST_X:] = turned / STEP_S
    told_process[[PITCH - 1, PITCH]] = max(0.36 * times * before, 1e-12) * STEP_S
    told = run(model._replace(rocking=0.0, noise=told_noise, rest_process=told_process))
    for state in (DRIFT_X, PITCH):
        found, right = (np.sqrt(one.covariances[-1, state, state]) for one in (learnt, told))
        assert found == pytest.approx(right, rel=0.12)


def judged(force: np.ndarray, steps: int = 200, **changes: np.ndarray) -> Found:
    """What the filter makes of a train that stands level, and of a force along X in its last steps."""
    quiet = np.zeros((steps, 5))
    quiet[-len(force) :, 3] = force
    model = ride_of(steps, given=np.full(steps, -1.0))._replace(
        **({"signals": quiet, "turning": np.zeros((steps, 3)), "force": quiet[:, 3].copy()} | changes)
    )
    found = room(steps, 2)
    start = np.zeros(STATES)
    zero_velocity(model, start, np.diag(SDS**2), found, NO_PAST)
    return found


def test_a_train_that_stands_is_held_surer_with_time() -> None:
    """It begins at rest, which is known; and nothing makes it surer than `SUREST` and its speed do."""
    odds = judged(np.zeros(1)).log_odds
    assert (odds > math.log(99.0)).all()
    assert odds.max() < PRIOR + SUREST + math.log(80.0 / (math.sqrt(2.0 * math.pi) * 1e-4))


def test_a_train_that_leaves_is_let_go_and_none_that_rocks() -> None:
    """A force of .5 m/s2 ends a rest within half a second; one of two sds of what passengers do does not."""
    leaves = judged(np.full(50, 0.5))
    first = np.flatnonzero(leaves.log_odds < 0.0)[0]
    assert 150 <= first <= 155
    assert leaves.states[-1, V] == pytest.approx(0.5 * (199 - first) * STEP_S, abs=0.2)
    assert (judged(np.full(3, 0.04)).log_odds > math.log(99.0)).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_train_that_crawls_turns(axis: int) -> None:
    """1e-3 rad/s for three seconds is what rails do at a walking pace, and no passengers."""
    turning = np.zeros((200, 3))
    turning[150:, axis] = 1e-3
    found = judged(np.zeros(1), turning=turning)
    assert (found.log_odds[150:] < 0.0).all()
    assert (found.log_odds[:150] > math.log(99.0)).all()


def test_that_nothing_shakes_is_said_once() -> None:
    """A train runs by sensors that hide it: for 90 s it shakes no more than at rest, and its speed is lost.

    All that is known is that it does not shake (2 to 1), and a speed of 3 +- 5 to 10 m/s among those to 40.
    """
    steps = 1000
    runs = np.where(np.arange(steps) < 100, 0.0, -1.0)
    process = ride_of(1).process.copy()
    process[V] = 0.1
    driven, shaking = np.zeros((steps, 5)), np.full(steps, math.log(2.0))
    driven[:60, 3] = 0.5
    shaking[60:100] = -20.0
    found = judged(
        np.zeros(1),
        steps,
        signals=driven,
        shaking=shaking,
        given=runs,
        process=process,
        rate_variance=1.0,
        force_variance=100.0,
    )
    assert (found.covariances[100:, V, V] > 3.0**2).all()
    most = PRIOR + math.log(2.0) + math.log(80.0 / (math.sqrt(2.0 * math.pi) * 3.0))
    assert found.log_odds[100:].max() < most < math.log(99.0)


def test_lost_samples_are_no_rest() -> None:
    shaking = np.full(200, math.log(2.0))
    shaking[150:] = -np.inf
    found = judged(np.zeros(1), shaking=shaking)
    assert np.isneginf(found.log_odds[150:]).all()
    assert np.isfinite(found.states[:, S]).all()
