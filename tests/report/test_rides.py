"""What a page says of a ride: its title, its facts in metres and kilometres an hour, its rank."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from simrail.recording.recording import ImuSheet
from simrail.report.pages.rides import _rank_words, ride_facts, ride_title
from simrail.track.design import Straight, TrackDesign


def ridden(place: np.ndarray, cell: dict[str, object]) -> SimpleNamespace:
    """A ride at 100 Hz through places, on a line that is drawn."""
    time = pd.Index(np.arange(len(place)) / 100.0, name="time_s")
    speed = np.gradient(place, 0.01)
    recording = SimpleNamespace(
        name="there",
        imu_sheet=ImuSheet("mine", 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        mount="imu",
        mount_body="frame",
        mount_position_m=(1.0, 0.0, 0.6),
        odometry=None,
    )
    return SimpleNamespace(
        cell=cell,
        recording=recording,
        motion=pd.DataFrame({"position_m": place, "speed_mps": speed}, index=time),
        line=TrackDesign("line", 0.0, (Straight(500.0),)),
    )


def test_the_title_has_the_values_of_the_axes_and_not_the_imu() -> None:
    cell = {"cell": 3, "case": 1, "imu.grade": "tactical", "ride.speed_kmh": 70.0, "map": "exact"}
    title = ride_title(ridden(np.zeros(10), cell))  # type: ignore[arg-type]
    assert title.startswith("there \u00b7 ") and "70" in title and "tactical" not in title
    assert ride_title(ridden(np.zeros(10), {"map": "exact"})) == "there"  # type: ignore[arg-type]


def test_a_ride_is_told_by_its_way_and_its_speeds() -> None:
    """4 s at rest, 10 s at 10 m/s backwards: the mean is of what moves."""
    place = np.concatenate([np.full(400, 300.0), 300.0 - 0.1 * np.arange(1.0, 1002.0)])
    way, speed, *_ = ride_facts(ridden(place, {"map": "exact"}))  # type: ignore[arg-type]
    assert way == "100 m towards decreasing distance, 14 s"
    mean, most = (float(word) for word in speed.split() if word[0].isdigit())
    assert mean == pytest.approx(36.0, abs=0.1) and most == 36.0


def test_a_recording_has_its_rank_among_those_of_its_case() -> None:
    cells = pd.DataFrame({"cell": [0, 1, 2, 3, 4], "case": [7, 7, 7, 8, 9]})
    errors = pd.Series([0.1, 0.3, 0.2, 9.0], index=[0, 1, 2, 3])
    words = [_rank_words(number, errors, cells) for number in range(5)]
    assert words == [
        "number 3 of 3, the worst first",
        "the worst of 3",
        "number 2 of 3, the worst first",
        "",
        "",
    ]
    assert _rank_words(None, errors, cells) == _rank_words(0, errors, cells[["cell"]]) == ""
