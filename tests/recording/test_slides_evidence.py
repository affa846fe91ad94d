"""On a straight line a wheel that slides tells neither its size nor its clock; one that holds tells both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from simrail.recording.evidence import judge
from simrail.recording.evidence.devices import weigh_all
from simrail.recording.evidence.judge import weigh
from simrail.recording.evidence.model import INDEX, ride_of, start_values
from simrail.recording.evidence.slides import slides_left
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording
from simrail.track.design import Straight, TrackDesign
from tests.shared.planted_faults import PLANTS

BASE = Path(__file__).parents[1] / "field" / "cases" / "00-base" / "ride.toml"


@pytest.fixture(scope="module")
def straight() -> Recording:
    """Sets off after 5 s with 0.9 m/s2, and brakes so, with the sheets of the sound ride."""
    sound = read_signals(BASE)
    assert sound.encoder is not None and sound.encoder_sheet is not None
    time = np.arange(0.0, 50.0, 0.05)
    push = np.interp(
        time, [5.0, 6.5, 15.0, 16.5, 26.0, 27.5, 36.0, 37.5], [0.0, 0.9, 0.9, 0.0, 0.0, -0.9, -0.9, 0.0]
    )
    way = np.cumsum(np.cumsum(push) * 0.05) * 0.05
    index = pd.Index(time, name="time_s")
    sheet = sound.imu_sheet
    noise = np.random.default_rng(5).standard_normal((len(time), 6)) * np.sqrt(sheet.rate_hz)
    noise *= [*3 * [sheet.gyro_noise_radpsqrts], *3 * [sheet.accel_noise_mpsqrts]]
    imu = pd.DataFrame(noise, columns=sound.imu.columns, index=index)
    imu["accel_x_mps2"] += push
    imu["accel_z_mps2"] += sound.gravity_mps2
    pulses = np.rint(way / sound.encoder_sheet.pulse_m).astype(np.int64)
    track = TrackDesign("level_straight", 0.0, (Straight(1000.0),))
    return replace(
        sound,
        imu=imu,
        encoder=pd.DataFrame({"pulse_count": pulses}, index=index),
        track=track,
        start_position_m=50.0,
    )


def slid(sound: Recording) -> Recording:
    """Spins up by 1.1 m/s under power, and is held back by 1.6 m/s under the brake, as on leaves."""
    assert sound.encoder is not None and sound.encoder_sheet is not None
    excess = np.interp(
        sound.encoder.index,
        [10.3, 11.0, 15.0, 15.4, 30.0, 30.4, 34.0, 35.0],
        [0.0, 0.8, 1.1, 0.0, 0.0, -1.6, -1.2, 0.0],
    )
    more = np.rint(np.cumsum(excess) * 0.05 / sound.encoder_sheet.pulse_m).astype(np.int64)
    return replace(sound, encoder=(sound.encoder["pulse_count"] + more).to_frame())


@pytest.mark.long
def test_what_a_wheel_that_slides_seems_to_say_is_not_believed(
    straight: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fit that bends a factor, a clock and its drift around the slides leaves them as they were."""
    ride = ride_of(slid(straight))
    assert ride is not None
    x = start_values()
    x[INDEX["wheel"]], x[INDEX["offset"]] = 0.8, -0.11
    left = slides_left(ride, x)
    assert [round(0.5 * one.first) for one in left] == [10, 30]
    assert not weigh(ride.recording).wrong
    # Without the slides taken out and doubted, the factor would be told.
    bent = replace(weigh(ride.recording).of("wheel"), verdict="likely wrong")
    monkeypatch.setattr(judge, "_judged", lambda key, *rest: replace(bent, key=key))
    told = weigh(ride.recording)
    assert [finding.key for finding in told.wrong] == ["yaw", "pitch", "roll"]
    assert "the wheel spins or slides at 10 to 16 s and 30 to 35 s" in told.of("offset").why


def test_a_clock_that_explains_the_difference_leaves_no_slide(straight: Recording) -> None:
    ride = ride_of(PLANTS["offset"](straight, -2.0))
    assert ride is not None and slides_left(ride, start_values())
    x = start_values()
    x[INDEX["offset"]] = -2.0
    assert slides_left(ride, x) == ()


@pytest.mark.parametrize(("key", "size"), [("wheel", 2.0), ("offset", -2.0)])
def test_a_wheel_that_holds_there_tells_its_factor_and_its_clock(
    key: str, size: float, straight: Recording
) -> None:
    evidence = weigh_all(PLANTS[key](straight, size))
    assert [finding.key for finding in evidence.wrong] == [key]
    assert evidence.of(key).value == pytest.approx(size, rel=0.05)
