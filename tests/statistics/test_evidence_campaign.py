"""False alarms of sound rides, and the share of planted faults that is found: a campaign, and its script.

``python -m tests.statistics.test_evidence_campaign`` prints the figures: the rides of shipped scenarios, both
directions, all grades, each with a map that errs; and a curve of detection over sizes for each kind of fault.
``--seed`` draws tracks and sensors anew, ``--multibody`` leaves out what the kinematic engine runs,
``--minutes`` ends when so much time of the processor is spent, ``--alarms`` leaves out the planted faults.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import pytest

from simrail.campaign.cell import record_cell, simulated
from simrail.campaign.progress import Watcher
from simrail.recording.doubts import doubts
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.judge import KINDS, weigh
from simrail.recording.recording import Recording
from simrail.scenario.cells import cells
from simrail.scenario.check import judge_scenario
from simrail.scenario.scenario import load_scenario
from tests.shared.planted_faults import PLANTS

SIZES: dict[str, tuple[float, ...]] = {
    "gyro": (0.5, 2.0, 1.03, 1.02, 1.05),
    "wheel": (0.5, 2.0, 1.02, 1.01, 1.03),
    "shift": (20.0, -20.0, 10.0, 60.0),
    "yaw": (5.0, 2.0, -20.0, 30.0, 90.0, 180.0),
    "pitch": (2.0, 1.0),
    "roll": (2.0, 1.0),
    "offset": (0.3, 0.1, -2.0),
    "drift": (200.0, 500.0),
}
"""Sizes of planted faults: those of the requirement first, then those of the curve of detection."""

KINEMATIC = ("engine=kinematic",)

CHEAP: tuple[tuple[str, Sequence[str], int, int], ...] = (
    ("validation_quick", KINEMATIC, 10, 12),
    ("quick_kinematic", (), 2, 1),
)
"""(scenario, settings, one cell in so many, most cells) of the slow test: no multibody ride to wait for."""

ALL: tuple[tuple[str, Sequence[str], int, int], ...] = (
    ("validation_quick", KINEMATIC, 1, 432),
    ("quick_kinematic", (), 1, 4),
    ("validation_quick", (), 9, 48),
    ("odometry", (), 7, 30),
    ("scale_track", (), 3, 8),
    ("metro_table3", (), 2, 6),
    ("metro_geometry", (), 3, 6),
    ("vertical_profile", (), 3, 6),
    ("track_relative", (), 5, 12),
    ("passes", (), 7, 6),
    ("shaking", (), 1, 6),
    ("leaves", (), 1, 2),
)
"""The same of the script."""


def rides(
    chosen: Sequence[tuple[str, Sequence[str], int, int]], seed: int | None = None
) -> Iterator[tuple[str, Recording]]:
    """Recordings of scenarios, as a logger would hand them in: without an odometry."""
    for name, settings, every, most in chosen:
        scenario = load_scenario(name, overrides=list(settings), seed=seed)
        parts = judge_scenario(scenario).parts
        wanted = [cell for i, cell in enumerate(cells(scenario)) if i % every == 0][:most]
        for _, group in groupby(wanted, key=lambda cell: cell.ride_number):
            of_ride = list(group)
            motion = simulated(of_ride[0], parts, Watcher(), 1, 1)
            for cell in of_ride:
                recorded = record_cell(cell, motion, parts)
                yield f"{name} {cell.imu.grade}", replace(recorded, odometry=None, odometry_source="")


def false_alarms(recordings: Sequence[tuple[str, Recording]]) -> list[str]:
    """What is said of sound rides."""
    found = []
    for name, recording in recordings:
        found += [f"{name}: {finding.key} {finding.shown}" for finding in weigh_all(recording).wrong]
        found += [f"{name}: {told}" for told in doubts(recording)]
    return found


def detection(
    recordings: Sequence[tuple[str, Recording]], key: str, size: float
) -> tuple[float, float, float]:
    """Share found, share in which nothing else was blamed, rms error of the figure found."""
    found, alone, errors = [], [], []
    for _, recording in recordings:
        if recording.encoder is None:
            continue
        evidence = weigh(PLANTS[key](recording, size))
        wrong = [finding.key for finding in evidence.wrong]
        found.append(key in wrong)
        alone.append(wrong == [key])
        error = evidence.of(key).value - size
        errors.append(np.remainder(error + 180.0, 360.0) - 180.0 if key == "yaw" else error)
    return float(np.mean(found)), float(np.mean(alone)), float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module")
def recordings() -> list[tuple[str, Recording]]:
    return list(rides(CHEAP))


@pytest.mark.slow
def test_sound_rides_raise_no_alarm(recordings: list[tuple[str, Recording]]) -> None:
    assert false_alarms(recordings) == []


@pytest.mark.slow
def test_a_wheel_that_slips_on_leaves_is_no_other_wheel_and_no_other_clock() -> None:
    """Seed 8802: a straight line and rough rails, on which no fit finds the way without the slides."""
    assert false_alarms(list(rides((("leaves", (), 1, 2),), 8802))) == []


@pytest.mark.slow
def test_springs_that_pass_for_a_low_pass_are_no_clock_that_drifts() -> None:
    """Noise of ten LORDs on an axle at 70 km/h: a drift of -1500 +- 340 ppm beside a low-pass of .29 s."""
    noisy = [pair for pair in rides((("metro_geometry", (), 3, 4),)) if "noise" in pair[0]]
    assert noisy and false_alarms(noisy) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "size"),
    [
        ("gyro", 0.5),
        ("gyro", 2.0),
        ("gyro", 1.05),
        ("wheel", 0.5),
        ("wheel", 2.0),
        ("wheel", 1.02),
        ("shift", 20.0),
        ("yaw", 5.0),
        ("pitch", 2.0),
        ("roll", 2.0),
        ("offset", 0.3),
    ],
)
def test_planted_faults_are_found(key: str, size: float, recordings: list[tuple[str, Recording]]) -> None:
    share, _, _ = detection(recordings, key, size)
    assert share >= 0.9  # of some twelve rides: one may be missed


def main() -> None:
    """Print the figures of the campaign."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int)
    parser.add_argument("--multibody", action="store_true")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--alarms", action="store_true")
    asked = parser.parse_args()
    chosen = [entry for entry in ALL if not (asked.multibody and "kinematic" in f"{entry[0]} {entry[1]}")]
    kept, alarms, count = [], [], 0
    for pair in rides(chosen, asked.seed):
        alarms += false_alarms([pair])
        if count % 12 == 0:
            kept.append(pair)
        count += 1
        print(f"{time.process_time():.0f} s: {pair[0]}, {len(alarms)} false alarms in {count}", flush=True)
        if time.process_time() > 60.0 * asked.minutes:
            break
    print(f"{count} sound rides, {len(alarms)} false alarms: {alarms}")
    for key in () if asked.alarms else KINDS:
        for size in SIZES[key]:
            share, alone, error = detection(kept, key, size)
            print(
                f"{key} {size:g}: found {share:.0%} of {len(kept)}, alone {alone:.0%}, rms error {error:.4g}"
            )


if __name__ == "__main__":
    main()
