"""Where a wheel leaves its rail, and what is said to have brought it there."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.hunting import with_hunting
from simrail.ride.ride import Ride, rails_of, simulate
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import CHANNELS, lay
from simrail.track.rail_condition import RailCondition
from simrail.vehicle import hunting
from simrail.vehicle.contact.contact import CONTACT
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.engines.compiled_engine import CompiledEngine
from simrail.vehicle.engines.derailment import (
    DerailedError,
    Derailment,
    flange_angle,
    nadal_limit,
    outward_ratio,
    refuse_derailed,
)
from simrail.vehicle.engines.engine import Setup
from simrail.vehicle.engines.exudyn_engine import ExudynEngine
from simrail.vehicle.engines.force_data import memory_of
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.hunting import critical_below
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
    assert "the rail falls by 300 mm within 5.0 m" in found.words


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
    assert "left wheels of front and rear lost their load together" in found.cause
    assert not found.from_the_track and not found.swung
    assert found.lift_m > 5e-3


def test_a_line_says_all_of_it_and_survives_another_process():
    found = derailment(with_defect(**DEFECTS["too wide"]))
    line = str(DerailedError(found))
    assert len(line) < 300 and "\n" not in line
    for words in ("front", f"s = {found.place_m:.1f} m", "km/h", "inward", "Y/Q", "gauge", "likely cause"):
        assert words in line
    again = pickle.loads(pickle.dumps(DerailedError(found)))
    assert str(again) == line and again.derailment == found


def test_nadal_and_the_sign_of_y_over_q():
    """70 degrees, mu = 0.3: (2.7475 - 0.3)/(1 + 0.8242) = 1.3416; no limit at the angle of friction."""
    assert nadal_limit(np.deg2rad(70.0), 0.3) == pytest.approx(1.3416, abs=1e-4)
    assert nadal_limit(np.arctan(0.3), 0.3) == pytest.approx(0.0, abs=1e-15)
    load, guiding = np.array([40e3, 40e3, 0.0]), np.array([-8e3, 8e3, 1e3])
    np.testing.assert_allclose(outward_ratio(guiding, load, 1), [0.2, -0.2, 0.0], atol=1e-15)
    np.testing.assert_allclose(outward_ratio(guiding, load, -1), [-0.2, 0.2, 0.0], atol=1e-15)


RATE_HZ, SPEED_MPS, ROWS = 1000.0, 20.0, 600
FRONT_LEFT, FRONT_RIGHT = 0, 1


def model_of(name, *, friction=None):
    model = load(VehicleFile, "vehicle", name).model(name)
    if friction is None:
        return model
    return replace(model, wheel_rail=replace(model.wheel_rail, friction=friction))


def on_level(name="two_axle_wagon", laid=None, **profile):
    return Setup(model_of(name), laid or lay(LEVEL, SMOOTH, seed=0), replace(PROFILE, **profile))


def running(setup, *, place_m=100.0, speed_mps=SPEED_MPS):
    """Records (k, w) of a vehicle that runs on the treads of its wheels, up to a place."""
    told = np.zeros((ROWS, len(setup.model.wheels)), CONTACT)
    told["wanted"], told["flag"] = 1, 1
    told["load_n"] = told["normal_n"] = setup.model.wheel_load_n(9.81)
    told["position_m"] = place_m - speed_mps / RATE_HZ * np.arange(ROWS, 0, -1)[:, None]
    return told


def judged(
    setup, told, *, wheel=FRONT_LEFT, lift_m=8e-3, shift_m=12.5e-3, place_m=100.0, speed_mps=SPEED_MPS
):
    """The derailment that is told of a wheel, at the end of hand-made records."""
    memory = memory_of(len(setup.model.axle_names))
    memo = memory.axle_memos[wheel // 2]
    memo["derailed"], memo["derailed_time_s"], memo["derailed_s_m"] = 1 + wheel % 2, 7.0, place_m
    memo["speed_mps"], memo["lift_m"], memo["shift_m"] = speed_mps, lift_m, shift_m
    with pytest.raises(DerailedError) as raised:
        refuse_derailed(memory, setup, lambda _time_s: told)
    return raised.value.derailment


def on_flange(told, wheel, rows):
    """Its tread has carried nothing for the last rows; its flange carries all, with Y/Q = 1.2 outward."""
    side = 1 if wheel % 2 == 0 else -1
    told["flag"][-rows:, wheel] = 2
    told["guiding_n"][-rows:, wheel] = -1.2 * side * told["load_n"][-rows:, wheel]
    return told


def test_wheels_of_one_side_without_load_are_a_vehicle_that_turns_over():
    """60 ms of it; 20 ms, as over a joint, are not; nor is one axle of two."""
    setup = on_level()
    for side, word in ((0, "left"), (1, "right")):
        told = running(setup)
        told["load_n"][-60:, side::2] = 0.0
        assert f"the {word} wheels of front and rear lost their load together" in judged(setup, told).cause
        told = running(setup)
        told["load_n"][-20:, side::2] = 0.0
        assert "together" not in judged(setup, told).cause
        told = running(setup)
        told["load_n"][-60:, side] = 0.0
        assert "together" not in judged(setup, told).cause


def test_all_wheels_without_load_are_a_vehicle_that_jumps():
    setup, told = on_level(), running(on_level())
    told["load_n"][-60:] = 0.0
    assert "all wheels of front and rear lost their load at once" in judged(setup, told).cause


def test_a_long_vehicle_turns_over_from_one_end():
    """The left wheels of the leading bogie; the other bogie of the coach still carries."""
    setup = on_level("manchester_1")
    for axle, names in ((0, "axle_f1 and axle_f2"), (1, "axle_f1 and axle_f2")):
        told = running(setup)
        told["load_n"][-60:, [0, 2]] = 0.0
        found = judged(setup, told, wheel=2 * axle)
        assert f"the left wheels of {names} lost their load together" in found.cause
    assert "together" not in judged(setup, told, wheel=4).cause


def test_what_ended_long_before_is_no_cause():
    """A quarter of a second before; all wheels back on their treads since."""
    setup, told = on_level(), running(on_level())
    told["load_n"][-400:-300] = 0.0
    told["flag"][-400:-300] = 0
    assert "blow" in judged(setup, on_flange(told, FRONT_LEFT, 20)).cause


def test_a_wheel_lifted_above_its_flange_has_derailed_by_that():
    """28 mm is the height of the flange of S1002 (EN 13715)."""
    setup, told = on_level(), running(on_level())
    told["load_n"][-60:, FRONT_LEFT] = 0.0
    told["flag"][-60:, FRONT_LEFT] = 0
    assert "more than its flange is high" in judged(setup, told, lift_m=28.1e-3).cause
    assert "lost its load as it passed" in judged(setup, told, lift_m=27.9e-3).cause


def test_a_wheel_that_lands_on_its_tread_again_was_not_in_the_air():
    setup, told = on_level(), running(on_level())
    told["load_n"][-150:-90, FRONT_LEFT] = 0.0
    told["flag"][-150:-90, FRONT_LEFT] = 0
    assert "flange climbing" in judged(setup, on_flange(told, FRONT_LEFT, 80)).cause


def test_a_wheel_that_rattles_up_its_flange_climbs():
    """It touches one time in four, with four times the load: Y/Q is that of the forces' means."""
    setup, told = on_level(), running(on_level())
    told = on_flange(told, FRONT_RIGHT, 120)
    up = np.arange(ROWS - 120, ROWS) % 4 != 0
    for field, factor in (("load_n", 4.0), ("normal_n", 4.0), ("guiding_n", 4.0), ("flag", 1)):
        told[field][-120:, FRONT_RIGHT] = np.where(up, 0, factor * told[field][-120:, FRONT_RIGHT])
    found = judged(setup, told, wheel=FRONT_RIGHT)
    assert "flange climbing within 2.4 m" in found.cause  # 120 rows at 20 mm
    assert found.y_over_q == pytest.approx(1.2, rel=1e-12)  # of 100 rows: 2 m


def test_slow_is_flange_climbing_and_sudden_is_a_blow():
    setup = on_level()
    slow = judged(setup, on_flange(running(setup), FRONT_LEFT, 60))
    assert "flange climbing within 1.2 m" in slow.cause
    sudden = judged(setup, on_flange(running(setup), FRONT_LEFT, 40))
    assert "a blow from the side threw the wheel up its flange within 40 ms" in sudden.cause
    assert not slow.from_the_track and not sudden.from_the_track
    both = on_flange(running(setup), FRONT_LEFT, 200)
    both["flag"][-200:-60, FRONT_LEFT] = 3  # in two-point contact the tread carries still
    assert "flange climbing within 1.2 m" in judged(setup, both).cause


@pytest.mark.parametrize("wheel", [FRONT_LEFT, FRONT_RIGHT])
def test_nadals_limit_is_of_the_rail_as_it_lies(wheel):
    """S1002 has a flange of 70 degrees (EN 13715): mu = 0.3 makes 1.34, mu = 0.15 on one rail 1.84."""
    wet = RailCondition(50.0, 150.0, 0.5, "left")
    setup = on_level(laid=lay(LEVEL, SMOOTH, seed=0, conditions=[wet]))
    slope = np.tan(np.deg2rad(70.0))
    mu = 0.15 if wheel == FRONT_LEFT else 0.3
    limit = (slope - mu) / (1.0 + mu * slope)
    cause = judged(setup, on_flange(running(setup), wheel, 100), wheel=wheel).cause
    assert f"Nadal's limit of Y/Q is {limit:.2f} (70 degrees, friction {mu:.2f})" in cause


def test_the_flange_angle_is_the_profiles():
    """70 degrees, and no steeper where a flange far from its rail has a slope in the table, too."""
    table = contacts_of(model_of("two_axle_wagon")).tables[0]
    assert np.rad2deg(flange_angle(table)) == pytest.approx(70.0, abs=0.1)


def test_a_little_gauge_widening_is_no_cause():
    """20 mm, as in sharp curves: a wheel that climbs there climbs, and none falls inward by it."""
    setup = on_level(laid=with_defect(y_left=(0.02, 10.0)))
    found = judged(setup, on_flange(running(setup), FRONT_LEFT, 100))
    assert "flange climbing" in found.cause and found.gauge_m == pytest.approx(1.455, abs=1e-6)
    found = judged(setup, running(setup), shift_m=-52e-3, lift_m=-2e-3)
    assert "went inward" in found.cause and not found.from_the_track
    assert "2.0 mm under and 52.0 mm inward" in found.words


def test_60_mm_too_wide_is_the_cause_where_the_wheel_went_inward():
    setup = on_level(laid=with_defect(y_left=(0.06, 20.0)))
    place_m = FALL_AT_M + 40.0
    told = running(setup, place_m=place_m)
    assert "60 mm too wide" in judged(setup, told, shift_m=-53e-3, place_m=place_m).cause
    climbed = on_flange(told, FRONT_RIGHT, 100)
    assert "climbing" in judged(setup, climbed, wheel=FRONT_RIGHT, place_m=place_m).cause


def test_a_fast_wheel_flies_far_from_where_its_rail_fell():
    """28 mm take 76 ms of free fall: 7.6 m at 100 m/s. It does not fly off a slope of 40 mm over 20 m."""
    fell, slope = (on_level(laid=with_defect(z_left=(-0.04, length))) for length in (2.0, 20.0))
    at = {"place_m": FALL_AT_M + 20.0, "lift_m": 28.5e-3}
    for setup, speed_mps, is_cause in ((fell, 100.0, True), (fell, 20.0, False), (slope, 100.0, False)):
        told = running(setup, place_m=at["place_m"], speed_mps=speed_mps)
        found = judged(setup, told, speed_mps=speed_mps, **at)
        assert ("the rail falls by 40 mm" in found.cause) == found.from_the_track == is_cause


def test_rails_that_fall_ahead_or_behind_are_no_cause():
    """A wheel meets them in the direction in which it runs: what rises with s falls on the way back."""
    fell, rises = (on_level(laid=with_defect(z_left=(height_m, 2.0))) for height_m in (-0.04, 0.04))
    before, after = FALL_AT_M - 1.0, FALL_AT_M + 3.0
    cases = (
        (fell, before, 20.0, False),
        (fell, after, 20.0, True),
        (fell, before, -20.0, False),
        (rises, after, 20.0, False),
        (rises, before, -20.0, True),
    )
    for setup, place_m, speed_mps, is_cause in cases:
        found = judged(setup, running(setup, place_m=place_m), place_m=place_m, speed_mps=speed_mps)
        assert found.from_the_track == is_cause


def test_a_derailment_near_the_tracks_end_is_told():
    setup = on_level()
    assert judged(setup, running(setup)[-3:], place_m=1.0).place_m == 1.0
    assert ", Y/Q 0.00 (2 m mean)" in judged(setup, running(setup)[:0], place_m=1.0).words


def test_small_rails_fall_by_less():
    """At 1:10 the flange is 2.8 mm high: 4 mm within 0.2 m are its 300 mm."""
    setup = on_level("scale_vehicle", laid=with_defect(z_left=(-4e-3, 0.2), z_right=(-4e-3, 0.2)))
    place_m = FALL_AT_M + 0.3
    assert "within 0.5 m" in judged(setup, running(setup, place_m=place_m), place_m=place_m).cause
    slope = on_level("scale_vehicle", laid=with_defect(z_left=(-4e-3, 4.0), z_right=(-4e-3, 4.0)))
    assert not judged(slope, running(slope, place_m=82.0), place_m=82.0).from_the_track


def test_prescribed_contact_ends_where_its_flange_is():
    setup = on_level("suspended_wheelset")
    assert "prescribed linear contact" in judged(setup, running(setup)).cause


def test_swinging_is_from_side_to_side_and_back():
    """4 mm to both sides; not 2 mm, not on one side only, and not once across."""
    setup = on_level()
    wave = np.sin(2.0 * np.pi * 4.0 * np.arange(ROWS) / RATE_HZ)
    across = np.where(np.arange(ROWS) < 300, -6e-3, 6e-3)
    for y, swung in ((4e-3 * wave, True), (2e-3 * wave, False), (5e-3 + 1e-3 * wave, False), (across, False)):
        told = running(setup)
        told["shift_m"][:, 0], told["shift_m"][:, 1] = y, -y
        assert judged(setup, told).swung == swung


def test_hunting_is_named_where_the_axle_swung_above_the_critical_speed(monkeypatch):
    def said(name, *, from_the_track=False, swung=True, critical_mps=60.0):
        monkeypatch.setattr(hunting, "critical_below", lambda *_, **__: critical_mps)
        values = ("a", "a.left", 7.0, 90.0, 70.0, 1.435, 8e-3, 12e-3, 0.9, "W")
        found = Derailment(*values, from_the_track, swung)
        ride = Ride("r", LEVEL, SMOOTH, 0, model_of(name), PROFILE)
        return with_hunting(found, ride, rails_of(ride)).cause

    assert said("two_axle_wagon") == "hunting, above the critical speed of 216 km/h; W"
    assert said("metro_irw_bogie") == "unstable running, above the critical speed of 216 km/h; W"
    assert said("two_axle_wagon", from_the_track=True) == "W"
    assert said("two_axle_wagon", swung=False) == "W"
    assert said("two_axle_wagon", critical_mps=None) == "W"


def test_a_wheelset_that_hunts_is_said_to(tmp_path, monkeypatch):
    """The suspended wheelset at 1.3 times its critical speed, which `tests/vehicle/test_linear.py` holds to a
    closed form; a swing grows out of the irregularities until the flange's place ends it.
    """
    monkeypatch.setattr(hunting, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    track = TrackDesign("long", 0.0, (Straight(3000.0),))
    rails = Irregularity("erri_b176_low", (1.5, 100.0))
    model = model_of("suspended_wheelset")
    critical = critical_below(model, 150.0)
    profile = SpeedProfile(20.0, 2900.0, 1.3 * critical, **BRISK | {"acceleration_mps2": 8.0})
    ride = Ride("fast", track, rails, 0, model, profile, engine="compiled")
    with pytest.raises(DerailedError, match="likely cause: hunting, above the critical speed") as raised:
        simulate(ride, warn=False)
    found = raised.value.derailment
    assert f"speed of {3.6 * critical:.0f} km/h" in found.cause and found.swung
    assert critical < found.speed_mps < 1.31 * critical


@pytest.mark.slow
def test_a_wagon_climbs_in_a_sharp_curve_at_friction_1():
    """R100, uncanted, 18 km/h, mu = 1: above Nadal's limit of 0.47 no longer needs much; dry rails hold it.

    While it slides up, Y/Q is tan(angle - 45 degrees), from 70 degrees at the steepest down to the end of the
    table, and more where part of the friction acts along the rail; before, its tread carries.
    """
    design = TrackDesign("sharp", 0.0, (Straight(30.0), Transition(10.0), Curve(60.0, 100.0)))
    profile = SpeedProfile(8.0, 60.0, 5.0, **BRISK)
    sharp = lay(design, SMOOTH, seed=0)
    setup = Setup(model_of("two_axle_wagon", friction=1.0), sharp, profile, settle_s=1.0)
    with pytest.raises(DerailedError) as raised:
        for _ in CompiledEngine(setup).run(12.0):
            pass
    found = raised.value.derailment
    assert found.wheel == "front.right" and not found.from_the_track and not found.swung
    assert "flange climbing" in found.cause and "limit of Y/Q is 0.47" in found.cause
    steepest, last = np.deg2rad(70.0 - 45.0), np.deg2rad(50.0 - 45.0)
    assert np.tan(last) < found.y_over_q < 1.2 * np.tan(steepest)
    dry = Setup(model_of("two_axle_wagon"), sharp, profile, settle_s=1.0)
    assert sum(len(segment.time_s) for segment in CompiledEngine(dry).run(12.0)) == 12001


@pytest.mark.parametrize("engine", [CompiledEngine, pytest.param(ExudynEngine, marks=pytest.mark.slow)])
def test_what_went_before_counts_however_a_ride_is_cut(engine):
    """An engine runs in stretches; one that ends just before the derailment leaves nothing out."""
    setup = Setup(model_of("metro_irw_bogie"), with_defect(**DEFECTS["too narrow"]), PROFILE, settle_s=1.0)

    def found(segment_s):
        with pytest.raises(DerailedError) as raised:
            for _ in engine(setup).run(8.0, segment_s=segment_s):
                pass
        return raised.value.derailment

    whole = found(20.0)
    cut = found(0.5 * whole.time_s - 1e-3)
    assert cut.words == whole.words and whole.y_over_q > 0.5
    assert cut.y_over_q == pytest.approx(whole.y_over_q, rel=1e-9)
