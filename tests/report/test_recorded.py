"""Tables of a recorded ride: what methods differ by, places beyond limits by their chance, words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import IMU
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import ImuSheet, Recording
from simrail.report.pages.estimate_page import _gaps, _tiles, design_differences, ride_facts
from simrail.report.tables.recorded import (
    NO_DRAWS,
    MethodResult,
    beside_each_other,
    difference_table,
    differences,
    exceedance_table,
    exceedance_words,
    rails_over_distance,
    reference_table,
)
from simrail.scoring.table import FIGURE_COLUMNS
from simrail.track.design import Straight, TrackDesign
from simrail.track.rail_limits import EXAMPLE_LIMITS, EXCEEDANCES, RailLimits, RailLine

TIME = pd.Index(np.arange(0.0, 10.0, 0.01), name="time_s")
PLACE = np.arange(0.0, 100.0, 0.25)


def result(
    name: str, roll: float, roll_sd: float | None, rails: float | None = None, **line: Any
) -> MethodResult:
    states = pd.DataFrame({"roll_rad": roll}, index=TIME)
    if roll_sd is not None:
        states["roll_sd_rad"] = roll_sd
    lines = []
    if rails is not None:
        lines = [RailLine("alignment", "D1", PLACE, np.full(len(PLACE), rails), **line)]
    estimate = Estimate(states=states, mount="imu")
    return MethodResult(name, name, f"{name}()", None, estimate, tuple(lines), 1.5)  # type: ignore[arg-type]


def test_differences_are_held_against_both_standard_deviations():
    wide, narrow = np.full(len(PLACE), 3e-3), np.full(len(PLACE), 4e-3)
    one = result("one", 0.0, 3e-3, rails=1e-3, sd=wide)
    other = result("other", 2.0 * np.pi + 5e-3, 4e-3, rails=-1e-3, sd=narrow)
    table = differences([one, other, result("bare", 1e-3, None)])
    rows = table.set_index(["method", "quantity"])
    roll = rows.loc[("other", "roll")]
    # A turn is no difference; sqrt(3^2 + 4^2) = 5.
    assert roll["rms"] == pytest.approx(np.rad2deg(5e-3)) and roll["joint_sd"] == pytest.approx(
        np.rad2deg(5e-3)
    )
    assert roll["within_95"] == 1.0 and roll["unit"] == "deg"
    rails = rows.loc[("other", "alignment")]
    assert (rails["rms"], rails["joint_sd"], rails["unit"]) == (pytest.approx(2.0), pytest.approx(5.0), "mm")
    bare = rows.loc[("bare", "roll")]
    assert np.isnan(bare["joint_sd"]) and np.isnan(bare["within_95"])
    assert ("bare", "alignment") not in rows.index
    words = difference_table(table)
    assert words.columns[0] == "less one" and words.rows[0][0] == "other: roll, deg"
    assert words.rows[-1][-2:] == ("\u2013", "\u2013")
    beside = beside_each_other([one, result("bare", 0.0, None)])
    assert beside.rows[0][-2:] == ("yes", "1.5") and beside.rows[1][1:3] == ("no sd", "\u2013")


def test_methods_that_contradict_each_other_are_seen():
    table = differences([result("one", 0.0, 1e-3), result("other", 5e-3, 1e-3)])
    assert table["within_95"].iloc[0] == 0.0


def places(*chances: float) -> pd.DataFrame:
    rows = [
        ("alignment", "D1", 10.0 * k, 10.0 * k + 2.0, 5e-3 + 1e-4 * k, 10.0 * k + 1.0, 4e-3, 1e-3, chance)
        for k, chance in enumerate(chances)
    ]
    return pd.DataFrame(rows, columns=list(EXCEEDANCES))


def test_the_surest_places_come_first_and_words_count_them():
    table = exceedance_table(places(0.4, 0.999, 0.96), most=2)
    assert [row[-1] for row in table.rows] == ["> 99 %", "96 %"] and table.rows[0][1] == "10.0 to 12.0"
    words = exceedance_words(places(0.4, 0.999, 0.96), RailLimits())
    assert words.startswith("3 places beyond the limits: 2 surely") and "1 with a chance below 50 %" in words
    assert NO_DRAWS in exceedance_words(places(np.nan), EXAMPLE_LIMITS)
    assert "example limits" in exceedance_words(places(np.nan), EXAMPLE_LIMITS)
    assert "within the limits" in exceedance_words(places(), RailLimits())
    limits = RailLimits(peaks={("alignment", "D1"): 4e-3})
    unsure, sure = (result("one", 0.0, None, 1e-3, **more).lines for more in ({}, {"sd": PLACE}))
    assert NO_DRAWS in exceedance_words(places(), limits, unsure)
    assert NO_DRAWS not in exceedance_words(places(), limits, sure)


def test_a_reference_is_never_called_a_truth():
    rows = [
        ("roll", "full", "reference", "whole", "rms", 0.05, "deg", 7, "ok"),
        ("roll", "full", "reference", "whole", "coverage95", 0.9, "1", 7, "ok"),
        ("roll", "full", "reference", "moving", "rms", 0.07, "deg", 7, "ok"),
    ]
    table = reference_table(pd.DataFrame(rows, columns=list(FIGURE_COLUMNS)).assign(estimator="EKF"))
    assert table.rows == (("EKF: roll, deg", "0.050", "\u2013", "\u2013", "90 %", "7"),)
    assert "truth" not in " ".join(table.columns)


def test_rails_over_distance_have_a_column_for_each_band():
    frame = rails_over_distance(result("one", 0.0, None, rails=1e-3, sd=np.ones(len(PLACE))).lines)
    assert list(frame) == ["alignment_D1_m", "alignment_D1_sd_m"] and frame.index.name == "position_m"


def ridden(**more: Any) -> Recording:
    """Ten seconds along a straight, 2.5 m every second."""
    track = TrackDesign("my line", 0.0, (Straight(200.0),))
    odometry = pd.DataFrame({"position_m": 50.0 + 2.5 * TIME.to_numpy(), "speed_mps": -2.5}, index=TIME)
    given = {"encoder": None, "encoder_sheet": None, "odometry": odometry, "odometry_source": "encoder"}
    return Recording(
        name="ride",
        imu=pd.DataFrame(0.0, index=TIME, columns=list(IMU)),
        imu_sheet=ImuSheet("mine", 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount="imu",
        mount_body="frame",
        mount_position_m=(1.0, 0.25, 0.6),
        track=track,
        start_position_m=50.0,
        **(given | more),
    )


def test_a_ride_is_told_in_samples_metres_and_kilometres_an_hour():
    gaps = pd.DataFrame({"start_s": [1.0, 4.0], "end_s": [1.1, 4.05], "missing": [9.0, 1.0]})
    samples, way, imu, source = ride_facts(ridden(gaps=gaps))
    assert samples == "1000 samples at 100 Hz, 10.0 s; 10 of them lost and interpolated, in 2 gaps"
    assert way == "from s = 50.0 to 75.0 m of track 'my line', at most 9.0 km/h"
    assert imu == "IMU mine at 100 Hz on 'frame', 1, 0.25, 0.6 m (forward, left, up)"
    assert source == "position and speed from the odometry 'encoder'"
    assert _gaps(ridden(gaps=gaps)) == [
        "9 samples between 1.000 and 1.100 s",
        "1 sample between 4.000 and 4.050 s",
    ]
    many = pd.concat([gaps] * 11, ignore_index=True)
    assert len(_gaps(ridden(gaps=many))) == 21 and _gaps(ridden(gaps=many))[-1] == "and 2 more"
    bare = ride_facts(ridden(odometry=None))
    assert bare[0].endswith("; no gaps") and bare[1] == "from s = 50.0 m of track 'my line'"


def test_what_an_estimate_differs_from_the_design_by_is_told_in_degrees():
    """Rolled by 3 deg one half of the way and by 4 deg the other: rms 3.54 deg; a turn more is none."""
    roll = np.radians(np.where(np.arange(len(TIME)) < 500, 3.0, 4.0)) + 2.0 * np.pi
    states = pd.DataFrame({"roll_rad": roll, "pitch_rad": 0.0}, index=TIME)
    found = MethodResult(
        "one", "the one", "one()", ridden(), Estimate(states=states, mount="imu"), (), 12.34, ()
    )
    assert design_differences(found) == pytest.approx({"roll": np.sqrt(12.5), "pitch": 0.0})
    tiles = _tiles(SimpleNamespace(results=[found], limits=None))
    assert [(what, value) for what, value, _ in tiles] == [
        ("way", "25 m"),
        ("roll less design", "3.536\u00b0"),
        ("pitch less design", "0.000\u00b0"),
        ("time", "12.3 s"),
    ]
    assert tiles[0][2] == "in 10 s"
