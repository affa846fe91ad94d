"""Draws of the smoother's error: against a dense smoother, their covariances, and coverage in a band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
from scipy.special import stdtrit
from scipy.stats import binom
from simrail.estimators.trajectory.draws import FELT, geometry_draws, state_errors, stream_of
from simrail.estimators.trajectory.kernel import (
    ROWS,
    STATES,
    WIDTH,
    Model,
    Past,
    linearise,
    room_for_filtered,
    room_for_past,
    trajectory_error,
    trajectory_filter,
)
from simrail.estimators.trajectory.model import process_noise
from simrail.estimators.trajectory.noise import Hyperparameters
from simrail.estimators.trajectory.smoother import TrajectorySmoother, run_model
from simrail.estimators.trajectory.track_geometry import Sight, geometry_of, sight_of, track_geometry
from twins.trajectory import measured, transition

from simrail.core.columns import (
    ACCEL,
    ATTITUDE,
    GYRO,
    IRREGULARITY,
    IRREGULARITY_SD,
    ODOMETRY,
    ODOMETRY_SD,
    RELATIVE_POSITION,
)
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, RailSensorSheet, Recording
from simrail.track.bands import BANDS, band_pass, margin_m, sd_of_draws
from simrail.track.design import Straight, TrackDesign

SAMPLES, STEP, GRAVITY = 60, 0.004, 9.81
ONE = Hyperparameters(1e-3, 2e-3, 3e-3, 1.0, 2.0, accel_x_m2ps4=1e-2)
OTHER = Hyperparameters(4e-3, 1e-3, 1e-3, 3.0, 0.5, 1e-5, 1e-6, 2e-6, 1e-3, 4e-3, 2e-3, 1e-4, 5e-5)
START_SD = np.array([2e-3, 5e-3, 2e-3, 5e-3, 2e-3, 5e-3, 0.002, 0.005, 0.05, 0.002, 0.005, 0.05])


class Left(NamedTuple):
    """A model, and what its filter left behind."""

    model: Model
    past: Past


@lru_cache
def left(*, printed: bool = False) -> Left:
    """A steady curve with cant, whose second half is noisier; the signals are no matter."""
    turn, cant, speed = 0.05, -0.02, 15.0
    v, h = cant * turn, turn
    row = [
        cant,
        0.0,
        0.0,
        0.0,
        speed * h,
        -speed * v,
        0.0,
        -h * h,
        v * h,
        0.0,
        v * h,
        -v * v,
        0.0,
        2 * v,
        2 * h,
    ]
    track = np.tile(row, (SAMPLES, 1))
    track[:, 2] = turn * STEP * np.arange(SAMPLES)
    start = np.zeros(STATES)
    start[[0, 5, 9]] = cant, turn, 0.6
    kinds = np.repeat(np.array([0, 1], dtype=np.int64), SAMPLES // 2)
    noise = np.array([ONE.vector()[5:], OTHER.vector()[5:]])
    process = np.array([process_noise(values, STEP) for values in (ONE, OTHER)])
    signals = np.array([measured(start, term, GRAVITY)[0][:6] for term in track])
    signals += 0.05 * stream(1, "signals").standard_normal(signals.shape)
    model = Model(
        signals, track, np.full((SAMPLES if printed else 0, 3), 0.3), kinds,
        process, noise, np.array([0.0, 0.6]), start, START_SD**2, STEP, GRAVITY,
    )  # fmt: skip
    past = room_for_past(SAMPLES)
    trajectory_filter(model, past, room_for_filtered())
    return Left(model, past)


class Dense(NamedTuple):
    """Linear model of all samples, and the Rauch-Tung-Striebel smoother of it, by whole matrices."""

    f: np.ndarray
    q: list[np.ndarray]
    j: list[np.ndarray]
    gains: list[np.ndarray]
    back: list[np.ndarray]
    covariance: np.ndarray

    def smooth(self, z: np.ndarray) -> np.ndarray:
        """Smoothed states of measurements (n, 8), from a prior of mean zero."""
        n = len(z)
        before, after = np.zeros((n, STATES)), np.zeros((n, STATES))
        for k in range(n):
            before[k] = self.f @ after[k - 1] if k else 0.0
            after[k] = before[k] + self.gains[k] @ (z[k] - self.j[k] @ before[k])
        for k in range(n - 2, -1, -1):
            after[k] += self.back[k] @ (after[k + 1] - before[k + 1])
        return after


@lru_cache
def dense(*, printed: bool = False) -> Dense:
    model, past = left(printed=printed)
    f = transition(STEP)
    both = [process_noise(values, STEP) for values in (ONE, OTHER)]
    q = [both[kind] for kind in model.kinds]
    slips = model.slips if printed else [None] * SAMPLES
    j = [
        measured(x, *at)[1]
        for x, *at in zip(past.states, model.track, [GRAVITY] * SAMPLES, slips, strict=True)
    ]
    predicted, filtered, gains = [], [], []
    p = np.diag(START_SD**2)
    for k in range(SAMPLES):
        p = f @ p @ f.T + q[k] if k else p
        predicted.append(p)
        gain = np.linalg.solve(j[k] @ p @ j[k].T + np.diag(model.noise[model.kinds[k]]), j[k] @ p).T
        p = p - gain @ j[k] @ p
        p = 0.5 * (p + p.T)
        gains.append(gain)
        filtered.append(p)
    back, smoothed = [], [filtered[-1]]
    for k in range(SAMPLES - 2, -1, -1):
        g = np.linalg.solve(predicted[k + 1], f @ filtered[k]).T
        back.insert(0, g)
        smoothed.insert(0, filtered[k] + g @ (smoothed[0] - predicted[k + 1]) @ g.T)
    return Dense(f, q, j, gains, back, np.array(smoothed))


def drawn(normals: np.ndarray, *, printed: bool = False) -> np.ndarray:
    """A draw (n, 12) by the kernel."""
    model, past = left(printed=printed)
    roots = np.array([np.linalg.cholesky(process_noise(v, STEP)) for v in (ONE, OTHER)])
    errors, work = np.empty((SAMPLES, STATES)), np.empty((SAMPLES, ROWS))
    trajectory_error(model, past, roots, np.sqrt(model.noise), normals, work, errors)
    return errors


@pytest.mark.parametrize("printed", [False, True], ids=["corrected", "printed"])
def test_a_draw_is_a_simulated_truth_less_what_a_dense_smoother_makes_of_it(printed: bool) -> None:
    """Mean corrections as they stand in the book: simulate states and measurements, smooth, subtract."""
    model, twin = left(printed=printed).model, dense(printed=printed)
    normals = stream(2, "normals").standard_normal((SAMPLES, STATES + ROWS))
    truth, z = np.empty((SAMPLES, STATES)), np.empty((SAMPLES, ROWS))
    for k in range(SAMPLES):
        moved = np.linalg.cholesky(twin.q[k]) @ normals[k, :STATES]
        truth[k] = twin.f @ truth[k - 1] + moved if k else START_SD * normals[0, :STATES]
        z[k] = twin.j[k] @ truth[k] + np.sqrt(model.noise[model.kinds[k]]) * normals[k, STATES:]
    sd = np.sqrt(np.diagonal(twin.covariance, axis1=1, axis2=2))
    np.testing.assert_allclose(
        drawn(normals, printed=printed) / sd, (truth - twin.smooth(z)) / sd, rtol=0, atol=1e-6
    )


def test_covariances_are_those_of_the_smoother() -> None:
    """A draw is linear in its normal numbers, so unit vectors give its covariances without any statistics.

    At each sample those of the smoother; from one to the next P(k+1) G', G the textbook's gain backwards.
    """
    smoothed = run_model(left().model, smoothed=True)
    twin, count = dense(), STATES + ROWS
    maps = np.array([drawn(unit.reshape(SAMPLES, count)) for unit in np.eye(SAMPLES * count)])
    upper = np.triu_indices(STATES)
    for k in range(SAMPLES):
        sd = np.sqrt(np.diag(twin.covariance[k]))
        scale = np.outer(sd, sd)
        drawn_covariance = maps[:, k].T @ maps[:, k]
        np.testing.assert_allclose(drawn_covariance / scale, twin.covariance[k] / scale, rtol=0, atol=1e-6)
        ours = smoothed.covariance[k] / scale[upper]
        np.testing.assert_allclose(drawn_covariance[upper] / scale[upper], ours, rtol=0, atol=1e-7)
        if k > 0:
            cross = twin.covariance[k] @ twin.back[k - 1].T
            scale = np.outer(sd, np.sqrt(np.diag(twin.covariance[k - 1])))
            seen = maps[:, k].T @ maps[:, k - 1]
            np.testing.assert_allclose(seen / scale, cross / scale, rtol=0, atol=1e-6)


def test_what_the_estimator_keeps_is_roll_and_place() -> None:
    errors = state_errors(*left(), [stream(5, "a"), stream(5, "b")])
    for draw, name in enumerate("ab"):
        whole = drawn(stream(5, name).standard_normal((SAMPLES, STATES + ROWS)))
        np.testing.assert_allclose(errors[draw], whole[:, FELT], rtol=1e-12)


# Through the rails and into a band, on rides that the model itself made.

LINE = TrackDesign("straight", 0.0, (Straight(400.0),))
SPEED, RIDE, EDGES = 15.0, 3001, (1.0, 5.0)
TRUE = Hyperparameters(
    1e-6, 1e-6, 1e-6, 1e-2, 1e-2, 3e-6, 3e-6, 3e-6, 1e-3, 1e-3, 1e-3, 1e6, 1e6
)  # fmt: skip
SHEET = ImuSheet("model", 250.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SMOOTHER = TrajectorySmoother(
    hyperparameters=TRUE,
    second_order=False,
    rest_bias=False,
    draws=20,
    start_sd_rad=1e-3,
    start_yaw_sd_rad=1e-3,
)


def empty(name: str, *, sd_m: float = 0.0) -> Recording:
    """A ride at steady speed without signals."""
    time = pd.Index(np.arange(RIDE) * STEP, name="time_s")
    odometry = pd.DataFrame(0.0, index=time, columns=[*ODOMETRY, *ODOMETRY_SD])
    odometry["position_m"], odometry["speed_mps"] = 10.0 + SPEED * time, SPEED
    odometry["position_sd_m"] = sd_m
    imu = pd.DataFrame(0.0, index=time, columns=[*GYRO, *ACCEL])
    return Recording(
        name, imu, SHEET, "axle", "front", (0.0, 0.0, 0.6), LINE, None, None, 10.0, odometry, "model"
    )


def made(name: str, noise: Hyperparameters = TRUE) -> tuple[Recording, Estimate]:
    """A ride whose states and signals are drawn from the smoother's model, and its true states."""
    recording, rng = empty(name), stream(6, "ride", name)
    model = SMOOTHER.model(recording)
    f, root = transition(STEP), np.linalg.cholesky(process_noise(noise, STEP))
    x = model.start + np.sqrt(model.start_variance) * rng.standard_normal(STATES)
    truth, signals = np.empty((RIDE, STATES)), np.empty((RIDE, 6))
    sd = np.sqrt(noise.vector()[5:11])
    g, rows = np.zeros(ROWS), np.zeros((ROWS, WIDTH))  # measurements are judged in test_equations
    for k in range(RIDE):
        x = f @ x + root @ rng.standard_normal(STATES) if k else x
        truth[k] = x
        linearise(x, model.track, model.slips, k, model.gravity, g, rows)
        signals[k] = g[:6] + sd * rng.standard_normal(6)
    recording.imu.loc[:, [*GYRO, *ACCEL]] = signals
    states = pd.DataFrame(truth[:, [0, 2, 4, 6, 9]], recording.imu.index, [*ATTITUDE, *RELATIVE_POSITION])
    return recording, Estimate(states, "axle")


RIDES = {False: 16, True: 48}
"""How many are judged: every time, and in the slow run."""


@lru_cache
def shares(scale: float, rides: int) -> tuple[np.ndarray, int]:
    """How many places are inside the interval in the band of `EDGES`, by irregularity, and out of how many.

    Places a longest wave apart, where an error of the band has forgotten itself.
    """
    noise = Hyperparameters(*(TRUE.vector() * np.r_[np.full(11, scale**2), 1.0, 1.0]).tolist())
    inside, count = np.zeros(3), 0
    for ride in range(rides):
        recording, truth = made(f"ride {ride}", noise)
        estimate = SMOOTHER.estimate(recording)
        true, found = track_geometry(truth, recording), estimate.geometry
        assert found is not None and estimate.geometry_draws is not None
        crop = round(margin_m(EDGES) / 0.25)
        at = np.arange(crop, len(found) - crop, 20)
        for i, name in enumerate(IRREGULARITY[:3]):
            error = band_pass((found - true)[name].to_numpy(), EDGES, step_m=0.25)
            sd = sd_of_draws(band_pass(estimate.geometry_draws[:, :, i], EDGES, step_m=0.25))
            inside[i] += np.count_nonzero(np.abs(error[at]) <= 1.96 * sd[at])
        count += len(at)
    return inside, count


SLOW = pytest.mark.parametrize("slow", [False, pytest.param(True, marks=pytest.mark.slow)])


@pytest.mark.long
@SLOW
def test_the_interval_in_a_band_holds_95_of_100(slow: bool) -> None:
    inside, count = shares(1.0, RIDES[slow])
    low, high = binom.ppf([0.005 / 3, 1.0 - 0.005 / 3], count, 0.95)
    assert (low <= inside).all() and (inside <= high).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scale", "slow"), [(1.4, False), *(pytest.param(by, True, marks=pytest.mark.slow) for by in (0.7, 1.4))]
)
def test_an_interval_too_wide_or_too_narrow_by_two_fifths_is_seen(scale: float, slow: bool) -> None:
    inside, count = shares(scale, RIDES[slow])
    low, high = binom.ppf([0.005 / 3, 1.0 - 0.005 / 3], count, 0.95)
    assert ((inside < low) if scale > 1.0 else (inside > high)).all()


def test_the_factor_of_few_draws_is_students() -> None:
    """Of m draws and one error: 95 % inside, where 1.96 of the plain root holds less."""
    rng = stream(7, "normals")
    draws, errors = rng.standard_normal((4, 100_000)), rng.standard_normal(100_000)
    inside = np.count_nonzero(np.abs(errors) <= 1.959964 * sd_of_draws(draws))
    low, high = binom.ppf([0.005, 0.995], 100_000, 0.95)
    assert low <= inside <= high
    plain = np.count_nonzero(np.abs(errors) <= 1.959964 * np.sqrt(np.square(draws).mean(axis=0)))
    assert plain < low
    assert sd_of_draws(np.ones((20, 1)))[0] == pytest.approx(stdtrit(20, 0.975) / 1.959964)


def sight(recording: Recording, *, sd_m: float = 0.0, noise_m: float = 0.0) -> tuple[Sight, pd.DataFrame]:
    """Wavy rails, seen by a rail sensor of some noise."""
    place = recording.odometry["position_m"].to_numpy()
    n = len(place)
    wave = 1e-3 * np.sin(2.0 * np.pi * place / 12.0)
    seen = np.column_stack([wave + 0.7, -0.6 + 0.5 * wave, 0.3 * wave - 0.7, -0.6 - 0.2 * wave])
    recording = replace(
        recording,
        rail_displacement=pd.DataFrame(seen, index=recording.imu.index),
        rail_sensor_sheet=RailSensorSheet(noise_m),
    )
    recording.odometry["position_sd_m"] = sd_m
    states = pd.DataFrame(np.zeros((n, 5)), recording.imu.index, [*ATTITUDE, *RELATIVE_POSITION])
    sds = {"roll_sd_rad": 0.0, "lateral_sd_m": 0.0, "vertical_sd_m": 0.0}
    estimate = Estimate(states.assign(**sds), "axle")
    return sight_of(estimate, recording), track_geometry(estimate, recording)


@pytest.mark.parametrize("term", ["rail_sensor", "position", "bias"])
def test_each_term_has_the_unfiltered_sd_that_the_geometry_tells(term: str) -> None:
    """Noise of the rail sensor, displacement, bias: each alone, in the mean over the line and the draws."""
    recording, many = empty("terms"), 400
    options = {"rail_sensor": {"noise_m": 1e-4}, "position": {"sd_m": 0.3}, "bias": {}}[term]
    seen, geometry = sight(recording, **options)
    tilts = (2e-3, 1e-3) if term == "bias" else ()
    draws = geometry_draws(seen, geometry, np.zeros((many, RIDE, 3)), recording, tilts_rad=tilts, step_m=0.25)
    inner = slice(20, -20)
    told = geometry[list(IRREGULARITY_SD)].to_numpy()[inner]
    if term == "bias":
        # Alignment by the height of the rails below the IMU, cross-level over the rail base of 1.4 m.
        told = np.full((len(told), 4), np.sqrt(5e-6 / 3.0)) * [0.6, 0.0, 1.4, 0.0]
        assert np.ptp(draws[:, inner, 2], axis=1).max() < 1e-2 * np.abs(draws[:, inner, 2]).max()
    drawn_sd = np.sqrt(np.square(draws[:, inner]).mean(axis=0))
    # Displacement and bias are one number per draw: their mean square is known to sqrt(2/m) only.
    ratio = np.sqrt(np.square(drawn_sd).mean(axis=0) / np.maximum(np.square(told).mean(axis=0), 1e-20))
    judged = [0, 2] if term == "bias" else [0, 1, 2, 3]
    allowed = 0.02 if term == "rail_sensor" else 3.5 / np.sqrt(2.0 * many)
    np.testing.assert_allclose(ratio[judged], 1.0, atol=allowed)
    if term == "position":  # the wave of 12 m, moved as a whole, less itself: again a wave of 12 m
        phase = 2.0 * np.pi * geometry.index.to_numpy()[inner] / 12.0
        waves = np.column_stack([np.sin(phase), np.cos(phase)])
        beside = draws[0, inner] - waves @ np.linalg.lstsq(waves, draws[0, inner], rcond=None)[0]
        assert (np.abs(beside).max(axis=0) < 1e-2 * np.abs(draws[0, inner]).max(axis=0)).all()
    if term == "bias":  # a constant has no waves: it is gone in a band
        edges = BANDS["D1"].edges_m("cross_level")
        assert (
            np.nanmax(np.abs(band_pass(draws[0, :, 2], edges, step_m=0.25)))
            < 1e-2 * np.abs(draws[0, :, 2]).max()
        )


@pytest.mark.parametrize("unused", [slice(0, 0), slice(0, 1100), slice(900, 2000)])
def test_errors_go_to_the_places_where_they_are(unused: slice) -> None:
    """Roll, y and z that err by waves of their own: what each does to the rails by hand, used samples or not.

    With the rails 0.6 m below the IMU and 0.7 m beside it, and left side up for a positive roll.
    """
    recording = empty("places")
    seen, _ = sight(recording)
    use = np.ones(RIDE, dtype=bool)
    use[unused] = False
    seen = seen._replace(use=use)
    place = recording.odometry["position_m"].to_numpy()

    def waves(at: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * np.pi * at[:, None] / [20.0, 15.0, 12.0]) * [1e-3, 2e-3, 3e-3]

    geometry = geometry_of(seen, step_m=0.25)
    errors = waves(place)[None]
    (found,) = geometry_draws(seen, geometry, errors, recording, tilts_rad=(), step_m=0.25)
    at = geometry.index.to_numpy()
    roll, y, z = waves(at).T
    there = np.ones(len(at), dtype=bool)  # a gap of 66 m is bridged by a spline, and its ends are no places
    there[:20] = there[-20:] = False
    if unused.start:
        low, high = place[unused][[0, -1]]
        there &= (at < low - 5.0) | (at > high + 5.0)
    assert np.count_nonzero(there) > 300
    for column, true in enumerate((y + 0.6 * roll, z, 1.4 * roll)):
        np.testing.assert_allclose(found[there, column], true[there], atol=0.01 * np.abs(true).max())


def test_draws_change_nothing_else_and_are_the_same_bits_again(line_recording: Callable) -> None:
    whole = line_recording(70.0, 1, 0)
    rows = slice(6000, 9000)
    recording = replace(whole, imu=whole.imu.iloc[rows], odometry=whole.odometry.iloc[rows])
    without, few = TrajectorySmoother().estimate(recording), TrajectorySmoother(draws=3).estimate(recording)
    pd.testing.assert_frame_equal(without.states, few.states, check_exact=True)
    pd.testing.assert_frame_equal(without.geometry, few.geometry, check_exact=True)
    assert without.geometry_draws is None and few.geometry_draws is not None
    assert np.array_equal(without.covariance, few.covariance)
    again = TrajectorySmoother(draws=5).estimate(recording).geometry_draws
    assert again is not None and again.shape == (5, len(few.geometry), 4)
    assert np.array_equal(again[:3], few.geometry_draws, equal_nan=True)
    assert np.isnan(again[:, :, 3]).all() and np.isfinite(again[:, :, :3]).all()
    other = TrajectorySmoother(draws=1).estimate(replace(recording, name="another")).geometry_draws
    assert not np.array_equal(other[0, :, :3], again[0, :, :3])
    assert not np.array_equal(again[0, :, :3], again[1, :, :3])


def test_draws_of_other_recordings_are_independent() -> None:
    """Another draw of the sensors or of the track has other draws of the error; the same one, the same.

    What two machines differ by is no other recording. Coverage that is a mean over draws of the sensors has
    errors of its intervals that differ from one to the next, or a mean would not lessen them.
    """
    one = empty("ride")
    rng = stream(8, "noise")
    one.imu.loc[:] = 1e-4 * rng.standard_normal(one.imu.shape)
    other = replace(one, imu=one.imu + 1e-4 * rng.standard_normal(one.imu.shape))
    elsewhere = replace(one, imu=one.imu * (1.0 + 1e-9))
    errors, others, again = (
        state_errors(*left(), [stream_of(recording, draw, "trajectory") for draw in range(40)])
        for recording in (one, other, elsewhere)
    )
    assert np.array_equal(errors, again) and not np.array_equal(errors, others)
    # Roll at the middle of each of 40 draws: a correlation of independent numbers is below 4/sqrt(40).
    middle = SAMPLES // 2
    assert abs(np.corrcoef(errors[:, middle, 0], others[:, middle, 0])[0, 1]) < 4.0 / np.sqrt(40.0)
    shares = [stream_of(recording, 0, "tilt").uniform() for recording in (one, other)]
    assert shares[0] != shares[1]


@pytest.mark.parametrize(
    "options",
    [
        {"draws": -1},
        {"draws": 2.5},
        {"draws": True},
        {"draws": 1001},
        {"draws": 2, "smoothed": False},
        {"draws": 2, "geometry_step_m": 0.0},
    ],
)
def test_draws_that_cannot_be_are_named(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="draws"):
        TrajectorySmoother(**options)
