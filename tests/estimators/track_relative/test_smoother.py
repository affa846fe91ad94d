"""The track-relative smoother and its filter on rides with a map that errs: how good, how sure, wrong use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline
from simrail.estimators.baselines import DesignAngles
from simrail.estimators.track_relative import states as at
from simrail.estimators.track_relative.kernel import SEGMENT
from simrail.estimators.track_relative.noise import AXLE
from simrail.estimators.track_relative.output import SD_COLUMNS, Trace
from simrail.estimators.track_relative.prior import PARTS
from simrail.estimators.track_relative.smoother import PIECE, TrackRelativeSmoother, log_likelihood

from simrail.core.columns import (
    ACCEL,
    ATTITUDE,
    BOUND,
    FAULT,
    GYRO,
    INNOVATION,
    IRREGULARITY,
    ODOMETRY,
    RATE_INNOVATION,
    RELATIVE_POSITION,
)
from simrail.core.errors import InputError
from simrail.core.seeds import stream
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.estimate import Estimate
from simrail.estimation.user_modules import class_named
from simrail.recording.recording import Recording, beginning
from simrail.recording.sheets.vehicle_sheet import SheetBody, VehicleSheet
from simrail.track.design import Curve
from simrail.track.file import track_by_name

DRAWN = VehicleSheet((SheetBody("body"),))
"""The mount is on what runs on the rails by itself."""

QUANTITIES = ("roll_rad", "pitch_rad", "yaw_rad", "position_m", "speed_mps", *RELATIVE_POSITION)


def errors(estimate: Estimate, motion: pd.DataFrame) -> pd.DataFrame:
    states = estimate.states
    names = [name for name in QUANTITIES if name in states]
    return states[names] - motion[names].loc[states.index]


def rms(values: pd.DataFrame) -> pd.Series:
    return np.sqrt((values**2).mean())


def drawn(recording: Recording) -> Recording:
    return replace(recording, vehicle_sheet=DRAWN)


@pytest.fixture(scope="module")
def found() -> dict[tuple[int, bool], Estimate]:
    """Estimates of the drawn ride, by direction and smoothed: made once."""
    return {}


def estimate_of(found: dict[tuple[int, bool], Estimate], rough: Callable, *key: Any) -> Estimate:
    if key not in found:
        direction, smoothed = key
        smoother = TrackRelativeSmoother(smoothed=smoothed, geometry_step_m=0.0)
        found[key] = smoother.estimate(drawn(rough(0, direction)))
    return found[key]


# --- How good ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", [1, -1])
def test_it_beats_its_map(
    rough: Callable, rough_motion: Callable, found: dict[tuple[int, bool], Estimate], direction: int
) -> None:
    """The map's cant errs by 4 mm a curve, 3 mrad of roll; its joints by 0.3 m, its radii by 1 %."""
    recording, motion = drawn(rough(0, direction)), rough_motion(0, direction)
    design = rms(errors(DesignAngles().estimate(with_odometry(recording, "encoder")), motion))
    filtered, smoothed = (rms(errors(estimate_of(found, rough, direction, s), motion)) for s in (False, True))
    assert smoothed["roll_rad"] < 0.3 * design["roll_rad"]
    assert filtered["roll_rad"] < 0.5 * design["roll_rad"]
    assert smoothed["roll_rad"] < filtered["roll_rad"]
    assert smoothed["pitch_rad"] < filtered["pitch_rad"] < 5e-4
    # Where the train begins is known to 5 cm; what the wheel's radius is uncertain by would make 0.6 m.
    assert smoothed["position_m"] < min(filtered["position_m"], 0.25)
    assert smoothed["speed_mps"] < min(filtered["speed_mps"], 0.01)
    still = rms(motion[list(RELATIVE_POSITION)] - np.array(recording.mount_position_m[1:]))
    assert (smoothed[list(RELATIVE_POSITION)] < still).all()


def test_it_needs_no_drawing(rough: Callable, rough_motion: Callable) -> None:
    """Then it takes the mount for a body that sways: less good than with one, still better than the map."""
    recording, motion = rough(), rough_motion()
    assert recording.vehicle_sheet is None
    design = rms(errors(DesignAngles().estimate(with_odometry(recording, "encoder")), motion))
    found = rms(errors(TrackRelativeSmoother().estimate(recording), motion))
    assert found["roll_rad"] < 0.4 * design["roll_rad"]
    assert found["position_m"] < 0.6


def squares_over_variances(estimate: Estimate, motion: pd.DataFrame) -> pd.Series:
    """Mean NEES of each quantity by itself."""
    return (errors(estimate, motion) ** 2 / estimate.states[list(SD_COLUMNS)].to_numpy() ** 2).mean()


@pytest.mark.parametrize("direction", [1, -1])
def test_intervals_hold_on_a_ride(
    rough: Callable, rough_motion: Callable, found: dict[tuple[int, bool], Estimate], direction: int
) -> None:
    """On one draw of map and sensors, where an error may be one constant: below three of its sds."""
    for smoothed in (False, True):
        estimate = estimate_of(found, rough, direction, smoothed)
        assert (estimate.states[list(SD_COLUMNS)] > 0.0).all(axis=None)
        assert (squares_over_variances(estimate, rough_motion(0, direction)) < 3.0**2).all()


DRAWS = 20


@pytest.mark.slow
@pytest.mark.parametrize("mount", ["drawn", "not drawn"])
@pytest.mark.parametrize("smoothed", [False, True], ids=["filter", "smoother"])
def test_intervals_hold_over_draws(
    rough: Callable, rough_motion: Callable, mount: str, smoothed: bool
) -> None:
    """Of track, map and sensors, both directions: none is covered less often than its 95 % interval says.

    Samples of a ride are anything but independent: each ride counts once, by its share of samples covered.
    More may be covered: the body of these rides moves less than the smoother fears.
    """
    shares = []
    smoother = TrackRelativeSmoother(smoothed=smoothed, geometry_step_m=0.0)
    for draw in range(DRAWS):
        for direction in (1, -1):
            recording = rough(draw, direction)
            estimate = smoother.estimate(drawn(recording) if mount == "drawn" else recording)
            error = errors(estimate, rough_motion(draw, direction)).abs()
            shares.append((error < 1.96 * estimate.states[list(SD_COLUMNS)].to_numpy()).mean())
    table = pd.DataFrame(shares)
    slack = 2.6 * table.std() / np.sqrt(len(table))
    assert (table.mean() + slack > 0.95).all(), table.mean()
    assert (table.mean() > 0.85).all()


# --- What it says -----------------------------------------------------------------------------------------


def test_states_and_innovations_are_those_of_the_trace(rough: Callable) -> None:
    recording = beginning(drawn(rough()), samples=3000)
    for smoother in (TrackRelativeSmoother(passes=1), TrackRelativeSmoother(smoothed=False)):
        estimate, trace = smoother.estimate(recording), smoother.trace(recording)
        assert list(estimate.states) == [*ATTITUDE, *ODOMETRY, *RELATIVE_POSITION, *SD_COLUMNS, *BOUND, FAULT]
        assert smoother.causal is not smoother.smoothed
        steps = trace.course.steps
        last = np.searchsorted(steps.end_s, recording.imu.index.to_numpy() + 1e-9, side="right") - 1
        sd = np.sqrt(np.diagonal(trace.covariance, axis1=1, axis2=2))[:, : len(SD_COLUMNS)]
        if smoother.smoothed:
            # A cubic spline goes through its knots.
            place = CubicSpline(recording.imu.index, estimate.states["position_m"])(steps.time_s)
            np.testing.assert_allclose(place[1:-1], trace.states[1:-1, at.S], atol=1e-6)
        else:
            known = last >= 0
            found, last = estimate.states[known], last[known]
            np.testing.assert_allclose(found[list(SD_COLUMNS)], sd[last], rtol=1e-12)
            age = recording.imu.index.to_numpy()[known] - steps.time_s[last]
            ahead = trace.states[last, at.S] + age * trace.states[last, at.V]
            np.testing.assert_allclose(found["position_m"].to_numpy(), ahead, rtol=1e-12)
            before = estimate.states["position_m"].to_numpy()[~known]
            np.testing.assert_allclose(before, recording.start_position_m, rtol=1e-12)
        innovations = estimate.innovations
        assert innovations is not None
        assert list(innovations) == [*RATE_INNOVATION, *INNOVATION]
        np.testing.assert_allclose(
            innovations["nis"], (innovations.drop(columns="nis") ** 2).sum(axis=1), rtol=1e-12
        )
        shown = np.vstack([np.zeros(6), trace.surprises[:, :6]])
        last = np.searchsorted(steps.end_s, recording.imu.index.to_numpy() + 1e-9, side="right")
        np.testing.assert_array_equal(innovations.to_numpy()[:, :6], shown[last])


def test_pieces_do_not_show(rough: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ride that is linearised and run in pieces is the ride in one: to rounding, and here to the bit."""
    recording = beginning(drawn(rough()), samples=5000)
    traces: list[tuple[Trace, Trace]] = []
    for _ in range(2):
        traces.append(
            tuple(
                TrackRelativeSmoother(smoothed=s, passes=1, rate_hz=125.0).trace(recording)
                for s in (False, True)
            )  # type: ignore[arg-type]
        )
        monkeypatch.setattr("simrail.estimators.track_relative.smoother.PIECE", 2 * SEGMENT)
    for whole, pieces in zip(*traces, strict=True):
        assert len(whole.states) > 4 * 2 * SEGMENT
        for name in ("states", "covariance", "surprises"):
            np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name), err_msg=name)
        assert pieces.log_likelihood == pytest.approx(whole.log_likelihood, rel=1e-12)


def test_the_likelihood_is_half_of_what_the_filter_sums_of_every_piece(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Squares of surprises and logarithms of their variances, whose halves a normal density has."""
    place = "simrail.estimators.track_relative.smoother"
    sums = iter((3.0, 5.0, -1.0))
    monkeypatch.setattr(f"{place}.linearised", lambda course, rows: None)
    monkeypatch.setattr(f"{place}.run_filter", lambda *_: next(sums))
    course = SimpleNamespace(
        steps=SimpleNamespace(time_s=np.zeros(2 * PIECE + 1)),
        rows=7,
        start=np.zeros(at.STATES),
        start_covariance=np.zeros((at.STATES, at.WIDTH)),
    )
    assert log_likelihood(course) == -3.5  # type: ignore[arg-type]


def test_its_rails_have_the_step_that_is_asked_for(rough: Callable) -> None:
    recording = beginning(drawn(rough()), samples=4000)
    none, half = (TrackRelativeSmoother(passes=1, geometry_step_m=step) for step in (0.0, 0.5))
    assert none.estimate(recording).geometry is None
    geometry = half.estimate(recording).geometry
    assert geometry is not None
    assert np.diff(geometry.index).mean() == pytest.approx(0.5)
    assert set(IRREGULARITY) <= set(geometry)


def test_a_second_pass_linearises_about_the_first(rough: Callable) -> None:
    recording = beginning(drawn(rough()), samples=4000)
    one, two = (TrackRelativeSmoother(passes=n).trace(recording) for n in (1, 2))
    np.testing.assert_array_equal(two.course.around.states[:, at.S], one.states[:, at.S])
    assert np.abs(one.states[:, at.S] - two.states[:, at.S]).max() < 0.1


@pytest.mark.parametrize("part", PARTS)
def test_what_is_left_out_stays_nothing(rough: Callable, part: str) -> None:
    recording = beginning(rough(), samples=3500)
    found = TrackRelativeSmoother(smoothed=False, without=part).trace(recording).states
    left = list(PARTS[part])
    np.testing.assert_array_equal(found[:, left], np.tile(found[0, left], (len(found), 1)))
    if part not in ("tilt", "lag", "drift_in_curves"):  # these have a mean, which is kept
        assert not found[:, left].any()


def test_a_motion_of_ones_own_is_taken(rough: Callable) -> None:
    recording = beginning(rough(), samples=3000)
    ours = TrackRelativeSmoother(smoothed=False, motion=AXLE).trace(recording).states
    np.testing.assert_array_equal(
        ours, TrackRelativeSmoother(smoothed=False, motion=replace(AXLE)).trace(recording).states
    )
    assert np.abs(ours - TrackRelativeSmoother(smoothed=False).trace(recording).states).max() > 1e-3


# --- Wrong use --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options",
    [
        {"passes": 0}, {"passes": 5}, {"passes": 1.5}, {"rate_hz": 5.0}, {"rate_hz": 2000.0},
        {"rate_hz": float("nan")}, {"geometry_step_m": -0.1}, {"geometry_step_m": float("nan")},
        {"without": "tilts"},
    ],
    ids=str,
)  # fmt: skip
def test_an_option_out_of_range_is_refused(options: dict[str, Any]) -> None:
    (name,) = options
    with pytest.raises(InputError) as caught:
        TrackRelativeSmoother(**options)
    assert caught.value.field == name
    assert caught.value.limit


def test_a_scenario_finds_it_by_its_name() -> None:
    assert class_named("TrackRelativeSmoother", None) is TrackRelativeSmoother


def turned_over(recording: Recording, *, about: str) -> Recording:
    """The IMU turned by 180 degrees about an axis of its own."""
    imu = recording.imu.copy()
    across = [name for name in (*GYRO, *ACCEL) if f"_{about}_" not in name]
    imu[across] = -imu[across]
    return replace(recording, imu=imu)


def noisier(recording: Recording) -> Recording:
    """Signals a hundred times noisier than the sheet says."""
    imu, rng, sheet = recording.imu.copy(), stream(11, "noisier"), recording.imu_sheet
    for names, density in ((GYRO, sheet.gyro_noise_radpsqrts), (ACCEL, sheet.accel_noise_mpsqrts)):
        sd = 100.0 * density * np.sqrt(sheet.rate_hz)
        imu[list(names)] += sd * rng.standard_normal((len(imu), 3))
    return replace(recording, imu=imu)


def mirrored_map(recording: Recording) -> Recording:
    elements = tuple(
        replace(e, radius_m=-e.radius_m) if isinstance(e, Curve) else e for e in recording.track.elements
    )
    return replace(recording, track=replace(recording.track, elements=elements))


def with_gyro_negated(recording: Recording) -> Recording:
    return replace(recording, imu=recording.imu.assign(**{GYRO[2]: -recording.imu[GYRO[2]]}))


WRONG = {
    "upside down, rolled over": lambda r: turned_over(r, about="x"),
    "upside down, pitched over": lambda r: turned_over(r, about="y"),
    "facing backwards": lambda r: turned_over(r, about="z"),
    "another line's map": lambda r: replace(r, track=track_by_name("condequinto_olivar")),
    "mirrored map": mirrored_map,
    "sheet a hundred times too good": noisier,
    "a gyro with the wrong sign": with_gyro_negated,
}


def nis(recording: Recording) -> float:
    innovations = TrackRelativeSmoother(smoothed=False).estimate(recording).innovations
    assert innovations is not None
    return float(innovations["nis"].mean())


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_use_shows(rough: Callable, wrong: str) -> None:
    """Six innovations that are right have a mean NIS of 6, less where the body moves less than was feared.

    With thousands of steps the interval of that mean is 6 +- 0.2.
    """
    assert nis(WRONG[wrong](drawn(rough()))) > 15.0


def test_right_use_does_not_show(rough: Callable) -> None:
    """Without a drawing how the body moves is a guess: it may be wrong by half as much again."""
    assert nis(drawn(rough())) < 6.2
    assert nis(rough()) < 9.0
