"""Estimates beside a reference: at its times and places, by both standard deviations, called by its name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IRREGULARITY
from simrail.estimation.estimate import Estimate
from simrail.recording.files.asked import RideReference
from simrail.scoring.measured_reference import motion_errors, rail_errors, score_reference

TIME = pd.Index(np.arange(0.0, 100.0, 0.01), name="time_s")
S = pd.Index(np.arange(0.0, 600.0, 0.25), name="position_m")


class Ride:
    """As much of a recording as windows ask for: no map, and no odometry."""

    odometry = None

    class track:  # noqa: N801
        is_map = False


def estimate(**more: Any) -> Estimate:
    states = pd.DataFrame(
        {"roll_rad": 1e-3 * TIME.to_numpy(), "roll_sd_rad": 3e-3, "position_m": 5.0 * TIME.to_numpy()},
        index=TIME,
    )
    return Estimate(states=states.assign(**more), mount="imu")


def test_it_is_taken_at_the_times_of_the_reference():
    """Five surveyed places, and a level with an offset of two mrad."""
    times = np.array([10.003, 31.0, 55.5, 70.0, 99.0])
    motion = pd.DataFrame(
        {"roll_rad": 1e-3 * times - 2e-3, "position_m": 5.0 * times + 0.25},
        index=pd.Index(times, name="time_s"),
    )
    reference = RideReference(motion, sds={"roll_rad": 4e-3}, source="a level")
    table = score_reference(estimate(), Ride(), reference, twist_base_m=3.0)  # type: ignore[arg-type]
    assert set(table["reference"].astype(str)) == {"reference"}
    assert not table["status"].ne("ok").any()
    value = table.set_index(["quantity", "metric"])["value"]
    assert value["roll", "mean"] == pytest.approx(np.rad2deg(2e-3), rel=1e-6)
    assert value["position", "mean"] == pytest.approx(-0.25, rel=1e-9)
    # By both: (2 / 5)^2, and not (2 / 3)^2.
    assert value["roll", "nees"] == pytest.approx(0.16, rel=1e-6)
    assert ("position", "nees") not in value.index, "the method gives no sd of its place"
    assert int(table["n_samples"].iloc[0]) == 5


def test_angles_are_compared_over_the_turn_and_blanks_are_none():
    yaw = np.linspace(3.0, 3.4, len(TIME))
    wrapped = (yaw + np.pi) % (2.0 * np.pi) - np.pi
    motion = pd.DataFrame({"yaw_rad": wrapped[::10] - 0.01, "roll_rad": np.nan}, index=TIME[::10])
    series = {s.quantity: s for s, _ in motion_errors(estimate(yaw_rad=yaw), RideReference(motion))}
    assert set(series) == {"yaw", "yaw_debiased"}
    np.testing.assert_allclose(series["yaw"].error, np.rad2deg(0.01), rtol=1e-6)
    np.testing.assert_allclose(series["yaw_debiased"].error, 0.0, atol=1e-9)


def test_an_estimate_that_is_counted_from_minus_to_plus_pi_has_no_turn_between_two_samples():
    """At half a sample beside the jump from pi to -pi a mean of both would be 0, off by half a turn."""
    yaw = np.pi + 1e-3 * (np.arange(len(TIME)) - 5000.5)
    times = TIME.to_numpy()[:-1:100] + 0.005
    motion = pd.DataFrame({"yaw_rad": np.interp(times, TIME, yaw)}, index=pd.Index(times, name="time_s"))
    motion.loc[TIME[5000] + 0.005] = np.pi
    wrapped = estimate(yaw_rad=(yaw + np.pi) % (2.0 * np.pi) - np.pi)
    (series, *_) = (one for one, _ in motion_errors(wrapped, RideReference(motion.sort_index())))
    np.testing.assert_allclose(series.error, 0.0, atol=1e-9)


def rails(error: np.ndarray) -> Estimate:
    geometry = pd.DataFrame(np.nan, index=S, columns=list(IRREGULARITY))
    geometry["cross_level_m"] = 4e-3 * np.sin(2.0 * np.pi * S / 10.0) + error
    return Estimate(states=pd.DataFrame(index=TIME), mount="imu", geometry=geometry)


def trolley(**more: Any) -> RideReference:
    """The same rails every half metre, from 50 to 550 m."""
    place = np.arange(50.0, 550.1, 0.5)
    frame = pd.DataFrame({"cross_level_m": 4e-3 * np.sin(2.0 * np.pi * place / 10.0)}, index=place)
    return RideReference(rails=frame, **more)


def test_rails_are_compared_in_their_bands():
    """An error of a long wave is in D2 and not in D1; twist follows from the cross-level."""
    long_wave = 2e-3 * np.sin(2.0 * np.pi * S.to_numpy() / 50.0)
    found = {(s.quantity, s.band): s for s, _ in rail_errors(rails(long_wave), trolley(), twist_base_m=3.0)}
    rms = {key: float(np.sqrt(np.nanmean(s.error**2))) for key, s in found.items()}
    # The reference is taken between its places by straight lines: 4 mm (pi 0.5 / 10)^2 / 2 at most.
    assert rms["cross_level", "D2"] == pytest.approx(2.0 / np.sqrt(2.0), rel=0.03)
    assert rms["cross_level", "D1"] < 0.05
    assert rms["twist", "full"] == pytest.approx(
        2.0 * 2.0 * np.sin(np.pi * 3.0 / 50.0) / np.sqrt(2.0), rel=0.03
    )
    assert {quantity for quantity, _ in found} == {"cross_level", "twist"}


def test_a_filtered_reference_is_compared_in_its_own_band_alone():
    offset = np.full(len(S), 10e-3)
    pairs = list(rail_errors(rails(offset), trolley(rail_band="D1"), twist_base_m=3.0))
    assert {(s.quantity, s.band) for s, _ in pairs} == {("cross_level", "D1")}
    (series, _) = pairs[0]
    # What the band takes off is no error: the wave of 10 m passes it, the offset does not.
    assert np.nanmax(np.abs(series.error)) < 0.06


def test_beside_the_ride_there_is_nothing():
    far = trolley()
    assert far.rails is not None
    far.rails.index += 5000.0
    assert not list(rail_errors(rails(np.zeros(len(S))), far, twist_base_m=3.0))


def test_two_places_of_a_reference_err_apart_where_twist_is_between_them():
    """A method without any error of its own: what is left is the reference's, once or twice."""
    sure = replace(rails(np.zeros(len(S))), geometry_draws=np.zeros((20, len(S), 4)))
    reference = trolley(rail_sds={"cross_level_m": 0.5e-3})
    sds = {(s.quantity, s.band): s.sd for s, _ in rail_errors(sure, reference, twist_base_m=3.0)}
    assert np.nanmax(sds["cross_level", "D1"]) == pytest.approx(0.5, rel=1e-12)
    assert np.nanmax(sds["twist", "full"]) == pytest.approx(0.5 * np.sqrt(2.0), rel=1e-12)


def test_what_the_estimate_does_not_have_hides_nothing_behind_it() -> None:
    """A column that is unknown to it, and one of blanks, before one that is compared."""
    yaw = np.linspace(0.0, 0.3, len(TIME))
    motion = pd.DataFrame(
        {"pitch_rad": 0.0, "roll_rad": np.nan, "yaw_rad": yaw[::10] - np.linspace(0.0, 0.2, len(TIME[::10]))},
        index=TIME[::10],
    )
    series = {s.quantity: s.error for s, _ in motion_errors(estimate(yaw_rad=yaw), RideReference(motion))}
    assert set(series) == {"yaw", "yaw_debiased"}
    assert series["yaw_debiased"][0] == 0.0
    assert series["yaw_debiased"][-1] == pytest.approx(np.rad2deg(0.2), rel=1e-3)
