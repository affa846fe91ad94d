"""What people have recorded: factors, place, mounting and clocks that are wrong, found with their numbers.

Each case of `cases` is a ride as a logger wrote it, after a public report; its README says from where, and
what is right. ``00-base`` is the sound ride that the others are made from.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from simrail.core.errors import InputError
from simrail.estimation.recorded_ride import judged_ride, read_ride
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.files.ride_reader import read_signals

CASES = Path(__file__).parent / "cases"

WRONG = {
    "02-gyro-x0.5": ("gyro", 0.5, 0.05),
    "02-gyro-x2": ("gyro", 2.0, 0.05),
    "03-diameter-for-radius": ("wheel", 0.5, 0.02),
    "05-start-100-m-off": ("shift", -100.0, 5.0),
    "10-mounted-yaw-30": ("yaw", 30.0, 2.0),
    "18-gnss-2-s-late": ("offset", -2.0, 0.1),
}
"""Case -> what is wrong, by how much, and how well it has to be found."""


def evidence_of(case: str) -> Evidence:
    return weigh(read_signals(CASES / case / "ride.toml"))


def test_the_sound_ride_is_accepted_without_a_word(recwarn: pytest.WarningsRecorder) -> None:
    _, evidence = judged_ride(CASES / "00-base" / "ride.toml")
    assert not evidence.wrong
    assert {finding.key for finding in evidence.findings if finding.verdict == "sound"} >= {
        "gyro",
        "wheel",
        "shift",
        "yaw",
        "pitch",
        "roll",
        "offset",
    }
    read_ride(CASES / "00-base" / "ride.toml")
    assert not [warning for warning in recwarn if "likely" in str(warning.message)]


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_found_with_its_number_and_nothing_else(case: str) -> None:
    key, right, slack = WRONG[case]
    evidence = evidence_of(case)
    assert [finding.key for finding in evidence.wrong] == [key]
    found = evidence.of(key)
    assert found.verdict == "surely wrong"
    assert abs(found.value - right) < slack
    assert found.sd < slack


@pytest.mark.parametrize("case", WRONG)
def test_it_is_refused_with_the_setting_that_mends_it(case: str) -> None:
    with pytest.raises(InputError) as refused:
        read_ride(CASES / case / "ride.toml")
    found = evidence_of(case).of(WRONG[case][0])
    message = str(refused.value)
    assert found.shown in message and found.setting in message and "--write" in message
    assert len(message.splitlines()) == 1
