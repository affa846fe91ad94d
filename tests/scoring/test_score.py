"""Scores against closed forms; consistency against the chi-square distribution; planted faults."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from simrail.core.columns import ACCEL, ACCELERATION, ATTITUDE, IMU, ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording
from simrail.scoring.aggregate import aggregate
from simrail.scoring.metrics import Series
from simrail.scoring.metrics import figures as figures_of
from simrail.scoring.score import Reference, reference_of, score, score_odometry, truth_at_imu
from simrail.scoring.table import (
    FIGURE_COLUMNS,
    LABEL_COLUMNS,
    METRICS,
    OK,
    QUANTITY_UNITS,
    SCORE_COLUMNS,
    _categorical,
    as_score_table,
    concat_scores,
    failed_figures,
    in_order,
    labelled,
)
from simrail.track.design import CURVE, STRAIGHT, TRANSITION

RATE, G = 100.0, 9.81


class PiecewiseTrack:
    """Straight 0-100, transition 100-150, curve 150-250, transition 250-300, curve 300-400, straight."""

    edges = np.array([100.0, 150.0, 250.0, 300.0, 400.0])
    kinds = np.array([STRAIGHT, TRANSITION, CURVE, TRANSITION, CURVE, STRAIGHT])

    def segment(self, s: np.ndarray) -> np.ndarray:
        return np.searchsorted(self.edges, s, side="right")

    def kind(self, s: np.ndarray) -> np.ndarray:
        return self.kinds[self.segment(s)]

    def segment_name(self, number: int) -> str:
        return f"part {number}"

    def frame(self, s: np.ndarray) -> Any:
        return SimpleNamespace(roll_rad=-0.05 + 0.0 * s, pitch_rad=0.01 + 0.0 * s, yaw_rad=3.0 + 0.002 * s)


def ride(n: int = 6000, *, rest: int = 1000, speed: float = 10.0) -> pd.DataFrame:
    """True motion at the IMU times: `rest` samples standing, then running at a constant speed."""
    t = np.arange(n) / RATE
    v = np.where(np.arange(n) < rest, 0.0, speed)
    s = np.concatenate([[0.0], np.cumsum(v[1:]) / RATE])
    columns = {
        "roll_rad": 0.03 * np.sin(0.3 * t),
        "pitch_rad": 0.01 + 0.0 * t,
        "yaw_rad": 3.0 + 0.002 * s,
        "position_m": s,
        "speed_mps": v,
        "acceleration_mps2": 0.0 * t,
        "lateral_m": 0.001 * np.sin(t),
        "vertical_m": 0.6 + 0.0 * t,
    }
    return pd.DataFrame(columns, index=pd.Index(t, name="time_s"))


def recorded(motion: pd.DataFrame) -> Recording:
    odometry = motion[list(ODOMETRY)].copy()
    odometry[list(ODOMETRY_SD)] = 1.0
    sheet = ImuSheet("test", RATE, 0.0, *([1e-3] * 6))
    imu = pd.DataFrame(np.zeros((len(motion), 6)), index=motion.index, columns=list(IMU))
    return Recording(
        name="ride",
        imu=imu,
        imu_sheet=sheet,
        mount="axle",
        mount_body="body",
        mount_position_m=(0.0, 0.0, 0.6),
        track=PiecewiseTrack(),  # type: ignore[arg-type]
        encoder=None,
        encoder_sheet=None,
        start_position_m=0.0,
        odometry=odometry,
        odometry_source="truth",
    )


def estimated(motion: pd.DataFrame, errors: dict[str, np.ndarray], **extra: np.ndarray) -> Estimate:
    states = motion[list(ATTITUDE)].copy()
    for name, error in errors.items():
        states[name] = states[name] + error
    for name, values in extra.items():
        states[name] = values
    return Estimate(states=states, mount="axle")


def pick(table: pd.DataFrame, **words: str) -> pd.Series:
    """The one row with these words (reference truth, window whole by default)."""
    words = {"reference": "truth", "window": "whole"} | words
    rows = table
    for column, word in words.items():
        rows = rows[rows[column] == word]
    assert len(rows) == 1, f"{len(rows)} rows for {words}"
    return rows.iloc[0]


def value(table: pd.DataFrame, **words: str) -> float:
    row = pick(table, **words)
    assert row["status"] == OK
    return float(row["value"])


# ---- deviations --------------------------------------------------------------------------------


def test_metrics_of_a_ramp_error_are_the_closed_forms() -> None:
    motion = ride()
    n = len(motion)
    ramp = np.deg2rad(np.linspace(-1.0, 3.0, n))
    table = score(estimated(motion, {"roll_rad": ramp}), motion, recorded(motion))
    # Uniform samples from a to b: mean (a+b)/2, variance (b-a)^2 (n+1) / (12 (n-1)).
    sd = 4.0 * np.sqrt((n + 1) / (12.0 * (n - 1)))
    assert value(table, quantity="roll", metric="mean") == pytest.approx(1.0, abs=1e-9)
    assert value(table, quantity="roll", metric="sd") == pytest.approx(sd, rel=1e-9)
    assert value(table, quantity="roll", metric="rms") == pytest.approx(np.hypot(1.0, sd), rel=1e-9)
    assert value(table, quantity="roll", metric="max") == pytest.approx(3.0, rel=1e-9)
    assert value(table, quantity="roll", metric="final") == pytest.approx(3.0, rel=1e-9)
    # abs(e) is above x for a share (3 - x) / 4 of the samples while x > 1: 5 % at x = 2.8.
    assert value(table, quantity="roll", metric="p95") == pytest.approx(2.8, abs=8.0 / n)


def test_units_are_degrees_millimetres_metres() -> None:
    motion = ride()
    estimate = estimated(
        motion,
        {"pitch_rad": np.full(len(motion), -0.01)},
        lateral_m=motion["lateral_m"].to_numpy() + 0.002,
        position_m=motion["position_m"].to_numpy() - 0.5,
    )
    table = score(estimate, motion, recorded(motion))
    assert value(table, quantity="pitch", metric="mean") == pytest.approx(np.rad2deg(-0.01))
    assert value(table, quantity="lateral", metric="mean") == pytest.approx(2.0)
    assert value(table, quantity="position", metric="mean") == pytest.approx(-0.5)
    units = table[["quantity", "metric", "unit"]].astype(str).drop_duplicates()
    assert set(units[units.quantity == "lateral"].unit) == {"mm"}
    assert set(units[units.quantity == "position"].unit) == {"m"}


def test_design_is_the_other_reference() -> None:
    motion = ride()
    table = score(estimated(motion, {}), motion, recorded(motion))
    # The estimate is the truth; the design roll is -0.05 rad everywhere.
    expected = np.rad2deg(np.sqrt(np.mean((motion["roll_rad"].to_numpy() + 0.05) ** 2)))
    assert value(table, quantity="roll", metric="rms", reference="design") == pytest.approx(
        expected, rel=1e-9
    )
    assert value(table, quantity="roll", metric="rms") == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_yaw_error_is_wrapped(turns: int) -> None:
    motion = ride()
    offset = np.deg2rad(0.7) + 2.0 * np.pi * turns
    table = score(estimated(motion, {"yaw_rad": np.full(len(motion), offset)}), motion, recorded(motion))
    for reference in ("truth", "design"):
        assert value(table, quantity="yaw", metric="mean", reference=reference) == pytest.approx(
            0.7, abs=1e-6
        )


def test_debiased_yaw_has_its_initial_offset_removed_and_keeps_its_drift() -> None:
    motion = ride()
    drift = np.deg2rad(np.linspace(0.0, 2.0, len(motion)))
    table = score(estimated(motion, {"yaw_rad": np.deg2rad(40.0) + drift}), motion, recorded(motion))
    assert value(table, quantity="yaw", metric="final") == pytest.approx(42.0, abs=1e-6)
    assert value(table, quantity="yaw_debiased", metric="final") == pytest.approx(2.0, abs=1e-6)
    # Removed is the offset at the start of the ride, not at the start of a window.
    last = value(table, quantity="yaw_debiased", metric="final", window="curve:part 4")
    assert last == pytest.approx(2.0 * 4999 / 5999, abs=2.0 * 2 / 5999)


# ---- acceleration ------------------------------------------------------------------------------


def felt(motion: pd.DataFrame, acceleration: np.ndarray) -> pd.DataFrame:
    """The motion with what a body feels that so accelerates in its own axes: gravity turned into them."""
    turns = Rotation.from_euler("ZYX", motion[list(ATTITUDE)[::-1]].to_numpy())
    gravity = turns.inv().apply([0.0, 0.0, G])
    return motion.assign(**dict(zip(ACCEL, (acceleration + gravity).T, strict=True)))


def shaking(n: int, hz: float) -> np.ndarray:
    return np.sin(2.0 * np.pi * hz * np.arange(n) / RATE)


def test_acceleration_is_the_specific_force_without_gravity_in_body_axes() -> None:
    """A body that leans, gains speed and sways; by scipy's rotations."""
    n = 6000
    acceleration = np.column_stack([np.full(n, 0.9), 0.3 * shaking(n, 0.1), shaking(n, 0.05)])
    motion = felt(ride(n), acceleration)
    own = dict(zip(ACCELERATION, (acceleration + np.array([0.02, -0.03, 0.04])).T, strict=True))
    table = score(estimated(motion, {}, **own), motion, recorded(motion))
    for axis, error in zip("xyz", (0.02, -0.03, 0.04), strict=True):
        for metric in ("mean", "max", "final"):
            size = abs(error) if metric == "max" else error
            found = value(table, quantity=f"acceleration_{axis}", metric=metric)
            assert found == pytest.approx(size, abs=1e-9)
        assert pick(table, quantity=f"acceleration_{axis}", metric="rms")["unit"] == "m/s2"


def test_gravity_is_that_of_the_recording() -> None:
    motion = felt(ride(), np.zeros((6000, 3)))
    recording = replace(recorded(motion), gravity_mps2=G - 0.5)
    table = score(estimated(motion, {}, acceleration_z_mps2=np.zeros(6000)), motion, recording)
    # Half a metre per second squared of the true force is then no gravity, all but what the roll takes.
    assert value(table, quantity="acceleration_z", metric="mean") == pytest.approx(-0.5, abs=1e-3)


@pytest.mark.parametrize(("hz", "share"), [(0.05, 1.0), (1.0, 0.5), (20.0, 0.0)])
def test_acceleration_is_scored_below_one_hertz(hz: float, share: float) -> None:
    """Twice through a Butterworth filter of second order: 1 / (1 + (f / f0)^4); the ends ring a little."""
    n = 6000
    motion = felt(ride(n), np.zeros((n, 3)))
    table = score(estimated(motion, {}, acceleration_x_mps2=shaking(n, hz)), motion, recorded(motion))
    assert value(table, quantity="acceleration_x", metric="rms") == pytest.approx(share * 0.5**0.5, abs=0.02)


def test_acceleration_needs_what_the_body_felt_and_a_finite_estimate() -> None:
    n = 6000
    motion = ride(n)
    own = np.zeros(n)
    bare = score(estimated(motion, {}, acceleration_x_mps2=own), motion, recorded(motion))
    assert "acceleration_x" not in set(bare["quantity"])
    motion, broken = felt(motion, np.zeros((n, 3))), np.where(np.arange(n) == 7, np.nan, 0.0)
    table = score(estimated(motion, {}, acceleration_x_mps2=broken), motion, recorded(motion))
    assert (
        pick(table, quantity="acceleration_x", metric="rms")["status"]
        == f"estimate not finite in 1 of {n} samples"
    )


# ---- windows -----------------------------------------------------------------------------------


def test_windows_follow_the_track_and_the_true_speed() -> None:
    motion = ride()
    n = len(motion)
    time = motion.index.to_numpy()
    position = motion["position_m"].to_numpy()
    moving = motion["speed_mps"].to_numpy() > 0.0
    masks = {
        "whole": np.ones(n, bool),
        "cropped": (time >= time[0] + 2.0) & (time <= time[-1] - 2.0),
        "standstill": ~moving,
        "moving": moving,
        "straight": moving & ((position < 100.0) | (position >= 400.0)),
        "transition": ((position >= 100.0) & (position < 150.0)) | ((position >= 250.0) & (position < 300.0)),
        "curve": ((position >= 150.0) & (position < 250.0)) | ((position >= 300.0) & (position < 400.0)),
        "curve:part 2": (position >= 150.0) & (position < 250.0),
        "curve:part 4": (position >= 300.0) & (position < 400.0),
    }
    error = np.random.default_rng(3).normal(size=n)
    table = score(estimated(motion, {"roll_rad": np.deg2rad(error)}), motion, recorded(motion))
    assert set(table["window"].unique()) == set(masks)
    for window, mask in masks.items():
        row = pick(table, quantity="roll", metric="rms", window=window)
        assert row["n_samples"] == mask.sum() > 0
        assert row["value"] == pytest.approx(np.sqrt(np.mean(error[mask] ** 2)), rel=1e-12)


def test_a_stop_in_a_curve_counts_as_standstill_only() -> None:
    motion = ride()
    position = motion["position_m"].to_numpy(copy=True)
    at = int(np.searchsorted(position, 200.0))
    motion.iloc[at : at + 300, list(motion.columns).index("speed_mps")] = 0.0
    table = score(estimated(motion, {}), motion, recorded(motion))
    expected = np.count_nonzero((position >= 150.0) & (position < 250.0)) - 300
    assert pick(table, quantity="roll", metric="rms", window="curve:part 2")["n_samples"] == expected
    assert pick(table, quantity="roll", metric="rms", window="standstill")["n_samples"] == 1300


def test_empty_window_is_a_row_that_says_so() -> None:
    motion = ride(500, rest=500)
    table = score(estimated(motion, {}, roll_sd_rad=np.full(500, 0.1)), motion, recorded(motion))
    rows = table[(table["window"] == "curve") & (table["quantity"] == "roll")]
    assert set(rows["metric"]) >= {"rms", "nees"}
    assert set(rows["status"]) == {"no samples"}
    assert rows["value"].isna().all() and (rows["n_samples"] == 0).all()


def test_a_choice_of_windows_and_metrics_is_kept_and_a_wrong_one_refused() -> None:
    motion = ride()
    recording = recorded(motion)
    table = score(estimated(motion, {}), motion, recording, windows=["whole", "curve:*"], metrics=["rms"])
    assert set(table["window"]) == {"whole", "curve:part 2", "curve:part 4"}
    assert set(table["metric"]) == {"rms"}
    with pytest.raises(InputError, match="no such window"):
        score(estimated(motion, {}), motion, recording, windows=["bend"])
    with pytest.raises(InputError, match="no such metric"):
        score(estimated(motion, {}), motion, recording, metrics=["mae"])


# ---- consistency -------------------------------------------------------------------------------


def consistency(*, sd_claimed: float = 1.0, sign: float = 1.0, seed: int = 5) -> tuple[float, float, int]:
    """NEES and coverage of roll for independent Gaussian errors with sd 1 deg."""
    motion = ride(20000)
    n = len(motion)
    error = np.deg2rad(np.random.default_rng(seed).normal(size=n))
    roll = sign * (motion["roll_rad"].to_numpy() + error)
    sd = np.full(n, np.deg2rad(sd_claimed))
    table = score(
        estimated(motion, {"roll_rad": roll - motion["roll_rad"]}, roll_sd_rad=sd), motion, recorded(motion)
    )
    return value(table, quantity="roll", metric="nees"), value(table, quantity="roll", metric="coverage95"), n


def is_consistent(nees: float, coverage: float, n: int) -> tuple[bool, bool]:
    """Two-sided 99.9 % intervals: n NEES is chi-square with n degrees of freedom, n coverage binomial."""
    low, high = stats.chi2.interval(0.999, n) / np.float64(n)
    few, many = stats.binom.interval(0.999, n, 0.95) / np.float64(n)
    return bool(low < nees < high), bool(few <= coverage <= many)


def test_consistent_errors_are_inside_both_intervals() -> None:
    assert is_consistent(*consistency()) == (True, True)


@pytest.mark.parametrize(
    "fault", [{"sd_claimed": 0.5}, {"sd_claimed": 2.0}, {"sign": -1.0}, {"sd_claimed": 1.05}]
)
def test_planted_inconsistency_is_outside_both_intervals(fault: dict[str, float]) -> None:
    assert is_consistent(*consistency(**fault)) == (False, False)


def test_each_error_is_held_against_its_own_standard_deviation() -> None:
    """(1/1)^2, (3/1.5)^2 and (2/4)^2: not the sum of squares over that of the variances."""
    series = Series("roll", "truth", np.array([1.0, -3.0, 2.0]), np.array([1.0, 1.5, 4.0]))
    ((*_, nees, unit, n, status),) = figures_of(series, {"whole": np.arange(3)}, ["nees"])
    assert (nees, unit, n, status) == (pytest.approx((1.0 + 4.0 + 0.25) / 3.0), "1", 3, OK)


@pytest.mark.parametrize(
    ("name", "share"), [("50", 0.5), ("90", 0.9), ("95", 0.95), ("99", 0.99), ("999", 0.999)]
)
def test_an_interval_ends_at_its_quantile(name: str, share: float) -> None:
    """Errors a ten-thousandth inside and outside, above and below: half of them are held."""
    end = stats.norm.ppf(0.5 + 0.5 * share)
    error = end * np.array([1.0 - 1e-4, 1.0 + 1e-4, -1.0 + 1e-4, -1.0 - 1e-4])
    series = Series("roll", "truth", 0.2 * error, np.full(4, 0.2))
    ((*_, held, unit, _, _),) = figures_of(series, {"whole": np.arange(4)}, [f"coverage{name}"])
    assert (held, unit) == (0.5, "1")


def test_halved_standard_deviation_quadruples_nees() -> None:
    nees, coverage, n = consistency(sd_claimed=0.5)
    assert nees == pytest.approx(4.0 * consistency()[0], rel=1e-9)
    assert coverage == pytest.approx(stats.norm.cdf(0.98) * 2 - 1, abs=4.0 * np.sqrt(0.25 / n))


@pytest.mark.parametrize("name", ["50", "90", "95", "99", "999"])
def test_every_coverage_is_that_of_its_normal_law(name: str) -> None:
    """Independent normal errors with the sd that is claimed: a binomial share, within 99.9 %."""
    motion = ride(20000)
    n = len(motion)
    error = np.deg2rad(np.random.default_rng(6).normal(size=n))
    states = estimated(motion, {"roll_rad": error}, roll_sd_rad=np.full(n, np.deg2rad(1.0)))
    table = score(states, motion, recorded(motion), metrics=[f"coverage{name}"])
    low, high = stats.binom.interval(0.999, n, 0.999 if name == "999" else float(name) / 100.0) / np.float64(
        n
    )
    assert low <= value(table, quantity="roll", metric=f"coverage{name}") <= high


def test_bounds_are_judged_by_the_way_and_until_a_fault() -> None:
    """Outside over a fifth of the way, of which half is behind the fault; the bound doubles halfway."""
    motion = ride()
    n, time = len(motion), motion.index.to_numpy()
    way = np.abs(motion["speed_mps"].to_numpy()) * np.gradient(time)
    run = np.cumsum(way) / way.sum()
    bound = np.where(run < 0.4, 2.0, 4.0)
    error = np.where((run > 0.7) & (run < 0.9), 5.0, 1.0)
    fault = (run > 0.8).astype(float)
    place = motion["position_m"].to_numpy() + error
    found = estimated(motion, {}, position_m=place, position_bound_m=bound, fault=fault)
    table = score(found, motion, recorded(motion), metrics=["bound", "outside", "fault"])
    kept = {name: value(table, quantity="position", metric=name) for name in ("bound", "outside", "fault")}
    assert kept["bound"] == 4.0
    assert kept["outside"] == pytest.approx(0.1, abs=3.0 / n)
    assert kept["fault"] == pytest.approx(0.2, abs=3.0 / n)
    assert not set(score(found, motion, recorded(motion))["metric"]) & {"bound", "outside", "fault"}
    # However long it stands: no way is run then. 0.6 of the way is more than half of it.
    moves = np.abs(motion["speed_mps"].to_numpy()) >= 0.01
    bound = np.where(moves, np.where(run < 0.6, 2.0, 4.0), 9.0)
    assert np.median(bound) > 2.0
    found = estimated(motion, {}, position_m=place, position_bound_m=bound, fault=fault)
    assert value(score(found, motion, recorded(motion), metrics=["bound"]), quantity="position") == 2.0


def test_consistency_stands_only_beside_the_truth_and_only_with_a_standard_deviation() -> None:
    motion = ride()
    table = score(estimated(motion, {}, roll_sd_rad=np.full(len(motion), 0.1)), motion, recorded(motion))
    rows = table[table["metric"].isin(["nees", "coverage95"])]
    assert set(rows["quantity"]) == {"roll"} and set(rows["reference"]) == {"truth"}


def test_nis_is_per_degree_of_freedom_and_skips_samples_without_update() -> None:
    motion = ride()
    n = len(motion)
    z = np.random.default_rng(7).normal(size=(n, 3))
    names = ["innovation_x_mps2", "innovation_y_mps2", "innovation_z_mps2"]
    innovations = pd.DataFrame(z, index=motion.index, columns=names)
    innovations["nis"] = (z**2).sum(axis=1)
    innovations.iloc[0] = np.nan
    estimate = Estimate(states=motion[list(ATTITUDE)], mount="axle", innovations=innovations)
    row = pick(score(estimate, motion, recorded(motion)), metric="nis")
    low, high = stats.chi2.interval(0.999, 3 * (n - 1)) / np.float64(3 * (n - 1))
    assert low < row["value"] < high
    assert row["n_samples"] == n - 1 and row["unit"] == "1"
    innovations.iloc[10, 3] = np.nan
    assert "NIS not finite in 1 of" in pick(score(estimate, motion, recorded(motion)), metric="nis")["status"]


# ---- failures ----------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_an_estimate_that_is_not_finite_is_a_reason_never_a_value(bad: float) -> None:
    motion = ride()
    estimate = estimated(motion, {}, roll_sd_rad=np.full(len(motion), 0.1))
    at = int(np.searchsorted(motion["position_m"], 200.0))
    estimate.states.iloc[at, 0] = bad
    table = score(estimate, motion, recorded(motion))
    hit = table[
        (table["quantity"] == "roll") & table["window"].isin(["whole", "moving", "curve", "curve:part 2"])
    ]
    assert hit["value"].isna().all()
    assert hit["status"].str.match(r"estimate not finite in 1 of \d+ samples").all()
    # Windows and quantities without the bad sample keep their figures.
    assert pick(table, quantity="roll", metric="rms", window="straight")["status"] == OK
    assert pick(table, quantity="pitch", metric="rms")["status"] == OK
    ok = table["status"] == OK
    assert np.isfinite(table.loc[ok, "value"]).all() and table.loc[~ok, "value"].isna().all()


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_a_standard_deviation_that_is_not_positive_is_a_reason(bad: float) -> None:
    motion = ride()
    sd = np.full(len(motion), 0.1)
    sd[17] = bad
    table = score(estimated(motion, {}, roll_sd_rad=sd), motion, recorded(motion))
    assert (
        pick(table, quantity="roll", metric="nees")["status"]
        == "standard deviation not positive in 1 of 6000 samples"
    )
    assert pick(table, quantity="roll", metric="rms")["status"] == OK


def test_an_estimate_of_other_times_or_another_mount_is_refused() -> None:
    motion = ride()
    recording = recorded(motion)
    shifted = motion.set_axis(motion.index + 0.5 / RATE)
    with pytest.raises(InputError, match="IMU times"):
        score(estimated(shifted, {}), motion, recording)
    with pytest.raises(InputError, match="another mount"):
        score(Estimate(states=motion[list(ATTITUDE)], mount="body"), motion, recording)
    with pytest.raises(InputError, match="not finite"):
        score(estimated(motion, {}), motion.assign(roll_rad=np.nan), recording)


# ---- truth, odometry, whole method ---------------------------------------------------------------


class FakeTruth:
    def __init__(self, motion: pd.DataFrame) -> None:
        self.kept, self.asked = motion, None
        self.track, self.time_s = PiecewiseTrack(), motion.index.to_numpy()

    def motion(self, mount: Any, rows: range | None = None, columns: Sequence[str] = ()) -> pd.DataFrame:
        self.asked = mount
        return self.kept if rows is None else self.kept.iloc[list(rows)]


def test_truth_at_the_imu_times_takes_samples_and_interpolates_between_them() -> None:
    fine = ride(60000)  # read as the truth's own grid
    truth = FakeTruth(fine)
    coarse = recorded(fine.iloc[::4])
    at = truth_at_imu(truth, coarse)
    pd.testing.assert_frame_equal(at, fine.iloc[::4], check_index_type=False)
    assert (truth.asked.name, truth.asked.body, truth.asked.position_m) == ("axle", "body", (0.0, 0.0, 0.6))
    between = fine.iloc[:-1].set_axis(fine.index[:-1] + 0.5 / RATE)
    mid = truth_at_imu(truth, recorded(between))
    expected = 0.5 * (fine["roll_rad"].to_numpy()[:-1] + fine["roll_rad"].to_numpy()[1:])
    np.testing.assert_allclose(mid["roll_rad"], expected, atol=1e-12)
    with pytest.raises(InputError, match=rf"time span.*limit: {fine.index[0]} to {fine.index[-11]} s"):
        truth_at_imu(FakeTruth(fine.iloc[:-10]), recorded(fine))


def test_truth_its_motion_and_the_reference_give_the_same_scores() -> None:
    motion = ride()
    recording = recorded(motion)
    estimate = estimated(motion, {"roll_rad": np.full(len(motion), 0.01)})
    reference = reference_of(motion, recording)
    assert isinstance(reference, Reference)
    tables = [score(estimate, truth, recording) for truth in (FakeTruth(motion), motion, reference)]
    pd.testing.assert_frame_equal(tables[0], tables[1])
    pd.testing.assert_frame_equal(tables[0], tables[2])


def test_odometry_is_scored_over_the_distance_run() -> None:
    motion = ride()
    recording = recorded(motion)
    odometry = recording.odometry.copy()
    odometry["position_m"] = 5.0 + 1.01 * motion["position_m"].to_numpy()
    odometry["speed_mps"] = 1.01 * motion["speed_mps"].to_numpy()
    table = score_odometry(recording.with_odometry(odometry, "encoder"), motion)
    run = motion["position_m"].iloc[-1]
    assert value(table, quantity="distance_relative", metric="final") == pytest.approx(0.01, rel=1e-9)
    assert value(table, quantity="position", metric="final") == pytest.approx(5.0 + 0.01 * run, rel=1e-9)
    assert value(table, quantity="speed", metric="mean", window="moving") == pytest.approx(0.1, rel=1e-9)
    assert set(table[table["metric"] == "coverage95"]["quantity"]) == {"position", "speed"}


def test_relative_distance_is_over_the_way_there_and_back() -> None:
    motion = ride(6000, rest=0)
    motion["position_m"] = 300.0 - np.abs(motion["position_m"] - 300.0)  # 300 m there, 299.9 m back
    recording = recorded(motion)
    odometry = recording.odometry.assign(position_m=motion["position_m"] + np.linspace(0.0, 6.0, 6000))
    table = score_odometry(recording.with_odometry(odometry, "encoder"), motion)
    assert value(table, quantity="distance_relative", metric="final") == pytest.approx(6.0 / 599.9, rel=1e-9)


def test_relative_distance_of_a_train_that_stands_has_no_value() -> None:
    motion = ride(500, rest=500)
    row = pick(score_odometry(recorded(motion), motion), quantity="distance_relative", metric="final")
    assert row["status"] == "less than 1 m run" and np.isnan(row["value"])


def test_time_per_sample_is_one_row() -> None:
    motion = ride()
    row = pick(
        score(estimated(motion, {}), motion, recorded(motion), us_per_sample=0.12), metric="us_per_sample"
    )
    assert (row["value"], row["unit"], row["n_samples"]) == (0.12, "us", 6000)


# ---- the table -----------------------------------------------------------------------------------

LABELS: dict[str, object] = {
    "cell": 3,
    "scenario": "test",
    "ride": "go",
    "vehicle": "bogie",
    "mount": "axle",
    "imu": "ideal",
    "odometry": "encoder",
    "map": "exact",
    "vibration": "off",
    "tuning": "recommended",
    "track_draw": 0,
    "sensor_draw": 0,
    "estimator": "ekf",
}


def figures(**words: object) -> pd.DataFrame:
    row: dict[str, object] = dict(
        zip(FIGURE_COLUMNS, ("roll", "full", "truth", "whole", "rms", 1.0, "deg", 9, OK), strict=True)
    )
    return pd.DataFrame([row | words])


def test_columns_and_vocabulary_are_those_of_the_design() -> None:
    written = (
        "cell, scenario, ride, vehicle, mount, imu, odometry, map, vibration, tuning, track_draw, "
        "sensor_draw, estimator, quantity, band, reference, window, metric, value, unit, n_samples, status"
    )
    assert ", ".join(SCORE_COLUMNS) == written
    quantities = (
        "roll pitch yaw lateral vertical position speed acceleration_x acceleration_y acceleration_z "
        "alignment vertical_profile cross_level gauge twist yaw_debiased distance_relative gyro_bias "
        "accel_bias "
        "derailment_quotient sum_y sum_y_relative guiding_force wheel_load wheel_unloading comfort_nmv "
        "sperling_lateral sperling_vertical lateral_growth"
    )
    assert " ".join(QUANTITY_UNITS) == quantities
    assert " ".join(METRICS) == "rms mean sd p95 p9985 max final nees nis coverage95 us_per_sample"


def test_rows_of_a_cell_stay_in_their_order() -> None:
    """However many there are, and whichever cell was ready first."""
    cell = np.random.default_rng(1).permutation(np.repeat(np.arange(5), 400))
    sorted_rows = in_order(pd.DataFrame({"cell": cell, "value": np.arange(2000.0)}))
    assert sorted_rows["cell"].is_monotonic_increasing
    assert sorted_rows.groupby("cell")["value"].is_monotonic_increasing.all()


@pytest.mark.parametrize(
    "words",
    [
        {"quantity": "heading"},
        {"band": "paper"},
        {"reference": "gnss"},
        {"window": "bend"},
        {"metric": "mae"},
        {"unit": "rad"},
        {"unit": "mm"},
        {"value": np.nan},
        {"value": np.inf},
        {"status": "failed"},
        {"colour": "red"},
    ],
)
def test_a_word_outside_the_vocabulary_is_refused(words: dict[str, object]) -> None:
    as_score_table(figures())
    with pytest.raises(ValueError, match="score table"):
        as_score_table(figures(**words))


def test_own_bands_single_curves_and_reasons_are_allowed() -> None:
    assert as_score_table(figures(band="paper"), bands=["paper"])["band"].iloc[0] == "paper"
    as_score_table(figures(window="curve:curve 4 R-250"))
    as_score_table(figures(value=np.nan, status="estimator failed: singular matrix"))


def test_tables_are_categorical_with_the_whole_vocabulary_and_lie_side_by_side() -> None:
    motion = ride()
    one = score(estimated(motion, {}), motion, recorded(motion))
    two = score(estimated(motion, {}), motion, recorded(motion), windows=["whole"], metrics=["rms"])
    for name in ("quantity", "band", "reference", "metric", "unit"):
        assert one[name].dtype == two[name].dtype
    assert list(one.columns) == list(FIGURE_COLUMNS)
    both = concat_scores(
        [labelled([(one, LABELS)]), labelled([(two, LABELS | {"estimator": "gda", "cell": 4})])]
    )
    assert list(both.columns) == list(SCORE_COLUMNS)
    assert len(both) == len(one) + len(two)
    assert all(
        isinstance(both[n].dtype, pd.CategoricalDtype) for n in SCORE_COLUMNS if n in LABEL_COLUMNS[1:8]
    )
    assert list(both["estimator"].unique()) == ["ekf", "gda"]
    np.testing.assert_array_equal(both["value"], np.concatenate([one["value"], two["value"]]))
    assert list(both["window"].astype(str)) == [*one["window"].astype(str), *two["window"].astype(str)]
    as_score_table(both)


def test_a_failed_estimate_is_one_row_with_its_reason() -> None:
    row = failed_figures("MatrixError: singular").iloc[0]
    assert row["status"] == "MatrixError: singular" and np.isnan(row["value"]) and row["n_samples"] == 0


def test_aggregate_keeps_the_two_levels_of_draws_apart() -> None:
    rng = np.random.default_rng(2)
    values = 5.0 + rng.normal(size=(4, 6)) + 10.0 * rng.normal(size=(4, 1))
    parts, cells = [], []
    for number, (track, sensor) in enumerate(np.ndindex(4, 6)):
        labels = LABELS | {"cell": number, "track_draw": track, "sensor_draw": sensor}
        parts.append(labelled([(as_score_table(figures(value=values[track, sensor])), labels)]))
        cells.append({"cell": number, "ride.speed_kmh": 20.0})
    fast = LABELS | {"cell": 99}
    parts.append(labelled([(failed_figures("broken"), fast | {"track_draw": 0})]))
    parts.append(labelled([(as_score_table(figures(value=1000.0)), fast)]))
    cells.append({"cell": 99, "ride.speed_kmh": 70.0})
    table = aggregate(concat_scores(parts), pd.DataFrame(cells))
    assert len(table) == 2
    row = table[table["ride.speed_kmh"] == 20.0].iloc[0]
    assert row["value"] == pytest.approx(values.mean())
    assert row["sd_sensor"] == pytest.approx(np.sqrt(values.var(axis=1, ddof=1).mean()))
    assert row["sd_track"] == pytest.approx(values.mean(axis=1).std(ddof=1))
    assert (row["track_draws"], row["draws"], row["failed"]) == (4, 24, 0)
    other = table[table["ride.speed_kmh"] == 70.0].iloc[0]
    assert (other["value"], other["draws"], other["failed"]) == (1000.0, 1, 1)
    assert np.isnan(other["sd_sensor"]) and np.isnan(other["sd_track"])


def test_ten_estimates_of_a_hundred_thousand_samples_take_well_under_two_seconds() -> None:
    motion = ride(100_000, speed=0.45)
    recording = recorded(motion)
    noise = np.random.default_rng(1).normal(size=len(motion)) * 0.01
    sd = np.full(len(motion), 0.01)
    estimate = estimated(
        motion, dict.fromkeys(ATTITUDE, noise), roll_sd_rad=sd, pitch_sd_rad=sd, yaw_sd_rad=sd
    )
    begun = time.process_time()
    reference = reference_of(motion, recording)
    for _ in range(10):
        score(estimate, reference, recording)
    assert time.process_time() - begun < 2.0


def test_words_of_curves_are_windows_and_nothing_else() -> None:
    assert list(_categorical("window", ["curve:12", "whole"], ())) == ["curve:12", "whole"]
    for name in ("metric", "quantity", "band", "reference", "unit"):
        with pytest.raises(ValueError, match="not in the vocabulary"):
            _categorical(name, ["curve:12"], ())
    assert list(_categorical("band", ["mine"], ("mine",))) == ["mine"]
    with pytest.raises(ValueError, match="not in the vocabulary"):
        _categorical("band", ["mine"], ())
    assert list(_categorical("estimator", ["curve:12"], ())) == ["curve:12"]
