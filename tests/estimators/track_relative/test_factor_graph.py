"""The track-relative smoother against a factor graph (GTSAM) with the same model on a stretch of a ride.

The graph knows nothing of filters: it has the start, each transition and each measurement as a factor, and
eliminates them. What a transition leaves without noise is a constraint of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import twins.track_relative as twin
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.aiding import WheelWay
from simrail.estimators.track_relative.kernel import (
    OUTPUTS,
    SEGMENT,
    Model,
    room_for_segment,
    room_to_work,
    run_back,
    run_filter,
)
from simrail.estimators.track_relative.model import course_of, linearised, steps_of
from simrail.estimators.track_relative.noise import BODY

from simrail.core.jit import FloatArray

gtsam: Any = pytest.importorskip("gtsam", reason='pip install -e ".[test]"')

STEPS = 60
"""Of 32 ms: 30 m of the ride, from a straight into a curve."""

NOISELESS = 1e-18
"""Of a transition, in units of the start's variances: rounding of its matrices."""


@pytest.fixture
def stretch(rough: Callable) -> tuple[Model, FloatArray, FloatArray]:
    """Model, start and its covariance; all states are uncertain."""
    recording = rough()
    sheet = replace(
        recording.imu_sheet, gyro_scale_error=5e-3, accel_scale_error=5e-3, package_misalignment_rad=4e-3
    )
    recording = replace(recording, imu_sheet=sheet)
    steps = steps_of(recording, 31.25)
    motion = replace(BODY, torsion_sd=0.15)
    course = course_of(recording, steps, motion, (WheelWay(),), ())
    first = int(np.searchsorted(steps.odometry[:, 0], 70.0))
    start, covariance = course.start.copy(), course.start_covariance.copy()
    start[[at.S, at.V, at.A, at.WAY]] = *steps.odometry[first - 1, :3], steps.way[first - 1]
    covariance[at.HEADING, at.HEADING] = covariance[at.ROLL_SLOW, at.ROLL_SLOW] = 1e-6
    return linearised(course, slice(first, first + STEPS)), start, covariance


def smoothed(model: Model, start: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States (n, 52), and sds (n, 7) of the outputs."""
    n, work = len(model.measured), room_to_work()
    x, p, rows = start.copy(), covariance.copy(), model.measured.shape[1]
    starts, squares = np.empty((1, at.STATES)), np.empty((1, at.STATES, at.WIDTH))
    none, none3 = np.empty((0, at.STATES)), np.empty((0, OUTPUTS, OUTPUTS))
    run_filter(model, starts, squares, none, none3, np.empty((0, rows)), work, x, p)
    states, out, lines = (
        np.empty((n, at.STATES)),
        np.empty((n, OUTPUTS, OUTPUTS)),
        np.zeros((2, OUTPUTS, at.WIDTH)),
    )
    lam, info = np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH))
    segment = room_for_segment(SEGMENT, rows)
    run_back(model, starts, squares, states, out, segment, work, x, p, lam, info, lines[0], lines[1])
    return states, np.sqrt(np.diagonal(out, axis1=1, axis2=2))


def graph_of(model: Model, start: FloatArray, covariance: FloatArray, sizes: FloatArray) -> Any:
    """Key 0 is the start, key k + 1 the state at step k; in units of ``sizes``."""
    graph, unit = gtsam.GaussianFactorGraph(), gtsam.noiseModel.Unit.Create
    root = np.linalg.inv(np.linalg.cholesky(covariance[:, : at.STATES] / np.outer(sizes, sizes)))
    graph.add(gtsam.JacobianFactor(0, root, root @ (start / sizes), unit(at.STATES)))
    for k, (f, q) in enumerate(twin.steps_of(model)):
        values, vectors = np.linalg.eigh(q / np.outer(sizes, sizes))
        sds = np.where(values > NOISELESS, np.sqrt(np.maximum(values, 0.0)), 0.0)
        moved = vectors.T @ (f * sizes / sizes[:, None])
        noise = gtsam.noiseModel.Constrained.MixedSigmas(1.0, sds)
        graph.add(gtsam.JacobianFactor(k, -moved, k + 1, vectors.T, np.zeros(at.STATES), noise))
        made = np.isfinite(model.variances[k])
        sd = np.sqrt(model.variances[k][made])
        rows = twin.whole_rows(model.columns, model.coefficients[k])[made] * sizes / sd[:, None]
        graph.add(gtsam.JacobianFactor(k + 1, rows, model.measured[k][made] / sd, unit(len(sd))))
    return graph


def test_states_and_sds_are_those_of_a_factor_graph(stretch: tuple[Model, FloatArray, FloatArray]) -> None:
    """To 1e-5 of an sd: rounding of two eliminations, each of numbers to 1e-9 of the largest."""
    model, start, covariance = stretch
    sizes = np.sqrt(np.diag(covariance[:, : at.STATES]))
    sizes[sizes == 0.0] = 1.0
    states, sds = smoothed(model, start, covariance)
    graph = graph_of(model, start, covariance, sizes)
    found = graph.optimize()
    marginals = gtsam.Marginals(graph, found)
    for k in (0, STEPS // 2, STEPS - 1):
        spread = marginals.marginalCovariance(k + 1) * np.outer(sizes, sizes)
        sd = np.sqrt(np.maximum(np.diag(spread), 1e-18 * sizes**2))
        np.testing.assert_allclose(found.at(k + 1) * sizes / sd, states[k] / sd, rtol=0, atol=1e-5)
        rows = twin.whole_rows(model.said_columns, model.said[k])
        wanted = np.sqrt(np.diag(rows @ spread @ rows.T))
        np.testing.assert_allclose(sds[k], wanted, rtol=1e-5)
