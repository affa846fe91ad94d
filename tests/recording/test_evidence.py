"""Each fit finds what was planted, and nothing else; what a ride cannot tell, it says."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.core.columns import GYRO
from simrail.core.errors import InputError
from simrail.recording.evidence.finding import Finding
from simrail.recording.evidence.judge import Evidence, refuse_wrong, warnings_of, weigh
from simrail.recording.evidence.way import way_of
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from simrail.track.design import Straight
from tests.shared.planted_faults import PLANTS

BASE = Path(__file__).parents[1] / "field" / "cases" / "00-base" / "ride.toml"


@pytest.fixture(scope="module")
def sound() -> Recording:
    return read_signals(BASE)


def tell(evidence: Evidence) -> list[str]:
    return [finding.key for finding in evidence.wrong]


@pytest.mark.parametrize(
    ("key", "size", "slack"),
    [
        ("gyro", 0.5, 0.02),
        ("gyro", 3.0, 0.1),
        ("wheel", 0.25, 0.01),
        ("wheel", 2.0, 0.05),
        ("wheel", 1.05, 0.015),
        ("wheel", -1.0, 0.05),
        ("shift", 20.0, 5.0),
        ("shift", 60.0, 5.0),
        ("yaw", 5.0, 1.0),
        ("yaw", -20.0, 1.0),
        ("yaw", 180.0, 1.0),
        ("yaw", 90.0, 1.0),
        ("pitch", 2.0, 0.3),
        ("roll", -2.0, 0.3),
        ("offset", 0.3, 0.05),
        ("offset", -2.0, 0.1),
        ("gyro_offset", 0.6, 0.1),
        ("gyro_offset", -1.0, 0.1),
        pytest.param("gyro_offset", -5.0, 0.1, marks=pytest.mark.long),
    ],
)
def test_a_planted_fault_is_found_with_its_size_and_alone(
    key: str, size: float, slack: float, sound: Recording
) -> None:
    """Tolerances are three times the sd that the fit of this ride gives, with its map and its sheet."""
    evidence = weigh(PLANTS[key](sound, size))
    found = evidence.of(key)
    off = found.value - size
    assert abs(np.remainder(off + 180.0, 360.0) - 180.0 if key == "yaw" else off) < slack
    # Of a train that ran the other way, the place where it began is where it is said to be.
    assert tell(evidence) == [key]


@pytest.mark.parametrize("size", [-0.6, pytest.param(1.0, marks=pytest.mark.long)])
def test_of_three_clocks_the_accelerometers_is_told_where_the_others_agree(
    size: float, sound: Recording
) -> None:
    evidence = weigh(PLANTS["accel_offset"](sound, size))
    (found,) = evidence.wrong
    assert found.setting == "imu.accel.time_offset_s" and "accelerometer are" in found.why
    assert found.value == pytest.approx(size, abs=0.1)
    assert evidence.of("offset").verdict == evidence.of("gyro").verdict == "sound"


@pytest.mark.long
def test_a_late_gyro_and_a_late_encoder_are_told_apart(sound: Recording) -> None:
    evidence = weigh(PLANTS["gyro_offset"](PLANTS["offset"](sound, -0.5), 1.0))
    found = {finding.key: finding.value for finding in evidence.wrong}
    assert found == {"offset": pytest.approx(-0.5, abs=0.05), "gyro_offset": pytest.approx(1.0, abs=0.1)}


@pytest.mark.long
def test_where_speed_and_push_do_not_tell_a_late_gyro_from_another_place_both_are_said(
    sound: Recording,
) -> None:
    """At one speed, and without the accelerometer's Y, a gyro 3 s late is like a train some 40 m behind."""
    time = np.arange(0.0, 40.0, 0.05)
    assert sound.encoder is not None and sound.encoder_sheet is not None
    counts = np.rint(13.0 * time / sound.encoder_sheet.pulse_m).astype(np.int64)
    encoder = pd.DataFrame({"pulse_count": counts}, index=pd.Index(time, name="time_s"))
    frame = sound.track.frame_extended(0.0 + 13.0 * (time - 3.0))
    noise = np.random.default_rng(1).normal(0.0, 1.0, (len(time), 6)) * [*3 * [1e-3], *3 * [10.0]]
    imu = pd.DataFrame(noise, columns=sound.imu.columns, index=encoder.index)
    imu[list(GYRO)] += 13.0 * frame.k
    imu["accel_z_mps2"] += sound.gravity_mps2
    evidence = weigh(replace(sound, imu=imu, encoder=encoder, start_position_m=0.0))
    found = evidence.of("shift")
    assert found.wrong and "imu.gyro.time_offset_s" in found.remedy
    late = re.search(r"gyro are (\d\.\d+) s late", found.remedy)
    assert late is not None and float(late[1]) == pytest.approx(3.0, abs=0.5)
    assert evidence.of("gyro_offset").verdict == "could not be judged"


def test_nothing_is_said_of_the_sound_ride(sound: Recording) -> None:
    evidence = weigh(sound)
    assert not evidence.wrong and not warnings_of(evidence)
    refuse_wrong(evidence)


def test_an_imu_far_ahead_on_its_body_turns_as_the_middle_does(sound: Recording) -> None:
    """Twelve metres behind its place are too many for one in the middle, and what one twelve ahead shows."""
    behind = PLANTS["shift"](sound, -12.0)
    assert tell(weigh(behind)) == ["shift"]
    _, lateral, height = sound.mount_position_m
    assert not weigh(replace(behind, mount_position_m=(12.0, lateral, height))).wrong


def test_what_is_surely_wrong_is_refused_and_what_is_likely_told(sound: Recording) -> None:
    with pytest.raises(InputError, match=r"imu.scale.gyro.*--write") as refused:
        refuse_wrong(weigh(PLANTS["gyro"](sound, 2.0)))
    assert refused.value.field == "imu.gyro_z_radps" and "2.0" in str(refused.value.value)
    likely = weigh(PLANTS["shift"](sound, 10.0))
    refuse_wrong(likely)
    (line,) = warnings_of(likely)
    assert "start_position_m" in line and "10 m ahead" in line


def test_a_ride_on_the_straight_says_what_it_could_not_judge(sound: Recording) -> None:
    track = replace(sound.track, elements=(Straight(sound.track.length_m),))
    imu = sound.imu.assign(gyro_z_radps=0.0, gyro_y_radps=0.0, gyro_x_radps=0.0, accel_y_mps2=0.0)
    evidence = weigh(replace(sound, track=track, imu=imu))
    for key in ("gyro", "shift"):
        assert evidence.of(key).verdict == "could not be judged" and "no curve" in evidence.of(key).why
    assert evidence.of("wheel").verdict == "sound"


def test_without_a_way_nothing_is_judged(sound: Recording) -> None:
    evidence = weigh(replace(sound, encoder=None, encoder_sheet=None))
    assert {finding.verdict for finding in evidence.findings} == {"could not be judged"}


def test_the_acceleration_of_the_way_is_not_flattened_by_coarse_counts(sound: Recording) -> None:
    """Counts of 100 mm: the regression of what is true on what is smoothed keeps its slope."""
    fine, sheet = way_of(sound), sound.encoder_sheet
    assert fine is not None and sheet is not None and sound.encoder is not None
    step = round(0.1 / sheet.pulse_m)
    coarse = way_of(
        replace(
            sound,
            encoder=sound.encoder // step,
            encoder_sheet=replace(sheet, wheel_radius_m=sheet.wheel_radius_m * step),
        )
    )
    assert coarse is not None
    x = coarse.acceleration_mps2
    slope = float(x @ fine.acceleration_mps2 / (x @ x))
    assert slope == pytest.approx(1.0, abs=0.05)


def test_a_figure_whose_sd_nobody_knows_is_shown() -> None:
    found = Finding("factor", "gyro", 1.0, math.inf, 1.0, "s", "nothing", "could not be judged")
    assert found.shown == "1 s (sd unknown)"
    assert replace(found, sd=0.02, unit="1").shown == "1.000 +- 0.020"
