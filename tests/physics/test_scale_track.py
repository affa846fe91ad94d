"""Rail geometry on the scale track: the accuracy of paper 001, and why alignment errs at the start of a ride.

Gonzalez-Carbajal et al. 2023, Tables 1 and 2: the standard deviations of what their filtered profiles err by,
the best of each column. They leave a peak of the alignment in the first metres to further work.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import signal
from simrail.estimators.attitude.rest_bias import rest_bias
from simrail.estimators.baselines import ZeroTrack
from simrail.estimators.track_relative import rails as rails_of_body
from simrail.estimators.track_relative.model import steps_of
from simrail.estimators.track_relative.smoother import TrackRelativeSmoother
from simrail.estimators.trajectory.smoother import TrajectorySmoother
from simrail.estimators.tuning.file import Tuning

from simrail.campaign.campaign import run_campaign
from simrail.campaign.cell import record_cell
from simrail.core.columns import GYRO
from simrail.core.jit import FloatArray
from simrail.core.toml_files import shipped
from simrail.estimation.estimate import Estimate, Estimator
from simrail.recording.recording import Recording
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.scenario.scenario import load_scenario
from simrail.scoring.geometry import score_geometry
from simrail.scoring.table import OK, UNOBSERVABLE
from simrail.track.bands import TOO_COARSE, TOO_SHORT, Band
from simrail.track.laid_track import LaidTrack

pytestmark = [pytest.mark.usefixtures("own_cache"), pytest.mark.long]

PAPER_MM = {"cross_level": 0.12, "vertical_profile": 0.38, "alignment": 0.66}
"""The goal; the paper's own best are 0.111, 0.356 and 0.659 mm."""

PAPER = Band("paper", 0.3, 7.0)
STEP_M, DRAWS = 0.05, 3
HAND = Tuning.from_file(Path(shipped("scenario")["scale_track"]).parent / "tunings" / "scale_by_hand.toml")
SMOOTHER = TrajectorySmoother(tuning=HAND, passes=2, geometry_step_m=STEP_M, with_covariance=False)

Rides = Callable[..., list[Recording]]


@pytest.fixture(scope="module")
def ride(own_cache: None) -> tuple[Rides, LaidTrack]:
    """Recordings of the first 60 m of the shipped ride, some draws of some IMU; and the rails."""
    settings = ("ride.end_m=61.0", "monte_carlo.track_draws=1", f"monte_carlo.sensor_draws={DRAWS}")

    def record(*more: str) -> list[Recording]:
        scenario = load_scenario("scale_track", overrides=[*settings, *more])
        parts = Parts(scenario)
        chosen = [cell for cell in cells(scenario) if cell.imu.name == "body"]
        return [record_cell(cell, simulate(parts.ride(cell)), parts) for cell in chosen]

    scenario = load_scenario("scale_track", overrides=settings)
    rails = Parts(scenario).rails(next(iter(cells(scenario))))
    return record, rails


def grade(name: str) -> str:
    return f'imu.grade="{name}"'


def pooled_sd(estimator: Estimator, recordings: list[Recording], rails: LaidTrack) -> dict[str, float]:
    """Root of the mean square, over draws, of the sd in the paper's band, by quantity."""
    rows = pd.concat(
        score_geometry(
            estimator.estimate(recording), rails, recording, bands=[PAPER], windows=["whole"], metrics=["sd"]
        )
        for recording in recordings
    )
    rows = rows[(rows["band"] == "paper") & (rows["status"] == OK)]
    return {
        str(name): float(np.sqrt(np.mean(values**2)))
        for name, values in rows.groupby("quantity", observed=True)["value"]
    }


def test_with_the_rails_in_sight_it_errs_less_than_the_paper(ride: tuple[Rides, LaidTrack]) -> None:
    record, rails = ride
    recordings = record(grade("adis16505_1"))
    assert len(recordings) == DRAWS
    ours = pooled_sd(SMOOTHER, recordings, rails)
    for quantity, most in PAPER_MM.items():
        assert ours[quantity] <= most
    # What no sensor at all errs by lies above the goals, but for alignment: that is to be beaten, too.
    nothing = pooled_sd(ZeroTrack(step_m=STEP_M), recordings, rails)
    for quantity in PAPER_MM:
        assert ours[quantity] < 0.5 * nothing[quantity]
    assert ours["gauge"] < 0.05


def test_without_sight_or_a_second_pass_it_errs_more(ride: tuple[Rides, LaidTrack]) -> None:
    """With an IMU without errors: a body on springs feels about half of the cross-level."""
    record, rails = ride
    recordings = record(grade("ideal"))[:1]
    both = pooled_sd(SMOOTHER, recordings, rails)
    blind = pooled_sd(replace(SMOOTHER, rail_sensor=False), recordings, rails)
    assert blind["cross_level"] > 3.0 * PAPER_MM["cross_level"]
    assert "gauge" in both and "gauge" not in blind
    # Bodies roll by 8 mrad rms here.
    once = pooled_sd(replace(SMOOTHER, passes=1), recordings, rails)
    assert both["vertical_profile"] < 0.85 * once["vertical_profile"]


@pytest.mark.slow
def test_over_twenty_draws_it_errs_less_than_the_paper() -> None:
    """The whole scenario: four lays of the rails by five draws of the sensors, and no sight beside it."""
    result = run_campaign(load_scenario("scale_track"))
    assert result.failures == []
    rows = result.scores.query("window == 'whole' and metric == 'sd' and band == 'paper'")
    for imu in ("lord_3dm_gx4_25", "adis16505_1"):
        for quantity, most in PAPER_MM.items():
            chosen = rows[(rows["imu"] == imu) & (rows["quantity"] == quantity)]
            ours = chosen[chosen["estimator"] == "smoother"]["value"]
            blind = chosen[chosen["estimator"] == "smoother_camera_free"]["value"]
            assert len(ours) == len(blind) == 20
            assert np.sqrt(np.mean(ours**2)) <= most
            assert np.sqrt(np.mean(blind**2)) > np.sqrt(np.mean(ours**2))


# The track-relative smoother, whose body of a model is seen at full rate.

SCALED_D1 = Band("scaled_d1", 0.3, 2.5)
IN_FULL = TrackRelativeSmoother(geometry_step_m=STEP_M, draws=20)
RAILS = ("vertical_profile", "cross_level", "alignment")


def in_d1(estimate: Estimate, recording: Recording, rails: LaidTrack, metric: str) -> FloatArray:
    rows = score_geometry(estimate, rails, recording, bands=[SCALED_D1], windows=["whole"], metrics=[metric])
    rows = rows[(rows["band"] == SCALED_D1.name) & (rows["status"] == OK)].set_index("quantity")
    return rows.loc[list(RAILS), "value"].to_numpy(dtype=np.float64)


def test_the_rails_of_a_models_body_are_near_and_their_intervals_hold(
    ride: tuple[Rides, LaidTrack], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One ride with three devices; without the ends of the body profile and alignment err twice as much."""
    record, rails = ride
    recordings = record(grade("lord_3dm_gx4_25"))
    estimates = [IN_FULL.estimate(recording) for recording in recordings]

    def pooled(metric: str, found: list[Estimate]) -> FloatArray:
        each = [in_d1(one, seen, rails, metric) for one, seen in zip(found, recordings, strict=True)]
        return np.asarray(np.sqrt(np.mean(np.square(each), axis=0)))

    covered, error = pooled("coverage95", estimates), pooled("sd", estimates)
    assert (covered > 0.85).all()  # of one draw of the rails: some twenty waves of the longest
    assert (error < [0.05, 0.08, 0.07]).all()
    monkeypatch.setattr(rails_of_body, "ends_of", lambda *_: None)
    alone = [replace(IN_FULL, draws=0).estimate(recording) for recording in recordings]
    assert (pooled("sd", alone)[[0, 2]] > 1.6 * error[[0, 2]]).all()


def test_a_rolling_wheel_of_a_model_does_not_slip(ride: tuple[Rides, LaidTrack]) -> None:
    """A body that sways as by its scale alone was .4 m off its own wheel, which knows to centimetres."""
    for recording in ride[0](grade("lord_3dm_gx4_25")):
        steps = steps_of(recording, 31.25)
        assert recording.odometry is not None and not steps.slipping.any()
        wheel = np.interp(steps.time_s, recording.odometry.index, recording.odometry["position_m"])
        assert np.abs(steps.odometry[:, 0] - wheel).max() < 0.12


@pytest.mark.slow
def test_intervals_of_the_rails_hold_over_six_rides() -> None:
    """Six draws of the rails, a device each: by as many waves the share is known to some 3 %."""
    scenario = load_scenario("scale_greatest", overrides=["monte_carlo.track_draws=6"])
    parts, covered, greatest = Parts(scenario), [], []
    for cell in cells(scenario):
        recording = record_cell(cell, simulate(parts.ride(cell)), parts)
        estimate = IN_FULL.estimate(recording)
        covered.append(in_d1(estimate, recording, parts.rails(cell), "coverage95"))
        greatest.append(in_d1(estimate, recording, parts.rails(cell), "max"))
    assert (np.mean(covered, axis=0) > 0.90).all()
    assert (np.mean(covered, axis=0) < 0.99).all()
    assert (np.mean(greatest, axis=0) < [0.16, 0.25, 0.22]).all()


# The peak at the start. A fixed-interval smoother balances what its model does not have, from both sides; in
# the first metres there is one side only.


def in_band(geometry: pd.DataFrame, rails: LaidTrack) -> pd.Series:
    """Error of the alignment in the paper's band, mm, up to both ends, as the paper shows it."""
    place = geometry.index.to_numpy()
    error = 1e3 * (geometry["alignment_m"] - rails.irregularities(place)["alignment_m"])
    band = signal.butter(4, (1.0 / 7.0, 1.0 / 0.3), btype="bandpass", fs=1.0 / STEP_M, output="sos")
    return pd.Series(signal.sosfiltfilt(band, error.to_numpy()), index=geometry.index)


def start_and_middle(
    smoother: TrajectorySmoother, recordings: list[Recording], rails: LaidTrack
) -> tuple[float, float]:
    """Rms in the first 4 m, and from 14 m behind the start to 14 m before the end, mm, over recordings."""
    first, middle = [], []
    for recording in recordings:
        estimate: Estimate = smoother.estimate(recording)
        assert estimate.geometry is not None
        error = in_band(estimate.geometry, rails)
        start, end = error.index[0], error.index[-1]
        first.append(np.mean(error[: start + 4.0] ** 2))
        middle.append(np.mean(error[start + 14.0 : end - 14.0] ** 2))
    return float(np.sqrt(np.mean(first))), float(np.sqrt(np.mean(middle)))


def loose(lateral_position_m2: float) -> Tuning:
    """The tuning with another variance of the virtual measurement of y."""
    return replace(
        HAND, hyperparameters=replace(HAND.hyperparameters, lateral_position_m2=lateral_position_m2)
    )


def under_way(recording: Recording, *, from_m: float = 10.0, unbiased: bool = False) -> Recording:
    """The recording from a place on, where the train runs at 1 m/s, without the rest before."""
    first = int(np.searchsorted(recording.odometry["position_m"], from_m))
    imu = recording.imu
    if unbiased:
        imu = imu.copy()
        imu[list(GYRO)] -= rest_bias(recording).bias[-1]
    seen = recording.rail_displacement
    return replace(
        recording,
        imu=imu.iloc[first:],
        odometry=recording.odometry.iloc[first:],
        rail_displacement=None if seen is None else seen.iloc[first:],
        start_position_m=float(recording.odometry["position_m"].iloc[first]),
    )


def test_no_peak_at_the_start_after_a_rest_and_with_firm_virtual_positions(
    ride: tuple[Rides, LaidTrack],
) -> None:
    record, rails = ride
    recordings = record(grade("lord_3dm_gx4_25"))
    start, middle = start_and_middle(SMOOTHER, recordings, rails)
    assert start < 1.25 * middle
    # As soft as 1 m: the noise of the accelerometer, integrated twice, is held by nothing at the ends.
    soft_start, soft_middle = start_and_middle(replace(SMOOTHER, tuning=loose(1.0)), recordings, rails)
    assert soft_start > 2.5 * soft_middle
    assert soft_middle < 1.3 * middle
    # It grows with every softening.
    softer = [
        start_and_middle(replace(SMOOTHER, tuning=loose(value)), recordings, rails)[0]
        for value in (3e-2, 3e-1)
    ]
    assert start < softer[0] < softer[1] < soft_start


def test_a_gyro_bias_makes_a_peak_where_no_rest_tells_it(ride: tuple[Rides, LaidTrack]) -> None:
    record, rails = ride
    recordings = record(grade("lord_3dm_gx4_25"))
    smoother = replace(SMOOTHER, rest_bias=False)
    biased, middle = start_and_middle(smoother, [under_way(one) for one in recordings], rails)
    known, same = start_and_middle(smoother, [under_way(one, unbiased=True) for one in recordings], rails)
    assert biased > 3.0 * middle and biased > 2.0 * known
    assert same == pytest.approx(middle, rel=0.1)


def test_an_attitude_that_is_asserted_at_the_start_makes_a_peak(ride: tuple[Rides, LaidTrack]) -> None:
    """Without any error of the sensors: the body rolls with the rails, by mrad, where the design says 0."""
    record, rails = ride
    recordings = [under_way(one) for one in record(grade("ideal"))[:1]]
    smoother = replace(SMOOTHER, rest_bias=False)
    honest, middle = start_and_middle(smoother, recordings, rails)
    sure = replace(smoother, start_sd_rad=1e-4, start_yaw_sd_rad=1e-4)
    asserted, same = start_and_middle(sure, recordings, rails)
    assert honest < 2.0 * middle < 0.5 * asserted
    assert same == pytest.approx(middle, rel=0.1)


def test_the_odometry_does_not_make_the_peak(ride: tuple[Rides, LaidTrack]) -> None:
    record, rails = ride
    smoother = replace(SMOOTHER, tuning=loose(1.0))
    ours, _ = start_and_middle(smoother, record(grade("lord_3dm_gx4_25")), rails)
    true, _ = start_and_middle(smoother, record(grade("lord_3dm_gx4_25"), 'odometry="truth"'), rails)
    assert true > 0.75 * ours


@pytest.mark.parametrize(
    ("estimator", "band", "quantity", "reason"),
    [
        (replace(SMOOTHER, rail_sensor=False), PAPER, "gauge", UNOBSERVABLE),
        (ZeroTrack(step_m=STEP_M), PAPER, "gauge", UNOBSERVABLE),
        (SMOOTHER, Band("long", 3.0, 25.0), "alignment", TOO_SHORT),
        (replace(SMOOTHER, geometry_step_m=0.25), PAPER, "cross_level", TOO_COARSE),
    ],
    ids=[
        "gauge without the rail sensor",
        "gauge of no sensor",
        "band longer than the ride",
        "step too coarse",
    ],
)
def test_what_cannot_be_known_is_marked_by_name(
    ride: tuple[Rides, LaidTrack], estimator: Any, band: Band, quantity: str, reason: str
) -> None:
    record, rails = ride
    recording = record(grade("ideal"))[0]
    rows = score_geometry(estimator.estimate(recording), rails, recording, bands=[band])
    rows = rows[(rows["quantity"] == quantity) & (rows["status"] != OK)]
    assert len(rows) > 0 and rows["value"].isna().all()
    assert set(rows["status"].astype(str)) == {reason}
    # What can be known beside it has a value, and with the sensor so has the gauge.
    rest = score_geometry(SMOOTHER.estimate(recording), rails, recording, bands=[PAPER])
    assert (rest["status"] == OK).all() and "gauge" in set(rest["quantity"].astype(str))
