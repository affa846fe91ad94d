"""The compiled loops: transition against its differential equations, estimates against whole matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
import twins.track_relative as twin
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.kernel import (
    FLOWS,
    FORGETS,
    OUTPUTS,
    SEGMENT,
    Model,
    Noise,
    matern_pair,
    matern_triple,
    oscillator,
    room_for_segment,
    room_to_work,
    run_back,
    run_filter,
)

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream

DT = 0.008

ROWS = 7
"""Measurements of a step."""

RUNS = [0.0, 1e-3, 0.15, 3.0, 40.0]
"""m; lengths are of metres."""


def of_kernel(move: Callable[..., None], size: int, *arguments: float) -> tuple[FloatArray, FloatArray]:
    f, q = np.zeros((3, 3)), np.zeros((3, 3))
    move(*arguments, f, q)
    return f[:size, :size], q[:size, :size]


PROCESSES = {
    "matern 3/2": (matern_pair, twin.matern_3_2(4.4), (1.3e-3, 4.4)),
    "matern 5/2": (matern_triple, twin.matern_5_2(4.9), (4e-3, 4.9)),
    "oscillator": (oscillator, twin.swaying(0.51, 0.3), (3e-3, 0.51, 0.3)),
}


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("run", RUNS)
def test_a_process_moves_as_its_differential_equation(process: str, run: float) -> None:
    """F and Q in units of the stationary sds, to 1e-11: rounding, as F and P - F P F' are made of exps."""
    move, generator, arguments = PROCESSES[process]
    size, sd = len(generator), arguments[0]
    f, q = of_kernel(move, size, run, *arguments)
    p = twin.stationary(generator, sd)
    wanted, noise = twin.moved(generator, p, run)
    scale = np.sqrt(np.diag(p))
    np.testing.assert_allclose(
        f * scale / scale[:, None], wanted * scale / scale[:, None], rtol=0, atol=1e-11
    )
    across = np.outer(scale, scale)
    np.testing.assert_allclose(q / across, noise / across, rtol=0, atol=1e-11)
    assert np.linalg.eigvalsh(q / across).min() > -1e-14


@pytest.mark.parametrize("process", PROCESSES)
def test_the_noise_of_a_short_way_is_that_of_its_drive(process: str) -> None:
    """To first order in the way only the last derivative is driven, by -(A P + P A') at its corner."""
    move, generator, arguments = PROCESSES[process]
    size, run = len(generator), 1e-4
    p = twin.stationary(generator, arguments[0])
    drive = -(generator @ p + p @ generator.T)
    np.testing.assert_allclose(drive[:-1], 0.0, atol=1e-12 * drive[-1, -1])
    _, q = of_kernel(move, size, run, *arguments)
    assert q[-1, -1] == pytest.approx(drive[-1, -1] * run, rel=2e-3)


NOISE = Noise(
    sd=np.array([1.3e-3, 6.5e-4, 1.5e-3, 2e-3, 4e-3, 3.7e-3]),
    length=np.array([4.4, 2.6, 5.6, 100.0, 4.9, 5.1]),
    sway_hz=0.0,
    damping=0.3,
    jerk=0.05,
    tread_sd=3e-4,
    tread_length=50.0,
    lag_walk=1e-3,
    gyro_walk=1e-9,
    accel_walk=1e-8,
    forgotten_sd=np.array([2e-4, 0.01, 2e-3, 0.5, 0.4]),
)
SWAYING = NOISE._replace(sway_hz=0.51)

SIZES = np.full(at.STATES, 1e-3)
"""Of the states at the start: all unlike, so that none can stand for another."""
SIZES[[at.S, at.WAY, at.EVEN, at.ODD, at.LAG]] = 0.3, 0.2, 0.5, 0.4, 0.6
SIZES[[at.V, at.A, at.Y_BEND]] = 0.1, 0.2, 3.0


def random_model(noise: Noise, steps: int = 15) -> Model:
    """Measurements and outputs of all states, moves to and fro, rests, joints; some are not measured."""
    rng = stream(3, "track-relative", steps)
    width = 21
    columns = np.array([rng.permutation(at.STATES)[:width] for _ in range(ROWS)])
    columns[:, -1] = 0  # as the table pads shorter rows; a state that is there twice counts twice
    left_out = np.setdiff1d(np.arange(at.STATES), columns)
    columns[-1, : len(left_out)] = left_out
    coefficients = rng.standard_normal((steps, ROWS, width)) / SIZES[columns]
    said_columns = np.array([rng.permutation(at.STATES)[:7] for _ in range(OUTPUTS)])
    flows = np.ones((steps, FLOWS))
    way = rng.uniform(-1.0, 2.0, steps)
    way[::5] = 0.0
    flows[:, 0], flows[:, 1] = np.abs(way), way
    flows[:, 2:7] = way[:, None] * rng.uniform(-0.01, 0.01, (steps, 5))
    flows[:, 5:7] = rng.uniform(0.0, 1.0, (steps, 2))
    for row in range(7, 12):
        flows[rng.integers(1, steps), row], flows[rng.integers(1, steps), row] = 0.0, 0.6
    flows[:, 13] = np.exp(-0.1 * np.abs(way))
    flows[:, 12] = 1e-6 * np.abs(way)
    flows[4, 12] = 1.0
    variances = rng.uniform(0.5, 4.0, (steps, ROWS))
    variances[3, 6] = variances[7, 0] = variances[8] = np.inf
    return Model(
        columns=columns,
        coefficients=coefficients,
        measured=5.0 * rng.standard_normal((steps, ROWS)),
        variances=variances,
        flows=flows,
        said_columns=said_columns,
        said=rng.standard_normal((steps, OUTPUTS, 7)) / SIZES[said_columns],
        dt=DT,
        noise=noise,
    )


def random_start() -> tuple[FloatArray, FloatArray]:
    """State, and a covariance that is full."""
    rng = stream(4, "track-relative start")
    root = np.eye(at.STATES) + 0.05 * rng.standard_normal((at.STATES, at.STATES))
    p = np.zeros((at.STATES, at.WIDTH))
    p[:, : at.STATES] = root @ root.T * np.outer(SIZES, SIZES)
    return SIZES * rng.standard_normal(at.STATES), p


class Run(NamedTuple):
    """What the kernels find: filtered, then smoothed; and state and covariance after the last step."""

    filtered: FloatArray
    filtered_covariance: FloatArray
    surprises: FloatArray
    total: float
    smoothed: FloatArray
    covariance: FloatArray
    x: FloatArray
    p: FloatArray


def run(model: Model, start: FloatArray, covariance: FloatArray) -> Run:
    """Filter, which keeps nothing or segments, and smoother."""
    n, work = len(model.measured), room_to_work()
    filtered, said = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    surprises, x, p = np.full((n, ROWS), np.nan), start.copy(), covariance.copy()
    none, none3 = np.empty((0, at.STATES)), np.empty((0, at.STATES, at.WIDTH))
    total = run_filter(model, none, none3, filtered, said, surprises, work, x, p)
    last, last_covariance = x.copy(), p.copy()
    count = -(-n // SEGMENT)
    starts, squares = np.empty((count, at.STATES)), np.empty((count, at.STATES, at.WIDTH))
    x[:], p[:] = start, covariance
    no_said = np.empty((0, OUTPUTS, OUTPUTS))
    assert total == run_filter(model, starts, squares, none, no_said, np.empty((0, ROWS)), work, x, p)
    smoothed, out = np.empty((n, at.STATES)), np.empty((n, OUTPUTS, OUTPUTS))
    lam, info = np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH))
    lines = np.zeros((2, OUTPUTS, at.WIDTH))
    segment = room_for_segment(SEGMENT, ROWS)
    run_back(model, starts, squares, smoothed, out, segment, work, x, p, lam, info, lines[0], lines[1])
    return Run(filtered, said, surprises, total, smoothed, out, last, last_covariance)


def said_by(model: Model, covariances: FloatArray) -> FloatArray:
    """Covariances (n, 7, 7) of the outputs."""
    rows = [twin.whole_rows(model.said_columns, said) for said in model.said]
    return np.array([a @ p @ a.T for a, p in zip(rows, covariances, strict=True)])


def require_close(found: FloatArray, wanted: FloatArray, sd: FloatArray, within: float) -> None:
    np.testing.assert_allclose(found / sd, wanted / sd, rtol=0, atol=within)


def require_covariance(found: FloatArray, wanted: FloatArray, within: float) -> None:
    """By correlation."""
    sd = np.sqrt(np.diagonal(wanted, axis1=1, axis2=2))
    across = sd[:, :, None] * sd[:, None, :]
    np.testing.assert_allclose(found / across, wanted / across, rtol=0, atol=within)


def joint(model: Model, start: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means (n, m) and covariances (n, m, m) of all states given all measurements, by one big normal law.

    All states are a linear map of white noise: of the start, and of each step. The rows of measurements are
    in units of their own noise, so that what is inverted is I + A A'.
    """
    n, width = len(model.measured), at.STATES
    steps = twin.steps_of(model)
    reach, mean = np.zeros((n, width, (n + 1) * width)), np.zeros((n, width))
    before, at_start = np.zeros((width, (n + 1) * width)), start
    before[:, :width] = np.linalg.cholesky(covariance[:, :width])
    for k, (f, q) in enumerate(steps):
        values, vectors = np.linalg.eigh(q / np.outer(SIZES, SIZES))
        reach[k] = f @ before
        reach[k][:, (k + 1) * width : (k + 2) * width] = (
            SIZES[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        )
        mean[k] = at_start = f @ at_start
        before = reach[k]
    rows, errors = [], []
    for k in range(n):
        made = np.isfinite(model.variances[k])
        h = twin.whole_rows(model.columns, model.coefficients[k])[made]
        noise = np.sqrt(model.variances[k][made])
        rows.append(h @ reach[k] / noise[:, None])
        errors.append((model.measured[k][made] - h @ mean[k]) / noise)
    a, e = np.vstack(rows), np.concatenate(errors)
    inverse = np.linalg.inv(np.eye(len(a)) + a @ a.T)
    across = reach @ a.T
    means = mean + across @ (inverse @ e)
    before = reach @ reach.transpose(0, 2, 1)
    return means, before - across @ inverse @ across.transpose(0, 2, 1)


@pytest.mark.parametrize("noise", [NOISE, SWAYING], ids=["over the way", "swaying"])
def test_the_smoother_is_the_joint_normal_law(noise: Noise) -> None:
    """Every state to 1e-8 of its own sd, the outputs' correlations to 1e-8."""
    model, (start, p) = random_model(noise), random_start()
    found, (states, covariances) = run(model, start, p), joint(model, start, p)
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    require_close(found.smoothed, states, sd, 1e-8)
    require_covariance(found.covariance, said_by(model, covariances), 1e-8)
    # After the last step filter and smoother know the same.
    require_close(found.x, states[-1], sd[-1], 1e-8)
    require_covariance(found.p[None, :, : at.STATES], covariances[-1:], 1e-8)
    assert not found.p[:, at.STATES :].any()


@pytest.mark.parametrize("noise", [NOISE, SWAYING], ids=["over the way", "swaying"])
def test_the_filter_equals_filterpy(noise: Noise) -> None:
    """States to 1e-9 of their sds, correlations, innovations and likelihood to 1e-9."""
    model, (start, p) = random_model(noise), random_start()
    found, wanted = run(model, start, p), twin.filterpy_filter(model, twin.steps_of(model), start, p)
    sd = np.sqrt(np.diagonal(wanted.covariances, axis1=1, axis2=2))
    require_close(found.filtered, wanted.states, sd, 1e-9)
    require_covariance(found.filtered_covariance, said_by(model, wanted.covariances), 1e-9)
    require_covariance(found.p[None, :, : at.STATES], wanted.covariances[-1:], 1e-9)
    np.testing.assert_allclose(found.surprises, wanted.surprises, rtol=1e-9, atol=1e-9)
    assert found.total == pytest.approx(wanted.total, rel=1e-9)


def test_every_state_matters_in_these_models() -> None:
    """Each is measured and each is said by some row: none could be lost unseen."""
    model = random_model(NOISE)
    assert set(model.columns.ravel()) == set(range(at.STATES))
    assert len(set(model.said_columns.ravel())) > 30
    assert all((model.flows[:, 7 + i] == 0.0).any() for i in range(len(FORGETS) - 1))


def test_segments_do_not_show() -> None:
    """Over two segments the smoother is filterpy's, which inverts predicted covariances: to 1e-7."""
    model, (start, p) = random_model(SWAYING, SEGMENT + 30), random_start()
    found, steps = run(model, start, p), twin.steps_of(model)
    wanted = twin.filterpy_filter(model, steps, start, p)
    states, covariances = twin.filterpy_smoother(steps, wanted)
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    require_close(found.smoothed, states, sd, 1e-7)
    require_covariance(found.covariance, said_by(model, covariances), 1e-7)
    sd = np.sqrt(np.diagonal(wanted.covariances, axis1=1, axis2=2))
    require_close(found.filtered, wanted.states, sd, 1e-9)
