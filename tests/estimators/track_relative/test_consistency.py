"""Are the covariances true? On a world that is exactly the filter's, over many draws, two-sided.

States are drawn from the filter's own start and moved by its own transition and noise, over a stretch of a
ride that leaves a straight for a curve; measurements are drawn of its own linear rows. Then the NEES of any
group of states is chi-square, and so is the NIS, whatever the rows mean: that is for the tests of the
measurement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest
import twins.track_relative as twin
from scipy.stats import chi2
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
from simrail.estimators.track_relative.noise import AXLE, BODY, Motion

from simrail.core.jit import FloatArray
from simrail.core.seeds import stream
from simrail.recording.recording import Recording

SAMPLES = SEGMENT + 24
AT = (0, 100, SAMPLES - 1)
"""Steps that are judged, each by itself."""

GROUPS = {
    "angles in the track": (
        *(at.ROLL, at.ROLL_RATE, at.ROLL_SLOW, at.PITCH, at.PITCH_RATE, at.YAW, at.YAW_RATE),
    ),
    "place in the track": (at.Y, at.Y_1, at.Y_2, at.Z, at.Z_1, at.Z_2),
    "map": (at.CANT_ALONG, at.CANT_ALONG_1, at.CANT, at.SLOPE, at.CURVE, at.EVEN, at.ODD),
    "train": (at.S, at.V, at.A, at.WAY, at.SCALE, at.TREAD, at.HEADING),
    "body on its suspension": (at.LEFT, at.RIGHT, at.TILT, at.SQUAT, at.LAG, at.LEAD, at.Y_TILT),
    "biases": (at.Y_BEND, *at.GYRO_BIAS, *at.ACCEL_BIAS),
    "scales": (*at.GYRO_OF_Z, *at.ACCEL_OF_X),
    "axes and torsion": (*at.ACCEL_OF_Y, at.TORSION, at.TILT_RATE),
}
"""All states; of a body that sways, ROLL_SLOW is zero and known to be."""

ROWS = 7
"""Measurements of a step: six of the IMU, and the wheel."""


def test_the_groups_are_all_states() -> None:
    assert sorted(state for group in GROUPS.values() for state in group) == list(range(at.STATES))


class World(NamedTuple):
    model: Model
    start: FloatArray
    covariance: FloatArray


def world_of(recording: Recording, motion: Motion) -> World:
    """From 4 m before the first curve's transition on, with an IMU of which all is uncertain; synthetic."""
    sheet = replace(
        recording.imu_sheet, gyro_scale_error=5e-3, accel_scale_error=5e-3, package_misalignment_rad=4e-3
    )
    recording = replace(recording, imu_sheet=sheet)
    steps = steps_of(recording, 125.0)
    course = course_of(
        recording, steps, replace(motion, torsion_sd=0.15, tilt_rate_sd=0.05), (WheelWay(),), ()
    )
    first = int(np.searchsorted(steps.odometry[:, 0], 56.0))
    model = linearised(course, slice(first, first + SAMPLES))
    return World(model, course.start, course.start_covariance)


def drawn(world: World, draws: int, scale: float) -> tuple[FloatArray, FloatArray]:
    """States (n, draws, m) and measurements (draws, n, 7); ``scale`` spoils the noise of both."""
    rng = stream(9, "track-relative consistency", draws)
    return twin.draw(world.model, world.start, world.covariance, rng, draws=draws, scale=scale)


class Found(NamedTuple):
    """Filtered and smoothed states (n, m), innovations (n, 7), covariances (n, 7, 7) of what is said."""

    filtered: FloatArray
    smoothed: FloatArray
    surprises: FloatArray
    covariance: FloatArray
    last: FloatArray


def run(world: World, model: Model, *, with_covariance: bool) -> Found:
    count, work = -(-SAMPLES // SEGMENT), room_to_work()
    starts, squares = np.empty((count, at.STATES)), np.empty((count, at.STATES, at.WIDTH))
    n = len(model.measured)
    filtered, surprises = np.empty((n, at.STATES)), np.full((n, ROWS), np.nan)
    smoothed, covariance = np.empty((n, at.STATES)), np.empty((n if with_covariance else 0, OUTPUTS, OUTPUTS))
    x, p, none = world.start.copy(), world.covariance.copy(), np.empty((0, OUTPUTS, OUTPUTS))
    count = -(-n // SEGMENT)
    run_filter(model, starts[:count], squares[:count], filtered, none, surprises, work, x, p)
    last = p[:, : at.STATES].copy()
    lam, info, lines = np.zeros(at.STATES), np.zeros((at.STATES, at.WIDTH)), np.zeros((2, OUTPUTS, at.WIDTH))
    segment = room_for_segment(SEGMENT, ROWS)
    run_back(
        model, starts[:count], squares[:count], smoothed, covariance, segment, work, x, p, lam, info,
        lines[0], lines[1],
    )  # fmt: skip
    return Found(filtered, smoothed, surprises, covariance, last)


def first_steps(model: Model, n: int) -> Model:
    cut = {
        name: getattr(model, name)[:n] for name in ("coefficients", "measured", "variances", "flows", "said")
    }
    return model._replace(**cut)


@lru_cache(maxsize=2)
def covariances(world_of_draws: Callable[[], World]) -> dict[tuple[bool, str], list[FloatArray]]:
    """By smoothed and group, at each of `AT`; they are the same for every draw."""
    world = world_of_draws()
    model = world.model
    ends = [run(world, first_steps(model, k + 1), with_covariance=False).last for k in AT]
    found = {}
    for name in GROUPS:
        states = uncertain(world, name)
        m, columns = len(states), np.zeros((OUTPUTS, 1), dtype=np.int64)
        columns[:m, 0] = states
        said = model._replace(said_columns=columns, said=np.ones((SAMPLES, OUTPUTS, 1)))
        smoothed = run(world, said, with_covariance=True).covariance
        found[False, name] = [end[np.ix_(states, states)] for end in ends]
        found[True, name] = [smoothed[k, :m, :m] for k in AT]
    return found


def nees(error: FloatArray, covariance: FloatArray) -> FloatArray:
    sd = np.sqrt(np.diag(covariance))
    scaled = error / sd
    return np.einsum("di,di->d", scaled, np.linalg.solve(covariance / np.outer(sd, sd), scaled.T).T)


def uncertain(world: World, name: str) -> list[int]:
    """States of a group that are not known exactly."""
    return [state for state in GROUPS[name] if world.covariance[state, state] > 0.0]


Sizes = dict[tuple[bool, str], FloatArray]


@lru_cache(maxsize=4)
def judged(world_of_draws: Callable[[], World], draws: int, scale: float = 1.0) -> tuple[Sizes, FloatArray]:
    """ANEES (times,) by smoothed and group, and the NIS of all draws and steps (draws, n)."""
    world = world_of_draws()
    states, measured = drawn(world, draws, scale)
    known, model = covariances(world_of_draws), world.model
    total = {key: np.zeros(len(AT)) for key in known}
    errors = {smoothed: np.empty((len(AT), draws, at.STATES)) for smoothed in (False, True)}
    nis = np.empty((draws, SAMPLES))
    for draw in range(draws):
        found = run(world, model._replace(measured=measured[draw]), with_covariance=False)
        for smoothed, estimate in ((False, found.filtered), (True, found.smoothed)):
            errors[smoothed][:, draw] = (estimate - states[:, draw])[list(AT)]
        nis[draw] = np.nansum(found.surprises**2, axis=1)
    for (smoothed, name), at_times in known.items():
        for time, covariance in enumerate(at_times):
            error = errors[smoothed][time][:, uncertain(world, name)]
            total[smoothed, name][time] = nees(error, covariance).mean()
    return total, nis


def interval(draws: int, freedom: int, *, tests: int = 1) -> tuple[float, float]:
    """Two-sided 99 % interval of the mean of chi-square draws, shared by several tests."""
    tail = 0.005 / tests
    low, high = chi2.ppf([tail, 1.0 - tail], freedom * draws) / draws
    return float(low), float(high)


@pytest.fixture(scope="module")
def worlds() -> dict[str, Callable[[], World]]:
    return {}


def world_by(rough: Callable, worlds: dict[str, Callable[[], World]], motion: str) -> Callable[[], World]:
    if motion not in worlds:
        world = world_of(rough(), {"axle": AXLE, "body": BODY}[motion])
        worlds[motion] = lambda: world
    return worlds[motion]


def judge(world: Callable[[], World], draws: int) -> None:
    found, nis = judged(world, draws)
    for (smoothed, name), means in found.items():
        low, high = interval(draws, len(uncertain(world(), name)), tests=len(found) * len(AT))
        assert (low < means).all() and (means < high).all(), (smoothed, name, means, low, high)
    # Innovations are white: every step counts.
    made = np.isfinite(world().model.variances).sum()
    low, high = interval(draws, int(made))
    assert low < nis.sum(axis=1).mean() < high


def test_consistent_over_60_draws(rough: Callable, worlds: dict[str, Callable[[], World]]) -> None:
    judge(world_by(rough, worlds, "body"), 60)


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["axle", "body"])
def test_consistent_over_200_draws(
    rough: Callable, worlds: dict[str, Callable[[], World]], motion: str
) -> None:
    judge(world_by(rough, worlds, motion), 200)


@pytest.mark.long
@pytest.mark.parametrize("scale", [0.8, pytest.param(1.25, marks=pytest.mark.slow)])
def test_a_noise_wrong_by_a_quarter_is_noticed(
    rough: Callable, worlds: dict[str, Callable[[], World]], scale: float
) -> None:
    """The test above has the power to see it."""
    world, draws = world_by(rough, worlds, "body"), 60
    found, nis = judged(world, draws, scale)
    low, high = interval(draws, int(np.isfinite(world().model.variances).sum()))
    assert not low < nis.sum(axis=1).mean() < high
    for smoothed in (False, True):
        name = "place in the track"
        low, high = interval(draws, len(GROUPS[name]), tests=len(found) * len(AT))
        assert not low < found[smoothed, name][-1] < high


@pytest.mark.parametrize("hours", [0.1, pytest.param(1.5, marks=pytest.mark.slow)])
def test_covariances_stay_such_on_a_long_ride(rough: Callable, hours: float) -> None:
    """One ride after another, with rests: however many steps, no eigenvalue is below zero but by rounding."""
    recording = rough()
    steps = steps_of(recording, 125.0)
    course = course_of(recording, steps, BODY, (WheelWay(),), ())
    model = linearised(course, slice(0, len(steps.time_s)))
    x, p, work = course.start.copy(), course.start_covariance.copy(), room_to_work()
    none, none3, said = (
        np.empty((0, at.STATES)),
        np.empty((0, at.STATES, at.WIDTH)),
        np.empty((0, OUTPUTS, OUTPUTS)),
    )
    for _ in range(round(hours * 3600.0 / (len(steps.time_s) * steps.dt))):
        x[:] = course.start
        run_filter(model, none, none3, none, said, np.empty((0, ROWS)), work, x, p)
    sd = np.sqrt(np.diag(p))
    known = sd > 0.0  # of the rest the sheets leave nothing open
    assert known.sum() > 30 and not p[~known].any()
    correlation = (p[:, : at.STATES] / np.where(known, sd, 1.0)[:, None] / np.where(known, sd, 1.0))[known][
        :, known
    ]
    np.testing.assert_allclose(correlation, correlation.T, rtol=0, atol=1e-9)
    assert np.linalg.eigvalsh(correlation).min() > -1e-9
