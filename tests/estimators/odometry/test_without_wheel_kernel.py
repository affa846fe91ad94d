"""How a filter's errors hang together, by the joint law; and the derivative of a step along the line."""

from __future__ import annotations

import numpy as np
import pytest
from simrail.estimators.kalman import History, remember, remember_prediction, room_for_history, update
from simrail.estimators.odometry.kernel import (
    DRIFT,
    LEAD,
    SCALE,
    SWAY,
    LineModel,
    S,
    Steps,
    V,
    room_to_work,
)
from simrail.estimators.odometry.line_table import Line
from simrail.estimators.odometry.without_wheel import process_of
from simrail.estimators.odometry.without_wheel_kernel import (
    BUMP,
    GRADE,
    HEADING,
    LOST_M,
    OFFSET,
    REST,
    ROWS,
    SLOPE,
    STATES,
    TILT,
    Reckoned,
    SlopeModel,
    about,
    neighbours,
    predict_reckoned,
    without_wheel,
)

from simrail.core.seeds import stream

N, K = 4, 7
NOISE = np.array([[1e-4, 2e-5, 1e-5], [2e-5, 1e-4, -3e-5], [1e-5, -3e-5, 2e-4]])
PICKED = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 2.0, -0.5, 0.0]])


def filtered() -> tuple[History, np.ndarray, np.ndarray]:
    """A filter of four states over seven steps, of which some have an update or two; its history, F and Q."""
    rng = stream(3, "neighbours")
    f = np.eye(N) + 0.3 * rng.standard_normal((K, N, N))
    roots = rng.standard_normal((K, N, N))
    q = roots @ roots.transpose(0, 2, 1)
    past, x, p = room_for_history(K, N, 2), np.zeros(N), np.eye(N)
    for k in range(K):
        p = f[k] @ p @ f[k].T + q[k]
        remember_prediction(past, k, x, p, f[k])
        for m in range((0, 2, 1)[k % 3]):
            h, gain, v = rng.standard_normal(N), np.empty(N), np.empty(N)
            s = update(x, p, h, 0.0, 0.7, gain, v)
            remember(past, k, m, h, gain, 0.0, s)
    return past, f, q


def joint(past: History, f: np.ndarray, q: np.ndarray, smoothed: bool) -> np.ndarray:
    """Covariance of the errors of all steps (K N, K N): what states and noises make of them, all at once."""
    after = [np.eye(N)] * K
    rows, noises = [], []
    for k in range(K):
        for m in range(2):
            if past.inverses[k, m] > 0.0:
                row = np.zeros(K * N)
                row[k * N : (k + 1) * N] = past.rows[k, m]
                rows.append(row)
                noises.append((k, m))
                after[k] = (np.eye(N) - np.outer(past.gains[k, m], past.rows[k, m])) @ after[k]
    # Of the states themselves: x = L u with u = (start, w_1, w_2, ..).
    carries = np.zeros((K * N, (K + 1) * N))
    spread = np.zeros(((K + 1) * N,) * 2)
    spread[:N, :N] = np.eye(N)
    carried = np.zeros((N, (K + 1) * N))
    carried[:, :N] = np.eye(N)
    error, errors = carried.copy(), np.zeros((K * N, (K + 1) * N + len(rows)))
    error = np.hstack([error, np.zeros((N, len(rows)))])
    for k in range(K):
        at = slice((k + 1) * N, (k + 2) * N)
        spread[at, at] = q[k]
        carried, error = f[k] @ carried, f[k] @ error
        carried[:, at] += np.eye(N)
        error[:, at] += np.eye(N)
        for number, (step, m) in enumerate(noises):
            if step == k:
                gain = past.gains[k, m]
                error -= np.outer(gain, past.rows[k, m] @ error)
                error[:, (K + 1) * N + number] -= gain
        carries[k * N : (k + 1) * N], errors[k * N : (k + 1) * N] = carried, error
    if smoothed:
        states = carries @ spread @ carries.T
        h = np.array(rows)
        return states - states @ h.T @ np.linalg.solve(h @ states @ h.T + 0.7 * np.eye(len(h)), h @ states)
    whole = np.zeros(((K + 1) * N + len(rows),) * 2)
    whole[: (K + 1) * N, : (K + 1) * N] = spread
    whole[(K + 1) * N :, (K + 1) * N :] = 0.7 * np.eye(len(rows))
    return errors @ whole @ errors.T


@pytest.mark.parametrize("smoothed", [False, True])
def test_neighbours_are_those_of_the_joint_law(smoothed: bool) -> None:
    """Of the smoother's errors all three; of the filter's up to a step's updates, which follow from P^+."""
    past, f, q = filtered()
    before, crossed, after = np.zeros((3, K, 2, 2))
    neighbours(past, PICKED, smoothed, before, crossed, after)
    errors = joint(past, f, q, smoothed).reshape(K, N, K, N)
    for k in range(1, K):
        last = errors[k - 1, :, k - 1]
        np.testing.assert_allclose(before[k], PICKED @ last @ PICKED.T, rtol=1e-9)
        across, own = (errors[k - 1, :, k], errors[k, :, k]) if smoothed else (last @ f[k].T, None)
        own = f[k] @ last @ f[k].T + q[k] if own is None else own
        np.testing.assert_allclose(crossed[k], PICKED @ across @ PICKED.T, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(after[k], PICKED @ own @ PICKED.T, rtol=1e-9)


def test_a_process_is_found_from_its_covariances() -> None:
    """Of a Markov process, made with known A and Q, both come back."""
    rng = stream(4, "process")
    a, root = rng.standard_normal((2, 20, 3, 3))
    q = root @ root.transpose(0, 2, 1)
    before, crossed, after = np.zeros((3, 20, 3, 3))
    after[0] = np.eye(3)
    for k in range(1, 20):
        before[k] = after[k - 1]
        crossed[k] = before[k] @ a[k].T
        after[k] = a[k] @ before[k] @ a[k].T + q[k]
    found, noises = process_of(before, crossed, after)
    size = after.max(axis=(1, 2))[:, None, None]
    np.testing.assert_allclose(found[1:], a[1:], rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose((noises / size)[1:], (q / size)[1:], atol=1e-9)
    np.testing.assert_array_equal(found[0], np.eye(3))
    np.testing.assert_array_equal(noises[0], 0.0)


HERE = Line(-0.4, -0.004, 1e-4, -5e-5, 0.05, 0.01, 1e-4, -0.004, 0.0, 3.0, 1.0)
MODEL = LineModel(*[1e-6] * len(LineModel._fields))._replace(sway_length_m=4.0, turn_rad=3e-4)
SLOPES = SlopeModel(1e-3, 8.0, 2e-4, 300.0, 2e-4)
MOVES = np.array([[0.99, 0.098, 1e-3], [-0.01, 0.98, 0.02], [0.03, -0.02, 0.97]])
X = np.array([470.0, 15.0, 1e-3, 2e-3, 4e-3, 5e-4, 2e-4, 1e-3, 0.05, 0.8])
X = np.concatenate([X, [0.3, 5e-4, 1e-3, 1.5, 0.01, 0.4, -0.6, 3e-4, 0.02]])


def reckoned_steps(*, rests: float = 0.0, rest_variance: float = 4e-4) -> Reckoned:
    """Two steps of a train that runs at 15 m/s and accelerates."""
    return Reckoned(
        predicted=np.array([14.7, 14.8]),
        speed=np.array([14.7, 14.9]),
        acceleration=np.array([1.0, 1.0]),
        pitch=np.zeros(2),
        turning=np.array([-0.06, -0.06]),
        rests=np.full(2, rests),
        shifts=np.array([[0.0, 0.0], [1e-3, -2e-3]]),
        transitions=np.stack([np.eye(3), MOVES]),
        noises=np.tile(NOISE, (2, 1, 1)),
        rest_variance=rest_variance,
    )


def step(x: np.ndarray, rests: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State, noise and F after the second of them."""
    x, p, f = x.copy(), np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    predict_reckoned(x, p, f, p.copy(), HERE, reckoned_steps(rests=rests), 1, 0.1, MODEL, SLOPES, 9.81)
    return x, p, f


def test_a_step_follows_the_process_and_the_reference() -> None:
    """The errors move by A, and lose what the updates have put right; the place gets the mean speed."""
    after, _, _ = step(X)
    errors = MOVES @ [X[V] - (1.0 + X[SCALE]) * 14.7, 9.81 * X[TILT], X[OFFSET]]
    assert after[V] == pytest.approx((1.0 + X[SCALE]) * 14.8 + errors[0], rel=1e-12)
    assert 9.81 * after[TILT] == pytest.approx(errors[1] - 1e-3, rel=1e-12)
    assert after[OFFSET] == pytest.approx(errors[2] + 2e-3, rel=1e-12)
    assert after[S] == pytest.approx(X[S] + 0.05 * (X[V] + after[V]), rel=1e-12)


def innovations(x: np.ndarray, reckoned: Reckoned) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Innovations of the rows of the first step and their Jacobian; 0 where a row is not taken; the state."""
    grid, table = np.array([0.0, 1.0]), np.zeros((900, 10))
    place = np.arange(900.0)
    table[:, 0], table[:, 1], table[:, 4] = -2e-6 * place**2, -4e-6 * place, 0.05
    table[:, 5] = 1e-4 * place
    past, states = room_for_history(2, STATES, ROWS), np.empty((2, STATES))
    flags = np.zeros((2, 2), dtype=bool)
    out = Steps(10.0, np.zeros(2), states, np.empty((2, 2, 2)), np.zeros(2), *flags)
    one = reckoned._replace(
        speed=reckoned.speed[:1], predicted=reckoned.predicted[:1], noises=0.0 * reckoned.noises
    )
    p = np.diag(np.full(STATES, 1e-14))
    model = MODEL._replace(heading_sd_rad=1.0, drift_walk_rad2ps3=0.0, gyro_rad2ps=0.0)
    slopes = SLOPES._replace(slope_sd_rad=1.0)
    without_wheel(
        0.1, one, model, slopes, 9.81, grid, table, x.copy(), p, out, room_to_work(STATES), past
    )  # fmt: skip
    made = past.inverses[0] > 0.0
    return (
        np.where(made, past.errors[0] / np.where(made, past.inverses[0], 1.0), 0.0),
        past.rows[0],
        past.states[0],
    )


def test_rows_are_the_derivative_of_their_innovations() -> None:
    """Of heading, pitch and rest: e(x + d) - e(x) = -h d, x being the predicted state."""
    running, stands = reckoned_steps(), reckoned_steps(rests=1.0)
    for reckoned in (running, stands):
        error, rows, predicted = innovations(X, reckoned)
        for j in range(STATES):
            d = np.zeros(STATES)
            d[j] = 1e-4
            ahead, _, moved = innovations(X + d, reckoned)
            expected = -rows @ (moved - predicted)
            wanted = [HEADING, SLOPE] if reckoned is running else [HEADING, SLOPE, REST]
            np.testing.assert_allclose((ahead - error)[wanted], expected[wanted], atol=4e-8, err_msg=str(j))
    assert innovations(X, running)[0][REST] == 0.0
    assert innovations(X, stands)[0][REST] == pytest.approx(-innovations(X, stands)[2][V], rel=1e-6)
    assert innovations(X, reckoned_steps(rests=1.0, rest_variance=np.inf))[0][REST] == 0.0


def test_transition_is_the_derivative_of_the_step() -> None:
    """F against central differences, in a curve, at speed; a train that stands gets nowhere."""
    x = X
    _, p, f = step(x)
    for j in range(STATES):
        h = np.zeros(STATES)
        h[j] = 1e-4
        slope = (step(x + h)[0] - step(x - h)[0]) / 2e-4
        # How much a Markov state fades depends on the way that is run; F leaves that out.
        exact = [i for i in range(STATES) if i not in (BUMP, GRADE, SWAY) or j == i]
        if j not in (S, LEAD):  # the map's derivative by place is no part of a step
            np.testing.assert_allclose(f[exact, j], slope[exact], atol=2e-6, err_msg=str(j))
    # Noise of the speed moves the place with it, half a step long.
    to = np.array([[0.05, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0 / 9.81, 0.0], [0.0, 0.0, 1.0]])
    moved = [S, V, TILT, OFFSET]
    np.testing.assert_allclose(p[np.ix_(moved, moved)], to @ NOISE @ to.T)
    assert f[DRIFT, DRIFT] == 1.0
    stood, p, f = step(x, rests=1.0)
    assert stood[S] == x[S]
    assert p[S, S] == 0.0
    assert f[S, V] == 0.0


def test_a_map_about_a_place_that_is_not_known() -> None:
    """Over a vertical curve that begins half-way: its mean slope, no tangent, and what is left over."""
    grid, table = np.array([0.0, 1.0]), np.zeros((400, 10))
    table[:, 5] = 5e-4 * np.maximum(np.arange(400) - 200.0, 0.0)
    sharp, _, none = about(grid, table, 150.0, 0.9 * LOST_M, 50.0)
    assert sharp.pitch_slope == none == 0.0
    line, heading, pitch = about(grid, table, 200.0, 40.0, 50.0)
    assert line.pitch_slope == pytest.approx(2.5e-4, rel=1e-9)  # E[t max(t, 0)] of a normal t is half
    assert line.pitch > 0.0
    assert heading == 0.0
    assert pitch == pytest.approx(50.0 * about(grid, table, 200.0, 40.0, 1.0)[2])
    assert pitch > 0.0
