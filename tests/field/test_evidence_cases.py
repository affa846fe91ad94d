"""What people have recorded: factors, place, mounting and clocks that are wrong, found with their numbers.

Each case of `cases` is a ride as a logger wrote it, after a public report; its README says from where, and
what is right. ``00-base`` is the sound ride that the others are made from.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from simrail.estimators.attitude.ekf import AttitudeEkf

from simrail.cli.main import BAD_INPUT, call
from simrail.core.errors import InputError
from simrail.estimation.choose_odometry import with_odometry
from simrail.estimation.recorded_ride import judged_ride, read_ride
from simrail.recording.evidence.judge import Evidence, weigh
from simrail.recording.files.mend import write_mended
from simrail.recording.files.ride_reader import read_signals
from simrail.recording.recording import Recording

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


@pytest.mark.parametrize("case", WRONG)
def test_the_mended_file_is_accepted_and_says_what_is_right(case: str, tmp_path: Path) -> None:
    out = tmp_path / "mended.toml"
    changes = write_mended(CASES / case / "ride.toml", evidence_of(case), out)
    assert len(changes) == 1
    recording, evidence = judged_ride(out)
    assert not evidence.wrong
    # The sound ride is what the cases are made from: the odometry must come back to it.
    sound, _ = judged_ride(CASES / "00-base" / "ride.toml")
    assert recording.odometry is not None and sound.odometry is not None
    off = recording.odometry["position_m"] - sound.odometry["position_m"]
    # GNSS speeds of one a second, rounded to 0.1 km/h: some metres after 200 m.
    assert np.abs(off).max() < (8.0 if case.startswith("18") else 2.0)
    force = recording.imu["accel_x_mps2"] - sound.imu["accel_x_mps2"]
    assert np.sqrt(np.mean(force**2)) < 0.02
    rate = recording.imu["gyro_z_radps"] - sound.imu["gyro_z_radps"]
    assert np.sqrt(np.mean(rate**2)) < 0.002


def test_check_prints_the_findings_and_writes_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(CASES / "18-gnss-2-s-late", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    assert call(["check", "ride.toml"]) == BAD_INPUT
    shown = capsys.readouterr()
    assert "offset of the clock" in shown.out and "surely wrong" in shown.out
    assert "odometer.time_offset_s" in shown.err
    assert call(["check", "ride.toml", "--write", "mended.toml"]) == 0
    assert "odometer.time_offset_s = -2.0" in capsys.readouterr().out
    written = Path("mended.toml").read_bytes()
    assert call(["check", "ride.toml", "--write", "mended.toml"]) == BAD_INPUT
    assert "exists already" in capsys.readouterr().err
    assert Path("mended.toml").read_bytes() == written
    assert call(["check", "mended.toml"]) == 0
    assert "fine" in capsys.readouterr().out
    assert call(["check", "mended.toml", "--write", "again.toml"]) == 0
    assert "nothing is to be mended" in capsys.readouterr().out and not Path("again.toml").exists()


def test_a_ride_that_begins_at_speed_is_followed_from_its_first_sample() -> None:
    """38 km/h at first: speed within its sd, and a pitch that no invented acceleration bends."""
    recording = read_ride(CASES / "19-begins-moving" / "ride.toml")
    odometry = recording.odometry
    assert odometry is not None
    # By the sound ride at the same place, which came there from rest: 9.75 m/s.
    first = odometry.iloc[0]
    assert abs(first["speed_mps"] - 9.75) < 3.0 * first["speed_sd_mps"] < 1.0
    assert pitch_off_deg(recording) < 1.0


def pitch_off_deg(recording: Recording) -> float:
    """Largest pitch of an attitude filter beside the design's."""
    assert recording.odometry is not None
    estimated = AttitudeEkf(compensated=True).estimate(recording).states
    design = recording.track.frame(recording.odometry["position_m"].to_numpy())
    return float(np.abs(np.degrees(estimated["pitch_rad"].to_numpy() - design.pitch_rad)).max())


@pytest.mark.parametrize("odometry", ["curve_matched_hindsight", "curve_smoothed"])
def test_stamps_that_jitter_are_no_slip_to_an_odometry_that_knows_the_line(odometry: str) -> None:
    """Its readings are off by 35 mm, a pulse is 1.8 mm: taken for slip, the braking went into the pitch."""
    recording = with_odometry(read_signals(CASES / "19-begins-moving" / "ride.toml"), odometry)
    assert pitch_off_deg(recording) < 1.0
