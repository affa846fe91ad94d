"""Where a wheel leaves its rail, and what is said to have brought it there."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from simrail.core.toml_files import load
from simrail.track.design import Straight, TrackDesign
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import CHANNELS, lay
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.derailment import DerailedError, nadal, outward_ratio
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile

SMOOTH = Irregularity("none", (1.5, 100.0), 0.0)
LEVEL = TrackDesign("level", 0.0, (Straight(200.0),))
BRISK = {"rest_s": 0.2, "final_rest_s": 0.1, "acceleration_mps2": 3.0, "jerk_mps3": 20.0}
PROFILE = SpeedProfile(20.0, 120.0, 18.0, **BRISK)
FALL_AT_M = 80.0


def with_defect(**rails):
    """Level track whose rails (by channel) go over to a deviation (m) within a length (m) from 80 m on."""
    laid = lay(LEVEL, SMOOTH, seed=0)
    s = laid.table_start_m + laid.table_step_m * np.arange(len(laid.table) + 1)
    table = laid.table.copy()
    for channel, (height_m, length_m) in rails.items():
        share = np.clip((s - FALL_AT_M) / length_m, 0.0, 1.0)
        table[:, CHANNELS.index(channel)] += CubicSpline(
            s, 0.5 * height_m * (1.0 - np.cos(np.pi * share))
        ).c.T
    return replace(laid, table=np.ascontiguousarray(table))


def derailment(laid, profile=PROFILE, *, engine=CompiledEngine, duration_s=12.0):
    model = load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")
    with pytest.raises(DerailedError) as raised:
        for _ in engine(Setup(model, laid, profile, settle_s=1.0)).run(duration_s):
            pass
    return raised.value.derailment


DEFECTS = {
    "falls by": {"z_left": (-0.3, 2.0), "z_right": (-0.3, 2.0)},
    "too wide": {"y_left": (0.08, 10.0)},
    "too narrow": {"y_left": (-0.03, 10.0)},
    "leads aside": {"y_left": (0.05, 1.0), "y_right": (0.05, 1.0)},
}


@pytest.mark.parametrize("words", DEFECTS)
def test_rails_that_nothing_can_follow_are_the_cause(words):
    """At the front axle, 0.9 m ahead of the reference, where the defect is; the gauge is the laid one."""
    laid = with_defect(**DEFECTS[words])
    found = derailment(laid)
    assert words in found.cause and found.from_the_track
    assert found.axle == "front" and FALL_AT_M < found.place_m < FALL_AT_M + 15.0
    assert found.speed_mps == pytest.approx(float(PROFILE.motion(np.array([found.time_s]))[1][0]), rel=0.02)
    y_left, _, y_right, _ = laid.rails(found.place_m)
    assert found.gauge_m == pytest.approx(1.435 + y_left - y_right, abs=1e-12)


def test_rails_that_drop_by_300_mm_end_the_ride_where_the_wheels_fly():
    """A wheel is lifted by more than its flange within the 2 m: it falls by 28 mm in 76 ms, 1.4 m at 18 m/s.

    Pushed down by its springs it falls faster than by gravity alone, so not before half of that way either.
    """
    found = derailment(with_defect(**DEFECTS["falls by"]))
    assert 0.4 < found.place_m - FALL_AT_M < 2.0
    assert found.lift_m == pytest.approx(0.028, abs=2e-3)
    assert "mm within 5 m" in found.words


def test_both_engines_say_the_same():
    laid = with_defect(**DEFECTS["too narrow"])
    one, other = (
        derailment(laid, engine=engine, duration_s=8.0) for engine in (CompiledEngine, ExudynEngine)
    )
    assert one.words == other.words
    assert one.y_over_q > 0.5


def test_too_fast_for_a_curve_is_said_to_turn_over():
    laid = lay(load(TrackFile, "track", "smooth_curve").design("smooth_curve"), SMOOTH, seed=0)
    fast = SpeedProfile(20.0, 560.0, 75.0, rest_s=0.5, acceleration_mps2=30.0, jerk_mps3=200.0)
    found = derailment(laid, fast, duration_s=8.0)
    assert "lost their load together" in found.cause and not found.from_the_track
    assert found.lift_m > 5e-3


def test_a_line_says_all_of_it_and_survives_another_process():
    found = derailment(with_defect(**DEFECTS["too wide"]))
    line = str(DerailedError(found))
    assert len(line) < 280 and "\n" not in line
    for words in ("front", f"s = {found.place_m:.1f} m", "km/h", "lifted", "Y/Q", "gauge", "likely cause"):
        assert words in line
    again = pickle.loads(pickle.dumps(DerailedError(found)))
    assert str(again) == line and again.derailment == found


def test_nadal_and_the_sign_of_y_over_q():
    """70 degrees, mu = 0.3: (2.7475 - 0.3)/(1 + 0.8242) = 1.3416; no limit at the angle of friction."""
    assert nadal(np.deg2rad(70.0), 0.3) == pytest.approx(1.3416, abs=1e-4)
    assert nadal(np.arctan(0.3), 0.3) == pytest.approx(0.0, abs=1e-15)
    load, guiding = np.array([40e3, 40e3, 0.0]), np.array([-8e3, 8e3, 1e3])
    np.testing.assert_allclose(outward_ratio(guiding, load, 1), [0.2, -0.2, 0.0], atol=1e-15)
    np.testing.assert_allclose(outward_ratio(guiding, load, -1), [-0.2, 0.2, 0.0], atol=1e-15)
