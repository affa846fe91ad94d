"""When the train stands, from the encoder alone: stops, both directions, stray pulses, crawling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from simrail.estimation.choose_odometry import with_odometry
from simrail.recording.recording import beginning
from simrail.recording.sheets.imu_file import load_grade
from simrail.recording.standstill import (
    GUARD_S,
    SETTLE_S,
    SHORTEST_S,
    first_motion_s,
    guard_s,
    motion_times,
    rest_periods,
)
from simrail.ride.kinematic import kinematic_truth
from simrail.ride.truth import Mount
from simrail.sensors.encoder import EncoderSpec
from simrail.sensors.measure import measure
from simrail.track.design import Straight, TrackDesign
from simrail.vehicle.speed_profile import SpeedProfile

TRACK = TrackDesign("line", -50.0, (Straight(400.0),))
DWELLS = (8.0, 12.0)
REST_S, FINAL_S = 6.0, 5.0


def ride(direction=1, *, speed=8.0, dwells=DWELLS):
    ends = (10.0, 160.0)
    start, end = ends if direction > 0 else ends[::-1]
    stops = tuple((60.0 + 50.0 * i if direction > 0 else 110.0 - 50.0 * i, t) for i, t in enumerate(dwells))
    return kinematic_truth(
        TRACK, SpeedProfile(start, end, speed, rest_s=REST_S, final_rest_s=FINAL_S, stops=stops)
    )


def record(truth, **encoder):
    return measure(
        truth,
        name="ride",
        mount=Mount("axle", "body", (0.0, 0.0, 0.6)),
        grade=load_grade("ideal"),
        encoder=EncoderSpec("wheel", **encoder),
        seed=1,
        draw=0,
    )


def true_rests(truth):
    """Starts and ends of the times at which the train really stood."""
    still = np.diff(truth.reference_position_m) == 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int)))
    spans = truth.time_s[np.minimum(edges, len(truth.time_s) - 1)].reshape(-1, 2)
    return spans[np.diff(spans, axis=1)[:, 0] > 0.2]


@pytest.mark.parametrize("direction", (1, -1))
@pytest.mark.parametrize(
    "encoder",
    [
        {"pulses_per_revolution": 1024},
        {"pulses_per_revolution": 100},
        {"pulses_per_revolution": 1024, "quadrature": True, "edge_jitter_sd": 0.1, "edge_pattern_sd": 0.1},
        {"pulses_per_revolution": 256, "rate_hz": 50.0, "missed_rate": 1e-3},
    ],
)
def test_every_stop_is_found_and_the_wheel_stands_in_it(direction, encoder):
    truth = ride(direction)
    recording = record(truth, **encoder)
    found, true = rest_periods(recording), true_rests(truth)
    assert len(found) == len(true) == 4
    guard = guard_s(recording)
    reading = 1.0 / encoder.get("rate_hz", 250.0)
    for (start, end), (really, until) in zip(found.to_numpy(), true, strict=True):
        assert really <= start < end <= until
        # What the guards cost: the last pulse comes before the stop, the first one after the start.
        assert start - really <= max(SETTLE_S, guard) + reading
        assert until - end <= guard + 0.05
    assert found["start_s"].iloc[0] == recording.imu.index[0]


def test_a_coarse_encoder_has_the_longer_guard():
    fine, coarse = (record(ride(dwells=()), pulses_per_revolution=n) for n in (1024, 100))
    assert guard_s(fine) == GUARD_S
    # 2 x 18.2 mm at 0.2 m/s3: t^3 = 6 x 36.4 mm / 0.2 m/s3.
    assert guard_s(coarse) == pytest.approx((6.0 * 2.0 * 2.0 * np.pi * 0.29 / 100 / 0.2) ** (1.0 / 3.0))


@pytest.mark.parametrize("direction", (1, -1))
def test_one_stray_pulse_costs_a_later_stop_its_guards_at_most(direction):
    """Standing on an edge that jitters: one count more for a moment, or from then on."""
    truth = ride(direction)
    recording = record(truth)
    clean, true = rest_periods(recording).to_numpy(), true_rests(truth)
    whole = 0
    for i in range(1, len(clean)):
        at = clean[i].mean()
        for sign, last in ((1, 0.004), (-1, 0.004), (direction, np.inf)):
            counts = recording.encoder.copy()
            during = (counts.index >= at) & (counts.index < at + last)
            counts.loc[during, "pulse_count"] += sign
            found = rest_periods(replace(recording, encoder=counts)).to_numpy()
            pieces = found[(found[:, 0] >= true[i, 0]) & (found[:, 1] <= true[i, 1])]
            assert len(found) - len(pieces) == len(clean) - 1  # every other rest is as it was
            assert (pieces[:, 1] - pieces[:, 0]).sum() >= np.diff(clean[i])[0] - SETTLE_S - GUARD_S - 0.1
            whole += len(pieces) == 1
    assert whole >= 3  # to the count where the wheel came from it costs nothing


def test_a_stray_pulse_in_the_initial_rest_costs_its_guards_only():
    """Nothing is known of the edges then, so the first pulse ends the rest; the next begins at once."""
    recording = record(ride())
    clean = rest_periods(recording)
    counts = recording.encoder.copy()
    counts.loc[(counts.index >= 2.0) & (counts.index < 2.1), "pulse_count"] += 1
    found = rest_periods(replace(recording, encoder=counts))
    assert len(found) == len(clean) + 1
    assert found["end_s"].iloc[0] == pytest.approx(2.0 - GUARD_S)
    assert found["start_s"].iloc[1] == pytest.approx(2.0 + SETTLE_S)
    pd.testing.assert_series_equal(found["end_s"].iloc[1:], clean["end_s"], check_index=False, atol=0.1)


def test_a_wheel_that_trembles_on_an_edge_stands():
    recording = record(ride())
    counts = recording.encoder.copy()
    counts["pulse_count"] = np.arange(len(counts)) // 25 % 2
    found = rest_periods(replace(recording, encoder=counts))
    assert len(found) == 1 and found["start_s"].iloc[0] < 1.2
    counts["pulse_count"] = np.arange(len(counts)) // 25 % 3  # two counts to and fro are motion
    assert len(rest_periods(replace(recording, encoder=counts))) == 0


@pytest.mark.parametrize("pulses", (1024, 100))
def test_a_crawling_train_does_not_rest(pulses):
    recording = record(ride(), pulses_per_revolution=pulses)
    way = 2.0 * np.pi * 0.29 / pulses
    times = recording.encoder.index.to_numpy()
    # Two counts in less than the guards and the shortest rest together.
    quick = 2.0 * way / (guard_s(recording) + max(SETTLE_S, guard_s(recording)) + SHORTEST_S)
    for speed, rests in ((1.1 * quick, 1), (-1.1 * quick, 1), (0.45 * quick, 2)):
        crawl = np.floor(speed * np.clip(times - 3.0, 0.0, None) / way + 1e-9).astype(int)
        found = rest_periods(replace(recording, encoder=recording.encoder.assign(pulse_count=crawl)))
        assert (len(found) == 1) == (rests == 1), (speed, found)


def test_a_train_that_moves_from_the_first_reading_never_rests():
    recording = record(ride())
    running = recording.encoder.assign(pulse_count=np.arange(len(recording.encoder)) * 3)
    moving = replace(recording, encoder=running)
    assert rest_periods(moving).empty and first_motion_s(moving) == running.index[1]


def test_a_train_that_never_moves_rests_to_the_end():
    recording = beginning(record(ride()), samples=1000)
    found = rest_periods(recording)
    assert len(found) == 1 and len(motion_times(recording)) == 0
    assert found["end_s"].iloc[0] == pytest.approx(recording.imu.index[-1] - GUARD_S)


def test_without_an_encoder_the_odometry_says_it():
    truth = ride()
    recording = replace(with_odometry(record(truth), "encoder"), encoder=None, encoder_sheet=None)
    found, true = rest_periods(recording), true_rests(truth)
    assert len(found) == len(true)
    assert (found.to_numpy()[:, 0] >= true[:, 0]).all() and (found.to_numpy()[:, 1] <= true[:, 1]).all()


@pytest.mark.parametrize("direction", (1, -1))
def test_signs_of_motion_use_nothing_read_later(direction):
    recording = record(ride(direction), edge_jitter_sd=0.1)
    whole = motion_times(recording)
    for n in (500, 1700, 4000, 6001, len(recording.imu) - 3):
        part = beginning(recording, samples=n)
        np.testing.assert_array_equal(motion_times(part), whole[whole <= part.encoder.index[-1]])
